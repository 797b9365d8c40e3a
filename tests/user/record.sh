#!/bin/sh
# SPDX-License-Identifier: MIT
# make record, make learn, and HDF5 in: recordings obey the machine's limits, its equations and their seed; two tiny machines are
# learned, one with fewer motors than joints, one a closed chain; what cannot be recorded is refused with its message.
# Last line: N passed, N failed.
cd "$(dirname "$0")/../.." || exit 1
dir=build/recorded
. tests/user/check.sh
# says WORDS COMMAND ..: it ends with 1, and its last line says them
says() {
    words=$1
    shift
    "$@" > $dir/says.log 2>&1
    code=$?
    if [ $code -eq 1 ] && tail -n 1 $dir/says.log | grep -q "$words"; then
        passed=$((passed + 1))
    else
        failed=$((failed + 1))
        echo "$*: ended with $code; wanted: $words"
        tail -n 2 $dir/says.log
    fi
}
# refuses WORDS COMMAND ..: it ends with 1, says them first, and a hint last
refuses() {
    words=$1
    shift
    check "$words" sh -c "$* 2> $dir/refused.log; [ \$? -eq 1 ] && head -n 1 $dir/refused.log | grep '$words' &&
        tail -n 1 $dir/refused.log | grep '^hint: '"
}
machines=tests/mujoco/machines
few="train=4 test=1 seconds=0.5"
# xml NAME BODY [REST]: a model
xml() {
    echo "<mujoco><option timestep='0.001' ${4:-}/><worldbody>$2</worldbody>${3:-}</mujoco>" > "$dir/$1.xml"
}
rod="<geom type='capsule' fromto='0 0 0 0 0 -.3' size='.01' contype='0' conaffinity='0'/>"

# ---- recordings ----

check 'planar3' build/record $machines/planar3.xml $dir/arm train=6 test=2 seconds=1
check 'as many as were asked for' awk -F, 'FNR == 1 { n = 0 } NF < 2 { n++ } END { exit n != 5 }' $dir/arm.csv
check 'its header' sh -c "head -n 1 $dir/arm.csv | grep '^t,q1,q2,q3,qd1,qd2,qd3,tau1,tau2,tau3$'"
check 'ranges and motors' awk -F, 'NR > 1 && NF > 1 { n++; for (i = 2; i <= 4; i++) bad += $i ^ 2 > 1.5 ^ 2
    bad += $8 ^ 2 > 40 ^ 2 + 1e-6 || $9 ^ 2 > 20 ^ 2 + 1e-6 || $10 ^ 2 > 10 ^ 2 + 1e-6 } END { exit bad || n < 1000 }' $dir/arm.csv
check 'falls, and driven ones' awk -F, 'NF > 1 && $1 == 0.1 { if ($8 == 0) fall++; else driven++ } END { exit !(fall && driven) }' \
    $dir/arm.csv
check 'its config' sh -c "grep -x '#define ROLN_AE 3' $dir/arm.h && grep -x '#define ROLN_MLP 16, 16' $dir/arm.h &&
    grep -x '#define ROLN_DAMPING 1' $dir/arm.h && ! grep INPUTS $dir/arm.h && sh examples/lint.sh $dir/arm.h"
check 'the same again' sh -c "build/record $machines/planar3.xml $dir/twin train=6 test=2 seconds=1 &&
    cmp $dir/arm.csv $dir/twin.csv && cmp $dir/arm_test.csv $dir/twin_test.csv && cmp $dir/arm.h5 $dir/twin.h5"
check 'another seed' sh -c "build/record $machines/planar3.xml $dir/other train=6 test=2 seconds=1 seed=2 &&
    ! cmp $dir/arm.csv $dir/other.csv"
check 'another rate' sh -c "build/record $machines/planar3.xml $dir/slow $few dt=0.004 &&
    awk -F, 'NR == 3 { exit \$1 != 0.004 }' $dir/slow.csv"

# twin: MuJoCo's inverse dynamics of q, qd and of central differences of qd; what is held over two intervals acts in their middle
cat > $dir/inverse.c << 'END_OF_FILE'
#include <math.h>
#include <mujoco/mujoco.h>
#include <stdio.h>
#include <string.h>

int main(int argc, char **argv)
{
    char error[500], line[1000];
    mjModel *m = mj_loadXML(argv[1], NULL, error, sizeof error);
    mjData *d = mj_makeData(m);
    const int wide = 3 * m->nv;
    double x[3][40], off = 0, size = 0;
    FILE *f = fopen(argv[2], "r");
    int have = 0;
    while (fgets(line, sizeof line, f)) {
        int at = 0, step;
        memmove(x, x[1], 2 * sizeof x[0]);
        for (step = 0; step <= wide && sscanf(line + at, "%lf%*1[,\n]", &x[2][step]) == 1; step++)
            at += (int)strcspn(line + at, ",\n") + 1;
        have = step > wide ? have + 1 : 0;
        if (have < 3) continue;
        memcpy(d->qpos, x[1] + 1, (size_t)m->nq * sizeof(double));
        memcpy(d->qvel, x[1] + 1 + m->nv, (size_t)m->nv * sizeof(double));
        for (int j = 0; j < m->nv; j++)
            d->qacc[j] = (x[2][1 + m->nv + j] - x[0][1 + m->nv + j]) / (x[2][0] - x[0][0]);
        mj_inverse(m, d);
        for (int j = 0; j < m->nv; j++) {
            const double u = (x[0][1 + 2 * m->nv + j] + x[1][1 + 2 * m->nv + j]) / 2;
            off += (d->qfrc_inverse[j] - u) * (d->qfrc_inverse[j] - u), size += u * u;
        }
    }
    printf("off %g of %g\n", sqrt(off), sqrt(size));
    return !(size > 0 && off < 1e-5 * size);
}
END_OF_FILE
check 'twin' gcc -std=c99 -O1 $dir/inverse.c -o $dir/inverse -lmujoco -lm
check 'the torques move it' $dir/inverse $machines/planar3.xml $dir/arm.csv
check 'slider' build/record $machines/slider.xml $dir/slider train=12 test=3 seconds=1
check 'its motor moves it' $dir/inverse $machines/slider.xml $dir/slider.csv
check 'units of a slider beside a hinge' sh -c "grep -x '#define ROLN_SCALE each' $dir/slider.h && ! grep SCALE $dir/arm.h"
check 'fewer motors than joints' sh -c "! grep INPUTS $dir/slider.h && head -n 1 $dir/slider.csv | grep ',tau1,tau2$' &&
    grep 'B of the motors .2..1. in the pose that the model begins in: 1, 0 ' $dir/slider.h"
check 'the hinge has no motor' awk -F, 'NR > 1 && NF > 1 && $7 != 0 { n++ } END { exit n > 0 }' $dir/slider.csv

xml motors "<body><joint name='a' axis='0 1 0'/>$rod</body>" \
    "<actuator><position joint='a' kp='2' ctrllimited='true' ctrlrange='-1 1'/></actuator>"
check 'servo' sh -c "build/record $dir/motors.xml $dir/motors $few | grep '^1 motors are servos' &&
    awk -F, '\$4 != 0 { n++ } END { exit n < 100 }' $dir/motors.csv"
xml fall "<geom type='plane' size='1 1 .1'/><body pos='0 0 .5'><joint type='slide' axis='0 0 1'/><geom size='.1'/></body>"
check 'no motors, contacts end recordings' sh -c "build/record $dir/fall.xml $dir/fall $few |
    grep '^5 end at a contact: contact is' &&
    head -n 1 $dir/fall.csv | grep -x 't,q1,qd1' && ! grep DAMPING $dir/fall.h &&
    awk -F, 'NF > 1 && FNR > 1 && \$2 < -0.401 { n++ } END { exit n > 0 }' $dir/fall.csv $dir/fall_test.csv"
check 'always in contact: without contacts, and said' sh -c "
    build/record $dir/fall.xml $dir/fall train=4 test=1 seconds=4 > $dir/fall.log &&
    grep 'met a contact too early (a contact of geoms 1  and 2 ); again without contacts' $dir/fall.log &&
    grep '^without contacts: ' $dir/fall.log && grep 'recorded without contacts' $dir/fall.h"
xml dry "<body><joint axis='0 1 0' frictionloss='0.01'/>$rod</body>"
check 'dry friction' sh -c "build/record $dir/dry.xml $dir/dry $few &&
    grep '^ *dry friction \*/' $dir/dry.h && grep -x '#define ROLN_FRICTION 1' $dir/dry.h"
xml spin "<body><joint axis='0 0 1'/>$rod</body>" "<actuator><motor joint='__' gear='1'/></actuator>"
sed -i "s/<joint axis/<joint name='__' axis/" $dir/spin.xml
check 'turns round' sh -c "build/record $dir/spin.xml $dir/spin train=12 test=1 seconds=5 |
    grep 'joints turn round in [1-9]: without autoencoder as angles' &&
    grep 'joints that turn round: 1' $dir/spin.h && grep -x '#define ROLN_ANGLES 1' $dir/spin.h"
bead="<geom size='.01' mass='.01' contype='0' conaffinity='0'/>"
xml wild "<body><joint type='slide' axis='1 0 0' stiffness='2e5' damping='30'/>$bead</body>"
check 'a stiff spring: the integrator of the model, with small steps' \
    sh -c "build/record $dir/wild.xml $dir/wild $few | grep '^Euler with 32 steps of 3.125e-05 s'"

# ---- machines of strangers: recorded as they are ----

# A timestep of 20 ms: energy is constant without friction, which RK4 with that step does not keep; twin: the sum of T in the file
link="<joint axis='0 0 1'/><geom type='capsule' fromto='0 0 0 .3 0 0' size='.02' contype='0' conaffinity='0'/>"
xml coarse "<body>$link<body pos='.3 0 0'>$link</body></body>" '' "gravity='0 0 0'"
sed -i "s/timestep='0.001'/timestep='0.02'/" $dir/coarse.xml
cat > $dir/energy.c << 'END_OF_FILE'
/* The largest change of a machine's energy in a recording, in parts of it. */
#include <math.h>
#include <mujoco/mujoco.h>
#include <stdio.h>
#include <string.h>

int main(int argc, char **argv)
{
    char error[500], line[1000];
    mjModel *m = mj_loadXML(argv[1], NULL, error, sizeof error);
    mjData *d = mj_makeData(m);
    double x[40], first = -1, worst = 0;
    FILE *f = fopen(argv[2], "r");
    m->opt.enableflags |= mjENBL_ENERGY;
    while (fgets(line, sizeof line, f)) {
        int at = 0, k = 0;
        for (; k <= 2 * m->nv && sscanf(line + at, "%lf%*1[,\n]", &x[k]) == 1; k++) at += (int)strcspn(line + at, ",\n") + 1;
        if (k <= 2 * m->nv) { first = -1; continue; }
        memcpy(d->qpos, x + 1, (size_t)m->nv * sizeof(double)), memcpy(d->qvel, x + 1 + m->nv, (size_t)m->nv * sizeof(double));
        mj_forward(m, d);
        if (first < 0) first = d->energy[1];
        worst = fmax(worst, fabs(d->energy[1] / first - 1));
    }
    printf("energy changes by %g\n", worst);
    return !(worst > 0 && worst < 0.01);
}
END_OF_FILE
check 'energy' gcc -std=c99 -O1 $dir/energy.c -o $dir/energy -lmujoco -lm
check 'a timestep of 20 ms without gravity' sh -c "build/record $dir/coarse.xml $dir/coarse train=6 test=2 > $dir/coarse.log &&
    awk -F, 'NR == 3 { exit \$1 != 0.002 }' $dir/coarse.csv &&
    grep '^Euler with [0-9]* steps .* the motion by 0.0[0-9]* %' $dir/coarse.log"
check 'its energy' $dir/energy $dir/coarse.xml $dir/coarse.csv
check 'it moves in every recording' awk -F, 'NF < 2 { bad += n < 50; n = 0 }
    NF > 1 && NR > 1 { n += $4 ^ 2 + $5 ^ 2 > 1e-4 } END { exit bad || n < 50 }' $dir/coarse.csv
xml held "<body><joint axis='0 1 0' frictionloss='0.5'/>$rod</body>" "<actuator><motor joint='__'/></actuator>" "gravity='0 0 0'"
sed -i "s/<joint axis/<joint name='__' axis/" $dir/held.xml
check 'dry friction without gravity: moved, or not counted' sh -c "
    build/record $dir/held.xml $dir/held train=6 test=2 > $dir/held.log &&
    awk -F, 'function end() { if (n && high - low < 0.015) bad = 1; n = 0 } NF < 2 { end() }
        NF > 1 && NR > 1 { if (n++ == 0) low = high = \$2; if (\$2 < low) low = \$2; if (\$2 > high) high = \$2 }
        END { end(); exit bad }' $dir/held.csv"
xml stuck "<body><joint axis='0 1 0' damping='1e4'/>$rod</body>" '' "gravity='0 0 0'"
says '^hint: unstable: ' build/record $dir/stuck.xml $dir/no $few
check 'stuck: the true reason' grep 'of 12 recordings 0 were unstable (-), 0 met .*, 12 did not move' $dir/says.log
check 'gripper: begins closed' sh -c "build/record $machines/gripper.xml $dir/gripper $few | grep 'limit' | grep -v unstable"
check 'gripper: opens' awk -F, 'NF > 1 && NR > 1 && $3 > 0.1 { n++ } END { exit n < 100 }' $dir/gripper.csv
check 'hoist: a taut string' sh -c "build/record $machines/hoist.xml $dir/hoist $few | grep '^1 tendons are taut at rest' &&
    grep -x '#define ROLN_AE 3, 2' $dir/hoist.h"
check 'hoist: it stays taut' awk -F, 'NF > 1 && NR > 1 { l = sqrt(($3 - $2) ^ 2 + ($4 - .4) ^ 2); bad += l < .399 || l > .41 }
    END { exit bad }' $dir/hoist.csv
check 'finger: no contact in recordings' sh -c "build/record $machines/finger.xml $dir/finger $few > $dir/finger.log &&
    ! grep 'did not move' $dir/finger.log &&
    grep '^dry friction holds a joint in [1-9][0-9]* % of the samples: ROLN_STICTION' $dir/finger.log"
check 'swimmer: drag' sh -c "build/record $machines/swimmer.xml $dir/swimmer $few |
    grep '^drag grows with the square of the speed .density 1000.' && grep -x '#define ROLN_DAMPING 2' $dir/swimmer.h"
check 'servos: no jumps, little saturation' sh -c "build/record $machines/servo6.xml $dir/servo6 train=5 test=1 > $dir/servo6.log &&
    awk '/at full force/ { on = 1; next } on && (\$(NF - 1) > 2 || \$5 > 3) { bad = 1 } END { exit !on || bad }' $dir/servo6.log"
check 'hinges with limits that turn round' sh -c "grep '^#define ROLN_ANGLES .*1' $dir/servo6.h &&
    grep -x '#define ROLN_ANGLES 1, 1, 1, 1, 1, 1' $dir/servo6_angles.h"
check 'half the speed' sh -c "build/record $machines/servo6.xml $dir/slow6 train=5 test=1 speed=0.3 > $dir/slow6.log &&
    for f in servo6 slow6; do awk '\$2 == \"pan\" { print \$5 }' $dir/\$f.log; done |
    awk '{ v[NR] = \$1 } END { exit v[2] > 0.6 * v[1] }'"
check 'less effort' sh -c "build/record $machines/planar3.xml $dir/weak train=6 test=2 seconds=1 effort=0.3 > $dir/weak.log &&
    awk '\$2 == \"a\" && NF > 8 { exit !(\$8 < 30) }' $dir/weak.log"
check 'progress' grep -x '  steps of a sample: trying' $dir/coarse.log

# ---- next= ----

# as FILE: the recordings of OUT behind the first four begin as those of FILE, and move as they do where FILE says how
cat > $dir/as.awk << 'END_OF_FILE'
FNR == 1 { k = 0; next }
NF < 2 { k++; next }
FNR == NR { n = k + 1; for (j = 2; j <= 10; j++) want[k, $1, j] = $j; next }
k >= 4 && (k - 4, $1, 2) in want { same += $1 > 0; for (j = 2; j <= 4; j++) bad += ($j - want[k - 4, $1, j]) ^ 2 > 1e-12 }
k >= 4 && fall { bad += $8 ^ 2 + $9 ^ 2 + $10 ^ 2 > 0 }
END { print k + 1 " recordings, " same " samples as wanted, " bad " others"; exit k != 3 + n || bad || same < (fall ? 0 : 1000) }
END_OF_FILE
next() { build/record $machines/planar3.xml "$dir/$1" $few next="$dir/$2.csv" > "$dir/$1.log"; }
check 'what was recorded once can be wanted' build/record $machines/planar3.xml $dir/wanted train=3 test=1 seconds=0.5 seed=9
check 'next=: recorded' next led wanted
check 'next=: all' grep '^next=: 0 of those that were chosen could not be recorded$' $dir/led.log
check 'next=: the motion that was wanted' awk -F, -f $dir/as.awk $dir/wanted.csv $dir/led.csv
awk -F, 'FNR == 1 { print "t,q1,q2,q3,qd1,qd2,qd3" } $1 == "0" { print $1 "," $2 "," $3 "," $4 "," $5 "," $6 "," $7; print "" }' \
    $dir/wanted.csv > $dir/starts.csv
check 'next=: starts alone' next fell starts
check 'next=: they fall' awk -F, -v fall=1 -f $dir/as.awk $dir/starts.csv $dir/fell.csv
check 'next=: no recordings for the test' sh -c "build/record $machines/planar3.xml $dir/alone $few > $dir/alone.log &&
    cmp $dir/alone_test.csv $dir/led_test.csv"
sed '3s/,.*//' $dir/wanted.csv > $dir/row.csv
sed '/^$/,$d; s/,[^,]*$/,9/; s/^0,[^,]*/0,400/' $dir/wanted.csv > $dir/far.csv
check 'next=: out of reach' sh -c "build/record $machines/planar3.xml $dir/off $few next=$dir/far.csv |
    grep '^next=: 1 of those that were chosen could not be recorded$' && test \$(grep -c '^\$' $dir/off.csv) -eq 3"
for machine in hoist fivebar; do
    refuses 'next=: a start would break the equalities' build/record $machines/$machine.xml $dir/no $few next=$dir/wanted.csv
done
refuses 'next=.*: no recordings of this machine' build/record $machines/slider.xml $dir/no $few next=$dir/wanted.csv
refuses 'nothing.csv: No such file' build/record $machines/planar3.xml $dir/no $few next=$dir/nothing.csv
refuses 'row.csv:3: no recording of 3 joints' build/record $machines/planar3.xml $dir/no $few next=$dir/row.csv
refuses 'next=.*: samples of 0.001 s, here 0.004 s' build/record $machines/planar3.xml $dir/no $few dt=0.004 next=$dir/wanted.csv

# ---- learned ----

# learn NAME STEPS CODE VERDICT SETTING ..: a model that predicts better than q + h qd, whether it is called useful or not
learn() {
    name=$1
    steps=$2
    wanted=$3
    verdict=$4
    shift 4
    check "$name" sh -c 'wanted=$1 verdict=$2; shift 2; sh tests/mujoco/learn.sh "$@"
        [ $? -eq $wanted ] && tail -n 1 "$2.learn" | grep "$verdict"' learn "$wanted" "$verdict" \
        "$machines/$name.xml" "$dir/learned/$name" "steps=$steps" "$@"
    check "$name: its table" awk '$1 == 100 { n += $4 < $2 / 3 } END { exit n != 1 }' "$dir/learned/$name.learn"
    check "$name: no complaint about its recordings" sh -c "! grep 'warning: .*csv: ' $dir/learned/$name.log"
}
learn still2 105 0 '^useful for control, and for prediction up to' train=12 test=3 seconds=1
learn fivebar 40 3 '^not useful: ended by steps=40 at step 40: before windows' train=12 test=3 seconds=0.5
check 'fivebar: two coordinates' sh -c "grep -x '#define ROLN_AE 4, 2' $dir/learned/fivebar.h &&
    grep -x '#define ROLN_AE 4' $dir/learned/fivebar_full.h"
check 'fivebar: beside all joints' awk '$1 == 25 { exit !($3 > 0 && $3 != $4) }' $dir/learned/fivebar.learn
says '^hint: check the path' sh tests/mujoco/learn.sh nothing.xml $dir/learned/nothing steps=1
says 'none does not compile: ' env CC=false sh tests/mujoco/learn.sh $machines/slider.xml $dir/learned/none steps=1 $few
check 'not useful' sh -c "
    OPTIMISE=-O1 sh tests/mujoco/learn.sh $machines/planar3.xml $dir/learned/worse steps=1 $few > $dir/worse.log
    [ \$? -eq 3 ] && tail -n 1 $dir/worse.log | grep '^not useful: ended by steps=1 at step 1: ' &&
    grep 'joints as numbers: E_q [0-9.]* %; all hinges as angles: [0-9.]* %, after 1 steps' $dir/worse.log"
# what is trained, and what is kept: a compiler that makes a trainer of a shell script, which learns nothing in no time
cat > $dir/cc << 'END_OF_FILE'
#!/bin/sh
while [ $# -gt 0 ]; do [ "$1" != -o ] || to=$2; shift; done
place=$(dirname "$to")
cat > "$to" << END_OF_TRAINER
for a; do case \$a in out=*) out=\${a#out=} ;; seconds=*) echo "asked for \$a" ;; esac; done
e=3
grep -q 'ANGLES' $place/*.h && e=2.5
grep -q '_full' $place/*.h && e=${FULL:-3}
grep -q 'MLP 32, 32' $place/*.h && e=$WIDE
grep -q 'POLYNOMIALS' $place/*.h && e=${POLYNOMIALS:-3}
case \$e in none) echo 'nothing was learned'; exit 1 ;; esac
echo "      0  E_q(24 ms)   1.0 %  E_q(1 s)  9 +- 1 %, typical 9.000 %  residual 1"
echo "    400  E_q(24 ms)   0.1 %  E_q(1 s)  \$e +- 1 %, typical \$e %  residual 1"
for f in .roln _weights.h .check; do echo \$e > \$out\$f; done
for a; do case \$a in next=2) cp $NEXT \${out}_next.csv ;; esac; done
joints=\$(awk '/ROLN_AE/ { sub(/,/, "", \$3); print \$3 }' $place/*.h)
each=\$(seq \$joints | sed 's/.*/0.5,8/' | paste -sd, -)
{
    echo "recordings,ms,E_q_percent,E_q_error,E_qd_percent,E_qd_error,failed,windows,worst_joint,\$(seq \$joints |
        sed 's/.*/E_q&_percent,rms_q&/' | paste -sd, -),constant_velocity_percent,counts,recording_count"
    for t in 0 26 100 1000; do echo "\"a_test.csv\",\$t,$ERROR,0,1,0,0,50,1,\$each,9,1,10"; done
} > \${out}_errors.csv
END_OF_TRAINER
chmod +x "$to"
END_OF_FILE
chmod +x $dir/cc
# keeps WHAT WIDE ERROR CODE VERDICT MODEL: that header and verdict
keeps() {
    WIDE=$2 ERROR=$3 CC=$dir/cc sh tests/mujoco/learn.sh "$6" $dir/learned/grown seconds=100 $few > $dir/grown.log
    check "$1: exit code" test $? -eq "$4"
    check "$1: verdict" sh -c "tail -n 1 $dir/learned/grown.learn | grep '$5'"
    check "$1: network" grep -x "#define ROLN_MLP $1" $dir/learned/grown.h
}
keeps '32, 32' 2 0.5 0 '^useful for control, and for prediction up to 1 s$' $dir/spin.xml
keeps '16, 16' 2.9 2 0 '^useful for prediction up to 1 s: there are no motors$' $dir/dry.xml
keeps '16, 16' 2.9 9 3 '^not useful: E_q is 9 % at 26 ms' $dir/dry.xml
keeps '16, 16' 2.9 4.6 3 '^not useful: E_q at 26 ms is 4.6 %, of q + h qd 9 %' $machines/planar3.xml
check 'angles are kept' grep 'ROLN_ANGLES 1, 1, 1' $dir/learned/grown.h
check 'both were tried' grep '^note joints as numbers: E_q 3 %; all hinges as angles: 2.5 %, after 400 steps' \
    $dir/learned/grown.learn
for FULL in 1.4 1.6; do # all joints are kept if they have less than half of the error
    export FULL
    coordinates=$([ $FULL = 1.4 ] && echo 4 || echo '4, 2')
    keeps '16, 16' 2.9 0.5 0 '^useful for prediction up to 1 s: there are no motors$' $machines/fivebar.xml
    check "$FULL: $coordinates" grep -x "#define ROLN_AE $coordinates" $dir/learned/grown.h
    check "$FULL: its name" sh -c "grep -x '#define ROLN_NAME grown' $dir/learned/grown.h"
    check "$FULL: its weights" grep -x "$([ $FULL = 1.4 ] && echo 1.4 || echo 3)" $dir/learned/grown_weights.h
done
unset FULL
# polynomials MACHINE WON OPTION NOTE: kept by their error, which is POLYNOMIALS, or not; none: they cannot be trained
polynomials() {
    WIDE=2.6 ERROR=0.5 CC=$dir/cc sh tests/mujoco/learn.sh "$1" $dir/learned/grown seconds=100 $few > $dir/grown.log
    check "polynomials $POLYNOMIALS: config" grep -x "#define $3" $dir/learned/grown.h
    check "polynomials $POLYNOMIALS: note" grep "^note $4" $dir/learned/grown.learn
    check "polynomials $POLYNOMIALS: $2" grep "^$2, 400 steps" $dir/learned/grown.learn
}
for POLYNOMIALS in 2.2 2.3 none; do
    export POLYNOMIALS
    case $POLYNOMIALS in
    2.2) polynomials $machines/planar3.xml 'polynomials of degrees 2, 3' 'ROLN_MASS squares, 6' \
        'networks of 16, 16: E_q 2.5 %; polynomials of degrees 2, 3: 2.2 %$' ;;
    2.3) polynomials $machines/planar3.xml 'networks of 16, 16' 'ROLN_MLP 16, 16' \
        'networks of 16, 16: E_q 2.5 %; polynomials of degrees 2, 3: 2.3 %$' ;;
    none) polynomials $machines/fivebar.xml 'networks of 32, 32' 'ROLN_MLP 32, 32' 'grown was not trained: nothing was learned$' ;;
    esac
done
unset POLYNOMIALS
# chosen WORDS CODE NEXT: make learn whose first model chooses two recordings more, or cannot choose them
chosen() {
    NEXT=$dir/two.csv WIDE=2 ERROR=0.5 CC=$dir/cc sh tests/mujoco/learn.sh $machines/planar3.xml $dir/learned/chosen \
        seconds=100 $few next="$3" > $dir/chosen.log
    check "next=$3: exit code" test $? -eq "$2"
    check "next=$3: said" grep "$1" $dir/chosen.log
}
sed 2,503d $dir/wanted.csv > $dir/two.csv
chosen '^training chosen, to choose 2 recordings more$' 0 2
check 'next=2: six recordings, the last two as they were wanted' awk -F, -f $dir/as.awk $dir/two.csv \
    $dir/learned/chosen.csv
chosen 'typical 3' 1 3
check 'all joints: told' sh -c "FULL=1 CC=$dir/cc WIDE=9 ERROR=0.5 sh tests/mujoco/learn.sh $machines/fivebar.xml \
    $dir/learned/grown seconds=100 $few | grep '^note 2 coordinates: E_q 3 %; all 4 joints: 1 %, so the model has all joints'"
check 'E_qd is in the table' awk '$1 == 100 { exit $5 != 1 }' $dir/learned/grown.learn

check 'table' sh -c "sh tests/mujoco/learn.sh table $dir/learned/still2 $dir/learned/none $dir/learned/fivebar > $dir/table &&
    grep '^| still2 | 2, 1 | 2 | [0-9.e+]* / [0-9.e+]* / [0-9.e+]* | .* | useful for control' $dir/table &&
    grep '^| none | .*does not compile' $dir/table"

# ---- HDF5 in ----

{ cat $dir/arm.csv; echo; sed 1d $dir/arm_test.csv; } > $dir/both.csv
check 'back from HDF5' sh -c "build/convert $dir/arm.h5 $dir/back.csv && cmp $dir/both.csv $dir/back.csv"
check 'sets' build/generate pend2_act $dir/2.h5 --train 2 --test 1 --tune 1 --csv $dir/2
awk -F, 'NF > 1 && FNR > 1' $dir/2_train.csv $dir/2_test.csv $dir/2_tune.csv > $dir/2.want
check 'sets of generate' sh -c "build/convert $dir/2.h5 $dir/2.csv && awk -F, 'NF > 1 && FNR > 1' $dir/2.csv | cmp - $dir/2.want"
cat > $dir/layouts.c << 'END_OF_FILE'
/* The recorder's file in the layouts of others: robomimic's observations, and MuJoCo's states. */
#include <hdf5.h>
#include <string.h>

static void put(hid_t group, const char *name, int rank, int samples, int n, const double *x)
{
    const hsize_t shape[2] = {(hsize_t)samples, (hsize_t)n};
    hid_t space = H5Screate_simple(rank, shape, NULL);
    hid_t set = H5Dcreate2(group, name, H5T_NATIVE_FLOAT, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
    H5Dwrite(set, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, x);
    H5Dclose(set), H5Sclose(space);
}

int main(int argc, char **argv)
{
    enum { S = 30 };
    static double q[S * 2], qd[S * 2], u[S], states[S * 6], small[S];
    hid_t file = H5Fcreate(argv[argc - 1], H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
    hid_t data = H5Gcreate2(file, "data", H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
    const char *const names[] = {"demo_1", "demo_7"};
    for (int k = 0; k < 2; k++) {
        hid_t demo = H5Gcreate2(data, names[k], H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
        hid_t obs = H5Gcreate2(demo, "obs", H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
        for (int i = 0; i < S; i++) {
            u[i] = i % 4, small[i] = i;
            states[6 * i] = i * 0.25, states[6 * i + 5] = 9;
            for (int j = 0; j < 2; j++) {
                q[2 * i + j] = states[6 * i + 1 + j] = k + i + j * 0.5;
                qd[2 * i + j] = states[6 * i + 3 + j] = 4;
            }
        }
        put(obs, "robot0_joint_pos", 2, S, 2, q), put(obs, "robot0_joint_vel", 2, S, 2, qd), put(demo, "actions", 2, S, 1, u);
        put(demo, "states", 2, S, 6, states), put(demo, "short", 2, S - 1, 2, qd), put(demo, "one", 1, S, 1, small);
        H5Gclose(obs), H5Gclose(demo);
    }
    H5Gclose(data), H5Fclose(file);
    return 0;
}
END_OF_FILE
check 'other layouts' sh -c "gcc -std=c99 $dir/layouts.c -o $dir/layouts \$(pkg-config --cflags --libs hdf5) &&
    $dir/layouts $dir/robo.h5"
check 'robomimic' build/convert $dir/robo.h5 $dir/robo.csv dt=0.25
{ echo t,q1,q2,qd1,qd2,u1; awk 'BEGIN { for (k = 0; k < 2; k++) { if (k) print ""; for (i = 0; i < 30; i++)
    printf "%g,%g,%g,4,4,%d\n", i / 4, k + i, k + i + .5, i % 4 } }'; } > $dir/robo.want
check 'robomimic: its numbers' cmp $dir/robo.csv $dir/robo.want
check 'states' sh -c "build/convert $dir/robo.h5 $dir/states.csv states=2 && cmp $dir/states.csv $dir/robo.want"
check 'names' build/convert $dir/robo.h5 $dir/names.csv q=obs/robot0_joint_pos qd=obs/robot0_joint_vel force=actions dt=0.25
check 'names: the same numbers' cmp $dir/names.csv $dir/robo.want
check 'no commands' sh -c "build/convert $dir/robo.h5 $dir/names.csv dt=0.25 force= && head -n 1 $dir/names.csv |
    grep -x 't,q1,q2,qd1,qd2'"
says 'convert IN.h5' build/convert $dir/robo.h5
says 'convert IN.h5' build/convert $dir/robo.h5 $dir/no.csv dt=-1
says 'convert IN.h5' build/convert $dir/robo.h5 $dir/no.csv much
says 'convert IN.h5' build/convert $dir/robo.h5 $dir/no.csv dt=inf
says 'convert IN.h5' build/convert $dir/robo.h5 $dir/no.csv states=1e10
refuses 'not there, or no HDF5' build/convert $dir/nothing.h5 $dir/no.csv
refuses 'not there, or no HDF5' build/convert $dir/arm.csv $dir/no.csv
refuses 'no group steps' build/convert $dir/robo.h5 $dir/no.csv data=steps
refuses 'robo.h5: demo_1: there is no t' build/convert $dir/robo.h5 $dir/no.csv
refuses 'robo.h5: demo_1: there is no pose, which q= names' build/convert $dir/robo.h5 $dir/no.csv dt=1 q=pose
refuses 'robo.h5: demo_1: qd is .1,29,2., q is .1,30,2.' build/convert $dir/robo.h5 $dir/no.csv dt=1 qd=short
refuses 'robo.h5: demo_1: the force is .1,29,2., q is' build/convert $dir/robo.h5 $dir/no.csv dt=1 force=short
refuses 'robo.h5: demo_1: states has 6 columns, t, q and qd of 3 joints have 7' build/convert $dir/robo.h5 $dir/no.csv states=3
refuses 'robo.h5: demo_1: obs: no array of numbers' build/convert $dir/robo.h5 $dir/no.csv dt=1 force=obs
says 'No such file' build/convert $dir/arm.h5 $dir/nowhere/no.csv
check 'nothing was written' test ! -e $dir/no.csv

# as strangers store them (h5_cases.c): the same numbers, in the same order, or a refusal that names the recording
for c in plain packed big attributes padded episodes suffix numbers large newline links epoch uptime nanoseconds; do
    build/h5_cases $c $dir/$c.h5
    check "HDF5: $c" build/convert $dir/$c.h5 $dir/$c.csv
    cut -d, -f2- $dir/$c.csv > $dir/$c.q
    check "HDF5: $c, its numbers" cmp $dir/plain.q $dir/$c.q
done
check 'the order of people' awk -F, '$1 == 0 { n++; bad += ($2 - sin(k)) ^ 2 > 1e-16; k++ } END { exit bad > 0 || n != 12 }' \
    $dir/plain.csv
for c in f32 int; do
    build/h5_cases $c $dir/$c.h5
    check "HDF5: $c" build/convert $dir/$c.h5 $dir/$c.csv
done
paste -d, $dir/plain.csv $dir/f32.csv > $dir/f32.both
check 'f32: its numbers' awk -F, 'NR > 1 && NF == 10 { n++; for (i = 1; i < 6; i++) bad += ($i - $(i + 5)) ^ 2 > 1e-13 }
    END { exit bad > 0 || n != 480 }' $dir/f32.both
check 'int: its numbers' awk -F, 'NR == 3 { ok = $2 == 100 && $3 == 100 && $4 == 10000 } END { exit !ok }' $dir/int.csv
check 'since 1970: every step' awk -F, 'NR > 1 && NF { if (n++ % 40) bad += ($1 - t - 0.01) ^ 2 > 1e-12; t = $1 }
    END { exit bad > 0 || n != 480 || t < 1.7e9 }' $dir/epoch.csv
while read -r c words; do
    build/h5_cases "$c" "$dir/$c.h5"
    refuses "$c.h5: $words" build/convert "$dir/$c.h5" $dir/no.csv
done << 'END_OF_TABLE'
dangling demo_5b: no group that can be opened
outside demo_5b: no group that can be opened
circle demo_5b: no group that can be opened
dataset demo_5b: no group that can be opened
empty demo_5b: there is no q
missing demo_1: there is no q
nan demo_1: row 7 of q has nan
inf demo_1: row 3 of qd has inf
1e39 demo_1: row 3 of qd has 1e+39
ragged demo_1: qd is .1,39,2., q is .1,40,2.
shape demo_1: qd is .1,40,1., q is .1,40,2.
rank demo_1: q: no array of numbers of rank 1 to 3
text demo_1: qd: no array of numbers of rank 1 to 3
none demo_0: t: no numbers
wide demo_1: 1 joints and 0 forces, in recordings before it 2 and 0
huge demo_0: qd: too many numbers, or more than the file holds
root no group data or train
END_OF_TABLE
refuses 'plain.h5: data: there is no q' build/convert $dir/plain.h5 $dir/no.csv data=/
check 'nothing was written of them' test ! -e $dir/no.csv
cp $dir/plain.h5 $dir/second.h5
refuses 'second.h5: HDF5, which would be lost' build/convert $dir/plain.h5 $dir/second.h5
check 'it is not lost' cmp $dir/plain.h5 $dir/second.h5
check 'root, told' build/convert $dir/root.h5 $dir/root.csv data=other
build/h5_cases twice $dir/twice.h5
check 'a stamp that comes twice on a steady clock' sh -c "build/convert $dir/twice.h5 $dir/twice.csv > $dir/twice.log &&
    grep 'a clock of 10 ms rounded to 10 ms' $dir/twice.log && grep 'twice.csv: 12 recordings of 2 joints' $dir/twice.log"
echo old > $dir/cut.csv
(ulimit -f 0; build/convert $dir/plain.h5 $dir/cut.csv; echo "ended with $?") 2>&1 | cat > $dir/signal.log
check 'a signal' grep 'plain.h5: reading it ended with signal' $dir/signal.log
check 'a signal, its hint and exit code' awk 'NR == 2 { ok = /^hint: possible cause/ } NR == 3 { ok = ok && /^ended with 1$/ }
    END { exit !ok || NR != 3 }' $dir/signal.log
check 'a signal: the old file stays, and nothing beside it' sh -c "grep -x old $dir/cut.csv && test ! -e $dir/cut.csv.part"
check 'damaged HDF5' python3 tests/safety/fuzz_files.py convert 300

# ---- refused ----

says '^record: usage' build/record
refuses 'cannot read nothing.xml: No such' build/record nothing.xml $dir/no
echo '<mujoco><worldbody>' > $dir/broken.xml
says 'broken.xml: .*XML' build/record $dir/broken.xml $dir/no
xml ball "<body><joint name='neck' type='ball'/>$rod</body>"
refuses 'joint 1 neck is a ball joint: its quaternion is no q with qd = dq/dt' \
    build/record $dir/ball.xml $dir/no
xml free "<body><joint type='slide'/>$rod<body><joint axis='1 0 0'/>$rod</body></body><body><freejoint/>$rod</body>"
refuses 'joint 3  is free: its quaternion' build/record $dir/free.xml $dir/no
xml none "<body>$rod</body>"
refuses 'there are no joints' build/record $dir/none.xml $dir/no
says '^hint: one of seed=, train=' build/record $machines/slider.xml $dir/no haste=1
refuses 'ape: no setting' build/record $machines/slider.xml $dir/no ape
for word in seed=-1 train=1e9 test=0 seconds=0.01 dt=2 test=much train=nan; do
    refuses "$word: expected a number" build/record $machines/slider.xml $dir/no $word
done
# names: each OUT is mapped to a name in C that no other file has
while read -r out name; do
    check "OUT $out" sh -c "build/record --name $dir/$out | grep -x $dir/$name"
done << 'END_OF_TABLE'
arm arm
no-name no_name
a.b.c a_b_c
2 m2
string string_model
roln roln_model
arm_full arm_full_model
arm_test arm_test_model
END_OF_TABLE
check 'OUT is mapped' sh -c "build/record $machines/slider.xml $dir/1-way $few |
    grep '1-way is written as .*/m1_way' && test -f $dir/m1_way.h"
mkdir -p $dir/a $dir/b
cp $machines/slider.xml $dir/a/twice.xml
cp $machines/slider.xml $dir/b/twice.xml
check 'two models of one file name' sh -c "build/record $dir/a/twice.xml $dir/twice $few &&
    build/record --name $dir/twice $dir/a/twice.xml | grep -x $dir/twice &&
    build/record --name $dir/twice $dir/b/twice.xml | grep -x $dir/twice_2"
# words of newer versions
newer() { # OLD NEW HINT
    sed "s|$1|$2|" $machines/slider.xml > $dir/newer.xml
    says "^hint: in place of $3" build/record $dir/newer.xml $dir/no
}
newer '<worldbody>' '<option integrator="implicitfast"/><worldbody>' 'implicitfast write implicit. MuJoCo 2.2 has Euler, RK4'
newer '<worldbody>' '<option><flag eulerdamp="disable"/></option><worldbody>' 'eulerdamp write nothing'
newer '<worldbody>' '<worldbody><frame pos="0 0 1"/>' 'frame write its children'
newer '<worldbody>' '<worldbody><body gravcomp="1"/>' 'gravcomp write nothing'
newer '<joint ' '<joint actuatorfrcrange="-1 1" ' 'actuatorfrcrange write forcerange'
newer '<motor ' '<position kv="1" ' 'kv write <general'
newer '<motor ' '<general dyntype="filterexact" ' 'filterexact write filter'
sed 's|<worldbody>|<option zeal="1"/><worldbody>|' $machines/slider.xml > $dir/newer.xml
says '^hint: MuJoCo 2.2.* does not know zeal. Possible cause: a model for a newer version' build/record $dir/newer.xml $dir/no
xml range "<body><joint axis='0 1 0' range='-90 90'/>$rod</body>"
says '^hint: add <compiler autolimits="true"/>' build/record $dir/range.xml $dir/no
refuses 'no file name of 1 to 80 letters' build/record $machines/slider.xml $dir/
refuses 'cannot write .*nowhere/a.h: No such' build/record $machines/slider.xml $dir/nowhere/a $few
xml stiff "<body><joint type='slide' axis='1 0 0' stiffness='1e9'/>$bead</body>"
says '^hint: unstable: ' build/record $dir/stiff.xml $dir/no $few
check 'stiff: the true reason' grep 'of 12 recordings 12 were unstable (.*), 0 met a limit too early' $dir/says.log
check 'gentler and gentler' grep 'again with amplitudes of 0.0625' $dir/says.log
xml tight "<body><joint axis='0 1 0' limited='true' range='1 1.1'/>$rod</body>"
check 'tight: shorter recordings, and said' sh -c "build/record $dir/tight.xml $dir/tight $few |
    grep 'met a limit too early (the limit of joint 1 ); again, with recordings of'"
check 'nothing is left of what was refused' sh -c "! ls $dir/no.* $dir/no_* 2> /dev/null"
check 'no MODEL' sh -c "! make -s learn MODEL= 2>&1 && ! make -s record MODEL= 2>&1"
check 'no MODEL: said' sh -c "make -s learn MODEL= 2> /dev/null | grep 'make learn MODEL=my.xml'"
echo "$passed passed, $failed failed"
[ $failed -eq 0 ]
