/* plan.c - holds what envmap_filter_plan expects against what happens.

   What you will see: progress on stderr, then tables: what each work needs, expected and measured
   error, and how often AUTO took the cheapest method. `plan DIR` puts the tables between the marks
   of DIR/plan.md; where DIR/charts/accuracy-speed.csv is there (`make chart`), its rows are held
   against too.
       cc -O3 -march=native -std=c99 -I. examples/measure/plan.c -o plan -lm -lpthread

   A work is a scene, a lobe, a source, a result and a tolerance. The truth is the definition at 4
   x 4 texels a face, which have the same centres as every third, ninth or 27th texel of the result.
   Times are this process's, the best of several runs; a method too slow for that is timed on the
   truth's texels alone, and scaled. Copies are times over a memcpy of source and result.

   >>works    scenes, lobes, sizes
   >>runs     one method timed and compared
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

/* What was measured: seconds, less than 0 where a method cannot do that. */
typedef struct timing {
    double time, error;
} timing;

typedef struct row {
    int scene, lobe, shape;
    double tolerance, copy; /* copy: seconds of a memcpy of source and result */
    envmap_plan needs;
    timing fast, reference, hierarchical[THRESHOLDS];
} row;

static row rows[ROWS];
static int row_count;

/* ------------------------------------------------------------------------------------ >>runs -- */

static envmap_filter_desc desc_of(int method, double tolerance, float threshold) {
    envmap_filter_desc desc = {0};
    desc.method = method, desc.tolerance = (float)tolerance, desc.threshold = threshold;
    return desc;
}

/* The best of several runs; -1 where the method cannot. */
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
    return best;
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

/* On all texels where that is quick, else on the truth's. */
static timing run(envmap *dst, envmap *part, const envmap *truth, const envmap *src,
                  const envmap_lobe *lobe, envmap_filter_desc desc, double guess) {
    timing out;
    double ratio = (double)dst->size / part->size;
    envmap *map = guess * ratio * ratio < 0.02 ? dst : part;
    out.time = timed(map, src, lobe, &desc) * (map == dst ? 1 : ratio * ratio);
    out.error = error_of(map, truth);
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
    double copy = measure_copy(src, &dst, 1, measure_seconds);
    timing reference = run(&dst, &part, &truth, src, &lobe, exact, guess), h[THRESHOLDS];
    for (i = 0; i < THRESHOLDS; ++i)
        h[i] = run(&dst, &part, &truth, src, &lobe,
                   desc_of(ENVMAP_METHOD_HIERARCHICAL, 0, thresholds[i]), guess);
    for (k = 0; k < 3; ++k) {
        row *r = rows + row_count;
        envmap_filter_desc desc = desc_of(ENVMAP_METHOD_AUTO, tolerances[k], 0);
        if (s->scene >= 0 && k != 1) continue;
        memset(r, 0, sizeof *r);
        r->scene = scene, r->lobe = lobe_index, r->shape = shape, r->tolerance = tolerances[k],
        r->copy = copy;
        r->reference = reference, memcpy(r->hierarchical, h, sizeof h);
        measure_must(envmap_filter_plan(&r->needs, &dst, src, &lobe, &desc), "a plan");
        r->fast.time = timed(&dst, src, &lobe, &desc);
        r->fast.error = r->fast.time < 0 ? 0 : error_of(&dst, &truth);
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

/* The time of a method that keeps the tolerance, or infinity. */
static double keeps(const timing *t, double tolerance) {
    return t->time > 0 && t->error <= tolerance ? t->time : HUGE_VAL;
}

static void table_picks(FILE *out) {
    static const double slack[3] = {1.0, 1.1, 2.0};
    int right[3] = {0, 0, 0}, above = 0, i, k, fast_rows = 0, rows_of = 0, other[2] = {0, 0};
    double most = 0, ratio[ROWS], lost = 0;
    for (i = 0; i < row_count; ++i) {
        const row *r = rows + i;
        double fast = keeps(&r->fast, r->tolerance), best;
        double reference = r->reference.time, hierarchical = HUGE_VAL, own;
        for (k = 0; k < THRESHOLDS; ++k)
            hierarchical = fmin(hierarchical, keeps(r->hierarchical + k, r->tolerance));
        best = fmin(fast, fmin(reference, hierarchical));
        own = fast;
        for (k = 0; k < 3; ++k) right[k] += own <= slack[k] * best;
        if (own > 1.1 * best) ++other[hierarchical <= best];
        if (own < HUGE_VAL) lost = fmax(lost, own / best); /* what missed it is counted below */
        if (own > 1.1 * best)
            fprintf(stderr,
                    "not the cheapest: %s, %s, shape %d, tolerance %g: took %s; FAST %.3g s, "
                    "REFERENCE %.3g s, HIERARCHICAL %.3g s\n",
                    scene_name[r->scene], lobes[r->lobe].name, r->shape, r->tolerance,
                    method_names[r->needs.method], fast, reference, hierarchical);
        if (!(r->fast.time > 0)) continue;
        above += r->fast.error > r->tolerance;
        most = fmax(most, r->fast.error / r->tolerance);
        ++fast_rows;
        if (r->needs.error > 0) /* through harmonics */
            ratio[rows_of++] = r->fast.error / r->needs.error;
    }
    fprintf(out, "| of %d works | |\n|---|--:|\n", row_count);
    fprintf(out, "| what AUTO took was the cheapest that kept the tolerance | %.0f %% |\n",
            100.0 * right[0] / row_count);
    fprintf(out, "| ... or within 10 %% of it | %.0f %% |\n", 100.0 * right[1] / row_count);
    fprintf(out, "| ... or within a factor of two | %.0f %% |\n", 100.0 * right[2] / row_count);
    fprintf(out, "| where it was not: REFERENCE or FAST was, HIERARCHICAL was | %d, %d works |\n",
            other[0], other[1]);
    fprintf(out, "| ... and cost, at the worst | %.1f times as much |\n", lost);
    fprintf(out, "| FAST: works above the tolerance | %d of %d |\n", above, fast_rows);
    fprintf(out, "| FAST: the largest error, of the tolerance | %.2f |\n", most);
    fprintf(out, "| FAST: measured / expected error, median | %.2f |\n",
            quantile(ratio, rows_of, 0.5));
    fprintf(out, "| ... one work of ten is below, one above | %.2f, %.2f |\n",
            quantile(ratio, rows_of, 0.1), quantile(ratio, rows_of, 0.9));
}

static void table_works(FILE *out) {
    int i;
    fprintf(out, "| scene | lobe | edge | bands | slices | lights | contrast | nine numbers | "
                 "copies | expected, measured error |\n"
                 "|---|---|--:|--:|--:|--:|--:|--:|--:|--:|\n");
    for (i = 0; i < row_count; ++i) {
        const row *r = rows + i;
        if (r->shape || fabs(log10(r->tolerance) + 3) > 0.1 || !(r->fast.time > 0)) continue;
        fprintf(out, "| %s | %s | %d | %d | %d | %d | %.2f | %.2g | %.0f | %.1e, %.1e |\n",
                scene_name[r->scene], lobes[r->lobe].name, r->needs.size, r->needs.bands,
                r->needs.slices, r->needs.lights, r->needs.contrast, r->needs.nine,
                r->fast.time / r->copy, r->needs.error, r->fast.error);
    }
}

/* ----------------------------------------------------------------------------------- >>chart --
   Rows of accuracy-speed.csv, whatever made them: FAST's are expected anew, the others compete. */

typedef struct chart_row {
    char scene[32], lobe[32], mapping[32], method[40], setting[96];
    double parameter, knob, ms, rms;
    int size, result, slices, threads, wall;
    double error; /* expected of FAST; 0: not FAST, or not ours */
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
    static const char *const mappings[] = {"cube",    "paraboloid", "sphere",
                                           "latlong", "angular",    "octahedral"};
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

/* What is expected of a row, where FAST made it. */
static void chart_expect(chart_row *r) {
    envmap_lobe lobe = lobe_of(chart_kind(r), (float)r->parameter);
    envmap_filter_desc desc = desc_of(0, fmin(r->knob, 0.1), 0);
    const envmap *src;
    envmap dst = {0};
    envmap_plan needs;
    r->error = 0;
    if (strcmp(r->method, "fast") || !(src = chart_source(r))) return;
    dst.mapping = src->mapping, dst.size = r->result, dst.levels = 1, dst.slices = r->slices;
    if (envmap_filter_plan(&needs, &dst, src, &lobe, &desc)) return;
    if (needs.method == ENVMAP_METHOD_FAST) r->error = needs.error;
}

/* Does FAST, asked for a tolerance, keep it, and is it cheaper than whatever else keeps it? */
static void chart_picks(int n[5], double *lost) {
    int i, k;
    for (i = 0; i < chart_count; ++i) {
        const chart_row *r = chart_rows + i;
        const chart_row *best = NULL;
        int others = 0;
        if (strcmp(r->method, "fast")) continue;
        n[3] += r->rms > r->knob;
        for (k = 0; k < chart_count; ++k) {
            const chart_row *o = chart_rows + k;
            if (!strcmp(o->method, "fast") || !strcmp(o->method, "harmonics") || !chart_same(r, o))
                continue;
            ++others;
            if (o->rms <= r->knob && (!best || o->ms < best->ms)) best = o;
        }
        if (!others) continue;
        ++n[0], n[1] += !best || r->ms <= best->ms, n[2] += !best || r->ms <= 2 * best->ms;
        if (!best || r->ms <= best->ms) continue;
        n[4] += !strcmp(best->method, "coefficients");
        *lost = fmax(*lost, r->ms / best->ms);
    }
}

static void table_chart(FILE *out) {
    static double errors[CHART_ROWS];
    int n[5] = {0, 0, 0, 0, 0}, i, fast = 0, count = 0;
    double lost = 0;
    for (i = 0; i < chart_count; ++i) {
        chart_row *r = chart_rows + i;
        if (i % 100 == 0) fprintf(stderr, "\rrow %d of %d", i, chart_count);
        chart_expect(r);
        fast += !strcmp(r->method, "fast");
        if (r->error > 0) errors[count++] = r->rms / r->error;
    }
    fprintf(stderr, "\r%-30s\r", "");
    chart_picks(n, &lost);
    fprintf(
        out,
        "FAST has %d rows; measured over expected error is %.2f in the median, and above %.2f "
        "in one row of\nten. Of %d rows that other methods, those of `examples/methods` too, "
        "have to compete with, it was the\ncheapest that kept the tolerance in %.0f %%, within "
        "a factor of two in %.0f %%, and took %.1f times as long\nat the worst. What beat it in "
        "%d of the other %d rows: coefficients of few bands (`envmap_sh_project`\nand "
        "`envmap_sh_fill`). %d of its rows are above their tolerance.\n",
        fast, quantile(errors, count, 0.5), quantile(errors, count, 0.9), n[0],
        100.0 * n[1] / fmax(n[0], 1), 100.0 * n[2] / fmax(n[0], 1), lost, n[4], n[0] - n[1], n[3]);
}

/* ------------------------------------------------------------------------------------ >>main -- */

int main(int argc, char **argv) {
    char path[1024], cpu[128];
    const char *docs = argc > 1 ? argv[1] : "docs";
    measure_document document = {0};
    FILE *out;
    if (argc < 3 || strcmp(argv[2], "--chart")) {
        measure_all();
        measure_processor(cpu, sizeof cpu);
        out = measure_begin(&document, "works");
        fprintf(out, "%s, %s, one thread.\n\n", cpu, MEASURE_COMPILER);
        table_works(out);
        measure_end(&document, out, 1);
        out = measure_begin(&document, "picks");
        table_picks(out);
        measure_end(&document, out, 1);
    }
    snprintf(path, sizeof path, "%s/charts/accuracy-speed.csv", docs);
    if (chart_load(path)) {
        out = measure_begin(&document, "chart");
        table_chart(out);
        measure_end(&document, out, 1);
    }
    snprintf(path, sizeof path, "%s/plan.md", docs);
    if (argc > 1) measure_write(&document, path, "make plan");
    measure_document_free(&document);
    return 0;
}
