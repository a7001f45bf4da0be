/* stage.h - what an OpenGL example lights its object with: a scene of scenes.h or the map that is
   named on the command line, as an envmap, as a cube with levels, as nine coefficients.

   Include it first: the library, its bodies and all that these examples share come with it.

   SPDX-License-Identifier: MIT */

#ifndef STAGE_H
#define STAGE_H

#define _POSIX_C_SOURCE 200809L
#define ENVMAP_STATIC
#define ENVMAP_IMPLEMENTATION
#include "envmap.h"
#include "../tool/scenes.h"
#include "gl.h"
#include "gl_file.h"
#include "surface.h"
#include "../tool/threads.h"

static const float stage_exposure[SCENE_COUNT] = {0.62f, 0.62f, 0.52f};

typedef struct stage {
    envmap environment, cube; /* the source, and a cube of it with all levels */
    GLuint sky;               /* the cube as a texture */
    GLuint backdrop, soft;    /* for a background: finer, and out of focus */
    GLuint file;              /* a cube that was read from a KTX or DDS file, as it is, or 0 */
    int file_levels;
    GLuint surface, behind; /* programs */
    float sh[28];           /* irradiance / pi, for surface.sh */
    float turn[9];          /* of the environment: world direction -> map */
    threads_pool threads;
    envmap_filter_desc desc; /* on all threads */
} stage;

/* Says what went wrong; returns 1 when nothing did. */
static inline int stage_say(envmap_result result) {
    if (!result) return 1;
    fprintf(stderr, "%s\n", envmap_result_text(result));
    gl_errors++;
    return 0;
}

/* The largest exponent that is filtered at once: its lobe is not thinner than two texels of the
   environment, and has a few hundred bands at the most. */
static inline float stage_sharpest(const stage *st) {
    float edge = (float)st->environment.size / 7;
    return fminf(fmaxf(edge * edge, 1), 2000);
}

/* A map of the environment through a lobe, as a texture. */
static inline envmap_result stage_filter(GLuint *out, const stage *st, int mapping, int size,
                                         const envmap_lobe *lobe) {
    envmap map = {0};
    envmap_result result;
    result = envmap_create(&map, mapping, size, 1, 1);
    if (!result) result = envmap_filter(&map, &st->environment, lobe, &st->desc);
    if (!result) {
        gl.DeleteTextures(1, out);
        *out = gl_map(&map);
    }
    envmap_free(&map);
    return result;
}

#define STAGE_BACKDROP 1024 /* edge: a pixel or two of a window to a texel */

/* What stands behind an object in focus: the scene's formula drawn finer, or (path) the map. */
static inline envmap_result stage_backdrop(stage *st, int scene, const char *path) {
    envmap fine = {0}, cube = {0};
    int size = path ? st->environment.size : STAGE_BACKDROP;
    envmap_result result = envmap_create(&cube, ENVMAP_CUBE, size, 1, 1);
    if (!result && !path) result = envmap_create(&fine, ENVMAP_LATLONG, 2 * size, 1, 1);
    if (!result && !path) scene_fill(&fine, scene);
    if (!result) result = envmap_resample(&cube, path ? &st->environment : &fine, &st->desc.work);
    if (!result) {
        gl.DeleteTextures(1, &st->backdrop);
        st->backdrop = gl_map(&cube);
    }
    envmap_free(&fine);
    envmap_free(&cube);
    return result;
}

/* Everything that follows from st->environment. */
static inline envmap_result stage_prepare(stage *st) {
    double sh[27];
    envmap_lobe diffuse = envmap_lobe_diffuse();
    envmap_lobe blur = envmap_lobe_gaussian(stage_sharpest(st));
    envmap_result result = ENVMAP_OK;
    if (!st->cube.texels)
        result = envmap_create(&st->cube, ENVMAP_CUBE, 256, envmap_levels(256), 1);
    if (!result) result = envmap_resample(&st->cube, &st->environment, NULL);
    if (!result) result = envmap_mips_build(&st->cube);
    if (!result) result = envmap_sh_project(sh, 3, &st->environment, 0, 0, NULL);
    if (!result) result = envmap_sh_convolve(sh, sh, 3, &diffuse, 0);
    if (!result) result = envmap_sh_pack(NULL, st->sh, sh);
    if (!result) result = stage_filter(&st->soft, st, ENVMAP_CUBE, 128, &blur);
    if (result) return result;
    gl.DeleteTextures(1, &st->sky);
    st->sky = gl_map(&st->cube);
    return ENVMAP_OK;
}

static inline int stage_ends_with(const char *path, const char *end) {
    size_t length = strlen(path), tail = strlen(end);
    return length > tail && !strcmp(path + length - tail, end);
}

static inline int stage_is_texture(const char *path) {
    return stage_ends_with(path, ".ktx") || stage_ends_with(path, ".ktx2") ||
           stage_ends_with(path, ".dds");
}

/* Level 0 of a KTX or DDS file as an environment; a cube stays in *texture with all its levels. */
static inline envmap_result stage_open_texture(envmap *out, GLuint *texture, int *levels,
                                               const char *path) {
    gl_file f;
    const char *why = gl_file_open(&f, path);
    envmap_result result;
    if (why) return fprintf(stderr, "%s: %s\n", path, why), ENVMAP_ERROR_FILE;
    *texture = gl_file_upload(&f), *levels = f.levels;
    f.levels = 1;
    result = gl_file_map(out, &f, *texture);
    if (result || f.faces == 1) {
        gl.DeleteTextures(1, texture);
        *texture = 0;
    }
    gl_file_free(&f);
    return result;
}

/* Another environment: a lat-long PFM, a KTX or DDS file, or (path NULL) a scene. What was stays
   when that fails. */
static inline envmap_result stage_light(stage *st, int scene, const char *path) {
    envmap next, old = st->environment;
    envmap_result result;
    GLuint file = 0;
    int levels = 0;
    memset(&next, 0, sizeof next);
    if (path && stage_is_texture(path)) {
        result = stage_open_texture(&next, &file, &levels, path);
    } else if (path) {
        result = envmap_pfm_load(&next, path, ENVMAP_LATLONG);
    } else {
        result = envmap_create(&next, ENVMAP_LATLONG, 256, 1, 1);
        if (!result) scene_fill(&next, scene);
    }
    if (result) return result;
    st->environment = next;
    result = stage_prepare(st);
    if (!result) result = stage_backdrop(st, scene, path);
    if (result) {
        st->environment = old, old = next;
        stage_prepare(st);
    }
    gl.DeleteTextures(1, result ? &file : &st->file);
    if (!result) st->file = file, st->file_levels = levels;
    envmap_free(&old);
    return result;
}

/* Fills a stage after gl_open: the file or the scene's name among the arguments, else the scene;
   and the exposure that suits it. Returns 1 when it worked. */
static inline int stage_open(stage *st, gl_app *app, int scene, int argc, char **argv) {
    const char *path = NULL;
    int i, k;
    memset(st, 0, sizeof *st);
    for (i = 1; i < argc; i++) {
        if (stage_ends_with(argv[i], ".pfm") || stage_is_texture(argv[i])) path = argv[i];
        for (k = 0; k < SCENE_COUNT; k++)
            if (!strcmp(argv[i], scene_name[k])) scene = k;
    }
    threads_begin(&st->threads, threads_here());
    st->desc.work.executor.run = threads_run, st->desc.work.executor.user = &st->threads;
    st->turn[0] = st->turn[4] = st->turn[8] = 1;
    st->surface = surface_program();
    st->behind = gl_program(gl_cover, gl_sky);
    if (!st->surface || !st->behind || !stage_say(stage_light(st, scene, path))) return 0;
    app->exposure = path ? picture_exposure(&st->environment) : stage_exposure[scene];
    return 1;
}

/* The environment behind everything, in focus or not. */
static inline void stage_sky(const stage *st, const gl_app *app, int sharp) {
    gl_draw_sky(app, st->behind, sharp ? st->backdrop : st->soft, st->turn);
}

static inline void stage_close(stage *st) {
    threads_end(&st->threads);
    envmap_free(&st->environment);
    envmap_free(&st->cube);
    gl.DeleteTextures(1, &st->sky);
    gl.DeleteTextures(1, &st->backdrop);
    gl.DeleteTextures(1, &st->soft);
    gl.DeleteTextures(1, &st->file);
    gl.DeleteProgram(st->surface);
    gl.DeleteProgram(st->behind);
}

#endif /* STAGE_H */
