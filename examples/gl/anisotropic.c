/* anisotropic.c - brushed metal in two ways. Banks' lobe: the light that a thread along t sends to
   the eye depends on t and on v.t, so it is a stack of maps, one 3D texture for each half of the
   sphere. An elliptical lobe: one map of a round lobe, looked up along a fan across the strokes.

   What you will see: two teapots, brushed around their axis; on the left Banks with s = 0.99, on
   the right the ellipse; between them Banks' slices at angles between eye and thread of 44, 39
   and 35 degrees, each with the ring that the lobe leaves of every lamp. In a window one teapot:
   drag to orbit; L for the other lobe, S for the next s.

   usage: anisotropic [--headless out.png] [overcast | studio | sun | sky.pfm]      a lat-long map

   SPDX-License-Identifier: MIT */

#include "stage.h"

#define SIZE   96
#define SLICES 96
#define ROUND  300  /* the exponent of the fan's map */
#define ALONG  0.5f /* sigma of the ellipse across the strokes, rad */

static const float sharpness[4] = {0.99f, 0.95f, 0.9f, 0.7f};

typedef struct show {
    gl_app app;
    stage st;
    gl_mesh teapot;
    surface banks, ellipse;
    envmap stack;
} show;

/* Filters the environment for one s into the two volumes. */
static envmap_result brush(show *s, float sharp) {
    envmap_lobe lobe = envmap_lobe_banks(sharp);
    envmap_filter_desc desc = s->st.desc;
    envmap_result result =
        s->stack.texels ? ENVMAP_OK : envmap_create(&s->stack, ENVMAP_PARABOLOID, SIZE, 1, SLICES);
    int face;
    desc.tolerance = 0.01f; /* what an eye may see */
    if (!result) result = envmap_filter(&s->stack, &s->st.environment, &lobe, &desc);
    for (face = 0; face < 2 && !result; face++) {
        gl.DeleteTextures(1, &s->banks.slices[face]);
        s->banks.slices[face] = gl_volume(&s->stack, face);
    }
    return result;
}

/* The round map, and the fan that stretches it. */
static envmap_result stretch(show *s) {
    envmap_lobe lobe = envmap_lobe_phong(fminf(ROUND, stage_sharpest(&s->st)));
    if (!surface_fan(&s->ellipse, (double)ALONG, envmap_lobe_sigma(&lobe, 0)))
        return ENVMAP_ERROR_LOBE;
    return stage_filter(&s->ellipse.map, &s->st, ENVMAP_CUBE, 128, &lobe);
}

static void draw(show *s, const surface *look) {
    float model[16];
    mesh_identity(model);
    surface_draw(s->st.surface, &s->app, look, &s->teapot, model);
    stage_sky(&s->st, &s->app, 0);
}

/* ---------------------------------------------------------------------------------- >>slices -- */

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

#define COLUMN 180 /* pixels, for the slices in the middle */

static void label(const show *s, picture *p) {
    static const int angles[3] = {44, 39, 35};
    int k, edge = 138, row = p->height / 3, middle = p->width / 2;
    char text[64];
    picture_rectangle(p, middle - COLUMN / 2, 0, COLUMN, p->height, 0x15171Cu, 1);
    for (k = 0; k < 3; k++) {
        slice_view view;
        int y = k * row + (row - edge - 26) / 2;
        view.map = &s->stack, view.p = cosf((float)angles[k] * MESH_TURN / 360);
        picture_draw(p, middle - edge / 2, y, edge, edge, s->app.exposure, slice_point, &view);
        snprintf(text, sizeof text, "v, t: %d degrees", angles[k]);
        picture_caption(p, (float)middle, (float)(y + edge + 14), 12, 0xF3F1ECu, text);
    }
    gl_write(p, "Banks, s = 0.99: a stack of maps", 20, p->height - 34);
    gl_write(p, "an elliptical lobe: a fan in one map", middle + COLUMN / 2 + 20, p->height - 34);
}

static void draw_both(show *s) {
    int width = (s->app.width - COLUMN) / 2;
    gl_area(&s->app, 0, 0, width, s->app.height);
    draw(s, &s->banks);
    gl_area(&s->app, width + COLUMN, 0, width, s->app.height);
    draw(s, &s->ellipse);
}

int main(int argc, char **argv) {
    static show s;
    int i, k = 0, fan = 0;
    if (!gl_open(&s.app, "anisotropic", 1440, 560, argc, argv)) return 1;
    if (!stage_open(&s.st, &s.app, SCENE_STUDIO, argc, argv)) return 1;
    if (!gl_mesh_make(&s.teapot, GL_TEAPOT)) return 1;
    s.banks = s.ellipse = surface_default();
    for (i = 0; i < 3; i++) s.banks.tint[i] = 0.75f; /* threads know no horizon, and shine more */
    s.banks.axis = SURFACE_TANGENT, s.ellipse.axis = SURFACE_FAN;
    if (!s.app.window) s.app.distance = 4.9f, s.app.at[0] = 0.1f;
    if (!stage_say(brush(&s, sharpness[k])) || !stage_say(stretch(&s))) return 1;
    while (gl_frame(&s.app)) {
        if (s.app.key == 'S') stage_say(brush(&s, sharpness[k = (k + 1) % 4]));
        if (s.app.key == 'L') fan = !fan;
        if (s.app.window) {
            draw(&s, fan ? &s.ellipse : &s.banks);
            snprintf(s.app.caption, sizeof s.app.caption, "L  %s, S  s = %.2f",
                     fan ? "elliptical" : "Banks", (double)sharpness[k]);
        } else {
            draw_both(&s);
        }
        gl_show(&s.app);
    }
    if (s.app.shot.rgb) label(&s, &s.app.shot);
    gl.DeleteTextures(2, s.banks.slices);
    gl.DeleteTextures(1, &s.ellipse.map);
    gl_mesh_free(&s.teapot);
    envmap_free(&s.stack);
    stage_close(&s.st);
    return gl_close(&s.app);
}
