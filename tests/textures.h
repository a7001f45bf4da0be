/* SPDX-License-Identifier: MIT
   Readers of texture files, from the published pages of the formats alone: KTX 2.0 and 1.1, DDS,
   Radiance. They share nothing with the tool's writers, and know only what those write: cubes and
   pictures in four formats. Numbers become doubles by the formulas of the specifications. */
#ifndef TEXTURES_H
#define TEXTURES_H

#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { TEXTURE_RGBA16F, TEXTURE_RGBA32F, TEXTURE_RGB9E5, TEXTURE_B10G11R11, TEXTURE_RGBE };

typedef struct texture_file {
    unsigned char *data;
    size_t size;
    int good, format, width, height, levels, faces;
    size_t at[32][6];     /* where each face of each level begins */
    const char *keys[16]; /* of KTX: keys, and behind each one's 0 its value */
    int key_count;
} texture_file;

static inline void texture_file_free(texture_file *f) {
    free(f->data);
    f->data = NULL;
}

/* --------------------------------------------------------------------------------- numbers -- */

/* s eeeee mmmmmmmmmm, bias 15; no Inf or NaN is expected. */
static inline double texture_half_value(unsigned h) {
    int e = h >> 10 & 31, m = h & 1023;
    double value = e ? ldexp(1024 + m, e - 25) : ldexp(m, -24);
    return h & 0x8000 ? -value : value;
}

static inline double texture_unsigned_value(unsigned bits, int mantissa) {
    int e = (int)(bits >> mantissa & 31), m = (int)(bits & ((1u << mantissa) - 1));
    return e ? ldexp(1 + ldexp(m, -mantissa), e - 15) : ldexp(m, -14 - mantissa);
}

static inline void texture_b10g11r11_value(double rgb[3], uint32_t u) {
    rgb[0] = texture_unsigned_value(u & 2047, 6);
    rgb[1] = texture_unsigned_value(u >> 11 & 2047, 6);
    rgb[2] = texture_unsigned_value(u >> 22, 5);
}

static inline void texture_rgb9e5_value(double rgb[3], uint32_t u) {
    for (int c = 0; c < 3; ++c) rgb[c] = ldexp(u >> 9 * c & 511, (int)(u >> 27) - 15 - 9);
}

static inline uint64_t texture_little(const unsigned char *p, int bytes) {
    uint64_t value = 0;
    for (int k = bytes - 1; k >= 0; --k) value = value << 8 | p[k];
    return value;
}

/* ------------------------------------------------------------------------------- the texels -- */

static inline int texture_file_width(const texture_file *f, int level) {
    return f->width >> level > 1 ? f->width >> level : 1;
}
static inline int texture_file_height(const texture_file *f, int level) {
    return f->height >> level > 1 ? f->height >> level : 1;
}

static inline size_t texture_texel_bytes(int format) {
    static const size_t bytes[] = {8, 16, 4, 4, 4};
    return bytes[format];
}

static inline size_t texture_face_size(const texture_file *f, int level) {
    return (size_t)texture_file_width(f, level) * (size_t)texture_file_height(f, level) *
           texture_texel_bytes(f->format);
}

/* 0 where the file has no such texel. */
static inline int texture_file_texel(double rgb[3], const texture_file *f, int level, int face,
                                     int x, int y) {
    size_t at = f->at[level][face] +
                texture_texel_bytes(f->format) * (size_t)(y * texture_file_width(f, level) + x);
    const unsigned char *p = f->data + at;
    if (!f->good || at + texture_texel_bytes(f->format) > f->size) return 0;
    if (f->format == TEXTURE_B10G11R11)
        texture_b10g11r11_value(rgb, (uint32_t)texture_little(p, 4));
    if (f->format == TEXTURE_RGB9E5) texture_rgb9e5_value(rgb, (uint32_t)texture_little(p, 4));
    for (int c = 0; c < 3; ++c) {
        uint32_t u = (uint32_t)texture_little(p + 4 * c, 4);
        float value;
        memcpy(&value, &u, sizeof value);
        if (f->format == TEXTURE_RGBA16F)
            rgb[c] = texture_half_value((unsigned)texture_little(p + 2 * c, 2));
        if (f->format == TEXTURE_RGBA32F) rgb[c] = (double)value;
        if (f->format == TEXTURE_RGBE) rgb[c] = p[3] ? ldexp(p[c], p[3] - 136) : 0;
    }
    return 1;
}

static inline texture_file texture_open(const char *name) {
    texture_file f;
    FILE *file = fopen(name, "rb");
    memset(&f, 0, sizeof f);
    if (!file) return f;
    fseek(file, 0, SEEK_END);
    f.size = (size_t)ftell(file);
    rewind(file);
    f.data = (unsigned char *)calloc(f.size + 16, 1);
    if (fread(f.data, 1, f.size, file) != f.size) f.size = 0;
    fclose(file);
    return f;
}

/* Pairs: 4 bytes of length, key 0 value, padding to 4. */
static inline void texture_keys(texture_file *f, size_t at, size_t bytes) {
    size_t end = at + bytes;
    while (at + 4 < end && f->key_count < 16) {
        size_t size = (size_t)texture_little(f->data + at, 4);
        f->keys[f->key_count++] = (const char *)f->data + at + 4;
        at += 4 + (size + 3) / 4 * 4;
    }
    if (at != end) f->good = 0;
}

/* The value of a key, or NULL. */
static inline const char *texture_value(const texture_file *f, const char *key) {
    for (int k = 0; k < f->key_count; ++k)
        if (!strcmp(f->keys[k], key)) return f->keys[k] + strlen(key) + 1;
    return NULL;
}

/* -------------------------------------------------------------------------------- containers -- */

/* KTX 2.0: 80 bytes of header, then 24 a level: offset, length, length when inflated. */
static inline texture_file texture_ktx2(const char *name) {
    static const unsigned char magic[] = {0xAB, 0x4B, 0x54, 0x58, 0x20, 0x32,
                                          0x30, 0xBB, 0x0D, 0x0A, 0x1A, 0x0A};
    texture_file f = texture_open(name);
    const unsigned char *h = f.data;
    if (f.size < 104 || memcmp(h, magic, 12)) return f;
    uint64_t vk = texture_little(h + 12, 4);
    f.format = vk == 97    ? TEXTURE_RGBA16F
               : vk == 109 ? TEXTURE_RGBA32F
               : vk == 123 ? TEXTURE_RGB9E5
               : vk == 122 ? TEXTURE_B10G11R11
                           : -1;
    f.width = (int)texture_little(h + 20, 4), f.height = (int)texture_little(h + 24, 4);
    f.faces = (int)texture_little(h + 36, 4), f.levels = (int)texture_little(h + 40, 4);
    f.good = f.format >= 0 && !texture_little(h + 28, 8) && !texture_little(h + 44, 4) &&
             (f.faces == 1 || f.faces == 6) && f.levels > 0 && f.levels < 20;
    size_t dfd = (size_t)texture_little(h + 48, 4), kvd = (size_t)texture_little(h + 56, 4);
    size_t kvd_size = (size_t)texture_little(h + 60, 4);
    if (!f.good) return f;
    f.good = dfd == 80 + 24 * (size_t)f.levels && kvd == dfd + texture_little(h + 52, 4) &&
             texture_little(h + dfd, 4) == texture_little(h + 52, 4) &&
             !texture_little(h + 64, 8) && !texture_little(h + 72, 8);
    texture_keys(&f, kvd, kvd_size);
    for (int l = 0; l < f.levels && f.good; ++l) {
        const unsigned char *index = h + 80 + 24 * l;
        size_t at = (size_t)texture_little(index, 8), bytes = (size_t)texture_little(index + 8, 8);
        f.good = bytes == texture_face_size(&f, l) * (size_t)f.faces &&
                 bytes == texture_little(index + 16, 8) && at + bytes <= f.size &&
                 at % texture_texel_bytes(f.format) == 0 && at >= kvd + kvd_size;
        for (int k = 0; k < f.faces; ++k) f.at[l][k] = at + (size_t)k * texture_face_size(&f, l);
    }
    return f;
}

/* KTX 1.1: 64 bytes of header, pairs, then each level: size of a face (cubes) or of all, data. */
static inline texture_file texture_ktx1(const char *name) {
    static const unsigned char magic[] = {0xAB, 0x4B, 0x54, 0x58, 0x20, 0x31,
                                          0x31, 0xBB, 0x0D, 0x0A, 0x1A, 0x0A};
    texture_file f = texture_open(name);
    const unsigned char *h = f.data;
    if (f.size < 64 || memcmp(h, magic, 12) || texture_little(h + 12, 4) != 0x04030201) return f;
    uint64_t gl = texture_little(h + 28, 4), type = texture_little(h + 16, 4);
    f.format = gl == 0x881A && type == 0x140B   ? TEXTURE_RGBA16F
               : gl == 0x8814 && type == 0x1406 ? TEXTURE_RGBA32F
               : gl == 0x8C3D && type == 0x8C3E ? TEXTURE_RGB9E5
               : gl == 0x8C3A && type == 0x8C3B ? TEXTURE_B10G11R11
                                                : -1;
    f.width = (int)texture_little(h + 36, 4), f.height = (int)texture_little(h + 40, 4);
    f.faces = (int)texture_little(h + 52, 4), f.levels = (int)texture_little(h + 56, 4);
    size_t at = 64 + (size_t)texture_little(h + 60, 4);
    f.good = f.format >= 0 && (f.faces == 1 || f.faces == 6) && f.levels > 0 && f.levels < 20;
    texture_keys(&f, 64, at - 64);
    for (int l = 0; l < f.levels && f.good; ++l) {
        size_t bytes = (size_t)texture_little(h + at, 4);
        f.good = bytes == texture_face_size(&f, l);
        at += 4;
        for (int k = 0; k < f.faces; ++k, at += bytes) f.at[l][k] = at;
        if (at > f.size) f.good = 0;
    }
    f.good = f.good && at == f.size;
    return f;
}

/* DDS: "DDS ", 124 bytes, 20 bytes of DX10; each face with all its levels. */
static inline texture_file texture_dds(const char *name) {
    texture_file f = texture_open(name);
    const unsigned char *h = f.data;
    if (f.size < 148 || memcmp(h, "DDS ", 4) || memcmp(h + 84, "DX10", 4)) return f;
    uint64_t dxgi = texture_little(h + 128, 4), caps2 = texture_little(h + 112, 4);
    f.format = dxgi == 10   ? TEXTURE_RGBA16F
               : dxgi == 2  ? TEXTURE_RGBA32F
               : dxgi == 67 ? TEXTURE_RGB9E5
               : dxgi == 26 ? TEXTURE_B10G11R11
                            : -1;
    f.height = (int)texture_little(h + 12, 4), f.width = (int)texture_little(h + 16, 4);
    f.levels = (int)texture_little(h + 28, 4);
    int cube = (texture_little(h + 136, 4) & 4) != 0;
    f.faces = cube ? 6 : 1;
    f.good = f.format >= 0 && texture_little(h + 4, 4) == 124 && texture_little(h + 76, 4) == 32 &&
             texture_little(h + 80, 4) == 4 && texture_little(h + 132, 4) == 3 &&
             texture_little(h + 140, 4) == 1 && cube == (caps2 == 0xFE00) && f.levels > 0 &&
             f.levels < 20 && (texture_little(h + 108, 4) & 0x1000);
    size_t at = 148;
    for (int k = 0; k < f.faces && f.good; ++k)
        for (int l = 0; l < f.levels; ++l) f.at[l][k] = at, at += texture_face_size(&f, l);
    f.good = f.good && at == f.size;
    return f;
}

/* A row of Radiance's newer runs: 2 2 width, then each channel; or 4 bytes a pixel as they are.
   Returns the bytes read, 0 for a bad row. */
static inline size_t texture_hdr_row(unsigned char *out, const unsigned char *p,
                                     const unsigned char *end, int width) {
    const unsigned char *start = p;
    if (width < 8 || width > 32767) {
        memcpy(out, p, 4 * (size_t)width);
        return 4 * (size_t)width;
    }
    if (p[0] != 2 || p[1] != 2 || p[2] * 256 + p[3] != width) return 0;
    p += 4;
    for (int c = 0; c < 4; ++c)
        for (int x = 0; x < width;) {
            int count = *p++, run = count > 128;
            if (run) count -= 128;
            if (!count || x + count > width || p >= end) return 0;
            for (int k = 0; k < count; ++k, ++x) out[4 * x + c] = run ? *p : *p++;
            if (run) ++p;
        }
    return (size_t)(p - start);
}

/* Its texels become RGBE, one level of one face. */
static inline texture_file texture_hdr(const char *name) {
    texture_file f = texture_open(name);
    const unsigned char *end = f.data + f.size;
    const char *head = (const char *)f.data, *size = head ? strstr(head, "\n\n-Y ") : NULL;
    if (!size || strncmp(head, "#?RADIANCE\n", 11) || !strstr(head, "FORMAT=32-bit_rle_rgbe\n"))
        return f;
    f.levels = f.faces = 1, f.format = TEXTURE_RGBE;
    if (sscanf(size + 2, "-Y %d +X %d", &f.height, &f.width) != 2) return f;
    const unsigned char *p = (const unsigned char *)strchr(size + 2, '\n') + 1;
    size_t bytes = 4 * (size_t)f.width * (size_t)f.height, used = 1;
    unsigned char *pixels = (unsigned char *)calloc(bytes, 1);
    for (int y = 0; y < f.height && used; ++y, p += used)
        used = texture_hdr_row(pixels + 4 * (size_t)y * (size_t)f.width, p, end, f.width);
    f.good = used && p == end;
    free(f.data);
    f.data = pixels, f.size = bytes;
    return f;
}

#endif
