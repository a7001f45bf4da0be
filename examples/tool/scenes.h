/* scenes.h - three environments made of formulas, so that nothing needs a photograph: a town square
   under an overcast sky (low contrast), a photographer's studio (lamps in a dark room), and a
   terrace above a lake in the sun (a peak more than 5e4 times the mean).

   What you will see: scene_fill(&map, SCENE_SUN) fills a map of any parameterization and size.
   Every texel is the mean of its radiance over its solid angle, so scenes carry the same energy at
   any size; the sun's disc, half a degree wide, is spread over texels by exact flux.
   Same numbers on every machine, up to the last digits of its libm. Include after envmap.h.

   >>noise     hashed lattice noise and sums of it
   >>overcast  a square of houses
   >>studio    softboxes, strips and a ring in a room
   >>sun       sky, clouds, mountains, lake, terrace
   >>fill      directions into texels

   SPDX-License-Identifier: MIT */

#ifndef SCENES_H
#define SCENES_H

#include <math.h>
#include <string.h>

enum { SCENE_OVERCAST, SCENE_STUDIO, SCENE_SUN, SCENE_COUNT };
static const char *const scene_name[SCENE_COUNT] = {"overcast", "studio", "sun"};

/* ----------------------------------------------------------------------------------- >>noise -- */

static inline void scene_set(float rgb[3], float r, float g, float b) {
    rgb[0] = r, rgb[1] = g, rgb[2] = b;
}

static inline void scene_scale(float rgb[3], float k) { rgb[0] *= k, rgb[1] *= k, rgb[2] *= k; }

/* rgb moves towards (r,g,b) by t in [0,1]. */
static inline void scene_mix(float rgb[3], float t, float r, float g, float b) {
    rgb[0] += (r - rgb[0]) * t, rgb[1] += (g - rgb[1]) * t, rgb[2] += (b - rgb[2]) * t;
}

static inline float scene_dot(const float a[3], const float b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* 0 below `from`, 1 above `to`, smooth between; from > to falls. */
static inline float scene_step(float from, float to, float x) {
    float t = (x - from) / (to - from);
    t = t < 0 ? 0 : t > 1 ? 1 : t;
    return t * t * (3 - 2 * t);
}

/* 1 inside |x| < half, with an edge `soft` wide. */
static inline float scene_inside(float x, float half, float soft) {
    return scene_step(half + soft, half - soft, fabsf(x));
}

/* A random number in [0,1) for a point of the lattice. */
static inline float scene_hash(int x, int y, int z) {
    unsigned h = (unsigned)x * 0x8DA6B343u ^ (unsigned)y * 0xD8163841u ^ (unsigned)z * 0xCB1AB31Fu;
    h = (h ^ h >> 15) * 0x2C1B3C6Du;
    h = (h ^ h >> 12) * 0x297A2D39u;
    return (float)((h ^ h >> 15) >> 8) / 16777216.0f;
}

static inline float scene_noise(float x, float y, float z) {
    float fx = floorf(x), fy = floorf(y), fz = floorf(z), t[3], sum = 0;
    int ix = (int)fx, iy = (int)fy, iz = (int)fz, k;
    t[0] = scene_step(0, 1, x - fx), t[1] = scene_step(0, 1, y - fy),
    t[2] = scene_step(0, 1, z - fz);
    for (k = 0; k < 8; k++) {
        float w = (k & 1 ? t[0] : 1 - t[0]) * (k & 2 ? t[1] : 1 - t[1]) * (k & 4 ? t[2] : 1 - t[2]);
        sum += w * scene_hash(ix + (k & 1), iy + (k >> 1 & 1), iz + (k >> 2));
    }
    return sum;
}

/* fBm: octaves of noise, each half as high and twice as fine; mean about 1/2. */
static inline float scene_fbm(float x, float y, float z, int octaves) {
    float sum = 0, height = 0.5f, total = 0;
    for (; octaves > 0; octaves--, height *= 0.5f) {
        sum += height * scene_noise(x, y, z), total += height;
        x = 2.03f * x + 17.1f, y = 2.03f * y + 5.7f, z = 2.03f * z + 31.3f;
    }
    return sum / total;
}

/* The same with a crease where noise crosses 1/2: mountains. */
static inline float scene_ridges(float x, float y, float z, int octaves) {
    float sum = 0, height = 0.5f, total = 0;
    for (; octaves > 0; octaves--, height *= 0.5f) {
        float crease = 1 - fabsf(2 * scene_noise(x, y, z) - 1);
        sum += height * crease * crease, total += height;
        x = 2.03f * x + 11.9f, y = 2.03f * y + 47.2f, z = 2.03f * z + 3.3f;
    }
    return sum / total;
}

/* -------------------------------------------------------------------------------- >>overcast -- */

/* The CIE's overcast sky, three times brighter at the zenith than at the horizon, under clouds
   that are a plane far above. */
static inline void scene_overcast_sky(float rgb[3], const float d[3]) {
    float x = d[0] / (d[1] + 0.25f), z = d[2] / (d[1] + 0.25f);
    float cloud = scene_fbm(1.3f * x + 0.6f * scene_noise(x, 3, z), 0.5f, 1.3f * z, 6);
    float light = (1 + 2 * d[1]) / 3 * (1.05f + 1.1f * (cloud - 0.5f));
    float warm = scene_step(0.25f, 0, d[1]);
    scene_set(rgb, 1.18f * light, 1.24f * light, (1.34f - 0.1f * warm) * light);
    scene_mix(rgb, 0.35f * warm, 0.60f, 0.61f, 0.62f);
}

/* A church tower behind the roofs, pale with distance. */
static inline void scene_tower(float rgb[3], float side, float slope) {
    float spire = 0.62f + (0.062f - fabsf(side)) * 4.2f;
    float body = scene_inside(side, 0.062f, 0.002f) * scene_step(0.625f, 0.62f, slope);
    float roof = scene_inside(side, 0.066f, 0.002f) * scene_step(0.003f, -0.003f, slope - spire) *
                 scene_step(0.615f, 0.62f, slope);
    float bell = scene_inside(side, 0.016f, 0.002f) * scene_inside(slope - 0.555f, 0.035f, 0.002f);
    scene_mix(rgb, body, 0.47f, 0.44f, 0.41f);
    scene_mix(rgb, bell, 0.20f, 0.20f, 0.21f);
    scene_mix(rgb, roof, 0.24f, 0.33f, 0.32f);
}

/* The windows and the shop of a house of `width`, s metres from its left, y above the ground. */
static inline void scene_windows(float rgb[3], float s, float y, float width, float seed) {
    float bays = floorf(width / 2.4f), bay = s / width * bays, floor_y = (y - 4.1f) / 3.1f;
    float u = (bay - floorf(bay) - 0.5f) * width / bays,
          v = (floor_y - floorf(floor_y)) * 3.1f - 1.5f;
    float pane = scene_hash((int)floorf(bay), (int)floorf(fmaxf(floor_y, -1)), (int)(seed * 977));
    float up = scene_step(4.0f, 4.15f, y);
    float frame = scene_inside(u, 0.68f, 0.03f) * scene_inside(v, 1.0f, 0.03f) * up;
    float glass = scene_inside(u, 0.53f, 0.02f) * scene_inside(v, 0.86f, 0.02f) * up;
    float bars = fmaxf(scene_inside(u, 0.035f, 0.015f), scene_inside(v - 0.25f, 0.035f, 0.015f));
    float shop = scene_inside(u, 0.98f, 0.03f) * scene_inside(y - 1.6f, 1.45f, 0.04f);
    scene_mix(rgb, frame, 0.62f, 0.61f, 0.58f);
    scene_mix(rgb, glass * (1 - bars), 0.07f + 0.22f * pane, 0.09f + 0.24f * pane,
              0.12f + 0.26f * pane);
    scene_mix(rgb, shop, 0.08f, 0.075f, 0.08f);
    if (pane > 0.86f)
        scene_mix(rgb, (glass + shop) * (1 - bars), 1.5f, 1.0f, 0.45f); /* lamps lit */
    scene_mix(rgb, 0.7f * scene_inside(y - 3.75f, 0.16f, 0.03f), 0.55f, 0.54f, 0.52f);
}

static inline void scene_plaster(float rgb[3], float seed) {
    static const float paint[6][3] = {{0.52f, 0.40f, 0.24f}, {0.46f, 0.24f, 0.17f},
                                      {0.53f, 0.49f, 0.42f}, {0.33f, 0.39f, 0.41f},
                                      {0.56f, 0.46f, 0.33f}, {0.44f, 0.33f, 0.29f}};
    memcpy(rgb, paint[(int)(seed * 5.999f)], 3 * sizeof *rgb);
}

/* A row of houses along a side of the square: s metres along it, y up. Leaves rgb where sky is. */
static inline void scene_house(float rgb[3], float s, float y, int side) {
    float lot = floorf(s / 10 + 0.5f), left = 10 * lot - 5, seed = scene_hash((int)lot, side, 5);
    float jog = 3 * (scene_hash((int)lot, side, 9) - 0.5f); /* some houses are wider */
    float width, eave, gable, shade, in;
    if (s - left < jog) lot -= 1, seed = scene_hash((int)lot, side, 5), left -= 10;
    left += fmaxf(0, 3 * (scene_hash((int)lot, side, 9) - 0.5f));
    width = 10 + fmaxf(0, 3 * (scene_hash((int)lot + 1, side, 9) - 0.5f)) - (left - (10 * lot - 5));
    in = s - left;
    eave = 10.3f + 3.1f * floorf(seed * 2.6f);
    gable = seed > 0.45f ? 3.6f * (1 - fabsf(2 * in / width - 1)) : 1.9f;
    if (y > eave + gable) return;
    shade = 0.55f + 0.45f * scene_step(-1, 9, y);
    if (y > eave) {
        scene_set(rgb, 0.30f, 0.20f, 0.17f);
        scene_mix(rgb, 0.4f * scene_noise(3 * s, 9 * y, 1), 0.42f, 0.27f, 0.21f);
    } else {
        scene_plaster(rgb, scene_hash((int)lot, side, 7));
        scene_scale(rgb, 0.86f + 0.28f * scene_fbm(0.5f * s, 0.4f * y, (float)side, 4));
        scene_windows(rgb, in, y, width, seed);
        scene_mix(rgb, 0.8f * scene_step(0.35f, 0.2f, eave - y), 0.60f, 0.58f, 0.55f);
    }
    scene_scale(rgb, shade * (1 - 0.4f * scene_step(0.10f, 0, fabsf(in))));
}

/* Wet paving: slabs in a grid with a border of dark ones, more of the sky where it is flat. */
static inline void scene_paving(float rgb[3], const float d[3]) {
    float t = 1.7f / -d[1], x = d[0] * t, z = d[2] * t, far_off = scene_step(4, 30, t);
    float slab = scene_hash((int)floorf(x / 1.2f), 0, (int)floorf(z / 1.2f));
    float ring = fmodf(fmaxf(fabsf(x), fabsf(z)) + 4, 6);
    float gx = fabsf(x / 1.2f - floorf(x / 1.2f + 0.5f)),
          gz = fabsf(z / 1.2f - floorf(z / 1.2f + 0.5f));
    float joint =
        (scene_inside(gx, 0.012f, 0.012f) + scene_inside(gz, 0.012f, 0.012f)) * (1 - far_off);
    float puddle = scene_step(0.52f, 0.66f, scene_fbm(0.28f * x, 0, 0.28f * z, 4)), wet, sky[3],
          up[3];
    scene_set(rgb, 0.47f, 0.44f, 0.40f);
    scene_scale(rgb, 0.78f + 0.4f * slab);
    if (ring < 1.2f) scene_mix(rgb, 0.75f, 0.25f, 0.19f, 0.17f);
    scene_mix(rgb, fminf(joint, 1) * 0.6f, 0.10f, 0.10f, 0.10f);
    up[0] = d[0], up[1] = -d[1], up[2] = d[2];
    scene_overcast_sky(sky, up);
    wet = 0.06f + 0.3f * puddle + 0.4f * far_off * (0.3f + 0.7f * puddle);
    scene_scale(rgb, 1 - 0.35f * puddle);
    scene_mix(rgb, wet, 0.8f * sky[0], 0.8f * sky[1], 0.8f * sky[2]);
    scene_scale(rgb, 1 - 0.3f * scene_step(20, 27, fmaxf(fabsf(x), fabsf(z))));
}

static inline void scene_overcast(float rgb[3], const float d[3]) {
    float across = fmaxf(fabsf(d[0]), fabsf(d[2])), level = hypotf(d[0], d[2]);
    float wall = 27 / fmaxf(across, 1e-4f), y = 1.7f + wall * d[1];
    int side = fabsf(d[0]) > fabsf(d[2]) ? (d[0] > 0 ? 0 : 1) : (d[2] > 0 ? 2 : 3);
    float s = wall * (side < 2 ? d[2] : d[0]), fog[3];
    if (y < 0) {
        scene_paving(rgb, d);
        return;
    }
    scene_overcast_sky(rgb, d);
    memcpy(fog, rgb, sizeof fog);
    scene_tower(rgb, atan2f(d[0], -d[2]) - 0.62f, d[1] / fmaxf(level, 1e-4f));
    scene_mix(rgb, 0.45f, fog[0], fog[1], fog[2]);
    scene_house(rgb, s + 200, y, side);
    if (d[1] < 0.8f) scene_mix(rgb, 0.06f, 0.6f, 0.63f, 0.66f);
}

/* ---------------------------------------------------------------------------------- >>studio -- */

/* A rectangular lamp that faces the middle of the room; half_x 0 makes a ring of radius half_y.
   The room: 8 x 3.6 x 10 metres, the eye at (0, 1.5, 0), lamps relative to the eye. */
typedef struct scene_lamp {
    float centre[3], half_x, half_y, rgb[3];
    int stand; /* a pole from the lamp to the floor */
} scene_lamp;

#define SCENE_LAMPS 7
static const scene_lamp scene_lamps[SCENE_LAMPS] = {
    {{-2.30f, 1.05f, 1.70f}, 0.62f, 0.88f, {34, 32, 29}, 1},      /* key: a large softbox        */
    {{2.90f, 0.35f, 1.10f}, 0.80f, 0.80f, {6.5f, 6.8f, 7.4f}, 1}, /* fill                      */
    {{0.15f, 2.00f, -0.90f}, 1.50f, 0.34f, {19, 19, 19}, 0},      /* a bank under the ceiling    */
    {{-2.35f, 0.10f, -2.50f}, 0.11f, 1.15f, {1.0f, 9, 17}, 1},    /* rim strips with gels        */
    {{2.55f, 0.10f, -2.30f}, 0.11f, 1.15f, {19, 6.5f, 0.6f}, 1},
    {{1.05f, 0.55f, 3.30f}, 0, 0.40f, {48, 46, 44}, 1},       /* a ring light                */
    {{-0.85f, 1.15f, -3.9f}, 0.30f, 0.30f, {24, 21, 17}, 1}}; /* a small hair light          */

static inline void scene_unit(float out[3], float x, float y, float z) {
    float k = 1 / fmaxf(sqrtf(x * x + y * y + z * z), 1e-12f);
    out[0] = x * k, out[1] = y * k, out[2] = z * k;
}

/* How the lamp looks from the middle along d: coordinates on its face in metres; 0 if behind. */
static inline int scene_lamp_at(float *x, float *y, const scene_lamp *lamp, const float from[3],
                                const float d[3]) {
    const float *c = lamp->centre;
    float n[3], right[3], up[3], to[3], k;
    int i;
    scene_unit(n, c[0], c[1], c[2]);
    if (fabsf(n[1]) > 0.75f) scene_unit(right, 1, 0, 0);
    else scene_unit(right, -n[2], 0, n[0]);
    scene_unit(up, right[1] * n[2] - right[2] * n[1], right[2] * n[0] - right[0] * n[2],
               right[0] * n[1] - right[1] * n[0]);
    for (i = 0; i < 3; i++) to[i] = c[i] - from[i];
    k = scene_dot(n, d);
    if (k < 1e-3f) return 0;
    k = scene_dot(n, to) / k;
    for (i = 0; i < 3; i++) to[i] = k * d[i] - to[i];
    *x = scene_dot(to, right), *y = scene_dot(to, up);
    return k > 0;
}

/* Lays a lamp's face over rgb: bright cloth, brightest in the middle, seams, a black rim. */
static inline void scene_lamp_face(float rgb[3], const scene_lamp *lamp, float x, float y) {
    float r = hypotf(x, y), ring = lamp->half_y, face, body, glow, seam;
    if (lamp->half_x > 0) {
        face = scene_inside(x, lamp->half_x, 0.012f) * scene_inside(y, lamp->half_y, 0.012f);
        body = scene_inside(x, lamp->half_x + 0.05f, 0.012f) *
               scene_inside(y, lamp->half_y + 0.05f, 0.012f);
        glow = 1 - 0.45f * (x * x + y * y) /
                       (lamp->half_x * lamp->half_x + lamp->half_y * lamp->half_y);
        seam = fminf(fabsf(x), fabsf(y)) * (lamp->half_x > 0.5f ? 1.0f : 1e3f);
        glow *= 1 - 0.12f * scene_step(0.02f, 0, seam);
    } else {
        face = scene_inside(r - 0.84f * ring, 0.16f * ring, 0.01f), glow = 1;
        body = scene_inside(r - 0.84f * ring, 0.22f * ring, 0.01f);
    }
    scene_mix(rgb, body, 0.008f, 0.008f, 0.009f);
    scene_mix(rgb, face, glow * lamp->rgb[0], glow * lamp->rgb[1], glow * lamp->rgb[2]);
}

/* Light that falls from all lamps on a point with a normal, each lamp taken as a point that
   radiates to its front, softened near it. */
static inline void scene_lamp_light(float rgb[3], const float at[3], const float n[3]) {
    int k, i;
    scene_set(rgb, 0.10f, 0.10f, 0.11f);
    for (k = 0; k < SCENE_LAMPS; k++) {
        const scene_lamp *lamp = &scene_lamps[k];
        float to[3], axis[3], d2, cosines, area = 4 * lamp->half_x * lamp->half_y;
        if (!(lamp->half_x > 0)) area = 1.7f * lamp->half_y * lamp->half_y;
        for (i = 0; i < 3; i++) to[i] = lamp->centre[i] - at[i];
        scene_unit(axis, lamp->centre[0], lamp->centre[1], lamp->centre[2]);
        d2 = scene_dot(to, to);
        cosines = fmaxf(0, scene_dot(to, n)) * fmaxf(0, scene_dot(to, axis)) / d2;
        for (i = 0; i < 3; i++) rgb[i] += lamp->rgb[i] * area * cosines / (d2 + 0.5f * area);
    }
}

/* Where a ray from the middle meets the room: the point, and the wall's normal. */
static inline void scene_room_hit(float at[3], float n[3], const float d[3]) {
    static const float high[3] = {4, 2.1f, 5}, low[3] = {-4, -1.5f, -5};
    float k = 1e9f;
    int i, wall = 0;
    for (i = 0; i < 3; i++) {
        float t = fabsf(d[i]) > 1e-6f ? (d[i] > 0 ? high[i] : low[i]) / d[i] : 1e9f;
        if (t < k) k = t, wall = i;
    }
    for (i = 0; i < 3; i++) at[i] = k * d[i], n[i] = 0;
    n[wall] = d[wall] > 0 ? -1.0f : 1.0f;
}

/* Reflectance of the room: boards, concrete, bricks, a white paper backdrop on the -z side. */
static inline void scene_room_albedo(float rgb[3], const float at[3], const float n[3]) {
    float paper = scene_inside(at[0], 1.75f, 0.01f) * scene_step(-2.3f, -2.5f, at[2]);
    if (n[1] > 0) { /* floor */
        float plank = floorf(at[0] / 0.22f), grain = scene_fbm(30 * at[0], plank, 2.5f * at[2], 4);
        float edge = fabsf(at[0] / 0.22f - floorf(at[0] / 0.22f) - 0.5f);
        scene_set(rgb, 0.27f, 0.18f, 0.12f);
        scene_scale(rgb, (0.6f + 0.5f * grain) * (0.8f + 0.4f * scene_hash((int)plank, 1, 1)));
        scene_scale(rgb, 1 - 0.6f * scene_step(0.46f, 0.5f, edge));
    } else if (n[1] < 0) { /* ceiling with beams */
        float beam = fabsf(at[2] / 1.6f - floorf(at[2] / 1.6f) - 0.5f);
        scene_set(rgb, 0.16f, 0.16f, 0.17f);
        scene_scale(rgb, 1 - 0.65f * scene_step(0.40f, 0.42f, beam));
        return;
    } else { /* brick */
        float s = n[0] > 0 || n[0] < 0 ? at[2] : at[0], row = floorf(at[1] / 0.11f);
        float u = s / 0.34f + 0.5f * (row - 2 * floorf(row / 2)), v = at[1] / 0.11f - row;
        float tone = scene_hash((int)floorf(u), (int)row, (int)(3 * n[0] + n[2]));
        float mortar = fmaxf(scene_step(0.44f, 0.48f, fabsf(u - floorf(u) - 0.5f)),
                             scene_step(0.38f, 0.44f, fabsf(v - 0.5f)));
        scene_set(rgb, 0.26f + 0.10f * tone, 0.17f + 0.06f * tone, 0.14f + 0.05f * tone);
        scene_mix(rgb, 0.6f * mortar, 0.32f, 0.30f, 0.28f);
    }
    scene_mix(rgb, paper, 0.72f, 0.72f, 0.72f);
}

/* Black poles below the lamps that stand on the floor. */
static inline void scene_stands(float rgb[3], const float d[3]) {
    int k;
    for (k = 0; k < SCENE_LAMPS; k++) {
        const float *c = scene_lamps[k].centre;
        float level = hypotf(d[0], d[2]), away = hypotf(c[0], c[2]);
        float off = (d[0] * c[2] - d[2] * c[0]) / fmaxf(level, 1e-4f);
        float ahead = d[0] * c[0] + d[2] * c[2], y = d[1] / fmaxf(level, 1e-4f) * away;
        if (!scene_lamps[k].stand || ahead <= 0 || y < -1.5f || y > c[1]) continue;
        scene_mix(rgb, scene_inside(off, 0.025f, 0.008f), 0.015f, 0.015f, 0.016f);
        scene_mix(rgb, scene_inside(off - 0.012f, 0.005f, 0.006f), 0.22f, 0.22f, 0.23f);
    }
}

static inline void scene_studio(float rgb[3], const float d[3]) {
    static const float eye[3] = {0, 0, 0};
    float at[3], n[3], light[3], x, y;
    int k, i;
    scene_room_hit(at, n, d);
    scene_room_albedo(rgb, at, n);
    scene_lamp_light(light, at, n);
    for (i = 0; i < 3; i++) rgb[i] *= light[i] * 0.31831f; /* 1/pi */
    if (n[1] > 0) {                                        /* the floor is varnished */
        float up[3], shine[3] = {0, 0, 0}, fresnel = 0.05f + 0.6f * powf(1 + d[1], 5);
        up[0] = d[0], up[1] = -d[1], up[2] = d[2];
        for (k = 0; k < SCENE_LAMPS; k++)
            if (scene_lamp_at(&x, &y, &scene_lamps[k], at, up))
                scene_lamp_face(shine, &scene_lamps[k], x, y);
        for (i = 0; i < 3; i++) rgb[i] += fresnel * shine[i];
    }
    scene_stands(rgb, d);
    for (k = 0; k < SCENE_LAMPS; k++)
        if (scene_lamp_at(&x, &y, &scene_lamps[k], eye, d))
            scene_lamp_face(rgb, &scene_lamps[k], x, y);
}

/* ------------------------------------------------------------------------------------- >>sun -- */

/* The sun stands at the middle of texel (75, 70) of a 512 x 256 lat-long map, 40 degrees up and
   behind the camera's left shoulder: there one texel holds all of it. Its |z| is more than
   sin 19.5 degrees, so it is in no paraboloid texel outside the circle either. */
static const float scene_sun_direction[3] = {-0.608740f, 0.648531f, 0.457037f};
static const float scene_sun_flux[3] = {20.5f, 18.3f, 15.2f}; /* radiance times solid angle */
#define SCENE_SUN_RADIUS 0.00465f

/* Blue that fades towards a bright horizon, and the haze around the sun. */
static inline void scene_clear_sky(float rgb[3], const float d[3]) {
    float high = d[1] > 0 ? d[1] : 0, near_horizon = expf(-5.5f * high),
          far_below = expf(-1.5f * high);
    float angle = acosf(fminf(1, scene_dot(d, scene_sun_direction)));
    float halo = 0.9f * expf(-angle / 0.22f) + 7 * expf(-angle / 0.022f);
    scene_set(rgb, 0.075f, 0.20f, 0.56f);
    scene_mix(rgb, 0.45f * far_below, 0.24f, 0.50f, 0.98f);
    scene_mix(rgb, 0.85f * near_horizon, 0.95f, 1.02f, 1.08f);
    scene_mix(rgb, 0.30f * expf(-16 * high) * (0.6f + 0.4f * d[2]), 1.45f, 1.20f, 0.92f);
    rgb[0] += halo, rgb[1] += 0.93f * halo, rgb[2] += 0.80f * halo;
}

/* Fair-weather clouds on a plane above: white where they are thinner towards the sun. */
static inline void scene_clouds(float rgb[3], const float d[3]) {
    float k = 1.25f / (d[1] + 0.10f), x = d[0] * k + 3.1f, z = d[2] * k + 1.4f;
    float warp = 0.7f * scene_noise(0.9f * x, 7, 0.9f * z);
    float here = scene_fbm(0.8f * x + warp, 0.2f, 0.8f * z - warp, 6), there, light, cover;
    if (d[1] < 0.01f || here < 0.49f) return;
    there = scene_fbm(0.8f * x + warp - 0.16f, 0.2f, 0.8f * z - warp + 0.12f, 4);
    light = 0.62f + 3.0f * (here - there) + 0.5f * scene_step(0.68f, 0.5f, here);
    light = 0.55f + 1.75f * (light < 0 ? 0 : light > 1.1f ? 1.1f : light);
    cover = scene_step(0.49f, 0.64f, here) * scene_step(0.01f, 0.16f, d[1]);
    scene_mix(rgb, 0.96f * cover, 1.06f * light, 1.03f * light, 1.04f * light);
}

/* One chain of mountains: how steep the ray must be (its slope) to pass above, from the azimuth. */
static inline float scene_crest(const float a[2], int chain) {
    static const float base[3] = {0.085f, 0.020f, -0.004f}, height[3] = {0.40f, 0.13f, 0.050f};
    static const float fine[3] = {1.7f, 3.2f, 5.0f};
    float f = fine[chain], rise = scene_ridges(f * a[0] + 9, 13.7f * (float)chain, f * a[1], 6);
    float valley = 0.45f + 0.55f * scene_step(-1.0f, 0.1f, fabsf(a[0]) - 0.5f * a[1] - 0.55f);
    return base[chain] + height[chain] * rise * rise * valley * 1.6f;
}

/* Rock, meadow and snow, lit from the side of the sun, bluer the farther away. */
static inline void scene_mountain(float rgb[3], const float a[2], float slope, float crest,
                                  int chain) {
    static const float haze[3] = {0.55f, 0.36f, 0.16f};
    float f = 6 + 9 * (float)chain, y = 1.3f * f * slope + 0.5f, e = 0.22f, here, there, lit, snow;
    here = scene_ridges(f * a[0], y, f * a[1], 4);
    there = scene_ridges(f * a[0] - 0.8f * e, y + 0.6f * e, f * a[1] + 0.6f * e, 4);
    lit = 0.5f + 0.42f * (-0.80f * -a[0] - 0.60f * a[1]) + 1.5f * (here - there);
    lit = lit < 0.10f ? 0.10f : lit > 1 ? 1 : lit;
    scene_set(rgb, 0.46f, 0.40f, 0.35f);
    if (chain == 1) scene_set(rgb, 0.25f, 0.29f, 0.14f);
    if (chain == 2) scene_set(rgb, 0.12f, 0.19f, 0.07f);
    snow = chain ? 0 : scene_step(0.17f, 0.24f, slope + 0.20f * (here - 0.4f));
    scene_mix(rgb, snow, 1.35f, 1.38f, 1.42f);
    scene_scale(rgb, 0.22f + 1.25f * lit);
    scene_mix(rgb, haze[chain] * (1 - 0.5f * scene_step(0, 0.35f, crest)), 0.36f, 0.55f, 0.92f);
}

/* Everything above the horizon (slope > 0): sky, clouds, three chains of mountains. */
static inline void scene_upper(float rgb[3], const float d[3]) {
    float level = fmaxf(hypotf(d[0], d[2]), 1e-4f), slope = d[1] / level, a[2];
    int chain;
    scene_clear_sky(rgb, d);
    scene_clouds(rgb, d);
    a[0] = d[0] / level, a[1] = d[2] / level;
    if (slope > 0.55f) return;
    for (chain = 0; chain < 3; chain++) {
        float crest = scene_crest(a, chain);
        if (slope < crest) scene_mountain(rgb, a, slope, crest, chain);
    }
}

/* Water: what stands above it, upside down and shaken, over its own blue green. */
static inline void scene_lake(float rgb[3], const float d[3], float x, float z) {
    float up[3], ripple = 0.10f * (scene_fbm(0.11f * x, 1, 0.35f * z, 4) - 0.5f);
    float tilt = -d[1] < 0.5f ? -d[1] : 0.5f, fresnel = 0.04f + 0.9f * powf(1 - tilt, 5);
    scene_unit(up, d[0] + ripple * 0.4f, fabsf(-d[1] + ripple * -d[1] * 2), d[2]);
    scene_upper(rgb, up);
    scene_mix(rgb, 1 - fresnel, 0.05f, 0.19f, 0.22f);
}

/* The country around the terrace, 40 metres below it: meadows, woods, a lake ahead. */
static inline void scene_country(float rgb[3], const float d[3]) {
    float t = 40 / fmaxf(-d[1], 1e-3f), x = d[0] * t, z = d[2] * t, away = hypotf(x, z), shore,
          wood, lit;
    float bank = scene_fbm(0.0040f * x + 3, 0, 0.0040f * z, 5) - 0.5f;
    shore = hypotf(0.42f * (x - 60), z + 420) / 330 + 1.1f * bank;
    if (shore < 1 && t < 3e4f) {
        scene_lake(rgb, d, x, z);
        scene_mix(rgb, 0.7f * scene_step(0.975f, 1, shore), 0.75f, 0.68f, 0.50f);
        return;
    }
    wood = scene_step(0.50f, 0.56f, scene_fbm(0.012f * x, 2, 0.012f * z, 4));
    lit = 0.75f + 0.7f * (scene_fbm(0.06f * x, 4, 0.06f * z, 4) - 0.5f);
    scene_set(rgb, 0.36f * lit, 0.43f * lit, 0.14f * lit);
    scene_mix(rgb, 0.9f * wood, 0.07f + 0.10f * (lit - 0.6f), 0.13f + 0.14f * (lit - 0.6f), 0.05f);
    scene_mix(rgb, 0.8f * scene_step(1.03f, 1.0f, shore), 0.75f, 0.68f, 0.50f);
    scene_mix(rgb, 0.55f * scene_step(200, 3000, away), 0.62f, 0.76f, 0.95f);
}

/* Sandstone slabs, two tones, in the full sun; the parapet's shadow lies on the sunny side. */
static inline void scene_terrace(float rgb[3], float x, float z) {
    float u = x / 1.1f + 0.5f, v = z / 1.1f + 0.5f, r = hypotf(x, z);
    float a = fabsf(u - floorf(u + 0.5f)), b = fabsf(v - floorf(v + 0.5f));
    float odd = fmodf(fabsf(floorf(u) + floorf(v)), 2), tone;
    float far_x = x + 0.80f * 1.0f,
          far_z = z - 0.60f * 1.0f; /* where its sunlight passed 0.85 m up */
    float shadow = scene_step(5.15f, 5.2f, hypotf(far_x, far_z));
    tone = 0.82f + 0.22f * scene_hash((int)floorf(u), 3, (int)floorf(v)) +
           0.3f * (scene_fbm(6 * x, 0, 6 * z, 4) - 0.5f);
    scene_set(rgb, 1.28f, 1.06f, 0.80f);
    if (odd > 0.5f) scene_set(rgb, 0.60f, 0.40f, 0.30f);
    if (r > 4.4f) scene_set(rgb, 1.18f, 1.00f, 0.78f); /* a border */
    scene_scale(rgb, tone);
    scene_mix(rgb, 0.6f * fmaxf(scene_step(0.02f, 0.008f, a), scene_step(0.02f, 0.008f, b)), 0.3f,
              0.25f, 0.2f);
    scene_mix(rgb, 0.7f * scene_inside(r - 4.4f, 0.03f, 0.02f), 0.25f, 0.2f, 0.16f);
    rgb[0] *= 1 - 0.80f * shadow, rgb[1] *= 1 - 0.74f * shadow, rgb[2] *= 1 - 0.62f * shadow;
}

/* The balustrade, on a circle of 5.2 metres: how much of it covers a point, y above the floor. */
static inline float scene_balustrade(float turn, float y) {
    float post = turn * 16 - floorf(turn * 16 + 0.5f), bar = turn * 128 - floorf(turn * 128 + 0.5f);
    float belly = 0.16f + 0.15f * scene_inside(y - 0.36f, 0.10f, 0.10f);
    float rail = scene_inside(y - 0.90f, 0.07f, 0.012f) + scene_inside(y - 0.06f, 0.08f, 0.012f);
    float cover = fmaxf(rail, scene_inside(post, 0.055f, 0.004f) * scene_step(1.05f, 1.03f, y));
    cover = fmaxf(cover, scene_inside(bar, belly, 0.03f) * scene_step(0.9f, 0.88f, y));
    return fminf(cover, 1) * scene_step(-0.02f, 0, y);
}

static inline void scene_sun(float rgb[3], const float d[3]) {
    float level = fmaxf(hypotf(d[0], d[2]), 1e-4f), y = 1.7f + 5.2f * d[1] / level, cover, lit;
    if (d[1] >= 0) {
        scene_upper(rgb, d);
        return;
    }
    if (y < 0) {
        scene_terrace(rgb, d[0] * 1.7f / -d[1], d[2] * 1.7f / -d[1]);
        return;
    }
    scene_country(rgb, d);
    if (y > 1.1f) return;
    cover = scene_balustrade(0.5f + atan2f(d[0], -d[2]) * 0.159154943f, y);
    lit = fmaxf(0, 0.80f * d[0] / level - 0.60f * d[2] / level); /* its inner side faces us */
    lit = 0.26f + 0.85f * lit + (y > 0.9f ? 0.25f : 0.0f);
    scene_mix(rgb, cover, 1.10f * lit, 1.00f * lit, 0.86f * lit);
}

/* ------------------------------------------------------------------------------------ >>fill -- */

/* Radiance from direction d (a unit vector), without the sun's disc. */
static inline void scene_radiance(float rgb[3], const float d[3], int scene) {
    if (scene == SCENE_OVERCAST) scene_overcast(rgb, d);
    else if (scene == SCENE_STUDIO) scene_studio(rgb, d);
    else scene_sun(rgb, d);
}

#define SCENE_SAMPLES 3 /* per side of a texel */

/* The mean over a texel. `fine` is the same map with SCENE_SAMPLES times the edge and no texels:
   it knows the solid angle of each sample. Outside a rim, where that is 0, samples count alike. */
static inline void scene_texel(float *texel, const envmap *fine, int face, int x, int y,
                               int scene) {
    double sum[3] = {0, 0, 0}, even[3] = {0, 0, 0}, weight = 0;
    int width = fine->mapping == ENVMAP_LATLONG ? 2 : 1, k, c;
    for (k = 0; k < SCENE_SAMPLES * SCENE_SAMPLES; k++) {
        int i = x * SCENE_SAMPLES + k % SCENE_SAMPLES, j = y * SCENE_SAMPLES + k / SCENE_SAMPLES;
        double w = envmap_solid_angle(fine, 0, face, i, j);
        float d[3], rgb[3];
        envmap_direction(d, fine->mapping, face, ((float)i + 0.5f) / (float)(width * fine->size),
                         ((float)j + 0.5f) / (float)fine->size);
        scene_radiance(rgb, d, scene);
        for (c = 0; c < 3; c++) sum[c] += w * (double)rgb[c], even[c] += (double)rgb[c];
        weight += w;
    }
    for (c = 0; c < 3; c++)
        texel[c] =
            (float)(weight > 0 ? sum[c] / weight : even[c] / (SCENE_SAMPLES * SCENE_SAMPLES));
}

/* Adds the sun: its flux in 128 x 128 equal parts, each to the texel that it falls into. */
static inline void scene_add_sun(envmap *map) {
    const float *s = scene_sun_direction;
    float right[3], up[3];
    int k, c, width = map->mapping == ENVMAP_LATLONG ? 2 * map->size : map->size;
    scene_unit(right, s[2], 0, -s[0]);
    up[0] = s[1] * right[2], up[1] = s[2] * right[0] - s[0] * right[2], up[2] = -s[1] * right[0];
    for (k = 0; k < 128 * 128; k++) { /* equal areas: r is the root, the angle a golden section */
        float r = SCENE_SUN_RADIUS * sqrtf(((float)k + 0.5f) / (128 * 128)), u, v, d[3], *texel;
        double turn = k * 0.6180339887498949, angle = 6.283185307179586 * (turn - floor(turn)), w;
        int face, x, y;
        for (c = 0; c < 3; c++)
            d[c] = s[c] + r * ((float)cos(angle) * right[c] + (float)sin(angle) * up[c]);
        envmap_coordinates(&face, &u, &v, map->mapping, d);
        x = (int)(u * (float)width), y = (int)(v * (float)map->size);
        x = x < width ? x : width - 1, y = y < map->size ? y : map->size - 1;
        w = 128 * 128 * envmap_solid_angle(map, 0, face, x, y);
        texel = envmap_texel(map, 0, 0, face, x, y);
        for (c = 0; c < 3 && w > 0; c++) texel[c] += (float)((double)scene_sun_flux[c] / w);
    }
}

/* Fills level 0 of a created map, every slice alike, with one of the scenes. */
static inline void scene_fill(envmap *map, int scene) {
    int face, x, y, slice, width = map->mapping == ENVMAP_LATLONG ? 2 * map->size : map->size;
    size_t floats = 3 * (size_t)width * (size_t)map->size * (size_t)envmap_faces(map->mapping);
    envmap fine = *map;
    fine.size *= SCENE_SAMPLES;
    for (face = 0; face < envmap_faces(map->mapping); face++)
        for (y = 0; y < map->size; y++)
            for (x = 0; x < width; x++)
                scene_texel(envmap_texel(map, 0, 0, face, x, y), &fine, face, x, y, scene);
    if (scene == SCENE_SUN) scene_add_sun(map);
    for (slice = 1; slice < map->slices; slice++)
        memcpy(map->texels + (size_t)slice * floats, map->texels, floats * sizeof *map->texels);
}

#endif /* SCENES_H */
