/* SPDX-License-Identifier: MIT
   What envmap.h promises, each promise held for one work. */
#ifndef SEARCH_PROMISES_H
#define SEARCH_PROMISES_H

#include "search_slow.h"

#include <time.h>

/* --------------------------------------------------------------------------------- promises -- */

#define PROMISES(X)                                                                                \
    X(PROMISE_OK, "what fits is not refused")                                                      \
    X(PROMISE_RMS, "rms is at most the tolerance")                                                 \
    X(PROMISE_WORST, "the worst texel is off by at most 20 tolerances")                            \
    X(PROMISE_SIGN, "light that is nowhere negative stays so")                                     \
    X(PROMISE_FINITE, "every number is finite, outside rims too")                                  \
    X(PROMISE_ALIKE, "slices of a lobe without p are alike, and the source is untouched")          \
    X(PROMISE_COST, "CPU time keeps to a bound per texel")                                         \
    X(PROMISE_CLIFF, "no lobe takes more than six times the time of its neighbours")               \
    X(PROMISE_MIRROR, "the mirror in a chain is what resampling makes")                            \
    X(PROMISE_FURNACE, "a constant environment stays itself to 1e-5")                              \
    X(PROMISE_BITS, "the bits are the same for any order of tasks")                                \
    X(PROMISE_ERROR, "what fails says why")                                                        \
    X(PROMISE_UNTOUCHED, "what fails leaves its output untouched, and no memory")                  \
    X(PROMISE_PLAN, "a plan's numbers are in range")                                               \
    X(PROMISE_CONTRAST, "a plan's contrast is the result's, to a tenth")                           \
    X(PROMISE_VALUE, "a lobe's value, integral and sigma are its formula's")                       \
    X(PROMISE_ZONAL, "zonal coefficients are the integrals of k P_l")                              \
    X(PROMISE_BANDS, "the bands needed are enough, and one fewer are not")                         \
    X(PROMISE_PROJECT, "coefficients are off by at most the tolerance")                            \
    X(PROMISE_EVALUATE, "a series is evaluated, and filled in, as it is written")                  \
    X(PROMISE_ROTATE, "a turned environment is the same one from turned directions")               \
    X(PROMISE_CONVOLVE, "convolving multiplies with zonal coefficients")                           \
    X(PROMISE_WINDOW, "what is windowed is nowhere negative, and keeps its mean")                  \
    X(PROMISE_IDENTITY, "resampling to the same shape copies; constants stay constants")           \
    X(PROMISE_RANGE, "resampling stays between the source's least and most")                       \
    X(PROMISE_MEAN, "resampling to coarser maps makes means of texels, to 5 %")                    \
    X(PROMISE_ENERGY, "resampling to coarser maps keeps the light, to 1 %, slivers' to 5 %")       \
    X(PROMISE_MIPS, "a level is the mean of the one above, weighted by overlap")                   \
    X(PROMISE_LOOKUP, "lookups are bilinear across every seam, pole and rim")                      \
    X(PROMISE_GEOMETRY, "directions, coordinates and solid angles are their formulas")

#define PROMISE_ENUM(name, text) name,
enum { PROMISES(PROMISE_ENUM) PROMISE_COUNT };
#define PROMISE_TEXT(name, text) text,
static const char *const promise_text[PROMISE_COUNT] = {PROMISES(PROMISE_TEXT)};

/* What one work showed of each promise: the value that broke its bound most, and value / bound, at
   most 1 where the promise holds, < 0 where it was not asked. */
typedef struct verdict {
    double over[PROMISE_COUNT], value[PROMISE_COUNT];
} verdict;

static verdict verdict_none(void) {
    verdict v;
    for (int i = 0; i < PROMISE_COUNT; ++i) v.over[i] = -1, v.value[i] = 0;
    return v;
}

/* value <= bound, or the promise is broken; NaN breaks it. */
static void hold(verdict *v, int promise, double value, double bound) {
    double over = value <= bound           ? (bound > 0 ? fmax(0, value / bound) : 0)
                  : bound > 0 && value > 0 ? value / bound
                                           : HUGE_VAL;
    if (over > v->over[promise]) v->over[promise] = over, v->value[promise] = value;
}

static int broken(const verdict *v, int promise) { return v->over[promise] > 1; }

/* ------------------------------------------------------- the calls, with what may change of them */

static double cpu_seconds(void) { return (double)clock() / CLOCKS_PER_SEC; }

enum { ORDER_FORWARD, ORDER_BACKWARD, ORDER_SHUFFLED };

/* Runs tasks in some order, and ends what takes longer than `limit` seconds of CPU time: as the
   progress callback it then cancels. */
typedef struct watch {
    double start, limit;
    int expired, order;
    int reports, cancel_at; /* progress: how often it was asked, and when it cancels (0: never) */
} watch;

static void watch_run(void *user, envmap_task *task, void *context, int count) {
    watch *w = (watch *)user;
    int step = 7919; /* a prime: coprime to counts that it does not divide */
    for (int i = 0; i < count; ++i) {
        int shuffled = count % step ? (int)((long long)i * step % count) : count - 1 - i;
        task(context, w->order == ORDER_FORWARD    ? i
                      : w->order == ORDER_BACKWARD ? count - 1 - i
                                                   : shuffled);
    }
    w->expired = cpu_seconds() - w->start > w->limit;
}

static int watch_report(void *user, float fraction) {
    watch *w = (watch *)user;
    (void)fraction;
    w->expired |= cpu_seconds() - w->start > w->limit;
    return w->expired || ++w->reports == w->cancel_at;
}

static watch watch_for(double seconds) {
    watch w;
    memset(&w, 0, sizeof w);
    w.start = cpu_seconds(), w.limit = seconds;
    return w;
}

/* The calls as they are today; what a change of the interface touches is here and nowhere else. */
static envmap_filter_desc call_desc(const work *w, watch *clock_watch) {
    envmap_filter_desc desc;
    memset(&desc, 0, sizeof desc);
    desc.method = w->method, desc.tolerance = (float)w->tolerance;
    desc.work.progress.user = desc.work.executor.user = clock_watch;
    desc.work.progress.report = watch_report, desc.work.executor.run = watch_run;
    return desc;
}

static envmap_result call_project(double *sh, int bands, const envmap *map, int slice,
                                  double tolerance, watch *clock_watch) {
    envmap_work how = {{clock_watch, watch_run}, {NULL, NULL}, NULL};
    return envmap_sh_project(sh, bands, map, slice, tolerance, &how);
}

static envmap_result call_fill(envmap *map, int slice, const double *sh, int bands,
                               double tolerance, watch *clock_watch) {
    envmap_work how = {{clock_watch, watch_run}, {NULL, NULL}, NULL};
    return envmap_sh_fill(map, 0, slice, sh, bands, tolerance, &how);
}

/* The fields of a plan that are checked. */
typedef struct call_planned {
    int method, size, bands, slices, lights;
    double contrast, nine, lookup, error;
} call_planned;

static envmap_result call_plan(call_planned *out, const envmap *dst, const envmap *src,
                               const envmap_lobe *lobe, const envmap_filter_desc *desc) {
    envmap_plan p;
    envmap_result result = envmap_filter_plan(&p, dst, src, lobe, desc);
    memset(out, 0, sizeof *out);
    if (result) return result;
    out->method = p.method, out->size = p.size, out->bands = p.bands, out->slices = p.slices;
    out->lights = p.lights, out->contrast = p.contrast, out->nine = p.nine;
    out->lookup = p.lookup, out->error = p.error;
    return result;
}

/* --------------------------------------------------------------------------------- a bench ---- */

/* A work with all that its checks need. */
typedef struct bench {
    const work *w;
    oracle_lobe lobe;
    envmap_lobe header_lobe;
    oracle_texel *src_texels, *dst_texels;
    envmap src, dst;
} bench;

static void bench_free(bench *b) {
    envmap_free(&b->src), envmap_free(&b->dst);
    free(b->src_texels), free(b->dst_texels), free(b->lobe.table);
}

static int bench_create(bench *b, const work *w) {
    memset(b, 0, sizeof *b);
    b->w = w, b->lobe = work_lobe(w);
    b->header_lobe = work_header_lobe(&b->lobe);
    b->src_texels = oracle_texels(w->src_mapping, w->src_size);
    b->dst_texels = oracle_texels(w->dst_mapping, w->dst_size);
    if (!b->src_texels || !b->dst_texels || (w->lobe == LOBE_TABLE && !b->lobe.table) ||
        !work_source(&b->src, w, b->src_texels))
        return 0;
    return envmap_create(&b->dst, (envmap_mapping)w->dst_mapping, w->dst_size,
                         envmap_levels(w->dst_size), w->dst_slices) == ENVMAP_OK;
}

/* ------------------------------------------------------------------------------- the judge ---- */

/* Sums over the texels that are looked at. */
typedef struct judge {
    double error, square, mean, worst, weight, brightest;
} judge;

static oracle_filter judge_filter(const bench *b, int slice, int slices) {
    oracle_filter f;
    const work *w = b->w;
    size_t count = oracle_count(w->src_mapping, w->src_size);
    memset(&f, 0, sizeof f);
    f.texels = b->src_texels, f.count = count, f.lobe = &b->lobe, f.fine = 1;
    f.image = oracle_image_of(b->src.texels + (w->src_slices > 1 ? 3 * count * (size_t)slice : 0),
                              w->src_mapping, w->src_size);
    f.p = oracle_p(&b->lobe, slice, slices), f.sigma = oracle_sigma(&b->lobe, f.p);
    f.extent = oracle_extent(w->src_mapping, w->src_size);
    oracle_support(&f.from, &f.to, &b->lobe, f.p);
    f.flank = oracle_flank(&f), f.sight = oracle_sight(&f);
    return f;
}

/* Floors for numbers that a float cannot hold. */
static const double judge_tiny = 1e-37;

/* What floats lose: 1e-6 of the mean, and 1.2e-7 of the brightest texel, counts for nothing. */
static void judge_texel(judge *j, const float *a, const double b[3], double w, double floor) {
    double off = 0, peak = floor;
    for (int c = 0; c < 3; ++c) {
        double e = fabs((double)a[c] - b[c]), lost = 1e-3 * floor + 1.2e-7 * j->brightest;
        j->error += w * pow(fmax(e - lost, 0), 2), j->square += w * b[c] * b[c],
            j->mean += w * fabs(b[c]) / 3;
        off = fmax(off, e), peak = fmax(peak, b[c]);
    }
    j->brightest = fmax(j->brightest, peak);
    off = fmax(off - 1e-3 * floor - 1.2e-7 * j->brightest, 0);
    j->weight += w, j->worst = fmax(j->worst, off / peak);
}

/* What the whole result says of its square and mean: as good as the truth's, when the result is
   good enough to be told from bad by them. */
static judge judge_whole(const float *a, const oracle_texel *texels, size_t count, int slices) {
    judge j = {0, 0, 0, 0, 0, 0};
    for (int slice = 0; slice < slices; ++slice)
        for (size_t i = 0; i < count; ++i, a += 3) {
            double b[3] = {(double)a[0], (double)a[1], (double)a[2]};
            if (texels[i].w > 0) judge_texel(&j, a, b, texels[i].w, judge_tiny);
        }
    return j;
}

/* Is this texel excepted from the promise of 20 tolerances? envmap.h: "Lobes with a kink (diffuse,
   Banks, GGX of large alpha) keep the tolerance in rms; beside a lamp on black their darkest texels
   may exceed 20 tolerances." To be removed with that sentence. */
static int judge_excepts(const work *w, const double b[3], double mean) {
    int black = w->scene >= SCENE_TEXEL && w->scene != SCENE_CHECKER;
    return black && work_lobe_kinked(w) && fmax(b[0], fmax(b[1], b[2])) < 0.1 * mean;
}

/* The truth of one texel. Where the bilinear radiance counts and the result seems off, it is summed
   again, 8 and then 16 times as fine, and where texels are few 64 times. By how much the last two
   differ is not known any better, beside a lat-long's pole most: no result is off by that. */
static void judge_axis(double rgb[3], oracle_filter *f, const double axis[3], const float *a,
                       double mean, double tolerance) {
    oracle_axis(rgb, f, axis);
    int finest = f->count < 200 ? 64 : 16;
    double before[3] = {0, 0, 0};
    while (f->sigma < 1.5 * f->extent && f->fine < finest) {
        double off = 0, peak = 1e-3 * mean;
        for (int c = 0; c < 3; ++c)
            off = fmax(off, fabs((double)a[c] - rgb[c])), peak = fmax(peak, fabs(rgb[c]));
        if (off < 0.3 * tolerance * fmin(fmax(mean, peak), 20 * peak)) break;
        f->fine = f->fine < 8 ? 8 : f->fine < 16 ? 16 : 64;
        memcpy(before, rgb, sizeof before);
        oracle_axis(rgb, f, axis);
    }
    for (int c = 0; c < 3 && f->fine >= finest; ++c) {
        double known = fabs(rgb[c] - before[c]);
        rgb[c] += oracle_clamp((double)a[c] - rgb[c], -known, known);
    }
    f->fine = 1;
}

/* A step through n things that is coprime to n, so that whatever is looked at first lies all over. */
static size_t judge_stride(size_t n) {
    size_t step = (size_t)(0.618034 * (double)n) | 1, a = n, b = step;
    while (b) {
        size_t rest = a % b;
        a = b, b = rest;
        if (!b && a > 1) a = n, b = step += 2;
    }
    return step;
}

/* What few texels are promised relative to: the filtered scene over the whole sphere, whose light
   they may miss. By Parseval its mean square is sum_l lambda_l^2 |a_l|^2 / 4 pi; the first bands. */
static judge judge_scene(const bench *b, int slices) {
    enum { BANDS = 96 };
    static double sh[3 * BANDS * BANDS];
    double lambda[BANDS], square, size;
    judge j = {0, 0, 0, 0, 1, 0};
    for (int slice = 0; slice < slices; ++slice) {
        double norm = oracle_norm(&b->lobe);
        if ((!slice || b->w->src_slices > 1) &&
            envmap_sh_project(sh, BANDS, &b->src, b->w->src_slices > 1 ? slice : 0, 1e-2, NULL))
            return j;
        oracle_zonal(lambda, &square, &size, BANDS, &b->lobe, oracle_p(&b->lobe, slice, slices));
        if (!(norm > 0)) norm = lambda[0];
        j.mean += fabs(lambda[0] / norm) * (sh[0] + sh[1] + sh[2]) / 3 / sqrt(4 * PI) / slices;
        for (int i = 0; i < 3 * BANDS * BANDS; ++i) {
            double a = lambda[(int)sqrt(i / 3 + 0.5)] / norm * sh[i];
            j.square += a * a / (4 * PI) / slices;
        }
    }
    return j;
}

/* May a result's texels miss the scene's light? They are few, or their lobes leave room between. */
static int judge_few(const bench *b, int size, int slices) {
    double sigma = HUGE_VAL;
    for (int i = 0; i < slices; ++i)
        sigma = fmin(sigma, oracle_sigma(&b->lobe, oracle_p(&b->lobe, i, slices)));
    return size < 6 || sigma < oracle_extent(b->w->dst_mapping, size);
}

/* Level 0 of a result, all slices, against the definition, in tolerances: rms in error, worst in
   worst. After `seconds` what was looked at has to stand for all. */
static judge judge_map(const bench *b, const float *a, int size, int slices, double seconds) {
    const work *w = b->w;
    oracle_texel *texels =
        size == w->dst_size ? b->dst_texels : oracle_texels(w->dst_mapping, size);
    size_t count = oracle_count(w->dst_mapping, size), all = count * (size_t)slices;
    judge whole = judge_whole(a, texels, count, slices), j = {0, 0, 0, 0, 0, 0};
    int few = judge_few(b, size, slices);
    if (few) {
        judge scene = judge_scene(b, slices);
        whole.mean = fmax(whole.mean, whole.weight * scene.mean);
        whole.square = fmax(whole.square, whole.weight * scene.square);
    }
    double mean = whole.mean / whole.weight, start = cpu_seconds();
    size_t step = judge_stride(all), looked = 0;
    oracle_filter filters[32];
    j.brightest = whole.brightest;
    for (int slice = 0; slice < slices; ++slice) filters[slice] = judge_filter(b, slice, slices);
    for (; looked < all && cpu_seconds() - start < (looked < 60 ? 4 : 1) * seconds; ++looked) {
        size_t at = (size_t)((unsigned long long)looked * step % all);
        double axis[3], rgb[3], worst = j.worst;
        if (!(texels[at % count].w > 0)) continue;
        oracle_axis_of(axis, w->dst_mapping, size, texels + at % count);
        judge_axis(rgb, filters + at / count, axis, a + 3 * at, mean, w->tolerance);
        judge_texel(&j, a + 3 * at, rgb, texels[at % count].w, 1e-3 * mean + judge_tiny);
        if (judge_excepts(w, rgb, mean)) j.worst = worst;
    }
    if (looked < all || few) j.square = whole.square * j.weight / whole.weight;
    j.error = sqrt(j.error / (j.square + j.weight * judge_tiny * judge_tiny)) / w->tolerance;
    j.worst /= w->tolerance;
    if (size != w->dst_size) free(texels);
    return j;
}

/* Seconds of sums that a result may take; where it seems bad, it is looked at for much longer. */
static double judge_budget = 0.2;

/* n texels are a sample of the sphere that the tolerance is of: three standard deviations of the
   mean square of n normal errors. */
static double judge_sample(double n) { return sqrt(1 + 3 * sqrt(2 / n)); }

static void judge_hold(verdict *v, const bench *b, const float *a, int size, int slices) {
    double n = (double)oracle_count(b->w->dst_mapping, size) * slices;
    judge j = judge_map(b, a, size, slices, judge_budget);
    if (j.error > 1 || j.worst > 20) j = judge_map(b, a, size, slices, 8 * judge_budget);
    double rows = work_rows_off(b->w, &b->lobe, oracle_p(&b->lobe, 0, slices)) / b->w->tolerance;
    hold(v, PROMISE_RMS, j.error, 1.0001 * (size < 6 ? judge_sample(n) : 1) + rows);
    if (work_lobe_positive(b->w->lobe)) hold(v, PROMISE_WORST, j.worst, 20 + 20 * rows);
}

/* ------------------------------------------------------------------------------- the checks ---- */

/* Numbers of a result that are not finite, and (where light cannot turn negative) below zero. */
static void check_numbers(verdict *v, const work *w, const float *a, size_t floats) {
    double negative = 0, most = 0, bad = 0;
    for (size_t i = 0; i < floats; ++i) {
        double value = (double)a[i];
        bad += !(fabs(value) < HUGE_VAL);
        negative = fmax(negative, -value), most = fmax(most, value);
    }
    hold(v, PROMISE_FINITE, bad, 0);
    if (work_lobe_positive(w->lobe)) hold(v, PROMISE_SIGN, negative > 0 ? negative / most : 0, 0);
}

/* Calls are cancelled at 1.2 times their bound, and this: more where a program is instrumented. */
static double check_patience = 1;

/* The filter of one lobe, or a chain of them; 0 when that failed or took too long, which v says. */
static int check_chain_call(verdict *v, bench *b, const envmap_lobe *lobes, int count,
                            const envmap_prepared *prepared) {
    int reference = b->w->method == ENVMAP_METHOD_REFERENCE;
    int slow;
    double allowed = work_allowed_seconds(b->w, &slow) * count;
    watch clock_watch = watch_for(reference ? 5 : check_patience * fmax(0.3, 1.2 * allowed));
    envmap_filter_desc desc = call_desc(b->w, &clock_watch);
    desc.prepared = prepared;
    envmap_result result = envmap_filter_chain(&b->dst, &b->src, lobes, count, &desc);
    if (!reference) hold(v, PROMISE_COST, cpu_seconds() - clock_watch.start, allowed);
    if (clock_watch.expired) return 0;
    hold(v, PROMISE_OK, result, 0);
    return result == ENVMAP_OK;
}

static int check_call(verdict *v, bench *b) {
    return check_chain_call(v, b, &b->header_lobe, 1, NULL);
}

static size_t bench_floats(const bench *b) {
    return oracle_floats(b->w->dst_mapping, b->w->dst_size, b->w->dst_slices, 0);
}

/* Are all slices of the result the same map? */
static int bench_alike(const bench *b) {
    return !work_has_slices(b->w->lobe) && b->w->src_slices == 1;
}

static void check_result(verdict *v, bench *b) {
    size_t floats = bench_floats(b), slice = floats / (size_t)b->w->dst_slices;
    int different = 0;
    check_numbers(v, b->w, b->dst.texels, floats);
    for (int k = 1; bench_alike(b) && k < b->w->dst_slices; ++k)
        different |=
            memcmp(b->dst.texels, b->dst.texels + slice * (size_t)k, slice * sizeof(float)) != 0;
    different |= b->dst.p0 != b->header_lobe.p0 || b->dst.p1 != b->header_lobe.p1;
    hold(v, PROMISE_ALIKE, different, 0);
    judge_hold(v, b, b->dst.texels, b->w->dst_size, bench_alike(b) ? 1 : b->w->dst_slices);
}

static void check_filter(verdict *v, bench *b) {
    if (check_call(v, b)) check_result(v, b);
}

/* ------------------------------------------------------------------ checks of filtering calls ---- */

/* The lobe of level i: wider from level to level. */
static oracle_lobe chain_lobe(const oracle_lobe *lobe, int i) {
    oracle_lobe m = *lobe;
    if (m.kind == LOBE_PHONG || m.kind == LOBE_GAUSSIAN) m.a = (double)(float)(m.a / pow(3, i));
    if (m.kind == LOBE_GGX) m.a = (double)(float)fmin(1, m.a * pow(1.7, i));
    return m;
}

/* Three levels at most, every one held against the definition; with an odd seed the first is the
   mirror, and then it is what resampling makes. */
static void check_chain(verdict *v, bench *b) {
    int count = b->dst.levels < 3 ? b->dst.levels : 3, mirror = (int)(b->w->seed & 1), at = 0;
    oracle_lobe models[3], first = b->lobe;
    envmap_lobe lobes[3] = {b->header_lobe, b->header_lobe, b->header_lobe};
    envmap resampled = b->dst;
    for (int i = 0; i < count; ++i) {
        models[i] = chain_lobe(&b->lobe, i), lobes[i] = work_header_lobe(models + i);
        if (mirror && !i) lobes[0] = envmap_lobe_mirror();
    }
    if (!check_chain_call(v, b, lobes, count, NULL)) return;
    for (int i = 0; i < count; ++i) {
        int edge = oracle_edge(b->w->dst_size, i), slices = b->w->dst_slices;
        size_t floats = oracle_floats(b->w->dst_mapping, edge, slices, 0);
        float *level = envmap_texel(&b->dst, i, 0, 0, 0, 0);
        check_numbers(v, b->w, level, floats);
        b->lobe = models[i];
        if (i || !mirror) judge_hold(v, b, level, edge, bench_alike(b) ? 1 : slices);
    }
    b->lobe = first;
    if (!mirror) return;
    memset(&resampled, 0, sizeof resampled);
    at = envmap_create(&resampled, (envmap_mapping)b->w->dst_mapping, b->w->dst_size, 1,
                       b->w->dst_slices) ||
         envmap_resample(&resampled, &b->src, NULL) ||
         memcmp(resampled.texels, b->dst.texels, bench_floats(b) * sizeof(float));
    hold(v, PROMISE_MIRROR, at, 0);
    envmap_free(&resampled);
}

static void check_prepared(verdict *v, bench *b) {
    envmap_prepared prepared;
    watch clock_watch = watch_for(2);
    envmap_filter_desc desc = call_desc(b->w, &clock_watch);
    memset(&prepared, 0, sizeof prepared);
    if (b->w->src_slices > 1) return;
    envmap_result result = envmap_prepare(&prepared, &b->src, &b->header_lobe, 1, &desc);
    if (!clock_watch.expired) hold(v, PROMISE_OK, result, 0);
    if (!result && check_chain_call(v, b, &b->header_lobe, 1, &prepared)) check_result(v, b);
    envmap_prepared_free(&prepared);
}

/* A constant environment stays itself, for every lobe that is divided by its own sum; Banks' slices
   have their own brightness. */
static void check_furnace(verdict *v, bench *b) {
    size_t n = 3 * oracle_count(b->w->src_mapping, b->w->src_size) * (size_t)b->w->src_slices;
    float light = (float)(0.7 * b->w->times);
    double worst = 0;
    for (size_t i = 0; i < n; ++i) b->src.texels[i] = light;
    if (b->w->seed & 1) b->src.texels[n / 2] = nextafterf(light, 0); /* else there is no filter */
    b->lobe.raw = b->header_lobe.raw = 0;
    if (!check_call(v, b)) return;
    if (b->w->lobe == LOBE_BANKS) {
        check_result(v, b);
        return;
    }
    for (size_t i = 0; i < bench_floats(b); ++i) {
        double off = fabs((double)b->dst.texels[i] / (double)light - 1);
        if (!(off <= worst)) worst = off;
    }
    hold(v, PROMISE_FURNACE, worst, 1e-5);
}

/* The same bits whatever order tasks run in: the filter, coefficients, and a map of them. */
static void check_executors(verdict *v, bench *b) {
    size_t floats = bench_floats(b);
    float *first = (float *)malloc(2 * floats * sizeof(float));
    double sh[2][3 * 9];
    watch clock_watch = watch_for(1);
    envmap_filter_desc desc = call_desc(b->w, &clock_watch);
    for (int order = ORDER_FORWARD; first && order <= ORDER_SHUFFLED; ++order) {
        double *to = sh[order != ORDER_FORWARD];
        clock_watch.order = order;
        envmap_result result = envmap_filter(&b->dst, &b->src, &b->header_lobe, &desc);
        if (clock_watch.expired) break;
        hold(v, PROMISE_OK, result, 0);
        if (order == ORDER_FORWARD) memcpy(first, b->dst.texels, floats * sizeof(float));
        hold(v, PROMISE_BITS, memcmp(first, b->dst.texels, floats * sizeof(float)) != 0, 0);
        result =
            call_project(to, 3, &b->src, 0, b->w->seed & 1 ? b->w->tolerance : 0, &clock_watch);
        if (!result) result = call_fill(&b->dst, 0, to, 3, b->w->tolerance, &clock_watch);
        if (clock_watch.expired) break;
        hold(v, PROMISE_OK, b->w->times <= 1 ? (int)result : 0, 0);
        if (order == ORDER_FORWARD) memcpy(first + floats, b->dst.texels, floats * sizeof(float));
        else hold(v, PROMISE_BITS, memcmp(sh[0], sh[1], sizeof sh[0]) != 0, 0);
        hold(v, PROMISE_BITS, memcmp(first + floats, b->dst.texels, floats * sizeof(float)) != 0,
             0);
    }
    free(first);
}

/* Fills the result with a number that no filter makes; is it still there? */
static int dst_untouched(const envmap *dst, const envmap *before) {
    size_t n = oracle_floats(dst->mapping, dst->size, dst->slices, 0);
    int same = !memcmp(dst, before, sizeof *dst);
    for (size_t i = 0; i < n; ++i) same &= dst->texels[i] <= -7 && dst->texels[i] >= -7;
    return same;
}

/* One thing is made to go wrong; what is expected then. */
static envmap_result break_something(bench *b, int what, envmap_lobe *lobe, watch *clock_watch) {
    unsigned long long state = b->w->seed;
    size_t n = oracle_count(b->w->src_mapping, b->w->src_size) * 3;
    size_t at = (size_t)(test_random(&state) * (double)n);
    int count;
    switch (what) {
    case 0: b->src.texels[at] = (float)NAN; return ENVMAP_ERROR_RADIANCE;
    case 1: b->src.texels[at] = (float)INFINITY; return ENVMAP_ERROR_RADIANCE;
    case 2:
        b->src.texels[at] = -1;
        return b->w->method == ENVMAP_METHOD_REFERENCE ? ENVMAP_OK : ENVMAP_ERROR_RADIANCE;
    case 3: lobe->parameter = (float)NAN; return ENVMAP_ERROR_LOBE;
    case 4: lobe->kind = 77; return ENVMAP_ERROR_LOBE;
    case 5:
        count = oracle_calls, oracle_calls = 0;
        oracle_fail_at = (int)(test_random(&state) * count);
        return ENVMAP_ERROR_MEMORY;
    default:
        clock_watch->cancel_at = 1 + (int)(test_random(&state) * clock_watch->reports);
        clock_watch->reports = 0;
        return ENVMAP_CANCELLED;
    }
}

/* Each call that fails says why, leaves the result as it was, and gives all memory back. */
static void check_failures(verdict *v, bench *b) {
    int what = (int)(b->w->seed % 7);
    watch clock_watch = watch_for(0.5);
    envmap_filter_desc desc = call_desc(b->w, &clock_watch);
    envmap_lobe lobe = b->header_lobe;
    oracle_calls = 0;
    if (envmap_filter(&b->dst, &b->src, &lobe, &desc)) return; /* is another check's business */
    for (size_t i = 0; i < bench_floats(b); ++i) b->dst.texels[i] = -7;
    b->dst.p0 = -3;
    envmap before = b->dst;
    int live = oracle_live;
    envmap_result expected = break_something(b, what, &lobe, &clock_watch);
    envmap_result result = envmap_filter(&b->dst, &b->src, &lobe, &desc);
    oracle_fail_at = -1;
    if (clock_watch.expired) return;
    hold(v, PROMISE_ERROR, result != expected, 0);
    hold(v, PROMISE_UNTOUCHED, oracle_live != live, 0);
    if (result) hold(v, PROMISE_UNTOUCHED, !dst_untouched(&b->dst, &before), 0);
}

/* Seconds of the filter with its lobe's number changed by a factor. */
static double neighbour_seconds(bench *b, double factor, double limit) {
    work w = *b->w;
    double best = HUGE_VAL; /* of two */
    w.a = (double)(float)(w.a * factor);
    if (w.lobe == LOBE_GGX) w.a = oracle_clamp(w.a, 1e-4, 1);
    if (w.lobe == LOBE_BANKS) w.a = 1 - (1 - b->w->a) * factor;
    oracle_lobe m = work_lobe(&w);
    envmap_lobe lobe = work_header_lobe(&m);
    for (int i = 0; i < 2; ++i) {
        watch clock_watch = watch_for(limit);
        envmap_filter_desc desc = call_desc(&w, &clock_watch);
        envmap_filter(&b->dst, &b->src, &lobe, &desc);
        best = fmin(best, cpu_seconds() - clock_watch.start);
    }
    free(m.table);
    return best;
}

/* No lobe takes more than six times what the slightly wider one and the slightly sharper one take,
   and 30 ms a slice; 20 times, where envmap.h says that it is slow. */
static void check_neighbours(verdict *v, bench *b) {
    if (b->w->method == ENVMAP_METHOD_REFERENCE || b->w->a >= 1e5) return;
    if (!(b->w->lobe >= LOBE_PHONG && b->w->lobe <= LOBE_BANKS) ||
        (b->w->lobe == LOBE_BANKS && b->w->a < 0.3))
        return;
    int slow;
    double limit = fmin(1, 2 * work_allowed_seconds(b->w, &slow));
    double here = neighbour_seconds(b, 1, limit), more = neighbour_seconds(b, 1.25, limit);
    double less = neighbour_seconds(b, 0.8, limit);
    hold(v, PROMISE_CLIFF, fmax(here, fmax(more, less)),
         (slow ? 20 : 6) * fmin(here, fmin(more, less)) + 0.03 * b->w->dst_slices);
}

/* The contrast of level 0 of slice 0: its rms about its mean, over its mean, all channels; 0 where
   all is black. */
static double plan_contrast(const bench *b) {
    size_t n = oracle_count(b->w->dst_mapping, b->w->dst_size);
    double sum = 0, square = 0;
    for (int c = 0; c < 3; ++c) {
        double first = 0, weight = 0;
        for (size_t i = 0; i < n; ++i) {
            double value = (double)b->dst.texels[3 * i + (size_t)c], w = b->dst_texels[i].w;
            first += w * value, weight += w, sum += w * value * value / (4 * PI);
        }
        first /= weight, square += first * first;
    }
    return square > 0 ? sqrt(fmax(0, sum - square) / square) : 0;
}

/* A plan names a method and numbers in their ranges, whenever the filter works; its contrast is that
   of the result, to a tenth, where the result's texels are fine enough to show it. */
static void check_plan(verdict *v, bench *b) {
    watch clock_watch = watch_for(2);
    envmap_filter_desc desc = call_desc(b->w, &clock_watch);
    call_planned p;
    envmap_result planned = call_plan(&p, &b->dst, &b->src, &b->header_lobe, &desc);
    if (clock_watch.expired) return;
    hold(v, PROMISE_OK, planned, 0);
    int fits = p.method >= 0 && p.method < ENVMAP_METHOD_COUNT && p.size >= 1 && p.size <= 16384 &&
               p.bands >= 1 && p.bands <= 768 && p.slices >= 1 && p.slices <= 4096 &&
               p.lights >= 0 && p.contrast >= 0 && p.nine >= 0 && p.lookup >= 0 && p.error >= 0;
    if (!planned) hold(v, PROMISE_PLAN, !fits, 0);
    if (planned || b->w->dst_size < 24 || b->w->dst_slices > 1 || !check_call(v, b)) return;
    if (oracle_sigma(&b->lobe, 0) < 4 * oracle_extent(b->w->dst_mapping, b->w->dst_size)) return;
    double contrast = plan_contrast(b);
    hold(v, PROMISE_CONTRAST, fabs(p.contrast - contrast), 0.1 * contrast + 0.01);
}

#endif
