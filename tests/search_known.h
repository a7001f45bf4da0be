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

/* Black almost everywhere. */
static int is_dark(const work *w) {
    return w->scene == SCENE_TEXEL || w->scene == SCENE_LAMPS || w->scene == SCENE_COLOURS;
}

/* Sharp lobes: axes that look where all of a rim's texels meet go to the reference, and so do rings
   and what else reaches far; tight tolerances take many nodes. */
static int known_thin_time(const finding *f) {
    int rim = f->w->src_mapping == ENVMAP_SPHERE || f->w->src_mapping == ENVMAP_ANGULAR;
    return is_time(f) && f->texels < 2.6 &&
           (rim || f->w->lobe == LOBE_BANKS || f->w->lobe == LOBE_POWER ||
            f->w->lobe == LOBE_RING || f->w->lobe == LOBE_TWO || f->w->tolerance < 1e-4);
}

/* Lobes go to the reference where the source's texels are wider than 0.1 rad. */
static int known_coarse_time(const finding *f) { return is_time(f) && f->extent > 0.1; }

/* And kinked lobes on sources half as coarse, where a scene has a light. */
static int known_kinked_time(const finding *f) {
    return is_time(f) && work_lobe_kinked(f->w) && f->extent > 0.05 && f->w->scene >= SCENE_TEXEL;
}

/* And what needs more than 768 bands; what needs hundreds takes L^3. */
static int known_banded_time(const finding *f) {
    oracle_lobe m = work_lobe(f->w);
    envmap_lobe lobe = work_header_lobe(&m);
    int bands = 0;
    for (int i = 0; i < f->w->dst_slices && is_time(f); ++i) {
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

/* The integral of the bilinear radiance at tolerances tighter than its nodes: kinks of functions;
   the reference's rings, for Banks and around the point where all of a rim's texels meet. */
static int known_thin_sums(const finding *f) {
    double limit = f->promise == PROMISE_RMS ? 1e-4 : 2e-3;
    if (f->w->src_mapping == ENVMAP_SPHERE || f->w->src_mapping == ENVMAP_ANGULAR ||
        f->w->lobe == LOBE_BANKS)
        limit *= 500;
    return is_accuracy(f) && f->texels < 1.5 && f->off < limit;
}

/* Up to about the tolerance. The value is relative to the brightest texel, which small results need
   not have. */
static int known_sign(const finding *f) {
    int small = f->w->dst_size <= 5;
    return f->promise == PROMISE_SIGN && f->w->lobe >= LOBE_TABLE &&
           (small || f->value < 1e-2 + 2 * f->w->tolerance);
}

/* Light that lies near a pole; lamps have two more axes, with the same components. */
static int known_source_pole(const finding *f) {
    double y = fabs(2 * f->w->t - 1), r = sqrt(1 - y * y), angle = 2 * PI * f->w->s;
    int lamps = f->w->scene == SCENE_LAMPS || f->w->scene == SCENE_COLOURS;
    if (lamps) y = fmax(y, r * fmax(fabs(cos(angle)), fabs(sin(angle))));
    return is_accuracy(f) && f->w->src_mapping == ENVMAP_LATLONG && f->texels >= 2 && y > 0.85;
}

static int known_result_pole(const finding *f) {
    return f->promise == PROMISE_WORST && f->w->dst_mapping == ENVMAP_LATLONG && is_dark(f->w);
}

static int known_sphere(const finding *f) {
    double limit = f->promise == PROMISE_RMS ? 6 : 120;
    return is_accuracy(f) && f->w->src_mapping == ENVMAP_SPHERE && f->texels >= 1.5 &&
           f->value < limit;
}

static int known_kinked_function(const finding *f) {
    return f->promise == PROMISE_RMS && f->w->lobe == LOBE_POWER && f->value < 3;
}

static int known_black(const finding *f) {
    double limit = f->promise == PROMISE_WORST ? 60 : 2;
    return is_accuracy(f) && is_dark(f->w) && f->w->tolerance < 2.5e-3 && f->value < limit;
}

static int known_missed_light(const finding *f) {
    int few = f->w->dst_size == 1 && f->w->scene == SCENE_SUN && f->value < 2;
    return is_accuracy(f) && ((is_dark(f->w) && f->w->dst_size <= 5) || few);
}

/* Two or three units in the last place of a float. */
static int known_last_bits(const finding *f) {
    return is_accuracy(f) && f->w->tolerance < 3e-6 && f->w->dst_size <= 2 && f->value < 3;
}

/* The integral of k^2 near a horizon where k jumps, or nearly. */
static int known_bands(const finding *f) {
    return f->promise == PROMISE_BANDS && f->w->lobe == LOBE_PHONG && f->w->a < 1;
}

static int known_resampled(const finding *f) {
    return f->promise == PROMISE_MEAN || f->promise == PROMISE_ENERGY;
}

static const struct known {
    const char *what, *named; /* where the work that mends it is described */
    int (*matches)(const finding *f);
} known[] = {
    {"rims, rings and tight tolerances of lobes below two texels", "no cliffs: sharp lobes",
     known_thin_time},
    {"coarse sources take seconds", "no cliffs: small and coarse sources", known_coarse_time},
    {"kinked lobes, small sources with a light", "found here", known_kinked_time},
    {"lobes of hundreds of bands take seconds", "no cliffs: rings, middle lobes",
     known_banded_time},
    {"functions with a tip at an end take seconds", "found here", known_tip_time},
    {"lobes below 1.5 texels, tight tolerances and rims", "found here", known_thin_sums},
    {"negative light from functions and tables", "right everywhere", known_sign},
    {"lat-long sources near poles", "right everywhere", known_source_pole},
    {"lat-long results near poles", "right everywhere", known_result_pole},
    {"sphere map sources near -z", "right everywhere", known_sphere},
    {"functions with a declared kink", "right everywhere", known_kinked_function},
    {"smooth lobes in black scenes, tight tolerances", "right everywhere", known_black},
    {"results of few texels that miss the light", "right everywhere", known_missed_light},
    {"results of few texels at the rounding of floats", "found here", known_last_bits},
    {"some bands more than are needed, Phong below 1", "found here", known_bands},
    {"resampling", "no cliffs: resampling", known_resampled},
};
enum { KNOWN_COUNT = sizeof known / sizeof *known };

/* The row of a finding; -1: it is new. */
static int known_row(const finding *f) {
    for (int i = 0; i < KNOWN_COUNT; ++i)
        if (known[i].matches(f)) return i;
    return -1;
}

#endif
