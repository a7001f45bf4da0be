/* save.h - from a map to a file, by the name's ending; a file is there whole or not at all
   (write_file.h). Include after load.h and the write_*.h.

   SPDX-License-Identifier: MIT */

#ifndef SAVE_H
#define SAVE_H

#include <errno.h>
#include <math.h>
#include <string.h>
#include <strings.h>

static inline int ends_with(const char *text, const char *end) {
    size_t a = strlen(text), b = strlen(end);
    return a >= b && !strcasecmp(text + a - b, end);
}

/* From SAVE_KTX2 on: containers of texels in a format, with levels. */
enum { SAVE_PFM, SAVE_PNG, SAVE_HDR, SAVE_KTX2, SAVE_KTX1, SAVE_DDS, SAVE_KINDS };
static const char *const save_ends[] = {".pfm", ".png", ".hdr", ".ktx2", ".ktx", ".dds"};
#define SAVE_NAMES "pfm|png|hdr|ktx2|ktx|dds"

static inline int save_kind(const char *path) {
    int kind = 0;
    while (kind < SAVE_KINDS && !ends_with(path, save_ends[kind])) kind++;
    return kind;
}

/* Refuses a file name before any work is done for it, and options that would do nothing. */
static inline int check_output(const options *o) {
    const char *path = o->files[1];
    int kind = save_kind(path);
    if (kind == SAVE_KINDS)
        return fail(USAGE_ERROR, path, "is no name to write to", "end it in ." SAVE_NAMES);
    if (kind >= SAVE_KTX2 && strchr(path, '%'))
        return fail(USAGE_ERROR, path, "holds all six faces in one file", "leave out the %");
    if (kind < SAVE_KTX2 && is_given(o, "--format"))
        return fail(USAGE_ERROR, "--format", "would do nothing here", "it goes with ktx2|ktx|dds");
    if (kind != SAVE_PNG && is_given(o, "--exposure"))
        return fail(USAGE_ERROR, "--exposure", "would do nothing here", "it goes with png");
    return DONE;
}

static inline unsigned texel_colour(const float texel[3], float exposure) {
    float light[3];
    int c;
    for (c = 0; c < 3; c++) light[c] = picture_curve(exposure * texel[c]);
    return picture_colour(light);
}

/* A pixel per texel, faces below each other as in a PFM. 0, or an errno. */
static inline int save_png(const envmap *map, const char *path, float exposure) {
    int width = map_width(map), x, y, error;
    int height = map->size * envmap_faces(map->mapping) * map->slices;
    picture p;
    if (!picture_create(&p, width, height)) return ENOMEM;
    for (y = 0; y < height; y++)
        for (x = 0; x < width; x++) {
            const float *texel = map->texels + 3 * ((size_t)y * (size_t)width + (size_t)x);
            picture_blend(&p, x, y, texel_colour(texel, exposure), 1);
        }
    error = write_png(&p, path);
    picture_free(&p);
    return error;
}

/* 0, or the exit status after what a writer returned. */
static inline int check_written(int error, const char *path) {
    if (!error || error == ENOMEM) return check(write_result(error), path);
    return fail(FILE_ERROR, path, why_not_written(error), NULL);
}

/* One file; numbers that its format cannot hold are said. */
static inline int save_file(const envmap *map, const char *path, float exposure, int format) {
    int kind = save_kind(path), error;
    texture t = {0};
    t.map = map, t.format = format;
    switch (kind) {
    case SAVE_PFM: error = write_pfm(map, 0, path); break;
    case SAVE_PNG: error = save_png(map, path, exposure); break;
    case SAVE_HDR: error = write_hdr(&t, 0, path); break;
    case SAVE_KTX2: error = write_ktx2(&t, path); break;
    case SAVE_KTX1: error = write_ktx1(&t, path); break;
    default: error = write_dds(&t, path);
    }
    if (t.saturated && !error)
        fprintf(stderr, "envmap %s: %s: %ld numbers are too large for %s, and became its largest\n",
                command_name, path, t.saturated,
                kind == SAVE_HDR ? "RGBE" : texel_format_name[format]);
    return check_written(error, path);
}

/* Six files, the % in whose name stands for px nx py ny pz nz. */
static inline int save_faces(const envmap *map, const char *pattern, float exposure) {
    char path[4096];
    int face, status = DONE;
    for (face = 0; face < 6 && !status; face++) {
        envmap one = no_map;
        if (!face_path(path, pattern, face_words[0][face]))
            return fail(FILE_ERROR, pattern, why_not(ENAMETOOLONG), NULL);
        status = check(texture_face(&one, map, face), path);
        if (!status) status = save_file(&one, path, exposure, 0);
        envmap_free(&one);
    }
    return status;
}

/* --border: the map becomes the wider picture that is written. */
static inline int add_border(envmap *map, const options *o) {
    envmap wide = no_map;
    int status;
    if (!o->border) return DONE;
    if (o->border > map->size)
        return fail(RANGE_ERROR, "--border", "is wider than the map", "at most its --size");
    status = check(border_map(&wide, map, o->border), "--border");
    if (status) return status;
    envmap_free(map);
    *map = wide;
    return DONE;
}

/* Level 0, and of containers all levels, as --exposure and --format say. */
static inline int save(const envmap *map, const char *path, const options *o) {
    float exposure = picture_exposure(map) * exp2f((float)o->exposure);
    int kind = save_kind(path), faces = envmap_faces(map->mapping);
    if (map->slices > 1 && kind != SAVE_PFM && kind != SAVE_PNG)
        return fail(USAGE_ERROR, path, "cannot hold slices", "a .pfm can");
    if (kind >= SAVE_KTX2 && faces != 6 && faces != 1)
        return fail(USAGE_ERROR, path, "holds a cube or one picture", "--to cube makes one");
    if (!strchr(path, '%')) return save_file(map, path, exposure, o->format);
    if (faces == 6 && map->slices == 1) return save_faces(map, path, exposure);
    return fail(USAGE_ERROR, path, "six files hold the faces of a cube", "--to cube makes one");
}

/* Creates a folder and those above it; one that exists is fine. */
static inline int make_folder(const char *path) {
    char part[4096];
    size_t i, length = strlen(path);
    struct stat about;
    if (length >= sizeof part) return fail(FILE_ERROR, path, "the path is too long", NULL);
    for (i = 0; i <= length; i++) {
        part[i] = path[i];
        if (i == 0 || (path[i] && !strchr(SYSTEM_SLASHES, path[i])) || path[i - 1] == ':') continue;
        part[i] = 0;
        if (mkdir(part, 0777) && errno != EEXIST)
            return fail(FILE_ERROR, part, why_not(errno), "name a folder that can be created");
        part[i] = path[i];
    }
    if (stat(path, &about) || !S_ISDIR(about.st_mode))
        return fail(FILE_ERROR, path, "is not a folder", "name a folder that can be created");
    return DONE;
}

#endif /* SAVE_H */
