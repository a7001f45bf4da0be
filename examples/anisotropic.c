/* anisotropic.c - brushed metal by Banks' lobe: the light that a thread along t sends to the eye
   depends on t and on v.t, so it is a stack of maps, one 3D texture for each half of the sphere.

   What you will see: the teapot, brushed around its axis, s = 0.99; beside it the slices of the map
   at angles between eye and thread of 44, 39 and 35 degrees, each with the ring that the lobe
   leaves of every lamp. In a window: drag to orbit; S changes s.

   usage: anisotropic [--headless out.png] [overcast | studio | sun | sky.pfm]      a lat-long map

   SPDX-License-Identifier: MIT */

#define _POSIX_C_SOURCE 200809L
#define ENVMAP_STATIC
#define ENVMAP_IMPLEMENTATION
#include "envmap.h"
#include "stage.h"

#define SIZE   96
#define SLICES 96

static const float sharpness[4] = {0.99f, 0.95f, 0.9f, 0.7f};

/* Filters the environment for one s into the two volumes. */
static envmap_result brush(surface *s, envmap *map, const stage *st, float sharp) {
    envmap_lobe lobe = envmap_lobe_banks(sharp);
    envmap_result result =
        map->texels ? ENVMAP_OK : envmap_create(map, ENVMAP_PARABOLOID, SIZE, 1, SLICES);
    int face;
    if (!result) result = envmap_filter(map, &st->environment, &lobe, &st->desc);
    for (face = 0; face < 2 && !result; face++) {
        gl.DeleteTextures(1, &s->slices[face]);
        s->slices[face] = gl_volume(map, face);
    }
    return result;
}

typedef struct slice_view {
    const envmap *map;
    float p;
} slice_view;

/* One slice as the front paraboloid, up to its rim. */
static int slice_point(float rgb[3], float s, float t, const void *user) {
    const slice_view *view = (const slice_view *)user;
    float dir[3];
    if (hypotf(2 * s - 1, 2 * t - 1) > 1) return 0;
    envmap_direction(dir, ENVMAP_PARABOLOID, 0, s, t);
    envmap_lookup_slice(rgb, view->map, dir, view->p, 0);
    return 1;
}

static void slices_beside(picture *p, const envmap *map, float exposure) {
    static const int angles[3] = {44, 39, 35};
    int k, edge = p->height / 4, x = p->width - edge - 36;
    char text[64];
    for (k = 0; k < 3; k++) {
        slice_view view;
        int y = 36 + k * (edge + 48);
        view.map = map, view.p = cosf((float)angles[k] * MESH_TURN / 360);
        picture_draw(p, x, y, edge, edge, exposure, slice_point, &view);
        snprintf(text, sizeof text, "v, t: %d degrees", angles[k]);
        picture_caption(p, (float)(x + edge / 2), (float)(y + edge + 12), 12, 0xFFFFFFu, text);
    }
}

int main(int argc, char **argv) {
    gl_app app;
    stage st;
    surface s = surface_default();
    gl_mesh teapot;
    envmap map;
    float model[16];
    int k = 0;
    memset(&map, 0, sizeof map);
    if (!gl_open(&app, "anisotropic", 1200, 720, argc, argv)) return 1;
    if (!stage_open(&st, &app, SCENE_STUDIO, argc, argv)) return 1;
    gl_mesh_make(&teapot, GL_TEAPOT);
    s.axis = SURFACE_TANGENT, s.diffuse = SURFACE_NO_DIFFUSE;
    mesh_identity(model);
    if (!app.window) app.at[0] = 0.5f, app.distance = 7; /* room for the slices */
    stage_say(brush(&s, &map, &st, sharpness[k]));
    while (gl_frame(&app)) {
        if (app.key == 'S') stage_say(brush(&s, &map, &st, sharpness[k = (k + 1) % 4]));
        surface_draw(st.surface, &app, &s, &teapot, model);
        stage_sky(&st, &app, 3);
        snprintf(app.caption, sizeof app.caption, "Banks, s = %.2f", (double)sharpness[k]);
        gl_show(&app);
    }
    if (app.shot.rgb) slices_beside(&app.shot, &map, app.exposure);
    gl.DeleteTextures(2, s.slices);
    gl_mesh_free(&teapot);
    envmap_free(&map);
    stage_close(&st);
    return gl_close(&app);
}
