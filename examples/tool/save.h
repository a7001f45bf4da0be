/* save.h - from a map to a file, by the name's ending. Include after load.h and picture.h.

   SPDX-License-Identifier: MIT */

#ifndef SAVE_H
#define SAVE_H

#include <errno.h>
#include <math.h>
#include <string.h>
#include <strings.h>
#include <sys/stat.h>

static inline int ends_with(const char *text, const char *end) {
    size_t a = strlen(text), b = strlen(end);
    return a >= b && !strcasecmp(text + a - b, end);
}

/* Refuses a file name before any work is done for it. */
static inline int check_output(const char *path) {
    if (ends_with(path, ".pfm") || ends_with(path, ".png")) return DONE;
    return fail(USAGE_ERROR, path, "is no name to write to", "end it in .pfm or .png");
}

static inline unsigned texel_colour(const float texel[3], float exposure) {
    float light[3];
    int c;
    for (c = 0; c < 3; c++) light[c] = picture_curve(exposure * texel[c]);
    return picture_colour(light);
}

/* A pixel per texel, faces below each other as in a PFM. */
static inline int save_png(const envmap *map, const char *path, double stops) {
    float exposure = picture_exposure(map) * exp2f((float)stops);
    int width = map_width(map), x, y, saved;
    int height = map->size * envmap_faces(map->mapping) * map->slices;
    picture p;
    if (!picture_create(&p, width, height)) return check(ENVMAP_ERROR_MEMORY, path);
    for (y = 0; y < height; y++)
        for (x = 0; x < width; x++) {
            const float *texel = map->texels + 3 * ((size_t)y * (size_t)width + (size_t)x);
            picture_blend(&p, x, y, texel_colour(texel, exposure), 1);
        }
    saved = picture_save(&p, path);
    picture_free(&p);
    return check(saved ? ENVMAP_OK : ENVMAP_ERROR_FILE, path);
}

static inline int save(const envmap *map, const char *path, double stops) {
    if (ends_with(path, ".png")) return save_png(map, path, stops);
    return check(envmap_pfm_save(map, path, 0), path);
}

/* Creates a folder and those above it; one that exists is fine. */
static inline int make_folder(const char *path) {
    char part[4096];
    size_t i, length = strlen(path);
    struct stat about;
    if (length >= sizeof part) return fail(FILE_ERROR, path, "the path is too long", NULL);
    for (i = 0; i <= length; i++) {
        part[i] = path[i];
        if (i == 0 || (path[i] && path[i] != '/')) continue;
        part[i] = 0;
        if (mkdir(part, 0777) && errno != EEXIST)
            return fail(FILE_ERROR, part, strerror(errno), "name a folder that can be created");
        part[i] = path[i];
    }
    if (stat(path, &about) || !S_ISDIR(about.st_mode))
        return fail(FILE_ERROR, path, "is not a folder", "name a folder that can be created");
    return DONE;
}

#endif /* SAVE_H */
