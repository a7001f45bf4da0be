/* SPDX-License-Identifier: MIT
   Table 1 of Kautz, Vazquez, Heidrich and Seidel 2000 measured again: a parabolic map of 128 x 256
   texels filtered into one of the same size, hierarchically (threshold 0.001) and by brute force,
   the plain loop over the whole square with pow. Prints Markdown; takes some minutes.
       gcc -O2 -I. -Itests tests/bench_table1.c -o build/bench_table1 -lm && build/bench_table1 */
#define _POSIX_C_SOURCE 200809L
#define ENVMAP_IMPLEMENTATION
#include "envmap.h"

#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#define SIZE 128
#define TEXELS (2 * SIZE * SIZE)

static const int exponents[5] = {10, 50, 100, 250, 500};
static const double published[5] = {4.2, 5.3, 7.7, 9.9, 14.1};
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
    need(envmap_create(&map, ENVMAP_PARABOLOID, SIZE, 1, 1) == ENVMAP_OK);
    return map;
}

static void direction_of(float d[3], int i) {
    envmap_direction(d, ENVMAP_PARABOLOID, i / (SIZE * SIZE),
                     ((float)(i % SIZE) + 0.5f) / SIZE, ((float)(i / SIZE % SIZE) + 0.5f) / SIZE);
}

/* A sky over a ground with some soft lamps; with a sun, 12 texels that are 5e4 times the mean. */
static envmap scene(int sun) {
    envmap map = create();
    double mean = 0, sphere = 0;
    for (int i = 0; i < TEXELS; ++i) {
        float d[3], *t = map.texels + 3 * i;
        direction_of(d, i);
        double x = (double)d[0], y = (double)d[1], z = (double)d[2];
        double lamp = exp(40 * (0.6 * x + 0.8 * z - 1)) +
                      2 * exp(90 * (0.48 * y - 0.8 * x - 0.36 * z - 1));
        double ripple = 0.1 * sin(19 * x + 7 * y) * sin(13 * z - 11 * y);
        for (int c = 0; c < 3; ++c)
            t[c] = (float)((y > 0 ? 0.5 + 0.2 * c * y : 0.25 - 0.05 * c) + ripple + 3 * lamp);
        double w = envmap_solid_angle(&map, 0, i / (SIZE * SIZE), i % SIZE, i / SIZE % SIZE);
        mean += w * (double)t[1], sphere += w;
    }
    for (int i = 0; sun && i < 12; ++i)
        for (int c = 0; c < 3; ++c)
            envmap_texel(&map, 0, 0, 0, 83 + i % 4, 41 + i / 4)[c] = (float)(5e4 * mean / sphere);
    return map;
}

/* What brute force sums over: every texel of the square, its direction, solid angle and
   radiance. */
static double source[TEXELS][7];

static double brute(envmap *dst, const envmap *src, double n) {
    for (int i = 0; i < TEXELS; ++i) {
        float d[3];
        double w = envmap_solid_angle(src, 0, i / (SIZE * SIZE), i % SIZE, i / SIZE % SIZE);
        direction_of(d, i);
        for (int c = 0; c < 3; ++c) {
            source[i][c] = (double)d[c];
            source[i][3 + c] = w * (double)src->texels[3 * i + c];
        }
        source[i][6] = w;
    }
    double start = now();
    for (int j = 0; j < TEXELS; ++j) {
        const double *a = source[j];
        double r = 0, g = 0, b = 0, norm = 0;
        for (int i = 0; i < TEXELS; ++i) {
            const double *l = source[i];
            double x = a[0] * l[0] + a[1] * l[1] + a[2] * l[2], k = x > 0 ? pow(x, n) : 0;
            r += k * l[3], g += k * l[4], b += k * l[5], norm += k * l[6];
        }
        dst->texels[3 * j] = (float)(r / norm), dst->texels[3 * j + 1] = (float)(g / norm);
        dst->texels[3 * j + 2] = (float)(b / norm);
    }
    return now() - start;
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
    counter c = {exponents[i], 0};
    double plain = brute(&truth[0], &scenes[0], exponents[i]);
    double again = brute(&truth[1], &scenes[1], exponents[i]);
    if (again < plain) plain = again;
    double with_pow = hierarchical(&dst, &scenes[0], envmap_lobe_function(counted, &c), 1);
    double fewer = (double)TEXELS * TEXELS / c.calls;
    for (int s = 0; s < 2; ++s) {
        envmap_difference d;
        double seconds =
            hierarchical(&dst, &scenes[s], envmap_lobe_phong((float)exponents[i]), 5);
        need(envmap_compare(&d, &dst, &truth[s], 0) == ENVMAP_OK);
        printf("| %d | %s | %.1f | **%.1f** | %.1f | %.1f | %.2f s | %.3f s |", exponents[i],
               scene_name[s], published[i], plain / seconds, plain / with_pow, fewer, plain,
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
