/* SPDX-License-Identifier: MIT
   The definition of what the calls compute, a second time: own directions (oracle.h), own solid
   angles, own lookups, own lobes, and sums in plain double loops over all texels. Nothing here
   calls the header. Slow, and meant to be read beside the conventions of envmap.h.

     L(a) = sum_i k(a.l_i; p) L_i w_i / norm      sigma >= 2 mean texels of the source
     below that, texels become tents, and then the bilinear radiance: see oracle_axis. */
#ifndef SEARCH_ORACLE_H
#define SEARCH_ORACLE_H

#include "oracle.h"

/* ------------------------------------------------------------------------------ quadrature -- */

/* Gauss-Legendre on [-1,1]: roots of P_n by Newton's steps. */
static void oracle_gauss(double *x, double *w, int n) {
    for (int i = 0; i < n; ++i) {
        double z = cos(PI * (i + 0.75) / (n + 0.5)), slope = 1;
        for (int step = 0; step < 60; ++step) {
            double p = 1, before = 0;
            for (int l = 0; l < n; ++l) {
                double next = ((2 * l + 1) * z * p - l * before) / (l + 1);
                before = p, p = next;
            }
            slope = n * (z * p - before) / (z * z - 1);
            if (fabs(p / slope) < 1e-16) break;
            z -= p / slope;
        }
        x[i] = z, w[i] = 2 / ((1 - z * z) * slope * slope);
    }
}

static double oracle_clamp(double x, double low, double high) {
    return x < low ? low : x > high ? high : x;
}

/* ----------------------------------------------------------------------------- solid angles -- */

static int oracle_faces(int mapping) {
    static const int faces[] = {6, 2, 1, 1, 1, 1};
    return faces[mapping];
}

/* d(solid angle) / dX dY of a disc mapping. */
static double oracle_density(int mapping, double rr) {
    double r = sqrt(rr);
    if (mapping == ENVMAP_SPHERE) return 4;
    if (mapping == ENVMAP_PARABOLOID) return 4 / ((1 + rr) * (1 + rr));
    return r > 1e-9 ? PI * sin(PI * r) / r : PI * PI;
}

/* sum[0..3] = solid angle, area and first moments in X and Y of the part of [x0,x1] x [y0,y1]
   inside the unit circle. X = sin t makes the circle's ends smooth; panels end where the circle
   meets the rectangle's sides. */
static void oracle_disc_part(double sum[4], int mapping, const double low[2], const double high[2],
                             int nodes) {
    double x[24], w[24], ends[6];
    ends[0] = asin(oracle_clamp(low[0], -1, 1)), ends[5] = asin(oracle_clamp(high[0], -1, 1));
    for (int i = 0; i < 4; ++i) {
        double meet = acos(oracle_clamp(fabs(i & 1 ? low[1] : high[1]), 0, 1));
        ends[1 + i] = oracle_clamp(i & 2 ? meet : -meet, ends[0], ends[5]);
    }
    for (int i = 1; i < 5; ++i)
        for (int j = i; j > 1 && ends[j] < ends[j - 1]; --j) {
            double swap = ends[j];
            ends[j] = ends[j - 1], ends[j - 1] = swap;
        }
    oracle_gauss(x, w, nodes);
    for (int i = 0; i < 4; ++i) sum[i] = 0;
    for (int panel = 0; panel < 5; ++panel)
        for (int i = 0; ends[panel + 1] > ends[panel] && i < nodes; ++i) {
            double half = (ends[panel + 1] - ends[panel]) / 2, t = ends[panel] + half * (1 + x[i]);
            double X = sin(t), from = fmax(low[1], -cos(t)), to = fmin(high[1], cos(t));
            for (int j = 0; to > from && j < nodes; ++j) {
                double Y = from + (to - from) / 2 * (1 + x[j]);
                double area = half * w[i] * cos(t) * (to - from) / 2 * w[j];
                sum[0] += area * oracle_density(mapping, X * X + Y * Y);
                sum[1] += area, sum[2] += area * X, sum[3] += area * Y;
            }
        }
}

/* A texel: its solid angle, where on the face it counts, and the direction there. */
typedef struct oracle_texel {
    double d[3], w, u, v;
    int face, x, y;
} oracle_texel;

static double oracle_quad(int mapping, int face, double u0, double v0, double u1, double v1) {
    double a[3], b[3], c[3], d[3];
    oracle_direction(a, mapping, face, u0, v0), oracle_direction(b, mapping, face, u1, v0);
    oracle_direction(c, mapping, face, u1, v1), oracle_direction(d, mapping, face, u0, v1);
    return oracle_triangle(a, b, c) + oracle_triangle(a, c, d);
}

/* Solid angle of the rectangle [u0,u1] x [v0,v1] of a face; (u, v) becomes the centroid of its part
   inside where a rim cuts it. */
static double oracle_cell(double *u, double *v, int mapping, int face, double u0, double v0,
                          double u1, double v1) {
    *u = (u0 + u1) / 2, *v = (v0 + v1) / 2;
    if (mapping == ENVMAP_CUBE) return oracle_quad(mapping, face, u0, v0, u1, v1);
    if (mapping == ENVMAP_LATLONG) return 2 * PI * (u1 - u0) * (cos(PI * v0) - cos(PI * v1));
    double low[2] = {2 * u0 - 1, 1 - 2 * v1}, high[2] = {2 * u1 - 1, 1 - 2 * v0}, sum[4];
    if (mapping == ENVMAP_OCTAHEDRAL) { /* a map that is its mirror image along Y */
        double one[2] = {low[0], high[1]}, other[2] = {high[0], low[1]};
        return oracle_folded(low, one, high) + oracle_folded(low, other, high);
    }
    double far_x = fmax(fabs(low[0]), fabs(high[0])), far_y = fmax(fabs(low[1]), fabs(high[1]));
    oracle_disc_part(sum, mapping, low, high, u1 - u0 > 0.07 ? 24 : 6);
    if (!(sum[1] > 1e-15)) return 0;
    if (far_x * far_x + far_y * far_y > 1)
        *u = 0.5 + 0.5 * sum[2] / sum[1], *v = 0.5 - 0.5 * sum[3] / sum[1];
    return sum[0];
}

static size_t oracle_count(int mapping, int size) { return oracle_floats(mapping, size, 1, 0) / 3; }

/* All texels of a level of edge `size`, in memory order. */
static oracle_texel *oracle_texels(int mapping, int size) {
    int width = oracle_width(mapping, size);
    oracle_texel *texels = (oracle_texel *)malloc(oracle_count(mapping, size) * sizeof *texels);
    oracle_texel *t = texels;
    for (int face = 0; texels && face < oracle_faces(mapping); ++face)
        for (int y = 0; y < size; ++y)
            for (int x = 0; x < width; ++x, ++t) {
                t->face = face, t->x = x, t->y = y;
                t->w = oracle_cell(&t->u, &t->v, mapping, face, (double)x / width, (double)y / size,
                                   (x + 1.0) / width, (y + 1.0) / size);
                oracle_direction(t->d, mapping, face, t->u, t->v);
            }
    return texels;
}

/* The axis of a result's texel: its centre, in the extended domain outside a rim. */
static void oracle_axis_of(double d[3], int mapping, int size, const oracle_texel *t) {
    oracle_direction(d, mapping, t->face, (t->x + 0.5) / oracle_width(mapping, size),
                     (t->y + 0.5) / size);
}

/* The edge of the mean texel of a map, rad. */
static double oracle_extent(int mapping, int size) {
    double texels = (double)oracle_count(mapping, size);
    return sqrt(4 * PI / (oracle_is_disc(mapping) ? texels * PI / 4 : texels));
}

/* ---------------------------------------------------------------------------------- lookups -- */

/* One level of one slice, as lookups see it. */
typedef struct oracle_image {
    const float *texels;
    int mapping, size, width;
    double pole[2][3]; /* lat-long: the means of the first and the last row */
} oracle_image;

static oracle_image oracle_image_of(const float *texels, int mapping, int size) {
    oracle_image image;
    memset(&image, 0, sizeof image);
    image.texels = texels, image.mapping = mapping, image.size = size;
    image.width = oracle_width(mapping, size);
    for (int i = 0; mapping == ENVMAP_LATLONG && i < 6 * image.width; ++i) {
        int last = i >= 3 * image.width, at = last ? i - 3 * image.width : i;
        size_t row = last ? (size_t)(3 * image.width) * (size_t)(size - 1) : 0;
        image.pole[last][at % 3] += (double)texels[row + (size_t)at] / image.width;
    }
    return image;
}

/* Texel (x,y) may lie off its face by one: over a cube's edge it is the texel of the next face that
   touches it, over an octahedral map's that which has its centre there, lat-long wraps, discs clamp
   to texels inside their rim. */
static void oracle_tap(double rgb[3], const oracle_image *image, int face, int x, int y,
                       double weight) {
    int n = image->size, width = image->width;
    if (image->mapping == ENVMAP_CUBE && (x < 0 || y < 0 || x >= n || y >= n)) {
        double d[3], u, v, hair = 1e-9;
        oracle_direction(d, ENVMAP_CUBE, face,
                         x < 0    ? -hair
                         : x >= n ? 1 + hair
                                  : (x + 0.5) / n,
                         y < 0    ? -hair
                         : y >= n ? 1 + hair
                                  : (y + 0.5) / n);
        oracle_coordinates(&face, &u, &v, ENVMAP_CUBE, d);
        x = (int)(u * n), y = (int)(v * n);
    }
    if (image->mapping == ENVMAP_OCTAHEDRAL && (x < 0 || y < 0 || x >= n || y >= n)) {
        double d[3], u, v;
        oracle_direction(d, ENVMAP_OCTAHEDRAL, 0, (x + 0.5) / n, (y + 0.5) / n);
        oracle_coordinates(&face, &u, &v, ENVMAP_OCTAHEDRAL, d);
        x = (int)(u * n), y = (int)(v * n);
    }
    if (image->mapping == ENVMAP_LATLONG) x = (x + width) % width;
    x = x < 0 ? 0 : x >= width ? width - 1 : x;
    y = y < 0 ? 0 : y >= n ? n - 1 : y;
    if (image->mapping == ENVMAP_SPHERE || image->mapping == ENVMAP_ANGULAR) {
        double X = (2 * x + 1.0) / n - 1, Y = (2 * y + 1.0) / n - 1, r = sqrt(X * X + Y * Y);
        if (r > 1) {
            x = (int)oracle_clamp(floor((0.5 + 0.5 * X * (1 - 1.5 / n) / r) * n), 0, n - 1);
            y = (int)oracle_clamp(floor((0.5 + 0.5 * Y * (1 - 1.5 / n) / r) * n), 0, n - 1);
        }
    }
    const float *t = image->texels + 3 * ((size_t)(face * n + y) * (size_t)width + (size_t)x);
    for (int c = 0; c < 3; ++c) rgb[c] += weight * (double)t[c];
}

static int oracle_off_corner(const oracle_image *image, int x, int y) {
    return image->mapping == ENVMAP_CUBE && (x < 0 || x >= image->size) &&
           (y < 0 || y >= image->size);
}

/* Bilinear at (u,v) of a face. The texel beyond a cube's corner is the mean of the three that meet
   there; from a lat-long's last row of centres on to the pole the row blends into its mean. */
static void oracle_bilinear(double rgb[3], const oracle_image *image, int face, double u, double v,
                            double weight) {
    double s = u * image->width - 0.5, t = v * image->size - 0.5, last = image->size - 1;
    if (image->mapping == ENVMAP_LATLONG && (t < 0 || t > last)) {
        double beyond = 2 * (t < 0 ? -t : t - last);
        for (int c = 0; c < 3; ++c) rgb[c] += weight * beyond * image->pole[t > 0][c];
        weight *= 1 - beyond, t = t < 0 ? 0 : last;
    }
    int x = (int)floor(s), y = (int)floor(t);
    double taps[4] = {(1 - s + x) * (1 - t + y), (s - x) * (1 - t + y), (1 - s + x) * (t - y),
                      (s - x) * (t - y)};
    double third = 0;
    for (int i = 0; i < 4; ++i)
        if (oracle_off_corner(image, x + (i & 1), y + (i >> 1))) third = taps[i] / 3;
    for (int i = 0; i < 4; ++i)
        if (!oracle_off_corner(image, x + (i & 1), y + (i >> 1)) && taps[i] + third > 0)
            oracle_tap(rgb, image, face, x + (i & 1), y + (i >> 1), weight * (taps[i] + third));
}

/* rgb += weight times the bilinear radiance from d. In the last half texel (in X and Y: one over
   the edge) before their rim the two paraboloids blend, to half and half on the rim. */
static void oracle_lookup(double rgb[3], const oracle_image *image, const double d[3],
                          double weight) {
    int face;
    double u, v, other = 0;
    oracle_coordinates(&face, &u, &v, image->mapping, d);
    if (image->mapping == ENVMAP_PARABOLOID) {
        double r = sqrt((1 - fabs(d[2])) / (1 + fabs(d[2]))), s = face ? 1 + d[2] : 1 - d[2];
        other = oracle_clamp(0.5 * (1 - (1 - r) * image->size), 0, 0.5);
        if (other > 0)
            oracle_bilinear(rgb, image, 1 - face, 0.5 + 0.5 * d[0] / s, 0.5 - 0.5 * d[1] / s,
                            weight * other);
    }
    oracle_bilinear(rgb, image, face, u, v, weight * (1 - other));
}

/* ------------------------------------------------------------------------------------ lobes -- */

/* Kinds of lobes; those from CONE on are functions. */
enum {
    LOBE_DIFFUSE, /* max(x,0)                                                                     */
    LOBE_PHONG,   /* max(x,0)^a                                                                   */
    LOBE_GAUSSIAN, /* exp(a (x-1))                                                                */
    LOBE_GGX,   /* D(sqrt((1+x)/2)) max(x,0), alpha = a                                         */
    LOBE_BANKS, /* s = a                                                                        */
    LOBE_TABLE, /* b rows, bells of widths near a and of heights that have nothing in common    */
    LOBE_CONE,  /* max(0, 1 - t/a): a kink at a                                                 */
    LOBE_POWER, /* x (1-x)^a above the horizon: a kink there                                    */
    LOBE_RING,  /* exp(-((t-b)/a)^2/2): a peak off the centre                                   */
    LOBE_TWO,   /* two peaks: one of width a in the centre, a third of it at b                  */
    LOBE_HAT,   /* negative parts: a bell of width a less a wider and lower one                 */
    LOBE_SLIDE, /* slices: a bell of width a (1 + b p)                                          */
    LOBE_COUNT
};

typedef struct oracle_lobe {
    int kind, raw;
    double a, b, scale, p0, p1;
    int rows, size; /* of the table */
    float *table;
    float kink;
} oracle_lobe;

static double oracle_bell(double t, double width) { return exp(-t * t / (2 * width * width)); }

/* The functions that are handed to the header. */
static double oracle_function(double x, double p, void *user) {
    const oracle_lobe *m = (const oracle_lobe *)user;
    double t = acos(oracle_clamp(x, -1, 1));
    switch (m->kind) {
    case LOBE_CONE: return fmax(0, 1 - t / m->a);
    case LOBE_POWER: return x > 0 ? x * pow(fmax(0, 1 - x), m->a) : 0;
    case LOBE_RING: return oracle_bell(t - m->b, m->a);
    case LOBE_TWO: return oracle_bell(t, m->a) + oracle_bell(t - m->b, m->a) / 3;
    case LOBE_HAT: return oracle_bell(t, m->a) - m->b * oracle_bell(t, 2 * m->a);
    default: return oracle_bell(t, m->a * (1 + m->b * p));
    }
}

/* Catmull-Rom along a row, even about both ends. */
static double oracle_row(const oracle_lobe *m, int row, double t) {
    double at = t / PI * (m->size - 1), k[4];
    int i = (int)at < m->size - 2 ? (int)at : m->size - 2;
    double f = at - i;
    for (int j = 0; j < 4; ++j) {
        int tap = abs(i + j - 1);
        if (tap > m->size - 1) tap = 2 * (m->size - 1) - tap;
        k[j] = (double)m->table[row * m->size + tap];
    }
    return k[1] + f / 2 *
                      (k[2] - k[0] +
                       f * (2 * k[0] - 5 * k[1] + 4 * k[2] - k[3] +
                            f * (3 * (k[1] - k[2]) + k[3] - k[0])));
}

/* Rows lie at the centres of slices of p; linear between, clamped beyond. */
static double oracle_table(const oracle_lobe *m, double x, double p) {
    double t = acos(oracle_clamp(x, -1, 1));
    double at = oracle_clamp((p - m->p0) / (m->p1 - m->p0) * m->rows - 0.5, 0, m->rows - 1);
    int row = (int)at;
    double k = oracle_row(m, row, t), f = at - row;
    return f > 0 ? (1 - f) * k + f * oracle_row(m, row + 1, t) : k;
}

/* k(x; p), without scale. */
static double oracle_k(const oracle_lobe *m, double x, double p) {
    double a = m->a, c2 = (1 + x) / 2, q, ring;
    switch (m->kind) {
    case LOBE_DIFFUSE: return x > 0 ? x : 0;
    case LOBE_PHONG: return x > 1e-12 ? pow(x, a) : 0; /* 0 on the horizon, in spite of rounding */
    case LOBE_GAUSSIAN: return exp(a * (x - 1));
    case LOBE_GGX: /* the denominator without cancellation: (a^2 - 1) c2 + 1 */
        q = a * a * c2 + (1 - x) / 2;
        return x > 0 ? a * a / (PI * q * q) * x : 0;
    case LOBE_BANKS:
        ring = sqrt(fmax(0, 1 - x * x)) * sqrt(fmax(0, 1 - p * p)) - x * p - a;
        return fmax(0, ring) / ((1 - a) * (1 - a));
    case LOBE_TABLE: return oracle_table(m, x, p);
    default: return oracle_function(x, p, (void *)(size_t)m);
    }
}

static double oracle_p(const oracle_lobe *m, int slice, int slices) {
    return m->p0 + (m->p1 - m->p0) * (slice + 0.5) / slices;
}

/* Half the width of the angles, about the peak, where k exceeds e^(-1/2) of it. */
static double oracle_sigma(const oracle_lobe *m, double p) {
    const int n = 20000;
    double low = 0, high = PI / 2, level = exp(-0.5), peak = -1;
    int at = 0, from, to;
    if (m->kind == LOBE_BANKS) return acos(m->a + level * (1 - m->a));
    if (m->kind == LOBE_GAUSSIAN) return m->a > 0.25 ? acos(1 - 0.5 / m->a) : PI;
    if (m->kind <= LOBE_GGX) { /* falls all the way to the horizon */
        if (m->kind == LOBE_PHONG && !(m->a > 0)) return PI / 2;
        for (int i = 0; i < 100; ++i) {
            double t = (low + high) / 2;
            if (oracle_k(m, cos(t), p) < level * oracle_k(m, 1, p)) high = t;
            else low = t;
        }
        return low;
    }
    for (int i = 0; i <= n; ++i) {
        double k = oracle_k(m, cos(PI * i / n), p);
        if (k > peak) peak = k, at = i;
    }
    for (from = at; from >= 0 && oracle_k(m, cos(PI * from / n), p) >= level * peak;) --from;
    for (to = at; to <= n && oracle_k(m, cos(PI * to / n), p) >= level * peak;) ++to;
    double ends[2] = {from, to};
    if (to > n) ends[1] = n;                           /* up to pi */
    for (int i = 0; i < (to > n ? 30 : 2 * 30); ++i) { /* between samples by halving */
        double in = i % 30 ? low : i ? to - 1 : from + 1, out = i % 30 ? high : i ? to : from;
        double middle = (in + out) / 2,
               inside = oracle_k(m, cos(PI * middle / n), p) >= level * peak;
        low = inside > 0 ? middle : in, high = inside > 0 ? out : middle;
        ends[i / 30] = low;
    }
    if (from >= 0 && to > n) return PI * (n - ends[0]) / n; /* about what is opposite to the axis */
    return from < 0 ? PI * ends[1] / n : PI * (ends[1] - ends[0]) / n / 2;
}

/* The angles that hold all of k: where it is zero, or below 1e-12 of its peak, is left out for the
   lobes of which that is known. */
static void oracle_support(double *from, double *to, const oracle_lobe *m, double p) {
    double tiny = 27.631, ring = acos(oracle_clamp(-p, -1, 1)), edge = acos(m->a);
    *from = 0, *to = PI;
    if (m->kind == LOBE_DIFFUSE || m->kind == LOBE_GGX) *to = PI / 2;
    if (m->kind == LOBE_PHONG) *to = m->a > 0 ? acos(exp(-tiny / m->a)) : PI / 2;
    if (m->kind == LOBE_GAUSSIAN && m->a > tiny / 2) *to = acos(1 - tiny / m->a);
    if (m->kind == LOBE_BANKS) *from = fmax(0, ring - edge), *to = fmin(PI, ring + edge);
}

/* lambda[l] = 2 pi integral of k P_l, l below bands, and 2 pi integral of k^2 and of |k|: panels as
   wide as a fraction of the lobe or of the angle, and of the highest band. */
static void oracle_zonal(double *lambda, double *square, double *size, int bands,
                         const oracle_lobe *m, double p) {
    double from, to, x[8], w[8], sigma = oracle_sigma(m, p) / 4;
    int off_centre = m->kind == LOBE_RING || m->kind == LOBE_TWO || m->kind == LOBE_BANKS;
    oracle_support(&from, &to, m, p), oracle_gauss(x, w, 8);
    for (int l = 0; l < bands; ++l) lambda[l] = 0;
    *square = *size = 0;
    for (double t = from, next; t < to; t = next) {
        double step = fmin(off_centre ? sigma : fmax(sigma, t / 4), 2.0 / (bands + 20));
        if (m->kind == LOBE_PHONG || m->kind == LOBE_POWER) /* a root, or worse, at the horizon */
            step = fmin(step, fmax(1e-9, fabs(PI / 2 - t) / 2));
        double kink = m->kind == LOBE_CONE ? (double)m->kink : PI / 2;
        next = m->kind == LOBE_TABLE ? t + PI / (m->size - 1) : t + step;
        if (t < kink && next > kink && m->kind != LOBE_TABLE) next = kink;
        if (next > to - 1e-3 * step) next = to;
        for (int i = 0; i < 8; ++i) {
            double theta = t + (next - t) / 2 * (1 + x[i]), z = cos(theta), P = 1, before = 0;
            double k = oracle_k(m, z, p), weight = PI * (next - t) * w[i] * sin(theta);
            *square += weight * k * k, *size += weight * fabs(k);
            for (int l = 0; l < bands; ++l) {
                double after = ((2 * l + 1) * z * P - l * before) / (l + 1);
                lambda[l] += weight * k * P;
                before = P, P = after;
            }
        }
    }
}

/* What is divided by: nothing (raw), Banks' integral at c = 0, or (0) the sum of k w. */
static double oracle_norm(const oracle_lobe *m) {
    double s = m->a;
    if (m->raw) return 1 / m->scale;
    if (m->kind != LOBE_BANKS) return 0;
    return 2 * PI * (acos(s) - s * sqrt(1 - s * s)) / ((1 - s) * (1 - s));
}

/* ------------------------------------------------------------------------------- the filter -- */

/* One slice of a source and the lobe that filters it. */
typedef struct oracle_filter {
    const oracle_texel *texels;
    size_t count;
    oracle_image image;
    const oracle_lobe *lobe;
    double p, sigma, flank, extent, from, to;
    double sight; /* beyond it k is below 1e-14 of its peak */
    double fine;  /* 1, or more for a finer quadrature of the bilinear radiance */
} oracle_filter;

static double oracle_step(double value, double from, double to) {
    double t = oracle_clamp((value - from) / (to - from), 0, 1);
    return t * t * (3 - 2 * t);
}

/* sum[0..2] += k L w, sum[3] += k w. */
static void oracle_add(double sum[4], const oracle_filter *f, size_t i, double k) {
    double kw = k * f->texels[i].w;
    for (int c = 0; c < 3; ++c) sum[c] += kw * (double)f->image.texels[3 * i + (size_t)c];
    sum[3] += kw;
}

/* Texels at their centres: all of them, or with `beyond` only what lies farther than that. */
static void oracle_centres(double sum[4], const oracle_filter *f, const double a[3],
                           double beyond) {
    double least = cos(f->to) - 1e-9; /* a shortcut only */
    for (size_t i = 0; i < f->count; ++i) {
        double x = oracle_dot(a, f->texels[i].d), step = 1;
        if (x < least || !(f->texels[i].w > 0)) continue;
        if (beyond > 0) step = oracle_step(acos(oracle_clamp(x, -1, 1)), beyond / 2, beyond);
        if (step > 0) oracle_add(sum, f, i, step * oracle_k(f->lobe, x, f->p));
    }
}

/* k, less what fades out to `reach`, averaged over a texel's tent of half-width `tent` texels:
   Gauss-Jacobi for the weight 1 - s on [0,1], two nodes a half. */
static double oracle_tent(const oracle_filter *f, const double a[3], const oracle_texel *t,
                          double tent, double reach) {
    const double at[2] = {(4 - sqrt(6.0)) / 10, (4 + sqrt(6.0)) / 10};
    const double weight[2] = {0.25 + sqrt(6.0) / 36, 0.25 - sqrt(6.0) / 36};
    double k = 0, d[3];
    for (int i = 0; i < 16; ++i) {
        double u = (i & 2 ? 1 : -1) * at[i & 1], v = (i & 8 ? 1 : -1) * at[i >> 2 & 1];
        oracle_direction(d, f->image.mapping, t->face, t->u + tent * u / f->image.width,
                         t->v + tent * v / f->image.size);
        double x = oracle_dot(a, d), whole = weight[i & 1] * weight[i >> 2 & 1];
        if (f->to > reach) whole *= 1 - oracle_step(acos(oracle_clamp(x, -1, 1)), reach / 2, reach);
        k += whole * oracle_k(f->lobe, x, f->p);
    }
    return k;
}

/* Tents, to two mean texels beyond where the lobe ends or has faded. */
static void oracle_tents(double sum[4], const oracle_filter *f, const double a[3], double tent,
                         double reach) {
    double margin = 2 * f->extent, last = fmin(f->to, reach) + margin;
    for (size_t i = 0; i < f->count; ++i) {
        double angle = acos(oracle_clamp(oracle_dot(a, f->texels[i].d), -1, 1));
        if (angle < last && angle >= f->from - margin && f->texels[i].w > 0)
            oracle_add(sum, f, i, oracle_tent(f, a, f->texels + i, tent, reach));
    }
}

/* Does the circle of angle t about a come close to where a mapping has all texels of a row, or of
   its rim, in one direction? */
static int oracle_singular(const oracle_filter *f, const double a[3], double t) {
    double d[3] = {0, f->image.mapping == ENVMAP_LATLONG, f->image.mapping == ENVMAP_ANGULAR};
    if (f->image.mapping < ENVMAP_SPHERE || f->image.mapping == ENVMAP_OCTAHEDRAL) return 0;
    if (f->image.mapping == ENVMAP_SPHERE) d[2] = -1;
    double x = oracle_dot(a, d);
    if (f->image.mapping == ENVMAP_LATLONG) x = fabs(x);
    return acos(oracle_clamp(x, -1, 1)) < t + 2 * f->extent;
}

/* Where a point of a circle about an axis lies: between which four texel centres, on which face. */
typedef struct oracle_arc {
    double d[3];
    int face, x, y;
} oracle_arc;

static oracle_arc oracle_arc_at(const oracle_filter *f, double frame[3][3], double t, double phi) {
    oracle_arc p;
    double u, v;
    for (int j = 0; j < 3; ++j)
        p.d[j] = cos(t) * frame[0][j] + sin(t) * (cos(phi) * frame[1][j] + sin(phi) * frame[2][j]);
    oracle_coordinates(&p.face, &u, &v, f->image.mapping, p.d);
    p.x = (int)floor(u * f->image.width - 0.5), p.y = (int)floor(v * f->image.size - 0.5);
    for (int j = 0; j < 3; ++j) p.face = 2 * p.face + (p.d[j] > 0); /* an octahedral map's folds */
    return p;
}

static int oracle_arc_same(const oracle_arc *a, const oracle_arc *b) {
    return a->face == b->face && a->x == b->x && a->y == b->y;
}

/* The bilinear radiance on the circle of angle t about a, times weight: Gauss's rule between the
   points, found by halving, at which it comes between other texel centres. */
static void oracle_circle(double sum[4], const oracle_filter *f, const double a[3], double t,
                          double weight) {
    int n = (int)oracle_clamp(3 * f->fine * 2 * PI * sin(t) / f->extent, 24, 1e6);
    if (oracle_singular(f, a, t) && n < 8 * f->image.width) n = 8 * f->image.width;
    double frame[3][3], x[4], w[4], rgb[3] = {0, 0, 0};
    memcpy(frame[0], a, sizeof frame[0]);
    oracle_tangent(frame[1], a, 0), oracle_tangent(frame[2], a, PI / 2), oracle_gauss(x, w, 4);
    oracle_arc here = oracle_arc_at(f, frame, t, 0);
    double from = 0;
    for (int i = 0; i < n;) {
        double end = 2 * PI * (i + 1) / n, low = from, high = end;
        oracle_arc last = oracle_arc_at(f, frame, t, end), next = last;
        for (int halved = 0; halved < 30 && !oracle_arc_same(&here, &last); ++halved) {
            double middle = (low + high) / 2;
            oracle_arc p = oracle_arc_at(f, frame, t, middle);
            if (oracle_arc_same(&p, &here)) low = middle;
            else high = middle, next = p;
        }
        for (int j = 0; j < 4 && high > from; ++j) {
            double phi = from + (high - from) / 2 * (1 + x[j]);
            oracle_lookup(rgb, &f->image, oracle_arc_at(f, frame, t, phi).d,
                          (high - from) / 2 * w[j]);
        }
        if (oracle_arc_same(&here, &last)) ++i;
        here = next, from = high;
    }
    for (int j = 0; j < 3; ++j) sum[j] += weight / (2 * PI) * rgb[j];
    sum[3] += weight;
}

/* x^N, N < 2, has a root, or worse, at the horizon: panels halve towards it. */
static int oracle_rooted(const oracle_filter *f) {
    return f->lobe->kind == LOBE_PHONG && f->lobe->a < 2;
}

/* The end of the panel of angles that starts at t, about an axis a: as fine as lobe and texels at
   t, and no kink inside. Rings about a pole lie along a lat-long's rows and have kinks there. */
static double oracle_panel_end(const oracle_filter *f, const double a[3], double t, double end) {
    double step = fmin(fmax(f->sigma / 2, t / 4), f->extent / 2) / f->fine, next;
    if (oracle_rooted(f)) step = fmin(fmin(step, 0.1), fmax(1e-8, (PI / 2 - t) / 2));
    next = t + step;
    double kinks[3] = {acos(oracle_clamp(-f->p, -1, 1)), PI / 2, f->lobe->a};
    if (f->lobe->kind == LOBE_BANKS)
        step = fmin(f->sigma, f->extent) / 2 / f->fine, next = t + step;
    if (f->lobe->kind >= LOBE_CONE)
        for (int i = 1; i < 3; ++i)
            if (kinks[i] > t && kinks[i] < next) next = kinks[i];
    double pole = acos(oracle_clamp(a[1], -1, 1));
    int rows = f->image.mapping == ENVMAP_LATLONG && f->fine > 1 ? f->image.size : 0;
    for (int i = 0; i < 2 * rows; ++i) {
        double row = PI * (i / 2 + 0.5) / rows, at = i % 2 ? row + pole : fabs(row - pole);
        if (at > t && at < next) next = at;
    }
    return next < end - step / 100 ? next : end;
}

/* The integral of k over the bilinear radiance out to `reach`, in polar coordinates about a; where
   the lobe goes on, it fades out smoothly from half of it. */
static void oracle_polar(double sum[4], const oracle_filter *f, const double a[3], double reach) {
    double x[4], w[4], end = fmin(fmin(reach, f->to), f->sight);
    oracle_gauss(x, w, 4);
    for (double t = f->from, next; t < end; t = next) {
        next = oracle_panel_end(f, a, t, end);
        /* x^N, N < 1, has a root at the horizon, or jumps: nodes crowd there */
        int root = f->lobe->kind == LOBE_PHONG && f->lobe->a < 1 && !(next < end);
        for (int i = 0; i < 4; ++i) {
            double s = (1 - x[i]) / 2, rest = root ? s * s * s : s;
            double theta = next - (next - t) * rest, slope = root ? 3 * s * s : 1;
            double k = oracle_k(f->lobe, cos(theta), f->p);
            if (f->to > reach) k *= 1 - oracle_step(theta, reach / 2, reach);
            k *= slope * PI * (next - t) * w[i] * sin(theta);
            if (k > 0 || k < 0) oracle_circle(sum, f, a, theta, k);
        }
    }
}

/* The same on discs, in polar coordinates about a face's centre: a rim is then one line, and where
   lines through texel centres and the lobe's kinks meet a circle is a formula. */

/* An ordinary lobe of the header: it falls from its axis. */
static int oracle_falls(const oracle_filter *f) {
    return f->lobe->kind == LOBE_PHONG || f->lobe->kind == LOBE_GAUSSIAN ||
           f->lobe->kind == LOBE_GGX;
}

static int oracle_by_size(const void *a, const void *b) {
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* The radius on a disc at an angle from its face's centre, and the angle at a radius. */
static double oracle_disc_radius(int mapping, double t) {
    return mapping == ENVMAP_SPHERE ? sin(t / 2) : mapping == ENVMAP_ANGULAR ? t / PI : tan(t / 2);
}

static double oracle_disc_angle(int mapping, double r) {
    return mapping == ENVMAP_SPHERE    ? 2 * asin(fmin(r, 1))
           : mapping == ENVMAP_ANGULAR ? PI * fmin(r, 1)
                                       : 2 * atan(r);
}

/* An axis as a face sees it, and the angles about it at which the lobe has kinks, or ends. */
typedef struct oracle_disc {
    double a[3], t, phi, reach, end, kinks[8];
    int face, kink_count;
    double *cuts;
} oracle_disc;

static void oracle_disc_node(double sum[4], double rgb[3], const oracle_filter *f,
                             const oracle_disc *e, double t, double phi, double weight) {
    double side =
        f->image.mapping == ENVMAP_SPHERE || (f->image.mapping == ENVMAP_PARABOLOID && !e->face)
            ? 1
            : -1;
    double d[3] = {sin(t) * cos(phi), sin(t) * sin(phi), side * cos(t)}, share = 1;
    double r = oracle_disc_radius(f->image.mapping, t), x = oracle_dot(e->a, d);
    double k = oracle_k(f->lobe, x, f->p);
    if (f->to > e->reach)
        k *= 1 - oracle_step(acos(oracle_clamp(x, -1, 1)), e->reach / 2, e->reach);
    if (f->image.mapping == ENVMAP_PARABOLOID) /* as oracle_lookup blends them */
        share = r > 1 ? 0.5 * (1 - (1 - 1 / r) * f->image.size)
                      : fmin(1, 0.5 * (1 + (1 - r) * f->image.size));
    k *= weight * sin(t) * fmax(share, 0);
    if (!(k > 0) && !(k < 0)) return;
    oracle_bilinear(rgb, &f->image, e->face, 0.5 + 0.5 * r * cos(phi), 0.5 - 0.5 * r * sin(phi), k);
    sum[3] += k;
}

/* Where the circle of angle t about the face's centre meets that of angle `to` about the axis: half
   of the width of its part inside, < 0 where there is none. */
static double oracle_disc_wide(const oracle_disc *e, double t, double to) {
    double c = (cos(to) - cos(t) * cos(e->t)) / fmax(sin(t) * sin(e->t), 1e-300);
    return c > 1 ? -1 : acos(fmax(c, -1));
}

/* Nodes of a piece crowd at both its ends where x^N may have its root there. */
static double oracle_grade(double *at, const oracle_filter *f) {
    double t = *at;
    if (!oracle_rooted(f)) return 1;
    *at = t * t * t * (10 + t * (6 * t - 15));
    return 30 * t * t * (1 - t) * (1 - t);
}

static void oracle_disc_circle(double sum[4], const oracle_filter *f, const oracle_disc *e,
                               double t, double weight) {
    double r = oracle_disc_radius(f->image.mapping, t), *cuts = e->cuts, x[4], w[4];
    double wide = oracle_disc_wide(e, t, e->end), rgb[3] = {0, 0, 0};
    int n = f->image.size, count = 0;
    if (wide < 0) return;
    cuts[count++] = -wide, cuts[count++] = wide;
    for (int i = 0; i < e->kink_count; ++i) {
        double at = oracle_disc_wide(e, t, e->kinks[i]);
        if (at > 0) cuts[count++] = -at, cuts[count++] = at;
    }
    for (int i = 0; i < n; ++i) { /* lines through centres */
        double c = ((2 * i + 1.0) / n - 1) / r, at = fabs(c) < 1 ? acos(c) : -1;
        if (at < 0) continue;
        double four[4] = {at, -at, PI / 2 - at, PI / 2 + at};
        for (int k = 0; k < 4; ++k) cuts[count++] = remainder(four[k] - e->phi, 2 * PI);
    }
    qsort(cuts, (size_t)count, sizeof *cuts, oracle_by_size);
    oracle_gauss(x, w, 4);
    for (int i = 0; i + 1 < count; ++i) {
        double from = cuts[i], to = cuts[i + 1],
               nearest = from * to < 0 ? 0 : fmin(fabs(from), fabs(to));
        if (to > wide + 1e-15 || from < -wide - 1e-15 || !(to > from)) continue;
        double arc = hypot(sin(t) * nearest, t - e->t), step = f->sigma / 2;
        if (oracle_falls(f)) step = fmax(step, arc / 5);
        int parts =
            (int)ceil(fmin((to - from) * sin(t) / step * f->fine, 1e4)) + ((to - from) > 0.5);
        for (int k = 0; k < 4 * parts; ++k) {
            double at = (k / 4 + (1 + x[k % 4]) / 2) / parts, slope = oracle_grade(&at, f);
            oracle_disc_node(sum, rgb, f, e, t, e->phi + from + (to - from) * at,
                             weight * slope * (to - from) / parts / 2 * w[k % 4]);
        }
    }
    for (int c = 0; c < 3; ++c) sum[c] += rgb[c];
}

static void oracle_disc_face(double sum[4], const oracle_filter *f, oracle_disc *e) {
    int n = f->image.size, mapping = f->image.mapping, count = 0;
    double *ends = e->cuts + 4 * n + 32, x[6], w[6], most = mapping == ENVMAP_PARABOLOID ? 2 : 1;
    double side = mapping == ENVMAP_SPHERE || (mapping == ENVMAP_PARABOLOID && !e->face) ? 1 : -1;
    e->t = atan2(hypot(e->a[0], e->a[1]), side * e->a[2]), e->phi = atan2(e->a[1], e->a[0]);
    if (most > 1) most = n > 1 ? 1 / (1 - 1.0 / n) : HUGE_VAL; /* where it has blended away */
    double low = fmax(0, e->t - e->end);
    double high = fmin(most > 1e9 ? PI : oracle_disc_angle(mapping, most), e->t + e->end);
    ends[count++] = low, ends[count++] = high;
    for (int i = 1 - (n & 1); i < n; i += 2)
        ends[count++] = oracle_disc_angle(mapping, (double)i / n);
    ends[count++] = oracle_disc_angle(mapping, 1),
    ends[count++] = oracle_disc_angle(mapping, 1 - 1.0 / n);
    for (int i = 0; i < e->kink_count; ++i)
        ends[count++] = fabs(e->t - e->kinks[i]), ends[count++] = e->t + e->kinks[i];
    ends[count++] = 2 * PI - e->t - e->end, ends[count++] = e->t;
    ends[count++] = fabs(e->t - e->end);
    qsort(ends, (size_t)count, sizeof *ends, oracle_by_size);
    oracle_gauss(x, w, 6);
    for (int i = 0; i + 1 < count; ++i)
        for (double from = fmax(ends[i], low), to = fmin(ends[i + 1], high), next;
             from < to - 1e-14; from = next) {
            double step = f->sigma / 2, away = from > e->t ? from - e->t : (e->t - from) / 5 * 4;
            if (oracle_falls(f)) step = fmax(step, away / 4);
            step /= f->fine;
            next = from + step * 1.01 < to ? from + step : to;
            for (int k = 0; k < 6; ++k) {
                double at = (1 + x[k]) / 2, slope = oracle_grade(&at, f);
                oracle_disc_circle(sum, f, e, from + (next - from) * at,
                                   slope * (next - from) / 2 * w[k]);
            }
        }
}

static void oracle_discs(double sum[4], const oracle_filter *f, const double a[3], double reach) {
    oracle_disc e;
    double kinks[6] = {PI / 2, f->lobe->a, f->from, f->to, reach, reach / 2};
    memset(&e, 0, sizeof e);
    memcpy(e.a, a, sizeof e.a), e.reach = reach;
    e.end = fmin(fmin(reach, f->to), f->sight);
    for (int i = f->lobe->kind == LOBE_CONE ? 0 : f->lobe->kind == LOBE_BANKS ? 2 : 4; i < 6; ++i)
        if (kinks[i] > 0 && kinks[i] < e.end) e.kinks[e.kink_count++] = kinks[i];
    if (f->lobe->kind == LOBE_POWER && e.end > PI / 2) e.kinks[e.kink_count++] = PI / 2;
    e.cuts = (double *)malloc((size_t)(6 * f->image.size + 96) * sizeof(double));
    for (e.face = 0; e.cuts && e.face < oracle_faces(f->image.mapping); ++e.face)
        oracle_disc_face(sum, f, &e);
    free(e.cuts);
}

/* The last flank of a function or a table: the last of the steps of sigma/2 on which k falls faster
   than theta^-11, and the ring before has more than 1e-4 of all. */
static double oracle_flank(const oracle_filter *f) {
    double step = fmax(f->sigma / 2, PI / 4096), all = 0, last = 0, before = 0;
    for (double t = step; t < PI && f->lobe->kind >= LOBE_TABLE; t += step) {
        double k = fabs(oracle_k(f->lobe, cos(t), f->p));
        all += before * t * step;
        if (k < before * exp(-11 * step / t) && before * t * step > 1e-4 * all) last = t;
        before = k;
    }
    return last;
}

/* From there on there is next to nothing of k: integrals need not go on. */
static double oracle_sight(const oracle_filter *f) {
    double peak = 0, step = PI / 4096, last = PI;
    for (double t = 0; t < PI; t += step) peak = fmax(peak, fabs(oracle_k(f->lobe, cos(t), f->p)));
    while (last > step && fabs(oracle_k(f->lobe, cos(last - step), f->p)) < 1e-14 * peak)
        last -= step;
    return last;
}

/* The definition of one texel of a result: texel centres for lobes of two mean texels and more; for
   thinner ones tents of half-width t = clamp(2 - sigma/texel, 0, 1), which go over into bilinear
   radiance between t = 1/2 and 1. What such a lobe has beyond `reach` counts at centres again. */
static void oracle_axis(double rgb[3], const oracle_filter *f, const double a[3]) {
    double tent = oracle_clamp(2 - f->sigma / f->extent, 0, 1), norm = oracle_norm(f->lobe);
    double bilinear = oracle_step(tent, 0.5, 1),
           reach = fmax(fmax(12 * f->extent, 8 * f->sigma), 3 * f->flank);
    double texels[4] = {0, 0, 0, 0}, smooth[4] = {0, 0, 0, 0};
    if (f->from > 0 || reach > f->to) reach = f->to;
    if (!(tent > 0)) oracle_centres(texels, f, a, 0);
    else if (bilinear < 1) oracle_tents(texels, f, a, tent, reach);
    if (bilinear > 0 && oracle_is_disc(f->image.mapping)) oracle_discs(smooth, f, a, reach);
    else if (bilinear > 0) oracle_polar(smooth, f, a, reach);
    for (int c = 0; c < 4; ++c) texels[c] += bilinear * (smooth[c] - texels[c]);
    if (tent > 0 && f->to > reach) oracle_centres(texels, f, a, reach);
    if (!(norm > 0)) norm = texels[3];
    for (int c = 0; c < 3; ++c) rgb[c] = texels[c] / norm;
}

/* -------------------------------------------------------------------------------- harmonics -- */

/* Y[l(l+1)+m], orthonormal, no Condon-Shortley phase, polar axis z: normalised P_lm upwards in l. */
static void oracle_harmonics(double *Y, int bands, const double d[3]) {
    double s = sqrt(fmax(0, 1 - d[2] * d[2])), phi = atan2(d[1], d[0]), start = sqrt(0.25 / PI);
    for (int m = 0; m < bands; ++m) {
        double P = start, before = 0;
        for (int l = m; l < bands; ++l) {
            Y[l * (l + 1) + m] = m ? sqrt(2) * cos(m * phi) * P : P;
            if (m) Y[l * (l + 1) - m] = sqrt(2) * sin(m * phi) * P;
            double n = l + 1, up = sqrt((4 * n * n - 1) / (n * n - m * m));
            double back = l > m ? sqrt((1.0 * l * l - m * m) / (4.0 * l * l - 1)) : 0;
            double next = up * (d[2] * P - back * before);
            before = P, P = next;
        }
        start *= s * sqrt((2 * m + 3) / (2.0 * m + 2));
    }
}

/* sum of a_lm Y_lm(d); *size is the sum of their absolute values. */
static double oracle_series(double *size, const double *sh, int bands, int channel,
                            const double d[3]) {
    double Y[32 * 32], sum = 0;
    oracle_harmonics(Y, bands, d);
    *size = 0;
    for (int i = 0; i < bands * bands; ++i) {
        sum += Y[i] * sh[3 * i + channel];
        *size += fabs(Y[i] * sh[3 * i + channel]);
    }
    return sum;
}

#endif
