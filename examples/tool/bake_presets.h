/* bake_presets.h - what each engine takes, as one table of values: `bake --for NAME`. Where the
   values come from is in docs/bake.md, engine by engine.

   Include after write_texels.h.

   SPDX-License-Identifier: MIT */

#ifndef BAKE_PRESETS_H
#define BAKE_PRESETS_H

typedef enum bake_container { BAKE_KTX2, BAKE_KTX1, BAKE_DDS, BAKE_NONE } bake_container;

static const char *const bake_container_name[] = {"KTX 2", "KTX 1", "DDS (DX10)"};
static const char *const bake_container_end[] = {"ktx2", "ktx", "dds"};

typedef struct bake_preset {
    const char *name;
    int container; /* of the maps; NONE: the engine filters what it imports, so it gets a picture */
    int format;    /* texel_format of the specular and the irradiance map */
    int panorama;  /* 1: environment.hdr is written too */
    double bend;   /* level = (levels - 1) r (1 + bend - bend r) */
    double scale;  /* not 0: level = scale log2(size r^2) instead */
    int axes[3];   /* our x, y, z as the engine's axes: 1 x, 2 y, 3 z, negative: the other way */
    const char *space;
    const char *remark; /* what the engine does with the files */
} bake_preset;

static const bake_preset bake_presets[] = {
    {"opengl",
     BAKE_KTX2,
     TEXEL_RGBA16F,
     0,
     0,
     0,
     {1, 2, 3},
     "right-handed, +y up, the picture's middle is -z",
     "nothing is filtered again: upload the levels, look up with textureLod"},
    {"d3d",
     BAKE_DDS,
     TEXEL_RGBA16F,
     0,
     0,
     0,
     {1, 2, -3},
     "left-handed, +y up, the picture's middle is +z",
     "nothing is filtered again: upload the levels, look up with SampleLevel"},
    {"three",
     BAKE_KTX2,
     TEXEL_RGBA16F,
     1,
     0,
     0,
     {3, 2, -1},
     "right-handed, +y up, the picture's middle is +x",
     "three.js filters every environment of its own materials again (PMREMGenerator): give them "
     "environment.hdr. The KTX files are for a ShaderMaterial of yours, as docs/bake.md shows; "
     "LightProbe takes the nine radiance coefficients as they are"},
    {"babylon",
     BAKE_DDS,
     TEXEL_RGBA16F,
     0,
     0,
     0.8,
     {1, 2, -3},
     "left-handed, +y up, the picture's middle is +z",
     "CubeTexture.CreateFromPrefilteredData takes specular.dds as it is, with lodGenerationScale "
     "0.8, and makes its own harmonics of it"},
    {"godot",
     BAKE_NONE,
     TEXEL_RGBA16F,
     1,
     0,
     0,
     {-1, 2, -3},
     "right-handed, +y up, the picture's middle is +z",
     "Godot filters every sky again: give environment.hdr to a PanoramaSkyMaterial"},
    {"bevy",
     BAKE_KTX2,
     TEXEL_RGB9E5,
     0,
     0,
     0,
     {1, 2, -3},
     "right-handed, +y up; its shader looks cubes up with -z, so the cubes are mirrored; the "
     "picture's middle is -z",
     "EnvironmentMapLight takes irradiance.ktx2 as diffuse_map and specular.ktx2 as specular_map "
     "as "
     "they are"},
    {"filament",
     BAKE_KTX1,
     TEXEL_B10G11R11,
     0,
     1,
     0,
     {-1, 2, -3},
     "right-handed, +y up, the picture's middle is +z",
     "Ktx1Reader takes specular.ktx as it is, and its key sh as IndirectLight's irradiance"},
    {"gltf",
     BAKE_KTX2,
     TEXEL_RGBA16F,
     0,
     0,
     0,
     {1, 2, 3},
     "right-handed, +y up, the picture's middle is -z",
     "EXT_lights_image_based takes the nine irradiance coefficients times pi as "
     "irradianceCoefficients; its images must be PNG or JPEG, so a viewer that follows the "
     "extension "
     "strictly needs the levels in that form"},
    {"unity",
     BAKE_NONE,
     TEXEL_RGBA16F,
     1,
     0.7,
     0,
     {-3, 2, -1},
     "left-handed, +y up, the picture's middle is +x",
     "Unity filters every cubemap again when it imports one: give it environment.hdr, shape Cube, "
     "convolution Specular"},
    {"unreal",
     BAKE_NONE,
     TEXEL_RGBA16F,
     1,
     0,
     0,
     {1, 3, 2},
     "left-handed, +z up, the picture's middle is -y",
     "Unreal filters every cubemap again when a sky light captures it: import environment.hdr"}};
enum { BAKE_PRESETS = sizeof bake_presets / sizeof bake_presets[0] };

/* The same names for --for, in the same order: a test compares them. */
static const char *const bake_words[] = {"opengl",   "d3d",  "three", "babylon", "godot", "bevy",
                                         "filament", "gltf", "unity", "unreal",  NULL};

/* Our direction from the engine's. */
static inline void bake_to_ours(float ours[3], const bake_preset *p, const float engine[3]) {
    int k;
    for (k = 0; k < 3; k++) {
        float value = engine[abs(p->axes[k]) - 1];
        ours[k] = p->axes[k] < 0 ? -value : value;
    }
}

/* The engine's direction from ours: the axes the other way round. */
static inline void bake_to_engine(double engine[3], const bake_preset *p, const double ours[3]) {
    int k;
    for (k = 0; k < 3; k++) engine[abs(p->axes[k]) - 1] = p->axes[k] < 0 ? -ours[k] : ours[k];
}

/* The roughness of a level, by the engine's own formula; bend < 0: the preset's. */
static inline double bake_roughness(const bake_preset *p, int size, int level, int levels,
                                    double bend) {
    double alpha;
    if (p->scale <= 0 || bend >= 0)
        return envmap_level_roughness(level, levels, bend >= 0 ? bend : p->bend);
    alpha = level ? exp2(level / p->scale) / size : 0;
    return alpha < 1 ? sqrt(alpha) : 1;
}

/* out, a cube of in's size and levels, as the engine sees it. Texels lie on texels. */
static inline void bake_turn(envmap *out, const envmap *in, const bake_preset *p) {
    int level, face, x, y;
    for (level = 0; level < in->levels; level++) {
        int edge = in->size >> level > 1 ? in->size >> level : 1;
        for (face = 0; face < 6; face++)
            for (y = 0; y < edge; y++)
                for (x = 0; x < edge; x++) {
                    float d[3], e[3], u, v;
                    int from;
                    envmap_direction(d, ENVMAP_CUBE, face, ((float)x + 0.5f) / (float)edge,
                                     ((float)y + 0.5f) / (float)edge);
                    bake_to_ours(e, p, d);
                    envmap_coordinates(&from, &u, &v, ENVMAP_CUBE, e);
                    memcpy(envmap_texel(out, level, 0, face, x, y),
                           envmap_texel(in, level, 0, from, (int)(u * (float)edge),
                                        (int)(v * (float)edge)),
                           3 * sizeof(float));
                }
    }
}

#endif /* BAKE_PRESETS_H */
