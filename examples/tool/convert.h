/* convert.h - the commands that make maps without a filter: convert, mips, generate. Include after
   save.h, progress.h and labels.h.

   SPDX-License-Identifier: MIT */

#ifndef CONVERT_H
#define CONVERT_H

#include <math.h>

/* An edge that keeps about the source's resolution at the equator, where --size is not given. */
static inline int natural_size(const envmap *source, int to) {
    double around = source->mapping == ENVMAP_LATLONG ? 2.0 * source->size
                    : source->mapping == ENVMAP_CUBE  ? 4.0 * source->size
                                                      : 2.0 * source->size;
    if (to == source->mapping) return source->size;
    return (int)fmax(1, to == ENVMAP_CUBE ? around / 4 : around / 2);
}

/* dst = an empty map as --to and --size say, else like the source. */
static inline int create_output(envmap *dst, const envmap *src, const options *o, int levels,
                                int slices) {
    int to = o->to >= 0 ? o->to : src->mapping;
    int size = o->size > 0 ? o->size : natural_size(src, to);
    *dst = no_map;
    return check(envmap_create(dst, to, size, levels ? levels : envmap_levels(size), slices),
                 "output");
}

/* in as the level 0 of out, with progress. */
static inline int resample(envmap *out, const envmap *in, const options *o) {
    meter m = meter_start(o);
    envmap_filter_desc desc = describe(o, &m);
    envmap_result result = envmap_resample(out, in, &desc.work);
    meter_stop(&m);
    return check(result, o->files[0]);
}

static inline int run_convert(const options *o) {
    envmap in, out = no_map;
    int status = check_output(o);
    if (!status) status = load(&in, o->files[0], o);
    if (status) return status;
    status = create_output(&out, &in, o, 1, in.slices);
    if (!status) status = resample(&out, &in, o);
    if (!status) status = add_border(&out, o);
    if (!status) status = save(&out, o->files[1], o);
    envmap_free(&in);
    envmap_free(&out);
    return status;
}

static inline int save_levels(const envmap *map, const char *prefix) {
    char path[4096];
    int level, status = DONE;
    for (level = 0; level < map->levels && !status; level++) {
        snprintf(path, sizeof path, "%s%d.pfm", prefix, level);
        status = check_written(write_pfm(map, level, path), path);
        if (!status) printf("%s\n", path);
    }
    return status;
}

static inline int run_mips(const options *o) {
    envmap in, out = no_map;
    int kind = save_kind(o->files[1]), whole = kind >= SAVE_KTX2 && kind < SAVE_KINDS;
    int status;
    envmap_filter_desc desc = describe(o, NULL);
    if (!whole && is_given(o, "--format"))
        return fail(USAGE_ERROR, "--format", "would do nothing here", "it goes with ktx2|ktx|dds");
    status = load(&in, o->files[0], o);
    if (status) return status;
    status = create_output(&out, &in, o, 0, in.slices);
    if (!status) status = resample(&out, &in, o);
    if (!status) status = check(envmap_mips_work(&out, &desc.work), o->files[0]);
    if (!status) status = add_border(&out, o);
    if (!status && whole) status = save(&out, o->files[1], o);
    else if (!status) status = save_levels(&out, o->files[1]);
    envmap_free(&in);
    envmap_free(&out);
    return status;
}

/* A scene, or the labelled sky, whose number is SCENE_COUNT. */
static inline int run_generate(const options *o) {
    envmap map = no_map;
    int scene, status = check_output(o);
    int to = o->to >= 0 ? o->to : ENVMAP_LATLONG;
    for (scene = 0; scene < SCENE_COUNT; scene++)
        if (!strcmp(scene_name[scene], o->files[0])) break;
    if (scene == SCENE_COUNT && strcmp(o->files[0], "labels"))
        return fail(USAGE_ERROR, o->files[0], "is no scene", "overcast, studio, sun or labels");
    if (status) return status;
    status = check(envmap_create(&map, to, o->size > 0 ? o->size : 256, 1, 1), "output");
    if (status) return status;
    if (scene < SCENE_COUNT) scene_fill(&map, scene);
    else labels_fill(&map);
    status = add_border(&map, o);
    if (!status) status = save(&map, o->files[1], o);
    envmap_free(&map);
    return status;
}

#endif /* CONVERT_H */
