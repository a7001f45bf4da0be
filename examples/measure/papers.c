/* papers.c - the papers' figures that no other program draws, without OpenGL: a small rasteriser
   turns a mesh into normals, and every sample is looked up on the processor.

   usage: papers DOCS [NAME ...]
   Draws DOCS/images/papers-NAME.png for every figure in the table at the end, or for those named.
   `make papers` runs it: half a minute.

   What you will see: docs/gallery.md has each picture beside the figure that it stands for.

   >>shots >>sheets >>maps >>kautz >>tutorial >>vr >>lecture >>gaussian >>main

   SPDX-License-Identifier: MIT */

#define _POSIX_C_SOURCE 200809L
#include "measure.h" /* with the implementation of envmap.h */

#include "../gl/mesh.h"
#include "../methods/box_levels.h"
#include "../methods/cabral.h"
#include "../methods/nonphotorealistic.h"
#include "../methods/paraboloid_convolution.h"
#include "../methods/separable_gaussian.h"
#include "../tool/brdfs.h"
#include "../tool/picture.h"
#include "../tool/scenes.h"

static const unsigned paper = 0x15171Cu, ink = 0xF3F1ECu, grey = 0x9AA0ABu;
static const float exposure_of[SCENE_COUNT] = {0.62f, 0.62f, 0.52f};

/* ----------------------------------------------------------------------------------- >>shots --
   A mesh as a camera sees it: the normal of every sample, and where the eye is. */

enum { FINE = 3 }; /* samples along each side of a pixel */

typedef struct shot {
    picture_camera camera; /* looks at the origin */
    float distance;
    int width, height;
    float (*normal)[3]; /* [height * FINE][width * FINE]; zero where there is nothing */
    float *depth;
} shot;

static void camera_axes(float axes[3][3], const picture_camera *c) {
    float cy = cosf(c->yaw), sy = sinf(c->yaw), cp = cosf(c->pitch), sp = sinf(c->pitch);
    scene_set(axes[0], cy, 0, sy);
    scene_set(axes[1], -sy * sp, cp, cy * sp);
    scene_set(axes[2], sy * cp, sp, -cy * cp); /* ahead */
}

/* A corner in samples and its depth, and the normal in the world. */
typedef struct corner {
    float x, y, z, n[3];
} corner;

static corner corner_of(const shot *s, float axes[3][3], const float *vertex,
                        const float turn[16]) {
    corner c;
    float p[3], at[3];
    for (int k = 0; k < 3; ++k) {
        p[k] = turn[k] * vertex[0] + turn[4 + k] * vertex[1] + turn[8 + k] * vertex[2];
        c.n[k] = turn[k] * vertex[3] + turn[4 + k] * vertex[4] + turn[8 + k] * vertex[5];
    }
    for (int k = 0; k < 3; ++k) at[k] = scene_dot(axes[k], p);
    c.z = at[2] + s->distance;
    c.x = (at[0] / (c.z * s->camera.tan_x) + 1) * 0.5f * (float)(s->width * FINE);
    c.y = (1 - at[1] / (c.z * s->camera.tan_y)) * 0.5f * (float)(s->height * FINE);
    return c;
}

static void shot_sample(shot *s, int i, int j, const corner t[3], const float w[3]) {
    size_t at = (size_t)j * (size_t)(s->width * FINE) + (size_t)i;
    float z = 1 / (w[0] / t[0].z + w[1] / t[1].z + w[2] / t[2].z);
    if (z >= s->depth[at]) return;
    s->depth[at] = z;
    for (int k = 0; k < 3; ++k)
        s->normal[at][k] =
            w[0] * t[0].n[k] / t[0].z + w[1] * t[1].n[k] / t[1].z + w[2] * t[2].n[k] / t[2].z;
    mesh_unit(s->normal[at]);
}

static float edge_of(const corner *a, const corner *b, float x, float y) {
    return (b->x - a->x) * (y - a->y) - (b->y - a->y) * (x - a->x);
}

static int clamped(float x, int most) { return x < 0 ? 0 : x > (float)most ? most : (int)x; }

static void shot_triangle(shot *s, const corner t[3]) {
    float area = edge_of(t, t + 1, t[2].x, t[2].y);
    int right = s->width * FINE - 1, bottom = s->height * FINE - 1;
    int x0 = clamped(fminf(t[0].x, fminf(t[1].x, t[2].x)) - 1, right);
    int x1 = clamped(fmaxf(t[0].x, fmaxf(t[1].x, t[2].x)) + 1, right);
    int y0 = clamped(fminf(t[0].y, fminf(t[1].y, t[2].y)) - 1, bottom);
    int y1 = clamped(fmaxf(t[0].y, fmaxf(t[1].y, t[2].y)) + 1, bottom);
    if (!(fabsf(area) > 1e-6f)) return;
    for (int j = y0; j <= y1; ++j)
        for (int i = x0; i <= x1; ++i) {
            float x = (float)i + 0.5f, y = (float)j + 0.5f, w[3];
            for (int k = 0; k < 3; ++k)
                w[k] = edge_of(t + (k + 1) % 3, t + (k + 2) % 3, x, y) / area;
            if (w[0] >= 0 && w[1] >= 0 && w[2] >= 0) shot_sample(s, i, j, t, w);
        }
}

/* turn: the object's own, column-major. */
static shot shot_of(int (*make)(mesh *), const float turn[16], int width, int height, float yaw,
                    float pitch, float distance) {
    shot s;
    mesh m;
    corner t[3];
    float axes[3][3];
    size_t samples = (size_t)(width * FINE) * (size_t)(height * FINE);
    memset(&s, 0, sizeof s);
    s.width = width, s.height = height, s.distance = distance;
    s.camera.yaw = yaw, s.camera.pitch = pitch;
    s.camera.tan_y = 0.30f, s.camera.tan_x = 0.30f * (float)width / (float)height;
    s.normal = (float(*)[3])calloc(samples, sizeof *s.normal);
    s.depth = (float *)malloc(samples * sizeof *s.depth);
    if (!s.normal || !s.depth || !make(&m)) measure_must(ENVMAP_ERROR_MEMORY, "a mesh");
    for (size_t i = 0; i < samples; ++i) s.depth[i] = 1e30f;
    camera_axes(axes, &s.camera);
    for (int i = 0; i < m.index_count; i += 3) {
        for (int k = 0; k < 3; ++k)
            t[k] = corner_of(&s, axes, m.vertices + MESH_FLOATS * m.indices[i + k], turn);
        shot_triangle(&s, t);
    }
    mesh_free(&m);
    return s;
}

static void shot_free(shot *s) {
    free(s->normal);
    free(s->depth);
}

static int teapot(mesh *m) { return mesh_teapot(m, 20); }
static int torus(mesh *m) { return mesh_torus(m, 72, 0.45f); }
static int ball(mesh *m) { return mesh_ball(m, 72); }

/* The torus leans back, so that it shows most directions. */
static shot torus_shot(int width, int height, float distance) {
    float turn[16];
    mesh_turn(turn, 0, 1.0f);
    return shot_of(torus, turn, width, height, 0.5f, -0.1f, distance);
}

static shot teapot_shot(int width, int height, float distance) {
    float turn[16];
    mesh_identity(turn);
    return shot_of(teapot, turn, width, height, 0.35f, -0.25f, distance);
}

static shot ball_shot(int width, int height, float yaw) {
    float turn[16];
    mesh_identity(turn);
    return shot_of(ball, turn, width, height, yaw, 0, 4.2f);
}

/* Radiance towards the eye, v unit, n unit. */
typedef void shade(float rgb[3], const float n[3], const float v[3], const void *user);

static void view_of(float v[3], const shot *s, int i, int j) {
    float axes[3][3], x = (2 * ((float)i + 0.5f) / (float)(s->width * FINE) - 1) * s->camera.tan_x;
    float y = (1 - 2 * ((float)j + 0.5f) / (float)(s->height * FINE)) * s->camera.tan_y;
    camera_axes(axes, &s->camera);
    for (int k = 0; k < 3; ++k) v[k] = -(axes[2][k] + x * axes[0][k] + y * axes[1][k]);
    mesh_unit(v);
}

static void shot_draw(picture *p, int left, int top, const shot *s, float exposure, shade *f,
                      const void *user) {
    for (int y = 0; y < s->height; ++y)
        for (int x = 0; x < s->width; ++x) {
            float light[3] = {0, 0, 0}, rgb[3], v[3];
            int hits = 0;
            for (int k = 0; k < FINE * FINE; ++k) {
                int i = x * FINE + k % FINE, j = y * FINE + k / FINE;
                const float *n = s->normal[(size_t)j * (size_t)(s->width * FINE) + (size_t)i];
                if (!(mesh_dot(n, n) > 0)) continue;
                view_of(v, s, i, j);
                f(rgb, n, v, user);
                for (int c = 0; c < 3; ++c) light[c] += picture_curve(exposure * rgb[c]);
                ++hits;
            }
            for (int c = 0; c < 3 && hits; ++c) light[c] /= (float)hits;
            picture_blend(p, left + x, top + y, picture_colour(light), (float)hits / (FINE * FINE));
        }
}

static void reflected(float r[3], const float n[3], const float v[3]) {
    float nv = 2 * mesh_dot(n, v);
    for (int k = 0; k < 3; ++k) r[k] = nv * n[k] - v[k];
}

/* One lookup by the reflected direction; user is the map. */
static void shade_glossy(float rgb[3], const float n[3], const float v[3], const void *user) {
    float r[3];
    reflected(r, n, v);
    envmap_lookup(rgb, (const envmap *)user, r, 0);
}

/* The same by the normal. */
static void shade_diffuse(float rgb[3], const float n[3], const float v[3], const void *user) {
    (void)v;
    envmap_lookup(rgb, (const envmap *)user, n, 0);
}

/* ---------------------------------------------------------------------------------- >>sheets --
   A sheet is a title, heads over columns and beside rows, and panes of one size. */

typedef struct sheet {
    const char *title, *remark;
    int columns, rows, width, height, left;
    const char *heads[6], *notes[6];      /* over the columns: white, and grey below it */
    const char *sides[6], *side_notes[6]; /* beside the rows */
} sheet;

enum { MARGIN = 28, GAP = 14, TOP = 140 };

static int sheet_x(const sheet *s, int column) {
    return MARGIN + s->left + column * (s->width + GAP);
}

static int sheet_y(const sheet *s, int row) { return TOP + row * (s->height + GAP); }

/* Text in lines that are no wider than `most` pixels. */
static void lines(picture *p, float x, float y, float size, float most, const char *text) {
    char line[256];
    while (text && *text) {
        size_t length = 0, next = 0;
        do {
            length = next, next += strcspn(text + next + 1, " ") + 1;
            snprintf(line, sizeof line, "%.*s", (int)next, text);
        } while (picture_text_width(line, size) <= most && text[next] && next < sizeof line - 1);
        if (picture_text_width(line, size) <= most || !length) length = next;
        line[length] = 0;
        picture_text(p, x, y, size, grey, line);
        text += length + (text[length] == ' ');
        y += 1.75f * size;
    }
}

static picture sheet_begin(const sheet *s) {
    picture p;
    int width = sheet_x(s, s->columns) - GAP + MARGIN, height = sheet_y(s, s->rows) - GAP + MARGIN;
    if (!picture_create(&p, width, height)) measure_must(ENVMAP_ERROR_MEMORY, "picture");
    picture_rectangle(&p, 0, 0, width, height, paper, 1);
    picture_text(&p, MARGIN, 26, 18, ink, s->title);
    lines(&p, MARGIN, 58, 10, (float)(width - 2 * MARGIN), s->remark);
    for (int i = 0; i < s->columns && s->heads[i]; ++i) {
        float x = (float)sheet_x(s, i) + 0.5f * (float)s->width;
        picture_caption(&p, x, 104, 12, ink, s->heads[i]);
        if (s->notes[i]) picture_caption(&p, x, 123, 10, grey, s->notes[i]);
    }
    for (int i = 0; i < s->rows && s->sides[i]; ++i) {
        float y = (float)sheet_y(s, i) + 0.5f * (float)s->height - 12;
        picture_text(&p, MARGIN, y, 12, ink, s->sides[i]);
        lines(&p, MARGIN, y + 21, 10, (float)s->left - 8, s->side_notes[i]);
    }
    return p;
}

static const char *docs;

static void sheet_end(picture *p, const char *name) {
    char path[5000];
    snprintf(path, sizeof path, "%s/images/papers-%s.png", docs, name);
    if (!picture_save(p, path)) measure_must(ENVMAP_ERROR_FILE, path);
    picture_free(p);
}

/* A line of text on a dark band at the foot of a pane. */
static void foot(picture *p, const sheet *s, int column, int row, const char *text) {
    int x = sheet_x(s, column), y = sheet_y(s, row) + s->height;
    picture_rectangle(p, x, y - 24, s->width, 24, 0x000000, 0.55f);
    picture_text(p, (float)x + 8, (float)y - 17, 10, ink, text);
}

/* A caption in the first NAMED rows of pixels of a pane. */
enum { NAMED = 20 };
static void pane_name(picture *p, const sheet *s, int column, int row, const char *text) {
    picture_caption(p, (float)(sheet_x(s, column) + s->width / 2), (float)sheet_y(s, row) + 4, 10,
                    grey, text);
}

/* From black over red and yellow to white, x in [0,1]: display light. */
static unsigned heat_colour(float x) {
    float rgb[3];
    for (int c = 0; c < 3; ++c) rgb[c] = fminf(fmaxf(3 * x - (float)c, 0.015f), 1);
    return picture_colour(rgb);
}

#define HOTTEST 0.3f

/* The scale of heat maps, below the left heads. */
static void heat_scale(picture *p, int x, int y) {
    char text[32];
    for (int i = 0; i < 84; ++i)
        picture_rectangle(p, x + i, y, 1, 9, heat_colour((float)i / 83), 1);
    for (int i = 0; i <= 3; ++i) {
        snprintf(text, sizeof text, "%d", 10 * i);
        picture_caption(p, (float)(x + 28 * i), (float)y + 14, 9, grey, text);
    }
    picture_text(p, (float)x + 98, (float)y + 14, 9, grey, "%");
}

/* Pixel by pixel: how far a is from b, of b or of a tenth of b's mean where that is more. */
static void heat_face(picture *p, int left, int top, int edge, const envmap *a, const envmap *b,
                      int face) {
    size_t n = measure_bytes(b, 1) / sizeof(float);
    float mean = 0;
    for (size_t i = 0; i < n; ++i) mean += b->texels[i] / (float)n;
    for (int y = 0; y < edge; ++y)
        for (int x = 0; x < edge; ++x) {
            float d[3], one[3], two[3], worst = 0;
            float s = ((float)x + 0.5f) / (float)edge, t = ((float)y + 0.5f) / (float)edge;
            envmap_direction(d, b->mapping, face, s, t);
            envmap_lookup(one, a, d, 0), envmap_lookup(two, b, d, 0);
            for (int c = 0; c < 3; ++c)
                worst = fmaxf(worst, fabsf(one[c] - two[c]) / fmaxf(two[c], 0.1f * mean));
            if (hypotf(2 * s - 1, 2 * t - 1) <= 1)
                picture_blend(p, left + x, top + y, heat_colour(worst / HOTTEST), 1);
        }
}

/* ------------------------------------------------------------------------------------ >>maps -- */

static envmap skies[SCENE_COUNT]; /* lat-long, 1024 x 512, made when first asked for */

static const envmap *sky(int scene) {
    if (!skies[scene].texels) {
        skies[scene] = measure_map(ENVMAP_LATLONG, 512, 1, 1);
        scene_fill(skies + scene, scene);
    }
    return skies + scene;
}

static envmap filtered(const envmap *src, envmap_lobe lobe, int mapping, int size, int method) {
    envmap map = measure_map(mapping, size, 1, 1);
    envmap_filter_desc desc = {0};
    desc.method = method;
    measure_must(envmap_filter(&map, src, &lobe, &desc), "filter");
    return map;
}

/* What is behind a shot, out of focus. */
static void backdrop(picture *p, int left, int top, const shot *s, int scene) {
    static envmap soft;
    static int of = -1;
    picture_camera c = s->camera;
    if (of != scene) {
        envmap_free(&soft);
        soft = filtered(sky(scene), envmap_lobe_phong(600), ENVMAP_CUBE, 128, ENVMAP_METHOD_AUTO);
        of = scene;
    }
    c.map = &soft;
    picture_draw(p, left, top, s->width, s->height, exposure_of[scene], picture_camera_point, &c);
}

/* A scene in a parameterization, level 0 of `levels`. */
static envmap scene_map(int scene, int mapping, int size, int levels) {
    envmap map = measure_map(mapping, size, levels, 1);
    measure_must(envmap_resample(&map, sky(scene), NULL), "resample");
    return map;
}

static envmap by_method(const envmap *src, envmap_lobe lobe, int mapping, int size,
                        method_call *call, const method_desc *desc) {
    envmap map = measure_map(mapping, size, 1, 1);
    measure_must(call(&map, src, &lobe, desc), "a method");
    return map;
}

static double rms_of(const envmap *a, const envmap *b) {
    envmap_difference d;
    measure_must(envmap_compare(&d, a, b, 0), "compare");
    return d.rms;
}

/* A face of a paraboloid map with its rim. */
static void draw_disc(picture *p, int x, int y, int edge, float exposure, const envmap *map,
                      int face) {
    picture_map(p, x, y, edge, edge, exposure, map, map->mapping, face);
    picture_circle(p, (float)x + 0.5f * (float)edge, (float)y + 0.5f * (float)edge,
                   0.5f * (float)edge - 1, 1.2f, 0xFFFFFFu);
}

/* ----------------------------------------------------------------------------------- >>kautz -- */

/* Fig. 4: maps beside the torus that they light. */
static void fig4(const char *name) {
    static const sheet look = {
        "Kautz et al. 2000, figure 4: Phong N = 100 by five ways",
        "Front maps, the torus that each lights, and how far the map is from the reference. From "
        "faces of 256 x 256 texels to 128 x 128.",
        5,
        3,
        132,
        132,
        90,
        {"unfiltered", "reference", "hierarchical", "two passes", "one pass"},
        {"", "every texel", "threshold 0.001", "7 x 7 taps, S and L", "7 x 7 taps, S only"},
        {"map", "torus", "off by"},
        {"front face +z", "", "of the reference"}};
    method_desc ways[2] = {{0}, {0}};
    picture p = sheet_begin(&look);
    envmap src = scene_map(SCENE_STUDIO, ENVMAP_PARABOLOID, 256, 1), maps[5];
    envmap_lobe lobe = envmap_lobe_phong(100);
    shot s = torus_shot(look.width, look.height, 5.6f);
    float exposure = exposure_of[SCENE_STUDIO];
    ways[0].form = ways[1].form = METHOD_PUBLISHED, ways[1].one_map = 1;
    maps[0] = src;
    maps[1] = filtered(&src, lobe, ENVMAP_PARABOLOID, 128, ENVMAP_METHOD_REFERENCE);
    maps[2] = filtered(&src, lobe, ENVMAP_PARABOLOID, 128, ENVMAP_METHOD_HIERARCHICAL);
    for (int i = 0; i < 2; ++i)
        maps[3 + i] =
            by_method(&src, lobe, ENVMAP_PARABOLOID, 128, method_paraboloid_convolution, ways + i);
    for (int i = 0; i < 5; ++i) {
        int x = sheet_x(&look, i);
        draw_disc(&p, x, sheet_y(&look, 0), look.width, exposure, maps + i, 0);
        shot_draw(&p, x, sheet_y(&look, 1), &s, exposure, shade_glossy, maps + i);
        if (i > 1) {
            char text[32];
            heat_face(&p, x, sheet_y(&look, 2), look.width, maps + i, maps + 1, 0);
            snprintf(text, sizeof text, "rms %.2g %%", 100 * rms_of(maps + i, maps + 1));
            picture_caption(&p, (float)(x + look.width / 2), (float)(sheet_y(&look, 3) - 7), 10,
                            ink, text);
        }
    }
    for (int i = 0; i < 5; ++i) envmap_free(maps + i);
    heat_scale(&p, sheet_x(&look, 1) + 26, sheet_y(&look, 2) + 58);
    shot_free(&s);
    sheet_end(&p, name);
}

/* Fig. 5: two scenes, two exponents. */
static void fig5(const char *name) {
    static const sheet look = {
        "Kautz et al. 2000, figure 5: two scenes by their hardware filter",
        "Two maps of 7 x 7 taps, blended by d^2, from faces of 512 x 512 texels, as published. Off "
        "by: rms of the whole map, relative to the exact one's.",
        2,
        2,
        390,
        240,
        0,
        {"N = 50", "N = 500"},
        {"", ""},
        {NULL},
        {NULL}};
    static const int scenes[2] = {SCENE_OVERCAST, SCENE_STUDIO};
    static const float exponents[2] = {50, 500};
    method_desc way = {0};
    picture p = sheet_begin(&look);
    shot s[2] = {teapot_shot(look.width, look.height, 5.6f),
                 torus_shot(look.width, look.height, 7.0f)};
    way.form = METHOD_PUBLISHED;
    for (int i = 0; i < 4; ++i) {
        int x = sheet_x(&look, i % 2), y = sheet_y(&look, i / 2), scene = scenes[i / 2];
        envmap src = scene_map(scene, ENVMAP_PARABOLOID, 512, 1);
        envmap_lobe lobe = envmap_lobe_phong(exponents[i % 2]);
        envmap map = by_method(&src, lobe, ENVMAP_CUBE, 128, method_paraboloid_convolution, &way);
        envmap truth = filtered(&src, lobe, ENVMAP_CUBE, 128, ENVMAP_METHOD_AUTO);
        char text[64];
        backdrop(&p, x, y, s + i / 2, scene);
        shot_draw(&p, x, y, s + i / 2, exposure_of[scene], shade_glossy, &map);
        snprintf(text, sizeof text, "%s, off by %.1f %%", scene_name[scene],
                 100 * rms_of(&map, &truth));
        foot(&p, &look, i % 2, i / 2, text);
        envmap_free(&src), envmap_free(&map), envmap_free(&truth);
    }
    shot_free(s), shot_free(s + 1);
    sheet_end(&p, name);
}

/* Section 5.2: what a border of 64 texels and maps of [0,1] make of it. */
static void border(const char *name) {
    static const sheet look = {
        "Kautz et al. 2000, section 5.2: the border and [0, 1]",
        "Front maps in the studio, from faces of 512 x 512 texels by 7 x 7 taps in two passes. "
        "Off by: rms of the whole map, relative to the exact one's.",
        4,
        4,
        132,
        132 + NAMED,
        84,
        {"exact", "the square", "64 texels", "in [0, 1]"},
        {"", "its edge repeated", "beyond the disc", "and 64 texels"},
        {"N = 10", "N = 10", "N = 50", "N = 50"},
        {"the map", "off by", "the map", "off by"}};
    static const float exponents[2] = {10, 50};
    picture p = sheet_begin(&look);
    envmap src = scene_map(SCENE_STUDIO, ENVMAP_PARABOLOID, 512, 1);
    for (int i = 0; i < 8; ++i) {
        int x = sheet_x(&look, i % 4), row = 2 * (i / 4);
        envmap_lobe lobe = envmap_lobe_phong(exponents[i / 4]);
        envmap truth = filtered(&src, lobe, ENVMAP_PARABOLOID, 128, ENVMAP_METHOD_AUTO), map;
        method_desc way = {0};
        char text[32];
        way.form = METHOD_PUBLISHED;
        way.border = i % 4 >= 2 ? 0.25f : 0, way.white = i % 4 == 3 ? 1 : 0;
        map = by_method(&src, lobe, ENVMAP_PARABOLOID, 128, method_paraboloid_convolution, &way);
        snprintf(text, sizeof text, "off by %.0f %%", 100 * rms_of(&map, &truth));
        draw_disc(&p, x, sheet_y(&look, row) + NAMED, look.width, exposure_of[SCENE_STUDIO],
                  i % 4 ? &map : &truth, 0);
        if (i % 4) {
            pane_name(&p, &look, i % 4, row + 1, text);
            heat_face(&p, x, sheet_y(&look, row + 1) + NAMED, look.width, &map, &truth, 0);
        }
        envmap_free(&map), envmap_free(&truth);
    }
    heat_scale(&p, sheet_x(&look, 0) + 22, sheet_y(&look, 1) + 80);
    envmap_free(&src);
    sheet_end(&p, name);
}

/* -------------------------------------------------------------------------------- >>tutorial -- */

/* A sphere map that was made for one view. */
typedef struct one_view {
    const envmap *map;
    float axes[3][3]; /* of the camera that looks */
    int by_direction;
} one_view;

/* OpenGL's GL_SPHERE_MAP reflects in the eye's frame, and the map's centre is the viewer. */
static void shade_one_view(float rgb[3], const float n[3], const float v[3], const void *user) {
    const one_view *w = (const one_view *)user;
    float r[3], eye[3];
    reflected(r, n, v);
    for (int k = 0; k < 3; ++k) eye[k] = (k == 2 ? -1.0f : 1.0f) * mesh_dot(w->axes[k], r);
    envmap_lookup(rgb, w->map, w->by_direction ? r : eye, 0);
}

/* One environment from five view points. */
static void views(const char *name) {
    static const sheet look = {
        "One environment from several view points",
        "A mirror, each map of 13000 texels. Looked up in the viewer's frame, a sphere map shows "
        "its "
        "first view wherever the viewer goes.",
        5,
        3,
        118,
        110,
        150,
        {"0 degrees", "45 degrees", "90 degrees", "135 degrees", "180 degrees"},
        {"the map's view", "", "", "", ""},
        {"sphere map", "sphere map", "two paraboloids"},
        {"in the viewer's frame: right at 0 only", "by direction: its rim, -z, is one point",
         "by direction: even all around"}};
    picture p = sheet_begin(&look);
    envmap maps[2] = {scene_map(SCENE_SUN, ENVMAP_SPHERE, 128, 1),
                      scene_map(SCENE_SUN, ENVMAP_PARABOLOID, 91, 1)};
    float exposure = exposure_of[SCENE_SUN];
    for (int i = 0; i < 15; ++i) {
        int x = sheet_x(&look, i % 5), y = sheet_y(&look, i / 5);
        shot s = ball_shot(look.width, look.height, 0.785398f * (float)(i % 5));
        one_view w = {maps + i / 10, {{0}}, i >= 5};
        camera_axes(w.axes, &s.camera);
        backdrop(&p, x, y, &s, SCENE_SUN);
        shot_draw(&p, x, y, &s, exposure, shade_one_view, &w);
        shot_free(&s);
    }
    envmap_free(maps), envmap_free(maps + 1);
    sheet_end(&p, name);
}

/* A sphere map below its name. */
static void draw_sphere(picture *p, const sheet *s, int column, int row, float exposure,
                        const envmap *map, const char *text) {
    picture_map(p, sheet_x(s, column), sheet_y(s, row) + NAMED, s->width, s->width, exposure, map,
                ENVMAP_SPHERE, 0);
    pane_name(p, s, column, row, text);
}

/* A stored view: a source map above, and below it what the warp makes of it for the new view. */
static void cabral_column(picture *p, const sheet *look, int k, const cabral *set,
                          const int index[3], const float weight[3], const float frame[9]) {
    static const char *const axes[3] = {"view +x", "view +y", "view +z"};
    const float alone[3] = {(float)(k == 0), (float)(k == 1), (float)(k == 2)};
    envmap warped = measure_map(ENVMAP_SPHERE, 80, 1, 1);
    char text[32];
    snprintf(text, sizeof text, "b = %.2f", (double)weight[k]);
    measure_must(cabral_view(&warped, set, index, alone, frame), "the warp");
    draw_sphere(p, look, k, 0, exposure_of[SCENE_STUDIO], set->maps + index[k], axes[k]);
    draw_sphere(p, look, k, 1, exposure_of[SCENE_STUDIO], &warped, text);
    envmap_free(&warped);
}

/* The paper's figure 4: source maps, warped, and the weighted sum that is the new view's map. */
static void cabral_warp(const char *name) {
    enum { EDGE = 80 };
    static const sheet look = {
        "Cabral et al. 1999: a map for a new view",
        "GGX, alpha 0.2, in the studio, six stored views. A point of a map is a normal, the centre "
        "faces the viewer. Warped: by the reflected direction; b: the stored view's weight.",
        3,
        3,
        168,
        168 + NAMED,
        118,
        {NULL},
        {NULL},
        {"source maps", "warped", "new view"},
        {"eq. 1 for each stored view", "to v = (0.39, 0.49, 0.78)",
         "the sum is a map of 80 x 80 texels"}};
    static envmap_frame frames[EDGE * EDGE];
    brdf_values values = {{1, 1, 1}, 0.2, 0.2, 20, 0, 0};
    envmap_brdf brdf = {brdf_ggx, &values};
    picture p = sheet_begin(&look);
    envmap src = scene_map(SCENE_STUDIO, ENVMAP_CUBE, 40, 1);
    envmap sum = measure_map(ENVMAP_SPHERE, EDGE, 1, 1);
    envmap truth = measure_map(ENVMAP_SPHERE, EDGE, 1, 1);
    float frame[9], weight[3], v[3] = {0.39f, 0.49f, 0.78f};
    int index[3], x = sheet_x(&look, 2), y = sheet_y(&look, 2);
    char text[32];
    cabral set;
    mesh_unit(v);
    method_frame(frame, frame + 3, v);
    memcpy(frame + 6, v, sizeof v);
    measure_must(cabral_create(&set, &src, &brdf, 1, EDGE, NULL), "stored views");
    cabral_triangle(index, weight, set.steps, v);
    for (int k = 0; k < 3; ++k) cabral_column(&p, &look, k, &set, index, weight, frame);
    measure_must(cabral_view(&sum, &set, index, weight, frame), "the sum");
    measure_must(cabral_shade(&truth, frame, &src, &brdf, frames, NULL), "eq. 1");
    draw_sphere(&p, &look, 0, 2, exposure_of[SCENE_STUDIO], &sum, "sum of b times warped");
    draw_sphere(&p, &look, 1, 2, exposure_of[SCENE_STUDIO], &truth, "eq. 1 itself");
    heat_face(&p, x, y + NAMED, look.width, &sum, &truth, 0);
    snprintf(text, sizeof text, "off by, rms %.0f %%", 100 * rms_of(&sum, &truth));
    pane_name(&p, &look, 2, 2, text);
    heat_scale(&p, MARGIN, y + look.height - 24);
    cabral_free(&set), envmap_free(&src), envmap_free(&sum), envmap_free(&truth);
    sheet_end(&p, name);
}

/* The maps of a row of lobes, and what they light. */
static void glossy_maps(const char *name) {
    static const sheet look = {
        "The tutorial's prefiltered maps",
        "Both faces of the paraboloid maps themselves, and a teapot that looks them up: glossy "
        "ones by the reflected direction, the diffuse one (k_d = 0.2) by the normal.",
        5,
        3,
        130,
        130,
        70,
        {"mirror", "N = 1024", "N = 64", "N = 8", "diffuse"},
        {"256 x 256 texels", "256 x 256", "64 x 64", "32 x 32", "32 x 32"},
        {"front", "back", "teapot"},
        {"+z", "-z", ""}};
    static const float exponents[5] = {0, 1024, 64, 8, 1};
    static const int sizes[5] = {256, 256, 64, 32, 32};
    picture p = sheet_begin(&look);
    envmap src = scene_map(SCENE_SUN, ENVMAP_PARABOLOID, 256, 1);
    shot s = teapot_shot(look.width, look.height, 6.0f);
    for (int i = 0; i < 5; ++i) {
        int x = sheet_x(&look, i);
        float exposure = exposure_of[SCENE_SUN] * (i < 4 ? 1 : 0.2f);
        envmap_lobe lobe = i ? envmap_lobe_phong(exponents[i]) : envmap_lobe_mirror();
        envmap map = filtered(&src, lobe, ENVMAP_PARABOLOID, sizes[i], ENVMAP_METHOD_AUTO);
        for (int face = 0; face < 2; ++face)
            draw_disc(&p, x, sheet_y(&look, face), look.width, exposure, &map, face);
        shot_draw(&p, x, sheet_y(&look, 2), &s, exposure, i < 4 ? shade_glossy : shade_diffuse,
                  &map);
        envmap_free(&map);
    }
    envmap_free(&src), shot_free(&s);
    sheet_end(&p, name);
}

/* By the normal in the viewer's frame: user is a one_view. */
static void shade_drawn(float rgb[3], const float n[3], const float v[3], const void *user) {
    const one_view *w = (const one_view *)user;
    const float ahead[3] = {0, 0, 1};
    float eye[3], d[3];
    (void)v;
    for (int k = 0; k < 3; ++k) eye[k] = (k == 2 ? -1.0f : 1.0f) * mesh_dot(w->axes[k], n);
    reflected(d, eye, ahead); /* a sphere map has direction d at the normal that reflects it */
    envmap_lookup(rgb, w->map, d, 0);
}

/* Gooch's map as the course draws it: two triangles and a circle, then blurred. */
static void gooch(const char *name) {
    static const sheet look = {
        "The tutorial: a map for Gooch's shading, drawn by hand",
        "A point of the map is a normal, its centre faces the viewer. Blur: sigma of a Gaussian, "
        "in radii of the disc.",
        4,
        2,
        190,
        190,
        70,
        {"drawn", "blurred", "blurred more", "by the formula"},
        {"two triangles, a circle", "0.12 radii", "0.25 radii", "k warm + (1 - k) cool"},
        {"map", "teapot"},
        {"", ""}};
    static const float sigma[3] = {0, 0.12f, 0.25f};
    picture p = sheet_begin(&look);
    shot s = teapot_shot(look.width, look.height, 6.0f);
    for (int i = 0; i < 4; ++i) {
        envmap map = measure_map(ENVMAP_SPHERE, 256, 1, 1);
        one_view w = {&map, {{0}}, 0};
        camera_axes(w.axes, &s.camera);
        measure_must(i < 3 ? npr_gooch_drawn(&map, &npr_gooch_example, sigma[i])
                           : npr_gooch(&map, &npr_gooch_example),
                     "Gooch");
        picture_map(&p, sheet_x(&look, i), sheet_y(&look, 0), look.width, look.height, 0.8f, &map,
                    ENVMAP_SPHERE, 0);
        shot_draw(&p, sheet_x(&look, i), sheet_y(&look, 1), &s, 0.8f, shade_drawn, &w);
        envmap_free(&map);
    }
    shot_free(&s);
    sheet_end(&p, name);
}

/* -------------------------------------------------------------------------------------- >>vr -- */

/* (1 - F) albedo E(n) / pi + F L(r), F per channel by Schlick. */
typedef struct material {
    const envmap *diffuse, *glossy;
    float albedo[3], f0[3];
} material;

static void shade_material(float rgb[3], const float n[3], const float v[3], const void *user) {
    const material *m = (const material *)user;
    float r[3], shine[3], matt[3], nv = fmaxf(mesh_dot(n, v), 0);
    reflected(r, n, v);
    envmap_lookup(shine, m->glossy, r, 0), envmap_lookup(matt, m->diffuse, n, 0);
    for (int c = 0; c < 3; ++c) {
        float f = m->f0[c] > 0 ? (float)envmap_fresnel_schlick((double)nv, (double)m->f0[c]) : 0;
        rgb[c] = (1 - f) * m->albedo[c] * matt[c] + f * shine[c];
    }
}

/* The diffuse map of 64 x 64 texels that nine coefficients of a map give. */
static envmap nine(const envmap *src, int mapping) {
    double sh[27];
    envmap diffuse = measure_map(mapping, 64, 1, 1);
    envmap_lobe lobe = envmap_lobe_diffuse();
    measure_must(envmap_sh_project(sh, 3, src, 0, 0, NULL), "project");
    measure_must(envmap_sh_convolve(sh, sh, 3, &lobe, 0), "convolve");
    measure_must(envmap_sh_fill(&diffuse, 0, 0, sh, 3, 0, NULL), "fill");
    return diffuse;
}

/* Section 4: nine coefficients from faces of 8 x 8 texels, and from finer ones. */
static void small_faces(const char *name) {
    static const sheet look = {
        "The VR paper: coefficients from 8 x 8 faces",
        "Sphere maps of irradiance over pi. Cubes of a scene, resampled to 8 x 8, 16 x 16 and "
        "128 x 128 texels a face, give nine coefficients each. Off by: rms, of the nine of 128 x "
        "128.",
        4,
        4,
        132,
        132 + NAMED,
        84,
        {"8 x 8", "16 x 16", "128 x 128", "exact"},
        {"as published", "build/one_pass", "what is compared with", "diffuse map"},
        {"overcast", "overcast", "sun", "sun"},
        {"the map", "off by", "the map", "off by"}};
    static const int edges[3] = {8, 16, 128};
    picture p = sheet_begin(&look);
    for (int i = 0; i < 2; ++i) {
        int scene = i ? SCENE_SUN : SCENE_OVERCAST;
        float exposure = exposure_of[scene] * (i ? 0.5f : 1);
        envmap maps[4];
        for (int k = 0; k < 3; ++k) {
            envmap cube = scene_map(scene, ENVMAP_CUBE, edges[k], 1);
            maps[k] = nine(&cube, ENVMAP_SPHERE);
            envmap_free(&cube);
        }
        maps[3] =
            filtered(sky(scene), envmap_lobe_diffuse(), ENVMAP_SPHERE, 64, ENVMAP_METHOD_AUTO);
        for (int k = 0; k < 4; ++k) {
            char text[32];
            draw_sphere(&p, &look, k, 2 * i, exposure, maps + k, "");
            if (k == 2) continue;
            snprintf(text, sizeof text, "off by %.2g %%", 100 * rms_of(maps + k, maps + 2));
            pane_name(&p, &look, k, 2 * i + 1, text);
            heat_face(&p, sheet_x(&look, k), sheet_y(&look, 2 * i + 1) + NAMED, look.width,
                      maps + k, maps + 2, 0);
        }
        for (int k = 0; k < 4; ++k) envmap_free(maps + k);
    }
    heat_scale(&p, sheet_x(&look, 2) + 18, sheet_y(&look, 1) + 80);
    sheet_end(&p, name);
}

/* Fig. 3: three materials in two scenes. */
static void materials(const char *name) {
    static const sheet look = {
        "The VR paper, figure 3: three materials from one pass",
        "(1 - F) k_d E(n) + F L(r): nine coefficients give E, a map of exponent N gives L; F is "
        "Schlick's, and begins at f.",
        3,
        2,
        290,
        210,
        0,
        {"diffuse", "coated", "metal"},
        {"f = 0", "f = 0.06, N = 500", "f = 0.95, 0.64, 0.54, k_d = 0, N = 100"},
        {NULL},
        {NULL}};
    static const int scenes[2] = {SCENE_OVERCAST, SCENE_SUN};
    static const float exponents[3] = {100, 500, 100};
    picture p = sheet_begin(&look);
    shot s = teapot_shot(look.width, look.height, 5.4f);
    for (int i = 0; i < 6; ++i) {
        int x = sheet_x(&look, i % 3), y = sheet_y(&look, i / 3), scene = scenes[i / 3];
        envmap diffuse = nine(sky(scene), ENVMAP_CUBE), glossy;
        material m = {&diffuse, &glossy, {0.30f, 0.06f, 0.04f}, {0, 0, 0}};
        glossy = filtered(sky(scene), envmap_lobe_phong(exponents[i % 3]), ENVMAP_CUBE, 128,
                          ENVMAP_METHOD_AUTO);
        if (i % 3 == 1) scene_set(m.f0, 0.06f, 0.06f, 0.06f);
        if (i % 3 == 2) scene_set(m.f0, 0.95f, 0.64f, 0.54f), scene_set(m.albedo, 0, 0, 0);
        backdrop(&p, x, y, &s, scene);
        shot_draw(&p, x, y, &s, exposure_of[scene], shade_material, &m);
        envmap_free(&diffuse), envmap_free(&glossy);
    }
    shot_free(&s);
    sheet_end(&p, name);
}

/* One trilinear lookup at a biased level; alone: no face knows its neighbours. */
typedef struct biased {
    const envmap *map;
    float level;
    int alone;
} biased;

static void shade_biased(float rgb[3], const float n[3], const float v[3], const void *user) {
    const biased *b = (const biased *)user;
    float r[3];
    reflected(r, n, v);
    if (b->alone) method_lookup_face(rgb, b->map, r, b->level, 0);
    else envmap_lookup(rgb, b->map, r, b->level);
}

/* Figs. 4 and 5: a bias beyond the last level, and the bias that stands for N = 225. */
static void biases(const char *name) {
    static const sheet look = {
        "The VR paper, figures 4 and 5: one level, chosen by a bias b",
        "Box levels of a cube. Left, b = 9.4 is beyond the last level of faces of 512: six "
        "colours. "
        "Right, N = 225 and the level that the paper pairs with it, b = 2.25 (faces of 51 texels, "
        "where the formula of box_levels.h agrees).",
        5,
        2,
        176,
        176,
        74,
        {"b = 9.4", "b = 9.4", "N = 225", "b = 2.25", "b = 2.25"},
        {"published: faces alone", "levels across faces", "exact", "published: faces alone",
         "levels across faces"},
        {"ball", "teapot"},
        {"", ""}};
    picture p = sheet_begin(&look);
    envmap top[2], small[2], exact;
    shot s[2] = {ball_shot(look.width, look.height, 0.55f),
                 teapot_shot(look.width, look.height, 6.0f)};
    for (int k = 0; k < 2; ++k) { /* 0: plain boxes; 1: weighted */
        top[k] = scene_map(SCENE_OVERCAST, ENVMAP_CUBE, 512, 10);
        small[k] = scene_map(SCENE_OVERCAST, ENVMAP_CUBE, 51, 6);
        if (k) measure_must(envmap_mips_build(top + k), "mips");
        else method_plain_levels(top);
        if (k) measure_must(envmap_mips_build(small + k), "mips");
        else method_plain_levels(small);
    }
    exact = filtered(small + 1, envmap_lobe_phong(225), ENVMAP_CUBE, 128, ENVMAP_METHOD_AUTO);
    for (int i = 0; i < 10; ++i) {
        const biased all[5] = {{top, 9.4f, 1},
                               {top + 1, 9.4f, 0},
                               {&exact, 0, 0},
                               {small, 2.25f, 1},
                               {small + 1, 2.25f, 0}};
        shot_draw(&p, sheet_x(&look, i % 5), sheet_y(&look, i / 5), s + i / 5,
                  exposure_of[SCENE_OVERCAST], shade_biased, all + i % 5);
    }
    for (int k = 0; k < 2; ++k) envmap_free(top + k), envmap_free(small + k), shot_free(s + k);
    envmap_free(&exact);
    sheet_end(&p, name);
}

/* -------------------------------------------------------------------------------- >>lecture -- */

enum { POINT, BILINEAR, NEAREST_LEVEL, TRILINEAR, ANISOTROPIC, SAMPLED, LOOKUPS };

/* A mirror ball of PIXELS x PIXELS, one lookup a pixel: what each filter makes of its footprint. */
enum { PIXELS = 64 };

typedef struct lookups {
    const envmap *map;
    int filter;
} lookups;

/* The direction that a point of the ball reflects, unit; 0 outside. */
static int ball_reflects(float r[3], float x, float y) {
    float n[3], v[3] = {0, 0, 1}, r2 = x * x + y * y;
    if (r2 >= 1) return 0;
    scene_set(n, x, y, sqrtf(1 - r2));
    reflected(r, n, v);
    return 1;
}

static void nearest(float rgb[3], const envmap *map, const float d[3]) {
    float u, v;
    int face;
    envmap_coordinates(&face, &u, &v, map->mapping, d);
    memcpy(rgb,
           envmap_texel(map, 0, 0, face, clamped(u * (float)map->size, map->size - 1),
                        clamped(v * (float)map->size, map->size - 1)),
           3 * sizeof *rgb);
}

/* The mean of 16 x 16 points of the pixel. */
static void sampled(float rgb[3], const envmap *map, float x, float y) {
    int hits = 0;
    scene_set(rgb, 0, 0, 0);
    for (int k = 0; k < 256; ++k) {
        float r[3], one[3];
        float dx = ((float)(k % 16) - 7.5f) / 16, dy = ((float)(k / 16) - 7.5f) / 16;
        if (!ball_reflects(r, x + 2 * dx / PIXELS, y + 2 * dy / PIXELS)) continue;
        envmap_lookup(one, map, r, 0);
        for (int c = 0; c < 3; ++c) rgb[c] += one[c];
        ++hits;
    }
    for (int c = 0; c < 3; ++c) rgb[c] /= (float)(hits ? hits : 1);
}

/* The pixel about (x,y) of the ball; its footprint is the change of r to the next pixels. */
static int lookup_pixel(float rgb[3], float x, float y, const lookups *l) {
    float r[3], beside[2][3];
    float back_x = x > 0 ? -2.0f / PIXELS : 2.0f / PIXELS,
          back_y = y > 0 ? -2.0f / PIXELS : 2.0f / PIXELS;
    if (!ball_reflects(r, x, y)) return 0;
    ball_reflects(beside[0], x + back_x, y), ball_reflects(beside[1], x, y + back_y);
    for (int k = 0; k < 3; ++k) beside[0][k] -= r[k], beside[1][k] -= r[k];
    float level = envmap_footprint_level(l->map, r, beside[0], beside[1]);
    if (l->filter == POINT) nearest(rgb, l->map, r);
    if (l->filter == BILINEAR) envmap_lookup(rgb, l->map, r, 0);
    if (l->filter == NEAREST_LEVEL) envmap_lookup(rgb, l->map, r, floorf(level + 0.5f));
    if (l->filter == TRILINEAR) envmap_lookup(rgb, l->map, r, level);
    if (l->filter == ANISOTROPIC) envmap_lookup_footprint(rgb, l->map, r, beside[0], beside[1], 16);
    if (l->filter == SAMPLED) sampled(rgb, l->map, x, y);
    return 1;
}

/* Draws the ball's pixels as squares; returns the rms difference, after the tone curve, from what
   `truth` holds, or fills it. */
static double lookup_pane(picture *p, int left, int top, int edge, const lookups *l,
                          float truth[PIXELS * PIXELS][3]) {
    double error = 0, sum = 0;
    for (int i = 0; i < PIXELS * PIXELS; ++i) {
        float x = 2 * ((float)(i % PIXELS) + 0.5f) / PIXELS - 1, rgb[3];
        float y = 1 - 2 * ((float)(i / PIXELS) + 0.5f) / PIXELS;
        int from_x = i % PIXELS * edge / PIXELS, from_y = i / PIXELS * edge / PIXELS;
        if (!lookup_pixel(rgb, x, y, l)) continue;
        for (int c = 0; c < 3; ++c) {
            rgb[c] = picture_curve(exposure_of[SCENE_SUN] * rgb[c]);
            if (l->filter == SAMPLED) truth[i][c] = rgb[c];
            error += pow((double)(rgb[c] - truth[i][c]), 2), sum += pow((double)truth[i][c], 2);
        }
        picture_rectangle(p, left + from_x, top + from_y, (i % PIXELS + 1) * edge / PIXELS - from_x,
                          (i / PIXELS + 1) * edge / PIXELS - from_y, picture_colour(rgb), 1);
    }
    return sqrt(error / sum);
}

/* Point, bilinear, trilinear, anisotropic in one picture. */
static void lookup_filters(const char *name) {
    static const sheet look = {
        "The lecture's lookups: one lookup a pixel",
        "A mirror ball of 64 x 64 pixels and a cube of faces of 512 x 512 texels. Towards the rim "
        "a "
        "pixel reflects more and more of the cube, in one direction more than in the other. Off "
        "by: "
        "rms of the displayed light, relative to the mean of 256 points a pixel.",
        6,
        1,
        192,
        192,
        0,
        {"nearest texel", "bilinear", "bilinear, nearest level", "trilinear",
         "anisotropic, 16 probes", "256 points"},
        {NULL},
        {NULL},
        {NULL}};
    static float truth[PIXELS * PIXELS][3];
    picture p = sheet_begin(&look);
    envmap map = scene_map(SCENE_SUN, ENVMAP_CUBE, 512, 10);
    measure_must(envmap_mips_build(&map), "mips");
    for (int i = LOOKUPS - 1; i >= 0; --i) {
        char text[64] = "the truth";
        lookups l = {&map, i};
        int x = sheet_x(&look, i);
        double rms = lookup_pane(&p, x, sheet_y(&look, 0), look.width, &l, truth);
        if (i < SAMPLED) snprintf(text, sizeof text, "off by %.1f %%", 100 * rms);
        picture_caption(&p, (float)(x + look.width / 2), 123, 10, grey, text);
    }
    envmap_free(&map);
    sheet_end(&p, name);
}

/* -------------------------------------------------------------------------------- >>gaussian -- */

enum { GAUSSIANS = 3, GAUSSIAN_EDGE = 128 };
static const float gaussian_exponents[GAUSSIANS] = {640, 160, 40};

/* Levels of a chain as maps of their own. */
static void gaussian_chain(envmap out[GAUSSIANS], const envmap *src, const method_desc *desc) {
    envmap chain = measure_map(ENVMAP_CUBE, GAUSSIAN_EDGE, GAUSSIANS, 1);
    envmap_lobe lobes[GAUSSIANS];
    for (int i = 0; i < GAUSSIANS; ++i) lobes[i] = envmap_lobe_phong(gaussian_exponents[i]);
    measure_must(desc ? method_separable_chain(&chain, src, lobes, GAUSSIANS, desc)
                      : envmap_filter_chain(&chain, src, lobes, GAUSSIANS, NULL),
                 "a chain");
    for (int i = 0; i < GAUSSIANS; ++i) {
        out[i] = measure_map(ENVMAP_CUBE, GAUSSIAN_EDGE >> i, 1, 1);
        memcpy(out[i].texels, envmap_texel(&chain, i, 0, 0, 0, 0), measure_bytes(out + i, 1));
    }
    envmap_free(&chain);
}

/* A level seen from inside, or (truth not NULL) how far it is from the truth. */
typedef struct gaussian_view {
    picture_camera camera;
    const envmap *truth;
    float mean;
} gaussian_view;

static void gaussian_pane(picture *p, int left, int top, int width, int height,
                          const gaussian_view *view) {
    for (int y = 0; y < height; ++y)
        for (int x = 0; x < width; ++x) {
            float s = ((float)x + 0.5f) / (float)width, t = ((float)y + 0.5f) / (float)height;
            picture_camera exact = view->camera;
            float a[3], b[3], worst = 0;
            exact.map = view->truth;
            picture_camera_point(a, s, t, &view->camera), picture_camera_point(b, s, t, &exact);
            for (int c = 0; c < 3; ++c)
                worst = fmaxf(worst, fabsf(a[c] - b[c]) / fmaxf(b[c], 0.1f * view->mean));
            picture_blend(p, left + x, top + y, heat_colour(worst / HOTTEST), 1);
        }
}

/* The write-up's program, two rounds from the level before, beside a single pass. */
static void gaussians(const char *name) {
    static const sheet look = {
        "Separable Gaussians: one round, the program's two, mended",
        "Towards a corner of the cube, whose three edges meet in the middle of a pane: the third "
        "level of a chain, faces of 32 x 32 texels, and how far each level is from Phong's. "
        "Off by: rms of the whole level, relative to the exact one's.",
        4,
        4,
        190,
        130 + NAMED,
        90,
        {"exact", "one round", "two rounds", "mended"},
        {"", "from the source's levels", "from the level before", "exact flow, along the grid"},
        {"N = 40", "N = 640", "N = 160", "N = 40"},
        {"the level", "off by", "off by", "off by"}};
    picture p = sheet_begin(&look);
    envmap src = scene_map(SCENE_STUDIO, ENVMAP_CUBE, GAUSSIAN_EDGE, 1), all[4][GAUSSIANS];
    method_desc one = {0}, two = {0}, mended = {0};
    const method_desc *ways[4] = {NULL, &one, &two, &mended};
    one.form = two.form = METHOD_PUBLISHED, two.rounds = 2;
    for (int i = 0; i < 4; ++i) gaussian_chain(all[i], &src, ways[i]);
    for (int i = 0; i < 4; ++i) {
        gaussian_view v = {
            {all[i] + 2, 2.356194f, 0.6154797f, 0.9f, 0.9f * 130 / 190, 0}, NULL, 0.5f};
        picture_draw(&p, sheet_x(&look, i), sheet_y(&look, 0) + NAMED, look.width, 130,
                     exposure_of[SCENE_STUDIO], picture_camera_point, &v.camera);
        for (int k = 0; k < GAUSSIANS && i; ++k) {
            char text[32];
            v.camera.map = all[i] + k, v.truth = all[0] + k;
            gaussian_pane(&p, sheet_x(&look, i), sheet_y(&look, k + 1) + NAMED, look.width, 130,
                          &v);
            snprintf(text, sizeof text, "%.2g %%", 100 * rms_of(all[i] + k, all[0] + k));
            pane_name(&p, &look, i, k + 1, text);
        }
    }
    heat_scale(&p, sheet_x(&look, 0) + 40, sheet_y(&look, 2) + 70);
    for (int i = 0; i < 4 * GAUSSIANS; ++i) envmap_free(&all[0][0] + i);
    envmap_free(&src);
    sheet_end(&p, name);
}

/* ------------------------------------------------------------------------------------ >>main -- */

static const struct {
    const char *name;
    void (*draw)(const char *name);
} figures[] = {{"kautz-4", fig4},         {"kautz-5", fig5},           {"kautz-border", border},
               {"views", views},          {"cabral", cabral_warp},     {"maps", glossy_maps},
               {"gooch", gooch},          {"vr-3", materials},         {"vr-4-5", biases},
               {"vr-faces", small_faces}, {"lookups", lookup_filters}, {"gaussians", gaussians}};

int main(int argc, char **argv) {
    if (argc < 2) {
        fprintf(stderr, "usage: papers DOCS [NAME ...]\n");
        return 1;
    }
    docs = argv[1];
    for (int i = 0; i < COUNT(figures); ++i) {
        int wanted = argc == 2;
        for (int k = 2; k < argc; ++k) wanted |= !strcmp(argv[k], figures[i].name);
        if (!wanted) continue;
        fprintf(stderr, "papers: %5.1f s  %s\n", measure_seconds(), figures[i].name);
        figures[i].draw(figures[i].name);
    }
    for (int i = 0; i < SCENE_COUNT; ++i) envmap_free(skies + i);
    return 0;
}
