/* native.c - the page's chain by a native compiler, as run.py holds it against the scalar module:
   a hash (FNV-1a) of each level, the widest lobe first.
   SPDX-License-Identifier: MIT */

#include "../../examples/web/web.c"
#undef snprintf
#include <stdio.h>

static unsigned hash(const void *data, size_t bytes) {
    const unsigned char *at = (const unsigned char *)data;
    unsigned value = 2166136261u;
    while (bytes--) value = (value ^ *at++) * 16777619u;
    return value;
}

int main(void) {
    int i;
    if (web_scene(SCENE_SUN, 64, 0) || web_light(0, 1, 0, 2) || web_prepare(0.16f, 1e-3f) ||
        web_create(WEB_CHAIN, ENVMAP_CUBE, 64, 6, 1))
        return 1;
    for (i = 5; i >= 0; i--) {
        size_t edge = 64u >> i;
        if (web_filter(WEB_CHAIN, i, i ? WEB_GGX : WEB_MIRROR, (float)(i / 5.0 * (i / 5.0)), 0,
                       1e-3f))
            return 1;
        printf("%u\n", hash(web_map_texels(WEB_CHAIN, i), 18 * edge * edge * sizeof(float)));
    }
    return 0;
}
