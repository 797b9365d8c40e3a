#!/bin/sh
# SPDX-License-Identifier: MIT
# Models that must not compile, each with the words its user gets to read, and their neighbours that must; C and C++. Written
# weights, which must not compile with another config than their own.
cd "$(dirname "$0")/../.." || exit 1
dir=build/config
rm -rf $dir
mkdir -p $dir
passed=0
failed=0
turn=0

cc0='gcc -std=c99 -xc' cc1='g++ -std=c++11 -xc++' cc2='clang -std=c99 -xc' cc3='clang++ -std=c++11 -xc++'
# asked WANT: numbers of compilers. What is to be refused with a word is asked of one, and they take turns; all else, of all
asked() { case $1 in - | [0-9]*) echo 0 1 2 3 ;; *) echo $((turn % 4)) ;; esac }

# ask WANT WHAT: what stands in $dir/it is refused with this word; WANT -: it compiles
ask() {
    want=$1 what=$2
    turn=$((turn + 1))
    for number in $(asked "$want"); do
        eval "cc=\$cc$number"
        out=$($cc -I. -Wall -Wpedantic -Werror -Wno-unused -fsyntax-only - < $dir/it 2>&1)
        code=$?
        if if [ "$want" = - ]; then [ $code -eq 0 ]; else [ $code -ne 0 ] && echo "$out" | grep -q "$want"; fi; then
            passed=$((passed + 1))
        else
            failed=$((failed + 1))
            echo "$cc: wanted $want: $what"
            echo "$out" | head -n 5
        fi
    done
}

# model NAME OPTION=VALUE ..: its definitions, one a line
model() {
    echo "#define ROLN_NAME $1"
    shift
    for d in "$@"; do echo "#define ROLN_$(echo "$d" | sed 's/=/ /')"; done
    echo '#include "roln.h"'
}

# try WORD OPTION=VALUE ..: such a model is refused with this word; try -: it compiles, behind the others that do, each with a name
# of its own, as float and as double
try() {
    want=$1
    shift
    if [ "$want" != - ]; then
        model m "$@" > $dir/it
        ask "$want" "$*"
        return
    fi
    good=$((good + 1))
    case "$*" in *DOUBLE*) model m$good "$@" >> $dir/double ;; *) model m$good "$@" >> $dir/float ;; esac
}
good=0

try - 'AE=6, 4, 2' 'MLP=8'
try 'ROLN_AE: the sizes of the autoencoder' 'MLP=8'
try 'ROLN_MLP: the hidden widths' 'AE=6, 4, 2'
# sizes
try sizes_must_not_grow 'AE=6, 2, 4' 'MLP=8'
try sizes_must_not_grow 'AE=2, 4' 'MLP=8'
try - 'AE=10, 9, 8, 7, 6, 5, 4, 3, 2' 'MLP=8'
try sizes_must_not_grow 'AE=10, 9, 8, 7, 6, 5, 4, 3, 2, 1' 'MLP=8'
try sizes_must_be_at_least_1 'AE=4, -2' 'MLP=8'
try sizes_must_be_at_least_1 'AE=0' 'MLP=8'
try sizes_must_be_at_least_1 'AE=-3' 'MLP=8'
try sizes_must_be_at_least_1 'AE=4, 0' 'MLP=8'
try sizes_must_be_at_least_1 'AE=4, 0, 2' 'MLP=8'
try sizes_must_be_at_least_1 'AE=9, 8, 7, 6, 5, 4, 3, 2, 0' 'MLP=8'
try - 'AE=1' 'MLP=1'
# slopes, smallest eigenvalues: real numbers
for slope in 0.41421356 0.5f 1 1.0 '(1 / 3.)' 1e-3; do try - 'AE=4, 2' 'MLP=8' "SLOPE=$slope"; done
for slope in 2 1.5 1.0001 0 0.0 -0.5 '(3 / 2.)'; do try SLOPE_IS_ABOVE_0_AND_AT_MOST_1 'AE=4, 2' 'MLP=8' "SLOPE=$slope"; done
try - 'AE=4, 2' 'MLP=8' 'EIGENVALUE_FLOOR=1e-6'
try - 'AE=4, 2' 'MLP=8' 'EIGENVALUE_FLOOR=2'
for least in 0 -1e-4 1e-60; do try EIGENVALUE_FLOOR_IS_ABOVE_0 'AE=4, 2' 'MLP=8' 'MASS=cholesky' "EIGENVALUE_FLOOR=$least"; done
try - 'AE=4, 2' 'MLP=8' 'EIGENVALUE_FLOOR=1e-60' 'DOUBLE=1'
# refused by each compiler with the flags of a user, who has no -Werror, with an autoencoder and without; tcc names no macro
never() { # never WORD OPTION=VALUE
    for ae in '4, 2' 2; do
        model m "AE=$ae" 'MLP=8' "$2" > $dir/never.c
        for cc in "$cc0" "$cc1" "$cc2" "$cc3" tcc; do
            case $cc in tcc) command -v tcc > /dev/null || continue; word='division by zero' ;; *) word=$1 ;; esac
            out=$($cc -I. -c $dir/never.c -o $dir/never.o 2>&1)
            code=$?
            if [ $code -ne 0 ] && echo "$out" | grep -q "$word"; then
                passed=$((passed + 1))
            else
                failed=$((failed + 1))
                echo "$cc: compiled, or said other words than $word: AE=$ae $2"
            fi
        done
    done
}
for slope in 0 2 1.0001 -0.5; do never SLOPE_IS_ABOVE_0_AND_AT_MOST_1 "SLOPE=$slope"; done
for least in 0 -1 -1e-4 1e-60; do never EIGENVALUE_FLOOR_IS_ABOVE_0 "EIGENVALUE_FLOOR=$least"; done
# plans
try - 'AE=4, 2' 'MLP=8' 'PLAN=20, 4'
try - 'AE=4, 2' 'MLP=8' 'PLAN=1, 1'
try plan_must_be_steps_and_motors 'AE=4, 2' 'MLP=8' 'PLAN=20'
try plan_must_be_steps_and_motors 'AE=4, 2' 'MLP=8' 'PLAN=20, 2, 1'
try plan_must_be_steps_and_motors 'AE=4, 2' 'MLP=8' 'PLAN=-1, 2'
try plan_must_be_steps_and_motors 'AE=4, 2' 'MLP=8' 'PLAN=20, -1'
try motors_must_not_be_more_than_joints 'AE=4, 2' 'MLP=8' 'PLAN=20, 5'
try - 'AE=4, 2' 'MLP=8' 'LOAD=1'
try - 'AE=4, 2' 'MLP=8' 'LOAD=1' 'INPUTS=2' 'PLAN=4, 2'
try - 'AE=4, 2' 'MLP=8' 'DELAY=1'
try - 'AE=4, 2' 'MLP=8' 'DELAY=5' 'LOAD=1' 'INPUTS=2' 'PLAN=4, 2'
try delay_must_not_be_negative 'AE=4, 2' 'MLP=8' 'DELAY=-1'
try load_is_0_or_1 'AE=4, 2' 'MLP=8' 'LOAD=2'
try load_is_0_or_1 'AE=4, 2' 'MLP=8' 'LOAD=-1'
# charts
try - 'AE=4, 2' 'MLP=8' 'CHART=polynomial, 2'
try - 'AE=4, 2' 'MLP=8' 'CHART=polynomial, 8'
try - 'AE=600, 80, 10' 'MLP=8' 'CHART=polynomial, 3' 'SLOPE=1'
try - 'AE=10, 9, 8, 7, 6, 5, 4, 3, 2' 'MLP=8' 'CHART=polynomial, 3'
try - 'AE=600' 'MLP=8' 'CHART=none'
try chart_is_none_or_of_degree_2_to_8 'AE=4, 2' 'MLP=8' 'CHART=polynomial'
try chart_is_none_or_of_degree_2_to_8 'AE=4, 2' 'MLP=8' 'CHART=polynomial, 1'
try chart_is_none_or_of_degree_2_to_8 'AE=4, 2' 'MLP=8' 'CHART=polynomial, 9'
try chart_is_none_or_of_degree_2_to_8 'AE=4, 2' 'MLP=8' 'CHART=polynomial, -2'
try chart_is_none_or_of_degree_2_to_8 'AE=4, 2' 'MLP=8' 'CHART=polynomial, 3, 4'
try chart_is_none_or_of_degree_2_to_8 'AE=4, 2' 'MLP=8' 'CHART=none, 3'
try degree_must_be_a_number_that_the_preprocessor_can_read 'AE=4, 2' 'MLP=8' 'CHART=polynomial, ROLN_MIDPOINT'
try chart_needs_a_layer_that_reduces 'AE=4' 'MLP=8' 'CHART=polynomial, 3'
try chart_needs_a_layer_that_reduces 'AE=4, 4' 'MLP=8' 'CHART=polynomial, 3'
try chart_needs_a_layer_that_reduces 'AE=6, 4, 4' 'MLP=8' 'CHART=polynomial, 3'
try chart_needs_a_layer_that_reduces 'AE=10, 9, 8, 7, 6, 5, 4, 3, 3' 'MLP=8' 'CHART=polynomial, 3'
try ROLNI_CHART_fourier 'AE=4, 2' 'MLP=8' 'CHART=fourier, 3'
try - 'AE=4, 2' 'MLP=8' 'CHART=polynomial, 3' 'QUANTISE=int8'
# networks
try - 'AE=4, 2' 'MLP=8, 7, 6, 5, 4'
try mlp_needs_1_to_5_widths 'AE=4, 2' 'MLP=8, 7, 6, 5, 4, 3'
try mlp_needs_1_to_5_widths 'AE=4, 2' 'MLP=0'
try mlp_needs_1_to_5_widths 'AE=4, 2' 'MLP=8, 0'
try mlp_needs_1_to_5_widths 'AE=4, 2' 'MLP=8, 7, 6, 5, 0'
# SPD layers
try - 'AE=4, 2' 'MLP=8' 'LAYERS=gyro'
try - 'AE=4, 2' 'MLP=8' 'LAYERS=gyro, gyro, gyro, gyro'
try ROLNI_KIND_conv 'AE=4, 2' 'MLP=8' 'LAYERS=conv'
# Cholesky
try - 'AE=4, 2' 'MLP=8' 'MASS=cholesky' 'DAMPING=1'
try cholesky_takes_no_base_nor_layers 'AE=4, 2' 'MLP=8' 'MASS=cholesky' 'LAYERS=gyro'
try cholesky_takes_no_base_nor_layers 'AE=4, 2' 'MLP=8' 'MASS=cholesky' 'BASE=1'
# polynomials, squares
try - 'AE=4, 2' 'POLYNOMIALS=4, 7' 'CHART=polynomial, 2' 'MASS=squares, 6' 'GN_ROWS=20' 'PLAN=4, 2' 'DELAY=1' 'LOAD=1'
try - 'AE=2' 'POLYNOMIALS=2, 8' 'ANGLES=1, 1' 'MASS=squares, 2' 'DAMPING=2' 'FRICTION=2' 'STICTION=1' 'SCALE=each' 'DOUBLE=1'
try - 'AE=2' 'POLYNOMIALS=8, 2' 'INTEGRATOR=midpoint'
try polynomials_take_no_base_nor_layers 'AE=2' 'POLYNOMIALS=2, 2' 'LAYERS=gyro'
try polynomials_take_no_base_nor_layers 'AE=2' 'POLYNOMIALS=2, 2' 'BASE=1'
try polynomials_take_64_inputs_at_most 'AE=65' 'POLYNOMIALS=2, 2'
try squares_need_fewer_than_65536_columns 'AE=2' 'MLP=2' 'MASS=squares, 65538'
try - 'AE=4, 2' 'POLYNOMIALS=3, 3' 'MASS=cholesky' 'QUANTISE=int8'
try - 'AE=4' 'MLP=8' 'MASS=squares, 9' 'DRIVEN=2'
try 'ROLN_MLP, ROLN_POLYNOMIALS: a model has one of them' 'AE=4, 2' 'MLP=8' 'POLYNOMIALS=4, 7'
for degrees in 4 1 '1, 3' '3, 1' '4, 9' '9, 4' '4, 0' '0, 4' '-2, 4' '4, -2' '4, 7, 2'; do
    try polynomials_need_two_degrees_2_to_8 'AE=4, 2' "POLYNOMIALS=$degrees"
done
try polynomials_are_fewer_than_65536 'AE=20' 'POLYNOMIALS=2, 8'
for columns in squares 'squares, 1' 'squares, 0' 'squares, -3'; do
    try squares_need_a_number_of_columns_n_at_least 'AE=4, 2' 'MLP=8' "MASS=$columns"
done
for mass in 'cholesky, 4' 'exponential, 4' 'squares, 4, 4'; do
    try mass_takes_one_number_with_squares_else_none 'AE=4, 2' 'MLP=8' "MASS=$mass"
done
try cholesky_takes_no_base_nor_layers 'AE=4, 2' 'MLP=8' 'MASS=squares, 2' 'LAYERS=gyro'
try cholesky_takes_no_base_nor_layers 'AE=4, 2' 'MLP=8' 'MASS=squares, 2' 'BASE=1'
try ROLNI_MASS_ldl 'AE=4, 2' 'MLP=8' 'MASS=ldl'
try ROLNI_SCHEME_rk5 'AE=4, 2' 'MLP=8' 'INTEGRATOR=rk5'
# lists with a hole, lists too long, flags and counts that are none
try mlp_needs_1_to_5_widths 'AE=4, 2' 'MLP=8, 0, 4'
try mlp_needs_1_to_5_widths 'AE=4, 2' 'MLP=8, -3'
try spd_layers_4_at_most 'AE=4, 2' 'MLP=8' 'LAYERS=gyro, 0, gyro'
try spd_layers_4_at_most 'AE=4, 2' 'MLP=8' 'LAYERS=gyro, gyro, gyro, gyro, gyro'
try inputs_at_most_N 'AE=4, 2' 'MLP=8' 'INPUTS=5'
try inputs_at_most_N 'AE=4, 2' 'MLP=8' 'INPUTS=-1'
try - 'AE=4, 2' 'MLP=8' 'INPUTS=4'
try base_is_0_or_1 'AE=4, 2' 'MLP=8' 'BASE=2'
try - 'AE=4, 2' 'MLP=8' 'DAMPING=2'
try damping_is_0_1_or_2 'AE=4, 2' 'MLP=8' 'DAMPING=3'
try damping_is_0_1_or_2 'AE=4, 2' 'MLP=8' 'DAMPING=-1'
# friction
try - 'AE=4, 2' 'MLP=8' 'FRICTION=1' 'DAMPING=1'
try - 'AE=4, 2' 'MLP=8' 'FRICTION=2' 'DAMPING=2'
try - 'AE=4, 2' 'MLP=8' 'FRICTION=2' 'DOUBLE=1'
try friction_is_0_1_or_2 'AE=4, 2' 'MLP=8' 'FRICTION=3'
try friction_is_0_1_or_2 'AE=4, 2' 'MLP=8' 'FRICTION=-1'
try friction_must_be_a_number_that_the_preprocessor_can_read 'AE=4, 2' 'MLP=8' 'FRICTION=ROLN_CHOLESKY'
# stiction
try - 'AE=4, 2' 'MLP=8' 'FRICTION=1' 'STICTION=1' 'PLAN=4, 2' 'DELAY=1' 'GN_ROWS=20'
try - 'AE=4' 'MLP=8' 'FRICTION=2' 'STICTION=1' 'INTEGRATOR=midpoint' 'ACTUATOR=servo' 'DOUBLE=1'
try - 'AE=4, 2' 'MLP=8' 'FRICTION=1' 'STICTION=1' 'QUANTISE=int8' 'LOAD=1'
try - 'AE=4, 2' 'MLP=8' 'STICTION=0'
try stiction_is_0_or_1 'AE=4, 2' 'MLP=8' 'FRICTION=1' 'STICTION=2'
try stiction_is_0_or_1 'AE=4, 2' 'MLP=8' 'FRICTION=1' 'STICTION=-1'
try stiction_needs_friction 'AE=4, 2' 'MLP=8' 'STICTION=1'
try stiction_takes_no_driven_joints 'AE=4' 'MLP=8' 'FRICTION=1' 'STICTION=1' 'DRIVEN=1'
try stiction_must_be_a_number_that_the_preprocessor_can_read 'AE=4, 2' 'MLP=8' 'FRICTION=1' 'STICTION=ROLN_CHOLESKY'
# the filter
try - 'AE=4, 2' 'MLP=8' 'FILTER=leapfrog' 'LOAD=1' 'DELAY=1' 'PLAN=4, 2'
try - 'AE=4' 'MLP=8' 'FILTER=leapfrog' 'INTEGRATOR=leapfrog' 'DRIVEN=1' 'GN_ROWS=20' 'DOUBLE=1'
try - 'AE=4, 2' 'MLP=8' 'FILTER=model' 'FRICTION=1' 'STICTION=1'
try filter_leapfrog_takes_no_stiction 'AE=4, 2' 'MLP=8' 'FRICTION=1' 'STICTION=1' 'FILTER=leapfrog'
try ROLNI_FILTER_rk4 'AE=4, 2' 'MLP=8' 'FILTER=rk4'
# actuators
try - 'AE=4, 2' 'MLP=8' 'ACTUATOR=current'
try - 'AE=4, 2' 'MLP=8' 'ACTUATOR=servo' 'LOAD=1' 'DELAY=2' 'PLAN=4, 4' 'GN_ROWS=20'
try - 'AE=4, 2' 'MLP=8' 'ACTUATOR=current' 'SCALE=each' 'DELAY=1' 'PLAN=4, 2' 'DOUBLE=1'
try inputs_are_0_with_an_actuator 'AE=4, 2' 'MLP=8' 'ACTUATOR=current' 'INPUTS=2'
try ROLNI_ACTUATOR_voltage 'AE=4, 2' 'MLP=8' 'ACTUATOR=voltage'
# driven joints
try - 'AE=4' 'MLP=8' 'DRIVEN=3' 'GN_ROWS=20' 'PLAN=4, 2' 'DELAY=1'
try - 'AE=2' 'MLP=8' 'DRIVEN=1' 'SCALE=each' 'DOUBLE=1'
try - 'AE=6, 4' 'MLP=8' 'CHART=polynomial, 3' 'DRIVEN=2' 'PLAN=4, 4' 'GN_ROWS=20' 'DELAY=2' 'SCALE=each'
try driven_leaves_a_coordinate_free 'AE=4' 'MLP=8' 'DRIVEN=4'
try driven_leaves_a_coordinate_free 'AE=4' 'MLP=8' 'DRIVEN=-1'
try driven_leaves_a_coordinate_free 'AE=6, 2' 'MLP=8' 'CHART=polynomial, 2' 'DRIVEN=2'
try driven_behind_an_autoencoder_needs_a_chart_of_one_layer 'AE=4, 2' 'MLP=8' 'DRIVEN=1'
try driven_behind_an_autoencoder_needs_a_chart_of_one_layer 'AE=5, 4, 2' 'MLP=8' 'CHART=polynomial, 2' 'DRIVEN=1'
try driven_behind_an_autoencoder_takes_full_weights 'AE=4, 2' 'MLP=8' 'CHART=polynomial, 2' 'DRIVEN=1' 'QUANTISE=int8'
try driven_behind_an_autoencoder_learns_networks 'AE=4, 2' 'MLP=8' 'CHART=polynomial, 2' 'DRIVEN=1' 'LEARN=everything'
try driven_takes_no_midpoint_rule 'AE=4' 'MLP=8' 'DRIVEN=1' 'INTEGRATOR=midpoint'
try driven_takes_no_inputs_actuator_nor_load 'AE=4' 'MLP=8' 'DRIVEN=1' 'INPUTS=2'
try driven_takes_no_inputs_actuator_nor_load 'AE=4' 'MLP=8' 'DRIVEN=1' 'ACTUATOR=servo'
try driven_takes_no_inputs_actuator_nor_load 'AE=4' 'MLP=8' 'DRIVEN=1' 'LOAD=1'
# angles
try - 'AE=2' 'MLP=8' 'ANGLES=1, 0'
try - 'AE=2' 'MLP=8' 'ANGLES=0, 0'
try - 'AE=1' 'MLP=8' 'ANGLES=1'
try - 'AE=4, 2' 'MLP=8' 'ANGLES=0'
try - 'AE=31' 'MLP=8' "ANGLES=$(printf '0, %.0s' $(seq 30))1" 'DOUBLE=1'
try angles_are_0_or_1_for_each_joint 'AE=2' 'MLP=8' 'ANGLES=1'
try angles_are_0_or_1_for_each_joint 'AE=2' 'MLP=8' 'ANGLES=1, 0, 1'
try angles_are_0_or_1_for_each_joint 'AE=2' 'MLP=8' 'ANGLES=1, 2'
try angles_are_0_or_1_for_each_joint 'AE=2' 'MLP=8' 'ANGLES=-1, 0'
try angles_are_0_or_1_for_each_joint 'AE=1' 'MLP=8' 'ANGLES=2'
try angles_need_31_joints_at_most 'AE=32' 'MLP=8' "ANGLES=$(printf '1, %.0s' $(seq 31))1"
try angles_need_a_model_without_autoencoder 'AE=2, 2' 'MLP=8' 'ANGLES=1, 0'
try angles_need_a_model_without_autoencoder 'AE=4, 2' 'MLP=8' 'ANGLES=1, 0, 0, 1'
# units of joints
for scale in common each; do
    try - 'AE=4, 2' 'MLP=8' "SCALE=$scale" 'GN_ROWS=100'
    try - 'AE=2' 'MLP=8' "SCALE=$scale" 'ANGLES=1, 0' 'INPUTS=1'
done
try - 'AE=4, 2' 'MLP=8' 'SCALE=each' 'CHART=polynomial, 3'
try - 'AE=4, 2' 'MLP=8' 'SCALE=each' 'QUANTISE=half'
for scale in own 1 Each; do try "ROLNI_OWN_$scale" 'AE=4, 2' 'MLP=8' "SCALE=$scale"; done
try block_at_least_1 'AE=4, 2' 'MLP=8' 'BLOCK=0'
try - 'AE=4, 2' 'MLP=8' 'BLOCK=1' 'HORIZON=1'
try block_at_least_1 'AE=4, 2' 'MLP=8' 'BLOCK=-1'
try horizon_at_least_1 'AE=4, 2' 'MLP=8' 'HORIZON=0'
try horizon_at_least_1 'AE=4, 2' 'MLP=8' 'HORIZON=-1'
# rows of Gauss-Newton
try - 'AE=4, 2' 'MLP=8' 'GN_ROWS=100'
try - 'AE=4, 2' 'MLP=8' 'GN_ROWS=0' 'LEARN=networks'
try - 'AE=4, 2' 'MLP=8' 'GN_ROWS=1' 'LEARN=everything'
try rows_must_not_be_negative 'AE=4, 2' 'MLP=8' 'GN_ROWS=-1'
try rows_must_be_a_number_that_the_preprocessor_can_read 'AE=4, 2' 'MLP=8' 'GN_ROWS=ROLN_MIDPOINT'
try ROLNI_LEARN_decoder 'AE=4, 2' 'MLP=8' 'GN_ROWS=100' 'LEARN=decoder'
try ROLNI_LEARN_decoder 'AE=4, 2' 'MLP=8' 'LEARN=decoder'
# stored weights: float only, nothing to train
try - 'AE=4, 2' 'MLP=8' 'QUANTISE=half'
try - 'AE=4' 'MLP=8' 'QUANTISE=int8'
try - 'AE=4, 2' 'MLP=8' 'QUANTISE=full' 'DOUBLE=1'
try stored_weights_need_float 'AE=4, 2' 'MLP=8' 'QUANTISE=int8' 'DOUBLE=1'
try ROLNI_BITS_int4 'AE=4, 2' 'MLP=8' 'QUANTISE=int4'
for store in full half int8; do
    for verb in init init_pod grad grad_acc update variance fit_inertia force_variance errors decode rows newton_step; do
        case $store.$verb in full.* | *.errors | *.decode) continue ;; esac
        { model m 'AE=4, 2' 'MLP=8' "QUANTISE=$store" 'GN_ROWS=9'; echo "typedef char it[sizeof(&m_$verb)];"; } > $dir/it
        ask "m_$verb" "ROLN_QUANTISE $store, m_$verb"
    done
    case $store in
    full) verbs='init init_pod grad grad_acc update variance fit_inertia force_variance errors decode rows newton_step' ;;
    *) verbs='errors decode' ;;
    esac
    try - 'AE=4, 2' 'MLP=8' "QUANTISE=$store" 'GN_ROWS=9'
    for verb in $verbs; do echo "typedef char m${good}_has_$verb[sizeof(&m${good}_$verb)];" >> $dir/float; done
done
for it in float double; do
    cp $dir/$it $dir/it
    ask - "the models in $dir/$it"
done

# one type in a translation unit: defined or undefined behind the first header of roln it is an error in the next one
late() { # late WANT LINE ..
    want=$1
    shift
    printf '%s\n' "$@" > $dir/it
    ask "$want" "$*"
}
double='#define ROLN_DOUBLE'
one='#define ROLN_NAME one
#define ROLN_AE 4, 2
#define ROLN_MLP 8
#include "roln.h"'
two=$(echo "$one" | sed 's/one/two/')
late - "$double" "$one" "$two"
late - "$one" "$two" '#include "roln_spd.h"'
late 'ROLN_DOUBLE: before the first header' "$one" "$double" "$two"
late 'ROLN_DOUBLE: before the first header' "$double" "$one" '#undef ROLN_DOUBLE' "$two"
for header in roln.h roln_ae.h roln_lnn.h roln_riem.h roln_spd.h; do
    late 'ROLN_DOUBLE: before the first header' "#include \"$header\"" "$double" "$one"
    late 'ROLN_DOUBLE: before the first header' "#include \"$header\"" "$double" '#include "roln_spd.h"'
done
late 'ROLN_DOUBLE: before the first header' '#include "roln_ae.h"' "$double" '#include "roln_lnn.h"'
# weights are of one config: what the compiler says of each option that is another one. A slope or an eigenvalue floor, which it
# cannot compare, is found when the program runs
check() {
    what=$1
    shift
    if "$@" > $dir/log 2>&1; then
        passed=$((passed + 1))
    else
        failed=$((failed + 1))
        echo "$what" | head -n 5
        head -n 5 $dir/log
    fi
}
# defines NAME=VALUE ..: the model arm, with these options in place of its own
defines() {
    echo '#define ROLN_NAME arm'
    for d in 'AE=6, 4, 2' 'MLP=8, 6' INTEGRATOR=rk4 SLOPE=0.5 EIGENVALUE_FLOOR=1e-3 MASS=exponential BASE=1 LAYERS=gyro DAMPING=1 \
        INPUTS=1 'CHART=polynomial, 3' QUANTISE=full "$@"; do
        echo "#undef ROLN_${d%%=*}"
        echo "#define ROLN_${d%%=*} ${d#*=}"
    done
    echo '#include "roln.h"'
}
{ defines; cat << 'END_OF_FILE'; } > $dir/write.c
#include <stdio.h>
static void put(void *ctx, const char *text) { fputs(text, (FILE *)ctx); }
int main(void)
{
    static arm_params p;
    static arm_start start;
    uint64_t seed = 1;
    arm_init(&p, &seed, &start.init);
    return arm_write(&p, put, stdout) != ROLN_OK;
}
END_OF_FILE
check 'weights are written' sh -c "gcc -std=c99 -I. $dir/write.c -o $dir/write -lm && $dir/write > $dir/arm_weights.h"
cat > $dir/main.c << 'END_OF_FILE'
#include "arm_weights.h"
#include "arm_weights.h"
int main(void)
{
    static const arm_state x = {{0}, {0}};
    static arm_latent s;
    static arm_work work;
    const roln_status st = arm_encode(&arm_weights, &x, &s, &work.encode);
    return st == ROLN_E_SHAPE ? 2 : st != ROLN_OK;
}
END_OF_FILE
# with WANT NAME=VALUE: the weights of arm in such a config; WANT a number: status of the program
with() {
    { defines "$2"; cat $dir/main.c; } > $dir/with.c
    turn=$((turn + 1))
    for number in $(asked "$1"); do
        eval "cc=\$cc$number"
        out=$($cc -I. -I$dir -Wall -Wextra -Wpedantic -Wno-unused -ffp-contract=off $dir/with.c -o $dir/with -lm 2>&1)
        code=$?
        [ $code -ne 0 ] || { $dir/with; code=$?; }
        case $1 in *[!0-9]*) ok=$(echo "$out" | grep -c "'*arm_weights_are_of_ROLN_$1\\b") ;; *) ok=$((code == $1)) ;; esac
        check "$cc: weights with $2: $code $out" [ "$ok" -gt 0 ]
    done
}
with 0 INTEGRATOR=rk4
with AE_6_4_2 'AE=6, 3, 2'
with AE_6_4_2 'AE=6, 4, 4, 2'
with MLP_8_6 'MLP=6, 8'
with INTEGRATOR_rk4 INTEGRATOR=midpoint
with MASS_exponential MASS=cholesky
with BASE_1 BASE=0
with LAYERS_gyro 'LAYERS=gyro, gyro'
with DAMPING_1 DAMPING=0
with INPUTS_1 INPUTS=0
with FRICTION_0 FRICTION=1
with ANGLES_0 'ANGLES=1, 0, 0, 0, 0, 0'
with SCALE_common SCALE=each
with CHART_polynomial_3 'CHART=polynomial, 2'
with CHART_polynomial_3 CHART=none
with QUANTISE_full QUANTISE=half
with DOUBLE_not_defined_0 DOUBLE=1
with 2 SLOPE=0.50001
with 2 EIGENVALUE_FLOOR=2e-3
# one definition for two files
defines > $dir/arm.h
printf '#include "arm.h"\n#define ROLN_WEIGHTS_HERE\n' > $dir/one.c
cat $dir/main.c >> $dir/one.c
printf '#include "arm.h"\n#include "arm_weights.h"\nconst void *other(void);\nconst void *other(void) { return &arm_weights; }\n' \
    > $dir/two.c
for cc in 'gcc -std=c99 -xc' 'g++ -std=c++11 -xc++'; do
    check 'weights in one of two files' $cc -I. -I$dir -DROLN_WEIGHTS_EXTERN $dir/one.c $dir/two.c -o $dir/both -lm
    check 'they are there' $dir/both
    check 'once' sh -c "$cc -I. -I$dir -DROLN_WEIGHTS_EXTERN -c $dir/two.c -o $dir/two.o && nm $dir/two.o | grep 'U .*arm_weights'"
done

echo "$passed passed, $failed failed"
[ "$failed" -eq 0 ]
