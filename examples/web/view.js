/* Draws with WebGL2: the sky behind, an object in front, every material by lookups in maps that the
   worker filtered. The numbers of a view have the order of web_view in web.c, whose functions are
   this fragment shader on the CPU.
   SPDX-License-Identifier: MIT */
const VIEW = [
  '' +
      'look',
  'yaw', 'pitch', 'distance', 'skyTurn', 'exposure', 'roughness', 'metal', 'blur', 'along',
  'across', 'sunX', 'sunY', 'sunZ', 'flux'
];
const TANGENT = 0.35; /* of half the vertical field of view */

const COMMON = `#version 300 es
precision highp float;
precision highp sampler2DArray;
uniform samplerCube chain, gloss;
uniform sampler2DArray discs;
uniform sampler2D sky;
uniform vec4 sun; /* direction, flux */
uniform float sunRadius;
uniform vec4 sh[7], fit[16];
uniform vec2 split[32], fan[64];
uniform float yaw, pitch, distance_, aspect, skyTurn, exposure, roughness, metal, blur, top;
uniform int look, taps, slices;
out vec4 colour;
vec3 turned(vec3 d) {
  float s = sin(skyTurn), c = cos(skyTurn);
  return vec3(c * d.x - s * d.z, d.y, s * d.x + c * d.z);
}
vec3 skyAt(vec3 d) { /* lat-long, and the sun's tent */
  vec2 at = vec2(0.5 + atan(d.x, -d.z) / 6.2831853, acos(clamp(d.y, -1.0, 1.0)) / 3.1415927);
  float angle = 2.0 * asin(min(0.5 * length(d - sun.xyz), 1.0));
  float glow = sun.w * max(0.0, 1.0 - angle / sunRadius) / (1.0471976 * sunRadius * sunRadius);
  return textureLod(sky, at, 0.0).rgb + vec3(1.1, 1.0, 0.8) * glow;
}
vec3 tone(vec3 x) { return pow(1.0 - exp(-max(x, 0.0) * exposure), vec3(1.0 / 2.2)); }
`;
const SKY_VERTEX = `#version 300 es
uniform float aspect;
out vec2 at;
void main() {
  vec2 p = vec2(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0);
  at = ${TANGENT} * p * vec2(aspect, 1.0);
  gl_Position = vec4(p, 0.999999, 1.0);
}`;
const SKY_FRAGMENT = COMMON + `
in vec2 at;
uniform mat3 camera;
void main() {
  vec3 d = turned(normalize(camera * vec3(at, -1.0)));
  vec3 soft = textureLod(chain, d, max(1.0, blur * top)).rgb;
  colour = vec4(tone(mix(soft, skyAt(d), max(0.0, 1.0 - blur * top))), 1.0);
}`;
const OBJECT_VERTEX = `#version 300 es
layout(location = 0) in vec3 point;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec3 tangent;
uniform mat3 spin, camera;
uniform vec3 eye;
uniform float aspect, size;
out vec3 at, n, t;
void main() {
  at = size * (spin * point), n = spin * normal, t = spin * tangent;
  vec3 p = transpose(camera) * (at - eye);
  float front = 0.1, back = 20.0;
  gl_Position = vec4(p.x / (${TANGENT} * aspect), p.y / ${TANGENT},
                     (-p.z * (back + front) - 2.0 * front * back) / (back - front), -p.z);
}`;
const OBJECT_FRAGMENT = COMMON + `
in vec3 at, n, t;
uniform vec3 eye;
vec3 nine(vec3 d) {
  vec4 a = vec4(d, 1.0), b = d.xyzz * d.yzzx;
  return max(vec3(dot(sh[0], a), dot(sh[1], a), dot(sh[2], a)) +
             vec3(dot(sh[3], b), dot(sh[4], b), dot(sh[5], b)) +
             sh[6].rgb * (d.x * d.x - d.y * d.y), 0.0);
}
float fresnel(float c) { /* index 1.5 */
  float g = sqrt(1.25 + c * c), a = (g - c) / (g + c);
  float b = (c * (g + c) - 1.0) / (c * (g - c) + 1.0);
  return 0.5 * a * a * (1.0 + b * b);
}
vec3 disc(vec3 d, float k) { /* a slice of a dual paraboloid */
  float back = d.z < 0.0 ? 1.0 : 0.0;
  vec2 p = d.xy / (1.0 + abs(d.z));
  return texture(discs, vec3(0.5 + 0.5 * p.x, 0.5 - 0.5 * p.y, 2.0 * k + back)).rgb;
}
vec3 sliced(vec3 d, float p) { /* p in [0,1] */
  float last = float(slices - 1), x = clamp(p * float(slices) - 0.5, 0.0, last), k = floor(x);
  return mix(disc(d, k), disc(d, min(k + 1.0, last)), x - k);
}
vec3 copper(vec3 N, vec3 V, float c) {
  float x = clamp(c * 16.0 - 0.5, 0.0, 15.0);
  int k = int(x);
  vec4 f = mix(fit[k], fit[min(k + 1, 15)], x - float(k));
  vec3 off = c * N - V;
  float s = length(off), psi = f.w * atan(s, c);
  return f.rgb * sliced(s > 1e-6 ? cos(psi) * N + sin(psi) / s * off : N, c);
}
vec3 elliptical(vec3 N, vec3 V, vec3 T) {
  vec3 along = normalize(cross(N, T)), sum = vec3(0.0);
  for (int i = 0; i < taps; i++) {
    vec3 h = cos(0.5 * fan[i].x) * N + sin(0.5 * fan[i].x) * along;
    sum += fan[i].y * textureLod(gloss, reflect(-V, h), 0.0).rgb;
  }
  return sum;
}
void main() {
  vec3 V = normalize(eye - at), N = normalize(n), T = normalize(t);
  if (dot(N, V) < 0.0) N = normalize(N - 1.001 * dot(N, V) * V); /* seen past its edge */
  float c = clamp(dot(N, V), 0.0, 1.0);
  N = turned(N), V = turned(V), T = turned(T);
  vec3 R = reflect(-V, N), L, lit = textureLod(chain, R, roughness * top).rgb;
  if (look == 1) L = textureLod(gloss, R, 0.0).rgb;
  else if (look == 2) L = 0.8 * nine(N);
  else if (look == 3) L = mix(vec3(0.50, 0.13, 0.07) * nine(N), lit, fresnel(c));
  else if (look == 4) {
    float x = clamp(c * 32.0 - 0.5, 0.0, 31.0);
    vec2 s = mix(split[int(x)], split[min(int(x) + 1, 31)], fract(x));
    vec3 f0 = mix(vec3(0.04), vec3(1.0, 0.77, 0.34), metal);
    L = lit * (f0 * s.x + s.y) + (1.0 - metal) * 0.6 * nine(N);
  } else if (look == 5) L = sliced(T, 0.5 + 0.5 * dot(V, T));
  else if (look == 6) L = copper(N, V, c);
  else if (look == 7) L = elliptical(N, V, T);
  else L = skyAt(R);
  colour = vec4(tone(L), 1.0);
}`;

function program(gl, vertex, fragment) {
  const made = gl.createProgram();
  for (const [type, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(type);
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw Error(gl.getShaderInfoLog(shader));
    gl.attachShader(made, shader);
  }
  gl.linkProgram(made);
  if (!gl.getProgramParameter(made, gl.LINK_STATUS)) throw Error(gl.getProgramInfoLog(made));
  const at = {};
  return {made, at: name => at[name] ??= gl.getUniformLocation(made, name)};
}

/* Right, up and backwards of an eye that looks at the middle, as columns; and where it is. */
function cameraOf(view) {
  const [sy, cy, sp, cp] =
      [Math.sin(view.yaw), Math.cos(view.yaw), Math.sin(view.pitch), Math.cos(view.pitch)];
  const z = [cp * sy, sp, cp * cy], x = [cy, 0, -sy];
  const y = [z[1] * x[2] - z[2] * x[1], z[2] * x[0] - z[0] * x[2], z[0] * x[1] - z[1] * x[0]];
  return {axes: [...x, ...y, ...z], eye: z.map(v => v * view.distance)};
}

/* NULL without WebGL2. `format` says in what the maps are. */
function createView(canvas) {
  const gl = canvas.getContext('webgl2', {antialias: true, preserveDrawingBuffer: true});
  if (!gl) return null;
  const linear = gl.getExtension('OES_texture_float_linear');
  const internal = linear ? gl.RGB32F : gl.RGB16F, most = linear ? 3e38 : 65504;
  const sky = program(gl, SKY_VERTEX, SKY_FRAGMENT),
        object = program(gl, OBJECT_VERTEX, OBJECT_FRAGMENT);
  const textures = {}, meshes = [], numbers = {};
  const empty = gl.createVertexArray();

  function texture(name, target, levels, size, layers, format = internal) {
    const key = [levels, size, layers].join(), flat = target === gl.TEXTURE_2D;
    if (textures[name]?.key === key) return gl.bindTexture(target, textures[name].made);
    if (textures[name]) gl.deleteTexture(textures[name].made);
    textures[name] = {key, target, made: gl.createTexture()};
    gl.bindTexture(target, textures[name].made);
    if (layers)
      gl.texStorage3D(target, levels, internal, size, size, layers);
    else
      gl.texStorage2D(target, levels, format, flat ? 2 * size : size, size);
    gl.texParameteri(
        target, gl.TEXTURE_MIN_FILTER, layers || flat ? gl.LINEAR : gl.LINEAR_MIPMAP_LINEAR);
    gl.texParameteri(target, gl.TEXTURE_MAG_FILTER, gl.LINEAR);
    gl.texParameteri(target, gl.TEXTURE_WRAP_S, flat ? gl.REPEAT : gl.CLAMP_TO_EDGE);
    gl.texParameteri(target, gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE);
  }
  const fitting = (texels, limit = most) => {
    if (limit < 3e38)
      for (let i = 0; i < texels.length; i++) texels[i] = Math.min(texels[i], limit);
    return texels;
  };
  gl.pixelStorei(gl.UNPACK_ALIGNMENT, 4);

  function faces(level, size, texels) {
    for (let f = 0; f < 6; f++)
      gl.texSubImage2D(
          gl.TEXTURE_CUBE_MAP_POSITIVE_X + f, level, 0, 0, size, size, gl.RGB, gl.FLOAT,
          fitting(texels).subarray(3 * size * size * f, 3 * size * size * (f + 1)));
  }
  const api = {
    format: linear ?
        '32-bit float maps' :
        'no linear lookups of 32-bit floats here: the maps are half floats, radiance up to 65504',
    sky(h, texels) { /* only looked at, so half floats do */
                     texture('sky', gl.TEXTURE_2D, 1, h, 0, gl.RGB16F);
                     gl.texSubImage2D(
                         gl.TEXTURE_2D, 0, 0, 0, 2 * h, h, gl.RGB, gl.FLOAT,
                         fitting(texels.slice(), 65504));
    },
    level(level, levels, size, texels) {
      texture('chain', gl.TEXTURE_CUBE_MAP, levels, size << level, 0);
      faces(level, size, texels);
    },
    map({size, sliced, slices, fit, fan}, texels) {
      if (!sliced)
        texture('gloss', gl.TEXTURE_CUBE_MAP, 1, size, 0), faces(0, size, texels);
      else {
        texture('discs', gl.TEXTURE_2D_ARRAY, 1, size, 2 * slices);
        gl.texSubImage3D(
            gl.TEXTURE_2D_ARRAY, 0, 0, 0, 0, size, size, 2 * slices, gl.RGB, gl.FLOAT,
            fitting(texels));
      }
      Object.assign(numbers, {slices}, fit && {fit}, fan && {fan});
    },
    set(more) {
      Object.assign(numbers, more);
    },
    mesh(kind, vertices, indices) {
      const array = gl.createVertexArray();
      gl.bindVertexArray(array);
      gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
      gl.bufferData(gl.ARRAY_BUFFER, vertices, gl.STATIC_DRAW);
      gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
      gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, indices, gl.STATIC_DRAW);
      for (let i = 0; i < 3; i++) {
        gl.enableVertexAttribArray(i);
        gl.vertexAttribPointer(i, 3, gl.FLOAT, false, 36, 12 * i);
      }
      meshes[kind] = {array, count: indices.length};
      gl.bindVertexArray(null);
    },
    ready: look => textures.chain && textures.sky && numbers.sh &&
        (look === 1 || look === 7     ? textures.gloss :
             look === 5 || look === 6 ? textures.discs :
                                        true),

    draw(view, kind, spin) {
      const {axes, eye} = cameraOf(view), w = canvas.width, h = canvas.height;
      gl.viewport(0, 0, w, h);
      gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
      gl.enable(gl.DEPTH_TEST);
      gl.depthFunc(gl.LEQUAL);
      const units = ['chain', 'gloss', 'discs', 'sky'];
      units.forEach((name, i) => {
        gl.activeTexture(gl.TEXTURE0 + i);
        gl.bindTexture(
            [gl.TEXTURE_CUBE_MAP, gl.TEXTURE_CUBE_MAP, gl.TEXTURE_2D_ARRAY, gl.TEXTURE_2D][i],
            textures[name]?.made ?? null);
      });
      for (const p of [object, sky]) {
        gl.useProgram(p.made);
        units.forEach((name, i) => gl.uniform1i(p.at(name), i));
        for (const name of ['skyTurn', 'exposure', 'roughness', 'metal', 'blur'])
          gl.uniform1f(p.at(name), view[name]);
        gl.uniform1f(p.at('aspect'), w / h);
        gl.uniform1f(p.at('top'), numbers.top);
        gl.uniform4f(p.at('sun'), view.sunX, view.sunY, view.sunZ, view.flux);
        gl.uniform1f(p.at('sunRadius'), numbers.sunRadius ?? 1);
        gl.uniformMatrix3fv(p.at('camera'), false, axes);
      }
      gl.bindVertexArray(empty);
      gl.drawArrays(gl.TRIANGLES, 0, 3);
      if (!meshes[kind] || !api.ready(view.look)) return;
      gl.useProgram(object.made);
      gl.uniform3fv(object.at('eye'), eye);
      gl.uniform1i(object.at('look'), view.look);
      gl.uniform1i(object.at('slices'), numbers.slices ?? 1);
      gl.uniform1i(object.at('taps'), (numbers.fan?.length ?? 0) / 2);
      gl.uniform1f(object.at('size'), kind === 2 ? 0.75 : 1);
      gl.uniformMatrix3fv(
          object.at('spin'), false,
          [Math.cos(spin), 0, -Math.sin(spin), 0, 1, 0, Math.sin(spin), 0, Math.cos(spin)]);
      gl.uniform4fv(object.at('sh'), numbers.sh);
      if (numbers.fit) gl.uniform4fv(object.at('fit'), numbers.fit);
      if (numbers.fan?.length) gl.uniform2fv(object.at('fan'), numbers.fan);
      if (numbers.split) gl.uniform2fv(object.at('split'), numbers.split);
      gl.bindVertexArray(meshes[kind].array);
      gl.drawElements(gl.TRIANGLES, meshes[kind].count, gl.UNSIGNED_INT, 0);
    }
  };
  return api;
}
