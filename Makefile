# SPDX-License-Identifier: MIT
# No configure step. Give CC, CFLAGS, PREFIX or DESTDIR on the command line if you want others;
# everything that is built goes to build/.

BUILD   = build
CFLAGS  = -O2 -g1
PREFIX  = /usr/local
JOBS   := $(shell getconf _NPROCESSORS_ONLN 2>/dev/null || echo 2)

STRICT  = -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wsign-conversion -Wundef -Wcast-qual \
          -Wdouble-promotion
SANITIZE = -O1 -g -fsanitize=address,undefined,float-cast-overflow -fno-sanitize-recover=all \
           -fno-omit-frame-pointer
LIBS    = -lm -lpthread

# SKIP='fast gl' leaves test_fast and test_gl out.
SKIP     =
TESTS    = $(filter-out $(SKIP:%=$(BUILD)/tests/test_%), \
             $(patsubst %.c,$(BUILD)/tests/%,$(notdir $(wildcard tests/test_*.c tests/*/test_*.c))))
# examples/web is no program of its own.
EXAMPLES = $(patsubst %.c,$(BUILD)/%,$(notdir $(filter-out examples/web/%, \
             $(wildcard examples/*.c examples/*/*.c))))
GL       = $(patsubst examples/gl/%.c,$(BUILD)/%,$(wildcard examples/gl/*.c))
MEASURE  = $(patsubst examples/measure/%.c,%,$(wildcard examples/measure/*.c))
# The tests that take longest start first, so that none of them runs alone at the end.
LONGEST  = %/test_fast %/test_search %/test_near %/test_banks %/test_filters %/test_bake %/test_maps %/test_gl
# Tests with memory of their own have bodies of their own, the others share one object (oracle.h).
OWN     := $(shell grep -l '^\#include "envmap.h"' tests/test_*.c tests/*/test_*.c)
SHARED   = $(BUILD)/tests/oracle.o
# Those that use private names see bodies as of a system's header, whose inline functions do not warn.
PRIVATE := $(shell grep -l 'define ENVMAP_IMPLEMENTATION$$' tests/test_*.c tests/*/test_*.c)
BODYFLAGS =
# No two programs have the same name, so one can be built and run without its folder's.
vpath %.c examples examples/tool examples/gl examples/measure tests tests/methods
# A run of the test programs; valgrind is put before each with RUN, COMPILE= leaves the compile
# tests out.
RUN      =
COMPILE  = 'sh tests/compile/run.sh $(CC) $(BUILD)/compile' \
           'sh tests/cookbook.sh $(CC) $(BUILD)/envmap $(BUILD)/cookbook'
# Exact sums over millions of texels are not what valgrind is for, and its long double has 64 bits
# only, too few for the lobes' oracles; it sees into the OpenGL driver. (The sanitizers run them all.)
SLOW     = %/test_filters %/test_lobes %/test_fast %/test_hierarchical %/test_sh %/test_methods \
           %/test_methods_gaussian %/test_methods_sampling %/test_scenes %/test_prepared \
           %/test_materials %/test_gl %/test_shaders %/test_harmonics %/test_stability_filters \
           %/test_plan %/test_search %/test_bake %/test_stack %/test_threads %/test_tool_speed \
           %/test_memory
# Compilers to check with: those of gcc and clang that are here.
COMPILERS := $(foreach c,gcc clang,$(if $(shell command -v $(c)),$(c)))

# OpenGL: what of it is here, what an example that wants it is compiled with, and what to install.
HAS_EGL  := $(shell printf '\043include <EGL/egl.h>\n\043include <GL/glcorearb.h>\n' | \
              $(CC) -E - >/dev/null 2>&1 && echo yes)
HAS_GLFW := $(shell printf '\043include <GLFW/glfw3.h>\n' | $(CC) -DGLFW_INCLUDE_NONE -E - >/dev/null 2>&1 && echo yes)
GLFLAGS   = $(if $(HAS_GLFW),-DGL_WINDOW)
GLLIBS    = -lEGL $(if $(HAS_GLFW),-lglfw)
NO_GL     = passed by: no EGL headers here (Debian: libegl-dev libgl-dev, and libglfw3-dev for windows)

# OpenEXR's C library, for the tool to read .exr (Debian: libopenexr-dev; without it the tool says so).
HAS_EXR  := $(shell printf '\043include <OpenEXR/openexr.h>\n' | $(CC) -E - >/dev/null 2>&1 && echo yes)
EXRFLAGS  = $(if $(HAS_EXR),-DTOOL_EXR)
EXRLIBS   = $(if $(HAS_EXR),-lOpenEXRCore)

BENCH     = -O3 -march=native
BENCHARGS =
GALLERY   = docs/images
MAP       =

LONG    =
TARGETS =
.PHONY: help all demo test search check strict sanitize tsan analyze mutate coverage targets limits valgrind \
        fuzz $(MEASURE) bench-baseline size docs-check docs-test examples docs gallery web test-web test-three \
        install clean FORCE
.DEFAULT_GOAL = help

help: ## this list
	@sed -nE 's/^([a-z0-9-]+):[^#]*## (.*)/  make \1@\2/p' Makefile | awk -F@ '{printf "%-22s%s\n", $$1, $$2}'

all: examples $(TESTS) ## build the examples and the tests, run nothing

demo: $(BUILD)/envmap ## three environments, filtered; a picture of them in build/demo
	$(BUILD)/envmap demo $(BUILD)/demo

# Two tests are built while the tool is, which takes as long as these and the shared object.
test: ## build and run the tests; the last line counts them
	@$(MAKE) --no-print-directory -j$(JOBS) $(SHARED) $(if $(COMPILE),$(BUILD)/envmap \
	    $(filter %/test_fast %/test_search,$(TESTS)))
	@sh tests/run.sh -s -j$(JOBS) -l $(BUILD)/tests/log $(COMPILE) \
	    $(foreach t,$(filter $(LONGEST),$(TESTS)) $(filter-out $(LONGEST),$(TESTS)), \
	        '$(MAKE) -s --no-print-directory $(t) && $(strip $(RUN) $(t))')

SECONDS = 60
SEED    = 1
WORK    =
search: ## random works against sums of their own: SECONDS=60 SEED=1, or WORK="..." to check one again
	@mkdir -p $(BUILD)
	$(CC) -std=c99 $(CFLAGS) $(STRICT) -I. -Itests tests/search.c -o $(BUILD)/search $(LIBS)
	$(BUILD)/search $(if $(WORK),'$(WORK)',$(SECONDS) $(SEED))

check: ## all that can be checked here: tests by gcc and clang, strict, sanitizers, analyze, valgrind, pages
	@sh tests/run.sh $(foreach c,$(COMPILERS),'TEST_WHOLE=1 $(MAKE) --no-print-directory test CC=$(c) BUILD=$(BUILD)/$(c)') \
	    $(foreach t,strict sanitize tsan analyze valgrind test-web test-three docs-test docs-check,'$(MAKE) --no-print-directory $(t)')

strict: ## every standard, every strict warning, header, tests and examples, gcc and clang
	@sh tests/run.sh -j$(JOBS) $(foreach c,$(COMPILERS),'sh tests/compile/run.sh $(c) $(BUILD)/strict/$(c) strict')

sanitize: ## the tests with the address and the undefined-behaviour sanitizer
	@mkdir -p $(BUILD) && echo 'int main(void) { return 0; }' >$(BUILD)/probe.c
	@if $(CC) $(SANITIZE) $(BUILD)/probe.c -o $(BUILD)/probe 2>/dev/null && $(BUILD)/probe; then \
	    TEST_QUICK=1 $(MAKE) --no-print-directory test BUILD=$(BUILD)/sanitize CFLAGS="$(SANITIZE)" COMPILE=; \
	else \
	    echo "sanitize passed by: $(CC) has no sanitizers (Debian: libgcc-12-dev or libclang-rt-14-dev)"; \
	fi

TSANCC = clang
tsan: ## every call that takes an executor, under the thread sanitizer
	@mkdir -p $(BUILD) && echo 'int main(void) { return 0; }' >$(BUILD)/probe.c
	@if $(TSANCC) -fsanitize=thread $(BUILD)/probe.c -o $(BUILD)/probe 2>/dev/null && $(BUILD)/probe; then \
	    $(TSANCC) -std=c99 -O1 -g -fsanitize=thread $(STRICT) -I. -Itests tests/test_threads.c \
	        -o $(BUILD)/test_threads_tsan $(LIBS) && TEST_QUICK=1 $(BUILD)/test_threads_tsan; \
	else \
	    echo "tsan passed by: $(TSANCC) has no thread sanitizer (Debian: clang libclang-rt-14-dev)"; \
	fi

analyze: ## clang-tidy, cppcheck and scan-build on envmap.h, each where it is here
	@sh tests/analyze.sh $(BUILD)/analyze

MUTANTS = 200
mutate: ## small faults in envmap.h, one at a time: which do the tests miss? MUTANTS=200 SEED=1 ROOM=pfm, or FAULT=number
	@sh tests/mutate.sh $(BUILD)/mutate $(MUTANTS) $(SEED) '$(or $(FAULT),$(ROOM))'

coverage: ## lines and branches of envmap.h that the quick tests take (gcov), and the lines they do not
	@if command -v gcov >/dev/null; then \
	    rm -f $(BUILD)/coverage/tests/*.gcda; \
	    TEST_QUICK=1 $(MAKE) --no-print-directory test BUILD=$(BUILD)/coverage CC=gcc \
	        CFLAGS='-O1 --coverage' COMPILE= SKIP='gl $(SKIP)' && \
	    sh tests/coverage.sh $(BUILD)/coverage; \
	else \
	    echo "coverage passed by: no gcov here (Debian: gcc)"; \
	fi

EDGE = 8192
limits: $(BUILD)/envmap ## the tool on the largest maps, EDGE=8192, and cubes, FACES=8192: time and peak memory
	@sh tests/limits.sh $(BUILD)/envmap $(BUILD)/limits $(EDGE) $(FACES)

targets: ## the tests as other compilers, flags and machines see them: docs/targets.md; LONG=1 runs more
	@LONG='$(LONG)' sh tests/targets.sh $(if $(TARGETS),$(TARGETS),-o docs/targets.md)

valgrind: ## the quicker tests under valgrind
	@if command -v valgrind >/dev/null; then \
	    TEST_QUICK=1 $(MAKE) --no-print-directory test COMPILE= TESTS='$(filter-out $(SLOW),$(TESTS))' \
	        RUN='valgrind -q --error-exitcode=9 --leak-check=full --errors-for-leak-kinds=all'; \
	else \
	    echo "valgrind passed by: not here (Debian: valgrind)"; \
	fi

FUZZCC      = clang
FUZZERS     = $(basename $(notdir $(wildcard tests/fuzz_*.c)))
FUZZSAN     = address,undefined,float-cast-overflow
FUZZFLAGS   = -fsanitize=fuzzer,$(FUZZSAN) -fno-sanitize-recover=all
FUZZSECONDS = 30
fuzz: $(BUILD)/envmap ## libFuzzer on every reader, options and calls, half a minute each: FUZZSECONDS=30 FUZZSAN=memory
	@mkdir -p $(BUILD)/fuzz/corpus_fuzz_tool $(BUILD)/fuzz/corpus_fuzz_options
	@$(BUILD)/envmap generate labels $(BUILD)/fuzz/seed.pfm --size 8 # oiiotool makes an .exr of it
	@for k in zip piz none; do ! command -v oiiotool >/dev/null || oiiotool $(BUILD)/fuzz/seed.pfm \
	    -d half --compression $$k -o $(BUILD)/fuzz/corpus_fuzz_tool/$$k.exr; done
	@printf 'a.pfm\nb.ktx2\n--size=4\n--lobe\nggx\n--alpha\n.5\n--rotate\n1,2,3' >$(BUILD)/fuzz/corpus_fuzz_options/seed
	@echo '#include <stddef.h>' >$(BUILD)/fuzz/probe.c
	@echo 'int LLVMFuzzerTestOneInput(const unsigned char *d, size_t n) { return d && n > 9 ? 0 : 0; }' \
	    >>$(BUILD)/fuzz/probe.c
	@if $(FUZZCC) -fsanitize=fuzzer $(BUILD)/fuzz/probe.c -o $(BUILD)/fuzz/probe 2>/dev/null; then \
	    sh tests/run.sh -j$(JOBS) $(foreach f,$(FUZZERS),'$(MAKE) -s --no-print-directory $(BUILD)/fuzz/$(f) && \
	        $(BUILD)/fuzz/$(f) -max_total_time=$(FUZZSECONDS) -max_len=4096 -malloc_limit_mb=64 \
	        -timeout=60 -close_fd_mask=3 -print_final_stats=1 -artifact_prefix=$(BUILD)/fuzz/ \
	        $(BUILD)/fuzz/corpus_$(f) $(wildcard tests/fuzz/$(f))'); \
	else \
	    echo "fuzz passed by: $(FUZZCC) with libFuzzer is not here (Debian: clang libclang-rt-14-dev)"; \
	fi

# The programs of examples/measure/, each with what it is started with. They write their
# tables, charts and pictures into DOCS; most take MAP=sky.pfm, or several lat-long maps, and print.
# BENCH=-O2 is built with these flags instead.
DOCS = docs
MAPS = $(foreach m,$(MAP),'$(m)')
architecture: ARGS = $(DOCS) ## the rooms of envmap.h and a texel's way through them: docs/architecture.md
baking: $(BUILD)/envmap
baking: ARGS = $(BUILD)/envmap $(DOCS) ## bake beside 1024 samples a texel, time and memory: docs/bake.md
bench: ARGS = $(MAPS:%=--map %) $(BENCHARGS) ## verify, then time the filter; takes MAP, BENCH and BENCHARGS=--quick
chart: ARGS = $(if $(MAP),$(BUILD) $(MAPS),$(DOCS)) ## speed against accuracy of every method: docs/accuracy-speed.md; MAP: build/charts
conversions: ARGS = $(DOCS) ## what turning a map into another one takes and loses: docs/parameterizations.md
compiled: ARGS = $(DOCS) ## what compilers and flags make of the same filters: docs/filters.md
diagrams: ARGS = $(DOCS) ## what lobes, axes and parameterizations are, drawn: docs/diagrams.md
filters: ARGS = $(DOCS) ## what is in the filters, what they cost and lose: docs/filters.md
harmonics: ARGS = $(if $(MAP),$(MAPS),--docs $(DOCS)) ## what few coefficients cost and lose: docs/harmonics.md; MAP prints
materials: ARGS = $(DOCS) ## every reflection model beside eq. 1: docs/materials.md
methods: ARGS = $(if $(MAP),$(MAPS),--docs $(DOCS)) ## the approximations of examples/methods/: docs/methods.md; MAP prints
papers: ARGS = $(DOCS) ## the papers' figures that need no OpenGL: docs/papers-drawn.md
peers: ARGS = $(DOCS) ## beside what engines do, CMGEN= CMFT= IBLSAMPLER= THREE=path: docs/peers.md
plan: ARGS = $(DOCS) ## what envmap_filter_plan expects, held against what happens: docs/plan.md
pyramid: ARGS = $(if $(MAP),$(MAPS),--docs $(DOCS)) ## a chain from the source, from levels, from differences: docs/pyramids.md; MAP prints
sharpness: ARGS = $(DOCS) ## cost and error from the widest lobe to the sharpest: docs/filters.md
stability: ARGS = $(DOCS) ## where methods fail: docs/stability.md
table1: ARGS = $(DOCS) ## the speed-ups of Kautz et al. 2000, Table 1, beside the published ones: docs/filters.md
table2: ARGS = $(DOCS) ## the rates of Table 2 there, and of the fast filter: docs/accuracy-speed.md

$(MEASURE): %: $(BUILD)/%
	@mkdir -p $(BUILD)/charts $(DOCS)/charts $(DOCS)/images
	$< $(ARGS)

bench-baseline: ## bench, quick, as it is (A) and with -O2 (B), side by side
	@rm -f $(BUILD)/bench-a.csv $(BUILD)/bench-b.csv
	-@$(MAKE) --no-print-directory bench BENCHARGS='--quick --csv $(BUILD)/bench-a.csv'
	-@$(MAKE) --no-print-directory bench BENCH=-O2 BENCHARGS='--quick --csv $(BUILD)/bench-b.csv'
	@$(BUILD)/bench --join $(BUILD)/bench-a.csv $(BUILD)/bench-b.csv

# What is quick to make again, and does not depend on the machine but for times.
CHECKED = architecture diagrams docs size harmonics conversions materials stability papers
docs-check: ## makes tables and pictures of docs/ again, in build/, and fails where pages differ: CHECKED
	@sh tests/docs/check.sh $(BUILD)/docs-check $(CHECKED)

docs-test: ## links, names, and two pages followed word by word
	@sh tests/docs/run.sh $(BUILD)/docs-test

size: ## bytes of code that a program carries, feature by feature: docs/plan.md
	@sh tests/compile/size.sh $(CC) $(BUILD)/size $(DOCS)/plan.md

examples: $(EXAMPLES) ## build the examples

docs: $(BUILD)/envmap ## draw the pictures of README and docs/ again
	$(BUILD)/envmap docs $(DOCS)/images
	$(BUILD)/envmap demo $(BUILD)/demo && cp $(BUILD)/demo/contact-sheet.png $(DOCS)/images/
	$(BUILD)/envmap generate labels $(DOCS)/images/labels.png

gallery: ## render the OpenGL pictures of docs/gallery.md and README's page, headless
ifeq ($(HAS_EGL),yes)
	@mkdir -p $(GALLERY)
	@$(MAKE) --no-print-directory -j$(JOBS) $(GL)
	$(BUILD)/gl_gallery $(GALLERY)
	$(BUILD)/anisotropic --headless $(GALLERY)/anisotropic.png
	$(BUILD)/one_pass --headless $(GALLERY)/one_pass.png
	$(BUILD)/hardware_filter --headless $(GALLERY)/hardware_filter.png
	$(BUILD)/per_frame --headless $(GALLERY)/per_frame.png
	$(BUILD)/nonphotorealistic --headless $(GALLERY)/nonphotorealistic.png
	$(BUILD)/viewer --headless $(GALLERY)/viewer.png --keys MMMMMMM
else
	@echo "gallery $(NO_GL)"
endif
	@$(MAKE) --no-print-directory web
	@if command -v python3 >/dev/null; \
	then python3 tests/web/run.py $(BUILD)/envmap.html $(GALLERY)/web.png; \
	else echo "gallery passed by the page: no python3 here (Debian: python3)"; fi

test-web: web $(BUILD)/envmap ## the page in a headless Chromium; three minutes
	@if command -v python3 >/dev/null; then python3 tests/web/run.py $(BUILD)/envmap.html; \
	else echo "test-web passed by: no python3 here (Debian: python3)"; fi

THREE = $(if $(NODE_MODULES),$(NODE_MODULES),build/npm)/node_modules/three
test-three: $(BUILD)/envmap ## three.js in a headless Chromium draws what bake wrote as the CPU does
	@$(CC) -std=c99 $(CFLAGS) $(STRICT) -I. tests/three/balls.c -o $(BUILD)/balls $(LIBS)
	@if command -v python3 >/dev/null; then \
	    python3 tests/three/run.py $(THREE) $(BUILD)/envmap $(BUILD)/balls $(BUILD)/three; \
	else echo "test-three passed by: no python3 here (Debian: python3)"; fi

web: ## the library in a browser tab: build/envmap.html, one file; needs clang for WebAssembly
	@mkdir -p $(BUILD)
	@sh examples/web/build.sh $(BUILD)/envmap.html

install: ## copy the header to $(DESTDIR)$(PREFIX)/include
	install -d '$(DESTDIR)$(PREFIX)/include'
	install -m 644 envmap.h '$(DESTDIR)$(PREFIX)/include/envmap.h'

clean: ## remove build/
	rm -rf $(BUILD)

# What is built with one compiler or flags is not up to date for others.
$(BUILD)/flags: WORDS = $(CC) $(CFLAGS)
$(BUILD)/flags-measure: WORDS = $(CC) $(BENCH)
$(BUILD)/flags $(BUILD)/flags-measure: FORCE
	@mkdir -p $(BUILD)/tests
	@echo '$(WORDS)' | cmp -s - $@ || echo '$(WORDS)' >$@

HELPERS      = $(wildcard examples/*.h examples/*/*.h)
TEST_HELPERS = tests/fuzz_calls.c $(wildcard tests/*.h tests/*/*.h examples/methods/*.h)

$(SHARED): tests/oracle.c tests/oracle.h tests/test.h envmap.h $(BUILD)/flags
	$(CC) -std=c99 $(CFLAGS) $(BODYFLAGS) $(STRICT) -I. -Itests -c $< -o $@

$(BUILD)/tests/%: %.c envmap.h $(TEST_HELPERS) $(SHARED) $(BUILD)/flags
	$(CC) -std=c99 $(CFLAGS) $(STRICT) -I. -Itests $(if $(filter $<,$(OWN)),, \
	    $(if $(filter $<,$(PRIVATE)),-isystem .) -DTEST_SHARED $(SHARED)) $< -o $@ $(LIBS)

# -O1: test_gl has bodies of its own, but it is the driver that takes the time.
$(BUILD)/tests/test_gl $(BUILD)/tests/test_shaders: $(BUILD)/tests/%: %.c envmap.h $(TEST_HELPERS) $(HELPERS) $(SHARED) $(BUILD)/flags
	$(CC) -std=c99 $(CFLAGS) -O1 $(STRICT) -I. -Itests $(if $(HAS_EGL),-DTEST_GL) -DTEST_ROOT='"$(CURDIR)"' \
	    $(if $(filter $<,$(OWN)),,-DTEST_SHARED $(SHARED)) $< -o $@ $(if $(HAS_EGL),-lEGL) $(LIBS)

$(BUILD)/tests/test_tool_%: test_tool_%.c envmap.h $(TEST_HELPERS) $(HELPERS) $(SHARED) $(BUILD)/envmap $(BUILD)/flags
	$(CC) -std=c99 $(CFLAGS) -O3 $(STRICT) $(EXRFLAGS) -I. -Itests \
	    $(if $(filter $<,$(OWN)),,-DTEST_SHARED $(SHARED)) $< -o $@ $(EXRLIBS) $(LIBS)

# It runs the tool.
$(BUILD)/tests/test_gl: $(BUILD)/envmap

$(BUILD)/fuzz/fuzz_%: tests/fuzz_%.c envmap.h $(TEST_HELPERS) $(HELPERS)
	@mkdir -p $(BUILD)/fuzz/corpus_fuzz_$*
	$(FUZZCC) -std=c99 -O1 -g -I. -Itests $(FUZZFLAGS) $(EXRFLAGS) $< -o $@ $(EXRLIBS) $(LIBS)

# These test what the tool is made of.
$(BUILD)/tests/test_write $(BUILD)/tests/test_bake: $(HELPERS)

$(BUILD)/%: %.c envmap.h $(HELPERS) $(BUILD)/flags
	$(CC) -std=c99 $(CFLAGS) -O3 $(STRICT) -I. $< -o $@ $(LIBS)

$(BUILD)/envmap: envmap.c envmap.h $(HELPERS) $(BUILD)/flags
	$(CC) -std=c99 $(CFLAGS) -O3 $(STRICT) $(EXRFLAGS) -I. $< -o $@ $(EXRLIBS) $(LIBS)

$(MEASURE:%=$(BUILD)/%): $(BUILD)/%: %.c envmap.h $(HELPERS) $(BUILD)/flags-measure
	$(CC) $(BENCH) $(STRICT) -DBENCH_FLAGS='"$(BENCH)"' -I. $< -o $@ $(LIBS)

$(GL): $(BUILD)/%: %.c envmap.h $(HELPERS) $(BUILD)/flags
ifeq ($(HAS_EGL),yes)
	$(CC) -std=c99 $(CFLAGS) -O3 $(STRICT) $(GLFLAGS) -I. $< -o $@ $(GLLIBS) $(LIBS)
else
	@echo "$* $(NO_GL)"
endif

$(BUILD)/openmp: openmp.c envmap.h $(HELPERS) $(BUILD)/flags
	@if echo 'int main(void) { return 0; }' | $(CC) -fopenmp -x c - -o $(BUILD)/probe 2>/dev/null; then \
	    set -x; $(CC) -std=c99 $(CFLAGS) -O3 -fopenmp $(STRICT) -I. $< -o $@ $(LIBS); \
	else \
	    echo "openmp passed by: $(CC) has no -fopenmp (Debian: gcc, or libomp-14-dev for clang)"; \
	fi
