/* SPDX-License-Identifier: MIT
   The meshes of examples/gl/mesh.h, and what a graphics card makes of the maps: every path of the
   examples' shaders against envmap_lookup at the same normals, eyes and tangents, which the card
   writes out too. Without EGL at compile time, or without a driver, the meshes alone are tested. */
#define _POSIX_C_SOURCE 200809L
#include "oracle.h"
#include "examples/tool/scenes.h"
#include "examples/gl/mesh.h"
#include "examples/methods/paraboloid_convolution.h"
#ifdef TEST_GL
#include "examples/gl/gl.h"
#include "examples/gl/surface.h"
#include "examples/gl/gl_filter.h"
#include "examples/gl/capture.h"
#include "examples/tool/shader.h"
#include "examples/tool/brdfs.h"
#include "examples/methods/nonphotorealistic.h"
#endif

/* ---------------------------------------------------------------------------------- meshes -- */

static double mesh_volume(const mesh *m) {
    double sum = 0;
    for (int i = 0; i < m->index_count; i += 3) {
        const float *a = m->vertices + MESH_FLOATS * m->indices[i];
        const float *b = m->vertices + MESH_FLOATS * m->indices[i + 1];
        const float *c = m->vertices + MESH_FLOATS * m->indices[i + 2];
        float normal[3];
        mesh_cross(normal, b, c);
        sum += (double)mesh_dot(a, normal) / 6;
    }
    return sum;
}

/* The least cosine between a triangle (if it has an area) and the normals at its corners. */
static double mesh_least_cosine(const mesh *m) {
    double least = 1;
    for (int i = 0; i < m->index_count; i += 3) {
        const float *p[3];
        float ab[3], ac[3], normal[3];
        for (int k = 0; k < 3; ++k) p[k] = m->vertices + MESH_FLOATS * m->indices[i + k];
        for (int k = 0; k < 3; ++k) ab[k] = p[1][k] - p[0][k], ac[k] = p[2][k] - p[0][k];
        mesh_cross(normal, ab, ac);
        if (mesh_dot(normal, normal) < 1e-12f) continue;
        mesh_unit(normal);
        for (int k = 0; k < 3; ++k) least = fmin(least, (double)mesh_dot(normal, p[k] + 3));
    }
    return least;
}

static void meshes_enclose_what_balls_and_rings_do(void) {
    mesh ball = {0}, torus = {0}, teapot = {0};
    CHECK(mesh_ball(&ball, 96) && mesh_torus(&torus, 96, 0.4f) && mesh_teapot(&teapot, 12));
    FIGURE("volume of the ball: relative error", fabs(mesh_volume(&ball) / (4 * PI / 3) - 1),
           1.5e-3);
    FIGURE("volume of the torus: relative error",
           fabs(mesh_volume(&torus) / (2 * PI * PI * 0.16) - 1), 1.5e-3);
    /* Half its size is an eighth of the volume; the body's discs alone are pi int r^2 dz = 24.6. */
    FIGURE("volume of the teapot's body, and its lid, spout, handle: of 3.1",
           fabs(mesh_volume(&teapot) / 3.1 - 1), 0.2);
    mesh_free(&ball);
    mesh_free(&torus);
    mesh_free(&teapot);
}

static void meshes_show_their_outside(void) {
    mesh m[3] = {{0}};
    CHECK(mesh_ball(m, 24) && mesh_torus(m + 1, 24, 0.4f) && mesh_teapot(m + 2, 12));
    for (int k = 0; k < 3; ++k) {
        CHECK(mesh_least_cosine(&m[k]) > (k < 2 ? 0.9 : 0.3));
        for (int i = 0; i < m[k].vertex_count; ++i) {
            const float *v = m[k].vertices + MESH_FLOATS * i;
            CHECK_CLOSE(mesh_dot(v + 3, v + 3), 1, 1e-5);
            CHECK_CLOSE(mesh_dot(v + 6, v + 6), 1, 1e-5);
            CHECK_CLOSE(mesh_dot(v + 3, v + 6), 0, 1e-4);
        }
        mesh_free(&m[k]);
    }
}

static void a_camera_sees_what_it_looks_at_in_the_middle(void) {
    float eye[3] = {3, 2, 5}, at[3] = {1, 0, -1}, view[16], projection[16], camera[16], out[4];
    mesh_look(view, eye, at);
    mesh_perspective(projection, 0.3f, 1.5f, 0.1f, 100);
    mesh_multiply(camera, projection, view);
    for (int i = 0; i < 4; ++i)
        out[i] = camera[i] * at[0] + camera[4 + i] * at[1] + camera[8 + i] * at[2] + camera[12 + i];
    CHECK_CLOSE(out[0], 0, 1e-5);
    CHECK_CLOSE(out[1], 0, 1e-5);
    CHECK_CLOSE(out[3], sqrt(4 + 4 + 36), 1e-5); /* w: the distance */
}

#ifdef TEST_GL
/* ---------------------------------------------------------------------------------- shaders -- */

#define EDGE 128

static gl_app app;
static GLuint program;
static gl_mesh meshes[GL_MESH_COUNT];

static float model[16];

/* One frame of a surface: RGBA, alpha 1 where the object is. */
static float *shoot(surface s, int show, const gl_mesh *m) {
    s.show = show;
    gl_target_bind(&app.frame);
    surface_draw(program, &app, &s, m, model);
    return gl_target_read(&app.frame);
}

/* Normals, eyes and tangents of each mesh, as the card has them. */
static float *frames[GL_MESH_COUNT][3];

static void shoot_frames(void) {
    for (int m = 0; m < GL_MESH_COUNT; ++m)
        for (int k = 0; k < 3; ++k)
            frames[m][k] = shoot(surface_default(), SURFACE_SHOW_NORMAL + k, &meshes[m]);
}

static double fresnel(double c, double index) {
    double g = sqrt(index * index - 1 + c * c);
    double a = (g - c) / (g + c), b = (c * (g + c) - 1) / (c * (g - c) + 1);
    return 0.5 * a * a * (1 + b * b);
}

static void turned(float out[3], const float turn[9], const float d[3]) {
    for (int i = 0; i < 3; ++i) out[i] = turn[i] * d[0] + turn[3 + i] * d[1] + turn[6 + i] * d[2];
}

/* What the other axes look up; in the frame of the map. */
typedef struct looked {
    const envmap *map;
    const envmap_fit *fit;
} looked;

/* Where n stands in the viewer's frame, up on the screen being up: a reflection in z of the sphere
   map's own frame. */
static void drawn(float d[3], const float n[3], const float v[3]) {
    float up[3] = {app.view[1], app.view[5], app.view[9]}, x[3], y[3], local[3];
    mesh_cross(x, up, v);
    mesh_unit(x);
    mesh_cross(y, v, x);
    local[0] = mesh_dot(n, x), local[1] = mesh_dot(n, y), local[2] = fmaxf(mesh_dot(n, v), 1e-4f);
    mesh_unit(local);
    for (int i = 0; i < 3; ++i) d[i] = 2 * local[2] * local[i] - (i == 2);
}

static void gloss(float L[3], const surface *s, looked in, const float n[3], const float v[3],
                  const float t[3]) {
    float axis[3], r[3], turned_n[3], turned_v[3], across[3], turned_across[3], c = mesh_dot(n, v);
    float offsets[SURFACE_TAPS], weights[SURFACE_TAPS];
    for (int i = 0; i < 3; ++i) r[i] = 2 * c * n[i] - v[i];
    turned(axis, s->turn, s->axis == SURFACE_TANGENT ? t : r);
    mesh_cross(across, n, t);
    turned(turned_n, s->turn, n), turned(turned_v, s->turn, v);
    turned(turned_across, s->turn, across);
    for (int i = 0; i < s->taps; ++i) offsets[i] = s->fan[i][0], weights[i] = s->fan[i][1];
    if (s->axis == SURFACE_FAN)
        envmap_lookup_fan(L, in.map, turned_n, turned_across, turned_v, offsets, weights, s->taps);
    else if (s->axis == SURFACE_VIEW && in.fit)
        envmap_fit_lookup(L, in.fit, in.map, turned_n, turned_v);
    else if (s->axis == SURFACE_DRAWN)
        drawn(axis, n, v), envmap_lookup(L, in.map, axis, s->level);
    else
        envmap_lookup_slice(L, in.map, axis, s->axis == SURFACE_TANGENT ? mesh_dot(v, t) : c,
                            s->level);
}

/* What surface.h promises, by the library's own calls. */
static void shade(double rgb[3], const surface *s, looked in, const double *sh, const float n[3],
                  const float v[3], const float t[3]) {
    float normal[3], L[3] = {0, 0, 0}, c = mesh_dot(n, v);
    double E[3] = {0, 0, 0}, F = s->index > 0 ? fresnel(fmax((double)c, 0), (double)s->index) : 1;
    double w = s->diffuse == SURFACE_NO_DIFFUSE     ? 0
               : s->diffuse == SURFACE_PLUS_DIFFUSE ? 1
                                                    : 1 - F;
    turned(normal, s->turn, n);
    if (in.map) gloss(L, s, in, n, v, t);
    double wide[3] = {(double)normal[0], (double)normal[1], (double)normal[2]};
    if (w > 0) envmap_sh_evaluate(E, sh, 3, wide);
    for (int i = 0; i < 3; ++i)
        rgb[i] = F * (double)s->tint[i] * (double)L[i] + w * (double)s->albedo[i] * fmax(0, E[i]);
}

/* sum |gpu - cpu| / sum |cpu| over the object's pixels, on the mesh where that is most. */
static double worst_error(const surface *s, looked in, const double *sh) {
    double worst = 0;
    for (int m = 0; m < GL_MESH_COUNT; ++m) {
        float *shown = shoot(*s, SURFACE_SHOW_COLOUR, &meshes[m]);
        double miss = 0, all = 0;
        int pixels = 0;
        for (int i = 0; i < 4 * EDGE * EDGE; i += 4) {
            double rgb[3];
            if (!(shown[i + 3] > 0.5f)) continue;
            shade(rgb, s, in, sh, frames[m][0] + i, frames[m][1] + i, frames[m][2] + i);
            for (int c = 0; c < 3; ++c) {
                miss += fabs((double)shown[i + c] - rgb[c]);
                all += fabs(rgb[c]);
            }
            ++pixels;
        }
        free(shown);
        CHECK(pixels > EDGE * EDGE / 10 && all > 0);
        if (!(miss / all <= worst)) worst = miss / all; /* NaN too */
    }
    return worst;
}

static double worst_of_meshes(const surface *s, const envmap *map, const double *sh) {
    looked in = {map, NULL};
    return worst_error(s, in, sh);
}

static envmap environment;

static surface dressed(int lookup) {
    surface s = surface_default();
    float turn[16];
    mesh_turn(turn, 1, 0.7f);
    for (int i = 0; i < 9; ++i) s.turn[i] = turn[4 * (i / 3) + i % 3];
    s.lookup = lookup;
    return s;
}

static void every_lookup_is_the_library_s(void) {
    static const char *const names[SURFACE_LOOKUPS] = {"cube", "paraboloids, one pass",
                                                       "paraboloids, two passes", "sphere map"};
    for (int k = 0; k < SURFACE_LOOKUPS; ++k)
        for (int glossy = 0; glossy < 2; ++glossy) {
            envmap map = {0};
            surface s = dressed(k);
            envmap_lobe lobe = glossy ? envmap_lobe_phong(100) : envmap_lobe_mirror();
            char what[80];
            CHECK(!envmap_create(&map, surface_mapping[k], k == SURFACE_SPHERE ? 256 : 128, 1, 1));
            CHECK(!envmap_filter(&map, &environment, &lobe, NULL));
            s.map = gl_map(&map);
            snprintf(what, sizeof what, "%s, %s: mean error", names[k],
                     glossy ? "Phong 100" : "mirror");
            FIGURE(what, worst_of_meshes(&s, &map, NULL), 0.01);
            gl.DeleteTextures(1, &s.map);
            envmap_free(&map);
        }
}

static void a_chain_s_levels_are_the_library_s(void) {
    for (int k = 0; k < SURFACE_LOOKUPS; k += 3) {
        envmap map = {0};
        surface s = dressed(k);
        envmap_lobe lobes[5];
        for (int i = 0; i < 5; ++i) lobes[i] = envmap_lobe_ggx(0.15f + 0.2f * (float)i);
        CHECK(!envmap_create(&map, surface_mapping[k], 32, 5, 1));
        CHECK(!envmap_filter_chain(&map, &environment, lobes, 5, NULL));
        s.map = gl_map(&map), s.level = 2.4f;
        FIGURE(k ? "GGX chain between levels, sphere map: mean error"
                 : "GGX chain between levels, cube: mean error",
               worst_of_meshes(&s, &map, NULL), 0.01);
        gl.DeleteTextures(1, &s.map);
        envmap_free(&map);
    }
}

static void coats_are_fresnel_s_over_nine_coefficients(void) {
    static const float indices[3] = {1.5f, 5, 200};
    envmap map = {0};
    surface s = dressed(SURFACE_CUBE);
    double sh[27], worst[3] = {0, 0, 0};
    envmap_lobe diffuse = envmap_lobe_diffuse(), mirror = envmap_lobe_mirror();
    CHECK(!envmap_sh_project(sh, 3, &environment, 0, 0, NULL));
    CHECK(!envmap_sh_convolve(sh, sh, 3, &diffuse, 0) && !envmap_sh_pack(NULL, s.sh, sh));
    CHECK(!envmap_create(&map, ENVMAP_CUBE, 128, 1, 1));
    CHECK(!envmap_filter(&map, &environment, &mirror, NULL));
    s.map = gl_map(&map), s.albedo[1] = 0.3f, s.albedo[2] = 0.1f;
    for (int i = 0; i < 3; ++i)
        for (int k = 0; k < 3; ++k) {
            s.index = indices[i], s.diffuse = k;
            worst[k] = fmax(worst[k], worst_of_meshes(&s, &map, sh));
        }
    FIGURE("Fresnel, mirror only: mean error", worst[0], 0.01);
    FIGURE("Fresnel, plus diffuse: mean error", worst[1], 0.01);
    FIGURE("Fresnel, blended: mean error", worst[2], 0.01);
    s.tint[0] = s.tint[1] = s.tint[2] = 0, s.diffuse = SURFACE_PLUS_DIFFUSE;
    FIGURE("diffuse alone: mean error", worst_of_meshes(&s, &map, sh), 0.01);
    gl.DeleteTextures(1, &s.map);
    envmap_free(&map);
}

static double narrowing(double x, double p, void *user) {
    (void)user;
    return exp(20 * (0.3 + 3 * (1 - p) * (1 - p)) * (x - 1));
}

static void slices_are_the_library_s(void) {
    for (int axis = SURFACE_TANGENT; axis <= SURFACE_VIEW; ++axis) {
        envmap map = {0};
        surface s = dressed(SURFACE_CUBE);
        envmap_lobe lobe = axis == SURFACE_TANGENT ? envmap_lobe_banks(0.95f)
                                                   : envmap_lobe_function(narrowing, NULL);
        envmap_filter_desc desc = {0};
        if (axis == SURFACE_VIEW) lobe.p0 = 0, lobe.p1 = 1;
        desc.tolerance = 0.01f;
        CHECK(!envmap_create(&map, ENVMAP_PARABOLOID, 32, 1, 16));
        CHECK(!envmap_filter(&map, &environment, &lobe, &desc));
        s.axis = axis;
        for (int f = 0; f < 2; ++f) s.slices[f] = gl_volume(&map, f);
        FIGURE(axis == SURFACE_TANGENT ? "Banks by 3D textures: mean error"
                                       : "slices by n.v: mean error",
               worst_of_meshes(&s, &map, NULL), 0.01);
        gl.DeleteTextures(2, s.slices);
        envmap_free(&map);
    }
}

static void fits_are_the_library_s(void) {
    envmap map = {0};
    envmap_fit fit = {1, 16, 257, 0, NULL, NULL, NULL, NULL, NULL};
    brdf_values values = {{0.95, 0.64, 0.54}, 0.3, 0.3, 0, 0, 1};
    envmap_brdf brdf = {brdf_ggx, &values};
    envmap_filter_desc desc = {0};
    surface s = dressed(SURFACE_CUBE);
    desc.tolerance = 0.01f;
    CHECK(!envmap_fit_brdf(&fit, &brdf, NULL));
    envmap_lobe lobe = envmap_fit_lobe(&fit, 0);
    CHECK(!envmap_create(&map, ENVMAP_PARABOLOID, 32, 1, 16));
    CHECK(!envmap_filter(&map, &environment, &lobe, &desc));
    s.axis = SURFACE_VIEW;
    surface_fit(&s, &fit);
    for (int f = 0; f < 2; ++f) s.slices[f] = gl_volume(&map, f);
    looked in = {&map, &fit};
    FIGURE("a fit of GGX by 3D textures: mean error", worst_error(&s, in, NULL), 0.01);
    gl.DeleteTextures(2, s.slices);
    envmap_free(&map);
    envmap_fit_free(&fit);
}

static void fans_of_round_lobes_are_the_library_s(void) {
    for (int k = 0; k < SURFACE_LOOKUPS; ++k) {
        envmap map = {0};
        surface s = dressed(k);
        envmap_lobe lobe = envmap_lobe_phong(150);
        CHECK(!envmap_create(&map, surface_mapping[k], k == SURFACE_SPHERE ? 128 : 64, 1, 1));
        CHECK(!envmap_filter(&map, &environment, &lobe, NULL));
        s.map = gl_map(&map), s.axis = SURFACE_FAN;
        CHECK(surface_fan(&s, 0.5, envmap_lobe_sigma(&lobe, 0)) && s.taps > 3);
        FIGURE("an elliptical lobe by a fan: mean error", worst_of_meshes(&s, &map, NULL), 0.01);
        gl.DeleteTextures(1, &s.map);
        envmap_free(&map);
    }
}

static void maps_drawn_by_hand_are_the_library_s(void) {
    for (int k = 0; k < NPR_COUNT; ++k) {
        envmap map = {0};
        surface s = dressed(SURFACE_SPHERE);
        CHECK(!envmap_create(&map, ENVMAP_SPHERE, 128, 5, 1) && !npr_example(&map, k));
        s.map = gl_map(&map), s.axis = SURFACE_DRAWN, s.level = 1.3f;
        char what[80];
        snprintf(what, sizeof what, "drawn: %s: mean error", npr_name[k]);
        FIGURE(what, worst_of_meshes(&s, &map, NULL), 0.01);
        gl.DeleteTextures(1, &s.map);
        envmap_free(&map);
    }
}

/* ---------------------------------------------------------------------------------- shaders -- */

static const char glsl_fragment[] =
    "in vec3 at, n, t;\n"
    "out vec4 colour;\n"
    "void main() { colour = vec4(diffuse_light(normalize(gl_FrontFacing ? n : -n)), 1.0); }\n";

/* The text as it is printed, in a fragment shader, on each mesh. */
static void the_printed_shader_evaluates_nine_coefficients(void) {
    double sh[27], miss = 0, all = 0, worst = 0;
    float packed[28];
    char text[SHADER_ROOM + sizeof glsl_fragment];
    envmap_lobe diffuse = envmap_lobe_diffuse();
    CHECK(!envmap_sh_project(sh, 3, &environment, 0, 0, NULL));
    CHECK(!envmap_sh_convolve(sh, sh, 3, &diffuse, 0) && !envmap_sh_pack(NULL, packed, sh));
    shader_diffuse(text, packed);
    strcat(text, glsl_fragment);
    GLuint printed = gl_program(gl_vertex, text);
    CHECK(printed != 0);
    for (int k = 0; k < GL_MESH_COUNT; ++k) {
        gl_target_bind(&app.frame);
        gl.UseProgram(printed);
        gl_mat4(printed, "model", model);
        gl_mat4(printed, "camera", app.camera);
        gl_mesh_draw(&meshes[k]);
        float *rgba = gl_target_read(&app.frame);
        for (int i = 0; i < EDGE * EDGE; ++i) {
            const float *n = frames[k][0] + 4 * i;
            double E[3], wide[3] = {(double)n[0], (double)n[1], (double)n[2]};
            if (!(rgba[4 * i + 3] > 0.5f)) continue;
            CHECK(!envmap_sh_evaluate(E, sh, 3, wide));
            for (int c = 0; c < 3; ++c) {
                double off = fabs((double)rgba[4 * i + c] - E[c]);
                miss += off, all += fabs(E[c]), worst = fmax(worst, off);
            }
        }
        free(rgba);
    }
    FIGURE("envmap sh --glsl: mean error", miss / all, 1e-5);
    FIGURE("envmap sh --glsl: worst error", worst, 1e-4);
    gl.DeleteProgram(printed);
}

/* ---------------------------------------------------------------------------------- capture -- */

static capture caught;

/* The environment into level 0 and all that follows. */
static void catch_light(envmap *source) {
    CHECK(!envmap_create(source, ENVMAP_CUBE, CAPTURE_EDGE, CAPTURE_LEVELS, 1));
    CHECK(!envmap_resample(source, &environment, NULL) && capture_create(&caught));
    gl.BindTexture(GL_TEXTURE_CUBE_MAP, caught.cube);
    for (int f = 0; f < 6; ++f)
        gl.TexSubImage2D(GL_TEXTURE_CUBE_MAP_POSITIVE_X + (GLenum)f, 0, 0, 0, CAPTURE_EDGE,
                         CAPTURE_EDGE, GL_RGB, GL_FLOAT, envmap_texel(source, 0, 0, f, 0, 0));
    capture_levels(&caught);
    CHECK(!capture_project(&caught));
}

/* A level's texel by the library's lookups: a tent, also over the edges of its face. */
static void tent(float rgb[3], const envmap *map, int level, int face, int x, int y) {
    double sum[4] = {0, 0, 0, 0}, edge = map->size >> (level - 1);
    for (int k = 0; k < 16; ++k) {
        double u = (2 * x + k % 4 - 0.5) / edge, v = (2 * y + k / 4 - 0.5) / edge;
        double X = 2 * u - 1, Y = 2 * v - 1;
        double w = (2 - fabs(k % 4 - 1.5)) * (2 - fabs(k / 4 - 1.5)) * pow(1 + X * X + Y * Y, -1.5);
        float d[3], light[3];
        envmap_direction(d, ENVMAP_CUBE, face, (float)u, (float)v);
        envmap_lookup(light, map, d, (float)(level - 1));
        for (int c = 0; c < 3; ++c) sum[c] += w * (double)light[c];
        sum[3] += w;
    }
    for (int c = 0; c < 3; ++c) rgb[c] = (float)(sum[c] / sum[3]);
}

static void captured_levels_are_tents_over_the_edges(void) {
    envmap source = {0}, level = {0};
    double miss = 0, all = 0;
    catch_light(&source);
    for (int l = 1; l < CAPTURE_LEVELS; ++l) {
        int edge = CAPTURE_EDGE >> l;
        CHECK(!envmap_create(&level, ENVMAP_CUBE, edge, 1, 1));
        capture_read(&caught, &level, l);
        for (int i = 0; i < 6 * edge * edge; ++i) {
            int f = i / (edge * edge), y = i / edge % edge, x = i % edge;
            const float *is = envmap_texel(&level, 0, 0, f, x, y);
            float *should = envmap_texel(&source, l, 0, f, x, y);
            tent(should, &source, l, f, x, y);
            for (int c = 0; c < 3; ++c) {
                miss += fabs((double)is[c] - (double)should[c]);
                all += (double)should[c];
            }
        }
        envmap_free(&level);
    }
    FIGURE("levels of the captured cube: mean error", miss / all, 0.01);
    envmap_free(&source);
    capture_free(&caught);
}

#define SEAMS 128 /* points on each of the 12 edges */

static const char seam_fragment[] =
    "in vec2 st;\n"
    "out vec4 colour;\n"
    "uniform samplerCube cube;\n"
    "uniform float level, apart;\n" /* from the edge */
    "void main() {\n"
    "    int e = int(gl_FragCoord.y), a = e / 4, b = (a + 1) % 3;\n"
    "    vec3 d = vec3(0.0), across = vec3(0.0);\n"
    "    d[a] = e % 2 == 0 ? 1.0 : -1.0, d[b] = (e / 2 % 2 == 0 ? 1.0 : -1.0) * (1.0 - apart);\n"
    "    d[(a + 2) % 3] = 1.9 * st.x - 0.95;\n"
    "    across[b] = 1e-3 * sign(d[b] + 1e-9);\n"
    "    vec3 here = textureLod(cube, d - across, level).rgb;\n"
    "    vec3 there = textureLod(cube, d + across, level).rgb;\n"
    "    colour = vec4(abs(here - there), dot(here, vec3(1.0)));\n"
    "}\n";

/* The mean step of 0.1 degrees over edges, or beside them, of the mean radiance there. */
static double step_over(GLuint seam, int level, float apart) {
    gl_target strip;
    double step = 0, all = 0;
    CHECK(gl_target_create(&strip, SEAMS, 12, GL_RGBA32F));
    gl_target_bind(&strip);
    gl.UseProgram(seam);
    gl_sampler(seam, "cube", 0, GL_TEXTURE_CUBE_MAP, caught.cube);
    gl_float(seam, "level", (float)level);
    gl_float(seam, "apart", apart);
    gl.BindVertexArray(caught.array);
    gl.DrawArrays(GL_TRIANGLES, 0, 3);
    float *rgba = gl_target_read(&strip);
    for (int i = 0; i < 12 * SEAMS; ++i) {
        for (int c = 0; c < 3; ++c) step += (double)rgba[4 * i + c];
        all += (double)rgba[4 * i + 3];
    }
    free(rgba);
    gl_target_free(&strip);
    return step / all;
}

static void captured_levels_have_no_seams(void) {
    envmap source = {0};
    GLuint seam = gl_program(gl_cover, seam_fragment);
    catch_light(&source);
    for (int l = 1; l < CAPTURE_LEVELS; ++l) {
        char what[80];
        snprintf(what, sizeof what, "level %d: a step over an edge, of one beside it (%.2g)", l,
                 step_over(seam, l, 0.1f));
        FIGURE(what, step_over(seam, l, 0) / step_over(seam, l, 0.1f), 2);
    }
    gl.DeleteProgram(seam);
    envmap_free(&source);
    capture_free(&caught);
}

/* A cube whose level l holds l: what the card looks up there is the level that it took. */
static GLuint numbered(void) {
    GLuint cube = gl_texture(GL_TEXTURE_CUBE_MAP, CAPTURE_LEVELS);
    static float number[3 * CAPTURE_EDGE * CAPTURE_EDGE];
    for (int l = 0; l < CAPTURE_LEVELS; ++l)
        for (int f = 0; f < 6; ++f) {
            int edge = CAPTURE_EDGE >> l;
            for (int i = 0; i < 3 * edge * edge; ++i) number[i] = (float)l;
            gl.TexImage2D(GL_TEXTURE_CUBE_MAP_POSITIVE_X + (GLenum)f, l, GL_RGB32F, edge, edge, 0,
                          GL_RGB, GL_FLOAT, number);
        }
    return cube;
}

static float *shoot_captured(const gl_mesh *m, const capture_look *look) {
    gl_target_bind(&app.frame);
    capture_draw(&caught, &app, m, model, look);
    return gl_target_read(&app.frame);
}

/* One look of the captured light against lookups at the levels that the card took. */
static double captured_error(const envmap *map, const double *sh, int m, const capture_look *look,
                             GLuint numbers) {
    const capture_look bare = {1, look->b, {0, 0, 0}};
    GLuint cube = caught.cube;
    float *rgba = shoot_captured(&meshes[m], look);
    caught.cube = numbers;
    float *levels = shoot_captured(&meshes[m], &bare);
    caught.cube = cube;
    double miss = 0, all = 0;
    int pixels = 0;
    for (int i = 0; i < EDGE * EDGE; ++i) {
        const float *n = frames[m][0] + 4 * i, *v = frames[m][1] + 4 * i;
        float r[3], L[3], c = mesh_dot(n, v);
        double E[3], wide[3] = {(double)n[0], (double)n[1], (double)n[2]};
        if (!(rgba[4 * i + 3] > 0.5f)) continue;
        double F = (double)look->f + (1 - (double)look->f) * pow(1 - fmax((double)c, 0), 5);
        for (int k = 0; k < 3; ++k) r[k] = 2 * c * n[k] - v[k];
        envmap_lookup(L, map, r, levels[4 * i]);
        envmap_sh_evaluate(E, sh, 3, wide);
        for (int k = 0; k < 3; ++k) {
            double is = F * (double)L[k] + (1 - F) * (double)look->albedo[k] * fmax(0, E[k]);
            miss += fabs((double)rgba[4 * i + k] - is), all += is;
        }
        ++pixels;
    }
    free(rgba), free(levels);
    CHECK(pixels > EDGE * EDGE / 10 && all > 0);
    return miss / all;
}

static void captured_light_is_the_library_s_in_one_pass(void) {
    static const float f[4] = {0.03f, 0.09f, 0.26f, 0.42f}, b[4] = {0, 0.8f, 1.7f, 2.4f};
    envmap source = {0}, small = {0};
    envmap_lobe diffuse = envmap_lobe_diffuse();
    GLuint numbers = numbered();
    double sh[27];
    catch_light(&source);
    for (int l = 1; l < CAPTURE_LEVELS; ++l)
        for (int i = 0; i < 6; ++i) {
            envmap level = source;
            level.texels = envmap_texel(&source, l, 0, 0, 0, 0), level.size = source.size >> l;
            level.levels = 1;
            capture_read(&caught, &level, l);
        }
    CHECK(!envmap_create(&small, ENVMAP_CUBE, 64, 1, 1));
    CHECK(!envmap_resample(&small, &environment, NULL));
    CHECK(!envmap_sh_project(sh, 3, &small, 0, 0, NULL));
    CHECK(!envmap_sh_convolve(sh, sh, 3, &diffuse, 0));
    for (int i = 0; i < 4; ++i) {
        double worst = 0;
        for (int k = 0; k < 4; ++k) {
            capture_look look = {f[i], b[k], {0.3f, 0.5f, 0.4f}};
            for (int m = 0; m < GL_MESH_COUNT; ++m)
                worst = fmax(worst, captured_error(&source, sh, m, &look, numbers));
        }
        char what[80];
        snprintf(what, sizeof what, "one pass, f = %.2f, b = 0 ... 2.4: mean error", (double)f[i]);
        FIGURE(what, worst, 0.01);
    }
    gl.DeleteTextures(1, &numbers);
    envmap_free(&source);
    envmap_free(&small);
    capture_free(&caught);
}

/* ---------------------------------------------------------------------------------- filters -- */

static void the_card_convolves_paraboloids_as_the_method_does(void) {
    static const float exponents[4] = {10, 50, 100, 500};
    envmap source = {0}, map = {0};
    gl_filter filter;
    CHECK(!envmap_create(&source, ENVMAP_PARABOLOID, 256, 1, 1));
    CHECK(!envmap_create(&map, ENVMAP_PARABOLOID, 64, 1, 1));
    CHECK(!envmap_resample(&source, &environment, NULL));
    CHECK(gl_filter_create(&filter, 256));
    gl_filter_source(&filter, &source);
    for (int k = 0; k < 4; ++k)
        for (int maps = 1; maps <= 2; ++maps) {
            envmap_lobe lobe = envmap_lobe_phong(exponents[k]);
            method_desc desc = {0};
            double miss = 0, all = 0;
            char what[80];
            desc.form = METHOD_PUBLISHED, desc.one_map = maps == 1;
            CHECK(!method_paraboloid_convolution(&map, &source, &lobe, &desc));
            gl_filter_run(&filter, &lobe, maps);
            float *rgba = gl_filter_read(&filter, 64);
            for (int i = 0; i < 2 * 64 * 64; ++i)
                for (int c = 0; c < 3; ++c) {
                    miss += fabs((double)rgba[4 * i + c] - (double)map.texels[3 * i + c]);
                    all += (double)map.texels[3 * i + c];
                }
            free(rgba);
            snprintf(what, sizeof what, "N = %.0f, %d map%s: mean error", (double)exponents[k],
                     maps, maps == 1 ? "" : "s");
            FIGURE(what, miss / all, 0.01);
        }
    gl_filter_free(&filter);
    envmap_free(&source);
    envmap_free(&map);
}

static void no_error_was_reported(void) {
    CHECK(gl.GetError() == GL_NO_ERROR);
    CHECK(gl_errors == 0);
}

static void run_gl(void) {
    static char flag[] = "--headless", out[] = "unused.png";
    char *arguments[] = {flag, flag, out, NULL};
    int good = gl_open(&app, "test_gl", EDGE, EDGE, 3, arguments);
    if (!good) {
        printf("    the shaders passed by: no OpenGL 3.3 (Debian: libegl1 libgl1-mesa-dri)\n");
        return;
    }
    printf("    %s\n", (const char *)gl.GetString(GL_RENDERER));
    gl_target_free(&app.frame);
    app.samples = 1; /* as many points as pixels */
    CHECK(gl_target_create(&app.frame, EDGE, EDGE, GL_RGBA32F));
    app.tangent = 0.32f;
    gl_orbit(&app);
    mesh_turn(model, 0, 0.5f);
    program = surface_program();
    for (int k = 0; k < GL_MESH_COUNT; ++k) CHECK(gl_mesh_make(&meshes[k], k));
    CHECK(!envmap_create(&environment, ENVMAP_LATLONG, 64, 1, 1));
    scene_fill(&environment, SCENE_STUDIO);
    shoot_frames();
    RUN(every_lookup_is_the_library_s);
    RUN(a_chain_s_levels_are_the_library_s);
    RUN(coats_are_fresnel_s_over_nine_coefficients);
    RUN(slices_are_the_library_s);
    RUN(fits_are_the_library_s);
    RUN(fans_of_round_lobes_are_the_library_s);
    RUN(maps_drawn_by_hand_are_the_library_s);
    RUN(the_printed_shader_evaluates_nine_coefficients);
    RUN(captured_levels_are_tents_over_the_edges);
    RUN(captured_levels_have_no_seams);
    RUN(captured_light_is_the_library_s_in_one_pass);
    RUN(the_card_convolves_paraboloids_as_the_method_does);
    RUN(no_error_was_reported);
    for (int k = 0; k < GL_MESH_COUNT; ++k) gl_mesh_free(&meshes[k]);
    for (int k = 0; k < 3 * GL_MESH_COUNT; ++k) free(frames[k / 3][k % 3]);
    gl.DeleteProgram(program);
    envmap_free(&environment);
    gl_close(&app);
}
#endif

int main(void) {
    RUN(meshes_enclose_what_balls_and_rings_do);
    RUN(meshes_show_their_outside);
    RUN(a_camera_sees_what_it_looks_at_in_the_middle);
#ifdef TEST_GL
    run_gl();
#else
    printf("    the shaders passed by: no EGL headers (Debian: libegl-dev libgl-dev)\n");
#endif
    return test_summary();
}
