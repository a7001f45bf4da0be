/* Filters, apart from the page. The page posts what it wants, whole, each time that anything of it
   changes; what is done is compared with that, one piece at a time, so that a newer wish is seen
   between two pieces. Answers carry copies of the texels, and the number of the wish.
   SPDX-License-Identifier: MIT */
const SKY = 0, LIT = 1, CHAIN = 2, MAP = 3, METHOD = 4, TRUTH = 5, SKY_CHAIN = 6, SKY_MAP = 7;
const CUBE = 0, PARABOLOID = 1, LEVELS = 6, SLICES = 16, ONE = 64;
const REFUSED = 11; /* ENVMAP_ERROR_METHOD */
const FORMS_THAT_FAIL = 5, KTX2 = 2;
const LOBE = {
  mirror: 0,
  phong: 1,
  diffuse: 2,
  ggx: 3,
  banks: 4,
  fit: 5
};
const NEEDS_MAP = [0, 1, 0, 0, 0, 1, 1, 1];
const REST = 150; /* ms without a newer wish: the sun rests */
let lib, wish, wished = 0, busy = false, shown = false, done = {}, failed = {}, note = '';

const floats = (at, count) => new Float32Array(lib.memory.buffer, at, count).slice();
const text = at => {
  const bytes = new Uint8Array(lib.memory.buffer, at);
  return new TextDecoder().decode(bytes.slice(0, bytes.indexOf(0)));
};
const tell = (type, more, texels) =>
    postMessage({type, ...more, texels}, texels ? [texels.buffer] : []);
/* Between two pieces: messages that have come are heard first. */
const breath = () => new Promise(go => {
  const channel = new MessageChannel();
  channel.port1.onmessage = () => {
    channel.port1.close();
    go();
  };
  channel.port2.postMessage(0);
});
const time = work => {
  const start = performance.now();
  const result = work();
  return [result, performance.now() - start];
};

/* The lobe that a material looks up, which is also the one that is judged. */
const lobeOf = w => [
    [LOBE.mirror, 0], [LOBE.phong, w.exponent], [LOBE.diffuse, 0], [LOBE.ggx, w.roughness ** 2],
    [LOBE.ggx, w.roughness ** 2], [LOBE.banks, w.banks], [LOBE.fit, w.fit],
    [LOBE.phong, w.exponent]][w.look];

function say(what, result) {
  if (result)
    failed[what] = text(lib.web_message(result));
  else
    delete failed[what];
  tell('failed', {why: Object.values(failed)[0] || ''});
  return !result;
}

/* A file, or a scene: a quick one when there is no picture yet. */
function openSky(w) {
  if (!w.file) return say('sky', lib.web_scene(w.sky, w.size, !shown));
  const bytes = new Uint8Array(w.file), at = lib.web_buffer(bytes.length || 1);
  if (!at) return say('sky', 2);
  new Uint8Array(lib.memory.buffer, at, bytes.length).set(bytes);
  const isRadiance = bytes[0] === 35; /* "#?" */
  const result =
      isRadiance ? lib.web_open_hdr(at, bytes.length) : lib.web_open_pfm(at, bytes.length);
  lib.web_release(at);
  return say('sky', result);
}

/* SKY as it is, or each step-th texel of it: what is drawn sharp. */
function tellSky(key) {
  const size = lib.web_map_size(SKY);
  const all = new Float32Array(lib.memory.buffer, lib.web_map_texels(SKY, 0), 6 * size * size);
  const step = Math.ceil(size / 1024), h = Math.floor(size / step);
  const out = new Float32Array(6 * h * h);
  for (let y = 0, at = 0; y < h; y++)
    for (let x = 0; x < 2 * h; x++, at += 3) {
      const from = 3 * step * (2 * size * y + x);
      out.set(all.subarray(from, from + 3), at);
    }
  tell('sky', {h, key, radius: 2 * Math.PI / size}, out);
}

/* What is made of a sky at once: its small picture, nine numbers, room for its chain. */
function newSky(w) {
  done.meshes ??= meshes() ?? true;
  if (!openSky(w)) return;
  tellSky(w.skyKey);
  nine(w, 1);
  const size = lib.web_map_size(SKY), edge = 2 ** Math.floor(Math.log2(size / 2));
  for (const map of [CHAIN, SKY_CHAIN])
    say('room', lib.web_create(map, CUBE, Math.min(256, Math.max(32, edge)), LEVELS, 1));
}
function nine(w, again) {
  if (say('nine', lib.web_diffuse(again, ...w.sun, w.flux)))
    tell('nine', {}, floats(lib.web_floats(), 28));
}
function light(w) {
  if (say('sun', lib.web_light(...w.sun, w.flux))) lib.web_prepare(0.16, w.tolerance);
}

/* By the method of the wish; where it does not know the lobe, by the library's choice. */
function filter(w, map, i, lobe, value) {
  const result = lib.web_filter(map, i, lobe, value, w.method, w.tolerance);
  if (result !== REFUSED) return result;
  note = 'This method does not know such a lobe: the picture is the automatic one.';
  return lib.web_filter(map, i, lobe, value, 0, w.tolerance);
}

const lobeOfLevel = i => [i ? LOBE.ggx : LOBE.mirror, (i / (LEVELS - 1)) ** 2];
function tellLevel(w, i, ms) {
  const size = Math.max(1, lib.web_map_size(CHAIN) >> i);
  const texels = floats(lib.web_map_texels(CHAIN, i), 18 * size * size);
  tell('level', {level: i, size, ms, wish: w.number}, texels);
}
function level(w, i) {
  const [result, ms] = time(() => filter(w, CHAIN, i, ...lobeOfLevel(i)));
  if (say('chain', result)) tellLevel(w, i, ms);
  return ms;
}

const isSliced = w => w.look === 5 || w.look === 6;
const shapeOf = w => [isSliced(w) ? PARABOLOID : CUBE, ONE, 1, isSliced(w) ? SLICES : 1];
function tellMap(w, more) {
  tell(
      'map', {size: ONE, sliced: isSliced(w), slices: SLICES, wish: w.number, ...more},
      floats(lib.web_map_texels(MAP, 0), 3 * ONE * ONE * (isSliced(w) ? 2 * SLICES : 6)));
}
function ownMap(w) {
  const [lobe, value] = lobeOf(w);
  let result = lib.web_create(MAP, ...shapeOf(w)), fit, fan, across;
  if (!result && w.look === 6)
    result = lib.web_fit_copper(w.fit, SLICES), fit = floats(lib.web_floats(), 4 * SLICES);
  if (!result && w.look === 7) {
    let taps = 65; /* the shader has 64; wider steps ripple */
    for (across = lib.web_sigma(lobe, value); taps > 64; across *= taps > 64 ? 1.25 : 1)
      taps = lib.web_fan(Math.max(w.along, across), across);
    fan = floats(lib.web_floats(), 2 * taps);
  }
  if (!result) result = filter(w, MAP, 0, lobe, value);
  if (say('map', result)) tellMap(w, {fit, fan, across});
}

/* The sky alone, and what each lobe makes of the sun alone: then a sun that moves is a sum. */
function skyLevel(w, i) {
  lib.web_filter(SKY_CHAIN, i, ...lobeOfLevel(i), 0, 1e-3);
  lib.web_sun_tables(CHAIN, i, ...lobeOfLevel(i));
}
function skyMap(w) {
  if (lib.web_create(SKY_MAP, ...shapeOf(w))) return;
  lib.web_filter(SKY_MAP, 0, ...lobeOf(w), 0, 1e-3);
  lib.web_sun_tables(MAP, 0, ...lobeOf(w));
}
function follow(w) {
  done.filter = done.map = ''; /* at rest all is filtered anew */
  nine(w, 0);
  for (let i = LEVELS - 1; i >= 0; i--) {
    lib.web_sun(CHAIN, i, ...w.sun, w.flux);
    tellLevel(w, i, 0);
  }
  if (!NEEDS_MAP[w.look]) return;
  lib.web_sun(MAP, 0, ...w.sun, w.flux);
  tellMap(w, {});
}
const pause = async () => {
  for (const now = wish; wish === now && performance.now() < wished + REST;)
    await new Promise(go => setTimeout(go, 10));
};

/* The material's lobe by the method asked for, and by the library at 1e-5. */
function judge(w) {
  const [lobe, value] = lobeOf(w), w_ = 90, h = 45;
  const shape = shapeOf(w);
  shape[3] = 1;
  let result = lib.web_create(METHOD, ...shape) || lib.web_create(TRUTH, ...shape), ms = 0;
  if (!result && w.look === 6) result = lib.web_fit_copper(w.fit, SLICES);
  if (!result)
    [result, ms] = time(() => lib.web_filter(METHOD, 0, lobe, value, w.method, w.tolerance));
  if (!result) result = lib.web_filter(TRUTH, 0, lobe, value, 0, 1e-5);
  if (!result) result = lib.web_error(w_, h);
  if (result === REFUSED) return tell('error', {ms: 0});
  if (!say('error', result)) return tell('error', {ms: 0});
  const out = floats(lib.web_floats(), 16 + w_ * h);
  tell('error', {ms, rms: out[0], worst: out[1]}, out.slice(16));
}

/* What is not yet as wished, most visible first. Keys say what each thing was made from. */
function keysOf(w) {
  const sky = w.skyKey + (shown ? '' : ' coarse'), lobe = [w.look === 5, ...lobeOf(w)].join();
  const sun = [sky, w.flux && w.sun, w.flux].join(), filter = [sun, w.tolerance, w.method].join();
  return {
    sky,
    sun,
    filter,
    split: w.roughness,
    light: [sun, w.tolerance].join(),
    map: [filter, w.look, w.look === 7 && w.along, lobe].join(),
    error: [filter, isSliced(w), lobe].join(),
    skyChain: sky,
    skyMap: [sky, lobe].join()
  };
}
/* Whether a sun is a sum: forms that fail are to fail on the sun, too. */
const follows = (w, keys) => (w.method === 0 || w.method === 3) && done.skyChain === keys.sky &&
    (!NEEDS_MAP[w.look] || done.skyMap === keys.skyMap);

function* pieces(w) {
  const keys = keysOf(w);
  const stale = what => done[what] !== keys[what] && (done[what] = keys[what], true);
  if (stale('sky')) yield() => newSky(w);
  if (!lib.web_map_size(SKY)) return;
  if (stale('split'))
    yield() => {
      lib.web_split_sum(w.roughness, 32);
      tell('split', {}, floats(lib.web_floats(), 64));
    };
  if (stale('sun'))
    if (follows(w, keys)) {
      yield() => follow(w);
      yield pause;
    } else
      yield() => nine(w, 0);
  if (stale('light')) yield() => light(w);
  if (NEEDS_MAP[w.look] && stale('map')) yield() => ownMap(w);
  if (done.filter !== keys.filter) {
    let ms = 0;
    done.filter = '';
    for (let i = LEVELS - 1; i >= 0; i--)
      yield() => {
        ms += level(w, i);
      };
    done.filter = keys.filter;
    yield() => tell('chain', {ms});
  }
  if (!shown) {
    shown = true;
    return;
  }
  yield pause;
  if (w === wish && stale('error')) yield() => judge(w);
  if (done.skyChain !== keys.skyChain) {
    for (let i = LEVELS - 1; i >= 0; i--) yield() => skyLevel(w, i);
    done.skyChain = keys.skyChain;
  }
  if (NEEDS_MAP[w.look] && stale('skyMap')) yield() => skyMap(w);
}

/* Whether what is being made for one wish is of no use for a newer one. */
const isOther = (a, b) => ['skyKey', 'method', 'tolerance'].some(key => a[key] !== b[key]) ||
    keysOf(a).sun !== keysOf(b).sun && follows(a, keysOf(a));
async function work() {
  busy = true;
  for (let now = null; now !== wish || !shown;) {
    const first = !shown;
    if (wish !== now) note = '';
    now = wish;
    for (const piece of pieces(now)) {
      await piece();
      await breath();
      if (wish !== now && isOther(wish, now)) break;
    }
    if (first && !shown && wish === now) break; /* no sky: wait for another wish */
    if (first) now = null;
  }
  busy = false;
  tell('idle', {bytes: lib.memory.buffer.byteLength, note});
}

/* The test asks for what the CPU draws. */
function picture(view, w, h) {
  new Float32Array(lib.memory.buffer, lib.web_view_floats(), view.length).set(view);
  const at = lib.web_picture(w, h);
  const rgba = new Uint8ClampedArray(lib.memory.buffer, at, 4 * w * h).slice();
  lib.web_release(at);
  postMessage({type: 'picture', w, h, rgba}, [rgba.buffer]);
}

/* The chain is filtered once more, in one call: then it has the numbers that the tool bakes. */
function save({kind, map, level, name}) {
  if (busy) light(wish);
  if (map === CHAIN && kind === KTX2 && wish.method < FORMS_THAT_FAIL)
    if (lib.web_chain(wish.method, wish.tolerance) === REFUSED) lib.web_chain(0, wish.tolerance);
  const at = lib.web_save(kind, map, level);
  if (at) tell('file', {name}, new Uint8Array(lib.memory.buffer, at, lib.web_saved()).slice());
}

const KINDS = 3;
function meshes() {
  for (let kind = 0; kind < KINDS; kind++) {
    const at = lib.web_mesh(kind);
    if (!at) continue;
    const indices =
        new Uint32Array(lib.memory.buffer, lib.web_mesh_indices(kind), lib.web_mesh_count(kind, 1))
            .slice();
    tell('mesh', {kind, indices}, floats(at, 9 * lib.web_mesh_count(kind, 0)));
  }
}

async function unpack(base64) {
  const bytes = Uint8Array.from(atob(base64.trim()), c => c.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream('gzip'));
  return WebAssembly.compile(await new Response(stream).arrayBuffer());
}

async function start(base64) {
  const module = await unpack(base64);
  const made = await WebAssembly.instantiate(module, {});
  made.exports._initialize?.();
  lib = made.exports;
  tell('ready', {imports: WebAssembly.Module.imports(module).length});
}

onmessage = async ({data}) => {
  if (data.module) try {
      await start(data.module);
    } catch (error) {
      tell('failed', {why: `the module does not start: ${error.message}`});
    }
  if (data.backdrop) {
    const {sky, size, quick, skyKey} = data.backdrop;
    if (!lib.web_scene(sky, size, quick)) tellSky(skyKey);
    return;
  }
  if (data.picture) return picture(...data.picture);
  if (data.save) return save(data.save);
  if (data.wish) wish = data.wish, wished = performance.now();
  if (lib && wish && !busy)
    work().catch(error => {
      busy = false;
      tell('failed', {why: String(error.message)});
    });
};
