# SPDX-License-Identifier: MIT
# roln. A C compiler is enough for      make demo, swelling, ekf, furuta, mpc, arm, belt, lint, real, hour, install,
#                                       clean; api wants python3, dist zip
# make deps installs what these need:   make test, check, record, learn, errors, control, plans, alarms, robust, rope, models,
#                                       noise, next, heads, doubt, eig, bench; with plotting-deps experiments, report
# make release-deps installs the rest:  make release, hash, sanitize, mutants, fuzz, proof, numerics, upsets, soundness, machines,
#                                       sizes, count, firmware, pil

CC = cc
PREFIX = /usr/local
DESTDIR =
JOBS ?= $(shell nproc 2> /dev/null || echo 1)
HEADERS = roln.h roln_ae.h roln_lnn.h roln_riem.h roln_spd.h
VERSION = $(shell sed -n 's/^.define ROLN_VERSION "\(.*\)"/\1/p' roln_spd.h)
NUMBERS = $(firstword $(subst -, ,$(VERSION)))

# Strict IEEE arithmetic: no -ffast-math anywhere; contraction off, so that every machine computes the same bits.
STD = -std=c99 -D_POSIX_C_SOURCE=200809L -ffp-contract=off -I. -Iexamples
FAST = -O3 -march=native -fno-math-errno
WARN = -Wall -Wextra -Wpedantic -Wconversion -Wdouble-promotion -Wshadow -Wundef -Wcast-qual -Wvla -Wstrict-prototypes \
       -Wmissing-prototypes -Werror
# What a file includes, as a rule beside what is made of it; read at the end. Of several sources in a command: the last one.
DEPENDS = -MMD -MP -MF $@.d -MT $@

.PHONY: all demo swelling ekf furuta mpc arm belt lint api install dist clean deps release-deps test release check hash \
        sanitize mutants record learn real machines errors control plans alarms robust models noise next heads doubt rope \
        experiments rivals report plotting-deps plotting-test eig numerics bench scaling sizes count firmware hour pil upsets fuzz \
        proof soundness
all: demo

# ---- what a user does ----

demo: build/pendulum
	./build/pendulum build
swelling: build/swelling
	./build/swelling build/swelling.svg
ekf: build/ekf build/filter
	./build/ekf
	@echo
	./build/filter
furuta: build/furuta
	./build/furuta
mpc: build/mpc
	./build/mpc build/mpc.svg
arm: build/arm
	./build/arm

belt: build/belt
	./build/belt

# the weights and limits of belt.c anew, three minutes: a first training, then one on motion that the first model has smoothed
build/belt_weights.h: build/belt build/belt_train
	./build/belt record > build/belt.csv
	cd build && ./belt_train belt.csv torque=1 delay=auto steps=60 out=belt_first && \
	    ./belt_train belt.csv torque=1 delay=0.0053 smoother=belt_first.roln steps=150

# the weights of furuta.c and arm.c anew, from their recordings, to the bit; and of tests/control/rope.c. Its committed weights were
# trained when rows were bounded at 20 times their mean: 213 steps of today's trainer settle later (make rope: 1.92 s)
furuta_train = torque=1 start=random smooth=20 steps=150 force=0 inertia=9.765625e-4
arm_train = torque=1 start=random smooth=40 steps=200 force=0 inertia=1
rope_train = torque=1 start=random look=0.9 steps=213 force=0 inertia=1
build/%_weights.h: build/% build/%_train
	./build/$* record > build/$*.csv
	cd build && { ./$*_train $*.csv $($*_train) || { code=$$?; mv -f $*_weights.h $*_untrained.h; exit $$code; }; }
build/rope_train: STD += -Itests/control
build/%_train: examples/train.c
	@mkdir -p $(@D)
	$(CC) $(STD) $(FAST) $(DEPENDS) -DMODEL=$* $< -o $@ -lpthread -lm

# misspelt options of a config, which C takes in silence: make lint CONFIG=examples/arm.h
CONFIG =
lint:
	@sh examples/lint.sh $(CONFIG)

# plain prototypes of a model, a line of comment each, with python3: make api CONFIG=examples/arm.h
api:
	@python3 tests/user/api.py $(CONFIG)

build/%: examples/%.c
	@mkdir -p $(@D)
	$(CC) $(STD) $(FAST) $(DEPENDS) $< -o $@ -lm
build/regression: tests/user/regression.c
	@mkdir -p $(@D)
	$(CC) $(STD) $(FAST) $(DEPENDS) -Iexamples $< -o $@ -lm
build/filter: tests/control/filter.c
	@mkdir -p $(@D)
	$(CC) $(STD) $(FAST) $(DEPENDS) $< -o $@ -lm

# the headers, a pkg-config file and a CMake package, which all may read; they find each other, so that the tree may be moved
SHARE = share/pkgconfig/roln.pc share/cmake/roln/rolnConfig.cmake share/cmake/roln/rolnConfigVersion.cmake
install:
	umask 022 && to="$(DESTDIR)$(PREFIX)" && mkdir -p "$$to/include" "$$to/share/pkgconfig" "$$to/share/cmake/roln" && \
	    for f in $(HEADERS:%=include/%) $(SHARE); do rm -f "$$to/$$f" || exit 1; done && \
	    for f in $(HEADERS); do cat $$f > "$$to/include/$$f" || exit 1; done && \
	    for f in $(SHARE); do sed 's/@VERSION@/$(VERSION)/; s/@NUMBERS@/$(NUMBERS)/' .packaging/$$f > "$$to/$$f" || exit 1; done

# packages for PlatformIO, Arduino, Zephyr and ESP-IDF in build/dist, and a bill of materials (SBOM, SPDX 2.3) of them
dist:
	sh .packaging/dist.sh $(VERSION) $(HEADERS)

clean:
	rm -rf build

# ---- tests ----

# The Debian packages of make test, without what they recommend: 270 MB on a machine that has none of them. Then those of make
# release. If apt would remove other packages, both stop, unless told: make deps AGREE=yes
PACKAGES = gcc g++ clang clang-format make pkg-config zip libmujoco-dev libhdf5-dev python3 \
           gcc-arm-none-eabi libnewlib-arm-none-eabi qemu-system-arm
RELEASE_PACKAGES = clang-tidy cppcheck tcc cmake clang-19 llvm-19 libclang-rt-19-dev \
                   gcc-riscv64-unknown-elf picolibc-riscv64-unknown-elf qemu-system-misc \
                   gcc-aarch64-linux-gnu gcc-arm-linux-gnueabihf gcc-i686-linux-gnu gcc-powerpc64-linux-gnu gcc-riscv64-linux-gnu \
                   gcc-s390x-linux-gnu $(patsubst %,libc6-dev-%-cross,arm64 armhf i386 ppc64 riscv64 s390x) qemu-user \
                   frama-c-base gdb openmpi-bin libopenmpi-dev
AGREE = no
deps:
	@AGREE=$(AGREE) sh tests/deps.sh --no-install-recommends $(PACKAGES)
release-deps: deps
	@AGREE=$(AGREE) sh tests/deps.sh --install-recommends $(RELEASE_PACKAGES)

# What every change must pass. To repeat some of its steps: sh tests/run.sh NAME ..
test:
	+@$(MAKE) --no-print-directory -j$(JOBS) $(patsubst %,build/%,test_double test_address test_mujoco generate record convert \
	    h5_cases regression)
	@JOBS=$(JOBS) sh tests/run.sh test

# Everything; what no step starts must compile
PROGRAMS = test test_asan test_msan test_cov test_mujoco test_experiments generate record convert h5_cases \
           pil machines plans swing alarms robust rope hour threads interrupts regression $(FUZZ:build/%=%) \
           control bench scaling eig32 eig64 speed experiment $(ROWS:%=experiment_%) test_latent test_opinf
release:
	+@$(MAKE) --no-print-directory -j$(JOBS) $(PROGRAMS:%=build/%) firmware
	@JOBS=$(JOBS) sh tests/run.sh release

# figures of docs/soundness.md, from the logs of make release
soundness:
	sh tests/safety/soundness.sh -w

# The headers alone, in five minutes on two cores: of sweeps over millions of numbers a sample.
# Some files: build/test sample spd riem
check:
	+@$(MAKE) --no-print-directory -j$(JOBS) build/test
	./build/test sample

# the same bits from every compiler, level and target, a quarter of an hour on two cores; make test asks a part of them
hash:
	sh tests/compilers/hash.sh host
	sh tests/compilers/hash.sh targets

# float and double under address, undefined and memory sanitizers, without samples; make test has float alone, of sweeps a sample
sanitize: build/test_asan_both build/test_msan_both
	./build/test_asan_both
	./build/test_msan_both

# Small faults put into the headers one at a time, which the unit tests have to find (tests/safety/mutants.py): half a minute each.
# What is known from an earlier call is not done again; MUTANTS of 200 goes on where 100 ended.
MUTANTS = 100
SEED = 1
mutants:
	@python3 tests/safety/mutants.py $(MUTANTS) $(SEED)

# Objects: build/KIND/PATH.o from PATH.c
KIND_unit32 = gcc $(STD) -O2 $(WARN)
# compiled in a third of the time; at this level gcc warns of loops that it does not see through
KIND_unit64 = gcc $(STD) -Og $(WARN) -Wno-maybe-uninitialized -DROLN_DOUBLE
# gcc's, made in half the time of clang's, which the fuzzers have; with sanitizers on gcc warns falsely, so no WARN. Those of make
# test are of addresses alone, again in half of the time.
KIND_address32 = gcc $(STD) -Og -g1 -fsanitize=address
KIND_asan32 = $(KIND_address32),undefined,bounds-strict,float-cast-overflow -fno-sanitize-recover=all
KIND_asan64 = $(KIND_asan32) -DROLN_DOUBLE
KIND_msan32 = clang $(STD) -O1 -gline-tables-only $(WARN) -fsanitize=memory -fno-sanitize-recover=all
KIND_msan64 = $(KIND_msan32) -DROLN_DOUBLE
# One name for all files of a build, so that the counts of a function of the headers are one sum over them all.
COV = clang-19 $(STD) -O1 -fprofile-instr-generate -fcoverage-mapping -fcoverage-mcdc -Xclang -main-file-name -Xclang
KIND_cov32 = $(COV) float
KIND_cov64 = $(COV) double -DROLN_DOUBLE -DROLN_SIMD=0
KIND_host32 = gcc $(STD) $(FAST) $(WARN) $$(pkg-config --cflags hdf5 2> /dev/null | sed 's/-I/-isystem /g')
KIND_host64 = $(KIND_host32) -DROLN_DOUBLE
define kind
build/$(1)/%.o: %.c
	@mkdir -p $$(@D)
	$$(KIND_$(1)) $$(DEPENDS) -c $$< -o $$@
endef
$(foreach k,$(patsubst KIND_%,%,$(filter KIND_%,$(.VARIABLES))),$(eval $(call kind,$(k))))
.SECONDARY:

# Every file of unit tests, as float and as double, in one program. make test has double alone, and float alone under sanitizers,
# where some compare with themselves in double, which needs no address sanitizer.
TWICE = $(patsubst %,tests/unit/test_%,gradient rows)
UNIT = $(basename $(wildcard tests/unit/test_*.c))
part = $(UNIT:%=build/$(1)32/%.o) build/$(1)32/tests/unit/check.o
unit = $(call part,$(1)) $(UNIT:%=build/$(1)64/%.o) build/$(1)32/tests/unit/main.o
alone = $(call part,$(1)) $(TWICE:%=build/$(2)64/%.o) build/$(1)32/tests/unit/main_f32.o
build/test: $(call unit,unit)
build/test_double: $(UNIT:%=build/unit64/%.o) build/unit32/tests/unit/check.o build/unit32/tests/unit/main_f64.o
build/test_address: $(call alone,address,unit)
build/test_asan: $(call alone,asan,unit)
build/test_msan: $(call alone,msan,msan)
build/test_asan_both: $(call unit,asan)
build/test_msan_both: $(call unit,msan)
build/test_cov: $(call unit,cov)
$(foreach k,unit address asan msan,$(foreach a,f32 f64,build/$(k)32/tests/unit/main_$(a).o)): tests/unit/main.c
	@mkdir -p $(@D)
	$(KIND) $(DEPENDS) -DALONE=$(@F:main_%.o=%) -c $< -o $@
build/test build/test_double: KIND = $(KIND_unit32)
build/test_address: KIND = $(KIND_address32)
build/test_asan build/test_asan_both: KIND = $(KIND_asan32)
build/test_msan build/test_msan_both: KIND = $(KIND_msan32)
build/test_cov: KIND = $(KIND_cov32)
build/test $(patsubst %,build/test_%,double address asan msan asan_both msan_both cov):
	$(KIND) $^ -o $@ -lm

# threads under their sanitizer; interrupts
build/threads: KIND = clang $(STD) -Itests $(WARN) -O1 -g -fsanitize=thread
build/interrupts: KIND = gcc $(STD) -Itests $(WARN) -O2
build/threads build/interrupts: build/%: tests/safety/%.c tests/unit/check.c
	@mkdir -p $(@D)
	$(KIND) $(DEPENDS) tests/unit/check.c $< -o $@ -lpthread -lm

# Targets of libFuzzer: build/fuzz/KIND/fuzz_TARGET. Kinds: address and undefined, of the scalar kernels that firmware has, vectors
# being in the unit tests; memory; none and at full speed; float or double
FUZZED = clang $(STD) -Ibuild/firmware $(WARN) -gline-tables-only -fno-sanitize-coverage=trace-cmp
FUZZ_au = $(FUZZED) -DROLN_SIMD=0 -O1 -fno-inline -fsanitize=fuzzer,address,undefined,float-cast-overflow -fno-sanitize-recover=all
FUZZ_m = $(FUZZED) -O1 -fno-inline -fsanitize=fuzzer,memory
FUZZ_none = $(FUZZED) -O2 -fsanitize=fuzzer
FUZZ_audouble = $(FUZZ_au) -DROLN_DOUBLE
fuzz = $(foreach k,$(1),$(patsubst %,build/fuzz/$(k)/fuzz_%,$(2)))
FUZZ = $(call fuzz,au m,packed frames csv calls)
define fuzzed
build/fuzz/$(1)/fuzz_%: tests/safety/fuzz_%.c
	@mkdir -p $$(@D)
	$$(FUZZ_$(1)) $$(DEPENDS) $$< -o $$@ -lm
endef
$(foreach k,$(patsubst FUZZ_%,%,$(filter FUZZ_%,$(.VARIABLES))),$(eval $(call fuzzed,$(k))))
$(patsubst %,build/fuzz/%/fuzz_frames,au m none): build/firmware/pend16_weights.h

# random inputs and calls, SECONDS for each target and kind (RUNS="none/csv none/calls": these), JOBS at a time; a table of all
# that was run so far; then, as long each, files that Python and the HDF5 library read
fuzz: build/convert build/h5_cases $(FUZZ) $(call fuzz,none,packed frames csv calls) $(call fuzz,audouble,packed calls)
	@JOBS=$(JOBS) sh tests/safety/fuzz.sh $(SECONDS) $(RUNS)
	@python3 tests/safety/fuzz_files.py $(SECONDS)

# Frama-C Eva, for all bits that may come in: nothing undefined, torques within their limits (tests/safety/proof); five minutes
proof:
	@sh tests/safety/proof/proof.sh all

# ---- with MuJoCo ----

# programs and their parts, PATH of tests/PATH.c
host = $(patsubst %,build/host32/tests/%.o,$(1))
PARTS = $(patsubst %,experiments/%,motion measure model newton train mechanics latent baseline opinf fit solve recipes) mujoco/truth
# a model of an experiment: row NAME of configs.h
ROWS = $(shell sed -n 's/^.define ROW_\([a-z][a-z0-9_]*\) .*/\1/p' tests/experiments/configs.h)
row = $(patsubst %,build/host32/tests/experiments/config/%.o,$(1))
$(call row,$(ROWS)): build/host32/tests/experiments/config/%.o: tests/experiments/config.c
	@mkdir -p $(@D)
	$(KIND_host32) $(DEPENDS) -DCONFIG=$* -c $< -o $@
build/test_mujoco: $(call host,mujoco/main $(patsubst %,mujoco/test_%,truth models control friction furuta arm load) \
                     control/control mujoco/truth mujoco/h5 unit/check)
build/generate: $(call host,mujoco/generate mujoco/truth mujoco/h5 mujoco/demos)
build/record: $(call host,mujoco/record mujoco/config mujoco/demos mujoco/newer)
build/convert: $(call host,mujoco/convert mujoco/demos)
build/h5_cases: $(call host,mujoco/h5_cases)
build/control: $(call host,control/closed_loop control/control mujoco/truth)
build/rope: $(call host,control/rope control/rope_plant unit/check) build/host64/tests/control/rope_best.o
build/pil: $(call host,control/pil control/image control/control mujoco/truth unit/check)
build/machines: $(call host,control/machines control/image unit/check)
build/plans: $(call host,control/plans control/control mujoco/truth unit/check) build/host64/tests/control/offline.o
build/swing: $(call host,control/swing unit/check)
build/alarms: $(call host,control/alarms unit/check)
build/robust: $(call host,control/robust unit/check)
build/experiment $(ROWS:%=build/experiment_%): $(call host,experiments/experiment $(PARTS))
$(ROWS:%=build/experiment_%): build/experiment_%: build/host32/tests/experiments/config/%.o
SPEED = pend2 chart16_d4 layered16 chart16_d6 chart16_d8 rope_n10_d3 cloth_n10_d3 cloth_free_n10
build/speed: $(call host,experiments/speed $(PARTS)) $(call row,$(SPEED))
HEADLINE = pend2 chart16_d4 chart16_d6 layered16 rope_n10_d3 cloth_n10_d3 cloth_free_n10 cloth_free_layers cloth_free_half \
           cloth_free_int8
build/test_experiments: $(call host,experiments/test_experiments $(PARTS) unit/check) \
                        $(call row,$(filter test%,$(ROWS)) $(HEADLINE))
build/test_opinf: $(call host,experiments/test_opinf experiments/opinf experiments/solve unit/check)
build/test_latent: $(call host,experiments/test_latent unit/check) build/host64/tests/experiments/test_latent.o
build/bench: $(call host,measure/bench)
$(patsubst %,build/%,test_mujoco generate record convert h5_cases control rope pil machines plans swing alarms robust experiment \
                     speed $(ROWS:%=experiment_%) test_experiments test_opinf test_latent bench):
	gcc $(filter %.o,$^) -o $@ -Wl,--as-needed -lmujoco $$(pkg-config --libs hdf5) -lm

# a MuJoCo model of your own, moved at random: recordings and a config; then trained, with a table of errors and a verdict.
# make record MODEL=my.xml; make learn MODEL=my.xml [OUT=build/learn/my] [SECONDS=300, of all] [SPEED=0.5] [EFFORT=0.5]
# [WITH="train=40 seconds=2"]. Without OUT= the name is that of the model, as a name in C, and with _2 if another model has it.
MODEL =
OUT = build/learn/$(basename $(notdir $(MODEL)))
SECONDS = 300
SPEED =
EFFORT =
WITH =
NAMED = out=$$(./build/record --name "$(OUT)" $(if $(filter file,$(origin OUT)),"$(MODEL)"))
MOVED = $(SPEED:%=speed=%) $(EFFORT:%=effort=%) $(WITH)
record: build/record
	@test $(words $(MODEL)) -eq 1 || { echo "make record MODEL=my.xml, a path without blanks"; exit 1; }
	@mkdir -p $(dir $(OUT))
	@$(NAMED) && ./build/record $(MODEL) "$$out" $(MOVED)
learn: build/record
	@test $(words $(MODEL)) -eq 1 || { echo "make learn MODEL=my.xml, a path without blanks"; exit 1; }
	@$(NAMED) && sh tests/mujoco/learn.sh $(MODEL) "$$out" seconds=$(SECONDS) $(MOVED)

# public recordings of real robots, DATA/double_pendulum and DATA/ur10e, which are not part of this repository: docs/training.md
# says where they are. Trains a model of each, SECONDS at most, and prints a table
DATA =
real:
	@test -n "$(DATA)" || { echo "make real DATA=folder: docs/training.md, \"Real recordings\""; exit 1; }
	@sh tests/user/real.sh $(DATA) $(SECONDS)

# the same of 19 small machines, and their errors in a table: STEPS of each training at most, so that it is the same everywhere;
# WITH="train=25 next=25": 25 recordings of each, and 25 more that a first model chooses
STEPS = 300
MACHINES = $(basename $(notdir $(wildcard tests/mujoco/machines/*.xml)))
machines: build/record
	-@for m in $(MACHINES); do \
	    echo "$$m" && sh tests/mujoco/learn.sh tests/mujoco/machines/$$m.xml build/learn/$$m steps=$(STEPS) $(WITH); done
	@sh tests/mujoco/learn.sh table $(MACHINES:%=build/learn/%) | tee build/learn/table.md

# error tables of the committed models, on recordings that no model has seen
errors: build/test_mujoco build/test_experiments
	./build/test_mujoco
	./build/test_experiments

# closed loops around MuJoCo's chain: table and build/control.svg, a minute and a half
control: build/control
	./build/control build/control.svg

# plans of the chain with four motors: against PD+, without limits, and the best that there is;
# and a hundred swing-ups; five minutes
plans: build/plans build/swing
	./build/plans
	./build/swing

# a guard whose limit comes from a rate of false alarms: the rate while machines change, and what faults take to be found; minutes
alarms: build/alarms
	./build/alarms

# soft limits of joints, and a wall before the tip, on machines that are 20 % off: limits tightened and not; four minutes
robust: build/robust
	./build/robust

# a rope on a trolley: plans on its learned model, PD and the time-optimal solution on the true one: table and build/rope.svg
rope: build/rope
	./build/rope build/rope.svg

# train the committed models again (an hour on two cores)
models: build/generate
	sh tests/mujoco/models/train.sh

# what sensor noise costs: trains four models, a minute each
noise: build/generate
	sh tests/experiments/noise.sh

# M and V as networks and as polynomials: 30 models, an hour and a quarter of a core; two at a time with JOBS=2
heads: build/generate
	@JOBS=$(JOBS) sh tests/experiments/heads.sh

# whether the deviations of NAME_doubt hold on recordings that were not trained with, and in a region that was left out, and those
# of a covariance of the last layers: 12 models, twenty minutes of a core; two at a time with JOBS=2
doubt: build/generate build/record
	@JOBS=$(JOBS) sh tests/experiments/doubt.sh

# whether it pays to choose what to record next: 15 models, an hour and a quarter of a core; two at a time with JOBS=2
next: build/generate
	@JOBS=$(JOBS) sh tests/experiments/next.sh $(SECONDS)

# the paper's experiments, and the tests of the rivals in them: trains what has no result in EXPERIMENTS yet, each run on one core
# (make -j2 experiments: two at a time), by a program for each of the models. tests/experiments/results.txt keeps what the runs say,
# RESULTS.md is written from it. One run: make experiments RUN=pend16-ro-1
EXPERIMENTS = build/experiments
RUN =
experiments: $(EXPERIMENTS)/runs.list $(if $(RUN),,build/speed rivals plotting-test)
	@./build/experiment configs > $(EXPERIMENTS)/runs.configs
	@awk -v d=$(EXPERIMENTS)/ '{ t = t " " d $$1 ".txt"; program = "./build/experiment" ($$2 == "-" ? "" : "_" $$2); \
	    print d $$1 ".txt:"; \
	    print "\t" program " run " $$1 " $(EXPERIMENTS) > " d $$1 ".log" } \
	    END { print "all:" t }' $(EXPERIMENTS)/runs.configs > $(EXPERIMENTS)/runs.mk
	+@$(MAKE) --no-print-directory build/experiment $$(awk -v d=$(EXPERIMENTS)/ -v run=$(RUN) '$$2 != "-" && \
	    (run == "" || run == $$1) && (getline line < (d $$1 ".txt")) < 1 { print "build/experiment_" $$2 }' \
	    $(EXPERIMENTS)/runs.configs | sort -u)
	+$(if $(RUN),,-)$(MAKE) -k -f $(EXPERIMENTS)/runs.mk $(if $(RUN),$(EXPERIMENTS)/$(RUN).txt,all)
	$(if $(RUN),@cat $(EXPERIMENTS)/$(RUN).txt)
	$(if $(RUN),,./build/speed $(EXPERIMENTS) > $(EXPERIMENTS)/speed.part && mv $(EXPERIMENTS)/speed.part $(EXPERIMENTS)/speed.txt)
	$(if $(RUN),,$(PLOTTING) tests/experiments/report.py $(EXPERIMENTS) tests/experiments)
	$(if $(RUN),,@! grep '^Missing' tests/experiments/RESULTS.md)

$(EXPERIMENTS)/runs.list: build/experiment
	@mkdir -p $(@D)
	@./$< list > $@

# other models of the same motion: latent models without structure or with another one, operator inference
rivals: build/test_latent build/test_opinf
	./build/test_latent
	./build/test_opinf

# tables and pictures again, of the results that are there; Python 3.8 or later with matplotlib, which only they need
PLOTTING = /usr/bin/python3
report: $(EXPERIMENTS)/runs.list
	$(PLOTTING) tests/experiments/report.py $(EXPERIMENTS) tests/experiments
plotting-deps:
	@sudo=; [ "$$(id -u)" = 0 ] || sudo=sudo; \
	$$sudo apt-get update -q && \
	$$sudo env DEBIAN_FRONTEND=noninteractive apt-get install -y -q --no-install-recommends python3-matplotlib
plotting-test:
	$(PLOTTING) tests/experiments/test_report.py

# ---- measurements ----

# the eigensolver on a million matrices, float and double
EIG = $(basename $(wildcard tests/*/eig_million.c))
eig: build/eig32 build/eig64
	./build/eig32
	./build/eig64
build/eig32 build/eig64: build/eig%: build/host%/$(EIG).o build/host32/tests/unit/check.o
	gcc $^ -o $@ -lm

# errors of arithmetic: all floats, a million matrices; of torques, which are compared with the table of docs/accuracy.md; minutes
numerics:
	sh tests/safety/numerics.sh

# times on this machine
bench: build/bench
	./build/bench

# times of a step of training on 1 to 1,024 processes, from times on this machine and sizes of messages; a minute
scaling: build/scaling
	./build/scaling
build/scaling: tests/measure/scaling.c
	@mkdir -p $(@D)
	$(CC) $(STD) $(FAST) $(WARN) $(DEPENDS) $< -o $@ -lm

# flash, RAM, stack and instructions of three models on five cores, and of plans, compared with the tables of the texts
sizes:
	sh tests/measure/sizes.sh
	sh tests/measure/plan.sh

# instructions of the kernels and of a control tick on a Cortex-M4F, against targets
count:
	sh tests/measure/count.sh

# ---- firmware ----

# images for every core, and for the host, in build/firmware/CORE/. Any C file of this repository becomes an image:
# make build/firmware/m4/tests/compilers/hash.elf; sh examples/firmware/run.sh m4 build/firmware/m4/tests/compilers/hash.elf
CORES = m4 m7 m33 m55 rv32 host
IMAGES = $(patsubst %,examples/firmware/%.elf,predict three control chart adapt plan serial furuta arm)
firmware: $(foreach c,$(CORES),$(IMAGES:%=build/firmware/$(c)/%))
define image
build/firmware/$(1)/%.elf: %.c $(wildcard examples/firmware/*)
	@mkdir -p $$(@D)
	sh examples/firmware/cc.sh $(1) $(WARN) -Ibuild/firmware $$(DEPENDS) $$< -o $$@
endef
$(foreach c,$(CORES),$(eval $(call image,$(c))))
$(CORES:%=build/firmware/%/examples/firmware/serial.elf): build/firmware/pend16_weights.h
build/firmware/pend16_weights.h: build/firmware/weights tests/mujoco/models/pend16_act.roln
	./$< < $(word 2,$^) > $@ || { rm $@; exit 1; }
build/firmware/weights: tests/measure/weights.c
	@mkdir -p $(@D)
	$(CC) $(STD) -O1 -DMODEL=pend16 $(DEPENDS) $< -o $@ -lm

# single-event upsets: 100,000 bits flip in a closed loop in QEMU, one in each run; a quarter of an hour on two busy cores
upsets:
	JOBS=$(JOBS) sh tests/firmware/upsets.sh

# an hour of adapt.c: payloads, bad data and power cuts; a minute
hour: build/hour
	./build/hour
build/hour: tests/firmware/hour.c examples/firmware/host.c
	@mkdir -p $(@D)
	$(CC) $(STD) -Iexamples/firmware $(FAST) $(WARN) $(DEPENDS) examples/firmware/host.c $< -o $@ -lm

# processor in the loop: MuJoCo's chain here, its controller in QEMU, a minute or two for every core; other machines; 1,000 plans
PIL = m4 m7 rv32
pil: build/pil build/machines
	./build/pil $(PIL)
	./build/machines $(PIL)
	sh tests/measure/plan.sh $(PIL)
build/pil: $(patsubst %,build/firmware/%/examples/firmware/serial.elf,$(PIL) host)
build/machines: $(foreach i,furuta arm,$(patsubst %,build/firmware/%/examples/firmware/$(i).elf,$(PIL) host))

-include $(shell find build -name '*.d' 2> /dev/null)
