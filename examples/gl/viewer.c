/* viewer.c - a look at every kind of map: an object in an environment, dressed by one prefiltered
   map at a time.

   What you will see: a teapot that reflects the terrace above the lake, and what the keys do:
     M  material: mirror, Phong, diffuse, coated, GGX, Banks, an elliptical lobe, and copper whose
        microfacets are fitted, a 3D map; and the levels of a file as they are
     - and =  its number: N, index of refraction, roughness, s, sigma, level; also with the right
        button, dragged; maps are filtered anew at once, from what is known of the environment
     F  what is under the coat: nothing, diffuse light added, diffuse light by 1 - F
     L  lookup: cube, dual paraboloid (texture matrices, alpha at the rim), the same in two passes,
        sphere map          O  object          E  environment          , .  turn it
     9 0  exposure          B  background sharp or not          H  hide the words
   Drag to orbit, wheel to come closer; drop a lat-long .pfm onto the window to stand in it, or a
   .ktx, .ktx2 or .dds, as `envmap bake` writes them.

   usage: viewer [--headless out.png] [--keys MM=L] [overcast | studio | sun | sky.pfm | cube.ktx2]

   SPDX-License-Identifier: MIT */

#include "stage.h"
#include "../tool/brdfs.h"

enum { MIRROR, PHONG, DIFFUSE, COATED, GGX, BANKS, ELLIPTICAL, FITTED, FILED, MATERIALS };

typedef struct viewer {
    gl_app app;
    stage st;
    surface s;
    gl_mesh meshes[GL_MESH_COUNT];
    envmap_prepared prepared; /* of the environment, so that a slider costs the result alone */
    int object, material, scene, hidden, sharp, stale;
    float number[MATERIALS], yaw;
    double filtering; /* seconds that the last map took */
} viewer;

#define CHAIN  7   /* levels of the GGX chain, roughness 0 .. 1 */
#define ACROSS 300 /* exponent of the map that the elliptical lobe looks up */

/* ------------------------------------------------------------------------------------ >>maps -- */

/* What the materials look up: a map of this shape, through this lobe. */
typedef struct recipe {
    int mapping;
    int size, levels, slices;
    envmap_lobe lobes[CHAIN];
} recipe;

static recipe recipe_of(const viewer *v) {
    static const int sizes[MATERIALS] = {256, 128, 1, 256, 128, 64, 128, 64, 1};
    int m = v->material, i;
    recipe r = {0};
    r.mapping = m == BANKS || m == FITTED ? ENVMAP_PARABOLOID : surface_mapping[v->s.lookup];
    r.size = r.mapping == ENVMAP_SPHERE ? 2 * sizes[m] : sizes[m];
    r.levels = m == GGX ? CHAIN : 1, r.slices = m == BANKS ? 48 : m == FITTED ? 16 : 1;
    r.lobes[0] = m == PHONG        ? envmap_lobe_phong(v->number[PHONG])
                 : m == ELLIPTICAL ? envmap_lobe_phong(fminf(ACROSS, stage_sharpest(&v->st)))
                 : m == BANKS      ? envmap_lobe_banks(v->number[BANKS])
                                   : envmap_lobe_mirror();
    for (i = 1; i < CHAIN; i++) {
        float roughness = (float)i / (CHAIN - 1);
        r.lobes[i] = envmap_lobe_ggx(roughness * roughness);
    }
    return r;
}

static envmap_result filter_map(viewer *v, envmap *map) {
    recipe r = recipe_of(v);
    envmap_filter_desc desc = v->st.desc;
    brdf_values copper = {{0.95, 0.64, 0.54}, 0, 0, 0, 0, 1};
    envmap_brdf brdf = {brdf_ggx, NULL};
    envmap_fit fit = {1, 16, 257, 0, NULL, NULL, NULL, NULL, NULL};
    envmap_result result = envmap_create(map, r.mapping, r.size, r.levels, r.slices);
    desc.prepared = &v->prepared;
    desc.tolerance = r.slices > 1 ? 0.01f : 0;
    if (!result && v->material == FITTED) {
        copper.alpha = (double)v->number[FITTED] * (double)v->number[FITTED], brdf.user = &copper;
        result = envmap_fit_brdf(&fit, &brdf, &desc.work);
        if (!result) r.lobes[0] = envmap_fit_lobe(&fit, 0), surface_fit(&v->s, &fit);
    }
    if (!result) result = envmap_filter_chain(map, &v->st.environment, r.lobes, r.levels, &desc);
    envmap_fit_free(&fit);
    return result;
}

/* A cube that the stage has already, or 0. */
static GLuint cube_at_hand(const viewer *v) {
    int mirror = v->s.lookup == SURFACE_CUBE && (v->material == MIRROR || v->material == COATED);
    return v->material == FILED ? v->st.file : mirror ? v->st.sky : 0;
}

/* Filters what the material asks for, and puts it into textures. */
static void refresh(viewer *v) {
    envmap map = {0};
    double start = gl_seconds();
    int i, good = 1;
    if (v->material != DIFFUSE && !cube_at_hand(v)) good = stage_say(filter_map(v, &map));
    v->filtering = gl_seconds() - start;
    v->app.began += v->filtering; /* a frame is counted without */
    v->stale = 0;
    gl.DeleteTextures(1, &v->s.map);
    gl.DeleteTextures(2, v->s.slices);
    v->s.map = v->s.slices[0] = v->s.slices[1] = 0;
    if (good && map.slices > 1)
        for (i = 0; i < 2; i++) v->s.slices[i] = gl_volume(&map, i);
    else if (good && map.texels) v->s.map = gl_map(&map);
    envmap_free(&map);
}

/* -------------------------------------------------------------------------------- >>controls -- */

/* by: keys 1 or -1, the slider parts of that. */
static void step(viewer *v, float by) {
    float *x = &v->number[v->material];
    switch (v->material) {
    case PHONG: *x = fminf(fmaxf(*x * powf(1.25f, by), 1), stage_sharpest(&v->st)); break;
    case COATED: *x = fminf(fmaxf(*x * powf(1.25f, by), 1.05f), 200); break;
    case GGX: *x = fminf(fmaxf(*x + 0.05f * by, 0), 1); break;
    case BANKS: *x = 1 - fminf(fmaxf((1 - *x) * powf(0.8f, by), 0.01f), 1); break;
    case ELLIPTICAL: *x = fminf(fmaxf(*x * powf(1.25f, by), 0.1f), 0.9f); break;
    case FITTED: *x = fminf(fmaxf(*x + 0.05f * by, 0.25f), 1); break;
    case FILED: *x = fminf(fmaxf(*x + 0.25f * by, 0), (float)(v->st.file_levels - 1)); break;
    default: break;
    }
    v->stale = v->stale || v->material == PHONG || v->material == BANKS || v->material == FITTED;
}

/* The indices of the Fresnel figure, one after the other; of other materials one step. */
static void press_step(viewer *v, int up) {
    static const float indices[3] = {1.5f, 5, 200};
    float *x = &v->number[COATED];
    int i = *x < 2 ? 0 : *x < 100 ? 1 : 2;
    if (v->material != COATED) step(v, up ? 1 : -1);
    else *x = indices[up ? (i < 2 ? i + 1 : 2) : (i > 0 ? i - 1 : 0)];
}

/* Whatever follows from another environment. A file's levels are shown first, and their texels are
   too coarse for a background in focus. */
static int enlighten(viewer *v) {
    envmap_lobe lobe = envmap_lobe_phong(stage_sharpest(&v->st));
    if (v->st.file) v->material = FILED, v->number[FILED] = 0, v->sharp = 0;
    else if (v->material == FILED) v->material = MIRROR;
    v->number[PHONG] = fminf(v->number[PHONG], stage_sharpest(&v->st));
    v->stale = 1;
    envmap_prepared_free(&v->prepared);
    return stage_say(envmap_prepare(&v->prepared, &v->st.environment, &lobe, 1, &v->st.desc));
}

static void light(viewer *v, const char *path) {
    v->scene = path ? v->scene : (v->scene + 1) % SCENE_COUNT;
    if (!stage_say(stage_light(&v->st, v->scene, path))) {
        gl_errors--; /* somebody's file, not our fault */
        return;
    }
    v->app.exposure = path ? picture_exposure(&v->st.environment) : stage_exposure[v->scene];
    enlighten(v);
}

static void press(viewer *v, int key) {
    switch (key) {
    case 'M':
        v->material = (v->material + 1) % (v->st.file ? MATERIALS : FILED), v->stale = 1;
        break;
    case 'L': v->s.lookup = (v->s.lookup + 1) % SURFACE_LOOKUPS, v->stale = 1; break;
    case 'F': v->s.diffuse = (v->s.diffuse + 1) % 3; break;
    case 'O': v->object = (v->object + 1) % GL_MESH_COUNT; break;
    case 'E': light(v, NULL); break;
    case '=':
    case '-': press_step(v, key == '='); break;
    case ',':
    case '.': v->yaw += key == '.' ? 0.1f : -0.1f; break;
    case '9':
    case '0': v->app.exposure *= key == '0' ? 1.15f : 1 / 1.15f; break;
    case 'B': v->sharp = !v->sharp; break;
    case 'H': v->hidden = !v->hidden; break;
    default: break;
    }
}

/* ----------------------------------------------------------------------------------- >>frame -- */

static void words(viewer *v) {
    static const char *const materials[MATERIALS] = {"mirror",
                                                     "Phong, N = %.0f",
                                                     "diffuse, nine coefficients",
                                                     "coated, index %.1f",
                                                     "GGX, roughness %.2f",
                                                     "Banks, s = %.3f",
                                                     "elliptical, sigma %.2f",
                                                     "copper, roughness %.2f, fitted",
                                                     "level %.2f of the file"};
    static const char *const lookups[SURFACE_LOOKUPS] = {
        "cube", "dual paraboloid, one pass", "dual paraboloid, two passes", "sphere map"};
    static const char *const under[3] = {"", " over diffuse", " blended with diffuse"};
    char name[64], *to = v->app.caption;
    size_t room = sizeof v->app.caption;
    static double shown, when;
    if (gl_seconds() > when + 0.5) shown = v->app.took, when = gl_seconds(); /* readable */
    snprintf(name, sizeof name, materials[v->material], (double)v->number[v->material]);
    if (v->hidden) *to = 0;
    else if (!v->app.window)
        snprintf(to, room, "%s%s", name, v->material == COATED ? under[v->s.diffuse] : "");
    else
        snprintf(to, room, "M  %s%s\nL  %s\nfiltered in %.1f ms\na frame in %.1f ms", name,
                 v->material == COATED ? under[v->s.diffuse] : "", lookups[v->s.lookup],
                 1e3 * v->filtering, 1e3 * shown);
}

static void draw(viewer *v) {
    static const int axes[MATERIALS] = {SURFACE_REFLECTION, SURFACE_REFLECTION, SURFACE_REFLECTION,
                                        SURFACE_REFLECTION, SURFACE_REFLECTION, SURFACE_TANGENT,
                                        SURFACE_FAN,        SURFACE_VIEW,       SURFACE_REFLECTION};
    surface s = v->s;
    float model[16], pose[16];
    int i, diffuse = v->material == DIFFUSE, coated = v->material == COATED;
    mesh_turn(model, 1, v->yaw);
    for (i = 0; i < 9; i++) v->st.turn[i] = model[4 * (i / 3) + i % 3];
    memcpy(s.turn, v->st.turn, sizeof s.turn);
    memcpy(s.sh, v->st.sh, sizeof s.sh);
    s.axis = axes[v->material];
    if (cube_at_hand(v)) s.map = cube_at_hand(v), s.lookup = SURFACE_CUBE;
    if (v->material == ELLIPTICAL)
        surface_fan(&s, (double)v->number[ELLIPTICAL],
                    1 / sqrt((double)fminf(ACROSS, stage_sharpest(&v->st))));
    s.index = coated ? v->number[COATED] : 0;
    s.level = v->material == GGX     ? v->number[GGX] * (CHAIN - 1)
              : v->material == FILED ? v->number[FILED]
                                     : 0;
    s.diffuse = diffuse ? SURFACE_PLUS_DIFFUSE : coated ? v->s.diffuse : SURFACE_NO_DIFFUSE;
    if (diffuse) {
        s.tint[0] = s.tint[1] = s.tint[2] = 0;
        s.albedo[0] = s.albedo[1] = s.albedo[2] = 0.45f;
    }
    if (coated) s.albedo[0] = 0.35f, s.albedo[1] = 0.03f, s.albedo[2] = 0.02f;
    mesh_turn(pose, 0, v->object == GL_TORUS ? 0.9f : 0);
    surface_draw(v->st.surface, &v->app, &s, &v->meshes[v->object], pose);
    stage_sky(&v->st, &v->app, v->sharp);
}

int main(int argc, char **argv) {
    static const float numbers[MATERIALS] = {0, 100, 0, 1.5f, 0.4f, 0.95f, 0.4f, 0.4f, 0};
    static viewer v;
    int i, good;
    if (!gl_open(&v.app, "viewer", 1200, 720, argc, argv)) return 1;
    if (!stage_open(&v.st, &v.app, v.scene = SCENE_SUN, argc, argv)) return 1;
    v.s = surface_default();
    v.s.diffuse = SURFACE_BLENDED, v.sharp = 1;
    memcpy(v.number, numbers, sizeof numbers);
    good = enlighten(&v);
    for (i = 0; i < GL_MESH_COUNT; i++) good = good && gl_mesh_make(&v.meshes[i], i);
    while (good && gl_frame(&v.app)) {
        press(&v, v.app.key);
        if (*v.app.keys) continue; /* a picture of the last of them is enough */
        if (v.app.slide < 0 || v.app.slide > 0) step(&v, 20 * v.app.slide);
        if (v.app.dropped[0]) light(&v, v.app.dropped);
        if (v.stale) refresh(&v);
        draw(&v);
        words(&v);
        gl_show(&v.app);
    }
    gl.DeleteTextures(1, &v.s.map);
    gl.DeleteTextures(2, v.s.slices);
    for (i = 0; i < GL_MESH_COUNT; i++) gl_mesh_free(&v.meshes[i]);
    envmap_prepared_free(&v.prepared);
    stage_close(&v.st);
    return gl_close(&v.app);
}
