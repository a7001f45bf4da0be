/* bake_read.h - the textures that bake has written, read back: what the preview shows and what the
   manifest's errors are measured on is what is in the files. Include after write_texels.h.

   SPDX-License-Identifier: MIT */

#ifndef BAKE_READ_H
#define BAKE_READ_H

static inline unsigned long bake_little(const unsigned char *p, int bytes) {
    unsigned long value = 0;
    while (bytes--) value = value << 8 | p[bytes];
    return value;
}

static inline float bake_small_float(unsigned bits, int mantissa) {
    int exponent = (int)(bits >> mantissa & 31);
    float m = (float)(bits & ((1u << mantissa) - 1));
    return exponent ? ldexpf(m + (float)(1 << mantissa), exponent - 15 - mantissa)
                    : ldexpf(m, -14 - mantissa);
}

static inline void bake_decode(float rgb[3], const unsigned char *p, int format) {
    unsigned u = (unsigned)bake_little(p, 4);
    int c;
    for (c = 0; c < 3; c++) {
        if (format == TEXEL_RGBA16F) {
            unsigned h = (unsigned)bake_little(p + 2 * c, 2);
            rgb[c] = bake_small_float(h & 0x7FFF, 10) * (h & 0x8000 ? -1.0f : 1.0f);
        } else if (format == TEXEL_RGBA32F) {
            uint32_t bits = (uint32_t)bake_little(p + 4 * c, 4);
            memcpy(&rgb[c], &bits, sizeof bits);
        } else if (format == TEXEL_RGB9E5)
            rgb[c] = ldexpf((float)(u >> 9 * c & 511), (int)(u >> 27) - 24);
        else rgb[c] = bake_small_float(u >> 11 * c & (c < 2 ? 2047 : 1023), c < 2 ? 6 : 5);
    }
}

/* Where a face of a level begins. */
static inline size_t bake_offset(const unsigned char *data, const texture *t, int container,
                                 int level, int face) {
    size_t at = 148, one = 0;
    int k;
    if (container == BAKE_KTX2)
        return bake_little(data + 80 + 24 * level, 4) + (size_t)face * texture_face_bytes(t, level);
    if (container == BAKE_KTX1) {
        at = 64 + bake_little(data + 60, 4);
        for (k = 0; k < level; k++) at += 4 + (size_t)texture_faces(t) * texture_face_bytes(t, k);
        return at + 4 + (size_t)face * texture_face_bytes(t, level);
    }
    for (k = 0; k < t->map->levels; k++) one += texture_face_bytes(t, k);
    for (k = 0; k < level; k++) at += texture_face_bytes(t, k);
    return at + (size_t)face * one;
}

/* map, of the shape of t's, = the file's texels. 0 where it is not as long as it should be. */
static inline int bake_unpack(envmap *map, const texture *t, int container,
                              const unsigned char *data, size_t size) {
    int level, face;
    for (level = 0; level < map->levels; level++)
        for (face = 0; face < texture_faces(t); face++) {
            size_t at = bake_offset(data, t, container, level, face), i;
            size_t bytes = texture_face_bytes(t, level);
            float *rgb = envmap_texel(map, level, 0, face, 0, 0);
            if (at + bytes > size) return 0;
            for (i = 0; i < bytes; i += (size_t)texel_bytes[t->format], rgb += 3)
                bake_decode(rgb, data + at + i, t->format);
        }
    return 1;
}

#endif /* BAKE_READ_H */
