/* bake_job.h - one map on its way to an engine: what is computed, written, read back and measured.
   Include after sheen.h, bake_presets.h, bake_sun.h and bake_read.h.

   >>maps      specular chain, irradiance, harmonics, table
   >>files     written, read back, compared
   >>measures  levels against plain sums over the source

   SPDX-License-Identifier: MIT */

#ifndef BAKE_JOB_H
#define BAKE_JOB_H

#include <signal.h>

#define BAKE_LEVELS     16
#define BAKE_TABLE      64
#define BAKE_AXES       32 /* that a texel is added to at once, so that its direction is known once */
#define BAKE_IRRADIANCE 32 /* edge: diffuse light is smooth, this loses less than 1e-3 */

typedef struct bake_file {
    char name[64];
    const char *what, *container, *format;
    int size, levels, faces;
    long saturated;
    double error; /* relative rms of what the format lost, all levels */
    double lost;  /* share of the energy that is not in the file, negative: more is */
} bake_file;

typedef struct bake_level {
    envmap_lobe lobe;
    double roughness, alpha;
    double stored;          /* relative rms of what the file's format lost */
    double measured, worst; /* of the file against sums over the source; negative: not measured */
} bake_level;

typedef struct bake_job {
    const options *o;
    const bake_preset *preset;
    const char *input, *folder;
    envmap source, chain, irradiance, table; /* as written: in the engine's axes */
    envmap chain_back, irradiance_back;      /* as read from the files */
    bake_level levels[BAKE_LEVELS];
    int level_count, lobe, size, source_mapping, source_size;
    double sh[27], diffuse[27], zonal[3], axis[3]; /* in the engine's axes */
    double ringing; /* rms that windowing against negative light would move */
    bake_light lights[BAKE_LIGHTS];
    int light_count;
    envmap_cleaned cleaned;
    bake_file files[8];
    int file_count;
    meter m;
    float done, share; /* progress: of the stages before, and of this one */
    float verifying;   /* the part of the time that --verify takes: about 4 ns a texel and axis,
                          where the rest takes about 0.7 us a texel */
    double seconds[6], started;
    char path[WRITE_PATH];
    envmap_filter_desc desc;
} bake_job;

enum { BAKE_READING, BAKE_SUN, BAKE_FILTERING, BAKE_DIFFUSE, BAKE_WRITING, BAKE_MEASURING };

static volatile sig_atomic_t bake_stopped; /* by a signal: between tasks everything ends in order */

static inline void bake_stop(int signal_number) {
    (void)signal_number;
    bake_stopped = 1;
}

#define BAKE_BEFORE 0.9f /* where in the stages measuring begins */

static inline int bake_report(void *user, float fraction) {
    bake_job *j = (bake_job *)user;
    float raw = (j->done + j->share * fraction) / BAKE_BEFORE, before = 1 - j->verifying;
    if (raw > 1) raw = before + (raw - 1) * BAKE_BEFORE / (1 - BAKE_BEFORE) * j->verifying;
    else raw *= before;
    meter_report(&j->m, raw);
    return bake_stopped;
}

/* Ends a stage: its time, and where progress is. */
static inline void bake_stage(bake_job *j, int stage, float done, float next) {
    double now = seconds();
    j->seconds[stage] += now - j->started;
    j->started = now, j->done = done, j->share = next - done;
}

static inline const char *bake_path(bake_job *j, const char *name) {
    snprintf(j->path, sizeof j->path, "%s/%s", j->folder, name);
    return j->path;
}

/* ------------------------------------------------------------------------------------ >>maps -- */

/* Charlie is a ring about 2 alpha wide: one that is thinner than two texels of the source takes the
   filter minutes, and nothing in the source tells it from a wider one. */
static inline void bake_lobe(const bake_job *j, bake_level *l) {
    int kind = j->lobe;
    l->alpha = l->roughness * l->roughness;
    if (kind == LOBE_CHARLIE) {
        l->alpha = fmax(l->alpha, 1.5707963267948966 / natural_size(&j->source, ENVMAP_CUBE));
        l->lobe = sheen_lobe(&l->alpha);
    } else if (l->alpha <= 0) l->lobe = envmap_lobe_mirror();
    else if (kind == LOBE_PHONG)
        l->lobe = envmap_lobe_phong((float)fmax(1, 0.5 / (l->alpha * l->alpha) - 0.5));
    else l->lobe = envmap_lobe_ggx((float)l->alpha);
}

/* The edge: --size, or the power of two that is as fine as the source, up to 512; 256 where an
   engine's second level would else be thinner than sources have texels. The levels: --levels, or
   down to an edge of 4, which is enough for roughness 1. */
static inline void bake_choose(bake_job *j) {
    const options *o = j->o;
    int natural = natural_size(&j->source, ENVMAP_CUBE), l, all;
    int most = j->preset->scale > 0 ? 256 : 512;
    for (j->size = 1; 2 * j->size <= natural && j->size < most;) j->size *= 2;
    if (o->size > 0) j->size = o->size;
    all = envmap_levels(j->size);
    if (all > BAKE_LEVELS) all = BAKE_LEVELS;
    j->level_count = j->preset->scale > 0 || all < 4 ? all : all - 2;
    if (o->levels > 0) j->level_count = o->levels < all ? o->levels : all;
    for (l = 0; l < j->level_count; l++) {
        j->levels[l].roughness = bake_roughness(j->preset, j->size, l, j->level_count, o->bend);
        j->levels[l].measured = j->levels[l].worst = -1;
        bake_lobe(j, &j->levels[l]);
    }
}

static inline void bake_expect(bake_job *j) {
    double sums = ceil((double)j->o->verify / BAKE_AXES) * BAKE_AXES * j->level_count;
    if (j->preset->container != BAKE_NONE)
        j->verifying = (float)(4e-9 * sums / (4e-9 * sums + 0.7e-6));
}

static inline envmap_result bake_filter(bake_job *j) {
    envmap_lobe lobes[BAKE_LEVELS];
    envmap out = no_map;
    int l, k, mirrored = 0;
    envmap_result result = envmap_create(&j->chain, ENVMAP_CUBE, j->size, j->level_count, 1);
    for (l = 0; l < j->level_count; l++) lobes[l] = j->levels[l].lobe;
    if (!result)
        result = envmap_filter_chain(&j->chain, &j->source, lobes, j->level_count, &j->desc);
    for (k = 0; k < 3; k++) mirrored |= j->preset->axes[k] != k + 1;
    if (result || !mirrored) return result;
    result = envmap_create(&out, ENVMAP_CUBE, j->size, j->level_count, 1);
    if (result) return result;
    bake_turn(&out, &j->chain, j->preset);
    envmap_free(&j->chain);
    j->chain = out;
    return ENVMAP_OK;
}

/* Linear light and its zonal quadratic part: twelve numbers and three. The axis is the direction
   that most of the luminance comes from. Source: Roughton, Sloan et al., "ZH3: Quadratic Zonal
   Harmonics", 2024. */
static inline void bake_zonal(bake_job *j) {
    static const int order[3] = {3, 1, 2}; /* x, y, z among the coefficients of l = 1 */
    double Y[9], length = 0;
    int k, c;
    for (k = 0; k < 3; k++) {
        j->axis[k] = bake_luminance(&j->sh[3 * order[k]]);
        length += j->axis[k] * j->axis[k];
    }
    for (k = 0; k < 3; k++) j->axis[k] = length > 0 ? j->axis[k] / sqrt(length) : k == 1;
    envmap_sh_basis(Y, 3, j->axis);
    for (c = 0; c < 3; c++)
        for (j->zonal[c] = 0, k = 4; k < 9; k++)
            j->zonal[c] += 1.5853309190424043 * Y[k] * j->sh[3 * k + c]; /* sqrt(4 pi / 5) */
}

static inline envmap_result bake_harmonics(bake_job *j) {
    envmap_lobe cosine = envmap_lobe_diffuse();
    double ours[27], windowed[27], turn[9] = {0};
    int k;
    envmap_result result = envmap_sh_project(ours, 3, &j->source, 0, 1e-4, &j->desc.work);
    for (k = 0; k < 3; k++)
        turn[3 * (abs(j->preset->axes[k]) - 1) + k] = j->preset->axes[k] < 0 ? -1 : 1;
    if (!result) result = envmap_sh_rotate(j->sh, ours, 3, turn);
    if (!result) result = envmap_sh_convolve(j->diffuse, j->sh, 3, &cosine, 0);
    if (!result && envmap_sh_window(windowed, &j->ringing, j->sh, 3, &cosine, 0)) j->ringing = 0;
    bake_zonal(j);
    return result;
}

static inline envmap_result bake_diffuse(bake_job *j) {
    envmap_lobe cosine = envmap_lobe_diffuse();
    envmap out = no_map;
    envmap_result result = bake_harmonics(j);
    if (!result) result = envmap_create(&out, ENVMAP_CUBE, BAKE_IRRADIANCE, 1, 1);
    if (!result) result = envmap_create(&j->irradiance, ENVMAP_CUBE, BAKE_IRRADIANCE, 1, 1);
    if (!result) result = envmap_filter(&out, &j->source, &cosine, &j->desc);
    if (!result) bake_turn(&j->irradiance, &out, j->preset);
    envmap_free(&out);
    return result;
}

/* One row of the table's sheen. */
static inline void bake_sheen(void *context, int y) {
    envmap *table = (envmap *)context;
    double r = (y + 0.5) / BAKE_TABLE;
    int x;
    for (x = 0; x < BAKE_TABLE; x++)
        envmap_texel(table, 0, 0, 0, x, y)[2] =
            (float)sheen_albedo((x + 0.5) / BAKE_TABLE, r * r);
}

/* The split-sum table as a picture: x = n.v, y = roughness; R scale, G bias, B sheen. */
static inline envmap_result bake_table(bake_job *j) {
    float *values = (float *)malloc(2 * BAKE_TABLE * BAKE_TABLE * sizeof *values);
    int i;
    envmap_result result = ENVMAP_ERROR_MEMORY;
    if (values) result = envmap_ggx_table(values, BAKE_TABLE, &j->desc.work);
    if (!result) result = envmap_create(&j->table, ENVMAP_ANGULAR, BAKE_TABLE, 1, 1);
    for (i = 0; i < BAKE_TABLE * BAKE_TABLE && !result; i++) {
        j->table.texels[3 * i] = values[2 * i];
        j->table.texels[3 * i + 1] = values[2 * i + 1];
    }
    if (!result && j->o->sheen) threads_run(&workers, bake_sheen, &j->table, BAKE_TABLE);
    free(values);
    return result;
}

/* ----------------------------------------------------------------------------------- >>files -- */

static inline int bake_wrong_file(bake_job *j, int error) {
    return fail(FILE_ERROR, j->path, why_not_written(error), NULL);
}

static inline double bake_mean(const envmap *map) {
    bake_texel t = bake_first_texel;
    double sum = 0;
    while (bake_next_texel(&t, map)) sum += t.luminance * t.omega;
    return sum;
}

/* Reads the file at j->path into a new map of the shape of t's. */
static inline int bake_reread(bake_job *j, envmap *map, const texture *t, int container) {
    file_bytes bytes;
    int status = read_path(&bytes, j->path);
    if (!status)
        status =
            check(envmap_create(map, t->map->mapping, t->map->size, t->map->levels, 1), j->path);
    if (!status && !bake_unpack(map, t, container, bytes.data, bytes.count))
        status =
            fail(FILE_ERROR, j->path, "is not what was written: the disk may be failing", NULL);
    free(bytes.data);
    return status;
}

/* Writes a map, reads it back into *back, and notes what was lost on the way. */
static inline int bake_save(bake_job *j, envmap *back, const envmap *map, const char *name,
                            const char *what, int format, const char *notes, size_t notes_size) {
    static int (*const writers[])(texture *, const char *) = {write_ktx2, write_ktx1, write_dds};
    bake_file *f = &j->files[j->file_count++];
    int container = j->preset->container, error, status;
    double mean = bake_mean(map);
    texture t = {0};
    t.map = map, t.format = format, t.notes = notes, t.notes_size = notes_size;
    snprintf(f->name, sizeof f->name, "%s.%s", name, bake_container_end[container]);
    f->what = what, f->container = bake_container_name[container];
    f->format = texel_format_name[format];
    f->size = map->size, f->levels = map->levels, f->faces = texture_faces(&t);
    error = writers[container](&t, bake_path(j, f->name));
    if (error) return bake_wrong_file(j, error);
    f->saturated = t.saturated;
    status = bake_reread(j, back, &t, container);
    if (!status) f->lost = mean > 0 ? 1 - bake_mean(back) / mean : 0;
    return status;
}

/* Filament's key sh: irradiance / pi as polynomials of the normal, each coefficient times the
   constant of its basis function. */
static inline size_t bake_notes(char notes[1024], const bake_job *j) {
    static const double basis[9] = {0.28209479177387814, 0.4886025119029199, 0.4886025119029199,
                                    0.4886025119029199,  1.0925484305920792, 1.0925484305920792,
                                    0.31539156525252005, 1.0925484305920792, 0.5462742152960396};
    size_t used = 3;
    int k;
    memcpy(notes, "sh", 3);
    for (k = 0; k < 27; k++)
        used += (size_t)snprintf(notes + used, 1024 - used, "%.9g%s", basis[k / 3] * j->diffuse[k],
                                 k % 3 == 2 ? "\n" : " ");
    return used + 1;
}

static inline int bake_save_panorama(bake_job *j) {
    bake_file *f = &j->files[j->file_count++];
    double mean = bake_mean(&j->source);
    texture t = {0};
    envmap back = no_map, flat = no_map;
    int error, status = DONE;
    const envmap *map = &j->source;
    if (map->mapping != ENVMAP_LATLONG) {
        status = check(envmap_create(&flat, ENVMAP_LATLONG, 2 * map->size, 1, 1), j->folder);
        if (!status) status = check(envmap_resample(&flat, map, &j->desc.work), j->folder);
        map = &flat;
    }
    t.map = map;
    snprintf(f->name, sizeof f->name, "environment.hdr");
    f->what = "the picture, lat-long, without the lights that were taken out";
    f->container = "Radiance", f->format = "RGBE", f->size = map->size, f->levels = f->faces = 1;
    if (!status && (error = write_hdr(&t, 0, bake_path(j, f->name))) != 0)
        status = bake_wrong_file(j, error);
    f->saturated = t.saturated;
    if (!status) status = load(&back, j->path, &defaults);
    if (!status) f->lost = mean > 0 ? 1 - bake_mean(&back) / mean : 0;
    if (!status && j->preset->container == BAKE_NONE) envmap_free(&j->source), j->source = back;
    else envmap_free(&back);
    envmap_free(&flat);
    return status;
}

/* Per level, and over all of them, how far the file is from the maps. */
static inline void bake_compare(bake_job *j, bake_file *f, const envmap *back, const envmap *map,
                                int levels) {
    envmap_difference d;
    int l;
    for (l = 0; l < map->levels; l++) {
        if (envmap_compare(&d, back, map, l)) continue;
        f->error = fmax(f->error, d.rms);
        if (levels) j->levels[l].stored = d.rms;
    }
}

static inline int bake_save_maps(bake_job *j) {
    char notes[1024];
    int filament = j->preset->container == BAKE_KTX1, status;
    envmap table_back = no_map;
    size_t size = filament ? bake_notes(notes, j) : 0;
    status =
        bake_save(j, &j->chain_back, &j->chain, "specular", "specular light, a level a roughness",
                  j->preset->format, filament ? notes : NULL, size);
    if (!status) bake_compare(j, &j->files[j->file_count - 1], &j->chain_back, &j->chain, 1);
    if (!status)
        status = bake_save(j, &j->irradiance_back, &j->irradiance, "irradiance",
                           "irradiance / pi for each normal", j->preset->format, NULL, 0);
    if (!status)
        bake_compare(j, &j->files[j->file_count - 1], &j->irradiance_back, &j->irradiance, 0);
    if (!status)
        status = bake_save(j, &table_back, &j->table, "split-sum",
                           j->o->sheen ? "x: n.v, y: roughness, at texel centres; R scale, G bias, "
                                         "B sheen"
                                       : "x: n.v, y: roughness, at texel centres; R scale, G bias",
                           TEXEL_RGBA16F, NULL, 0);
    if (!status) bake_compare(j, &j->files[j->file_count - 1], &table_back, &j->table, 0);
    envmap_free(&table_back);
    return status;
}

/* -------------------------------------------------------------------------------- >>measures -- */

typedef struct bake_sums {
    const envmap *source;
    const envmap_lobe *lobe;
    double ggx; /* alpha^2, or 0 for other lobes */
    int count;
    double axis[3][BAKE_AXES], rgb[3][BAKE_AXES], norm[BAKE_AXES];
} bake_sums;

/* k(a.l) of every axis. */
static inline void bake_values(double k[BAKE_AXES], const bake_sums *s, const double l[3]) {
    int i;
    for (i = 0; i < BAKE_AXES; i++)
        k[i] = s->axis[0][i] * l[0] + s->axis[1][i] * l[1] + s->axis[2][i] * l[2];
    if (s->ggx > 0)
        for (i = 0; i < BAKE_AXES; i++) {
            double f = (s->ggx - 1) * 0.5 * (1 + k[i]) + 1;
            k[i] = (k[i] > 0 ? k[i] : 0) / (f * f);
        }
    else
        for (i = 0; i < s->count; i++) k[i] = envmap_lobe_value(s->lobe, k[i], 0);
}

/* The definition, in double: sum k(a.l) L w / sum k w over every texel. */
static inline void bake_add_up(void *context, int task) {
    bake_sums *s = (bake_sums *)context + task;
    bake_texel t = bake_first_texel;
    double k[BAKE_AXES] = {0}, l[3];
    int i, c;
    while (bake_next_texel(&t, s->source)) {
        bake_texel_direction(&t, s->source);
        for (c = 0; c < 3; c++) l[c] = (double)t.direction[c];
        bake_values(k, s, l);
        for (i = 0; i < BAKE_AXES; i++) s->norm[i] += k[i] *= t.omega;
        for (c = 0; c < 3; c++) {
            double radiance = (double)t.rgb[c];
            for (i = 0; i < BAKE_AXES; i++) s->rgb[c][i] += k[i] * radiance;
        }
    }
    for (c = 0; c < 3; c++)
        for (i = 0; i < s->count; i++) s->rgb[c][i] /= s->norm[i] > 0 ? s->norm[i] : 1;
}

/* Texel number i of count, spread evenly over a level of the file, and what it holds. */
static inline const float *bake_pick(double axis[3], const bake_job *j, int level, int i,
                                     int count) {
    int edge = j->size >> level > 1 ? j->size >> level : 1;
    long all = 6L * edge * edge, n = (long)((i + 0.5) / count * (double)all);
    int face = (int)(n / (edge * edge)), y = (int)(n / edge % edge), x = (int)(n % edge), k;
    float d[3], ours[3];
    x = (x + 7 * i) % edge;
    envmap_direction(d, ENVMAP_CUBE, face, ((float)x + 0.5f) / (float)edge,
                     ((float)y + 0.5f) / (float)edge);
    bake_to_ours(ours, j->preset, d);
    for (k = 0; k < 3; k++) axis[k] = (double)ours[k];
    return envmap_texel(&j->chain_back, level, 0, face, x, y);
}

/* Where a lobe is as narrow as two texels of the source the definition is another (envmap_filter):
   such levels, the mirror first of all, are not measured. */
static inline int bake_measurable(const bake_job *j, const bake_level *l) {
    double texel = sqrt(12.5663706143592 / (6.0 * natural_size(&j->source, ENVMAP_CUBE) *
                                            natural_size(&j->source, ENVMAP_CUBE)));
    return l->lobe.kind != ENVMAP_LOBE_MIRROR && envmap_lobe_sigma(&l->lobe, 0) > 2.2 * texel;
}

/* The axes of `count` texels of a level, in groups. */
static inline void bake_ask(bake_sums *sums, const bake_job *j, int level, int count) {
    const bake_level *l = &j->levels[level];
    int i, c;
    for (i = 0; i < count; i++) {
        bake_sums *s = &sums[i / BAKE_AXES];
        double axis[3];
        if (i % BAKE_AXES == 0) memset(s, 0, sizeof *s);
        s->source = &j->source, s->lobe = &l->lobe, s->count = i % BAKE_AXES + 1;
        s->ggx = l->lobe.kind == ENVMAP_LOBE_GGX ? l->alpha * l->alpha : 0;
        bake_pick(axis, j, level, i, count);
        for (c = 0; c < 3; c++) s->axis[c][i % BAKE_AXES] = axis[c];
    }
}

static inline void bake_measure_level(bake_job *j, int level, bake_sums *sums, int count) {
    bake_level *l = &j->levels[level];
    double error = 0, all = 0;
    int i, c;
    bake_ask(sums, j, level, count);
    threads_run(&workers, bake_add_up, sums, (count + BAKE_AXES - 1) / BAKE_AXES);
    l->worst = 0;
    for (i = 0; i < count; i++) {
        double axis[3], want[3], most = 0;
        const float *got = bake_pick(axis, j, level, i, count);
        for (c = 0; c < 3; c++) {
            want[c] = sums[i / BAKE_AXES].rgb[c][i % BAKE_AXES];
            most = fmax(most, want[c]);
        }
        for (c = 0; c < 3; c++) {
            double off = (double)got[c] - want[c];
            error += off * off, all += want[c] * want[c];
            if (most > 0) l->worst = fmax(l->worst, fabs(off) / most);
        }
    }
    l->measured = all > 0 ? sqrt(error / all) : 0;
}

/* --verify N: N texels of every level that can be measured. */
static inline int bake_measure(bake_job *j) {
    int level, count = j->o->verify;
    bake_sums *sums;
    if (count < 1) return DONE;
    sums = (bake_sums *)calloc((size_t)(count + BAKE_AXES - 1) / BAKE_AXES, sizeof *sums);
    if (!sums) return check(ENVMAP_ERROR_MEMORY, j->folder);
    for (level = 0; level < j->level_count && !bake_stopped; level++) {
        if (bake_measurable(j, &j->levels[level])) bake_measure_level(j, level, sums, count);
        bake_report(j, (float)(level + 1) / (float)j->level_count);
    }
    free(sums);
    return DONE;
}

#endif /* BAKE_JOB_H */
