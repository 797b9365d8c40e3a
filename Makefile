# roln: make demo, make ekf, make swelling (C compiler only), make deps test, make errors, make control, make bench, make models,
#       make noise, make experiments, make report, make firmware, make pil, make sizes, make count, make install,
#       make dist, make clean

CC = cc
PREFIX = /usr/local
DESTDIR =
HEADERS = roln.h roln_ae.h roln_lnn.h roln_riem.h roln_spd.h

# strict IEEE arithmetic: no -ffast-math anywhere; contraction off, so that every machine computes the same bits
FAST = -std=c99 -D_POSIX_C_SOURCE=200809L -O3 -march=native -fno-math-errno -ffp-contract=off -I. -Iexamples
WARN = -Wall -Wextra -Wpedantic -Wconversion -Wdouble-promotion -Wshadow -Wundef -Wcast-qual -Wvla -Wstrict-prototypes \
       -Wmissing-prototypes -Werror
STRICT = -std=c99 -O2 -ffp-contract=off -I. $(WARN)
TESTS = elementary dense eig spd ae lnn riem roln control
MUJOCO = -D_POSIX_C_SOURCE=200809L $$(pkg-config --cflags hdf5 | sed 's/-I/-isystem /g')
MUJOCO_LIBS = -lmujoco $$(pkg-config --libs hdf5) -lm
TRUTH = tests/mujoco/truth.c tests/mujoco/h5.c

.PHONY: all demo ekf swelling deps test errors control models noise experiments bench firmware pil install dist clean
all: demo

# ---- what a user does ----

demo: build/pendulum
	./build/pendulum build

build/pendulum: examples/pendulum.c $(HEADERS) examples/chain.h examples/chain_plant.h | build
	$(CC) $(FAST) examples/pendulum.c -o $@ -lm

swelling: build/swelling
	./build/swelling build/swelling.svg

build/swelling: examples/swelling.c roln_spd.h | build
	$(CC) $(FAST) examples/swelling.c -o $@ -lm

ekf: build/ekf
	./build/ekf

build/ekf: examples/ekf.c $(HEADERS) examples/chain.h examples/chain_plant.h examples/chain_weights.h | build
	$(CC) $(FAST) examples/ekf.c -o $@ -lm

build:
	mkdir -p build/log

# the headers, a pkg-config file and a CMake package; they find each other, so that the tree may be moved
VERSION = $(shell sed -n 's/^.define ROLN_VERSION "\(.*\)"/\1/p' roln_spd.h)
SHARE = share/pkgconfig/roln.pc share/cmake/roln/rolnConfig.cmake share/cmake/roln/rolnConfigVersion.cmake
install:
	mkdir -p "$(DESTDIR)$(PREFIX)/include" "$(DESTDIR)$(PREFIX)/share/pkgconfig" "$(DESTDIR)$(PREFIX)/share/cmake/roln"
	cp $(HEADERS) "$(DESTDIR)$(PREFIX)/include"
	for f in $(SHARE); do sed 's/@VERSION@/$(VERSION)/' tests/packaging/$$f > "$(DESTDIR)$(PREFIX)/$$f" || exit 1; done

# packages for PlatformIO, Arduino, Zephyr and ESP-IDF in build/dist
dist:
	sh tests/packaging/dist.sh $(VERSION) $(HEADERS)

clean:
	rm -rf build

# ---- tests ----

# the sanitizers of clang are a package with clang's version in its name, or, on other systems, part of clang
PACKAGES = gcc g++ clang make pkg-config cmake zip libmujoco-dev libhdf5-dev \
           gcc-arm-none-eabi libnewlib-arm-none-eabi gcc-riscv64-unknown-elf picolibc-riscv64-unknown-elf \
           qemu-system-arm qemu-system-misc \
           gcc-aarch64-linux-gnu gcc-arm-linux-gnueabihf gcc-i686-linux-gnu gcc-powerpc64-linux-gnu gcc-riscv64-linux-gnu \
           gcc-s390x-linux-gnu $(patsubst %,libc6-dev-%-cross,arm64 armhf i386 ppc64 riscv64 s390x) qemu-user
deps: | build
	@get() { sudo=; [ "$$(id -u)" = 0 ] || sudo=sudo; \
	    $$sudo apt-get update -q && $$sudo env DEBIAN_FRONTEND=noninteractive apt-get install -y -q "$$@"; }; \
	set --; for p in $(PACKAGES); do dpkg-query -W -f='$${Status}' $$p 2> /dev/null | grep -q 'ok installed' || set -- "$$@" $$p; done; \
	if [ $$# -gt 0 ]; then get "$$@" || exit 1; fi; \
	echo 'int main(void) { return 0; }' > build/deps.c; \
	clang -fsanitize=memory build/deps.c -o build/deps > /dev/null 2>&1 || \
	    get libclang-rt-$$(clang -dumpversion | cut -d. -f1)-dev

test: build/test build/test_asan build/test_msan build/test_mujoco build/generate build/test_latent build/test_opinf build/test_experiments build/pil
	sh tests/run.sh

build/f32_%.o: tests/test_%.c tests/check.h tests/twin.h tests/small.h $(HEADERS) | build
	gcc $(STRICT) -c $< -o $@
build/f64_%.o: tests/test_%.c tests/check.h tests/twin.h tests/small.h $(HEADERS) | build
	gcc $(STRICT) -DROLN_DOUBLE -c $< -o $@
build/test: $(TESTS:%=build/f32_%.o) $(TESTS:%=build/f64_%.o) tests/main.c tests/check.c
	gcc $(STRICT) $^ -o $@ -lm

ASAN = clang $(STRICT) -O1 -g -fsanitize=address,undefined -fno-sanitize-recover=all
MSAN = clang $(STRICT) -O1 -g -fsanitize=memory
build/asan_f32_%.o: tests/test_%.c tests/check.h tests/twin.h tests/small.h $(HEADERS) | build
	$(ASAN) -c $< -o $@
build/asan_f64_%.o: tests/test_%.c tests/check.h tests/twin.h tests/small.h $(HEADERS) | build
	$(ASAN) -DROLN_DOUBLE -c $< -o $@
build/test_asan: $(TESTS:%=build/asan_f32_%.o) $(TESTS:%=build/asan_f64_%.o) tests/main.c tests/check.c
	$(ASAN) $^ -o $@ -lm
build/msan_f32_%.o: tests/test_%.c tests/check.h tests/twin.h tests/small.h $(HEADERS) | build
	$(MSAN) -c $< -o $@
build/msan_f64_%.o: tests/test_%.c tests/check.h tests/twin.h tests/small.h $(HEADERS) | build
	$(MSAN) -DROLN_DOUBLE -c $< -o $@
build/test_msan: $(TESTS:%=build/msan_f32_%.o) $(TESTS:%=build/msan_f64_%.o) tests/main.c tests/check.c
	$(MSAN) $^ -o $@ -lm

build/test_mujoco: tests/mujoco/main.c tests/mujoco/test_truth.c tests/mujoco/test_models.c tests/mujoco/test_control.c \
                   tests/mujoco/control.c $(TRUTH) tests/check.c tests/mujoco/control.h tests/mujoco/truth.h tests/mujoco/h5.h \
                   tests/check.h examples/pend16.h examples/pend16_int8.h $(HEADERS) | build
	gcc $(STRICT) -O3 -march=native -fno-math-errno $(MUJOCO) $(filter %.c,$^) -o $@ $(MUJOCO_LIBS)

build/test_opinf: tests/experiments/test_opinf.c tests/experiments/opinf.c tests/experiments/solve.c tests/check.c \
                  tests/experiments/experiment.h tests/experiments/solve.h tests/mujoco/truth.h tests/check.h \
                  $(HEADERS) | build
	gcc $(STRICT) -O3 -march=native -fno-math-errno $(filter %.c,$^) -o $@ -lm

# the models that the experiments compare with; no MuJoCo: experiment.h needs but the declarations of truth.h
LATENT = gcc $(STRICT) -O3 -march=native -fno-math-errno
LATENT_DEPS = tests/experiments/test_latent.c tests/experiments/latent.c tests/experiments/experiment.h tests/mujoco/truth.h \
              tests/check.h $(HEADERS)
build/latent_f32.o: $(LATENT_DEPS) | build
	$(LATENT) -c $< -o $@
build/latent_f64.o: $(LATENT_DEPS) | build
	$(LATENT) -DROLN_DOUBLE -c $< -o $@
build/test_latent: build/latent_f32.o build/latent_f64.o tests/check.c
	$(LATENT) $^ -o $@ -lm

build/generate: tests/mujoco/generate.c $(TRUTH) tests/mujoco/truth.h tests/mujoco/h5.h | build
	gcc $(STRICT) $(MUJOCO) $(filter %.c,$^) -o $@ $(MUJOCO_LIBS)

# error tables of the committed models, on fresh trajectories
errors: build/test_mujoco build/test_experiments
	./build/test_mujoco
	./build/test_experiments

# closed loops around MuJoCo's chain: table and build/control.svg, a minute and a half
control: build/control
	./build/control build/control.svg
build/control: tests/mujoco/closed_loop.c tests/mujoco/control.c tests/mujoco/truth.c tests/mujoco/control.h tests/mujoco/truth.h \
               examples/pend16.h $(HEADERS) | build
	gcc $(STRICT) -O3 -march=native -fno-math-errno -D_POSIX_C_SOURCE=200809L $(filter %.c,$^) -o $@ -lmujoco -lm

# train the committed models again (two hours)
models: build/generate
	sh tests/mujoco/models/train.sh

# what sensor noise costs: trains eleven models (45 minutes)
noise: build/generate
	sh tests/mujoco/noise.sh

# the paper's experiments: trains what has no result in EXPERIMENTS yet, each run on one core (make -j2 experiments: two at a
# time), and writes tests/experiments/RESULTS.md, without the runs that failed. One run: make experiments RUN=pend16-acc-1
EXPERIMENTS = build/experiments
RUN =
experiments: build/experiment $(if $(RUN),,build/speed)
	@mkdir -p $(EXPERIMENTS)
	@./build/experiment list > $(EXPERIMENTS)/runs.list
	@awk -v d=$(EXPERIMENTS) '{ t = t " " d "/" $$1 ".txt"; \
	    print d "/" $$1 ".txt:" ($$2 == "-" ? "" : " " d "/" $$2 ".txt") "\n\t./build/experiment run " $$1 " " d " > " d "/" $$1 ".log" } \
	    END { print "all:" t }' $(EXPERIMENTS)/runs.list > $(EXPERIMENTS)/runs.mk
	+$(if $(RUN),,-)$(MAKE) -k -f $(EXPERIMENTS)/runs.mk $(if $(RUN),$(EXPERIMENTS)/$(RUN).txt,all)
	$(if $(RUN),@cat $(EXPERIMENTS)/$(RUN).txt)
	$(if $(RUN),,./build/speed $(EXPERIMENTS) > $(EXPERIMENTS)/speed.part && mv $(EXPERIMENTS)/speed.part $(EXPERIMENTS)/speed.txt)
	$(if $(RUN),,$(PLOTTING) tests/experiments/report.py $(EXPERIMENTS) tests/experiments)
	$(if $(RUN),,@! grep '^Missing' tests/experiments/RESULTS.md)
PARTS = $(patsubst %,tests/experiments/%.c,motion measure model mechanics latent baseline opinf fit solve recipes) tests/mujoco/truth.c
PARTS_H = $(patsubst %,tests/experiments/%.h,experiment recipes solve) tests/mujoco/truth.h $(HEADERS)
build/experiment: tests/experiments/experiment.c $(PARTS) $(PARTS_H) | build
	gcc $(STRICT) -O3 -march=native -fno-math-errno -D_POSIX_C_SOURCE=200809L $(filter %.c,$^) -o $@ -lmujoco -lm

# MuJoCo against the reduced models
build/speed: tests/experiments/speed.c $(PARTS) $(PARTS_H) | build
	gcc $(STRICT) -O3 -march=native -fno-math-errno -D_POSIX_C_SOURCE=200809L $(filter %.c,$^) -o $@ -lmujoco -lm

build/test_experiments: tests/experiments/test_experiments.c $(PARTS) $(PARTS_H) tests/check.c tests/check.h | build
	gcc $(STRICT) -O3 -march=native -fno-math-errno -D_POSIX_C_SOURCE=200809L $(filter %.c,$^) -o $@ -lmujoco -lm

# tables and pictures of the results that are there; Python 3.8 or later with matplotlib, which nothing else here needs
.PHONY: report plotting-deps plotting-test
PLOTTING = /usr/bin/python3
report:
	$(PLOTTING) tests/experiments/report.py $(EXPERIMENTS) tests/experiments
plotting-deps:
	@sudo=; [ "$$(id -u)" = 0 ] || sudo=sudo; \
	$$sudo apt-get update -q && $$sudo env DEBIAN_FRONTEND=noninteractive apt-get install -y -q --no-install-recommends python3-matplotlib
plotting-test:
	$(PLOTTING) tests/experiments/test_report.py

bench: build/bench
	./build/bench
build/bench: tests/bench/bench.c $(HEADERS) | build
	gcc $(FAST) $< -o $@ -lmujoco -lm

# ---- firmware ----

# images for every core, and for the host, in build/firmware/CORE/. Any C file of this repository becomes an image:
# make build/firmware/m4/tests/hash.elf; sh examples/firmware/run.sh m4 build/firmware/m4/tests/hash.elf
FIRMWARE = $(patsubst %,examples/firmware/%.elf,predict three control adapt serial)
CORES = m4 m7 m33 m55 rv32 host
firmware: $(foreach c,$(CORES),$(FIRMWARE:%=build/firmware/$(c)/%))
define image
build/firmware/$(1)/%.elf: %.c $(HEADERS) $(wildcard examples/*.h examples/firmware/*)
	@mkdir -p $$(@D)
	sh examples/firmware/cc.sh $(1) $(WARN) -Ibuild/firmware $$< -o $$@
endef
$(foreach c,$(CORES),$(eval $(call image,$(c))))
$(CORES:%=build/firmware/%/examples/firmware/serial.elf): build/firmware/pend16_weights.h
build/firmware/pend16_weights.h: tests/sizes/weights.c tests/mujoco/models/pend16_act.roln tests/sizes/firmware.h examples/pend16.h $(HEADERS)
	@mkdir -p $(@D)
	$(CC) -std=c99 -O1 -ffp-contract=off -I. -Iexamples -DMODEL=pend16 $< -o build/firmware/weights -lm
	./build/firmware/weights < $(word 2,$^) > $@ || { rm $@; exit 1; }

# processor in the loop: MuJoCo's chain here, its controller in QEMU; a minute or two for every core
PIL = m4 m7 rv32
pil: build/pil
	./build/pil $(PIL)
build/pil: tests/mujoco/pil.c tests/mujoco/control.c tests/mujoco/truth.c tests/check.c tests/mujoco/control.h \
           tests/mujoco/truth.h tests/check.h examples/firmware/frame.h examples/pend16.h $(HEADERS) \
           $(patsubst %,build/firmware/%/examples/firmware/serial.elf,$(PIL) host)
	gcc $(STRICT) -O3 -march=native -fno-math-errno -D_POSIX_C_SOURCE=200809L $(filter %.c,$^) -o $@ -lmujoco -lm

# flash, RAM, stack and instructions of three models on five cores, compared with the tables of README.md
.PHONY: sizes
sizes:
	sh tests/sizes/sizes.sh

# instructions of the kernels and of a control tick on a Cortex-M4F, against targets
.PHONY: count
count:
	sh tests/bench/count.sh
