/* gl_gallery.c - the figures of docs/gallery.md that no other example draws, headless.

   What you will see, in the folder that is named (default: here):
     fresnel.png   a coat of index 1.5, 5 and 200 (rows): the mirror alone, over diffuse light,
                   blended with it by 1 - F
     filters.png   N = 100 by five ways to filter, and how far each is from the reference
     teapots.png   one teapot through every kind of map

   usage: gl_gallery [FOLDER]

   SPDX-License-Identifier: MIT */

#define _POSIX_C_SOURCE 200809L
#define ENVMAP_STATIC
#define ENVMAP_IMPLEMENTATION
#include "envmap.h"
#include "stage.h"
#include "methods/box_levels.h"
#include "methods/paraboloid_convolution.h"

typedef struct figures {
    gl_app app;
    stage st;
    gl_mesh teapot, torus;
    const char *folder;
} figures;

/* Draws a teapot into a cell, with the stage's light behind it. */
static void teapot(figures *f, const surface *look, int column, int row, int columns, int rows) {
    surface s = *look;
    float model[16];
    mesh_identity(model);
    memcpy(s.sh, f->st.sh, sizeof s.sh);
    gl_cell(&f->app, column, row, columns, rows);
    surface_draw(f->st.surface, &f->app, &s, &f->teapot, model);
    stage_sky(&f->st, &f->app, 3);
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

/* A map of an environment through a lobe, as a texture; 0 when that failed. */
static GLuint filtered(figures *f, envmap_mapping mapping, int size, envmap_lobe lobe) {
    envmap map;
    GLuint texture = 0;
    memset(&map, 0, sizeof map);
    if (stage_say(envmap_create(&map, mapping, size, 1, 1)) &&
        stage_say(envmap_filter(&map, &f->st.environment, &lobe, &f->st.desc)))
        texture = gl_map(&map);
    envmap_free(&map);
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
    s.map = filtered(f, ENVMAP_CUBE, 256, envmap_lobe_mirror());
    s.albedo[0] = 0.35f, s.albedo[1] = 0.03f, s.albedo[2] = 0.02f;
    gl_target_bind(&f->app.frame);
    for (i = 0; i < 9; i++) {
        s.index = indices[i / 3], s.diffuse = i % 3;
        teapot(f, &s, i % 3, i / 3, 3, 3);
    }
    gl.DeleteTextures(1, &s.map);
    if (!gl_shoot(&f->app, &p)) return;
    for (i = 0; i < 9; i++) {
        snprintf(text, sizeof text, "index %g, %s", (double)indices[i / 3], under[i % 3]);
        label(&p, i % 3, i / 3, 3, 3, text);
    }
    save(f, &p, "fresnel.png");
}

/* --------------------------------------------------------------------------------- >>filters -- */

#define WAYS 5
static const char *const way_names[WAYS] = {"unfiltered", "reference", "hierarchical",
                                            "two maps, 7 x 7 taps", "one biased level"};

static envmap_result by_way(envmap *map, const envmap *source, int way, figures *f) {
    envmap_lobe lobe = way ? envmap_lobe_phong(100) : envmap_lobe_mirror();
    envmap_filter_desc desc = f->st.desc;
    method_desc published;
    memset(&published, 0, sizeof published);
    published.form = METHOD_PUBLISHED;
    if (way == 3) return method_paraboloid_convolution(map, source, &lobe, &published);
    if (way == 4) return method_box_levels(map, source, &lobe, &published);
    desc.method = way == 1   ? ENVMAP_METHOD_REFERENCE
                  : way == 2 ? ENVMAP_METHOD_HIERARCHICAL
                             : ENVMAP_METHOD_AUTO;
    return envmap_filter(map, source, &lobe, &desc);
}

/* |a - b| / b from black over red and yellow to white, which is 30 % of b (or of a tenth of the
   mean, where b is less). */
static void heat(envmap *out, const envmap *a, const envmap *b, float exposure) {
    size_t i, texels = 6 * (size_t)a->size * (size_t)a->size;
    float mean = 0;
    for (i = 0; i < 3 * texels; i++) mean += b->texels[i] / (float)(3 * texels);
    for (i = 0; i < texels; i++) {
        float worst = 0, least = 0.1f * mean;
        int c;
        for (c = 0; c < 3; c++) {
            float truth = b->texels[3 * i + (size_t)c];
            worst = fmaxf(worst,
                          fabsf(a->texels[3 * i + (size_t)c] - truth) / fmaxf(truth, least) / 0.3f);
        }
        for (c = 0; c < 3; c++)
            out->texels[3 * i + (size_t)c] =
                3 * fminf(fmaxf(3 * worst - (float)c, 0.01f), 1) / exposure;
    }
}

static void torus(figures *f, const envmap *map, int column, int row) {
    surface s = surface_default();
    float model[16];
    s.map = gl_map(map);
    mesh_turn(model, 0, 1.0f);
    gl_cell(&f->app, column, row, WAYS, 2);
    surface_draw(f->st.surface, &f->app, &s, &f->torus, model);
    if (row == 0) stage_sky(&f->st, &f->app, 3);
    gl.DeleteTextures(1, &s.map);
}

static envmap_result filters_cells(figures *f, envmap maps[WAYS], envmap *source, envmap *hot,
                                   envmap_difference off[WAYS]) {
    envmap_result result = envmap_create(source, ENVMAP_CUBE, 128, 1, 1);
    int k;
    if (!result) result = envmap_resample(source, &f->st.environment);
    if (!result) result = envmap_create(hot, ENVMAP_CUBE, 64, 1, 1);
    for (k = 0; k < WAYS && !result; k++) {
        result = envmap_create(&maps[k], ENVMAP_CUBE, k ? 64 : 128, 1, 1);
        if (!result) result = by_way(&maps[k], source, k, f);
        if (!result) torus(f, &maps[k], k, 0);
    }
    for (k = 2; k < WAYS && !result; k++) {
        heat(hot, &maps[k], &maps[1], f->app.exposure);
        result = envmap_compare(&off[k], &maps[k], &maps[1], 0);
        if (!result) torus(f, hot, k, 1);
    }
    return result;
}

static void filters_figure(figures *f) {
    envmap maps[WAYS], source, hot;
    envmap_difference off[WAYS];
    float distance = f->app.distance;
    picture p;
    char text[64];
    int k, good;
    memset(maps, 0, sizeof maps);
    memset(&source, 0, sizeof source);
    memset(&hot, 0, sizeof hot);
    memset(off, 0, sizeof off);
    f->app.distance = 9.5f;
    gl_target_bind(&f->app.frame);
    good = stage_say(filters_cells(f, maps, &source, &hot, off));
    f->app.distance = distance;
    if (good && gl_shoot(&f->app, &p)) {
        gl_write(&p, "error, from black (none)\nto white (30 %)", 14, 3 * p.height / 4 - 20);
        for (k = 0; k < WAYS; k++) {
            label(&p, k, 0, WAYS, 2, way_names[k]);
            snprintf(text, sizeof text, "rms %.2f %%", 100 * off[k].rms);
            if (k > 1) label(&p, k, 1, WAYS, 2, text);
        }
        save(f, &p, "filters.png");
    }
    for (k = 0; k < WAYS; k++) envmap_free(&maps[k]);
    envmap_free(&source);
    envmap_free(&hot);
}

/* ------------------------------------------------------------------------------- >>materials -- */

static void banks(figures *f, surface *s) {
    envmap map;
    envmap_lobe lobe = envmap_lobe_banks(0.95f);
    int face;
    memset(&map, 0, sizeof map);
    if (stage_say(envmap_create(&map, ENVMAP_PARABOLOID, 64, 1, 64)) &&
        stage_say(envmap_filter(&map, &f->st.environment, &lobe, &f->st.desc)))
        for (face = 0; face < 2; face++) s->slices[face] = gl_volume(&map, face);
    envmap_free(&map);
}

static void materials_figure(figures *f) {
    static const char *const names[6] = {"mirror",  "Phong, N = 300",    "Phong, N = 20",
                                         "diffuse", "coated, index 1.5", "Banks, s = 0.95"};
    static const float exponents[3] = {0, 300, 20};
    float distance = f->app.distance;
    picture p;
    int i;
    f->app.distance = 7.2f;
    gl_target_bind(&f->app.frame);
    for (i = 0; i < 6; i++) {
        surface s = surface_default();
        if (i < 3 || i == 4)
            s.map = filtered(f, ENVMAP_CUBE, i % 4 ? 128 : 256,
                             i % 4 ? envmap_lobe_phong(exponents[i]) : envmap_lobe_mirror());
        if (i == 3) s.tint[0] = s.tint[1] = s.tint[2] = 0;
        if (i == 3)
            s.diffuse = SURFACE_PLUS_DIFFUSE, s.albedo[0] = s.albedo[1] = s.albedo[2] = 0.45f;
        if (i == 4) s.diffuse = SURFACE_BLENDED, s.index = 1.5f;
        if (i == 4) s.albedo[0] = 0.02f, s.albedo[1] = 0.08f, s.albedo[2] = 0.3f;
        if (i == 5) s.axis = SURFACE_TANGENT, banks(f, &s);
        teapot(f, &s, i % 3, i / 3, 3, 2);
        gl.DeleteTextures(1, &s.map);
        gl.DeleteTextures(2, s.slices);
    }
    f->app.distance = distance;
    if (!gl_shoot(&f->app, &p)) return;
    for (i = 0; i < 6; i++) label(&p, i % 3, i / 3, 3, 2, names[i]);
    save(f, &p, "teapots.png");
}

int main(int argc, char **argv) {
    static figures f;
    static char name[] = "gl_gallery", flag[] = "--headless", here[] = ".";
    char *arguments[3];
    arguments[0] = name, arguments[1] = flag, arguments[2] = argc > 1 ? argv[1] : here;
    f.folder = arguments[2];
    if (!gl_open(&f.app, name, 1440, 800, 3, arguments)) return 1;
    if (!stage_open(&f.st, &f.app, SCENE_SUN, 0, NULL)) return 1;
    if (!gl_mesh_make(&f.teapot, GL_TEAPOT) || !gl_mesh_make(&f.torus, GL_TORUS)) return 1;
    fresnel_figure(&f);
    materials_figure(&f);
    if (stage_say(stage_light(&f.st, SCENE_STUDIO, NULL))) {
        f.app.exposure = stage_exposure[SCENE_STUDIO];
        filters_figure(&f);
    }
    gl_mesh_free(&f.teapot);
    gl_mesh_free(&f.torus);
    stage_close(&f.st);
    return gl_close(&f.app);
}
