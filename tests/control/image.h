/* SPDX-License-Identifier: MIT */
/* image.h - a firmware image in QEMU, or on this machine, at the end of an emulated serial line. */
#ifndef IMAGE_H
#define IMAGE_H

#include <stdint.h>
#include <sys/types.h>

struct image_line {
    pid_t pid;
    int line; /* socket: standard input and output of QEMU */
};

/* Starts examples/firmware/NAME.elf on a core. It dies with this process, however that ends. 0, or -1. */
int image_start(struct image_line *l, const char *core, const char *name);
void image_stop(struct image_line *l);

/* So many bytes to it, and from it; -1: it does not take them, or is silent for a minute. */
int image_put(const struct image_line *l, int count, const uint8_t *bytes);
int image_get(const struct image_line *l, int count, uint8_t *bytes);

#endif
