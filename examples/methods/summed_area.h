/* summed_area.h - the mean over any box of texels for the price of four: a table of the sums of all
   texels above and to the left.

     mean[u0,u1]x[v0,v1] = (T(u1,v1) - T(u0,v1) - T(u1,v0) + T(u0,v0)) / (the same of weights)

   T between the corners of texels is bilinear, which is exact for texels as constant patches. A
   texel weighs its solid angle. Sums are double: a float table of n texels loses about
   n / 2^24 of its mean, which is all of a small box (F. Crow. Summed-area tables for texture
   mapping, SIGGRAPH 1984, says so; the third term of some printed forms has a slip).

   As a filter, on a lat-long map. Published: one box of the lobe's variance about the axis (half
   its side sqrt 3 sigma, over sin theta along the row), plain weights, a float table. Mended: the
   lobe as a stack of `discs` of equal energy, each disc as `strips` boxes: the row at theta is
   covered for |phi - phi0| < acos((cos r - cos theta cos theta0) / (sin theta sin theta0)), which
   stays right at the poles. The cost is 4 discs * strips table entries, however wide the lobe.

   Domain: lobes that fall from their axis. Fails: with few discs the lobe is a staircase; strips
   narrower than a texel count the texels they cut.  Tests: summed_* in test_methods_sampling.c.

   SPDX-License-Identifier: MIT */

#ifndef METHOD_SUMMED_AREA_H
#define METHOD_SUMMED_AREA_H

#include "methods.h"

typedef struct summed_area {
    double *sums; /* [face][height + 1][width + 1][4]: weighted r, g, b; weight */
    int faces, width, height, wraps;
} summed_area;

/* Level 0 of slice 0 of any map. plain: texels weigh the same, and sums are kept as floats. */
static inline envmap_result summed_area_create(summed_area *table, const envmap *map, int plain) {
    size_t row, x, y;
    int f, c;
    if (!table || !envmap_texel(map, 0, 0, 0, 0, 0)) return ENVMAP_ERROR_ARGUMENT;
    table->faces = envmap_faces(map->mapping), table->width = method_width(map, 0);
    table->height = map->size, table->wraps = map->mapping == ENVMAP_LATLONG;
    row = 4 * ((size_t)table->width + 1);
    table->sums = (double *)method_alloc((size_t)table->faces * ((size_t)map->size + 1) * row,
                                         sizeof(double));
    if (!table->sums) return ENVMAP_ERROR_MEMORY;
    for (f = 0; f < table->faces; ++f)
        for (y = 0; y <= (size_t)map->size; ++y) {
            double *to = table->sums + ((size_t)f * ((size_t)map->size + 1) + y) * row;
            double line[4] = {0, 0, 0, 0};
            for (x = 0; x <= (size_t)table->width; ++x, to += 4)
                for (c = 0; c < 4; ++c) {
                    double w = 1;
                    if (!x || !y) {
                        to[c] = 0;
                        continue;
                    }
                    if (!plain) w = envmap_solid_angle(map, 0, f, (int)x - 1, (int)y - 1);
                    if (c < 3) w *= (double)envmap_texel(map, 0, 0, f, (int)x - 1, (int)y - 1)[c];
                    line[c] += w;
                    to[c] = to[c - (int)row] + line[c];
                    if (plain) to[c] = (double)(float)to[c];
                }
        }
    return ENVMAP_OK;
}

static inline void summed_area_free(summed_area *table) {
    METHOD_FREE(table->sums);
    table->sums = NULL;
}

/* sum += sign * T at x, y in texels */
static inline void summed_area_corner(double sum[4], const summed_area *table, int face, double x,
                                      double y, double sign) {
    int i = (int)x, j = (int)y, c, k;
    double f, g;
    i = i < table->width - 1 ? i : table->width - 1,
    j = j < table->height - 1 ? j : table->height - 1;
    f = x - i, g = y - j;
    for (k = 0; k < 4; ++k) {
        const double *t =
            table->sums + 4 * (((size_t)face * ((size_t)table->height + 1) + (size_t)(j + k / 2)) *
                                   ((size_t)table->width + 1) +
                               (size_t)(i + k % 2));
        double w = sign * (k % 2 ? f : 1 - f) * (k / 2 ? g : 1 - g);
        for (c = 0; c < 4; ++c) sum[c] += w * t[c];
    }
}

/* sum += the texels of a box of a face, and their weights; clipped to the face, but for a lat-long
   map's u, which goes round (u0 >= -1, u1 <= 2). */
static inline void summed_area_add(double sum[4], const summed_area *table, int face, double u0,
                                   double v0, double u1, double v1) {
    double x0, x1, y0, y1;
    if (table->wraps && u1 - u0 >= 1) u0 = 0, u1 = 1;
    if (table->wraps && u0 < 0) {
        summed_area_add(sum, table, face, u0 + 1, v0, u1 < 0 ? u1 + 1 : 1, v1);
        u0 = 0;
    }
    if (table->wraps && u1 > 1) {
        summed_area_add(sum, table, face, u0 > 1 ? u0 - 1 : 0, v0, u1 - 1, v1);
        u1 = 1;
    }
    x0 = fmax(u0, 0) * table->width, x1 = fmin(u1, 1) * table->width;
    y0 = fmax(v0, 0) * table->height, y1 = fmin(v1, 1) * table->height;
    if (!(x1 > x0 && y1 > y0)) return;
    summed_area_corner(sum, table, face, x1, y1, 1);
    summed_area_corner(sum, table, face, x0, y1, -1);
    summed_area_corner(sum, table, face, x1, y0, -1);
    summed_area_corner(sum, table, face, x0, y0, 1);
}

/* rgb = the mean over a box; black where it is empty. */
static inline void summed_area_box(float rgb[3], const summed_area *table, int face, double u0,
                                   double v0, double u1, double v1) {
    double sum[4] = {0, 0, 0, 0};
    int c;
    summed_area_add(sum, table, face, u0, v0, u1, v1);
    for (c = 0; c < 3; ++c) rgb[c] = sum[3] > 0 ? (float)(sum[c] / sum[3]) : 0;
}

/* sum += the disc of radius r about a direction of a lat-long map. */
static inline void summed_area_disc(double sum[4], const summed_area *table, double u, double theta,
                                    double r, int strips) {
    double from = fmax(theta - r, 0), to = fmin(theta + r, METHOD_PI);
    int i;
    for (i = 0; i < strips; ++i) {
        double a = from + (to - from) * i / strips, b = from + (to - from) * (i + 1) / strips;
        double t = (a + b) / 2, across = sin(t) * sin(theta), c = cos(r) - cos(t) * cos(theta);
        double half = c <= -across ? METHOD_PI : c >= across ? 0 : acos(c / across);
        half /= 2 * METHOD_PI;
        summed_area_add(sum, table, 0, u - half, a / METHOD_PI, u + half, b / METHOD_PI);
    }
}

typedef struct summed_area_lobe {
    summed_area table;
    double radius[64], weight[64], sigma;
    int discs, strips, published;
} summed_area_lobe;

/* Discs at the lobe's quantiles: ring i has the mean m_i of k, disc i the weight m_i - m_(i+1)
   times its solid angle. The last ends where a quarter of its energy lies beyond; none is
   smaller than half a texel. */
static inline void summed_area_stack(summed_area_lobe *lobe, const double *cdf, int height) {
    int i, n = lobe->discs;
    double inner = 1, mean[65], sum = 0;
    mean[n] = 0;
    for (i = 0; i < n; ++i) {
        double part = (i + 1 < n ? i + 1.0 : n - 0.25) / n, c;
        lobe->radius[i] = method_quantile(cdf, part), c = cos(lobe->radius[i]);
        mean[i] = 1 / fmax(inner - c, 1e-16), inner = c;
    }
    for (i = 0; i < n; ++i) {
        double drop = mean[i] - mean[i + 1];
        lobe->weight[i] = drop * (1 - cos(lobe->radius[i])), sum += lobe->weight[i];
    }
    for (i = 0; i < n; ++i) {
        lobe->weight[i] /= sum;
        lobe->radius[i] = fmax(lobe->radius[i], METHOD_PI / (2.0 * height));
    }
}

static inline void summed_area_value(float rgb[3], const float dir[3], const void *user) {
    const summed_area_lobe *lobe = (const summed_area_lobe *)user;
    float u, v;
    int i, c, face;
    double out[3] = {0, 0, 0};
    envmap_coordinates(&face, &u, &v, ENVMAP_LATLONG, dir);
    if (lobe->published) {
        double half = sqrt(3.0) * lobe->sigma, s = sin(METHOD_PI * (double)v);
        double du = fmin(half / fmax(s, 1e-9), METHOD_PI) / (2 * METHOD_PI), dv = half / METHOD_PI;
        summed_area_box(rgb, &lobe->table, 0, (double)u - du, (double)v - dv, (double)u + du,
                        (double)v + dv);
        return;
    }
    for (i = 0; i < lobe->discs; ++i) {
        double sum[4] = {0, 0, 0, 0};
        summed_area_disc(sum, &lobe->table, (double)u, METHOD_PI * (double)v, lobe->radius[i],
                         lobe->strips);
        for (c = 0; c < 3; ++c) out[c] += lobe->weight[i] * sum[c] / sum[3];
    }
    for (c = 0; c < 3; ++c) rgb[c] = (float)out[c];
}

static inline envmap_result method_summed_area(envmap *dst, const envmap *src,
                                               const envmap_lobe *lobe, const method_desc *desc) {
    method_desc d;
    summed_area_lobe stack;
    envmap map;
    double *cdf;
    envmap_result result = method_check(&d, dst, src, lobe, desc);
    if (result) return result;
    if (!method_setting(&stack.discs, d.discs, 8, 64) ||
        !method_setting(&stack.strips, d.strips, 9, 64) || !method_falls(lobe))
        return ENVMAP_ERROR_METHOD;
    stack.published = d.form, stack.sigma = method_gaussian(NULL, lobe), stack.table.sums = NULL;
    result = method_cumulate(&cdf, lobe);
    if (result) return result;
    result = method_levels(&map, src, ENVMAP_LATLONG, d.form);
    if (!result) {
        summed_area_stack(&stack, cdf, map.size);
        result = summed_area_create(&stack.table, &map, d.form);
        envmap_free(&map);
    }
    if (!result) method_fill(dst, lobe, method_scale(lobe), summed_area_value, &stack);
    summed_area_free(&stack.table);
    METHOD_FREE(cdf);
    return result;
}

#endif /* METHOD_SUMMED_AREA_H */
