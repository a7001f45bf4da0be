/* nonphotorealistic.c - maps that nobody filtered: four sphere maps in the viewer's frame, drawn by
   examples/methods/nonphotorealistic.h, on one teapot that turns. The map stands still on the
   screen while the teapot moves under it, as ink follows a silhouette.

   What you will see: a cartoonist's window, Gooch's warm and cool, a black silhouette, hatching.
   Below, turned and further away: levels that were drawn by hand keep ink as many pixels wide. In
   a window the four of them turn; drag to orbit, wheel to come closer.

   usage: nonphotorealistic [--headless out.png]

   SPDX-License-Identifier: MIT */

#include "stage.h"
#include "../methods/nonphotorealistic.h"

#define EDGE   256
#define LEVELS 7

typedef struct show {
    gl_app app;
    GLuint program, maps[NPR_COUNT];
    gl_mesh teapot;
} show;

static envmap_result draw_map(GLuint *texture, int kind) {
    envmap map = {0};
    envmap_result result;
    result = envmap_create(&map, ENVMAP_SPHERE, EDGE, LEVELS, 1);
    if (!result) result = npr_example(&map, kind);
    if (!result) *texture = gl_map(&map);
    envmap_free(&map);
    return result;
}

/* Levels are chosen for every pixel, so that a line is as wide on the handle as on the body: a
   texel for a pixel. */
static void draw(show *s, int kind, float turn) {
    surface look = surface_default();
    float model[16];
    mesh_turn(model, 1, turn);
    look.lookup = SURFACE_SPHERE, look.axis = SURFACE_DRAWN;
    look.map = s->maps[kind], look.level = -(float)s->app.samples;
    surface_draw(s->program, &s->app, &look, &s->teapot, model);
}

/* Four large ones, and of each two small ones further on in their turn. */
static void draw_all(show *s) {
    int k, column = s->app.width / NPR_COUNT, large = s->app.height * 2 / 3;
    float turn = (float)s->app.seconds * 0.6f, distance = s->app.distance;
    for (k = 0; k < NPR_COUNT; k++) {
        gl_area(&s->app, k * column, 0, column, large);
        draw(s, k, turn);
        gl_area(&s->app, k * column + 20, large - 30, column / 2 - 20, s->app.height - large);
        draw(s, k, turn + 1.1f);
        s->app.distance *= 1.7f;
        gl_area(&s->app, k * column + column / 2, large - 30, column / 2 - 20,
                s->app.height - large);
        draw(s, k, turn + 2.2f);
        s->app.distance = distance;
    }
}

int main(int argc, char **argv) {
    static show s;
    int k, good;
    if (!gl_open(&s.app, "nonphotorealistic", 1440, 540, argc, argv)) return 1;
    s.program = surface_program();
    good = s.program && gl_mesh_make(&s.teapot, GL_TEAPOT);
    for (k = 0; k < NPR_COUNT && good; k++) good = stage_say(draw_map(&s.maps[k], k));
    if (!good) return 1;
    s.app.distance = 5, s.app.at[0] = 0.1f;
    while (gl_frame(&s.app)) {
        gl.ClearColor(1.1f, 1.07f, 1, 0); /* paper */
        gl.Clear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
        draw_all(&s);
        gl_show(&s.app);
    }
    for (k = 0; k < NPR_COUNT && s.app.shot.rgb; k++)
        picture_text(&s.app.shot, (float)(k * s.app.width / NPR_COUNT + 24),
                     (float)s.app.height - 34, 13, 0x202020u, npr_name[k]);
    gl.DeleteTextures(NPR_COUNT, s.maps);
    gl_mesh_free(&s.teapot);
    gl.DeleteProgram(s.program);
    return gl_close(&s.app);
}
