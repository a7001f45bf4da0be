/* cached_memory.c - a chain filtered again and again without asking the system for memory.

   What you will see: how often each of three calls asked for memory. Only the first one does: what
   is given back is kept in a list, and given out again to whoever asks for as much or less.

   SPDX-License-Identifier: MIT */

#include <stdio.h>
#include <stdlib.h>

typedef union cache_block { /* before the memory that it describes; as aligned as any number */
    struct {
        union cache_block *next;
        size_t bytes;
    } is;
    long double align[2];
} cache_block;
typedef struct cache {
    cache_block *kept;
    int asked;
} cache;

static void *cache_get(cache *c, size_t bytes) {
    cache_block **best = NULL;
    for (cache_block **b = c ? &c->kept : NULL; b && *b; b = &(*b)->is.next)
        if ((*b)->is.bytes >= bytes && (!best || (*b)->is.bytes < (*best)->is.bytes)) best = b;
    cache_block *found = best ? *best : (cache_block *)malloc(sizeof(cache_block) + bytes);
    if (best) *best = found->is.next;
    else if (found) found->is.bytes = bytes;
    if (c && !best) ++c->asked;
    return found ? found + 1 : NULL;
}

static void cache_put(cache *c, void *memory) {
    cache_block *b = memory ? (cache_block *)memory - 1 : NULL;
    if (b && c) b->is.next = c->kept, c->kept = b;
    else free(b);
}

#define ENVMAP_MALLOC(context, bytes) cache_get((cache *)(context), bytes)
#define ENVMAP_FREE(context, pointer) cache_put((cache *)(context), pointer)
#define ENVMAP_IMPLEMENTATION
#include "envmap.h"

int main(void) {
    cache scratch = {NULL, 0};
    envmap sky = {0}, chain = {0};
    envmap_filter_desc desc = {0};
    envmap_lobe lobes[5];
    int later = 0;
    if (envmap_create(&sky, ENVMAP_CUBE, 64, 1, 1)) return 1;
    if (envmap_create(&chain, ENVMAP_CUBE, 64, 5, 1)) return 1;
    for (int i = 0; i < 3 * 6 * 64 * 64; ++i) sky.texels[i] = (float)(i % 97) / 97;
    for (int l = 0; l < 5; ++l) lobes[l] = envmap_lobe_ggx((float)(l * l) / 16);
    desc.work.memory = &scratch;
    for (int call = 1; call <= 3; ++call) {
        scratch.asked = 0;
        if (envmap_filter_chain(&chain, &sky, lobes, 5, &desc)) return 1;
        printf("call %d asked for memory %d times\n", call, scratch.asked);
        if (call > 1) later += scratch.asked;
    }
    for (cache_block *b = scratch.kept, *next; b; b = next) next = b->is.next, free(b);
    envmap_free(&sky);
    envmap_free(&chain);
    return later > 0;
}
