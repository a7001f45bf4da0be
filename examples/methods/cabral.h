/* cabral.h - reflection space images: sphere maps that a BRDF has shaded for a sparse set of views,
   and the warp and blend that makes the map for a view between them. Any isotropic BRDF, with all
   of eq. 1 in it (n.l and the horizon too), which no lobe about r_v holds. Source: B. Cabral,
   M. Olano, P. Nemec. Reflection space image based rendering, SIGGRAPH 1999.

     stored   S_i(r) = eq. 1 at the normal n that reflects v_i to r, n = (r + v_i)/|r + v_i|
     new view L(v, r) = sum b_i S_i(r), b the barycentric coordinates of v in its triangle of views

   S_i is an OpenGL sphere map in the frame of v_i (centre = v_i), so that a point of the map is a
   normal, and the whole disc is what the view can see. Two maps are blended at the same *reflected*
   direction, not at the same normal: that is the warp, which keeps highlights where they are; what
   moves with the normal (shading by n.l, diffuse) is ghosted instead, the more the wider the
   triangle.

   Views stand at the corners of a subdivided octahedron: 4 m^2 + 2 of them, 6, 18, 38, 66 ...
   The original takes an icosahedron's 12 to 20 and hardware's warp of meshes; here it is per texel.
   Cost: (4 m^2 + 2) size^2 sums over the source (eq. 1), then three lookups a point.
   Fails: between few views, most at grazing reflection.  Tests: cabral_* in test_materials.c.

   SPDX-License-Identifier: MIT */

#ifndef METHOD_CABRAL_H
#define METHOD_CABRAL_H

#include "methods.h"

typedef struct cabral {
    envmap *maps; /* [views], one slice each */
    float (*views)[3], (*frames)[9];
    int steps, count; /* m, 4 m^2 + 2 */
} cabral;

/* The corner at integer coordinates (x,y,z), |x| + |y| + |z| = m, in a fixed order. */
static inline int cabral_index(int m, int x, int y, int z) {
    int ring, at = 0, k;
    for (k = -m; k < z; ++k) at += m - abs(k) ? 4 * (m - abs(k)) : 1;
    ring = m - abs(z);
    if (!ring) return at;
    return at + (y >= 0 ? ring - x : 3 * ring + x);
}

/* The three corners around v and their weights. */
static inline void cabral_triangle(int index[3], float weight[3], int m, const float v[3]) {
    float sum = fabsf(v[0]) + fabsf(v[1]) + fabsf(v[2]), p[3];
    int cell[3], k, up, used;
    for (k = 0; k < 3; ++k) {
        p[k] = (float)m * fabsf(v[k]) / sum;
        cell[k] = (int)(p[k] + 1e-5f);
        p[k] = fmaxf(p[k] - (float)cell[k], 0);
    }
    used = m - cell[0] - cell[1] - cell[2]; /* 0: a corner; 1: an upright triangle; 2: the other */
    up = used < 2;
    for (k = 0; k < 3; ++k) {
        int at[3], j;
        for (j = 0; j < 3; ++j) {
            at[j] = cell[j] + (up ? (used ? j == k : 0) : j != k);
            if (v[j] < 0) at[j] = -at[j];
        }
        index[k] = cabral_index(m, at[0], at[1], at[2]);
        weight[k] = up ? (used ? p[k] : (float)(k == 0)) : 1 - p[k];
    }
}

static inline void cabral_free(cabral *set) {
    int i;
    for (i = 0; set->maps && i < set->count; ++i) envmap_free(set->maps + i);
    if (set->maps) METHOD_FREE(set->maps);
    if (set->views) METHOD_FREE(set->views);
    if (set->frames) METHOD_FREE(set->frames);
    memset(set, 0, sizeof *set);
}

/* The direction of a map's texel in the frame of view i, turned into the world. */
static inline void cabral_turn(float out[3], const float frame[9], const float d[3]) {
    int k;
    for (k = 0; k < 3; ++k) out[k] = frame[k] * d[0] + frame[3 + k] * d[1] + frame[6 + k] * d[2];
}

/* The sphere map of the view frame[6 .. 8]; frames: room for its texels. */
static inline envmap_result cabral_shade(envmap *map, const float frame[9], const envmap *src,
                                         const envmap_brdf *brdf, envmap_frame *frames,
                                         const envmap_filter_desc *desc) {
    int x, y, k, size = map->size;
    for (y = 0; y < size; ++y)
        for (x = 0; x < size; ++x) {
            envmap_frame *f = frames + y * size + x;
            float d[3], r[3];
            envmap_direction(d, ENVMAP_SPHERE, 0, ((float)x + 0.5f) / (float)size,
                             ((float)y + 0.5f) / (float)size);
            if (d[2] < -0.9999f) d[0] += 0.02f; /* at the rim r = -v is no reflection */
            cabral_turn(r, frame, d);
            for (k = 0; k < 3; ++k) {
                f->v[k] = frame[6 + k];
                f->n[k] = r[k] + f->v[k];
                f->t[k] = 0;
            }
        }
    return envmap_radiance(map->texels, src, brdf, frames, size * size, desc ? &desc->work : NULL);
}

/* 4 steps^2 + 2 sphere maps of size x size, shaded from src. desc as for envmap_radiance.
   Overwrites *set without freeing. Errors: ARGUMENT (steps not 1 .. 16, size not 2 .. 1024), and
   envmap_radiance's. */
static inline envmap_result cabral_create(cabral *set, const envmap *src, const envmap_brdf *brdf,
                                          int steps, int size, const envmap_filter_desc *desc) {
    cabral made;
    envmap_frame *frames;
    envmap_result result = ENVMAP_OK;
    int x, y, z, i = 0;
    memset(&made, 0, sizeof made);
    if (!set || steps < 1 || steps > 16 || size < 2 || size > 1024) return ENVMAP_ERROR_ARGUMENT;
    made.steps = steps, made.count = 4 * steps * steps + 2;
    made.maps = (envmap *)method_alloc((size_t)made.count, sizeof *made.maps);
    made.views = (float(*)[3])method_alloc((size_t)made.count, sizeof *made.views);
    made.frames = (float(*)[9])method_alloc((size_t)made.count, sizeof *made.frames);
    frames = (envmap_frame *)method_alloc((size_t)size * (size_t)size, sizeof *frames);
    if (made.maps) memset(made.maps, 0, (size_t)made.count * sizeof *made.maps);
    if (!made.maps || !made.views || !made.frames || !frames) result = ENVMAP_ERROR_MEMORY;
    for (z = -steps; z <= steps && !result; ++z)
        for (y = -steps; y <= steps && !result; ++y)
            for (x = -steps; x <= steps && !result; ++x) {
                float length = sqrtf((float)(x * x + y * y + z * z));
                if (abs(x) + abs(y) + abs(z) != steps) continue;
                i = cabral_index(steps, x, y, z);
                made.views[i][0] = (float)x / length, made.views[i][1] = (float)y / length;
                made.views[i][2] = (float)z / length;
                method_frame(made.frames[i], made.frames[i] + 3, made.views[i]);
                memcpy(made.frames[i] + 6, made.views[i], 3 * sizeof(float));
                result = envmap_create(made.maps + i, ENVMAP_SPHERE, size, 1, 1);
                if (!result)
                    result = cabral_shade(made.maps + i, made.frames[i], src, brdf, frames, desc);
            }
    if (frames) METHOD_FREE(frames);
    if (result) cabral_free(&made);
    else *set = made;
    return result;
}

/* sum b_i S_i(r): the warp is that all three maps are looked up at the same reflected direction. */
static inline void cabral_blend(float rgb[3], const cabral *set, const int index[3],
                                const float weight[3], const float r[3]) {
    int k, c;
    rgb[0] = rgb[1] = rgb[2] = 0;
    for (k = 0; k < 3; ++k) {
        const float *f = set->frames[index[k]];
        float d[3], part[3];
        for (c = 0; c < 3; ++c) d[c] = f[3 * c] * r[0] + f[3 * c + 1] * r[1] + f[3 * c + 2] * r[2];
        envmap_lookup(part, set->maps + index[k], d, 0);
        for (c = 0; c < 3; ++c) rgb[c] += weight[k] * part[c];
    }
}

/* The two-dimensional map for a view, as the paper makes it: level 0 of the sphere map dst, in a
   frame whose centre is the view, from three stored maps. Errors: ARGUMENT.
   Test: the_map_for_a_view_holds_its_lookups. */
static inline envmap_result cabral_view(envmap *dst, const cabral *set, const int index[3],
                                        const float weight[3], const float frame[9]) {
    int x, y;
    if (!envmap_texel(dst, 0, 0, 0, 0, 0) || dst->mapping != ENVMAP_SPHERE || !set->maps)
        return ENVMAP_ERROR_ARGUMENT;
    for (y = 0; y < dst->size; ++y)
        for (x = 0; x < dst->size; ++x) {
            float d[3], r[3];
            envmap_direction(d, ENVMAP_SPHERE, 0, ((float)x + 0.5f) / (float)dst->size,
                             ((float)y + 0.5f) / (float)dst->size);
            cabral_turn(r, frame, d);
            cabral_blend(envmap_texel(dst, 0, 0, 0, x, y), set, index, weight, r);
        }
    return ENVMAP_OK;
}

/* What a surface with normal n shows towards v. Black where n.v <= 0. */
static inline void cabral_lookup(float rgb[3], const cabral *set, const float n[3],
                                 const float v[3]) {
    float weight[3], nn = 0, vv = 0, nv = 0, r[3];
    int index[3], k;
    rgb[0] = rgb[1] = rgb[2] = 0;
    for (k = 0; k < 3; ++k) nn += n[k] * n[k], vv += v[k] * v[k], nv += n[k] * v[k];
    if (!(nn > 0 && vv > 0 && nv > 0) || !set->maps) return;
    for (k = 0; k < 3; ++k) r[k] = 2 * nv / nn * n[k] - v[k];
    cabral_triangle(index, weight, set->steps, v);
    cabral_blend(rgb, set, index, weight, r);
}

#endif /* METHOD_CABRAL_H */
