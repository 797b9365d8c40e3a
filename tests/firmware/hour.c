/* SPDX-License-Identifier: MIT */
/* hour.c - an hour of adapt.c on a PC. The payload changes every four minutes, bad data come in twice between two changes, and the
   power is cut at random instants. The same hour is done three times:

   1. As it is. After every accepted update the new weights predict TESTED windows that the learner does not see, of the machine as
      it is at that time and without bad data.
   2. With power cuts, at any tick and within a save. The weights at the end must be those of the first hour, to the last bit.
   3. Without the checks of held_out.h: they always say yes.

   Then eight minutes with two payloads for each scene in which held-out windows are few or rare, a hand pushing once with each
   payload, and for spikes in a measured velocity.

   First held_out.h alone, and when adapt.c may decide. Errors are in mrad: root of the mean square over joints and windows, at the
   end of a window. */
#include <math.h>
#include <setjmp.h>
#include <stdio.h>
#include <string.h>
#include "held_out.h"

static int checked = 1;

static int near_or_unchecked(float error, int count, const float *now)
{
    return !checked || held_near(error, count, now);
}

static int no_worse_or_unchecked(int count, const float *now, const float *next)
{
    return !checked || held_no_worse(count, now, next);
}

int adapt_main(void);
static void *copy_or_cut(void *to, const void *from, size_t size);
#define held_near near_or_unchecked
#define held_no_worse no_worse_or_unchecked
#define memcpy copy_or_cut
#define main adapt_main
#include "../../examples/firmware/adapt.c"
#undef held_near
#undef held_no_worse
#undef memcpy
#undef main

#ifndef BAD
#define BAD 1600 /* ticks of bad data */
#endif
enum {
    PARTS = 15, PART = 48000,       /* parts of the hour with a payload each, ticks of one */
    CORNERED = 10000,               /* ticks of motion in a corner, which is good data */
    TESTED = 60
};
#define MARGIN 2.0f /* mrad: by so much the error may rise over the least one of the part; a quarter of it from bad data */
#define LATE_MOST 2 /* parts whose payload is not learned within 40 s */

static const float payload[PARTS] = {0.2f, 0, -0.1f, 0.4f, 0.1f, 0.3f, 0, 0.2f, -0.2f, 0, 0.15f, 0.4f, 0.35f, -0.1f, 0};
typedef enum { STUCK, SCALED, LATE, NOT_A_NUMBER, HAND, CORNER, KINDS, SPIKE, NONE } kinds;
static const char *const name_of[KINDS] = {"stuck", "times 10", "late", "NaN", "hand", "corner"};

static int passed, failed;
static void check(int good, const char *what, int part)
{
    if (good) passed++;
    else failed++, printf("part %d: %s\n", part, what);
}

/* ---- held_out.h ---- */

/* The median by counting: the least number that is not less than half of them. */
static float slow_median(int count, const float *e)
{
    float best = INFINITY;
    for (int i = 0; i < count; i++) {
        int least = 0;
        for (int k = 0; k < count; k++)
            least += e[k] <= e[i];
        if (2 * least >= count && e[i] < best) best = e[i];
    }
    return best;
}

static void test_held(void)
{
    uint64_t seed = 5;
    float now[HELD_MOST], next[HELD_MOST];
    int medians = 0, minority = 0, same = 0;
    for (int t = 0; t < 4000; t++) {
        const int count = 1 + t % HELD_MOST, bad = (count - 1) / 2;
        for (int i = 0; i < count; i++) {
            now[i] = t % 2 ? (float)(int)(5 * roln_uniform(&seed)) : roln_uniform(&seed); /* with ties, without */
            if (t % 7 == 0 && roln_uniform(&seed) < 0.3f) now[i] = HELD_FAILED;
        }
        medians += held_median(count, now) != slow_median(count, now);
        same += held_no_worse(count, now, now);
        for (int i = 0; i < count; i++) { /* the bad windows become far better or stay, all others become worse by 1 % */
            now[i] = i < bad ? 100 * roln_uniform(&seed) : 1 + roln_uniform(&seed);
            next[i] = i < bad ? now[i] * 0.5f : 1.01f * now[i];
        }
        minority += held_no_worse(count, now, next) || held_median(count, now) > 2 || held_near(32.01f, count, now);
    }
    check(medians == 0, "a median is wrong", 0);
    check(minority == 0, "fewer than half of the windows decide", 0);
    check(same == 0, "weights that change nothing", 0);
    for (int i = 0; i < 16; i++)
        now[i] = 1, next[i] = i < 8 ? 0.5f : 0.9f;
    check(held_no_worse(16, now, next) && !held_no_worse(16, next, now), "better is refused", 0);
    check(held_near(16, 16, now) && !held_near(16.01f, 16, now) && !held_near(NAN, 16, now), "the bound of errors", 0);
    for (int i = 0; i < 16; i++)
        next[i] = HELD_FAILED;
    check(!held_near(HELD_FAILED, 16, next), "a roll-out that fails is near others that do", 0);
    for (int i = 0; i < 16; i++)
        next[i] = 0.5f;
    next[3] = NAN;
    check(!held_no_worse(16, now, next), "a NaN is accepted", 0);
    for (int i = 0; i < 16; i++) /* two windows of bad data: 20 medians count as 16, and so does 1,000 */
        now[i] = i < 2 ? 20 : 1, next[i] = i < 2 ? 1000 : 0.9f;
    check(held_no_worse(16, now, next), "windows of bad data decide", 0);
    next[1] = HELD_FAILED;
    check(!held_no_worse(16, now, next), "a roll-out that fails anew is accepted", 0);
    now[1] = HELD_FAILED;
    check(held_no_worse(16, now, next), "a roll-out that failed before decides", 0);
    check(!held_no_worse(0, now, next) && held_median(0, now) == 0, "accepted without windows", 0);
    for (int count = 1; count <= 16; count++) { /* the answer does not depend on the unit, and nothing is better than no error */
        for (int i = 0; i < count; i++)
            now[i] = 1e-25f, next[i] = i < (count + 1) / 2 ? 1.5e-24f : 0;
        check(!held_no_worse(count, now, next), "tiny errors that grow are accepted", count);
        for (int i = 0; i < count; i++)
            now[i] = 0, next[i] = i % 2 ? 0 : HELD_FAILED;
        check(!held_no_worse(count, now, next), "errors where there were none are accepted", count);
    }
    for (int i = 0; i < 9; i++)
        now[i] = i < 4 ? 100 : i == 4 ? NAN : 1;
    check(held_median(9, now) == 100, "a median with a NaN is wrong", 0);
}

/* The same by the definition: BAD_MOST ticks of bad data at all places. A window has the WINDOW + 1 ticks before `tick`. */
static int may_decide_slowly(const memory *m)
{
    int count = 0, most = 0;
    for (int i = 0; i < HELD; i++)
        count += m->held[i].tick > 0;
    for (uint32_t from = 100000 - 9000; from < 100000 + 2000; from++) {
        int touched = 0;
        for (int i = 0; i < HELD; i++) {
            const window *w = &m->held[i];
            touched += w->tick > 0 && !w->sure && w->tick > from && w->tick - WINDOW - 1 < from + BAD_MOST;
        }
        if (touched > most) most = touched;
    }
    return count >= LEAST && most < count / 2;
}

static void test_votes(void)
{
    static memory m;
    uint64_t seed = 9;
    int differ = 0, yes = 0;
    for (int t = 0; t < 400; t++) {
        const float apart = t % 4 == 1 ? (BAD_MOST + WINDOW - 1) / 3 - 1 : 100 + 450 * roln_uniform(&seed); /* four just so */
        const float kept = 0.4f + 0.6f * roln_uniform(&seed);
        uint32_t tick = 100000;
        for (int i = 0; i < HELD; i++) {
            window *w = &m.held[(7 * i + t) % HELD];
            w->tick = roln_uniform(&seed) < kept ? tick : 0, w->sure = t % 3 == 0 && i > 10;
            tick -= 1 + (uint32_t)(apart * (t % 2 ? 1 : 2 * roln_uniform(&seed)));
        }
        differ += may_decide(&m) != may_decide_slowly(&m), yes += may_decide(&m);
    }
    check(differ == 0, "bad data could decide, or good data may not", differ);
    check(yes > 50 && yes < 350, "hardly any votes", yes);
}

/* ---- the hour ---- */

static int copy, busy, busiest; /* ticks of this turn behind its window; the most so far */
static int outvoted;            /* decisions while half of the held-out windows or more were of bad data */
static float mass[N];
static window clean[TESTED];
static struct {
    int on;
    uint64_t seed;
    uint32_t cuts, in_saves;
    jmp_buf back;
} power;

/* A part of a save may be all that is written. */
static void *copy_or_cut(void *to, const void *from, size_t size)
{
    if (power.on && size == sizeof(memory) && roln_uniform(&power.seed) < 0.02f) {
        memcpy(to, from, (size_t)((float)size * roln_uniform(&power.seed)));
        power.in_saves++;
        longjmp(power.back, 1);
    }
    return memcpy(to, from, size);
}

/* Where somebody moves the chain to, and how often. LEAVING: anywhere in the first quarter of a part, later to one region, and to
   two others while a hand pushes. only: a kind that disturbs the middle of each part, alone; NONE: all do, as in the hour. */
typedef enum { ANYWHERE, ONE_SIDE, LEAVING } places;
static struct {
    places where;
    int every; /* ticks */
    kinds only;
    float spike; /* rad/s, in one tick of 97 */
} scene;

static int allowed(uint32_t at, int region)
{
    const uint32_t since = at % PART - PART / 2;
    if (scene.where == ONE_SIDE) return region >= 2;
    if (scene.where == ANYWHERE || at % PART < PART / 4) return 1;
    return region == (since < BAD / 2 ? 0 : since < BAD ? 1 : 2);
}

static void move_there(uint32_t at, rods *machine, uint64_t *seed)
{
    chain_state x;
    chain_latent s;
    do {
        move(machine, seed);
        rods_read(machine, &x);
        if (chain_encode(&chain_weights, &x, &s, &scratch.work.encode) != ROLN_OK) check(0, "encode", 0);
    } while (!allowed(at, region_of(&s)));
}

/* What disturbs tick `at` of the hour: of the two of a part, in its middle and after three quarters. */
static kinds kind_at(uint32_t at)
{
    const uint32_t part = at / PART, half = at % PART / (PART / 4);
    if (half < 2) return NONE;
    if (scene.only != NONE) return at % PART - PART / 2 < BAD ? scene.only : NONE;
    const kinds kind = (kinds)((2 * part + half - 2) % KINDS);
    return at % (PART / 4) < (kind == CORNER ? CORNERED : BAD) ? kind : NONE;
}

/* q, qd of one joint as a bad encoder has them. */
static void spoil(kinds kind, uint32_t at, chain_state *x)
{
    const uint32_t j = at / PART * 3 % N;
    if (kind == STUCK) x->q[j] = 0.3f, x->qd[j] = 0;
    if (kind == SCALED) x->q[j] *= 10, x->qd[j] *= 10;
    if (kind == LATE) x->q[j] -= 0.04f * x->qd[j]; /* 40 ms */
    if (kind == NOT_A_NUMBER && at % 13 == 0) x->q[j] = NAN;
    if (kind == SPIKE && at % 97 == 0) x->qd[j] = scene.spike;
}

/* Counts a decision that bad data could have made: the last tick begins to learn from a window, or began anew. */
static void watch_votes(uint32_t anew)
{
    const memory *m = &copies[copy];
    int bad = 0, all = 0;
    if (!checked || (turn.phase != SUMS && m->anew == anew)) return;
    for (int i = 0; i < HELD; i++) {
        int touched = 0;
        for (uint32_t k = 1; k <= WINDOW + 1 && m->held[i].tick > 0; k++) {
            const kinds kind = kind_at(m->held[i].tick - k);
            touched |= kind != NONE && kind != CORNER;
        }
        all += m->held[i].tick > 0, bad += touched;
    }
    outvoted += 2 * bad >= all;
}

static void one_tick(void)
{
    memory *m = &copies[copy];
    const uint32_t anew = m->anew;
    const kinds kind = kind_at(m->tick);
    const float hand[N] = {0.5f}; /* Nm */
    chain_state x;
    for (int i = 0; i < N; i++)
        mass[i] = i < 4 ? 0.1f : 0.1f * (1 + payload[m->tick / PART]);
    if (m->tick % (uint32_t)scene.every == 0) {
        move_there(m->tick, &m->machine, &m->seed), m->samples = 0;
        for (int i = 0; i < n && kind == CORNER; i++)
            m->machine.z[i] = 0.5f + 0.1f * m->machine.z[i], m->machine.zd[i] *= 0.1f;
    }
    rods_step(&m->machine, mass, kind == HAND ? hand : NULL, TICK);
    rods_read(&m->machine, &x);
    spoil(kind, m->tick, &x);
    copy = tick(copy, &x);
    busy = turn.phase == SAMPLE ? 0 : busy + 1;
    if (busy > busiest) busiest = busy;
    watch_votes(anew);
}

/* Windows of the machine as it is. */
static void make_clean(void)
{
    uint64_t seed = 77;
    for (int t = 0; t < TESTED; t++) {
        rods machine;
        chain_state x;
        move_there(PART - 1, &machine, &seed);
        rods_read(&machine, &x);
        if (chain_encode(&chain_weights, &x, &clean[t].start, &scratch.work.encode) != ROLN_OK) check(0, "encode", 0);
        for (int i = 0; i < WINDOW; i++)
            rods_step(&machine, mass, NULL, TICK);
        rods_read(&machine, &x);
        memcpy(clean[t].end, x.q, sizeof x.q);
    }
}

/* mrad; a roll-out that fails or is off by more counts as 1000. */
static float error_of(const chain_params *p)
{
    float sum = 0;
    for (int t = 0; t < TESTED; t++) {
        const float e = roll(p, &clean[t]);
        sum += e < 1 ? e * e : 1;
    }
    return 1000 * ROLN_SQRT(sum / TESTED);
}

/* Of a part, mrad: with the weights of the part before, after 20 s, after 40 s; before each disturbance and the most until 54 s
   after its begin; at the end; the largest rise over the least one before. Then turns. */
typedef struct {
    float first, at20, at40, before[2], most[2], end, rise;
    uint32_t accepted, refused, left_out, anew;
} row_of;
static row_of rows[2][PARTS];

/* Before tick `at`, with the error then. least: since the part began. */
static void note(row_of *r, const memory *m, uint32_t at, float error, float least)
{
    const uint32_t in = at % PART, half = in / (PART / 4), since = in % (PART / 4);
    if (in == 0) r->first = error;
    if (in == 4000) r->at20 = error;
    if (in == 8000) r->at40 = error;
    if (half >= 2) {
        if (since == 0) r->before[half - 2] = r->most[half - 2] = error;
        if (since < 10800 && error > r->most[half - 2]) r->most[half - 2] = error;
    }
    if (error - least > r->rise) r->rise = error - least;
    r->end = error;
    r->accepted = m->accepted, r->refused = m->refused, r->left_out = m->left_out, r->anew = m->anew;
}

static void begin(void)
{
    memset(&turn, 0, sizeof turn);
    memset(marks, 0, sizeof marks);
    start(&copies[0]);
    copy = kept_save(marks, copies, (int)sizeof *copies, 0, origin);
}

/* A tick without a measurement drops the window, and no difference of velocities spans the gap. */
static void test_dropped(void)
{
    scene.every = PUSH, scene.where = ANYWHERE, scene.only = NONE;
    begin();
    while (turn.age < 10)
        one_tick();
    const uint32_t at = copies[copy].tick;
    const chain_state last = copies[copy].last[0];
    copy = tick(copy, NULL);
    check(turn.age == 0 && copies[copy].tick == at + 1, "a window goes on without a measurement", 0);
    check(memcmp(&last, copies[copy].last, sizeof last) == 0, "a measurement that is none", 0);
    one_tick();
    check(turn.age == 1 && turn.rows == 0, "a window spans a gap", 0);
    while (turn.phase != LOOK)
        one_tick();
    const memory was = copies[copy];
    copy = tick(copy, NULL); /* the guard sees what was wrong when the window has ended */
    check(turn.phase == SAMPLE && copies[copy].left_out == was.left_out, "a window that has just ended is looked at", 0);
    check(memcmp(was.held, copies[copy].held, sizeof was.held) == 0, "a window that has just ended is held out", 0);
}

/* What is left of earlier rows overflows: learning goes on. */
static void test_overflow(void)
{
    scene.every = PUSH, scene.where = ANYWHERE, scene.only = NONE;
    begin();
    while (copies[copy].begun < 3)
        one_tick();
    const uint32_t at = copies[copy].tick, accepted = copies[copy].accepted;
    copies[copy].older[P / 2] = INFINITY;
    while (copies[copy].tick < at + 4000)
        one_tick();
    check(copies[copy].accepted > accepted, "nothing is learned after an overflow", 0);
}

/* The hour as it is, or without checks. Returns the hash of what was learned. */
static uint64_t hour(int checks)
{
    float error = 0, least = 0;
    uint32_t accepted = 0;
    checked = checks;
    scene.every = PUSH, scene.where = ANYWHERE, scene.only = NONE;
    begin();
    while (copies[copy].tick < PARTS * PART) {
        const uint32_t at = copies[copy].tick;
        one_tick();
        if (at % PART == 0) make_clean(), least = error = error_of(&copies[copy].model);
        if (copies[copy].accepted != accepted) error = error_of(&copies[copy].model), accepted = copies[copy].accepted;
        if (error < least) least = error;
        note(&rows[checks][at / PART], &copies[copy], at, error, least);
    }
    return hash_of(&copies[copy]);
}

static uint64_t hour_with_cuts(void)
{
    checked = 1;
    begin();
    power.seed = 3, power.on = 1;
    if (setjmp(power.back)) {
        memset(&turn, 0, sizeof turn); /* start-up */
        power.cuts++;
        copy = kept_open(marks, copies, (int)sizeof *copies, origin);
        if (copy < 0) {
            power.on = 0;
            return 0;
        }
    }
    while (copies[copy].tick < PARTS * PART) {
        if (roln_uniform(&power.seed) < 1 / 1500.0f) longjmp(power.back, 1);
        one_tick();
    }
    power.on = 0;
    return hash_of(&copies[copy]);
}

/* The first part and the second. In the middle of each a hand pushes for BAD ticks, or one tick of 97 has a wrong velocity. */
static void play(places where, int every, kinds only)
{
    static const char *const name[] = {"anywhere", "to one side", "later to one region, to two others while a hand pushes"};
    float error = 0, until = 0, rise = 0, first = 0;
    uint32_t accepted = 0;
    checked = 1, scene.every = every, scene.where = where, scene.only = only;
    begin();
    for (uint32_t at = 0; at < 2 * PART; at++) {
        const memory *m;
        one_tick();
        m = &copies[copy];
        if (at % PART == 0) make_clean(), error = error_of(&m->model), first += error;
        if (m->accepted != accepted) error = error_of(&m->model), accepted = m->accepted;
        if (at % PART < PART / 2) until = error;
        if (error - until > rise) rise = error - until;
    }
    printf("chain moved every %d ticks, %s: %.1f mrad at first, %.2f at the end, ", every, name[where], (double)first / 2,
           (double)error);
    if (only == SPIKE) printf("spikes of %.0e rad/s in place of the push, ", (double)scene.spike);
    printf("rise behind the push %.2f, accepted %u, anew %u\n", (double)rise, accepted, copies[copy].anew);
    check(rise <= MARGIN / 4, "a push or a spike makes predictions worse", every);
    check(accepted >= 30 && error <= first / 4, "the payload is not learned", every);
}

/* ---- report ---- */

static void print_table(void)
{
    puts("| minute | payload | at first | 20 s | 40 s | disturbance: before, most | second one | end | largest rise "
         "| accepted, refused, left out | without checks: most, end |");
    puts("|---|---|---|---|---|---|---|---|---|---|---|");
    for (int p = 0; p < PARTS; p++) {
        static const row_of none;
        const row_of *r = &rows[1][p], *last = p > 0 ? r - 1 : &none, *un = &rows[0][p];
        printf("| %d | %+.0f %% | %.1f | %.2f | %.2f |", 4 * p, (double)(100 * payload[p]), (double)r->first, (double)r->at20,
               (double)r->at40);
        for (int k = 0; k < 2; k++)
            printf(" %s %.2f, %.2f |", name_of[(2 * p + k) % KINDS], (double)r->before[k], (double)r->most[k]);
        printf(" %.2f | %.2f | %u, %u, %u | %.1f, %.1f |\n", (double)r->end, (double)r->rise, r->accepted - last->accepted,
               r->refused - last->refused, r->left_out - last->left_out,
               (double)(un->most[0] > un->most[1] ? un->most[0] : un->most[1]), (double)un->end);
    }
}

int main(void)
{
    const row_of *last = &rows[1][PARTS - 1];
    float most = 0, trained, rise = 0;
    int late = 0, high = 0;
    test_held();
    test_dropped();
    test_overflow();
    test_votes();
    const uint64_t hash = hour(1), again = hour_with_cuts();
    hour(0);
    print_table();
    play(ONE_SIDE, PUSH, HAND);
    play(ANYWHERE, 400, HAND);
    play(ONE_SIDE, 400, HAND);
    play(ANYWHERE, 1000, HAND);
    play(ONE_SIDE, 1000, HAND);
    play(LEAVING, PUSH, HAND);
    for (scene.spike = 100; scene.spike < 1e13f; scene.spike *= 1e4f)
        play(ANYWHERE, PUSH, SPIKE);
    scene.where = ANYWHERE;
    for (int i = 0; i < N; i++)
        mass[i] = 0.1f;
    make_clean(), trained = error_of(&chain_weights);
    for (int p = 0; p < PARTS; p++) {
        const row_of *r = &rows[1][p];
        check(r->rise <= MARGIN, "an update makes predictions worse", p);
        check(r->end <= 0.75f * trained, "the payload is not learned", p);
        late += r->at40 > 1.5f * trained, high += r->rise > 1;
        for (int k = 0; k < 2; k++)
            check(r->most[k] <= r->before[k] + MARGIN / 4, name_of[(2 * p + k) % KINDS], p);
        if (r->rise > rise) rise = r->rise;
        for (int k = 0; k < 2; k++)
            if (rows[0][p].most[k] > most) most = rows[0][p].most[k];
    }
    check(late <= LATE_MOST, "parts are learned too late", late);
    check(last->anew >= PARTS / 2 && last->anew < PARTS, "learning begins anew at other times than changes", 0);
    check(outvoted == 0, "bad data decide", outvoted);
    check(busiest <= 2 * TRIES + HELD + 3, "a turn without end", busiest);
    check(hash == again, "other weights after power cuts", 0);
    check(power.cuts > 500 && power.in_saves > 100, "hardly any power cuts", 0);
    check(most > 50 * MARGIN, "the bad data are harmless", 0);
    printf("the trained model, its own machine: %.2f mrad\n", (double)trained);
    printf("figure: updates accepted %u, refused %u, turns left out %u; ", last->accepted, last->refused, last->left_out);
    printf("largest rise %.2f mrad, above 1 mrad in %d parts, %d parts not learned within 40 s; ", (double)rise, high, late);
    printf("without checks errors up to %.0f mrad\n", (double)most);
    printf("figure: power cuts %u, of them %u within a save; the same bits\n", power.cuts, power.in_saves);
    printf("%d passed, %d failed\n", passed, failed);
    return failed > 0;
}
