/* read_hdr.h - Radiance pictures (.hdr, .pic) into floats, as they are found: with new run lengths,
   old ones and none, in any of the eight orders of pixels. Include after image.h.

       file       "#?" and a name, lines, an empty line, the order and the size, lines of pixels
       radiance = m 2^(e - 136) / (all EXPOSURE and COLORCORR lines), with no half added

   Nothing is read past `end`; every line's length is checked before it is written.
   Source: G. Ward, Real Pixels, Graphics Gems II (1991); Radiance's file formats.
   Tests: tests/test_tool_read.c, tests/fuzz_tool.c.

   SPDX-License-Identifier: MIT */

#ifndef READ_HDR_H
#define READ_HDR_H

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

typedef struct hdr_file {
    const unsigned char *at, *end;
    double divide[3]; /* what EXPOSURE and COLORCORR multiplied radiance with */
    char axes[2];     /* 'X' or 'Y': along which the lines follow each other, and each line runs */
    char signs[2];    /* '+' or '-': to which side */
    int counts[2];    /* lines, and pixels of each */
} hdr_file;

/* Copies the next line, without its end and not more than fits; 0 at the end of the file. */
static inline int hdr_line(hdr_file *in, char line[256]) {
    const unsigned char *start = in->at, *end;
    size_t length;
    if (start == in->end) return 0;
    end = (const unsigned char *)memchr(start, '\n', (size_t)(in->end - start));
    in->at = end ? end + 1 : in->end;
    if (!end) end = in->end;
    if (end > start && end[-1] == '\r') end--;
    length = (size_t)(end - start) < 255 ? (size_t)(end - start) : 255;
    memcpy(line, start, length);
    line[length] = 0;
    return 1;
}

static inline const char *hdr_skip_blanks(const char *text) {
    while (*text == ' ' || *text == '\t') text++;
    return text;
}

/* What stands behind "name =", blanks anywhere; NULL if the line is another. */
static inline const char *hdr_value(const char *line, const char *name) {
    size_t length = strlen(name);
    line = hdr_skip_blanks(line);
    if (strncmp(line, name, length)) return NULL;
    line = hdr_skip_blanks(line + length);
    return *line == '=' ? hdr_skip_blanks(line + 1) : NULL;
}

/* Multiplies factors with the numbers of a line: one for all channels, or one for each. */
static inline int hdr_factors(double factors[3], const char *text, int count) {
    double value = 1;
    char *end;
    int c;
    for (c = 0; c < 3; c++) {
        if (c < count) {
            value = strtod(text, &end);
            if (end == text || !(value > 0) || value > 1e30) return 0;
            text = end;
        }
        factors[c] *= value;
        if (!(factors[c] > 1e-30) || factors[c] > 1e30) return 0;
    }
    return 1;
}

static inline int hdr_variable(image *out, hdr_file *in, const char *line) {
    const char *value;
    if ((value = hdr_value(line, "FORMAT")) != NULL) {
        if (!strncmp(value, "32-bit_rle_xyze", 15))
            return image_fail(out, "its colours are XYZ, not RGB (FORMAT=32-bit_rle_xyze)");
        if (strncmp(value, "32-bit_rle_rgbe", 15))
            return image_fail(out, "has an unknown FORMAT: %.60s", value);
    }
    if (((value = hdr_value(line, "EXPOSURE")) && !hdr_factors(in->divide, value, 1)) ||
        ((value = hdr_value(line, "COLORCORR")) && !hdr_factors(in->divide, value, 3)))
        return image_fail(out, "has a line that makes no sense: %.60s", line);
    return 1;
}

/* "-Y 512 +X 1024" */
static inline int hdr_resolution(image *out, hdr_file *in, const char *line) {
    const char *text = line;
    char *end;
    int k, x;
    for (k = 0; k < 2; k++) {
        long count;
        text = hdr_skip_blanks(text);
        if ((text[0] != '+' && text[0] != '-') || (text[1] != 'X' && text[1] != 'Y')) break;
        in->signs[k] = text[0], in->axes[k] = text[1];
        text = hdr_skip_blanks(text + 2);
        if (*text < '0' || *text > '9') break;
        count = strtol(text, &end, 10);
        if (count < 1 || count > 1000000) break;
        in->counts[k] = (int)count, text = end;
    }
    if (k < 2 || in->axes[0] == in->axes[1] || *hdr_skip_blanks(text))
        return image_fail(out, "has no size that makes sense: %.60s", line);
    x = in->axes[1] == 'Y';
    out->width = in->counts[!x], out->height = in->counts[x];
    return 1;
}

/* Up to the first line of pixels. */
static inline int hdr_header(image *out, hdr_file *in) {
    char line[256];
    hdr_line(in, line);
    while (hdr_line(in, line)) {
        if (!*hdr_skip_blanks(line))
            return hdr_line(in, line) ? hdr_resolution(out, in, line)
                                      : image_fail(out, "ends before its size");
        if (!hdr_variable(out, in, line)) return 0;
    }
    return image_fail(out, "ends within its header");
}

/* Room behind the planes, so that a code's bytes can be written 128 at a time, which is fast; the
   next code writes over what is too much. */
enum { HDR_SLACK = 128 };

/* One plane of a line with new run lengths: n > 128: n - 128 times the next byte; else n bytes. */
static inline int hdr_plane(hdr_file *in, unsigned char *plane, int length) {
    const unsigned char *at = in->at, *end = in->end;
    int i = 0, n;
    while (i < length) {
        if (end - at < 2) return 0;
        n = *at++;
        if (n > 128) {
            n -= 128;
            if (n > length - i) return 0;
            memset(plane + i, *at++, HDR_SLACK);
        } else {
            if (n == 0 || n > length - i || end - at < n) return 0;
            memcpy(plane + i, at, end - at < HDR_SLACK ? (size_t)n : HDR_SLACK);
            at += n;
        }
        i += n;
    }
    in->at = at;
    return 1;
}

/* A line of whole pixels. One of 1, 1, 1, n repeats the one before n times; several in a row are
   the digits of one number to the base 256, the lowest first. */
static inline int hdr_old_line(hdr_file *in, unsigned char *planes, int length) {
    int i = 0, c, shift = 0;
    while (i < length) {
        const unsigned char *p = in->at;
        if (in->end - p < 4) return 0;
        in->at += 4;
        if (p[0] == 1 && p[1] == 1 && p[2] == 1) {
            long n = shift > 16 ? length : (long)p[3] << shift;
            if (i == 0 || n > length - i) return 0;
            for (c = 0; c < 4; c++)
                memset(planes + c * length + i, planes[c * length + i - 1], (size_t)n);
            i += (int)n, shift += 8;
        } else {
            for (c = 0; c < 4; c++) planes[c * length + i] = p[c];
            i++, shift = 0;
        }
    }
    return 1;
}

/* planes = the next line: [4][length], red, green, blue, exponent. */
static inline int hdr_planes(hdr_file *in, unsigned char *planes, int length) {
    const unsigned char *p = in->at;
    int c;
    if (length < 8 || length > 32767 || in->end - p < 4 || p[0] != 2 || p[1] != 2 || p[2] > 127)
        return hdr_old_line(in, planes, length);
    if ((p[2] << 8 | p[3]) != length) return 0;
    in->at += 4;
    for (c = 0; c < 4; c++)
        if (!hdr_plane(in, planes + c * length, length)) return 0;
    return 1;
}

/* m 2^(e - 136), three numbers a pixel. As long as no exponent is so small that floats have no
   such power of two but as a denormal number, its bits are (e - 9) << 23; e = 0 is black. */
static inline void hdr_floats(float *rgb, const unsigned char *planes, int length) {
    const unsigned char *e = planes + 3 * length;
    int i, c, small = 0;
    for (i = 0; i < length; i++) small |= e[i] > 0 && e[i] < 10;
    for (i = 0; i < length; i++) {
        uint32_t bits = e[i] ? ((uint32_t)e[i] - 9) << 23 : 0;
        float unit;
        memcpy(&unit, &bits, sizeof unit);
        for (c = 0; c < 3; c++) rgb[3 * i + c] = unit * (float)planes[c * length + i];
    }
    for (i = 0; i < length && small; i++)
        for (c = 0; c < 3; c++)
            rgb[3 * i + c] = e[i] ? ldexpf((float)planes[c * length + i], e[i] - 136) : 0;
}

/* A line into its place; `room` for it, if that is not in one piece. */
static inline void hdr_place(image *out, const hdr_file *in, int line, const unsigned char *planes,
                             float *room) {
    int by_rows = in->axes[0] == 'Y', length = in->counts[1], i;
    int down = by_rows ? in->signs[0] == '-' : in->signs[0] == '+'; /* lines, as in memory */
    int along = by_rows ? in->signs[1] == '+' : in->signs[1] == '-';
    ptrdiff_t row = out->width, step = by_rows ? 1 : row, stride = by_rows ? row : 1;
    float *p = out->rgb + 3 * ((down ? line : in->counts[0] - 1 - line) * stride +
                               (along ? 0 : (length - 1) * step));
    if (by_rows && along) {
        hdr_floats(p, planes, length);
        return;
    }
    hdr_floats(room, planes, length);
    for (i = 0; i < length; i++) memcpy(p + 3 * i * (along ? step : -step), room + 3 * i, 12);
}

static inline int hdr_lines(image *out, hdr_file *in) {
    size_t length = (size_t)in->counts[1];
    int line = 0;
    unsigned char *planes = (unsigned char *)ENVMAP_MALLOC(NULL, 4 * length + HDR_SLACK);
    float *room = (float *)ENVMAP_MALLOC(NULL, 3 * length * sizeof(float));
    out->no_room = !planes || !room;
    for (; !out->no_room && line < in->counts[0] && hdr_planes(in, planes, (int)length); line++)
        hdr_place(out, in, line, planes, room);
    if (planes) ENVMAP_FREE(NULL, planes);
    if (room) ENVMAP_FREE(NULL, room);
    if (out->no_room) return image_fail(out, "out of memory for a line");
    if (line < in->counts[0])
        return image_fail(out, "ends or is damaged in line %d of %d", line + 1, in->counts[0]);
    return 1;
}

static inline int hdr_read(image *out, const unsigned char *data, size_t bytes) {
    hdr_file in = {NULL, NULL, {1, 1, 1}, {0, 0}, {0, 0}, {0, 0}};
    size_t i, count;
    in.at = data, in.end = data + bytes;
    out->format = "Radiance RGBE";
    if (!hdr_header(out, &in)) return 0;
    if ((in.end - in.at) / 4 < in.counts[0]) /* before there is memory for them */
        return image_fail(out, "ends before its last line");
    if (!image_create(out) || !hdr_lines(out, &in)) return 0;
    count = image_floats(out);
    if (in.divide[0] < 1 || in.divide[0] > 1 || in.divide[1] < 1 || in.divide[1] > 1 ||
        in.divide[2] < 1 || in.divide[2] > 1)
        for (i = 0; i < count; i++) out->rgb[i] = (float)((double)out->rgb[i] / in.divide[i % 3]);
    return 1;
}

#endif /* READ_HDR_H */
