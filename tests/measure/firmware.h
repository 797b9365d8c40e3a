/* SPDX-License-Identifier: MIT */
/* firmware.h - between firmware.c, which is measured, and measure.c, which measures. MODEL is the ROLN_NAME of a config header that
   is named after it. With TRAIN the firmware learns, too. With FILTER or OBSERVE it estimates velocities. With DOUBT it calls
   NAME_doubt, and its guard checks novelty. With WORST it has filter, observer and doubt, for longest.c. */
#ifndef FIRMWARE_H
#define FIRMWARE_H

#define STRING_(x) #x
#define STRING(x) STRING_(x)
#define HEADER_(m) STRING(m.h)
#define HEADER(m) HEADER_(m)
#define ROLN_BLOCK 1 /* one training window at a time: little scratch */
#include HEADER(MODEL)

#define CAT_(a, b) a##_##b
#define CAT(a, b) CAT_(a, b)
#define M(name) CAT(MODEL, name) /* M(params) is chain_params */

enum { N = M(N), n = M(n), HORIZON = M(horizon) };

extern const M(params) *const weights; /* in flash */
extern struct control {
    M(state) x;     /* measured */
    M(latent) s;    /* z, zd of the last good tick */
    M(target) ref;  /* to be followed, and gains */
    M(guard) guard; /* guard.tau: to the motors */
} control;

/* Scratch. What learns does so between its ticks, and no function leaves anything in its scratch: so there is one for both. */
extern union scratch {
    M(work) control;
#ifdef TRAIN
    M(train) train;
#endif
} scratch;

roln_status tick(void);  /* NAME_tick, every check on: control.x to control.guard.tau */
roln_status ahead(void); /* one step of the prediction from control.s */

#ifdef WORST
#define FILTER
#define OBSERVE
#endif
#if defined FILTER || defined OBSERVE || defined DOUBT
extern struct estimates {
#ifdef FILTER
    M(filter) filter;
    M(filter_tick_work) work;
#endif
#ifdef OBSERVE
    M(observer) observer;
    M(observer_tick_work) observing;
#endif
#if defined WORST || defined DOUBT
    M(doubts) doubts;
#endif
#ifdef WORST /* longest.c writes them; else firmware.c has them in flash, and y is control.x.q */
    roln_noise noise;
    M(observer_gains) gains;
    M(evidence) known;
    roln_real y[N];
#endif
} estimates;

roln_status filter(void);  /* one tick of the filter */
roln_status observe(void); /* one tick of the observer */
roln_status doubt(void);   /* how far the model may be off at control.s */
extern int longest_way;    /* 1, 2: the longest way through what depends on numbers, without and with second derivatives */
#endif

#ifdef TRAIN
extern struct learner {
    M(params) p;
    M(optimiser) optimiser;
    M(gradient) gradient;
    roln_real q[(HORIZON + 1) * N], qd[(HORIZON + 1) * N], qdd[N]; /* a window; of its first sample the acceleration */
} learner;

roln_status train(void); /* gradient of the acceleration loss of a sample and of the ODE loss of a window, update of all weights */
#endif

/* The function that this firmware has beside those that control, if it is one. */
#if defined TRAIN
#define MORE train
#elif defined WORST
#elif defined FILTER
#define MORE filter
#elif defined OBSERVE
#define MORE observe
#elif defined DOUBT
#define MORE doubt
#endif

#endif
