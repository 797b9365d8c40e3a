/* SPDX-License-Identifier: MIT */
/* net.h - a model of bench.c that learns, included for each behind NET, its name, and its options of roln.h but those below:
   NET_begin, NET_predict, NET_learn, as a row has them. r->more: windows of a batch. */
#define ROLN_NAME NET
#define ROLN_HORIZON HORIZON
#define ROLN_BLOCK BLOCK
#include "roln.h"

static struct {
    NET_(params) p;
    NET_(gradient) g;
    NET_(optimiser) o;
    union { NET_(start) start; NET_(work) work; NET_(train) train; } room;
    NET_(state) x, out;
    roln_real *data; /* q, then qd, of the windows of a batch */
} NET_(net);

static void NET_(begin)(const row *r)
{
    const int count = 2 * r->more * (HORIZON + 1) * NET_(N);
    memset(&NET_(net).o, 0, sizeof NET_(net).o);
    must(NET_(init)(&NET_(net).p, &seed, &NET_(net).room.start.init));
    free(NET_(net).data), NET_(net).data = reals(count);
    fill(count, ROLN_C(0.3), NET_(net).data);
    memcpy(&NET_(net).x, NET_(net).data, sizeof NET_(net).x);
}

/* encode, a step, decode */
ROLN_FN void NET_(predict)(const row *r)
{
    NET_(latent) s;
    (void)r;
    must(NET_(encode)(&NET_(net).p, &NET_(net).x, &s, &NET_(net).room.work.encode));
    must(NET_(step)(&NET_(net).p, &s, NULL, ROLN_C(1e-3), &NET_(net).room.work.step));
    must(NET_(decode)(&NET_(net).p, &s, &NET_(net).out, &NET_(net).room.work.decode));
}

/* Gradient of a batch and update, so small that every run does the same work. */
static void NET_(learn)(const row *r)
{
    static const roln_loss weights = ROLN_ODE_WEIGHTS;
    static const roln_opt opt = {
        .lr = {ROLN_C(1e-9), ROLN_C(1e-9), ROLN_C(1e-9)}, .beta1 = ROLN_C(0.9), .beta2 = ROLN_C(0.999), .eps = ROLN_C(1e-8),
        .decay = ROLN_C(2e-5), .clip = 5};
    const roln_batch b = {.count = r->more, .steps = HORIZON, .stride = 1, .q = NET_(net).data,
                          .qd = NET_(net).data + r->more * (HORIZON + 1) * NET_(N)};
    memset(&NET_(net).g, 0, sizeof NET_(net).g);
    must(NET_(grad)(&NET_(net).p, &weights, &b, ROLN_C(1e-3), &NET_(net).g, &NET_(net).room.train.grad));
    must(NET_(update)(&NET_(net).p, &opt, &NET_(net).o, &NET_(net).g, &NET_(net).room.train.update));
}
#undef NET
