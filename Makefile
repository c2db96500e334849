# farm: one picture, ray-traced by as many processors as you have.
#
#   make deps run    install what is missing, build, render the lantern on all cores
#   make deps test   install what is missing, then all tests
#   make             build ./farm and the generated parts of the sample scenes (make scenes)
#   make install     program, manual pages and scenes; PREFIX=/usr/local DESTDIR=
#   make uninstall   remove what make install with the same PREFIX and DESTDIR has put there
#   make clean       remove what was built, but for bench/out/
#   make asan        all tests under the address and undefined-behaviour sanitizers
#   make valgrind    whole runs on one to three processes under valgrind
#   make tsan        the same under the thread sanitizer
#   make fuzz        every parser and validator against hostile input, FUZZ_SECONDS=30 each
#                    (make fuzz-deps installs what it needs)
#   make lint        clang's warnings, clang-tidy and cppcheck, as .clang-tidy and .cppcheck say
#   make format      clang-format over all sources
#   make help        this text
#   make bench       all of these, one after the other, some four hours; reports, tables and plots to bench/out/:
#   make bench-kernel      the kernel beside Embree, Tachyon and POV-Ray (which make bench-deps installs)
#   make bench-omit        what is saved by leaving out what a scene does not need
#   make bench-balance     how evenly the work is shared out, in real runs and simulated on machines
#                          that are not here
#   make bench-error       error against run time: uniform, adaptive, depth, cutoff, peers
#   make bench-error-truncation   what pruned pictures claim to be wrong by, and are
#   make bench-stability   the catalogue of stiff and extreme cases at full size, 1e9 rays through
#                          closed meshes among them
#   make bench-faults      kill -9, SIGSTOP, torn journals, full and slow disks, hundreds of times

VERSION := 0.1.0
.DEFAULT_GOAL := all

# Make runs as many jobs as there are processors, unless it is told a number. Several goals are made one after the
# other, so that goals that clean or measure have the machine to themselves.
ifneq ($(word 2,$(filter-out deps bench-deps,$(MAKECMDGOALS))),)
.NOTPARALLEL:
else ifeq ($(MAKELEVEL),0)
MAKEFLAGS += -j$(shell nproc)
endif

# Packages that a fresh Debian or Ubuntu lacks; those from cmocka on are for the tests (pgrep, ip).
PACKAGES := gcc binutils libc6-dev mpich libmpich-dev libinih-dev libstb-dev zlib1g-dev \
            libcmocka-dev libgmp-dev libmpfr-dev procps iproute2

# Further packages for the benches that compare the farm with other programs.
BENCH_PACKAGES := tachyon-bin-nox povray libembree-dev gnuplot-nox
BESIDE_PEERS   := bench bench-kernel bench-error

# Shell commands that install the missing ones of these packages.
install_missing = missing=""; for p in $(1); do \
	    dpkg-query -W -f='$${Status}' $$p 2>/dev/null | grep -q '^install ok installed' \
	        || missing="$$missing $$p"; done; \
	if [ -n "$$missing" ]; then \
	    if [ "$$(id -u)" = 0 ]; then root=""; else root=sudo; fi; \
	    echo "installing:$$missing"; \
	    $$root apt-get update -q && \
	    $$root env DEBIAN_FRONTEND=noninteractive apt-get install -q -y \
	        --no-install-recommends $$missing; \
	fi

deps:
	@$(call install_missing,$(PACKAGES))

bench-deps:
	@$(call install_missing,$(PACKAGES) $(BENCH_PACKAGES))

# How the rest is built depends on what is installed. So with `make deps run`, another make is started for the rest
# after the installation.
INSTALLED := $(filter deps bench-deps,$(MAKECMDGOALS))
ifndef INSTALLED_BEFORE
INSTALLED += $(if $(filter $(BESIDE_PEERS),$(MAKECMDGOALS)),bench-deps)
endif
AFTERWARDS := $(if $(strip $(INSTALLED)),$(filter-out $(INSTALLED),$(MAKECMDGOALS)))
.PHONY: deps bench-deps $(AFTERWARDS)
ifneq ($(strip $(INSTALLED)),)
.NOTPARALLEL:
endif
ifneq ($(AFTERWARDS),)
$(AFTERWARDS): $(INSTALLED)
	@$(MAKE) --no-print-directory INSTALLED_BEFORE=yes $@
else

# mpicc.mpich is MPICH's compiler if several MPIs are installed side by side.
MPICC   := $(firstword $(shell command -v mpicc.mpich mpicc) mpicc)
OBJCOPY ?= objcopy
MPIEXEC = $(firstword $(shell command -v mpiexec.hydra mpiexec) mpiexec)
PREFIX  ?= /usr/local

BUILD    := build
FARM     := farm
WARNINGS := -Wall -Wextra -Werror -Wshadow -Wconversion -Wdouble-promotion -Wundef \
            -Wmissing-prototypes -Wstrict-prototypes -Wcast-qual -Wvla -Wpointer-arith
# -ffp-contract=off: only operations that the source names as fused are fused, so that every compiler and optimisation
# level gives the same bits.
FLOAT    := -ffp-contract=off -fno-math-errno -fopenmp-simd
# -g1 is enough for backtraces and profiles; the rest of -g takes a third of the time to compile.
OPTIMISE ?= -O2 -g1
SANITIZE :=
FLAGS    := -std=c17 $(OPTIMISE) $(WARNINGS) $(FLOAT) -pthread -D_GNU_SOURCE -I. -MMD -MP \
            -DFARM_VERSION='"$(VERSION)"' $(SANITIZE)

# The compiler that MPICC calls, without MPICC: the wrapper script starts a process for each of its arguments, which
# takes a tenth of the build time. If MPICC is a plain compiler, which has no -show, it is called itself.
COMPILE  := $(or $(shell $(MPICC) -show -c 2>/dev/null),$(MPICC) -c)
LINK     := $(filter-out -c,$(COMPILE))
LIBS     := -linih -lz -lm $(filter -L% -l% -Wl%,$(shell $(MPICC) -show 2>/dev/null))

# `make V=1` shows complete commands.
quiet := $(if $(V),,@)
say   := $(if $(V),@:,@echo)

# Links a program from its prerequisites and these libraries.
define link
$(say)  link $@
$(quiet)$(LINK) $(FLAGS) $(CFLAGS) $(LDFLAGS) $(WRAPPED) $^ $(1) -o $@
endef

# The kernel's files are compiled for each level of processor, whose flags follow the others; not those whose work is
# done once for a scene or has no arithmetic: what these call of the kernel is the portable level's. The objects of a
# level are linked into one, of which only the kernel's table is visible. Tests of single functions are linked with the
# functions of the portable level, which are plain functions without SIMD.
KERNEL := $(filter-out $(addprefix worker/,bvh%.c box_lights.c collective.c kernel.c medium.c node.c node_scene.c \
    radiance_clusters.c receive.c segment.c send.c work.c),$(wildcard worker/*.c))
ALL_LEVELS := portable
ifneq ($(findstring x86_64,$(shell $(MPICC) -dumpmachine)),)
ALL_LEVELS += avx2 avx512
endif

# The levels that the program has. AVX-512 takes a quarter of the time to build, and is left out if this machine lacks
# it by /proc/cpuinfo; `make LEVELS="portable avx2 avx512"` builds for machines that have it.
LACKED := $(if $(wildcard /proc/cpuinfo),$(if $(shell grep -m1 avx512dq /proc/cpuinfo),,avx512))
LEVELS ?= $(filter-out $(LACKED),$(ALL_LEVELS))
FLAGS  += $(if $(filter avx512,$(LEVELS)),-DKERNEL_AVX512)
AVX2 := -mavx2 -mfma -mbmi -mbmi2 -mlzcnt -mpopcnt
FLAGS_avx2   := $(AVX2)
FLAGS_avx512 := $(AVX2) -mavx512f -mavx512vl -mavx512dq

# The kernel's functions that are called from outside: worker/kernel.c has functions of the same names, which choose the
# level.
ENTRIES := nearest nearest_rough occluded surface_at renderer_task
HIDE_portable := $(ENTRIES:%=--localize-symbol=%)
HIDE_avx2     := --keep-global-symbol=kernel_avx2
HIDE_avx512   := --keep-global-symbol=kernel_avx512

SOURCES := $(filter-out $(KERNEL),$(wildcard common/*.c master/*.c worker/*.c))
OBJECTS := $(SOURCES:%.c=$(BUILD)/%.o) $(LEVELS:%=$(BUILD)/kernel_%.o)
LIBRARY := $(filter-out $(BUILD)/master/main.o,$(OBJECTS))
MODELS  := $(patsubst %.c,$(BUILD)/%.o,$(wildcard config/models/*.c))
UNITS   := $(patsubst test/%.c,$(BUILD)/test/%,$(filter-out test/test_bundles.c,$(wildcard test/test_*.c)))

# If the processor supports AVX2, tests of the kernel's internals are also run at that level, linked with its single
# objects.
INSIDE := $(if $(shell grep -m1 avx2 /proc/cpuinfo 2>/dev/null),$(addprefix $(BUILD)/avx2/test/, \
    test_bundles test_duplicates test_float_slabs test_pinhole test_pinhole_bounds test_points \
    test_rough_triangles test_tree))
UNITS  += $(INSIDE)
INSIDE_KERNEL := $(patsubst %.c,$(BUILD)/avx2/%.o,$(filter-out worker/kernel_table.c,$(KERNEL)))
STABILITY := $(patsubst %.c,$(BUILD)/%.o,$(wildcard bench/oracle.c bench/scenes.c bench/stability_*.c \
    bench/pictures*.c test/reference*.c))

FUZZERS := $(patsubst test/fuzz/fuzz_%.c,%,$(wildcard test/fuzz/fuzz_*.c))

.PHONY: all run test asan valgrind tsan lint fuzz fuzz-deps bench bench-stability bench-kernel \
        bench-balance bench-error bench-error-truncation bench-faults bench-omit scenes install uninstall \
        clean format help FORCE
.SECONDARY:

# The scenes first: they are made by one process, while the rest is compiled.
all: scenes $(FARM)

$(FARM): $(OBJECTS)
	$(call link,$(LIBS))

# The compiler and its flags: if they have changed, everything is compiled again.
COMPILES := $(strip $(COMPILE) $(FLAGS) $(CFLAGS))
$(BUILD)/flags: $(if $(findstring |$(COMPILES)|,|$(file <$(BUILD)/flags)|),,FORCE)
	@command -v $(firstword $(MPICC)) >/dev/null || \
	    { echo "there is no $(firstword $(MPICC)): 'make deps' installs what the farm needs" >&2; exit 1; }
	@mkdir -p $(@D)
	@printf '%s\n' '$(subst ','\'',$(COMPILES))' >$@

$(BUILD)/%.o: %.c Makefile $(BUILD)/flags
	@mkdir -p $(@D)
	$(say)  compile $<
	$(quiet)$(COMPILE) $(FLAGS) $(CFLAGS) $< -o $@

CODE := $(sort $(wildcard common/*.[ch] master/*.[ch] worker/*.[ch]))

# The list of the sources: if one has been removed, the program is linked again.
$(BUILD)/sources: $(if $(findstring |$(CODE)|,|$(file <$(BUILD)/sources)|),,FORCE)
	@mkdir -p $(@D)
	@echo '$(CODE)' >$@

# The checksum of the sources, see common/build.h.
$(BUILD)/common/build.o: common/build.c $(CODE) Makefile $(BUILD)/flags $(BUILD)/sources
	@mkdir -p $(@D)
	$(say)  compile $<
	$(quiet)$(COMPILE) $(FLAGS) -DFARM_SOURCES="\"$$(cat $(CODE) | cksum | cut -d' ' -f1)\"" $(CFLAGS) $< -o $@

# Rules for $(BUILD)/avx2/worker/nearest.o and so on, and for $(BUILD)/kernel_avx2.o, which consists of them.
define level_rules
$(BUILD)/$(1)/%.o: %.c Makefile $(BUILD)/flags
	@mkdir -p $$(@D)
	$$(say)  compile $$< \($(1)\)
	$$(quiet)$$(COMPILE) $$(FLAGS) $$(CFLAGS) $$(FLAGS_$(1)) -DKERNEL_TABLE=kernel_$(1) $$< -o $$@

$(BUILD)/kernel_$(1).o: $(KERNEL:%.c=$(BUILD)/$(1)/%.o)
	$$(quiet)$$(LD) -r $$^ -o $$@
	$$(quiet)$$(OBJCOPY) $(HIDE_$(1)) $$@
endef
$(foreach level,$(ALL_LEVELS),$(eval $(call level_rules,$(level))))

# Loops over lanes: both sides of a selection may be computed, nobody looks at the traps. Where fma()
# is a call, Clang complains that it cannot use SIMD; the bits are the same without.
$(addprefix %/worker/,points.o points_light.o points_solids.o points_triangles.o radiance.o sample.o): \
    FLAGS += -fno-trapping-math -Wno-pass-failed

# A test of cmocka gets a state, which few tests use.
$(BUILD)/test/%.o $(BUILD)/avx2/test/%.o: FLAGS += -Wno-unused-parameter

# The large parts of the sample scenes are made by programs, not checked in.
scenes: config/generated/.made

config/generated/.made: $(BUILD)/models
	@mkdir -p $(@D)
	$(BUILD)/models $(@D)
	@touch $@

$(BUILD)/models: $(MODELS) $(BUILD)/common/message.o $(BUILD)/common/memory.o
	$(call link,-lm)

$(BUILD)/test/%: $(BUILD)/test/%.o $(LIBRARY) $(filter-out $(BUILD)/config/models/main.o,$(MODELS))
	$(call link,$(LIBS) -lcmocka $(ORACLE))

$(INSIDE): %: %.o $(INSIDE_KERNEL) $(filter-out $(BUILD)/kernel_%.o $(BUILD)/worker/kernel.o,$(LIBRARY))
	$(call link,$(LIBS) -lcmocka)

$(BUILD)/avx2/test/test_bundles: WRAPPED := -Wl,--wrap=nearest_bundle,--wrap=occluded_packet
$(BUILD)/test/test_cpu_time: WRAPPED := -Wl,--wrap=clock_gettime
$(BUILD)/test/test_image_file: WRAPPED := -Wl,--wrap=png_encode
$(BUILD)/test/test_journal: WRAPPED := -Wl,--wrap=fdatasync
$(BUILD)/test/test_save: WRAPPED := -Wl,--wrap=pwrite
$(BUILD)/test/test_snapshot $(BUILD)/test/test_thread_pool: WRAPPED := -Wl,--wrap=pthread_create

# The simulated farm of bench-balance.
$(BUILD)/test/test_simulate: $(patsubst %.c,$(BUILD)/%.o,$(wildcard bench/balance_sim*.c bench/balance_costs*.c)) \
    $(addprefix $(BUILD)/bench/balance_,events.o passes.o record.o stage.o trace.o) \
    $(addprefix $(BUILD)/bench/,median.o report_values.o scenes.o)

# Tests that compare with numbers of arbitrary precision.
$(BUILD)/test/test_exact $(BUILD)/test/test_optics $(BUILD)/test/test_solids: ORACLE := -lmpfr -lgmp

# The catalogue of stiff and extreme cases; its oracles, not the farm, need GMP and MPFR.
$(BUILD)/bench/stability: $(STABILITY) $(LIBRARY)
	$(call link,$(LIBS) -lmpfr -lgmp)

# Each bench has the machine to itself. If one fails, the others are still made.
BENCHES := bench-kernel bench-omit bench-balance bench-error bench-error-truncation bench-stability \
           bench-faults

# To be appended to the command of a bench: draws its plots even if it has failed.
draw = ; status=$$?; gnuplot $(1:%=bench/%.gp) || status=1; exit $$status

bench:
	@failed=""; for bench in $(BENCHES); do \
	    $(MAKE) --no-print-directory $$bench || failed="$$failed $$bench"; done; \
	    [ -z "$$failed" ] || { echo "failed:$$failed"; exit 1; }

# Takes some 45 minutes of two idle cores. STABILITY_OPTIONS="--rays 100000" or "--rows 1-16" is shorter; "--kernel avx2
# --alike 33" selects a level of the kernel, and rays that traverse the tree in bundles.
bench-stability: $(BUILD)/bench/stability all
	@$(call install_missing,gnuplot-nox)
	@mkdir -p bench/out
	export FARM="$(abspath $(FARM))"; $(BUILD)/bench/stability --csv bench/out/stability.csv \
	    --markdown bench/out/stability.md $(STABILITY_OPTIONS); \
	    status=$$?; sh bench/stability_cost.sh || status=1; (exit $$status)$(call draw,stability)

# What pictures claim to be wrong by for max_depth and cutoff, against what they are.
$(BUILD)/bench/error_truncation: $(BUILD)/bench/error_truncation.o \
    $(filter-out %/stability_main.o,$(STABILITY)) $(LIBRARY)
	$(call link,$(LIBS) -lmpfr -lgmp)

# Takes some minutes. SCENES=FOLDER adds the scene files of another folder.
bench-error-truncation: $(BUILD)/bench/error_truncation all
	@$(call install_missing,gnuplot-nox)
	@mkdir -p bench/out
	$(BUILD)/bench/error_truncation --csv bench/out/error_claims.csv \
	    --markdown bench/out/error_claims.md $(ERROR_TRUNCATION_OPTIONS)$(call draw,error_claims)

# Compares the kernel with Embree, Tachyon and POV-Ray, on one thread each; takes about a quarter of an hour.
# KERNEL_OPTIONS="--scenes balls,million --repeat 3 --programs farm,embree" is shorter.
BENCH_KERNEL := $(patsubst %.c,$(BUILD)/%.o,bench/command.c bench/kernel_export.c bench/kernel_main.c \
              bench/kernel_picture.c bench/kernel_report.c bench/kernel_run.c bench/kernel_scenes.c bench/median.c \
              bench/report_values.c bench/scenes.c)
EMBREE := $(patsubst %.c,$(BUILD)/%.o,$(wildcard bench/kernel_embree*.c))
EMBREE_LIBRARY = $(shell test -e /usr/include/embree4/rtcore.h && echo -lembree4 || echo -lembree3)

# Embree's program gets all optimisations that the compiler offers.
$(EMBREE): FLAGS += -O3 -march=native -ffast-math -fno-finite-math-only -ffp-contract=fast

$(BUILD)/bench/kernel: $(BENCH_KERNEL) $(LIBRARY)
	$(call link,$(LIBS))

$(BUILD)/bench/kernel_embree: $(EMBREE) $(BUILD)/bench/scenes.o $(LIBRARY)
	$(call link,$(LIBS) $(EMBREE_LIBRARY))

bench-kernel: $(BUILD)/bench/kernel $(BUILD)/bench/kernel_embree all
	@mkdir -p bench/out
	$(BUILD)/bench/kernel --farm ./$(FARM) --embree $(BUILD)/bench/kernel_embree \
	    --folder $(BUILD)/bench/kernel.out --csv bench/out/kernel.csv \
	    --markdown bench/out/kernel.md --montage bench/out/kernel.png $(KERNEL_OPTIONS)$(call draw,kernel)

# Error against run time, beside POV-Ray and Tachyon; an hour and a half or more of two idle cores, half an
# hour of it for the peers, a quarter of an hour for time limits. What was measured is kept: ended, it goes on
# where it was. ERROR_SECTIONS="sampling forecast" and ERROR_SCENES="lantern" for less, ERROR_SIZE=640x480
# for more; bench/error.sh has all of them.
ERROR_TOOL := $(patsubst %.c,$(BUILD)/%.o,bench/error_tool.c bench/error_allocation.c bench/error_fields.c \
              bench/error_lattice.c bench/error_scale.c bench/kernel_export.c bench/kernel_picture.c \
              bench/kernel_scenes.c bench/median.c bench/scenes.c)

$(BUILD)/bench/error_tool: $(ERROR_TOOL) $(LIBRARY)
	$(call link,$(LIBS))

bench-error: $(BUILD)/bench/error_tool all
	@mkdir -p bench/out
	FARM="$(abspath $(FARM))" TOOL="$(abspath $(BUILD)/bench/error_tool)" WORK=$(BUILD)/bench/error.out \
	    MPIEXEC="$(MPIEXEC)" sh bench/error.sh $(ERROR_SECTIONS)

$(BUILD)/bench/omit: $(addprefix $(BUILD)/,bench/omit.o bench/command.o bench/median.o bench/report_values.o \
    common/message.o common/memory.o)
	$(call link,-lm)

# Takes about five minutes.
bench-omit: $(BUILD)/bench/omit all
	@$(call install_missing,gnuplot-nox)
	@mkdir -p bench/out
	FARM="$(abspath $(FARM))" $(BUILD)/bench/omit$(call draw,omit)

$(BUILD)/bench/faults_journal: $(BUILD)/bench/faults_journal.o
	$(call link)

# Libraries for LD_PRELOAD, which therefore have no sanitizers.
PRELOADED := bench/faults_slow bench/faults_stop test/several_nodes
$(PRELOADED:%=$(BUILD)/%.so): $(BUILD)/%.so: %.c Makefile $(BUILD)/flags
	@mkdir -p $(@D)
	$(say)  link $@
	$(quiet)$(LINK) $(filter-out -Wmissing-prototypes $(SANITIZE),$(FLAGS)) -MT $@ -MF $@.d -shared -fPIC $< -ldl -o $@

FAULTS := $(addprefix $(BUILD)/bench/,faults_journal faults_slow.so faults_stop.so)
# One run in twelve is without a fault.
FAULT_RUNS ?= 330
# Pairs of runs with and without a journal, of 20 s each.
FAULT_PAIRS ?= 7

# Takes some forty minutes of two idle cores. FAULT_RUNS=50 is shorter; FAULTS_KINDS="none" runs without faults.
bench-faults: $(FAULTS) all
	@$(call install_missing,gnuplot-nox)
	@mkdir -p bench/out
	FARM="$(abspath $(FARM))" MPIEXEC="$(MPIEXEC)" FAULTS_JOURNAL=$(BUILD)/bench/faults_journal \
	    FAULTS_SLOW=$(BUILD)/bench/faults_slow.so FAULTS_STOP=$(BUILD)/bench/faults_stop.so \
	    sh bench/faults.sh $(FAULT_RUNS) 1 bench/out$(call draw,faults)
	FARM="$(abspath $(FARM))" sh bench/faults_cost.sh $(FAULT_PAIRS) bench/out$(call draw,faults_cost)

# How the work is distributed. Takes some 20 minutes of two idle cores. BALANCE_OPTIONS="--only real,model" runs the
# parts that need a quiet machine, and keeps the results of the others.
BALANCE := $(patsubst %.c,$(BUILD)/%.o,$(filter-out bench/balance_messages.c,$(wildcard bench/balance*.c)) \
           bench/median.c bench/report_values.c bench/scenes.c)

$(BUILD)/bench/balance: $(BALANCE) $(LIBRARY)
	$(call link,$(LIBS))

$(BUILD)/bench/balance_messages: $(BUILD)/bench/balance_messages.o $(BUILD)/bench/median.o $(LIBRARY)
	$(call link,$(LIBS))

bench-balance: $(BUILD)/bench/balance $(BUILD)/bench/balance_messages all
	@$(call install_missing,gnuplot-nox)
	@mkdir -p bench/out
	FARM="$(abspath $(FARM))" MPIEXEC="$(MPIEXEC)" MESSAGES=$(BUILD)/bench/balance_messages \
	    $(BUILD)/bench/balance $(BALANCE_OPTIONS)$(call draw,balance_plan balance_figures)

run: all
	$(MPIEXEC) -n $$(nproc) ./$(FARM) config/lantern.ini

# What the program lacks of the kernel, and programs of benches without a test, are compiled, at least.
test: all $(ALL_LEVELS:%=$(BUILD)/kernel_%.o) $(UNITS) $(BUILD)/bench/stability $(BUILD)/bench/kernel \
        $(BUILD)/bench/omit $(BUILD)/bench/balance $(FAULTS) $(BUILD)/test/several_nodes.so \
        $(addprefix $(BUILD)/bench/,balance_messages error_tool error_truncation)
	@FARM=./$(FARM) UNITS="$(UNITS)" STABILITY=$(BUILD)/bench/stability KERNEL=$(BUILD)/bench/kernel \
	    OMIT=$(BUILD)/bench/omit BALANCE=$(BUILD)/bench/balance FAULTS_JOURNAL=$(BUILD)/bench/faults_journal \
	    FAULTS_SLOW=$(BUILD)/bench/faults_slow.so FAULTS_STOP=$(BUILD)/bench/faults_stop.so \
	    NODES=$(BUILD)/test/several_nodes.so TRUNCATION=$(BUILD)/bench/error_truncation \
	    MPIEXEC="$(MPIEXEC)" MPICC="$(MPICC)" sh test/run.sh

asan:
	@$(MAKE) BUILD=build/asan FARM=build/asan/farm OPTIMISE='-O1 -g' \
	    SANITIZE='-fsanitize=address,undefined -fno-sanitize-recover=all -fno-omit-frame-pointer' \
	    test

# Whole runs on several processes; takes some minutes.
valgrind: all
	@$(call install_missing,valgrind)
	@FARM=./$(FARM) MPIEXEC="$(MPIEXEC)" sh test/valgrind.sh

# Whole runs under the thread sanitizer; takes some minutes, most of them to compile.
tsan:
	@$(MAKE) BUILD=build/tsan FARM=build/tsan/farm OPTIMISE='-O1 -g' SANITIZE='-fsanitize=thread' all
	@FARM=build/tsan/farm MPIEXEC="$(MPIEXEC)" sh test/tsan.sh

# clang's warnings are others than gcc's: what is clean here compiles with both.
# What is looked at, bench/ by cppcheck alone, and how a compiler that is not mpicc finds mpi.h. In lanes the
# kernel is another program than without: it is looked at twice.
LINT_IN   ?= common master worker test/fuzz config/models
tidy = printf '%s\n' $(1) | xargs -P $$(nproc) -I FILE clang-tidy --quiet FILE -- -std=c17 \
    -D_GNU_SOURCE -I. $(filter -I%,$(COMPILE)) -DFARM_VERSION='"$(VERSION)"' $(2) 2>/dev/null

lint:
	@$(call install_missing,clang clang-tidy cppcheck)
	@MPICH_CC=clang OMPI_CC=clang $(MAKE) --no-print-directory BUILD=build/lint FARM=build/lint/farm build/lint/farm
	@$(call tidy,$(wildcard $(LINT_IN:%=%/*.c)))
	@$(call tidy,$(filter $(LINT_IN:%=%/%),$(KERNEL)),$(FLAGS_$(lastword $(ALL_LEVELS))))
	cppcheck --quiet --std=c11 --enable=warning,style,performance,portability --error-exitcode=1 \
	    --inline-suppr --suppressions-list=.cppcheck -I. -D_GNU_SOURCE -DFARM_VERSION='"$(VERSION)"' \
	    -D_Noreturn='__attribute__((noreturn))' $(LINT_IN) bench

# libFuzzer is part of clang. Where its run-time library is a separate package, clang alone cannot link a fuzz target:
# this command tests that.
fuzz_links = echo 'int LLVMFuzzerTestOneInput(const char *d, long n); \
    int LLVMFuzzerTestOneInput(const char *d, long n) { return !d && n; }' | \
    clang -fsanitize=fuzzer,address -x c - -o /dev/null 2>/dev/null

fuzz-deps:
	@$(fuzz_links) || { $(call install_missing,clang); }
	@$(fuzz_links) || { $(call install_missing,libclang-rt-dev); }

# Everything of rank 0 except the files that use MPI and those that depend on them.
SERVING := main prepare keep conclude serve silence post hand_out take_in accept own_renderer passes
FUZZED := $(filter-out $(SERVING:%=$(BUILD)/master/%.o),$(filter $(BUILD)/common/% \
    $(BUILD)/master/%,$(OBJECTS))) $(BUILD)/test/fuzz/fuzz.o

$(BUILD)/fuzz_%: $(BUILD)/test/fuzz/fuzz_%.o $(FUZZED)
	$(call link,-fsanitize=fuzzer $(LIBS))

# FUZZ="ini obj" selects targets, FUZZ_RUNS=10000000 sets a number of inputs instead of a time.
FUZZ ?= $(FUZZERS)

# Clang would warn that loops over lanes do not use SIMD, because of the sanitizers' checks.
fuzz: fuzz-deps
	@$(MAKE) BUILD=build/fuzz MPICC=clang OPTIMISE='-O2 -g -fno-omit-frame-pointer' \
	    SANITIZE='-fsanitize=fuzzer-no-link,address,undefined -fno-sanitize-recover=all -Wno-pass-failed' \
	    $(FUZZ:%=build/fuzz/fuzz_%)
	@sh test/fuzz/run.sh build/fuzz $(FUZZ)

ROOT  := $(DESTDIR)$(PREFIX)
SHARE := $(ROOT)/share/farm

install: all
	install -d "$(ROOT)/bin" "$(ROOT)/share/man/man1" "$(ROOT)/share/man/man5" \
	    "$(SHARE)/config/generated" "$(SHARE)/config/extreme"
	install -m 755 $(FARM) "$(ROOT)/bin/farm"
	install -m 644 master/farm.1 "$(ROOT)/share/man/man1/"
	install -m 644 config/farm.5 "$(ROOT)/share/man/man5/"
	install -m 644 config/*.ini "$(SHARE)/config/"
	install -m 644 config/generated/*.obj "$(SHARE)/config/generated/"
	install -m 644 config/extreme/*.ini config/extreme/*.obj "$(SHARE)/config/extreme/"

# Files that others have put beside the scenes stay.
uninstall:
	rm -f "$(ROOT)/bin/farm" "$(ROOT)/share/man/man1/farm.1" "$(ROOT)/share/man/man5/farm.5"
	rm -rf "$(SHARE)/config"
	if [ -d "$(SHARE)" ]; then rmdir --ignore-fail-on-non-empty "$(SHARE)"; fi

clean:
	rm -rf build $(FARM) config/generated

# Prints the comment at the top of this file.
help:
	@sed -n '/^#/!q; s/^# \{0,1\}//p' $(firstword $(MAKEFILE_LIST))

format:
	clang-format -i $(wildcard common/*.[ch] master/*.[ch] worker/*.[ch] config/models/*.[ch] \
	    test/*.[ch] test/fuzz/*.[ch] bench/*.[ch])

# What each object that there is was made of.
-include $(wildcard $(BUILD)/*/*.d $(BUILD)/*/*/*.d)

endif # AFTERWARDS
