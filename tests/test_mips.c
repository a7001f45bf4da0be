/* SPDX-License-Identifier: MIT
   mips: every level carries the energy of level 0, one colour at the top, no seam at any level;
   the level of a footprint, and probes along it. Beside it the unweighted box that most tools use,
   and its drift. */
#include "oracle.h"

static const int sizes[] = {1, 2, 3, 4, 5, 7, 8, 16, 17, 33, 64, 100};
#define SIZES (int)(sizeof sizes / sizeof *sizes)

static envmap make(int mapping, int size) {
    envmap map = {0};
    if (envmap_create(&map, mapping, size, envmap_levels(size), 2)) {
        printf("    cannot create a %s map of %d\n", oracle_name[mapping], size);
        exit(1);
    }
    return map;
}

static double energy(const envmap *map, int level, int slice, int channel) {
    int e = oracle_edge(map->size, level), w = oracle_width(map->mapping, e);
    double sum = 0;
    for (int f = 0; f < envmap_faces(map->mapping); ++f)
        for (int y = 0; y < e; ++y)
            for (int x = 0; x < w; ++x) {
                double omega = envmap_solid_angle(map, level, f, x, y);
                if (omega > 0)
                    sum += omega * (double)envmap_texel(map, level, slice, f, x, y)[channel];
            }
    return sum;
}

/* Largest |E_level / E_0 - 1| over levels, slices and channels. */
static double drift(const envmap *map) {
    double worst = 0;
    for (int s = 0; s < map->slices; ++s)
        for (int c = 0; c < 3; ++c)
            for (int l = 1; l < map->levels; ++l) {
                double e = fabs(energy(map, l, s, c) / energy(map, 0, s, c) - 1);
                if (!(e <= worst)) worst = e;
            }
    return worst;
}

/* What most tools do: each texel the plain mean of the four above it, each face alone. */
static void unweighted_box(envmap *map) {
    for (int l = 1; l < map->levels; ++l) {
        int e = oracle_edge(map->size, l), w = oracle_width(map->mapping, e);
        for (int s = 0; s < map->slices; ++s)
            for (int f = 0; f < envmap_faces(map->mapping); ++f)
                for (int y = 0; y < e; ++y)
                    for (int x = 0; x < w; ++x)
                        for (int c = 0; c < 3; ++c) {
                            float sum = 0;
                            for (int k = 0; k < 4; ++k)
                                sum += envmap_texel(map, l - 1, s, f, 2 * x + k % 2,
                                                    2 * y + k / 2)[c];
                            envmap_texel(map, l, s, f, x, y)[c] = sum / 4;
                        }
    }
}

/* A scene with contrast: noise under a bright sky, and a lamp in a corner of the cube. */
static void scene(envmap *map) {
    unsigned long long state = 3;
    const double lamp[3] = {1, 1, 1};
    for (int s = 0; s < map->slices; ++s)
        for (int f = 0; f < envmap_faces(map->mapping); ++f)
            for (int y = 0; y < map->size; ++y)
                for (int x = 0; x < oracle_width(map->mapping, map->size); ++x) {
                    double d[3];
                    oracle_direction(d, map->mapping, f,
                                     (x + 0.5) / oracle_width(map->mapping, map->size),
                                     (y + 0.5) / map->size);
                    float *t = envmap_texel(map, 0, s, f, x, y);
                    double light = oracle_angle(d, lamp) < 0.15 ? 50 : d[1] > 0 ? 2 : 0.2;
                    for (int c = 0; c < 3; ++c)
                        t[c] = (float)(light * (0.5 + test_random(&state)));
                }
}

static void mip_levels_carry_the_same_energy(void) {
    for (int m = 0; m < MAPPINGS; ++m) {
        double worst = 0, box = 0;
        for (int i = 0; i < SIZES; ++i) {
            envmap map = make(m, sizes[i]);
            scene(&map);
            CHECK(envmap_mips_build(&map) == ENVMAP_OK);
            double e = drift(&map);
            if (!(e <= worst)) worst = e;
            if (sizes[i] == 64) {
                unweighted_box(&map);
                box = drift(&map);
            }
            envmap_free(&map);
        }
        char what[80];
        sprintf(what, "%s: energy drift of a level, sizes 1 ... 100", oracle_name[m]);
        FIGURE(what, worst, 1e-6);
        printf("    %-64s %.3g\n", "... and of an unweighted box from 64", box);
        /* a sphere map's texels are all alike, so that only its rim can drift */
        CHECK(box > (m == ENVMAP_SPHERE ? 1e-3 : 1e-2));
    }
}

static void the_top_level_is_one_colour_the_mean_of_the_sphere(void) {
    for (int m = 0; m < MAPPINGS; ++m) {
        double worst = 0;
        for (int i = 0; i < SIZES; ++i) {
            envmap map = make(m, sizes[i]);
            scene(&map);
            if (map.levels == 1) { /* level 0 is the caller's, whatever its edge */
                envmap_free(&map);
                continue;
            }
            CHECK(envmap_mips_build(&map) == ENVMAP_OK);
            int top = map.levels - 1;
            for (int s = 0; s < 2; ++s)
                for (int c = 0; c < 3; ++c) {
                    double mean = energy(&map, 0, s, c) / (4 * PI);
                    for (int f = 0; f < envmap_faces(m); ++f)
                        for (int x = 0; x < oracle_width(m, 1); ++x) {
                            double t = (double)envmap_texel(&map, top, s, f, x, 0)[c];
                            double e = fabs(t / mean - 1);
                            if (!(e <= worst)) worst = e;
                            CHECK(envmap_texel(&map, top, s, f, x, 0)[c] ==
                                  envmap_texel(&map, top, s, 0, 0, 0)[c]);
                        }
                }
            envmap_free(&map);
        }
        char what[80];
        sprintf(what, "%s: top level against the mean of the sphere", oracle_name[m]);
        FIGURE(what, worst, 1e-6);
    }
}

static void a_constant_stays_itself_at_every_level(void) {
    for (int m = 0; m < MAPPINGS; ++m)
        for (int i = 0; i < SIZES; ++i) {
            envmap map = make(m, sizes[i]);
            oracle_fill(&map, 0, oracle_one);
            CHECK(envmap_mips_build(&map) == ENVMAP_OK);
            size_t n = 0;
            for (int l = 0; l < map.levels; ++l) n += oracle_floats(m, sizes[i], 2, l);
            for (size_t k = 0; k < n; ++k) CHECK_CLOSE(map.texels[k], 1 + k % 3, 1e-6);
            envmap_free(&map);
        }
}

/* A texel of level l against the smooth radiance averaged over it by the oracle's own mapping:
   a level that is shifted by half a texel of level 0, or weighs wrongly, shows. Of second order
   for even edges; where an odd edge cuts texels in two, each part counts with the whole's mean. In
   a disc's last ring of first order, as level 0 was filled at centres that lie outside. */
static void mip_texels_are_the_mean_over_their_part_of_the_sphere(void) {
    static const int some[] = {64, 63, 40, 17};
    for (int m = 0; m < MAPPINGS; ++m)
        for (int i = 0; i < 4; ++i) {
            envmap map = make(m, some[i]);
            oracle_fill(&map, 0, oracle_smooth);
            CHECK(envmap_mips_build(&map) == ENVMAP_OK);
            double worst = 0, ring = 0;
            int disc = oracle_is_disc(m);
            for (int l = 1; l <= 2; ++l) {
                int e = oracle_edge(some[i], l), w = oracle_width(m, e), n = 24;
                for (int f = 0; f < envmap_faces(m); ++f)
                    for (int y = 0; y < e; ++y)
                        for (int x = 0; x < w; ++x) {
                            double sum = 0, all = 0;
                            if (envmap_solid_angle(&map, l, f, x, y) == 0) continue;
                            for (int k = 0; k < n * n; ++k) {
                                double d[3], u = (x + (k % n + 0.5) / n) / w, rate;
                                double v = (y + (k / n + 0.5) / n) / e, X = 2 * u - 1, Y = 2 * v - 1;
                                double r = X * X + Y * Y;
                                if (disc && r >= 1) continue;
                                oracle_direction(d, m, f, u, v);
                                rate = m == ENVMAP_CUBE         ? pow(1 + r, -1.5)
                                       : m == ENVMAP_PARABOLOID ? pow(1 + r, -2)
                                       : m == ENVMAP_LATLONG    ? sin(PI * v)
                                       : m == ENVMAP_OCTAHEDRAL ? oracle_octahedral_density(d)
                                       : m == ENVMAP_ANGULAR    ? sin(PI * sqrt(r)) / sqrt(r)
                                                                : 1;
                                sum += rate * oracle_smooth(d, 0), all += rate;
                            }
                            if (all == 0) continue;
                            double error = fabs((double)envmap_texel(&map, l, 0, f, x, y)[0] - sum / all);
                            double X = (2 * x + 1.0) / w - 1, Y = (2 * y + 1.0) / e - 1;
                            double *bin = disc && sqrt(X * X + Y * Y) > 1 - 4.0 / e ? &ring : &worst;
                            if (!(error <= *bin)) *bin = error;
                        }
            }
            char what[80];
            sprintf(what, "%s %d: worst texel of levels 1, 2 against its mean", oracle_name[m], some[i]);
            FIGURE(what, worst, some[i] % 4 ? 0.7 / some[i] : 15.0 / (some[i] * some[i]));
            if (disc) FIGURE("... and in its last ring", ring, m == ENVMAP_SPHERE ? 0.2 : 4.0 / some[i]);
            envmap_free(&map);
        }
}

/* Looked up on both sides of every edge, rim, seam and pole, with noise at level 0. */
static void no_level_has_a_seam(void) {
    static const int which[] = {ENVMAP_CUBE, ENVMAP_PARABOLOID, ENVMAP_LATLONG, ENVMAP_OCTAHEDRAL};
    for (int k = 0; k < 4; ++k)
        for (int i = 0; i < 3; ++i) {
            static const int some[] = {8, 11, 16};
            int m = which[k];
            unsigned long long state = 5;
            envmap map = make(m, some[i]);
            scene(&map);
            CHECK(envmap_mips_build(&map) == ENVMAP_OK);
            double worst = 0;
            for (float level = 0; level <= (float)map.levels - 1; level += 0.5f)
                for (int j = 0; j < test_many(4000); ++j) {
                    double d[3] = {1, 1, 1}, t = 2 * test_random(&state) - 1;
                    if (m == ENVMAP_CUBE) {
                        for (int c = 0; c < 3; ++c) d[c] = test_random(&state) < 0.5 ? -1 : 1;
                        if (j % 8) d[j % 3] = t; /* else a corner */
                    } else if (m == ENVMAP_PARABOLOID) {
                        d[0] = cos(PI * t), d[1] = sin(PI * t), d[2] = 0;
                    } else if (m == ENVMAP_OCTAHEDRAL && j % 8) { /* edges and folds */
                        d[j % 3] = 0, d[(j + 1) % 3] = cos(PI * t), d[(j + 2) % 3] = sin(PI * t);
                    } else if (j % 8) {
                        d[0] = 0, d[1] = cos(PI * (t + 1) / 2), d[2] = sin(PI * (t + 1) / 2);
                    } else {
                        d[0] = d[2] = 0; /* a pole */
                    }
                    double a[3];
                    float side[2][3], rgb[2][3];
                    oracle_tangent(a, d, 2 * PI * test_random(&state));
                    for (int c = 0; c < 3; ++c) {
                        side[0][c] = (float)(d[c] + 1e-6 * a[c]);
                        side[1][c] = (float)(d[c] - 1e-6 * a[c]);
                    }
                    envmap_lookup(rgb[0], &map, side[0], level);
                    envmap_lookup(rgb[1], &map, side[1], level);
                    for (int c = 0; c < 3; ++c) {
                        double e = fabs((double)rgb[0][c] - (double)rgb[1][c]);
                        if (!(e <= worst)) worst = e;
                    }
                }
            char what[80];
            sprintf(what, "%s %d: jump at seams, scene of radiance up to 75", oracle_name[m], some[i]);
            FIGURE(what, worst, 0.02); /* slope 75 * 32 per radian at most, times 2e-6, and floats */
            envmap_free(&map);
        }
}

static void mips_leave_level_0_and_refuse_bad_maps(void) {
    envmap map = make(ENVMAP_PARABOLOID, 9), copy = make(ENVMAP_PARABOLOID, 9), none = {0};
    size_t n = oracle_floats(ENVMAP_PARABOLOID, 9, 2, 0) * sizeof(float);
    oracle_noise(&map, 6);
    memcpy(copy.texels, map.texels, n);
    CHECK(envmap_mips_build(&map) == ENVMAP_OK);
    CHECK(!memcmp(copy.texels, map.texels, n));
    CHECK(envmap_mips_build(NULL) == ENVMAP_ERROR_ARGUMENT);
    CHECK(envmap_mips_build(&none) == ENVMAP_ERROR_ARGUMENT);
    envmap bad = map;
    bad.levels = 30;
    CHECK(envmap_mips_build(&bad) == ENVMAP_ERROR_ARGUMENT);
    bad = map, bad.mapping = 9;
    CHECK(envmap_mips_build(&bad) == ENVMAP_ERROR_ARGUMENT);
    envmap_free(&map), envmap_free(&copy);
    CHECK(envmap_create(&map, ENVMAP_CUBE, 1, 1, 1) == ENVMAP_OK);
    CHECK(envmap_mips_build(&map) == ENVMAP_OK); /* nothing to do */
    envmap_free(&map);
}

/* Building fewer levels than there could be gives the same levels. */
static void fewer_levels_are_the_same_levels(void) {
    envmap all = make(ENVMAP_CUBE, 12), few = {0};
    CHECK(envmap_create(&few, ENVMAP_CUBE, 12, 2, 2) == ENVMAP_OK);
    oracle_noise(&all, 7);
    size_t n = oracle_floats(ENVMAP_CUBE, 12, 2, 0), n1 = oracle_floats(ENVMAP_CUBE, 12, 2, 1);
    memcpy(few.texels, all.texels, n * sizeof(float));
    CHECK(envmap_mips_build(&all) == ENVMAP_OK && envmap_mips_build(&few) == ENVMAP_OK);
    CHECK(!memcmp(all.texels, few.texels, (n + n1) * sizeof(float)));
    envmap_free(&all), envmap_free(&few);
}

static void run_odd_first(void *user, envmap_task *task, void *context, int count) {
    for (int i = 1; i < count; i += 2) task(context, i);
    for (int i = 0; i < count; i += 2) task(context, i);
    *(int *)user += count;
}

static void run_none(void *user, envmap_task *task, void *context, int count) {
    (void)user, (void)task, (void)context, (void)count;
}

static void an_executor_gives_the_same_levels(void) {
    int tasks = 0;
    envmap_work work = {{&tasks, run_odd_first}, {NULL, NULL}, NULL}, bad = work;
    bad.executor.run = run_none;
    for (int m = 0; m < MAPPINGS; ++m) {
        envmap one = make(m, 133), other = make(m, 133);
        size_t n = 0;
        for (int l = 0; l < one.levels; ++l) n += oracle_floats(m, 133, 2, l);
        oracle_noise(&one, 8), oracle_noise(&other, 8);
        CHECK(envmap_mips_build(&one) == ENVMAP_OK);
        CHECK(envmap_mips_work(&other, &bad) == ENVMAP_ERROR_ARGUMENT);
        tasks = 0;
        CHECK(envmap_mips_work(&other, &work) == ENVMAP_OK && tasks > 33);
        CHECK(!memcmp(one.texels, other.texels, n * sizeof(float)));
        envmap_free(&one), envmap_free(&other);
    }
    CHECK(envmap_mips_work(NULL, &work) == ENVMAP_ERROR_ARGUMENT);
}

/* Radiance near the top of float must not overflow on the way. */
static void mips_of_huge_radiance_stay_finite(void) {
    for (int m = 0; m < MAPPINGS; ++m) {
        envmap map = make(m, 8);
        for (size_t k = 0; k < oracle_floats(m, 8, 2, 0); ++k) map.texels[k] = 3e38f;
        CHECK(envmap_mips_build(&map) == ENVMAP_OK);
        for (int l = 0; l < map.levels; ++l)
            CHECK_CLOSE(envmap_texel(&map, l, 0, 0, 0, 0)[0] / 3e38f, 1, 1e-6);
        envmap_free(&map);
    }
}

/* ------------------------------------------------------------------------------ footprints -- */

/* At the centre of a cube's face a texel is 2/size wide; at a lat-long's equator pi/size; at a
   paraboloid's centre 4/size (r = tan(t/2)), as at a sphere map's; an angular map's 2 pi/size. */
static void a_footprint_of_two_texels_is_level_one(void) {
    static const double texel[] = {2, 4, 4, PI, 2 * PI}; /* radians times size, at the centre */
    static const float centre[][3] = {{0, 0, 1}, {0, 0, 1}, {0, 0, 1}, {0, 0, -1}, {0, 0, -1}};
    for (int m = 0; m < 5; ++m) {
        envmap map = make(m, 256);
        double side = texel[m] / 256;
        for (int l = 0; l <= 4; ++l) {
            float longer = (float)(side * (1 << l)), shorter = longer / 7;
            float dx[3] = {longer, 0, 0}, dy[3] = {0, shorter, 0}, none[3] = {0, 0, 0};
            CHECK_CLOSE(envmap_footprint_level(&map, centre[m], dx, dy), l, 0.02);
            dx[0] = shorter, dy[1] = longer;
            CHECK_CLOSE(envmap_footprint_level(&map, centre[m], dx, dy), l, 0.02);
            CHECK_CLOSE(envmap_footprint_level(&map, centre[m], dy, none), l, 0.02);
        }
        envmap_free(&map);
    }
    envmap map = make(ENVMAP_CUBE, 64); /* all six faces alike */
    for (int f = 0; f < 6; ++f)
        for (int axis = 0; axis < 3; ++axis) {
            float d[3] = {0, 0, 0}, dx[3] = {0, 0, 0}, none[3] = {0, 0, 0};
            d[f / 2] = f % 2 ? -1 : 1;
            if (axis == f / 2) continue;
            dx[axis] = 4.0f / 64;
            CHECK_CLOSE(envmap_footprint_level(&map, d, dx, none), 1, 0.02);
        }
    envmap_free(&map);
}

/* A texel is 2/size wide at an octahedral map's centre and at its corners, sqrt 8/size across an
   edge halfway down to -y: over an edge, footprints are as long as beside it. */
static void a_footprint_goes_on_over_an_octahedral_edge(void) {
    static const double h = 0.7071067811865476;
    static const double at[5][3] = {{0, 1, 0}, {0, -1, 0}, {0, -1, 0}, {0, -h, h}, {-h, -h, 0}};
    static const double along[5][3] = {{1, 0, 0}, {1, 0, 0}, {h, 0, h}, {1, 0, 0}, {0, 0, 1}};
    envmap map = make(ENVMAP_OCTAHEDRAL, 256);
    for (int i = 0; i < 5; ++i)
        for (int l = 0; l <= 4; ++l) {
            double side = (i < 3 ? 2 : sqrt(8)) / 256 * (1 << l);
            float d[3], dx[3], none[3] = {0, 0, 0};
            for (int c = 0; c < 3; ++c) d[c] = (float)at[i][c], dx[c] = (float)(side * along[i][c]);
            CHECK_CLOSE(envmap_footprint_level(&map, d, dx, none), l, 0.02);
        }
    envmap_free(&map);
}

/* Where a texel's width changes by a third within 0.01 rad, it is the width at the direction. */
static void a_footprint_beside_a_pole_is_measured_where_it_is(void) {
    envmap map = make(ENVMAP_LATLONG, 256);
    float theta = 0.03f, dir[3] = {0, cosf(theta), -sinf(theta)}, none[3] = {0, 0, 0};
    float dx[3] = {0.01f, 0, 0};
    double texels = 0.01 * 512 / (2 * PI * sin((double)theta));
    CHECK_CLOSE(envmap_footprint_level(&map, dir, dx, none), log2(texels), 1e-4);
    envmap_free(&map);
}

static void footprints_clamp_to_the_levels(void) {
    float z[3] = {0, 0, 1}, none[3] = {0, 0, 0}, tiny[3] = {1e-9f, 0, 0}, huge[3] = {100, 0, 0};
    for (int m = 0; m < MAPPINGS; ++m) {
        envmap map = make(m, 32);
        CHECK(envmap_footprint_level(&map, z, none, none) == 0);
        CHECK(envmap_footprint_level(&map, z, tiny, tiny) == 0);
        CHECK(envmap_footprint_level(&map, z, huge, none) == 5);
        CHECK(envmap_footprint_level(&map, z, tiny, huge) == 5);
        envmap_free(&map);
    }
}

static void bad_footprints_are_level_0(void) {
    const float nan = (float)NAN, inf = (float)INFINITY;
    float z[3] = {0, 0, 1}, x[3] = {0.1f, 0, 0};
    const float bad[][3] = {{nan, 0, 0}, {0, inf, 0}, {0, 0, -inf}, {nan, nan, nan}};
    envmap map = make(ENVMAP_CUBE, 32), none = {0};
    CHECK(envmap_footprint_level(&map, z, x, x) > 0);
    for (int i = 0; i < 4; ++i) {
        CHECK(envmap_footprint_level(&map, z, bad[i], x) == 0);
        CHECK(envmap_footprint_level(&map, z, x, bad[i]) == 0);
        CHECK(envmap_footprint_level(&map, bad[i], x, x) == 0);
    }
    CHECK(envmap_footprint_level(&none, z, x, x) == 0);
    CHECK(envmap_footprint_level(NULL, z, x, x) == 0);
    envmap_free(&map);
}

/* A wider footprint is never a finer level, and one twice as wide is one level coarser. */
static void footprints_double_level_by_level(void) {
    unsigned long long state = 9;
    for (int m = 0; m < MAPPINGS; ++m) {
        envmap map = make(m, 1024);
        for (int i = 0; i < test_many(2000); ++i) {
            double d[3], t[2][3];
            oracle_random_direction(d, &state);
            oracle_tangent(t[0], d, 2 * PI * test_random(&state));
            oracle_tangent(t[1], d, 2 * PI * test_random(&state));
            float f[3], dx[3], dy[3], before = 0;
            for (int l = 0; l < 4; ++l) {
                double side = 0.02 * (1 << l);
                for (int c = 0; c < 3; ++c) {
                    f[c] = (float)d[c];
                    dx[c] = (float)(side * t[0][c]), dy[c] = (float)(0.3 * side * t[1][c]);
                }
                float level = envmap_footprint_level(&map, f, dx, dy);
                CHECK(level >= 0 && level <= 10);
                if (l && before > 0 && level < 10) CHECK_CLOSE(level - before, 1, 1e-3);
                before = level;
            }
        }
        envmap_free(&map);
    }
}

/* ------------------------------------------------------------------- assembled footprints -- */

/* Waves a sixth of a radian long, that a blur takes away. */
static double waves(const double d[3], int channel) {
    return 1 + 0.9 * sin(40 * (d[channel] + 0.3 * d[(channel + 1) % 3]));
}

/* The mean of bilinear lookups at 24 x 24 points of the footprint. */
static void dense_footprint(double rgb[3], const envmap *map, const float dir[3], const float dx[3],
                            const float dy[3]) {
    rgb[0] = rgb[1] = rgb[2] = 0;
    for (int i = 0; i < 24 * 24; ++i) {
        float d[3], tap[3], s = ((float)(i % 24) + 0.5f) / 24 - 0.5f;
        float t = ((float)(i / 24) + 0.5f) / 24 - 0.5f;
        for (int c = 0; c < 3; ++c) d[c] = dir[c] + s * dx[c] + t * dy[c];
        envmap_lookup(tap, map, d, 0);
        for (int c = 0; c < 3; ++c) rgb[c] += (double)tap[c] / (24 * 24);
    }
}

/* rms error of footprints of longer by shorter rad, turned at random, at an angle from an axis. */
static void footprint_errors(double error[2], int mapping, const float axis[3], double away,
                             double longer, double shorter) {
    unsigned long long state = 4;
    envmap map = make(mapping, 128);
    oracle_fill(&map, 0, waves);
    CHECK(envmap_mips_build(&map) == ENVMAP_OK);
    double pole[3] = {(double)axis[0], (double)axis[1], (double)axis[2]}, sum = 0;
    error[0] = error[1] = 0;
    for (int i = 0; i < test_many(300); ++i) {
        double t[3], d[3], a[3], b[3], truth[3], turn = 2 * PI * test_random(&state);
        float dir[3], dx[3], dy[3], rgb[3];
        oracle_tangent(t, pole, 2 * PI * test_random(&state));
        for (int k = 0; k < 3; ++k) d[k] = cos(away) * pole[k] + sin(away) * t[k];
        oracle_tangent(a, d, turn), oracle_tangent(b, d, turn + PI / 2);
        for (int k = 0; k < 3; ++k) {
            dir[k] = (float)d[k], dx[k] = (float)(longer * a[k]), dy[k] = (float)(shorter * b[k]);
        }
        dense_footprint(truth, &map, dir, dx, dy);
        for (int probes = 1; probes <= 16; probes += 15) {
            envmap_lookup_footprint(rgb, &map, dir, dx, dy, probes);
            for (int c = 0; c < 3; ++c) {
                double e = (double)rgb[c] - truth[c];
                error[probes > 1] += e * e;
            }
        }
        for (int c = 0; c < 3; ++c) sum += truth[c] * truth[c];
    }
    error[0] = sqrt(error[0] / sum), error[1] = sqrt(error[1] / sum);
    envmap_free(&map);
}

static void assembled_footprints_see_what_one_level_blurs(void) {
    static const struct {
        const char *what;
        int mapping;
        float axis[3];
        double away, longer, shorter;
    } rows[] = {{"cube, 8 : 1", ENVMAP_CUBE, {1, 0, 0}, 0.4, 0.4, 0.05},
                {"lat-long, near a pole, square", ENVMAP_LATLONG, {0, 1, 0}, 0.2, 0.1, 0.1},
                {"lat-long, near a pole, 4 : 1", ENVMAP_LATLONG, {0, -1, 0}, 0.2, 0.2, 0.05},
                {"sphere map, near its rim, square", ENVMAP_SPHERE, {0, 0, -1}, 0.3, 0.1, 0.1},
                {"sphere map, near its rim, 4 : 1", ENVMAP_SPHERE, {0, 0, -1}, 0.3, 0.2, 0.05}};
    for (int i = 0; i < 5; ++i) {
        double e[2];
        footprint_errors(e, rows[i].mapping, rows[i].axis, rows[i].away, rows[i].longer,
                         rows[i].shorter);
        printf("    %-40s one level: rms %.3g\n", rows[i].what, e[0]);
        FIGURE("... 16 probes: rms", e[1], 0.8 * e[0]);
    }
}

static void assembled_footprints_that_are_square_or_of_one_probe_are_lookups(void) {
    const float z[3] = {0, 0, 1}, thin[3] = {0, 0.01f, 0};
    const float dx[3] = {0.1f, 0, 0}, dy[3] = {0, 0.1f, 0};
    float twice[3], long_x[3], long_y[3], a[3], b[3];
    envmap map = make(ENVMAP_CUBE, 64);
    scene(&map);
    CHECK(envmap_mips_build(&map) == ENVMAP_OK);
    envmap_lookup(a, &map, z, envmap_footprint_level(&map, z, dx, dy));
    envmap_lookup_footprint(b, &map, z, dx, dy, 16);
    for (int c = 0; c < 3; ++c) CHECK_CLOSE(a[c], b[c], 1e-4);
    envmap_lookup(a, &map, z, envmap_footprint_level(&map, z, dx, thin));
    envmap_lookup_footprint(b, &map, z, dx, thin, 1);
    CHECK(!memcmp(a, b, sizeof a));
    envmap_lookup_footprint(b, &map, z, dx, thin, -5);
    CHECK(!memcmp(a, b, sizeof a));
    for (int c = 0; c < 3; ++c) twice[c] = 2 * z[c], long_x[c] = 2 * dx[c], long_y[c] = 2 * thin[c];
    envmap_lookup_footprint(a, &map, z, dx, thin, 8);
    envmap_lookup_footprint(b, &map, twice, long_x, long_y, 8); /* directions have any length */
    for (int c = 0; c < 3; ++c) CHECK_CLOSE(a[c], b[c], 1e-4 * (1 + fabs((double)a[c])));
    envmap_lookup_footprint(b, &map, z, thin, dx, 8); /* and sides any order */
    for (int c = 0; c < 3; ++c) CHECK_CLOSE(a[c], b[c], 1e-4 * (1 + fabs((double)a[c])));
    envmap_free(&map);
}

/* A parallelogram of two long sides is thin: its axes are those of the ellipse that they span. */
static void assembled_footprints_find_the_axes_of_a_sheared_one(void) {
    const float z[3] = {0, 0, 1}, dx[3] = {0.2f, 0.19f, 0}, dy[3] = {0.19f, 0.2f, 0};
    envmap map = make(ENVMAP_CUBE, 128);
    double truth[3], one = 0, many = 0;
    oracle_fill(&map, 0, waves);
    CHECK(envmap_mips_build(&map) == ENVMAP_OK);
    dense_footprint(truth, &map, z, dx, dy);
    for (int probes = 1; probes <= 64; probes += 63) {
        float rgb[3];
        envmap_lookup_footprint(rgb, &map, z, dx, dy, probes);
        for (int c = 0; c < 3; ++c)
            *(probes > 1 ? &many : &one) += fabs((double)rgb[c] / truth[c] - 1) / 3;
    }
    printf("    %-64s %.3g\n", "sheared, one level: relative error", one);
    FIGURE("64 probes", many, 0.8 * one);
    envmap_free(&map);
}

static void assembled_footprints_of_bad_numbers_are_level_0_or_black(void) {
    const float nan = (float)NAN, inf = (float)INFINITY, z[3] = {0, 0, 1}, x[3] = {0.1f, 0, 0};
    const float bad[][3] = {{nan, 0, 0}, {0, inf, 0}, {nan, nan, nan}}, huge[3] = {1e30f, 0, 0};
    envmap map = make(ENVMAP_CUBE, 32), none = {0};
    float a[3], b[3] = {1, 1, 1};
    scene(&map);
    CHECK(envmap_mips_build(&map) == ENVMAP_OK);
    envmap_lookup(a, &map, z, 0);
    for (int i = 0; i < 3; ++i) {
        envmap_lookup_footprint(b, &map, z, bad[i], x, 8);
        CHECK(!memcmp(a, b, sizeof a));
        envmap_lookup_footprint(b, &map, bad[i], x, x, 8);
        CHECK(b[0] >= 0 && b[0] < 1e3f);
    }
    envmap_lookup_footprint(b, &map, z, huge, x, 256);
    CHECK(b[0] >= 0 && b[0] < 1e3f);
    envmap_lookup_footprint(b, &none, z, x, x, 8);
    CHECK(b[0] == 0 && b[1] == 0 && b[2] == 0);
    b[0] = 1;
    envmap_lookup_footprint(b, NULL, z, x, x, 8);
    CHECK(b[0] == 0);
    envmap_lookup_footprint(b, &map, NULL, x, x, 8);
    envmap_lookup_footprint(b, &map, z, NULL, NULL, 8);
    envmap_lookup_footprint(NULL, &map, z, x, x, 8);
    envmap_free(&map);
}

static void no_test_leaked(void) {
    CHECK(oracle_live == 0);
    CHECK(oracle_wrong_context == 0);
}

int main(void) {
    RUN(mip_levels_carry_the_same_energy);
    RUN(the_top_level_is_one_colour_the_mean_of_the_sphere);
    RUN(a_constant_stays_itself_at_every_level);
    RUN(mip_texels_are_the_mean_over_their_part_of_the_sphere);
    RUN(no_level_has_a_seam);
    RUN(mips_leave_level_0_and_refuse_bad_maps);
    RUN(fewer_levels_are_the_same_levels);
    RUN(an_executor_gives_the_same_levels);
    RUN(mips_of_huge_radiance_stay_finite);
    RUN(a_footprint_of_two_texels_is_level_one);
    RUN(a_footprint_goes_on_over_an_octahedral_edge);
    RUN(a_footprint_beside_a_pole_is_measured_where_it_is);
    RUN(footprints_clamp_to_the_levels);
    RUN(bad_footprints_are_level_0);
    RUN(footprints_double_level_by_level);
    RUN(assembled_footprints_see_what_one_level_blurs);
    RUN(assembled_footprints_that_are_square_or_of_one_probe_are_lookups);
    RUN(assembled_footprints_find_the_axes_of_a_sheared_one);
    RUN(assembled_footprints_of_bad_numbers_are_level_0_or_black);
    RUN(no_test_leaked);
    return test_summary();
}
