/* bake.h - the command bake: from a picture, or a folder of them, to what an engine loads. Include
   after convert.h and the write_*.h; it includes the rest of its parts.

   SPDX-License-Identifier: MIT */

#ifndef BAKE_H
#define BAKE_H

#include <dirent.h>

#include "bake_sun.h"
#include "bake_read.h"
#include "bake_job.h"
#include "bake_preview.h"
#include "bake_manifest.h"

static inline int bake_check(bake_job *j, envmap_result result) {
    if (bake_stopped)
        return fail(RANGE_ERROR, j->input, "stopped; no file is half written",
                    "a folder without manifest.json is not complete");
    return check(result, j->input);
}

/* The source, cleaned; the limit's energy goes into the manifest, so it is applied here. */
static inline int bake_load(bake_job *j) {
    options o = *j->o;
    int status;
    o.limit = 0;
    status = load(&j->source, j->input, &o);
    if (!status && j->source.slices > 1)
        status = fail(FILE_ERROR, j->input, "has slices: an environment has one", NULL);
    if (!status && j->o->limit > 0)
        status = check(envmap_clean(&j->source, (float)j->o->limit, &j->cleaned), j->input);
    j->source_mapping = j->source.mapping, j->source_size = j->source.size;
    bake_choose(j);
    bake_expect(j);
    return status;
}

static inline int bake_compute(bake_job *j) {
    int status;
    if (j->o->sun) j->light_count = bake_take_lights(j->lights, &j->source);
    bake_stage(j, BAKE_SUN, 0.16f, 0.58f);
    status = bake_check(j, j->preset->container == BAKE_NONE ? ENVMAP_OK : bake_filter(j));
    bake_stage(j, BAKE_FILTERING, 0.58f, 0.65f);
    if (!status) status = bake_check(j, bake_diffuse(j));
    if (!status) status = bake_check(j, bake_table(j));
    bake_stage(j, BAKE_DIFFUSE, 0.65f, BAKE_BEFORE);
    return status;
}

/* An older manifest would vouch for files that are about to change. */
static inline void bake_forget(bake_job *j) {
    struct stat about;
    if (!lstat(bake_path(j, "manifest.json"), &about) && S_ISREG(about.st_mode)) remove(j->path);
}

static inline int bake_finish(bake_job *j) {
    int status = DONE, none = j->preset->container == BAKE_NONE;
    bake_forget(j);
    if (!none) status = bake_save_maps(j);
    if (!status && j->preset->panorama) status = bake_save_panorama(j);
    if (!status && none) status = bake_check(j, bake_stand_in(j));
    if (!status) status = bake_check(j, ENVMAP_OK);
    if (!status) status = bake_preview(j);
    bake_stage(j, BAKE_WRITING, BAKE_BEFORE, 1);
    if (!status && !none) status = bake_measure(j);
    bake_stage(j, BAKE_MEASURING, 1, 1);
    if (!status) status = bake_check(j, ENVMAP_OK);
    return status ? status : bake_manifest(j);
}

static inline void bake_free(bake_job *j) {
    envmap_free(&j->source), envmap_free(&j->chain), envmap_free(&j->irradiance);
    envmap_free(&j->table), envmap_free(&j->chain_back), envmap_free(&j->irradiance_back);
}

/* What a format could not hold is said, with what would help. */
static inline void bake_warn(const bake_job *j, const bake_file *f) {
    fprintf(stderr,
            "envmap bake: %s/%s: %ld numbers are too large for %s, which loses %.2g %% of "
            "the energy\n",
            j->folder, f->name, f->saturated, f->format, 100 * f->lost);
    if (!j->light_count)
        fprintf(stderr, "  --sun takes a bright light out, --limit makes it darker\n");
}

static inline void bake_print(const bake_job *j) {
    int k;
    for (k = 0; k < j->file_count; k++)
        if (j->files[k].saturated) bake_warn(j, &j->files[k]);
    for (k = 0; k < j->file_count; k++)
        printf("%s/%-18s %s, %s\n", j->folder, j->files[k].name, j->files[k].container,
               j->files[k].format);
    printf("%s/preview.png\n%s/manifest.json\n", j->folder, j->folder);
    for (k = 0; k < j->light_count; k++)
        printf("a light of %.3g degrees with %.3g %% of the energy is in the manifest, not in the "
               "maps\n",
               j->lights[k].diameter, 100 * j->lights[k].share);
}

static inline int bake_one(const options *o, const char *input, const char *folder) {
    bake_job *j = (bake_job *)calloc(1, sizeof *j);
    int status;
    if (!j) return check(ENVMAP_ERROR_MEMORY, input);
    j->lobe = is_given(o, "--lobe") ? o->lobe : LOBE_GGX;
    j->o = o, j->preset = &bake_presets[o->engine], j->input = input, j->folder = folder;
    j->source = no_map, j->m = meter_start(o), j->started = seconds();
    j->desc = describe(o, &j->m);
    j->desc.work.progress.user = j, j->desc.work.progress.report = bake_report;
    status = bake_load(j);
    bake_stage(j, BAKE_READING, 0.06f, 0.16f);
    if (!status) status = make_folder(j->folder);
    if (!status) status = bake_compute(j);
    if (!status) status = bake_finish(j);
    meter_stop(&j->m);
    if (!status) bake_print(j);
    bake_free(j);
    free(j);
    return status;
}

static inline int bake_is_picture(const char *name) {
    static const char *const ends[] = {".hdr", ".exr", ".pfm", ".pic"};
    int k;
    for (k = 0; k < 4; k++)
        if (ends_with(name, ends[k])) return 1;
    return 0;
}

/* Every picture of a folder, each into a folder of its own name; one that fails stops no other. */
static inline int bake_folder(const options *o, DIR *directory) {
    struct dirent *entry;
    char input[WRITE_PATH], folder[WRITE_PATH];
    int worst = DONE, count = 0;
    while ((entry = readdir(directory)) != NULL && !bake_stopped) {
        int status, stem = (int)strlen(entry->d_name) - 4;
        if (!bake_is_picture(entry->d_name)) continue;
        snprintf(input, sizeof input, "%s/%s", o->files[0], entry->d_name);
        snprintf(folder, sizeof folder, "%s/%.*s", o->files[1], stem, entry->d_name);
        status = bake_one(o, input, folder);
        worst = status > worst ? status : worst;
        count++;
    }
    if (!count) return fail(FILE_ERROR, o->files[0], "has no .hdr, .exr, .pfm or .pic in it", NULL);
    return worst;
}

/* An engine that filters for itself gets a picture: what is said about maps would do nothing. */
static inline int bake_refuse(const options *o) {
    static const char *const of_maps[] = {"--size", "--levels", "--bend", "--lobe",
                                          "--sheen", "--tolerance", "--verify"};
    char why[96];
    int k;
    if (bake_presets[o->engine].container != BAKE_NONE) return DONE;
    for (k = 0; k < 7; k++) {
        if (!is_given(o, of_maps[k])) continue;
        snprintf(why, sizeof why, "does nothing with --for %s, which filters for itself",
                 bake_words[o->engine]);
        return fail(USAGE_ERROR, of_maps[k], why,
                    "leave it out, or take --for opengl for maps that are filtered here");
    }
    return DONE;
}

static inline int run_bake(const options *o) {
    DIR *directory;
    int status = bake_refuse(o);
    if (status) return status;
    if (is_given(o, "--lobe") && o->lobe != LOBE_PHONG && o->lobe != LOBE_GGX &&
        o->lobe != LOBE_CHARLIE)
        return fail(USAGE_ERROR, lobe_words[o->lobe], "is no lobe of a chain",
                    "--lobe ggx, phong or charlie");
    signal(SIGINT, bake_stop);
    signal(SIGTERM, bake_stop);
    directory = opendir(o->files[0]);
    if (!directory) return bake_one(o, o->files[0], o->files[1]);
    status = bake_folder(o, directory);
    closedir(directory);
    return status;
}

#endif /* BAKE_H */
