/* SPDX-License-Identifier: MIT
   materials: eq. 1, Fresnel, fits of BRDFs, GGX, Banks end to end, fans; and the example
   methods that stand on eq. 1 or are drawn by hand. */
#include "helpers.h"

#include "examples/tool/brdfs.h"
#include "examples/methods/cabral.h"
#include "examples/methods/nonphotorealistic.h"

static brdf_values values(double alpha, double exponent, double s) {
    brdf_values v = {{1, 1, 1}, 0, 0, 0, 0, 0};
    v.alpha = v.alpha_y = alpha, v.exponent = exponent, v.s = s;
    return v;
}

static envmap_brdf model(envmap_brdf_function *function, brdf_values *v) {
    envmap_brdf brdf = {function, v};
    return brdf;
}

static envmap_frame frame_of(double nx, double ny, double nz, double vx, double vy, double vz) {
    envmap_frame f = {
        {(float)nx, (float)ny, (float)nz}, {1, 0, 0}, {(float)vx, (float)vy, (float)vz}};
    return f;
}

/* v at cosine c in the plane of z and x. */
static envmap_frame seen_at(double c) { return frame_of(0, 0, 1, -sqrt(1 - c * c), 0, c); }

static envmap ones(int size) {
    envmap map = black(ENVMAP_CUBE, size, 1, 1);
    fill(&map, 1);
    return map;
}

static double one_radiance(const envmap *map, const envmap_brdf *brdf, const envmap_frame *f) {
    float rgb[3] = {-7, -7, -7};
    CHECK(envmap_radiance(rgb, map, brdf, f, 1, NULL) == ENVMAP_OK);
    return (double)rgb[1];
}

/* ------------------------------------------------------------------------------------ eq. 1 -- */

static void eq_1_of_lambert_is_the_diffuse_map(void) {
    envmap src = noise(ENVMAP_CUBE, 16, 3), dst = black(ENVMAP_CUBE, 2, 1, 1);
    brdf_values v = values(0, 0, 0);
    envmap_brdf lambert = model(brdf_lambert, &v);
    envmap_lobe lobe = envmap_lobe_diffuse();
    double worst = 0;
    lobe.raw = 1;
    CHECK(filter(&dst, &src, lobe, ENVMAP_METHOD_REFERENCE, 0) == ENVMAP_OK);
    for (int i = 0; i < 24; ++i) {
        float d[3];
        envmap_direction(d, ENVMAP_CUBE, i / 4, 0.25f + 0.5f * (float)(i % 2),
                         i % 4 < 2 ? 0.25f : 0.75f);
        envmap_frame f = frame_of((double)d[0], (double)d[1], (double)d[2], (double)d[0] + 0.3,
                                  (double)d[1], (double)d[2]);
        double e = fabs(one_radiance(&src, &lambert, &f) * PI /
                            (double)envmap_texel(&dst, 0, 0, i / 4, i % 2, i % 4 / 2)[1] -
                        1);
        if (!(e <= worst)) worst = e;
    }
    FIGURE("Lambert against the diffuse map, 24 normals", worst, 1e-5);
    envmap_free(&src);
    envmap_free(&dst);
}

static void eq_1_of_phong_is_the_phong_map_above_the_horizon(void) {
    envmap src = noise(ENVMAP_CUBE, 32, 4), dst = black(ENVMAP_CUBE, 1, 1, 1);
    brdf_values v = values(0, 60, 0);
    envmap_brdf phong = model(brdf_phong, &v);
    envmap_lobe lobe = envmap_lobe_phong(60);
    envmap_frame f = seen_at(1); /* r_v = n = +z, the centre of face 4 */
    lobe.raw = 1;
    CHECK(filter(&dst, &src, lobe, ENVMAP_METHOD_REFERENCE, 0) == ENVMAP_OK);
    CHECK_CLOSE(one_radiance(&src, &phong, &f) / (double)envmap_texel(&dst, 0, 0, 4, 0, 0)[1], 1,
                1e-5);
    envmap_free(&src);
    envmap_free(&dst);
}

static void eq_1_is_black_from_behind_and_takes_any_tangent(void) {
    envmap src = noise(ENVMAP_LATLONG, 8, 5);
    brdf_values v = values(0.3, 0, 0);
    v.alpha_y = 0.1;
    envmap_brdf ward = model(brdf_ward, &v);
    envmap_frame f = frame_of(0, 0, 2, 0.3, 0.1, -0.1), g = seen_at(0.6);
    CHECK(one_radiance(&src, &ward, &f) == 0);
    double straight = one_radiance(&src, &ward, &g);
    g.t[2] = 5; /* not at right angles to n: what is along n goes */
    CHECK_CLOSE(one_radiance(&src, &ward, &g) / straight, 1, 1e-5);
    g.t[0] = 0; /* along n: any will do */
    CHECK(one_radiance(&src, &ward, &g) > 0);
    memset(g.t, 0, sizeof g.t);
    CHECK(one_radiance(&src, &ward, &g) > 0);
    envmap_free(&src);
}

static void not_a_number(double f[3], const double v[3], const double l[3], void *user) {
    (void)v, (void)user;
    f[0] = f[1] = 1, f[2] = l[2] < 0.2 ? (double)NAN : 1;
}

static void negative(double f[3], const double v[3], const double l[3], void *user) {
    (void)v, (void)l, (void)user;
    f[0] = f[2] = 1, f[1] = -1;
}

static void dark(double f[3], const double v[3], const double l[3], void *user) {
    (void)v, (void)l, (void)user;
    f[0] = f[1] = f[2] = 0;
}

static void bad_input_is_refused_and_nothing_is_written(void) {
    envmap src = noise(ENVMAP_CUBE, 8, 6), none = {0};
    brdf_values v = values(0.3, 0, 0);
    envmap_brdf ggx = model(brdf_ggx, &v), bad = model(not_a_number, NULL),
                minus = model(negative, NULL), null = {NULL, NULL}, nothing = model(dark, NULL);
    envmap_frame f[2] = {seen_at(0.5), seen_at(0.7)};
    float rgb[6] = {-7, -7, -7, -7, -7, -7};
    envmap_fit fit;
    CHECK(envmap_radiance(NULL, &src, &ggx, f, 2, NULL) == ENVMAP_ERROR_ARGUMENT);
    CHECK(envmap_radiance(rgb, &none, &ggx, f, 2, NULL) == ENVMAP_ERROR_ARGUMENT);
    CHECK(envmap_radiance(rgb, NULL, &ggx, f, 2, NULL) == ENVMAP_ERROR_ARGUMENT);
    CHECK(envmap_radiance(rgb, &src, NULL, f, 2, NULL) == ENVMAP_ERROR_ARGUMENT);
    CHECK(envmap_radiance(rgb, &src, &null, f, 2, NULL) == ENVMAP_ERROR_ARGUMENT);
    CHECK(envmap_radiance(rgb, &src, &ggx, NULL, 2, NULL) == ENVMAP_ERROR_ARGUMENT);
    CHECK(envmap_radiance(rgb, &src, &ggx, f, 0, NULL) == ENVMAP_ERROR_ARGUMENT);
    CHECK(envmap_radiance(rgb, &src, &bad, f, 2, NULL) == ENVMAP_ERROR_LOBE);
    CHECK(envmap_radiance(rgb, &src, &minus, f, 2, NULL) == ENVMAP_ERROR_LOBE);
    f[1].n[0] = NAN;
    CHECK(envmap_radiance(rgb, &src, &ggx, f, 2, NULL) == ENVMAP_ERROR_ARGUMENT);
    memset(f[1].n, 0, sizeof f[1].n);
    CHECK(envmap_radiance(rgb, &src, &ggx, f, 2, NULL) == ENVMAP_ERROR_ARGUMENT);
    f[1] = f[0], f[1].t[1] = INFINITY;
    CHECK(envmap_radiance(rgb, &src, &ggx, f, 2, NULL) == ENVMAP_ERROR_ARGUMENT);
    src.texels[9] = NAN;
    CHECK(envmap_radiance(rgb, &src, &ggx, f, 1, NULL) == ENVMAP_ERROR_RADIANCE);
    for (int i = 0; i < 6; ++i) CHECK(rgb[i] == -7);

    memset(&fit, 0, sizeof fit);
    CHECK(envmap_fit_brdf(NULL, &ggx, NULL) == ENVMAP_ERROR_ARGUMENT);
    CHECK(envmap_fit_brdf(&fit, &null, NULL) == ENVMAP_ERROR_ARGUMENT);
    fit.slices = 2, fit.size = 33;
    CHECK(envmap_fit_brdf(&fit, &bad, NULL) == ENVMAP_ERROR_LOBE);
    CHECK(envmap_fit_brdf(&fit, &minus, NULL) == ENVMAP_ERROR_LOBE);
    CHECK(envmap_fit_brdf(&fit, &nothing, NULL) == ENVMAP_ERROR_LOBE);
    fit.lobes = 4;
    CHECK(envmap_fit_brdf(&fit, &ggx, NULL) == ENVMAP_ERROR_ARGUMENT);
    fit.lobes = 1, fit.slices = 257;
    CHECK(envmap_fit_brdf(&fit, &ggx, NULL) == ENVMAP_ERROR_ARGUMENT);
    CHECK(!fit.table && !fit.axis && !fit.factor && !fit.error);
    envmap_lobe lobe = envmap_fit_lobe(&fit, 0), thin = envmap_lobe_banks(1);
    envmap dst = black(ENVMAP_CUBE, 2, 1, 1), two = noise(ENVMAP_CUBE, 4, 1);
    fill(&dst, -7);
    CHECK(envmap_filter(&dst, &two, &lobe, NULL) == ENVMAP_ERROR_LOBE);
    CHECK(envmap_filter(&dst, &two, &thin, NULL) == ENVMAP_ERROR_LOBE); /* Banks with s = 1 */
    CHECK(all_are(&dst, -7));
    CHECK(envmap_lobe_slices(&thin, 0.1) == 0 && envmap_lobe_slices(NULL, 0.1) == 0);
    CHECK(envmap_ggx_table(NULL, 4, NULL) == ENVMAP_ERROR_ARGUMENT);
    CHECK(envmap_ggx_table(rgb, 0, NULL) == ENVMAP_ERROR_ARGUMENT);
    envmap_fit_lookup(rgb, &fit, &two, f[0].n, f[0].v);
    CHECK(rgb[0] == 0 && rgb[1] == 0 && rgb[2] == 0);
    envmap_fit_lookup(NULL, NULL, NULL, NULL, NULL);
    envmap_lookup_fan(rgb, &two, f[0].n, f[0].t, NULL, rgb, rgb, 1);
    CHECK(rgb[0] == 0);
    CHECK(!envmap_fan(NULL, NULL, 0, 0, 0.1, 0.1) &&
          !envmap_fan(NULL, NULL, 0, (double)NAN, 0.1, 0.1) &&
          !envmap_fan(NULL, NULL, 0, 0.1, 0.1, 0));
    envmap_free(&src);
    envmap_free(&dst);
    envmap_free(&two);
}

static void memory_that_fails_leaves_no_trace(void) {
    envmap src = noise(ENVMAP_CUBE, 4, 6);
    brdf_values v = values(0.3, 0, 0);
    envmap_brdf ggx = model(brdf_ggx, &v);
    envmap_frame f = seen_at(0.5);
    float rgb[3] = {-7, -7, -7}, table[2] = {-7, -7};
    int live = oracle_live;
    for (int at = 0; at < 2; ++at) {
        envmap_fit fit;
        memset(&fit, 0, sizeof fit);
        fit.slices = 1, fit.size = 16;
        oracle_calls = 0, oracle_fail_at = at;
        CHECK(envmap_radiance(rgb, &src, &ggx, &f, 1, NULL) == ENVMAP_ERROR_MEMORY && rgb[0] == -7);
        oracle_calls = oracle_fail_at = 0; /* it asks once */
        CHECK(envmap_fit_brdf(&fit, &ggx, NULL) == ENVMAP_ERROR_MEMORY && !fit.table);
        oracle_calls = 0;
        CHECK(envmap_ggx_table(table, 1, NULL) == ENVMAP_ERROR_MEMORY && table[0] == -7);
        oracle_fail_at = -1;
        CHECK(oracle_live == live);
    }
    envmap_free(&src);
}

static void results_are_the_same_bits_on_any_thread(void) {
    envmap src = noise(ENVMAP_CUBE, 8, 6);
    brdf_values v = values(0.3, 0, 0);
    envmap_brdf ggx = model(brdf_ggx, &v);
    envmap_frame f[20];
    float a[60], b[60];
    static crew c;
    envmap_filter_desc desc = desc_of(0, 0);
    envmap_fit one, two;
    memset(&one, 0, sizeof one), memset(&two, 0, sizeof two);
    pthread_mutex_init(&c.lock, NULL);
    c.threads = 3;
    desc.work.executor.user = &c, desc.work.executor.run = crew_run;
    for (int i = 0; i < 20; ++i) f[i] = seen_at((i + 0.5) / 20);
    CHECK(envmap_radiance(a, &src, &ggx, f, 20, NULL) == ENVMAP_OK);
    CHECK(envmap_radiance(b, &src, &ggx, f, 20, &desc.work) == ENVMAP_OK);
    CHECK(!memcmp(a, b, sizeof a));
    one.slices = two.slices = 4, one.size = two.size = 65, one.lobes = two.lobes = 2;
    CHECK(envmap_fit_brdf(&one, &ggx, NULL) == ENVMAP_OK);
    CHECK(envmap_fit_brdf(&two, &ggx, &desc.work) == ENVMAP_OK);
    CHECK(envmap_ggx_table(a, 4, NULL) == ENVMAP_OK);
    CHECK(envmap_ggx_table(b, 4, &desc.work) == ENVMAP_OK);
    CHECK(!memcmp(a, b, 32 * sizeof *a));
    CHECK(!memcmp(one.table, two.table, (2 * 4 * 65 + 4 * 8 + 4) * sizeof(float)));
    envmap_fit_free(&one);
    envmap_fit_free(&two);
    envmap_fit_free(&two);
    envmap_free(&src);
    pthread_mutex_destroy(&c.lock);
}

/* Cancels at the first report, the second, ...: nothing is written and nothing leaks. A call that is
   not cancelled reports 1 in the end. */
static void check_cancelled(envmap_result (*call)(float *out, const envmap_work *work), int least) {
    int at = 0, live = oracle_live;
    for (envmap_result result = ENVMAP_CANCELLED; result == ENVMAP_CANCELLED && at < 1000;) {
        float out[128];
        envmap_filter_desc desc = desc_of(0, 0);
        watch w = {0, 0, 0, 0};
        w.cancel_at = ++at;
        desc.work.progress.user = &w, desc.work.progress.report = watch_report;
        for (int i = 0; i < 128; ++i) out[i] = -7;
        result = call(out, &desc.work);
        CHECK(oracle_live == live && w.disorder == 0);
        if (result == ENVMAP_CANCELLED) {
            CHECK(w.calls == at);
            for (int i = 0; i < 128; ++i) CHECK(out[i] == -7);
        } else CHECK(result == ENVMAP_OK && w.calls == at - 1 && w.last == 1.0f && out[0] > -7);
    }
    CHECK(at > least);
}

static envmap_result radiance_of_three(float *out, const envmap_work *work) {
    envmap src = noise(ENVMAP_CUBE, 4, 6);
    brdf_values v = values(0.3, 0, 0);
    envmap_brdf ggx = model(brdf_ggx, &v);
    envmap_frame f[3] = {seen_at(0.5), seen_at(0.6), seen_at(0.7)};
    envmap_result result = envmap_radiance(out, &src, &ggx, f, 3, work);
    envmap_free(&src);
    return result;
}

static envmap_result table_of_eight(float *out, const envmap_work *work) {
    return envmap_ggx_table(out, 8, work);
}

/* A pointer that was written shows as a number. */
static envmap_result fit_of_three_slices(float *out, const envmap_work *work) {
    brdf_values v = values(0.3, 0, 0);
    envmap_brdf ggx = model(brdf_ggx, &v);
    envmap_fit fit;
    memset(&fit, 0, sizeof fit);
    fit.slices = 3, fit.size = 16;
    envmap_result result = envmap_fit_brdf(&fit, &ggx, work);
    if (fit.table || fit.axis || fit.factor || fit.error) out[0] = 1;
    envmap_fit_free(&fit);
    return result;
}

static void cancelled_calls_write_nothing(void) {
    check_cancelled(radiance_of_three, 3);
    check_cancelled(table_of_eight, 8);
    check_cancelled(fit_of_three_slices, 3);
}

/* ---------------------------------------------------------------------------------- Fresnel -- */

static void fresnel_has_its_textbook_values(void) {
    double brewster = cos(atan(1.5)), rs = (1 - 2.25) / (1 + 2.25);
    CHECK_CLOSE(envmap_fresnel(1, 1.5, 0), 0.04, 1e-15);
    CHECK_CLOSE(envmap_fresnel(0, 1.5, 0), 1, 2e-16);
    CHECK_CLOSE(envmap_fresnel(brewster, 1.5, 0), rs * rs / 2, 1e-12); /* p is not reflected */
    CHECK_CLOSE(envmap_fresnel(1, 0.27, 2.95),
                (0.73 * 0.73 + 2.95 * 2.95) / (1.27 * 1.27 + 2.95 * 2.95), 1e-12);
    CHECK_CLOSE(envmap_fresnel(0, 0.27, 2.95), 1, 0);
    for (int i = 0; i <= 20; ++i) {
        double c = i / 20.0, critical = sqrt(1 - 0.75 * 0.75), s = sqrt(1 - c * c);
        CHECK_CLOSE(envmap_fresnel(c, 1, 0), 0, 1e-15);
        if (c < critical) CHECK_CLOSE(envmap_fresnel(c, 0.75, 0), 1, 1e-14);
        if (s < 1 / 1.5 && c > 0) /* reversed light: the same part is reflected */
            CHECK_CLOSE(envmap_fresnel(c, 1 / 1.5, 0),
                        envmap_fresnel(sqrt(1 - 2.25 * s * s), 1.5, 0), 1e-12);
        /* unpolarised, by Snell's law and Fresnel's two formulas */
        double ct = sqrt(1 - s * s / 2.25), a = (c - 1.5 * ct) / (c + 1.5 * ct),
               b = (1.5 * c - ct) / (1.5 * c + ct);
        CHECK_CLOSE(envmap_fresnel(c, 1.5, 0), (a * a + b * b) / 2, 1e-13);
    }
    CHECK(envmap_fresnel(1e-9, 1, 0) < 1e-12);
    CHECK_CLOSE(envmap_fresnel(2, 1.5, 0), envmap_fresnel(1, 1.5, 0), 1e-17);
    CHECK_CLOSE(envmap_fresnel(-1, 1.5, 0), 1, 2e-16);
    CHECK(envmap_fresnel((double)NAN, 1.5, 0) == 0 && envmap_fresnel(1, 0, 0) == 0 &&
          envmap_fresnel(1, (double)NAN, 0) == 0 && envmap_fresnel(1, 1, -1) == 0 &&
          envmap_fresnel(1, HUGE_VAL, 0) == 0 && envmap_fresnel(1, 1e9, 0) == 0 &&
          envmap_fresnel(1, 2, 1e9) == 0 && envmap_fresnel(1, 2, 9e8) > 0.99);
    CHECK_CLOSE(envmap_fresnel_schlick(1, 0.04), 0.04, 1e-17);
    CHECK_CLOSE(envmap_fresnel_schlick(0, 0.04), 1, 2e-16);
    CHECK(envmap_fresnel_schlick(0.5, 2) == 0);
}

static void schlick_is_near_fresnel_for_a_dielectric(void) {
    double worst = 0;
    for (int i = 0; i <= 100; ++i) {
        double e =
            fabs(envmap_fresnel(i / 100.0, 1.5, 0) - envmap_fresnel_schlick(i / 100.0, 0.04));
        if (e > worst) worst = e;
    }
    FIGURE("Schlick against a dielectric of n = 1.5", worst, 0.04);
}

static void compositions_keep_the_furnace(void) {
    /* in a constant environment of 1 over white F L_mirror + (1-F) L_d is 1 at every angle; the sum
       without 1 - F gains F; the VR paper's (1-F) L_diffuse + F L_glossy is 1 in every channel */
    envmap src = ones(16), glossy = black(ENVMAP_CUBE, 2, 1, 1);
    brdf_values v = values(0, 0, 0);
    envmap_brdf lambert = model(brdf_lambert, &v);
    const double n[3] = {0.2, 1.5, 2.4}, k[3] = {3, 0, 0};
    CHECK(filter(&glossy, &src, envmap_lobe_phong(30), ENVMAP_METHOD_REFERENCE, 0) == ENVMAP_OK);
    for (int i = 1; i <= 10; ++i) {
        envmap_frame f = seen_at(i / 10.0);
        double diffuse = one_radiance(&src, &lambert, &f); /* the texels' own error is 1.3e-3 */
        float mirror[3], gloss[3];
        envmap_lookup(mirror, &src, f.n, 0);
        envmap_lookup(gloss, &glossy, f.n, 0);
        for (int c = 0; c < 3; ++c) {
            double F = envmap_fresnel(i / 10.0, n[c], k[c]);
            CHECK_CLOSE(F * (double)mirror[c] + (1 - F) * diffuse, 1, 2e-3);
            CHECK_CLOSE(F * (double)mirror[c] + diffuse, 1 + F, 2e-3);
            CHECK_CLOSE((1 - F) * diffuse + F * (double)gloss[c], 1, 2e-3);
        }
    }
    envmap_free(&src);
    envmap_free(&glossy);
}

/* ------------------------------------------------------------------------------------- fits -- */

static envmap_fit fit_of(const envmap_brdf *brdf, int lobes, int slices, int flat) {
    envmap_fit fit;
    memset(&fit, 0, sizeof fit);
    fit.lobes = lobes, fit.slices = slices, fit.flat = flat;
    if (!CHECK(envmap_fit_brdf(&fit, brdf, NULL) == ENVMAP_OK)) exit(1);
    return fit;
}

static void fits_find_phong_and_lambert_again(void) {
    brdf_values v = values(0, 50, 0);
    envmap_brdf phong = model(brdf_phong, &v), lambert = model(brdf_lambert, &v);
    envmap_fit fit = fit_of(&phong, 1, 8, 0);
    envmap_lobe lobe = envmap_fit_lobe(&fit, 0), truth = envmap_lobe_phong(50);
    double worst = 0, error = 0;
    for (int i = 0; i < 100; ++i) { /* seen steeply: p = 1 */
        double x = cos(PI * i / 200),
               e = fabs(envmap_lobe_value(&lobe, x, 1) * (double)fit.factor[3 * 7] -
                        envmap_lobe_value(&truth, x, 0));
        if (!(e <= worst)) worst = e;
    }
    FIGURE("Phong N = 50 found again: largest error, of its peak", worst, 0.01);
    CHECK_CLOSE(fit.axis[7], 1, 0.02);
    for (int k = 3; k < 8; ++k) error = fmax(error, (double)fit.error[k]);
    FIGURE("... fit.error where n.v > 0.37", error, 0.02);
    printf("    ... grazing, n.v = 0.06: %.2f\n", (double)fit.error[0]);
    CHECK((double)fit.error[0] > 0.2); /* the lobe knows no horizon */
    envmap_fit_free(&fit);
    fit = fit_of(&lambert, 2, 8, 1);
    for (int k = 0; k < 8; ++k) {
        CHECK_CLOSE(fit.factor[3 * (8 + k)] + fit.factor[3 * k], 1, 0.02);
        CHECK((double)fit.error[k] < 0.02);
    }
    envmap_fit_free(&fit);
}

static void green_phong(double f[3], const double v[3], const double l[3], void *user) {
    brdf_phong(f, v, l, user);
    f[0] = f[2] = 0;
}

static void fits_of_a_green_model_are_those_of_a_grey_one_in_green(void) {
    brdf_values v = values(0, 50, 0);
    envmap_brdf grey = model(brdf_phong, &v), green = model(green_phong, &v);
    envmap_fit a = fit_of(&grey, 1, 2, 0), b = fit_of(&green, 1, 2, 0);
    for (int k = 0; k < 2; ++k) {
        CHECK_CLOSE(a.axis[k], b.axis[k], 1e-6);
        CHECK_CLOSE(a.factor[3 * k + 1], b.factor[3 * k + 1], 1e-5);
        CHECK_CLOSE(fabsf(b.factor[3 * k]) + fabsf(b.factor[3 * k + 2]), 0, 0);
    }
    for (int i = 0; i < 2 * a.size; ++i) CHECK_CLOSE(a.table[i], b.table[i], 1e-4);
    envmap_fit_free(&a), envmap_fit_free(&b);
}

static void fits_reflect_all_of_a_constant_environment(void) {
    envmap src = ones(8);
    brdf_values v = values(0.3, 0, 0);
    envmap_brdf ggx = model(brdf_ggx, &v);
    for (int form = 0; form < 3; ++form) { /* one lobe in 3D, in 2D, two lobes */
        envmap_fit fit = fit_of(&ggx, 1 + (form == 2), 12, form == 1);
        envmap map[2] = {black(ENVMAP_CUBE, 2, 1, 12), black(ENVMAP_CUBE, 2, 1, 12)};
        double worst = 0;
        for (int i = 0; i < fit.lobes; ++i) {
            envmap_lobe lobe = envmap_fit_lobe(&fit, i);
            CHECK(envmap_filter(map + i, &src, &lobe, NULL) == ENVMAP_OK);
        }
        for (int k = 0; k < 12; ++k) {
            double c = (k + 0.5) / 12, scale, bias;
            envmap_frame f = seen_at(c);
            float rgb[3];
            envmap_fit_lookup(rgb, &fit, map, f.n, f.v);
            envmap_ggx_split_sum(&scale, &bias, c, 0.3);
            double e = fabs((double)rgb[1] / (scale + bias) - 1);
            if (!(e <= worst)) worst = e;
        }
        FIGURE(form == 2 ? "two lobes of GGX in a furnace, against the albedo"
               : form    ? "one lobe in 2D"
                         : "one lobe in 3D",
               worst, 0.005);
        envmap_fit_free(&fit);
        envmap_free(map);
        envmap_free(map + 1);
    }
    envmap_free(&src);
}

/* f of a fit: the sum of factor * lobe, over n.l. */
static double fitted(const envmap_fit *fit, double cv, const double l[3]) {
    double theta = acos(cv), f = 0, at = fmin(fmax(cv * fit->slices - 0.5, 0), fit->slices - 1.0);
    int k = (int)at, next = k + 1 < fit->slices ? k + 1 : k;
    for (int i = 0; i < fit->lobes; ++i) {
        const float *m = fit->axis + i * fit->slices, *g = fit->factor + 3 * i * fit->slices;
        double psi = theta * ((double)m[k] + (at - k) * (double)(m[next] - m[k]));
        double factor = (double)g[3 * k] + (at - k) * (double)(g[3 * next] - g[3 * k]);
        envmap_lobe lobe = envmap_fit_lobe(fit, i);
        f += factor * envmap_lobe_value(&lobe, l[0] * sin(psi) + l[2] * cos(psi), cv);
    }
    return f / l[2];
}

static void fits_are_reciprocal_where_the_model_is(void) {
    brdf_values v = values(0, 20, 0);
    envmap_brdf lafortune = model(brdf_lafortune, &v), lambert = model(brdf_lambert, &v);
    const envmap_brdf *models[2] = {&lafortune, &lambert};
    const double bound[2] = {0.2, 1e-3};
    for (int m = 0; m < 2; ++m) {
        envmap_fit fit = fit_of(models[m], 2, 16, 0);
        double worst = 0, peak = 0;
        for (int i = 0; i < 12; ++i)
            for (int j = 0; j < 12; ++j) {
                double a = 1.1 * (i + 0.5) / 12, b = 1.1 * (j + 0.5) / 12; /* up to 63 degrees */
                double la[3] = {sin(a), 0, cos(a)}, lb[3] = {sin(b), 0, cos(b)};
                double there = fitted(&fit, cos(a), lb), back = fitted(&fit, cos(b), la);
                worst = fmax(worst, fabs(there - back)), peak = fmax(peak, there);
            }
        FIGURE(m ? "Lambert's fit: f(v,l) - f(l,v), of the peak"
                 : "Lafortune's N = 20: f(v,l) - f(l,v), of the peak",
               worst / peak, bound[m]);
        envmap_fit_free(&fit);
    }
}

static void fits_err_by_angle_as_n_r_leaves_n_l(void) {
    envmap src = smooth(ENVMAP_CUBE, 12), map = black(ENVMAP_CUBE, 12, 1, 12);
    brdf_values v = values(0.5, 0, 0);
    envmap_brdf ggx = model(brdf_ggx, &v);
    envmap_fit fit = fit_of(&ggx, 1, 12, 0);
    envmap_lobe lobe = envmap_fit_lobe(&fit, 0);
    CHECK(filter(&map, &src, lobe, ENVMAP_METHOD_REFERENCE, 0) == ENVMAP_OK);
    static const double bound[4] = {0.1, 0.08, 0.05, 0.03}, cosine[4] = {0.1, 0.3, 0.6, 0.9};
    for (int k = 0; k < 4; ++k) {
        double off = 0, sum = 0;
        for (int i = 0; i < 24; ++i) {
            float d[3], rgb[3], t[3], b[3];
            envmap_direction(d, ENVMAP_CUBE, i / 4, 0.3f + 0.4f * (float)(i % 2),
                             i % 4 < 2 ? 0.2f : 0.7f);
            method_frame(t, b, d);
            envmap_frame f;
            for (int j = 0; j < 3; ++j) {
                f.n[j] = d[j], f.t[j] = t[j];
                f.v[j] = (float)(cosine[k] * (double)d[j] +
                                 sqrt(1 - cosine[k] * cosine[k]) * (double)b[j]);
            }
            double truth = one_radiance(&src, &ggx, &f);
            envmap_fit_lookup(rgb, &fit, &map, f.n, f.v);
            off += ((double)rgb[1] - truth) * ((double)rgb[1] - truth), sum += truth * truth;
        }
        char what[80];
        sprintf(what, "GGX 0.5 by one 3D lobe, n.v = %.1f: rms against eq. 1", cosine[k]);
        FIGURE(what, sqrt(off / sum), bound[k]);
    }
    envmap_fit_free(&fit);
    envmap_free(&src);
    envmap_free(&map);
}

static void slices_needed_are_enough(void) {
    envmap_lobe banks = envmap_lobe_banks(0.6f), phong = envmap_lobe_phong(9);
    envmap src = noise(ENVMAP_CUBE, 8, 2);
    int n = envmap_lobe_slices(&banks, 0.03);
    CHECK(envmap_lobe_slices(&phong, 0.03) == 1);
    CHECK(n > 4 && n < 64 && envmap_lobe_slices(&banks, 0.1) < n);
    envmap few = black(ENVMAP_PARABOLOID, 8, 1, n), many = black(ENVMAP_PARABOLOID, 8, 1, 8 * n);
    CHECK(filter(&few, &src, banks, ENVMAP_METHOD_REFERENCE, 0) == ENVMAP_OK &&
          filter(&many, &src, banks, ENVMAP_METHOD_REFERENCE, 0) == ENVMAP_OK);
    double off = 0, sum = 0;
    for (int i = 0; i < 400; ++i) {
        float d[3], a[3], b[3], p = (float)(-1 + 2 * (i + 0.5) / 400);
        envmap_direction(d, ENVMAP_LATLONG, 0, (float)(i * 0.618034 - floor(i * 0.618034)),
                         ((float)(i % 20) + 0.5f) / 20);
        envmap_lookup_slice(a, &few, d, p, 0);
        envmap_lookup_slice(b, &many, d, p, 0);
        off += (double)(a[1] - b[1]) * (double)(a[1] - b[1]), sum += (double)b[1] * (double)b[1];
    }
    printf("    Banks s = 0.6 to 3 %%: %d slices\n", n);
    FIGURE("... rms against 8 times as many, noise", sqrt(off / sum), 0.03);
    envmap_free(&src);
    envmap_free(&few);
    envmap_free(&many);
}

/* -------------------------------------------------------------------------------------- GGX -- */

/* The split sum over half vectors, at t = alpha tan psi from n, in columns of phi that end where the
   light sets: n Gauss nodes for each quarter of phi and 2n for psi, close to where columns end and
   where cos phi is 0. */
static void ggx_by_normals(double sums[2], double c, double a, int n) {
    static double x[96], wx[96], y[192], wy[192];
    static int made;
    double sv = sqrt(1 - c * c), aa = a * a;
    if (made != n) o_gauss(n, x, wx), o_gauss(2 * n, y, wy), made = n;
    sums[0] = sums[1] = 0;
    for (int i = 0; i < 2 * n; ++i) {
        double q = (1 + x[i / 2]) / 2, w = wx[i / 2] * 0.75 * q * q;
        double along = sv * sin(PI / 2 * q * q * q) * (i % 2 ? -1 : 1);
        double root = sqrt(along * along + c * c), end = atan((along + root) / (a * c));
        if (along < 0) end = atan(c / (a * (root - along)));
        for (int j = 0; j < 2 * n; ++j) {
            double u = (1 + y[j]) / 2, part = w * wy[j] * 1.5 * u * u * end;
            double psi = end * (1 - u * u * u), t = a * tan(psi), hz = 1 / sqrt(1 + t * t);
            double vh = (along * t + c) * hz, l = 2 * vh * hz - c, f = pow(1 - vh, 5);
            if (!(l > 0)) continue; /* by rounding */
            part *= 2 * sin(psi) * cos(psi) * 2 * l * vh / hz;
            part /= l * sqrt(aa + (1 - aa) * c * c) + c * sqrt(aa + (1 - aa) * l * l);
            sums[0] += part * (1 - f), sums[1] += part * f;
        }
    }
}

/* The same over lights, for alpha that is not small: f0 scale + bias. */
static double ggx_by_lights(double c, double a, double f0) {
    double x[96], w[96], sum = 0, v[3] = {sqrt(1 - c * c), 0, c}, f[3];
    brdf_values ggx = values(a, 0, 0);
    ggx.fresnel = 1, ggx.colour[0] = f0;
    o_gauss(96, x, w);
    for (int i = 0; i < 96; ++i)
        for (int j = 0; j < 400; ++j) {
            double z = (1 + x[i]) / 2, s = sqrt(1 - z * z), phi = 2 * PI * (j + 0.5) / 400;
            double l[3] = {s * cos(phi), s * sin(phi), z};
            brdf_ggx(f, v, l, &ggx);
            sum += w[i] / 2 * 2 * PI / 400 * z * f[0];
        }
    return sum;
}

static void ggx_by_normals_and_by_lights_are_the_same_integral(void) {
    double worst = 0, sums[2];
    for (int i = 0; i < 25; ++i) {
        double c = 0.1 + 0.9 * (i % 5) / 4, a = 0.5 + 0.5 * (i / 5) / 4;
        ggx_by_normals(sums, c, a, 64);
        worst = fmax(worst, fabs(ggx_by_lights(c, a, 1) - sums[0] - sums[1]));
        worst = fmax(worst, fabs(ggx_by_lights(c, a, 0) - sums[1]));
    }
    FIGURE("the two oracles of the split sum", worst, 1e-8);
}

static void ggx_terms_agree_with_quadrature_over_normals(void) {
    double worst = 0, steep = 0, open = 0, scale, bias, sums[2], more[2];
    unsigned long long state = 5;
    int n = test_many(1500);
    for (int i = 0; i < n; ++i) { /* even, or even in the logarithm: c from 1e-8, alpha from 1e-4 */
        double c = test_random(&state), a = fmax(test_random(&state), 1e-4);
        if (i & 1) c = pow(10, -8 * c);
        if (i & 2) a = pow(10, -4 * a);
        envmap_ggx_split_sum(&scale, &bias, c, a);
        ggx_by_normals(sums, c, a, 48);
        if (i < n / 10) ggx_by_normals(more, c, a, 96);
        if (i < n / 10)
            open = fmax(open, fmax(fabs(more[0] - sums[0]), fabs(more[1] - sums[1])));
        double error = fmax(fabs(scale - sums[0]), fabs(bias - sums[1]));
        worst = fmax(worst, error), steep = fmax(steep, c > 0.1 ? error : 0);
    }
    FIGURE("quadrature over half vectors against twice as many nodes", open, 1e-6);
    FIGURE("split sum against quadrature over half vectors", worst, 3e-5);
    FIGURE("... where n.v > 0.1", steep, 1e-5);
    envmap_ggx_split_sum(&scale, &bias, 0.5, 1e-4); /* a mirror: Schlick itself */
    CHECK_CLOSE(scale, 1 - 1.0 / 32, 1e-6);
    CHECK_CLOSE(bias, 1.0 / 32, 1e-6);
    envmap_ggx_split_sum(&scale, NULL, (double)NAN, 0.5);
    CHECK(scale == 0);
}

/* D is constant there, and the integral has a closed form: 1 - c log(1 + 1/c). */
static void ggx_of_alpha_1_reflects_1_minus_c_log_1_plus_1_over_c(void) {
    double worst = 0, scale, bias;
    for (int i = 0; i <= 600; ++i) {
        double c = pow(10, -i / 100.0);
        envmap_ggx_split_sum(&scale, &bias, c, 1);
        worst = fmax(worst, fabs(scale + bias - 1 + c * log1p(1 / c)));
    }
    FIGURE("scale + bias of alpha = 1 against the closed form", worst, 1e-5);
    envmap_ggx_split_sum(&scale, &bias, 0, 1);
    CHECK_CLOSE(scale + bias, 1, 1e-5);
}

static void entries_of_a_ggx_table_are_within_1e_4(void) {
    static float table[2 * 64 * 64];
    double worst = 0, sums[2];
    CHECK(envmap_ggx_table(table, 64, NULL) == ENVMAP_OK);
    for (int i = 0; i < 64 * 64; i += 1 + 4096 / test_many(4096)) {
        double r = (i / 64 + 0.5) / 64;
        ggx_by_normals(sums, (i % 64 + 0.5) / 64, fmax(r * r, 1e-4), 40);
        worst = fmax(worst, fabs((double)table[2 * i] - sums[0]));
        worst = fmax(worst, fabs((double)table[2 * i + 1] - sums[1]));
    }
    FIGURE("table of 64 x 64 against quadrature over half vectors", worst, 1e-4);
}

static void ggx_terms_agree_with_eq_1(void) {
    envmap src = ones(64);
    brdf_values v = values(0.5, 0, 0);
    v.fresnel = 1, v.colour[1] = 0.3;
    envmap_brdf ggx = model(brdf_ggx, &v);
    for (int i = 1; i <= 4; ++i) {
        envmap_frame f = seen_at(i / 4.0);
        double scale, bias;
        envmap_ggx_split_sum(&scale, &bias, i / 4.0, 0.5);
        CHECK_CLOSE(one_radiance(&src, &ggx, &f), 0.3 * scale + bias, 1e-3);
    }
    envmap_free(&src);
}

static void ggx_loses_nothing_with_its_multiple_scattering(void) {
    float table[2 * 36];
    CHECK(envmap_ggx_table(table, 6, NULL) == ENVMAP_OK);
    for (int i = 0; i < 36; ++i) {
        double scale, bias, r = (i / 6 + 0.5) / 6;
        envmap_ggx_split_sum(&scale, &bias, (i % 6 + 0.5) / 6, r * r);
        CHECK_CLOSE(table[2 * i], scale, 1e-7);
        CHECK_CLOSE(table[2 * i + 1], bias, 1e-7);
        CHECK_CLOSE(scale + bias + envmap_ggx_multiple(1, scale, bias), 1, 1e-12);
        double grey = 0.5 * scale + bias + envmap_ggx_multiple(0.5, scale, bias);
        CHECK(grey < 1 && grey > 0.5 * scale + bias);
    }
    double E = 0.04 * 0.5 + 0.1, F = 0.04 + 0.96 / 21; /* the formula of the header's comment */
    CHECK_CLOSE(envmap_ggx_multiple(0.04, 0.5, 0.1), F * E * 0.4 / (1 - F * 0.4), 1e-12);
    CHECK(envmap_ggx_multiple(2, 0.5, 0.1) == 0 && envmap_ggx_multiple((double)NAN, 0.5, 0.1) == 0);
}

static void roughness_and_level_are_inverse(void) {
    for (int i = 0; i <= 20; ++i)
        for (int q = 0; q <= 10; ++q) {
            double r = i / 20.0, bend = q / 10.0, l = envmap_roughness_level(r, 9, bend);
            CHECK_CLOSE(envmap_level_roughness(l, 9, bend), r, bend < 1 || r < 1 ? 1e-7 : 1e-7);
        }
    CHECK_CLOSE(envmap_roughness_level(0.5, 9, 0), 4, 1e-12);
    CHECK_CLOSE(envmap_roughness_level(0.5, 5, 1), 3, 1e-12);                /* r (2 - r) */
    CHECK_CLOSE(envmap_roughness_level(0.5, 7, 0.7), 0.5 * 1.35 * 6, 1e-12); /* r (1.7 - 0.7 r) */
    CHECK(envmap_roughness_level((double)NAN, 5, 0) == 0 && envmap_level_roughness(3, 1, 0) == 0);
}

/* ------------------------------------------------------------------------------------ Banks -- */

static void banks_end_to_end_is_eq_1_without_n_l(void) {
    envmap src = smooth(ENVMAP_CUBE, 12);
    envmap_lobe lobe = envmap_lobe_banks(0.5f);
    int slices = envmap_lobe_slices(&lobe, 0.03);
    envmap map = black(ENVMAP_PARABOLOID, 12, 1, slices);
    lobe.raw = 1;
    CHECK(filter(&map, &src, lobe, ENVMAP_METHOD_REFERENCE, 0) == ENVMAP_OK);
    brdf_values v = values(0, 0, 0.5);
    envmap_brdf banks = model(brdf_banks, &v);
    double off = 0, sum = 0, behind = 0;
    /* the hemispheres above and below n: eq. 1 sees one, the map both */
    for (int i = 0; i < 20; ++i) {
        double c = -0.9 + 1.8 * i / 19, s = sqrt(1 - c * c);
        envmap_frame up = frame_of(0, 0, 1, c, 0, s), down = frame_of(0, 0, -1, c, 0, -s);
        float rgb[3], t[3] = {1, 0, 0};
        envmap_lookup_slice(rgb, &map, t, (float)c, 0);
        double above = one_radiance(&src, &banks, &up), below = one_radiance(&src, &banks, &down);
        off += pow((double)rgb[1] - above - below, 2), sum += pow(above + below, 2),
            behind += below;
    }
    FIGURE("the map against eq. 1 of both hemispheres", sqrt(off / sum), 0.015);
    CHECK(behind > 0);
    envmap_free(&src);
    envmap_free(&map);
}

static void banks_sees_light_from_behind_and_eq_1_does_not(void) {
    envmap src = black(ENVMAP_CUBE, 16, 1, 1), map = black(ENVMAP_PARABOLOID, 12, 1, 16);
    for (int i = 0; i < 16 * 16 * 3; ++i)
        envmap_texel(&src, 0, 0, 5, 0, 0)[i] = 1; /* the -z face */
    envmap_lobe lobe = envmap_lobe_banks(0.5f);
    CHECK(filter(&map, &src, lobe, ENVMAP_METHOD_REFERENCE, 0) == ENVMAP_OK);
    brdf_values v = values(0, 0, 0.5);
    envmap_brdf banks = model(brdf_banks, &v), shadowed = model(brdf_banks_shadowed, &v);
    envmap_frame f = frame_of(0, 0, 1, 0, 0.6, 0.8), back = frame_of(0, 0, -1, 0, 0.6, -0.8);
    float rgb[3], t[3] = {1, 0, 0};
    envmap_lookup_slice(rgb, &map, t, 0, 0);
    CHECK((double)rgb[1] > 0.1);
    CHECK(one_radiance(&src, &banks, &f) == 0 && one_radiance(&src, &shadowed, &f) == 0);
    double whole = one_radiance(&src, &banks, &back),
           with_cosine = one_radiance(&src, &shadowed, &back);
    CHECK(with_cosine > 0 && with_cosine < whole);
    envmap_free(&src);
    envmap_free(&map);
}

/* ------------------------------------------------------------------------------------- fans -- */

static void a_fan_of_round_lobes_is_elliptical(void) {
    static const double tolerance[3] = {0.3, 0.05, 0.003};
    for (int k = 0; k < 3; ++k) {
        float offset[256], weight[256];
        double worst = 0, along = 0.4, across = 0.1, sum = 0;
        int n = envmap_fan(offset, weight, 256, along, across, tolerance[k]);
        CHECK(n > 1 && n <= 256 && n == envmap_fan(NULL, NULL, 0, along, across, tolerance[k]));
        for (int i = 0; i < n; ++i) sum += (double)weight[i];
        CHECK_CLOSE(sum, 1, 1e-5);
        for (int x = -80; x <= 80; ++x) { /* on the line, where the comb's ripple lives */
            double at = x * 0.01, lobe = 0,
                   truth = exp(-at * at / (2 * along * along)) * across / along;
            for (int i = 0; i < n; ++i)
                lobe += (double)weight[i] *
                        exp(-pow(at - (double)offset[i], 2) / (2 * across * across));
            double e = fabs(lobe / truth - 1);
            if (!(e <= worst)) worst = e;
        }
        char what[80];
        sprintf(what, "%d taps, 4 : 1, tolerance %g: ripple within 2 sigma", n, tolerance[k]);
        FIGURE(what, worst, 3 * tolerance[k]);
    }
    CHECK(envmap_fan(NULL, NULL, 0, 0.1, 0.1, 0.1) == 1 &&
          envmap_fan(NULL, NULL, 0, 0.1, 0.3, 0.1) == 1);
}

static void a_fan_about_n_is_the_sum_of_its_maps(void) {
    envmap map = smooth(ENVMAP_CUBE, 32);
    float offset[64], weight[64], rgb[3], one[3], n[3] = {0, 0, 1}, t[3] = {1, 0, 5}, sum = 0;
    int count = envmap_fan(offset, weight, 64, 0.3, 0.1, 0.05);
    envmap_lookup_fan(rgb, &map, n, t, n, offset, weight, count);
    for (int i = 0; i < count; ++i) { /* with v = n: a great circle through n */
        float d[3] = {sinf(offset[i]), 0, cosf(offset[i])};
        envmap_lookup(one, &map, d, 0);
        sum += weight[i] * one[1];
    }
    CHECK_CLOSE(rgb[1], sum, 1e-5);
    envmap_free(&map);
}

/* ---------------------------------------------------------------------------------- methods -- */

static void cabral_blends_towards_eq_1_with_more_views(void) {
    envmap src = smooth(ENVMAP_CUBE, 8);
    brdf_values v = values(0, 20, 0);
    envmap_brdf brdf = model(brdf_lafortune, &v);
    static const double bound[3] = {0.1, 0.04, 0.02};
    for (int m = 1; m <= 3; ++m) {
        cabral set;
        double off = 0, sum = 0;
        CHECK(cabral_create(&set, &src, &brdf, m, 24, NULL) == ENVMAP_OK &&
              set.count == 4 * m * m + 2);
        for (int i = 0; i < 300; ++i) {
            float d[3], t[3], b[3], rgb[3];
            envmap_frame f;
            double tilt = 1.2 * (i % 17) / 17, turn = i * 2.4;
            envmap_direction(d, ENVMAP_LATLONG, 0, (float)(i * 0.618034 - floor(i * 0.618034)),
                             ((float)i + 0.5f) / 300);
            method_frame(t, b, d);
            for (int j = 0; j < 3; ++j) {
                f.v[j] = d[j], f.t[j] = 0;
                f.n[j] = (float)(cos(tilt) * (double)d[j] +
                                 sin(tilt) * (cos(turn) * (double)t[j] + sin(turn) * (double)b[j]));
            }
            cabral_lookup(rgb, &set, f.n, f.v);
            double truth = one_radiance(&src, &brdf, &f);
            off += pow((double)rgb[1] - truth, 2), sum += truth * truth;
        }
        char what[80];
        sprintf(what, "%d views: rms against eq. 1", set.count);
        FIGURE(what, sqrt(off / sum), bound[m - 1]);
        cabral_free(&set);
    }
    cabral bad;
    CHECK(cabral_create(&bad, &src, &brdf, 0, 24, NULL) == ENVMAP_ERROR_ARGUMENT);
    CHECK(cabral_create(&bad, NULL, &brdf, 1, 24, NULL) == ENVMAP_ERROR_ARGUMENT);
    envmap_free(&src);
}

static void cabral_corners_are_counted_once_and_weights_hold_the_view(void) {
    for (int m = 1; m < 6; ++m) {
        int seen[200] = {0};
        for (int x = -m; x <= m; ++x)
            for (int y = -m; y <= m; ++y)
                for (int z = -m; z <= m; ++z)
                    if (abs(x) + abs(y) + abs(z) == m) {
                        int i = cabral_index(m, x, y, z);
                        CHECK(i >= 0 && i < 4 * m * m + 2 && !seen[i]++);
                    }
        unsigned long long state = 1;
        for (int k = 0; k < 200; ++k) {
            float v[3], w[3];
            int index[3];
            for (int j = 0; j < 3; ++j) v[j] = (float)test_random(&state) - 0.5f;
            cabral_triangle(index, w, m, v);
            CHECK_CLOSE(w[0] + w[1] + w[2], 1, 1e-4);
            for (int j = 0; j < 3; ++j)
                CHECK(w[j] >= 0 && index[j] >= 0 && index[j] < 4 * m * m + 2);
        }
    }
}

static void the_map_for_a_view_holds_its_lookups(void) {
    envmap src = smooth(ENVMAP_CUBE, 8), map = black(ENVMAP_SPHERE, 32, 1, 1);
    brdf_values shiny = values(0, 20, 0);
    envmap_brdf brdf = model(brdf_lafortune, &shiny);
    const float v[3] = {0.48f, 0.6f, 0.64f};
    float weight[3], frame[9];
    int index[3];
    cabral set;
    CHECK(cabral_create(&set, &src, &brdf, 2, 24, NULL) == ENVMAP_OK);
    cabral_triangle(index, weight, set.steps, v);
    method_frame(frame, frame + 3, v);
    memcpy(frame + 6, v, sizeof v);
    CHECK(cabral_view(&map, &set, index, weight, frame) == ENVMAP_OK);
    for (int i = 5; i < 27; ++i) {
        float d[3], r[3], n[3], rgb[3];
        envmap_direction(d, ENVMAP_SPHERE, 0, ((float)i + 0.5f) / 32, 0.4f + 0.5f / 32);
        cabral_turn(r, frame, d);
        for (int k = 0; k < 3; ++k) n[k] = r[k] + v[k];
        cabral_lookup(rgb, &set, n, v);
        float mine[3];
        envmap_lookup(mine, &map, d, 0);
        CHECK_CLOSE(mine[1], rgb[1], 2e-2 * (double)rgb[1]);
    }
    CHECK(cabral_view(&src, &set, index, weight, frame) == ENVMAP_ERROR_ARGUMENT);
    cabral_free(&set);
    envmap_free(&src);
    envmap_free(&map);
}

static void drawn_silhouettes_have_the_same_width_at_every_level(void) {
    envmap map = black(ENVMAP_SPHERE, 128, 6, 1), averaged = black(ENVMAP_SPHERE, 128, 6, 1);
    npr_silhouette_desc desc = {3, {1, 1, 1}, {0, 0, 0}};
    CHECK(npr_silhouette(&map, &desc) == ENVMAP_OK &&
          npr_silhouette(&averaged, &desc) == ENVMAP_OK);
    CHECK(envmap_mips_build(&averaged) == ENVMAP_OK);
    for (int l = 0; l < 5; ++l) {
        int edge = 128 >> l;
        double ink = 0, grey = 0; /* along the middle row, from the rim inwards */
        for (int x = 0; x < edge / 2; ++x) {
            ink += 1 - (double)envmap_texel(&map, l, 0, 0, x, edge / 2)[1];
            grey += 1 - (double)envmap_texel(&averaged, l, 0, 0, x, edge / 2)[1];
        }
        CHECK_CLOSE(ink, 3, 0.6);
        if (l > 1) CHECK(grey < 0.5 * ink); /* what averaging leaves of it */
    }
    envmap_free(&map);
    envmap_free(&averaged);
}

static void gooch_is_drawn_with_two_triangles_and_a_circle_and_blurred(void) {
    envmap map = black(ENVMAP_SPHERE, 64, 1, 1);
    npr_gooch_desc gooch = {{1, 0.8f, 0.2f}, {0.1f, 0.2f, 0.9f}, {0, 0.6f, 0.8f}, 50};
    const float *middle = envmap_texel(&map, 0, 0, 0, 10, 32), *highlight;
    highlight = envmap_texel(&map, 0, 0, 0, 32, 32 - 10); /* of (l + z)/|l + z|: y = 0.316 */
    CHECK(npr_gooch_drawn(&map, &gooch, 0) == ENVMAP_OK);
    CHECK_CLOSE(envmap_texel(&map, 0, 0, 0, 32, 60)[2], 0.9, 1e-4);
    CHECK_CLOSE(envmap_texel(&map, 0, 0, 0, 32, 3)[0], 1, 1e-4);
    CHECK_CLOSE(highlight[2], 1, 1e-4);
    CHECK_CLOSE(middle[2], 0.9, 1e-4);
    CHECK(npr_gooch_drawn(&map, &gooch, 0.2f) == ENVMAP_OK);
    CHECK(middle[2] > 0.45f && middle[2] < 0.7f); /* half warm, half cool */
    CHECK(highlight[2] > 0.3f && highlight[2] < 0.95f);
    CHECK(npr_gooch_drawn(&map, &gooch, -1) == ENVMAP_ERROR_ARGUMENT);
    envmap_free(&map);
}

static void drawn_maps_are_what_their_formulas_say(void) {
    envmap map = black(ENVMAP_SPHERE, 64, 1, 1), cube = black(ENVMAP_CUBE, 8, 1, 1);
    npr_gooch_desc gooch = {{1, 0.8f, 0.2f}, {0.1f, 0.2f, 0.9f}, {0, 1, 0}, 50};
    npr_window_desc window = {{0.1f, 0.1f, 0.2f}, {2, 2, 2}, 2};
    npr_hatch_desc hatch = {5, 0.6f, {1, 1, 1}, {0, 0, 0}};
    CHECK(npr_gooch(&map, &gooch) == ENVMAP_OK);
    CHECK_CLOSE(envmap_texel(&map, 0, 0, 0, 32, 62)[2], 0.9, 0.05); /* turned away: cool */
    CHECK_CLOSE(envmap_texel(&map, 0, 0, 0, 32, 1)[0], 1, 0.05);    /* towards the light: warm */
    CHECK(npr_window(&map, &window) == ENVMAP_OK);
    int panes = 0;
    for (int i = 0; i < 64 * 64; ++i) panes += map.texels[3 * i] > 1.9f;
    CHECK(panes > 60 && panes < 1500);
    CHECK(npr_hatch(&map, &hatch) == ENVMAP_OK);
    CHECK(envmap_texel(&map, 0, 0, 0, 32, 32)[0] == 1.0f); /* none in the middle */
    double ink = 0;
    for (int i = 0; i < 64; ++i) ink += 1 - (double)envmap_texel(&map, 0, 0, 0, i, 4)[0];
    CHECK(ink > 2);
    CHECK(npr_gooch(&cube, &gooch) == ENVMAP_ERROR_ARGUMENT &&
          npr_gooch(NULL, &gooch) == ENVMAP_ERROR_ARGUMENT &&
          npr_gooch(&map, NULL) == ENVMAP_ERROR_ARGUMENT &&
          npr_hatch(&map, NULL) == ENVMAP_ERROR_ARGUMENT);
    envmap_free(&map);
    envmap_free(&cube);
}

int main(void) {
    RUN(eq_1_of_lambert_is_the_diffuse_map);
    RUN(eq_1_of_phong_is_the_phong_map_above_the_horizon);
    RUN(eq_1_is_black_from_behind_and_takes_any_tangent);
    RUN(bad_input_is_refused_and_nothing_is_written);
    RUN(memory_that_fails_leaves_no_trace);
    RUN(results_are_the_same_bits_on_any_thread);
    RUN(cancelled_calls_write_nothing);
    RUN(fresnel_has_its_textbook_values);
    RUN(schlick_is_near_fresnel_for_a_dielectric);
    RUN(compositions_keep_the_furnace);
    RUN(fits_find_phong_and_lambert_again);
    RUN(fits_of_a_green_model_are_those_of_a_grey_one_in_green);
    RUN(fits_reflect_all_of_a_constant_environment);
    RUN(fits_are_reciprocal_where_the_model_is);
    RUN(fits_err_by_angle_as_n_r_leaves_n_l);
    RUN(slices_needed_are_enough);
    RUN(ggx_by_normals_and_by_lights_are_the_same_integral);
    RUN(ggx_terms_agree_with_quadrature_over_normals);
    RUN(ggx_of_alpha_1_reflects_1_minus_c_log_1_plus_1_over_c);
    RUN(entries_of_a_ggx_table_are_within_1e_4);
    RUN(ggx_terms_agree_with_eq_1);
    RUN(ggx_loses_nothing_with_its_multiple_scattering);
    RUN(roughness_and_level_are_inverse);
    RUN(banks_end_to_end_is_eq_1_without_n_l);
    RUN(banks_sees_light_from_behind_and_eq_1_does_not);
    RUN(a_fan_of_round_lobes_is_elliptical);
    RUN(a_fan_about_n_is_the_sum_of_its_maps);
    RUN(cabral_blends_towards_eq_1_with_more_views);
    RUN(cabral_corners_are_counted_once_and_weights_hold_the_view);
    RUN(the_map_for_a_view_holds_its_lookups);
    RUN(drawn_silhouettes_have_the_same_width_at_every_level);
    RUN(gooch_is_drawn_with_two_triangles_and_a_circle_and_blurred);
    RUN(drawn_maps_are_what_their_formulas_say);
    return test_summary();
}
