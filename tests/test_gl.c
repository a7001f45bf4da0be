/* SPDX-License-Identifier: MIT
   The meshes of examples/mesh.h, and what a graphics card makes of the maps: every path of the
   examples' shaders against envmap_lookup at the same normals, eyes and tangents, which the card
   writes out too. Without EGL at compile time, or without a driver, the meshes alone are tested. */
#define _POSIX_C_SOURCE 200809L
#define ENVMAP_IMPLEMENTATION
#include "envmap.h"
#include "test.h"
#include "examples/scenes.h"
#include "examples/mesh.h"
#include "examples/methods/paraboloid_convolution.h"
#ifdef TEST_GL
#include "examples/gl.h"
#include "examples/surface.h"
#include "examples/gl_filter.h"
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

#define EDGE 160

static gl_app app;
static GLuint program;
static gl_mesh meshes[GL_MESH_COUNT];

/* One frame of a surface: RGBA, alpha 1 where the object is. */
static float *shoot(surface s, int show, const gl_mesh *m) {
    float model[16];
    s.show = show;
    mesh_turn(model, 0, 0.5f);
    gl_target_bind(&app.frame);
    surface_draw(program, &app, &s, m, model);
    return gl_target_read(&app.frame);
}

static double fresnel(double c, double index) {
    double g = sqrt(index * index - 1 + c * c);
    double a = (g - c) / (g + c), b = (c * (g + c) - 1) / (c * (g - c) + 1);
    return 0.5 * a * a * (1 + b * b);
}

static void turned(float out[3], const float turn[9], const float d[3]) {
    for (int i = 0; i < 3; ++i) out[i] = turn[i] * d[0] + turn[3 + i] * d[1] + turn[6 + i] * d[2];
}

/* What surface.h promises, by the library's own calls. */
static void shade(double rgb[3], const surface *s, const envmap *map, const double *sh,
                  const float n[3], const float v[3], const float t[3]) {
    float r[3], axis[3], normal[3], L[3] = {0, 0, 0}, c = mesh_dot(n, v);
    double E[3] = {0, 0, 0}, F = s->index > 0 ? fresnel(fmax((double)c, 0), (double)s->index) : 1;
    double w = s->diffuse == SURFACE_NO_DIFFUSE     ? 0
               : s->diffuse == SURFACE_PLUS_DIFFUSE ? 1
                                                    : 1 - F;
    for (int i = 0; i < 3; ++i) r[i] = 2 * c * n[i] - v[i];
    turned(axis, s->turn, s->axis == SURFACE_TANGENT ? t : r);
    turned(normal, s->turn, n);
    if (map)
        envmap_lookup_slice(L, map, axis, s->axis == SURFACE_TANGENT ? mesh_dot(v, t) : c,
                            s->level);
    double wide[3] = {(double)normal[0], (double)normal[1], (double)normal[2]};
    if (w > 0) envmap_sh_evaluate(E, sh, 3, wide);
    for (int i = 0; i < 3; ++i)
        rgb[i] = F * (double)s->tint[i] * (double)L[i] + w * (double)s->albedo[i] * fmax(0, E[i]);
}

/* sum |gpu - cpu| / sum |cpu| over the object's pixels. */
static double mean_error(const surface *s, const envmap *map, const double *sh, const gl_mesh *m) {
    float *show[4];
    double miss = 0, all = 0;
    int pixels = 0;
    for (int k = 0; k < 4; ++k) show[k] = shoot(*s, k, m);
    for (int i = 0; i < EDGE * EDGE; ++i) {
        double rgb[3];
        if (!(show[0][4 * i + 3] > 0.5f)) continue;
        shade(rgb, s, map, sh, show[1] + 4 * i, show[2] + 4 * i, show[3] + 4 * i);
        for (int c = 0; c < 3; ++c) {
            miss += fabs((double)show[0][4 * i + c] - rgb[c]);
            all += fabs(rgb[c]);
        }
        ++pixels;
    }
    for (int k = 0; k < 4; ++k) free(show[k]);
    CHECK(pixels > EDGE * EDGE / 10);
    return miss / all;
}

static double worst_of_meshes(const surface *s, const envmap *map, const double *sh) {
    double worst = 0;
    for (int k = 0; k < GL_MESH_COUNT; ++k) worst = fmax(worst, mean_error(s, map, sh, &meshes[k]));
    return worst;
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

/* ---------------------------------------------------------------------------------- filters -- */

static void the_card_convolves_paraboloids_as_the_method_does(void) {
    static const float exponents[4] = {10, 50, 100, 500};
    envmap source = {0}, map = {0};
    gl_filter filter;
    CHECK(!envmap_create(&source, ENVMAP_PARABOLOID, 256, 1, 1));
    CHECK(!envmap_create(&map, ENVMAP_PARABOLOID, 64, 1, 1));
    CHECK(!envmap_resample(&source, &environment));
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
    int good = gl_open(&app, "test_gl", EDGE / 4, EDGE / 4, 3, arguments);
    if (!good) {
        printf("    the shaders passed by: no OpenGL 3.3 (Debian: libegl1 libgl1-mesa-dri)\n");
        return;
    }
    printf("    %s\n", (const char *)gl.GetString(GL_RENDERER));
    app.tangent = 0.32f;
    gl_orbit(&app);
    program = surface_program();
    for (int k = 0; k < GL_MESH_COUNT; ++k) CHECK(gl_mesh_make(&meshes[k], k));
    CHECK(!envmap_create(&environment, ENVMAP_LATLONG, 64, 1, 1));
    scene_fill(&environment, SCENE_STUDIO);
    RUN(every_lookup_is_the_library_s);
    RUN(a_chain_s_levels_are_the_library_s);
    RUN(coats_are_fresnel_s_over_nine_coefficients);
    RUN(slices_are_the_library_s);
    RUN(the_card_convolves_paraboloids_as_the_method_does);
    RUN(no_error_was_reported);
    for (int k = 0; k < GL_MESH_COUNT; ++k) gl_mesh_free(&meshes[k]);
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
