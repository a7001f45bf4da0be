/* SPDX-License-Identifier: MIT
   Filters: the reference against harmonics, closed forms, a plain sum written apart (zonal.h) and
   the symmetries that an integral over the sphere has; the rules that every method keeps. */
#define _POSIX_C_SOURCE 200809L
#include "helpers.h"

#include <float.h>

/* ----------------------------------------------------------------------------------- tools ---- */

static envmap_result reference(envmap *dst, const envmap *src, envmap_lobe lobe) {
    return filter(dst, src, lobe, ENVMAP_METHOD_REFERENCE, 0);
}

static envmap_lobe lobe_of(o_lobe o) {
    float n = (float)o.n;
    return o.kind == O_PHONG      ? envmap_lobe_phong(n)
           : o.kind == O_GAUSSIAN ? envmap_lobe_gaussian(n)
           : o.kind == O_GGX      ? envmap_lobe_ggx(n)
                                  : envmap_lobe_banks(n);
}

/* "Phong 10"; good for one print. */
static const char *name_of(o_lobe o) {
    static const char *const names[] = {"Phong", "Gaussian", "GGX", "Banks"};
    static char text[48];
    snprintf(text, sizeof text, "%s %g", names[o.kind], o.n);
    return text;
}

/* Texel number i of slice 0 of level 0, in memory order: its axis; NULL at the end. */
static float *texel_of(double axis[3], const envmap *map, int i) {
    int width = oracle_width(map->mapping, map->size), area = width * map->size;
    if (i / area >= envmap_faces(map->mapping)) return NULL;
    int x = i % width, y = i / width % map->size;
    oracle_direction(axis, map->mapping, i / area, (x + 0.5) / width, (y + 0.5) / map->size);
    return envmap_texel(map, 0, 0, i / area, x, y);
}

static double worst_of_two(const envmap *a, const envmap *b) {
    double worst = 0;
    for (size_t i = 0; i < floats_of(a); ++i) {
        double off = fabs((double)a->texels[i] - (double)b->texels[i]);
        if (!(off <= worst)) worst = off;
    }
    return worst;
}

/* --------------------------------------------------------------------------- Funk and Hecke ----
 */

static double harmonics_2_3_4(const double d[3], int channel) {
    static const int l[3] = {2, 3, 4}, m[3] = {1, -2, 0};
    return o_harmonic(l[channel], m[channel], d);
}

/* The largest |filter(Y) - lambda_l Y| / max |Y|, and in *rms the root of the mean square. */
static double funk_hecke_error(double *rms, int mapping, int size, o_lobe lobe, int slices) {
    envmap src = black(mapping, size, 1, 1), dst = black(ENVMAP_CUBE, 5, 1, slices);
    oracle_fill(&src, 0, harmonics_2_3_4);
    double worst = 0, square = 0;
    int count = 0;
    CHECK(reference(&dst, &src, lobe_of(lobe)) == ENVMAP_OK);
    for (int k = 0; k < slices; ++k) {
        double p = -1 + 2 * (k + 0.5) / slices, lambda[5], norm = o_norm(lobe, p);
        o_moments(lambda, 5, lobe, p, 1);
        for (int i = 0; i < 150; ++i) {
            double axis[3];
            const float *texel = texel_of(axis, &dst, i) + 450 * k;
            for (int c = 0; c < 3; ++c, ++count) {
                double expected = lambda[c + 2] / norm * harmonics_2_3_4(axis, c);
                double error = fabs((double)texel[c] - expected) / 0.85;
                if (!(error <= worst)) worst = error;
                square += error * error;
            }
        }
    }
    if (rms) *rms = sqrt(square / count);
    envmap_free(&src);
    envmap_free(&dst);
    return worst;
}

static void filtering_a_harmonic_scales_it_by_the_zonal_coefficient(void) {
    static const struct {
        o_lobe lobe;
        int size, slices;
        double bound;
    } cases[] = {{{O_PHONG, 0}, 32, 1, 1.5e-3},    {{O_PHONG, 1}, 32, 1, 3e-4},
                 {{O_PHONG, 10}, 32, 1, 3e-4},     {{O_PHONG, 100}, 48, 1, 1e-4},
                 {{O_PHONG, 1000}, 128, 1, 1e-6},  {{O_GAUSSIAN, 20}, 32, 1, 3e-4},
                 {{O_GAUSSIAN, 0.5}, 32, 1, 3e-4}, {{O_GGX, 0.5}, 32, 1, 3e-4},
                 {{O_GGX, 0.25}, 48, 1, 2e-4},     {{O_BANKS, 0}, 32, 4, 3e-4},
                 {{O_BANKS, 0.75}, 32, 3, 3e-4}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; ++i) {
        char what[96];
        snprintf(what, sizeof what, "%s, cube %d: |filter(Y) - lambda Y| / max |Y|",
                 name_of(cases[i].lobe), cases[i].size);
        FIGURE(what,
               funk_hecke_error(NULL, ENVMAP_CUBE, cases[i].size, cases[i].lobe, cases[i].slices),
               cases[i].bound);
    }
}

static void halving_the_texel_quarters_the_error(void) {
    static const o_lobe lobes[3] = {{O_PHONG, 3}, {O_GAUSSIAN, 3}, {O_GGX, 0.6}};
    static const int mappings[5] = {ENVMAP_CUBE, ENVMAP_LATLONG, ENVMAP_PARABOLOID, ENVMAP_ANGULAR,
                                    ENVMAP_OCTAHEDRAL};
    double coarse, fine, finer;
    for (int i = 0; i < 3; ++i)
        for (int m = 0; m < 5; ++m) {
            funk_hecke_error(&coarse, mappings[m], 24, lobes[i], 1);
            funk_hecke_error(&fine, mappings[m], 48, lobes[i], 1);
            funk_hecke_error(&finer, mappings[m], 96, lobes[i], 1);
            printf("    %-12s %-11s rms %.2e %.2e %.2e, ratios %.2f %.2f\n", name_of(lobes[i]),
                   oracle_name[mappings[m]], coarse, fine, finer, coarse / fine, fine / finer);
            CHECK(coarse / fine > 3.4 && coarse / fine < 4.8);
            CHECK(fine / finer > 3.6 && fine / finer < 4.5);
        }
    /* and with a lobe thinner than a texel it is the error of bilinear radiance */
    o_lobe thin = {O_PHONG, 1e5};
    funk_hecke_error(&coarse, ENVMAP_CUBE, 12, thin, 1);
    funk_hecke_error(&fine, ENVMAP_CUBE, 24, thin, 1);
    funk_hecke_error(&finer, ENVMAP_CUBE, 48, thin, 1);
    printf("    %-12s %-11s rms %.2e %.2e %.2e, ratios %.2f %.2f\n", name_of(thin), "cube", coarse,
           fine, finer, coarse / fine, fine / finer);
    CHECK(coarse / fine > 3 && coarse / fine < 5);
    CHECK(fine / finer > 3 && fine / finer < 5);
}

/* ------------------------------------------------------------------------------ the plain sum ----
 */

static double plain_sum_error(int mapping, int size, o_lobe lobe, int dst_mapping, int slices) {
    envmap src = noise(mapping, size, 7), dst = black(dst_mapping, 3, 1, slices);
    double worst = 0;
    o_source source;
    o_source_make(&source, &src);
    CHECK(reference(&dst, &src, lobe_of(lobe)) == ENVMAP_OK);
    int count = envmap_faces(dst_mapping) * oracle_width(dst_mapping, 3) * 3;
    for (int k = 0; k < slices; ++k) {
        double p = -1 + 2 * (k + 0.5) / slices;
        for (int i = 0; i < count; ++i) {
            double axis[3], rgb[3];
            const float *texel = texel_of(axis, &dst, i) + 3 * count * k;
            o_sum(rgb, &source, lobe, p, axis, lobe.kind == O_BANKS ? o_norm(lobe, p) : 0);
            for (int c = 0; c < 3; ++c) {
                double error = fabs((double)texel[c] / rgb[c] - 1);
                if (rgb[c] <= 0) error = fabs((double)texel[c]);
                if (!(error <= worst)) worst = error;
            }
        }
    }
    o_source_free(&source);
    envmap_free(&src);
    envmap_free(&dst);
    return worst;
}

/* Wherever sigma is two texels and more, the reference is the sum over texel centres. */
static void the_reference_is_the_sum_over_all_texels(void) {
    static const struct {
        int mapping, size;
        o_lobe lobe;
        int dst, slices;
        double bound;
    } cases[] = {{ENVMAP_CUBE, 32, {O_PHONG, 1}, ENVMAP_CUBE, 1, 2e-7},
                 {ENVMAP_CUBE, 32, {O_PHONG, 50}, ENVMAP_CUBE, 1, 2e-7},
                 {ENVMAP_CUBE, 32, {O_GAUSSIAN, 50}, ENVMAP_LATLONG, 1, 2e-7},
                 {ENVMAP_CUBE, 32, {O_GGX, 0.25}, ENVMAP_PARABOLOID, 1, 2e-7},
                 {ENVMAP_CUBE, 32, {O_BANKS, 0.5}, ENVMAP_CUBE, 2, 2e-7},
                 {ENVMAP_LATLONG, 32, {O_PHONG, 10}, ENVMAP_CUBE, 1, 2e-7},
                 {ENVMAP_LATLONG, 32, {O_BANKS, 0}, ENVMAP_SPHERE, 2, 2e-7},
                 {ENVMAP_PARABOLOID, 32, {O_PHONG, 10}, ENVMAP_CUBE, 1, 2e-7},
                 {ENVMAP_PARABOLOID, 32, {O_GGX, 0.5}, ENVMAP_ANGULAR, 1, 2e-7},
                 {ENVMAP_ANGULAR, 64, {O_GAUSSIAN, 20}, ENVMAP_CUBE, 1, 2e-7},
                 {ENVMAP_ANGULAR, 64, {O_PHONG, 1}, ENVMAP_LATLONG, 1, 2e-7},
                 {ENVMAP_OCTAHEDRAL, 33, {O_PHONG, 10}, ENVMAP_CUBE, 1, 2e-7},
                 {ENVMAP_OCTAHEDRAL, 32, {O_GGX, 0.5}, ENVMAP_OCTAHEDRAL, 1, 2e-7},
                 {ENVMAP_SPHERE, 64, {O_PHONG, 1}, ENVMAP_PARABOLOID, 1, 2e-7}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; ++i) {
        char what[96];
        snprintf(what, sizeof what, "%s %d -> %s, %s: against the plain sum",
                 oracle_name[cases[i].mapping], cases[i].size, oracle_name[cases[i].dst],
                 name_of(cases[i].lobe));
        FIGURE(what,
               plain_sum_error(cases[i].mapping, cases[i].size, cases[i].lobe, cases[i].dst,
                               cases[i].slices),
               cases[i].bound);
    }
}

static void one_lit_texel_shows_the_lobe(void) {
    static const o_lobe lobes[4] = {{O_PHONG, 12}, {O_GAUSSIAN, 12}, {O_GGX, 0.4}, {O_BANKS, 0.6}};
    static const int lit[3] = {0, 137, 6 * 256 - 100};
    double worst = 0;
    for (int n = 0; n < 3; ++n)
        for (int i = 0; i < 4; ++i) {
            envmap src = black(ENVMAP_CUBE, 16, 1, 1), dst = black(ENVMAP_LATLONG, 8, 1, 1);
            envmap_lobe lobe = lobe_of(lobes[i]);
            double l[3], axis[3], u, v;
            float *lamp = texel_of(l, &src, lit[n]), *texel;
            lamp[0] = 3, lamp[1] = 1, lamp[2] = 0;
            double omega = o_texel(&u, &v, ENVMAP_CUBE, 16, lit[n] % 16, lit[n] / 16 % 16);
            lobe.raw = 1;
            CHECK(reference(&dst, &src, lobe) == ENVMAP_OK);
            for (int j = 0; (texel = texel_of(axis, &dst, j)) != NULL; ++j) {
                double angle = oracle_angle(axis, l);
                double k = (double)o_k(lobes[i], (long double)angle, 0) * omega;
                double peak = omega * (lobes[i].kind == O_BANKS ? 1 / (1 - lobes[i].n)
                                       : lobes[i].kind == O_GGX ? 1 / (PI * lobes[i].n * lobes[i].n)
                                                                : 1);
                for (int c = 0; c < 3; ++c) {
                    double error = fabs((double)texel[c] - k * (c == 0 ? 3 : c == 1)) / (3 * peak);
                    if (!(error <= worst)) worst = error;
                }
            }
            envmap_free(&src);
            envmap_free(&dst);
        }
    FIGURE("one lit texel: |filter - k omega| / peak", worst, 1e-6);
}

/* --------------------------------------------------------------------------- white furnace ---- */

static void white(envmap *map) {
    for (size_t i = 0; i < floats_of(map); i += 3) {
        map->texels[i] = 0.75f;
        map->texels[i + 1] = 2;
        map->texels[i + 2] = 1e-3f;
    }
}

static double furnace_error(const envmap *dst, double expected) {
    static const float colour[3] = {0.75f, 2, 1e-3f};
    double worst = 0;
    for (size_t i = 0; i < floats_of(dst); ++i) {
        double error = fabs((double)dst->texels[i] / ((double)colour[i % 3] * expected) - 1);
        if (!(error <= worst)) worst = error;
    }
    return worst;
}

static void a_constant_environment_stays_itself_for_every_lobe_and_mapping(void) {
    static const o_lobe lobes[] = {{O_PHONG, 0},    {O_PHONG, 0.5},   {O_PHONG, 1},
                                   {O_PHONG, 10},   {O_PHONG, 1e5},   {O_PHONG, 1e9},
                                   {O_GAUSSIAN, 0}, {O_GAUSSIAN, 20}, {O_GAUSSIAN, 1e9},
                                   {O_GGX, 1},      {O_GGX, 0.2},     {O_GGX, (double)1e-4f}};
    static const int sizes[3][2] = {{6, 2}, {1, 1}, {3, 1}};
    double worst = 0;
    for (int s = 0; s < 3; ++s)
        for (int m = 0; m < MAPPINGS * MAPPINGS; ++m) {
            envmap src = black(m / MAPPINGS, sizes[s][0], 1, 1),
                   dst = black(m % MAPPINGS, sizes[s][1], 1, 1);
            white(&src);
            for (size_t i = 0; i < sizeof lobes / sizeof *lobes; i += s ? 4 : 1) {
                CHECK(reference(&dst, &src, lobe_of(lobes[i])) == ENVMAP_OK);
                double error = furnace_error(&dst, 1);
                if (!CHECK(error <= 3e-7))
                    printf("    %s %d -> %s %d, %s: off by %g\n", oracle_name[m / MAPPINGS],
                           sizes[s][0], oracle_name[m % MAPPINGS], sizes[s][1], name_of(lobes[i]),
                           error);
                if (!(error <= worst)) worst = error;
            }
            envmap_free(&src);
            envmap_free(&dst);
        }
    FIGURE("white furnace, all mapping pairs, N = 0 .. 1e9: relative", worst, 3e-7);
}

/* One norm for all slices: the ratio of the integrals is sqrt(1-c^2) for s >= |c|. */
static void a_constant_environment_under_banks_is_brightest_across_the_view(void) {
    static const float s[4] = {0.2f, 0.6f, 0.9f, 0.99999f};
    for (int i = 0; i < 4; ++i) {
        o_lobe lobe = {O_BANKS, (double)s[i]};
        envmap src = black(ENVMAP_CUBE, 32, 1, 1), dst = black(ENVMAP_CUBE, 2, 1, 5);
        char what[96];
        double worst = 0;
        white(&src);
        CHECK(reference(&dst, &src, envmap_lobe_banks(s[i])) == ENVMAP_OK);
        for (int k = 0; k < 5; ++k) {
            double c = -1 + 2 * (k + 0.5) / 5, ratio = o_integral(lobe, c) / o_integral(lobe, 0);
            if (lobe.n >= fabs(c)) CHECK_CLOSE(ratio, sqrt(1 - c * c), 1e-9);
            envmap slice = dst;
            slice.slices = 1;
            slice.texels = envmap_texel(&dst, 0, k, 0, 0, 0);
            double error = furnace_error(&slice, ratio);
            if (k == 2) CHECK_CLOSE(ratio, 1, 1e-12);
            if (!(error <= worst)) worst = error;
        }
        snprintf(what, sizeof what, "white furnace of Banks %g, five slices, cube 32", lobe.n);
        FIGURE(what, worst, 1e-4);
        envmap_free(&src);
        envmap_free(&dst);
    }
}

static void raw_sums_of_a_constant_environment_are_the_closed_integrals(void) {
    envmap src = black(ENVMAP_CUBE, 32, 1, 1), dst = black(ENVMAP_CUBE, 2, 1, 1);
    white(&src);
    for (int i = 0; i < 4; ++i) {
        static const float N[4] = {1, 5, 10, 50};
        envmap_lobe lobe = envmap_lobe_phong(N[i]);
        lobe.raw = 1;
        lobe.scale = 0.5f; /* k_s */
        CHECK(reference(&dst, &src, lobe) == ENVMAP_OK);
        FIGURE("raw Phong: relative to k_s 2 pi / (N+1)",
               furnace_error(&dst, PI / ((double)N[i] + 1)), 3e-4);
    }
    envmap_lobe diffuse = envmap_lobe_diffuse();
    diffuse.raw = 1;
    diffuse.scale = (float)(1 / PI); /* the VR paper's k_d / pi */
    CHECK(reference(&dst, &src, diffuse) == ENVMAP_OK);
    FIGURE("raw diffuse with k_d = 1/pi: relative to 1", furnace_error(&dst, 1), 1e-4);
    for (int i = 0; i < 2; ++i) {
        envmap_lobe banks = envmap_lobe_banks(0.7f);
        double s = (double)0.7f, c = i ? 1 : 0, half = acos(s);
        banks.raw = 1;
        banks.p0 = banks.p1 = (float)c;
        double expected = 2 * PI * (half - s * sqrt(1 - s * s)) / ((1 - s) * (1 - s));
        CHECK(reference(&dst, &src, banks) == ENVMAP_OK);
        FIGURE(i ? "raw Banks at c = 1: relative to pi"
                 : "raw Banks at c = 0: relative to the ring's",
               furnace_error(&dst, i ? PI : expected), 3e-4);
    }
    envmap_free(&src);
    envmap_free(&dst);
}

static void radiance_at_the_edge_of_a_float_does_not_overflow(void) {
    static const float N[3] = {0, 10, 1e6f};
    envmap src = black(ENVMAP_CUBE, 8, 1, 1), dst = black(ENVMAP_ANGULAR, 4, 1, 1);
    for (int n = 0; n < 3; ++n)
        for (int e = 0; e < 3; ++e) {
            static const float edge[3] = {3.3e38f, 65504, 1e-38f};
            double worst = 0;
            for (size_t i = 0; i < floats_of(&src); ++i) src.texels[i] = edge[e];
            CHECK(reference(&dst, &src, envmap_lobe_phong(N[n])) == ENVMAP_OK);
            for (size_t i = 0; i < floats_of(&dst); ++i) {
                double error = fabs((double)dst.texels[i] / (double)edge[e] - 1);
                if (!(error <= worst)) worst = error;
            }
            CHECK(worst <= 3e-7);
        }
    envmap_free(&src);
    envmap_free(&dst);
}

/* ------------------------------------------------------------------------------- symmetries ----
 */

/* map(d) = source(R^-1 d), R a quarter turn about an axis: a cube's texels fall onto texels. */
static void turn(envmap *map, const envmap *source, int axis) {
    int n = map->size, a = (axis + 1) % 3, b = (axis + 2) % 3;
    for (int i = 0; i < 6 * n * n; ++i) {
        double d[3], e[3], u, v;
        int face;
        float *texel = texel_of(d, map, i);
        e[axis] = d[axis], e[a] = d[b], e[b] = -d[a];
        oracle_coordinates(&face, &u, &v, ENVMAP_CUBE, e);
        memcpy(texel, envmap_texel(source, 0, 0, face, (int)(u * n), (int)(v * n)),
               3 * sizeof(float));
    }
}

static void turning_the_source_by_90_degrees_turns_the_result(void) {
    static const o_lobe lobes[4] = {{O_PHONG, 1}, {O_PHONG, 30}, {O_BANKS, 0.5}, {O_PHONG, 2000}};
    envmap src = noise(ENVMAP_CUBE, 16, 11), turned = black(ENVMAP_CUBE, 16, 1, 1);
    envmap a = black(ENVMAP_CUBE, 6, 1, 1), b = black(ENVMAP_CUBE, 6, 1, 1);
    envmap c = black(ENVMAP_CUBE, 6, 1, 1);
    for (int i = 0; i < 4; ++i) {
        double worst = 0;
        char what[96];
        CHECK(reference(&a, &src, lobe_of(lobes[i])) == ENVMAP_OK);
        for (int axis = 0; axis < 3; ++axis) {
            turn(&turned, &src, axis);
            CHECK(worst_of_two(&turned, &src) > 0.1);
            CHECK(reference(&b, &turned, lobe_of(lobes[i])) == ENVMAP_OK);
            turn(&c, &a, axis);
            double off = worst_of_two(&b, &c);
            if (!(off <= worst)) worst = off;
        }
        snprintf(what, sizeof what, "turned by 90 degrees about x, y, z, %s", name_of(lobes[i]));
        /* Below a texel's width (N = 2000 here) the quadrature's circles do not turn along. */
        FIGURE(what, worst, i == 3 ? 5e-4 : 1e-6);
    }
    envmap_free(&src);
    envmap_free(&turned);
    envmap_free(&a);
    envmap_free(&b);
    envmap_free(&c);
}

static void the_result_of_a_sum_is_the_sum_of_the_results(void) {
    static const o_lobe lobes[3] = {{O_PHONG, 10}, {O_BANKS, 0.5}, {O_PHONG, 1e5}};
    envmap a = noise(ENVMAP_LATLONG, 12, 21), b = noise(ENVMAP_LATLONG, 12, 22);
    envmap both = black(ENVMAP_LATLONG, 12, 1, 1), out[3];
    for (size_t i = 0; i < floats_of(&a); ++i) {
        a.texels[i] = ldexpf(floorf(ldexpf(a.texels[i], 10)), -10); /* sums of these are exact */
        b.texels[i] = ldexpf(floorf(ldexpf(b.texels[i], 10)), -5);
        both.texels[i] = a.texels[i] + b.texels[i];
    }
    for (int i = 0; i < 3; ++i) out[i] = black(ENVMAP_PARABOLOID, 6, 1, 1);
    double worst = 0;
    for (int n = 0; n < 3; ++n) {
        CHECK(reference(&out[0], &a, lobe_of(lobes[n])) == ENVMAP_OK);
        CHECK(reference(&out[1], &b, lobe_of(lobes[n])) == ENVMAP_OK);
        CHECK(reference(&out[2], &both, lobe_of(lobes[n])) == ENVMAP_OK);
        for (size_t i = 0; i < floats_of(&out[0]); ++i) {
            double sum = (double)out[0].texels[i] + (double)out[1].texels[i];
            double error = fabs((double)out[2].texels[i] - sum) / (sum + 1e-3);
            if (!(error <= worst)) worst = error;
        }
    }
    FIGURE("superposition: relative", worst, 1.5e-7);
    for (int i = 0; i < 3; ++i) envmap_free(&out[i]);
    envmap_free(&a);
    envmap_free(&b);
    envmap_free(&both);
}

/* A filter is an average: nothing leaves the range of the source. */
static void a_normalised_result_stays_between_the_darkest_and_the_brightest_texel(void) {
    static const float N[4] = {0, 20, 300, 1e9f};
    for (int m = 0; m < MAPPINGS; ++m) {
        envmap src = noise(m, 8, 31), dst = black(ENVMAP_CUBE, 4, 1, 1);
        for (size_t i = 0; i < floats_of(&src); ++i) src.texels[i] = 5 + src.texels[i];
        for (int n = 0; n < 4; ++n) {
            CHECK(reference(&dst, &src, envmap_lobe_phong(N[n])) == ENVMAP_OK);
            for (size_t i = 0; i < floats_of(&dst); ++i)
                CHECK(dst.texels[i] >= 5 - 2e-6f && dst.texels[i] <= 6 + 2e-6f);
        }
        envmap_free(&src);
        envmap_free(&dst);
    }
}

/* ------------------------------------------------------------------------------ limits of N ----
 */

/* Steps of 5 % in N, across sigma = 2 texels and sigma = 1 texel: where the result jumps, one
   step stands out against the two beside it. */
static void results_are_continuous_in_the_exponent(void) {
    enum { STEPS = 90, AXES = 8 };
    static const int mappings[3] = {ENVMAP_CUBE, ENVMAP_LATLONG, ENVMAP_PARABOLOID};
    static float seen[STEPS][AXES * 3];
    for (int m = 0; m < 3; ++m) {
        envmap src = noise(mappings[m], 16, 41), dst = black(ENVMAP_PARABOLOID, 2, 1, 1);
        double worst = 0, largest = 0;
        for (int i = 0; i < STEPS; ++i) {
            double N = 4 * pow(10, 1.9 * i / (STEPS - 1));
            CHECK(reference(&dst, &src, envmap_lobe_phong((float)N)) == ENVMAP_OK);
            memcpy(seen[i], dst.texels, sizeof seen[i]);
        }
        for (int i = 1; i + 2 < STEPS; ++i)
            for (int j = 0; j < AXES * 3; ++j) {
                double before = fabs((double)seen[i][j] - (double)seen[i - 1][j]);
                double step = fabs((double)seen[i + 1][j] - (double)seen[i][j]);
                double after = fabs((double)seen[i + 2][j] - (double)seen[i + 1][j]);
                double jump = step - (before > after ? before : after);
                if (step > largest) largest = step;
                if (jump > worst) worst = jump;
            }
        char what[96];
        snprintf(what, sizeof what, "%s 16, N = 4 .. 318: largest jump (largest step %.1e)",
                 oracle_name[mappings[m]], largest);
        FIGURE(what, worst, 1e-4);
        envmap_free(&src);
        envmap_free(&dst);
    }
}

static void exponents_towards_infinity_give_the_bilinear_mirror(void) {
    /* of even size, for axes off the points where a rim or a pole has no bilinear radiance */
    for (int m = 0; m < MAPPINGS; ++m) {
        envmap src = noise(m, 11, 51), dst = black(ENVMAP_CUBE, 4, 1, 1);
        double error[3] = {0, 0, 0};
        for (int n = 0; n < 3; ++n) {
            static const float N[3] = {1e7f, 1e8f, 1e9f};
            CHECK(reference(&dst, &src, envmap_lobe_phong(N[n])) == ENVMAP_OK);
            float *texel;
            double axis[3];
            for (int i = 0; (texel = texel_of(axis, &dst, i)) != NULL; ++i) {
                float d[3] = {(float)axis[0], (float)axis[1], (float)axis[2]}, rgb[3];
                envmap_lookup(rgb, &src, d, 0);
                for (int c = 0; c < 3; ++c) {
                    double off = fabs((double)texel[c] - (double)rgb[c]);
                    if (!(off <= error[n])) error[n] = off;
                }
            }
        }
        printf("    %-11s N = 1e7, 1e8, 1e9: %.2e %.2e %.2e from the bilinear lookup\n",
               oracle_name[m], error[0], error[1], error[2]);
        CHECK(error[2] <= 1e-4);
        CHECK(error[2] <= 0.5 * error[1] + 2e-6);
        envmap_free(&src);
        envmap_free(&dst);
    }
    /* at a texel's centre that is the texel, but for sigma/texel = 3e-4 of its slopes: bilinear
       radiance has a ridge there */
    envmap src = noise(ENVMAP_CUBE, 8, 52), dst = black(ENVMAP_CUBE, 8, 1, 1);
    CHECK(reference(&dst, &src, envmap_lobe_phong(1e9f)) == ENVMAP_OK);
    FIGURE("N = 1e9 from a cube to itself: off by", worst_of_two(&dst, &src), 6e-4);
    envmap_free(&src);
    envmap_free(&dst);
}

static void exponents_towards_0_give_the_hemisphere(void) {
    envmap src = noise(ENVMAP_CUBE, 16, 61),
           dst[2] = {black(ENVMAP_CUBE, 3, 1, 1), black(ENVMAP_CUBE, 3, 1, 1)};
    static const float N[3] = {1e-2f, 1e-4f, 1e-6f};
    double error[3];
    CHECK(reference(&dst[0], &src, envmap_lobe_phong(0)) == ENVMAP_OK);
    for (int i = 0; i < 3; ++i) {
        CHECK(reference(&dst[1], &src, envmap_lobe_phong(N[i])) == ENVMAP_OK);
        error[i] = worst_of_two(&dst[0], &dst[1]);
    }
    printf("    N = 1e-2, 1e-4, 1e-6: %.2e %.2e %.2e from N = 0\n", error[0], error[1], error[2]);
    CHECK(error[0] > error[1] && error[0] <= 1e-2);
    FIGURE("N = 1e-6 from N = 0", error[2], 1e-6);
    /* and light from behind adds nothing */
    envmap lamp = black(ENVMAP_CUBE, 16, 1, 1), out = black(ENVMAP_CUBE, 1, 1, 1);
    for (int y = 0; y < 16; ++y)
        for (int x = 0; x < 16; ++x) *envmap_texel(&lamp, 0, 0, 1, x, y) = 1; /* -x */
    CHECK(reference(&out, &lamp, envmap_lobe_phong(0)) == ENVMAP_OK);
    CHECK(*envmap_texel(&out, 0, 0, 0, 0, 0) == 0.0f);
    CHECK_CLOSE(*envmap_texel(&out, 0, 0, 1, 0, 0), 1.0 / 3, 1e-3);
    envmap_free(&src);
    envmap_free(&dst[0]);
    envmap_free(&dst[1]);
    envmap_free(&lamp);
    envmap_free(&out);
}

/* ----------------------------------------------------------------------------------- slices ----
 */

static void slices_hold_the_parameter_at_their_centres(void) {
    envmap src = noise(ENVMAP_CUBE, 16, 71), dst = black(ENVMAP_CUBE, 2, 1, 4);
    envmap one = black(ENVMAP_CUBE, 2, 1, 1);
    envmap_lobe banks = envmap_lobe_banks(0.4f);
    dst.p0 = 7;
    dst.p1 = 8;
    CHECK(reference(&dst, &src, banks) == ENVMAP_OK);
    CHECK(dst.p0 == -1.0f && dst.p1 == 1.0f);
    for (int k = 0; k < 4; ++k) {
        envmap_lobe single = banks;
        single.p0 = single.p1 = -0.75f + 0.5f * (float)k;
        CHECK(reference(&one, &src, single) == ENVMAP_OK);
        const float *slice = envmap_texel(&dst, 0, k, 0, 0, 0);
        for (size_t i = 0; i < floats_of(&one); ++i) CHECK_CLOSE(slice[i], one.texels[i], 1e-6);
    }
    /* a lookup at a slice's centre is that slice */
    for (int k = 0; k < 4; ++k) {
        double axis[3];
        texel_of(axis, &dst, 5);
        float d[3] = {(float)axis[0], (float)axis[1], (float)axis[2]}, rgb[3];
        envmap_lookup_slice(rgb, &dst, d, -0.75f + 0.5f * (float)k, 0);
        CHECK_CLOSE(rgb[1], envmap_texel(&dst, 0, k, 1, 1, 0)[1], 1e-5);
    }
    envmap_free(&src);
    envmap_free(&dst);
    envmap_free(&one);
}

static void a_lobe_without_parameter_fills_every_slice_alike(void) {
    envmap src = noise(ENVMAP_LATLONG, 8, 72), dst = black(ENVMAP_PARABOLOID, 5, 1, 3);
    static const o_lobe lobes[3] = {{O_PHONG, 10}, {O_GGX, 0.5}, {O_PHONG, 1e6}};
    for (int i = 0; i < 3; ++i) {
        CHECK(reference(&dst, &src, lobe_of(lobes[i])) == ENVMAP_OK);
        size_t n = oracle_floats(ENVMAP_PARABOLOID, 5, 1, 0);
        CHECK(!memcmp(dst.texels, dst.texels + n, n * sizeof(float)));
        CHECK(!memcmp(dst.texels, dst.texels + 2 * n, n * sizeof(float)));
        CHECK(dst.texels[7] > 0);
    }
    envmap_lobe mirror = envmap_lobe_mirror();
    CHECK(envmap_filter(&dst, &src, &mirror, NULL) == ENVMAP_OK);
    size_t n = oracle_floats(ENVMAP_PARABOLOID, 5, 1, 0);
    CHECK(!memcmp(dst.texels, dst.texels + 2 * n, n * sizeof(float)));
    envmap_free(&src);
    envmap_free(&dst);
}

/* ------------------------------------------------------------------------------------- rims ----
 */

/* Corner texels: a paraboloid's hold the other hemisphere as seen from this face; on sphere and
   angular maps they hold the rim's one direction. */
static void texels_outside_a_rim_hold_the_extended_domain_or_the_rim(void) {
    static const int discs[3] = {ENVMAP_PARABOLOID, ENVMAP_SPHERE, ENVMAP_ANGULAR};
    envmap src = noise(ENVMAP_CUBE, 16, 81);
    o_lobe lobe = {O_PHONG, 5};
    o_source source;
    o_source_make(&source, &src);
    for (int m = 0; m < 3; ++m) {
        envmap dst = black(discs[m], 8, 1, 1);
        int outside = 0;
        CHECK(reference(&dst, &src, lobe_of(lobe)) == ENVMAP_OK);
        for (int face = 0; face < envmap_faces(discs[m]); ++face)
            for (int i = 0; i < 64; ++i) {
                double X = (i % 8 + 0.5) / 4 - 1, Y = 1 - (i / 8 + 0.5) / 4, r = X * X + Y * Y;
                double d[3] = {0, 0, discs[m] == ENVMAP_SPHERE ? -1 : 1}, rgb[3];
                if (r <= 1) continue;
                if (discs[m] == ENVMAP_PARABOLOID) {
                    d[0] = 2 * X / (1 + r);
                    d[1] = 2 * Y / (1 + r);
                    d[2] = (face ? -1 : 1) * (1 - r) / (1 + r);
                    CHECK(face ? d[2] > 0 : d[2] < 0);
                }
                o_sum(rgb, &source, lobe, 0, d, 0);
                const float *texel = envmap_texel(&dst, 0, 0, face, i % 8, i / 8);
                for (int c = 0; c < 3; ++c) CHECK_CLOSE(texel[c], rgb[c], 1e-6);
                ++outside;
            }
        CHECK(outside > 4);
        envmap_free(&dst);
    }
    o_source_free(&source);
    envmap_free(&src);
}

/* A source's texels outside its rim weigh nothing. */
static void a_lamp_outside_a_rim_lights_nothing(void) {
    static const int discs[3] = {ENVMAP_PARABOLOID, ENVMAP_SPHERE, ENVMAP_ANGULAR};
    for (int m = 0; m < 3; ++m) {
        envmap src = black(discs[m], 16, 1, 1), dst = black(ENVMAP_CUBE, 4, 1, 1);
        *envmap_texel(&src, 0, 0, 0, 0, 0) = 1e6f;
        *envmap_texel(&src, 0, 0, 0, 15, 1) = 1e6f;
        CHECK(reference(&dst, &src, envmap_lobe_phong(1)) == ENVMAP_OK);
        CHECK(all_are(&dst, 0));
        envmap_free(&src);
        envmap_free(&dst);
    }
}

static void brdf_of_one(double f[3], const double v[3], const double l[3], void *user) {
    (void)v, (void)l, (void)user;
    f[0] = f[1] = f[2] = 1;
}

/* -------------------------------------------------------------------------------- executors ----
 */

static void results_are_the_same_bits_for_any_executor(void) {
    static const struct {
        int src, dst, slices;
        o_lobe lobe;
    } cases[] = {{ENVMAP_CUBE, ENVMAP_LATLONG, 1, {O_PHONG, 50}},
                 {ENVMAP_PARABOLOID, ENVMAP_CUBE, 3, {O_BANKS, 0.7}},
                 {ENVMAP_LATLONG, ENVMAP_ANGULAR, 1, {O_PHONG, 300}},
                 {ENVMAP_CUBE, ENVMAP_SPHERE, 1, {O_PHONG, 1e6}}};
    for (int method = 0; method < 2; ++method) /* auto, reference */
        for (size_t i = 0; i < sizeof cases / sizeof *cases; ++i) {
            envmap src = noise(cases[i].src, 12, 91);
            envmap dst = black(cases[i].dst, 4, 1, cases[i].slices);
            envmap_lobe lobe = lobe_of(cases[i].lobe);
            check_executors(&dst, &src, &lobe, 1, desc_of(method, 0));
            envmap_free(&src);
            envmap_free(&dst);
        }
}

/* Runs every task but each `leaves`-th, from the run numbered `from` on. */
typedef struct idler {
    int leaves, from, runs;
} idler;

static void idler_run(void *user, envmap_task *task, void *context, int count) {
    idler *idle = (idler *)user;
    int idles = idle->runs++ >= idle->from;
    for (int i = 0; i < count; ++i)
        if (!idles || i % idle->leaves) task(context, i);
}

static void an_executor_that_leaves_tasks_out_is_refused_by_every_call(void) {
    envmap src = smooth(ENVMAP_CUBE, 16), dst = black(ENVMAP_CUBE, 16, 1, 1);
    envmap_lobe lobe = envmap_lobe_diffuse();
    envmap_prepared prepared = {NULL, NULL};
    envmap_plan plan;
    envmap_fit fit;
    envmap_frame frame = {{0, 0, 1}, {1, 0, 0}, {0, 0, 1}};
    envmap_brdf brdf = {brdf_of_one, NULL};
    double sh[12];
    float numbers[8];
    memset(&fit, 0, sizeof fit), fill(&dst, -7);
    for (int leaves = 1; leaves <= 3; leaves += 2) {
        idler idle = {leaves, 0, 0};
        envmap_filter_desc desc = desc_of(ENVMAP_METHOD_AUTO, 0);
        desc.work.executor.user = &idle, desc.work.executor.run = idler_run;
        const envmap_work *work = &desc.work;
        for (desc.method = 0; desc.method < ENVMAP_METHOD_COUNT; ++desc.method)
            CHECK(envmap_filter(&dst, &src, &lobe, &desc) == ENVMAP_ERROR_ARGUMENT);
        desc.method = ENVMAP_METHOD_AUTO;
        CHECK(envmap_prepare(&prepared, &src, &lobe, 1, &desc) == ENVMAP_ERROR_ARGUMENT);
        CHECK(envmap_filter_plan(&plan, &dst, &src, &lobe, &desc) == ENVMAP_ERROR_ARGUMENT);
        CHECK(envmap_sh_project(sh, 2, &src, 0, 0, work) == ENVMAP_ERROR_ARGUMENT);
        CHECK(envmap_sh_fill(&dst, 0, 0, sh, 2, 0, work) == ENVMAP_ERROR_ARGUMENT);
        CHECK(envmap_radiance(numbers, &src, &brdf, &frame, 1, work) == ENVMAP_ERROR_ARGUMENT);
        CHECK(envmap_fit_brdf(&fit, &brdf, work) == ENVMAP_ERROR_ARGUMENT);
        CHECK(envmap_ggx_table(numbers, 2, work) == ENVMAP_ERROR_ARGUMENT);
    }
    CHECK(all_are(&dst, -7) && prepared.state == NULL && fit.table == NULL);
    envmap_free(&src), envmap_free(&dst);
}

/* One that begins to idle later, when the call is under way. */
static void tasks_that_an_executor_leaves_out_later_are_run_all_the_same(void) {
    envmap src = noise(ENVMAP_LATLONG, 32, 5), dst = black(ENVMAP_CUBE, 40, 1, 1);
    envmap serial = black(ENVMAP_CUBE, 40, 1, 1);
    envmap_lobe lobe = envmap_lobe_phong(20);
    for (int from = 1; from < 40; ++from) {
        idler idle = {1 + from % 3, from, 0};
        envmap_filter_desc desc = desc_of(from % ENVMAP_METHOD_COUNT, 0);
        CHECK(envmap_filter(&serial, &src, &lobe, &desc) == ENVMAP_OK);
        desc.work.executor.user = &idle, desc.work.executor.run = idler_run;
        CHECK(envmap_filter(&dst, &src, &lobe, &desc) == ENVMAP_OK && same_bits(&dst, &serial));
    }
    envmap_free(&src), envmap_free(&dst), envmap_free(&serial);
}

/* --------------------------------------------------------------------------------- progress ----
 */

static void progress_grows_and_ends_at_1(void) {
    for (int n = 0; n < 3; ++n) {
        envmap src = noise(ENVMAP_CUBE, 16, 101), dst = black(ENVMAP_CUBE, 16, 3, 2);
        envmap_lobe lobes[3] = {n == 1 ? envmap_lobe_mirror() : envmap_lobe_phong(10),
                                envmap_lobe_banks(0.5f), envmap_lobe_phong(1)};
        watch w = {0, 0, 0, 0};
        envmap_filter_desc desc;
        memset(&desc, 0, sizeof desc);
        desc.work.progress.user = &w;
        desc.work.progress.report = watch_report;
        CHECK(envmap_filter_chain(&dst, &src, lobes, n == 2 ? 3 : 1, &desc) == ENVMAP_OK);
        CHECK(w.disorder == 0);
        CHECK(w.last == 1.0f);
        CHECK(n == 1 || w.calls >= 3);
        envmap_free(&src);
        envmap_free(&dst);
    }
}

static void a_cancelled_filter_leaves_its_result_untouched(void) {
    envmap src = noise(ENVMAP_CUBE, 12, 102), dst = black(ENVMAP_CUBE, 8, 2, 2);
    envmap_lobe lobes[2] = {envmap_lobe_banks(0.5f), envmap_lobe_phong(1)};
    CHECK(check_cancelling(&dst, &src, lobes, 2, desc_of(ENVMAP_METHOD_AUTO, 0)) >= 3);
    CHECK(dst.texels[0] > 0);
    envmap_free(&src);
    envmap_free(&dst);
}

/* -------------------------------------------------------------------------------- bad input ----
 */

static void bad_arguments_are_refused(void) {
    envmap src = noise(ENVMAP_CUBE, 4, 111), dst = black(ENVMAP_CUBE, 4, 1, 1);
    envmap_lobe lobe = envmap_lobe_phong(10);
    envmap_filter_desc desc;
    fill(&dst, -7);
    CHECK(envmap_filter(NULL, &src, &lobe, NULL) == ENVMAP_ERROR_ARGUMENT);
    CHECK(envmap_filter(&dst, NULL, &lobe, NULL) == ENVMAP_ERROR_ARGUMENT);
    CHECK(envmap_filter(&dst, &src, NULL, NULL) == ENVMAP_ERROR_ARGUMENT);
    CHECK(envmap_filter(&dst, &dst, &lobe, NULL) == ENVMAP_ERROR_ARGUMENT);
    envmap alias = dst; /* another map, the same texels */
    CHECK(envmap_filter(&dst, &alias, &lobe, NULL) == ENVMAP_ERROR_ARGUMENT);
    for (int i = 0; i < 8; ++i) {
        envmap bad = src;
        if (i == 0) bad.texels = NULL;
        if (i == 1) bad.size = 0;
        if (i == 2) bad.size = -4;
        if (i == 3) bad.levels = 0;
        if (i == 4) bad.slices = 0;
        if (i == 5) bad.mapping = ENVMAP_MAPPING_COUNT;
        if (i == 6) bad.mapping = -1;
        if (i == 7) bad.levels = 4; /* more than a size of 4 has */
        CHECK(envmap_filter(&dst, &bad, &lobe, NULL) == ENVMAP_ERROR_ARGUMENT);
        CHECK(envmap_filter(&bad, &src, &lobe, NULL) == ENVMAP_ERROR_ARGUMENT);
    }
    for (int i = 0; i < 7; ++i) {
        memset(&desc, 0, sizeof desc);
        if (i == 0) desc.method = -1;
        if (i == 1) desc.method = ENVMAP_METHOD_COUNT;
        if (i == 2) desc.method = 0x7fffffff;
        if (i == 3) desc.tolerance = -1e-3f;
        if (i == 4) desc.tolerance = NAN;
        if (i == 5) desc.threshold = NAN;
        if (i == 6) desc.tolerance = INFINITY;
        CHECK(envmap_filter(&dst, &src, &lobe, &desc) == ENVMAP_ERROR_ARGUMENT);
    }
    CHECK(all_are(&dst, -7));
    envmap_free(&src);
    envmap_free(&dst);
}

static void radiance_that_is_not_finite_is_refused_by_every_method(void) {
    static const float bad[3] = {NAN, INFINITY, -INFINITY};
    for (int m = 0; m < MAPPINGS; ++m)
        for (int i = 0; i < 3; ++i) {
            envmap src = noise(m, 6, 112), dst = black(ENVMAP_CUBE, 2, 1, 1);
            envmap_lobe lobe = envmap_lobe_phong(10), mirror = envmap_lobe_mirror();
            envmap_filter_desc desc;
            memset(&desc, 0, sizeof desc);
            envmap_texel(&src, 0, 0, envmap_faces(m) - 1, 3, 2)[2] = bad[i];
            for (int method = 0; method < 2; ++method) {
                desc.method = method;
                CHECK(envmap_filter(&dst, &src, &lobe, &desc) == ENVMAP_ERROR_RADIANCE);
                CHECK(envmap_filter(&dst, &src, &mirror, &desc) == ENVMAP_ERROR_RADIANCE);
            }
            CHECK(all_are(&dst, 0));
            envmap_free(&src);
            envmap_free(&dst);
        }
}

static void negative_radiance_is_for_the_reference_alone(void) {
    envmap src = noise(ENVMAP_CUBE, 6, 113), dst = black(ENVMAP_CUBE, 2, 1, 1);
    envmap_lobe lobe = envmap_lobe_phong(1);
    envmap_texel(&src, 0, 0, 5, 3, 2)[2] = -1e-3f;
    CHECK(envmap_filter(&dst, &src, &lobe, NULL) == ENVMAP_ERROR_RADIANCE);
    CHECK(dst.texels[0] == 0.0f);
    CHECK(reference(&dst, &src, lobe) == ENVMAP_OK);
    CHECK(dst.texels[0] > 0);
    for (size_t i = 0; i < floats_of(&src); ++i) src.texels[i] = -src.texels[i];
    CHECK(reference(&dst, &src, lobe) == ENVMAP_OK);
    CHECK(dst.texels[0] < 0);
    envmap_free(&src);
    envmap_free(&dst);
}

static double nan_in_one_place(double x, double p, void *user) {
    (void)p;
    return x > *(double *)user - 1e-9 && x < *(double *)user + 1e-9 ? (double)NAN : 1;
}

static void a_callback_that_fails_fails_the_filter(void) {
    envmap src = noise(ENVMAP_CUBE, 4, 114), dst = black(ENVMAP_CUBE, 2, 1, 1);
    double a[3], b[3];
    texel_of(a, &dst, 7);
    texel_of(b, &src, 40);
    double x = a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; /* no quadrature will meet this one */
    CHECK(reference(&dst, &src, envmap_lobe_function(nan_near_the_axis, NULL)) ==
          ENVMAP_ERROR_LOBE);
    CHECK(reference(&dst, &src, envmap_lobe_function(nan_in_one_place, &x)) == ENVMAP_ERROR_LOBE);
    CHECK(all_are(&dst, 0));
    envmap_free(&src);
    envmap_free(&dst);
}

static void out_of_memory_leaks_nothing_and_touches_nothing(void) {
    envmap src = noise(ENVMAP_CUBE, 6, 115), dst = black(ENVMAP_PARABOLOID, 8, 2, 3);
    envmap_lobe lobes[2] = {envmap_lobe_banks(0.5f), envmap_lobe_phong(1e5f)};
    for (int method = 0; method < 2; ++method) /* auto, reference */
        CHECK(check_starving(&dst, &src, lobes, 2, desc_of(method, 0)) >= 1);
    envmap_free(&src);
    envmap_free(&dst);
    /* one lobe into one slice: sums of few texels go straight into dst */
    for (int mapping = 0; mapping < ENVMAP_MAPPING_COUNT; ++mapping) {
        envmap sky = noise((envmap_mapping)mapping, 24, 3), out = black(ENVMAP_LATLONG, 6, 1, 1);
        CHECK(check_starving(&out, &sky, lobes + 1, 1, desc_of(0, 0)) >= 5);
        envmap_free(&sky);
        envmap_free(&out);
    }
}

/* --------------------------------------------------------------------------- mirror and chain ----
 */

static void the_mirror_lobe_is_resampling(void) {
    for (int m = 0; m < MAPPINGS * MAPPINGS; ++m) {
        envmap src = noise(m / MAPPINGS, 9, 121), a = black(m % MAPPINGS, 5, 1, 1),
               b = black(m % MAPPINGS, 5, 1, 1);
        envmap_lobe mirror = envmap_lobe_mirror();
        CHECK(envmap_filter(&a, &src, &mirror, NULL) == ENVMAP_OK);
        CHECK(envmap_resample(&b, &src, NULL) == ENVMAP_OK);
        CHECK(!memcmp(a.texels, b.texels, floats_of(&a) * sizeof(float)));
        CHECK(a.texels[0] > 0);
        envmap_free(&src);
        envmap_free(&a);
        envmap_free(&b);
    }
}

static void a_chain_is_its_filters_level_by_level(void) {
    envmap src = noise(ENVMAP_LATLONG, 10, 122), dst = black(ENVMAP_CUBE, 13, 4, 2);
    envmap_lobe lobes[4] = {envmap_lobe_mirror(), envmap_lobe_phong(500), envmap_lobe_banks(0.3f),
                            envmap_lobe_diffuse()};
    CHECK(envmap_filter_chain(&dst, &src, lobes, 4, NULL) == ENVMAP_OK);
    for (int level = 0; level < 4; ++level) {
        envmap one = black(ENVMAP_CUBE, oracle_edge(13, level), 1, 2);
        CHECK(envmap_filter(&one, &src, &lobes[level], NULL) == ENVMAP_OK);
        CHECK(!memcmp(one.texels, envmap_texel(&dst, level, 0, 0, 0, 0),
                      floats_of(&one) * sizeof(float)));
        envmap_free(&one);
    }
    /* fewer lobes than levels: the rest stays */
    fill(&dst, -7);
    CHECK(envmap_filter_chain(&dst, &src, lobes, 2, NULL) == ENVMAP_OK);
    CHECK(*envmap_texel(&dst, 1, 1, 5, 5, 5) > 0);
    CHECK(*envmap_texel(&dst, 2, 0, 0, 0, 0) < -6);
    CHECK(*envmap_texel(&dst, 3, 1, 5, 0, 0) < -6);
    envmap_free(&src);
    envmap_free(&dst);
}

static void a_chain_writes_all_its_levels_or_none(void) {
    envmap src = noise(ENVMAP_CUBE, 4, 123), dst = black(ENVMAP_CUBE, 4, 2, 1);
    envmap_lobe lobes[3] = {envmap_lobe_phong(10), envmap_lobe_phong(-1), envmap_lobe_phong(1)};
    CHECK(envmap_filter_chain(&dst, &src, lobes, 0, NULL) == ENVMAP_ERROR_ARGUMENT);
    CHECK(envmap_filter_chain(&dst, &src, lobes, -1, NULL) == ENVMAP_ERROR_ARGUMENT);
    CHECK(envmap_filter_chain(&dst, &src, lobes, 3, NULL) == ENVMAP_ERROR_ARGUMENT);
    CHECK(envmap_filter_chain(&dst, &src, NULL, 1, NULL) == ENVMAP_ERROR_ARGUMENT);
    CHECK(envmap_filter_chain(&dst, &src, lobes, 2, NULL) == ENVMAP_ERROR_LOBE);
    lobes[1] = envmap_lobe_function(nan_near_the_axis, NULL);
    CHECK(envmap_filter_chain(&dst, &src, lobes, 2, NULL) == ENVMAP_ERROR_LOBE);
    CHECK(all_are(&dst, 0));
    envmap_free(&src);
    envmap_free(&dst);
}

static void filtering_reads_and_writes_level_0_only(void) {
    envmap src = black(ENVMAP_CUBE, 8, 4, 1), dst = black(ENVMAP_CUBE, 4, 3, 1);
    envmap flat = noise(ENVMAP_CUBE, 8, 124), expected = black(ENVMAP_CUBE, 4, 1, 1);
    oracle_noise(&src, 125);
    memcpy(src.texels, flat.texels, floats_of(&flat) * sizeof(float));
    fill(&dst, -7);
    CHECK(reference(&dst, &src, envmap_lobe_phong(20)) == ENVMAP_OK);
    CHECK(reference(&expected, &flat, envmap_lobe_phong(20)) == ENVMAP_OK);
    size_t n = floats_of(&expected);
    CHECK(!memcmp(dst.texels, expected.texels, n * sizeof(float)));
    for (size_t i = n; i < floats_of(&dst); ++i) CHECK(dst.texels[i] < -6);
    envmap_free(&src);
    envmap_free(&dst);
    envmap_free(&flat);
    envmap_free(&expected);
}

/* The default call keeps the default tolerance. */
static void auto_is_within_a_thousandth_of_the_reference(void) {
    static const o_lobe lobes[4] = {{O_PHONG, 1}, {O_PHONG, 60}, {O_GGX, 0.3}, {O_PHONG, 3000}};
    envmap src = smooth(ENVMAP_LATLONG, 16), a = black(ENVMAP_CUBE, 5, 1, 1);
    envmap b = black(ENVMAP_CUBE, 5, 1, 1);
    double worst = 0;
    for (int i = 0; i < 4; ++i) {
        envmap_lobe lobe = lobe_of(lobes[i]);
        envmap_difference d = {0, 0, 0, 0, 9, 9, 9};
        CHECK(envmap_filter(&a, &src, &lobe, NULL) == ENVMAP_OK);
        CHECK(reference(&b, &src, lobe) == ENVMAP_OK);
        CHECK(envmap_compare(&d, &a, &b, 0) == ENVMAP_OK);
        if (!(d.rms <= worst)) worst = d.rms;
    }
    FIGURE("rms of the default call against the reference", worst, 1e-3);
    envmap_free(&src);
    envmap_free(&a);
    envmap_free(&b);
}

int main(void) {
    RUN(filtering_a_harmonic_scales_it_by_the_zonal_coefficient);
    RUN(halving_the_texel_quarters_the_error);
    RUN(the_reference_is_the_sum_over_all_texels);
    RUN(one_lit_texel_shows_the_lobe);
    RUN(a_constant_environment_stays_itself_for_every_lobe_and_mapping);
    RUN(a_constant_environment_under_banks_is_brightest_across_the_view);
    RUN(raw_sums_of_a_constant_environment_are_the_closed_integrals);
    RUN(radiance_at_the_edge_of_a_float_does_not_overflow);
    RUN(turning_the_source_by_90_degrees_turns_the_result);
    RUN(the_result_of_a_sum_is_the_sum_of_the_results);
    RUN(a_normalised_result_stays_between_the_darkest_and_the_brightest_texel);
    RUN(results_are_continuous_in_the_exponent);
    RUN(exponents_towards_infinity_give_the_bilinear_mirror);
    RUN(exponents_towards_0_give_the_hemisphere);
    RUN(slices_hold_the_parameter_at_their_centres);
    RUN(a_lobe_without_parameter_fills_every_slice_alike);
    RUN(texels_outside_a_rim_hold_the_extended_domain_or_the_rim);
    RUN(a_lamp_outside_a_rim_lights_nothing);
    RUN(results_are_the_same_bits_for_any_executor);
    RUN(an_executor_that_leaves_tasks_out_is_refused_by_every_call);
    RUN(tasks_that_an_executor_leaves_out_later_are_run_all_the_same);
    RUN(progress_grows_and_ends_at_1);
    RUN(a_cancelled_filter_leaves_its_result_untouched);
    RUN(bad_arguments_are_refused);
    RUN(radiance_that_is_not_finite_is_refused_by_every_method);
    RUN(negative_radiance_is_for_the_reference_alone);
    RUN(a_callback_that_fails_fails_the_filter);
    RUN(out_of_memory_leaks_nothing_and_touches_nothing);
    RUN(the_mirror_lobe_is_resampling);
    RUN(a_chain_is_its_filters_level_by_level);
    RUN(a_chain_writes_all_its_levels_or_none);
    RUN(filtering_reads_and_writes_level_0_only);
    RUN(auto_is_within_a_thousandth_of_the_reference);
    return test_summary();
}
