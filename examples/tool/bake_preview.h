/* bake_preview.h - preview.png: balls over roughness and material, lit by what is in the files, in
   the line of a shader that any engine has:
       colour = (f0 scale + bias) specular(r, level(roughness)) + albedo irradiance(n)
   Include after bake_job.h and picture.h.

   SPDX-License-Identifier: MIT */

#ifndef BAKE_PREVIEW_H
#define BAKE_PREVIEW_H

enum { BAKE_BALLS = 6, BAKE_EDGE = 96, BAKE_GAP = 14 };

typedef struct bake_ball {
    const bake_job *j;
    double roughness, level;
    float f0[3], albedo[3];
} bake_ball;

static inline void bake_look(float rgb[3], const bake_job *j, const envmap *map,
                             const float ours[3], double level) {
    double d[3], engine[3];
    float e[3];
    int k;
    for (k = 0; k < 3; k++) d[k] = (double)ours[k];
    bake_to_engine(engine, j->preset, d);
    for (k = 0; k < 3; k++) e[k] = (float)engine[k];
    envmap_lookup(rgb, map, e, (float)level);
}

/* The level of a roughness, by the engine's formula; the inverse of bake_roughness. */
static inline double bake_level_of(const bake_job *j, double roughness) {
    const bake_preset *p = j->preset;
    double bend = j->o->bend >= 0 ? j->o->bend : p->bend;
    if (p->scale <= 0 || j->o->bend >= 0)
        return envmap_roughness_level(roughness, j->level_count, bend);
    return fmax(0, p->scale * log2(fmax(1, j->size * roughness * roughness)));
}

static inline int bake_ball_point(float rgb[3], float s, float t, const void *user) {
    const bake_ball *b = (const bake_ball *)user;
    float n[3], r[3], specular[3], diffuse[3], r2;
    const float *ab;
    int c;
    n[0] = 2 * s - 1, n[1] = 1 - 2 * t;
    r2 = n[0] * n[0] + n[1] * n[1];
    if (r2 > 1) return 0;
    n[2] = sqrtf(1 - r2);
    r[0] = 2 * n[2] * n[0], r[1] = 2 * n[2] * n[1], r[2] = 2 * n[2] * n[2] - 1;
    bake_look(specular, b->j, &b->j->chain_back, r, b->level);
    bake_look(diffuse, b->j, &b->j->irradiance_back, n, 0);
    ab = envmap_texel(&b->j->table, 0, 0, 0, (int)fminf(n[2] * BAKE_TABLE, BAKE_TABLE - 1),
                      (int)fmin(b->roughness * BAKE_TABLE, BAKE_TABLE - 1));
    for (c = 0; c < 3; c++)
        rgb[c] = (b->f0[c] * ab[0] + ab[1]) * specular[c] + b->albedo[c] * diffuse[c];
    return 1;
}

static inline void bake_draw_ball(picture *p, const bake_job *j, int column, int row,
                                  float exposure) {
    static const float f0[2][3] = {{0.91f, 0.92f, 0.92f}, {0.04f, 0.04f, 0.04f}};
    static const float albedo[2][3] = {{0, 0, 0}, {0.5f, 0.5f, 0.5f}};
    bake_ball b;
    char text[32];
    int x = BAKE_GAP + column * (BAKE_EDGE + BAKE_GAP), y = 42 + row * (BAKE_EDGE + 2 * BAKE_GAP);
    b.j = j, b.roughness = column / (BAKE_BALLS - 1.0);
    b.level = bake_level_of(j, b.roughness);
    memcpy(b.f0, f0[row], sizeof b.f0), memcpy(b.albedo, albedo[row], sizeof b.albedo);
    picture_draw(p, x, y, BAKE_EDGE, BAKE_EDGE, exposure, bake_ball_point, &b);
    snprintf(text, sizeof text, "%.1f", b.roughness);
    if (row)
        picture_caption(p, (float)x + BAKE_EDGE / 2.0f, (float)(y + BAKE_EDGE + 8), 10, 0xF3F1ECu,
                        text);
}

/* Where the engine filters for itself, a small chain of what it was given stands in for its own. */
static inline envmap_result bake_stand_in(bake_job *j) {
    int l;
    envmap_result result;
    envmap_free(&j->chain), envmap_free(&j->irradiance);
    j->size = 128, j->level_count = 6;
    for (l = 0; l < 6; l++) {
        j->levels[l].roughness = bake_roughness(j->preset, 128, l, 6, j->o->bend);
        bake_lobe(j, &j->levels[l]);
    }
    result = bake_filter(j);
    if (!result) result = bake_diffuse(j);
    j->chain_back = j->chain, j->irradiance_back = j->irradiance;
    j->chain = j->irradiance = no_map;
    return result;
}

/* 0, or an exit status. */
static inline int bake_preview(bake_job *j) {
    picture p;
    int k, error, width = BAKE_GAP + BAKE_BALLS * (BAKE_EDGE + BAKE_GAP);
    float exposure;
    if (!picture_create(&p, width, 42 + 2 * (BAKE_EDGE + 2 * BAKE_GAP) + 6))
        return check(ENVMAP_ERROR_MEMORY, j->folder);
    picture_rectangle(&p, 0, 0, p.width, p.height, 0x15171Cu, 1);
    picture_text(&p, BAKE_GAP, 16, 11, 0xF3F1ECu,
                 "metal above, white dielectric below; roughness:");
    exposure = picture_exposure(&j->chain_back) * exp2f((float)j->o->exposure);
    for (k = 0; k < 2 * BAKE_BALLS; k++)
        bake_draw_ball(&p, j, k % BAKE_BALLS, k / BAKE_BALLS, exposure);
    error = write_png(&p, bake_path(j, "preview.png"));
    picture_free(&p);
    return error ? bake_wrong_file(j, error) : DONE;
}

#endif /* BAKE_PREVIEW_H */
