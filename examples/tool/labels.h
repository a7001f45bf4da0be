/* labels.h - a sky that shows at one look whether a program has it the right way: every axis has
   its name and a colour of its own.

   What you will see: seen from the middle, with +y up and looking along -z: "-Z" ahead, "+X" to the
   right, "+Y" overhead, and all letters read rightly. Turned names mean another convention (see
   --from-convention), reversed letters a mirror. Include after gallery.h.

   SPDX-License-Identifier: MIT */

#ifndef LABELS_H
#define LABELS_H

#include <math.h>

/* +X -X +Y -Y +Z -Z: red, cyan, green, magenta, blue, yellow. */
static const float label_colours[6][3] = {{0.7f, 0.1f, 0.1f},  {0.1f, 0.5f, 0.5f},
                                          {0.1f, 0.6f, 0.1f},  {0.5f, 0.1f, 0.5f},
                                          {0.1f, 0.15f, 0.8f}, {0.6f, 0.5f, 0.1f}};

/* White letters with a black edge, and a grid of black lines between the colours. */
static inline void label_radiance(float rgb[3], const float d[3]) {
    float a = fabsf(d[0]), b = fabsf(d[1]), c = fabsf(d[2]), most = fmaxf(a, fmaxf(b, c));
    int axis = most <= a ? 0 : most <= b ? 1 : 2, sign = gallery_sign(d);
    float next = a + b + c - most - fminf(a, fminf(b, c));
    const float *colour = label_colours[2 * axis + (d[axis] < 0)];
    scene_set(rgb, colour[0], colour[1], colour[2]);
    if (sign == 1) scene_set(rgb, 2, 2, 2);
    if (sign == 2 || next > 0.97f * most) scene_set(rgb, 0, 0, 0);
}

/* Level 0, slice 0: each texel the mean of 4 x 4 points. */
static inline void labels_fill(envmap *map) {
    int width = map->mapping == ENVMAP_LATLONG ? 2 * map->size : map->size, face, x, y, k, c;
    for (face = 0; face < envmap_faces(map->mapping); face++)
        for (y = 0; y < map->size; y++)
            for (x = 0; x < width; x++)
                for (k = 0; k < 16; k++) {
                    float d[3], rgb[3];
                    envmap_direction(d, map->mapping, face,
                                     ((float)x + ((float)(k % 4) + 0.5f) / 4) / (float)width,
                                     ((float)y + ((float)(k / 4) + 0.5f) / 4) / (float)map->size);
                    label_radiance(rgb, d);
                    for (c = 0; c < 3; c++) envmap_texel(map, 0, 0, face, x, y)[c] += rgb[c] / 16;
                }
}

#endif /* LABELS_H */
