/* picture.h - what the examples draw with: an 8-bit canvas, a tone curve, lettering, views of
   environment maps, and a PNG file at the end. No library but envmap.h and libc.

   What you will see: nothing by itself. Include it after envmap.h; every function is static
   inline, so a program carries only those that it calls.

   >>canvas     create, rectangles, strokes
   >>tone       radiance -> 8 bits: exposure, filmic curve, sRGB
   >>lettering  a stroke font for printable ASCII, smooth at any size
   >>views      panoramas, faces, perspective views and balls looked up in a map
   >>png        filters, LZ77, Huffman codes, file

   SPDX-License-Identifier: MIT */

#ifndef PICTURE_H
#define PICTURE_H

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---------------------------------------------------------------------------------- >>canvas -- */

typedef struct picture {
    unsigned char *rgb; /* rows from top to bottom, 3 bytes a pixel */
    int width, height;
} picture;

/* Colours of lines and letters are 0xRRGGBB. Returns 0 when out of memory. */
static inline int picture_create(picture *p, int width, int height) {
    p->rgb = (unsigned char *)calloc((size_t)width * (size_t)height, 3);
    p->width = width;
    p->height = height;
    return p->rgb != NULL;
}

static inline void picture_free(picture *p) {
    free(p->rgb);
    p->rgb = NULL;
}

static inline int picture_channel(unsigned colour, int c) {
    return (int)(colour >> (16 - 8 * c) & 255u);
}

/* Lays colour over pixel (x,y), cover in [0,1]. Everything that is drawn ends here, so everything
   is clipped here. */
static inline void picture_blend(picture *p, int x, int y, unsigned colour, float cover) {
    unsigned char *pixel;
    int c;
    if (x < 0 || y < 0 || x >= p->width || y >= p->height || cover <= 0) return;
    pixel = p->rgb + 3 * ((size_t)y * (size_t)p->width + (size_t)x);
    for (c = 0; c < 3; c++) {
        float from = (float)pixel[c], to = (float)picture_channel(colour, c);
        pixel[c] = (unsigned char)(from + (to - from) * (cover < 1 ? cover : 1) + 0.5f);
    }
}

static inline void picture_rectangle(picture *p, int x, int y, int width, int height,
                                     unsigned colour, float cover) {
    int i, j;
    for (j = y; j < y + height; j++)
        for (i = x; i < x + width; i++) picture_blend(p, i, j, colour, cover);
}

/* How far (x,y) is from the segment from (s[0],s[1]) to (s[2],s[3]). */
static inline float picture_distance(const float s[4], float x, float y) {
    float dx = s[2] - s[0], dy = s[3] - s[1], length2 = dx * dx + dy * dy;
    float t = length2 > 0 ? ((x - s[0]) * dx + (y - s[1]) * dy) / length2 : 0;
    t = t < 0 ? 0 : t > 1 ? 1 : t;
    return hypotf(s[0] + t * dx - x, s[1] + t * dy - y);
}

/* A line with round ends, `width` pixels wide. */
static inline void picture_stroke(picture *p, float x0, float y0, float x1, float y1, float width,
                                  unsigned colour) {
    float s[4], r = 0.5f * width;
    int x, y;
    s[0] = x0, s[1] = y0, s[2] = x1, s[3] = y1;
    for (y = (int)(fminf(y0, y1) - r) - 1; (float)y <= fmaxf(y0, y1) + r; y++)
        for (x = (int)(fminf(x0, x1) - r) - 1; (float)x <= fmaxf(x0, x1) + r; x++)
            picture_blend(p, x, y, colour,
                          r + 0.5f - picture_distance(s, (float)x + 0.5f, (float)y + 0.5f));
}

static inline void picture_circle(picture *p, float cx, float cy, float radius, float width,
                                  unsigned colour) {
    float out = radius + width;
    int x, y;
    for (y = (int)(cy - out); (float)y <= cy + out; y++)
        for (x = (int)(cx - out); (float)x <= cx + out; x++) {
            float d = hypotf((float)x + 0.5f - cx, (float)y + 0.5f - cy);
            picture_blend(p, x, y, colour, 0.5f * width + 0.5f - fabsf(d - radius));
        }
}

/* ------------------------------------------------------------------------------------ >>tone -- */

/* Radiance (exposed) -> display light in [0,1]: a filmic S with a toe and a long shoulder, so that
   a lamp a thousand times brighter than its room still shows a shape. Source: K. Narkowicz, "ACES
   filmic tone mapping curve", 2015; the 0.8 puts middle grey back to about where it was. */
static inline float picture_curve(float x) {
    if (!(x > 0)) return 0; /* NaN too */
    x = fminf(0.8f * x, 1e4f);
    x = x * (2.51f * x + 0.03f) / (x * (2.43f * x + 0.59f) + 0.14f);
    return x < 1 ? x : 1;
}

/* Display light -> 8 bits: the exact sRGB transfer (IEC 61966-2-1), rounded. */
static inline unsigned char picture_srgb(float x) {
    float y = x <= 0.0031308f ? 12.92f * x : 1.055f * powf(x, 1 / 2.4f) - 0.055f;
    return (unsigned char)(255 * (y < 0 ? 0 : y > 1 ? 1 : y) + 0.5f);
}

/* Display light, as three channels in [0,1], to the colour of a pixel. */
static inline unsigned picture_colour(const float light[3]) {
    return (unsigned)picture_srgb(light[0]) << 16 | (unsigned)picture_srgb(light[1]) << 8 |
           picture_srgb(light[2]);
}

/* An exposure that suits a map: brings the mean of its log radiance over the sphere a little below
   middle grey. The floor keeps black rooms from being pulled up to noise. */
static inline float picture_exposure(const envmap *map) {
    double sum = 0, mean = 0;
    int i, j;
    for (j = 0; j < 64; j++)
        for (i = 0; i < 128; i++) { /* a point set of equal areas: cylinder to sphere */
            float y = 1 - ((float)j + 0.5f) / 32, a = ((float)i + 0.5f) * 0.0490873852f;
            float r = sqrtf(1 - y * y), dir[3], rgb[3];
            dir[0] = r * sinf(a), dir[1] = y, dir[2] = r * cosf(a);
            envmap_lookup(rgb, map, dir, 0);
            y = fmaxf(0, 0.2126f * rgb[0] + 0.7152f * rgb[1] + 0.0722f * rgb[2]);
            mean += (double)fminf(y, 1e9f) / 8192;
            sum += log((double)y + 1e-4 * mean + 1e-12) / 8192;
        }
    return (float)(0.27 / exp(sum));
}

/* ------------------------------------------------------------------------------- >>lettering -- */

/* The letters, from ' ' to '~', as the strokes of a pen. A point is two characters: the digit is x,
   the letter y, from A (the top of capitals) through D (the top of an x) and K (the line that text
   stands on) to N (the foot of a p). A small letter is not on the stroke but a control point of a
   quadratic Bezier curve, as in TrueType: between two of them the curve passes half-way. A blank
   lifts the pen. */
#define PICTURE_BOWL "2D3D5d5F5H5k3K2K0k0H0F0d2D"
static const char *const picture_glyphs[95] = {
    /* space ! " # $ % & ' */
    "", "0A0G 0K0K", "0A0D 2A2D", "2B1J 5B4J 0D6D 0H6H", "6D6b3B0b0D0f3F6f6H6j3J0j0H 3A3K",
    "6A0K 1A2a2B2c1C0c0B0a1A 5I6i6J6k5K4k4J4i5I", "6K1D1a3A5a5C5e2F0g0H0k3K6k6G", "0A0D",
    /* ( ) * + , - . / */
    "2A0c0F0i2L", "0A2c2F2i0L", "2B2F 0C4E 4C0E", "3C3I 0F6F", "1K0M", "0G4G", "0K0K", "0L4A",
    /* 0 1 2 3 4 5 6 7 */
    "3A6a6D6G6k3K0k0G0D0a3A", "0C3A3K", "0C0a3A6a6D6f0K6K", "0C0a3A6a6C6e3E6e6H6k3K0k0I",
    "4K4A0H6H", "6A0A0E3E6e6H6k3K0k0I", "6C6a3A0a0D0G0k3K6k6H6e3E0e0H", "0A6A2K",
    /* 8 9 : ; < = > ? */
    "3A6a6C6e3E0e0C0a3A 3E6e6H6k3K0k0H0e3E", "0I0k3K6k6H6D6a3A0a0D0g3G6g6D", "0E0E 0K0K",
    "1E1E 1K0M", "5C0F5I", "0D6D 0H6H", "0C5F0I", "0C0a3A6a6C6e3F3H 3K3K",
    /* @ A B C D E F G */
    "6D6G6h7H8h8F8a4A0a0F0k4K6k7J 6F6d4D2d2F2h4H6h6F", "0K3A6K 1H5H",
    "0A3A6a6C6e3E0E 3E6e6H6k3K0K0A", "6C6a3A0a0D0G0k3K6k6I", "0A3A6a6D6G6k3K0K0A", "5A0A0K5K 0F4F",
    "5A0A0K 0F4F", "6C6a3A0a0D0G0k3K6k6H6F3F",
    /* H I J K L M N O */
    "0A0K 6A6K 0F6F", "0A0K", "4A4H4k2K0k0I", "0A0K 6A0G 2E6K", "0A0K5K", "0K0A4H8A8K", "0K0A6K6A",
    "3A4A7a7D7G7k4K3K0k0G0D0a3A",
    /* P Q R S T U V W */
    "0K0A3A6a6C6D6f3F0F", "3A4A7a7D7G7k4K3K0k0G0D0a3A 4H7L", "0K0A3A6a6C6D6f3F0F 3F6K",
    "6C6a3A0a0C0f3F6f6H6k3K0k0I", "0A6A 3A3K", "0A0G0k3K6k6G6A", "0A3K6A", "0A2K4B6K8A",
    /* X Y Z [ \ ] ^ _ */
    "0A6K 6A0K", "0A3F6A 3F3K", "0A6A0K6K", "2A0A0L2L", "0A4L", "0A2A2L0L", "0D2A4D", "0L6L",
    /* ` a b c d e f g */
    "0A1C", "0E0d2D3D5d5F5K 5G2G0g0I0k2K3K5k5I", "0A0K " PICTURE_BOWL, "5F5d3D2D0d0F0H0k2K3K5k5I",
    "5A5K " PICTURE_BOWL, "0G5G5F5d3D2D0d0F0H0k2K3K5k5I", "4A3A1a1C1K 0D3D",
    "5D5L5n3N1N " PICTURE_BOWL,
    /* h i j k l m n o */
    "0A0K 0F0d2D3D5d5F5K", "0D0K 0A0A", "1D1L1n0N 1A1A", "0A0K 5D0I 2G5K", "0A0I0k2K",
    "0D0K 0F0d2D4d4F4K 4F4d6D8d8F8K", "0D0K 0F0d2D3D5d5F5K", PICTURE_BOWL,
    /* p q r s t u v w */
    "0D0N " PICTURE_BOWL, "5D5N " PICTURE_BOWL, "0D0K 0G0d3D", "5E5d3D2D0d0E0g2G3G5g5I5k3K2K0k0J",
    "1A1I1k3K4K 0D3D", "0D0H0k2K3K5k5H 5D5K", "0D3K6D", "0D2K4E6K8D",
    /* x y z { | } ~ */
    "0D5K 5D0K", "0D3K 6D2N0N", "0D5D0K5K", "3A1a1C1f0F1f1I1l3L", "0A0L", "0A2a2C2f3F2f2I2l0L",
    "0G1d3F5h6E"};

#define PICTURE_SEGMENTS 128 /* no glyph needs more than 12 curves of 6 segments and 16 lines */

static inline const char *picture_glyph(char letter) {
    return picture_glyphs[letter >= ' ' && letter <= '~' ? letter - ' ' : '?' - ' '];
}

/* Adds the curve a, control b, c to the segments; a straight line where b is NULL. */
static inline int picture_flatten(float segments[][4], int count, const float a[2],
                                  const float b[2], const float c[2]) {
    int i, k, steps = b ? 6 : 1;
    for (i = 0; i < steps && count < PICTURE_SEGMENTS; i++, count++)
        for (k = 0; k < 4; k++) { /* k: x0 y0 x1 y1 */
            float t = (float)(i + k / 2) / (float)steps, s = 1 - t;
            segments[count][k] = b ? s * s * a[k % 2] + 2 * s * t * b[k % 2] + t * t * c[k % 2]
                                   : s * a[k % 2] + t * c[k % 2];
        }
    return count;
}

/* The segments of a glyph in font units (capitals are 10 high); returns how many. */
static inline int picture_outline(float segments[][4], const char *glyph) {
    float pen[2] = {0, 0}, control[2] = {0, 0}, to[2];
    int count = 0, down = 0, curved = 0;
    for (; *glyph; glyph += 2) {
        int off = glyph[0] != ' ' && glyph[1] >= 'a';
        if (glyph[0] == ' ') {
            down = curved = 0, glyph--;
            continue;
        }
        to[0] = (float)(glyph[0] - '0');
        to[1] = (float)(glyph[1] - (off ? 'a' : 'A'));
        if (off && curved) { /* two controls in a row: through the middle of them */
            float half[2];
            half[0] = 0.5f * (control[0] + to[0]), half[1] = 0.5f * (control[1] + to[1]);
            count = picture_flatten(segments, count, pen, control, half);
            memcpy(pen, half, sizeof pen);
        }
        if (!off && down)
            count = picture_flatten(segments, count, pen, curved ? control : NULL, to);
        memcpy(off ? control : pen, to, sizeof pen);
        curved = off, down = 1;
    }
    return count;
}

/* From the left of a letter to the left of the next, in font units. */
static inline float picture_advance(char letter) {
    const char *glyph = picture_glyph(letter);
    int width = 0;
    if (!*glyph) return 5;
    for (; *glyph; glyph++)
        if (*glyph >= '0' && *glyph <= '9' && *glyph - '0' > width) width = *glyph - '0';
    return (float)width + 2.7f;
}

/* size  the height of capitals, in pixels */
static inline float picture_text_width(const char *text, float size) {
    float width = -2.7f;
    for (; *text; text++) width += picture_advance(*text);
    return width * size / 10;
}

static inline void picture_letter(picture *p, float x, float y, float size, unsigned colour,
                                  char letter) {
    float segments[PICTURE_SEGMENTS][4], scale = size / 10, r = fmaxf(0.062f * size, 0.58f);
    int i, j, k, count = picture_outline(segments, picture_glyph(letter));
    for (k = 0; k < 4 * count; k++)
        segments[k / 4][k % 4] = (k % 2 ? y : x) + segments[k / 4][k % 4] * scale;
    for (j = (int)(y - 2 * r); count && (float)j < y + 1.4f * size + 2 * r; j++)
        for (i = (int)(x - 2 * r); (float)i < x + size + 2 * r; i++) {
            float d = 1e9f;
            for (k = 0; k < count; k++)
                d = fminf(d, picture_distance(segments[k], (float)i + 0.5f, (float)j + 0.5f));
            picture_blend(p, i, j, colour, r + 0.5f - d);
        }
}

/* Writes a line of text; (x,y) is the top left corner of its capitals. */
static inline void picture_text(picture *p, float x, float y, float size, unsigned colour,
                                const char *text) {
    for (; *text; text++) {
        picture_letter(p, x, y, size, colour, *text);
        x += picture_advance(*text) * size / 10;
    }
}

/* The same with its middle at x. */
static inline void picture_caption(picture *p, float x, float y, float size, unsigned colour,
                                   const char *text) {
    picture_text(p, x - 0.5f * picture_text_width(text, size), y, size, colour, text);
}

/* How far a point is from the strokes of a text, all in font units with the text's top left at the
   origin. For lettering that is part of a scene. */
static inline float picture_text_distance(const char *text, float x, float y) {
    float nearest = 1e9f;
    for (; *text; x -= picture_advance(*text), text++) {
        float segments[PICTURE_SEGMENTS][4];
        int k, count = x > -4 && x < 14 ? picture_outline(segments, picture_glyph(*text)) : 0;
        for (k = 0; k < count; k++) nearest = fminf(nearest, picture_distance(segments[k], x, y));
    }
    return nearest;
}

/* ----------------------------------------------------------------------------------- >>views -- */

/* A drawing is a function of (s,t) in [0,1]^2, t downwards: it writes radiance, or returns 0 where
   there is nothing to see. */
typedef int picture_point(float rgb[3], float s, float t, const void *user);

/* One pixel: the mean of 3 x 3 points, after the tone curve, so that edges of lamps are smooth
   too. Returns the part of the pixel that is covered. */
static inline float picture_pixel(float light[3], int i, int j, int width, int height,
                                  float exposure, picture_point *point, const void *user) {
    int k, c, hits = 0;
    light[0] = light[1] = light[2] = 0;
    for (k = 0; k < 9; k++) {
        float rgb[3], s = ((float)i + ((float)(k % 3) + 0.5f) / 3) / (float)width;
        if (!point(rgb, s, ((float)j + ((float)(k / 3) + 0.5f) / 3) / (float)height, user))
            continue;
        for (c = 0; c < 3; c++) light[c] += picture_curve(exposure * rgb[c]);
        hits++;
    }
    for (c = 0; c < 3 && hits; c++) light[c] /= (float)hits;
    return (float)hits / 9;
}

static inline void picture_draw(picture *p, int x, int y, int width, int height, float exposure,
                                picture_point *point, const void *user) {
    int i, j;
    for (j = 0; j < height; j++)
        for (i = 0; i < width; i++) {
            float light[3];
            float cover = picture_pixel(light, i, j, width, height, exposure, point, user);
            picture_blend(p, x + i, y + j, picture_colour(light), cover);
        }
}

/* A map shown in any parameterization, its own or another. */
typedef struct picture_face {
    const envmap *map;
    int mapping;
    int face;
} picture_face;

static inline int picture_face_point(float rgb[3], float s, float t, const void *user) {
    const picture_face *f = (const picture_face *)user;
    float dir[3], r = hypotf(2 * s - 1, 2 * t - 1);
    if (r > 1 && (f->mapping == ENVMAP_SPHERE || f->mapping == ENVMAP_ANGULAR)) return 0;
    envmap_direction(dir, f->mapping, f->face, s, t);
    envmap_lookup(rgb, f->map, dir, 0);
    return 1;
}

static inline void picture_map(picture *p, int x, int y, int width, int height, float exposure,
                               const envmap *map, int mapping, int face) {
    picture_face f;
    f.map = map, f.mapping = mapping, f.face = face;
    picture_draw(p, x, y, width, height, exposure, picture_face_point, &f);
}

static inline void picture_panorama(picture *p, int x, int y, int width, int height, float exposure,
                                    const envmap *map) {
    picture_map(p, x, y, width, height, exposure, map, ENVMAP_LATLONG, 0);
}

/* A camera in the middle of the map. */
typedef struct picture_camera {
    const envmap *map;
    float yaw, pitch;   /* rad; 0 looks along -z, yaw turns towards +x, pitch up */
    float tan_x, tan_y; /* tangents of half the fields of view */
    float level;        /* of the map, for a background out of focus */
} picture_camera;

static inline int picture_camera_point(float rgb[3], float s, float t, const void *user) {
    const picture_camera *c = (const picture_camera *)user;
    float x = (2 * s - 1) * c->tan_x, y = (1 - 2 * t) * c->tan_y, dir[3];
    float up = y * cosf(c->pitch) + sinf(c->pitch), ahead = cosf(c->pitch) - y * sinf(c->pitch);
    dir[0] = x * cosf(c->yaw) + ahead * sinf(c->yaw);
    dir[1] = up;
    dir[2] = x * sinf(c->yaw) - ahead * cosf(c->yaw);
    envmap_lookup(rgb, c->map, dir, c->level);
    return 1;
}

/* A ball in front of a distant camera that looks along -z: what is looked up at a point of it. */
typedef enum picture_ball_kind {
    PICTURE_BALL_REFLECTION, /* r_v: mirror, Phong, Gaussian, GGX                              */
    PICTURE_BALL_NORMAL,     /* n: diffuse                                                     */
    PICTURE_BALL_TANGENT     /* t along circles of latitude, slice c = v.t: Banks' brushed metal */
} picture_ball_kind;

typedef struct picture_ball_view {
    const envmap *map;
    picture_ball_kind kind;
} picture_ball_view;

static inline void picture_ball_shade(float rgb[3], const picture_ball_view *ball,
                                      const float n[3]) {
    float dir[3];
    if (ball->kind == PICTURE_BALL_TANGENT) { /* t = y x n; v = z, so c = t_z */
        float length = fmaxf(hypotf(n[0], n[2]), 1e-6f);
        dir[0] = n[2] / length, dir[1] = 0, dir[2] = -n[0] / length;
        envmap_lookup_slice(rgb, ball->map, dir, dir[2], 0);
        return;
    }
    memcpy(dir, n, sizeof dir);
    if (ball->kind == PICTURE_BALL_REFLECTION) { /* r = 2 (n.v) n - v */
        dir[0] = 2 * n[2] * n[0], dir[1] = 2 * n[2] * n[1], dir[2] = 2 * n[2] * n[2] - 1;
    }
    envmap_lookup(rgb, ball->map, dir, 0);
}

static inline int picture_ball_point(float rgb[3], float s, float t, const void *user) {
    float n[3], r2;
    n[0] = 2 * s - 1, n[1] = 1 - 2 * t;
    r2 = n[0] * n[0] + n[1] * n[1];
    if (r2 > 1) return 0;
    n[2] = sqrtf(1 - r2);
    picture_ball_shade(rgb, (const picture_ball_view *)user, n);
    return 1;
}

static inline void picture_ball(picture *p, int x, int y, int edge, float exposure,
                                const envmap *map, picture_ball_kind kind) {
    picture_ball_view ball;
    ball.map = map, ball.kind = kind;
    picture_draw(p, x, y, edge, edge, exposure, picture_ball_point, &ball);
}

/* ------------------------------------------------------------------------------------- >>png -- */

/* A compressor that suits pictures, small rather than clever: each row is filtered by the PNG
   filter that leaves the smallest numbers, repetitions are found through one hash of three bytes,
   and every 32768 symbols get Huffman codes of their own. Sources: RFC 1950, 1951, 2083. */

#define PICTURE_BLOCK 32768

typedef struct picture_deflate {
    unsigned char *out; /* large enough for the worst case, so that writing cannot fail */
    size_t size;
    unsigned long long bits; /* not yet written, lowest first */
    int bit_count, token_count;
    unsigned tokens[PICTURE_BLOCK];        /* a byte, or length << 16 | distance */
    unsigned literals[286], distances[30]; /* how often each symbol occurs in the tokens */
} picture_deflate;

static const unsigned short picture_lengths[29] = {3,  4,  5,  6,   7,   8,   9,   10,  11, 13,
                                                   15, 17, 19, 23,  27,  31,  35,  43,  51, 59,
                                                   67, 83, 99, 115, 131, 163, 195, 227, 258};

static inline void picture_put(picture_deflate *d, unsigned value, int count) {
    d->bits |= (unsigned long long)value << d->bit_count;
    for (d->bit_count += count; d->bit_count >= 8; d->bit_count -= 8, d->bits >>= 8)
        d->out[d->size++] = (unsigned char)(d->bits & 255);
}

/* The symbol of a match length or distance: the last whose base is not larger. */
static inline int picture_length_symbol(int length) {
    int s = 28;
    while (picture_lengths[s] > length) s--;
    return s;
}
static inline int picture_length_bits(int s) { return s < 8 || s == 28 ? 0 : (s - 4) / 4; }
static inline int picture_distance_bits(int s) { return s < 4 ? 0 : s / 2 - 1; }
static inline int picture_distance_base(int s) {
    return s < 4 ? s + 1 : ((2 + s % 2) << picture_distance_bits(s)) + 1;
}
static inline int picture_distance_symbol(int distance) {
    int s = 29;
    while (picture_distance_base(s) > distance) s--;
    return s;
}

/* Huffman's tree, by repeatedly joining the two lightest; returns the depth of the deepest leaf. */
static inline int picture_huffman(unsigned char *lengths, const unsigned *counts, int n) {
    unsigned weight[2 * 286];
    int parent[2 * 286], i, top = n, deepest = 0;
    for (i = 0; i < n; i++) weight[i] = counts[i];
    for (;;) {
        int a = -1, b = -1; /* the lightest and the next */
        for (i = 0; i < top; i++) {
            if (!weight[i]) continue;
            if (a < 0 || weight[i] < weight[a]) b = a, a = i;
            else if (b < 0 || weight[i] < weight[b]) b = i;
        }
        if (b < 0) break;
        weight[top] = weight[a] + weight[b];
        weight[a] = weight[b] = 0, parent[a] = parent[b] = top++;
    }
    for (i = 0; i < n; i++) {
        int depth = 0, node = i;
        for (; counts[i] && node != top - 1; node = parent[node]) depth++;
        lengths[i] = (unsigned char)depth;
        if (depth > deepest) deepest = depth;
    }
    return deepest;
}

/* Code lengths of at most 15 bits: where the tree is deeper, counts are evened out and it is built
   again. Two symbols are always given a code, because a code of one is a special case. */
static inline void picture_code_lengths(unsigned char *lengths, unsigned *counts, int n) {
    int i;
    counts[0] += !counts[0], counts[1] += !counts[1];
    while (picture_huffman(lengths, counts, n) > 15)
        for (i = 0; i < n; i++) counts[i] = counts[i] / 2 | (counts[i] > 0);
}

/* Canonical codes from their lengths, bits reversed as deflate wants them. */
static inline void picture_codes(unsigned *codes, const unsigned char *lengths, int n) {
    unsigned next = 0;
    int i, bits, k;
    for (bits = 1; bits <= 15; bits++, next <<= 1)
        for (i = 0; i < n; i++) {
            if (lengths[i] != bits) continue;
            for (k = 0, codes[i] = 0; k < bits; k++) codes[i] |= (next >> k & 1u) << (bits - 1 - k);
            next++;
        }
}

/* A block's header: all 286 + 30 code lengths, each as four bits (a flat code of 16 symbols). */
static inline void picture_block_header(picture_deflate *d, int last, const unsigned char *literal,
                                        const unsigned char *distance) {
    /* Deflate lists the lengths of this code in the order 16 17 18 0 8 7 9 ...; 0 is "unused". */
    int i, k;
    picture_put(d, (unsigned)last, 1);
    picture_put(d, 2, 2);
    picture_put(d, 286 - 257, 5), picture_put(d, 30 - 1, 5), picture_put(d, 19 - 4, 4);
    for (i = 0; i < 19; i++) picture_put(d, i < 3 ? 0 : 4, 3);
    for (i = 0; i < 286 + 30; i++) {
        unsigned length = i < 286 ? literal[i] : distance[i - 286], reversed = 0;
        for (k = 0; k < 4; k++) reversed |= (length >> k & 1u) << (3 - k);
        picture_put(d, reversed, 4);
    }
}

static inline void picture_match_put(picture_deflate *d, unsigned token, const unsigned *codes,
                                     const unsigned char *bits, const unsigned *far_codes,
                                     const unsigned char *far_bits) {
    int length = (int)(token >> 16), distance = (int)(token & 65535u);
    int s = picture_length_symbol(length), f = picture_distance_symbol(distance);
    picture_put(d, codes[257 + s], bits[257 + s]);
    picture_put(d, (unsigned)(length - picture_lengths[s]), picture_length_bits(s));
    picture_put(d, far_codes[f], far_bits[f]);
    picture_put(d, (unsigned)(distance - picture_distance_base(f)), picture_distance_bits(f));
}

/* Writes the gathered tokens as one block and starts the next. */
static inline void picture_block(picture_deflate *d, int last) {
    unsigned char bits[286], far_bits[30];
    unsigned codes[286] = {0}, far_codes[30] = {0};
    int i;
    d->literals[256] = 1; /* the end of the block */
    picture_code_lengths(bits, d->literals, 286), picture_codes(codes, bits, 286);
    picture_code_lengths(far_bits, d->distances, 30), picture_codes(far_codes, far_bits, 30);
    picture_block_header(d, last, bits, far_bits);
    for (i = 0; i < d->token_count; i++) {
        unsigned token = d->tokens[i];
        if (token < 256) picture_put(d, codes[token], bits[token]);
        else picture_match_put(d, token, codes, bits, far_codes, far_bits);
    }
    picture_put(d, codes[256], bits[256]);
    memset(d->literals, 0, sizeof d->literals);
    memset(d->distances, 0, sizeof d->distances);
    d->token_count = 0;
}

static inline void picture_token(picture_deflate *d, int length, int distance, unsigned byte) {
    if (length) {
        d->literals[257 + picture_length_symbol(length)]++;
        d->distances[picture_distance_symbol(distance)]++;
        byte = (unsigned)length << 16 | (unsigned)distance;
    } else {
        d->literals[byte]++;
    }
    d->tokens[d->token_count++] = byte;
    if (d->token_count == PICTURE_BLOCK) picture_block(d, 0);
}

/* How many bytes at a and b agree, up to deflate's 258. */
static inline int picture_match(const unsigned char *a, const unsigned char *b, size_t room) {
    int n = 0;
    while (n < 258 && (size_t)n < room && a[n] == b[n]) n++;
    return n;
}

static inline void picture_compress(picture_deflate *d, const unsigned char *data, size_t size) {
    static const size_t none = (size_t)-1;
    size_t seen[4096], i = 0;
    int k, h;
    for (k = 0; k < 4096; k++) seen[k] = none;
    while (i < size) {
        int length = 0, distance = 0;
        if (i + 3 <= size) {
            h = (int)(((unsigned)data[i] << 16 | (unsigned)data[i + 1] << 8 | data[i + 2]) *
                          2654435761u >>
                      20);
            if (seen[h] != none && i - seen[h] <= 32768) {
                distance = (int)(i - seen[h]);
                length = picture_match(data + seen[h], data + i, size - i);
            }
            seen[h] = i;
        }
        if (length < 4) length = 0;
        picture_token(d, length, distance, data[i]);
        i += length ? (size_t)length : 1;
    }
}

/* Checksums of the zlib stream and of the PNG chunks. */
static inline unsigned picture_adler(const unsigned char *data, size_t size) {
    unsigned a = 1, b = 0;
    size_t i;
    for (i = 0; i < size; i++) a = (a + data[i]) % 65521, b = (b + a) % 65521;
    return b << 16 | a;
}

static inline unsigned picture_crc(unsigned crc, const unsigned char *data, size_t size) {
    int k;
    for (crc = ~crc; size--; data++)
        for (crc ^= *data, k = 0; k < 8; k++) crc = crc >> 1 ^ (crc & 1 ? 0xEDB88320u : 0);
    return ~crc;
}

static inline void picture_big_endian(unsigned char out[4], size_t value) {
    int k;
    for (k = 0; k < 4; k++) out[k] = (unsigned char)(value >> (24 - 8 * k) & 255);
}

/* The prediction of PNG filter `kind` from the bytes to the left, above and above left. */
static inline int picture_predict(int kind, int left, int above, int corner) {
    int p = left + above - corner;
    int dl = abs(p - left), da = abs(p - above), dc = abs(p - corner);
    switch (kind) {
    case 1: return left;
    case 2: return above;
    case 3: return (left + above) / 2;
    case 4: return dl <= da && dl <= dc ? left : da <= dc ? above : corner; /* Paeth */
    default: return 0;
    }
}

/* out[0] = kind, then a row of differences; returns the sum of their sizes. */
static inline long picture_filter_row(unsigned char *out, const picture *p, int y, int kind) {
    int i, bytes = 3 * p->width;
    const unsigned char *row = p->rgb + (size_t)y * (size_t)bytes, *up = y ? row - bytes : NULL;
    long sum = 0;
    out[0] = (unsigned char)kind;
    for (i = 0; i < bytes; i++) {
        int left = i < 3 ? 0 : row[i - 3], above = up ? up[i] : 0,
            corner = up && i > 2 ? up[i - 3] : 0;
        int difference = (row[i] - picture_predict(kind, left, above, corner)) & 255;
        out[i + 1] = (unsigned char)difference;
        sum += difference < 128 ? difference : 256 - difference;
    }
    return sum;
}

static inline void picture_filter(unsigned char *out, const picture *p) {
    size_t bytes = 3 * (size_t)p->width + 1;
    int y, kind;
    for (y = 0; y < p->height; y++, out += bytes) {
        int best = 0;
        long least = -1;
        for (kind = 0; kind < 5; kind++) {
            long sum = picture_filter_row(out, p, y, kind);
            if (least < 0 || sum < least) least = sum, best = kind;
        }
        picture_filter_row(out, p, y, best);
    }
}

/* The picture as a zlib stream: two bytes of header, the blocks, the checksum. NULL: no memory. */
static inline unsigned char *picture_zlib(size_t *size, const picture *p) {
    size_t raw_size = (3 * (size_t)p->width + 1) * (size_t)p->height;
    unsigned char *raw = (unsigned char *)malloc(raw_size), *out = NULL;
    picture_deflate *d = (picture_deflate *)calloc(1, sizeof *d);
    if (raw && d) out = d->out = (unsigned char *)malloc(2 * raw_size + 65536);
    if (out) {
        picture_filter(raw, p);
        out[0] = 0x78, out[1] = 0x9C, d->size = 2;
        picture_compress(d, raw, raw_size);
        picture_block(d, 1);
        picture_put(d, 0, 7); /* to a whole byte */
        picture_big_endian(out + d->size, picture_adler(raw, raw_size));
        *size = d->size + 4;
    }
    free(d);
    free(raw);
    return out;
}

static inline int picture_chunk(FILE *file, const char *name, const unsigned char *data,
                                size_t size) {
    unsigned char length[4], check[4], type[4];
    unsigned crc;
    memcpy(type, name, 4);
    crc = picture_crc(0, type, 4);
    crc = picture_crc(crc, data, size);
    picture_big_endian(length, size);
    picture_big_endian(check, crc);
    return fwrite(length, 1, 4, file) == 4 && fwrite(type, 1, 4, file) == 4 &&
           fwrite(data, 1, size, file) == size && fwrite(check, 1, 4, file) == 4;
}

/* Returns 1 when all of it went into the file. */
static inline int picture_write(const picture *p, FILE *file) {
    static const unsigned char magic[8] = {137, 'P', 'N', 'G', 13, 10, 26, 10};
    unsigned char header[13] = {0}, *data;
    size_t size = 0;
    int good;
    picture_big_endian(header, (size_t)p->width);
    picture_big_endian(header + 4, (size_t)p->height);
    header[8] = 8, header[9] = 2; /* 8 bits, RGB */
    data = picture_zlib(&size, p);
    good = data && fwrite(magic, 1, 8, file) == 8 && picture_chunk(file, "IHDR", header, 13) &&
           picture_chunk(file, "IDAT", data, size) && picture_chunk(file, "IEND", header, 0);
    free(data);
    return good;
}

/* Removes a file that is not whole: something with a length. A device, or a link to one, has none
   and stays. */
static inline void picture_discard(const char *path) {
    FILE *file = fopen(path, "rb");
    int plain = file && !fseek(file, 0, SEEK_END) && ftell(file) > 0;
    if (file) fclose(file);
    if (plain) remove(path);
}

/* Returns 1 when the whole file was written; else none is left. */
static inline int picture_save(const picture *p, const char *path) {
    FILE *file = fopen(path, "wb");
    int good = file && picture_write(p, file);
    good = file && !fclose(file) && good;
    if (file && !good) picture_discard(path);
    return good;
}

#endif /* PICTURE_H */
