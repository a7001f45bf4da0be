/* memory.h - the memory of the tool's maps: large blocks ask for large pages, because a fresh map's
   first writes otherwise wait for the system longer than for the memory. Include before envmap.h,
   and define _DEFAULT_SOURCE before all.

   SPDX-License-Identifier: MIT */

#ifndef MEMORY_H
#define MEMORY_H

#include <stdlib.h>
#ifdef __unix__
#include <sys/mman.h>
#endif

static inline void *memory_get(size_t bytes) {
#ifdef MADV_HUGEPAGE
    const size_t page = (size_t)2 << 20;
    void *block = NULL;
    if (bytes >= 4 * page) {
        if (posix_memalign(&block, page, bytes)) return NULL;
        madvise(block, bytes, MADV_HUGEPAGE); /* no harm where it is refused */
        return block;
    }
#endif
    return malloc(bytes);
}

#define ENVMAP_MALLOC(context, bytes) ((void)(context), memory_get(bytes))
#define ENVMAP_FREE(context, pointer) ((void)(context), free(pointer))

#endif /* MEMORY_H */
