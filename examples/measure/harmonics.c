/* harmonics.c - what few coefficients cost and what they lose: the tables, charts and the picture
   of docs/harmonics.md.

   What you will see: the tables, each error beside its time. `harmonics --docs DOCS` also puts
   them into DOCS/harmonics.md, and writes DOCS/charts/harmonics.svg, DOCS/charts/ringing.svg and
   DOCS/images/ringing.png. Maps that are named are measured beside the three made scenes.
       cc -O3 -march=native -std=c99 -I. examples/measure/harmonics.c -o harmonics -lm

   >>tools    time, scenes, differences
   >>tables   sizes, tolerances, bands, ringing, speed
   >>charts   SVG, and the balls
   >>main

   SPDX-License-Identifier: MIT */

#define _POSIX_C_SOURCE 200809L
#include "measure.h"

#include "../tool/picture.h"
#include "../tool/scenes.h"
#include "svg.h"

/* ----------------------------------------------------------------------------------- >>tools -- */

enum { EDGE = 256, MOST_SCENES = 16, FIRST = 2, LAST = 10 };

typedef struct scene {
    const char *name;
    envmap map; /* a cube of edge EDGE */
    double mean[LAST + 1], rms[LAST + 1], worst[LAST + 1];
} scene;

static scene scenes[MOST_SCENES];
static int scene_count;
static measure_document document;

static envmap cube(int size) { return measure_map(ENVMAP_CUBE, size, 1, 1); }

static void load_scenes(char **paths) {
    int k;
    for (k = 0; k < SCENE_COUNT; k++) {
        scenes[k].map = cube(EDGE);
        scene_fill(&scenes[k].map, k);
        scenes[k].name = scene_name[k];
    }
    for (scene_count = k; *paths && scene_count < MOST_SCENES; paths++, scene_count++) {
        envmap map = {0};
        const char *slash = strrchr(*paths, '/');
        measure_must(envmap_pfm_load(&map, *paths, ENVMAP_LATLONG), *paths);
        scenes[scene_count].map = cube(EDGE);
        measure_must(envmap_resample(&scenes[scene_count].map, &map, NULL), *paths);
        scenes[scene_count].name = slash ? slash + 1 : *paths;
        envmap_free(&map);
    }
}

/* |a - b| / |b| over all coefficients. */
static double apart(const double *a, const double *b, int bands) {
    double difference = 0, all = 0;
    int i;
    for (i = 0; i < 3 * bands * bands; i++) {
        difference += (a[i] - b[i]) * (a[i] - b[i]);
        all += b[i] * b[i];
    }
    return sqrt(difference / all);
}

/* Mean of |a - b| over the mean of b, over solid angle and channels. */
static double mean_apart(const envmap *a, const envmap *b) {
    double difference = 0, all = 0;
    int face, y, x, c;
    for (face = 0; face < 6; face++)
        for (y = 0; y < b->size; y++)
            for (x = 0; x < b->size; x++) {
                double w = envmap_solid_angle(b, 0, face, x, y);
                const float *p = envmap_texel(a, 0, 0, face, x, y);
                const float *q = envmap_texel(b, 0, 0, face, x, y);
                for (c = 0; c < 3; c++) {
                    difference += w * fabs((double)p[c] - (double)q[c]);
                    all += w * (double)q[c];
                }
            }
    return difference / all;
}

/* ---------------------------------------------------------------------------------- >>tables -- */

/* A section: what its table is, and the head of it, with a column for each scene in the end. */
static FILE *open_table(const char *name, const char *caption, const char *columns) {
    FILE *out = measure_begin(&document, name);
    int k;
    fprintf(out, "%s\n\n%s", caption, columns);
    for (k = 0; k < scene_count; k++) fprintf(out, " %s |", scenes[k].name);
    fprintf(out, "\n|");
    for (; *columns; columns++)
        if (*columns == '|' && columns[1]) fprintf(out, "---|");
    for (k = 0; k < scene_count; k++) fprintf(out, "---|");
    fprintf(out, "\n");
    return out;
}

/* Nine coefficients from the levels of a mip chain, against all texels of level 0. */
static void table_of_sizes(void) {
    FILE *out = open_table("sizes",
                           "From a level of the mip chain, against all texels of 6 × 256², "
                           "relative rms:",
                           "| edge |");
    int k, level;
    for (level = 7; level > 0; level--) {
        fprintf(out, "| %d |", EDGE >> level);
        for (k = 0; k < scene_count; k++) {
            double all[27], few[27];
            envmap chain = measure_map(ENVMAP_CUBE, EDGE, 9, 1), small = cube(EDGE >> level);
            memcpy(chain.texels, scenes[k].map.texels, measure_bytes(&chain, 1));
            measure_must(envmap_mips_build(&chain), "mips");
            memcpy(small.texels, envmap_texel(&chain, level, 0, 0, 0, 0), measure_bytes(&small, 1));
            measure_must(envmap_sh_project(all, 3, &chain, 0, 0, NULL), "project");
            measure_must(envmap_sh_project(few, 3, &small, 0, 0, NULL), "project");
            fprintf(out, " %.1e |", apart(few, all, 3));
            envmap_free(&chain), envmap_free(&small);
        }
        fprintf(out, "\n");
    }
    measure_end(&document, out, 1);
}

static double best_of(int times, double (*once)(void)) {
    double best = 1e9;
    while (times-- > 0) {
        double t = once();
        if (t < best) best = t;
    }
    return best;
}

static int timed_bands;
static double timed_tolerance, timed_sh[3 * 32 * 32], timed_out[3 * 32 * 32];
static double one_projection(void) {
    double start = measure_seconds();
    measure_must(envmap_sh_project(timed_sh, timed_bands, &scenes[0].map, 0, timed_tolerance, NULL),
                 "project");
    return measure_seconds() - start;
}

static double one_rotation(void) {
    static const double turn[9] = {0, -0.6, 0.8, 1, 0, 0, 0, 0.8, 0.6};
    double start = measure_seconds();
    measure_must(envmap_sh_rotate(timed_out, timed_sh, timed_bands, turn), "rotate");
    return measure_seconds() - start;
}

static double one_window(void) {
    envmap_lobe diffuse = envmap_lobe_diffuse();
    double start = measure_seconds();
    measure_must(envmap_sh_window(timed_out, NULL, timed_sh, timed_bands, &diffuse, 0), "window");
    return measure_seconds() - start;
}

/* A tolerance is a promise for one light in the worst place; scenes stay far below. */
static void table_of_tolerances(void) {
    static const int bands[] = {3, 6, 10};
    static const double tolerances[] = {1e-2, 1e-3, 1e-4, 1e-5, 0};
    static double all[300];
    char caption[256];
    int b, t, k;
    FILE *out;
    double copy = measure_copy(&scenes[0].map, &scenes[0].map, 0, measure_seconds);
    snprintf(caption, sizeof caption,
             "Projecting 6 × %d², one thread, %s; a copy is a memcpy of the cube, %.2f ms. "
             "Relative rms of all coefficients:",
             EDGE, MEASURE_COMPILER, copy * 1e3);
    out = open_table("tolerances", caption, "| bands | tolerance | copies |");
    for (b = 0; b < 3; b++)
        for (t = 0; t < 5; t++) {
            timed_bands = bands[b], timed_tolerance = tolerances[t];
            fprintf(out, "| %d | %g | %.1f |", bands[b], tolerances[t],
                    best_of(t < 4 ? 25 : 3, one_projection) / copy);
            for (k = 0; k < scene_count; k++) {
                const envmap *map = &scenes[k].map;
                measure_must(envmap_sh_project(all, bands[b], map, 0, 0, NULL), "project");
                measure_must(envmap_sh_project(timed_sh, bands[b], map, 0, tolerances[t], NULL),
                             "project");
                fprintf(out, t < 4 ? " %.0e |" : " %g |", apart(timed_sh, all, bands[b]));
            }
            fprintf(out, "\n");
        }
    measure_end(&document, out, 1);
}

/* Irradiance of few bands against the reference filter, 6 x 16^2 from 6 x 64^2. */
static void measure_bands(scene *s) {
    static double sh[3 * LAST * LAST], lit[3 * LAST * LAST];
    envmap_lobe diffuse = envmap_lobe_diffuse();
    envmap_filter_desc desc = {0};
    envmap source = cube(64), exact = cube(16), few = cube(16);
    int bands;
    desc.method = ENVMAP_METHOD_REFERENCE;
    measure_must(envmap_resample(&source, &s->map, NULL), "resample");
    measure_must(envmap_filter(&exact, &source, &diffuse, &desc), "filter");
    measure_must(envmap_sh_project(sh, LAST, &source, 0, 0, NULL), "project");
    for (bands = FIRST; bands <= LAST; bands++) {
        envmap_difference d;
        measure_must(envmap_sh_convolve(lit, sh, bands, &diffuse, 0), "convolve");
        measure_must(envmap_sh_fill(&few, 0, 0, lit, bands, 0, NULL), "fill");
        measure_must(envmap_compare(&d, &few, &exact, 0), "compare");
        s->mean[bands] = mean_apart(&few, &exact);
        s->rms[bands] = d.rms, s->worst[bands] = d.worst;
    }
    envmap_free(&source), envmap_free(&exact), envmap_free(&few);
}

/* From 3 on an even number of bands is no better than one less: lambda_3, lambda_5 ... are 0. */
static void table_of_bands(void) {
    FILE *out =
        open_table("bands",
                   "Against the exact diffuse map (6 × 64² → 6 × 16²): mean of |error| over "
                   "the mean, rms, and\nthe worst texel (relative to itself), in %:",
                   "| bands |");
    int k, bands;
    for (k = 0; k < scene_count; k++) measure_bands(&scenes[k]);
    for (bands = FIRST; bands <= LAST; bands += bands > 2 ? 2 : 1) {
        fprintf(out, bands > 2 ? "| %d, %d |" : "| %d |", bands, bands + 1);
        for (k = 0; k < scene_count; k++)
            fprintf(out, " %.2f, %.2f, %.1f |", 100 * scenes[k].mean[bands],
                    100 * scenes[k].rms[bands], 100 * scenes[k].worst[bands]);
        fprintf(out, "\n");
    }
    measure_end(&document, out, 1);
}

/* The lowest irradiance over its mean, on a cube of directions. */
static double lowest(const double *sh, int bands) {
    double lit[300], low = 1e9;
    envmap_lobe diffuse = envmap_lobe_diffuse();
    envmap map = cube(64);
    size_t i;
    measure_must(envmap_sh_convolve(lit, sh, bands, &diffuse, 0), "convolve");
    measure_must(envmap_sh_fill(&map, 0, 0, lit, bands, 0, NULL), "fill");
    for (i = 0; i < measure_bytes(&map, 1) / sizeof(float); i++)
        low = fmin(low, (double)map.texels[i] / (lit[i % 3] / sqrt(4 * MEASURE_PI)));
    envmap_free(&map);
    return low;
}

static void light(double *sh, int bands) {
    static const double up[3] = {0, 0, 1};
    double Y[100];
    int i;
    measure_must(envmap_sh_basis(Y, bands, up), "basis");
    for (i = 0; i < 3 * bands * bands; i++) sh[i] = Y[i / 3];
}

static void table_of_ringing(void) {
    envmap_lobe diffuse = envmap_lobe_diffuse();
    FILE *out =
        open_table("ringing",
                   "Lowest irradiance over its mean, the same after windowing, and what that "
                   "moved (relative rms):",
                   "| bands | one light |");
    int k, bands;
    for (bands = 3; bands <= 5; bands += 2) {
        fprintf(out, "| %d, %d |", bands, bands + 1);
        for (k = -1; k < scene_count; k++) {
            double sh[108], windowed[108], moved;
            if (k < 0) light(sh, bands);
            else measure_must(envmap_sh_project(sh, bands, &scenes[k].map, 0, 0, NULL), "project");
            measure_must(envmap_sh_window(windowed, &moved, sh, bands, &diffuse, 0), "window");
            fprintf(out, " %.3f, %.3f, %.3f |", lowest(sh, bands), lowest(windowed, bands), moved);
        }
        fprintf(out, "\n");
    }
    measure_end(&document, out, 1);
}

static void table_of_needs(void) {
    static const char *const names[] = {"diffuse", "Phong 10", "Phong 100", "Gaussian 30",
                                        "GGX 0.25"};
    static const double tolerances[] = {1e-1, 1e-2, 1e-3};
    static double sh[3 * 32 * 32];
    envmap_lobe lobes[5];
    FILE *out =
        open_table("needs",
                   "At tolerance 0.1, 0.01, 0.001 of the result's rms, with 32 bands of each "
                   "scene known:",
                   "| lobe | one light |");
    int i, t, k;
    lobes[0] = envmap_lobe_diffuse(), lobes[1] = envmap_lobe_phong(10);
    lobes[2] = envmap_lobe_phong(100), lobes[3] = envmap_lobe_gaussian(30);
    lobes[4] = envmap_lobe_ggx(0.25f);
    for (i = 0; i < 5; i++) {
        fprintf(out, "| %s |", names[i]);
        for (k = -1; k < scene_count; k++) {
            if (k >= 0)
                measure_must(envmap_sh_project(sh, 32, &scenes[k].map, 0, 1e-3, NULL), "project");
            for (t = 0; t < 3; t++)
                fprintf(out, "%s %d", t ? "," : "",
                        envmap_sh_bands(&lobes[i], 0, k < 0 ? NULL : sh, k < 0 ? 0 : 32,
                                        tolerances[t]));
            fprintf(out, " |");
        }
        fprintf(out, "\n");
    }
    measure_end(&document, out, 1);
}

static void table_of_speed(void) {
    static const int bands[] = {3, 6, 10, 16, 32};
    FILE *out = measure_begin(&document, "speed");
    int b;
    fprintf(out,
            "Milliseconds, one thread, %s:\n\n"
            "| bands | rotate | window of one light |\n|---|---|---|\n",
            MEASURE_COMPILER);
    for (b = 0; b < 5; b++) {
        timed_bands = bands[b];
        memset(timed_sh, 0, sizeof timed_sh);
        if (bands[b] <= 10) light(timed_sh, bands[b]);
        fprintf(out, "| %d | %.3f |", bands[b], 1e3 * best_of(5, one_rotation));
        if (bands[b] <= 10) fprintf(out, " %.2f |\n", 1e3 * best_of(3, one_window));
        else fprintf(out, " |\n");
    }
    measure_end(&document, out, 1);
}

/* ---------------------------------------------------------------------------------- >>charts -- */

static double chart_x(int bands) { return 70 + 60.0 * (bands - FIRST); }
static double chart_y(double error) { return 110 + 65 * -log10(fmax(error, 1e-5)); }

/* Mean (solid) and worst (dashed) error of irradiance against bands, logarithmic. */
static void draw_bands(const char *folder) {
    FILE *f = svg_open(folder, "harmonics.svg", 760, 460,
                       "Irradiance from few bands: mean (solid) and worst (dashed) error");
    int k, bands, worst;
    for (k = -1; k <= 4; k++) {
        double y = chart_y(pow(10, -k));
        fprintf(f,
                "<path d=\"M70 %.1fH550\" stroke=\"#ddd\"/><text x=\"62\" y=\"%.1f\" "
                "text-anchor=\"end\">%g %%</text>\n",
                y, y + 4, 100 * pow(10, -k));
    }
    for (bands = FIRST; bands <= LAST; bands++)
        fprintf(f, "<text x=\"%.1f\" y=\"435\" text-anchor=\"middle\">%d</text>\n", chart_x(bands),
                bands);
    fprintf(f, "<text x=\"310\" y=\"454\" text-anchor=\"middle\">bands</text>\n");
    for (k = 0; k < scene_count; k++) {
        const char *colour = svg_colours[k % 10];
        for (worst = 0; worst < 2; worst++) {
            fprintf(f, "<path fill=\"none\" stroke=\"%s\" stroke-width=\"2\"%s d=\"", colour,
                    worst ? " stroke-dasharray=\"6 5\"" : "");
            for (bands = FIRST; bands <= LAST; bands++)
                fprintf(f, "%c%.1f %.1f", bands == FIRST ? 'M' : 'L', chart_x(bands),
                        chart_y(worst ? scenes[k].worst[bands] : scenes[k].mean[bands]));
            fprintf(f, "\"/>\n");
        }
        fprintf(f, "<text x=\"570\" y=\"%d\" fill=\"%s\">%s</text>\n", 60 + 22 * k, colour,
                scenes[k].name);
    }
    svg_close(f);
}

/* The irradiance of one light against the angle to it: exact, and of so many bands. */
static void ringing_curve(FILE *f, const double *sh, int bands, const char *colour,
                          const char *name, int row) {
    double lit[300], rgb[3];
    envmap_lobe diffuse = envmap_lobe_diffuse();
    int i;
    if (bands) measure_must(envmap_sh_convolve(lit, sh, bands, &diffuse, 0), "convolve");
    fprintf(f, "<path fill=\"none\" stroke=\"%s\" stroke-width=\"2\" d=\"", colour);
    for (i = 0; i <= 180; i++) {
        double t = i * MEASURE_PI / 180, d[3] = {sin(t), 0, cos(t)};
        double value = cos(t) > 0 ? cos(t) : 0;
        if (bands) {
            measure_must(envmap_sh_evaluate(rgb, lit, bands, d), "evaluate");
            value = MEASURE_PI * rgb[0];
        }
        fprintf(f, "%c%.1f %.1f", i ? 'L' : 'M', 70 + 2.7 * i, 290 - 230 * value);
    }
    fprintf(f, "\"/>\n<text x=\"400\" y=\"%d\" fill=\"%s\">%s</text>\n", 84 + 20 * row, colour,
            name);
}

static void draw_ringing(const char *folder) {
    FILE *f =
        svg_open(folder, "ringing.svg", 600, 370, "Irradiance of one light, by the angle to it");
    envmap_lobe diffuse = envmap_lobe_diffuse();
    double sh[108], windowed[108];
    int i;
    fprintf(f, "<path d=\"M70 290H556M70 60H556\" stroke=\"#999\"/>\n"
               "<text x=\"62\" y=\"294\" text-anchor=\"end\">0</text>"
               "<text x=\"62\" y=\"64\" text-anchor=\"end\">1</text>\n");
    for (i = 0; i <= 180; i += 45)
        fprintf(f, "<text x=\"%.0f\" y=\"335\" text-anchor=\"middle\">%d&#176;</text>\n",
                70 + 2.7 * i, i);
    svg_text(f, 313, 358, 13, "middle", "#444", "angle from the light to the normal");
    svg_text(f, 170, 48, 12, "start", "#444", "irradiance, 1: facing the light");
    ringing_curve(f, NULL, 0, "#222", "exact: max(cos, 0)", 0);
    light(sh, 3);
    ringing_curve(f, sh, 3, svg_colours[2], "3 bands", 1);
    measure_must(envmap_sh_window(windowed, NULL, sh, 3, &diffuse, 0), "window");
    ringing_curve(f, windowed, 3, svg_colours[0], "3 bands, windowed", 2);
    light(sh, 6);
    ringing_curve(f, sh, 6, svg_colours[1], "6 bands", 3);
    svg_close(f);
}

/* A ball whose negative irradiance is shown as magenta. */
static int ringing_point(float rgb[3], float s, float t, const void *user) {
    float n[3], r2;
    n[0] = 2 * s - 1, n[1] = 1 - 2 * t;
    r2 = n[0] * n[0] + n[1] * n[1];
    if (r2 > 1) return 0;
    n[2] = sqrtf(1 - r2);
    envmap_lookup(rgb, (const envmap *)user, n, 0);
    if (rgb[0] < 0 || rgb[1] < 0 || rgb[2] < 0) rgb[0] = 1.5f, rgb[1] = 0.05f, rgb[2] = 1;
    return 1;
}

static void ringing_ball(picture *p, int i, const envmap *map, const char *caption) {
    int x = 24 + 244 * i;
    picture_draw(p, x, 24, 220, 220, 0.9f, ringing_point, map);
    picture_caption(p, (float)(x + 110), 262, 12, 0xF3F1ECu, caption);
}

/* Two lamps in the dark light a ball, turned so that we see where they do not. */
static void draw_balls(const char *folder) {
    static const double lamp[3] = {-0.75, 0.45, -0.5};
    envmap_lobe diffuse = envmap_lobe_diffuse();
    envmap_filter_desc desc = {0};
    envmap source = cube(64), map = cube(64);
    picture p;
    double sh[108], out[108], lit[108];
    char path[5000];
    int face, y, x, c;
    desc.method = ENVMAP_METHOD_REFERENCE;
    for (face = 0; face < 6; face++)
        for (y = 0; y < 64; y++)
            for (x = 0; x < 64; x++) {
                float d[3], *texel = envmap_texel(&source, 0, 0, face, x, y);
                double a;
                envmap_direction(d, ENVMAP_CUBE, face, ((float)x + 0.5f) / 64,
                                 ((float)y + 0.5f) / 64);
                a = lamp[0] * (double)d[0] + lamp[1] * (double)d[1] + lamp[2] * (double)d[2];
                for (c = 0; c < 3; c++)
                    texel[c] = a > 0.985 ? 60.0f - 6.0f * (float)c : 0.02f + 0.01f * (float)c;
            }
    if (!picture_create(&p, 1000, 290)) measure_must(ENVMAP_ERROR_MEMORY, "picture");
    picture_rectangle(&p, 0, 0, p.width, p.height, 0x15171Cu, 1);
    measure_must(envmap_filter(&map, &source, &diffuse, &desc), "filter");
    ringing_ball(&p, 0, &map, "exact");
    measure_must(envmap_sh_project(sh, 6, &source, 0, 0, NULL), "project");
    measure_must(envmap_sh_convolve(lit, sh, 3, &diffuse, 0), "convolve");
    measure_must(envmap_sh_fill(&map, 0, 0, lit, 3, 0, NULL), "fill");
    ringing_ball(&p, 1, &map, "3 bands");
    measure_must(envmap_sh_window(out, NULL, sh, 3, &diffuse, 0), "window");
    measure_must(envmap_sh_convolve(lit, out, 3, &diffuse, 0), "convolve");
    measure_must(envmap_sh_fill(&map, 0, 0, lit, 3, 0, NULL), "fill");
    ringing_ball(&p, 2, &map, "3 bands, windowed");
    measure_must(envmap_sh_convolve(lit, sh, 6, &diffuse, 0), "convolve");
    measure_must(envmap_sh_fill(&map, 0, 0, lit, 6, 0, NULL), "fill");
    ringing_ball(&p, 3, &map, "6 bands");
    snprintf(path, sizeof path, "%s/ringing.png", folder);
    if (!picture_save(&p, path)) measure_must(ENVMAP_ERROR_FILE, path);
    picture_free(&p);
    envmap_free(&source), envmap_free(&map);
}

/* ------------------------------------------------------------------------------------ >>main -- */

int main(int argc, char **argv) {
    const char *docs = argc > 2 && !strcmp(argv[1], "--docs") ? argv[2] : NULL;
    int k;
    load_scenes(argv + (docs ? 3 : 1));
    table_of_sizes();
    table_of_tolerances();
    table_of_bands();
    table_of_ringing();
    table_of_needs();
    table_of_speed();
    if (docs) {
        char path[4096];
        draw_bands(docs), draw_ringing(docs);
        snprintf(path, sizeof path, "%s/images", docs);
        draw_balls(path);
        snprintf(path, sizeof path, "%s/harmonics.md", docs);
        measure_write(&document, path, "make harmonics");
    }
    measure_document_free(&document);
    for (k = 0; k < scene_count; k++) envmap_free(&scenes[k].map);
    return 0;
}
