/* SPDX-License-Identifier: MIT
   What the tests of filters share: maps to filter, and the rules that every method keeps, held for
   any call: the same bits for any executor; progress that grows, and cancels; no leak, nothing
   touched, whichever allocation fails. */
#ifndef HELPERS_H
#define HELPERS_H

#include "zonal.h"

#ifdef __wasm__ /* no threads: one runs to its end where it is created */
typedef int pthread_t, pthread_mutex_t;
#define pthread_mutex_init(lock, attributes) (*(lock) = 0)
#define pthread_mutex_destroy(lock)          ((void)(lock))
#define pthread_mutex_lock(lock)             ((void)(lock))
#define pthread_mutex_unlock(lock)           ((void)(lock))
#define pthread_create(thread, attributes, run, user) (*(thread) = (run)(user) != NULL)
#define pthread_join(thread, result)                  ((void)(thread), 0)
#else
#include <pthread.h>
#endif

/* ---------------------------------------------------------------------------------- maps ---- */

static inline envmap black(int mapping, int size, int levels, int slices) {
    envmap map = {0};
    if (!CHECK(envmap_create(&map, mapping, size, levels, slices) == ENVMAP_OK)) {
        printf("    no map to test with\n");
        exit(1);
    }
    return map;
}

static inline envmap noise(int mapping, int size, unsigned long long seed) {
    envmap map = black(mapping, size, 1, 1);
    oracle_noise(&map, seed);
    return map;
}

static inline envmap smooth(int mapping, int size) {
    envmap map = black(mapping, size, 1, 1);
    oracle_fill(&map, 0, oracle_smooth);
    return map;
}

static inline size_t floats_of(const envmap *map) {
    size_t n = 0;
    for (int l = 0; l < map->levels; ++l)
        n += oracle_floats(map->mapping, map->size, map->slices, l);
    return n;
}

static inline void fill(envmap *map, float value) {
    for (size_t i = 0; i < floats_of(map); ++i) map->texels[i] = value;
}

static inline int all_are(const envmap *map, float value) {
    size_t other = 0;
    for (size_t i = 0; i < floats_of(map); ++i)
        other += memcmp(&map->texels[i], &value, sizeof value) != 0;
    return other == 0;
}

static inline int same_bits(const envmap *a, const envmap *b) {
    return !memcmp(a->texels, b->texels, floats_of(a) * sizeof(float));
}

static inline envmap_filter_desc desc_of(int method, double tolerance) {
    envmap_filter_desc desc;
    memset(&desc, 0, sizeof desc);
    desc.method = method;
    desc.tolerance = (float)tolerance;
    return desc;
}

static inline envmap_result filter(envmap *dst, const envmap *src, envmap_lobe lobe, int method,
                                   double tolerance) {
    envmap_filter_desc desc = desc_of(method, tolerance);
    return envmap_filter(dst, src, &lobe, &desc);
}

static inline double nan_near_the_axis(double x, double p, void *user) {
    (void)p;
    (void)user;
    return x > 0.95 ? (double)NAN : x > 0;
}

/* ----------------------------------------------------------------------------- executors ---- */

typedef struct crew {
    pthread_mutex_t lock;
    envmap_task *task;
    void *context;
    int count, next, threads, runs;
    unsigned char done[1 << 16]; /* how often each task has run */
} crew;

static inline void *crew_member(void *user) {
    crew *c = (crew *)user;
    for (;;) {
        pthread_mutex_lock(&c->lock);
        int i = c->next++;
        if (i < c->count && i < 1 << 16) ++c->done[i];
        pthread_mutex_unlock(&c->lock);
        if (i >= c->count) return NULL;
        c->task(c->context, i);
    }
}

/* 0 threads: in reversed order on this one. */
static inline void crew_run(void *user, envmap_task *task, void *context, int count) {
    crew *c = (crew *)user;
    pthread_t threads[8];
    memset(c->done, 0, sizeof c->done);
    c->task = task, c->context = context, c->count = count, c->next = 0;
    for (int i = count - 1; !c->threads && i >= 0; --i) task(context, i);
    for (int i = 0; i < c->threads; ++i)
        if (pthread_create(&threads[i], NULL, crew_member, c)) exit(1);
    for (int i = 0; i < c->threads; ++i) pthread_join(threads[i], NULL);
    for (int i = 0; c->threads && i < count && i < 1 << 16; ++i) CHECK(c->done[i] == 1);
    ++c->runs;
}

/* The call gives the same bits serially, on 1, 2, 3 and 7 threads, and backwards. */
static inline void check_executors(envmap *dst, const envmap *src, const envmap_lobe *lobes,
                                   int count, envmap_filter_desc desc) {
    static const int threads[5] = {1, 2, 3, 7, 0};
    static crew c;
    envmap serial = black(dst->mapping, dst->size, dst->levels, dst->slices);
    fill(&serial, -7);
    pthread_mutex_init(&c.lock, NULL);
    CHECK(envmap_filter_chain(&serial, src, lobes, count, &desc) == ENVMAP_OK);
    for (int k = 0; k < 5; ++k) {
        fill(dst, -7);
        c.threads = threads[k], c.runs = 0;
        desc.work.executor.user = &c;
        desc.work.executor.run = crew_run;
        CHECK(envmap_filter_chain(dst, src, lobes, count, &desc) == ENVMAP_OK);
        CHECK(same_bits(dst, &serial));
        CHECK(c.runs > 0);
    }
    pthread_mutex_destroy(&c.lock);
    envmap_free(&serial);
}

/* ------------------------------------------------------------------------------ progress ---- */

typedef struct watch {
    int calls, cancel_at, disorder;
    float last;
} watch;

static inline int watch_report(void *user, float fraction) {
    watch *w = (watch *)user;
    if (!(fraction >= w->last) || !(fraction <= 1)) ++w->disorder;
    w->last = fraction;
    return ++w->calls == w->cancel_at;
}

/* Cancels at the first report, the second, ... until the call ends before: nobody is asked again,
   nothing leaks, nothing of dst is touched. Returns how often it was cancelled. */
static inline int check_cancelling(envmap *dst, const envmap *src, const envmap_lobe *lobes,
                                   int count, envmap_filter_desc desc) {
    int at = 0, live = oracle_live;
    fill(dst, -7);
    dst->p0 = -3;
    envmap before = *dst;
    for (envmap_result result = ENVMAP_CANCELLED; result == ENVMAP_CANCELLED && at < 100000;) {
        watch w = {0, 0, 0, 0};
        w.cancel_at = ++at;
        desc.work.progress.user = &w;
        desc.work.progress.report = watch_report;
        result = envmap_filter_chain(dst, src, lobes, count, &desc);
        CHECK(oracle_live == live && w.disorder == 0);
        if (result == ENVMAP_CANCELLED) {
            CHECK(w.calls == at && all_are(dst, -7) && !memcmp(dst, &before, sizeof before));
        } else {
            CHECK(result == ENVMAP_OK && w.calls == at - 1 && w.last == 1.0f);
            CHECK(dst->texels[0] > -6);
        }
    }
    return at - 1;
}

/* -------------------------------------------------------------------------------- memory ---- */

/* Fails the first allocation, the second, ... until the call needs no more: nothing leaks, nothing
   of dst is touched, blocks go back with their context. Returns how many failed. */
static inline int check_starving(envmap *dst, const envmap *src, const envmap_lobe *lobes,
                                 int count, envmap_filter_desc desc) {
    int n = 0, finished = 0, live = oracle_live, context = 0;
    desc.work.memory = &context;
    fill(dst, -7);
    dst->p0 = -3;
    envmap before = *dst;
    for (; n < 1000 && !finished; ++n) {
        oracle_calls = 0;
        oracle_fail_at = n;
        envmap_result result = envmap_filter_chain(dst, src, lobes, count, &desc);
        oracle_fail_at = -1;
        finished = oracle_calls <= n;
        CHECK(oracle_live == live);
        CHECK(result == (finished ? ENVMAP_OK : ENVMAP_ERROR_MEMORY));
        if (!finished) CHECK(all_are(dst, -7) && !memcmp(dst, &before, sizeof before));
    }
    CHECK(finished && dst->texels[0] > -6 && oracle_wrong_context == 0);
    return n - 1;
}

#endif
