/* viewer.c - a look at every kind of map: an object in an environment, dressed by one prefiltered
   map at a time.

   What you will see: a teapot that reflects the terrace above the lake, and what the keys do:
     M  material: mirror, Phong, diffuse, coated, GGX, Banks, sharper at grazing angles (a 3D map)
     - and =  its number: N, index of refraction, roughness or s; maps are filtered anew at once
     F  what is under the coat: nothing, diffuse light added, diffuse light by 1 - F
     L  lookup: cube, dual paraboloid (texture matrices, alpha at the rim), the same in two passes,
        sphere map          O  object          E  environment          , .  turn it
     9 0  exposure          B  background sharp or not          H  hide the words
   Drag to orbit, wheel to come closer; drop a lat-long .pfm onto the window to stand in it.

   usage: viewer [--headless out.png] [--keys MM=L] [overcast | studio | sun | sky.pfm]

   SPDX-License-Identifier: MIT */

#define _POSIX_C_SOURCE 200809L
#define ENVMAP_STATIC
#define ENVMAP_IMPLEMENTATION
#include "envmap.h"
#include "stage.h"

enum { MIRROR, PHONG, DIFFUSE, COATED, GGX, BANKS, GRAZING, MATERIALS };

typedef struct viewer {
    gl_app app;
    stage st;
    surface s;
    gl_mesh meshes[GL_MESH_COUNT];
    GLuint program;
    int object, material, scene, hidden, stale;
    float number[MATERIALS], yaw, sharp;
    double filtering; /* seconds that the last map took */
} viewer;

#define CHAIN 7 /* levels of the GGX chain, roughness 0 .. 1 */

/* A lobe that narrows as the eye sinks to the surface; p is n.v. */
static double grazing(double x, double p, void *user) {
    double sharpness = (double)*(const float *)user;
    return exp(sharpness * (0.3 + 3 * (1 - p) * (1 - p)) * (x - 1));
}

/* ------------------------------------------------------------------------------------ >>maps -- */

static envmap_result filter_chain(viewer *v, envmap *map) {
    envmap_lobe lobes[CHAIN];
    int i;
    for (i = 0; i < CHAIN; i++) {
        float roughness = (float)i / (CHAIN - 1);
        lobes[i] = i ? envmap_lobe_ggx(roughness * roughness) : envmap_lobe_mirror();
    }
    return envmap_filter_chain(map, &v->st.environment, lobes, CHAIN, &v->st.desc);
}

static envmap_lobe lobe_of(viewer *v) {
    envmap_lobe lobe;
    switch (v->material) {
    case PHONG:
        return envmap_lobe_phong(v->number[PHONG]);
    case BANKS:
        return envmap_lobe_banks(v->number[BANKS]);
    case GRAZING:
        lobe = envmap_lobe_function(grazing, &v->number[GRAZING]);
        lobe.p0 = 0, lobe.p1 = 1;
        return lobe;
    default:
        return envmap_lobe_mirror();
    }
}

static envmap_result filter_map(viewer *v, envmap *map) {
    int sliced = v->material == BANKS || v->material == GRAZING, chain = v->material == GGX;
    int sharp = v->material == MIRROR || v->material == COATED, size = sharp ? 256 : 128;
    envmap_mapping mapping = sliced ? ENVMAP_PARABOLOID : surface_mapping[v->s.lookup];
    envmap_lobe lobe = lobe_of(v);
    envmap_result result;
    if (mapping == ENVMAP_SPHERE) size *= 2;
    if (sliced) size = 64;
    result = envmap_create(map, mapping, size, chain ? CHAIN : 1, sliced ? 32 : 1);
    if (result) return result;
    return chain ? filter_chain(v, map)
                 : envmap_filter(map, &v->st.environment, &lobe, &v->st.desc);
}

/* Filters what the material asks for, and puts it into textures. */
static void refresh(viewer *v) {
    envmap map;
    double start = gl_seconds();
    int i, good = 1;
    memset(&map, 0, sizeof map);
    if (v->material != DIFFUSE) good = stage_say(filter_map(v, &map));
    v->filtering = gl_seconds() - start;
    v->stale = 0;
    gl.DeleteTextures(1, &v->s.map);
    gl.DeleteTextures(2, v->s.slices);
    v->s.map = v->s.slices[0] = v->s.slices[1] = 0;
    if (good && map.slices > 1)
        for (i = 0; i < 2; i++) v->s.slices[i] = gl_volume(&map, i);
    else if (good && map.texels)
        v->s.map = gl_map(&map);
    envmap_free(&map);
}

/* -------------------------------------------------------------------------------- >>controls -- */

static void step(viewer *v, int up) {
    static const float indices[3] = {1.5f, 5, 200};
    float *x = &v->number[v->material];
    int i;
    switch (v->material) {
    case PHONG:
    case GRAZING:
        *x = fminf(fmaxf(*x * (up ? 1.25f : 0.8f), 1), 5000);
        break;
    case GGX:
        *x = fminf(fmaxf(*x + (up ? 0.05f : -0.05f), 0), 1);
        break;
    case BANKS:
        *x = 1 - fminf(fmaxf((1 - *x) * (up ? 0.8f : 1.25f), 0.005f), 1);
        break;
    case COATED:
        for (i = 0; i < 3 && indices[i] < *x; i++) {
        }
        *x = indices[up ? (i < 2 ? i + 1 : 2) : (i > 0 ? i - 1 : 0)];
        break;
    default:
        break;
    }
    v->stale = v->stale || v->material == PHONG || v->material == GRAZING || v->material == BANKS;
}

static void light(viewer *v, const char *path) {
    v->scene = path ? v->scene : (v->scene + 1) % SCENE_COUNT;
    if (!stage_say(stage_light(&v->st, v->scene, path))) {
        gl_errors--; /* somebody's file, not our fault */
        return;
    }
    v->app.exposure = path ? picture_exposure(&v->st.environment) : stage_exposure[v->scene];
    v->stale = 1;
}

static void press(viewer *v, int key) {
    switch (key) {
    case 'M':
        v->material = (v->material + 1) % MATERIALS, v->stale = 1;
        break;
    case 'L':
        v->s.lookup = (v->s.lookup + 1) % SURFACE_LOOKUPS, v->stale = 1;
        break;
    case 'F':
        v->s.diffuse = (v->s.diffuse + 1) % 3;
        break;
    case 'O':
        v->object = (v->object + 1) % GL_MESH_COUNT;
        break;
    case 'E':
        light(v, NULL);
        break;
    case '=':
    case '-':
        step(v, key == '=');
        break;
    case ',':
    case '.':
        v->yaw += key == '.' ? 0.1f : -0.1f;
        break;
    case '9':
    case '0':
        v->app.exposure *= key == '0' ? 1.15f : 1 / 1.15f;
        break;
    case 'B':
        v->sharp = v->sharp > 0 ? 0.0f : 2.0f;
        break;
    case 'H':
        v->hidden = !v->hidden;
        break;
    default:
        break;
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
                                                     "sharper at grazing angles, lambda %.0f"};
    static const char *const lookups[SURFACE_LOOKUPS] = {
        "cube", "dual paraboloid, one pass", "dual paraboloid, two passes", "sphere map"};
    static const char *const under[3] = {"", " over diffuse", " blended with diffuse"};
    char name[64], *to = v->app.caption;
    size_t room = sizeof v->app.caption;
    static double shown;
    if (v->app.frames % 20 == 1) shown = v->app.took; /* readable */
    snprintf(name, sizeof name, materials[v->material], (double)v->number[v->material]);
    if (v->hidden)
        *to = 0;
    else if (!v->app.window)
        snprintf(to, room, "%s%s", name, v->material == COATED ? under[v->s.diffuse] : "");
    else
        snprintf(to, room, "M  %s%s\nL  %s\nfiltered in %.1f ms\na frame in %.1f ms", name,
                 v->material == COATED ? under[v->s.diffuse] : "", lookups[v->s.lookup],
                 1e3 * v->filtering, 1e3 * shown);
}

static void draw(viewer *v) {
    surface s = v->s;
    float model[16], pose[16], tilt[16];
    int i, diffuse = v->material == DIFFUSE, coated = v->material == COATED;
    mesh_turn(model, 1, v->yaw);
    for (i = 0; i < 9; i++) v->st.turn[i] = model[4 * (i / 3) + i % 3];
    memcpy(s.turn, v->st.turn, sizeof s.turn);
    memcpy(s.sh, v->st.sh, sizeof s.sh);
    s.axis = v->material == BANKS     ? SURFACE_TANGENT
             : v->material == GRAZING ? SURFACE_VIEW
                                      : SURFACE_REFLECTION;
    s.index = coated ? v->number[COATED] : 0;
    s.level = v->material == GGX ? v->number[GGX] * (CHAIN - 1) : 0;
    s.diffuse = diffuse ? SURFACE_PLUS_DIFFUSE : coated ? v->s.diffuse : SURFACE_NO_DIFFUSE;
    if (diffuse) {
        s.tint[0] = s.tint[1] = s.tint[2] = 0;
        s.albedo[0] = s.albedo[1] = s.albedo[2] = 0.45f;
    }
    if (coated) s.albedo[0] = 0.35f, s.albedo[1] = 0.03f, s.albedo[2] = 0.02f;
    mesh_turn(tilt, 0, v->object == GL_TORUS ? 0.9f : 0);
    memcpy(pose, tilt, sizeof pose);
    surface_draw(v->program, &v->app, &s, &v->meshes[v->object], pose);
    stage_sky(&v->st, &v->app, v->sharp);
}

int main(int argc, char **argv) {
    static const float numbers[MATERIALS] = {0, 100, 0, 1.5f, 0.4f, 0.95f, 60};
    static viewer v;
    int i, good = 1;
    if (!gl_open(&v.app, "viewer", 1200, 720, argc, argv)) return 1;
    if (!stage_open(&v.st, &v.app, v.scene = SCENE_SUN, argc, argv)) return 1;
    v.s = surface_default();
    v.program = v.st.surface, v.s.diffuse = SURFACE_BLENDED, v.sharp = 2, v.stale = 1;
    memcpy(v.number, numbers, sizeof numbers);
    for (i = 0; i < GL_MESH_COUNT; i++) good = good && gl_mesh_make(&v.meshes[i], i);
    while (good && gl_frame(&v.app)) {
        press(&v, v.app.key);
        if (v.app.dropped[0]) light(&v, v.app.dropped);
        if (v.stale) refresh(&v);
        draw(&v);
        words(&v);
        gl_show(&v.app);
    }
    gl.DeleteTextures(1, &v.s.map);
    gl.DeleteTextures(2, v.s.slices);
    for (i = 0; i < GL_MESH_COUNT; i++) gl_mesh_free(&v.meshes[i]);
    stage_close(&v.st);
    return gl_close(&v.app);
}
