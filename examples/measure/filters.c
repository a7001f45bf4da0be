/* filters.c - what the filters do inside, what they cost and how far they are from the truth: the
   tables, the charts and the picture of docs/filters.md.

   What you will see: `filters` prints the tables; `filters DOCS` also writes them between the
   marks in DOCS/filters.md, the charts DOCS/charts/filters-*.svg and DOCS/images/filters-sun.png.
   It looks into the header's private parts (envmapi_*), in >>inside and >>picture alone.
       cc -O3 -march=native -std=c99 -I. examples/measure/filters.c -o filters -lm -lpthread

   >>tools    scenes, progress
   >>works    what is measured
   >>inside   what the fast filter plans, how long its stages take, what the hierarchical one opens
   >>truth    the definition at some texels
   >>tables   time and error of works, error against tolerance, the survey
   >>charts   SVG
   >>picture  grids and opened nodes
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
    {"Banks s = 0.99, 2×64²×32", ENVMAP_LOBE_BANKS, 0.99f, ENVMAP_PARABOLOID, 64,
     32, 1}};

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

/* ---------------------------------------------------------------------------------- >>inside -- */

/* What the fast filter makes of a source, a lobe and a tolerance. need 0: the reference. */
typedef struct inside {
    int need, kinked, lights;
    double h, dark, share; /* share: of all light, in the lights */
    double kappa[10], epsilon[10]; /* contrasts at the scale of band 2^i */
    envmapi_grid grid;     /* of the source */
    float light[ENVMAPI_LIGHTS][3];
} inside;

static void look_inside(inside *in, const envmap *src, const work *w, double tolerance) {
    envmap_lobe lobe = lobe_of(w, 0);
    envmapi_job job;
    envmap dst = *src;
    memset(in, 0, sizeof *in), memset(&job, 0, sizeof job);
    dst.mapping = w->mapping, dst.size = w->size, dst.slices = w->slices;
    envmapi_desc(&job.desc, NULL);
    job.desc.method = ENVMAP_METHOD_FAST, job.desc.tolerance = (float)tolerance;
    measure_must(envmapi_job_create(&job, &dst, src, &lobe, 1), w->name);
    const envmapi_plan *plan = job.plans;
    if (job.planned[0] && plan->need) {
        const envmapi_survey *s = plan->kinked ? &job.scene.rest : &job.scene.whole;
        in->need = plan->need, in->kinked = plan->kinked, in->h = plan->h;
        in->dark = HUGE_VAL;
        for (int i = 0; i < envmapi_plan_sampled(plan); ++i) {
            envmapi_look look;
            envmapi_look_create(&look, plan, i, s);
            in->dark = fmin(in->dark, look.darkest / look.mean);
        }
        in->grid = envmapi_grid_of(src, plan->h, tolerance);
        in->lights = plan->kinked ? s->light_count : 0;
        for (int i = 0; i < in->lights; ++i)
            for (int c = 0; c < 3; ++c) in->light[i][c] = (float)s->lights[i].d[c];
        in->share = s->all > 0 ? 1 - s->energy / s->all : 0;
        for (int i = 0; i < 10; ++i) {
            envmapi_contrast c = envmapi_contrast_at(s, 1 << i);
            in->kappa[i] = c.kappa, in->epsilon[i] = c.epsilon;
        }
    }
    envmapi_pool_free(&job.pool, 0);
}

/* The stages of the fast filter, by the tasks that they consist of. */
enum { SURVEY, TEXELS, SPLINES, RINGS, FFT, LEGENDRE, OTHER, STAGES };
static const char *const stage_name[STAGES] = {
    "survey",     "texels to nodes and back", "spline solves",        "nodes to rings and back",
    "FFT",        "Legendre",                 "plans, poles, memory"};

typedef struct stopwatch {
    double spent[STAGES];
} stopwatch;

static int stage_of(envmap_task *task) {
    if (task == envmapi_task_omega || task == envmapi_task_survey) return SURVEY;
    if (task == envmapi_task_reduce || task == envmapi_task_copy || task == envmapi_task_expand)
        return TEXELS;
    if (task == envmapi_task_solve_columns || task == envmapi_task_solve_rows) return SPLINES;
    if (task == envmapi_task_points || task == envmapi_task_spread ||
        task == envmapi_task_interpolate)
        return RINGS;
    if (task == envmapi_task_fft_out || task == envmapi_task_fft_back) return FFT;
    if (task == envmapi_task_analyse || task == envmapi_task_synthesise) return LEGENDRE;
    return OTHER;
}

/* An executor of one thread that looks at the clock. */
static void timed_run(void *user, envmap_task *task, void *context, int count) {
    stopwatch *watch = (stopwatch *)user;
    double start = measure_seconds();
    for (int i = 0; i < count; ++i) task(context, i);
    watch->spent[stage_of(((const envmapi_batch *)context)->task)] += measure_seconds() - start;
}

static void time_stages(double spent[STAGES], const envmap *src, const work *w) {
    double best = 1e9;
    envmap dst = measure_map(w->mapping, w->size, w->levels, w->slices);
    for (int run = 0; run < 9; ++run) {
        stopwatch watch;
        envmap_filter_desc desc;
        memset(&watch, 0, sizeof watch), memset(&desc, 0, sizeof desc);
        desc.method = ENVMAP_METHOD_FAST;
        desc.work.executor.user = &watch, desc.work.executor.run = timed_run;
        double start = measure_seconds(), all = 0;
        run_work(&dst, src, w, &desc);
        double took = measure_seconds() - start;
        for (int i = 0; i < OTHER; ++i) all += watch.spent[i];
        watch.spent[OTHER] = took - all;
        if (took < best) best = took, memcpy(spent, watch.spent, sizeof watch.spent);
    }
    envmap_free(&dst);
}

/* Which node the hierarchical filter takes each texel of a cube with, for one axis: its level, or
   -1 where the lobe's support does not reach. The walk is envmapi_hier_visit's, line by line. */
typedef struct opened {
    const envmapi_hier *job;
    double a[3];
    int edge, nodes, values; /* nodes that were added, lobe values that were taken */
    signed char *level;
} opened;

static void paint_texels(opened *o, const envmapi_quad *quad, int level) {
    for (int i = 0; i < 4; ++i) {
        float d[3] = {(float)quad->x[i], (float)quad->y[i], (float)quad->z[i]}, u, v;
        int face;
        envmap_coordinates(&face, &u, &v, ENVMAP_CUBE, d);
        int x = (int)(u * (float)o->edge), y = (int)(v * (float)o->edge);
        o->level[(face * o->edge + y) * o->edge + x] = (signed char)level;
    }
}

static void paint(opened *o, int at_level, int at, int level) {
    if (at_level == 2) {
        const envmapi_hier_block *block = o->job->tree.blocks + at;
        for (int j = 0; j < 4; ++j) paint_texels(o, block->zero + j, level);
    } else {
        const envmapi_hier_node *node = o->job->tree.nodes + at;
        for (int j = 0; j < 4; ++j) paint(o, at_level - 1, node->child[j], level);
    }
}

static void open_block(opened *o, int at, double k2) {
    const envmapi_hier_block *block = o->job->tree.blocks + at;
    double k1[4], k0[4];
    envmapi_hier_k(k1, o->job, o->a, &block->one), o->values += 4;
    if (envmapi_hier_alike(k1, k2, o->job->threshold)) {
        paint(o, 2, at, 2), ++o->nodes;
        return;
    }
    for (int j = 0; j < 4; ++j) {
        envmapi_hier_k(k0, o->job, o->a, block->zero + j), o->values += 4;
        int alike = envmapi_hier_alike(k0, k1[j], o->job->threshold);
        paint_texels(o, block->zero + j, alike), o->nodes += alike ? 1 : 4;
    }
}

static double open_node(opened *o, int *count, int level, int at, int top) {
    const envmapi_hier_node *node = o->job->tree.nodes + at;
    const envmapi_quad *quad = &node->quad;
    double k[4] = {0, 0, 0, 0}, mean = 0;
    int before = *count, nodes = o->nodes;
    if (level == 3) envmapi_hier_k(k, o->job, o->a, quad), o->values += 4;
    for (int j = 0; level > 3 && j < 4; ++j) {
        double x = o->a[0] * quad->x[j] + o->a[1] * quad->y[j] + o->a[2] * quad->z[j];
        if (x >= node->low[j] && x <= node->high[j])
            k[j] = open_node(o, count, level - 1, node->child[j], 0);
    }
    for (int j = 0; j < 4; ++j) mean += node->share[j] * k[j];
    if (!top && *count == before && envmapi_hier_alike(k, mean, o->job->threshold)) {
        paint(o, level, at, level), o->nodes = nodes + 1;
        return mean;
    }
    ++*count;
    for (int j = 0; level == 3 && j < 4; ++j) open_block(o, node->child[j], k[j]);
    return mean;
}

static void open_tree(opened *o, const envmap *src, const envmap_lobe *lobe, const float axis[3]) {
    envmapi_hier *job = (envmapi_hier *)calloc(1, sizeof *job);
    size_t texels = 6 * (size_t)src->size * (size_t)src->size;
    memset(o, 0, sizeof *o);
    o->level = (signed char *)malloc(texels);
    if (!job || !o->level) measure_must(ENVMAP_ERROR_MEMORY, "a tree");
    memset(o->level, -1, texels);
    job->dst = job->src = src, job->lobe = lobe;
    measure_must(envmapi_hier_create(&job->tree, src, 0, NULL), "a tree");
    envmapi_hier_aim(job, 0, 0);
    o->job = job, o->edge = src->size;
    for (int c = 0; c < 3; ++c) o->a[c] = (double)axis[c];
    for (int face = 0, count = 0; face < 6; ++face)
        open_node(o, &count, job->tree.levels, job->tree.root[face], 1);
    envmapi_hier_free(&job->tree, NULL);
    free(job);
    o->job = NULL;
}

/* ----------------------------------------------------------------------------------- >>truth --
   The definition, at a lattice of texels and at the darkest and the brightest of every image. */

enum { MOST_PROBES = 4096 };

typedef struct probe {
    const envmapi_source *source;
    envmap_lobe lobe;
    double p, rgb[3], w;
    const float *texel;
    int mapping, size, face, x, y, even; /* even: one of the lattice */
} probe;

typedef struct truth {
    envmapi_source source;
    probe probes[MOST_PROBES];
    int count;
} truth;

static void probe_task(void *context, int i) {
    probe *q = (probe *)context + i;
    envmapi_axis axis;
    memset(&axis, 0, sizeof axis);
    axis.source = q->source, axis.lobe = &q->lobe, axis.p = q->p;
    axis.level = envmapi_level_of(q->source->map, 0, 0);
    axis.sigma = envmap_lobe_sigma(&q->lobe, q->p);
    envmap_lobe_support(&axis.from, &axis.to, &q->lobe, q->p);
    envmapi_texel_direction(axis.a, q->mapping, q->face, q->size, q->x, q->y);
    envmapi_axis_filter(&axis);
    double norm = envmapi_lobe_norm(&q->lobe);
    for (int c = 0; c < 3; ++c) q->rgb[c] = axis.rgb[c] / (norm > 0 ? norm : axis.norm);
}

static void add_probe(truth *t, const envmap *map, const envmap_lobe *lobe, int level, int slice,
                      int face, int x, int y, int even) {
    probe *q = t->probes + t->count;
    if (t->count >= MOST_PROBES) return;
    memset(q, 0, sizeof *q);
    q->source = &t->source, q->lobe = *lobe, q->even = even;
    q->p = envmapi_slice_p(lobe, slice, map->slices);
    q->texel = envmap_texel(map, level, slice, face, x, y);
    q->mapping = map->mapping, q->size = map->size >> level, q->face = face, q->x = x, q->y = y;
    q->w = envmap_solid_angle(map, level, face, x, y);
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
    int threads = threads_here();
    t->count = 0;
    measure_must(envmapi_source_create(&t->source, src, 0, NULL), "a source");
    for (int l = 0; l < w->levels; ++l) {
        envmap_lobe lobe = lobe_of(w, l);
        int step = w->slices > 8 ? w->slices / 8 : 1;
        for (int slice = step / 2; slice < w->slices; slice += step)
            for (int face = 0; face < envmap_faces(map->mapping); ++face)
                add_image(t, map, &lobe, l, slice, face, side);
    }
    threads_run(&threads, probe_task, t->probes, t->count);
    envmapi_source_free(&t->source, NULL);
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
    inside in;
} figure;

static figure figures[COUNT(works)][SCENE_COUNT];

static void measure_work(figure *f, const envmap *src, const work *w) {
    static truth t;
    envmap dst = measure_map(w->mapping, w->size, w->levels, w->slices);
    envmap_filter_desc desc;
    measure_meter m = {0, 0};
    double best = 1e9, spent = 0;
    memset(&desc, 0, sizeof desc);
    desc.method = ENVMAP_METHOD_FAST, desc.work.memory = &m;
    double copied = measure_copy(src, &dst, dst.levels, measure_seconds);
    for (int run = 0; run < 9 && (run < 3 || spent < 0.5); ++run) {
        double start = measure_seconds();
        run_work(&dst, src, w, &desc);
        spent += measure_seconds() - start, best = fmin(best, measure_seconds() - start);
    }
    f->copies = best / fmin(copied, measure_copy(src, &dst, dst.levels, measure_seconds));
    f->memory = (double)m.most / (double)measure_bytes(src, src->levels);
    look_inside(&f->in, src, w, 1e-3);
    find_truth(&t, &dst, src, w, w->levels > 1 ? 2 : w->slices > 1 ? 4 : 6);
    miss(&f->rms, &f->worst, &t);
    envmap_free(&dst);
}

static void table_of_time(void) {
    FILE *out = measure_begin(&document, "time");
    fprintf(out, "Copies; rms and worst texel in tolerances; memory over the source's bytes. "
                 "Source 6 × %d², tolerance 1e-3, one thread, compiler %s.\n\n| work |",
            EDGE, __VERSION__);
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

/* What the plans of the same works are. */
static void table_of_plans(void) {
    FILE *out = measure_begin(&document, "plans");
    double texel = envmapi_texel_extent(&skies[0]);
    fprintf(out, "Bands L, spacing h in texels of the source, nodes of its grid in %% of the "
                 "texels; lights that are summed one by one, if any.\n\n| work |");
    for (int k = 0; k < SCENE_COUNT; ++k) fprintf(out, " %s |", scene_name[k]);
    fprintf(out, "\n|---|---|---|---|\n");
    for (int i = 0; i < COUNT(works); ++i) {
        if (works[i].levels > 1) continue;
        fprintf(out, "| %s |", works[i].name);
        for (int k = 0; k < SCENE_COUNT; ++k) {
            const inside *in = &figures[i][k].in;
            double part = 100 * (double)in->grid.count / (6.0 * EDGE * EDGE);
            if (!in->need) fprintf(out, " the reference |");
            else fprintf(out, " %d, %.1f, %.0f %%", in->need, in->h / texel, part);
            if (in->need && in->lights) fprintf(out, "; %d lights", in->lights);
            if (in->need) fprintf(out, " |");
        }
        fprintf(out, "\n");
    }
    measure_end(&document, out, 1);
}

static void table_of_survey(void) {
    FILE *out = measure_begin(&document, "survey");
    fprintf(out, "| scene | κ at l = 1 | 4 | 16 | 64 | 256 | ε at l = 1 | 16 | 256 "
                 "| D for N = 10 | for N = 500 |\n|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|\n");
    for (int k = 0; k < SCENE_COUNT; ++k) {
        const inside *in = &figures[2][k].in;
        fprintf(out, "| %s |", scene_name[k]);
        for (int i = 0; i <= 8; i += 2) fprintf(out, " %.2g |", in->kappa[i]);
        for (int i = 0; i <= 8; i += 4) fprintf(out, " %.2g |", in->epsilon[i]);
        fprintf(out, " %.2g | %.2g |\n", figures[0][k].in.dark, in->dark);
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
    envmap_filter_desc desc;
    memset(&desc, 0, sizeof desc);
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
        measure_must(envmap_resample(&src, &skies[k]), "resample");
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
    FILE *f = svg_open(folder, "filters-tolerance.svg", 1030, 520,
                       "Error against tolerance: rms (solid), worst texel (dotted); black: 1 and "
                       "20 tolerances");
    for (int k = 0; k < SCENE_COUNT; ++k) draw_panel(f, k);
    for (int i = 0; i < COUNT(held); ++i)
        fprintf(f, "<text x=\"900\" y=\"%d\" fill=\"%s\">%s</text>\n", 90 + 22 * i, svg_colours[i],
                held[i].name);
    fprintf(f, "<text x=\"480\" y=\"508\" text-anchor=\"middle\">tolerance asked for</text>\n");
    svg_close(f);
}

/* |lambda_l| of lobes, and where the plan for the sun ends them at each tolerance. */
static double band_x(int l) { return 70 + 255 * log10(l < 1 ? 1 : l); }
static double band_y(double lambda) { return 50 + 45 * -log10(fmax(lambda, 1e-9)); }

/* The largest of four, for lobes with a kink change their sign or have zeros between. */
static double band_of(const double *lambda, int l) {
    double most = fabs(lambda[l]);
    for (int i = l; i < l + 4 && i < ENVMAPI_FAST_BANDS; ++i) most = fmax(most, fabs(lambda[i]));
    return most;
}

static void band_curve(FILE *f, int i, const envmap *src) {
    static const work curves[] = {{"diffuse", ENVMAP_LOBE_PHONG, 1, ENVMAP_CUBE, 64, 1, 1},
                                  {"Phong 10", ENVMAP_LOBE_PHONG, 10, ENVMAP_CUBE, 256, 1, 1},
                                  {"Phong 100", ENVMAP_LOBE_PHONG, 100, ENVMAP_CUBE, 256, 1, 1},
                                  {"Phong 500", ENVMAP_LOBE_PHONG, 500, ENVMAP_CUBE, 256, 1, 1},
                                  {"Phong 2000", ENVMAP_LOBE_PHONG, 2000, ENVMAP_CUBE, 256, 1, 1},
                                  {"GGX 0.25", ENVMAP_LOBE_GGX, 0.25f, ENVMAP_CUBE, 256, 1, 1}};
    static double lambda[ENVMAPI_FAST_BANDS];
    static inside in;
    const work *w = curves + i;
    envmap_lobe lobe = lobe_of(w, 0);
    measure_must(envmap_lobe_zonal(lambda, ENVMAPI_FAST_BANDS, &lobe, 0), w->name);
    fprintf(f, "<path fill=\"none\" stroke=\"%s\" stroke-width=\"2\" d=\"", svg_colours[i]);
    char pen = 'M';
    for (int l = 0; l + 4 < ENVMAPI_FAST_BANDS; ++l) {
        double most = band_of(lambda, l);
        fprintf(f, "%c%.1f %.1f", pen, band_x(l), band_y(most)), pen = 'L';
        if (most < 1e-9) break;
    }
    fprintf(f, "\"/>\n<text x=\"820\" y=\"%d\" fill=\"%s\">%s</text>\n", 80 + 22 * i,
            svg_colours[i], w->name);
    for (int n = 0; n < 4; ++n) {
        look_inside(&in, src, w, tolerances[n]);
        if (!in.need) continue;
        double y = band_y(band_of(lambda, in.need));
        fprintf(f, "<circle cx=\"%.1f\" cy=\"%.1f\" r=\"%d\" fill=\"%s\" fill-opacity=\"%.1f\" "
                   "stroke=\"%s\" stroke-width=\"1.5\"/>\n",
                band_x(in.need), y, in.kinked ? 5 : 4, svg_colours[i], in.kinked ? 0.0 : 1.0,
                svg_colours[i]);
        fprintf(f, "<text x=\"%.1f\" y=\"%.1f\" font-size=\"9\" fill=\"%s\">%d</text>\n",
                band_x(in.need) + 7, y + 3, svg_colours[i], n + 2);
    }
}

static void draw_bands(const char *folder, const envmap *src) {
    FILE *f = svg_open(folder, "filters-bands.svg", 930, 520,
                       "|λ| by band, and where the plan for the sun ends at tolerance 1e-2 "
                       "(2) to 1e-5 (5)");
    for (int e = 0; e <= 9; ++e)
        fprintf(f, "<path d=\"M70 %.0fH805\" stroke=\"#e4e4e4\"/><text x=\"62\" y=\"%.0f\" "
                   "text-anchor=\"end\">1e-%d</text>\n",
                band_y(pow(10, -e)), band_y(pow(10, -e)) + 4, e);
    for (int l = 1; l <= 512; l *= 2)
        fprintf(f, "<text x=\"%.1f\" y=\"480\" text-anchor=\"middle\">%d</text>\n", band_x(l), l);
    fprintf(f, "<text x=\"430\" y=\"505\" text-anchor=\"middle\">band l, the largest of "
               "l ... l + 3; open dots: lights taken out</text>\n");
    for (int i = 0; i < 6; ++i) band_curve(f, i, src);
    svg_close(f);
}

/* Where the time goes, in copies, under the sun. */
static void draw_work(const char *folder, const envmap *src) {
    FILE *f = svg_open(folder, "filters-work.svg", 930, 390,
                       "Where the time goes, in copies: the sun, tolerance 1e-3, one thread");
    FILE *out = measure_begin(&document, "work");
    double most = 0, spent[COUNT(works)][STAGES];
    fprintf(out, "| work |");
    for (int s = 0; s < STAGES; ++s) fprintf(out, " %s |", stage_name[s]);
    fprintf(out, "\n|---|--:|--:|--:|--:|--:|--:|--:|\n");
    for (int i = 0; i < COUNT(works); ++i) {
        const work *w = works + i;
        envmap dst = measure_map(w->mapping, w->size, w->levels, w->slices);
        double copied = measure_copy(src, &dst, dst.levels, measure_seconds), all = 0;
        progress(w->name);
        time_stages(spent[i], src, w);
        copied = fmin(copied, measure_copy(src, &dst, dst.levels, measure_seconds));
        fprintf(out, "| %s |", w->name);
        for (int s = 0; s < STAGES; ++s) {
            spent[i][s] /= copied, all += spent[i][s];
            fprintf(out, " %.1f |", spent[i][s]);
        }
        fprintf(out, "\n");
        most = fmax(most, all);
        envmap_free(&dst);
    }
    measure_end(&document, out, 1);
    for (int i = 0; i < COUNT(works); ++i) {
        double x = 210, y = 44 + 32 * i;
        fprintf(f, "<text x=\"202\" y=\"%.0f\" text-anchor=\"end\">%s</text>\n", y + 16,
                works[i].name);
        for (int s = 0; s < STAGES; ++s) {
            double width = 600 * spent[i][s] / most;
            fprintf(f, "<rect x=\"%.1f\" y=\"%.0f\" width=\"%.1f\" height=\"22\" fill=\"%s\"/>\n",
                    x, y, width, svg_colours[s]);
            x += width;
        }
        fprintf(f, "<text x=\"%.1f\" y=\"%.0f\">%.0f</text>\n", x + 8, y + 16,
                (x - 210) / 600 * most);
    }
    for (int s = 0; s < STAGES; ++s)
        fprintf(f, "<rect x=\"%d\" y=\"%d\" width=\"13\" height=\"13\" fill=\"%s\"/>"
                   "<text x=\"%d\" y=\"%d\">%s</text>\n",
                70 + 210 * (s % 4), 320 + 28 * (s / 4), svg_colours[s], 90 + 210 * (s % 4),
                331 + 28 * (s / 4), stage_name[s]);
    svg_close(f);
}

/* --------------------------------------------------------------------------------- >>picture -- */

#define PANORAMA 484
#define PADDED   316
#define MARGIN   16
static const unsigned level_colour[8] = {0xFFF3B0u, 0xFFC94Cu, 0xF28E2Bu, 0xD1495Bu,
                                         0x8E3B8Au, 0x54408Fu, 0x34386Bu, 0x262A4Au};

typedef struct padded_face {
    const envmap *map;
    double from, length; /* of u and v */
    int face;
} padded_face;

static int padded_point(float rgb[3], float s, float t, const void *user) {
    const padded_face *f = (const padded_face *)user;
    float d[3], u = (float)(f->from + f->length * (double)s);
    envmap_direction(d, ENVMAP_CUBE, f->face, u, (float)(f->from + f->length * (double)t));
    envmap_lookup(rgb, f->map, d, 0);
    return 1;
}

/* One face's grid, with the nodes beyond its edge, over what lies in their directions. */
static void draw_grid(picture *p, int x, int y, const envmap *src, const work *w, float exposure) {
    static inside in;
    char text[100];
    float u, v;
    padded_face f;
    look_inside(&in, src, w, 1e-3);
    f.map = src;
    envmap_coordinates(&f.face, &u, &v, ENVMAP_CUBE, scene_sun_direction);
    const envmapi_grid *g = &in.grid;
    double beside = g->identity ? 0 : (double)g->pad / g->nu;
    f.from = -beside, f.length = 1 + 2 * beside;
    picture_draw(p, x, y, PADDED, PADDED, exposure, padded_point, &f);
    float a = (float)(beside / f.length * PADDED), b = (float)PADDED - a, size = 1.1f;
    float left = (float)x, top = (float)y, step = (float)PADDED / (float)g->width;
    float edges[4][4] = {{a, a, b, a}, {b, a, b, b}, {b, b, a, b}, {a, b, a, a}};
    for (int i = 0; i < 4; ++i)
        picture_stroke(p, left + edges[i][0], top + edges[i][1], left + edges[i][2],
                       top + edges[i][3], 1.5f, 0xFFA24Cu);
    for (int j = 0; j < g->height; ++j)
        for (int i = 0; i < g->width; ++i) {
            float cx = left + ((float)i + 0.5f) * step, cy = top + ((float)j + 0.5f) * step;
            picture_stroke(p, cx, cy, cx, cy, step < 4 ? 1 : 2 * size, 0x7FE7FFu);
        }
    snprintf(text, sizeof text, "N = %g: %d bands, %d nodes",
             (double)w->parameter, in.need, (int)g->count);
    picture_text(p, left, top + PADDED + 8, 13, 0xF3F1ECu, text);
    snprintf(text, sizeof text, "%d x %d on the face, %d beyond each edge", g->nu, g->nv, g->pad);
    picture_text(p, left, top + PADDED + 28, 11, 0x9AA0ABu, text);
}

static void mark(picture *p, int x, int y, const float d[3], float radius, unsigned colour) {
    float u, v;
    int face;
    envmap_coordinates(&face, &u, &v, ENVMAP_LATLONG, d);
    picture_circle(p, (float)x + u * PANORAMA, (float)y + v * PANORAMA / 2, radius, 1.5f, colour);
}

/* The texels about the sun, with those that are among the lights. */
static void draw_zoom(picture *p, int x, int y, const envmap *src, const inside *in) {
    enum { SIDE = 20, PIXELS = 5 };
    float u, v, lu, lv;
    int face, other, x0, y0;
    picture_rectangle(p, x - 2, y - 2, SIDE * PIXELS + 4, SIDE * PIXELS + 4, 0xF3F1ECu, 1);
    envmap_coordinates(&face, &u, &v, ENVMAP_CUBE, scene_sun_direction);
    x0 = (int)(u * (float)src->size) - SIDE / 2, y0 = (int)(v * (float)src->size) - SIDE / 2;
    x0 = x0 < 0 ? 0 : x0 > src->size - SIDE ? src->size - SIDE : x0; /* it is near a corner */
    y0 = y0 < 0 ? 0 : y0 > src->size - SIDE ? src->size - SIDE : y0;
    for (int i = 0; i < SIDE * SIDE; ++i) {
        const float *texel = envmap_texel(src, 0, 0, face, x0 + i % SIDE, y0 + i / SIDE);
        float light[3] = {0, 0, 0};
        for (int c = 0; c < 3 && texel; ++c) light[c] = picture_curve(0.1f * texel[c]);
        picture_rectangle(p, x + i % SIDE * PIXELS, y + i / SIDE * PIXELS, PIXELS, PIXELS,
                          picture_colour(light), 1);
    }
    for (int i = 0; i < in->lights; ++i) {
        envmap_coordinates(&other, &lu, &lv, ENVMAP_CUBE, in->light[i]);
        int lx = (int)(lu * (float)src->size) - x0, ly = (int)(lv * (float)src->size) - y0;
        if (other == face && lx >= 0 && ly >= 0 && lx < SIDE && ly < SIDE)
            picture_rectangle(p, x + lx * PIXELS + 1, y + ly * PIXELS + 1, PIXELS - 2, PIXELS - 2,
                              0x1B7FA6u, 1);
    }
}

/* The scene, with the lights that are taken out for the diffuse lobe. */
static void draw_lights(picture *p, int x, int y, const envmap *src, float exposure) {
    static inside in;
    char text[100];
    look_inside(&in, src, works + 5, 1e-3);
    picture_panorama(p, x, y, PANORAMA, PANORAMA / 2, exposure, src);
    mark(p, x, y, scene_sun_direction, 7, 0xF3F1ECu);
    draw_zoom(p, x + PANORAMA - 112, y + PANORAMA / 2 - 112, src, &in);
    picture_text(p, (float)x, (float)y + PANORAMA / 2 + 8, 13, 0xF3F1ECu,
                 "the scene; enlarged: what the diffuse lobe sums exactly");
    snprintf(text, sizeof text, "%d texels of %d, %.0f %% of the light", in.lights,
             6 * src->size * src->size, 100 * in.share);
    picture_text(p, (float)x, (float)y + PANORAMA / 2 + 28, 11, 0x9AA0ABu, text);
}

/* What the hierarchical filter opens for an axis whose lobe has the sun on its flank. */
static void draw_opened(picture *p, int x, int y, const envmap *src) {
    static const float axis[3] = {-0.5f, 0.42f, 0.757f};
    envmap_lobe lobe = envmap_lobe_phong(100);
    char text[100];
    opened o;
    open_tree(&o, src, &lobe, axis);
    for (int j = 0; j < PANORAMA / 2; ++j)
        for (int i = 0; i < PANORAMA; ++i) {
            float d[3], u, v;
            int face, level;
            envmap_direction(d, ENVMAP_LATLONG, 0, ((float)i + 0.5f) / PANORAMA,
                             ((float)j + 0.5f) / (PANORAMA / 2));
            envmap_coordinates(&face, &u, &v, ENVMAP_CUBE, d);
            level = o.level[(face * o.edge + (int)fminf(v * (float)o.edge, (float)o.edge - 1)) *
                                o.edge + (int)fminf(u * (float)o.edge, (float)o.edge - 1)];
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
    if (!picture_create(&p, 3 * MARGIN + 2 * PANORAMA, below + PADDED + 50))
        measure_must(ENVMAP_ERROR_MEMORY, "a picture");
    picture_rectangle(&p, 0, 0, p.width, p.height, 0x15171Cu, 1);
    draw_lights(&p, MARGIN, MARGIN, src, exposure);
    draw_opened(&p, 2 * MARGIN + PANORAMA, MARGIN, src);
    for (int i = 0; i < 3; ++i)
        draw_grid(&p, MARGIN + i * (PADDED + (2 * PANORAMA + MARGIN - 3 * PADDED) / 2), below, src,
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
    table_of_plans();
    table_of_survey();
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
