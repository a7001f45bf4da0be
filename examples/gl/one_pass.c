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

#define GRID 4
static const float schlick[GRID] = {0.03f, 0.09f, 0.26f, 0.42f}, bias[GRID] = {0, 0.8f, 1.7f, 2.4f};

static const char sky_fragment[] = "in vec2 st;\n"
                                   "out vec4 colour;\n"
                                   "uniform samplerCube sky;\n"
                                   "uniform mat3 face;\n" /* columns S, T, M */
                                   "void main() {\n"
                                   "    vec3 d = face * vec3(2.0 * st - 1.0, 1.0);\n"
                                   "    colour = vec4(textureLod(sky, d, 0.0).rgb, 1.0);\n"
                                   "}\n";

static const char ball_fragment[] =
    "in vec3 at, n, t;\n"
    "out vec4 colour;\n"
    "uniform vec4 sh[7];\n"
    "uniform vec3 albedo;\n"
    "void main() { colour = vec4(albedo * max(nine(sh, normalize(n)), 0.0), 1.0); }\n";

typedef struct show {
    gl_app app;
    stage st;
    gl_mesh teapot, ball;
    GLuint sky, balls; /* programs */
    capture caught;
} show;

/* --------------------------------------------------------------------------------- >>capture -- */

/* The three balls, at their places of this moment. */
static void draw_balls(show *s, const float camera[16]) {
    static const float colours[3][3] = {
        {0.7f, 0.04f, 0.02f}, {0.03f, 0.1f, 0.6f}, {0.7f, 0.35f, 0.02f}};
    int k;
    gl.UseProgram(s->balls);
    gl_mat4(s->balls, "camera", camera);
    gl_vec4s(s->balls, "sh", s->st.sh, 7);
    for (k = 0; k < 3; k++) {
        float a = (float)s->app.seconds * (0.5f + 0.1f * (float)k) + 2.1f * (float)k - 0.75f;
        float model[16] = {0.35f, 0, 0, 0, 0, 0.35f, 0, 0, 0, 0, 0.35f, 0, 0, 0, 0, 1};
        model[12] = 2.15f * sinf(a), model[13] = 0.5f * sinf(1.3f * a) + 0.35f;
        model[14] = 2.15f * cosf(a);
        gl_vec3(s->balls, "albedo", colours[k]);
        gl_mat4(s->balls, "model", model);
        gl_mesh_draw(&s->ball);
    }
}

/* Environment and balls into the six faces, and all that follows from them. */
static void catch_light(show *s) {
    float axes[9], camera[16];
    int face;
    for (face = 0; face < 6; face++) {
        capture_face(&s->caught, face, 0);
        gl.Clear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
        capture_axes(axes, face);
        capture_camera(camera, axes);
        draw_balls(s, camera);
        gl.UseProgram(s->sky);
        gl_sampler(s->sky, "sky", 0, GL_TEXTURE_CUBE_MAP, s->st.sky);
        gl_mat3(s->sky, "face", axes);
        gl.BindVertexArray(s->app.array);
        gl.DrawArrays(GL_TRIANGLES, 0, 3);
    }
    capture_levels(&s->caught);
    stage_say(capture_project(&s->caught));
}

/* ------------------------------------------------------------------------------------ >>draw -- */

static void draw(show *s, float f, float b) {
    capture_look look = {0, 0, {0.025f, 0.13f, 0.11f}};
    float model[16];
    mesh_identity(model);
    look.f = f, look.b = b;
    capture_draw(&s->caught, &s->app, &s->teapot, model, &look);
    draw_balls(s, s->app.camera);
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

static int prepare(show *s) {
    s->sky = gl_program(gl_cover, sky_fragment);
    s->balls = gl_program(gl_vertex, ball_fragment);
    return s->sky && s->balls && capture_create(&s->caught) &&
           gl_mesh_make(&s->teapot, GL_TEAPOT) && gl_mesh_make(&s->ball, GL_BALL);
}

int main(int argc, char **argv) {
    static show s;
    int f = 1, b = 0;
    if (!gl_open(&s.app, "one_pass", 1280, 880, argc, argv)) return 1;
    if (!stage_open(&s.st, &s.app, SCENE_SUN, argc, argv) || !prepare(&s)) return 1;
    s.app.distance = 6.3f;
    while (gl_frame(&s.app)) {
        if (s.app.key == 'F') f = (f + 1) % GRID;
        if (s.app.key == 'B') b = (b + 1) % GRID;
        catch_light(&s);
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
    gl_mesh_free(&s.ball);
    gl.DeleteProgram(s.sky);
    gl.DeleteProgram(s.balls);
    stage_close(&s.st);
    return gl_close(&s.app);
}
