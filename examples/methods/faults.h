/* faults.h - the forms that fail, each as it is found in papers and programs, for tests/ and
   examples/measure/stability.c to hold against the library. Nothing of this is of use otherwise.

   A texel as a point; coordinates interpolated over triangles; discs with nothing outside their
   rim; maps of 8 bits; sums in floats; a map looked up as if every point were its centre. Others
   are the METHOD_PUBLISHED forms of their own files: plain boxes, faces alone, lookups half a texel
   off (methods.h), Gaussians stepped on the plane (separable_gaussian.h), clamped kernels
   (paraboloid_convolution.h).

   Include after envmap.h; every function is static inline.
   Tests: tests/test_stability_maps.c, tests/test_stability_filters.c.

   SPDX-License-Identifier: MIT */

#ifndef METHOD_FAULTS_H
#define METHOD_FAULTS_H

#include "methods.h"

/* ---------------------------------------------------------------------------------- >>points -- */

/* The texels of level 0 as points: centre, solid angle, radiance. */
typedef struct fault_points {
    double (*d)[3], *w;
    const float *rgb;
    int count;
} fault_points;

static inline void fault_points_free(fault_points *points) {
    if (points->d) METHOD_FREE(points->d);
    if (points->w) METHOD_FREE(points->w);
    memset(points, 0, sizeof *points);
}

/* Borrows map's texels. Returns 0 when out of memory. */
static inline int fault_points_create(fault_points *points, const envmap *map) {
    int width = method_width(map, 0), i;
    float d[3];
    points->count = envmap_faces(map->mapping) * width * map->size;
    points->rgb = map->texels;
    points->d = (double(*)[3])method_alloc((size_t)points->count, sizeof *points->d);
    points->w = (double *)method_alloc((size_t)points->count, sizeof *points->w);
    if (!points->d || !points->w) {
        fault_points_free(points);
        return 0;
    }
    for (i = 0; i < points->count; ++i) {
        int x = i % width, y = i / width % map->size, face = i / width / map->size, k;
        points->w[i] = envmap_solid_angle(map, 0, face, x, y);
        envmap_direction(d, map->mapping, face, ((float)x + 0.5f) / (float)width,
                         ((float)y + 0.5f) / (float)map->size);
        for (k = 0; k < 3; ++k) points->d[i][k] = (double)d[k];
    }
    return 1;
}

/* rgb = sum k(a.l) L w; returns sum k w, 0 where no texel's centre meets the lobe. */
static inline double fault_point_sum(double rgb[3], const fault_points *points,
                                     const envmap_lobe *lobe, const double axis[3]) {
    double total = 0;
    int i, c;
    rgb[0] = rgb[1] = rgb[2] = 0;
    for (i = 0; i < points->count; ++i) {
        const double *d = points->d[i];
        double k = envmap_lobe_value(lobe, axis[0] * d[0] + axis[1] * d[1] + axis[2] * d[2],
                                     (double)lobe->p0) *
                   points->w[i];
        if (!(k > 0)) continue;
        total += k;
        for (c = 0; c < 3; ++c) rgb[c] += k * (double)points->rgb[3 * i + c];
    }
    return total;
}

/* The same for Phong's N, directions, product and power in floats. */
static inline double fault_float_sum(double rgb[3], const fault_points *points, float n,
                                     const double axis[3]) {
    float a[3], total = 0, sum[3] = {0, 0, 0};
    int i, c;
    for (c = 0; c < 3; ++c) a[c] = (float)axis[c];
    for (i = 0; i < points->count; ++i) {
        const double *d = points->d[i];
        float x = a[0] * (float)d[0] + a[1] * (float)d[1] + a[2] * (float)d[2];
        float k = x > 0 ? powf(x, n) * (float)points->w[i] : 0;
        total += k;
        for (c = 0; c < 3; ++c) sum[c] += k * points->rgb[3 * i + c];
    }
    for (c = 0; c < 3; ++c) rgb[c] = (double)sum[c];
    return (double)total;
}

/* The mean over all floats of a map, the sum a float. */
static inline float fault_float_mean(const float *values, size_t count) {
    float sum = 0;
    size_t i;
    for (i = 0; i < count; ++i) sum += values[i];
    return sum / (float)count;
}

/* --------------------------------------------------------------------------------- >>lookups -- */

/* The direction that a rasteriser looks up inside a triangle with coordinates at its corners:
   u and v interpolated, on the face of the first corner. */
static inline void fault_interpolated(float dir[3], int mapping, const float corner[3][3],
                                      const float weight[3]) {
    float u = 0, v = 0, at[2];
    int k, face, first = 0;
    for (k = 0; k < 3; ++k) {
        envmap_coordinates(&face, at, at + 1, mapping, corner[k]);
        if (!k) first = face;
        u += weight[k] * at[0], v += weight[k] * at[1];
    }
    envmap_direction(dir, mapping, first, u, v);
}

/* The largest step of the green channel across the edges of a cube, over the mean of both sides;
   faces_alone: by lookups that know no other face. */
static inline double fault_seam(const envmap *map, float level, int faces_alone) {
    double worst = 0;
    int edge, i, k;
    for (edge = 0; edge < 12; ++edge)
        for (i = 0; i < 97; ++i) {
            float d[3], rgb[2][3];
            int axis = edge / 4;
            for (k = 0; k < 2; ++k) { /* a millionth to both sides of the edge */
                float beside = k ? 1e-6f : -1e-6f;
                d[axis] = ((float)i - 48) / 48.5f;
                d[(axis + 1) % 3] = (edge & 1 ? 1.0f : -1.0f) * (1 + beside);
                d[(axis + 2) % 3] = (edge & 2 ? 1.0f : -1.0f) * (1 - beside);
                if (faces_alone) method_lookup_face(rgb[k], map, d, level, 0);
                else envmap_lookup(rgb[k], map, d, level);
            }
            worst = fmax(worst, 2 * fabs((double)rgb[0][1] - (double)rgb[1][1]) /
                                    ((double)rgb[0][1] + (double)rgb[1][1] + 1e-30));
        }
    return worst;
}

/* ------------------------------------------------------------------------------------ >>maps -- */

/* What a picture drawn into the circles of a paraboloid map leaves outside them: black. */
static inline void fault_empty_rims(envmap *map) {
    int f, x, y, n = map->size;
    for (f = 0; f < 2; ++f)
        for (y = 0; y < n; ++y)
            for (x = 0; x < n; ++x) {
                int X = 2 * x + 1 - n, Y = 2 * y + 1 - n;
                if (X * X + Y * Y > n * n)
                    memset(envmap_texel(map, 0, 0, f, x, y), 0, 3 * sizeof(float));
            }
}

/* Level 0 in 8 bits a channel, `white` the radiance that is 255. */
static inline void fault_eight_bits(envmap *map, float white) {
    size_t i, n = method_floats(map);
    for (i = 0; i < n; ++i) {
        float x = map->texels[i] / white;
        x = x > 0 ? x < 1 ? x : 1 : 0;
        map->texels[i] = floorf(255 * x + 0.5f) / 255 * white;
    }
}

/* out = where the ray from p along d (unit) meets the unit sphere: the direction to look up for a
   surface at p when the scene is that far away. A map looked up at d itself takes p for 0. */
static inline void fault_mended_parallax(float out[3], const float p[3], const float d[3]) {
    float b = p[0] * d[0] + p[1] * d[1] + p[2] * d[2], c = p[0] * p[0] + p[1] * p[1] + p[2] * p[2];
    float t = sqrtf(fmaxf(b * b - c + 1, 0)) - b;
    int k;
    for (k = 0; k < 3; ++k) out[k] = p[k] + t * d[k];
}

#endif /* METHOD_FAULTS_H */
