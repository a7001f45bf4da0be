/* separable_grid.h - the separable Gaussian of separable_gaussian.h at speed: passes along rows,
   columns and diagonals of each face, no lookup between texels.

   On a face's plane (u, v), rho^2 = 1 + u^2 + v^2, the metric's inverse is rho^2 (I + r r^T),
   r = (u, v). It is a sum of squares along the grid's own directions, none of them negative:
       rho^2 ((1 + u^2 - |uv|) e_u e_u^T + (1 + v^2 - |uv|) e_v e_v^T + |uv| d d^T),
   d = e_u + e_v where uv > 0, e_u - e_v where uv < 0. So the heat equation is three of one
   dimension, each (1/m) d(m a d f), m = rho^-3 the solid angle: along s, ds = du / sqrt(a), its
   kernel is exp(-(s'-s)^2 / 2 sigma^2) sqrt(m') a'^(-1/4) du', symmetric but for m, so that each
   pass keeps the energy; sums over texels, not quite 1, are shared between both ends of a tap so
   that it stays so. Where the kernel is thinner than a texel five taps with a Gaussian's second
   and fourth moment stand in. Rounds go U V D and D V U by turns. What the boxes of a level have
   spread is taken off a: a constant of the grid.

   Weights are the same for the six faces and, mirrored, for the four quarters of one. What these
   have at the same place lies together: 4 x 6 x 3 = 72 floats, a *knot*. So a weight is made once
   for 24 texels, and every loop over a knot becomes vectors. A face goes on beyond its edges as far
   as the passes reach, from its neighbours' texels by Catmull-Rom: across the edge a row is a row,
   along it is stretched.

   Domain: even sides.  Fails: a lamp of a texel on an axis of a face, where |uv| has its kink, on
   an edge, and most in a corner.  Tests: a_chain_* in tests/methods/test_methods_gaussian.c.

   SPDX-License-Identifier: MIT */

#ifndef METHOD_SEPARABLE_GRID_H
#define METHOD_SEPARABLE_GRID_H

#include "methods.h"

#define GRID_ROUND 0.05 /* a wider sigma is done in rounds: beyond its edges a plane goes far */
#define GRID_CUT   3.8  /* sigmas at which a kernel ends                                      */
#define GRID_TAPS  64   /* the most that a kernel reaches                                     */
#define GRID_THIN  0.5f /* texels^2: below, a kernel is five taps with its moments            */

#define GRID_PARTS 24 /* of a knot: [lower, upper half][left, right half][face], 3 floats each */
#define GRID_KNOT  72

enum { GRID_U, GRID_V, GRID_D };

/* Floats that are filtered at once; one where a product of floats is wider than a float, as x87's. */
#if defined(__GNUC__) && defined(__AVX__)
typedef float grid_lanes __attribute__((vector_size(32)));
#elif defined(__GNUC__) && __FLT_EVAL_METHOD__ == 0
typedef float grid_lanes __attribute__((vector_size(16)));
#else
typedef float grid_lanes;
#endif
#define GRID_LANES ((int)(sizeof(grid_lanes) / sizeof(float)))

/* Lines down and across the image do not lie together: what comes is asked for before. */
#ifdef __GNUC__
#define GRID_FETCH(p) __builtin_prefetch(p)
#else
#define GRID_FETCH(p) (void)(p)
#endif

/* The kernels of rows and columns, and of diagonals. */
typedef struct grid_kernels {
    float variance, boxes; /* texels^2 at a face's centre; what is taken off it               */
    float *weights;        /* [line][tap, -reach .. reach][knot]                              */
    int *reaches, reach;   /* [line][knot]: how far each goes back, and on; the farthest      */
} grid_kernels;

typedef struct grid {
    float *image;             /* [side][side] knots; (0, 0) is beside the middle of a face    */
    float *line;              /* knots of a line as they were, from -GRID_TAPS on             */
    float *a, *s, *r, *g, *h; /* of a line: see grid_places                                   */
    float *sum;               /* of the weights of its knots                                  */
    int side, half, wide;     /* knots: of a row, of a face, and with what lies beyond it     */
    int rounds;               /* an even number                                               */
    grid_kernels kernels[2];
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

/* to = what count knots from `from` on, `step` floats apart, weigh; weights are `next` apart. */
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

/* The knot on the other side of the axis that a line crosses. */
static inline void grid_mirror(float *to, const float *from, int which) {
    int i, part = which == GRID_U ? GRID_KNOT / 4 : which == GRID_V ? GRID_KNOT / 2 : 0;
    if (!part) memcpy(to, from, GRID_KNOT * sizeof *to);
    for (i = 0; part && i < GRID_KNOT; i += 2 * part) {
        memcpy(to + i, from + i + part, (size_t)part * sizeof *to);
        memcpy(to + i + part, from + i, (size_t)part * sizeof *to);
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

/* Of the `count` knots of a line, and of what it reaches beyond its beginning: a, the variance; s,
   the place in sigmas; r = sqrt(m); g = r a^(-1/4); h = r a^(1/4). Lines are even about the axis
   where they begin; for diagonals it is a mirror: their variance is 0 there, nothing gets over. */
static inline void grid_places(const grid *g, const grid_kernels *d, int line, int count) {
    float texel = 1 / (float)g->half, last = 0;
    int j, diagonal = d != g->kernels;
    for (j = -d->reach; j < count; ++j) {
        float v = fabsf((float)j + 0.5f) * texel, u = ((float)line + 0.5f) * texel, rho2, a, root;
        if (diagonal) u += v - 0.5f * texel;
        rho2 = 1 + u * u + v * v;
        a = d->variance * rho2 * (diagonal ? u * v : 1 + v * v - u * v) - d->boxes;
        a = a > 1e-4f ? a : 1e-4f, root = sqrtf(a);
        g->a[j] = a, g->r[j] = sqrtf(1 / (rho2 * sqrtf(rho2)));
        g->h[j] = g->r[j] * sqrtf(root), g->g[j] = g->h[j] / root;
        g->s[j] = j > -d->reach ? g->s[j - 1] + 2 / (last + root) : 0; /* a linear in between */
        last = root;
    }
}

/* Tap k of every knot, and the sum so far. */
static inline void grid_tap(const grid *g, float *restrict w, float *restrict sum, int k,
                            int count) {
    const float *s = g->s, *to = g->s + k, *there = g->g + k;
    int j;
    for (j = 0; j < count; ++j) {
        float d = to[j] - s[j];
        w[j] = d * d > (float)(GRID_CUT * GRID_CUT) ? 0 : grid_bell(d) * there[j];
        sum[j] += w[j];
    }
}

static inline void grid_scale(float *restrict w, const float *restrict scale, int count) {
    int j;
    for (j = 0; j < count; ++j) w[j] *= scale[j];
}

/* Tap k of five that have a Gaussian's second and fourth moment, in knots that are thin; rest: what
   the middle one keeps. */
static inline void grid_five(const grid *g, float *restrict w, float *restrict rest, int k,
                             int count) {
    const float *a = g->a, *b = g->a + k, *r = g->r, *there = g->r + k;
    int j, outer = k == 2 || k == -2;
    for (j = 0; j < count; ++j) {
        float v = 0.5f * (a[j] + b[j]), two = (3 * v * v - v) / 24;
        float tap = (outer ? two : 0.5f * v - 4 * two) * there[j] / r[j];
        int thin = a[j] < GRID_THIN;
        w[j] = thin ? tap : w[j], rest[j] -= thin ? tap : 0;
    }
}

static inline float *grid_row(const grid *g, const grid_kernels *d, int line, int k) {
    return d->weights +
           (size_t)(line * (2 * d->reach + 1) + d->reach + k) * (size_t)(g->wide + d->reach);
}

/* How far the weights of a knot reach, back (-1) or on (1). */
static inline int grid_far(const grid *g, const grid_kernels *d, int line, int j, int side) {
    int far = d->reach;
    if (g->a[j] < GRID_THIN) return 2;
    while (!(grid_row(g, d, line, side * far)[j] > 0)) --far;
    return far;
}

/* The weights of a line. Each knot's sum is shared between both ends of its taps, so that the
   kernel stays symmetric; what is then left is made up for by the knot itself. */
static inline void grid_weigh(const grid *g, const grid_kernels *d, int line) {
    int j, k, reach = d->reach, n = g->wide - (d == g->kernels ? 0 : line);
    int *far = d->reaches + 2 * line * g->wide;
    float *sum = g->sum, *share = g->h, *rest = g->g, *w;
    grid_places(g, d, line, n + 2 * reach);
    for (j = 0; j < n + reach; ++j) sum[j] = 0;
    for (k = -reach; k <= reach; ++k) grid_tap(g, grid_row(g, d, line, k), sum, k, n + reach);
    for (j = 0; j < n + reach; ++j) /* the root of 2 pi: a whole Gaussian's */
        share[j] = 1 / sqrtf(g->a[j] < GRID_THIN ? 2.5066283f : sum[j] / g->h[j]);
    for (j = 0; j < reach; ++j) share[-1 - j] = share[j];
    for (j = 0; j < n; ++j) sum[j] = 0, rest[j] = 1;
    for (k = -reach; k <= reach; ++k) {
        grid_scale(w = grid_row(g, d, line, k), share + k, n);
        for (j = 0; j < n; ++j) sum[j] += w[j];
    }
    for (j = 0; j < n; ++j) {
        sum[j] = 1 / sum[j];
        far[2 * j] = grid_far(g, d, line, j, -1), far[2 * j + 1] = grid_far(g, d, line, j, 1);
    }
    for (k = -reach; k <= reach; ++k) grid_scale(grid_row(g, d, line, k), sum, n);
    for (k = -2; k <= 2; ++k)
        if (k) grid_five(g, grid_row(g, d, line, k), rest, k, n);
    for (w = grid_row(g, d, line, 0), j = 0; j < n; ++j)
        w[j] = g->a[j] < GRID_THIN ? rest[j] : w[j];
}

/* ---------------------------------------------------------------------------------- >>passes -- */

/* Filters the line of `count` knots from `at` on, `step` floats apart. */
static inline void grid_line(const grid *g, int which, int line, float *at, size_t step,
                             int count) {
    const grid_kernels *d = g->kernels + (which == GRID_D);
    const int *far = d->reaches + 2 * line * g->wide;
    const float *weights = grid_row(g, d, line, 0);
    int j, c, reach = d->reach, next = g->wide + reach;
    float *old = g->line + (size_t)GRID_TAPS * GRID_KNOT;
    for (j = 0; j < reach; ++j) {
        memcpy(old + j * GRID_KNOT, at + (size_t)j * step, GRID_KNOT * sizeof *at);
        grid_mirror(old - (j + 1) * GRID_KNOT, old + j * GRID_KNOT, which);
    }
    for (j = 0; j < count; ++j, at += step, far += 2) {
        const float *ahead = at + (size_t)(reach + (j + 8 < count ? 8 : 0)) * step;
        for (c = 0; c < GRID_KNOT; c += 16) GRID_FETCH(ahead + c);
        memcpy(old + (j + reach) * GRID_KNOT, at + (size_t)reach * step, GRID_KNOT * sizeof *at);
        grid_sum(at, old + (j - far[0]) * GRID_KNOT, GRID_KNOT, weights + j - far[0] * next,
                 (size_t)next, far[0] + 1 + far[1]);
    }
}

/* One pass over what is valid: px knots beyond the edges along x, py along y; the pass makes them
   fewer. */
static inline void grid_pass(const grid *g, int which, int *px, int *py) {
    int i, lines, count, reach = g->kernels[which == GRID_D].reach;
    size_t row = (size_t)g->side * GRID_KNOT, step = which == GRID_U ? GRID_KNOT : row;
    if (which == GRID_D) step += GRID_KNOT;
    *px -= which == GRID_V ? 0 : reach, *py -= which == GRID_U ? 0 : reach;
    lines = g->half + (which == GRID_U ? *py : *px);
    count = g->half + (which == GRID_U ? *px : *py);
    for (i = 0; i < lines; ++i) {
        int length = which == GRID_D ? count - i : count; /* then px = py */
        if (which != GRID_U) grid_line(g, which, i, grid_knot(g, i, 0), step, length);
        if (which == GRID_U || (which == GRID_D && i))
            grid_line(g, which, i, grid_knot(g, 0, i), step, length);
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

/* What lies `deep` on the neighbours: rows[0] along y, rows[1] along x, from two knots before the
   middle to two beyond the end. */
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

/* Writes what lies beyond the edges: what is at 1 / f on a face's plane is at f on the next. */
static inline void grid_border(const grid *g) {
    int depth, i, k, part, seams[2][GRID_PARTS];
    float w[4], *rows[2], found[2 * GRID_KNOT];
    rows[0] = g->line + 2 * GRID_KNOT, rows[1] = rows[0] + (g->half + 4) * GRID_KNOT;
    grid_seams(seams);
    for (depth = 0; depth < g->wide - g->half; ++depth) {
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

/* The root of the solid angle of a knot's texels, up to a constant. */
static inline float grid_root(const grid *g, int x, int y) {
    float u = ((float)x + 0.5f) / (float)g->half, v = ((float)y + 0.5f) / (float)g->half;
    float rho2 = 1 + u * u + v * v;
    return sqrtf(1 / (rho2 * sqrtf(rho2)));
}

/* The mean of the four knots about the middle of f x f, times scale; by roots of solid angles, as
   the passes' kernels are: solid angles would drift. Its variance is 1/4 knot^2. */
static inline void grid_mean(const grid *g, float *to, int x, int y, int f, float scale) {
    int i, at = f / 2 - 1;
    float w[4], sum = 0, row[2 * GRID_KNOT];
    x = f * x + at, y = f * y + at;
    for (i = 0; i < 4; ++i) sum += w[i] = grid_root(g, x + i % 2, y + i / 2);
    for (i = 0; i < 4; ++i) w[i] *= scale / sum;
    for (i = 0; i < 2; ++i)
        grid_sum(row + i * GRID_KNOT, grid_knot(g, x, y + i), GRID_KNOT, w + 2 * i, 1, 2);
    for (i = 0; i < GRID_KNOT; ++i) to[i] = row[i] + row[GRID_KNOT + i];
}

static inline void grid_halve(grid *g) {
    int x, y;
    float *mean = g->line;
    for (y = 0; y < g->half / 2; ++y)
        for (x = 0; x < g->half / 2; ++x) {
            grid_mean(g, mean, x, y, 2, 1);
            memcpy(grid_knot(g, x, y), mean, GRID_KNOT * sizeof *mean);
        }
    g->half /= 2;
}

/* Where row y of each part begins on a map's level, n knots a quarter; texels of the left half go
   to the left. */
static inline void grid_rows(float *texels[GRID_PARTS], const envmap *map, int level, int n,
                             int y) {
    int part;
    for (part = 0; part < GRID_PARTS; ++part)
        texels[part] = envmap_texel(map, level, 0, part % 6, part / 6 % 2 ? n : n - 1,
                                    part / 12 ? n + y : n - 1 - y);
}

static inline void grid_load(const grid *g, const envmap *map) {
    int part, x, y;
    float *texels[GRID_PARTS];
    for (y = 0; y < g->half; ++y) {
        float *to = grid_knot(g, 0, y);
        grid_rows(texels, map, 0, g->half, y);
        for (x = 0; x < 3 * g->half; x += 3)
            for (part = 0; part < GRID_PARTS; ++part, to += 3)
                memcpy(to, texels[part] + (part / 6 % 2 ? x : -x), 3 * sizeof *to);
    }
}

/* A level of a cube from the image. */
static inline void grid_store(const grid *g, envmap *map, int level, float scale) {
    int part, x, y, n = method_edge(map, level) / 2, f = g->half / n;
    float *texels[GRID_PARTS], knot[GRID_KNOT];
    for (y = 0; y < n; ++y) {
        grid_rows(texels, map, level, n, y);
        for (x = 0; x < n; ++x) {
            if (f > 1) grid_mean(g, knot, x, y, f, scale);
            else grid_sum(knot, grid_knot(g, x, y), 0, &scale, 0, 1);
            for (part = 0; part < GRID_PARTS; ++part)
                memcpy(texels[part] + (part / 6 % 2 ? 3 * x : -3 * x), knot + 3 * part,
                       3 * sizeof *knot);
        }
    }
}

/* ------------------------------------------------------------------------------------ >>work -- */

/* Rounds for a variance: see GRID_ROUND, and what GRID_TAPS are enough for. */
static inline int grid_rounds(int n, double variance) {
    double texels = 0.5 * n * GRID_ROUND, most = GRID_TAPS / (GRID_CUT * 2.1);
    double at_once = GRID_ROUND * (texels > most ? most / texels : 1);
    int pairs = (int)ceil(variance / (2 * at_once * at_once));
    return pairs > 1 ? 2 * pairs : 2;
}

/* Shapes g for faces of n texels and a variance, less what `boxes` have added, in texels^2 along
   rows and columns. */
static inline void grid_shape(grid *g, int n, double variance, double boxes) {
    grid_kernels *d = g->kernels;
    double texels;
    g->half = n / 2, g->rounds = grid_rounds(n, variance);
    texels = variance / g->rounds * 0.25 * n * n;
    d[0].variance = d[1].variance = (float)texels;
    d[0].boxes = (float)(boxes / g->rounds), d[1].boxes = 0;
    d[0].reach = 2 + (int)(GRID_CUT * sqrt(4 * texels));
    d[1].reach = 2 + (int)(GRID_CUT * sqrt(3 * texels));
    g->wide = g->half + d[0].reach + d[1].reach;
}

/* The floats of the weights that a shape needs, and of all else for images of `side` knots. */
static inline size_t grid_weights(const grid *g) {
    int a = g->kernels[0].reach, b = g->kernels[1].reach;
    return (size_t)g->wide *
           (size_t)((g->wide + a) * (2 * a + 1) + (g->wide + b) * (2 * b + 1) + 4 * g->wide);
}

static inline size_t grid_floats(int side) {
    size_t s = (size_t)side;
    return GRID_KNOT * (s * s + 2 * s + 2 * GRID_TAPS + 8) + 6 * (s + 3 * GRID_TAPS) + 16;
}

/* p: grid_floats(side) and room for the weights of any shape that g will have. */
static inline void grid_lay_out(grid *g, int side, float *p) {
    size_t s = (size_t)side, table = s + 3 * GRID_TAPS;
    p += (64 - (size_t)p % 64) / sizeof *p; /* vectors that do not cross lines of the cache */
    g->side = side, g->image = p, p += s * s * GRID_KNOT;
    g->line = p, p += (2 * s + 2 * GRID_TAPS + 8) * GRID_KNOT;
    g->a = p + GRID_TAPS, g->s = g->a + table, g->r = g->s + table, g->g = g->r + table;
    g->h = g->g + table, g->sum = g->h + table, g->kernels[0].weights = p + 6 * table;
}

/* The heat kernel: the image through all rounds. */
static inline void grid_run(grid *g) {
    static const int order[2][3] = {{GRID_U, GRID_V, GRID_D}, {GRID_D, GRID_V, GRID_U}};
    int i, k;
    size_t lines = (size_t)g->wide;
    for (k = 0; k < 2; ++k) {
        grid_kernels *d = g->kernels + k;
        if (k) d->weights = (float *)(g->kernels[0].reaches + 2 * lines * lines);
        d->reaches = (int *)grid_row(g, d, g->wide, -d->reach);
        for (i = 0; i < g->wide; ++i) grid_weigh(g, d, i);
    }
    for (i = 0; i < g->rounds; ++i) {
        int px = g->wide - g->half, py = px;
        grid_border(g);
        for (k = 0; k < 3; ++k) grid_pass(g, order[i % 2][k], &px, &py);
    }
}

#endif /* METHOD_SEPARABLE_GRID_H */
