/* SPDX-License-Identifier: MIT */
/* kept.h - a state that survives a reset at any moment, in the middle of a save too. Two copies lie in memory that start-up leaves
   alone (KEPT); the program works on one of them while the other, the last one saved, is whole. A save seals the copy at work with
   a number and an FNV-1a of all its bytes, then carries on in the other.

       static kept_mark marks[2] KEPT;
       static T states[2] KEPT;
       int i = kept_open(marks, states, sizeof *states, of);      -1: nothing saved, work on states[0]
       i = kept_save(marks, states, sizeof *states, i, of);       work on states[i] from now on

   of: any number of what the states go on from, a sum of the program's weights say. States saved of another one are not opened.

   In memory that keeps without power what is in it, FRAM say, it survives a power cut, too, in the middle of a word
   (tests/firmware/cuts.c). If memory is cached, keep these where it is not, or write the cache back in kept_settle. */
#ifndef KEPT_H
#define KEPT_H

#include "board.h"
#include "roln.h"

typedef struct { uint64_t number, sum; } kept_mark; /* number: of the save, from 1; 0: being worked on */

/* What was written before this line is in memory before what is written after it. */
static void kept_settle(void)
{
    __asm volatile("" ::: "memory");
}

static uint64_t kept_sum(uint64_t of, uint64_t number, const unsigned char *bytes, int size)
{
    return roln_fnv(size, bytes, roln_fnv((int)sizeof number, (const unsigned char *)&number, ROLN_FNV ^ of));
}

/* Leave copy i as it is and go on in the other one. */
static int kept_switch(kept_mark *marks, unsigned char *copies, int size, int i)
{
    marks[1 - i].number = 0;
    kept_settle();
    memcpy(copies + (1 - i) * size, copies + i * size, (size_t)size);
    return 1 - i;
}

/* Index of the copy to work on, equal to the newest whole one; -1: there is none. */
static int kept_open(kept_mark *marks, void *copies, int size, uint64_t of)
{
    unsigned char *bytes = (unsigned char *)copies;
    int newest = -1;
    for (int i = 0; i < 2; i++)
        if (marks[i].number > 0 && marks[i].sum == kept_sum(of, marks[i].number, bytes + i * size, size)) {
            if (newest < 0 || marks[i].number > marks[newest].number) newest = i;
        } else
            marks[i].number = 0;
    return newest < 0 ? -1 : kept_switch(marks, bytes, size, newest);
}

/* Save copy i; returns the index of the copy to work on from now on. */
static int kept_save(kept_mark *marks, void *copies, int size, int i, uint64_t of)
{
    unsigned char *bytes = (unsigned char *)copies;
    const uint64_t number = marks[1 - i].number + 1;
    kept_settle();
    marks[i].sum = kept_sum(of, number, bytes + i * size, size);
    kept_settle();
    marks[i].number = number;
    kept_settle();
    return kept_switch(marks, bytes, size, i);
}

#endif
