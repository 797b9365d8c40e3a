#!/bin/sh
# SPDX-License-Identifier: MIT
# examples/import.py: checkpoints as PyTorch writes them become a config, weights and bytes that roln reads, and compute what the
# tensors say (checkpoint.py, in double); what cannot be represented is refused with its message, and nothing written.
# Last line: N passed, N failed.
cd "$(dirname "$0")/../.." || exit 1
dir=build/import
. tests/user/check.sh
mkdir $dir/no
python="python3 -B"
import="$python examples/import.py"

# ranges WORDS ARGUMENT ..: range.c ends with 1, says WORDS, and the weights are as they were
ranges() {
    words=$1
    shift
    cp $dir/ae/ae.roln $dir/kept.roln
    check "range: $words" sh -c "! $dir/ae/range $* 2> $dir/says.log && grep '$words' $dir/says.log && tail -n 1 $dir/says.log |
        grep '^hint: ' && cmp $dir/kept.roln $dir/ae/ae.roln"
}

cat > $dir/probe.c << 'END_OF_FILE'
/* The model as written and as packed: the same numbers, and those of roln's own writer; and what it computes. */
#define STRING_(x) #x
#define STRING(x) STRING_(x)
#define CAT_(a, b) a##b
#define CAT(a, b) CAT_(a, b)
#define M(name) CAT(MODEL, _##name)
#define HEADER(x) STRING(x.h)
#include HEADER(MODEL)
#include HEADER(M(weights))
#include "probe.h"
#include <math.h>
#include <stdio.h>

static int wrong;

static void compare(const char *what, int n, const roln_real *x, const double *y)
{
    double off = 0, size = 0;
    int i;
    for (i = 0; i < n; i++)
        off += ((double)x[i] - y[i]) * ((double)x[i] - y[i]), size += y[i] * y[i];
    if (!(sqrt(off) <= 5e-6 * (1 + sqrt(size)))) wrong = 1, printf("%s is %.1e off, of %.1e\n", what, sqrt(off), sqrt(size));
}

static void put(void *file, const char *text)
{
    fputs(text, file);
}

int main(int argc, char **argv)
{
    static unsigned char file[M(packed_size) + 1], bytes[M(packed_size)];
    static M(params) p, seen;
    static M(work) work;
    static M(fit_range_work) room;
    FILE *f = fopen(argv[1], "rb"), *text = fopen(argv[2], "w");
    roln_real q[4][M(N)], qd[4][M(N)];
    size_t k;
    int j;
    if (argc != 3 || !f || !text) return 1;
    if (M(unpack)((int)fread(file, 1, sizeof file, f), file, &p) != ROLN_OK) return printf("not unpacked\n"), 1;
    M(pack)(&M(weights), bytes);
    if (memcmp(&p, &M(weights), sizeof p) != 0 || memcmp(file, bytes, sizeof bytes) != 0) return printf("other numbers\n"), 1;
    if (M(write)(&p, put, text) != ROLN_OK || fclose(text) != 0) return 1;
    seen = p;
    if (p.scale.q != 1 || p.scale.t != 1 || p.scale.m != 1 || p.dt != DT) return printf("other scales\n"), 1;
    for (k = 0; k < sizeof probes / sizeof *probes; k++) { /* the motion that range.c read */
        for (j = 0; j < (int)M(N); j++)
            q[k][j] = (roln_real)probes[k][0][j], qd[k][j] = (roln_real)probes[k][1][j];
    }
    if (RANGE && M(fit_range)(&seen, 4, q[0], qd[0], &room) != ROLN_OK) return 1;
    for (j = 0; j < (int)M(n); j++) {
        if (p.z_min[j] != seen.z_min[j] || p.z_max[j] != seen.z_max[j] || p.zd_max[j] != seen.zd_max[j])
            return printf("another range\n"), 1;
        if (!RANGE && (p.z_min[j] != 0 || p.z_max[j] != 0 || p.zd_max[j] != 0)) return printf("a range\n"), 1;
    }
    for (k = 0; k < sizeof probes / sizeof *probes; k++) {
        const double (*y)[64] = probes[k];
        M(state) x, back;
        M(latent) s;
        M(equation) e;
        roln_real tau[M(N)], tau_z[M(n)];
        int i;
        for (i = 0; i < (int)M(N); i++)
            x.q[i] = (roln_real)y[0][i], x.qd[i] = (roln_real)y[1][i], tau[i] = (roln_real)y[2][i];
        wrong |= M(encode)(&p, &x, &s, &work.encode) || M(decode)(&p, &s, &back, &work.decode) ||
                 M(dynamics)(&p, &s, &e, &work.dynamics) || M(reduce)(&p, &s, tau, tau_z, &work.reduce);
        compare("z", M(n), s.z, y[3]), compare("zd", M(n), s.zd, y[4]);
        compare("q", M(N), back.q, y[5]), compare("qd", M(N), back.qd, y[6]);
        compare("M", M(n) * M(n), e.M, y[7]), compare("c", M(n), e.c, y[8]), compare("g", M(n), e.g, y[9]);
        compare("T", 1, &e.T, y[10]), compare("V", 1, &e.V, y[11]), compare("tau_z", M(n), tau_z, y[12]);
        wrong |= M(step)(&p, &s, tau, (roln_real)0.01, &work.step) != ROLN_OK;
        compare("z after a step", M(n), s.z, y[13]), compare("zd after a step", M(n), s.zd, y[13] + M(n));
    }
    return wrong;
}
END_OF_FILE

# model KIND DT SETTING ..: imported, compiled without a warning, compared
model() {
    name=$(echo "$1" | tr - _)
    kind=$1
    dt=$2
    shift 2
    mkdir -p "$dir/$name"
    check "$kind: a checkpoint" $python tests/user/checkpoint.py "$kind" "$dir/$name/model.pt" "$dir/$name/probe.h" \
        "$dir/$name/motion.csv"
    check "$kind: imported" $import "$dir/$name/model.pt" "$name" out="$dir/$name" dt="$dt" "$@"
    for cc in gcc clang; do
        check "$kind: $cc" $cc -std=c99 -O1 -ffp-contract=off -Wall -Wextra -Wpedantic -Werror -I. -I"$dir/$name" -DMODEL="$name" \
            -DDT="${dt}f" -DRANGE=0 $dir/probe.c -o "$dir/$name/probe" -lm
        check "$kind: $cc, its numbers" "$dir/$name/probe" "$dir/$name/$name.roln" "$dir/$name/written.h"
        check "$kind: $cc, the text is that of NAME_write" cmp "$dir/$name/${name}_weights.h" "$dir/$name/written.h"
    done
    check "$kind: range.c" gcc -std=c99 -O1 -Wall -Wextra -Wpedantic -Werror -I. -Iexamples -I"$dir/$name" \
        -DMODEL="$name" examples/range.c -o "$dir/$name/range" -lm
    check "$kind: its range" "$dir/$name/range" "$dir/$name/motion.csv" "$dir/$name/$name"
    check "$kind: with a range" gcc -std=c99 -O1 -ffp-contract=off -I. -I"$dir/$name" -DMODEL="$name" -DDT="${dt}f" -DRANGE=1 \
        $dir/probe.c -o "$dir/$name/probe" -lm
    check "$kind: with a range, its numbers" "$dir/$name/probe" "$dir/$name/$name.roln" "$dir/$name/written.h"
    check "$kind: with a range, the text" cmp "$dir/$name/${name}_weights.h" "$dir/$name/written.h"
    check "$kind: lint" sh examples/lint.sh "$dir/$name/$name.h"
}
model ae 0.005 alpha=pi/10
model lnn 0.0 step=euler
model ae-off 0.001 alpha=0.3141592653589793 repair=1
ranges '^usage: ' $dir/ae/motion.csv
for word in smooth=0 smooth=1.5 smooth= smooth=-1 smooth=1e5 smooth=99999999999999999999; do
    ranges '^smooth=.*: expected a whole number, 1 .. 100000' $dir/ae/motion.csv $dir/ae/ae $word
done
for word in dt=0 dt=-1 dt=nan dt=1x dt=; do
    ranges '^dt=.*: expected seconds from sample to sample' $dir/ae/motion.csv $dir/ae/ae $word
done
ranges '^unknown setting rough' $dir/ae/motion.csv $dir/ae/ae rough=1
ranges 'cannot read .*nothing.csv' $dir/nothing.csv $dir/ae/ae
ranges 'cannot read .*nothing.roln' $dir/ae/motion.csv $dir/nothing
ranges "lnn.roln: no weights of ae" $dir/ae/motion.csv $dir/lnn/lnn
printf 't,q1\n0,1\n' > $dir/few.csv
ranges 'few.csv:2: 2 columns, but ae needs t, 6 q, 6 qd' $dir/few.csv $dir/ae/ae
cut -d, -f1-7 $dir/ae/motion.csv > $dir/q.csv
check 'range: without qd' $dir/ae/range $dir/q.csv $dir/ae/ae
check 'range: smoothed' $dir/ae/range $dir/q.csv $dir/ae/ae smooth=1
# weights beside a config that was changed do not compile
sed -i 's/ROLN_INTEGRATOR rk4/ROLN_INTEGRATOR euler/' $dir/ae/ae.h
check 'another config' sh -c "! gcc -std=c99 -I. -I$dir/ae -DMODEL=ae -DDT=0 -DRANGE=0 $dir/probe.c 2> $dir/gcc.log &&
    grep -q weights_are_of_ROLN_INTEGRATOR_rk4 $dir/gcc.log"

# refuses WORDS KIND SETTING ..: it ends with 1, the last line says WORDS, and nothing is written
refuses() {
    words=$1
    kind=$2
    shift 2
    [ -e "$dir/$kind.pt" ] || $python tests/user/checkpoint.py "$kind" "$dir/$kind.pt"
    $import "$dir/$kind.pt" "${name:-arm}" out=$dir/no "$@" > $dir/says.log 2>&1
    code=$?
    if [ $code -eq 1 ] && tail -n 1 $dir/says.log | grep -q "^import.py: .*$words" && [ -z "$(ls $dir/no)" ]; then
        passed=$((passed + 1))
    else
        failed=$((failed + 1))
        echo "$kind $*: ended with $code; wanted: $words"
        tail -n 2 $dir/says.log
    fi
}
name=
a=alpha=pi/10
refuses 'alpha= is missing' ae
refuses 'alpha=pi/4: between 0 and pi/4' ae alpha=pi/4
refuses 'alpha=0: between' ae alpha=0
refuses 'alpha=pi/0: not a number' ae alpha=pi/0
refuses 'alpha=much: not a number' ae alpha=much
refuses 'step=heun: euler, leapfrog, rk4 or midpoint' ae $a step=heun
refuses 'dt=-1: a time step is not negative' ae $a dt=-1
refuses 'dt=nan: not a number' ae $a dt=nan
refuses 'dt=1e+39 is too large for a float\|1e+39 is too large for a float' ae $a dt=1e39
refuses 'repair=2: 0 or 1' ae $a repair=2
refuses 'activation=ReLU: the networks of roln have SoftPlus' ae $a activation=ReLU
refuses 'beta=1: not one of alpha=, step=' ae $a beta=1
refuses 'motion=a.csv: not one of alpha=, step=' ae $a motion=a.csv
name=2arm refuses '2arm: no name in C' ae $a
refuses 'layer 1: Psi^T Phi is not I; repair=1' ae-off $a
refuses 'layer 1: Psi^T Phi has no inverse' ae-singular $a repair=1
refuses 'the file asks for posix.system; only tensors are read' ae-evil $a
check 'and nothing was executed' test ! -e $dir/evil
refuses 'numbers of type Half: roln takes Float and Double' ae-half $a
refuses 'lagrangianNN.layers_D.0.weight: unknown to roln' ae-unknown $a
refuses 'lagrangianNN.layers_M.1.bias is missing' ae-missing $a
refuses 'autoencoder.layers.0.weight is missing' ae-hole $a
refuses 'lagrangianNN.layers_M.1.weight is \[8, 7\], not \[8, 8\]' ae-shape $a
refuses 'autoencoder.layers.0.weight is \[48\], not a matrix' ae-matrix $a
refuses 'layer 1 of the autoencoder goes from 4 to 5: sizes must not grow' ae-grows $a
refuses 'layers_M.0.weight takes 3 numbers, the autoencoder gives 2' ae-latent $a
refuses 'hidden sizes \[8, 8\] and \[8, 6\]: roln has one ROLN_MLP for both' ae-widths $a
refuses '6 hidden layers: roln has 1 to 5' ae-deep $a
refuses '9 layers of the autoencoder: roln has 8 at most' ae-layers $a
refuses 'lagrangianNN.ae.layers.0.bias is not autoencoder.layers.0.bias' ae-alias $a
refuses 'autoencoder.layers.1.weight has numbers that are not finite' ae-nan $a
refuses '1e+300 is too large for a float' ae-large $a
refuses 'no state_dict: names and tensors' ae-number $a
refuses 'is damaged: ' ae-cut $a
refuses 'exp_point is not positive definite' lnn-indefinite
refuses 'exp_point is not symmetric' lnn-askew
printf 'not a zip' > $dir/text.pt
refuses 'is no zip, as torch.save' text $a
check 'no file' sh -c "$import $dir/nothing.pt arm $a 2>&1 | grep 'cannot read .*nothing.pt'"
check 'no place' sh -c "$import $dir/ae.pt arm $a out=$dir/nowhere 2>&1 | grep 'cannot write arm.h: No such file'"
check 'usage' sh -c "$import $dir/ae.pt 2>&1 | grep '^import.py: usage: '"
check 'damaged checkpoints' $python tests/safety/fuzz_files.py import 1000
# bytes of roln 0.3, which had no scale.m, become those of today; whatever is damaged does not
$python - $dir/lnn/lnn.roln $dir/old.roln << 'END_OF_FILE'
import functools
import struct
import sys
with open(sys.argv[1], "rb") as f:
    data = f.read()
at = 8 + 2 * data[7] + 16
data = data[:4] + b"\2\0" + data[6:at] + data[at + 4:-8]
h = functools.reduce(lambda h, byte: (h ^ byte) * 0x100000001b3 % 2 ** 64, data, 0xcbf29ce484222325)
with open(sys.argv[2], "wb") as f:
    f.write(data + struct.pack("<Q", h))
END_OF_FILE
check 'format 2' $import $dir/old.roln $dir/new.roln
check 'format 2, the bytes' cmp $dir/new.roln $dir/lnn/lnn.roln
head -c 300 $dir/old.roln > $dir/cut.roln
rm -f $dir/new.roln
check 'format 2, cut' sh -c "$import $dir/cut.roln $dir/new.roln 2>&1 | grep 'cut.roln is damaged' && [ ! -e $dir/new.roln ]"
check 'format 3' sh -c "$import $dir/lnn/lnn.roln $dir/new.roln 2>&1 | grep 'lnn.roln is not of format 2' && [ ! -e $dir/new.roln ]"
check 'no .roln' sh -c "$import $dir/nothing.roln $dir/new.roln 2>&1 | grep 'cannot read .*nothing.roln'"
echo "$passed passed, $failed failed"
[ $failed -eq 0 ]
