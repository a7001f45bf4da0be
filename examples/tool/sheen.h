/* sheen.h - Charlie, the sheen of cloth: its lobe for chains of maps, and what it reflects of a
   white environment, for a column of the split-sum table.

       D(h) = (2 + 1/alpha) sin^(1/alpha) / 2 pi,  sin that of the angle between n and h
       V    = 1 / 4 (n.l + n.v - n.l n.v)

   Sources: Estevez and Kulla, "Production Friendly Microfacet Sheen BRDF", 2017, for D; Neubelt and
   Pettineo, "Crafting a Next-Gen Material Pipeline for The Order: 1886", 2013, for V. Test:
   tests/test_bake.c. Include after envmap.h.

   SPDX-License-Identifier: MIT */

#ifndef SHEEN_H
#define SHEEN_H

#include <math.h>

#define SHEEN_ALPHA 0.01 /* the least: below it cloth is a rim thinner than a texel */

/* sine2: sin squared. */
static inline double sheen_density(double sine2, double alpha) {
    return (2 + 1 / alpha) * pow(sine2, 0.5 / alpha) / 6.28318530717959;
}

/* D(h) (n.l) with n = v = r, as an envmap_lobe_function; user: alpha. */
static inline double sheen_lobe_value(double x, double p, void *user) {
    (void)p;
    return x > 0 ? sheen_density(0.5 * (1 - x), *(const double *)user) * x : 0;
}

/* *alpha is raised to the least there is, and must outlive the lobe. */
static inline envmap_lobe sheen_lobe(double *alpha) {
    static const float kink[1] = {1.57079633f};
    envmap_lobe lobe = envmap_lobe_function(sheen_lobe_value, alpha);
    *alpha = fmax(*alpha, SHEEN_ALPHA);
    lobe.kinks = kink, lobe.kink_count = 1;
    return lobe;
}

/* The integral of D V (n.l) over l: midpoints in n.l, which is squared to be dense at the horizon,
   where D is, and in the angle between the planes of l and v. */
static inline double sheen_albedo(double nv, double alpha) {
    enum { COSINES = 64, ANGLES = 32 };
    double sum = 0, sine = sqrt(1 - nv * nv);
    int i, k;
    alpha = fmax(alpha, SHEEN_ALPHA);
    for (i = 0; i < COSINES; i++) {
        double t = (i + 0.5) / COSINES, nl = t * t, part = 0;
        for (k = 0; k < ANGLES; k++) {
            double phi = 3.14159265358979 * (k + 0.5) / ANGLES;
            double lv = nl * nv + sqrt(1 - nl * nl) * sine * cos(phi);
            double nh2 = (nl + nv) * (nl + nv) / (2 + 2 * lv);
            part += sheen_density(fmax(0, 1 - nh2), alpha);
        }
        sum += part / ANGLES * 2 * t / COSINES * nl / (4 * (nl + nv - nl * nv));
    }
    return 6.28318530717959 * sum;
}

#endif /* SHEEN_H */
