/* methods.c - the approximations of examples/methods/, measured: how far each is from the truth and
   how long it takes, on three made-up scenes and on the lat-long PFM files that you name.

   What you will see: Markdown tables. First every method is verified (a constant stays itself), and
   the truths are (against plain sums over the source); then, for each lobe, the methods are timed:
       ms      the best of three runs on the first scene, one thread; resampling to the method's
               parameterization, levels and tables are built anew each time
       copies  ms over the time to memcpy the source and the result (best of seven, same run)
       rms, worst  envmap_compare against the truth: for GGX the definition, for others the fast
               filter at a tolerance of 1e-4
   Sources are cubes of 128 x 128 (files: lat-long), results cubes of 32 x 32.

   usage: methods [--docs DIR] [FILE.pfm]...   with files, the tables of the lobes only
   --docs writes the tables into DIR/methods.md between its two markers, and draws DIR/charts/.
   The exit status is 1 when a verification fails.

   >>clock >>rows >>truth >>tables >>details >>charts >>main

   SPDX-License-Identifier: MIT */

#define _POSIX_C_SOURCE 200809L
#include "measure.h"

#include "../methods/box_levels.h"
#include "../methods/importance_sampling.h"
#include "../methods/paraboloid_convolution.h"
#include "../methods/separable_gaussian.h"
#include "../methods/summed_area.h"
#include "../tool/picture.h"
#include "../tool/scenes.h"
#include "svg.h"

#define SOURCE 128
#define RESULT 32

/* ----------------------------------------------------------------------------------- >>clock -- */

static double milliseconds(void) { return 1e3 * measure_seconds(); }

static double copy_time(const envmap *src, const envmap *dst) {
    return 1e3 * measure_copy(src, dst, dst->levels, measure_seconds);
}

/* Everything that is printed goes to stdout and, where it is open, into the document. */
static measure_document page;
static FILE *document;

static void say(const char *format, ...) {
    va_list list;
    va_start(list, format);
    vprintf(format, list);
    va_end(list);
    if (!document) return;
    va_start(list, format);
    vfprintf(document, format, list);
    va_end(list);
}

/* ------------------------------------------------------------------------------------ >>rows -- */

typedef method_row row;

static envmap_result fast(envmap *dst, const envmap *src, const envmap_lobe *lobe,
                          const method_desc *desc) {
    (void)desc;
    return envmap_filter(dst, src, lobe, NULL);
}

/* What each kind of method reads of a method_desc. */
#define PLAIN(form)                                                                                \
    { form, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0 }
#define PARABOLOID(form, cut, limit, one, lossy)                                                   \
    { form, cut, limit, one, lossy, 0, 0, 0, 0, 0, 0, 0, 0, 0 }
#define SAMPLING(form, samples, half)                                                              \
    { form, 0, 0, 0, 0, 0, 0, samples, half, 0, 0, 0, 0, 0 }
#define AREAS(form, discs, strips)                                                                 \
    { form, 0, 0, 0, 0, 0, 0, 0, 0, discs, strips, 0, 0, 0 }

static const row rows[] = {
    {"`envmap_filter`, tolerance 1e-3", fast, PLAIN(0)},
    {"paraboloid, published", method_paraboloid_convolution, PLAIN(1)},
    {"paraboloid, published, lossy", method_paraboloid_convolution, PARABOLOID(1, 0, 0, 0, 1)},
    {"paraboloid, published, S only", method_paraboloid_convolution, PARABOLOID(1, 0, 0, 1, 0)},
    {"paraboloid, mended", method_paraboloid_convolution, PLAIN(0)},
    {"paraboloid, mended, 31 texels, cut 0.01", method_paraboloid_convolution,
     PARABOLOID(0, 0.01f, 31, 0, 0)},
    {"box levels, published", method_box_levels, PLAIN(1)},
    {"box levels, mended", method_box_levels, PLAIN(0)},
    {"Gaussian, published", method_separable_gaussian, PLAIN(1)},
    {"Gaussian, mended", method_separable_gaussian, PLAIN(0)},
    {"sampling, published, 256", method_importance_sampling, SAMPLING(1, 256, 0)},
    {"sampling, half a texel off, 256", method_importance_sampling, SAMPLING(1, 256, 1)},
    {"sampling, mended, 32", method_importance_sampling, SAMPLING(0, 32, 0)},
    {"sampling, mended, 256", method_importance_sampling, SAMPLING(0, 256, 0)},
    {"summed areas, published", method_summed_area, PLAIN(1)},
    {"summed areas, 8 discs of 9", method_summed_area, AREAS(0, 8, 9)},
    {"summed areas, 24 discs of 25", method_summed_area, AREAS(0, 24, 25)}};

typedef struct named_lobe {
    const char *name;
    envmap_lobe lobe;
} named_lobe;

#define LOBES 5
static void make_lobes(named_lobe lobes[LOBES]) {
    lobes[0].name = "Phong N = 10", lobes[0].lobe = envmap_lobe_phong(10);
    lobes[1].name = "Phong N = 100", lobes[1].lobe = envmap_lobe_phong(100);
    lobes[2].name = "Phong N = 500", lobes[2].lobe = envmap_lobe_phong(500);
    lobes[3].name = "GGX alpha = 0.25", lobes[3].lobe = envmap_lobe_ggx(0.25f);
    lobes[4].name = "diffuse", lobes[4].lobe = envmap_lobe_diffuse();
}

/* ----------------------------------------------------------------------------------- >>truth -- */

#define SCENES_MOST 16
typedef struct bench {
    envmap sources[SCENES_MOST], truths[SCENES_MOST];
    char names[SCENES_MOST][32];
    int scenes, failed;
} bench;

static void make_truths(bench *b, const named_lobe *lobe) {
    envmap_filter_desc desc = {0};
    desc.tolerance = 1e-4f;
    if (lobe->lobe.kind == ENVMAP_LOBE_GGX) desc.method = ENVMAP_METHOD_REFERENCE;
    for (int i = 0; i < b->scenes; ++i) {
        measure_must(envmap_filter(b->truths + i, b->sources + i, &lobe->lobe, &desc), "a truth");
        if (!measure_truth_holds(b->truths + i, b->sources + i, &lobe->lobe, lobe->name))
            b->failed = 1;
    }
}

/* A constant stays itself, or the method refuses the lobe with METHOD. */
static void verify_method(bench *b, const row *r, const named_lobe *lobe) {
    envmap src = measure_map(ENVMAP_CUBE, 16, 1, 1), dst = measure_map(ENVMAP_CUBE, 8, 1, 1);
    measure_flat(&src, 2);
    envmap_result result = r->call(&dst, &src, &lobe->lobe, &r->desc);
    int ok =
        result ? result == ENVMAP_ERROR_METHOD : r->desc.lossy || measure_is_flat(&dst, 2, 1e-3f);
    if (!ok) {
        fprintf(stderr, "%s, %s: a constant does not stay itself\n", r->name, lobe->name);
        b->failed = 1;
    }
    envmap_free(&src);
    envmap_free(&dst);
}

/* ---------------------------------------------------------------------------------- >>tables -- */

typedef struct point {
    double ms, rms;
    int ok;
} point;

static point points[LOBES][COUNT(rows)]; /* the second scene, for the chart */

/* Best of `times`, or of fewer when a third of a second has passed. */
static double time_of(envmap *dst, const envmap *src, const envmap_lobe *lobe, const row *r,
                      int times, envmap_result *result) {
    double best = 1e9, all = 0;
    for (int i = 0; i < times && all < 333; ++i) {
        double start = milliseconds(), ms;
        *result = r->call(dst, src, lobe, &r->desc);
        ms = milliseconds() - start, all += ms;
        best = fmin(best, ms);
    }
    return best;
}

static void measure(bench *b, const row *r, const named_lobe *lobe, point *chart) {
    envmap dst = measure_map(ENVMAP_CUBE, RESULT, 1, 1);
    say("| %s |", r->name);
    for (int i = 0; i < b->scenes; ++i) {
        envmap_difference d;
        envmap_result result;
        double ms = time_of(&dst, b->sources + i, &lobe->lobe, r, i ? 1 : 3, &result);
        if (result) {
            say(i ? " | |" : " refused: %s | |", envmap_result_text(result));
            if (!i) say(" |");
            continue;
        }
        measure_must(envmap_compare(&d, &dst, b->truths + i, 0), "a comparison");
        if (!i) say(" %.3g | %.0f |", ms, ms / copy_time(b->sources, &dst));
        say(" %.2g | %.2g |", d.rms, d.worst);
        if (!i) chart->ms = ms;
        if (i == SCENE_STUDIO) chart->rms = d.rms, chart->ok = 1;
    }
    say("\n");
    envmap_free(&dst);
}

static void table(bench *b, const named_lobe *lobe, point *chart) {
    say("\n### %s\n\n| method | ms | copies |", lobe->name);
    for (int i = 0; i < b->scenes; ++i) say(" %s: rms | worst |", b->names[i]);
    say("\n|---|--:|--:|");
    for (int i = 0; i < b->scenes; ++i) say("--:|--:|");
    say("\n");
    make_truths(b, lobe);
    for (int i = 0; i < COUNT(rows); ++i) {
        verify_method(b, rows + i, lobe);
        if (!b->failed) measure(b, rows + i, lobe, chart + i);
        fflush(stdout);
    }
}

/* --------------------------------------------------------------------------------- >>details -- */

static void paraboloid_table(void) {
    static const float exponents[] = {10, 50, 100, 250, 500};
    say("\n### Paraboloid filter sizes (faces of 512, cut 0.1, limit 7)\n\n"
        "| N | S: size | shrink | L: size | shrink | energy cut | distortion at the rim |\n"
        "|--:|--:|--:|--:|--:|--:|--:|\n");
    for (int i = 0; i < COUNT(exponents); ++i) {
        envmap_lobe lobe = envmap_lobe_phong(exponents[i]);
        int size[2], shrink[2];
        paraboloid_sizes(size, shrink, &lobe, 512, 0.1, 7);
        say("| %g | %d | %d | %d | %d | %.1f %% | %.1f %% |\n", (double)exponents[i], size[0],
            shrink[0], size[1], shrink[1],
            100 * (1 - paraboloid_share(&lobe, paraboloid_angle(&lobe, 0.1))),
            100 * paraboloid_distortion(1, size[1] / 512.0));
    }
}

/* The level that leaves the least rms over the scenes: golden section. */
static double box_error(bench *b, const envmap_lobe *lobe, double level, int scene) {
    envmap dst = measure_map(ENVMAP_CUBE, RESULT, 1, 1);
    envmap_difference d;
    method_desc desc = {0};
    desc.level = (float)level;
    measure_must(method_box_levels(&dst, b->sources + scene, lobe, &desc), "box levels");
    measure_must(envmap_compare(&d, &dst, b->truths + scene, 0), "a comparison");
    envmap_free(&dst);
    return d.rms;
}

static void box_table(bench *b) {
    say("\n### Box levels: b for N, faces of %d\n\n| N | b of the lobe |", SOURCE);
    for (int i = 0; i < SCENE_COUNT; ++i)
        say(" %s: best b | rms | rms at the lobe's |", b->names[i]);
    say("\n|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|\n");
    for (float n = 14.0625f; n < 1000; n *= 4) {
        named_lobe lobe;
        lobe.name = "Phong", lobe.lobe = envmap_lobe_phong(n);
        double own = method_box_level(&lobe.lobe, SOURCE);
        make_truths(b, &lobe);
        say("| %g | %.2f |", (double)n, own);
        for (int i = 0; i < SCENE_COUNT; ++i) {
            double from = fmax(own - 1.5, 0.01), to = own + 1, g = 0.6180339887;
            for (int k = 0; k < 9; ++k) {
                double p = to - g * (to - from), q = from + g * (to - from);
                if (box_error(b, &lobe.lobe, p, i) < box_error(b, &lobe.lobe, q, i)) to = q;
                else from = p;
            }
            double best = (from + to) / 2;
            say(" %.2f | %.2g | %.2g |", best, box_error(b, &lobe.lobe, best, i),
                box_error(b, &lobe.lobe, own, i));
        }
        say("\n");
    }
}

static void gaussian_table(bench *b) {
    say("\n### Separable Gaussian: Phong against its own lobe, sigma, and the misfit of the two\n\n"
        "| N | sigma | misfit |");
    for (int i = 0; i < SCENE_COUNT; ++i) say(" %s: rms |", b->names[i]);
    say("\n|--:|--:|--:|--:|--:|--:|\n");
    for (float n = 8; n < 1000; n *= 2) {
        named_lobe lobe;
        double misfit = 0;
        lobe.name = "Phong", lobe.lobe = envmap_lobe_phong(n);
        double sigma = method_gaussian(&misfit, &lobe.lobe);
        make_truths(b, &lobe);
        say("| %g | %.3g | %.2g |", (double)n, sigma, misfit);
        for (int i = 0; i < SCENE_COUNT; ++i) {
            envmap dst = measure_map(ENVMAP_CUBE, RESULT, 1, 1);
            envmap_difference d;
            measure_must(method_separable_gaussian(&dst, b->sources + i, &lobe.lobe, NULL),
                         "Gaussian");
            measure_must(envmap_compare(&d, &dst, b->truths + i, 0), "a comparison");
            say(" %.2g |", d.rms);
            envmap_free(&dst);
        }
        say("\n");
    }
}

/* A chain, its time and what each level differs by from its own Gaussian. */
static double heat_kernel(double x, double sigma) {
    double a = 1, b = x, sum = 1 + 3 * exp(-sigma * sigma) * x;
    for (int l = 2; 0.5 * l * (l + 1) * sigma * sigma < 40; ++l) {
        double c = ((2 * l - 1) * x * b - (l - 1) * a) / l;
        a = b, b = c, sum += (2 * l + 1) * exp(-0.5 * l * (l + 1) * sigma * sigma) * c;
    }
    return fmax(sum, 0);
}

static double chain_error(const envmap *dst, const envmap *src, const envmap_lobe *lobe,
                          int level) {
    enum { SAMPLES = 4096 };
    static float table[SAMPLES];
    double sigma = method_gaussian(NULL, lobe);
    envmap got = measure_map(ENVMAP_CUBE, method_edge(dst, level), 1, 1);
    envmap truth = measure_map(ENVMAP_CUBE, got.size, 1, 1);
    envmap_difference d;
    envmap_filter_desc desc = {0};
    desc.tolerance = 1e-4f;
    for (int i = 0; i < SAMPLES; ++i)
        table[i] = (float)heat_kernel(cos(METHOD_PI * i / (SAMPLES - 1)), sigma);
    for (int i = 0; i < SAMPLES; ++i) table[i] = table[i] > 1e-7f * table[0] ? table[i] : 0;
    envmap_lobe heat = envmap_lobe_table(table, SAMPLES, 1, 0, 0);
    memcpy(got.texels, envmap_texel(dst, level, 0, 0, 0, 0), method_floats(&got) * sizeof(float));
    measure_must(envmap_filter(&truth, src, &heat, &desc), "a truth");
    measure_must(envmap_compare(&d, &got, &truth, 0), "a comparison");
    envmap_free(&got);
    envmap_free(&truth);
    return d.rms;
}

static void chain_lines(void) {
    envmap src = measure_map(ENVMAP_CUBE, 256, 1, 1), dst = measure_map(ENVMAP_CUBE, 256, 5, 1);
    envmap_lobe lobes[5];
    for (int i = 0; i < 5; ++i) lobes[i] = envmap_lobe_phong((float)(8192 >> 2 * i));
    for (int form = METHOD_MENDED; form <= METHOD_PUBLISHED; ++form) {
        method_desc desc = {0};
        double best = 1e9, copy = 1e9;
        desc.form = form;
        scene_fill(&src, SCENE_OVERCAST);
        for (int i = 0; i < (form ? 2 : 15); ++i) {
            double start = milliseconds();
            measure_must(method_separable_chain(&dst, &src, lobes, 5, &desc), "a chain");
            best = fmin(best, milliseconds() - start);
            copy = fmin(copy, copy_time(&src, &dst));
        }
        say("\nA chain N = 8192, 2048, 512, 128, 32 on levels 0 ... 4 of faces of 256, %s: %.3g "
            "ms, "
            "%.0f copies; rms against the Gaussian of its first harmonic on levels 2, 3, 4:",
            form ? "as published" : "mended", best, best / copy);
        for (int scene = 0; scene < SCENE_COUNT; ++scene) {
            scene_fill(&src, scene);
            measure_must(method_separable_chain(&dst, &src, lobes, 5, &desc), "a chain");
            say("%s %s", scene ? ";" : "", scene_name[scene]);
            for (int i = 2; i < 5; ++i) say(" %.2g", chain_error(&dst, &src, lobes + i, i));
        }
        say(".\n");
    }
    envmap_free(&src);
    envmap_free(&dst);
}

static const int sample_counts[] = {8, 16, 32, 64, 128, 256, 512, 1024, 2048, 4096};
static double sample_errors[3][COUNT(sample_counts)];

static void sampling_table(bench *b) {
    envmap_lobe lobe = envmap_lobe_ggx(0.25f);
    envmap dst = measure_map(ENVMAP_CUBE, 8, 1, 1), truth[SCENE_COUNT];
    envmap_filter_desc reference = {0};
    reference.method = ENVMAP_METHOD_REFERENCE;
    say("\n### Importance sampling: GGX alpha = 0.25, rms and worst texel against samples\n\n"
        "| samples | us per texel |");
    for (int i = 0; i < SCENE_COUNT; ++i) say(" %s: rms | worst |", b->names[i]);
    say("\n|--:|--:|--:|--:|--:|--:|--:|--:|\n");
    for (int i = 0; i < SCENE_COUNT; ++i) {
        truth[i] = measure_map(ENVMAP_CUBE, 8, 1, 1);
        measure_must(envmap_filter(truth + i, b->sources + i, &lobe, &reference), "a truth");
    }
    for (int k = 0; k < COUNT(sample_counts); ++k) {
        method_desc desc = {0};
        desc.samples = sample_counts[k];
        say("| %d |", desc.samples);
        for (int i = 0; i < SCENE_COUNT; ++i) {
            envmap_difference d;
            double start, ms;
            start = milliseconds();
            measure_must(method_importance_sampling(&dst, b->sources + i, &lobe, &desc),
                         "sampling");
            ms = milliseconds() - start;
            measure_must(envmap_compare(&d, &dst, truth + i, 0), "a comparison");
            if (!i) say(" %.3g |", 1e3 * ms / (6 * 64));
            say(" %.2g | %.2g |", d.rms, d.worst);
            sample_errors[i][k] = d.rms;
        }
        say("\n");
    }
    envmap_free(&dst);
    for (int i = 0; i < SCENE_COUNT; ++i) envmap_free(truth + i);
}

/* The mean over a footprint: 32 x 32 bilinear lookups; and by a box of the table that holds it. */
static void footprint_truth(double rgb[3], const envmap *map, float place[3][3]) {
    rgb[0] = rgb[1] = rgb[2] = 0;
    for (int i = 0; i < 1024; ++i) {
        float d[3], tap[3];
        for (int c = 0; c < 3; ++c)
            d[c] = place[0][c] + (((float)(i % 32) + 0.5f) / 32 - 0.5f) * place[1][c] +
                   (((float)(i / 32) + 0.5f) / 32 - 0.5f) * place[2][c];
        envmap_lookup(tap, map, d, 0);
        for (int c = 0; c < 3; ++c) rgb[c] += (double)tap[c] / 1024;
    }
}

static void footprint_box(float rgb[3], const summed_area *sums, const envmap *map,
                          float place[3][3]) {
    float u, v, half[2] = {0, 0};
    int face, other;
    envmap_coordinates(&face, &u, &v, map->mapping, place[0]);
    for (int side = 1; side < 3; ++side) {
        float d[3], a, b;
        for (int c = 0; c < 3; ++c) d[c] = place[0][c] + 0.5f * place[side][c];
        envmap_coordinates(&other, &a, &b, map->mapping, d);
        a -= u, b -= v;
        if (sums->wraps) a -= floorf(a + 0.5f);
        half[0] += fabsf(a), half[1] += fabsf(b);
    }
    summed_area_box(rgb, sums, face, (double)(u - half[0]), (double)(v - half[1]),
                    (double)(u + half[0]), (double)(v + half[1]));
}

/* 200 footprints around an axis, at an angle from it. */
static void footprint_row(const char *what, const envmap *scene, int mapping, const float axis[3],
                          float away, float longer, float shorter) {
    envmap map = measure_map(mapping, 256, envmap_levels(256), 1);
    summed_area sums;
    double error[3] = {0, 0, 0}, all = 0;
    measure_must(envmap_resample(&map, scene, NULL), "a map");
    measure_must(envmap_mips_build(&map), "levels");
    measure_must(summed_area_create(&sums, &map, 0), "a table");
    for (int i = 0; i < 200; ++i) {
        float x[3], y[3], place[3][3], rgb[3], turn = 2.39996f * (float)i;
        double truth[3];
        method_frame(x, y, axis);
        for (int c = 0; c < 3; ++c)
            place[0][c] =
                cosf(away) * axis[c] + sinf(away) * (cosf(turn) * x[c] + sinf(turn) * y[c]);
        method_frame(x, y, place[0]);
        turn *= 1.7f;
        for (int c = 0; c < 3; ++c) {
            place[1][c] = longer * (cosf(turn) * x[c] + sinf(turn) * y[c]);
            place[2][c] = shorter * (cosf(turn) * y[c] - sinf(turn) * x[c]);
        }
        footprint_truth(truth, &map, place);
        for (int k = 0; k < 3; ++k) {
            if (k < 2) envmap_lookup_footprint(rgb, &map, place[0], place[1], place[2], k ? 16 : 1);
            else footprint_box(rgb, &sums, &map, place);
            for (int c = 0; c < 3; ++c)
                error[k] += ((double)rgb[c] - truth[c]) * ((double)rgb[c] - truth[c]);
        }
        for (int c = 0; c < 3; ++c) all += truth[c] * truth[c];
    }
    say("| %s | %.2g x %.2g |", what, (double)longer, (double)shorter);
    for (int k = 0; k < 3; ++k) say(" %.2g |", sqrt(error[k] / all));
    say("\n");
    summed_area_free(&sums);
    envmap_free(&map);
}

static void footprint_table(const envmap *scene) {
    static const float ahead[3] = {0, 0, -1}, up[3] = {0, 1, 0}, side[3] = {1, 0, 0};
    say("\n### Lookups over a footprint (overcast, maps of 256): rms\n\n| where | footprint, rad | "
        "one level | 16 probes | summed areas |\n|---|---|--:|--:|--:|\n");
    footprint_row("cube, 0.4 from a face's centre", scene, ENVMAP_CUBE, side, 0.4f, 0.4f, 0.05f);
    footprint_row("lat-long, at the horizon", scene, ENVMAP_LATLONG, up, 1.5f, 0.2f, 0.05f);
    footprint_row("lat-long, 0.1 from a pole", scene, ENVMAP_LATLONG, up, 0.1f, 0.1f, 0.1f);
    footprint_row("lat-long, 0.1 from a pole", scene, ENVMAP_LATLONG, up, 0.1f, 0.2f, 0.05f);
    footprint_row("sphere map, 0.2 from its rim", scene, ENVMAP_SPHERE, ahead, 0.2f, 0.1f, 0.1f);
    footprint_row("sphere map, 0.2 from its rim", scene, ENVMAP_SPHERE, ahead, 0.2f, 0.2f, 0.05f);
}

/* ---------------------------------------------------------------------------------- >>charts -- */

static FILE *chart_open(const char *dir, const char *name, const char *title, const char *x,
                        const char *y) {
    FILE *f = svg_open(dir, name, 720, 440, title);
    svg_text(f, 370, 432, 12, "middle", "#444", "%s", x);
    svg_text(f, 70, 39, 12, "start", "#444", "%s", y);
    return f;
}

static svg_axes chart_axes(double x0, double x1, double y0, double y1, int logarithmic) {
    svg_axes a = {70, 44, 670, 390, 0, 0, 0, 0, 0, 0};
    a.x0 = x0, a.x1 = x1, a.y0 = y0, a.y1 = y1, a.log_x = a.log_y = logarithmic;
    return a;
}

static void chart_tick(FILE *f, const svg_axes *a, int vertical, double value) {
    char label[24];
    snprintf(label, sizeof label, "%g", value);
    if (vertical) svg_tick_y(f, a, value, label);
    else svg_tick_x(f, a, value, label);
}

/* A label's box; y is the text's baseline. Dots and points of leaders are boxes too. */
typedef struct label {
    double x, y, width, height;
} label;

static int label_clear(const label *l, const label *others, int count) {
    for (int i = 0; i < count; ++i)
        if (fabs(others[i].y - l->y) < (others[i].height + l->height) / 2 &&
            others[i].x <= l->x + l->width && others[i].x + others[i].width >= l->x)
            return 0;
    return 1;
}

enum { LEADER = 8 };

/* Points of the line from a dot to its label, without those beside the dot. */
static void label_leader(label out[LEADER], const label *l, double x, double y) {
    double near_x = l->x > x ? l->x - 1 : l->x + l->width + 1;
    for (int i = 0; i < LEADER; ++i) {
        double t = (i + 3.0) / (LEADER + 3);
        out[i].x = x + t * (near_x - x), out[i].y = y + 3 + t * (l->y - 3 - y);
        out[i].width = 1, out[i].height = 2;
    }
}

/* Puts a label to the right or left of its dot, level with it or above or below, where it is clear
   of the others, leaders too, and inside the frame. */
static label label_place(const svg_axes *a, const point *p, const char *text, const label *others,
                         int count) {
    label l = {0, 0, 5.6 * (double)strlen(text), 12}, leader[LEADER], second = l;
    double x = svg_x(a, p->ms), y = svg_y(a, p->rms);
    int clear = 0;
    for (int step = 0; !clear && step < 240; ++step) {
        int rise = step / 12, out = 7 + 18 * (step / 2 % 6);
        l.x = x + (step & 1 ? -out - l.width : out);
        l.y = y + 3 + 6 * (rise & 1 ? rise + 1 : -rise);
        clear = l.x > a->left && l.x + l.width < a->right && l.y > a->top + 12 && l.y < a->bottom &&
                label_clear(&l, others, count);
        if (clear && !(second.x > 0)) second = l; /* its leader may cross another */
        label_leader(leader, &l, x, y);
        for (int i = 0; i < LEADER && out + rise > 7; ++i)
            clear &= label_clear(&leader[i], others, count);
    }
    return clear || !(second.x > 0) ? l : second;
}

/* Error against time of every method, for one lobe, on the second scene. */
static void chart_methods(const char *dir, const char *name, const char *title,
                          const point *chart) {
    FILE *f = chart_open(dir, name, title, "time, ms", "rms error, relative");
    svg_axes a = chart_axes(0.3, 1e4, 1e-6, 1, 1);
    for (double t = 1; t < 2e4; t *= 10) chart_tick(f, &a, 0, t);
    for (double e = 1e-6; e < 2; e *= 10) chart_tick(f, &a, 1, e);
    svg_frame(f, &a);
    label labels[(2 + LEADER) * COUNT(rows)]; /* the dots, then labels and leaders */
    int count = 0;
    for (int i = 0; i < COUNT(rows); ++i) {
        label dot = {svg_x(&a, chart[i].ms) - 5, svg_y(&a, chart[i].rms) + 3, 10, 10};
        if (chart[i].ok) labels[count++] = dot;
    }
    for (int i = 0; i < COUNT(rows); ++i) {
        if (!chart[i].ok) continue;
        const char *text = i ? rows[i].name : "envmap_filter";
        const char *colour = i == 0                         ? "#000"
                             : strstr(rows[i].name, "publ") ? svg_colours[2]
                             : strstr(rows[i].name, "half") ? svg_colours[2]
                                                            : svg_colours[0];
        label l = labels[count] = label_place(&a, chart + i, text, labels, count);
        ++count;
        double x = svg_x(&a, chart[i].ms), y = svg_y(&a, chart[i].rms);
        double near_x = l.x > x ? l.x : l.x + l.width;
        if (fabs(l.y - y) > 6 || fabs(near_x - x) > 8) {
            label_leader(labels + count, &l, x, y), count += LEADER;
            fprintf(f, "<path d=\"M%.1f %.1fL%.1f %.1f\" stroke=\"%s\" stroke-width=\"0.7\"/>\n", x,
                    y, l.x > x ? near_x - 1 : near_x + 1, l.y - 3, colour);
        }
        svg_dot(f, &a, chart[i].ms, chart[i].rms, 4, colour, colour);
        svg_text(f, near_x, l.y, 10, l.x > x ? "start" : "end", colour, "%s", text);
    }
    svg_close(f);
}

static void chart_samples(const char *dir) {
    FILE *f = chart_open(dir, "sampling.svg", "Filtered importance sampling, GGX alpha = 0.25",
                         "samples per texel", "rms error, relative");
    svg_axes a = chart_axes(8, 4096, 1e-4, 1, 1);
    double x[COUNT(sample_counts)];
    for (int n = 8; n <= 4096; n *= 2) chart_tick(f, &a, 0, n);
    for (double e = 1e-4; e < 2; e *= 10) chart_tick(f, &a, 1, e);
    svg_frame(f, &a);
    for (int k = 0; k < COUNT(sample_counts); ++k) x[k] = sample_counts[k];
    for (int i = 0; i < 3; ++i) {
        svg_line(f, &a, x, sample_errors[i], COUNT(sample_counts), svg_colours[i], 2, "");
        svg_text(f, 88, 372 - 18 * i, 12, "start", svg_colours[i], "%s", scene_name[i]);
    }
    svg_close(f);
}

static void chart_distortion(const char *dir) {
    FILE *f = chart_open(dir, "distortion.svg",
                         "How far a circle's image is off its centre: "
                         "|a - b| / (a + b)",
                         "distance d from the map's centre, 1: the rim",
                         "offset over the circle's width");
    svg_axes a = chart_axes(0, 1, 0, 0.5, 0);
    double x[65], y[65];
    for (int i = 0; i <= 5; ++i) chart_tick(f, &a, 0, 0.2 * i), chart_tick(f, &a, 1, 0.1 * i);
    svg_frame(f, &a);
    for (int k = 0; k < 4; ++k) {
        double r = k == 3 ? 260.0 / 512 : 0.125 * (k + 1);
        for (int i = 0; i <= 64; ++i) x[i] = i / 64.0, y[i] = paraboloid_distortion(x[i], r);
        svg_line(f, &a, x, y, 65, svg_colours[k], 2, "");
        svg_text(f, 88, 107 - 16 * k, 12, "start", svg_colours[k],
                 "radius %.3g: %.1f %% at the rim", r, 100 * paraboloid_distortion(1, r));
    }
    svg_close(f);
}

/* The studio through Phong N = 100: the truth, and what each method makes of it. */
static void draw_methods(const char *dir, bench *b) {
    static const int shown[] = {1, 4, 6, 7, 8, 9, 12, 13, 14, 15};
    const int w = 300, h = 150, gap = 24;
    named_lobe lobe;
    picture p;
    char path[1024];
    lobe.name = "Phong", lobe.lobe = envmap_lobe_phong(100);
    make_truths(b, &lobe);
    if (!picture_create(&p, 3 * w, 4 * (h + gap))) return;
    picture_rectangle(&p, 0, 0, p.width, p.height, 0x15171Cu, 1);
    float exposure = picture_exposure(b->sources + SCENE_STUDIO);
    for (int i = -2; i < COUNT(shown); ++i) {
        envmap dst = measure_map(ENVMAP_CUBE, RESULT, 1, 1);
        const envmap *map = i == -2 ? b->sources + SCENE_STUDIO
                            : i < 0 ? b->truths + SCENE_STUDIO
                                    : &dst;
        int x = (i + 2) % 3 * w, y = (i + 2) / 3 * (h + gap);
        if (i >= 0)
            measure_must(rows[shown[i]].call(&dst, b->sources + SCENE_STUDIO, &lobe.lobe,
                                             &rows[shown[i]].desc),
                         "a picture");
        picture_panorama(&p, x, y + gap, w - 4, h - 4, exposure, map);
        picture_text(&p, (float)x + 4, (float)y + 8, 9, 0xF3F1ECu,
                     i == -2 ? "studio"
                     : i < 0 ? "Phong N = 100, exact"
                             : rows[shown[i]].name);
        envmap_free(&dst);
    }
    snprintf(path, sizeof path, "%s/images/methods.png", dir);
    if (!picture_save(&p, path)) fprintf(stderr, "cannot write %s\n", path);
    picture_free(&p);
}

/* ------------------------------------------------------------------------------------ >>main -- */

static void add_file(bench *b, const char *path) {
    const char *name = strrchr(path, '/') ? strrchr(path, '/') + 1 : path;
    if (b->scenes == SCENES_MOST) return;
    envmap *map = b->sources + b->scenes;
    measure_must(envmap_pfm_load(map, path, ENVMAP_LATLONG), path);
    snprintf(b->names[b->scenes], sizeof b->names[0], "%.*s", (int)strcspn(name, "."), name);
    b->truths[b->scenes++] = measure_map(ENVMAP_CUBE, RESULT, 1, 1);
}

static void draw(const char *docs, bench *b) {
    char path[1024];
    chart_methods(docs, "methods-phong100.svg", "Phong N = 100, studio", points[1]);
    chart_methods(docs, "methods-ggx.svg", "GGX alpha = 0.25, studio", points[3]);
    chart_samples(docs);
    chart_distortion(docs);
    draw_methods(docs, b);
    snprintf(path, sizeof path, "%s/methods.md", docs);
    measure_write(&page, path, "make methods");
}

int main(int argc, char **argv) {
    static bench b;
    named_lobe lobes[LOBES];
    const char *docs = NULL;
    for (int i = 0; i < SCENE_COUNT; ++i) {
        b.sources[i] = measure_map(ENVMAP_CUBE, SOURCE, 1, 1);
        b.truths[i] = measure_map(ENVMAP_CUBE, RESULT, 1, 1);
        scene_fill(b.sources + i, i);
        snprintf(b.names[i], sizeof b.names[i], "%s", scene_name[i]);
    }
    b.scenes = SCENE_COUNT;
    for (int i = 1; i < argc; ++i) {
        if (!strcmp(argv[i], "--docs") && i + 1 < argc) docs = argv[++i];
        else add_file(&b, argv[i]);
    }
    if (docs) document = measure_begin(&page, "tables");
    make_lobes(lobes);
    for (int i = 0; i < LOBES && !b.failed; ++i) table(&b, lobes + i, points[i]);
    if (!b.failed && (docs || b.scenes == SCENE_COUNT)) {
        b.scenes = SCENE_COUNT; /* the details are about the made-up scenes */
        paraboloid_table();
        box_table(&b);
        gaussian_table(&b);
        chain_lines();
        sampling_table(&b);
        footprint_table(b.sources);
    }
    if (document) measure_end(&page, document, 0);
    if (docs && document && !b.failed) draw(docs, &b);
    for (int i = 0; i < SCENES_MOST; ++i) envmap_free(b.sources + i), envmap_free(b.truths + i);
    measure_document_free(&page);
    return b.failed;
}
