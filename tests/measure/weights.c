/* SPDX-License-Identifier: MIT */
/* weights.c - MODEL.roln on standard input, MODEL_weights.h on standard output. A file without the range seen in training gets
   |z| <= 0.5, |zd| <= 0.5 / scale.t: that of the states that measure.c draws. */

#include <stdio.h>
#include "firmware.h"

static void put(void *ctx, const char *text)
{
    fputs(text, (FILE *)ctx);
}

int main(void)
{
    static unsigned char bytes[M(packed_size) + 1];
    static M(params) p;
    const int count = (int)fread(bytes, 1, sizeof bytes, stdin);
    if (M(unpack)(count, bytes, &p) != ROLN_OK) return 1;
    for (int i = 0; i < n && !(p.z_min[i] < p.z_max[i]); i++)
        p.z_min[i] = -0.5f, p.z_max[i] = 0.5f, p.zd_max[i] = 0.5f / p.scale.t;
    return M(write)(&p, put, stdout) != ROLN_OK;
}
