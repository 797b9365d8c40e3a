/* SPDX-License-Identifier: MIT */
/* processes.h - messages between the processes of a training that runs on several machines, by MPI.

   All processes run the same program with the same settings. Each computes a share of the rows, sums and roll-outs, and sends it to
   all others. Processes never add numbers of each other, so no sum depends on their count. All processes call the functions below
   in the same order, from their first thread.

   With -DROLN_MPI the functions call MPI. Without it there is one process, number 0, and they do nothing. Include recording.h
   first. */

#ifndef PROCESSES_H
#define PROCESSES_H

#ifdef ROLN_MPI
#include <mpi.h>
#endif

static int processes = 1, process; /* how many there are; the number of this one */
static int apart;                  /* nonzero: this process has work of its own, and no other can have the same error */

#ifdef ROLN_MPI
static int ending; /* the exit code after an error; 0: no error */

/* Gives process 0 time for the message if all processes have found the same error. Process 0 then ends this one. Signals do not
   shorten the time. */
static void let_first_speak(int code)
{
    struct timespec left = {10, 0};
    int waiting = process > 0 && !apart;
    ending = code;
    while (waiting)
        waiting = nanosleep(&left, &left) != 0;
}

/* Ends the other processes if this one calls exit() in the middle of the program. */
static void end_others(void)
{
    int ended = 0;
    MPI_Finalized(&ended);
    if (!ended) MPI_Abort(MPI_COMM_WORLD, ending ? ending : WRONG);
}
#endif

/* Call it first. From then on process 0 alone writes to stdout. */
static void begin_processes(void)
{
#ifdef ROLN_MPI
    int level;
    MPI_Init_thread(NULL, NULL, MPI_THREAD_FUNNELED, &level);
    MPI_Comm_size(MPI_COMM_WORLD, &processes), MPI_Comm_rank(MPI_COMM_WORLD, &process);
    before_end = let_first_speak;
    if (atexit(end_others) != 0) fail("atexit is out of room\nhint: start it again");
    if (process > 0 && !freopen("/dev/null", "w", stdout)) fail("cannot open /dev/null: %s\nhint: is it there?", strerror(errno));
#endif
}

/* Makes the functions below do nothing from here on. Process 0 calls it when the others have ended their work. */
static void leave_processes(void)
{
    processes = 1;
}

/* Ends this process and all others at once. */
static void end_at_once(int code)
{
#ifdef ROLN_MPI
    MPI_Abort(MPI_COMM_WORLD, code);
#endif
    _Exit(code);
}

/* Call it last. Returns the exit code. */
static int end_processes(int code)
{
#ifdef ROLN_MPI
    MPI_Finalize();
#endif
    return code;
}

/* Replaces each number of x [count] by the largest of all processes. No number may be NaN. */
static void largest(int count, double *x)
{
    if (processes == 1) return;
#ifdef ROLN_MPI
    MPI_Allreduce(MPI_IN_PLACE, x, count, MPI_DOUBLE, MPI_MAX, MPI_COMM_WORLD);
#endif
    (void)count, (void)x;
}

/* Returns the largest x of all processes. Decisions that depend on clocks or signals pass through this function. */
static int agreed(int x)
{
    double most = x;
    largest(1, &most);
    return (int)most;
}

/* Sends bytes of process `from` to all others. */
static void hand_out(int from, void *bytes, size_t count)
{
    char *at = bytes;
    size_t now;
    for (; processes > 1 && count > 0; at += now, count -= now) {
        now = count < INT_MAX ? count : INT_MAX;
#ifdef ROLN_MPI
        MPI_Bcast(at, (int)now, MPI_BYTE, from, MPI_COMM_WORLD);
#endif
    }
    (void)from, (void)at;
}

/* Combines bytes of all processes by a bitwise or. A process that does not know a byte passes 0. */
static void unite(void *bytes, size_t count)
{
    char *at = bytes;
    size_t now;
    for (; processes > 1 && count > 0; at += now, count -= now) {
        now = count < INT_MAX ? count : INT_MAX;
#ifdef ROLN_MPI
        MPI_Allreduce(MPI_IN_PLACE, at, (int)now, MPI_BYTE, MPI_BOR, MPI_COMM_WORLD);
#endif
    }
    (void)at;
}

/* Sends things of `size` bytes in base to all processes. Process p has things from[p] .. from[p + 1] - 1; from [processes + 1]. */
static void gather(void *base, size_t size, const int *from)
{
#ifdef ROLN_MPI
    MPI_Datatype thing;
    int *count, p;
    if (processes == 1) return;
    count = (int *)room((size_t)processes, sizeof *count);
    for (p = 0; p < processes; p++)
        count[p] = from[p + 1] - from[p];
    MPI_Type_contiguous((int)size, MPI_BYTE, &thing), MPI_Type_commit(&thing);
    MPI_Allgatherv(MPI_IN_PLACE, 0, MPI_DATATYPE_NULL, base, count, from, thing, MPI_COMM_WORLD);
    MPI_Type_free(&thing);
    free(count);
#endif
    (void)base, (void)size, (void)from;
}

/* Process p works on things cut_at(count, p) .. cut_at(count, p + 1) - 1 of `count`. */
static int cut_at(int count, int p)
{
    return (int)((int64_t)count * p / processes);
}

/* As gather, for `count` things that cut_at shares out. */
static void gather_cuts(void *base, size_t size, int count)
{
    int *from, p;
    if (processes == 1) return;
    from = room((size_t)processes + 1, sizeof *from);
    for (p = 0; p <= processes; p++)
        from[p] = cut_at(count, p);
    gather(base, size, from);
    free(from);
}

#endif
