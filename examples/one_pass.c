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

#define _POSIX_C_SOURCE 200809L
#define ENVMAP_STATIC
#define ENVMAP_IMPLEMENTATION
#include "envmap.h"
#include "stage.h"

#define EDGE   128
#define LEVELS 8
#define SMALL  3 /* the level that goes to the CPU */
#define GRID   4
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

/* One face of one level from the level above, which is the only one that the sampler sees: 4 x 4
   texels, tents of their solid angle. Taps past an edge are directions into the next face. */
static const char level_fragment[] =
    "in vec2 st;\n"
    "out vec4 colour;\n"
    "uniform samplerCube above;\n"
    "uniform float edge;\n" /* of the level above */
    "uniform mat3 face;\n"
    "void main() {\n"
    "    vec4 sum = vec4(0.0);\n"
    "    for (int i = 0; i < 16; i++) {\n"
    "        vec2 k = vec2(i % 4, i / 4) - 1.5;\n"
    "        vec2 p = 2.0 * (st + k / edge) - 1.0;\n"
    "        vec2 tent = 2.0 - abs(k);\n"
    "        float w = tent.x * tent.y * pow(1.0 + dot(p, p), -1.5);\n"
    "        sum += w * vec4(textureLod(above, face * vec3(p, 1.0), 0.0).rgb, 1.0);\n"
    "    }\n"
    "    colour = vec4(sum.rgb / sum.a, 1.0);\n"
    "}\n";

static const char one_vertex[] = "in vec3 position, normal, tangent;\n"
                                 "out vec3 at, n, E;\n"
                                 "uniform mat4 model, camera;\n"
                                 "uniform vec4 sh[7];\n"
                                 "void main() {\n"
                                 "    vec4 world = model * vec4(position, 1.0);\n"
                                 "    at = world.xyz;\n"
                                 "    n = mat3(model) * normal;\n"
                                 "    E = max(nine(sh, normalize(n)), 0.0);\n"
                                 "    gl_Position = camera * world;\n"
                                 "}\n";

static const char one_fragment[] =
    "in vec3 at, n, E;\n"
    "out vec4 colour;\n"
    "uniform samplerCube cube;\n"
    "uniform vec3 eye, albedo;\n"
    "uniform float f, b;\n"
    "void main() {\n"
    "    vec3 N = normalize(n), V = normalize(eye - at);\n"
    "    float F = f + (1.0 - f) * pow(1.0 - clamp(dot(N, V), 0.0, 1.0), 5.0);\n"
    "    colour = vec4(mix(albedo * E, texture(cube, reflect(-V, N), b).rgb, F), 1.0);\n"
    "}\n";

typedef struct show {
    gl_app app;
    stage st;
    gl_mesh teapot, ball;
    GLuint sky, balls, level, one; /* programs */
    GLuint cube, frame, depth;
    envmap small;
    float sh[28];
} show;

/* --------------------------------------------------------------------------------- >>capture -- */

/* The axes of a face: S and T along u and v, M to its middle; column-major. */
static void face_axes(float out[9], int face) {
    int i;
    envmap_direction(out + 6, ENVMAP_CUBE, face, 0.5f, 0.5f);
    envmap_direction(out, ENVMAP_CUBE, face, 1, 0.5f);
    envmap_direction(out + 3, ENVMAP_CUBE, face, 0.5f, 1);
    for (i = 0; i < 6; i++) out[i] = 1.41421356f * out[i] - out[6 + i % 3];
}

/* A camera in the middle whose picture is a face, row 0 at t = 0. */
static void face_camera(float out[16], const float axes[9]) {
    const float front = 0.1f, back = 50;
    int i;
    memset(out, 0, 16 * sizeof(float));
    for (i = 0; i < 3; i++) {
        out[4 * i] = axes[i], out[4 * i + 1] = axes[3 + i];
        out[4 * i + 2] = axes[6 + i] * (back + front) / (back - front);
        out[4 * i + 3] = axes[6 + i];
    }
    out[14] = -2 * front * back / (back - front);
}

static void bind_face(show *s, int face, int level) {
    gl.BindFramebuffer(GL_FRAMEBUFFER, s->frame);
    gl.FramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0,
                            GL_TEXTURE_CUBE_MAP_POSITIVE_X + (GLenum)face, s->cube, level);
    gl.FramebufferRenderbuffer(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER,
                               level ? 0 : s->depth);
    gl.Viewport(0, 0, EDGE >> level, EDGE >> level);
}

/* The three balls, at their places of this moment. */
static void draw_balls(show *s, const float camera[16]) {
    static const float colours[3][3] = {
        {0.7f, 0.04f, 0.02f}, {0.03f, 0.1f, 0.6f}, {0.7f, 0.35f, 0.02f}};
    int k;
    gl.UseProgram(s->balls);
    gl_mat4(s->balls, "camera", camera);
    gl_vec4s(s->balls, "sh", s->st.sh, 7);
    for (k = 0; k < 3; k++) {
        float a = (float)s->app.seconds * (0.5f + 0.1f * (float)k) + 2.1f * (float)k - 0.9f;
        float model[16] = {0.4f, 0, 0, 0, 0, 0.4f, 0, 0, 0, 0, 0.4f, 0, 0, 0, 0, 1};
        model[12] = 2.4f * sinf(a), model[13] = 0.7f * sinf(1.3f * a) + 0.3f;
        model[14] = 2.4f * cosf(a);
        gl_vec3(s->balls, "albedo", colours[k]);
        gl_mat4(s->balls, "model", model);
        gl_mesh_draw(&s->ball);
    }
}

static void capture(show *s) {
    float axes[9], camera[16];
    int face;
    for (face = 0; face < 6; face++) {
        bind_face(s, face, 0);
        gl.Clear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
        face_axes(axes, face);
        face_camera(camera, axes);
        draw_balls(s, camera);
        gl.UseProgram(s->sky);
        gl_sampler(s->sky, "sky", 0, GL_TEXTURE_CUBE_MAP, s->st.sky);
        gl_mat3(s->sky, "face", axes);
        gl.BindVertexArray(s->app.array);
        gl.DrawArrays(GL_TRIANGLES, 0, 3);
    }
}

static void make_levels(show *s) {
    float axes[9];
    int face, l;
    gl.Disable(GL_DEPTH_TEST);
    gl.UseProgram(s->level);
    gl.BindVertexArray(s->app.array);
    gl_sampler(s->level, "above", 0, GL_TEXTURE_CUBE_MAP, s->cube);
    for (l = 1; l < LEVELS; l++) {
        gl.TexParameteri(GL_TEXTURE_CUBE_MAP, GL_TEXTURE_BASE_LEVEL, l - 1);
        gl.TexParameteri(GL_TEXTURE_CUBE_MAP, GL_TEXTURE_MAX_LEVEL, l - 1);
        gl_float(s->level, "edge", (float)(EDGE >> (l - 1)));
        for (face = 0; face < 6; face++) {
            bind_face(s, face, l);
            face_axes(axes, face);
            gl_mat3(s->level, "face", axes);
            gl.DrawArrays(GL_TRIANGLES, 0, 3);
        }
    }
    gl.TexParameteri(GL_TEXTURE_CUBE_MAP, GL_TEXTURE_BASE_LEVEL, 0);
    gl.TexParameteri(GL_TEXTURE_CUBE_MAP, GL_TEXTURE_MAX_LEVEL, LEVELS - 1);
    gl.Enable(GL_DEPTH_TEST);
}

/* The nine coefficients of a small level, on the CPU. */
static envmap_result project(show *s) {
    envmap_lobe diffuse = envmap_lobe_diffuse();
    envmap_result result;
    double sh[27];
    int face;
    for (face = 0; face < 6; face++) {
        bind_face(s, face, SMALL);
        gl.ReadPixels(0, 0, s->small.size, s->small.size, GL_RGB, GL_FLOAT,
                      envmap_texel(&s->small, 0, 0, face, 0, 0));
    }
    result = envmap_sh_project(sh, 3, &s->small, 0, 0, NULL);
    if (!result) result = envmap_sh_convolve(sh, sh, 3, &diffuse, 0);
    return result ? result : envmap_sh_pack(NULL, s->sh, sh);
}

/* ------------------------------------------------------------------------------------ >>draw -- */

static void draw(show *s, float f, float b) {
    static const float albedo[3] = {0.025f, 0.13f, 0.11f};
    float model[16];
    mesh_identity(model);
    gl.UseProgram(s->one);
    gl_sampler(s->one, "cube", 0, GL_TEXTURE_CUBE_MAP, s->cube);
    gl_mat4(s->one, "model", model);
    gl_mat4(s->one, "camera", s->app.camera);
    gl_vec3(s->one, "eye", s->app.eye);
    gl_vec3(s->one, "albedo", albedo);
    gl_vec4s(s->one, "sh", s->sh, 7);
    gl_float(s->one, "f", f);
    /* more points a pixel make the card choose sharper levels; b is meant for one */
    gl_float(s->one, "b", b + log2f((float)s->app.samples));
    gl_mesh_draw(&s->teapot);
    if (s->app.window) draw_balls(s, s->app.camera);
    stage_sky(&s->st, &s->app, 3);
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
    int f, l;
    s->sky = gl_program(gl_cover, sky_fragment);
    s->balls = gl_program(gl_vertex, ball_fragment);
    s->level = gl_program(gl_cover, level_fragment);
    s->one = gl_program(one_vertex, one_fragment);
    s->cube = gl_texture(GL_TEXTURE_CUBE_MAP, LEVELS);
    for (l = 0; l < LEVELS; l++)
        for (f = 0; f < 6; f++)
            gl.TexImage2D(GL_TEXTURE_CUBE_MAP_POSITIVE_X + (GLenum)f, l, GL_RGBA32F, EDGE >> l,
                          EDGE >> l, 0, GL_RGBA, GL_FLOAT, NULL);
    gl.GenFramebuffers(1, &s->frame);
    gl.GenRenderbuffers(1, &s->depth);
    gl.BindRenderbuffer(GL_RENDERBUFFER, s->depth);
    gl.RenderbufferStorage(GL_RENDERBUFFER, GL_DEPTH_COMPONENT24, EDGE, EDGE);
    return s->sky && s->balls && s->level && s->one && gl_mesh_make(&s->teapot, GL_TEAPOT) &&
           gl_mesh_make(&s->ball, GL_BALL) &&
           stage_say(envmap_create(&s->small, ENVMAP_CUBE, EDGE >> SMALL, 1, 1));
}

int main(int argc, char **argv) {
    static show s;
    int f = 1, b = 0;
    if (!gl_open(&s.app, "one_pass", 1280, 880, argc, argv)) return 1;
    if (!stage_open(&s.st, &s.app, SCENE_SUN, argc, argv) || !prepare(&s)) return 1;
    if (s.app.window) s.app.distance = 9;
    while (gl_frame(&s.app)) {
        if (s.app.key == 'F') f = (f + 1) % GRID;
        if (s.app.key == 'B') b = (b + 1) % GRID;
        capture(&s);
        make_levels(&s);
        stage_say(project(&s));
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
    envmap_free(&s.small);
    gl_mesh_free(&s.teapot);
    gl_mesh_free(&s.ball);
    gl.DeleteFramebuffers(1, &s.frame);
    gl.DeleteRenderbuffers(1, &s.depth);
    gl.DeleteTextures(1, &s.cube);
    gl.DeleteProgram(s.sky);
    gl.DeleteProgram(s.balls);
    gl.DeleteProgram(s.level);
    gl.DeleteProgram(s.one);
    stage_close(&s.st);
    return gl_close(&s.app);
}
