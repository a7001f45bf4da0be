/* gl_filter.h - the two-map paraboloid convolution (examples/methods/paraboloid_convolution.h, the
   published form) on the graphics card: what a frame needs to filter an environment that moves.

     levels of the source by plain boxes; S and L by at most 7 x 7 taps on the level that shrinks
     each kernel to that; L(a) = (1 - d^2) S(a) + d^2 L(a) where it is looked up

   Include after gl.h and methods/paraboloid_convolution.h, which makes the kernels.
   Source: Kautz, Vazquez, Heidrich, Seidel, "A unified approach to prefiltered environment maps",
   2000, section 5.2.  Test: the_card_convolves_paraboloids_as_the_method_does.

   SPDX-License-Identifier: MIT */

#ifndef GL_FILTER_H
#define GL_FILTER_H

#define GL_FILTER_PAD                                                                              \
    2 /* texels around a result, so that bilinear lookups find some at the border */

typedef struct gl_filter {
    GLuint source;         /* two layers with all levels: render into level 0, then gl_filter_run */
    GLuint result[2];      /* S and L, two layers each */
    int edge, maps, room;  /* of the source; what was run; side of results, as created */
    int sides[2], taps[2]; /* of the last results; taps per side */
    GLuint frame, array, convolve, show;
} gl_filter;

static const char gl_filter_convolve[] =
    "out vec4 colour;\n"
    "uniform sampler2DArray source;\n"
    "uniform int face, level, reach;\n"
    "uniform float weights[49], total;\n"
    "void main() {\n"
    "    ivec2 at = ivec2(gl_FragCoord.xy) - 2;\n"
    "    int last = textureSize(source, level).x - 1, side = 2 * reach + 1;\n"
    "    vec3 sum = vec3(0.0);\n"
    "    for (int i = 0; i < side * side; i++) {\n"
    "        ivec2 tap = clamp(at + ivec2(i % side, i / side) - reach, 0, last);\n"
    "        sum += weights[i] * texelFetch(source, ivec3(tap, face), level).rgb;\n"
    "    }\n"
    "    colour = vec4(sum / total, 1.0);\n"
    "}\n";

/* GLSL for whoever looks the result up: `sides` are gl_filter.sides. */
#define GL_FILTER_GLSL                                                                             \
    "uniform sampler2DArray centre, rim;\n"                                                        \
    "uniform int maps;\n"                                                                          \
    "uniform vec3 sides;\n" /* of S, of L, of both textures */                                     \
    "vec3 one_map(sampler2DArray map, vec2 p, float face, float side) {\n"                         \
    "    vec2 st = (vec2(p.x, -p.y) + 1.0) * 0.5 * (side - 4.0) + 2.0;\n"                          \
    "    return textureLod(map, vec3(st / sides.z, face), 0.0).rgb;\n"                             \
    "}\n"                                                                                          \
    "vec3 two_maps(vec3 d) {\n"                                                                    \
    "    vec2 p = d.xy / (1.0 + abs(d.z));\n"                                                      \
    "    float face = d.z < 0.0 ? 1.0 : 0.0;\n"                                                    \
    "    vec3 S = one_map(centre, p, face, sides.x);\n"                                            \
    "    return maps == 1 ? S : mix(S, one_map(rim, p, face, sides.y), dot(p, p));\n"              \
    "}\n"

static const char gl_filter_show[] =
    "in vec2 st;\n"
    "out vec4 colour;\n"
    "uniform int face;\n" GL_FILTER_GLSL "void main() {\n"
    "    vec2 p = vec2(2.0 * st.x - 1.0, 1.0 - 2.0 * st.y);\n"
    "    float s = 1.0 + dot(p, p), z = (2.0 - s) / s;\n"
    "    colour = vec4(two_maps(vec3(2.0 * p / s, face == 0 ? z : -z)), 1.0);\n"
    "}\n";

static inline GLuint gl_filter_texture(int edge, int levels) {
    GLuint texture = gl_texture(GL_TEXTURE_2D_ARRAY, levels);
    int l;
    for (l = 0; l < levels; l++)
        gl.TexImage3D(GL_TEXTURE_2D_ARRAY, l, GL_RGBA32F, edge >> l, edge >> l, 2, 0, GL_RGBA,
                      GL_FLOAT, NULL);
    return texture;
}

/* edge  of a face of the source, a power of two. Returns 1 when the card can. */
static inline int gl_filter_create(gl_filter *f, int edge) {
    int k;
    memset(f, 0, sizeof *f);
    f->edge = edge, f->room = edge + 2 * GL_FILTER_PAD;
    f->source = gl_filter_texture(edge, envmap_levels(edge));
    for (k = 0; k < 2; k++) f->result[k] = gl_filter_texture(f->room, 1);
    gl.GenFramebuffers(1, &f->frame);
    gl.GenVertexArrays(1, &f->array);
    f->convolve = gl_program(gl_cover, gl_filter_convolve);
    f->show = gl_program(gl_cover, gl_filter_show);
    return f->convolve && f->show;
}

static inline void gl_filter_free(gl_filter *f) {
    gl.DeleteTextures(1, &f->source);
    gl.DeleteTextures(2, f->result);
    gl.DeleteFramebuffers(1, &f->frame);
    gl.DeleteVertexArrays(1, &f->array);
    gl.DeleteProgram(f->convolve);
    gl.DeleteProgram(f->show);
}

/* Draws into a face of a two-layer texture from now on; row 0 of the map is the lowest. */
static inline void gl_filter_face(gl_filter *f, GLuint texture, int face, int side) {
    gl.BindFramebuffer(GL_FRAMEBUFFER, f->frame);
    gl.FramebufferTextureLayer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, texture, 0, face);
    gl.Viewport(0, 0, side, side);
}

/* Level 0 from a paraboloid map of the same edge. */
static inline void gl_filter_source(gl_filter *f, const envmap *map) {
    gl.BindTexture(GL_TEXTURE_2D_ARRAY, f->source);
    gl.TexSubImage3D(GL_TEXTURE_2D_ARRAY, 0, 0, 0, 0, f->edge, f->edge, 2, GL_RGB, GL_FLOAT,
                     envmap_texel(map, 0, 0, 0, 0, 0));
}

/* One of the two maps, its two faces. */
static inline void gl_filter_map(gl_filter *f, const envmap_lobe *lobe, int large) {
    double angle = paraboloid_angle(lobe, 0.1);
    paraboloid_kernel kernel;
    float weights[49], total = 0;
    int size[2], shrink[2], level = 0, i, face, side;
    paraboloid_sizes(size, shrink, lobe, f->edge, 0.1, 7);
    while (1 << level < shrink[large] && f->edge >> (level + 1) > 0) level++;
    paraboloid_kernel_of(&kernel, lobe, angle, 7, f->edge >> level, large, 0);
    side = 2 * kernel.reach + 1;
    for (i = 0; i < side * side; i++) total += weights[i] = kernel.weight[i / side][i % side];
    f->sides[large] = (f->edge >> level) + 2 * GL_FILTER_PAD, f->taps[large] = side;
    gl_int(f->convolve, "level", level);
    gl_int(f->convolve, "reach", kernel.reach);
    gl_float(f->convolve, "total", total);
    gl.Uniform1fv(gl.GetUniformLocation(f->convolve, "weights"), side * side, weights);
    for (face = 0; face < 2; face++) {
        gl_filter_face(f, f->result[large], face, f->sides[large]);
        gl_int(f->convolve, "face", face);
        gl.DrawArrays(GL_TRIANGLES, 0, 3);
    }
}

/* Filters what is in level 0 of the source. lobe: Phong, or whatever the method takes. */
static inline void gl_filter_run(gl_filter *f, const envmap_lobe *lobe, int maps) {
    int k;
    f->maps = maps;
    gl.Disable(GL_DEPTH_TEST);
    gl.BindVertexArray(f->array);
    gl.UseProgram(f->convolve);
    gl_sampler(f->convolve, "source", 0, GL_TEXTURE_2D_ARRAY, f->source);
    gl.GenerateMipmap(GL_TEXTURE_2D_ARRAY);
    for (k = 0; k < maps; k++) gl_filter_map(f, lobe, k);
    gl.Enable(GL_DEPTH_TEST);
}

/* Uniforms of GL_FILTER_GLSL for the program in use, on texture units 0 and 1. */
static inline void gl_filter_bind(const gl_filter *f, GLuint program) {
    float sides[3];
    sides[0] = (float)f->sides[0], sides[1] = (float)f->sides[1], sides[2] = (float)f->room;
    gl_sampler(program, "centre", 0, GL_TEXTURE_2D_ARRAY, f->result[0]);
    gl_sampler(program, "rim", 1, GL_TEXTURE_2D_ARRAY, f->result[1]);
    gl_int(program, "maps", f->maps);
    gl_vec3(program, "sides", sides);
}

/* The result as a paraboloid map of an edge, RGBA, in the order of envmap.h (to be freed). */
static inline float *gl_filter_read(gl_filter *f, int edge) {
    size_t face_floats = 4 * (size_t)edge * (size_t)edge;
    float *rgba = (float *)malloc(2 * face_floats * sizeof(float));
    gl_target target;
    int face;
    if (rgba && gl_target_create(&target, edge, edge, GL_RGBA32F)) {
        gl.UseProgram(f->show);
        gl_filter_bind(f, f->show);
        for (face = 0; face < 2; face++) {
            gl_target_bind(&target);
            gl_int(f->show, "face", face);
            gl.BindVertexArray(f->array);
            gl.DrawArrays(GL_TRIANGLES, 0, 3);
            gl.ReadPixels(0, 0, edge, edge, GL_RGBA, GL_FLOAT, rgba + (size_t)face * face_floats);
        }
        gl_target_free(&target);
    }
    return rgba;
}

#endif /* GL_FILTER_H */
