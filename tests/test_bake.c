/* SPDX-License-Identifier: MIT
   The command bake, called as a person calls it. What it wrote is read by the readers of
   textures.h, and held against plain sums over the source, in the engine's axes as this file writes
   them down a second time. */
#define _DEFAULT_SOURCE
#ifdef TEST_SHARED
#define ENVMAP_IMPLEMENTATION_ONCE /* envmap.c asks for bodies; they are in the shared object */
#endif
#include "oracle.h"
#define MEMORY_H /* the tool's memory: here it is the oracle's */
#undef _DEFAULT_SOURCE /* which envmap.c defines itself */
#define main tool_main
#include "examples/tool/envmap.c"
#undef main
#include "textures.h"
#include <sys/wait.h>

static char folder[] = "/tmp/envmap-bake-XXXXXX";
static char path[1024], sky[64];

static const char *in_folder(const char *name) {
    snprintf(path, sizeof path, "%s/%s", folder, name);
    return path;
}

static int tool(const char *arguments) {
    char text[1024], *argv[32];
    int argc = 0;
    snprintf(text, sizeof text, "envmap %s", arguments);
    for (char *word = strtok(text, " "); word && argc < 31; word = strtok(NULL, " "))
        argv[argc++] = word;
    argv[argc] = NULL;
    return tool_main(argc, argv);
}

/* bake of the sky, for an engine, into out-ENGINE. */
static int bake(const char *engine, const char *more) {
    char text[512];
    snprintf(text, sizeof text, "bake %s %s/out-%s --for %s --size 64 --levels 5 %s", sky, folder,
             engine, engine, more);
    return tool(text);
}

static texture_file baked(const char *engine, const char *name) {
    char file[128];
    snprintf(file, sizeof file, "out-%s/%s", engine, name);
    const char *end = strrchr(name, '.');
    return !strcmp(end, ".dds")   ? texture_dds(in_folder(file))
           : !strcmp(end, ".ktx") ? texture_ktx1(in_folder(file))
                                  : texture_ktx2(in_folder(file));
}

static char *manifest(const char *engine) {
    char file[128];
    snprintf(file, sizeof file, "out-%s/manifest.json", engine);
    return (char *)texture_open(in_folder(file)).data;
}

/* ------------------------------------------------------------------------------ the source -- */

enum { HEIGHT = 128, WIDTH = 2 * HEIGHT };
static envmap source;
static double towards[HEIGHT * WIDTH][3]; /* of its texels */

/* The terrace under the sun, its sun no brighter than a half can hold. */
static void make_sky(void) {
    CHECK(!envmap_create(&source, ENVMAP_LATLONG, HEIGHT, 1, 1));
    scene_fill(&source, SCENE_SUN);
    for (int i = 0; i < 3 * WIDTH * HEIGHT; ++i) source.texels[i] = fminf(source.texels[i], 9000);
    for (int i = 0; i < WIDTH * HEIGHT; ++i)
        oracle_direction(towards[i], ENVMAP_LATLONG, 0, (i % WIDTH + 0.5) / WIDTH,
                         (i / WIDTH + 0.5) / HEIGHT);
    snprintf(sky, sizeof sky, "%s/sky.pfm", folder);
    CHECK(!envmap_pfm_save(&source, sky, 0));
}

static double texel_omega(int y) {
    return 2 * PI / WIDTH * (cos(PI * y / HEIGHT) - cos(PI * (y + 1) / HEIGHT));
}

/* GGX with n = v = r, from its definition: D at the half vector, times the cosine. */
static double ggx(double x, double alpha) {
    double h = (1 + x) / 2, a2 = alpha * alpha, f = (a2 - 1) * h + 1;
    return x > 0 ? a2 / (PI * f * f) * x : 0;
}

/* Charlie, the same way; the half vector's angle is half of that between n and l. */
static double charlie(double x, double alpha) {
    return x > 0 ? (2 + 1 / alpha) / (2 * PI) * pow(sin(acos(x) / 2), 1 / alpha) * x : 0;
}

/* sum k L w / sum k w over every texel; alpha 0: k is the cosine, below 0: Charlie. */
static void definition(double rgb[3], const double axis[3], double alpha) {
    double norm = 0;
    rgb[0] = rgb[1] = rgb[2] = 0;
    for (int y = 0; y < HEIGHT; ++y) {
        double omega = texel_omega(y);
        for (int x = 0; x < WIDTH; ++x) {
            const double *d = towards[y * WIDTH + x];
            double c = axis[0] * d[0] + axis[1] * d[1] + axis[2] * d[2];
            if (c <= 0) continue;
            double k = omega * (alpha > 0 ? ggx(c, alpha) : alpha < 0 ? charlie(c, -alpha) : c);
            const float *t = source.texels + 3 * (y * WIDTH + x);
            for (int i = 0; i < 3; ++i) rgb[i] += k * (double)t[i];
            norm += k;
        }
    }
    for (int i = 0; i < 3; ++i) rgb[i] /= norm;
}

/* From an engine's direction to ours, engine by engine. */
static void ours_of(double ours[3], const char *engine, const double d[3]) {
    double x = d[0], y = d[1], z = d[2];
    if (!strcmp(engine, "three")) ours[0] = z, ours[1] = y, ours[2] = -x;
    else if (!strcmp(engine, "filament")) ours[0] = -x, ours[1] = y, ours[2] = -z;
    else if (!strcmp(engine, "opengl") || !strcmp(engine, "gltf"))
        ours[0] = x, ours[1] = y, ours[2] = z;
    else ours[0] = x, ours[1] = y, ours[2] = -z; /* d3d, babylon, bevy */
}

/* ------------------------------------------------------------------------------- the files -- */

/* Relative rms over `count` texels of a level of the file. */
static double level_error(const texture_file *file, const char *engine, int level, double alpha,
                          int count) {
    int edge = texture_file_width(file, level);
    unsigned long long seed = 5;
    double error = 0, all = 0;
    for (int i = 0; i < count; ++i) {
        int face = i % 6, x = (int)(edge * test_random(&seed)),
            y = (int)(edge * test_random(&seed));
        double d[3], ours[3], want[3], got[3];
        oracle_direction(d, ENVMAP_CUBE, face, (x + 0.5) / edge, (y + 0.5) / edge);
        ours_of(ours, engine, d);
        definition(want, ours, alpha);
        CHECK(texture_file_texel(got, file, level, face, x, y));
        for (int c = 0; c < 3; ++c)
            error += (got[c] - want[c]) * (got[c] - want[c]), all += want[c] * want[c];
    }
    return sqrt(error / all);
}

/* The tolerance, 1e-3, and what the format loses: half a unit in the last place at most. */
static void check_engine(const char *engine, const char *end, double format, double bend,
                         int count) {
    char name[64], what[96];
    CHECK(bake(engine, "--threads 2") == 0);
    snprintf(name, sizeof name, "specular.%s", end);
    texture_file file = baked(engine, name);
    CHECK(file.good && file.levels == 5 && file.faces == 6 && file.width == 64);
    for (int l = 1; l < 5 && file.good; ++l) {
        double level = l / 4.0, r = bend > 0 ? 1 - sqrt(1 - level) : level; /* r (2 - r) = level */
        snprintf(what, sizeof what, "%s: level %d, %d texels, relative rms", engine, l, count);
        FIGURE(what, level_error(&file, engine, l, r * r, count), 1e-3 + format);
    }
    texture_file_free(&file);
    snprintf(name, sizeof name, "irradiance.%s", end);
    file = baked(engine, name);
    snprintf(what, sizeof what, "%s: irradiance, %d texels, relative rms", engine, count);
    FIGURE(what, level_error(&file, engine, 0, 0, count), 1e-3 + format);
    texture_file_free(&file);
}

static void opengl_gets_every_level_within_the_tolerance(void) {
    check_engine("opengl", "ktx2", 0.0005, 0, test_many(200));
}
static void d3d_gets_its_axes(void) { check_engine("d3d", "dds", 0.0005, 0, test_many(200)); }
static void three_gets_its_axes(void) { check_engine("three", "ktx2", 0.0005, 0, test_many(200)); }
static void bevy_gets_its_format(void) { check_engine("bevy", "ktx2", 0.002, 0, test_many(200)); }
static void gltf_gets_every_level(void) { check_engine("gltf", "ktx2", 0.0005, 0, test_many(50)); }
static void filament_gets_its_bend(void) {
    check_engine("filament", "ktx", 1.0 / 64, 1, test_many(200));
}

/* Babylon's level is 0.8 log2(edge alpha). */
static void babylon_gets_its_levels(void) {
    char what[64];
    CHECK(bake("babylon", "--threads 2") == 0);
    texture_file file = baked("babylon", "specular.dds");
    CHECK(file.good && file.levels == 5);
    for (int l = 2; l < 5 && file.good; ++l) {
        snprintf(what, sizeof what, "babylon: level %d, relative rms", l);
        FIGURE(what, level_error(&file, "babylon", l, pow(2, l / 0.8) / 64, test_many(50)), 1.5e-3);
    }
    texture_file_free(&file);
}

/* Level 0 is the picture itself: each texel the mean of what it covers. */
static void check_first_level(const char *engine, const char *name) {
    char what[96];
    texture_file file = baked(engine, name);
    double error = 0, all = 0;
    unsigned long long seed = 9;
    CHECK(file.good);
    for (int i = 0; i < 200 && file.good; ++i) {
        int face = i % 6, x = (int)(64 * test_random(&seed)), y = (int)(64 * test_random(&seed));
        double want[3] = {0, 0, 0}, weight = 0, got[3];
        for (int k = 0; k < 64 * 64; ++k) {
            double e[3], d[3], u, v, X = (x + (k % 64 + 0.5) / 64) / 32 - 1,
                                     Y = (y + (k / 64 + 0.5) / 64) / 32 - 1;
            double w = pow(1 + X * X + Y * Y, -1.5);
            int f;
            oracle_direction(e, ENVMAP_CUBE, face, (X + 1) / 2, (Y + 1) / 2);
            ours_of(d, engine, e);
            oracle_coordinates(&f, &u, &v, ENVMAP_LATLONG, d);
            const float *t = source.texels + 3 * ((int)fmin(v * HEIGHT, HEIGHT - 1) * WIDTH +
                                                  (int)fmin(u * WIDTH, WIDTH - 1));
            for (int c = 0; c < 3; ++c) want[c] += w * (double)t[c];
            weight += w;
        }
        CHECK(texture_file_texel(got, &file, 0, face, x, y));
        for (int c = 0; c < 3; ++c) {
            want[c] /= weight;
            error += (got[c] - want[c]) * (got[c] - want[c]), all += want[c] * want[c];
        }
    }
    snprintf(what, sizeof what, "%s: level 0, 200 texels, relative rms", engine);
    FIGURE(what, sqrt(error / all), 0.02);
    texture_file_free(&file);
}

static void the_first_level_is_the_picture(void) {
    check_first_level("opengl", "specular.ktx2");
    check_first_level("d3d", "specular.dds");
    check_first_level("three", "specular.ktx2");
    check_first_level("filament", "specular.ktx");
}

/* alpha is roughness squared, as of GGX; level 0's is the least there is. */
static void a_chain_of_sheen_is_charlies(void) {
    char what[64];
    CHECK(bake("opengl", "--threads 2 --lobe charlie --size 8 --levels 3") == 0);
    texture_file file = baked("opengl", "specular.ktx2");
    CHECK(file.good && file.levels == 3);
    for (int l = 0; l < 3 && file.good; ++l) {
        double r = l / 2.0;
        snprintf(what, sizeof what, "charlie: level %d, relative rms", l);
        FIGURE(what, level_error(&file, "opengl", l, -fmax(r * r, PI / 2 / 64), test_many(50)),
               1.5e-3); /* the source is as fine as a cube of 64 */
    }
    texture_file_free(&file);
    CHECK(bake("opengl", "--lobe banks") == USAGE_ERROR);
}

/* A ring thinner than the source's texels would take the filter two hundred times as long. */
static void a_chain_of_sheen_is_quick_where_sources_are_small(void) {
    envmap small = {0};
    char text[512];
    double seconds_of[2];
    CHECK(!envmap_create(&small, ENVMAP_LATLONG, 32, 1, 1));
    scene_fill(&small, SCENE_SUN);
    CHECK(!envmap_pfm_save(&small, in_folder("small.pfm"), 0));
    for (int k = 0; k < 2; ++k) {
        clock_t begun = clock();
        snprintf(text, sizeof text, "bake %s/small.pfm %s/small --threads 1 --lobe %s", folder,
                 folder, k ? "charlie" : "ggx");
        CHECK(tool(text) == 0);
        seconds_of[k] = (double)(clock() - begun) / CLOCKS_PER_SEC;
    }
    FIGURE("charlie's time over GGX's, small source", seconds_of[1] / seconds_of[0], 15);
    envmap_free(&small);
}

/* The same integral over angles instead of cosines, four times as dense. */
static double sheen(double nv, double alpha) {
    double sum = 0;
    for (int i = 0; i < 400 * 100; ++i) {
        double theta = PI / 2 * (i / 100 + 0.5) / 400, phi = PI * (i % 100 + 0.5) / 100;
        double nl = cos(theta), lv = nl * nv + sin(theta) * sqrt(1 - nv * nv) * cos(phi);
        double nh = (nl + nv) / sqrt(2 + 2 * lv), D;
        D = (2 + 1 / alpha) / (2 * PI) * pow(sqrt(fmax(0, 1 - nh * nh)), 1 / alpha);
        sum += D * nl * sin(theta) / (4 * (nl + nv - nl * nv));
    }
    return sum * (PI / 2 / 400) * (2 * PI / 100);
}

static void the_table_has_sheen_where_asked(void) {
    double rgb[3], worst = 0;
    texture_file file = baked("opengl", "split-sum.ktx2");
    CHECK(texture_file_texel(rgb, &file, 0, 0, 20, 40) && rgb[2] == 0);
    texture_file_free(&file);
    CHECK(bake("opengl", "--sheen --threads 2") == 0);
    file = baked("opengl", "split-sum.ktx2");
    CHECK(file.good);
    for (int i = 5; i < 64 * 64 && file.good; i += 129) {
        double r = (i / 64 + 0.5) / 64, want = sheen((i % 64 + 0.5) / 64, fmax(r * r, 0.01));
        CHECK(texture_file_texel(rgb, &file, 0, 0, i % 64, i / 64));
        worst = fmax(worst, fabs(rgb[2] - want) / fmax(1, want));
    }
    FIGURE("sheen: worst error", worst, 1e-3);
    texture_file_free(&file);
}

static void the_table_is_the_split_sum(void) {
    texture_file file = baked("opengl", "split-sum.ktx2");
    double worst = 0;
    CHECK(file.good && file.width == 64 && file.faces == 1);
    for (int i = 0; i < 64 * 64 && file.good; i += 61) {
        double rgb[3], scale, bias, r = (i / 64 + 0.5) / 64;
        envmap_ggx_split_sum(&scale, &bias, (i % 64 + 0.5) / 64, r * r);
        CHECK(texture_file_texel(rgb, &file, 0, 0, i % 64, i / 64));
        worst = fmax(worst, fmax(fabs(rgb[0] - scale), fabs(rgb[1] - bias)));
    }
    FIGURE("split sum: worst error", worst, 5e-4);
    texture_file_free(&file);
}

/* ----------------------------------------------------------------------------- the manifest -- */

/* Numbers behind "name": , brackets left out; returns how many. */
static int numbers(double *out, int room, const char *text, const char *name) {
    char key[64];
    int count = 0, depth = 0;
    snprintf(key, sizeof key, "\"%s\": ", name);
    const char *at = text ? strstr(text, key) : NULL;
    if (!at) return 0;
    at += strlen(key);
    do {
        while (*at == '[' || *at == ']' || *at == ',' || *at == ' ')
            depth += (*at == '[') - (*at == ']'), ++at;
        char *end;
        double value = strtod(at, &end);
        if (end == at) break;
        out[count++] = value, at = end;
    } while (count < room && depth > 0);
    return count;
}

/* The nine numbers are the source's coefficients in three.js' axes, by that basis: LightProbe's. */
static void the_nine_numbers_are_in_the_engines_axes(void) {
    double got[27], want[27] = {0}, worst = 0;
    char *text = manifest("three");
    CHECK(numbers(got, 27, text, "radiance") == 27);
    for (int y = 0; y < HEIGHT; ++y)
        for (int x = 0; x < WIDTH; ++x) {
            double o[3], w = texel_omega(y);
            oracle_direction(o, ENVMAP_LATLONG, 0, (x + 0.5) / WIDTH, (y + 0.5) / HEIGHT);
            double X = -o[2], Y = o[1], Z = o[0]; /* the picture's middle, our -z, is three's +x */
            double basis[9] = {0.282095,
                               0.488603 * Y,
                               0.488603 * Z,
                               0.488603 * X,
                               1.092548 * X * Y,
                               1.092548 * Y * Z,
                               0.315392 * (3 * Z * Z - 1),
                               1.092548 * X * Z,
                               0.546274 * (X * X - Y * Y)};
            for (int k = 0; k < 27; ++k)
                want[k] += basis[k / 3] * w * (double)source.texels[3 * (y * WIDTH + x) + k % 3];
        }
    for (int k = 0; k < 27; ++k) worst = fmax(worst, fabs(got[k] - want[k]) / want[0]);
    FIGURE("nine numbers: worst error, of the first", worst, 2e-3);
    free(text);
}

static double next_number(const char **text) {
    char *end;
    double value = strtod(*text, &end);
    *text = end;
    return value;
}

/* Filament's key: polynomials of the normal that are irradiance / pi. */
static void filaments_key_evaluates_to_irradiance(void) {
    texture_file file = baked("filament", "specular.ktx");
    const char *text = texture_value(&file, "sh");
    double sh[27], n[3] = {0.36, 0.48, 0.8}, got[3] = {0}, want[3] = {0}, worst = 0, sums[27];
    char *t = manifest("filament");
    CHECK(text && numbers(sums, 27, t, "irradiance_over_pi") == 27);
    for (int k = 0; k < 27 && text; ++k) sh[k] = next_number(&text);
    double basis[9] = {1,
                       n[1],
                       n[2],
                       n[0],
                       n[1] * n[0],
                       n[1] * n[2],
                       3 * n[2] * n[2] - 1,
                       n[2] * n[0],
                       n[0] * n[0] - n[1] * n[1]};
    double Y[9];
    envmap_sh_basis(Y, 3, n);
    for (int c = 0; c < 3; ++c) {
        for (int k = 0; k < 9; ++k)
            got[c] += basis[k] * sh[3 * k + c], want[c] += Y[k] * sums[3 * k + c];
        worst = fmax(worst, fabs(got[c] / want[c] - 1));
    }
    FIGURE("filament's key against the nine numbers", worst, 1e-6);
    texture_file_free(&file);
    free(t);
}

/* What --verify measures is what this test measures, and the tolerance is kept. */
static void check_manifest(const char *engine, const char *end, double format, double bend) {
    char name[64], *text, *at;
    snprintf(name, sizeof name, "specular.%s", end);
    CHECK(bake(engine, "--verify 200") == 0);
    texture_file file = baked(engine, name);
    at = text = manifest(engine);
    for (int l = 0; l < 5; ++l) {
        at = strstr(at, "\"measured_rms\": ") + 16;
        double said = strncmp(at, "null", 4) ? strtod(at, NULL) : -1, level = l / 4.0;
        double r = bend > 0 ? 1 - sqrt(1 - level) : level;
        if (l == 0) CHECK(said < 0); /* the mirror: another definition */
        if (l < 2) continue;
        double own = level_error(&file, engine, l, r * r, test_many(200));
        printf("    %s, level %d: the manifest says %.3g, here it is %.3g\n", engine, l, said, own);
        CHECK(said > 0 && said < 1e-3 + format);
        CHECK(said < 3 * own && own < 3 * said);
    }
    texture_file_free(&file);
    free(text);
}

static void the_manifests_errors_are_true(void) {
    check_manifest("opengl", "ktx2", 0.0005, 0);
    check_manifest("d3d", "dds", 0.0005, 0);
    check_manifest("bevy", "ktx2", 0.002, 0);
    check_manifest("filament", "ktx", 1.0 / 64, 1);
}

static void every_engine_has_its_word_and_turns_axes_by_right_angles(void) {
    for (int k = 0; k < BAKE_PRESETS; ++k) {
        const bake_preset *p = &bake_presets[k];
        CHECK(!strcmp(p->name, bake_words[k]));
        CHECK(abs(p->axes[0]) * abs(p->axes[1]) * abs(p->axes[2]) == 6);
        CHECK(abs(p->axes[0]) + abs(p->axes[1]) + abs(p->axes[2]) == 6);
        float ours[3], engine[3] = {1, 2, 3};
        double back[3], from[3];
        bake_to_ours(ours, p, engine);
        for (int c = 0; c < 3; ++c) from[c] = (double)ours[c];
        bake_to_engine(back, p, from);
        for (int c = 0; c < 3; ++c) CHECK(back[c] == c + 1);
        for (int l = 0; l < 6; ++l) {
            double r = bake_roughness(p, 64, l, 6, -1);
            CHECK(r >= 0 && r <= 1 + 1e-9 && (l > 0 || r < 1e-6));
        }
    }
    CHECK(!bake_words[BAKE_PRESETS]);
}

/* ---------------------------------------------------------------------------------- the sun -- */

static void energy(double sum[3], const envmap *map) {
    sum[0] = sum[1] = sum[2] = 0;
    for (int i = 0; i < WIDTH * HEIGHT; ++i)
        for (int c = 0; c < 3; ++c)
            sum[c] += texel_omega(i / WIDTH) * (double)map->texels[3 * i + c];
}

static void the_sun_and_the_rest_are_the_whole(void) {
    envmap map = {0};
    bake_light lights[BAKE_LIGHTS];
    double whole[3], rest[3], off = 0;
    CHECK(!envmap_create(&map, ENVMAP_LATLONG, HEIGHT, 1, 1));
    scene_fill(&map, SCENE_SUN);
    energy(whole, &map);
    int count = bake_take_lights(lights, &map);
    CHECK(count == 1);
    energy(rest, &map);
    for (int c = 0; c < 3; ++c)
        off = fmax(off, fabs((rest[c] + lights[0].irradiance[c]) / whole[c] - 1));
    FIGURE("light + rest over the whole, less 1", off, 1e-6);
    double d[3];
    for (int c = 0; c < 3; ++c) d[c] = (double)scene_sun_direction[c];
    FIGURE("where the sun stands, degrees off", oracle_angle(d, lights[0].direction) * 180 / PI, 1);
    for (int c = 0; c < 3; ++c)
        CHECK_CLOSE(lights[0].irradiance[c] / (double)scene_sun_flux[c], 1, 0.05);
    CHECK(lights[0].diameter > 0.1 && lights[0].diameter < 3);
    float rgb[3];
    envmap_lookup(rgb, &map, scene_sun_direction, 0);
    FIGURE("what is left where the sun was, of its radiance", (double)rgb[0] / (20.5 / 6e-5), 1e-3);
    envmap_free(&map);
}

static void an_overcast_sky_has_no_sun(void) {
    envmap map = {0}, before = {0};
    bake_light lights[BAKE_LIGHTS];
    CHECK(!envmap_create(&map, ENVMAP_LATLONG, 64, 1, 1));
    CHECK(!envmap_create(&before, ENVMAP_LATLONG, 64, 1, 1));
    scene_fill(&map, SCENE_OVERCAST), scene_fill(&before, SCENE_OVERCAST);
    CHECK(bake_take_lights(lights, &map) == 0);
    CHECK(!memcmp(map.texels, before.texels, 64 * 128 * 3 * sizeof(float)));
    envmap_free(&map), envmap_free(&before);
}

/* Zonal coefficients of a light: it is zonal about its own direction, so they are all of it. */
static void zh3_is_exact_for_one_light(void) {
    bake_job *j = (bake_job *)calloc(1, sizeof *j);
    double d[3] = {0.48, 0.6, 0.64}, Y[9];
    envmap_sh_basis(Y, 3, d);
    for (int k = 0; k < 27; ++k) j->sh[k] = Y[k / 3] * (1 + k % 3);
    bake_zonal(j);
    for (int k = 0; k < 3; ++k) CHECK_CLOSE(j->axis[k], d[k], 1e-12);
    for (int k = 12; k < 27; ++k)
        CHECK_CLOSE(j->zonal[k % 3] * 1.5853309190424043 * Y[k / 3], j->sh[k], 1e-12);
    free(j);
}

/* ---------------------------------------------------------------------------------- manners -- */

/* Every file but the manifest, which has times. */
static void threads_change_no_bit(void) {
    static const char *const names[] = {"specular.ktx2", "irradiance.ktx2", "split-sum.ktx2",
                                        "environment.hdr", "preview.png"};
    unsigned char *first[5];
    size_t sizes[5];
    char text[128];
    for (int threads = 1; threads <= 5; threads += 2) {
        snprintf(text, sizeof text, "--sun --sheen --threads %d", threads);
        CHECK(bake("three", text) == 0);
        for (int k = 0; k < 5; ++k) {
            snprintf(text, sizeof text, "out-three/%s", names[k]);
            texture_file file = texture_open(in_folder(text));
            CHECK(file.data && file.size > 100);
            if (threads == 1) first[k] = file.data, sizes[k] = file.size;
            else {
                CHECK(file.size == sizes[k] && !memcmp(file.data, first[k], sizes[k]));
                texture_file_free(&file);
            }
        }
    }
    for (int k = 0; k < 5; ++k) free(first[k]);
}

static int file_is_there(const char *name) {
    struct stat about;
    return !stat(in_folder(name), &about);
}

static void engines_that_filter_for_themselves_get_a_picture(void) {
    static const char *const engines[] = {"godot", "unity", "unreal"};
    char text[512];
    for (int k = 0; k < 3; ++k) {
        snprintf(text, sizeof text, "bake %s %s/out-%s --for %s --sun", sky, folder, engines[k],
                 engines[k]);
        CHECK(tool(text) == 0);
        snprintf(text, sizeof text, "out-%s/environment.hdr", engines[k]);
        texture_file file = texture_hdr(in_folder(text));
        CHECK(file.good && file.width == WIDTH && file.height == HEIGHT);
        texture_file_free(&file);
        snprintf(text, sizeof text, "out-%s/specular.ktx2", engines[k]);
        CHECK(!file_is_there(text));
        snprintf(text, sizeof text, "out-%s/preview.png", engines[k]);
        CHECK(file_is_there(text));
    }
}

static void options_that_would_do_nothing_are_refused(void) {
    static const char *const idle[] = {"--size 8",   "--levels 3", "--bend 1",
                                       "--lobe ggx", "--sheen",    "--tolerance 1e-2",
                                       "--verify 9"};
    static const char *const engines[] = {"godot", "unity", "unreal"};
    char text[512];
    for (int k = 0; k < 21; ++k) {
        snprintf(text, sizeof text, "bake %s %s/idle --for %s %s", sky, folder, engines[k % 3],
                 idle[k / 3]);
        CHECK(tool(text) == USAGE_ERROR && !file_is_there("idle"));
    }
}

static void a_manifest_says_what_was_not_measured(void) {
    CHECK(bake("opengl", "--threads 2") == 0);
    char *text = manifest("opengl");
    CHECK(text && strstr(text, "\"measured\": \"not measured: --verify 200"));
    CHECK(text && strstr(text, "\"texels_measured\": 0") && !strstr(text, "\"measured_rms\": 0"));
    free(text);
    CHECK(bake("opengl", "--threads 2 --verify 32") == 0);
    text = manifest("opengl");
    CHECK(text && !strstr(text, "not measured") && strstr(text, "\"texels_measured\": 32"));
    free(text);
}

static void a_folder_is_baked_picture_by_picture(void) {
    char text[512];
    mkdir(in_folder("many"), 0777);
    CHECK(!envmap_pfm_save(&source, in_folder("many/a.pfm"), 0));
    CHECK(!envmap_pfm_save(&source, in_folder("many/b.pfm"), 0));
    FILE *bad = fopen(in_folder("many/c.pfm"), "w");
    fputs("PF\n4 2\n-1\n", bad), fclose(bad);
    snprintf(text, sizeof text, "bake %s/many %s/outs --size 16 --levels 3", folder, folder);
    CHECK(tool(text) == FILE_ERROR); /* for c, and a and b are done */
    CHECK(file_is_there("outs/a/manifest.json") && file_is_there("outs/b/manifest.json"));
    CHECK(!file_is_there("outs/c"));
}

static void what_is_stopped_leaves_no_manifest_and_no_half_file(void) {
    CHECK(bake("opengl", "") == 0 && file_is_there("out-opengl/manifest.json"));
    bake_stopped = 1;
    CHECK(bake("gltf", "") == RANGE_ERROR);
    bake_stopped = 0;
    CHECK(bake("d3d", "--size 8 --levels 2") == 0);
    CHECK(file_is_there("out-d3d/manifest.json"));
}

/* bake in a process of its own, which gets a signal after so many microseconds; 0: none. Returns
   what waitpid says. */
static int bake_stopped_after(const char *out, long microseconds, int signal_number) {
    char text[512];
    int status = -1;
    fflush(NULL);
    pid_t child = fork();
    if (child == 0) {
        if (!freopen("/dev/null", "w", stdout) || !freopen("/dev/null", "w", stderr)) _exit(126);
        snprintf(text, sizeof text, "bake %s %s/%s --for three --size 64 --levels 5", sky, folder,
                 out);
        _exit(tool(text));
    }
    struct timespec pause = {microseconds / 1000000, microseconds % 1000000 * 1000};
    if (microseconds) nanosleep(&pause, NULL), kill(child, signal_number);
    CHECK(waitpid(child, &status, 0) == child);
    return status;
}

/* Files in a folder; CHECKs that those with a name of bake's are whole. */
static int whole_files(const char *out) {
    char file[512];
    struct dirent *entry;
    int count = 0;
    DIR *directory = opendir(in_folder(out));
    while (directory && (entry = readdir(directory)) != NULL) {
        const char *end = strrchr(entry->d_name, '.');
        snprintf(file, sizeof file, "%s/%.200s", out, entry->d_name);
        count += entry->d_name[0] != '.';
        if (!strcmp(end, ".ktx2") || !strcmp(end, ".hdr")) {
            texture_file t = end[1] == 'k' ? texture_ktx2(in_folder(file))
                                           : texture_hdr(in_folder(file));
            CHECK(t.good);
            texture_file_free(&t);
        }
    }
    if (directory) closedir(directory);
    return count;
}

/* At sixteen times of a bake. One that is killed may leave a temporary file, never a half one. */
static void a_signal_at_any_time_leaves_no_half_file(void) {
    double begun = seconds();
    CHECK(bake_stopped_after("whole", 0, 0) == 0 && whole_files("whole") == 6);
    double whole = 1e6 * (seconds() - begun);
    int stopped = 0;
    for (int k = 0; k < 16; ++k) {
        char out[64], file[96];
        snprintf(out, sizeof out, "stopped-%d", k);
        snprintf(file, sizeof file, "%s/manifest.json", out);
        int killed = k % 4 == 3;
        int status =
            bake_stopped_after(out, 1000 + (long)(whole * k / 15), killed ? SIGKILL : SIGTERM);
        int count = whole_files(out), done = file_is_there(file);
        CHECK(killed || WIFSIGNALED(status) || WEXITSTATUS(status) == (done ? DONE : RANGE_ERROR));
        CHECK(done ? count >= 6 : killed || count < 6);
        stopped += !done;
    }
    printf("    %d of 16 were stopped on their way\n", stopped);
    CHECK(stopped >= 2);
}

static void where_nothing_can_be_written_it_says_so(void) {
    char text[256];
    snprintf(text, sizeof text, "bake %s /dev/null/out --size 8", sky);
    CHECK(tool(text) == FILE_ERROR);
    snprintf(text, sizeof text, "bake %s/nothing.hdr %s/never --size 8", folder, folder);
    CHECK(tool(text) == FILE_ERROR && !file_is_there("never"));
}

int main(void) {
    char text[128];
    if (!mkdtemp(folder)) return 1;
    RUN(make_sky);
    RUN(every_engine_has_its_word_and_turns_axes_by_right_angles);
    RUN(opengl_gets_every_level_within_the_tolerance);
    RUN(the_table_is_the_split_sum);
    RUN(d3d_gets_its_axes);
    RUN(three_gets_its_axes);
    RUN(bevy_gets_its_format);
    RUN(gltf_gets_every_level);
    RUN(filament_gets_its_bend);
    RUN(babylon_gets_its_levels);
    RUN(the_first_level_is_the_picture);
    RUN(a_chain_of_sheen_is_charlies);
    RUN(a_chain_of_sheen_is_quick_where_sources_are_small);
    RUN(the_table_has_sheen_where_asked);
    RUN(the_nine_numbers_are_in_the_engines_axes);
    RUN(filaments_key_evaluates_to_irradiance);
    RUN(the_manifests_errors_are_true);
    RUN(the_sun_and_the_rest_are_the_whole);
    RUN(an_overcast_sky_has_no_sun);
    RUN(zh3_is_exact_for_one_light);
    RUN(threads_change_no_bit);
    RUN(engines_that_filter_for_themselves_get_a_picture);
    RUN(options_that_would_do_nothing_are_refused);
    RUN(a_manifest_says_what_was_not_measured);
    RUN(a_folder_is_baked_picture_by_picture);
    RUN(what_is_stopped_leaves_no_manifest_and_no_half_file);
    RUN(a_signal_at_any_time_leaves_no_half_file);
    RUN(where_nothing_can_be_written_it_says_so);
    envmap_free(&source);
    snprintf(text, sizeof text, "rm -rf %s", folder);
    return system(text) != 0 || test_summary();
}
