/* SPDX-License-Identifier: MIT
   What the tests hold the library against: the mappings written a second time, in double and
   straight from their sources, a memory that counts and fails on demand, and scenes. Include it
   before envmap.h: it defines ENVMAP_MALLOC and ENVMAP_FREE.

   A test that uses private names of the header defines ENVMAP_IMPLEMENTATION first. Compiled alone
   every test has the bodies; with -DTEST_SHARED it links those of tests/oracle.c, which saves most of
   the time that compiling takes: private names are then compiled once more, as far as the test uses
   them, and bodies of public calls are seen but not emitted. */
#ifndef ORACLE_H
#define ORACLE_H

#include "test.h"

/* ------------------------------------------------------------------------------- the memory --
   Live blocks are counted; the call number `oracle_fail_at` (from 0) gets NULL, a single block
   of more than `oracle_most` too, and a block must come back with the context that it was asked
   with.
   Threads may count at once, but for the bytes held and their peak, while `oracle_metered`. */
#ifndef TEST_SHARED
#undef ENVMAP_IMPLEMENTATION
#define ENVMAP_IMPLEMENTATION
#elif defined(__clang__)
#define ENVMAPI_BODY extern inline __attribute__((gnu_inline))
#else
#define ENVMAPI_BODY extern inline __attribute__((gnu_inline, noinline, noipa))
#endif
extern int oracle_live, oracle_calls, oracle_fail_at, oracle_wrong_context;
extern size_t oracle_largest, oracle_most; /* largest: that was asked for */
extern size_t oracle_held, oracle_peak;
extern int oracle_metered;
void *oracle_malloc(void *context, size_t bytes);
void oracle_free(void *context, void *pointer);
#ifndef TEST_SHARED
int oracle_live, oracle_calls, oracle_fail_at = -1, oracle_wrong_context;
size_t oracle_largest, oracle_most = (size_t)256 << 20;
size_t oracle_held, oracle_peak;
int oracle_metered;

static int oracle_counts(int *count, int n) { /* returns what it was */
#ifdef __TINYC__
    return (*count += n) - n;
#else
    return __sync_fetch_and_add(count, n);
#endif
}

void *oracle_malloc(void *context, size_t bytes) {
    if (bytes > oracle_largest) oracle_largest = bytes;
    if (oracle_counts(&oracle_calls, 1) == oracle_fail_at || bytes > oracle_most)
        return NULL;
    void **block = (void **)malloc(bytes + 16);
    if (!block) return NULL;
    block[0] = context;
    memcpy(block + 1, &bytes, sizeof bytes);
    if (oracle_metered && (oracle_held += bytes) > oracle_peak) oracle_peak = oracle_held;
    memset((char *)block + 16, 0xFF, bytes); /* NaN, as float and as double */
    oracle_counts(&oracle_live, 1);
    return (char *)block + 16;
}

void oracle_free(void *context, void *pointer) {
    if (!pointer) return;
    void **block = (void **)((char *)pointer - 16);
    size_t bytes;
    if (block[0] != context) oracle_counts(&oracle_wrong_context, 1);
    memcpy(&bytes, block + 1, sizeof bytes);
    if (oracle_metered) oracle_held -= bytes;
    oracle_counts(&oracle_live, -1);
    free(block);
}
#endif

#define ENVMAP_MALLOC(context, bytes) oracle_malloc(context, bytes)
#define ENVMAP_FREE(context, pointer) oracle_free(context, pointer)
#include "envmap.h"

/* ------------------------------------------------------------------------------ the mappings -- */

#define MAPPINGS 6
static const char *const oracle_name[MAPPINGS] = {"cube",     "paraboloid", "sphere",
                                                  "lat-long", "angular",    "octahedral"};

static inline int oracle_is_disc(int mapping) {
    return mapping == ENVMAP_PARABOLOID || mapping == ENVMAP_SPHERE || mapping == ENVMAP_ANGULAR;
}

/* OpenGL 4.6, table 8.19: the face of largest |r|, s_c and t_c as signed components (1 x, 2 y,
   3 z), then s = (s_c/|m_a| + 1)/2, t = (t_c/|m_a| + 1)/2. */
static const int oracle_cube[6][3] = {/* m_a, s_c, t_c */
                                      {+1, -3, -2}, {-1, +3, -2}, {+2, +1, +3},
                                      {-2, +1, -3}, {+3, +1, -2}, {-3, -1, -2}};

static inline double oracle_component(const double d[3], int axis) {
    return axis > 0 ? d[axis - 1] : -d[-axis - 1];
}

static inline void oracle_coordinates(int *face, double *u, double *v, int mapping,
                                      const double d[3]) {
    double n = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
    double x = d[0] / n, y = d[1] / n, z = d[2] / n, X = 0, Y = 0;
    *face = 0;
    if (mapping == ENVMAP_CUBE) {
        for (int f = 1; f < 6; ++f)
            if (oracle_component(d, oracle_cube[f][0]) >
                oracle_component(d, oracle_cube[*face][0]))
                *face = f;
        double m = oracle_component(d, oracle_cube[*face][0]);
        *u = (oracle_component(d, oracle_cube[*face][1]) / m + 1) / 2;
        *v = (oracle_component(d, oracle_cube[*face][2]) / m + 1) / 2;
        return;
    }
    if (mapping == ENVMAP_LATLONG) { /* Debevec's lat-long formula */
        *u = 0.5 + atan2(x, -z) / (2 * PI);
        *v = acos(y) / PI;
        return;
    }
    if (mapping == ENVMAP_OCTAHEDRAL) { /* the faces below y = 0 as those above, over a diagonal */
        double sum = fabs(x) + fabs(y) + fabs(z), a = fabs(x) / sum, b = fabs(z) / sum;
        *u = 0.5 + (x < 0 ? -0.5 : 0.5) * (y < 0 ? 1 - b : a);
        *v = 0.5 + (z < 0 ? -0.5 : 0.5) * (y < 0 ? 1 - a : b);
        return;
    }
    if (mapping == ENVMAP_PARABOLOID) { /* Heidrich & Seidel 1998 */
        *face = z < 0;
        X = x / (1 + fabs(z)), Y = y / (1 + fabs(z));
    } else if (mapping == ENVMAP_SPHERE) { /* OpenGL 1.1, 2.10.4: m = 2 sqrt(x^2+y^2+(z+1)^2) */
        double m = 2 * sqrt(x * x + y * y + (z + 1) * (z + 1));
        X = 2 * x / m, Y = 2 * y / m;
    } else { /* Debevec's angular map */
        double r = acos(-z) / (PI * sqrt(x * x + y * y));
        X = x * r, Y = y * r;
    }
    *u = 0.5 + 0.5 * X;
    *v = 0.5 - 0.5 * Y;
}

/* A point of a face is its three corners, +-x, +-z and a pole, in shares whose sum is 1. Beyond an
   edge: half a turn about its middle. */
static inline void oracle_octahedral(double d[3], double X, double Y) {
    if (X > 1 || X < -1) {
        oracle_octahedral(d, (X > 1 ? 2 : -2) - X, -Y);
        return;
    }
    if (Y > 1 || Y < -1) {
        oracle_octahedral(d, -X, (Y > 1 ? 2 : -2) - Y);
        return;
    }
    double x[3] = {X < 0 ? -1 : 1, 0, 0}, z[3] = {0, 0, Y < 0 ? -1 : 1}, pole[3] = {0, 1, 0};
    double to_x = fabs(X), to_z = fabs(Y);
    if (to_x + to_z > 1) to_x = 1 - fabs(Y), to_z = 1 - fabs(X), pole[1] = -1;
    double n = 0;
    for (int k = 0; k < 3; ++k) {
        d[k] = to_x * x[k] + to_z * z[k] + (1 - to_x - to_z) * pole[k];
        n += d[k] * d[k];
    }
    for (int k = 0; k < 3; ++k) d[k] /= sqrt(n);
}

/* Solid angle per area of (X,Y): 1 / |p|^3, where d = p / |p|. */
static inline double oracle_octahedral_density(const double d[3]) {
    return pow(fabs(d[0]) + fabs(d[1]) + fabs(d[2]), 3);
}

/* The inverse, derived apart; discs other than the paraboloids clamp to their rim. */
static inline void oracle_direction(double d[3], int mapping, int face, double u, double v) {
    double X = 2 * u - 1, Y = 1 - 2 * v, r = sqrt(X * X + Y * Y);
    if (mapping == ENVMAP_CUBE) {
        static const int signs[2] = {-1, 1};
        double c[3] = {1, 2 * u - 1, 2 * v - 1};
        for (int k = 0; k < 3; ++k) {
            int axis = oracle_cube[face][k];
            d[abs(axis) - 1] = signs[axis > 0] * c[k];
        }
        double n = sqrt(1 + c[1] * c[1] + c[2] * c[2]);
        for (int k = 0; k < 3; ++k) d[k] /= n;
    } else if (mapping == ENVMAP_PARABOLOID) {
        double s = 1 + r * r;
        d[0] = 2 * X / s, d[1] = 2 * Y / s, d[2] = (face ? -1 : 1) * (1 - r * r) / s;
    } else if (mapping == ENVMAP_LATLONG) {
        double a = 2 * PI * (u - 0.5), t = PI * v;
        d[0] = sin(a) * sin(t), d[1] = cos(t), d[2] = -cos(a) * sin(t);
    } else if (mapping == ENVMAP_OCTAHEDRAL) {
        oracle_octahedral(d, X, -Y);
    } else {
        if (r > 1) X /= r, Y /= r, r = 1;
        if (mapping == ENVMAP_SPHERE) {
            double nz = sqrt(1 - r * r);
            d[0] = 2 * nz * X, d[1] = 2 * nz * Y, d[2] = 2 * nz * nz - 1;
        } else {
            double s = r > 0 ? sin(PI * r) / r : PI;
            d[0] = s * X, d[1] = s * Y, d[2] = -cos(PI * r);
        }
    }
}

static inline double oracle_angle(const double a[3], const double b[3]) {
    double c[3] = {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2],
                   a[0] * b[1] - a[1] * b[0]};
    return atan2(sqrt(c[0] * c[0] + c[1] * c[1] + c[2] * c[2]),
                 a[0] * b[0] + a[1] * b[1] + a[2] * b[2]);
}

static inline double oracle_angle_f(const float a[3], const float b[3]) {
    double p[3] = {(double)a[0], (double)a[1], (double)a[2]};
    double q[3] = {(double)b[0], (double)b[1], (double)b[2]};
    return oracle_angle(p, q);
}

/* ----------------------------------------------------------------------------- solid angles -- */

static inline double oracle_dot(const double a[3], const double b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* Solid angle of a triangle of unit vectors: Van Oosterom and Strackee 1983. */
static inline double oracle_triangle(const double a[3], const double b[3], const double c[3]) {
    double det = a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) +
                 a[2] * (b[0] * c[1] - b[1] * c[0]);
    return 2 * atan2(fabs(det), 1 + oracle_dot(a, b) + oracle_dot(b, c) + oracle_dot(c, a));
}

/* A triangle of (X,Y) on an octahedral map, divided until no fold crosses it. */
static inline double oracle_folded(const double p[2], const double q[2], const double r[2]) {
    const double *corner[3] = {p, q, r};
    for (int k = 0; k < 9; ++k) {
        const double *a = corner[k % 3], *b = corner[(k + 1) % 3], *c = corner[(k + 2) % 3];
        double from = k < 6 ? a[k / 3] : fabs(a[0]) + fabs(a[1]) - 1, middle[2];
        double to = k < 6 ? b[k / 3] : fabs(b[0]) + fabs(b[1]) - 1;
        if (!(from < -1e-12 && to > 1e-12) && !(from > 1e-12 && to < -1e-12)) continue;
        for (int i = 0; i < 2; ++i) middle[i] = a[i] + from / (from - to) * (b[i] - a[i]);
        return oracle_folded(a, middle, c) + oracle_folded(middle, b, c);
    }
    double d[3][3];
    for (int k = 0; k < 3; ++k) oracle_octahedral(d[k], corner[k][0], corner[k][1]);
    return oracle_triangle(d[0], d[1], d[2]);
}

/* ---------------------------------------------------------------------------------- scenes -- */

static inline void oracle_random_direction(double d[3], unsigned long long *state) {
    double z = 2 * test_random(state) - 1, a = 2 * PI * test_random(state), s = sqrt(1 - z * z);
    d[0] = s * cos(a), d[1] = s * sin(a), d[2] = z;
}

/* Some unit vector at right angles to d, turned by an angle. */
static inline void oracle_tangent(double t[3], const double d[3], double angle) {
    double h[3] = {fabs(d[0]) < 0.6, 0, fabs(d[0]) >= 0.6};
    double a[3] = {h[1] * d[2] - h[2] * d[1], h[2] * d[0] - h[0] * d[2], h[0] * d[1] - h[1] * d[0]};
    double n = sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]);
    for (int k = 0; k < 3; ++k) a[k] /= n;
    double b[3] = {d[1] * a[2] - d[2] * a[1], d[2] * a[0] - d[0] * a[2], d[0] * a[1] - d[1] * a[0]};
    for (int k = 0; k < 3; ++k) t[k] = cos(angle) * a[k] + sin(angle) * b[k];
}

static inline int oracle_width(int mapping, int edge) {
    return mapping == ENVMAP_LATLONG ? 2 * edge : edge;
}

static inline int oracle_edge(int size, int level) { return size >> level > 1 ? size >> level : 1; }

/* Samples of a level, all slices and faces, x 3. */
static inline size_t oracle_floats(int mapping, int size, int slices, int level) {
    static const size_t faces[] = {6, 2, 1, 1, 1, 1};
    size_t edge = (size_t)oracle_edge(size, level);
    return faces[mapping] * edge * (size_t)oracle_width(mapping, (int)edge) * (size_t)slices * 3;
}

static inline void oracle_noise(envmap *map, unsigned long long seed) {
    size_t n = 0;
    for (int l = 0; l < map->levels; ++l)
        n += oracle_floats(map->mapping, map->size, map->slices, l);
    for (size_t i = 0; i < n; ++i) map->texels[i] = (float)test_random(&seed);
}

static inline void oracle_fill(envmap *map, int level, double (*f)(const double d[3], int channel)) {
    int edge = oracle_edge(map->size, level), width = oracle_width(map->mapping, edge);
    for (int s = 0; s < map->slices; ++s)
        for (int face = 0; face < envmap_faces(map->mapping); ++face)
            for (int y = 0; y < edge; ++y)
                for (int x = 0; x < width; ++x) {
                    double d[3];
                    oracle_direction(d, map->mapping, face, (x + 0.5) / width, (y + 0.5) / edge);
                    float *t = envmap_texel(map, level, s, face, x, y);
                    for (int c = 0; c < 3; ++c) t[c] = (float)f(d, c);
                }
}

static inline double oracle_one(const double d[3], int channel) {
    (void)d;
    return 1 + channel;
}

/* Smooth, of no symmetry, positive: 2 + a linear, a quadratic and a cubic part. */
static inline double oracle_smooth(const double d[3], int channel) {
    double x = d[channel], y = d[(channel + 1) % 3], z = d[(channel + 2) % 3];
    return 2 + 0.4 * x + 0.3 * x * y + 0.3 * z * z * y - 0.2 * z;
}

#endif
