/* capture.h - an environment that is caught on the fly: a cube to render into, its levels, its nine
   coefficients, and the shader that lights an object with them in one pass:

     colour = F L(r; level + b) + (1 - F) albedo E(n) / pi,   F = f + (1 - f) (1 - n.v)^5

   Levels are tents of 4 x 4 texels that reach over the edges of a face, so that none shows a seam;
   coefficients come from a level of 6 x 16 x 16 texels, on the CPU.
   Include after envmap.h and gl.h. What you will see: `one_pass`. Tests: captured_* in test_gl.c.

   SPDX-License-Identifier: MIT */

#ifndef CAPTURE_H
#define CAPTURE_H

#define CAPTURE_EDGE   128
#define CAPTURE_LEVELS 8
#define CAPTURE_SMALL  3 /* the level that goes to the CPU */

typedef struct capture {
    GLuint cube, frame, depth, array;
    GLuint level, light; /* programs: the next level; the object in one pass */
    envmap small;
    float sh[28]; /* irradiance / pi, of envmap_sh_pack */
} capture;

/* One face of one level from the level above, which is the only one that the sampler sees: 4 x 4
   texels, tents of their solid angle. Taps past an edge are directions into the next face. */
static const char capture_level[] =
    "in vec2 st;\n"
    "out vec4 colour;\n"
    "uniform samplerCube above;\n"
    "uniform float edge;\n" /* of the level above */
    "uniform mat3 face;\n"
    "void main() {\n"
    "    vec4 sum = vec4(0.0);\n"
    "    for (int i = 0; i < 16; i++) {\n"
    "        vec2 k = vec2(i % 4, i / 4) - 1.5;\n"
    "        vec2 p = 2.0 * (st + k / edge) - 1.0;\n"
    "        vec2 tent = 2.0 - abs(k);\n"
    "        float w = tent.x * tent.y * pow(1.0 + dot(p, p), -1.5);\n"
    "        sum += w * vec4(textureLod(above, face * vec3(p, 1.0), 0.0).rgb, 1.0);\n"
    "    }\n"
    "    colour = vec4(sum.rgb / sum.a, 1.0);\n"
    "}\n";

static const char capture_vertex[] = "in vec3 position, normal, tangent;\n"
                                     "out vec3 at, n, E, inside;\n" /* of both sides */
                                     "uniform mat4 model, camera;\n"
                                     "uniform vec4 sh[7];\n"
                                     "void main() {\n"
                                     "    vec4 world = model * vec4(position, 1.0);\n"
                                     "    at = world.xyz;\n"
                                     "    n = mat3(model) * normal;\n"
                                     "    E = max(nine(sh, normalize(n)), 0.0);\n"
                                     "    inside = max(nine(sh, normalize(-n)), 0.0);\n"
                                     "    gl_Position = camera * world;\n"
                                     "}\n";

static const char capture_fragment[] =
    "in vec3 at, n, E, inside;\n"
    "out vec4 colour;\n"
    "uniform samplerCube cube;\n"
    "uniform vec3 eye, albedo;\n"
    "uniform float f, b;\n"
    "void main() {\n"
    "    vec3 N = normalize(gl_FrontFacing ? n : -n), V = normalize(eye - at);\n"
    "    float F = f + (1.0 - f) * pow(1.0 - clamp(dot(N, V), 0.0, 1.0), 5.0);\n"
    "    vec3 diffuse = albedo * (gl_FrontFacing ? E : inside);\n"
    "    colour = vec4(mix(diffuse, texture(cube, reflect(-V, N), b).rgb, F), 1.0);\n"
    "}\n";

/* The axes of a face: S and T along u and v, M to its middle; column-major. */
static inline void capture_axes(float out[9], int face) {
    int i;
    envmap_direction(out + 6, ENVMAP_CUBE, face, 0.5f, 0.5f);
    envmap_direction(out, ENVMAP_CUBE, face, 1, 0.5f);
    envmap_direction(out + 3, ENVMAP_CUBE, face, 0.5f, 1);
    for (i = 0; i < 6; i++) out[i] = 1.41421356f * out[i] - out[6 + i % 3];
}

/* A camera in the middle whose picture is a face, row 0 at t = 0. */
static inline void capture_camera(float out[16], const float axes[9]) {
    const float front = 0.1f, back = 50;
    int i;
    memset(out, 0, 16 * sizeof(float));
    for (i = 0; i < 3; i++) {
        out[4 * i] = axes[i], out[4 * i + 1] = axes[3 + i];
        out[4 * i + 2] = axes[6 + i] * (back + front) / (back - front);
        out[4 * i + 3] = axes[6 + i];
    }
    out[14] = -2 * front * back / (back - front);
}

/* Draws into a face of a level from now on; row 0 is t = 0. */
static inline void capture_face(const capture *c, int face, int level) {
    gl.BindFramebuffer(GL_FRAMEBUFFER, c->frame);
    gl.FramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0,
                            GL_TEXTURE_CUBE_MAP_POSITIVE_X + (GLenum)face, c->cube, level);
    gl.FramebufferRenderbuffer(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER,
                               level ? 0 : c->depth);
    gl.Viewport(0, 0, CAPTURE_EDGE >> level, CAPTURE_EDGE >> level);
}

/* Levels 1 and on, from what was drawn into level 0. */
static inline void capture_levels(const capture *c) {
    float axes[9];
    int face, l;
    gl.Disable(GL_DEPTH_TEST);
    gl.UseProgram(c->level);
    gl.BindVertexArray(c->array);
    gl_sampler(c->level, "above", 0, GL_TEXTURE_CUBE_MAP, c->cube);
    for (l = 1; l < CAPTURE_LEVELS; l++) {
        gl.TexParameteri(GL_TEXTURE_CUBE_MAP, GL_TEXTURE_BASE_LEVEL, l - 1);
        gl.TexParameteri(GL_TEXTURE_CUBE_MAP, GL_TEXTURE_MAX_LEVEL, l - 1);
        gl_float(c->level, "edge", (float)(CAPTURE_EDGE >> (l - 1)));
        for (face = 0; face < 6; face++) {
            capture_face(c, face, l);
            capture_axes(axes, face);
            gl_mat3(c->level, "face", axes);
            gl.DrawArrays(GL_TRIANGLES, 0, 3);
        }
    }
    gl.TexParameteri(GL_TEXTURE_CUBE_MAP, GL_TEXTURE_BASE_LEVEL, 0);
    gl.TexParameteri(GL_TEXTURE_CUBE_MAP, GL_TEXTURE_MAX_LEVEL, CAPTURE_LEVELS - 1);
    gl.Enable(GL_DEPTH_TEST);
}

/* Faces of a level into level 0 of a map of that edge. */
static inline void capture_read(const capture *c, envmap *map, int level) {
    int face;
    for (face = 0; face < 6; face++) {
        capture_face(c, face, level);
        gl.ReadPixels(0, 0, map->size, map->size, GL_RGB, GL_FLOAT,
                      envmap_texel(map, 0, 0, face, 0, 0));
    }
}

/* The nine coefficients of the small level, on the CPU. */
static inline envmap_result capture_project(capture *c) {
    envmap_lobe diffuse = envmap_lobe_diffuse();
    envmap_result result;
    double sh[27];
    capture_read(c, &c->small, CAPTURE_SMALL);
    result = envmap_sh_project(sh, 3, &c->small, 0, 0, NULL);
    if (!result) result = envmap_sh_convolve(sh, sh, 3, &diffuse, 0);
    return result ? result : envmap_sh_pack(NULL, c->sh, sh);
}

/* What a surface is made of. */
typedef struct capture_look {
    float f, b; /* reflectance at normal incidence, bias of the level */
    float albedo[3];
} capture_look;

/* An object in what was captured, through `camera`, into the frame that is bound. */
static inline void capture_draw(const capture *c, const gl_app *app, const gl_mesh *m,
                                const float model[16], const capture_look *look) {
    gl.UseProgram(c->light);
    gl_sampler(c->light, "cube", 0, GL_TEXTURE_CUBE_MAP, c->cube);
    gl_mat4(c->light, "model", model);
    gl_mat4(c->light, "camera", app->camera);
    gl_vec3(c->light, "eye", app->eye);
    gl_vec3(c->light, "albedo", look->albedo);
    gl_vec4s(c->light, "sh", c->sh, 7);
    gl_float(c->light, "f", look->f);
    /* more points a pixel make the card choose sharper levels; b is meant for one */
    gl_float(c->light, "b", look->b + log2f((float)app->samples));
    gl_mesh_draw(m);
}

static inline void capture_free(capture *c) {
    envmap_free(&c->small);
    gl.DeleteFramebuffers(1, &c->frame);
    gl.DeleteRenderbuffers(1, &c->depth);
    gl.DeleteVertexArrays(1, &c->array);
    gl.DeleteTextures(1, &c->cube);
    gl.DeleteProgram(c->level);
    gl.DeleteProgram(c->light);
}

/* Returns 1 when card and memory can. */
static inline int capture_create(capture *c) {
    int f, l;
    memset(c, 0, sizeof *c);
    c->level = gl_program(gl_cover, capture_level);
    c->light = gl_program(capture_vertex, capture_fragment);
    c->cube = gl_texture(GL_TEXTURE_CUBE_MAP, CAPTURE_LEVELS);
    for (l = 0; l < CAPTURE_LEVELS; l++)
        for (f = 0; f < 6; f++)
            gl.TexImage2D(GL_TEXTURE_CUBE_MAP_POSITIVE_X + (GLenum)f, l, GL_RGBA32F,
                          CAPTURE_EDGE >> l, CAPTURE_EDGE >> l, 0, GL_RGBA, GL_FLOAT, NULL);
    gl.GenVertexArrays(1, &c->array);
    gl.GenFramebuffers(1, &c->frame);
    gl.GenRenderbuffers(1, &c->depth);
    gl.BindRenderbuffer(GL_RENDERBUFFER, c->depth);
    gl.RenderbufferStorage(GL_RENDERBUFFER, GL_DEPTH_COMPONENT24, CAPTURE_EDGE, CAPTURE_EDGE);
    return c->level && c->light &&
           !envmap_create(&c->small, ENVMAP_CUBE, CAPTURE_EDGE >> CAPTURE_SMALL, 1, 1);
}

#endif /* CAPTURE_H */
