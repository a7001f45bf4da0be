/* SPDX-License-Identifier: MIT
   A GGX chain as most engines bake it, beside this library's: one loop of 1024 samples a texel, on
   the source itself or on a level that fits the sample's share of the sphere.

   What you will see: time and error of each on two scenes, after a minute; `peers DOCS` also writes
   the table to DOCS/peers.md. Errors are against the exact sum of the same lobe, D(h) (n.l) with
   n = v = r, over all texels.
       cc -O3 -march=native -I. examples/measure/peers.c -o peers -lm -lpthread */
#define _POSIX_C_SOURCE 200809L
#include "measure.h"
#include "../tool/scenes.h"
#include "../tool/threads.h"

enum { SIZE = 128, LEVELS = 6, SAMPLES = 1024 };
enum { OURS, FILTERED, PLAIN, WAYS };
static const char *const names[WAYS] = {"`envmap_filter_chain`, tolerance 1e-3",
                                        "1024 samples, each on the level that fits it",
                                        "1024 samples of the source itself"};

static double roughness(int level) { return envmap_level_roughness(level, LEVELS, 0); }

/* Van der Corput's second coordinate of Hammersley's points. */
static double radical(unsigned i) {
    double sum = 0, part = 0.5;
    for (; i; i >>= 1, part /= 2) sum += part * (double)(i & 1);
    return sum;
}

/* Sample i about n: its direction and n.l; returns the level whose texels are as large as the
   sample's share of the sphere. h is drawn from D(h) (n.h); with n = v the density of l is D/4. */
static double sample(float l[3], double *nl, int i, double alpha, double omega, const double n[3],
                     const double t[3], const double b[3]) {
    double u = (i + 0.5) / SAMPLES, phi = 2 * MEASURE_PI * radical((unsigned)i), aa = alpha * alpha;
    double c = sqrt((1 - u) / (1 + (aa - 1) * u)), s = sqrt(1 - c * c), q = (aa - 1) * c * c + 1;
    double density = aa / (MEASURE_PI * q * q) / 4;
    *nl = 2 * c * c - 1;
    for (int k = 0; k < 3; ++k) {
        double h = s * cos(phi) * t[k] + s * sin(phi) * b[k] + c * n[k];
        l[k] = (float)(2 * c * h - n[k]);
    }
    return 0.5 * log2(fmax(1 / (SAMPLES * density * omega), 1));
}

static void sampled_texel(float rgb[3], const envmap *src, const double n[3], double alpha,
                          int filtered) {
    double t[3] = {0, 0, 0}, b[3], sum[3] = {0, 0, 0}, weight = 0;
    double omega = 4 * MEASURE_PI / (6.0 * SIZE * SIZE);
    t[fabs(n[1]) < 0.9] = 1;
    double along = measure_dot(t, n);
    for (int k = 0; k < 3; ++k) t[k] -= along * n[k];
    measure_unit(t, t);
    for (int k = 0; k < 3; ++k)
        b[k] = n[(k + 1) % 3] * t[(k + 2) % 3] - n[(k + 2) % 3] * t[(k + 1) % 3];
    for (int i = 0; i < SAMPLES; ++i) {
        float l[3], L[3];
        double nl, level = sample(l, &nl, i, alpha, omega, n, t, b);
        if (nl <= 0) continue;
        envmap_lookup(L, src, l, filtered ? (float)level : 0);
        for (int k = 0; k < 3; ++k) sum[k] += nl * (double)L[k];
        weight += nl;
    }
    for (int k = 0; k < 3; ++k) rgb[k] = (float)(sum[k] / weight);
}

static void sampled_chain(envmap *dst, envmap *src, int filtered) {
    if (filtered) measure_must(envmap_mips_build(src), "levels");
    measure_must(envmap_resample(dst, src, NULL), "mirror");
    for (int level = 1; level < LEVELS; ++level) {
        double r = roughness(level);
        for (int i = 0; i < 6 * (SIZE >> level) * (SIZE >> level); ++i) {
            int edge = SIZE >> level, face = i / (edge * edge), y = i / edge % edge, x = i % edge;
            double n[3];
            measure_direction(n, dst, level, face, x, y);
            sampled_texel(envmap_texel(dst, level, 0, face, x, y), src, n, r * r, filtered);
        }
    }
}

static void chain_of(envmap *dst, const envmap *src, const envmap_filter_desc *desc) {
    envmap_lobe lobes[LEVELS];
    for (int l = 0; l < LEVELS; ++l)
        lobes[l] = envmap_lobe_ggx((float)(roughness(l) * roughness(l)));
    measure_must(envmap_filter_chain(dst, src, lobes, LEVELS, desc), "chain");
}

/* One way on one scene: seconds, and the errors of the levels after the mirror. */
static void measure_way(FILE *out, const char *scene, envmap *src, const envmap *truth, int way) {
    envmap dst = measure_map(ENVMAP_CUBE, SIZE, LEVELS, 1);
    envmap_filter_desc desc = {0};
    double begun = measure_seconds(), worst = 0;
    if (way == OURS) chain_of(&dst, src, &desc);
    else sampled_chain(&dst, src, way == FILTERED);
    double seconds = measure_seconds() - begun;
    fprintf(out, "| %s | %s | %.0f |", scene, names[way], 1e3 * seconds);
    for (int level = 1; level < LEVELS; ++level) {
        envmap_difference d;
        measure_must(envmap_compare(&d, &dst, truth, level), "compare");
        fprintf(out, level > 1 ? ", %.2g" : " %.2g", d.rms);
        worst = fmax(worst, d.worst);
    }
    fprintf(out, " | %.2g |\n", worst);
    envmap_free(&dst);
}

int main(int argc, char **argv) {
    static const int scenes[2] = {SCENE_STUDIO, SCENE_SUN};
    static measure_document document;
    int threads = threads_here();
    envmap_filter_desc exact = {0};
    FILE *out = measure_begin(&document, "table");
    exact.method = ENVMAP_METHOD_REFERENCE;
    exact.work.executor.run = threads_run, exact.work.executor.user = &threads;
    fprintf(out,
            "One thread, %s; source 6 x %d², result 6 x %d² ... %d².\n\n"
            "| scene | way | ms | rms of levels 1 ... 5 | worst texel of all |\n"
            "|---|---|--:|---|--:|\n",
            MEASURE_COMPILER, SIZE, SIZE, SIZE >> (LEVELS - 1));
    for (int s = 0; s < 2; ++s) {
        envmap wide = measure_map(ENVMAP_LATLONG, 2 * SIZE, 1, 1);
        envmap src = measure_map(ENVMAP_CUBE, SIZE, envmap_levels(SIZE), 1);
        envmap truth = measure_map(ENVMAP_CUBE, SIZE, LEVELS, 1);
        scene_fill(&wide, scenes[s]);
        measure_must(envmap_resample(&src, &wide, NULL), "source");
        chain_of(&truth, &src, &exact);
        for (int way = 0; way < WAYS; ++way)
            measure_way(out, scene_name[scenes[s]], &src, &truth, way);
        envmap_free(&wide), envmap_free(&src), envmap_free(&truth);
    }
    measure_end(&document, out, 1);
    if (argc > 1) {
        char path[4096];
        snprintf(path, sizeof path, "%s/peers.md", argv[1]);
        measure_write(&document, path, "make peers");
    }
    measure_document_free(&document);
    return 0;
}
