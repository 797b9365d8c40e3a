/* SPDX-License-Identifier: MIT */
/* configs.h - the configurations of the run list and of test_experiments.c. config.c is compiled for each, -DCONFIG=NAME; the
   Makefile reads their names here.

   A row: sizes of the autoencoder, from the joints or the POD coordinates in which the model is trained; of the latter the sizes of
   the same model of all coordinates, else 0; chart; which joints are angles; head: the width of both hidden layers of networks, or
   the degrees of polynomials for M and V; slope; mass matrix; base point; SPD layers; damping; storage. */
#ifndef CONFIGS_H
#define CONFIGS_H

/* no autoencoder */
#define ROW_pend2           (2), (0), (none), (0), (32), 1, (exponential), 0, 0, 0, full
#define ROW_pend2_base      (2), (0), (none), (0), (32), 1, (exponential), 1, 0, 0, full
#define ROW_pend2_gyro      (2), (0), (none), (0), (32), 1, (exponential), 0, gyro, 0, full
#define ROW_pend2_base_gyro (2), (0), (none), (0), (32), 1, (exponential), 1, gyro, 0, full
#define ROW_pend2_chol      (2), (0), (none), (0), (32), 1, (cholesky), 0, 0, 0, full
#define ROW_pend2_angles    (2), (0), (none), (1, 1), (32), 1, (exponential), 0, 0, 0, full
#define ROW_pend2_poly      (2), (0), (none), (1, 1), (2, 3), 1, (squares, 6), 0, 0, 0, full
#define ROW_full16          (16), (0), (none), (0), (32), 1, (exponential), 0, 0, 0, full
#define ROW_full16_chol     (16), (0), (none), (0), (32), 1, (cholesky), 0, 0, 0, full

/* charts of 16 joints, by degree; POD; the layered autoencoder of the paper */
#define ROW_chart16_d2      (16, 4), (0), (polynomial, 2), (0), (32), 1, (exponential), 0, 0, 0, full
#define ROW_chart16_d3      (16, 4), (0), (polynomial, 3), (0), (32), 1, (exponential), 0, 0, 0, full
#define ROW_chart16_d4      (16, 4), (0), (polynomial, 4), (0), (32), 1, (exponential), 0, 0, 0, full
#define ROW_chart16_d5      (16, 4), (0), (polynomial, 5), (0), (32), 1, (exponential), 0, 0, 0, full
#define ROW_chart16_d6      (16, 4), (0), (polynomial, 6), (0), (32), 1, (exponential), 0, 0, 0, full
#define ROW_chart16_d8      (16, 4), (0), (polynomial, 8), (0), (32), 1, (exponential), 0, 0, 0, full
#define ROW_chart16_d4_chol (16, 4), (0), (polynomial, 4), (0), (32), 1, (cholesky), 0, 0, 0, full
#define ROW_chart16_d6_chol (16, 4), (0), (polynomial, 6), (0), (32), 1, (cholesky), 0, 0, 0, full
#define ROW_chart16_d8_chol (16, 4), (0), (polynomial, 8), (0), (32), 1, (cholesky), 0, 0, 0, full
#define ROW_chart16_d4_poly (16, 4), (0), (polynomial, 4), (0), (4, 7), 1, (squares, 6), 0, 0, 0, full
#define ROW_chart16_d6_poly (16, 4), (0), (polynomial, 6), (0), (4, 7), 1, (squares, 6), 0, 0, 0, full
#define ROW_chart16_d8_poly (16, 4), (0), (polynomial, 8), (0), (4, 7), 1, (squares, 6), 0, 0, 0, full
#define ROW_pod16_poly      (16, 4), (0), (none), (0), (4, 7), 1, (squares, 6), 0, 0, 0, full
#define ROW_pod16           (16, 4), (0), (none), (0), (32), 1, (exponential), 0, 0, 0, full
#define ROW_layered16       (16, 16, 16, 16, 12, 8, 4), (0), (none), (0), (64), 0.6, (exponential), 0, 0, 0, full

/* rope and cloth in POD coordinates, by n and degree */
#define ROW_rope_n4_pod     (64, 4), (192, 4), (none), (0), (20), 1, (exponential), 0, 0, 0, full
#define ROW_rope_n4_d2      (64, 4), (192, 64, 4), (polynomial, 2), (0), (20), 1, (exponential), 0, 0, 0, full
#define ROW_rope_n4_d3      (64, 4), (192, 64, 4), (polynomial, 3), (0), (20), 1, (exponential), 0, 0, 0, full
#define ROW_rope_n4_d4      (64, 4), (192, 64, 4), (polynomial, 4), (0), (20), 1, (exponential), 0, 0, 0, full
#define ROW_rope_n4_d5      (64, 4), (192, 64, 4), (polynomial, 5), (0), (20), 1, (exponential), 0, 0, 0, full
#define ROW_rope_n6         (64, 6), (192, 64, 6), (polynomial, 4), (0), (20), 1, (exponential), 0, 0, 0, full
#define ROW_rope_n10_pod    (64, 10), (192, 10), (none), (0), (20), 1, (exponential), 0, 0, 0, full
#define ROW_rope_n10_d2     (64, 10), (192, 64, 10), (polynomial, 2), (0), (20), 1, (exponential), 0, 0, 0, full
#define ROW_rope_n10_d3     (64, 10), (192, 64, 10), (polynomial, 3), (0), (20), 1, (exponential), 0, 0, 0, full
#define ROW_rope_n10_d4     (64, 10), (192, 64, 10), (polynomial, 4), (0), (20), 1, (exponential), 0, 0, 0, full
#define ROW_rope_n10_poly   (64, 10), (192, 64, 10), (polynomial, 3), (0), (2, 3), 1, (cholesky), 0, 0, 0, full
#define ROW_rope_n14        (64, 14), (192, 64, 14), (polynomial, 3), (0), (20), 1, (exponential), 0, 0, 0, full
#define ROW_cloth_n4        (128, 4), (600, 128, 4), (polynomial, 5), (0), (20), 1, (exponential), 0, 0, 0, full
#define ROW_cloth_n6        (128, 6), (600, 128, 6), (polynomial, 4), (0), (20), 1, (exponential), 0, 0, 0, full
#define ROW_cloth_n10_pod   (128, 10), (600, 10), (none), (0), (20), 1, (exponential), 0, 0, 0, full
#define ROW_cloth_n10_d2    (128, 10), (600, 128, 10), (polynomial, 2), (0), (20), 1, (exponential), 0, 0, 0, full
#define ROW_cloth_n10_d3    (128, 10), (600, 128, 10), (polynomial, 3), (0), (20), 1, (exponential), 0, 0, 0, full
#define ROW_cloth_n10_d4    (128, 10), (600, 128, 10), (polynomial, 4), (0), (20), 1, (exponential), 0, 0, 0, full
#define ROW_cloth_n14       (128, 14), (600, 128, 14), (polynomial, 3), (0), (20), 1, (exponential), 0, 0, 0, full
#define ROW_cloth_free_n10  (128, 10), (600, 128, 10), (polynomial, 3), (0), (20), 1, (exponential), 0, 0, 1, full

/* the same with layers; the last one also in less flash */
#define EIGHT               48, 48, 48, 48, 48, 48, 48
#define SIX                 48, 48, 48, 48, 32
#define ROW_rope_n4_layers  (48, EIGHT, 4), (192, EIGHT, 4), (none), (0), (64), 0.6, (exponential), 0, 0, 0, full
#define ROW_rope_layers     (48, EIGHT, 10), (192, EIGHT, 10), (none), (0), (64), 0.6, (exponential), 0, 0, 0, full
#define ROW_cloth_layers    (48, SIX, 10), (600, SIX, 10), (none), (0), (64), 0.6, (exponential), 0, 0, 0, full
#define ROW_cloth_free_layers (48, SIX, 10), (600, SIX, 10), (none), (0), (64), 0.6, (exponential), 0, 0, 1, full
#define ROW_cloth_free_half (600, SIX, 10), (0), (none), (0), (64), 0.6, (exponential), 0, 0, 1, half
#define ROW_cloth_free_int8 (600, SIX, 10), (0), (none), (0), (64), 0.6, (exponential), 0, 0, 1, int8

/* small ones of test_experiments.c, and that of tests/mujoco/models/pend16.roln */
#define ROW_test_layers     (7, 6, 3), (16, 6, 3), (none), (0), (8), 0.5, (exponential), 0, 0, 1, full
#define ROW_test_chart      (7, 3), (16, 7, 3), (polynomial, 3), (0), (8), 1, (exponential), 0, 0, 0, full
#define ROW_test16          (16, 4), (0), (polynomial, 4), (0), (8), 1, (exponential), 0, 0, 0, full
#define ROW_test2           (2), (0), (none), (0), (16), 1, (exponential), 0, 0, 0, full
#define ROW_test2_damped    (2), (0), (none), (0), (8), 1, (exponential), 0, 0, 1, full
#define ROW_test16_poly     (16, 4), (0), (polynomial, 4), (0), (2, 3), 1, (squares, 5), 0, 0, 0, full
#define ROW_test2_poly      (2), (0), (none), (1, 1), (2, 3), 1, (squares, 3), 0, 0, 0, full
#define ROW_test_pend16     (16, 4), (0), (polynomial, 4), (0), (32), 0.41421356, (exponential), 0, 0, 0, full

/* Of the row of CONFIG one column, COLUMN(AE_OF); those in brackets without them. */
#define COLUMN(pick) COLUMN_(pick, ROW(CONFIG))
#define COLUMN_(pick, ...) pick(__VA_ARGS__)
#define ROW(config) ROW_(config)
#define ROW_(config) ROW_##config
#define OPEN(...) __VA_ARGS__
#define AE_OF(ae, whole, chart, angles, head, slope, mass, base, layers, damping, store) OPEN ae
#define WHOLE_OF(ae, whole, chart, angles, head, slope, mass, base, layers, damping, store) OPEN whole
#define CHART_OF(ae, whole, chart, angles, head, slope, mass, base, layers, damping, store) OPEN chart
#define ANGLES_OF(ae, whole, chart, angles, head, slope, mass, base, layers, damping, store) OPEN angles
#define HEAD_OF(ae, whole, chart, angles, head, slope, mass, base, layers, damping, store) OPEN head
#define SLOPE_OF(ae, whole, chart, angles, head, slope, mass, base, layers, damping, store) slope
#define MASS_OF(ae, whole, chart, angles, head, slope, mass, base, layers, damping, store) OPEN mass
#define BASE_OF(ae, whole, chart, angles, head, slope, mass, base, layers, damping, store) base
#define LAYERS_OF(ae, whole, chart, angles, head, slope, mass, base, layers, damping, store) layers
#define DAMPING_OF(ae, whole, chart, angles, head, slope, mass, base, layers, damping, store) damping
#define STORE_OF(ae, whole, chart, angles, head, slope, mass, base, layers, damping, store) store

#endif
