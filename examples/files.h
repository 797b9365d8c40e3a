/* SPDX-License-Identifier: MIT */
/* files.h - what a command line says of recordings: files, folders, and the settings of recording.h: t=, q=, qd=, tau=, filter=,
   dt=. Included behind recording.h. Without folders, as with MSVC: -DNO_FOLDERS. */

#ifndef FILES_H
#define FILES_H

#if defined _MSC_VER && !defined NO_FOLDERS
#define NO_FOLDERS
#endif
#ifndef NO_FOLDERS
#include <dirent.h>
#endif

/* A key of the column map, dt= or filter= that a program is given becomes a part of w. Returns 0 if the key is none of them. */
static int read_key(wanted *w, const char *key, const char *value)
{
    int kind;
    for (kind = 0; kind < KINDS; kind++)
        if (strcmp(key, kind_names[kind]) == 0) {
            w->columns[kind] = *value ? value : NULL;
            return 1;
        }
    if (strcmp(key, "filter") == 0) {
        char *end;
        const double hz = strtod(value, &end);
        const int number_is = end != value && *end == 0 && hz > 0 && hz < 1e9;
        if (!number_is && strcmp(value, "off") != 0 && strcmp(value, "auto") != 0)
            fail("filter=%s: expected a frequency in Hz, off or auto\nhint: filter=10 keeps motion below 10 Hz", value);
        w->filter = number_is ? hz : *value == 'o' ? -1 : 0;
        return 1;
    }
    if (strcmp(key, "dt") == 0) {
        char *end;
        w->dt = strtod(value, &end);
        if (end == value || *end || !(w->dt > 0 && w->dt < 1e9))
            fail("dt=%s: expected seconds from sample to sample\nhint: dt=0.01, say", value);
        return 1;
    }
    return 0;
}

/* Files to read. */
typedef struct {
    const char **path;
    int count;
} file_list;

static void add_path(file_list *list, const char *path)
{
    list->path = extended((void *)list->path, (size_t)list->count, (size_t)list->count + 1, sizeof *list->path);
    list->path[list->count++] = path;
}

#ifndef NO_FOLDERS
/* Order of names, in which a number of more digits is larger: run2 before run10. */
static int by_name(const void *x, const void *y)
{
    const char *a = *(const char *const *)x, *b = *(const char *const *)y;
    while (*a && *b) {
        if (is_digit(*a) && is_digit(*b)) {
            const size_t m = strspn(a, "0123456789"), n = strspn(b, "0123456789");
            const int order = m != n ? (m > n) - (m < n) : strncmp(a, b, m);
            if (order != 0) return order;
            a += m, b += n;
        } else if (*a != *b) break;
        else a++, b++;
    }
    return (unsigned char)*a - (unsigned char)*b;
}

/* Nonzero if a name ends so, in capitals or not. */
static int ends_with(const char *name, const char *end)
{
    const size_t n = strlen(name), k = strlen(end);
    size_t i;
    for (i = 0; n > k && i < k && tolower((unsigned char)name[n - k + i]) == end[i];)
        i++;
    return n > k && i == k;
}

/* Nonzero if a name ends like that of a table of numbers, and not like those that train.c writes. */
static int is_table(const char *name)
{
    static const char *const ends[] = {".csv", ".tsv", ".txt", ".dat", ".log"};
    size_t i;
    if (*name == '.' || ends_with(name, "_errors.csv") || ends_with(name, "_next.csv")) return 0;
    for (i = 0; i < sizeof ends / sizeof *ends; i++)
        if (ends_with(name, ends[i])) return 1;
    return 0;
}

/* Adds the tables of a folder, in the order of their names. Returns 0 if it is no folder. */
static int add_folder(file_list *list, const char *path)
{
    DIR *const folder = opendir(path);
    const int had = list->count;
    int others = 0;
    struct dirent *e;
    if (!folder) return 0;
    while ((e = readdir(folder)) != NULL) {
        char *name;
        if (!is_table(e->d_name)) {
            others += *e->d_name != '.';
            continue;
        }
        name = room(strlen(path) + strlen(e->d_name) + 2, 1);
        sprintf(name, "%s%s%s", path, path[strlen(path) - 1] == '/' ? "" : "/", e->d_name);
        add_path(list, name);
    }
    closedir(folder);
    if (list->count == had)
        fail("%s: no file in it ends in .csv, .tsv, .txt, .dat or .log\nhint: name the files themselves", path);
    qsort((void *)(list->path + had), (size_t)(list->count - had), sizeof *list->path, by_name);
    if (others > 0) say("%s: %d other files are not read\n", path, others);
    return 1;
}
#endif

/* Adds a file, or all tables of a folder. */
static void add_files(file_list *list, const char *path)
{
#ifndef NO_FOLDERS
    if (*path && add_folder(list, path)) return;
#endif
    add_path(list, path);
}

#endif
