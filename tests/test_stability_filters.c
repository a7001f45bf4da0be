/* SPDX-License-Identifier: MIT
   Where filters fail, and that ours do not: lobes driven from nothing to a point, radiance to both
   ends of floats, the forms of examples/methods/faults.h beside the library. docs/stability.md
   shows each and names its tests, these and those that stand in the other files. TEST_WHOLE takes
   every parameterization and more sizes, and a map 8192 wide. */
#include "helpers.h"
#include "methods/methods.h"
#include "examples/tool/brdfs.h"
#include "examples/methods/faults.h"

static double larger(double a, double b) { return b <= a ? a : b; } /* NaN wins */

/* A world of four bands: what a lobe makes of it is known, for any lobe. */
enum { BANDS = 4 };
static double world_sh[3 * BANDS * BANDS];

static envmap world(int mapping, int size) {
    envmap map = black(mapping, size, 1, 1);
    unsigned long long state = 11;
    for (int i = 0; i < 3 * BANDS * BANDS; ++i)
        world_sh[i] = i < 3 ? 8 : 2 * test_random(&state) - 1;
    CHECK(envmap_sh_fill(&map, 0, 0, world_sh, BANDS, 0, NULL) == ENVMAP_OK);
    return map;
}

/* rms of a filtered world against its harmonics, each slice with its p. */
static double off_world(const envmap *dst, const envmap_lobe *lobe) {
    double lit[3 * BANDS * BANDS], error = 0, sum = 0;
    int width = method_width(dst, 0);
    for (int s = 0; s < dst->slices; ++s) {
        double p = (double)lobe->p0 + (double)(lobe->p1 - lobe->p0) * (s + 0.5) / dst->slices;
        CHECK(envmap_sh_convolve(lit, world_sh, BANDS, lobe, p) == ENVMAP_OK);
        for (int f = 0; f < envmap_faces(dst->mapping); ++f)
            for (int i = 0; i < width * dst->size; ++i) {
                double d[3], truth[3];
                const float *t = envmap_texel(dst, 0, s, f, i % width, i / width);
                oracle_direction(d, dst->mapping, f, (i % width + 0.5) / width,
                                 (i / width + 0.5) / dst->size);
                CHECK(envmap_sh_evaluate(truth, lit, BANDS, d) == ENVMAP_OK);
                for (int c = 0; c < 3; ++c) {
                    double off = (double)t[c] - truth[c];
                    error = off <= 1e30 ? error + off * off : HUGE_VAL;
                    sum += truth[c] * truth[c];
                }
            }
    }
    return sqrt(error / sum);
}

/* ------------------------------------------------------------------------- lobes to limits --- */

/* N and lambda 0 .. 1e9, alpha 1 .. 1e-4; then Banks, s 0 .. 0.99999. */
enum { LOBES = 31, ROUND = 24 };
static envmap_lobe lobe_of(int i) {
    static const float n[9] = {0, 1e-3f, 0.3f, 1, 12, 300, 1e4f, 1e6f, 1e9f};
    static const float alpha[6] = {1, 0.5f, 0.1f, 0.02f, 1e-3f, 1e-4f};
    static const float s[7] = {0, 0.5f, 0.9f, 0.99f, 0.999f, 0.9999f, 0.99999f};
    if (i < 9) return envmap_lobe_phong(n[i]);
    if (i < 18) return envmap_lobe_gaussian(n[i - 9]);
    if (i < ROUND) return envmap_lobe_ggx(alpha[i - 18]);
    return envmap_lobe_banks(s[i - ROUND]);
}

/* Texels cost 1/size^2: the point sum at wide lobes, the bilinear world at thin ones; in between,
   at a ring one texel wide about v = t, most. */
static void worlds_of_harmonics_pass_every_lobe(void) {
    static const int sizes[3] = {32, 24, 48};
    int most = test_whole() ? 3 * MAPPINGS : 2;
    for (int k = 0; k < most; ++k) {
        int m = test_whole() ? k % MAPPINGS : k ? ENVMAP_LATLONG : ENVMAP_CUBE;
        int size = sizes[k / MAPPINGS];
        envmap src = world(m, size);
        double off[2] = {0, 0};
        for (int i = 0; i < LOBES; i += test_many(50) < 50 ? 4 : 1) {
            envmap_lobe lobe = lobe_of(i);
            envmap dst = black(MAPPINGS - 1 - m, 3, 1, i < ROUND ? 1 : 4);
            CHECK(filter(&dst, &src, lobe, ENVMAP_METHOD_AUTO, 1e-4) == ENVMAP_OK);
            off[i >= ROUND] = larger(off[i >= ROUND], off_world(&dst, &lobe));
            envmap_free(&dst);
        }
        char what[96];
        snprintf(what, sizeof what, "%s %d: N 0 .. 1e9, alpha 1 .. 1e-4, rms * size^2",
                 oracle_name[m], size);
        FIGURE(what, off[0] * size * size, m == ENVMAP_SPHERE ? 30 : 8);
        snprintf(what, sizeof what, "%s %d: Banks s 0 .. 0.99999, rms * size^2", oracle_name[m],
                 size);
        FIGURE(what, off[1] * size * size, m == ENVMAP_SPHERE ? 60 : 15);
        envmap_free(&src);
    }
}

/* Between the darkest and the brightest texel, whatever the lobe, method, size and mapping. */
static void results_stay_between_the_darkest_and_the_brightest(void) {
    static const int methods[3] = {ENVMAP_METHOD_REFERENCE, ENVMAP_METHOD_HIERARCHICAL,
                                   ENVMAP_METHOD_AUTO};
    static const int sizes[6] = {1, 2, 3, 5, 8, 17};
    int step = test_whole() ? 2 : test_many(50) < 50 ? 79 : 47, count = 0;
    double over = 0;
    for (int k = 0; k < ROUND * 6 * MAPPINGS; k += step) {
        int m = k % MAPPINGS, size = sizes[k / MAPPINGS % 6];
        envmap src = noise(m, size, (unsigned long long)k);
        envmap dst = black((m + k) % MAPPINGS, 4, 1, 1);
        float low = HUGE_VALF, high = 0;
        src.texels[3 * (floats_of(&src) / 7)] = 1e4f; /* one red sun */
        for (size_t i = 0; i < floats_of(&src); ++i)
            low = fminf(low, src.texels[i]), high = fmaxf(high, src.texels[i]);
        for (int j = 0; j < 3; ++j, ++count) {
            CHECK(filter(&dst, &src, lobe_of(k / (6 * MAPPINGS)), methods[j], 0) == ENVMAP_OK);
            for (size_t i = 0; i < floats_of(&dst); ++i) {
                double t = (double)dst.texels[i];
                over = larger(over, fmax(t - (double)high, (double)low - t) / (double)high);
            }
        }
        envmap_free(&src);
        envmap_free(&dst);
    }
    printf("    %d calls\n", count);
    FIGURE("beyond the darkest and the brightest texel, of the brightest", over, 1e-6);
}

/* Through harmonics the range is kept to the tolerance, and nothing rings below zero: the result
   of one filter is a source for the next. */
static void harmonics_stay_in_the_range_to_the_tolerance(void) {
    static const int lobes[3] = {3, 4, 13};
    envmap src = black(ENVMAP_CUBE, 48, 1, 1), dst = black(ENVMAP_CUBE, 12, 1, 1);
    envmap again = black(ENVMAP_CUBE, 4, 1, 1);
    double over = 0, under = 0;
    for (int c = 0; c < 3; ++c) envmap_texel(&src, 0, 0, 2, 20, 15)[c] = 1e4f;
    tests_lamp(&src, -1, 0.3, 0.2, 0.3, 1);
    for (int k = 0; k < 6; ++k) {
        float high = 0, low = 0;
        if (k == 3)
            for (size_t i = 0; i < floats_of(&src); ++i) src.texels[i] = src.texels[i] > 0;
        CHECK(filter(&dst, &src, lobe_of(lobes[k % 3]), ENVMAP_METHOD_AUTO, 1e-3) == ENVMAP_OK);
        for (size_t i = 0; i < floats_of(&dst); ++i)
            high = fmaxf(high, dst.texels[i]), low = fminf(low, dst.texels[i]);
        if (k >= 3) over = larger(over, (double)high - 1);
        under = larger(under, -(double)low / (double)high);
        CHECK(filter(&again, &dst, envmap_lobe_diffuse(), ENVMAP_METHOD_AUTO, 1e-3) == ENVMAP_OK);
    }
    envmap_free(&again);
    FIGURE("AUTO, a lamp on black: below zero, of the brightest", under, 0);
    FIGURE("AUTO, lamps of 1 on black: above 1", over, 1e-3);
    envmap_free(&src);
    envmap_free(&dst);
}

/* A texel as a point: no N is thin enough to hurt the library, and 0/0 is what a sum has left. */
static void thin_lobes_meet_no_point(void) {
    static const float n[4] = {1e4f, 1e5f, 1e6f, 1e7f};
    envmap src = world(ENVMAP_CUBE, 16), dst = black(ENVMAP_CUBE, 5, 1, 1);
    fault_points points;
    int last = 0;
    CHECK(fault_points_create(&points, &src));
    for (int i = 0; i < 4; ++i) {
        int none = 0;
        envmap_lobe lobe = envmap_lobe_phong(n[i]);
        for (int k = 0; k < 150; ++k) {
            double d[3], rgb[3];
            oracle_direction(d, ENVMAP_CUBE, k / 25, (k % 5 + 0.5) / 5, (k / 5 % 5 + 0.5) / 5);
            none += fault_float_sum(rgb, &points, n[i], d) < 1e-30;
        }
        CHECK(filter(&dst, &src, lobe, ENVMAP_METHOD_AUTO, 0) == ENVMAP_OK);
        double off = off_world(&dst, &lobe);
        printf("    N = %-5g %3d of 150 axes meet no texel; library: rms %.2e\n", (double)n[i],
               none, off);
        CHECK(none >= last && off < 5e-3);
        last = none;
    }
    CHECK(last > 120);
    fault_points_free(&points);
    envmap_free(&src);
    envmap_free(&dst);
}

/* Where sigma is two texels at least, so that the lobe is sampled: one lit texel about a sigma
   from the axis. */
static void float_products_err_by_6e_8_N_and_the_filter_does_not(void) {
    int size = test_many(50) < 50 ? 64 : 512;
    double N = size == 512 ? 2e4 : 300;
    envmap src = black(ENVMAP_CUBE, size, 1, 1), dst = black(ENVMAP_CUBE, 1, 1, 1);
    int at = size / 2 + (int)(0.5 * size / sqrt(N));
    for (int c = 0; c < 3; ++c) envmap_texel(&src, 0, 0, 4, at, size / 2 + 1)[c] = 1e6f;
    envmap_lobe lobe = envmap_lobe_phong((float)N);
    lobe.raw = 1;
    CHECK(filter(&dst, &src, lobe, ENVMAP_METHOD_REFERENCE, 0) == ENVMAP_OK);
    double d[3], u, v, z[3] = {0, 0, 1};
    double w = o_texel(&u, &v, ENVMAP_CUBE, size, at, size / 2 + 1);
    oracle_direction(d, ENVMAP_CUBE, 4, u, v);
    o_lobe truth = {O_PHONG, N};
    double k = (double)o_k(truth, (long double)oracle_angle(d, z), 0);
    FIGURE("library, one lit texel a sigma away, relative",
           fabs((double)envmap_texel(&dst, 0, 0, 4, 0, 0)[1] / (1e6 * w * k) - 1), 2e-6);
    double worst = 0, law = 6e-8 * N;
    unsigned long long state = 31;
    for (int i = 0; i < 2000; ++i) { /* the same angle elsewhere on the sphere, in floats */
        double a[3], t[3], b[3], angle = 1 / sqrt(N);
        float x = 0;
        oracle_random_direction(a, &state), oracle_tangent(t, a, i);
        for (int c = 0; c < 3; ++c) {
            b[c] = cos(angle) * a[c] + sin(angle) * t[c];
            x += (float)a[c] * (float)b[c];
        }
        worst = larger(worst, fabs(pow((double)x / cos(angle), N) - 1));
    }
    printf("    a float product at N = %g: off by up to %.2e, 6e-8 N is %.2e\n", N, worst, law);
    CHECK(worst > 0.5 * law && worst < 6 * law);
    envmap_free(&src);
    envmap_free(&dst);
}

/* The ring falls between centres: its energy comes and goes from axis to axis. */
static void rings_thinner_than_a_texel_keep_their_energy(void) {
    static const float s[4] = {0.9f, 0.99f, 0.999f, 0.99999f};
    envmap src = black(ENVMAP_CUBE, 24, 1, 1), dst = black(ENVMAP_CUBE, 3, 1, 1);
    fault_points points;
    fill(&src, 1);
    CHECK(fault_points_create(&points, &src));
    for (int i = 0; i < 4; ++i) {
        double norm, wrong = 0, off = 0;
        envmap_lobe lobe = envmap_lobe_banks(s[i]);
        norm = envmap_lobe_integral(&lobe, 0);
        lobe.p0 = lobe.p1 = 0.3f;
        double truth = envmap_lobe_integral(&lobe, (double)0.3f) / norm;
        CHECK(filter(&dst, &src, lobe, ENVMAP_METHOD_REFERENCE, 0) == ENVMAP_OK);
        for (int k = 0; k < 54; ++k) {
            double d[3], rgb[3];
            oracle_direction(d, ENVMAP_CUBE, k / 9, (k % 3 + 0.5) / 3, (k / 3 % 3 + 0.5) / 3);
            fault_point_sum(rgb, &points, &lobe, d);
            wrong = larger(wrong, fabs(rgb[1] / norm / truth - 1));
            off = larger(off, fabs((double)dst.texels[3 * k + 1] / truth - 1));
        }
        printf("    s = %-7g energy of a ring off by: points %.2e, library %.2e\n", (double)s[i],
               wrong, off);
        CHECK(off < 5e-3);
        if (i == 3) CHECK(wrong > 0.5);
    }
    fault_points_free(&points);
    envmap_free(&src);
    envmap_free(&dst);
}

/* -------------------------------------------------------------------------------- radiance --- */

/* Powers of two are exact, so only what over- or underflows can change. */
static void radiance_at_both_ends_of_floats_gives_the_scaled_result(void) {
    static const int powers[3] = {-118, 30, 107}, lobes[5] = {3, 4, 8, 19, 25};
    static const int methods[3] = {ENVMAP_METHOD_REFERENCE, ENVMAP_METHOD_HIERARCHICAL,
                                   ENVMAP_METHOD_AUTO};
    double exact = 0, fast = 0;
    for (int k = 0; k < 45; ++k) {
        int j = k / 15, slices = lobes[k % 5] < ROUND ? 1 : 2;
        envmap src = noise(ENVMAP_CUBE, 24, 5), a = black(ENVMAP_LATLONG, 4, 1, slices);
        envmap b = black(ENVMAP_LATLONG, 4, 1, slices);
        for (int c = 0; c < 3; ++c) envmap_texel(&src, 0, 0, 3, 5, 7)[c] = 5e5f;
        CHECK(filter(&a, &src, lobe_of(lobes[k % 5]), methods[j], 1e-3) == ENVMAP_OK);
        for (size_t i = 0; i < floats_of(&src); ++i)
            src.texels[i] = ldexpf(src.texels[i], powers[k / 5 % 3]);
        CHECK(filter(&b, &src, lobe_of(lobes[k % 5]), methods[j], 1e-3) == ENVMAP_OK);
        for (size_t i = 0; i < floats_of(&a); ++i) {
            double scaled = ldexp((double)b.texels[i], -powers[k / 5 % 3]);
            double off = fabs(scaled / (double)a.texels[i] - 1);
            *(j < 2 ? &exact : &fast) = larger(j < 2 ? exact : fast, off);
        }
        envmap_free(&src);
        envmap_free(&a);
        envmap_free(&b);
    }
    FIGURE("radiance * 2^-118, 2^30, 2^107: reference, hierarchical", exact, 1e-6);
    FIGURE("... AUTO", fast, 1e-4);
}

/* 0 and 1 texel by texel: the highest frequency there is holds no light for any lobe wider. */
static void a_checkerboard_at_nyquist_filters_to_grey(void) {
    static const int lobes[6] = {1, 3, 4, 5, 13, 19};
    double worst = 0, rim = 0, apart = 0;
    for (int m = 0; m < MAPPINGS; m += test_whole() ? 1 : 3) {
        envmap src = black(m, 48, 1, 1), dst = black(ENVMAP_CUBE, 4, 1, 1);
        envmap truth = black(ENVMAP_CUBE, 4, 1, 1);
        int width = method_width(&src, 0);
        double *at = m == ENVMAP_SPHERE ? &rim : &worst; /* texels like needles at its rim */
        for (int f = 0; f < envmap_faces(m); ++f)
            for (int i = 0; i < width * 48; ++i)
                for (int c = 0; c < 3; ++c)
                    envmap_texel(&src, 0, 0, f, i % width, i / width)[c] =
                        (float)((i % width + i / width) & 1);
        for (int i = 0; i < 6; ++i) {
            CHECK(filter(&dst, &src, lobe_of(lobes[i]), ENVMAP_METHOD_AUTO, 1e-3) == ENVMAP_OK);
            CHECK(filter(&truth, &src, lobe_of(lobes[i]), ENVMAP_METHOD_REFERENCE, 0) == ENVMAP_OK);
            for (size_t k = 0; k < floats_of(&dst); ++k)
                *at = larger(*at, fabs((double)dst.texels[k] - 0.5));
            apart = larger(apart, tests_difference(&dst, &truth).rms);
        }
        envmap_free(&src);
        envmap_free(&dst);
        envmap_free(&truth);
    }
    FIGURE("a checkerboard of 48, any lobe of two texels and more: off 1/2 by", worst, 0.02);
    FIGURE("... and of a sphere map", rim, 0.1);
    FIGURE("AUTO against the reference, rms", apart, 1e-3);
}

/* ------------------------------------------------------------------- what is asked of lobes --- */

/* The floor is lit, the wall's normal is level: from e above the horizon a lobe about r_v takes the
   part of it that hangs below; eq. 1 takes none. */
static void light_below_the_horizon_leaks_by_the_lobes_part(void) {
    static const double angles[4] = {1.5707963, 1.4, 1.1, 0.7};
    static const float n[3] = {5, 50, 500};
    envmap src = black(ENVMAP_CUBE, 96, 1, 1);
    envmap dst = black(ENVMAP_LATLONG, 64, 1, 1);
    double worst = 0;
    for (int f = 0; f < 6; ++f)
        for (int i = 0; i < 96 * 96; ++i) {
            double d[3];
            oracle_direction(d, ENVMAP_CUBE, f, (i % 96 + 0.5) / 96, (i / 96 + 0.5) / 96);
            for (int c = 0; c < 3; ++c) envmap_texel(&src, 0, 0, f, i % 96, i / 96)[c] = d[1] < 0;
        }
    for (int k = 0; k < 3; ++k) {
        envmap_lobe lobe = envmap_lobe_phong(n[k]);
        CHECK(filter(&dst, &src, lobe, ENVMAP_METHOD_AUTO, 1e-4) == ENVMAP_OK);
        printf("    N = %-4g leaks, from 90 degrees up:", (double)n[k]);
        for (int i = 0; i < 4; ++i) {
            double part = 0, all = 0, e = PI / 2 - angles[i];
            float rgb[3], d[3] = {(float)cos(e), (float)sin(e), 0};
            for (int j = 0; j < 4000; ++j) { /* the part of each circle that lies below */
                double t = PI * (j + 0.5) / 4000, w = envmap_lobe_value(&lobe, cos(t), 0) * sin(t);
                double q = tan(e) / tan(t);
                all += w, part += w * acos(fmin(fmax(q, -1), 1)) / PI;
            }
            envmap_lookup(rgb, &dst, d, 0);
            worst = larger(worst, fabs((double)rgb[1] - part / all));
            printf(" %.3f", (double)rgb[1]);
        }
        printf("\n");
        brdf_values values = {{1, 1, 1}, 0, 0, (double)n[k], 0, 0};
        envmap_brdf brdf = {brdf_phong, &values};
        envmap_frame frame = {{0, 1, 0}, {1, 0, 0}, {1, 0.05f, 0}};
        float rgb[3];
        CHECK(envmap_radiance(rgb, &src, &brdf, &frame, 1, NULL) == ENVMAP_OK && rgb[1] == 0);
    }
    FIGURE("leaked light against the lobe's part below the horizon", worst, 5e-3);
    envmap_free(&src);
    envmap_free(&dst);
}

/* A rule that compares lobes but not what they multiply. */
static void the_threshold_loses_a_sun_and_sharp_lobes(void) {
    static const float n[4] = {10, 200, 4000, 20000};
    envmap src = smooth(ENVMAP_CUBE, 48), dst = black(ENVMAP_CUBE, 6, 1, 1);
    envmap truth = black(ENVMAP_CUBE, 6, 1, 1);
    double calm = 0, rms = 0, bias = 0, ours = 0;
    for (int sun = 0; sun < 2; ++sun) {
        for (int c = 0; sun && c < 3; ++c) envmap_texel(&src, 0, 0, 4, 27, 21)[c] = 2e4f;
        for (int i = 0; i < 4; ++i) {
            envmap_lobe lobe = envmap_lobe_phong(n[i]);
            CHECK(filter(&truth, &src, lobe, ENVMAP_METHOD_REFERENCE, 0) == ENVMAP_OK);
            CHECK(filter(&dst, &src, lobe, ENVMAP_METHOD_HIERARCHICAL, 0) == ENVMAP_OK);
            envmap_difference d = tests_difference(&dst, &truth);
            CHECK(filter(&dst, &src, lobe, ENVMAP_METHOD_AUTO, 1e-3) == ENVMAP_OK);
            ours = larger(ours, tests_difference(&dst, &truth).rms);
            printf("    %s, N = %-5g threshold 0.001: rms %.2e, worst %.2e, bias %+.2e\n",
                   sun ? "sun " : "calm", (double)n[i], d.rms, d.worst, d.bias);
            if (!sun && i < 2) calm = larger(calm, fabs(d.bias));
            if (sun) rms = larger(rms, d.rms), bias = larger(bias, fabs(d.bias));
        }
    }
    FIGURE("calm, N to 200: bias of the mean", calm, 1e-3);
    CHECK(rms > 0.3 && bias > 0.05);
    FIGURE("AUTO, all of them: rms", ours, 1e-3);
    envmap_free(&src);
    envmap_free(&dst);
    envmap_free(&truth);
}

/* ----------------------------------------------------------------------------------- sizes --- */

static void sources_of_every_size_err_by_one_over_its_square(void) {
    static const int sizes[12] = {4, 5, 7, 8, 11, 16, 17, 31, 32, 33, 64, 100};
    envmap_lobe lobe = envmap_lobe_phong(10);
    for (int m = 0; m < MAPPINGS; ++m) {
        static const double bound[MAPPINGS] = {0.4, 1.6, 6, 1.6, 5, 5};
        double worst = 0;
        char what[96];
        for (int i = 0; i < (test_whole() ? 12 : test_many(50) < 50 ? 6 : 9); ++i) {
            envmap src = world(m, sizes[i]), dst = black(ENVMAP_CUBE, 3, 1, 1);
            CHECK(filter(&dst, &src, lobe, ENVMAP_METHOD_AUTO, 1e-5) == ENVMAP_OK);
            worst = larger(worst, off_world(&dst, &lobe) * sizes[i] * sizes[i]);
            envmap_free(&src);
            envmap_free(&dst);
        }
        snprintf(what, sizeof what, "%s, 4 to 100: rms * size^2, Phong 10", oracle_name[m]);
        FIGURE(what, worst, bound[m]);
    }
}

/* The whole form only: 400 MB. */
static void a_source_8192_wide_filters(void) {
    if (!test_whole()) {
        CHECK(1);
        printf("    not in the quick form\n");
        return;
    }
    oracle_most = (size_t)2 << 30;
    envmap src = world(ENVMAP_LATLONG, 4096);
    for (int i = 0; i < 4; ++i) {
        envmap_lobe lobe = i == 3 ? envmap_lobe_diffuse()
                                  : envmap_lobe_phong(i == 2 ? 500
                                                      : i    ? 50
                                                             : 5);
        envmap dst = black(ENVMAP_CUBE, 8, 1, 1);
        CHECK(filter(&dst, &src, lobe, ENVMAP_METHOD_FAST, 1e-4) == ENVMAP_OK);
        FIGURE("lat-long 8192 x 4096 against its harmonics, rms", off_world(&dst, &lobe), 1e-4);
        envmap_free(&dst);
    }
    envmap_free(&src);
    oracle_most = (size_t)256 << 20;
}

static void nothing_leaks(void) { CHECK(oracle_live == 0 && oracle_wrong_context == 0); }

int main(void) {
    RUN(worlds_of_harmonics_pass_every_lobe);
    RUN(results_stay_between_the_darkest_and_the_brightest);
    RUN(harmonics_stay_in_the_range_to_the_tolerance);
    RUN(thin_lobes_meet_no_point);
    RUN(float_products_err_by_6e_8_N_and_the_filter_does_not);
    RUN(rings_thinner_than_a_texel_keep_their_energy);
    RUN(radiance_at_both_ends_of_floats_gives_the_scaled_result);
    RUN(a_checkerboard_at_nyquist_filters_to_grey);
    RUN(light_below_the_horizon_leaks_by_the_lobes_part);
    RUN(the_threshold_loses_a_sun_and_sharp_lobes);
    RUN(sources_of_every_size_err_by_one_over_its_square);
    RUN(a_source_8192_wide_filters);
    RUN(nothing_leaks);
    return test_summary();
}
