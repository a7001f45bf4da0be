# SPDX-License-Identifier: MIT
# No configure step. Give CC, CFLAGS, PREFIX or DESTDIR on the command line if you want others;
# everything that is built goes to build/.

BUILD   = build
CFLAGS  = -O2 -g
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
             $(patsubst tests/%.c,$(BUILD)/tests/%,$(wildcard tests/test_*.c)))
EXAMPLES = $(patsubst examples/%.c,$(BUILD)/%,$(wildcard examples/*.c))
# A run of the test programs; valgrind is put before each with RUN, COMPILE= leaves the compile
# tests out.
RUN      =
COMPILE  = 'sh tests/compile/run.sh $(CC) $(BUILD)/compile'
# Exact sums over millions of texels are not what valgrind is for, and its long double has 64 bits
# only, too few for the lobes' oracles; it sees into the OpenGL driver. (The sanitizers run them all.)
SLOW     = %/test_filters %/test_lobes %/test_fast %/test_hierarchical %/test_sh %/test_methods \
           %/test_methods_gaussian %/test_methods_sampling %/test_scenes %/test_prepared \
           %/test_materials %/test_gl %/test_harmonics %/test_stability_filters \
           %/test_plan %/test_search
# Compilers to check with: those of gcc and clang that are here.
COMPILERS := $(foreach c,gcc clang,$(if $(shell command -v $(c)),$(c)))

# OpenGL: what of it is here, what an example that wants it is compiled with, and what to install.
HAS_EGL  := $(shell printf '\043include <EGL/egl.h>\n\043include <GL/glcorearb.h>\n' | \
              $(CC) -E - >/dev/null 2>&1 && echo yes)
HAS_GLFW := $(shell printf '\043include <GLFW/glfw3.h>\n' | $(CC) -DGLFW_INCLUDE_NONE -E - >/dev/null 2>&1 && echo yes)
GLFLAGS   = $(if $(HAS_GLFW),-DGL_WINDOW)
GLLIBS    = -lEGL $(if $(HAS_GLFW),-lglfw)
NO_GL     = passed by: no EGL headers here (Debian: libegl-dev libgl-dev, and libglfw3-dev for windows)
GL        = $(patsubst examples/%.c,$(BUILD)/%,$(shell grep -l '"stage.h"' examples/*.c))

BENCH     = -O3 -march=native
BENCHARGS =
GALLERY   = docs/images
MAP       =

.PHONY: help all demo test search check strict sanitize valgrind fuzz bench bench-baseline table1 pyramid \
        harmonics filters methods materials plan size chart examples docs gallery install clean FORCE
.DEFAULT_GOAL = help

help: ## this list
	@sed -nE 's/^([a-z0-9-]+):[^#]*## (.*)/  make \1@\2/p' Makefile | awk -F@ '{printf "%-22s%s\n", $$1, $$2}'

all: examples $(TESTS) ## build the examples and the tests, run nothing

demo: $(BUILD)/envmap ## three environments, filtered; a picture of them in build/demo
	$(BUILD)/envmap demo $(BUILD)/demo

test: ## build and run the tests; the last line counts them
	@$(MAKE) --no-print-directory -j$(JOBS) $(TESTS)
	@sh tests/run.sh -s -j$(JOBS) -l $(BUILD)/tests/log \
	    $(foreach t,$(TESTS),'$(strip $(RUN) $(t))') $(COMPILE)

SECONDS = 60
SEED    = 1
WORK    =
search: ## random works against sums of their own: SECONDS=60 SEED=1, or WORK="..." to check one again
	@mkdir -p $(BUILD)
	$(CC) -std=c99 $(CFLAGS) $(STRICT) -I. -Itests tests/search.c -o $(BUILD)/search $(LIBS)
	$(BUILD)/search $(if $(WORK),'$(WORK)',$(SECONDS) $(SEED))

check: ## all that can be checked here: the whole tests by gcc and clang, strict, sanitize, valgrind
	@sh tests/run.sh $(foreach c,$(COMPILERS),'TEST_WHOLE=1 $(MAKE) --no-print-directory test CC=$(c) BUILD=$(BUILD)/$(c)') \
	    $(foreach t,strict sanitize valgrind,'$(MAKE) --no-print-directory $(t)')

strict: ## every standard, every strict warning, header, tests and examples, gcc and clang
	@sh tests/run.sh $(foreach c,$(COMPILERS),'sh tests/compile/run.sh $(c) $(BUILD)/strict/$(c) strict')

sanitize: ## the tests with the address and the undefined-behaviour sanitizer
	@mkdir -p $(BUILD) && echo 'int main(void) { return 0; }' >$(BUILD)/probe.c
	@if $(CC) $(SANITIZE) $(BUILD)/probe.c -o $(BUILD)/probe 2>/dev/null && $(BUILD)/probe; then \
	    TEST_QUICK=1 $(MAKE) --no-print-directory test BUILD=$(BUILD)/sanitize CFLAGS="$(SANITIZE)" COMPILE=; \
	else \
	    echo "sanitize passed by: $(CC) has no sanitizers (Debian: libgcc-12-dev or libclang-rt-14-dev)"; \
	fi

valgrind: ## the quicker tests under valgrind
	@if command -v valgrind >/dev/null; then \
	    TEST_QUICK=1 $(MAKE) --no-print-directory test COMPILE= TESTS='$(filter-out $(SLOW),$(TESTS))' \
	        RUN='valgrind -q --error-exitcode=9 --leak-check=full --errors-for-leak-kinds=all'; \
	else \
	    echo "valgrind passed by: not here (Debian: valgrind)"; \
	fi

FUZZCC      = clang
FUZZSECONDS = 30
fuzz: ## libFuzzer on the PFM reader, half a minute
	@mkdir -p $(BUILD)/fuzz
	@echo '#include <stddef.h>' >$(BUILD)/fuzz/probe.c
	@echo 'int LLVMFuzzerTestOneInput(const unsigned char *d, size_t n) { return d && n > 9 ? 0 : 0; }' \
	    >>$(BUILD)/fuzz/probe.c
	@if $(FUZZCC) -fsanitize=fuzzer $(BUILD)/fuzz/probe.c -o $(BUILD)/fuzz/probe 2>/dev/null; then \
	    $(FUZZCC) -std=c99 -O1 -g -I. -fsanitize=fuzzer,address,undefined,float-cast-overflow \
	        -fno-sanitize-recover=all tests/fuzz_pfm.c -o $(BUILD)/fuzz/fuzz_pfm -lm && \
	    mkdir -p $(BUILD)/fuzz/corpus && \
	    $(BUILD)/fuzz/fuzz_pfm -max_total_time=$(FUZZSECONDS) -max_len=4096 -malloc_limit_mb=64 \
	        -print_final_stats=1 -artifact_prefix=$(BUILD)/fuzz/ $(BUILD)/fuzz/corpus; \
	else \
	    echo "fuzz passed by: $(FUZZCC) with libFuzzer is not here (Debian: clang libclang-rt-14-dev)"; \
	fi

# The table is the end of docs/filters.md.
table1: ## the speed-ups of Kautz et al. 2000, Table 1, beside the published ones
	@mkdir -p $(BUILD)
	$(CC) -std=c99 -O2 -I. -Itests tests/bench_table1.c -o $(BUILD)/table1 $(LIBS)
	$(BUILD)/table1 >$(BUILD)/table1.md
	@cat $(BUILD)/table1.md
	@{ sed '/^<!-- make table1/q' docs/filters.md && cat $(BUILD)/table1.md; } >$(BUILD)/filters.md
	@cp $(BUILD)/filters.md docs/filters.md

# The table is the end of docs/pyramids.md; a map's is only printed.
pyramid: ## a chain's levels from the source, from levels, from differences; MAP=sky.pfm on that map
	@mkdir -p $(BUILD)
	$(CC) $(BENCH) $(STRICT) -I. tests/bench_pyramid.c -o $(BUILD)/pyramid $(LIBS)
	$(BUILD)/pyramid $(foreach m,$(MAP),'$(m)') >$(BUILD)/pyramid.md
	@cat $(BUILD)/pyramid.md
ifeq ($(MAP),)
	@{ sed '/^<!-- make pyramid/q' docs/pyramids.md && cat $(BUILD)/pyramid.md; } >$(BUILD)/pyramids.md
	@cp $(BUILD)/pyramids.md docs/pyramids.md
endif

bench: ## verify, then time the filter; MAP=sky.pfm on that map, BENCH=-O2, BENCHARGS=--quick
	@mkdir -p $(BUILD)
	$(CC) $(BENCH) $(STRICT) -DBENCH_FLAGS='"$(BENCH)"' -I. examples/bench.c -o $(BUILD)/bench-timed $(LIBS)
	$(BUILD)/bench-timed $(foreach m,$(MAP),--map '$(m)') $(BENCHARGS)

bench-baseline: ## bench, quick, as it is (A) and with -O2 (B), side by side
	@rm -f $(BUILD)/bench-a.csv $(BUILD)/bench-b.csv
	-@$(MAKE) --no-print-directory bench BENCHARGS='--quick --csv $(BUILD)/bench-a.csv'
	-@$(MAKE) --no-print-directory bench BENCH=-O2 BENCHARGS='--quick --csv $(BUILD)/bench-b.csv'
	@$(BUILD)/bench-timed --join $(BUILD)/bench-a.csv $(BUILD)/bench-b.csv

harmonics: ## the tables, charts and the picture of docs/harmonics.md; MAP=sky.pfm with that map
	@mkdir -p $(BUILD) docs/charts
	$(CC) $(BENCH) $(STRICT) -I. examples/harmonics.c -o $(BUILD)/harmonics-timed $(LIBS)
	$(BUILD)/harmonics-timed docs $(MAP)

filters: ## the tables, charts and the picture of docs/filters.md
	@mkdir -p $(BUILD) docs/charts
	$(CC) $(BENCH) $(STRICT) -I. examples/filters.c -o $(BUILD)/filters-timed $(LIBS)
	$(BUILD)/filters-timed docs

.PHONY: stability
stability: $(BUILD)/stability ## where methods fail: docs/stability.md, its tables, charts and pictures
	@mkdir -p docs/charts docs/images
	$(BUILD)/stability docs

examples: $(EXAMPLES) ## build the examples

docs: $(BUILD)/envmap ## draw the pictures of README and docs/ again
	$(BUILD)/envmap docs docs/images

gallery: ## render the OpenGL pictures of docs/gallery.md, headless
ifeq ($(HAS_EGL),yes)
	@mkdir -p $(GALLERY)
	@$(MAKE) --no-print-directory $(GL)
	$(BUILD)/gl_gallery $(GALLERY)
	$(BUILD)/anisotropic --headless $(GALLERY)/anisotropic.png
	$(BUILD)/one_pass --headless $(GALLERY)/one_pass.png
	$(BUILD)/hardware_filter --headless $(GALLERY)/hardware_filter.png
	$(BUILD)/nonphotorealistic --headless $(GALLERY)/nonphotorealistic.png
	$(BUILD)/viewer --headless $(GALLERY)/viewer.png --keys MMMMMMM
else
	@echo "gallery $(NO_GL)"
endif

# With maps it only prints: their names are not the documents' business.
methods: ## measure examples/methods/, and write docs/methods.md and its charts; MAP=sky.pfm prints
	@mkdir -p $(BUILD) docs/charts
	$(CC) -std=c99 $(BENCH) $(STRICT) -I. examples/methods.c -o $(BUILD)/methods-timed $(LIBS)
	$(BUILD)/methods-timed $(if $(MAP),$(MAP),--docs docs)

plan: ## hold envmap_filter_plan against measured times and errors: the tables of docs/plan.md
	@mkdir -p $(BUILD)
	$(CC) $(BENCH) $(STRICT) -I. examples/plan.c -o $(BUILD)/plan-timed $(LIBS)
	$(BUILD)/plan-timed docs

size: ## bytes of code that a program carries, feature by feature: the table of docs/plan.md
	@sh tests/compile/size.sh $(CC) $(BUILD)/size docs/plan.md

materials: $(BUILD)/materials ## every reflection model beside eq. 1: docs/materials.md, its pictures and chart
	@mkdir -p docs/charts
	$(BUILD)/materials docs

# Charts of your own map go to build/charts, what the project shows to docs/.
chart: ## speed against accuracy of every method: docs/charts, docs/accuracy-speed.md; MAP=sky.pfm on that map
	@mkdir -p $(BUILD)/charts docs/charts
	$(CC) -std=c99 $(BENCH) $(STRICT) -I. examples/chart.c -o $(BUILD)/chart-timed $(LIBS)
	$(BUILD)/chart-timed $(if $(MAP),$(BUILD) $(foreach m,$(MAP),'$(m)'),docs)

install: ## copy the header to $(DESTDIR)$(PREFIX)/include
	install -d '$(DESTDIR)$(PREFIX)/include'
	install -m 644 envmap.h '$(DESTDIR)$(PREFIX)/include/envmap.h'

clean: ## remove build/
	rm -rf $(BUILD)

# What is built with one compiler or flags is not up to date for others.
$(BUILD)/flags: FORCE
	@mkdir -p $(BUILD)/tests
	@echo '$(CC) $(CFLAGS)' | cmp -s - $@ || echo '$(CC) $(CFLAGS)' >$@

$(BUILD)/tests/%: tests/%.c envmap.h $(wildcard tests/*.h examples/methods/*.h) $(BUILD)/flags
	$(CC) -std=c99 $(CFLAGS) $(STRICT) -I. -Itests $< -o $@ $(LIBS)

$(BUILD)/%: examples/%.c envmap.h $(wildcard examples/*.h examples/*/*.h) $(BUILD)/flags
	$(CC) -std=c99 $(CFLAGS) -O3 $(STRICT) -I. $< -o $@ $(LIBS)

$(BUILD)/tests/test_gl: tests/test_gl.c envmap.h $(wildcard tests/*.h examples/*.h examples/methods/*.h) $(BUILD)/flags
	$(CC) -std=c99 $(CFLAGS) $(STRICT) -I. -Itests $(if $(HAS_EGL),-DTEST_GL) $< -o $@ $(if $(HAS_EGL),-lEGL) $(LIBS)

$(GL): $(BUILD)/%: examples/%.c envmap.h $(wildcard examples/*.h examples/*/*.h) $(BUILD)/flags
ifeq ($(HAS_EGL),yes)
	$(CC) -std=c99 $(CFLAGS) -O3 $(STRICT) $(GLFLAGS) -I. $< -o $@ $(GLLIBS) $(LIBS)
else
	@echo "$* $(NO_GL)"
endif

$(BUILD)/openmp: examples/openmp.c envmap.h $(wildcard examples/*.h) $(BUILD)/flags
	@if echo 'int main(void) { return 0; }' | $(CC) -fopenmp -x c - -o $(BUILD)/probe 2>/dev/null; then \
	    set -x; $(CC) -std=c99 $(CFLAGS) -O3 -fopenmp $(STRICT) -I. $< -o $@ $(LIBS); \
	else \
	    echo "openmp passed by: $(CC) has no -fopenmp (Debian: gcc, or libomp-14-dev for clang)"; \
	fi
