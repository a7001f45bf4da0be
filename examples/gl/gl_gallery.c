/* gl_gallery.c - the figures of docs/gallery.md that no other example draws, headless.

   What you will see, in the folder that is named (default: here):
     teapots.png   one teapot through every kind of map
     fresnel.png   a coat of index 1.5, 5 and 200 (rows): the mirror alone, over diffuse light,
                   blended with it by 1 - F
     filters.png   N = 100 on a torus: unfiltered, the reference, and four ways that are as old
     errors.png    N = 100 on a ball by every method there is here
                   the last two with heat maps of how far a way is from the reference

   usage: gl_gallery [FOLDER]

   SPDX-License-Identifier: MIT */

#include "stage.h"
#include "../tool/brdfs.h"
#include "../methods/box_levels.h"
#include "../methods/importance_sampling.h"
#include "../methods/paraboloid_convolution.h"
#include "../methods/separable_gaussian.h"
#include "../methods/summed_area.h"

typedef struct figures {
    gl_app app;
    stage st;
    gl_mesh meshes[GL_MESH_COUNT];
    const char *folder;
    envmap source, truth; /* of the comparisons: a cube of the studio, and it through N = 100 */
} figures;

/* Draws a teapot into a cell, with the stage's light behind it. */
static void teapot(figures *f, const surface *look, int column, int row, int columns, int rows) {
    surface s = *look;
    float model[16];
    mesh_identity(model);
    memcpy(s.sh, f->st.sh, sizeof s.sh);
    gl_cell(&f->app, column, row, columns, rows);
    surface_draw(f->st.surface, &f->app, &s, &f->meshes[GL_TEAPOT], model);
    stage_sky(&f->st, &f->app, 1);
}

static void label(picture *p, int column, int row, int columns, int rows, const char *text) {
    gl_write(p, text, column * p->width / columns + 14, (row + 1) * p->height / rows - 28);
}

static int save(figures *f, picture *p, const char *name) {
    char path[4096];
    int good;
    snprintf(path, sizeof path, "%s/%s", f->folder, name);
    good = picture_save(p, path);
    if (!good) fprintf(stderr, "cannot write %s\n", path), gl_errors++;
    picture_free(p);
    return good;
}

/* A cube of the environment through a lobe; 0 when that failed. */
static GLuint filtered(figures *f, int size, envmap_lobe lobe) {
    GLuint texture = 0;
    stage_say(stage_filter(&texture, &f->st, ENVMAP_CUBE, size, &lobe));
    return texture;
}

/* --------------------------------------------------------------------------------- >>fresnel -- */

static void fresnel_figure(figures *f) {
    static const float indices[3] = {1.5f, 5, 200};
    static const char *const under[3] = {"mirror only", "plus diffuse", "blended"};
    surface s = surface_default();
    picture p;
    char text[64];
    int i;
    s.map = f->st.sky;
    s.albedo[0] = 0.35f, s.albedo[1] = 0.03f, s.albedo[2] = 0.02f;
    gl_target_bind(&f->app.frame);
    for (i = 0; i < 9; i++) {
        s.index = indices[i / 3], s.diffuse = i % 3;
        teapot(f, &s, i % 3, i / 3, 3, 3);
    }
    if (!gl_shoot(&f->app, &p)) return;
    for (i = 0; i < 9; i++) {
        snprintf(text, sizeof text, "index %g, %s", (double)indices[i / 3], under[i % 3]);
        label(&p, i % 3, i / 3, 3, 3, text);
    }
    save(f, &p, "fresnel.png");
}

/* --------------------------------------------------------------------------------- >>methods -- */

static envmap_result unfiltered(envmap *dst, const envmap *src, const envmap_lobe *lobe,
                                const method_desc *desc) {
    (void)lobe, (void)desc;
    return envmap_resample(dst, src, NULL);
}

static envmap_result fast(envmap *dst, const envmap *src, const envmap_lobe *lobe,
                          const method_desc *desc) {
    (void)desc;
    return envmap_filter(dst, src, lobe, NULL);
}

static envmap_result hierarchical(envmap *dst, const envmap *src, const envmap_lobe *lobe,
                                  const method_desc *desc) {
    envmap_filter_desc filter = {0};
    (void)desc;
    filter.method = ENVMAP_METHOD_HIERARCHICAL;
    return envmap_filter(dst, src, lobe, &filter);
}

#define FORM(form)                                                                                 \
    { form, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0 }
#define ONE_MAP                                                                                    \
    { METHOD_PUBLISHED, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0 }
#define SAMPLES                                                                                    \
    { METHOD_MENDED, 0, 0, 0, 0, 0, 0, 32, 0, 0, 0, 0, 0, 0 }

/* NULL: the reference, which all are held against. */
static const method_row old_ways[6] = {
    {"unfiltered", unfiltered, FORM(0)},
    {"reference", NULL, FORM(0)},
    {"hierarchical", hierarchical, FORM(0)},
    {"7 x 7 taps, two passes", method_paraboloid_convolution, FORM(METHOD_PUBLISHED)},
    {"7 x 7 taps, one pass", method_paraboloid_convolution, ONE_MAP},
    {"one biased level", method_box_levels, FORM(METHOD_PUBLISHED)}};

static const method_row all_ways[12] = {
    {"reference", NULL, FORM(0)},
    {"fast, the default", fast, FORM(0)},
    {"hierarchical", hierarchical, FORM(0)},
    {"32 samples", method_importance_sampling, SAMPLES},
    {"two maps, published", method_paraboloid_convolution, FORM(METHOD_PUBLISHED)},
    {"two maps, mended", method_paraboloid_convolution, FORM(METHOD_MENDED)},
    {"Gaussian, published", method_separable_gaussian, FORM(METHOD_PUBLISHED)},
    {"Gaussian, mended", method_separable_gaussian, FORM(METHOD_MENDED)},
    {"box levels, published", method_box_levels, FORM(METHOD_PUBLISHED)},
    {"box levels, mended", method_box_levels, FORM(METHOD_MENDED)},
    {"summed areas, published", method_summed_area, FORM(METHOD_PUBLISHED)},
    {"summed areas, mended", method_summed_area, FORM(METHOD_MENDED)}};

/* The source and the truth, which takes seconds. */
static envmap_result compare_begin(figures *f) {
    envmap_lobe lobe = envmap_lobe_phong(100);
    envmap_filter_desc desc = f->st.desc;
    envmap_result result = envmap_create(&f->source, ENVMAP_CUBE, 128, 1, 1);
    desc.method = ENVMAP_METHOD_REFERENCE;
    if (!result) result = envmap_resample(&f->source, &f->st.environment, NULL);
    if (!result) result = envmap_create(&f->truth, ENVMAP_CUBE, 64, 1, 1);
    return result ? result : envmap_filter(&f->truth, &f->source, &lobe, &desc);
}

/* From black over red and yellow to white at 1; 3 is white after the tone curve. */
static void heat_colour(float rgb[3], float x) {
    int c;
    for (c = 0; c < 3; c++) rgb[c] = 3 * fminf(fmaxf(3 * x - (float)c, 0.01f), 1);
}

#define HOTTEST 0.3f

/* |a - b| / b as heat (of a tenth of the mean, where b is less). */
static void heat(envmap *out, const envmap *a, const envmap *b, float exposure) {
    size_t i, texels = 6 * (size_t)a->size * (size_t)a->size;
    float mean = 0;
    int c;
    for (i = 0; i < 3 * texels; i++) mean += b->texels[i] / (float)(3 * texels);
    for (i = 0; i < texels; i++) {
        float worst = 0, *to = out->texels + 3 * i;
        for (c = 0; c < 3; c++) {
            float truth = b->texels[3 * i + (size_t)c];
            worst = fmaxf(worst,
                          fabsf(a->texels[3 * i + (size_t)c] - truth) / fmaxf(truth, 0.1f * mean));
        }
        heat_colour(to, worst / HOTTEST);
        for (c = 0; c < 3; c++) to[c] /= exposure;
    }
}

static void legend(picture *p, int x, int y) {
    char text[32];
    int i, c;
    for (i = 0; i <= 3; i++) { /* numbers below the bar: 0, 10, 20, 30 */
        snprintf(text, sizeof text, "%.0f", 100 * (double)HOTTEST * i / 3);
        gl_write(p, text, x + 50 * i - (int)picture_text_width(text, 13) / 2, y - 20);
    }
    for (i = 0; i < 150; i++) {
        float rgb[3];
        heat_colour(rgb, (float)i / 149);
        for (c = 0; c < 3; c++) rgb[c] = picture_curve(rgb[c]);
        picture_rectangle(p, x + i, y, 1, 10, picture_colour(rgb), 1);
    }
    gl_write(p, "off by, %", x, y - 44);
}

/* A mesh that shines, turned so that it shows most directions. */
static void shine(figures *f, const envmap *map, int kind) {
    surface s = surface_default();
    float model[16];
    s.map = gl_map(map);
    mesh_turn(model, 0, 1.0f);
    surface_draw(f->st.surface, &f->app, &s, &f->meshes[kind], model);
    gl.DeleteTextures(1, &s.map);
}

/* A figure of ways, in a grid: on the left half of each cell a mesh, on the right its errors; the
   unfiltered one and the reference have none. */
typedef struct comparison {
    const char *name;
    const method_row *ways;
    int count, columns, mesh;
    float distance;
} comparison;

static envmap_result compare_cell(figures *f, const comparison *k, int i, double *rms) {
    int width = f->app.width / k->columns, height = f->app.height * k->columns / k->count;
    int x = i % k->columns * width, y = i / k->columns * height, bare, plain;
    const method_row *way = &k->ways[i];
    envmap_lobe lobe = envmap_lobe_phong(100);
    envmap map, hot;
    envmap_difference off;
    envmap_result result;
    memset(&map, 0, sizeof map);
    memset(&hot, 0, sizeof hot);
    bare = way->call == unfiltered, plain = bare || !way->call;
    result = envmap_create(&map, ENVMAP_CUBE, bare ? 128 : 64, 1, 1);
    if (!result)
        result = way->call ? way->call(&map, &f->source, &lobe, &way->desc)
                           : envmap_resample(&map, &f->truth, NULL);
    if (!result) {
        gl_area(&f->app, x, y, plain ? width : width / 2, height);
        shine(f, &map, k->mesh);
        stage_sky(&f->st, &f->app, 0);
    }
    if (!result && !plain) result = envmap_compare(&off, &map, &f->truth, 0);
    if (!result && !plain) result = envmap_create(&hot, ENVMAP_CUBE, 64, 1, 1);
    if (!result && !plain) {
        *rms = off.rms;
        heat(&hot, &map, &f->truth, f->app.exposure);
        gl_area(&f->app, x + width / 2, y, width / 2, height);
        shine(f, &hot, k->mesh);
    }
    envmap_free(&map);
    envmap_free(&hot);
    return result;
}

/* In two lines, at the comma, so that it stays within its half of the cell. */
static void way_name(char *text, size_t room, const char *name) {
    char *comma;
    snprintf(text, room, "%s", name);
    comma = strstr(text, ", ");
    if (comma) *comma = '\n', memmove(comma + 1, comma + 2, strlen(comma + 1));
}

static void compare_label(const comparison *k, picture *p, const double *rms) {
    int i, width = p->width / k->columns, rows = k->count / k->columns;
    char text[64];
    for (i = 0; i < k->count; i++) {
        int x = i % k->columns * width, y = (i / k->columns + 1) * p->height / rows;
        way_name(text, sizeof text, k->ways[i].name);
        gl_write(p, text, i % k->columns * width + 14,
                 y - 28 - (strchr(text, '\n') ? GL_TEXT_LINE : 0));
        if (!k->ways[i].call) legend(p, x + width - 170, y - 28);
        snprintf(text, sizeof text, "rms %.2g %%", 100 * rms[i]);
        if (rms[i] > 0)
            gl_write(p, text, x + width - 14 - (int)picture_text_width(text, 13), y - 28);
    }
}

static void compare_figure(figures *f, const comparison *k) {
    envmap_result result = ENVMAP_OK;
    double rms[12] = {0};
    float distance = f->app.distance;
    picture p;
    int i;
    f->app.distance = k->distance;
    gl_target_bind(&f->app.frame);
    for (i = 0; i < k->count && !result; i++) result = compare_cell(f, k, i, &rms[i]);
    f->app.distance = distance;
    if (stage_say(result) && gl_shoot(&f->app, &p)) {
        compare_label(k, &p, rms);
        save(f, &p, k->name);
    }
}

/* ------------------------------------------------------------------------------- >>materials -- */

/* The slices of a lobe, for the axes that have them. */
static void slice(figures *f, surface *s, const envmap_lobe *lobe, int slices) {
    envmap map = {0};
    envmap_filter_desc desc = f->st.desc;
    int face;
    desc.tolerance = 0.01f;
    if (stage_say(envmap_create(&map, ENVMAP_PARABOLOID, 64, 1, slices)) &&
        stage_say(envmap_filter(&map, &f->st.environment, lobe, &desc)))
        for (face = 0; face < 2; face++) s->slices[face] = gl_volume(&map, face);
    envmap_free(&map);
}

static void copper(figures *f, surface *s) {
    brdf_values values = {{0.95, 0.64, 0.54}, 0.16, 0, 0, 0, 1};
    envmap_brdf brdf = {brdf_ggx, NULL};
    envmap_fit fit = {1, 16, 257, 0, NULL, NULL, NULL, NULL, NULL};
    brdf.user = &values, s->axis = SURFACE_VIEW;
    if (stage_say(envmap_fit_brdf(&fit, &brdf, &f->st.desc.work))) {
        envmap_lobe lobe = envmap_fit_lobe(&fit, 0);
        surface_fit(s, &fit);
        slice(f, s, &lobe, 16);
    }
    envmap_fit_free(&fit);
}

static void brushed(figures *f, surface *s) {
    envmap_lobe lobe = envmap_lobe_banks(0.95f);
    s->axis = SURFACE_TANGENT;
    s->tint[0] = s->tint[1] = s->tint[2] = 0.75f; /* threads know no horizon, and shine more */
    slice(f, s, &lobe, 48);
}

static void gold(figures *f, surface *s) {
    s->map = filtered(f, 128, envmap_lobe_ggx(0.16f));
    s->tint[1] = 0.72f, s->tint[2] = 0.3f;
}

static void elliptical(figures *f, surface *s) {
    envmap_lobe lobe = envmap_lobe_phong(300);
    s->axis = SURFACE_FAN;
    s->map = filtered(f, 128, lobe);
    surface_fan(s, 0.5, envmap_lobe_sigma(&lobe, 0));
}

static void diffuse(surface *s) {
    s->diffuse = SURFACE_PLUS_DIFFUSE;
    s->tint[0] = s->tint[1] = s->tint[2] = 0;
    s->albedo[0] = s->albedo[1] = s->albedo[2] = 0.45f;
}

static void coated(figures *f, surface *s) {
    s->map = f->st.sky, s->index = 1.5f, s->diffuse = SURFACE_BLENDED;
    s->albedo[0] = 0.02f, s->albedo[1] = 0.08f, s->albedo[2] = 0.3f;
}

static void materials_figure(figures *f) {
    static const char *const names[9] = {
        "mirror",         "Phong, N = 300",    "Phong, N = 20",
        "diffuse",        "coated, index 1.5", "GGX, roughness 0.4",
        "copper, fitted", "Banks, s = 0.95",   "elliptical"};
    picture p;
    int i;
    gl_target_bind(&f->app.frame);
    for (i = 0; i < 9; i++) {
        surface s = surface_default();
        if (i == 0) s.map = f->st.sky;
        if (i == 1) s.map = filtered(f, 128, envmap_lobe_phong(300));
        if (i == 2) s.map = filtered(f, 64, envmap_lobe_phong(20));
        if (i == 3) diffuse(&s);
        if (i == 4) coated(f, &s);
        if (i == 5) gold(f, &s);
        if (i == 6) copper(f, &s);
        if (i == 7) brushed(f, &s);
        if (i == 8) elliptical(f, &s);
        teapot(f, &s, i % 3, i / 3, 3, 3);
        if (s.map != f->st.sky) gl.DeleteTextures(1, &s.map);
        gl.DeleteTextures(2, s.slices);
    }
    if (!gl_shoot(&f->app, &p)) return;
    for (i = 0; i < 9; i++) label(&p, i % 3, i / 3, 3, 3, names[i]);
    save(f, &p, "teapots.png");
}

int main(int argc, char **argv) {
    const comparison on_torus = {"filters.png", old_ways, 6, 3, GL_TORUS, 8.2f};
    const comparison on_ball = {"errors.png", all_ways, 12, 4, GL_BALL, 5.9f};
    static figures f;
    static char name[] = "gl_gallery", flag[] = "--headless", here[] = ".";
    char *arguments[3];
    int i;
    arguments[0] = name, arguments[1] = flag, arguments[2] = argc > 1 ? argv[1] : here;
    f.folder = arguments[2];
    if (!gl_open(&f.app, name, 1440, 900, 3, arguments)) return 1;
    if (!stage_open(&f.st, &f.app, SCENE_SUN, 0, NULL)) return 1;
    for (i = 0; i < GL_MESH_COUNT; i++)
        if (!gl_mesh_make(&f.meshes[i], i)) return 1;
    f.app.distance = 3.6f, f.app.at[0] = 0.1f;
    materials_figure(&f);
    fresnel_figure(&f);
    f.app.at[0] = 0;
    if (stage_say(stage_light(&f.st, SCENE_STUDIO, NULL))) {
        f.app.exposure = stage_exposure[SCENE_STUDIO];
        if (stage_say(compare_begin(&f))) {
            compare_figure(&f, &on_torus);
            compare_figure(&f, &on_ball);
        }
    }
    envmap_free(&f.source);
    envmap_free(&f.truth);
    for (i = 0; i < GL_MESH_COUNT; i++) gl_mesh_free(&f.meshes[i]);
    stage_close(&f.st);
    return gl_close(&f.app);
}
