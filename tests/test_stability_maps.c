/* SPDX-License-Identifier: MIT
   Where maps fail, and that ours do not: the faulty forms of examples/methods/faults.h beside the
   library, driven past every limit. docs/stability.md shows each and names its tests, these and
   those that stand in the other files. TEST_WHOLE takes every size to 130 and a map 8192 wide. */
#include "helpers.h"
#include "methods/methods.h"
#include "examples/methods/faults.h"

static double larger(double a, double b) { return b <= a ? a : b; } /* NaN wins */

/* --------------------------------------------------------------------------- sampling rate -- */

/* Longer over shorter side of a texel at (u,v): singular values of the direction's derivative. */
static double stretch(int mapping, double u, double v) {
    double a[2][3], g[3] = {0, 0, 0}, h = 1e-3;
    for (int k = 0; k < 2; ++k) {
        float from[3], to[3];
        double du = k ? 0 : mapping == ENVMAP_LATLONG ? h / 2 : h, dv = k ? h : 0;
        envmap_direction(from, mapping, 0, (float)(u - du), (float)(v - dv));
        envmap_direction(to, mapping, 0, (float)(u + du), (float)(v + dv));
        for (int c = 0; c < 3; ++c) a[k][c] = (double)to[c] - (double)from[c];
    }
    for (int c = 0; c < 3; ++c)
        g[0] += a[0][c] * a[0][c], g[1] += a[1][c] * a[1][c], g[2] += a[0][c] * a[1][c];
    double mean = (g[0] + g[1]) / 2, root = hypot((g[0] - g[1]) / 2, g[2]);
    return sqrt((mean + root) / (mean - root));
}

/* The same of a point on the octahedron's face x, y, z > 0, from the sides of the texel there, less
   what is along the ray. 0 too near a fold; below the horizon it is the mirror image. */
static double octahedral_stretch(double a, double b) {
    if (a + b > 1) {
        double swap = 1 - a;
        a = 1 - b, b = swap;
    }
    double c = 1 - a - b, pp = a * a + b * b + c * c;
    if (fmin(a, fmin(b, c)) < 0.01) return 0;
    double aa = 2 - (a - c) * (a - c) / pp, bb = 2 - (b - c) * (b - c) / pp;
    double ab = 1 - (a - c) * (b - c) / pp, root = hypot((aa - bb) / 2, ab);
    return sqrt(((aa + bb) / 2 + root) / ((aa + bb) / 2 - root));
}

static void texels_are_as_long_as_they_are_said_to_be(void) {
    unsigned long long state = 37;
    for (int m = 0; m < MAPPINGS; ++m) {
        double worst = 0;
        for (int i = 0; i < 500; ++i) {
            double u = 0.02 + 0.96 * test_random(&state), v = 0.02 + 0.96 * test_random(&state);
            double a = 2 * u - 1, b = 2 * v - 1, r = sqrt(a * a + b * b), truth = 1;
            if (oracle_is_disc(m) && r > 0.95) continue;
            if (m == ENVMAP_OCTAHEDRAL) truth = octahedral_stretch(fabs(a), fabs(b));
            if (m == ENVMAP_CUBE) truth = sqrt(1 + r * r);
            if (m == ENVMAP_SPHERE) truth = 1 / (1 - r * r);
            if (m == ENVMAP_ANGULAR) truth = PI * r / sin(PI * r);
            if (m == ENVMAP_LATLONG) truth = 1 / sin(PI * v);
            if (truth > 0) worst = larger(worst, fabs(stretch(m, u, v) / truth - 1));
        }
        FIGURE(oracle_name[m], worst, 2e-3);
    }
}

/* --------------------------------------------------------------------------- seams and rims -- */

static void faces_mipmapped_alone_step_at_their_edges(void) {
    envmap map = tests_map(ENVMAP_CUBE, 64, 7), plain = tests_map(ENVMAP_CUBE, 64, 7);
    double least = 2, most = 0;
    oracle_fill(&map, 0, oracle_smooth);
    tests_lamp(&map, 1, 0.9, 0.2, 0.3, 20);
    memcpy(plain.texels, map.texels, method_floats(&map) * sizeof(float));
    method_plain_levels(&plain);
    CHECK(envmap_mips_build(&map) == ENVMAP_OK);
    for (int l = 1; l < 7; ++l) {
        double alone = fault_seam(&plain, (float)l, 1), across = fault_seam(&map, (float)l, 0);
        printf("    level %d: step at an edge, faces alone %.3g, library %.3g\n", l, alone, across);
        least = fmin(least, alone), most = larger(most, across);
    }
    CHECK(least > 0.2);
    FIGURE("library: largest step at an edge, any level, relative", most, 1e-4);
    envmap_free(&map);
    envmap_free(&plain);
}

static void black_around_a_paraboloid_darkens_its_rim(void) {
    envmap map = tests_map(ENVMAP_PARABOLOID, 64, 7), faulty = tests_map(ENVMAP_PARABOLOID, 64, 7);
    for (size_t i = 0; i < method_floats(&map); ++i) map.texels[i] = faulty.texels[i] = 1;
    fault_empty_rims(&faulty);
    method_plain_levels(&faulty);
    CHECK(envmap_mips_build(&map) == ENVMAP_OK);
    double dark = 1, off = 0;
    for (int l = 0; l < 6; ++l)
        for (int i = 0; i < 500; ++i) {
            float a = (float)i * 0.0125663706f, rgb[3], d[3] = {cosf(a), sinf(a), 1e-4f};
            if (i % 2) d[2] = -d[2];
            method_lookup_face(rgb, &faulty, d, (float)l, 0);
            dark = fmin(dark, (double)rgb[1]);
            envmap_lookup(rgb, &map, d, (float)l);
            off = larger(off, fabs((double)rgb[1] - 1));
        }
    printf("    %-64s %.3g\n", "a world of 1, black outside the circles: darkest at the rim", dark);
    CHECK(dark < 0.5);
    FIGURE("library: off by", off, 1e-6);
    envmap_free(&map);
    envmap_free(&faulty);
}

/* Mean angle between what triangles of an edge look up by coordinates and by directions. */
static double interpolation_error(int mapping, double edge, int inside) {
    unsigned long long state = 9;
    double sum = 0;
    int n = 20000, used = 0;
    for (int i = 0; i < n; ++i) {
        double d[3], t[3];
        float corner[3][3], weight[3] = {0.2f, 0.5f, 0.3f}, wrong[3], right[3] = {0, 0, 0};
        oracle_random_direction(d, &state);
        int cut = 0, face[3];
        for (int k = 0; k < 3; ++k) {
            float u, v;
            oracle_tangent(t, d, 2 * PI * k / 3 + i);
            for (int c = 0; c < 3; ++c) {
                corner[k][c] = (float)(d[c] + edge / sqrt(3.0) * t[c]);
                right[c] += weight[k] * corner[k][c];
            }
            envmap_coordinates(face + k, &u, &v, mapping, corner[k]);
            cut |= face[k] != face[0];
        }
        if (cut && inside) continue;
        fault_interpolated(wrong, mapping, (const float(*)[3])corner, weight);
        sum += oracle_angle_f(wrong, right), ++used;
    }
    return sum / used;
}

/* Inside a face the error falls with the square of the edge; a seam is met in proportion to the
   edge, and what is then looked up is anywhere: halving the edge only halves the error. */
static void interpolated_coordinates_do_not_get_right_as_triangles_get_small(void) {
    static const float a[3] = {0.01f, 0, 1}, b[3] = {-0.01f, 0, 1}, half[3] = {0.5f, 0.5f, 0};
    const float corner[3][3] = {{a[0], a[1], a[2]}, {b[0], b[1], b[2]}, {0, 1, 0}};
    float dir[3];
    fault_interpolated(dir, ENVMAP_LATLONG, corner, half);
    double off = oracle_angle_f(dir, (const float[3]){0, 0, 1});
    printf("    %-64s %.3g\n", "midway between two sides of lat-long's seam, off by, rad", off);
    CHECK(off > 3.1);
    for (int m = 0; m < MAPPINGS; ++m) {
        double e = interpolation_error(m, 0.1, 0), f = interpolation_error(m, 0.05, 0);
        printf("    %-11s edge 0.1: mean error %.2e rad, over that of 0.05: %.2f\n", oracle_name[m],
               e, e / f);
        if (m == ENVMAP_CUBE || m == ENVMAP_LATLONG) CHECK(e / f < 2.8 && e > 0.01);
    }
    double e = interpolation_error(ENVMAP_CUBE, 0.1, 1),
           f = interpolation_error(ENVMAP_CUBE, 0.05, 1);
    printf("    cube, inside a face: %.2e, ratio %.2f\n", e, e / f);
    CHECK(e < 2e-3 && e / f > 3);
}

/* --------------------------------------------------------------------------------- lookups --- */

static double slope(const double d[3], int channel) {
    (void)channel;
    return 3 + d[0] / fabs(d[2]) * (fabs(d[2]) > 0.57);
}

/* On face +z radiance is 3 + x/z, and a texel of level l is 2^(l+1)/size of x/z. */
static void half_a_texel_off_is_more_at_every_level(void) {
    envmap map = tests_map(ENVMAP_CUBE, 64, 7);
    const float z[3] = {0, 0, 1};
    double worst = 0;
    oracle_fill(&map, 0, slope);
    CHECK(envmap_mips_build(&map) == ENVMAP_OK);
    for (int l = 0; l < 5; ++l) {
        float rgb[3], off[3];
        envmap_lookup(rgb, &map, z, (float)l);
        method_lookup_face(off, &map, z, (float)l, 0.5f);
        worst = larger(worst, fabs((double)rgb[1] - 3));
        printf("    level %d: half a texel off by %.4g\n", l, (double)off[1] - (double)rgb[1]);
        CHECK_CLOSE(off[1] - rgb[1], (1 << l) / 64.0, 0.08 * (1 << l) / 64.0);
    }
    FIGURE("library: off by", worst, 1e-6);
    envmap_free(&map);
}

/* What a ray from p along d meets on the unit sphere is asin(p sin t) from d. */
static void a_map_is_right_only_from_its_centre(void) {
    unsigned long long state = 17;
    double worst = 0;
    for (int i = 0; i < 1000; ++i) {
        double d[3], q[3];
        float p[3], f[3], out[3], size = 0;
        oracle_random_direction(d, &state), oracle_random_direction(q, &state);
        double radius = 0.999 * test_random(&state), length = 0;
        for (int k = 0; k < 3; ++k) {
            p[k] = (float)(radius * q[k]), f[k] = (float)d[k];
            length += radius * q[k] * radius * q[k];
        }
        fault_mended_parallax(out, p, f);
        for (int k = 0; k < 3; ++k) size += out[k] * out[k];
        double sine = sqrt(length) * sin(oracle_angle(d, q));
        worst = larger(worst, fabs(oracle_angle_f(out, f) - asin(sine)));
        CHECK_CLOSE(size, 1, 1e-5);
    }
    FIGURE("angle between seen and looked up, against asin(p sin t), rad", worst, 1e-4);
}

/* -------------------------------------------------------------------------------- radiance --- */

/* A sun of 5e4 in a sky of 0.4: white at 1 keeps the sky, white at the sun's nothing else. Floats
   keep both; a limit takes as much, and says so. */
static void eight_bits_hold_a_sun_or_a_sky(void) {
    envmap map = tests_map(ENVMAP_CUBE, 64, 1), bits = tests_map(ENVMAP_CUBE, 64, 1);
    for (size_t i = 0; i < method_floats(&map); ++i) map.texels[i] = 0.4f;
    tests_lamp(&map, 0.3, 0.8, 0.5, 0.03, 5e4f);
    double all = tests_energy(&map), sky = 0.4 * 4 * PI, kept[2];
    envmap_cleaned cleaned;
    for (int k = 0; k < 2; ++k) {
        memcpy(bits.texels, map.texels, method_floats(&map) * sizeof(float));
        fault_eight_bits(&bits, k ? 5e4f : 1);
        kept[k] = tests_energy(&bits);
    }
    printf("    of all energy, white 1 keeps %.4f, white 5e4 %.4f; of the sky %.3f and 0\n",
           kept[0] / all, kept[1] / all, kept[0] / sky);
    CHECK(kept[0] < 0.05 * all);
    CHECK_CLOSE(kept[1] / (all - sky), 1, 1e-3); /* the sun alone */
    CHECK(envmap_clean(&map, 1, &cleaned) == ENVMAP_OK);
    FIGURE("what envmap_clean says it took against the energy that 8 bits cut",
           fabs(1 - cleaned.energy - kept[0] / all), 1e-3);
    envmap_free(&map);
    envmap_free(&bits);
}

/* A running float stops growing when a texel is less than half its last bit. */
static void a_float_sum_stalls_and_overflows_and_levels_do_not(void) {
    int size = test_many(50) < 50 ? 128 : 1024;
    envmap map = tests_map(ENVMAP_LATLONG, size, envmap_levels(size));
    const float grey = 0.7f, huge = 3e38f;
    for (int pass = 0; pass < 2; ++pass) {
        size_t n = method_floats(&map);
        for (size_t i = 0; i < n; ++i) map.texels[i] = pass ? huge : grey;
        CHECK(envmap_mips_build(&map) == ENVMAP_OK);
        float sum = fault_float_mean(map.texels, n);
        double top = (double)envmap_texel(&map, map.levels - 1, 0, 0, 0, 0)[1];
        printf("    %u floats of %g: a float's mean is %g\n", (unsigned)n,
               (double)(pass ? huge : grey), (double)sum);
        if (pass)
            CHECK(sum > 3.4028234e38f);
        else if (size == 1024)
            CHECK(fabsf(sum / grey - 1) > 1e-3f);
        FIGURE("library: top level, relative", fabs(top / (double)(pass ? huge : grey) - 1), 1e-6);
    }
    envmap_free(&map);
}

static void scale(envmap *map, int power) {
    for (size_t i = 0; i < floats_of(map); ++i) map->texels[i] = ldexpf(map->texels[i], power);
}

/* Everything that reads a map, into a row of numbers. */
enum { READINGS = 3 * 40 + 3 * 32 };
static void read_all(float *to, envmap *map) {
    unsigned long long state = 23;
    envmap small = tests_map(ENVMAP_PARABOLOID, 4, 1);
    CHECK(envmap_mips_build(map) == ENVMAP_OK);
    CHECK(envmap_resample(&small, map, NULL) == ENVMAP_OK);
    for (int i = 0; i < 40; ++i, to += 3) {
        double d[3], t[3], s[3];
        oracle_random_direction(d, &state);
        oracle_tangent(t, d, 1), oracle_tangent(s, d, 2);
        float dir[3], dx[3], dy[3];
        for (int k = 0; k < 3; ++k)
            dir[k] = (float)d[k], dx[k] = 0.3f * (float)t[k], dy[k] = 0.02f * (float)s[k];
        if (i % 2)
            envmap_lookup(to, map, dir, (float)i / 9);
        else
            envmap_lookup_footprint(to, map, dir, dx, dy, 8);
    }
    memcpy(to, small.texels, 3 * 32 * sizeof(float));
    envmap_free(&small);
}

/* Powers of two scale exactly, so the same bits must come out, and do down to where a float loses
   its own. */
static void radiance_from_1e_38_to_1e38_passes_alike(void) {
    static const int powers[4] = {-110, -20, 60, 111};
    static float base[READINGS], scaled[READINGS];
    for (int m = 0; m < MAPPINGS; ++m) {
        envmap map = tests_map(m, 16, 5), other = tests_map(m, 16, 5);
        for (size_t i = 0; i < method_floats(&map); ++i) map.texels[i] = 0.25f + (float)(i % 7);
        tests_lamp(&map, 0.3, 0.8, 0.5, 0.3, 5e4f);
        read_all(base, &map);
        for (int k = 0; k < 4; ++k) {
            size_t off = 0;
            double rms[2] = {0, 0};
            for (int s = 0; s < 2; ++s) { /* compare: a against a / 2, scaled or not */
                envmap a = tests_map(m, 16, 1), b = tests_map(m, 16, 1);
                memcpy(a.texels, map.texels, method_floats(&a) * sizeof(float));
                if (s) scale(&a, powers[k]);
                memcpy(b.texels, a.texels, method_floats(&a) * sizeof(float));
                scale(&b, -1);
                rms[s] = tests_difference(&a, &b).rms;
                if (s) memcpy(other.texels, a.texels, method_floats(&a) * sizeof(float));
                envmap_free(&a);
                envmap_free(&b);
            }
            read_all(scaled, &other);
            for (int i = 0; i < READINGS; ++i) off += ldexpf(base[i], powers[k]) != scaled[i];
            CHECK(off == 0);
            CHECK_CLOSE(rms[1], rms[0], 0);
        }
        envmap_free(&map);
        envmap_free(&other);
    }
}

/* Below 1.2e-38 a float has fewer bits; nothing but those is lost, and black is black. */
static void the_smallest_radiance_there_is_stays_and_black_is_black(void) {
    static const float values[3] = {1e-38f, 1e-42f, 0};
    for (int m = 0; m < MAPPINGS; ++m)
        for (int k = 0; k < 3; ++k) {
            static float readings[READINGS];
            envmap map = tests_map(m, 16, 5);
            for (size_t i = 0; i < method_floats(&map); ++i) map.texels[i] = values[k];
            read_all(readings, &map);
            for (int i = 0; i < READINGS; ++i)
                CHECK_CLOSE(readings[i], values[k], 2e-45 + 1e-6 * (double)values[k]);
            envmap_free(&map);
        }
}

/* Mips do not refuse what is no number, they carry it up, and only up. */
static void nan_in_a_map_reaches_only_the_texels_above_it(void) {
    for (int m = 0; m < MAPPINGS; ++m) {
        envmap map = tests_map(m, 16, 5);
        for (size_t i = 0; i < method_floats(&map); ++i) map.texels[i] = 1;
        envmap_texel(&map, 0, 0, 0, 9, 9)[1] = NAN;
        CHECK(envmap_mips_build(&map) == ENVMAP_OK);
        for (int l = 0; l < 4; ++l) {
            int bad = 0, edge = oracle_edge(16, l), width = oracle_width(m, edge);
            for (int f = 0; f < envmap_faces(m); ++f)
                for (int i = 0; i < edge * width; ++i) {
                    const float *t = envmap_texel(&map, l, 0, f, i % width, i / width);
                    bad += !(t[1] >= 0);
                    CHECK(t[0] >= 0.999f && t[0] <= 1.001f); /* nor another channel */
                }
            CHECK(bad == 1 && !(envmap_texel(&map, l, 0, 0, 9 >> l, 9 >> l)[1] >= 0));
        }
        envmap_free(&map);
    }
}

/* ----------------------------------------------------------------------------------- sizes --- */

static void checks(envmap *map) {
    int width = method_width(map, 0);
    for (int f = 0; f < envmap_faces(map->mapping); ++f)
        for (int i = 0; i < width * map->size; ++i)
            for (int c = 0; c < 3; ++c)
                envmap_texel(map, 0, 0, f, i % width, i / width)[c] =
                    (float)((i % width + i / width) & 1);
}

/* rms of a level from 1/2, by solid angle. */
static double from_grey(const envmap *map, int level) {
    double sum = 0;
    int edge = oracle_edge(map->size, level), width = oracle_width(map->mapping, edge);
    for (int f = 0; f < envmap_faces(map->mapping); ++f)
        for (int i = 0; i < edge * width; ++i)
            sum += envmap_solid_angle(map, level, f, i % width, i / width) *
                   pow((double)envmap_texel(map, level, 0, f, i % width, i / width)[1] - 0.5, 2);
    return sqrt(sum / (4 * PI));
}

/* Texel by texel 0 and 1, which a lookup by nearest of every second texel takes for one or the
   other. Levels are grey, but where a rim leaves one texel of four. */
static void a_checkerboard_at_nyquist_is_grey_in_every_level(void) {
    static const double bound[MAPPINGS] = {3e-4, 0.05, 0.08, 1e-6, 0.02, 5e-3};
    for (int m = 0; m < MAPPINGS; ++m) {
        envmap map = tests_map(m, 64, 7), other = tests_map((m + 1) % MAPPINGS, 16, 1);
        double off = 0;
        char what[96];
        checks(&map);
        CHECK(envmap_mips_build(&map) == ENVMAP_OK);
        CHECK_CLOSE(from_grey(&map, 0), 0.5, 1e-6);
        for (int l = 1; l < 7; ++l) off = larger(off, from_grey(&map, l));
        snprintf(what, sizeof what, "%s: levels of a checkerboard, rms from grey", oracle_name[m]);
        FIGURE(what, off, bound[m]);
        CHECK(envmap_resample(&other, &map, NULL) == ENVMAP_OK);
        snprintf(what, sizeof what, "... resampled to %s of 16: mean",
                 oracle_name[(m + 1) % MAPPINGS]);
        FIGURE(what, fabs(tests_energy(&other) / (4 * PI) - 0.5), 1e-6);
        snprintf(what, sizeof what, "... and rms from grey");
        FIGURE(what, from_grey(&other, 0), 0.15);
        envmap_free(&map);
        envmap_free(&other);
    }
}

/* Solid angles, levels, lookups and resampling of a constant and of noise, size by size. */
static void check_size(int mapping, int size) {
    envmap map = tests_map(mapping, size, envmap_levels(size)),
           other = tests_map(MAPPINGS - 1 - mapping, 3, 1);
    double sum = 0;
    for (int f = 0; f < envmap_faces(mapping); ++f)
        for (int y = 0; y < size; ++y)
            for (int x = 0; x < oracle_width(mapping, size); ++x)
                sum += envmap_solid_angle(&map, 0, f, x, y);
    CHECK_CLOSE(sum, 4 * PI, 1e-9);
    for (size_t i = 0; i < method_floats(&map); ++i) map.texels[i] = 1 + (float)(i % 3);
    CHECK(envmap_mips_build(&map) == ENVMAP_OK);
    CHECK(envmap_resample(&other, &map, NULL) == ENVMAP_OK);
    for (size_t i = 0; i < method_floats(&other); ++i)
        CHECK_CLOSE(other.texels[i], 1 + i % 3, 2e-6);
    for (size_t i = 0; i < floats_of(&map); ++i) CHECK_CLOSE(map.texels[i], 1 + i % 3, 2e-6);
    unsigned long long state = 29;
    for (int i = 0; i < 60; ++i) {
        double d[3];
        float rgb[3];
        oracle_random_direction(d, &state);
        float dir[3] = {(float)d[0], (float)d[1], (float)d[2]};
        if (i < 6) dir[0] = dir[1] = dir[2] = 0, dir[i / 2] = i % 2 ? -1.0f : 1.0f;
        envmap_lookup(rgb, &map, dir, (float)i / 6);
        for (int c = 0; c < 3; ++c) CHECK_CLOSE(rgb[c], 1 + c, 5e-6);
    }
    oracle_noise(&map, (unsigned long long)size);
    double energy = tests_energy(&map);
    CHECK(envmap_mips_build(&map) == ENVMAP_OK);
    if (size > 1) {
        double top = (double)envmap_texel(&map, map.levels - 1, 0, 0, 0, 0)[1];
        CHECK_CLOSE(top * 4 * PI / energy, 1, 1e-6);
    }
    envmap_free(&map);
    envmap_free(&other);
}

static void every_size_from_one_texel_up_is_right(void) {
    int most = test_whole() ? 130 : test_many(50) < 50 ? 9 : 33, count = 0;
    for (int m = 0; m < MAPPINGS; ++m)
        for (int size = 1; size <= most; size += size < 40 ? 1 : 9, ++count) check_size(m, size);
    printf("    %d maps, sizes 1 .. %d\n", count, most);
}

/* 64 x 64 texels of 8192 are one texel of 128: in the middle, at corners, rims and poles. Solid
   angles never read texels, so the map of 8192 has none. */
static void texels_of_8192_sum_to_those_of_128(void) {
    static const int at[6][2] = {{64, 64}, {0, 0}, {127, 63}, {63, 0}, {110, 17}, {18, 108}};
    float none[3] = {0, 0, 0};
    double worst = 0;
    for (int m = 0; m < MAPPINGS; ++m)
        for (int i = 0; i < 6; ++i) {
            envmap fine = {none, NULL, m, 8192, 1, 1, -1, 1},
                   coarse = {none, NULL, m, 128, 1, 1, -1, 1};
            double sum = 0, one = envmap_solid_angle(&coarse, 0, 0, at[i][0], at[i][1]);
            int step = test_many(50) < 50 ? 16 : 1;
            if (step > 1 && i) continue;
            for (int y = 0; y < 64; ++y)
                for (int x = 0; x < 64; ++x)
                    sum += envmap_solid_angle(&fine, 0, 0, 64 * at[i][0] + x, 64 * at[i][1] + y);
            worst = larger(worst, fabs(sum - one) * 128 * 128);
            CHECK(one >= 0);
        }
    FIGURE("sums of 4096 texels against one, of a mean texel", worst, 1e-8);
}

/* The whole form only: 400 MB and 540 MB. */
static void a_lat_long_map_8192_wide_keeps_its_mean(void) {
    if (!test_whole()) {
        CHECK(1);
        printf("    not in the quick form\n");
        return;
    }
    oracle_most = (size_t)1 << 30;
    envmap map = tests_map(ENVMAP_LATLONG, 4096, 13);
    for (size_t i = 0; i < method_floats(&map); ++i) map.texels[i] = 0.7f;
    float *sun = envmap_texel(&map, 0, 0, 0, 8191, 2000);
    for (int c = 0; c < 3; ++c) sun[c] = 1e7f;
    double mean =
        (double)0.7f + (1e7 - 0.7) * envmap_solid_angle(&map, 0, 0, 8191, 2000) / (4 * PI);
    CHECK(envmap_mips_build(&map) == ENVMAP_OK);
    double top = (double)envmap_texel(&map, 12, 0, 0, 0, 0)[1];
    FIGURE("lat-long 8192 x 4096, a sun in its last column: mean", fabs(top / mean - 1), 1e-6);
    double sh[3];
    CHECK(envmap_sh_project(sh, 1, &map, 0, 1e-3, NULL) == ENVMAP_OK);
    FIGURE("... projected", fabs(sh[1] / (mean * sqrt(4 * PI)) - 1), 1e-6);
    envmap_free(&map);
    oracle_most = (size_t)256 << 20;
}

static void nothing_leaks(void) { CHECK(oracle_live == 0 && oracle_wrong_context == 0); }

int main(void) {
    RUN(texels_are_as_long_as_they_are_said_to_be);
    RUN(faces_mipmapped_alone_step_at_their_edges);
    RUN(black_around_a_paraboloid_darkens_its_rim);
    RUN(interpolated_coordinates_do_not_get_right_as_triangles_get_small);
    RUN(half_a_texel_off_is_more_at_every_level);
    RUN(a_map_is_right_only_from_its_centre);
    RUN(eight_bits_hold_a_sun_or_a_sky);
    RUN(a_float_sum_stalls_and_overflows_and_levels_do_not);
    RUN(radiance_from_1e_38_to_1e38_passes_alike);
    RUN(the_smallest_radiance_there_is_stays_and_black_is_black);
    RUN(nan_in_a_map_reaches_only_the_texels_above_it);
    RUN(a_checkerboard_at_nyquist_is_grey_in_every_level);
    RUN(every_size_from_one_texel_up_is_right);
    RUN(texels_of_8192_sum_to_those_of_128);
    RUN(a_lat_long_map_8192_wide_keeps_its_mean);
    RUN(nothing_leaks);
    return test_summary();
}
