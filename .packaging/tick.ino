/* SPDX-License-Identifier: MIT */
/* Once a second: measure, look one second ahead, tell how long that took. The weights lie in flash, all else is static;
   chain_weights.h is a chain of eight joints that roln learned from recordings. */
#include <Arduino.h>
#include "chain.h"
#include "chain_weights.h"

static chain_latent s;
static chain_work work;

void setup()
{
    Serial.begin(115200);
}

void loop()
{
    chain_state x = {{0.3f, 0.05f, -0.02f, 0.01f, 0.4f}, {0}}; /* measured q, qd */
    const unsigned long start = micros();
    roln_status st = chain_encode(&chain_weights, &x, &s, &work.encode);
    for (int k = 0; k < 200 && st == ROLN_OK; k++) /* NULL: no torque */
        st = chain_step(&chain_weights, &s, NULL, 0.005f, &work.step);
    if (st == ROLN_OK) st = chain_decode(&chain_weights, &s, &x, &work.decode);
    const unsigned long us = micros() - start;
    Serial.print("roln " ROLN_VERSION ": status ");
    Serial.print((int)st);
    Serial.print(", mrad:");
    for (int k = 0; k < chain_N; k++) {
        Serial.print(" ");
        Serial.print((int)(1000 * x.q[k]));
    }
    Serial.println();
    Serial.print(us);
    Serial.println(" us");
    delay(1000);
}
