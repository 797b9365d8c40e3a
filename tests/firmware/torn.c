/* SPDX-License-Identifier: MIT */
/* torn.c - a save (kept.h) that a reset interrupts after 1, 2, 3, .. instructions until it comes to its end: the state found after
   every reset is whole, and the one before or the one being saved. Cortex-M; with -Wl,--wrap=systick, so that SysTick resets. */
#include "kept.h"
#include "text.h"

typedef struct { uint32_t value, fill[15]; } state;
static kept_mark marks[2] KEPT;
static state states[2] KEPT;
static struct { uint32_t magic, trial, value, old, new; } test KEPT;

void __wrap_systick(void);
void __wrap_systick(void)
{
    board_reset();
}

#define REGISTER(address) (*(volatile uint32_t *)(address))

int main(void)
{
    int i = kept_open(marks, states, (int)sizeof *states, 0);
    if (test.magic != 0x600d) { /* power-up: two saves without a reset */
        memset(&test, 0, sizeof test);
        memset(states, 0, sizeof states);
        i = kept_save(marks, states, (int)sizeof *states, 0, 0);
        i = kept_save(marks, states, (int)sizeof *states, i, 0);
        test.magic = 0x600d;
    }
    if (i < 0) {
        put_text("both copies lost\n");
        return 1;
    }
    state *s = &states[i];
    for (uint32_t k = 0; k < 15; k++)
        if (s->fill[k] != s->value * (k + 1)) {
            put_text("a torn state\n");
            return 1;
        }
    if (s->value != test.value && s->value != test.value + 1) {
        put_text("neither the old state nor the new one\n");
        return 1;
    }
    if (test.trial > 0) {
        if (s->value == test.value) test.old++;
        else test.new++;
    }
    test.value = s->value;
    test.trial++;

    REGISTER(0xe000e014) = test.trial * 6 + 30; /* one instruction takes 5 to 8 ticks */
    REGISTER(0xe000e018) = 0;
    REGISTER(0xe000e010) = 7;
    kept_settle(); /* the state changes after this line */
    s->value++;
    for (uint32_t k = 0; k < 15; k++)
        s->fill[k] = s->value * (k + 1);
    kept_save(marks, states, (int)sizeof *states, i, 0);
    REGISTER(0xe000e010) = 0;

    put_text("resets before the save counted: ");
    put_integer(test.old, 0);
    put_text(", after: ");
    put_integer(test.new, 0);
    put_text("\n");
    return test.old < 100 || test.new < 10;
}
