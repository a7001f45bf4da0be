/* SPDX-License-Identifier: MIT
   The shaders of docs/shaders.md, as they stand there, against the library. Every pixel of a frame
   is a direction d (a lat-long map); numbers are written into the text, so there are no uniforms
   but textures. HLSL goes to SPIR-V and on to GLSL by glslangValidator and spirv-cross. Without EGL at
   compile time, or without a driver, the page's blocks are only looked for. */
#define _POSIX_C_SOURCE 200809L
#include "oracle.h"
#include "examples/tool/scenes.h"
#ifdef TEST_ROOT /* the project's folder: a test may be started in any other */
#include <unistd.h>
#endif
#ifdef TEST_GL
#include <stdarg.h>
#include "examples/gl/gl.h"
#endif

#define ROOM 20000

/* The text of the page's block in this language; its length, 0 when there is none. */
static size_t block(char text[ROOM], const char *language) {
    char line[256], fence[32];
    FILE *page = fopen("docs/shaders.md", "r");
    size_t length = 0;
    int inside = 0;
    snprintf(fence, sizeof fence, "```%s\n", language);
    text[0] = 0;
    while (page && fgets(line, sizeof line, page)) {
        size_t more = strlen(line);
        if (inside && !strncmp(line, "```", 3)) break;
        if (inside && length + more < ROOM) memcpy(text + length, line, more + 1), length += more;
        inside = inside || !strcmp(line, fence);
    }
    if (page) fclose(page);
    return length;
}

static void the_page_has_both_languages(void) {
    static char text[ROOM];
#ifdef TEST_ROOT
    CHECK(chdir(TEST_ROOT) == 0);
#endif
    CHECK(block(text, "glsl") > 1000 && strstr(text, "env_elliptical"));
    CHECK(block(text, "hlsl") > 1000 && strstr(text, "env_elliptical"));
}

#ifdef TEST_GL
enum { EDGE = 96, LEVELS = 5, TABLE = 64, SLICES = 24, TAPS = 32, KINDS = 5 };

static gl_app app;
static envmap chain, strokes, rounded;
static envmap_lobe ring;
static float table[2 * TABLE * TABLE], packed[28], fan[TAPS][2];
static int taps;
static double sh[27];
static const float eye[3] = {0.36f, 0.48f, 0.8f}, across[3] = {0.6f, 0, -0.8f};
static const float albedo[3] = {0.5f, 0.3f, 0.2f}, f0[3] = {0.9f, 0.6f, 0.04f};
static const float roughness = 0.37f;

/* What each kind of frame shows of direction d, in GLSL; HLSL has float3 for vec3 and samplers. */
static const char *const shown_glsl[KINDS] = {
    "env_reflection(chain, 5.0, d, 0.37)", "env_diffuse(sh, d)",
    "env_lit(chain, 5.0, table, sh, d, eye, 0.37, albedo, f0)", "env_banks(front, back, d, eye)",
    "env_elliptical(round_map, fan, taps, d, across, eye)"};
static const char *const shown_hlsl[KINDS] = {
    "env_reflection(chain, smooth, 5.0, d, 0.37)", "env_diffuse(sh, d)",
    "env_lit(chain, smooth, 5.0, table, sh, d, eye, 0.37, albedo, f0)",
    "env_banks(front, back, smooth, 32.0, d, eye)",
    "env_elliptical(round_map, smooth, fan, taps, d, across, eye)"};
static const char *const kind_names[KINDS] = {"chain", "nine numbers", "split sum", "Banks",
                                              "elliptical"};
static const double bounds[KINDS] = {1e-5, 1e-5, 5e-4, 1e-5, 1e-5};

static void make_maps(void) {
    envmap sky = {0};
    envmap_lobe lobes[LEVELS], diffuse = envmap_lobe_diffuse(), gaussian = envmap_lobe_gaussian(60);
    float offsets[TAPS], weights[TAPS];
    CHECK(!envmap_create(&sky, ENVMAP_LATLONG, 64, 1, 1));
    scene_fill(&sky, SCENE_STUDIO);
    for (int l = 0; l < LEVELS; ++l) {
        double r = envmap_level_roughness(l, LEVELS, 0);
        lobes[l] = envmap_lobe_ggx((float)(r * r));
    }
    ring = envmap_lobe_banks(0.8f);
    CHECK(!envmap_create(&chain, ENVMAP_CUBE, 64, LEVELS, 1));
    CHECK(!envmap_filter_chain(&chain, &sky, lobes, LEVELS, NULL));
    CHECK(!envmap_create(&strokes, ENVMAP_PARABOLOID, 32, 1, SLICES));
    CHECK(!envmap_filter(&strokes, &sky, &ring, NULL));
    CHECK(!envmap_create(&rounded, ENVMAP_CUBE, 64, 1, 1));
    CHECK(!envmap_filter(&rounded, &sky, &gaussian, NULL));
    CHECK(!envmap_sh_project(sh, 3, &sky, 0, 0, NULL));
    CHECK(!envmap_sh_convolve(sh, sh, 3, &diffuse, 0) && !envmap_sh_pack(NULL, packed, sh));
    CHECK(!envmap_ggx_table(table, TABLE, NULL));
    taps = envmap_fan(offsets, weights, TAPS, 0.4, envmap_lobe_sigma(&gaussian, 0), 0.05);
    CHECK(taps > 2 && taps <= TAPS);
    for (int i = 0; i < taps; ++i) fan[i][0] = offsets[i], fan[i][1] = weights[i];
    envmap_free(&sky);
}

static float dot3(const float a[3], const float b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void lit(float rgb[3], const float d[3], double E[3]) {
    double scale, bias, nv = (double)dot3(d, eye);
    float r[3], light[3];
    for (int i = 0; i < 3; ++i) r[i] = 2 * (float)nv * d[i] - eye[i];
    envmap_lookup(light, &chain, r, roughness * (LEVELS - 1));
    envmap_ggx_split_sum(&scale, &bias, nv, (double)roughness * (double)roughness);
    for (int i = 0; i < 3; ++i) {
        double f = (double)f0[i], once = f * scale + bias,
               more = envmap_ggx_multiple(f, scale, bias);
        rgb[i] = (float)(once * (double)light[i] +
                         (more + (double)albedo[i] * (1 - once - more)) * E[i]);
    }
}

/* The library's answer for direction d; 0 where the eye sees the surface too flat, or from behind. */
static int expected(float rgb[3], int kind, const float d[3]) {
    double E[3], wide[3] = {(double)d[0], (double)d[1], (double)d[2]};
    float offsets[TAPS], weights[TAPS];
    if ((kind == 2 || kind == 4) && dot3(d, eye) < 0.1f) return 0;
    CHECK(!envmap_sh_evaluate(E, sh, 3, wide));
    for (int i = 0; i < 3; ++i) rgb[i] = (float)E[i];
    for (int i = 0; i < taps; ++i) offsets[i] = fan[i][0], weights[i] = fan[i][1];
    if (kind == 0) envmap_lookup(rgb, &chain, d, roughness * (LEVELS - 1));
    if (kind == 2) lit(rgb, d, E);
    if (kind == 3) envmap_lookup_slice(rgb, &strokes, d, dot3(d, eye), 0);
    if (kind == 4) envmap_lookup_fan(rgb, &rounded, d, across, eye, offsets, weights, taps);
    return 1;
}

/* Appends; the text has room for ROOM characters more. */
static void say(char *text, const char *format, ...) {
    va_list values;
    va_start(values, format);
    vsnprintf(text + strlen(text), ROOM, format, values);
    va_end(values);
}

/* An array constant: vec4[](vec4(...), ...) or {float4(...), ...}; without a name, one value. */
static void list(char *text, const char *type, const char *name, const float *values, int size,
                 int count) {
    say(text, name ? "    const %s %s[%d] = " : "", type, name, count);
    say(text, !name ? "" : type[0] == 'v' ? "%s[](" : "{", type);
    for (int i = 0; i < count; ++i) {
        say(text, "%s%s(", i ? ", " : "", type);
        for (int k = 0; k < size; ++k)
            say(text, k ? ", %.9e" : "%.9e", (double)values[size * i + k]);
        say(text, ")");
    }
    say(text, !name ? "" : type[0] == 'v' ? ");\n" : "};\n");
}

/* The frames' constants, and the direction d of the pixel at `at`, in [0,1]. */
static void constants(char *text, int hlsl) {
    static const char *const names[] = {"eye", "across", "albedo", "f0"};
    const float *const values[] = {eye, across, albedo, f0};
    const char *three = hlsl ? "float3" : "vec3";
    list(text, hlsl ? "float4" : "vec4", "sh", packed, 4, 7);
    list(text, hlsl ? "float2" : "vec2", "fan", fan[0], 2, TAPS);
    for (int i = 0; i < 4; ++i) {
        say(text, "    const %s %s = ", three, names[i]);
        list(text, three, NULL, values[i], 3, 1);
        say(text, ";\n");
    }
    say(text,
        "    const int taps = %d;\n"
        "    float phi = 6.283185307 * (at.x - 0.5), theta = 3.141592654 * at.y;\n"
        "    %s d = %s(sin(theta) * sin(phi), cos(theta), -sin(theta) * cos(phi));\n",
        taps, three, three);
}

static GLuint glsl_program(int kind) {
    static char text[3 * ROOM];
    block(text, "glsl");
    say(text,
        "uniform samplerCube chain, round_map;\nuniform sampler2D table;\n"
        "uniform sampler3D front, back;\nout vec4 colour;\nvoid main() {\n"
        "    vec2 at = gl_FragCoord.xy / %d.0;\n",
        EDGE);
    constants(text, 0);
    say(text, "    colour = vec4(%s, 1.0);\n}\n", shown_glsl[kind]);
    return gl_program(gl_cover, text);
}

static int write_file(const char *path, const char *text) {
    FILE *file = fopen(path, "w");
    int good = file && fputs(text, file) >= 0;
    return file && !fclose(file) && good;
}

/* The file without its first line, "#version 330", which gl_program has already. */
static void read_after_version(char *text, size_t room, const char *path) {
    FILE *file = fopen(path, "r");
    size_t got = file ? fread(text, 1, room - 1, file) : 0;
    text[got] = 0;
    if (file) fclose(file);
    char *line = strchr(text, '\n');
    if (line) memmove(text, line, strlen(line) + 1);
}

/* HLSL by way of SPIR-V; 0 when a tool says no. Names of textures become those of pairs of texture
   and sampler. */
static GLuint hlsl_program(int kind) {
    static char text[4 * ROOM];
    block(text, "hlsl");
    say(text,
        "TextureCube chain, round_map;\nTexture2D table;\nTexture3D front, back;\n"
        "SamplerState smooth;\nfloat4 main(float4 pixel : SV_Position) : SV_Target {\n"
        "    float2 at = pixel.xy / %d.0;\n",
        EDGE);
    constants(text, 1);
    say(text, "    return float4(%s, 1.0);\n}\n", shown_hlsl[kind]);
    if (!write_file("build/page.hlsl", text) ||
        system("glslangValidator -D -V -S frag -e main build/page.hlsl -o build/page.spv "
               ">build/page.log && spirv-cross build/page.spv --version 330 --no-es "
               "--no-420pack-extension --output build/page.glsl"))
        return 0;
    read_after_version(text, sizeof text, "build/page.glsl");
    return gl_program(gl_cover, text);
}

static void bind(GLuint use, const char *name, int unit, GLenum target, GLuint texture) {
    char paired[80];
    snprintf(paired, sizeof paired, "SPIRV_Cross_Combined%ssmooth", name);
    gl_sampler(use, name, unit, target, texture);
    gl_sampler(use, paired, unit, target, texture);
}

static GLuint textures[5];

static void make_textures(void) {
    textures[0] = gl_map(&chain), textures[1] = gl_map(&rounded);
    textures[2] = gl_texture(GL_TEXTURE_2D, 1);
    gl.TexImage2D(GL_TEXTURE_2D, 0, GL_RG32F, TABLE, TABLE, 0, GL_RG, GL_FLOAT, table);
    textures[3] = gl_volume(&strokes, 0), textures[4] = gl_volume(&strokes, 1);
}

/* Mean of |card - library| over the mean of the library, of the directions that the kind shows. */
static double frame_error(GLuint use, int kind) {
    double miss = 0, all = 0;
    gl_target_bind(&app.frame);
    gl.UseProgram(use);
    gl.BindVertexArray(app.array);
    bind(use, "chain", 0, GL_TEXTURE_CUBE_MAP, textures[0]);
    bind(use, "round_map", 1, GL_TEXTURE_CUBE_MAP, textures[1]);
    bind(use, "table", 2, GL_TEXTURE_2D, textures[2]);
    bind(use, "front", 3, GL_TEXTURE_3D, textures[3]);
    bind(use, "back", 4, GL_TEXTURE_3D, textures[4]);
    gl.DrawArrays(GL_TRIANGLES, 0, 3);
    float *rgba = gl_target_read(&app.frame);
    for (int i = 0; rgba && i < EDGE * EDGE; ++i) {
        float d[3], rgb[3];
        envmap_direction(d, ENVMAP_LATLONG, 0, ((float)(i % EDGE) + 0.5f) / EDGE,
                         ((float)(i / EDGE) + 0.5f) / EDGE);
        if (!expected(rgb, kind, d)) continue;
        for (int c = 0; c < 3; ++c) {
            miss += fabs((double)rgba[4 * i + c] - (double)rgb[c]);
            all += fabs((double)rgb[c]);
        }
    }
    free(rgba);
    return miss / all;
}

static void check_programs(GLuint (*make)(int kind), const char *language) {
    for (int kind = 0; kind < KINDS; ++kind) {
        char what[80];
        GLuint made = make(kind);
        snprintf(what, sizeof what, "%s, %s: mean error", language, kind_names[kind]);
        CHECK(made != 0);
        if (made) FIGURE(what, frame_error(made, kind), bounds[kind]);
        gl.DeleteProgram(made);
    }
}

static void the_page_s_glsl_is_the_library(void) { check_programs(glsl_program, "GLSL"); }

static void the_page_s_hlsl_is_the_library(void) { check_programs(hlsl_program, "HLSL"); }

static void no_error_was_reported(void) { CHECK(gl.GetError() == GL_NO_ERROR && gl_errors == 0); }

static void run_gl(void) {
    static char flag[] = "--headless", out[] = "unused.png";
    char *arguments[] = {flag, flag, out, NULL};
    if (!gl_open(&app, "test_shaders", EDGE, EDGE, 3, arguments)) {
        printf("    the shaders passed by: no OpenGL 3.3 (Debian: libegl1 libgl1-mesa-dri)\n");
        return;
    }
    gl_target_free(&app.frame);
    CHECK(gl_target_create(&app.frame, EDGE, EDGE, GL_RGBA32F));
    make_maps();
    make_textures();
    RUN(the_page_s_glsl_is_the_library);
    if (!system("command -v glslangValidator >/dev/null && command -v spirv-cross >/dev/null"))
        RUN(the_page_s_hlsl_is_the_library);
    else printf("    HLSL passed by: no compiler here (Debian: glslang-tools spirv-cross)\n");
    RUN(no_error_was_reported);
    envmap_free(&chain), envmap_free(&strokes), envmap_free(&rounded);
    gl_close(&app);
}
#endif

int main(void) {
    RUN(the_page_has_both_languages);
#ifdef TEST_GL
    run_gl();
#else
    printf("    the shaders passed by: no EGL headers (Debian: libegl-dev libgl-dev)\n");
#endif
    return test_summary();
}
