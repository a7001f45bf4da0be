/* sharpness.c - cost and error from the widest lobe to the sharpest: Phong N from 1 to a million, GGX
   alpha from 1 to 1e-4, from a cube and from a lat-long.

   What you will see: `sharpness` prints the table; `sharpness DOCS` also writes it between the marks
   in DOCS/filters.md, and the chart DOCS/charts/sharpness.svg.
       cc -O3 -march=native -std=c99 -I. examples/measure/sharpness.c -o sharpness -lm -lpthread

   SPDX-License-Identifier: MIT */

#define _POSIX_C_SOURCE 200809L
#include "measure.h"

#include "../tool/picture.h"
#include "../tool/scenes.h"
#include "svg.h"

/* Texels of edge 9 have the centres of every 27th texel of edge 243: so the definition is asked for
   486 axes only. */
#define EDGE     243
#define SOME     9
#define LATLONG  256 /* half its width */
#define PHONGS   19
#define ALPHAS   17
#define LONGEST  0.2 /* seconds after which a measurement is not tried again */

static const double exponents[PHONGS] = {1,    2,    5,    10,   20,   50,  100, 200, 500, 1e3,
                                         2e3,  5e3,  1e4,  2e4,  5e4,  1e5, 2e5, 5e5, 1e6};
static const double alphas[ALPHAS] = {1,    0.7,   0.5,   0.3,    0.2,  0.1,  0.07, 0.05, 0.03,
                                      0.02, 0.015, 0.01,  0.005,  2e-3, 1e-3, 3e-4, 1e-4};

typedef struct point {
    double copies, reference, rms, worst; /* copies of the sum over all texels: from a few axes */
} point;

static point found[2][2][PHONGS]; /* Phong, GGX; from a cube, from a lat-long */

static envmap_lobe lobe_of(int kind, int i) {
    return kind ? envmap_lobe_ggx((float)alphas[i]) : envmap_lobe_phong((float)exponents[i]);
}

/* The least processor time of a filter, with as many tries as fit. */
static double seconds_of(envmap *dst, const envmap *src, const envmap_lobe *lobe,
                         const envmap_filter_desc *desc) {
    double least = 1e9, spent = 0;
    for (int i = 0; i < 2 || (i < 7 && spent < LONGEST); ++i) {
        double start = measure_seconds();
        measure_must(envmap_filter(dst, src, lobe, desc), "a filter");
        start = measure_seconds() - start;
        least = fmin(least, start), spent += start;
    }
    return least;
}

/* The root of the sphere's mean square of a map's numbers. */
static double norm_of(const envmap *map) {
    double sum = 0;
    for (int i = 0; i < 6 * map->size * map->size; ++i) {
        int face = i / map->size / map->size, x = i % map->size, y = i / map->size % map->size;
        const float *rgb = envmap_texel(map, 0, 0, face, x, y);
        for (int c = 0; c < 3; ++c)
            sum += envmap_solid_angle(map, 0, face, x, y) * (double)rgb[c] * (double)rgb[c];
    }
    return sqrt(sum);
}

static point measure_point(const envmap *src, const envmap_lobe *lobe) {
    envmap all = measure_map(ENVMAP_CUBE, EDGE, 1, 1), some = measure_map(ENVMAP_CUBE, SOME, 1, 1);
    envmap truth = measure_map(ENVMAP_CUBE, SOME, 1, 1);
    envmap_filter_desc desc;
    envmap_difference off;
    point p;
    memset(&desc, 0, sizeof desc);
    double copy = measure_copy(src, &all, 1, measure_seconds);
    p.copies = seconds_of(&all, src, lobe, NULL) / copy;
    desc.method = ENVMAP_METHOD_REFERENCE;
    double start = measure_seconds();
    measure_must(envmap_filter(&truth, src, lobe, &desc), "the reference");
    p.reference = (measure_seconds() - start) / copy * EDGE * EDGE / SOME / SOME;
    for (int i = 0; i < 6 * SOME * SOME; ++i) {
        int face = i / SOME / SOME, x = i % SOME, y = i / SOME % SOME, step = EDGE / SOME;
        memcpy(envmap_texel(&some, 0, 0, face, x, y),
               envmap_texel(&all, 0, 0, face, step * x + step / 2, step * y + step / 2),
               3 * sizeof(float));
    }
    measure_must(envmap_compare(&off, &some, &truth, 0), "a comparison");
    /* of the few axes one may lie beside the sun, or none: their error counts against all texels */
    p.rms = off.rms / 1e-3 * norm_of(&truth) / norm_of(&all), p.worst = off.worst / 1e-3;
    envmap_free(&all), envmap_free(&some), envmap_free(&truth);
    return p;
}

static void table(measure_document *document) {
    static const char *const names[2] = {"Phong N", "GGX α"};
    FILE *out = measure_begin(document, "sharpness");
    fprintf(out,
            "Copies, and rms and worst texel in tolerances of 1e-3 (bounds: 1 and 20), beside a sun; "
            "result\n6 × %d². One thread. The reference's copies are those of %d axes, scaled;\n"
            "errors are those of the same axes, rms against the root mean square of all texels.\n",
            EDGE, 6 * SOME * SOME);
    for (int kind = 0; kind < 2; ++kind) {
        fprintf(out, "\n| %s | from 6 × %d² | rms, worst | from %d × %d | rms, worst | reference |\n",
                names[kind], EDGE, 2 * LATLONG, LATLONG);
        fprintf(out, "|--:|--:|--:|--:|--:|--:|\n");
        for (int i = 0; i < (kind ? ALPHAS : PHONGS); ++i) {
            const point *c = &found[kind][0][i], *l = &found[kind][1][i];
            fprintf(out, "| %g | %.3g | %.2g, %.2g | %.3g | %.2g, %.2g | %.2g |\n",
                    kind ? alphas[i] : exponents[i], c->copies, c->rms, c->worst, l->copies,
                    l->rms, l->worst, c->reference);
        }
    }
    measure_end(document, out, 1);
}

/* One panel: copies above, errors below, by N or by 1 over alpha. */
static void panel(FILE *f, int kind, double left) {
    static const char *const ticks_x[2][7] = {{"1", "10", "100", "1000", "1e4", "1e5", "1e6"},
                                              {"1", "0.1", "0.01", "0.001", "1e-4", NULL, NULL}};
    int count = kind ? ALPHAS : PHONGS;
    svg_axes time = {left, 60, left + 380, 310, 1, kind ? 1e4 : 1e6, 1, 1e8, 1, 1};
    svg_axes error = {left, 350, left + 380, 530, 1, kind ? 1e4 : 1e6, 1e-6, 100, 1, 1};
    for (int i = 0; i < 7 && ticks_x[kind][i]; ++i) {
        svg_tick_x(f, &time, pow(10, i), NULL);
        svg_tick_x(f, &error, pow(10, i), ticks_x[kind][i]);
    }
    for (int i = 0; i <= 8; ++i) {
        char text[20];
        snprintf(text, sizeof text, i < 4 ? "%.0f" : "%.0e", pow(10, i));
        svg_tick_y(f, &time, pow(10, i), text);
        snprintf(text, sizeof text, "%g", pow(10, i - 6));
        svg_tick_y(f, &error, pow(10, i - 6), text);
    }
    for (int from = 0; from < 2; ++from) {
        double x[PHONGS], y[4][PHONGS];
        for (int i = 0; i < count; ++i) {
            const point *p = &found[kind][from][i];
            x[i] = kind ? 1 / alphas[i] : exponents[i];
            y[0][i] = p->copies, y[1][i] = p->rms, y[2][i] = p->worst, y[3][i] = p->reference;
        }
        svg_line(f, &time, x, y[0], count, svg_colours[from], 2, "");
        if (!from) svg_line(f, &time, x, y[3], count, "#777777", 1.5, "stroke-dasharray=\"5 4\"");
        svg_line(f, &error, x, y[1], count, svg_colours[from], 2, "");
        svg_line(f, &error, x, y[2], count, svg_colours[from], 1.5, "stroke-dasharray=\"2 3\"");
    }
    svg_frame(f, &time), svg_frame(f, &error);
    svg_text(f, left + 190, 566, 13, "middle", "#222", kind ? "GGX α" : "Phong N");
    svg_text(f, left, 52, 12, "start", "#444", "copies (processor time over that of a copy)");
    svg_text(f, left, 342, 12, "start", "#444", "error in tolerances of 1e-3");
}

static void key(FILE *f, double x, const char *colour, const char *style, const char *text) {
    fprintf(f, "<path fill=\"none\" stroke=\"%s\" stroke-width=\"2\" %s d=\"M%.1f 592h26\"/>\n",
            colour, style, x);
    svg_text(f, x + 32, 596, 12, "start", "#222", "%s", text);
}

static void draw(const char *folder) {
    FILE *f = svg_open(folder, "sharpness.svg", 916, 615, "Cost and error against sharpness");
    panel(f, 0, 70), panel(f, 1, 516);
    key(f, 70, svg_colours[0], "", "from a cube");
    key(f, 200, svg_colours[1], "", "from a lat-long");
    key(f, 350, "#777777", "stroke-dasharray=\"5 4\"", "the reference, from the cube");
    key(f, 590, "#444", "stroke-dasharray=\"2 3\"", "worst texel (whole line: rms)");
    svg_close(f);
}

int main(int argc, char **argv) {
    envmap skies[2];
    measure_document document;
    memset(&document, 0, sizeof document);
    skies[0] = measure_map(ENVMAP_CUBE, EDGE, 1, 1);
    skies[1] = measure_map(ENVMAP_LATLONG, LATLONG, 1, 1);
    for (int from = 0; from < 2; ++from) scene_fill(&skies[from], SCENE_SUN);
    for (int kind = 0; kind < 2; ++kind)
        for (int i = 0; i < (kind ? ALPHAS : PHONGS); ++i)
            for (int from = 0; from < 2; ++from) {
                envmap_lobe lobe = lobe_of(kind, i);
                fprintf(stderr, "\r%s %d of %d ", kind ? "GGX" : "Phong", i + 1,
                        kind ? ALPHAS : PHONGS);
                found[kind][from][i] = measure_point(&skies[from], &lobe);
            }
    fprintf(stderr, "\r%40s\r", "");
    table(&document);
    if (argc > 1) {
        char path[5000];
        draw(argv[1]);
        snprintf(path, sizeof path, "%s/filters.md", argv[1]);
        measure_write(&document, path, "make sharpness");
    }
    for (int from = 0; from < 2; ++from) envmap_free(&skies[from]);
    measure_document_free(&document);
    return 0;
}
