/* SPDX-License-Identifier: MIT
   Compiled with -ffast-math, under which compilers take every number for finite: envmap.h decides
   by bits, so what is not finite is refused all the same. Exits with 0 when all of it was. */
#define ENVMAP_STATIC
#define ENVMAP_IMPLEMENTATION
#include "envmap.h"

#include <stdio.h>

static int wrong;

static void expect(const char *call, const char *with, int result, int expected) {
    if (result == expected) return;
    ++wrong;
    printf("%s with %s: %s\n", call, with, envmap_result_text(result));
}

/* Every call that reads radiance. */
static void expect_of_map(envmap *dst, const envmap *src, const char *with, int expected) {
    envmap_lobe lobe = envmap_lobe_phong(30);
    envmap_prepared prepared = {0};
    envmap_plan plan;
    double sh[27];
    for (int method = 0; method < ENVMAP_METHOD_COUNT; ++method) {
        envmap_filter_desc desc = {0};
        desc.method = method;
        expect("filter", with, envmap_filter(dst, src, &lobe, &desc), expected);
    }
    expect("prepare", with, envmap_prepare(&prepared, src, &lobe, 1, NULL), expected);
    envmap_prepared_free(&prepared);
    expect("plan", with, envmap_filter_plan(&plan, dst, src, &lobe, NULL), expected);
    expect("resample", with, envmap_resample(dst, src, NULL), expected);
    expect("project", with, envmap_sh_project(sh, 3, src, 0, 0, NULL), expected);
    expect("project fast", with, envmap_sh_project(sh, 3, src, 0, 1e-3, NULL), expected);
}

/* Every call that reads other numbers. */
static void expect_of_numbers(envmap *dst, const envmap *src, const char *with, float bad) {
    envmap_lobe lobe = envmap_lobe_phong(bad);
    envmap_filter_desc desc = {0};
    double sh[27] = {0}, rgb[3], d[3] = {0, 0, 1};
    expect("lobe", with, envmap_filter(dst, src, &lobe, NULL), ENVMAP_ERROR_LOBE);
    lobe.parameter = 30, desc.tolerance = bad;
    expect("desc", with, envmap_filter(dst, src, &lobe, &desc), ENVMAP_ERROR_ARGUMENT);
    sh[7] = (double)bad;
    expect("evaluate", with, envmap_sh_evaluate(rgb, sh, 3, d), ENVMAP_ERROR_RADIANCE);
    expect("fill", with, envmap_sh_fill(dst, 0, 0, sh, 3, 1e-3, NULL), ENVMAP_ERROR_RADIANCE);
}

int main(void) {
    static const struct {
        const char *name;
        uint32_t bits;
    } bad[] = {{"NaN", 0x7FC00000}, {"-NaN", 0xFFC00001}, {"Inf", 0x7F800000},
               {"-Inf", 0xFF800000}};
    envmap src = {0}, dst = {0};
    if (envmap_create(&src, ENVMAP_CUBE, 32, 1, 1) || envmap_create(&dst, ENVMAP_CUBE, 16, 1, 1))
        return 1;
    for (int i = 0; i < 3 * 6 * 32 * 32; ++i) src.texels[i] = 1 + (float)(i % 7);
    expect_of_map(&dst, &src, "numbers", ENVMAP_OK);
    for (int i = 0; i < 4; ++i) {
        float number;
        memcpy(&number, &bad[i].bits, sizeof number);
        expect_of_numbers(&dst, &src, bad[i].name, number);
        memcpy(src.texels + 7777, &number, sizeof number);
        expect_of_map(&dst, &src, bad[i].name, ENVMAP_ERROR_RADIANCE);
        src.texels[7777] = 1;
    }
    envmap_free(&src), envmap_free(&dst);
    return wrong;
}
