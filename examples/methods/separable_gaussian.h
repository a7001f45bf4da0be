/* separable_gaussian.h - LTASG, the linear-time approximate spherical Gaussian: a cube is filtered
   by three passes of one dimension, one along each axis.

   With A_i(x) = sigma (a_i - x (x.a_i)) along the axes a_1, a_2, a_3, sum A_i A_i^T = sigma^2
   (I - x x^T): the passes' steps add up to one isotropic Gaussian, the heat kernel
   exp(-l(l+1) sigma^2 / 2) on band l, for small sigma. A step of parameter t along A / sigma leads
   from x to x + a (s (cosh t - 1) + sinh t), s = x.a: along the meridian about a, where
   tau = atanh(s) grows by t. Seen on a face of the cube meridians are straight lines: columns or
   rows of the four side faces (u = w sinh tau, w^2 = 1 + v^2), rays on the two pole faces
   (r = 1 / sinh |tau|). So a pass sums the texels of its line, each weighted by
   exp(-(tau' - tau)^2 / 2 sigma^2) dtau: no interpolation along it. Where the Gaussian is thinner
   than a texel (everywhere near a pole), three texels with its mean and variance stand in.

   Published (hyper3d-envmapgen's write-up): steps straight on the face, u' = u + rho t, on the
   pole face r' = r (1 - rho t), rho^2 = 1 + u^2 + v^2, which drift to the face's centre by
   sigma^2 tan(angle) and leave a seam; order X Y Z; sigma^2 = 1/N, the lobe's curvature at its
   peak; plain boxes shrink. Its program works in `rounds` of three passes, at least two, and makes
   each level from the one before. Mended: the exact flow, order X/2 Y/2 Z/2 Z/2 Y/2 X/2, in rounds
   of at most sigma 0.1, Catmull-Rom wherever lookups fall between texels (bilinear ones would widen
   the kernel), sigma by the lobe's first harmonic; boxes by solid angle, and the variance that they
   add (texel^2 / 12) is taken off. Chains go along the grid (separable_grid.h).

   Domain: lobes like a Gaussian: sigma <= 0.36 and no more than 20 % rms from its heat
   kernel (Phong N >= 7, not GGX, not diffuse). Fails: tails; a wide sigma, as passes do not
   commute.  Tests: separable_* in tests/methods/test_methods_gaussian.c.

   SPDX-License-Identifier: MIT */

#ifndef METHOD_SEPARABLE_GAUSSIAN_H
#define METHOD_SEPARABLE_GAUSSIAN_H

#include "methods.h"
#include "separable_grid.h"

#define SEPARABLE_SIGMA  0.36
#define SEPARABLE_MISFIT 0.20
#define SEPARABLE_ROUND  0.1 /* what is wider is done in rounds: the passes do not commute */
#define SEPARABLE_FINE   64  /* smaller levels of a chain are filtered at this edge */
#define SEPARABLE_CUT    3.8 /* sigmas at which a kernel ends: it loses 0.2 % of its variance */

/* Where a cell of the border is found: sixteen texels and what they weigh. */
typedef struct separable_cell {
    int at[16], to;
    float weight[16];
} separable_cell;

typedef struct separable {
    float *image, *other; /* [6][side][side][4], side = n + 2 pad */
    separable_cell *border;
    float *rows, *rays; /* weights [lines][n][taps] and [lines][lines][taps], taps 2 reach + 1 */
    unsigned char *row_reach, *ray_reach;
    int n, lines, pad, side, reach, cells;
    int published;
} separable;

/* ---------------------------------------------------------------------------------- >>border -- */

static inline int separable_at(const separable *s, int face, int x, int y) {
    return (face * s->side + y + s->pad) * s->side + x + s->pad;
}

static inline void separable_cell_of(const separable *s, separable_cell *cell, int face, int x,
                                     int y) {
    float m[3], a[3], b[3], dir[3], u, v, wx[4], wy[4];
    int k, c, other, n = s->n;
    envmap_direction(m, ENVMAP_CUBE, face, 0.5f, 0.5f);
    envmap_direction(a, ENVMAP_CUBE, face, 1, 0.5f),
        envmap_direction(b, ENVMAP_CUBE, face, 0.5f, 1);
    for (c = 0; c < 3; ++c) { /* the face's plane goes on: m + X e_u + Y e_v */
        float e_u = a[c] * 1.41421356f - m[c], e_v = b[c] * 1.41421356f - m[c];
        dir[c] = m[c] + (2 * (float)x + 1 - (float)n) / (float)n * e_u +
                 (2 * (float)y + 1 - (float)n) / (float)n * e_v;
    }
    envmap_coordinates(&other, &u, &v, ENVMAP_CUBE, dir);
    x = grid_cubic(wx, u * (float)n - 0.5f), y = grid_cubic(wy, v * (float)n - 0.5f);
    for (k = 0; k < 16; ++k) {
        int i = x + k % 4, j = y + k / 4;
        i = i < 0 ? 0 : i >= n ? n - 1 : i, j = j < 0 ? 0 : j >= n ? n - 1 : j;
        cell->at[k] = separable_at(s, other, i, j);
        cell->weight[k] = wx[k % 4] * wy[k / 4];
    }
}

static inline void separable_border(separable *s) {
    int face, x, y;
    separable_cell *cell = s->border;
    for (face = 0; face < 6; ++face)
        for (y = -s->pad; y < s->n + s->pad; ++y)
            for (x = -s->pad; x < s->n + s->pad; ++x) {
                if (y >= 0 && y < s->n && x == 0) x = s->n;
                if (x >= s->n + s->pad) continue;
                cell->to = separable_at(s, face, x, y);
                separable_cell_of(s, cell++, face, x, y);
            }
    s->cells = (int)(cell - s->border);
}

/* Writes the border of every face from its neighbours. */
static inline void separable_fill_border(separable *s) {
    int i, k, c;
    for (i = 0; i < s->cells; ++i) {
        const separable_cell *cell = s->border + i;
        float sum[4] = {0, 0, 0, 0};
        for (k = 0; k < 16; ++k)
            for (c = 0; c < 4; ++c)
                sum[c] += cell->weight[k] * s->image[4 * (size_t)cell->at[k] + (size_t)c];
        memcpy(s->image + 4 * (size_t)cell->to, sum, sizeof sum);
    }
}

/* --------------------------------------------------------------------------------- >>weights -- */

/* Three texels of a mean and a variance (in texels) that is too small for a sum to see. */
static inline void separable_three(float *w, double mean, double variance) {
    double square = variance + mean * mean;
    w[-1] = (float)((square - mean) / 2), w[1] = (float)((square + mean) / 2);
    w[0] = (float)(1 - square);
}

static inline void separable_normalise(float *w, int reach) {
    double sum = 0;
    int k;
    for (k = -reach; k <= reach; ++k) sum += (double)w[k];
    for (k = -reach; k <= reach; ++k) w[k] = (float)((double)w[k] / sum);
}

/* Texel m of a line of a side face, u along the line; tau and step [-pad .. n+pad) of the line.
   Returns how far the weights reach. */
static inline int separable_row(const separable *s, float *w, const double *tau, const double *step,
                                double u, double v, int m, double sigma) {
    double rho2 = 1 + u * u + v * v, half = 0.5 * s->n;
    double variance = sigma * sigma * rho2 * half * half, scale = -0.5 / (sigma * sigma);
    int k, reach = (int)ceil(SEPARABLE_CUT * sqrt(variance) * (1 + 2 * sigma));
    memset(w, 0, (size_t)(2 * s->reach + 1) * sizeof *w), w += s->reach;
    if (variance < 0.5) {
        separable_three(w, s->published ? 0 : 0.5 * sigma * sigma * u * half, variance);
        return 1;
    }
    if (reach > s->reach) reach = s->reach;
    for (k = -reach; k <= reach; ++k) {
        double t = s->published ? k / (half * sqrt(rho2)) : tau[m + k] - tau[m];
        w[k] = (float)(exp(scale * t * t) * (s->published ? 1 : step[m + k]));
    }
    separable_normalise(w, reach);
    return reach;
}

/* The texel at (u,v), u >= v >= 0, of a pole face: steps along u, and v/u times as far along v. */
static inline int separable_ray(const separable *s, float *w, double u, double v, double sigma) {
    double slope = u > 0 ? 1 + v * v / (u * u) : 1, rho2 = 1 + u * u * slope, half = 0.5 * s->n;
    double variance = sigma * sigma * rho2 * u * u * half * half, scale = -0.5 / (sigma * sigma);
    double tau = u > 0 ? asinh(1 / (u * sqrt(slope))) : 0;
    int k, reach = (int)ceil(SEPARABLE_CUT * sqrt(variance) * (1 + 4 * sigma));
    memset(w, 0, (size_t)(2 * s->reach + 1) * sizeof *w), w += s->reach;
    if (variance < 0.5) {
        double mean = s->published ? 0 : (rho2 - 0.5) * sigma * sigma * u * half;
        separable_three(w, mean, variance);
        return 1;
    }
    if (reach > s->reach) reach = s->reach;
    for (k = -reach; k <= reach; ++k) {
        double at = u + k / half, r = at * sqrt(slope), t;
        if (!(at > 0)) continue;
        t = s->published ? (1 - at / u) / sqrt(rho2) : asinh(1 / r) - tau;
        w[k] = (float)(exp(scale * t * t) * (s->published ? 1 : 1 / (at * sqrt(1 + r * r))));
    }
    separable_normalise(w, reach);
    return reach;
}

/* Faces are symmetric: class q of a column or row stands for two, (2q+1)/n off the middle. */
static inline int separable_class(int n, int x) { return abs(2 * x + 1 - n) / 2; }

static inline double separable_off(int n, int q) { return (2.0 * q + 1 - n % 2) / n; }

/* The weights of a pass. tau: room for 2 side numbers */
static inline void separable_weights(separable *s, double sigma, double *tau) {
    int q, m, n = s->n, taps = 2 * s->reach + 1;
    double *step = tau + s->side;
    for (q = 0; q < s->lines; ++q) {
        double v = separable_off(n, q), w = sqrt(1 + v * v);
        for (m = 0; m < s->side && !s->published; ++m) {
            double u = (2.0 * (m - s->pad) + 1) / n - 1;
            tau[m] = asinh(u / w), step[m] = 1 / sqrt(w * w + u * u);
        }
        for (m = 0; m < n; ++m)
            s->row_reach[q * n + m] = (unsigned char)separable_row(
                s, s->rows + (size_t)(q * n + m) * (size_t)taps, tau + s->pad, step + s->pad,
                (2.0 * m + 1) / n - 1, v, m, sigma);
        for (m = 0; m <= q; ++m)
            s->ray_reach[q * s->lines + m] =
                (unsigned char)separable_ray(s, s->rays + (size_t)(q * s->lines + m) * (size_t)taps,
                                             v, separable_off(n, m), sigma);
    }
}

/* ---------------------------------------------------------------------------------- >>passes -- */

/* One side face; dx, dy the line's direction in texels: (1,0) or (0,1). */
static inline void separable_side(separable *s, int face, int dx, int dy) {
    int x, y, k, c, n = s->n, taps = 2 * s->reach + 1, stride = 4 * (dx + dy * s->side);
    for (y = 0; y < n; ++y)
        for (x = 0; x < n; ++x) {
            int line = separable_class(n, dx ? y : x) * n + (dx ? x : y), reach;
            const float *w = s->rows + (size_t)line * (size_t)taps + s->reach;
            size_t at = 4 * (size_t)separable_at(s, face, x, y);
            const float *tap = s->image + at;
            float sum[4] = {0, 0, 0, 0};
            reach = s->row_reach[line];
            for (k = -reach; k <= reach; ++k)
                for (c = 0; c < 4; ++c) sum[c] += w[k] * tap[k * stride + c];
            memcpy(s->other + at, sum, sizeof sum);
        }
}

/* One texel of a pole face: `along` and `across` are the strides (in floats) of the direction of
   the steps, outwards, and of the one at right angles to it. Across, Catmull-Rom: linear would
   widen the kernel. */
static inline void separable_ray_texel(float *to, const float *from, const float *w, int reach,
                                       int along, int across, float slope) {
    float sum[4] = {0, 0, 0, 0}, v[4];
    int k, c;
    for (k = -reach; k <= reach; ++k) {
        const float *tap = from + k * along + grid_cubic(v, slope * (float)k) * across;
        for (c = 0; c < 4; ++c)
            sum[c] += w[k] * (v[0] * tap[c] + v[1] * tap[c + across] + v[2] * tap[c + 2 * across] +
                              v[3] * tap[c + 3 * across]);
    }
    memcpy(to, sum, sizeof sum);
}

static inline void separable_pole(separable *s, int face) {
    int x, y, n = s->n, taps = 2 * s->reach + 1;
    for (y = 0; y < n; ++y)
        for (x = 0; x < n; ++x) {
            int a = separable_class(n, x), b = separable_class(n, y), steep = b > a, ray;
            int sx = 2 * x + 1 < n ? -1 : 1, sy = 2 * y + 1 < n ? -1 : 1;
            size_t at = 4 * (size_t)separable_at(s, face, x, y);
            float u = (float)separable_off(n, a), v = (float)separable_off(n, b);
            ray = steep ? b * s->lines + a : a * s->lines + b;
            separable_ray_texel(s->other + at, s->image + at,
                                s->rays + (size_t)ray * (size_t)taps + s->reach, s->ray_reach[ray],
                                4 * (steep ? sy * s->side : sx), 4 * (steep ? sx : sy * s->side),
                                steep   ? u / v
                                : u > 0 ? v / u
                                        : 0);
        }
}

/* One pass along an axis. The axes along u and v of each pair of faces are OpenGL's. */
static inline void separable_pass(separable *s, int axis) {
    static const int along_u[3] = {2, 0, 0};
    float *swap = s->image;
    int face;
    separable_fill_border(s);
    for (face = 0; face < 6; ++face) {
        if (face / 2 == axis) separable_pole(s, face);
        else separable_side(s, face, along_u[face / 2] == axis, along_u[face / 2] != axis);
    }
    s->image = s->other, s->other = swap;
}

/* ----------------------------------------------------------------------------------- >>work -- */

static inline void separable_free(separable *s) {
    METHOD_FREE(s->image);
    METHOD_FREE(s->other);
    METHOD_FREE(s->border);
    METHOD_FREE(s->rows);
    METHOD_FREE(s->rays);
    METHOD_FREE(s->row_reach);
    METHOD_FREE(s->ray_reach);
}

/* Room for faces of n texels and passes of at most sigma. */
static inline int separable_create(separable *s, int n, double sigma, int published) {
    size_t image, lines = (size_t)(n + 1) / 2, edge = (size_t)n;
    memset(s, 0, sizeof *s);
    s->n = n, s->lines = (int)lines, s->published = published;
    s->reach = (int)ceil(SEPARABLE_CUT * sigma * sqrt(3.0) * (1 + 4 * sigma) * 0.5 * n);
    s->reach = s->reach < 1 ? 1 : s->reach > 255 ? 255 : s->reach;
    s->pad = s->reach + 2, s->side = n + 2 * s->pad;
    image = 6 * (size_t)s->side * (size_t)s->side;
    s->image = (float *)method_alloc(image, 4 * sizeof(float));
    s->other = (float *)method_alloc(image, 4 * sizeof(float));
    s->border = (separable_cell *)method_alloc(image - 6 * edge * edge, sizeof *s->border);
    s->rows = (float *)method_alloc(lines * edge, (2 * (size_t)s->reach + 1) * sizeof(float));
    s->rays = (float *)method_alloc(lines * lines, (2 * (size_t)s->reach + 1) * sizeof(float));
    s->row_reach = (unsigned char *)method_alloc(lines * edge, 1);
    s->ray_reach = (unsigned char *)method_alloc(lines * lines, 1);
    return s->image && s->other && s->border && s->rows && s->rays && s->row_reach && s->ray_reach;
}

/* A level of a cube, in or out. */
static inline void separable_copy(separable *s, const envmap *map, int level, int out) {
    int face, x, y;
    for (face = 0; face < 6; ++face)
        for (y = 0; y < s->n; ++y) {
            float *texel = envmap_texel(map, level, 0, face, 0, y);
            float *mine = s->image + 4 * (size_t)separable_at(s, face, 0, y);
            for (x = 0; x < s->n; ++x, texel += 3, mine += 4) {
                memcpy(out ? texel : mine, out ? mine : texel, 3 * sizeof(float));
                if (!out) mine[3] = 0;
            }
        }
}

/* s->image = a level of a cube times the heat kernel of a variance, its border filled. Creates s;
   free it in any case. */
static inline envmap_result separable_run(separable *s, const envmap *map, int level,
                                          double variance, const method_desc *desc) {
    static const int order[] = {0, 1, 2, 2, 1, 0};
    int i, published = desc->form == METHOD_PUBLISHED;
    int rounds = published ? desc->rounds : 1 + (int)(sqrt(variance) / SEPARABLE_ROUND);
    double sigma = sqrt(variance * (published ? 1 : 0.5) / rounds), *tau;
    if (!separable_create(s, method_edge(map, level), sigma, published)) return ENVMAP_ERROR_MEMORY;
    tau = (double *)method_alloc((size_t)s->side, 2 * sizeof *tau);
    if (!tau) return ENVMAP_ERROR_MEMORY;
    separable_border(s);
    separable_copy(s, map, level, 0);
    separable_weights(s, sigma, tau);
    for (i = 0; i < (published ? 3 : 6) * rounds; ++i)
        separable_pass(s, order[i % (published ? 3 : 6)]);
    separable_fill_border(s);
    METHOD_FREE(tau);
    return ENVMAP_OK;
}

/* Catmull-Rom in the image: unlike bilinear lookups it adds no variance. */
static inline void separable_value(float rgb[3], const float dir[3], const void *user) {
    const separable *s = (const separable *)user;
    float u, v, wx[4], wy[4], sum[4] = {0, 0, 0, 0};
    int face, x, y, k, c;
    envmap_coordinates(&face, &u, &v, ENVMAP_CUBE, dir);
    x = grid_cubic(wx, u * (float)s->n - 0.5f);
    y = grid_cubic(wy, v * (float)s->n - 0.5f);
    for (k = 0; k < 16; ++k) {
        const float *tap = s->image + 4 * separable_at(s, face, x + k % 4, y + k / 4);
        for (c = 0; c < 4; ++c) sum[c] += wx[k % 4] * wy[k / 4] * tap[c];
    }
    memcpy(rgb, sum, 3 * sizeof *rgb);
}

/* ----------------------------------------------------------------------------------- >>lobes -- */

/* sigma for a lobe; 0 when it is too wide, or no Gaussian. */
static inline double separable_sigma(const envmap_lobe *lobe, int published) {
    double misfit = 0, sigma = method_gaussian(&misfit, lobe), p = (double)lobe->p0, t, k;
    if (!(sigma > 0 && sigma <= SEPARABLE_SIGMA && misfit <= SEPARABLE_MISFIT)) return 0;
    if (!published) return sigma;
    t = 0.05 * sigma, k = envmap_lobe_value(lobe, cos(t), p) / envmap_lobe_value(lobe, 1, p);
    return k > 0 && k < 1 ? sqrt(-0.5 * t * t / log(k)) : 0;
}

/* The variance that the passes are to add on a level: the lobe's, less what the boxes spread. */
static inline double separable_variance(double sigma, int size, int level, int published) {
    double texel = method_cube_texel(size), here = texel * (1 << level);
    double boxes = published ? 0 : (here * here - texel * texel) / 12;
    return sigma * sigma > boxes ? sigma * sigma - boxes : 0;
}

/* Which level has texels of sigma / kernel: log2(size) - 0.53 + log2(sigma) - log2(kernel). */
static inline int separable_level_of(double sigma, int size, double kernel) {
    double level = log2(sigma / (kernel * method_cube_texel(size)));
    int most = envmap_levels(size) - 2;
    if (most < 0) most = 0;
    return level < 0 ? 0 : level > most ? most : (int)level;
}

static inline envmap_result method_separable_gaussian(envmap *dst, const envmap *src,
                                                      const envmap_lobe *lobe,
                                                      const method_desc *desc) {
    method_desc d;
    envmap map;
    separable s;
    double sigma, kernel;
    int level;
    envmap_result result = method_check(&d, dst, src, lobe, desc);
    if (result) return result;
    if (!method_setting(&d.rounds, d.rounds, 1, 64)) return ENVMAP_ERROR_METHOD;
    sigma = separable_sigma(lobe, d.form), kernel = d.kernel > 0 ? (double)d.kernel : 4;
    if (!(sigma > 0) || !(d.kernel >= 0 && kernel >= 1 && kernel <= 16)) return ENVMAP_ERROR_METHOD;
    result = method_levels(&map, src, ENVMAP_CUBE, d.form);
    if (result) return result;
    level = separable_level_of(sigma, map.size, kernel);
    result = separable_run(&s, &map, level, separable_variance(sigma, map.size, level, d.form), &d);
    if (!result) method_fill(dst, lobe, method_scale(lobe), separable_value, &s);
    separable_free(&s);
    envmap_free(&map);
    return result;
}

/* A chain's lobes and maps; sigma gets a number per lobe. */
static inline envmap_result separable_check_chain(method_desc *d, double *sigma, const envmap *dst,
                                                  const envmap *src, const envmap_lobe *lobes,
                                                  int count, const method_desc *desc) {
    int i;
    envmap_result result = lobes && count > 0 ? ENVMAP_OK : ENVMAP_ERROR_ARGUMENT;
    if (!result) result = method_check(d, dst, src, lobes, desc);
    if (!result && (count > dst->levels || dst->mapping != ENVMAP_CUBE || dst->slices != 1 ||
                    dst->size != method_size_for(src, ENVMAP_CUBE)))
        result = ENVMAP_ERROR_METHOD;
    for (i = 0; i < count && !result; ++i) {
        result = method_check_lobe(lobes + i);
        if (!result) sigma[i] = separable_sigma(lobes + i, d->form);
        if (!result && !(sigma[i] > 0)) result = ENVMAP_ERROR_METHOD;
    }
    return result;
}

/* Each level by itself, from the source's; as the program does it, from the result before, halved
   by plain boxes. work: as dst, count levels; map: the levels, overwritten by the program's way */
static inline envmap_result separable_chain_plain(envmap *work, envmap *map, const double *sigma,
                                                  const method_desc *desc, int from_before) {
    int i;
    envmap_result result = ENVMAP_OK;
    for (i = 0; i < work->levels && !result; ++i) {
        double variance = separable_variance(sigma[i], map->size, i, desc->form);
        separable s;
        if (i && from_before) variance = fmax(variance - sigma[i - 1] * sigma[i - 1], 0);
        result = separable_run(&s, map, i, variance, desc);
        if (!result) separable_copy(&s, work, i, 1);
        if (!result && from_before) separable_copy(&s, map, i, 1);
        if (!result && from_before && i + 1 < map->levels) method_plain_level(map, i + 1);
        separable_free(&s);
    }
    return result;
}

/* The edge that a level of a chain is filtered at: small ones in a finer one. */
static inline int separable_work(const envmap *map, int level) {
    while (level && method_edge(map, level) < SEPARABLE_FINE) --level;
    return method_edge(map, level);
}

/* Mended: along the grid. dst is written once nothing can fail any more. `boxes`: what halving, and
   the mean that a level is stored by, add. */
static inline envmap_result separable_chain_grid(envmap *dst, const envmap *map,
                                                 const envmap_lobe *lobes, const double *sigma,
                                                 int count) {
    grid g;
    double done = 0, boxes = 0;
    int i, side = 0;
    size_t weights = 0;
    float *memory;
    for (i = 0; i < count; ++i) {
        grid_shape(&g, separable_work(map, i), sigma[i] * sigma[i] - done, 0);
        side = g.wide > side ? g.wide : side, done = sigma[i] * sigma[i];
        weights = grid_weights(&g) > weights ? grid_weights(&g) : weights;
    }
    memory = (float *)method_alloc(grid_floats(side) + weights, sizeof *memory);
    if (!memory) return ENVMAP_ERROR_MEMORY;
    grid_lay_out(&g, side, memory);
    g.half = map->size / 2;
    grid_load(&g, map);
    for (i = 0, done = 0; i < count; ++i) {
        int edge = separable_work(map, i), f = edge / method_edge(map, i);
        double mean = f > 1 ? 0.25 : 0;
        if (edge < 2 * g.half) grid_halve(&g), boxes = (boxes + 0.25) / 4;
        grid_shape(&g, edge, sigma[i] * sigma[i] - done, boxes + mean);
        grid_run(&g);
        boxes = -mean, done = sigma[i] * sigma[i];
        grid_store(&g, dst, i, (float)method_scale(lobes + i));
    }
    METHOD_FREE(memory);
    return ENVMAP_OK;
}

/* Each lobe wider than the one before, and even sides all the way. */
static inline int separable_goes_on(const envmap *src, const double *sigma, int count) {
    int i, even = src->mapping == ENVMAP_CUBE;
    for (i = 0; i < count && even; ++i)
        even = (!i || sigma[i] >= 1.5 * sigma[i - 1]) && src->size >> i << i == src->size &&
               method_edge(src, i) % 2 == 0;
    return even;
}

/* A glossy chain: level i of the cube dst, of src's size, gets lobes[i]: with four times fewer N
   per level the kernel is a constant number of texels. Mirrors envmap_filter_chain. A cube whose
   levels have even sides goes along the grid, each level from the one before, as long as each lobe
   is half as wide again as the last (heat kernels compose). Other chains, and the published form,
   filter each level of the source by itself: slowly, and after boxes have seen the lamps. */
static inline envmap_result method_separable_chain(envmap *dst, const envmap *src,
                                                   const envmap_lobe *lobes, int count,
                                                   const method_desc *desc) {
    method_desc d;
    envmap map, work;
    double sigma[32];
    int i, from_before;
    envmap_result result = count > 32
                               ? ENVMAP_ERROR_METHOD
                               : separable_check_chain(&d, sigma, dst, src, lobes, count, desc);
    if (result) return result;
    from_before = d.form == METHOD_PUBLISHED && d.rounds > 0;
    if (!method_setting(&d.rounds, d.rounds, 1, 64)) return ENVMAP_ERROR_METHOD;
    if (d.form == METHOD_MENDED && separable_goes_on(src, sigma, count))
        return separable_chain_grid(dst, src, lobes, sigma, count);
    result = method_levels(&map, src, ENVMAP_CUBE, d.form);
    if (result) return result;
    memset(&work, 0, sizeof work);
    work.memory = src->memory;
    result = envmap_create(&work, ENVMAP_CUBE, map.size, count, 1);
    if (!result) result = separable_chain_plain(&work, &map, sigma, &d, from_before);
    for (i = 0; i < count && !result; ++i) {
        size_t k, n = 18 * (size_t)method_edge(dst, i) * (size_t)method_edge(dst, i);
        float *to = envmap_texel(dst, i, 0, 0, 0, 0);
        const float *from = envmap_texel(&work, i, 0, 0, 0, 0);
        for (k = 0; k < n; ++k) to[k] = (float)method_scale(lobes + i) * from[k];
    }
    envmap_free(&work);
    envmap_free(&map);
    return result;
}

#endif /* METHOD_SEPARABLE_GAUSSIAN_H */
