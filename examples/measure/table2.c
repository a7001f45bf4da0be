/* SPDX-License-Identifier: MIT
   Table 2 of Kautz, Vazquez, Heidrich and Seidel 2000 measured again: a parabolic map of 512 x 1024
   texels convolved twice with at most 7 x 7 taps, beside the fast filter on the same map.

   What you will see: the table and its chart, after a minute; `table2 DOCS` writes them to
   DOCS/accuracy-speed.md and DOCS/charts/table2.svg.
       cc -O3 -march=native -I. examples/measure/table2.c -o table2 -lm */
#define _POSIX_C_SOURCE 200809L
#include "measure.h"
#include "svg.h"
#include "../tool/scenes.h"
#include "../methods/paraboloid_convolution.h"

/* Kernels in texels of faces of 512, by how much the map shrinks first, S and L; frames a second on
   an SGI O2, with both maps and with S alone. */
static const struct published {
    int exponent, size[2], shrink[2], frames[2];
} published[] = {{10, {174, 260}, {32, 64}, {25, 33}},
                 {50, {78, 136}, {16, 32}, {20, 33}},
                 {100, {56, 100}, {8, 16}, {16, 25}},
                 {250, {36, 66}, {8, 16}, {16, 25}},
                 {500, {26, 48}, {4, 8}, {9, 11}}};

enum { TWO, ONE, FAST, RATES };
static const char *const names[RATES] = {"both maps", "map S alone", "FAST, tolerance 0.01"};
static const char *const colours[RATES] = {"#8a6d3b", "#3b6ea8", "#d01c2a"};

typedef struct rate {
    double per_second, rms;
} rate;

static envmap_result run(envmap *dst, const envmap *src, const envmap_lobe *lobe, int way) {
    method_desc method = {0};
    envmap_filter_desc fast = {0};
    method.form = METHOD_PUBLISHED, method.one_map = way == ONE, fast.tolerance = 0.01f;
    return way == FAST ? envmap_filter(dst, src, lobe, &fast)
                       : method_paraboloid_convolution(dst, src, lobe, &method);
}

/* The best of three runs, against the fast filter at a tolerance of 1e-5. */
static void measure_rates(rate rates[RATES], const envmap *src, int exponent) {
    envmap dst = measure_map(src->mapping, src->size, 1, 1);
    envmap truth = measure_map(src->mapping, src->size, 1, 1);
    envmap_lobe lobe = envmap_lobe_phong((float)exponent);
    envmap_filter_desc exact = {0};
    exact.tolerance = 1e-5f;
    measure_must(envmap_filter(&truth, src, &lobe, &exact), "truth");
    for (int way = 0; way < RATES; ++way) {
        envmap_difference d;
        double best = 1e30;
        for (int i = 0; i < 3; ++i) {
            double begun = measure_seconds();
            measure_must(run(&dst, src, &lobe, way), names[way]);
            best = fmin(best, measure_seconds() - begun);
        }
        measure_must(envmap_compare(&d, &dst, &truth, 0), names[way]);
        rates[way].per_second = 1 / best, rates[way].rms = d.rms;
    }
    envmap_free(&dst);
    envmap_free(&truth);
}

static void table_row(FILE *out, int i, const rate rates[RATES]) {
    const struct published *was = published + i;
    envmap_lobe lobe = envmap_lobe_phong((float)was->exponent);
    int size[2], shrink[2];
    paraboloid_sizes(size, shrink, &lobe, 512, 0.1, 7);
    fprintf(out, "| %d | %d, %d; %d, %d | %d, %d; %d, %d | %d, %d |", was->exponent, was->size[0],
            was->size[1], was->shrink[0], was->shrink[1], size[0], size[1], shrink[0], shrink[1],
            was->frames[0], was->frames[1]);
    for (int way = 0; way < RATES; ++way)
        fprintf(out, " **%.0f** | %.1g |", rates[way].per_second, rates[way].rms);
    fprintf(out, "\n");
}

static void chart_bar(FILE *f, const svg_axes *a, double y, double value, const char *colour,
                      const char *text) {
    double x = svg_x(a, value);
    svg_bar(f, a->left, y, x - a->left, 12, colour);
    svg_text(f, x + 6, y + 10, 11, "start", "#111", "%s", text);
}

static void chart_row(FILE *f, const svg_axes *a, int i, const rate rates[RATES]) {
    static const char *const was[2] = {"published, both", "published, S"};
    double y = a->top + 8 + 88 * i;
    char text[80];
    svg_text(f, a->left - 10, y + 38, 13, "end", "#111", "N = %d", published[i].exponent);
    for (int k = 0; k < 2; ++k) {
        snprintf(text, sizeof text, "%d (%s)", published[i].frames[k], was[k]);
        chart_bar(f, a, y + 14 * k, published[i].frames[k], "#777777", text);
    }
    for (int way = 0; way < RATES; ++way) {
        snprintf(text, sizeof text, "%.0f (rms %.1g)", rates[way].per_second, rates[way].rms);
        chart_bar(f, a, y + 28 + 14 * way, rates[way].per_second, colours[way], text);
    }
}

static void chart_frame(FILE *f, const svg_axes *a) {
    for (int i = 0; i <= 3; ++i) {
        char text[16];
        snprintf(text, sizeof text, "%g", pow(10, i));
        svg_tick_x(f, a, pow(10, i), text);
    }
    svg_frame(f, a);
    svg_text(f, 0.5 * (a->left + a->right), a->bottom + 34, 12, "middle", "#444",
             "maps a second; grey: an SGI O2 in 2000, the rest: one thread of a processor here");
    for (int way = 0; way < RATES; ++way) {
        svg_bar(f, a->left + 210 * way, a->bottom + 48, 12, 12, colours[way]);
        svg_text(f, a->left + 18 + 210 * way, a->bottom + 58, 12, "start", "#111", "%s",
                 names[way]);
    }
}

static void write_table2(const char *folder) {
    static measure_document document;
    char path[4096];
    envmap src = measure_map(ENVMAP_PARABOLOID, 512, 1, 1);
    svg_axes a = {110, 44, 780, 484, 1, 1000, 0, 1, 1, 0};
    FILE *out = measure_begin(&document, "table2");
    FILE *f = folder ? svg_open(folder, "table2.svg", 900, 556,
                                "Filtering in every frame: Kautz et al. 2000, Table 2")
                     : NULL;
    scene_fill(&src, SCENE_STUDIO);
    if (f) chart_frame(f, &a);
    fprintf(out,
            "| N | published: kernels S, L; shrunk by | here | published frames a second: both, "
            "S | both maps, maps a second | rms | S alone | rms | FAST, tolerance 0.01, maps a "
            "second | rms |\n|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|\n");
    for (int i = 0; i < COUNT(published); ++i) {
        rate rates[RATES];
        measure_rates(rates, &src, published[i].exponent);
        table_row(out, i, rates);
        if (f) chart_row(f, &a, i, rates);
    }
    measure_end(&document, out, 1);
    if (f) {
        svg_close(f);
        snprintf(path, sizeof path, "%s/accuracy-speed.md", folder);
        measure_write(&document, path, "make table2");
    }
    measure_document_free(&document);
    envmap_free(&src);
}

int main(int argc, char **argv) {
    write_table2(argc > 1 ? argv[1] : NULL);
    return 0;
}
