/* layouts.h - which map a picture is: by its shape, or by what its user says. Include after
   envmap.h.

       2:1 lat-long; 1:6 and 6:1 strips, 3:4 and 4:3 crosses of a cube; 1:2 paraboloids. A lat-long
       of any other shape is stretched; squares have to be named, for they could be several things.

   Crosses hold the six faces as OpenGL has them:
             +Y               +Y
          -X +Z +X         -X +Z +X -Z
             -Y               -Y
             -Z (turned by 180 degrees)
   Tests: tests/test_tool_read.c, tests/fuzz_tool.c.

   SPDX-License-Identifier: MIT */

#ifndef LAYOUTS_H
#define LAYOUTS_H

#include "image.h"

#include <stdint.h>

static const char *const mapping_words[] = {"cube",    "paraboloid", "sphere",
                                            "latlong", "angular",    NULL};
enum { HORIZON_NONE = -1, HORIZON_BLACK, HORIZON_MEAN };

#define LAYOUT_SIZE 16384 /* the longest edge of a map */

/* Where a face lies in the picture, in edges, and whether it is turned by 180 degrees. */
typedef struct layout_cell {
    unsigned char column, row, turned;
} layout_cell;

static const layout_cell layout_row[6] = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0},
                                          {3, 0, 0}, {4, 0, 0}, {5, 0, 0}};
static const layout_cell layout_upright[6] = {{2, 1, 0}, {0, 1, 0}, {1, 0, 0},
                                              {1, 2, 0}, {1, 1, 0}, {1, 3, 1}};
static const layout_cell layout_lying[6] = {{2, 1, 0}, {0, 1, 0}, {1, 0, 0},
                                            {1, 2, 0}, {1, 1, 0}, {3, 1, 0}};

typedef struct layout {
    int mapping, columns, rows; /* shape of the picture, in edges */
    const layout_cell *cells;   /* NULL: in memory as in the picture */
} layout;

static const layout layouts[] = {
    {ENVMAP_LATLONG, 2, 1, NULL},         {ENVMAP_CUBE, 1, 6, NULL},
    {ENVMAP_CUBE, 6, 1, layout_row},      {ENVMAP_CUBE, 3, 4, layout_upright},
    {ENVMAP_CUBE, 4, 3, layout_lying},    {ENVMAP_PARABOLOID, 1, 2, NULL},
    {ENVMAP_PARABOLOID, 2, 1, layout_row}};

/* The first layout that a picture of this shape has; mapping -1: of any map. */
static inline const layout *layout_find(int width, int height, int mapping) {
    size_t k;
    for (k = 0; k < sizeof layouts / sizeof *layouts; k++) {
        const layout *l = &layouts[k];
        if ((mapping < 0 || mapping == l->mapping) && width % l->columns == 0 &&
            (int64_t)(width / l->columns) * l->rows == height)
            return l;
    }
    return NULL;
}

/* The pixels become the map's texels: its memory has the same order. */
static inline int layout_take(envmap *map, image *in, int mapping, int size, int slices) {
    if (size > LAYOUT_SIZE || slices > 4096) {
        in->no_room = 1;
        return image_fail(in, "is %d texels an edge with %d slices; maps have at most %d and 4096",
                          size, slices, LAYOUT_SIZE);
    }
    memset(map, 0, sizeof *map);
    map->texels = in->rgb, in->rgb = NULL;
    map->mapping = mapping, map->size = size, map->levels = 1, map->slices = slices;
    map->p0 = -1, map->p1 = 1;
    return 1;
}

/* The picture = a face of another one. */
static inline void layout_copy(float *face, const image *in, layout_cell cell, int edge) {
    size_t row = 3 * (size_t)edge;
    int x, y;
    for (y = 0; y < edge; y++) {
        size_t line = (size_t)(cell.row * edge + (cell.turned ? edge - 1 - y : y));
        const float *from =
            in->rgb + 3 * (line * (size_t)in->width + (size_t)cell.column * (size_t)edge);
        float *to = face + (size_t)y * row;
        for (x = 0; x < edge && cell.turned; x++) memcpy(to + 3 * x, from + 3 * (edge - 1 - x), 12);
        if (!cell.turned) memcpy(to, from, row * sizeof(float));
    }
}

/* Faces that lie apart become a strip. */
static inline int layout_gather(image *in, const layout *l, int edge) {
    image strip = *in;
    int faces = envmap_faces(l->mapping), k;
    strip.rgb = NULL, strip.width = edge, strip.height = faces * edge;
    if (!image_create(&strip)) return image_fail(in, "%s", strip.error), in->no_room = 1, 0;
    for (k = 0; k < faces; k++)
        layout_copy(strip.rgb + 3 * (size_t)k * (size_t)edge * (size_t)edge, in, l->cells[k], edge);
    image_free(in);
    *in = strip;
    return 1;
}

/* out[j] = the mean of in over the j-th of `to` equal parts; three channels, `step` floats from one
   pixel to the next in both. */
static inline void layout_stretch_line(float *out, int to, const float *in, int from, size_t step) {
    double ratio = (double)from / to;
    int j, i, c;
    for (j = 0; j < to; j++) {
        double start = j * ratio, end = j + 1 < to ? start + ratio : from, sum[3] = {0, 0, 0};
        for (i = (int)start; i < from && i < end; i++) {
            double part = ((double)i + 1 < end ? i + 1 : end) - (i > start ? i : start);
            for (c = 0; c < 3; c++) sum[c] += part * (double)in[(size_t)i * step + (size_t)c];
        }
        for (c = 0; c < 3; c++) out[(size_t)j * step + (size_t)c] = (float)(sum[c] / (end - start));
    }
}

/* The picture in another size: each pixel is the mean over its area. */
static inline int layout_stretch(image *in, int width, int height) {
    image wide = *in, out = *in;
    int k;
    wide.rgb = out.rgb = NULL, wide.width = out.width = width, out.height = height;
    if (!image_create(&wide) || !image_create(&out)) {
        image_free(&wide);
        return image_fail(in, "out of memory for %d x %d pixels", width, height), in->no_room = 1,
                                                                                  0;
    }
    for (k = 0; k < in->height; k++)
        layout_stretch_line(wide.rgb + 3 * (size_t)k * (size_t)width, width,
                            in->rgb + 3 * (size_t)k * (size_t)in->width, in->width, 3);
    for (k = 0; k < width; k++)
        layout_stretch_line(out.rgb + 3 * k, height, wide.rgb + 3 * k, in->height,
                            3 * (size_t)width);
    image_free(&wide), image_free(in);
    *in = out;
    return 1;
}

/* A sky that ends at the horizon gets a ground: black, or the mean of its lowest row. */
static inline int layout_ground(image *in, int horizon) {
    image all = *in;
    size_t half = image_floats(in), row = 3 * (size_t)in->width, i;
    double mean[3] = {0, 0, 0};
    all.rgb = NULL, all.height = 2 * in->height;
    if (!image_create(&all)) return image_fail(in, "%s", all.error), in->no_room = 1, 0;
    memcpy(all.rgb, in->rgb, half * sizeof(float));
    for (i = 0; i < row; i++) mean[i % 3] += (double)in->rgb[half - row + i] / in->width;
    for (i = 0; i < half; i++) all.rgb[half + i] = horizon == HORIZON_MEAN ? (float)mean[i % 3] : 0;
    image_free(in);
    *in = all;
    return 1;
}

/* Any shape as a lat-long: no direction gets fewer pixels than it has. */
static inline int layout_latlong(envmap *map, image *in) {
    int width = in->width, height = in->height;
    int size = width / 2 + width % 2 > height ? width / 2 + width % 2 : height;
    if (size > LAYOUT_SIZE) size = LAYOUT_SIZE;
    if (width != 2 * size || height != size) {
        if (!layout_stretch(in, 2 * size, size)) return 0;
        image_remark(in, "is %d x %d, not 2:1, and was stretched to %d x %d\n", width, height,
                     2 * size, size);
    }
    return layout_take(map, in, ENVMAP_LATLONG, size, 1);
}

/* The maps that a square could be, as words for --mapping. */
static inline void layout_squares(char out[96]) {
    int m;
    *out = 0;
    for (m = 0; mapping_words[m]; m++)
        if (envmap_faces(m) == 1 && m != ENVMAP_LATLONG)
            snprintf(out + strlen(out), 96 - strlen(out), "%s%s", *out ? "|" : "",
                     mapping_words[m]);
}

/* What a shape could be that has no layout, or several. */
static inline int layout_refuse(image *in, int mapping) {
    int w = in->width, h = in->height;
    char squares[96];
    layout_squares(squares);
    if (mapping >= 0)
        return image_fail(in, "is %d x %d; %s maps have width to height %s", w, h,
                          mapping_words[mapping],
                          mapping == ENVMAP_CUBE ? "1:6 (strip, times slices), 6:1, 3:4 or 4:3"
                          : mapping == ENVMAP_PARABOLOID ? "1:2 (times slices) or 2:1"
                                                         : "1:1 (times slices)");
    if (w == h)
        return image_fail(in, "is %d x %d: a square could be several things: say --mapping %s", w,
                          h, squares);
    if (h > w && h % w == 0)
        return image_fail(in,
                          "is %d x %d, a strip of %d squares: say which --mapping its slices are",
                          w, h, h / w);
    return image_fail(in,
                      "is %d x %d: no lat-long (2:1), cube (1:6, 6:1, 3:4, 4:3) or paraboloid map "
                      "(1:2); --mapping latlong would stretch it%s",
                      w, h, w > 3 * h ? ", --horizon take it for the upper half" : "");
}

/* The picture as a map; mapping -1: as its shape tells. Takes the pixels, or leaves an error. */
static inline int layout_map(envmap *map, image *in, int mapping, int horizon) {
    const layout *l;
    int faces;
    if (horizon >= 0) {
        if (mapping >= 0 && mapping != ENVMAP_LATLONG)
            return image_fail(in, "--horizon is for lat-long maps");
        return layout_ground(in, horizon) && layout_latlong(map, in);
    }
    l = layout_find(in->width, in->height, mapping);
    if (l) {
        int edge = in->width / l->columns;
        if (l->cells && !layout_gather(in, l, edge)) return 0;
        return layout_take(map, in, l->mapping, edge, 1);
    }
    if (mapping == ENVMAP_LATLONG ||
        (mapping < 0 && in->width > 1.9 * in->height && in->width < 2.1 * in->height))
        return layout_latlong(map, in);
    faces = envmap_faces(mapping);
    if (faces && in->height % in->width == 0 && in->height / in->width % faces == 0)
        return layout_take(map, in, mapping, in->width, in->height / in->width / faces);
    return layout_refuse(in, mapping);
}

#endif /* LAYOUTS_H */
