/* SPDX-License-Identifier: MIT
   maps: limits and memory, where texels lie, their solid angles, lookups without seams, resampling
   between all 36 pairs of parameterizations. */
#include "oracle.h"

static const int mappings[] = {ENVMAP_CUBE,    ENVMAP_PARABOLOID, ENVMAP_SPHERE,
                               ENVMAP_LATLONG, ENVMAP_ANGULAR,    ENVMAP_OCTAHEDRAL};

/* A map or the end of the program: what follows makes no sense without it. */
static envmap make(int mapping, int size, int levels, int slices) {
    envmap map = {0};
    if (envmap_create(&map, mapping, size, levels, slices)) {
        printf("    cannot create a %s map of %d\n", oracle_name[mapping], size);
        exit(1);
    }
    return map;
}

/* ------------------------------------------------------------------------ limits and memory -- */

static void levels_halve_down_to_one(void) {
    static const int table[][2] = {{-5, 0}, {0, 0}, {1, 1},  {2, 2},     {3, 2},     {4, 3},
                                   {7, 3},  {8, 4}, {17, 5}, {1023, 10}, {1024, 11}, {16384, 15}};
    for (size_t i = 0; i < sizeof table / sizeof *table; ++i)
        CHECK_CLOSE(envmap_levels(table[i][0]), table[i][1], 0);
}

static void a_new_map_is_black_and_has_its_sizes(void) {
    for (int m = 0; m < MAPPINGS; ++m)
        for (int size = 1; size <= 9; ++size) {
            int levels = envmap_levels(size), here = 0;
            envmap map = {0};
            map.memory = &here;
            CHECK(envmap_create(&map, mappings[m], size, levels, 3) == ENVMAP_OK);
            CHECK(map.mapping == m && map.size == size && map.levels == levels && map.slices == 3);
            CHECK(map.memory == &here && map.texels != NULL);
            CHECK(map.p0 == -1 && map.p1 == 1);
            size_t n = 0;
            float sum = 0;
            for (int l = 0; l < levels; ++l) n += oracle_floats(m, size, 3, l);
            for (size_t i = 0; i < n; ++i) sum += fabsf(map.texels[i]);
            CHECK(sum == 0);
            envmap_free(&map);
            CHECK(map.texels == NULL && map.size == 0 && map.levels == 0 && map.memory == &here);
            envmap_free(&map);
            CHECK(oracle_live == 0 && oracle_wrong_context == 0);
        }
}

static void sizes_beyond_the_limits_are_refused_before_any_allocation(void) {
    static const struct {
        int mapping, size, levels, slices;
    } bad[] = {{0, 0, 1, 1},          {0, -1, 1, 1},         {0, -2147483647 - 1, 1, 1},
               {0, 2147483647, 1, 1}, {0, 8, 0, 1},          {0, 8, -1, 1},
               {0, 8, 5, 1},          {0, 8, 2147483647, 1}, {0, 8, 1, 0},
               {0, 8, 1, -1},         {0, 8, 1, 4097},       {0, 8, 1, 2147483647},
               {0, 16385, 1, 1},      {3, 16385, 1, 1},      {0, 16384, 1, 1}, /* 19 GB */
               {0, 16384, 15, 4096},  {3, 2048, 1, 4096},    {4, 16384, 1, 3},
               {6, 8, 1, 1},          {-1, 8, 1, 1},         {1000, 8, 1, 1}};
    envmap map = {0}, before;
    map.texels = NULL, map.size = 77, map.levels = 5, map.p0 = 3;
    memcpy(&before, &map, sizeof map);
    oracle_calls = 0;
    for (size_t i = 0; i < sizeof bad / sizeof *bad; ++i) {
        envmap_result r =
            envmap_create(&map, bad[i].mapping, bad[i].size, bad[i].levels, bad[i].slices);
        CHECK(r == ENVMAP_ERROR_ARGUMENT || r == ENVMAP_ERROR_LIMIT);
        CHECK(!memcmp(&before, &map, sizeof map));
    }
    CHECK(envmap_create(&map, ENVMAP_CUBE, 16384, 1, 1) == ENVMAP_ERROR_LIMIT);
    CHECK(envmap_create(&map, ENVMAP_CUBE, 16385, 1, 1) == ENVMAP_ERROR_LIMIT);
    CHECK(envmap_create(&map, 7, 8, 1, 1) == ENVMAP_ERROR_ARGUMENT);
    CHECK(envmap_create(NULL, ENVMAP_CUBE, 8, 1, 1) == ENVMAP_ERROR_ARGUMENT);
    CHECK(oracle_calls == 0);
    /* the largest that is allowed gets as far as the memory, which has only 256 MB */
    CHECK(envmap_create(&map, ENVMAP_LATLONG, 16384, 1, 1) == ENVMAP_ERROR_MEMORY);
    CHECK(oracle_calls == 1 && oracle_largest >= (size_t)16384 * 32768 * 12);
    CHECK(!memcmp(&before, &map, sizeof map));
}

static void without_memory_a_map_stays_as_it_was(void) {
    envmap map = {0}, before;
    map.size = 77, map.p1 = 5;
    memcpy(&before, &map, sizeof map);
    for (int n = 0; n < 10; ++n) {
        oracle_calls = 0, oracle_fail_at = n;
        envmap_result r = envmap_create(&map, ENVMAP_PARABOLOID, 16, 5, 2);
        oracle_fail_at = -1;
        if (r == ENVMAP_OK) {
            CHECK(n > 0);
            break;
        }
        CHECK(r == ENVMAP_ERROR_MEMORY);
        CHECK(oracle_live == 0);
        CHECK(!memcmp(&before, &map, sizeof map));
    }
    CHECK(map.texels != NULL);
    envmap_free(&map);
    CHECK(oracle_live == 0);
}

/* --------------------------------------------------------------------------------- texels -- */

static void texels_are_where_the_memory_order_says(void) {
    for (int m = 0; m < MAPPINGS; ++m)
        for (int size = 1; size <= 9; size += 2) {
            envmap map = make(m, size, envmap_levels(size), 2);
            const float *next = map.texels;
            for (int l = 0; l < map.levels; ++l)
                for (int s = 0; s < 2; ++s)
                    for (int f = 0; f < envmap_faces(m); ++f)
                        for (int y = 0; y < oracle_edge(size, l); ++y)
                            for (int x = 0; x < oracle_width(m, oracle_edge(size, l)); ++x) {
                                CHECK(envmap_texel(&map, l, s, f, x, y) == next);
                                next += 3;
                            }
            envmap_free(&map);
        }
}

static void texels_out_of_range_are_null_and_have_no_solid_angle(void) {
    static const int big = 2147483647, small = -2147483647 - 1;
    for (int m = 0; m < MAPPINGS; ++m) {
        envmap map = make(m, 6, 3, 2);
        for (int l = 0; l < 3; ++l) {
            int e = oracle_edge(6, l), w = oracle_width(m, e), faces = envmap_faces(m);
            CHECK(envmap_texel(&map, l, 1, faces - 1, w - 1, e - 1) != NULL);
            const int bad[][5] = {
                {-1, 0, 0, 0, 0}, {3, 0, 0, 0, 0},     {big, 0, 0, 0, 0}, {small, 0, 0, 0, 0},
                {l, 0, -1, 0, 0}, {l, 0, faces, 0, 0}, {l, 0, big, 0, 0}, {l, 0, small, 0, 0},
                {l, 0, 0, -1, 0}, {l, 0, 0, w, 0},     {l, 0, 0, big, 0}, {l, 0, 0, small, 0},
                {l, 0, 0, 0, -1}, {l, 0, 0, 0, e},     {l, 0, 0, 0, big}, {l, 0, 0, 0, small}};
            for (size_t i = 0; i < sizeof bad / sizeof *bad; ++i) {
                CHECK(!envmap_texel(&map, bad[i][0], bad[i][1], bad[i][2], bad[i][3], bad[i][4]));
                CHECK(envmap_solid_angle(&map, bad[i][0], bad[i][2], bad[i][3], bad[i][4]) == 0);
            }
            CHECK(!envmap_texel(&map, l, -1, 0, 0, 0) && !envmap_texel(&map, l, 2, 0, 0, 0));
            CHECK(!envmap_texel(&map, l, big, 0, 0, 0) && !envmap_texel(&map, l, small, 0, 0, 0));
        }
        envmap_free(&map);
        CHECK(!envmap_texel(&map, 0, 0, 0, 0, 0) && !envmap_texel(NULL, 0, 0, 0, 0, 0));
        CHECK(envmap_solid_angle(&map, 0, 0, 0, 0) == 0);
        CHECK(envmap_solid_angle(NULL, 0, 0, 0, 0) == 0);
    }
}

/* --------------------------------------------------------------------------- solid angles -- */

static void solid_angles_sum_to_4_pi(void) {
    static const int sizes[] = {1, 2, 3, 17, 64};
    for (int m = 0; m < MAPPINGS; ++m) {
        double worst = 0;
        for (int i = 0; i < 5; ++i) {
            envmap map = make(m, sizes[i], envmap_levels(sizes[i]), 1);
            for (int l = 0; l < map.levels; ++l) {
                int e = oracle_edge(sizes[i], l), w = oracle_width(m, e);
                double sum = 0;
                for (int f = 0; f < envmap_faces(m); ++f)
                    for (int y = 0; y < e; ++y)
                        for (int x = 0; x < w; ++x) {
                            double omega = envmap_solid_angle(&map, l, f, x, y);
                            CHECK(omega >= 0);
                            sum += omega;
                        }
                double error = fabs(sum / (4 * PI) - 1);
                if (!(error <= worst)) worst = error;
            }
            envmap_free(&map);
        }
        char what[80];
        sprintf(what, "%s: sum of solid angles over 4 pi - 1, sizes 1 2 3 17 64", oracle_name[m]);
        FIGURE(what, worst, 1e-11);
    }
}

static const double gauss_x[4] = {.1834346424956498, .5255324099163290, .7966664774136267,
                                  .9602898564975363};
static const double gauss_w[4] = {.3626837833783620, .3137066458778873, .2223810344533745,
                                  .1012285362903763};

static double gauss(double (*f)(double x, const void *data), const void *data, double a, double b) {
    double sum = 0, mid = (a + b) / 2, half = (b - a) / 2;
    for (int i = 0; i < 4; ++i)
        sum += gauss_w[i] * (f(mid + half * gauss_x[i], data) + f(mid - half * gauss_x[i], data));
    return sum * half;
}

/* Solid angle per area of a disc's plane, sr per unit of (X,Y), from dw = sin t dt dphi. */
static double disc_density(int mapping, double r) {
    if (mapping == ENVMAP_PARABOLOID) return 4 / ((1 + r * r) * (1 + r * r)); /* tan(t/2) = r */
    if (mapping == ENVMAP_SPHERE) return 4;                                   /* sin(t/2) = r */
    return r > 0 ? PI * sin(PI * r) / r : PI * PI;                            /* t = pi r */
}

/* |d_u x d_v| of the oracle's mapping by differences of fourth order. */
static double jacobian(int mapping, int face, double u, double v) {
    double p[3], q[3], g[2][3];
    const double h = 1e-3;
    for (int k = 0; k < 2; ++k) {
        for (int i = 0; i < 3; ++i) g[k][i] = 0;
        for (int s = 1; s <= 2; ++s) {
            double e = s * h, weight = (s == 1 ? 8.0 : -1.0) / (12 * h);
            oracle_direction(p, mapping, face, k == 0 ? u + e : u, k == 1 ? v + e : v);
            oracle_direction(q, mapping, face, k == 0 ? u - e : u, k == 1 ? v - e : v);
            for (int i = 0; i < 3; ++i) g[k][i] += weight * (p[i] - q[i]);
        }
    }
    double c[3] = {g[0][1] * g[1][2] - g[0][2] * g[1][1], g[0][2] * g[1][0] - g[0][0] * g[1][2],
                   g[0][0] * g[1][1] - g[0][1] * g[1][0]};
    return sqrt(c[0] * c[0] + c[1] * c[1] + c[2] * c[2]);
}

typedef struct {
    int mapping, face;
    double x0, x1, y, lo, hi;
} strip;

static double along_row(double x, const void *data) {
    const strip *s = (const strip *)data;
    if (s->mapping == ENVMAP_OCTAHEDRAL) {
        double d[3];
        oracle_direction(d, s->mapping, 0, x, s->y);
        return 4 * oracle_octahedral_density(d);
    }
    if (!oracle_is_disc(s->mapping)) return jacobian(s->mapping, s->face, x, s->y);
    return disc_density(s->mapping, sqrt(x * x + s->y * s->y));
}

/* One row of the texel; for discs the part of it inside, after the substitution y(t) that takes
   the square root out of the ends of the piece lo..hi; for octahedral maps from fold to fold. */
static double across_rows(double t, const void *data) {
    strip s = *(const strip *)data;
    double a = s.x0, b = s.x1, scale = 1;
    s.y = s.lo + (s.hi - s.lo) * t;
    if (oracle_is_disc(s.mapping)) {
        s.y = s.lo + (s.hi - s.lo) * t * t * (3 - 2 * t);
        scale = 6 * t * (1 - t);
        double edge = s.y * s.y < 1 ? sqrt(1 - s.y * s.y) : 0;
        a = fmax(a, -edge), b = fmin(b, edge);
        if (a >= b) return 0;
    }
    double sum = 0, reach = 0.5 - fabs(s.y - 0.5);
    double folds[5] = {a, 0.5 - reach, 0.5, 0.5 + reach, b};
    for (int i = 0; i < 4; ++i) {
        double from = a + (b - a) * i / 4, to = a + (b - a) * (i + 1) / 4;
        if (s.mapping == ENVMAP_OCTAHEDRAL)
            from = fmin(fmax(folds[i], a), b), to = fmin(fmax(folds[i + 1], a), b);
        for (int k = 0; k < 4; ++k)
            sum +=
                gauss(along_row, &s, from + (to - from) * k / 4, from + (to - from) * (k + 1) / 4);
    }
    return sum * scale * (s.hi - s.lo);
}

static double by_rows(int mapping, int face, double x0, double x1, double y0, double y1) {
    strip s = {mapping, face, x0, x1, 0, 0, 0};
    double cuts[8] = {y0, y1}, sum = 0;
    int n = 2;
    if (mapping == ENVMAP_OCTAHEDRAL)
        for (int k = 0; k < 5; ++k) { /* where the horizon meets the texel's sides; the middle */
            double x = fabs((k & 2 ? x0 : x1) - 0.5), y = k < 4 ? (k & 1 ? x : 1 - x) : 0.5;
            if (y > y0 && y < y1) cuts[n++] = y;
        }
    if (oracle_is_disc(mapping))
        for (int k = 0; k < 6; ++k) { /* where the circle meets the texel's sides, and its poles */
            double x = k < 2 ? x0 : k < 4 ? x1 : 0, y = x * x <= 1 ? sqrt(1 - x * x) : -9;
            if (k & 1) y = -y;
            if (y > y0 && y < y1) cuts[n++] = y;
        }
    for (int i = 1; i < n; ++i)
        for (int j = i; j > 0 && cuts[j] < cuts[j - 1]; --j) {
            double t = cuts[j];
            cuts[j] = cuts[j - 1], cuts[j - 1] = t;
        }
    for (int i = 0; i + 1 < n; ++i) {
        s.lo = cuts[i], s.hi = cuts[i + 1];
        for (int k = 0; k < 8; ++k) sum += gauss(across_rows, &s, k / 8.0, (k + 1) / 8.0);
    }
    return sum;
}

static void solid_angles_are_the_integral_over_the_texel(void) {
    static const int sizes[] = {1, 2, 3, 5, 8};
    for (int m = 0; m < MAPPINGS; ++m) {
        double worst = 0;
        int disc = oracle_is_disc(m), cut = 0, outside = 0;
        for (int i = 0; i < 5; ++i) {
            int e = sizes[i], w = oracle_width(m, e);
            envmap map = make(m, e, 1, 1);
            for (int f = 0; f < envmap_faces(m); ++f)
                for (int y = 0; y < e; ++y)
                    for (int x = 0; x < w; ++x) {
                        double a = (double)x / w, b = (x + 1.0) / w, c = (double)y / e,
                               d = (y + 1.0) / e, expected;
                        if (disc)
                            expected = by_rows(m, f, 2 * a - 1, 2 * b - 1, 1 - 2 * d, 1 - 2 * c);
                        else expected = by_rows(m, f, a, b, c, d);
                        double omega = envmap_solid_angle(&map, 0, f, x, y);
                        double error = fabs(omega - expected) * e * e;
                        if (!(error <= worst)) worst = error;
                        outside += expected == 0;
                        cut +=
                            expected > 0 && disc && fmax(fabs(2 * a - 1), fabs(2 * b - 1)) > 0.99;
                    }
            envmap_free(&map);
        }
        char what[80];
        sprintf(what, "%s: solid angle against quadrature, sr * size^2", oracle_name[m]);
        FIGURE(what, worst, 2e-8);
        if (disc) CHECK(cut > 0 && outside > 0);
    }
}

/* A texel that the disc's rim leaves outside has none at all, and one inside some. */
static void texels_outside_the_rim_count_nothing(void) {
    for (int m = 0; m < MAPPINGS; ++m) {
        if (!oracle_is_disc(m)) continue;
        envmap map = make(m, 33, 1, 1);
        for (int y = 0; y < 33; ++y)
            for (int x = 0; x < 33; ++x) {
                double near_x = fmax(0, fabs(x - 16.0) - 0.5) / 16.5;
                double near_y = fmax(0, fabs(y - 16.0) - 0.5) / 16.5;
                int inside = near_x * near_x + near_y * near_y < 1;
                CHECK((envmap_solid_angle(&map, 0, 0, x, y) > 0) == inside);
            }
        envmap_free(&map);
    }
}

/* Largest over smallest solid angle of whole texels at an edge of `size`. */
static double density_ratio(int mapping, int size) {
    envmap map = make(mapping, size, 1, 1);
    double least = 1e9, most = 0;
    for (int y = 0; y < size; ++y)
        for (int x = 0; x < size; ++x) {
            double X = (fabs(x + 0.5 - size / 2.0) + 0.5) / (size / 2.0);
            double Y = (fabs(y + 0.5 - size / 2.0) + 0.5) / (size / 2.0);
            if (oracle_is_disc(mapping) && X * X + Y * Y > 1) continue;
            double omega = envmap_solid_angle(&map, 0, 0, x, y);
            least = fmin(least, omega), most = fmax(most, omega);
        }
    envmap_free(&map);
    return most / least;
}

/* In the limit; two sizes extrapolate the cube's, whose extremes are a texel's centre apart, and the
   octahedral map's, whose least is in a corner. */
static void sampling_density_varies_as_the_papers_say(void) {
    double cube = 2 * density_ratio(ENVMAP_CUBE, 512) - density_ratio(ENVMAP_CUBE, 256);
    double octahedral =
        2 * density_ratio(ENVMAP_OCTAHEDRAL, 768) - density_ratio(ENVMAP_OCTAHEDRAL, 384);
    double paraboloid = density_ratio(ENVMAP_PARABOLOID, 512);
    double sphere = density_ratio(ENVMAP_SPHERE, 512);
    FIGURE("cube: density max/min against 3 sqrt 3", fabs(cube - 3 * sqrt(3)), 2e-4);
    FIGURE("octahedral: density max/min against 3 sqrt 3", fabs(octahedral - 3 * sqrt(3)), 2e-4);
    FIGURE("paraboloid: density max/min against 4", fabs(paraboloid - 4), 0.02);
    FIGURE("sphere map: density max/min against 1", fabs(sphere - 1), 1e-9);
    envmap map = make(ENVMAP_SPHERE, 64, 1, 1);
    CHECK_CLOSE(envmap_solid_angle(&map, 0, 0, 32, 32), 4 * (2.0 / 64) * (2.0 / 64), 1e-15);
    CHECK_CLOSE(envmap_solid_angle(&map, 0, 0, 32, 2), 4 * (2.0 / 64) * (2.0 / 64), 1e-15);
    envmap_free(&map);
}

/* -------------------------------------------------------------------------------- lookups -- */

static double difference(const float a[3], const float b[3]) {
    double worst = 0;
    for (int c = 0; c < 3; ++c) {
        double d = fabs((double)a[c] - (double)b[c]);
        if (!(d <= worst)) worst = d;
    }
    return worst;
}

/* Noise, at every texel whose centre is farther than half a texel inside the rim. */
static void lookups_at_texel_centres_give_the_texel(void) {
    for (int m = 0; m < MAPPINGS; ++m) {
        double worst = 0;
        for (int size = 1; size <= 16; size += 5) {
            envmap map = make(m, size, envmap_levels(size), 1);
            oracle_noise(&map, 5);
            for (int l = 0; l < map.levels; ++l) {
                int e = oracle_edge(size, l), w = oracle_width(m, e);
                for (int f = 0; f < envmap_faces(m); ++f)
                    for (int y = 0; y < e; ++y)
                        for (int x = 0; x < w; ++x) {
                            float d[3], rgb[3], u = (float)((x + 0.5) / w),
                                                v = (float)((y + 0.5) / e);
                            double X = 2 * (double)u - 1, Y = 2 * (double)v - 1;
                            if (oracle_is_disc(m) && sqrt(X * X + Y * Y) > 1 - 1.001 / e) continue;
                            envmap_direction(d, mappings[m], f, u, v);
                            envmap_lookup(rgb, &map, d, (float)l);
                            double error = difference(rgb, envmap_texel(&map, l, 0, f, x, y));
                            if (!(error <= worst)) worst = error;
                        }
            }
            envmap_free(&map);
        }
        char what[80];
        sprintf(what, "%s: lookup at a centre against the texel (noise)", oracle_name[m]);
        FIGURE(what, worst, 1e-5); /* size * 2^-24 * a few */
    }
}

/* Texels of sphere and angular maps whose centres lie outside the circle may hold anything: lookups
   around the rim meet those inside only. */
static void lookups_see_nothing_outside_a_rim(void) {
    for (int size = 3; size < 40; ++size)
        for (int m = ENVMAP_SPHERE; m <= ENVMAP_ANGULAR; m += ENVMAP_ANGULAR - ENVMAP_SPHERE) {
            envmap map = make(m, size, 1, 1);
            double worst = 0;
            for (int y = 0; y < size; ++y)
                for (int x = 0; x < size; ++x) {
                    double X = (2 * x + 1.0) / size - 1, Y = (2 * y + 1.0) / size - 1;
                    for (int c = 0; c < 3; ++c)
                        envmap_texel(&map, 0, 0, 0, x, y)[c] = X * X + Y * Y > 1 ? 1e6f : 1;
                }
            for (int i = 0; i < 150; ++i) {
                double a = 2 * PI * i / 150, r = 1 - 1e-3 * (i % 4), d[3];
                float rgb[3];
                oracle_direction(d, m, 0, 0.5 + 0.5 * r * cos(a), 0.5 + 0.5 * r * sin(a));
                float f[3] = {(float)d[0], (float)d[1], (float)d[2]};
                envmap_lookup(rgb, &map, f, 0);
                worst = fmax(worst, fabs((double)rgb[0] - 1));
            }
            CHECK_CLOSE(worst, 0, 1e-6);
            envmap_free(&map);
        }
}

/* A smooth radiance looked up between texels errs by C/size^2: halving the texel quarters it.
   Two exceptions. Over a cube's edge a row of texels goes on at another angle (but at its middle),
   an error of first order in a strip of a texel: order 3/2 in all; so over an octahedral map's folds.
   The sphere map's texels have no
   bounded diameter near -z, so there it is left out. (The angular map's worst is at its rim, where
   texels outside clamp.) */
static void lookups_are_of_second_order(void) {
    for (int m = 0; m < MAPPINGS; ++m) {
        double rms[2], worst[2];
        for (int i = 0; i < 2; ++i) {
            unsigned long long state = 71;
            int n = test_many(20000), size = 32 << i;
            envmap map = make(m, size, 1, 1);
            oracle_fill(&map, 0, oracle_smooth);
            rms[i] = worst[i] = 0;
            for (int k = 0; k < n; ++k) {
                double d[3];
                float rgb[3];
                oracle_random_direction(d, &state);
                if (m == ENVMAP_SPHERE && d[2] < -0.8) continue;
                float f[3] = {(float)d[0], (float)d[1], (float)d[2]};
                envmap_lookup(rgb, &map, f, 0);
                for (int c = 0; c < 3; ++c) {
                    double error = fabs((double)rgb[c] - oracle_smooth(d, c));
                    rms[i] += error * error / (3 * n);
                    if (!(error <= worst[i])) worst[i] = error;
                }
            }
            rms[i] = sqrt(rms[i]);
            envmap_free(&map);
        }
        char what[80];
        sprintf(what, "%s: lookup of a smooth radiance, 64: rms", oracle_name[m]);
        FIGURE(what, rms[1], 1.5e-3);
        sprintf(what, "%s: ... worst", oracle_name[m]);
        FIGURE(what, worst[1], m == ENVMAP_ANGULAR ? 0.04 : m == ENVMAP_OCTAHEDRAL ? 0.015 : 8e-3);
        double order = m == ENVMAP_CUBE || m == ENVMAP_OCTAHEDRAL ? 1.5 : 2;
        sprintf(what, "%s: ... over that of 32: 2^-%.1f", oracle_name[m], order);
        FIGURE(what, rms[1] / rms[0], pow(2, -order) * 1.05);
    }
}

/* Looks up in d moved by `step` along a tangent, at every half level; the spread of `n` of them. */
static double spread(const envmap *map, const double d[3], double step, int n, float level) {
    float first[3] = {0}, rgb[3];
    double worst = 0;
    for (int i = 0; i < n; ++i) {
        double t[3];
        oracle_tangent(t, d, 2 * PI * i / n + 0.1);
        float p[3];
        for (int k = 0; k < 3; ++k) p[k] = (float)(d[k] + step * t[k]);
        envmap_lookup(rgb, map, p, level);
        if (i == 0) memcpy(first, rgb, sizeof rgb);
        double error = difference(first, rgb);
        if (!(error <= worst)) worst = error;
    }
    return worst;
}

/* Noise of amplitude 1: a seam shows as a jump of 0.1 to 1. Eight directions around a point at
   1e-6 rad may differ by 2e-6 rad times the steepest slope, which is below 2 size per radian
   (paraboloid, cube), so below 1e-3 with room for floats. All levels, and between levels. */
static void lookups_are_continuous_across_seams(void) {
    static const int which[] = {ENVMAP_CUBE, ENVMAP_PARABOLOID, ENVMAP_LATLONG, ENVMAP_OCTAHEDRAL};
    static const int sizes[] = {1, 2, 3, 7, 8};
    for (int k = 0; k < 4; ++k)
        for (int i = 0; i < 5; ++i) {
            int m = which[k], size = sizes[i];
            unsigned long long state = 81;
            envmap map = make(m, size, envmap_levels(size), 1);
            oracle_noise(&map, 6);
            double edges = 0, corners = 0, anywhere = 0;
            for (float level = 0; level <= (float)map.levels - 1; level += 0.5f) {
                for (int j = 0; j < test_many(2000); ++j) {
                    double d[3] = {1, 1, 1}, t = 2 * test_random(&state) - 1;
                    if (m == ENVMAP_CUBE) { /* a point on a random edge of the cube */
                        int axis = (int)(3 * test_random(&state));
                        for (int c = 0; c < 3; ++c) d[c] = test_random(&state) < 0.5 ? -1 : 1;
                        if (j % 4 == 0) t = d[axis] * (1 - pow(10, -1 - 5 * test_random(&state)));
                        d[axis] = t;
                    } else if (m == ENVMAP_PARABOLOID) { /* on the rim z = 0 */
                        d[0] = cos(PI * t), d[1] = sin(PI * t), d[2] = 0;
                    } else if (m == ENVMAP_OCTAHEDRAL) { /* on a fold; its lower half is an edge */
                        d[j % 3] = 0, d[(j + 1) % 3] = cos(PI * t), d[(j + 2) % 3] = sin(PI * t);
                    } else { /* on the seam x = 0, z > 0 */
                        d[0] = 0, d[1] = cos(PI * (t + 1) / 2), d[2] = sin(PI * (t + 1) / 2);
                    }
                    double e = spread(&map, d, 1e-6, 8, level);
                    if (!(e <= edges)) edges = e;
                    oracle_random_direction(d, &state);
                    e = spread(&map, d, 1e-6, 2, level);
                    if (!(e <= anywhere)) anywhere = e;
                }
                for (int j = 0; j < 8; ++j) {
                    double d[3] = {j & 1 ? -1 : 1, j & 2 ? -1 : 1, j & 4 ? -1 : 1};
                    if (m == ENVMAP_PARABOLOID) d[2] = 0;
                    if (m == ENVMAP_LATLONG) d[0] = d[2] = 0; /* the poles */
                    if (m == ENVMAP_OCTAHEDRAL) d[j % 3] = d[(j + 1) % 3] = 0;
                    double e = spread(&map, d, 1e-6, 48, level);
                    if (!(e <= corners)) corners = e;
                }
            }
            char what[80];
            sprintf(what, "%s %d: jump over %s", oracle_name[m], size,
                    m == ENVMAP_CUBE         ? "edges"
                    : m == ENVMAP_PARABOLOID ? "the rim"
                    : m == ENVMAP_LATLONG    ? "the seam u = 0"
                                             : "edges and folds");
            FIGURE(what, edges, 1e-3);
            sprintf(what, "%s %d: jump at %s", oracle_name[m], size,
                    m == ENVMAP_PARABOLOID ? "the rim's diagonals"
                    : m == ENVMAP_LATLONG  ? "poles"
                                           : "corners");
            FIGURE(what, corners, 1e-3);
            CHECK_CLOSE(anywhere, 0, 1e-3);
            envmap_free(&map);
        }
}

/* Far steps instead of tiny ones: walking a great circle in N steps, no step changes the radiance
   by more than the slope allows, for circles that meet corners and poles head on. */
static void lookups_along_great_circles_have_no_jump(void) {
    static const double axis[][2][3] = {{{1, 1, 1}, {1, -1, 0}}, {{0, 1, 0}, {0, 0, 1}},
                                        {{1, 0, 0}, {0, 1, 0}},  {{1, 1, 0}, {0, 0, 1}},
                                        {{1, 0, 1}, {0, 1, 0}},  {{1, 2, 3}, {2, -1, 0}}};
    static const int which[] = {ENVMAP_CUBE, ENVMAP_PARABOLOID, ENVMAP_LATLONG, ENVMAP_OCTAHEDRAL};
    int n = test_many(50000);
    for (int k = 0; k < 4; ++k) {
        envmap map = make(which[k], 8, 4, 1);
        oracle_noise(&map, 7);
        double worst = 0;
        for (size_t c = 0; c < sizeof axis / sizeof *axis; ++c)
            for (int l = 0; l < 4; ++l) {
                float before[3] = {0}, rgb[3];
                for (int i = 0; i <= n; ++i) {
                    double a = 2 * PI * i / n, d[3], p = 0, q = 0;
                    for (int j = 0; j < 3; ++j)
                        p += axis[c][0][j] * axis[c][0][j], q += axis[c][1][j] * axis[c][1][j];
                    for (int j = 0; j < 3; ++j)
                        d[j] = cos(a) * axis[c][0][j] / sqrt(p) + sin(a) * axis[c][1][j] / sqrt(q);
                    float f[3] = {(float)d[0], (float)d[1], (float)d[2]};
                    envmap_lookup(rgb, &map, f, (float)l);
                    double e = i ? difference(rgb, before) * n : 0;
                    if (!(e <= worst)) worst = e;
                    memcpy(before, rgb, sizeof rgb);
                }
            }
        char what[80];
        sprintf(what, "%s 8: steepest step over 2 pi / n, noise", oracle_name[which[k]]);
        /* a jump of 0.1 would show as n/10 = 5000; a radian crosses up to size * 1.3 texels, and a
           lat-long's more beside a pole, where its values approach one */
        FIGURE(what, worst, n > 10000 ? 400 : 4000);
        envmap_free(&map);
    }
}

/* At the lat-long poles the value is the mean of the row. */
static void the_pole_is_the_mean_of_its_row(void) {
    envmap map = make(ENVMAP_LATLONG, 8, 2, 1);
    oracle_noise(&map, 8);
    for (int l = 0; l < 2; ++l)
        for (int s = 0; s < 2; ++s) {
            int e = 8 >> l;
            double mean = 0;
            float d[3] = {0, s ? -1 : 1, 0}, rgb[3];
            for (int x = 0; x < 2 * e; ++x)
                mean += (double)envmap_texel(&map, l, 0, 0, x, s ? e - 1 : 0)[1] / (2 * e);
            envmap_lookup(rgb, &map, d, (float)l);
            CHECK_CLOSE(rgb[1], mean, 1e-6);
        }
    envmap_free(&map);
}

static void levels_are_interpolated_and_clamped(void) {
    unsigned long long state = 91;
    for (int m = 0; m < MAPPINGS; ++m) {
        envmap map = make(m, 16, 5, 1);
        oracle_noise(&map, 9);
        for (int i = 0; i < 500; ++i) {
            double d[3];
            oracle_random_direction(d, &state);
            float f[3] = {(float)d[0], (float)d[1], (float)d[2]}, a[3], b[3], c[3];
            int l = i % 4;
            float t = (float)test_random(&state);
            envmap_lookup(a, &map, f, (float)l);
            envmap_lookup(b, &map, f, (float)(l + 1));
            envmap_lookup(c, &map, f, (float)l + t);
            for (int k = 0; k < 3; ++k)
                CHECK_CLOSE(c[k], (double)a[k] + (double)t * ((double)b[k] - (double)a[k]), 2e-6);
            static const float low[] = {-1e-6f, -3, -1e30f, (float)-INFINITY, (float)NAN};
            static const float high[] = {4.001f, 5, 1e30f, (float)INFINITY};
            envmap_lookup(a, &map, f, 0);
            for (int k = 0; k < 5; ++k) {
                envmap_lookup(c, &map, f, low[k]);
                CHECK(difference(a, c) == 0);
            }
            envmap_lookup(a, &map, f, 4);
            for (int k = 0; k < 4; ++k) {
                envmap_lookup(c, &map, f, high[k]);
                CHECK(difference(a, c) == 0);
            }
        }
        envmap_free(&map);
    }
}

/* Slice k of n holds p = p0 + (p1 - p0)(k + 1/2)/n. */
static void slices_are_interpolated_between_centres_and_clamped(void) {
    unsigned long long state = 95;
    for (int m = 0; m < MAPPINGS; ++m)
        for (int n = 1; n <= 5; n += 2)
            for (int range = 0; range < 2; ++range) {
                envmap map = make(m, 4, 3, n);
                oracle_noise(&map, 10);
                if (range) map.p0 = 0, map.p1 = 1;
                double p0 = range ? 0 : -1, step = (1 - p0) / n;
                for (int i = 0; i < 100; ++i) {
                    double d[3], want[3] = {0, 0, 0};
                    oracle_random_direction(d, &state);
                    float f[3] = {(float)d[0], (float)d[1], (float)d[2]}, rgb[3];
                    double p = p0 - 0.2 + (1.4 - p0) * test_random(&state);
                    if (i < n) p = p0 + step * (i + 0.5);
                    double k = (p - p0) / step - 0.5;
                    k = k < 0 ? 0 : k > n - 1 ? n - 1 : k;
                    int low = (int)k < n - 1 ? (int)k : n > 1 ? n - 2 : 0;
                    for (int s = low; s <= low + 1 && s < n; ++s) {
                        /* a view of one slice: level 1 of a map of 4 is a map of 2 */
                        envmap one = make(m, 2, 1, 1);
                        memcpy(one.texels, envmap_texel(&map, 1, s, 0, 0, 0),
                               oracle_floats(m, 2, 1, 0) * sizeof(float));
                        envmap_lookup(rgb, &one, f, 0);
                        double weight = n == 1 ? 1 : s == low ? 1 - (k - low) : k - low;
                        for (int c = 0; c < 3; ++c) want[c] += weight * (double)rgb[c];
                        if (i == 0 && s == 0) {
                            float zero[3];
                            envmap_lookup(zero, &map, f, 1);
                            CHECK(difference(zero, rgb) == 0);
                        }
                        envmap_free(&one);
                    }
                    envmap_lookup_slice(rgb, &map, f, (float)p, 1);
                    for (int c = 0; c < 3; ++c) CHECK_CLOSE(rgb[c], want[c], 3e-6);
                }
                envmap_free(&map);
            }
}

static void odd_inputs_to_lookups_give_finite_radiance(void) {
    const float nan = (float)NAN, inf = (float)INFINITY;
    const float odd[][3] = {
        {0, 0, 0},          {nan, 0, 0},       {0, inf, 0},          {nan, nan, nan},
        {-inf, inf, 0},     {1e-45f, 0, 0},    {0, -1e-40f, 1e-42f}, {3e38f, 3e38f, -3e38f},
        {1e38f, 0, -3e38f}, {-0.0f, -0.0f, -1}};
    for (int m = 0; m < MAPPINGS; ++m) {
        envmap map = make(m, 5, 3, 3);
        oracle_noise(&map, 11);
        for (size_t i = 0; i < sizeof odd / sizeof *odd; ++i) {
            const float ps[] = {0, nan, inf, -inf, 1e38f, -2};
            for (size_t j = 0; j < sizeof ps / sizeof *ps; ++j) {
                float rgb[3] = {9, 9, 9};
                envmap_lookup_slice(rgb, &map, odd[i], ps[j], ps[(j + i) % 6]);
                for (int c = 0; c < 3; ++c) CHECK(rgb[c] >= 0 && rgb[c] <= 1.00001f);
            }
        }
        envmap_free(&map);
        float rgb[3] = {9, 9, 9}, d[3] = {0, 0, 1};
        envmap_lookup(rgb, &map, d, 0);
        CHECK(rgb[0] == 0 && rgb[1] == 0 && rgb[2] == 0);
        rgb[0] = rgb[1] = rgb[2] = 9;
        envmap_lookup_slice(rgb, NULL, d, 0, 0);
        CHECK(rgb[0] == 0 && rgb[1] == 0 && rgb[2] == 0);
    }
}

/* Radiance that is the same everywhere is the same in every direction, also at rims and poles. */
static void a_constant_map_looks_the_same_everywhere(void) {
    unsigned long long state = 97;
    for (int m = 0; m < MAPPINGS; ++m)
        for (int size = 1; size <= 8; ++size) {
            envmap map = make(m, size, envmap_levels(size), 1);
            for (int l = 0; l < map.levels; ++l) oracle_fill(&map, l, oracle_one);
            for (int i = 0; i < 500; ++i) {
                double d[3];
                oracle_random_direction(d, &state);
                if (i < 27) d[0] = i % 3 - 1, d[1] = i / 3 % 3 - 1, d[2] = i / 9 - 1;
                float f[3] = {(float)d[0], (float)d[1], (float)d[2]}, rgb[3];
                envmap_lookup(rgb, &map, f, (float)(4 * test_random(&state)));
                for (int c = 0; c < 3; ++c) CHECK_CLOSE(rgb[c], 1 + c, 1e-6);
            }
            envmap_free(&map);
        }
}

/* ------------------------------------------------------------------------------- resample -- */

static double energy(const envmap *map, int slice, int channel) {
    double sum = 0;
    for (int f = 0; f < envmap_faces(map->mapping); ++f)
        for (int y = 0; y < map->size; ++y)
            for (int x = 0; x < oracle_width(map->mapping, map->size); ++x)
                sum += envmap_solid_angle(map, 0, f, x, y) *
                       (double)envmap_texel(map, 0, slice, f, x, y)[channel];
    return sum;
}

static void resampling_to_the_same_map_copies_it(void) {
    for (int m = 0; m < MAPPINGS; ++m)
        for (int size = 1; size <= 16; size += 3) {
            envmap a = make(m, size, 1, 2), b = make(m, size, 1, 2);
            oracle_noise(&a, 12);
            CHECK(envmap_resample(&b, &a, NULL) == ENVMAP_OK);
            CHECK(!memcmp(a.texels, b.texels, oracle_floats(m, size, 2, 0) * sizeof(float)));
            envmap_free(&a), envmap_free(&b);
        }
}

static void resampling_keeps_a_constant(void) {
    static const int sizes[][2] = {{1, 1}, {8, 8}, {3, 16}, {16, 3}, {33, 8}, {1, 5}, {7, 1}};
    for (int m = 0; m < MAPPINGS; ++m)
        for (int n = 0; n < MAPPINGS; ++n)
            for (int i = 0; i < 7; ++i) {
                envmap a = make(m, sizes[i][0], 1, 1), b = make(n, sizes[i][1], 1, 1);
                oracle_fill(&a, 0, oracle_one);
                CHECK(envmap_resample(&b, &a, NULL) == ENVMAP_OK);
                for (size_t k = 0; k < oracle_floats(n, sizes[i][1], 1, 0); ++k)
                    CHECK_CLOSE(b.texels[k], 1 + k % 3, 1e-6);
                envmap_free(&a), envmap_free(&b);
            }
}

/* rms over the sphere of the resampled smooth radiance against itself; *outside: the worst texel
   of those that the rim leaves out. */
static double resampled(int from, int size, int to, int edge, double *outside) {
    envmap a = make(from, size, 1, 1), b = make(to, edge, 1, 1);
    oracle_fill(&a, 0, oracle_smooth);
    CHECK(envmap_resample(&b, &a, NULL) == ENVMAP_OK);
    double sum = 0, all = 0;
    *outside = 0;
    for (int f = 0; f < envmap_faces(to); ++f)
        for (int y = 0; y < edge; ++y)
            for (int x = 0; x < oracle_width(to, edge); ++x) {
                double d[3], omega = envmap_solid_angle(&b, 0, f, x, y), u, v;
                u = (x + 0.5) / oracle_width(to, edge), v = (y + 0.5) / edge;
                oracle_direction(d, to, f, u, v);
                for (int c = 0; c < 3; ++c) {
                    double error = (double)envmap_texel(&b, 0, 0, f, x, y)[c] - oracle_smooth(d, c);
                    sum += omega * error * error, all += omega;
                    if (omega == 0 && !(fabs(error) <= *outside)) *outside = fabs(error);
                }
            }
    envmap_free(&a), envmap_free(&b);
    return sqrt(sum / all);
}

/* All 36 pairs: the mean of the texels that lie under one is that of its centre to first order, as
   their boxes lie as they will; doubling both sizes halves the error. Where the sphere map takes
   part its last ring of texels, an area of 1/size, spans an angle of 1/sqrt(size) around -z. */
static void resampling_is_of_first_order_between_all_pairs(void) {
    for (int m = 0; m < MAPPINGS; ++m)
        for (int n = 0; n < MAPPINGS; ++n) {
            double out, coarse, fine;
            int sphere = m == ENVMAP_SPHERE || n == ENVMAP_SPHERE;
            char what[80];
            if (m == n) continue; /* a copy; unequal sizes come below */
            coarse = resampled(m, 24, n, 24, &out), fine = resampled(m, 48, n, 48, &out);
            sprintf(what, "%s 48 -> %s 48: rms", oracle_name[m], oracle_name[n]);
            FIGURE(what, fine, sphere ? 0.012 : 2e-3);
            FIGURE("... over that of 24", fine / coarse, 0.55);
            /* texels outside the circle hold the extended domain, or the rim */
            CHECK_CLOSE(out, 0, 0.03);
        }
    for (int m = 0; m < MAPPINGS; ++m) { /* other sizes of the same map, up and down */
        double out;
        char what[80];
        sprintf(what, "%s 48 -> 80: rms", oracle_name[m]);
        FIGURE(what, resampled(m, 48, m, 80, &out), m == ENVMAP_SPHERE ? 0.014 : 1.5e-3);
        sprintf(what, "%s 80 -> 48: rms", oracle_name[m]);
        FIGURE(what, resampled(m, 80, m, 48, &out), m == ENVMAP_SPHERE ? 0.014 : 2e-3);
    }
}

/* A scene that is hard to shrink: noise in every texel, and one texel of a thousand. */
static void resampling_down_conserves_energy(void) {
    double worst = 0;
    for (int m = 0; m < MAPPINGS; ++m)
        for (int n = 0; n < MAPPINGS; ++n) {
            envmap a = make(m, 64, 1, 1), b = make(n, 16, 1, 1);
            oracle_noise(&a, 13);
            CHECK(envmap_resample(&b, &a, NULL) == ENVMAP_OK);
            double error = 0;
            for (int c = 0; c < 3; ++c) {
                double e = fabs(energy(&b, 0, c) / energy(&a, 0, c) - 1);
                if (!(e <= error)) error = e;
            }
            if (!(error <= worst)) worst = error;
            envmap_free(&a), envmap_free(&b);
        }
    FIGURE("64 -> 16, noise, all 36 pairs: energy off by", worst, 5e-3);
}

/* exp(a.d) has the mean sinh|a| / |a|, whatever the direction of a. */
static double oblique(const double d[3], int channel) {
    return exp(2 * d[channel] - 1.5 * d[(channel + 1) % 3]);
}

/* Down to texels as large as faces the mean is one by solid angle: a plain mean of the points, or
   of a face's texels, would be off by percents. */
static void resampling_down_weighs_by_solid_angle(void) {
    for (int m = 0; m < MAPPINGS; ++m) {
        double worst = 0, mean = sinh(2.5) / 2.5;
        for (int n = 0; n < MAPPINGS; ++n)
            for (int edge = 1; edge <= 3; ++edge) {
                envmap a = make(m, 96, 1, 1), b = make(n, edge, 1, 1);
                oracle_fill(&a, 0, oblique);
                CHECK(envmap_resample(&b, &a, NULL) == ENVMAP_OK);
                for (int c = 0; c < 3; ++c) {
                    double e = fabs(energy(&b, 0, c) / (4 * PI * mean) - 1);
                    if (!(e <= worst)) worst = e;
                }
                envmap_free(&a), envmap_free(&b);
            }
        char what[80];
        sprintf(what, "%s 96 -> edges of 1 to 3: energy off by", oracle_name[m]);
        FIGURE(what, worst, 5e-3);
    }
}

/* Texels that alternate between 0 and 1 hold nothing that a map a quarter of the size could show:
   their mean is all that may remain. Picking single texels would leave 0 and 1. */
static void resampling_down_does_not_alias(void) {
    for (int m = 0; m < MAPPINGS; ++m)
        for (int n = 0; n < MAPPINGS; ++n) {
            envmap a = make(m, 64, 1, 1), b = make(n, 8, 1, 1);
            for (int f = 0; f < envmap_faces(m); ++f)
                for (int y = 0; y < 64; ++y)
                    for (int x = 0; x < oracle_width(m, 64); ++x)
                        for (int c = 0; c < 3; ++c)
                            envmap_texel(&a, 0, 0, f, x, y)[c] = (float)((x + y) & 1);
            CHECK(envmap_resample(&b, &a, NULL) == ENVMAP_OK);
            double sum = 0, all = 0;
            for (int f = 0; f < envmap_faces(n); ++f)
                for (int y = 0; y < 8; ++y)
                    for (int x = 0; x < oracle_width(n, 8); ++x) {
                        double e = (double)envmap_texel(&b, 0, 0, f, x, y)[0] - 0.5;
                        double omega = envmap_solid_angle(&b, 0, f, x, y);
                        sum += omega * e * e, all += omega;
                    }
            char what[80];
            sprintf(what, "%s 64 -> %s 8: what a checkerboard of texels leaves, rms",
                    oracle_name[m], oracle_name[n]);
            FIGURE(what, sqrt(sum / all), m == n ? 0.02 : 0.04);
            envmap_free(&a), envmap_free(&b);
        }
}

/* The energy of a texel alone, of the result over that of the source. */
static double alone(envmap *b, envmap *a, int face, int x, int y) {
    memset(a->texels, 0, oracle_floats(a->mapping, a->size, 1, 0) * sizeof(float));
    envmap_texel(a, 0, 0, face, x, y)[0] = 1;
    CHECK(envmap_resample(b, a, NULL) == ENVMAP_OK);
    return energy(b, 0, 0) / energy(a, 0, 0);
}

/* Whichever texel is alone in the light, its energy stays, where the result is coarser: within 1 %,
   0.1 % between most maps; also that of a sliver that a rim cuts. */
static void resampling_keeps_the_energy_of_each_texel(void) {
    for (int m = 0; m < MAPPINGS; ++m)
        for (int n = 0; n < MAPPINGS; ++n) {
            static const int edge[] = {4, 8, 11, 8, 11, 9}, from[] = {16, 16, 24, 16, 24, 23};
            envmap a = make(m, from[m], 1, 1), b = make(n, edge[n], 1, 1);
            double worst = 0, rim = 0;
            for (int i = 0; i < 45; ++i) {
                int face = i % envmap_faces(m), width = oracle_width(m, from[m]);
                int x = i * 7 % width, y = i * 11 % from[m];
                double X = fabs((2 * x + 1.0) / from[m] - 1) + 1.0 / from[m];
                double Y = fabs((2 * y + 1.0) / from[m] - 1) + 1.0 / from[m];
                int cut = oracle_is_disc(m) && hypot(X, Y) > 1;
                if (!(envmap_solid_angle(&a, 0, face, x, y) > 0)) continue;
                double off = fabs(alone(&b, &a, face, x, y) - 1);
                if (cut && !(off <= rim)) rim = off;
                if (!cut && !(off <= worst)) worst = off;
            }
            char what[80];
            sprintf(what, "%s %d -> %s %d: a texel's energy is off by", oracle_name[m], from[m],
                    oracle_name[n], edge[n]);
            FIGURE(what, worst, m == n ? 1e-6 : 0.01);
            FIGURE("... that a rim cuts", rim, 0.01);
            envmap_free(&a), envmap_free(&b);
        }
}

/* A sun in noise at 64^2: the whole map's energy stays within 1e-4, a sphere map's within 5e-4. */
static void resampling_keeps_the_energy_of_the_whole_map(void) {
    for (int m = 0; m < MAPPINGS; ++m)
        for (int n = 0; n < MAPPINGS; ++n) {
            envmap a = make(m, 64, 1, 1), b = make(n, 48, 1, 1);
            oracle_noise(&a, 17);
            envmap_texel(&a, 0, 0, 0, 20, 30)[0] = 1e4f;
            CHECK(envmap_resample(&b, &a, NULL) == ENVMAP_OK);
            char what[80];
            sprintf(what, "%s 64 -> %s 48: energy is off by", oracle_name[m], oracle_name[n]);
            FIGURE(what, fabs(energy(&b, 0, 1) / energy(&a, 0, 1) - 1),
                   m == ENVMAP_SPHERE ? 5e-4 : 1e-4);
            envmap_free(&a), envmap_free(&b);
        }
}

/* Three texels of the result to one of the source, and most of the light in 16 of these. */
static void resampling_to_a_finer_map_keeps_a_suns_energy(void) {
    double worst = 0;
    for (int at = 0; at < 120; at += 7) {
        envmap a = make(ENVMAP_LATLONG, 64, 1, 1), b = make(ENVMAP_CUBE, 64, 1, 1);
        oracle_noise(&a, 19);
        for (int i = 0; i < 16; ++i)
            envmap_texel(&a, 0, 0, 0, at + i % 4, 12 + at / 3 + i / 4)[1] = 1e5f;
        CHECK(envmap_resample(&b, &a, NULL) == ENVMAP_OK);
        worst = fmax(worst, fabs(energy(&b, 0, 1) / energy(&a, 0, 1) - 1));
        envmap_free(&a), envmap_free(&b);
    }
    FIGURE("energy is off by", worst, 1e-3);
}

static int stop_late(void *user, float fraction) {
    ++*(int *)user;
    return fraction > 0.6f;
}

static void a_cancelled_resampling_writes_nothing(void) {
    for (int m = 0; m < MAPPINGS; ++m)
        for (int n = 0; n < MAPPINGS; ++n) {
            envmap a = make(m, 24, 1, 1), b = make(n, 20, 1, 1);
            envmap_work work = {0};
            int calls = 0;
            oracle_noise(&a, 18);
            work.progress.user = &calls, work.progress.report = stop_late;
            CHECK(envmap_resample(&b, &a, &work) == ENVMAP_CANCELLED);
            CHECK(calls > 1);
            for (size_t i = 0; i < oracle_floats(n, 20, 1, 0); ++i)
                CHECK(!(fabs((double)b.texels[i]) > 0));
            envmap_free(&a), envmap_free(&b);
        }
}

static void backwards(void *user, envmap_task *task, void *context, int count) {
    (void)user;
    while (count-- > 0) task(context, count);
}

static void resampling_gives_the_same_bits_for_any_order_of_tasks(void) {
    for (int m = 0; m < MAPPINGS; ++m)
        for (int n = 0; n < MAPPINGS; ++n) {
            envmap a = make(m, 21, 1, 1), b = make(n, 18, 1, 1), c = make(n, 18, 1, 1);
            envmap_work work = {0};
            oracle_noise(&a, 19);
            work.executor.run = backwards;
            CHECK(envmap_resample(&b, &a, NULL) == ENVMAP_OK);
            CHECK(envmap_resample(&c, &a, &work) == ENVMAP_OK);
            CHECK(!memcmp(b.texels, c.texels, oracle_floats(n, 18, 1, 0) * sizeof(float)));
            envmap_free(&a), envmap_free(&b), envmap_free(&c);
        }
}

static void resampling_spreads_one_slice_over_all(void) {
    envmap one = make(ENVMAP_CUBE, 6, 1, 1), three = make(ENVMAP_CUBE, 6, 1, 3);
    envmap out = make(ENVMAP_LATLONG, 5, 1, 3), first = make(ENVMAP_LATLONG, 5, 1, 1);
    size_t n = oracle_floats(ENVMAP_LATLONG, 5, 1, 0), k = oracle_floats(ENVMAP_CUBE, 6, 1, 0);
    oracle_noise(&one, 14), oracle_noise(&three, 15);
    CHECK(envmap_resample(&first, &one, NULL) == ENVMAP_OK);
    CHECK(envmap_resample(&out, &one, NULL) == ENVMAP_OK);
    for (size_t s = 0; s < 3; ++s)
        CHECK(!memcmp(out.texels + s * n, first.texels, n * sizeof(float)));
    CHECK(envmap_resample(&out, &three, NULL) == ENVMAP_OK);
    for (size_t s = 0; s < 3; ++s) {
        memcpy(one.texels, three.texels + s * k, k * sizeof(float));
        CHECK(envmap_resample(&first, &one, NULL) == ENVMAP_OK);
        CHECK(!memcmp(out.texels + s * n, first.texels, n * sizeof(float)));
    }
    envmap many = make(ENVMAP_LATLONG, 2, 1, 100), cubes = make(ENVMAP_CUBE, 2, 1, 100);
    CHECK(envmap_resample(&cubes, &many, NULL) == ENVMAP_OK);
    envmap_free(&many), envmap_free(&cubes);
    envmap two = make(ENVMAP_CUBE, 6, 1, 2);
    CHECK(envmap_resample(&out, &two, NULL) == ENVMAP_ERROR_ARGUMENT);
    CHECK(envmap_resample(&first, &two, NULL) == ENVMAP_ERROR_ARGUMENT);
    envmap_free(&one), envmap_free(&three), envmap_free(&out), envmap_free(&first);
    envmap_free(&two);
}

static void resampling_refuses_what_it_cannot_do(void) {
    static const float bad[] = {(float)NAN, (float)INFINITY, (float)-INFINITY};
    envmap a = make(ENVMAP_CUBE, 4, 2, 1), b = make(ENVMAP_LATLONG, 4, 2, 1), none = {0};
    size_t n = oracle_floats(ENVMAP_LATLONG, 4, 1, 0),
           rest = oracle_floats(ENVMAP_LATLONG, 4, 1, 1);
    oracle_noise(&b, 16);
    envmap copy = make(ENVMAP_LATLONG, 4, 2, 1);
    memcpy(copy.texels, b.texels, (n + rest) * sizeof(float));
    for (int i = 0; i < 3; ++i) {
        oracle_fill(&a, 0, oracle_one);
        envmap_texel(&a, 0, 0, 5, 3, 3)[2] = bad[i];
        CHECK(envmap_resample(&b, &a, NULL) == ENVMAP_ERROR_RADIANCE);
        CHECK(!memcmp(copy.texels, b.texels, (n + rest) * sizeof(float)));
    }
    CHECK(envmap_resample(NULL, &b, NULL) == ENVMAP_ERROR_ARGUMENT);
    CHECK(envmap_resample(&b, NULL, NULL) == ENVMAP_ERROR_ARGUMENT);
    CHECK(envmap_resample(&b, &none, NULL) == ENVMAP_ERROR_ARGUMENT);
    CHECK(envmap_resample(&none, &b, NULL) == ENVMAP_ERROR_ARGUMENT);
    CHECK(envmap_resample(&b, &b, NULL) == ENVMAP_ERROR_ARGUMENT);
    /* negative radiance is no error here, and levels other than 0 are not written */
    oracle_fill(&a, 0, oracle_one);
    for (size_t i = 0; i < oracle_floats(ENVMAP_CUBE, 4, 1, 0); ++i) a.texels[i] = -a.texels[i];
    CHECK(envmap_resample(&b, &a, NULL) == ENVMAP_OK);
    CHECK_CLOSE(b.texels[0], -1, 1e-6);
    CHECK(!memcmp(copy.texels + n, b.texels + n, rest * sizeof(float)));
    envmap_free(&a), envmap_free(&b), envmap_free(&copy);
}

static void no_test_leaked(void) {
    CHECK(oracle_live == 0);
    CHECK(oracle_wrong_context == 0);
}

int main(void) {
    RUN(levels_halve_down_to_one);
    RUN(a_new_map_is_black_and_has_its_sizes);
    RUN(sizes_beyond_the_limits_are_refused_before_any_allocation);
    RUN(without_memory_a_map_stays_as_it_was);
    RUN(texels_are_where_the_memory_order_says);
    RUN(texels_out_of_range_are_null_and_have_no_solid_angle);
    RUN(solid_angles_sum_to_4_pi);
    RUN(solid_angles_are_the_integral_over_the_texel);
    RUN(texels_outside_the_rim_count_nothing);
    RUN(sampling_density_varies_as_the_papers_say);
    RUN(lookups_at_texel_centres_give_the_texel);
    RUN(lookups_see_nothing_outside_a_rim);
    RUN(lookups_are_of_second_order);
    RUN(lookups_are_continuous_across_seams);
    RUN(lookups_along_great_circles_have_no_jump);
    RUN(the_pole_is_the_mean_of_its_row);
    RUN(levels_are_interpolated_and_clamped);
    RUN(slices_are_interpolated_between_centres_and_clamped);
    RUN(odd_inputs_to_lookups_give_finite_radiance);
    RUN(a_constant_map_looks_the_same_everywhere);
    RUN(resampling_to_the_same_map_copies_it);
    RUN(resampling_keeps_a_constant);
    RUN(resampling_is_of_first_order_between_all_pairs);
    RUN(resampling_down_conserves_energy);
    RUN(resampling_down_weighs_by_solid_angle);
    RUN(resampling_down_does_not_alias);
    RUN(resampling_keeps_the_energy_of_each_texel);
    RUN(resampling_keeps_the_energy_of_the_whole_map);
    RUN(resampling_to_a_finer_map_keeps_a_suns_energy);
    RUN(a_cancelled_resampling_writes_nothing);
    RUN(resampling_gives_the_same_bits_for_any_order_of_tasks);
    RUN(resampling_spreads_one_slice_over_all);
    RUN(resampling_refuses_what_it_cannot_do);
    RUN(no_test_leaked);
    return test_summary();
}
