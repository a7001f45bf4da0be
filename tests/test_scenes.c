/* SPDX-License-Identifier: MIT
   Scenes that a filter through harmonics finds hard, and those that it finds too easy: lamps and
   discs with sharp edges, on black, on edges and corners of faces; halves; checks. FAST keeps the
   tolerance in rms for each lobe, and HARMONICS does the same or says that it cannot. The worst
   texel is held to 20 tolerances where nothing is black. */
#include "helpers.h"

/* ---------------------------------------------------------------------------------- scenes ---- */

static double centre[3], radius; /* of what the scene has one of */

static double dot(const double a[3], const double b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static double lamp(const double d[3], int channel) {
    static const double tint[3] = {10, 9, 7};
    return dot(d, centre) > cos(radius) ? tint[channel] : 0;
}

static double white_but_for_a_disc(const double d[3], int channel) {
    (void)channel;
    return dot(d, centre) > cos(radius) ? 0 : 0.8;
}

static double half_bright(const double d[3], int channel) {
    (void)channel;
    return dot(d, centre) > 0 ? 1 : 0.05;
}

static double checks(const double d[3], int channel) {
    int u = (int)floor(5 + atan2(d[1], d[0]) * 1.7), v = (int)floor(acos(d[2]) * 2.1);
    return (u + v) & 1 ? 1 : 0.02 * channel;
}

static void aim(double x, double y, double z, double r) {
    double n = sqrt(x * x + y * y + z * z);
    centre[0] = x / n, centre[1] = y / n, centre[2] = z / n, radius = r;
}

static envmap scene(int mapping, int size, double (*f)(const double d[3], int channel)) {
    envmap map = black(mapping, size, 1, 1);
    oracle_fill(&map, 0, f);
    return map;
}

/* ----------------------------------------------------------------------------------- lobes ---- */

enum { TABLE = 65 };
static float bell[TABLE];

static envmap_lobe table(void) {
    for (int i = 0; i < TABLE; ++i) bell[i] = (float)exp(9 * (cos(PI * i / (TABLE - 1)) - 1));
    return envmap_lobe_table(bell, TABLE, 1, 0, 0);
}

enum { LOBES = 11, KINKED = 3 }; /* the first ones have kinks */
static envmap_lobe lobe_of(int i) {
    static const float exponents[5] = {2, 3, 6, 15, 30};
    if (i == 0) return envmap_lobe_diffuse();
    if (i == 1) return envmap_lobe_phong(1);
    if (i == 2) return envmap_lobe_ggx(0.5f);
    if (i < 8) return envmap_lobe_phong(exponents[i - 3]);
    return i == 8 ? envmap_lobe_ggx(0.25f) : i == 9 ? envmap_lobe_ggx(0.1f) : table();
}

/* --------------------------------------------------------------------------------- holding ---- */

typedef struct figures {
    double rms, worst; /* in tolerances */
    int fast, all;     /* calls that did not end at the reference, and all */
} figures;

/* One lobe at the tolerances 1e-2 .. 10^-to, by FAST, and once by HARMONICS. */
static void hold(figures *f, const envmap *src, int size, envmap_lobe lobe, int to) {
    envmap truth = black(ENVMAP_CUBE, size, 1, 1), dst = black(ENVMAP_CUBE, size, 1, 1);
    envmap again = black(ENVMAP_CUBE, size, 1, 1);
    CHECK(filter(&truth, src, lobe, ENVMAP_METHOD_REFERENCE, 0) == ENVMAP_OK);
    for (int k = 2; k <= to; ++k) {
        double tolerance = pow(10, -k);
        envmap_difference d;
        CHECK(filter(&dst, src, lobe, ENVMAP_METHOD_FAST, tolerance) == ENVMAP_OK);
        if (!CHECK(envmap_compare(&d, &dst, &truth, 0) == ENVMAP_OK)) continue;
        if (!(d.rms / tolerance <= f->rms)) f->rms = d.rms / tolerance;
        if (!(d.worst / tolerance <= f->worst)) f->worst = d.worst / tolerance;
        f->fast += !same_bits(&dst, &truth), ++f->all;
        if (k != 3) continue;
        envmap_result result = filter(&again, src, lobe, ENVMAP_METHOD_HARMONICS, tolerance);
        if (result == ENVMAP_OK) /* FAST does not take bands where sums are quicker */
            CHECK(!envmap_compare(&d, &again, &truth, 0) && d.rms <= tolerance);
        else CHECK(result == ENVMAP_ERROR_METHOD && same_bits(&dst, &truth));
    }
    envmap_free(&truth);
    envmap_free(&dst);
    envmap_free(&again);
}

static void report(const char *what, figures f, int dark) {
    char text[128];
    snprintf(text, sizeof text, "%s: rms / tolerance", what);
    FIGURE(text, f.rms, 1);
    snprintf(text, sizeof text, "%s: worst / tolerance", what);
    if (dark) printf("    %-64s %.3g\n", text, f.worst);
    else FIGURE(text, f.worst, 20);
    printf("    %d of %d calls through harmonics\n", f.fast, f.all);
    CHECK(4 * f.fast >= 3 * f.all);
}

static const int sizes[ENVMAP_MAPPING_COUNT] = {64, 64, 96, 64, 96, 96};

/* From one mapping, kinked lobes to 1e-4 and others to 1e-5; dark: some of the scene is black. */
static void hold_all(const char *what, double (*f)(const double d[3], int channel), int mapping,
                     int size, int first, int step, int dark) {
    figures all = {0, 0, 0, 0};
    envmap src = scene(mapping, sizes[mapping], f);
    for (int i = first; i < LOBES; i += test_many(50) < 50 ? 5 : step)
        hold(&all, &src, size, lobe_of(i), i < KINKED ? 3 + (mapping == ENVMAP_CUBE) : 5);
    envmap_free(&src);
    report(what, all, dark);
}

static void a_wide_lamp_on_black_keeps_the_tolerance(void) {
    aim(0.3, 0.7, 0.55, 0.3);
    hold_all("lamp, cube", lamp, ENVMAP_CUBE, 16, 0, 3, 1);
    hold_all("lamp, cube", lamp, ENVMAP_CUBE, 6, 0, 1, 1);
    hold_all("lamp, lat-long", lamp, ENVMAP_LATLONG, 6, 0, 2, 1);
    hold_all("lamp, paraboloid", lamp, ENVMAP_PARABOLOID, 6, 1, 2, 1);
}

static void a_lamp_across_an_edge_or_a_pole_keeps_the_tolerance(void) {
    aim(1, 0.999, 0.1, 0.25);
    hold_all("lamp on an edge", lamp, ENVMAP_CUBE, 6, 1, 2, 1);
    aim(1, -1, 1, 0.2);
    hold_all("lamp on a corner", lamp, ENVMAP_CUBE, 6, 1, 2, 1);
    aim(0, 1, 0.02, 0.2);
    hold_all("lamp on a pole", lamp, ENVMAP_LATLONG, 6, 0, 2, 1);
    aim(0.02, -0.7, 0.72, 0.2);
    hold_all("lamp on a folded edge", lamp, ENVMAP_OCTAHEDRAL, 6, 0, 2, 1);
}

static void a_black_disc_keeps_the_tolerance(void) {
    aim(-0.6, 0.2, 0.77, 0.4);
    hold_all("disc, cube", white_but_for_a_disc, ENVMAP_CUBE, 6, 0, 2, 0);
    hold_all("disc, lat-long", white_but_for_a_disc, ENVMAP_LATLONG, 6, 1, 2, 0);
}

static void checks_keep_the_tolerance(void) {
    hold_all("checks, cube", checks, ENVMAP_CUBE, 6, 1, 2, 0);
    hold_all("checks, paraboloid", checks, ENVMAP_PARABOLOID, 6, 0, 2, 0);
}

static void a_horizon_keeps_the_tolerance(void) {
    aim(0.13, 0.97, -0.21, 1);
    hold_all("horizon, cube", half_bright, ENVMAP_CUBE, 6, 0, 2, 0);
    hold_all("horizon, lat-long", half_bright, ENVMAP_LATLONG, 6, 1, 2, 0);
}

/* ------------------------------------------------------------- what one look may miss ---- */

/* Channels that add up to grey: what one of them has, the others lack. */
static double red_or_green(const double d[3], int channel) {
    double red = sin(6 * d[0]) * sin(7 * d[1] + 1) > 0;
    return channel == 0 ? red : channel == 1 ? 1 - red : 0;
}

static double red_to_green(const double d[3], int channel) {
    double red = 0.5 + 0.5 * sin(4 * d[0]) * sin(5 * d[1] + 1);
    return channel == 0 ? red : channel == 1 ? 1 - red : 0.3;
}

/* Edges along the middle of a map, or along a face's. */
static double up(const double d[3], int channel) {
    (void)channel;
    return d[1] > 0 ? 1 : 0.2;
}

static double a_ceiling(const double d[3], int channel) {
    (void)channel;
    return d[1] > fabs(d[0]) && d[1] > fabs(d[2]) ? 1 : 0.01;
}

static void colours_that_sum_to_grey_keep_the_tolerance(void) {
    hold_all("red or green, cube", red_or_green, ENVMAP_CUBE, 6, 1, 2, 0);
    hold_all("red or green, lat-long", red_or_green, ENVMAP_LATLONG, 6, 0, 4, 0);
    hold_all("red to green, paraboloid", red_to_green, ENVMAP_PARABOLOID, 6, 1, 2, 0);
}

static void edges_along_the_texels_keep_the_tolerance(void) {
    hold_all("sky and ground, cube", up, ENVMAP_CUBE, 6, 0, 2, 0);
    hold_all("sky and ground, lat-long", up, ENVMAP_LATLONG, 6, 1, 2, 0);
    hold_all("one bright face, cube", a_ceiling, ENVMAP_CUBE, 6, 1, 2, 0);
}

/* Sizes that no block divides: the last blocks of a face are alone at the coarser scales. */
static void a_sun_in_the_last_texel_keeps_the_tolerance(void) {
    static const int odd[4] = {33, 36, 49, 68};
    figures all = {0, 0, 0, 0};
    for (int i = 0; i < 4; ++i)
        for (int lobe = 4; lobe < LOBES; lobe += 3) {
            envmap src = black(ENVMAP_CUBE, odd[i], 1, 1);
            float *texel = envmap_texel(&src, 0, 0, 4, odd[i] - 1, odd[i] - 1);
            for (int c = 0; c < 3; ++c) texel[c] = 1000;
            hold(&all, &src, 6, lobe_of(lobe), 3);
            envmap_free(&src);
        }
    report("a sun in the last texel", all, 1);
}

static void nothing_leaks(void) { CHECK(oracle_live == 0); }

int main(void) {
    RUN(a_wide_lamp_on_black_keeps_the_tolerance);
    RUN(a_lamp_across_an_edge_or_a_pole_keeps_the_tolerance);
    RUN(a_black_disc_keeps_the_tolerance);
    RUN(checks_keep_the_tolerance);
    RUN(a_horizon_keeps_the_tolerance);
    RUN(colours_that_sum_to_grey_keep_the_tolerance);
    RUN(edges_along_the_texels_keep_the_tolerance);
    RUN(a_sun_in_the_last_texel_keeps_the_tolerance);
    RUN(nothing_leaks);
    return test_summary();
}
