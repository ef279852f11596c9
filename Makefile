# perp: build, test, install. GNU make and a POSIX shell.
#
#   make help            lists the targets and the switches
#
# The default build lives in build/ (build/lib, build/tests, ...); every other set of switches has a
# directory of its own under build/variants/. Each directory records the flags it was built with, and
# a change of flags, here or in the environment, rebuilds it.

.DELETE_ON_ERROR:
.SUFFIXES:
MAKEFLAGS += --no-builtin-rules
SHELL = /bin/sh

.PHONY: all
all: library

## Switches

# Fuzz targets are built by clang, on a library that counts what it covers.
FUZZ_GOALS := fuzz fuzz-check fuzz-merge fuzzers
ifneq ($(filter $(FUZZ_GOALS),$(MAKECMDGOALS)),)
ifeq ($(origin CC),default)
CC = clang
endif
SANITIZE := fuzzer-no-link,address,undefined
endif
ifeq ($(origin CC),default)
CC = cc
endif
ifeq ($(origin AR),default)
AR = ar
endif
BUILD_DIR ?= build
DEBUG ?= 0
SANITIZE ?=
BLAS ?= system
WERROR ?= 0
# Folders of tests/ that are tested; empty: all.
LAYERS ?=
# Tests that run, and files that are compiled for them, at a time.
export JOBS ?= $(shell getconf _NPROCESSORS_ONLN 2>/dev/null || echo 1)

ifeq ($(filter system internal,$(BLAS)),)
$(error BLAS is '$(BLAS)'; it can be 'system' or 'internal')
endif
ifneq ($(filter -ffast-math -Ofast -funsafe-math-optimizations -ffinite-math-only,$(CFLAGS)),)
$(error CFLAGS asks for arithmetic that is not IEEE 754; perp's exact zeros and bounds need it)
endif

comma := ,
empty :=
space := $(empty) $(empty)

compiler_part := $(subst /,_,$(subst $(space),_,$(strip $(filter-out cc gcc,$(CC)))))
variant := $(subst $(space),-,$(strip $(compiler_part) \
    $(if $(filter 1,$(DEBUG)),debug) \
    $(if $(SANITIZE),sanitize-$(subst $(comma),-,$(SANITIZE))) \
    $(if $(filter internal,$(BLAS)),blas-internal)))
B := $(BUILD_DIR)$(if $(variant),/variants/$(variant))

## Versions, from the header that states them

version_of = $(shell sed -n 's/^\#define $(1) \([0-9][0-9]*\)$$/\1/p' include/perp/base.h)
VERSION_MAJOR := $(call version_of,PERP_VERSION_MAJOR)
VERSION_MINOR := $(call version_of,PERP_VERSION_MINOR)
VERSION_PATCH := $(call version_of,PERP_VERSION_PATCH)
VERSION := $(VERSION_MAJOR).$(VERSION_MINOR).$(VERSION_PATCH)
ABI_VERSION := $(call version_of,PERP_ABI_VERSION)
SONAME := libperp.so.$(ABI_VERSION)
MECHANISM_SONAME := libperp-mechanism.so.$(ABI_VERSION)

## What the goals need from the machine

NO_DEPENDENCIES := clean help dist format format-check uninstall check-headers check-size mutate binding
TEST_GOALS := test test-c test-threads tests check check-abi check-consumer valgrind run extremes $(B)/tests/%
PYTHON_GOALS := test test-python check run bench zoo pictures python wheel $(B)/venv/%
goals := $(or $(MAKECMDGOALS),all)

needs := library \
    $(if $(filter $(TEST_GOALS),$(goals)),tests) \
    $(if $(filter $(FUZZ_GOALS),$(goals)),fuzz) \
    $(if $(filter $(PYTHON_GOALS),$(goals)),python) \
    $(if $(filter check check-consumer,$(goals)),consumer)
needs := $(strip $(needs))
CERTIFICATES := $(BUILD_DIR)/certificates.pem
DEPENDENCIES := $(B)/dependencies/$(subst $(space),-,$(needs)).mk

# These install what is missing; every other goal only tells.
INSTALL_MISSING := $(if $(filter test run wheel check-consumer,$(goals)),--install)

ifneq ($(filter-out $(NO_DEPENDENCIES),$(goals)),)
include $(DEPENDENCIES)
$(DEPENDENCIES): scripts/dependencies
	@mkdir -p $(@D)
	@CC='$(CC)' BLAS='$(BLAS)' CERTIFICATES=$(CERTIFICATES) scripts/dependencies $(INSTALL_MISSING) $@ $(needs)
endif

## Flags

WARNINGS := -Wall -Wextra -Wpedantic -Wconversion -Wshadow $(if $(filter 1,$(WERROR)),-Werror)
ifeq ($(origin CFLAGS),undefined)
ifeq ($(DEBUG),1)
CFLAGS := -O0 -g
else ifneq ($(SANITIZE),)
CFLAGS := -O1 -g
else
CFLAGS := -O3
endif
endif
SANITIZE_FLAGS := $(if $(SANITIZE),-fsanitize=$(SANITIZE) -fno-sanitize-recover=all \
    -fno-omit-frame-pointer)

ifeq ($(BLAS),internal)
BLAS_NAME := internal
BLAS_CFLAGS :=
BLAS_LIBS :=
endif
LIBRARY_LIBS = $(strip $(KLU_LIBS) $(BLAS_LIBS) -lm)

# After CFLAGS, so that the environment can't contract a product and a sum by accident. Nobody reads
# errno after a square root: loops that take some become lanes.
STANDARD := -std=c99 -fPIC -ffp-contract=off -fno-math-errno
COMPILE = $(CC) $(CPPFLAGS) $(CFLAGS) $(STANDARD) $(SANITIZE_FLAGS) $(WARNINGS)
LIBRARY_FLAGS = -fvisibility=hidden -DPERP_BUILD -Iinclude -Isrc $(KLU_CFLAGS) $(BLAS_CFLAGS) \
    -DPERP__BLAS_NAME='"$(BLAS_NAME)"'
TEST_FLAGS = -Iinclude -Isrc -Itests $(CMOCKA_CFLAGS)
LINK = $(CC) $(CFLAGS) $(SANITIZE_FLAGS) $(LDFLAGS)
# $(call shared_flags,SONAME,MAP)
shared_flags = -shared -Wl,-soname,$(1) -Wl,-Bsymbolic -Wl,--version-script=$(2) \
    -Wl,--as-needed $(if $(SANITIZE),,-Wl,--no-undefined)
SHARED_FLAGS = $(call shared_flags,$(SONAME),perp.map)
MECHANISM_FLAGS = $(call shared_flags,$(MECHANISM_SONAME),perp-mechanism.map)

## Files: two libraries. libperp-mechanism is src/mechanism, which calls libperp's public functions.

BLAS_OTHER := $(if $(filter internal,$(BLAS)),src/linalg/blas.c,src/linalg/blas_internal.c)
SOURCES := $(sort $(wildcard src/*/*.c src/*/*/*.c))
SOURCES := $(filter-out $(BLAS_OTHER),$(SOURCES))
MECHANISM_SOURCES := $(filter src/mechanism/%,$(SOURCES))
OBJECTS := $(patsubst %.c,$(B)/obj/%.o,$(filter-out $(MECHANISM_SOURCES),$(SOURCES)))
MECHANISM_OBJECTS := $(MECHANISM_SOURCES:%.c=$(B)/obj/%.o)
HEADERS := $(sort $(wildcard include/perp/*.h))

# What libperp has inside and libperp-mechanism needs too: the shared library carries a copy, hidden.
# No public function and nothing that changes may be in these files (make check-abi).
COMMON := base/arena base/check base/clock base/context base/handle \
    linalg/blas$(if $(filter internal,$(BLAS)),_internal) linalg/cone linalg/doubled \
    linalg/active_rows linalg/lanes/loops linalg/matrix linalg/multiply linalg/pivoting \
    patterns/patterns patterns/polyhedron
COMMON_OBJECTS := $(COMMON:%=$(B)/obj/src/%.o)

STATIC := $(B)/lib/libperp.a
SHARED_FILE := $(B)/lib/libperp.so.$(VERSION)
SHARED := $(B)/lib/libperp.so
MECHANISM_STATIC := $(B)/lib/libperp-mechanism.a
MECHANISM_SHARED_FILE := $(B)/lib/libperp-mechanism.so.$(VERSION)
MECHANISM_SHARED := $(B)/lib/libperp-mechanism.so

TEST_HELPERS := $(sort $(wildcard tests/*.c tests/*/problems*.c))
TEST_SOURCES := $(sort $(wildcard $(or $(LAYERS:%=tests/%/test_*.c),tests/*/test_*.c)))
TEST_HELPER_OBJECTS := $(TEST_HELPERS:%.c=$(B)/obj/%.o)
TEST_OBJECTS := $(TEST_SOURCES:%.c=$(B)/obj/%.o)
TESTS := $(TEST_SOURCES:%.c=$(B)/%)

EXAMPLE_SOURCES := $(sort $(wildcard examples/*.c))
EXAMPLE_HELPERS := $(sort $(wildcard examples/third_party/*.c))
EXAMPLES := $(EXAMPLE_SOURCES:%.c=$(B)/%)
EXAMPLE_OBJECTS := $(EXAMPLE_SOURCES:%.c=$(B)/obj/%.o)
EXAMPLE_HELPER_OBJECTS := $(EXAMPLE_HELPERS:%.c=$(B)/obj/%.o)

BENCH_SOURCES := $(sort $(wildcard bench/*.c))
BENCH_HELPERS := $(sort $(wildcard tests/scene*.c tests/piles*.c tests/machines*.c \
    tests/ncp/problems*.c)) tests/gen_base.c
BENCH_HELPER_OBJECTS := $(BENCH_HELPERS:%.c=$(B)/obj/%.o)
BENCHES := $(BENCH_SOURCES:%.c=$(B)/%)
BENCH_OBJECTS := $(BENCH_SOURCES:%.c=$(B)/obj/%.o)

## Records: rewritten only when what they hold changes, so that they date the last change

.PHONY: FORCE
FORCE:

# $(call record,text): the recipe of a record file
define record
@mkdir -p $(@D)
@printf '%s\n' '$(subst ','\'',$(strip $(1)))' > $@.$$$$ && \
    if cmp -s $@.$$$$ $@; then rm $@.$$$$; else mv $@.$$$$ $@; fi
endef

# $(call quietly,WORD,command): with V=1 the command is shown, else the word and the file
ifeq ($(V),1)
quietly = $(2)
else
quietly = @printf '  %-3s %s\n' '$(1)' '$@' && $(2)
endif

compiler_version = $(shell $(CC) --version 2>/dev/null | sed -n '1s/^[^ ]* //p')

$(B)/flags: FORCE
	$(call record,$(compiler_version) $(COMPILE:gcc%=cc%) $(LIBRARY_FLAGS))
$(B)/link-flags: FORCE
	$(call record,$(compiler_version) $(LINK:gcc%=cc%) $(SHARED_FLAGS) $(MECHANISM_FLAGS) \
	    $(LIBRARY_LIBS))
$(B)/test-flags: FORCE
	$(call record,$(TEST_FLAGS) $(CMOCKA_LIBS))
# A source file that was deleted leaves the library too.
$(B)/sources: FORCE
	$(call record,$(SOURCES) $(COMMON) $(TEST_HELPERS) $(EXAMPLE_HELPERS))

## Libraries

.PHONY: library static shared
library: static shared
static: $(STATIC) $(MECHANISM_STATIC)
shared: $(SHARED) $(MECHANISM_SHARED)

$(B)/obj/src/%.o: src/%.c $(B)/flags
	@mkdir -p $(@D)
	$(call quietly,CC,$(COMPILE) $(LIBRARY_FLAGS) -MMD -MP -c -o $@ $<)

$(STATIC): $(OBJECTS) $(B)/sources
	@mkdir -p $(@D)
	@rm -f $@
	$(call quietly,AR,$(AR) rcsD $@ $(OBJECTS))

$(SHARED_FILE): $(OBJECTS) $(B)/sources $(B)/link-flags perp.map
	@mkdir -p $(@D)
	$(call quietly,LD,$(LINK) $(SHARED_FLAGS) -o $@ $(OBJECTS) $(LIBRARY_LIBS))

$(B)/lib/$(SONAME): $(SHARED_FILE)
	@ln -sf $(<F) $@
$(SHARED): $(B)/lib/$(SONAME)
	@ln -sf $(<F) $@

# The static one takes what both need from libperp.a.
$(MECHANISM_STATIC): $(MECHANISM_OBJECTS) $(B)/sources
	@mkdir -p $(@D)
	@rm -f $@
	$(call quietly,AR,$(AR) rcsD $@ $(MECHANISM_OBJECTS))

$(MECHANISM_SHARED_FILE): $(MECHANISM_OBJECTS) $(COMMON_OBJECTS) $(SHARED) $(B)/sources \
    $(B)/link-flags perp-mechanism.map
	@mkdir -p $(@D)
	$(call quietly,LD,$(LINK) $(MECHANISM_FLAGS) -o $@ $(MECHANISM_OBJECTS) $(COMMON_OBJECTS) \
	    $(SHARED) $(BLAS_LIBS) -lm)

$(B)/lib/$(MECHANISM_SONAME): $(MECHANISM_SHARED_FILE)
	@ln -sf $(<F) $@
$(MECHANISM_SHARED): $(B)/lib/$(MECHANISM_SONAME)
	@ln -sf $(<F) $@

# What the Python package carries: the same under names of its own. A simulator in the same process
# may have brought another copy, and the second library must not find that by its name.
PACKAGED := $(B)/python/libperp-python.so.$(ABI_VERSION)
MECHANISM_PACKAGED := $(B)/python/libperp-mechanism-python.so.$(ABI_VERSION)
.PHONY: packaged
packaged: $(PACKAGED) $(MECHANISM_PACKAGED)

$(PACKAGED): $(SHARED)
	@mkdir -p $(@D)
	$(call quietly,LD,$(LINK) $(call shared_flags,$(@F),perp.map) -o $@ $(OBJECTS) $(LIBRARY_LIBS))

BESIDE := '-Wl,-rpath,$$ORIGIN'
$(MECHANISM_PACKAGED): $(PACKAGED) $(MECHANISM_SHARED)
	$(call quietly,LD,$(LINK) $(call shared_flags,$(@F),perp-mechanism.map) $(BESIDE) -o $@ \
	    $(MECHANISM_OBJECTS) $(COMMON_OBJECTS) $< $(BLAS_LIBS) -lm)

## Tests: one program a file, on the static libraries, so that internals can be reached

# In this order: the first is a client of the second.
STATICS := $(MECHANISM_STATIC) $(STATIC)

.PHONY: tests
tests: $(TESTS)

# The program goes before its object is compiled: if that fails, no old program can pass.
$(B)/obj/tests/%.o: tests/%.c $(B)/flags $(B)/test-flags
	@mkdir -p $(@D)
	@rm -f $(B)/tests/$*
	$(call quietly,CC,$(COMPILE) $(TEST_FLAGS) -MMD -MP -c -o $@ $<)

$(TESTS): $(B)/tests/%: $(B)/obj/tests/%.o $(TEST_HELPER_OBJECTS) $(STATICS) $(B)/link-flags
	@mkdir -p $(@D)
	$(call quietly,LD,$(LINK) -o $@ $< $(TEST_HELPER_OBJECTS) $(STATICS) $(LIBRARY_LIBS) \
	    $(CMOCKA_LIBS) -ldl -lpthread)

$(B)/obj/tests/lcp/test_regressions.o: TEST_FLAGS += \
    -DPERP_TEST_REGRESSIONS='"$(abspath tests/regressions)"'
$(B)/obj/tests/extremes/test_world_extremes.o: TEST_FLAGS += \
    -DPERP_TEST_TABLES='"$(abspath bench/results)"'

# These load the shared library from where it was built.
$(B)/obj/tests/abi/%.o: TEST_FLAGS += -DPERP_TEST_SHARED='"$(abspath $(SHARED))"' \
    -DPERP_TEST_MECHANISM='"$(abspath $(MECHANISM_SHARED))"'
$(filter $(B)/tests/abi/%,$(TESTS)): $(SHARED) $(MECHANISM_SHARED)

## Examples and benchmarks: as a user would, with the public headers and the shared libraries

.PHONY: examples benches
examples: $(EXAMPLES)
benches: $(BENCHES)

$(EXAMPLE_OBJECTS) $(BENCH_OBJECTS): $(B)/obj/%.o: %.c $(B)/flags
	@mkdir -p $(@D)
	@rm -f $(B)/$*
	$(call quietly,CC,$(COMPILE) -Iinclude -MMD -MP -c -o $@ $<)

# Other people's code: their style, not our warnings.
$(EXAMPLE_HELPER_OBJECTS): $(B)/obj/%.o: %.c $(B)/flags
	@mkdir -p $(@D)
	$(call quietly,CC,$(COMPILE) -w -Iinclude -MMD -MP -c -o $@ $<)

# examples/NAME.c becomes build/examples/NAME, which finds the library next to it.
RPATH := '-Wl,-rpath,$$ORIGIN/../lib'
SHARED_LIBS := -L$(B)/lib -Wl,--as-needed -lperp-mechanism -lperp -lm
$(EXAMPLES): $(B)/%: $(B)/obj/%.o $(EXAMPLE_HELPER_OBJECTS) $(SHARED) $(MECHANISM_SHARED) \
    $(B)/link-flags
	@mkdir -p $(@D)
	$(call quietly,LD,$(LINK) -o $@ $< $(EXAMPLE_HELPER_OBJECTS) $(SHARED_LIBS) $(RPATH))

$(BENCHES): $(B)/%: $(B)/obj/%.o $(BENCH_HELPER_OBJECTS) $(SHARED) $(MECHANISM_SHARED) \
    $(B)/link-flags
	@mkdir -p $(@D)
	$(call quietly,LD,$(LINK) -o $@ $< $(BENCH_HELPER_OBJECTS) $(SHARED_LIBS) -lpthread $(RPATH))

## Fuzz targets: tests/fuzz/fuzz_NAME.c becomes build/.../fuzz/NAME, on an instrumented library

FUZZ_SOURCES := $(sort $(wildcard tests/fuzz/fuzz_*.c))
FUZZ_NAMES := $(FUZZ_SOURCES:tests/fuzz/fuzz_%.c=%)
FUZZ_HELPERS := tests/fuzz/fuzz.c tests/fuzz/oracle.c tests/fuzz/oracle_integer.c tests/fuzz/oracle_exact.c \
    tests/fuzz/problem.c tests/fuzz/laws.c tests/fuzz/dynamics.c
FUZZ_OBJECTS := $(FUZZ_SOURCES:%.c=$(B)/obj/%.o) $(FUZZ_HELPERS:%.c=$(B)/obj/%.o) \
    $(B)/obj/tests/fuzz/standalone.o
FUZZERS := $(FUZZ_NAMES:%=$(B)/fuzz/%)
FUZZ_ALONE := $(FUZZ_NAMES:%=$(B)/fuzz/alone/%)

.PHONY: fuzzers
fuzzers: $(FUZZERS)
FUZZ_PARTS = $(FUZZ_HELPERS:%.c=$(B)/obj/%.o) $(B)/obj/tests/rational.o $(STATICS)
$(FUZZ_OBJECTS): TEST_FLAGS = -Iinclude
$(FUZZERS): $(B)/fuzz/%: $(B)/obj/tests/fuzz/fuzz_%.o $(FUZZ_PARTS) $(B)/link-flags
	@mkdir -p $(@D)
	$(call quietly,LD,$(LINK) -fsanitize=fuzzer -o $@ $< $(FUZZ_PARTS) $(LIBRARY_LIBS) -lpthread)
$(FUZZ_ALONE): $(B)/fuzz/alone/%: $(B)/obj/tests/fuzz/fuzz_%.o $(B)/obj/tests/fuzz/standalone.o \
    $(FUZZ_PARTS) $(B)/link-flags
	@mkdir -p $(@D)
	$(call quietly,LD,$(LINK) -o $@ $< $(B)/obj/tests/fuzz/standalone.o $(FUZZ_PARTS) \
	    $(LIBRARY_LIBS) -lpthread)

## Python: a virtual environment with what the binding's tests and the plots need

VENV := $(BUILD_DIR)/venv
PYTHON := $(VENV)/bin/python
.PHONY: python
python: $(VENV)/ready
$(VENV)/ready: scripts/requirements.txt
	@CERTIFICATES=$(CERTIFICATES) scripts/dependencies --venv $(VENV) $<
	@touch $@
WHEEL_VENV := $(BUILD_DIR)/venv-wheel
$(WHEEL_VENV)/ready: scripts/requirements-wheel.txt
	@CERTIFICATES=$(CERTIFICATES) scripts/dependencies --venv $(WHEEL_VENV) $<
	@touch $@

# How the scripts, whatever they run, find what was built.
ENVIRONMENT = BUILD='$(B)' CC='$(CC)' PYTHON='$(abspath $(PYTHON))' PERP_LIBRARY='$(abspath $(SHARED))' \
    PYTHONPATH='$(abspath bindings/python)' PYTHONDONTWRITEBYTECODE=1 MPLBACKEND=Agg

# The same dependencies in a make called from here.
AGAIN = $(MAKE) --no-print-directory DEPENDENCIES='$(DEPENDENCIES)'

## Running

#: make binding           write Python's _generated.py and tests/abi/layout.def from the headers
.PHONY: binding
binding:
	@CC='$(CC)' scripts/generate-binding

#: make run               solve the sample problems and simulate; results in build/run
.PHONY: run
run: library examples $(VENV)/ready
	@$(ENVIRONMENT) OUTPUT='$(B)/run' scripts/run-main

#: make pictures          draw the pictures of docs/ anew
.PHONY: pictures
pictures: library $(VENV)/ready
	@$(ENVIRONMENT) OUTPUT='$(B)/pictures' scripts/draw-pictures

#: make zoo               1000 random assemblies at rest, each judged by another solver, and a tenth as
#:                        many articulated systems in motion, judged by their energy, and as many
#:                        lives of worlds (COUNT=, SEED=)
.PHONY: zoo
COUNT ?= 1000
SEED ?= 0
zoo: library $(VENV)/ready
	@$(ENVIRONMENT) PERP_LIBRARY=$(abspath $(B))/lib/libperp.so PYTHONPATH=bindings/python \
	    sh -c '$(VENV)/bin/python tests/zoo/assemblies.py --count $(COUNT) --seed $(SEED); first=$$?; \
	    $(VENV)/bin/python tests/zoo/articulated.py --count $$(($(COUNT) / 10)) --seed $(SEED) && \
	    $(VENV)/bin/python tests/zoo/lives.py --count $(COUNT) --seed $(SEED) && \
	    exit $$first'

#: make bench             speed against accuracy; tables and pictures in bench/results. Peers:
#:                        apt install siconos python3-scipy libbullet-dev libode-dev libbox2d-dev;
#:                        pip install drake quantecon mujoco pin; PEERS_PYTHON=a/python:b/python
.PHONY: bench
bench: library benches $(VENV)/ready
	@$(ENVIRONMENT) bench/run $(B)

## Testing

# What can't be compiled counts as failed, and the rest is tested all the same.
#: make test              every test: C, Python, examples, README
.PHONY: test test-c test-python
test: $(VENV)/ready
	@$(AGAIN) -j$(JOBS) -k library tests examples || true
	@$(ENVIRONMENT) scripts/run-all-tests $(TESTS)

#: make test-c            the C tests alone
test-c:
	@$(AGAIN) -j$(JOBS) -k static tests || true
	@scripts/run-tests $(TESTS)

#: make test-threads      the tests with threads: SANITIZE=thread BLAS=internal tells of races
THREAD_TESTS := $(addprefix $(B)/tests/,base/test_tasks base/test_threads contact/test_coloured \
    lcp/test_batch world/test_lanes)
.PHONY: test-threads
test-threads: $(THREAD_TESTS)
	@scripts/run-tests $(THREAD_TESTS)

#: make extremes          the table of extremes of the stepper; PERP_EXTREMES_LONG=1: the hour awake
EXTREMES := $(B)/tests/extremes/test_world_extremes
.PHONY: extremes
extremes: $(EXTREMES)
	@$(EXTREMES) table >$(B)/extremes.txt; status=$$?; cat $(B)/extremes.txt; exit $$status

#: make test-python       the Python tests alone
test-python: library $(VENV)/ready
	@$(ENVIRONMENT) scripts/run-all-tests

#: make valgrind          C tests under valgrind; leaks are failures; ALL=1: all of them
VALGRIND := valgrind -q --error-exitcode=99 --leak-check=full --errors-for-leak-kinds=definite,indirect \
    --show-leak-kinds=definite,indirect --suppressions=scripts/valgrind.supp
# Address sanitizer sees leaks and overruns in every test; valgrind adds reads of what was not set.
# By default a suite or two of each layer, with those of memory, handles and refusals.
UNDER_VALGRIND := %allocation %handles %refusals %sizes %calls %callbacks %arena %context %storage \
    %_failures %test_contact %test_front_door %test_known %test_run %test_step %test_impact
.PHONY: valgrind
# Its long doubles are doubles: what needs more digits stays out.
valgrind: $(if $(filter 1,$(ALL)),$(TESTS),$(filter-out %test_load_sizes,$(filter $(UNDER_VALGRIND),$(TESTS))))
	@RUNNER='$(VALGRIND)' scripts/run-tests $^

#: make mutate            breaks what decides about answers, one line at a time: do the tests notice?
.PHONY: mutate
mutate:
	@CC='$(CC)' scripts/mutate --build '$(BUILD_DIR)/mutants'

TARGETS ?= $(FUZZ_NAMES)
SECONDS ?= 60
RUNS ?= 50
#: make fuzz              each fuzz target for SECONDS (60) over its corpus; TARGETS='lcp world'
#:                        picks; finds go to build/fuzz, crashes to build/fuzz/crashes
#: make fuzz-check        the corpora, and RUNS (50) changes of each file, the same ones always
#: make fuzz-merge        take what fuzzing found into tests/fuzz/corpus, minimised
#: make fuzz-alone        the corpora without libFuzzer, by any compiler
.PHONY: fuzz fuzz-check fuzz-merge fuzz-alone
fuzz: $(TARGETS:%=$(B)/fuzz/%)
	@FINDS='$(BUILD_DIR)/fuzz' scripts/fuzz run $(SECONDS) $(B)/fuzz $(TARGETS)
fuzz-check: $(TARGETS:%=$(B)/fuzz/%)
	@FINDS='$(BUILD_DIR)/fuzz' scripts/fuzz check $(RUNS) $(B)/fuzz $(TARGETS)
fuzz-merge: $(TARGETS:%=$(B)/fuzz/%)
	@FINDS='$(BUILD_DIR)/fuzz' scripts/fuzz merge $(B)/fuzz $(TARGETS)
fuzz-alone: $(TARGETS:%=$(B)/fuzz/alone/%)
	@scripts/fuzz alone $(B)/fuzz/alone $(TARGETS)

#: make check             test, and every check below
.PHONY: check check-abi check-headers check-consumer
check: test check-abi check-headers check-consumer check-size format-check

#: make check-abi         exported symbols, licences of what is linked, abidiff with the last tag
check-abi: library
	@CC='$(CC)' scripts/check-abi $(B)/lib $(SONAME)

#: make check-headers     every header alone, as C99 and C++11, warnings are errors
check-headers:
	@scripts/check-headers

#: make check-size        lines of each library, and the most there may be
.PHONY: check-size
check-size:
	@scripts/size

#: make check-consumer    install somewhere else, build on it with pkg-config and CMake, uninstall
check-consumer: library
	@CC='$(CC) $(SANITIZE_FLAGS)' MAKE='$(AGAIN)' scripts/check-consumer

FORMATTED := $(wildcard include/perp/*.h src/*/*.[ch] src/*/*/*.[ch] tests/*.[ch] \
    tests/*/*.[ch] examples/*.[ch] bench/*.[ch])
CLANG_FORMAT ?= clang-format
#: make format            clang-format all sources; make format-check only looks
.PHONY: format format-check
format:
	$(CLANG_FORMAT) -i $(FORMATTED)
format-check:
	@$(CLANG_FORMAT) --dry-run -Werror $(FORMATTED)

## Installing

DESTDIR ?=
PREFIX ?= /usr/local
LIBDIR ?= $(PREFIX)/lib
INCLUDEDIR ?= $(PREFIX)/include
PKGCONFIGDIR ?= $(LIBDIR)/pkgconfig
CMAKEDIR ?= $(LIBDIR)/cmake/perp
INSTALL ?= install

# Written at installation: the prefix isn't known before.
define pc_file
sed -e 's|@PREFIX@|$(PREFIX)|' -e 's|@LIBDIR@|$(LIBDIR)|' -e 's|@INCLUDEDIR@|$(INCLUDEDIR)|' \
    -e 's|@VERSION@|$(VERSION)|' -e 's|@LIBS_PRIVATE@|$(LIBRARY_LIBS)|' \
    -e 's|^\(libdir=\)$(PREFIX)/|\1$${prefix}/|' -e 's|^\(includedir=\)$(PREFIX)/|\1$${prefix}/|'
endef
define cmake_file
sed -e 's|@VERSION@|$(VERSION)|' -e 's|@SONAME@|$(SONAME)|' -e 's|@CMAKEDIR@|$(CMAKEDIR)|' \
    -e 's|@MECHANISM_SONAME@|$(MECHANISM_SONAME)|' \
    -e 's|@LIBDIR@|$(LIBDIR)|' -e 's|@INCLUDEDIR@|$(INCLUDEDIR)|' \
    -e 's|@LIBS_PRIVATE@|$(subst $(space),;,$(LIBRARY_LIBS))|'
endef
CMAKE_FILES := perpConfig.cmake perpConfigVersion.cmake
PC_FILES := perp.pc perp-mechanism.pc
SHARED_FILES = $(SHARED_FILE) $(MECHANISM_SHARED_FILE)
INSTALLED_LIBS = libperp.a libperp-mechanism.a $(notdir $(SHARED_FILES)) $(SONAME) \
    $(MECHANISM_SONAME) libperp.so libperp-mechanism.so

#: make install           under DESTDIR and PREFIX (/usr/local); make uninstall takes it away
.PHONY: install uninstall
install: library
	$(INSTALL) -d '$(DESTDIR)$(LIBDIR)' '$(DESTDIR)$(INCLUDEDIR)/perp' '$(DESTDIR)$(PKGCONFIGDIR)' \
	    '$(DESTDIR)$(CMAKEDIR)'
	$(INSTALL) -m 644 $(HEADERS) '$(DESTDIR)$(INCLUDEDIR)/perp'
	$(INSTALL) -m 644 $(STATICS) '$(DESTDIR)$(LIBDIR)'
	$(INSTALL) -m 755 $(SHARED_FILES) '$(DESTDIR)$(LIBDIR)'
	set -e; for name in libperp libperp-mechanism; do \
	    ln -sf $$name.so.$(VERSION) '$(DESTDIR)$(LIBDIR)'/$$name.so.$(ABI_VERSION); \
	    ln -sf $$name.so.$(ABI_VERSION) '$(DESTDIR)$(LIBDIR)'/$$name.so; done
	set -e; for file in $(PC_FILES); do \
	    $(pc_file) packaging/$$file.in > '$(DESTDIR)$(PKGCONFIGDIR)'/$$file; \
	    chmod 644 '$(DESTDIR)$(PKGCONFIGDIR)'/$$file; done
	set -e; for file in $(CMAKE_FILES); do \
	    $(cmake_file) packaging/$$file.in > '$(DESTDIR)$(CMAKEDIR)'/$$file; \
	    chmod 644 '$(DESTDIR)$(CMAKEDIR)'/$$file; done

uninstall:
	rm -f $(HEADERS:include/%='$(DESTDIR)$(INCLUDEDIR)/%')
	rm -f $(INSTALLED_LIBS:%='$(DESTDIR)$(LIBDIR)/%') $(PC_FILES:%='$(DESTDIR)$(PKGCONFIGDIR)/%') \
	    $(CMAKE_FILES:%='$(DESTDIR)$(CMAKEDIR)/%')
	-rmdir '$(DESTDIR)$(INCLUDEDIR)/perp' '$(DESTDIR)$(CMAKEDIR)'

#: make wheel             Python's packages in build/wheels: a source archive, and a wheel with BLAS
#:                        and KLU inside, tested in a fresh environment
.PHONY: wheel
wheel: $(WHEEL_VENV)/ready
	@CERTIFICATES='$(abspath $(CERTIFICATES))' PYTHON='$(abspath $(WHEEL_VENV))/bin/python' \
	    scripts/make-wheel $(BUILD_DIR)/wheels

# The committed tree and nothing else; the times are the commit's, so the bytes are always the same.
#: make dist              a source archive of the last commit: build/perp-VERSION.tar.gz
.PHONY: dist
dist:
	@mkdir -p $(BUILD_DIR)
	git archive --format=tar --prefix=perp-$(VERSION)/ HEAD | gzip -9n \
	    > $(BUILD_DIR)/perp-$(VERSION).tar.gz

#: make clean             remove build/
.PHONY: clean help
clean:
	rm -rf $(BUILD_DIR)

help:
	@echo 'make                   build libperp and libperp-mechanism, static and shared, in build/lib'
	@sed -n 's/^#: //p' Makefile
	@echo
	@echo 'Switches: CC=clang  DEBUG=1  SANITIZE=address,undefined  BLAS=internal  WERROR=1  V=1'
	@echo '          LAYERS="lcp ncp" (only these folders of tests/)  JOBS=n (tests at a time)'
	@echo 'CFLAGS, CPPFLAGS and LDFLAGS are used as they come.'

-include $(wildcard $(patsubst %.o,%.d,$(OBJECTS) $(MECHANISM_OBJECTS) $(TEST_OBJECTS) $(TEST_HELPER_OBJECTS) \
    $(EXAMPLE_OBJECTS) $(EXAMPLE_HELPER_OBJECTS) $(BENCH_OBJECTS) $(FUZZ_OBJECTS)))
