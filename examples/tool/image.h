/* image.h - a picture of floats on its way from a file to a map. Include after envmap.h.

   SPDX-License-Identifier: MIT */

#ifndef IMAGE_H
#define IMAGE_H

#include <stdarg.h>
#include <stddef.h>
#include <stdio.h>
#include <string.h>

/* The most bytes of a picture: as many as a map may have. */
#ifndef IMAGE_LIMIT
#define IMAGE_LIMIT 8589934592.0
#endif

typedef struct image {
    float *rgb;         /* rows from top to bottom, 3 floats a pixel; of ENVMAP_MALLOC(NULL, ...) */
    int width, height;  /* pixels */
    const char *format; /* its file's */
    double scale;       /* that a PFM's samples were multiplied by, with its sign; elsewhere 1 */
    char remarks[512];  /* what its user should know of it: sentences, each with a line end */
    char error[256];    /* why there is no picture */
    int no_room;        /* 1: the error is about memory or limits */
} image;

/* Sets the error; always 0, for readers return 1 when they are done and 0 when they failed. */
static inline int image_fail(image *p, const char *format, ...) {
    va_list values;
    va_start(values, format);
    vsnprintf(p->error, sizeof p->error, format, values);
    va_end(values);
    return 0;
}

static inline void image_remark(image *p, const char *format, ...) {
    size_t used = strlen(p->remarks), room = sizeof p->remarks - used;
    va_list values;
    va_start(values, format);
    vsnprintf(p->remarks + used, room, format, values);
    va_end(values);
}

static inline void image_free(image *p) {
    if (p->rgb) ENVMAP_FREE(NULL, p->rgb);
    p->rgb = NULL;
}

static inline size_t image_floats(const image *p) {
    return 3 * (size_t)p->width * (size_t)p->height;
}

/* Room for the pixels of p->width x p->height, not cleared. */
static inline int image_create(image *p) {
    double bytes = 12.0 * p->width * p->height;
    p->no_room = 1;
    if (bytes > IMAGE_LIMIT || bytes > (double)((size_t)-1))
        return image_fail(p, "%d x %d pixels are more than a map may have", p->width, p->height);
    p->rgb = (float *)ENVMAP_MALLOC(NULL, image_floats(p) * sizeof(float));
    if (!p->rgb) return image_fail(p, "out of memory for %d x %d pixels", p->width, p->height);
    p->no_room = 0;
    return 1;
}

/* Turns the rows upside down. */
static inline void image_flip(image *p) {
    size_t row = 3 * (size_t)p->width, i;
    int y;
    for (y = 0; y < p->height / 2; y++) {
        float *a = p->rgb + (size_t)y * row, *b = p->rgb + (size_t)(p->height - 1 - y) * row;
        for (i = 0; i < row; i++) {
            float keep = a[i];
            a[i] = b[i], b[i] = keep;
        }
    }
}

#endif /* IMAGE_H */
