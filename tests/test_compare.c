/* SPDX-License-Identifier: MIT
   Compare: rms, worst and bias of examples small enough to be worked out by hand. */
#include "zonal.h"

static envmap black(int mapping, int size, int levels, int slices) {
    envmap map = {0};
    if (!CHECK(envmap_create(&map, mapping, size, levels, slices) == ENVMAP_OK)) exit(1);
    return map;
}

static void set(envmap *map, int level, int slice, int face, int x, int y, float r, float g,
                float b) {
    float *texel = envmap_texel(map, level, slice, face, x, y);
    if (!CHECK(texel != NULL)) return;
    texel[0] = r;
    texel[1] = g;
    texel[2] = b;
}

static void fill(envmap *map, int level, float r, float g, float b) {
    int edge = oracle_edge(map->size, level), width = oracle_width(map->mapping, edge);
    for (int slice = 0; slice < map->slices; ++slice)
        for (int face = 0; face < envmap_faces(map->mapping); ++face)
            for (int y = 0; y < edge; ++y)
                for (int x = 0; x < width; ++x) set(map, level, slice, face, x, y, r, g, b);
}

static envmap_difference blank(void) {
    envmap_difference d = {-7, -7, -7, -7, -7, -7, -7};
    return d;
}

static void differences_of_a_map_from_itself_are_0(void) {
    envmap a = black(ENVMAP_CUBE, 4, 1, 2);
    envmap_difference d = blank();
    oracle_noise(&a, 1);
    CHECK(envmap_compare(&d, &a, &a, 0) == ENVMAP_OK);
    CHECK(d.rms == 0.0 && d.worst == 0.0 && d.bias == 0.0);
    envmap_free(&a);
}

/* Six texels of 4 pi/6, truth (1,2,4); one is (1.5,2,3): the squares' sum is 1.25 of 6 * 21, the
   sums' difference -0.5 of 6 * 7, and the worst channel is off by 1 of 4. */
static void differences_of_six_texels_are_those_worked_out_by_hand(void) {
    envmap a = black(ENVMAP_CUBE, 1, 1, 1), b = black(ENVMAP_CUBE, 1, 1, 1);
    envmap_difference d = blank();
    fill(&a, 0, 1, 2, 4);
    fill(&b, 0, 1, 2, 4);
    set(&a, 0, 0, 3, 0, 0, 1.5f, 2, 3);
    CHECK(envmap_compare(&d, &a, &b, 0) == ENVMAP_OK);
    CHECK_CLOSE(d.rms, sqrt(1.25 / 126), 1e-14);
    CHECK_CLOSE(d.bias, -0.5 / 42, 1e-14);
    CHECK_CLOSE(d.worst, 0.25, 1e-14);
    CHECK(d.slice == 0 && d.face == 3 && d.x == 0 && d.y == 0);
    /* the truth is the second map: 1.25 of 5 * 21 + 15.25, and 1 of 3 */
    CHECK(envmap_compare(&d, &b, &a, 0) == ENVMAP_OK);
    CHECK_CLOSE(d.rms, sqrt(1.25 / 120.25), 1e-14);
    CHECK_CLOSE(d.bias, 0.5 / 41.5, 1e-14);
    CHECK_CLOSE(d.worst, 1.0 / 3, 1e-14);
    envmap_free(&a);
    envmap_free(&b);
}

static void differences_are_weighted_by_solid_angle(void) {
    static const int place[3][3] = {{0, 0, 0}, {2, 1, 1}, {5, 4, 2}}; /* corner, middle, side */
    envmap a = black(ENVMAP_CUBE, 5, 1, 1), b = black(ENVMAP_CUBE, 5, 1, 1);
    fill(&a, 0, 1, 1, 1);
    fill(&b, 0, 1, 1, 1);
    for (int i = 0; i < 3; ++i) {
        double u, v, omega = o_texel(&u, &v, ENVMAP_CUBE, 5, place[i][1], place[i][2]);
        envmap_difference d = blank();
        set(&a, 0, 0, place[i][0], place[i][1], place[i][2], 1.5f, 1, 1);
        CHECK(envmap_compare(&d, &a, &b, 0) == ENVMAP_OK);
        CHECK_CLOSE(d.rms, sqrt(0.25 * omega / (4 * PI * 3)), 1e-9);
        CHECK_CLOSE(d.bias, 0.5 * omega / (4 * PI * 3), 1e-9);
        CHECK_CLOSE(d.worst, 0.5, 1e-14);
        CHECK(d.face == place[i][0] && d.x == place[i][1] && d.y == place[i][2]);
        set(&a, 0, 0, place[i][0], place[i][1], place[i][2], 1, 1, 1);
    }
    envmap_free(&a);
    envmap_free(&b);
}

/* In lat-long every texel of a row weighs alike, and a pole's row next to nothing. */
static void differences_at_a_pole_hardly_count(void) {
    envmap a = black(ENVMAP_LATLONG, 8, 1, 1), b = black(ENVMAP_LATLONG, 8, 1, 1);
    envmap_difference pole = blank(), equator = blank();
    fill(&a, 0, 2, 2, 2);
    fill(&b, 0, 2, 2, 2);
    set(&a, 0, 0, 0, 3, 0, 4, 4, 4);
    CHECK(envmap_compare(&pole, &a, &b, 0) == ENVMAP_OK);
    set(&a, 0, 0, 0, 3, 0, 2, 2, 2);
    set(&a, 0, 0, 0, 3, 4, 4, 4, 4);
    CHECK(envmap_compare(&equator, &a, &b, 0) == ENVMAP_OK);
    CHECK_CLOSE(equator.bias / pole.bias, (cos(PI / 2) - cos(5 * PI / 8)) / (1 - cos(PI / 8)),
                1e-9);
    CHECK(equator.y == 4 && pole.y == 0 && pole.x == 3);
    envmap_free(&a);
    envmap_free(&b);
}

/* The worst texel is relative to itself, but not to less than a thousandth of the mean. */
static void the_worst_texel_in_the_dark_is_relative_to_a_thousandth_of_the_mean(void) {
    envmap a = black(ENVMAP_CUBE, 1, 1, 1), b = black(ENVMAP_CUBE, 1, 1, 1);
    envmap_difference d = blank();
    const float lit = 0.01f; /* a constant is a double where C99 evaluates floats so */
    fill(&a, 0, 3, 3, 3);
    fill(&b, 0, 3, 3, 3);
    set(&b, 0, 0, 4, 0, 0, 0, 0, 0);
    set(&a, 0, 0, 4, 0, 0, 0, lit, 0);
    CHECK(envmap_compare(&d, &a, &b, 0) == ENVMAP_OK);
    CHECK_CLOSE(d.worst, (double)lit / (1e-3 * 2.5), 1e-9);
    CHECK(d.face == 4);
    envmap_free(&a);
    envmap_free(&b);
}

static void the_worst_texel_is_found_in_its_slice(void) {
    envmap a = black(ENVMAP_PARABOLOID, 4, 1, 3), b = black(ENVMAP_PARABOLOID, 4, 1, 3);
    envmap_difference d = blank();
    fill(&a, 0, 1, 1, 1);
    fill(&b, 0, 1, 1, 1);
    set(&a, 0, 0, 0, 1, 1, 1, 1, 1.25f);
    set(&a, 0, 2, 1, 2, 1, 1, 0.5f, 1);
    CHECK(envmap_compare(&d, &a, &b, 0) == ENVMAP_OK);
    CHECK(d.slice == 2 && d.face == 1 && d.x == 2 && d.y == 1);
    CHECK_CLOSE(d.worst, 0.5, 1e-14);
    /* all slices share one sum */
    double u, v, omega = o_texel(&u, &v, ENVMAP_PARABOLOID, 4, 1, 1);
    CHECK_CLOSE(d.rms, sqrt(omega * (0.0625 + 0.25) / (3 * 3 * 4 * PI)), 1e-7);
    CHECK_CLOSE(d.bias, omega * (0.25 - 0.5) / (3 * 3 * 4 * PI), 1e-7);
    envmap_free(&a);
    envmap_free(&b);
}

static void differences_are_those_of_the_level(void) {
    envmap a = black(ENVMAP_CUBE, 4, 3, 1), b = black(ENVMAP_CUBE, 4, 3, 1);
    envmap_difference d = blank();
    for (int level = 0; level < 3; ++level) {
        fill(&a, level, 1, 1, 1);
        fill(&b, level, 1, 1, 1);
    }
    fill(&a, 1, 1.5f, 1.5f, 1.5f);
    CHECK(envmap_compare(&d, &a, &b, 0) == ENVMAP_OK);
    CHECK(d.rms == 0.0);
    CHECK(envmap_compare(&d, &a, &b, 1) == ENVMAP_OK);
    CHECK_CLOSE(d.rms, 0.5, 1e-14);
    CHECK_CLOSE(d.bias, 0.5, 1e-14);
    CHECK(envmap_compare(&d, &a, &b, 2) == ENVMAP_OK);
    CHECK(d.rms == 0.0);
    envmap_free(&a);
    envmap_free(&b);
}

static void differences_outside_a_rim_do_not_count(void) {
    static const int discs[3] = {ENVMAP_PARABOLOID, ENVMAP_SPHERE, ENVMAP_ANGULAR};
    for (int i = 0; i < 3; ++i) {
        envmap a = black(discs[i], 8, 1, 1), b = black(discs[i], 8, 1, 1);
        envmap_difference d = blank();
        fill(&a, 0, 1, 1, 1);
        fill(&b, 0, 1, 1, 1);
        set(&a, 0, 0, 0, 0, 0, 100, 100, 100);
        set(&b, 0, 0, 0, 7, 7, 1000, 1000, 1000);
        CHECK(envmap_compare(&d, &a, &b, 0) == ENVMAP_OK);
        CHECK(d.rms == 0.0 && d.worst == 0.0 && d.bias == 0.0);
        /* one that the rim cuts does */
        double u, v, omega = o_texel(&u, &v, (int)discs[i], 8, 1, 1);
        set(&a, 0, 0, 0, 1, 1, 2, 1, 1);
        CHECK(envmap_compare(&d, &a, &b, 0) == ENVMAP_OK);
        CHECK_CLOSE(d.bias, omega / (3 * 4 * PI), 1e-7);
        CHECK(d.x == 1 && d.y == 1);
        envmap_free(&a);
        envmap_free(&b);
    }
}

static void differences_from_black_are_0_or_infinite(void) {
    envmap a = black(ENVMAP_CUBE, 2, 1, 1), b = black(ENVMAP_CUBE, 2, 1, 1);
    envmap_difference d = blank();
    CHECK(envmap_compare(&d, &a, &b, 0) == ENVMAP_OK);
    CHECK(d.rms == 0.0 && d.worst == 0.0 && d.bias == 0.0);
    set(&a, 0, 0, 1, 1, 0, 0, 1e-20f, 0);
    CHECK(envmap_compare(&d, &a, &b, 0) == ENVMAP_OK);
    CHECK(d.rms == (double)INFINITY && d.worst == (double)INFINITY && d.bias == (double)INFINITY);
    CHECK(d.face == 1 && d.x == 1 && d.y == 0);
    envmap_free(&a);
    envmap_free(&b);
}

static void differences_of_huge_and_tiny_radiance_are_finite(void) {
    static const float scale[2] = {1e38f, 1e-38f};
    for (int i = 0; i < 2; ++i) {
        envmap a = black(ENVMAP_CUBE, 2, 1, 1), b = black(ENVMAP_CUBE, 2, 1, 1);
        envmap_difference d = blank();
        fill(&a, 0, 2 * scale[i], 2 * scale[i], 2 * scale[i]);
        fill(&b, 0, scale[i], scale[i], scale[i]);
        CHECK(envmap_compare(&d, &a, &b, 0) == ENVMAP_OK);
        CHECK_CLOSE(d.rms, 1, 1e-6);
        CHECK_CLOSE(d.worst, 1, 1e-6);
        CHECK_CLOSE(d.bias, 1, 1e-6);
        envmap_free(&a);
        envmap_free(&b);
    }
}

static void a_map_that_is_not_finite_cannot_be_compared(void) {
    const float bad[3] = {NAN, INFINITY, -INFINITY};
    envmap a = black(ENVMAP_CUBE, 2, 2, 2), b = black(ENVMAP_CUBE, 2, 2, 2);
    for (int i = 0; i < 3; ++i) {
        envmap_difference d = blank();
        set(&a, 0, 1, 5, 1, 1, 0, 0, bad[i]);
        CHECK(envmap_compare(&d, &a, &b, 0) == ENVMAP_ERROR_RADIANCE);
        CHECK(envmap_compare(&d, &b, &a, 0) == ENVMAP_ERROR_RADIANCE);
        CHECK(d.rms < -6 && d.face == -7);
        CHECK(envmap_compare(&d, &b, &a, 1) == ENVMAP_OK); /* the other level is sound */
        set(&a, 0, 1, 5, 1, 1, 0, 0, 0);
    }
    envmap_free(&a);
    envmap_free(&b);
}

static void maps_of_different_shapes_cannot_be_compared(void) {
    envmap a = black(ENVMAP_CUBE, 4, 1, 1), none = {0};
    envmap others[4] = {black(ENVMAP_PARABOLOID, 4, 1, 1), black(ENVMAP_CUBE, 3, 1, 1),
                        black(ENVMAP_CUBE, 4, 1, 2), none};
    envmap_difference d = blank();
    for (int i = 0; i < 4; ++i) {
        CHECK(envmap_compare(&d, &a, &others[i], 0) == ENVMAP_ERROR_ARGUMENT);
        CHECK(envmap_compare(&d, &others[i], &a, 0) == ENVMAP_ERROR_ARGUMENT);
        envmap_free(&others[i]);
    }
    CHECK(envmap_compare(NULL, &a, &a, 0) == ENVMAP_ERROR_ARGUMENT);
    CHECK(envmap_compare(&d, NULL, &a, 0) == ENVMAP_ERROR_ARGUMENT);
    CHECK(envmap_compare(&d, &a, NULL, 0) == ENVMAP_ERROR_ARGUMENT);
    CHECK(envmap_compare(&d, &a, &a, 1) == ENVMAP_ERROR_ARGUMENT);
    CHECK(envmap_compare(&d, &a, &a, -1) == ENVMAP_ERROR_ARGUMENT);
    CHECK(d.rms < -6 && d.face == -7);
    envmap_free(&a);
}

int main(void) {
    RUN(differences_of_a_map_from_itself_are_0);
    RUN(differences_of_six_texels_are_those_worked_out_by_hand);
    RUN(differences_are_weighted_by_solid_angle);
    RUN(differences_at_a_pole_hardly_count);
    RUN(the_worst_texel_in_the_dark_is_relative_to_a_thousandth_of_the_mean);
    RUN(the_worst_texel_is_found_in_its_slice);
    RUN(differences_are_those_of_the_level);
    RUN(differences_outside_a_rim_do_not_count);
    RUN(differences_from_black_are_0_or_infinite);
    RUN(differences_of_huge_and_tiny_radiance_are_finite);
    RUN(a_map_that_is_not_finite_cannot_be_compared);
    RUN(maps_of_different_shapes_cannot_be_compared);
    return test_summary();
}
