/* refilter.h - a captured cube through the library in every frame: read back, filtered into a GGX
   chain on the CPU, uploaded.

     level l of 5 is roughness l/4: the mirror, of edge 128, to alpha = 1, of edge 8

   What a frame's filter gives back to its cache (cache.h) the next one takes, so the system is
   asked for memory in the first frames alone; the executor is the caller's.
   Include cache.h before envmap.h, and this after capture.h.
   What you will see: `per_frame`.  Test: a_refiltered_cube_is_the_library_s_chain.

   SPDX-License-Identifier: MIT */

#ifndef REFILTER_H
#define REFILTER_H

#define REFILTER_LEVELS 5

typedef struct refilter {
    envmap source, chain;
    GLuint cube; /* the chain */
    envmap_lobe lobes[REFILTER_LEVELS];
    envmap_filter_desc desc;
    cache kept;
    double read, filtered, uploaded; /* seconds that the last run's parts took */
    int asked;                       /* how often it asked the system for memory */
} refilter;

/* desc: tolerance and executor. Returns 1 if there is memory. */
static inline int refilter_create(refilter *r, const envmap_filter_desc *desc) {
    int l;
    memset(r, 0, sizeof *r);
    r->desc = *desc, r->desc.work.memory = &r->kept;
    for (l = 0; l < REFILTER_LEVELS; l++) {
        float roughness = (float)l / (REFILTER_LEVELS - 1);
        r->lobes[l] = envmap_lobe_ggx(roughness * roughness); /* alpha 0 is the mirror */
    }
    if (envmap_create(&r->source, ENVMAP_CUBE, CAPTURE_EDGE, 1, 1) ||
        envmap_create(&r->chain, ENVMAP_CUBE, CAPTURE_EDGE, REFILTER_LEVELS, 1))
        return 0;
    r->cube = gl_map(&r->chain);
    return 1;
}

static inline void refilter_free(refilter *r) {
    envmap_free(&r->source);
    envmap_free(&r->chain);
    gl.DeleteTextures(1, &r->cube);
    cache_free(&r->kept);
}

static inline void refilter_upload(const refilter *r) {
    int l, f;
    gl.BindTexture(GL_TEXTURE_CUBE_MAP, r->cube);
    for (l = 0; l < REFILTER_LEVELS; l++)
        for (f = 0; f < 6; f++)
            gl.TexSubImage2D(GL_TEXTURE_CUBE_MAP_POSITIVE_X + (GLenum)f, l, 0, 0, CAPTURE_EDGE >> l,
                             CAPTURE_EDGE >> l, GL_RGB, GL_FLOAT,
                             envmap_texel(&r->chain, l, 0, f, 0, 0));
    gl.Finish();
}

/* From level 0 of what was captured to the chain in r->cube. */
static inline envmap_result refilter_run(refilter *r, const capture *c) {
    double start = gl_seconds(), read, filtered;
    envmap_result result;
    capture_read(c, &r->source, 0);
    read = gl_seconds();
    r->kept.asked = 0;
    result = envmap_filter_chain(&r->chain, &r->source, r->lobes, REFILTER_LEVELS, &r->desc);
    r->asked = r->kept.asked;
    filtered = gl_seconds();
    refilter_upload(r);
    r->read = read - start, r->filtered = filtered - read, r->uploaded = gl_seconds() - filtered;
    return result;
}

#endif /* REFILTER_H */
