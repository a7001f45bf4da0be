/* SPDX-License-Identifier: MIT
   The promises of all calls but the filter: lobes, harmonics, resampling, mips, lookups. */
#ifndef SEARCH_OTHERS_H
#define SEARCH_OTHERS_H

#include "search_promises.h"

/* ------------------------------------------------------------------------------------ lobes ---- */

/* How far a is off b, of the larger of |b| and size. */
static double off_by(double a, double b, double size) { return fabs(a - b) / fmax(fabs(b), size); }

static void check_lobe_values(verdict *v, bench *b, double p, double integral, double size) {
    unsigned long long state = b->w->seed;
    const envmap_lobe *lobe = &b->header_lobe;
    double from, to, worst = 0, scale = b->lobe.scale, peak = 0, beyond = 0;
    envmap_lobe_support(&from, &to, lobe, p);
    for (int i = 0; i < 400; ++i) {
        double t = i % 2 ? PI * test_random(&state) : work_between(1e-5, PI, &state);
        double k = scale * oracle_k(&b->lobe, cos(t), p);
        peak = fmax(peak, fabs(k));
        worst = fmax(worst, off_by(envmap_lobe_value(lobe, cos(t), p), k, 1e-6 * peak));
        if (t < from || t > to) beyond = fmax(beyond, fabs(k));
    }
    peak = fmax(peak, scale * oracle_k(&b->lobe, 1, p));
    hold(v, PROMISE_VALUE, worst, 1e-6);
    hold(v, PROMISE_VALUE, beyond, 1.1e-12 * peak);
    hold(v, PROMISE_VALUE, fabs(envmap_lobe_integral(lobe, p) - scale * integral),
         1e-6 * scale * size);
    double sigma = oracle_sigma(&b->lobe, p);
    hold(v, PROMISE_VALUE, fabs(envmap_lobe_sigma(lobe, p) - sigma), 0.01 * sigma + 2e-4);
}

/* The fewest bands whose tail is at most tolerance^2 of the whole, sum_l (2l+1) lambda_l^2. */
static void check_lobe_bands(verdict *v, bench *b, double p, const double *lambda, int known,
                             double square) {
    double tolerance = fmax(1e-4, b->w->tolerance), total = 8 * PI * PI * square / (2 * PI), tail;
    int bands = envmap_sh_bands(&b->header_lobe, p, NULL, 0, tolerance);
    if (bands >= known) return;
    hold(v, PROMISE_BANDS, bands < 1, 0);
    tail = total;
    for (int l = 0; l < bands; ++l) tail -= (2 * l + 1) * lambda[l] * lambda[l];
    hold(v, PROMISE_BANDS, tail, 1.001 * tolerance * tolerance * total + 1e-11 * total);
    if (bands < 2) return;
    tail += (2 * bands - 1) * lambda[bands - 1] * lambda[bands - 1];
    hold(v, PROMISE_BANDS, 0.999 * tolerance * tolerance * total - 1e-11 * total, tail);
}

static void check_lobes(verdict *v, bench *b) {
    enum { KNOWN = 96 };
    unsigned long long state = b->w->seed;
    double p = oracle_p(&b->lobe, work_below(b->w->dst_slices, &state), b->w->dst_slices);
    double own[KNOWN], square, size, lambda[KNOWN], worst = 0, norm = oracle_norm(&b->lobe);
    oracle_zonal(own, &square, &size, KNOWN, &b->lobe, p);
    check_lobe_values(v, b, p, own[0], size);
    check_lobe_bands(v, b, p, own, KNOWN, square);
    hold(v, PROMISE_OK, envmap_lobe_zonal(lambda, KNOWN, &b->header_lobe, p), 0);
    if (!(norm > 0)) norm = own[0];
    for (int l = 0; l < KNOWN; ++l)
        worst = fmax(worst, fabs(lambda[l] - own[l] / norm) / (size / norm));
    hold(v, PROMISE_ZONAL, worst, 1e-6);
}

/* -------------------------------------------------------------------------------- harmonics ---- */

/* a_lm of level 0 of slice 0, and a_00 of |L|. */
static void own_project(double *sh, double size[3], int bands, const bench *b) {
    double Y[32 * 32];
    memset(sh, 0, (size_t)(3 * bands * bands) * sizeof *sh);
    size[0] = size[1] = size[2] = 0;
    for (size_t i = 0; i < oracle_count(b->w->src_mapping, b->w->src_size); ++i) {
        oracle_harmonics(Y, bands, b->src_texels[i].d);
        for (int c = 0; c < 3; ++c) {
            double flux = b->src_texels[i].w * (double)b->src.texels[3 * i + (size_t)c];
            size[c] += fabs(flux) * sqrt(0.25 / PI);
            for (int lm = 0; lm < bands * bands; ++lm) sh[3 * lm + c] += flux * Y[lm];
        }
    }
}

static void check_project(verdict *v, const bench *b, const double *own, const double size[3],
                          int bands, double tolerance) {
    double *sh = (double *)malloc((size_t)(3 * bands * bands) * sizeof *sh), worst = 0;
    watch clock_watch = watch_for(10);
    if (!sh) return;
    hold(v, PROMISE_OK, call_project(sh, bands, &b->src, 0, tolerance, &clock_watch), 0);
    for (int l = 0; l < bands; ++l)
        for (int lm = l * l; lm < (l + 1) * (l + 1); ++lm)
            for (int c = 0; c < 3; ++c) {
                double off = fabs(sh[3 * lm + c] - own[3 * lm + c]) / sqrt(2 * l + 1);
                worst = fmax(worst, size[c] > 0 ? off / size[c] : off);
            }
    hold(v, PROMISE_PROJECT, worst, tolerance + 1e-7);
    free(sh);
}

/* At some directions, and at some texels of a map that is filled. */
static void check_series(verdict *v, bench *b, const double *sh, int bands) {
    unsigned long long state = b->w->seed;
    size_t count = oracle_count(b->w->dst_mapping, b->w->dst_size);
    double d[3], size, rgb[3], worst = 0, filled = 0;
    watch clock_watch = watch_for(10);
    hold(v, PROMISE_OK, call_fill(&b->dst, 0, sh, bands, b->w->tolerance, &clock_watch), 0);
    for (int i = 0; i < 100; ++i) {
        size_t at = (size_t)(test_random(&state) * (double)count);
        oracle_random_direction(d, &state);
        hold(v, PROMISE_OK, envmap_sh_evaluate(rgb, sh, bands, d), 0);
        for (int c = 0; c < 3; ++c) {
            double own = oracle_series(&size, sh, bands, c, d);
            worst = fmax(worst, size > 0 ? fabs(rgb[c] - own) / size : fabs(rgb[c]));
        }
        oracle_axis_of(d, b->w->dst_mapping, b->w->dst_size, b->dst_texels + at);
        for (int c = 0; c < 3; ++c) {
            double own = oracle_series(&size, sh, bands, c, d);
            double off = fabs((double)b->dst.texels[3 * at + (size_t)c] - own);
            filled = fmax(filled, off / (size + judge_tiny));
        }
    }
    hold(v, PROMISE_EVALUATE, worst, 1e-9);
    hold(v, PROMISE_EVALUATE, filled, fmax(b->w->tolerance, 1e-6));
}

/* out(R d) = sh(d), R made of three random vectors at right angles; a mirror image now and then. */
static void check_rotate(verdict *v, const bench *b, const double *sh, int bands) {
    unsigned long long state = b->w->seed;
    double R[9], d[3], turned[3], size, *out, worst = 0;
    oracle_random_direction(R, &state);
    oracle_tangent(R + 3, R, 2 * PI * test_random(&state));
    for (int i = 0; i < 3; ++i)
        R[6 + i] = (state & 1 ? 1 : -1) *
                   (R[(i + 1) % 3] * R[3 + (i + 2) % 3] - R[(i + 2) % 3] * R[3 + (i + 1) % 3]);
    if (!(out = (double *)malloc((size_t)(3 * bands * bands) * sizeof *out))) return;
    hold(v, PROMISE_OK, envmap_sh_rotate(out, sh, bands, R), 0);
    for (int i = 0; i < 30; ++i) {
        oracle_random_direction(d, &state);
        for (int r = 0; r < 3; ++r) turned[r] = oracle_dot(R + 3 * r, d);
        for (int c = 0; c < 3; ++c) {
            double own = oracle_series(&size, sh, bands, c, d);
            double off = fabs(oracle_series(&size, out, bands, c, turned) - own);
            worst = fmax(worst, size > 0 ? off / size : off);
        }
    }
    hold(v, PROMISE_ROTATE, worst, 1e-9);
    free(out);
}

static void check_convolve(verdict *v, bench *b, const double *sh, int bands) {
    double lambda[32], square, size, *out, worst = 0, norm = oracle_norm(&b->lobe);
    double p = oracle_p(&b->lobe, 0, b->w->dst_slices);
    if (!(out = (double *)malloc((size_t)(3 * bands * bands) * sizeof *out))) return;
    oracle_zonal(lambda, &square, &size, bands, &b->lobe, p);
    if (!(norm > 0)) norm = lambda[0];
    hold(v, PROMISE_OK, envmap_sh_convolve(out, sh, bands, &b->header_lobe, p), 0);
    for (int l = 0; l < bands; ++l)
        for (int i = 3 * l * l; i < 3 * (l + 1) * (l + 1); ++i) {
            double off = fabs(out[i] - sh[i] * lambda[l] / norm);
            if (off > 0) worst = fmax(worst, off / (fabs(sh[i]) * size / norm));
        }
    hold(v, PROMISE_CONVOLVE, worst, 1e-6);
    free(out);
}

static void check_harmonics(verdict *v, bench *b) {
    size_t texels = oracle_count(b->w->src_mapping, b->w->src_size);
    int bands = 1 + (int)(b->w->seed % (texels > 20000 ? 6 : 20));
    double *sh = (double *)malloc((size_t)(3 * bands * bands) * sizeof *sh), size[3];
    if (!sh) return;
    own_project(sh, size, bands, b);
    check_project(v, b, sh, size, bands, 0);
    check_project(v, b, sh, size, bands, b->w->tolerance);
    check_series(v, b, sh, bands);
    check_rotate(v, b, sh, bands);
    check_convolve(v, b, sh, bands);
    free(sh);
}

/* The least value, over many directions and the means' size, of what the lobe makes of sh. */
static double window_least(const double *sh, int bands, const double *lambda, double norm,
                           unsigned long long state) {
    double filtered[3 * 8 * 8], d[3], size, least = HUGE_VAL;
    for (int l = 0; l < bands; ++l)
        for (int i = 3 * l * l; i < 3 * (l + 1) * (l + 1); ++i)
            filtered[i] = sh[i] * lambda[l] / norm;
    for (int i = 0; i < 4000; ++i) {
        oracle_random_direction(d, &state);
        for (int c = 0; c < 3; ++c)
            if (filtered[c] > 0)
                least = fmin(least, oracle_series(&size, filtered, bands, c, d) /
                                        (filtered[c] * sqrt(0.25 / PI)));
    }
    return least;
}

/* Coefficients of the scene, or (odd seeds) at random about a mean of 1. */
static void check_window(verdict *v, bench *b) {
    unsigned long long state = b->w->seed;
    int bands = 2 + (int)(b->w->seed % 5), diffuse = work_below(2, &state);
    double sh[3 * 36], out[3 * 36], size[3], lambda[6], square, all, moved, norm = 1;
    own_project(sh, size, bands, b);
    for (int i = 0; b->w->seed & 1 && i < 3 * bands * bands; ++i)
        sh[i] = i < 3 ? 3.5 : 3 * (2 * test_random(&state) - 1);
    for (int l = 0; l < 6; ++l) lambda[l] = 1;
    envmap_lobe lobe = envmap_lobe_diffuse();
    oracle_lobe own = {LOBE_DIFFUSE, 0, 1, 0, 1, 0, 0, 0, 0, NULL, 0};
    if (diffuse) oracle_zonal(lambda, &square, &all, bands, &own, 0), norm = lambda[0];
    hold(v, PROMISE_OK, envmap_sh_window(out, &moved, sh, bands, diffuse ? &lobe : NULL, 0), 0);
    double before = window_least(sh, bands, lambda, norm, state);
    double least = window_least(out, bands, lambda, norm, state);
    hold(v, PROMISE_WINDOW, -least, 1e-6);
    for (int c = 0; c < 3; ++c) hold(v, PROMISE_WINDOW, fabs(out[c] - sh[c]), 1e-12 * fabs(sh[c]));
    hold(v, PROMISE_WINDOW, moved < 0 || moved > 1 || (before < -1e-6 && !(moved > 0)), 0);
}

/* ------------------------------------------------------------------------- resampling, mips ---- */

/* The mean of the source's texels, as boxes, over a result's texel, the part inside its rim. */
static void own_resample(double rgb[3], const oracle_image *image, const bench *b,
                         const oracle_texel *t, int points) {
    int size = b->w->dst_size, width = oracle_width(b->w->dst_mapping, size);
    double sum = 0, d[3], hair = 0.01 / points;
    rgb[0] = rgb[1] = rgb[2] = 0;
    for (int i = 0; i < points * points; ++i) {
        double u = (t->x + (i % points + 0.5) / points) / width;
        double v = (t->y + (i / points + 0.5) / points) / size, at[2];
        double X = 2 * u - 1, Y = 1 - 2 * v, w = 1;
        if (oracle_is_disc(b->w->dst_mapping) && X * X + Y * Y > 1) continue;
        if (oracle_is_disc(b->w->dst_mapping)) w = oracle_density(b->w->dst_mapping, X * X + Y * Y);
        else
            w = oracle_cell(at, at + 1, b->w->dst_mapping, t->face, u - hair / width,
                            v - hair / size, u + hair / width, v + hair / size);
        oracle_direction(d, b->w->dst_mapping, t->face, u, v);
        int face, x, y;
        oracle_coordinates(&face, &u, &v, image->mapping, d);
        x = (int)oracle_clamp(u * image->width, 0, image->width - 1);
        y = (int)oracle_clamp(v * image->size, 0, image->size - 1);
        oracle_tap(rgb, image, face, x, y, w);
        sum += w;
    }
    for (int c = 0; c < 3; ++c) rgb[c] /= sum;
}

static double own_energy(const float *map, const oracle_texel *texels, size_t count) {
    double sum = 0;
    for (size_t i = 0; i < 3 * count; ++i) sum += texels[i / 3].w * (double)map[i];
    return sum;
}

/* Some texels that are resampled, the brightest first. */
static void check_means(verdict *v, const bench *b, double ratio) {
    size_t count = oracle_count(b->w->dst_mapping, b->w->dst_size), step = judge_stride(count);
    oracle_image image = oracle_image_of(b->src.texels, b->w->src_mapping, b->w->src_size);
    int points = (int)(64 * ratio); /* 64 a texel's side: boxes have edges */
    double error = 0, square = 0, start = cpu_seconds(), rgb[3];
    size_t at = 0, i;
    for (i = 0; i < count; ++i)
        if (b->dst.texels[3 * i] > b->dst.texels[3 * at] && b->dst_texels[i].w > 0) at = i;
    for (i = 0; i < count && (i < 4 || cpu_seconds() - start < 0.3);
         ++i, at = (at + step) % count) {
        if (!(b->dst_texels[at].w > 0)) continue;
        own_resample(rgb, &image, b, b->dst_texels + at, points);
        for (int c = 0; c < 3; ++c) {
            double off = (double)b->dst.texels[3 * at + (size_t)c] - rgb[c];
            error += b->dst_texels[at].w * off * off;
            square += b->dst_texels[at].w * rgb[c] * rgb[c];
        }
    }
    if (square > 0) hold(v, PROMISE_MEAN, sqrt(error / square), 0.05);
}

static void check_resample(verdict *v, bench *b) {
    size_t count = oracle_count(b->w->dst_mapping, b->w->dst_size);
    size_t from = oracle_count(b->w->src_mapping, b->w->src_size);
    double least = HUGE_VAL, most = -HUGE_VAL, out = 0;
    double ratio = oracle_extent(b->w->dst_mapping, b->w->dst_size) /
                   oracle_extent(b->w->src_mapping, b->w->src_size);
    if (ratio > 16) return; /* texels of thousands */
    hold(v, PROMISE_OK, envmap_resample(&b->dst, &b->src, NULL), 0);
    for (size_t i = 0; i < 3 * from; ++i)
        least = fmin(least, (double)b->src.texels[i]), most = fmax(most, (double)b->src.texels[i]);
    for (size_t i = 0; i < 3 * count; ++i)
        out = fmax(out, fmax(least - (double)b->dst.texels[i], (double)b->dst.texels[i] - most));
    hold(v, PROMISE_RANGE, out, 1e-6 * most);
    if (b->w->scene == SCENE_CONSTANT) hold(v, PROMISE_IDENTITY, out, 1e-6 * most);
    if (b->w->dst_mapping == b->w->src_mapping && b->w->dst_size == b->w->src_size)
        hold(v, PROMISE_IDENTITY, memcmp(b->dst.texels, b->src.texels, 12 * from) != 0, 0);
    /* else boxes are smoothed, or those of a cube between two others show; a sphere map's rim mixes
       texels; points are too few for texels alone */
    int alone = b->w->scene == SCENE_TEXEL || b->w->scene == SCENE_SUN;
    if (ratio > 2.5 && b->w->src_size > 23 && b->w->src_mapping != ENVMAP_SPHERE &&
        b->w->dst_mapping != ENVMAP_SPHERE && !alone)
        check_means(v, b, ratio);
    double light = own_energy(b->src.texels, b->src_texels, from);
    int slivers = 0; /* that a rim cuts, of either map */
    for (int i = 0; i < 2; ++i) {
        int mapping = i ? b->w->dst_mapping : b->w->src_mapping;
        slivers |= mapping == ENVMAP_SPHERE || mapping == ENVMAP_ANGULAR;
    }
    if (ratio > 1)
        hold(v, PROMISE_ENERGY, fabs(own_energy(b->dst.texels, b->dst_texels, count) - light),
             (slivers ? 0.05 : 0.01) * light);
}

/* One texel of a level from the level above, whose edge is `above`. */
static void own_mip(double rgb[3], const bench *b, const float *from, int above,
                    const oracle_texel *t, int edge) {
    int m = b->w->dst_mapping, width = oracle_width(m, edge), wide = oracle_width(m, above);
    double sum = 0, u, v;
    rgb[0] = rgb[1] = rgb[2] = 0;
    for (int y = t->y * above / edge; y * edge < (t->y + 1) * above; ++y)
        for (int x = t->x * wide / width; x * width < (t->x + 1) * wide; ++x) {
            double u0 = fmax((double)x / wide, (double)t->x / width);
            double u1 = fmin((x + 1.0) / wide, (t->x + 1.0) / width);
            double v0 = fmax((double)y / above, (double)t->y / edge);
            double v1 = fmin((y + 1.0) / above, (t->y + 1.0) / edge);
            double w = oracle_cell(&u, &v, m, t->face, u0, v0, u1, v1);
            size_t at = (size_t)((t->face * above + y) * wide + x);
            for (int c = 0; c < 3; ++c) rgb[c] += w * (double)from[3 * at + (size_t)c];
            sum += w;
        }
    for (int c = 0; c < 3; ++c) rgb[c] /= sum;
}

/* Every texel of a level; one of edge 1 is the mean of the sphere. */
static double check_mip_level(const bench *b, int level) {
    int m = b->w->dst_mapping, edge = oracle_edge(b->w->dst_size, level);
    int above = oracle_edge(b->w->dst_size, level - 1);
    const float *to = envmap_texel(&b->dst, level, 0, 0, 0, 0);
    const float *from = envmap_texel(&b->dst, level - 1, 0, 0, 0, 0);
    oracle_texel *texels = oracle_texels(m, edge), *parents = oracle_texels(m, above);
    double worst = 0, mean[3] = {0, 0, 0}, peak = 0, all = 0;
    for (size_t i = 0; i < oracle_count(m, above); ++i, all += parents[i - 1].w)
        for (int c = 0; c < 3; ++c) {
            mean[c] += parents[i].w * (double)from[3 * i + (size_t)c];
            peak = fmax(peak, (double)from[3 * i + (size_t)c]);
        }
    for (size_t i = 0; i < oracle_count(m, edge); ++i) {
        double rgb[3] = {mean[0] / all, mean[1] / all, mean[2] / all};
        if (!(texels[i].w > 0)) continue;
        double least = fmax(1e-3, 1e-10 / texels[i].w) * peak; /* overlaps are known to 1e-15 sr */
        if (edge > 1) own_mip(rgb, b, from, above, texels + i, edge);
        for (int c = 0; c < 3; ++c)
            worst = fmax(worst, off_by((double)to[3 * i + (size_t)c], rgb[c], least));
    }
    free(texels), free(parents);
    return worst;
}

/* dst takes a scene of its own, in every slice; the first is looked at. */
static int fill_levels(bench *b) {
    envmap scene;
    work w = *b->w;
    w.src_mapping = w.dst_mapping, w.src_size = w.dst_size, w.src_slices = w.dst_slices;
    if (!work_source(&scene, &w, b->dst_texels)) return 0;
    memcpy(b->dst.texels, scene.texels, bench_floats(b) * sizeof(float));
    envmap_free(&scene);
    return envmap_mips_build(&b->dst) == ENVMAP_OK;
}

static void check_mips(verdict *v, bench *b) {
    hold(v, PROMISE_OK, !fill_levels(b), 0);
    for (int level = 1; level < b->dst.levels; ++level)
        hold(v, PROMISE_MIPS, check_mip_level(b, level), 1e-5);
}

/* ---------------------------------------------------------------------------------- lookups ---- */

/* Anywhere; or close to an edge, corner, rim, pole or texel's centre of some face. */
static void lookup_direction(float out[3], const bench *b, unsigned long long *state) {
    double d[3], u = test_random(state), v = test_random(state), size = b->w->dst_size;
    int how = work_below(5, state), face = work_below(oracle_faces(b->w->dst_mapping), state);
    if (how & 1) u = work_below(2, state) ? 1e-3 * u : 1 - 1e-3 * u;
    if (how & 2) v = work_below(2, state) ? 1e-3 * v : 1 - 1e-3 * v;
    if (how == 4) u = (floor(u * 2 * size) + 0.5) / (2 * size), v = (floor(v * size) + 0.5) / size;
    oracle_direction(d, b->w->dst_mapping, face, u, v);
    if (how == 0) oracle_random_direction(d, state);
    for (int i = 0; i < 3; ++i) out[i] = (float)(d[i] * (1 + test_random(state)));
    for (int i = 0; how == 4 && i < 3; ++i) out[i] = (float)d[i];
}

/* Two levels and two slices at most, linear between. */
static void own_lookup(double rgb[3], const bench *b, const double d[3], double p, double level) {
    int slices = b->w->dst_slices;
    double range = (double)b->dst.p1 - (double)b->dst.p0;
    double s = oracle_clamp((p - (double)b->dst.p0) / range * slices - 0.5, 0, slices - 1);
    double l = oracle_clamp(level, 0, b->dst.levels - 1);
    rgb[0] = rgb[1] = rgb[2] = 0;
    for (int i = 0; i < 4; ++i) {
        int slice = (int)s + (i & 1), at = (int)l + (i >> 1);
        double weight =
            (i & 1 ? s - (int)s : 1 - s + (int)s) * (i & 2 ? l - (int)l : 1 - l + (int)l);
        if (!(weight > 0)) continue;
        oracle_image image = oracle_image_of(envmap_texel(&b->dst, at, slice, 0, 0, 0),
                                             b->w->dst_mapping, oracle_edge(b->w->dst_size, at));
        oracle_lookup(rgb, &image, d, weight);
    }
}

static void check_geometry(verdict *v, const bench *b, const float dir[3],
                           unsigned long long *state) {
    int m = b->w->dst_mapping, face, own_face;
    const oracle_texel *t = b->dst_texels + work_below((int)oracle_count(m, b->w->dst_size), state);
    double d[3] = {(double)dir[0], (double)dir[1], (double)dir[2]}, own_u, own_v;
    float u, w;
    hold(v, PROMISE_GEOMETRY,
         off_by(envmap_solid_angle(&b->dst, 0, t->face, t->x, t->y), t->w, 1e-9), 1e-7);
    envmap_coordinates(&face, &u, &w, (envmap_mapping)m, dir);
    oracle_coordinates(&own_face, &own_u, &own_v, m, d);
    if (face != own_face) return; /* on an edge */
    double across = fabs((double)u - own_u);
    if (m == ENVMAP_LATLONG) across = fmin(across, 1 - across);
    hold(v, PROMISE_GEOMETRY, fmax(across, fabs((double)w - own_v)), 1e-6);
}

static void check_lookups(verdict *v, bench *b) {
    unsigned long long state = b->w->seed;
    double worst = 0;
    if (!fill_levels(b)) return;
    for (int i = 0; i < 500; ++i) {
        float dir[3], rgb[3], level = (float)(work_below(3, &state) ? 0 : 9 * test_random(&state));
        float p = (float)(2.2 * test_random(&state) - 1.1);
        double d[3], own[3], n;
        lookup_direction(dir, b, &state);
        for (int j = 0; j < 3; ++j) d[j] = (double)dir[j];
        n = sqrt(oracle_dot(d, d));
        if (!(n > 0.5)) continue;
        for (int j = 0; j < 3; ++j) d[j] /= n;
        if (d[0] * d[0] + d[1] * d[1] < 1e-10) continue; /* rims are one point: any of them */
        envmap_lookup_slice(rgb, &b->dst, dir, p, level);
        own_lookup(own, b, d, (double)p, (double)level);
        for (int c = 0; c < 3; ++c)
            worst = fmax(worst, off_by((double)rgb[c], own[c], 1e-2 * b->w->times));
        check_geometry(v, b, dir, &state);
    }
    hold(v, PROMISE_LOOKUP, worst, 1e-4);
}

/* -------------------------------------------------------------------------------- all of it ---- */

typedef void check_function(verdict *v, bench *b);
static check_function *const check_functions[CHECK_COUNT] = {
    check_filter,   check_chain,      check_prepared, check_furnace, check_executors,
    check_failures, check_neighbours, check_plan,     check_lobes,   check_harmonics,
    check_window,   check_resample,   check_mips,     check_lookups};

/* No call may touch its source or keep memory. */
static verdict check_work(const work *w) {
    verdict v = verdict_none();
    int live = oracle_live;
    bench b;
    if (bench_create(&b, w)) check_functions[w->check](&v, &b);
    bench_free(&b);
    hold(&v, PROMISE_UNTOUCHED, oracle_live != live, 0);
    return v;
}

/* The verdict on a work as tests list them: its maps and its lobe, and its scene. Nothing is held
   (over is negative) where it cannot be read. Quick forms run under sanitizers and valgrind, and
   get their time. */
static verdict check_line(const char *check, const char *what, const char *scene, int seed) {
    char text[400];
    work w;
    snprintf(text, sizeof text, "check=%s method=auto src=%s scene=%s times=1 seed=%d", check, what,
             scene, seed);
    if (!work_read(&w, text)) return verdict_none();
    check_patience = test_timed() ? 1 : 40;
    verdict v = check_work(&w);
    check_patience = 1;
    return v;
}

#endif
