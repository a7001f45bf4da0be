/* plan.c - holds what envmap_filter_plan expects against what happens, and fits what it counts with.

   What you will see: progress on stderr, then tables: expected and measured time and error, how
   often AUTO took the cheapest method, and the weights of the costs as they come out on this
   machine beside those of the header. `plan DIR` puts the tables between the marks of DIR/plan.md;
   where DIR/charts/accuracy-speed.csv is there (`make chart`), its rows are held against too.
       cc -O3 -march=native -std=c99 -I. examples/measure/plan.c -o plan -lm -lpthread

   A work is a scene, a lobe, a source, a result and a tolerance. The truth is the definition at 4
   x 4 texels a face, which have the same centres as every third, ninth or 27th texel of the result.
   Times are this process's, the best of several runs; a method too slow for that is timed on the
   truth's texels alone, and scaled. Time is told in copies of one texel of a large map.

   >>works    scenes, lobes, sizes
   >>runs     one method timed and compared
   >>fit      non-negative least squares of relative errors
   >>tables   Markdown
   >>chart    rows of accuracy-speed.csv
   >>main

   SPDX-License-Identifier: MIT */

#define _POSIX_C_SOURCE 200809L
#include "measure.h"

#include "../tool/scenes.h"

/* ----------------------------------------------------------------------------------- >>works -- */

static const struct {
    const char *name;
    int kind;
    float parameter;
} lobes[] = {{"diffuse", ENVMAP_LOBE_PHONG, 1},
             {"Phong N = 10", ENVMAP_LOBE_PHONG, 10},
             {"Phong N = 50", ENVMAP_LOBE_PHONG, 50},
             {"Phong N = 100", ENVMAP_LOBE_PHONG, 100},
             {"Phong N = 250", ENVMAP_LOBE_PHONG, 250},
             {"Phong N = 500", ENVMAP_LOBE_PHONG, 500},
             {"Phong N = 2000", ENVMAP_LOBE_PHONG, 2000},
             {"Gaussian 200", ENVMAP_LOBE_GAUSSIAN, 200},
             {"GGX roughness 0.3", ENVMAP_LOBE_GGX, 0.09f},
             {"GGX roughness 0.5", ENVMAP_LOBE_GGX, 0.25f},
             {"Banks s = 0.9", ENVMAP_LOBE_BANKS, 0.9f},
             {"Banks s = 0.99", ENVMAP_LOBE_BANKS, 0.99f}};
enum { LOBES = COUNT(lobes), SLICES = 4, TRUTH = 4 };

static envmap_lobe lobe_of(int kind, float parameter) {
    if (kind == ENVMAP_LOBE_BANKS) return envmap_lobe_banks(parameter);
    if (kind == ENVMAP_LOBE_GGX) return envmap_lobe_ggx(parameter);
    if (kind == ENVMAP_LOBE_GAUSSIAN) return envmap_lobe_gaussian(parameter);
    return envmap_lobe_phong(parameter);
}

/* Sources and results; edge is TRUTH times 1, 3, 9 or 27. scene -1: each, at three tolerances. */
static const struct shape {
    int from, source, to, edge, scene;
} shapes[] = {
    {ENVMAP_CUBE, 128, ENVMAP_CUBE, 36, -1},   {ENVMAP_CUBE, 128, ENVMAP_CUBE, 108, 2},
    {ENVMAP_LATLONG, 128, ENVMAP_CUBE, 36, 1}, {ENVMAP_CUBE, 64, ENVMAP_CUBE, 12, 0},
    {ENVMAP_CUBE, 64, ENVMAP_CUBE, 108, 1},    {ENVMAP_PARABOLOID, 64, ENVMAP_LATLONG, 36, 2},
    {ENVMAP_ANGULAR, 64, ENVMAP_CUBE, 12, 1},  {ENVMAP_CUBE, 32, ENVMAP_CUBE, 4, 2},
    {ENVMAP_CUBE, 32, ENVMAP_CUBE, 12, 1},     {ENVMAP_LATLONG, 32, ENVMAP_CUBE, 12, 0},
    {ENVMAP_CUBE, 24, ENVMAP_CUBE, 4, 1},      {ENVMAP_LATLONG, 16, ENVMAP_LATLONG, 4, 2},
    {ENVMAP_CUBE, 16, ENVMAP_CUBE, 4, 2},      {ENVMAP_CUBE, 8, ENVMAP_CUBE, 4, 0}};
enum { SHAPES = COUNT(shapes), ROWS = LOBES * (SHAPES + 8), THRESHOLDS = 3 };

static const double tolerances[3] = {1e-2, 1e-3, 1e-4};
static const float thresholds[THRESHOLDS] = {0.01f, 0.003f, 0.001f};

/* What was measured: times in copies of a texel, less than 0 where a method was not run. */
typedef struct timing {
    double time, error;
    double counts[ENVMAPI_COUNTS]; /* of what was timed: all, or the truth's texels */
    double timed;
} timing;

typedef struct row {
    int scene, lobe, shape;
    double tolerance;
    envmap_needs needs;
    timing fast, reference, hierarchical[THRESHOLDS];
} row;

static row rows[ROWS];
static int row_count;
static double texel_copy, texel_cached; /* seconds */

/* ------------------------------------------------------------------------------------ >>runs -- */

static double copy_of_a_texel(size_t bytes) {
    char *a = (char *)malloc(2 * bytes);
    double best = 1e30;
    int i, k, runs = bytes < 1 << 20 ? 64 : 1;
    if (!a) measure_must(ENVMAP_ERROR_MEMORY, "a copy");
    memset(a, 1, 2 * bytes);
    for (i = 0; i < 15; ++i) {
        double t = measure_seconds();
        for (k = 0; k < runs; ++k) measure_memcpy(a, a + bytes, bytes);
        best = fmin(best, (measure_seconds() - t) / runs);
    }
    free(a);
    return 12 * best / (double)bytes;
}

static envmap_filter_desc desc_of(int method, double tolerance, float threshold) {
    envmap_filter_desc desc;
    memset(&desc, 0, sizeof desc);
    desc.method = method, desc.tolerance = (float)tolerance, desc.threshold = threshold;
    return desc;
}

/* The best of several runs, in copies of a texel; -1 where the method cannot. */
static double timed(envmap *dst, const envmap *src, const envmap_lobe *lobe,
                    const envmap_filter_desc *desc) {
    double best = 1e30, start = measure_seconds(), t = start;
    int i;
    for (i = 0; i < 9 && (i < 2 || t - start < 0.03); ++i) {
        double before = t;
        if (envmap_filter(dst, src, lobe, desc)) return -1;
        t = measure_seconds();
        best = fmin(best, t - before);
        if (t - before > 0.1) break;
    }
    return best / texel_copy;
}

/* Relative rms over the texels of truth, which dst has among its own. */
static double error_of(const envmap *dst, const envmap *truth) {
    int s, f, x, y, c, ratio = dst->size / truth->size, width = measure_width(truth, 0);
    double off = 0, all = 0;
    for (s = 0; s < truth->slices; ++s)
        for (f = 0; f < envmap_faces(truth->mapping); ++f)
            for (y = 0; y < truth->size; ++y)
                for (x = 0; x < width; ++x) {
                    const float *b = envmap_texel(truth, 0, s, f, x, y);
                    const float *a =
                        envmap_texel(dst, 0, s, f, ratio * x + ratio / 2, ratio * y + ratio / 2);
                    double w = envmap_solid_angle(truth, 0, f, x, y);
                    for (c = 0; c < 3; ++c) {
                        off += w * pow((double)a[c] - (double)b[c], 2);
                        all += w * pow((double)b[c], 2);
                    }
                }
    return all > 0 ? sqrt(off / all) : 0;
}

static void count(double counts[ENVMAPI_COUNTS], const envmap *dst, const envmap *src,
                  const envmap_lobe *lobe, const envmap_filter_desc *desc) {
    double n[ENVMAP_METHOD_COUNT][ENVMAPI_COUNTS];
    envmap_needs needs;
    envmapi_job job;
    memset(&job, 0, sizeof job);
    envmapi_desc(&job.desc, desc);
    measure_must(envmapi_needs_job(&needs, &job, dst, src, lobe), "counts");
    envmapi_job_counts(n, &job);
    envmapi_pool_free(&job.pool, 0);
    memcpy(counts, n[desc->method], sizeof n[desc->method]);
}

/* On all texels where that is quick, else on the truth's. */
static timing run(envmap *dst, envmap *part, const envmap *truth, const envmap *src,
                  const envmap_lobe *lobe, envmap_filter_desc desc, double guess) {
    timing out;
    double ratio = (double)dst->size / part->size;
    envmap *map = guess * ratio * ratio < 0.02 / texel_copy ? dst : part;
    out.timed = timed(map, src, lobe, &desc);
    out.error = error_of(map, truth);
    out.time = out.timed * (map == dst ? 1 : ratio * ratio);
    count(out.counts, map, src, lobe, &desc);
    return out;
}

/* One work at one tolerance, or three. */
static void measure_work(const envmap *src, int scene, int lobe_index, int shape) {
    const struct shape *s = shapes + shape;
    envmap_lobe lobe = lobe_of(lobes[lobe_index].kind, lobes[lobe_index].parameter);
    int slices = lobes[lobe_index].kind == ENVMAP_LOBE_BANKS ? SLICES : 1, k, i;
    envmap dst = measure_map(s->to, s->edge, 1, slices),
           truth = measure_map(s->to, TRUTH, 1, slices);
    envmap part = measure_map(s->to, TRUTH, 1, slices);
    envmap_filter_desc exact = desc_of(ENVMAP_METHOD_REFERENCE, 0, 0);
    double guess = timed(&truth, src, &lobe, &exact);
    timing reference = run(&dst, &part, &truth, src, &lobe, exact, guess), h[THRESHOLDS];
    for (i = 0; i < THRESHOLDS; ++i)
        h[i] = run(&dst, &part, &truth, src, &lobe,
                   desc_of(ENVMAP_METHOD_HIERARCHICAL, 0, thresholds[i]), guess);
    for (k = 0; k < 3; ++k) {
        row *r = rows + row_count;
        envmap_filter_desc desc = desc_of(ENVMAP_METHOD_HARMONICS, tolerances[k], 0);
        if (s->scene >= 0 && k != 1) continue;
        memset(r, 0, sizeof *r);
        r->scene = scene, r->lobe = lobe_index, r->shape = shape, r->tolerance = tolerances[k];
        r->reference = reference, memcpy(r->hierarchical, h, sizeof h);
        measure_must(envmap_filter_plan(&r->needs, &dst, src, &lobe, &desc), "a plan");
        r->fast.time = r->fast.timed = timed(&dst, src, &lobe, &desc);
        r->fast.error = r->fast.time < 0 ? 0 : error_of(&dst, &truth);
        desc.method = ENVMAP_METHOD_FAST;
        count(r->fast.counts, &dst, src, &lobe, &desc);
        ++row_count;
    }
    envmap_free(&dst), envmap_free(&part), envmap_free(&truth);
}

static void measure_all(void) {
    int shape, scene, k;
    for (shape = 0; shape < SHAPES; ++shape)
        for (scene = 0; scene < SCENE_COUNT; ++scene) {
            envmap src;
            if (shapes[shape].scene >= 0 && shapes[shape].scene != scene) continue;
            src = measure_map(shapes[shape].from, shapes[shape].source, 1, 1);
            scene_fill(&src, scene);
            for (k = 0; k < LOBES; ++k) {
                fprintf(stderr, "\r%-60s", "");
                fprintf(stderr, "\rshape %d of %d, %s, %s", shape + 1, SHAPES, scene_name[scene],
                        lobes[k].name);
                measure_work(&src, scene, k, shape);
            }
            envmap_free(&src);
        }
    fprintf(stderr, "\r%-60s\r", "");
}

/* ------------------------------------------------------------------------------------- >>fit -- */

/* x >= 0 with the least sum over rows of (sum_i x_i n_i / t - 1)^2, coordinate by coordinate. */
typedef struct fit {
    double A[ENVMAPI_COUNTS][ENVMAPI_COUNTS], b[ENVMAPI_COUNTS], x[ENVMAPI_COUNTS];
    int rows;
} fit;

static void fit_add(fit *f, const timing *t) {
    int i, j;
    if (!(t->timed > 0)) return;
    for (i = 0; i < ENVMAPI_COUNTS; ++i) {
        f->b[i] += t->counts[i] / t->timed;
        for (j = 0; j < ENVMAPI_COUNTS; ++j)
            f->A[i][j] += t->counts[i] * t->counts[j] / (t->timed * t->timed);
    }
    ++f->rows;
}

static void fit_solve(fit *f) {
    int turn, i, j;
    for (turn = 0; turn < 100000; ++turn)
        for (i = 0; i < ENVMAPI_COUNTS; ++i) {
            double rest = f->b[i];
            for (j = 0; j < ENVMAPI_COUNTS; ++j) rest -= j == i ? 0 : f->A[i][j] * f->x[j];
            f->x[i] = f->A[i][i] > 0 ? fmax(rest / f->A[i][i], 0) : 0;
        }
}

static void fits(fit out[ENVMAP_METHOD_COUNT]) {
    int i, k;
    memset(out, 0, ENVMAP_METHOD_COUNT * sizeof *out);
    for (i = 0; i < row_count; ++i) {
        fit_add(out + ENVMAP_METHOD_FAST, &rows[i].fast);
        if (rows[i].tolerance > 2e-3 || rows[i].tolerance < 5e-4) continue; /* the same again */
        fit_add(out + ENVMAP_METHOD_REFERENCE, &rows[i].reference);
        for (k = 0; k < THRESHOLDS; ++k)
            fit_add(out + ENVMAP_METHOD_HIERARCHICAL, &rows[i].hierarchical[k]);
    }
    for (i = 0; i < ENVMAP_METHOD_COUNT; ++i) fit_solve(out + i);
}

/* ---------------------------------------------------------------------------------- >>tables -- */

static const char *const method_names[] = {"mirror", "REFERENCE", "HIERARCHICAL", "FAST"};

static int ascending(const void *a, const void *b) {
    double x = *(const double *)a, y = *(const double *)b;
    return x < y ? -1 : x > y;
}

static double quantile(double *values, int n, double q) {
    qsort(values, (size_t)n, sizeof *values, ascending);
    return n ? values[(int)(q * (n - 1) + 0.5)] : 0;
}

static double weighted(const double *weights, const double *counts) {
    double sum = 0;
    int i;
    for (i = 0; i < ENVMAPI_COUNTS; ++i) sum += weights[i] * counts[i];
    return sum;
}

/* Expected over measured time, by the header's weights and by these. */
static void table_times(FILE *out, const fit *fitted) {
    static const int order[3] = {ENVMAP_METHOD_FAST, ENVMAP_METHOD_REFERENCE,
                                 ENVMAP_METHOD_HIERARCHICAL};
    double ratio[2][ROWS * THRESHOLDS], off[2][ROWS * THRESHOLDS];
    int i, k, m, w;
    fprintf(out,
            "| method | rows | expected / measured, median | off by a factor, median | in nine of "
            "ten rows | as fitted anew here |\n|---|--:|--:|--:|--:|--:|\n");
    for (m = 0; m < 3; ++m) {
        int n = 0, method = order[m];
        for (i = 0; i < row_count; ++i)
            for (k = 0; k < (method == ENVMAP_METHOD_HIERARCHICAL ? THRESHOLDS : 1); ++k) {
                const timing *t = method == ENVMAP_METHOD_FAST        ? &rows[i].fast
                                  : method == ENVMAP_METHOD_REFERENCE ? &rows[i].reference
                                                                      : rows[i].hierarchical + k;
                if (!(t->timed > 0)) continue;
                if (method != ENVMAP_METHOD_FAST && fabs(log10(rows[i].tolerance) + 3) > 0.1)
                    continue;
                for (w = 0; w < 2; ++w) {
                    double e = weighted(w ? fitted[method].x : envmapi_costs[method], t->counts);
                    ratio[w][n] = e / t->timed, off[w][n] = exp(fabs(log(e / t->timed)));
                }
                ++n;
            }
        fprintf(out, "| %s | %d | %.2f | %.2f | %.2f | %.2f |\n", method_names[method], n,
                quantile(ratio[0], n, 0.5), quantile(off[0], n, 0.5), quantile(off[0], n, 0.9),
                quantile(off[1], n, 0.9));
    }
}

/* The time of a method that keeps the tolerance, or infinity. */
static double keeps(const timing *t, double tolerance) {
    return t->time > 0 && t->error <= tolerance ? t->time : HUGE_VAL;
}

static void table_picks(FILE *out) {
    static const double slack[3] = {1.0, 1.1, 2.0};
    int right[3] = {0, 0, 0}, model = 0, above = 0, i, k, fast_rows = 0, other[2] = {0, 0};
    double most = 0, ratio[ROWS], lost = 0;
    for (i = 0; i < row_count; ++i) {
        const row *r = rows + i;
        double fast = keeps(&r->fast, r->tolerance), best;
        double reference = r->reference.time, hierarchical = HUGE_VAL, own;
        for (k = 0; k < THRESHOLDS; ++k)
            hierarchical = fmin(hierarchical, keeps(r->hierarchical + k, r->tolerance));
        best = fmin(fast, fmin(reference, hierarchical));
        own = r->needs.method == ENVMAP_METHOD_FAST ? fast : reference;
        for (k = 0; k < 3; ++k) right[k] += own <= slack[k] * best;
        if (own > 1.1 * best) ++other[hierarchical <= best], lost = fmax(lost, own / best);
        model += (r->needs.operations[ENVMAP_METHOD_FAST] <
                  r->needs.operations[ENVMAP_METHOD_REFERENCE]) == (fast < reference);
        if (own > 1.1 * best)
            fprintf(stderr,
                    "not the cheapest: %s, %s, shape %d, tolerance %g: took %s; FAST %.3g "
                    "(expected %.3g), REFERENCE %.3g (%.3g), HIERARCHICAL %.3g\n",
                    scene_name[r->scene], lobes[r->lobe].name, r->shape, r->tolerance,
                    method_names[r->needs.method], fast, r->needs.operations[ENVMAP_METHOD_FAST],
                    reference, r->needs.operations[ENVMAP_METHOD_REFERENCE], hierarchical);
        if (!(r->fast.time > 0)) continue;
        above += r->fast.error > r->tolerance;
        most = fmax(most, r->fast.error / r->tolerance);
        ratio[fast_rows++] = r->fast.error / r->needs.error[ENVMAP_METHOD_FAST];
    }
    fprintf(out, "| of %d works | |\n|---|--:|\n", row_count);
    fprintf(out, "| what AUTO took was the cheapest that kept the tolerance | %.0f %% |\n",
            100.0 * right[0] / row_count);
    fprintf(out, "| ... or within 10 %% of it | %.0f %% |\n", 100.0 * right[1] / row_count);
    fprintf(out, "| ... or within a factor of two | %.0f %% |\n", 100.0 * right[2] / row_count);
    fprintf(out, "| where it was not: REFERENCE or FAST was, HIERARCHICAL was | %d, %d works |\n",
            other[0], other[1]);
    fprintf(out, "| ... and cost, at the worst | %.1f times as much |\n", lost);
    fprintf(out, "| expected costs tell FAST from REFERENCE rightly | %.0f %% |\n",
            100.0 * model / row_count);
    fprintf(out, "| FAST: works above the tolerance | %d of %d |\n", above, fast_rows);
    fprintf(out, "| FAST: the largest error, of the tolerance | %.2f |\n", most);
    fprintf(out, "| FAST: measured / expected error, median | %.2f |\n",
            quantile(ratio, fast_rows, 0.5));
    fprintf(out, "| ... one work of ten is below, one above | %.2f, %.2f |\n",
            quantile(ratio, fast_rows, 0.1), quantile(ratio, fast_rows, 0.9));
}

static void table_works(FILE *out) {
    int i;
    fprintf(out, "| scene | lobe | edge | bands | slices | lights | contrast | nine numbers | "
                 "expected, measured copies | expected, measured error |\n"
                 "|---|---|--:|--:|--:|--:|--:|--:|--:|--:|\n");
    for (i = 0; i < row_count; ++i) {
        const row *r = rows + i;
        double copy = r->needs.operations[ENVMAP_METHOD_FAST] / r->needs.copies[ENVMAP_METHOD_FAST];
        if (r->shape || fabs(log10(r->tolerance) + 3) > 0.1 || !(r->fast.time > 0)) continue;
        fprintf(out, "| %s | %s | %d | %d | %d | %d | %.2f | %.2g | %.0f, %.0f | %.1e, %.1e |\n",
                scene_name[r->scene], lobes[r->lobe].name, r->needs.size, r->needs.bands,
                r->needs.slices, r->needs.lights, r->needs.contrast, r->needs.nine,
                r->needs.copies[ENVMAP_METHOD_FAST], r->fast.time / copy,
                r->needs.error[ENVMAP_METHOD_FAST], r->fast.error);
    }
}

/* The header's tables, as they come out here. */
static void print_weights(const fit *fitted) {
    int m, i, w;
    printf("weights in the header, and as fitted here (copies of a texel of a large map):\n");
    for (m = 1; m < ENVMAP_METHOD_HARMONICS; ++m)
        for (w = 0; w < 2; ++w) {
            printf("  %-12s %s {", method_names[m], w ? "fitted" : "header");
            for (i = 0; i < ENVMAPI_COUNTS; ++i)
                printf("%s%.3g", i ? ", " : "", w ? fitted[m].x[i] : envmapi_costs[m][i]);
            printf("}  %d rows\n", fitted[m].rows);
        }
    printf("a texel copied in a cache over one of a large map: header %.2f, here %.2f\n",
           envmapi_costs_cached, texel_cached / texel_copy);
}

/* ----------------------------------------------------------------------------------- >>chart --
   Rows of accuracy-speed.csv, whatever made them: the header's methods are expected anew, the
   others only compete. */

typedef struct chart_row {
    char scene[32], lobe[32], mapping[32], method[40], setting[96];
    double parameter, knob, ms, rms;
    int size, result, slices, threads, wall;
    int kind; /* of the header's methods, or 0, with what is expected: */
    double operations, error;
} chart_row;

enum { CHART_ROWS = 4096 };
static chart_row chart_rows[CHART_ROWS];
static int chart_count;

static double chart_number(const char *setting, const char *name, double otherwise) {
    const char *at = strstr(setting, name);
    return at ? strtod(at + strlen(name), NULL) : otherwise;
}

static int chart_load(const char *path) {
    FILE *file = fopen(path, "r");
    char line[512];
    double copies;
    for (chart_count = 0; file && chart_count < CHART_ROWS && fgets(line, sizeof line, file);) {
        chart_row *r = chart_rows + chart_count;
        if (sscanf(line, "%31[^,],%31[^,],%lf,%31[^,],%d,%39[^,],%95[^,],%d,%lf,%lf,%lf", r->scene,
                   r->lobe, &r->parameter, r->mapping, &r->size, r->method, r->setting, &r->threads,
                   &r->ms, &copies, &r->rms) < 11)
            continue;
        r->knob = chart_number(r->setting, "tolerance=", 0);
        if (!strcmp(r->method, "hierarchical")) r->knob = chart_number(r->setting, "threshold=", 0);
        r->result = (int)chart_number(r->setting, "result=", 36);
        r->slices = (int)chart_number(r->setting, "slices=", 1);
        r->wall = strstr(r->setting, "clock=wall") != NULL;
        if (!r->wall && r->threads == 1) ++chart_count;
    }
    if (file) fclose(file);
    return chart_count;
}

static int chart_same(const chart_row *a, const chart_row *b) {
    return !strcmp(a->scene, b->scene) && !strcmp(a->lobe, b->lobe) && a->size == b->size &&
           !strcmp(a->mapping, b->mapping) && a->result == b->result && a->slices == b->slices &&
           fabs(a->parameter - b->parameter) < 1e-6 * fabs(a->parameter);
}

/* The source of a row, made once. NULL for scenes that are not ours. */
static const envmap *chart_source(const chart_row *r) {
    static const char *const mappings[] = {"cube", "paraboloid", "sphere", "latlong", "angular"};
    static envmap maps[32];
    static int scenes[32], made;
    int m = 0, s = 0, i;
    while (m < COUNT(mappings) && strcmp(mappings[m], r->mapping)) ++m;
    while (s < SCENE_COUNT && strcmp(scene_name[s], r->scene)) ++s;
    if (m == COUNT(mappings) || s == SCENE_COUNT) return NULL;
    for (i = 0; i < made; ++i)
        if (scenes[i] == s && maps[i].mapping == m && maps[i].size == r->size) return maps + i;
    if (made == COUNT(maps)) return NULL;
    maps[made] = measure_map(m, r->size, 1, 1), scenes[made] = s;
    scene_fill(maps + made, s);
    return maps + made++;
}

static int chart_kind(const chart_row *r) {
    return !strcmp(r->lobe, "banks")      ? ENVMAP_LOBE_BANKS
           : !strcmp(r->lobe, "ggx")      ? ENVMAP_LOBE_GGX
           : !strcmp(r->lobe, "gaussian") ? ENVMAP_LOBE_GAUSSIAN
                                          : ENVMAP_LOBE_PHONG;
}

/* What is expected of a row, where it is one of the header's methods. */
static void chart_expect(chart_row *r) {
    static const char *const names[] = {"", "reference", "hierarchical", "fast"};
    envmap_lobe lobe = lobe_of(chart_kind(r), (float)r->parameter);
    envmap_filter_desc desc = desc_of(0, fmin(r->knob, 0.1), (float)r->knob);
    const envmap *src;
    envmap dst;
    envmap_needs needs;
    int m = 1;
    while (m < COUNT(names) && strcmp(names[m], r->method)) ++m;
    r->kind = 0;
    if (m == COUNT(names) || !(src = chart_source(r))) return;
    memset(&dst, 0, sizeof dst);
    dst.mapping = src->mapping, dst.size = r->result, dst.levels = 1, dst.slices = r->slices;
    if (envmap_filter_plan(&needs, &dst, src, &lobe, &desc)) return;
    if (m == ENVMAP_METHOD_FAST && !(needs.operations[m] < HUGE_VAL))
        m = ENVMAP_METHOD_REFERENCE; /* which FAST takes then */
    r->kind = m, r->operations = needs.operations[m], r->error = needs.error[m];
}

/* Does FAST, asked for a tolerance, keep it, and is it cheaper than whatever else keeps it? */
static void chart_picks(int n[4], double *lost) {
    int i, k;
    for (i = 0; i < chart_count; ++i) {
        const chart_row *r = chart_rows + i;
        double best = HUGE_VAL;
        int others = 0;
        if (strcmp(r->method, "fast")) continue;
        n[3] += r->rms > r->knob;
        for (k = 0; k < chart_count; ++k) {
            const chart_row *o = chart_rows + k;
            if (!strcmp(o->method, "fast") || !strcmp(o->method, "harmonics") || !chart_same(r, o))
                continue;
            ++others;
            if (o->rms <= r->knob) best = fmin(best, o->ms);
        }
        if (!others) continue;
        ++n[0], n[1] += r->ms <= best, n[2] += r->ms <= 2 * best;
        *lost = fmax(*lost, r->ms / best);
    }
}

static void table_chart(FILE *out) {
    static double ratio[CHART_ROWS], off[CHART_ROWS], errors[CHART_ROWS];
    static const char *const names[] = {"", "REFERENCE", "HIERARCHICAL", "FAST"};
    int n[4] = {0, 0, 0, 0}, m, i, fast = 0;
    double lost = 0;
    fprintf(out,
            "| method | rows | expected / measured time, median | off by a factor, median | in "
            "nine of ten rows | measured / expected error, median |\n"
            "|---|--:|--:|--:|--:|--:|\n");
    for (i = 0; i < chart_count; ++i) {
        if (i % 100 == 0) fprintf(stderr, "\rrow %d of %d", i, chart_count);
        chart_expect(chart_rows + i);
    }
    fprintf(stderr, "\r%-30s\r", "");
    for (m = ENVMAP_METHOD_FAST; m > 0; --m) {
        int count_of = 0, error_count = 0;
        for (i = 0; i < chart_count; ++i) {
            const chart_row *r = chart_rows + i;
            if (r->kind != m) continue;
            ratio[count_of] = r->operations * texel_copy * 1e3 / r->ms;
            off[count_of] = exp(fabs(log(ratio[count_of]))), ++count_of;
            if (r->error > 0) errors[error_count++] = r->rms / r->error;
        }
        fprintf(out, "| %s | %d | %.2f | %.2f | %.2f | %.2f |\n", names[m], count_of,
                quantile(ratio, count_of, 0.5), quantile(off, count_of, 0.5),
                quantile(off, count_of, 0.9), quantile(errors, error_count, 0.5));
        fast += m == ENVMAP_METHOD_FAST ? count_of : 0;
    }
    chart_picks(n, &lost);
    fprintf(out,
            "\nOf %d rows of FAST that other methods, those of `examples/methods` too, have to "
            "compete with, it was\nthe cheapest that kept the tolerance in %.0f %%, within a "
            "factor of two in %.0f %%, and took %.1f times\nas long at the worst. Of all %d, %d "
            "are above their tolerance.\n",
            n[0], 100.0 * n[1] / fmax(n[0], 1), 100.0 * n[2] / fmax(n[0], 1), lost, fast, n[3]);
}

/* ------------------------------------------------------------------------------------ >>main -- */

int main(int argc, char **argv) {
    char path[1024], cpu[128], compiler[128];
    int chart_only = 0;
    measure_document document;
    fit fitted[ENVMAP_METHOD_COUNT];
    FILE *out;
    memset(&document, 0, sizeof document);
    if (argc > 2) chart_only = !strcmp(argv[2], "--chart");
    texel_copy = copy_of_a_texel((size_t)32 << 20), texel_cached = copy_of_a_texel((size_t)1 << 18);
    if (!chart_only) measure_all();
    fits(fitted);
    print_weights(fitted);
    measure_machine(cpu, compiler, sizeof cpu);
    out = measure_begin(&document, "machine");
    fprintf(out, "%s, %s; a texel of a large map is copied in %.2f ns.\n", cpu, compiler,
            1e9 * texel_copy);
    measure_end(&document, out, 1);
    out = measure_begin(&document, "times");
    table_times(out, fitted);
    measure_end(&document, out, 1);
    out = measure_begin(&document, "picks");
    table_picks(out);
    measure_end(&document, out, 1);
    out = measure_begin(&document, "works");
    table_works(out);
    measure_end(&document, out, 1);
    snprintf(path, sizeof path, "%s/charts/accuracy-speed.csv", argc > 1 ? argv[1] : "docs");
    if (chart_load(path)) {
        out = measure_begin(&document, "chart");
        table_chart(out);
        measure_end(&document, out, 1);
    }
    snprintf(path, sizeof path, "%s/plan.md", argc > 1 ? argv[1] : "docs");
    if (argc > 1) measure_write(&document, path, "make plan");
    measure_document_free(&document);
    return 0;
}
