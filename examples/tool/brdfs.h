/* brdfs.h - reflection models as callbacks for envmap_radiance and envmap_fit_brdf, each the
   formula of its paper. v and l are in the frame x = t, y = n x t, z = n.

   Include after envmap.h; every function is static inline.

   SPDX-License-Identifier: MIT */

#ifndef BRDFS_H
#define BRDFS_H

#include <math.h>

#define BRDF_PI 3.14159265358979323846

/* What the models are made with; each uses some of it. */
typedef struct brdf_values {
    double colour[3]; /* albedo, or f0 */
    double alpha;     /* roughness along t, or of both ways */
    double alpha_y;   /* along n x t */
    double exponent;  /* N */
    double s;         /* Banks */
    int fresnel;      /* GGX: 1: Schlick's term; 0: 1 */
} brdf_values;

static inline void brdf_grey(double f[3], double value) { f[0] = f[1] = f[2] = value; }

static inline double brdf_dot(const double a[3], const double b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static inline void brdf_half(double h[3], const double v[3], const double l[3]) {
    double length;
    int i;
    for (i = 0; i < 3; ++i) h[i] = v[i] + l[i];
    length = sqrt(brdf_dot(h, h));
    for (i = 0; i < 3; ++i) h[i] /= length > 0 ? length : 1;
}

/* r_v.l */
static inline double brdf_reflected(const double v[3], const double l[3]) {
    return v[2] * l[2] - v[0] * l[0] - v[1] * l[1];
}

static inline void brdf_lambert(double f[3], const double v[3], const double l[3], void *user) {
    int c;
    (void)v, (void)l;
    for (c = 0; c < 3; ++c) f[c] = ((const brdf_values *)user)->colour[c] / BRDF_PI;
}

/* The original, in which n.l does not occur: max(r.l,0)^N / n.l */
static inline void brdf_phong(double f[3], const double v[3], const double l[3], void *user) {
    double x = brdf_reflected(v, l);
    brdf_grey(f, x > 0 ? pow(x, ((const brdf_values *)user)->exponent) / l[2] : 0);
}

/* Made reciprocal, as Lafortune, Foo, Torrance and Greenberg have it (1997, their eq. 4 and the
   example of its generalised form with C_x = C_y = -1, C_z = 1). */
static inline void brdf_lafortune(double f[3], const double v[3], const double l[3], void *user) {
    const brdf_values *b = (const brdf_values *)user;
    double x = brdf_reflected(v, l);
    brdf_grey(f, x > 0 ? (b->exponent + 2) / (2 * BRDF_PI) * pow(x, b->exponent) : 0);
}

/* Cook-Torrance with GGX, height-correlated Smith [Heitz14]. */
static inline void brdf_ggx(double f[3], const double v[3], const double l[3], void *user) {
    const brdf_values *b = (const brdf_values *)user;
    double h[3], aa = b->alpha * b->alpha, q, value, vh;
    int c;
    brdf_half(h, v, l);
    q = (aa - 1) * h[2] * h[2] + 1;
    value = aa / (BRDF_PI * q * q) * 0.5 /
            (l[2] * sqrt(aa + (1 - aa) * v[2] * v[2]) + v[2] * sqrt(aa + (1 - aa) * l[2] * l[2]));
    vh = brdf_dot(v, h);
    for (c = 0; c < 3; ++c)
        f[c] = value * (b->fresnel ? envmap_fresnel_schlick(vh, b->colour[c]) : 1);
}

/* Ward 1992, eqs. 3 (isotropic) and 5. */
static inline void brdf_ward(double f[3], const double v[3], const double l[3], void *user) {
    const brdf_values *b = (const brdf_values *)user;
    double h[3], x, y;
    brdf_half(h, v, l);
    x = h[0] / (h[2] * b->alpha), y = h[1] / (h[2] * b->alpha_y);
    brdf_grey(f, exp(-x * x - y * y) / (4 * BRDF_PI * b->alpha * b->alpha_y * sqrt(v[2] * l[2])));
}

/* Oren and Nayar 1994, eq. 30 (the simpler model); sigma = alpha. */
static inline void brdf_oren_nayar(double f[3], const double v[3], const double l[3], void *user) {
    const brdf_values *b = (const brdf_values *)user;
    double ss = b->alpha * b->alpha, across = v[0] * l[0] + v[1] * l[1];
    double steep = v[2] > l[2] ? v[2] : l[2]; /* cos dphi sin a tan b = (v_xy . l_xy) / cos b */
    int c;
    for (c = 0; c < 3; ++c)
        f[c] = b->colour[c] / BRDF_PI *
               (1 - 0.5 * ss / (ss + 0.33) +
                0.45 * ss / (ss + 0.09) * (across > 0 ? across : 0) / steep);
}

/* Banks, as the prefiltered map has it: no n.l in it, but the horizon. */
static inline void brdf_banks(double f[3], const double v[3], const double l[3], void *user) {
    double s = ((const brdf_values *)user)->s;
    double k = sqrt(fmax((1 - l[0] * l[0]) * (1 - v[0] * v[0]), 0)) - l[0] * v[0] - s;
    brdf_grey(f, k > 0 ? k / ((1 - s) * (1 - s)) / l[2] : 0);
}

/* The same times n.l: the self-shadowing that the map drops. */
static inline void brdf_banks_shadowed(double f[3], const double v[3], const double l[3],
                                       void *user) {
    int c;
    brdf_banks(f, v, l, user);
    for (c = 0; c < 3; ++c) f[c] *= l[2];
}

#endif /* BRDFS_H */
