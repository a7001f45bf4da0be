/* write_ktx.h - Khronos textures: KTX 2 (Vulkan formats) and KTX 1 (OpenGL formats); cubes and
   pictures, with levels.

   Sources: KTX File Format Specification 2.0.4 and 1.1; Khronos Data Format Specification 1.3,
   section 5 (the descriptor). Test: tests/test_write.c. Include after write_texels.h.

   SPDX-License-Identifier: MIT */

#ifndef WRITE_KTX_H
#define WRITE_KTX_H

#define KTX_WRITER "KTXwriter\0envmap.h"

/* ------------------------------------------------------------------------------------ >>ktx2 -- */

/* A channel of the descriptor: where its bits are, and 0 R, 1 G, 2 B, 15 A, with the data format's
   flags: 0x80 float, 0x40 signed, 0x20 exponent. */
typedef struct ktx_sample {
    int format, offset, length, channel;
    uint32_t low, high;
} ktx_sample;

static const ktx_sample ktx_samples[] = {
    {TEXEL_RGBA16F, 0, 16, 0xC0, 0xBF800000, 0x3F800000},
    {TEXEL_RGBA16F, 16, 16, 0xC1, 0xBF800000, 0x3F800000},
    {TEXEL_RGBA16F, 32, 16, 0xC2, 0xBF800000, 0x3F800000},
    {TEXEL_RGBA16F, 48, 16, 0xCF, 0xBF800000, 0x3F800000},
    {TEXEL_RGBA32F, 0, 32, 0xC0, 0xBF800000, 0x3F800000},
    {TEXEL_RGBA32F, 32, 32, 0xC1, 0xBF800000, 0x3F800000},
    {TEXEL_RGBA32F, 64, 32, 0xC2, 0xBF800000, 0x3F800000},
    {TEXEL_RGBA32F, 96, 32, 0xCF, 0xBF800000, 0x3F800000},
    {TEXEL_RGB9E5, 0, 9, 0x00, 0, 8448}, /* each mantissa, then the exponent that it shares */
    {TEXEL_RGB9E5, 27, 5, 0x20, 15, 31},
    {TEXEL_RGB9E5, 9, 9, 0x01, 0, 8448},
    {TEXEL_RGB9E5, 27, 5, 0x21, 15, 31},
    {TEXEL_RGB9E5, 18, 9, 0x02, 0, 8448},
    {TEXEL_RGB9E5, 27, 5, 0x22, 15, 31},
    {TEXEL_B10G11R11, 0, 11, 0x80, 0, 0x3F800000},
    {TEXEL_B10G11R11, 11, 11, 0x81, 0, 0x3F800000},
    {TEXEL_B10G11R11, 22, 10, 0x82, 0, 0x3F800000}};
enum { KTX_SAMPLES = sizeof ktx_samples / sizeof ktx_samples[0] };

static inline unsigned ktx_descriptor_bytes(int format) {
    unsigned bytes = 28;
    int k;
    for (k = 0; k < KTX_SAMPLES; k++) bytes += ktx_samples[k].format == format ? 16 : 0;
    return bytes;
}

/* Linear RGB with BT.709's primaries, one texel a block. */
static inline void ktx2_descriptor(write_file *w, int format) {
    unsigned bytes = ktx_descriptor_bytes(format);
    int k;
    write_little(w, bytes, 4);
    write_little(w, 0, 4);                     /* vendor Khronos, the basic block */
    write_little(w, 2 | (bytes - 4) << 16, 4); /* version 1.3 */
    write_little(w, 1 | 1 << 8 | 1 << 16, 4);  /* model RGB, primaries BT.709, transfer linear */
    write_little(w, 0, 4);                     /* blocks of 1 x 1 x 1 x 1 */
    write_little(w, (unsigned)texel_bytes[format], 8);
    for (k = 0; k < KTX_SAMPLES; k++) {
        const ktx_sample *s = &ktx_samples[k];
        if (s->format != format) continue;
        write_little(w, (unsigned)(s->offset | (s->length - 1) << 16) | (unsigned)s->channel << 24,
                     4);
        write_little(w, 0, 4);
        write_little(w, s->low, 4);
        write_little(w, s->high, 4);
    }
}

static inline size_t ktx_align(size_t at, size_t to) { return (at + to - 1) / to * to; }

/* "key\0value\0" as a pair with its length before and padding after; returns its bytes, and only
   counts them where w is NULL. */
static inline size_t ktx_pair(write_file *w, const char *pair, size_t size) {
    if (w) {
        write_little(w, size, 4);
        write_bytes(w, pair, size);
        write_zeros(w, ktx_align(size, 4) - size);
    }
    return 4 + ktx_align(size, 4);
}

/* All pairs, in the order of their keys' letters, as KTX 2 wants them. */
static inline size_t ktx_pairs(write_file *w, const texture *t, const char *orientation,
                               size_t orientation_size) {
    size_t sum = ktx_pair(w, orientation, orientation_size), at = 0;
    sum += ktx_pair(w, KTX_WRITER, sizeof KTX_WRITER);
    while (at < t->notes_size) {
        size_t key = strlen(t->notes + at) + 1, size = key + strlen(t->notes + at + key) + 1;
        sum += ktx_pair(w, t->notes + at, size);
        at += size;
    }
    return sum;
}

/* Levels lie from the smallest to the largest; offset[level] is where. Returns the file's size. */
static inline size_t ktx2_layout(size_t offset[32], const texture *t, size_t at) {
    size_t align = (size_t)texel_bytes[t->format];
    int level;
    for (level = t->map->levels - 1; level >= 0; level--) {
        offset[level] = at = ktx_align(at, align);
        at += texture_face_bytes(t, level) * (size_t)texture_faces(t);
    }
    return at;
}

static inline void ktx2_header(write_file *w, const texture *t, const size_t offset[32],
                               size_t pairs) {
    static const unsigned char magic[12] = {0xAB, 'K',  'T', 'X', ' ', '2',
                                            '0',  0xBB, 13,  10,  26,  10};
    static const unsigned vulkan[] = {97, 109, 123, 122}, type_size[] = {2, 4, 4, 4};
    size_t descriptor = 80 + 24 * (size_t)t->map->levels;
    unsigned descriptor_bytes = ktx_descriptor_bytes(t->format);
    int level;
    write_bytes(w, magic, 12);
    write_little(w, vulkan[t->format], 4);
    write_little(w, type_size[t->format], 4);
    write_little(w, (unsigned)texture_width(t, 0), 4);
    write_little(w, (unsigned)texture_edge(t, 0), 4);
    write_little(w, 0, 8); /* no depth, no layers */
    write_little(w, (unsigned)texture_faces(t), 4);
    write_little(w, (unsigned)t->map->levels, 4);
    write_little(w, 0, 4); /* not compressed */
    write_little(w, descriptor, 4), write_little(w, descriptor_bytes, 4);
    write_little(w, descriptor + descriptor_bytes, 4), write_little(w, pairs, 4);
    write_zeros(w, 16); /* no data of a compression */
    for (level = 0; level < t->map->levels; level++) {
        size_t bytes = texture_face_bytes(t, level) * (size_t)texture_faces(t);
        write_little(w, offset[level], 8);
        write_little(w, bytes, 8), write_little(w, bytes, 8);
    }
}

/* 0, or an errno. */
static inline int write_ktx2(texture *t, const char *path) {
    static const char orientation[] = "KTXorientation\0rd";
    write_file w;
    size_t offset[32], pairs, at;
    int level, face;
    if (!texture_is_writable(t)) return EINVAL;
    t->saturated = 0;
    write_open(&w, path);
    pairs = ktx_pairs(NULL, t, orientation, sizeof orientation);
    at = 80 + 24 * (size_t)t->map->levels + ktx_descriptor_bytes(t->format) + pairs;
    ktx2_layout(offset, t, at);
    ktx2_header(&w, t, offset, pairs);
    ktx2_descriptor(&w, t->format);
    ktx_pairs(&w, t, orientation, sizeof orientation);
    for (level = t->map->levels - 1; level >= 0; level--) {
        write_zeros(&w, offset[level] - at);
        for (face = 0; face < texture_faces(t); face++) texture_write_face(&w, t, level, face);
        at = offset[level] + texture_face_bytes(t, level) * (size_t)texture_faces(t);
    }
    return write_close(&w);
}

/* ------------------------------------------------------------------------------------ >>ktx1 -- */

/* type, size of a component, format, internal format, base internal format */
static const unsigned ktx1_words[][5] = {{0x140B, 2, 0x1908, 0x881A, 0x1908},
                                         {0x1406, 4, 0x1908, 0x8814, 0x1908},
                                         {0x8C3E, 4, 0x1907, 0x8C3D, 0x1907},
                                         {0x8C3B, 4, 0x1907, 0x8C3A, 0x1907}};

/* 0, or an errno. A level's size counts one face of a cube, all of a picture. */
static inline int write_ktx1(texture *t, const char *path) {
    static const unsigned char magic[12] = {0xAB, 'K',  'T', 'X', ' ', '1',
                                            '1',  0xBB, 13,  10,  26,  10};
    static const char orientation[] = "KTXorientation\0S=r,T=d";
    write_file w;
    int k, level, face;
    if (!texture_is_writable(t)) return EINVAL;
    t->saturated = 0;
    write_open(&w, path);
    write_bytes(&w, magic, 12);
    write_little(&w, 0x04030201, 4);
    for (k = 0; k < 5; k++) write_little(&w, ktx1_words[t->format][k], 4);
    write_little(&w, (unsigned)texture_width(t, 0), 4);
    write_little(&w, (unsigned)texture_edge(t, 0), 4);
    write_little(&w, 0, 8); /* no depth, no layers */
    write_little(&w, (unsigned)texture_faces(t), 4);
    write_little(&w, (unsigned)t->map->levels, 4);
    write_little(&w, ktx_pairs(NULL, t, orientation, sizeof orientation), 4);
    ktx_pairs(&w, t, orientation, sizeof orientation);
    for (level = 0; level < t->map->levels; level++) {
        write_little(&w, texture_face_bytes(t, level), 4);
        for (face = 0; face < texture_faces(t); face++) texture_write_face(&w, t, level, face);
    }
    return write_close(&w);
}

#endif /* WRITE_KTX_H */
