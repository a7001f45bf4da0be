/* bake_sun.h - the brightest compact lights of a map, taken out of it: what a renderer gives to a
   directional light, so that it casts shadows, instead of to the maps.

   A light is the texels within 5 degrees of the brightest one that are four times brighter than the
   ring from 5 to 7 degrees. They get the ring's mean radiance, and the light gets the rest, so the
   light and what is left carry the energy of the whole. Test: tests/test_bake.c.

   SPDX-License-Identifier: MIT */

#ifndef BAKE_SUN_H
#define BAKE_SUN_H

#define BAKE_LIGHTS 4

typedef struct bake_light {
    double direction[3];
    double irradiance[3]; /* of a surface that faces it: radiance times solid angle */
    double diameter;      /* degrees, of an even disc of its light and its greatest radiance */
    double share;         /* of the whole map's energy */
} bake_light;

static inline double bake_luminance(const double rgb[3]) {
    return 0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2];
}

typedef struct bake_texel {
    float *rgb;
    float direction[3];
    double omega, luminance;
    int face, x, y;
} bake_texel;

/* Texels one by one: start with face = x = y = 0 and x = -1. Their solid angle is asked for once a
   row on lat-long maps. */
static inline int bake_next_texel(bake_texel *t, const envmap *map) {
    int width = map->mapping == ENVMAP_LATLONG ? 2 * map->size : map->size, c;
    double rgb[3];
    if (++t->x == width) t->x = 0, t->y++;
    if (t->y == map->size) t->y = 0, t->face++;
    if (t->face == envmap_faces(map->mapping)) return 0;
    t->rgb = envmap_texel(map, 0, 0, t->face, t->x, t->y);
    if (map->mapping != ENVMAP_LATLONG || t->x == 0)
        t->omega = envmap_solid_angle(map, 0, t->face, t->x, t->y);
    for (c = 0; c < 3; c++) rgb[c] = (double)t->rgb[c];
    t->luminance = bake_luminance(rgb);
    return 1;
}

static inline void bake_texel_direction(bake_texel *t, const envmap *map) {
    float width = (float)(map->mapping == ENVMAP_LATLONG ? 2 * map->size : map->size);
    envmap_direction(t->direction, map->mapping, t->face, ((float)t->x + 0.5f) / width,
                     ((float)t->y + 0.5f) / (float)map->size);
}

static const bake_texel bake_first_texel = {NULL, {0, 0, 0}, 0, 0, 0, -1, 0};

/* The brightest texel, and the energy of all, per luminance. */
static inline bake_texel bake_brightest(double *energy, const envmap *map) {
    bake_texel t = bake_first_texel, best = bake_first_texel;
    *energy = 0;
    while (bake_next_texel(&t, map)) {
        *energy += t.luminance * t.omega;
        if (t.omega > 0 && t.luminance > best.luminance) best = t;
    }
    bake_texel_direction(&best, map);
    return best;
}

static inline double bake_cosine(const bake_texel *a, const bake_texel *b) {
    return (double)a->direction[0] * (double)b->direction[0] +
           (double)a->direction[1] * (double)b->direction[1] +
           (double)a->direction[2] * (double)b->direction[2];
}

/* Mean radiance of the ring around a light. */
static inline void bake_ring(double ring[3], const envmap *map, const bake_texel *centre) {
    bake_texel t = bake_first_texel;
    double omega = 0;
    int c;
    ring[0] = ring[1] = ring[2] = 0;
    while (bake_next_texel(&t, map)) {
        double x;
        bake_texel_direction(&t, map);
        x = bake_cosine(&t, centre);
        if (x > 0.99619 || x < 0.99255 || t.luminance >= 0.1 * centre->luminance) continue;
        for (c = 0; c < 3; c++) ring[c] += (double)t.rgb[c] * t.omega;
        omega += t.omega;
    }
    for (c = 0; c < 3; c++) ring[c] = omega > 0 ? ring[c] / omega : 0;
}

/* Measures the light; with `take` also takes it out. */
static inline void bake_gather(bake_light *light, envmap *map, const bake_texel *centre,
                               const double ring[3], int take) {
    bake_texel t = bake_first_texel;
    double omega, length;
    int c;
    memset(light, 0, sizeof *light);
    while (bake_next_texel(&t, map)) {
        if (t.luminance < 4 * bake_luminance(ring)) continue;
        bake_texel_direction(&t, map);
        if (bake_cosine(&t, centre) < 0.99619) continue;
        for (c = 0; c < 3; c++) {
            float left = fminf(t.rgb[c], (float)ring[c]);
            light->irradiance[c] += ((double)t.rgb[c] - (double)left) * t.omega;
            light->direction[c] += (double)t.direction[c] * t.luminance * t.omega;
            if (take) t.rgb[c] = left;
        }
    }
    length =
        sqrt(light->direction[0] * light->direction[0] + light->direction[1] * light->direction[1] +
             light->direction[2] * light->direction[2]);
    for (c = 0; c < 3; c++) light->direction[c] /= length > 0 ? length : 1;
    omega = bake_luminance(light->irradiance) / centre->luminance;
    light->diameter = 360 / 3.14159265358979 * acos(fmax(-1, 1 - omega / 6.28318530717959));
}

/* Takes out lights, the brightest first, while each has at least 2 % of the energy that the map had
   at first, and is 20 times brighter than its mean. Returns how many. */
static inline int bake_take_lights(bake_light lights[BAKE_LIGHTS], envmap *map) {
    double all = 0, energy, ring[3];
    int count = 0;
    while (count < BAKE_LIGHTS) {
        bake_light *light = &lights[count];
        bake_texel centre = bake_brightest(&energy, map);
        if (!count) all = energy;
        if (!(centre.luminance > 20 * energy / 12.5663706143592)) break;
        bake_ring(ring, map, &centre);
        bake_gather(light, map, &centre, ring, 0);
        light->share = bake_luminance(light->irradiance) / all;
        if (light->share < 0.02) break;
        bake_gather(light, map, &centre, ring, 1);
        light->share = bake_luminance(light->irradiance) / all;
        count++;
    }
    return count;
}

#endif /* BAKE_SUN_H */
