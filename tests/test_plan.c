/* SPDX-License-Identifier: MIT
   What a scene needs, held against what it gets: sizes, bands and slices that are enough, and half of
   them that are not; errors that are expected, and made. */
#define ENVMAP_IMPLEMENTATION
#include "helpers.h"

#include "examples/tool/scenes.h"

static envmap scene_map(int scene, int mapping, int size) {
    envmap map = black(mapping, size, 1, 1);
    scene_fill(&map, scene);
    return map;
}

static envmap_plan plan_of(const envmap *dst, const envmap *src, envmap_lobe lobe,
                           double tolerance) {
    envmap_filter_desc desc = desc_of(0, tolerance);
    envmap_plan plan;
    memset(&plan, 0, sizeof plan);
    CHECK(envmap_filter_plan(&plan, dst, src, &lobe, &desc) == ENVMAP_OK);
    return plan;
}

static envmap shape_of(int mapping, int size, int slices) {
    envmap shape = {0};
    shape.mapping = mapping, shape.size = size, shape.levels = 1, shape.slices = slices;
    return shape;
}

static envmap exact(const envmap *src, envmap_lobe lobe, int mapping, int size, int slices,
                    double tolerance) {
    envmap map = black(mapping, size, 1, slices);
    CHECK(filter(&map, src, lobe, ENVMAP_METHOD_FAST, tolerance) == ENVMAP_OK);
    return map;
}

/* Relative rms of bilinear lookups in a map of `size` at the texels of truth, which has another
   grid. */
static double looked_up(const envmap *src, envmap_lobe lobe, int mapping, int size,
                        const envmap *truth, double tolerance) {
    envmap map = exact(src, lobe, mapping, size, 1, tolerance / 20);
    double off = 0, all = 0;
    int width = 2 * truth->size;
    for (int i = 0; i < width * truth->size; ++i) {
        int x = i % width, y = i / width;
        double w = envmap_solid_angle(truth, 0, 0, x, y);
        const float *b = envmap_texel(truth, 0, 0, 0, x, y);
        float d[3], a[3];
        envmap_direction(d, ENVMAP_LATLONG, 0, ((float)x + 0.5f) / (float)width,
                         ((float)y + 0.5f) / (float)truth->size);
        envmap_lookup(a, &map, d, 0);
        for (int c = 0; c < 3; ++c) {
            off += w * pow((double)a[c] - (double)b[c], 2);
            all += w * pow((double)b[c], 2);
        }
    }
    envmap_free(&map);
    return sqrt(off / all);
}

/* ------------------------------------------------------------------------------ oracles ---- */

/* The addition theorem: sum_m |a_lm|^2 of one light is (2l+1)/4pi of its square, in every band. */
static void one_light_is_equally_bright_in_every_band(void) {
    envmap src = black(ENVMAP_CUBE, 64, 1, 1), dst = black(ENVMAP_CUBE, 8, 1, 1);
    float *texel = envmap_texel(&src, 0, 0, 2, 20, 37);
    double w = envmap_solid_angle(&src, 0, 2, 20, 37), off = 0;
    texel[0] = 30, texel[1] = 20, texel[2] = 10;
    double light = 1400 * w * w / (4 * PI);
    for (int fast = 0; fast < 2; ++fast) {
        static envmapi_power d;
        static envmapi_job job;
        envmap_lobe lobe = envmap_lobe_phong(200);
        envmap_filter_desc desc;
        CHECK(envmapi_desc(&desc, NULL));
        desc.method = fast ? ENVMAP_METHOD_FAST : ENVMAP_METHOD_REFERENCE;
        CHECK(envmapi_job_open(&job, &dst, &src, &lobe, 1, &desc) == ENVMAP_OK);
        CHECK(envmapi_power_create(&d, &job) == ENVMAP_OK);
        CHECK_CLOSE(d.scene[0] / light, 1, 1e-3);
        for (int l = 0; l < 100; ++l) off = fmax(off, fabs(d.scene[l] / d.scene[0] - 1));
        FIGURE(fast ? "power of as many bands as FAST needs, off by" : "power of 24 bands, off by",
               off, fast ? 2e-2 : 2e-3);
        envmapi_pool_free(&job.pool, 0);
    }
    envmap_free(&src), envmap_free(&dst);
}

/* exp(i w t) from its values at 0 and 1; and two such, of unequal directions. */
static void linear_interpolation_loses_what_is_said(void) {
    double most = 0;
    for (double w = 0.05; w < 3; w += 0.05) {
        double sum = 0;
        enum { N = 64, ANGLES = 32 };
        for (int a = 0; a < ANGLES; ++a)
            for (int i = 0; i < N * N; ++i) {
                double wu = w * cos(2 * PI * (a + 0.5) / ANGLES);
                double wv = w * sin(2 * PI * (a + 0.5) / ANGLES);
                double u = (i % N + 0.5) / N, v = ((i / N) + 0.5) / N, re = 0, im = 0;
                for (int k = 0; k < 4; ++k) {
                    double weight = (k & 1 ? u : 1 - u) * (k & 2 ? v : 1 - v);
                    double phase = (k & 1) * wu + (k >> 1) * wv;
                    re += weight * cos(phase), im += weight * sin(phase);
                }
                re -= cos(wu * u + wv * v), im -= sin(wu * u + wv * v);
                sum += (re * re + im * im) / (N * N * ANGLES);
            }
        most = fmax(most, fabs(sqrt(envmapi_bilinear_square(w * w) / sum) - 1));
    }
    FIGURE("bilinear error of a plane wave, off by a share of", most, 0.1);
}

/* What lookups lose is the mean over the sphere: of sixteen texels in a quarter of a map, each has
   its solid angle, a paraboloid's (1 + z)^2, and those outside a disc have none. */
static void lookups_are_weighed_by_solid_angle_inside_the_circle(void) {
    envmapi_power power;
    envmapi_lookups t;
    memset(&power, 0, sizeof power);
    for (int m = 0; m < MAPPINGS; ++m) {
        double sum = 0, d[3], last[3];
        envmapi_lookups_create(&t, &power, m, 0);
        for (int i = 0; i < 16; ++i) {
            double u = (i % 4 + 0.5) / 8, v = ((i / 4) + 0.5) / 8;
            int outside = oracle_is_disc(m) && hypot(2 * u - 1, 2 * v - 1) > 1;
            CHECK((t.w[i] > 0) == !outside);
            sum += t.w[i];
            oracle_direction(d, m, 0, u, v), oracle_direction(last, m, 0, 0.4375, 0.4375);
            if (m == ENVMAP_PARABOLOID && !outside)
                CHECK_CLOSE(t.w[i] / t.w[15], pow((1 + d[2]) / (1 + last[2]), 2), 1e-6);
        }
        CHECK_CLOSE(sum, 1, 1e-12);
    }
}

/* ------------------------------------------------------------------------------- needs ---- */

static void a_planned_size_is_enough_and_half_of_it_is_not(void) {
    static const struct {
        int scene, to;
        float N;
        double tolerance;
    } works[] = {
        {SCENE_OVERCAST, ENVMAP_CUBE, 1, 1e-3},       {SCENE_OVERCAST, ENVMAP_CUBE, 100, 1e-2},
        {SCENE_STUDIO, ENVMAP_CUBE, 10, 1e-2},        {SCENE_STUDIO, ENVMAP_LATLONG, 50, 3e-3},
        {SCENE_SUN, ENVMAP_CUBE, 50, 3e-3},           {SCENE_SUN, ENVMAP_PARABOLOID, 10, 3e-3},
        {SCENE_STUDIO, ENVMAP_PARABOLOID, 100, 1e-2}, {SCENE_SUN, ENVMAP_LATLONG, 100, 1e-2},
        {SCENE_OVERCAST, ENVMAP_ANGULAR, 10, 1e-2},   {SCENE_STUDIO, ENVMAP_OCTAHEDRAL, 50, 3e-3},
        {SCENE_SUN, ENVMAP_OCTAHEDRAL, 10, 1e-2}};
    double most = 0, least = 1e9, expected = 0;
    for (size_t i = 0; i < sizeof works / sizeof works[0]; ++i) {
        envmap src = scene_map(works[i].scene, ENVMAP_CUBE, 64);
        envmap_lobe lobe = envmap_lobe_phong(works[i].N);
        double tolerance = works[i].tolerance;
        envmap shape = shape_of(works[i].to, 32, 1);
        envmap truth = exact(&src, lobe, ENVMAP_LATLONG, 70, 1, tolerance / 20);
        envmap_plan n = plan_of(&shape, &src, lobe, tolerance);
        double whole = looked_up(&src, lobe, works[i].to, n.size, &truth, tolerance);
        double half = looked_up(&src, lobe, works[i].to, (n.size + 1) / 2, &truth, tolerance);
        double at_32 = looked_up(&src, lobe, works[i].to, 32, &truth, tolerance);
        printf(
            "    %-8s N = %-4g %-10s edge %3d: %.2e of %.0e, half %.2e; edge 32 %.2e, said %.2e\n",
            scene_name[works[i].scene], (double)works[i].N, oracle_name[works[i].to], n.size, whole,
            tolerance, half, at_32, n.lookup);
        most = fmax(most, whole / tolerance), least = fmin(least, half / tolerance);
        expected = fmax(expected, fabs(log(n.lookup / at_32)));
        CHECK(n.method == ENVMAP_METHOD_FAST && n.slices == 1);
        envmap_free(&src), envmap_free(&truth);
    }
    FIGURE("error of the planned size, of the tolerance", most, 1.05);
    FIGURE("tolerance, of the error of half that size", 1 / least, 0.7);
    FIGURE("expected over made error of lookups, off by a factor of", exp(expected), 1.5);
}

/* A map of few texels and many slices, against one of an odd multiple of them. */
static double between_slices(const envmap *src, envmap_lobe lobe, int slices, int odd) {
    envmap few = exact(src, lobe, ENVMAP_CUBE, 6, slices, 1e-3);
    envmap many = exact(src, lobe, ENVMAP_CUBE, 6, odd * slices, 1e-3);
    double off = 0, all = 0;
    for (int k = 0; k < many.slices; ++k) {
        double at = (k + 0.5) / many.slices * slices - 0.5;
        at = at < 0 ? 0 : at > slices - 1 ? slices - 1 : at;
        int low = (int)at, high = low + 1 < slices ? low + 1 : low;
        for (int i = 0; i < 6 * 36; ++i) {
            const float *a = envmap_texel(&few, 0, low, 0, 0, 0) + 3 * i;
            const float *b = envmap_texel(&few, 0, high, 0, 0, 0) + 3 * i;
            const float *t = envmap_texel(&many, 0, k, 0, 0, 0) + 3 * i;
            for (int c = 0; c < 3; ++c) {
                double value = (double)a[c] + (at - low) * ((double)b[c] - (double)a[c]);
                off += pow(value - (double)t[c], 2), all += pow((double)t[c], 2);
            }
        }
    }
    envmap_free(&few), envmap_free(&many);
    return sqrt(off / all);
}

static void planned_slices_are_enough_and_half_of_them_are_not(void) {
    for (int scene = 0; scene < SCENE_COUNT; ++scene) {
        envmap src = scene_map(scene, ENVMAP_CUBE, 64), shape = shape_of(ENVMAP_CUBE, 6, 16);
        envmap_lobe banks = envmap_lobe_banks(0.8f);
        double tolerance = scene == SCENE_SUN ? 0.06 : 0.02;
        envmap_plan n = plan_of(&shape, &src, banks, tolerance);
        double whole = between_slices(&src, banks, n.slices, 3);
        double half = between_slices(&src, banks, (n.slices + 1) / 2, 5);
        printf("    %-8s %d slices: %.2e, half %.2e of %.2e\n", scene_name[scene], n.slices, whole,
               half, tolerance);
        FIGURE("error of the planned slices, of the tolerance", whole / tolerance, 1.15);
        FIGURE("tolerance, of the error of half as many", tolerance / half, 0.7);
        CHECK(n.slices < envmap_lobe_slices(&banks, tolerance));
        envmap_free(&src);
    }
}

/* What L bands leave, measured, is at most the tolerance, and with one band less it is more. */
static double left_by(const envmap *truth, const envmap *src, envmap_lobe lobe, int bands) {
    static double sh[3 * 64 * 64];
    envmap map = black(truth->mapping, truth->size, 1, 1);
    envmap_difference d;
    CHECK(envmap_sh_project(sh, bands, src, 0, 0, NULL) == ENVMAP_OK);
    CHECK(envmap_sh_convolve(sh, sh, bands, &lobe, 0) == ENVMAP_OK);
    CHECK(envmap_sh_fill(&map, 0, 0, sh, bands, 0, NULL) == ENVMAP_OK);
    CHECK(envmap_compare(&d, &map, truth, 0) == ENVMAP_OK);
    envmap_free(&map);
    return d.rms;
}

static void planned_bands_are_enough_and_one_less_is_not(void) {
    for (int scene = 0; scene < SCENE_COUNT; ++scene)
        for (int k = 0; k < 2; ++k) {
            envmap src = scene_map(scene, ENVMAP_CUBE, 32);
            envmap_lobe lobe = k ? envmap_lobe_phong(20) : envmap_lobe_diffuse();
            envmap truth = exact(&src, lobe, ENVMAP_CUBE, 32, 1, 3e-4);
            double tolerance = 0.01;
            envmap_plan n = plan_of(&truth, &src, lobe, tolerance);
            double nine = left_by(&truth, &src, lobe, 3);
            CHECK(n.bands > 1);
            FIGURE("error of the planned bands, of the tolerance",
                   left_by(&truth, &src, lobe, n.bands) / tolerance, 1.05);
            FIGURE("tolerance, of the error of one band less",
                   tolerance / left_by(&truth, &src, lobe, n.bands - 1), 1.05);
            printf("    %s, %s: nine numbers lose %.4f, said %.4f\n", scene_name[scene],
                   k ? "Phong 20" : "diffuse", nine, n.nine);
            CHECK_CLOSE(n.nine, nine, 0.03 * nine + 3e-4);
            envmap_free(&src), envmap_free(&truth);
        }
}

/* Low contrast is said plainly: nine numbers do for the overcast scene, and not for the sun. */
static void nine_numbers_do_for_an_overcast_sky(void) {
    envmap overcast = scene_map(SCENE_OVERCAST, ENVMAP_CUBE, 64);
    envmap sun = scene_map(SCENE_SUN, ENVMAP_CUBE, 64), shape = shape_of(ENVMAP_CUBE, 16, 1);
    envmap_plan a = plan_of(&shape, &overcast, envmap_lobe_diffuse(), 1e-3);
    envmap_plan b = plan_of(&shape, &sun, envmap_lobe_diffuse(), 1e-3);
    FIGURE("overcast: relative rms of nine numbers", a.nine, 0.01);
    FIGURE("overcast over sun", a.nine / b.nine, 0.2);
    CHECK(a.contrast < 0.4 && b.contrast > 0.7);
    CHECK(a.size < b.size && a.bands < b.bands);
    envmap_free(&overcast), envmap_free(&sun);
}

static void a_uniform_scene_needs_one_texel(void) {
    envmap src = black(ENVMAP_CUBE, 32, 1, 1), shape = shape_of(ENVMAP_CUBE, 16, 1);
    envmap_plan n = plan_of(&shape, &src, envmap_lobe_diffuse(), 1e-3); /* black */
    CHECK(n.size == 1 && n.bands == 1 && n.slices == 1 && n.lights == 0);
    n = plan_of(&shape, &src, envmap_lobe_phong(1e6f), 1e-3); /* and no slow way there */
    CHECK(n.size == 1 && n.bands == 1 && n.method == ENVMAP_METHOD_FAST && n.error <= 0);
    fill(&src, 3);
    n = plan_of(&shape, &src, envmap_lobe_phong(20), 1e-3);
    CHECK(n.size == 1 && n.bands == 1 && n.slices == 1 && n.lights == 0);
    FIGURE("contrast of a uniform scene", n.contrast, 1e-3);
    FIGURE("what nine numbers lose of it", n.nine, 1e-3);
    envmap_free(&src);
}

/* Sources whose texels are wider than the lobe: the definition filters the radiance between texels,
   not light at their centres. Against the mean of the reference's result itself. */
static void the_contrast_of_few_texels_is_the_result_s(void) {
    static const struct {
        int mapping, edge;
        float N; /* 0: diffuse */
    } works[] = {{ENVMAP_CUBE, 1, 30},      {ENVMAP_CUBE, 2, 5},   {ENVMAP_LATLONG, 2, 0},
                 {ENVMAP_ANGULAR, 4, 8},    {ENVMAP_SPHERE, 3, 2}, {ENVMAP_OCTAHEDRAL, 2, 100},
                 {ENVMAP_PARABOLOID, 5, 12}};
    double off = 0;
    for (size_t i = 0; i < sizeof works / sizeof works[0]; ++i) {
        envmap src = noise(works[i].mapping, works[i].edge, 3 + (unsigned)i);
        envmap dst = black(ENVMAP_CUBE, 24, 1, 1);
        envmap_lobe lobe = works[i].N > 0 ? envmap_lobe_phong(works[i].N) : envmap_lobe_diffuse();
        double sum = 0, square = 0, first[3] = {0, 0, 0};
        CHECK(filter(&dst, &src, lobe, ENVMAP_METHOD_REFERENCE, 0) == ENVMAP_OK);
        for (int k = 0; k < 6 * 24 * 24; ++k) {
            double w = envmap_solid_angle(&dst, 0, 0, k % 24, k / 24 % 24) / (4 * PI);
            for (int c = 0; c < 3; ++c) {
                double value = (double)dst.texels[3 * k + c];
                first[c] += w * value, sum += w * value * value;
            }
        }
        for (int c = 0; c < 3; ++c) square += first[c] * first[c];
        double contrast = sqrt(fmax(sum - square, 0) / square);
        envmap_plan n = plan_of(&dst, &src, lobe, 1e-3);
        printf("    %-10s %d: contrast %.4f, planned %.4f\n", oracle_name[works[i].mapping],
               works[i].edge, contrast, n.contrast);
        off = fmax(off, fabs(n.contrast - contrast) / (0.1 * contrast + 0.01));
        envmap_free(&src), envmap_free(&dst);
    }
    FIGURE("contrast of few texels, off by tenths and 0.01", off, 0.8);
}

/* A source whose texels are all alike has no contrast, whatever its texels. */
static void a_constant_of_few_texels_has_no_contrast(void) {
    for (int m = 0; m < MAPPINGS; ++m) {
        envmap src = black(m, 1, 1, 1), shape = shape_of(ENVMAP_CUBE, 24, 1);
        fill(&src, 2);
        envmap_plan n = plan_of(&shape, &src, envmap_lobe_phong(30), 1e-3);
        CHECK(n.contrast <= 0 && n.nine <= 0 && n.size == 1 && n.bands == 1 && n.lookup <= 0);
        envmap_free(&src);
    }
}

static void a_scene_turned_by_a_quarter_needs_the_same(void) {
    envmap a = scene_map(SCENE_STUDIO, ENVMAP_CUBE, 48), b = black(ENVMAP_CUBE, 48, 1, 1);
    envmap shape = shape_of(ENVMAP_CUBE, 16, 1);
    for (int f = 0; f < 6; ++f)
        for (int y = 0; y < 48; ++y)
            for (int x = 0; x < 48; ++x) {
                float d[3], t[3], u, v;
                int face;
                envmap_direction(d, ENVMAP_CUBE, f, ((float)x + 0.5f) / 48, ((float)y + 0.5f) / 48);
                t[0] = d[1], t[1] = -d[0], t[2] = d[2];
                envmap_coordinates(&face, &u, &v, ENVMAP_CUBE, t);
                memcpy(envmap_texel(&b, 0, 0, f, x, y),
                       envmap_texel(&a, 0, 0, face, (int)(48 * u), (int)(48 * v)), 12);
            }
    envmap_plan p = plan_of(&shape, &a, envmap_lobe_phong(30), 1e-3);
    envmap_plan q = plan_of(&shape, &b, envmap_lobe_phong(30), 1e-3);
    CHECK(p.bands == q.bands && p.method == q.method && abs(p.size - q.size) <= 1);
    CHECK_CLOSE(p.nine, q.nine, 1e-3);
    CHECK_CLOSE(p.contrast, q.contrast, 1e-3);
    envmap_free(&a), envmap_free(&b);
}

/* ---------------------------------------------------------------------- errors, methods ---- */

static void expected_errors_are_made_and_below_the_tolerance(void) {
    double most = 0, over = 0;
    for (int scene = 0; scene < SCENE_COUNT; ++scene) {
        envmap src = scene_map(scene, ENVMAP_CUBE, 48);
        static const double tolerances[3] = {1e-2, 1e-3, 1e-4};
        envmap_lobe lobes[4] = {envmap_lobe_diffuse(), envmap_lobe_phong(10), envmap_lobe_phong(80),
                                envmap_lobe_banks(0.9f)};
        for (int i = 0; i < 4; ++i) {
            envmap truth = black(ENVMAP_CUBE, 4, 1, i == 3 ? 3 : 1);
            envmap map = black(ENVMAP_CUBE, 4, 1, truth.slices);
            CHECK(filter(&truth, &src, lobes[i], ENVMAP_METHOD_REFERENCE, 0) == ENVMAP_OK);
            for (int k = 0; k < 3; ++k) {
                envmap_difference d;
                envmap_plan n = plan_of(&map, &src, lobes[i], tolerances[k]);
                CHECK(filter(&map, &src, lobes[i], ENVMAP_METHOD_FAST, tolerances[k]) == ENVMAP_OK);
                CHECK(envmap_compare(&d, &map, &truth, 0) == ENVMAP_OK);
                most = fmax(most, d.rms / tolerances[k]);
                CHECK(n.error <= tolerances[k]);
                CHECK(n.method == ENVMAP_METHOD_FAST);
                if (n.error > 0) over = fmax(over, d.rms / n.error); /* else it is rounding's */
            }
            envmap_free(&truth), envmap_free(&map);
        }
        envmap_free(&src);
    }
    FIGURE("error made, of the tolerance", most, 1);
    FIGURE("error made, of that expected", over, 2);
}

/* The plan's method gives AUTO's bits, for few texels, for sharp lobes and for others. */
static double about_the_axis(double x, double p, void *user) {
    (void)user;
    return exp(-(30 + 15 * p) * (1 - x));
}

static double opposite_to_it(double x, double p, void *user) { return about_the_axis(-x, p, user); }

static void slices_are_as_many_for_a_lobe_opposite_to_its_axis(void) {
    envmap_lobe about = envmap_lobe_function(about_the_axis, NULL);
    envmap_lobe opposite = envmap_lobe_function(opposite_to_it, NULL);
    about.p0 = opposite.p0 = -1, about.p1 = opposite.p1 = 1;
    int n = envmap_lobe_slices(&about, 1e-2);
    CHECK(n > 2 && abs(envmap_lobe_slices(&opposite, 1e-2) - n) <= 1);
}

/* A lobe without a kink needs none, and no band limit holds one that is sharper than the texels. */
static void lights_are_for_lobes_with_a_kink_that_have_bands(void) {
    envmap src = scene_map(SCENE_SUN, ENVMAP_CUBE, 32), shape = shape_of(ENVMAP_CUBE, 8, 1);
    CHECK(plan_of(&shape, &src, envmap_lobe_ggx(1), 1e-3).lights > 0);
    CHECK(plan_of(&shape, &src, envmap_lobe_gaussian(20), 1e-3).lights == 0);
    CHECK(plan_of(&shape, &src, envmap_lobe_ggx(0.02f), 1e-3).lights == 0);
    envmap_free(&src);
}

/* Of Banks' 12 slices together there are enough pairs of texels for bands. */
static void the_method_is_what_auto_takes(void) {
    static const struct {
        int source, edge, slices;
        float N;
        int method;
    } works[] = {{8, 4, 1, 10, ENVMAP_METHOD_FAST},
                 {48, 12, 1, 10, ENVMAP_METHOD_FAST},
                 {32, 8, 1, 1e4f, ENVMAP_METHOD_FAST},
                 {48, 12, 1, 1, ENVMAP_METHOD_FAST},
                 {48, 2, 12, 0, ENVMAP_METHOD_FAST}};
    for (int i = 0; i < 5; ++i) {
        envmap src = scene_map(SCENE_STUDIO, ENVMAP_CUBE, works[i].source);
        envmap a = black(ENVMAP_CUBE, works[i].edge, 1, works[i].slices),
               b = black(ENVMAP_CUBE, works[i].edge, 1, works[i].slices);
        envmap_lobe lobe = works[i].slices > 1 ? envmap_lobe_banks(0.3f)
                                               : envmap_lobe_phong(works[i].N);
        envmap_plan n = plan_of(&a, &src, lobe, 1e-3);
        CHECK(n.method == works[i].method);
        CHECK(filter(&a, &src, lobe, ENVMAP_METHOD_AUTO, 1e-3) == ENVMAP_OK);
        CHECK(filter(&b, &src, lobe, n.method, 1e-3) == ENVMAP_OK);
        CHECK(same_bits(&a, &b));
        envmap_free(&src), envmap_free(&a), envmap_free(&b);
    }
}

static void what_is_sharper_than_the_source_needs_its_size(void) {
    envmap src = smooth(ENVMAP_CUBE, 32), shape = shape_of(ENVMAP_CUBE, 16, 1);
    envmap_plan n = plan_of(&shape, &src, envmap_lobe_phong(1e5f), 1e-3);
    CHECK(n.method == ENVMAP_METHOD_FAST && n.size >= 30 && n.size <= 34);
    n = plan_of(&shape, &src, envmap_lobe_mirror(), 1e-3);
    CHECK(n.method == ENVMAP_METHOD_AUTO && n.size == 32);
    n = plan_of(&shape, &src, envmap_lobe_ggx(0), 1e-3);
    CHECK(n.method == ENVMAP_METHOD_AUTO && n.size == 32);
    envmap_free(&src);
}

/* ------------------------------------------------------------------------------- rules ---- */

static void bad_input_is_refused(void) {
    envmap src = smooth(ENVMAP_CUBE, 16), shape = shape_of(ENVMAP_CUBE, 8, 1), bad;
    envmap_lobe lobe = envmap_lobe_phong(10), wrong = envmap_lobe_phong(-1);
    envmap_filter_desc desc = desc_of(0, 1e-3);
    envmap_plan plan, before;
    memset(&plan, 7, sizeof plan), before = plan;
    CHECK(envmap_filter_plan(NULL, &shape, &src, &lobe, NULL) == ENVMAP_ERROR_ARGUMENT);
    CHECK(envmap_filter_plan(&plan, NULL, &src, &lobe, NULL) == ENVMAP_ERROR_ARGUMENT);
    CHECK(envmap_filter_plan(&plan, &shape, NULL, &lobe, NULL) == ENVMAP_ERROR_ARGUMENT);
    CHECK(envmap_filter_plan(&plan, &shape, &src, NULL, NULL) == ENVMAP_ERROR_ARGUMENT);
    bad = shape, bad.size = 0;
    CHECK(envmap_filter_plan(&plan, &bad, &src, &lobe, NULL) == ENVMAP_ERROR_ARGUMENT);
    bad = shape, bad.size = 1 << 20;
    CHECK(envmap_filter_plan(&plan, &bad, &src, &lobe, NULL) == ENVMAP_ERROR_ARGUMENT);
    bad = shape, bad.mapping = 9;
    CHECK(envmap_filter_plan(&plan, &bad, &src, &lobe, NULL) == ENVMAP_ERROR_ARGUMENT);
    bad = shape, bad.slices = 0;
    CHECK(envmap_filter_plan(&plan, &bad, &src, &lobe, NULL) == ENVMAP_ERROR_ARGUMENT);
    bad = src, bad.texels = NULL;
    CHECK(envmap_filter_plan(&plan, &shape, &bad, &lobe, NULL) == ENVMAP_ERROR_ARGUMENT);
    desc.tolerance = -1;
    CHECK(envmap_filter_plan(&plan, &shape, &src, &lobe, &desc) == ENVMAP_ERROR_ARGUMENT);
    desc.tolerance = NAN;
    CHECK(envmap_filter_plan(&plan, &shape, &src, &lobe, &desc) == ENVMAP_ERROR_ARGUMENT);
    CHECK(envmap_filter_plan(&plan, &shape, &src, &wrong, NULL) == ENVMAP_ERROR_LOBE);
    wrong = envmap_lobe_function(nan_near_the_axis, NULL);
    CHECK(envmap_filter_plan(&plan, &shape, &src, &wrong, NULL) == ENVMAP_ERROR_LOBE);
    src.texels[5] = NAN;
    CHECK(envmap_filter_plan(&plan, &shape, &src, &lobe, NULL) == ENVMAP_ERROR_RADIANCE);
    src.texels[5] = HUGE_VALF;
    CHECK(envmap_filter_plan(&plan, &shape, &src, &lobe, NULL) == ENVMAP_ERROR_RADIANCE);
    CHECK(!memcmp(&plan, &before, sizeof plan));
    envmap_free(&src);
}

static void extremes_are_planned(void) {
    static const int edges[4] = {1, 2, 7, 33};
    envmap_lobe lobes[6] = {envmap_lobe_diffuse(),       envmap_lobe_phong(0),
                            envmap_lobe_phong(1e9f),     envmap_lobe_ggx(1e-4f),
                            envmap_lobe_banks(0.99999f), envmap_lobe_ggx(1)};
    for (int m = 0; m < ENVMAP_MAPPING_COUNT; ++m)
        for (int e = 0; e < 4; ++e)
            for (int i = 0; i < 6; ++i) {
                envmap src = noise(m, edges[e], 5);
                envmap shape =
                    shape_of((m + e) % ENVMAP_MAPPING_COUNT, edges[3 - e], i == 4 ? 3 : 1);
                envmap_plan n = plan_of(&shape, &src, lobes[i], 1e-2);
                CHECK(n.size >= 1 && n.size <= 16384 && n.bands >= 1 && n.slices >= 1);
                CHECK(n.slices <= 4096 && n.contrast >= 0 && n.contrast < 100);
                CHECK(n.lookup >= 0 && n.lookup < 2 && n.nine >= 0 && n.nine <= 1.001);
                CHECK(n.error >= 0 && n.error <= 1e-2);
                envmap_free(&src);
            }
}

/* A cone that turns from the axis with p, as a callback with a kink. */
static double turning(double x, double p, void *user) {
    (void)user;
    return fmax(x - 0.5 * p, 0);
}

static void lobes_and_sources_with_slices_are_planned(void) {
    envmap src = scene_map(SCENE_STUDIO, ENVMAP_CUBE, 32), two = black(ENVMAP_CUBE, 32, 1, 2);
    envmap shape = shape_of(ENVMAP_CUBE, 12, 2);
    envmap_lobe lobe = envmap_lobe_function(turning, NULL), phong = envmap_lobe_phong(20);
    envmap_plan n, one, both;
    lobe.p0 = 0, lobe.p1 = 1;
    n = plan_of(&shape, &src, lobe, 1e-2);
    CHECK(n.slices > 1 && n.slices <= envmap_lobe_slices(&lobe, 1e-2));
    CHECK(n.method == ENVMAP_METHOD_FAST && n.error < 1e-2);
    for (int k = 0; k < 2; ++k)
        memcpy(envmap_texel(&two, 0, k, 0, 0, 0), src.texels, floats_of(&src) * sizeof(float));
    both = plan_of(&shape, &two, phong, 1e-3);
    one = plan_of(&shape, &src, phong, 1e-3);
    CHECK(both.size == one.size && both.bands == one.bands);
    shape.slices = 3;
    CHECK(envmap_filter_plan(&n, &shape, &two, &phong, NULL) == ENVMAP_ERROR_ARGUMENT);
    envmap_free(&src), envmap_free(&two);
}

static void a_plan_is_the_same_for_any_executor_and_prepared(void) {
    static crew c;
    envmap src = scene_map(SCENE_STUDIO, ENVMAP_LATLONG, 48), shape = shape_of(ENVMAP_CUBE, 16, 1);
    envmap_lobe lobe = envmap_lobe_diffuse();
    envmap_filter_desc desc = desc_of(0, 1e-3);
    envmap_plan a = plan_of(&shape, &src, lobe, 1e-3), b;
    envmap_prepared prepared = {NULL, NULL};
    pthread_mutex_init(&c.lock, NULL);
    c.threads = 3, desc.work.executor.user = &c, desc.work.executor.run = crew_run;
    CHECK(envmap_filter_plan(&b, &shape, &src, &lobe, &desc) == ENVMAP_OK);
    CHECK(!memcmp(&a, &b, sizeof a) && c.runs > 0);
    desc.work.executor.run = NULL;
    CHECK(envmap_prepare(&prepared, &src, &lobe, 1, &desc) == ENVMAP_OK);
    desc.prepared = &prepared;
    CHECK(envmap_filter_plan(&b, &shape, &src, &lobe, &desc) == ENVMAP_OK);
    CHECK(!memcmp(&a, &b, sizeof a));
    envmap_prepared_free(&prepared);
    pthread_mutex_destroy(&c.lock);
    envmap_free(&src);
}

static void planning_without_memory_leaks_nothing(void) {
    envmap_lobe lobes[2] = {envmap_lobe_diffuse(), envmap_lobe_phong(1e6f)};
    int live, context = 0;
    for (int i = 0; i < 2; ++i) {
        envmap src = scene_map(SCENE_SUN, ENVMAP_CUBE, 24 + 24 * !i);
        envmap shape = shape_of(ENVMAP_CUBE, 8, 1);
        envmap_filter_desc desc = desc_of(0, 1e-3);
        envmap_plan plan, before;
        int n = 0, finished = 0;
        memset(&plan, 7, sizeof plan), before = plan;
        desc.work.memory = &context, live = oracle_live;
        for (; n < 500 && !finished; ++n) {
            oracle_calls = 0, oracle_fail_at = n;
            envmap_result result = envmap_filter_plan(&plan, &shape, &src, lobes + i, &desc);
            oracle_fail_at = -1;
            finished = oracle_calls <= n;
            CHECK(oracle_live == live);
            CHECK(result == (finished ? ENVMAP_OK : ENVMAP_ERROR_MEMORY));
            if (!finished) CHECK(!memcmp(&plan, &before, sizeof plan));
        }
        CHECK(finished && n > 1);
        printf("    %d allocations failed, one after the other\n", n - 1);
        envmap_free(&src);
    }
}

static void nothing_leaks(void) { CHECK(oracle_live == 0 && oracle_wrong_context == 0); }

int main(void) {
    RUN(one_light_is_equally_bright_in_every_band);
    RUN(linear_interpolation_loses_what_is_said);
    RUN(lookups_are_weighed_by_solid_angle_inside_the_circle);
    RUN(a_planned_size_is_enough_and_half_of_it_is_not);
    RUN(planned_slices_are_enough_and_half_of_them_are_not);
    RUN(planned_bands_are_enough_and_one_less_is_not);
    RUN(nine_numbers_do_for_an_overcast_sky);
    RUN(a_uniform_scene_needs_one_texel);
    RUN(the_contrast_of_few_texels_is_the_result_s);
    RUN(a_constant_of_few_texels_has_no_contrast);
    RUN(a_scene_turned_by_a_quarter_needs_the_same);
    RUN(expected_errors_are_made_and_below_the_tolerance);
    RUN(slices_are_as_many_for_a_lobe_opposite_to_its_axis);
    RUN(lights_are_for_lobes_with_a_kink_that_have_bands);
    RUN(the_method_is_what_auto_takes);
    RUN(what_is_sharper_than_the_source_needs_its_size);
    RUN(bad_input_is_refused);
    RUN(extremes_are_planned);
    RUN(lobes_and_sources_with_slices_are_planned);
    RUN(a_plan_is_the_same_for_any_executor_and_prepared);
    RUN(planning_without_memory_leaks_nothing);
    RUN(nothing_leaks);
    return test_summary();
}
