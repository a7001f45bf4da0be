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

   Weights are the same for the six faces and for both halves of one: each row of them is made once
   for the 36 rows that it filters. A face goes on beyond its edges as far as the passes reach, from
   its neighbours' texels by Catmull-Rom: across the edge a row is a row, along it is stretched.

   Domain: even sides.  Fails: a lamp of a few texels on a face's axis, where |uv| has its kink, and
   on an edge: 0.2 to 0.4 % rms.  Tests: a_chain_* in tests/test_methods_gaussian.c.

   SPDX-License-Identifier: MIT */

#ifndef METHOD_SEPARABLE_GRID_H
#define METHOD_SEPARABLE_GRID_H

#include "methods.h"

#define GRID_ROUND  0.07  /* a wider sigma is done in rounds: beyond its edges a plane goes far */
#define GRID_PLAIN  0.015 /* a thinner one in the plain order, U V D                          */
#define GRID_CUT    3.2   /* sigmas at which a kernel ends                                    */
#define GRID_BLOCK  16    /* texels that share a reach                                        */
#define GRID_TAPS   64    /* the most that a kernel reaches                                   */
#define GRID_BORDER 192   /* the most that the passes of a round do                           */

/* Floats that are filtered at once. */
#if defined(__GNUC__) && defined(__AVX__)
typedef float grid_lanes __attribute__((vector_size(32)));
#elif defined(__GNUC__)
typedef float grid_lanes __attribute__((vector_size(16)));
#else
typedef float grid_lanes;
#endif
#define GRID_LANES ((int)(sizeof(grid_lanes) / sizeof(float)))

/* GCC, tuned for Zen, would load a weight anew for each of its three uses: this keeps it. */
#if defined(__AVX__) && defined(__GNUC__) && !defined(__clang__)
#define GRID_KEEP(x) __asm__("" : "+x"(x))
#else
#define GRID_KEEP(x) (void)(x)
#endif

typedef struct grid_direction {
    float *a, *s, *g; /* variance in texels^2, place in sigmas, sqrt(m) a^(-1/4): [rows][stride] */
    int step, reach;
} grid_direction;

typedef struct grid {
    float *image,
        *other;     /* [6][3][side][stride]                                                  */
    float *m;       /* rho^-3, as the directions' tables                                     */
    float *weights; /* [2 GRID_TAPS + 1][stride]                                             */
    float *strip;
    int *reach; /* of a row's blocks */
    grid_direction direction[3];
    int n, border, pad, side, stride, rows; /* pad: the border and what makes blocks meet midway */
} grid;

static inline float *grid_texel(const grid *g, float *image, int plane, int x, int y) {
    return image + ((size_t)plane * (size_t)g->side + (size_t)(y + g->pad)) * (size_t)g->stride +
           (size_t)(x + g->pad);
}

/* Catmull-Rom: what the four texels around a place weigh; returns the first. */
static inline int grid_cubic(float w[4], float at) {
    int i = (int)(at + 1024) - 1024; /* floorf would be a call */
    float f = at - (float)i, g = 1 - f, p = -0.5f * f * g;
    w[0] = p * g, w[1] = g - p * (2 * g - f), w[2] = f - p * (2 * f - g), w[3] = p * f;
    return i - 1;
}

/* --------------------------------------------------------------------------------- >>weights -- */

static inline double grid_at(const grid *g, int x) { return (2.0 * (x - g->pad) + 1) / g->n - 1; }

/* The directions' variances: `variance` of the lobe in all passes together, `boxes` of the level's
   texels in U and V, of which there are `halves` passes each. */
static inline void grid_variances(grid *g, double variance, double boxes, int halves) {
    int x, y;
    double scale = variance * 0.25 * g->n * g->n;
    float part = 1 / (float)halves;
    for (y = 0; y < g->rows; ++y) {
        float v = (float)grid_at(g, y), least = 1e-4f;
        size_t row = (size_t)y * (size_t)g->stride;
        float *m = g->m + row, *a[3];
        for (x = 0; x < 3; ++x) a[x] = g->direction[x].a + row;
        for (x = 0; x < g->stride; ++x) {
            float u = (2 * (float)(x - g->pad) + 1) / (float)g->n - 1, uv = fabsf(u * v);
            float rho2 = 1 + u * u + v * v, f = (float)scale * rho2, half = part * (float)boxes;
            float du = part * f * (1 + u * u - uv) - half, dv = part * f * (1 + v * v - uv) - half;
            a[0][x] = du > least ? du : least, a[1][x] = dv > least ? dv : least;
            a[2][x] = f * uv > least ? f * uv : least;
            m[x] = 1 / (rho2 * sqrtf(rho2));
        }
    }
}

/* s and g of a direction, from a and m. */
static inline void grid_places(const grid *g, grid_direction *d) {
    int x, y;
    size_t i, count = (size_t)g->rows * (size_t)g->stride;
    for (i = 0; i < count; ++i) d->g[i] = 1 / sqrtf(d->a[i]), d->s[i] = 0;
    for (y = d->step >= g->stride; y < g->rows; ++y) {
        float *s = d->s + (size_t)y * (size_t)g->stride, *q = d->g + (s - d->s);
        for (x = d->step % g->stride; x < g->stride; ++x)
            s[x] = s[x - d->step] + 0.5f * (q[x - d->step] + q[x]);
    }
    for (i = 0; i < count; ++i) d->g[i] = sqrtf(g->m[i] * d->g[i]);
}

/* exp(-d^2 / 2), to 1e-4 of itself where it counts. */
static inline float grid_bell(float d) {
    float t = d * d * (-1.0f / 64), e;
    t = t > -1 ? t : -1;
    e = 1 + t * (1 + t * (0.5f + t * (1.0f / 6 + t * (1.0f / 24))));
    e *= e, e *= e, e *= e, e *= e;
    return e * e;
}

/* Texels that a kernel as thin as this sees only by its moments. */
#define GRID_THIN 0.5f

/* The five taps' outer ones; v their variance. */
static inline float grid_five(int k, float v) {
    float two = (3 * v * v - v) / 24;
    return k == 2 || k == -2 ? two : 0.5f * v - 4 * two;
}

static inline float *grid_weights(const grid *g, int k) {
    return g->weights + (size_t)(k + GRID_TAPS) * (size_t)g->stride;
}

/* Tap k of a block of texels at `at`. sum: of the taps so far; last: what thin ones keep. */
static inline void grid_tap(const grid_direction *d, size_t at, int k, float *w, float *sum) {
    const float *s = d->s + at, *next = s + k * d->step, *there = d->g + at + k * d->step;
    int x;
    for (x = 0; x < GRID_BLOCK; ++x) w[x] = grid_bell(next[x] - s[x]) * there[x];
    for (x = 0; x < GRID_BLOCK; ++x) sum[x] += w[x];
}

static inline void grid_thin(const grid *g, const grid_direction *d, size_t at, int k, float *w,
                             float *middle) {
    const float *a = d->a + at, *m = g->m + at;
    int x, to = k * d->step;
    for (x = 0; x < GRID_BLOCK; ++x) {
        float thin = grid_five(k, 0.5f * (a[x] + a[x + to])) * 0.5f * (1 + m[x + to] / m[x]);
        thin = a[x] < GRID_THIN ? thin : 0;
        w[x] += thin, middle[x] -= thin;
    }
}

/* The texels of a block at x of row y that have a tap k. On a diagonal the variance is 0 where it
   crosses an axis: nothing gets across. */
static inline int grid_count(const grid *g, int which, int x, int y, int k) {
    int half = g->n / 2, left = half - k - x;
    if (which < 2 || k < 0) return GRID_BLOCK;
    return y + k >= half || left < 0 ? 0 : left > GRID_BLOCK ? GRID_BLOCK : left;
}

/* The weights of a block at x of row y, on the left half; returns how far they reach. */
static inline int grid_block(const grid *g, int which, int x, int y) {
    const grid_direction *d = g->direction + which;
    size_t at = (size_t)(y + g->pad) * (size_t)g->stride + (size_t)(x + g->pad);
    float *middle = grid_weights(g, 0) + x + g->pad, sum[GRID_BLOCK], widest = 0, least = 1e9f;
    int i, k, reach;
    for (i = 0; i < GRID_BLOCK; ++i) {
        float a = d->a[at + (size_t)i];
        widest = a > widest ? a : widest, least = a < least ? a : least;
        sum[i] = d->g[at + (size_t)i];
    }
    reach = (int)(GRID_CUT * (double)sqrtf(widest)) + 1;
    reach = reach > d->reach ? d->reach : reach < 2 ? 2 : reach;
    for (k = -reach; k <= reach; ++k) {
        float *w = grid_weights(g, k) + x + g->pad;
        if (k) grid_tap(d, at, k, w, sum);
        for (i = grid_count(g, which, x, y, k); i < GRID_BLOCK; ++i) sum[i] -= w[i], w[i] = 0;
    }
    for (i = 0; i < GRID_BLOCK; ++i) {
        int thin = d->a[at + (size_t)i] < GRID_THIN;
        float all = 1 / sum[i];
        sum[i] = thin ? 0 : all, middle[i] = thin ? 1 : all * d->g[at + (size_t)i];
    }
    for (k = -reach; k <= reach; ++k) {
        float *w = grid_weights(g, k) + x + g->pad;
        for (i = 0; k && i < GRID_BLOCK; ++i) w[i] *= sum[i];
        if (least >= GRID_THIN || !k || k < -2 || k > 2) continue;
        grid_thin(g, d, at, k, w, middle);
        for (i = grid_count(g, which, x, y, k); i < GRID_BLOCK; ++i) middle[i] += w[i], w[i] = 0;
    }
    return reach;
}

/* The weights of row y of the upper half of a face, and how far they reach in each block: the left
   half, and its mirror image. */
static inline void grid_row(const grid *g, int which, int y) {
    int x, k, b, wide = g->n + 2 * g->pad, blocks = wide / GRID_BLOCK, most = 0;
    for (b = 0; 2 * b < blocks; ++b) {
        int reach = grid_block(g, which, b * GRID_BLOCK - g->pad, y);
        g->reach[b] = g->reach[blocks - 1 - b] = reach;
        most = reach > most ? reach : most;
    }
    for (k = -most; k <= most; ++k) {
        const float *from = grid_weights(g, which ? k : -k);
        float *to = grid_weights(g, k) + wide - 1;
        for (x = 0; 2 * x < wide; ++x) to[-x] = from[x];
    }
}

/* ---------------------------------------------------------------------------------- >>passes -- */

/* Blocks `from` .. `to` of a row of the three planes of a face; tap k lies `step` k texels off. */
static inline void grid_sum(const grid *g, float *out, const float *in, int step, int from,
                            int to) {
    size_t stride = (size_t)g->stride, plane = (size_t)g->side * stride;
    int b, x, k;
    for (b = from; b < to; ++b)
        for (x = b * GRID_BLOCK; x < (b + 1) * GRID_BLOCK; x += 2 * GRID_LANES) {
            int reach = g->reach[b];
            const float *weight = grid_weights(g, -reach) + x, *tap = in + x - reach * step;
            float *result = out + x;
            grid_lanes r = {0}, r2 = {0}, e = {0}, e2 = {0}, l = {0}, l2 = {0}, v, u, t;
            for (k = -reach; k <= reach; ++k, weight += stride, tap += step) {
                memcpy(&v, weight, sizeof v), memcpy(&u, weight + GRID_LANES, sizeof u);
                GRID_KEEP(v);
                GRID_KEEP(u);
                memcpy(&t, tap, sizeof t), r += v * t;
                memcpy(&t, tap + GRID_LANES, sizeof t), r2 += u * t;
                memcpy(&t, tap + plane, sizeof t), e += v * t;
                memcpy(&t, tap + plane + GRID_LANES, sizeof t), e2 += u * t;
                memcpy(&t, tap + 2 * plane, sizeof t), l += v * t;
                memcpy(&t, tap + 2 * plane + GRID_LANES, sizeof t), l2 += u * t;
            }
            memcpy(result, &r, sizeof r), memcpy(result + GRID_LANES, &r2, sizeof r);
            result += plane;
            memcpy(result, &e, sizeof r), memcpy(result + GRID_LANES, &e2, sizeof r);
            result += plane;
            memcpy(result, &l, sizeof r), memcpy(result + GRID_LANES, &l2, sizeof r);
        }
}

/* One pass over what is valid around the faces: px texels beyond their sides, py above and below;
   the pass makes them fewer. */
static inline void grid_pass(grid *g, int which, int *px, int *py) {
    const grid_direction *d = g->direction + which;
    float *swap = g->image;
    int face, half, y, s = g->stride, first, last, middle;
    if (which != 1) *px -= d->reach;
    if (which != 0) *py -= d->reach;
    first = (g->pad - *px) / GRID_BLOCK;
    last = (g->pad + g->n + *px + GRID_BLOCK - 1) / GRID_BLOCK;
    middle = (g->pad + g->n / 2) / GRID_BLOCK;
    for (y = -*py; 2 * y < g->n; ++y) {
        grid_row(g, which, y);
        for (face = 0; face < 6; ++face)
            for (half = 0; half < 2; ++half) {
                float *to = grid_texel(g, g->other, 3 * face, -g->pad, half ? g->n - 1 - y : y);
                const float *from = g->image + (to - g->other);
                int step = which == 0 ? 1 : which == 1 ? (half ? -s : s) : half ? 1 - s : 1 + s;
                grid_sum(g, to, from, step, first, which < 2 ? last : middle);
                if (which == 2) grid_sum(g, to, from, half ? -1 - s : s - 1, middle, last);
            }
    }
    g->image = g->other, g->other = swap;
}

/* ---------------------------------------------------------------------------------- >>border -- */

/* Where the texels beyond an edge are found: the i-th along it, j deep, at
   from + i from_along + j from_deep in the neighbour's plane; to: the same on this face. */
typedef struct grid_edge {
    int from, from_along, from_deep, to, to_along, to_deep, face;
} grid_edge;

static inline int grid_place(const grid *g, const float dir[3], int *face) {
    float u, v;
    envmap_coordinates(face, &u, &v, ENVMAP_CUBE, dir);
    return ((int)(v * (float)g->n) + g->pad) * g->stride + (int)(u * (float)g->n) + g->pad;
}

static inline void grid_find_edge(grid_edge *e, const grid *g, int face, int side) {
    float m[3], a[3], b[3], dir[3], half = 0.5f / (float)g->n;
    int c, k, at[3], n = g->n, out = side & 1 ? 1 : -1;
    envmap_direction(m, ENVMAP_CUBE, face, 0.5f, 0.5f);
    envmap_direction(a, ENVMAP_CUBE, face, side < 2 ? 0.5f * (float)(1 + out) : 0.5f,
                     side < 2 ? 0.5f : 0.5f * (float)(1 + out));
    envmap_direction(b, ENVMAP_CUBE, face, side < 2 ? 0.5f : 1, side < 2 ? 1 : 0.5f);
    for (k = 0; k < 3; ++k) { /* the first texel, the next one along, the next one deep */
        float t = 2 * half * (k == 1 ? 3.0f : 1.0f) - 1, z = 1 - 2 * half * (k == 2 ? 3.0f : 1.0f);
        for (c = 0; c < 3; ++c)
            dir[c] = a[c] * 1.41421356f - m[c] + t * (b[c] * 1.41421356f - m[c]) + z * m[c];
        at[k] = grid_place(g, dir, &e->face);
    }
    e->from = at[0], e->from_along = at[1] - at[0], e->from_deep = at[2] - at[0];
    e->to_along = side < 2 ? g->stride : 1;
    e->to_deep = (side < 2 ? 1 : g->stride) * out;
    e->to = g->pad * (g->stride + 1) + (out > 0 ? (n - 1) * e->to_deep : 0);
}

/* What the row `depth` beyond any edge is made of: deep[] of four rows from `first` on, stretched
   by 1 / f: weight[] of four texels from at[] on. */
typedef struct grid_beyond {
    float deep[4], *weight; /* [4][stride] */
    int *at, first;
} grid_beyond;

static inline void grid_stretch(const grid *g, grid_beyond *r, int depth) {
    int i, k, n = g->n, count = n + 2 * depth + 2;
    float f = 1 / (1 + (2 * (float)depth + 1) / (float)n), w[4];
    r->weight = g->strip + (size_t)(2 * g->border + 8 + 5 * depth) * (size_t)g->stride;
    r->at = (int *)(r->weight + 4 * g->stride);
    r->first = grid_cubic(r->deep, (1 - f) * 0.5f * (float)n - 0.5f);
    for (i = 0; i < count; ++i) {
        float x = (float)(i - depth - 1);
        int at = grid_cubic(w, (x + 0.5f - 0.5f * (float)n) * f + 0.5f * (float)(n - 1));
        r->at[i] = at < -2 ? -2 : at > n - 2 ? n - 2 : at;
        for (k = 0; k < 4; ++k) r->weight[k * g->stride + i] = w[k];
    }
}

/* Row `depth` in `to`, from the neighbour's rows in `from`. row: room for one */
static inline void grid_edge_row(const grid *g, const grid_beyond *r, int depth, float *to,
                                 const float *from, float *row) {
    const float *deep = r->deep, *w = r->weight, *source[4];
    int i, k, n = g->n, count = n + 2 * depth + 2, s = g->stride;
    for (k = 0; k < 4; ++k) {
        int at = r->first + k < 0 ? 0 : r->first + k > n - 1 ? n - 1 : r->first + k;
        source[k] = from + at * s;
    }
    row += 2;
    for (i = 0; i < n; ++i)
        row[i] = deep[0] * source[0][i] + deep[1] * source[1][i] + deep[2] * source[2][i] +
                 deep[3] * source[3][i];
    row[-2] = row[-1] = row[0], row[n] = row[n + 1] = row[n - 1];
    for (i = 0; i < count; ++i) {
        const float *tap = row + r->at[i];
        to[i] = w[i] * tap[0] + w[s + i] * tap[1] + w[2 * s + i] * tap[2] + w[3 * s + i] * tap[3];
    }
}

/* One plane beyond one edge. Rows of the neighbour, and those that they make, lie in g->strip as if
   along the edge were along x. */
static inline void grid_edge_rows(const grid *g, const grid_edge *e, const grid_beyond *r,
                                  float *to, const float *from) {
    int i, k, s = g->stride, rows = g->border + 4, n = g->n;
    float *near_rows = g->strip, *made = near_rows + rows * s, *row = made + g->border * s;
    if (rows > n) rows = n;
    from += e->from, to += e->to;
    if (e->from_along == 1 || e->from_along == -1)
        for (k = 0; k < rows; ++k)
            for (i = 0; i < n; ++i)
                near_rows[k * s + i] = from[i * e->from_along + k * e->from_deep];
    else
        for (i = 0; i < n; ++i)
            for (k = 0; k < rows; ++k)
                near_rows[k * s + i] = from[i * e->from_along + k * e->from_deep];
    for (k = 0; k < g->border; ++k) {
        float *out = e->to_along == 1 ? to + (k + 1) * e->to_deep - k - 1 : made + k * s;
        grid_edge_row(g, r + k, k, out, near_rows, row);
    }
    for (i = -g->border; i < n + g->border && e->to_along != 1; ++i) {
        int first = i < 0 ? -1 - i : i < n ? 0 : i - n;
        for (k = first; k < g->border; ++k)
            to[i * e->to_along + (k + 1) * e->to_deep] = made[k * s + i + k + 1];
    }
}

static inline void grid_border(const grid *g) {
    int i, c;
    size_t plane = (size_t)g->side * (size_t)g->stride;
    grid_beyond rows[GRID_BORDER];
    for (i = 0; i < g->border; ++i) grid_stretch(g, rows + i, i);
    for (i = 0; i < 24; ++i) {
        grid_edge e;
        grid_find_edge(&e, g, i / 4, i % 4);
        for (c = 0; c < 3; ++c)
            grid_edge_rows(g, &e, rows, g->image + (size_t)(i / 4 * 3 + c) * plane,
                           g->image + (size_t)(3 * e.face + c) * plane);
    }
}

/* ---------------------------------------------------------------------------------- >>levels -- */

/* The faces, `edge` texels a side: as they are, or halved: means of 2 x 2 texels, weighted by the
   roots of their solid angles as the passes' kernels are; of a variance of 1/4 texel^2. */
static inline void grid_halve(const grid *g, float *below, int edge) {
    int plane, x, y;
    for (plane = 0; plane < 18; ++plane)
        for (y = 0; y < edge; ++y, below += edge) {
            const float *t = grid_texel(g, g->image, plane, 0, edge < g->n ? 2 * y : y);
            const float *s = t + g->stride, *m, *w;
            int upper = 4 * y < g->n, row = g->pad + (upper ? 2 * y : g->n - 1 - 2 * y);
            if (edge == g->n) memcpy(below, t, (size_t)edge * sizeof *below);
            if (edge == g->n) continue;
            m = g->m + row * g->stride + g->pad, w = m + (upper ? g->stride : -g->stride);
            for (x = 0; x < edge; ++x) {
                float sum = m[2 * x] * t[2 * x] + m[2 * x + 1] * t[2 * x + 1] +
                            w[2 * x] * s[2 * x] + w[2 * x + 1] * s[2 * x + 1];
                below[x] = sum / (m[2 * x] + m[2 * x + 1] + w[2 * x] + w[2 * x + 1]);
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

/* Passes along a row, and along a column: a Gaussian this thin hardly sees their order. */
static inline int grid_halves(double variance) {
    return variance < GRID_PLAIN * GRID_PLAIN ? 1 : 2;
}

/* Shapes g for faces of n texels and a variance; returns the floats that it then needs. */
static inline size_t grid_shape(grid *g, int n, double variance) {
    double texels = sqrt(variance / grid_rounds(n, variance)) * 0.5 * n;
    int halves = grid_halves(variance);
    g->n = n;
    g->direction[0].reach = 2 + (int)(GRID_CUT * sqrt(4.0 / halves) * texels);
    g->direction[1].reach = g->direction[0].reach;
    g->direction[2].reach = 2 + (int)(GRID_CUT * sqrt(3.0) * texels);
    g->border = halves * g->direction[0].reach + g->direction[2].reach;
    g->pad = g->border + GRID_BLOCK - (n / 2 + g->border - 1) % GRID_BLOCK - 1;
    g->side = n + 2 * g->pad;
    g->stride = g->side + GRID_BLOCK;
    g->rows = g->pad + n / 2 + g->direction[2].reach + 1;
    return (size_t)g->stride * (36 * (size_t)g->side + 10 * (size_t)g->rows + 2 * GRID_TAPS + 16 +
                                7 * (size_t)g->border);
}

static inline void grid_lay_out(grid *g, float *p) {
    size_t stride = (size_t)g->stride, image = 18 * stride * (size_t)g->side;
    size_t table = stride * (size_t)g->rows;
    int k;
    g->image = p, p += image + stride, g->other = p, p += image + stride;
    g->m = p + stride, p += table + stride;
    for (k = 0; k < 3; ++k) {
        grid_direction *d = g->direction + k;
        d->a = p, p += table, d->s = p, p += table, d->g = p, p += table;
        d->step = (k > 0 ? g->stride : 0) + (k != 1);
    }
    g->weights = p, p += stride * (2 * GRID_TAPS + 1), g->strip = p,
    p += stride * (size_t)(7 * g->border + 9);
    g->reach = (int *)p;
}

/* The heat kernel of a variance: the image through all rounds. */
static inline void grid_run(grid *g, double variance, double boxes) {
    static const int order[] = {0, 1, 2, 1, 0};
    int i, k, rounds = grid_rounds(g->n, variance), halves = grid_halves(variance);
    grid_variances(g, variance / rounds, boxes / rounds, halves);
    for (k = 0; k < 3; ++k) grid_places(g, g->direction + k);
    for (i = 0; i < rounds; ++i) {
        int px = g->border, py = g->border;
        grid_border(g);
        for (k = 0; k < 2 * halves + 1; ++k) grid_pass(g, order[k], &px, &py);
    }
}

/* Faces that grid_halve made. */
static inline void grid_take(const grid *g, const float *level) {
    int plane, y;
    for (plane = 0; plane < 18; ++plane)
        for (y = 0; y < g->n; ++y, level += g->n)
            memcpy(grid_texel(g, g->image, plane, 0, y), level, (size_t)g->n * sizeof *level);
}

static inline void grid_load(const grid *g, const envmap *map) {
    int face, x, y, c;
    for (face = 0; face < 6; ++face)
        for (y = 0; y < g->n; ++y) {
            const float *texel = envmap_texel(map, 0, 0, face, 0, y);
            for (c = 0; c < 3; ++c) {
                float *mine = grid_texel(g, g->image, 3 * face + c, 0, y);
                for (x = 0; x < g->n; ++x) mine[x] = texel[3 * x + c];
            }
        }
}

/* A level of a cube from the image, or from what grid_halve made. */
static inline void grid_store(const grid *g, envmap *map, int level, const float *halved,
                              float scale) {
    int face, x, y, c, n = halved ? g->n / 2 : g->n;
    for (face = 0; face < 6; ++face)
        for (y = 0; y < n; ++y) {
            float *texel = envmap_texel(map, level, 0, face, 0, y);
            const float *from[3];
            for (c = 0; c < 3; ++c)
                from[c] = halved ? halved + ((3 * face + c) * n + y) * n
                                 : grid_texel(g, g->image, 3 * face + c, 0, y);
            for (x = 0; x < n; ++x, texel += 3)
                texel[0] = scale * from[0][x], texel[1] = scale * from[1][x],
                texel[2] = scale * from[2][x];
        }
}

#endif /* METHOD_SEPARABLE_GRID_H */
