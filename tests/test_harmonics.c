/* SPDX-License-Identifier: MIT
   The transform on rings, part by part: FFT against a plain DFT, splines against waves, Legendre
   functions against their orthonormality and the addition theorem, points of light against the
   harmonics of zonal.h. These are private functions: nothing public shows them one by one. */
#define ENVMAP_IMPLEMENTATION
#include "zonal.h"

/* ----------------------------------------------------------------------------------- tools ---- */

static envmapi_pool pool;

static envmapi_rings rings_of(int M, int bands) {
    envmapi_rings rings;
    if (!CHECK(envmapi_rings_create(&rings, M, bands, &pool) == ENVMAP_OK)) exit(1);
    return rings;
}

/* The block at `row` of frequency or ring k. */
static double *cell(const envmapi_rings *rings, int k, int at) {
    return rings->G + (size_t)k * rings->row + at;
}

static double larger(double a, double b) { return b <= a ? a : b; } /* NaN wins */

/* ------------------------------------------------------------------------------------- FFT ---- */

static void rings_are_multiples_of_8_with_factors_2_and_3(void) {
    for (int least = 1; least <= 3200; ++least) {
        int M = envmapi_rings_size(least), rest = 2 * M;
        while (rest % 2 == 0) rest /= 2;
        while (rest % 3 == 0) rest /= 3;
        CHECK(M >= least && M % 8 == 0 && rest == 1);
        CHECK(envmapi_rings_size(M) == M);
        CHECK(M <= 8 || 2 * M <= 3 * least + 24); /* no more than half as many again */
    }
}

static void the_fft_is_the_plain_dft(void) {
    static const int sizes[] = {8, 16, 24, 32, 48, 72, 96, 144};
    double worst = 0;
    for (size_t i = 0; i < sizeof sizes / sizeof *sizes; ++i) {
        int M = sizes[i], n = 2 * M, block = M / 8 - 1; /* the last one */
        unsigned long long seed = 1 + i;
        envmapi_rings rings = rings_of(M, M / 2);
        double *in = (double *)malloc((size_t)n * 2 * ENVMAPI_BLOCK * sizeof(double));
        unsigned char *used = (unsigned char *)calloc((size_t)n, 1);
        for (int k = 0; k < n; ++k)
            for (int v = 0; v < 2 * ENVMAPI_BLOCK; ++v)
                in[k * 2 * ENVMAPI_BLOCK + v] = cell(
                    &rings, k, ENVMAPI_BLOCK * block + v % ENVMAPI_BLOCK)[v / ENVMAPI_BLOCK * n] =
                    test_random(&seed) - 0.5;
        double *re = cell(&rings, 0, ENVMAPI_BLOCK * block);
        envmapi_fft(&rings, re, re + n, -1);
        for (int m = 0; m < n; ++m) {
            int at = rings.place[m];
            if (!CHECK(at >= 0 && at < n && !used[at])) break;
            used[at] = 1;
            for (int v = 0; v < ENVMAPI_BLOCK; v += 5) {
                double a = 0, b = 0;
                for (int k = 0; k < n; ++k) {
                    double turn = 2 * PI * (double)((long)m * k % n) / n, c = cos(turn),
                           s = sin(turn);
                    const double *x = in + k * 2 * ENVMAPI_BLOCK + v;
                    a += x[0] * c + x[ENVMAPI_BLOCK] * s;
                    b += x[ENVMAPI_BLOCK] * c - x[0] * s;
                }
                const double *out = cell(&rings, at, ENVMAPI_BLOCK * block + v);
                worst = larger(worst, fabs(out[0] - a) / n);
                worst = larger(worst, fabs(out[n] - b) / n);
            }
        }
        free(in);
        free(used);
        envmapi_pool_free(&pool, 0);
    }
    FIGURE("FFT of 16 .. 288 points - plain DFT, per point", worst, 1e-15);
}

static void the_fft_back_undoes_the_fft(void) {
    static const int sizes[] = {8, 24, 64, 216, 384, 768};
    double worst = 0;
    for (size_t i = 0; i < sizeof sizes / sizeof *sizes; ++i) {
        int M = sizes[i], n = 2 * M;
        unsigned long long seed = 11, again = 11;
        envmapi_rings rings = rings_of(M, 1);
        for (int k = 0; k < n; ++k)
            for (int v = 0; v < 4 * M; ++v) *cell(&rings, k, v) = test_random(&seed) - 0.5;
        for (int block = 0; block < M / 8; ++block) {
            double *re = cell(&rings, 0, ENVMAPI_BLOCK * block);
            envmapi_fft(&rings, re, re + n, -1);
            envmapi_fft(&rings, re, re + n, 1);
        }
        for (int k = 0; k < n; ++k)
            for (int v = 0; v < 4 * M; ++v)
                worst = larger(worst, fabs(*cell(&rings, k, v) / n - (test_random(&again) - 0.5)));
        envmapi_pool_free(&pool, 0);
    }
    FIGURE("FFT there and back, 16 .. 1536 points", worst, 1e-15);
}

/* ----------------------------------------------------------------------------------- spline ----
 */

static void splines_are_a_partition_of_unity(void) {
    double unity = 0, first = 0, second = 0;
    for (int i = 0; i <= 1000; ++i) {
        float w[4], f = (float)i / 1001;
        double m[3] = {0, 0, 0};
        envmapi_spline(w, f);
        for (int k = 0; k < 4; ++k)
            for (int power = 0; power < 3; ++power)
                m[power] += (double)w[k] * pow(k - 1 - (double)f, power);
        unity = larger(unity, fabs(m[0] - 1));
        first = larger(first, fabs(m[1]));
        second = larger(second, fabs(m[2] - 1.0 / 3)); /* the cubic B-spline's variance */
        for (int k = 0; k < 4; ++k) CHECK(w[k] >= 0);
    }
    FIGURE("|sum of spline weights - 1|", unity, 2e-7);
    FIGURE("their first moment about the point", first, 4e-7);
    FIGURE("their variance - 1/3", second, 8e-7);
}

/* A wave of f cycles a sample, its samples prefiltered by the response and interpolated. */
static double measured_spline_error(double f) {
    double response = (4 + 2 * cos(2 * PI * f)) / 6, square = 0;
    int n = 64;
    for (int i = 0; i < n; ++i) {
        float w[4];
        double at = (i + 0.5) / n, re = -cos(2 * PI * f * at), im = -sin(2 * PI * f * at);
        envmapi_spline(w, (float)at);
        for (int k = 0; k < 4; ++k) {
            re += (double)w[k] * cos(2 * PI * f * (k - 1)) / response;
            im += (double)w[k] * sin(2 * PI * f * (k - 1)) / response;
        }
        square += re * re + im * im;
    }
    return sqrt(square / n);
}

static void the_splines_error_is_what_waves_lose(void) {
    double over = 0, under = 0;
    for (int i = 2; i <= 50; ++i) {
        double f = i / 100.0, ratio = measured_spline_error(f) / envmapi_spline_error(f);
        over = larger(over, ratio);
        under = larger(under, 1 / ratio);
    }
    FIGURE("what a wave loses, up to half a cycle a sample, over its bound", over, 1.001);
    FIGURE("the bound over what a wave loses", under, 2);
    CHECK(envmapi_spline_error(0) <= 0 && envmapi_spline_error(0.7) <= 1);
}

/* ------------------------------------------------------------------------------------ atan2 ----
 */

static void atan2_is_good_to_1e_10(void) {
    double worst = 0;
    unsigned long long seed = 5;
    for (int i = 0; i < test_many(400000); ++i) {
        double turn = 2 * PI * test_random(&seed), scale = exp(40 * (test_random(&seed) - 0.5));
        double y = sin(turn) * scale, x = cos(turn) * scale;
        if (i % 3 == 0) y *= exp(-30 * test_random(&seed));
        if (i % 3 == 1) x *= exp(-30 * test_random(&seed));
        worst = larger(worst, fabs(envmapi_atan2(y, x) - atan2(y, x)));
    }
    for (int i = 0; i < 16; ++i) { /* axes, diagonals and where the polynomial turns */
        double y = sin(PI * i / 8), x = cos(PI * i / 8);
        worst = larger(worst, fabs(remainder(envmapi_atan2(y, x) - atan2(y, x), 2 * PI)));
    }
    CHECK(envmapi_atan2(0, 0) <= 0 && envmapi_atan2(0, 0) >= 0);
    CHECK_CLOSE(envmapi_atan2(0, 1), 0, 0);
    CHECK_CLOSE(envmapi_atan2(1, 0), PI / 2, 1e-15);
    CHECK_CLOSE(envmapi_atan2(-1, 0), -PI / 2, 1e-15);
    CHECK_CLOSE(fabs(envmapi_atan2(0, -1)), PI, 1e-15);
    FIGURE("envmapi_atan2 - atan2", worst, 1e-10);
}

/* --------------------------------------------------------------------------------- Legendre ----
 */

/* The northern half of the 2H-point rule, in long double, then rounded. */
static void northern_gauss(double *x, double *log_sin, double *w, int H) {
    for (int i = 0; i < H; ++i) {
        long double t = cosl(PI_L * (i + 0.75L) / (2 * H + 0.5L)), slope = 1;
        for (int step = 0; step < 20; ++step) {
            long double p0 = 1, p1 = t;
            for (int l = 2; l <= 2 * H; ++l) {
                long double p2 = ((2 * l - 1) * t * p1 - (l - 1) * p0) / l;
                p0 = p1, p1 = p2;
            }
            slope = 2 * H * (t * p1 - p0) / (t * t - 1);
            t -= p1 / slope;
            if (fabsl(p1 / slope) < 1e-19L) break;
        }
        x[i] = (double)t;
        log_sin[i] = (double)(0.5L * logl((1 - t) * (1 + t)));
        w[i] = (double)(2 / ((1 - t * t) * slope * slope));
    }
}

static void legendre_functions_are_orthonormal_to_256_bands(void) {
    int bands = 256, H = 128, step = test_many(50) > 1 ? 1 : 40;
    double w[128], worst = 0;
    envmapi_rings rings = rings_of(2 * H, bands);
    double *A = (double *)calloc((size_t)bands * 10 + (size_t)(bands * H), sizeof(double));
    double *B = A + bands, *P = B + bands, *all = P + 8 * bands;
    northern_gauss(rings.x, rings.log_sin, w, H);
    for (int m = 0; m < bands; m += m < 8 ? 1 : 9 * step) {
        envmapi_legendre_factors(A, B, m, bands);
        memset(all, 0, (size_t)(bands * H) * sizeof(double));
        for (int first = 0; first < H; first += 8)
            if (envmapi_legendre(P, &rings, m, first, A, B))
                for (int l = m; l < bands; ++l)
                    for (int b = 0; b < 8; ++b) all[l * H + first + b] = P[8 * (l - m) + b];
        for (int l = m; l < bands; ++l)
            for (int k = l; k < bands; k += 2) { /* of other parity: 0 by symmetry */
                double sum = 0;
                for (int j = 0; j < H; ++j) sum += w[j] * all[l * H + j] * all[k * H + j];
                worst = larger(worst, fabs(4 * PI * sum - (k == l)));
            }
    }
    FIGURE("Legendre functions to 256 bands: |<P, P> - 1 or 0|", worst, 1e-12);
    free(A);
    envmapi_pool_free(&pool, 0);
}

/* sum over m of P_lm^2 = (2l+1)/4pi at every ring, poles near and far: what underflows at the start
   must not be missed later. */
static void legendre_functions_obey_the_addition_theorem_to_768_bands(void) {
    int bands = test_many(50) > 1 ? 768 : 96, M = envmapi_rings_size(bands + 2), H = M / 2;
    envmapi_rings rings = rings_of(M, bands);
    double *A = (double *)calloc((size_t)bands * 18, sizeof(double));
    double *B = A + bands, *P = B + bands, *sums = P + 8 * bands, worst = 0;
    int finite = 1;
    for (int first = 0; first < H; first += first < 16 ? 8 : 40) {
        memset(sums, 0, (size_t)bands * 8 * sizeof(double));
        for (int m = 0; m < bands; ++m) {
            envmapi_legendre_factors(A, B, m, bands);
            if (!envmapi_legendre(P, &rings, m, first, A, B)) continue;
            for (int i = 0; i < 8 * (bands - m); ++i) {
                finite &= envmapi_finite(P[i]);
                sums[8 * m + i] += (m ? 2 : 1) * P[i] * P[i];
            }
        }
        for (int l = 0; l < bands; ++l)
            for (int b = 0; b < 8 && first + b < H; ++b)
                worst = larger(worst, fabs(sums[8 * l + b] * 4 * PI / (2 * l + 1) - 1));
    }
    CHECK(finite);
    FIGURE("sum over m of P_lm^2, relative, to 768 bands", worst, 1e-10);
    free(A);
    envmapi_pool_free(&pool, 0);
}

/* ------------------------------------------------------------------------------------ rings ----
 */

/* <copy g, h> = <g, fold h>, rings beyond the poles on the left. */
static void folding_over_the_poles_is_the_adjoint_of_copying(void) {
    int M = 16, n = 2 * M;
    unsigned long long seed = 21;
    envmapi_rings rings = rings_of(M, 4);
    size_t floats = (size_t)n * rings.row;
    double *g = (double *)malloc(2 * floats * sizeof(double)), *h = g + floats, left = 0, right = 0;
    for (size_t i = 0; i < floats; ++i) g[i] = test_random(&seed) - 0.5, h[i] = test_random(&seed);
    memcpy(rings.G, g, floats * sizeof(double));
    envmapi_rings_poles(&rings, 0);
    for (size_t i = 0; i < floats; ++i) left += rings.G[i] * h[i];
    for (int j = 0; j < M; ++j) /* inside, a copy changes nothing */
        for (int k = 0; k < n; ++k)
            CHECK(!memcmp(cell(&rings, k, rings.offset[j + 2]),
                          g + (size_t)k * rings.row + rings.offset[j + 2], 4 * sizeof(double)));
    for (int k = 0; k < n; ++k) /* ring -1 is ring 0 half a turn on, ring M is ring M-1 */
        for (int i = 0; i < 4; ++i) {
            static const int beyond[4] = {-1, -2, 16, 17}, inside[4] = {0, 1, 15, 14};
            CHECK(!memcmp(cell(&rings, k, rings.offset[beyond[i] + 2]),
                          cell(&rings, (k + M) % n, rings.offset[inside[i] + 2]),
                          4 * sizeof(double)));
        }
    memcpy(rings.G, h, floats * sizeof(double));
    envmapi_rings_poles(&rings, 1);
    for (int k = 0; k < n; ++k)
        for (int j = 0; j < M; ++j)
            for (int c = 0; c < 4; ++c)
                right += cell(&rings, k, rings.offset[j + 2])[c] *
                         g[(size_t)k * rings.row + (size_t)(rings.offset[j + 2] + c)];
    CHECK_CLOSE(left, right, 1e-12 * (double)floats);
    free(g);
    envmapi_pool_free(&pool, 0);
}

/* <spread v, g> = <v, interpolate g>, whatever rows the tasks take. */
static void spreading_is_the_adjoint_of_interpolating(void) {
    enum { COUNT = 500 };
    static float values[4 * COUNT], back[4 * COUNT];
    static envmapi_point points[COUNT];
    int M = 24, n = 2 * M;
    unsigned long long seed = 31;
    double left = 0, right = 0;
    envmapi_rings rings = rings_of(M, 4);
    size_t floats = (size_t)n * rings.row;
    double *g = (double *)malloc(floats * sizeof(double));
    memset(rings.G, 0, floats * sizeof(double));
    for (int i = 0; i < COUNT; ++i) {
        double d[3];
        oracle_random_direction(d, &seed);
        if (i < 8) d[0] = d[1] = 0, d[2] = i & 1 ? -1 : 1;
        if (i >= 8 && i < 12) d[1] = i & 1 ? -1e-18 : 0, d[0] = fabs(d[0]); /* the seam */
        points[i] = envmapi_rings_point(&rings, d);
        CHECK(points[i].k >= 0 && points[i].k < n && points[i].j >= -1 && points[i].j < M);
        CHECK(points[i].f_k >= 0 && points[i].f_k <= 1 && points[i].f_j >= 0 && points[i].f_j <= 1);
        for (int c = 0; c < 4; ++c) values[4 * i + c] = (float)test_random(&seed);
    }
    for (int from = 0; from < n; from += 5)
        envmapi_rings_spread(&rings, points, values, COUNT, from, from + 5 < n ? from + 5 : n);
    for (size_t i = 0; i < floats; ++i) left += rings.G[i] * (g[i] = test_random(&seed));
    memcpy(rings.G, g, floats * sizeof(double));
    envmapi_rings_interpolate(&rings, points, back, COUNT);
    for (int i = 0; i < 4 * COUNT; ++i) right += (double)values[i] * (double)back[i];
    CHECK_CLOSE(left, right, 1e-6 * COUNT);
    CHECK(right > COUNT / 2.0);
    free(g);
    envmapi_pool_free(&pool, 0);
}

/* -------------------------------------------------------------------------------- transforms ----
 */

/* One point's transform on M rings; *t then holds its coefficients. */
static void analyse_one(envmapi_transform *t, envmapi_rings *rings, const double d[3], int bands,
                        int M) {
    static float values[4] = {1, 2, 0.5f, -1};
    static envmapi_point point;
    envmap_executor serial = {NULL, NULL};
    *rings = rings_of(M, bands);
    memset(t, 0, sizeof *t);
    point = envmapi_rings_point(rings, d);
    t->rings = rings, t->points = &point, t->values = values, t->count = 1, t->a_bands = bands;
    t->work_size = 11 * (size_t)bands + (size_t)M;
    t->work = (double *)envmapi_pool_get(&pool, ENVMAPI_TASKS * t->work_size, sizeof(double));
    t->a = (double *)envmapi_pool_get(&pool, envmapi_triangle(bands, bands), sizeof(double));
    if (!CHECK(t->work && t->a)) exit(1);
    envmapi_analyse(t, &serial);
}

static void a_points_coefficients_are_the_harmonics_there(void) {
    static const double value[4] = {1, 2, 0.5, -1};
    static const double ds[5][3] = {
        {0.6, 0.48, 0.64}, {-0.28, 0, -0.96}, {0, -1, 0}, {1e-4, -1e-4, 1}, {1, 0, 0}};
    int bands = 24;
    double worst = 0;
    for (int i = 0; i < 5; ++i) {
        envmapi_transform t;
        envmapi_rings rings;
        analyse_one(&t, &rings, ds[i], bands, 384);
        for (int m = 0; m < bands; ++m)
            for (int l = m; l < bands; ++l) {
                const double *a = t.a + envmapi_triangle(bands, m) + 8 * (l - m);
                double share = m ? sqrt(0.5) : 1, size = sqrt((2 * l + 1) / (4 * PI));
                double re = share * o_harmonic(l, m, ds[i]);
                double im = m ? -share * o_harmonic(l, -m, ds[i]) : 0;
                for (int c = 0; c < 4; ++c) {
                    worst = larger(worst, fabs(a[c] - value[c] * re) / size);
                    worst = larger(worst, fabs(a[4 + c] - value[c] * im) / size);
                }
            }
        envmapi_pool_free(&pool, 0);
    }
    FIGURE("a_lm of one point, 24 bands on 384 rings", worst, 2e-5);
}

static void a_point_at_a_pole_has_zonal_coefficients_only(void) {
    int bands = 40;
    for (int south = 0; south < 2; ++south) {
        double d[3] = {0, 0, south ? -1 : 1}, worst = 0, others = 0;
        envmapi_transform t;
        envmapi_rings rings;
        analyse_one(&t, &rings, d, bands, 512);
        for (int m = 0; m < bands; ++m)
            for (int l = m; l < bands; ++l) {
                const double *a = t.a + envmapi_triangle(bands, m) + 8 * (l - m);
                double size = sqrt((2 * l + 1) / (4 * PI)), sign = south && l & 1 ? -1 : 1;
                for (int c = 0; c < 8; ++c)
                    if (m || c >= 4) others = larger(others, fabs(a[c]) / size);
                if (!m) worst = larger(worst, fabs(a[0] - sign * size) / size);
            }
        FIGURE(south ? "a_l0 of the south pole" : "a_l0 of the north pole", worst, 2e-5);
        FIGURE("a_lm of a pole, m > 0", others, 2e-5);
        envmapi_pool_free(&pool, 0);
    }
}

/* Each of L bands with lambda = 1: sum (2l+1)/4pi P_l(cos), here and there; with another lambda,
   that. */
static void a_point_synthesised_is_the_sum_of_legendre_polynomials(void) {
    enum { COUNT = 400 };
    static float out[4 * COUNT];
    static envmapi_point points[COUNT];
    static double cosines[COUNT];
    static const double ds[4][3] = {{0.6, 0.48, 0.64}, {0, 0, 1}, {0, 0, -1}, {-0.8, 0.6, 0}};
    static const int bands[4] = {1, 8, 32, 33};
    double worst = 0, lambda[40];
    unsigned long long seed = 41;
    envmap_executor serial = {NULL, NULL};
    for (int i = 0; i < 16; ++i) {
        const double *d = ds[i & 3];
        int L = bands[i >> 2];
        envmapi_transform t;
        envmapi_rings rings;
        analyse_one(&t, &rings, d, L, envmapi_rings_size(16 * L));
        for (int k = 0; k < COUNT; ++k) {
            double a[3];
            oracle_random_direction(a, &seed);
            if (k < 3)
                for (int c = 0; c < 3; ++c) a[c] = k ? (k == 1 ? -d[c] : (c == 2)) : d[c];
            points[k] = envmapi_rings_point(&rings, a);
            cosines[k] = a[0] * d[0] + a[1] * d[1] + a[2] * d[2];
        }
        for (int l = 0; l < L; ++l) lambda[l] = i < 12 ? 1 : 1 / (1.0 + l);
        t.lambda = lambda, t.points = points, t.values = out, t.count = COUNT;
        envmapi_synthesise(&t, &serial);
        for (int k = 0; k < COUNT; ++k) {
            double sum = 0, peak = 0, p0 = 1, p1 = cosines[k];
            for (int l = 0; l < L; ++l) {
                sum += lambda[l] * (2 * l + 1) / (4 * PI) * p0;
                peak += lambda[l] * (2 * l + 1) / (4 * PI);
                double p2 = ((2 * l + 3) * cosines[k] * p1 - (l + 1) * p0) / (l + 2);
                p0 = p1, p1 = p2;
            }
            worst = larger(worst, fabs((double)out[4 * k] - sum) / peak);
            worst = larger(worst, fabs((double)out[4 * k + 1] - 2 * sum) / peak / 2);
            worst = larger(worst, fabs((double)out[4 * k + 3] + sum) / peak);
        }
        envmapi_pool_free(&pool, 0);
    }
    FIGURE("one point through L bands - its Legendre series, over the peak", worst, 1e-5);
}

/* Fewer bands read from a wider triangle of coefficients: what levels that share one do. */
static void bands_of_a_larger_triangle_are_the_same_bands(void) {
    enum { COUNT = 50 };
    static float wide[4 * COUNT], narrow[4 * COUNT];
    static envmapi_point points[COUNT];
    double d[3] = {0.48, -0.6, 0.64}, lambda[40], worst = 0;
    unsigned long long seed = 51;
    envmap_executor serial = {NULL, NULL};
    for (int pass = 0; pass < 2; ++pass) {
        envmapi_transform t;
        envmapi_rings rings, few;
        analyse_one(&t, &rings, d, pass ? 12 : 40, 384);
        few = rings_of(384, 12);
        for (int k = 0; k < COUNT; ++k) {
            double a[3];
            if (!pass) oracle_random_direction(a, &seed), points[k] = envmapi_rings_point(&few, a);
        }
        for (int l = 0; l < 40; ++l) lambda[l] = 1;
        t.rings = &few, t.lambda = lambda, t.points = points, t.count = COUNT;
        t.values = pass ? narrow : wide;
        envmapi_synthesise(&t, &serial);
        envmapi_pool_free(&pool, 0);
    }
    for (int i = 0; i < 4 * COUNT; ++i)
        worst = larger(worst, fabs((double)wide[i] - (double)narrow[i]));
    FIGURE("12 bands of 40 - 12 bands", worst, 1e-6);
}

static void nothing_leaks(void) { CHECK(oracle_live == 0); }

int main(void) {
    RUN(rings_are_multiples_of_8_with_factors_2_and_3);
    RUN(the_fft_is_the_plain_dft);
    RUN(the_fft_back_undoes_the_fft);
    RUN(splines_are_a_partition_of_unity);
    RUN(the_splines_error_is_what_waves_lose);
    RUN(atan2_is_good_to_1e_10);
    RUN(legendre_functions_are_orthonormal_to_256_bands);
    RUN(legendre_functions_obey_the_addition_theorem_to_768_bands);
    RUN(folding_over_the_poles_is_the_adjoint_of_copying);
    RUN(spreading_is_the_adjoint_of_interpolating);
    RUN(a_points_coefficients_are_the_harmonics_there);
    RUN(a_point_at_a_pole_has_zonal_coefficients_only);
    RUN(a_point_synthesised_is_the_sum_of_legendre_polynomials);
    RUN(bands_of_a_larger_triangle_are_the_same_bands);
    RUN(nothing_leaks);
    return test_summary();
}
