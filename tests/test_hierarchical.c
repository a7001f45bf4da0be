/* SPDX-License-Identifier: MIT
   The hierarchical filter: opened everywhere it is the reference; how its error grows with the
   threshold, with a sun and with a lobe too thin for its samples; the rules of every method. */
#define _POSIX_C_SOURCE 200809L
#include "helpers.h"

#include <time.h>

/* ----------------------------------------------------------------------------------- tools -- */

/* Smooth, with a sun of 3x3 texels that are `sun` times as bright. */
static envmap lit(int mapping, int size, float sun) {
    envmap map = black(mapping, size, 1, 1);
    oracle_fill(&map, 0, oracle_smooth);
    for (int i = 0; i < 9; ++i)
        for (int c = 0; c < 3; ++c)
            envmap_texel(&map, 0, 0, 0, size / 3 + i % 3, size / 2 + i / 3)[c] *= sun;
    return map;
}

static envmap_result hierarchical(envmap *dst, const envmap *src, envmap_lobe lobe,
                                  float threshold) {
    envmap_filter_desc desc = desc_of(ENVMAP_METHOD_HIERARCHICAL, 0);
    desc.threshold = threshold;
    return envmap_filter(dst, src, &lobe, &desc);
}

/* Hierarchical against the reference. */
static envmap_difference off(const envmap *src, envmap_lobe lobe, int mapping, int size, int slices,
                             float threshold) {
    envmap a = black(mapping, size, 1, slices), b = black(mapping, size, 1, slices);
    envmap_difference d;
    memset(&d, 0, sizeof d);
    CHECK(hierarchical(&a, src, lobe, threshold) == ENVMAP_OK);
    CHECK(filter(&b, src, lobe, ENVMAP_METHOD_REFERENCE, 0) == ENVMAP_OK);
    CHECK(envmap_compare(&d, &a, &b, 0) == ENVMAP_OK);
    envmap_free(&a);
    envmap_free(&b);
    return d;
}

static double ring_and_peak(double x, double p, void *user) {
    (void)user;
    return 0.3 * exp(-20 * (x - p) * (x - p)) + (x > 0 ? x * x : 0);
}

static float triangle[2][64];

/* One of every kind, none thinner than two texels of a 32 x 32 cube face; Banks, the function and
   the table have slices. */
static envmap_lobe lobe_number(int i) {
    envmap_lobe lobe = envmap_lobe_function(ring_and_peak, NULL);
    lobe.p0 = -0.5f, lobe.p1 = 0.5f;
    for (int n = 0; n < 64; ++n) {
        triangle[0][n] = n < 24 ? 1 - (float)n / 24 : 0;
        triangle[1][n] = n < 40 ? 3 - 3 * (float)n / 40 : 0;
    }
    switch (i) {
    case 0: return envmap_lobe_diffuse();
    case 1: return envmap_lobe_phong(0);
    case 2: return envmap_lobe_phong(0.5f);
    case 3: return envmap_lobe_phong(2.5f);
    case 4: return envmap_lobe_phong(10);
    case 5: return envmap_lobe_phong(50);
    case 6: return envmap_lobe_gaussian(0);
    case 7: return envmap_lobe_gaussian(3);
    case 8: return envmap_lobe_gaussian(40);
    case 9: return envmap_lobe_ggx(1);
    case 10: return envmap_lobe_ggx(0.35f);
    case 11: return envmap_lobe_banks(0);
    case 12: return envmap_lobe_banks(0.8f);
    case 13: return lobe;
    default: return envmap_lobe_table(triangle[0], 64, 2, -1, 1);
    }
}

#define LOBES 15

/* ------------------------------------------------------------------------------- the result -- */

static void opened_everywhere_it_is_the_reference(void) {
    double worst = 0;
    for (int i = 0; i < LOBES; ++i)
        for (int raw = 0; raw < 2; ++raw) {
            envmap src = noise(ENVMAP_CUBE, 32, 11);
            envmap_lobe lobe = lobe_number(i);
            lobe.raw = raw, lobe.scale = raw ? 0.7f : 1.0f;
            envmap_difference d = off(&src, lobe, ENVMAP_PARABOLOID, 4, 3, -1);
            if (!(d.worst <= worst)) worst = d.worst;
            if (!(d.worst <= 1e-6)) printf("    lobe %d, raw %d: worst %.2e\n", i, raw, d.worst);
            envmap_free(&src);
        }
    FIGURE("opened everywhere, every lobe: worst texel", worst, 1e-6);
}

static void it_knows_every_parameterization_and_odd_sizes(void) {
    static const int sizes[6] = {20, 21, 32, 33, 37, 48};
    double opened = 0, tents = 0, coarse = 0;
    for (int m = 0; m < MAPPINGS; ++m)
        for (int s = 0; s < 6; ++s) {
            envmap src = noise(m, sizes[s], 12);
            envmap_difference d = off(&src, envmap_lobe_phong(4), (m + s) % MAPPINGS, 5, 1, -1);
            /* the texels at the rims of sphere and angular map are wider than half the lobe: there
               the reference spreads them */
            double *worst = m == ENVMAP_SPHERE || m == ENVMAP_ANGULAR ? &tents : &opened;
            if (!(d.worst <= *worst)) *worst = d.worst;
            envmap_free(&src);
            src = lit(m, sizes[s], 1);
            d = off(&src, envmap_lobe_phong(4), (m + s) % MAPPINGS, 5, 1, 0);
            if (!(d.rms <= coarse)) coarse = d.rms;
            envmap_free(&src);
        }
    FIGURE("odd sizes, cube, paraboloid, lat-long opened everywhere: worst", opened, 1e-6);
    FIGURE("odd sizes, sphere and angular map opened everywhere: worst", tents, 0.1);
    FIGURE("odd sizes, all mappings, threshold 0.001, a smooth scene: rms", coarse, 4e-3);
}

static void its_error_grows_with_the_threshold(void) {
    static const float thresholds[6] = {-1, 1e-6f, 1e-4f, 1e-3f, 1e-2f, 1e-1f};
    envmap src = lit(ENVMAP_CUBE, 32, 30);
    for (int i = 0; i < 2; ++i) {
        double last = 0;
        printf("    Phong %d: rms", i ? 50 : 10);
        for (int t = 0; t < 6; ++t) {
            envmap_difference d =
                off(&src, envmap_lobe_phong(i ? 50 : 10), ENVMAP_CUBE, 12, 1, thresholds[t]);
            printf(" %.1e (%g)", d.rms, (double)thresholds[t]);
            CHECK(t > 0 || d.rms < 1e-6);
            CHECK(d.rms >= 0.8 * last);
            last = d.rms;
        }
        printf("\n");
        CHECK(last > 1e-3);
    }
    envmap_free(&src);
}

/* Two values, 0.15 apart: where children differ at all, one is at least 0.075 from their mean. */
static double two_values(double x, double p, void *user) {
    (void)p, (void)user;
    return x > 0.4 ? 1 : 0.85;
}

static void what_differs_by_more_than_the_threshold_is_opened(void) {
    static const float thresholds[3] = {0.01f, 0.074f, 0.076f};
    envmap src = noise(ENVMAP_CUBE, 32, 9), dst[3];
    for (int i = 0; i < 3; ++i) {
        dst[i] = black(ENVMAP_CUBE, 6, 1, 1);
        CHECK(hierarchical(dst + i, &src, envmap_lobe_function(two_values, NULL), thresholds[i]) ==
              ENVMAP_OK);
    }
    CHECK(same_bits(&dst[0], &dst[1]) && !same_bits(&dst[1], &dst[2]));
    envmap_free(&src);
    for (int i = 0; i < 3; ++i) envmap_free(dst + i);
}

static void zero_is_a_threshold_of_a_thousandth(void) {
    envmap src = noise(ENVMAP_PARABOLOID, 24, 13), a = black(ENVMAP_CUBE, 6, 1, 1), b = a;
    b = black(ENVMAP_CUBE, 6, 1, 1);
    CHECK(hierarchical(&a, &src, envmap_lobe_phong(10), 0) == ENVMAP_OK);
    CHECK(hierarchical(&b, &src, envmap_lobe_phong(10), 1e-3f) == ENVMAP_OK);
    double largest = 0;
    for (size_t i = 0; i < floats_of(&a); ++i) {
        double d = fabs((double)a.texels[i] - (double)b.texels[i]);
        if (!(d <= largest)) largest = d;
    }
    CHECK(largest < 1e-6);
    envmap_free(&src);
    envmap_free(&a);
    envmap_free(&b);
}

static void a_constant_environment_stays_itself(void) {
    static const float n[7] = {0, 1, 10, 500, 1e4f, 1e6f, 1e9f};
    double worst = 0;
    for (int m = 0; m < MAPPINGS; ++m) {
        envmap src = black(m, 19, 1, 1), dst = black((m + 1) % MAPPINGS, 5, 1, 1);
        oracle_fill(&src, 0, oracle_one);
        for (int i = 0; i < 14; ++i) {
            CHECK(hierarchical(&dst, &src, envmap_lobe_phong(n[i % 7]), i < 7 ? 0 : -1.0f) ==
                  ENVMAP_OK);
            for (size_t t = 0; t < floats_of(&dst); ++t) {
                double error = fabs((double)dst.texels[t] / (double)(1 + t % 3) - 1);
                if (!(error <= worst)) worst = error;
            }
        }
        envmap_free(&src);
        envmap_free(&dst);
    }
    FIGURE("white furnace: |result / constant - 1|", worst, 1e-6);
}

/* ---------------------------------------------------------------------------- where it fails -- */

/* The rule compares lobe values and does not see what they multiply. */
static void a_sun_is_not_kept_to_the_same_visual_quality(void) {
    envmap mild = lit(ENVMAP_CUBE, 48, 1), sunny = lit(ENVMAP_CUBE, 48, 5e4f);
    envmap_difference a = off(&mild, envmap_lobe_phong(100), ENVMAP_CUBE, 16, 1, 0);
    envmap_difference b = off(&sunny, envmap_lobe_phong(100), ENVMAP_CUBE, 16, 1, 0);
    printf("    Phong 100, threshold 0.001\n");
    printf("    smooth: rms %.2e, worst %.2e, bias %+.1e\n", a.rms, a.worst, a.bias);
    printf("    sun:    rms %.2e, worst %.2e, bias %+.1e\n", b.rms, b.worst, b.bias);
    FIGURE("a smooth scene: worst texel", a.worst, 2e-3);
    CHECK(b.rms > 2 * a.rms);
    CHECK(b.worst > 0.1);
    envmap_free(&mild);
    envmap_free(&sunny);
}

/* Thinner than the distance of its samples a lobe is lost or blurred: finite, but not right. */
static void a_sharp_lobe_slips_between_the_samples(void) {
    static const float n[5] = {100, 400, 1600, 6400, 1e6f};
    envmap src = noise(ENVMAP_CUBE, 32, 14);
    double largest = 0, last = 0;
    for (int i = 0; i < 5; ++i) {
        last = off(&src, envmap_lobe_phong(n[i]), ENVMAP_CUBE, 6, 1, 0).rms;
        printf("    noise, Phong %-7g rms %.2e\n", (double)n[i], last);
        if (!(last <= largest)) largest = last;
    }
    CHECK(largest > 0.02 && largest < 2);
    FIGURE("so thin that no sample meets it, bilinear radiance: rms", last, 1e-5);
    envmap_free(&src);
}

static void thin_rings_give_no_nan(void) {
    envmap src = noise(ENVMAP_CUBE, 8, 15), dst = black(ENVMAP_LATLONG, 4, 1, 5);
    for (int raw = 0; raw < 2; ++raw) {
        envmap_lobe lobe = envmap_lobe_banks(0.9999f);
        lobe.raw = raw;
        CHECK(hierarchical(&dst, &src, lobe, 0) == ENVMAP_OK);
        for (size_t i = 0; i < floats_of(&dst); ++i) CHECK(dst.texels[i] >= 0.0f);
    }
    envmap_free(&src);
    envmap_free(&dst);
}

/* ------------------------------------------------------------------------- rules of a method -- */

static void results_are_the_same_bits_for_any_executor(void) {
    for (int i = 0; i < LOBES; i += 3) {
        envmap src = noise(ENVMAP_CUBE, 16, 16), dst = black(ENVMAP_LATLONG, 7, 1, 3);
        envmap_lobe lobe = lobe_number(i);
        check_executors(&dst, &src, &lobe, 1, desc_of(ENVMAP_METHOD_HIERARCHICAL, 0));
        envmap_free(&src);
        envmap_free(&dst);
    }
}

static void out_of_memory_and_cancelling_leak_nothing(void) {
    envmap src = black(ENVMAP_CUBE, 9, 1, 2), dst = black(ENVMAP_PARABOLOID, 5, 1, 2);
    envmap_lobe lobe = envmap_lobe_banks(0.5f);
    envmap_filter_desc desc = desc_of(ENVMAP_METHOD_HIERARCHICAL, 0);
    oracle_noise(&src, 17);
    CHECK(check_starving(&dst, &src, &lobe, 1, desc) >= 6); /* a map for each of two slices */
    CHECK(check_cancelling(&dst, &src, &lobe, 1, desc) >= 3);
    envmap_free(&src);
    envmap_free(&dst);
}

static void a_callback_that_fails_fails_the_filter(void) {
    envmap src = noise(ENVMAP_CUBE, 8, 18), dst = black(ENVMAP_CUBE, 2, 1, 1);
    envmap_lobe lobe = envmap_lobe_function(nan_near_the_axis, NULL);
    lobe.raw = 1;
    CHECK(hierarchical(&dst, &src, lobe, 0) == ENVMAP_ERROR_LOBE);
    CHECK(dst.texels[0] == 0.0f);
    envmap_free(&src);
    envmap_free(&dst);
}

/* ------------------------------------------------------------------------------------ speed -- */

#if defined(__SANITIZE_ADDRESS__)
#define INSTRUMENTED 1
#elif defined(__has_feature)
#if __has_feature(address_sanitizer)
#define INSTRUMENTED 1
#endif
#endif
#ifndef INSTRUMENTED
#define INSTRUMENTED 0
#endif

static double now(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static double source[8192][7];

/* The plain loop of pow over the whole square; the time for every 8th axis, times 8. */
static double brute_seconds(const envmap *src, double n) {
    double start = now(), total = 0;
    for (int j = 0; j < 8192; j += 8) {
        const double *a = source[j];
        double sum[4] = {0, 0, 0, 0};
        for (int i = 0; i < 8192; ++i) {
            const double *l = source[i];
            double x = a[0] * l[0] + a[1] * l[1] + a[2] * l[2], k = x > 0 ? pow(x, n) : 0;
            for (int c = 0; c < 4; ++c) sum[c] += k * l[3 + c];
        }
        total += sum[0] / sum[3];
    }
    CHECK(total > 0 && src->size == 64);
    return 8 * (now() - start);
}

/* Loosely: machines are shared. `make table1` measures. */
static void it_is_faster_than_brute_force(void) {
    static const double exponents[3] = {10, 100, 500};
    envmap src = lit(ENVMAP_PARABOLOID, 64, 1), dst = black(ENVMAP_PARABOLOID, 64, 1, 1);
    for (int i = 0; i < 8192; ++i) {
        int face = i / 4096, x = i % 64, y = i / 64 % 64;
        double w = envmap_solid_angle(&src, 0, face, x, y);
        oracle_direction(source[i], ENVMAP_PARABOLOID, face, (x + 0.5) / 64, (y + 0.5) / 64);
        for (int c = 0; c < 3; ++c) source[i][3 + c] = w * (double)src.texels[3 * i + c];
        source[i][6] = w;
    }
    if (!test_timed() || INSTRUMENTED) {
        CHECK(1);
        printf("    not measured: instrumented\n");
    }
    for (int i = 0; i < 3 && test_timed() && !INSTRUMENTED; ++i) {
        double brute = 1e9, best = 1e9;
        for (int run = 0; run < 3; ++run) {
            double seconds = brute_seconds(&src, exponents[i]), start = now();
            if (seconds < brute) brute = seconds;
            CHECK(hierarchical(&dst, &src, envmap_lobe_phong((float)exponents[i]), 0) == ENVMAP_OK);
            seconds = now() - start;
            if (seconds < best) best = seconds;
        }
        printf("    parabolic map 64 x 128, N = %-4g %.1f times as fast as brute force\n",
               exponents[i], brute / best);
        CHECK(brute / best > 1.5);
    }
    envmap_free(&src);
    envmap_free(&dst);
}

int main(void) {
    RUN(opened_everywhere_it_is_the_reference);
    RUN(it_knows_every_parameterization_and_odd_sizes);
    RUN(its_error_grows_with_the_threshold);
    RUN(what_differs_by_more_than_the_threshold_is_opened);
    RUN(zero_is_a_threshold_of_a_thousandth);
    RUN(a_constant_environment_stays_itself);
    RUN(a_sun_is_not_kept_to_the_same_visual_quality);
    RUN(a_sharp_lobe_slips_between_the_samples);
    RUN(thin_rings_give_no_nan);
    RUN(results_are_the_same_bits_for_any_executor);
    RUN(out_of_memory_and_cancelling_leak_nothing);
    RUN(a_callback_that_fails_fails_the_filter);
    RUN(it_is_faster_than_brute_force);
    return test_summary();
}
