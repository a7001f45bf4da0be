/* SPDX-License-Identifier: MIT
   Calls, drawn from bytes: maps with hostile radiance, lobes with parameters, tables and functions
   that nobody should give, executors that run tasks backwards, nested or not at all, memory that
   fails, progress that cancels. Whatever comes, a call ends, leaks nothing, leaves its outputs as
   they were when it fails, and a result that it calls good is one: finite, not negative where
   neither radiance nor lobe is, and a constant where the environment is one.
   `make fuzz` draws the bytes with libFuzzer; tests/test_calls.c with a generator. */
#include "oracle.h"
#include <stdint.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t bytes);

static const uint8_t *fuzz_next, *fuzz_end;
static int fuzz_results[ENVMAP_RESULT_COUNT]; /* how often each was returned */

#define DEMAND(condition)                                                                          \
    do {                                                                                           \
        if (!(condition)) {                                                                        \
            fprintf(stderr, "%s:%d: not true: %s\n", __FILE__, __LINE__, #condition);              \
            abort();                                                                               \
        }                                                                                          \
    } while (0)

/* ------------------------------------------------------------------------------ arguments ---- */

/* 0 .. n-1; 0 when there are no bytes left. */
static int draw(int n) { return fuzz_next < fuzz_end ? *fuzz_next++ % n : 0; }

static int one_in(int n) { return draw(n) == n - 1; }

static double draw_unit(void) { return (draw(256) * 256 + draw(256)) / 65535.0; }

/* Mostly in [0, scale], sometimes any bits. */
static float draw_float(double scale) {
    static const float odd[] = {0, -0.0f, 1, -1, 1e-38f, 1e-30f, 1e30f, 3.4e38f, 65504, 1e-3f};
    uint32_t bits = 0;
    float out;
    if (!one_in(6)) return (float)(scale * draw_unit());
    if (draw(2)) return odd[draw(10)];
    for (int i = 0; i < 4; ++i) bits = bits << 8 | (uint32_t)draw(256);
    memcpy(&out, &bits, sizeof out);
    return out;
}

typedef struct drawn_map {
    envmap map;
    float least, most; /* of level 0, all slices; NaN in `least` where a number is not finite */
    size_t floats;
} drawn_map;

static void see_radiance(drawn_map *m) {
    m->floats = oracle_floats(m->map.mapping, m->map.size, m->map.slices, 0);
    m->least = m->most = m->map.texels[0];
    for (size_t i = 0; i < m->floats; ++i) {
        float x = m->map.texels[i];
        if (!isfinite(x)) m->least = NAN;
        if (x < m->least) m->least = x;
        if (x > m->most) m->most = x;
    }
}

static drawn_map draw_map(int hostile) {
    drawn_map m;
    memset(&m, 0, sizeof m);
    int size = 1 + draw(draw(16) ? 8 : 24), levels = 1 + draw(envmap_levels(size));
    DEMAND(!envmap_create(&m.map, draw(5), size, levels, draw(3) ? 1 : 1 + draw(4)));
    float base = draw_float(2), other = draw_float(100);
    int lit = draw(4); /* none: a constant; one texel; noise; some of all kinds */
    unsigned long long seed = (unsigned long long)draw(256);
    size_t n = oracle_floats(m.map.mapping, size, m.map.slices, 0);
    if (!hostile) base = fabsf(base) <= 1e30f ? fabsf(base) : 1, other = 50;
    for (size_t i = 0; i < n; ++i)
        m.map.texels[i] = lit == 2 ? base * (float)test_random(&seed) : base;
    if (lit == 1) m.map.texels[(size_t)draw(256) * 7 % n] = other;
    for (int i = 0; lit == 3 && i < 12; ++i)
        m.map.texels[(size_t)draw(256) * 13 % n] = hostile ? draw_float(10) : (float)draw(9);
    see_radiance(&m);
    return m;
}

/* A function of hostile answers; `user` says which. The last kind contradicts itself. */
static double draw_lobe_function(double x, double p, void *user) {
    static int calls;
    switch (*(int *)user) {
    case 0: return x > 0 ? x * x : 0;
    case 1: return exp(20 * (x - 1)) * (1 + 0.3 * p);
    case 2: return x > 0.3 ? (double)NAN : 1;
    case 3: return -1 - x;
    case 4: return x > 0.99 ? HUGE_VAL : 0;
    case 5: return 1e300 * x;
    case 6: return x;
    case 7: return fabs(x) < 1e-3 ? 1 : 0;
    case 8: return 1e-320;
    default: return (double)(++calls % 5);
    }
}

typedef struct drawn_lobe {
    envmap_lobe lobe;
    int known; /* one of the formulas: positive, deterministic */
} drawn_lobe;

static float lobe_numbers[64];
static int lobe_function_kind;

static drawn_lobe draw_lobe(void) {
    static const double scales[] = {0, 1, 300, 300, 1, 1, 0, 0, 1};
    drawn_lobe out;
    int kind = draw(10);
    out.lobe = envmap_lobe_diffuse();
    lobe_function_kind = draw(10);
    for (int i = 0; i < 64; ++i) lobe_numbers[i] = i < 24 ? draw_float(3) : (float)i / 64;
    if (kind == ENVMAP_LOBE_FUNCTION)
        out.lobe = envmap_lobe_function(draw_lobe_function, &lobe_function_kind);
    else if (kind == ENVMAP_LOBE_TABLE)
        out.lobe =
            envmap_lobe_table(lobe_numbers, 3 + draw(13), draw(5), draw_float(1), draw_float(1));
    else if (kind == ENVMAP_LOBE_BANKS)
        out.lobe = envmap_lobe_banks(draw_float(1));
    else if (kind < 9)
        out.lobe.kind = kind, out.lobe.parameter = draw_float(scales[kind]);
    out.known = kind < ENVMAP_LOBE_FUNCTION || kind == 9;
    if (one_in(8)) out.lobe.kinks = lobe_numbers, out.lobe.kink_count = draw(70) - 2;
    if (out.lobe.kink_count > 64) out.lobe.kink_count = 64;
    if (one_in(8)) out.lobe.p0 = draw_float(1), out.lobe.p1 = draw_float(1), out.known = 0;
    if (one_in(6)) out.lobe.raw = 1, out.lobe.scale = draw_float(2), out.known = 0;
    return out;
}

typedef struct drawn_work {
    int order, cancel_at, reports, context;
} drawn_work;

static void draw_run(void *user, envmap_task *task, void *context, int count) {
    const drawn_work *w = (const drawn_work *)user;
    envmap_executor inner = {NULL, draw_run};
    drawn_work half = {1, 0, 0, 0};
    inner.user = &half;
    if (w->order == 1)
        for (int i = count - 1; i >= 0; --i) task(context, i);
    else if (w->order == 2) /* odd ones, then even ones */
        for (int i = 0; i < count; ++i)
            task(context, i < count / 2 ? 2 * i + 1 : 2 * (i - count / 2));
    else if (w->order == 3)
        inner.run(inner.user, task, context, count);
    else if (w->order == 4) /* leaves out the last: refused, or run by the caller */
        for (int i = 0; i + 1 < count; ++i) task(context, i);
}

static int draw_report(void *user, float fraction) {
    drawn_work *w = (drawn_work *)user;
    DEMAND(fraction >= 0 && fraction <= 1);
    return ++w->reports == w->cancel_at;
}

static envmap_work draw_work(drawn_work *w) {
    envmap_work out;
    memset(&out, 0, sizeof out);
    w->order = draw(6), w->cancel_at = draw(12), w->reports = 0;
    if (w->order) out.executor.user = w, out.executor.run = draw_run;
    if (w->cancel_at) out.progress.user = w, out.progress.report = draw_report;
    if (draw(2)) out.memory = &w->context;
    return out;
}

static envmap_filter_desc draw_desc(drawn_work *w) {
    envmap_filter_desc desc;
    memset(&desc, 0, sizeof desc);
    desc.method = one_in(16) ? draw(256) - 128 : draw(ENVMAP_METHOD_COUNT);
    desc.tolerance = draw(2) ? 0 : one_in(5) ? draw_float(1) : (float)pow(10, -1 - draw(5));
    desc.threshold = draw(4) ? 0 : draw_float(0.1);
    desc.work = draw_work(w);
    return desc;
}

/* ---------------------------------------------------------------------------------- rules ---- */

/* Bytes that a failing call must leave alone. */
typedef struct kept {
    void *at, *copy;
    size_t bytes;
} kept;

static kept keep(void *at, size_t bytes) {
    kept k;
    k.at = at, k.bytes = bytes, k.copy = malloc(bytes);
    DEMAND(k.copy);
    memcpy(k.copy, at, bytes);
    return k;
}

static void demand_kept(kept *k, envmap_result result) {
    DEMAND((int)result >= 0 && result < ENVMAP_RESULT_COUNT);
    ++fuzz_results[result];
    DEMAND(!result || !memcmp(k->at, k->copy, k->bytes));
    free(k->copy);
}

/* What a filter calls good. `share`: how far a constant may be off. */
static void demand_good(const drawn_map *src, const drawn_map *dst, const drawn_lobe *lobe,
                        double share) {
    size_t bad = 0, below = 0;
    double off = 0;
    for (size_t i = 0; i < dst->floats; ++i) {
        float x = dst->map.texels[i];
        bad += isfinite(x) ? 0 : 1;
        below += x < 0 ? 1 : 0;
        off = fmax(off, fabs((double)x - (double)src->least));
    }
    if (!lobe->known) return;
    DEMAND(bad == 0);
    if (src->least >= 0) DEMAND(below == 0);
    if (src->least >= src->most && lobe->lobe.kind != ENVMAP_LOBE_BANKS)
        DEMAND(off <= share * fabs((double)src->most) + 1e-37);
}

/* ---------------------------------------------------------------------------------- calls ---- */

static void call_filter(void) {
    drawn_map src = draw_map(draw(2)), dst = draw_map(0);
    drawn_lobe lobes[3] = {draw_lobe(), draw_lobe(), draw_lobe()};
    envmap_lobe list[3] = {lobes[0].lobe, lobes[1].lobe, lobes[2].lobe};
    drawn_work w, other;
    envmap_filter_desc desc = draw_desc(&w), first = draw_desc(&other);
    envmap_prepared prepared = {NULL, NULL};
    int how = draw(4), count = 1 + draw(3);
    if (how == 3 && !envmap_prepare(&prepared, &src.map, list, count, &first))
        desc.prepared = &prepared;
    oracle_calls = 0, oracle_fail_at = one_in(3) ? draw(40) : -1;
    kept k = keep(dst.map.texels, dst.floats * sizeof(float));
    envmap_result r = how ? envmap_filter(&dst.map, &src.map, list, &desc)
                          : envmap_filter_chain(&dst.map, &src.map, list, count, &desc);
    demand_kept(&k, r);
    if (!r) demand_good(&src, &dst, lobes, desc.tolerance > 0.01f ? 1e-2 : 2e-3);
    oracle_fail_at = -1;
    envmap_prepared_free(&prepared);
    envmap_free(&src.map), envmap_free(&dst.map);
}

static void call_plan(void) {
    drawn_map src = draw_map(draw(2)), dst = draw_map(0);
    drawn_lobe lobe = draw_lobe();
    drawn_work w;
    envmap_filter_desc desc = draw_desc(&w);
    envmap_plan plan;
    memset(&plan, 0, sizeof plan);
    oracle_calls = 0, oracle_fail_at = one_in(3) ? draw(40) : -1;
    kept k = keep(&plan, sizeof plan);
    envmap_result r = envmap_filter_plan(&plan, &dst.map, &src.map, &lobe.lobe, &desc);
    demand_kept(&k, r);
    if (!r) DEMAND(plan.size >= 1 && plan.bands >= 1 && plan.slices >= 1 && plan.error >= 0);
    oracle_fail_at = -1;
    envmap_free(&src.map), envmap_free(&dst.map);
}

static void call_resample(void) {
    drawn_map src = draw_map(draw(2)), dst = draw_map(0);
    drawn_work w;
    envmap_work work = draw_work(&w);
    drawn_lobe mirror = {envmap_lobe_mirror(), 1};
    oracle_calls = 0, oracle_fail_at = one_in(3) ? draw(20) : -1;
    kept k = keep(dst.map.texels, dst.floats * sizeof(float));
    envmap_result r = envmap_resample(&dst.map, &src.map, &work);
    demand_kept(&k, r);
    if (!r) demand_good(&src, &dst, &mirror, 1e-5);
    oracle_fail_at = -1;
    envmap_free(&src.map), envmap_free(&dst.map);
}

static void call_map(void) {
    drawn_map a = draw_map(1), b = draw_map(1);
    envmap_difference d;
    envmap_cleaned cleaned;
    float rgb[3], dir[3] = {draw_float(1), draw_float(1), draw_float(1)}, u, v;
    float dx[3] = {draw_float(1), 0, draw_float(1)}, dy[3] = {0, draw_float(1), 0};
    int face;
    memset(&d, 0, sizeof d);
    kept k = keep(&d, sizeof d);
    demand_kept(&k, envmap_compare(&d, &a.map, draw(2) ? &a.map : &b.map, draw(4) - 1));
    k = keep(a.map.texels, a.floats * sizeof(float));
    demand_kept(&k, envmap_clean(&a.map, draw_float(100), &cleaned));
    see_radiance(&a);
    ++fuzz_results[envmap_mips_build(&a.map)];
    envmap_coordinates(&face, &u, &v, a.map.mapping, dir);
    DEMAND(face >= 0 && face < envmap_faces(a.map.mapping) && u >= 0 && u <= 1 && v >= 0 && v <= 1);
    envmap_lookup_slice(rgb, &a.map, dir, draw_float(1), draw_float(6));
    if (a.least >= 0) DEMAND(rgb[0] >= 0 && rgb[1] >= 0 && rgb[2] >= 0);
    DEMAND(envmap_footprint_level(&a.map, dir, dx, dy) >= 0);
    envmap_lookup_footprint(rgb, &a.map, dir, dx, dy, draw(256) - 1);
    envmap_free(&a.map), envmap_free(&b.map);
}

static void call_series(void) {
    enum { MOST = 12 };
    double sh[3 * MOST * MOST], out[3 * MOST * MOST], moved = -1, turn[9];
    drawn_map map = draw_map(draw(2));
    drawn_lobe lobe = draw_lobe();
    drawn_work w;
    envmap_work work = draw_work(&w);
    int bands = 1 + draw(MOST);
    memset(sh, 0, sizeof sh), memset(out, 0, sizeof out);
    double tolerance = draw(2) ? 0 : (double)draw_float(0.1), p = (double)draw_float(1);
    oracle_calls = 0, oracle_fail_at = one_in(4) ? draw(20) : -1;
    kept k = keep(sh, sizeof sh);
    envmap_result r = envmap_sh_project(sh, bands, &map.map, draw(3), tolerance, &work);
    demand_kept(&k, r);
    for (int i = 0; i < (r ? 27 : 0); ++i) sh[i] = (double)draw_float(1);
    for (int i = 0; i < 9; ++i) turn[i] = i % 4 == 0;
    if (draw(2)) turn[0] = turn[4] = cos(p), turn[1] = sin(p), turn[3] = -sin(p);
    k = keep(out, sizeof out);
    demand_kept(&k, envmap_sh_convolve(out, sh, bands, &lobe.lobe, p));
    k = keep(out, sizeof out);
    demand_kept(&k, envmap_sh_rotate(out, sh, bands, turn));
    k = keep(out, sizeof out);
    demand_kept(&k, envmap_sh_window(out, &moved, sh, bands, draw(2) ? &lobe.lobe : NULL, p));
    k = keep(map.map.texels, map.floats * sizeof(float));
    demand_kept(&k, envmap_sh_fill(&map.map, 0, 0, sh, bands, tolerance, &work));
    oracle_fail_at = -1;
    envmap_free(&map.map);
}

static void call_lobe(void) {
    drawn_lobe lobe = draw_lobe();
    double lambda[20], from, to, p = (double)draw_float(1);
    int bands = 1 + draw(20), known = lobe.known;
    memset(lambda, 0, sizeof lambda);
    kept k = keep(lambda, sizeof lambda);
    envmap_result r = envmap_lobe_zonal(lambda, bands, &lobe.lobe, p);
    demand_kept(&k, r);
    for (int l = 0; l < bands && known && !r; ++l) DEMAND(fabs(lambda[l]) <= 10);
    envmap_lobe_support(&from, &to, &lobe.lobe, p);
    DEMAND(from >= 0 && to >= from && to <= 3.1416);
    DEMAND(envmap_lobe_sigma(&lobe.lobe, p) >= 0);
    if (known) DEMAND(isfinite(envmap_lobe_integral(&lobe.lobe, p)));
    if (known) DEMAND(isfinite(envmap_lobe_value(&lobe.lobe, (double)draw_float(1), p)));
}

static void draw_brdf(double f[3], const double v[3], const double l[3], void *user) {
    const int *kind = (const int *)user;
    f[0] = f[1] = f[2] = 0.3;
    if (*kind == 1) f[0] = pow(fmax(0, v[2] * l[2] - v[0] * l[0] - v[1] * l[1]), 20);
    if (*kind == 2 && l[2] > 0.9) f[1] = (double)NAN;
    if (*kind == 3 && l[2] > 0.9) f[2] = -1;
    if (*kind == 4) f[0] = f[1] = f[2] = 0;
    if (*kind == 5) f[0] = 1e300;
    if (*kind == 6) f[0] = 1 / l[2];
}

static void call_materials(void) {
    drawn_map map = draw_map(draw(2));
    int kind = draw(7);
    envmap_brdf brdf;
    envmap_frame frames[2];
    drawn_work w;
    envmap_work work = draw_work(&w);
    float rgb[6] = {0}, offsets[9], weights[9];
    brdf.function = draw_brdf, brdf.user = &kind;
    for (int i = 0; i < 2; ++i)
        for (int c = 0; c < 3; ++c) {
            frames[i].n[c] = draw_float(1);
            frames[i].t[c] = draw_float(1), frames[i].v[c] = draw_float(1);
        }
    oracle_calls = 0, oracle_fail_at = one_in(4) ? draw(8) : -1;
    kept k = keep(rgb, sizeof rgb);
    demand_kept(&k, envmap_radiance(rgb, &map.map, &brdf, frames, 1 + draw(2), &work));
    oracle_fail_at = -1;
    int taps = envmap_fan(offsets, weights, 9, (double)draw_float(1), (double)draw_float(0.3),
                          (double)draw_float(0.3));
    DEMAND(taps >= 0);
    if (taps > 9) taps = 9;
    envmap_lookup_fan(rgb, &map.map, frames[0].n, frames[0].t, frames[0].v, offsets, weights, taps);
    envmap_free(&map.map);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t bytes) {
    static void (*const calls[])(void) = {call_filter, call_filter, call_filter,
                                          call_plan,   call_resample, call_map,
                                          call_series, call_lobe,   call_materials};
    fuzz_next = data, fuzz_end = data + bytes;
    calls[draw(9)]();
    DEMAND(oracle_live == 0 && oracle_wrong_context == 0);
    return 0;
}
