/* one_pass.c - diffuse and glossy light of an environment that is captured on the fly, in one
   pass over the object: nine coefficients in the vertex shader, one biased lookup in the levels of
   a cube in the fragment shader, Schlick's Fresnel between them.

     colour = F L(r; level + b) + (1 - F) albedo E(n) / pi,   F = f + (1 - f) (1 - n.v)^5

   What you will see: headless, the grid of f = 0.03, 0.09, 0.26, 0.42 by b = 0, 0.8, 1.7, 2.4; in a
   window one of them (F and B for the next), with the three balls that move around the object and
   in its reflections. Every frame: six faces, levels whose texels are tents that reach over
   the edges of a face, so that none shows a seam, and 6 x 16 x 16 texels to the CPU for the nine
   coefficients.

   usage: one_pass [--headless out.png] [overcast | studio | sun | sky.pfm]

   SPDX-License-Identifier: MIT */

#include "stage.h"
#include "capture.h"
#include "moving.h"

#define GRID 4
static const float schlick[GRID] = {0.03f, 0.09f, 0.26f, 0.42f}, bias[GRID] = {0, 0.8f, 1.7f, 2.4f};

typedef struct show {
    gl_app app;
    stage st;
    gl_mesh teapot;
    moving balls;
    capture caught;
} show;

static void draw(show *s, float f, float b) {
    capture_look look = {0, 0, {0.025f, 0.13f, 0.11f}};
    float model[16];
    mesh_identity(model);
    look.f = f, look.b = b;
    capture_draw(&s->caught, &s->app, &s->teapot, model, &look);
    moving_draw(&s->balls, &s->st, s->app.seconds, s->app.camera);
    stage_sky(&s->st, &s->app, 1);
}

static void draw_grid(show *s) {
    int i;
    for (i = 0; i < GRID * GRID; i++) {
        gl_cell(&s->app, i % GRID, i / GRID, GRID, GRID);
        draw(s, schlick[i / GRID], bias[i % GRID]);
    }
}

static void label(show *s) {
    picture *p = &s->app.shot;
    char text[64];
    int i;
    for (i = 0; i < GRID * GRID; i++) {
        snprintf(text, sizeof text, "f %.2f  b %.1f", (double)schlick[i / GRID],
                 (double)bias[i % GRID]);
        gl_write(p, text, i % GRID * p->width / GRID + 14, (i / GRID + 1) * p->height / GRID - 28);
    }
}

int main(int argc, char **argv) {
    static show s;
    int f = 1, b = 0;
    if (!gl_open(&s.app, "one_pass", 1280, 880, argc, argv)) return 1;
    if (!stage_open(&s.st, &s.app, SCENE_SUN, argc, argv) || !moving_create(&s.balls, 0) ||
        !capture_create(&s.caught) || !gl_mesh_make(&s.teapot, GL_TEAPOT))
        return 1;
    s.app.distance = 5.9f; /* no ball is cut by a pane */
    while (gl_frame(&s.app)) {
        if (s.app.key == 'F') f = (f + 1) % GRID;
        if (s.app.key == 'B') b = (b + 1) % GRID;
        moving_capture(&s.balls, &s.st, &s.caught, s.app.seconds);
        capture_levels(&s.caught);
        stage_say(capture_project(&s.caught));
        gl_target_bind(&s.app.frame);
        if (s.app.window) {
            draw(&s, schlick[f], bias[b]);
            snprintf(s.app.caption, sizeof s.app.caption, "F  f = %.2f\nB  b = %.1f",
                     (double)schlick[f], (double)bias[b]);
        } else {
            draw_grid(&s);
        }
        gl_show(&s.app);
    }
    if (s.app.shot.rgb) label(&s);
    capture_free(&s.caught);
    gl_mesh_free(&s.teapot);
    moving_free(&s.balls);
    stage_close(&s.st);
    return gl_close(&s.app);
}
