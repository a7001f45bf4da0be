/* cached_memory.c - a chain filtered again and again without asking the system for memory.

   What you will see: how often each of three calls asked for memory. Only the first one does: what
   it gives back is kept by cache.h, and given out again. (gl/per_frame.c does so in every frame.)

   SPDX-License-Identifier: MIT */

#include "cache.h"
#define ENVMAP_IMPLEMENTATION
#include "envmap.h"

int main(void) {
    cache kept = {0};
    envmap sky = {0}, chain = {0};
    envmap_filter_desc desc = {0};
    envmap_lobe lobes[5];
    int later = 0;
    if (envmap_create(&sky, ENVMAP_CUBE, 64, 1, 1)) return 1;
    if (envmap_create(&chain, ENVMAP_CUBE, 64, 5, 1)) return 1;
    for (int i = 0; i < 3 * 6 * 64 * 64; ++i) sky.texels[i] = (float)(i % 97) / 97;
    for (int l = 0; l < 5; ++l) lobes[l] = envmap_lobe_ggx((float)(l * l) / 16);
    desc.work.memory = &kept;
    for (int call = 1; call <= 3; ++call) {
        kept.asked = 0;
        if (envmap_filter_chain(&chain, &sky, lobes, 5, &desc)) return 1;
        printf("call %d asked for memory %d times\n", call, kept.asked);
        if (call > 1) later += kept.asked;
    }
    cache_free(&kept);
    envmap_free(&sky);
    envmap_free(&chain);
    return later > 0;
}
