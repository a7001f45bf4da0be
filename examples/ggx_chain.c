/* ggx_chain.c - what an engine needs of an environment: a GGX chain for reflections, nine numbers
   for diffuse light, the split-sum table. Copy it.

   What you will see: the names of the files that it wrote. In a shader, with n, v, r = reflect(-v, n):
     level    = roughness * 5                               (envmap_roughness_level)
     ab       = table(n.v, roughness)                       (split-sum.f32: 64 x 64 pairs)
     colour   = (f0 * ab.x + ab.y) * chain(r, level)        (chain-0.pfm ... chain-5.pfm)
              + albedo * diffuse(n)                         (diffuse.f32: the vec4 sh[7] of
                                                             envmap_sh_pack, irradiance / pi)
       cc -O3 -I. examples/ggx_chain.c -o build/ggx_chain -lm
       build/ggx_chain [SKY.pfm [FOLDER]]     a lat-long map; without one, a blue sky; into build

   SPDX-License-Identifier: MIT */

#define ENVMAP_IMPLEMENTATION
#include "envmap.h"

#include <stdio.h>
#include <stdlib.h>

enum { LEVELS = 6, SIZE = 256, TABLE = 64 }; /* levels of 256 x 256 ... 8 x 8 texels */

static void must(envmap_result result, const char *what) {
    if (!result) return;
    fprintf(stderr, "ggx_chain: %s: %s\n", what, envmap_result_text(result));
    exit(1);
}

/* A blue sky with a sun above grey ground. */
static void make_sky(envmap *sky) {
    static const float zenith[3] = {0.2f, 0.4f, 1.0f};
    must(envmap_create(sky, ENVMAP_LATLONG, 128, 1, 1), "a sky");
    for (int y = 0; y < 128; ++y)
        for (int x = 0; x < 256; ++x) {
            float d[3], *texel = envmap_texel(sky, 0, 0, 0, x, y);
            envmap_direction(d, ENVMAP_LATLONG, 0, ((float)x + 0.5f) / 256,
                             ((float)y + 0.5f) / 128);
            float sun = 0.64f * d[0] + 0.6f * d[1] - 0.48f * d[2] > 0.999f ? 1000.0f : 0.0f;
            for (int c = 0; c < 3; ++c)
                texel[c] = d[1] < 0 ? 0.2f : sun + 1 - (1 - zenith[c]) * d[1];
        }
}

static void make_chain(envmap *chain, const envmap *sky) {
    envmap_lobe lobes[LEVELS];
    for (int l = 0; l < LEVELS; ++l) {
        double roughness = envmap_level_roughness(l, LEVELS, 0);
        lobes[l] = l ? envmap_lobe_ggx((float)(roughness * roughness)) : envmap_lobe_mirror();
    }
    must(envmap_create(chain, ENVMAP_CUBE, SIZE, LEVELS, 1), "a chain");
    must(envmap_filter_chain(chain, sky, lobes, LEVELS, NULL), "filter");
}

static void make_diffuse(float packed[28], const envmap *sky) {
    envmap_lobe diffuse = envmap_lobe_diffuse();
    double sh[27];
    must(envmap_sh_project(sh, 3, sky, 0, 1e-3, NULL), "project");
    must(envmap_sh_convolve(sh, sh, 3, &diffuse, 0), "convolve");
    must(envmap_sh_pack(NULL, packed, sh), "pack");
}

static void save(const char *folder, const char *name, const float *data, size_t count) {
    char path[4096];
    FILE *file;
    snprintf(path, sizeof path, "%s/%s", folder, name);
    file = fopen(path, "wb");
    if (!file || fwrite(data, sizeof *data, count, file) != count || fclose(file))
        must(ENVMAP_ERROR_FILE, path);
    printf("%s: %d floats\n", path, (int)count);
}

int main(int argc, char **argv) {
    static float table[2 * TABLE * TABLE], packed[28];
    const char *folder = argc > 2 ? argv[2] : "build";
    envmap sky = {0}, chain = {0};
    char path[4096];
    if (argc > 1) must(envmap_pfm_load(&sky, argv[1], ENVMAP_LATLONG), argv[1]);
    else make_sky(&sky);
    make_chain(&chain, &sky);
    make_diffuse(packed, &sky);
    must(envmap_ggx_table(table, TABLE, NULL), "table");
    for (int l = 0; l < LEVELS; ++l) {
        snprintf(path, sizeof path, "%s/chain-%d.pfm", folder, l);
        must(envmap_pfm_save(&chain, path, l), path);
        printf("%s: six faces of %d x %d\n", path, SIZE >> l, SIZE >> l);
    }
    save(folder, "diffuse.f32", packed, 28);
    save(folder, "split-sum.f32", table, sizeof table / sizeof *table);
    envmap_free(&sky);
    envmap_free(&chain);
    return 0;
}
