/* SPDX-License-Identifier: MIT
   The rules that every method of examples/methods/ keeps; the paraboloid convolution and the box
   levels, with their published figures and where they fail. The others: test_methods_*.c. */
#include "methods.h"

typedef struct named {
    const char *name;
    method_call *call;
} named;

static const named methods[] = {{"paraboloid convolution", method_paraboloid_convolution},
                                {"box levels", method_box_levels},
                                {"separable Gaussian", method_separable_gaussian},
                                {"importance sampling", method_importance_sampling},
                                {"summed areas", method_summed_area}};
#define METHODS (int)(sizeof methods / sizeof *methods)

/* ----------------------------------------------------------------------------------- rules -- */

static void a_constant_stays_itself_in_every_method_and_parameterization(void) {
    double worst = 0;
    envmap_lobe lobe = envmap_lobe_phong(40);
    for (int m = 0; m < METHODS; ++m)
        for (int form = 0; form < METHOD_FORM_COUNT; ++form)
            for (int mapping = 0; mapping < 5; ++mapping) {
                envmap src = tests_map(mapping, 16, 1), dst = tests_map(4 - mapping, 9, 1);
                method_desc desc = tests_desc(form);
                desc.samples = 32;
                oracle_fill(&src, 0, oracle_one);
                CHECK(methods[m].call(&dst, &src, &lobe, &desc) == ENVMAP_OK);
                for (size_t i = 0; i < method_floats(&dst); ++i) {
                    double e = fabs((double)dst.texels[i] / (1 + (double)(i % 3)) - 1);
                    if (!(e <= worst)) worst = e;
                }
                envmap_free(&src);
                envmap_free(&dst);
            }
    FIGURE("constant 1, 2, 3: largest relative error", worst, 2e-6);
}

static void raw_results_are_the_integral_times_normalised_ones(void) {
    envmap src = tests_map(ENVMAP_CUBE, 8, 1), a = tests_map(ENVMAP_CUBE, 4, 1),
           b = tests_map(ENVMAP_CUBE, 4, 1);
    envmap_lobe lobe = envmap_lobe_phong(30), raw = lobe;
    raw.raw = 1, raw.scale = 3;
    oracle_noise(&src, 5);
    for (int m = 0; m < METHODS; ++m) {
        CHECK(methods[m].call(&a, &src, &lobe, NULL) == ENVMAP_OK);
        CHECK(methods[m].call(&b, &src, &raw, NULL) == ENVMAP_OK);
        for (size_t i = 0; i < method_floats(&a); ++i)
            CHECK_CLOSE(b.texels[i], 3 * 2 * PI / 31 * (double)a.texels[i], 1e-6);
    }
    envmap_free(&src);
    envmap_free(&a);
    envmap_free(&b);
}

static void every_slice_is_alike(void) {
    envmap src = tests_map(ENVMAP_LATLONG, 8, 1), dst;
    envmap_lobe lobe = envmap_lobe_phong(30);
    oracle_noise(&src, 5);
    memset(&dst, 0, sizeof dst);
    CHECK(envmap_create(&dst, ENVMAP_PARABOLOID, 5, 1, 3) == ENVMAP_OK);
    for (int m = 0; m < METHODS; ++m) {
        CHECK(methods[m].call(&dst, &src, &lobe, NULL) == ENVMAP_OK);
        CHECK(!memcmp(dst.texels, dst.texels + 2 * method_floats(&dst),
                      method_floats(&dst) * sizeof(float)));
        CHECK(dst.p0 == lobe.p0 && dst.p1 == lobe.p1);
    }
    envmap_free(&src);
    envmap_free(&dst);
}

static double rising(double x, double p, void *user) {
    (void)p, (void)user;
    return 2 - x;
}

static void what_cannot_be_done_is_refused_and_nothing_is_written(void) {
    envmap src = tests_map(ENVMAP_CUBE, 8, 1), dst = tests_map(ENVMAP_CUBE, 4, 1), two, none;
    envmap_lobe good = envmap_lobe_phong(30), mirror = envmap_lobe_mirror(),
                banks = envmap_lobe_banks(0.9f), bad = envmap_lobe_phong(-1),
                ring = envmap_lobe_function(rising, NULL);
    method_desc form = tests_desc(7);
    memset(&two, 0, sizeof two), memset(&none, 0, sizeof none);
    CHECK(envmap_create(&two, ENVMAP_CUBE, 8, 1, 2) == ENVMAP_OK);
    dst.texels[5] = 7;
    for (int m = 0; m < METHODS; ++m) {
        method_call *call = methods[m].call;
        CHECK(call(NULL, &src, &good, NULL) == ENVMAP_ERROR_ARGUMENT);
        CHECK(call(&dst, NULL, &good, NULL) == ENVMAP_ERROR_ARGUMENT);
        CHECK(call(&dst, &none, &good, NULL) == ENVMAP_ERROR_ARGUMENT);
        CHECK(call(&dst, &src, NULL, NULL) == ENVMAP_ERROR_ARGUMENT);
        CHECK(call(&dst, &dst, &good, NULL) == ENVMAP_ERROR_ARGUMENT);
        CHECK(call(&dst, &src, &good, &form) == ENVMAP_ERROR_ARGUMENT);
        CHECK(call(&dst, &src, &mirror, NULL) == ENVMAP_ERROR_METHOD);
        CHECK(call(&dst, &src, &banks, NULL) == ENVMAP_ERROR_METHOD);
        CHECK(call(&dst, &src, &bad, NULL) == ENVMAP_ERROR_LOBE);
        CHECK(call(&dst, &two, &good, NULL) == ENVMAP_ERROR_METHOD);
        if (call != method_importance_sampling)
            CHECK(call(&dst, &src, &ring, NULL) == ENVMAP_ERROR_METHOD);
        const float wrong[] = {(float)NAN, (float)HUGE_VAL};
        for (int i = 0; i < 2; ++i) {
            src.texels[100] = wrong[i];
            CHECK(call(&dst, &src, &good, NULL) == ENVMAP_ERROR_RADIANCE);
            src.texels[100] = 0;
        }
        CHECK(dst.texels[5] == 7);
    }
    envmap_free(&src);
    envmap_free(&dst);
    envmap_free(&two);
}

static void settings_out_of_range_are_refused(void) {
    envmap src = tests_map(ENVMAP_CUBE, 8, 1), dst = tests_map(ENVMAP_CUBE, 4, 1);
    envmap_lobe lobe = envmap_lobe_phong(30);
    method_desc bad[5];
    for (int i = 0; i < 5; ++i) bad[i] = tests_desc(0);
    bad[0].cut = 1.5f, bad[1].level = -1, bad[2].kernel = 99, bad[3].samples = -1;
    bad[4].discs = 65;
    for (int m = 0; m < METHODS; ++m)
        CHECK(methods[m].call(&dst, &src, &lobe, bad + m) == ENVMAP_ERROR_METHOD);
    bad[0] = tests_desc(0), bad[0].limit = 64;
    CHECK(method_paraboloid_convolution(&dst, &src, &lobe, bad) == ENVMAP_ERROR_METHOD);
    bad[0].limit = 0, bad[0].cut = (float)NAN;
    CHECK(method_paraboloid_convolution(&dst, &src, &lobe, bad) == ENVMAP_ERROR_METHOD);
    bad[1].level = (float)NAN;
    CHECK(method_box_levels(&dst, &src, &lobe, bad + 1) == ENVMAP_ERROR_METHOD);
    envmap_free(&src);
    envmap_free(&dst);
}

static void every_failed_allocation_is_survived(void) {
    envmap src = tests_map(ENVMAP_CUBE, 4, 1), dst = tests_map(ENVMAP_CUBE, 4, 1);
    envmap_lobe lobe = envmap_lobe_phong(30);
    method_desc desc = tests_desc(0);
    int live = oracle_live;
    desc.samples = 4;
    dst.texels[5] = 7;
    for (int m = 0; m < METHODS; ++m) {
        int failures = 0;
        for (int n = 0; n < 64; ++n) {
            oracle_calls = 0, oracle_fail_at = n;
            envmap_result result = methods[m].call(&dst, &src, &lobe, &desc);
            oracle_fail_at = -1;
            CHECK(oracle_live == live);
            if (result == ENVMAP_OK) break;
            CHECK(result == ENVMAP_ERROR_MEMORY);
            CHECK(dst.texels[5] == 7);
            ++failures;
        }
        CHECK(failures >= 1 && failures < 64);
        dst.texels[5] = 7;
    }
    CHECK(oracle_wrong_context == 0);
    envmap_free(&src);
    envmap_free(&dst);
}

static void maps_of_one_texel_and_odd_maps_work(void) {
    static const int sizes[] = {1, 2, 3, 5, 33};
    envmap_lobe lobe = envmap_lobe_phong(30);
    method_desc desc = tests_desc(0);
    desc.samples = 16;
    for (int m = 0; m < METHODS; ++m)
        for (int i = 0; i < 5; ++i)
            for (desc.form = 0; desc.form < METHOD_FORM_COUNT; ++desc.form) {
                envmap src = tests_map(ENVMAP_CUBE, sizes[i], 1), dst = tests_map(i, sizes[i], 1);
                oracle_noise(&src, 9);
                CHECK(methods[m].call(&dst, &src, &lobe, &desc) == ENVMAP_OK);
                for (size_t k = 0; k < method_floats(&dst); ++k)
                    CHECK(dst.texels[k] >= -0.2f && dst.texels[k] <= 1.2f);
                envmap_free(&src);
                envmap_free(&dst);
            }
}

/* ------------------------------------------------------------------------------ paraboloid -- */

static void paraboloid_filter_sizes_are_the_published_ones(void) {
    static const struct {
        float n;
        int size[2], shrink[2];
    } rows[] = {{10, {174, 260}, {32, 64}}, {50, {78, 136}, {16, 32}}, {500, {26, 48}, {4, 8}}};
    for (int i = 0; i < 3; ++i) {
        envmap_lobe lobe = envmap_lobe_phong(rows[i].n);
        int size[2], shrink[2];
        paraboloid_sizes(size, shrink, &lobe, 512, 0.1, 7);
        for (int k = 0; k < 2; ++k) {
            CHECK(size[k] == rows[i].size[k]);
            CHECK(shrink[k] == rows[i].shrink[k]);
        }
    }
}

static void paraboloid_distortion_is_a_quarter(void) {
    CHECK_CLOSE(paraboloid_distortion(1, 260.0 / 512), 0.243, 5e-4);
    CHECK_CLOSE(paraboloid_distortion(1, 1), 0.42, 5e-3);
    CHECK_CLOSE(paraboloid_distortion(0, 0.5), 0, 1e-12);
}

/* Beyond the angle where cos^N = cut lies the part cut^((N+1)/N) of Phong's integral. */
static void the_cut_loses_the_tail_and_lossy_shows_it(void) {
    envmap src = tests_map(ENVMAP_PARABOLOID, 64, 1), dst = tests_map(ENVMAP_PARABOLOID, 8, 1);
    for (size_t i = 0; i < method_floats(&src); ++i) src.texels[i] = 1;
    static const float exponents[] = {5, 10, 50, 500};
    for (int i = 0; i < 4; ++i) {
        envmap_lobe lobe = envmap_lobe_phong(exponents[i]);
        double n = (double)exponents[i];
        method_desc desc = tests_desc(METHOD_PUBLISHED);
        desc.lossy = 1;
        CHECK(method_paraboloid_convolution(&dst, &src, &lobe, &desc) == ENVMAP_OK);
        CHECK_CLOSE(dst.texels[0], 1 - pow(0.1, (n + 1) / n), 1e-5);
    }
    printf("    %-64s %.3g\n", "Phong N = 10, cut 0.1: energy lost", pow(0.1, 1.1));
    envmap_free(&src);
    envmap_free(&dst);
}

/* What a lamp at an angle from +z makes of each form. */
static envmap_difference lamp_miss(double angle, float n, const method_desc *desc) {
    envmap src = tests_map(ENVMAP_PARABOLOID, 64, 1);
    tests_lamp(&src, sin(angle), 0, cos(angle), 0.2, 10);
    envmap_lobe lobe = envmap_lobe_phong(n);
    envmap truth = tests_truth(&src, &lobe, ENVMAP_PARABOLOID, 32);
    envmap_difference d = tests_miss(method_paraboloid_convolution, &src, lobe, desc, &truth);
    envmap_free(&src);
    envmap_free(&truth);
    return d;
}

static void two_paraboloid_maps_serve_centre_and_rim_and_one_only_the_centre(void) {
    method_desc desc = tests_desc(METHOD_PUBLISHED), one = desc;
    one.one_map = 1;
    double centre = lamp_miss(0, 50, &one).rms, rim = lamp_miss(PI / 2, 50, &one).rms;
    printf("    %-64s %.3g, %.3g\n", "one map: rms of a lamp in the centre, at the rim", centre,
           rim);
    CHECK(rim > 2 * centre);
    FIGURE("two maps: rms of a lamp at the rim", lamp_miss(PI / 2, 50, &desc).rms, 0.75 * rim);
}

static void the_mended_paraboloid_filter_sees_rims_and_centres_alike(void) {
    method_desc mended = tests_desc(0), published = tests_desc(METHOD_PUBLISHED);
    mended.limit = published.limit = 31, mended.cut = published.cut = 0.01f;
    double before = lamp_miss(PI / 2, 50, &published).rms;
    printf("    %-64s %.3g\n", "31 texels, cut 0.01, as published: lamp at the rim", before);
    FIGURE("mended: lamp at the rim", lamp_miss(PI / 2, 50, &mended).rms, 0.6 * before);
    FIGURE("mended: lamp at 45 degrees", lamp_miss(PI / 4, 50, &mended).rms, 0.1);
}

/* The green channel at the rim of a white world, with the border of the paper. */
static float white_at_the_rim(float n, float border) {
    envmap src = tests_map(ENVMAP_PARABOLOID, 128, 1), dst = tests_map(ENVMAP_PARABOLOID, 16, 1);
    envmap_lobe lobe = envmap_lobe_phong(n);
    method_desc desc = tests_desc(METHOD_PUBLISHED);
    const float rim[3] = {1, 0, 0.02f};
    float rgb[3];
    desc.border = border;
    for (size_t i = 0; i < method_floats(&src); ++i) src.texels[i] = 1;
    CHECK(method_paraboloid_convolution(&dst, &src, &lobe, &desc) == ENVMAP_OK);
    envmap_lookup(rgb, &dst, rim, 0);
    envmap_free(&src);
    envmap_free(&dst);
    return rgb[1];
}

static void a_border_of_64_texels_of_512_is_enough_for_sharp_lobes_only(void) {
    CHECK_CLOSE(white_at_the_rim(500, 0.25f), 1, 1e-5);
    CHECK_CLOSE(white_at_the_rim(10, 0), 1, 1e-5);
    float wide = white_at_the_rim(10, 0.25f);
    printf("    %-64s %.3g\n", "N = 10: a white world at the rim, 64 texels of border",
           (double)wide);
    CHECK(wide > 0.8f && wide < 0.97f);
}

static void maps_of_zero_to_one_lose_what_is_brighter(void) {
    envmap src = tests_map(ENVMAP_PARABOLOID, 64, 1), dst = tests_map(ENVMAP_PARABOLOID, 32, 1);
    envmap_lobe lobe = envmap_lobe_phong(50);
    method_desc desc = tests_desc(METHOD_PUBLISHED);
    tests_lamp(&src, 0, 0, 1, 0.2, 10);
    CHECK(method_paraboloid_convolution(&dst, &src, &lobe, &desc) == ENVMAP_OK);
    double all = tests_energy(&dst);
    desc.white = 1;
    CHECK(method_paraboloid_convolution(&dst, &src, &lobe, &desc) == ENVMAP_OK);
    CHECK_CLOSE(tests_energy(&dst), all / 10, 1e-3 * all);
    desc.white = -1;
    CHECK(method_paraboloid_convolution(&dst, &src, &lobe, &desc) == ENVMAP_ERROR_METHOD);
    envmap_free(&src);
    envmap_free(&dst);
}

static void lobes_that_do_not_fit_a_paraboloid_are_refused(void) {
    envmap src = tests_map(ENVMAP_PARABOLOID, 16, 1), dst = tests_map(ENVMAP_PARABOLOID, 8, 1);
    envmap_lobe diffuse = envmap_lobe_diffuse(), wide = envmap_lobe_gaussian(1);
    CHECK(method_paraboloid_convolution(&dst, &src, &diffuse, NULL) == ENVMAP_ERROR_METHOD);
    CHECK(method_paraboloid_convolution(&dst, &src, &wide, NULL) == ENVMAP_ERROR_METHOD);
    envmap_free(&src);
    envmap_free(&dst);
}

/* ------------------------------------------------------------------------------ box levels -- */

static void box_levels_are_one_apart_for_four_times_the_exponent(void) {
    for (float n = 16; n < 1000; n *= 4) {
        envmap_lobe a = envmap_lobe_phong(n), b = envmap_lobe_phong(4 * n);
        CHECK_CLOSE(method_box_level(&a, 256) - method_box_level(&b, 256), 1, 0.06);
        CHECK_CLOSE(method_box_level(&b, 256), 8.47 - 0.5 * log2(4 * (double)n), 0.03);
    }
}

/* Seven levels around the lobe's on noise: the lobe's is within a fifth of the best. */
static void box_levels_of_a_lobe_are_nearly_the_best(void) {
    envmap src = tests_map(ENVMAP_CUBE, 64, 1);
    oracle_noise(&src, 3);
    tests_lamp(&src, 1, 0.3, 0.2, 0.3, 5), tests_lamp(&src, -1, 0.9, -0.4, 0.5, 2);
    envmap_lobe lobe = envmap_lobe_phong(40);
    envmap truth = tests_truth(&src, &lobe, ENVMAP_CUBE, 32);
    double own = tests_miss(method_box_levels, &src, lobe, NULL, &truth).rms, best = own;
    for (int i = -3; i <= 3; ++i) {
        method_desc desc = tests_desc(0);
        desc.level = (float)method_box_level(&lobe, 64) + 0.25f * (float)i;
        double e = tests_miss(method_box_levels, &src, lobe, &desc, &truth).rms;
        if (e < best) best = e;
    }
    FIGURE("error at the lobe's level over the best", own / best, 1.2);
    printf("    %-64s %.3g\n", "... which is, relative rms", best);
    envmap_free(&src);
    envmap_free(&truth);
}

static void published_boxes_have_six_colours_at_the_top(void) {
    envmap src = tests_map(ENVMAP_CUBE, 16, 1), dst = tests_map(ENVMAP_CUBE, 2, 1);
    envmap_lobe lobe = envmap_lobe_phong(30);
    oracle_noise(&src, 3);
    for (int form = 0; form < METHOD_FORM_COUNT; ++form) {
        method_desc desc = tests_desc(form);
        double spread = 0;
        desc.level = 4;
        CHECK(method_box_levels(&dst, &src, &lobe, &desc) == ENVMAP_OK);
        for (int f = 1; f < 6; ++f)
            spread = fmax(spread, fabs((double)envmap_texel(&dst, 0, 0, f, 0, 0)[0] -
                                       (double)envmap_texel(&dst, 0, 0, 0, 0, 0)[0]));
        CHECK(form == METHOD_PUBLISHED ? spread > 1e-3 : spread < 1e-6);
    }
    envmap_free(&src);
    envmap_free(&dst);
}

static void box_levels_fail_beside_a_lamp(void) {
    envmap src = tests_map(ENVMAP_CUBE, 64, 1);
    for (size_t i = 0; i < method_floats(&src); ++i) src.texels[i] = 0.1f;
    tests_lamp(&src, 1, 0.3, 0.2, 0.05, 1000);
    envmap_lobe lobe = envmap_lobe_phong(100);
    envmap truth = tests_truth(&src, &lobe, ENVMAP_CUBE, 32);
    envmap_difference d = tests_miss(method_box_levels, &src, lobe, NULL, &truth);
    printf("    %-64s %.3g, %.3g\n", "a lamp on grey: rms and worst texel of box levels", d.rms,
           d.worst);
    CHECK(d.rms > 0.1 && d.worst > 0.5);
    envmap_free(&src);
    envmap_free(&truth);
}

int main(void) {
    RUN(a_constant_stays_itself_in_every_method_and_parameterization);
    RUN(raw_results_are_the_integral_times_normalised_ones);
    RUN(every_slice_is_alike);
    RUN(what_cannot_be_done_is_refused_and_nothing_is_written);
    RUN(settings_out_of_range_are_refused);
    RUN(every_failed_allocation_is_survived);
    RUN(maps_of_one_texel_and_odd_maps_work);
    RUN(paraboloid_filter_sizes_are_the_published_ones);
    RUN(paraboloid_distortion_is_a_quarter);
    RUN(the_cut_loses_the_tail_and_lossy_shows_it);
    RUN(two_paraboloid_maps_serve_centre_and_rim_and_one_only_the_centre);
    RUN(the_mended_paraboloid_filter_sees_rims_and_centres_alike);
    RUN(a_border_of_64_texels_of_512_is_enough_for_sharp_lobes_only);
    RUN(maps_of_zero_to_one_lose_what_is_brighter);
    RUN(lobes_that_do_not_fit_a_paraboloid_are_refused);
    RUN(box_levels_are_one_apart_for_four_times_the_exponent);
    RUN(box_levels_of_a_lobe_are_nearly_the_best);
    RUN(published_boxes_have_six_colours_at_the_top);
    RUN(box_levels_fail_beside_a_lamp);
    return test_summary();
}
