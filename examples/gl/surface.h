/* surface.h - one shader for what a prefiltered map can dress: a gloss through any of the lookups,
   a diffuse coat through nine coefficients, Fresnel between them.

     colour = F tint L(axis) + w albedo E(n) / pi

   axis   r, the reflected eye; t, the tangent, with the slice v.t (Banks); the axis of an
          envmap_fit at n.v, r without one, with the slice n.v, times the fit's factor (Kautz and
          McCool's 3D maps); a fan of r, as n turns across the strokes t (an elliptical lobe); or
          the normal in the viewer's frame (maps that are drawn by hand)
   F      1, or the reflectance of a dielectric at n.v; w is 0, 1 or 1 - F
   lookup cube; dual paraboloid by texture matrices, both faces at once with alpha at the rim, or in
          two passes that discard the other's part; sphere map
   What you will see: `viewer` shows it, `make gallery` draws it, tests/test_gl.c holds every path
   against envmap_lookup. Include after gl.h.

   SPDX-License-Identifier: MIT */

#ifndef SURFACE_H
#define SURFACE_H

enum { SURFACE_CUBE, SURFACE_PARABOLOID, SURFACE_TWO_PASS, SURFACE_SPHERE, SURFACE_LOOKUPS };
enum { SURFACE_REFLECTION, SURFACE_TANGENT, SURFACE_VIEW, SURFACE_FAN, SURFACE_DRAWN }; /* axis */
enum { SURFACE_NO_DIFFUSE, SURFACE_PLUS_DIFFUSE, SURFACE_BLENDED };
enum { SURFACE_SHOW_COLOUR, SURFACE_SHOW_NORMAL, SURFACE_SHOW_VIEW, SURFACE_SHOW_TANGENT };

#define SURFACE_TAPS 64 /* the most of a fan */
#define SURFACE_FITS 32 /* the most slices of a fit */

static const int surface_mapping[SURFACE_LOOKUPS] = {ENVMAP_CUBE, ENVMAP_PARABOLOID,
                                                     ENVMAP_PARABOLOID, ENVMAP_SPHERE};

/* Maps are textures of gl_map; those that a look does not need stay 0. */
typedef struct surface {
    int lookup, axis, diffuse; /* of the lists above                                              */
    float level;               /* of the map; DRAWN, < 0: per pixel, a texel for -level pixels   */
    float index;               /* of refraction; 0: F = 1                                         */
    float tint[3], albedo[3];
    float sh[28];     /* of envmap_sh_pack                                                      */
    GLuint map;       /* cube or layers, by lookup                                              */
    GLuint slices[2]; /* of gl_volume, front and back; for the axes with slices                 */
    float turn[9];    /* world direction -> map, column-major                                   */
    float fan[SURFACE_TAPS][2]; /* offset, weight                                                 */
    float fit[SURFACE_FITS][4]; /* factor, m                                                      */
    int taps, fits;             /* how many of them; fits 0: factor 1, m 1                        */
    int show; /* what to write instead of the colour: for tests                         */
} surface;

static const char surface_fragment[] =
    "in vec3 at, n, t;\n"
    "out vec4 colour;\n"
    "uniform samplerCube cube;\n"
    "uniform sampler2DArray layers;\n"
    "uniform sampler3D front, back;\n"
    "uniform int lookup, axis, diffuse, show, face, taps, fits;\n"
    "uniform vec2 fan[64];\n"
    "uniform vec4 fit[32];\n"
    "uniform float level, index;\n"
    "uniform vec3 tint, albedo, eye;\n"
    "uniform vec4 sh[7];\n"
    "uniform mat3 turn;\n"
    "uniform mat4 view, matrix[2];\n"
    "vec3 disc(vec3 r, int side) {\n" /* uv by texture matrix; texels to the rim */
    "    vec4 s = matrix[side] * vec4(mat3(view) * r, 1.0);\n"
    "    vec2 uv = s.xy / s.w;\n"
    "    float inside = (1.0 - length(2.0 * uv - 1.0)) * float(textureSize(layers, "
    "int(level)).x);\n"
    "    return vec3(uv, s.w * matrix[side][3][3] < 0.0 ? -1e3 : inside);\n"
    "}\n"
    "vec3 both(vec3 r) {\n"
    "    vec3 f = disc(r, 0), b = disc(r, 1);\n"
    "    vec3 lf = textureLod(layers, vec3(f.xy, 0.0), level).rgb;\n"
    "    vec3 lb = textureLod(layers, vec3(b.xy, 1.0), level).rgb;\n"
    "    float alpha = f.z > -1.0 ? clamp(0.5 + 0.5 * f.z, 0.0, 1.0) : 0.0;\n"
    "    return alpha == 1.0 ? lf : alpha == 0.0 ? lb : mix(lb, lf, alpha);\n"
    "}\n"
    "vec3 look(vec3 r) {\n"
    "    if (lookup == 0) return textureLod(cube, turn * r, level).rgb;\n"
    "    if (lookup == 1 || (lookup == 2 && axis == 3)) return both(r);\n" /* a fan: both faces */
    "    if (lookup == 3) return sphere_map(layers, turn * r, level);\n"
    "    vec3 one = disc(r, face);\n"
    "    if (one.z < 0.0) discard;\n" /* alpha is 0 outside the circle */
    "    return textureLod(layers, vec3(one.xy, float(face)), level).rgb;\n"
    "}\n"
    "vec3 fitted(vec3 N, vec3 V, float c) {\n"
    "    float at = clamp(c * float(fits) - 0.5, 0.0, float(max(fits - 1, 0)));\n"
    "    int k = int(at);\n"
    "    vec4 f = fits == 0 ? vec4(1.0) : mix(fit[k], fit[min(k + 1, fits - 1)], at - float(k));\n"
    "    vec3 off = c * N - V;\n" /* in the plane of N and V, away from V */
    "    float s = length(off), psi = f.w * atan(s, c);\n"
    "    vec3 a = s > 1e-6 ? cos(psi) * N + sin(psi) / s * off : N;\n"
    "    return f.rgb * slices(front, back, turn * a, c);\n"
    "}\n"
    "vec3 fanned(vec3 N, vec3 V, vec3 T) {\n"
    "    vec3 along = normalize(cross(N, T)), sum = vec3(0.0);\n"
    "    for (int i = 0; i < taps; i++) {\n"
    "        vec3 h = cos(0.5 * fan[i].x) * N + sin(0.5 * fan[i].x) * along;\n"
    "        sum += fan[i].y * look(reflect(-V, h));\n"
    "    }\n"
    "    return sum;\n"
    "}\n"
    "vec3 drawn(vec3 N, vec3 V) {\n" /* up on the screen is up in the map */
    "    vec3 up = vec3(view[0][1], view[1][1], view[2][1]), x = normalize(cross(up, V));\n"
    "    vec2 p = vec2(dot(N, x), dot(N, cross(V, x)));\n"
    "    p /= dot(N, V) < 0.0 ? length(p) : 1.0;\n" /* the rim, and not its inside again */
    "    float size = float(textureSize(layers, 0).x), l = level;\n"
    "    float across = 0.5 * size * max(length(dFdx(p)), length(dFdy(p)));\n" /* texels a pixel */
    "    if (l < 0.0) l = log2(across * -level + 1e-6);\n"
    "    return textureLod(layers, vec3(0.5 + 0.5 * p.x, 0.5 - 0.5 * p.y, 0.0), max(l, 0.0)).rgb;\n"
    "}\n"
    "void main() {\n"
    "    vec3 N = normalize(gl_FrontFacing ? n : -n), V = normalize(eye - at), T = normalize(t);\n"
    "    float c = dot(N, V), F = index > 0.0 ? fresnel(max(c, 0.0), index) : 1.0;\n"
    "    vec3 S = axis == 0   ? look(reflect(-V, N))\n"
    "             : axis == 1 ? slices(front, back, turn * T, 0.5 + 0.5 * dot(V, T))\n"
    "             : axis == 2 ? fitted(N, V, c)\n"
    "             : axis == 3 ? fanned(N, V, T)\n"
    "                         : drawn(N, V);\n"
    "    float w = diffuse == 0 ? 0.0 : diffuse == 1 ? 1.0 : 1.0 - F;\n"
    "    vec3 light = F * tint * S + w * albedo * max(nine(sh, turn * N), 0.0);\n"
    "    colour = vec4(show == 0 ? light : show == 1 ? N : show == 2 ? V : T, 1.0);\n"
    "}\n";

/* A white mirror under no turn. */
static inline surface surface_default(void) {
    surface s = {0};
    s.tint[0] = s.tint[1] = s.tint[2] = 1;
    s.albedo[0] = s.albedo[1] = s.albedo[2] = 1;
    s.turn[0] = s.turn[4] = s.turn[8] = 1;
    return s;
}

/* An elliptical lobe from a map of a round one: envmap_fan's numbers. Returns 1 if they fit; where
   they do not, the surface is black. */
static inline int surface_fan(surface *s, double along, double across) {
    float offsets[SURFACE_TAPS], weights[SURFACE_TAPS];
    int i, count = envmap_fan(offsets, weights, SURFACE_TAPS, along, across, 0.01);
    s->taps = count <= SURFACE_TAPS ? count : 0;
    for (i = 0; i < s->taps; i++) s->fan[i][0] = offsets[i], s->fan[i][1] = weights[i];
    return s->taps > 0;
}

/* The first lobe of a fit. Returns 1 if its slices fit. */
static inline int surface_fit(surface *s, const envmap_fit *fit) {
    int k;
    if (fit->slices > SURFACE_FITS) return 0;
    s->fits = fit->slices;
    for (k = 0; k < fit->slices; k++) {
        memcpy(s->fit[k], fit->factor + 3 * k, 3 * sizeof(float));
        s->fit[k][3] = fit->axis[k];
    }
    return 1;
}

static inline GLuint surface_program(void) { return gl_program(gl_vertex, surface_fragment); }

/* The modelview matrix of the map: its space -> eye. `turn` is a rotation. */
static inline void surface_modelview(float out[16], const float view[16], const float turn[9]) {
    float back[16];
    int i;
    mesh_identity(back);
    for (i = 0; i < 9; i++) back[4 * (i / 3) + i % 3] = turn[3 * (i % 3) + i / 3];
    mesh_multiply(out, view, back);
}

static inline void surface_matrices(GLuint program, const gl_app *app, const surface *s) {
    float modelview[16], matrices[2][16];
    surface_modelview(modelview, app->view, s->turn);
    if (envmap_paraboloid_matrix(matrices[0], modelview, 0) ||
        envmap_paraboloid_matrix(matrices[1], modelview, 1))
        return;
    gl_mat4(program, "matrix[0]", matrices[0]);
    gl_mat4(program, "matrix[1]", matrices[1]);
    gl_mat4(program, "view", app->view);
}

/* Draws a mesh where `model` puts it, in the frame that is bound; twice for SURFACE_TWO_PASS. */
static inline void surface_draw(GLuint program, const gl_app *app, const surface *s,
                                const gl_mesh *m, const float model[16]) {
    GLuint layers = s->lookup == SURFACE_CUBE ? 0 : s->map;
    int face;
    gl.UseProgram(program);
    gl_mat4(program, "model", model);
    gl_mat4(program, "camera", app->camera);
    gl_vec3(program, "eye", app->eye);
    gl_mat3(program, "turn", s->turn);
    gl_sampler(program, "cube", 0, GL_TEXTURE_CUBE_MAP, s->lookup == SURFACE_CUBE ? s->map : 0);
    gl_sampler(program, "layers", 1, GL_TEXTURE_2D_ARRAY, layers);
    gl_sampler(program, "front", 2, GL_TEXTURE_3D, s->slices[0]);
    gl_sampler(program, "back", 3, GL_TEXTURE_3D, s->slices[1]);
    gl_int(program, "lookup", s->lookup);
    gl_int(program, "axis", s->axis);
    gl_int(program, "diffuse", s->diffuse);
    gl_int(program, "show", s->show);
    gl_float(program, "level", s->level);
    gl_float(program, "index", s->index);
    gl_vec3(program, "tint", s->tint);
    gl_vec3(program, "albedo", s->albedo);
    gl_vec4s(program, "sh", s->sh, 7);
    gl_int(program, "taps", s->taps);
    gl_int(program, "fits", s->fits);
    gl_vec4s(program, "fit", s->fit[0], SURFACE_FITS);
    gl.Uniform2fv(gl.GetUniformLocation(program, "fan"), SURFACE_TAPS, s->fan[0]);
    surface_matrices(program, app, s);
    for (face = 0; face < (s->lookup == SURFACE_TWO_PASS ? 2 : 1); face++) {
        gl_int(program, "face", face);
        gl_mesh_draw(m);
    }
}

#endif /* SURFACE_H */
