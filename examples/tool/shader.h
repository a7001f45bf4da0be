/* shader.h - what `envmap sh sky.pfm --glsl` prints: nine coefficients and the function that
   evaluates them, for any GLSL or GLSL ES from 3.00 on. Test: the_printed_shader_*, in test_gl.c.

   SPDX-License-Identifier: MIT */

#ifndef SHADER_H
#define SHADER_H

#include <stdio.h>

#define SHADER_ROOM 2048 /* is enough */

/* packed  of envmap_sh_pack, convolved with the diffuse lobe. */
static inline void shader_diffuse(char out[SHADER_ROOM], const float packed[28]) {
    int k, n = snprintf(out, SHADER_ROOM,
                        "// irradiance / pi: times the albedo, it is the light that a diffuse "
                        "surface sends out.\n"
                        "// n: unit normal, right-handed, +y up\n"
                        "const vec4 sh[7] = vec4[7](\n");
    for (k = 0; k < 7; k++)
        n += snprintf(out + n, SHADER_ROOM - (size_t)n, "    vec4(%.9g, %.9g, %.9g, %.9g)%s\n",
                      (double)packed[4 * k], (double)packed[4 * k + 1], (double)packed[4 * k + 2],
                      (double)packed[4 * k + 3], k < 6 ? "," : ");");
    snprintf(out + n, SHADER_ROOM - (size_t)n,
             "vec3 diffuse_light(vec3 n) {\n"
             "    vec4 a = vec4(n, 1.0), b = n.xyzz * n.yzzx;\n"
             "    return vec3(dot(sh[0], a), dot(sh[1], a), dot(sh[2], a))\n"
             "         + vec3(dot(sh[3], b), dot(sh[4], b), dot(sh[5], b))\n"
             "         + sh[6].rgb * (n.x * n.x - n.y * n.y);\n}\n");
}

#endif /* SHADER_H */
