/* SPDX-License-Identifier: MIT */
/* whole.h - files that are old or new, and never a part of either, whenever the power fails or the disk is full: written under
   another name, brought to the disk, then renamed. Without _POSIX_C_SOURCE the system decides when they are on the disk. */

#ifndef WHOLE_H
#define WHOLE_H

#include <errno.h>
#include <stdio.h>
#ifdef _POSIX_C_SOURCE
#include <unistd.h>
#endif

/* Closes a file that was written, once it is on the disk. Zero if not all of it is: errno. */
static int close_whole(FILE *f)
{
    int good = !ferror(f) && fflush(f) == 0;
#ifdef _POSIX_C_SOURCE
    good = good && (fsync(fileno(f)) == 0 || errno == EINVAL || errno == EROFS); /* not of a pipe or a device */
#endif
    return fclose(f) == 0 && good;
}

/* Closes f, which was written as the file `part`; that becomes the file `whole`. Zero if it cannot: errno, and the old file
   stays. */
static int put_whole(FILE *f, const char *part, const char *whole)
{
    int good = close_whole(f), why;
#ifdef _WIN32
    if (good) remove(whole); /* rename does not replace there */
#endif
    good = good && rename(part, whole) == 0;
    why = errno;
    if (!good) remove(part);
    errno = why;
    return good;
}

#endif
