/* SPDX-License-Identifier: MIT */
/* Arduino.h - what the sketch uses of it, on a PC: Serial is stdout, loop runs once. */
#include <stdio.h>

struct serial {
    void begin(unsigned long) {}
    void print(const char *s) { printf("%s", s); }
    void print(int i) { printf("%d", i); }
    void print(unsigned long u) { printf("%lu", u); }
    void println() { printf("\n"); }
    void println(const char *s) { printf("%s\n", s); }
};
static serial Serial;

unsigned long micros() { return 0; }
void delay(unsigned long) {}
void setup();
void loop();

int main()
{
    setup();
    loop();
    return 0;
}
