/* SPDX-License-Identifier: MIT
   A glossy chain in eight ways: filtered level by level from the source, by envmap_filter_chain,
   each level from the one before, from the source's mip levels, and summed from the differences of
   a pyramid [Burt and Adelson 1983]. Prints Markdown, a table for each scene: the time in copies
   (memcpy of the source and of the chain) and each level's error against the chain at a tolerance
   of 1e-6. docs/pyramids.md says what each way does and which wins.

   What you will see: the tables, after a minute or two. `pyramid --docs DOCS` also writes them to
   DOCS/pyramids.md; `pyramid MAP.pfm ...` takes lat-long maps of yours instead of the scenes.
       cc -O3 -march=native -I. examples/measure/pyramid.c -o pyramid -lm */
#define _POSIX_C_SOURCE 200809L
#include "measure.h"

#include "../tool/scenes.h"

#define SIZE   256
#define LEVELS 9
#define BANDS  768
#define PI     MEASURE_PI

static const float exponents[LEVELS] = {2048, 861, 362, 152, 64, 27, 11, 5, 2};

static measure_document document;

static void need(envmap_result result) { measure_must(result, "pyramid"); }

static envmap create(int size, int levels) { return measure_map(ENVMAP_CUBE, size, levels, 1); }

/* Level l as a map of one level. */
static envmap view(const envmap *map, int l) {
    envmap out = *map;
    out.texels = envmap_texel(map, l, 0, 0, 0, 0);
    out.size = map->size >> l, out.levels = 1;
    return out;
}

static size_t floats_of(const envmap *map) { return 18 * (size_t)map->size * (size_t)map->size; }

static void filter(envmap dst, const envmap *src, envmap_lobe lobe, double tolerance) {
    envmap_filter_desc desc = {0};
    desc.tolerance = (float)tolerance;
    need(envmap_filter(&dst, src, &lobe, &desc));
}

/* ------------------------------------------------------------------------------- the steps -- */

#define TABLE 1024
static float quotient[LEVELS][TABLE];

/* The kernel that takes level i-1 to level i: k(t) = sum (2l+1)/4pi q_l P_l(cos t), where
   q_l = lambda_l(N_i) / lambda_l(N_(i-1)), and 0 where the level has lost what the next one needs:
   lobes of small N have the stronger horizon, so the quotient grows without bound. */
static void make_quotient(int i) {
    static double was[BANDS], is[BANDS];
    envmap_lobe before = envmap_lobe_phong(exponents[i - 1]);
    envmap_lobe after = envmap_lobe_phong(exponents[i]);
    need(envmap_lobe_zonal(was, BANDS, &before, 0));
    need(envmap_lobe_zonal(is, BANDS, &after, 0));
    for (int t = 0; t < TABLE; ++t) {
        double x = cos(PI * t / (TABLE - 1)), below = 0, P = 1, k = 0;
        for (int l = 0; l < BANDS; ++l) {
            double up = ((2 * l + 1) * x * P - l * below) / (l + 1);
            if (fabs(was[l]) > 1e-3) k += (2 * l + 1) / (4 * PI) * is[l] / was[l] * P;
            below = P, P = up;
        }
        quotient[i][t] = (float)k;
    }
}

static envmap_lobe step_exact(int i) { return envmap_lobe_table(quotient[i], TABLE, 1, 0, 0); }

/* The Gaussian whose first harmonic coth(s) - 1/s is that of the quotient: Gaussians of variance
   1/s add, nearly. */
static envmap_lobe step_gaussian(int i) {
    double a = (double)exponents[i - 1], b = (double)exponents[i];
    double first = (b + 1) / (b + 2) * (a + 2) / (a + 1);
    double low = 1e-3, high = 1e6;
    for (int k = 0; k < 100; ++k) {
        double s = sqrt(low * high);
        *(1 / tanh(s) - 1 / s < first ? &low : &high) = s;
    }
    return envmap_lobe_gaussian((float)low);
}

/* -------------------------------------------------------------------------------- the ways -- */

static void one_by_one(envmap *dst, const envmap *src) {
    for (int i = 0; i < LEVELS; ++i) filter(view(dst, i), src, envmap_lobe_phong(exponents[i]), 0);
}

static void chain(envmap *dst, const envmap *src, double tolerance) {
    envmap_filter_desc desc = {0};
    envmap_lobe lobes[LEVELS];
    for (int i = 0; i < LEVELS; ++i) lobes[i] = envmap_lobe_phong(exponents[i]);
    desc.tolerance = (float)tolerance;
    need(envmap_filter_chain(dst, src, lobes, LEVELS, &desc));
}

static void chain_shared(envmap *dst, const envmap *src) { chain(dst, src, 0); }

/* Each level from the one before, which is kept `finer` times finer than the chain has it, with an
   edge of `least` texels at least. */
static void from_levels(envmap *dst, const envmap *src, envmap_lobe (*step)(int), int finer,
                        int least) {
    envmap kept = create(SIZE, 1);
    filter(kept, src, envmap_lobe_phong(exponents[0]), 0);
    memcpy(dst->texels, kept.texels, floats_of(&kept) * sizeof(float));
    for (int i = 1; i < LEVELS; ++i) {
        int edge = finer * SIZE >> i > least ? finer * SIZE >> i : least;
        envmap next = create(edge < SIZE ? edge : SIZE, 1), out = view(dst, i);
        filter(out, &kept, step(i), 0);
        if (next.size == out.size) memcpy(next.texels, out.texels, floats_of(&out) * sizeof(float));
        else if (i + 1 < LEVELS) filter(next, &kept, step(i), 0);
        envmap_free(&kept);
        kept = next;
    }
    envmap_free(&kept);
}

static void levels_exact(envmap *dst, const envmap *src) {
    from_levels(dst, src, step_exact, 1, 1);
}
static void levels_gaussian(envmap *dst, const envmap *src) {
    from_levels(dst, src, step_gaussian, 1, 1);
}
static void finer_exact(envmap *dst, const envmap *src) {
    from_levels(dst, src, step_exact, 4, 32);
}
static void finer_gaussian(envmap *dst, const envmap *src) {
    from_levels(dst, src, step_gaussian, 4, 32);
}

/* The coarsest mip level in which sigma is `texels` texels at least. */
static int mip_level(int i, double texels) {
    envmap_lobe lobe = envmap_lobe_phong(exponents[i]);
    double fit = envmap_lobe_sigma(&lobe, 0) / texels / (PI / 2 / SIZE);
    int level = fit > 1 ? (int)(log(fit) / log(2)) : 0;
    return level < LEVELS ? level : LEVELS - 1;
}

static envmap mips_of(const envmap *src) {
    envmap mips = create(SIZE, LEVELS);
    memcpy(mips.texels, src->texels, floats_of(src) * sizeof(float));
    need(envmap_mips_build(&mips));
    return mips;
}

static void from_mips(envmap *dst, const envmap *src) {
    envmap mips = mips_of(src);
    for (int i = 0; i < LEVELS; ++i) {
        envmap from = view(&mips, mip_level(i, 4));
        filter(view(dst, i), &from, envmap_lobe_phong(exponents[i]), 0);
    }
    envmap_free(&mips);
}

/* Burt and Adelson's pyramid: band j is what mip level j has more than level j+1, split in its
   positive part (0) and the other (1), since filters refuse negative radiance. */
static void differences(envmap bands[2], const envmap *mips) {
    for (int j = 0; j < LEVELS; ++j) {
        envmap fine = view(mips, j), plus = view(bands, j), minus = view(bands + 1, j);
        if (j + 1 < LEVELS) {
            envmap coarse = view(mips, j + 1);
            need(envmap_resample(&plus, &coarse, NULL));
        }
        for (size_t k = 0; k < floats_of(&fine); ++k) {
            float d = fine.texels[k] - plus.texels[k];
            plus.texels[k] = d > 0 ? d : 0, minus.texels[k] = d < 0 ? -d : 0;
        }
    }
}

/* A level as the sum over bands, coarse to fine, each filtered at its own resolution. Bands whose
   texels are wider than a quarter of sigma are taken together, as the mip level that they sum to;
   finer than a sixteenth little is left. (Every result is coarser than its bands, so they need not
   be expanded to be summed.) */
static void from_differences(envmap *dst, const envmap *src) {
    envmap mips = mips_of(src), bands[2] = {create(SIZE, LEVELS), create(SIZE, LEVELS)};
    differences(bands, &mips);
    for (int i = 0; i < LEVELS; ++i) {
        int coarse = mip_level(i, 4), fine = mip_level(i, 16);
        envmap_lobe lobe = envmap_lobe_phong(exponents[i]);
        envmap sum = view(dst, i), rest = view(&mips, coarse), part = create(sum.size, 1);
        filter(sum, &rest, lobe, 0);
        for (int j = 2 * coarse - 1; j >= 2 * fine; --j) {
            envmap band = view(bands + (j & 1), j >> 1);
            filter(part, &band, lobe, 0);
            for (size_t k = 0; k < floats_of(&part); ++k)
                sum.texels[k] += j & 1 ? -part.texels[k] : part.texels[k];
        }
        envmap_free(&part);
    }
    envmap_free(&mips);
    envmap_free(&bands[0]);
    envmap_free(&bands[1]);
}

static const struct {
    const char *name;
    void (*run)(envmap *dst, const envmap *src);
} ways[] = {{"one by one", one_by_one},
            {"chain", chain_shared},
            {"from the level before", levels_exact},
            {"the same, Gaussians", levels_gaussian},
            {"the same, kept finer", finer_exact},
            {"Gaussians, kept finer", finer_gaussian},
            {"from mip levels", from_mips},
            {"from differences", from_differences}};

/* ----------------------------------------------------------------------------- the figures -- */

static void line(FILE *out, int way, envmap *dst, const envmap *truth, const envmap *src) {
    double best = 1e9, first = measure_now(), one = measure_copy(src, dst, LEVELS, measure_now);
    for (int run = 0; run < 7 && measure_now() - first < 1.5; ++run) {
        double start = measure_now();
        ways[way].run(dst, src);
        double t = measure_now() - start;
        best = t < best ? t : best;
    }
    fprintf(out, "| %s | %.0f |", ways[way].name, best / one);
    for (int i = 0; i < LEVELS; ++i) {
        envmap_difference d;
        need(envmap_compare(&d, dst, truth, i));
        fprintf(out, " %.0e, %.0e |", d.rms, d.worst);
    }
    fprintf(out, "\n");
}

static void table(FILE *out, const char *name, const envmap *sky) {
    envmap src = create(SIZE, 1), dst = create(SIZE, LEVELS), truth = create(SIZE, LEVELS);
    fprintf(stderr, "pyramid: %s\n", name);
    need(envmap_resample(&src, sky, NULL));
    chain(&truth, &src, 1e-6);
    fprintf(out, "\n**%s**\n\n| way | copies |", name);
    for (int i = 0; i < LEVELS; ++i)
        fprintf(out, " %d², N = %g |", SIZE >> i, (double)exponents[i]);
    fprintf(out, "\n|:--|--:|");
    for (int i = 0; i < LEVELS; ++i) fprintf(out, ":-:|");
    fprintf(out, "\n");
    for (int i = 0; i < COUNT(ways); ++i) line(out, i, &dst, &truth, &src);
    envmap_free(&src);
    envmap_free(&dst);
    envmap_free(&truth);
}

static void table_of_file(FILE *out, const char *path) {
    envmap sky = {0};
    const char *slash = strrchr(path, '/');
    measure_must(envmap_pfm_load(&sky, path, ENVMAP_LATLONG), path);
    table(out, slash ? slash + 1 : path, &sky);
    envmap_free(&sky);
}

static void table_of_scene(FILE *out, int scene) {
    envmap sky = measure_map(ENVMAP_LATLONG, 512, 1, 1);
    scene_fill(&sky, scene);
    table(out, scene_name[scene], &sky);
    envmap_free(&sky);
}

int main(int argc, char **argv) {
    int docs = argc == 3 && !strcmp(argv[1], "--docs");
    FILE *out = measure_begin(&document, "table");
    for (int i = 1; i < LEVELS; ++i) make_quotient(i);
    fprintf(out,
            "Source 6 x %d², one thread, %s. Time in copies; then rms and worst texel of "
            "each level.\n",
            SIZE, MEASURE_COMPILER);
    if (docs || argc == 1)
        for (int i = 0; i < SCENE_COUNT; ++i) table_of_scene(out, i);
    else
        for (int i = 1; i < argc; ++i) table_of_file(out, argv[i]);
    measure_end(&document, out, 1);
    if (docs) {
        char path[4096];
        snprintf(path, sizeof path, "%s/pyramids.md", argv[2]);
        measure_write(&document, path, "make pyramid");
    }
    measure_document_free(&document);
    return 0;
}
