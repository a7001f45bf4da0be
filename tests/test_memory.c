/* SPDX-License-Identifier: MIT
   The memory that calls take at once, beside their results: as much as the header says. S and D are
   the bytes of level 0 of a source and of all levels of a result, L the bands of a lobe. */
#include "helpers.h"

#define MB 1e6

static double bytes_of(const envmap *map) { return 4.0 * (double)floats_of(map); }

static void run_tasks(void *user, envmap_task *task, void *context, int count) {
    (void)user;
    for (int i = 0; i < count; ++i) task(context, i);
}

/* A call's arguments, whatever it is. */
typedef struct work {
    envmap src, dst;
    envmap_lobe lobes[6];
    int count, bands;
    envmap_filter_desc desc;
    const char *name;
} work;

typedef envmap_result call(work *w);

/* The most that the call holds at once, over a bound; all of it is given back. */
static void check_memory(work *w, call *run, double bound, const char *what) {
    char text[128];
    oracle_held = oracle_peak = 0, oracle_metered = 1;
    CHECK(run(w) == ENVMAP_OK);
    oracle_metered = 0;
    CHECK(oracle_held == 0);
    snprintf(text, sizeof text, "%s, %s: %.1f MB of %.1f", w->name, what, (double)oracle_peak / MB,
             bound / MB);
    FIGURE(text, (double)oracle_peak / bound, 1);
}

static work work_of(const char *name, int from, int size, int to, int edge, int levels) {
    work w;
    memset(&w, 0, sizeof w);
    w.name = name, w.count = levels;
    w.src = noise(from, size, 3), w.dst = black(to, edge, levels, 1);
    for (int c = 0; c < 3; ++c) envmap_texel(&w.src, 0, 0, 0, 5, size / 3)[c] = 3e4f;
    return w;
}

static void work_free(work *w) { envmap_free(&w->src), envmap_free(&w->dst); }

static envmap_result filtered(work *w) {
    return envmap_filter_chain(&w->dst, &w->src, w->lobes, w->count, &w->desc);
}

static envmap_result planned(work *w) {
    envmap_plan plan;
    return envmap_filter_plan(&plan, &w->dst, &w->src, w->lobes, &w->desc);
}

static envmap_result prepared(work *w) {
    envmap_prepared p = {NULL, NULL};
    envmap_result done = envmap_prepare(&p, &w->src, w->lobes, w->count, &w->desc);
    envmap_prepared_free(&p);
    return done;
}

static envmap_result projected(work *w) {
    static double sh[3 * 64 * 64];
    return envmap_sh_project(sh, w->bands, &w->src, 0, (double)w->desc.tolerance, &w->desc.work);
}

static envmap_result filled(work *w) {
    static double sh[3 * 64 * 64];
    sh[0] = 1;
    return envmap_sh_fill(&w->dst, 0, 0, sh, w->bands, (double)w->desc.tolerance, &w->desc.work);
}

static const struct {
    const char *name;
    int from, size, to, edge;
} shapes[] = {{"cube to cube", ENVMAP_CUBE, 128, ENVMAP_CUBE, 128},
              {"cube to a small one", ENVMAP_CUBE, 128, ENVMAP_CUBE, 16},
              {"lat-long to cube", ENVMAP_LATLONG, 128, ENVMAP_CUBE, 64},
              {"octahedral to lat-long", ENVMAP_OCTAHEDRAL, 200, ENVMAP_LATLONG, 64},
              {"angular to cube", ENVMAP_ANGULAR, 128, ENVMAP_CUBE, 64}};
enum { SHAPES = sizeof shapes / sizeof *shapes };

static work shape_of(int i) {
    return work_of(shapes[i].name, shapes[i].from, shapes[i].size, shapes[i].to, shapes[i].edge, 1);
}

/* What FAST needs where a lobe is at least two texels wide. */
static double fast_bytes(const work *w, double result) {
    double L = 0;
    for (int i = 0; i < w->count; ++i)
        L = fmax(L, 1.5 * envmap_sh_bands(w->lobes + i, 0, NULL, 0, 1e-3));
    return bytes_of(&w->src) + result + 100 * L * L + 2 * MB;
}

static void the_definition_takes_four_sources_and_a_result(void) {
    for (int i = 0; i < SHAPES; ++i) {
        work w = shape_of(i);
        w.desc.method = ENVMAP_METHOD_REFERENCE;
        w.lobes[0] = envmap_lobe_phong(3e4f);
        if (w.dst.size > 16) {
            envmap_free(&w.dst);
            w.dst = black(shapes[i].to, 8, 1, 1);
        }
        check_memory(&w, filtered, 4 * bytes_of(&w.src) + bytes_of(&w.dst) + 2e4, "Phong 3e4");
        work_free(&w);
    }
}

/* sigma is 1.45 texels; 960000 places are the most. */
static void lobes_of_one_to_two_texels_keep_the_places_of_their_tents(void) {
    for (int edge = 32; edge <= 128; edge *= 4) {
        work w = work_of(edge == 32 ? "cube of 32" : "cube of 128", ENVMAP_CUBE, edge, ENVMAP_CUBE,
                         4, 1);
        double texels = 6.0 * edge * edge, places = 16 * texels <= 960000 ? 16 * texels : 0;
        w.desc.method = ENVMAP_METHOD_REFERENCE;
        w.lobes[0] = envmap_lobe_gaussian((float)(0.232 * edge * edge));
        check_memory(&w, filtered, 4 * bytes_of(&w.src) + bytes_of(&w.dst) + 24 * places + 2e4,
                     "of 1.45 texels");
        work_free(&w);
    }
}

static void the_hierarchical_method_takes_eight_sources_and_a_result(void) {
    work w = work_of("cube to a tiny one", ENVMAP_CUBE, 64, ENVMAP_CUBE, 8, 1);
    w.desc.method = ENVMAP_METHOD_HIERARCHICAL, w.lobes[0] = envmap_lobe_phong(50);
    check_memory(&w, filtered, 8 * bytes_of(&w.src) + bytes_of(&w.dst) + 4e4, "Phong 50");
    work_free(&w);
}

static void lobes_of_two_texels_take_both_maps_and_the_square_of_bands(void) {
    for (int i = 0; i < SHAPES; ++i) {
        work w = shape_of(i);
        w.lobes[0] = envmap_lobe_phong(10);
        check_memory(&w, filtered, fast_bytes(&w, bytes_of(&w.dst)), "Phong 10");
        w.lobes[0] = envmap_lobe_phong(150);
        check_memory(&w, filtered, fast_bytes(&w, bytes_of(&w.dst)), "Phong 150");
        check_memory(&w, planned, fast_bytes(&w, 0), "its plan");
        check_memory(&w, prepared, fast_bytes(&w, 0), "prepared");
        w.desc.work.executor.run = run_tasks;
        check_memory(&w, filtered, fast_bytes(&w, bytes_of(&w.dst)), "Phong 150, tasks");
        work_free(&w);
    }
}

/* Where values and places of all texels are in memory at once, beside rings of more samples. Sums
   of few texels take no more, where their tail is written before. */
static void the_sharpest_lobes_of_bands_take_four_or_five_sources(void) {
    static const float exponents[4] = {500, 800, 1100, 1400};
    work w = work_of("cube to cube", ENVMAP_CUBE, 128, ENVMAP_CUBE, 128, 1);
    double both = 2 * bytes_of(&w.src);
    for (int i = 0; i < 4; ++i) {
        w.lobes[0] = envmap_lobe_phong(exponents[i]);
        check_memory(&w, filtered, 2 * both, "Phong 500 to 1400");
    }
    work_free(&w);
    w = work_of("cube to cube", ENVMAP_CUBE, 256, ENVMAP_CUBE, 256, 1);
    w.lobes[0] = envmap_lobe_ggx(0.01f), both = 2 * bytes_of(&w.src);
    check_memory(&w, filtered, 2 * both, "GGX 0.01");
    work_free(&w);
    w = work_of("lat-long to cube", ENVMAP_LATLONG, 256, ENVMAP_CUBE, 256, 1);
    w.lobes[0] = envmap_lobe_ggx(0.01f);
    check_memory(&w, filtered, 5 * bytes_of(&w.src), "GGX 0.01");
    work_free(&w);
}

static void sharp_lobes_take_nine_of_both_maps_and_three_MB_a_task(void) {
    for (int i = 0; i < SHAPES; ++i) {
        work w = shape_of(i);
        double bound = 9 * (bytes_of(&w.src) + bytes_of(&w.dst)) + 2 * MB;
        w.lobes[0] = envmap_lobe_phong(1e6f);
        check_memory(&w, filtered, bound, "Phong 1e6");
        w.lobes[0] = envmap_lobe_ggx(0.01f);
        /* Points about a rim take 52 bytes each: here 6 MB, at most 104 MB (ENVMAPI_MANY / 2). */
        if (w.src.mapping == ENVMAP_ANGULAR || w.src.mapping == ENVMAP_SPHERE) bound += 6 * MB;
        check_memory(&w, filtered, bound, "GGX 0.01");
        w.desc.work.executor.run = run_tasks;
        check_memory(&w, filtered, bound + 48 * MB, "GGX 0.01, tasks");
        work_free(&w);
    }
}

static int go_on(void *user, float fraction) {
    (void)user, (void)fraction;
    return 0;
}

/* Sums that add to a tail have their memory before the tail is written to the result itself. Whom a
   callback may cancel gets a copy, with the same bits. */
static void a_tail_is_written_when_its_sums_have_their_memory(void) {
    for (int latlong = 0; latlong < 2; ++latlong) {
        work w = work_of("", latlong ? ENVMAP_LATLONG : ENVMAP_CUBE, 128, ENVMAP_CUBE, 64, 1);
        envmap staged = black(ENVMAP_CUBE, 64, 1, 1);
        size_t bytes = floats_of(&w.dst) * sizeof(float);
        int fail = 0;
        envmap_result result;
        w.lobes[0] = envmap_lobe_ggx(0.01f);
        for (; fail < 60; ++fail) {
            oracle_calls = 0, oracle_fail_at = fail;
            result = filtered(&w);
            if (result == ENVMAP_OK) break;
            CHECK(result == ENVMAP_ERROR_MEMORY && !memcmp(w.dst.texels, staged.texels, bytes));
        }
        oracle_fail_at = -1;
        CHECK(fail > 10 && fail < 60);
        w.desc.work.progress.report = go_on;
        CHECK(!envmap_filter(&staged, &w.src, w.lobes, &w.desc));
        CHECK(!memcmp(w.dst.texels, staged.texels, bytes));
        envmap_free(&staged), work_free(&w);
    }
}

static void a_chain_takes_no_more_than_its_dearest_level(void) {
    work w = work_of("cube to a chain", ENVMAP_CUBE, 128, ENVMAP_CUBE, 128, 6);
    for (int l = 0; l < 6; ++l) w.lobes[l] = envmap_lobe_phong(400.0f / (float)(1 << l));
    check_memory(&w, filtered, fast_bytes(&w, bytes_of(&w.dst)), "Phong 400 and wider");
    w.lobes[0] = envmap_lobe_mirror();
    check_memory(&w, filtered, fast_bytes(&w, bytes_of(&w.dst)), "the mirror first");
    work_free(&w);
}

static void coefficients_take_sixteen_sets_or_a_map_and_the_square_of_bands(void) {
    work w = shape_of(0);
    w.bands = 3;
    check_memory(&w, projected, 16 * 24.0 * 9 + 144 * 12 * 128.0 + 4e3, "projected, exact");
    check_memory(&w, filled, bytes_of(&w.dst) + 1e3, "filled, exact");
    w.desc.tolerance = 1e-3f, w.bands = 64;
    check_memory(&w, projected, bytes_of(&w.src) + 1e3 * 64 * 64, "projected");
    check_memory(&w, filled, bytes_of(&w.dst) + 1e3 * 64 * 64, "filled");
    work_free(&w);
}

static void a_table_is_written_beside_itself(void) {
    static float values[2 * 64 * 64];
    oracle_held = oracle_peak = 0, oracle_metered = 1;
    CHECK(envmap_ggx_table(values, 64, NULL) == ENVMAP_OK);
    oracle_metered = 0;
    CHECK(oracle_peak <= sizeof values + 64 && oracle_held == 0);
}

/* These have no way to say that there is none. */
static void mips_cleaning_and_comparing_take_none(void) {
    envmap map = noise(ENVMAP_CUBE, 24, 5), levels = black(ENVMAP_CUBE, 24, 5, 1);
    envmap_difference difference;
    int calls = oracle_calls;
    CHECK(!envmap_mips_build(&levels) && !envmap_clean(&map, 2, NULL));
    CHECK(!envmap_compare(&difference, &map, &levels, 0) && oracle_calls == calls);
    envmap_free(&map), envmap_free(&levels);
}

int main(void) {
    RUN(the_definition_takes_four_sources_and_a_result);
    RUN(lobes_of_one_to_two_texels_keep_the_places_of_their_tents);
    RUN(the_hierarchical_method_takes_eight_sources_and_a_result);
    RUN(lobes_of_two_texels_take_both_maps_and_the_square_of_bands);
    RUN(the_sharpest_lobes_of_bands_take_four_or_five_sources);
    RUN(sharp_lobes_take_nine_of_both_maps_and_three_MB_a_task);
    RUN(a_tail_is_written_when_its_sums_have_their_memory);
    RUN(a_chain_takes_no_more_than_its_dearest_level);
    RUN(coefficients_take_sixteen_sets_or_a_map_and_the_square_of_bands);
    RUN(a_table_is_written_beside_itself);
    RUN(mips_cleaning_and_comparing_take_none);
    return test_summary();
}
