/* hardware_filter.c - an environment that moves, filtered anew in every frame on the graphics card:
   two convolutions of a dual-paraboloid map with at most 7 x 7 taps, blended by d^2.

   What you will see: a torus in a studio through which three coloured lamps travel. Headless: the
   exponents 10, 50, 100 and 500, above with the map S of the small radius alone (which is too sharp
   at the rim of the map), below with both, and how far they are apart; and a table of what filtering
   costs, and how many frames that leaves in a second. In a window: N for the next exponent, 1 and 2 for the number of maps;
   drag to orbit.

   usage: hardware_filter [--headless out.png] [overcast | studio | sun | sky.pfm]

   SPDX-License-Identifier: MIT */

#include "stage.h"
#include "../methods/paraboloid_convolution.h"
#include "gl_filter.h"

#define EDGE      256
#define EXPONENTS 4
static const float exponents[EXPONENTS] = {10, 50, 100, 500};

#define LAMPS                                                                                      \
    "uniform samplerCube sky;\n"                                                                   \
    "uniform float time;\n"                                                                        \
    "vec3 radiance(vec3 d, float level) {\n"                                                       \
    "    vec3 sum = textureLod(sky, d, level).rgb;\n"                                              \
    "    for (int i = 0; i < 3; i++) {\n"                                                          \
    "        float a = time * (0.7 + 0.2 * float(i)) + 2.1 * float(i);\n"                          \
    "        vec3 l = normalize(vec3(sin(a), 0.2 + 0.45 * cos(0.8 * a + float(i)), cos(a)));\n"    \
    "        vec3 colour = i == 0 ? vec3(30, 5, 2) : i == 1 ? vec3(2, 9, 30) : vec3(8, 24, 3);\n"  \
    "        sum = mix(sum, colour, smoothstep(0.985, 0.99, dot(d, l)));\n"                        \
    "    }\n"                                                                                      \
    "    return sum;\n"                                                                            \
    "}\n"

/* Into one face of the paraboloid map, its square and all. */
static const char capture_fragment[] =
    "in vec2 st;\n"
    "out vec4 colour;\n"
    "uniform int face;\n" LAMPS "void main() {\n"
    "    vec2 p = vec2(2.0 * st.x - 1.0, 1.0 - 2.0 * st.y);\n"
    "    float s = 1.0 + dot(p, p), z = (2.0 - s) / s;\n"
    "    colour = vec4(radiance(vec3(2.0 * p / s, face == 0 ? z : -z), 0.0), 1.0);\n"
    "}\n";

static const char behind_fragment[] =
    "in vec2 st;\n"
    "out vec4 colour;\n"
    "uniform vec3 lens;\n"
    "uniform mat4 view;\n" LAMPS "void main() {\n"
    "    vec3 d = vec3((2.0 * st - 1.0) * lens.xy, -1.0) * mat3(view);\n"
    "    colour = vec4(radiance(normalize(d), 2.5), 0.0);\n"
    "}\n";

static const char torus_fragment[] =
    "in vec3 at, n, t;\n"
    "out vec4 colour;\n"
    "uniform vec3 eye;\n" GL_FILTER_GLSL "void main() {\n"
    "    colour = vec4(two_maps(reflect(normalize(at - eye), normalize(n))), 1.0);\n"
    "}\n";

typedef struct show {
    gl_app app;
    stage st;
    gl_filter filter;
    gl_mesh torus;
    GLuint capture, behind, dress;
} show;

/* The two faces of the environment as it is now. */
static void capture(show *s) {
    int face;
    gl.UseProgram(s->capture);
    gl_sampler(s->capture, "sky", 0, GL_TEXTURE_CUBE_MAP, s->st.sky);
    gl_float(s->capture, "time", (float)s->app.seconds + 0.9f);
    gl.Disable(GL_DEPTH_TEST);
    gl.BindVertexArray(s->app.array);
    for (face = 0; face < 2; face++) {
        gl_filter_face(&s->filter, s->filter.source, face, EDGE);
        gl_int(s->capture, "face", face);
        gl.DrawArrays(GL_TRIANGLES, 0, 3);
    }
    gl.Enable(GL_DEPTH_TEST);
}

static void filter(show *s, float exponent, int maps) {
    envmap_lobe lobe = envmap_lobe_phong(exponent);
    capture(s);
    gl_filter_run(&s->filter, &lobe, maps);
}

/* Torus and background into the cell that is set. */
static void draw(show *s) {
    float model[16], lens[3];
    mesh_turn(model, 0, 1.0f);
    lens[0] = s->app.tangent * s->app.aspect, lens[1] = s->app.tangent, lens[2] = 0;
    gl.UseProgram(s->dress);
    gl_mat4(s->dress, "model", model);
    gl_mat4(s->dress, "camera", s->app.camera);
    gl_vec3(s->dress, "eye", s->app.eye);
    gl_filter_bind(&s->filter, s->dress);
    gl_mesh_draw(&s->torus);
    gl.UseProgram(s->behind);
    gl_sampler(s->behind, "sky", 0, GL_TEXTURE_CUBE_MAP, s->st.sky);
    gl_float(s->behind, "time", (float)s->app.seconds + 0.9f);
    gl_mat4(s->behind, "view", s->app.view);
    gl_vec3(s->behind, "lens", lens);
    gl.DepthFunc(GL_LEQUAL);
    gl.BindVertexArray(s->app.array);
    gl.DrawArrays(GL_TRIANGLES, 0, 3);
    gl.DepthFunc(GL_LESS);
}

static void draw_cell(show *s, int column, int row, int columns, int rows, float exponent,
                      int maps) {
    filter(s, exponent, maps);
    gl.BindFramebuffer(GL_FRAMEBUFFER, s->app.frame.frame);
    gl_cell(&s->app, column, row, columns, rows);
    draw(s);
}

/* The best of five, capture included; with the torus drawn, or without. */
static double seconds_of(show *s, float exponent, int maps, int drawn) {
    double best = 1e9;
    int k;
    for (k = 0; k < 5; k++) {
        double start = gl_seconds();
        filter(s, exponent, maps);
        gl.BindFramebuffer(GL_FRAMEBUFFER, s->app.frame.frame);
        gl.Viewport(0, 0, 512, 512);
        if (drawn) draw(s);
        gl.Finish();
        best = fmin(best, gl_seconds() - start);
    }
    return best;
}

static void table(show *s) {
    int k, maps;
    printf("%s, paraboloids of 2 x %d x %d, a picture of 512 x 512\n",
           (const char *)gl.GetString(GL_RENDERER), EDGE, EDGE);
    printf("     N  maps  taps  filtered in ms  frames per second\n");
    gl_orbit(&s->app);
    for (k = 0; k < EXPONENTS; k++)
        for (maps = 1; maps <= 2; maps++) {
            double t = seconds_of(s, exponents[k], maps, 0);
            printf("%6.0f  %4d  %dx%d  %14.2f  %17.1f\n", (double)exponents[k], maps,
                   s->filter.taps[maps - 1], s->filter.taps[maps - 1], 1e3 * t,
                   1 / seconds_of(s, exponents[k], maps, 1));
        }
}

/* The lowest third: four times what the two above are apart. */
static void draw_difference(picture *p) {
    size_t third = 3 * (size_t)p->width * (size_t)(p->height / 3), i;
    for (i = 0; i < third; i++) {
        int apart = 4 * abs((int)p->rgb[i] - (int)p->rgb[third + i]);
        p->rgb[2 * third + i] = (unsigned char)(apart < 255 ? apart : 255);
    }
}

static void label(show *s) {
    static const char *const what[3] = {"one map", "two maps", "4 x apart"};
    picture *p = &s->app.shot;
    int k;
    draw_difference(p);
    for (k = 0; k < 3 * EXPONENTS; k++) {
        char text[64];
        snprintf(text, sizeof text, "N = %.0f, %s", (double)exponents[k % EXPONENTS],
                 what[k / EXPONENTS]);
        gl_write(p, text, k % EXPONENTS * p->width / EXPONENTS + 16,
                 (k / EXPONENTS + 1) * p->height / 3 - 30);
    }
}

int main(int argc, char **argv) {
    static show s;
    int k = 2, maps = 2, row;
    if (!gl_open(&s.app, "hardware_filter", 1280, 960, argc, argv)) return 1;
    if (!stage_open(&s.st, &s.app, SCENE_STUDIO, argc, argv)) return 1;
    s.capture = gl_program(gl_cover, capture_fragment);
    s.behind = gl_program(gl_cover, behind_fragment);
    s.dress = gl_program(gl_vertex, torus_fragment);
    if (!s.capture || !s.behind || !s.dress || !gl_filter_create(&s.filter, EDGE) ||
        !gl_mesh_make(&s.torus, GL_TORUS))
        return 1;
    s.app.exposure *= 0.55f, s.app.distance = 5.2f; /* for the lamps; whole in a square cell, */
    s.app.at[1] = -0.15f;                           /* with its caption below it */
    if (!s.app.window) table(&s);
    while (gl_frame(&s.app)) {
        if (s.app.key == 'N') k = (k + 1) % EXPONENTS;
        if (s.app.key == '1' || s.app.key == '2') maps = s.app.key - '0';
        if (s.app.window) {
            draw_cell(&s, 0, 0, 1, 1, exponents[k], maps);
            snprintf(s.app.caption, sizeof s.app.caption, "N = %.0f\n%d map%s",
                     (double)exponents[k], maps, maps == 1 ? "" : "s");
            if (s.app.frames % 20 == 19) printf("%.1f frames a second\n", 1 / s.app.took);
        } else {
            for (row = 0; row < 2; row++)
                for (k = 0; k < EXPONENTS; k++)
                    draw_cell(&s, k, row, EXPONENTS, 3, exponents[k], row + 1);
        }
        gl_show(&s.app);
    }
    if (s.app.shot.rgb) label(&s);
    gl_filter_free(&s.filter);
    gl_mesh_free(&s.torus);
    gl.DeleteProgram(s.capture);
    gl.DeleteProgram(s.behind);
    gl.DeleteProgram(s.dress);
    stage_close(&s.st);
    return gl_close(&s.app);
}
