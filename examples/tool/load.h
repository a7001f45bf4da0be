/* load.h - from a file to a map: load() is what every command reads with. Include after
   options.h.

   SPDX-License-Identifier: MIT */

#ifndef LOAD_H
#define LOAD_H

static const envmap no_map = {NULL, NULL, 0, 0, 0, 0, 0, 0};

static inline int map_width(const envmap *map) {
    return map->mapping == ENVMAP_LATLONG ? 2 * map->size : map->size;
}

/* Reads a PFM. Without --mapping its shape tells: 2:1 lat-long, 1:6 cube, 1:2 paraboloids; a square
   could be two things, and a taller strip has slices of who knows what. */
static inline int load(envmap *map, const char *path, const options *o) {
    static const int guesses[] = {ENVMAP_LATLONG, ENVMAP_CUBE, ENVMAP_PARABOLOID};
    envmap_result result = ENVMAP_ERROR_SHAPE;
    int k;
    *map = no_map;
    if (o->mapping >= 0) return check(envmap_pfm_load(map, path, o->mapping), path);
    for (k = 0; k < 3 && result == ENVMAP_ERROR_SHAPE; k++) {
        result = envmap_pfm_load(map, path, guesses[k]);
        if (!result && map->slices > 1) envmap_free(map), result = ENVMAP_ERROR_SHAPE;
    }
    return check(result, path);
}

#endif /* LOAD_H */
