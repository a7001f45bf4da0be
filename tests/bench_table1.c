/* SPDX-License-Identifier: MIT
   Table 1 of Kautz, Vazquez, Heidrich and Seidel 2000 measured again: a parabolic map of 128 x 256
   texels filtered into one of the same size, hierarchically (threshold 0.001) and by brute force,
   the plain loop over the whole square with pow. Prints Markdown; takes some minutes.
       gcc -O2 -I. -Itests tests/bench_table1.c -o build/bench_table1 -lm && build/bench_table1 */
#define _POSIX_C_SOURCE 200809L
#define ENVMAP_IMPLEMENTATION
#include "envmap.h"
#include "examples/table1.h"

#include <stdio.h>
#include <stdlib.h>
#include <time.h>

static const char *const scene_name[2] = {"mild", "sun"};

static double now(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static void need(int ok) {
    if (ok) return;
    fprintf(stderr, "bench_table1: a call failed\n");
    exit(1);
}

static envmap create(void) {
    envmap map = {0, 0, 0, 0, 0, 0, 0, 0};
    need(envmap_create(&map, ENVMAP_PARABOLOID, TABLE1_SIZE, 1, 1) == ENVMAP_OK);
    return map;
}

static envmap scene(int sun) {
    envmap map = create();
    table1_scene(&map, sun);
    return map;
}

static double brute(envmap *dst, const envmap *src, double n) {
    double seconds = table1_brute(dst, src, n, 1, now);
    need(seconds > 0);
    return seconds;
}

typedef struct counter {
    double n, calls;
} counter;

static double counted(double x, double p, void *user) {
    counter *c = (counter *)user;
    (void)p;
    c->calls += 1;
    return x > 0 ? pow(x, c->n) : 0;
}

static double hierarchical(envmap *dst, const envmap *src, envmap_lobe lobe, int runs) {
    envmap_filter_desc desc = {0};
    desc.method = ENVMAP_METHOD_HIERARCHICAL;
    double best = 1e9;
    for (int run = 0; run < runs; ++run) {
        double start = now();
        need(envmap_filter(dst, src, &lobe, &desc) == ENVMAP_OK);
        double seconds = now() - start;
        if (seconds < best) best = seconds;
    }
    return best;
}

static void line(const envmap scenes[2], int i) {
    envmap truth[2] = {create(), create()}, dst = create();
    counter c = {table1_exponents[i], 0};
    double plain = brute(&truth[0], &scenes[0], table1_exponents[i]);
    double again = brute(&truth[1], &scenes[1], table1_exponents[i]);
    if (again < plain) plain = again;
    double with_pow = hierarchical(&dst, &scenes[0], envmap_lobe_function(counted, &c), 1);
    double fewer = (double)TABLE1_TEXELS * TABLE1_TEXELS / c.calls;
    for (int s = 0; s < 2; ++s) {
        envmap_difference d;
        double seconds =
            hierarchical(&dst, &scenes[s], envmap_lobe_phong((float)table1_exponents[i]), 5);
        need(envmap_compare(&d, &dst, &truth[s], 0) == ENVMAP_OK);
        printf("| %d | %s | %.1f | **%.1f** | %.1f | %.1f | %.2f s | %.3f s |", table1_exponents[i],
               scene_name[s], table1_published[i], plain / seconds, plain / with_pow, fewer, plain,
               seconds);
        printf(" %.2e | %.2e | %+.1e |\n", d.rms, d.worst, d.bias);
        fflush(stdout);
    }
    envmap_free(&truth[0]);
    envmap_free(&truth[1]);
    envmap_free(&dst);
}

int main(void) {
    envmap scenes[2] = {scene(0), scene(1)};
    printf("Parabolic map 128 x 256, threshold 0.001, one thread, errors against brute force. `pow "
           "in both`: the\nsame function given as a callback, which has no support to skip; "
           "`evaluations`: how many times fewer\nlobe values that takes.\n\n");
    printf("| N | scene | published | speed-up | pow in both | evaluations | brute force | "
           "hierarchical | rms | worst | bias |\n|--:|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|\n");
    for (int i = 0; i < 5; ++i) line(scenes, i);
    envmap_free(&scenes[0]);
    envmap_free(&scenes[1]);
    return 0;
}
