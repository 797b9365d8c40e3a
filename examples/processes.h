/* SPDX-License-Identifier: MIT */
/* processes.h - the processes of a training that runs on several machines (MPI), and what they tell each other.

   All processes run the same program on the same settings in lockstep. Each computes a share of the rows, sums and roll-outs, and
   all get the results. Nothing is added up between processes, so no sum depends on how many there are. The functions below are
   called by all processes in the same order, from the first thread.

   With -DROLN_MPI they call MPI. Without it there is one process, number 0, and they return what they are given. Included behind
   recording.h. */

#ifndef PROCESSES_H
#define PROCESSES_H

#ifdef ROLN_MPI
#include <mpi.h>
#endif

static int processes = 1, process; /* how many there are; the number of this one */
static int apart;                  /* nonzero: this process does what no other does, so its messages are its own */

#ifdef ROLN_MPI
static int ending; /* exit code of a program that fails; 0: none failed */

/* Process 0 says what all processes have found, and ends them. Another one says it if process 0 does not within this time. */
static void let_first_speak(int code)
{
    const struct timespec patience = {2, 0};
    ending = code;
    if (process > 0 && !apart) nanosleep(&patience, NULL);
}

/* Behind exit() in the middle of a program: the other processes end, too. */
static void end_others(void)
{
    int ended = 0;
    MPI_Finalized(&ended);
    if (!ended) MPI_Abort(MPI_COMM_WORLD, ending ? ending : WRONG);
}
#endif

/* Call it first. Process 0 alone writes to stdout. */
static void begin_processes(void)
{
#ifdef ROLN_MPI
    int level;
    MPI_Init_thread(NULL, NULL, MPI_THREAD_FUNNELED, &level);
    MPI_Comm_size(MPI_COMM_WORLD, &processes), MPI_Comm_rank(MPI_COMM_WORLD, &process);
    before_end = let_first_speak;
    if (atexit(end_others) != 0) fail("atexit is out of room");
    if (process > 0 && !freopen("/dev/null", "w", stdout)) fail("cannot open /dev/null");
#endif
}

/* From here on process 0 is alone: calls of the functions below concern no other process. */
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

/* x [count] becomes the largest of all processes, number by number; no NaN. */
static void largest(int count, double *x)
{
    if (processes == 1) return;
#ifdef ROLN_MPI
    MPI_Allreduce(MPI_IN_PLACE, x, count, MPI_DOUBLE, MPI_MAX, MPI_COMM_WORLD);
#endif
    (void)count, (void)x;
}

/* The largest x of all processes. What clocks and signals decide passes through here. */
static int agreed(int x)
{
    double most = x;
    largest(1, &most);
    return (int)most;
}

/* Bytes of process `from` go to all others. */
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

/* Bytes that are 0 but in the processes that know them become the same everywhere: their bits are united by or. */
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

/* Things of `size` bytes in base: process p has written from[p] .. from[p + 1] - 1, and all get all of them. from [processes + 1] */
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

/* Of `count` things process p works on cut(count, p) .. cut(count, p + 1) - 1. */
static int cut_at(int count, int p)
{
    return (int)((int64_t)count * p / processes);
}

/* As gather, of `count` things that are shared out so. */
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
