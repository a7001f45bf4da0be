/* methods.h - what the published approximations in this directory share: one signature, the checks,
   levels with and without their faults, lobes as distributions and as Gaussians.

       envmap_result method_xxx(envmap *dst, const envmap *src, const envmap_lobe *lobe,
                                const method_desc *desc);

   mirrors envmap_filter: dst level 0 = src level 0 filtered, every slice alike (only lobes without
   p are taken), any parameterization and size. desc NULL or all zero is the mended form with
   its defaults; METHOD_PUBLISHED is the form that was published, with its faults.
   Errors: ARGUMENT, RADIANCE (NaN, Inf), LOBE (no lobe at all), METHOD (not a lobe, or not a desc,
   for this method), MEMORY; dst then stays as it was.  Thread-safe.
   Include after envmap.h; every function is static inline.

   >>desc >>memory >>checks >>levels >>lookups >>lobes >>fill

   SPDX-License-Identifier: MIT */

#ifndef METHODS_H
#define METHODS_H

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define METHOD_PI 3.14159265358979323846

/* ------------------------------------------------------------------------------------ >>desc -- */

enum { METHOD_MENDED, METHOD_PUBLISHED, METHOD_FORM_COUNT };

typedef struct method_desc {
    int form;       /* METHOD_MENDED, or METHOD_PUBLISHED                                         */
    float cut;      /* paraboloid: the lobe ends where it is below this part of its peak; 0: 0.1  */
    int limit;      /* paraboloid: the kernel's texels per side, 1 .. 63; 0: 7                    */
    int one_map;    /* paraboloid: 1: only the map S of the small radius                          */
    int lossy;      /* paraboloid: 1: what was cut is lost, not restored                          */
    float level;    /* box levels: the level, (0, levels-1]; 0: the lobe's                        */
    float kernel;   /* Gaussian: sigma in texels of the level it is filtered at, 1 .. 16; 0: 4    */
    int samples;    /* importance sampling: directions per texel, 1 .. 65536; 0: 256              */
    int half_texel; /* importance sampling: 1: every lookup half a texel off                      */
    int discs;      /* summed areas: discs that stack up to the lobe, 1 .. 64; 0: 8               */
    int strips;     /* summed areas: boxes per disc, 1 .. 64; 0: 9                                */
    float border;   /* paraboloid, published: radii beyond the rim that are filled, black from
                       there; the paper's 64 texels are 0.25; 0: the square, its edge repeated    */
    float white;    /* paraboloid, published: the radiance that is 1 in maps of [0,1]; 0: floats  */
    int rounds;     /* Gaussian, published: of three passes; more than 0: each level of a chain
                       from the one before, as the write-up's program does it; 0: one             */
} method_desc;

/* A method with its settings, for tables of them. */
typedef envmap_result method_call(envmap *dst, const envmap *src, const envmap_lobe *lobe,
                                  const method_desc *desc);
typedef struct method_row {
    const char *name;
    method_call *call;
    method_desc desc;
} method_row;

/* ---------------------------------------------------------------------------------- >>memory -- */

/* Tests count and fail these. */
#ifndef METHOD_MALLOC
#define METHOD_MALLOC(bytes) malloc(bytes)
#define METHOD_FREE(pointer) free(pointer)
#endif

/* count * size bytes, NULL when that is more than memory can be. */
static inline void *method_alloc(size_t count, size_t size) {
    return count && size && count <= ((size_t)-1 >> 1) / size ? METHOD_MALLOC(count * size) : NULL;
}

/* ---------------------------------------------------------------------------------- >>checks -- */

static inline int method_edge(const envmap *map, int level) {
    return map->size >> level > 1 ? map->size >> level : 1;
}

static inline int method_width(const envmap *map, int level) {
    return method_edge(map, level) * (map->mapping == ENVMAP_LATLONG ? 2 : 1);
}

/* Floats of level 0 of one slice. */
static inline size_t method_floats(const envmap *map) {
    return 3 * (size_t)envmap_faces(map->mapping) * (size_t)method_width(map, 0) *
           (size_t)map->size;
}

static inline int method_finite(const envmap *map) {
    size_t i, n = method_floats(map);
    int bad = 0;
    for (i = 0; i < n; ++i) bad |= !(fabsf(map->texels[i]) <= 3.4028234e38f);
    return !bad;
}

/* 0 is the default; what is out of range makes the call fail. */
static inline int method_setting(int *out, int value, int fallback, int most) {
    *out = value ? value : fallback;
    return value >= 0 && value <= most;
}

/* What every method asks of a lobe. */
static inline envmap_result method_check_lobe(const envmap_lobe *lobe) {
    double one;
    envmap_result result;
    if (lobe->kind == ENVMAP_LOBE_MIRROR) return ENVMAP_ERROR_METHOD;
    result = envmap_lobe_zonal(&one, 1, lobe, (double)lobe->p0);
    if (result) return result;
    return lobe->p0 < lobe->p1 || lobe->p0 > lobe->p1 ? ENVMAP_ERROR_METHOD : ENVMAP_OK;
}

/* What every method asks of its arguments. Copies desc, or the defaults. */
static inline envmap_result method_check(method_desc *out, const envmap *dst, const envmap *src,
                                         const envmap_lobe *lobe, const method_desc *desc) {
    envmap_result result;
    memset(out, 0, sizeof *out);
    if (desc) *out = *desc;
    if (!envmap_texel(dst, 0, 0, 0, 0, 0) || !envmap_texel(src, 0, 0, 0, 0, 0) || !lobe ||
        dst->texels == src->texels || out->form < 0 || out->form >= METHOD_FORM_COUNT)
        return ENVMAP_ERROR_ARGUMENT;
    result = method_check_lobe(lobe);
    if (!result && src->slices != 1) result = ENVMAP_ERROR_METHOD;
    if (result) return result;
    return method_finite(src) ? ENVMAP_OK : ENVMAP_ERROR_RADIANCE;
}

/* ---------------------------------------------------------------------------------- >>levels -- */

/* The plain mean of the four texels above, each face alone: what most tools do. */
static inline void method_plain_level(envmap *map, int l) {
    int f, x, y, k, c, edge = method_edge(map, l), width = method_width(map, l);
    int last_x = method_width(map, l - 1) - 1, last_y = method_edge(map, l - 1) - 1;
    for (f = 0; f < envmap_faces(map->mapping); ++f)
        for (y = 0; y < edge; ++y)
            for (x = 0; x < width; ++x) {
                float *to = envmap_texel(map, l, 0, f, x, y);
                to[0] = to[1] = to[2] = 0;
                for (k = 0; k < 4; ++k) {
                    int i = 2 * x + k % 2, j = 2 * y + k / 2;
                    const float *from = envmap_texel(map, l - 1, 0, f, i < last_x ? i : last_x,
                                                     j < last_y ? j : last_y);
                    for (c = 0; c < 3; ++c) to[c] += 0.25f * from[c];
                }
            }
}

static inline void method_plain_levels(envmap *map) {
    int l;
    for (l = 1; l < map->levels; ++l) method_plain_level(map, l);
}

/* The edge, a power of two, at which a map of another parameterization loses nothing. */
static inline int method_size_for(const envmap *src, int mapping) {
    static const double per_edge[] = {6, 1.5708, 0.7854, 2, 0.7854, 1}; /* texels / edge^2 */
    double texels = per_edge[src->mapping] * src->size * src->size;
    int size = 1;
    if (src->mapping == (int)mapping) return src->size;
    while (size < 4096 && size * size * per_edge[mapping] < 0.9 * texels) size *= 2;
    return size;
}

/* A copy of src in a parameterization, with all its levels; `plain`: with plain_levels. */
static inline envmap_result method_levels(envmap *out, const envmap *src, int mapping, int plain) {
    int size = method_size_for(src, mapping);
    envmap_result result;
    memset(out, 0, sizeof *out);
    out->memory = src->memory;
    result = envmap_create(out, mapping, size, envmap_levels(size), 1);
    if (result) return result;
    result = envmap_resample(out, src, NULL);
    if (!result && plain) method_plain_levels(out);
    if (!result && !plain) result = envmap_mips_build(out);
    if (result) envmap_free(out);
    return result;
}

/* --------------------------------------------------------------------------------- >>lookups -- */

/* envmap_lookup, as hardware that knows no neighbouring faces does it: `shift` texels off along
   both sides of each level (Filament's libs/ibl: 1/2), clamped to the centres of the face. */
static inline void method_lookup_face(float rgb[3], const envmap *map, const float dir[3],
                                      float level, float shift) {
    int face, k, c, l = level > 0 ? (int)level : 0;
    float u, v, sum[3] = {0, 0, 0}, f;
    if (l > map->levels - 1) l = map->levels - 1;
    f = level > (float)l ? level - (float)l : 0;
    envmap_coordinates(&face, &u, &v, map->mapping, dir);
    for (k = 0; k < 2; ++k) {
        int at = l + k < map->levels ? l + k : l;
        float weight = k ? f : 1 - f, at_dir[3], w = (float)method_width(map, at);
        float h = (float)method_edge(map, at), s = u + shift / w, t = v + shift / h;
        if (!(weight > 0)) continue;
        s = fminf(fmaxf(s, 0.5f / w), 1 - 0.5f / w), t = fminf(fmaxf(t, 0.5f / h), 1 - 0.5f / h);
        envmap_direction(at_dir, map->mapping, face, s, t);
        envmap_lookup(rgb, map, at_dir, (float)at);
        for (c = 0; c < 3; ++c) sum[c] += weight * rgb[c];
    }
    for (c = 0; c < 3; ++c) rgb[c] = sum[c];
}

/* Two unit vectors at right angles to z and to one another. */
static inline void method_frame(float x[3], float y[3], const float z[3]) {
    float s = z[2] < 0 ? -1.0f : 1.0f, a = -1 / (s + z[2]), b = z[0] * z[1] * a;
    x[0] = 1 + s * z[0] * z[0] * a, x[1] = s * b, x[2] = -s * z[0];
    y[0] = b, y[1] = s + z[1] * z[1] * a, y[2] = -z[1];
}

/* ----------------------------------------------------------------------------------- >>lobes -- */

/* What a normalised result is to be multiplied by: lobe.raw asks for the papers' sums. */
static inline double method_scale(const envmap_lobe *lobe) {
    return lobe->raw ? envmap_lobe_integral(lobe, (double)lobe->p0) : 1;
}

#define METHOD_STEPS 4096

/* *cdf = a new [METHOD_STEPS + 1]: 2 pi integral of k sin t over t from 0 to pi i / STEPS, over its
   integral: the midpoint rule at 8 points a step. NULL, and METHOD, when k is negative somewhere. */
static inline envmap_result method_cumulate(double **cdf, const envmap_lobe *lobe) {
    int i, k, ok = 1;
    double sum = 0, step = METHOD_PI / METHOD_STEPS, *out;
    *cdf = out = (double *)method_alloc(METHOD_STEPS + 1, sizeof *out);
    if (!out) return ENVMAP_ERROR_MEMORY;
    out[0] = 0;
    for (i = 0; i < METHOD_STEPS && ok; ++i) {
        for (k = 0; k < 8; ++k) {
            double t = (i + (k + 0.5) / 8) * step;
            double v = envmap_lobe_value(lobe, cos(t), (double)lobe->p0);
            ok = ok && v >= 0, sum += v * sin(t);
        }
        out[i + 1] = sum;
    }
    for (i = 1; i <= METHOD_STEPS && ok && sum > 0; ++i) out[i] /= sum;
    if (ok && sum > 0) return ENVMAP_OK;
    METHOD_FREE(out);
    *cdf = NULL;
    return ENVMAP_ERROR_METHOD;
}

/* The angle where the cumulated lobe is `part`. Inside a step it grows with t^2 - t_i^2. */
static inline double method_quantile(const double *cdf, double part) {
    int from = 0, to = METHOD_STEPS;
    double f, a, b;
    while (to - from > 1) {
        int half = (from + to) / 2;
        if (cdf[half] <= part) from = half;
        else to = half;
    }
    f = cdf[to] > cdf[from] ? (part - cdf[from]) / (cdf[to] - cdf[from]) : 0;
    a = (double)from * from, b = (double)to * to;
    return sqrt(a + f * (b - a)) * METHOD_PI / METHOD_STEPS;
}

/* 1 when k falls from its peak at the axis, as every disc-shaped kernel wants it. */
static inline int method_falls(const envmap_lobe *lobe) {
    int i;
    double last = envmap_lobe_value(lobe, 1, (double)lobe->p0);
    for (i = 1; i <= 1024; ++i) {
        double v = envmap_lobe_value(lobe, cos(METHOD_PI * i / 1024), (double)lobe->p0);
        if (!(v >= 0 && v <= last * (1 + 1e-9))) return 0;
        last = v;
    }
    return 1;
}

#define METHOD_BANDS 256

/* The heat kernel exp(-l(l+1) sigma^2 / 2) that has the lobe's first harmonic: for Phong
   sigma^2 = ln((N+2)/(N+1)). Returns sigma, 0 where there is none. misfit (or NULL) gets the rms
   over all bands of what the two differ by, over the lobe's. */
static inline double method_gaussian(double *misfit, const envmap_lobe *lobe) {
    double lambda[METHOD_BANDS], error = 0, sum = 0, variance;
    int l;
    if (envmap_lobe_zonal(lambda, METHOD_BANDS, lobe, (double)lobe->p0)) return 0;
    if (!(lambda[1] > 0 && lambda[1] < lambda[0])) return 0;
    variance = log(lambda[0] / lambda[1]);
    for (l = 0; l < METHOD_BANDS; ++l) {
        double k = lambda[l] / lambda[0], e = k - exp(-0.5 * l * (l + 1) * variance);
        error += (2 * l + 1) * e * e, sum += (2 * l + 1) * k * k;
    }
    if (misfit) *misfit = sqrt(error / sum);
    return sqrt(variance);
}

/* The side of a mean texel of a cube face, rad. */
static inline double method_cube_texel(double edge) { return sqrt(METHOD_PI / 1.5) / edge; }

/* ------------------------------------------------------------------------------------ >>fill -- */

typedef void method_value(float rgb[3], const float dir[3], const void *user);

/* dst slice 0 = scale times value(direction), the other slices the same. */
static inline void method_fill(envmap *dst, const envmap_lobe *lobe, double scale,
                               method_value *value, const void *user) {
    int f, x, y, s, c, width = method_width(dst, 0);
    size_t floats = method_floats(dst);
    for (f = 0; f < envmap_faces(dst->mapping); ++f)
        for (y = 0; y < dst->size; ++y) {
            float *to = envmap_texel(dst, 0, 0, f, 0, y);
            for (x = 0; x < width; ++x, to += 3) {
                float dir[3], rgb[3];
                envmap_direction(dir, dst->mapping, f, ((float)x + 0.5f) / (float)width,
                                 ((float)y + 0.5f) / (float)dst->size);
                value(rgb, dir, user);
                for (c = 0; c < 3; ++c) to[c] = (float)(scale * (double)rgb[c]);
            }
        }
    for (s = 1; s < dst->slices; ++s)
        memcpy(dst->texels + (size_t)s * floats, dst->texels, floats * sizeof(float));
    dst->p0 = lobe->p0, dst->p1 = lobe->p1;
}

#endif /* METHODS_H */
