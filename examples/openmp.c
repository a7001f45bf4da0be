/* openmp.c - runs the tasks of a filter with OpenMP: the executor that envmap.h leaves to its user,
   in three lines. (tool/threads.h is the one for POSIX threads.)

   What you will see: the time of one glossy chain serially and on all cores, and that both wrote
   the same bits. Tasks are cut by the data alone, so any order and any number of threads will do;
   schedule(dynamic) gives the next one to whoever is free.
       cc -O3 -fopenmp -I. examples/openmp.c -o openmp -lm
   Without -fopenmp the loop is serial. GCC's threads wait for each other by spinning: where other
   programs want the cores too, set OMP_WAIT_POLICY=passive, or two threads are slower than one.

   SPDX-License-Identifier: MIT */

#define _POSIX_C_SOURCE 200809L
#define ENVMAP_IMPLEMENTATION
#include "envmap.h"
#include "tool/scenes.h"

#include <stdio.h>
#include <string.h>
#include <time.h>
#ifdef _OPENMP
#include <omp.h>
#endif

/* envmap_executor.run */
static void openmp_run(void *user, envmap_task *task, void *context, int count) {
    (void)user;
#ifdef _OPENMP
#pragma omp parallel for schedule(dynamic)
#endif
    for (int i = 0; i < count; ++i) task(context, i);
}

static double seconds(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

#define LEVELS 6

/* The best time of five, in ms; negative on failure. */
static double time_chain(envmap *dst, const envmap *sky, const envmap_filter_desc *desc) {
    envmap_lobe lobes[LEVELS];
    double best = -1, exponent = 1024;
    for (int l = 0; l < LEVELS; ++l, exponent /= 4) lobes[l] = envmap_lobe_phong((float)exponent);
    for (int run = 0; run < 5; ++run) {
        double t = seconds();
        envmap_result result = envmap_filter_chain(dst, sky, lobes, LEVELS, desc);
        t = 1e3 * (seconds() - t);
        if (result) {
            fprintf(stderr, "openmp: %s\n", envmap_result_text(result));
            return -1;
        }
        if (best < 0 || t < best) best = t;
    }
    return best;
}

static int compare(envmap *one, envmap *all, const envmap *sky) {
    envmap_filter_desc desc = {0};
    int threads = 1;
#ifdef _OPENMP
    threads = omp_get_max_threads();
#endif
    double serial = time_chain(one, sky, &desc);
    desc.work.executor.run = openmp_run;
    double parallel = time_chain(all, sky, &desc);
    if (serial < 0 || parallel < 0) return 0;
    const float *end = envmap_texel(one, LEVELS - 1, 0, 5, 0, 0);
    size_t floats = (size_t)(end - one->texels) +
                    3 * (size_t)(one->size >> (LEVELS - 1)) * (size_t)(one->size >> (LEVELS - 1));
    int same = !memcmp(one->texels, all->texels, floats * sizeof(float));
    printf("serial %.1f ms; %d thread%s %.1f ms, %.2f times as fast; %s\n", serial, threads,
           threads == 1 ? "" : "s", parallel, serial / parallel,
           same ? "the same bits" : "OTHER BITS");
    return same;
}

int main(void) {
    envmap sky = {0}, one = {0}, all = {0};
    int ok = !envmap_create(&sky, ENVMAP_LATLONG, 256, 1, 1) &&
             !envmap_create(&one, ENVMAP_CUBE, 128, LEVELS, 1) &&
             !envmap_create(&all, ENVMAP_CUBE, 128, LEVELS, 1);
    if (ok) {
        scene_fill(&sky, SCENE_SUN);
        ok = compare(&one, &all, &sky);
    } else {
        fprintf(stderr, "openmp: out of memory\n");
    }
    envmap_free(&sky);
    envmap_free(&one);
    envmap_free(&all);
    return !ok;
}
