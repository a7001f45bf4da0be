/* importance_sampling.h - filtered importance sampling: n directions drawn from the lobe, each of
   which looks up the level whose texels are as large as the part of the sphere it stands for.

     L(a) ~ 1/n sum over i of L_in(d_i, level_i),  level_i = 1/2 log2(1 / (n p(d_i)) / omega)

   p = k / integral of k is the density at d_i, omega the solid angle of a texel of level 0. The
   directions are the same for every texel, turned to its axis: angle from the axis by the inverse
   of the cumulated lobe at (i+1/2)/n, angle about it by the radical inverse of i to base 2.
   Published (M. Colbert, J. Krivanek: GPU-based importance sampling, GPU Gems 3, 2007, chapter 20):
   two paraboloids, plain boxes for levels, each face alone. Mended: a cube, levels by solid angle,
   lookups across faces.
   half_texel shifts every lookup by half a texel of its level, as a well-known library does.

   Domain: every lobe that is nowhere negative. Fails: few samples on a sun, which falls between the
   directions or whose level blurs it: fireflies in the shape of the pattern.
   Tests: sampling_* in tests/methods/test_methods_sampling.c.

   SPDX-License-Identifier: MIT */

#ifndef METHOD_IMPORTANCE_SAMPLING_H
#define METHOD_IMPORTANCE_SAMPLING_H

#include "methods.h"

typedef struct method_direction {
    float x, y, z, level; /* about the z axis */
} method_direction;

typedef struct method_sampling {
    envmap map;
    method_direction *directions;
    int count, published;
    float shift;
} method_sampling;

/* Van der Corput: the bits of i behind the binary point, in reverse. */
static inline double method_radical_inverse(unsigned i) {
    double out = 0, bit = 0.5;
    for (; i; i >>= 1, bit /= 2) out += bit * (i & 1u);
    return out;
}

/* Direction i, and the level of its part of the sphere where level 0 has texels of 1 sr. */
static inline method_direction method_direction_of(const double *cdf, const envmap_lobe *lobe,
                                                   int i, int count) {
    double t = method_quantile(cdf, (i + 0.5) / count);
    double turn = 2 * METHOD_PI * method_radical_inverse((unsigned)i);
    double p = envmap_lobe_value(lobe, cos(t), (double)lobe->p0) /
               envmap_lobe_integral(lobe, (double)lobe->p0);
    method_direction out;
    out.x = (float)(sin(t) * cos(turn)), out.y = (float)(sin(t) * sin(turn));
    out.z = (float)cos(t);
    out.level = (float)fmin(0.5 * log2(1 / (count * fmax(p, 1e-12))), 64);
    return out;
}

/* -1/2 log2 of the solid angle of a texel at a unit vector: 16 / (1 + r^2)^2 = 4 (1 + |z|)^2 of the
   unit square for paraboloids, 4 (1 + r^2)^(-3/2) = 4 max(|x|,|y|,|z|)^3 for cubes. */
static inline float method_texel_level(const envmap *map, const float d[3]) {
    float z = fabsf(d[2]), m = fmaxf(z, fmaxf(fabsf(d[0]), fabsf(d[1]))), edge = (float)map->size;
    return map->mapping == ENVMAP_CUBE ? log2f(edge / (2 * m * sqrtf(m)))
                                       : log2f(edge / (2 + 2 * z));
}

static inline void method_sampling_value(float rgb[3], const float dir[3], const void *user) {
    const method_sampling *s = (const method_sampling *)user;
    float x[3], y[3], at[3], tap[3];
    double sum[3] = {0, 0, 0};
    int i, c;
    float level;
    method_frame(x, y, dir);
    for (i = 0; i < s->count; ++i) {
        const method_direction *d = s->directions + i;
        for (c = 0; c < 3; ++c) at[c] = d->x * x[c] + d->y * y[c] + d->z * dir[c];
        level = d->level + method_texel_level(&s->map, at);
        if (s->published || s->shift > 0) method_lookup_face(tap, &s->map, at, level, s->shift);
        else envmap_lookup(tap, &s->map, at, level);
        for (c = 0; c < 3; ++c) sum[c] += (double)tap[c];
    }
    for (c = 0; c < 3; ++c) rgb[c] = (float)(sum[c] / s->count);
}

static inline envmap_result method_importance_sampling(envmap *dst, const envmap *src,
                                                       const envmap_lobe *lobe,
                                                       const method_desc *desc) {
    method_desc d;
    method_sampling s;
    int i;
    double *cdf;
    envmap_result result = method_check(&d, dst, src, lobe, desc);
    if (result) return result;
    if (!method_setting(&s.count, d.samples, 256, 65536)) return ENVMAP_ERROR_METHOD;
    s.published = d.form == METHOD_PUBLISHED, s.shift = d.half_texel ? 0.5f : 0;
    result = method_cumulate(&cdf, lobe);
    if (result) return result;
    s.directions = (method_direction *)method_alloc((size_t)s.count, sizeof *s.directions);
    if (!s.directions) result = ENVMAP_ERROR_MEMORY;
    else
        result =
            method_levels(&s.map, src, s.published ? ENVMAP_PARABOLOID : ENVMAP_CUBE, s.published);
    if (!result) {
        for (i = 0; i < s.count; ++i) s.directions[i] = method_direction_of(cdf, lobe, i, s.count);
        method_fill(dst, lobe, method_scale(lobe), method_sampling_value, &s);
        envmap_free(&s.map);
    }
    METHOD_FREE(cdf);
    METHOD_FREE(s.directions);
    return result;
}

#endif /* METHOD_IMPORTANCE_SAMPLING_H */
