/* SPDX-License-Identifier: MIT */
/* image.c - starts images, and talks to them. */
#include <errno.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <sys/wait.h>
#include <unistd.h>

#include "image.h"

enum { SILENCE = 60 }; /* s without an answer: the image is dead */

void image_stop(struct image_line *l)
{
    kill(l->pid, SIGKILL);
    waitpid(l->pid, NULL, 0);
    close(l->line);
}

int image_put(const struct image_line *l, int count, const uint8_t *bytes)
{
    while (count > 0) {
        const ssize_t written = write(l->line, bytes, (size_t)count);
        if (written < 0 && errno != EINTR) return -1;
        if (written > 0) bytes += written, count -= (int)written;
    }
    return 0;
}

int image_get(const struct image_line *l, int count, uint8_t *bytes)
{
    return recv(l->line, bytes, (size_t)count, MSG_WAITALL) == count ? 0 : -1;
}

int image_start(struct image_line *l, const char *core, const char *name)
{
    const struct timeval silence = {SILENCE, 0};
    char path[80];
    int line[2];
    memset(l, 0, sizeof *l);
    snprintf(path, sizeof path, "build/firmware/%s/examples/firmware/%s.elf", core, name);
    fflush(stdout);
    if (socketpair(AF_UNIX, SOCK_STREAM, 0, line) || (l->pid = fork()) < 0) return -1;
    if (l->pid == 0) {
        prctl(PR_SET_PDEATHSIG, SIGKILL);
        if (dup2(line[1], 0) == 0 && dup2(line[1], 1) == 1 && !close(line[0]) && !close(line[1]))
            execlp("sh", "sh", "examples/firmware/run.sh", core, path, (char *)NULL);
        perror("run.sh");
        _exit(1);
    }
    close(line[1]);
    l->line = line[0];
    if (!setsockopt(l->line, SOL_SOCKET, SO_RCVTIMEO, &silence, sizeof silence)) return 0;
    image_stop(l);
    return -1;
}
