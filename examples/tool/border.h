/* border.h - texels around an octahedral map, so that a sampler that knows nothing of its folds
   looks it up without seams: what lies beyond an edge is the same edge turned about its middle,
   beyond a corner the opposite corner. A direction's place in the wider picture is
   b + (1 - 2 b) u, b + (1 - 2 b) v with b = border / (size + 2 border); every level has the same b.

   Docs: docs/parameterizations.md. Test: tests/test_write.c. Include after envmap.h.

   SPDX-License-Identifier: MIT */

#ifndef BORDER_H
#define BORDER_H

#include <string.h>

/* Where texel (x,y) is, up to a whole edge outside of a map. */
static inline void border_fold(int *x, int *y, int edge) {
    if (*x < 0 || *x >= edge) *x = (*x < 0 ? 0 : 2 * edge) - 1 - *x, *y = edge - 1 - *y;
    if (*y < 0 || *y >= edge) *y = (*y < 0 ? 0 : 2 * edge) - 1 - *y, *x = edge - 1 - *x;
}

/* Levels that hold half the edge and half the border of the one before, to the texel. */
static inline int border_levels(int size, int border) {
    int levels = 1;
    for (; size % 2 == 0 && border % 2 == 0 && border > 0; size /= 2, border /= 2) levels++;
    return levels;
}

static inline void border_fill(envmap *out, const envmap *in, int border, int level, int slice) {
    int edge = in->size >> level, wide = border >> level, x, y;
    for (y = -wide; y < edge + wide; y++)
        for (x = -wide; x < edge + wide; x++) {
            int i = x, j = y;
            border_fold(&i, &j, edge);
            memcpy(envmap_texel(out, level, slice, 0, x + wide, y + wide),
                   envmap_texel(in, level, slice, 0, i, j), 3 * sizeof(float));
        }
}

/* out = an octahedral map with its border, up to as wide as the map, as a larger picture; with the
   levels that border_levels allows. */
static inline envmap_result border_map(envmap *out, const envmap *in, int border) {
    int levels = border_levels(in->size, border), level, slice;
    envmap_result result;
    if (in->mapping != ENVMAP_OCTAHEDRAL || border > in->size) return ENVMAP_ERROR_ARGUMENT;
    if (levels > in->levels) levels = in->levels;
    result = envmap_create(out, ENVMAP_OCTAHEDRAL, in->size + 2 * border, levels, in->slices);
    for (level = 0; level < levels && !result; level++)
        for (slice = 0; slice < in->slices; slice++) border_fill(out, in, border, level, slice);
    return result;
}

#endif /* BORDER_H */
