/* SPDX-License-Identifier: MIT
   Banks' thin rings, tile by tile of the source: against the definition, which search_oracle.h
   writes a second time, against the integral of a ring, and against each other. */
#define _POSIX_C_SOURCE 200809L
#define ENVMAP_IMPLEMENTATION
#include "search_others.h"

/* ----------------------------------------------------------------------------------- tools ---- */

/* Sources whose mean texel a ring is `texels` times as wide as, from its middle to its edge. */
static int edge_for(int mapping, double s, double texels) {
    int edge = 30;
    while (oracle_extent(mapping, edge) * texels > acos(s)) ++edge;
    return edge;
}

static work work_of(int from, int edge, int to, int size, double s, const char *scene) {
    char text[400];
    work w;
    snprintf(text, sizeof text,
             "check=filter method=fast src=%s:%d:1 dst=%s:%d:2 lobe=banks:%.9g:0 raw=0:1 "
             "tolerance=1e-3 scene=%s times=1 seed=1",
             work_mappings[from], edge, work_mappings[to], size, s, scene);
    if (!CHECK(work_read(&w, text))) printf("    %s\n", text);
    return w;
}

/* The room itself, wherever FAST may go for such a work. */
static envmap_result rings(envmap *dst, const envmap *src, const envmap_lobe *lobe, int *served) {
    envmap_filter_desc desc;
    envmapi_pool pool;
    memset(&desc, 0, sizeof desc), memset(&pool, 0, sizeof pool);
    desc.tolerance = 1e-3f;
    dst->p0 = lobe->p0, dst->p1 = lobe->p1;
    envmap_result result =
        envmapi_filter_banks(dst, src, 0, dst->slices, served, lobe, &desc, &pool);
    envmapi_pool_free(&pool, 0);
    return result;
}

/* All mappings; the cube only in quick forms. */
static int sources(void) { return test_many(MAPPINGS) < MAPPINGS ? 1 : MAPPINGS; }

/* Rings this wide in texels from a mapping to the next few; prints the worst of all. Two of the
   scenes; all in the whole form. */
static void rings_keep(int from, double texels, double s) {
    static const char *const scenes[] = {"noise:0:0", "sun:0.42:0.45", "texel:0.334:0.99",
                                         "texel:0.6:0.01"};
    double rms = 0, worst = 0;
    for (int i = test_whole() ? 0 : from % 2; i < 4; i += test_whole() ? 1 : 2) {
        work w = work_of(from, edge_for(from, s, texels), (from + i) % MAPPINGS, 10, s, scenes[i]);
        bench b;
        int served = 0;
        CHECK(bench_create(&b, &w));
        CHECK(rings(&b.dst, &b.src, &b.header_lobe, &served) == ENVMAP_OK && served);
        judge j = judge_map(&b, b.dst.texels, w.dst_size, w.dst_slices, 0.1);
        if (j.error > 1) j = judge_map(&b, b.dst.texels, w.dst_size, w.dst_slices, 2);
        rms = fmax(rms, j.error), worst = fmax(worst, j.worst);
        bench_free(&b);
    }
    FIGURE("rms in tolerances", rms, 1);
    FIGURE("the worst texel's", worst, 20);
}

/* ----------------------------------------------------------------------------------- tests ---- */

static void rings_wider_than_two_texels_keep_the_tolerance(void) {
    for (int from = 0; from < sources(); ++from) rings_keep(from, 3.5, 0.998);
}

static void rings_of_tents_keep_the_tolerance(void) {
    for (int from = 0; from < sources(); ++from) rings_keep(from, 2.4, 0.9995);
}

/* Thinner ones against the reference at a third of the tolerance, whose rings lie elsewhere. */
static void rings_agree(double texels, double s) {
    double error = 0;
    for (int from = 0; from < sources(); ++from) {
        int n = 2 * 6 * 4 * 3, served = 0;
        work w = work_of(from, edge_for(from, s, texels), ENVMAP_CUBE, 2, s,
                         from % 2 ? "noise:0:0" : "lamps:0.42:0.45");
        double square = 0, off = 0;
        bench b, fine;
        envmap_filter_desc desc;
        memset(&desc, 0, sizeof desc);
        desc.method = ENVMAP_METHOD_REFERENCE, desc.tolerance = 3e-4f;
        CHECK(bench_create(&b, &w) && bench_create(&fine, &w));
        CHECK(envmap_filter(&fine.dst, &b.src, &b.header_lobe, &desc) == ENVMAP_OK);
        CHECK(rings(&b.dst, &b.src, &b.header_lobe, &served) == ENVMAP_OK && served);
        for (int k = 0; k < n; ++k) {
            double expected = (double)fine.dst.texels[k];
            square += expected * expected, off += pow((double)b.dst.texels[k] - expected, 2);
        }
        error = fmax(error, sqrt(off / square) / 1e-3);
        bench_free(&b), bench_free(&fine);
    }
    FIGURE("rms in tolerances", error, 1);
}

static void rings_between_tents_and_bilinear_radiance_agree_with_the_reference(void) {
    rings_agree(1.8, 0.9995);
}

static void rings_thinner_than_a_texel_agree_with_the_reference(void) { rings_agree(0.7, 0.9999); }

/* What a lit texel sends along all axes whose ring sees it, against sums over 240 x 240 directions
   about it: in the middle of a face, beside an edge, in a corner, at a pole, on a fold. */
static void a_lit_texel_counts_its_bilinear_radiance(void) {
    enum { N = 240 };
    static const struct {
        int mapping, edge, face, x, y;
    } lit[] = {{ENVMAP_CUBE, 64, 2, 63, 10},       {ENVMAP_LATLONG, 64, 0, 20, 3},
               {ENVMAP_OCTAHEDRAL, 96, 0, 47, 20}, {ENVMAP_CUBE, 64, 2, 50, 30},
               {ENVMAP_CUBE, 64, 2, 0, 0},         {ENVMAP_LATLONG, 64, 0, 0, 30},
               {ENVMAP_LATLONG, 64, 0, 20, 63},    {ENVMAP_OCTAHEDRAL, 96, 0, 0, 0},
               {ENVMAP_OCTAHEDRAL, 96, 0, 24, 23}, {ENVMAP_PARABOLOID, 64, 0, 9, 9},
               {ENVMAP_PARABOLOID, 64, 1, 40, 40}, {ENVMAP_ANGULAR, 96, 0, 60, 60}};
    const double p = (double)-0.4f, s = (double)0.9999f, w = acos(s), A = acos(-p);
    double norm = 2 * PI * (w - sin(w) * s), worst = 0; /* over sin A = 1, times 1 - s */
    for (int i = 0; i < (test_many(MAPPINGS) < MAPPINGS ? 3 : 12); ++i) {
        int mapping = lit[i].mapping, edge = lit[i].edge;
        int size = mapping == ENVMAP_PARABOLOID ? 20 : 10; /* of few axes >>reference has all */
        work one = work_of(mapping, edge, ENVMAP_CUBE, size, s, "constant:0:0");
        double centre[3], side[3], other[3], square = 0, off = 0;
        float d[3];
        bench b;
        int served = 0;
        one.dst_slices = 1;
        CHECK(bench_create(&b, &one));
        memset(b.src.texels, 0,
               3 * (size_t)(envmap_faces(mapping) * edge * envmapi_width(mapping, edge)) *
                   sizeof(float));
        for (int c = 0; c < 3; ++c)
            envmap_texel(&b.src, 0, 0, lit[i].face, lit[i].x, lit[i].y)[c] = 1;
        b.header_lobe.p0 = b.header_lobe.p1 = -0.4f;
        CHECK(rings(&b.dst, &b.src, &b.header_lobe, &served) == ENVMAP_OK && served);
        envmap_direction(d, mapping, lit[i].face,
                         (float)((lit[i].x + 0.5) / envmapi_width(mapping, edge)),
                         (float)((lit[i].y + 0.5) / edge));
        for (int c = 0; c < 3; ++c) centre[c] = (double)d[c];
        envmapi_tangents(side, other, centre, NULL);
        double reach = 3.5 * fmax(oracle_extent(mapping, edge), PI / 2 / 64);
        for (int n = 0; n < 6 * size * size; ++n) {
            float axis[3], rgb[3];
            double x = 0, sum = 0;
            envmap_direction(axis, ENVMAP_CUBE, n / size / size, (float)((n % size + 0.5) / size),
                             (float)((n / size % size + 0.5) / size));
            for (int c = 0; c < 3; ++c) x += (double)axis[c] * centre[c];
            if (fabs(acos(x) - A) > w + 1.5 * reach) continue;
            for (int k = 0; k < N * N; ++k) {
                double u = (2 * (k % N + 0.5) / N - 1) * reach, r;
                double v = (2 * (k / N + 0.5) / N - 1) * reach;
                r = sqrt(1 + u * u + v * v), x = 0;
                for (int c = 0; c < 3; ++c) {
                    d[c] = (float)((centre[c] + u * side[c] + v * other[c]) / r);
                    x += (double)axis[c] * (centre[c] + u * side[c] + v * other[c]) / r;
                }
                double ring = cos(acos(x) - A) - s;
                if (!(ring > 0)) continue;
                envmap_lookup(rgb, &b.src, d, 0);
                sum += ring * (double)rgb[0] * pow(2 * reach / N, 2) / (r * r * r);
            }
            sum /= norm;
            square += sum * sum, off += pow((double)b.dst.texels[3 * n] - sum, 2);
        }
        if (sqrt(off / square) > 5e-4)
            printf("    %s %d: texel %d %d, %.3g\n", work_mappings[mapping], edge, lit[i].x,
                   lit[i].y, sqrt(off / square));
        worst = fmax(worst, sqrt(off / square));
        bench_free(&b);
    }
    FIGURE("rms of the texel's light, off by", worst, 1e-3);
}

/* A ring of half-width w at the angle A: the integral of cos(theta - A) - s over it is
   2 pi sin A (w - sin w cos w), and a constant becomes that over the same at A = pi/2: sin A. */
static void a_constant_becomes_the_sine_of_the_rings_angle(void) {
    static const double lobes[] = {0.9999, 0.99999, 0.999999};
    double error = 0;
    for (int i = 0; i < 3 * sources(); ++i) {
        int edge = edge_for(i / 3, 0.9999, 0.6);
        work w = work_of(i / 3, edge, ENVMAP_CUBE, 3, lobes[i % 3], "constant:0:0");
        bench b;
        int served = 0;
        CHECK(bench_create(&b, &w));
        b.header_lobe.p0 = -0.7f, b.header_lobe.p1 = 0.5f; /* centres at -0.4, 0.2 */
        CHECK(rings(&b.dst, &b.src, &b.header_lobe, &served) == ENVMAP_OK && served);
        for (int n = 0; n < 2 * 6 * 9; ++n) {
            double p = n < 6 * 9 ? -0.4 : 0.2, expected = (double)b.src.texels[0] * sqrt(1 - p * p);
            error = fmax(error, fabs((double)b.dst.texels[3 * n] / expected - 1));
        }
        bench_free(&b);
    }
    FIGURE("off by, relatively", error, 1e-3);
}

/* Slices at p and -p see the same rings from opposite sides: made together or one by one. */
static void slices_made_together_are_those_made_one_by_one(void) {
    static const double widths[] = {3.5, 2.4, 1.8};
    for (int i = 0; i < 3; ++i) {
        int edge = edge_for(ENVMAP_CUBE, 0.9995, widths[i]), served = 0, n = 2 * 16 * 16 * 3;
        work w = work_of(ENVMAP_CUBE, edge, ENVMAP_PARABOLOID, 16, 0.9995, "noise:0:0");
        double off = 0, mean = 0;
        bench b, one;
        CHECK(bench_create(&b, &w));
        w.dst_slices = 1;
        CHECK(bench_create(&one, &w));
        b.header_lobe.p0 = -0.8f, b.header_lobe.p1 = 0.8f; /* centres at -0.4 and 0.4 */
        CHECK(rings(&b.dst, &b.src, &b.header_lobe, &served) == ENVMAP_OK && served);
        for (int k = 0; k < 2; ++k) {
            one.header_lobe.p0 = one.header_lobe.p1 = k ? 0.4f : -0.4f;
            CHECK(rings(&one.dst, &b.src, &one.header_lobe, &served) == ENVMAP_OK && served);
            for (int j = 0; j < n; ++j) {
                double of = (double)b.dst.texels[k * n + j];
                off = fmax(off, fabs(of - (double)one.dst.texels[j])), mean += of / (2 * n);
            }
        }
        FIGURE("of the mean, at most", off / mean, 1e-4);
        bench_free(&b), bench_free(&one);
    }
}

/* CPU time of a cube's 8 slices, the better of two; where nothing is timed, of smaller ones. */
static double seconds(double s) {
    work w = work_of(ENVMAP_CUBE, test_timed() ? 256 : 72, ENVMAP_PARABOLOID,
                     test_timed() ? 32 : 10, s, "noise:0:0");
    double best = HUGE_VAL;
    bench b;
    w.dst_slices = 8;
    CHECK(bench_create(&b, &w));
    for (int i = 0; i < 2; ++i) {
        clock_t from = clock();
        int served = 0;
        CHECK(rings(&b.dst, &b.src, &b.header_lobe, &served) == ENVMAP_OK && served);
        best = fmin(best, (double)(clock() - from) / CLOCKS_PER_SEC);
    }
    bench_free(&b);
    return best;
}

static void rings_of_any_width_take_a_few_times_as_long_as_their_neighbours(void) {
    double wide = seconds(0.9999), thin = seconds(0.99995), thinner = seconds(0.99999);
    if (!test_timed()) return;
    FIGURE("1.6 texels, times 2.3", thin / wide, 6);
    FIGURE("0.7 texels, times 2.3", thinner / wide, 6);
}

/* FAST goes there, and keeps the rules of every call. */
static void all_rules_are_kept(void) {
    static const int checks[] = {CHECK_EXECUTORS, CHECK_FAILURES};
    static const struct {
        int mapping, edge;
    } sources[] = {{ENVMAP_CUBE, 260}, {ENVMAP_CUBE, 72}, {ENVMAP_ANGULAR, 198}};
    for (int i = 0; i < 3; ++i) {
        work w = work_of(sources[i].mapping, sources[i].edge, ENVMAP_CUBE, 3, 0.9999, "noise:0:0");
        bench b, room;
        int served = 0;
        envmap_filter_desc desc;
        memset(&desc, 0, sizeof desc);
        desc.method = ENVMAP_METHOD_FAST;
        CHECK(bench_create(&b, &w) && bench_create(&room, &w));
        CHECK(envmap_filter(&b.dst, &b.src, &b.header_lobe, &desc) == ENVMAP_OK);
        CHECK(rings(&room.dst, &room.src, &b.header_lobe, &served) == ENVMAP_OK && served);
        CHECK(!memcmp(b.dst.texels, room.dst.texels, 2 * 6 * 9 * 3 * sizeof(float)));
        bench_free(&b), bench_free(&room);
        for (int j = 0; j < 2; ++j) {
            w.check = checks[j];
            verdict v = check_work(&w);
            v.over[PROMISE_COST] = -1;
            for (int p = 0; p < PROMISE_COUNT; ++p)
                if (!CHECK(!broken(&v, p))) printf("    %s\n", promise_text[p]);
        }
    }
}

int main(void) {
    (void)work_draw, (void)work_simplify, (void)work_print, (void)check_line; /* the search's */
    RUN(rings_wider_than_two_texels_keep_the_tolerance);
    RUN(rings_of_tents_keep_the_tolerance);
    RUN(rings_between_tents_and_bilinear_radiance_agree_with_the_reference);
    RUN(rings_thinner_than_a_texel_agree_with_the_reference);
    RUN(a_lit_texel_counts_its_bilinear_radiance);
    RUN(a_constant_becomes_the_sine_of_the_rings_angle);
    RUN(slices_made_together_are_those_made_one_by_one);
    RUN(rings_of_any_width_take_a_few_times_as_long_as_their_neighbours);
    RUN(all_rules_are_kept);
    return test_summary();
}
