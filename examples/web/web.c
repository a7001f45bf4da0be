/* web.c - the library as a page calls it: one module of WebAssembly without imports.

   What you will see: `make web` puts it into build/envmap.html, a page that filters in a worker and
   draws with WebGL2. Numbers go in and out as ints, floats and addresses of floats in the module's
   memory; calls that can fail return an envmap_result, and web_message has its text.

   >>maps      the places of maps, and the environment: a scene, a file, a sun added to it
   >>filter    a lobe, a method, a level of a map
   >>sun       the sun by itself, while it moves
   >>outcome   error, harmonics, fit, fan, split sum
   >>picture   the ball as the CPU draws it: what the test holds WebGL against
   >>files     what the tool's writers make of a map
   >>meshes

   SPDX-License-Identifier: MIT */

#define ENVMAP_NO_STDIO
#define ENVMAP_IMPLEMENTATION
#include "envmap.h"

#include "../gl/mesh.h"
#include "../methods/box_levels.h"
#include "../methods/faults.h"
#include "../methods/importance_sampling.h"
#include "../tool/brdfs.h"
#include "../tool/scenes.h"
#include <stdarg.h>
#include <stdio.h>

/* For the tool's readers and writers: printf itself would need imports for its files. Knows %d and
   strings. */
static int web_print(char *out, size_t room, const char *format, va_list values) {
    size_t n = 0;
    for (; *format; format++) {
        char number[12], *text = number + 11;
        number[11] = 0;
        if (*format != '%') *--text = *format;
        else if (*++format == 'd') {
            int value = va_arg(values, int);
            do *--text = (char)('0' + value % 10);
            while ((value /= 10) > 0);
        } else {
            text = va_arg(values, char *);
            while (*format != 's') format++; /* %.60s */
        }
        for (; *text && n + 1 < room; n++) out[n] = *text++;
    }
    if (room) out[n] = 0;
    return (int)n;
}
static int web_printf(char *out, size_t room, const char *format, ...) {
    va_list values;
    int count;
    va_start(values, format);
    count = web_print(out, room, format, values);
    va_end(values);
    return count;
}
#define vsnprintf web_print
#define snprintf  web_printf
#include "memory_file.h"

#include "../tool/image.h"
#include "../tool/read_hdr.h"
#include "../tool/write_texels.h"

#include "../tool/write_hdr.h"
#include "../tool/write_ktx.h"

#ifdef __wasm__
#define WEB_CALL(name) __attribute__((export_name(#name)))
#else
#define WEB_CALL(name)
#endif

/* ------------------------------------------------------------------------------------ >>maps -- */

/* SKY is the scene or file; LIT has the sun added; CHAIN and MAP, which are drawn, METHOD and
   TRUTH, one map by two methods, are LIT filtered. SKY_CHAIN and SKY_MAP are SKY filtered. */
enum {
    WEB_SKY,
    WEB_LIT,
    WEB_CHAIN,
    WEB_MAP,
    WEB_METHOD,
    WEB_TRUTH,
    WEB_SKY_CHAIN,
    WEB_SKY_MAP,
    WEB_MAPS
};
static envmap web_maps[WEB_MAPS];
static envmap_prepared web_prepared;
static float web_numbers[4096]; /* what calls hand back; large enough for the longest, a ramp */
static char web_words[256];

WEB_CALL(web_buffer) void *web_buffer(int bytes) {
    return bytes > 0 ? malloc((size_t)bytes) : NULL;
}
WEB_CALL(web_release) void web_release(void *p) { free(p); }
WEB_CALL(web_floats) float *web_floats(void) { return web_numbers; }
WEB_CALL(web_text) char *web_text(void) { return web_words; }

WEB_CALL(web_message) const char *web_message(int result) {
    return result < 0 ? web_words : envmap_result_text(result);
}

WEB_CALL(web_map_texels) float *web_map_texels(int map, int level) {
    return envmap_texel(web_maps + map, level, 0, 0, 0, 0);
}
WEB_CALL(web_map_size) int web_map_size(int map) { return web_maps[map].size; }

/* The new map takes the old one's place only when there is one. */
static envmap_result web_put(int map, envmap *made) {
    envmap_free(web_maps + map);
    web_maps[map] = *made;
    return ENVMAP_OK;
}

WEB_CALL(web_create)
int web_create(int map, int mapping, int size, int levels, int slices) {
    envmap made = {0}, *old = web_maps + map;
    envmap_result result;
    if (old->texels && old->mapping == mapping && old->size == size && old->levels == levels &&
        old->slices == slices)
        return ENVMAP_OK;
    result = envmap_create(&made, mapping, size, levels, slices);
    return result ? (int)result : (int)web_put(map, &made);
}

/* `quick`: one sample a texel instead of nine. */
WEB_CALL(web_scene) int web_scene(int scene, int size, int quick) {
    envmap_result result;
    envmap made = {0};
    int x, y;
    result = envmap_create(&made, ENVMAP_LATLONG, size, 1, 1);
    if (result) return result;
    for (y = 0; y < size && quick; y++)
        for (x = 0; x < 2 * size; x++) {
            float d[3];
            envmap_direction(d, ENVMAP_LATLONG, 0, ((float)x + 0.5f) / (float)(2 * size),
                             ((float)y + 0.5f) / (float)size);
            scene_radiance(envmap_texel(&made, 0, 0, 0, x, y), d, scene);
        }
    if (!quick) scene_fill(&made, scene);
    else if (scene == SCENE_SUN) scene_add_sun(&made);
    return web_put(WEB_SKY, &made);
}

/* NaN and negative numbers become 0, and Inf what fits into half floats with room for sums. */
static int web_take(envmap *made, envmap_result result) {
    if (!result) result = envmap_clean(made, 0, NULL);
    if (!result && made->mapping != ENVMAP_LATLONG) { /* the sun is added to a lat-long */
        envmap turned = {0};
        result = envmap_create(&turned, ENVMAP_LATLONG, 2 * made->size, 1, 1);
        if (!result) result = envmap_resample(&turned, made, NULL);
        envmap_free(made);
        *made = turned;
    }
    if (!result) return web_put(WEB_SKY, made);
    envmap_free(made);
    return result;
}

WEB_CALL(web_open_pfm) int web_open_pfm(const void *data, int bytes) {
    envmap made = {0};
    envmap_result result = envmap_pfm_read(&made, data, (size_t)bytes, ENVMAP_LATLONG);
    if (result == ENVMAP_ERROR_SHAPE)
        result = envmap_pfm_read(&made, data, (size_t)bytes, ENVMAP_CUBE);
    return web_take(&made, result);
}

/* -1: web_text says why not. */
WEB_CALL(web_open_hdr) int web_open_hdr(const void *data, int bytes) {
    envmap made = {0};
    image p = {0};
    int result = -1;
    if (!hdr_read(&p, (const unsigned char *)data, (size_t)bytes))
        memcpy(web_words, p.error, sizeof web_words);
    else if (p.width != 2 * p.height) result = ENVMAP_ERROR_SHAPE;
    else if (!(result = envmap_create(&made, ENVMAP_LATLONG, p.height, 1, 1))) {
        memcpy(made.texels, p.rgb, image_floats(&p) * sizeof *p.rgb);
        result = web_take(&made, ENVMAP_OK);
    }
    image_free(&p);
    return result;
}

/* The sun is a small disc, brightest in its middle: a tent, whose radius is two texels of SKY's
   equator. */
static const float web_sun_colour[3] = {1.1f, 1, 0.8f};
static float web_sun_radius(void) { return MESH_TURN / (float)web_maps[WEB_SKY].size; }

static float web_tent(const envmap *map, const float d[3], int x, int y) {
    float c[3];
    envmap_direction(c, ENVMAP_LATLONG, 0, ((float)x + 0.5f) / (float)(2 * map->size),
                     ((float)y + 0.5f) / (float)map->size);
    return fmaxf(0, 1 - acosf(fminf(1, mesh_dot(c, d))) / web_sun_radius());
}

/* LIT = SKY and a sun in direction d, whose light is `flux` (radiance * sr) in green. */
WEB_CALL(web_light)
int web_light(float dx, float dy, float dz, float flux) {
    const envmap *sky = web_maps + WEB_SKY;
    envmap *lit = web_maps + WEB_LIT;
    float d[3] = {dx, dy, dz}, row;
    double total = 0;
    int pass, x, y, c, result = web_create(WEB_LIT, ENVMAP_LATLONG, sky->size, 1, 1);
    if (result) return result;
    envmap_prepared_free(&web_prepared);
    memcpy(lit->texels, sky->texels, method_floats(sky) * sizeof(float));
    mesh_unit(d);
    row = acosf(d[1]) * (float)sky->size / (MESH_TURN / 2);
    for (pass = 0; pass < 2 && flux > 0; pass++)
        for (y = (int)fmaxf(0, row - 3); y < sky->size && (float)y < row + 3; y++)
            for (x = 0; x < 2 * sky->size; x++) {
                float w = web_tent(sky, d, x, y), *texel = envmap_texel(lit, 0, 0, 0, x, y);
                if (!pass) total += (double)w * envmap_solid_angle(sky, 0, 0, x, y);
                else
                    for (c = 0; c < 3; c++) texel[c] += web_sun_colour[c] * flux * w / (float)total;
            }
    return ENVMAP_OK;
}

/* ---------------------------------------------------------------------------------- >>filter -- */

/* Methods of the page: the library's four after AUTO, then forms that fail. */
enum { WEB_BOXES = ENVMAP_METHOD_COUNT, WEB_SAMPLES, WEB_NINE, WEB_BYTES };
enum { WEB_MIRROR, WEB_PHONG, WEB_DIFFUSE, WEB_GGX, WEB_BANKS, WEB_FIT };

static envmap_fit web_fit;

static envmap_lobe web_lobe(int kind, float value) {
    switch (kind) {
    case WEB_PHONG: return envmap_lobe_phong(value);
    case WEB_DIFFUSE: return envmap_lobe_diffuse();
    case WEB_GGX: return envmap_lobe_ggx(value);
    case WEB_BANKS: return envmap_lobe_banks(value);
    case WEB_FIT: return envmap_fit_lobe(&web_fit, 0);
    default: return envmap_lobe_mirror();
    }
}

/* What LIT's sharper levels share: called once for a new LIT, before them. */
WEB_CALL(web_prepare) int web_prepare(float alpha, float tolerance) {
    envmap_lobe lobe = envmap_lobe_ggx(alpha);
    envmap_filter_desc desc = {0};
    desc.tolerance = tolerance;
    envmap_prepared_free(&web_prepared);
    return envmap_prepare(&web_prepared, web_maps + WEB_LIT, &lobe, 1, &desc);
}

/* Three bands without a window: negative light, which is written as it is. */
static envmap_result web_nine(envmap *dst, const envmap *src, const envmap_lobe *lobe) {
    double sh[27];
    envmap_result result = envmap_sh_project(sh, 3, src, 0, 1e-4, NULL);
    if (!result) result = envmap_sh_convolve(sh, sh, 3, lobe, 0);
    return result ? result : envmap_sh_fill(dst, 0, 0, sh, 3, 0, NULL);
}

/* The source in 8 bits, white at four times its mean: what is brighter is gone. */
static envmap_result web_bytes(envmap *dst, const envmap *src, const envmap_lobe *lobe,
                               const envmap_filter_desc *desc) {
    envmap clamped = {0};
    double mean[3];
    envmap_result result = envmap_create(&clamped, src->mapping, src->size, 1, 1);
    if (result) return result;
    memcpy(clamped.texels, src->texels, method_floats(src) * sizeof(float));
    result = envmap_sh_project(mean, 1, src, 0, 1e-4, NULL);
    if (!result) {
        fault_eight_bits(&clamped, (float)(4 * mean[1] * 0.28209479177387814));
        result = envmap_filter(dst, &clamped, lobe, desc);
    }
    envmap_free(&clamped);
    return result;
}

static envmap_result web_by(envmap *dst, const envmap *src, const envmap_lobe *lobe, int method,
                            float tolerance) {
    envmap_filter_desc desc = {0};
    method_desc published = {0};
    published.form = METHOD_PUBLISHED, published.samples = 16;
    desc.tolerance = tolerance;
    if (method == WEB_BOXES) return method_box_levels(dst, src, lobe, &published);
    if (method == WEB_SAMPLES) return method_importance_sampling(dst, src, lobe, &published);
    if (method == WEB_NINE) return web_nine(dst, src, lobe);
    if (method == WEB_BYTES) return web_bytes(dst, src, lobe, &desc);
    desc.method = method;
    desc.threshold = tolerance;
    if (src == web_maps + WEB_LIT && web_prepared.state) desc.prepared = &web_prepared;
    return envmap_filter(dst, src, lobe, &desc);
}

/* Level `level` of a map = LIT (or SKY) filtered; the mirror and levels that the method refuses: see
   the result. The map stays as it was when that is not 0. */
WEB_CALL(web_filter)
int web_filter(int map, int level, int kind, float value, int method, float tolerance) {
    envmap *to = web_maps + map, dst = {0};
    envmap_lobe lobe = web_lobe(kind, value);
    envmap_result result;
    if (kind == WEB_MIRROR) method = ENVMAP_METHOD_AUTO;
    result = envmap_create(&dst, to->mapping, to->size >> level, 1, to->slices);
    if (result) return result;
    result = web_by(&dst, web_maps + (map >= WEB_SKY_CHAIN ? WEB_SKY : WEB_LIT), &lobe, method,
                    tolerance);
    if (!result) {
        memcpy(envmap_texel(to, level, 0, 0, 0, 0), dst.texels,
               method_floats(&dst) * (size_t)dst.slices * sizeof(float));
        to->p0 = dst.p0, to->p1 = dst.p1;
    }
    envmap_free(&dst);
    return result;
}

/* All of CHAIN = LIT filtered by GGX in one call, level l of roughness l / (levels - 1): the
   numbers that the tool bakes. */
WEB_CALL(web_chain) int web_chain(int method, float tolerance) {
    const envmap *shape = web_maps + WEB_CHAIN;
    envmap_lobe lobes[16];
    envmap_filter_desc desc = {0};
    envmap made = {0};
    envmap_result result;
    int l;
    if (!shape->texels || shape->levels > 16) return ENVMAP_ERROR_ARGUMENT;
    for (l = 0; l < shape->levels; l++) {
        double r = envmap_level_roughness(l, shape->levels, 0);
        lobes[l] = l ? envmap_lobe_ggx((float)(r * r)) : envmap_lobe_mirror();
    }
    desc.method = method, desc.tolerance = tolerance;
    result = envmap_create(&made, shape->mapping, shape->size, shape->levels, 1);
    if (!result)
        result = envmap_filter_chain(&made, web_maps + WEB_LIT, lobes, shape->levels, &desc);
    if (!result) return web_put(WEB_CHAIN, &made);
    envmap_free(&made);
    return result;
}

/* ------------------------------------------------------------------------------------- >>sun --
   Filters are linear: filter(sky + sun) = filter(sky) + filter(sun). What a lobe makes of a small
   disc depends only on the angle theta between the axis and the disc's middle,
     K(theta) = mean over the disc of k(a.l) / norm,
   so a table of K for each level, or slice, stands for the filter while the sun moves.
   Tested by tests/web: the_sun_by_itself_is_the_filters_sun. */

enum { WEB_RINGS = 5, WEB_ARCS = 8, WEB_STEPS = 512, WEB_TABLES = 16 };
static float web_glows[2][WEB_TABLES][WEB_STEPS + 2]; /* of CHAIN's levels and of MAP's slices */

/* The tent's rings weigh r (1 - r). */
static double web_glow(const envmap_lobe *lobe, double theta, double p) {
    double sum = 0, weights = 0;
    int i, j;
    for (i = 0; i < WEB_RINGS; i++) {
        double r = (i + 0.5) / WEB_RINGS, a = r * (double)web_sun_radius();
        for (j = 0; j < WEB_ARCS; j++) {
            double turn = cos(3.14159265358979 * (j + 0.5) / WEB_ARCS);
            double x = cos(theta) * cos(a) + sin(theta) * sin(a) * turn;
            sum += r * (1 - r) * envmap_lobe_value(lobe, fmin(fmax(x, -1), 1), p);
        }
        weights += WEB_ARCS * r * (1 - r);
    }
    return sum / weights;
}

/* The tables of CHAIN's level, or of MAP's slices: theta = pi (i / STEPS)^2, closest at the peak.
   A mirror's texels are means over themselves, about a Gaussian of their width. */
WEB_CALL(web_sun_tables) void web_sun_tables(int map, int level, int kind, float value) {
    const envmap *m = web_maps + map;
    envmap_lobe lobe = web_lobe(kind, value);
    float texel = MESH_TURN / 4 / (float)(m->size >> level);
    int i, k;
    if (kind == WEB_MIRROR) lobe = envmap_lobe_gaussian(12 / (texel * texel));
    for (k = 0; k < m->slices && k < WEB_TABLES; k++) {
        double p = (double)lobe.p0 + (double)(lobe.p1 - lobe.p0) * (k + 0.5) / m->slices;
        double norm = envmap_lobe_integral(&lobe, kind == WEB_BANKS ? 0 : p);
        float *table = web_glows[map == WEB_MAP][map == WEB_MAP ? k : level];
        for (i = 0; i <= WEB_STEPS; i++) {
            double t = (double)i / WEB_STEPS;
            table[i] = (float)(web_glow(&lobe, 3.14159265358979 * t * t, p) / norm);
        }
        table[WEB_STEPS + 1] = table[WEB_STEPS];
    }
}

static void web_sun_texel(float *texel, const float *table, float cosine, float flux) {
    float theta = acosf(fmaxf(-1, fminf(1, cosine)));
    float t = (float)WEB_STEPS * sqrtf(theta * (2 / MESH_TURN));
    int i = (int)t, c;
    float glow = flux * (table[i] + (t - (float)i) * (table[i + 1] - table[i]));
    for (c = 0; c < 3; c++) texel[c] += web_sun_colour[c] * glow;
}

/* A level of CHAIN, or MAP, = the same of SKY_CHAIN, or SKY_MAP, and the sun's tables. */
WEB_CALL(web_sun)
void web_sun(int map, int level, float dx, float dy, float dz, float flux) {
    envmap *to = web_maps + map;
    const envmap *from = web_maps + (map == WEB_MAP ? WEB_SKY_MAP : WEB_SKY_CHAIN);
    int n = to->size >> level, faces = envmap_faces(to->mapping), face, x, y, k;
    float d[3] = {dx, dy, dz}, a[3], *texel = envmap_texel(to, level, 0, 0, 0, 0);
    size_t slice = 3 * (size_t)(faces * n * n);
    mesh_unit(d);
    memcpy(texel, envmap_texel(from, level, 0, 0, 0, 0),
           slice * (size_t)to->slices * sizeof *texel);
    to->p0 = from->p0, to->p1 = from->p1;
    for (face = 0; face < faces; face++)
        for (y = 0; y < n; y++)
            for (x = 0; x < n; x++, texel += 3) {
                envmap_direction(a, to->mapping, face, ((float)x + 0.5f) / (float)n,
                                 ((float)y + 0.5f) / (float)n);
                for (k = 0; k < to->slices && k < WEB_TABLES; k++)
                    web_sun_texel(texel + (size_t)k * slice,
                                  web_glows[map == WEB_MAP][map == WEB_MAP ? k : level],
                                  mesh_dot(a, d), flux);
            }
}

/* --------------------------------------------------------------------------------- >>outcome -- */

/* floats [0..2] = rms, worst, bias of METHOD against TRUTH; from 16 on, a lat-long picture of
   log10 of each direction's error over the mean of TRUTH, w x h. */
WEB_CALL(web_error) int web_error(int w, int h) {
    const envmap *a = web_maps + WEB_METHOD, *b = web_maps + WEB_TRUTH;
    envmap_difference difference;
    float *f = web_numbers, d[3], one[3], two[3], mean[3];
    int x, y, c, result = envmap_compare(&difference, a, b, 0);
    if (result || 16 + w * h > (int)(sizeof web_numbers / sizeof *web_numbers))
        return result ? result : ENVMAP_ERROR_ARGUMENT;
    f[0] = (float)difference.rms, f[1] = (float)difference.worst, f[2] = (float)difference.bias;
    envmap_lookup(mean, web_maps + WEB_CHAIN, f, 16); /* the last level is nearly flat */
    for (y = 0; y < h; y++)
        for (x = 0; x < w; x++) {
            float error = 0;
            envmap_direction(d, ENVMAP_LATLONG, 0, ((float)x + 0.5f) / (float)w,
                             ((float)y + 0.5f) / (float)h);
            envmap_lookup(one, a, d, 0), envmap_lookup(two, b, d, 0);
            for (c = 0; c < 3; c++) error = fmaxf(error, fabsf(one[c] - two[c]));
            f[16 + y * w + x] = log10f(fmaxf(error / fmaxf(mean[1], 1e-20f), 1e-9f));
        }
    return ENVMAP_OK;
}

static double web_sky_sh[27]; /* of SKY */
static float web_sh[28];      /* the last that web_diffuse gave, for web_picture */

/* floats = the 28 numbers of envmap_sh_pack, of SKY's coefficients and the sun's: a light adds its
   flux times Y(d). `again`: SKY is another one. */
WEB_CALL(web_diffuse) int web_diffuse(int again, float dx, float dy, float dz, float flux) {
    double sh[27], Y[9];
    const double d[3] = {(double)dx, (double)dy, (double)dz};
    int i;
    envmap_lobe lobe = envmap_lobe_diffuse();
    envmap_result result = ENVMAP_OK;
    if (again) result = envmap_sh_project(web_sky_sh, 3, web_maps + WEB_SKY, 0, 1e-4, NULL);
    if (!result) result = envmap_sh_basis(Y, 3, d);
    for (i = 0; i < 27 && !result; i++)
        sh[i] = web_sky_sh[i] + (double)(flux * web_sun_colour[i % 3]) * Y[i / 3];
    if (!result) result = envmap_sh_convolve(sh, sh, 3, &lobe, 0);
    if (!result) result = envmap_sh_pack(NULL, web_numbers, sh);
    if (!result) memcpy(web_sh, web_numbers, sizeof web_sh);
    return result;
}

/* Rough copper as one lobe with a slice for each n.v; floats = factor and m of each slice. */
WEB_CALL(web_fit_copper) int web_fit_copper(float roughness, int slices) {
    static const double copper[3] = {0.955, 0.638, 0.538};
    brdf_values values = {0};
    envmap_brdf brdf = {brdf_ggx, &values};
    envmap_fit fit = {0};
    int k, result;
    values.alpha = (double)roughness * (double)roughness, values.fresnel = 1;
    memcpy(values.colour, copper, sizeof copper);
    fit.lobes = 1, fit.slices = slices, fit.size = 257;
    result = envmap_fit_brdf(&fit, &brdf, NULL);
    if (result) return result;
    envmap_fit_free(&web_fit);
    web_fit = fit;
    for (k = 0; k < slices; k++) {
        memcpy(web_numbers + 4 * k, fit.factor + 3 * k, 3 * sizeof(float));
        web_numbers[4 * k + 3] = fit.axis[k];
    }
    return ENVMAP_OK;
}

/* floats = offset and weight of each tap, up to 64 of them; returns how many there are. */
WEB_CALL(web_fan) int web_fan(float along, float across) {
    float offsets[64], weights[64];
    int i, count = envmap_fan(offsets, weights, 64, (double)along, (double)across, 0.01);
    for (i = 0; i < count && i < 64; i++)
        web_numbers[2 * i] = offsets[i], web_numbers[2 * i + 1] = weights[i];
    return count;
}

WEB_CALL(web_sigma) float web_sigma(int kind, float value) {
    envmap_lobe lobe = web_lobe(kind, value);
    return (float)envmap_lobe_sigma(&lobe, 0);
}

/* floats = (scale, bias) at n.v = (k + 1/2) / count. */
WEB_CALL(web_split_sum) void web_split_sum(float roughness, int count) {
    int k;
    for (k = 0; k < count; k++) {
        double scale, bias;
        envmap_ggx_split_sum(&scale, &bias, (k + 0.5) / count, (double)(roughness * roughness));
        web_numbers[2 * k] = (float)scale, web_numbers[2 * k + 1] = (float)bias;
    }
}

/* --------------------------------------------------------------------------------- >>picture -- */

/* What view.js knows of a picture, in the same order; its fragment shader is these functions. */
typedef struct web_view {
    float look, yaw, pitch, distance, sky_turn, exposure, roughness, metal, blur, along, across;
    float sun[3], flux;
} web_view;
enum {
    WEB_LOOK_MIRROR,
    WEB_LOOK_PHONG,
    WEB_LOOK_DIFFUSE,
    WEB_LOOK_COATED,
    WEB_LOOK_GGX,
    WEB_LOOK_BANKS,
    WEB_LOOK_FITTED,
    WEB_LOOK_ELLIPTICAL
};
static web_view web_seen;
static float web_taps[2][64];
static int web_tap_count;

WEB_CALL(web_view_floats) float *web_view_floats(void) { return &web_seen.look; }

static void web_nine_at(float rgb[3], const float n[3]) {
    const float b[4] = {n[0] * n[1], n[1] * n[2], n[2] * n[2], n[2] * n[0]};
    int c, k;
    for (c = 0; c < 3; c++) {
        rgb[c] = mesh_dot(web_sh + 4 * c, n) + web_sh[4 * c + 3] +
                 web_sh[24 + c] * (n[0] * n[0] - n[1] * n[1]);
        for (k = 0; k < 4; k++) rgb[c] += web_sh[12 + 4 * c + k] * b[k];
        rgb[c] = fmaxf(rgb[c], 0);
    }
}

/* The sky itself, with the sun's tent, whose solid angle is a third of a disc's. */
static void web_sky_at(float rgb[3], const float d[3]) {
    float radius = web_sun_radius(), angle = acosf(fmaxf(-1, fminf(1, mesh_dot(d, web_seen.sun))));
    float glow = web_seen.flux * fmaxf(0, 1 - angle / radius) * 6 / (MESH_TURN * radius * radius);
    int c;
    envmap_lookup(rgb, web_maps + WEB_SKY, d, 0);
    for (c = 0; c < 3; c++) rgb[c] += web_sun_colour[c] * glow;
}

static void web_coated(float rgb[3], const float n[3], const float r[3], float nv) {
    static const float albedo[3] = {0.50f, 0.13f, 0.07f};
    const envmap *chain = web_maps + WEB_CHAIN;
    float base[3], f = (float)envmap_fresnel((double)nv, 1.5, 0);
    int c;
    web_nine_at(base, n);
    envmap_lookup(rgb, chain, r, web_seen.roughness * (float)(chain->levels - 1));
    for (c = 0; c < 3; c++) rgb[c] = f * rgb[c] + (1 - f) * albedo[c] * base[c];
}

static void web_ggx(float rgb[3], const float n[3], const float r[3], float nv) {
    static const float gold[3] = {1.0f, 0.77f, 0.34f}, albedo = 0.6f;
    const envmap *chain = web_maps + WEB_CHAIN;
    float base[3], m = web_seen.metal;
    double scale, bias;
    int c;
    envmap_ggx_split_sum(&scale, &bias, (double)nv,
                         (double)(web_seen.roughness * web_seen.roughness));
    web_nine_at(base, n);
    envmap_lookup(rgb, chain, r, web_seen.roughness * (float)(chain->levels - 1));
    for (c = 0; c < 3; c++)
        rgb[c] = rgb[c] * ((0.04f + m * (gold[c] - 0.04f)) * (float)scale + (float)bias) +
                 (1 - m) * albedo * base[c];
}

/* Radiance from the ball's point with normal n towards v, both in the map's frame. */
static void web_shade(float rgb[3], const float n[3], const float v[3]) {
    const envmap *map = web_maps + WEB_MAP;
    float nv = mesh_dot(n, v), r[3], t[3], up[3] = {0, 1, 0}, across[3];
    int c;
    for (c = 0; c < 3; c++) r[c] = 2 * nv * n[c] - v[c];
    mesh_cross(t, up, n), mesh_unit(t), mesh_cross(across, n, t);
    switch ((int)web_seen.look) {
    case WEB_LOOK_PHONG: envmap_lookup(rgb, map, r, 0); break;
    case WEB_LOOK_DIFFUSE:
        web_nine_at(rgb, n);
        for (c = 0; c < 3; c++) rgb[c] *= 0.8f;
        break;
    case WEB_LOOK_COATED: web_coated(rgb, n, r, nv); break;
    case WEB_LOOK_GGX: web_ggx(rgb, n, r, nv); break;
    case WEB_LOOK_BANKS: envmap_lookup_slice(rgb, map, t, mesh_dot(v, t), 0); break;
    case WEB_LOOK_FITTED: envmap_fit_lookup(rgb, &web_fit, map, n, v); break;
    case WEB_LOOK_ELLIPTICAL:
        envmap_lookup_fan(rgb, map, n, across, v, web_taps[0], web_taps[1], web_tap_count);
        break;
    default: web_sky_at(rgb, r);
    }
}

static void web_turned(float out[3], const float d[3]) {
    float s = sinf(web_seen.sky_turn), c = cosf(web_seen.sky_turn);
    out[0] = c * d[0] - s * d[2], out[1] = d[1], out[2] = s * d[0] + c * d[2];
}

/* What the ray from the eye along d (unit) sees: the ball, of radius 1, or the sky. */
static void web_ray(float rgb[3], const float eye[3], const float d[3]) {
    const envmap *chain = web_maps + WEB_CHAIN;
    float b = mesh_dot(eye, d), q = b * b - mesh_dot(eye, eye) + 1, n[3], v[3], p[3];
    int c;
    if (q < 0) {
        float level = web_seen.blur * (float)(chain->levels - 1), sharp[3];
        web_turned(n, d);
        envmap_lookup(rgb, chain, n, fmaxf(1, level));
        web_sky_at(sharp, n);
        for (c = 0; c < 3; c++) rgb[c] += (sharp[c] - rgb[c]) * fmaxf(0, 1 - level);
        return;
    }
    for (c = 0; c < 3; c++) p[c] = eye[c] - (b + sqrtf(q)) * d[c], v[c] = -d[c];
    web_turned(n, p), web_turned(p, v);
    web_shade(rgb, n, p);
}

static unsigned char web_tone(float x) {
    x = 1 - expf(-fmaxf(x, 0) * web_seen.exposure);
    return (unsigned char)(255 * powf(x, 1 / 2.2f) + 0.5f);
}

/* w x h pixels of RGBA by the numbers at web_view_floats, for the caller to release; or NULL. */
WEB_CALL(web_picture) unsigned char *web_picture(int w, int h) {
    unsigned char *out = (unsigned char *)malloc(4 * (size_t)w * (size_t)h);
    const web_view *s = &web_seen;
    const float eye[3] = {s->distance * cosf(s->pitch) * sinf(s->yaw), s->distance * sinf(s->pitch),
                          s->distance * cosf(s->pitch) * cosf(s->yaw)};
    float view[16], at[3] = {0, 0, 0}, d[3], rgb[3];
    int x, y, c;
    if (!out) return out;
    web_tap_count = envmap_fan(web_taps[0], web_taps[1], 64, (double)fmaxf(s->along, s->across),
                               (double)s->across, 0.01);
    if (web_tap_count > 64) web_tap_count = 0;
    mesh_look(view, eye, at);
    for (y = 0; y < h; y++)
        for (x = 0; x < w; x++) {
            float X = 0.35f * (2 * (float)x + 1 - (float)w) / (float)h;
            float Y = 0.35f * ((float)h - 2 * (float)y - 1) / (float)h;
            for (c = 0; c < 3; c++) d[c] = X * view[4 * c] + Y * view[4 * c + 1] - view[4 * c + 2];
            mesh_unit(d);
            web_ray(rgb, eye, d);
            for (c = 0; c < 3; c++) out[4 * (y * w + x) + c] = web_tone(rgb[c]);
            out[4 * (y * w + x) + 3] = 255;
        }
    return out;
}

/* ----------------------------------------------------------------------------------- >>files -- */

/* What a map is saved as: the level as PFM (all slices) or .hdr, or all levels as KTX 2 in half
   floats. */
enum { WEB_PFM, WEB_HDR, WEB_KTX2 };

static int web_write_pfm(const envmap *map, int level) {
    size_t bytes = 0;
    write_file w;
    write_open(&w, "");
    envmap_pfm_write(NULL, 0, &bytes, map, level);
    write_zeros(&w, bytes);
    return write_close(&w) || envmap_pfm_write(memory_file.data, bytes, &bytes, map, level);
}

/* The bytes belong to the module until the next call; NULL without memory. */
WEB_CALL(web_save) const unsigned char *web_save(int kind, int map, int level) {
    texture t = {0};
    int failed;
    t.map = web_maps + map;
    t.format = TEXEL_RGBA16F;
    if (!t.map->texels || level >= t.map->levels) return NULL;
    failed = kind == WEB_PFM   ? web_write_pfm(t.map, level)
             : kind == WEB_HDR ? write_hdr(&t, level, "")
                               : write_ktx2(&t, "");
    return failed ? NULL : memory_file.data;
}
WEB_CALL(web_saved) int web_saved(void) { return (int)memory_file.size; }

/* ---------------------------------------------------------------------------------- >>meshes -- */

static mesh web_meshes[3];

/* ball, teapot, torus; returns vertices of 9 floats: position, normal, tangent. */
WEB_CALL(web_mesh) float *web_mesh(int kind) {
    mesh *m = web_meshes + kind;
    int made = m->vertices || (kind == 0   ? mesh_ball(m, 64)
                               : kind == 1 ? mesh_teapot(m, 12)
                                           : mesh_torus(m, 64, 0.4f));
    return made ? m->vertices : NULL;
}
WEB_CALL(web_mesh_indices) unsigned *web_mesh_indices(int kind) { return web_meshes[kind].indices; }
WEB_CALL(web_mesh_count) int web_mesh_count(int kind, int indices) {
    return indices ? web_meshes[kind].index_count : web_meshes[kind].vertex_count;
}
