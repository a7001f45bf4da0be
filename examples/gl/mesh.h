/* mesh.h - a teapot, a ball, a torus and a plane as triangles, and the few matrices that a camera
   needs.

   What you will see: mesh_teapot(&m, 16) is the teapot that M. Newell drew in 1975: 32 bicubic
   patches, each cut into 16 x 16 quads. Nothing here knows about OpenGL.
   Vertices are position, normal, tangent (unit vectors; the tangent runs with u: around the axis
   of what was turned, across handle and spout). Triangles are counter-clockwise from outside.

   Tests: mesh_* in tests/test_gl.c.

   SPDX-License-Identifier: MIT */

#ifndef MESH_H
#define MESH_H

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define MESH_TURN   6.28318530718f
#define MESH_FLOATS 9 /* of a vertex */

typedef struct mesh {
    float *vertices;   /* [vertex_count][MESH_FLOATS] */
    unsigned *indices; /* [index_count], three a triangle */
    int vertex_count, index_count;
} mesh;

/* --------------------------------------------------------------------------------- >>vectors -- */

static inline float mesh_dot(const float a[3], const float b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static inline void mesh_cross(float out[3], const float a[3], const float b[3]) {
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

static inline void mesh_unit(float v[3]) {
    float length = sqrtf(mesh_dot(v, v));
    if (length > 0) v[0] /= length, v[1] /= length, v[2] /= length;
}

/* out = a b, all column-major; out is neither. */
static inline void mesh_multiply(float out[16], const float a[16], const float b[16]) {
    int i, k;
    for (i = 0; i < 16; i++)
        for (out[i] = 0, k = 0; k < 4; k++) out[i] += a[4 * k + i % 4] * b[i / 4 * 4 + k];
}

static inline void mesh_identity(float out[16]) {
    int i;
    for (i = 0; i < 16; i++) out[i] = i % 5 ? 0.0f : 1.0f;
}

/* A turn about an axis (0 x, 1 y, 2 z) by an angle, right-handed. */
static inline void mesh_turn(float out[16], int axis, float angle) {
    int a = (axis + 1) % 3, b = (axis + 2) % 3;
    mesh_identity(out);
    out[5 * a] = out[5 * b] = cosf(angle);
    out[4 * a + b] = sinf(angle), out[4 * b + a] = -sinf(angle);
}

/* OpenGL's perspective: the tangent of half the vertical field of view, width / height, and the
   depths of the two planes. */
static inline void mesh_perspective(float out[16], float tangent, float aspect, float front,
                                    float back) {
    memset(out, 0, 16 * sizeof(float));
    out[0] = 1 / (tangent * aspect), out[5] = 1 / tangent;
    out[10] = (front + back) / (front - back), out[11] = -1;
    out[14] = 2 * front * back / (front - back);
}

/* The world as an eye sees it that looks at a point, +y up. */
static inline void mesh_look(float out[16], const float eye[3], const float at[3]) {
    float axes[3][3], up[3] = {0, 1, 0};
    int i, k;
    for (i = 0; i < 3; i++) axes[2][i] = eye[i] - at[i];
    mesh_unit(axes[2]);
    mesh_cross(axes[0], up, axes[2]);
    mesh_unit(axes[0]);
    mesh_cross(axes[1], axes[2], axes[0]);
    mesh_identity(out);
    for (i = 0; i < 3; i++) {
        for (k = 0; k < 3; k++) out[4 * k + i] = axes[i][k];
        out[12 + i] = -mesh_dot(axes[i], eye);
    }
}

/* -------------------------------------------------------------------------------- >>surfaces -- */

/* A point and its two derivatives (of any length), u and v in [0,1]; du x dv points outwards. */
typedef void mesh_surface(float p[3], float du[3], float dv[3], float u, float v, const void *user);

/* Makes room for `patches` grids of nu x nv quads. Returns 1 if there is memory. */
static inline int mesh_reserve(mesh *m, int patches, int nu, int nv) {
    size_t points = (size_t)patches * (size_t)((nu + 1) * (nv + 1)), quads = (size_t)(nu * nv);
    memset(m, 0, sizeof *m);
    m->vertices = (float *)malloc(points * MESH_FLOATS * sizeof(float));
    m->indices = (unsigned *)malloc((size_t)patches * quads * 6 * sizeof(unsigned));
    if (m->vertices && m->indices) return 1;
    free(m->vertices);
    free(m->indices);
    memset(m, 0, sizeof *m);
    return 0;
}

static inline void mesh_free(mesh *m) {
    free(m->vertices);
    free(m->indices);
    memset(m, 0, sizeof *m);
}

static inline void mesh_vertex(float out[MESH_FLOATS], mesh_surface *surface, const void *user,
                               float u, float v) {
    float du[3], dv[3], p[3];
    float inside = fminf(fmaxf(v, 1e-3f), 1 - 1e-3f); /* off the poles, where a derivative is 0 */
    surface(p, du, dv, u, inside, user);
    mesh_cross(out + 3, du, dv);
    mesh_unit(out + 3);
    memcpy(out + 6, du, 3 * sizeof(float));
    mesh_unit(out + 6);
    surface(out, du, dv, u, v, user);
}

/* Appends a grid. */
static inline void mesh_grid(mesh *m, mesh_surface *surface, const void *user, int nu, int nv) {
    int i, j, k;
    for (j = 0; j < nv; j++)
        for (i = 0; i < nu; i++) {
            static const int corner[6] = {0, 1, 2, 1, 3, 2}; /* of u + 2 v */
            for (k = 0; k < 6; k++)
                m->indices[m->index_count++] =
                    (unsigned)(m->vertex_count + i + (corner[k] == 1 || corner[k] == 3) +
                               (nu + 1) * (j + corner[k] / 2));
        }
    for (j = 0; j <= nv; j++)
        for (i = 0; i <= nu; i++)
            mesh_vertex(m->vertices + MESH_FLOATS * m->vertex_count++, surface, user,
                        (float)i / (float)nu, (float)j / (float)nv);
}

/* A circle in the plane of z and x, radius r and height y of which are given with their slopes. */
static inline void mesh_revolve(float p[3], float du[3], float dv[3], float u, const float at[2],
                                const float slope[2]) {
    float s = sinf(-MESH_TURN * u), c = cosf(-MESH_TURN * u);
    p[0] = at[0] * s, p[1] = at[1], p[2] = at[0] * c;
    du[0] = -c, du[1] = 0, du[2] = s;
    dv[0] = slope[0] * s, dv[1] = slope[1], dv[2] = slope[0] * c;
}

static inline void mesh_ball_surface(float p[3], float du[3], float dv[3], float u, float v,
                                     const void *user) {
    float a = 0.5f * MESH_TURN * v, at[2], slope[2];
    (void)user;
    at[0] = sinf(a), at[1] = cosf(a);
    slope[0] = at[1], slope[1] = -at[0];
    mesh_revolve(p, du, dv, u, at, slope);
}

/* user: the radius of the tube; that of the ring is 1. */
static inline void mesh_torus_surface(float p[3], float du[3], float dv[3], float u, float v,
                                      const void *user) {
    float r = *(const float *)user, a = -MESH_TURN * v, at[2], slope[2];
    at[0] = 1 + r * cosf(a), at[1] = r * sinf(a);
    slope[0] = sinf(a), slope[1] = -cosf(a);
    mesh_revolve(p, du, dv, u, at, slope);
}

/* Radius 1, axis y. */
static inline int mesh_ball(mesh *m, int n) {
    if (!mesh_reserve(m, 1, 2 * n, n)) return 0;
    mesh_grid(m, mesh_ball_surface, NULL, 2 * n, n);
    return 1;
}

/* Radii 1 and `tube`, axis y. */
static inline int mesh_torus(mesh *m, int n, float tube) {
    if (!mesh_reserve(m, 1, 2 * n, n)) return 0;
    mesh_grid(m, mesh_torus_surface, &tube, 2 * n, n);
    return 1;
}

/* ---------------------------------------------------------------------------------- >>teapot -- */

/* What is turned about z: (radius, height) of the control points, from the rim down to the foot,
   and from the knob down to the edge of the lid. Source: M. Newell's data, University of Utah,
   1975, as printed in F. Crow, "The origins of the teapot", 1987. */
static const float mesh_profiles[6][4][2] = {
    {{1.4f, 2.4f}, {1.3375f, 2.53125f}, {1.4375f, 2.53125f}, {1.5f, 2.4f}},
    {{1.5f, 2.4f}, {1.75f, 1.875f}, {2, 1.35f}, {2, 0.9f}},
    {{2, 0.9f}, {2, 0.45f}, {1.5f, 0.225f}, {1.5f, 0.15f}},
    {{1.5f, 0.15f}, {1.5f, 0.075f}, {1.425f, 0}, {0, 0}},
    {{0, 3.15f}, {0.8f, 3.15f}, {0, 2.85f}, {0.2f, 2.7f}},
    {{0.2f, 2.7f}, {0.4f, 2.55f}, {1.3f, 2.55f}, {1.3f, 2.4f}}};

/* Half of handle and spout, whose other half is its mirror image in y: four patches of four rows of
   (x, z) of the first two points, (x, z) of the last two, and how far the middle two are from y = 0. */
static const float mesh_halves[4][4][5] = {{{-1.6f, 2.025f, -1.5f, 2.25f, 0.3f},
                                            {-2.3f, 2.025f, -2.5f, 2.25f, 0.3f},
                                            {-2.7f, 2.025f, -3, 2.25f, 0.3f},
                                            {-2.7f, 1.8f, -3, 1.8f, 0.3f}},
                                           {{-2.7f, 1.8f, -3, 1.8f, 0.3f},
                                            {-2.7f, 1.575f, -3, 1.35f, 0.3f},
                                            {-2.5f, 1.125f, -2.65f, 0.9375f, 0.3f},
                                            {-2, 0.9f, -1.9f, 0.6f, 0.3f}},
                                           {{1.7f, 1.425f, 1.7f, 0.6f, 0.66f},
                                            {2.6f, 1.425f, 3.1f, 0.825f, 0.66f},
                                            {2.3f, 2.1f, 2.4f, 2.025f, 0.25f},
                                            {2.7f, 2.4f, 3.3f, 2.4f, 0.25f}},
                                           {{2.7f, 2.4f, 3.3f, 2.4f, 0.25f},
                                            {2.8f, 2.475f, 3.525f, 2.49375f, 0.25f},
                                            {2.9f, 2.475f, 3.45f, 2.5125f, 0.15f},
                                            {2.8f, 2.4f, 3.2f, 2.4f, 0.15f}}};

typedef float mesh_bicubic[16][3]; /* u runs fastest */

static inline void mesh_bernstein(float b[4], float slope[4], float t) {
    float s = 1 - t;
    b[0] = s * s * s, b[1] = 3 * s * s * t, b[2] = 3 * s * t * t, b[3] = t * t * t;
    slope[0] = -3 * s * s, slope[1] = 3 * s * (s - 2 * t), slope[2] = 3 * t * (2 * s - t);
    slope[3] = 3 * t * t;
}

/* A patch, laid down from Newell's z up to y up, the middle of its height and half its size. */
static inline void mesh_bicubic_surface(float p[3], float du[3], float dv[3], float u, float v,
                                        const void *user) {
    const float *points = (const float *)user;
    float bu[4], bv[4], su[4], sv[4], sums[3][3];
    int i, c;
    mesh_bernstein(bu, su, u);
    mesh_bernstein(bv, sv, v);
    memset(sums, 0, sizeof sums);
    for (i = 0; i < 16; i++)
        for (c = 0; c < 3; c++) {
            sums[0][c] += bu[i % 4] * bv[i / 4] * points[3 * i + c];
            sums[1][c] += su[i % 4] * bv[i / 4] * points[3 * i + c];
            sums[2][c] += bu[i % 4] * sv[i / 4] * points[3 * i + c];
        }
    sums[0][2] -= 1.575f;
    for (i = 0; i < 3; i++) {
        float *out = i == 0 ? p : i == 1 ? du : dv;
        out[0] = 0.5f * sums[i][0], out[1] = 0.5f * sums[i][2], out[2] = -0.5f * sums[i][1];
    }
}

/* A quarter of a turn of a profile; 0.56 is Newell's circle. */
static inline void mesh_quarter(mesh_bicubic out, const float profile[4][2], int turns) {
    static const float circle[4][2] = {{1, 0}, {1, -0.56f}, {0.56f, -1}, {0, -1}};
    int i, k;
    for (i = 0; i < 16; i++) {
        float x = circle[i % 4][0], y = circle[i % 4][1];
        for (k = 0; k < turns; k++) {
            float old = x;
            x = y, y = -old;
        }
        out[i][0] = x * profile[i / 4][0], out[i][1] = y * profile[i / 4][0];
        out[i][2] = profile[i / 4][1];
    }
}

/* The half as it is, or its mirror image with u reversed, so that it stays outside out. */
static inline void mesh_half(mesh_bicubic out, const float half[4][5], int mirrored) {
    int i;
    for (i = 0; i < 16; i++) {
        int k = mirrored ? 3 - i % 4 : i % 4;
        const float *row = half[i / 4], side = k == 1 || k == 2 ? row[4] : 0;
        out[i][0] = row[k / 2 * 2], out[i][1] = mirrored ? side : -side;
        out[i][2] = row[k / 2 * 2 + 1];
    }
}

/* About 1.6 high and 3.2 long, spout towards +x, its middle at the origin. */
static inline int mesh_teapot(mesh *m, int n) {
    mesh_bicubic patch;
    int i, k;
    if (!mesh_reserve(m, 32, n, n)) return 0;
    for (i = 0; i < 6; i++)
        for (k = 0; k < 4; k++) {
            mesh_quarter(patch, mesh_profiles[i], k);
            mesh_grid(m, mesh_bicubic_surface, patch, n, n);
        }
    for (i = 0; i < 4; i++)
        for (k = 0; k < 2; k++) {
            mesh_half(patch, mesh_halves[i], k);
            mesh_grid(m, mesh_bicubic_surface, patch, n, n);
        }
    return 1;
}

#endif /* MESH_H */
