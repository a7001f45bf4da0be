/* gallery.h - the pictures of `envmap demo` and `envmap docs`.

   What you will see: contact-sheet.png, a row for each of three environments with the balls that it
   lights, from a mirror through five glossinesses to diffuse and brushed metal; and, for the
   documentation, one environment at five glossinesses, and the six parameterizations of one
   environment with their faces named in the scene itself.

   Include after envmap.h, picture.h and scenes.h.

   SPDX-License-Identifier: MIT */

#ifndef GALLERY_H
#define GALLERY_H

#include <stdio.h>
#include <string.h>

#define GALLERY_PAPER 0x15171Cu
#define GALLERY_INK   0xF3F1ECu
#define GALLERY_GREY  0x9AA0ABu
#define GALLERY_MARK  0xFFA24Cu /* what to look at */

/* One filtered map of a scene, and the ball that it is shown on. */
typedef struct gallery_look {
    const char *file, *caption, *remark;
    int kind;
    float parameter;
    int mapping, size, slices;
    picture_ball_kind ball;
    float albedo;    /* what the ball reflects of the light that it is shown */
    float tolerance; /* of the filter; 0: its default */
} gallery_look;

#define GALLERY_LOOKS 8
#define GALLERY_GLOSS 1 /* the first of five Phong lobes */
static const gallery_look gallery_looks[GALLERY_LOOKS] = {
    {"mirror", "mirror", "N = infinity", ENVMAP_LOBE_MIRROR, 0, ENVMAP_CUBE, 128, 1,
     PICTURE_BALL_REFLECTION, 1, 0},
    {"phong-1024", "N = 1024", "Phong", ENVMAP_LOBE_PHONG, 1024, ENVMAP_CUBE, 128, 1,
     PICTURE_BALL_REFLECTION, 1, 0},
    {"phong-256", "N = 256", "Phong", ENVMAP_LOBE_PHONG, 256, ENVMAP_CUBE, 96, 1,
     PICTURE_BALL_REFLECTION, 1, 0},
    {"phong-64", "N = 64", "Phong", ENVMAP_LOBE_PHONG, 64, ENVMAP_CUBE, 64, 1,
     PICTURE_BALL_REFLECTION, 1, 0},
    {"phong-16", "N = 16", "Phong", ENVMAP_LOBE_PHONG, 16, ENVMAP_CUBE, 48, 1,
     PICTURE_BALL_REFLECTION, 1, 0},
    {"phong-4", "N = 4", "Phong", ENVMAP_LOBE_PHONG, 4, ENVMAP_CUBE, 32, 1, PICTURE_BALL_REFLECTION,
     1, 0},
    {"diffuse", "diffuse", "k_d = 0.45", ENVMAP_LOBE_PHONG, 1, ENVMAP_CUBE, 32, 1,
     PICTURE_BALL_NORMAL, 0.45f, 0},
    {"banks", "Banks", "s = 0.95, k_s = 0.45", ENVMAP_LOBE_BANKS, 0.95f, ENVMAP_PARABOLOID, 64, 32,
     PICTURE_BALL_TANGENT, 0.45f, 0.01f}};

static const float gallery_exposure[SCENE_COUNT] = {0.62f, 0.62f, 0.52f};
static const char *const gallery_remark[SCENE_COUNT] = {
    "a square under clouds", "lamps in a dark room", "a terrace above a lake"};

typedef struct gallery {
    const char *folder;
    char path[4096]; /* the file at hand, for messages */
    envmap_filter_desc desc;
    int job, jobs; /* for progress over all maps */
    envmap_progress progress;
} gallery;

static inline const char *gallery_path(gallery *g, const char *scene, const char *name) {
    snprintf(g->path, sizeof g->path, "%s/%s%s%s", g->folder, scene, *scene ? "-" : "", name);
    return g->path;
}

static inline int gallery_report(void *user, float fraction) {
    gallery *g = (gallery *)user;
    if (!g->progress.report) return 0;
    return g->progress.report(g->progress.user, ((float)g->job + fraction) / (float)g->jobs);
}

static inline envmap_lobe gallery_lobe(const gallery_look *look) {
    if (look->kind == ENVMAP_LOBE_MIRROR) return envmap_lobe_mirror();
    if (look->kind == ENVMAP_LOBE_BANKS) return envmap_lobe_banks(look->parameter);
    return envmap_lobe_phong(look->parameter);
}

static inline envmap_result gallery_filter(gallery *g, envmap *map, const envmap *environment,
                                           const gallery_look *look) {
    envmap_lobe lobe = gallery_lobe(look);
    envmap_result result = envmap_create(map, look->mapping, look->size, 1, look->slices);
    g->desc.tolerance = look->tolerance;
    if (!result) result = envmap_filter(map, environment, &lobe, &g->desc);
    g->job++;
    return result;
}

static inline envmap_result gallery_environment(envmap *map, int scene, int size) {
    envmap_result result = envmap_create(map, ENVMAP_LATLONG, size, 1, 1);
    if (!result) scene_fill(map, scene);
    return result;
}

/* ------------------------------------------------------------------------------------ >>demo -- */

#define GALLERY_BALL   172
#define GALLERY_GAP    18
#define GALLERY_MARGIN 44
#define GALLERY_TOP    150
#define GALLERY_ROW    (GALLERY_BALL + 2 * GALLERY_GAP)

static inline int gallery_column(int look) {
    return GALLERY_MARGIN + 2 * GALLERY_BALL + 2 * GALLERY_GAP +
           look * (GALLERY_BALL + GALLERY_GAP);
}

static inline void gallery_head(picture *p) {
    int k;
    picture_rectangle(p, 0, 0, p->width, p->height, GALLERY_PAPER, 1);
    picture_text(p, GALLERY_MARGIN, 38, 26, GALLERY_INK, "envmap.h");
    picture_text(
        p, GALLERY_MARGIN + 190, 46, 15, GALLERY_GREY,
        "three environments, and the maps that are filtered from them: a ball is one lookup "
        "per point");
    picture_text(p, GALLERY_MARGIN, 104, 14, GALLERY_INK, "environment");
    picture_text(p, GALLERY_MARGIN, 128, 10, GALLERY_GREY, "512 x 256, lat-long");
    for (k = 0; k < GALLERY_LOOKS; k++) {
        float x = (float)(gallery_column(k) + GALLERY_BALL / 2);
        picture_caption(p, x, 104, 14, GALLERY_INK, gallery_looks[k].caption);
        picture_caption(p, x, 128, 10, GALLERY_GREY, gallery_looks[k].remark);
    }
}

/* The environment itself, with its name; its balls follow to the right. */
static inline void gallery_row_head(picture *p, const envmap *environment, int scene) {
    int x = GALLERY_MARGIN, y = GALLERY_TOP + scene * GALLERY_ROW + GALLERY_GAP / 2;
    picture_panorama(p, x, y, 2 * GALLERY_BALL, GALLERY_BALL, gallery_exposure[scene], environment);
    picture_rectangle(p, x, y + GALLERY_BALL - 30, 2 * GALLERY_BALL, 30, 0x000000, 0.5f);
    picture_text(p, (float)x + 12, (float)(y + GALLERY_BALL - 21), 12, GALLERY_INK,
                 scene_name[scene]);
    picture_text(p, (float)x + 24 + picture_text_width(scene_name[scene], 12),
                 (float)(y + GALLERY_BALL - 20), 10, 0xC8CCD4u, gallery_remark[scene]);
}

static inline envmap_result gallery_demo_map(gallery *g, picture *p, const envmap *environment,
                                             int scene, int k) {
    const gallery_look *look = &gallery_looks[k];
    char name[64];
    envmap map = {0};
    envmap_result result;
    snprintf(name, sizeof name, "%s.pfm", look->file);
    gallery_path(g, scene_name[scene], name);
    result = gallery_filter(g, &map, environment, look);
    if (!result) result = write_result(write_pfm(&map, 0, g->path));
    if (!result)
        picture_ball(p, gallery_column(k), GALLERY_TOP + scene * GALLERY_ROW + GALLERY_GAP / 2,
                     GALLERY_BALL, look->albedo * gallery_exposure[scene], &map, look->ball);
    envmap_free(&map);
    return result;
}

static inline envmap_result gallery_demo_scene(gallery *g, picture *p, int scene) {
    envmap environment = {0};
    envmap_result result;
    int k;
    gallery_path(g, scene_name[scene], "environment.pfm");
    result = gallery_environment(&environment, scene, 256);
    if (!result) result = write_result(write_pfm(&environment, 0, g->path));
    if (!result) gallery_row_head(p, &environment, scene);
    for (k = 0; k < GALLERY_LOOKS && !result; k++)
        result = gallery_demo_map(g, p, &environment, scene, k);
    envmap_free(&environment);
    return result;
}

static inline envmap_result gallery_save(gallery *g, const picture *p, const char *name) {
    return write_result(write_png(p, gallery_path(g, "", name)));
}

/* Sets up progress over `jobs` maps; the caller's progress hears of the whole. */
static inline void gallery_begin(gallery *g, int jobs) {
    g->progress = g->desc.work.progress;
    g->desc.work.progress.user = g;
    g->desc.work.progress.report = gallery_report;
    g->job = 0, g->jobs = jobs;
}

/* Everything of `envmap demo`: PFM files and contact-sheet.png in g->folder. */
static inline envmap_result gallery_demo(gallery *g) {
    picture p;
    envmap_result result = ENVMAP_OK;
    int scene, width = gallery_column(GALLERY_LOOKS) - GALLERY_GAP + GALLERY_MARGIN;
    gallery_begin(g, SCENE_COUNT * GALLERY_LOOKS);
    gallery_path(g, "", "contact-sheet.png");
    if (!picture_create(&p, width, GALLERY_TOP + SCENE_COUNT * GALLERY_ROW + 20))
        return ENVMAP_ERROR_MEMORY;
    gallery_head(&p);
    for (scene = 0; scene < SCENE_COUNT && !result; scene++)
        result = gallery_demo_scene(g, &p, scene);
    if (!result) result = gallery_save(g, &p, "contact-sheet.png");
    picture_free(&p);
    return result;
}

/* ------------------------------------------------------------------------------------ >>hero -- */

#define GALLERY_HERO_WIDTH  1080
#define GALLERY_HERO_BAND   208
#define GALLERY_HERO_HEIGHT 452

/* All around, from 25 degrees below the horizon to 44 above. */
static inline int gallery_band_point(float rgb[3], float s, float t, const void *user) {
    const envmap *map = (const envmap *)user;
    float dir[3];
    envmap_direction(dir, ENVMAP_LATLONG, 0, s, 0.255f + t * (0.64f - 0.255f));
    envmap_lookup(rgb, map, dir, 0);
    return 1;
}

static inline envmap_result gallery_hero_balls(gallery *g, picture *p, const envmap *environment,
                                               float exposure) {
    envmap_result result = ENVMAP_OK;
    int k, edge = 164, gap = (GALLERY_HERO_WIDTH - 5 * edge) / 5;
    for (k = 0; k < 5 && !result; k++) {
        const gallery_look *look = &gallery_looks[GALLERY_GLOSS + k];
        int x = gap / 2 + k * (edge + gap);
        envmap map = {0};
        result = gallery_filter(g, &map, environment, look);
        if (!result) picture_ball(p, x, GALLERY_HERO_BAND + 26, edge, exposure, &map, look->ball);
        envmap_free(&map);
        picture_caption(p, (float)(x + edge / 2), GALLERY_HERO_HEIGHT - 42, 15, GALLERY_INK,
                        look->caption);
    }
    return result;
}

/* One environment, and below it the five balls that it lights. */
static inline envmap_result gallery_hero(gallery *g) {
    const float exposure = 0.52f;
    picture p;
    envmap environment = {0};
    envmap_result result;
    gallery_path(g, "", "glossinesses.png");
    if (!picture_create(&p, GALLERY_HERO_WIDTH, GALLERY_HERO_HEIGHT)) return ENVMAP_ERROR_MEMORY;
    picture_rectangle(&p, 0, 0, p.width, p.height, GALLERY_PAPER, 1);
    result = gallery_environment(&environment, SCENE_SUN, 512);
    if (!result) {
        picture_draw(&p, 0, 0, p.width, GALLERY_HERO_BAND, exposure, gallery_band_point,
                     &environment);
        result = gallery_hero_balls(g, &p, &environment, exposure);
    }
    if (!result) result = gallery_save(g, &p, "glossinesses.png");
    envmap_free(&environment);
    picture_free(&p);
    return result;
}

/* ------------------------------------------------------------------------ >>parameterizations --
 */

/* The name of the axis that d points along, hung into the scene as a sign that reads rightly from
   inside: 0 where it is not, 1 on its letters, 2 on their dark outline. */
static inline int gallery_sign(const float d[3]) {
    static const char *const names[6] = {"+X", "-X", "+Y", "-Y", "+Z", "-Z"};
    static const float ups[6][3] = {{0, 1, 0},  {0, 1, 0}, {0, 0, 1},
                                    {0, 0, -1}, {0, 1, 0}, {0, 1, 0}};
    float a = fabsf(d[0]), b = fabsf(d[1]), c = fabsf(d[2]), ahead[3] = {0, 0, 0}, right[3], x, y,
          far_off;
    int axis = a >= b && a >= c ? 0 : b >= c ? 1 : 2, face = 2 * axis + (d[axis] < 0);
    const float *up = ups[face];
    ahead[axis] = d[axis] < 0 ? -1.0f : 1.0f;
    right[0] = ahead[1] * up[2] - ahead[2] * up[1];
    right[1] = ahead[2] * up[0] - ahead[0] * up[2];
    right[2] = ahead[0] * up[1] - ahead[1] * up[0];
    x = scene_dot(d, right) / fabsf(d[axis]), y = scene_dot(d, up) / fabsf(d[axis]);
    far_off = picture_text_distance(
        names[face], x / 0.07f + picture_text_width(names[face], 10) / 2, 5 - y / 0.07f);
    return far_off < 0.95f ? 1 : far_off < 1.6f ? 2 : 0;
}

static inline int gallery_signed_point(float rgb[3], float s, float t, const void *user) {
    const picture_face *f = (const picture_face *)user;
    float d[3];
    int sign;
    if (!picture_face_point(rgb, s, t, user)) return 0;
    envmap_direction(d, f->mapping, f->face, s, t);
    sign = gallery_sign(d);
    if (sign == 1) scene_set(rgb, 4, 4, 4);
    if (sign == 2) scene_set(rgb, 0.05f, 0.06f, 0.08f);
    return 1;
}

/* One face with its caption, and whether it is a mirrored picture. */
static inline void gallery_face(picture *p, int x, int y, int edge, const envmap *map, int mapping,
                                int face, const char *caption, int mirrored) {
    picture_face f;
    int width = mapping == ENVMAP_LATLONG ? 2 * edge : edge;
    float middle = (float)x + 0.5f * (float)width;
    f.map = map, f.mapping = mapping, f.face = face;
    picture_draw(p, x, y, width, edge, 0.52f, gallery_signed_point, &f);
    if (mapping == ENVMAP_PARABOLOID)
        picture_circle(p, middle, (float)y + 0.5f * (float)edge, 0.5f * (float)edge, 1.5f,
                       0xFFFFFFu);
    picture_caption(p, middle, (float)(y + edge + 12), 11, GALLERY_INK, caption);
    picture_caption(p, middle, (float)(y + edge + 31), 10, mirrored ? GALLERY_MARK : GALLERY_GREY,
                    mirrored ? "mirrored" : "not mirrored");
}

static inline void gallery_maps(picture *p, const envmap *map) {
    static const char *const names[6] = {"0: +X", "1: -X", "2: +Y", "3: -Y", "4: +Z", "5: -Z"};
    int face, x, edge = 146, y = 118;
    picture_text(p, 28, 96, 10, GALLERY_INK, "ENVMAP_CUBE");
    for (face = 0; face < 6; face++)
        gallery_face(p, 28 + face * (edge + 16), y, edge, map, ENVMAP_CUBE, face, names[face], 1);
    y += edge + 94, edge = 126, x = 28;
    picture_text(p, (float)x, (float)y - 22, 10, GALLERY_INK, "ENVMAP_PARABOLOID");
    gallery_face(p, x, y, edge, map, ENVMAP_PARABOLOID, 0, "0: front, +Z", 1);
    gallery_face(p, x += edge + 10, y, edge, map, ENVMAP_PARABOLOID, 1, "1: back, -Z", 0);
    picture_text(p, (float)(x += edge + 16), (float)y - 22, 10, GALLERY_INK, "ENVMAP_SPHERE");
    gallery_face(p, x, y, edge, map, ENVMAP_SPHERE, 0, "centre +Z", 1);
    picture_text(p, (float)(x += edge + 16), (float)y - 22, 10, GALLERY_INK, "ENVMAP_ANGULAR");
    gallery_face(p, x, y, edge, map, ENVMAP_ANGULAR, 0, "centre -Z", 0);
    picture_text(p, (float)(x += edge + 16), (float)y - 22, 10, GALLERY_INK, "ENVMAP_LATLONG");
    gallery_face(p, x, y, edge, map, ENVMAP_LATLONG, 0, "centre -Z", 0);
    picture_text(p, (float)(x += 2 * edge + 16), (float)y - 22, 10, GALLERY_INK,
                 "ENVMAP_OCTAHEDRAL");
    gallery_face(p, x, y, edge, map, ENVMAP_OCTAHEDRAL, 0, "centre +Y", 1);
}

/* The six parameterizations of one scene. */
static inline envmap_result gallery_parameterizations(gallery *g) {
    picture p;
    envmap map = {0};
    envmap_result result;
    gallery_path(g, "", "parameterizations.png");
    if (!picture_create(&p, 1012, 552)) return ENVMAP_ERROR_MEMORY;
    picture_rectangle(&p, 0, 0, p.width, p.height, GALLERY_PAPER, 1);
    picture_text(&p, 28, 28, 20, GALLERY_INK, "One scene, six parameterizations");
    picture_text(
        &p, 28, 62, 9.5f, GALLERY_GREY,
        "The letters hang in the scene and read rightly from inside; where they are reversed, "
        "the map is a mirrored picture.");
    result = gallery_environment(&map, SCENE_SUN, 128);
    if (!result) {
        gallery_maps(&p, &map);
        result = gallery_save(g, &p, "parameterizations.png");
    }
    envmap_free(&map);
    picture_free(&p);
    return result;
}

/* Everything of `envmap docs`. */
static inline envmap_result gallery_docs(gallery *g) {
    envmap_result result;
    gallery_begin(g, 5);
    result = gallery_hero(g);
    return result ? result : gallery_parameterizations(g);
}

#endif /* GALLERY_H */
