/* write_texels.h - RGB floats as the texels of a file: half, float, and the two packed formats that
   graphics cards read. Everything is rounded to the nearest, halves and small floats to even; what
   no number of the format can hold is saturated and counted, so that no Inf or NaN is ever written.

   Sources: IEEE 754-2008; Khronos Data Format Specification 1.3, sections 10.2 to 10.4 (10 and 11
   bits), and the OpenGL 4.6 specification, section 8.5.2 (shared exponent). Test: test_write.c.
   Include after write_file.h.

   SPDX-License-Identifier: MIT */

#ifndef WRITE_TEXELS_H
#define WRITE_TEXELS_H

#include <math.h>
#include <stdint.h>

typedef enum texel_format {
    TEXEL_RGBA16F,
    TEXEL_RGBA32F,
    TEXEL_RGB9E5,
    TEXEL_B10G11R11
} texel_format;

static const char *const texel_format_name[] = {"RGBA16F", "RGBA32F", "RGB9E5", "B10G11R11"};
static const int texel_bytes[] = {8, 16, 4, 4};

/* value >= 0 as a float of 5 exponent bits and `bits` bits of mantissa, without its sign. */
static inline unsigned texel_small_float(float value, int bits, long *saturated) {
    uint32_t u, exponent, shift = 23 - (uint32_t)bits, most = (31u << bits) - 1, kept, lost, half;
    memcpy(&u, &value, sizeof u);
    exponent = u >> 23 & 255;
    if (exponent < 113) { /* below 2^-14: denormal, in units of 2^(-14-bits) */
        shift += 113 - exponent;
        if (!exponent || shift > 24) return 0;
        u = (u & 0x7FFFFF) | 0x800000;
    } else u -= 112u << 23;
    kept = u >> shift, lost = u & ((1u << shift) - 1), half = 1u << (shift - 1);
    kept += lost > half || (lost == half && (kept & 1));
    if (kept <= most) return kept;
    ++*saturated;
    return most;
}

/* NaN, and below zero what a format without sign cannot hold: 0, and counted. */
static inline float texel_positive(float value, long *saturated) {
    if (value >= 0) return value;
    ++*saturated;
    return 0;
}

static inline unsigned texel_half(float value, long *saturated) {
    if (value < 0) return 0x8000u | texel_small_float(-value, 10, saturated);
    return texel_small_float(texel_positive(value, saturated), 10, saturated);
}

static inline uint32_t texel_b10g11r11(const float rgb[3], long *saturated) {
    uint32_t packed[3];
    int c;
    for (c = 0; c < 3; c++)
        packed[c] = texel_small_float(texel_positive(rgb[c], saturated), c < 2 ? 6 : 5, saturated);
    return packed[0] | packed[1] << 11 | packed[2] << 22;
}

/* Three mantissas of 9 bits, m 2^(e - 24), and one exponent of 5 bits. */
static inline uint32_t texel_rgb9e5(const float rgb[3], long *saturated) {
    float value[3], most = 0;
    uint32_t packed;
    int c, e;
    for (c = 0; c < 3; c++) {
        value[c] = texel_positive(rgb[c], saturated);
        if (value[c] > 65408) value[c] = 65408, ++*saturated;
        if (value[c] > most) most = value[c];
    }
    frexpf(most, &e); /* most < 2^e */
    e = most > 0 && e > -15 ? e + 15 : 0;
    e += floorf(ldexpf(most, 24 - e) + 0.5f) > 511;
    packed = (uint32_t)e << 27;
    for (c = 0; c < 3; c++) packed |= (uint32_t)floorf(ldexpf(value[c], 24 - e) + 0.5f) << 9 * c;
    return packed;
}

/* Floats too have a largest number; alpha is 1. */
static inline uint32_t texel_float(float value, long *saturated) {
    uint32_t u;
    memcpy(&u, &value, sizeof u);
    if ((u & 0x7F800000) != 0x7F800000) return u;
    ++*saturated;
    return u & 0x7FFFFF ? 0 : (u & 0x80000000) | 0x7F7FFFFF;
}

static inline void texel_put(unsigned char **out, uint32_t value, int bytes) {
    int k;
    for (k = 0; k < bytes; k++) *(*out)++ = (unsigned char)(value >> 8 * k & 255);
}

/* out  count * texel_bytes[format] bytes, little-endian; saturated  is added to. */
static inline void texel_encode(unsigned char *out, const float *rgb, size_t count, int format,
                                long *saturated) {
    size_t i;
    int c;
    for (i = 0; i < count; i++, rgb += 3) {
        if (format == TEXEL_RGB9E5) texel_put(&out, texel_rgb9e5(rgb, saturated), 4);
        else if (format == TEXEL_B10G11R11) texel_put(&out, texel_b10g11r11(rgb, saturated), 4);
        else if (format == TEXEL_RGBA16F) {
            for (c = 0; c < 3; c++) texel_put(&out, texel_half(rgb[c], saturated), 2);
            texel_put(&out, 0x3C00, 2);
        } else {
            for (c = 0; c < 3; c++) texel_put(&out, texel_float(rgb[c], saturated), 4);
            texel_put(&out, 0x3F800000, 4);
        }
    }
}

/* What every container writes: a map (all faces of it, all levels) in a format. A 2D texture is a
   map of one face. */
typedef struct texture {
    const envmap *map; /* slice 0 */
    int format;        /* texel_format */
    const char *notes; /* for KTX: more key-value pairs, "key\0value\0" each, or NULL */
    size_t notes_size;
    long saturated; /* out: numbers that did not fit */
} texture;

static inline int texture_edge(const texture *t, int level) {
    int edge = t->map->size >> level;
    return edge > 1 ? edge : 1;
}

static inline int texture_width(const texture *t, int level) {
    return texture_edge(t, level) * (t->map->mapping == ENVMAP_LATLONG ? 2 : 1);
}

static inline int texture_faces(const texture *t) { return envmap_faces(t->map->mapping); }

/* Bytes of one face of a level. */
static inline size_t texture_face_bytes(const texture *t, int level) {
    return (size_t)texture_edge(t, level) * (size_t)texture_width(t, level) *
           (size_t)texel_bytes[t->format];
}

static inline size_t texture_bytes(const texture *t) {
    size_t sum = 0;
    int level;
    for (level = 0; level < t->map->levels; level++)
        sum += texture_face_bytes(t, level) * (size_t)texture_faces(t);
    return sum;
}

/* One face of a level, row by row from v = 0. */
static inline void texture_write_face(write_file *w, texture *t, int level, int face) {
    int y, width = texture_width(t, level);
    size_t bytes = (size_t)width * (size_t)texel_bytes[t->format];
    unsigned char *row = (unsigned char *)malloc(bytes);
    if (!row && !w->error) w->error = ENOMEM;
    for (y = 0; y < texture_edge(t, level) && row && !w->error; y++) {
        texel_encode(row, envmap_texel(t->map, level, 0, face, 0, y), (size_t)width, t->format,
                     &t->saturated);
        write_bytes(w, row, bytes);
    }
    free(row);
}

/* Containers hold a cube, or one picture. */
static inline int texture_is_writable(const texture *t) {
    return t->map->texels && t->map->slices == 1 &&
           (texture_faces(t) == 6 || texture_faces(t) == 1);
}

/* out = one face of level 0, as a picture: a map of one square face, whose mapping says nothing. */
static inline envmap_result texture_face(envmap *out, const envmap *map, int face) {
    envmap_result result = envmap_create(out, ENVMAP_ANGULAR, map->size, 1, 1);
    size_t floats = 3 * (size_t)map->size * (size_t)map->size;
    if (!result) memcpy(out->texels, envmap_texel(map, 0, 0, face, 0, 0), floats * sizeof(float));
    return result;
}

#endif /* WRITE_TEXELS_H */
