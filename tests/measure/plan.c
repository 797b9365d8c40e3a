/* SPDX-License-Identifier: MIT */
/* plan.c - what a plan takes: 16 joints, n = 4, four motors, 20 steps of 20 ms, networks of two layers of WIDE; the weights are
   random, which no count depends on but by the number of tries. The model itself is the machine; every half second the goal is
   another pose, out of reach for the motors within that time, so that most plans touch a limit. RATE: with limits of rate.

   Prints plans that touch a limit, torques beyond one, a hash of all torques and feedback, bytes, instructions: least, most, mean.
   WORST: and the most that a plan can take (longest_plan).
   sh examples/firmware/cc.sh m7 -DWIDE=32 -DPLANS=1000 tests/measure/plan.c -o plan.elf; sh examples/firmware/run.sh m7 plan.elf */

#define ROLN_NAME wide
#define ROLN_AE 16, 4
#define ROLN_SLOPE 1
#define ROLN_MLP WIDE, WIDE
#define ROLN_INTEGRATOR euler
#define ROLN_PLAN 20, 4
#ifdef WORST
static int longest(int rows);
#define ROLNI_EIG_SWEEPS longest
#endif
#include "roln.h"

#include "text.h"
#ifdef WORST
#include "longest_way.h"
#endif

enum { N = 16, n = 4, MOTORS = 4 };
#define DT 0.02f
#define TOP 0.5f /* of a torque */
#ifdef RATE
#define FAST 10.0f /* 1/s */
#else
#define FAST 0.0f
#endif

static wide_params p;
static wide_plan plan;
static wide_plan_next_work planwork;
static wide_work work;
static wide_start start;
static uint64_t hash = ROLN_FNV;
static uint32_t least = 0xffffffff, most, full, beyond, worst;
static uint64_t all; /* instructions */

static float ref[N];
static const float weight[N] = {1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1}, still[N];
static const float slow[N] = {0.05f, 0.05f, 0.05f, 0.05f, 0.05f, 0.05f, 0.05f, 0.05f,
                              0.05f, 0.05f, 0.05f, 0.05f, 0.05f, 0.05f, 0.05f, 0.05f};
static const float B[N * MOTORS] = {[3 * 4] = 1, [7 * 4 + 1] = 1, [11 * 4 + 2] = 1, [15 * 4 + 3] = 1}, dear[MOTORS] = {
    0.01f, 0.01f, 0.01f, 0.01f};
static const roln_motors motors = {MOTORS, B, 0};
static const roln_limits limits = {.dt = DT, .margin = 10, .tau = TOP, .rate = FAST, .motors = &motors};
static const roln_term terms[2] = {{.of = ROLN_OF_Q, .weight = weight, .ref = ref},
                                   {.of = ROLN_OF_QD, .weight = slow, .ref = still}};
static const roln_goal goal = {.dt = DT, .terms = 2, .term = terms, .u = dear, .limits = &limits};

#ifdef WORST
/* A plan from s along the longest way: no derivatives are kept but those of one step, which do not hold, so that this step is made
   twice, and three tries go all the way. Of a plan that takes its first try, all that is left is counted on its own. */
static void longest_plan(const wide_latent *s)
{
    static wide_plan other;
    wide_latent end = *s;
    float cost;
    const rolni_push push = {.dt = DT};
    uint32_t before, count;
    other = plan;
    memset(other.of, 0, sizeof other.of);
    longest_way = 2;
    before = board_count();
    const roln_status st = wide_plan_next(&p, &goal, s, &other, &planwork);
    count = board_count() - before;
    if (st == ROLN_OK && other.of[0]) {
        before = board_count();
        for (int i = 0; i < 2; i++)
            if (wide_i_plan_try(&p, &goal, 1, NULL, &cost, &planwork) != ROLN_OK) count = 0;
        (void)wide_i_plan_near(&p, &other, 0, &planwork, planwork.x, planwork.x + 2 * n);
        (void)wide_i_plan_straight(&p, end.z, planwork.x, planwork.x + 2 * n);
        if (wide_i_step(&p, end.z, end.zd, &push, &planwork.now.step) != ROLN_OK) count = 0;
        count += board_count() - before;
        worst = count > worst ? count : worst;
    }
    longest_way = 0;
}
#endif

/* A plan, counted, and checked as numbers of the machine. */
static int next(const wide_latent *s, const float last[MOTORS])
{
    int at_limit = 0;
    const uint32_t before = board_count();
    const roln_status st = wide_plan_next(&p, &goal, s, &plan, &planwork);
    const uint32_t count = board_count() - before;
    if (st != ROLN_OK) return -1;
    most = count > most ? count : most, least = count < least ? count : least, all += count;
    hash = roln_fnv((int)sizeof plan.u, (const unsigned char *)plan.u, hash);
    hash = roln_fnv((int)sizeof plan.K, (const unsigned char *)plan.K, hash);
    for (int i = 0; i < wide_steps * MOTORS; i++) {
        const float change = ROLN_ABS(plan.u[i] - (i < MOTORS ? last[i] : plan.u[i - MOTORS]));
        beyond += !(ROLN_ABS(plan.u[i]) <= TOP) || (FAST > 0 && !(change <= FAST * DT * 1.000001f));
        at_limit |= ROLN_ABS(plan.u[i]) > 0.99f * TOP || (FAST > 0 && change > 0.99f * FAST * DT);
    }
    full += at_limit != 0;
    return 0;
}

static void put(const char *text, uint32_t x)
{
    put_text(text);
    put_integer(x, 0);
}

int main(void)
{
    uint64_t seed = 1;
    wide_latent s = {{0.3f, 0.3f, 0.3f, 0.3f}, {0, 0, 0, 0}};
    float u[MOTORS] = {0};
    if (wide_init(&p, &seed, &start.init) != ROLN_OK) return 1;
    for (int i = 0; i < n; i++)
        p.z_min[i] = -3, p.z_max[i] = 3, p.zd_max[i] = 10;
    for (int k = 0; k < PLANS; k++) {
        float tau[N] = {0};
        if (k % 25 == 0)
            for (int i = 0; i < N; i++)
                ref[i] = 0.6f * (roln_uniform(&seed) - 0.5f);
#ifdef WORST
        longest_plan(&s);
#endif
        if (next(&s, u)) return 1;
        for (int j = 0; j < MOTORS; j++)
            tau[4 * j + 3] = u[j] = plan.u[j];
        if (wide_step(&p, &s, tau, DT, &work.step) != ROLN_OK) return 1;
    }
    put("plans ", PLANS), put(" at_a_limit ", full), put(" beyond ", beyond);
    put_text(" hash ");
    put_hex(hash, 16);
    put(" bytes ", (uint32_t)(sizeof plan + sizeof planwork)), put(" instructions ", least), put(" ", most);
    put(" ", (uint32_t)(all / PLANS));
#ifdef WORST
    put(" worst ", worst);
#endif
    put_text("\n");
    return 0;
}
