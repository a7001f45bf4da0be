/* diagrams.c - what lobes, axes and parameterizations are, drawn: the figures of docs/diagrams.md.

   What you will see: `diagrams DOCS` writes DOCS/charts/diagram-*.svg. All curves are computed:
   lobes by envmap_lobe_value, circles on maps by envmap_coordinates.
       cc -O3 -march=native -I. examples/measure/diagrams.c -o diagrams -lm

   >>pencil   lines, arrows and letters on an area with its own units
   >>lobes    the axis of a map, and the lobe around it
   >>maps     how each parameterization comes about
   >>circle   a circle on the paraboloid
   >>chain    the texture matrices
   >>split    near and far

   SPDX-License-Identifier: MIT */
#define _POSIX_C_SOURCE 200809L
#include "measure.h"
#include "svg.h"

#define INK    "#111"
#define PALE   "#777777"
#define BLUE   "#3b6ea8"
#define ORANGE "#c4732b"
#define RED    "#b03a48"
#define GREEN  "#4d8f4d"

static const char *folder;

/* ---------------------------------------------------------------------------------- >>pencil -- */

static svg_axes area(double left, double top, double size, double from, double to) {
    svg_axes a = {left, top, left + size, top + size, from, to, from, to, 0, 0};
    return a;
}

static void stroke(FILE *f, const svg_axes *a, double x0, double y0, double x1, double y1,
                   const char *colour, double width, const char *style) {
    double x[2] = {x0, x1}, y[2] = {y0, y1};
    svg_line(f, a, x, y, 2, colour, width, style);
}

/* Its head is 9 pixels long. */
static void arrow(FILE *f, const svg_axes *a, double x0, double y0, double x1, double y1,
                  const char *colour, double width) {
    double X0 = svg_x(a, x0), Y0 = svg_y(a, y0), X = svg_x(a, x1), Y = svg_y(a, y1);
    double length = fmax(hypot(X - X0, Y - Y0), 1e-9), ux = (X - X0) / length,
           uy = (Y - Y0) / length;
    fprintf(f,
            "<path fill=\"none\" stroke=\"%s\" stroke-width=\"%g\" d=\"M%.1f %.1fL%.1f %.1f\"/>\n",
            colour, width, X0, Y0, X - 6 * ux, Y - 6 * uy);
    fprintf(f, "<path fill=\"%s\" d=\"M%.1f %.1fL%.1f %.1fL%.1f %.1fZ\"/>\n", colour, X, Y,
            X - 9 * ux + 3.5 * uy, Y - 9 * uy - 3.5 * ux, X - 9 * ux - 3.5 * uy,
            Y - 9 * uy + 3.5 * ux);
}

static void label(FILE *f, const svg_axes *a, double x, double y, const char *anchor,
                  const char *text) {
    svg_text(f, svg_x(a, x), svg_y(a, y), 13, anchor, INK, "%s", text);
}

static void circle(FILE *f, const svg_axes *a, double x, double y, double r, double from, double to,
                   const char *colour, double width, const char *style) {
    double X[91], Y[91];
    for (int i = 0; i <= 90; ++i) {
        double t = from + (to - from) * i / 90;
        X[i] = x + r * cos(t), Y[i] = y + r * sin(t);
    }
    svg_line(f, a, X, Y, 91, colour, width, style);
}

/* ----------------------------------------------------------------------------------- >>lobes -- */

/* k over its peak, as a curve in polar coordinates about the axis at angle `axis`. */
static void polar(FILE *f, const svg_axes *a, const envmap_lobe *lobe, double p, double axis,
                  double length, const char *colour) {
    double x[361], y[361], peak = 0;
    for (int i = 0; i <= 360; ++i)
        peak = fmax(peak, envmap_lobe_value(lobe, cos(MEASURE_PI * (i - 180) / 180), p));
    for (int i = 0; i <= 360; ++i) {
        double t = MEASURE_PI * (i - 180) / 180;
        double r = length * envmap_lobe_value(lobe, cos(t), p) / peak;
        x[i] = r * cos(axis + t), y[i] = r * sin(axis + t);
    }
    svg_line(f, a, x, y, 361, colour, 2, "stroke-linejoin=\"round\"");
}

static void ground(FILE *f, const svg_axes *a) {
    stroke(f, a, -1, 0, 1, 0, PALE, 2, "");
    for (int i = 0; i < 14; ++i)
        stroke(f, a, -0.9 + 0.14 * i, 0, -0.98 + 0.14 * i, -0.08, PALE, 1, "");
}

static void draw_lobes(void) {
    FILE *f = svg_open(folder, "diagram-lobes.svg", 920, 330,
                       "A map is looked up along an axis; a lobe around it says what light counts");
    svg_axes a = area(20, 40, 270, -1.15, 1.15);
    envmap_lobe phong = envmap_lobe_phong(12), diffuse = envmap_lobe_diffuse();
    envmap_lobe banks = envmap_lobe_banks(0.9f);
    double c = sqrt(0.5), t = 0.35, v = 2.3;
    ground(f, &a);
    arrow(f, &a, 0, 0, -c, c, BLUE, 1.5), label(f, &a, -c, c + 0.06, "end", "v");
    arrow(f, &a, 0, 0, 0, 1, INK, 1.5), label(f, &a, 0.05, 1, "start", "n");
    arrow(f, &a, 0, 0, c, c, RED, 1.5), label(f, &a, c + 0.02, c + 0.06, "start", "r = axis a");
    polar(f, &a, &phong, 0, MEASURE_PI / 4, 0.85, RED);
    label(f, &a, 0, -0.35, "middle", "glossy: axis r, the reflected view");
    a = area(315, 40, 270, -1.15, 1.15);
    ground(f, &a);
    arrow(f, &a, 0, 0, 0, 1, RED, 1.5), label(f, &a, 0.05, 1, "start", "n = axis a");
    polar(f, &a, &diffuse, 0, MEASURE_PI / 2, 0.85, RED);
    arrow(f, &a, 0, 0, -0.8, 0.6, GREEN, 1.5), label(f, &a, -0.82, 0.64, "end", "l");
    label(f, &a, -0.26, 0.62, "middle", "θ"), circle(f, &a, 0, 0, 0.5, 1.57, 2.5, PALE, 1, "");
    label(f, &a, 0, -0.35, "middle", "diffuse: axis n; k = cos θ");
    a = area(610, 40, 270, -1.15, 1.15);
    stroke(f, &a, -cos(t), -sin(t), 0, 0, PALE, 5, "stroke-linecap=\"round\"");
    arrow(f, &a, 0, 0, cos(t), sin(t), INK, 1.5), label(f, &a, cos(t), sin(t) + 0.08, "start", "t");
    arrow(f, &a, 0, 0, cos(v), sin(v), BLUE, 1.5), label(f, &a, cos(v), sin(v) + 0.06, "end", "v");
    polar(f, &a, &banks, cos(v - t), t, 0.85, RED);
    label(f, &a, 0, -0.85, "middle", "Banks: axis t, the thread; k is a ring about it,");
    label(f, &a, 0, -1.0, "middle", "cut here by the plane of t and v; slice p = v·t");
    svg_close(f);
}

/* ------------------------------------------------------------------------------------ >>maps -- */

#define RAYS 7

/* One paraboloid, up (z = 1) or down: parallel rays become all directions of a half. */
static void paraboloid(FILE *f, const svg_axes *a, double up, const char *colour) {
    double x[41], z[41];
    for (int i = 0; i <= 40; ++i) x[i] = i / 20.0 - 1, z[i] = up * 0.5 * (1 - x[i] * x[i]);
    svg_line(f, a, x, z, 41, INK, 2, "");
    for (int i = 0; i < RAYS; ++i) {
        double X = 2.0 * (i + 0.5) / RAYS - 1, Z = up * 0.5 * (1 - X * X), q = 1 + X * X;
        stroke(f, a, X, up * 1.55, X, Z, PALE, 1, "");
        arrow(f, a, X, Z, X + 0.75 * 2 * X / q, Z + up * 0.75 * (1 - X * X) / q, colour, 1.5);
    }
}

static void mirror_ball(FILE *f, const svg_axes *a) {
    circle(f, a, 0, 0, 0.8, 0, 2 * MEASURE_PI, INK, 2, "");
    for (int i = 0; i < RAYS; ++i) {
        double X = 2.0 * (i + 0.5) / RAYS - 1, Z = sqrt(1 - X * X);
        stroke(f, a, 0.8 * X, 1.55, 0.8 * X, 0.8 * Z, PALE, 1, "");
        arrow(f, a, 0.8 * X, 0.8 * Z, 0.8 * X + 0.75 * 2 * Z * X, 0.8 * Z + 0.75 * (2 * Z * Z - 1),
              ORANGE, 1.5);
    }
}

static void cube_section(FILE *f, const svg_axes *a) {
    for (int i = 0; i < 4; ++i) {
        double c = cos(i * MEASURE_PI / 2), s = sin(i * MEASURE_PI / 2);
        stroke(f, a, c - s, s + c, c + s, s - c, INK, 2, "");
        for (int k = 0; k < 6; ++k) {
            double u = 2 * (k + 0.5) / 6 - 1;
            arrow(f, a, 0, 0, c - u * s, s + u * c, i % 2 ? BLUE : GREEN, 1);
        }
    }
}

static void octahedron(FILE *f, const svg_axes *a) {
    for (int i = 0; i < 4; ++i) {
        double c = cos(i * MEASURE_PI / 2), s = sin(i * MEASURE_PI / 2);
        stroke(f, a, c, s, -s, c, INK, 2, "");
        for (int k = 0; k < 6; ++k) {
            double u = (k + 0.5) / 6;
            arrow(f, a, 0, 0, (1 - u) * c - u * s, (1 - u) * s + u * c, i < 2 ? BLUE : GREEN, 1);
        }
    }
}

/* The octahedron cut along its lower edges and laid flat: the upper half is the middle. */
static void unfolded(FILE *f, const svg_axes *a) {
    for (int i = 0; i < 4; ++i) {
        double c = cos(i * MEASURE_PI / 2), s = sin(i * MEASURE_PI / 2);
        stroke(f, a, c, s, -s, c, BLUE, 2, "");
        stroke(f, a, c - s, s + c, -c - s, c - s, INK, 2, "");
        stroke(f, a, 0, 0, c, s, PALE, 1, "");
        stroke(f, a, c, s, c - s, s + c, GREEN, 1, "");
        stroke(f, a, -s, c, c - s, s + c, GREEN, 1, "");
        label(f, a, 0.84 * (c - s), 0.84 * (c + s) - 0.05, "middle", "−y");
    }
    label(f, a, 0.12, 0.05, "middle", "+y");
}

/* A half circle of meridian, and the rows that its even steps become. */
static void unrolled(FILE *f, const svg_axes *a) {
    circle(f, a, -0.75, 0, 0.7, MEASURE_PI / 2, 3 * MEASURE_PI / 2, INK, 2, "");
    stroke(f, a, -0.75, -0.7, -0.75, 0.7, PALE, 1, "stroke-dasharray=\"4 3\"");
    for (int i = 0; i <= 8; ++i) {
        double t = MEASURE_PI * i / 8, y = 0.7 - 1.4 * i / 8;
        stroke(f, a, -0.2, y, 1.2, y, BLUE, i % 8 ? 1 : 2, "");
        stroke(f, a, -0.75 - 0.7 * sin(t), 0.7 * cos(t), -0.75, 0.7 * cos(t), GREEN, 1, "");
        stroke(f, a, -0.75, 0.7 * cos(t), -0.2, y, PALE, 1, "stroke-dasharray=\"2 3\"");
    }
    for (int i = 0; i <= 8; ++i)
        stroke(f, a, -0.2 + 1.4 * i / 8, -0.7, -0.2 + 1.4 * i / 8, 0.7, BLUE, i % 8 ? 1 : 2, "");
}

static void draw_maps(void) {
    static const char *const names[] = {
        "two paraboloids: rays that come", "sphere map: a mirror ball;",
        "cube: rays through even steps",   "octahedron: the same on",
        "... unfolded: the lower half's",  "lat-long: even steps of"};
    static const char *const more[] = {"parallel leave as a half each",
                                       "near the rim all look to −z",
                                       "of each face",
                                       "four (eight) faces",
                                       "corners meet in the corners",
                                       "angle become rows"};
    FILE *f = svg_open(folder, "diagram-maps.svg", 900, 690,
                       "How each parameterization comes about (sections)");
    for (int i = 0; i < 6; ++i) {
        double left = 20 + 295 * (i % 3), top = 40 + 325 * (i / 3);
        svg_axes a = area(left, top, 270, -1.6, 1.6);
        if (i == 0) paraboloid(f, &a, 1, BLUE), paraboloid(f, &a, -1, GREEN);
        if (i == 1) mirror_ball(f, &a);
        if (i == 2) cube_section(f, &a);
        if (i == 3) octahedron(f, &a);
        if (i == 4) unfolded(f, &a);
        if (i == 5) unrolled(f, &a);
        svg_text(f, left + 135, top + 288, 13, "middle", INK, "%s", names[i]);
        svg_text(f, left + 135, top + 304, 13, "middle", INK, "%s", more[i]);
    }
    svg_close(f);
}

/* ---------------------------------------------------------------------------------- >>circle -- */

/* The map's circle of directions at `angle` about a direction `from` the centre, on the front face. */
static void cone(FILE *f, const svg_axes *a, double from, double angle, const char *colour,
                 const char *style) {
    double X[91], Y[91];
    for (int i = 0; i <= 90; ++i) {
        double t = 2 * MEASURE_PI * i / 90, s = sin(angle), c = cos(angle);
        double d[3] = {c * sin(from) + s * cos(t) * cos(from), s * sin(t),
                       c * cos(from) - s * cos(t) * sin(from)};
        X[i] = d[0] / (1 + d[2]), Y[i] = d[1] / (1 + d[2]);
    }
    svg_line(f, a, X, Y, 91, colour, 2, style);
}

static void draw_circle(void) {
    static const double at[3] = {0, 0.5, 1};
    double angle = acos(pow(0.1, 1.0 / 10)); /* where Phong N = 10 falls to a tenth */
    FILE *f =
        svg_open(folder, "diagram-circle.svg", 900, 470,
                 "The lobe N = 10, cut at a tenth, on the paraboloid: round, but off its axis");
    svg_axes a = {20, 45, 800, 435, -1.2, 2.4 * 780 / 390 - 1.2, -1.2, 1.2, 0, 0};
    circle(f, &a, 0, 0, 1, 0, 2 * MEASURE_PI, PALE, 2, "");
    for (int i = 0; i < 3; ++i) {
        double from = 2 * atan(at[i]), near_side = tan((from - angle) / 2);
        double far_side = tan((from + angle) / 2), middle = (near_side + far_side) / 2;
        cone(f, &a, from, angle, RED, "");
        circle(f, &a, at[i], 0, (far_side - near_side) / 2, 0, 2 * MEASURE_PI, BLUE, 1.5,
               "stroke-dasharray=\"4 3\"");
        svg_dot(f, &a, at[i], 0, 4, BLUE, BLUE);
        svg_dot(f, &a, middle, 0, 4, "none", RED);
    }
    label(f, &a, 0, 1.05, "middle", "rim: 90° from +z");
    svg_dot(f, &a, 2.1, 0.9, 4, BLUE, BLUE), label(f, &a, 2.2, 0.87, "start", "axis of the lobe");
    svg_dot(f, &a, 2.1, 0.72, 4, "none", RED),
        label(f, &a, 2.2, 0.69, "start", "centre of its circle");
    stroke(f, &a, 2.0, 0.56, 2.16, 0.56, RED, 2, ""),
        label(f, &a, 2.2, 0.52, "start", "the lobe on the map");
    stroke(f, &a, 2.0, 0.39, 2.16, 0.39, BLUE, 1.5, "stroke-dasharray=\"4 3\"");
    label(f, &a, 2.2, 0.35, "start", "as a convolution has it");
    svg_close(f);
}

/* ----------------------------------------------------------------------------------- >>chain -- */

/* What the chain makes of one reflection vector in eye space, step by step, for the front face. */
static void draw_chain(void) {
    static const char *const what[6] = {"r, eye space", "M_l⁻¹ r", "S: d − r",
                                        "P: over z",    "bias",    "texture (s, t)"};
    static const char *const under[6] = {"as OpenGL makes it", "into the map's space",
                                         "d = (0, 0, −1)",     "−r_x / (−1 − r_z)",
                                         "½ + ½x, ½ − ½y",     "u, v of envmap.h"};
    static const char *const colours[6] = {BLUE, GREEN, ORANGE, RED, RED, INK};
    float d[3] = {0.48f, 0.36f, 0.8f}, u, v;
    int face;
    char value[6][60];
    FILE *f = svg_open(folder, "diagram-matrix.svg", 900, 190,
                       "From a reflection vector to texture coordinates: bias · P · S · M_l⁻¹");
    svg_axes a = {0, 0, 900, 190, 0, 900, 190, 0, 0, 0};
    double x = (double)(d[0] / (1 + d[2])), y = (double)(d[1] / (1 + d[2]));
    envmap_coordinates(&face, &u, &v, ENVMAP_PARABOLOID, d);
    snprintf(value[0], 60, "(−0.8, 0.36, 0.48)");
    snprintf(value[1], 60, "(%g, %g, %g)", (double)d[0], (double)d[1], (double)d[2]);
    snprintf(value[2], 60, "(−%g, −%g, −%g)", (double)d[0], (double)d[1], 1 + (double)d[2]);
    snprintf(value[3], 60, "(%.3f, %.3f)", x, y);
    snprintf(value[4], 60, "(%.3f, %.3f)", 0.5 + 0.5 * x, 0.5 - 0.5 * y);
    snprintf(value[5], 60, "(%.3f, %.3f)", (double)u, (double)v);
    for (int i = 0; i < 6; ++i) {
        double left = 12 + 148 * i;
        fprintf(f,
                "<rect x=\"%.0f\" y=\"60\" width=\"132\" height=\"84\" rx=\"6\" fill=\"none\" "
                "stroke=\"%s\" stroke-width=\"2\"/>\n",
                left, colours[i]);
        svg_text(f, left + 66, 84, 14, "middle", INK, "%s", what[i]);
        svg_text(f, left + 66, 108, 11, "middle", INK, "%s", value[i]);
        svg_text(f, left + 66, 132, 11, "middle", "#444", "%s", under[i]);
        if (i) arrow(f, &a, left - 16, 102, left - 1, 102, PALE, 1.5);
    }
    svg_text(f, 12, 172, 12, "start", "#444",
             "M_l: the camera turned by a quarter about y. The last box is envmap_coordinates of "
             "the second.");
    svg_close(f);
}

/* ----------------------------------------------------------------------------------- >>split -- */

static double smooth(double t) {
    t = fmin(fmax(t, 0), 1);
    return t * t * t * (t * (6 * t - 15) + 10);
}

static void draw_split(void) {
    double x[3][301], y[3][301], peak;
    static const char *const colours[3] = {PALE, RED, BLUE};
    static const char *const names[3] = {"k: GGX, α = 0.02",
                                         "near: k (1 − step), summed texel by texel",
                                         "far: k · step, through few bands"};
    envmap_lobe ggx = envmap_lobe_ggx(0.02f);
    FILE *f = svg_open(folder, "diagram-near-far.svg", 900, 400,
                       "A sharp lobe with a tail is cut into what is near and what is smooth");
    svg_axes a = {80, 44, 860, 320, 0, 0.5, 1e-5, 1, 0, 1};
    peak = envmap_lobe_value(&ggx, 1, 0);
    for (int i = 0; i <= 5; ++i) {
        char text[16];
        snprintf(text, sizeof text, "%g", pow(10, -i)), svg_tick_y(f, &a, pow(10, -i), text);
        snprintf(text, sizeof text, "%.1f", 0.1 * i), svg_tick_x(f, &a, 0.1 * i, text);
    }
    for (int i = 0; i <= 300; ++i) {
        double t = 0.5 * i / 300, k = envmap_lobe_value(&ggx, cos(t), 0) / peak;
        double far_part = smooth((t - 0.1) / 0.15);
        for (int j = 0; j < 3; ++j) x[j][i] = t;
        y[0][i] = k, y[1][i] = k * (1 - far_part), y[2][i] = k * far_part;
    }
    for (int j = 0; j < 3; ++j) {
        int from = 0, to = 301;
        while (j == 2 && from < 300 && y[j][from] < 1e-5) ++from;
        while (j == 1 && to > 1 && y[j][to - 1] < 1e-5) --to;
        svg_line(f, &a, x[j] + from, y[j] + from, to - from, colours[j], j ? 2 : 4, "");
        svg_bar(f, 90 + 230 * j + (j == 2 ? 70 : 0), 372, 12, 12, colours[j]);
        svg_text(f, 108 + 230 * j + (j == 2 ? 70 : 0), 382, 12, "start", INK, "%s", names[j]);
    }
    svg_frame(f, &a);
    svg_text(f, 470, 354, 12, "middle", "#444", "angle to the axis, rad");
    svg_text(f, 852, 62, 12, "end", "#444", "upwards: k over its peak, no unit");
    svg_close(f);
}

int main(int argc, char **argv) {
    folder = argc > 1 ? argv[1] : "docs";
    draw_lobes();
    draw_maps();
    draw_circle();
    draw_chain();
    draw_split();
    return 0;
}
