/* SPDX-License-Identifier: MIT
   Filtered importance sampling: its distribution, its error against samples, half-texel lookups,
   fireflies. Summed areas: exact boxes, what float tables lose, poles. */
#include "methods.h"

/* -------------------------------------------------------------------------------- sampling -- */

static void sampled_directions_have_the_moments_of_the_lobe(void) {
    envmap_lobe lobes[4] = {envmap_lobe_phong(10), envmap_lobe_gaussian(50), envmap_lobe_ggx(0.3f),
                            envmap_lobe_diffuse()};
    for (int k = 0; k < 4; ++k) {
        double lambda[3], mean[2] = {0, 0}, side = 0, *cdf;
        if (!CHECK(method_cumulate(&cdf, lobes + k) == ENVMAP_OK)) continue;
        CHECK(envmap_lobe_zonal(lambda, 3, lobes + k, 0) == ENVMAP_OK);
        for (int i = 0; i < 1024; ++i) {
            method_direction d = method_direction_of(cdf, lobes + k, i, 1024);
            double z = (double)d.z;
            mean[0] += z / 1024, mean[1] += (1.5 * z * z - 0.5) / 1024;
            side += (double)d.x / 1024;
        }
        CHECK_CLOSE(mean[0], lambda[1], 3e-4);
        CHECK_CLOSE(mean[1], lambda[2], 5e-4);
        CHECK_CLOSE(side, 0, 2e-3);
        METHOD_FREE(cdf);
    }
}

static double sampling_miss(const envmap *src, envmap_lobe lobe, int samples, int half_texel,
                            double *worst) {
    envmap truth = tests_truth(src, &lobe, ENVMAP_CUBE, 8);
    method_desc desc = tests_desc(0);
    desc.samples = samples, desc.half_texel = half_texel;
    envmap_difference d = tests_miss(method_importance_sampling, src, lobe, &desc, &truth);
    envmap_free(&truth);
    if (worst) *worst = d.worst;
    return d.rms;
}

static void sampling_errors_fall_with_samples(void) {
    envmap src = tests_map(ENVMAP_CUBE, 64, 1);
    oracle_noise(&src, 3);
    tests_lamp(&src, 1, 0.3, 0.2, 0.5, 3), tests_lamp(&src, -1, 0.9, -0.4, 0.8, 2);
    double last = 1;
    for (int n = 8; n <= 4096; n *= 8) {
        double e = sampling_miss(&src, envmap_lobe_ggx(0.25f), n, 0, NULL);
        printf("    GGX alpha 0.25, %4d samples: rms %.3g\n", n, e);
        CHECK(e < 0.7 * last);
        last = e;
    }
    FIGURE("4096 samples", last, 2e-3);
    envmap_free(&src);
}

static void half_a_texel_off_costs_more_than_all_else(void) {
    envmap src = tests_map(ENVMAP_CUBE, 64, 1);
    oracle_fill(&src, 0, oracle_smooth);
    double right = sampling_miss(&src, envmap_lobe_ggx(0.25f), 1024, 0, NULL);
    double off = sampling_miss(&src, envmap_lobe_ggx(0.25f), 1024, 1, NULL);
    printf("    %-64s %.3g\n", "half a texel off, rms", off);
    FIGURE("right, rms", right, off / 8);
    envmap_free(&src);
}

static void few_samples_make_fireflies_of_a_sun(void) {
    envmap src = tests_map(ENVMAP_CUBE, 64, 1);
    for (size_t i = 0; i < method_floats(&src); ++i) src.texels[i] = 0.5f;
    tests_lamp(&src, 0.3, 0.8, 0.5, 0.02, 20000);
    double worst, few = sampling_miss(&src, envmap_lobe_ggx(0.25f), 32, 0, &worst);
    double many = sampling_miss(&src, envmap_lobe_ggx(0.25f), 1024, 0, NULL);
    printf("    %-64s %.3g, %.3g\n", "a sun, 32 samples: rms, worst texel", few, worst);
    printf("    %-64s %.3g\n", "... 1024 samples: rms", many);
    CHECK(few > 0.1 && worst > 0.3 && many < few);
    envmap_free(&src);
}

static double negative(double x, double p, void *user) {
    (void)p, (void)user;
    return x + 0.5;
}

static void lobes_below_zero_cannot_be_sampled(void) {
    envmap src = tests_map(ENVMAP_CUBE, 8, 1), dst = tests_map(ENVMAP_CUBE, 4, 1);
    envmap_lobe lobe = envmap_lobe_function(negative, NULL);
    CHECK(method_importance_sampling(&dst, &src, &lobe, NULL) == ENVMAP_ERROR_METHOD);
    envmap_free(&src);
    envmap_free(&dst);
}

/* ---------------------------------------------------------------------------- summed areas -- */

/* The mean over a box by the texels it covers, each by the part of it. */
static double plain_box(const envmap *map, int face, double u0, double v0, double u1, double v1) {
    double sum = 0, weight = 0;
    int w = method_width(map, 0), h = map->size;
    for (int turn = -1; turn <= 1; ++turn)
        for (int y = 0; y < h; ++y)
            for (int x = 0; x < w; ++x) {
                double x0 = (double)x / w + turn, y0 = (double)y / h;
                double a = fmin(u1, x0 + 1.0 / w) - fmax(u0, x0);
                double b = fmin(v1, y0 + 1.0 / h) - fmax(v0, y0);
                if (!(a > 0 && b > 0) || (turn && map->mapping != ENVMAP_LATLONG)) continue;
                double s = a * b * envmap_solid_angle(map, 0, face, x, y);
                sum += s * (double)envmap_texel(map, 0, 0, face, x, y)[1], weight += s;
            }
    return sum / weight;
}

static void summed_boxes_are_exact(void) {
    unsigned long long state = 5;
    double worst = 0;
    for (int mapping = 0; mapping < 5; ++mapping) {
        envmap map = tests_map(mapping, 16, 1);
        summed_area table;
        oracle_noise(&map, 8);
        map.texels[400] = 1e5f;
        CHECK(summed_area_create(&table, &map, 0) == ENVMAP_OK);
        for (int i = 0; i < test_many(400); ++i) {
            float rgb[3];
            double u = test_random(&state), v = test_random(&state), du = test_random(&state),
                   dv = test_random(&state);
            double start = mapping == ENVMAP_LATLONG ? 2 * u - 1 : 0.3 + 0.2 * u;
            double to = mapping == ENVMAP_LATLONG ? start + 0.01 + 0.9 * du : start + 0.4 * du;
            v = 0.3 + 0.3 * v * 0.5, dv = v + 0.05 + 0.3 * dv;
            int face = i % envmap_faces(mapping);
            double truth = plain_box(&map, face, start, v, to, dv);
            summed_area_box(rgb, &table, face, start, v, to, dv);
            double e = fabs((double)rgb[1] / truth - 1);
            if (!(e <= worst)) worst = e;
        }
        summed_area_free(&table);
        envmap_free(&map);
    }
    FIGURE("mean over a box, relative error", worst, 2e-7);
}

static void float_tables_lose_small_boxes_beside_a_sun(void) {
    envmap map = tests_map(ENVMAP_LATLONG, 128, 1);
    oracle_noise(&map, 8);
    tests_lamp(&map, 0.1, 0.9, 0.2, 0.05, 50000);
    double lost = 0, kept = 0;
    for (int plain = 0; plain < 2; ++plain) {
        summed_area table;
        CHECK(summed_area_create(&table, &map, plain) == ENVMAP_OK);
        for (int x = 0; x < 256; ++x) {
            float rgb[3];
            summed_area_box(rgb, &table, 0, x / 256.0, 0.78125, (x + 1) / 256.0, 0.7890625);
            double truth = (double)envmap_texel(&map, 0, 0, 0, x, 100)[1];
            double e = fabs((double)rgb[1] - truth);
            if (plain && e > lost) lost = e;
            if (!plain && !(e <= kept)) kept = e;
        }
        summed_area_free(&table);
    }
    printf("    %-64s %.3g\n", "one texel (0 ... 1) below a sun, from floats: off by", lost);
    FIGURE("... from doubles", kept, 1e-5);
    CHECK(lost > 0.1);
    envmap_free(&map);
}

/* A lamp on a pole of the lat-long map, and one on its horizon. */
static void stacked_discs_hold_at_the_pole_where_one_box_fails(void) {
    method_desc published = tests_desc(METHOD_PUBLISHED), fine = tests_desc(0);
    fine.discs = 24, fine.strips = 25;
    for (int pole = 0; pole < 2; ++pole) {
        envmap src = tests_map(ENVMAP_LATLONG, 64, 1);
        tests_lamp(&src, 0.1, pole, 1 - pole, 0.3, 10);
        envmap_lobe lobe = envmap_lobe_ggx(0.25f);
        envmap truth = tests_truth(&src, &lobe, ENVMAP_CUBE, 16);
        double box = tests_miss(method_summed_area, &src, lobe, &published, &truth).rms;
        printf("    %-64s %.3g\n",
               pole ? "lamp on the pole: one box" : "lamp on the horizon: one box", box);
        CHECK(box > 0.1);
        FIGURE("8 discs of 9 strips", tests_miss(method_summed_area, &src, lobe, NULL, &truth).rms,
               0.05);
        FIGURE("24 discs of 25", tests_miss(method_summed_area, &src, lobe, &fine, &truth).rms,
               0.015);
        envmap_free(&src);
        envmap_free(&truth);
    }
}

static void summed_area_tables_refuse_what_is_no_map(void) {
    envmap none;
    summed_area table;
    memset(&none, 0, sizeof none);
    CHECK(summed_area_create(&table, NULL, 0) == ENVMAP_ERROR_ARGUMENT);
    CHECK(summed_area_create(&table, &none, 0) == ENVMAP_ERROR_ARGUMENT);
    CHECK(summed_area_create(NULL, &none, 0) == ENVMAP_ERROR_ARGUMENT);
}

int main(void) {
    RUN(sampled_directions_have_the_moments_of_the_lobe);
    RUN(sampling_errors_fall_with_samples);
    RUN(half_a_texel_off_costs_more_than_all_else);
    RUN(few_samples_make_fireflies_of_a_sun);
    RUN(lobes_below_zero_cannot_be_sampled);
    RUN(summed_boxes_are_exact);
    RUN(float_tables_lose_small_boxes_beside_a_sun);
    RUN(stacked_discs_hold_at_the_pole_where_one_box_fails);
    RUN(summed_area_tables_refuse_what_is_no_map);
    return test_summary();
}
