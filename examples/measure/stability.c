/* stability.c - where methods fail: every one of them driven into its bad region, beside what the
   library does there.

   usage: stability DOCS
   Prints the tables of docs/stability.md and writes them between its marks; draws the charts
   DOCS/charts/stability-*.svg, DOCS/charts/density*.svg and the pictures
   DOCS/images/stability-*.png, DOCS/images/density.png. `make stability` runs it; it takes about a
   minute and says on stderr how far it is.

   What you will see: lines that leave a chart where a method fails, and pictures with the fault
   beside the truth.

   >>tools >>charts >>density >>maps >>lobes >>methods >>surfaces >>numbers >>main

   SPDX-License-Identifier: MIT */

#define _POSIX_C_SOURCE 200809L
#include <stdarg.h>

#include "measure.h" /* with the implementation of envmap.h */

#include "../tool/brdfs.h"
#include "../methods/box_levels.h"
#include "../methods/cabral.h"
#include "../methods/faults.h"
#include "../methods/importance_sampling.h"
#include "../methods/paraboloid_convolution.h"
#include "../methods/separable_gaussian.h"
#include "../tool/picture.h"
#include "../tool/scenes.h"
#include "svg.h"

#define PI 3.14159265358979323846

/* ----------------------------------------------------------------------------------- >>tools -- */

static const char *docs;
static envmap skies[SCENE_COUNT]; /* cubes of edge 128 */
static const char *const mapping_name[] = {"cube",     "paraboloid", "sphere",
                                           "lat-long", "angular",    "octahedral"};

/* A scene in some parameterization and size, all its levels to be built. */
static envmap view_of(int scene, int mapping, int size) {
    envmap map = measure_map(mapping, size, envmap_levels(size), 1);
    measure_must(envmap_resample(&map, skies + scene, NULL), "resample");
    return map;
}

static void filter_by(envmap *dst, const envmap *src, const envmap_lobe *lobe, int method,
                      double tolerance) {
    envmap_filter_desc desc = {0};
    desc.method = method, desc.tolerance = (float)tolerance;
    measure_must(envmap_filter(dst, src, lobe, &desc), "filter");
}

static envmap filtered(const envmap *src, envmap_lobe lobe, int size) {
    envmap map = measure_map(ENVMAP_CUBE, size, 1, 1);
    filter_by(&map, src, &lobe, ENVMAP_METHOD_AUTO, 1e-4);
    return map;
}

static envmap_difference apart(const envmap *a, const envmap *b) {
    envmap_difference d;
    measure_must(envmap_compare(&d, a, b, 0), "compare");
    return d;
}

static double at_random(unsigned long long *state) {
    *state = *state * 6364136223846793005ull + 1442695040888963407ull;
    return (double)(*state >> 33) / 2147483648.0;
}

static void random_direction(double d[3], unsigned long long *state) {
    double z = 2 * at_random(state) - 1, a = 2 * PI * at_random(state), s = sqrt(1 - z * z);
    d[0] = s * cos(a), d[1] = s * sin(a), d[2] = z;
}

static double angle_of(const float a[3], const float b[3]) {
    double p[3], q[3];
    measure_unit_float(p, a), measure_unit_float(q, b);
    return measure_angle(p, q);
}

/* A line on stderr that says how far this is. */
static void progress(const char *what) {
    fprintf(stderr, "stability: %5.1f s  %s\n", measure_seconds(), what);
}

static measure_document document;

static FILE *begin(const char *name) { return measure_begin(&document, name); }

static void end(FILE *file) { measure_end(&document, file, 1); }

/* A line of the table of contents: the title of a section, how badly it gets | the library. */
static char contents[1 << 13];

static void note(const char *title, const char *format, ...) {
    size_t used = strlen(contents);
    char anchor[80];
    int n = 0;
    va_list list;
    for (const char *c = title; *c && n < 79; ++c)
        anchor[n++] = *c == ' ' ? '-' : (char)(*c >= 'A' && *c <= 'Z' ? *c + 32 : *c);
    anchor[n] = 0;
    used +=
        (size_t)snprintf(contents + used, sizeof contents - used, "| [%s](#%s) | ", title, anchor);
    va_start(list, format);
    used += (size_t)vsnprintf(contents + used, sizeof contents - used, format, list);
    va_end(list);
    snprintf(contents + used, sizeof contents - used, " |\n");
}

/* ---------------------------------------------------------------------------------- >>charts -- */

typedef struct chart_axis {
    const char *name;
    double from, to;
    int log; /* 1: decades; else ticks at so many steps */
    int steps;
} chart_axis;

typedef struct chart {
    FILE *file;
    svg_axes axes;
    int lines, below, above; /* below, above: data that leave the frame */
} chart;

static void chart_ticks(const chart *c, const chart_axis *a, int vertical) {
    int n = a->log ? (int)(log10(a->to / a->from) + 0.5) : a->steps, step = 1 + n / 12;
    for (int i = 0; i <= n; i += step) {
        double v = a->log ? a->from * pow(10, i) : (a->from * (n - i) + a->to * i) / n;
        char label[32];
        snprintf(label, sizeof label, "%g", fabs(v) < 1e-12 ? 0 : v);
        if (vertical) svg_tick_y(c->file, &c->axes, v, label);
        else svg_tick_x(c->file, &c->axes, v, label);
    }
}

static chart chart_open(const char *name, const char *title, chart_axis x, chart_axis y) {
    chart c = {NULL, {80, 65, 500, 335, x.from, x.to, y.from, y.to, x.log, y.log}, 0, 0, 0};
    char file[128];
    snprintf(file, sizeof file, "%s.svg", name);
    c.file = svg_open(docs, file, 740, 385, title);
    svg_text(c.file, 290, 376, 13, "middle", "#222", "%s", x.name);
    svg_text(c.file, 70, 46, 13, "start", "#666", "%s", y.name);
    chart_ticks(&c, &x, 0), chart_ticks(&c, &y, 1);
    return c;
}

/* Says beside the frame where lines leave it; they are drawn along its edge there. */
static void chart_close(chart *c) {
    if (c->below)
        svg_text(c->file, 512, 335, 11, "start", "#666", "on the lower edge: below %g", c->axes.y0);
    if (c->above)
        svg_text(c->file, 512, 54, 11, "start", "#666", "on the upper edge: above %g", c->axes.y1);
    svg_close(c->file);
}

/* dash NULL: solid. The label, one line or two around a '|', stands on the right. */
static void chart_line(chart *c, const char *label, const char *dash, const double *x,
                       const double *y, int count) {
    const char *colour = svg_colours[c->lines % COUNT(svg_colours)], *second = strchr(label, '|');
    int at = 76 + 36 * c->lines++;
    char style[64] = "";
    if (dash) snprintf(style, sizeof style, "stroke-dasharray=\"%s\"", dash);
    svg_line(c->file, &c->axes, x, y, count, colour, 2, style);
    for (int i = 0; i < count; ++i) c->below |= y[i]<c->axes.y0, c->above |= y[i]> c->axes.y1;
    fprintf(c->file, "<path d=\"M512 %dh22\" stroke=\"%s\" stroke-width=\"2\" %s/>\n", at - 4,
            colour, style);
    svg_text(c->file, 540, at, 13, "start", colour, "%.*s",
             second ? (int)(second - label) : (int)strlen(label), label);
    if (second) svg_text(c->file, 540, at + 15, 13, "start", colour, "%s", second + 1);
}

/* Values from `from` to `to` in equal ratios, or in equal steps where from is not positive. */
static void spread(double *x, int count, double from, double to) {
    for (int i = 0; i < count; ++i) {
        double t = (double)i / (count - 1);
        x[i] = from > 0 ? from * pow(to / from, t) : from + (to - from) * t;
    }
}

/* ---------------------------------------------------------------------------------- pictures -- */

static const unsigned paper = 0x15171Cu, ink = 0xF3F1ECu;

static picture sheet_of(int width, int height) {
    picture p;
    if (!picture_create(&p, width, height)) measure_must(ENVMAP_ERROR_MEMORY, "picture");
    picture_rectangle(&p, 0, 0, width, height, paper, 1);
    return p;
}

static void sheet_save(picture *p, const char *name) {
    char path[5000];
    snprintf(path, sizeof path, "%s/images/%s.png", docs, name);
    if (!picture_save(p, path)) measure_must(ENVMAP_ERROR_FILE, path);
    picture_free(p);
}

/* Panoramas of what a function of the direction sees. */
typedef struct looker {
    void (*look)(float rgb[3], const float dir[3], const struct looker *l);
    const envmap *map;
    float level, shift;
} looker;

static void look_alone(float rgb[3], const float dir[3], const looker *l) {
    method_lookup_face(rgb, l->map, dir, l->level, l->shift);
}

static void look_across(float rgb[3], const float dir[3], const looker *l) {
    envmap_lookup(rgb, l->map, dir, l->level);
}

static int panorama_point(float rgb[3], float s, float t, const void *user) {
    const looker *l = (const looker *)user;
    float dir[3];
    envmap_direction(dir, ENVMAP_LATLONG, 0, s, t);
    l->look(rgb, dir, l);
    return 1;
}

/* ------------------------------------------------------------------------------- >>density -- */

/* On a face of the octahedron a texel's sides are (2, -2, 0) and (0, -2, 2) in its corners' axes; of
   these the part across d, over |p|. */
static void octahedral_sides(double *longer, double *shorter, const double d[3]) {
    double x = fabs(d[0]), y = fabs(d[1]), z = fabs(d[2]), scale = 4 * pow(x + y + z, 2);
    double uu = scale * (2 - (x - y) * (x - y)), vv = scale * (2 - (z - y) * (z - y));
    double uv = scale * (1 - (x - y) * (z - y)), root = hypot((uu - vv) / 2, uv);
    *longer = sqrt((uu + vv) / 2 + root), *shorter = sqrt((uu + vv) / 2 - root);
}

/* The two sides of a texel at d, in units of a texel whose mean over the sphere is one steradian:
   the singular values of d(direction)/d(u, v), in closed form. Returns their product, the solid
   angle. */
static double texel_sides(double *longer, double *shorter, int mapping, const double d[3]) {
    static const double area[] = {6, 2 * PI / 4, PI / 4, 2, PI / 4, 1}; /* texels / size^2 */
    double scale = sqrt(area[mapping] / (4 * PI)), a, b, angle;
    switch (mapping) {
    case ENVMAP_CUBE: /* across and along the radius on the face, which is 1 / a at the texel */
        a = fmax(fabs(d[0]), fmax(fabs(d[1]), fabs(d[2])));
        b = 2 * a * a, a *= 2;
        break;
    case ENVMAP_PARABOLOID: a = b = 2 * (1 + fabs(d[2])); break; /* stereographic */
    case ENVMAP_SPHERE: /* along and across the radius, at half the angle to +z */
        b = sqrt(fmax((1 + d[2]) / 2, 0));
        a = 4 / b, b *= 4;
        break;
    case ENVMAP_OCTAHEDRAL: octahedral_sides(&a, &b, d); break;
    case ENVMAP_LATLONG: a = PI, b = PI * sqrt(fmax(1 - d[1] * d[1], 0)); break;
    default: /* along and across the radius, at the angle to -z */
        angle = acos(fmin(fmax(-d[2], -1), 1));
        a = 2 * PI, b = angle > 0 ? 2 * PI * sin(angle) / angle : 2 * PI;
    }
    *longer = scale * a, *shorter = scale * b;
    return *longer * *shorter;
}

enum { SPHERE = 40000 }; /* directions, evenly spread */

static void even_direction(double d[3], int i) {
    double z = 1 - (2 * i + 1.0) / SPHERE, a = i * 2.39996322972865332, s = sqrt(1 - z * z);
    d[0] = s * cos(a), d[1] = z, d[2] = s * sin(a);
}

static int rising(const void *a, const void *b) {
    double x = *(const double *)a, y = *(const double *)b;
    return x < y ? -1 : x > y;
}

static double density_of[ENVMAP_MAPPING_COUNT][SPHERE], longest_of[ENVMAP_MAPPING_COUNT][SPHERE],
    stretch_of[ENVMAP_MAPPING_COUNT][SPHERE];

static void measure_density(int mapping) {
    for (int i = 0; i < SPHERE; ++i) {
        double d[3], longer, shorter;
        even_direction(d, i);
        density_of[mapping][i] = 1 / texel_sides(&longer, &shorter, mapping, d);
        longest_of[mapping][i] = longer;
        stretch_of[mapping][i] = longer / shorter;
    }
    qsort(density_of[mapping], SPHERE, sizeof(double), rising);
    qsort(longest_of[mapping], SPHERE, sizeof(double), rising);
    qsort(stretch_of[mapping], SPHERE, sizeof(double), rising);
}

static void density_chart(const char *name, const char *title, chart_axis y,
                          double values[ENVMAP_MAPPING_COUNT][SPHERE]) {
    chart_axis x = {"share of the sphere", 0, 1, 0, 5};
    chart c = chart_open(name, title, x, y);
    for (int m = 0; m < ENVMAP_MAPPING_COUNT; ++m) {
        double at[201], value[201];
        spread(at, 201, 0, 1);
        for (int i = 0; i < 201; ++i) value[i] = values[m][i * (SPHERE - 1) / 200];
        chart_line(&c, mapping_name[m], NULL, at, value, 201);
    }
    chart_close(&c);
}

static void density_table(void) {
    static const char *const bound[] = {"3√3 = 5.196", "4", "1", "∞", "∞", "3√3 = 5.196"};
    static const double outside[] = {0, 1 - PI / 4, 1 - PI / 4, 0, 1 - PI / 4, 0};
    FILE *out = begin("density");
    fprintf(out,
            "| map | densest over sparsest | on 98 %% of the sphere | longest over shortest side "
            "of a texel, 98 %% | longest side over that of a square, 98 %% | texels outside the "
            "rim |\n|---|--:|--:|--:|--:|--:|\n");
    for (int m = 0; m < ENVMAP_MAPPING_COUNT; ++m) {
        int low = SPHERE / 100, high = SPHERE - 1 - low;
        fprintf(out, "| %s | %s | %.2f | %.2f | %.2f | %.0f %% |\n", mapping_name[m], bound[m],
                density_of[m][high] / density_of[m][low], stretch_of[m][SPHERE * 98 / 100],
                longest_of[m][SPHERE * 98 / 100], 100 * outside[m]);
    }
    end(out);
}

/* Blue where texels are too few, white where they are the mean, red where too many: log2, to 8. */
static void density_colour(float rgb[3], double density) {
    float t = (float)fmin(fmax(log2(density) / 3, -1), 1), k = fabsf(t);
    rgb[0] = t < 0 ? 1 - 0.85f * k : 1 - 0.20f * k;
    rgb[1] = t < 0 ? 1 - 0.60f * k : 1 - 0.80f * k;
    rgb[2] = t < 0 ? 1 - 0.25f * k : 1 - 0.80f * k;
}

/* A ball with the texels of a map of 12 x 12: seen from a side, or from the opposite one. */
typedef struct density_ball {
    int mapping;
    double from[3], right[3], up[3];
} density_ball;

static int density_point(float rgb[3], double s, double t, const density_ball *b) {
    double x = 2 * s - 1, y = 1 - 2 * t, r2 = x * x + y * y, d[3], longer, shorter, edge = 1;
    float dir[3], uv[2];
    int face;
    if (r2 > 1) return 0;
    for (int k = 0; k < 3; ++k) d[k] = x * b->right[k] + y * b->up[k] + sqrt(1 - r2) * b->from[k];
    double density = 1 / texel_sides(&longer, &shorter, b->mapping, d);
    for (int k = 0; k < 3; ++k) dir[k] = (float)d[k];
    envmap_coordinates(&face, uv, uv + 1, b->mapping, dir);
    for (int k = 0; k < 2; ++k) { /* the distance to the next line, in texels */
        double at = (double)uv[k] * (b->mapping == ENVMAP_LATLONG && !k ? 24 : 12);
        edge = fmin(edge, fabs(at - floor(at + 0.5)));
    }
    density_colour(rgb, density);
    for (int k = 0; k < 3; ++k) rgb[k] *= edge < 0.045 ? 0.35f : 1;
    return 1;
}

static void density_draw(picture *p, int left, int top, int side, const density_ball *b) {
    for (int y = 0; y < side; ++y)
        for (int x = 0; x < side; ++x) {
            float sum[3] = {0, 0, 0}, rgb[3];
            int hits = 0;
            for (int k = 0; k < 16; ++k) {
                double s = (x + (k % 4 + 0.5) / 4) / side, t = (y + (k / 4 + 0.5) / 4) / side;
                if (!density_point(rgb, s, t, b)) continue;
                for (int c = 0; c < 3; ++c) sum[c] += rgb[c];
                ++hits;
            }
            unsigned colour = 0;
            for (int c = 0; c < 3 && hits; ++c)
                colour = colour << 8 | (unsigned)(255 * sum[c] / (float)hits + 0.5f);
            picture_blend(p, left + x, top + y, colour, (float)hits / 16);
        }
}

static void density_picture(void) {
    picture p = sheet_of(1080, 470);
    static const double from[2][3] = {{0.42, 0.42, 0.805}, {-0.42, 0.42, -0.805}};
    for (int m = 0; m < ENVMAP_MAPPING_COUNT; ++m)
        for (int side = 0; side < 2; ++side) {
            density_ball b = {m, {0, 0, 0}, {0, 0, 0}, {0, 0, 0}};
            double flat = hypot(from[side][0], from[side][2]), n = hypot(flat, from[side][1]);
            for (int k = 0; k < 3; ++k) b.from[k] = from[side][k] / n;
            b.right[0] = from[side][2] / flat, b.right[2] = -from[side][0] / flat;
            for (int k = 0; k < 3; ++k) b.up[k] = -b.from[1] * from[side][k] / flat;
            b.up[1] = flat / n;
            density_draw(&p, 20 + 175 * m, 44 + 178 * side, 160, &b);
            if (!side) picture_caption(&p, (float)(100 + 175 * m), 18, 13, ink, mapping_name[m]);
        }
    for (int i = 0; i < 360; ++i) {
        float rgb[3];
        unsigned colour = 0;
        density_colour(rgb, pow(2, 6.0 * i / 359 - 3));
        for (int c = 0; c < 3; ++c) colour = colour << 8 | (unsigned)(255 * rgb[c] + 0.5f);
        picture_rectangle(&p, 395 + i, 426, 1, 14, colour, 1);
    }
    picture_text(&p, 60, 428, 11, ink, "texels per steradian over the mean:   1/8");
    picture_text(&p, 770, 428, 11, ink, "8    above: from +z,  below: from -z");
    sheet_save(&p, "density");
}

static void density(void) {
    static const chart_axis d = {"texels per steradian over the mean", 0.1, 100, 1, 0};
    static const chart_axis l = {"longest side of a texel over that of a square", 0.1, 100, 1, 0};
    progress("density");
    for (int m = 0; m < ENVMAP_MAPPING_COUNT; ++m) measure_density(m);
    density_table();
    density_chart("density", "Sampling density, sorted over the sphere", d, density_of);
    density_chart("density-side", "The longest side of a texel, sorted over the sphere", l,
                  longest_of);
    density_picture();
}

/* ------------------------------------------------------------------------------------ >>maps -- */

/* There and back through float coordinates, the worst of a circle at delta about an axis. */
static double round_trip(int mapping, double sign, double delta) {
    double worst = 0;
    for (int i = 0; i < 400; ++i) {
        double a = 2 * PI * (i + 0.5) / 400;
        float d[3] = {(float)(sin(delta) * cos(a)), (float)(sin(delta) * sin(a)),
                      (float)(sign * cos(delta))},
              back[3], u, v;
        int face;
        envmap_coordinates(&face, &u, &v, mapping, d);
        envmap_direction(back, mapping, face, u, v);
        worst = fmax(worst, angle_of(d, back));
    }
    return worst;
}

static void round_trips(void) {
    enum { N = 61 };
    static const chart_axis ax = {"distance from the singular point, rad", 1e-6, 1, 1, 0};
    static const chart_axis ay = {"largest error of the round trip, rad", 1e-8, 1e-2, 1, 0};
    chart c = chart_open("stability-sphere", "Direction to float coordinates and back", ax, ay);
    double x[N], y[N], law[N];
    spread(x, N, 1e-6, 1);
    for (int i = 0; i < N; ++i) {
        double slip = 8 * 6e-8 * sqrt(2);
        y[i] = round_trip(ENVMAP_SPHERE, -1, x[i]);
        law[i] =
            x[i] * x[i] > slip ? x[i] - sqrt(x[i] * x[i] - slip) : sqrt(x[i] * x[i] + slip) - x[i];
    }
    chart_line(&c, "sphere map beside -z", NULL, x, y, N);
    note("The sphere map beside its rim",
         "%.0e rad at 1e-3 rad from -z | the same: it is in the "
         "floats; directions stay directions",
         round_trip(ENVMAP_SPHERE, -1, 1e-3));
    chart_line(&c, "its law", "6 4", x, law, N);
    for (int i = 0; i < N; ++i) y[i] = round_trip(ENVMAP_ANGULAR, 1, x[i]);
    chart_line(&c, "angular map beside +z", NULL, x, y, N);
    for (int i = 0; i < N; ++i) y[i] = round_trip(ENVMAP_PARABOLOID, -1, x[i]);
    chart_line(&c, "paraboloid beside -z", NULL, x, y, N);
    chart_close(&c);
}

/* Corners of a triangle of an edge about d. */
static void triangle_at(float corner[3][3], const double d[3], double edge, double turn) {
    float z[3] = {(float)d[0], (float)d[1], (float)d[2]}, x[3], y[3];
    method_frame(x, y, z);
    for (int k = 0; k < 3; ++k) {
        float a = (float)(turn + 2 * PI * k / 3), r = (float)(edge / sqrt(3.0));
        for (int c = 0; c < 3; ++c)
            corner[k][c] = cosf(r) * z[c] + sinf(r) * (cosf(a) * x[c] + sinf(a) * y[c]);
    }
}

/* Mean angle between what triangles look up by coordinates and by directions, rad. */
static double interpolation_error(int mapping, double edge) {
    unsigned long long state = 7;
    double sum = 0;
    for (int i = 0; i < 20000; ++i) {
        float corner[3][3], weight[3], wrong[3], right[3];
        double d[3];
        random_direction(d, &state);
        triangle_at(corner, d, edge, 6 * at_random(&state));
        weight[0] = (float)at_random(&state),
        weight[1] = (1 - weight[0]) * (float)at_random(&state);
        weight[2] = 1 - weight[0] - weight[1];
        fault_interpolated(wrong, mapping, (const float(*)[3])corner, weight);
        for (int c = 0; c < 3; ++c)
            right[c] =
                weight[0] * corner[0][c] + weight[1] * corner[1][c] + weight[2] * corner[2][c];
        sum += angle_of(wrong, right) / 20000;
    }
    return sum;
}

static void interpolation_chart(void) {
    enum { N = 17 };
    static const chart_axis ax = {"edge of the triangles, rad", 1e-2, 1, 1, 0};
    static const chart_axis ay = {"mean error, rad", 1e-5, 1, 1, 0};
    chart c = chart_open("stability-interpolation",
                         "Coordinates interpolated over triangles all over the sphere", ax, ay);
    double x[N], y[N];
    spread(x, N, 1e-2, 1);
    for (int m = 0; m < ENVMAP_MAPPING_COUNT; ++m) {
        for (int i = 0; i < N; ++i) y[i] = interpolation_error(m, x[i]);
        chart_line(&c, mapping_name[m], NULL, x, y, N);
    }
    for (int i = 0; i < N; ++i) y[i] = 1e-7;
    chart_line(&c, "directions: none", "2 5", x, y, N);
    chart_close(&c);
}

typedef struct triangle {
    const envmap *map;
    int mapping; /* -1: by direction */
    float corner[3][3];
} triangle;

static int triangle_point(float rgb[3], float s, float t, const void *user) {
    const triangle *tri = (const triangle *)user;
    float x = (s - 0.5f) * 1.1547005f, weight[3], dir[3]; /* corners at (0,0), (1,1), (0,1) */
    weight[0] = 1 - t, weight[1] = 0.5f * t + x * 0.8660254f, weight[2] = t - weight[1];
    for (int k = 0; k < 3; ++k)
        if (weight[k] < 0) return 0;
    for (int c = 0; c < 3; ++c)
        dir[c] = weight[0] * tri->corner[0][c] + weight[1] * tri->corner[1][c] +
                 weight[2] * tri->corner[2][c];
    if (tri->mapping >= 0) fault_interpolated(dir, tri->mapping, tri->corner, weight);
    envmap_lookup(rgb, tri->map, dir, 0);
    return 1;
}

static void interpolation_note(void) {
    note("Interpolated coordinates",
         "%.2f rad in the mean, lat-long, triangles of 0.1 rad | none: a "
         "lookup takes a direction",
         interpolation_error(ENVMAP_LATLONG, 0.1));
}

static void interpolation_picture(void) {
    static const struct {
        int mapping;
        const char *where;
        double d[3];
    } at[] = {{ENVMAP_LATLONG, "lat-long, seam", {0.12, 0.12, 1}},
              {ENVMAP_LATLONG, "lat-long, pole", {0.02, 1, -0.04}},
              {ENVMAP_CUBE, "cube, corner", {-1, 0.9, -1.1}},
              {ENVMAP_PARABOLOID, "paraboloid, rim", {0.97, 0.2, -0.08}},
              {ENVMAP_SPHERE, "sphere map, -z", {0.05, 0.04, -1}}};
    picture p = sheet_of(1080, 440);
    for (int i = 0; i < 5; ++i)
        for (int wrong = 0; wrong < 2; ++wrong) {
            triangle tri;
            double d[3];
            measure_unit(d, at[i].d);
            tri.map = skies + SCENE_STUDIO, tri.mapping = wrong ? at[i].mapping : -1;
            triangle_at(tri.corner, d, 0.9, 0.4);
            picture_draw(&p, 20 + 212 * i, 50 + 195 * wrong, 192, 166, 1.2f, triangle_point, &tri);
            if (!wrong) picture_caption(&p, (float)(116 + 212 * i), 20, 12, ink, at[i].where);
        }
    picture_text(&p, 20, 418, 11, ink,
                 "above: directions interpolated, as the library wants them;  "
                 "below: coordinates interpolated");
    sheet_save(&p, "stability-interpolation");
}

/* How much radiance differs around the pole of a lat-long map, the closer the less it may. */
static void poles(void) {
    enum { N = 33 };
    static const chart_axis ax = {"distance from the pole, rad (a texel is 0.025)", 1e-4, 1, 1, 0};
    static const chart_axis ay = {"largest less smallest on a circle, over the mean", 1e-4, 10, 1,
                                  0};
    chart c = chart_open("stability-pole", "Around the pole of a lat-long map of noise, 256 x 128",
                         ax, ay);
    double x[N], y[2][N];
    envmap map = measure_map(ENVMAP_LATLONG, 128, 1, 1);
    unsigned long long state = 19;
    for (size_t i = 0; i < method_floats(&map); ++i) map.texels[i] = (float)at_random(&state);
    spread(x, N, 1e-4, 1);
    for (int i = 0; i < N; ++i)
        for (int mended = 0; mended < 2; ++mended) {
            double least = 1e9, most = 0;
            for (int k = 0; k < 720; ++k) {
                double a = 2 * PI * (k + 0.5) / 720;
                float rgb[3], d[3] = {(float)(sin(x[i]) * cos(a)), (float)cos(x[i]),
                                      (float)(sin(x[i]) * sin(a))};
                if (mended) envmap_lookup(rgb, &map, d, 0);
                else method_lookup_face(rgb, &map, d, 0, 0);
                least = fmin(least, (double)rgb[1]), most = fmax(most, (double)rgb[1]);
            }
            y[mended][i] = 2 * (most - least) / (most + least);
        }
    chart_line(&c, "rows clamped at the pole", NULL, x, y[0], N);
    chart_line(&c, "library: the pole is|its row's mean", "6 4", x, y[1], N);
    chart_close(&c);
    note("Poles of a lat-long map",
         "%.1f of the mean on a circle of 1e-4 rad | %.2f, falling with the distance", y[0][0],
         y[1][0]);
    envmap_free(&map);
}

/* Levels of each face alone: steps at the edges. */
static void seams(void) {
    enum { LEVELS = 8 };
    static const chart_axis ax = {"level", 0, LEVELS - 1, 0, LEVELS - 1};
    static const chart_axis ay = {"largest step across an edge, over the mean of both sides", 0, 2,
                                  0, 4};
    chart c = chart_open("stability-seams", "Faces mipmapped alone", ax, ay);
    double x[LEVELS], alone[LEVELS], across[LEVELS], most[LEVELS] = {0};
    for (int s = 0; s < SCENE_COUNT; ++s) {
        envmap plain = view_of(s, ENVMAP_CUBE, 128), map = view_of(s, ENVMAP_CUBE, 128);
        char label[64];
        method_plain_levels(&plain);
        measure_must(envmap_mips_build(&map), "mips");
        for (int l = 0; l < LEVELS; ++l) {
            x[l] = l, alone[l] = fault_seam(&plain, (float)l, 1);
            across[l] = fault_seam(&map, (float)l, 0), most[l] = fmax(most[l], across[l]);
        }
        snprintf(label, sizeof label, "%s, faces alone", scene_name[s]);
        chart_line(&c, label, NULL, x, alone, LEVELS);
        if (s == SCENE_OVERCAST) {
            picture p = sheet_of(1080, 310);
            for (int k = 0; k < 2; ++k) {
                looker l = {k ? look_across : look_alone, k ? &map : &plain, 5, 0};
                picture_draw(&p, 20 + 530 * k, 20, 510, 255, 0.8f, panorama_point, &l);
                picture_caption(&p, 275 + 530 * (float)k, 288, 12, ink,
                                k ? "level 5: weighted, looked up across faces"
                                  : "level 5: each face alone");
            }
            sheet_save(&p, "stability-seams");
            note("Faces mipmapped alone", "steps of %.2f of the radiance, overcast, level 7 | %.1g",
                 alone[7], across[7]);
        }
        envmap_free(&plain), envmap_free(&map);
    }
    chart_line(&c, "library, all three", "6 4", x, most, LEVELS);
    chart_close(&c);
}

static double mean_at(const envmap *map, int level) {
    double sum = 0;
    for (int f = 0; f < envmap_faces(map->mapping); ++f)
        for (int y = 0; y < method_edge(map, level); ++y)
            for (int x = 0; x < method_width(map, level); ++x)
                sum += envmap_solid_angle(map, level, f, x, y) *
                       (double)envmap_texel(map, level, 0, f, x, y)[1];
    return sum / (4 * PI);
}

/* Boxes without weights: the mean of the sphere, level by level. */
static void drifts(void) {
    enum { LEVELS = 8 };
    static const chart_axis ax = {"level", 0, LEVELS - 1, 0, LEVELS - 1};
    static const chart_axis ay = {"mean radiance off by, of itself", 1e-8, 1, 1, 0};
    chart c =
        chart_open("stability-boxes", "Mip levels from boxes without weights, overcast", ax, ay);
    double x[LEVELS], y[LEVELS], most[LEVELS] = {0}, cube = 0;
    for (int m = 0; m < ENVMAP_MAPPING_COUNT; ++m) {
        envmap map = view_of(SCENE_OVERCAST, m, 128);
        double mean = mean_at(&map, 0);
        measure_must(envmap_mips_build(&map), "mips");
        for (int l = 0; l < LEVELS; ++l) most[l] = fmax(most[l], fabs(mean_at(&map, l) / mean - 1));
        method_plain_levels(&map);
        for (int l = 0; l < LEVELS; ++l)
            x[l] = l, y[l] = fmax(fabs(mean_at(&map, l) / mean - 1), 1e-8);
        chart_line(&c, mapping_name[m], NULL, x + 1, y + 1, LEVELS - 1);
        if (m == ENVMAP_CUBE) cube = y[LEVELS - 1];
        envmap_free(&map);
    }
    note("Boxes without weights", "the mean of a cube drifts %.1f %%, overcast | %.0e", 100 * cube,
         most[LEVELS - 1]);
    chart_line(&c, "library, all six", "6 4", x, most, LEVELS);
    chart_close(&c);
}

/* Lookups half a texel off, level by level; at the level that is looked up, right ones. */
static void half_texels(void) {
    enum { LEVELS = 7 };
    static const chart_axis ax = {"level", 0, LEVELS - 1, 0, LEVELS - 1};
    static const chart_axis ay = {"rms over that of the radiance, or rad", 1e-3, 10, 1, 0};
    chart c = chart_open("stability-half-texel", "Every lookup half a texel off", ax, ay);
    double x[LEVELS], y[LEVELS], angle[LEVELS];
    for (int s = 0; s < SCENE_COUNT; ++s) {
        envmap map = view_of(s, ENVMAP_CUBE, 128);
        measure_must(envmap_mips_build(&map), "mips");
        for (int l = 0; l < LEVELS; ++l) {
            double error = 0, sum = 0;
            for (int i = 0; i < SPHERE; i += 3) {
                float rgb[3], off[3], dir[3];
                double d[3];
                even_direction(d, i);
                for (int k = 0; k < 3; ++k) dir[k] = (float)d[k];
                method_lookup_face(off, &map, dir, (float)l, 0.5f);
                envmap_lookup(rgb, &map, dir, (float)l);
                error += pow((double)off[1] - (double)rgb[1], 2), sum += pow((double)rgb[1], 2);
            }
            x[l] = l, y[l] = sqrt(error / sum);
            angle[l] = sqrt(0.5) * method_cube_texel(128) * (1 << l);
        }
        chart_line(&c, scene_name[s], NULL, x, y, LEVELS);
        if (s == SCENE_OVERCAST)
            note("Half a texel off",
                 "rms %.1f %% at level 0, %.0f %% at level 6, overcast | 0 at "
                 "texel centres",
                 100 * y[0], 100 * y[6]);
        envmap_free(&map);
    }
    chart_line(&c, "the angle, rad:|(texel / root 2) 2^level", "6 4", x, angle, LEVELS);
    chart_close(&c);
}

/* A white world in paraboloids whose circles were drawn into black. */
static void rims(void) {
    enum { LEVELS = 7 };
    static const chart_axis ax = {"level", 0, LEVELS - 1, 0, LEVELS - 1};
    static const chart_axis ay = {"darkest lookup at the rim in a world of 1", 0, 1, 0, 5};
    chart c = chart_open("stability-rim", "Paraboloids with nothing outside the circle", ax, ay);
    double x[LEVELS], y[2][LEVELS];
    for (int mended = 0; mended < 2; ++mended) {
        envmap map = measure_map(ENVMAP_PARABOLOID, 128, 8, 1);
        for (size_t i = 0; i < method_floats(&map); ++i) map.texels[i] = 1;
        if (!mended) fault_empty_rims(&map), method_plain_levels(&map);
        else measure_must(envmap_mips_build(&map), "mips");
        for (int l = 0; l < LEVELS; ++l) {
            double least = 1;
            for (int i = 0; i < 1000; ++i) {
                float a = (float)i * 0.0062831853f, rgb[3];
                float d[3] = {cosf(a), sinf(a), i % 2 ? 1e-4f : -1e-4f};
                if (mended) envmap_lookup(rgb, &map, d, (float)l);
                else method_lookup_face(rgb, &map, d, (float)l, 0);
                least = fmin(least, (double)rgb[1]);
            }
            x[l] = l, y[mended][l] = least;
        }
        envmap_free(&map);
    }
    chart_line(&c, "black outside,|plain levels", NULL, x, y[0], LEVELS);
    chart_line(&c, "library", "6 4", x, y[1], LEVELS);
    chart_close(&c);
    note("Around a paraboloid", "%.2f at the rim of a world of 1, level 1 | %.2f", y[0][1],
         y[1][1]);
    picture p = sheet_of(1080, 310);
    for (int mended = 0; mended < 2; ++mended) {
        envmap map = view_of(SCENE_OVERCAST, ENVMAP_PARABOLOID, 128);
        if (!mended) fault_empty_rims(&map), method_plain_levels(&map);
        else measure_must(envmap_mips_build(&map), "mips");
        looker l = {mended ? look_across : look_alone, &map, 2, 0};
        picture_draw(&p, 20 + 530 * mended, 20, 510, 255, 0.8f, panorama_point, &l);
        picture_caption(&p, 275 + 530 * (float)mended, 288, 12, ink,
                        mended ? "level 2: the extended domain"
                               : "level 2: black outside the circle");
        envmap_free(&map);
    }
    sheet_save(&p, "stability-rim");
}

/* Energy that 8 bits keep, by the radiance that is white. */
static void eight_bits(void) {
    enum { N = 25 };
    static const chart_axis ax = {"radiance that is 255, over the mean", 0.1, 1e5, 1, 0};
    static const chart_axis ay = {"rms of Phong N = 100 after 8 bits", 1e-3, 1, 1, 0};
    chart c = chart_open("stability-8-bits", "Maps of 8 bits in [0,1]", ax, ay);
    double x[N], y[N], best = 1e9;
    spread(x, N, 0.1, 1e5);
    for (int s = 0; s < SCENE_COUNT; ++s) {
        envmap hdr = view_of(s, ENVMAP_CUBE, 64), map = view_of(s, ENVMAP_CUBE, 64);
        envmap truth = filtered(&hdr, envmap_lobe_phong(100), 16);
        double mean = mean_at(&hdr, 0);
        for (int i = 0; i < N; ++i) {
            memcpy(map.texels, hdr.texels, method_floats(&hdr) * sizeof(float));
            fault_eight_bits(&map, (float)(x[i] * mean));
            envmap dst = filtered(&map, envmap_lobe_phong(100), 16);
            y[i] = apart(&dst, &truth).rms;
            envmap_free(&dst);
        }
        chart_line(&c, scene_name[s], NULL, x, y, N);
        for (int i = 0; i < N; ++i)
            if (s == SCENE_SUN && y[i] < best) best = y[i];
        envmap_free(&hdr), envmap_free(&map), envmap_free(&truth);
    }
    note("Maps of 8 bits", "rms %.0f %% with a sun, at the best exposure | floats: none",
         100 * best);
    chart_close(&c);
    static const float white[4] = {0, 1, 30, 1000};
    picture p = sheet_of(1080, 300);
    for (int i = 0; i < 4; ++i) {
        char caption[64];
        envmap map = view_of(SCENE_SUN, ENVMAP_CUBE, 128);
        snprintf(caption, sizeof caption, i ? "8 bits, white = %g" : "floats", (double)white[i]);
        if (i) fault_eight_bits(&map, white[i]);
        envmap ball = filtered(&map, envmap_lobe_phong(60), 64);
        picture_ball(&p, 32 + 262 * i, 16, 230, 0.5f, &ball, PICTURE_BALL_REFLECTION);
        picture_caption(&p, 147 + 262 * (float)i, 268, 12, ink, caption);
        envmap_free(&map), envmap_free(&ball);
    }
    sheet_save(&p, "stability-8-bits");
}

static void maps(void) {
    progress("maps: round trips, coordinates");
    round_trips();
    poles();
    interpolation_note();
    interpolation_chart();
    interpolation_picture();
    progress("maps: seams, boxes, half texels");
    seams();
    rims();
    drifts();
    half_texels();
    progress("maps: 8 bits");
    eight_bits();
}

/* ----------------------------------------------------------------------------------- >>lobes -- */

/* A world of four bands of harmonics: what a lobe makes of it is known, for any lobe. */
enum { BANDS = 4 };
static double world_sh[3 * BANDS * BANDS];

static envmap world_of(int mapping, int size) {
    envmap map = measure_map(mapping, size, 1, 1);
    unsigned long long state = 11;
    for (int i = 0; i < 3 * BANDS * BANDS; ++i) world_sh[i] = i < 3 ? 8 : 2 * at_random(&state) - 1;
    measure_must(envmap_sh_fill(&map, 0, 0, world_sh, BANDS, 0, NULL), "fill");
    return map;
}

/* rms of the green channel over what the harmonics say, for the axes of a map's texels. */
typedef struct score {
    double error, sum;
} score;

static void score_add(score *s, double value, const double *lit, const double axis[3]) {
    double truth[3];
    measure_must(envmap_sh_evaluate(truth, lit, BANDS, axis), "evaluate");
    /* nothing over nothing counts as black */
    if (!(value < 1e30)) value = 0;
    s->error += pow(value - truth[1], 2), s->sum += truth[1] * truth[1];
}

static double score_of(const score *s) { return sqrt(s->error / s->sum); }

/* The i-th of 96 axes: the texels of a cube of 4 x 4. */
static void axis_of(double axis[3], int i) {
    envmap cube = {0};
    cube.mapping = ENVMAP_CUBE, cube.size = 4;
    measure_direction(axis, &cube, 0, i / 16, i % 4, i / 4 % 4);
}

static double library_error(const envmap *src, const envmap_lobe *lobe, const double *lit) {
    score s = {0, 0};
    envmap dst = measure_map(ENVMAP_CUBE, 4, 1, 1);
    filter_by(&dst, src, lobe, ENVMAP_METHOD_AUTO, 1e-5);
    for (int i = 0; i < 96; ++i) {
        double axis[3];
        axis_of(axis, i);
        score_add(&s, (double)envmap_texel(&dst, 0, 0, i / 16, i % 4, i / 4 % 4)[1], lit, axis);
    }
    envmap_free(&dst);
    return score_of(&s);
}

/* The same from texels as points; norm 0: over sum k w, else over norm. */
static double points_error(const fault_points *points, const envmap_lobe *lobe, const double *lit,
                           double norm, int floats) {
    score s = {0, 0};
    for (int i = 0; i < 96; ++i) {
        double axis[3], rgb[3], total;
        axis_of(axis, i);
        total = floats ? fault_float_sum(rgb, points, lobe->parameter, axis)
                       : fault_point_sum(rgb, points, lobe, axis);
        score_add(&s, rgb[1] / (norm > 0 ? norm : total), lit, axis);
    }
    return score_of(&s);
}

/* The first x from which on y stays above a bound. */
static double last_below(const double *x, const double *y, int n, double bound) {
    while (n > 1 && y[n - 2] > bound) --n;
    return x[n - 1];
}

static double largest(const double *y, int n) {
    double most = y[0];
    for (int i = 1; i < n; ++i) most = fmax(most, y[i]);
    return most;
}

static void exponents(void) {
    enum { N = 49 };
    static const chart_axis ax = {"N", 1e-3, 1e9, 1, 0};
    static const chart_axis ay = {"rms error (1: black, no texel's centre meets the lobe)", 1e-6, 1,
                                  1, 0};
    chart c = chart_open("stability-exponent", "Phong from N = 0.001 to 1e9, cube of 32", ax, ay);
    double x[N], y[3][N], lit[3 * BANDS * BANDS];
    envmap src = world_of(ENVMAP_CUBE, 32);
    fault_points points;
    if (!fault_points_create(&points, &src)) measure_must(ENVMAP_ERROR_MEMORY, "points");
    spread(x, N, 1e-3, 1e9);
    for (int i = 0; i < N; ++i) {
        envmap_lobe lobe = envmap_lobe_phong((float)x[i]);
        measure_must(envmap_sh_convolve(lit, world_sh, BANDS, &lobe, 0), "convolve");
        y[0][i] = points_error(&points, &lobe, lit, 0, 1);
        y[1][i] = points_error(&points, &lobe, lit, 0, 0);
        y[2][i] = library_error(&src, &lobe, lit);
    }
    note("Exponents from 0 to infinity", "rms 1 from N = %.0e on: black | %.0e for every N",
         last_below(x, y[0], N, 0.9), largest(y[2], N));
    chart_line(&c, "texels as points, floats", NULL, x, y[0], N);
    chart_line(&c, "texels as points, doubles", "6 4", x, y[1], N);
    chart_line(&c, "library", NULL, x, y[2], N);
    chart_close(&c);
    fault_points_free(&points), envmap_free(&src);
}

/* k one sigma from its axis, the cosine from float directions. */
static void float_directions(void) {
    enum { N = 29 };
    static const chart_axis ax = {"N", 1e2, 1e9, 1, 0};
    static const chart_axis ay = {"largest error of k at one sigma, of itself", 1e-9, 1, 1, 0};
    chart c = chart_open("stability-floats", "The cosine of an angle, rounded", ax, ay);
    double x[N], y[2][N], law[N];
    unsigned long long state = 3;
    spread(x, N, 1e2, 1e9);
    for (int i = 0; i < N; ++i) {
        y[0][i] = y[1][i] = 0, law[i] = fmin(6e-8 * x[i], 1);
        for (int k = 0; k < 2000; ++k) {
            double a[3], b[3], dot = 0, dots = 0;
            float z[3], p[3], q[3], dotf = 0;
            random_direction(a, &state);
            for (int j = 0; j < 3; ++j) z[j] = (float)a[j];
            method_frame(p, q, z);
            for (int j = 0; j < 3; ++j) b[j] = a[j] + (double)p[j] / sqrt(x[i]);
            measure_unit(b, b), measure_unit(a, a);
            double truth = pow(cos(measure_angle(a, b)), x[i]);
            for (int j = 0; j < 3; ++j)
                dot += a[j] * b[j], dotf += (float)a[j] * (float)b[j],
                    dots += (double)(float)a[j] * (double)(float)b[j];
            y[0][i] = fmax(y[0][i], fabs(pow((double)dotf, x[i]) / truth - 1));
            y[1][i] = fmax(y[1][i], fabs(pow(dot, x[i]) / truth - 1));
        }
    }
    note("Directions in floats", "k off by %.0e at N = 1e4, by %.1f at 1e7 | %.0e at 1e9", y[0][8],
         y[0][20], y[1][N - 1]);
    chart_line(&c, "float directions and product", NULL, x, y[0], N);
    chart_line(&c, "6e-8 N", "6 4", x, law, N);
    chart_line(&c, "doubles", NULL, x, y[1], N);
    chart_close(&c);
}

static void rings(void) {
    enum { N = 41 };
    static const chart_axis ax = {"1 - s (the ring gets thinner to the left)", 1e-5, 1, 1, 0};
    static const chart_axis ay = {"rms error (1: black, the ring meets no texel's centre)", 1e-5,
                                  10, 1, 0};
    chart c = chart_open("stability-banks", "Banks as s goes to 1, cube of 32", ax, ay);
    double x[N], y[2][N], lit[3 * BANDS * BANDS];
    envmap src = world_of(ENVMAP_CUBE, 32);
    fault_points points;
    if (!fault_points_create(&points, &src)) measure_must(ENVMAP_ERROR_MEMORY, "points");
    spread(x, N, 1e-5, 1);
    for (int at = 0; at < 2; ++at) {
        for (int i = 0; i < N; ++i) {
            envmap_lobe lobe = envmap_lobe_banks((float)fmin(1 - x[i], 0.99999));
            double norm = envmap_lobe_integral(&lobe, 0);
            lobe.p0 = lobe.p1 = at ? 1.0f : 0.3f;
            measure_must(envmap_sh_convolve(lit, world_sh, BANDS, &lobe, (double)lobe.p0),
                         "convolve");
            y[0][i] = points_error(&points, &lobe, lit, norm, 0);
            y[1][i] = library_error(&src, &lobe, lit);
        }
        if (at)
            note("Rings thinner than a texel",
                 "rms %.1f at s = 0.99999, t along v | %.0e; %.0e at "
                 "the worst s",
                 y[0][0], y[1][0], largest(y[1], N));
        chart_line(&c, at ? "texels as points, t along v" : "texels as points, v.t = 0.3",
                   at ? "6 4" : NULL, x, y[0], N);
        chart_line(&c, at ? "library, t along v" : "library, v.t = 0.3", at ? "6 4" : NULL, x, y[1],
                   N);
    }
    chart_close(&c);
    fault_points_free(&points), envmap_free(&src);
}

/* The part of a lobe below the horizon of n, its axis at an angle from n. */
static double below(const envmap_lobe *lobe, double angle) {
    double part = 0, all = 0, e = PI / 2 - angle;
    for (int i = 0; i < 4000; ++i) {
        double t = PI * (i + 0.5) / 4000, k = envmap_lobe_value(lobe, cos(t), 0) * sin(t);
        double q = sin(t) * cos(e) > 1e-12 ? cos(t) * sin(e) / (sin(t) * cos(e)) : 1e9;
        all += k, part += k * acos(fmin(fmax(q, -1), 1)) / PI;
    }
    return part / all;
}

static void horizons(void) {
    enum { N = 91 };
    static const chart_axis ax = {"angle of r_v from n, degrees", 0, 90, 0, 9};
    static const chart_axis ay = {"part of the lobe below the horizon", 0, 0.5, 0, 5};
    chart c = chart_open("stability-horizon", "What a map without n cannot cut off", ax, ay);
    envmap_lobe lobes[5] = {envmap_lobe_phong(5), envmap_lobe_phong(50), envmap_lobe_phong(500),
                            envmap_lobe_ggx(0.1f), envmap_lobe_ggx(0.5f)};
    static const char *const names[5] = {"Phong N = 5", "Phong N = 50", "Phong N = 500",
                                         "GGX alpha = 0.1", "GGX alpha = 0.5"};
    double x[N], y[N];
    spread(x, N, 0, 90);
    for (int k = 0; k < 5; ++k) {
        for (int i = 0; i < N; ++i) y[i] = below(lobes + k, x[i] * PI / 180);
        chart_line(&c, names[k], NULL, x, y, N);
    }
    note("Light below the horizon",
         "%.0f %% of Phong N = 50 at 80 degrees, half at 90 | the same: a "
         "map has no n; eq. 1 has",
         100 * below(lobes + 1, 80 * PI / 180));
    for (int i = 0; i < N; ++i) y[i] = 0.5;
    chart_line(&c, "Banks, t across n", "6 4", x, y, N);
    chart_close(&c);
}

/* A lamp of a share of all light in an even sky, through so many bands: lowest over mean. */
static double lowest_of(double *moved, int bands, double share, int window) {
    double sh[3 * 36] = {0}, basis[36], least = 1e9;
    static const double up[3] = {0, 0, 1};
    envmap_lobe diffuse = envmap_lobe_diffuse();
    measure_must(envmap_sh_basis(basis, bands, up), "basis");
    for (int i = 0; i < 3 * bands * bands; ++i) sh[i] = share * basis[i / 3];
    for (int c = 0; c < 3; ++c) sh[c] += (1 - share) * basis[0];
    if (window) measure_must(envmap_sh_window(sh, moved, sh, bands, &diffuse, 0), "window");
    measure_must(envmap_sh_convolve(sh, sh, bands, &diffuse, 0), "convolve");
    for (int i = 0; i <= 720; ++i) {
        double t = PI * i / 720, d[3] = {sin(t), 0, cos(t)}, rgb[3];
        measure_must(envmap_sh_evaluate(rgb, sh, bands, d), "evaluate");
        least = fmin(least, rgb[1]);
    }
    return least * 4 * PI;
}

static void ringing(void) {
    enum { N = 51 };
    static const chart_axis ax = {"the lamp's share of all light", 0, 1, 0, 5};
    static const chart_axis ay = {"lowest irradiance over the mean; what the window moved, rms",
                                  -0.2, 1, 0, 6};
    chart c = chart_open("stability-ringing", "A lamp in an even sky, few bands", ax, ay);
    double x[N], y[N], moved[N];
    spread(x, N, 0, 1);
    for (int i = 0; i < N; ++i) y[i] = 1 - x[i];
    chart_line(&c, "exact", NULL, x, y, N);
    for (int bands = 3; bands <= 5; bands += 2) {
        for (int i = 0; i < N; ++i) y[i] = lowest_of(NULL, bands, x[i], 0);
        chart_line(&c, bands == 3 ? "3 bands" : "5 bands", NULL, x, y, N);
    }
    double deepest = lowest_of(NULL, 3, 1, 0);
    for (int i = 0; i < N; ++i) y[i] = lowest_of(moved + i, 3, x[i], 1);
    note("Ringing", "%.3f of the mean: negative light | %.0e, for %.2f moved", deepest,
         fabs(y[N - 1]) < 1e-6 ? 0 : y[N - 1], moved[N - 1]);
    chart_line(&c, "3 bands, windowed", "6 4", x, y, N);
    chart_line(&c, "moved by the window", "2 4", x, moved, N);
    chart_close(&c);
}

/* The paper's threshold under clouds, and with a sun. */
static void thresholds(void) {
    enum { N = 22 };
    static const int scenes[2] = {SCENE_OVERCAST, SCENE_SUN};
    static const chart_axis ax = {"N", 1, 1e7, 1, 0};
    static const chart_axis ay = {"error, relative", 1e-5, 1000, 1, 0};
    chart c = chart_open("stability-threshold",
                         "Hierarchical filtering, threshold 0.001, cube of 64", ax, ay);
    double x[N], y[3][N], fast[N];
    spread(x, N, 1, 1e7);
    for (int s = 0; s < 2; ++s) {
        envmap src = view_of(scenes[s], ENVMAP_CUBE, 64), dst = measure_map(ENVMAP_CUBE, 8, 1, 1);
        for (int i = 0; i < N; ++i) {
            envmap_lobe lobe = envmap_lobe_phong((float)x[i]);
            envmap truth = measure_map(ENVMAP_CUBE, 8, 1, 1);
            filter_by(&truth, &src, &lobe, ENVMAP_METHOD_REFERENCE, 0);
            filter_by(&dst, &src, &lobe, ENVMAP_METHOD_HIERARCHICAL, 0);
            envmap_difference d = apart(&dst, &truth);
            y[0][i] = d.rms, y[1][i] = d.worst, y[2][i] = fabs(d.bias);
            filter_by(&dst, &src, &lobe, ENVMAP_METHOD_AUTO, 0);
            fast[i] = apart(&dst, &truth).rms;
            envmap_free(&truth);
        }
        chart_line(&c, s ? "sun: rms" : "overcast: rms", NULL, x, y[0], N);
        chart_line(&c, s ? "sun: worst texel" : "overcast: worst texel", "6 4", x, y[1], N);
        if (s)
            note("A threshold on lobes",
                 "rms %.1f with a sun, worst texel %.0f times itself | %.0e "
                 "(AUTO)",
                 largest(y[0], N), largest(y[1], N), largest(fast, N));
        if (s) chart_line(&c, "sun: bias of the mean", "2 4", x, y[2], N);
        if (s) chart_line(&c, "sun: library (AUTO), rms", NULL, x, fast, N);
        envmap_free(&src), envmap_free(&dst);
    }
    chart_close(&c);
}

static void lobes(void) {
    progress("lobes: exponents");
    exponents();
    float_directions();
    progress("lobes: rings");
    rings();
    horizons();
    ringing();
    progress("lobes: thresholds");
    thresholds();
}

/* --------------------------------------------------------------------------------- >>methods -- */

static void clamps(void) {
    enum { N = 17 };
    static const chart_axis ax = {"N", 3, 3e4, 1, 0};
    static const chart_axis ay = {"energy lost; distortion at the rim", 0, 0.4, 0, 4};
    static const float cut[2] = {0.1f, 0.01f};
    chart c =
        chart_open("stability-clamp", "Two-map paraboloid filter: its clamp, its circles", ax, ay);
    double x[N], y[N], rim[N];
    envmap src = measure_map(ENVMAP_PARABOLOID, 32, 1, 1),
           dst = measure_map(ENVMAP_PARABOLOID, 2, 1, 1);
    for (size_t i = 0; i < method_floats(&src); ++i) src.texels[i] = 1;
    spread(x, N, 3, 3e4);
    for (int k = 0; k < 2; ++k) {
        for (int i = 0; i < N; ++i) {
            envmap_lobe lobe = envmap_lobe_phong((float)x[i]);
            method_desc desc = {0};
            desc.form = METHOD_PUBLISHED, desc.lossy = 1, desc.cut = cut[k];
            measure_must(method_paraboloid_convolution(&dst, &src, &lobe, &desc), "paraboloid");
            y[i] = 1 - (double)dst.texels[0];
            double t = acos(pow((double)cut[0], 1 / x[i]));
            rim[i] = paraboloid_distortion(1, 1 - tan((PI / 2 - t) / 2));
        }
        chart_line(&c, k ? "energy lost, clamp 0.01" : "energy lost, clamp 0.1", NULL, x, y, N);
    }
    note("Clamped kernels and circles",
         "10 %% of all energy lost, circles off by %.0f %% of their "
         "radius, N = 10 | no kernel, no clamp",
         100 * paraboloid_distortion(1, 260.0 / 512));
    chart_line(&c, "a circle's centre at the|rim, off by (clamp 0.1)", "6 4", x, rim, N);
    chart_close(&c);
    envmap_free(&src), envmap_free(&dst);
}

/* The heat kernel of a sigma as a table. */
static envmap_lobe heat(float table[2048], double sigma) {
    for (int i = 0; i < 2048; ++i) {
        double x = cos(PI * i / 2047), a = 1, b = x, sum = 1 + 3 * exp(-sigma * sigma) * x;
        for (int l = 2; 0.5 * l * (l + 1) * sigma * sigma < 40; ++l) {
            double next = ((2 * l - 1) * x * b - (l - 1) * a) / l;
            a = b, b = next;
            sum += (2 * l + 1) * exp(-0.5 * l * (l + 1) * sigma * sigma) * next;
        }
        table[i] = (float)(sum > 1e-9 ? sum : 0);
    }
    return envmap_lobe_table(table, 2048, 1, 0, 0);
}

/* A lamp on black, half-width 0.06 rad. */
static envmap lamp_at(double x, double y, double z, int size) {
    envmap map = measure_map(ENVMAP_CUBE, size, 1, 1);
    double axis[3] = {x, y, z};
    measure_unit(axis, axis);
    for (int i = 0; i < 6 * size * size; ++i) {
        double d[3];
        measure_direction(d, &map, 0, i / size / size, i % size, i / size % size);
        for (int c = 0; c < 3; ++c)
            map.texels[3 * i + c] = measure_angle(d, axis) < 0.06 ? 100.0f - 20.0f * (float)c : 0;
    }
    return map;
}

/* The separable Gaussian of a lamp, as published or mended; worst of the truth's peak. */
static double separable_error(const envmap *src, double sigma, int form, envmap *keep) {
    static float table[2048];
    envmap_lobe lobe = heat(table, sigma);
    envmap truth = filtered(src, lobe, 64), dst = measure_map(ENVMAP_CUBE, 64, 1, 1);
    method_desc desc = {0};
    double worst = 0, peak = 0;
    desc.form = form;
    measure_must(method_separable_gaussian(&dst, src, &lobe, &desc), "Gaussian");
    for (size_t i = 0; i < method_floats(&dst); ++i) {
        worst = fmax(worst, fabs((double)dst.texels[i] - (double)truth.texels[i]));
        peak = fmax(peak, (double)truth.texels[i]);
    }
    if (keep) keep[0] = truth, keep[1] = dst;
    else envmap_free(&truth), envmap_free(&dst);
    return worst / peak;
}

static void gaussians(void) {
    enum { N = 10 };
    static const chart_axis ax = {"sigma, rad", 0, 0.4, 0, 4};
    static const chart_axis ay = {"worst texel over the lamp's peak", 1e-4, 1, 1, 0};
    chart c = chart_open("stability-gaussian", "The separable Gaussian of a lamp", ax, ay);
    double x[N], y[N], worst[2] = {0, 0};
    for (int i = 0; i < N; ++i) x[i] = 0.05 + 0.31 * i / (N - 1);
    for (int corner = 0; corner < 2; ++corner) {
        envmap src = lamp_at(1, corner ? 1 : 0.1, corner ? 1 : 0.05, 64);
        for (int form = 1; form >= 0; --form) {
            char label[64];
            for (int i = 0; i < N; ++i) y[i] = separable_error(&src, x[i], form, NULL);
            snprintf(label, sizeof label, "%s, %s", form ? "stepped on the plane" : "exact flow",
                     corner ? "corner" : "centre");
            chart_line(&c, label, corner ? NULL : "6 4", x, y, N);
            worst[form] = fmax(worst[form], largest(y, N));
        }
        envmap_free(&src);
    }
    chart_close(&c);
    note("Gaussians stepped on the plane",
         "%.0f %% of a lamp's peak, sigma to 0.36 | %.1f %% along the "
         "flow",
         100 * worst[1], 100 * worst[0]);
    picture p = sheet_of(1080, 390);
    envmap src = lamp_at(1, 1, 1, 64), maps[2][2];
    for (int form = 0; form < 2; ++form) separable_error(&src, 0.3, form, maps[form]);
    for (int i = 0; i < 3; ++i) {
        static const char *const names[3] = {"the heat kernel, sigma = 0.3",
                                             "exact flow, mirrored order",
                                             "as published: steps on the plane"};
        picture_camera camera = {
            i ? &maps[i - 1][1] : &maps[0][0], 2.3562f, 0.6155f, 0.8f, 0.8f, 0};
        picture_draw(&p, 20 + 350 * i, 20, 330, 330, 0.5f, picture_camera_point, &camera);
        picture_caption(&p, 185 + 350 * (float)i, 364, 12, ink, names[i]);
    }
    sheet_save(&p, "stability-gaussian");
    for (int i = 0; i < 4; ++i) envmap_free(&maps[i / 2][i % 2]);
    envmap_free(&src);
}

static void fireflies(void) {
    static const int samples[3] = {16, 64, 1024};
    picture p = sheet_of(1080, 300);
    envmap src = view_of(SCENE_SUN, ENVMAP_CUBE, 128);
    envmap_lobe lobe = envmap_lobe_ggx(0.25f);
    envmap truth = measure_map(ENVMAP_CUBE, 32, 1, 1);
    filter_by(&truth, &src, &lobe, ENVMAP_METHOD_AUTO, 1e-4);
    double rms[4];
    for (int i = 0; i < 4; ++i) {
        envmap ball = measure_map(ENVMAP_CUBE, 32, 1, 1);
        char caption[64];
        method_desc desc = {0};
        snprintf(caption, sizeof caption, i < 3 ? "%d samples" : "envmap_filter", samples[i % 3]);
        desc.samples = samples[i % 3];
        if (i < 3) measure_must(method_importance_sampling(&ball, &src, &lobe, &desc), "sampling");
        else filter_by(&ball, &src, &lobe, ENVMAP_METHOD_AUTO, 0);
        rms[i] = apart(&ball, &truth).rms;
        picture_ball(&p, 32 + 262 * i, 16, 230, 0.35f, &ball, PICTURE_BALL_REFLECTION);
        picture_caption(&p, 147 + 262 * (float)i, 268, 12, ink, caption);
        envmap_free(&ball);
    }
    sheet_save(&p, "stability-fireflies");
    note("Fireflies", "rms %.0f %% with 16 samples, %.0f %% with 1024 | %.0e", 100 * rms[0],
         100 * rms[2], rms[3]);
    envmap_free(&src), envmap_free(&truth);
}

static void methods(void) {
    progress("methods: clamps, Gaussians");
    clamps();
    gaussians();
    progress("methods: fireflies");
    fireflies();
}

/* -------------------------------------------------------------------------------- >>surfaces -- */

static void grazing(void) {
    enum { N = 24 };
    static const chart_axis ax = {"n.v", 0, 1, 0, 5};
    static const chart_axis ay = {"rms of the fitted lobe, of the true one", 0, 1, 0, 5};
    chart c =
        chart_open("stability-grazing", "One round lobe for f_r n.l, by the angle of view", ax, ay);
    static const struct {
        const char *name;
        envmap_brdf_function *function;
        double alpha;
    } models[] = {{"GGX alpha = 0.1", brdf_ggx, 0.1},
                  {"GGX alpha = 0.3", brdf_ggx, 0.3},
                  {"Ward alpha = 0.2", brdf_ward, 0.2},
                  {"Lafortune N = 20", brdf_lafortune, 0.2}};
    for (int k = 0; k < COUNT(models); ++k) {
        brdf_values values = {{1, 1, 1}, models[k].alpha, models[k].alpha, 20, 0, 0};
        envmap_brdf brdf = {models[k].function, &values};
        double x[N], y[N];
        envmap_fit fit = {0};
        fit.lobes = 1, fit.slices = N;
        measure_must(envmap_fit_brdf(&fit, &brdf, NULL), "fit");
        for (int i = 0; i < N; ++i) x[i] = (i + 0.5) / N, y[i] = (double)fit.error[i];
        chart_line(&c, models[k].name, NULL, x, y, N);
        if (k == 1)
            note("Grazing angles",
                 "rms %.0f %% of GGX 0.3 at n.v = %.2f, %.0f %% at %.2f | `fit.error` "
                 "says so, slice by slice",
                 100 * y[0], x[0], 100 * y[N - 1], x[N - 1]);
        envmap_fit_free(&fit);
    }
    chart_close(&c);
}

/* eq. 1 between three stored views. */
static double cabral_error(const envmap *src, const envmap_brdf *brdf, int steps) {
    enum { LOOKS = 400 };
    static envmap_frame frames[LOOKS];
    static float truth[3 * LOOKS];
    unsigned long long state = 5;
    double error = 0, sum = 0;
    cabral set;
    for (int i = 0; i < LOOKS;) {
        double n[3], v[3];
        random_direction(n, &state), random_direction(v, &state);
        if (measure_dot(n, v) < 0.3) continue;
        memset(frames + i, 0, sizeof *frames);
        for (int k = 0; k < 3; ++k) frames[i].n[k] = (float)n[k], frames[i].v[k] = (float)v[k];
        ++i;
    }
    measure_must(envmap_radiance(truth, src, brdf, frames, LOOKS, NULL), "eq. 1");
    measure_must(cabral_create(&set, src, brdf, steps, 32, NULL), "Cabral");
    for (int i = 0; i < LOOKS; ++i) {
        float rgb[3];
        cabral_lookup(rgb, &set, frames[i].n, frames[i].v);
        error += pow((double)rgb[1] - (double)truth[3 * i + 1], 2);
        sum += pow((double)truth[3 * i + 1], 2);
    }
    cabral_free(&set);
    return sqrt(error / sum);
}

static void views(void) {
    enum { N = 4 };
    static const chart_axis ax = {"stored views", 0, 80, 0, 4};
    static const chart_axis ay = {"rms between the views, n.v over 0.3", 1e-3, 1, 1, 0};
    static const double alpha[2] = {0.6, 0.3};
    chart c = chart_open("stability-views", "The warp between stored views, in the studio", ax, ay);
    envmap src = measure_map(ENVMAP_CUBE, 16, 1, 1);
    measure_must(envmap_resample(&src, skies + SCENE_STUDIO, NULL), "resample");
    for (int k = 0; k < 2; ++k) {
        brdf_values values = {{1, 1, 1}, alpha[k], alpha[k], 20, 0, 0};
        envmap_brdf brdf = {brdf_ggx, &values};
        double x[N], y[N];
        char label[64];
        for (int i = 0; i < N; ++i)
            x[i] = 4 * (i + 1) * (i + 1) + 2, y[i] = cabral_error(&src, &brdf, i + 1);
        if (k)
            note("Between stored views",
                 "rms %.0f %% with 6, %.0f %% with 66, GGX 0.3 | "
                 "`envmap_radiance` where it counts",
                 100 * y[0], 100 * y[3]);
        snprintf(label, sizeof label, "GGX alpha = %g", alpha[k]);
        chart_line(&c, label, NULL, x, y, N);
    }
    chart_close(&c);
    envmap_free(&src);
}

/* A mirror ball of a radius in the middle of a world that is a sphere of radius 1, as a distant
   camera sees it: looked up as from the centre, or where the ray meets the world. */
typedef struct parallax {
    const envmap *map;
    float radius;
    int mended;
} parallax;

static int parallax_point(float rgb[3], float s, float t, const void *user) {
    const parallax *q = (const parallax *)user;
    float n[3] = {2 * s - 1, 1 - 2 * t, 0}, r[3], p[3], r2 = n[0] * n[0] + n[1] * n[1];
    if (r2 > 1) return 0;
    n[2] = sqrtf(1 - r2);
    r[0] = 2 * n[2] * n[0], r[1] = 2 * n[2] * n[1], r[2] = 2 * n[2] * n[2] - 1;
    for (int k = 0; k < 3; ++k) p[k] = q->radius * n[k];
    if (q->mended) fault_mended_parallax(r, p, r);
    envmap_lookup(rgb, q->map, r, 0);
    return 1;
}

static void parallaxes(void) {
    enum { N = 31 };
    static const chart_axis ax = {"distance of the surface from the map's centre, over the scene's",
                                  1e-3, 1, 1, 0};
    static const chart_axis ay = {"angle between what is looked up and what is seen, degrees", 0.01,
                                  100, 1, 0};
    chart c = chart_open("stability-parallax", "A map is seen from its centre only", ax, ay);
    double x[N], worst[N], mean[N];
    spread(x, N, 1e-3, 0.999);
    for (int i = 0; i < N; ++i) {
        worst[i] = asin(x[i]) * 180 / PI, mean[i] = 0;
        for (int k = 0; k < 2000; ++k) {
            double z = (k + 0.5) / 1000 - 1;
            float d[3] = {(float)sqrt(1 - z * z), 0, (float)z}, p[3] = {0, 0, (float)x[i]}, out[3];
            fault_mended_parallax(out, p, d);
            mean[i] += angle_of(d, out) * 180 / PI / 2000;
        }
    }
    note("Away from the centre",
         "%.0f degrees at a tenth of the scene's distance | the caller's: "
         "look up where the ray ends",
         asin(0.1) * 180 / PI);
    chart_line(&c, "worst, asin p", NULL, x, worst, N);
    chart_line(&c, "mean over directions", NULL, x, mean, N);
    chart_close(&c);
    picture p = sheet_of(1080, 300);
    for (int i = 0; i < 4; ++i) {
        static const char *const names[4] = {"from the centre: any size",
                                             "right, radius 0.05 of the room", "right, radius 0.3",
                                             "right, radius 0.7"};
        static const float radius[4] = {0, 0.05f, 0.3f, 0.7f};
        parallax q = {skies + SCENE_STUDIO, radius[i], i > 0};
        picture_draw(&p, 32 + 262 * i, 16, 230, 230, 1.2f, parallax_point, &q);
        picture_caption(&p, 147 + 262 * (float)i, 268, 12, ink, names[i]);
    }
    sheet_save(&p, "stability-parallax");
}

static void surfaces(void) {
    progress("surfaces: grazing angles, views");
    grazing();
    views();
    parallaxes();
}

/* --------------------------------------------------------------------------------- >>numbers -- */

/* What each call answers to a texel that is no radiance, and at the ends of floats. */
static const struct {
    const char *name;
    double value;
} inputs[] = {{"NaN", (double)NAN}, {"Inf", HUGE_VAL},  {"-1", -1},
              {"65504", 65504},     {"3.4e38", 3.4e38}, {"1e-38", 1e-38}};

enum {
    CREATE,
    MIPS,
    RESAMPLE,
    REFERENCE,
    HIERARCHICAL,
    FAST,
    LIMITED,
    PROJECT,
    RADIANCE,
    COMPARE,
    CALLS
};
static const char *const call_name[CALLS] = {
    "`envmap_pfm_read`",        "`envmap_mips_build`",
    "`envmap_resample`",        "`envmap_filter`, REFERENCE",
    "... HIERARCHICAL",         "... AUTO, FAST, HARMONICS",
    "... after `envmap_clean`", "`envmap_sh_project`",
    "`envmap_radiance`",        "`envmap_compare`"};

static envmap_result read_back(envmap *map, const envmap *src) {
    unsigned char file[4096];
    size_t bytes;
    envmap_free(map);
    measure_must(envmap_pfm_write(file, sizeof file, &bytes, src, 0), "write");
    return envmap_pfm_read(map, file, bytes, ENVMAP_CUBE);
}

static envmap_result call(int which, envmap *src, envmap *dst) {
    envmap_lobe lobe = envmap_lobe_phong(4);
    envmap_filter_desc desc = {0};
    envmap_difference difference;
    envmap_frame frame = {{0, 0, 1}, {1, 0, 0}, {0, 0, 1}};
    brdf_values white = {{1, 1, 1}, 0, 0, 0, 0, 0};
    envmap_brdf lambert = {brdf_lambert, &white};
    double sh[12];
    float rgb[3];
    desc.method = which == REFERENCE      ? ENVMAP_METHOD_REFERENCE
                  : which == HIERARCHICAL ? ENVMAP_METHOD_HIERARCHICAL
                                          : ENVMAP_METHOD_AUTO;
    if (which == LIMITED) envmap_clean(src, 1000, NULL);
    switch (which) {
    case CREATE: return read_back(dst, src);
    case MIPS: return envmap_mips_build(src);
    case RESAMPLE: return envmap_resample(dst, src, NULL);
    case PROJECT: return envmap_sh_project(sh, 2, src, 0, 0, NULL);
    case RADIANCE: return envmap_radiance(rgb, src, &lambert, &frame, 1, NULL);
    case COMPARE: return envmap_compare(&difference, src, dst, 0);
    default: return envmap_filter(dst, src, &lobe, &desc);
    }
}

static void inputs_table(void) {
    FILE *out = begin("inputs");
    fprintf(out, "| call |");
    for (int i = 0; i < COUNT(inputs); ++i) fprintf(out, " %s |", inputs[i].name);
    fprintf(out, "\n|---|");
    for (int i = 0; i < COUNT(inputs); ++i) fprintf(out, "---|");
    for (int k = 0; k < CALLS; ++k) {
        fprintf(out, "\n| %s |", call_name[k]);
        for (int i = 0; i < COUNT(inputs); ++i) {
            envmap src = measure_map(ENVMAP_CUBE, 4, 3, 1), dst = measure_map(ENVMAP_CUBE, 4, 1, 1);
            for (size_t t = 0; t < method_floats(&src); ++t) src.texels[t] = 1;
            src.texels[60] = (float)inputs[i].value;
            envmap_result result = call(k, &src, &dst);
            fprintf(out, " %s |",
                    !result                           ? "ok"
                    : result == ENVMAP_ERROR_RADIANCE ? "RADIANCE"
                                                      : "?");
            envmap_free(&src), envmap_free(&dst);
        }
    }
    fprintf(out, "\n");
    end(out);
    note("What is no radiance",
         "one NaN makes every filtered texel NaN | RADIANCE, or `envmap_clean`");
}

/* A mean over so many texels, the sum a float. */
static void float_sums(void) {
    enum { N = 16 };
    static const chart_axis ax = {"texels", 1e3, 1e8, 1, 0};
    static const chart_axis ay = {"mean off by, of itself", 1e-9, 1, 1, 0};
    chart c = chart_open("stability-sums", "The mean of a grey world, its sum a float", ax, ay);
    double x[N], y[N], wide[N];
    size_t most = (size_t)64 << 20, done = 0;
    float *values = (float *)malloc(most * sizeof *values), sum = 0;
    double sums = 0;
    if (!values) measure_must(ENVMAP_ERROR_MEMORY, "texels");
    for (size_t i = 0; i < most; ++i) values[i] = 0.7f;
    spread(x, N, 1e3, (double)most);
    for (int i = 0; i < N; ++i) {
        for (; done < (size_t)x[i]; ++done) sum += values[done], sums += (double)values[done];
        y[i] = fmax(fabs((double)sum / ((double)done * (double)0.7f) - 1), 1e-9);
        wide[i] = fmax(fabs(sums / ((double)done * (double)0.7f) - 1), 1e-9);
    }
    note("Sums in floats", "%.0f %% off at 6.7e7 texels of grey; Inf from two of 3e38 | %.0e",
         100 * y[N - 1], wide[N - 1]);
    chart_line(&c, "float", NULL, x, y, N);
    chart_line(&c, "double", NULL, x, wide, N);
    chart_close(&c);
    free(values);
}

/* Every parameterization from one texel up: Phong N = 10 against its harmonics. */
static void sizes(void) {
    static const int edges[] = {1, 2, 3, 4, 5, 7, 8, 11, 16, 17, 32, 33, 64, 100, 128};
    static const chart_axis ax = {"edge of the source, texels", 1, 1000, 1, 0};
    static const chart_axis ay = {"rms error of Phong N = 10", 1e-6, 1, 1, 0};
    chart c = chart_open("stability-sizes", "Maps of 1, 2, 3 ... texels", ax, ay);
    double x[COUNT(edges)], y[COUNT(edges)], lit[3 * BANDS * BANDS];
    envmap_lobe lobe = envmap_lobe_phong(10);
    for (int m = 0; m < ENVMAP_MAPPING_COUNT; ++m) {
        for (int i = 0; i < COUNT(edges); ++i) {
            envmap src = world_of(m, edges[i]);
            measure_must(envmap_sh_convolve(lit, world_sh, BANDS, &lobe, 0), "convolve");
            x[i] = edges[i], y[i] = library_error(&src, &lobe, lit);
            envmap_free(&src);
        }
        chart_line(&c, mapping_name[m], NULL, x, y, COUNT(edges));
        if (m == ENVMAP_CUBE)
            note("Maps of 1 and of 8192 texels",
                 "rms %.0f %% at one texel; sizes that are not powers of two | "
                 "%.2f / size^2, odd or even, cube, Phong N = 10",
                 100 * y[0], y[COUNT(edges) - 1] * 128 * 128);
    }
    for (int i = 0; i < COUNT(edges); ++i) y[i] = fmin(1, 1 / (x[i] * x[i]));
    chart_line(&c, "1 / size^2", "6 4", x, y, COUNT(edges));
    chart_close(&c);
}

/* Files that are not what they say. */
static void files_table(void) {
    static const struct {
        const char *what, *header;
        int samples, mapping; /* bytes of samples after the header */
    } files[] = {{"a good 4 x 2 lat-long", "PF\n4 2\n-1\n", 96, ENVMAP_LATLONG},
                 {"big-endian (scale 1)", "PF\n4 2\n1\n", 96, ENVMAP_LATLONG},
                 {"no bytes at all", "", 0, ENVMAP_LATLONG},
                 {"another magic", "P6\n4 2\n255\n", 96, ENVMAP_LATLONG},
                 {"one byte missing", "PF\n4 2\n-1\n", 95, ENVMAP_LATLONG},
                 {"one byte more", "PF\n4 2\n-1\n", 97, ENVMAP_LATLONG},
                 {"4294967297 x 2", "PF\n4294967297 2\n-1\n", 96, ENVMAP_LATLONG},
                 {"99999 x 99999", "PF\n99999 99999\n-1\n", 96, ENVMAP_ANGULAR},
                 {"-4 x 2", "PF\n-4 2\n-1\n", 96, ENVMAP_LATLONG},
                 {"0 x 0", "PF\n0 0\n-1\n", 0, ENVMAP_LATLONG},
                 {"scale 0", "PF\n4 2\n0\n", 96, ENVMAP_LATLONG},
                 {"scale nan", "PF\n4 2\nnan\n", 96, ENVMAP_LATLONG},
                 {"scale 1e999", "PF\n4 2\n-1e999\n", 96, ENVMAP_LATLONG},
                 {"scale 1,5 (a locale's)", "PF\n4 2\n1,5\n", 96, ENVMAP_LATLONG},
                 {"4 x 2 read as a cube", "PF\n4 2\n-1\n", 96, ENVMAP_CUBE}};
    FILE *out = begin("files");
    fprintf(out, "| file | answer |\n|---|---|\n");
    for (int i = 0; i < COUNT(files); ++i) {
        char data[256] = {0};
        envmap map = {0};
        size_t bytes = strlen(files[i].header);
        memcpy(data, files[i].header, bytes);
        envmap_result result =
            envmap_pfm_read(&map, data, bytes + (size_t)files[i].samples, files[i].mapping);
        fprintf(out, "| %s | %s |\n", files[i].what, envmap_result_text(result));
        envmap_free(&map);
    }
    end(out);
    note("Files that lie", "a crash, a hang, a wrong picture | a result, and nothing written");
}

static void numbers(void) {
    progress("numbers: inputs, sums, sizes, files");
    inputs_table();
    float_sums();
    sizes();
    files_table();
}

/* ------------------------------------------------------------------------------------ >>main -- */

int main(int argc, char **argv) {
    if (argc != 2) {
        fprintf(stderr, "usage: stability DOCS\n");
        return 1;
    }
    docs = argv[1];
    progress("scenes");
    for (int s = 0; s < SCENE_COUNT; ++s) {
        skies[s] = measure_map(ENVMAP_CUBE, 128, 1, 1);
        scene_fill(skies + s, s);
    }
    density();
    maps();
    lobes();
    methods();
    surfaces();
    numbers();
    FILE *out = begin("contents");
    fprintf(out, "| | how badly | the library |\n|---|---|---|\n%s", contents);
    end(out);
    char path[5000];
    snprintf(path, sizeof path, "%s/stability.md", docs);
    measure_write(&document, path, "make stability");
    measure_document_free(&document);
    for (int s = 0; s < SCENE_COUNT; ++s) envmap_free(skies + s);
    progress("done");
    return 0;
}
