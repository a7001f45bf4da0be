/* SPDX-License-Identifier: MIT
   A search: draws works, makes what breaks smaller, counts. */
#ifndef SEARCH_RUN_H
#define SEARCH_RUN_H

#include "search_others.h"

typedef struct search {
    int works, findings;
    int pairs[MAPPINGS][MAPPINGS], lobes[LOBE_COUNT], scenes[SCENE_COUNT], checks[CHECK_COUNT];
    int promises[PROMISE_COUNT]; /* how often each was asked, */
    double most[PROMISE_COUNT];  /* and the most of its bound that a work took */
} search;

static void search_count(search *s, const work *w, const verdict *v) {
    ++s->works, ++s->pairs[w->src_mapping][w->dst_mapping];
    ++s->lobes[w->lobe], ++s->scenes[w->scene], ++s->checks[w->check];
    for (int i = 0; i < PROMISE_COUNT; ++i)
        s->promises[i] += v->over[i] >= 0, s->most[i] = fmax(s->most[i], v->over[i]);
}

/* Makes w simpler as long as the same promise breaks, for at most `seconds`. */
static void search_shrink(work *w, int promise, double seconds) {
    double start = cpu_seconds();
    for (int step = 0, idle = 0; idle < WORK_STEPS; step = (step + 1) % WORK_STEPS, ++idle) {
        work simpler = *w;
        if (cpu_seconds() - start > seconds) return;
        work_simplify(&simpler, step);
        if (!memcmp(&simpler, w, sizeof simpler)) continue;
        verdict v = check_work(&simpler);
        if (broken(&v, promise)) *w = simpler, idle = -1;
    }
}

static void search_show(const work *w, const verdict *v, int promise) {
    char text[512];
    work_print(text, sizeof text, w);
    printf("    broken: %s: %.4g, %.3g times its bound\n      WORK=\"%s\"\n", promise_text[promise],
           v->value[promise], v->over[promise], text);
    fflush(stdout);
}

/* What a work broke, as it was drawn, and as small as it becomes. */
static void search_sort(search *s, const work *w, const verdict *v, double shrink) {
    for (int i = 0; i < PROMISE_COUNT; ++i) {
        if (!broken(v, i)) continue;
        if (++s->findings > 30) continue;
        search_show(w, v, i);
        if (!(shrink > 0)) continue;
        work small = *w;
        search_shrink(&small, i, shrink);
        verdict last = check_work(&small);
        search_show(&small, &last, i);
    }
}

/* Work number n of a seed. */
static work search_draw(unsigned long long seed, int n) {
    work w;
    work_draw(&w, seed * 1000003u + (unsigned long long)n);
    return w;
}

static void search_add(search *s, const work *w, const verdict *v, double shrink) {
    search_count(s, w, v);
    search_sort(s, w, v, shrink);
}

static void search_list(const char *what, const int *counts, const char *const *words, int n) {
    printf("  %s:", what);
    for (int i = 0; i < n; ++i) printf(" %s %d%s", words[i], counts[i], i + 1 < n ? "," : "\n");
}

/* What was tried, promise by promise. */
static void search_report(const search *s) {
    int least = s->pairs[0][0];
    for (int i = 0; i < MAPPINGS * MAPPINGS; ++i) {
        int times = s->pairs[i / MAPPINGS][i % MAPPINGS];
        least = times < least ? times : least;
    }
    printf("  %d works; each of the %d pairs of mappings at least %d times\n", s->works,
           MAPPINGS * MAPPINGS, least);
    search_list("lobes", s->lobes, work_lobes, LOBE_COUNT);
    search_list("scenes", s->scenes, work_scenes, SCENE_COUNT);
    search_list("checks", s->checks, work_checks, CHECK_COUNT);
    for (int i = 0; i < PROMISE_COUNT; ++i)
        printf("  %6d  %s: at most %.2g of its bound\n", s->promises[i], promise_text[i],
               s->most[i]);
    printf("  %d findings\n", s->findings);
}

#endif
