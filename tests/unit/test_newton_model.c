/* SPDX-License-Identifier: MIT */
/* Riemannian Gauss-Newton of models (NAME_newton_rows, _sums, _step, _judge; the step itself: test_newton.c): two links are learned
   from samples, windows through an autoencoder; every verb is the kernel on the table of its model; sizes, and counts that do not
   fit. */
#define ROLN_NAME leg /* two links, no autoencoder */
#define ROLN_AE 2
#define ROLN_MLP 10, 10
#define ROLN_GN_ROWS 360
#include "roln.h"

#define ROLN_NAME hand /* every manifold, all of it learned; systems of either kind */
#define ROLN_AE 5, 4, 2
#define ROLN_CHART polynomial, 2
#define ROLN_MLP 5
#define ROLN_LAYERS gyro, gyro
#define ROLN_BASE 1
#define ROLN_DAMPING 1
#define ROLN_INPUTS 2
#define ROLN_HORIZON 3
#define ROLN_BLOCK 2
#define ROLN_GN_ROWS 230
#define ROLN_LEARN everything
#include "roln.h"

#define ROLN_NAME palm /* the same, its networks alone */
#define ROLN_AE 5, 4, 2
#define ROLN_CHART polynomial, 2
#define ROLN_MLP 5
#define ROLN_LAYERS gyro, gyro
#define ROLN_BASE 1
#define ROLN_DAMPING 1
#define ROLN_INPUTS 2
#define ROLN_HORIZON 3
#define ROLN_BLOCK 2
#define ROLN_GN_ROWS 13
#define ROLN_LEARN networks
#include "roln.h"

#define ROLN_NAME toe /* polynomials of two numbers and an angle */
#define ROLN_AE 3
#define ROLN_ANGLES 0, 1, 0
#define ROLN_POLYNOMIALS 3, 4
#define ROLN_MASS squares, 4
#define ROLN_DAMPING 1
#define ROLN_GN_ROWS 40
#include "roln.h"

#define ROLN_NAME heel /* the same behind an autoencoder, M an exponential */
#define ROLN_AE 4, 3
#define ROLN_POLYNOMIALS 2, 3
#define ROLN_GN_ROWS 40
#define ROLN_LEARN everything
#include "roln.h"

#include "manifolds.h"
#include "room.h"

void TEST_NAME(newton_model)(void);

#define CHECK_OK(call) CHECK((call) == ROLN_OK)

/* ---- two links -------------------------------------------------------------------------------- */

enum { POSES = 120 };
static roln_real pose_q[2 * POSES], pose_qd[2 * POSES], pose_qdd[2 * POSES], pose_tau[2 * POSES];

/* Two uniform rods of 1 kg and 1 m, the first angle from hanging, the second from the first: M qdd = tau - c - g. Without gravity
   nothing depends on the first. */
static void two_links(double gravity, uint64_t *s)
{
    int k, i;
    for (k = 0; k < POSES; k++) {
        roln_real *q = pose_q + 2 * k, *qd = pose_qd + 2 * k, *tau = pose_tau + 2 * k;
        double a, b, M11, M12, f1, f2, det;
        for (i = 0; i < 2; i++) {
            q[i] = 3 * roln_uniform(s) - ROLN_C(1.5), qd[i] = 4 * roln_uniform(s) - 2;
            tau[i] = 10 * roln_uniform(s) - 5;
        }
        a = (double)q[0], b = (double)q[1], M11 = 5.0 / 3 + cos(b), M12 = 1.0 / 3 + cos(b) / 2;
        f1 = (double)tau[0] + sin(b) / 2 * (2 * (double)qd[0] + (double)qd[1]) * (double)qd[1] -
             gravity * (1.5 * sin(a) + sin(a + b) / 2);
        f2 = (double)tau[1] - sin(b) / 2 * (double)qd[0] * (double)qd[0] - gravity * sin(a + b) / 2;
        det = M11 / 3 - M12 * M12;
        pose_qdd[2 * k] = (roln_real)((f1 / 3 - M12 * f2) / det), pose_qdd[2 * k + 1] = (roln_real)((M11 * f2 - M12 * f1) / det);
    }
}

static const roln_newton begin = ROLN_NEWTON_START;
static const roln_newton_opt usual = ROLN_NEWTON_OPT;

/* Mean of |zdd_pred - zdd|^2 over all poses, as the gradient sums it. */
static ld pose_error(const leg_params *p, const roln_loss *weights, leg_train *train)
{
    static leg_gradient g;
    const roln_batch all = {.count = POSES, .stride = 1, .q = pose_q, .qd = pose_qd, .qdd = pose_qdd, .tau = pose_tau};
    memset(&g, 0, sizeof g);
    CHECK_OK(leg_grad_acc(p, weights, &all, &g, &train->grad_acc));
    return (ld)g.loss.zdd / POSES;
}

/* The coordinate 0 is ignorable: the first rows of the first layers are 0, and no others. */
static void check_ignored(const leg_params *p)
{
    const roln_lnn *f = &leg_model.lnn;
    const roln_real *const nets[2] = {p->theta, p->theta + roln_mlp_params(&f->mass_net)};
    int k, i;
    CHECK(leg_ignores(p, 0) && !leg_ignores(p, 1) && !leg_ignores(p, -1) && !leg_ignores(p, 2));
    for (k = 0; k < 2; k++)
        for (i = 0; i < 2 * f->mass_net.size[1]; i++) CHECK((nets[k][i] == 0) == (i < f->mass_net.size[1]));
}

/* Two links from random weights: what is left of the mean square of the errors of acceleration. */
static void check_learning(int ignored, int count, roln_real memory, int steps, ld most, uint64_t s)
{
    static const roln_loss weights = {.zdd = 1};
    static leg_start init;
    static leg_params p;
    static leg_residuals g;
    static leg_newton o;
    static leg_train train;
    static int start[360];
    roln_batch b = {.count = count, .stride = 1, .start = start, .q = pose_q, .qd = pose_qd, .qdd = pose_qdd, .tau = pose_tau};
    roln_newton_opt opt = usual;
    roln_real qbar[2];
    ld first;
    int k, i, taken = 0;
    two_links(ignored ? 0 : 9.81, &s);
    CHECK_OK(leg_init_pod(&p, POSES, pose_q, pose_qd, qbar, &s, &init.init_pod));
    if (ignored) CHECK_OK(leg_ignore(&p, 0));
    memset(&g, 0, sizeof g), memset(&o, 0, sizeof o);
    o.state = begin, opt.memory = memory, g.seed = s;
    first = pose_error(&p, &weights, &train);
    for (k = 0; k < steps; k++, g.seed += (uint64_t)count) {
        for (i = 0; i < count; i++) start[i] = (k * count + i) % POSES;
        CHECK_OK(leg_rows(&p, &weights, &b, 1, 0, 0, &g, &train.rows));
        CHECK_OK(leg_newton_rows(&p, &opt, count, &g, &o));
        leg_newton_normal_equations(&opt, count, 0, leg_newton_side, &g, &o, o.work.sums);
        for (taken = i = 0; i < 30 && !taken; i++) {
            CHECK_OK(leg_newton_step(&p, &opt, count, &g, &o));
            (void)leg_rows(&o.next, &weights, &b, 1, 0, 1, &g, &train.rows); /* a model that fails there is refused */
            taken = leg_newton_accept(&p, count, count, &g, &o);
        }
    }
    CHECK((int)o.state.taken == steps && o.state.refused > 0);
    BOUND("two links, loss, last / first", pose_error(&p, &weights, &train) / first, most);
    if (ignored) check_ignored(&p);
}

/* Riemannian Adam keeps an ignorable coordinate, too, and so do packed bytes. What is no coordinate is refused. */
static void test_ignored(void)
{
    static const roln_loss weights = {.zdd = 1};
    static leg_start init;
    static leg_params p, q;
    static leg_optimiser o;
    static leg_gradient g;
    static leg_train train;
    static unsigned char bytes[leg_packed_size];
    const roln_batch all = {.count = POSES, .stride = 1, .q = pose_q, .qd = pose_qd, .qdd = pose_qdd, .tau = pose_tau};
    const roln_opt opt = ROLN_OPT(ROLN_C(0.02), ROLN_C(0.01));
    roln_real qbar[2];
    uint64_t s = 3;
    ld first = 0;
    int k;
    two_links(0, &s);
    CHECK_OK(leg_init_pod(&p, POSES, pose_q, pose_qd, qbar, &s, &init.init_pod));
    q = p;
    CHECK(leg_ignore(&p, -1) == ROLN_E_LENGTH && leg_ignore(&p, 2) == ROLN_E_LENGTH && memcmp(&p, &q, sizeof p) == 0);
    CHECK(!leg_ignores(&p, 0) && !leg_ignores(&p, 1));
    CHECK_OK(leg_ignore(&p, 0));
    for (k = 0; k < 300; k++) {
        memset(&g, 0, sizeof g);
        CHECK_OK(leg_grad_acc(&p, &weights, &all, &g, &train.grad_acc));
        if (k == 0) first = (ld)g.loss.zdd;
        CHECK_OK(leg_update(&p, &opt, &o, &g, &train.update));
    }
    BOUND("two links by Adam, loss, last / first", (ld)g.loss.zdd / first, 0.05L);
    check_ignored(&p);
    leg_pack(&p, bytes);
    CHECK_OK(leg_unpack(leg_packed_size, bytes, &q));
    check_ignored(&q);
    CHECK_OK(leg_ignore(&p, 1));
    CHECK(leg_ignores(&p, 0) && leg_ignores(&p, 1));
}

static void test_learning(void)
{
    uint64_t s;
    for (s = 1; s <= 2; s++) {
        check_learning(0, 360, 1, 60, 1e-3L, s);
        check_learning(0, 60, 8, 100, 1e-5L, s); /* fewer than parameters, but remembered */
        check_learning(0, 40, 10, 200, 3e-4L, s); /* the system of the rows */
        check_learning(1, 60, 8, 100, 1e-5L, s);
        check_learning(1, 40, 10, 200, 3e-4L, s);
    }
}

/* ---- windows through an autoencoder ------------------------------------------------------------ */

/* Two oscillators seen through five channels, and inputs that do nothing. */
enum { SEEN = 300, COUNT = 230, DUAL = 20 };
static roln_real seen_q[5 * SEEN], seen_qd[5 * SEEN], seen_u[2 * SEEN];
static int seen_start[COUNT];
static const roln_real tick = ROLN_C(0.05);

static void oscillators(uint64_t *s)
{
    int k, c;
    for (k = 0; k < SEEN; k++)
        for (c = 0; c < 5; c++) {
            const double a = cos(k * 0.05), ad = -sin(k * 0.05), b = sin(k * 0.07 + 1), bd = 1.4 * cos(k * 0.07 + 1);
            const double e = 0.4 * (c - 2), f = 0.6 * (c % 3 - 1), odd = c % 2;
            seen_q[k * 5 + c] = (roln_real)(e * a + f * b + 0.1 * a * a * odd);
            seen_qd[k * 5 + c] = (roln_real)(e * ad + f * bd + 0.2 * a * ad * odd);
            if (c < 2) seen_u[k * 2 + c] = roln_uniform(s) - ROLN_C(0.5);
        }
    for (k = 0; k < COUNT; k++) seen_start[k] = roln_randint(SEEN - 3, s);
}

/* All that a learning hand keeps. */
typedef struct {
    hand_params p;
    hand_residuals g;
    hand_newton o;
} hand_all;
static hand_all hand_a, hand_b;
static hand_train hand_scratch;
static const roln_loss hand_weights = ROLN_ODE_WEIGHTS;

static roln_batch hand_batch(int from, int count)
{
    const roln_batch b = {
        .count = count, .steps = 3, .stride = 1, .start = seen_start + from, .q = seen_q, .qd = seen_qd, .tau = seen_u};
    return b;
}

static void hand_begin(hand_all *h, uint64_t s)
{
    static hand_start init;
    roln_real qbar[5];
    memset(h, 0, sizeof *h);
    oscillators(&s);
    CHECK_OK(hand_init_pod(&h->p, SEEN, seen_q, seen_qd, qbar, &s, &init.init_pod));
    h->o.state = begin, h->g.seed = s;
}

/* A step up to where NAME_newton_accept decides. */
static void hand_try(hand_all *h, const roln_newton_opt *opt, int count)
{
    const roln_batch b = hand_batch(0, count);
    CHECK_OK(hand_newton_step(&h->p, opt, count, &h->g, &h->o));
    (void)hand_rows(&h->o.next, &hand_weights, &b, tick, 0, 1, &h->g, &hand_scratch.rows);
}

/* New rows and their sums. */
static void hand_look(hand_all *h, const roln_newton_opt *opt, int count)
{
    const roln_batch b = hand_batch(0, count);
    CHECK_OK(hand_rows(&h->p, &hand_weights, &b, tick, 0, 0, &h->g, &hand_scratch.rows));
    CHECK_OK(hand_newton_rows(&h->p, opt, count, &h->g, &h->o));
    hand_newton_normal_equations(opt, count, 0, hand_newton_side, &h->g, &h->o, h->o.work.sums);
}

/* Steps that are taken, whatever damping they need. */
static void hand_learn(hand_all *h, const roln_newton_opt *opt, int count, int steps)
{
    for (; steps > 0; steps--, h->g.seed += 1000) {
        int tries = 0;
        hand_look(h, opt, count);
        do hand_try(h, opt, count);
        while (!hand_newton_accept(&h->p, count, count, &h->g, &h->o) && ++tries < 30);
        CHECK(tries < 30);
    }
}

static ld hand_error(const hand_params *p)
{
    static hand_gradient g;
    const roln_batch b = hand_batch(0, COUNT);
    memset(&g, 0, sizeof g);
    CHECK_OK(hand_grad(p, &hand_weights, &b, tick, &g, &hand_scratch.grad));
    return (ld)roln_loss_total(&hand_weights, &g.loss) / COUNT;
}

/* Every pair, and that the encoder undoes the decoder. */
static void check_hand(const hand_params *p)
{
    static hand_work work;
    hand_latent z = {{ROLN_C(0.25), -ROLN_C(0.5)}, {ROLN_C(0.125), ROLN_C(0.75)}}, y;
    hand_state x;
    int i;
    BOUND("pairs of the hand, eps", defect(4, 5, p->theta) / EPS, 2);
    BOUND("pairs of the hand, eps", defect(2, 4, p->theta + 45) / EPS, 2);
    CHECK_OK(hand_decode(p, &z, &x, &work.decode));
    CHECK_OK(hand_encode(p, &x, &y, &work.encode));
    for (i = 0; i < 2; i++) BOUND("left inverse, eps", (fabsl((ld)(y.z[i] - z.z[i])) + fabsl((ld)(y.zd[i] - z.zd[i]))) / EPS, 20);
}

/* Windows of the whole model, autoencoder and all: it learns; 6 steps and 6 more, from copies of what is said to be enough, are
   12. */
static void check_resume(int count, roln_real memory)
{
    roln_newton_opt opt = usual;
    ld first;
    opt.memory = memory;
    hand_begin(&hand_a, 11);
    first = hand_error(&hand_a.p);
    hand_learn(&hand_a, &opt, count, 6);
    memset(&hand_b, 0, sizeof hand_b);
    hand_b.p = hand_a.p, hand_b.o.state = hand_a.o.state, hand_b.g.seed = hand_a.g.seed;
    memcpy(hand_b.o.S, hand_a.o.S, sizeof hand_a.o.S);
    memcpy(hand_b.o.carried, hand_a.o.carried, sizeof hand_a.o.carried);
    hand_learn(&hand_a, &opt, count, 6), hand_learn(&hand_b, &opt, count, 6);
    CHECK(memcmp(&hand_a.p, &hand_b.p, sizeof hand_a.p) == 0 && memcmp(&hand_a.o.state, &hand_b.o.state, sizeof begin) == 0);
    CHECK(same(hand_newton_size, hand_a.o.carried, hand_b.o.carried));
    CHECK(hand_a.o.state.taken == 12);
    BOUND("windows, loss, last / first", hand_error(&hand_a.p) / first, count == COUNT ? 0.15L : 0.6L);
    check_hand(&hand_a.p);
}

/* Rows in pieces, sums in two halves, each verb of the shell and what it stands for, after steps of `before` rows. */
static void check_hand_pieces(int before, int count, roln_newton_opt opt)
{
    const int side = ROLN_NEWTON_SIDE(count, hand_newton_size), cut = 7 * side / 10, P = hand_newton_size;
    static roln_real other_work[ROLN_SYM_WORK];
    const roln_newton_system system = {count, P, hand_b.g.J, hand_b.g.r, hand_b.o.S};
    roln_batch b;
    hand_begin(&hand_a, 12);
    hand_learn(&hand_a, &opt, before, 3);
    hand_b = hand_a;
    hand_look(&hand_a, &opt, count), hand_try(&hand_a, &opt, count);
    b = hand_batch(0, 7);
    CHECK_OK(hand_rows(&hand_b.p, &hand_weights, &b, tick, 0, 0, &hand_b.g, &hand_scratch.rows));
    b = hand_batch(7, count - 7);
    CHECK_OK(hand_rows(&hand_b.p, &hand_weights, &b, tick, 7, 0, &hand_b.g, &hand_scratch.rows));
    memcpy(hand_b.g.J + count * P, hand_b.o.carried, sizeof hand_b.o.carried);
    CHECK_OK(roln_newton_rows(hand_blocks, hand_table, &opt, count, hand_b.p.theta, hand_b.g.J, hand_b.g.r, hand_b.g.weight,
                              &hand_b.o.state, room));
    CHECK(same((count + 1) * P, hand_a.g.J, hand_b.g.J) && same(count, hand_a.g.r, hand_b.g.r));
    CHECK(same(count, hand_a.g.weight, hand_b.g.weight));
    hand_newton_normal_equations(&opt, count, cut, hand_newton_side, &hand_b.g, &hand_b.o, other_work);
    hand_newton_normal_equations(&opt, count, 0, cut, &hand_b.g, &hand_b.o, hand_b.o.work.sums);
    hand_b.o.next = hand_b.p;
    CHECK_OK(roln_newton_step(hand_blocks, hand_table, &opt, &system, hand_b.p.theta, &hand_b.o.state, hand_b.o.next.theta,
                              hand_b.g.expect, hand_b.o.keep, room));
    CHECK(same(side * (side + 1), hand_a.o.S, hand_b.o.S) && same(P, hand_a.o.keep, hand_b.o.keep));
    CHECK(same(count, hand_a.g.expect, hand_b.g.expect));
    CHECK(memcmp(&hand_a.o.next, &hand_b.o.next, sizeof hand_a.o.next) == 0);
    CHECK(memcmp(&hand_a.o.state, &hand_b.o.state, sizeof hand_a.o.state) == 0);
}

static ld move_of(const hand_params *p, const hand_params *next)
{
    ld sum = 0;
    int i;
    for (i = 0; i < hand_theta_size; i++) sum += ((ld)next->theta[i] - (ld)p->theta[i]) * ((ld)next->theta[i] - (ld)p->theta[i]);
    return sum;
}

/* Refused, and with more damping from the same sums; taken; judged by some of the rows. */
static void check_hand_judge(int count, roln_newton_opt opt)
{
    const int side = ROLN_NEWTON_SIDE(count, hand_newton_size), P = hand_newton_size;
    const roln_batch b = hand_batch(0, 5);
    roln_real *carried = hand_a.g.J + count * P, lambda;
    hand_begin(&hand_a, 12);
    hand_learn(&hand_a, &opt, count, 3);
    hand_look(&hand_a, &opt, count), hand_try(&hand_a, &opt, count);
    hand_b = hand_a, lambda = hand_a.o.state.lambda;
    hand_a.g.next[count - 1] = (roln_real)NAN; /* refused: residuals that are none */
    CHECK(hand_newton_accept(&hand_a.p, count, count, &hand_a.g, &hand_a.o) == 0);
    CHECK(memcmp(&hand_a.p, &hand_b.p, sizeof hand_a.p) == 0 && same(count * P, hand_a.g.J, hand_b.g.J));
    CHECK(same(count, hand_a.g.r, hand_b.g.r) && same(side * (side + 1), hand_a.o.S, hand_b.o.S));
    CHECK(hand_a.o.state.lambda == 4 * lambda && hand_a.o.state.loss == hand_b.o.state.loss);
    if (side == P) CHECK(same(P, carried, hand_b.g.J + count * P) && same(P, hand_a.o.carried, hand_b.o.carried)); /* rest waits, */
    else CHECK(roln_dot(P, carried, carried) <= 0 && roln_dot(P, hand_a.o.carried, hand_a.o.carried) <= 0); /* no last step */
    CHECK_OK(hand_newton_step(&hand_a.p, &opt, count, &hand_a.g, &hand_a.o)); /* shorter, from the same sums */
    CHECK(move_of(&hand_a.p, &hand_a.o.next) < move_of(&hand_b.p, &hand_b.o.next));
    /* taken, now or with more damping; 5 of the rows judge, and the others do not count */
    hand_a = hand_b;
    memset(hand_b.g.next, 255, sizeof hand_b.g.next); /* NaN */
    CHECK_OK(hand_rows(&hand_b.o.next, &hand_weights, &b, tick, 0, 1, &hand_b.g, &hand_scratch.rows));
    CHECK(same(5, hand_a.g.next, hand_b.g.next));
    while (!hand_newton_accept(&hand_b.p, count, 5, &hand_b.g, &hand_b.o) && hand_b.o.state.refused < 50) {
        CHECK_OK(hand_newton_step(&hand_b.p, &opt, count, &hand_b.g, &hand_b.o));
        CHECK_OK(hand_rows(&hand_b.o.next, &hand_weights, &b, tick, 0, 1, &hand_b.g, &hand_scratch.rows));
    }
    CHECK(hand_b.o.state.refused < 50 && hand_b.o.state.taken == hand_a.o.state.taken + 1);
    CHECK(memcmp(&hand_b.p, &hand_b.o.next, sizeof hand_b.p) == 0 && same(P, hand_b.o.keep, hand_b.o.carried));
}

/* The networks alone: what is in front of them stays, bit for bit; their rows are the tail of those of everything. */
static void check_palm(void)
{
    static palm_params p;
    static palm_residuals g;
    static palm_newton o;
    static palm_train train;
    const int P = palm_newton_size, ae = palm_ae_size;
    const roln_batch b = hand_batch(0, 13);
    int k, i, moved = 0;
    hand_begin(&hand_a, 13);
    memcpy(&p, &hand_a.p, sizeof p);
    CHECK(sizeof p == sizeof hand_a.p && P == hand_newton_size - ae && palm_newton_side == 13);
    memset(&g, 0, sizeof g), memset(&o, 0, sizeof o);
    o.state = begin, g.seed = hand_a.g.seed;
    CHECK_OK(hand_rows(&hand_a.p, &hand_weights, &b, tick, 0, 0, &hand_a.g, &hand_scratch.rows));
    for (k = 0; k < 8; k++) {
        CHECK_OK(palm_rows(&p, &hand_weights, &b, tick, 0, 0, &g, &train.rows));
        for (i = 0; i < 13 && k == 0; i++) CHECK(same(P, g.J + i * P, hand_a.g.J + i * hand_newton_size + ae));
        CHECK_OK(palm_newton_rows(&p, &usual, 13, &g, &o));
        palm_newton_normal_equations(&usual, 13, 0, palm_newton_side, &g, &o, o.work.sums);
        CHECK_OK(palm_newton_step(&p, &usual, 13, &g, &o));
        (void)palm_rows(&o.next, &hand_weights, &b, tick, 0, 1, &g, &train.rows);
        (void)palm_newton_accept(&p, 13, 13, &g, &o);
    }
    CHECK(o.state.taken >= 4 && same(ae, p.theta, hand_a.p.theta) && same(3, &p.scale.q, &hand_a.p.scale.q));
    for (i = ae; i < palm_theta_size; i++) moved += p.theta[i] < hand_a.p.theta[i] || p.theta[i] > hand_a.p.theta[i];
    CHECK(moved > 3 * P / 4);
}

/* Value and slope along (1, .., 1) of a network with one weight, at x. */
static void value_of(const roln_mlp *net, const roln_real *theta, const roln_real *x, roln_real y[2])
{
    roln_real in[2 * 8], out[2 * 16], *hidden = room_of(4 * (roln_mlp_hidden(net) + 40));
    const int ni = net->size[0], no = net->size[net->layers];
    int i;
    CHECK(ni <= 8 && no <= 16);
    for (i = 0; i < ni; i++) in[i] = x[i], in[ni + i] = 1;
    roln_mlp_forward(net, 1, 2, 1, theta, in, out, hidden, hidden + roln_mlp_hidden(net));
    for (y[0] = y[1] = 0, i = 0; i < no; i++) y[0] += out[i], y[1] += out[no + i];
}

/* The ridge of each weight of a network: its polynomial, or the slope, squared; none on what is linear along a line. */
static void check_ridge_of(const roln_mlp *net, int slope, const roln_real *reach, const roln_real *w)
{
    static roln_real theta[1000];
    const int P = roln_mlp_params(net);
    int i, j, k, free_ = 0;
    CHECK(P <= 1000);
    for (i = 0; i < P; i++) {
        roln_real y[2], x[8], line[3], curve, size;
        memset(theta, 0, sizeof theta), theta[i] = 1;
        value_of(net, theta, reach, y);
        for (k = 0; k < 3; k++) {
            roln_real v[2];
            for (j = 0; j < net->size[0]; j++) x[j] = ROLN_C(0.3) + ROLN_C(0.1) * (roln_real)(j + 1) * (roln_real)(k + 1);
            value_of(net, theta, x, v), line[k] = v[0];
        }
        curve = ROLN_ABS(line[0] - 2 * line[1] + line[2]), size = 1 + y[slope] * y[slope];
        free_ += w[i] <= 0;
        if (curve < 20 * ROLN_EPS) CHECK(w[i] <= 0 && w[i] >= 0);
        else CHECK_NEAR((double)w[i], (double)(ROLN_C(0.5) * y[slope] * y[slope]), 20 * (double)(size * ROLN_EPS));
    }
    CHECK(free_ == (net->size[0] + 1) * net->size[2]);
}

static void check_ridges(void)
{
    static const roln_real of_toe[4] = {ROLN_C(1.5), 1, ROLN_C(1.5), 1}, of_heel[3] = {2, 2, 2};
    static roln_real toe[toe_newton_size], heel[heel_newton_size], leg[leg_newton_size];
    const roln_lnn *f = &toe_model.lnn, *g = &heel_model.lnn;
    roln_real top = 0;
    int i;
    toe_newton_ridge(ROLN_C(0.5), ROLN_C(1.5), toe), heel_newton_ridge(ROLN_C(0.5), 2, heel), leg_newton_ridge(1, 2, leg);
    check_ridge_of(&f->mass_net, 0, of_toe, toe);
    check_ridge_of(&f->potential_net, 1, of_toe, toe + rolni_potential_at(f));
    check_ridge_of(&f->damper_net, 0, of_toe, toe + rolni_damper_at(f));
    check_ridge_of(&g->mass_net, 0, of_heel, heel + heel_ae_size);
    check_ridge_of(&g->potential_net, 1, of_heel, heel + heel_ae_size + rolni_potential_at(g));
    for (i = 0; i < heel_ae_size; i++) CHECK(heel[i] <= 0 && heel[i] >= 0);
    for (i = 0; i < leg_newton_size; i++) CHECK(leg[i] <= 0 && leg[i] >= 0);
    toe_newton_ridge(ROLN_C(0.5), ROLN_C(1e18), toe); /* no weight is too large for a number */
    for (i = 0; i < toe_newton_size; i++) top = ROLN_MAX(top, toe[i]);
    CHECK_NEAR((double)(top * ROLN_EPS * ROLN_EPS), 1, 4 * (double)ROLN_EPS);
}

/* The row of the scale is the derivative of its residual; with L and R times c and V times c^2, M and so its logarithm are those
   of c^2 M. What an exponential says of it is linear. */
#define CHECK_SCALE(name) \
    do { \
        static name##_residuals g; \
        static name##_params p; \
        const int outputs = rolni_outputs(&name##_model.lnn), from = name##_ae_size + rolni_potential_at(&name##_model.lnn); \
        uint64_t s_ = 3; \
        roln_real r, there; \
        int i_; \
        fill(name##_theta_size, 1, &s_, p.theta), fill(name##_newton_size, 1, &s_, g.J + 2 * name##_newton_size); \
        CHECK_OK(name##_scale_row(&p, ROLN_C(0.5), 3, 2, &g)), r = g.r[2]; \
        CHECK_NEAR((double)r, 3 * (0.5 - (double)name##_scale_of(&p)), 40 * (double)ROLN_EPS); \
        CHECK(name##_scale_row(&p, 0, 3, -1, &g) == ROLN_E_LENGTH && name##_scale_row(&p, 0, 3, 40, &g) == ROLN_E_LENGTH); \
        for (i_ = 0; i_ < name##_newton_size; i_++) { \
            const roln_real h = ROLN_SQRT(ROLN_EPS), kept = p.theta[i_], row = g.J[2 * name##_newton_size + i_]; \
            p.theta[i_] = kept + h, (void)name##_scale_row(&p, ROLN_C(0.5), 3, 3, &g), there = g.r[3], p.theta[i_] = kept; \
            CHECK_NEAR((double)(r - there), (double)(h * row), 40 * (double)ROLN_EPS); \
            CHECK((i_ >= from - outputs && i_ < from) || (row <= 0 && row >= 0)); \
        } \
        if (name##_model.lnn.mass == ROLN_CHOLESKY) { \
            for (i_ = name##_ae_size; i_ < name##_theta_size; i_++) p.theta[i_] *= ROLN_C(1.5); \
            CHECK_OK(name##_scale_row(&p, ROLN_C(0.5), 3, 3, &g)); \
            CHECK_NEAR((double)(g.r[3] - r), -6 * log(1.5), 40 * (double)ROLN_EPS); \
            memset(g.r, 0, sizeof g.r); \
            for (i_ = 0; i_ < name##_theta_size; i_++) p.theta[i_] = (roln_real)(sizeof(roln_real) > 4 ? 1e-161 : 1e-22); \
            CHECK(name##_scale_row(&p, 0, 3, 3, &g) == ROLN_E_NOT_FINITE && g.r[3] <= 0 && g.r[3] >= 0); \
            rolni_zero(name##_theta_size, p.theta); \
            CHECK(name##_scale_row(&p, 0, 3, 3, &g) == ROLN_E_NOT_FINITE && g.r[3] <= 0 && g.r[3] >= 0); \
        } \
    } while (0)

static void check_scales(void)
{
    CHECK_SCALE(toe);
    CHECK_SCALE(heel);
}

/* Blocks and scratch of the shell are those of its table, for any number of rows. */
static void check_sizes(void)
{
    const int P = hand_newton_size, blocks = hand_blocks, Q = palm_newton_size, from = palm_newton_from, R = COUNT;
    int verb = 0, count, b;
    for (b = 0; b < blocks; b++)
        if (hand_table[b].manifold != ROLN_EUCLIDEAN && roln_block_size(hand_table + b) > 0)
            verb = ROLN_MAX(verb, hand_table[b].manifold->work(hand_table[b].rows, hand_table[b].cols));
    CHECK(hand_newton_from == 0 && hand_newton_first == 0 && hand_newton_blocks == blocks);
    CHECK(roln_product_size(blocks, hand_table) == P && P == hand_theta_size);
    CHECK(roln_product_size(palm_newton_first, palm_table) == from && from == palm_ae_size);
    CHECK(roln_product_size(palm_newton_blocks, palm_table + palm_newton_first) == Q);
    CHECK((int)(sizeof hand_a.o.work.rows / sizeof(roln_real)) == verb);
    CHECK((int)(sizeof hand_a.o.work.step / sizeof(roln_real)) == ROLN_NEWTON_STEP_WORK(R, P, verb));
    for (count = 1; count < R; count++)
        CHECK(ROLN_NEWTON_STEP_WORK(count, P, verb) <= ROLN_NEWTON_STEP_WORK(R, P, verb));
}

/* Counts that do not fit: a status, and nothing is touched. */
static void check_lengths(void)
{
    static const struct {
        int at, count, steps;
    } wrong[7] = {
        {.at = -1, .count = 1, .steps = 3},
        {.at = COUNT, .count = 1, .steps = 3},
        {.at = COUNT - 4, .count = 5, .steps = 3},
        {.at = 0, .count = COUNT + 1, .steps = 3},
        {.at = 0, .count = -1, .steps = 3},
        {.at = 0, .count = 1, .steps = 4},
        {.at = 0, .count = 1, .steps = -1},
    };
    int i, again;
    hand_begin(&hand_a, 14);
    hand_learn(&hand_a, &usual, DUAL, 1);
    hand_b = hand_a;
    for (i = 0; i < 7; i++)
        for (again = 0; again < 2; again++) {
            roln_batch b = hand_batch(0, wrong[i].count);
            b.steps = wrong[i].steps;
            CHECK(hand_rows(&hand_a.p, &hand_weights, &b, tick, wrong[i].at, again, &hand_a.g, &hand_scratch.rows) ==
                  ROLN_E_LENGTH);
        }
    for (i = 0; i < 3; i++) {
        const int count = i == 0 ? -1 : i == 1 ? 0 : COUNT + 1;
        CHECK(hand_newton_rows(&hand_a.p, &usual, count, &hand_a.g, &hand_a.o) == ROLN_E_LENGTH);
        CHECK(hand_newton_step(&hand_a.p, &usual, count, &hand_a.g, &hand_a.o) == ROLN_E_LENGTH);
        CHECK(hand_newton_accept(&hand_a.p, count, 1, &hand_a.g, &hand_a.o) == 0);
        CHECK(hand_newton_accept(&hand_a.p, DUAL, i == 2 ? DUAL + 1 : count, &hand_a.g, &hand_a.o) == 0);
    }
    CHECK(memcmp(&hand_a.p, &hand_b.p, sizeof hand_a.p) == 0 && memcmp(&hand_a.g, &hand_b.g, sizeof hand_a.g) == 0);
    CHECK(memcmp(&hand_a.o.state, &hand_b.o.state, sizeof begin) == 0);
}

static void test_shell(void)
{
    static const roln_newton_opt opts[3] = {
        {.memory = 1, .rate = 1, .cap = 5}, {.memory = 4, .rate = 1, .cap = 2}, {.memory = 2, .rate = 1, .cap = 5}};
    int i;
    check_sizes();
    check_lengths();
    check_resume(COUNT, 1), check_resume(COUNT, 8), check_resume(DUAL, 10);
    for (i = 0; i < 3; i++) {
        check_hand_pieces(i < 2 ? COUNT - 30 : DUAL, i < 2 ? COUNT : DUAL, opts[i]);
        check_hand_judge(i < 2 ? COUNT : DUAL, opts[i]);
    }
    check_palm();
    check_ridges();
    check_scales();
}

void TEST_NAME(newton_model)(void)
{
    test_learning();
    test_ignored();
    test_shell();
    print_bounds();
}
