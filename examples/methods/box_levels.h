/* box_levels.h - a glossy map for nothing: one trilinear lookup in the level of a cube whose boxes
   are about as wide as the lobe.

     L(a) = lookup(src, a, b)
     b = log2(size sigma / 0.72), sigma^2 = ln(lambda_0 / lambda_1)

   b is the level at which box and bilinear tent, together a variance of texel^2 / 4 along each
   side, have the lobe's first harmonic: a texel of 2 sigma. For Phong sigma^2 = ln((N+2)/(N+1)), so
   b = log2(size) + 0.47 - 1/2 log2 N: one level for four times the exponent.
   Published (the VR paper, "level of detail bias"): plain boxes, each face alone, so that the top
   level has six colours; its pair is N = 225, b = 2.25, found by eye. Mended: levels by solid
   angle, lookups across faces.

   Domain: lobes with a peak at their axis. Fails: the kernel is a box that stands on a grid, so a
   lamp shows as squares and jumps from texel to texel.  Tests: box_* in tests/methods/test_methods.c.

   SPDX-License-Identifier: MIT */

#ifndef METHOD_BOX_LEVELS_H
#define METHOD_BOX_LEVELS_H

#include "methods.h"

typedef struct method_box {
    envmap map;
    float level;
    int published;
} method_box;

/* The level b of a cube of an edge for a lobe; -1 where the lobe has no Gaussian. */
static inline double method_box_level(const envmap_lobe *lobe, int size) {
    double sigma = method_gaussian(NULL, lobe);
    return sigma > 0 ? fmax(0, log2(2 * sigma / method_cube_texel(size))) : -1;
}

static inline void method_box_value(float rgb[3], const float dir[3], const void *user) {
    const method_box *box = (const method_box *)user;
    if (box->published) method_lookup_face(rgb, &box->map, dir, box->level, 0);
    else envmap_lookup(rgb, &box->map, dir, box->level);
}

static inline envmap_result method_box_levels(envmap *dst, const envmap *src,
                                              const envmap_lobe *lobe, const method_desc *desc) {
    method_desc d;
    method_box box;
    double level;
    envmap_result result = method_check(&d, dst, src, lobe, desc);
    if (result) return result;
    level = method_box_level(lobe, method_size_for(src, ENVMAP_CUBE));
    if (level < 0 || !method_falls(lobe) || !(d.level >= 0)) return ENVMAP_ERROR_METHOD;
    box.published = d.form == METHOD_PUBLISHED;
    result = method_levels(&box.map, src, ENVMAP_CUBE, box.published);
    if (result) return result;
    box.level = d.level > 0 ? d.level : (float)level;
    if (box.level > (float)(box.map.levels - 1)) box.level = (float)(box.map.levels - 1);
    method_fill(dst, lobe, method_scale(lobe), method_box_value, &box);
    envmap_free(&box.map);
    return ENVMAP_OK;
}

#endif /* METHOD_BOX_LEVELS_H */
