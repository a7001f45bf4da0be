/* orientation.h - which way a map looks: turns it by angles, and from other programs' conventions
   to ours, which are in docs/parameterizations.md. Include after envmap.h.

       out(d) = in(M^T d)     M: what was in direction d is then in direction M d

   By right angles and mirrors every texel keeps its numbers where the mapping has that symmetry;
   else each new texel is the mean of some lookups in its area.
   Test: tests/test_tool_read.c.

   SPDX-License-Identifier: MIT */

#ifndef ORIENTATION_H
#define ORIENTATION_H

#include <math.h>
#include <string.h>

/* A convention that differs from ours by a turn about +y and a mirror, applied in this order. */
typedef struct orientation_convention {
    double yaw;   /* degrees, as in orientation_matrix */
    int mirrored; /* 1: z points the other way: its space is left-handed */
} orientation_convention;

static const char *const orientation_words[] = {"envmap", "openexr", "three", "directx", NULL};
static const orientation_convention orientation_conventions[] = {
    {0, 0}, {180, 0}, {-90, 0}, {0, 1}};

static inline void orientation_multiply(double out[9], const double a[9], const double b[9]) {
    double m[9];
    int i, j;
    for (i = 0; i < 3; i++)
        for (j = 0; j < 3; j++)
            m[3 * i + j] = a[3 * i] * b[j] + a[3 * i + 1] * b[3 + j] + a[3 * i + 2] * b[6 + j];
    memcpy(out, m, sizeof m);
}

/* m = m turned further, by degrees about an axis (0 x, 1 y, 2 z), right-handed; exact at right
   angles. */
static inline void orientation_turn(double m[9], int axis, double degrees) {
    double turn = remainder(degrees, 360), r[9] = {0};
    double c = cos(turn * 0.017453292519943295), s = sin(turn * 0.017453292519943295);
    int i = (axis + 1) % 3, j = (axis + 2) % 3;
    if (remainder(turn, 90) < 1e-9 && remainder(turn, 90) > -1e-9) c = round(c), s = round(s);
    r[4 * axis] = 1, r[4 * i] = c, r[3 * i + j] = -s, r[3 * j + i] = s, r[4 * j] = c;
    orientation_multiply(m, r, m);
}

/* First from a convention to ours; then about +z by roll, about +x by pitch, about +y by yaw, each
   right-handed, in degrees. A yaw of 90 brings what was in the middle of a lat-long, -z, to -x. */
static inline void orientation_matrix(double m[9], int convention, const double angles[3]) {
    const orientation_convention *from = &orientation_conventions[convention];
    static const double identity[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    memcpy(m, identity, sizeof identity);
    orientation_turn(m, 1, from->yaw);
    if (from->mirrored) m[6] = -m[6], m[7] = -m[7], m[8] = -m[8];
    orientation_turn(m, 2, angles[2]);
    orientation_turn(m, 0, angles[1]);
    orientation_turn(m, 1, angles[0]);
}

static inline int orientation_is_identity(const double m[9]) {
    int i;
    for (i = 0; i < 9; i++)
        if (fabs(m[i] - (i % 4 == 0)) > 1e-12) return 0;
    return 1;
}

/* The texel of in at (u,v) of a face, if that is its centre; NULL between centres. */
static inline const float *orientation_texel(const envmap *in, int slice, int face, float u,
                                             float v) {
    int width = in->mapping == ENVMAP_LATLONG ? 2 * in->size : in->size;
    double x = (double)u * width - 0.5, y = (double)v * in->size - 0.5;
    double i = floor(x + 0.5), j = floor(y + 0.5);
    if (fabs(x - i) > 0.02 || fabs(y - j) > 0.02) return NULL;
    return envmap_texel(in, 0, slice, face, (int)i, (int)j);
}

/* rgb += what is seen of in where out's point (u,v) is. */
static inline void orientation_add(float rgb[3], const envmap *in, const double m[9], int slice,
                                   int face, float u, float v) {
    float to[3], from[3], seen[3];
    const float *texel;
    int i;
    envmap_direction(to, in->mapping, face, u, v);
    for (i = 0; i < 3; i++)
        from[i] =
            (float)(m[i] * (double)to[0] + m[3 + i] * (double)to[1] + m[6 + i] * (double)to[2]);
    envmap_coordinates(&face, &u, &v, in->mapping, from);
    texel = orientation_texel(in, slice, face, u, v);
    if (!texel) {
        double p = (double)in->p0 + (double)(in->p1 - in->p0) * (slice + 0.5) / in->slices;
        envmap_lookup_slice(seen, in, from, (float)p, 0);
        texel = seen;
    }
    for (i = 0; i < 3; i++) rgb[i] += texel[i];
}

/* out, of in's mapping and size, = in turned; points: 1 where texels lie on texels, else some. */
static inline void orientation_apply(envmap *out, const envmap *in, const double m[9], int points) {
    int width = in->mapping == ENVMAP_LATLONG ? 2 * in->size : in->size, slice, face, x, y, k, c;
    for (slice = 0; slice < in->slices; slice++)
        for (face = 0; face < envmap_faces(in->mapping); face++)
            for (y = 0; y < in->size; y++)
                for (x = 0; x < width; x++) {
                    float *texel = envmap_texel(out, 0, slice, face, x, y);
                    for (k = 0; k < points * points; k++)
                        orientation_add(texel, in, m, slice, face,
                                        ((float)x + ((float)(k % points) + 0.5f) / (float)points) /
                                            (float)width,
                                        ((float)y + ((float)(k / points) + 0.5f) / (float)points) /
                                            (float)in->size);
                    for (c = 0; c < 3 && points > 1; c++) texel[c] /= (float)(points * points);
                }
}

/* Turns a map of one level. */
static inline envmap_result orientation_turn_map(envmap *map, const double m[9]) {
    envmap out = {0};
    envmap_result result;
    int i, right = 1;
    if (orientation_is_identity(m)) return ENVMAP_OK;
    for (i = 0; i < 9; i++) right &= fabs(m[i] - round(m[i])) < 1e-12;
    result = envmap_create(&out, map->mapping, map->size, 1, map->slices);
    if (result) return result;
    out.p0 = map->p0, out.p1 = map->p1;
    orientation_apply(&out, map, m, right ? 1 : 3);
    envmap_free(map);
    *map = out;
    return ENVMAP_OK;
}

#endif /* ORIENTATION_H */
