/* per_frame.c - an environment that moves, captured into a cube in every frame, and its whole GGX
   chain filtered anew on the CPU by the library: the mirror of edge 128, roughness 1/4, 2/4, 3/4
   and 1 of edge 8.

   What you will see: balls of these four roughnesses while lamps move around them. Above they look
   up the chain, below the box levels that the card makes of the same cube (glGenerateMipmap), at
   the level as wide as the lobe. Under them what a frame takes, part by part, how long the box
   levels take, and how often the filter asked the system for memory: after the first frames never,
   for it works in a cache. Each part waits for the one before, so that the clock is fair.
   In a window: O for another object, drag to orbit.

   usage: per_frame [--headless out.png] [overcast | studio | sun | sky.pfm]

   SPDX-License-Identifier: MIT */

#define _POSIX_C_SOURCE 200809L
#include "../cache.h"
#include "stage.h"
#include "capture.h"
#include "moving.h"
#include "refilter.h"
#include "../methods/box_levels.h"

enum { CAPTURE, READ, FILTER, UPLOAD, DRAW, PARTS, BOXES = PARTS, TIMES };
enum { WIDTH = 1280, COLUMNS = 4, PANE = WIDTH / COLUMNS, HEAD = 34, STRIP = 124, WARM = 24 };

static const char *const part_name[PARTS] = {"capture", "read back", "filter, CPU", "upload",
                                             "draw"};
static const unsigned part_colour[TIMES] = {0x5FA8D3u, 0x9AA0ABu, 0xFFA24Cu,
                                            0xE8D26Au, 0x7BB662u, 0xC98BDBu};

typedef struct show {
    gl_app app;
    stage st;
    moving lamps;
    capture caught;
    refilter filtered;
    gl_mesh meshes[GL_MESH_COUNT];
    int object, asked;
    double seconds, times[TIMES]; /* of the scene; of the parts, smoothed */
} show;

/* A part of this frame, into the smoothed one. */
static void count(show *s, int part, double took) {
    double share =
        s->app.frames < 4 ? 1 : 0.1; /* the first frames are not like those that follow */
    s->times[part] += share * (took - s->times[part]);
}

/* A part that ends when the card has done its work; returns when that was. */
static double finish(show *s, int part, double start) {
    gl.Finish();
    count(s, part, gl_seconds() - start);
    return gl_seconds();
}

/* One object of a row: a texture at a level, in its pane. */
static void draw_pane(show *s, int column, int row, GLuint cube, float level) {
    surface look = surface_default();
    float model[16];
    mesh_turn(model, 0, s->object == GL_TORUS ? 0.9f : 0);
    look.map = cube, look.level = level;
    gl_area(&s->app, column * PANE, HEAD + row * (HEAD + PANE), PANE, PANE);
    surface_draw(s->st.surface, &s->app, &look, &s->meshes[s->object], model);
    moving_draw(&s->lamps, &s->st, s->seconds, s->app.camera);
    stage_sky(&s->st, &s->app, 0);
}

/* The level of the card's boxes that is as wide as a level of the chain. */
static float box_level(const show *s, int level) {
    double l = method_box_level(&s->filtered.lobes[level], CAPTURE_EDGE);
    return (float)fmin(l, CAPTURE_LEVELS - 1);
}

static void make_boxes(const show *s) {
    gl.BindTexture(GL_TEXTURE_CUBE_MAP, s->caught.cube);
    gl.GenerateMipmap(GL_TEXTURE_CUBE_MAP);
}

static void frame(show *s) {
    double start = gl_seconds();
    int i;
    moving_capture(&s->lamps, &s->st, &s->caught, s->seconds);
    finish(s, CAPTURE, start);
    stage_say(refilter_run(&s->filtered, &s->caught));
    count(s, READ, s->filtered.read);
    count(s, FILTER, s->filtered.filtered);
    count(s, UPLOAD, s->filtered.uploaded);
    start = gl_seconds();
    make_boxes(s);
    start = finish(s, BOXES, start);
    gl_target_bind(&s->app.frame);
    for (i = 0; i < 2 * COLUMNS; i++)
        draw_pane(s, i % COLUMNS, i / COLUMNS, i < COLUMNS ? s->filtered.cube : s->caught.cube,
                  i < COLUMNS ? (float)(i + 1) : box_level(s, i % COLUMNS + 1));
    finish(s, DRAW, start);
}

static double frame_time(const show *s) {
    double sum = 0;
    int k;
    for (k = 0; k < PARTS; k++) sum += s->times[k];
    return sum;
}

static void words(show *s) {
    const double *t = s->times;
    snprintf(
        s->app.caption, sizeof s->app.caption,
        "a frame in %.1f ms: capture %.1f, read back %.1f, filter %.1f, upload %.1f, draw %.1f\n"
        "above the GGX chain; below the card's box levels, made in %.1f ms\n"
        "asked for memory %d times",
        1e3 * frame_time(s), 1e3 * t[CAPTURE], 1e3 * t[READ], 1e3 * t[FILTER], 1e3 * t[UPLOAD],
        1e3 * t[DRAW], 1e3 * t[BOXES], s->filtered.asked);
}

/* ----------------------------------------------------------------------------- >>the picture -- */

/* Parts from..to as a bar whose whole width is a frame; returns where it ends. */
static void bar(const show *s, picture *p, int y, int from, int to) {
    const double scale = (WIDTH - 300) / frame_time(s);
    double at = 190;
    int k;
    for (k = from; k < to; k++) {
        int x = (int)(at + 0.5);
        at += scale * s->times[k];
        picture_rectangle(p, x, y, (int)(at + 0.5) - x, 16, part_colour[k], 1);
    }
}

/* A frame's parts and the box levels on one scale, and which colour is which. */
static void draw_times(const show *s, picture *p, int y) {
    char text[64];
    int k;
    gl_write(p, "a frame", 16, y + 2);
    bar(s, p, y, 0, PARTS);
    gl_write(p, "box levels", 16, y + 30);
    bar(s, p, y + 28, BOXES, TIMES);
    snprintf(text, sizeof text, "%.1f ms", 1e3 * frame_time(s));
    gl_write(p, text, WIDTH - 96, y + 2);
    snprintf(text, sizeof text, "%.1f ms", 1e3 * s->times[BOXES]);
    gl_write(p, text, WIDTH - 96, y + 30);
    for (k = 0; k < PARTS; k++) {
        int x = 190 + k * (WIDTH - 300) / PARTS;
        picture_rectangle(p, x, y + 62, 12, 12, part_colour[k], 1);
        snprintf(text, sizeof text, "%s %.1f ms", part_name[k], 1e3 * s->times[k]);
        gl_write(p, text, x + 20, y + 62);
    }
}

static void label(show *s) {
    picture *p = &s->app.shot;
    char text[64];
    int i;
    for (i = 0; i < 2 * COLUMNS; i++) {
        int x = i % COLUMNS * PANE, y = i / COLUMNS * (HEAD + PANE);
        picture_rectangle(p, x, y, PANE, HEAD, 0x15171Cu, 1);
        if (i < COLUMNS) snprintf(text, sizeof text, "GGX chain, roughness %.2f", 0.25 * (i + 1));
        else
            snprintf(text, sizeof text, "box levels, level %.1f of 7",
                     (double)box_level(s, i % COLUMNS + 1));
        gl_write(p, text, x + 16, y + 12);
    }
    picture_rectangle(p, 0, p->height - STRIP, WIDTH, STRIP, 0x15171Cu, 1);
    draw_times(s, p, p->height - STRIP + 22);
}

/* Frames before the one that is kept, at one point a pixel, as a window may draw them: its times
   are theirs. The last one's moment is one when no lamp hides a ball. */
static void warm(show *s) {
    int samples = s->app.samples;
    s->app.samples = 1;
    for (; s->app.frames < WARM; s->app.frames++) {
        s->seconds = 23.4 - 0.1 * (WARM - 1 - s->app.frames);
        frame(s);
        if (s->app.frames >= WARM / 2) s->asked += s->filtered.asked;
    }
    printf("%s, %d threads; of %d frames, the last %d asked for memory %d times\n",
           (const char *)gl.GetString(GL_RENDERER), s->st.threads.threads, WARM, WARM / 2, s->asked);
    s->app.samples = samples;
}

static int prepare(show *s) {
    int k, good = moving_create(&s->lamps, 2.5f) && capture_create(&s->caught);
    s->st.desc.tolerance = 0.01f; /* a hundredth of the picture's contrast, which nobody sees */
    for (k = 0; k < GL_MESH_COUNT; k++) good = good && gl_mesh_make(&s->meshes[k], k);
    s->object = GL_BALL;
    return good && refilter_create(&s->filtered, &s->st.desc);
}

int main(int argc, char **argv) {
    static show s;
    int k;
    if (!gl_open(&s.app, "per_frame", WIDTH, 2 * (HEAD + PANE) + STRIP, argc, argv)) return 1;
    if (!stage_open(&s.st, &s.app, SCENE_SUN, argc, argv) || !prepare(&s)) return 1;
    s.app.distance = 6;
    if (!s.app.window) warm(&s);
    while (gl_frame(&s.app)) {
        if (s.app.key == 'O') s.object = (s.object + 1) % GL_MESH_COUNT;
        if (s.app.window) s.seconds = s.app.seconds;
        frame(&s);
        if (s.app.window) words(&s);
        gl_show(&s.app);
    }
    if (s.app.shot.rgb) label(&s);
    moving_free(&s.lamps);
    capture_free(&s.caught);
    refilter_free(&s.filtered);
    for (k = 0; k < GL_MESH_COUNT; k++) gl_mesh_free(&s.meshes[k]);
    stage_close(&s.st);
    return gl_close(&s.app);
}
