/* SPDX-License-Identifier: MIT
   What `make fuzz` runs: any bytes may be given to the PFM reader as any mapping. What it accepts
   it must be able to write, and read back as the same bits. */
#define ENVMAP_IMPLEMENTATION
#include "envmap.h"
#include "fuzz_variants.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t bytes);

static void read_as_every_mapping(const uint8_t *data, size_t bytes) {
    for (int m = 0; m < ENVMAP_MAPPING_COUNT; ++m) {
        envmap map = {0}, back = {0};
        size_t need = 0, written = 0;
        if (envmap_pfm_read(&map, data, bytes, m)) {
            if (map.texels || map.size) abort();
            continue;
        }
        if (envmap_pfm_write(NULL, 0, &need, &map, 0)) abort();
        unsigned char *file = (unsigned char *)malloc(need);
        if (!file || envmap_pfm_write(file, need, &written, &map, 0) || written != need) abort();
        if (envmap_pfm_read(&back, file, need, m)) abort();
        size_t n = (size_t)envmap_faces(m) * (size_t)map.size * (size_t)map.size *
                   (m == ENVMAP_LATLONG ? 2 : 1) * (size_t)map.slices * 3;
        if (back.size != map.size || back.slices != map.slices ||
            memcmp(back.texels, map.texels, n * sizeof(float)))
            abort();
        free(file);
        envmap_free(&map), envmap_free(&back);
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t bytes) {
    fuzz_variants(read_as_every_mapping, data, bytes);
    return 0;
}
