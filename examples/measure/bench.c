/* bench.c - how long the filter takes, and how far from the truth it is.

   What you will see: the machine, the compiler and its flags; a table that holds the filter against
   the definition; then a table (Markdown) with one row for each work, on three made-up scenes or
   on the lat-long PFM files that you name. First every result is verified, then it is timed.

       ms       the best of several runs, one thread
       copies   ms over the time to memcpy the source and the result (best of seven, same run;
                seven before the timing, seven after)
       rms      relative rms error, worst: relative error of the worst texel, against the truth:
                the same filter at a tolerance of 1e-6
                (rms "-": no truth within half a minute; worst of the sampled texels only)
       truth    how far that truth is, in sampled texels, from a plain sum over the source that
                stands in measure.h (measure_plain_sum); "-" where a plain sum is not the definition
       bands    the harmonics that the lobe has at this tolerance (envmap_sh_bands), the most of
                a chain's: the fast filter costs O(texels + bands^3), no pairs of texels
       memory   the most that was allocated at a time, over the source's bytes
       bar, aim the copies that the project set itself

   usage: bench [--quick] [--scene NAME] [--map FILE.pfm]... [--csv FILE]
          bench --join A.csv B.csv: two runs beside each other, say of two sets of flags
   The exit status is 1 when a verification fails: a truth that is not true, a tolerance not kept,
   a texel off by more than 20 tolerances, or two threads whose bits differ from one's.

   >>clock >>threads >>works >>scenes >>truth >>timing >>rows >>verify >>ratios
   >>growth >>join >>main

   SPDX-License-Identifier: MIT */

#define _POSIX_C_SOURCE 200809L
#include "measure.h"
#include "../tool/scenes.h"
#include "../tool/threads.h"

#ifndef BENCH_FLAGS
#define BENCH_FLAGS "(not told)"
#endif

#define PATIENCE 30.0 /* seconds that a run may take before it is given up */
#define THREADS  2

/* ----------------------------------------------------------------------------------- >>clock -- */

/* A progress callback that gives up after PATIENCE. */
static int out_of_patience(void *user, float fraction) {
    (void)fraction;
    return measure_now() - *(const double *)user > PATIENCE;
}

/* --------------------------------------------------------------------------------- >>threads --
   Two of them (tool/threads.h); and an executor that runs its tasks one after the other and counts
   processor time, which tells how much of a call two threads can share also where other programs
   have the cores. */

typedef struct shares {
    double tasks, longer, clocks; /* seconds: all tasks; those of the busier of two threads; looks
                                     at the clock, which take as long as a short task */
    double clock;                 /* one look */
} shares;

static double shares_now(void) {
    struct timespec t;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* envmap_executor.run */
static void shares_run(void *user, envmap_task *task, void *context, int count) {
    shares *s = (shares *)user;
    double load[2] = {0, 0}, start = shares_now();
    for (int i = 0; i < count; ++i) {
        task(context, i);
        double now = shares_now();
        load[load[1] < load[0]] += now - start - s->clock; /* who is free takes the next */
        start = now;
    }
    s->tasks += load[0] + load[1], s->longer += fmax(load[0], load[1]);
    s->clocks += (count + 1) * s->clock;
}

/* ----------------------------------------------------------------------------------- >>works -- */

typedef struct shape {
    int mapping, size;
} shape;

typedef struct work {
    const char *name;
    int kind;        /* envmap_lobe_kind, or one of the below */
    float parameter; /* of the lobe; a GGX chain's bend; a Phong chain has its own */
    shape from, to;
    int slices, levels;
    float tolerance;
    double bar, aim; /* copies; 0: none */
} work;

/* What is no filter: a conversion, mip levels, nine coefficients from every texel. */
enum { RESAMPLE = 100, MIPS, NINE };

static const float chain_exponents[9] = {2048, 861, 362, 152, 64, 27, 11, 5, 2};

#define PHONG ENVMAP_LOBE_PHONG
#define GGX   ENVMAP_LOBE_GGX
#define BANKS ENVMAP_LOBE_BANKS
#define MAP(mapping, size)                                                                         \
    { ENVMAP_##mapping, size }
#define CUBE_256 MAP(CUBE, 256), MAP(CUBE, 256), 1
#define SKY_256  MAP(LATLONG, 256), MAP(CUBE, 256), 1
static const work figures[] = {
    {"Phong N = 10", PHONG, 10, CUBE_256, 1, 1e-3f, 5, 4},
    {"Phong N = 100", PHONG, 100, CUBE_256, 1, 1e-3f, 8, 6},
    {"Phong N = 500", PHONG, 500, CUBE_256, 1, 1e-3f, 25, 15},
    {"chain N = 2048 .. 2", PHONG, 0, CUBE_256, 9, 1e-3f, 100, 40},
    {"chain r = i/5", GGX, 0, CUBE_256, 6, 1e-3f, 80, 40},
    {"diffuse", PHONG, 1, MAP(CUBE, 256), MAP(CUBE, 64), 1, 1, 1e-3f, 9, 5},
    {"Phong N = 2000", PHONG, 2000, CUBE_256, 1, 1e-3f, 60, 40},
    {"Phong N = 5000", PHONG, 5000, CUBE_256, 1, 1e-3f, 120, 80},
    {"Phong N = 8000", PHONG, 8000, CUBE_256, 1, 1e-3f, 120, 80},
    {"Phong N = 20000", PHONG, 20000, CUBE_256, 1, 1e-3f, 120, 80},
    {"Phong N = 1e5", PHONG, 1e5f, CUBE_256, 1, 1e-3f, 60, 25},
    {"Phong N = 1e6", PHONG, 1e6f, CUBE_256, 1, 1e-3f, 60, 25},
    {"GGX alpha = 1", GGX, 1, CUBE_256, 1, 1e-3f, 30, 15},
    {"GGX alpha = 0.25", GGX, 0.25f, CUBE_256, 1, 1e-3f, 30, 15},
    {"GGX alpha = 0.0625", GGX, 0.0625f, CUBE_256, 1, 1e-3f, 25, 15},
    {"GGX alpha = 0.02", GGX, 0.02f, CUBE_256, 1, 1e-3f, 80, 50},
    {"GGX alpha = 0.01", GGX, 0.01f, CUBE_256, 1, 1e-3f, 250, 100},
    {"GGX alpha = 0.001", GGX, 1e-3f, CUBE_256, 1, 1e-3f, 250, 100},
    {"GGX alpha = 1e-4", GGX, 1e-4f, CUBE_256, 1, 1e-3f, 250, 100},
    {"chain, Unity's nine", GGX, 0.7f, CUBE_256, 9, 1e-3f, 200, 100},
    {"a frame, r = i/4", GGX, 0, MAP(CUBE, 128), MAP(CUBE, 128), 1, 5, 1e-3f, 0, 0},
    {"Banks s = 0.99, x 32", BANKS, 0.99f, MAP(CUBE, 256), MAP(PARABOLOID, 64), 32, 1, 1e-3f, 150,
     60},
    {"Banks s = 0.9999, x 32", BANKS, 0.9999f, MAP(CUBE, 256), MAP(PARABOLOID, 64), 32, 1, 1e-3f,
     1500, 500},
    {"Banks s = 0.99995, x 32", BANKS, 0.99995f, MAP(CUBE, 256), MAP(PARABOLOID, 64), 32, 1, 1e-3f,
     1500, 500},
    {"Phong N = 100", PHONG, 100, SKY_256, 1, 1e-3f, 20, 10},
    {"Phong N = 20000", PHONG, 20000, SKY_256, 1, 1e-3f, 300, 104},
    {"GGX alpha = 0.01", GGX, 0.01f, SKY_256, 1, 1e-3f, 625, 130},
    {"resample", RESAMPLE, 0, SKY_256, 1, 1e-3f, 40, 15},
    {"resample", RESAMPLE, 0, MAP(CUBE, 256), MAP(LATLONG, 256), 1, 1, 1e-3f, 80, 20},
    {"resample", RESAMPLE, 0, MAP(ANGULAR, 512), MAP(CUBE, 128), 1, 1, 1e-3f, 80, 20},
    {"mips", MIPS, 0, CUBE_256, 9, 1e-3f, 8, 3},
    {"nine coefficients", NINE, 0, MAP(CUBE, 256), MAP(CUBE, 1), 1, 1, 1e-3f, 8, 3},
    {"Phong N = 100", PHONG, 100, CUBE_256, 1, 1e-5f, 1000, 200},
};
enum { QUICK = 6 }; /* so many are done in a quick run */
/* About as many texels as the cube has. */
static const work others[] = {
    {"Phong N = 100", PHONG, 100, MAP(CUBE, 256), MAP(CUBE, 256), 1, 1, 1e-2f, 0, 0},
    {"Phong N = 100", PHONG, 100, MAP(CUBE, 256), MAP(CUBE, 256), 1, 1, 1e-4f, 0, 0},
    {"GGX alpha = 0.25", GGX, 0.25f, MAP(CUBE, 256), MAP(CUBE, 256), 1, 1, 1e-3f, 0, 0},
    {"Phong N = 100", PHONG, 100, MAP(PARABOLOID, 443), MAP(CUBE, 256), 1, 1, 1e-3f, 0, 0},
    {"Phong N = 100", PHONG, 100, MAP(LATLONG, 443), MAP(CUBE, 256), 1, 1, 1e-3f, 0, 0},
    {"Phong N = 100", PHONG, 100, MAP(SPHERE, 627), MAP(CUBE, 256), 1, 1, 1e-3f, 0, 0},
    {"Phong N = 100", PHONG, 100, MAP(ANGULAR, 627), MAP(CUBE, 256), 1, 1, 1e-3f, 0, 0},
    {"Phong N = 100", PHONG, 100, MAP(OCTAHEDRAL, 627), MAP(CUBE, 256), 1, 1, 1e-3f, 0, 0},
    {"Phong N = 100", PHONG, 100, MAP(CUBE, 256), MAP(PARABOLOID, 443), 1, 1, 1e-3f, 0, 0},
    {"Phong N = 100", PHONG, 100, MAP(CUBE, 256), MAP(LATLONG, 443), 1, 1, 1e-3f, 0, 0},
    {"Phong N = 100", PHONG, 100, MAP(CUBE, 256), MAP(SPHERE, 627), 1, 1, 1e-3f, 0, 0},
    {"Phong N = 100", PHONG, 100, MAP(CUBE, 256), MAP(ANGULAR, 627), 1, 1, 1e-3f, 0, 0},
    {"Phong N = 100", PHONG, 100, MAP(CUBE, 256), MAP(OCTAHEDRAL, 627), 1, 1, 1e-3f, 0, 0},
    {"Phong N = 2000", PHONG, 2000, MAP(OCTAHEDRAL, 627), MAP(OCTAHEDRAL, 627), 1, 1, 1e-3f, 0, 0},
};
/* Held against the definition, which is slow, so the results are tiny. */
static const work small_works[] = {
    {"Phong N = 10", PHONG, 10, MAP(CUBE, 256), MAP(CUBE, 8), 1, 1, 1e-6f, 0, 0},
    {"Phong N = 100", PHONG, 100, MAP(CUBE, 256), MAP(CUBE, 8), 1, 1, 1e-6f, 0, 0},
    {"Phong N = 500", PHONG, 500, MAP(CUBE, 256), MAP(CUBE, 8), 1, 1, 1e-6f, 0, 0},
    {"Phong N = 2048", PHONG, 2048, MAP(CUBE, 256), MAP(CUBE, 8), 1, 1, 1e-6f, 0, 0},
    {"diffuse", PHONG, 1, MAP(CUBE, 256), MAP(CUBE, 8), 1, 1, 1e-6f, 0, 0},
    {"GGX alpha = 0.25", GGX, 0.25f, MAP(CUBE, 256), MAP(CUBE, 8), 1, 1, 1e-6f, 0, 0},
    {"Banks s = 0.99, x 8", BANKS, 0.99f, MAP(CUBE, 256), MAP(PARABOLOID, 4), 8, 1, 1e-5f, 0, 0},
    {"Banks s = 0.99995, x 2", BANKS, 0.99995f, MAP(CUBE, 256), MAP(PARABOLOID, 4), 2, 1, 1e-3f, 0,
     0},
    {"Phong N = 100", PHONG, 100, MAP(PARABOLOID, 443), MAP(CUBE, 8), 1, 1, 1e-6f, 0, 0},
    {"Phong N = 100", PHONG, 100, MAP(LATLONG, 443), MAP(CUBE, 8), 1, 1, 1e-6f, 0, 0},
    {"Phong N = 100", PHONG, 100, MAP(SPHERE, 627), MAP(CUBE, 8), 1, 1, 1e-6f, 0, 0},
    {"Phong N = 100", PHONG, 100, MAP(ANGULAR, 627), MAP(CUBE, 8), 1, 1, 1e-6f, 0, 0},
    {"Phong N = 100", PHONG, 100, MAP(OCTAHEDRAL, 627), MAP(CUBE, 8), 1, 1, 1e-6f, 0, 0},
};

static envmap_lobe work_lobe(const work *w, int level) {
    double roughness = envmap_level_roughness(level, w->levels, (double)w->parameter);
    if (w->kind == ENVMAP_LOBE_BANKS) return envmap_lobe_banks(w->parameter);
    if (w->kind == ENVMAP_LOBE_GGX && w->levels > 1)
        return envmap_lobe_ggx((float)(roughness * roughness));
    if (w->kind == ENVMAP_LOBE_GGX) return envmap_lobe_ggx(w->parameter);
    if (w->kind >= RESAMPLE) return envmap_lobe_mirror();
    return envmap_lobe_phong(w->levels > 1 ? chain_exponents[level] : w->parameter);
}

static const char *shape_name(char text[32], shape s) {
    static const char *const names[] = {"cube",    "paraboloid", "sphere",
                                        "latlong", "angular",    "octahedral"};
    snprintf(text, 32, "%s %d", names[s.mapping], s.size);
    return text;
}

/* ---------------------------------------------------------------------------------- >>scenes -- */

/* Times by texels, of the result (0) or the source (1). */
typedef struct growth {
    double texels[8], ms[8];
    int count;
} growth;

typedef struct bench {
    threads_pool crew;
    const char *maps[16], *only;
    int map_count, quick;
    FILE *csv;
    growth growth[2];
    double ease; /* bars are meant for -march=native; without it they are wider */
    int failures, rows, bars, bars_met, aims, aims_met;
    char scene[24];
    envmap sky, source; /* the scene as lat-long, and as the source of the present row */
    measure_texels texels;
} bench;

static void complain(bench *b, const char *what, const char *why) {
    fprintf(stderr, "bench: %s: %s: %s\n", b->scene, what, why);
    ++b->failures;
}

/* Scene i, or map i where maps are named: they take the scenes' place. */
static int load_scene(bench *b, int i) {
    envmap_free(&b->sky);
    if (i < b->map_count) {
        const char *slash = strrchr(b->maps[i], '/');
        snprintf(b->scene, sizeof b->scene, "%.20s", slash ? slash + 1 : b->maps[i]);
        char *dot = strrchr(b->scene, '.');
        if (dot) *dot = 0;
        return envmap_pfm_load(&b->sky, b->maps[i], ENVMAP_LATLONG) == ENVMAP_OK;
    }
    snprintf(b->scene, sizeof b->scene, "%s", scene_name[i]);
    if (envmap_create(&b->sky, ENVMAP_LATLONG, 512, 1, 1)) return 0;
    scene_fill(&b->sky, i);
    return 1;
}

static int make_source(bench *b, shape s) {
    if (b->source.texels && b->source.mapping == s.mapping && b->source.size == s.size) return 1;
    envmap_free(&b->source);
    free(b->texels.at);
    b->texels.at = NULL;
    if (envmap_create(&b->source, s.mapping, s.size, 1, 1)) return 0;
    if (envmap_resample(&b->source, &b->sky, NULL)) return 0;
    measure_list(&b->texels, &b->source);
    return 1;
}

/* ----------------------------------------------------------------------------------- >>truth --
   The truth of a row is the same filter at a tolerance of 1e-6, or where that is out of patience
   the next that is; some of its texels are held against a plain sum. */

/* The one call that a row is about. Mip levels are made of what is in dst, nine coefficients go to
   dst's six texels. */
static envmap_result call_work(bench *b, envmap *dst, const work *w,
                               const envmap_filter_desc *desc) {
    envmap_lobe lobes[9];
    double sh[27];
    if (w->kind == RESAMPLE) return envmap_resample(dst, &b->source, &desc->work);
    if (w->kind == MIPS) return envmap_mips_build(dst);
    if (w->kind == NINE) {
        envmap_result result = envmap_sh_project(sh, 3, &b->source, 0, 0, &desc->work);
        for (int i = 0; i < 18 && !result; ++i) dst->texels[i] = (float)sh[i];
        return result;
    }
    for (int l = 0; l < w->levels; ++l) lobes[l] = work_lobe(w, l);
    return envmap_filter_chain(dst, &b->source, lobes, w->levels, desc);
}

/* A run with the given method and tolerance into dst. */
static envmap_result run_work(bench *b, envmap *dst, const work *w, int method, double tolerance,
                              int threads, measure_meter *m) {
    envmap_filter_desc desc = {0};
    double start = measure_now();
    desc.method = method, desc.tolerance = (float)tolerance, desc.work.memory = m;
    desc.work.progress.user = &start, desc.work.progress.report = out_of_patience;
    if (threads > 1) desc.work.executor.user = &b->crew, desc.work.executor.run = threads_run;
    return call_work(b, dst, w, &desc);
}

typedef struct sample {
    const bench *b;
    envmap_lobe lobe;
    double axis[3], p, rgb[3];
    const float *texel;
} sample;

static void sample_task(void *context, int i) {
    sample *s = (sample *)context + i;
    measure_plain_sum(s->rgb, &s->b->texels, &s->lobe, s->p, s->axis, 4);
}

/* The texel of dst at a place in [0,1)^3 of its level; 0 where it is not wholly inside a rim. */
static int sample_at(sample *s, const envmap *dst, int level, const double place[3]) {
    int width = measure_width(dst, level), height = measure_height(dst, level);
    int image = (int)(place[0] * dst->slices * envmap_faces(dst->mapping));
    int slice = image / envmap_faces(dst->mapping), face = image % envmap_faces(dst->mapping);
    int x = (int)(place[1] * width), y = (int)(place[2] * height);
    double X = fabs(2 * (x + 0.5) / width - 1) + 1.0 / width;
    double Y = fabs(2 * (y + 0.5) / height - 1) + 1.0 / height;
    int round = dst->mapping == ENVMAP_PARABOLOID || dst->mapping == ENVMAP_SPHERE ||
                dst->mapping == ENVMAP_ANGULAR;
    if (round && X * X + Y * Y > 1) return 0;
    measure_direction(s->axis, dst, level, face, x, y);
    s->p = measure_slice(&s->lobe, slice, dst->slices);
    s->texel = envmap_texel(dst, level, slice, face, x, y);
    return measure_plain_enough(&s->b->texels, &s->lobe, s->p);
}

static double fraction(double x) { return x - floor(x); }

/* The worst of the sampled texels, relative as in envmap_compare. */
static double sample_error(const sample *s, int count) {
    double mean = 0, worst = 0;
    for (int i = 0; i < count; ++i) mean += (s[i].rgb[0] + s[i].rgb[1] + s[i].rgb[2]) / (3 * count);
    for (int i = 0; i < count; ++i) {
        double peak = 1e-3 * mean, off = 0;
        for (int c = 0; c < 3; ++c) {
            double e = fabs((double)s[i].texel[c] - s[i].rgb[c]);
            if (!(e <= off)) off = e;
            if (s[i].rgb[c] > peak) peak = s[i].rgb[c];
        }
        if (!(off / peak <= worst)) worst = off / peak;
    }
    return worst;
}

/* How far a truth is from plain sums, stratified over faces and slices; -1 where there are none. */
static double sample_truth(bench *b, const envmap *truth, const work *w) {
    sample samples[64];
    int per_level = 64 / w->levels, count = 0;
    for (int l = 0; l < w->levels; ++l)
        for (int i = 0; i < per_level; ++i) {
            double place[3] = {(i + 0.5) / per_level, fraction(0.5 + 0.7548776662 * i),
                               fraction(0.5 + 0.5698402910 * i)};
            samples[count].b = b, samples[count].lobe = work_lobe(w, l);
            count += sample_at(samples + count, truth, l, place);
        }
    if (!count) return -1;
    threads_run(&b->crew, sample_task, samples, count);
    return sample_error(samples, count);
}

/* Fills truth; returns its tolerance, 0 where none can be had. */
static double find_truth(bench *b, envmap *truth, const work *w) {
    static const double tolerances[] = {1e-6, 1e-5, 1e-4};
    for (int i = 0; i < COUNT(tolerances); ++i) {
        envmap_result result;
        if (tolerances[i] > (double)w->tolerance / 5) break;
        result = run_work(b, truth, w, ENVMAP_METHOD_FAST, tolerances[i], THREADS, NULL);
        if (result == ENVMAP_OK) return tolerances[i];
        if (result != ENVMAP_CANCELLED) complain(b, w->name, envmap_result_text(result));
    }
    return 0;
}

/* ---------------------------------------------------------------------------------- >>timing -- */

/* The least time of `most` calls at the most, or as many as a second holds, in seconds. */
static double time_work(bench *b, envmap *dst, const work *w, int method, int threads, int most) {
    envmap_filter_desc desc = {0};
    double best = 1e30, spent = 0;
    desc.method = method, desc.tolerance = w->tolerance;
    if (threads > 1) desc.work.executor.user = &b->crew, desc.work.executor.run = threads_run;
    for (int i = 0; i < most && (i < 3 || spent < 1); ++i) {
        double t = measure_now();
        call_work(b, dst, w, &desc);
        t = measure_now() - t;
        spent += t;
        if (t < best) best = t;
    }
    return best;
}

/* ------------------------------------------------------------------------------------ >>rows -- */

typedef struct row {
    const work *work;
    int method;
    double ms, copies, rms, worst, truth, memory; /* negative: not known */
    int bands;
} row;

static const char *const method_name[] = {"auto", "reference", "hierarchical", "fast", "harmonics"};

/* "ok 30": the copies are within 30. */
static const char *verdict(char text[24], double copies, double limit) {
    text[0] = 0;
    if (limit > 0)
        snprintf(text, 24, "%s %.0f", copies >= 0 && copies <= limit ? "ok" : "over", limit);
    return text;
}

static const char *number(char text[24], const char *format, double value) {
    if (value < 0) snprintf(text, 24, "-");
    else snprintf(text, 24, format, value);
    return text;
}

static void print_head(void) {
    printf(
        "| %-10s | %-20s | %-14s | %-14s | %-6s | %-5s | %5s | %8s | %6s | %7s | %7s | %7s | %6s "
        "| %9s | %8s |\n",
        "scene", "work", "source", "result", "method", "tol", "bands", "ms", "copies", "rms",
        "worst", "truth", "memory", "bar", "aim");
    printf("|%.12s|%.22s|%.16s|%.16s|%.8s|%.7s|------:|%.9s:|%.7s:|%.8s:|%.8s:|%.8s:|%.7s:|%.11s|"
           "%.10s|\n",
           "------------", "----------------------", "----------------", "----------------",
           "--------", "-------", "---------", "-------", "--------", "--------", "--------",
           "-------", "-----------", "----------");
}

static void print_row(bench *b, const row *r) {
    const work *w = r->work;
    char from[32], to[32], t[8][24];
    shape_name(from, w->from), shape_name(to, w->to);
    printf("| %-10s | %-20s | %-14s | %-14s | %-6s | %-5.0e | %5d | %8s | %6s | %7s | %7s | %7s | "
           "%6s | %9s | %8s |\n",
           b->scene, w->name, from, to, method_name[r->method], (double)w->tolerance, r->bands,
           number(t[0], "%.2f", r->ms), number(t[1], "%.1f", r->copies),
           number(t[2], "%.1e", r->rms), number(t[3], "%.1e", r->worst),
           number(t[4], "%.1e", r->truth), number(t[5], "%.1f", r->memory),
           verdict(t[6], r->copies, w->bar * b->ease),
           verdict(t[7], r->copies, w->aim * (b->ease > 1 ? 1.5 : 1)));
    fflush(stdout);
    if (b->csv)
        fprintf(b->csv, "%s,\"%s\",%s,%s,%s,%g,%d,%.4f,%.3f,%.4g,%.4g,%.4g,%.3f,%g,%g\n", b->scene,
                w->name, from, to, method_name[r->method], (double)w->tolerance, r->bands, r->ms,
                r->copies, r->rms, r->worst, r->truth, r->memory, w->bar, w->aim);
}

static void count_row(bench *b, const row *r) {
    const work *w = r->work;
    int known = r->copies >= 0;
    ++b->rows;
    if (w->bar > 0) ++b->bars, b->bars_met += known && r->copies <= w->bar * b->ease;
    if (w->aim > 0)
        ++b->aims, b->aims_met += known && r->copies <= w->aim * (b->ease > 1 ? 1.5 : 1);
}

/* rms and worst over all levels. */
static void compare_levels(row *r, const envmap *a, const envmap *truth) {
    r->rms = r->worst = 0;
    for (int l = 0; l < r->work->levels; ++l) {
        envmap_difference d;
        if (envmap_compare(&d, a, truth, l)) d.rms = d.worst = 1e30;
        if (!(d.rms <= r->rms)) r->rms = d.rms;
        if (!(d.worst <= r->worst)) r->worst = d.worst;
    }
}

static int most_bands(const work *w) {
    int most = 0;
    for (int l = 0; l < w->levels && w->kind < RESAMPLE; ++l) {
        envmap_lobe lobe = work_lobe(w, l);
        for (int k = 0; k < w->slices; ++k) { /* of all slices that there are */
            double p = (double)lobe.p0 + (double)(lobe.p1 - lobe.p0) * (k + 0.5) / w->slices;
            int bands = envmap_sh_bands(&lobe, p, NULL, 0, (double)w->tolerance);
            if (bands > most) most = bands;
        }
    }
    return most;
}

/* All light of level `level` times solid angle, and times basis function Y of the nine. */
static double light(const envmap *map, int level, int Y) {
    double sum = 0, basis[9], d[3];
    for (int face = 0; face < envmap_faces(map->mapping); ++face)
        for (int y = 0; y < measure_height(map, level); ++y)
            for (int x = 0; x < measure_width(map, level); ++x) {
                const float *t = envmap_texel(map, level, 0, face, x, y);
                measure_direction(d, map, level, face, x, y);
                if (Y) envmap_sh_basis(basis, 3, d);
                sum +=
                    envmap_solid_angle(map, level, face, x, y) * (double)t[0] * (Y ? basis[Y] : 1);
            }
    return sum;
}

/* What is no filter keeps all light, to 1e-4; nine coefficients are those of plain sums, which take
   the centres of texels for their centroids. */
static void verify_light(bench *b, row *r, const envmap *dst) {
    double all = light(&b->source, 0, 0), most = 0;
    if (r->work->kind == NINE)
        for (int i = 1; i < 6; ++i)
            most = fmax(most, fabs((double)dst->texels[3 * i] - light(&b->source, 0, i)) / all);
    for (int l = 0; l < r->work->levels && r->work->kind != NINE; ++l)
        most = fmax(most, fabs(light(dst, l, 0) / all - 1));
    r->rms = most;
    if (!(most <= 1e-4)) complain(b, r->work->name, "light is lost, or won");
}

static void verify_row(bench *b, row *r, envmap *dst, envmap *truth) {
    const work *w = r->work;
    if (w->kind == BANKS && w->parameter > 0.9999f) return; /* its sums are the same at 1e-4 */
    if (w->kind >= RESAMPLE) {
        verify_light(b, r, dst);
        return;
    }
    double tolerance = find_truth(b, truth, w);
    if (!(tolerance > 0)) {
        r->worst = sample_truth(b, dst, w);
        if (r->worst < 0) complain(b, w->name, "out of patience with the truth: not verified");
        if (!(r->worst <= 20 * (double)w->tolerance))
            complain(b, w->name, "a sampled texel is off by too much");
        return;
    }
    r->truth = sample_truth(b, truth, w);
    if (!(r->truth <= 20 * tolerance)) complain(b, w->name, "the truth is not the plain sum");
    compare_levels(r, dst, truth);
    if (!(r->rms <= (double)w->tolerance)) complain(b, w->name, "the tolerance is not kept");
    if (!(r->worst <= 20 * (double)w->tolerance))
        complain(b, w->name, "a texel is off by too much");
}

/* Copies before and after, so that a neighbour's burst does not make the filter look good. */
static void time_row(bench *b, row *r, envmap *dst, double first) {
    double before = measure_copy(&b->source, dst, r->work->levels, measure_now);
    double t = first < 5 ? time_work(b, dst, r->work, r->method, 1, 20) : first;
    double after = measure_copy(&b->source, dst, r->work->levels, measure_now);
    double c = before < after ? before : after;
    r->ms = 1e3 * t;
    r->copies = c > 0 ? t / c : -1;
}

/* The first run verifies, the next ones are timed. Returns the milliseconds, -1 without. */
static double make_row(bench *b, const work *w, int method) {
    row r = {0};
    envmap dst = {0}, truth = {0};
    measure_meter m = {0, 0, NULL};
    r.bands = most_bands(w);
    r.work = w, r.method = method, r.ms = r.copies = r.rms = r.worst = r.truth = r.memory = -1;
    fprintf(stderr, "\r%-10s %-24s %-48s", b->scene, w->name, "");
    if (!make_source(b, w->from) ||
        envmap_create(&dst, w->to.mapping, w->to.size, w->levels, w->slices) ||
        envmap_create(&truth, w->to.mapping, w->to.size, w->levels, w->slices)) {
        complain(b, w->name, "out of memory");
    } else {
        if (w->kind == MIPS) memcpy(dst.texels, b->source.texels, measure_bytes(&b->source, 1));
        double start = measure_now();
        envmap_result result = run_work(b, &dst, w, method, (double)w->tolerance, 1, &m);
        start = measure_now() - start;
        r.memory = (double)m.most / (double)measure_bytes(&b->source, 1);
        if (result) complain(b, w->name, envmap_result_text(result));
        if (!result) verify_row(b, &r, &dst, &truth);
        if (!result) time_row(b, &r, &dst, start);
    }
    fprintf(stderr, "\r%-84s\r", "");
    print_row(b, &r);
    count_row(b, &r);
    envmap_free(&dst);
    envmap_free(&truth);
    return r.ms;
}

/* ---------------------------------------------------------------------------------- >>verify --
   The fast filter against the library's definition, into tiny results; and two threads. */

static void verify_small(bench *b, const work *w) {
    envmap dst = {0}, truth = {0};
    envmap_difference d;
    char from[32], to[32];
    envmap_result result = ENVMAP_ERROR_MEMORY;
    double exact = (double)w->tolerance > 1e-4 ? 1e-4 : 1e-6; /* or rings take minutes */
    fprintf(stderr, "\r%-10s %-24s %-48s", b->scene, w->name, "against the definition");
    if (make_source(b, w->from) && !envmap_create(&dst, w->to.mapping, w->to.size, 1, w->slices) &&
        !envmap_create(&truth, w->to.mapping, w->to.size, 1, w->slices) &&
        !(result = run_work(b, &truth, w, ENVMAP_METHOD_REFERENCE, exact, THREADS, NULL)) &&
        !(result = run_work(b, &dst, w, ENVMAP_METHOD_FAST, (double)w->tolerance, THREADS, NULL)))
        result = envmap_compare(&d, &dst, &truth, 0);
    fprintf(stderr, "\r%-84s\r", "");
    if (result) {
        complain(b, w->name, envmap_result_text(result));
    } else {
        int ok = d.rms <= 2 * (double)w->tolerance && d.worst <= 20 * (double)w->tolerance;
        printf("| %-10s | %-20s | %-14s | %-14s | %5.0e | %8.1e | %8.1e | %8.0e | %-4s |\n",
               b->scene, w->name, shape_name(from, w->from), shape_name(to, w->to),
               (double)w->tolerance, d.rms, d.worst, fabs(d.bias),
               ok ? d.rms > 0 ? "ok" : "same" : "FAIL");
        if (!ok) complain(b, w->name, "is not the definition");
    }
    fflush(stdout);
    envmap_free(&dst);
    envmap_free(&truth);
}

static void verify_head(void) {
    printf("The fast filter against the definition (every texel, in double), into tiny maps\n"
           "(same: the filter chose the definition):\n\n");
    printf("| %-10s | %-20s | %-14s | %-14s | %5s | %8s | %8s | %8s | %-4s |\n", "scene", "work",
           "source", "result", "tol", "rms", "worst", "|bias|", "");
    printf("|%.12s|%.22s|%.16s|%.16s|%.7s|%.9s:|%.9s:|%.9s:|%.6s|\n", "------------",
           "----------------------", "----------------", "----------------", "-------", "---------",
           "---------", "---------", "------");
}

/* The part of a call's processor time outside tasks, where it is least of several runs; *times: how
   much sooner two threads were done if it cost nothing to hand tasks over. */
static double share_work(bench *b, envmap *dst, const work *w, double *times) {
    double least = 2, clock = shares_now();
    for (int i = 0; i < 1000; ++i) (void)shares_now();
    clock = (shares_now() - clock) / 1001;
    for (int i = 0; i < 10; ++i) {
        shares s = {0, 0, 0, clock};
        envmap_filter_desc desc = {0};
        desc.method = ENVMAP_METHOD_FAST, desc.tolerance = w->tolerance;
        desc.work.executor.user = &s, desc.work.executor.run = shares_run;
        double t = shares_now();
        call_work(b, dst, w, &desc);
        t = shares_now() - t - s.clocks;
        if (1 - s.tasks / t < least) least = 1 - s.tasks / t, *times = t / (t - s.tasks + s.longer);
    }
    return least;
}

/* One thread and two, in turn, so that both see the same machine; `possible` is what that can do. */
static void thread_row(bench *b, const work *w, double possible) {
    envmap one = {0}, two = {0};
    double best[2] = {1e30, 1e30}, bar = 1.8, times = 0;
    if (make_source(b, w->from) &&
        !envmap_create(&one, w->to.mapping, w->to.size, w->levels, w->slices) &&
        !envmap_create(&two, w->to.mapping, w->to.size, w->levels, w->slices)) {
        for (int i = 0; i < 10; ++i)
            for (int k = 0; k < 2; ++k) {
                double t = time_work(b, k ? &two : &one, w, ENVMAP_METHOD_FAST, k + 1, 1);
                if (t < best[k]) best[k] = t;
            }
        int same = !memcmp(one.texels, two.texels, measure_bytes(&one, w->levels));
        double alone = share_work(b, &two, w, &times);
        same &= !memcmp(one.texels, two.texels, measure_bytes(&one, w->levels));
        printf("| %-10s | %-20s | %8.2f | %8.2f | %5.1f | %5.2f | %5.2f | %-5s %.1f | %-9s |\n",
               b->scene, w->name, 1e3 * best[0], 1e3 * best[1], 100 * alone, times,
               best[0] / best[1],
               best[0] >= bar * best[1] ? "ok"
               : possible < bar         ? "busy"
                                        : "under",
               bar, same ? "same bits" : "DIFFER");
        if (!same) complain(b, w->name, "two threads make other bits than one");
    }
    fflush(stdout);
    envmap_free(&one);
    envmap_free(&two);
}

/* What two threads can do on this machine at this moment: plain sums share nothing. */
static double thread_bound(bench *b) {
    sample samples[16];
    double best[2] = {1e30, 1e30};
    for (int i = 0; i < COUNT(samples); ++i) {
        const double axis[3] = {cos(i * MEASURE_PI / 8), 0, sin(i * MEASURE_PI / 8)};
        samples[i].b = b, samples[i].lobe = envmap_lobe_phong(100), samples[i].p = 0;
        memcpy(samples[i].axis, axis, sizeof axis);
    }
    for (int i = 0; i < 10; ++i)
        for (int k = 0; k < 2; ++k) {
            double t = measure_now();
            if (k) threads_run(&b->crew, sample_task, samples, COUNT(samples));
            for (int j = 0; !k && j < COUNT(samples); ++j) sample_task(samples, j);
            t = measure_now() - t;
            if (t < best[k]) best[k] = t;
        }
    printf("| %-10s | %-20s | %8.2f | %8.2f | %5s | %5s | %5.2f | %-9s | %-9s |\n", "(machine)",
           "16 plain sums", 1e3 * best[0], 1e3 * best[1], "", "", best[0] / best[1], "", "");
    return best[0] / best[1];
}

static void thread_rows(bench *b) {
    static const int rows[] = {1, 2, 3, 4, 5, 6, 10, 16, 19, 20, 21, 24, 26}; /* of figures */
    printf("\nOne thread and two; alone: per cent of processor time outside tasks, and what two\n"
           "threads could then reach, which other programs' load does not change:\n\n"
           "| %-10s | %-20s | %8s | %8s | %5s | %5s | %5s | %-9s | %-9s |\n",
           "scene", "work", "one, ms", "two, ms", "alone", "could", "times", "bar", "");
    printf("|%.12s|%.22s|%.9s:|%.9s:|%.6s:|%.6s:|%.6s:|%.11s|%.11s|\n", "------------",
           "----------------------", "---------", "---------", "------", "------", "------",
           "-----------", "-----------");
    double possible = thread_bound(b);
    for (int i = 0; i < (b->quick ? 5 : COUNT(rows)); ++i)
        thread_row(b, figures + rows[i], possible);
}

/* ---------------------------------------------------------------------------------- >>ratios --
   What a call adds to another one: a plan to its filter, a mirror to the chain below it. */

static double plan_time(bench *b, const work *w, const envmap *dst) {
    envmap_lobe lobe = work_lobe(w, 0);
    envmap_plan plan;
    double best = 1e30;
    for (int i = 0; i < 5; ++i) {
        double t = measure_now();
        if (envmap_filter_plan(&plan, dst, &b->source, &lobe, NULL)) return -1;
        t = measure_now() - t;
        if (t < best) best = t;
    }
    return best;
}

/* The levels below the mirror, as a chain of a map of their own. */
static double below_time(bench *b, const work *w) {
    envmap dst = {0};
    envmap_lobe lobes[9];
    double best = 1e30;
    for (int l = 1; l < w->levels; ++l) lobes[l - 1] = work_lobe(w, l);
    if (envmap_create(&dst, w->to.mapping, w->to.size / 2, w->levels - 1, 1)) return -1;
    for (int i = 0; i < 5; ++i) {
        double t = measure_now();
        if (envmap_filter_chain(&dst, &b->source, lobes, w->levels - 1, NULL)) best = -1;
        t = measure_now() - t;
        if (t < best) best = t;
    }
    envmap_free(&dst);
    return best;
}

static void ratio_row(bench *b, const work *w, int plan, double bar) {
    envmap dst = {0};
    if (!make_source(b, w->from) ||
        envmap_create(&dst, w->to.mapping, w->to.size, w->levels, w->slices))
        return;
    double whole = time_work(b, &dst, w, ENVMAP_METHOD_AUTO, 1, 5);
    double part = plan ? plan_time(b, w, &dst) : below_time(b, w);
    double ratio = plan ? part / whole : whole / part;
    printf("| %-10s | %-36s | %8.2f | %8.2f | %5.2f | %-4s %.2f |\n", b->scene,
           plan ? "plan over filter" : "chain with its mirror over without", 1e3 * part,
           1e3 * whole, ratio, ratio <= bar ? "ok" : "over", bar);
    envmap_free(&dst);
}

static void ratio_rows(bench *b) {
    printf("\nWhat a call adds to another:\n\n| %-10s | %-36s | %8s | %8s | %5s | %-9s |\n",
           "scene", "", "part, ms", "all, ms", "ratio", "bar");
    printf("|%.12s|%.38s|%.9s:|%.9s:|%.6s:|%.11s|\n", "------------",
           "----------------------------------------", "---------", "---------", "------",
           "-----------");
    ratio_row(b, figures + 1, 1, 0.7), ratio_row(b, figures + 5, 1, 0.7);
    ratio_row(b, figures + 2, 1, 0.7), ratio_row(b, figures + 21, 1, 0.7);
    ratio_row(b, figures + 4, 0, 1.15);
}

/* ---------------------------------------------------------------------------------- >>growth -- */

/* The slope from the first to the last that are known, on log-log. */
static double slope(const double *texels, const double *ms, int count) {
    int from = 0, to = count - 1;
    while (from < to && !(ms[from] > 0)) ++from;
    while (to > from && !(ms[to] > 0)) --to;
    return to > from ? log(ms[to] / ms[from]) / log(texels[to] / texels[from]) : 0;
}

static void grow(bench *b, int source) {
    static const int source_sizes[] = {64, 128, 256, 512, 1024};
    static const int result_sizes[] = {16, 32, 64, 128, 256, 512};
    const int *sizes = source ? source_sizes : result_sizes;
    growth *g = b->growth + source;
    g->count = source ? COUNT(source_sizes) : COUNT(result_sizes);
    printf("\nGrowth with the %s:\n\n", source ? "source" : "result");
    print_head();
    for (int i = 0; i < g->count; ++i) {
        work w = figures[1];
        w.bar = w.aim = 0;
        if (source) w.from.size = sizes[i];
        else w.to.size = sizes[i];
        g->texels[i] = 6.0 * sizes[i] * sizes[i];
        g->ms[i] = make_row(b, &w, ENVMAP_METHOD_FAST);
    }
    printf("\n%s texels x %.0f: time as texels to the power %.2f; over the last step %.2f\n",
           source ? "source" : "result", g->texels[g->count - 1] / g->texels[0],
           slope(g->texels, g->ms, g->count),
           slope(g->texels + g->count - 2, g->ms + g->count - 2, 2));
}

/* ------------------------------------------------------------------------------------ >>join --
   Two tables that --csv wrote, row by row. */

/* Splits a row before its last eight numbers, ms first; 0 where it has not so many. */
static int join_split(char *line, double numbers[8]) {
    for (int i = 7; i >= 0; --i) {
        char *comma = strrchr(line, ',');
        if (!comma || sscanf(comma + 1, "%lf", numbers + i) != 1) return 0;
        *comma = 0;
    }
    return 1;
}

/* The named columns as Markdown: commas within quotes stay. */
static void join_key(const char *key) {
    int quoted = 0;
    printf("| ");
    for (; *key; ++key) {
        if (*key == '"') quoted = !quoted;
        else if (*key == ',' && !quoted) printf(" | ");
        else putchar(*key);
    }
}

static int join_rows(FILE *a, FILE *b) {
    char one[512], two[512];
    double x[8], y[8], sum = 0, worst = 0;
    int rows = 0;
    printf("| scene | work | source | result | method | tol | bands | A, ms | B, ms | A, copies | "
           "B, copies | ratio |\n|--|--|--|--|--|--|--:|--:|--:|--:|--:|--:|\n");
    while (fgets(one, sizeof one, a) && fgets(two, sizeof two, b)) {
        if (!join_split(one, x) || !join_split(two, y)) continue; /* titles */
        if (strcmp(one, two)) return 0;
        if (!(x[1] > 0) || !(y[1] > 0)) continue;
        join_key(one);
        printf(" | %.2f | %.2f | %.1f | %.1f | %.2f |\n", x[0], y[0], x[1], y[1], y[1] / x[1]);
        sum += log(y[1] / x[1]), ++rows;
        if (y[1] / x[1] > worst) worst = y[1] / x[1];
    }
    if (rows) printf("\nB over A in copies: mean %.2f, at most %.2f\n", exp(sum / rows), worst);
    return rows > 0;
}

static int join(const char *first, const char *second) {
    FILE *a = fopen(first, "r"), *b = fopen(second, "r");
    int ok = a && b && join_rows(a, b);
    if (!ok) fprintf(stderr, "bench: %s and %s are not two runs of the same rows\n", first, second);
    if (a) fclose(a);
    if (b) fclose(b);
    return !ok;
}

/* ------------------------------------------------------------------------------------ >>main -- */

static void print_machine(void) {
    char cpu[128];
    measure_processor(cpu, sizeof cpu);
    printf("machine   %s\ncompiler  %s\nflags     %s\n", cpu, MEASURE_COMPILER, BENCH_FLAGS);
}

static int is_scene(const char *name) {
    for (int i = 0; i < (int)SCENE_COUNT; ++i)
        if (!strcmp(name, scene_name[i])) return 1;
    return 0;
}

static int options(bench *b, int argc, char **argv) {
    for (int i = 1; i < argc; ++i) {
        const char *value = i + 1 < argc ? argv[i + 1] : NULL;
        if (!strcmp(argv[i], "--quick")) {
            b->quick = 1;
            continue;
        }
        if (!value) return 0;
        if (!strcmp(argv[i], "--scene") && is_scene(value)) b->only = value;
        else if (!strcmp(argv[i], "--map") && b->map_count < COUNT(b->maps))
            b->maps[b->map_count++] = value;
        else if (!strcmp(argv[i], "--csv") && (b->csv = fopen(value, "w")) != NULL)
            fprintf(b->csv, "scene,work,source,result,method,tolerance,bands,ms,copies,rms,worst,"
                            "truth,memory,bar,aim\n");
        else return 0;
        ++i;
    }
    return 1;
}

/* Loads scene i and forgets the source of the last; 0 where it is not asked for. */
static int begin_scene(bench *b, int i) {
    if (!b->map_count && b->only && strcmp(b->only, scene_name[i])) return 0;
    if (b->quick && !b->only && !b->map_count && i == SCENE_STUDIO) return 0;
    envmap_free(&b->source);
    if (load_scene(b, i)) return 1;
    complain(b, "load", b->map_count ? b->maps[i] : "out of memory");
    return 0;
}

static void verify_scenes(bench *b, int scenes) {
    verify_head();
    for (int i = 0; i < scenes; ++i) {
        if (!begin_scene(b, i)) continue;
        for (int k = 0; k < (b->quick ? 2 : COUNT(small_works)); ++k)
            verify_small(b, small_works + k);
    }
}

static void time_scenes(bench *b, int scenes) {
    printf("\n");
    print_head();
    for (int i = 0; i < scenes; ++i) {
        if (!begin_scene(b, i)) continue;
        for (int k = 0; k < (b->quick ? QUICK : COUNT(figures)); ++k)
            make_row(b, figures + k, ENVMAP_METHOD_AUTO);
        for (int k = 0; k < (b->quick ? 0 : COUNT(others)); ++k)
            make_row(b, others + k, ENVMAP_METHOD_AUTO);
    }
}

static int finish(bench *b) {
    printf("\n%d rows; bars met %d of %d, aims %d of %d; verifications failed: %d\n", b->rows,
           b->bars_met, b->bars, b->aims_met, b->aims, b->failures);
    threads_end(&b->crew);
    envmap_free(&b->sky);
    envmap_free(&b->source);
    free(b->texels.at);
    if (b->csv && fclose(b->csv)) ++b->failures;
    return b->failures != 0;
}

int main(int argc, char **argv) {
    static bench b;
    if (argc == 4 && !strcmp(argv[1], "--join")) return join(argv[2], argv[3]);
    if (!options(&b, argc, argv)) {
        fprintf(stderr, "usage: bench [--quick] [--scene NAME] [--map FILE.pfm]... [--csv FILE]\n"
                        "       bench --join A.csv B.csv\n");
        return 2;
    }
    threads_begin(&b.crew, THREADS);
    b.ease = strstr(BENCH_FLAGS, "-march=native") ? 1 : 3;
    int scenes = b.map_count ? b.map_count : (int)SCENE_COUNT;
    print_machine();
    if (b.ease > 1) printf("without -march=native bars are 3 times as wide, aims 1.5 times\n");
    printf("\n");
    verify_scenes(&b, scenes);
    time_scenes(&b, scenes);
    if (b.sky.texels) { /* growth and threads on the last scene, which has the sun */
        thread_rows(&b);
        ratio_rows(&b);
        for (int source = 1; source >= 0 && !b.quick; --source) grow(&b, source);
    }
    return finish(&b);
}
