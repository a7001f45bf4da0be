/* SPDX-License-Identifier: MIT
   Calls with hostile arguments, callbacks, memory and executors, drawn at random: the rules of
   fuzz_calls.c, where every compiler and every machine can hold them. A broken rule ends the
   program. CALLS=n draws more. */
#include "fuzz_calls.c"
#include <limits.h>

static void random_calls_end_well_and_leave_no_trace(void) {
    unsigned long long state = 20261127;
    uint8_t bytes[256];
    int count = getenv("CALLS") ? atoi(getenv("CALLS")) : (getenv("TEST_QUICK") ? 100 : 400);
    for (int n = 0; n < count; ++n) {
        for (int i = 0; i < 256; ++i) bytes[i] = (uint8_t)(256 * test_random(&state));
        LLVMFuzzerTestOneInput(bytes, sizeof bytes);
    }
    for (int r = 0; r < ENVMAP_RESULT_COUNT; ++r)
        if (fuzz_results[r]) printf("    %7d %s\n", fuzz_results[r], envmap_result_text(r));
    CHECK(fuzz_results[ENVMAP_OK] > count / 4 && fuzz_results[ENVMAP_ERROR_RADIANCE] > 0);
}

/* ------------------------------------------------------------- sizes at the ends of integers -- */

static const int ends[] = {INT_MIN, -INT_MAX, -1,      0,       1,       2048,        4096,   4097,
                           16384,   16385,    46341,   65536,   1 << 20, 1 << 28,     1 << 30,
                           INT_MAX - 1, INT_MAX};
enum { ENDS = sizeof ends / sizeof *ends };

/* Bytes of a map, in double, which holds them all. */
static double bytes_of(int mapping, int size, int levels, int slices) {
    double texels = 0;
    for (int l = 0; l < levels; ++l) {
        double edge = oracle_edge(size, l);
        texels += envmap_faces(mapping) * edge * edge * (mapping == ENVMAP_LATLONG ? 2 : 1);
    }
    return 12 * texels * slices;
}

static void check_create(int mapping, int size, int levels, int slices) {
    envmap map = {0};
    int bad = size < 1 || levels < 1 || slices < 1 || levels > envmap_levels(size);
    double bytes = bad ? 0 : bytes_of(mapping, size, levels, slices);
    int large = size > 16384 || slices > 4096;
    large |= bytes > 8589934592.0 || bytes > (double)PTRDIFF_MAX;
    oracle_largest = 0;
    envmap_result r = envmap_create(&map, mapping, size, levels, slices);
    int ok = bad ? r == ENVMAP_ERROR_ARGUMENT
             : large ? r == ENVMAP_ERROR_LIMIT
                     : r == (bytes > (double)oracle_most ? ENVMAP_ERROR_MEMORY : ENVMAP_OK);
    ok &= bad || large ? oracle_largest == 0 : bytes >= (double)oracle_largest;
    ok &= bad || large || bytes <= (double)oracle_largest;
    if (!CHECK(ok && !map.texels == !!r))
        printf("    %s %d, %d levels, %d slices\n", oracle_name[mapping], size, levels, slices);
    envmap_free(&map);
}

static void maps_are_as_large_as_they_say_or_refused(void) {
    size_t most = oracle_most;
    oracle_most = (size_t)1 << 19;
    for (int m = 0; m < MAPPINGS; ++m)
        for (int i = 0; i < ENDS; ++i)
            for (int k = 0; k < ENDS; ++k) {
                check_create(m, ends[i], 1, ends[k]);
                check_create(m, ends[i], ends[k], 1);
                check_create(m, ends[i], envmap_levels(ends[i]), ends[k]);
            }
    oracle_most = most;
}

static void a_files_size_is_right_or_refused(void) {
    float texel[3] = {0, 0, 0};
    for (int m = 0; m < MAPPINGS; ++m)
        for (int slices = 1; slices <= 4096; slices *= 2)
            for (int size = 1; size <= 16384; size *= 2) {
                envmap map = {texel, NULL, 0, 0, 1, 0, -1, 1};
                size_t bytes = 7;
                map.mapping = m, map.size = size, map.slices = slices;
                if (m == ENVMAP_LATLONG && slices > 1) continue;
                double room = bytes_of(m, size, 1, slices);
                envmap_result r = envmap_pfm_write(NULL, 0, &bytes, &map, 0);
                if (room > (double)PTRDIFF_MAX) CHECK(r == ENVMAP_ERROR_ARGUMENT && bytes == 7);
                else CHECK(!r && (double)bytes > room + 10 && (double)bytes < room + 64);
            }
}

/* No table is read: 4 numbers are all that there is. */
static void tables_that_integers_cannot_count_are_refused(void) {
    static const float table[4] = {1, 1, 1, 1};
    double lambda[2];
    for (int i = 0; i < ENDS; ++i)
        for (int k = 0; k < ENDS; ++k) {
            envmap_lobe lobe = envmap_lobe_table(table, ends[i], ends[k], 0, 1);
            double numbers = (double)ends[i] * ends[k];
            if (ends[i] >= 4 && ends[i] <= 1 << 20 && ends[k] >= 1 && ends[k] <= 4096 &&
                numbers <= 1 << 28)
                continue;
            CHECK(envmap_lobe_zonal(lambda, 2, &lobe, 0) == ENVMAP_ERROR_LOBE);
            CHECK(envmap_lobe_value(&lobe, 1, 0) == 0.0);
        }
}

static void counts_at_the_ends_of_integers_are_refused(void) {
    static double many[4096];
    envmap map = {0}, other = {0};
    envmap_difference difference;
    envmap_prepared prepared = {NULL, NULL};
    envmap_lobe lobe = envmap_lobe_diffuse();
    double dir[3] = {0, 0, 1};
    float rgb[3], up[3] = {0, 1, 0};
    int kind = 0, shape[3];
    envmap_frame frame = {{0, 0, 1}, {1, 0, 0}, {0, 0, 1}};
    envmap_brdf brdf;
    brdf.function = draw_brdf, brdf.user = &kind;
    CHECK(!envmap_create(&map, ENVMAP_CUBE, 2, 2, 1));
    CHECK(!envmap_create(&other, ENVMAP_CUBE, 2, 2, 1));
    for (int i = 0; i < ENDS; ++i) {
        int n = ends[i], odd = n < 1 || n > 1;
        if (!n) continue;
        CHECK(!envmap_texel(&map, n, 0, 0, 0, 0) == (odd != 0));
        CHECK(!envmap_texel(&map, 0, 0, n, n, n) == (odd != 0));
        CHECK(!envmap_texel(&map, 0, n, 0, 0, 0));
        CHECK(!odd || !(envmap_solid_angle(&map, n, n, n, n) > 0));
        CHECK(!!envmap_compare(&difference, &map, &other, n) == odd);
        CHECK(!!envmap_sh_basis(many, n, dir) == odd);
        CHECK(!!envmap_sh_project(many, n, &map, 0, 0, NULL) == odd);
        CHECK(envmap_sh_project(many, 1, &map, n, 0, NULL) == ENVMAP_ERROR_ARGUMENT);
        CHECK(!!envmap_sh_fill(&map, 0, 0, many, n, 0, NULL) == odd);
        CHECK(!!envmap_sh_fill(&map, n, 0, many, 1, 0, NULL) == odd);
        CHECK(!!envmap_lobe_zonal(many, n, &lobe, 0) == (n < 1 || n > 4096));
        CHECK(!!envmap_filter_chain(&map, &other, &lobe, n, NULL) == odd);
        CHECK(!!envmap_prepare(&prepared, &other, &lobe, n, NULL) == odd);
        envmap_prepared_free(&prepared);
        if (n < 1 || n > INT_MAX / 4)
            CHECK(envmap_radiance(rgb, &map, &brdf, &frame, n, NULL) == ENVMAP_ERROR_ARGUMENT);
        if (n < 1 || n > 1024) CHECK(envmap_ggx_table(rgb, n, NULL) == ENVMAP_ERROR_ARGUMENT);
        CHECK(isfinite(envmap_roughness_level(1, n, 0.7)));
        CHECK(isfinite(envmap_level_roughness(1, n, 0)));
        envmap_lookup_footprint(rgb, &map, up, up, up, n);
        for (int k = 0; k < 3; ++k) {
            shape[0] = shape[1] = 1, shape[2] = 16, shape[k] = n;
            envmap_fit fit = {0, 0, 0, 0, NULL, NULL, NULL, NULL, NULL};
            fit.lobes = shape[0], fit.slices = shape[1], fit.size = shape[2];
            int good = shape[0] == 1 && shape[1] == 1 && n >= (k == 2 ? 16 : 1) && n <= 65536;
            CHECK(envmap_fit_brdf(&fit, &brdf, NULL) == (good ? ENVMAP_OK : ENVMAP_ERROR_ARGUMENT));
            envmap_fit_free(&fit);
        }
    }
    envmap_free(&map), envmap_free(&other);
}

int main(void) {
    RUN(maps_are_as_large_as_they_say_or_refused);
    RUN(a_files_size_is_right_or_refused);
    RUN(tables_that_integers_cannot_count_are_refused);
    RUN(counts_at_the_ends_of_integers_are_refused);
    RUN(random_calls_end_well_and_leave_no_trace);
    return test_summary();
}
