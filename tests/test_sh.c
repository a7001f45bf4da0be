/* SPDX-License-Identifier: MIT
   Spherical harmonics in the open: the basis against Gauss nodes and the addition theorem,
   projection against the plain sum over texels and against lights in the worst places, convolution
   against quadrature, rotation against its group, nine numbers of irradiance against the exact
   diffuse map, a sun's ringing against its closed form. */
#define ENVMAP_IMPLEMENTATION
#include "zonal.h"

/* ----------------------------------------------------------------------------------- tools ---- */

enum { MOST = 32, NUMBERS = 3 * MOST * MOST };

static double larger(double a, double b) { return b <= a ? a : b; } /* NaN wins */

static void random_coefficients(double *sh, int bands, unsigned long long seed) {
    for (int i = 0; i < 3 * bands * bands; ++i) sh[i] = test_random(&seed) - 0.5;
}

static double furthest(const double *a, const double *b, int count) {
    double worst = 0;
    for (int i = 0; i < count; ++i) worst = larger(worst, fabs(a[i] - b[i]));
    return worst;
}

static envmap map_of(int mapping, int size) {
    envmap map;
    memset(&map, 0, sizeof map);
    if (!CHECK(envmap_create(&map, mapping, size, 1, 1) == ENVMAP_OK)) exit(1);
    return map;
}

static size_t floats_of(const envmap *map) {
    return oracle_floats(map->mapping, map->size, map->slices, 0);
}

/* A turn about z, then x, then z. */
static void turn_of(double R[9], double a, double b, double c) {
    double z1[9] = {cos(a), -sin(a), 0, sin(a), cos(a), 0, 0, 0, 1};
    double x[9] = {1, 0, 0, 0, cos(b), -sin(b), 0, sin(b), cos(b)};
    double z2[9] = {cos(c), -sin(c), 0, sin(c), cos(c), 0, 0, 0, 1}, t[9];
    memset(t, 0, sizeof t);
    for (int i = 0; i < 9; ++i)
        for (int k = 0; k < 3; ++k) t[i] += x[3 * (i / 3) + k] * z1[3 * k + i % 3];
    for (int i = 0; i < 9; ++i) {
        R[i] = 0;
        for (int k = 0; k < 3; ++k) R[i] += z2[3 * (i / 3) + k] * t[3 * k + i % 3];
    }
}

static void times(double out[3], const double R[9], const double d[3]) {
    for (int i = 0; i < 3; ++i)
        out[i] = R[3 * i] * d[0] + R[3 * i + 1] * d[1] + R[3 * i + 2] * d[2];
}

/* ----------------------------------------------------------------------------------- basis ---- */

static void the_basis_is_that_of_the_convention(void) {
    static double Y[MOST * MOST];
    unsigned long long seed = 3;
    double worst = 0, k1 = sqrt(3 / (4 * PI));
    for (int i = 0; i < test_many(300); ++i) {
        double d[3], scaled[3];
        oracle_random_direction(d, &seed);
        for (int k = 0; k < 3; ++k) scaled[k] = 7.5 * d[k];
        CHECK(envmap_sh_basis(Y, MOST, scaled) == ENVMAP_OK);
        for (int l = 0; l < MOST; ++l)
            for (int m = -l; m <= l; ++m)
                worst = larger(worst, fabs(Y[l * (l + 1) + m] - o_harmonic(l, m, d)));
        CHECK_CLOSE(Y[0], 1 / sqrt(4 * PI), 1e-15);
        CHECK_CLOSE(Y[1], k1 * d[1], 1e-15); /* y, z, x: no sign in front */
        CHECK_CLOSE(Y[2], k1 * d[2], 1e-15);
        CHECK_CLOSE(Y[3], k1 * d[0], 1e-15);
        CHECK_CLOSE(Y[4], 2 * k1 * sqrt(1.25) * d[0] * d[1], 1e-14);
        CHECK_CLOSE(Y[8], k1 * sqrt(1.25) * (d[0] * d[0] - d[1] * d[1]), 1e-14);
    }
    FIGURE("the basis to 32 bands, over angles", worst, 1e-12);
}

static void the_basis_is_orthonormal(void) {
    enum { L = 20 };
    static double Y[L * L], product[L * L][L * L];
    double z[L], w[L], worst = 0;
    memset(product, 0, sizeof product);
    o_gauss(L, z, w);
    for (int i = 0; i < L * 2 * L; ++i) {
        double phi = PI * (i % (2 * L)) / L, s = sqrt(1 - z[i / (2 * L)] * z[i / (2 * L)]);
        double d[3] = {s * cos(phi), s * sin(phi), z[i / (2 * L)]};
        CHECK(envmap_sh_basis(Y, L, d) == ENVMAP_OK);
        for (int a = 0; a < L * L; ++a) {
            double by = Y[a] * w[i / (2 * L)] * PI / L;
            for (int b = 0; b <= a; ++b) product[a][b] += by * Y[b];
        }
    }
    for (int a = 0; a < L * L; ++a)
        for (int b = 0; b <= a; ++b) worst = larger(worst, fabs(product[a][b] - (a == b)));
    FIGURE("orthonormality of 20 bands at Gauss nodes", worst, 1e-12);
}

static void the_basis_is_stable_to_256_bands(void) {
    static double Y[256 * 256];
    static const double near_pole[] = {0, 1e-300, 1e-30, 1e-8, 1e-3, 0.02, 0.3, 1, PI / 2};
    double worst = 0;
    for (size_t i = 0; i < sizeof near_pole / sizeof *near_pole; ++i)
        for (int south = 0; south < 2; ++south) {
            double t = near_pole[i], d[3] = {sin(t) * 0.6, sin(t) * 0.8, south ? -cos(t) : cos(t)};
            CHECK(envmap_sh_basis(Y, 256, d) == ENVMAP_OK);
            for (int l = 0; l < 256; ++l) {
                double sum = 0; /* the addition theorem: sum_m Y_lm^2 = (2l+1)/4pi */
                for (int m = -l; m <= l; ++m) sum += Y[l * (l + 1) + m] * Y[l * (l + 1) + m];
                worst = larger(worst, fabs(sum * 4 * PI / (2 * l + 1) - 1));
            }
        }
    FIGURE("addition theorem to 256 bands, poles too, relative", worst, 1e-10);
}

/* -------------------------------------------------------------------------------- projection -- */

static int of_l, of_m;
static double one_harmonic(const double d[3], int channel) {
    return (channel + 1) * o_harmonic(of_l, of_m, d);
}

static double own_projection_error(int mapping, int size) {
    envmap map = map_of(mapping, size);
    double worst = 0;
    for (int i = 0; i < 9; ++i) {
        double sh[27];
        of_l = i > 3 ? 2 : i > 0, of_m = i - of_l * (of_l + 1);
        oracle_fill(&map, 0, one_harmonic);
        CHECK(envmap_sh_project(sh, 3, &map, 0, 0, NULL) == ENVMAP_OK);
        for (int k = 0; k < 27; ++k)
            worst = larger(worst, fabs(sh[k] / (k % 3 + 1) - (k / 3 == i)));
    }
    envmap_free(&map);
    return worst;
}

static void a_harmonic_projects_onto_itself(void) {
    double cube = 0, latlong = 0;
    for (int size = 16; size <= (test_many(100) < 100 ? 16 : 128); size *= 2) {
        cube = larger(cube, own_projection_error(ENVMAP_CUBE, size) * size * size);
        latlong = larger(latlong, own_projection_error(ENVMAP_LATLONG, size) * size * size);
    }
    FIGURE("Y_lm of nine, off the unit vector, times size^2: cube", cube, 0.5);
    FIGURE("the same on a lat-long map", latlong, 1.2);
}

static void projection_is_the_plain_sum(void) {
    enum { L = 6 };
    for (int n = 0; n < 2 * ENVMAP_MAPPING_COUNT; ++n) {
        int mapping = n / 2;
        envmap map = map_of(mapping, 24 + n % 2); /* an odd edge has texels in its middle */
        o_source s;
        double sh[3 * L * L], sum[3 * L * L];
        oracle_noise(&map, 5);
        o_source_make(&s, &map);
        memset(sum, 0, sizeof sum);
        for (int i = 0; i < s.count; ++i)
            for (int l = 0; l < L && s.omega[i] > 0; ++l)
                for (int m = -l; m <= l; ++m) {
                    double Y = s.omega[i] * o_harmonic(l, m, s.d + 3 * i);
                    for (int c = 0; c < 3; ++c)
                        sum[3 * (l * (l + 1) + m) + c] += Y * s.rgb[3 * i + c];
                }
        CHECK(envmap_sh_project(sh, L, &map, 0, 0, NULL) == ENVMAP_OK);
        FIGURE(oracle_name[mapping], furthest(sh, sum, 3 * L * L), 1e-11);
        CHECK(envmap_sh_project(sh, 3, &map, 0, 0, NULL) == ENVMAP_OK);
        FIGURE("its first nine alone", furthest(sh, sum, 3 * 9), 1e-11);
        o_source_free(&s);
        envmap_free(&map);
    }
}

/* The worst of |error| / (tolerance sqrt(2l+1) a_00) with every texel dark but one, or noise. */
static double over_tolerance(envmap *map, int bands, double tolerance, int lights, int lit) {
    static double fast[NUMBERS], all[NUMBERS];
    unsigned long long seed = 17;
    double worst = 0;
    for (int i = 0; i < lights; ++i) {
        if (lit) memset(map->texels, 0, floats_of(map) * sizeof(float));
        if (lit) {
            size_t texel = (size_t)(test_random(&seed) * (double)(floats_of(map) / 3));
            if (map->mapping == ENVMAP_LATLONG && i < 4) /* at a pole */
                texel = i & 1 ? floats_of(map) / 3 - 1 - texel % 8 : texel % 8;
            for (int c = 0; c < 3; ++c) map->texels[3 * texel + (size_t)c] = 1;
        } else {
            oracle_noise(map, seed++);
        }
        CHECK(envmap_sh_project(fast, bands, map, 0, tolerance, NULL) == ENVMAP_OK);
        CHECK(envmap_sh_project(all, bands, map, 0, 0, NULL) == ENVMAP_OK);
        for (int k = 0; k < 3 * bands * bands && all[0] > 0; ++k) {
            int l = (int)sqrt(k / 3 + 0.5);
            double allowed = tolerance * sqrt(2.0 * l + 1) * all[k % 3];
            worst = larger(worst, fabs(fast[k] - all[k]) / allowed);
        }
    }
    return worst;
}

static void points_keep_the_tolerance(void) {
    static const int sizes[MAPPINGS] = {96, 120, 140, 90, 150, 150};
    for (int mapping = 0; mapping < ENVMAP_MAPPING_COUNT; ++mapping) {
        envmap map = map_of(mapping, sizes[mapping]);
        double lit = 0, noise = 0;
        for (int bands = 1; bands <= 9; bands += 2)
            for (double tolerance = 1e-2; tolerance > 5e-6; tolerance /= 10) {
                lit = larger(lit, over_tolerance(&map, bands, tolerance, test_many(4), 1));
                noise = larger(noise, over_tolerance(&map, bands, tolerance, 1, 0));
            }
        FIGURE(oracle_name[mapping], lit, 1);
        FIGURE("  the same for noise", noise, 0.3);
        CHECK(noise > 0); /* it did take points */
        envmap_free(&map);
    }
}

/* Coefficients that fill a map with numbers up to `most` project onto themselves, whatever it is. */
static void radiance_at_both_ends_of_floats_is_filled_in_and_projected(void) {
    static const double most[6] = {3.4e38, 1e37, 1, 1e-30, 1e-37, 1e-41};
    static double sh[27], back[27];
    double worst = 0;
    for (int i = 0; i < 12; ++i) {
        envmap map = map_of(ENVMAP_CUBE, 64), exact = map_of(ENVMAP_CUBE, 64);
        double tolerance = i < 6 ? 1e-2 : 1e-4, scale = most[i % 6];
        random_coefficients(sh, 3, 6);
        double bound =
            fmax(fmax(envmapi_sh_bound(sh, 3, NULL, 0), envmapi_sh_bound(sh, 3, NULL, 1)),
                 envmapi_sh_bound(sh, 3, NULL, 2));
        for (int k = 0; k < 27; ++k) sh[k] *= scale / bound;
        CHECK(envmap_sh_fill(&map, 0, 0, sh, 3, tolerance, NULL) == ENVMAP_OK);
        CHECK(envmap_sh_fill(&exact, 0, 0, sh, 3, 0, NULL) == ENVMAP_OK);
        for (size_t k = 0; k < floats_of(&map); ++k)
            worst = larger(worst, fabs((double)map.texels[k] - (double)exact.texels[k]) / scale /
                                      tolerance);
        CHECK(envmap_sh_project(back, 3, &exact, 0, tolerance, NULL) == ENVMAP_OK);
        for (int k = 0; k < 27; ++k)
            worst = larger(worst, fabs(back[k] - sh[k]) / scale / (tolerance + 2e-3));
        envmap_free(&map), envmap_free(&exact);
    }
    FIGURE("filled in, and projected back, in tolerances", worst, 1);
}

static void run_backwards(void *user, envmap_task *task, void *context, int count) {
    ++*(int *)user;
    while (count-- > 0) task(context, count);
}

static void coefficients_are_the_same_bits_for_any_executor(void) {
    static double a[27], b[27];
    int runs = 0;
    envmap_work work;
    memset(&work, 0, sizeof work);
    work.executor.user = &runs, work.executor.run = run_backwards;
    envmap map = map_of(ENVMAP_CUBE, 100), other = map_of(ENVMAP_CUBE, 100);
    oracle_noise(&map, 8);
    for (int i = 0; i < 2; ++i) {
        CHECK(envmap_sh_project(a, 3, &map, 0, i ? 1e-3 : 0, NULL) == ENVMAP_OK);
        CHECK(envmap_sh_project(b, 3, &map, 0, i ? 1e-3 : 0, &work) == ENVMAP_OK);
        CHECK(!memcmp(a, b, sizeof a));
    }
    for (int i = 0; i < 2; ++i) {
        CHECK(envmap_sh_fill(&map, 0, 0, a, 3, i ? 1e-3 : 0, NULL) == ENVMAP_OK);
        CHECK(envmap_sh_fill(&other, 0, 0, a, 3, i ? 1e-3 : 0, &work) == ENVMAP_OK);
        CHECK(!memcmp(map.texels, other.texels, floats_of(&map) * sizeof(float)));
    }
    CHECK(runs > 8);
    envmap_free(&map);
    envmap_free(&other);
}

static void filling_evaluates_at_every_texel(void) {
    static double sh[3 * 25];
    double worst = 0;
    random_coefficients(sh, 5, 6);
    for (int mapping = 0; mapping < ENVMAP_MAPPING_COUNT; ++mapping) {
        envmap map;
        memset(&map, 0, sizeof map);
        CHECK(envmap_create(&map, mapping, 12, 2, 3) == ENVMAP_OK);
        CHECK(envmap_sh_fill(&map, 1, 2, sh, 5, 0, NULL) == ENVMAP_OK);
        for (int face = 0; face < envmap_faces(mapping); ++face)
            for (int y = 0; y < 6; ++y)
                for (int x = 0; x < oracle_width(mapping, 6); ++x) {
                    double d[3], rgb[3];
                    const float *texel = envmap_texel(&map, 1, 2, face, x, y);
                    oracle_direction(d, mapping, face, (x + 0.5) / oracle_width(mapping, 6),
                                     (y + 0.5) / 6);
                    CHECK(envmap_sh_evaluate(rgb, sh, 5, d) == ENVMAP_OK);
                    for (int c = 0; c < 3; ++c)
                        worst = larger(worst, fabs((double)texel[c] - rgb[c]));
                }
        for (int s = 0; s < 2; ++s)
            CHECK(!memcmp(envmap_texel(&map, 1, s, 0, 0, 0), map.texels, 36)); /* black */
        envmap_free(&map);
    }
    FIGURE("filled texels - evaluated directions", worst, 1e-6);
}

/* ------------------------------------------------------------------------------- convolution -- */

static void convolving_is_filtering(void) {
    enum { L = 8, N = 64 };
    static const o_lobe lobes[] = {{O_GAUSSIAN, 4}, {O_PHONG, 8}, {O_PHONG, 20}};
    double z[N], w[N], sh[3 * L * L], out[3 * L * L], worst = 0;
    random_coefficients(sh, L, 9);
    o_gauss(N, z, w);
    for (int i = 0; i < 3; ++i) {
        envmap_lobe lobe = i ? envmap_lobe_phong((float)lobes[i].n) : envmap_lobe_gaussian(4);
        unsigned long long seed = 10;
        CHECK(envmap_sh_convolve(out, sh, L, &lobe, 0) == ENVMAP_OK);
        for (int t = 0; t < 5; ++t) { /* rings about the axis: integral of k f, over that of k */
            double a[3], sum[3] = {0, 0, 0}, norm = 0, rgb[3], s[3], u[3];
            oracle_random_direction(a, &seed);
            oracle_tangent(s, a, 0), oracle_tangent(u, a, PI / 2);
            for (int j = 0; j < N; ++j)
                for (int k = 0; k < 2 * L; ++k) {
                    int front = lobes[i].kind == O_PHONG; /* the horizon ends the panel */
                    double x = front ? (z[j] + 1) / 2 : z[j], r = sqrt(1 - x * x), d[3];
                    double by = w[j] * (double)o_k(lobes[i], acosl((long double)x), 0);
                    for (int q = 0; q < 3; ++q)
                        d[q] = x * a[q] + r * (cos(PI * k / L) * s[q] + sin(PI * k / L) * u[q]);
                    CHECK(envmap_sh_evaluate(rgb, sh, L, d) == ENVMAP_OK);
                    for (int c = 0; c < 3; ++c) sum[c] += by * rgb[c];
                    norm += by;
                }
            CHECK(envmap_sh_evaluate(rgb, out, L, a) == ENVMAP_OK);
            for (int c = 0; c < 3; ++c) worst = larger(worst, fabs(rgb[c] - sum[c] / norm));
        }
    }
    FIGURE("coefficients times lambda_l - integral of k f (Funk-Hecke)", worst, 1e-12);
    envmap_lobe diffuse = envmap_lobe_diffuse();
    diffuse.raw = 1;
    CHECK(envmap_sh_convolve(sh, sh, L, &diffuse, 0) == ENVMAP_OK);
    random_coefficients(out, L, 9);
    CHECK_CLOSE(sh[0] / out[0], PI, 1e-12); /* [RH01]: A_0, A_1, A_2, A_3 */
    CHECK_CLOSE(sh[3] / out[3], 2 * PI / 3, 1e-12);
    CHECK_CLOSE(sh[12] / out[12], PI / 4, 1e-12);
    CHECK_CLOSE(sh[27], 0, 1e-12);
}

/* Some sky, ground and a soft lamp: nothing that a table could hold. */
static double small_scene(const double d[3], int channel) {
    double lamp = d[0] * 0.6 + d[1] * 0.64 + d[2] * 0.48;
    double sky = d[1] > 0 ? 1 + 0.5 * channel * d[1] : 0.3 - 0.05 * channel;
    return sky + 0.2 * sin(9 * d[0]) * d[2] + 30 * exp(60 * (lamp - 1));
}

static void nine_numbers_light_like_the_exact_map(void) {
    static double sh[300], lit[300];
    envmap_lobe diffuse = envmap_lobe_diffuse();
    envmap_filter_desc desc;
    envmap src = map_of(ENVMAP_CUBE, 32), exact = map_of(ENVMAP_CUBE, 12);
    envmap few = map_of(ENVMAP_CUBE, 12);
    double before = 1;
    memset(&desc, 0, sizeof desc);
    desc.method = ENVMAP_METHOD_REFERENCE;
    oracle_fill(&src, 0, small_scene);
    CHECK(envmap_filter(&exact, &src, &diffuse, &desc) == ENVMAP_OK);
    for (int bands = 2; bands <= 10; ++bands) {
        envmap_difference d;
        CHECK(envmap_sh_project(sh, bands, &src, 0, 0, NULL) == ENVMAP_OK);
        CHECK(envmap_sh_convolve(lit, sh, bands, &diffuse, 0) == ENVMAP_OK);
        CHECK(envmap_sh_fill(&few, 0, 0, lit, bands, 0, NULL) == ENVMAP_OK);
        CHECK(envmap_compare(&d, &few, &exact, 0) == ENVMAP_OK);
        if (bands == 3) {
            FIGURE("nine coefficients - the exact diffuse map: rms", d.rms, 0.03);
            FIGURE("their worst texel", d.worst, 0.15);
        }
        if (bands == 10) FIGURE("a hundred coefficients: rms", d.rms, 0.0025);
        CHECK(d.rms < before + 2e-4); /* odd bands beyond 1 add nothing */
        before = d.rms;
    }
    envmap_free(&src);
    envmap_free(&exact);
    envmap_free(&few);
}

/* ---------------------------------------------------------------------------------- rotation -- */

static void rotations_turn_the_function(void) {
    static double sh[NUMBERS], out[NUMBERS];
    double R[9], worst = 0;
    unsigned long long seed = 4;
    random_coefficients(sh, MOST, 1);
    turn_of(R, 0.3, 1.1, -2.2);
    for (int mirror = 0; mirror < 2; ++mirror) {
        for (int i = 0; i < 3; ++i) R[i] = mirror ? -R[i] : R[i];
        CHECK(envmap_sh_rotate(out, sh, MOST, R) == ENVMAP_OK);
        for (int i = 0; i < 50; ++i) {
            double d[3], turned[3], a[3], b[3];
            oracle_random_direction(d, &seed);
            times(turned, R, d);
            CHECK(envmap_sh_evaluate(a, sh, MOST, d) == ENVMAP_OK);
            CHECK(envmap_sh_evaluate(b, out, MOST, turned) == ENVMAP_OK);
            worst = larger(worst, furthest(a, b, 3));
        }
    }
    FIGURE("out(R d) - sh(d), 32 bands, a mirror image too", worst, 1e-11);
}

static void rotations_compose(void) {
    static double sh[NUMBERS], once[NUMBERS], twice[NUMBERS], both[NUMBERS];
    double A[9], B[9], AB[9], back[9];
    random_coefficients(sh, MOST, 2);
    turn_of(A, 1.3, 0.4, 2), turn_of(B, -0.2, 2.5, 0.7);
    for (int i = 0; i < 9; ++i) {
        AB[i] = 0, back[i] = A[3 * (i % 3) + i / 3];
        for (int k = 0; k < 3; ++k) AB[i] += B[3 * (i / 3) + k] * A[3 * k + i % 3];
    }
    CHECK(envmap_sh_rotate(once, sh, MOST, A) == ENVMAP_OK);
    CHECK(envmap_sh_rotate(twice, once, MOST, B) == ENVMAP_OK);
    CHECK(envmap_sh_rotate(both, sh, MOST, AB) == ENVMAP_OK);
    FIGURE("B after A - (B A), 32 bands", furthest(twice, both, NUMBERS), 1e-12);
    CHECK(envmap_sh_rotate(twice, once, MOST, back) == ENVMAP_OK);
    FIGURE("there and back, 32 bands", furthest(twice, sh, NUMBERS), 1e-12);
}

static void rotations_keep_the_energy_of_each_band(void) {
    static double sh[NUMBERS], out[NUMBERS];
    double R[9], worst = 0;
    random_coefficients(sh, MOST, 3);
    turn_of(R, 2, 2.9, 0.1);
    CHECK(envmap_sh_rotate(out, sh, MOST, R) == ENVMAP_OK);
    for (int l = 0; l < MOST; ++l)
        for (int c = 0; c < 3; ++c) {
            double before = 0, after = 0;
            for (int i = l * l; i < (l + 1) * (l + 1); ++i)
                before += sh[3 * i + c] * sh[3 * i + c], after += out[3 * i + c] * out[3 * i + c];
            worst = larger(worst, fabs(after / before - 1));
        }
    FIGURE("energy of a band, turned / before - 1, 32 bands", worst, 1e-12);
}

/* ----------------------------------------------------------------------------------- ringing -- */

/* The lowest that a light's irradiance over pi gets with nine coefficients, times 4 pi:
   1 + 2 w_1 x + 5/8 w_2 (3x^2 - 1). */
static double sun_lowest_by(double w_1, double w_2) {
    double a = 2 * w_1, b = 0.625 * w_2, x = -a / (6 * b);
    if (x < -1) x = -1;
    return 1 + a * x + b * (3 * x * x - 1);
}

/* The window's own factors. */
static double sun_lowest(double mu) { return sun_lowest_by(exp(-mu), exp(-2 * mu)); }

/* The relative rms that factors move: lambda_l^2 (2l+1) is 1, 4/3, 5/16. */
static double sun_moved(double w_1, double w_2) {
    double change = 4.0 / 3 * pow(1 - w_1, 2) + 5.0 / 16 * pow(1 - w_2, 2);
    return sqrt(change / (1 + 4.0 / 3 + 5.0 / 16));
}

static double sun_mu(void) {
    double low = 0, high = 1;
    for (int i = 0; i < 60; ++i) {
        double middle = (low + high) / 2;
        if (sun_lowest(middle) < 0) low = middle;
        else high = middle;
    }
    return high;
}

/* The lowest value of a channel, over the mean, on fine rings. */
static double lowest_of(const double *sh, int bands, const envmap_lobe *lobe) {
    double lit[300], least = 1e9;
    if (lobe) CHECK(envmap_sh_convolve(lit, sh, bands, lobe, 0) == ENVMAP_OK);
    else memcpy(lit, sh, 3 * (size_t)(bands * bands) * sizeof *lit);
    for (int j = 0; j <= 180; ++j)
        for (int k = 0; k < 360; k += 2) {
            double t = PI * j / 180, p = PI * k / 180, rgb[3];
            double d[3] = {sin(t) * cos(p), sin(t) * sin(p), cos(t)};
            CHECK(envmap_sh_evaluate(rgb, lit, bands, d) == ENVMAP_OK);
            for (int c = 0; c < 3; ++c)
                if (rgb[c] / lit[c] * sqrt(4 * PI) < least) least = rgb[c] / lit[c] * sqrt(4 * PI);
        }
    return least;
}

static void sun_into(double *sh, int bands, double sky) {
    double Y[100], d[3] = {0.3, 0.7, -0.4};
    CHECK(envmap_sh_basis(Y, bands, d) == ENVMAP_OK);
    for (int i = 0; i < 3 * bands * bands; ++i) sh[i] = (i % 3 + 1) * Y[i / 3] + (i < 3 ? sky : 0);
}

static void a_suns_ringing_is_windowed_away(void) {
    double sh[300], out[300], moved, again;
    envmap_lobe diffuse = envmap_lobe_diffuse();
    sun_into(sh, 3, 0);
    CHECK_CLOSE(lowest_of(sh, 3, &diffuse), sun_lowest(0), 1e-3);
    CHECK(sun_lowest(0) < -0.1);
    CHECK(envmap_sh_window(out, &moved, sh, 3, &diffuse, 0) == ENVMAP_OK);
    double mu = log(sh[3] / out[3]);
    FIGURE("mu of one light and nine coefficients, off the closed form", fabs(mu / sun_mu() - 1),
           2e-3);
    CHECK_CLOSE(out[0], sh[0], 0); /* the mean stays */
    CHECK_CLOSE(sh[12] / out[12], exp(2 * mu), 1e-9);
    CHECK_CLOSE(exp(-mu), sqrt(56.0 / 75), 1e-3);
    CHECK_CLOSE(moved, sun_moved(exp(-mu), exp(-2 * mu)), 1e-9);
    FIGURE("relative rms that it moves", moved, 0.14);
    for (int bands = 2; bands <= 6; ++bands) {
        sun_into(sh, bands, 0.05);
        CHECK(envmap_sh_window(out, &moved, sh, bands, &diffuse, 0) == ENVMAP_OK);
        CHECK(lowest_of(sh, bands, &diffuse) < 0 && moved > 0 && moved < 1);
        double least = lowest_of(out, bands, &diffuse);
        CHECK(least > -1e-9);
        FIGURE("the lowest of windowed irradiance, over the mean", least, 2e-3);
        CHECK(envmap_sh_window(out, &again, out, bands, &diffuse, 0) == ENVMAP_OK);
        CHECK(again <= 0); /* what was windowed does not ring */
    }
}

/* [Sloan08]'s window is 1 / (1 + mu l^2 (l+1)^2). */
static void the_window_moves_less_than_sloans(void) {
    double sh[27], out[27], moved, mu = 0, least = 1;
    envmap_lobe diffuse = envmap_lobe_diffuse();
    sun_into(sh, 3, 0);
    CHECK(envmap_sh_window(out, &moved, sh, 3, &diffuse, 0) == ENVMAP_OK);
    while (sun_lowest_by(1 / (1 + 4 * mu), 1 / (1 + 36 * mu)) < 0) mu += 1e-5;
    CHECK_CLOSE(sun_moved(1 / (1 + 4 * mu), 1 / (1 + 36 * mu)), 0.42, 0.005);
    for (int i = 1; i <= 400; ++i)
        for (int k = 1; k <= 400; ++k)
            if (sun_lowest_by(i / 400.0, k / 400.0) >= 0)
                least = fmin(least, sun_moved(i / 400.0, k / 400.0));
    CHECK_CLOSE(least, 0.1055, 0.0005); /* what any two factors have to move */
    CHECK(moved >= least && moved < 1.25 * least);
}

/* A minimum between the points of a grid, beside one about as low, a channel black; and noise. */
static void windowed_scenes_are_nowhere_below_zero(void) {
    static const double two[9] = {2.8209, 2.9068,  1.3963, 1.5387, .5099,
                                  1.4567, -2.0500, 2.0030, .3824};
    double sh[300], out[300], lit[300], moved, d[3] = {-.377, -.917, .129}, rgb[3], least = 1;
    envmap_lobe diffuse = envmap_lobe_diffuse();
    for (int k = 0; k < 27; ++k) sh[k] = k % 3 == 1 ? two[k / 3] : k == 0;
    CHECK(envmap_sh_window(out, &moved, sh, 3, &diffuse, 0) == ENVMAP_OK && moved > 0.05);
    CHECK(envmap_sh_convolve(lit, out, 3, &diffuse, 0) == ENVMAP_OK);
    CHECK(envmap_sh_evaluate(rgb, lit, 3, d) == ENVMAP_OK && rgb[1] >= 0);
    CHECK(lowest_of(out, 3, &diffuse) > -1e-9);
    for (int i = 0; i < test_many(40); ++i) {
        int bands = 2 + i % 4;
        random_coefficients(sh, bands, 100 + (unsigned long long)i);
        for (int c = 0; c < 3; ++c) sh[c] = 1;
        CHECK(envmap_sh_window(out, &moved, sh, bands, NULL, 0) == ENVMAP_OK);
        least = -larger(-least, -lowest_of(out, bands, NULL));
        if (moved > 0) { /* a hundredth less is not enough */
            double mu = log(sh[3] / out[3]);
            for (int k = 0; k < 3 * bands * bands; ++k)
                lit[k] = sh[k] * exp(-0.99 * mu * floor(sqrt(k / 3 + 0.5)));
            CHECK(lowest_of(lit, bands, NULL) < 0);
        }
    }
    CHECK(least > -1e-9);
    FIGURE("windowed noise, its lowest over the mean", fabs(least), 1e-2);
}

static void what_does_not_ring_is_left_alone(void) {
    double sh[300], out[300], moved = 1;
    envmap_lobe diffuse = envmap_lobe_diffuse(), soft = envmap_lobe_gaussian(1);
    sun_into(sh, 6, 30);
    CHECK(envmap_sh_window(out, &moved, sh, 6, &diffuse, 0) == ENVMAP_OK);
    CHECK(!memcmp(out, sh, 108 * sizeof *sh) && moved <= 0);
    sun_into(sh, 10, 0); /* a light under a lobe of few bands is the lobe, and that is positive */
    CHECK(envmap_sh_window(out, NULL, sh, 10, &soft, 0) == ENVMAP_OK);
    CHECK(!memcmp(out, sh, 300 * sizeof *sh));
    memset(sh, 0, sizeof sh);
    CHECK(envmap_sh_window(out, &moved, sh, 6, NULL, 0) == ENVMAP_OK && moved <= 0); /* black */
    sh[0] = -1;
    CHECK(envmap_sh_window(out, &moved, sh, 6, NULL, 0) == ENVMAP_ERROR_RADIANCE);
    sh[0] = 0, sh[3] = 1;
    CHECK(envmap_sh_window(out, &moved, sh, 6, NULL, 0) == ENVMAP_ERROR_RADIANCE);
}

/* The power of all bands is 4 pi (2 pi integral of k^2) / (2 pi integral of k)^2, and k^2 is Phong of
   twice the exponent: its slope has no bound at the horizon, where a quadrature is off by percents. */
static void bands_needed_below_phong_1_are_enough_and_no_more(void) {
    static double lambda[4096];
    for (int i = 0; i < 60; ++i) {
        envmap_lobe lobe = envmap_lobe_phong((float)(0.013 + 0.1 * (i / 6)));
        double tolerance = 0.3 / pow(3, i % 6), N = (double)lobe.parameter;
        double all = 2 * (N + 1) * (N + 1) / (2 * N + 1), rest = all;
        int needed = 0;
        CHECK(envmap_lobe_zonal(lambda, 4096, &lobe, 0) == ENVMAP_OK);
        for (; needed < 4096 && rest > tolerance * tolerance * all; ++needed)
            rest -= (2 * needed + 1) * lambda[needed] * lambda[needed];
        CHECK(envmap_sh_bands(&lobe, 0, NULL, 0, tolerance) == needed);
    }
}

/* ------------------------------------------------------------------------------------- bands -- */

static void bands_needed_are_enough(void) {
    static double sh[3 * 40 * 40], lambda[400];
    envmap_lobe lobes[3];
    lobes[0] = envmap_lobe_phong(20), lobes[1] = envmap_lobe_gaussian(60);
    lobes[2] = envmap_lobe_diffuse();
    for (int i = 0; i < 3; ++i)
        for (double tolerance = 0.1; tolerance > 5e-4; tolerance /= 10) {
            int alone = envmap_sh_bands(&lobes[i], 0, NULL, 0, tolerance);
            random_coefficients(sh, 40, 30); /* a scene that falls as 1/(l+1)^2 */
            for (int k = 0; k < 3 * 1600; ++k) {
                double l = floor(sqrt(k / 3 + 0.5));
                sh[k] /= (l + 1) * (l + 1);
            }
            int L = envmap_sh_bands(&lobes[i], 0, sh, 40, tolerance);
            CHECK(L >= 1 && L < alone);
            CHECK(envmap_lobe_zonal(lambda, 400, &lobes[i], 0) == ENVMAP_OK);
            double tail = 0, total = 0, at_last = 0, last = 0; /* a flat scene from the 40th on */
            for (int k = 3 * 39 * 39; k < 3 * 1600; ++k) last += sh[k] * sh[k] / 79;
            for (int l = 0; l < 400; ++l) {
                double power = l < 40 ? 0 : last * (2 * l + 1);
                for (int k = 3 * l * l; l < 40 && k < 3 * (l + 1) * (l + 1); ++k)
                    power += sh[k] * sh[k];
                total += power * lambda[l] * lambda[l];
                if (l >= L) tail += power * lambda[l] * lambda[l];
                if (l >= L - 1) at_last += power * lambda[l] * lambda[l];
            }
            CHECK(sqrt(tail / total) <= tolerance * (1 + 1e-6));
            if (L > 1) CHECK(sqrt(at_last / total) >= tolerance * (1 - 1e-4)); /* one less is not */
        }
    CHECK(envmap_sh_bands(&lobes[0], 0, sh, 40, 1) == 1);
    CHECK(envmap_sh_bands(NULL, 0, sh, 40, 0.1) == 0);
    CHECK(envmap_sh_bands(&lobes[0], 0, NULL, 4, 0.1) == 0);
    CHECK(envmap_sh_bands(&lobes[0], 0, sh, 40, (double)NAN) == 0);
    CHECK(envmap_sh_bands(&lobes[0], 0, sh, 40, -1) == 0);
}

/* ----------------------------------------------------------------------------------- shaders -- */

static void matrix_and_packing_are_the_nine_coefficients(void) {
    double sh[27], worst = 0;
    float M[48], v[28];
    unsigned long long seed = 12;
    random_coefficients(sh, 3, 14);
    CHECK(envmap_sh_pack(M, v, sh) == ENVMAP_OK);
    for (int i = 0; i < 100; ++i) {
        double d[3], rgb[3];
        oracle_random_direction(d, &seed);
        CHECK(envmap_sh_evaluate(rgb, sh, 3, d) == ENVMAP_OK);
        double n[4] = {d[0], d[1], d[2], 1};
        double b[4] = {d[0] * d[1], d[1] * d[2], d[2] * d[2], d[2] * d[0]};
        for (int c = 0; c < 3; ++c) {
            double quadratic = 0, packed = (double)v[24 + c] * (d[0] * d[0] - d[1] * d[1]);
            for (int k = 0; k < 16; ++k) quadratic += n[k / 4] * n[k % 4] * (double)M[16 * c + k];
            for (int k = 0; k < 4; ++k)
                packed += (double)v[4 * c + k] * n[k] + (double)v[12 + 4 * c + k] * b[k];
            worst = larger(worst, fabs(quadratic - rgb[c]));
            worst = larger(worst, fabs(packed - rgb[c]));
        }
    }
    FIGURE("matrix and packing - nine coefficients", worst, 1e-6);
    envmap_lobe diffuse = envmap_lobe_diffuse();
    diffuse.raw = 1;
    for (int i = 0; i < 27; ++i) sh[i] = 1;
    CHECK(envmap_sh_convolve(sh, sh, 3, &diffuse, 0) == ENVMAP_OK);
    CHECK(envmap_sh_pack(M, NULL, sh) == ENVMAP_OK); /* c1 .. c5 of [RH01] eq. 12 */
    CHECK_CLOSE(M[0], 0.429043, 1e-6);
    CHECK_CLOSE(M[1], 0.429043, 1e-6);
    CHECK_CLOSE(M[3], 0.511664, 1e-6);
    CHECK_CLOSE(M[5], -0.429043, 1e-6);
    CHECK_CLOSE(M[10], 0.743125, 2e-6);
    CHECK_CLOSE(M[15], 0.886227 - 0.247708, 1e-6);
    for (int i = 0; i < 16; ++i) CHECK_CLOSE(M[i], M[4 * (i % 4) + i / 4], 0);
}

/* --------------------------------------------------------------------------------- bad input -- */

static void bad_input_is_refused_and_nothing_is_written(void) {
    static double sh[NUMBERS], out[NUMBERS];
    double rgb[3] = {7, 7, 7}, d[3] = {0, 0, 1}, one[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
    static const int bad_bands[] = {0, -1, 257, 2147483647, -2147483647 - 1};
    envmap map = map_of(ENVMAP_CUBE, 8), none;
    envmap_lobe lobe = envmap_lobe_diffuse(), broken = envmap_lobe_phong(-1);
    float packed[28];
    memset(&none, 0, sizeof none);
    random_coefficients(sh, MOST, 1);
    for (int i = 0; i < NUMBERS; ++i) out[i] = 7;
    for (size_t i = 0; i < sizeof bad_bands / sizeof *bad_bands; ++i) {
        int L = bad_bands[i];
        CHECK(envmap_sh_basis(out, L, d) == ENVMAP_ERROR_ARGUMENT);
        CHECK(envmap_sh_project(out, L, &map, 0, 0, NULL) == ENVMAP_ERROR_ARGUMENT);
        CHECK(envmap_sh_evaluate(rgb, sh, L, d) == ENVMAP_ERROR_ARGUMENT);
        CHECK(envmap_sh_fill(&map, 0, 0, sh, L, 0, NULL) == ENVMAP_ERROR_ARGUMENT);
        CHECK(envmap_sh_convolve(out, sh, L, &lobe, 0) == ENVMAP_ERROR_ARGUMENT);
        CHECK(envmap_sh_rotate(out, sh, L, one) == ENVMAP_ERROR_ARGUMENT);
        CHECK(envmap_sh_window(out, rgb, sh, L, &lobe, 0) == ENVMAP_ERROR_ARGUMENT);
        CHECK(envmap_sh_bands(&lobe, 0, sh, L, 0.1) == 0);
    }
    CHECK(envmap_sh_basis(NULL, 3, d) == ENVMAP_ERROR_ARGUMENT);
    CHECK(envmap_sh_basis(out, 3, NULL) == ENVMAP_ERROR_ARGUMENT);
    CHECK(envmap_sh_project(NULL, 3, &map, 0, 0, NULL) == ENVMAP_ERROR_ARGUMENT);
    CHECK(envmap_sh_project(out, 3, NULL, 0, 0, NULL) == ENVMAP_ERROR_ARGUMENT);
    CHECK(envmap_sh_project(out, 3, &none, 0, 0, NULL) == ENVMAP_ERROR_ARGUMENT);
    CHECK(envmap_sh_project(out, 3, &map, 1, 0, NULL) == ENVMAP_ERROR_ARGUMENT);
    CHECK(envmap_sh_project(out, 3, &map, -1, 0, NULL) == ENVMAP_ERROR_ARGUMENT);
    CHECK(envmap_sh_project(out, 3, &map, 0, -1, NULL) == ENVMAP_ERROR_ARGUMENT);
    CHECK(envmap_sh_project(out, 3, &map, 0, (double)NAN, NULL) == ENVMAP_ERROR_ARGUMENT);
    CHECK(envmap_sh_evaluate(NULL, sh, 3, d) == ENVMAP_ERROR_ARGUMENT);
    CHECK(envmap_sh_evaluate(rgb, NULL, 3, d) == ENVMAP_ERROR_ARGUMENT);
    CHECK(envmap_sh_evaluate(rgb, sh, 3, NULL) == ENVMAP_ERROR_ARGUMENT);
    CHECK(envmap_sh_fill(&map, 1, 0, sh, 3, 0, NULL) == ENVMAP_ERROR_ARGUMENT);
    CHECK(envmap_sh_fill(NULL, 0, 0, sh, 3, 0, NULL) == ENVMAP_ERROR_ARGUMENT);
    CHECK(envmap_sh_convolve(NULL, sh, 3, &lobe, 0) == ENVMAP_ERROR_ARGUMENT);
    CHECK(envmap_sh_convolve(out, sh, 3, NULL, 0) == ENVMAP_ERROR_ARGUMENT);
    CHECK(envmap_sh_convolve(out, sh, 3, &broken, 0) == ENVMAP_ERROR_LOBE);
    CHECK(envmap_sh_window(out, rgb, sh, 3, &broken, 0) == ENVMAP_ERROR_LOBE);
    CHECK(envmap_sh_rotate(sh, sh, 3, one) == ENVMAP_ERROR_ARGUMENT);
    CHECK(envmap_sh_rotate(out, sh, 3, NULL) == ENVMAP_ERROR_ARGUMENT);
    one[1] = 0.1;
    CHECK(envmap_sh_rotate(out, sh, 3, one) == ENVMAP_ERROR_ARGUMENT);
    one[1] = (double)INFINITY;
    CHECK(envmap_sh_rotate(out, sh, 3, one) == ENVMAP_ERROR_ARGUMENT);
    CHECK(envmap_sh_pack(NULL, NULL, sh) == ENVMAP_ERROR_ARGUMENT);
    CHECK(envmap_sh_pack(NULL, packed, NULL) == ENVMAP_ERROR_ARGUMENT);
    for (int bad = 0; bad < 3; ++bad) {
        sh[5] = bad == 0 ? (double)NAN : bad == 1 ? -(double)INFINITY : 1e101;
        CHECK(envmap_sh_evaluate(rgb, sh, 3, d) == ENVMAP_ERROR_RADIANCE);
        CHECK(envmap_sh_fill(&map, 0, 0, sh, 3, 0, NULL) == ENVMAP_ERROR_RADIANCE);
        CHECK(envmap_sh_convolve(out, sh, 3, &lobe, 0) == ENVMAP_ERROR_RADIANCE);
        CHECK(envmap_sh_window(out, rgb, sh, 3, &lobe, 0) == ENVMAP_ERROR_RADIANCE);
        CHECK(envmap_sh_pack(NULL, packed, sh) == ENVMAP_ERROR_RADIANCE);
        CHECK(envmap_sh_bands(&lobe, 0, sh, 3, 0.1) == 0);
    }
    sh[5] = 1e40;
    CHECK(envmap_sh_fill(&map, 0, 0, sh, 3, 0, NULL) == ENVMAP_ERROR_RADIANCE);
    CHECK(envmap_sh_pack(NULL, packed, sh) == ENVMAP_ERROR_RADIANCE);
    map.texels[100] = NAN;
    CHECK(envmap_sh_project(out, 3, &map, 0, 0, NULL) == ENVMAP_ERROR_RADIANCE);
    CHECK(envmap_sh_project(out, 3, &map, 0, 1e-2, NULL) == ENVMAP_ERROR_RADIANCE);
    for (int i = 0; i < NUMBERS; ++i) CHECK_CLOSE(out[i], 7, 0);
    for (int i = 0; i < 3; ++i) CHECK_CLOSE(rgb[i], 7, 0);
    envmap_free(&map);
}

/* A tolerance makes envmap_sh_fill go through the grids: every level of it is kept in rms. */
static void filling_keeps_the_tolerance(void) {
    static double sh[3 * 30 * 30];
    random_coefficients(sh, 30, 12);
    for (int mapping = 0; mapping < ENVMAP_MAPPING_COUNT; ++mapping)
        for (int size = 20; size <= 160; size += 140) {
            double most = 0;
            envmap exact = map_of(mapping, size), map = map_of(mapping, size);
            envmap_difference d = {0};
            CHECK(envmap_sh_fill(&exact, 0, 0, sh, 30, 0, NULL) == ENVMAP_OK);
            for (double tolerance = 1e-1; tolerance > 5e-6; tolerance /= 10) {
                CHECK(envmap_sh_fill(&map, 0, 0, sh, 30, tolerance, NULL) == ENVMAP_OK);
                CHECK(envmap_compare(&d, &map, &exact, 0) == ENVMAP_OK);
                if (!(d.rms / tolerance <= most)) most = d.rms / tolerance;
            }
            FIGURE(oracle_name[mapping], most, 1);
            envmap_free(&exact);
            envmap_free(&map);
        }
}

/* Where one texel holds the whole rim, or a pole, or an edge of the cube. */
static void the_smallest_maps_keep_the_tolerance(void) {
    double worst = 0;
    for (int mapping = 0; mapping < ENVMAP_MAPPING_COUNT; ++mapping)
        for (int size = 1; size <= 4; ++size) {
            envmap map = map_of(mapping, size);
            double sums[27], sh[27];
            oracle_noise(&map, 5);
            CHECK(envmap_sh_project(sums, 3, &map, 0, 0, NULL) == ENVMAP_OK);
            CHECK(envmap_sh_project(sh, 3, &map, 0, 1e-4, NULL) == ENVMAP_OK);
            for (int i = 0; i < 27; ++i)
                worst = larger(worst, fabs(sh[i] - sums[i]) / sqrt(4 * PI));
            envmap_free(&map);
        }
    FIGURE("coefficients of maps of 1 to 4 texels, off by", worst, 1e-4);
}

static void failed_allocations_leave_no_trace(void) {
    envmap map = map_of(ENVMAP_CUBE, 64);
    double sh[27] = {7};
    oracle_noise(&map, 1);
    int live = oracle_live, fail = 0;
    for (;; ++fail) {
        oracle_calls = 0, oracle_fail_at = fail;
        envmap_result result = envmap_sh_project(sh, 3, &map, 0, 1e-2, NULL);
        CHECK(oracle_live == live);
        if (result == ENVMAP_OK) break;
        CHECK(result == ENVMAP_ERROR_MEMORY && fabs(sh[0] - 7) <= 0 && fail < 30);
    }
    oracle_fail_at = -1;
    CHECK(fail > 0);
    envmap_free(&map);
}

int main(void) {
    RUN(the_basis_is_that_of_the_convention);
    RUN(the_basis_is_orthonormal);
    RUN(the_basis_is_stable_to_256_bands);
    RUN(a_harmonic_projects_onto_itself);
    RUN(projection_is_the_plain_sum);
    RUN(points_keep_the_tolerance);
    RUN(the_smallest_maps_keep_the_tolerance);
    RUN(radiance_at_both_ends_of_floats_is_filled_in_and_projected);
    RUN(coefficients_are_the_same_bits_for_any_executor);
    RUN(filling_evaluates_at_every_texel);
    RUN(filling_keeps_the_tolerance);
    RUN(convolving_is_filtering);
    RUN(nine_numbers_light_like_the_exact_map);
    RUN(rotations_turn_the_function);
    RUN(rotations_compose);
    RUN(rotations_keep_the_energy_of_each_band);
    RUN(a_suns_ringing_is_windowed_away);
    RUN(the_window_moves_less_than_sloans);
    RUN(windowed_scenes_are_nowhere_below_zero);
    RUN(what_does_not_ring_is_left_alone);
    RUN(bands_needed_are_enough);
    RUN(bands_needed_below_phong_1_are_enough_and_no_more);
    RUN(matrix_and_packing_are_the_nine_coefficients);
    RUN(bad_input_is_refused_and_nothing_is_written);
    RUN(failed_allocations_leave_no_trace);
    return test_summary();
}
