/* weights.c - the C definition of a trained pend16, for flash:  weights MODEL.roln > pend16_weights.h */
#include <stdio.h>

#include "../../examples/pend16.h"

static void put(void *ctx, const char *text)
{
    fputs(text, (FILE *)ctx);
}

int main(int argc, char **argv)
{
    static unsigned char bytes[pend16_packed_size + 1];
    static pend16_params p;
    FILE *f = argc == 2 ? fopen(argv[1], "rb") : NULL;
    if (!f || pend16_unpack((int)fread(bytes, 1, sizeof bytes, f), bytes, &p) != ROLN_OK) {
        fprintf(stderr, "weights: no model of examples/pend16.h\n");
        return 1;
    }
    return pend16_write(&p, put, stdout) != ROLN_OK || fclose(stdout) != 0;
}
