/* SPDX-License-Identifier: MIT
   The transform on rings, part by part: FFT against a plain DFT, splines against waves, Legendre
   functions against their orthonormality and the addition theorem, points of light against the
   harmonics of zonal.h. These are private functions: nothing public shows them one by one. */
#define ENVMAP_IMPLEMENTATION
#include "zonal.h"

/* ----------------------------------------------------------------------------------- tools ---- */

static envmapi_pool pool;
static const envmap_work serial = {{NULL, NULL}, {NULL, NULL}, NULL};

/* With room for up to 16 tasks; three share the work. */
static envmapi_rings rings_of(int M, int bands) {
    envmapi_rings rings;
    if (!CHECK(envmapi_rings_create(&rings, M, bands, 1, 0, 16, NULL, &pool) == ENVMAP_OK)) exit(1);
    rings.tasks = 3;
    return rings;
}

/* A point of light, or one to look at. */
static envmapi_point point_of(const double d[3]) {
    double soa[3][ENVMAPI_CHUNK];
    envmapi_point point;
    for (int c = 0; c < 3; ++c) soa[c][0] = d[c];
    envmapi_points_of(&point, soa, 1);
    return point;
}

static double larger(double a, double b) { return b <= a ? a : b; } /* NaN wins */

/* ------------------------------------------------------------------------------------- FFT ---- */

static void rings_are_multiples_of_4_with_factors_2_and_3(void) {
    for (int least = 1; least <= 3200; ++least) {
        int M = envmapi_rings_size(least), rest = 2 * M;
        while (rest % 2 == 0) rest /= 2;
        while (rest % 3 == 0) rest /= 3;
        CHECK(M >= least && M >= 8 && M % 4 == 0 && rest == 1);
        CHECK(envmapi_rings_size(M) == M);
        CHECK(M <= 8 || 2 * M <= 3 * least); /* no more than half as many again */
    }
}

enum { ROW = 2 * ENVMAPI_BLOCK }; /* of the FFT: real parts, imaginary parts */

/* Sum over k of x[k stride] e^(sign 2 pi i m k/n). */
static void plain_dft(double out[2], const double *re, const double *im, size_t stride, int n,
                      int m, int sign) {
    out[0] = out[1] = 0;
    for (int k = 0; k < n; ++k) {
        double turn = 2 * PI * (double)((long)m * k % n) / n, c = cos(turn), s = sign * sin(turn);
        double a = re[(size_t)k * stride], b = im ? im[(size_t)k * stride] : 0;
        out[0] += a * c - b * s, out[1] += a * s + b * c;
    }
}

static void the_fft_is_the_plain_dft(void) {
    static const int sizes[] = {8, 12, 16, 24, 32, 36, 48, 72, 96, 108, 144};
    double worst = 0;
    for (size_t i = 0; i < sizeof sizes / sizeof *sizes; ++i) {
        int M = sizes[i], n = 2 * M;
        unsigned long long seed = 1 + i;
        envmapi_rings rings = rings_of(M, M / 2);
        double *in = (double *)malloc((size_t)n * 2 * ROW * sizeof(double)), *z = in + n * ROW;
        unsigned char *used = (unsigned char *)calloc((size_t)n, 1);
        for (int k = 0; k < n * ROW; ++k) z[k] = in[k] = test_random(&seed) - 0.5;
        envmapi_fft(&rings, z, -1);
        for (int m = 0; m < n; ++m) {
            int at = rings.reversed[m];
            if (!CHECK(at >= 0 && at < n && !used[at])) break;
            used[at] = 1;
            for (int v = 0; v < ENVMAPI_BLOCK; v += 5) {
                double a[2];
                plain_dft(a, in + v, in + v + ENVMAPI_BLOCK, ROW, n, m, -1);
                worst = larger(worst, fabs(z[at * ROW + v] - a[0]) / n);
                worst = larger(worst, fabs(z[at * ROW + v + ENVMAPI_BLOCK] - a[1]) / n);
            }
        }
        free(in);
        free(used);
        envmapi_pool_free(&pool, 0);
    }
    FIGURE("FFT of 16 .. 288 points - plain DFT, per point", worst, 1e-15);
}

static void the_fft_back_undoes_the_fft(void) {
    static const int sizes[] = {8, 12, 24, 36, 64, 216, 384, 768};
    double worst = 0;
    for (size_t i = 0; i < sizeof sizes / sizeof *sizes; ++i) {
        int M = sizes[i], n = 2 * M;
        unsigned long long seed = 11, again = 11;
        envmapi_rings rings = rings_of(M, 1);
        double *z = (double *)malloc((size_t)n * ROW * sizeof(double));
        for (int k = 0; k < n * ROW; ++k) z[k] = test_random(&seed) - 0.5;
        envmapi_fft(&rings, z, -1);
        envmapi_fft(&rings, z, 1);
        for (int k = 0; k < n * ROW; ++k)
            worst = larger(worst, fabs(z[k] / n - (test_random(&again) - 0.5)));
        free(z);
        envmapi_pool_free(&pool, 0);
    }
    FIGURE("FFT there and back, 16 .. 1536 points", worst, 1e-15);
}

/* The response of the spline of six taps to a wave of w radians a sample. */
static double spline_response(double w) { return (66 + 52 * cos(w) + 2 * cos(2 * w)) / 120; }

/* Everything random: what is beyond the seam and the poles must not matter. */
static float *random_rings(envmapi_rings *rings, unsigned long long seed) {
    size_t count = (2 * (size_t)rings->M + 6) * rings->row;
    float *copy = (float *)malloc(count * sizeof(float));
    for (size_t i = 0; i < count; ++i)
        copy[i] = rings->G[i] = (float)test_random(&seed) - 0.5f;
    return copy;
}

static double sample_of(const float *copy, const envmapi_rings *rings, int k, int j, int c) {
    return (double)copy[envmapi_ring(rings, k, j) - rings->G + c];
}

/* e and o of ring pair j, channel c, of F_m. */
static void pair_of(double e[2], double o[2], const double *F, int j, int c) {
    const double *f = F + 16 * j + c;
    e[0] = f[0], e[1] = f[4], o[0] = f[8], o[1] = f[12];
}

/* Rings -> F_m = DFT / response; e, o = north +- south. */
static void unpacking_separates_north_and_south(void) {
    static const int sizes[3] = {8, 12, 48};
    double worst = 0, north[2], south[2], e[2], o[2];
    for (int i = 0; i < 3; ++i) {
        int M = sizes[i], n = 2 * M, bands = M / 2;
        envmapi_rings rings = rings_of(M, bands);
        double *z = (double *)malloc((size_t)(n * ROW) * sizeof *z), wave[96], F[16 * 24];
        float *g = random_rings(&rings, 61);
        for (int block = 0; block < M / 4; ++block) {
            envmapi_rings_block(&rings, block, z, 0);
            envmapi_fft(&rings, z, -1);
            envmapi_rings_unpack(&rings, block, z);
        }
        for (int m = 0; m < bands; ++m)
            for (int j = 0; j < M / 2; ++j)
                for (int c = 0; c < 4; ++c) {
                    double r = spline_response(PI * m / M);
                    for (int k = 0; k < n; ++k) wave[k] = sample_of(g, &rings, k, j, c);
                    plain_dft(north, wave, NULL, 1, n, m, -1);
                    for (int k = 0; k < n; ++k) wave[k] = sample_of(g, &rings, k, M - 1 - j, c);
                    plain_dft(south, wave, NULL, 1, n, m, -1);
                    envmapi_rings_column(&rings, F, m);
                    pair_of(e, o, F, j, c);
                    for (int k = 0; k < 2; ++k) {
                        worst = larger(worst, fabs(e[k] - (north[k] + south[k]) / r) / n);
                        worst = larger(worst, fabs(o[k] - (north[k] - south[k]) / r) / n);
                    }
                }
        free(g);
        free(z);
        envmapi_pool_free(&pool, 0);
    }
    FIGURE("F_m, e and o, of rings - plain DFT, per point", worst, 1e-9);
}

/* e, o -> rings: g(k) = Re (F_0 + 2 sum over m > 0 of F_m e^(2 pi i m k/n)), F / response. */
static void packing_is_the_wave_of_its_frequencies(void) {
    static const int sizes[3] = {8, 12, 48};
    double worst = 0;
    for (int i = 0; i < 3; ++i) {
        int M = sizes[i], n = 2 * M, bands = M / 2;
        unsigned long long seed = 71;
        envmapi_rings rings = rings_of(M, bands);
        double *z = (double *)malloc((size_t)(n * ROW) * sizeof *z), F[24][16 * 24];
        for (int m = 0; m < bands; ++m) {
            for (int k = 0; k < 8 * M; ++k) F[m][k] = test_random(&seed) - 0.5;
            envmapi_rings_column_back(&rings, F[m], m);
        }
        for (int block = 0; block < M / 4; ++block) {
            envmapi_rings_pack(&rings, block, z);
            envmapi_fft(&rings, z, 1);
            envmapi_rings_block(&rings, block, z, 1);
        }
        for (int k = 0; k < n; ++k)
            for (int j = 0; j < M / 2; ++j)
                for (int c = 0; c < 4; ++c) {
                    double north = 0, south = 0, e[2], o[2];
                    for (int m = 0; m < bands; ++m) {
                        double turn = PI * (m * k % n) / M, re = cos(turn), im = sin(turn);
                        double w = (m ? 2 : 1) / spline_response(PI * m / M);
                        pair_of(e, o, F[m], j, c);
                        north += w * ((e[0] + o[0]) * re - (m ? e[1] + o[1] : 0) * im);
                        south += w * ((e[0] - o[0]) * re - (m ? e[1] - o[1] : 0) * im);
                    }
                    worst = larger(worst, fabs((double)envmapi_ring(&rings, k, j)[c] - north) / n);
                    south -= (double)envmapi_ring(&rings, k, M - 1 - j)[c];
                    worst = larger(worst, fabs(south) / n);
                }
        free(z);
        envmapi_pool_free(&pool, 0);
    }
    FIGURE("rings of e and o - their waves, per point", worst, 1e-7);
}

/* ----------------------------------------------------------------------------------- spline ----
 */

static void splines_are_a_partition_of_unity(void) {
    double unity = 0, first = 0, second = 0, third = 0;
    for (int i = 0; i <= 1000; ++i) {
        float w[16], v[16], f = (float)i / 1000;
        double m[4] = {0, 0, 0, 0};
        envmapi_splines(w, f, 1 - f), envmapi_splines(v, 1 - f, f);
        CHECK(!memcmp(w, v + 8, 32) && !memcmp(w + 8, v, 32));
        for (int k = 0; k < 6; ++k)
            for (int power = 0; power < 4; ++power)
                m[power] += (double)w[k] * pow(k - 2 - (double)f, power);
        unity = larger(unity, fabs(m[0] - 1));
        first = larger(first, fabs(m[1]));
        second = larger(second, fabs(m[2] - 0.5)); /* the quintic B-spline's variance */
        third = larger(third, fabs(m[3]));
        for (int k = 0; k < 6; ++k) CHECK(w[k] >= -1e-7f);
    }
    FIGURE("|sum of spline weights - 1|", unity, 2e-7);
    FIGURE("their first moment about the point", first, 4e-7);
    FIGURE("their variance - 1/2", second, 8e-7);
    FIGURE("their third moment", third, 2e-6);
}

/* A wave of f cycles a sample, its samples prefiltered by the response and interpolated. */
static double measured_spline_error(double f) {
    double response = spline_response(2 * PI * f), square = 0;
    int n = 64;
    for (int i = 0; i < n; ++i) {
        float w[16];
        double at = (i + 0.5) / n, re = -cos(2 * PI * f * at), im = -sin(2 * PI * f * at);
        envmapi_splines(w, (float)at, 0);
        for (int k = 0; k < 6; ++k) {
            re += (double)w[k] * cos(2 * PI * f * (k - 2)) / response;
            im += (double)w[k] * sin(2 * PI * f * (k - 2)) / response;
        }
        square += re * re + im * im;
    }
    return sqrt(square / n);
}

/* Waves that lose less than weights in float do can show no more than that. */
static void the_splines_error_is_what_waves_lose(void) {
    double over = 0, under = 0, grain = 0;
    for (int i = 1; i <= 50; ++i) {
        double f = i / 100.0, bound = envmapi_spline_error(f), error = measured_spline_error(f);
        if (bound < 1e-4) {
            grain = larger(grain, error - bound);
            continue;
        }
        over = larger(over, error / bound);
        under = larger(under, bound / error);
    }
    FIGURE("what a wave loses, up to half a cycle a sample, over its bound", over, 1.001);
    FIGURE("the bound over what a wave loses", under, 1.75);
    FIGURE("what slow waves lose beyond their bound", grain, 2e-7);
    for (int i = 1; i <= 3; ++i) {
        double f = i / 100.0;
        CHECK_CLOSE(envmapi_spline_error(f) / pow(f, 6), 2.6, 0.1); /* of sixth order */
    }
    CHECK(envmapi_spline_error(0) <= 0 && envmapi_spline_error(0.7) <= 1);
}

/* (1, 26, 66, 26, 1)/120 of c, of n rows that are mirrored at both ends with these signs. */
static double spline_row(const double *c, int n, int row, double first, double last) {
    static const double weights[5] = {1, 26, 66, 26, 1};
    double sum = 0;
    for (int k = 0; k < 5; ++k) {
        int i = row + k - 2;
        double sign = i < 0 ? first : i >= n ? last : 1;
        sum += weights[k] / 120 * sign * c[16 * (i < 0 ? -1 - i : i >= n ? 2 * n - 1 - i : i)];
    }
    return sum;
}

/* The pole mirrors as (-1)^m, the equator as + for e and - for o. */
static void the_solve_down_the_rings_undoes_the_spline(void) {
    static const int sizes[5] = {8, 12, 24, 96, 768};
    double worst = 0;
    for (int i = 0; i < 5; ++i)
        for (int m = 0; m < 4; ++m) {
            int H = sizes[i] / 2;
            unsigned long long seed = 81;
            envmapi_rings rings = rings_of(sizes[i], 4);
            double *f = (double *)malloc((size_t)(2 * 16 * H) * sizeof(double)), *c = f + 16 * H;
            for (int k = 0; k < 16 * H; ++k) c[k] = f[k] = test_random(&seed) - 0.5;
            envmapi_rings_solve(&rings, c, m);
            for (int k = 0; k < 16 * H; ++k)
                worst = larger(worst, fabs(spline_row(c + k % 16, H, k / 16, m & 1 ? -1 : 1,
                                                      k % 16 < 8 ? 1 : -1) -
                                           f[k]));
            free(f);
            envmapi_pool_free(&pool, 0);
        }
    FIGURE("(1, 26, 66, 26, 1)/120 of the solution - f", worst, 1e-14);
}

/* ------------------------------------------------------------------------------------ polar ----
 */

static void angles_are_good_to_1e_11_and_lengths_to_1e_12(void) {
    double worst = 0, longer = 0;
    unsigned long long seed = 5;
    double y[ENVMAPI_CHUNK], x[ENVMAPI_CHUNK], angle[ENVMAPI_CHUNK], length[ENVMAPI_CHUNK];
    for (int chunk = 0; chunk < test_many(400000) / ENVMAPI_CHUNK + 2; ++chunk) {
        for (int i = 0; i < ENVMAPI_CHUNK; ++i) {
            double turn = 2 * PI * test_random(&seed), scale = exp(40 * (test_random(&seed) - 0.5));
            y[i] = sin(turn) * scale, x[i] = cos(turn) * scale;
            if (i % 3 == 0) y[i] *= exp(-30 * test_random(&seed));
            if (i % 3 == 1) x[i] *= exp(-30 * test_random(&seed));
            if (!chunk) /* axes, diagonals and where the polynomial turns */
                y[i] = sin(PI * i / 8), x[i] = cos(PI * i / 8);
        }
        envmapi_polar(angle, length, y, x);
        for (int i = 0; i < ENVMAPI_CHUNK; ++i) {
            double off = angle[i] - atan2(y[i], x[i]), h = hypot(x[i], y[i]);
            worst = larger(worst, fabs(chunk ? off : remainder(off, 2 * PI)));
            longer = larger(longer, fabs(length[i] / h - 1));
        }
    }
    FIGURE("angle - atan2", worst, 1e-11);
    FIGURE("length / hypot - 1", longer, 1e-12);
}

static void angles_on_the_axes_are_exact(void) {
    static const double ys[5] = {0, 0, 1, -1, 0}, xs[5] = {0, 1, 0, 0, -1};
    double y[ENVMAPI_CHUNK] = {0}, x[ENVMAPI_CHUNK] = {0}, angle[ENVMAPI_CHUNK];
    double length[ENVMAPI_CHUNK];
    memcpy(y, ys, sizeof ys), memcpy(x, xs, sizeof xs);
    envmapi_polar(angle, length, y, x);
    CHECK_CLOSE(angle[0], 0, 0);
    CHECK_CLOSE(angle[1], 0, 0);
    CHECK_CLOSE(angle[2], PI / 2, 1e-15);
    CHECK_CLOSE(angle[3], -PI / 2, 1e-15);
    CHECK_CLOSE(fabs(angle[4]), PI, 1e-15);
    CHECK_CLOSE(length[0], 0, 0);
    for (int i = 1; i < 5; ++i) CHECK_CLOSE(length[i], 1, 1e-12);
}

/* Chunks of every length, directions of every length; only so many are written. */
static void points_are_where_their_angles_say(void) {
    double worst = 0, d[3][ENVMAPI_CHUNK], keep[3][ENVMAPI_CHUNK];
    unsigned long long seed = 91;
    envmapi_rings rings = rings_of(96, 4);
    envmapi_point points[ENVMAPI_CHUNK], untouched;
    memset(&untouched, 0x5A, sizeof untouched);
    for (int n = 1; n <= ENVMAPI_CHUNK; ++n) {
        memset(points, 0x5A, sizeof points);
        for (int i = 0; i < n; ++i) {
            double a[3], scale = exp(20 * (test_random(&seed) - 0.5));
            oracle_random_direction(a, &seed);
            for (int c = 0; c < 3; ++c) keep[c][i] = d[c][i] = scale * a[c];
        }
        envmapi_points_of(points, d, n);
        for (int i = 0; i < n; ++i) {
            envmapi_spot p;
            envmapi_spots(&p, &rings, points + i, 1);
            double x = keep[0][i], y = keep[1][i];
            double phi = atan2(y, x), theta = atan2(hypot(x, y), keep[2][i]);
            double k = p.k + (double)p.f_k - phi * 96 / PI;
            double j = p.j + (double)p.f_j - (theta * 96 / PI - 0.5);
            CHECK(p.k >= 0 && p.k < 192 && p.j >= -1 && p.j < 96);
            worst = larger(worst, larger(fabs(remainder(k, 192)), fabs(j)));
        }
        for (int i = n; i < ENVMAPI_CHUNK; ++i)
            CHECK(!memcmp(points + i, &untouched, sizeof untouched));
    }
    FIGURE("where points are - their angles, in rings", worst, 1e-7);
    envmapi_pool_free(&pool, 0);
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
    double *A = (double *)calloc((size_t)bands * 18 + 2 + (size_t)(bands * H), sizeof(double));
    double *B = A + bands + 1, *P = B + bands + 1, *all = P + 16 * bands;
    northern_gauss(rings.x, rings.log_sin, w, H);
    for (int m = 0; m < bands; m += m < 8 ? 1 : 9 * step) {
        envmapi_legendre_factors(A, B, m, bands);
        memset(all, 0, (size_t)(bands * H) * sizeof(double));
        for (int first = 0, skip[2]; first < H; first += 16) {
            envmapi_legendre(P, skip, &rings, m, first, A, B);
            for (int b = 0; b < 16; ++b)
                for (int l = m + skip[b / 8]; l >= m && l < bands; ++l)
                    all[l * H + first + b] = P[8 * (b / 8 * (bands - m) + l - m) + b % 8];
        }
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
    double *A = (double *)calloc((size_t)bands * 34 + 2, sizeof(double));
    double *B = A + bands + 1, *P = B + bands + 1, *sums = P + 16 * bands, worst = 0;
    int finite = 1;
    for (int first = 0, skip[2]; first < H; first += first < 16 ? 16 : 48) {
        memset(sums, 0, (size_t)bands * 16 * sizeof(double));
        for (int m = 0; m < bands; ++m) {
            envmapi_legendre_factors(A, B, m, bands);
            envmapi_legendre(P, skip, &rings, m, first, A, B);
            for (int b = 0; b < 16; ++b)
                for (int l = m + skip[b / 8]; l >= m && l < bands; ++l) {
                    double p = P[8 * (b / 8 * (bands - m) + l - m) + b % 8];
                    finite &= envmapi_finite(p);
                    sums[16 * l + b] += (m ? 2 : 1) * p * p;
                }
        }
        for (int l = 0; l < bands; ++l)
            for (int b = 0; b < 16 && first + b < H; ++b)
                worst = larger(worst, fabs(sums[16 * l + b] * 4 * PI / (2 * l + 1) - 1));
    }
    CHECK(finite);
    FIGURE("sum over m of P_lm^2, relative, to 768 bands", worst, 1e-10);
    free(A);
    envmapi_pool_free(&pool, 0);
}

/* Nothing of 1e-18 or more is skipped, and nothing less begins a row but for its parity. */
static void skipped_legendre_functions_are_negligible(void) {
    int bands = 384, M = 432, skipped = 0, all = 0, wrong = 0;
    envmapi_rings rings = rings_of(M, bands);
    double *A = (double *)calloc((size_t)bands * 18 + 2, sizeof(double));
    double *B = A + bands + 1, *P = B + bands + 1;
    for (int first = 0, skip[2]; first < M / 2; first += 16)
        for (int m = 0; m < bands; m += 3) {
            envmapi_legendre_factors(A, B, m, bands);
            memset(P, 0, (size_t)(bands - m) * 16 * sizeof *P);
            envmapi_legendre(P, skip, &rings, m, first, A, B);
            for (int block = 0; block < 2; ++block) {
                int begin = -1;
                const double *p = P + 8 * (bands - m) * block;
                for (int i = 0; begin < 0 && i < 8 * (bands - m); ++i)
                    if (fabs(p[i]) > 1e-14) begin = i / 8;
                wrong += skip[block] != (begin < 0 ? -1 : begin / 2 * 2);
                skipped += skip[block] > 0, all += skip[block] < 0;
            }
        }
    CHECK(wrong == 0);
    printf("    begun later: %d, all skipped: %d\n", skipped, all);
    CHECK(skipped > 100 && all > 100);
    free(A);
    envmapi_pool_free(&pool, 0);
}

/* ------------------------------------------------------------------------------------ rings ----
 */

/* <copy g, h> = <g, fold h>, samples beyond the seam and the poles on the left. */
static void folding_over_seam_and_poles_is_the_adjoint_of_copying(void) {
    int M = 16, n = 2 * M;
    envmapi_rings rings = rings_of(M, 4), old = rings;
    size_t floats = (size_t)(n + 6) * rings.row;
    float *h = random_rings(&rings, 21), *g = random_rings(&rings, 22);
    double left = 0, right = 0;
    old.G = g;
    envmapi_rings_close(&rings, 0);
    for (size_t i = 0; i < floats; ++i) left += (double)rings.G[i] * (double)h[i];
    for (int k = -3; k < n + 3; ++k) {
        int same = (k + n) % n;
        for (int j = 0; j < M; ++j) /* inside, a copy changes nothing */
            CHECK(!memcmp(envmapi_ring(&rings, k, j), envmapi_ring(&old, same, j), 16));
        for (int i = 0; i < 6; ++i) { /* ring -1 is ring 0 half a turn on, ring M is ring M-1 */
            static const int beyond[6] = {-1, -2, -3, 16, 17, 18};
            static const int inside[6] = {0, 1, 2, 15, 14, 13};
            CHECK(!memcmp(envmapi_ring(&rings, k, beyond[i]),
                          envmapi_ring(&old, (same + M) % n, inside[i]), 16));
        }
    }
    memcpy(rings.G, h, floats * sizeof(float));
    envmapi_rings_close(&rings, 1);
    for (int k = 0; k < n; ++k)
        for (int j = 0; j < M; ++j)
            for (int c = 0; c < 4; ++c)
                right += (double)envmapi_ring(&rings, k, j)[c] *
                         (double)envmapi_ring(&old, k, j)[c];
    CHECK_CLOSE(left, right, 1e-7 * (double)floats);
    free(g);
    free(h);
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
    size_t floats = (size_t)(n + 6) * rings.row;
    float *g = (float *)malloc(floats * sizeof(float));
    memset(rings.G, 0, floats * sizeof(float));
    for (int i = 0; i < COUNT; ++i) {
        double d[3];
        oracle_random_direction(d, &seed);
        if (i < 8) d[0] = d[1] = 0, d[2] = i & 1 ? -1 : 1;
        if (i >= 8 && i < 12) d[1] = i & 1 ? -1e-18 : 0, d[0] = fabs(d[0]); /* the seam */
        points[i] = point_of(d);
        envmapi_spot p;
        envmapi_spots(&p, &rings, points + i, 1);
        CHECK(p.k >= 0 && p.k < n && p.j >= -1 && p.j < M);
        CHECK(p.f_k >= 0 && p.f_k <= 1 && p.f_j >= 0 && p.f_j <= 1);
        for (int c = 0; c < 4; ++c) values[4 * i + c] = (float)test_random(&seed);
    }
    for (int from = -3; from < n + 3; from += 5)
        envmapi_rings_spread(&rings, points, values, COUNT, from,
                             from + 5 < n + 3 ? from + 5 : n + 3);
    for (size_t i = 0; i < floats; ++i) {
        g[i] = (float)test_random(&seed);
        left += (double)rings.G[i] * (double)g[i];
    }
    memcpy(rings.G, g, floats * sizeof(float));
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
static void analyse_one(envmapi_rings *t, const double d[3], int bands, int M) {
    static float values[4] = {1, 2, 0.5f, -1};
    static envmapi_point point;
    *t = rings_of(M, bands);
    point = point_of(d);
    t->points = &point, t->values = values, t->count = 1, t->a_bands = bands;
    t->a = (double *)envmapi_pool_get(&pool, envmapi_triangle(bands, bands), sizeof(double));
    if (!CHECK(t->a)) exit(1);
    envmapi_analyse(t, &serial);
}

static void a_points_coefficients_are_the_harmonics_there(void) {
    static const double value[4] = {1, 2, 0.5, -1};
    static const double ds[5][3] = {
        {0.6, 0.48, 0.64}, {-0.28, 0, -0.96}, {0, -1, 0}, {6e-5, -8e-5, 1 - 5e-9}, {1, 0, 0}};
    int bands = 24;
    double worst = 0;
    for (int i = 0; i < 5; ++i) {
        envmapi_rings t;
        analyse_one(&t, ds[i], bands, 384);
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
    FIGURE("a_lm of one point, 24 bands on 384 rings", worst, 3e-7);
}

static void a_point_at_a_pole_has_zonal_coefficients_only(void) {
    int bands = 40;
    for (int south = 0; south < 2; ++south) {
        double d[3] = {0, 0, south ? -1 : 1}, worst = 0, others = 0;
        envmapi_rings t;
        analyse_one(&t, d, bands, 512);
        for (int m = 0; m < bands; ++m)
            for (int l = m; l < bands; ++l) {
                const double *a = t.a + envmapi_triangle(bands, m) + 8 * (l - m);
                double size = sqrt((2 * l + 1) / (4 * PI)), sign = south && l & 1 ? -1 : 1;
                for (int c = 0; c < 8; ++c)
                    if (m || c >= 4) others = larger(others, fabs(a[c]) / size);
                if (!m) worst = larger(worst, fabs(a[0] - sign * size) / size);
            }
        FIGURE(south ? "a_l0 of the south pole" : "a_l0 of the north pole", worst, 2e-7);
        FIGURE("a_lm of a pole, m > 0", others, 5e-8);
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
    for (int i = 0; i < 16; ++i) {
        const double *d = ds[i & 3];
        int L = bands[i >> 2];
        envmapi_rings t;
        analyse_one(&t, d, L, envmapi_rings_size(16 * L));
        for (int k = 0; k < COUNT; ++k) {
            double a[3];
            oracle_random_direction(a, &seed);
            if (k < 3)
                for (int c = 0; c < 3; ++c) a[c] = k ? (k == 1 ? -d[c] : (c == 2)) : d[c];
            points[k] = point_of(a);
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
    FIGURE("one point through L bands - its Legendre series, over the peak", worst, 1e-6);
}

/* F_m are rounded, and what they lose goes around: it must be below 1e-6 of the mean, which is what
   envmap_filter says of floats, though one point has all light. Phong 5000's lobe. */
static void the_rounding_of_frequencies_stays_far_below_a_lamps_mean(void) {
    enum { COUNT = 4000, L = 560, M = 576 };
    static float out[4 * COUNT];
    static envmapi_point points[COUNT];
    static double lambda[L];
    double d[3] = {0.48, -0.6, 0.64}, worst = 0, mean = 1 / (4 * PI), peak = 0;
    unsigned long long seed = 61;
    envmapi_rings t;
    analyse_one(&t, d, L, M);
    for (int l = 0; l < L; ++l) lambda[l] = exp(-l * (l + 1) / 10000.0);
    for (int k = 0; k < COUNT; ++k) { /* most on the lamp's own ring */
        double a[3], angle = 0.3 + (2 * PI - 0.6) * k / COUNT;
        memcpy(a, d, sizeof a);
        a[0] = d[0] * cos(angle) - d[1] * sin(angle), a[1] = d[0] * sin(angle) + d[1] * cos(angle);
        if (k % 4 == 0)
            do oracle_random_direction(a, &seed);
            while (a[0] * d[0] + a[1] * d[1] + a[2] * d[2] > 0.97);
        points[k] = point_of(k ? a : d);
    }
    t.lambda = lambda, t.points = points, t.values = out, t.count = COUNT;
    envmapi_synthesise(&t, &serial);
    for (int k = 1; k < COUNT; ++k) worst = larger(worst, fabs((double)out[4 * k]) / mean);
    peak = (double)out[0] / mean;
    CHECK(peak > 5000 && peak < 15000);
    FIGURE("0.2 from a lamp and more, over the mean", worst, 1e-6);
    envmapi_pool_free(&pool, 0);
}

/* Fewer bands read from a wider triangle of coefficients: what levels that share one do. */
static void bands_of_a_larger_triangle_are_the_same_bands(void) {
    enum { COUNT = 50 };
    static float wide[4 * COUNT], narrow[4 * COUNT];
    static envmapi_point points[COUNT];
    double d[3] = {0.48, -0.6, 0.64}, lambda[40], worst = 0;
    unsigned long long seed = 51;
    for (int pass = 0; pass < 2; ++pass) {
        envmapi_rings t, few = rings_of(384, 12);
        analyse_one(&t, d, pass ? 12 : 40, 384);
        for (int k = 0; k < COUNT; ++k) {
            double a[3];
            if (!pass) oracle_random_direction(a, &seed), points[k] = point_of(a);
        }
        for (int l = 0; l < 40; ++l) lambda[l] = 1;
        few.a = t.a, few.a_bands = t.a_bands;
        few.lambda = lambda, few.points = points, few.count = COUNT;
        few.values = pass ? narrow : wide;
        envmapi_synthesise(&few, &serial);
        envmapi_pool_free(&pool, 0);
    }
    for (int i = 0; i < 4 * COUNT; ++i)
        worst = larger(worst, fabs((double)wide[i] - (double)narrow[i]));
    FIGURE("12 bands of 40 - 12 bands", worst, 1e-7);
}

/* However many tasks share the work. */
static void any_number_of_tasks_gives_the_same_bits(void) {
    enum { COUNT = 100 };
    static const int tasks[3] = {1, 5, 16};
    static float out[3][4 * COUNT];
    static envmapi_point points[COUNT];
    static double first[8 * 20 * 21 / 2];
    double d[3] = {0.48, -0.6, 0.64}, lambda[20];
    for (int i = 0; i < 3; ++i) {
        unsigned long long seed = 101;
        envmapi_rings t;
        analyse_one(&t, d, 20, 48);
        t.tasks = tasks[i];
        envmapi_analyse(&t, &serial);
        if (!i) memcpy(first, t.a, sizeof first);
        CHECK(envmapi_triangle(20, 20) * sizeof(double) == sizeof first);
        CHECK(!memcmp(t.a, first, sizeof first));
        for (int k = 0; k < COUNT; ++k) {
            double a[3];
            oracle_random_direction(a, &seed), points[k] = point_of(a);
        }
        for (int l = 0; l < 20; ++l) lambda[l] = 1;
        t.lambda = lambda, t.points = points, t.count = COUNT, t.values = out[i];
        envmapi_synthesise(&t, &serial);
        CHECK(!memcmp(out[i], out[0], sizeof out[0]));
        envmapi_pool_free(&pool, 0);
    }
    CHECK(out[0][0] < 0 || out[0][0] > 0);
}

/* Tasks that write where others do are a race, which no order of tasks shows. */
static void tasks_spread_to_columns_of_their_own(void) {
    enum { M = 96 };
    double d[3] = {0.48, -0.6, 0.64};
    static unsigned char writes[(2 * M + 6) * (M + 6) * 8];
    envmapi_rings t;
    analyse_one(&t, d, 20, M);
    t.tasks = 16;
    int tasks = envmapi_spread_tasks(&t);
    size_t count = (size_t)(2 * M + 6) * t.row;
    if (!CHECK(tasks == 8 && count <= sizeof writes)) return;
    for (int task = 0; task < tasks; ++task) {
        for (size_t i = 0; i < count; ++i) t.G[i] = 1e30f;
        envmapi_task_spread(&t, task);
        for (size_t i = 0; i < count; ++i) writes[i] = (unsigned char)(writes[i] + (t.G[i] < 1e29f));
    }
    size_t once = 0;
    for (size_t i = 0; i < count; ++i) once += writes[i] == 1;
    CHECK(once == count);
    envmapi_pool_free(&pool, 0);
}

static void nothing_leaks(void) { CHECK(oracle_live == 0); }

/* The transform's own solid angles, to fourth order: octahedral maps of even and of odd edge, whose
   folds run between texels or through them. */
static void solid_angles_of_whole_rows_are_those_of_their_texels(void) {
    enum { MOST = 97 };
    static float omega[4 * 2 * MOST * MOST];
    static const int sizes[4] = {7, 64, 65, MOST};
    double worst = 0;
    for (int mapping = 0; mapping < MAPPINGS; ++mapping)
        for (int k = 0; k < 4; ++k) {
            float none = 0;
            envmap map = {0};
            envmapi_input in;
            memset(&in, 0, sizeof in), in.map = &map, in.omega = omega;
            map.mapping = mapping, map.size = sizes[k], map.levels = map.slices = 1;
            map.texels = &none;
            int width = oracle_width(mapping, sizes[k]);
            for (int y = 0; y < (sizes[k] + 1) / 2; ++y) {
                envmapi_task_omega(&in, y);
                for (int x = 0; x < width; ++x) {
                    double exact = envmap_solid_angle(&map, 0, 0, x, y);
                    double own = (double)omega[4 * width * y + 3 * x];
                    if (own > 0 || !oracle_is_disc(mapping)) /* 0: a rim cuts it */
                        worst = fmax(worst, fabs(own / exact - 1));
                }
            }
        }
    FIGURE("a texel's solid angle, relative", worst, 1e-5);
}

/* As far as 0.001 from the plane of the face, beyond which it is a plane 0.001 away. */
static void a_cubes_face_reaches_nearly_to_a_right_angle(void) {
    for (int i = 0; i < 2; ++i) {
        double z = i ? 1.2e-3 : -0.2, x = sqrt(1 - z * z), d[3] = {x, 0, z}, uv[2];
        envmapi_project(uv, ENVMAP_CUBE, 4, d);
        CHECK_CLOSE(uv[0], 0.5 + 0.5 * x / (i ? z : 1e-3), 1e-9);
        CHECK_CLOSE(uv[1], 0.5, 1e-12);
    }
}

/* d omega / dA of every mapping, summed over the picture: 4 pi, on discs inside the circle. */
static void densities_integrate_to_the_whole_sphere(void) {
    enum { N = 200 };
    for (int mapping = 0; mapping < MAPPINGS; ++mapping) {
        double sum = 0;
        for (int i = 0; i < N * N; ++i) {
            double u = (i % N + 0.5) / N, v = (i / N + 0.5) / N;
            if (oracle_is_disc(mapping) && hypot(2 * u - 1, 2 * v - 1) > 1) continue;
            sum += envmapi_density(mapping, u, v) / (N * N);
        }
        CHECK_CLOSE(sum * envmap_faces(mapping) / (4 * PI), 1, 2e-3);
    }
}

int main(void) {
    RUN(solid_angles_of_whole_rows_are_those_of_their_texels);
    RUN(a_cubes_face_reaches_nearly_to_a_right_angle);
    RUN(densities_integrate_to_the_whole_sphere);
    RUN(rings_are_multiples_of_4_with_factors_2_and_3);
    RUN(the_fft_is_the_plain_dft);
    RUN(the_fft_back_undoes_the_fft);
    RUN(unpacking_separates_north_and_south);
    RUN(packing_is_the_wave_of_its_frequencies);
    RUN(splines_are_a_partition_of_unity);
    RUN(the_splines_error_is_what_waves_lose);
    RUN(the_solve_down_the_rings_undoes_the_spline);
    RUN(angles_are_good_to_1e_11_and_lengths_to_1e_12);
    RUN(angles_on_the_axes_are_exact);
    RUN(points_are_where_their_angles_say);
    RUN(legendre_functions_are_orthonormal_to_256_bands);
    RUN(legendre_functions_obey_the_addition_theorem_to_768_bands);
    RUN(skipped_legendre_functions_are_negligible);
    RUN(folding_over_seam_and_poles_is_the_adjoint_of_copying);
    RUN(spreading_is_the_adjoint_of_interpolating);
    RUN(a_points_coefficients_are_the_harmonics_there);
    RUN(a_point_at_a_pole_has_zonal_coefficients_only);
    RUN(a_point_synthesised_is_the_sum_of_legendre_polynomials);
    RUN(the_rounding_of_frequencies_stays_far_below_a_lamps_mean);
    RUN(bands_of_a_larger_triangle_are_the_same_bands);
    RUN(any_number_of_tasks_gives_the_same_bits);
    RUN(tasks_spread_to_columns_of_their_own);
    RUN(nothing_leaks);
    return test_summary();
}
