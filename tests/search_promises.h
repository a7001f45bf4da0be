/* SPDX-License-Identifier: MIT
   What envmap.h promises, each promise held for one work, and the table of what is known to break
   today. */
#ifndef SEARCH_PROMISES_H
#define SEARCH_PROMISES_H

#include "search_works.h"

#include <time.h>

/* --------------------------------------------------------------------------------- promises -- */

#define PROMISES(X)                                                                                \
    X(PROMISE_OK, "what fits is not refused")                                                      \
    X(PROMISE_RMS, "rms is at most the tolerance")                                                 \
    X(PROMISE_WORST, "the worst texel is off by at most 20 tolerances")                            \
    X(PROMISE_SIGN, "light that is nowhere negative stays so")                                     \
    X(PROMISE_FINITE, "every number is finite, outside rims too")                                  \
    X(PROMISE_ALIKE, "slices of a lobe without p are alike, and the source is untouched")          \
    X(PROMISE_COST, "CPU time keeps to a bound per texel")

#define PROMISE_ENUM(name, text) name,
enum { PROMISES(PROMISE_ENUM) PROMISE_COUNT };
#define PROMISE_TEXT(name, text) text,
static const char *const promise_text[PROMISE_COUNT] = {PROMISES(PROMISE_TEXT)};

/* What one work showed: value / bound per promise, at most 1 where it holds, < 0 where not asked. */
typedef struct verdict {
    double over[PROMISE_COUNT];
} verdict;

static verdict verdict_none(void) {
    verdict v;
    for (int i = 0; i < PROMISE_COUNT; ++i) v.over[i] = -1;
    return v;
}

/* value <= bound, or the promise is broken; NaN breaks it. */
static void hold(verdict *v, int promise, double value, double bound) {
    double over = value <= bound ? (bound > 0 ? fmax(0, value / bound) : 0)
                                 : bound > 0 && value > 0 ? value / bound : HUGE_VAL;
    if (over > v->over[promise]) v->over[promise] = over;
}

static int broken(const verdict *v, int promise) { return v->over[promise] > 1; }

/* ------------------------------------------------------- the calls, with what may change of them */

/* Ends what takes longer than `limit` seconds of CPU time: as an executor it leaves the remaining
   tasks out, and as the progress callback, which is asked more seldom, it then cancels. */
typedef struct watch {
    double start, limit;
    int expired;
} watch;

static double cpu_seconds(void) { return (double)clock() / CLOCKS_PER_SEC; }

static void watch_run(void *user, envmap_task *task, void *context, int count) {
    watch *w = (watch *)user;
    for (int i = 0; i < count && !w->expired; ++i) {
        task(context, i);
        w->expired = cpu_seconds() - w->start > w->limit;
    }
}

static int watch_report(void *user, float fraction) {
    watch *w = (watch *)user;
    (void)fraction;
    w->expired |= cpu_seconds() - w->start > w->limit;
    return w->expired;
}

static envmap_filter_desc call_desc(const work *w, watch *clock_watch) {
    envmap_filter_desc desc;
    memset(&desc, 0, sizeof desc);
    desc.method = w->method, desc.tolerance = (float)w->tolerance;
    if (clock_watch) {
        clock_watch->start = cpu_seconds(), clock_watch->expired = 0;
        desc.progress.user = clock_watch, desc.progress.report = watch_report;
        desc.executor.user = clock_watch, desc.executor.run = watch_run;
    }
    return desc;
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
    double error, square, mean, worst, weight;
} judge;

/* Seconds that one axis of the definition takes, roughly. */
static double judge_seconds(const oracle_filter *f) {
    double reach = fmin(f->to, fmax(12 * f->extent, 8 * f->sigma)) / f->extent;
    double k = f->lobe->kind == LOBE_TABLE ? 8e-8 : f->lobe->kind > LOBE_TABLE ? 5e-8 : 2e-8;
    double seconds = (double)f->count * k;
    if (f->sigma < 2 * f->extent) seconds += 10e-6 * PI * reach * reach * f->fine;
    return seconds;
}

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
    return f;
}

/* Floors for numbers that a float cannot hold. */
static const double judge_tiny = 1e-37;

static void judge_texel(judge *j, const float *a, const double b[3], double w, double floor) {
    double off = 0, peak = floor;
    for (int c = 0; c < 3; ++c) {
        double e = fabs((double)a[c] - b[c]);
        j->error += w * e * e, j->square += w * b[c] * b[c], j->mean += w * fabs(b[c]) / 3;
        off = fmax(off, e), peak = fmax(peak, b[c]);
    }
    j->weight += w, j->worst = fmax(j->worst, off / peak);
}

/* What the whole result says of its square and mean: as good as the truth's, when the result is
   good enough to be told from bad by them. */
static judge judge_whole(const float *a, const oracle_texel *texels, size_t count, int slices) {
    judge j = {0, 0, 0, 0, 0};
    for (int slice = 0; slice < slices; ++slice)
        for (size_t i = 0; i < count; ++i, a += 3) {
            double b[3] = {(double)a[0], (double)a[1], (double)a[2]};
            if (texels[i].w > 0) judge_texel(&j, a, b, texels[i].w, 1);
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

/* Level 0 of a result, all slices, against the definition, in tolerances: rms in error, worst in
   worst. At most `seconds` of sums: then random texels stand for all. */
static judge judge_map(const bench *b, const float *a, int size, int slices, double seconds) {
    const work *w = b->w;
    unsigned long long state = w->seed;
    oracle_texel *texels =
        size == w->dst_size ? b->dst_texels : oracle_texels(w->dst_mapping, size);
    size_t count = oracle_count(w->dst_mapping, size), all = count * (size_t)slices, looked = all;
    judge whole = judge_whole(a, texels, count, slices), j = {0, 0, 0, 0, 0};
    double mean = whole.mean / whole.weight, one = 0;
    int last = -1;
    oracle_filter f;
    for (int slice = 0; slice < slices; ++slice) {
        f = judge_filter(b, slice, slices);
        one += judge_seconds(&f) / slices;
    }
    if (seconds / one < (double)all) looked = (size_t)fmax(60, seconds / one);
    if (looked > all) looked = all;
    for (size_t n = 0; n < looked; ++n) {
        size_t stratum = (size_t)(((double)n + test_random(&state)) * ((double)all / (double)looked));
        size_t at = looked == all ? n : stratum < all ? stratum : all - 1;
        double axis[3], rgb[3];
        if (!(texels[at % count].w > 0)) continue;
        if ((int)(at / count) != last) f = judge_filter(b, last = (int)(at / count), slices);
        oracle_axis_of(axis, w->dst_mapping, size, texels + at % count);
        oracle_axis(rgb, &f, axis);
        double worst = j.worst;
        judge_texel(&j, a + 3 * at, rgb, texels[at % count].w, 1e-3 * mean + judge_tiny);
        if (judge_excepts(w, rgb, mean)) j.worst = worst;
    }
    if (looked < all) j.square = whole.square * j.weight / whole.weight;
    j.error = sqrt(j.error / (j.square + j.weight * judge_tiny * judge_tiny)) / w->tolerance;
    j.worst /= w->tolerance;
    if (size != w->dst_size) free(texels);
    return j;
}

static void judge_hold(verdict *v, const bench *b, const float *a, int size, int slices) {
    judge j = judge_map(b, a, size, slices, 0.3);
    if (j.error > 1 || j.worst > 20) j = judge_map(b, a, size, slices, 2); /* more of them */
    hold(v, PROMISE_RMS, j.error, 1.0001);
    if (work_lobe_positive(b->w->lobe)) hold(v, PROMISE_WORST, j.worst, 20);
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
    if (work_lobe_positive(w->lobe)) hold(v, PROMISE_SIGN, negative, 0);
}

static double check_allowed_seconds(const work *w) {
    double src = (double)oracle_count(w->src_mapping, w->src_size) * w->src_slices;
    double dst = (double)oracle_count(w->dst_mapping, w->dst_size) * w->dst_slices;
    return 0.05 + 0.005 * w->dst_slices + 2e-6 * (src + dst);
}

/* Filters; 0 when that took too long, or failed, which v then says. */
static int check_call(verdict *v, bench *b) {
    double allowed = check_allowed_seconds(b->w), seconds;
    watch clock_watch = {0, 0, 0};
    clock_watch.limit = fmax(1, 4 * allowed);
    if (b->w->method == ENVMAP_METHOD_REFERENCE) clock_watch.limit = 20;
    envmap_filter_desc desc = call_desc(b->w, &clock_watch);
    envmap_result result = envmap_filter(&b->dst, &b->src, &b->header_lobe, &desc);
    seconds = cpu_seconds() - clock_watch.start;
    if (b->w->method != ENVMAP_METHOD_REFERENCE) hold(v, PROMISE_COST, seconds, allowed);
    if (clock_watch.expired) return 0;
    hold(v, PROMISE_OK, result, 0);
    return result == ENVMAP_OK;
}

static size_t bench_floats(const bench *b) {
    return oracle_floats(b->w->dst_mapping, b->w->dst_size, b->w->dst_slices, 0);
}

static void check_filter(verdict *v, bench *b) {
    const work *w = b->w;
    size_t floats = bench_floats(b), slice = floats / (size_t)w->dst_slices;
    int alike = !work_has_slices(w->lobe) && w->src_slices == 1, different = 0;
    if (!check_call(v, b)) return;
    check_numbers(v, w, b->dst.texels, floats);
    for (int k = 1; alike && k < w->dst_slices; ++k)
        different |= memcmp(b->dst.texels, b->dst.texels + slice * (size_t)k,
                            slice * sizeof(float)) != 0;
    hold(v, PROMISE_ALIKE, different, 0);
    judge_hold(v, b, b->dst.texels, w->dst_size, alike ? 1 : w->dst_slices);
}

typedef void check_function(verdict *v, bench *b);
static check_function *const check_functions[CHECK_COUNT] = {check_filter};

static verdict check_work(const work *w) {
    verdict v = verdict_none();
    bench b;
    if (bench_create(&b, w) && check_functions[w->check]) check_functions[w->check](&v, &b);
    bench_free(&b);
    return v;
}

#endif
