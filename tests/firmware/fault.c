/* SPDX-License-Identifier: MIT */
/* fault.c - what happens when a program goes wrong: FAULT 1 an undefined instruction, 2 a read where there is nothing, 3 a stack
   that grows beyond its end. Each first calls board_safe, then says where it was, then ends. */
#include "text.h"

void board_safe(void)
{
    put_text("motors off");
}

__attribute__((noipa)) static uint32_t deeper(uint32_t n)
{
    volatile uint32_t a[256];
    a[n & 255] = n;
    return n == 0 ? 0 : deeper(n - 1) + a[n & 255];
}

int main(void)
{
    put_text("begin\n");
    if (FAULT == 1) __builtin_trap();
    if (FAULT == 2) return (int)*(volatile uint32_t *)UINT32_C(0xf0000000);
    return (int)deeper(1000);
}
