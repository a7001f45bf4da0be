/* load.h - from a file to a map: load() is what every command reads with, so all of them take the
   same files and options, and clean alike. Include after options.h.

       bytes -> picture (read.h) -> map (layouts.h) -> turned (orientation.h) -> cleaned

   SPDX-License-Identifier: MIT */

#ifndef LOAD_H
#define LOAD_H

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* The options that load() heeds. */
#define LOAD_OPTIONS "--mapping --from --flip --horizon --from-convention --rotate --limit "

static const envmap no_map = {NULL, NULL, 0, 0, 0, 0, 0, 0};

static inline int map_width(const envmap *map) {
    return map->mapping == ENVMAP_LATLONG ? 2 * map->size : map->size;
}

typedef struct file_bytes {
    unsigned char *data;
    size_t count, room;
} file_bytes;

/* All that is left in a file; 0, and errno, if it cannot be read or there is no memory for it. */
static inline int read_all(file_bytes *bytes, FILE *file) {
    struct stat about;
    bytes->count = 0, bytes->room = 1 << 16, bytes->data = NULL;
    if (!fstat(fileno(file), &about) && S_ISREG(about.st_mode) && about.st_size > 0)
        bytes->room = (size_t)about.st_size + 1;
    for (;;) {
        unsigned char *more = (unsigned char *)realloc(bytes->data, bytes->room);
        if (!more) return errno = ENOMEM, 0;
        bytes->data = more;
        errno = 0;
        bytes->count += fread(more + bytes->count, 1, bytes->room - bytes->count, file);
        if (ferror(file)) return 0;
        if (bytes->count < bytes->room) return 1;
        bytes->room *= 2;
    }
}

/* The bytes of a path, or of standard input for "-"; to be freed in any case. */
static inline int read_path(file_bytes *bytes, const char *path) {
    int standard = !strcmp(path, "-"), ok;
    FILE *file = standard ? stdin : fopen(path, "rb");
    bytes->data = NULL, bytes->count = 0;
    if (!file) return fail(FILE_ERROR, path, why_not(errno), NULL);
    ok = read_all(bytes, file);
    if (!ok) fail(FILE_ERROR, path, why_not(errno), NULL);
    if (!standard) fclose(file);
    return ok ? DONE : FILE_ERROR;
}

/* Every line of the remarks, as a sentence about `path`. */
static inline void print_remarks(const char *path, const char *remarks) {
    const char *end;
    for (; (end = strchr(remarks, '\n')) != NULL; remarks = end + 1)
        fprintf(stderr, "envmap %s: %s: %.*s\n", command_name, path, (int)(end - remarks), remarks);
}

static inline int load_picture(image *out, const char *path) {
    file_bytes bytes;
    int status = read_path(&bytes, path);
    if (!status && !image_read(out, bytes.data, bytes.count))
        status = fail(out->no_room ? RANGE_ERROR : FILE_ERROR, path, out->error, NULL);
    free(bytes.data);
    return status;
}

/* How six files are named: '%' in a path stands for one of these, +X -X +Y -Y +Z -Z. */
static const char *const face_words[][6] = {{"px", "nx", "py", "ny", "pz", "nz"},
                                            {"posx", "negx", "posy", "negy", "posz", "negz"},
                                            {"right", "left", "top", "bottom", "front", "back"},
                                            {"0", "1", "2", "3", "4", "5"}};
enum { FACE_WORDS = sizeof face_words / sizeof face_words[0] };

static inline int file_exists(const char *path) {
    struct stat about;
    return !stat(path, &about);
}

static inline int face_path(char out[4096], const char *pattern, const char *word) {
    const char *at = strchr(pattern, '%');
    return snprintf(out, 4096, "%.*s%s%s", (int)(at - pattern), pattern, word, at + 1) < 4096;
}

/* Faces of the same edge below each other, as one picture. */
static inline int load_face(image *strip, int face, const char *path) {
    image one;
    size_t floats;
    int status = load_picture(&one, path);
    if (status) return status;
    floats = image_floats(&one);
    if (face == 0) {
        *strip = one, strip->rgb = NULL, strip->height = 6 * one.width;
        if (!image_create(strip)) status = fail(RANGE_ERROR, path, strip->error, NULL);
    }
    if (!status && (one.width != one.height || one.width != strip->width))
        status =
            fail(FILE_ERROR, path, "is not square, or not of the size of the first face", NULL);
    if (!status) memcpy(strip->rgb + (size_t)face * floats, one.rgb, floats * sizeof(float));
    image_free(&one);
    return status;
}

static inline int load_faces(image *strip, const char *pattern) {
    char path[4096];
    int words = 0, face, status = DONE;
    while (words < FACE_WORDS &&
           (!face_path(path, pattern, face_words[words][0]) || !file_exists(path)))
        words++;
    if (words == FACE_WORDS)
        return fail(FILE_ERROR, pattern, "six files are looked for, and there is no first one",
                    "% stands for px nx py ny pz nz, posx ..., right left top bottom front back, "
                    "or 0 to 5");
    for (face = 0; face < 6 && !status; face++) {
        face_path(path, pattern, face_words[words][face]);
        status = load_face(strip, face, path);
    }
    if (status) image_free(strip);
    return status;
}

/* Level 0 as filters want it, and a line on what was taken. Without a limit Inf becomes the largest
   finite number of the map: mostly it is a sun that went over a format's edge. */
static inline void load_clean(envmap *map, const char *path, double limit) {
    size_t count = 3 * (size_t)map_width(map) * (size_t)map->size *
                   (size_t)envmap_faces(map->mapping) * (size_t)map->slices;
    float largest = 0;
    envmap_cleaned found;
    size_t i;
    for (i = 0; i < count; i++)
        if (map->texels[i] > largest && isfinite(map->texels[i])) largest = map->texels[i];
    if (limit > 0) largest = (float)limit;
    envmap_clean(map, largest > 0 ? largest : 1, &found);
    if (found.nan || found.negative || found.infinite)
        fprintf(stderr,
                "envmap %s: %s: %d NaN and %d negative samples became 0, %d infinite ones %g: on "
                "%.2g %% of the sphere\n",
                command_name, path, found.nan, found.negative, found.infinite, (double)largest,
                100 * found.replaced);
    if (limit > 0)
        fprintf(stderr,
                "envmap %s: %s: %d samples above %g became it, which took %.3g %% of the energy\n",
                command_name, path, found.limited, limit, 100 * found.energy);
}

/* The same as load(), not cleaned; facts: what the picture was, without pixels. */
static inline int load_as_it_is(envmap *map, image *facts, const char *path, const options *o) {
    double matrix[9];
    int status, width, height;
    *map = no_map;
    memset(facts, 0, sizeof *facts);
    if (strchr(path, '%') && !file_exists(path)) status = load_faces(facts, path);
    else status = load_picture(facts, path);
    if (status) return status;
    width = facts->width, height = facts->height;
    if (o->flip) image_flip(facts);
    if (!layout_map(map, facts, o->mapping, o->horizon))
        status = fail(facts->no_room ? RANGE_ERROR : FILE_ERROR, path, facts->error, NULL);
    print_remarks(path, facts->remarks);
    image_free(facts);
    facts->width = width, facts->height = height;
    if (status) return status;
    orientation_matrix(matrix, o->convention, o->rotate);
    status = check(orientation_turn_map(map, matrix), path);
    if (status) envmap_free(map);
    return status;
}

/* *map = a file ("-": standard input; "sky_%.hdr": six), as the options say; nothing on failure. */
static inline int load(envmap *map, const char *path, const options *o) {
    image facts;
    int status = load_as_it_is(map, &facts, path, o);
    if (!status) load_clean(map, path, o->limit);
    return status;
}

#endif /* LOAD_H */
