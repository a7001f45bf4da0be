/* SPDX-License-Identifier: MIT
   Random works: what is drawn, how a work is written as one line and read again, how it is made
   simpler, and the maps and lobes that it stands for. */
#ifndef SEARCH_WORKS_H
#define SEARCH_WORKS_H

#include "search_oracle.h"

/* ------------------------------------------------------------------------------------ words -- */

static const char *const work_mappings[MAPPINGS] = {"cube",    "paraboloid", "sphere",
                                                    "latlong", "angular",    "octahedral"};
static const char *const work_lobes[LOBE_COUNT] = {"diffuse", "phong", "gaussian", "ggx",
                                                   "banks",   "table", "cone",     "power",
                                                   "ring",    "two",   "hat",      "slide"};

enum {
    SCENE_CONSTANT,
    SCENE_NOISE,
    SCENE_SMOOTH,
    SCENE_TEXEL,   /* one lit texel on black, (s,t) says where                                    */
    SCENE_LAMPS,   /* three discs on black                                                        */
    SCENE_SUN,     /* a texel of 1e5 over noise                                                   */
    SCENE_CHECKER, /* texels, black and white                                                     */
    SCENE_HALF,    /* half of the sphere black                                                    */
    SCENE_DECADES, /* eight decades from one pole to the other                                    */
    SCENE_COLOURS, /* a lamp in red, noise in green, nothing in blue                              */
    SCENE_COUNT
};
static const char *const work_scenes[SCENE_COUNT] = {"constant", "noise",  "smooth",  "texel",
                                                     "lamps",    "sun",    "checker", "half",
                                                     "decades",  "colours"};

/* What is checked of a work; each is a function in search_promises.h. */
enum {
    CHECK_FILTER,
    CHECK_CHAIN,
    CHECK_PREPARED,
    CHECK_FURNACE,
    CHECK_EXECUTORS,
    CHECK_FAILURES,
    CHECK_NEIGHBOURS,
    CHECK_PLAN,
    CHECK_LOBES,
    CHECK_HARMONICS,
    CHECK_WINDOW,
    CHECK_RESAMPLE,
    CHECK_MIPS,
    CHECK_LOOKUPS,
    CHECK_COUNT
};
static const char *const work_checks[CHECK_COUNT] = {
    "filter", "chain", "prepared",  "furnace", "executors", "failures", "neighbours",
    "plan",   "lobes", "harmonics", "window",  "resample",  "mips",     "lookups"};

static const char *const work_methods[] = {"auto", "reference", "hierarchical", "fast",
                                           "harmonics"};

typedef struct work {
    unsigned long long seed; /* of noise, rows of tables, and what else a check draws */
    int check, method, scene;
    int src_mapping, src_size, src_slices, dst_mapping, dst_size, dst_slices;
    int lobe, raw;
    double a, b, scale;     /* the lobe's numbers */
    double tolerance, s, t; /* (s,t) in [0,1): where a scene's light is */
    double times;           /* all radiance is multiplied with this */
} work;

/* ------------------------------------------------------------------------------ one a line -- */

static void work_print(char *text, size_t room, const work *w) {
    snprintf(text, room,
             "check=%s method=%s src=%s:%d:%d dst=%s:%d:%d lobe=%s:%.9g:%.9g raw=%d:%.9g "
             "tolerance=%.6g scene=%s:%.9g:%.9g times=%.9g seed=%llu",
             work_checks[w->check], work_methods[w->method], work_mappings[w->src_mapping],
             w->src_size, w->src_slices, work_mappings[w->dst_mapping], w->dst_size, w->dst_slices,
             work_lobes[w->lobe], w->a, w->b, w->raw, w->scale, w->tolerance, work_scenes[w->scene],
             w->s, w->t, w->times, w->seed);
}

/* The index of the word that the text begins with, up to a colon or blank; -1: none. */
static int work_word(const char *text, const char *const *words, int count) {
    size_t n = strcspn(text, ": ");
    for (int i = 0; i < count; ++i)
        if (strlen(words[i]) == n && !strncmp(words[i], text, n)) return i;
    return -1;
}

/* What follows `key=` in a line; NULL where there is none. */
static const char *work_key(const char *line, const char *key) {
    size_t n = strlen(key);
    for (; *line; line += strcspn(line, " "), line += *line == ' ')
        if (!strncmp(line, key, n) && line[n] == '=') return line + n + 1;
    return NULL;
}

static int work_read_map(int *mapping, int *size, int *slices, const char *text) {
    if (!text || (*mapping = work_word(text, work_mappings, MAPPINGS)) < 0) return 0;
    return sscanf(strchr(text, ':') ? strchr(text, ':') : "", ":%d:%d", size, slices) == 2;
}

/* The word of `key`, and the numbers after it. */
static int work_read_word(int *word, double *first, double *second, const char *line,
                          const char *key, const char *const *words, int count) {
    const char *text = work_key(line, key);
    if (!text || (*word = work_word(text, words, count)) < 0) return 0;
    return !first || sscanf(text + strcspn(text, ":"), ":%lf:%lf", first, second) == 2;
}

/* Reads what work_print wrote; 0 when a part is missing. */
static int work_read(work *w, const char *line) {
    const char *raw = work_key(line, "raw"), *tolerance = work_key(line, "tolerance");
    const char *times = work_key(line, "times"), *seed = work_key(line, "seed");
    memset(w, 0, sizeof *w);
    return work_read_word(&w->check, NULL, NULL, line, "check", work_checks, CHECK_COUNT) &&
           work_read_word(&w->method, NULL, NULL, line, "method", work_methods, 5) &&
           work_read_word(&w->lobe, &w->a, &w->b, line, "lobe", work_lobes, LOBE_COUNT) &&
           work_read_word(&w->scene, &w->s, &w->t, line, "scene", work_scenes, SCENE_COUNT) &&
           work_read_map(&w->src_mapping, &w->src_size, &w->src_slices, work_key(line, "src")) &&
           work_read_map(&w->dst_mapping, &w->dst_size, &w->dst_slices, work_key(line, "dst")) &&
           raw && sscanf(raw, "%d:%lf", &w->raw, &w->scale) == 2 && tolerance &&
           sscanf(tolerance, "%lf", &w->tolerance) == 1 && times &&
           sscanf(times, "%lf", &w->times) == 1 && seed && sscanf(seed, "%llu", &w->seed) == 1;
}

/* ------------------------------------------------------------------------- lobes and scenes -- */

/* A lobe as the oracle has it; its table, where there is one, is to be freed. */
static oracle_lobe work_lobe(const work *w) {
    oracle_lobe m;
    unsigned long long state = w->seed;
    memset(&m, 0, sizeof m);
    m.kind = w->lobe, m.raw = w->raw, m.a = w->a, m.b = w->b, m.scale = w->scale;
    if (m.kind == LOBE_BANKS || m.kind == LOBE_SLIDE) m.p0 = -1, m.p1 = 1;
    m.kink = m.kind == LOBE_POWER ? (float)(PI / 2) : m.kind == LOBE_CONE ? (float)m.a : 0;
    if (m.kind != LOBE_TABLE) return m;
    m.p1 = 1, m.rows = (int)w->b, m.size = (int)oracle_clamp(24 * PI / w->a, 16, 4096);
    m.table = (float *)malloc((size_t)(m.rows * m.size) * sizeof(float));
    for (int row = 0; m.table && row < m.rows; ++row) {
        double width = w->a * pow(4, test_random(&state)), height = 0.2 + test_random(&state);
        for (int i = 0; i < m.size; ++i)
            m.table[row * m.size + i] = (float)(height * oracle_bell(PI * i / (m.size - 1), width));
    }
    return m;
}

/* The same lobe for the header; borrows m. */
static envmap_lobe work_header_lobe(oracle_lobe *m) {
    float a = (float)m->a;
    envmap_lobe lobe = m->kind == LOBE_DIFFUSE    ? envmap_lobe_diffuse()
                       : m->kind == LOBE_PHONG    ? envmap_lobe_phong(a)
                       : m->kind == LOBE_GAUSSIAN ? envmap_lobe_gaussian(a)
                       : m->kind == LOBE_GGX      ? envmap_lobe_ggx(a)
                       : m->kind == LOBE_BANKS    ? envmap_lobe_banks(a)
                       : m->kind == LOBE_TABLE    ? envmap_lobe_table(m->table, m->size, m->rows,
                                                                      (float)m->p0, (float)m->p1)
                                                  : envmap_lobe_function(oracle_function, m);
    lobe.raw = m->raw, lobe.scale = (float)m->scale;
    lobe.p0 = (float)m->p0, lobe.p1 = (float)m->p1;
    if (m->kink > 0) lobe.kinks = &m->kink, lobe.kink_count = 1;
    return lobe;
}

static int work_has_slices(int lobe) {
    return lobe == LOBE_BANKS || lobe == LOBE_TABLE || lobe == LOBE_SLIDE;
}

/* Nowhere negative. (Catmull-Rom swings below zero between the samples of a table.) */
static int work_lobe_positive(int lobe) { return lobe != LOBE_HAT && lobe != LOBE_TABLE; }

/* Lobes that have a kink, as envmap.h counts them; GGX has one at the horizon. */
static int work_lobe_kinked(const work *w) {
    return w->lobe == LOBE_DIFFUSE || (w->lobe == LOBE_PHONG && w->a < 2) || w->lobe == LOBE_GGX ||
           w->lobe == LOBE_BANKS || w->lobe == LOBE_CONE || w->lobe == LOBE_POWER;
}

/* Radiance of one channel in a direction; `lit` texels are those that (s,t) names. */
static double work_radiance(const work *w, const double d[3], const oracle_texel *texel, int lit,
                            int channel, unsigned long long *state) {
    double lamp = 0, noise = test_random(state), z = 2 * w->t - 1, r = sqrt(1 - z * z);
    double axis[3] = {r * cos(2 * PI * w->s), z, r * sin(2 * PI * w->s)};
    for (int i = 0; i < 3; ++i) {
        double turned[3] = {axis[i], axis[(i + 1) % 3], axis[(i + 2) % 3]};
        lamp += lit || oracle_dot(turned, d) > cos(0.05 + 0.1 * i) ? 10.0 / (1 + i + channel) : 0;
    }
    switch (w->scene) {
    case SCENE_NOISE: return noise;
    case SCENE_SMOOTH: return oracle_smooth(d, channel);
    case SCENE_TEXEL: return lit;
    case SCENE_LAMPS: return lamp;
    case SCENE_SUN: return lit ? 1e5 : noise;
    case SCENE_CHECKER: return (texel->x + texel->y + texel->face) & 1;
    case SCENE_HALF: return oracle_dot(axis, d) > 0;
    case SCENE_DECADES: return pow(10, 4 * oracle_dot(axis, d));
    case SCENE_COLOURS: return channel == 0 ? lamp : channel == 1 ? noise : 0;
    default: return 1;
    }
}

/* The source; slices differ in noise only. 0 when there is no memory. */
static int work_source(envmap *src, const work *w, const oracle_texel *texels) {
    size_t count = oracle_count(w->src_mapping, w->src_size);
    int faces = oracle_faces(w->src_mapping), width = oracle_width(w->src_mapping, w->src_size);
    double face = w->s * faces;
    unsigned long long state = w->seed ^ 0x5CE9E;
    memset(src, 0, sizeof *src);
    if (envmap_create(src, (envmap_mapping)w->src_mapping, w->src_size, 1, w->src_slices)) return 0;
    for (int slice = 0; slice < w->src_slices; ++slice)
        for (size_t i = 0; i < count; ++i) {
            const oracle_texel *t = texels + i;
            int lit = t->face == (int)face && t->x == (int)((face - (int)face) * width) &&
                      t->y == (int)(w->t * w->src_size);
            if (!(t->w > 0)) lit = 0; /* beyond a rim, where only a blend shows it */
            for (int c = 0; c < 3; ++c)
                src->texels[3 * ((size_t)slice * count + i) + (size_t)c] =
                    (float)(w->times * work_radiance(w, t->d, t, lit, c, &state));
        }
    return 1;
}

/* ------------------------------------------------------------------------------------- draw -- */

static double work_between(double low, double high, unsigned long long *state) {
    return exp(log(low) + test_random(state) * (log(high) - log(low)));
}

static int work_below(int n, unsigned long long *state) { return (int)(n * test_random(state)); }

/* Angles of widths, heights and centres have their own ranges; the rest is log-random over all that
   the lobe takes. */
static void work_draw_lobe(work *w, unsigned long long *state) {
    w->lobe = work_below(LOBE_COUNT + 3, state);
    if (w->lobe >= LOBE_COUNT) w->lobe = LOBE_PHONG + w->lobe - LOBE_COUNT; /* oftener */
    w->a = work_between(0.02, 1, state);
    w->b = 0;
    if (w->lobe == LOBE_DIFFUSE) w->a = 1;
    if (w->lobe == LOBE_PHONG || w->lobe == LOBE_GAUSSIAN)
        w->a = work_below(20, state) ? work_between(0.01, 1e6, state) : 0;
    if (w->lobe == LOBE_GGX) w->a = work_below(20, state) ? work_between(1e-4, 1, state) : 1;
    if (w->lobe == LOBE_BANKS) w->a = work_below(20, state) ? 1 - work_between(1e-3, 1, state) : 0;
    if (w->lobe == LOBE_TABLE) w->b = 1 + work_below(32, state);
    if (w->lobe == LOBE_POWER) w->a = work_between(0.5, 30, state);
    if (w->lobe == LOBE_RING || w->lobe == LOBE_TWO) w->b = w->a * work_between(1, 10, state);
    if (w->lobe == LOBE_HAT) w->b = 0.2 * test_random(state);
    if (w->lobe == LOBE_SLIDE) w->b = 0.9 * test_random(state);
    w->a = (double)(float)w->a;
    w->raw = work_below(4, state) == 0;
    w->scale = w->raw ? (double)(float)work_between(0.1, 10, state) : 1;
    if (w->lobe == LOBE_CONE) w->a = (double)(float)fmin(w->a, 1.5);
}

static int work_draw_size(unsigned long long *state) {
    int size = (int)(work_between(1, 129, state));
    return work_below(3, state) ? size : 1 << (int)(log2(size));
}

static void work_draw_maps(work *w, unsigned long long *state) {
    w->src_mapping = work_below(MAPPINGS, state), w->dst_mapping = work_below(MAPPINGS, state);
    w->src_size = work_draw_size(state), w->dst_size = work_draw_size(state);
    if (work_below(2, state)) w->src_size = (int)(64 + 65 * test_random(state));
    w->src_slices = w->dst_slices = 1;
    if (work_has_slices(w->lobe) || work_below(8, state) == 0)
        w->dst_slices = (int)work_between(1, 33, state);
    if (work_below(4, state) == 0) w->src_slices = w->dst_slices;
}

static void work_draw_scene(work *w, unsigned long long *state) {
    w->scene = work_below(SCENE_COUNT, state);
    w->s = test_random(state), w->t = test_random(state);
    if (work_below(3, state) == 0) w->t = work_below(2, state) ? 0 : 0.999999;
    w->times = work_below(8, state) ? 1 : work_below(2, state) ? 1e30 : 1e-30;
}

/* Makes the result smaller, to at most that many texels in all slices. */
static void work_at_most(work *w, double texels) {
    int alike = w->src_slices == w->dst_slices;
    double more = (double)oracle_count(w->dst_mapping, w->dst_size) * w->dst_slices / texels;
    if (more <= 1) return;
    if (w->dst_slices > 3) more *= 3.0 / w->dst_slices, w->dst_slices = 3;
    if (alike) w->src_slices = w->dst_slices;
    if (more > 1) w->dst_size = (int)fmax(1, w->dst_size / sqrt(more));
}

/* The reference, which thin lobes go to today, takes minutes where maps are large: it gets bounded
   works, but for one in ten thin lobes. */
static void work_spare(work *w, unsigned long long *state) {
    double width = w->lobe == LOBE_PHONG || w->lobe == LOBE_GAUSSIAN ? 1 / sqrt(w->a + 1) : w->a;
    if (w->lobe == LOBE_BANKS) width = sqrt(1 - w->a);
    int thin = w->lobe != LOBE_DIFFUSE && w->lobe != LOBE_POWER &&
               width < 2.5 * oracle_extent(w->src_mapping, w->src_size);
    if (thin && work_below(10, state)) work_at_most(w, 3000);
    if (w->check == CHECK_NEIGHBOURS) work_at_most(w, 20000);
    if (w->method == ENVMAP_METHOD_REFERENCE)
        work_at_most(w, (thin ? 1e6 : 1e7) / (double)oracle_count(w->src_mapping, w->src_size));
}

/* One in two works asks the filter for a map. */
static void work_draw(work *w, unsigned long long seed) {
    unsigned long long state = seed;
    memset(w, 0, sizeof *w);
    w->check = work_below(2, &state) ? work_below(CHECK_COUNT, &state) : CHECK_FILTER;
    w->method = work_below(4, &state)   ? ENVMAP_METHOD_AUTO
                : work_below(4, &state) ? ENVMAP_METHOD_FAST
                                        : ENVMAP_METHOD_REFERENCE;
    work_draw_lobe(w, &state);
    work_draw_maps(w, &state);
    work_spare(w, &state);
    work_draw_scene(w, &state);
    w->tolerance = work_below(3, &state) ? work_between(1e-6, 1e-1, &state) : 1e-3;
    w->seed = (unsigned long long)(1e6 * test_random(&state));
}

/* ----------------------------------------------------------------------------------- shrink -- */

static double work_round(double x, int digits) {
    char text[32];
    snprintf(text, sizeof text, "%.*g", digits, x);
    return atof(text);
}

enum { WORK_STEPS = 25 };

/* Makes w simpler in one way, step = 0 .. WORK_STEPS-1; a step may change nothing. */
static void work_simplify(work *w, int step) {
    int bell = w->lobe == LOBE_TABLE || w->lobe >= LOBE_RING;
    if (step == 0) w->src_slices = 1;
    if (step == 1) w->dst_slices = w->src_slices = 1;
    if (step == 2) w->dst_slices = (w->dst_slices + 1) / 2, w->src_slices = 1;
    if (step == 3) w->dst_size = (w->dst_size + 1) / 2;
    if (step == 4) w->src_size = (w->src_size + 1) / 2;
    if (step == 5) w->dst_size -= w->dst_size > 1;
    if (step == 6) w->src_size = 1 << (int)log2(w->src_size);
    if (step == 7) w->dst_mapping = ENVMAP_CUBE;
    if (step == 8) w->src_mapping = ENVMAP_CUBE;
    if (step == 9) w->times = 1;
    if (step == 10) w->raw = 0, w->scale = 1;
    if (step == 11) w->scale = 1;
    if (step == 12) w->scene = SCENE_CONSTANT;
    if (step == 13 && w->scene > SCENE_TEXEL) w->scene = SCENE_TEXEL;
    if (step == 14 && w->scene > SCENE_NOISE) w->scene = SCENE_NOISE;
    if (step == 15) w->a = (double)(float)work_round(w->a, 1);
    if (step == 16) w->a = (double)(float)work_round(w->a, 2);
    if (step == 17) w->b = w->lobe == LOBE_TABLE ? (int)(w->b + 1) / 2 : work_round(w->b, 1);
    if (step == 18) w->tolerance = 1e-3;
    if (step == 19) w->tolerance = work_round(w->tolerance, 1);
    if (step == 20) w->s = fmin(0.999, work_round(w->s, 2));
    if (step == 21) w->t = fmin(0.999999, work_round(w->t, 2));
    if (step == 22) w->method = ENVMAP_METHOD_AUTO;
    if (step == 23) w->seed = 1;
    if (step == 24 && bell) w->lobe = LOBE_PHONG, w->a = (double)(float)(1 / (w->a * w->a));
}

#endif
