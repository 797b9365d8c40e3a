/* SPDX-License-Identifier: MIT */
/* bytes.c - whatever bytes come, however many, NAME_unpack reads no byte beyond them and leaves the parameters alone unless it
   returns ROLN_OK; and NAME_check reads nothing but the parameters, whatever its state and its count. */

#include "eva.h"
#include "furuta.h"
#include "pend16.h"

volatile int any;

enum { HEAD = 64 }; /* bytes that are read before the length is known to be right: at most */

#define BYTES(name) \
    static unsigned char name##_bytes[name##_packed_size], name##_first[HEAD]; \
    static name##_params name##_to; \
    static void name##_untouched(roln_status st) \
    { \
        int i; \
        const roln_bits *to = (const roln_bits *)&name##_to; \
        for (i = 0; st != ROLN_OK && i < name##_numbers; i++) \
            as_it_was(to[i]); \
    } \
    static void name##_unpacked(void) \
    { \
        int count; \
        EVA_ANY(name##_bytes), EVA_ANY(name##_first); \
        memset(&name##_to, 0x55, sizeof name##_to); \
        for (count = 0; count < HEAD; count++) /* they end where the array ends */ \
            name##_untouched(name##_unpack(count, name##_first + (HEAD - count), &name##_to)); \
        count = any; \
        if (count < 0) name##_untouched(name##_unpack(count, NULL, &name##_to)); \
        else if (count == name##_packed_size) name##_untouched(name##_unpack(count, name##_bytes, &name##_to)); \
        else if (count >= HEAD && count < name##_packed_size) name##_untouched(name##_unpack(count, name##_first, &name##_to)); \
        else if (count > name##_packed_size) name##_untouched(name##_unpack(count, name##_first, &name##_to)); \
    } \
    static roln_check name##_at; \
    static void name##_checked(void) \
    { \
        int at; \
        EVA_ANY(name##_to); \
        for (at = -1; at <= name##_numbers; at++) { \
            EVA_ANY(name##_at); \
            if (at >= 0 && at < name##_numbers) name##_at.at = at; \
            else if (name##_at.at >= 0 && name##_at.at < name##_numbers) continue; \
            name##_check(&name##_to, any, &name##_at); \
        } \
    }

static void as_it_was(roln_bits b)
{
    /*@ assert untouched: b == 0x55555555; */
    (void)b;
}

BYTES(furuta)
BYTES(pend16)

int main(void)
{
    furuta_unpacked();
    pend16_unpacked();
    furuta_checked();
    /*@ assert ended: \true; */
    return 0;
}
