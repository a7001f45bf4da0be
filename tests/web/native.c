/* native.c - the page's chain by a native compiler, as run.py holds it against the modules: a hash
   (FNV-1a) of each level, the widest lobe first; with an argument, the least ms of the processor
   that a chain of a cube of 128 took.
   SPDX-License-Identifier: MIT */

#define _POSIX_C_SOURCE 199309L
#include "../../examples/web/web.c"
#undef snprintf
#include <stdio.h>
#include <time.h>

static unsigned hash(const void *data, size_t bytes) {
    const unsigned char *at = (const unsigned char *)data;
    unsigned value = 2166136261u;
    while (bytes--) value = (value ^ *at++) * 16777619u;
    return value;
}

static int chain(int sky, int edge, int quick) {
    return web_scene(SCENE_SUN, sky, quick) || web_light(0, 1, 0, 2) || web_prepare(0.16f, 1e-3f) ||
           web_create(WEB_CHAIN, ENVMAP_CUBE, edge, 6, 1);
}
static int level(int i) {
    float alpha = (float)(i / 5.0 * (i / 5.0));
    return web_filter(WEB_CHAIN, i, i ? WEB_GGX : WEB_MIRROR, alpha, 0, 1e-3f);
}

static double now(void) {
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return 1e3 * (double)t.tv_sec + 1e-6 * (double)t.tv_nsec;
}
static int times(void) {
    double least = 1e9;
    int i, pass;
    if (chain(256, 128, 1)) return 1;
    for (pass = 0; pass < 3; pass++) {
        double start = now();
        for (i = 5; i >= 0; i--)
            if (level(i)) return 1;
        least = fmin(least, now() - start);
    }
    printf("%.3f\n", least);
    return 0;
}

int main(int argc, char **argv) {
    int i;
    (void)argv;
    if (argc > 1) return times();
    if (chain(64, 64, 0)) return 1;
    for (i = 5; i >= 0; i--) {
        size_t edge = 64u >> i;
        if (level(i)) return 1;
        printf("%u\n", hash(web_map_texels(WEB_CHAIN, i), 18 * edge * edge * sizeof(float)));
    }
    return 0;
}
