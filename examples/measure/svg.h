/* svg.h - charts: an SVG file, axes that are linear or logarithmic, grids, lines and dots.

   What you will see: nothing by itself. Charts stand on a sheet of their own, white on light pages
   and nearly black on dark ones: callers name the colours of the light sheet, and a style in the file
   has what stands for each of them on the dark one.

   SPDX-License-Identifier: MIT */

#ifndef SVG_H
#define SVG_H

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>

static const char *const svg_colours[] = {"#3b6ea8", "#c4732b", "#b03a48", "#4d8f4d", "#7a5aa6",
                                          "#1f8f8f", "#8a6d3b", "#c2559d", "#111111", "#777777"};

/* The sheet, ink, pale ink, grid lines, and the lines' colours: light, dark. Others stay. */
static const char *const svg_schemes[][2] = {
    {"#fff", "#14181d"},    {"#000", "#e8e8e8"},    {"#111", "#e8e8e8"},    {"#222", "#e8e8e8"},
    {"#111111", "#e8e8e8"}, {"#444", "#b9bec5"},    {"#666", "#b9bec5"},    {"#777777", "#a3a8af"},
    {"#888", "#8b9199"},    {"#ddd", "#3a4048"},    {"#e4e4e4", "#30363d"}, {"#3b6ea8", "#6ea6e0"},
    {"#c4732b", "#e69a58"}, {"#b03a48", "#ec7582"}, {"#4d8f4d", "#74bd74"}, {"#7a5aa6", "#b093de"},
    {"#1f8f8f", "#45bdbd"}, {"#8a6d3b", "#c4a468"}, {"#c2559d", "#e586c4"}, {"#d01c2a", "#f4606b"}};

/* Rules are stronger than attributes, so one a colour is all that a dark page needs. */
static inline void svg_style(FILE *f) {
    size_t i;
    fprintf(f, "<style>@media (prefers-color-scheme:dark){\ntext:not([fill]){fill:%s}\n",
            svg_schemes[1][1]);
    for (i = 0; i < sizeof svg_schemes / sizeof *svg_schemes; ++i)
        fprintf(f, "[fill=\"%s\"]{fill:%s}[stroke=\"%s\"]{stroke:%s}\n", svg_schemes[i][0],
                svg_schemes[i][1], svg_schemes[i][0], svg_schemes[i][1]);
    fprintf(f, "}</style>\n");
}

static inline FILE *svg_open(const char *folder, const char *name, int width, int height,
                             const char *title) {
    char path[5000];
    FILE *f;
    snprintf(path, sizeof path, "%s/charts/%s", folder, name);
    f = fopen(path, "w");
    if (!f) {
        fprintf(stderr, "cannot write %s\n", path);
        exit(2);
    }
    fprintf(f,
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 %d %d\" role=\"img\" "
            "font-family=\"sans-serif\" font-size=\"13\">\n<title>%s</title>\n",
            width, height, title);
    svg_style(f);
    fprintf(f,
            "<rect width=\"%d\" height=\"%d\" fill=\"#fff\"/>\n"
            "<text x=\"70\" y=\"24\" font-size=\"16\">%s</text>\n",
            width, height, title);
    return f;
}

static inline void svg_close(FILE *f) {
    fprintf(f, "</svg>\n");
    fclose(f);
}

/* anchor: "start", "middle" or "end". What is printed must be well-formed XML. */
static inline void svg_text(FILE *f, double x, double y, int size, const char *anchor,
                            const char *colour, const char *format, ...) {
    va_list list;
    fprintf(f, "<text x=\"%.1f\" y=\"%.1f\" font-size=\"%d\" text-anchor=\"%s\" fill=\"%s\">", x, y,
            size, anchor, colour);
    va_start(list, format);
    vfprintf(f, format, list);
    va_end(list);
    fprintf(f, "</text>\n");
}

/* The area of a chart in pixels, y downwards, and what its edges stand for. */
typedef struct svg_axes {
    double left, top, right, bottom;
    double x0, x1, y0, y1; /* at the left, right, bottom, top */
    int log_x, log_y;
} svg_axes;

static inline double svg_part(double v, double from, double to, int logarithmic) {
    if (!logarithmic) return (v - from) / (to - from);
    return log(fmax(v, 1e-30) / from) / log(to / from);
}

/* Clamped a little outside the area. */
static inline double svg_x(const svg_axes *a, double v) {
    double part = svg_part(v, a->x0, a->x1, a->log_x);
    return a->left + (a->right - a->left) * fmin(fmax(part, -0.02), 1.02);
}

static inline double svg_y(const svg_axes *a, double v) {
    double part = svg_part(v, a->y0, a->y1, a->log_y);
    return a->bottom + (a->top - a->bottom) * fmin(fmax(part, -0.02), 1.02);
}

/* A grid line across the area; label NULL: none. */
static inline void svg_tick_x(FILE *f, const svg_axes *a, double v, const char *label) {
    double x = svg_x(a, v);
    fprintf(f, "<path d=\"M%.1f %.1fV%.1f\" stroke=\"#e4e4e4\"/>\n", x, a->top, a->bottom);
    if (label) svg_text(f, x, a->bottom + 16, 11, "middle", "#444", "%s", label);
}

static inline void svg_tick_y(FILE *f, const svg_axes *a, double v, const char *label) {
    double y = svg_y(a, v);
    fprintf(f, "<path d=\"M%.1f %.1fH%.1f\" stroke=\"#e4e4e4\"/>\n", a->left, y, a->right);
    if (label) svg_text(f, a->left - 6, y + 4, 11, "end", "#444", "%s", label);
}

static inline void svg_frame(FILE *f, const svg_axes *a) {
    fprintf(f,
            "<rect x=\"%.1f\" y=\"%.1f\" width=\"%.1f\" height=\"%.1f\" fill=\"none\" "
            "stroke=\"#888\"/>\n",
            a->left, a->top, a->right - a->left, a->bottom - a->top);
}

/* style: more attributes of the path, or "". */
static inline void svg_line(FILE *f, const svg_axes *a, const double *x, const double *y, int count,
                            const char *colour, double width, const char *style) {
    int i;
    if (!count) return;
    fprintf(f, "<path fill=\"none\" stroke=\"%s\" stroke-width=\"%g\" %s d=\"", colour, width,
            style);
    for (i = 0; i < count; ++i)
        fprintf(f, "%c%.1f %.1f", i ? 'L' : 'M', svg_x(a, x[i]), svg_y(a, y[i]));
    fprintf(f, "\"/>\n");
}

static inline void svg_dot(FILE *f, const svg_axes *a, double x, double y, double radius,
                           const char *fill, const char *stroke) {
    fprintf(f,
            "<circle cx=\"%.1f\" cy=\"%.1f\" r=\"%g\" fill=\"%s\" stroke=\"%s\" "
            "stroke-width=\"1.5\"/>\n",
            svg_x(a, x), svg_y(a, y), radius, fill, stroke);
}

static inline void svg_bar(FILE *f, double x, double y, double width, double height,
                           const char *colour) {
    fprintf(f, "<rect x=\"%.1f\" y=\"%.1f\" width=\"%.1f\" height=\"%.1f\" fill=\"%s\"/>\n", x, y,
            fmax(width, 0.5), height, colour);
}

#endif /* SVG_H */
