/* measure.h - what the programs that measure share: clocks, the copy that times are told in, memory
   counted, plain sums to hold truths against, and Markdown that goes between a document's marks.

   What you will see: nothing by itself. Include it instead of envmap.h, which it includes with
   ENVMAP_IMPLEMENTATION and a memory that counts. One *copy* is a memcpy of level 0 of the source
   and of the result's levels, buffers touched before, the best of seven.

   >>memory     a meter as the context of ENVMAP_MALLOC
   >>clock      the process's time, the wall's, a copy's
   >>vectors    of three doubles
   >>maps       create or exit, bytes, where a texel is, a constant
   >>sums       the definition as it stands in the literature
   >>document   sections between marks; the machine

   SPDX-License-Identifier: MIT */

#ifndef MEASURE_H
#define MEASURE_H

#include <math.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

/* ---------------------------------------------------------------------------------- >>memory --
   The context of ENVMAP_MALLOC is a meter, or NULL. A block's size stands before it. */

typedef struct measure_meter {
    size_t now, most;
    void (*note)(size_t bytes); /* NULL, or told the size of every block that is asked for */
} measure_meter;

#define MEASURE_HEAD 64 /* keeps malloc's alignment */

static inline void *measure_malloc(void *context, size_t bytes) {
    measure_meter *m = (measure_meter *)context;
    char *block = bytes > SIZE_MAX - MEASURE_HEAD ? NULL : (char *)malloc(bytes + MEASURE_HEAD);
    if (!block) return NULL;
    memcpy(block, &bytes, sizeof bytes);
    if (m) m->now += bytes;
    if (m && m->now > m->most) m->most = m->now;
    if (m && m->note) m->note(bytes);
    return block + MEASURE_HEAD;
}

static inline void measure_free(void *context, void *pointer) {
    measure_meter *m = (measure_meter *)context;
    size_t bytes;
    if (!pointer) return;
    memcpy(&bytes, (char *)pointer - MEASURE_HEAD, sizeof bytes);
    if (m) m->now -= bytes;
    free((char *)pointer - MEASURE_HEAD);
}

#define ENVMAP_MALLOC(context, bytes) measure_malloc(context, bytes)
#define ENVMAP_FREE(context, pointer) measure_free(context, pointer)
#define ENVMAP_IMPLEMENTATION
#include "envmap.h"

#define MEASURE_PI   3.14159265358979323846
#define COUNT(array) ((int)(sizeof(array) / sizeof *(array)))

/* ----------------------------------------------------------------------------------- >>clock -- */

static inline double measure_clock(clockid_t id) {
    struct timespec t;
    clock_gettime(id, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* Seconds of this process, all threads: what others do on the machine hardly shows. */
static inline double measure_seconds(void) { return measure_clock(CLOCK_PROCESS_CPUTIME_ID); }

/* Seconds on the wall: for threads. */
static inline double measure_now(void) { return measure_clock(CLOCK_MONOTONIC); }

/* --------------------------------------------------------------------------------- >>vectors -- */

static inline double measure_dot(const double a[3], const double b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* out = in / |in|; they may be the same. */
static inline void measure_unit(double out[3], const double in[3]) {
    double length = sqrt(measure_dot(in, in));
    int c;
    for (c = 0; c < 3; ++c) out[c] = in[c] / length;
}

static inline void measure_unit_float(double out[3], const float in[3]) {
    double wide[3] = {(double)in[0], (double)in[1], (double)in[2]};
    measure_unit(out, wide);
}

/* The angle between unit vectors, exact also where acos is not. */
static inline double measure_angle(const double a[3], const double b[3]) {
    double minus[3] = {a[0] - b[0], a[1] - b[1], a[2] - b[2]};
    double plus[3] = {a[0] + b[0], a[1] + b[1], a[2] + b[2]};
    return 2 * atan2(sqrt(measure_dot(minus, minus)), sqrt(measure_dot(plus, plus)));
}

/* ------------------------------------------------------------------------------------ >>maps -- */

static inline void measure_must(envmap_result result, const char *what) {
    if (!result) return;
    fprintf(stderr, "%s: %s\n", what, envmap_result_text(result));
    exit(2);
}

static inline envmap measure_map(int mapping, int size, int levels, int slices) {
    envmap map;
    memset(&map, 0, sizeof map);
    measure_must(envmap_create(&map, mapping, size, levels, slices), "a map");
    return map;
}

static inline int measure_height(const envmap *map, int level) {
    return map->size >> level > 1 ? map->size >> level : 1;
}

static inline int measure_width(const envmap *map, int level) {
    return measure_height(map, level) * (map->mapping == ENVMAP_LATLONG ? 2 : 1);
}

/* The unit direction of the centre of texel (x,y). */
static inline void measure_direction(double d[3], const envmap *map, int level, int face, int x,
                                     int y) {
    float dir[3];
    envmap_direction(dir, map->mapping, face, ((float)x + 0.5f) / (float)measure_width(map, level),
                     ((float)y + 0.5f) / (float)measure_height(map, level));
    measure_unit_float(d, dir);
}

/* The parameter of slice k of n: at its centre. */
static inline double measure_slice(const envmap_lobe *lobe, int k, int n) {
    return (double)lobe->p0 + (double)(lobe->p1 - lobe->p0) * (k + 0.5) / n;
}

/* Bytes of the first `levels` levels, all slices. */
static inline size_t measure_bytes(const envmap *map, int levels) {
    size_t texels = 0;
    int l;
    for (l = 0; l < levels; ++l)
        texels += (size_t)measure_width(map, l) * (size_t)measure_height(map, l);
    return 3 * sizeof(float) * texels * (size_t)(envmap_faces(map->mapping) * map->slices);
}

/* memcpy where no compiler can see it. */
static void *(*volatile measure_memcpy)(void *, const void *, size_t) = memcpy;

/* Seconds of one copy by a clock of the above: level 0 of src, `levels` of dst. */
static inline double measure_copy(const envmap *src, const envmap *dst, int levels,
                                  double (*clock_of)(void)) {
    size_t from = measure_bytes(src, 1), to = measure_bytes(dst, levels);
    char *memory = (char *)malloc(from + to);
    double best = 1e30;
    int i;
    if (!memory) measure_must(ENVMAP_ERROR_MEMORY, "a copy");
    memset(memory, 1, from + to);
    for (i = 0; i < 7; ++i) {
        double t = clock_of();
        measure_memcpy(memory, src->texels, from);
        measure_memcpy(memory + from, dst->texels, to);
        t = clock_of() - t;
        if (t < best) best = t;
    }
    free(memory);
    return best;
}

static inline void measure_flat(envmap *map, float value) {
    size_t i, n = measure_bytes(map, 1) / sizeof(float);
    for (i = 0; i < n; ++i) map->texels[i] = value;
}

/* 1 when every sample of level 0 is within `most` of value. */
static inline int measure_is_flat(const envmap *map, float value, float most) {
    size_t i, n = measure_bytes(map, 1) / sizeof(float);
    for (i = 0; i < n; ++i)
        if (!(fabsf(map->texels[i] - value) <= most)) return 0;
    return 1;
}

/* ------------------------------------------------------------------------------------ >>sums -- */

/* Where a map's texels are: x, y, z, solid angle, in order of memory. */
typedef struct measure_texels {
    const envmap *map;
    double *at;
    size_t count;
} measure_texels;

static inline void measure_list(measure_texels *list, const envmap *map) {
    int face, x, y, width = measure_width(map, 0), height = measure_height(map, 0);
    double *d;
    list->map = map;
    list->count = measure_bytes(map, 1) / (3 * sizeof(float) * (size_t)map->slices);
    d = list->at = (double *)malloc(4 * list->count * sizeof(double));
    if (!d) measure_must(ENVMAP_ERROR_MEMORY, "a list of texels");
    for (face = 0; face < envmap_faces(map->mapping); ++face)
        for (y = 0; y < height; ++y)
            for (x = 0; x < width; ++x, d += 4) {
                measure_direction(d, map, 0, face, x, y);
                d[3] = envmap_solid_angle(map, 0, face, x, y);
            }
}

/* sum k w L / norm over the texels in double, as it stands in the literature.
   a      the axis, of unit length
   reach  texels at larger angles are passed over; 4: none, the sum asks nothing of the lobe but k */
static inline void measure_plain_sum(double rgb[3], const measure_texels *list,
                                     const envmap_lobe *lobe, double p, const double a[3],
                                     double reach) {
    double sum[3] = {0, 0, 0}, norm = 0, least = reach < MEASURE_PI ? cos(reach) : -2;
    const double *d = list->at;
    const float *texel = list->map->texels;
    size_t i;
    int c;
    for (i = 0; i < list->count; ++i, d += 4, texel += 3) {
        double x = measure_dot(a, d), k;
        if (x < least) continue;
        k = d[3] * envmap_lobe_value(lobe, x < 1 ? x : 1, p);
        for (c = 0; c < 3; ++c) sum[c] += k * (double)texel[c];
        norm += k;
    }
    if (lobe->kind == ENVMAP_LOBE_BANKS) norm = envmap_lobe_integral(lobe, 0);
    for (c = 0; c < 3; ++c) rgb[c] = sum[c] / norm;
}

/* A plain sum is the definition where lobes are wider than two texels, and centres are centres. */
static inline int measure_plain_enough(const measure_texels *list, const envmap_lobe *lobe,
                                       double p) {
    double texel = sqrt(4 * MEASURE_PI / (double)list->count);
    return (list->map->mapping == ENVMAP_CUBE || list->map->mapping == ENVMAP_LATLONG) &&
           envmap_lobe_sigma(lobe, p) >= 2 * texel;
}

/* 1 when six texels of a truth, one a face and slice as far as they go, are the plain sums over src
   to 0.1 %, or those are not the definition; says on stderr where they are not. */
static inline int measure_truth_holds(const envmap *truth, const envmap *src,
                                      const envmap_lobe *lobe, const char *name) {
    measure_texels list;
    int i, c, ok = 1, faces = envmap_faces(truth->mapping);
    measure_list(&list, src);
    for (i = 0; i < 6; ++i) {
        int face = i % faces, slice = i % truth->slices;
        int x = (7 * i + 1) % truth->size, y = (5 * i + 2) % truth->size;
        double p = measure_slice(lobe, slice, truth->slices);
        double d[3], sum[3], most = 0;
        const float *t = envmap_texel(truth, 0, slice, face, x, y);
        if (!measure_plain_enough(&list, lobe, p)) continue;
        measure_direction(d, truth, 0, face, x, y);
        measure_plain_sum(sum, &list, lobe, p, d, 4);
        for (c = 0; c < 3; ++c) most = fmax(most, sum[c]);
        for (c = 0; c < 3; ++c)
            if (!(fabs((double)t[c] - sum[c]) <= 1e-3 * most)) {
                fprintf(stderr, "\n%s: the truth is %g, a plain sum %g\n", name, (double)t[c],
                        sum[c]);
                ok = 0;
            }
    }
    free(list.at);
    return ok;
}

/* -------------------------------------------------------------------------------- >>document --
   A section is written to a FILE between begin and end, and put into the document in place of what
   stands between <!-- PROGRAM: NAME --> and <!-- end -->. */

typedef struct measure_section {
    const char *name;
    char *text;
    size_t bytes;
} measure_section;

typedef struct measure_document {
    measure_section sections[16];
    int count;
} measure_document;

static inline FILE *measure_begin(measure_document *document, const char *name) {
    measure_section *s = document->sections + document->count++;
    FILE *file;
    s->name = name;
    file = open_memstream(&s->text, &s->bytes);
    if (!file) measure_must(ENVMAP_ERROR_MEMORY, name);
    return file;
}

/* `print`: to stdout too. */
static inline void measure_end(measure_document *document, FILE *file, int print) {
    fclose(file);
    if (!print) return;
    printf("%s\n", document->sections[document->count - 1].text);
    fflush(stdout);
}

/* The whole of a file, to be freed; exits without one. */
static inline char *measure_read(const char *path) {
    enum { MOST = 1 << 20 };
    FILE *file = fopen(path, "rb");
    char *text = file ? (char *)calloc(MOST, 1) : NULL;
    if (!text || !fread(text, 1, MOST - 1, file)) measure_must(ENVMAP_ERROR_FILE, path);
    fclose(file);
    return text;
}

/* Puts every section between its marks. program: "make filters", say. */
static inline void measure_write(const measure_document *document, const char *path,
                                 const char *program) {
    char *text = measure_read(path), mark[64];
    const char *at = text, *found;
    FILE *file = fopen(path, "wb");
    int i;
    if (!file) measure_must(ENVMAP_ERROR_FILE, path);
    snprintf(mark, sizeof mark, "<!-- %s: ", program);
    while ((found = strstr(at, mark)) != NULL) {
        const char *name = found + strlen(mark), *start = strchr(found, '\n');
        const char *stop = strstr(found, "<!-- end -->");
        if (!start || !stop) break;
        fwrite(at, 1, (size_t)(start + 1 - at), file), at = start + 1;
        for (i = 0; i < document->count; ++i) {
            const measure_section *s = document->sections + i;
            size_t length = strlen(s->name);
            if (strncmp(name, s->name, length) || strncmp(name + length, " -->", 4)) continue;
            fwrite(s->text, 1, s->bytes, file), at = stop;
        }
    }
    fputs(at, file);
    if (fclose(file)) measure_must(ENVMAP_ERROR_FILE, path);
    free(text);
}

static inline void measure_document_free(measure_document *document) {
    int i;
    for (i = 0; i < document->count; ++i) free(document->sections[i].text);
    document->count = 0;
}

#ifdef __clang__
#define MEASURE_COMPILER "clang " __clang_version__
#elif defined(__GNUC__)
#define MEASURE_COMPILER "gcc " __VERSION__
#else
#define MEASURE_COMPILER "unknown compiler"
#endif

/* The processor's name, at most `room` characters of it. */
static inline void measure_processor(char *cpu, size_t room) {
    char line[256];
    FILE *f = fopen("/proc/cpuinfo", "r");
    snprintf(cpu, room, "unknown processor");
    while (f && fgets(line, sizeof line, f)) {
        const char *colon = strchr(line, ':');
        if (strncmp(line, "model name", 10) || !colon) continue;
        line[strcspn(line, "\n")] = 0;
        snprintf(cpu, room, "%s", colon + 2);
        break;
    }
    if (f) fclose(f);
}

#endif /* MEASURE_H */
