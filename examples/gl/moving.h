/* moving.h - a stage with three balls that move around an object: what an environment that is
   captured in every frame is made of.

   Include after stage.h and capture.h. What you will see: `one_pass` and `per_frame`.

   SPDX-License-Identifier: MIT */

#ifndef MOVING_H
#define MOVING_H

typedef struct moving {
    GLuint sky, balls; /* programs */
    gl_mesh ball;
    float glow; /* of the balls, times their colours: 0 is lit by the stage alone */
} moving;

static const char moving_sky[] = "in vec2 st;\n"
                                 "out vec4 colour;\n"
                                 "uniform samplerCube sky;\n"
                                 "uniform mat3 face;\n" /* columns S, T, M */
                                 "void main() {\n"
                                 "    vec3 d = face * vec3(2.0 * st - 1.0, 1.0);\n"
                                 "    colour = vec4(textureLod(sky, d, 0.0).rgb, 1.0);\n"
                                 "}\n";

static const char moving_ball[] =
    "in vec3 at, n, t;\n"
    "out vec4 colour;\n"
    "uniform vec4 sh[7];\n"
    "uniform vec3 albedo;\n"
    "uniform float glow;\n"
    "void main() {\n"
    "    colour = vec4(albedo * (max(nine(sh, normalize(n)), 0.0) + glow), 1.0);\n"
    "}\n";

/* Returns 1 when it worked. */
static inline int moving_create(moving *m, float glow) {
    m->sky = gl_program(gl_cover, moving_sky);
    m->balls = gl_program(gl_vertex, moving_ball);
    m->glow = glow;
    return m->sky && m->balls && gl_mesh_make(&m->ball, GL_BALL);
}

static inline void moving_free(moving *m) {
    gl_mesh_free(&m->ball);
    gl.DeleteProgram(m->sky);
    gl.DeleteProgram(m->balls);
}

/* The three balls, at their places of a moment. */
static inline void moving_draw(const moving *m, const stage *st, double seconds,
                               const float camera[16]) {
    static const float colours[3][3] = {
        {0.7f, 0.04f, 0.02f}, {0.03f, 0.1f, 0.6f}, {0.7f, 0.35f, 0.02f}};
    int k;
    gl.UseProgram(m->balls);
    gl_mat4(m->balls, "camera", camera);
    gl_vec4s(m->balls, "sh", st->sh, 7);
    gl_float(m->balls, "glow", m->glow);
    for (k = 0; k < 3; k++) {
        float a = (float)seconds * (0.5f + 0.1f * (float)k) + 2.1f * (float)k - 0.75f;
        float model[16] = {0.35f, 0, 0, 0, 0, 0.35f, 0, 0, 0, 0, 0.35f, 0, 0, 0, 0, 1};
        model[12] = 2.15f * sinf(a), model[13] = 0.5f * sinf(1.3f * a) + 0.35f;
        model[14] = 2.15f * cosf(a);
        gl_vec3(m->balls, "albedo", colours[k]);
        gl_mat4(m->balls, "model", model);
        gl_mesh_draw(&m->ball);
    }
}

/* Environment and balls of a moment into the six faces of level 0. */
static inline void moving_capture(const moving *m, const stage *st, const capture *to,
                                  double seconds) {
    float axes[9], camera[16];
    int face;
    for (face = 0; face < 6; face++) {
        capture_face(to, face, 0);
        gl.Clear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
        capture_axes(axes, face);
        capture_camera(camera, axes);
        moving_draw(m, st, seconds, camera);
        gl.UseProgram(m->sky);
        gl_sampler(m->sky, "sky", 0, GL_TEXTURE_CUBE_MAP, st->sky);
        gl_mat3(m->sky, "face", axes);
        gl.BindVertexArray(to->array);
        gl.DrawArrays(GL_TRIANGLES, 0, 3);
    }
}

#endif /* MOVING_H */
