/* read_exr.h - OpenEXR pictures (.exr) through OpenEXR's own C library, where the tool was built
   with it (TOOL_EXR; Debian: libopenexr-dev). Include after image.h.

   Lines and tiles, any compression that the library knows, halves and floats. Of several parts the
   first, of several levels the finest is read. Channels are R, G, B, or Y for grey.
   Tests: tests/test_tool_read.c.

   SPDX-License-Identifier: MIT */

#ifndef READ_EXR_H
#define READ_EXR_H

#ifdef TOOL_EXR
#include <OpenEXR/openexr.h>
#include <stdint.h>
#include <string.h>

typedef struct exr_bytes {
    image *out;
    const unsigned char *data;
    uint64_t bytes;
} exr_bytes;

static inline int64_t exr_bytes_read(exr_const_context_t file, void *user, void *buffer,
                                     uint64_t size, uint64_t offset,
                                     exr_stream_error_func_ptr_t error) {
    const exr_bytes *in = (const exr_bytes *)user;
    (void)file, (void)error;
    if (offset >= in->bytes) return 0;
    if (size > in->bytes - offset) size = in->bytes - offset;
    memcpy(buffer, in->data + offset, (size_t)size);
    return (int64_t)size;
}

static inline int64_t exr_bytes_size(exr_const_context_t file, void *user) {
    (void)file;
    return (int64_t)((const exr_bytes *)user)->bytes;
}

/* The library's sentence, the first one, for the first says most. */
static inline void exr_bytes_error(exr_const_context_t file, exr_result_t code, const char *text) {
    void *user = NULL;
    (void)code;
    if (file && exr_get_user_data(file, &user) == EXR_ERR_SUCCESS && user) {
        image *out = ((const exr_bytes *)user)->out;
        if (!*out->error) image_fail(out, "%.200s", text);
    }
}

/* Which of R, G, B a channel goes to; 3: Y, to all; -1: it is not wanted. */
static inline int exr_colour(const char *name) {
    const char *at = *name && !name[1] ? strchr("RGBY", *name) : NULL;
    return at ? (int)(at - "RGBY") : -1;
}

/* The channels must be R, G and B, or Y alone, each in every pixel. */
static inline int exr_channels(image *out, exr_const_context_t file, int *grey) {
    const exr_attr_chlist_t *list = NULL;
    int k, seen = 0;
    if (exr_get_channels(file, 0, &list) != EXR_ERR_SUCCESS || !list)
        return image_fail(out, "its channels cannot be read");
    for (k = 0; k < list->num_channels; k++) {
        const exr_attr_chlist_entry_t *entry = &list->entries[k];
        int colour = exr_colour(entry->name.str);
        if (colour < 0) {
            seen |= strcmp(entry->name.str, "RY") ? 0 : 16;
            continue;
        }
        seen |= 1 << colour;
        if (entry->x_sampling != 1 || entry->y_sampling != 1)
            return image_fail(out, "has channels with fewer samples than pixels");
    }
    *grey = (seen & 7) != 7;
    if (*grey && (!(seen & 8) || (seen & 16)))
        return image_fail(out, "has no channels R, G, B, and no Y alone");
    return 1;
}

/* One chunk, that begins (x,y) pixels into the data window, into its place in the picture. Channels
   that are not wanted go to a sink: with none, OpenEXR 3.1 writes to NULL where one of three is
   wanted. */
static inline int exr_chunk(image *out, exr_const_context_t file, const exr_chunk_info_t *chunk,
                            int x, int y, int grey) {
    exr_decode_pipeline_t decode;
    float *first = out->rgb + 3 * ((size_t)y * (size_t)out->width + (size_t)x), *sink;
    int k, ok;
    memset(&decode, 0, sizeof decode);
    if (x + chunk->width > out->width || y + chunk->height > out->height) return 0;
    sink = (float *)malloc((size_t)chunk->width * (size_t)chunk->height * sizeof(float));
    if (!sink || exr_decoding_initialize(file, 0, chunk, &decode) != EXR_ERR_SUCCESS) {
        free(sink);
        return 0;
    }
    for (k = 0; k < decode.channel_count; k++) {
        exr_coding_channel_info_t *channel = &decode.channels[k];
        int colour = exr_colour(channel->channel_name);
        int wanted = colour >= 0 && (colour == 3) == grey;
        channel->decode_to_ptr = (uint8_t *)(wanted ? first + colour % 3 : sink);
        channel->user_pixel_stride = wanted ? 12 : 4;
        channel->user_line_stride = wanted ? 12 * out->width : 4 * chunk->width;
        channel->user_bytes_per_element = 4, channel->user_data_type = EXR_PIXEL_FLOAT;
    }
    ok = exr_decoding_choose_default_routines(file, 0, &decode) == EXR_ERR_SUCCESS &&
         exr_decoding_run(file, 0, &decode) == EXR_ERR_SUCCESS;
    exr_decoding_destroy(file, &decode);
    free(sink);
    return ok;
}

static inline int exr_lines(image *out, exr_const_context_t file, int top, int grey) {
    exr_chunk_info_t chunk;
    int32_t step = 0;
    int y;
    if (exr_get_scanlines_per_chunk(file, 0, &step) != EXR_ERR_SUCCESS || step < 1) return 0;
    for (y = 0; y < out->height; y += step)
        if (exr_read_scanline_chunk_info(file, 0, top + y, &chunk) != EXR_ERR_SUCCESS ||
            !exr_chunk(out, file, &chunk, 0, y, grey))
            return 0;
    return 1;
}

static inline int exr_tiles(image *out, exr_const_context_t file, int grey) {
    exr_chunk_info_t chunk;
    uint32_t width = 0, height = 0;
    exr_tile_level_mode_t level;
    exr_tile_round_mode_t rounding;
    int64_t x, y;
    if (exr_get_tile_descriptor(file, 0, &width, &height, &level, &rounding) != EXR_ERR_SUCCESS ||
        width < 1 || height < 1)
        return 0;
    for (y = 0; y * height < out->height; y++)
        for (x = 0; x * width < out->width; x++)
            if (exr_read_tile_chunk_info(file, 0, (int)x, (int)y, 0, 0, &chunk) !=
                    EXR_ERR_SUCCESS ||
                !exr_chunk(out, file, &chunk, (int)(x * width), (int)(y * height), grey))
                return 0;
    return 1;
}

/* Grey to all channels, and black where the window that is shown is larger than the data's. */
static inline int exr_show(image *out, const exr_attr_box2i_t *data, const exr_attr_box2i_t *shown,
                           int grey) {
    image all = *out;
    size_t i, count = image_floats(out);
    int x, y;
    for (i = 0; i < count && grey; i += 3) out->rgb[i + 1] = out->rgb[i + 2] = out->rgb[i];
    if (!memcmp(data, shown, sizeof *data)) return 1;
    all.rgb = NULL;
    all.width = shown->max.x - shown->min.x + 1, all.height = shown->max.y - shown->min.y + 1;
    if (!image_create(&all)) return image_fail(out, "%s", all.error), out->no_room = 1, 0;
    memset(all.rgb, 0, image_floats(&all) * sizeof(float));
    for (y = 0; y < all.height; y++)
        for (x = 0; x < all.width; x++) {
            int i_in = x + shown->min.x - data->min.x, j_in = y + shown->min.y - data->min.y;
            if (i_in < 0 || j_in < 0 || i_in >= out->width || j_in >= out->height) continue;
            memcpy(all.rgb + 3 * ((size_t)y * (size_t)all.width + (size_t)x),
                   out->rgb + 3 * ((size_t)j_in * (size_t)out->width + (size_t)i_in), 12);
        }
    image_free(out);
    *out = all;
    image_remark(out, "is black where its display window is larger than its data window\n");
    return 1;
}

static inline int exr_window_is_sane(const exr_attr_box2i_t *w) {
    int64_t width = (int64_t)w->max.x - w->min.x + 1, height = (int64_t)w->max.y - w->min.y + 1;
    return width > 0 && height > 0 && width <= 1000000 && height <= 1000000 &&
           w->min.x > -1000000000 && w->min.y > -1000000000 && w->max.x < 1000000000 &&
           w->max.y < 1000000000;
}

static inline int exr_part(image *out, exr_const_context_t file) {
    exr_storage_t storage;
    exr_attr_box2i_t data, shown;
    exr_envmap_t kind;
    int grey = 0, parts = 1, ok;
    if (exr_get_storage(file, 0, &storage) != EXR_ERR_SUCCESS || storage > EXR_STORAGE_TILED)
        return image_fail(out, "holds deep data, not a picture");
    if (exr_get_data_window(file, 0, &data) != EXR_ERR_SUCCESS ||
        exr_get_display_window(file, 0, &shown) != EXR_ERR_SUCCESS || !exr_window_is_sane(&data) ||
        !exr_window_is_sane(&shown))
        return image_fail(out, "has no size that makes sense");
    out->width = data.max.x - data.min.x + 1, out->height = data.max.y - data.min.y + 1;
    if (!exr_channels(out, file, &grey) || !image_create(out)) return 0;
    ok = storage == EXR_STORAGE_TILED ? exr_tiles(out, file, grey)
                                      : exr_lines(out, file, data.min.y, grey);
    if (!ok) return *out->error ? 0 : image_fail(out, "ends early or is damaged");
    if (exr_get_count(file, &parts) == EXR_ERR_SUCCESS && parts > 1)
        image_remark(out, "holds %d parts, of which the first is taken\n", parts);
    if (exr_attr_get_envmap(file, 0, "envmap", &kind) == EXR_ERR_SUCCESS)
        image_remark(out, "is marked as OpenEXR's kind of environment map: "
                          "--from-convention openexr turns it\n");
    return exr_show(out, &data, &shown, grey);
}

static inline int exr_read(image *out, const unsigned char *data, size_t bytes) {
    exr_context_initializer_t use = EXR_DEFAULT_CONTEXT_INITIALIZER;
    exr_context_t file = NULL;
    exr_bytes in;
    int ok;
    in.out = out, in.data = data, in.bytes = bytes;
    use.user_data = &in, use.read_fn = exr_bytes_read, use.size_fn = exr_bytes_size;
    use.error_handler_fn = exr_bytes_error;
    out->format = "OpenEXR";
    ok = exr_start_read(&file, "the picture", &use) == EXR_ERR_SUCCESS && exr_part(out, file);
    if (file) exr_finish(&file);
    if (!ok && !*out->error) image_fail(out, "is damaged");
    return ok;
}

#else

static inline int exr_read(image *out, const unsigned char *data, size_t bytes) {
    (void)data, (void)bytes;
    return image_fail(out, "is OpenEXR, and this tool was built without OpenEXR's library "
                           "(Debian: libopenexr-dev; then make demo again)");
}

#endif
#endif /* READ_EXR_H */
