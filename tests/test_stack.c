/* SPDX-License-Identifier: MIT
   The stack that calls take: 16 KB at the most, as the header says. Each call runs on a thread
   whose stack was painted before; what it touched shows afterwards. Its tasks run on the same
   thread, so the depth of a call and of its deepest task are seen together. */
#define _XOPEN_SOURCE 600 /* pthread_attr_setstack */
#include "helpers.h"

#define STACK (1 << 18)
#define MOST  16384

/* The sanitizers and unoptimised code have larger frames, which this is not about. */
#if defined(__SANITIZE_ADDRESS__) || !defined(__OPTIMIZE__)
#define MEASURED 0
#elif defined(__has_feature)
#if __has_feature(address_sanitizer)
#define MEASURED 0
#endif
#endif
#ifndef MEASURED
#define MEASURED 1
#endif

static unsigned char stack[STACK];
static envmap source, result, slices, levels;
static double sh[3 * 64 * 64], other[3 * 64 * 64];

static void *nothing(void *user) { return user; }

/* Bytes of stack that are touched when `call` runs. */
static double depth_of(void *(*call)(void *)) {
    pthread_attr_t attributes;
    pthread_t thread;
    size_t clean = 0;
    memset(stack, 0xA5, STACK);
    pthread_attr_init(&attributes);
    CHECK(!pthread_attr_setstack(&attributes, stack, STACK));
    if (!CHECK(!pthread_create(&thread, &attributes, call, NULL))) return 0;
    CHECK(!pthread_join(thread, NULL));
    pthread_attr_destroy(&attributes);
    while (clean < STACK && stack[clean] == 0xA5) ++clean;
    return (double)(STACK - clean);
}

/* Once before, as the first call of a function of libm's takes the dynamic linker's stack. */
static void check_stack(const char *what, void *(*call)(void *)) {
    CHECK(call(NULL) == NULL);
    double depth = depth_of(call) - depth_of(nothing);
    if (MEASURED) FIGURE(what, depth, MOST);
    else CHECK(depth < STACK);
}

/* A call as a thread's function; NULL where it went well. */
#define CALL(name, expression)                                                                     \
    static void *name(void *user) { return (expression) ? &source : user; }

static envmap_result filtered(envmap *dst, envmap_lobe lobe, int method) {
    return filter(dst, &source, lobe, method, 0);
}

static envmap_result chained(int method) {
    envmap_filter_desc desc = desc_of(method, 0);
    envmap_lobe lobes[5];
    for (int l = 0; l < 5; ++l) lobes[l] = envmap_lobe_ggx((float)(l * l) / 16);
    return envmap_filter_chain(&levels, &source, lobes, 5, &desc);
}

static envmap_result planned(envmap_lobe lobe, const envmap *dst) {
    envmap_plan plan;
    return envmap_filter_plan(&plan, dst, &source, &lobe, NULL);
}

static envmap_result prepared(void) {
    envmap_prepared p = {0};
    envmap_lobe lobes[2] = {envmap_lobe_diffuse(), envmap_lobe_phong(50)};
    envmap_result done = envmap_prepare(&p, &source, lobes, 2, NULL);
    envmap_prepared_free(&p);
    return done;
}

static envmap_result resampled(int from, int to) {
    envmap src = smooth(from, 24), dst = black(to, 16, 1, 1);
    envmap_result done = envmap_resample(&dst, &src, NULL);
    envmap_free(&src), envmap_free(&dst);
    return done;
}

static int resampled_all(void) {
    int bad = 0;
    for (int i = 0; i < ENVMAP_MAPPING_COUNT * ENVMAP_MAPPING_COUNT; ++i)
        bad += resampled(i / ENVMAP_MAPPING_COUNT, i % ENVMAP_MAPPING_COUNT) != ENVMAP_OK;
    return bad;
}

static double cosine(double x, double p, void *user) { return (void)user, x > 0 ? x + p : p; }

static void lambert(double f[3], const double v[3], const double l[3], void *user) {
    (void)user;
    for (int c = 0; c < 3; ++c) f[c] = l[2] * v[2] + 0.1;
}

static envmap_result fitted(void) {
    envmap_brdf brdf = {lambert, NULL};
    envmap_fit fit = {0};
    fit.lobes = 3, fit.slices = 4;
    envmap_result done = envmap_fit_brdf(&fit, &brdf, NULL);
    envmap_fit_free(&fit);
    return done;
}

static envmap_result shaded(void) {
    envmap_brdf brdf = {lambert, NULL};
    envmap_frame frame = {{0, 0, 1}, {1, 0, 0}, {0, 1, 1}};
    float rgb[3];
    return envmap_radiance(rgb, &source, &brdf, &frame, 1, NULL);
}

static envmap_result zonal(void) {
    envmap_lobe lobe = envmap_lobe_function(cosine, NULL);
    return envmap_lobe_zonal(other, 4096, &lobe, 0.5);
}

static envmap_result windowed(void) {
    envmap_lobe lobe = envmap_lobe_phong(20);
    double dir[3] = {0.3, 0.5, 0.7}, Y[64];
    envmap_sh_basis(Y, 8, dir);
    for (int i = 0; i < 192; ++i) sh[i] = Y[i / 3];
    return envmap_sh_window(other, NULL, sh, 8, &lobe, 0);
}

static envmap_result rotated(void) {
    double turn[9] = {0, 1, 0, 0, 0, 1, 1, 0, 0};
    return envmap_sh_rotate(other, sh, 8, turn);
}

static int counted(void) {
    envmap_lobe phong = envmap_lobe_phong(5000), banks = envmap_lobe_banks(0.9f);
    return envmap_sh_bands(&phong, 0, NULL, 0, 1e-4) < 1 || envmap_lobe_slices(&banks, 0.01) < 1;
}

static envmap_result tabled(void) {
    static float values[2 * 8 * 8];
    return envmap_ggx_table(values, 8, NULL);
}

static envmap_result compared(void) {
    envmap_difference difference;
    return envmap_compare(&difference, &result, &result, 0);
}

CALL(diffuse, filtered(&result, envmap_lobe_diffuse(), ENVMAP_METHOD_FAST))
CALL(phong, filtered(&result, envmap_lobe_phong(100), ENVMAP_METHOD_FAST))
CALL(sharp, filtered(&result, envmap_lobe_phong(20000), ENVMAP_METHOD_FAST))
CALL(tail, filtered(&result, envmap_lobe_ggx(0.01f), ENVMAP_METHOD_FAST))
CALL(banks, filtered(&slices, envmap_lobe_banks(0.9f), ENVMAP_METHOD_FAST))
CALL(function, filtered(&slices, envmap_lobe_function(cosine, NULL), ENVMAP_METHOD_FAST))
CALL(hierarchical, filtered(&result, envmap_lobe_phong(50), ENVMAP_METHOD_HIERARCHICAL))
CALL(reference, filtered(&result, envmap_lobe_phong(50), ENVMAP_METHOD_REFERENCE))
CALL(chain, chained(ENVMAP_METHOD_AUTO))
CALL(preparing, prepared())
CALL(planning, planned(envmap_lobe_phong(50), &result))
CALL(planning_slices, planned(envmap_lobe_banks(0.5f), &slices))
CALL(projecting, envmap_sh_project(sh, 8, &source, 0, 0, NULL))
CALL(projecting_fast, envmap_sh_project(sh, 64, &source, 0, 1e-3, NULL))
CALL(filling, envmap_sh_fill(&result, 0, 0, sh, 8, 0, NULL))
CALL(filling_fast, envmap_sh_fill(&result, 0, 0, sh, 8, 1e-3, NULL))
CALL(windowing, windowed())
CALL(rotating, rotated())
CALL(zonal_numbers, zonal())
CALL(counting, counted())
CALL(resampling, resampled_all())
CALL(mips, envmap_mips_build(&levels))
CALL(cleaning, envmap_clean(&result, 0, NULL))
CALL(table, tabled())
CALL(fitting, fitted())
CALL(shading, shaded())
CALL(comparing, compared())

#define STACK_OF(name) check_stack(#name, name)

static void filters_take_16_KB_of_stack(void) {
    STACK_OF(diffuse), STACK_OF(phong), STACK_OF(sharp), STACK_OF(tail), STACK_OF(banks);
    STACK_OF(function), STACK_OF(hierarchical), STACK_OF(reference), STACK_OF(chain);
    STACK_OF(preparing), STACK_OF(planning), STACK_OF(planning_slices);
}

static void harmonics_take_16_KB_of_stack(void) {
    STACK_OF(projecting), STACK_OF(projecting_fast), STACK_OF(filling), STACK_OF(filling_fast);
    STACK_OF(windowing), STACK_OF(rotating), STACK_OF(zonal_numbers), STACK_OF(counting);
}

static void conversions_and_materials_take_16_KB_of_stack(void) {
    STACK_OF(resampling), STACK_OF(mips), STACK_OF(cleaning), STACK_OF(table);
    STACK_OF(fitting), STACK_OF(shading), STACK_OF(comparing);
}

int main(void) {
    source = noise(ENVMAP_CUBE, 48, 7);
    for (int c = 0; c < 3; ++c) /* lamps, which FAST and its plan sum apart */
        envmap_texel(&source, 0, 0, c, 20, 3)[c] = 1e4f;
    result = black(ENVMAP_CUBE, 32, 1, 1), slices = black(ENVMAP_CUBE, 16, 1, 8);
    levels = black(ENVMAP_CUBE, 32, 5, 1);
    RUN(filters_take_16_KB_of_stack);
    RUN(harmonics_take_16_KB_of_stack);
    RUN(conversions_and_materials_take_16_KB_of_stack);
    envmap_free(&source), envmap_free(&result), envmap_free(&slices), envmap_free(&levels);
    return test_summary();
}
