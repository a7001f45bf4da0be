/* SPDX-License-Identifier: MIT
   The harness that every test program shares. A test is a function whose name is a sentence:

       static void solid_angles_sum_to_4_pi(void) { CHECK_CLOSE(sum, 4 * PI, 1e-6); }
       int main(void) { RUN(solid_angles_sum_to_4_pi); return test_summary(); }

   A failing check prints file, line, the expression and its values, and the test goes on; a test
   passes when all of its checks did, and fails when it made none; its processor time stands beside
   its name where that is half a second or more; with TEST_FIRST set the first that fails ends the
   program (make mutate). FIGURE prints a measured number beside its bound, so that the log of a run
   is the table that docs quote. */
#ifndef TEST_H
#define TEST_H

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#define PI 3.14159265358979323846

static int test_checks, test_misses, test_passed, test_failed;

static inline int test_check(int ok, const char *file, int line, const char *what) {
    ++test_checks;
    if (!ok && ++test_misses <= 10) printf("    %s:%d: not true: %s\n", file, line, what);
    return ok;
}

/* !(<=) rather than >, so that NaN misses. */
static inline int test_within(double error, double bound, double value, double expected,
                              const char *file, int line, const char *what) {
    ++test_checks;
    if (error <= bound) return 1;
    if (++test_misses <= 10)
        printf("    %s:%d: %s is %.9g, expected %.9g: off by %.3g, allowed %.3g\n", file, line,
               what, value, expected, error, bound);
    return 0;
}

static inline int test_figure(const char *what, double value, double bound, const char *file,
                              int line) {
    printf("    %-64s %.3g (bound %.3g)\n", what, value, bound);
    return test_within(value, bound, value, 0, file, line, what);
}

static inline void test_run(const char *name, void (*test)(void)) {
    test_checks = test_misses = 0;
    clock_t start = clock();
    test();
    double seconds = (double)(clock() - start) / CLOCKS_PER_SEC;
    if (!test_checks) printf("    made no check\n");
    if (test_misses > 10) printf("    ... %d checks missed in all\n", test_misses);
    int ok = test_checks > 0 && test_misses == 0;
    printf("  %s %s", ok ? "ok  " : "FAIL", name);
    if (seconds >= 0.5) printf(" (%.1f s)", seconds);
    puts("");
    fflush(stdout);
    if (ok)
        ++test_passed;
    else
        ++test_failed;
    if (!ok && getenv("TEST_FIRST")) exit(1);
}

static inline int test_summary(void) {
    printf("%d passed, %d failed\n", test_passed, test_failed);
    return test_failed != 0;
}

#define RUN(test) test_run(#test, test)
#define CHECK(condition) test_check(!!(condition), __FILE__, __LINE__, #condition)
/* |value - expected| <= bound */
#define CHECK_CLOSE(value, expected, bound)                                                        \
    test_within(fabs((double)(value) - (double)(expected)), (bound), (double)(value),              \
                (double)(expected), __FILE__, __LINE__, #value)
/* prints `what` and value; value <= bound */
#define FIGURE(what, value, bound) test_figure((what), (value), (bound), __FILE__, __LINE__)

/* The same numbers on every machine: splitmix64, uniform in [0,1). */
static inline double test_random(unsigned long long *state) {
    unsigned long long z = (*state += 0x9E3779B97F4A7C15ull);
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9ull;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBull;
    z ^= z >> 31;
    return (double)(z >> 11) / 9007199254740992.0;
}

/* n, or a fiftieth of it where TEST_QUICK is set (valgrind): how often to draw at random. */
static inline int test_many(int n) { return getenv("TEST_QUICK") ? n / 50 + 1 : n; }

/* 0 where times tell nothing: in quick forms and with faults (make mutate). */
static inline int test_timed(void) { return !getenv("TEST_QUICK") && !getenv("TEST_FIRST"); }

/* 1 in the whole form (TEST_WHOLE, set by `make check`): what takes minutes, or gigabytes. */
static inline int test_whole(void) { return getenv("TEST_WHOLE") != NULL; }

#endif
