/* paraboloid_convolution.h - two convolutions of the whole paraboloid map with a small kernel, as
   an OpenGL 1.2 pass does them, blended.

   A circle of angle t about the axis stays a circle on a paraboloid, of radius tan(t/2) at the
   map's centre and 1 - tan((pi/2 - t)/2) at its rim (where it reaches inwards). So one map S is
   filtered with the small radius, one map L with the large one, and at distance d from the centre
     L(a) = (1 - d^2) S(a) + d^2 L(a)
   The lobe ends where it is below `cut` of its peak; a kernel wider than `limit` texels works
   on the level that shrinks it: the smallest power of two with size / shrink <= limit.
   Source: J. Kautz, P.-P. Vazquez, W. Heidrich, H.-P. Seidel. A unified approach to prefiltered
   environment maps, Rendering Workshop 2000, section 5.2.

   Published: taps count alike though a texel at the rim is a quarter of one in the centre, the
   circle's centre stays on the axis though it moves outwards by sec t - 1 at the rim, taps off the
   square repeat its border, plain boxes shrink. `border` has a rim of filled texels around the disc
   instead and black beyond it, and `white` what maps of [0,1] hold. Mended: taps weigh their solid
   angle (sums of weights are convolved beside the colours), the square goes on over its border by
   direction, the kernel stands where its mean direction is the axis, its radius at the rim is tan t, levels are
   weighted by solid angle. `lossy` keeps the loss of the cut tail; `one_map` is S alone.

   Domain: lobes that fall from their axis and are below `cut` before 80 degrees (Phong N > 1.4
   at cut 0.1). Fails: wide lobes; a shrunk map is seven texels to a kernel, whatever the size.
   Tests: paraboloid_* in tests/methods/test_methods.c.

   SPDX-License-Identifier: MIT */

#ifndef METHOD_PARABOLOID_CONVOLUTION_H
#define METHOD_PARABOLOID_CONVOLUTION_H

#include "methods.h"

/* The angle where k falls below a part of its peak, by bisection; pi where it does not. */
static inline double paraboloid_angle(const envmap_lobe *lobe, double cut) {
    double from = 0, to = METHOD_PI, p = (double)lobe->p0, peak = envmap_lobe_value(lobe, 1, p);
    int i;
    for (i = 0; i < 60; ++i) {
        double half = (from + to) / 2;
        if (envmap_lobe_value(lobe, cos(half), p) >= cut * peak) from = half;
        else to = half;
    }
    return from;
}

/* How large the image of a circle of an angle is: at the centre, and (large) at the rim. */
static inline double paraboloid_radius(double angle, int large, int mended) {
    if (!large) return tan(angle / 2);
    return mended ? tan(angle) : 1 - tan((METHOD_PI / 2 - angle) / 2);
}

/* The smallest power of two that shrinks a kernel of `size` texels to the limit. */
static inline int paraboloid_shrink(int size, int edge, int limit) {
    int shrink = 1;
    while (size > limit * shrink && shrink < edge) shrink *= 2;
    return shrink;
}

/* The kernels' sides in texels of a face of `edge` and what they are shrunk by, [0] S, [1] L.
   Test: paraboloid_filter_sizes_are_the_published_ones. */
static inline void paraboloid_sizes(int size[2], int shrink[2], const envmap_lobe *lobe, int edge,
                                    double cut, int limit) {
    double angle = paraboloid_angle(lobe, cut);
    int k;
    for (k = 0; k < 2; ++k) {
        size[k] = 2 * (int)ceil(edge * paraboloid_radius(angle, k, 0) / 2 - 1e-9);
        shrink[k] = paraboloid_shrink(size[k], edge, limit);
    }
}

/* How far the image of a circle of radius r about distance d is off its centre: |a-b| / (a+b) for
   the angles a outwards and b inwards. Test: paraboloid_distortion_is_a_quarter. */
static inline double paraboloid_distortion(double d, double r) {
    double a = atan(d + r) - atan(d), b = atan(d) - atan(d - r);
    return fabs(a - b) / (a + b);
}

/* One face of one of the maps: colours times weight, and weights, on a square that goes beyond
   [-1,1]^2 by `pad` texels. */
typedef struct paraboloid_plane {
    float *texels; /* [n][n][4] */
    int n, pad;
    float half; /* texels per unit */
} paraboloid_plane;

#define PARABOLOID_STEPS 64

typedef struct paraboloid_map {
    paraboloid_plane face[2];
    float shift[PARABOLOID_STEPS + 1]; /* where the kernel stands for an axis at d = i / STEPS */
} paraboloid_map;

typedef struct paraboloid_kernel {
    float weight[63][63];
    int reach;   /* taps -reach .. reach */
    double half; /* texels per unit */
} paraboloid_kernel;

/* The angle that a tap at distance r stands for. */
static inline double paraboloid_tap(double r, int large, int mended) {
    if (!large) return 2 * atan(r);
    return mended ? atan(r) : METHOD_PI / 2 - 2 * atan(1 - r);
}

static inline void paraboloid_kernel_of(paraboloid_kernel *kernel, const envmap_lobe *lobe,
                                        double angle, int limit, int edge, int large, int mended) {
    double radius = paraboloid_radius(angle, large, mended);
    int i, j, side;
    kernel->half = edge / 2.0;
    kernel->reach = (int)floor(radius * kernel->half);
    if (kernel->reach > (limit - 1) / 2) kernel->reach = (limit - 1) / 2;
    side = 2 * kernel->reach + 1;
    for (i = 0; i < side; ++i)
        for (j = 0; j < side; ++j) {
            double r = hypot(i - kernel->reach, j - kernel->reach) / kernel->half;
            kernel->weight[i][j] =
                r > radius ? 0
                           : (float)envmap_lobe_value(lobe, cos(paraboloid_tap(r, large, mended)),
                                                      (double)lobe->p0);
        }
}

/* The direction at (X,Y) of a face, beyond its square too, and d(solid angle) / dX dY over 4. */
static inline float paraboloid_direction(float dir[3], int face, float X, float Y) {
    float s = 1 + X * X + Y * Y;
    dir[0] = 2 * X / s, dir[1] = 2 * Y / s, dir[2] = (face ? -1.0f : 1.0f) * (2 - s) / s;
    return 1 / (s * s);
}

static inline int paraboloid_plane_create(paraboloid_plane *plane, int edge, int pad) {
    plane->n = edge + 2 * pad, plane->pad = pad, plane->half = 0.5f * (float)edge;
    plane->texels = (float *)method_alloc((size_t)plane->n * (size_t)plane->n, 4 * sizeof(float));
    return plane->texels != NULL;
}

/* A texel of the published form: the map's own, the square's edge repeated; or, with a border, by
   direction up to the border's end. */
static inline void paraboloid_published(float rgb[3], const envmap *map, int level, int face, int i,
                                        int j, const method_desc *d) {
    int c, last = method_edge(map, level) - 1;
    if (d->border > 0) {
        float half = 0.5f * (float)(last + 1), dir[3];
        float X = ((float)i + 0.5f) / half - 1, Y = 1 - ((float)j + 0.5f) / half;
        paraboloid_direction(dir, face, X, Y);
        envmap_lookup(rgb, map, dir, (float)level);
        for (c = 0; c < 3 && hypotf(X, Y) > 1 + d->border; ++c) rgb[c] = 0;
    } else {
        i = i < 0 ? 0 : i > last ? last : i, j = j < 0 ? 0 : j > last ? last : j;
        memcpy(rgb, envmap_texel(map, level, 0, face, i, j), 3 * sizeof *rgb);
    }
}

/* A level of the map as a plane: mended, looked up by direction and weighed by solid angle;
   published, each texel counts alike. */
static inline void paraboloid_plane_read(paraboloid_plane *plane, const envmap *map, int level,
                                         int face, const method_desc *d) {
    int x, y;
    for (y = 0; y < plane->n; ++y)
        for (x = 0; x < plane->n; ++x) {
            float *to = plane->texels + 4 * ((size_t)y * (size_t)plane->n + (size_t)x), dir[3];
            int i = x - plane->pad, j = y - plane->pad;
            float w = paraboloid_direction(dir, face, ((float)i + 0.5f) / plane->half - 1,
                                           1 - ((float)j + 0.5f) / plane->half);
            if (d->form == METHOD_MENDED) {
                envmap_lookup(to, map, dir, (float)level);
                to[0] *= w, to[1] *= w, to[2] *= w, to[3] = w;
            } else {
                paraboloid_published(to, map, level, face, i, j, d);
                to[3] = 1;
            }
        }
}

static inline void paraboloid_convolve(paraboloid_plane *to, const paraboloid_plane *from,
                                       const paraboloid_kernel *kernel) {
    int x, y, i, j, c, side = 2 * kernel->reach + 1;
    int off = from->pad - to->pad - kernel->reach;
    for (y = 0; y < to->n; ++y)
        for (x = 0; x < to->n; ++x) {
            float sum[4] = {0, 0, 0, 0};
            for (i = 0; i < side; ++i) {
                const float *tap = from->texels + 4 * ((size_t)(y + off + i) * (size_t)from->n +
                                                       (size_t)(x + off));
                for (j = 0; j < side; ++j, tap += 4)
                    for (c = 0; c < 4; ++c) sum[c] += kernel->weight[i][j] * tap[c];
            }
            memcpy(to->texels + 4 * ((size_t)y * (size_t)to->n + (size_t)x), sum, sizeof sum);
        }
}

/* The distance at which the kernel's mean direction lies at the angle of distance d. */
static inline double paraboloid_stand(const paraboloid_kernel *kernel, double d) {
    double from = d, to = d + 0.5, want = 2 * atan(d);
    int k, i, j, side = 2 * kernel->reach + 1;
    for (k = 0; k < 24; ++k) {
        double at = (from + to) / 2, x = 0, z = 0;
        for (i = 0; i < side; ++i)
            for (j = 0; j < side; ++j) {
                float dir[3], X = (float)(at + (j - kernel->reach) / kernel->half);
                float w =
                    paraboloid_direction(dir, 0, X, (float)((i - kernel->reach) / kernel->half));
                x += (double)(w * kernel->weight[i][j] * dir[0]);
                z += (double)(w * kernel->weight[i][j] * dir[2]);
            }
        if (atan2(x, z) < want) from = at;
        else to = at;
    }
    return from;
}

static inline envmap_result paraboloid_map_create(paraboloid_map *out, const envmap *map,
                                                  const paraboloid_kernel *kernel, int level,
                                                  const method_desc *desc) {
    int face, i, edge = method_edge(map, level), mended = desc->form == METHOD_MENDED;
    int pad = mended ? (int)ceil(0.51 * kernel->half) + 2 : 2;
    for (i = 0; i <= PARABOLOID_STEPS; ++i) {
        double d = (double)i / PARABOLOID_STEPS;
        out->shift[i] = (float)(mended ? paraboloid_stand(kernel, d) : d);
    }
    for (face = 0; face < 2; ++face) {
        paraboloid_plane from;
        if (!paraboloid_plane_create(&from, edge, pad + kernel->reach)) return ENVMAP_ERROR_MEMORY;
        if (!paraboloid_plane_create(&out->face[face], edge, pad)) {
            METHOD_FREE(from.texels);
            return ENVMAP_ERROR_MEMORY;
        }
        paraboloid_plane_read(&from, map, level, face, desc);
        paraboloid_convolve(&out->face[face], &from, kernel);
        METHOD_FREE(from.texels);
    }
    return ENVMAP_OK;
}

/* Bilinear on the plane of direction's face, weight times the mean added. */
static inline void paraboloid_add(float rgb[3], const paraboloid_map *map, const float dir[3],
                                  float weight) {
    int face = dir[2] < 0, x, y, k, c;
    const paraboloid_plane *plane = &map->face[face];
    float X = dir[0] / (1 + fabsf(dir[2])), Y = dir[1] / (1 + fabsf(dir[2])), d = hypotf(X, Y);
    float at = d * PARABOLOID_STEPS, sum[4] = {0, 0, 0, 0}, stand, s, t;
    k = at < PARABOLOID_STEPS - 1 ? (int)at : PARABOLOID_STEPS - 1;
    stand = map->shift[k] + (at - (float)k) * (map->shift[k + 1] - map->shift[k]);
    if (d > 1e-6f) X *= stand / d, Y *= stand / d;
    s = (X + 1) * plane->half - 0.5f + (float)plane->pad;
    t = (1 - Y) * plane->half - 0.5f + (float)plane->pad;
    x = (int)s, y = (int)t, s -= (float)x, t -= (float)y;
    for (k = 0; k < 4; ++k) {
        const float *tap =
            plane->texels + 4 * ((size_t)(y + k / 2) * (size_t)plane->n + (size_t)(x + k % 2));
        float w = (k % 2 ? s : 1 - s) * (k / 2 ? t : 1 - t);
        for (c = 0; c < 4; ++c) sum[c] += w * tap[c];
    }
    for (c = 0; c < 3; ++c) rgb[c] += weight * sum[c] / sum[3];
}

typedef struct paraboloid_pair {
    paraboloid_map centre, rim;
    int one_map;
} paraboloid_pair;

static inline void paraboloid_value(float rgb[3], const float dir[3], const void *user) {
    const paraboloid_pair *pair = (const paraboloid_pair *)user;
    float dd = (1 - fabsf(dir[2])) / (1 + fabsf(dir[2]));
    rgb[0] = rgb[1] = rgb[2] = 0;
    paraboloid_add(rgb, &pair->centre, dir, pair->one_map ? 1 : 1 - dd);
    if (!pair->one_map) paraboloid_add(rgb, &pair->rim, dir, dd);
}

static inline void paraboloid_pair_free(paraboloid_pair *pair) {
    int i;
    for (i = 0; i < 2; ++i) {
        METHOD_FREE(pair->centre.face[i].texels);
        METHOD_FREE(pair->rim.face[i].texels);
    }
}

/* The part of the lobe's integral within an angle: Simpson's rule. */
static inline double paraboloid_share(const envmap_lobe *lobe, double angle) {
    double sum = 0, p = (double)lobe->p0;
    int i;
    for (i = 0; i <= 512; ++i) {
        double t = angle * i / 512, weight = i == 0 || i == 512 ? 1 : i % 2 ? 4 : 2;
        sum += weight * sin(t) * envmap_lobe_value(lobe, cos(t), p);
    }
    return 2 * METHOD_PI * sum * angle / 512 / 3 / envmap_lobe_integral(lobe, p);
}

/* What a map of [0,1] holds: means of it lie there too. */
static inline void paraboloid_clamp(envmap *map, float white) {
    size_t i, n = method_floats(map);
    for (i = 0; i < n; ++i) map->texels[i] = fminf(fmaxf(map->texels[i], 0), white);
    method_plain_levels(map);
}

static inline envmap_result method_paraboloid_convolution(envmap *dst, const envmap *src,
                                                          const envmap_lobe *lobe,
                                                          const method_desc *desc) {
    method_desc d;
    envmap map;
    paraboloid_pair pair;
    paraboloid_kernel kernel;
    int limit, k, mended;
    double cut, angle;
    envmap_result result = method_check(&d, dst, src, lobe, desc);
    if (result) return result;
    cut = d.cut > 0 ? (double)d.cut : 0.1, angle = paraboloid_angle(lobe, cut);
    mended = d.form == METHOD_MENDED;
    if (!method_setting(&limit, d.limit, 7, 63) || !(d.cut >= 0 && cut < 1) || !(d.border >= 0) ||
        !(d.white >= 0) || !method_falls(lobe) || angle > METHOD_PI * 80 / 180)
        return ENVMAP_ERROR_METHOD;
    result = method_levels(&map, src, ENVMAP_PARABOLOID, !mended);
    if (result) return result;
    if (!mended && d.white > 0) paraboloid_clamp(&map, d.white);
    memset(&pair, 0, sizeof pair);
    pair.one_map = d.one_map;
    for (k = 0; k < 2 && !result; ++k) {
        double size = 2 * ceil(map.size * paraboloid_radius(angle, k, mended) / 2 - 1e-9);
        int level = 0, shrink = paraboloid_shrink((int)size, map.size, limit);
        while (1 << level < shrink && level < map.levels - 1) ++level;
        paraboloid_kernel_of(&kernel, lobe, angle, limit, method_edge(&map, level), k, mended);
        result = paraboloid_map_create(k ? &pair.rim : &pair.centre, &map, &kernel, level, &d);
    }
    if (!result)
        method_fill(dst, lobe, method_scale(lobe) * (d.lossy ? paraboloid_share(lobe, angle) : 1),
                    paraboloid_value, &pair);
    paraboloid_pair_free(&pair);
    envmap_free(&map);
    return result;
}

#endif /* METHOD_PARABOLOID_CONVOLUTION_H */
