/* SPDX-License-Identifier: MIT
   What the tests of examples/methods/ share: the methods in a list, their memory counted with the
   library's, and maps to try them on. Include it instead of oracle.h. */
#ifndef METHODS_TEST_H
#define METHODS_TEST_H

#include "oracle.h"

#define METHOD_MALLOC(bytes) oracle_malloc(NULL, bytes)
#define METHOD_FREE(pointer) oracle_free(NULL, pointer)
#include "examples/methods/box_levels.h"
#include "examples/methods/importance_sampling.h"
#include "examples/methods/paraboloid_convolution.h"
#include "examples/methods/separable_gaussian.h"
#include "examples/methods/summed_area.h"

static inline envmap tests_map(int mapping, int size, int levels) {
    envmap map;
    memset(&map, 0, sizeof map);
    if (!CHECK(envmap_create(&map, mapping, size, levels, 1) == ENVMAP_OK)) {
        printf("    no map to test with\n");
        exit(1);
    }
    return map;
}

static inline method_desc tests_desc(int form) {
    method_desc desc;
    memset(&desc, 0, sizeof desc);
    desc.form = form;
    return desc;
}

/* Adds to level 0 a lamp of half-width `radius` (rad) about an axis. */
static inline void tests_lamp(envmap *map, double x, double y, double z, double radius,
                              float light) {
    const double axis[3] = {x, y, z};
    for (int f = 0; f < envmap_faces(map->mapping); ++f)
        for (int j = 0; j < map->size; ++j)
            for (int i = 0; i < method_width(map, 0); ++i) {
                double d[3];
                oracle_direction(d, map->mapping, f, (i + 0.5) / method_width(map, 0),
                                 (j + 0.5) / map->size);
                float *t = envmap_texel(map, 0, 0, f, i, j);
                for (int c = 0; c < 3; ++c) t[c] += oracle_angle(d, axis) < radius ? light : 0;
            }
}

static inline double tests_energy(const envmap *map) {
    double sum = 0;
    for (int f = 0; f < envmap_faces(map->mapping); ++f)
        for (int j = 0; j < map->size; ++j)
            for (int i = 0; i < method_width(map, 0); ++i)
                sum += envmap_solid_angle(map, 0, f, i, j) *
                       (double)envmap_texel(map, 0, 0, f, i, j)[1];
    return sum;
}

/* Largest difference of level 0, over the largest texel of b. */
static inline double tests_worst_of_peak(const envmap *a, const envmap *b) {
    double worst = 0, peak = 0;
    for (size_t i = 0; i < method_floats(a); ++i) {
        double e = fabs((double)a->texels[i] - (double)b->texels[i]);
        if (!(e <= worst)) worst = e;
        if ((double)b->texels[i] > peak) peak = (double)b->texels[i];
    }
    return worst / peak;
}

/* The fast filter at a tenth of the smallest bound; for GGX the definition. */
static inline envmap tests_truth(const envmap *src, const envmap_lobe *lobe, int mapping,
                                 int size) {
    envmap truth = tests_map(mapping, size, 1);
    envmap_filter_desc desc;
    memset(&desc, 0, sizeof desc);
    desc.tolerance = 1e-4f;
    if (lobe->kind == ENVMAP_LOBE_GGX) desc.method = ENVMAP_METHOD_REFERENCE;
    CHECK(envmap_filter(&truth, src, lobe, &desc) == ENVMAP_OK);
    return truth;
}

static inline envmap_difference tests_difference(const envmap *a, const envmap *b) {
    envmap_difference d;
    memset(&d, 0, sizeof d);
    CHECK(envmap_compare(&d, a, b, 0) == ENVMAP_OK);
    return d;
}

/* What a method differs by from the truth. */
static inline envmap_difference tests_miss(method_call *method, const envmap *src, envmap_lobe lobe,
                                           const method_desc *desc, const envmap *truth) {
    envmap dst = tests_map(truth->mapping, truth->size, 1);
    CHECK(method(&dst, src, &lobe, desc) == ENVMAP_OK);
    envmap_difference d = tests_difference(&dst, truth);
    envmap_free(&dst);
    return d;
}

#endif
