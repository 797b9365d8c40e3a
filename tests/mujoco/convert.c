/* SPDX-License-Identifier: MIT */
/* convert - recordings in HDF5 become the CSV that examples/train.c reads.

     convert IN.h5 OUT.csv [q=NAME] [qd=NAME] [force=NAME] [t=NAME] [data=GROUP] [states=N] [dt=S]

   Layouts, of which the first that fits is taken:
     a group /data (data=) with a group or a link to one for each recording, of any name, as record, robomimic and MuJoCo's own
     tools write it, in the order demo_2, demo_10; /mask is not read
     arrays of equally long recordings [count,S,N] in /train, /test, /tune, as generate writes them: all of them, in this order
   Inside a recording, unless a name is given:
     q       q, qpos, obs/q, obs/qpos, obs/robot0_joint_pos, obs/joint_pos          qd likewise
     force   tau_model, tau, u, obs/tau, ctrl, actions: columns tau if there are N of them and they are called tau, else u; if
             there is none, or the name is empty, no such columns
     t       t, time, obs/t, obs/time; else dt= is needed
   states=N: q and qd of the first N joints are columns 1 .. 2N of `states`, MuJoCo's state of a machine of N joints, t is column 0.
   Quaternions (ball and free joints) are no joints: they must be left out of q.

   The CSV is read again by examples/recording.h. What the trainer refuses is refused here, with the line of the CSV, which is kept
   then. Angles may jump by turns, for a model with ROLN_ANGLES. A process of its own reads the HDF5, for the library may crash on a
   damaged file, or not end. Exit code 1: said in the last lines. */
#include <signal.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include "demos.h"
#include "recording.h"

static int usage(void)
{
    fprintf(stderr, "convert IN.h5 OUT.csv [q=NAME] [qd=NAME] [force=NAME] [t=NAME] [data=GROUP] [states=N] [dt=S]\n");
    return 1;
}

/* Whole text as a positive number, at most `most`; 0: it is none. */
static double positive(const char *text, double most)
{
    char *end;
    const double x = strtod(text, &end);
    return end != text && *end == 0 && x > 0 && x <= most ? x : 0;
}

/* Nonzero if there is a file that begins as HDF5 does. */
static int is_h5(const char *path)
{
    char begin[4] = "";
    FILE *f = fopen(path, "rb");
    const size_t n = f ? fread(begin, 1, sizeof begin, f) : 0;
    if (f) fclose(f);
    return n == sizeof begin && !memcmp(begin, "\211HDF", 4);
}

static int convert(const layout *want, const char *from, const char *to)
{
    demos d;
    if (demos_read_h5(&d, want, from)) return 1;
    for (int k = 0; k < d.count; k++) d.demo[k].test = 0;
    if (demos_write_csv(&d, 0, to)) return 1;
    const wanted w = {.model = "it", .N = d.N, .inputs = d.inputs ? d.forces : 0, .angles = ~0u};
    read_recordings(1, &to, &w);
    (void)add_noise, (void)smooth; /* are the trainer's */
    printf("%s: %d recordings of %d joints, %d columns %s\n", to, d.count, d.N, d.forces, d.inputs ? "u" : "tau");
    demos_free(&d);
    return 0;
}

/* In a process that has 20 s of a processor, and one more for each half megabyte. */
static int convert_apart(const layout *want, const char *from, const char *to)
{
    struct stat file;
    int status = 0;
    const pid_t child = fork();
    if (child == 0) {
        const rlim_t seconds = 20 + (stat(from, &file) == 0 ? (rlim_t)file.st_size >> 19 : 0);
        const struct rlimit time = {seconds, seconds}, core = {0, 0};
        setrlimit(RLIMIT_CPU, &time), setrlimit(RLIMIT_CORE, &core);
        exit(convert(want, from, to));
    }
    if (child < 0 || waitpid(child, &status, 0) != child) return perror("convert"), 1;
    if (WIFEXITED(status)) return WEXITSTATUS(status);
    demos_forget(to);
    fprintf(stderr, "%s: reading it ended with signal %d\nhint: possible cause: a damaged file, on which the HDF5 library crashes "
            "or does not end\n", from, WTERMSIG(status));
    return 1;
}

int main(int argc, char **argv)
{
    layout want = {NULL, NULL, NULL, NULL, NULL, 0, 0};
    const struct {
        const char *key, **to;
    } words[] = {{"q=", &want.q}, {"qd=", &want.qd}, {"force=", &want.force}, {"t=", &want.t}, {"data=", &want.data}};
    if (argc < 3) return usage();
    for (int i = 3; i < argc; i++) {
        size_t k = 0;
        while (k < 5 && strncmp(argv[i], words[k].key, strlen(words[k].key))) k++;
        if (k < 5) *words[k].to = argv[i] + strlen(words[k].key);
        else if (!strncmp(argv[i], "states=", 7) && positive(argv[i] + 7, 1e5) >= 1) want.states = (int)positive(argv[i] + 7, 1e5);
        else if (!strncmp(argv[i], "dt=", 3) && positive(argv[i] + 3, 1e6) > 0) want.dt = positive(argv[i] + 3, 1e6);
        else return fprintf(stderr, "%s: no such setting, or no positive number\n", argv[i]), usage();
    }
    if (is_h5(argv[2])) {
        fprintf(stderr, "%s: HDF5, which would be lost\nhint: the second name is that of the CSV; one file at a time\n", argv[2]);
        return 1;
    }
    return convert_apart(&want, argv[1], argv[2]);
}
