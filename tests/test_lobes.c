/* SPDX-License-Identifier: MIT
   Lobes: each kind's values, integral, support, kinks, bound on second derivatives and zonal
   coefficients, held against the formulas of zonal.h and against quadrature. */
#define ENVMAP_IMPLEMENTATION
#include "zonal.h"

/* ------------------------------------------------------------------ the lobes under test ---- */

typedef struct pair {
    envmap_lobe lobe;
    o_lobe oracle;
    char name[48];
} pair;

enum { PAIRS = 32, SLICES = 9 };
/* Banks' c; the last two put the ring near the axis, where its tip is a cone. */
static const double slice_c[SLICES] = {0, -1, 1, -0.95, -0.5, 0.3, 0.8, -0.9999, 0.99};

static pair make(int kind, float parameter) {
    static const char *const names[] = {"Phong", "Gaussian", "GGX", "Banks"};
    pair p;
    p.lobe = kind == O_PHONG      ? envmap_lobe_phong(parameter)
             : kind == O_GAUSSIAN ? envmap_lobe_gaussian(parameter)
             : kind == O_GGX      ? envmap_lobe_ggx(parameter)
                                  : envmap_lobe_banks(parameter);
    p.oracle.kind = kind;
    p.oracle.n = (double)parameter;
    snprintf(p.name, sizeof p.name, "%s %g", names[kind], (double)parameter);
    return p;
}

static void all_pairs(pair pairs[PAIRS]) {
    static const float phong[] = {0, 0.5f, 1, 1.5f, 2, 2.5f, 3, 10, 100, 1000, 1e6f, 1e9f};
    static const float gaussian[] = {0, 0.01f, 0.2f, 1, 10, 100, 1e4f, 1e9f};
    static const float ggx[] = {1, 0.5f, 0.25f, 0.1f, 0.01f, 1e-4f};
    static const float banks[] = {0, 0.3f, 0.7f, 0.9f, 0.99f, 0.99999f};
    int n = 0;
    for (int i = 0; i < 12; ++i) pairs[n++] = make(O_PHONG, phong[i]);
    for (int i = 0; i < 8; ++i) pairs[n++] = make(O_GAUSSIAN, gaussian[i]);
    for (int i = 0; i < 6; ++i) pairs[n++] = make(O_GGX, ggx[i]);
    for (int i = 0; i < 6; ++i) pairs[n++] = make(O_BANKS, banks[i]);
}

static int slices_of(const pair *p) { return p->oracle.kind == O_BANKS ? SLICES : 1; }

/* The largest k, at the axis or on the ring. */
static double peak_of(const pair *p, double c) {
    return (double)o_k(p->oracle, p->oracle.kind == O_BANKS ? (long double)o_ring(c) : 0, c);
}

/* What a rounding of x = cos t does to k at t: the largest slope in x, times an ulp. A ring has
   slopes in t, and near an axis x tells little of t: dk/dx = k_t / sin t. */
static double rounding_of(const pair *p, double t, double c) {
    double n = p->oracle.n, slope, sine = sin(t) > 1e-8 ? sin(t) : 1e-8;
    if (p->oracle.kind == O_PHONG || p->oracle.kind == O_GAUSSIAN) slope = n;
    else if (p->oracle.kind == O_GGX) slope = 4 / (n * n);
    else slope = 1 / (1 - n) / sine;
    return 4e-16 * (1 + slope) * peak_of(p, c);
}

/* Angles of all sizes: half of them spread over [0,pi], half within ten sigma of the peak. */
static double some_angle(unsigned long long *state, const pair *p, double c) {
    double t = PI * test_random(state);
    if (test_random(state) < 0.5) return t;
    double sigma = o_sigma(p->oracle, c), centre = p->oracle.kind == O_BANKS ? o_ring(c) : 0;
    t = fabs(centre + sigma * 10 * (2 * test_random(state) - 1));
    return t < PI ? t : PI;
}

/* ---------------------------------------------------------------------------------- values ---- */

static void lobes_know_their_values(void) {
    pair pairs[PAIRS];
    unsigned long long state = 1;
    double worst = 0;
    all_pairs(pairs);
    for (int i = 0; i < PAIRS; ++i)
        for (int j = 0; j < slices_of(pairs + i); ++j)
            for (int n = 0; n < 2000; ++n) {
                const pair *p = pairs + i;
                double c = slice_c[j], t = some_angle(&state, p, c), peak = peak_of(p, c);
                double k = (double)o_k(p->oracle, (long double)t, c);
                double value = envmap_lobe_value(&p->lobe, cos(t), c);
                if (fabs(t - PI / 2) < 1e-9) continue;
                double error = fabs(value - k) / (rounding_of(p, t, c) + 1e-13 * peak);
                if (!CHECK(error <= 1))
                    printf("    %s c %g t %.17g: %g, not %g\n", p->name, c, t, value, k);
                if (fabs(value - k) / peak > worst) worst = fabs(value - k) / peak;
            }
    FIGURE("lobe values against formulas, error / peak", worst, 4e-7);
}

static void lobes_know_their_values_at_the_edges(void) {
    envmap_lobe hemisphere = envmap_lobe_phong(0), sharp = envmap_lobe_phong(1e9f);
    CHECK(envmap_lobe_value(&hemisphere, 0, 0) == 0.0);
    CHECK(envmap_lobe_value(&hemisphere, -1e-300, 0) == 0.0);
    CHECK(envmap_lobe_value(&hemisphere, -1, 0) == 0.0);
    CHECK(envmap_lobe_value(&hemisphere, 1e-13, 0) == 0.0); /* on the horizon, but for rounding */
    CHECK(envmap_lobe_value(&hemisphere, 1e-11, 0) == 1.0);
    CHECK(envmap_lobe_value(&hemisphere, 1, 0) == 1.0);
    CHECK(envmap_lobe_value(&sharp, 1, 0) == 1.0);
    CHECK(envmap_lobe_value(&sharp, 0.9999, 0) < 1e-300);
    CHECK_CLOSE(envmap_lobe_value(&sharp, 1 - 1e-9, 0), exp(1e9 * log1p(-1e-9)), 1e-6);
    envmap_lobe diffuse = envmap_lobe_diffuse();
    CHECK(envmap_lobe_value(&diffuse, 0.25, 0) == 0.25);
    CHECK(envmap_lobe_value(&diffuse, -0.25, 0) == 0.0);
    CHECK(envmap_lobe_value(&diffuse, 0, 0) == 0.0);
    envmap_lobe flat = envmap_lobe_gaussian(0);
    CHECK(envmap_lobe_value(&flat, -1, 0) == 1.0);
    CHECK(envmap_lobe_value(&flat, 1, 0) == 1.0);
    for (int i = 0; i < 4; ++i) {
        static const float s[] = {0, 0.5f, 0.99f, 0.99999f};
        envmap_lobe banks = envmap_lobe_banks(s[i]);
        double peak = 1 / (1 - (double)s[i]);
        CHECK_CLOSE(envmap_lobe_value(&banks, -1, 1) / peak, 1, 1e-9);
        CHECK_CLOSE(envmap_lobe_value(&banks, 1, -1) / peak, 1, 1e-9);
        CHECK_CLOSE(envmap_lobe_value(&banks, 0, 0) / peak, 1, 1e-9);
        CHECK(envmap_lobe_value(&banks, 1, 1) == 0.0);
        CHECK(envmap_lobe_value(&banks, -1, -1) == 0.0);
    }
    envmap_lobe ggx = envmap_lobe_ggx(0.25f);
    CHECK_CLOSE(envmap_lobe_value(&ggx, 1, 0), 1 / (PI * 0.0625), 1e-12);
    CHECK(envmap_lobe_value(&ggx, 0, 0) == 0.0);
    CHECK(envmap_lobe_value(&ggx, -0.5, 0) == 0.0);
    ggx = envmap_lobe_ggx(1);
    CHECK_CLOSE(envmap_lobe_value(&ggx, 0.3, 0), 0.3 / PI, 1e-14);
}

static void raw_lobes_carry_their_scale(void) {
    envmap_lobe lobes[4] = {envmap_lobe_phong(10), envmap_lobe_diffuse(), envmap_lobe_banks(0.5f),
                            envmap_lobe_gaussian(5)};
    for (int i = 0; i < 4; ++i) {
        envmap_lobe raw = lobes[i];
        double a[8], b[8];
        raw.raw = 1;
        raw.scale = 2.5f;
        CHECK_CLOSE(envmap_lobe_value(&raw, -0.4, 0.2),
                    2.5 * envmap_lobe_value(&lobes[i], -0.4, 0.2), 1e-14);
        CHECK_CLOSE(envmap_lobe_value(&raw, 0.4, 0.2), 2.5 * envmap_lobe_value(&lobes[i], 0.4, 0.2),
                    1e-14);
        double integral = envmap_lobe_integral(&lobes[i], 0);
        CHECK_CLOSE(envmap_lobe_integral(&raw, 0), 2.5 * integral, 1e-13);
        if (!CHECK(!envmap_lobe_zonal(a, 8, &lobes[i], 0)) ||
            !CHECK(!envmap_lobe_zonal(b, 8, &raw, 0)))
            continue;
        for (int l = 0; l < 8; ++l) CHECK_CLOSE(b[l], 2.5 * integral * a[l], 1e-12);
    }
}

/* ------------------------------------------------------------------------------- integrals ---- */

static void lobes_know_their_integrals(void) {
    pair pairs[PAIRS];
    double worst = 0;
    all_pairs(pairs);
    for (int i = 0; i < PAIRS; ++i)
        for (int j = 0; j < slices_of(pairs + i); ++j) {
            double c = slice_c[j], expected = o_integral(pairs[i].oracle, c);
            double error = fabs(envmap_lobe_integral(&pairs[i].lobe, c) / expected - 1);
            if (!CHECK(error <= 1e-9))
                printf("    %s c %g: integral off by %g\n", pairs[i].name, c, error);
            if (error > worst) worst = error;
        }
    FIGURE("lobe integrals against quadrature, relative", worst, 1e-9);
}

static void integrals_have_their_closed_forms(void) {
    static const float N[] = {0, 0.5f, 1, 10, 1000, 1e9f}, L[] = {0.01f, 1, 100, 1e9f};
    static const float s[] = {0, 0.3f, 0.7f, 0.99f};
    for (int i = 0; i < 6; ++i) {
        envmap_lobe phong = envmap_lobe_phong(N[i]);
        CHECK_CLOSE(envmap_lobe_integral(&phong, 0) * ((double)N[i] + 1), 2 * PI, 1e-12);
    }
    envmap_lobe lobe = envmap_lobe_diffuse();
    CHECK_CLOSE(envmap_lobe_integral(&lobe, 0), PI, 1e-14);
    lobe = envmap_lobe_gaussian(0);
    CHECK_CLOSE(envmap_lobe_integral(&lobe, 0), 4 * PI, 1e-13);
    for (int i = 0; i < 4; ++i) {
        lobe = envmap_lobe_gaussian(L[i]);
        double lambda = (double)L[i];
        CHECK_CLOSE(envmap_lobe_integral(&lobe, 0) * lambda, -2 * PI * expm1(-2 * lambda), 1e-12);
    }
    lobe = envmap_lobe_ggx(1); /* x/pi over the hemisphere */
    CHECK_CLOSE(envmap_lobe_integral(&lobe, 0), 1, 1e-12);
    for (int i = 0; i < 4; ++i) {
        lobe = envmap_lobe_banks(s[i]);
        double S = (double)s[i], half = acos(S), room = (1 - S) * (1 - S);
        for (int j = 0; j < SLICES; ++j) {
            double c = slice_c[j], value = envmap_lobe_integral(&lobe, c);
            if (fabs(c) <= S)
                CHECK_CLOSE(value /
                                (2 * PI * sqrt(1 - c * c) * (half - S * sqrt(1 - S * S)) / room),
                            1, 1e-10);
            if (fabs(c) >= 1) CHECK_CLOSE(value, PI, 1e-10);
        }
    }
}

/* ----------------------------------------------------------------------- sigma and support ---- */

static void lobes_know_their_width(void) {
    pair pairs[PAIRS];
    double worst = 0;
    all_pairs(pairs);
    for (int i = 0; i < PAIRS; ++i)
        for (int j = 0; j < slices_of(pairs + i); ++j) {
            double c = slice_c[j], expected = o_sigma(pairs[i].oracle, c), ring = o_ring(c);
            /* where the ring covers the axis, "half the width" can be read in two ways */
            int whole = ring == 0 || ring == PI || (ring > expected && PI - ring > expected);
            if (pairs[i].oracle.kind == O_BANKS && !whole) continue;
            double error = fabs(envmap_lobe_sigma(&pairs[i].lobe, c) / expected - 1);
            if (!CHECK(error <= 1e-6))
                printf("    %s c %g: sigma %g, not %g\n", pairs[i].name, c,
                       envmap_lobe_sigma(&pairs[i].lobe, c), expected);
            if (error > worst) worst = error;
        }
    FIGURE("lobe widths, relative error", worst, 1e-6);
}

/* x (1 - x)^22: the peak is at x = 1/23, between the angles that a search looks at. */
static double beside_the_horizon(double x, double p, void *user) {
    (void)p, (void)user;
    return x > 0 ? x * pow(1 - x, 22) : 0;
}

static void a_functions_width_is_that_of_its_peak_wherever_it_is(void) {
    envmap_lobe lobe = envmap_lobe_function(beside_the_horizon, NULL);
    double peak = 1.0 / 23, level = exp(-0.5) * beside_the_horizon(peak, 0, NULL), ends[2];
    for (int i = 0; i < 2; ++i) {
        double in = peak, out = i;
        for (int halved = 0; halved < 60; ++halved) {
            double middle = (in + out) / 2;
            if (beside_the_horizon(middle, 0, NULL) > level) in = middle;
            else out = middle;
        }
        ends[i] = in;
    }
    double width = (acos(ends[0]) - acos(ends[1])) / 2;
    FIGURE("relative error", fabs(envmap_lobe_sigma(&lobe, 0) / width - 1), 1e-4);
}

static void outside_its_support_a_lobe_is_below_1e_12_of_its_peak(void) {
    pair pairs[PAIRS];
    all_pairs(pairs);
    for (int i = 0; i < PAIRS; ++i)
        for (int j = 0; j < slices_of(pairs + i); ++j) {
            const pair *p = pairs + i;
            double c = slice_c[j], from = -1, to = -1, peak = peak_of(p, c), first = PI, last = 0;
            envmap_lobe_support(&from, &to, &p->lobe, c);
            CHECK(from >= 0 && from < to && to <= PI + 1e-15);
            double a, b;
            o_support(&a, &b, p->oracle, c);
            for (int n = 0; n <= 20000; ++n) { /* a grid over the circle and one over the lobe */
                double t = n <= 10000 ? PI * n / 10000 : a + (b - a) * (n - 10000) / 10000;
                double k = (double)o_k(p->oracle, (long double)t, c);
                if (t < from - 1e-9 || t > to + 1e-9)
                    if (!CHECK(k <= 1e-12 * peak))
                        printf("    %s c %g t %g k %g [%g %g]\n", p->name, c, t, k, from, to);
                if (k > 1e-12 * peak && t < first) first = t;
                if (k > 1e-12 * peak && t > last) last = t;
            }
            if (p->oracle.kind == O_GGX) continue; /* its tail may count to the horizon */
            if (!CHECK(to <= 1.15 * last + 1e-3 * (b - a)) ||
                !CHECK(from >= first / 1.15 - 1e-3 * (b - a)))
                printf("    %s c %g: support [%g %g], lobe [%g %g]\n", p->name, c, from, to, first,
                       last);
        }
}

/* ----------------------------------------------------------------------------------- kinks ---- */

static double folded(double t) { return t < 0 ? -t : t > PI ? 2 * PI - t : t; }

/* |k(t+h) - 2 k(t) + k(t-h)| / h: constant in h at a kink, linear where k is smooth, between the
   two (h^(N-1)) where the second derivative has no bound, as cos^N at the horizon for 1 < N < 2. */
static double bend(const pair *p, double t, double c, double h) {
    long double a = o_k(p->oracle, (long double)folded(t - h), c);
    long double b = o_k(p->oracle, (long double)folded(t), c);
    long double d = o_k(p->oracle, (long double)folded(t + h), c);
    return (double)fabsl(a - 2 * b + d) / h;
}

static void every_listed_kink_is_one(void) {
    pair pairs[PAIRS];
    all_pairs(pairs);
    for (int i = 0; i < PAIRS; ++i)
        for (int j = 0; j < slices_of(pairs + i); ++j) {
            const pair *p = pairs + i;
            double c = slice_c[j], angles[ENVMAPI_KINKS], sigma = o_sigma(p->oracle, c);
            int count = envmapi_lobe_kinks(angles, &p->lobe, c);
            CHECK(count >= 0 && count <= 2);
            for (int n = 0; n < count; ++n) {
                double h = 1e-4 * sigma, once = bend(p, angles[n], c, h);
                if (!CHECK(once > 0 && bend(p, angles[n], c, h / 2) > 0.6 * once))
                    printf("    %s c %g: %g is no kink\n", p->name, c, angles[n]);
            }
        }
}

static void every_kink_is_listed(void) {
    pair pairs[PAIRS];
    all_pairs(pairs);
    for (int i = 0; i < PAIRS; ++i)
        for (int j = 0; j < slices_of(pairs + i); ++j) {
            const pair *p = pairs + i;
            double c = slice_c[j], angles[ENVMAPI_KINKS], mine[8];
            int count = envmapi_lobe_kinks(angles, &p->lobe, c);
            int expected = o_kinks(mine, p->oracle, c);
            if (p->oracle.kind == O_GGX && p->oracle.n < 0.002)
                continue; /* below 1e-12 of the peak */
            for (int m = 0; m < expected; ++m) {
                double nearest = 10;
                for (int n = 0; n < count; ++n)
                    if (fabs(angles[n] - mine[m]) < nearest) nearest = fabs(angles[n] - mine[m]);
                if (!CHECK(nearest <= 1e-7))
                    printf("    %s c %g: the kink at %g is not listed\n", p->name, c, mine[m]);
            }
        }
}

static double flat(double x, double p, void *user) {
    (void)x, (void)p, (void)user;
    return 1;
}

static void a_functions_kinks_are_its_own_up_to_the_room(void) {
    double angles[ENVMAPI_KINKS];
    float many[ENVMAPI_KINKS + 3];
    envmap_lobe smooth = envmap_lobe_gaussian(3), lobe = envmap_lobe_function(flat, NULL);
    for (int i = 0; i < ENVMAPI_KINKS + 3; ++i) many[i] = (float)(i + 1) / 32;
    lobe.kinks = many, lobe.kink_count = 3;
    CHECK(envmapi_lobe_kinks(angles, &lobe, 0) == 3);
    for (int i = 0; i < 3; ++i) CHECK_CLOSE(angles[i], many[i], 0);
    lobe.kink_count = ENVMAPI_KINKS + 3;
    CHECK(envmapi_lobe_kinks(angles, &lobe, 0) == ENVMAPI_KINKS);
    CHECK_CLOSE(envmap_lobe_integral(&lobe, 0), 4 * PI, 1e-12); /* with all its panels */
    CHECK(envmapi_lobe_kinks(angles, &smooth, 0) == 0);
}

/* ---------------------------------------------------------------------- zonal coefficients ---- */

enum { BANDS = 257 };

static double zonal_error(const envmap_lobe *lobe, o_lobe oracle, double c) {
    double lambda[BANDS], mine[BANDS], worst = 0, norm = o_norm(oracle, c);
    if (!CHECK(envmap_lobe_zonal(lambda, BANDS, lobe, c) == ENVMAP_OK)) return 1;
    o_moments(mine, BANDS, oracle, c, 1);
    for (int l = 0; l < BANDS; ++l) {
        double error = fabs(lambda[l] - mine[l] / norm);
        if (!(error <= worst)) worst = error;
    }
    return worst;
}

/* The largest of lobes of one kind, at p = 0. */
static double largest_zonal_error(int kind, const float *parameters, int count) {
    double worst = 0;
    for (int i = 0; i < count; ++i) {
        pair p = make(kind, parameters[i]);
        double error = zonal_error(&p.lobe, p.oracle, 0);
        if (!(error <= worst)) worst = error;
    }
    return worst;
}

static void zonal_coefficients_of_phong_follow_the_recurrence(void) {
    static const float N[] = {0, 1, 10, 100, 1000};
    double worst = 0;
    for (int i = 0; i < 5; ++i) {
        envmap_lobe lobe = envmap_lobe_phong(N[i]);
        double lambda[BANDS], n = (double)N[i], expected[BANDS];
        if (!CHECK(envmap_lobe_zonal(lambda, BANDS, &lobe, 0) == ENVMAP_OK)) return;
        expected[0] = 1;
        expected[1] = (n + 1) / (n + 2);
        for (int l = 0; l + 2 < BANDS; ++l) expected[l + 2] = expected[l] * (n - l) / (n + l + 3);
        for (int l = 0; l < BANDS; ++l)
            if (!(fabs(lambda[l] - expected[l]) <= worst)) worst = fabs(lambda[l] - expected[l]);
    }
    FIGURE("lambda_l of Phong N = 0 .. 1000 against the recurrence", worst, 1e-14);
}

static void zonal_coefficients_of_phong_agree_with_quadrature(void) {
    static const float N[8] = {0, 0.5f, 1, 2.5f, 10, 100, 1000, 1e6f};
    FIGURE("lambda_l of Phong N = 0 .. 1e6 against quadrature, l <= 256",
           largest_zonal_error(O_PHONG, N, 8), 1e-11);
}

static void zonal_coefficients_of_diffuse_are_1_2_thirds_1_quarter_0(void) {
    static const double expected[5] = {1, 2.0 / 3, 0.25, 0, -1.0 / 24};
    static const double half[5] = {1, 0.5, 0, -0.125, 0};
    envmap_lobe diffuse = envmap_lobe_diffuse(), hemisphere = envmap_lobe_phong(0);
    double a[5] = {9, 9, 9, 9, 9}, b[5] = {9, 9, 9, 9, 9};
    CHECK(envmap_lobe_zonal(a, 5, &diffuse, 0) == ENVMAP_OK);
    CHECK(envmap_lobe_zonal(b, 5, &hemisphere, 0) == ENVMAP_OK);
    for (int l = 0; l < 5; ++l) {
        CHECK_CLOSE(a[l], expected[l], 1e-15);
        CHECK_CLOSE(b[l], half[l], 1e-15);
    }
}

static void zonal_coefficients_of_gaussian_agree_with_quadrature(void) {
    static const float L[6] = {0, 0.01f, 1, 100, 1e4f, 1e6f};
    double first = 0;
    for (int i = 0; i < 6; ++i) {
        pair p = make(O_GAUSSIAN, L[i]);
        double lambda = (double)L[i], l1[2];
        if (!CHECK(envmap_lobe_zonal(l1, 2, &p.lobe, 0) == ENVMAP_OK)) continue;
        double langevin = lambda < 0.1 ? lambda / 3 - lambda * lambda * lambda / 45
                                       : 1 / tanh(lambda) - 1 / lambda;
        if (!(fabs(l1[1] - langevin) <= first)) first = fabs(l1[1] - langevin);
    }
    FIGURE("lambda_1 of Gaussian against coth L - 1/L", first, 1e-10);
    FIGURE("lambda_l of Gaussian L = 0 .. 1e6 against quadrature, l <= 256",
           largest_zonal_error(O_GAUSSIAN, L, 6), 1e-11);
}

static void zonal_coefficients_of_ggx_agree_with_quadrature(void) {
    static const float alpha[6] = {1, 0.5f, 0.25f, 0.1f, 0.01f, 1e-3f};
    FIGURE("lambda_l of GGX alpha = 1 .. 1e-3 against quadrature, l <= 256",
           largest_zonal_error(O_GGX, alpha, 6), 1e-10);
}

static void zonal_coefficients_of_banks_agree_with_quadrature_for_every_slice(void) {
    static const float s[] = {0, 0.3f, 0.7f, 0.99f, 0.9999f};
    double worst = 0;
    for (int i = 0; i < 5; ++i) {
        pair p = make(O_BANKS, s[i]);
        for (int j = 0; j < SLICES; ++j) {
            double error = zonal_error(&p.lobe, p.oracle, slice_c[j]);
            if (!(error <= worst)) worst = error;
        }
    }
    FIGURE("lambda_l of Banks, nine slices, against quadrature, l <= 256", worst, 1e-10);
}

/* A thin ring at angle g has the coefficients of a delta on it: sin g P_l(cos g), Banks' norm at
   c = 0 being that of the equator. */
static void zonal_coefficients_of_a_thin_ring_are_legendre_polynomials(void) {
    envmap_lobe banks = envmap_lobe_banks(0.99999f);
    double lambda[40], c = 0.6, g = o_ring(c), x = cos(g), p0 = 1, p1 = x, worst = 0;
    if (!CHECK(envmap_lobe_zonal(lambda, 40, &banks, c) == ENVMAP_OK)) return;
    for (int l = 0; l < 40; ++l) {
        double error = fabs(lambda[l] - sin(g) * p0);
        if (!(error <= worst)) worst = error;
        double p2 = ((2 * l + 3) * x * p1 - (l + 1) * p0) / (l + 2);
        p0 = p1;
        p1 = p2;
    }
    FIGURE("lambda_l of a ring of half-width 4.5e-3, l < 40, against P_l", worst, 5e-3);
}

static double copied(double x, double p, void *user) {
    const o_lobe *lobe = (const o_lobe *)user;
    return (double)o_k(*lobe, (long double)acos(x < 1 ? x > -1 ? x : -1 : 1), p);
}

static void zonal_coefficients_of_a_function_equal_those_of_the_lobe_it_copies(void) {
    static const float horizon[] = {1.57079632679f};
    double worst = 0;
    for (int i = 0; i < 5; ++i) {
        pair p = i == 0   ? make(O_GAUSSIAN, 50)
                 : i == 1 ? make(O_PHONG, 1)
                 : i == 2 ? make(O_PHONG, 100)
                 : i == 3 ? make(O_GAUSSIAN, 1e4f)
                          : make(O_GGX, 0.25f);
        envmap_lobe copy = envmap_lobe_function(copied, &p.oracle);
        if (i == 1 || i == 4) {
            copy.kinks = horizon;
            copy.kink_count = 1;
        }
        double error = zonal_error(&copy, p.oracle, 0);
        printf("    a function copying %-36s %.3g\n", p.name, error);
        if (!(error <= worst)) worst = error;
    }
    FIGURE("lambda_l of function lobes against quadrature, l <= 256", worst, 1e-7);
}

static double glossier(double x, double p, void *user) {
    (void)user;
    return exp(20 * (2 + p) * (x - 1));
}

static void functions_and_tables_with_p_follow_it(void) {
    envmap_lobe lobe = envmap_lobe_function(glossier, NULL);
    lobe.p0 = -1;
    lobe.p1 = 1;
    for (int i = 0; i < 3; ++i) {
        o_lobe oracle = {O_GAUSSIAN, 0};
        double p = -0.5 + 0.5 * i;
        oracle.n = 20 * (2 + p);
        CHECK_CLOSE(envmap_lobe_value(&lobe, 0.9, p), exp(oracle.n * -0.1), 1e-14);
        CHECK_CLOSE(envmap_lobe_integral(&lobe, p) / o_integral(oracle, 0), 1, 1e-9);
        CHECK_CLOSE(envmap_lobe_sigma(&lobe, p) / o_sigma(oracle, 0), 1, 1e-3);
        CHECK(zonal_error(&lobe, oracle, p) <= 1e-8);
    }
    /* rows of a table stand at the slices' centres, are linear between and clamp at the ends */
    enum { SIZE = 65 };
    float table[2 * SIZE];
    for (int i = 0; i < SIZE; ++i) {
        table[i] = (float)exp(3 * (cos(PI * i / (SIZE - 1)) - 1));
        table[SIZE + i] = 2 * table[i];
    }
    lobe = envmap_lobe_table(table, SIZE, 2, 0, 1);
    double one = (double)table[10], x = cos(PI * 10 / (SIZE - 1));
    CHECK_CLOSE(envmap_lobe_value(&lobe, x, 0.25), one, 1e-6);
    CHECK_CLOSE(envmap_lobe_value(&lobe, x, 0.75), 2 * one, 1e-6);
    CHECK_CLOSE(envmap_lobe_value(&lobe, x, 0.5), 1.5 * one, 1e-6);
    CHECK_CLOSE(envmap_lobe_value(&lobe, x, 0), one, 1e-6);
    CHECK_CLOSE(envmap_lobe_value(&lobe, x, 1), 2 * one, 1e-6);
}

static void zonal_coefficients_of_a_table_equal_those_of_the_lobe_it_copies(void) {
    enum { SIZE = 4097 };
    float *table = (float *)malloc(SIZE * sizeof(float));
    double smooth = 0, kinked = 0, value = 0;
    unsigned long long state = 5;
    for (int i = 0; i < 4; ++i) {
        pair p = i == 0   ? make(O_GAUSSIAN, 50)
                 : i == 1 ? make(O_PHONG, 100)
                 : i == 2 ? make(O_GAUSSIAN, 1)
                          : make(O_PHONG, 1);
        for (int n = 0; n < SIZE; ++n)
            table[n] = (float)o_k(p.oracle, (long double)(PI * n / (SIZE - 1)), 0);
        envmap_lobe lobe = envmap_lobe_table(table, SIZE, 1, 0, 0);
        for (int n = 0; i < 3 && n < 1000; ++n) {
            double t = PI * test_random(&state);
            double error = fabs(envmap_lobe_value(&lobe, cos(t), 0) -
                                (double)o_k(p.oracle, (long double)t, 0));
            if (!(error <= value)) value = error;
        }
        double error = zonal_error(&lobe, p.oracle, 0);
        if (i < 3 && !(error <= smooth)) smooth = error;
        if (i == 3) kinked = error;
    }
    FIGURE("tables of 4097 samples, smooth lobes: values", value, 2e-7);
    FIGURE("tables of 4097 samples, smooth lobes: lambda_l", smooth, 2e-7);
    FIGURE("tables of 4097 samples, diffuse: lambda_l", kinked, 2e-6);
    free(table);
}

static void tables_pass_through_their_samples(void) {
    static const float table[5] = {1, 0.7f, 0.4f, 0.2f, 0.1f};
    envmap_lobe lobe = envmap_lobe_table(table, 5, 1, 0, 0);
    for (int i = 0; i < 5; ++i)
        CHECK_CLOSE(envmap_lobe_value(&lobe, cos(PI * i / 4), 0), (double)table[i], 1e-6);
    /* Catmull-Rom half way: (-a + 9 b + 9 c - d) / 16 */
    CHECK_CLOSE(envmap_lobe_value(&lobe, cos(PI * 1.5 / 4), 0), (-1 + 9 * 0.7 + 9 * 0.4 - 0.2) / 16,
                1e-6);
}

static double counted(double x, double p, void *user) {
    (void)x, (void)p;
    return ++*(int *)user;
}

static void a_functions_value_is_one_call_of_it(void) {
    int calls = 0;
    envmap_lobe lobe = envmap_lobe_function(counted, &calls);
    double value = envmap_lobe_value(&lobe, 0.5, 0);
    CHECK(calls == 1 && value == 1.0);
}

static void function_and_table_lobes_know_their_support_and_sigma(void) {
    enum { SIZE = 2049 };
    float *table = (float *)malloc(SIZE * sizeof(float));
    pair p = make(O_GAUSSIAN, 50);
    for (int n = 0; n < SIZE; ++n)
        table[n] = (float)o_k(p.oracle, (long double)(PI * n / (SIZE - 1)), 0);
    envmap_lobe lobes[2] = {envmap_lobe_function(copied, &p.oracle),
                            envmap_lobe_table(table, SIZE, 1, 0, 0)};
    for (int i = 0; i < 2; ++i) {
        double from = -1, to = -1, sigma = o_sigma(p.oracle, 0);
        envmap_lobe_support(&from, &to, &lobes[i], 0);
        CHECK(from >= 0 && from < to && to <= PI + 1e-15);
        for (int n = 0; n <= 1000; ++n) {
            double t = PI * n / 1000;
            if (t < from || t > to) CHECK(envmap_lobe_value(&lobes[i], cos(t), 0) <= 1e-12);
        }
        CHECK_CLOSE(envmap_lobe_sigma(&lobes[i], 0) / sigma, 1, 1e-3);
        double angles[ENVMAPI_KINKS];
        CHECK(envmapi_lobe_kinks(angles, &lobes[i], 0) == 0);
    }
    free(table);
}

/* A Gaussian in theta about 1.2, or the same with the sign turned: sigma is its own. */
static double ring(double x, double p, void *user) {
    double t = (acos(x) - 1.2) / 0.03, k = exp(-t * t / 2);
    (void)p;
    return user ? -k : k;
}

static void a_rings_sigma_is_its_half_width_whatever_its_sign(void) {
    int minus;
    for (int i = 0; i < 2; ++i) {
        envmap_lobe lobe = envmap_lobe_function(ring, i ? &minus : NULL);
        CHECK_CLOSE(envmap_lobe_sigma(&lobe, 0) / 0.03, 1, 3e-3); /* the peak is a node near 1.2 */
    }
}

/* The same about 0.0771, wide 0.075: it falls to e^(-1/2) just before the axis. */
static double close_ring(double x, double p, void *user) {
    double t = (acos(x) - 0.0771) / 0.075;
    (void)p, (void)user;
    return exp(-t * t / 2);
}

static void a_ring_that_falls_just_before_the_axis_does_not_reach_it(void) {
    envmap_lobe lobe = envmap_lobe_function(close_ring, NULL);
    CHECK_CLOSE(envmap_lobe_sigma(&lobe, 0) / 0.075, 1, 3e-3);
}

static void zonal_coefficients_are_finite_and_at_most_one(void) {
    pair pairs[PAIRS];
    double *lambda = (double *)malloc(4096 * sizeof(double));
    all_pairs(pairs);
    for (int i = 0; i < PAIRS; ++i) {
        int banks = pairs[i].oracle.kind == O_BANKS;
        int bands = pairs[i].oracle.kind < O_GGX ? 4096 : 600;
        if (!CHECK(envmap_lobe_zonal(lambda, bands, &pairs[i].lobe, banks ? 0.3 : 0) ==
                   ENVMAP_OK)) {
            printf("    %s\n", pairs[i].name);
            continue;
        }
        int bad = 0;
        for (int l = 0; l < bands; ++l) bad += !(fabs(lambda[l]) <= 1 + 1e-9);
        if (!CHECK(bad == 0)) printf("    %s: %d coefficients\n", pairs[i].name, bad);
        if (!banks) CHECK_CLOSE(lambda[0], 1, 1e-12);
    }
    free(lambda);
}

/* ----------------------------------------------------------------------------------- bands ---- */

/* The least number of bands whose tail is within tolerance, by Parseval:
   sum (2l+1) lambda_l^2 = 4 pi (2 pi integral of k^2 dx) / norm^2. */
static int bands_needed(const pair *p, double c, const double *lambda, int most, double tolerance) {
    double total, norm = o_norm(p->oracle, c), head = 0;
    o_moments(&total, 1, p->oracle, c, 2);
    total *= 4 * PI / (norm * norm);
    for (int l = 0; l < most; ++l) {
        head += (2 * l + 1) * lambda[l] * lambda[l];
        if (total - head <= tolerance * tolerance * total) return l + 1;
    }
    return most;
}

static void beyond_the_bands_the_tail_is_below_the_tolerance(void) {
    enum { MOST = 4096 };
    static const double tolerances[] = {1e-1, 1e-2, 1e-3};
    pair pairs[12] = {make(O_PHONG, 0),      make(O_PHONG, 1),    make(O_PHONG, 10),
                      make(O_PHONG, 1000),   make(O_PHONG, 1e6f), make(O_GAUSSIAN, 1),
                      make(O_GAUSSIAN, 100), make(O_GGX, 1),      make(O_GGX, 0.1f),
                      make(O_BANKS, 0),      make(O_BANKS, 0.7f), make(O_BANKS, 0.99f)};
    double *lambda = (double *)malloc(MOST * sizeof(double));
    for (int i = 0; i < 12; ++i) {
        const pair *p = pairs + i;
        int slices = p->oracle.kind == O_BANKS ? 2 : 1, needed[3] = {1, 1, 1};
        for (int k = 0; k < slices; ++k) {
            double c = p->oracle.kind == O_BANKS ? -1 + 2 * (k + 0.5) / slices : 0;
            if (!CHECK(envmap_lobe_zonal(lambda, MOST, &p->lobe, c) == ENVMAP_OK)) continue;
            for (int j = 0; j < 3; ++j) {
                int n = bands_needed(p, c, lambda, MOST, tolerances[j]);
                if (n > needed[j]) needed[j] = n;
            }
        }
        for (int j = 0; j < 3; ++j) {
            int bands = 0;
            for (int k = 0; k < slices; ++k) {
                double c = slices > 1 ? -1 + 2 * (k + 0.5) / slices : 0;
                int n = envmap_sh_bands(&p->lobe, c, NULL, 0, tolerances[j]);
                if (n > bands) bands = n;
            }
            CHECK(bands >= 1 && bands <= MOST);
            if (!CHECK(bands >= needed[j]) || !CHECK(bands <= 1 + needed[j] * 1.02))
                printf("    %s tolerance %g: %d bands, needed %d\n", p->name, tolerances[j], bands,
                       needed[j]);
        }
    }
    free(lambda);
}

static void bands_of_bad_requests_are_0(void) {
    envmap_lobe good = envmap_lobe_phong(10), bad = envmap_lobe_phong(-1);
    CHECK(envmap_sh_bands(&good, 0, NULL, 0, 1e-3) > 0);
    CHECK(envmap_sh_bands(&bad, 0, NULL, 0, 1e-3) == 0);
    CHECK(envmap_sh_bands(NULL, 0, NULL, 0, 1e-3) == 0);
    CHECK(envmap_sh_bands(&good, (double)NAN, NULL, 0, 1e-3) == 0);
}

/* --------------------------------------------------------------------------------- bad ones ----
 */

static double returns_nan(double x, double p, void *user) {
    (void)p;
    (void)user;
    return x > 0.5 ? (double)NAN : 1;
}
static double returns_infinity(double x, double p, void *user) {
    (void)p;
    (void)user;
    return x > 0.5 ? (double)INFINITY : 1;
}
static double returns_minus_one(double x, double p, void *user) {
    (void)x;
    (void)p;
    (void)user;
    return -1;
}
static double returns_zero(double x, double p, void *user) {
    (void)x;
    (void)p;
    (void)user;
    return 0;
}
static double returns_odd(double x, double p, void *user) {
    (void)p;
    (void)user;
    return x;
}

enum { BAD = 41 };
static void bad_lobes(envmap_lobe bad[BAD]) {
    static const float table[8] = {1, 1, 1, 1, 1, 1, 1, 1}, holed[4] = {1, NAN, 1, 1};
    static const float black[4] = {0, 0, 0, 0}, wide[4] = {1, INFINITY, 1, 1};
    static const float nowhere[1] = {NAN};
    int n = 0;
    bad[n++] = envmap_lobe_phong(-1);
    bad[n++] = envmap_lobe_phong(-1e-6f);
    bad[n++] = envmap_lobe_phong(NAN);
    bad[n++] = envmap_lobe_phong(INFINITY);
    bad[n++] = envmap_lobe_phong(1.1e9f);
    bad[n++] = envmap_lobe_gaussian(-1);
    bad[n++] = envmap_lobe_gaussian(NAN);
    bad[n++] = envmap_lobe_gaussian(INFINITY);
    bad[n++] = envmap_lobe_gaussian(2e9f);
    bad[n++] = envmap_lobe_ggx(-0.5f);
    bad[n++] = envmap_lobe_ggx(1.5f);
    bad[n++] = envmap_lobe_ggx(NAN);
    bad[n++] = envmap_lobe_ggx(INFINITY);
    bad[n++] = envmap_lobe_banks(1);
    bad[n++] = envmap_lobe_banks(0.999999f);
    bad[n++] = envmap_lobe_banks(-0.1f);
    bad[n++] = envmap_lobe_banks(2);
    bad[n++] = envmap_lobe_banks(NAN);
    bad[n++] = envmap_lobe_banks(-INFINITY);
    bad[n++] = envmap_lobe_function(NULL, NULL);
    bad[n++] = envmap_lobe_function(returns_nan, NULL);
    bad[n++] = envmap_lobe_function(returns_infinity, NULL);
    bad[n++] = envmap_lobe_function(returns_minus_one, NULL);
    bad[n++] = envmap_lobe_function(returns_zero, NULL);
    bad[n++] = envmap_lobe_function(returns_odd, NULL);
    bad[n++] = envmap_lobe_table(NULL, 8, 1, 0, 0);
    bad[n++] = envmap_lobe_table(table, 3, 1, 0, 0);
    bad[n++] = envmap_lobe_table(table, 0, 1, 0, 0);
    bad[n++] = envmap_lobe_table(table, -8, 1, 0, 0);
    bad[n++] = envmap_lobe_table(table, 8, 0, 0, 0);
    bad[n++] = envmap_lobe_table(holed, 4, 1, 0, 0);
    bad[n++] = envmap_lobe_table(wide, 4, 1, 0, 0);
    bad[n++] = envmap_lobe_table(black, 4, 1, 0, 0);
    bad[n] = envmap_lobe_phong(10);
    bad[n++].kind = -1;
    bad[n] = envmap_lobe_phong(10);
    bad[n++].kind = ENVMAP_LOBE_KIND_COUNT;
    bad[n] = envmap_lobe_phong(10);
    bad[n].raw = 1;
    bad[n++].scale = NAN;
    bad[n] = envmap_lobe_banks(0.5f);
    bad[n++].p0 = NAN;
    bad[n] = envmap_lobe_banks(0.5f); /* p is a cosine */
    bad[n++].p0 = -1.01f;
    bad[n] = envmap_lobe_banks(0.5f);
    bad[n++].p1 = 1e30f;
    bad[n] = envmap_lobe_function(glossier, NULL);
    bad[n++].kink_count = 2;
    bad[n] = envmap_lobe_function(glossier, NULL);
    bad[n].kinks = nowhere;
    bad[n++].kink_count = 1;
    if (n != BAD) CHECK(0);
}

static void bad_lobes_are_refused_and_answer_0(void) {
    envmap_lobe bad[BAD];
    envmap src = {0}, dst = {0};
    CHECK(envmap_create(&src, ENVMAP_CUBE, 4, 1, 1) == ENVMAP_OK);
    CHECK(envmap_create(&dst, ENVMAP_CUBE, 2, 1, 2) == ENVMAP_OK);
    for (int i = 0; src.texels && i < 6 * 4 * 4 * 3; ++i) src.texels[i] = 1;
    bad_lobes(bad);
    for (int i = 0; i < BAD; ++i) {
        double lambda[4] = {-7, -7, -7, -7}, from = 0, to = 0;
        float *texel = envmap_texel(&dst, 0, 1, 5, 1, 1);
        if (!CHECK(texel != NULL)) break;
        *texel = -7;
        int ok = CHECK(envmap_lobe_zonal(lambda, 4, &bad[i], 0) == ENVMAP_ERROR_LOBE);
        for (int l = 0; l < 4; ++l) ok &= CHECK(lambda[l] < -6);
        ok &= CHECK(envmap_filter(&dst, &src, &bad[i], NULL) == ENVMAP_ERROR_LOBE);
        ok &= CHECK(*texel < -6);
        ok &= CHECK(envmap_sh_bands(&bad[i], 0, NULL, 0, 1e-3) == 0);
        /* the queries need not integrate a function or read a table to its end, but stay finite */
        int known = bad[i].kind != ENVMAP_LOBE_FUNCTION && bad[i].kind != ENVMAP_LOBE_TABLE;
        double answers[3];
        answers[0] = envmap_lobe_value(&bad[i], 0.9, 0);
        answers[1] = envmap_lobe_integral(&bad[i], 0);
        answers[2] = envmap_lobe_sigma(&bad[i], 0);
        known |= (bad[i].kind == ENVMAP_LOBE_FUNCTION && !bad[i].function);
        known |= (bad[i].kind == ENVMAP_LOBE_TABLE && (!bad[i].table || bad[i].table_size < 4));
        for (int n = 0; n < 3 && known; ++n) ok &= CHECK(answers[n] == 0.0);
        envmap_lobe_support(&from, &to, &bad[i], 0);
        if (known) ok &= CHECK(from == 0.0 && to == 0.0);
        if (!ok) printf("    bad lobe %d (kind %d)\n", i, bad[i].kind);
    }
    envmap_free(&src);
    envmap_free(&dst);
}

static void queries_of_null_and_nan_answer_0(void) {
    envmap_lobe good = envmap_lobe_phong(10), banks = envmap_lobe_banks(0.5f);
    double lambda[2] = {-7, -7}, from = 5, to = 5;
    CHECK(envmap_lobe_value(NULL, 1, 0) == 0.0);
    CHECK(envmap_lobe_integral(NULL, 0) == 0.0);
    CHECK(envmap_lobe_sigma(NULL, 0) == 0.0);
    envmap_lobe_support(&from, &to, NULL, 0);
    CHECK(from == 0.0 && to == 0.0);
    envmap_lobe_support(NULL, NULL, &good, 0);
    CHECK(envmap_lobe_value(&good, (double)NAN, 0) == 0.0);
    CHECK(envmap_lobe_value(&banks, 0.5, (double)NAN) == 0.0);
    CHECK(envmap_lobe_integral(&banks, 1.01) == 0.0 && envmap_lobe_value(&banks, -1, -1e30) == 0.0);
    CHECK(envmap_lobe_zonal(lambda, 2, &banks, 1e30) == ENVMAP_ERROR_LOBE);
    CHECK(envmap_lobe_value(&banks, -1, 1 + 1e-7) > 1.9); /* a cosine, but for rounding */
    static const float row[8] = {1, 0.5f, 0.2f, 0, 1, 1, 1, 1};
    envmap_lobe table = envmap_lobe_table(row, 4, 2, 0, 1);
    CHECK(envmap_lobe_value(&table, (double)NAN, 0) == 0.0);
    CHECK(envmap_lobe_value(&table, 0.5, (double)NAN) == 0.0);
    CHECK(envmap_lobe_integral(&table, (double)INFINITY) == 0.0);
    CHECK(envmap_lobe_sigma(&table, (double)NAN) == 0.0);
    CHECK(envmap_lobe_zonal(NULL, 2, &good, 0) == ENVMAP_ERROR_ARGUMENT);
    CHECK(envmap_lobe_zonal(lambda, 2, NULL, 0) == ENVMAP_ERROR_ARGUMENT);
    CHECK(envmap_lobe_zonal(lambda, 0, &good, 0) == ENVMAP_ERROR_ARGUMENT);
    CHECK(envmap_lobe_zonal(lambda, -1, &good, 0) == ENVMAP_ERROR_ARGUMENT);
    CHECK(envmap_lobe_zonal(lambda, 4097, &good, 0) == ENVMAP_ERROR_ARGUMENT);
    CHECK(lambda[0] < -6 && lambda[1] < -6);
    envmap_lobe mirror = envmap_lobe_mirror();
    CHECK(envmap_lobe_value(&mirror, 1, 0) == 0.0);
    CHECK(envmap_lobe_integral(&mirror, 0) == 0.0);
}

static double nearly_odd(double x, double p, void *user) {
    (void)p;
    return x + *(const double *)user;
}

/* Its integral is 4 pi times the excess, where that of |k| is 2 pi. */
static void lobes_that_cancel_to_a_millionth_are_used_and_to_rounding_are_not(void) {
    double excess[2] = {1e-6, 1e-11}, lambda[3];
    envmap_lobe used = envmap_lobe_function(nearly_odd, excess);
    envmap_lobe refused = envmap_lobe_function(nearly_odd, excess + 1);
    CHECK(envmap_lobe_zonal(lambda, 3, &used, 0) == ENVMAP_OK);
    CHECK(envmap_lobe_zonal(lambda, 3, &refused, 0) == ENVMAP_ERROR_LOBE);
}

/* Every query, with every odd number in every place; a table's room ends where malloc's does, which
   the address sanitizer watches. */
static void queries_of_odd_numbers_stay_in_range(void) {
    const double odd[] = {(double)NAN, HUGE_VAL, -HUGE_VAL, 1e300, -1e300, 1e19,
                                 -3e9,        2,        0,         -1,    0.3};
    enum { ODD = sizeof odd / sizeof *odd };
    float *rows = (float *)malloc(15 * sizeof *rows);
    int asked = 0, bad = 0;
    for (int i = 0; rows && i < 15; ++i) rows[i] = (float)(i % 5);
    for (int i = 0; rows && i < ODD * ODD * ODD * 8; ++i) {
        int kind = i % 8 - 1, a = i / 8 % ODD, b = i / 8 / ODD % ODD, c = i / 8 / ODD / ODD;
        envmap_lobe lobe = envmap_lobe_table(rows, 5, 3, 0, 1);
        double from, to, x = odd[b], p = odd[c];
        lobe.function = flat, lobe.kind = kind, lobe.parameter = (float)odd[a];
        if (b % 2) lobe.p0 = (float)(odd[a] / 2), lobe.p1 = (float)odd[b - 1];
        double value = envmap_lobe_value(&lobe, x, p), sigma = envmap_lobe_sigma(&lobe, p);
        double integral = envmap_lobe_integral(&lobe, p);
        envmap_lobe_support(&from, &to, &lobe, p);
        bad += !isfinite(value) || !isfinite(integral) || !(sigma >= 0 && sigma <= PI);
        bad += !(from >= 0 && from <= to && to <= PI);
        asked += sigma > 0;
    }
    CHECK(asked > 500 && bad == 0);
    free(rows);
}

/* As floats, whatever precision the machine computes in. */
static int same_float(float a, float b) { return !memcmp(&a, &b, sizeof a); }

static void ggx_of_alpha_0_is_the_mirror_and_what_is_below_1e_4_counts_as_1e_4(void) {
    CHECK(envmap_lobe_ggx(0).kind == ENVMAP_LOBE_MIRROR);
    CHECK(envmap_lobe_ggx(1e-9f).kind == ENVMAP_LOBE_GGX);
    CHECK(same_float(envmap_lobe_ggx(1e-9f).parameter, 1e-4f));
    CHECK(same_float(envmap_lobe_ggx(9e-5f).parameter, 1e-4f));
    CHECK(same_float(envmap_lobe_ggx(2e-4f).parameter, 2e-4f));
}

/* Rounding may push |x| past 1 and |p| past 1: that is the end of the range, not NaN. */
static void arguments_past_one_by_a_rounding_are_one(void) {
    double past = 1 + 4e-16;
    pair pairs[PAIRS];
    all_pairs(pairs);
    for (int i = 0; i < PAIRS; ++i) {
        const envmap_lobe *lobe = &pairs[i].lobe;
        for (int sign = -1; sign <= 1; sign += 2) {
            double one = envmap_lobe_value(lobe, sign, 1),
                   value = envmap_lobe_value(lobe, sign * past, past);
            if (!CHECK(fabs(value - one) <= 1e-6 * (1 + fabs(one))))
                printf("    %s at %d: %g, not %g\n", pairs[i].name, sign, value, one);
        }
    }
}

int main(void) {
    RUN(lobes_know_their_values);
    RUN(lobes_know_their_values_at_the_edges);
    RUN(raw_lobes_carry_their_scale);
    RUN(lobes_know_their_integrals);
    RUN(integrals_have_their_closed_forms);
    RUN(lobes_know_their_width);
    RUN(a_functions_width_is_that_of_its_peak_wherever_it_is);
    RUN(outside_its_support_a_lobe_is_below_1e_12_of_its_peak);
    RUN(every_listed_kink_is_one);
    RUN(every_kink_is_listed);
    RUN(a_functions_kinks_are_its_own_up_to_the_room);
    RUN(zonal_coefficients_of_phong_follow_the_recurrence);
    RUN(zonal_coefficients_of_phong_agree_with_quadrature);
    RUN(zonal_coefficients_of_diffuse_are_1_2_thirds_1_quarter_0);
    RUN(zonal_coefficients_of_gaussian_agree_with_quadrature);
    RUN(zonal_coefficients_of_ggx_agree_with_quadrature);
    RUN(zonal_coefficients_of_banks_agree_with_quadrature_for_every_slice);
    RUN(zonal_coefficients_of_a_thin_ring_are_legendre_polynomials);
    RUN(zonal_coefficients_of_a_function_equal_those_of_the_lobe_it_copies);
    RUN(functions_and_tables_with_p_follow_it);
    RUN(zonal_coefficients_of_a_table_equal_those_of_the_lobe_it_copies);
    RUN(tables_pass_through_their_samples);
    RUN(a_functions_value_is_one_call_of_it);
    RUN(function_and_table_lobes_know_their_support_and_sigma);
    RUN(a_rings_sigma_is_its_half_width_whatever_its_sign);
    RUN(a_ring_that_falls_just_before_the_axis_does_not_reach_it);
    RUN(zonal_coefficients_are_finite_and_at_most_one);
    RUN(beyond_the_bands_the_tail_is_below_the_tolerance);
    RUN(bands_of_bad_requests_are_0);
    RUN(bad_lobes_are_refused_and_answer_0);
    RUN(queries_of_null_and_nan_answer_0);
    RUN(lobes_that_cancel_to_a_millionth_are_used_and_to_rounding_are_not);
    RUN(queries_of_odd_numbers_stay_in_range);
    RUN(ggx_of_alpha_0_is_the_mirror_and_what_is_below_1e_4_counts_as_1e_4);
    RUN(arguments_past_one_by_a_rounding_are_one);
    return test_summary();
}
