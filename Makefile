# farm: one picture, ray-traced by as many processors as you have.
#
#   make deps run    install what is missing, build, render the lantern on all cores
#   make deps test   install what is missing, then all tests
#   make             build ./farm and the generated parts of the sample scenes
#   make asan        all tests under the address and undefined-behaviour sanitizers
#   make bench-stability   the catalogue of stiff and extreme cases at full size, 1e9 rays through
#                    closed meshes among them; tables to bench/out/
#   make install     PREFIX=/usr/local DESTDIR=

VERSION := 0.1.0

# MPICH by its own name, where several MPIs are installed side by side.
MPICC   = $(firstword $(shell command -v mpicc.mpich mpicc) mpicc)
MPIEXEC = $(firstword $(shell command -v mpiexec.hydra mpiexec) mpiexec)
PREFIX  ?= /usr/local

BUILD    := build
FARM     := farm
WARNINGS := -Wall -Wextra -Werror -Wshadow -Wconversion -Wdouble-promotion -Wundef \
            -Wmissing-prototypes -Wstrict-prototypes -Wcast-qual -Wvla -Wpointer-arith
# -ffp-contract=off: no fused operation that the source does not name, so that every compiler and
# optimisation level gives the same bits.
FLOAT    := -ffp-contract=off -fno-math-errno
OPTIMISE ?= -O2 -g
SANITIZE :=
FLAGS    := -std=c17 $(OPTIMISE) $(WARNINGS) $(FLOAT) -pthread -D_GNU_SOURCE -I. -MMD -MP \
            -DFARM_VERSION='"$(VERSION)"' $(SANITIZE)
LIBS     := -linih -lm

SOURCES := $(wildcard common/*.c master/*.c worker/*.c)
OBJECTS := $(SOURCES:%.c=$(BUILD)/%.o)
LIBRARY := $(filter-out $(BUILD)/master/main.o,$(OBJECTS))
MODELS  := $(patsubst %.c,$(BUILD)/%.o,$(wildcard config/models/*.c))
UNITS   := $(patsubst test/%.c,$(BUILD)/test/%,$(wildcard test/test_*.c))
STABILITY := $(patsubst %.c,$(BUILD)/%.o,$(wildcard bench/oracle.c bench/stability_*.c bench/pictures*.c test/reference.c))

# `make V=1` shows the whole commands.
quiet := $(if $(V),,@)
say   := $(if $(V),@:,@echo)

.PHONY: all deps run test asan bench-stability scenes install clean format
.SECONDARY:

all: $(FARM) scenes

$(FARM): $(OBJECTS)
	$(say)  link $@
	$(quiet)$(MPICC) $(FLAGS) $(CFLAGS) $(LDFLAGS) $^ $(LIBS) -o $@

# With `make -j deps run`, nothing is compiled before all is installed.
$(BUILD)/%.o: %.c Makefile | $(filter deps,$(MAKECMDGOALS))
	@mkdir -p $(@D)
	$(say)  compile $<
	$(quiet)$(MPICC) $(FLAGS) $(CFLAGS) -c $< -o $@

# The large parts of the sample scenes are made by programs, not checked in.
scenes: config/generated/.made

config/generated/.made: $(BUILD)/models
	@mkdir -p $(@D)
	$(BUILD)/models $(@D)
	@touch $@

$(BUILD)/models: $(MODELS) $(BUILD)/common/message.o
	$(say)  link $@
	$(quiet)$(MPICC) $(FLAGS) $(CFLAGS) $(LDFLAGS) $^ -lm -o $@

$(BUILD)/test/%: $(BUILD)/test/%.o $(LIBRARY) $(filter-out $(BUILD)/config/models/main.o,$(MODELS))
	$(say)  link $@
	$(quiet)$(MPICC) $(FLAGS) $(CFLAGS) $(LDFLAGS) $^ $(LIBS) -lcmocka $(ORACLE) -o $@

# What is tested against numbers of any precision.
$(BUILD)/test/test_exact $(BUILD)/test/test_optics: ORACLE := -lmpfr -lgmp

# The catalogue of stiff and extreme cases; its oracles, not the farm, need GMP and MPFR.
$(BUILD)/bench/stability: $(STABILITY) $(LIBRARY)
	$(say)  link $@
	$(quiet)$(MPICC) $(FLAGS) $(CFLAGS) $(LDFLAGS) $^ $(LIBS) -lmpfr -lgmp -o $@

# About 40 minutes on two cores: STABILITY_OPTIONS="--rays 100000" or "--rows 1-16" for less.
bench-stability: $(BUILD)/bench/stability all
	@mkdir -p bench/out
	FARM=$(abspath $(FARM)) $(BUILD)/bench/stability --csv bench/out/stability.csv \
	    --markdown bench/out/stability.md $(STABILITY_OPTIONS); \
	    status=$$?; FARM=$(abspath $(FARM)) sh bench/stability_cost.sh || status=1; exit $$status

# What a fresh Debian or Ubuntu lacks.
PACKAGES := gcc libc6-dev mpich libmpich-dev libinih-dev libstb-dev libcmocka-dev \
            libgmp-dev libmpfr-dev

deps:
	@missing=""; for p in $(PACKAGES); do \
	    dpkg-query -W -f='$${Status}' $$p 2>/dev/null | grep -q '^install ok installed' \
	        || missing="$$missing $$p"; done; \
	if [ -n "$$missing" ]; then \
	    if [ "$$(id -u)" = 0 ]; then root=""; else root=sudo; fi; \
	    echo "installing:$$missing"; \
	    $$root apt-get update -q && \
	    $$root env DEBIAN_FRONTEND=noninteractive apt-get install -q -y \
	        --no-install-recommends $$missing; \
	fi

run: all
	$(MPIEXEC) -n $$(nproc) ./$(FARM) config/lantern.ini

test: all $(UNITS) $(BUILD)/bench/stability
	@FARM=./$(FARM) UNITS="$(UNITS)" STABILITY=$(BUILD)/bench/stability MPIEXEC="$(MPIEXEC)" MPICC="$(MPICC)" sh test/run.sh

asan:
	@$(MAKE) BUILD=build/asan FARM=build/asan/farm OPTIMISE='-O1 -g' \
	    SANITIZE='-fsanitize=address,undefined -fno-sanitize-recover=all -fno-omit-frame-pointer' \
	    test

SHARE := $(DESTDIR)$(PREFIX)/share/farm

install: all
	install -d $(DESTDIR)$(PREFIX)/bin $(DESTDIR)$(PREFIX)/share/man/man1 \
	    $(DESTDIR)$(PREFIX)/share/man/man5 $(SHARE)/config/generated
	install -m 755 $(FARM) $(DESTDIR)$(PREFIX)/bin/farm
	install -m 644 master/farm.1 $(DESTDIR)$(PREFIX)/share/man/man1/
	install -m 644 config/farm.5 $(DESTDIR)$(PREFIX)/share/man/man5/
	install -m 644 config/*.ini $(SHARE)/config/
	install -m 644 config/generated/*.obj $(SHARE)/config/generated/

clean:
	rm -rf build $(FARM) config/generated

format:
	clang-format -i $(wildcard common/*.[ch] master/*.[ch] worker/*.[ch] config/models/*.[ch] \
	    test/*.[ch] bench/*.[ch])

-include $(OBJECTS:.o=.d) $(MODELS:.o=.d) $(UNITS:=.d) $(STABILITY:.o=.d)
