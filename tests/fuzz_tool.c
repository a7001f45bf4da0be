/* SPDX-License-Identifier: MIT
   What `make fuzz` runs on the tool's readers: any bytes may be given to them, as any
   parameterization and with a ground. A picture is refused with an error, or holds as many pixels as it says. */
#define IMAGE_LIMIT 1e6 /* bytes of a picture, so that memory is no matter */
#define ENVMAP_IMPLEMENTATION
#include "envmap.h"
#include "examples/tool/read.h"
#include "examples/tool/layouts.h"
#include "fuzz_variants.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t bytes);

static void read_as_any_picture(const uint8_t *data, size_t bytes) {
    for (int m = -1; m < ENVMAP_MAPPING_COUNT; ++m)
        for (int horizon = HORIZON_NONE; horizon <= HORIZON_MEAN; horizon += 2) {
            image in;
            envmap map = {0};
            if (!image_read(&in, data, bytes)) {
                if (in.rgb || !*in.error) abort();
                return;
            }
            volatile float last = in.rgb[image_floats(&in) - 1];
            (void)last;
            if ((double)in.width * in.height > 2e3) { /* what follows is slow, and no news */
                image_free(&in);
                return;
            }
            image_flip(&in);
            if (layout_map(&map, &in, m, horizon)) {
                if (in.rgb || !map.texels || map.size < 1) abort();
                if (m >= 0 && map.mapping != m) abort();
                if (envmap_mips_build(&map)) abort();
            } else if (map.texels || !*in.error) abort();
            image_free(&in);
            envmap_free(&map);
        }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t bytes) {
    fuzz_variants(read_as_any_picture, data, bytes);
    return 0;
}
