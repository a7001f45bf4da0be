/* materials.c - every reflection model of the papers, and what engines use: the pictures and
   figures of docs/materials.md.

   What you will see: `materials DOCS` writes DOCS/images/materials.png, a row for each model (the
   truth by eq. 1, the model from its prefiltered maps, and how far they are apart),
   DOCS/images/drawn.png with the maps that are drawn by hand, DOCS/charts/fresnel-out.svg, and
   the tables between the marks of DOCS/materials.md. About a minute; progress goes to stderr.
       cc -O3 -std=c99 -I. examples/measure/materials.c -o materials -lm -lpthread

   >>tools    the scene, its views, the truth
   >>models   one function a model: radiance from n and v
   >>tables   errors
   >>main

   SPDX-License-Identifier: MIT */

#define _POSIX_C_SOURCE 200809L
#include "measure.h"

#include "../tool/picture.h"
#include "../tool/scenes.h"
#include "../tool/threads.h"

#include "../tool/brdfs.h"
#include "../methods/cabral.h"
#include "../methods/nonphotorealistic.h"
#include "svg.h"

/* ----------------------------------------------------------------------------------- >>tools -- */

enum { GRID = 40, BALL = 120, SOURCE = 32, MOST = 17 };

static envmap scene; /* a small cube of the terrace: eq. 1 sums all of it for every pixel */
static envmap_filter_desc desc; /* threads */
static threads_pool threads;
static measure_document document;
static FILE *page; /* its only section */
static float exposure = 0.52f;

/* The sun's disc is brought down, so that 6 x 32^2 texels are scene enough. */
static void make_scene(void) {
    envmap wide, fine;
    size_t i;
    wide = measure_map(ENVMAP_LATLONG, 256, 1, 1);
    fine = measure_map(ENVMAP_CUBE, 128, 1, 1);
    scene = measure_map(ENVMAP_CUBE, SOURCE, 1, 1);
    scene_fill(&wide, SCENE_SUN);
    for (i = 0; i < 3u * 512 * 256; ++i) wide.texels[i] = fminf(wide.texels[i], 200);
    measure_must(envmap_resample(&fine, &wide, NULL), "resample");
    measure_must(envmap_resample(&scene, &fine, NULL), "resample");
    envmap_free(&wide);
    envmap_free(&fine);
}

static void unit(float v[3]) {
    float length = sqrtf(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    int k;
    for (k = 0; k < 3; ++k) v[k] /= length > 0 ? length : 1;
}

/* The ball, seen from +z far away; t along its circles of latitude. */
static int ball_frame(envmap_frame *f, float x, float y) {
    float r2 = x * x + y * y;
    if (r2 >= 0.998f) return 0;
    f->n[0] = x, f->n[1] = y, f->n[2] = sqrtf(1 - r2);
    f->t[0] = f->n[2], f->t[1] = 0, f->t[2] = -x;
    f->v[0] = f->v[1] = 0, f->v[2] = 1;
    unit(f->t);
    return 1;
}

typedef struct ball {
    float rgb[GRID][GRID][3];
    int inside[GRID][GRID];
} ball;

typedef void model_call(float rgb[3], const envmap_frame *f, const void *user);

static void shade(ball *b, model_call *call, const void *user) {
    int i, j;
    envmap_frame f;
    for (j = 0; j < GRID; ++j)
        for (i = 0; i < GRID; ++i) {
            b->inside[j][i] =
                ball_frame(&f, 2 * ((float)i + 0.5f) / GRID - 1, 1 - 2 * ((float)j + 0.5f) / GRID);
            memset(b->rgb[j][i], 0, sizeof b->rgb[j][i]);
            if (b->inside[j][i]) call(b->rgb[j][i], &f, user);
        }
}

/* Eq. 1 in an environment, at all pixels at once. */
static void shade_exactly(ball *b, const envmap *map, envmap_brdf_function *function,
                          brdf_values *values) {
    static envmap_frame frames[GRID * GRID];
    static float rgb[GRID * GRID][3];
    envmap_brdf brdf;
    int i, j, n = 0;
    brdf.function = function, brdf.user = values;
    for (j = 0; j < GRID; ++j)
        for (i = 0; i < GRID; ++i)
            n += b->inside[j][i] = ball_frame(frames + n, 2 * ((float)i + 0.5f) / GRID - 1,
                                              1 - 2 * ((float)j + 0.5f) / GRID);
    measure_must(envmap_radiance(rgb[0], map, &brdf, frames, n, &desc.work), "eq. 1");
    n = 0;
    for (j = 0; j < GRID; ++j)
        for (i = 0; i < GRID; ++i) {
            memset(b->rgb[j][i], 0, sizeof b->rgb[j][i]);
            if (b->inside[j][i]) memcpy(b->rgb[j][i], rgb[n++], sizeof rgb[0]);
        }
}

static void shade_truth(ball *b, envmap_brdf_function *function, brdf_values *values) {
    shade_exactly(b, &scene, function, values);
}

/* Relative rms where n.v is in [from, to). */
static double apart(const ball *a, const ball *b, double from, double to) {
    double off = 0, sum = 0;
    int i, j, c;
    envmap_frame f;
    for (j = 0; j < GRID; ++j)
        for (i = 0; i < GRID; ++i)
            if (ball_frame(&f, 2 * ((float)i + 0.5f) / GRID - 1,
                           1 - 2 * ((float)j + 0.5f) / GRID) &&
                (double)f.n[2] >= from && (double)f.n[2] < to)
                for (c = 0; c < 3; ++c) {
                    double d = (double)a->rgb[j][i][c] - (double)b->rgb[j][i][c];
                    off += d * d, sum += (double)b->rgb[j][i][c] * (double)b->rgb[j][i][c];
                }
    return sum > 0 ? sqrt(off / sum) : 0;
}

/* A ball as a picture: its grid, bilinear. */
static int ball_point(float rgb[3], float s, float t, const void *user) {
    const ball *b = (const ball *)user;
    float x = s * GRID - 0.5f, y = t * GRID - 0.5f, total = 0;
    int i, k, c;
    if ((2 * s - 1) * (2 * s - 1) + (2 * t - 1) * (2 * t - 1) > 0.98f) return 0;
    rgb[0] = rgb[1] = rgb[2] = 0;
    for (k = 0; k < 4; ++k) {
        int at_x = (int)floorf(x) + k % 2, at_y = (int)floorf(y) + k / 2;
        float w = (1 - fabsf(x - (float)at_x)) * (1 - fabsf(y - (float)at_y));
        if (at_x < 0 || at_y < 0 || at_x >= GRID || at_y >= GRID || !b->inside[at_y][at_x])
            continue;
        for (c = 0; c < 3; ++c) rgb[c] += w * b->rgb[at_y][at_x][c];
        total += w;
    }
    for (i = 0; i < 3; ++i) rgb[i] /= total > 0 ? total : 1;
    return total > 0;
}

/* ---------------------------------------------------------------------------------- >>models -- */

/* What models look up. */
typedef struct looks {
    envmap map[3];
    envmap_fit fit;
    brdf_values values;
    cabral views;
    float offset[64], weight[64];
    int taps;
    double scale;
} looks;

static void reflect(float r[3], const envmap_frame *f) {
    float nv = f->n[0] * f->v[0] + f->n[1] * f->v[1] + f->n[2] * f->v[2];
    int k;
    for (k = 0; k < 3; ++k) r[k] = 2 * nv * f->n[k] - f->v[k];
}

static void look_scaled(float rgb[3], const envmap *map, const float d[3], double scale) {
    int c;
    envmap_lookup(rgb, map, d, 0);
    for (c = 0; c < 3; ++c) rgb[c] *= (float)scale;
}

static void by_normal(float rgb[3], const envmap_frame *f, const void *user) {
    const looks *l = (const looks *)user;
    look_scaled(rgb, l->map, f->n, l->scale);
}

static void by_reflection(float rgb[3], const envmap_frame *f, const void *user) {
    const looks *l = (const looks *)user;
    float r[3];
    reflect(r, f);
    look_scaled(rgb, l->map, r, l->scale);
}

static void by_fit(float rgb[3], const envmap_frame *f, const void *user) {
    const looks *l = (const looks *)user;
    envmap_fit_lookup(rgb, &l->fit, l->map, f->n, f->v);
}

/* f0 scale + bias, and the multiple bounces over the diffuse map. */
static void by_split_sum(float rgb[3], const envmap_frame *f, const void *user) {
    const looks *l = (const looks *)user;
    double scale, bias;
    float r[3];
    int c;
    reflect(r, f);
    envmap_ggx_split_sum(&scale, &bias, (double)f->n[2], l->values.alpha);
    envmap_lookup(rgb, l->map, r, 0);
    for (c = 0; c < 3; ++c)
        rgb[c] *= (float)(l->values.fresnel ? l->values.colour[c] * scale + bias : scale + bias);
}

static void by_banks(float rgb[3], const envmap_frame *f, const void *user) {
    const looks *l = (const looks *)user;
    envmap_lookup_slice(rgb, l->map, f->t, f->t[2], 0);
}

/* For Ward: Banks' fibres along n x t, as bright in a constant environment at every c = v.t. */
static void by_fibres(float rgb[3], const envmap_frame *f, const void *user) {
    float b[3], s;
    int c;
    b[0] = f->n[1] * f->t[2] - f->n[2] * f->t[1];
    b[1] = f->n[2] * f->t[0] - f->n[0] * f->t[2];
    b[2] = f->n[0] * f->t[1] - f->n[1] * f->t[0];
    s = sqrtf(fmaxf(1 - b[2] * b[2], 1e-4f));
    envmap_lookup_slice(rgb, ((const looks *)user)->map, b, b[2], 0);
    for (c = 0; c < 3; ++c) rgb[c] /= s;
}

static void by_arc(float rgb[3], const envmap_frame *f, const void *user) {
    const looks *l = (const looks *)user;
    int c;
    envmap_lookup_fan(rgb, l->map, f->n, f->t, f->v, l->offset, l->weight, l->taps);
    for (c = 0; c < 3; ++c) rgb[c] *= (float)l->scale;
}

/* The same taps on the great circle through r_v: constant shape. */
static void by_great_circle(float rgb[3], const envmap_frame *f, const void *user) {
    const looks *l = (const looks *)user;
    float r[3];
    int c;
    reflect(r, f);
    envmap_lookup_fan(rgb, l->map, r, f->t, r, l->offset, l->weight, l->taps);
    for (c = 0; c < 3; ++c) rgb[c] *= (float)l->scale;
}

static void by_views(float rgb[3], const envmap_frame *f, const void *user) {
    cabral_lookup(rgb, &((const looks *)user)->views, f->n, f->v);
}

static void prefilter(envmap *map, int mapping, int size, int slices, envmap_lobe lobe) {
    envmap_filter_desc set = desc;
    set.method = ENVMAP_METHOD_REFERENCE; /* the source is small */
    *map = measure_map(mapping, size, 1, slices);
    measure_must(envmap_filter(map, &scene, &lobe, &set), "filter");
}

static void fit_of(looks *l, envmap_brdf_function *function, int lobes, int slices, int flat) {
    envmap_brdf brdf;
    int i;
    brdf.function = function, brdf.user = &l->values;
    memset(&l->fit, 0, sizeof l->fit);
    l->fit.lobes = lobes, l->fit.slices = slices, l->fit.flat = flat, l->fit.size = 129;
    measure_must(envmap_fit_brdf(&l->fit, &brdf, &desc.work), "fit");
    for (i = 0; i < lobes; ++i)
        prefilter(l->map + i, ENVMAP_CUBE, 16, flat ? 1 : slices, envmap_fit_lobe(&l->fit, i));
}

static void release(looks *l) {
    int i;
    for (i = 0; i < 3; ++i) envmap_free(l->map + i);
    envmap_fit_free(&l->fit);
    if (l->views.maps) cabral_free(&l->views);
}

/* ---------------------------------------------------------------------------------- >>tables -- */

static picture sheet;
static int row;
enum { LEFT = 250, ROW = BALL + 16, TOP = 64 };

/* A row of the sheet and of the table: the truth, the model, and `times` their difference. */
static void show_times(const char *name, const char *remark, const ball *truth, const ball *b,
                       float times) {
    static ball difference;
    int i, j, c, y = TOP + row * ROW;
    difference = *truth;
    for (j = 0; j < GRID; ++j)
        for (i = 0; i < GRID; ++i)
            for (c = 0; c < 3; ++c)
                difference.rgb[j][i][c] = times * fabsf(b->rgb[j][i][c] - truth->rgb[j][i][c]);
    picture_text(&sheet, 20, (float)y + 40, 13, 0xF3F1ECu, name);
    picture_text(&sheet, 20, (float)y + 64, 10, 0x9AA0ABu, remark);
    picture_draw(&sheet, LEFT, y, BALL, BALL, exposure, ball_point, truth);
    picture_draw(&sheet, LEFT + BALL + 16, y, BALL, BALL, exposure, ball_point, b);
    picture_draw(&sheet, LEFT + 2 * (BALL + 16), y, BALL, BALL, exposure, ball_point, &difference);
    fprintf(page, "| %s | %s | %.1f %% | %.1f %% | %.1f %% | %.1f %% |\n", name, remark,
            100 * apart(b, truth, 0, 2), 100 * apart(b, truth, 0.7, 2),
            100 * apart(b, truth, 0.35, 0.7), 100 * apart(b, truth, 0, 0.35));
    fprintf(stderr, "materials: %2d/%d %s\n", ++row, MOST - 1, name);
}

static void show(const char *name, const char *remark, const ball *truth, const ball *b) {
    show_times(name, remark, truth, b, 4);
}

static void zonal_rows(void) {
    static ball truth, b;
    looks l = {0};
    envmap_lobe lobe;
    l.values.colour[0] = l.values.colour[1] = l.values.colour[2] = 0.6;
    l.scale = 0.6;
    prefilter(l.map, ENVMAP_CUBE, 16, 1, envmap_lobe_diffuse());
    shade_truth(&truth, brdf_lambert, &l.values), shade(&b, by_normal, &l);
    show("diffuse", "axis n", &truth, &b);
    release(&l);
    lobe = envmap_lobe_phong(40), lobe.raw = 1, lobe.scale = 5, l.scale = 0.2,
    l.values.exponent = 40;
    prefilter(l.map, ENVMAP_CUBE, 32, 1, lobe);
    shade_truth(&truth, brdf_phong, &l.values);
    l.scale = 1.0 / 5, shade(&b, by_reflection, &l);
    show("Phong, N = 40", "axis r; no n.l, no horizon", &truth, &b);
    release(&l);
}

static void fit_rows(void) {
    static ball truth, b;
    looks l = {0};
    l.values.alpha = l.values.alpha_y = 0.3, l.values.exponent = 20;
    shade_truth(&truth, brdf_ggx, &l.values);
    fit_of(&l, brdf_ggx, 1, 16, 1), shade(&b, by_fit, &l);
    show("GGX 0.3, 2D form", "axis near r; factor(n.v)", &truth, &b), release(&l);
    fit_of(&l, brdf_ggx, 1, 16, 0), shade(&b, by_fit, &l);
    show("GGX 0.3, 3D form", "slices of n.v", &truth, &b), release(&l);
    fit_of(&l, brdf_ggx, 2, 16, 0), shade(&b, by_fit, &l);
    show("GGX 0.3, two lobes", "slices, axes near r and n", &truth, &b), release(&l);
    prefilter(l.map, ENVMAP_CUBE, 32, 1, envmap_lobe_ggx(0.3f)), shade(&b, by_split_sum, &l);
    show("GGX 0.3, split sum", "n = v = r; scale + bias", &truth, &b), release(&l);
    shade_truth(&truth, brdf_ward, &l.values);
    fit_of(&l, brdf_ward, 1, 16, 0), shade(&b, by_fit, &l);
    show("Ward 0.3, 3D form", "slices of n.v", &truth, &b), release(&l);
    shade_truth(&truth, brdf_lafortune, &l.values);
    fit_of(&l, brdf_lafortune, 1, 16, 0), shade(&b, by_fit, &l);
    show("Lafortune N = 20", "3D form", &truth, &b), release(&l);
    l.values.alpha = 0.5, l.values.colour[0] = l.values.colour[1] = l.values.colour[2] = 0.6;
    shade_truth(&truth, brdf_oren_nayar, &l.values);
    fit_of(&l, brdf_oren_nayar, 1, 16, 0), shade(&b, by_fit, &l);
    show("Oren-Nayar, one lobe", "not glossy: a warning", &truth, &b), release(&l);
    fit_of(&l, brdf_oren_nayar, 3, 8, 0), shade(&b, by_fit, &l);
    show("Oren-Nayar, three lobes", "axes near r, n and v", &truth, &b), release(&l);
}

/* What the model reflects of a constant environment, outside the lookup. */
static void multiply(ball *b, const ball *factor) {
    int i, j, c;
    for (j = 0; j < GRID; ++j)
        for (i = 0; i < GRID; ++i)
            for (c = 0; c < 3; ++c) b->rgb[j][i][c] *= factor->rgb[j][i][c];
}

static void anisotropic_rows(void) {
    static ball truth, b, factor;
    envmap constant;
    char remark[64];
    int i;
    looks l = {0};
    envmap_lobe lobe = envmap_lobe_banks(0.8f);
    l.values.s = 0.8, lobe.raw = 1;
    prefilter(l.map, ENVMAP_PARABOLOID, 24, 32, lobe);
    exposure = 0.015f; /* Banks' sum is not normalised, and its map lets light through */
    shade_truth(&truth, brdf_banks, &l.values), shade(&b, by_banks, &l);
    show_times("Banks s = 0.8", "axis t, slices of v.t; 1 x apart", &truth, &b, 1);
    shade_truth(&truth, brdf_banks_shadowed, &l.values);
    show_times("... and with n.l", "the map has none; 1 x apart", &truth, &b, 1);
    exposure = 0.52f;
    release(&l);
    /* Ward, strokes along n x t: sigma of the reflected direction is sqrt 2 alpha */
    l.values.alpha = 0.28, l.values.alpha_y = 0.07, l.scale = 1;
    l.taps = envmap_fan(l.offset, l.weight, 64, 1.414 * 0.28, 1.414 * 0.07, 0.05);
    prefilter(l.map, ENVMAP_CUBE, 32, 1, envmap_lobe_gaussian((float)(1 / (2 * 0.07 * 0.07))));
    shade_truth(&truth, brdf_ward, &l.values);
    constant = measure_map(ENVMAP_CUBE, SOURCE, 1, 1);
    for (i = 0; i < 18 * SOURCE * SOURCE; ++i) constant.texels[i] = 1;
    shade_exactly(&factor, &constant, brdf_ward, &l.values);
    sprintf(remark, "2D map, %d taps, factor(v)", l.taps);
    shade(&b, by_great_circle, &l), multiply(&b, &factor);
    show("Ward 4 : 1, great circle", remark, &truth, &b);
    shade(&b, by_arc, &l), multiply(&b, &factor);
    show("Ward 4 : 1, arc", remark, &truth, &b);
    release(&l);
    prefilter(l.map, ENVMAP_PARABOLOID, 16, 32, envmap_lobe_banks(0.95f));
    shade(&b, by_fibres, &l), multiply(&b, &factor);
    show_times("Ward 4 : 1 by Banks 0.95", "32 slices, factor(v); 1 x apart", &truth, &b, 1);
    envmap_free(&constant);
    release(&l);
}

static void cabral_row(void) {
    static ball truth, b;
    looks l = {0};
    envmap_brdf brdf;
    l.values.alpha = l.values.alpha_y = 0.3;
    brdf.function = brdf_ggx, brdf.user = &l.values;
    shade_truth(&truth, brdf_ggx, &l.values);
    measure_must(cabral_create(&l.views, &scene, &brdf, 1, 24, &desc), "views");
    shade(&b, by_views, &l);
    show("GGX 0.3, Cabral", "seen from one of 6 stored views", &truth, &b);
    release(&l);
}

/* F out of the integral: eq. 1 with Schlick's term inside, against F(n.v) times eq. 1 without. */
static void fresnel_table(void) {
    static const double alphas[5] = {0.05, 0.1, 0.25, 0.5, 1};
    static const double cosines[6] = {0.1, 0.2, 0.35, 0.5, 0.75, 1};
    int i, j;
    fprintf(page,
            "\nF taken out of the glossy integral, F(n.v) with f0 = 0.04, over what it is inside "
            "(constant environment):\n\n"
            "| alpha | n.v = 0.1 | 0.2 | 0.35 | 0.5 | 0.75 | 1 |\n|---|---|---|---|---|---|---|\n");
    for (i = 0; i < 5; ++i) {
        fprintf(page, "| %g |", alphas[i]);
        for (j = 0; j < 6; ++j) {
            double scale, bias;
            envmap_ggx_split_sum(&scale, &bias, cosines[j], alphas[i]);
            fprintf(page, " %+.0f %% |",
                    100 * (envmap_fresnel_schlick(cosines[j], 0.04) * (scale + bias) /
                               (0.04 * scale + bias) -
                           1));
        }
        fprintf(page, "\n");
    }
}

static void fresnel_chart(const char *docs) {
    static const double alphas[4] = {0.05, 0.1, 0.25, 0.5};
    FILE *f = svg_open(docs, "fresnel-out.svg", 660, 400,
                       "F(n.v) outside the integral, over F inside (f0 = 0.04)");
    int i, j;
    for (j = 0; j <= 4; ++j)
        fprintf(f,
                "<path d=\"M70 %d H540\" stroke=\"#ddd\"/><text x=\"62\" y=\"%d\" "
                "text-anchor=\"end\">%d</text>\n",
                350 - 75 * j, 354 - 75 * j, j + 1);
    for (j = 0; j <= 90; j += 15)
        fprintf(f, "<text x=\"%.0f\" y=\"370\" text-anchor=\"middle\">%d&#176;</text>\n",
                70 + 470 * j / 90.0, j);
    fprintf(f, "<text x=\"305\" y=\"390\" text-anchor=\"middle\">angle of n and v</text>\n");
    for (i = 0; i < 4; ++i) {
        fprintf(f, "<path fill=\"none\" stroke=\"%s\" stroke-width=\"2\" d=\"", svg_colours[i]);
        for (j = 0; j <= 88; ++j) {
            double c = cos(j * BRDF_PI / 180), scale, bias;
            envmap_ggx_split_sum(&scale, &bias, c, alphas[i]);
            double ratio = envmap_fresnel_schlick(c, 0.04) * (scale + bias) / (0.04 * scale + bias);
            if (ratio > 5) break;
            fprintf(f, "%c%.1f %.1f", j ? 'L' : 'M', 70 + 470 * j / 90.0, 350 - 75 * (ratio - 1));
        }
        fprintf(f, "\"/><text x=\"552\" y=\"%d\" fill=\"%s\">alpha = %g</text>\n", 80 + 22 * i,
                svg_colours[i], alphas[i]);
    }
    fprintf(f, "<text x=\"552\" y=\"190\" fill=\"#444\">cut at 5: the</text>\n"
               "<text x=\"552\" y=\"206\" fill=\"#444\">table goes on</text>\n"
               "<text x=\"70\" y=\"42\" fill=\"#444\">ratio, no unit</text>\n");
    svg_close(f);
}

/* A Banks lobe whose p is the angle between v and t, over pi. */
static double banks_by_angle(double x, double p, void *user) {
    envmap_lobe lobe = envmap_lobe_banks(*(const float *)user);
    return envmap_lobe_value(&lobe, x, cos(p * BRDF_PI));
}

static void slices_table(void) {
    static const float s[4] = {0.1f, 0.5f, 0.8f, 0.95f};
    int i, k;
    fprintf(page, "\nSlices that a Banks map needs (`envmap_lobe_slices`), at even cosines v.t, or "
                  "at even angles (a function lobe):\n\n"
                  "| s | 10 %% | 3 %% | 1 %% | 10 %%, angles | 3 %%, angles | 1 %%, angles "
                  "|\n|---|---|---|---|---|---|---|\n");
    for (i = 0; i < 4; ++i) {
        static const double tolerance[3] = {0.1, 0.03, 0.01};
        float value = s[i];
        envmap_lobe cosines = envmap_lobe_banks(value),
                    angles = envmap_lobe_function(banks_by_angle, &value);
        angles.p0 = 0, angles.p1 = 1;
        fprintf(page, "| %g |", (double)value);
        for (k = 0; k < 6; ++k)
            fprintf(page, " %d |",
                    envmap_lobe_slices(k < 3 ? &cosines : &angles, tolerance[k % 3]));
        fprintf(page, "\n");
    }
}

static void lobes_table(void) {
    static const struct {
        const char *name;
        envmap_brdf_function *function;
        double alpha;
    } models[5] = {{"GGX 0.1", brdf_ggx, 0.1},
                   {"GGX 0.3", brdf_ggx, 0.3},
                   {"Ward 0.2", brdf_ward, 0.2},
                   {"Lafortune N = 20", brdf_lafortune, 0},
                   {"Oren-Nayar 0.5", brdf_oren_nayar, 0.5}};
    int i, lobes, k, at, needed = 0;
    double m[3] = {0, 0, 0};
    fprintf(page, "\nThe lobes themselves, `fit.error` (rms over l, what a single light shows) at "
                  "n.v = 0.94, 0.56, 0.19, slices for 3 %%, and the axis m of one 3D lobe:\n\n"
                  "| model | one lobe, 2D | one lobe, 3D | two | three | slices | m "
                  "|\n|---|---|---|---|---|---|---|\n");
    for (i = 0; i < 5; ++i) {
        fprintf(page, "| %s |", models[i].name);
        for (lobes = 0; lobes <= 3; ++lobes) {
            brdf_values values = {{1, 1, 1}, 0, 0, 20, 0, 0};
            envmap_brdf brdf;
            envmap_fit fit = {0};
            values.alpha = values.alpha_y = models[i].alpha;
            brdf.function = models[i].function, brdf.user = &values;
            fit.lobes = lobes ? lobes : 1, fit.flat = !lobes, fit.slices = lobes == 1 ? 64 : 8;
            measure_must(envmap_fit_brdf(&fit, &brdf, &desc.work), "fit");
            k = fit.slices / 8;
            fprintf(page, " %.2f, %.2f, %.2f |", (double)fit.error[7 * k + k / 2],
                    (double)fit.error[4 * k + k / 2], (double)fit.error[k + k / 2]);
            if (lobes == 1) {
                envmap_lobe lobe = envmap_fit_lobe(&fit, 0);
                needed = envmap_lobe_slices(&lobe, 0.03);
                for (at = 0; at < 3; ++at) m[at] = (double)fit.axis[(7 - 3 * at) * k + k / 2];
            }
            envmap_fit_free(&fit);
        }
        fprintf(page, " %d | %.2f, %.2f, %.2f |\n", needed, m[0], m[1], m[2]);
        fprintf(stderr, "materials: fits of %s\n", models[i].name);
    }
}

static void views_table(void) {
    static const float view[3] = {0.5f, 0.3f, 0.81f};
    looks l = {0};
    envmap_brdf brdf;
    int m, i;
    l.values.alpha = l.values.alpha_y = 0.3;
    brdf.function = brdf_ggx, brdf.user = &l.values;
    fprintf(page, "\nCabral's maps, GGX 0.3, seen between three views, rms against eq. 1:\n\n| "
                  "views | rms |\n|---|---|\n");
    for (m = 1; m <= 3; ++m) {
        double off = 0, sum = 0;
        measure_must(cabral_create(&l.views, &scene, &brdf, m, 24, &desc), "views");
        for (i = 0; i < 200; ++i) {
            envmap_frame f;
            float rgb[3], truth[3], d[3];
            int k;
            envmap_direction(d, ENVMAP_LATLONG, 0,
                             (float)i * 0.618034f - floorf((float)i * 0.618034f),
                             ((float)i + 0.5f) / 200);
            for (k = 0; k < 3; ++k) f.v[k] = view[k], f.t[k] = 0, f.n[k] = d[k] + 1.1f * view[k];
            measure_must(envmap_radiance(truth, &scene, &brdf, &f, 1, NULL), "eq. 1");
            cabral_lookup(rgb, &l.views, f.n, f.v);
            for (k = 0; k < 3; ++k)
                off += (double)((rgb[k] - truth[k]) * (rgb[k] - truth[k])),
                    sum += (double)(truth[k] * truth[k]);
        }
        fprintf(page, "| %d | %.1f %% |\n", l.views.count, 100 * sqrt(off / sum));
        cabral_free(&l.views);
        fprintf(stderr, "materials: %d views\n", 4 * m * m + 2);
    }
}

/* The hand-drawn maps; the silhouette at four levels, as large as the first. */
static void drawn(const char *docs) {
    picture p;
    char path[4096];
    int k, l;
    if (!picture_create(&p, 4 * 220 + 20, 260)) measure_must(ENVMAP_ERROR_MEMORY, "drawn.png");
    picture_rectangle(&p, 0, 0, p.width, p.height, 0x5C6068u, 1);
    for (k = 0; k < 4; ++k) {
        envmap map = {0};
        int x = 20 + k * 220;
        measure_must(envmap_create(&map, ENVMAP_SPHERE, 128, 4, 1), "a drawn map");
        measure_must(npr_example(&map, k), npr_name[k]);
        for (l = 0; l < 4; ++l) { /* each level one texel a pixel, as it is on a screen */
            int edge = 128 >> l, i, j, at_x = x + (l ? 140 : 0),
                at_y = 60 + (l == 2   ? 70
                             : l == 3 ? 108
                                      : 0);
            for (j = 0; j < edge; ++j)
                for (i = 0; i < edge; ++i) {
                    float X = (2 * (float)i + 1) / (float)edge - 1,
                          Y = (2 * (float)j + 1) / (float)edge - 1, light[3];
                    const float *t = envmap_texel(&map, l, 0, 0, i, j);
                    int c;
                    for (c = 0; c < 3; ++c) light[c] = picture_curve(t[c]);
                    if (X * X + Y * Y <= 1)
                        picture_blend(&p, at_x + i, at_y + j, picture_colour(light), 1);
                }
        }
        picture_caption(&p, (float)x + 64, 212, 13, 0xF3F1ECu, npr_name[k]);
        envmap_free(&map);
    }
    picture_text(&p, 20, 20, 12, 0xF3F1ECu, "levels 0 to 3, a texel a pixel");
    snprintf(path, sizeof path, "%s/images/drawn.png", docs);
    if (!picture_save(&p, path)) measure_must(ENVMAP_ERROR_FILE, path);
    picture_free(&p);
}

/* ------------------------------------------------------------------------------------ >>main -- */

int main(int argc, char **argv) {
    char path[4096];
    if (argc != 2) {
        fprintf(stderr, "usage: materials DOCS\n");
        return 2;
    }
    threads_begin(&threads, threads_here());
    desc.work.executor.run = threads_run, desc.work.executor.user = &threads;
    page = measure_begin(&document, "tables");
    make_scene();
    if (!picture_create(&sheet, LEFT + 3 * (BALL + 16) + 8, TOP + (MOST - 1) * ROW))
        measure_must(ENVMAP_ERROR_MEMORY, "sheet");
    picture_rectangle(&sheet, 0, 0, sheet.width, sheet.height, 0x15171Cu, 1);
    picture_caption(&sheet, LEFT + BALL / 2, 28, 13, 0xF3F1ECu, "eq. 1");
    picture_caption(&sheet, LEFT + BALL * 3 / 2 + 16, 28, 13, 0xF3F1ECu, "from maps");
    picture_caption(&sheet, LEFT + BALL * 5 / 2 + 32, 28, 13, 0xF3F1ECu, "4 x apart");
    fprintf(page,
            "\nImages of a ball, rms against eq. 1 (a terrace in the sun, 6 x 32 x 32 texels):\n\n"
            "| model | map | whole ball | n.v > 0.7 | 0.35 to 0.7 | < 0.35 "
            "|\n|---|---|---|---|---|---|\n");
    zonal_rows();
    fit_rows();
    anisotropic_rows();
    cabral_row();
    fresnel_table();
    slices_table();
    lobes_table();
    views_table();
    fresnel_chart(argv[1]);
    drawn(argv[1]);
    snprintf(path, sizeof path, "%s/images/materials.png", argv[1]);
    if (!picture_save(&sheet, path)) measure_must(ENVMAP_ERROR_FILE, path);
    picture_free(&sheet);
    envmap_free(&scene);
    measure_end(&document, page, 1);
    snprintf(path, sizeof path, "%s/materials.md", argv[1]);
    measure_write(&document, path, "make materials");
    measure_document_free(&document);
    threads_end(&threads);
    return 0;
}
