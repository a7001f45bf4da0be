/* filters.c - what the filters see of a scene, what they cost and how far they are from the truth: the
   tables, the charts and the picture of docs/filters.md.

   What you will see: `filters` prints the tables; `filters DOCS` also writes them between the
   marks in DOCS/filters.md, the charts DOCS/charts/filters-*.svg and DOCS/images/filters-sun.png.
       cc -O3 -march=native -std=c99 -I. examples/measure/filters.c -o filters -lm -lpthread

   >>tools    scenes, progress
   >>works    what is measured
   >>truth    the definition at some texels
   >>tables   time and error of works, what they need, error against tolerance, scenes by band
   >>charts   SVG
   >>picture  lights, opened nodes, points
   >>main

   SPDX-License-Identifier: MIT */

#define _POSIX_C_SOURCE 200809L
#include "measure.h"

#include "../tool/picture.h"
#include "../tool/scenes.h"
#include "svg.h"
#include "../tool/threads.h"

/* ----------------------------------------------------------------------------------- >>tools -- */

#define EDGE 256

static envmap skies[SCENE_COUNT]; /* cubes of edge EDGE */

/* A line on stderr that says how far this is. */
static void progress(const char *what) {
    static double start;
    if (!(start > 0)) start = measure_now();
    fprintf(stderr, "filters: %5.1f s  %s\n", measure_now() - start, what);
}

static measure_document document;

/* ----------------------------------------------------------------------------------- >>works -- */

typedef struct work {
    const char *name;
    int kind;
    float parameter;
    int mapping, size, slices, levels; /* of the result */
} work;

static const work works[] = {
    {"Phong N = 10", ENVMAP_LOBE_PHONG, 10, ENVMAP_CUBE, EDGE, 1, 1},
    {"Phong N = 100", ENVMAP_LOBE_PHONG, 100, ENVMAP_CUBE, EDGE, 1, 1},
    {"Phong N = 500", ENVMAP_LOBE_PHONG, 500, ENVMAP_CUBE, EDGE, 1, 1},
    {"Phong N = 2000", ENVMAP_LOBE_PHONG, 2000, ENVMAP_CUBE, EDGE, 1, 1},
    {"GGX α = 0.25", ENVMAP_LOBE_GGX, 0.25f, ENVMAP_CUBE, EDGE, 1, 1},
    {"diffuse, 64²", ENVMAP_LOBE_PHONG, 1, ENVMAP_CUBE, 64, 1, 1},
    {"chain N = 2048 … 2", ENVMAP_LOBE_PHONG, 0, ENVMAP_CUBE, EDGE, 1, 9},
    {"Banks s = 0.99, 2×64²×32", ENVMAP_LOBE_BANKS, 0.99f, ENVMAP_PARABOLOID, 64, 32, 1}};

static envmap_lobe lobe_of(const work *w, int level) {
    static const float chain[9] = {2048, 861, 362, 152, 64, 27, 11, 5, 2};
    if (w->kind == ENVMAP_LOBE_BANKS) return envmap_lobe_banks(w->parameter);
    if (w->kind == ENVMAP_LOBE_GGX) return envmap_lobe_ggx(w->parameter);
    if (w->kind == ENVMAP_LOBE_GAUSSIAN) return envmap_lobe_gaussian(w->parameter);
    return envmap_lobe_phong(w->levels > 1 ? chain[level] : w->parameter);
}

static void run_work(envmap *dst, const envmap *src, const work *w,
                     const envmap_filter_desc *desc) {
    envmap_lobe lobes[9];
    for (int l = 0; l < w->levels; ++l) lobes[l] = lobe_of(w, l);
    measure_must(envmap_filter_chain(dst, src, lobes, w->levels, desc), w->name);
}

/* What a work needs of a source, as envmap_filter_plan says. */
static envmap_plan plan_of(const envmap *src, const work *w, double tolerance) {
    envmap_lobe lobe = lobe_of(w, 0);
    envmap dst = *src;
    envmap_filter_desc desc = {0};
    envmap_plan needs;
    desc.tolerance = (float)tolerance;
    dst.mapping = w->mapping, dst.size = w->size, dst.levels = 1, dst.slices = w->slices;
    measure_must(envmap_filter_plan(&needs, &dst, src, &lobe, &desc), w->name);
    return needs;
}

/* ----------------------------------------------------------------------------------- >>truth --
   The definition, at a lattice of texels and at the darkest and the brightest of every image. */

enum { MOST_PROBES = 4096 };

typedef struct probe {
    const measure_texels *source;
    envmap_lobe lobe;
    double p, reach, axis[3], rgb[3], w;
    const float *texel;
    int even; /* one of the lattice */
} probe;

typedef struct truth {
    measure_texels source;
    probe probes[MOST_PROBES];
    int count;
} truth;

static void probe_task(void *context, int i) {
    probe *q = (probe *)context + i;
    measure_plain_sum(q->rgb, q->source, &q->lobe, q->p, q->axis, q->reach);
}

static void add_probe(truth *t, const envmap *map, const envmap_lobe *lobe, int level, int slice,
                      int face, int x, int y, int even) {
    probe *q = t->probes + t->count;
    double from;
    if (t->count >= MOST_PROBES) return;
    memset(q, 0, sizeof *q);
    q->source = &t->source, q->lobe = *lobe, q->even = even;
    q->p = measure_slice(lobe, slice, map->slices);
    envmap_lobe_support(&from, &q->reach, lobe, q->p);
    measure_direction(q->axis, map, level, face, x, y);
    q->texel = envmap_texel(map, level, slice, face, x, y);
    q->w = envmap_solid_angle(map, level, face, x, y);
    if (!measure_plain_enough(&t->source, lobe, q->p))
        measure_must(ENVMAP_ERROR_LOBE, "too thin for a plain sum");
    t->count += q->w > 0;
}

static double brightness(const float *texel) {
    return (double)fmaxf(fmaxf(texel[0], texel[1]), texel[2]);
}

/* side x side texels of an image, shifted from image to image, and its two extremes. */
static void add_image(truth *t, const envmap *map, const envmap_lobe *lobe, int level, int slice,
                      int face, int side) {
    int size = map->size >> level, dark = 0, bright = 0;
    const float *image = envmap_texel(map, level, slice, face, 0, 0);
    for (int i = 0; i < size * size; ++i) {
        if (!(envmap_solid_angle(map, level, face, i % size, i / size) > 0)) continue;
        if (brightness(image + 3 * i) < brightness(image + 3 * dark)) dark = i;
        if (brightness(image + 3 * i) > brightness(image + 3 * bright)) bright = i;
    }
    if (side > size) side = size;
    for (int i = 0; i < side * side; ++i) {
        double u = 0.7549 * (i + 31 * face + 7 * slice + 3 * level), v = 0.5698 * u + 0.3;
        int x = (int)((i % side + (u - floor(u))) * size / side);
        int y = (int)((i / side + (v - floor(v))) * size / side);
        add_probe(t, map, lobe, level, slice, face, x, y, 1);
    }
    add_probe(t, map, lobe, level, slice, face, dark % size, dark / size, 0);
    add_probe(t, map, lobe, level, slice, face, bright % size, bright / size, 0);
}

/* The truth of a work at some texels of map, which holds a result of it. */
static void find_truth(truth *t, const envmap *map, const envmap *src, const work *w, int side) {
    static threads_pool threads;
    t->count = 0;
    measure_list(&t->source, src);
    for (int l = 0; l < w->levels; ++l) {
        envmap_lobe lobe = lobe_of(w, l);
        int step = w->slices > 8 ? w->slices / 8 : 1;
        for (int slice = step / 2; slice < w->slices; slice += step)
            for (int face = 0; face < envmap_faces(map->mapping); ++face)
                add_image(t, map, &lobe, l, slice, face, side);
    }
    threads_begin(&threads, threads_here());
    threads_run(&threads, probe_task, t->probes, t->count);
    threads_end(&threads);
    free(t->source.at);
}

/* rms over the lattice, and the worst of all, as envmap_compare has them. */
static void miss(double *rms, double *worst, const truth *t) {
    double off = 0, all = 0, sum = 0, solid = 0;
    for (const probe *q = t->probes; q < t->probes + t->count; ++q) {
        if (!q->even) continue;
        for (int c = 0; c < 3; ++c) {
            double e = (double)q->texel[c] - q->rgb[c];
            off += q->w * e * e, all += q->w * q->rgb[c] * q->rgb[c], sum += q->w * q->rgb[c] / 3;
        }
        solid += q->w;
    }
    *rms = sqrt(off / all), *worst = 0;
    for (const probe *q = t->probes; q < t->probes + t->count; ++q) {
        double most = 0, peak = 1e-3 * sum / solid;
        for (int c = 0; c < 3; ++c) {
            most = fmax(most, fabs((double)q->texel[c] - q->rgb[c]));
            peak = fmax(peak, q->rgb[c]);
        }
        *worst = fmax(*worst, most / peak);
    }
}

/* ---------------------------------------------------------------------------------- >>tables -- */

typedef struct figure {
    double copies, rms, worst, memory;
    envmap_plan needs;
} figure;

static figure figures[COUNT(works)][SCENE_COUNT];

static void measure_work(figure *f, const envmap *src, const work *w) {
    static truth t;
    envmap dst = measure_map(w->mapping, w->size, w->levels, w->slices);
    envmap_filter_desc desc = {0};
    measure_meter m = {0, 0, NULL};
    double best = 1e9, spent = 0;
    desc.method = ENVMAP_METHOD_FAST, desc.work.memory = &m;
    double copied = measure_copy(src, &dst, dst.levels, measure_seconds);
    for (int run = 0; run < 9 && (run < 3 || spent < 0.5); ++run) {
        double start = measure_seconds();
        run_work(&dst, src, w, &desc);
        spent += measure_seconds() - start, best = fmin(best, measure_seconds() - start);
    }
    f->copies = best / fmin(copied, measure_copy(src, &dst, dst.levels, measure_seconds));
    f->memory = (double)m.most / (double)measure_bytes(src, src->levels);
    f->needs = plan_of(src, w, 1e-3);
    find_truth(&t, &dst, src, w, w->levels > 1 ? 2 : w->slices > 1 ? 4 : 6);
    miss(&f->rms, &f->worst, &t);
    envmap_free(&dst);
}

static void table_of_time(void) {
    FILE *out = measure_begin(&document, "time");
    fprintf(out,
            "Copies; rms and worst texel in tolerances; memory over the source's bytes. "
            "Source 6 × %d², tolerance 1e-3, one thread, %s.\n\n| work |",
            EDGE, MEASURE_COMPILER);
    for (int k = 0; k < SCENE_COUNT; ++k) fprintf(out, " %s |", scene_name[k]);
    fprintf(out, " memory |\n|---|--:|--:|--:|--:|\n");
    for (int i = 0; i < COUNT(works); ++i) {
        double memory = 0;
        fprintf(out, "| %s |", works[i].name);
        for (int k = 0; k < SCENE_COUNT; ++k) {
            figure *f = &figures[i][k];
            progress(works[i].name);
            measure_work(f, &skies[k], &works[i]);
            memory = fmax(memory, f->memory);
            fprintf(out, " **%.0f**; %.2g, %.2g |", f->copies, f->rms * 1e3, f->worst * 1e3);
        }
        fprintf(out, " %.1f |\n", memory);
    }
    measure_end(&document, out, 1);
}

/* What the same works need. */
static void table_of_needs(void) {
    FILE *out = measure_begin(&document, "needs");
    fprintf(out, "Bands, and the edge that loses no more than the tolerance between its texels; "
                 "lights that are\nsummed one by one, if any.\n\n| work |");
    for (int k = 0; k < SCENE_COUNT; ++k) fprintf(out, " %s |", scene_name[k]);
    fprintf(out, "\n|---|---|---|---|\n");
    for (int i = 0; i < COUNT(works); ++i) {
        if (works[i].levels > 1) continue;
        fprintf(out, "| %s |", works[i].name);
        for (int k = 0; k < SCENE_COUNT; ++k) {
            const envmap_plan *n = &figures[i][k].needs;
            fprintf(out, " %d, %d", n->bands, n->size);
            if (n->lights) fprintf(out, "; %d lights", n->lights);
            fprintf(out, " |");
        }
        fprintf(out, "\n");
    }
    measure_end(&document, out, 1);
}

/* kappa_l: the rms of a scene's coefficients in band l, over that of one light of all its energy. */
static void table_of_scenes(void) {
    enum { KNOWN = 65 };
    static double sh[3 * KNOWN * KNOWN];
    FILE *out = measure_begin(&document, "scenes");
    fprintf(out, "| scene | κ at l = 1 | 4 | 16 | 64 |\n|---|--:|--:|--:|--:|\n");
    for (int k = 0; k < SCENE_COUNT; ++k) {
        measure_must(envmap_sh_project(sh, KNOWN, &skies[k], 0, 1e-4, NULL), "project");
        fprintf(out, "| %s |", scene_name[k]);
        for (int l = 1; l < KNOWN; l *= 4) {
            double power = 0;
            for (int i = 3 * l * l; i < 3 * (l + 1) * (l + 1); ++i) power += sh[i] * sh[i];
            fprintf(out, " %.2g |", sqrt(power / (2 * l + 1) / measure_dot(sh, sh)));
        }
        fprintf(out, "\n");
    }
    measure_end(&document, out, 1);
}

/* Error against tolerance. */
static const work held[] = {{"diffuse", ENVMAP_LOBE_PHONG, 1, ENVMAP_CUBE, 64, 1, 1},
                            {"Phong 10", ENVMAP_LOBE_PHONG, 10, ENVMAP_CUBE, 64, 1, 1},
                            {"Phong 100", ENVMAP_LOBE_PHONG, 100, ENVMAP_CUBE, 64, 1, 1},
                            {"Gaussian 500", ENVMAP_LOBE_GAUSSIAN, 500, ENVMAP_CUBE, 64, 1, 1},
                            {"GGX 0.25", ENVMAP_LOBE_GGX, 0.25f, ENVMAP_CUBE, 64, 1, 1},
                            {"Banks 0.9", ENVMAP_LOBE_BANKS, 0.9f, ENVMAP_CUBE, 32, 8, 1}};
static const double tolerances[4] = {1e-2, 1e-3, 1e-4, 1e-5};
static double held_rms[SCENE_COUNT][COUNT(held)][4], held_worst[SCENE_COUNT][COUNT(held)][4];

/* At 1e-5 a kink asks for so many bands that it can take minutes. */
static int tolerances_of(const work *w) { return w->slices > 1 ? 3 : 4; }

static void hold(int k, int i, const envmap *src) {
    static truth t;
    const work *w = held + i;
    envmap dst = measure_map(w->mapping, w->size, w->levels, w->slices);
    envmap_filter_desc desc = {0};
    desc.method = ENVMAP_METHOD_FAST;
    run_work(&dst, src, w, &desc);
    find_truth(&t, &dst, src, w, w->slices > 1 ? 3 : 8);
    for (int n = 0; n < tolerances_of(w); ++n) {
        desc.tolerance = (float)tolerances[n];
        run_work(&dst, src, w, &desc);
        miss(&held_rms[k][i][n], &held_worst[k][i][n], &t);
    }
    envmap_free(&dst);
}

static void table_of_tolerances(void) {
    FILE *out = measure_begin(&document, "tolerances");
    fprintf(out, "rms and worst texel, both **in tolerances** (bounds: 1 and 20). Source 6 × "
                 "128².\n\n| scene | lobe | 1e-2 | 1e-3 | 1e-4 | 1e-5 |\n"
                 "|---|---|--:|--:|--:|--:|\n");
    for (int k = 0; k < SCENE_COUNT; ++k) {
        envmap src = measure_map(ENVMAP_CUBE, 128, 1, 1);
        measure_must(envmap_resample(&src, &skies[k], NULL), "resample");
        for (int i = 0; i < COUNT(held); ++i) {
            progress(held[i].name);
            hold(k, i, &src);
            fprintf(out, "| %s | %s |", scene_name[k], held[i].name);
            for (int n = 0; n < tolerances_of(held + i); ++n)
                fprintf(out, " %.2g, %.2g |", held_rms[k][i][n] / tolerances[n],
                        held_worst[k][i][n] / tolerances[n]);
            fprintf(out, tolerances_of(held + i) < 4 ? " |\n" : "\n");
        }
        envmap_free(&src);
    }
    measure_end(&document, out, 1);
}

/* ---------------------------------------------------------------------------------- >>charts -- */

/* Error against tolerance, both logarithmic, a panel a scene. */
static double panel_x(int k, double tolerance) {
    return 80 + 290.0 * k + 75 * (-2 - log10(tolerance));
}

static double panel_y(double error) { return 60 + 50 * -log10(fmax(error, 1e-8)); }

static void draw_panel(FILE *f, int k) {
    double left = panel_x(k, 1e-2), right = panel_x(k, 1e-5);
    fprintf(f, "<text x=\"%.0f\" y=\"48\">%s</text>\n", left, scene_name[k]);
    for (int e = 1; e <= 8; ++e) {
        double y = panel_y(pow(10, -e));
        fprintf(f, "<path d=\"M%.0f %.1fH%.0f\" stroke=\"#e4e4e4\"/>\n", left, y, right);
        if (k) continue;
        fprintf(f, "<text x=\"72\" y=\"%.1f\" text-anchor=\"end\">1e-%d</text>\n", y + 4, e);
    }
    for (int n = 0; n < 4; ++n)
        fprintf(f, "<text x=\"%.0f\" y=\"484\" text-anchor=\"middle\">%.0e</text>\n",
                panel_x(k, tolerances[n]), tolerances[n]);
    for (int bound = 1; bound <= 20; bound += 19)
        fprintf(f, "<path d=\"M%.1f %.1fL%.1f %.1f\" stroke=\"#222\" stroke-width=\"1.5\"%s/>\n",
                left, panel_y(bound * 1e-2), right, panel_y(bound * 1e-5),
                bound > 1 ? " stroke-dasharray=\"7 4\"" : "");
    for (int i = 0; i < COUNT(held); ++i)
        for (int worst = 0; worst < 2; ++worst) {
            fprintf(f, "<path fill=\"none\" stroke=\"%s\" stroke-width=\"2\"%s d=\"",
                    svg_colours[i], worst ? " stroke-dasharray=\"2 4\"" : "");
            for (int n = 0; n < tolerances_of(held + i); ++n)
                fprintf(f, "%c%.1f %.1f", n ? 'L' : 'M', panel_x(k, tolerances[n]),
                        panel_y(worst ? held_worst[k][i][n] : held_rms[k][i][n]));
            fprintf(f, "\"/>\n");
        }
}

static void draw_tolerances(const char *folder) {
    FILE *f = svg_open(folder, "filters-tolerance.svg", 1040, 520,
                       "Error against tolerance: rms (solid), worst texel (dotted)");
    for (int k = 0; k < SCENE_COUNT; ++k) draw_panel(f, k);
    for (int i = 0; i < COUNT(held); ++i)
        svg_text(f, 900, 90 + 22 * i, 13, "start", svg_colours[i], "%s", held[i].name);
    fprintf(f, "<path d=\"M900 250H924\" stroke=\"#222\" stroke-width=\"1.5\"/>"
               "<path d=\"M900 272H924\" stroke=\"#222\" stroke-width=\"1.5\" "
               "stroke-dasharray=\"7 4\"/>\n");
    svg_text(f, 932, 254, 13, "start", "#222", "1 tolerance");
    svg_text(f, 932, 276, 13, "start", "#222", "20 tolerances");
    svg_text(f, 72, 88, 13, "end", "#222", "error");
    fprintf(f, "<text x=\"480\" y=\"508\" text-anchor=\"middle\">tolerance asked for</text>\n");
    svg_close(f);
}

/* |lambda_l| of lobes, and the bands that the sun needs of them at each tolerance. */
enum { BANDS = 768 };

static double band_x(int l) { return 70 + 255 * log10(l < 1 ? 1 : l); }
static double band_y(double lambda) { return 50 + 45 * -log10(fmax(lambda, 1e-9)); }

/* The largest of four, for lobes with a kink change their sign or have zeros between. */
static double band_of(const double *lambda, int l) {
    double most = fabs(lambda[l]);
    for (int i = l; i < l + 4 && i < BANDS; ++i) most = fmax(most, fabs(lambda[i]));
    return most;
}

static void band_curve(FILE *f, int i, const envmap *src) {
    static double lambda[BANDS];
    const work *w = works + i;
    envmap_lobe lobe = lobe_of(w, 0);
    measure_must(envmap_lobe_zonal(lambda, BANDS, &lobe, 0), w->name);
    fprintf(f, "<path fill=\"none\" stroke=\"%s\" stroke-width=\"2\" d=\"", svg_colours[i]);
    char pen = 'M';
    for (int l = 0; l + 4 < BANDS; ++l) {
        double most = band_of(lambda, l);
        fprintf(f, "%c%.1f %.1f", pen, band_x(l), band_y(most)), pen = 'L';
        if (most < 1e-9) break;
    }
    fprintf(f, "\"/>\n<text x=\"820\" y=\"%d\" fill=\"%s\">%s</text>\n", 80 + 22 * i,
            svg_colours[i], w->name);
    for (int n = 0; n < 4; ++n) {
        envmap_plan needs = plan_of(src, w, tolerances[n]);
        if (needs.bands > BANDS - 4) continue; /* beyond the chart */
        double x = band_x(needs.bands), y = band_y(band_of(lambda, needs.bands));
        fprintf(f, "<circle cx=\"%.1f\" cy=\"%.1f\" r=\"4\" fill=\"%s\"/>\n", x, y, svg_colours[i]);
        svg_text(f, x + 5, y - 5, 11, "start", svg_colours[i], "%d", n + 2);
    }
}

static void draw_bands(const char *folder, const envmap *src) {
    FILE *f = svg_open(folder, "filters-bands.svg", 950, 520,
                       "|λ| by band, and how many bands the sun needs at tolerance 1e-2 (2) "
                       "to 1e-5 (5)");
    for (int e = 0; e <= 9; ++e) {
        double y = band_y(pow(10, -e));
        fprintf(f, "<path d=\"M70 %.0fH805\" stroke=\"#e4e4e4\"/>\n", y);
        svg_text(f, 62, y + 4, 13, "end", "#111", e ? "1e-%d" : "1", e);
    }
    for (int l = 1; l <= 512; l *= 2)
        fprintf(f, "<text x=\"%.1f\" y=\"480\" text-anchor=\"middle\">%d</text>\n", band_x(l), l);
    fprintf(f, "<text x=\"430\" y=\"505\" text-anchor=\"middle\">band l, the largest of "
               "l ... l + 3</text>\n");
    for (int i = 0; i < 6; ++i) band_curve(f, i, src); /* neither the chain nor Banks */
    svg_close(f);
}

/* The halves of the fast filter: from the source to harmonics, which envmap_prepare does once for
   many calls, and from there to the result. In copies, under the sun. */
enum { SOURCE, RESULT, HALVES };
static const char *const half_name[HALVES] = {"source to harmonics", "harmonics to result"};

static void time_halves(double spent[HALVES], const envmap *src, envmap *dst, const work *w) {
    envmap_lobe lobes[9];
    envmap_filter_desc desc = {0};
    desc.method = ENVMAP_METHOD_FAST;
    for (int l = 0; l < w->levels; ++l) lobes[l] = lobe_of(w, l);
    for (int run = 0; run < 9; ++run) {
        envmap_prepared prepared = {NULL, NULL};
        double start = measure_seconds(), between;
        desc.prepared = NULL;
        measure_must(envmap_prepare(&prepared, src, lobes, w->levels, &desc), w->name);
        between = measure_seconds(), desc.prepared = &prepared;
        run_work(dst, src, w, &desc);
        spent[RESULT] = fmin(run ? spent[RESULT] : 1e9, measure_seconds() - between);
        spent[SOURCE] = fmin(run ? spent[SOURCE] : 1e9, between - start);
        envmap_prepared_free(&prepared);
    }
}

static void table_of_halves(double spent[][HALVES], const envmap *src) {
    FILE *out = measure_begin(&document, "halves");
    fprintf(out, "| work | %s | %s |\n|---|--:|--:|\n", half_name[SOURCE], half_name[RESULT]);
    for (int i = 0; i < COUNT(works); ++i) {
        const work *w = works + i;
        envmap dst = measure_map(w->mapping, w->size, w->levels, w->slices);
        double copied = measure_copy(src, &dst, dst.levels, measure_seconds);
        progress(w->name);
        time_halves(spent[i], src, &dst, w);
        copied = fmin(copied, measure_copy(src, &dst, dst.levels, measure_seconds));
        for (int h = 0; h < HALVES; ++h) spent[i][h] /= copied;
        fprintf(out, "| %s | %.1f | %.1f |\n", w->name, spent[i][SOURCE], spent[i][RESULT]);
        envmap_free(&dst);
    }
    measure_end(&document, out, 1);
}

static void draw_work(const char *folder, const envmap *src) {
    double most = 0, spent[COUNT(works)][HALVES];
    table_of_halves(spent, src);
    FILE *f = svg_open(folder, "filters-work.svg", 930, 350,
                       "Where the time goes, in copies: the sun, tolerance 1e-3, one thread");
    for (int i = 0; i < COUNT(works); ++i) most = fmax(most, spent[i][SOURCE] + spent[i][RESULT]);
    for (int i = 0; i < COUNT(works); ++i) {
        double x = 210, y = 44 + 32 * i;
        svg_text(f, 202, y + 16, 13, "end", "#000", "%s", works[i].name);
        for (int h = 0; h < HALVES; ++h) {
            double width = 600 * spent[i][h] / most;
            svg_bar(f, x, y, width, 22, svg_colours[h]);
            x += width;
        }
        svg_text(f, x + 8, y + 16, 13, "start", "#000", "%.0f", (x - 210) / 600 * most);
    }
    for (int h = 0; h < HALVES; ++h) {
        svg_bar(f, 210 + 210 * h, 316, 13, 13, svg_colours[h]);
        svg_text(f, 230 + 210 * h, 327, 13, "start", "#000", "%s", half_name[h]);
    }
    svg_close(f);
}

/* --------------------------------------------------------------------------------- >>picture -- */

#define PANORAMA 484
#define FACE     316
#define MARGIN   16
static const unsigned level_colour[8] = {0xFFF3B0u, 0xFFC94Cu, 0xF28E2Bu, 0xD1495Bu,
                                         0x8E3B8Au, 0x54408Fu, 0x34386Bu, 0x262A4Au};

/* What a lobe leaves of the sun's face, and points as close as half a wave of its last band. */
static void draw_points(picture *p, int x, int y, const envmap *src, const work *w,
                        float exposure) {
    envmap_plan needs = plan_of(src, w, 1e-3);
    envmap dst = measure_map(w->mapping, w->size, 1, 1);
    char text[100];
    float u, v;
    int face, side = (needs.bands + 1) / 2; /* a face is a quarter of a circle, and so is L / 2 */
    run_work(&dst, src, w, NULL);
    envmap_coordinates(&face, &u, &v, ENVMAP_CUBE, scene_sun_direction);
    picture_map(p, x, y, FACE, FACE, exposure, &dst, ENVMAP_CUBE, face);
    for (int i = 0; i < side * side; ++i) {
        float cx = (float)x + ((float)(i % side) + 0.5f) * FACE / (float)side;
        float cy = (float)y + ((float)(i / side) + 0.5f) * FACE / (float)side;
        picture_stroke(p, cx, cy, cx, cy, 2.2f, 0x7FE7FFu);
    }
    snprintf(text, sizeof text, "N = %g: %d bands", (double)w->parameter, needs.bands);
    picture_text(p, (float)x, (float)y + FACE + 8, 13, 0xF3F1ECu, text);
    snprintf(text, sizeof text, "%d x %d points, half a wave apart", side, side);
    picture_text(p, (float)x, (float)y + FACE + 28, 11, 0x9AA0ABu, text);
    envmap_free(&dst);
}

/* Which node the hierarchical filter takes each texel of a cube with, for one axis: its level, or
   -1 where the lobe does not reach. The lobe is sampled at nodes of 4 x 4 texels, averaged upward,
   and evaluated at smaller ones where these are opened. A node serves where its four children are
   within THRESHOLD of its own value, and all nodes below it serve too. */
#define THRESHOLD 0.001
enum { SAMPLED = 2 }; /* the level of 4 x 4 texels */

typedef struct opened {
    envmap_lobe lobe;
    const float *axis;
    double reach;                  /* the lobe's, rad */
    int face, edge, nodes, values; /* nodes that were added, lobe values that were taken */
    signed char *level;            /* of each texel */
} opened;

static void paint(opened *o, int level, int x, int y) {
    signed char *image = o->level + (size_t)o->face * (size_t)o->edge * (size_t)o->edge;
    for (int j = 0; j < 1 << level; ++j)
        memset(image + (y + j) * o->edge + x, level, (size_t)1 << level);
    ++o->nodes;
}

/* The cosine from the axis to the centre of a node. */
static double node_cosine(const opened *o, int level, int x, int y) {
    float d[3], half = 0.5f * (float)(1 << level);
    envmap_direction(d, ENVMAP_CUBE, o->face, ((float)x + half) / (float)o->edge,
                     ((float)y + half) / (float)o->edge);
    return (double)d[0] * (double)o->axis[0] + (double)d[1] * (double)o->axis[1] +
           (double)d[2] * (double)o->axis[2];
}

/* The values at a node's children; whether all are within the threshold of k. */
static int children(double values[4], opened *o, int level, int x, int y, double k) {
    int alike = 1, half = 1 << (level - 1);
    for (int i = 0; i < 4; ++i, ++o->values) {
        double c = node_cosine(o, level - 1, x + i % 2 * half, y + i / 2 * half);
        values[i] = envmap_lobe_value(&o->lobe, fmin(c, 1), 0);
        alike &= fabs(values[i] - k) <= THRESHOLD;
    }
    return alike;
}

/* A node below those that are averaged: it serves, or its children do. */
static void open_down(opened *o, int level, int x, int y, double k) {
    double values[4];
    int half = 1 << (level - 1);
    if (children(values, o, level, x, y, k)) {
        paint(o, level, x, y);
        return;
    }
    for (int i = 0; i < 4; ++i) {
        if (level > 1) open_down(o, level - 1, x + i % 2 * half, y + i / 2 * half, values[i]);
        else paint(o, 0, x + i % 2, y + i / 2);
    }
}

/* The mean over a node, which is painted where it serves; *failed counts those that do not. */
static double open_up(opened *o, int level, int x, int y, int *failed) {
    double k[4] = {0, 0, 0, 0}, mean = 0, most = 0, side = 1 << level;
    int half = 1 << (level - 1), before = *failed, nodes = o->nodes;
    double angle = acos(fmin(node_cosine(o, level, x, y), 1));
    if (angle > o->reach + 1.5 * side / o->edge) return 0; /* all of it is beyond the lobe */
    if (level == SAMPLED + 1) children(k, o, level, x, y, 0);
    for (int i = 0; i < 4; ++i) {
        if (level > SAMPLED + 1)
            k[i] = open_up(o, level - 1, x + i % 2 * half, y + i / 2 * half, failed);
        mean += k[i] / 4;
    }
    for (int i = 0; i < 4; ++i) most = fmax(most, fabs(k[i] - mean));
    if (*failed == before && most <= THRESHOLD && half < o->edge / 2) {
        o->nodes = nodes;
        paint(o, level, x, y);
        return mean;
    }
    ++*failed;
    for (int i = 0; level == SAMPLED + 1 && i < 4; ++i)
        open_down(o, SAMPLED, x + i % 2 * half, y + i / 2 * half, k[i]);
    return mean;
}

static opened open_tree(const envmap *src, envmap_lobe lobe, const float axis[3]) {
    size_t texels = 6 * (size_t)src->size * (size_t)src->size;
    opened o = {0};
    double from;
    int count = 0;
    o.lobe = lobe, o.axis = axis, o.edge = src->size;
    envmap_lobe_support(&from, &o.reach, &lobe, 0);
    o.level = (signed char *)malloc(texels);
    if (!o.level) measure_must(ENVMAP_ERROR_MEMORY, "a tree");
    memset(o.level, -1, texels);
    for (o.face = 0; o.face < 6; ++o.face) open_up(&o, envmap_levels(src->size) - 1, 0, 0, &count);
    return o;
}

static void mark(picture *p, int x, int y, const float d[3], float radius, unsigned colour) {
    float u, v;
    int face;
    envmap_coordinates(&face, &u, &v, ENVMAP_LATLONG, d);
    picture_circle(p, (float)x + u * PANORAMA, (float)y + v * PANORAMA / 2, radius, 1.5f, colour);
}

/* The light of a texel of a cube, all channels. */
static double light_of(const envmap *src, int i) {
    int edge = src->size, face = i / edge / edge;
    const float *t = src->texels + 3 * i;
    return envmap_solid_angle(src, 0, face, i % edge, i / edge % edge) *
           ((double)t[0] + (double)t[1] + (double)t[2]);
}

typedef struct lights {
    double all, part; /* of the energy */
    int count, texels;
} lights;

/* Texels that hold more than 1/2000 of all light. */
static lights find_lights(const envmap *src) {
    lights l = {0, 0, 0, 6 * src->size * src->size};
    for (int i = 0; i < l.texels; ++i) l.all += light_of(src, i);
    for (int i = 0; i < l.texels; ++i)
        if (light_of(src, i) > l.all / 2000) ++l.count, l.part += light_of(src, i);
    return l;
}

/* The texels about the sun, with those that are among the lights. */
static void draw_zoom(picture *p, int x, int y, const envmap *src, const lights *l) {
    enum { SIDE = 20, PIXELS = 5 };
    float u, v;
    int face, x0, y0;
    picture_rectangle(p, x - 2, y - 2, SIDE * PIXELS + 4, SIDE * PIXELS + 4, 0xF3F1ECu, 1);
    envmap_coordinates(&face, &u, &v, ENVMAP_CUBE, scene_sun_direction);
    x0 = (int)(u * (float)src->size) - SIDE / 2, y0 = (int)(v * (float)src->size) - SIDE / 2;
    x0 = x0 < 0 ? 0 : x0 > src->size - SIDE ? src->size - SIDE : x0; /* it is near a corner */
    y0 = y0 < 0 ? 0 : y0 > src->size - SIDE ? src->size - SIDE : y0;
    for (int i = 0; i < SIDE * SIDE; ++i) {
        const float *texel = envmap_texel(src, 0, 0, face, x0 + i % SIDE, y0 + i / SIDE);
        float light[3] = {0, 0, 0};
        for (int c = 0; c < 3; ++c) light[c] = picture_curve(0.1f * texel[c]);
        int left = x + i % SIDE * PIXELS, top = y + i / SIDE * PIXELS;
        picture_rectangle(p, left, top, PIXELS, PIXELS, picture_colour(light), 1);
        if (light_of(src, (int)(texel - src->texels) / 3) > l->all / 2000)
            picture_rectangle(p, left + 1, top + 1, PIXELS - 2, PIXELS - 2, 0x1B7FA6u, 1);
    }
}

/* The scene, with the lights that are taken out for the diffuse lobe. */
static void draw_lights(picture *p, int x, int y, const envmap *src, float exposure) {
    char text[100];
    lights l = find_lights(src);
    picture_panorama(p, x, y, PANORAMA, PANORAMA / 2, exposure, src);
    mark(p, x, y, scene_sun_direction, 7, 0xF3F1ECu);
    draw_zoom(p, x + PANORAMA - 112, y + PANORAMA / 2 - 112, src, &l);
    picture_text(p, (float)x, (float)y + PANORAMA / 2 + 8, 13, 0xF3F1ECu,
                 "the scene; enlarged: what diffuse sums exactly");
    snprintf(text, sizeof text, "%d texels of %d, %.0f %% of the light", l.count, l.texels,
             100 * l.part / l.all);
    picture_text(p, (float)x, (float)y + PANORAMA / 2 + 28, 11, 0x9AA0ABu, text);
}

/* What the hierarchical filter opens for an axis whose lobe has the sun on its flank. */
static void draw_opened(picture *p, int x, int y, const envmap *src) {
    static const float axis[3] = {-0.5f, 0.42f, 0.757f};
    opened o = open_tree(src, envmap_lobe_phong(100), axis);
    char text[100];
    for (int j = 0; j < PANORAMA / 2; ++j)
        for (int i = 0; i < PANORAMA; ++i) {
            float d[3], u, v;
            int face, level;
            envmap_direction(d, ENVMAP_LATLONG, 0, ((float)i + 0.5f) / PANORAMA,
                             ((float)j + 0.5f) / (PANORAMA / 2));
            envmap_coordinates(&face, &u, &v, ENVMAP_CUBE, d);
            level = o.level[(face * o.edge + (int)fminf(v * (float)o.edge, (float)o.edge - 1)) *
                                o.edge +
                            (int)fminf(u * (float)o.edge, (float)o.edge - 1)];
            picture_blend(p, x + i, y + j, level < 0 ? 0x30343Cu : level_colour[level & 7], 1);
        }
    mark(p, x, y, scene_sun_direction, 5, 0xFFFFFFu);
    for (int i = 0; i < 7; ++i) {
        float left = (float)x + 8 + 52 * (float)i;
        snprintf(text, sizeof text, i < 6 ? "%d" : "%d +", 1 << i);
        picture_rectangle(p, (int)left, y + PANORAMA / 2 - 20, 12, 12, level_colour[i], 1);
        picture_text(p, left + 17, (float)y + PANORAMA / 2 - 20, 11, 0xF3F1ECu, text);
    }
    picture_text(p, (float)x, (float)y + PANORAMA / 2 + 8, 13, 0xF3F1ECu,
                 "hierarchical, N = 100, one axis: texels a side of a node");
    snprintf(text, sizeof text, "%d nodes from %d values of the lobe; the ring is the sun", o.nodes,
             o.values);
    picture_text(p, (float)x, (float)y + PANORAMA / 2 + 28, 11, 0x9AA0ABu, text);
    free(o.level);
}

static void draw_picture(const char *folder, const envmap *src) {
    char path[5000];
    picture p;
    int below = MARGIN + PANORAMA / 2 + 62;
    float exposure = 0.52f;
    if (!picture_create(&p, 3 * MARGIN + 2 * PANORAMA, below + FACE + 50))
        measure_must(ENVMAP_ERROR_MEMORY, "a picture");
    picture_rectangle(&p, 0, 0, p.width, p.height, 0x15171Cu, 1);
    draw_lights(&p, MARGIN, MARGIN, src, exposure);
    draw_opened(&p, 2 * MARGIN + PANORAMA, MARGIN, src);
    for (int i = 0; i < 3; ++i)
        draw_points(&p, MARGIN + i * (FACE + (2 * PANORAMA + MARGIN - 3 * FACE) / 2), below, src,
                    works + i, exposure);
    snprintf(path, sizeof path, "%s/images/filters-sun.png", folder);
    if (!picture_save(&p, path)) measure_must(ENVMAP_ERROR_FILE, path);
    picture_free(&p);
}

/* ------------------------------------------------------------------------------------ >>main -- */

int main(int argc, char **argv) {
    for (int k = 0; k < SCENE_COUNT; ++k) {
        skies[k] = measure_map(ENVMAP_CUBE, EDGE, 1, 1);
        scene_fill(&skies[k], k);
        progress(scene_name[k]);
    }
    if (argc > 1) draw_picture(argv[1], &skies[SCENE_SUN]);
    table_of_time();
    table_of_needs();
    table_of_scenes();
    table_of_tolerances();
    if (argc > 1) {
        char path[5000];
        draw_tolerances(argv[1]);
        draw_bands(argv[1], &skies[SCENE_SUN]);
        draw_work(argv[1], &skies[SCENE_SUN]);
        snprintf(path, sizeof path, "%s/filters.md", argv[1]);
        measure_write(&document, path, "make filters");
    }
    for (int k = 0; k < SCENE_COUNT; ++k) envmap_free(&skies[k]);
    measure_document_free(&document);
    return 0;
}
