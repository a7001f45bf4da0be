/* write_hdr.h - Radiance pictures (.hdr): one level of a map, faces below each other.

   A pixel is m 2^(e - 136), rounded to the nearest, because readers add no half. What is below zero
   or no number is 0 and counted, what is above the largest too. Rows are run-length encoded where
   the format allows it, from 8 to 32767 pixels. Source: G. Ward, "Real Pixels", Graphics Gems II,
   1991, and the Radiance file format page. Test: tests/test_write.c. Include after write_texels.h.

   SPDX-License-Identifier: MIT */

#ifndef WRITE_HDR_H
#define WRITE_HDR_H

static inline void hdr_pixel(unsigned char rgbe[4], const float rgb[3], long *saturated) {
    static const float limit = 1.69476e38f; /* 255 2^119 = 1.6948e38 */
    float value[3], most = 0;
    int c, e;
    for (c = 0; c < 3; c++) {
        value[c] = texel_positive(rgb[c], saturated);
        if (value[c] > limit) value[c] = limit, ++*saturated;
        if (value[c] > most) most = value[c];
    }
    memset(rgbe, 0, 4);
    frexpf(most, &e);
    e += floorf(ldexpf(most, 8 - e) + 0.5f) > 255; /* 255.6 rounds to 256: the next exponent */
    if (!(most > 0) || e + 128 < 1) return;
    for (c = 0; c < 3; c++) rgbe[c] = (unsigned char)floorf(ldexpf(value[c], 8 - e) + 0.5f);
    rgbe[3] = (unsigned char)(e + 128);
}

/* How many bytes from `at` on are alike, 4 bytes apart, up to 127. */
static inline int hdr_run(const unsigned char *row, int at, int width) {
    int n = 1;
    while (at + n < width && n < 127 && row[4 * (at + n)] == row[4 * at]) n++;
    return n;
}

/* One channel of a row: runs of four and more, and the bytes between them as they are. */
static inline void hdr_channel(write_file *w, const unsigned char *row, int width) {
    int at = 0, start, k;
    while (at < width) {
        int run = hdr_run(row, at, width);
        if (run >= 4) {
            write_little(w, 128 + (unsigned)run, 1), write_little(w, row[4 * at], 1);
            at += run;
            continue;
        }
        for (start = at; at < width && at - start < 128 && hdr_run(row, at, width) < 4; at++) {}
        write_little(w, (unsigned)(at - start), 1);
        for (k = start; k < at; k++) write_little(w, row[4 * k], 1);
    }
}

static inline void hdr_row(write_file *w, unsigned char *row, const float *rgb, int width,
                           long *saturated) {
    int x, c;
    for (x = 0; x < width; x++) hdr_pixel(row + 4 * x, rgb + 3 * x, saturated);
    if (width < 8 || width > 32767) {
        write_bytes(w, row, 4 * (size_t)width);
        return;
    }
    write_little(w, 0x0202, 2);
    write_little(w, (unsigned)width >> 8, 1), write_little(w, (unsigned)width & 255, 1);
    for (c = 0; c < 4; c++) hdr_channel(w, row + c, width);
}

/* 0, or an errno; t->format does not count. */
static inline int write_hdr(texture *t, int level, const char *path) {
    write_file w;
    int face, y, width = texture_width(t, level), edge = texture_edge(t, level);
    unsigned char *row = (unsigned char *)malloc(4 * (size_t)width);
    char head[96];
    t->saturated = 0;
    write_open(&w, path);
    if (!row && !w.error) w.error = ENOMEM;
    snprintf(head, sizeof head, "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y %d +X %d\n",
             edge * texture_faces(t), width);
    write_text(&w, head);
    for (face = 0; face < texture_faces(t) && row; face++)
        for (y = 0; y < edge; y++)
            hdr_row(&w, row, envmap_texel(t->map, level, 0, face, 0, y), width, &t->saturated);
    free(row);
    return write_close(&w);
}

#endif /* WRITE_HDR_H */
