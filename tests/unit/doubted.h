/* SPDX-License-Identifier: MIT */
/* doubted.h - doubt of one model, for test_doubt.c. Include behind the model, with DOUBTED(x) = NAME_x. Defines NAME_test_doubt()
   and NAME_model_of(). */
#define T__(x) DOUBTED(x)
#define T_(x) T__(test_##x)

/* A model of random weights with a range. */
static void T__(model_of)(DOUBTED(params) *p)
{
    static DOUBTED(start) w;
    uint64_t seed = 5;
    int i;
    CHECK_OK(DOUBTED(init)(p, &seed, &w.init));
    p->scale.q = DOUBTED(angles) ? 1 : 2, p->scale.t = ROLN_C(0.5), p->scale.m = ROLN_C(0.25);
    p->dt = ROLN_C(0.001);
    for (i = 0; i < DOUBTED(n); i++)
        p->z_min[i] = ROLN_C(-1.5), p->z_max[i] = 1, p->zd_max[i] = 3;
}

/* A state of z, zd, by the decoder: then it is what the encoder finds. */
static void T_(state)(const DOUBTED(params) *p, uint64_t *seed, roln_real *q, roln_real *qd, DOUBTED(latent) *s)
{
    static DOUBTED(work) w;
    DOUBTED(state) x = {{0}, {0}};
    int i;
    for (i = 0; i < DOUBTED(n); i++) {
        s->z[i] = p->z_min[i] + (p->z_max[i] - p->z_min[i]) * roln_uniform(seed);
        s->zd[i] = p->zd_max[i] * (2 * roln_uniform(seed) - 1);
    }
    CHECK_OK(DOUBTED(decode)(p, s, &x, &w.decode));
    CHECK_OK(DOUBTED(encode)(p, &x, s, &w.encode));
    memcpy(q, x.q, sizeof x.q), memcpy(qd, x.qd, sizeof x.qd);
}

/* The terms of a state by their definition. */
static void T_(terms)(const DOUBTED(params) *p, const DOUBTED(latent) *s, ld *t)
{
    enum { n = DOUBTED(n), into = DOUBTED(net_inputs) };
    ld x[into], v[n];
    int i, j, made = 1, sine = n;
    for (i = 0; i < n; i++) {
        const ld low = (ld)p->z_min[i], high = (ld)p->z_max[i];
        v[i] = (ld)s->zd[i] / (ld)p->zd_max[i];
        x[i] = ((ld)s->z[i] - (low + high) / 2) / ((high - low) / 2);
        if (DOUBTED(angles) >> i & 1) x[i] = cosl((ld)s->z[i]), x[sine++] = sinl((ld)s->z[i]);
    }
    t[0] = 1;
    made += products(into, x, DOUBTED(degree_z) > 0 ? DOUBTED(degree_z) : 1, 1, 0, t + made);
    for (i = 0; i < into && n <= 8; i++) /* cos(k arccos x), for any x */
        for (j = DOUBTED(degree_z) + 1; j <= 6; j++) {
            const ld y = fabsl(x[i]), T = y > 1 ? coshl(j * acoshl(y)) : cosl(j * acosl(y));
            t[made++] = x[i] < 0 && j % 2 ? -T : T;
        }
    for (i = 0; i < n; i++)
        t[made++] = v[i];
    for (i = 0; i < n && n <= 8; i++) {
        for (j = 0; j < into; j++)
            t[made++] = v[i] * x[j];
        for (j = i; j < n; j++)
            t[made++] = v[i] * v[j];
    }
    CHECK(made == DOUBTED(terms));
}

/* The mean of novelties over what was seen is 1, but for dependent terms and what stood for states at first; parts of recordings
   add up. */
static void T_(seen)(const DOUBTED(params) *p, const DOUBTED(evidence) *e, int seen, roln_real *q, roln_real *qd)
{
    enum { N = DOUBTED(N) };
    static DOUBTED(evidence) again;
    static DOUBTED(evidence_add_work) w;
    static DOUBTED(doubt_work) doubt;
    roln_batch b = {1, seen / 2 - 1, 1, NULL, q, qd, NULL, NULL};
    DOUBTED(latent) s;
    DOUBTED(doubts) d;
    uint64_t seed = 7;
    ld mean = 0;
    int k;
    for (k = 0; k < seen; k++) {
        T_(state)(p, &seed, q + k * N, qd + k * N, &s);
        CHECK_OK(DOUBTED(doubt)(p, e, &s, &d, &doubt));
        mean += (ld)d.novelty / seen;
    }
    CHECK_BELOW(mean, 1 + 1 / (ld)seen);
    CHECK_BELOW(DOUBTED(angles) ? 0.4L : 0.5L, mean);
    memset(&again, 0, sizeof again);
    CHECK_OK(DOUBTED(evidence_add)(p, &b, &again, &w));
    b.q += seen / 2 * N, b.qd += seen / 2 * N, b.steps = seen - seen / 2 - 1;
    CHECK_OK(DOUBTED(evidence_add)(p, &b, &again, &w));
    CHECK(memcmp(e, &again, sizeof again) == 0);
}

/* Novelty is t^T A^-1 t / m of A = (1 + sum t t^T) / count; the same on every turn. */
static void T_(novelty)(void)
{
    enum { n = DOUBTED(n), N = DOUBTED(N), m = DOUBTED(terms), SEEN = 3 * m };
    static roln_real q[SEEN * N], qd[SEEN * N];
    static ld A[m * m], B[m * m], t[m], y[m];
    static DOUBTED(params) p;
    static DOUBTED(evidence) e;
    static DOUBTED(train) w;
    static DOUBTED(work) tick;
    const roln_batch b = {1, SEEN - 1, 1, NULL, q, qd, NULL, NULL};
    DOUBTED(latent) s;
    DOUBTED(doubts) d;
    uint64_t seed = 7;
    int k, i, j;
    T__(model_of)(&p);
    memset(A, 0, sizeof A);
    for (i = 0; i < m; i++)
        A[i * (m + 1)] = 1;
    for (k = 0; k < SEEN; k++) {
        T_(state)(&p, &seed, q + k * N, qd + k * N, &s);
        T_(terms)(&p, &s, t);
        for (i = 0; i < m; i++)
            for (j = 0; j < m; j++)
                A[i * m + j] += t[i] * t[j];
    }
    for (i = 0; i < m * m; i++)
        A[i] /= SEEN + 1;
    memset(&e, 0, sizeof e);
    CHECK_OK(DOUBTED(evidence_add)(&p, &b, &e, &w.evidence_add));
    CHECK_NEAR(e.count, SEEN + 1, 0);
    for (k = 0; k < 40; k++) {
        ld expected = 0;
        T_(state)(&p, &seed, q, qd, &s); /* q: the first sample is spent */
        for (i = 0; i < n; i++)
            s.z[i] *= k < 30 ? 1 : 2, s.zd[i] *= k < 30 ? 1 : 2; /* far out, too */
        T_(terms)(&p, &s, t);
        memcpy(B, A, sizeof A), memcpy(y, t, sizeof t);
        solve(m, B, y);
        for (i = 0; i < m; i++)
            expected += t[i] * y[i] / m;
        CHECK_OK(DOUBTED(doubt)(&p, &e, &s, &d, &tick.doubt));
        CHECK_NEAR(d.novelty, expected, 4096 * (ld)ROLN_EPS * expected);
        for (i = 0; i < n; i++)
            if (DOUBTED(angles) >> i & 1) s.z[i] += ROLN_C(6.28318530717958648);
        if (!DOUBTED(angles)) continue;
        CHECK_OK(DOUBTED(doubt)(&p, &e, &s, &d, &tick.doubt));
        CHECK_NEAR(d.novelty, expected, 8192 * (ld)ROLN_EPS * expected);
    }
    T_(seen)(&p, &e, SEEN, q, qd);
}

/* Recordings of one step whose ends are off by errors of the acceleration with a deviation that grows as 0.3^2 + 0.8^2 novelty^2:
   it is found, in this law. M times the error is the force. */
static void T_(deviations)(void)
{
    enum { n = DOUBTED(n), N = DOUBTED(N), SEEN = 400, TRIED = 3000, halves = 4 };
    static roln_real q[2 * TRIED * N], qd[2 * TRIED * N];
    static DOUBTED(params) p;
    static DOUBTED(evidence) e, kept;
    static DOUBTED(train) w;
    static DOUBTED(work) tick;
    const roln_real dt = ROLN_C(0.0078125);
    roln_batch b = {TRIED, 1, 1, NULL, q, qd, NULL, NULL};
    DOUBTED(latent) s;
    DOUBTED(doubts) d;
    DOUBTED(state) x = {{0}, {0}};
    uint64_t seed = 11;
    int k, i;
    T__(model_of)(&p);
    memset(&e, 0, sizeof e);
    for (k = 0; k < SEEN; k++)
        T_(state)(&p, &seed, q + k * N, qd + k * N, &s);
    b.count = 1, b.steps = SEEN - 1;
    CHECK_OK(DOUBTED(evidence_add)(&p, &b, &e, &w.evidence_add));
    for (k = 0; k < TRIED; k++) {
        T_(state)(&p, &seed, q + 2 * k * N, qd + 2 * k * N, &s);
        if (k % 2) { /* half of them at the edge, where novelty is larger */
            for (i = 0; i < n; i++)
                s.z[i] *= ROLN_C(1.5), s.zd[i] *= ROLN_C(1.5);
            CHECK_OK(DOUBTED(decode)(&p, &s, &x, &tick.decode));
            memcpy(q + 2 * k * N, x.q, sizeof x.q), memcpy(qd + 2 * k * N, x.qd, sizeof x.qd);
        }
        CHECK_OK(DOUBTED(doubt)(&p, &e, &s, &d, &tick.doubt));
        CHECK_OK(DOUBTED(step)(&p, &s, NULL, dt, &tick.step));
        for (i = 0; i < n; i++)
            s.zd[i] += dt * (roln_real)sqrt(0.09 + 0.64 * pow((double)d.novelty, halves / 2.0)) * roln_normal(&seed);
        CHECK_OK(DOUBTED(decode)(&p, &s, &x, &tick.decode));
        memcpy(q + (2 * k + 1) * N, x.q, sizeof x.q), memcpy(qd + (2 * k + 1) * N, x.qd, sizeof x.qd);
    }
    b.count = TRIED, b.steps = 1;
    kept = e;
    CHECK_OK(DOUBTED(fit_doubt)(&p, &b, dt, &e, &w.fit_doubt));
    CHECK(memcmp(e.L, kept.L, sizeof e.L) == 0);
    CHECK_BELOW(abs(e.halves - halves), 1);
    CHECK_NEAR(e.lasts, 0, 0);
    for (k = 0; k < 5; k++) { /* inside and outside */
        T_(state)(&p, &seed, q, qd, &s);
        for (i = 0; i < n && k > 2; i++)
            s.z[i] *= ROLN_C(1.5), s.zd[i] *= ROLN_C(1.5);
        CHECK_OK(DOUBTED(doubt)(&p, &e, &s, &d, &tick.doubt));
        for (i = 0; i < n; i++) {
            const double expected = sqrt(0.09 + 0.64 * pow((double)d.novelty, halves / 2.0));
            CHECK_NEAR(d.zdd[i], expected, 0.2 * expected);
            CHECK(d.force[i] > 0);
        }
    }
    e = kept;
    for (i = 0; i < 3; i++) { /* no number; errors whose squares are none */
        qd[(TRIED + 1) * N] = i == 0 ? (roln_real)NAN : (roln_real)(sizeof(roln_real) > 4 ? 1e150 : i == 1 ? 1e14 : 1e20);
        CHECK(DOUBTED(fit_doubt)(&p, &b, dt, &e, &w.fit_doubt) != ROLN_OK && memcmp(&e, &kept, sizeof e) == 0);
    }
}

/* A step of the covariance P of the larger system (z, zd, x): x+ = r x + noise, and the mean of x over the step, a x + noise, moves
   z, zd. Both noises come from the variance m of this mean, its correlation a with x and x+, and 1. */
static void T_(larger)(const roln_real *A, const roln_real *zdd, roln_real dt, ld u, ld *P)
{
    enum { n = DOUBTED(n), n2 = 2 * n, n3 = 3 * n };
    const ld r = expl(-u), a = -expm1l(-u) / u, m = 2 * (u + expm1l(-u)) / (u * u);
    ld F[n3 * n3], Q[n3 * n3], G[n2];
    int i, j, l;
    memset(F, 0, sizeof F);
    for (i = 0; i < n2; i++)
        for (j = 0; j < n2; j++)
            F[i * n3 + j] = (ld)A[i * n2 + j];
    for (i = 0; i < n; i++) {
        G[i] = (ld)dt * (ld)dt / 2 * (ld)zdd[i], G[n + i] = (ld)dt * (ld)zdd[i];
        F[(n2 + i) * (n3 + 1)] = r;
    }
    for (i = 0; i < n2; i++)
        F[i * n3 + n2 + i % n] = a * G[i];
    for (i = 0; i < n3; i++)
        for (j = 0; j < n3; j++)
            for (Q[i * n3 + j] = 0, l = 0; l < n3; l++)
                Q[i * n3 + j] += F[i * n3 + l] * P[l * n3 + j];
    for (i = 0; i < n3; i++)
        for (j = 0; j < n3; j++) {
            const ld gi = i < n2 ? G[i] : 0, gj = j < n2 ? G[j] : 0;
            P[i * n3 + j] = i % n != j % n ? 0
                            : i < n2 && j < n2 ? (m - a * a) * gi * gj
                            : i < n2 || j < n2 ? (a - r * a) * (gi + gj)
                                               : 1 - r * r;
            for (l = 0; l < n3; l++)
                P[i * n3 + j] += Q[i * n3 + l] * F[j * n3 + l];
        }
}

/* The covariance of a roll-out is the part of z, zd of that of the larger system. */
static void T_(ahead)(void)
{
    enum { n = DOUBTED(n), N = DOUBTED(N), n2 = 2 * n, n3 = 3 * n, STEPS = 20 };
    static DOUBTED(params) p;
    static DOUBTED(evidence) e;
    static DOUBTED(outlook) o, kept;
    static DOUBTED(doubt_ahead_work) w;
    static DOUBTED(linear_work) linear;
    static DOUBTED(work) tick;
    static DOUBTED(train) train;
    static roln_real q[100 * N], qd[100 * N];
    ld P[n3 * n3] = {0};
    const roln_real dt = ROLN_C(0.015625);
    roln_batch b = {1, 99, 1, NULL, q, qd, NULL, NULL};
    DOUBTED(latent) s, other;
    DOUBTED(jacobian) step;
    DOUBTED(doubts) d;
    roln_real tau[DOUBTED(force_size)];
    uint64_t seed = 13;
    int k, i;
    T__(model_of)(&p);
    memset(&e, 0, sizeof e), memset(&o, 0, sizeof o);
    for (k = 0; k < 100; k++)
        T_(state)(&p, &seed, q + k * N, qd + k * N, &s);
    CHECK_OK(DOUBTED(evidence_add)(&p, &b, &e, &train.evidence_add));
    for (i = 0; i < n2; i++)
        e.always[i] = ROLN_C(0.25), e.grows[i] = (roln_real)(1 + i) / 8;
    e.halves = 2;
    for (i = 0; i < n; i++)
        P[(n2 + i) * (n3 + 1)] = 1, s.z[i] /= 2, s.zd[i] /= 2;
    for (k = 0; k < STEPS; k++) {
        ld most = 0;
        e.lasts = k % 2 ? 4 * dt : dt / 4; /* on both sides of a step */
        for (i = 0; i < DOUBTED(force_size); i++)
            tau[i] = roln_normal(&seed) / 4;
        other = s;
        CHECK_OK(DOUBTED(doubt)(&p, &e, &s, &d, &tick.doubt));
        CHECK_OK(DOUBTED(linear)(&p, &other, tau, dt, &step, &linear));
        T_(larger)(step.A, d.zdd, dt, (ld)dt / (ld)e.lasts, P);
        CHECK_OK(DOUBTED(doubt_ahead)(&p, &e, &s, tau, dt, &o, &w));
        CHECK(memcmp(&s, &other, sizeof s) == 0);
        for (i = 0; i < n2 * n2; i++)
            most = fmaxl(most, fabsl(P[i / n2 * n3 + i % n2]));
        for (i = 0; i < n2 * n2; i++)
            CHECK_NEAR(o.P[i], P[i / n2 * n3 + i % n2], 512 * (ld)ROLN_EPS * most);
    }
    kept = o, other = s;
    o.P[0] = (roln_real)INFINITY;
    CHECK(DOUBTED(doubt_ahead)(&p, &e, &s, tau, dt, &o, &w) == ROLN_E_NOT_FINITE);
    o = kept, e.count = 0;
    CHECK(DOUBTED(doubt_ahead)(&p, &e, &s, tau, dt, &o, &w) == ROLN_E_RANGE);
    e.count = 100;
    CHECK(DOUBTED(doubt_ahead)(&p, &e, &s, tau, -dt, &o, &w) == ROLN_E_RANGE);
    e.lasts = 0;
    CHECK(DOUBTED(doubt_ahead)(&p, &e, &s, tau, dt, &o, &w) == ROLN_E_RANGE);
    e.lasts = dt, tau[0] = (roln_real)NAN;
    CHECK(DOUBTED(doubt_ahead)(&p, &e, &s, tau, dt, &o, &w) == ROLN_E_NOT_FINITE);
    CHECK(memcmp(&o, &kept, sizeof o) == 0 && memcmp(&s, &other, sizeof s) == 0);
}

/* Half steps end with the same covariance, whether errors last for a part of a step or for many. */
static void T_(halves)(void)
{
    enum { n = DOUBTED(n), N = DOUBTED(N), n2 = 2 * n, STEPS = 32 };
    static DOUBTED(params) p;
    static DOUBTED(evidence) e;
    static DOUBTED(doubt_ahead_work) w;
    static DOUBTED(train) train;
    const roln_real dt = ROLN_C(0.00390625);
    roln_real q[N], qd[N];
    const roln_batch b = {1, 0, 1, NULL, q, qd, NULL, NULL};
    DOUBTED(latent) start;
    uint64_t seed = 14;
    int way, part, k, i;
    T__(model_of)(&p);
    memset(&e, 0, sizeof e);
    T_(state)(&p, &seed, q, qd, &start);
    CHECK_OK(DOUBTED(evidence_add)(&p, &b, &e, &train.evidence_add));
    for (i = 0; i < n2; i++)
        e.always[i] = ROLN_C(0.25);
    e.halves = 2;
    for (i = 0; i < n; i++)
        start.z[i] /= 4, start.zd[i] /= 4;
    for (way = 0; way < 3; way++) {
        static DOUBTED(outlook) o[2];
        memset(o, 0, sizeof o);
        e.lasts = way == 0 ? dt / 8 : way == 1 ? dt : 16 * dt;
        for (part = 1; part <= 2; part++) {
            DOUBTED(latent) s = start;
            for (k = 0; k < STEPS * part; k++)
                CHECK_OK(DOUBTED(doubt_ahead)(&p, &e, &s, NULL, dt / (roln_real)part, o + part - 1, &w));
        }
        for (i = 0; i < n2; i++)
            CHECK_NEAR(o[1].P[i * (n2 + 1)] / o[0].P[i * (n2 + 1)], 1, 0.03);
    }
}

/* The time that NAME_fit_outlook is to find, by its definition, from a roll-out for each time. */
static double T_(longest)(const DOUBTED(params) *p, const roln_batch *b, roln_real dt, DOUBTED(evidence) e)
{
    enum { N = DOUBTED(N), n = DOUBTED(n), TIMES = 10 };
    static DOUBTED(doubt_ahead_work) w;
    static DOUBTED(work) tick;
    static DOUBTED(outlook) o;
    const double whole = b->steps * (double)dt;
    double cost[TIMES] = {0}, least = 1e300;
    int t, k, h, i;
    for (t = 0; t < TIMES; t++) {
        e.lasts = (roln_real)(whole / pow(2, t));
        for (k = 0; k < b->count; k++) {
            DOUBTED(latent) s, seen;
            DOUBTED(state) x;
            memset(&o, 0, sizeof o);
            for (h = 0; h <= b->steps; h++) {
                const size_t at = (size_t)(k * (b->steps + 1) + h) * N;
                memcpy(x.q, b->q + at, sizeof x.q), memcpy(x.qd, b->qd + at, sizeof x.qd);
                CHECK_OK(DOUBTED(encode)(p, &x, h ? &seen : &s, &tick.encode));
                for (i = 0; i < n && (h == b->steps || h == b->steps / 2 || h == b->steps / 4 || h == b->steps / 8); i++) {
                    const ld variance = (ld)o.P[i * (2 * n + 1)], turn = 6.28318530717958647693L;
                    ld off = (ld)seen.z[i] - (ld)s.z[i];
                    if (DOUBTED(angles) >> i & 1) off -= turn * roundl(off / turn);
                    cost[t] += (double)(off * off / variance + logl(variance));
                }
                if (h < b->steps) CHECK_OK(DOUBTED(doubt_ahead)(p, &e, &s, NULL, dt, &o, &w));
            }
        }
        least = fmin(least, cost[t]);
    }
    for (t = 0; cost[t] > least + 16; t++)
        continue;
    return whole / pow(2, t);
}

/* Recordings whose errors stay alike for a time: it is found, up to a factor of four, and taken for longer where there are few. */
static void T_(lasts)(void)
{
    enum { n = DOUBTED(n), N = DOUBTED(N), WINDOWS = 120, STEPS = 32 };
    static roln_real q[WINDOWS * (STEPS + 1) * N], qd[WINDOWS * (STEPS + 1) * N];
    static DOUBTED(params) p;
    static DOUBTED(evidence) e;
    static DOUBTED(fit_outlook_work) w;
    static DOUBTED(train) train;
    static DOUBTED(work) tick;
    const roln_real dt = ROLN_C(0.0078125);
    const roln_batch b = {WINDOWS, STEPS, 1, NULL, q, qd, NULL, NULL}, few = {1, STEPS, 1, NULL, q, qd, NULL, NULL};
    roln_batch some = few;
    roln_real of_few;
    DOUBTED(latent) s;
    DOUBTED(state) x = {{0}, {0}};
    uint64_t seed = 17;
    int length, k, h, i;
    T__(model_of)(&p);
    for (length = 1; length <= STEPS; length *= 32) {
        const double keeps = length == 1 ? 0 : exp(-1.0 / length);
        memset(&e, 0, sizeof e);
        for (k = 0; k < WINDOWS; k++) {
            roln_real error[n];
            roln_real *const at = q + k * (STEPS + 1) * N, *const v = qd + k * (STEPS + 1) * N;
            T_(state)(&p, &seed, at, v, &s);
            for (i = 0; i < n; i++)
                s.z[i] /= 4, s.zd[i] /= 4, error[i] = roln_normal(&seed);
            for (h = 0; h <= STEPS; h++) {
                CHECK_OK(DOUBTED(decode)(&p, &s, &x, &tick.decode));
                memcpy(at + h * N, x.q, sizeof x.q), memcpy(v + h * N, x.qd, sizeof x.qd);
                CHECK_OK(DOUBTED(step)(&p, &s, NULL, dt, &tick.step));
                for (i = 0; i < n; i++) {
                    s.zd[i] += dt * error[i] / 4, s.z[i] += dt * dt / 2 * error[i] / 4;
                    error[i] = (roln_real)keeps * error[i] + (roln_real)sqrt(1 - keeps * keeps) * roln_normal(&seed);
                }
            }
        }
        CHECK_OK(DOUBTED(evidence_add)(&p, &b, &e, &train.evidence_add));
        for (i = 0; i < 2 * n; i++)
            e.always[i] = ROLN_C(0.25);
        e.lasts = 1, e.halves = 2;
        CHECK_OK(DOUBTED(fit_outlook)(&p, &few, dt, &e, &w));
        of_few = e.lasts;
        for (some.count = 1; some.count <= 16; some.count += 5) {
            CHECK_OK(DOUBTED(fit_outlook)(&p, &some, dt, &e, &w));
            CHECK_NEAR(e.lasts, T_(longest)(&p, &some, dt, e), 1e-6L);
        }
        CHECK_OK(DOUBTED(fit_outlook)(&p, &b, dt, &e, &w));
        CHECK(of_few >= 2 * e.lasts || of_few >= STEPS * dt);
        if (length == 1) CHECK_BELOW(e.lasts / dt, 1);
        else CHECK_BELOW(fabs(log((double)(e.lasts / dt) / length)), log(4.0));
    }
}

/* What cannot be known is told, and nothing is written. */
static void T_(refusals)(void)
{
    enum { N = DOUBTED(N), n = DOUBTED(n) };
    static DOUBTED(params) p, other;
    static DOUBTED(evidence) e, kept;
    static DOUBTED(train) w;
    static DOUBTED(fit_outlook_work) ow;
    static DOUBTED(work) tick;
    static roln_real q[20 * N], qd[20 * N];
    roln_batch b = {1, 19, 1, NULL, q, qd, NULL, NULL}, none = b, still = b;
    DOUBTED(latent) s;
    DOUBTED(doubts) d, before;
    uint64_t seed = 19;
    int k;
    T__(model_of)(&p);
    for (k = 0; k < 20; k++)
        T_(state)(&p, &seed, q + k * N, qd + k * N, &s);
    memset(&e, 0, sizeof e), memset(&d, 1, sizeof d);
    before = d, kept = e;
    none.count = 0, still.qd = NULL;
    CHECK(DOUBTED(doubt)(&p, &e, &s, &d, &tick.doubt) == ROLN_E_RANGE && memcmp(&d, &before, sizeof d) == 0);
    CHECK(DOUBTED(fit_doubt)(&p, &b, ROLN_C(0.01), &e, &w.fit_doubt) == ROLN_E_RANGE);
    CHECK(DOUBTED(fit_outlook)(&p, &b, ROLN_C(0.01), &e, &ow) == ROLN_E_RANGE);
    CHECK(DOUBTED(evidence_add)(&p, &none, &e, &w.evidence_add) == ROLN_E_LENGTH);
    CHECK(DOUBTED(evidence_add)(&p, &still, &e, &w.evidence_add) == ROLN_E_LENGTH);
    other = p, other.z_max[n - 1] = other.z_min[n - 1];
    CHECK(DOUBTED(evidence_add)(&other, &b, &e, &w.evidence_add) == ROLN_E_RANGE);
    other = p, other.slope = 0;
    CHECK(DOUBTED(evidence_add)(&other, &b, &e, &w.evidence_add) == ROLN_E_SHAPE);
    CHECK(memcmp(&e, &kept, sizeof e) == 0);
    CHECK_OK(DOUBTED(evidence_add)(&p, &b, &e, &w.evidence_add));
    kept = e;
    CHECK(DOUBTED(fit_doubt)(&p, &none, ROLN_C(0.01), &e, &w.fit_doubt) == ROLN_E_LENGTH);
    CHECK(DOUBTED(fit_doubt)(&p, &still, ROLN_C(0.01), &e, &w.fit_doubt) == ROLN_E_LENGTH);
    CHECK(DOUBTED(fit_doubt)(&p, &b, 0, &e, &w.fit_doubt) == ROLN_E_RANGE);
    CHECK(DOUBTED(fit_outlook)(&p, &none, ROLN_C(0.01), &e, &ow) == ROLN_E_LENGTH);
    CHECK(DOUBTED(fit_outlook)(&p, &still, ROLN_C(0.01), &e, &ow) == ROLN_E_LENGTH);
    CHECK(DOUBTED(fit_outlook)(&p, &b, (roln_real)NAN, &e, &ow) == ROLN_E_RANGE);
    CHECK(DOUBTED(doubt)(&other, &e, &s, &d, &tick.doubt) == ROLN_E_SHAPE);
    CHECK(DOUBTED(fit_doubt)(&other, &b, ROLN_C(0.01), &e, &w.fit_doubt) == ROLN_E_SHAPE);
    CHECK(DOUBTED(fit_outlook)(&other, &b, ROLN_C(0.01), &e, &ow) == ROLN_E_SHAPE);
    for (none = b, none.stride = -1; none.stride < 1; none.stride++) {
        CHECK(DOUBTED(evidence_add)(&p, &none, &e, &w.evidence_add) == ROLN_E_LENGTH);
        CHECK(DOUBTED(fit_doubt)(&p, &none, ROLN_C(0.01), &e, &w.fit_doubt) == ROLN_E_LENGTH);
        CHECK(DOUBTED(fit_outlook)(&p, &none, ROLN_C(0.01), &e, &ow) == ROLN_E_LENGTH);
    }
    for (e.halves = -1; e.halves <= 9; e.halves++)
        CHECK((DOUBTED(doubt)(&p, &e, &s, &d, &tick.doubt) == ROLN_OK) == (e.halves >= 0 && e.halves <= 8));
    e.halves = kept.halves, d = before;
    s.zd[0] = (roln_real)NAN;
    CHECK(DOUBTED(doubt)(&p, &e, &s, &d, &tick.doubt) == ROLN_E_NOT_FINITE && memcmp(&d, &before, sizeof d) == 0);
    CHECK(memcmp(&e, &kept, sizeof e) == 0);
    qd[7 * N] = (roln_real)NAN; /* states before the bad one count */
    CHECK(DOUBTED(evidence_add)(&p, &b, &e, &w.evidence_add) != ROLN_OK);
    CHECK_NEAR(e.count, kept.count + 7, 0);
    e.count = 1 / (64 * ROLN_EPS); /* the oldest fade */
    qd[7 * N] = 0;
    CHECK_OK(DOUBTED(evidence_add)(&p, &b, &e, &w.evidence_add));
    CHECK_NEAR(e.count, 1 / (64 * ROLN_EPS), 0);
}

/* Recordings that fail on the way: at the start of a window, in a step, or behind it. */
static void T_(failures)(void)
{
    enum { N = DOUBTED(N), n = DOUBTED(n), STEPS = 3, F = DOUBTED(force_size) };
    static DOUBTED(params) p;
    static DOUBTED(evidence) e, kept, empty;
    static DOUBTED(train) w;
    static DOUBTED(fit_outlook_work) ow;
    static DOUBTED(work) tick;
    static roln_real q[(STEPS + 1) * N], qd[(STEPS + 1) * N], tau[(STEPS + 1) * F], fast[(STEPS + 1) * N];
    const roln_real dt = ROLN_C(0.0078125), nan = (roln_real)NAN;
    roln_batch b = {1, STEPS, 1, NULL, q, qd, NULL, NULL}, short_ = b;
    roln_real was;
    DOUBTED(latent) s;
    DOUBTED(doubts) d;
    uint64_t seed = 29;
    int k, i;
    T__(model_of)(&p);
    for (k = 0; k <= STEPS; k++)
        T_(state)(&p, &seed, q + k * N, qd + k * N, &s);
    memset(&e, 0, sizeof e);
    CHECK_OK(DOUBTED(evidence_add)(&p, &b, &e, &w.evidence_add));
    for (i = 0; i < 2 * n; i++)
        e.always[i] = 1;
    e.lasts = dt, kept = e;
    short_.steps = 0;
    CHECK(DOUBTED(fit_doubt)(&p, &short_, dt, &e, &w.fit_doubt) == ROLN_E_LENGTH);
    CHECK(DOUBTED(fit_outlook)(&p, &short_, dt, &e, &ow) == ROLN_E_LENGTH);
    short_.steps = -1;
    CHECK(DOUBTED(evidence_add)(&p, &short_, &e, &w.evidence_add) == ROLN_E_LENGTH);
    b.tau = tau;
    CHECK_OK(DOUBTED(fit_doubt)(&p, &b, dt, &e, &w.fit_doubt)), e = kept;
    CHECK_OK(DOUBTED(fit_outlook)(&p, &b, dt, &e, &ow)), e = kept;
    tau[F] = nan; /* the second step */
    CHECK(DOUBTED(fit_doubt)(&p, &b, dt, &e, &w.fit_doubt) == ROLN_E_NOT_FINITE);
    CHECK(DOUBTED(fit_outlook)(&p, &b, dt, &e, &ow) == ROLN_E_NOT_FINITE);
    tau[F] = 0;
    memcpy(fast, qd, sizeof qd), b.qd = fast, fast[0] = nan; /* the start */
    CHECK(DOUBTED(fit_doubt)(&p, &b, dt, &e, &w.fit_doubt) == ROLN_E_NOT_FINITE);
    CHECK(DOUBTED(fit_outlook)(&p, &b, dt, &e, &ow) == ROLN_E_NOT_FINITE);
    b.qd = qd, was = q[STEPS * N], q[STEPS * N] = nan; /* the end */
    CHECK(DOUBTED(fit_outlook)(&p, &b, dt, &e, &ow) == ROLN_E_NOT_FINITE);
    CHECK(memcmp(&e, &kept, sizeof e) == 0);
    q[STEPS * N] = was;
    memset(e.always, 0, sizeof e.always); /* no deviation: no likelihood */
    CHECK(DOUBTED(fit_outlook)(&p, &b, dt, &e, &ow) == ROLN_E_NOT_FINITE);
    e.L[0] = (roln_real)(sizeof(roln_real) > 4 ? 1e-200 : 1e-30); /* a novelty that is too large for a number */
    CHECK(DOUBTED(fit_doubt)(&p, &b, dt, &e, &w.fit_doubt) == ROLN_E_NOT_FINITE);
    e = kept, e.L[0] *= (roln_real)(sizeof(roln_real) > 4 ? 1e-60 : 1e-15); /* .. whose growth is too large for a double */
    CHECK_OK(DOUBTED(fit_doubt)(&p, &b, dt, &e, &w.fit_doubt));
    CHECK(roln_all_finite(2 * n, e.always) && roln_all_finite(2 * n, e.grows));
    e = kept, e.L[0] = nan;
    CHECK(DOUBTED(fit_doubt)(&p, &b, dt, &e, &w.fit_doubt) == ROLN_E_NOT_FINITE);
    CHECK(DOUBTED(doubt)(&p, &e, &s, &d, &tick.doubt) == ROLN_E_NOT_FINITE);
    e = kept, e.halves = 0; /* each is a number, both are none */
    e.always[n] = e.grows[n] = (roln_real)(sizeof(roln_real) > 4 ? 1.5e308 : 3e38);
    CHECK(DOUBTED(doubt)(&p, &e, &s, &d, &tick.doubt) == ROLN_E_NOT_FINITE);
    memset(&empty, 0, sizeof empty);
    p.zd_max[n - 1] = 0;
    CHECK(DOUBTED(evidence_add)(&p, &b, &empty, &w.evidence_add) == ROLN_E_RANGE);
}

/* NAME_fit_limits: novelty is slack times the largest of the recordings; with less the guard speaks, with it it does not. */
static void T_(limits)(void)
{
    enum { N = DOUBTED(N), n = DOUBTED(n), F = DOUBTED(force_size), SEEN = 60 };
    static roln_real q[SEEN * N], qd[SEEN * N], tau[F], rate[F];
    static DOUBTED(params) p;
    static DOUBTED(evidence) e;
    static DOUBTED(train) w;
    static DOUBTED(work) tick;
    static const roln_real zero[F] = {0};
    roln_batch b = {SEEN / 2, 1, 1, NULL, q, qd, NULL, NULL};
    roln_limits l = {.dt = ROLN_C(0.01), .tau = 1, .evidence = e.L};
    DOUBTED(state) x = {{0}, {0}};
    DOUBTED(latent) s;
    uint64_t seed = 23;
    int k, less, speaks = 0;
    T__(model_of)(&p);
    for (k = 0; k < SEEN; k++)
        T_(state)(&p, &seed, q + k * N, qd + k * N, &s);
    memset(&e, 0, sizeof e);
    CHECK_OK(DOUBTED(evidence_add)(&p, &b, &e, &w.evidence_add));
    CHECK_OK(DOUBTED(fit_limits)(&p, &b, 1, &l, tau, rate, &w.fit_limits));
    CHECK(l.evidence == e.L && l.novelty > 0);
    l.residual = 0, l.q_tolerance = l.qd_tolerance = 0;
    for (less = 0; less < 2; less++)
        for (k = 0; k < SEEN; k++) {
            DOUBTED(guard) g;
            uint32_t faults;
            memset(&g, 0, sizeof g);
            memcpy(x.q, q + k * N, sizeof x.q), memcpy(x.qd, qd + k * N, sizeof x.qd);
            CHECK_OK(DOUBTED(encode)(&p, &x, &s, &tick.encode));
            if (less) l.novelty *= k == 0 ? ROLN_C(0.999) : 1;
            faults = DOUBTED(guard_tick)(&p, &l, &x, &s, zero, &g, &tick.guard_tick);
            if (less) speaks += faults != 0;
            else CHECK(faults == 0);
        }
    CHECK(speaks == 1);
    {
        const roln_real once = l.novelty / ROLN_C(0.999);
        CHECK_OK(DOUBTED(fit_limits)(&p, &b, 4, &l, tau, rate, &w.fit_limits));
        CHECK_NEAR(l.novelty, 4 * once, 16 * ROLN_EPS * once);
    }
    e.L[0] = (roln_real)NAN;
    CHECK(DOUBTED(fit_limits)(&p, &b, 4, &l, tau, rate, &w.fit_limits) == ROLN_E_NOT_FINITE);
}

static void T_(doubt)(void)
{
    T_(novelty)();
    T_(deviations)();
    T_(ahead)();
    T_(halves)();
    T_(lasts)();
    T_(refusals)();
    T_(failures)();
    T_(limits)();
}
#undef T_
#undef T__
