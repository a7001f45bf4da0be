/* gl.h - what the OpenGL examples share: a 3.3 core context in a window or with none at all, its
   functions, shaders, maps as textures, an orbiting camera, pictures.

   What you will see: every example opens a window where there is a display (drag to orbit, wheel to
   come closer, Escape to leave), and writes a picture where there is none, or with
   --headless out.png; --keys ABC presses keys first. Compiled with -DGL_WINDOW it wants GLFW 3 and
   its window; without, or without a display, EGL makes a context that belongs to no screen. Frames
   are drawn as linear radiance at samples x samples points a pixel, and each point goes through the
   tone curve of picture.h before their mean is taken, so that edges of lamps are smooth too.
   Include after envmap.h. Libraries: -lEGL, and -lglfw with GL_WINDOW.

   >>functions  the table of OpenGL's functions
   >>programs   shaders, and the GLSL that looks maps up
   >>textures   envmap -> cube, layers (paraboloids, sphere map), volumes (slices)
   >>targets    where frames go
   >>app        context, frame loop, camera

   SPDX-License-Identifier: MIT */

#ifndef GL_H
#define GL_H

#include <stdio.h>
#include <time.h>
#include <EGL/egl.h>
#include <EGL/eglext.h>
#include <GL/glcorearb.h>
#ifdef GL_WINDOW
#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>
#endif
#include "mesh.h"
#include "../tool/picture.h"

/* ------------------------------------------------------------------------------- >>functions -- */

#define GL_FUNCTIONS(X)                                                                            \
    X(ACTIVETEXTURE, ActiveTexture)                                                                \
    X(ATTACHSHADER, AttachShader)                                                                  \
    X(BINDATTRIBLOCATION, BindAttribLocation)                                                      \
    X(BINDBUFFER, BindBuffer)                                                                      \
    X(BINDFRAMEBUFFER, BindFramebuffer)                                                            \
    X(BINDRENDERBUFFER, BindRenderbuffer)                                                          \
    X(BINDTEXTURE, BindTexture)                                                                    \
    X(BINDVERTEXARRAY, BindVertexArray)                                                            \
    X(BLENDFUNC, BlendFunc)                                                                        \
    X(BUFFERDATA, BufferData)                                                                      \
    X(CHECKFRAMEBUFFERSTATUS, CheckFramebufferStatus)                                              \
    X(CLEAR, Clear)                                                                                \
    X(CLEARCOLOR, ClearColor)                                                                      \
    X(COMPILESHADER, CompileShader)                                                                \
    X(CREATEPROGRAM, CreateProgram)                                                                \
    X(CREATESHADER, CreateShader)                                                                  \
    X(DELETEBUFFERS, DeleteBuffers)                                                                \
    X(DELETEFRAMEBUFFERS, DeleteFramebuffers)                                                      \
    X(DELETEPROGRAM, DeleteProgram)                                                                \
    X(DELETERENDERBUFFERS, DeleteRenderbuffers)                                                    \
    X(DELETESHADER, DeleteShader)                                                                  \
    X(DELETETEXTURES, DeleteTextures)                                                              \
    X(DELETEVERTEXARRAYS, DeleteVertexArrays)                                                      \
    X(DEPTHFUNC, DepthFunc)                                                                        \
    X(DEPTHMASK, DepthMask)                                                                        \
    X(DISABLE, Disable)                                                                            \
    X(DRAWARRAYS, DrawArrays)                                                                      \
    X(DRAWELEMENTS, DrawElements)                                                                  \
    X(ENABLE, Enable)                                                                              \
    X(ENABLEVERTEXATTRIBARRAY, EnableVertexAttribArray)                                            \
    X(FINISH, Finish)                                                                              \
    X(FRAMEBUFFERRENDERBUFFER, FramebufferRenderbuffer)                                            \
    X(FRAMEBUFFERTEXTURE2D, FramebufferTexture2D)                                                  \
    X(FRAMEBUFFERTEXTURELAYER, FramebufferTextureLayer)                                            \
    X(GENBUFFERS, GenBuffers)                                                                      \
    X(GENERATEMIPMAP, GenerateMipmap)                                                              \
    X(GENFRAMEBUFFERS, GenFramebuffers)                                                            \
    X(GENRENDERBUFFERS, GenRenderbuffers)                                                          \
    X(GENTEXTURES, GenTextures)                                                                    \
    X(GENVERTEXARRAYS, GenVertexArrays)                                                            \
    X(GETERROR, GetError)                                                                          \
    X(GETPROGRAMINFOLOG, GetProgramInfoLog)                                                        \
    X(GETPROGRAMIV, GetProgramiv)                                                                  \
    X(GETSHADERINFOLOG, GetShaderInfoLog)                                                          \
    X(GETSHADERIV, GetShaderiv)                                                                    \
    X(GETSTRING, GetString)                                                                        \
    X(GETTEXIMAGE, GetTexImage)                                                                    \
    X(GETUNIFORMLOCATION, GetUniformLocation)                                                      \
    X(LINKPROGRAM, LinkProgram)                                                                    \
    X(PIXELSTOREI, PixelStorei)                                                                    \
    X(READPIXELS, ReadPixels)                                                                      \
    X(RENDERBUFFERSTORAGE, RenderbufferStorage)                                                    \
    X(SHADERSOURCE, ShaderSource)                                                                  \
    X(TEXIMAGE2D, TexImage2D)                                                                      \
    X(TEXIMAGE3D, TexImage3D)                                                                      \
    X(TEXPARAMETERI, TexParameteri)                                                                \
    X(TEXSUBIMAGE2D, TexSubImage2D)                                                                \
    X(TEXSUBIMAGE3D, TexSubImage3D)                                                                \
    X(UNIFORM1F, Uniform1f)                                                                        \
    X(UNIFORM1I, Uniform1i)                                                                        \
    X(UNIFORM1FV, Uniform1fv)                                                                      \
    X(UNIFORM2FV, Uniform2fv)                                                                      \
    X(UNIFORM3FV, Uniform3fv)                                                                      \
    X(UNIFORM4FV, Uniform4fv)                                                                      \
    X(UNIFORMMATRIX3FV, UniformMatrix3fv)                                                          \
    X(UNIFORMMATRIX4FV, UniformMatrix4fv)                                                          \
    X(USEPROGRAM, UseProgram)                                                                      \
    X(VERTEXATTRIBPOINTER, VertexAttribPointer)                                                    \
    X(VIEWPORT, Viewport)

typedef void (*gl_function)(void);

#define GL_FIELD(upper, name) PFNGL##upper##PROC name;
static struct gl_functions {
    GL_FUNCTIONS(GL_FIELD)
    PFNGLDEBUGMESSAGECALLBACKPROC DebugMessageCallback; /* of OpenGL 4.3: may be NULL */
} gl;

static int gl_errors; /* that the driver reported */

static inline void APIENTRY gl_complain(GLenum source, GLenum type, GLuint id, GLenum severity,
                                        GLsizei length, const GLchar *message, const void *user) {
    (void)source, (void)id, (void)severity, (void)length, (void)user;
    if (type != GL_DEBUG_TYPE_ERROR && type != GL_DEBUG_TYPE_UNDEFINED_BEHAVIOR) return;
    fprintf(stderr, "OpenGL: %s\n", message);
    gl_errors++;
}

/* Returns 1 when all of them are there. */
static inline int gl_load(gl_function (*find)(const char *name)) {
    int all = 1;
#define GL_LOAD(upper, name)                                                                       \
    gl.name = (PFNGL##upper##PROC)find("gl" #name);                                                \
    all = all && gl.name;
    GL_FUNCTIONS(GL_LOAD)
    gl.DebugMessageCallback = (PFNGLDEBUGMESSAGECALLBACKPROC)find("glDebugMessageCallback");
    if (all && gl.DebugMessageCallback) {
        gl.Enable(GL_DEBUG_OUTPUT);
        gl.Enable(GL_DEBUG_OUTPUT_SYNCHRONOUS);
        gl.DebugMessageCallback(gl_complain, NULL);
    }
    return all;
}

/* -------------------------------------------------------------------------------- >>programs -- */

/* In front of every shader: directions into the mappings of envmap.h, as envmap_lookup
   does them, and what reflects how much. Levels are always explicit, so no derivative jumps at a
   seam. */
static const char gl_common[] =
    "#version 330 core\n"
    "vec2 paraboloid_uv(vec3 d, float face) {\n" /* of one face, also beyond its disc */
    "    vec2 p = d.xy / (1.0 + (face < 0.5 ? d.z : -d.z));\n"
    "    return vec2(0.5 + 0.5 * p.x, 0.5 - 0.5 * p.y);\n"
    "}\n"
    "float paraboloid_across(vec3 d, float edge) {\n" /* share of the other face at the rim */
    "    float r = sqrt((1.0 - abs(d.z)) / (1.0 + abs(d.z)));\n"
    "    return clamp(0.5 - 0.5 * (1.0 - r) * edge, 0.0, 0.5);\n"
    "}\n"
    "vec3 paraboloid_level(sampler2DArray map, vec3 d, float level) {\n"
    "    float face = d.z < 0.0 ? 1.0 : 0.0;\n"
    "    float across = paraboloid_across(d, float(textureSize(map, int(level)).x));\n"
    "    vec3 here = textureLod(map, vec3(paraboloid_uv(d, face), face), level).rgb;\n"
    "    if (across == 0.0) return here;\n"
    "    vec3 there = textureLod(map, vec3(paraboloid_uv(d, 1.0 - face), 1.0 - face), level).rgb;\n"
    "    return mix(here, there, across);\n"
    "}\n"
    "vec3 paraboloid(sampler2DArray map, vec3 d, float level) {\n"
    "    float l = floor(level), f = level - l;\n"
    "    vec3 sharp = paraboloid_level(map, d, l);\n"
    "    return f > 0.0 ? mix(sharp, paraboloid_level(map, d, l + 1.0), f) : sharp;\n"
    "}\n"
    "vec3 slices(sampler3D front, sampler3D back, vec3 d, float p) {\n" /* p in [0,1] */
    "    bool ahead = d.z >= 0.0;\n"
    "    float across = paraboloid_across(d, float(textureSize(front, 0).x));\n"
    "    vec3 f = vec3(paraboloid_uv(d, 0.0), p), b = vec3(paraboloid_uv(d, 1.0), p);\n"
    "    vec3 here = ahead ? textureLod(front, f, 0.0).rgb : textureLod(back, b, 0.0).rgb;\n"
    "    if (across == 0.0) return here;\n"
    "    vec3 there = ahead ? textureLod(back, b, 0.0).rgb : textureLod(front, f, 0.0).rgb;\n"
    "    return mix(here, there, across);\n"
    "}\n"
    "vec3 sphere_map(sampler2DArray map, vec3 d, float level) {\n"
    "    vec2 p = d.xy / sqrt(max(2.0 * (1.0 + d.z), 1e-7));\n"
    "    return textureLod(map, vec3(0.5 + 0.5 * p.x, 0.5 - 0.5 * p.y, 0.0), level).rgb;\n"
    "}\n"
    "vec3 nine(vec4 sh[7], vec3 n) {\n" /* envmap_sh_pack */
    "    vec4 b = n.xyzz * n.yzzx, a = vec4(n, 1.0);\n"
    "    return vec3(dot(sh[0], a), dot(sh[1], a), dot(sh[2], a))\n"
    "         + vec3(dot(sh[3], b), dot(sh[4], b), dot(sh[5], b))\n"
    "         + sh[6].rgb * (n.x * n.x - n.y * n.y);\n"
    "}\n"
    "float fresnel(float c, float index) {\n" /* unpolarised, from air; c the angle's cosine */
    "    float g = sqrt(max(index * index - 1.0 + c * c, 0.0));\n"
    "    float a = (g - c) / (g + c), b = (c * (g + c) - 1.0) / (c * (g - c) + 1.0);\n"
    "    return 0.5 * a * a * (1.0 + b * b);\n"
    "}\n";

static inline int gl_compile(GLuint program, GLenum kind, const char *const *parts, int count) {
    GLuint shader = gl.CreateShader(kind);
    GLint good = 0;
    char log[2000];
    gl.ShaderSource(shader, count, parts, NULL);
    gl.CompileShader(shader);
    gl.GetShaderiv(shader, GL_COMPILE_STATUS, &good);
    if (good) {
        gl.AttachShader(program, shader);
    } else {
        gl.GetShaderInfoLog(shader, (GLsizei)sizeof log, NULL, log);
        fprintf(stderr, "shader: %s\n", log);
    }
    gl.DeleteShader(shader); /* as soon as the program goes */
    return good;
}

/* Vertex attributes: position, normal, tangent. All shaders have gl_common before them.
   Returns 0 when something is wrong, after saying what. */
static inline GLuint gl_program(const char *vertex, const char *fragment) {
    static const char *const names[3] = {"position", "normal", "tangent"};
    const char *vertex_parts[2], *fragment_parts[2];
    GLuint program = gl.CreateProgram();
    GLint good = 0;
    int i;
    char log[2000];
    vertex_parts[0] = fragment_parts[0] = gl_common;
    vertex_parts[1] = vertex, fragment_parts[1] = fragment;
    for (i = 0; i < 3; i++) gl.BindAttribLocation(program, (GLuint)i, names[i]);
    if (gl_compile(program, GL_VERTEX_SHADER, vertex_parts, 2) &&
        gl_compile(program, GL_FRAGMENT_SHADER, fragment_parts, 2)) {
        gl.LinkProgram(program);
        gl.GetProgramiv(program, GL_LINK_STATUS, &good);
        if (!good) {
            gl.GetProgramInfoLog(program, (GLsizei)sizeof log, NULL, log);
            fprintf(stderr, "program: %s\n", log);
        }
    }
    if (good) return program;
    gl.DeleteProgram(program);
    gl_errors++;
    return 0;
}

/* Of a mesh: `model` places it (a turn and one scale), `camera` is projection times view. */
static const char gl_vertex[] = "in vec3 position, normal, tangent;\n"
                                "out vec3 at, n, t;\n"
                                "uniform mat4 model, camera;\n"
                                "void main() {\n"
                                "    vec4 world = model * vec4(position, 1.0);\n"
                                "    at = world.xyz;\n"
                                "    n = mat3(model) * normal;\n"
                                "    t = mat3(model) * tangent;\n"
                                "    gl_Position = camera * world;\n"
                                "}\n";

/* Of a triangle that covers the frame: st in [0,1], t upwards. */
static const char gl_cover[] =
    "out vec2 st;\n"
    "void main() {\n"
    "    st = vec2(gl_VertexID == 1 ? 2.0 : 0.0, gl_VertexID == 2 ? 2.0 : 0.0);\n"
    "    gl_Position = vec4(2.0 * st - 1.0, 0.99999, 1.0);\n"
    "}\n";

/* Uniforms of the program in use; what the compiler left out is passed over. */
static inline void gl_int(GLuint program, const char *name, int value) {
    gl.Uniform1i(gl.GetUniformLocation(program, name), value);
}
static inline void gl_float(GLuint program, const char *name, float value) {
    gl.Uniform1f(gl.GetUniformLocation(program, name), value);
}
static inline void gl_vec3(GLuint program, const char *name, const float value[3]) {
    gl.Uniform3fv(gl.GetUniformLocation(program, name), 1, value);
}
static inline void gl_vec4s(GLuint program, const char *name, const float *value, int count) {
    gl.Uniform4fv(gl.GetUniformLocation(program, name), count, value);
}
static inline void gl_mat3(GLuint program, const char *name, const float value[9]) {
    gl.UniformMatrix3fv(gl.GetUniformLocation(program, name), 1, GL_FALSE, value);
}
static inline void gl_mat4(GLuint program, const char *name, const float value[16]) {
    gl.UniformMatrix4fv(gl.GetUniformLocation(program, name), 1, GL_FALSE, value);
}

/* Binds a texture to a unit and tells the sampler. */
static inline void gl_sampler(GLuint program, const char *name, int unit, GLenum target,
                              GLuint texture) {
    gl.ActiveTexture(GL_TEXTURE0 + (GLenum)unit);
    gl.BindTexture(target, texture);
    gl_int(program, name, unit);
}

/* ---------------------------------------------------------------------------------- >>meshes -- */

typedef struct gl_mesh {
    GLuint array, buffers[2];
    GLsizei count;
} gl_mesh;

static inline void gl_mesh_upload(gl_mesh *out, const mesh *m) {
    int i;
    gl.GenVertexArrays(1, &out->array);
    gl.GenBuffers(2, out->buffers);
    gl.BindVertexArray(out->array);
    gl.BindBuffer(GL_ARRAY_BUFFER, out->buffers[0]);
    gl.BufferData(GL_ARRAY_BUFFER,
                  (GLsizeiptr)((size_t)m->vertex_count * MESH_FLOATS * sizeof(float)), m->vertices,
                  GL_STATIC_DRAW);
    gl.BindBuffer(GL_ELEMENT_ARRAY_BUFFER, out->buffers[1]);
    gl.BufferData(GL_ELEMENT_ARRAY_BUFFER, (GLsizeiptr)((size_t)m->index_count * sizeof(unsigned)),
                  m->indices, GL_STATIC_DRAW);
    for (i = 0; i < 3; i++) {
        gl.EnableVertexAttribArray((GLuint)i);
        gl.VertexAttribPointer((GLuint)i, 3, GL_FLOAT, GL_FALSE, MESH_FLOATS * sizeof(float),
                               (const void *)(3 * (size_t)i * sizeof(float)));
    }
    out->count = m->index_count;
}

enum { GL_TEAPOT, GL_BALL, GL_TORUS, GL_MESH_COUNT };

/* Makes and uploads one of the three. Returns 1 if there was memory. */
static inline int gl_mesh_make(gl_mesh *out, int kind) {
    mesh m;
    int good = kind == GL_TEAPOT ? mesh_teapot(&m, 16)
               : kind == GL_BALL ? mesh_ball(&m, 96)
                                 : mesh_torus(&m, 96, 0.42f);
    if (!good) return 0;
    gl_mesh_upload(out, &m);
    mesh_free(&m);
    return 1;
}

static inline void gl_mesh_free(gl_mesh *m) {
    gl.DeleteVertexArrays(1, &m->array);
    gl.DeleteBuffers(2, m->buffers);
    memset(m, 0, sizeof *m);
}

static inline void gl_mesh_draw(const gl_mesh *m) {
    gl.BindVertexArray(m->array);
    gl.DrawElements(GL_TRIANGLES, m->count, GL_UNSIGNED_INT, NULL);
}

/* -------------------------------------------------------------------------------- >>textures -- */

/* A new texture, bound: trilinear over `levels`, clamped. */
static inline GLuint gl_texture(GLenum target, int levels) {
    GLuint texture;
    gl.GenTextures(1, &texture);
    gl.BindTexture(target, texture);
    gl.TexParameteri(target, GL_TEXTURE_MIN_FILTER,
                     levels > 1 ? GL_LINEAR_MIPMAP_LINEAR : GL_LINEAR);
    gl.TexParameteri(target, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
    gl.TexParameteri(target, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
    gl.TexParameteri(target, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
    gl.TexParameteri(target, GL_TEXTURE_WRAP_R, GL_CLAMP_TO_EDGE);
    gl.TexParameteri(target, GL_TEXTURE_MAX_LEVEL, levels - 1);
    return texture;
}

static inline GLenum gl_target_of(const envmap *map) {
    return map->mapping == ENVMAP_CUBE ? GL_TEXTURE_CUBE_MAP : GL_TEXTURE_2D_ARRAY;
}

/* A level of a sphere map with the texels outside the circle as OpenGL needs them: copies of the
   nearest inside. (envmap_lookup never reads them.) NULL: no memory. */
static inline float *gl_rimmed(const envmap *map, int level, int edge) {
    float *out = (float *)malloc((size_t)edge * (size_t)edge * 3 * sizeof(float));
    int i;
    for (i = 0; i < edge * edge && out; i++) {
        float size = (float)edge, X = (2 * (float)(i % edge) + 1) / size - 1;
        float Y = (2 * (float)(i / edge) + 1) / size - 1, r = hypotf(X, Y);
        float inside = r > 1 ? (1 - 1.5f / size) / r : 1;
        memcpy(out + 3 * i,
               envmap_texel(map, level, 0, 0, (int)((0.5f + 0.5f * X * inside) * size),
                            (int)((0.5f + 0.5f * Y * inside) * size)),
               3 * sizeof(float));
    }
    return out;
}

/* Slice 0 with all its levels: a cube, or an array whose layers are the map's faces. Row 0 of a map
   is row 0 of the texture, so v of envmap.h is t of OpenGL, also on the cube's faces. */
static inline GLuint gl_map(const envmap *map) {
    GLenum target = gl_target_of(map);
    GLuint texture = gl_texture(target, map->levels);
    int l, f, faces = envmap_faces(map->mapping);
    for (l = 0; l < map->levels; l++) {
        int edge = map->size >> l > 1 ? map->size >> l : 1;
        int width = map->mapping == ENVMAP_LATLONG ? 2 * edge : edge;
        float *rimmed = map->mapping == ENVMAP_SPHERE ? gl_rimmed(map, l, edge) : NULL;
        if (target == GL_TEXTURE_2D_ARRAY)
            gl.TexImage3D(target, l, GL_RGB32F, width, edge, faces, 0, GL_RGB, GL_FLOAT,
                          rimmed ? rimmed : envmap_texel(map, l, 0, 0, 0, 0));
        free(rimmed);
        for (f = 0; f < faces && target == GL_TEXTURE_CUBE_MAP; f++)
            gl.TexImage2D(GL_TEXTURE_CUBE_MAP_POSITIVE_X + (GLenum)f, l, GL_RGB32F, edge, edge, 0,
                          GL_RGB, GL_FLOAT, envmap_texel(map, l, 0, f, 0, 0));
    }
    return texture;
}

/* One face of every slice as a 3D texture: (u, v, (p - p0) / (p1 - p0)). */
static inline GLuint gl_volume(const envmap *map, int face) {
    GLuint texture = gl_texture(GL_TEXTURE_3D, 1);
    int s;
    gl.TexImage3D(GL_TEXTURE_3D, 0, GL_RGB32F, map->size, map->size, map->slices, 0, GL_RGB,
                  GL_FLOAT, NULL);
    for (s = 0; s < map->slices; s++)
        gl.TexSubImage3D(GL_TEXTURE_3D, 0, 0, 0, s, map->size, map->size, 1, GL_RGB, GL_FLOAT,
                         envmap_texel(map, 0, s, face, 0, 0));
    return texture;
}

/* --------------------------------------------------------------------------------- >>targets -- */

typedef struct gl_target {
    GLuint frame, colour, depth;
    int width, height;
} gl_target;

/* Returns 1 if the driver can draw into such a format. */
static inline int gl_target_create(gl_target *t, int width, int height, GLenum format) {
    t->width = width, t->height = height;
    t->colour = gl_texture(GL_TEXTURE_2D, 1);
    gl.TexImage2D(GL_TEXTURE_2D, 0, (GLint)format, width, height, 0, GL_RGBA, GL_FLOAT, NULL);
    gl.GenRenderbuffers(1, &t->depth);
    gl.BindRenderbuffer(GL_RENDERBUFFER, t->depth);
    gl.RenderbufferStorage(GL_RENDERBUFFER, GL_DEPTH_COMPONENT24, width, height);
    gl.GenFramebuffers(1, &t->frame);
    gl.BindFramebuffer(GL_FRAMEBUFFER, t->frame);
    gl.FramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, t->colour, 0);
    gl.FramebufferRenderbuffer(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER, t->depth);
    return gl.CheckFramebufferStatus(GL_FRAMEBUFFER) == GL_FRAMEBUFFER_COMPLETE;
}

static inline void gl_target_free(gl_target *t) {
    gl.DeleteFramebuffers(1, &t->frame);
    gl.DeleteRenderbuffers(1, &t->depth);
    gl.DeleteTextures(1, &t->colour);
    memset(t, 0, sizeof *t);
}

/* Draws there from now on, on black with alpha 0. */
static inline void gl_target_bind(const gl_target *t) {
    gl.BindFramebuffer(GL_FRAMEBUFFER, t->frame);
    gl.Viewport(0, 0, t->width, t->height);
    gl.ClearColor(0, 0, 0, 0);
    gl.Clear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
}

/* The frame as floats, RGBA, lowest row first. NULL: no memory. */
static inline float *gl_target_read(const gl_target *t) {
    float *rgba = (float *)malloc((size_t)t->width * (size_t)t->height * 4 * sizeof(float));
    gl.BindFramebuffer(GL_FRAMEBUFFER, t->frame);
    if (rgba) gl.ReadPixels(0, 0, t->width, t->height, GL_RGBA, GL_FLOAT, rgba);
    return rgba;
}

/* ------------------------------------------------------------------------------------- >>app -- */

/* The tone curve of picture.h and sRGB, as the mean of samples x samples points. */
static const char gl_develop[] =
    "in vec2 st;\n"
    "out vec4 colour;\n"
    "uniform sampler2D light;\n"
    "uniform int samples;\n"
    "uniform float exposure;\n"
    "void main() {\n"
    "    vec3 sum = vec3(0.0);\n"
    "    ivec2 corner = ivec2(gl_FragCoord.xy) * samples;\n"
    "    for (int i = 0; i < samples * samples; i++) {\n"
    "        vec3 x = texelFetch(light, corner + ivec2(i % samples, i / samples), 0).rgb;\n"
    "        x = clamp(0.8 * exposure * x, 0.0, 1e4);\n"
    "        sum += min(x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14), 1.0);\n"
    "    }\n"
    "    vec3 y = sum / float(samples * samples);\n"
    "    colour = vec4(mix(1.055 * pow(y, vec3(1.0 / 2.4)) - 0.055, 12.92 * y,\n"
    "                      lessThanEqual(y, vec3(0.0031308))), 1.0);\n"
    "}\n";

typedef struct gl_app {
    const char *name, *out; /* out: the picture to write; NULL: a window                          */
    int width, height, samples, frames;
    float exposure;
    float yaw, pitch, distance,
        tangent;  /* of the camera, rad; tangent of half its field of view  */
    float aspect; /* width / height of what is drawn into                   */
    float at[3], eye[3], view[16], camera[16]; /* written by gl_frame                             */
    double seconds, began, took; /* since the start; the frame's beginning; a frame, smoothed     */
    gl_target frame;
    GLuint develop, array;
    picture shot; /* of the last frame, once headless has drawn it */
    EGLDisplay display;
    EGLContext context;
    void *window;
    float pointer[2];
    float slide;        /* since the last frame, with the right button: widths of the window */
    int key;            /* pressed since the last frame: a letter in upper case, or 0 */
    const char *keys;   /* that --keys has left to press before a picture is drawn */
    char caption[512];  /* lines of text at the lower left */
    char lettered[512]; /* what of it is in the texture */
    GLuint words, letter;
    int words_width, words_height;
    char dropped[4096]; /* a file, since the last frame */
} gl_app;

static inline double gl_seconds(void) {
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static inline gl_function gl_find_egl(const char *name) { return eglGetProcAddress(name); }

/* A context without a surface: Mesa's platform where there is one, else the default display. */
static inline int gl_open_headless(gl_app *app) {
    static const EGLint config[] = {EGL_RENDERABLE_TYPE, EGL_OPENGL_BIT, EGL_SURFACE_TYPE, 0,
                                    EGL_NONE};
    static const EGLint context[] = {EGL_CONTEXT_MAJOR_VERSION,
                                     3,
                                     EGL_CONTEXT_MINOR_VERSION,
                                     3,
                                     EGL_CONTEXT_OPENGL_PROFILE_MASK,
                                     EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT,
                                     EGL_CONTEXT_OPENGL_DEBUG,
                                     EGL_TRUE,
                                     EGL_NONE};
    PFNEGLGETPLATFORMDISPLAYEXTPROC platform =
        (PFNEGLGETPLATFORMDISPLAYEXTPROC)eglGetProcAddress("eglGetPlatformDisplayEXT");
    EGLConfig chosen;
    EGLint count = 0;
    if (platform) app->display = platform(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, NULL);
    if (!app->display) app->display = eglGetDisplay(EGL_DEFAULT_DISPLAY);
    if (!app->display || !eglInitialize(app->display, NULL, NULL)) return 0;
    if (eglBindAPI(EGL_OPENGL_API) && eglChooseConfig(app->display, config, &chosen, 1, &count) &&
        count > 0)
        app->context = eglCreateContext(app->display, chosen, EGL_NO_CONTEXT, context);
    if (app->context &&
        eglMakeCurrent(app->display, EGL_NO_SURFACE, EGL_NO_SURFACE, app->context) &&
        gl_load(gl_find_egl))
        return 1;
    eglTerminate(app->display);
    return 0;
}

#ifdef GL_WINDOW
static inline gl_function gl_find_glfw(const char *name) { return glfwGetProcAddress(name); }

static inline void gl_on_move(GLFWwindow *window, double x, double y) {
    gl_app *app = (gl_app *)glfwGetWindowUserPointer(window);
    float dx = (float)x - app->pointer[0], dy = (float)y - app->pointer[1];
    if (glfwGetMouseButton(window, GLFW_MOUSE_BUTTON_LEFT) == GLFW_PRESS) {
        app->yaw -= 0.008f * dx;
        app->pitch = fminf(fmaxf(app->pitch + 0.008f * dy, -1.5f), 1.5f);
    }
    if (glfwGetMouseButton(window, GLFW_MOUSE_BUTTON_RIGHT) == GLFW_PRESS)
        app->slide += dx / (float)app->width;
    app->pointer[0] = (float)x, app->pointer[1] = (float)y;
}
static inline void gl_on_wheel(GLFWwindow *window, double x, double y) {
    gl_app *app = (gl_app *)glfwGetWindowUserPointer(window);
    (void)x;
    app->distance = fminf(fmaxf(app->distance * expf(-0.1f * (float)y), 1.5f), 40.0f);
}
static inline void gl_on_key(GLFWwindow *window, int key, int code, int action, int mods) {
    gl_app *app = (gl_app *)glfwGetWindowUserPointer(window);
    (void)code, (void)mods;
    if (key == GLFW_KEY_ESCAPE) glfwSetWindowShouldClose(window, 1);
    if (action != GLFW_RELEASE && key < 128) app->key = key;
}
static inline void gl_on_drop(GLFWwindow *window, int count, const char **paths) {
    gl_app *app = (gl_app *)glfwGetWindowUserPointer(window);
    if (count > 0) snprintf(app->dropped, sizeof app->dropped, "%s", paths[0]);
}

static inline int gl_open_window(gl_app *app) {
    GLFWwindow *window;
    if (!glfwInit()) return 0;
    glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 3);
    glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 3);
    glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
    glfwWindowHint(GLFW_OPENGL_FORWARD_COMPAT, 1);
    glfwWindowHint(GLFW_OPENGL_DEBUG_CONTEXT, 1);
    glfwWindowHint(GLFW_RESIZABLE, 0);
    window = glfwCreateWindow(app->width, app->height, app->name, NULL, NULL);
    if (window) glfwMakeContextCurrent(window);
    if (!window || !gl_load(gl_find_glfw)) {
        glfwTerminate();
        return 0;
    }
    app->window = window;
    glfwSetWindowUserPointer(window, app);
    glfwSetCursorPosCallback(window, gl_on_move);
    glfwSetScrollCallback(window, gl_on_wheel);
    glfwSetKeyCallback(window, gl_on_key);
    glfwSetDropCallback(window, gl_on_drop);
    return 1;
}
#endif

/* After a context: what every frame needs. Returns 1 if it is there. */
static inline int gl_begin(gl_app *app) {
    gl.Enable(GL_DEPTH_TEST);
    gl.Enable(GL_TEXTURE_CUBE_MAP_SEAMLESS);
    gl.PixelStorei(GL_PACK_ALIGNMENT, 1);
    gl.PixelStorei(GL_UNPACK_ALIGNMENT, 1);
    gl.GenVertexArrays(1, &app->array);
    app->develop = gl_program(gl_cover, gl_develop);
    return app->develop && gl_target_create(&app->frame, app->width * app->samples,
                                            app->height * app->samples, GL_RGBA32F);
}

/* Opens a window, or with --headless out.png, or without a display, none. Returns 0 when there is
   no OpenGL 3.3, after saying so; other arguments are the caller's. */
static inline int gl_open(gl_app *app, const char *name, int width, int height, int argc,
                          char **argv) {
    int i, open = 0;
    memset(app, 0, sizeof *app);
    app->name = name, app->width = width, app->height = height;
    app->aspect = (float)width / (float)height;
    app->exposure = 1, app->distance = 3.9f, app->tangent = 0.36f, app->samples = 2;
    app->keys = "", app->yaw = 0.45f, app->pitch = 0.2f;
    for (i = 1; i + 1 < argc; i++) {
        if (!strcmp(argv[i], "--headless")) app->out = argv[i + 1];
        if (!strcmp(argv[i], "--keys")) app->keys = argv[i + 1];
    }
#ifdef GL_WINDOW
    if (!app->out) open = gl_open_window(app);
#endif
    if (!open) {
        static char path[256];
        snprintf(path, sizeof path, "%s.png", name);
        if (!app->out) {
            app->out = path;
            printf("no window here; writing %s\n", path);
        }
        app->samples = 3;
        open = gl_open_headless(app);
    }
    if (!open) fprintf(stderr, "%s: no OpenGL 3.3 here (Debian: libegl1 libgl1-mesa-dri)\n", name);
    if (open && !gl_begin(app)) {
        fprintf(stderr, "%s: this OpenGL cannot draw into floats\n", name);
        return 0;
    }
    return open;
}

/* The camera's matrices, from yaw (0: from +z, growing towards +x), pitch, distance. */
static inline void gl_orbit(gl_app *app) {
    float projection[16], d = app->distance;
    app->eye[0] = app->at[0] + d * cosf(app->pitch) * sinf(app->yaw);
    app->eye[1] = app->at[1] + d * sinf(app->pitch);
    app->eye[2] = app->at[2] + d * cosf(app->pitch) * cosf(app->yaw);
    mesh_look(app->view, app->eye, app->at);
    mesh_perspective(projection, app->tangent, app->aspect, 0.02f * d, 20 * d);
    mesh_multiply(app->camera, projection, app->view);
}

/* Draws into a part of the picture from now on, a view of its own; pixels from the top left. */
static inline void gl_area(gl_app *app, int x, int y, int width, int height) {
    int k = app->samples;
    app->aspect = (float)width / (float)height;
    gl.Viewport(k * x, k * (app->height - y - height), k * width, k * height);
    gl_orbit(app);
}

/* The same for cell (column, row) of a grid, row 0 on top. */
static inline void gl_cell(gl_app *app, int column, int row, int columns, int rows) {
    int width = app->width / columns, height = app->height / rows;
    gl_area(app, column * width, row * height, width, height);
}

/* Returns 1 when another frame is to be drawn, into the target that is then bound. */
static inline int gl_frame(gl_app *app) {
    static double start;
    app->began = gl_seconds();
    if (!app->frames) start = app->began;
    app->key = *app->keys ? *app->keys++ : 0, app->dropped[0] = 0, app->slide = 0;
#ifdef GL_WINDOW
    if (app->window) {
        glfwPollEvents();
        if (glfwWindowShouldClose((GLFWwindow *)app->window)) return 0;
    }
#endif
    if (!app->window && app->shot.rgb) return 0;
    app->seconds = app->window ? gl_seconds() - start : 0;
    gl_orbit(app);
    gl_target_bind(&app->frame);
    return 1;
}

/* Through the tone curve into the frame buffer that is bound. */
static inline void gl_develop_frame(gl_app *app) {
    gl.UseProgram(app->develop);
    gl_sampler(app->develop, "light", 0, GL_TEXTURE_2D, app->frame.colour);
    gl_int(app->develop, "samples", app->samples);
    gl_float(app->develop, "exposure", app->exposure);
    gl.Viewport(0, 0, app->width, app->height);
    gl.Disable(GL_DEPTH_TEST);
    gl.BindVertexArray(app->array);
    gl.DrawArrays(GL_TRIANGLES, 0, 3);
    gl.Enable(GL_DEPTH_TEST);
}

#define GL_TEXT_LINE 26 /* pixels between lines of a caption */

/* Writes the caption into a picture, its first line at (x,y), on darkened ground. */
static inline void gl_write(picture *p, const char *caption, int x, int y) {
    char line[256];
    for (; *caption; y += GL_TEXT_LINE) {
        size_t n = strcspn(caption, "\n"), kept = n < sizeof line ? n : sizeof line - 1;
        memcpy(line, caption, kept);
        line[kept] = 0;
        if (kept)
            picture_rectangle(p, x - 7, y - 6, (int)picture_text_width(line, 13) + 14, 26, 0,
                              0.55f);
        picture_text(p, (float)x, (float)y, 13, 0xFFFFFFu, line);
        caption += n + (caption[n] != 0);
    }
}

/* Lines of a caption, and the width of the longest. */
static inline int gl_caption_lines(const char *caption, float *width) {
    int lines = 0;
    char line[256];
    for (*width = 0;; lines++) {
        size_t n = strcspn(caption, "\n"), kept = n < sizeof line ? n : sizeof line - 1;
        memcpy(line, caption, kept);
        line[kept] = 0;
        *width = fmaxf(*width, picture_text_width(line, 13));
        if (!caption[n]) return lines + 1;
        caption += n + 1;
    }
}

static const char gl_words[] = "in vec2 st;\n"
                               "out vec4 colour;\n"
                               "uniform sampler2D words;\n"
                               "void main() { colour = vec4(textureLod(words,\n"
                               "    vec2(st.x, 1.0 - st.y), 0.0).rgb, 0.8); }\n";

/* The caption over what the window shows; its letters are drawn again only when they change. */
static inline void gl_caption_draw(gl_app *app) {
    if (!app->caption[0]) return;
    if (strcmp(app->caption, app->lettered)) {
        picture p;
        float width;
        int lines = gl_caption_lines(app->caption, &width);
        if (!picture_create(&p, (int)width + 36, lines * GL_TEXT_LINE + 22)) return;
        picture_rectangle(&p, 0, 0, p.width, p.height, 0x15171Cu, 1);
        gl_write(&p, app->caption, 18, 18);
        gl.DeleteTextures(1, &app->words);
        app->words = gl_texture(GL_TEXTURE_2D, 1);
        gl.TexImage2D(GL_TEXTURE_2D, 0, GL_RGB8, p.width, p.height, 0, GL_RGB, GL_UNSIGNED_BYTE,
                      p.rgb);
        app->words_width = p.width, app->words_height = p.height;
        picture_free(&p);
        memcpy(app->lettered, app->caption, sizeof app->lettered);
    }
    if (!app->letter) app->letter = gl_program(gl_cover, gl_words);
    gl.UseProgram(app->letter);
    gl_sampler(app->letter, "words", 0, GL_TEXTURE_2D, app->words);
    gl.Viewport(0, 0, app->words_width, app->words_height);
    gl.Disable(GL_DEPTH_TEST);
    gl.Enable(GL_BLEND);
    gl.BlendFunc(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA);
    gl.BindVertexArray(app->array);
    gl.DrawArrays(GL_TRIANGLES, 0, 3);
    gl.Disable(GL_BLEND);
    gl.Enable(GL_DEPTH_TEST);
}

/* What is in the frame as a picture (to be freed). Returns 1 if there is memory. */
static inline int gl_shoot(gl_app *app, picture *out) {
    gl_target eight;
    size_t row = 3 * (size_t)app->width;
    int y, good = 0;
    unsigned char *pixels = (unsigned char *)malloc(row * (size_t)app->height);
    if (gl_target_create(&eight, app->width, app->height, GL_RGBA8) && pixels &&
        picture_create(out, app->width, app->height)) {
        gl_target_bind(&eight);
        gl_develop_frame(app);
        gl.ReadPixels(0, 0, app->width, app->height, GL_RGB, GL_UNSIGNED_BYTE, pixels);
        for (y = 0; y < app->height; y++)
            memcpy(out->rgb + row * (size_t)y, pixels + row * (size_t)(app->height - 1 - y), row);
        good = 1;
    }
    gl_target_free(&eight);
    free(pixels);
    return good;
}

/* Ends a frame: shows it, or (headless, all keys pressed) leaves it in app->shot. */
static inline void gl_show(gl_app *app) {
    double took;
    float width;
    app->frames++;
    if (app->window) {
        gl.BindFramebuffer(GL_FRAMEBUFFER, 0);
        gl_develop_frame(app);
        gl_caption_draw(app);
#ifdef GL_WINDOW
        glfwSwapBuffers((GLFWwindow *)app->window);
#endif
    } else if (!*app->keys) {
        gl.Finish();
        if (!gl_shoot(app, &app->shot)) gl_errors++;
        else
            gl_write(&app->shot, app->caption, 24,
                     app->height - 8 - GL_TEXT_LINE * gl_caption_lines(app->caption, &width));
    }
    took = gl_seconds() - app->began;
    app->took = app->frames > 1 ? app->took + 0.1 * (took - app->took) : took;
}

/* Writes the picture, if there is one, and ends. Returns the program's exit status: 0 when no
   error was reported. */
static inline int gl_close(gl_app *app) {
    if (app->shot.rgb && !picture_save(&app->shot, app->out)) {
        fprintf(stderr, "%s: cannot write %s\n", app->name, app->out);
        gl_errors++;
    }
    if (app->shot.rgb) picture_free(&app->shot);
    gl_target_free(&app->frame);
    gl.DeleteProgram(app->develop);
    gl.DeleteProgram(app->letter);
    gl.DeleteTextures(1, &app->words);
    gl.DeleteVertexArrays(1, &app->array);
    if (gl.GetError() != GL_NO_ERROR) gl_errors++;
#ifdef GL_WINDOW
    if (app->window) {
        glfwTerminate();
        return gl_errors != 0;
    }
#endif
    eglMakeCurrent(app->display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
    eglDestroyContext(app->display, app->context);
    /* The display stays until the process ends: terminating it unloads Mesa's driver, and what that
       keeps for itself would count as leaked. */
    return gl_errors != 0;
}

/* The environment behind everything; `turn` takes world directions to those of the map. */
static const char gl_sky[] = "in vec2 st;\n"
                             "out vec4 colour;\n"
                             "uniform samplerCube sky;\n"
                             "uniform mat4 view;\n"
                             "uniform vec3 lens;\n" /* tangents of half the fields of view */
                             "uniform mat3 turn;\n"
                             "void main() {\n"
                             "    vec3 d = vec3((2.0 * st - 1.0) * lens.xy, -1.0) * mat3(view);\n"
                             "    colour = vec4(textureLod(sky, turn * d, 0.0).rgb, 0.0);\n"
                             "}\n";

static inline void gl_draw_sky(const gl_app *app, GLuint program, GLuint cube,
                               const float turn[9]) {
    float lens[3];
    lens[0] = app->tangent * app->aspect, lens[1] = app->tangent, lens[2] = 0;
    gl.UseProgram(program);
    gl_sampler(program, "sky", 0, GL_TEXTURE_CUBE_MAP, cube);
    gl_mat4(program, "view", app->view);
    gl_vec3(program, "lens", lens);
    gl_mat3(program, "turn", turn);
    gl.DepthFunc(GL_LEQUAL);
    gl.BindVertexArray(app->array);
    gl.DrawArrays(GL_TRIANGLES, 0, 3);
    gl.DepthFunc(GL_LESS);
}

#endif /* GL_H */
