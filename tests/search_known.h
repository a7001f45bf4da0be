/* SPDX-License-Identifier: MIT
   What is known to break today. A finding that one of these rows matches is counted and listed as
   known; anything else is a failure. Whoever mends a kind takes its row out. */
#ifndef SEARCH_KNOWN_H
#define SEARCH_KNOWN_H

#include "search_others.h"

/* A broken promise of a work, with what the rows ask about. */
typedef struct finding {
    const work *w;
    int promise;
    double value;  /* of the promise: tolerances for rms and worst */
    double off;    /* the same, absolute */
    double texels; /* sigma of the sharpest slice in mean texels of the source */
    double extent; /* of the source's mean texel, rad */
} finding;

static finding finding_of(const work *w, const verdict *v, int promise) {
    finding f;
    oracle_lobe m = work_lobe(w);
    memset(&f, 0, sizeof f);
    f.w = w, f.promise = promise, f.value = v->value[promise];
    f.off = f.value * w->tolerance;
    f.extent = oracle_extent(w->src_mapping, w->src_size), f.texels = HUGE_VAL;
    for (int i = 0; i < w->dst_slices; ++i)
        f.texels = fmin(f.texels, oracle_sigma(&m, oracle_p(&m, i, w->dst_slices)) / f.extent);
    free(m.table);
    return f;
}

static int is_accuracy(const finding *f) {
    return f->promise == PROMISE_RMS || f->promise == PROMISE_WORST;
}

static int is_time(const finding *f) {
    return f->promise == PROMISE_COST || f->promise == PROMISE_CLIFF;
}

/* Sharp lobes: axes that look where all of a sphere or an angular map's rim's texels meet are
   summed one by one, and so are rings and what else has kinks or reaches far; tight tolerances take
   many nodes, and so do functions and tables on paraboloids and an octahedral map's quadrants. */
static int known_thin_time(const finding *f) {
    int rim = f->w->src_mapping == ENVMAP_SPHERE || f->w->src_mapping == ENVMAP_ANGULAR;
    int smooth = f->w->src_mapping == ENVMAP_CUBE || f->w->src_mapping == ENVMAP_LATLONG;
    return is_time(f) && f->texels < 2.6 &&
           (rim || (!smooth && f->w->lobe >= LOBE_TABLE) || f->w->lobe == LOBE_BANKS ||
            f->w->lobe == LOBE_POWER || f->w->lobe == LOBE_RING || f->w->lobe == LOBE_TWO ||
            f->w->tolerance < 1e-4);
}

/* Where texels are wider than 0.1 rad, lobes below two of them that have kinks or reach far weigh
   all of them for every axis. */
static int known_coarse_time(const finding *f) {
    int bell = (f->w->lobe == LOBE_PHONG && f->w->a >= 2) || f->w->lobe == LOBE_GAUSSIAN;
    return is_time(f) && f->extent > 0.1 && f->texels < 2 && !bell;
}

/* Kinked lobes on sources half as coarse, where slices have lights of their own. */
static int known_kinked_time(const finding *f) {
    return is_time(f) && work_lobe_kinked(f->w) && f->extent > 0.05 && f->w->src_slices > 1 &&
           f->w->scene >= SCENE_TEXEL;
}

/* What needs hundreds of bands takes L^3, and more than 768 are not tried. Sharp lobes need none of
   them. */
static int known_banded_time(const finding *f) {
    oracle_lobe m = work_lobe(f->w);
    envmap_lobe lobe = work_header_lobe(&m);
    int bands = 0;
    for (int i = 0; i < f->w->dst_slices && is_time(f) && f->texels >= 2.6; ++i) {
        double p = oracle_p(&m, i, f->w->dst_slices);
        int one = envmap_sh_bands(&lobe, p, NULL, 0, 0.3 * f->w->tolerance);
        bands = one > bands ? one : bands;
    }
    free(m.table);
    return bands > 400;
}

/* A function (or wide bells in a table) with a tip at its axis or opposite to it, where no kink can
   be declared: beside lights no number of bands seems enough, and the reference is taken. */
static int known_tip_time(const finding *f) {
    oracle_lobe m = work_lobe(f->w);
    int tip = f->w->lobe == LOBE_TABLE && f->w->a > 0.2; /* bells that do not end before pi */
    for (int i = 0; i < f->w->dst_slices && f->w->lobe >= LOBE_CONE; ++i) {
        double p = oracle_p(&m, i, f->w->dst_slices), h = 1e-3;
        tip |= fabs(oracle_k(&m, cos(h), p) - oracle_k(&m, 1, p)) > 1e-4 * h ||
               fabs(oracle_k(&m, -cos(h), p) - oracle_k(&m, -1, p)) > 1e-4 * h;
    }
    free(m.table);
    return is_time(f) && tip;
}

/* Where a row of texels lies along the horizon of an axis, the definition's own sum over centres is
   off by texel^2 / 12 times the jump of k's slope there, which no number of bands has. It is much of
   a lobe whose peak is beside the horizon, and of tolerances below the square of a texel. Where k
   itself jumps (x^N, N < 0.2), it is off by half a row's, which the definition leaves out: x = 0. A
   cube's texels are 1.4 times the mean there. Coarse sources have no bands, nor has x^N, N < 1,
   where the pairs of texels are few. */
static int known_kink_on_rows(const finding *f) {
    oracle_lobe m = work_lobe(f->w);
    double h = 1e-4, integral = 0, p = oracle_p(&m, 0, f->w->dst_slices);
    double slope = fabs(oracle_k(&m, h, p) - oracle_k(&m, h / 2, p)) / (h / 2);
    double jump = fabs(oracle_k(&m, h, p));
    for (double x = h / 2; x < 1; x += h) integral += h * oracle_k(&m, x, p);
    free(m.table);
    double pairs = (double)oracle_count(f->w->src_mapping, f->w->src_size) *
                   (double)oracle_count(f->w->dst_mapping, f->w->dst_size);
    int few = f->w->lobe == LOBE_PHONG && f->w->a < 1 && pairs < 3e7;
    return is_accuracy(f) && work_lobe_kinked(f->w) && f->w->lobe != LOBE_BANKS &&
           f->texels > 1 && f->extent < 0.1 && !few && f->w->method != ENVMAP_METHOD_REFERENCE &&
           f->off < (f->promise == PROMISE_RMS ? 1 : 20) *
                        (f->extent * f->extent / 12 * slope + 0.7 * f->extent * jump) /
                        fabs(integral);
}

static const struct known {
    const char *what, *named; /* where the work that mends it is described */
    int (*matches)(const finding *f);
} known[] = {
    {"rims, rings and tight tolerances of lobes below two texels", "no cliffs: sharp lobes",
     known_thin_time},
    {"coarse sources take seconds", "no cliffs: small and coarse sources", known_coarse_time},
    {"kinked lobes, small sources of slices with lights", "found here", known_kinked_time},
    {"lobes of hundreds of bands take seconds", "no cliffs: rings, middle lobes",
     known_banded_time},
    {"functions with a tip at an end take seconds", "found here", known_tip_time},
    {"rows of texels along the horizon", "right everywhere", known_kink_on_rows},
};
enum { KNOWN_COUNT = sizeof known / sizeof *known };

/* The row of a finding; -1: it is new. */
static int known_row(const finding *f) {
    for (int i = 0; i < KNOWN_COUNT; ++i)
        if (known[i].matches(f)) return i;
    return -1;
}

#endif
