/* SPDX-License-Identifier: MIT
   The tests' second opinion on lobes and filters: quadrature, real spherical harmonics, the lobes
   as functions of the angle, and the plain sum over texels. Written from the formulas in other
   variables than the header's bodies use: angles instead of cosines, and long double where
   differences are taken. */
#ifndef ZONAL_H
#define ZONAL_H

#include "oracle.h"

#define PI_L 3.14159265358979323846264338327950288L

/* ---------------------------------------------------------------------------- quadrature ---- */

/* Gauss-Legendre on [-1,1]: Newton on P_n from Tricomi's first guess. */
static inline void o_gauss(int n, double *x, double *w) {
    for (int i = 0; i < n; ++i) {
        double t = cos(PI * (i + 0.75) / (n + 0.5)), slope = 1;
        for (int step = 0; step < 50; ++step) {
            double p0 = 1, p1 = t;
            for (int l = 2; l <= n; ++l) {
                double p2 = ((2 * l - 1) * t * p1 - (l - 1) * p0) / l;
                p0 = p1;
                p1 = p2;
            }
            slope = n * (t * p1 - p0) / (t * t - 1);
            double move = p1 / slope;
            t -= move;
            if (fabs(move) < 1e-16) break;
        }
        x[i] = t;
        w[i] = 2 / ((1 - t * t) * slope * slope);
    }
}

/* Real spherical harmonic, orthonormal, polar axis z. Y_00 = 1/sqrt(4 pi). */
static inline double o_harmonic(int l, int m, const double d[3]) {
    double x = d[2], s = sqrt(d[0] * d[0] + d[1] * d[1]), phi = atan2(d[1], d[0]);
    int k = abs(m);
    double below = 0, value = sqrt(1 / (4 * PI)); /* the normalised Legendre function, upwards */
    for (int i = 1; i <= k; ++i) value *= s * sqrt((2.0 * i + 1) / (2.0 * i));
    for (int i = k + 1; i <= l; ++i) {
        double a = sqrt((4.0 * i * i - 1) / ((double)i * i - (double)k * k));
        double b = sqrt(((i - 1.0) * (i - 1.0) - (double)k * k) / (4 * (i - 1.0) * (i - 1.0) - 1));
        double up = a * (x * value - (i == k + 1 ? 0 : b * below));
        below = value;
        value = up;
    }
    if (m > 0) return sqrt(2.0) * value * cos(k * phi);
    if (m < 0) return sqrt(2.0) * value * sin(k * phi);
    return value;
}

/* --------------------------------------------------------------------------------- lobes ---- */

enum { O_PHONG, O_GAUSSIAN, O_GGX, O_BANKS };

typedef struct o_lobe {
    int kind;
    double n; /* N, lambda, alpha or s */
} o_lobe;

/* k at an angle t in [0, pi]. */
static inline long double o_k(o_lobe lobe, long double t, double p) {
    long double n = (long double)lobe.n, half = sinl(t / 2), v = 2 * half * half; /* 1 - cos t */
    if (lobe.kind == O_PHONG) {
        if (t >= PI_L / 2) return 0;
        return n > 0 ? expl(n * log1pl(-v)) : 1;
    }
    if (lobe.kind == O_GAUSSIAN) return expl(-n * v);
    if (lobe.kind == O_GGX) {
        long double q = n * n * (1 - v / 2) + v / 2;
        return t < PI_L / 2 ? n * n / (PI_L * q * q) * (1 - v) : 0;
    }
    long double ring = PI_L - acosl((long double)p), d = sinl((t - ring) / 2);
    long double k = (1 - n) - 2 * d * d;
    return k > 0 ? k / ((1 - n) * (1 - n)) : 0;
}

static inline double o_ring(double p) { return PI - acos(p); }

/* Where k or its slope jumps, from the formulas: the horizon, the edges of the ring, the tip of the
   cone at 0 or pi where the ring covers it. */
static inline int o_kinks(double *angles, o_lobe lobe, double p) {
    int count = 0;
    if (lobe.kind == O_GGX || (lobe.kind == O_PHONG && lobe.n <= 1)) angles[count++] = PI / 2;
    if (lobe.kind == O_BANKS) {
        double ring = o_ring(p), half = acos(lobe.n);
        if (ring - half < 0 && fabs(p) < 1) angles[count++] = 0;
        if (ring - half > 0) angles[count++] = ring - half;
        if (ring + half < PI) angles[count++] = ring + half;
        if (ring + half > PI && fabs(p) < 1) angles[count++] = PI;
    }
    return count;
}

static inline void o_support(double *from, double *to, o_lobe lobe, double p) {
    *from = 0;
    *to = PI;
    if (lobe.kind == O_PHONG || lobe.kind == O_GGX) *to = PI / 2;
    if (lobe.kind == O_PHONG && 12 / sqrt(lobe.n) < *to) *to = 12 / sqrt(lobe.n);
    if (lobe.kind == O_GAUSSIAN && 12 / sqrt(lobe.n) < *to) *to = 12 / sqrt(lobe.n);
    if (lobe.kind == O_BANKS) {
        double ring = o_ring(p), half = acos(lobe.n);
        if (ring - half > 0) *from = ring - half;
        if (ring + half < PI) *to = ring + half;
    }
}

/* Half the width of where k exceeds e^(-1/2) of the peak. */
static inline double o_sigma(o_lobe lobe, double p) {
    if (lobe.kind == O_PHONG)
        return lobe.n > 0 ? 2 * asin(sqrt(-expm1(-0.5 / lobe.n) / 2)) : PI / 2;
    if (lobe.kind == O_GAUSSIAN) return lobe.n > 0.25 ? 2 * asin(sqrt(0.25 / lobe.n)) : PI;
    if (lobe.kind == O_BANKS) return 2 * asin(sqrt((1 - exp(-0.5)) * (1 - lobe.n) / 2));
    long double low = 0, high = PI_L / 2, aim = expl(-0.5L) * o_k(lobe, 0, p);
    for (int i = 0; i < 100; ++i) {
        long double middle = (low + high) / 2;
        if (o_k(lobe, middle, p) > aim)
            low = middle;
        else
            high = middle;
    }
    return (double)low;
}

/* moments[l] = 2 pi integral of k^power P_l sin t dt, l = 0 .. bands-1. Panels of 16 Gauss nodes,
   no wider than a lobe's detail or half a wave of P_l, halving towards the horizon where cos^N has
   a root there. */
static inline void o_moments(double *moments, int bands, o_lobe lobe, double p, int power) {
    double node[16], weight[16], from, to, sigma = o_sigma(lobe, p);
    o_gauss(16, node, weight);
    o_support(&from, &to, lobe, p);
    for (int l = 0; l < bands; ++l) moments[l] = 0;
    double a = from, last = lobe.kind == O_PHONG && lobe.n < 3 ? (to - from) * 1e-9 : 0;
    while (a < to) {
        double step = lobe.kind == O_BANKS ? (to - from) / 8 : 0.5 * sigma + 0.3 * a;
        if (step > 3.0 / bands) step = 3.0 / bands;
        if (last > 0 && step > (to - a) / 2) step = (to - a) / 2;
        double b = a + step;
        if (b > to || to - b < 1e-3 * step || to - b < last) b = to;
        for (int i = 0; i < 16; ++i) {
            double t = 0.5 * (a + b) + 0.5 * (b - a) * node[i], x = cos(t), p0 = 1, p1 = x;
            double k = (double)o_k(lobe, (long double)t, p);
            double f = 2 * PI * 0.5 * (b - a) * weight[i] * (power == 2 ? k * k : k) * sin(t);
            for (int l = 0; l < bands; ++l) {
                moments[l] += f * p0;
                double p2 = ((2 * l + 3) * x * p1 - (l + 1) * p0) / (l + 2);
                p0 = p1;
                p1 = p2;
            }
        }
        a = b;
    }
}

static inline double o_integral(o_lobe lobe, double p) {
    double integral;
    o_moments(&integral, 1, lobe, p, 1);
    return integral;
}

/* What a normalised filter divides by, in the limit of fine texels. */
static inline double o_norm(o_lobe lobe, double p) {
    return o_integral(lobe, lobe.kind == O_BANKS ? 0 : p);
}

/* -------------------------------------------------------------------------------- the sum ---- */

static inline double o_corner(double x, double y) { return atan2(x * y, sqrt(1 + x * x + y * y)); }

/* The part of a disc's texel [a,b] x [c,d] inside the rim: its solid angle by Gauss, in strips cut
   where the rim crosses the texel's sides, and its centroid on the disc. */
static inline double o_disc_texel(double *u, double *v, int mapping, double a, double b, double c,
                                  double d) {
    double node[16], weight[16], cut[6] = {a, b, 0, 0, 0, 0}, omega = 0, area = 0, su = 0, sv = 0;
    int cuts = 2;
    o_gauss(16, node, weight);
    for (int i = 0; i < 4; ++i) {
        double e = i & 1 ? c : d, at = (i & 2 ? 1 : -1) * sqrt(e * e < 1 ? 1 - e * e : 0);
        if (at > a && at < b) cut[cuts++] = at;
    }
    for (int i = 0; i < cuts; ++i)
        for (int j = i + 1; j < cuts; ++j)
            if (cut[j] < cut[i]) {
                double swap = cut[i];
                cut[i] = cut[j];
                cut[j] = swap;
            }
    for (int i = 0; i + 1 < cuts; ++i)
        for (int j = 0; j < 16; ++j) {
            /* X = middle + half sin q: the rim's root at a strip's end becomes smooth */
            double q = PI / 2 * node[j], half = 0.5 * (cut[i + 1] - cut[i]);
            double X = 0.5 * (cut[i] + cut[i + 1]) + half * sin(q);
            double dX = PI / 2 * weight[j] * half * cos(q), rim = X * X < 1 ? sqrt(1 - X * X) : 0;
            double low = c > -rim ? c : -rim, high = d < rim ? d : rim;
            if (high <= low) continue;
            area += dX * (high - low);
            su += dX * (high - low) * X;
            sv += dX * (high - low) * 0.5 * (low + high);
            for (int k = 0; k < 16; ++k) {
                double Y = 0.5 * (low + high) + 0.5 * (high - low) * node[k];
                double r = sqrt(X * X + Y * Y), density = 4; /* the sphere map's */
                if (mapping == ENVMAP_PARABOLOID) density = 4 / ((1 + r * r) * (1 + r * r));
                if (mapping == ENVMAP_ANGULAR) density = r > 1e-9 ? PI * sin(PI * r) / r : PI * PI;
                omega += dX * 0.5 * (high - low) * weight[k] * density;
            }
        }
    if (!(area > 0)) return 0;
    if (area < (b - a) * (d - c) * (1 - 1e-9)) {
        *u = 0.5 + 0.5 * su / area;
        *v = 0.5 + 0.5 * sv / area;
    }
    return omega;
}

/* Solid angle of texel (x,y), and in (*u,*v) the point that stands for it: its centre, or the
   centroid of the part inside a disc's rim. */
static inline double o_texel(double *u, double *v, int mapping, int size, int x, int y) {
    int width = oracle_width(mapping, size);
    double a = 2.0 * x / size - 1, b = 2.0 * (x + 1) / size - 1;
    double c = 2.0 * y / size - 1, d = 2.0 * (y + 1) / size - 1;
    *u = (x + 0.5) / width;
    *v = (y + 0.5) / size;
    if (mapping == ENVMAP_CUBE)
        return o_corner(b, d) - o_corner(a, d) - o_corner(b, c) + o_corner(a, c);
    if (mapping == ENVMAP_LATLONG)
        return 2 * PI / width * (cos(PI * y / size) - cos(PI * (y + 1) / size));
    if (mapping == ENVMAP_OCTAHEDRAL) {
        double p[4][2] = {{a, c}, {b, c}, {b, d}, {a, d}};
        return oracle_folded(p[0], p[1], p[2]) + oracle_folded(p[0], p[2], p[3]);
    }
    return o_disc_texel(u, v, mapping, a, b, c, d);
}

/* Every texel of a map's level 0 as direction, solid angle and radiance. */
typedef struct o_source {
    int count;
    double *d;     /* [count][3] */
    double *rgb;   /* [count][3] */
    double *omega; /* [count]    */
} o_source;

static inline void o_source_make(o_source *s, const envmap *map) {
    int width = oracle_width(map->mapping, map->size), faces = envmap_faces(map->mapping), i = 0;
    s->count = faces * width * map->size;
    s->d = (double *)calloc((size_t)s->count, 3 * sizeof(double));
    s->rgb = (double *)calloc((size_t)s->count, 3 * sizeof(double));
    s->omega = (double *)calloc((size_t)s->count, sizeof(double));
    for (int face = 0; face < faces; ++face)
        for (int y = 0; y < map->size; ++y)
            for (int x = 0; x < width; ++x, ++i) {
                double u, v;
                const float *texel = envmap_texel(map, 0, 0, face, x, y);
                s->omega[i] = o_texel(&u, &v, map->mapping, map->size, x, y);
                oracle_direction(s->d + 3 * i, map->mapping, face, u, v);
                for (int c = 0; c < 3; ++c) s->rgb[3 * i + c] = (double)texel[c];
            }
}

static inline void o_source_free(o_source *s) {
    free(s->d);
    free(s->rgb);
    free(s->omega);
}

/* sum k w L / norm; norm 0: sum k w, the normalised filter. */
static inline void o_sum(double rgb[3], const o_source *s, o_lobe lobe, double p,
                         const double axis[3], double norm) {
    double total = 0, sum[3] = {0, 0, 0};
    for (int i = 0; i < s->count; ++i) {
        double t = oracle_angle(axis, s->d + 3 * i);
        double k = (double)o_k(lobe, (long double)t, p) * s->omega[i];
        total += k;
        for (int c = 0; c < 3; ++c) sum[c] += k * s->rgb[3 * i + c];
    }
    for (int c = 0; c < 3; ++c) rgb[c] = sum[c] / (norm > 0 ? norm : total);
}

#endif
