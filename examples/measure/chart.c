/* chart.c - speed against accuracy: every method, swept over its own knob, on every scene and lobe.

   What you will see: progress on stderr, then tables. `chart DIR` writes the charts and
   accuracy-speed.csv to DIR/charts, and the tables between the marks of DIR/accuracy-speed.md;
   `chart DIR MAP.pfm ...` charts lat-long maps of yours instead (no document, and not what belongs
   to the machine alone: sizes, threads, the papers' tables).
       cc -O3 -march=native -std=c99 -I. examples/measure/chart.c -o chart -lm -lpthread

   The work: a cube of 128 x 128 (256 x 256 for Phong N = 2000, which 128 would leave thinner than
   two texels) becomes one of 36 x 36, for Banks 8 slices of 12 x 12. The truth is the definition,
   ENVMAP_METHOD_REFERENCE, for every third texel along both sides (those have the same centres, as
   36 = 3 * 12), itself held against plain sums first. Errors are envmap_compare's. Times are the
   best of several runs, on one thread the process's own time; *copies* are those times over a
   memcpy of source and result in the same run.

   >>works    lobes, methods and their settings
   >>trials   one setting run, timed and compared
   >>scenes   sources and truths
   >>sweep    all that goes into the CSV
   >>panels   error against time
   >>tables   which method when
   >>growth   cost against size
   >>papers   Tables 1 and 2 of Kautz et al. 2000
   >>threads  one and two
   >>main

   SPDX-License-Identifier: MIT */

#define _POSIX_C_SOURCE 200809L
#include "measure.h"

#include "../methods/box_levels.h"
#include "../methods/importance_sampling.h"
#include "../methods/paraboloid_convolution.h"
#include "../methods/separable_gaussian.h"
#include "../methods/summed_area.h"
#include "../tool/scenes.h"
#include "svg.h"
#include "table1.h"
#include "../tool/threads.h"

/* ----------------------------------------------------------------------------------- >>works -- */

enum { TRUTH = 12, RATIO = 3 }; /* edge of the truth, and of the result over it */

typedef struct work {
    const char *family, *name; /* as the CSV has it, and as people read it */
    int kind;
    float parameter; /* of the lobe; GGX: alpha = roughness^2 */
    int source, truth, slices;
} work;

static const work works[] = {
    {"diffuse", "diffuse", ENVMAP_LOBE_PHONG, 1, 128, TRUTH, 1},
    {"phong", "Phong N = 10", ENVMAP_LOBE_PHONG, 10, 128, TRUTH, 1},
    {"phong", "Phong N = 50", ENVMAP_LOBE_PHONG, 50, 128, TRUTH, 1},
    {"phong", "Phong N = 100", ENVMAP_LOBE_PHONG, 100, 128, TRUTH, 1},
    {"phong", "Phong N = 250", ENVMAP_LOBE_PHONG, 250, 128, TRUTH, 1},
    {"phong", "Phong N = 500", ENVMAP_LOBE_PHONG, 500, 128, TRUTH, 1},
    {"phong", "Phong N = 2000", ENVMAP_LOBE_PHONG, 2000, 256, TRUTH, 1},
    {"ggx", "GGX roughness 0.3", ENVMAP_LOBE_GGX, 0.09f, 128, TRUTH, 1},
    {"ggx", "GGX roughness 0.5", ENVMAP_LOBE_GGX, 0.25f, 128, TRUTH, 1},
    {"banks", "Banks s = 0.9", ENVMAP_LOBE_BANKS, 0.9f, 128, TRUTH / 3, 8},
    {"banks", "Banks s = 0.99", ENVMAP_LOBE_BANKS, 0.99f, 128, TRUTH / 3, 8},
};
enum { WORKS = COUNT(works), DIFFUSE = 0, PHONG_100 = 3, GGX_05 = 8, BANKS_09 = 9 };

static envmap_lobe lobe_of(const work *w) {
    if (w->kind == ENVMAP_LOBE_BANKS) return envmap_lobe_banks(w->parameter);
    if (w->kind == ENVMAP_LOBE_GGX) return envmap_lobe_ggx(w->parameter);
    return envmap_lobe_phong(w->parameter);
}

enum {
    FAST,
    HARMONICS,
    HIERARCHICAL,
    REFERENCE,
    COEFFICIENTS,
    BOX,
    SAMPLING,
    GAUSSIAN,
    PARABOLOID,
    AREAS,
    METHODS
};

static const struct {
    const char *csv, *name, *colour;
    int method;        /* of the header */
    method_call *call; /* of examples/methods */
} methods[METHODS] = {
    {"fast", "FAST", "#d01c2a", ENVMAP_METHOD_FAST, NULL},
    {"harmonics", "HARMONICS", "#e98a2b", ENVMAP_METHOD_HARMONICS, NULL},
    {"hierarchical", "HIERARCHICAL", "#3b6ea8", ENVMAP_METHOD_HIERARCHICAL, NULL},
    {"reference", "REFERENCE", "#111111", ENVMAP_METHOD_REFERENCE, NULL},
    {"coefficients", "SH coefficients", "#7a5aa6", 0, NULL},
    {"box-levels", "box levels", "#4d8f4d", 0, method_box_levels},
    {"importance-sampling", "importance sampling", "#1f8f8f", 0, method_importance_sampling},
    {"separable-gaussian", "separable Gaussian", "#c2559d", 0, method_separable_gaussian},
    {"paraboloid-convolution", "paraboloid convolution", "#8a6d3b", 0,
     method_paraboloid_convolution},
    {"summed-areas", "summed areas", "#777777", 0, method_summed_area},
};

/* A method's setting. knob: tolerance, threshold, bands, or the box levels' bias. */
typedef struct trial {
    int method, chained; /* chained: 0 where the line of the method does not go to it */
    const char *text;
    double knob;
    method_desc desc;
} trial;

static const trial trials[] = {
    {FAST, 1, "tolerance=0.1", 0.1, {0}},
    {FAST, 1, "tolerance=0.03", 0.03, {0}},
    {FAST, 1, "tolerance=0.01", 0.01, {0}},
    {FAST, 1, "tolerance=0.003", 0.003, {0}},
    {FAST, 1, "tolerance=0.001", 0.001, {0}},
    {FAST, 1, "tolerance=0.0003", 0.0003, {0}},
    {FAST, 1, "tolerance=0.0001", 0.0001, {0}},
    {FAST, 1, "tolerance=0.00001", 0.00001, {0}},
    {HARMONICS, 1, "tolerance=0.01", 0.01, {0}},
    {HARMONICS, 1, "tolerance=0.001", 0.001, {0}},
    {HARMONICS, 1, "tolerance=0.0001", 0.0001, {0}},
    {HIERARCHICAL, 1, "threshold=0.1", 0.1, {0}},
    {HIERARCHICAL, 1, "threshold=0.01", 0.01, {0}},
    {HIERARCHICAL, 1, "threshold=0.003", 0.003, {0}},
    {HIERARCHICAL, 1, "threshold=0.001", 0.001, {0}},
    {COEFFICIENTS, 1, "bands=2", 2, {0}},
    {COEFFICIENTS, 1, "bands=3", 3, {0}},
    {COEFFICIENTS, 1, "bands=5", 5, {0}},
    {COEFFICIENTS, 1, "bands=9", 9, {0}},
    {COEFFICIENTS, 1, "bands=17", 17, {0}},
    {COEFFICIENTS, 1, "bands=33", 33, {0}},
    {BOX, 1, "bias=-1", -1, {0}},
    {BOX, 1, "bias=-0.5", -0.5, {0}},
    {BOX, 1, "bias=0", 0, {0}},
    {BOX, 1, "bias=0.5", 0.5, {0}},
    {BOX, 1, "bias=1", 1, {0}},
    {BOX, 0, "published", 0, {.form = METHOD_PUBLISHED}},
    {SAMPLING, 1, "samples=4", 0, {.samples = 4}},
    {SAMPLING, 1, "samples=16", 0, {.samples = 16}},
    {SAMPLING, 1, "samples=64", 0, {.samples = 64}},
    {SAMPLING, 1, "samples=256", 0, {.samples = 256}},
    {SAMPLING, 0, "published samples=16", 0, {.form = METHOD_PUBLISHED, .samples = 16}},
    {GAUSSIAN, 1, "kernel=2", 0, {.kernel = 2}},
    {GAUSSIAN, 1, "kernel=4", 0, {.kernel = 4}},
    {GAUSSIAN, 1, "kernel=8", 0, {.kernel = 8}},
    {GAUSSIAN, 0, "published kernel=4", 0, {.form = METHOD_PUBLISHED, .kernel = 4}},
    {PARABOLOID, 1, "limit=7 cut=0.1", 0, {.cut = 0.1f, .limit = 7}},
    {PARABOLOID, 1, "limit=15 cut=0.03", 0, {.cut = 0.03f, .limit = 15}},
    {PARABOLOID, 1, "limit=31 cut=0.01", 0, {.cut = 0.01f, .limit = 31}},
    {PARABOLOID, 0, "published limit=7 cut=0.1", 0, {.form = METHOD_PUBLISHED}},
    {AREAS, 1, "discs=2 strips=5", 0, {.discs = 2, .strips = 5}},
    {AREAS, 1, "discs=8 strips=9", 0, {.discs = 8, .strips = 9}},
    {AREAS, 1, "discs=16 strips=17", 0, {.discs = 16, .strips = 17}},
    {AREAS, 0, "published", 0, {.form = METHOD_PUBLISHED}},
    {REFERENCE, 1, "every-texel", 0, {0}},
};
enum { TRIALS = COUNT(trials) };

static const trial *trial_named(int method, const char *text) {
    const trial *t = trials;
    while (t->method != method || strcmp(t->text, text)) ++t;
    return t;
}

/* ---------------------------------------------------------------------------------- >>trials -- */

#define PATIENCE 0.8 /* seconds; where a run takes longer, finer settings are not tried */
static double patience = 3 * PATIENCE; /* where a run is given up */
static threads_pool crew; /* of two */

static int out_of_patience(void *user, float fraction) {
    (void)fraction;
    return measure_seconds() - *(const double *)user > patience;
}

static envmap_result run_coefficients(envmap *dst, const envmap *src, const envmap_lobe *lobe,
                                      int bands) {
    static double sh[33 * 33 * 3], out[33 * 33 * 3];
    envmap_result result = envmap_sh_project(sh, bands, src, 0, 1e-5, NULL);
    for (int k = 0; k < dst->slices && !result; ++k) {
        double p = (double)lobe->p0 + (double)(lobe->p1 - lobe->p0) * (k + 0.5) / dst->slices;
        result = envmap_sh_convolve(out, sh, bands, lobe, p);
        if (!result) result = envmap_sh_fill(dst, 0, k, out, bands, 0, NULL);
    }
    return result;
}

static envmap_result run_trial(envmap *dst, const envmap *src, const envmap_lobe *lobe,
                               const trial *t, int threads) {
    if (t->method <= REFERENCE) {
        envmap_filter_desc desc = {0};
        double start = measure_seconds();
        desc.method = methods[t->method].method;
        desc.tolerance = (float)t->knob, desc.threshold = (float)t->knob;
        if (t->method != REFERENCE)
            desc.work.progress.user = &start, desc.work.progress.report = out_of_patience;
        if (threads > 1) desc.work.executor.user = &crew, desc.work.executor.run = threads_run;
        return envmap_filter(dst, src, lobe, &desc);
    }
    if (t->method == COEFFICIENTS) return run_coefficients(dst, src, lobe, (int)t->knob);
    method_desc desc = t->desc;
    if (t->method == BOX && !desc.form) {
        double level = method_box_level(lobe, method_size_for(src, ENVMAP_CUBE));
        if (level >= 0) desc.level = (float)fmax(level + t->knob, 0.01);
    }
    return methods[t->method].call(dst, src, lobe, &desc);
}

/* The best of at least one run, at most nine, about a twentieth of a second; in seconds. */
static double time_trial(envmap *dst, const envmap *src, const envmap_lobe *lobe, const trial *t,
                         envmap_result *result) {
    double best = 1e30, spent = 0;
    for (int i = 0; i < 9 && (i < 1 || spent < 0.05); ++i) {
        double start = measure_seconds();
        *result = run_trial(dst, src, lobe, t, 1);
        start = measure_seconds() - start, spent += start, best = fmin(best, start);
        if (*result) break;
    }
    return best;
}

/* 1 when a constant stays itself, to the method's own tolerance, or the lobe is refused. (Banks'
   lobes do not keep a constant; those are held against the truth alone.) */
static int constant_stays(const work *w, const trial *t) {
    if (w->slices > 1) return 1;
    /* Plain sums of harmonics are right to second order in the texel. */
    envmap src = measure_map(ENVMAP_CUBE, t->method == COEFFICIENTS ? 128 : 32, 1, 1);
    envmap dst = measure_map(ENVMAP_CUBE, 6, 1, 1);
    envmap_lobe lobe = lobe_of(w);
    measure_flat(&src, 2);
    envmap_result result = run_trial(&dst, &src, &lobe, t, 1);
    int ok = result ? result == ENVMAP_ERROR_METHOD : measure_is_flat(&dst, 2, 2e-3f);
    if (!ok)
        fprintf(stderr, "\n%s, %s %s: a constant does not stay itself: %s\n", w->name,
                methods[t->method].name, t->text, envmap_result_text(result));
    envmap_free(&src);
    envmap_free(&dst);
    return ok;
}

/* ---------------------------------------------------------------------------------- >>scenes -- */

enum { SCENES_MOST = 8, BIG = 256 };
static char scene_names[SCENES_MOST][32];
static envmap skies[SCENES_MOST]; /* cubes of BIG */
static int scenes, own_maps;

typedef struct point {
    int scene, work, trial; /* trial -1: one of the other sizes */
    double ms, copies, rms, worst;
} point;

static point points[SCENES_MOST * WORKS * TRIALS];
static int point_count, failed;
static FILE *csv;

static void progress(const char *scene, const char *what, const char *more) {
    static double start;
    if (!(start > 0)) start = measure_now();
    fprintf(stderr, "\r%5.1f s  %-10s %-20s %-40s", measure_now() - start, scene, what, more);
}

static envmap make_source(int scene, int mapping, int size) {
    envmap src = measure_map(mapping, size, 1, 1);
    measure_must(envmap_resample(&src, skies + scene, NULL), "a source");
    return src;
}

/* Texels of dst whose centres are those of truth: dst's edge is an odd multiple. */
static envmap_difference compare(const envmap *dst, const envmap *truth) {
    envmap small = measure_map(truth->mapping, truth->size, 1, truth->slices);
    int ratio = dst->size / truth->size, half = ratio / 2;
    for (int k = 0; k < truth->slices; ++k)
        for (int f = 0; f < envmap_faces(truth->mapping); ++f)
            for (int y = 0; y < truth->size; ++y)
                for (int x = 0; x < measure_width(truth, 0); ++x)
                    memcpy(envmap_texel(&small, 0, k, f, x, y),
                           envmap_texel(dst, 0, k, f, ratio * x + half, ratio * y + half),
                           3 * sizeof(float));
    envmap_difference d;
    measure_must(envmap_compare(&d, &small, truth, 0), "a comparison");
    envmap_free(&small);
    return d;
}

/* ----------------------------------------------------------------------------------- >>sweep -- */

static const char *const mapping_name[] = {"cube",    "paraboloid", "sphere",
                                           "latlong", "angular",    "octahedral"};

static void write_row(int scene, const work *w, const envmap *src, const envmap *dst,
                      const trial *t, const char *more, int threads, const point *p) {
    if (!csv) return;
    fprintf(csv, "%s,%s,%g,%s,%d,%s,%s result=%d", scene_names[scene], w->family,
            (double)w->parameter, mapping_name[src->mapping], src->size, methods[t->method].csv,
            t->text, dst->size);
    if (dst->slices > 1) fprintf(csv, " slices=%d", dst->slices);
    fprintf(csv, "%s,%d,%.5g,%.4g,%.4g,%.4g\n", more, threads, p->ms, p->copies, p->rms, p->worst);
}

/* A truth, how long it took, what it is to be multiplied by for a result of another size. */
typedef struct exact {
    envmap src, truth;
    double seconds;
} exact;

static void make_exact(exact *e, int scene, const work *w, int mapping, int source, int truth) {
    envmap_lobe lobe = lobe_of(w);
    const trial *t = trial_named(REFERENCE, "every-texel");
    e->src = make_source(scene, mapping, source);
    e->truth = measure_map(mapping, truth, 1, w->slices);
    e->seconds = measure_seconds();
    measure_must(run_trial(&e->truth, &e->src, &lobe, t, 1), "a truth");
    e->seconds = measure_seconds() - e->seconds;
    if (!measure_truth_holds(&e->truth, &e->src, &lobe, w->name)) failed = 1;
}

static void free_exact(exact *e) {
    envmap_free(&e->src);
    envmap_free(&e->truth);
}

/* One setting into a result of `ratio` times the truth's edge: a row of the CSV, and p. Returns the
   seconds, 0 where the method refuses, GAVE_UP where it takes too long. */
#define GAVE_UP 1e9
static double measure_trial(point *p, int scene, const work *w, const exact *e, const trial *t,
                            int ratio) {
    envmap dst = measure_map(e->truth.mapping, ratio * e->truth.size, 1, w->slices);
    envmap_lobe lobe = lobe_of(w);
    envmap_result result = ENVMAP_OK;
    double seconds = e->seconds * ratio * ratio; /* of the reference: texels are alike */
    double copy = measure_copy(&e->src, &dst, 1, measure_seconds);
    p->rms = p->worst = 0;
    if (t->method != REFERENCE) seconds = time_trial(&dst, &e->src, &lobe, t, &result);
    if (!result && t->method != REFERENCE) {
        envmap_difference d = compare(&dst, &e->truth);
        p->rms = d.rms, p->worst = d.worst;
    }
    copy = fmin(copy, measure_copy(&e->src, &dst, 1, measure_seconds));
    p->ms = 1e3 * seconds, p->copies = seconds / copy;
    if (!result)
        write_row(scene, w, &e->src, &dst, t,
                  t->method == REFERENCE && ratio > 1 ? " timed-part=1/9" : "", 1, p);
    else if (result != ENVMAP_ERROR_METHOD && result != ENVMAP_CANCELLED)
        measure_must(result, methods[t->method].name);
    envmap_free(&dst);
    return result ? result == ENVMAP_CANCELLED ? GAVE_UP : 0 : seconds;
}

/* Every setting of every method. */
static void sweep(int scene, int work_index, const exact *e) {
    const work *w = works + work_index;
    int tired[METHODS] = {0};
    for (int i = 0; i < TRIALS; ++i) {
        const trial *t = trials + i;
        point *p = points + point_count;
        if (tired[t->method]) continue;
        progress(scene_names[scene], w->name, methods[t->method].name);
        if (scene == 0 && t->method != REFERENCE && !constant_stays(w, t)) {
            failed = 1;
            continue;
        }
        double seconds = measure_trial(p, scene, w, e, t, RATIO);
        tired[t->method] = t->method != SAMPLING && seconds > PATIENCE;
        if (!(seconds > 0) || seconds >= GAVE_UP) continue;
        p->scene = scene, p->work = work_index, p->trial = i, ++point_count;
    }
}

static const char *const three[] = {"tolerance=0.01", "tolerance=0.001", "tolerance=0.0001"};

/* FAST into results of other sizes, and from other sources: what models of its cost stand on. */
static void other_results(int scene, const work *w, const exact *e) {
    static const int ratios[] = {1, 9, 27};
    point p;
    progress(scene_names[scene], w->name, "other sizes of the result");
    for (int r = 0; r < COUNT(ratios); ++r)
        for (int i = 0; i < COUNT(three); ++i)
            if (measure_trial(&p, scene, w, e, trial_named(FAST, three[i]), ratios[r]) > PATIENCE)
                return;
}

static void other_sources(int scene, const work *w) {
    static const int sizes[] = {64, 256};
    point p;
    for (int s = 0; s < COUNT(sizes); ++s) {
        envmap_lobe lobe = lobe_of(w);
        exact e;
        int wide = envmap_lobe_sigma(&lobe, 0) > 0.11, thin = w->parameter > 400;
        if (sizes[s] == w->source || (sizes[s] > 128 ? wide : thin)) continue;
        progress(scene_names[scene], w->name, "other sizes of the source");
        make_exact(&e, scene, w, ENVMAP_CUBE, sizes[s], w->truth);
        for (int i = 0; i < COUNT(three); ++i)
            measure_trial(&p, scene, w, &e, trial_named(FAST, three[i]), RATIO);
        free_exact(&e);
    }
}

/* The other parameterizations, with about as many texels: Phong N = 100. */
static void other_mappings(int scene) {
    static const int sizes[][3] = {{ENVMAP_PARABOLOID, 222, 21},
                                   {ENVMAP_LATLONG, 222, 21},
                                   {ENVMAP_SPHERE, 314, 29},
                                   {ENVMAP_ANGULAR, 314, 29},
                                   {ENVMAP_OCTAHEDRAL, 314, 29}};
    static const int methods_of[] = {FAST, FAST, FAST, HIERARCHICAL, BOX, REFERENCE};
    static const char *const settings[] = {"tolerance=0.01", "tolerance=0.001", "tolerance=0.0001",
                                           "threshold=0.01", "bias=0",          "every-texel"};
    const work *w = works + PHONG_100;
    for (int m = 0; m < COUNT(sizes); ++m) {
        exact e;
        point p;
        progress(scene_names[scene], w->name, mapping_name[sizes[m][0]]);
        make_exact(&e, scene, w, sizes[m][0], sizes[m][1], sizes[m][2]);
        for (int i = 0; i < COUNT(settings); ++i)
            measure_trial(&p, scene, w, &e, trial_named(methods_of[i], settings[i]), RATIO);
        free_exact(&e);
    }
}

static void sweep_all(void) {
    for (int s = 0; s < scenes && !failed; ++s) {
        for (int i = 0; i < WORKS && !failed; ++i) {
            exact e;
            progress(scene_names[s], works[i].name, "the truth");
            make_exact(&e, s, works + i, ENVMAP_CUBE, works[i].source, works[i].truth);
            if (!failed) sweep(s, i, &e);
            if (!failed) other_results(s, works + i, &e);
            free_exact(&e);
            if (works[i].slices == 1 && !failed) other_sources(s, works + i);
        }
        if (!failed && s == 0) other_mappings(s);
    }
}

/* ---------------------------------------------------------------------------------- >>panels -- */

/* A display of 8 bits: sRGB's f(x) = 1.055 x^(1/2.4) - 0.055 moves by x f'(x) e for a relative
   error e. That is largest in white, x = 1: half a code is 1 / (2 * 255 * f'(1)). */
static double eight_bits(void) { return 0.5 / 255 / (1.055 / 2.4); }

/* A setting of a method, on one scene or (geometric means) over all. */
typedef struct spot {
    double copies, ms, rms, most, worst; /* most: the largest rms of the scenes */
    int trial, front;
} spot;

/* The spots of a work; scene -1: those that every scene has. Returns how many. */
static int collect(spot spots[TRIALS], int work_index, int scene) {
    int count = 0;
    for (int t = 0; t < TRIALS; ++t) {
        spot s = {0, 0, 0, 0, 0, t, 0};
        int found = 0;
        for (const point *p = points; p < points + point_count; ++p) {
            if (p->work != work_index || p->trial != t) continue;
            if (scene >= 0 && p->scene != scene) continue;
            s.copies += log(p->copies), s.ms += log(p->ms), s.rms += log(fmax(p->rms, 1e-9));
            s.most = fmax(s.most, p->rms), s.worst = fmax(s.worst, p->worst), ++found;
        }
        if (found < (scene < 0 ? scenes : 1)) continue;
        s.copies = exp(s.copies / found), s.ms = exp(s.ms / found), s.rms = exp(s.rms / found);
        spots[count++] = s;
    }
    for (int i = 0; i < count; ++i) {
        spots[i].front = 1;
        for (int k = 0; k < count; ++k)
            if (spots[k].copies < spots[i].copies && spots[k].rms <= spots[i].rms)
                spots[i].front = 0;
    }
    return count;
}

static int by_cost(const void *a, const void *b) {
    const spot *x = (const spot *)a, *y = (const spot *)b;
    return x->copies < y->copies ? -1 : x->copies > y->copies;
}

/* The staircase under which no setting stands. */
static void draw_front(FILE *f, const svg_axes *a, const spot *spots, int count) {
    double x[2 * TRIALS + 2], y[2 * TRIALS + 2];
    spot sorted[TRIALS];
    int n = 0;
    memcpy(sorted, spots, (size_t)count * sizeof *spots);
    qsort(sorted, (size_t)count, sizeof *sorted, by_cost);
    for (int i = 0; i < count; ++i) {
        if (!sorted[i].front) continue;
        if (!n) x[n] = sorted[i].copies, y[n++] = a->y1;
        else x[n] = sorted[i].copies, y[n] = y[n - 1], ++n;
        x[n] = sorted[i].copies, y[n++] = sorted[i].rms;
    }
    if (n) x[n] = a->x1, y[n] = y[n - 1], ++n;
    svg_line(f, a, x, y, n, "#f3c64f", 7, "stroke-opacity=\"0.55\" stroke-linejoin=\"round\"");
}

static int drawn[METHODS]; /* in this picture, for its legend */

static void draw_method(FILE *f, const svg_axes *a, const spot *spots, int count, int method) {
    double x[TRIALS], y[TRIALS];
    int n = 0;
    const char *colour = methods[method].colour;
    for (int i = 0; i < count; ++i) {
        const trial *t = trials + spots[i].trial;
        if (t->method == method && t->chained) x[n] = spots[i].copies, y[n++] = spots[i].rms;
    }
    svg_line(f, a, x, y, n, colour, method == FAST ? 2.6 : 1.6,
             method == HARMONICS ? "stroke-dasharray=\"3 3\"" : "");
    for (int i = 0; i < count; ++i) {
        const trial *t = trials + spots[i].trial;
        if (t->method != method) continue;
        drawn[method] = 1;
        svg_dot(f, a, spots[i].copies, spots[i].rms, spots[i].front ? 4 : 2.6,
                t->chained ? colour : "#fff", spots[i].front ? "#111" : colour);
    }
}

static svg_axes panel_axes(double left, double top, double width, double height) {
    svg_axes a = {0, 0, 0, 0, 0.5, 1e6, 1e-8, 10, 1, 1};
    a.left = left, a.top = top, a.right = left + width, a.bottom = top + height;
    return a;
}

/* Axes, the floor of one copy and the level of 8 bits, then the methods. */
static void draw_panel(FILE *f, const svg_axes *a, const char *title, const spot *spots,
                       int count) {
    static const char *const powers[] = {"1", "10", "100", "1e3", "1e4", "1e5", "1e6"};
    for (int i = 0; i < 7; ++i) { /* below the dots that stand on the lower edge */
        svg_tick_x(f, a, pow(10, i), NULL);
        svg_text(f, svg_x(a, pow(10, i)), a->bottom + 19, 11, "middle", "#444", "%s", powers[i]);
    }
    for (int e = -8; e <= 0; e += 2) {
        char label[16];
        snprintf(label, sizeof label, e ? "1e%d" : "1", e);
        svg_tick_y(f, a, pow(10, e), label);
    }
    draw_front(f, a, spots, count);
    svg_frame(f, a);
    fprintf(f, "<path d=\"M%.1f %.1fV%.1f\" stroke=\"#111\" stroke-width=\"1.5\"/>\n", svg_x(a, 1),
            a->top, a->bottom);
    fprintf(f,
            "<path d=\"M%.1f %.1fH%.1f\" stroke=\"#111\" stroke-width=\"1\" "
            "stroke-dasharray=\"6 4\"/>\n",
            a->left, svg_y(a, eight_bits()), a->right);
    svg_text(f, svg_x(a, 1) + 4, a->bottom - 5, 10, "start", "#111", "1 copy");
    svg_text(f, svg_x(a, 1) + 4, svg_y(a, eight_bits()) + 12, 10, "start", "#111", "8 bits");
    for (int m = METHODS - 1; m >= 0; --m) draw_method(f, a, spots, count, m);
    svg_text(f, a->left, a->top - 7, 13, "start", "#111", "%s", title);
    svg_text(f, a->left - 6, a->top + 10, 11, "end", "#444", "rms error");
    svg_text(f, (a->left + a->right) / 2, a->bottom + 31, 11, "middle", "#444", "time, copies");
}

/* Names the methods that this picture has drawn, and forgets them. */
static void draw_legend(FILE *f, double x, double y, int columns, double step) {
    int named = 0;
    for (int m = 0; m < METHODS; ++m) {
        if (!drawn[m]) continue;
        double left = x + step * (named % columns), line = y + 20 * (named / columns);
        svg_bar(f, left, line - 9, 14, 10, methods[m].colour);
        svg_text(f, left + 20, line, 12, "start", "#111", "%s%s", methods[m].name,
                 m == HARMONICS ? ", below FAST" : "");
        drawn[m] = 0, ++named;
    }
    double line = y + 20 * ((named + columns - 1) / columns);
    fprintf(f,
            "<path d=\"M%.1f %.1fh14\" stroke=\"#f3c64f\" stroke-width=\"7\" "
            "stroke-opacity=\"0.55\"/>\n",
            x, line - 4);
    svg_text(f, x + 20, line, 12, "start", "#111",
             "the Pareto front: no setting is both quicker and more exact; what stands on it is "
             "ringed. Open dots: as published.");
    svg_text(f, x, line + 20, 12, "start", "#444",
             "A copy: memcpy of source and result. Above the dashed line 8 bits show the error. On "
             "the lower edge: the reference, which is the truth.");
}

enum { WIDE = 300, HIGH = 220, GAP_X = 68, GAP_Y = 62 };

/* A column a scene, a row a lobe. */
static void draw_family(const char *folder, const char *family, const char *title) {
    spot spots[TRIALS];
    char name[64], text[320];
    int rows = 0, row = 0;
    for (int i = 0; i < WORKS; ++i) rows += !strcmp(works[i].family, family);
    snprintf(name, sizeof name, "accuracy-speed-%s.svg", family);
    int width = 40 + (WIDE + GAP_X) * (scenes > 3 ? scenes : 3);
    int bottom = 64 + rows * (HIGH + GAP_Y);
    FILE *f = svg_open(folder, name, width, bottom + 100, title);
    for (int i = 0; i < WORKS; ++i) {
        if (strcmp(works[i].family, family)) continue;
        for (int s = 0; s < scenes; ++s) {
            svg_axes a = panel_axes(70 + s * (WIDE + GAP_X), 64 + row * (HIGH + GAP_Y), WIDE, HIGH);
            snprintf(text, sizeof text, "%s, %s", works[i].name, scene_names[s]);
            draw_panel(f, &a, text, spots, collect(spots, i, s));
        }
        ++row;
    }
    draw_legend(f, 70, bottom + 12, 5, 205);
    svg_close(f);
}

static void draw_overview(const char *folder) {
    static const int shown[4] = {DIFFUSE, PHONG_100, GGX_05, BANKS_09};
    spot spots[TRIALS];
    FILE *f = svg_open(folder, "accuracy-speed.svg", 1010, 800,
                       own_maps ? "Error against time: your maps"
                                : "Error against time: means over sun, studio and overcast");
    for (int i = 0; i < 4; ++i) {
        svg_axes a = panel_axes(70 + i % 2 * 480, 64 + i / 2 * 320, 410, 260);
        draw_panel(f, &a, works[shown[i]].name, spots, collect(spots, shown[i], -1));
    }
    draw_legend(f, 70, 712, 5, 190);
    svg_close(f);
}

/* ---------------------------------------------------------------------------------- >>tables -- */

static measure_document document;

/* The cheapest setting whose error is within the target on every scene. HARMONICS is FAST, where
   it can. */
static const spot *cheapest(const spot *spots, int count, double target) {
    const spot *best = NULL;
    for (const spot *s = spots; s < spots + count; ++s)
        if (s->most <= target && trials[s->trial].method != HARMONICS &&
            (!best || s->copies < best->copies))
            best = s;
    return best;
}

static void table_of_choices(void) {
    FILE *out = measure_begin(&document, "choice");
    const double targets[] = {1e-2, eight_bits(), 1e-3, 1e-4};
    spot spots[TRIALS];
    fprintf(out, "| lobe | 1 %% | 8 bits (%.2f %%) | 0.1 %% | 0.01 %% |\n|---|---|---|---|---|\n",
            100 * eight_bits());
    for (int i = 0; i < WORKS; ++i) {
        int count = collect(spots, i, -1);
        fprintf(out, "| %s |", works[i].name);
        for (int t = 0; t < COUNT(targets); ++t) {
            const spot *s = cheapest(spots, count, targets[t]);
            if (!s) {
                fprintf(out, " none |");
                continue;
            }
            const trial *of = trials + s->trial;
            fprintf(out, " %s %s: **%.0f**, %.2g ms, %.1g |", methods[of->method].name,
                    of->method == FAST ? strchr(of->text, '=') + 1 : of->text, s->copies, s->ms,
                    s->worst);
        }
        fprintf(out, "\n");
    }
    measure_end(&document, out, 1);
}

/* Each method: over which lobes, from what to what. */
static void table_of_methods(void) {
    FILE *out = measure_begin(&document, "methods");
    spot spots[TRIALS];
    fprintf(out, "| method | lobes | copies | rms, worst scene | settings on the front |\n"
                 "|---|--:|--:|--:|--:|\n");
    for (int m = 0; m < METHODS; ++m) {
        double cost[2] = {1e30, 0}, error[2] = {1e30, 0};
        int lobes = 0, front = 0, all = 0;
        for (int i = 0; i < WORKS; ++i) {
            int count = collect(spots, i, -1), found = 0;
            for (int k = 0; k < count; ++k) {
                if (trials[spots[k].trial].method != m) continue;
                cost[0] = fmin(cost[0], spots[k].copies), cost[1] = fmax(cost[1], spots[k].copies);
                error[0] = fmin(error[0], spots[k].most), error[1] = fmax(error[1], spots[k].most);
                ++found, front += spots[k].front;
            }
            lobes += found > 0, all += found;
        }
        fprintf(out, "| %s | %d of %d | %.2g … %.2g | %.1g … %.1g | %d of %d |\n", methods[m].name,
                lobes, WORKS, cost[0], cost[1], error[1], error[0], front, all);
    }
    measure_end(&document, out, 1);
}

static void table_of_machine(void) {
    char cpu[128];
    measure_processor(cpu, sizeof cpu);
    FILE *out = measure_begin(&document, "machine");
    envmap dst = measure_map(ENVMAP_CUBE, RATIO * TRUTH, 1, 1);
    envmap src = measure_map(ENVMAP_CUBE, 128, 1, 1);
    fprintf(out, "%s, %s, one thread. One copy (6 × 128² to 6 × %d² texels) took %.3g ms.\n", cpu,
            MEASURE_COMPILER, RATIO * TRUTH, 1e3 * measure_copy(&src, &dst, 1, measure_seconds));
    envmap_free(&src);
    envmap_free(&dst);
    measure_end(&document, out, 1);
}

/* ---------------------------------------------------------------------------------- >>growth -- */

/* Times by texels, of the source or the result. */
typedef struct growth {
    const char *name, *colour, *style;
    int method, count;
    const char *setting;
    double texels[8], ms[8], rms[8];
} growth;

static double slope(const growth *g) {
    return g->count < 2
               ? 0
               : log(g->ms[g->count - 1] / g->ms[0]) / log(g->texels[g->count - 1] / g->texels[0]);
}

/* again: such a row is in the CSV already. */
static void grow(growth *g, int scene, const exact *e, int ratio, double texels, int again) {
    point p;
    const trial *t = trial_named(g->method, g->setting);
    FILE *rows = csv;
    if (g->count && g->ms[g->count - 1] > 1e3 * PATIENCE) return;
    if (again) csv = NULL;
    double seconds = measure_trial(&p, scene, works + PHONG_100, e, t, ratio);
    csv = rows;
    if (!(seconds > 0) || seconds >= GAVE_UP) return;
    g->texels[g->count] = texels, g->ms[g->count] = p.ms, g->rms[g->count++] = p.rms;
}

#define GROWTH(name, colour, style, method, setting)                                               \
    {                                                                                              \
        name, colour, style, method, 0, setting, {0}, {0}, { 0 }                                   \
    }
#define DASHES "stroke-dasharray=\"5 4\""
static growth by_source[] = {
    GROWTH("FAST, by the source", "#d01c2a", "", FAST, "tolerance=0.001"),
    GROWTH("HIERARCHICAL, by the source", "#3b6ea8", "", HIERARCHICAL, "threshold=0.01"),
    GROWTH("box levels, by the source", "#4d8f4d", "", BOX, "bias=0"),
    GROWTH("REFERENCE, by the source", "#111111", "", REFERENCE, "every-texel")};
static growth by_result[] = {
    GROWTH("FAST, by the result", "#d01c2a", DASHES, FAST, "tolerance=0.001"),
    GROWTH("HIERARCHICAL, by the result", "#3b6ea8", DASHES, HIERARCHICAL, "threshold=0.01"),
    GROWTH("box levels, by the result", "#4d8f4d", DASHES, BOX, "bias=0")};

static void measure_growth(int scene) {
    static const int sources[] = {64, 128, 256, 512, 1024}, ratios[] = {1, 3, 9, 15, 27, 43};
    exact e;
    for (int i = 0; i < COUNT(sources); ++i) {
        progress(scene_names[scene], "growth", "with the source");
        make_exact(&e, scene, works + PHONG_100, ENVMAP_CUBE, sources[i], TRUTH);
        for (int k = 0; k < COUNT(by_source); ++k)
            grow(by_source + k, scene, &e, RATIO, 6.0 * sources[i] * sources[i],
                 sources[i] == 128 || (sources[i] < 512 && by_source[k].method == FAST));
        free_exact(&e);
    }
    make_exact(&e, scene, works + PHONG_100, ENVMAP_CUBE, 256, TRUTH);
    for (int i = 0; i < COUNT(ratios); ++i)
        for (int k = 0; k < COUNT(by_result); ++k) {
            progress(scene_names[scene], "growth", "with the result");
            grow(by_result + k, scene, &e, ratios[i], 6.0 * TRUTH * TRUTH * ratios[i] * ratios[i],
                 ratios[i] == RATIO);
        }
    free_exact(&e);
}

static void growth_row(FILE *out, const growth *g) {
    double error = 0;
    for (int i = 0; i < g->count; ++i) error = fmax(error, g->rms[i]);
    fprintf(out, "| %s | %s | %.2g … %.2g | %.3g … %.3g | %.2f | %.1g |\n", g->name, g->setting,
            g->texels[0], g->texels[g->count - 1], g->ms[0], g->ms[g->count - 1], slope(g), error);
}

static void growth_line(FILE *f, const svg_axes *a, const growth *g, int line) {
    double y = 70 + 20 * line;
    svg_line(f, a, g->texels, g->ms, g->count, g->colour, 2, g->style);
    for (int i = 0; i < g->count; ++i)
        svg_dot(f, a, g->texels[i], g->ms[i], 3, g->colour, g->colour);
    fprintf(f, "<path d=\"M590 %.1fH620\" stroke=\"%s\" stroke-width=\"2\" %s/>\n", y - 4,
            g->colour, g->style);
    svg_text(f, 628, y, 12, "start", "#111", "%s: power %.2f", g->name, slope(g));
}

static void draw_growth(const char *folder) {
    static const char *const names[] = {"1e3", "1e4", "1e5", "1e6"};
    FILE *f = svg_open(folder, "growth.svg", 900, 440,
                       "Time by texels: Phong N = 100, the sun, one thread");
    FILE *out = measure_begin(&document, "growth");
    svg_axes a = {80, 44, 560, 380, 600, 1e7, 0.1, 1e5, 1, 1};
    for (int i = 0; i < 4; ++i) svg_tick_x(f, &a, 1e3 * pow(10, i), names[i]);
    for (int e = -1; e <= 5; ++e) {
        char label[24];
        snprintf(label, sizeof label, "%g ms", pow(10, e));
        svg_tick_y(f, &a, pow(10, e), label);
    }
    svg_frame(f, &a);
    fprintf(f, "<path d=\"M%.1f %.1fL%.1f %.1f\" stroke=\"#999\" stroke-dasharray=\"1 4\"/>\n",
            svg_x(&a, 1e5), svg_y(&a, 0.3), svg_x(&a, 3e6), svg_y(&a, 9));
    svg_text(f, svg_x(&a, 1e6), svg_y(&a, 1.8), 11, "start", "#444", "linear");
    svg_text(f, 320, 424, 12, "middle", "#444",
             "texels, of the source (to 6 × 36²) or of the result (from 6 × 256²)");
    fprintf(out, "| | setting | texels | ms | time as texels to the power | largest rms |\n"
                 "|---|---|--:|--:|--:|--:|\n");
    for (int k = 0; k < COUNT(by_source); ++k)
        growth_row(out, by_source + k), growth_line(f, &a, by_source + k, k);
    for (int k = 0; k < COUNT(by_result); ++k)
        growth_row(out, by_result + k), growth_line(f, &a, by_result + k, 5 + k);
    svg_close(f);
    measure_end(&document, out, 1);
}

/* ---------------------------------------------------------------------------------- >>papers -- */

typedef struct speedup {
    double brute, seconds[2], rms[2], copies[2]; /* hierarchical, fast */
} speedup;

/* rms over every stride-th texel, as envmap_compare has it. */
static double strided_rms(const envmap *a, const envmap *b, int stride) {
    double off = 0, all = 0;
    for (int i = 0; i < TABLE1_TEXELS; i += stride) {
        double w = table1_solid_angle(a, i);
        for (int c = 0; c < 3; ++c) {
            double t = (double)b->texels[3 * i + c], e = (double)a->texels[3 * i + c] - t;
            off += w * e * e, all += w * t * t;
        }
    }
    return sqrt(off / all);
}

static void measure_table1(speedup *s, const envmap *src, int exponent) {
    static const char *const settings[2] = {"threshold=0.001", "tolerance=0.001"};
    enum { STRIDE = 61 };
    envmap truth = measure_map(ENVMAP_PARABOLOID, TABLE1_SIZE, 1, 1);
    envmap dst = measure_map(ENVMAP_PARABOLOID, TABLE1_SIZE, 1, 1);
    envmap_lobe lobe = envmap_lobe_phong((float)exponent);
    double copy = measure_copy(src, &dst, 1, measure_seconds);
    s->brute = table1_brute(&truth, src, exponent, STRIDE, measure_seconds);
    for (int k = 0; k < 2; ++k) {
        envmap_result result;
        s->seconds[k] = time_trial(&dst, src, &lobe,
                                   trial_named(k ? FAST : HIERARCHICAL, settings[k]), &result);
        measure_must(result, "table 1");
        s->rms[k] = strided_rms(&dst, &truth, STRIDE), s->copies[k] = s->seconds[k] / copy;
    }
    envmap_free(&truth);
    envmap_free(&dst);
}

static void log_bar(FILE *f, const svg_axes *a, double y, double v, const char *colour,
                    const char *text) {
    double x = svg_x(a, v);
    svg_bar(f, a->left, y, x - a->left, 14, colour);
    svg_text(f, x + 6, y + 11, 11, "start", "#111", "%s", text);
}

static void draw_table1(const char *folder, const speedup *s) {
    static const char *const colours[3] = {"#9aa0ab", "#3b6ea8", "#d01c2a"};
    static const char *const names[3] = {"hierarchical, as published in 2000",
                                         "HIERARCHICAL here, threshold 0.001",
                                         "FAST here, tolerance 0.001"};
    FILE *f = svg_open(folder, "table1.svg", 900, 440,
                       "Times quicker than brute force: Kautz et al. 2000, Table 1 (map of 128 x "
                       "256)");
    svg_axes a = {150, 44, 780, 384, 1, 1e6, 0, 1, 1, 0};
    char text[80];
    for (int i = 0; i <= 6; ++i) {
        snprintf(text, sizeof text, "%g", pow(10, i));
        svg_tick_x(f, &a, pow(10, i), text);
    }
    for (int i = 0; i < 5; ++i) {
        double y = 54 + 66 * i;
        svg_text(f, 142, y + 32, 13, "end", "#111", "N = %d", table1_exponents[i]);
        snprintf(text, sizeof text, "%.1f", table1_published[i]);
        log_bar(f, &a, y, table1_published[i], colours[0], text);
        for (int k = 0; k < 2; ++k) {
            double times = s[i].brute / s[i].seconds[k];
            snprintf(text, sizeof text, "%.*f (rms %.0e)", times < 100, times, s[i].rms[k]);
            log_bar(f, &a, y + 18 + 18 * k, times, colours[1 + k], text);
        }
    }
    for (int k = 0; k < 3; ++k) {
        svg_bar(f, 150 + 252 * k, 411, 13, 13, colours[k]);
        svg_text(f, 169 + 252 * k, 422, 12, "start", "#111", "%s", names[k]);
    }
    svg_close(f);
}

static void papers_table1(const char *folder) {
    envmap src = measure_map(ENVMAP_PARABOLOID, TABLE1_SIZE, 1, 1);
    speedup s[5];
    FILE *out = measure_begin(&document, "table1");
    table1_scene(&src, 0);
    fprintf(out, "| N | published | HIERARCHICAL | copies | rms | FAST | copies | rms |\n"
                 "|--:|--:|--:|--:|--:|--:|--:|--:|\n");
    for (int i = 0; i < 5; ++i) {
        progress("", "Table 1", "");
        measure_table1(s + i, &src, table1_exponents[i]);
        fprintf(out, "| %d | %.1f |", table1_exponents[i], table1_published[i]);
        for (int k = 0; k < 2; ++k)
            fprintf(out, " **%.*f** | %.0f | %.1e |", s[i].brute / s[i].seconds[k] < 100,
                    s[i].brute / s[i].seconds[k], s[i].copies[k], s[i].rms[k]);
        fprintf(out, "\n");
    }
    measure_end(&document, out, 1);
    draw_table1(folder, s);
    envmap_free(&src);
}

/* --------------------------------------------------------------------------------- >>threads -- */

typedef struct pair {
    const char *name;
    int work, method, ratio; /* ratio: the result's edge over the truth's */
    const char *setting;
} pair;

static const pair pairs[] = {
    {"diffuse, FAST", DIFFUSE, FAST, 27, "tolerance=0.001"},
    {"Phong 100, FAST", PHONG_100, FAST, 27, "tolerance=0.001"},
    {"Phong 500, FAST", PHONG_100 + 2, FAST, 27, "tolerance=0.001"},
    {"GGX 0.5, FAST", GGX_05, FAST, 27, "tolerance=0.001"},
    {"Banks 0.9, FAST", BANKS_09, FAST, 9, "tolerance=0.001"},
    {"Phong 100, HIERARCHICAL", PHONG_100, HIERARCHICAL, 3, "threshold=0.01"},
    {"Phong 500, REFERENCE", PHONG_100 + 2, REFERENCE, 1, "every-texel"}};

/* Wall seconds on one thread and on two, in turn so that both see the same machine. */
static void time_pair(double best[2], envmap *one, envmap *two, const envmap *src, const pair *q) {
    const trial *t = trial_named(q->method, q->setting);
    envmap_lobe lobe = lobe_of(works + q->work);
    double begun = measure_now();
    best[0] = best[1] = 1e30;
    for (int i = 0; i < 12 && (i < 2 || measure_now() - begun < 0.6); ++i)
        for (int k = 0; k < 2; ++k) {
            double start = measure_now();
            measure_must(run_trial(k ? two : one, src, &lobe, t, k + 1), q->name);
            best[k] = fmin(best[k], measure_now() - start);
        }
}

static void thread_row(FILE *out, FILE *f, const svg_axes *a, int scene, int i) {
    const pair *q = pairs + i;
    const work *w = works + q->work;
    exact e;
    double best[2];
    char text[80];
    progress(scene_names[scene], q->name, "one thread and two");
    make_exact(&e, scene, w, ENVMAP_CUBE, w->source, w->truth);
    envmap one = measure_map(ENVMAP_CUBE, q->ratio * w->truth, 1, w->slices);
    envmap two = measure_map(ENVMAP_CUBE, q->ratio * w->truth, 1, w->slices);
    time_pair(best, &one, &two, &e.src, q);
    if (memcmp(one.texels, two.texels, measure_bytes(&one, 1))) {
        fprintf(stderr, "%s: two threads make other bits than one\n", q->name);
        failed = 1;
    }
    double copy = measure_copy(&e.src, &one, 1, measure_now);
    envmap_difference d = compare(&two, &e.truth);
    for (int k = 0; k < 2; ++k) {
        point p = {scene, q->work, -1, 1e3 * best[k], best[k] / copy, d.rms, d.worst};
        write_row(scene, w, &e.src, &one, trial_named(q->method, q->setting), " clock=wall", k + 1,
                  &p);
    }
    fprintf(out, "| %s | %.3g | %.3g | %.2f | %.1g |\n", q->name, 1e3 * best[0], 1e3 * best[1],
            best[0] / best[1], d.rms);
    double y = 50 + 40 * i;
    svg_text(f, 202, y + 15, 12, "end", "#111", "%s", q->name);
    svg_bar(f, a->left, y, svg_x(a, best[0] / best[1]) - a->left, 22, methods[q->method].colour);
    snprintf(text, sizeof text, "%.2f times: %.3g to %.3g ms", best[0] / best[1], 1e3 * best[0],
             1e3 * best[1]);
    svg_text(f, svg_x(a, fmax(2, best[0] / best[1])) + 8, y + 15, 11, "start", "#111", "%s", text);
    envmap_free(&one);
    envmap_free(&two);
    free_exact(&e);
}

static void measure_threads(const char *folder, int scene) {
    FILE *out = measure_begin(&document, "threads");
    FILE *f = svg_open(folder, "threads.svg", 900, 380,
                       "Two threads over one: source 6 x 128 x 128, the same bits");
    svg_axes a = {212, 44, 812, 330, 0, 3, 0, 1, 0, 0};
    for (int i = 0; i <= 3; ++i) {
        char text[16];
        snprintf(text, sizeof text, "%d", i);
        svg_tick_x(f, &a, i, text);
    }
    fprintf(f, "<path d=\"M%.1f 44V330\" stroke=\"#111\" stroke-dasharray=\"6 4\"/>\n",
            svg_x(&a, 2));
    fprintf(out, "| | one, ms | two, ms | times | rms |\n|---|--:|--:|--:|--:|\n");
    for (int i = 0; i < COUNT(pairs); ++i) thread_row(out, f, &a, scene, i);
    svg_text(f, 512, 366, 12, "middle", "#444", "times quicker on the wall clock; %d processors",
             threads_here());
    svg_close(f);
    measure_end(&document, out, 1);
}

/* ------------------------------------------------------------------------------------ >>main -- */

static void load_scenes(int count, char **paths) {
    static const int order[SCENE_COUNT] = {SCENE_SUN, SCENE_STUDIO, SCENE_OVERCAST};
    own_maps = count > 0, scenes = count ? count < SCENES_MOST ? count : SCENES_MOST : SCENE_COUNT;
    for (int i = 0; i < scenes; ++i) {
        skies[i] = measure_map(ENVMAP_CUBE, BIG, 1, 1);
        progress("", "scenes", "");
        if (!count) {
            snprintf(scene_names[i], sizeof scene_names[i], "%s", scene_name[order[i]]);
            scene_fill(skies + i, order[i]);
            continue;
        }
        envmap map = {0};
        const char *name = strrchr(paths[i], '/') ? strrchr(paths[i], '/') + 1 : paths[i];
        snprintf(scene_names[i], sizeof scene_names[i], "%.*s", (int)strcspn(name, ".,&<"), name);
        measure_must(envmap_pfm_load(&map, paths[i], ENVMAP_LATLONG), paths[i]);
        measure_must(envmap_resample(skies + i, &map, NULL), paths[i]);
        envmap_free(&map);
    }
}

static void draw_all(const char *folder) {
    draw_overview(folder);
    draw_family(folder, "diffuse", "Error against time: the diffuse lobe");
    draw_family(folder, "phong", "Error against time: Phong lobes");
    draw_family(folder, "ggx", "Error against time: GGX lobes");
    draw_family(folder, "banks", "Error against time: Banks lobes, 8 slices");
}

int main(int argc, char **argv) {
    char path[5000], *rows;
    size_t bytes;
    if (argc < 2) {
        fprintf(stderr, "usage: chart DIR [MAP.pfm]...\n");
        return 2;
    }
    threads_begin(&crew, 2);
    load_scenes(argc - 2, argv + 2);
    csv = open_memstream(&rows, &bytes); /* a run that is stopped leaves the last one's file */
    if (!csv) measure_must(ENVMAP_ERROR_MEMORY, "the rows");
    fprintf(csv, "scene,lobe,parameter,mapping,size,method,setting,threads,milliseconds,copies,"
                 "relative_rms,worst_relative\n");
    table_of_machine();
    sweep_all();
    if (!failed && !own_maps) {
        measure_growth(0);
        patience = 1e9;
        measure_threads(argv[1], 0);
        papers_table1(argv[1]);
    }
    fclose(csv);
    progress("", failed ? "failed" : "done", "\n");
    if (!failed) {
        snprintf(path, sizeof path, "%s/charts/accuracy-speed.csv", argv[1]);
        csv = fopen(path, "w");
        if (!csv || !fwrite(rows, bytes, 1, csv) || fclose(csv))
            measure_must(ENVMAP_ERROR_FILE, path);
        table_of_choices();
        table_of_methods();
        draw_all(argv[1]);
        if (!own_maps) draw_growth(argv[1]);
        snprintf(path, sizeof path, "%s/accuracy-speed.md", argv[1]);
        if (!own_maps) measure_write(&document, path, "make chart");
    }
    free(rows);
    measure_document_free(&document);
    for (int i = 0; i < scenes; ++i) envmap_free(skies + i);
    threads_end(&crew);
    return failed;
}
