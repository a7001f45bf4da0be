/* SPDX-License-Identifier: MIT
   directions: each mapping against the formula of its source (tests/oracle.h), both ways, on
   seams, poles, rims, axes and corners; the paraboloid's texture matrix against the mapping. */
#include "oracle.h"

static const int mappings[] = {ENVMAP_CUBE,    ENVMAP_PARABOLOID, ENVMAP_SPHERE,
                               ENVMAP_LATLONG, ENVMAP_ANGULAR,    ENVMAP_OCTAHEDRAL};

/* Angle between dir and what its coordinates map back to. */
static double round_trip(int m, const float dir[3]) {
    int face = -1;
    float u = -1, v = -1, back[3] = {9, 9, 9};
    envmap_coordinates(&face, &u, &v, m, dir);
    CHECK(face >= 0 && face < envmap_faces((int)m));
    CHECK(u >= 0 && u <= 1 && v >= 0 && v <= 1);
    envmap_direction(back, m, face, u, v);
    double p[3] = {(double)back[0], (double)back[1], (double)back[2]};
    CHECK_CLOSE(p[0] * p[0] + p[1] * p[1] + p[2] * p[2], 1, 4e-7);
    return oracle_angle_f(dir, back);
}

/* u and v are floats: half an ulp at 1 is 3e-8, which the mappings stretch by at most 2 pi; the
   sphere map stretches it by 4/delta at the angle delta from -z. */
static void directions_round_trip(void) {
    for (int m = 0; m < MAPPINGS; ++m) {
        unsigned long long state = 1 + (unsigned)m;
        double worst = 0;
        for (int i = 0; i < test_many(100000); ++i) {
            double d[3], minus_z[3] = {0, 0, -1};
            oracle_random_direction(d, &state);
            float f[3] = {(float)d[0], (float)d[1], (float)d[2]};
            double error = round_trip(mappings[m], f), delta = oracle_angle(d, minus_z);
            if (m == ENVMAP_SPHERE && delta < 1) error *= delta;
            if (!(error <= worst)) worst = error;
        }
        char what[80];
        sprintf(what, "%s: direction -> float (u,v) -> direction, rad%s", oracle_name[m],
                m == ENVMAP_SPHERE ? " (times delta)" : "");
        FIGURE(what, worst, 5e-7);
    }
}

static void coordinates_round_trip(void) {
    for (int m = 0; m < MAPPINGS; ++m) {
        unsigned long long state = 11 + (unsigned)m;
        double worst = 0;
        for (int i = 0; i < test_many(100000); ++i) {
            int face = (int)(test_random(&state) * envmap_faces(m)), back = -1;
            float u = (float)test_random(&state), v = (float)test_random(&state), d[3], u1, v1;
            double X = 2 * (double)u - 1, Y = 2 * (double)v - 1, r = sqrt(X * X + Y * Y);
            if (oracle_is_disc(m) && r > 0.999999) continue;
            /* within 1e-6 of an edge, the direction may round to the neighbour's side */
            if ((m == ENVMAP_CUBE || m == ENVMAP_OCTAHEDRAL) &&
                (fabs(X) > 0.999999 || fabs(Y) > 0.999999))
                continue;
            envmap_direction(d, mappings[m], face, u, v);
            envmap_coordinates(&back, &u1, &v1, mappings[m], d);
            CHECK(back == face);
            double du = fabs((double)u1 - (double)u), dv = fabs((double)v1 - (double)v);
            if (m == ENVMAP_LATLONG) { /* u means less towards the poles, and 0 is 1 */
                if (du > 0.5) du = 1 - du;
                du *= sin(PI * (double)v);
            }
            if (m == ENVMAP_ANGULAR) { /* towards the rim the circle shrinks to +z */
                du *= 1 - r, dv *= 1 - r;
            }
            if (!(du <= worst)) worst = du;
            if (!(dv <= worst)) worst = dv;
        }
        char what[80];
        sprintf(what, "%s: (u,v) -> float direction -> (u,v)", oracle_name[m]);
        FIGURE(what, worst, 3e-7);
    }
}

static void mappings_are_the_formulas_of_their_sources(void) {
    for (int m = 0; m < MAPPINGS; ++m) {
        unsigned long long state = 21 + (unsigned)m;
        double there = 0, back = 0;
        for (int i = 0; i < test_many(100000); ++i) {
            double d[3], u, v, e[3];
            int face, f;
            oracle_random_direction(d, &state);
            float dir[3] = {(float)d[0], (float)d[1], (float)d[2]}, fu, fv, fd[3];
            for (int k = 0; k < 3; ++k) d[k] = (double)dir[k];
            oracle_coordinates(&face, &u, &v, m, d);
            envmap_coordinates(&f, &fu, &fv, mappings[m], dir);
            CHECK(f == face);
            double du = fabs((double)fu - u), dv = fabs((double)fv - v);
            /* the oracle's acos loses 1e-8 rad / sin near the poles, its z + 1 near -z */
            if (!(du <= there)) there = du;
            if (!(dv <= there)) there = dv;

            face = (int)(test_random(&state) * envmap_faces(m));
            fu = (float)test_random(&state), fv = (float)test_random(&state);
            oracle_direction(e, m, face, (double)fu, (double)fv);
            envmap_direction(fd, mappings[m], face, fu, fv);
            double p[3] = {(double)fd[0], (double)fd[1], (double)fd[2]}, angle = oracle_angle(p, e);
            if (!(angle <= back)) back = angle;
        }
        char what[80];
        sprintf(what, "%s: (u,v) of a direction against the formula", oracle_name[m]);
        FIGURE(what, there, 1e-7);
        sprintf(what, "%s: direction of (u,v) against the formula, rad", oracle_name[m]);
        FIGURE(what, back, 1.5e-7);
    }
}

/* Design figure: float coordinates near the sphere map's -z cost 3e-4 rad at 1e-3 rad from it. */
static void the_sphere_map_loses_digits_near_minus_z(void) {
    unsigned long long state = 31;
    for (int e = 1; e <= 4; ++e) {
        double delta = pow(10, -e), worst = 0, sum = 0;
        int n = test_many(20000);
        for (int i = 0; i < n; ++i) {
            double a = 2 * PI * test_random(&state);
            float d[3] = {(float)(sin(delta) * cos(a)), (float)(sin(delta) * sin(a)),
                          (float)-cos(delta)};
            double error = round_trip(ENVMAP_SPHERE, d);
            if (!(error <= worst)) worst = error;
            sum += error;
        }
        /* 1 - r = delta^2/8, and r is known to 6e-8 sqrt 2, at most half an ulp of u and of v */
        double slip = 8 * 6e-8 * sqrt(2), inside = delta * delta - slip;
        double bound = delta - sqrt(inside > 0 ? inside : 0);
        if (bound < sqrt(delta * delta + slip) - delta) bound = sqrt(delta * delta + slip) - delta;
        char what[80];
        sprintf(what, "sphere map: round trip at %.0e rad from -z, mean, rad", delta);
        FIGURE(what, sum / n, 0.7 * bound);
        sprintf(what, "sphere map: round trip at %.0e rad from -z, worst, rad", delta);
        FIGURE(what, worst, 1.1 * bound);
    }
}

/* OpenGL's cube, face by face, written out by hand: the direction at (u,v) = (0,0), (1,0), (0,1). */
static void cube_faces_are_labelled_and_turned_as_in_opengl(void) {
    static const float corner[6][3][3] = {
        {{1, 1, 1}, {1, 1, -1}, {1, -1, 1}},        /* +X: u to -z, v to -y */
        {{-1, 1, -1}, {-1, 1, 1}, {-1, -1, -1}},    /* -X: u to +z, v to -y */
        {{-1, 1, -1}, {1, 1, -1}, {-1, 1, 1}},      /* +Y: u to +x, v to +z */
        {{-1, -1, 1}, {1, -1, 1}, {-1, -1, -1}},    /* -Y: u to +x, v to -z */
        {{-1, 1, 1}, {1, 1, 1}, {-1, -1, 1}},       /* +Z: u to +x, v to -y */
        {{1, 1, -1}, {-1, 1, -1}, {1, -1, -1}}};    /* -Z: u to -x, v to -y */
    static const float at[3][2] = {{0, 0}, {1, 0}, {0, 1}};
    for (int f = 0; f < 6; ++f)
        for (int i = 0; i < 3; ++i) {
            float d[3];
            envmap_direction(d, ENVMAP_CUBE, f, at[i][0], at[i][1]);
            CHECK_CLOSE(oracle_angle_f(d, corner[f][i]), 0, 1e-7);
        }
}

/* Where +x, +y, +z and their opposites lie on the other mappings, from the conventions. */
static void axes_lie_where_the_conventions_say(void) {
    static const struct {
        int mapping;
        float d[3];
        int face;
        double u, v;
    } table[] = {{ENVMAP_CUBE, {1, 0, 0}, 0, .5, .5},
                 {ENVMAP_CUBE, {-1, 0, 0}, 1, .5, .5},
                 {ENVMAP_CUBE, {0, 1, 0}, 2, .5, .5},
                 {ENVMAP_CUBE, {0, -1, 0}, 3, .5, .5},
                 {ENVMAP_CUBE, {0, 0, 1}, 4, .5, .5},
                 {ENVMAP_CUBE, {0, 0, -1}, 5, .5, .5},
                 {ENVMAP_PARABOLOID, {1, 0, 0}, 0, 1, .5},
                 {ENVMAP_PARABOLOID, {-1, 0, 0}, 0, 0, .5},
                 {ENVMAP_PARABOLOID, {0, 1, 0}, 0, .5, 0},
                 {ENVMAP_PARABOLOID, {0, -1, 0}, 0, .5, 1},
                 {ENVMAP_PARABOLOID, {0, 0, 1}, 0, .5, .5},
                 {ENVMAP_PARABOLOID, {0, 0, -1}, 1, .5, .5},
                 {ENVMAP_SPHERE, {1, 0, 0}, 0, .5 + .3535533905932738, .5},
                 {ENVMAP_SPHERE, {-1, 0, 0}, 0, .5 - .3535533905932738, .5},
                 {ENVMAP_SPHERE, {0, 1, 0}, 0, .5, .5 - .3535533905932738},
                 {ENVMAP_SPHERE, {0, -1, 0}, 0, .5, .5 + .3535533905932738},
                 {ENVMAP_SPHERE, {0, 0, 1}, 0, .5, .5},
                 {ENVMAP_SPHERE, {0, 0, -1}, 0, 1, .5},
                 {ENVMAP_LATLONG, {1, 0, 0}, 0, .75, .5},
                 {ENVMAP_LATLONG, {-1, 0, 0}, 0, .25, .5},
                 {ENVMAP_LATLONG, {0, 1, 0}, 0, .5, 0},
                 {ENVMAP_LATLONG, {0, -1, 0}, 0, .5, 1},
                 {ENVMAP_LATLONG, {0, 0, -1}, 0, .5, .5},
                 {ENVMAP_ANGULAR, {1, 0, 0}, 0, .75, .5},
                 {ENVMAP_ANGULAR, {-1, 0, 0}, 0, .25, .5},
                 {ENVMAP_ANGULAR, {0, 1, 0}, 0, .5, .25},
                 {ENVMAP_ANGULAR, {0, -1, 0}, 0, .5, .75},
                 {ENVMAP_ANGULAR, {0, 0, -1}, 0, .5, .5},
                 {ENVMAP_ANGULAR, {0, 0, 1}, 0, 1, .5},
                 {ENVMAP_OCTAHEDRAL, {1, 0, 0}, 0, 1, .5},
                 {ENVMAP_OCTAHEDRAL, {-1, 0, 0}, 0, 0, .5},
                 {ENVMAP_OCTAHEDRAL, {0, 0, 1}, 0, .5, 1},
                 {ENVMAP_OCTAHEDRAL, {0, 0, -1}, 0, .5, 0},
                 {ENVMAP_OCTAHEDRAL, {0, 1, 0}, 0, .5, .5},
                 {ENVMAP_OCTAHEDRAL, {0, -1, 0}, 0, 1, 1},
                 {ENVMAP_OCTAHEDRAL, {2, 1, -1}, 0, .75, .375},
                 {ENVMAP_OCTAHEDRAL, {2, -1, -1}, 0, .875, .25}};
    for (size_t i = 0; i < sizeof table / sizeof *table; ++i) {
        int face;
        float u, v, back[3];
        envmap_coordinates(&face, &u, &v, table[i].mapping, table[i].d);
        CHECK(face == table[i].face);
        CHECK_CLOSE(u, table[i].u, 1e-7);
        CHECK_CLOSE(v, table[i].v, 1e-7);
        envmap_direction(back, table[i].mapping, face, u, v);
        CHECK_CLOSE(oracle_angle_f(back, table[i].d), 0, 5e-7);
    }
}

/* Along every edge and at every corner of the cube: the lower face, u or v exactly 0 or 1. */
static void cube_edges_and_corners_belong_to_the_lower_face(void) {
    for (int code = 0; code < 27; ++code)
        for (int i = 0; i < 64; ++i) {
            float d[3] = {(float)(code % 3 - 1), (float)(code / 3 % 3 - 1), (float)(code / 9 - 1)};
            int ends = 0, lowest = 6, face;
            for (int k = 0; k < 3; ++k) {
                if (d[k] == 0)
                    d[k] = (float)(i - 32) / 33.0f;
                else
                    ++ends;
            }
            if (ends < 2) continue;
            for (int k = 2; k >= 0; --k)
                if (fabsf(d[k]) == 1) lowest = 2 * k + (d[k] < 0);
            float u, v, power = ldexpf(1, i % 41 - 20);
            for (int k = 0; k < 3; ++k) d[k] *= power;
            envmap_coordinates(&face, &u, &v, ENVMAP_CUBE, d);
            CHECK(face == lowest);
            CHECK(u == 0 || u == 1 || v == 0 || v == 1);
            CHECK_CLOSE(round_trip(ENVMAP_CUBE, d), 0, 3e-7);
        }
}

/* From either face of a shared edge the same direction: each (face,u,v) on an edge goes to a
   direction whose own coordinates may name the neighbour, but the direction is the same. */
static void seams_are_the_same_direction_from_both_sides(void) {
    for (int i = 0; i <= 64; ++i) {
        float t = (float)i / 64, a[3], b[3];
        static const float side[4][2] = {{0, -1}, {1, -1}, {-1, 0}, {-1, 1}};
        for (int f = 0; f < 6; ++f)
            for (int s = 0; s < 4; ++s) {
                envmap_direction(a, ENVMAP_CUBE, f, side[s][0] < 0 ? t : side[s][0],
                                 side[s][1] < 0 ? t : side[s][1]);
                CHECK_CLOSE(round_trip(ENVMAP_CUBE, a), 0, 3e-7);
            }
        envmap_direction(a, ENVMAP_LATLONG, 0, 0, t); /* u = 0 and u = 1 are +z, all v */
        envmap_direction(b, ENVMAP_LATLONG, 0, 1, t);
        CHECK_CLOSE(oracle_angle_f(a, b), 0, 3e-7);
        CHECK_CLOSE(round_trip(ENVMAP_LATLONG, a), 0, 5e-7);
        envmap_direction(a, ENVMAP_LATLONG, 0, t, 0); /* one pole, all u */
        CHECK_CLOSE(a[1], 1, 1e-7);
        envmap_direction(a, ENVMAP_LATLONG, 0, t, 1);
        CHECK_CLOSE(a[1], -1, 1e-7);
        double angle = 2 * PI * i / 64;
        float u = (float)(0.5 + 0.5 * cos(angle)), v = (float)(0.5 - 0.5 * sin(angle));
        float rim[3] = {(float)cos(angle), (float)sin(angle), 0}, plus[3] = {0, 0, 1},
              minus[3] = {0, 0, -1};
        for (int f = 0; f < 2; ++f) { /* both faces agree on the rim, which is z = 0 */
            envmap_direction(a, ENVMAP_PARABOLOID, f, u, v);
            CHECK_CLOSE(oracle_angle_f(a, rim), 0, 3e-7);
        }
        for (int s = 0; s < 4; ++s) { /* an octahedral map's edge is the same, end for end */
            envmap_direction(a, ENVMAP_OCTAHEDRAL, 0, side[s][0] < 0 ? t : side[s][0],
                             side[s][1] < 0 ? t : side[s][1]);
            envmap_direction(b, ENVMAP_OCTAHEDRAL, 0, side[s][0] < 0 ? 1 - t : side[s][0],
                             side[s][1] < 0 ? 1 - t : side[s][1]);
            CHECK_CLOSE(oracle_angle_f(a, b), 0, 3e-7);
            CHECK_CLOSE(round_trip(ENVMAP_OCTAHEDRAL, a), 0, 5e-7);
        }
        CHECK_CLOSE(round_trip(ENVMAP_PARABOLOID, rim), 0, 3e-7);
        envmap_direction(a, ENVMAP_ANGULAR, 0, u, v);
        CHECK_CLOSE(oracle_angle_f(a, plus), 0, 5e-7);
        envmap_direction(a, ENVMAP_SPHERE, 0, u, v); /* 1e-7 of the radius is 9e-4 rad here */
        CHECK_CLOSE(oracle_angle_f(a, minus), 0, 2e-3);
    }
}

static void singular_directions_have_the_coordinates_that_are_documented(void) {
    int face;
    float u, v, z[3] = {0, 0, 1}, d[3] = {0, 0, -1};
    envmap_coordinates(&face, &u, &v, ENVMAP_SPHERE, d);
    CHECK(u == 1 && v == 0.5f);
    CHECK_CLOSE(round_trip(ENVMAP_SPHERE, d), 0, 1e-6);
    envmap_coordinates(&face, &u, &v, ENVMAP_ANGULAR, z);
    CHECK(u == 1 && v == 0.5f);
    CHECK_CLOSE(round_trip(ENVMAP_ANGULAR, z), 0, 5e-7);
    for (int i = 0; i < 4; ++i) { /* -y is all four corners */
        float minus_y[3] = {i & 1 ? 0.0f : -0.0f, -1, i & 2 ? 0.0f : -0.0f};
        envmap_coordinates(&face, &u, &v, ENVMAP_OCTAHEDRAL, minus_y);
        CHECK((u == 0 || u == 1) && (v == 0 || v == 1));
        envmap_direction(d, ENVMAP_OCTAHEDRAL, 0, (float)(i & 1), (float)(i / 2));
        CHECK(d[1] == -1);
    }
    for (int s = -1; s <= 1; s += 2) {
        float pole[3] = {0, (float)s, 0}, minus_zero[3] = {-0.0f, (float)s, -0.0f};
        envmap_coordinates(&face, &u, &v, ENVMAP_LATLONG, pole);
        CHECK(u == 0.5f && v == (s > 0 ? 0 : 1));
        envmap_coordinates(&face, &u, &v, ENVMAP_LATLONG, minus_zero);
        CHECK(u == 0.5f && v == (s > 0 ? 0 : 1));
        /* a thousandth, a millionth ... beside a pole, and beside +-z */
        for (int e = 1; e < 30; ++e)
            for (int i = 0; i < 12; ++i) {
                double t = pow(10, -e), a = 2 * PI * i / 12;
                float p[3] = {(float)(t * cos(a)), (float)s, (float)(t * sin(a))};
                float q[3] = {(float)(t * cos(a)), (float)(t * sin(a)), (float)s};
                for (int m = 0; m < MAPPINGS; ++m) {
                    CHECK_CLOSE(round_trip(mappings[m], p), 0, 5e-7);
                    if (m != ENVMAP_SPHERE || s > 0)
                        CHECK_CLOSE(round_trip(mappings[m], q), 0, 5e-7);
                }
                if (s > 0 || e < 5) continue; /* at -z the sphere map keeps the azimuth */
                envmap_coordinates(&face, &u, &v, ENVMAP_SPHERE, q);
                CHECK_CLOSE(2 * (double)u - 1, cos(a), 2e-7);
                CHECK_CLOSE(1 - 2 * (double)v, sin(a), 2e-7);
            }
    }
}

static void directions_need_no_unit_length(void) {
    unsigned long long state = 41;
    for (int m = 0; m < MAPPINGS; ++m)
        for (int i = 0; i < 1000; ++i) {
            double d[3];
            oracle_random_direction(d, &state);
            int e = (int)(test_random(&state) * 240) - 120, face, face1;
            float a[3], b[3], u, v, u1, v1;
            for (int k = 0; k < 3; ++k) a[k] = (float)d[k], b[k] = ldexpf(a[k], e);
            if (fabs(d[0]) < 1e-2 || fabs(d[1]) < 1e-2 || fabs(d[2]) < 1e-2) continue;
            envmap_coordinates(&face, &u, &v, mappings[m], a);
            envmap_coordinates(&face1, &u1, &v1, mappings[m], b);
            CHECK(face == face1);
            CHECK_CLOSE(u1, u, 1e-7);
            CHECK_CLOSE(v1, v, 1e-7);
        }
}

static void what_is_no_direction_counts_as_plus_z(void) {
    const float nan = (float)NAN, inf = (float)INFINITY;
    const float bad[][3] = {{0, 0, 0},   {nan, 0, 0}, {0, nan, 0},     {0, 0, nan},
                            {inf, 0, 0}, {0, 1, -inf}, {nan, nan, nan}, {-inf, inf, nan}};
    const float z[3] = {0, 0, 1};
    for (int m = 0; m < MAPPINGS; ++m) {
        int face, face1;
        float u, v, u1, v1, d[3];
        envmap_coordinates(&face, &u, &v, mappings[m], z);
        for (size_t i = 0; i < sizeof bad / sizeof *bad; ++i) {
            envmap_coordinates(&face1, &u1, &v1, mappings[m], bad[i]);
            CHECK(face == face1 && u == u1 && v == v1);
        }
        const float uv[][2] = {{nan, 0.5f}, {0.25f, nan}, {inf, 0.5f}, {0.25f, -inf}};
        for (size_t i = 0; i < 4; ++i) {
            envmap_direction(d, mappings[m], 0, uv[i][0], uv[i][1]);
            CHECK(d[0] == 0 && d[1] == 0 && d[2] == 1);
        }
        const int faces[] = {-1, envmap_faces(m), 1000, -2147483647 - 1, 2147483647};
        for (size_t i = 0; i < 5; ++i) {
            envmap_direction(d, mappings[m], faces[i], 0.25f, 0.25f);
            CHECK(d[0] == 0 && d[1] == 0 && d[2] == 1);
        }
    }
    float d[3];
    envmap_direction(d, ENVMAP_MAPPING_COUNT, 0, 0.25f, 0.25f);
    CHECK(d[0] == 0 && d[1] == 0 && d[2] == 1);
}

static void mappings_have_6_2_1_1_1_1_faces(void) {
    static const int faces[MAPPINGS] = {6, 2, 1, 1, 1, 1};
    for (int m = 0; m < MAPPINGS; ++m) CHECK(envmap_faces(m) == faces[m]);
    CHECK(envmap_faces(-1) == 0 && envmap_faces(MAPPINGS) == 0 && envmap_faces(2147483647) == 0);
}

/* Beyond [0,1] cube, paraboloid and lat-long go on; sphere and angular maps clamp to the rim;
   octahedral maps turn about the edge's middle. */
static void faces_go_on_beyond_their_edge_or_clamp_to_the_rim(void) {
    unsigned long long state = 51;
    for (int m = 0; m < MAPPINGS; ++m)
        for (int i = 0; i < 2000; ++i) {
            int face = (int)(test_random(&state) * envmap_faces(m));
            float u = (float)(2 * test_random(&state) - 0.5), d[3];
            float v = (float)(2 * test_random(&state) - 0.5);
            double e[3], p[3];
            oracle_direction(e, m, face, (double)u, (double)v);
            envmap_direction(d, mappings[m], face, u, v);
            for (int k = 0; k < 3; ++k) p[k] = (double)d[k];
            double X = 2 * (double)u - 1, Y = 2 * (double)v - 1;
            /* on the rim itself the sphere map's direction is only good to sqrt(eps) */
            CHECK_CLOSE(oracle_angle(p, e), 0,
                        m == ENVMAP_SPHERE && X * X + Y * Y > 0.999 ? 1e-3 : 5e-7);
        }
}

/* --------------------------------------------------------------------------- the matrix -- */

/* A random rotation, from a random unit quaternion; columns are where x, y, z go. */
static void random_rotation(double r[3][3], unsigned long long *state) {
    double q[4], n = 2;
    while (n > 1 || n < 0.01) {
        n = 0;
        for (int k = 0; k < 4; ++k) q[k] = 2 * test_random(state) - 1, n += q[k] * q[k];
    }
    double w = q[0], x = q[1], y = q[2], z = q[3], s = 2 / n;
    double t[3][3] = {{1 - s * (y * y + z * z), s * (x * y - w * z), s * (x * z + w * y)},
                      {s * (x * y + w * z), 1 - s * (x * x + z * z), s * (y * z - w * x)},
                      {s * (x * z - w * y), s * (y * z + w * x), 1 - s * (x * x + y * y)}};
    memcpy(r, t, sizeof t);
}

/* s/q, t/q of (r,1) against the mapping of R^T r, front and back, 1000 viewing positions. */
static void the_texture_matrix_agrees_with_the_mapping(void) {
    unsigned long long state = 61;
    double worst = 0, printed = 0;
    for (int i = 0; i < test_many(1000); ++i) {
        double r[3][3], scale = pow(10, 6 * test_random(&state) - 3);
        random_rotation(r, &state);
        float modelview[16] = {0};
        for (int column = 0; column < 3; ++column)
            for (int row = 0; row < 3; ++row)
                modelview[4 * column + row] = (float)(scale * r[row][column]);
        for (int k = 0; k < 3; ++k) modelview[12 + k] = (float)(200 * test_random(&state) - 100);
        modelview[15] = 1;
        for (int face = 0; face < 2; ++face) {
            float matrix[16];
            CHECK(envmap_paraboloid_matrix(matrix, modelview, face) == ENVMAP_OK);
            for (int j = 0; j < 20; ++j) {
                double d[3], eye[3] = {0, 0, 0}, u, v, out[4] = {0, 0, 0, 0};
                int f;
                oracle_random_direction(d, &state);
                oracle_coordinates(&f, &u, &v, ENVMAP_PARABOLOID, d);
                if (f != face) continue;
                for (int k = 0; k < 3; ++k)
                    for (int l = 0; l < 3; ++l) eye[k] += r[k][l] * d[l];
                for (int k = 0; k < 4; ++k)
                    for (int l = 0; l < 4; ++l)
                        out[k] += (double)matrix[4 * l + k] * (l < 3 ? eye[l] : 1);
                double error = fmax(fabs(out[0] / out[3] - u), fabs(out[1] / out[3] - v));
                if (!(error <= worst)) worst = error;
                /* d - r, as the tutorial prints S, would be this far off */
                double z = face ? -d[2] : d[2];
                printed = fmax(printed, fabs(0.5 - 0.5 * d[0] / (1 + z) - u));
                /* and the library's own lookup says the same */
                float dir[3] = {(float)d[0], (float)d[1], (float)d[2]}, fu, fv;
                envmap_coordinates(&f, &fu, &fv, ENVMAP_PARABOLOID, dir);
                CHECK(f == face);
                CHECK_CLOSE(fu, out[0] / out[3], 2e-6);
                CHECK_CLOSE(fv, out[1] / out[3], 2e-6);
            }
        }
    }
    FIGURE("texture matrix against the mapping, in u and v", worst, 1e-6);
    CHECK(printed > 0.5);
}

/* The identity, written out by hand. Front: q = 1 + z, s = q/2 + x/2, t = q/2 - y/2. */
static void the_texture_matrix_of_the_identity_is_the_printed_one(void) {
    float identity[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}, matrix[16];
    static const double rows[2][4][4] = {
        {{.5, 0, .5, .5}, {0, -.5, .5, .5}, {0, 0, 0, 0}, {0, 0, 1, 1}},
        {{.5, 0, -.5, .5}, {0, -.5, -.5, .5}, {0, 0, 0, 0}, {0, 0, -1, 1}}};
    for (int face = 0; face < 2; ++face) {
        CHECK(envmap_paraboloid_matrix(matrix, identity, face) == ENVMAP_OK);
        double q = (double)matrix[15]; /* homogeneous: up to a factor */
        CHECK(q != 0);
        for (int row = 0; row < 4; ++row) {
            if (row == 2) continue; /* r is not looked at */
            for (int column = 0; column < 4; ++column)
                CHECK_CLOSE((double)matrix[4 * column + row] / q, rows[face][row][column], 1e-7);
        }
    }
}

static void the_texture_matrix_refuses_what_has_no_inverse(void) {
    float good[16] = {2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0, 5, 6, 7, 1}, bad[16], matrix[16];
    for (int k = 0; k < 16; ++k) matrix[k] = 42;
    CHECK(envmap_paraboloid_matrix(NULL, good, 0) == ENVMAP_ERROR_ARGUMENT);
    CHECK(envmap_paraboloid_matrix(matrix, NULL, 0) == ENVMAP_ERROR_ARGUMENT);
    CHECK(envmap_paraboloid_matrix(matrix, good, -1) == ENVMAP_ERROR_ARGUMENT);
    CHECK(envmap_paraboloid_matrix(matrix, good, 2) == ENVMAP_ERROR_ARGUMENT);
    static const float values[] = {0, (float)NAN, (float)INFINITY};
    for (int i = 0; i < 3; ++i)
        for (int k = 0; k < 3; ++k) { /* 0 on the diagonal is rank 2 */
            memcpy(bad, good, sizeof bad);
            bad[5 * k] = values[i];
            CHECK(envmap_paraboloid_matrix(matrix, bad, 0) == ENVMAP_ERROR_ARGUMENT);
        }
    for (int k = 0; k < 11; ++k) bad[k] = 0;
    CHECK(envmap_paraboloid_matrix(matrix, bad, 1) == ENVMAP_ERROR_ARGUMENT);
    for (int k = 0; k < 16; ++k) CHECK(matrix[k] == 42);
    CHECK(envmap_paraboloid_matrix(matrix, good, 1) == ENVMAP_OK);
    CHECK(envmap_paraboloid_matrix(good, good, 0) == ENVMAP_OK); /* in place is fine */
}

int main(void) {
    RUN(mappings_have_6_2_1_1_1_1_faces);
    RUN(directions_round_trip);
    RUN(coordinates_round_trip);
    RUN(mappings_are_the_formulas_of_their_sources);
    RUN(the_sphere_map_loses_digits_near_minus_z);
    RUN(cube_faces_are_labelled_and_turned_as_in_opengl);
    RUN(axes_lie_where_the_conventions_say);
    RUN(cube_edges_and_corners_belong_to_the_lower_face);
    RUN(seams_are_the_same_direction_from_both_sides);
    RUN(singular_directions_have_the_coordinates_that_are_documented);
    RUN(directions_need_no_unit_length);
    RUN(what_is_no_direction_counts_as_plus_z);
    RUN(faces_go_on_beyond_their_edge_or_clamp_to_the_rim);
    RUN(the_texture_matrix_agrees_with_the_mapping);
    RUN(the_texture_matrix_of_the_identity_is_the_printed_one);
    RUN(the_texture_matrix_refuses_what_has_no_inverse);
    return test_summary();
}
