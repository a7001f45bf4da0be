/* nonphotorealistic.h - maps that are drawn, not filtered: sphere maps in the viewer's frame, so
   that a point of the disc is a normal (X,Y) = (n_x,n_y), the centre faces the viewer and the rim
   is the silhouette. Source: W. Heidrich's part of the SIGGRAPH course on advanced rendering with
   graphics hardware, section 4; A. Gooch, B. Gooch, P. Shirley, E. Cohen. A non-photorealistic
   lighting model for automatic technical illustration, SIGGRAPH 1998.

     window      the sketch of a window with panes, as cartoonists put it on anything that shines
     gooch       k = (1 + l.n)/2: k warm + (1 - k) cool, and a highlight max(r.l,0)^N; or drawn, as
                 the course has it: two triangles and a circle, blurred
     silhouette  a black rim, `width` texels wide at every level: hand-built levels, for a level
                 that is averaged from the one above has a grey rim of half as many texels
     hatch       strokes on paper, close to the silhouette only, as many texels apart on every level

   A level is chosen by how small an object is on the screen: what is a number of texels on every
   level is as many pixels on the screen at every distance.
   Each fills every level of a map that the user has created, ENVMAP_SPHERE, one slice.
   Errors: ARGUMENT (NULL, another mapping).  Tests: drawn_* in test_materials.c.

   SPDX-License-Identifier: MIT */

#ifndef METHOD_NONPHOTOREALISTIC_H
#define METHOD_NONPHOTOREALISTIC_H

#include "methods.h"

/* rgb at the point (x,y) of the disc's [-1,1]^2 (y up), on a level of that edge. */
typedef void npr_point(float rgb[3], float x, float y, int edge, const void *user);

/* Every texel of every level, the mean of 4 x 4 points. */
static inline envmap_result npr_draw(envmap *map, npr_point *point, const void *user) {
    int l, x, y, s, c;
    if (!envmap_texel(map, 0, 0, 0, 0, 0) || map->mapping != ENVMAP_SPHERE || map->slices != 1)
        return ENVMAP_ERROR_ARGUMENT;
    for (l = 0; l < map->levels; ++l) {
        int edge = method_edge(map, l);
        for (y = 0; y < edge; ++y)
            for (x = 0; x < edge; ++x) {
                float *to = envmap_texel(map, l, 0, 0, x, y), rgb[3], sum[3] = {0, 0, 0};
                for (s = 0; s < 16; ++s) {
                    float u = ((float)x + ((float)(s % 4) + 0.5f) / 4) / (float)edge;
                    float v = ((float)y + ((float)(s / 4) + 0.5f) / 4) / (float)edge;
                    point(rgb, 2 * u - 1, 1 - 2 * v, edge, user);
                    for (c = 0; c < 3; ++c) sum[c] += rgb[c] / 16;
                }
                for (c = 0; c < 3; ++c) to[c] = sum[c];
            }
    }
    return ENVMAP_OK;
}

/* The normal at a point, at the rim for points outside. */
static inline void npr_normal(float n[3], float x, float y) {
    float r2 = x * x + y * y, r = r2 > 1 ? sqrtf(r2) : 1;
    n[0] = x / r, n[1] = y / r;
    n[2] = r2 < 1 ? sqrtf(1 - r2) : 0;
}

/* ---------------------------------------------------------------------------------- >>window -- */

typedef struct npr_window_desc {
    float base[3], light[3]; /* of the surface, and of the panes */
    int panes;               /* along each side */
} npr_window_desc;

/* Seen in the reflected direction: a window is a rectangle in slopes, left and above. */
static inline void npr_window_point(float rgb[3], float x, float y, int edge, const void *user) {
    const npr_window_desc *d = (const npr_window_desc *)user;
    float n[3], rx, ry, rz, u, v, bar = 0.07f;
    int c, inside;
    (void)edge;
    npr_normal(n, x, y);
    rx = 2 * n[2] * n[0], ry = 2 * n[2] * n[1], rz = 2 * n[2] * n[2] - 1;
    u = (rx / (rz + 1.2f) + 0.85f) / 0.6f, v = (ry / (rz + 1.2f) - 0.25f) / 0.6f;
    inside = u > 0 && u < 1 && v > 0 && v < 1;
    if (inside) {
        float pu = u * (float)d->panes, pv = v * (float)d->panes;
        pu -= floorf(pu), pv -= floorf(pv);
        inside = pu > bar && pu < 1 - bar && pv > bar && pv < 1 - bar;
    }
    for (c = 0; c < 3; ++c) rgb[c] = inside ? d->light[c] : d->base[c] * (0.35f + 0.65f * n[2]);
}

static inline envmap_result npr_window(envmap *map, const npr_window_desc *desc) {
    return desc && desc->panes >= 1 ? npr_draw(map, npr_window_point, desc) : ENVMAP_ERROR_ARGUMENT;
}

/* ----------------------------------------------------------------------------------- >>gooch -- */

typedef struct npr_gooch_desc {
    float warm[3], cool[3], light[3], exponent; /* light: a unit direction, viewer at +z */
} npr_gooch_desc;

static inline void npr_gooch_point(float rgb[3], float x, float y, int edge, const void *user) {
    const npr_gooch_desc *d = (const npr_gooch_desc *)user;
    float n[3], k, shine;
    int c;
    (void)edge;
    npr_normal(n, x, y);
    k = (1 + n[0] * d->light[0] + n[1] * d->light[1] + n[2] * d->light[2]) / 2;
    shine = 2 * n[2] * (n[0] * d->light[0] + n[1] * d->light[1] + n[2] * d->light[2]) - d->light[2];
    shine = shine > 0 ? powf(shine, d->exponent) : 0;
    for (c = 0; c < 3; ++c) rgb[c] = (k * d->warm[c] + (1 - k) * d->cool[c]) * (1 - shine) + shine;
}

static inline envmap_result npr_gooch(envmap *map, const npr_gooch_desc *desc) {
    return desc ? npr_draw(map, npr_gooch_point, desc) : ENVMAP_ERROR_ARGUMENT;
}

/* A square cut along its diagonal into a warm and a cool triangle, and a white circle where the
   highlight is. */
static inline void npr_gooch_flat(float rgb[3], float x, float y, const npr_gooch_desc *d) {
    float half = sqrtf(2 + 2 * d->light[2]), hx = d->light[0] / half, hy = d->light[1] / half;
    int white = hypotf(x - hx, y - hy) < sqrtf(1.4f / d->exponent), c;
    const float *colour = x * d->light[0] + y * d->light[1] > 0 ? d->warm : d->cool;
    for (c = 0; c < 3; ++c) rgb[c] = white ? 1 : colour[c];
}

typedef struct npr_gooch_blur {
    const npr_gooch_desc *gooch;
    float sigma; /* in radii of the disc */
} npr_gooch_blur;

#define NPR_BLUR 256

/* The mean of points that are spread like a Gaussian. */
static inline void npr_gooch_blur_point(float rgb[3], float x, float y, int edge,
                                        const void *user) {
    const npr_gooch_blur *d = (const npr_gooch_blur *)user;
    int k, c;
    (void)edge;
    rgb[0] = rgb[1] = rgb[2] = 0;
    for (k = 0; k < NPR_BLUR; ++k) {
        float r = d->sigma * sqrtf(-2 * logf(1 - ((float)k + 0.5f) / NPR_BLUR)), one[3];
        float turn = 2.39996323f * (float)k; /* the golden angle */
        npr_gooch_flat(one, x + r * cosf(turn), y + r * sinf(turn), d->gooch);
        for (c = 0; c < 3; ++c) rgb[c] += one[c] / NPR_BLUR;
    }
}

/* sigma  of the blur, in radii of the disc; 0: as it was drawn */
static inline envmap_result npr_gooch_drawn(envmap *map, const npr_gooch_desc *desc, float sigma) {
    npr_gooch_blur blur;
    blur.gooch = desc, blur.sigma = sigma;
    return desc && sigma >= 0 ? npr_draw(map, npr_gooch_blur_point, &blur) : ENVMAP_ERROR_ARGUMENT;
}

/* ------------------------------------------------------------------------------ >>silhouette -- */

typedef struct npr_silhouette_desc {
    float width; /* of the rim, in texels of every level */
    float paper[3], ink[3];
} npr_silhouette_desc;

static inline void npr_silhouette_point(float rgb[3], float x, float y, int edge,
                                        const void *user) {
    const npr_silhouette_desc *d = (const npr_silhouette_desc *)user;
    float rim = 1 - 2 * d->width / (float)edge;
    int black = x * x + y * y > (rim > 0 ? rim * rim : 0);
    memcpy(rgb, black ? d->ink : d->paper, 3 * sizeof(float));
}

static inline envmap_result npr_silhouette(envmap *map, const npr_silhouette_desc *desc) {
    return desc && desc->width >= 0 ? npr_draw(map, npr_silhouette_point, desc)
                                    : ENVMAP_ERROR_ARGUMENT;
}

/* ----------------------------------------------------------------------------------- >>hatch -- */

typedef struct npr_hatch_desc {
    float spacing, from; /* texels between strokes; n.v below which there are any, (0,1] */
    float paper[3], ink[3];
} npr_hatch_desc;

/* Slanted strokes that grow thicker towards the silhouette, and a second family across them where
   it is nearest. */
static inline void npr_hatch_point(float rgb[3], float x, float y, int edge, const void *user) {
    const npr_hatch_desc *d = (const npr_hatch_desc *)user;
    float n[3], dark, texels = (float)edge / 2, a, b;
    int black;
    npr_normal(n, x, y);
    dark = 1 - n[2] / d->from;
    a = (x + 0.6f * y) * 0.8575f * texels / d->spacing,
    b = (x - 0.6f * y) * 0.8575f * texels / d->spacing;
    a -= floorf(a), b -= floorf(b);
    black = dark > 0 && (a < 0.2f + 0.4f * dark || (dark > 0.5f && b < 0.8f * (dark - 0.5f)));
    memcpy(rgb, black ? d->ink : d->paper, 3 * sizeof(float));
}

static inline envmap_result npr_hatch(envmap *map, const npr_hatch_desc *desc) {
    return desc && desc->spacing > 0 && desc->from > 0 ? npr_draw(map, npr_hatch_point, desc)
                                                       : ENVMAP_ERROR_ARGUMENT;
}

/* -------------------------------------------------------------------------------- >>examples -- */

/* The four as the pictures have them. */
enum { NPR_WINDOW, NPR_GOOCH, NPR_SILHOUETTE, NPR_HATCH, NPR_COUNT };
static const char *const npr_name[NPR_COUNT] = {"window", "Gooch", "silhouette", "hatching"};

static const npr_gooch_desc npr_gooch_example = {
    {0.9f, 0.6f, 0.15f}, {0.08f, 0.12f, 0.6f}, {-0.5f, 0.7f, 0.51f}, 60};

static inline envmap_result npr_example(envmap *map, int kind) {
    static const npr_window_desc window = {{0.06f, 0.1f, 0.28f}, {1.3f, 1.3f, 1.2f}, 2};
    static const npr_silhouette_desc rim = {2, {0.8f, 0.8f, 0.8f}, {0, 0, 0}};
    static const npr_hatch_desc hatch = {7, 0.9f, {0.9f, 0.9f, 0.85f}, {0, 0, 0}};
    return kind == NPR_WINDOW       ? npr_window(map, &window)
           : kind == NPR_GOOCH      ? npr_gooch(map, &npr_gooch_example)
           : kind == NPR_SILHOUETTE ? npr_silhouette(map, &rim)
                                    : npr_hatch(map, &hatch);
}

#endif /* METHOD_NONPHOTOREALISTIC_H */
