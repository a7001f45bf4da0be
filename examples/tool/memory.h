/* memory.h - the memory of the tool's maps: large blocks ask for large pages, because a fresh map's
   first writes otherwise wait for the system longer than for the memory. Include before envmap.h,
   and define _DEFAULT_SOURCE before all.

   SPDX-License-Identifier: MIT */

#ifndef MEMORY_H
#define MEMORY_H

#include <stdlib.h>
#include <sys/mman.h>

static inline void *memory_get(size_t bytes) {
    const size_t page = (size_t)2 << 20;
    void *block = NULL;
    if (bytes < 4 * page) return malloc(bytes);
    if (posix_memalign(&block, page, bytes)) return NULL;
#ifdef MADV_HUGEPAGE
    madvise(block, bytes, MADV_HUGEPAGE); /* no harm where it is refused */
#endif
    return block;
}

#define ENVMAP_MALLOC(context, bytes) ((void)(context), memory_get(bytes))
#define ENVMAP_FREE(context, pointer) ((void)(context), free(pointer))

#endif /* MEMORY_H */
