/* SPDX-License-Identifier: MIT
   What a work may take, and the one place where the definition is coarser than FAST: the bounds of
   what envmap.h calls slow (envmap_filter), so that slow stays bounded. */
#ifndef SEARCH_SLOW_H
#define SEARCH_SLOW_H

#include "search_works.h"

/* sigma of the sharpest slice, in mean texels of the source. */
static double work_texels(const work *w) {
    oracle_lobe m = work_lobe(w);
    double least = HUGE_VAL;
    for (int i = 0; i < w->dst_slices; ++i)
        least = fmin(least, oracle_sigma(&m, oracle_p(&m, i, w->dst_slices)));
    free(m.table);
    return least / oracle_extent(w->src_mapping, w->src_size);
}

/* Is k of a slice steep at its axis, or opposite to it, where no kink can be declared? */
static int work_has_tip(const oracle_lobe *m, double p) {
    double h = 1e-3;
    return fabs(oracle_k(m, cos(h), p) - oracle_k(m, 1, p)) > 1e-4 * h ||
           fabs(oracle_k(m, -cos(h), p) - oracle_k(m, -1, p)) > 1e-4 * h;
}

/* Slices that take hundreds of bands: of lobes of two texels and more, beside lights. */
static int work_banded(const work *w) {
    oracle_lobe m = work_lobe(w);
    envmap_lobe lobe = work_header_lobe(&m);
    int count = 0;
    for (int i = 0; i < w->dst_slices; ++i) {
        double p = oracle_p(&m, i, w->dst_slices);
        count += envmap_sh_bands(&lobe, p, NULL, 0, 0.3 * w->tolerance) > 400 ||
                 (w->lobe == LOBE_PHONG && w->a < 1) ||
                 (w->lobe >= LOBE_CONE && work_has_tip(&m, p)) ||
                 (w->lobe == LOBE_TABLE && w->a > 0.2);
    }
    free(m.table);
    return count;
}

/* Seconds that an axis may take, beside what all axes share: 0 where windows or bands serve. Else it
   looks at all texels that its lobe reaches, each of them by several nodes, more at tighter
   tolerances; bells take a quarter, on discs and octahedral maps. */
static double work_axis_seconds(const work *w, double texels) {
    double extent = oracle_extent(w->src_mapping, w->src_size);
    double all = (double)oracle_count(w->src_mapping, w->src_size);
    double tight = sqrt(fmax(1, 1e-3 / w->tolerance));
    int smooth = w->src_mapping == ENVMAP_CUBE || w->src_mapping == ENVMAP_LATLONG;
    int bell =
        w->lobe == LOBE_GAUSSIAN || w->lobe == LOBE_GGX || (w->lobe == LOBE_PHONG && w->a >= 2);
    int coarse = extent > 0.1 && texels < 2, kinked = work_lobe_kinked(w) && extent > 0.05;
    if (bell && texels < 2.6 && (!smooth || coarse || w->tolerance < 1e-4))
        return (1.25e-4 + 2.5e-7 * all) * tight;
    if (!bell && ((texels < 2.6 && (!smooth || w->lobe < LOBE_TABLE || w->lobe == LOBE_POWER ||
                                    w->lobe == LOBE_RING || w->lobe == LOBE_TWO || tight > 3)) ||
                  coarse || (kinked && w->src_slices > 1)))
        return (5e-4 + 1e-6 * all) * tight;
    return 0;
}

/* What a map takes that has no cliff; kinked lobes at tight tolerances need many bands. What is slow
   takes more, within bounds: *slow. */
static double work_allowed_seconds(const work *w, int *slow) {
    double src = (double)oracle_count(w->src_mapping, w->src_size) * w->src_slices;
    double dst = (double)oracle_count(w->dst_mapping, w->dst_size) * w->dst_slices;
    double tight = work_lobe_kinked(w) ? sqrt(fmax(1, 1e-3 / w->tolerance)) : 1;
    double texels = work_texels(w), more = dst * work_axis_seconds(w, texels);
    if (texels >= 2) more += work_banded(w);
    *slow = more > 0;
    return tight * (0.1 + 0.02 * w->dst_slices + 4e-6 * (src + dst)) + more;
}

/* Where a row of texels lies along the horizon of an axis, the definition's own sum over centres is
   off by texel^2 / 12 times the jump of k's slope there, which no number of bands has. It is much of
   a lobe whose peak is beside the horizon, and of tolerances below the square of a texel. Where k
   itself jumps (x^N, N < 0.2), it is off by half a row's, which the definition leaves out: x = 0. A
   cube's texels are 1.4 times the mean there. Coarse sources have no bands, nor has x^N, N < 1,
   where the pairs of texels are few. Returns this part of the result. */
static double work_rows_off(const work *w, const oracle_lobe *m, double p) {
    double h = 1e-4, integral = 0, extent = oracle_extent(w->src_mapping, w->src_size);
    double slope = fabs(oracle_k(m, h, p) - oracle_k(m, h / 2, p)) / (h / 2);
    double jump = fabs(oracle_k(m, h, p));
    double pairs = (double)oracle_count(w->src_mapping, w->src_size) *
                   (double)oracle_count(w->dst_mapping, w->dst_size);
    int few = w->lobe == LOBE_PHONG && w->a < 1 && pairs < 3e7;
    if (!work_lobe_kinked(w) || w->lobe == LOBE_BANKS || oracle_sigma(m, p) < extent ||
        extent > 0.1 || few || w->method == ENVMAP_METHOD_REFERENCE)
        return 0;
    for (double x = h / 2; x < 1; x += h) integral += h * oracle_k(m, x, p);
    return (extent * extent / 12 * slope + 0.7 * extent * jump) / fabs(integral);
}

#endif
