/* separable_grid.h - the separable Gaussian of separable_gaussian.h at speed: passes along rows,
   columns and diagonals of each face, no lookup between texels.

   On a face's plane (u, v), rho^2 = 1 + u^2 + v^2, the metric's inverse is rho^2 (I + r r^T),
   r = (u, v). It is a sum of squares along the grid's own directions, none of them negative:
       rho^2 ((1 + u^2 - |uv|) e_u e_u^T + (1 + v^2 - |uv|) e_v e_v^T + |uv| d d^T),
   d = e_u + e_v where uv > 0, e_u - e_v where uv < 0. So the heat equation is three of one
   dimension, each (1/m) d(m a d f), m = rho^-3 the solid angle: along s, ds = du / sqrt(a), its
   kernel is exp(-(s'-s)^2 / 2 sigma^2) sqrt(m') a'^(-1/4) du', symmetric but for m, so that each
   pass keeps the energy. Where it is thinner than a texel five taps with a Gaussian's second and
   fourth moment stand in. Order U/2 V/2 D V/2 U/2; what the boxes of a level have spread is taken
   off a: a constant of the grid.

   Weights are the same for the six faces and, mirrored, for the four quarters of one: what they
   have at the same place lies together, 4 x 6 x 3 = 72 floats, a *knot*. A line of weights is made,
   used for 72 lines, forgotten; every loop over a knot is plain and becomes vectors. A face goes on
   beyond its edges as far as the passes reach, from its neighbours' texels by Catmull-Rom: across
   the edge a row is a row, along it is stretched.

   Domain: even sides.  Fails: a lamp of a few texels on a face's axis, where |uv| has its kink, and
   on an edge: 0.2 to 0.4 % rms.  Tests: a_chain_* in tests/test_methods_gaussian.c.

   SPDX-License-Identifier: MIT */

#ifndef METHOD_SEPARABLE_GRID_H
#define METHOD_SEPARABLE_GRID_H

#include "methods.h"

#define GRID_ROUND 0.07  /* a wider sigma is done in rounds: beyond its edges a plane goes far */
#define GRID_PLAIN 0.015 /* a thinner one in the plain order, U V D                            */
#define GRID_CUT   3.2   /* sigmas at which a kernel ends                                      */
#define GRID_TAPS  64    /* the most that a kernel reaches                                     */
#define GRID_THIN  0.5f  /* texels^2: below, a kernel is five taps with its moments            */

#define GRID_PARTS 24 /* of a knot: [lower, upper half][left, right half][face], 3 floats each */
#define GRID_KNOT  72

enum { GRID_U, GRID_V, GRID_D };

/* Floats that are filtered at once. */
#if defined(__GNUC__) && defined(__AVX__)
typedef float grid_lanes __attribute__((vector_size(32)));
#elif defined(__GNUC__)
typedef float grid_lanes __attribute__((vector_size(16)));
#else
typedef float grid_lanes;
#endif
#define GRID_LANES ((int)(sizeof(grid_lanes) / sizeof(float)))

/* A pass: variance in texels^2 at a face's centre, what is taken off it, texels it reaches. */
typedef struct grid_direction {
    float variance, boxes;
    int reach;
} grid_direction;

typedef struct grid {
    float *image;        /* [side][side] knots; (0, 0) is beside the middle of a face          */
    float *line;         /* knots of a line as they were, from -GRID_TAPS on                   */
    float *weights;      /* [2 GRID_TAPS + 1][side] of a line                                  */
    float *a, *s, *r, *g;/* of a line: variance, place in sigmas, sqrt(m), sqrt(m) a^(-1/4)    */
    int *reach;          /* of each knot of a line                                             */
    int side, half, border, rounds, halves; /* knots: of a row, of a face, beyond it           */
    grid_direction direction[3];
} grid;

static inline float *grid_knot(const grid *g, int x, int y) {
    return g->image + ((size_t)y * (size_t)g->side + (size_t)x) * GRID_KNOT;
}

/* Catmull-Rom: what the four texels around a place weigh; returns the first. */
static inline int grid_cubic(float w[4], float at) {
    int i = (int)(at + 1024) - 1024; /* floorf would be a call */
    float f = at - (float)i, g = 1 - f, p = -0.5f * f * g;
    w[0] = p * g, w[1] = g - p * (2 * g - f), w[2] = f - p * (2 * f - g), w[3] = p * f;
    return i - 1;
}

/* to = what count knots from `from` on, `step` floats apart, weigh; w's are `next` floats apart. */
static inline void grid_sum(float *to, const float *from, size_t step, const float *w, size_t next,
                            int count) {
    grid_lanes sum[GRID_KNOT / GRID_LANES], t;
    int c, k;
    memset(sum, 0, sizeof sum);
    for (k = 0; k < count; ++k, from += step, w += next)
        for (c = 0; c < GRID_KNOT / GRID_LANES; ++c)
            memcpy(&t, from + c * GRID_LANES, sizeof t), sum[c] += *w * t;
    for (c = 0; c < GRID_KNOT / GRID_LANES; ++c) memcpy(to + c * GRID_LANES, sum + c, sizeof t);
}

/* The knot seen in a mirror: along rows, or along columns. */
static inline void grid_mirror(float *to, const float *from, int along) {
    int i, block = along == GRID_U ? GRID_KNOT / 4 : GRID_KNOT / 2;
    for (i = 0; i < GRID_KNOT; i += 2 * block) {
        memcpy(to + i, from + i + block, (size_t)block * sizeof *to);
        memcpy(to + i + block, from + i, (size_t)block * sizeof *to);
    }
}

/* --------------------------------------------------------------------------------- >>weights -- */

/* exp(-d^2 / 2), to 1e-4 of itself where it counts. */
static inline float grid_bell(float d) {
    float t = d * d * (-1.0f / 64), e;
    t = t > -1 ? t : -1;
    e = 1 + t * (1 + t * (0.5f + t * (1.0f / 6 + t * (1.0f / 24))));
    e *= e, e *= e, e *= e, e *= e;
    return e * e;
}

/* The five taps' outer ones; v their variance. */
static inline float grid_five(int k, float v) {
    float two = (3 * v * v - v) / 24;
    return k == 2 || k == -2 ? two : 0.5f * v - 4 * two;
}

/* a, s, r, g of line i and of what it reaches. Diagonals begin where they cross an axis: their
   variance is 0 there, nothing gets across. */
static inline void grid_places(const grid *g, int which, int i, int count) {
    const grid_direction *d = g->direction + which;
    float texel = 1 / (float)g->half, least = 1e-4f, v0 = ((float)i + 0.5f) * texel;
    int j;
    for (j = -d->reach; j < count + d->reach; ++j) {
        float v = ((float)j + 0.5f) * texel, u = which == GRID_D ? v + (float)i * texel : v0;
        float uv = fabsf(u * v), rho2 = 1 + u * u + v * v;
        float a = d->variance * rho2 * (which == GRID_D ? uv : 1 + v * v - uv) - d->boxes;
        a = a > least ? a : least;
        g->a[j] = a, g->s[j] = 1 / sqrtf(a);
        g->r[j] = which == GRID_D && j < 0 ? 0 : sqrtf(1 / (rho2 * sqrtf(rho2)));
        g->g[j] = g->r[j] * sqrtf(g->s[j]);
    }
    for (j = -d->reach; j < count + d->reach; ++j) {
        float q = g->s[j];
        g->s[j] = j > -d->reach ? g->s[j - 1] + 0.5f * (least + q) : 0, least = q;
    }
    for (j = 0; j < count; ++j) {
        int reach = (int)((float)GRID_CUT * sqrtf(g->a[j])) + 1;
        g->reach[j] = g->a[j] < GRID_THIN ? 2 : reach < d->reach ? reach : d->reach;
    }
}

/* Tap k of a line's weights, and the sum of them so far. */
static inline void grid_tap(const grid *g, float *restrict w, float *restrict sum, int k,
                            int count) {
    const float *s = g->s, *to = g->s + k, *there = g->g + k;
    const int *reach = g->reach;
    int j, far = k < 0 ? -k : k;
    for (j = 0; j < count; ++j) {
        float bell = grid_bell(to[j] - s[j]) * there[j];
        w[j] = far > reach[j] ? 0 : bell;
        sum[j] += w[j];
    }
}

static inline void grid_thin_tap(const grid *g, float *restrict w, float *restrict sum, int k,
                                 int count) {
    const float *a = g->a, *r = g->r;
    int j;
    for (j = 0; j < count; ++j) {
        float five = grid_five(k, 0.5f * (a[j] + a[j + k])) * r[j + k] / r[j];
        int thin = a[j] < GRID_THIN;
        sum[j] = thin ? sum[j] - five : sum[j];
        w[j] = thin ? five : w[j];
    }
}

static inline float *grid_weights(const grid *g, int k) {
    return g->weights + (size_t)(k + GRID_TAPS) * (size_t)g->side;
}

/* The weights of a line: tap k of knot j at [k][j]. */
static inline void grid_weigh(const grid *g, int which, int i, int count) {
    int j, k, reach = g->direction[which].reach;
    float *restrict sum = grid_weights(g, GRID_TAPS + 1), *restrict w;
    grid_places(g, which, i, count);
    for (j = 0; j < count; ++j) sum[j] = 0;
    for (k = -reach; k <= reach; ++k) grid_tap(g, grid_weights(g, k), sum, k, count);
    for (j = 0; j < count; ++j) sum[j] = 1 / sum[j];
    for (k = -reach; k <= reach; ++k)
        for (w = grid_weights(g, k), j = 0; j < count; ++j) w[j] *= sum[j];
    for (j = 0; j < count; ++j) sum[j] = 1;
    for (k = -2; k <= 2; ++k)
        if (k) grid_thin_tap(g, grid_weights(g, k), sum, k, count);
    for (w = grid_weights(g, 0), j = 0; j < count; ++j) w[j] = g->a[j] < GRID_THIN ? sum[j] : w[j];
}

/* ---------------------------------------------------------------------------------- >>passes -- */

/* The line of `count` knots from `at` on, `step` floats apart, by the weights that are made. */
static inline void grid_line(const grid *g, int which, float *at, size_t step, int count) {
    int j, reach = g->direction[which].reach;
    float *old = g->line + (size_t)GRID_TAPS * GRID_KNOT;
    for (j = 0; j < reach; ++j) {
        memcpy(old + j * GRID_KNOT, at + (size_t)j * step, GRID_KNOT * sizeof *at);
        if (which == GRID_D)
            memset(old - (j + 1) * GRID_KNOT, 0, GRID_KNOT * sizeof *at);
        else
            grid_mirror(old - (j + 1) * GRID_KNOT, old + j * GRID_KNOT, which);
    }
    for (j = 0; j < count; ++j, at += step) {
        int r = g->reach[j];
        memcpy(old + (j + reach) * GRID_KNOT, at + (size_t)reach * step, GRID_KNOT * sizeof *at);
        grid_sum(at, old + (j - r) * GRID_KNOT, GRID_KNOT,
                 grid_weights(g, -r) + j, (size_t)g->side, 2 * r + 1);
    }
}

/* One pass over what is valid: px knots beyond the edges along x, py along y; the pass makes them
   fewer. */
static inline void grid_pass(grid *g, int which, int *px, int *py) {
    int i, lines, count;
    size_t row = (size_t)g->side * GRID_KNOT;
    if (which != GRID_V) *px -= g->direction[which].reach;
    if (which != GRID_U) *py -= g->direction[which].reach;
    lines = g->half + (which == GRID_U ? *py : *px);
    count = g->half + (which == GRID_U ? *px : *py);
    for (i = 0; i < lines; ++i) {
        if (which == GRID_D) count = lines - i; /* px = py */
        grid_weigh(g, which, i, count);
        if (which == GRID_U) grid_line(g, which, grid_knot(g, 0, i), GRID_KNOT, count);
        if (which == GRID_V) grid_line(g, which, grid_knot(g, i, 0), row, count);
        if (which == GRID_D) grid_line(g, which, grid_knot(g, i, 0), row + GRID_KNOT, count);
        if (which == GRID_D && i)
            grid_line(g, which, grid_knot(g, 0, i), row + GRID_KNOT, count);
    }
}

/* ---------------------------------------------------------------------------------- >>border -- */

/* Which part goes on beyond the edge of each part, along x and along y; GRID_PARTS more where it
   does so along its own y. */
static inline void grid_seams(int seams[2][GRID_PARTS]) {
    int edge, part, face;
    for (edge = 0; edge < 2; ++edge)
        for (part = 0; part < GRID_PARTS; ++part) {
            float x = part / 6 % 2 ? 0.5f : -0.5f, y = part / 12 ? 0.5f : -0.5f, dir[3], u, v;
            x *= edge ? 0.5f : 1.01f, y *= edge ? 1.01f : 0.5f;
            envmap_direction(dir, ENVMAP_CUBE, part % 6, 0.5f + x, 0.5f + y);
            envmap_coordinates(&face, &u, &v, ENVMAP_CUBE, dir);
            seams[edge][part] = face + 6 * (u > 0.5f) + 12 * (v > 0.5f);
            if (fabsf(u - 0.5f) < fabsf(v - 0.5f)) seams[edge][part] += GRID_PARTS;
        }
}

/* Weights of four knots from `first` on, so that all lie on a face of n: what is beyond its end
   counts there. Returns the first. */
static inline int grid_inside(float w[4], int first, int n) {
    float in[4] = {0, 0, 0, 0};
    int k, start = first < n - 4 ? first : n - 4;
    start = start < 0 ? 0 : start;
    for (k = 0; k < 4; ++k) {
        int at = first + k < 0 ? 0 : first + k < n ? first + k : n - 1;
        in[at - start] += w[k];
    }
    memcpy(w, in, sizeof in);
    return start;
}

/* What lies as deep on the neighbours as knots `depth` beyond the edges do: rows[0] along y, rows[1]
   along x; from two knots before the middle to two beyond the end. */
static inline void grid_deep(const grid *g, float *rows[2], float deep) {
    int i, k, n = g->half, first, count = n < 4 ? n : 4;
    float w[4];
    size_t row = (size_t)g->side * GRID_KNOT;
    first = grid_cubic(w, deep);
    first = grid_inside(w, first, n);
    for (i = 0; i < n; ++i) {
        grid_sum(rows[0] + i * GRID_KNOT, grid_knot(g, first, i), GRID_KNOT, w, 1, count);
        grid_sum(rows[1] + i * GRID_KNOT, grid_knot(g, i, first), row, w, 1, count);
    }
    for (k = 0; k < 2; ++k)
        for (i = 0; i < 2; ++i) {
            float *last = rows[k] + (n - 1) * GRID_KNOT;
            int there = i < n ? i : n - 1;
            grid_mirror(rows[k] - (i + 1) * GRID_KNOT, rows[k] + there * GRID_KNOT,
                        k ? GRID_U : GRID_V);
            memcpy(last + (i + 1) * GRID_KNOT, last, GRID_KNOT * sizeof *last);
        }
}

/* Writes the knots beyond the edges: what is at 1 / f on a face's plane is at f on its neighbour's. */
static inline void grid_border(const grid *g) {
    int depth, i, k, part, seams[2][GRID_PARTS];
    float w[4], *rows[2], found[2 * GRID_KNOT];
    rows[0] = g->line + 2 * GRID_KNOT, rows[1] = rows[0] + (g->half + 4) * GRID_KNOT;
    grid_seams(seams);
    for (depth = 0; depth < g->border; ++depth) {
        int at = g->half + depth;
        float f = (float)g->half / ((float)at + 0.5f);
        grid_deep(g, rows, f * (float)g->half - 0.5f);
        for (i = 0; i <= at; ++i) {
            int from = grid_cubic(w, ((float)i + 0.5f) * f - 0.5f);
            for (k = 0; k < 2; ++k)
                grid_sum(found + k * GRID_KNOT, rows[k] + from * GRID_KNOT, GRID_KNOT, w, 1, 4);
            for (k = 0; k < 2; ++k)
                for (part = 0; part < GRID_PARTS; ++part)
                    memcpy(grid_knot(g, k ? i : at, k ? at : i) + 3 * part,
                           found + 3 * seams[k][part], 3 * sizeof *found);
        }
    }
}

/* ---------------------------------------------------------------------------------- >>levels -- */

/* Solid angle of a knot's texels, up to a constant. */
static inline float grid_solid_angle(const grid *g, int x, int y) {
    float u = ((float)x + 0.5f) / (float)g->half, v = ((float)y + 0.5f) / (float)g->half;
    float rho2 = 1 + u * u + v * v;
    return 1 / (rho2 * sqrtf(rho2));
}

/* The mean of four knots, by solid angle as the passes' kernels are; of a variance of 1/4 texel^2. */
static inline void grid_mean(const grid *g, float *to, int x, int y) {
    int k;
    float w[4], sum = 0, pair[2 * GRID_KNOT];
    for (k = 0; k < 4; ++k) sum += w[k] = grid_solid_angle(g, 2 * x + k % 2, 2 * y + k / 2);
    for (k = 0; k < 4; ++k) w[k] /= sum;
    for (k = 0; k < 2; ++k)
        grid_sum(pair + k * GRID_KNOT, grid_knot(g, 2 * x, 2 * y + k), GRID_KNOT, w + 2 * k, 1, 2);
    for (k = 0; k < GRID_KNOT; ++k) to[k] = pair[k] + pair[GRID_KNOT + k];
}

static inline void grid_halve(grid *g) {
    int x, y;
    for (y = 0; y < g->half / 2; ++y)
        for (x = 0; x < g->half / 2; ++x) grid_mean(g, grid_knot(g, x, y), x, y);
    g->half /= 2;
}

/* The texel of a map's level, n knots a quarter, that is at a place of a part. */
static inline float *grid_texel(const envmap *map, int level, int n, int part, int x, int y) {
    return envmap_texel(map, level, 0, part % 6, part / 6 % 2 ? n + x : n - 1 - x,
                        part / 12 ? n + y : n - 1 - y);
}

static inline void grid_load(const grid *g, const envmap *map) {
    int part, x, y;
    for (y = 0; y < g->half; ++y)
        for (part = 0; part < GRID_PARTS; ++part) {
            const float *texel = grid_texel(map, 0, g->half, part, 0, y);
            float *knot = grid_knot(g, 0, y) + 3 * part;
            int next = part / 6 % 2 ? 3 : -3;
            for (x = 0; x < g->half; ++x, knot += GRID_KNOT, texel += next)
                memcpy(knot, texel, 3 * sizeof *knot);
        }
}

/* A level of a cube from the image, or from its half. */
static inline void grid_store(const grid *g, envmap *map, int level, float scale) {
    int part, x, y, n = method_edge(map, level) / 2, halved = n < g->half;
    float *knots = g->line;
    for (y = 0; y < n; ++y) {
        for (x = 0; x < n && halved; ++x) grid_mean(g, knots + x * GRID_KNOT, x, y);
        for (part = 0; part < GRID_PARTS; ++part) {
            float *texel = grid_texel(map, level, n, part, 0, y);
            const float *knot = (halved ? knots : grid_knot(g, 0, y)) + 3 * part;
            int next = part / 6 % 2 ? 3 : -3;
            for (x = 0; x < n; ++x, knot += GRID_KNOT, texel += next)
                texel[0] = scale * knot[0], texel[1] = scale * knot[1], texel[2] = scale * knot[2];
        }
    }
}

/* ------------------------------------------------------------------------------------ >>work -- */

/* Rounds for a variance: see GRID_ROUND, and what GRID_TAPS are enough for. */
static inline int grid_rounds(int n, double variance) {
    double texels = 0.5 * n * GRID_ROUND, most = GRID_TAPS / (GRID_CUT * 2.1);
    double at_once = GRID_ROUND * (texels > most ? most / texels : 1);
    int rounds = (int)ceil(variance / (at_once * at_once));
    return rounds > 1 ? rounds : 1;
}

/* Shapes g for faces of n texels and a variance, less what `boxes` of the texels have added along
   rows and columns. A Gaussian as thin as GRID_PLAIN hardly sees the passes' order. */
static inline void grid_shape(grid *g, int n, double variance, double boxes) {
    double texels;
    grid_direction *d = g->direction;
    g->half = n / 2, g->rounds = grid_rounds(n, variance);
    g->halves = variance < GRID_PLAIN * GRID_PLAIN ? 1 : 2;
    texels = variance / g->rounds * 0.25 * n * n;
    d[GRID_U].variance = (float)(texels / g->halves);
    d[GRID_U].boxes = (float)(boxes / (g->rounds * g->halves));
    d[GRID_U].reach = 2 + (int)(GRID_CUT * sqrt(4 * texels / g->halves));
    d[GRID_V] = d[GRID_U];
    d[GRID_D].variance = (float)texels, d[GRID_D].boxes = 0;
    d[GRID_D].reach = 2 + (int)(GRID_CUT * sqrt(3 * texels));
    g->border = g->halves * d[GRID_U].reach + d[GRID_D].reach;
}

/* The floats that images up to `side` knots need. */
static inline size_t grid_floats(int side) {
    size_t s = (size_t)side;
    return GRID_KNOT * (s * s + 2 * s + 2 * GRID_TAPS + 8) + s * (2 * GRID_TAPS + 3) +
           4 * (s + 2 * GRID_TAPS);
}

static inline void grid_lay_out(grid *g, int side, float *p) {
    size_t s = (size_t)side, table = s + 2 * GRID_TAPS;
    g->side = side, g->image = p, p += s * s * GRID_KNOT;
    g->line = p, p += (2 * s + 2 * GRID_TAPS + 8) * GRID_KNOT;
    g->weights = p, p += s * (2 * GRID_TAPS + 2);
    g->reach = (int *)p, p += s + GRID_TAPS;
    g->a = p, g->s = p + table, g->r = p + 2 * table, g->g = p + 3 * table;
}

/* The heat kernel: the image through all rounds. */
static inline void grid_run(grid *g) {
    static const int order[] = {GRID_U, GRID_V, GRID_D, GRID_V, GRID_U};
    int i, k;
    for (i = 0; i < g->rounds; ++i) {
        int px = g->border, py = g->border;
        grid_border(g);
        for (k = 0; k < 2 * g->halves + 1; ++k) grid_pass(g, order[k], &px, &py);
    }
}

#endif /* METHOD_SEPARABLE_GRID_H */
