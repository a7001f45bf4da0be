/* glossy.c - the first program: a sky, filtered with Phong lobes of five exponents, on balls.

   What you will see: build/glossy.png, five balls from shiny to dull.
       cc -O3 -I. examples/glossy.c -o build/glossy -lm
       build/glossy [SKY.pfm [OUT.png]]       a lat-long map; without one, a terrace in the sun

   SPDX-License-Identifier: MIT */

#define ENVMAP_IMPLEMENTATION
#include "envmap.h"

#include <stdio.h>
#include <stdlib.h>

#include "tool/picture.h"
#include "tool/scenes.h"

enum { BALL = 200, GAP = 20, BALLS = 5 };
static const float exponents[BALLS] = {1000, 250, 60, 15, 4};

static void must(envmap_result result, const char *what) {
    if (!result) return;
    fprintf(stderr, "glossy: %s: %s\n", what, envmap_result_text(result));
    exit(1);
}

static void load_sky(envmap *sky, const char *path) {
    if (path) {
        must(envmap_pfm_load(sky, path, ENVMAP_LATLONG), path);
    } else {
        must(envmap_create(sky, ENVMAP_LATLONG, 256, 1, 1), "sky");
        scene_fill(sky, SCENE_SUN);
    }
}

/* The map of one exponent, and a ball that reflects it. */
static void draw_ball(picture *p, int i, const envmap *sky, float exposure) {
    envmap gloss = {0};
    envmap_lobe lobe = envmap_lobe_phong(exponents[i]);
    must(envmap_create(&gloss, ENVMAP_CUBE, 128, 1, 1), "map");
    must(envmap_filter(&gloss, sky, &lobe, NULL), "filter"); /* NULL: to a relative error of 1e-3 */
    picture_ball(p, GAP + i * (BALL + GAP), GAP, BALL, exposure, &gloss, PICTURE_BALL_REFLECTION);
    envmap_free(&gloss);
}

int main(int argc, char **argv) {
    const char *path = argc > 2 ? argv[2] : "build/glossy.png";
    envmap sky = {0};
    picture p;
    load_sky(&sky, argc > 1 ? argv[1] : NULL);
    if (!picture_create(&p, GAP + BALLS * (BALL + GAP), BALL + 2 * GAP))
        must(ENVMAP_ERROR_MEMORY, "picture");
    picture_rectangle(&p, 0, 0, p.width, p.height, 0x15171Cu, 1);
    for (int i = 0; i < BALLS; ++i) draw_ball(&p, i, &sky, picture_exposure(&sky));
    if (!picture_save(&p, path)) must(ENVMAP_ERROR_FILE, path);
    printf("%s\n", path);
    picture_free(&p);
    envmap_free(&sky);
    return 0;
}
