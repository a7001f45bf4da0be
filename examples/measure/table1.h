/* table1.h - the work of Table 1 of Kautz, Vazquez, Heidrich and Seidel 2000: a parabolic map of
   128 x 256 texels filtered into one of the same size by brute force, the plain loop over the whole
   square with pow, and the speed-ups that were published for the hierarchical filter.

   What you will see: nothing by itself; table1.c takes every texel, chart.c some.
   Include it after envmap.h.

   SPDX-License-Identifier: MIT */

#ifndef TABLE1_H
#define TABLE1_H

#include <math.h>
#include <stdlib.h>

#define TABLE1_SIZE   128
#define TABLE1_TEXELS (2 * TABLE1_SIZE * TABLE1_SIZE)

static const int table1_exponents[5] = {10, 50, 100, 250, 500};
static const double table1_published[5] = {4.2, 5.3, 7.7, 9.9, 14.1};

static inline void table1_direction(float d[3], int i) {
    int face = i / (TABLE1_SIZE * TABLE1_SIZE), x = i % TABLE1_SIZE;
    int y = i / TABLE1_SIZE % TABLE1_SIZE;
    envmap_direction(d, ENVMAP_PARABOLOID, face, ((float)x + 0.5f) / TABLE1_SIZE,
                     ((float)y + 0.5f) / TABLE1_SIZE);
}

static inline double table1_solid_angle(const envmap *map, int i) {
    return envmap_solid_angle(map, 0, i / (TABLE1_SIZE * TABLE1_SIZE), i % TABLE1_SIZE,
                              i / TABLE1_SIZE % TABLE1_SIZE);
}

/* Fills a parabolic map of TABLE1_SIZE: a sky over a ground with some soft lamps; with a sun, 12
   texels that are 5e4 times the mean. */
static inline void table1_scene(envmap *map, int sun) {
    double mean = 0, sphere = 0;
    for (int i = 0; i < TABLE1_TEXELS; ++i) {
        float d[3], *t = map->texels + 3 * i;
        table1_direction(d, i);
        double x = (double)d[0], y = (double)d[1], z = (double)d[2];
        double lamp =
            exp(40 * (0.6 * x + 0.8 * z - 1)) + 2 * exp(90 * (0.48 * y - 0.8 * x - 0.36 * z - 1));
        double ripple = 0.1 * sin(19 * x + 7 * y) * sin(13 * z - 11 * y);
        for (int c = 0; c < 3; ++c)
            t[c] = (float)((y > 0 ? 0.5 + 0.2 * c * y : 0.25 - 0.05 * c) + ripple + 3 * lamp);
        double w = table1_solid_angle(map, i);
        mean += w * (double)t[1], sphere += w;
    }
    for (int i = 0; sun && i < 12; ++i)
        for (int c = 0; c < 3; ++c)
            envmap_texel(map, 0, 0, 0, 83 + i % 4, 41 + i / 4)[c] = (float)(5e4 * mean / sphere);
}

/* Brute force for every stride-th texel of dst; returns the seconds that all of them would take
   (each takes the same), 0 when out of memory. */
static inline double table1_brute(envmap *dst, const envmap *src, double n, int stride,
                                  double (*clock_of)(void)) {
    double(*source)[7] = (double(*)[7])malloc(TABLE1_TEXELS * sizeof *source);
    if (!source) return 0;
    for (int i = 0; i < TABLE1_TEXELS; ++i) { /* direction, radiance, solid angle */
        float d[3];
        double w = table1_solid_angle(src, i);
        table1_direction(d, i);
        for (int c = 0; c < 3; ++c) {
            source[i][c] = (double)d[c];
            source[i][3 + c] = w * (double)src->texels[3 * i + c];
        }
        source[i][6] = w;
    }
    double start = clock_of();
    int done = 0;
    for (int j = 0; j < TABLE1_TEXELS; j += stride, ++done) {
        const double *a = source[j];
        double r = 0, g = 0, b = 0, norm = 0;
        for (int i = 0; i < TABLE1_TEXELS; ++i) {
            const double *l = source[i];
            double x = a[0] * l[0] + a[1] * l[1] + a[2] * l[2], k = x > 0 ? pow(x, n) : 0;
            r += k * l[3], g += k * l[4], b += k * l[5], norm += k * l[6];
        }
        dst->texels[3 * j] = (float)(r / norm), dst->texels[3 * j + 1] = (float)(g / norm);
        dst->texels[3 * j + 2] = (float)(b / norm);
    }
    double took = clock_of() - start;
    free(source);
    return took * TABLE1_TEXELS / done;
}

#endif /* TABLE1_H */
