/* usage: balls SKY.pfm OUT    the balls that run.py holds three.js' against, drawn by the CPU from
   the sky itself: nothing of what bake wrote is read here, and three.js' axes are written down a
   second time. OUT gets PIXELS x PIXELS RGB floats a ball, rows from the top; black is no ball.
   SPDX-License-Identifier: MIT */

#define ENVMAP_IMPLEMENTATION
#include "envmap.h"
#include <stdio.h>

enum { PIXELS = 64, EDGE = 64, LEVELS = 5, ROUGHNESSES = 6 };
enum { METAL, DIELECTRIC, PROBE, PANORAMA, KINDS };

typedef struct balls {
    envmap sky, chain, irradiance;
    double sh[27]; /* irradiance / pi, in our axes */
} balls;

static int prepare(balls *b, const char *path) {
    envmap_lobe lobes[LEVELS], cosine = envmap_lobe_diffuse();
    if (envmap_pfm_load(&b->sky, path, ENVMAP_LATLONG) || envmap_clean(&b->sky, 20, NULL) ||
        envmap_create(&b->chain, ENVMAP_CUBE, EDGE, LEVELS, 1) ||
        envmap_create(&b->irradiance, ENVMAP_CUBE, 32, 1, 1))
        return 0;
    for (int l = 0; l < LEVELS; ++l) {
        float r = (float)l / (LEVELS - 1);
        lobes[l] = l ? envmap_lobe_ggx(r * r) : envmap_lobe_mirror();
    }
    return !envmap_filter_chain(&b->chain, &b->sky, lobes, LEVELS, NULL) &&
           !envmap_filter(&b->irradiance, &b->sky, &cosine, NULL) &&
           !envmap_sh_project(b->sh, 3, &b->sky, 0, 1e-4, NULL) &&
           !envmap_sh_convolve(b->sh, b->sh, 3, &cosine, 0);
}

/* three.js' x is our -z, its z our x. */
static void ours_of(float ours[3], const float three[3]) {
    ours[0] = three[2], ours[1] = three[1], ours[2] = -three[0];
}

static void shade(float rgb[3], const balls *b, int kind, double roughness, const float n[3]) {
    static const float f0[2][3] = {{0.9f, 0.6f, 0.3f}, {0.04f, 0.04f, 0.04f}};
    float r[3], normal[3], mirror[3] = {2 * n[2] * n[0], 2 * n[2] * n[1], 2 * n[2] * n[2] - 1};
    double scale, bias, value[3], d[3];
    ours_of(r, mirror), ours_of(normal, n);
    for (int c = 0; c < 3; ++c) d[c] = (double)normal[c];
    if (kind == PROBE) {
        envmap_sh_evaluate(value, b->sh, 3, d);
        for (int c = 0; c < 3; ++c) rgb[c] = (float)value[c];
    } else if (kind == PANORAMA) envmap_lookup(rgb, &b->sky, r, 0);
    else {
        float diffuse[3];
        envmap_lookup(rgb, &b->chain, r, (float)envmap_roughness_level(roughness, LEVELS, 0));
        envmap_lookup(diffuse, &b->irradiance, normal, 0);
        envmap_ggx_split_sum(&scale, &bias, (double)n[2], roughness * roughness);
        for (int c = 0; c < 3; ++c)
            rgb[c] = (f0[kind][c] * (float)scale + (float)bias) * rgb[c] +
                     (kind == METAL ? 0 : 0.5f) * diffuse[c];
    }
}

static void draw(FILE *out, const balls *b, int kind, double roughness) {
    for (int y = 0; y < PIXELS; ++y)
        for (int x = 0; x < PIXELS; ++x) {
            float n[3], rgb[3] = {0, 0, 0}, r2;
            n[0] = ((float)x + 0.125f) / (PIXELS / 2) - 1; /* of 4 x 4 pixels the first */
            n[1] = 1 - ((float)y + 0.125f) / (PIXELS / 2);
            r2 = n[0] * n[0] + n[1] * n[1];
            n[2] = sqrtf(r2 < 1 ? 1 - r2 : 0);
            if (r2 < 0.9f) shade(rgb, b, kind, roughness, n); /* the rim is thinner than pixels */
            fwrite(rgb, sizeof rgb, 1, out);
        }
}

int main(int argc, char **argv) {
    balls b = {0};
    FILE *out = argc == 3 && prepare(&b, argv[1]) ? fopen(argv[2], "wb") : NULL;
    if (!out) return 1;
    for (int kind = 0; kind < KINDS; ++kind)
        for (int k = 0; k < (kind < PROBE ? ROUGHNESSES : 1); ++k)
            draw(out, &b, kind, k / (ROUGHNESSES - 1.0));
    envmap_free(&b.sky), envmap_free(&b.chain), envmap_free(&b.irradiance);
    return fclose(out) != 0;
}
