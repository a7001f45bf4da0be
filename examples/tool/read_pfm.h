/* read_pfm.h - float pictures (.pfm) of any shape, and what programs make of the format beyond what
   envmap_pfm_read accepts: four channels (PF4), blanks and comments after the scale, rows from the
   top as Photoshop writes them. Include after image.h.

   Which bytes belong to the header the size of the file tells: the pixels are as many as the header
   says, so what is too much must be blanks or a comment.
   Tests: tests/test_tool_read.c, tests/fuzz_tool.c.

   SPDX-License-Identifier: MIT */

#ifndef READ_PFM_H
#define READ_PFM_H

#include <ctype.h>
#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

typedef struct pfm_file {
    const unsigned char *at, *end;
    int channels;   /* of the file: 1, 3, 4 */
    int apart;      /* 1: width and height stand on lines of their own */
    uint64_t bytes; /* of all pixels */
} pfm_file;

/* Blanks, line ends and comments; returns how many line ends. */
static inline int pfm_skip(pfm_file *in) {
    int ends = 0;
    for (; in->at < in->end && (isspace(*in->at) || *in->at == '#'); in->at++) {
        if (*in->at == '#')
            while (in->at + 1 < in->end && in->at[1] != '\n' && in->at[1] != '\r') in->at++;
        ends += *in->at == '\n' || *in->at == '\r';
    }
    return ends;
}

/* The next word as a number; 0 if it is none. */
static inline int pfm_number(pfm_file *in, double *value) {
    char text[64], *end;
    size_t n = 0;
    while (in->at < in->end && n < sizeof text - 1 && *in->at < 128 &&
           strchr("+-.0123456789eE", *in->at) && *in->at)
        text[n++] = (char)*in->at++;
    text[n] = 0;
    *value = strtod(text, &end);
    return n > 0 && !*end && in->at < in->end && isspace(*in->at);
}

static inline int pfm_size(pfm_file *in, int *value) {
    double number;
    if (!pfm_number(in, &number) || !(number >= 1) || number > 1e9) return 0;
    *value = (int)number;
    return number <= (double)*value;
}

/* Behind blanks, a comment and the line end, if all of that comes before `stop`; else `at`. */
static inline const unsigned char *pfm_rest_of_line(const unsigned char *at,
                                                    const unsigned char *stop) {
    const unsigned char *p = at;
    while (p < stop && (*p == ' ' || *p == '\t')) p++;
    if (p < stop && *p == '#')
        while (p < stop && *p != '\n' && *p != '\r') p++;
    if (p == stop || (*p != '\n' && *p != '\r')) return at;
    if (*p == '\r' && p + 1 < stop && p[1] == '\n') p++;
    return p + 1;
}

/* 1: lines end in carriage returns alone, so that a line feed after one is a pixel's byte. */
static inline int pfm_lone_returns(const unsigned char *start, const unsigned char *end) {
    size_t length = (size_t)(end - start);
    return memchr(start, '\r', length) && !memchr(start, '\n', length);
}

/* To the first pixel: past the one white space after the scale, or both bytes of a line end, and
   past the rest of the scale's line and lines of comments. 0 if fewer than `bytes` remain. */
static inline int pfm_to_pixels(pfm_file *in, const unsigned char *start, uint64_t bytes) {
    const unsigned char *at = in->at, *stop, *next;
    int ended = *at == '\n' || *at == '\r';
    int pair = *at == '\r' && in->end - at > 1 && at[1] == '\n' && !pfm_lone_returns(start, at);
    in->at = at += 1 + pair;
    if ((uint64_t)(in->end - at) < bytes) return 0;
    stop = at + ((uint64_t)(in->end - at) - bytes);
    if (!ended) in->at = pfm_rest_of_line(at, stop);
    while (in->at < stop && *in->at == '#' && (next = pfm_rest_of_line(in->at, stop)) > in->at)
        in->at = next;
    return 1;
}

/* "PF", "Pf" or "PF4", width, height, scale. */
static inline int pfm_header(image *out, pfm_file *in) {
    const unsigned char *start = in->at;
    in->channels = start[1] == 'f' ? 1 : in->end - start > 2 && start[2] == '4' ? 4 : 3;
    in->at += in->channels == 4 ? 3 : 2;
    pfm_skip(in);
    if (!pfm_size(in, &out->width)) return image_fail(out, "its width makes no sense");
    in->apart = pfm_skip(in) > 0;
    if (!pfm_size(in, &out->height)) return image_fail(out, "its height makes no sense");
    in->apart &= pfm_skip(in) > 0;
    if (!pfm_number(in, &out->scale) || !(fabs(out->scale) > 0) || !isfinite(out->scale))
        return image_fail(out, "its scale makes no sense");
    in->bytes = (uint64_t)out->width * (uint64_t)out->height * (uint64_t)in->channels * 4;
    return pfm_to_pixels(in, start, in->bytes) ||
           image_fail(out, "ends before its last of %d x %d pixels", out->width, out->height);
}

/* Four bytes, the lowest first when `little`. */
static inline float pfm_sample(const unsigned char *b, int little) {
    uint32_t bits = 0;
    float value;
    int i;
    for (i = 0; i < 4; i++) bits |= (uint32_t)b[i] << (little ? 8 * i : 24 - 8 * i);
    memcpy(&value, &bits, sizeof value);
    return value;
}

/* Rows from the bottom up, as the format has them. */
static inline void pfm_pixels(image *out, const pfm_file *in) {
    float factor = (float)fmin(fmax(fabs(out->scale), 1e-38), 3e38);
    const unsigned char *sample = in->at;
    int x, y, c;
    for (y = out->height - 1; y >= 0; y--) {
        float *p = out->rgb + 3 * (size_t)y * (size_t)out->width;
        for (x = 0; x < out->width; x++, p += 3, sample += 4 * in->channels)
            for (c = 0; c < 3; c++)
                p[c] = factor * pfm_sample(sample + (in->channels > 1 ? 4 * c : 0), out->scale < 0);
    }
}

/* 1: more than blanks and line ends, which do no harm, is behind the pixels. */
static inline int pfm_trails(const pfm_file *in) {
    const unsigned char *at = in->at + in->bytes;
    while (at < in->end && isspace(*at)) at++;
    return at < in->end;
}

static inline int pfm_read(image *out, const unsigned char *data, size_t bytes) {
    pfm_file in = {NULL, NULL, 0, 0, 0};
    in.at = data, in.end = data + bytes;
    out->format = "PFM";
    if (!pfm_header(out, &in)) return 0;
    if (pfm_trails(&in)) return image_fail(out, "holds data after its last sample");
    if (!image_create(out)) return 0;
    pfm_pixels(out, &in);
    if (in.channels == 4) image_remark(out, "its fourth channel, alpha, is left out\n");
    if (in.apart) {
        image_flip(out);
        image_remark(out, "width and height on lines of their own are Photoshop's, so its first "
                          "row is the top one (--flip if not)\n");
    }
    return 1;
}

#endif /* READ_PFM_H */
