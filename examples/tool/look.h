/* look.h - the commands that only look: info and compare. Include after load.h.

   SPDX-License-Identifier: MIT */

#ifndef LOOK_H
#define LOOK_H

#include <math.h>
#include <stdlib.h>

typedef struct statistics {
    double least, most, mean, share; /* luminance; share: energy of the brightest 0.1 % */
    long nans, infinities, negatives;
} statistics;

typedef struct lit_texel {
    double luminance, omega;
} lit_texel;

static inline int brighter_first(const void *a, const void *b) {
    double x = ((const lit_texel *)a)->luminance, y = ((const lit_texel *)b)->luminance;
    return x < y ? 1 : x > y ? -1 : 0;
}

/* Rec. 709 luminance, counting what no filter should meet; those samples count as 0. */
static inline double luminance(const float texel[3], statistics *s) {
    static const double weight[3] = {0.2126, 0.7152, 0.0722};
    double sum = 0;
    int c;
    for (c = 0; c < 3; c++) {
        if (isnan(texel[c])) s->nans++;
        else if (isinf(texel[c])) s->infinities++;
        else sum += weight[c] * (double)texel[c];
        if (texel[c] < 0) s->negatives++;
    }
    return sum;
}

/* The energy of the brightest texels that together fill 0.1 % of the sphere, over all energy. */
static inline double bright_share(lit_texel *texels, size_t count, double energy) {
    double room = 0.001 * 4 * 3.14159265358979, sum = 0;
    size_t i;
    qsort(texels, count, sizeof *texels, brighter_first);
    for (i = 0; i < count && room > 0; i++) {
        sum += texels[i].luminance * fmin(texels[i].omega, room);
        room -= texels[i].omega;
    }
    return energy > 0 ? sum / energy : 0;
}

/* Over the first slice; texels outside a rim do not count. 0 when out of memory. */
static inline int measure(statistics *s, const envmap *map) {
    int faces = envmap_faces(map->mapping), width = map_width(map), face, x, y;
    size_t room = (size_t)faces * (size_t)width * (size_t)map->size, count = 0;
    lit_texel *texels = (lit_texel *)malloc(room * sizeof *texels);
    double energy = 0;
    memset(s, 0, sizeof *s);
    s->least = HUGE_VAL;
    for (face = 0; face < faces && texels; face++)
        for (y = 0; y < map->size; y++)
            for (x = 0; x < width; x++) {
                double omega = envmap_solid_angle(map, 0, face, x, y);
                double value = luminance(envmap_texel(map, 0, 0, face, x, y), s);
                if (omega <= 0) continue;
                s->least = fmin(s->least, value), s->most = fmax(s->most, value);
                energy += value * omega;
                texels[count].luminance = value, texels[count++].omega = omega;
            }
    s->mean = energy / (4 * 3.14159265358979);
    if (texels) s->share = bright_share(texels, count, energy);
    free(texels);
    return texels != NULL;
}

/* What other programs may have done to a file, from its numbers. */
static inline void print_suspicions(const image *facts, const envmap *map) {
    size_t count = 3 * (size_t)map_width(map) * (size_t)map->size *
                   (size_t)envmap_faces(map->mapping) * (size_t)map->slices,
           i;
    float most = 0;
    for (i = 0; i < count; i++)
        if (map->texels[i] > most) most = map->texels[i];
    if (!(most < 1) && !(most > 1))
        printf("  remark      the largest sample is exactly 1: something may have clipped it, as\n"
               "              ImageMagick does without a word\n");
    if (fabs(fabs(facts->scale) - 1) > 0)
        printf(
            "  remark      its scale is %g: samples were multiplied by %g, as netpbm's pages say;"
            "\n              not all programs do that\n",
            facts->scale, fabs(facts->scale));
}

static inline int run_info(const options *o) {
    envmap map;
    image facts;
    statistics s;
    int status = load_as_it_is(&map, &facts, o->files[0], o);
    if (status) return status;
    if (!measure(&s, &map)) status = check(ENVMAP_ERROR_MEMORY, o->files[0]);
    if (!status) {
        printf("%s\n", o->files[0]);
        printf("  file        %s, %d x %d pixels\n", facts.format, facts.width, facts.height);
        printf("  shape       %s%s, %d x %d texels, faces %d, slices %d\n",
               mapping_words[map.mapping], o->mapping < 0 ? " (by its proportions)" : "",
               map_width(&map), map.size, envmap_faces(map.mapping), map.slices);
        printf("  luminance   min %.4g, mean %.4g, max %.4g\n", s.least, s.mean, s.most);
        printf("  max/mean    %.4g\n", s.mean > 0 ? s.most / s.mean : 0);
        printf("  brightest   0.1 %% of the sphere holds %.2g %% of the energy\n", 100 * s.share);
        printf("  samples     %ld NaN, %ld infinite, %ld negative\n", s.nans, s.infinities,
               s.negatives);
        print_suspicions(&facts, &map);
    }
    envmap_free(&map);
    return status;
}

static inline void print_difference(const envmap_difference *d, const envmap *map) {
    float dir[3];
    envmap_direction(dir, map->mapping, d->face, ((float)d->x + 0.5f) / (float)map_width(map),
                     ((float)d->y + 0.5f) / (float)map->size);
    printf("rms    %.6g (relative to the second map)\n", d->rms);
    printf("bias   %+.6g\n", d->bias);
    printf("worst  %.6g at slice %d, face %d, x %d, y %d: direction %.4f %.4f %.4f\n", d->worst,
           d->slice, d->face, d->x, d->y, (double)dir[0], (double)dir[1], (double)dir[2]);
}

static inline int run_compare(const options *o) {
    envmap a, b = no_map;
    envmap_difference difference;
    int status = load(&a, o->files[0], o);
    if (status) return status;
    status = load(&b, o->files[1], o);
    if (!status && (a.mapping != b.mapping || a.size != b.size || a.slices != b.slices))
        status = fail(RANGE_ERROR, o->files[1], "has another size or parameterization",
                      "bring both to one with `envmap convert --to --size`");
    if (!status) status = check(envmap_compare(&difference, &a, &b, 0), o->files[0]);
    if (!status) print_difference(&difference, &a);
    envmap_free(&a);
    envmap_free(&b);
    return status;
}

#endif /* LOOK_H */
