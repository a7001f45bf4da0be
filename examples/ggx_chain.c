/* ggx_chain.c - what an engine needs of an environment, in forty lines: a GGX chain for reflections,
   nine numbers for diffuse light, the split-sum table. Copy it.

   What you will see: the names of the files that it wrote. In a shader, with n, v, r = reflect(-v, n):
     level    = roughness * 5                               (envmap_roughness_level)
     ab       = table(n.v, roughness)                       (split-sum.f32: 64 x 64 pairs)
     colour   = (f0 * ab.x + ab.y) * chain(r, level)        (chain-0.pfm ... chain-5.pfm)
              + albedo * diffuse(n)                         (diffuse.f32: the vec4 sh[7] of
                                                             envmap_sh_pack, irradiance / pi)
       cc -O3 -I. examples/ggx_chain.c -o build/ggx_chain -lm
       build/ggx_chain [SKY.pfm [FOLDER]]     a lat-long map; without one, a grey sky; into build

   SPDX-License-Identifier: MIT */
#define ENVMAP_IMPLEMENTATION
#include "envmap.h"
#include <stdio.h>
#include <stdlib.h>

enum { LEVELS = 6, SIZE = 256, TABLE = 64 }; /* levels of 256 x 256 ... 8 x 8 texels */

static void must(envmap_result result, const char *what) {
    if (result) fprintf(stderr, "ggx_chain: %s: %s\n", what, envmap_result_text(result)), exit(1);
}

static void save(const char *path, const float *data, size_t count) {
    FILE *file = fopen(path, "wb");
    if (!file || fwrite(data, sizeof *data, count, file) != count || fclose(file))
        must(ENVMAP_ERROR_FILE, path);
    puts(path);
}

int main(int argc, char **argv) {
    static float table[2 * TABLE * TABLE], packed[28];
    envmap sky = {0}, chain = {0};
    envmap_lobe lobes[LEVELS], diffuse = envmap_lobe_diffuse();
    const char *folder = argc > 2 ? argv[2] : "build";
    char path[1024];
    double sh[27];
    if (argc > 1) must(envmap_pfm_load(&sky, argv[1], ENVMAP_LATLONG), argv[1]);
    else must(envmap_create(&sky, ENVMAP_LATLONG, 256, 1, 1), "sky");
    for (int i = 0; argc < 2 && i < 3 * 512 * 256; ++i) /* white above, grey below */
        sky.texels[i] = i < 3 * 512 * 128 ? 1 : 0.2f;

    for (int l = 0; l < LEVELS; ++l) { /* level 0 is the mirror: alpha = 0 */
        double roughness = envmap_level_roughness(l, LEVELS, 0);
        lobes[l] = envmap_lobe_ggx((float)(roughness * roughness));
    }
    must(envmap_create(&chain, ENVMAP_CUBE, SIZE, LEVELS, 1), "chain");
    must(envmap_filter_chain(&chain, &sky, lobes, LEVELS, NULL), "filter");
    must(envmap_sh_project(sh, 3, &sky, 0, 1e-3, NULL), "project");
    must(envmap_sh_convolve(sh, sh, 3, &diffuse, 0), "convolve");
    must(envmap_sh_pack(NULL, packed, sh), "pack");
    must(envmap_ggx_table(table, TABLE, NULL), "table");

    for (int l = 0; l < LEVELS; ++l) {
        snprintf(path, sizeof path, "%s/chain-%d.pfm", folder, l);
        must(envmap_pfm_save(&chain, path, l), path), puts(path);
    }
    snprintf(path, sizeof path, "%s/diffuse.f32", folder), save(path, packed, 28);
    snprintf(path, sizeof path, "%s/split-sum.f32", folder), save(path, table, 2 * TABLE * TABLE);
    envmap_free(&sky), envmap_free(&chain);
    return 0;
}
