/* SPDX-License-Identifier: MIT
   What FAST knows of a source: prepared once for many calls, cleaned, and looked at
   (the survey: energies of blocks, contrast, lights). */
#define _POSIX_C_SOURCE 200809L
#define ENVMAP_IMPLEMENTATION
#include "helpers.h"

/* ----------------------------------------------------------------------------------- tools ---- */

static double sky(const double d[3], int channel) {
    static const double tint[3] = {1, 0.8, 0.5};
    double cloud = 0.5 + 0.5 * sin(5 * d[0] + 3 * sin(4 * d[2]) + 2 * d[1]);
    double sun = exp(300 * (0.36 * d[0] + 0.48 * d[1] + 0.8 * d[2] - 1));
    return 0.2 + 0.3 * channel * (1 + d[1]) + 0.6 * cloud * cloud + 40 * tint[channel] * sun;
}

static envmap sky_of(int mapping, int size) {
    envmap map = black(mapping, size, 1, 1);
    oracle_fill(&map, 0, sky);
    return map;
}

static envmap_prepared prepared_for(const envmap *src, const envmap_lobe *lobes, int count,
                                    double tolerance) {
    envmap_prepared prepared = {NULL, NULL};
    envmap_filter_desc desc = desc_of(0, tolerance);
    CHECK(envmap_prepare(&prepared, src, lobes, count, &desc) == ENVMAP_OK);
    CHECK(prepared.state != NULL);
    return prepared;
}

static envmap_result filter_with(envmap *dst, const envmap *src, envmap_lobe lobe,
                                 const envmap_prepared *prepared, int method, double tolerance) {
    envmap_filter_desc desc = desc_of(method, tolerance);
    desc.prepared = prepared;
    return envmap_filter(dst, src, &lobe, &desc);
}

static double rms_of(const envmap *a, const envmap *b) {
    envmap_difference d;
    return CHECK(envmap_compare(&d, a, b, 0) == ENVMAP_OK) ? d.rms : HUGE_VAL;
}

static double larger(double a, double b) { return b <= a ? a : b; } /* NaN wins */

/* ------------------------------------------------------------------------------- prepared ---- */

enum { LOBES = 6 };
static void lobes_of(envmap_lobe lobes[LOBES]) {
    lobes[0] = envmap_lobe_phong(60), lobes[1] = envmap_lobe_phong(6);
    lobes[2] = envmap_lobe_gaussian(12), lobes[3] = envmap_lobe_diffuse();
    lobes[4] = envmap_lobe_ggx(0.3f), lobes[5] = envmap_lobe_banks(0.4f);
}

/* Prepared for this lobe alone it takes the same bands over the same grid. */
static void a_source_prepared_for_one_lobe_gives_the_same_bits(void) {
    envmap_lobe lobes[LOBES];
    lobes_of(lobes);
    for (int mapping = 0; mapping < ENVMAP_MAPPING_COUNT; ++mapping)
        for (int i = mapping ? mapping : 0; i < LOBES; i += mapping ? LOBES : 1) {
            envmap src = sky_of(mapping, mapping == ENVMAP_CUBE ? 48 : 64);
            envmap with = black(ENVMAP_CUBE, 12, 1, 2), without = black(ENVMAP_CUBE, 12, 1, 2);
            envmap_prepared prepared = prepared_for(&src, lobes + i, 1, 1e-3);
            CHECK(filter(&without, &src, lobes[i], ENVMAP_METHOD_FAST, 1e-3) == ENVMAP_OK);
            for (int again = 0; again < 2; ++again) {
                fill(&with, -7);
                CHECK(filter_with(&with, &src, lobes[i], &prepared, ENVMAP_METHOD_FAST, 1e-3) ==
                      ENVMAP_OK);
                CHECK(same_bits(&with, &without));
            }
            envmap_prepared_free(&prepared);
            envmap_free(&src), envmap_free(&with), envmap_free(&without);
        }
}

/* For all lobes at once, for the sharpest of each kind, and to a finer tolerance than asked for. */
static void a_prepared_source_gives_the_same_map(void) {
    envmap_lobe lobes[LOBES], sharpest[2];
    double apart = 0, off = 0;
    lobes_of(lobes);
    sharpest[0] = lobes[0], sharpest[1] = lobes[3];
    envmap src = sky_of(ENVMAP_CUBE, 64);
    envmap_prepared prepared[3];
    prepared[0] = prepared_for(&src, lobes, LOBES, 1e-3);
    prepared[1] = prepared_for(&src, sharpest, 2, 1e-3);
    prepared[2] = prepared_for(&src, lobes, 3, 1e-4);
    for (int i = 0; i < LOBES; ++i) {
        envmap truth = black(ENVMAP_LATLONG, 6, 1, 2), without = black(ENVMAP_LATLONG, 6, 1, 2);
        envmap with = black(ENVMAP_LATLONG, 6, 1, 2);
        CHECK(filter(&truth, &src, lobes[i], ENVMAP_METHOD_REFERENCE, 0) == ENVMAP_OK);
        CHECK(filter(&without, &src, lobes[i], ENVMAP_METHOD_FAST, 1e-3) == ENVMAP_OK);
        CHECK(!same_bits(&without, &truth));
        for (int k = 0; k < 3; ++k) {
            CHECK(filter_with(&with, &src, lobes[i], prepared + k, ENVMAP_METHOD_FAST, 1e-3) ==
                  ENVMAP_OK);
            apart = larger(apart, rms_of(&with, &without) / 1e-3);
            off = larger(off, rms_of(&with, &truth) / 1e-3);
        }
        envmap_free(&truth), envmap_free(&without), envmap_free(&with);
    }
    FIGURE("prepared - not prepared: rms / tolerance", apart, 1);
    FIGURE("prepared - reference: rms / tolerance", off, 1);
    for (int k = 0; k < 3; ++k) envmap_prepared_free(prepared + k);
    envmap_free(&src);
}

static void what_was_not_prepared_is_right_all_the_same(void) {
    static const double tolerances[3] = {1e-3, 1e-5, 1e-4};
    envmap_lobe blunt = envmap_lobe_gaussian(1.5f), lobes[3];
    double worst = 0;
    lobes[0] = envmap_lobe_phong(100), lobes[1] = blunt, lobes[2] = envmap_lobe_diffuse();
    for (int mapping = 0; mapping < 2; ++mapping) {
        envmap src = sky_of(mapping, 64);
        envmap_prepared prepared = prepared_for(&src, &blunt, 1, 1e-2);
        for (int i = 0; i < 3; ++i) {
            envmap truth = black(ENVMAP_CUBE, 5, 1, 1), dst = black(ENVMAP_CUBE, 5, 1, 1);
            CHECK(filter(&truth, &src, lobes[i], ENVMAP_METHOD_REFERENCE, 0) == ENVMAP_OK);
            CHECK(filter_with(&dst, &src, lobes[i], &prepared, ENVMAP_METHOD_FAST, tolerances[i]) ==
                  ENVMAP_OK);
            worst = larger(worst, rms_of(&dst, &truth) / tolerances[i]);
            envmap_free(&truth), envmap_free(&dst);
        }
        envmap_prepared_free(&prepared);
        envmap_free(&src);
    }
    FIGURE("more bands, finer tolerances, kinks: rms / tolerance", worst, 1);
}

static void every_method_takes_a_prepared_source(void) {
    envmap_lobe lobes[2] = {envmap_lobe_phong(6), envmap_lobe_mirror()};
    envmap src = sky_of(ENVMAP_CUBE, 32);
    envmap_prepared prepared = prepared_for(&src, lobes, 1, 1e-3);
    for (int method = 0; method < ENVMAP_METHOD_COUNT; ++method)
        for (int i = 0; i < 2; ++i) {
            envmap with = black(ENVMAP_CUBE, 8, 1, 1), without = black(ENVMAP_CUBE, 8, 1, 1);
            CHECK(filter(&without, &src, lobes[i], method, 1e-3) ==
                  filter_with(&with, &src, lobes[i], &prepared, method, 1e-3));
            CHECK(same_bits(&with, &without));
            CHECK(with.texels[0] > 0 || method == ENVMAP_METHOD_HARMONICS);
            envmap_free(&with), envmap_free(&without);
        }
    envmap_prepared_free(&prepared);
    envmap_free(&src);
}

static void a_chain_takes_a_prepared_source(void) {
    envmap_lobe lobes[4] = {envmap_lobe_mirror(), envmap_lobe_phong(60), envmap_lobe_phong(6),
                            envmap_lobe_diffuse()};
    envmap src = sky_of(ENVMAP_CUBE, 48);
    envmap with = black(ENVMAP_CUBE, 16, 4, 1), without = black(ENVMAP_CUBE, 16, 4, 1);
    envmap_prepared prepared = prepared_for(&src, lobes, 4, 1e-3);
    envmap_filter_desc desc = desc_of(ENVMAP_METHOD_FAST, 1e-3);
    CHECK(envmap_filter_chain(&without, &src, lobes, 4, &desc) == ENVMAP_OK);
    desc.prepared = &prepared;
    CHECK(envmap_filter_chain(&with, &src, lobes, 4, &desc) == ENVMAP_OK);
    CHECK(same_bits(&with, &without));
    CHECK(check_starving(&with, &src, lobes, 4, desc) >= 3);
    CHECK(same_bits(&with, &without));
    CHECK(check_cancelling(&with, &src, lobes, 4, desc) >= 3);
    check_executors(&with, &src, lobes, 4, desc);
    envmap_prepared_free(&prepared);
    envmap_free(&src), envmap_free(&with), envmap_free(&without);
}

static void preparing_gives_the_same_bits_for_any_executor(void) {
    static crew c;
    envmap_lobe lobes[LOBES];
    lobes_of(lobes);
    envmap src = sky_of(ENVMAP_PARABOLOID, 64);
    envmap a = black(ENVMAP_CUBE, 10, 1, 1), b = black(ENVMAP_CUBE, 10, 1, 1);
    envmap_prepared serial = prepared_for(&src, lobes, 5, 1e-3), threads = {NULL, NULL};
    envmap_filter_desc desc = desc_of(0, 1e-3);
    pthread_mutex_init(&c.lock, NULL);
    c.threads = 3, desc.work.executor.user = &c, desc.work.executor.run = crew_run;
    CHECK(envmap_prepare(&threads, &src, lobes, 5, &desc) == ENVMAP_OK && c.runs > 0);
    for (int i = 0; i < 5; ++i) {
        CHECK(!filter_with(&a, &src, lobes[i], &serial, ENVMAP_METHOD_FAST, 1e-3));
        CHECK(!filter_with(&b, &src, lobes[i], &threads, ENVMAP_METHOD_FAST, 1e-3));
        CHECK(same_bits(&a, &b));
    }
    pthread_mutex_destroy(&c.lock);
    envmap_prepared_free(&serial), envmap_prepared_free(&threads);
    envmap_free(&src), envmap_free(&a), envmap_free(&b);
}

/* Two threads, each with all lobes three times, from one prepared source. */
typedef struct sharer {
    const envmap *src;
    const envmap_prepared *prepared;
    const envmap *expected; /* [LOBES] */
    int first, wrong;
} sharer;

static void *share(void *user) {
    sharer *s = (sharer *)user;
    envmap_lobe lobes[LOBES];
    lobes_of(lobes);
    for (int i = s->first; i < s->first + 3 * LOBES; ++i) {
        envmap dst = {0};
        envmap_result result = envmap_create(&dst, ENVMAP_CUBE, 10, 1, 1);
        if (!result)
            result =
                filter_with(&dst, s->src, lobes[i % LOBES], s->prepared, ENVMAP_METHOD_FAST, 1e-3);
        s->wrong += result || !same_bits(&dst, s->expected + i % LOBES);
        envmap_free(&dst);
    }
    return NULL;
}

static void two_threads_share_one_prepared_source(void) {
    envmap_lobe lobes[LOBES];
    lobes_of(lobes);
    envmap src = sky_of(ENVMAP_CUBE, 48), expected[LOBES];
    envmap_prepared prepared = prepared_for(&src, lobes, LOBES, 1e-3);
    for (int i = 0; i < LOBES; ++i) {
        expected[i] = black(ENVMAP_CUBE, 10, 1, 1);
        CHECK(!filter_with(expected + i, &src, lobes[i], &prepared, ENVMAP_METHOD_FAST, 1e-3));
    }
    pthread_t threads[2];
    sharer s[2] = {{&src, &prepared, expected, 0, 0}, {&src, &prepared, expected, LOBES / 2, 0}};
    for (int i = 0; i < 2; ++i) CHECK(!pthread_create(threads + i, NULL, share, s + i));
    for (int i = 0; i < 2; ++i) CHECK(!pthread_join(threads[i], NULL) && s[i].wrong == 0);
    for (int i = 0; i < LOBES; ++i) envmap_free(expected + i);
    envmap_prepared_free(&prepared);
    envmap_free(&src);
}

static void preparing_without_memory_leaks_nothing(void) {
    envmap_lobe lobes[LOBES];
    int n = 0, live, finished = 0, mine = 0, other = 0;
    lobes_of(lobes);
    for (int mapping = 0; mapping < 2; ++mapping) {
        envmap src = sky_of(mapping, 48);
        envmap_filter_desc desc = desc_of(0, 1e-2);
        desc.work.memory = &other;
        live = oracle_live, finished = 0;
        for (n = 0; n < 1000 && !finished; ++n) {
            envmap_prepared prepared = {NULL, &mine};
            oracle_calls = 0, oracle_fail_at = n;
            envmap_result result = envmap_prepare(&prepared, &src, lobes, LOBES, &desc);
            oracle_fail_at = -1, finished = oracle_calls <= n;
            CHECK(result == (finished ? ENVMAP_OK : ENVMAP_ERROR_MEMORY));
            CHECK(prepared.memory == &mine && !prepared.state == !finished);
            CHECK((oracle_live > live) == finished);
            envmap_prepared_free(&prepared);
            CHECK(oracle_live == live && oracle_wrong_context == 0);
        }
        CHECK(finished && n > 10);
        printf("    %d allocations\n", n - 1);
        envmap_free(&src);
    }
}

/* Where nothing that was asked for goes through harmonics, there is nothing to share. */
static void a_source_prepared_for_nothing_is_fine(void) {
    envmap_lobe lobes[2] = {envmap_lobe_mirror(), envmap_lobe_phong(1e6f)}, lobe;
    envmap src = sky_of(ENVMAP_CUBE, 48);
    envmap with = black(ENVMAP_CUBE, 12, 1, 1), without = black(ENVMAP_CUBE, 12, 1, 1);
    lobe = envmap_lobe_phong(6);
    CHECK(filter(&without, &src, lobe, ENVMAP_METHOD_FAST, 1e-3) == ENVMAP_OK);
    for (int i = 0; i < 2; ++i) {
        envmap_prepared prepared = prepared_for(&src, lobes + i, 1, 1e-3);
        CHECK(filter_with(&with, &src, lobe, &prepared, ENVMAP_METHOD_FAST, 1e-3) == ENVMAP_OK);
        CHECK(rms_of(&with, &without) <= 1e-3);
        envmap_prepared_free(&prepared);
    }
    envmap_free(&src), envmap_free(&with), envmap_free(&without);
}

static void freeing_twice_or_nothing_is_fine(void) {
    envmap src = sky_of(ENVMAP_CUBE, 32);
    envmap_lobe lobe = envmap_lobe_phong(5);
    int live = oracle_live;
    envmap_prepared prepared = prepared_for(&src, &lobe, 1, 1e-3), none = {NULL, NULL};
    envmap_prepared_free(&prepared);
    CHECK(prepared.state == NULL && oracle_live == live);
    envmap_prepared_free(&prepared);
    envmap_prepared_free(&none);
    envmap_prepared_free(NULL);
    CHECK(oracle_live == live);
    envmap_free(&src);
}

static void another_source_is_refused(void) {
    envmap_lobe lobe = envmap_lobe_phong(5);
    envmap src = sky_of(ENVMAP_CUBE, 32), twin = sky_of(ENVMAP_CUBE, 32), other = src;
    envmap dst = black(ENVMAP_CUBE, 12, 1, 1);
    envmap_prepared prepared = prepared_for(&src, &lobe, 1, 1e-3), none = {NULL, NULL};
    fill(&dst, -7);
    CHECK(filter_with(&dst, &twin, lobe, &prepared, 0, 0) == ENVMAP_ERROR_ARGUMENT);
    other.size = 16;
    CHECK(filter_with(&dst, &other, lobe, &prepared, 0, 0) == ENVMAP_ERROR_ARGUMENT);
    other = src, other.mapping = ENVMAP_PARABOLOID;
    CHECK(filter_with(&dst, &other, lobe, &prepared, 0, 0) == ENVMAP_ERROR_ARGUMENT);
    CHECK(filter_with(&dst, &src, lobe, &none, 0, 0) == ENVMAP_ERROR_ARGUMENT);
    CHECK(all_are(&dst, -7));
    CHECK(filter_with(&dst, &src, lobe, &prepared, 0, 0) == ENVMAP_OK);
    envmap_prepared_free(&prepared);
    envmap_free(&src), envmap_free(&twin), envmap_free(&dst);
}

static void what_cannot_be_prepared_is_refused(void) {
    const float radiance[4] = {NAN, INFINITY, -INFINITY, -1};
    envmap_lobe lobe = envmap_lobe_phong(5), bad = envmap_lobe_phong(-1);
    envmap src = sky_of(ENVMAP_CUBE, 32), sliced = black(ENVMAP_CUBE, 8, 1, 2), none = src;
    envmap_filter_desc desc = desc_of(0, 1e-3);
    envmap_prepared prepared = {&src, &desc}, before = prepared;
    int live = oracle_live;
    none.texels = NULL;
    CHECK(envmap_prepare(NULL, &src, &lobe, 1, &desc) == ENVMAP_ERROR_ARGUMENT);
    CHECK(envmap_prepare(&prepared, NULL, &lobe, 1, &desc) == ENVMAP_ERROR_ARGUMENT);
    CHECK(envmap_prepare(&prepared, &none, &lobe, 1, &desc) == ENVMAP_ERROR_ARGUMENT);
    CHECK(envmap_prepare(&prepared, &sliced, &lobe, 1, &desc) == ENVMAP_ERROR_ARGUMENT);
    CHECK(envmap_prepare(&prepared, &src, NULL, 1, &desc) == ENVMAP_ERROR_ARGUMENT);
    CHECK(envmap_prepare(&prepared, &src, &lobe, 0, &desc) == ENVMAP_ERROR_ARGUMENT);
    CHECK(envmap_prepare(&prepared, &src, &lobe, -1, &desc) == ENVMAP_ERROR_ARGUMENT);
    CHECK(envmap_prepare(&prepared, &src, &lobe, 33, &desc) == ENVMAP_ERROR_ARGUMENT);
    CHECK(envmap_prepare(&prepared, &src, &bad, 1, &desc) == ENVMAP_ERROR_LOBE);
    desc.tolerance = NAN;
    CHECK(envmap_prepare(&prepared, &src, &lobe, 1, &desc) == ENVMAP_ERROR_ARGUMENT);
    for (int i = 0; i < 4; ++i) {
        float *texel = envmap_texel(&src, 0, 0, 4, 3, 2), kept = texel[2];
        texel[2] = radiance[i];
        CHECK(envmap_prepare(&prepared, &src, &lobe, 1, NULL) == ENVMAP_ERROR_RADIANCE);
        texel[2] = kept;
    }
    CHECK(!memcmp(&prepared, &before, sizeof before) && oracle_live == live);
    prepared.memory = NULL;
    CHECK(envmap_prepare(&prepared, &src, &lobe, 1, NULL) == ENVMAP_OK);
    envmap_prepared_free(&prepared);
    envmap_free(&src), envmap_free(&sliced);
}

/* ---------------------------------------------------------------------------------- limits ---- */

const float odd_radiance[6] = {NAN, INFINITY, -INFINITY, -2, 3e38f, -0.0f};

/* Such radiance here and there, in single channels and in all of them. */
static void spoil(envmap *map) {
    unsigned long long seed = 7;
    size_t count = floats_of(map) / 3;
    for (int i = 0; i < 40; ++i) {
        float *texel = map->texels + 3 * (size_t)(test_random(&seed) * (double)count);
        for (int c = 0; c < 3; ++c)
            if (i % 4 == 3 || i % 4 == c) texel[c] = odd_radiance[i % 6];
    }
}

/* The map that a limit stands for; share[0] energy, share[1] sphere. */
static envmap clamped_by_hand(const envmap *map, float limit, double share[2]) {
    envmap out = black(map->mapping, map->size, 1, map->slices);
    double all = 0, taken = 0, solid = 0, odd = 0;
    int width = oracle_width(map->mapping, map->size);
    for (int i = 0; i < map->slices * envmap_faces(map->mapping) * map->size * width; ++i) {
        int x = i % width, y = i / width % map->size, face = i / width / map->size;
        int slice = face / envmap_faces(map->mapping), any = 0;
        face %= envmap_faces(map->mapping);
        double w = envmap_solid_angle(map, 0, face, x, y);
        const float *from = envmap_texel(map, 0, slice, face, x, y);
        float *to = envmap_texel(&out, 0, slice, face, x, y);
        for (int c = 0; c < 3; ++c) {
            to[c] = isnan(from[c]) || from[c] < 0 ? 0 : from[c] > limit ? limit : from[c] + 0.0f;
            if (isnan(from[c]) || isinf(from[c]) || from[c] < 0) any = 1;
            if (isfinite(from[c]) && from[c] > 0)
                all += w * (double)from[c], taken += w * ((double)from[c] - (double)to[c]);
        }
        solid += w, odd += any ? w : 0;
    }
    share[0] = all > 0 ? taken / all : 0, share[1] = odd / solid;
    return out;
}

static void cleaning_is_cutting_by_hand(void) {
    static const float limits[3] = {0.7f, 5, 1e30f};
    double off = 0;
    for (int mapping = 0; mapping < ENVMAP_MAPPING_COUNT; ++mapping)
        for (int i = 0; i < 3; ++i) {
            double share[2];
            envmap_cleaned cleaned;
            envmap src = black(mapping, 40, 1, 2);
            oracle_noise(&src, 3);
            spoil(&src);
            envmap by_hand = clamped_by_hand(&src, limits[i], share);
            CHECK(envmap_clean(&src, limits[i], &cleaned) == ENVMAP_OK);
            CHECK(same_bits(&src, &by_hand));
            off = larger(
                off, larger(fabs(cleaned.energy - share[0]), fabs(cleaned.replaced - share[1])));
            CHECK(share[1] > 1e-3 && cleaned.nan > 0 && cleaned.negative > 0);
            CHECK(cleaned.infinite > 0 && cleaned.limited > (i ? 0 : 100));
            CHECK(envmap_clean(&src, limits[i], &cleaned) == ENVMAP_OK); /* nothing is left to do */
            CHECK(same_bits(&src, &by_hand) && cleaned.energy <= 0 && cleaned.replaced <= 0);
            CHECK(!cleaned.nan && !cleaned.negative && !cleaned.infinite && !cleaned.limited);
            envmap_free(&src), envmap_free(&by_hand);
        }
    FIGURE("what a cleaning took and replaced - by hand", off, 1e-12);
}

static void cleaning_without_a_limit_makes_infinity_the_brightest(void) {
    envmap src = sky_of(ENVMAP_CUBE, 24), before = sky_of(ENVMAP_CUBE, 24);
    envmap_cleaned cleaned;
    CHECK(envmap_clean(&src, 0, &cleaned) == ENVMAP_OK && same_bits(&src, &before));
    float most = 0;
    for (size_t i = 0; i < floats_of(&src); ++i) most = src.texels[i] > most ? src.texels[i] : most;
    src.texels[7] = INFINITY, src.texels[8] = -INFINITY;
    CHECK(envmap_clean(&src, 0, NULL) == ENVMAP_OK);
    CHECK(src.texels[7] >= most && src.texels[7] <= most && !(src.texels[8] > 0));
    envmap_free(&src), envmap_free(&before);
}

static void what_is_cleaned_can_be_prepared(void) {
    envmap_lobe lobe = envmap_lobe_gaussian(8);
    envmap src = sky_of(ENVMAP_CUBE, 32), dst = black(ENVMAP_CUBE, 12, 1, 1);
    envmap_prepared prepared = {NULL, NULL};
    spoil(&src);
    CHECK(envmap_prepare(&prepared, &src, &lobe, 1, NULL) == ENVMAP_ERROR_RADIANCE);
    CHECK(envmap_clean(&src, 10, NULL) == ENVMAP_OK);
    CHECK(envmap_prepare(&prepared, &src, &lobe, 1, NULL) == ENVMAP_OK);
    CHECK(filter_with(&dst, &src, lobe, &prepared, 0, 0) == ENVMAP_OK);
    envmap_prepared_free(&prepared);
    envmap_free(&src), envmap_free(&dst);
}

static void what_is_not_cleaned_is_refused(void) {
    for (int method = 0; method < ENVMAP_METHOD_COUNT; ++method)
        for (int i = 0; i < 4; ++i) {
            envmap src = sky_of(ENVMAP_CUBE, 24), dst = black(ENVMAP_CUBE, 12, 1, 1);
            int fine = method == ENVMAP_METHOD_REFERENCE && i == 3; /* negative */
            envmap_texel(&src, 0, 0, 2, 7, 9)[1] = odd_radiance[i];
            fill(&dst, -7);
            CHECK(filter(&dst, &src, envmap_lobe_gaussian(8), method, 1e-3) ==
                  (fine ? ENVMAP_OK : ENVMAP_ERROR_RADIANCE));
            CHECK(all_are(&dst, -7) != fine);
            envmap_free(&src), envmap_free(&dst);
        }
}

static void bad_limits_are_refused(void) {
    static const float limits[4] = {NAN, -1, INFINITY, -INFINITY};
    envmap src = sky_of(ENVMAP_CUBE, 16), before = sky_of(ENVMAP_CUBE, 16);
    envmap_cleaned cleaned, untouched;
    memset(&cleaned, 7, sizeof cleaned), untouched = cleaned;
    for (int i = 0; i < 4; ++i)
        CHECK(envmap_clean(&src, limits[i], &cleaned) == ENVMAP_ERROR_ARGUMENT);
    CHECK(envmap_clean(NULL, 1, &cleaned) == ENVMAP_ERROR_ARGUMENT);
    CHECK(!memcmp(&cleaned, &untouched, sizeof cleaned) && same_bits(&src, &before));
    envmap_free(&src), envmap_free(&before);
}

/* ---------------------------------------------------------------------------------- survey ---- */

static envmapi_pool pool;
static const envmap_work serial;

static envmapi_scene survey_of(const envmap *map) {
    envmapi_scene survey;
    envmap_filter_desc desc = desc_of(0, 1e-3);
    CHECK(envmapi_scene_create(&survey, map, 0, 0.1, &desc.work, &pool) == ENVMAP_OK);
    return survey;
}

static const int survey_sizes[3] = {33, 64, 130};

static double energy_of(const envmap *map, int face, int x, int y) {
    const float *texel = envmap_texel(map, 0, 0, face, x, y);
    return envmap_solid_angle(map, 0, face, x, y) *
           ((double)texel[0] + (double)texel[1] + (double)texel[2]);
}

static double all_energy_of(const envmap *map) {
    double all = 0;
    int width = oracle_width(map->mapping, map->size);
    for (int face = 0; face < envmap_faces(map->mapping); ++face)
        for (int i = 0; i < width * map->size; ++i)
            all += energy_of(map, face, i % width, i / width);
    return all;
}

static void blocks_of_every_scale_carry_all_energy(void) {
    double light = 0, solid = 0;
    for (int mapping = 0; mapping < ENVMAP_MAPPING_COUNT; ++mapping)
        for (int i = 0; i < 3; ++i) {
            envmap map = noise(mapping, survey_sizes[i], 5);
            double all = all_energy_of(&map);
            envmapi_scene s = survey_of(&map);
            CHECK(s.scales >= 2);
            for (int scale = 0; scale < s.scales; ++scale) {
                const float *block = s.sums + s.blocks[scale].at;
                double energy = 0, sphere = 0;
                for (int k = 0; k < s.in.rim_count; ++k)
                    energy += envmapi_light_energy(s.in.rim + k), sphere += s.in.rim[k].value[3];
                for (size_t b = 0; b < s.blocks[scale].count; ++b, block += 4) {
                    energy += (double)block[0] + (double)block[1] + (double)block[2];
                    sphere += (double)block[3];
                }
                light = larger(light, fabs(energy / all - 1));
                solid = larger(solid, fabs(sphere / (4 * PI) - 1));
            }
            light = larger(light, fabs(s.energy / all - 1));
            solid = larger(solid, fabs(s.solid / (4 * PI) - 1));
            envmapi_pool_free(&pool, 0);
            envmap_free(&map);
        }
    FIGURE("energy of all blocks, and of a rim's texels, relative", light, 1e-6);
    FIGURE("their solid angle, relative", solid, 1e-6);
}

static void a_uniform_scene_has_no_contrast(void) {
    double round = 0, rims = 0;
    for (int mapping = 0; mapping < ENVMAP_MAPPING_COUNT; ++mapping)
        for (int i = 0; i < 3; ++i) {
            envmap map = black(mapping, survey_sizes[i], 1, 1);
            fill(&map, 0.3f);
            envmapi_scene s = survey_of(&map);
            for (int scale = 0; scale < s.scales; ++scale) {
                envmapi_contrast c = s.scale[scale];
                if (envmapi_is_disc(mapping))
                    rims = larger(rims, larger(c.kappa, c.epsilon));
                else
                    round = larger(round, larger(c.kappa, c.epsilon));
            }
            envmapi_pool_free(&pool, 0);
            envmap_free(&map);
        }
    FIGURE("contrast of a uniform cube, lat-long", round, 1e-6);
    FIGURE("contrast of a uniform disc: its rim's texels", rims, 0.02);
}

/* Not at wide scales, where blocks of a disc differ much in solid angle. */
static void one_lit_texel_has_all_contrast(void) {
    double off = 0;
    for (int mapping = 0; mapping < ENVMAP_MAPPING_COUNT; ++mapping)
        for (int i = 0; i < 4; ++i) {
            envmap map = black(mapping, 64, 1, 1);
            float *texel = envmap_texel(&map, 0, 0, 0, 30 + i % 2 * 5, 29 + i / 2 * 4);
            for (int c = 0; c < 3; ++c) texel[c] = 1e4f;
            envmapi_scene s = survey_of(&map);
            off = larger(off, fabs(s.texel.kappa - 1));
            CHECK(s.scales == (mapping == ENVMAP_CUBE         ? 5
                               : mapping == ENVMAP_PARABOLOID ? 4
                                                              : 3));
            for (int scale = 0; scale < 2; ++scale) {
                off = larger(off, fabs(s.scale[scale].kappa - 1));
                off = larger(off, fabs(s.scale[scale].epsilon - 1));
            }
            envmapi_pool_free(&pool, 0);
            envmap_free(&map);
        }
    FIGURE("contrast of one lit texel - 1", off, 0.1);
}

/* Squares of the texels' energies less the squares of their blocks' over the texels of a block. */
static void texels_have_the_contrast_that_their_blocks_do_not_have(void) {
    for (int size = 32; size <= 64; size += 32) {
        envmap map = noise(ENVMAP_CUBE, size, 11);
        double left = 0, all, block[6 * 16 * 16] = {0};
        for (int i = 0; i < 6 * size * size; ++i) /* all channels alike */
            map.texels[3 * i + 1] = map.texels[3 * i + 2] = map.texels[3 * i];
        envmapi_scene s = survey_of(&map);
        int nu = size / s.edge;
        all = all_energy_of(&map);
        for (int i = 0; i < 6 * size * size; ++i) {
            int face = i / (size * size), y = i / size % size, x = i % size;
            double energy = energy_of(&map, face, x, y);
            left += energy * energy;
            block[(face * nu + y / s.edge) * nu + x / s.edge] += energy;
        }
        for (int b = 0; b < 6 * nu * nu; ++b) left -= pow(block[b] / s.edge, 2);
        CHECK_CLOSE(s.texel.kappa / (sqrt(left) / all), 1, 1e-4);
        envmapi_pool_free(&pool, 0);
        envmap_free(&map);
    }
}

/* Wherever it is: alone in its parent, or with most of its parent's solid angle. */
static void a_lit_texel_has_contrast_wherever_it_is(void) {
    double least = 1;
    for (int mapping = 0; mapping < ENVMAP_MAPPING_COUNT; ++mapping)
        for (int i = 0; i < 6; ++i) {
            static const int edges[3] = {36, 64, 130};
            int size = edges[i / 2], width = oracle_width(mapping, size);
            int disc = oracle_is_disc(mapping);
            envmap map = black(mapping, size, 1, 1);
            int x = i & 1 ? disc ? width * 4 / 5 : width - 1 : width / 2;
            int y = i & 1 ? disc ? size * 4 / 5 : size - 1 : size / 2;
            for (int c = 0; c < 3; ++c) envmap_texel(&map, 0, 0, 0, x, y)[c] = 1e4f;
            envmapi_scene s = survey_of(&map);
            for (int scale = 0; scale + 1 < s.scales; ++scale)
                least = fmin(least, fmin(s.scale[scale].kappa, s.scale[scale].epsilon));
            envmapi_pool_free(&pool, 0);
            envmap_free(&map);
        }
    FIGURE("1 - contrast of a lit texel in a corner or centre, all but one scale", 1 - least, 0.3);
}

static double disc_axis[3];
static double disc(const double d[3], int channel) {
    (void)channel;
    return d[0] * disc_axis[0] + d[1] * disc_axis[1] + d[2] * disc_axis[2] > cos(0.15);
}

/* Blocks beside a pole of a lat-long are narrow; a spot there is as one of like size elsewhere. */
static void a_lamp_on_a_pole_has_the_contrast_of_one_elsewhere(void) {
    static const double axes[3][3] = {{0, 1, 0}, {0, -1, 0}, {0.6, 0.08, 0.796}};
    double least = 1;
    for (int size = 40; size <= 130; size += 45) {
        envmapi_contrast at[3][4];
        for (int i = 0; i < 3; ++i) {
            envmap map = black(ENVMAP_LATLONG, size, 1, 1);
            memcpy(disc_axis, axes[i], sizeof disc_axis);
            oracle_fill(&map, 0, disc);
            envmapi_scene s = survey_of(&map);
            memcpy(at[i], s.scale, sizeof at[i]);
            at[i][3] = s.texel;
            envmapi_pool_free(&pool, 0);
            envmap_free(&map);
        }
        for (int i = 0; i < 8; ++i) {
            const envmapi_contrast *pole = at[i & 1] + i / 2, *elsewhere = at[2] + i / 2;
            least = fmin(least,
                         fmin(pole->kappa / elsewhere->kappa, pole->epsilon / elsewhere->epsilon));
        }
    }
    FIGURE("contrast of a disc at the equator over that at a pole", 1 / least, 2);
}

/* Noise with lamps, in a rim too; the lights are those of more than 1/2000 and no others. */
static void lights_are_the_texels_of_a_2000th_of_the_energy(void) {
    int listed = 0;
    double left = 0;
    for (int mapping = 0; mapping < ENVMAP_MAPPING_COUNT; ++mapping)
        for (int i = 0; i < 3; ++i) {
            int size = survey_sizes[i], width = oracle_width(mapping, size), count = 0, wrong = 0;
            unsigned long long seed = 17;
            envmap map = noise(mapping, size, 9);
            for (int k = 0; k < 60; ++k) {
                size_t t = (size_t)(test_random(&seed) * (double)(floats_of(&map) / 3));
                map.texels[3 * t + (size_t)(k % 3)] = (float)exp(9 * test_random(&seed));
            }
            if (mapping == ENVMAP_SPHERE) envmap_texel(&map, 0, 0, 0, 0, size / 2)[1] = 1e6f;
            double all = all_energy_of(&map), lights = 0;
            envmapi_scene s = survey_of(&map);
            CHECK(envmapi_scene_lights(&s, 1, &serial, &pool) == ENVMAP_OK);
            for (int t = 0; t < envmap_faces(mapping) * width * size; ++t) {
                double e = energy_of(&map, t / width / size, t % width, t / width % size);
                int found = 0;
                for (int k = 0; k < s.light_count; ++k)
                    if (s.lights[k].texel == (size_t)t) {
                        ++found, lights += e;
                        wrong += !(fabs(envmapi_light_energy(s.lights + k) / e - 1) < 1e-5);
                    }
                count += e > all / 2000;
                if (fabs(e * 2000 / all - 1) > 1e-5) wrong += found != (e > all / 2000);
            }
            CHECK(wrong == 0);
            CHECK(count > 3 && s.light_count <= count + 1);
            left = larger(left, fabs((s.energy - (all - lights)) / all));
            listed += s.light_count;
            envmapi_pool_free(&pool, 0);
            envmap_free(&map);
        }
    printf("    %d lights\n", listed);
    FIGURE("energy without the lights, of all", left, 1e-6);
}

/* More lights than there is room for: the brightest of them, or none where all are alike. */
static void of_too_many_lights_the_brightest_are_taken(void) {
    for (int alike = 0; alike < 2; ++alike) {
        envmap map = black(ENVMAP_LATLONG, 64, 1, 1);
        double least = HUGE_VAL, most = 0;
        for (int k = 0; k < 900; ++k) {
            float *texel = envmap_texel(&map, 0, 0, 0, k * 7 % 128, 28 + k / 128);
            texel[0] = alike ? 1 : 1 + (float)k / 300;
        }
        envmapi_scene s = survey_of(&map);
        CHECK(envmapi_scene_lights(&s, 1, &serial, &pool) == ENVMAP_OK);
        CHECK(s.light_count <= ENVMAPI_LIGHTS);
        for (int t = 0; t < 128 * 64; ++t) {
            int found = 0;
            for (int k = 0; k < s.light_count; ++k) found |= s.lights[k].texel == (size_t)t;
            double e = energy_of(&map, 0, t % 128, t / 128);
            if (found)
                least = fmin(least, e);
            else
                most = fmax(most, e);
        }
        CHECK(least >= most);
        envmapi_pool_free(&pool, 0);
        envmap_free(&map);
    }
}

/* Of a lamp in noise: all energy and all squares lie somewhere, the lamp's where it is. */
static void axes_see_all_light_at_its_angle(void) {
    double off = 0, away[2] = {0, 0}; /* for narrow lobes, for wide ones: by the blocks' width */
    for (int mapping = 0; mapping < ENVMAP_MAPPING_COUNT; ++mapping)
        for (int i = 0; i < 6; ++i) {
            envmap map = noise(mapping, 64, 5);
            float d[3] = {0, 0, 0}, u, v;
            int face, width = oracle_width(mapping, 64);
            d[i / 2] = i & 1 ? -0.8f : 0.8f, d[(i / 2 + 1) % 3] = 0.5f, d[(i / 2 + 2) % 3] = 0.3f;
            envmap_coordinates(&face, &u, &v, mapping, d);
            int x = (int)(u * (float)width), y = (int)(v * 64);
            envmap_texel(&map, 0, 0, face, x, y)[1] = 1e7f;
            envmapi_scene s = survey_of(&map);
            double lamp[3], angle = 0, energy = s.sum[1];
            oracle_direction(lamp, mapping, face, (x + 0.5) / width, (y + 0.5) / 64);
            CHECK(envmapi_scene_lights(&s, i & 1 ? 1 : 0.2, &serial, &pool) == ENVMAP_OK);
            for (int a = 0; a < s.axes; ++a) {
                double sums[3 + ENVMAPI_SCALES] = {0};
                double t = acos(envmapi_dot(lamp, s.histograms[a].axis)), at = 0;
                for (int j = 0; j < ENVMAPI_ANGLES; ++j) {
                    double middle = PI * (j + 0.5) * (j + 0.5) / ENVMAPI_ANGLES / ENVMAPI_ANGLES;
                    for (int k = 0; k < 3 + s.scales; ++k)
                        sums[k] += (double)s.histograms[a].seen[j][k];
                    at += (double)s.histograms[a].seen[j][1] * middle;
                }
                for (int c = 0; c < 3; ++c) off = larger(off, fabs(sums[c] - s.sum[c] / energy));
                for (int k = 0; k < s.scales; ++k)
                    off = larger(off, fabs(sums[3 + k] - (i & 1 ? 0 : 1))); /* narrow lobes only */
                angle = larger(angle, fabs(at - t));
            }
            away[i & 1] = larger(away[i & 1], angle);
            envmapi_pool_free(&pool, 0);
            envmap_free(&map);
        }
    FIGURE("of energy and squares that axes see, lost", off, 1e-5);
    FIGURE("a lamp's angle from an axis, as narrow lobes see it, off by", away[0], 0.2);
    FIGURE("... as wide ones do", away[1], 0.5);
}

/* A table's slices of GGX 0.02 and 0.06 on a light, and each as a lobe of its own. */
static void slices_have_tails_of_their_own(void) {
    static float table[2 * 4096];
    envmap src = noise(ENVMAP_CUBE, 24, 3), both = black(ENVMAP_CUBE, 2, 1, 2);
    envmap_texel(&src, 0, 0, 0, 10, 10)[0] = 300;
    for (int i = 0; i < 2 * 4096; ++i) {
        envmap_lobe ggx = envmap_lobe_ggx(i < 4096 ? 0.02f : 0.06f);
        table[i] = (float)envmap_lobe_value(&ggx, cos(PI * (i % 4096) / 4095), 0);
    }
    envmap_lobe lobe = envmap_lobe_table(table, 4096, 2, 0, 1);
    CHECK(!filter(&both, &src, lobe, ENVMAP_METHOD_FAST, 1e-4));
    for (int slice = 0; slice < 2; ++slice) {
        envmap one = black(ENVMAP_CUBE, 2, 1, 1), of_both = one;
        lobe = envmap_lobe_table(table + 4096 * slice, 4096, 1, 0, 0);
        CHECK(!filter(&one, &src, lobe, ENVMAP_METHOD_FAST, 1e-4));
        of_both.texels = envmap_texel(&both, 0, slice, 0, 0, 0);
        FIGURE("a slice and its own lobe, rms", rms_of(&of_both, &one), 2e-4);
        envmap_free(&one);
    }
    envmap_free(&src), envmap_free(&both);
}

/* Only of -c .. c does half of the slices mirror the others. */
static void banks_over_any_slices_keeps_the_tolerance(void) {
    static const float ends[3][2] = {{-0.2f, 0.8f}, {-0.9f, 0.1f}, {-0.6f, 0.6f}};
    envmap src = sky_of(ENVMAP_CUBE, 40);
    for (int i = 0; i < 3; ++i) {
        envmap fast = black(ENVMAP_CUBE, 5, 1, 4), truth = black(ENVMAP_CUBE, 5, 1, 4);
        envmap_lobe lobe = envmap_lobe_banks(0.2f);
        lobe.p0 = ends[i][0], lobe.p1 = ends[i][1];
        CHECK(!filter(&fast, &src, lobe, ENVMAP_METHOD_FAST, 1e-3));
        CHECK(!filter(&truth, &src, lobe, ENVMAP_METHOD_REFERENCE, 1e-3));
        FIGURE("four slices of Banks, rms", rms_of(&fast, &truth), 1e-3);
        envmap_free(&fast), envmap_free(&truth);
    }
    envmap_free(&src);
}

static void nothing_leaks(void) { CHECK(oracle_live == 0 && oracle_wrong_context == 0); }

/* What is wider than from 0 to pi is said so by cosines that no direction has. */
static void cosines_of_an_angle_less_and_plus_another_end_at_0_and_pi(void) {
    for (int i = 1; i < 20; ++i)
        for (int j = 1; j < 20; ++j) {
            double a = PI * i / 20, b = PI * j / 20, x[2], angle[2];
            if (i == j || i + j == 20) continue; /* either answer is right */
            angle[0] = cos(a), angle[1] = sin(a);
            envmapi_cosines(x, angle, cos(b), sin(b));
            CHECK_CLOSE(x[0], i + j > 20 ? -2 : cos(a + b), 1e-12);
            CHECK_CLOSE(x[1], i < j ? 2 : cos(a - b), 1e-12);
        }
}

int main(void) {
    RUN(cosines_of_an_angle_less_and_plus_another_end_at_0_and_pi);
    RUN(a_source_prepared_for_one_lobe_gives_the_same_bits);
    RUN(a_prepared_source_gives_the_same_map);
    RUN(what_was_not_prepared_is_right_all_the_same);
    RUN(every_method_takes_a_prepared_source);
    RUN(a_chain_takes_a_prepared_source);
    RUN(preparing_gives_the_same_bits_for_any_executor);
    RUN(two_threads_share_one_prepared_source);
    RUN(preparing_without_memory_leaks_nothing);
    RUN(a_source_prepared_for_nothing_is_fine);
    RUN(freeing_twice_or_nothing_is_fine);
    RUN(another_source_is_refused);
    RUN(what_cannot_be_prepared_is_refused);
    RUN(cleaning_is_cutting_by_hand);
    RUN(cleaning_without_a_limit_makes_infinity_the_brightest);
    RUN(what_is_cleaned_can_be_prepared);
    RUN(what_is_not_cleaned_is_refused);
    RUN(bad_limits_are_refused);
    RUN(blocks_of_every_scale_carry_all_energy);
    RUN(a_uniform_scene_has_no_contrast);
    RUN(one_lit_texel_has_all_contrast);
    RUN(texels_have_the_contrast_that_their_blocks_do_not_have);
    RUN(a_lit_texel_has_contrast_wherever_it_is);
    RUN(a_lamp_on_a_pole_has_the_contrast_of_one_elsewhere);
    RUN(lights_are_the_texels_of_a_2000th_of_the_energy);
    RUN(of_too_many_lights_the_brightest_are_taken);
    RUN(axes_see_all_light_at_its_angle);
    RUN(slices_have_tails_of_their_own);
    RUN(banks_over_any_slices_keeps_the_tolerance);
    RUN(nothing_leaks);
    return test_summary();
}
