/* SPDX-License-Identifier: MIT */
/* rope_plant.h - MuJoCo's rope on a trolley (tests/mujoco/plants/rope.xml), a move of its tip, and what is measured of one. */
#ifndef ROPE_PLANT_H
#define ROPE_PLANT_H

#include <mujoco/mujoco.h>

enum { ROPE_JOINTS = 11, ROPE_MOTORS = 2, ROPE_TICKS = 8000, ROPE_REST = 1000, ROPE_EVERY = 20 };
#define ROPE_TICK 1e-3 /* s */
#define ROPE_MOVE 1.0  /* m: of trolley and tip, along the rail */
#define ROPE_TARGET 0.5 /* m: where it ends, in the middle of what was recorded */
#define ROPE_NEAR 0.02 /* of the move: where the tip is at its target */
#define ROPE_SLOW 0.1  /* of the move a second: where it is at rest */

/* A run: the tip, x and z beside its target, its velocity, and the motors' force and torque, tick by tick. */
struct plant_run {
    int ticks;
    double tip[ROPE_TICKS + 1][2], speed[ROPE_TICKS + 1][2], u[ROPE_TICKS][ROPE_MOTORS];
};

/* The plant. NULL, and it says why. */
mjModel *plant_load(void);
/* A run begins: at rest, a move before the target. */
void plant_start(const mjModel *m, mjData *d, struct plant_run *r);
/* Tip beside its target, and its velocity: y [4]. */
void plant_tip(const mjModel *m, const mjData *d, double y[4]);
/* A tick under u, written to the run. */
void plant_tick(const mjModel *m, mjData *d, const double u[ROPE_MOTORS], struct plant_run *r);
/* The time from which on the tip is near and slow to the end; that of the whole run if it never is. */
double plant_settled(const struct plant_run *r);
/* Largest distance from the target from `seconds` on, and the part of the ticks before it with a motor at its limit. */
double plant_swing(const struct plant_run *r, double seconds);
double plant_at_limit(const mjModel *m, const struct plant_run *r, double seconds);

/* The shortest time on the true plant: moves in steps of ROPE_EVERY ticks that settle in `steps` of them and stay so for ROPE_REST
   ticks more. The run is that of the shortest; returns its steps, 0: none. say: tells of each horizon that is tried. */
int plant_best(const mjModel *m, struct plant_run *r, int say);

#endif
