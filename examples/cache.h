/* cache.h - memory for calls that are made again and again: what one call gives back the next one
   gets, so only the first call asks the system. The library asks on the calling thread alone, so
   no lock is needed.

       cache kept = {0};
       desc.work.memory = &kept;    ... the calls ...    cache_free(&kept);

   Include before envmap.h. Maps without a context of their own still come from malloc.

   SPDX-License-Identifier: MIT */

#ifndef CACHE_H
#define CACHE_H

#include <stdlib.h>

#define CACHE_BLOCKS 128 /* more than that at once come from malloc */

typedef struct cache {
    int asked, count; /* asked: how often the system was, for the user to read and reset */
    void *block[CACHE_BLOCKS];
    size_t bytes[CACHE_BLOCKS];
    char used[CACHE_BLOCKS];
} cache;

/* The smallest free block that is large enough, else a new one. */
static inline void *cache_get(cache *c, size_t bytes) {
    int i, best = -1;
    void *block;
    for (i = 0; c && i < c->count; i++)
        if (!c->used[i] && c->bytes[i] >= bytes && (best < 0 || c->bytes[i] < c->bytes[best]))
            best = i;
    if (best >= 0) return c->used[best] = 1, c->block[best];
    block = malloc(bytes);
    if (c) c->asked++;
    if (c && block && c->count < CACHE_BLOCKS) {
        c->block[c->count] = block, c->bytes[c->count] = bytes;
        c->used[c->count++] = 1;
    }
    return block;
}

static inline void cache_put(cache *c, void *block) {
    int i = c ? c->count : 0;
    while (i-- > 0)
        if (c->block[i] == block) {
            c->used[i] = 0;
            return;
        }
    free(block);
}

static inline void cache_free(cache *c) {
    while (c->count > 0) free(c->block[--c->count]);
}

#define ENVMAP_MALLOC(context, bytes) cache_get((cache *)(context), bytes)
#define ENVMAP_FREE(context, pointer) cache_put((cache *)(context), pointer)

#endif /* CACHE_H */
