/* The page: controls into a wish for the worker and a view for the picture; answers onto the page.
   SPDX-License-Identifier: MIT */
const $ = id => document.getElementById(id);
const canvas = $('picture'), LEVELS = 6;
const CHAIN = 2, MAP = 3, PFM = 0, HDR = 1, KTX2 = 2; /* as in web.c */
const state = {
  yaw: 0.45,
  pitch: 0.22,
  file: null,
  fileCount: 0,
  ready: false,
  failure: '',
  levels: [],
  wishes: 0
};
const number = id => Number($(id).value);
const chosen = name => Number(document.querySelector(`input[name=${name}]:checked`)?.value ?? -1);
const radians = id => number(id) * Math.PI / 180;

const FORMULAS = [
  'L(r): the environment itself, at the reflected eye r. The level is a resampling, no filter.',
  'L(r) = ∫ max(r·l, 0)<sup>N</sup> L<sub>in</sub> dl / norm: one lobe around r.',
  'E(n)/π by nine numbers a channel, printed below. Three bands hold all but a few percent.',
  'F(n·v) L(r) + (1 − F) albedo E(n)/π, with Fresnel’s F for an index of 1.5.',
  'L<sub>α</sub>(r) (f<sub>0</sub> scale + bias): GGX, α = roughness², n = v = r, and the split sum.',
  'max(0, √(1−x²) √(1−c²) − xc − s) about the tangent t, with 16 slices of c = v·t.',
  'A GGX copper as one tabulated lobe with its own axis, with 16 slices of n·v.',
  'Lookups along an arc in a round Phong map widen its lobe to the length across the strokes.'
];
const PAGES = [
  'parameterizations', 'filters', 'harmonics', 'materials', 'materials', 'filters', 'materials',
  'materials'
];
const FAILURES = {
  1: 'Every texel of the source for every texel of the map: what all else is held against.',
  2: 'Lobe and environment as mip-maps: steps where a lobe changes its level. ' +
      '<a href="../docs/stability.md#a-threshold-on-lobes">A threshold on lobes</a>',
  5: 'Box levels with each cube face alone: squares, and seams along the faces’ edges. ' +
      '<a href="../docs/stability.md#faces-mipmapped-alone">Faces mipmapped alone</a>',
  6: 'Sixteen directions a texel: a sun falls between them, and shows as spots. ' +
      '<a href="../docs/stability.md#fireflies">Fireflies</a>',
  7: 'Three bands for a sharp lobe: it rings, and light goes below zero. ' +
      '<a href="../docs/stability.md#ringing">Ringing</a>',
  8: 'A source of 8 bits: what is brighter than four times its mean is gone. ' +
      '<a href="../docs/stability.md#maps-of-8-bits">Maps of 8 bits</a>'
};

/* ---- the module and its worker */

/* A module whose only function makes a v128. */
const HAS_SIMD = WebAssembly.validate(new Uint8Array([
  0, 97, 115, 109, 1,  0, 0, 0, 1,  5, 1,   96, 0,   1,  123, 3,
  2, 1,  0,   10,  10, 1, 8, 0, 65, 0, 253, 15, 253, 98, 11
]));

let worker, view;
const SCALAR = new URLSearchParams(location.search).has('scalar') || !HAS_SIMD;
function startWorker() {
  worker?.terminate();
  worker = new Worker(
      URL.createObjectURL(new Blob([$('worker').textContent], {type: 'text/javascript'})));
  worker.onmessage = ({data}) => {
    state.heard = performance.now();
    answers[data.type]?.(data);
  };
  worker.onerror = event => fail(event.message);
  worker.postMessage({module: $(SCALAR ? 'module-scalar' : 'module-simd').textContent});
  state.heard = performance.now();
}
function start() {
  startWorker();
  wish(); /* filters while the shaders are compiled */
  const before = performance.now();
  view = createView(canvas);
  state.gl = performance.now() - before;
  $('says').textContent = `${SCALAR ? 'Scalar' : 'SIMD'} WebAssembly. ` +
      (view ? `WebGL2, ${view.format}.` :
              'No WebGL2 here: the library draws a ball itself, in 8 bits.');
}

function fail(why) {
  state.failure = why;
  $('status').textContent = why;
  $('status').classList.toggle('bad', !!why);
}
const busy = text => {
  if (!state.failure) $('status').textContent = text;
};

const answers = {
  ready({imports}) {
    state.imports = imports;
  },
  failed({why}) {
    if (why || state.failure) fail(why && `This cannot be done: ${why}.`);
  },
  mesh({kind, indices, texels}) {
    view?.mesh(kind, texels, indices);
    draw();
  },
  sky({h, texels}) {
    state.sky = {h, texels};
    smallSky();
  },
  nine({texels}) {
    view?.set({sh: texels});
    state.glsl = glsl(texels);
    $('glsl').textContent = state.glsl;
    draw();
  },
  level({level, size, texels, wish}) {
    if (view && (state.size !== size << level)) state.size = size << level, state.levels = [];
    view?.set({top: LEVELS - 1});
    view?.level(level, LEVELS, size, texels);
    state.levels[level] = {size, texels};
    if (!level) state.whole = {wish, at: performance.now()};
    busy(level > 1 ? 'Wide lobes are there; sharp ones follow' : 'The sharpest lobes come last');
    draw();
  },
  map(data) {
    view?.map(data, data.texels);
    state.map = data, state.across = data.across ?? state.across;
    draw();
  },
  chain({ms}) {
    $('time').textContent = `${ms.toFixed(0)} ms`;
    state.chains = (state.chains ?? 0) + 1;
  },
  error({ms, rms, worst, texels}) {
    $('lobetime').textContent = texels ? `${ms.toFixed(1)} ms` : '–';
    $('rms').textContent = texels ? rms.toExponential(1) : '–';
    $('worst').textContent = texels ? worst.toExponential(1) : '–';
    heat(texels);
  },
  idle({bytes, note}) {
    state.bytes = bytes;
    state.idle = true;
    busy(note);
    if (!view) cpuPicture();
  },
  split({texels}) {
    view?.set({split: texels});
    draw();
  },
  file({name, texels}) {
    save(texels, name);
  },
  picture(data) {
    if (state.onPicture)
      state.onPicture(data);
    else if (!view)
      canvas.width = data.w, canvas.height = data.h,
      canvas.getContext('2d').putImageData(new ImageData(data.rgba, data.w, data.h), 0, 0);
  }
};

/* ---- wishes */

function wish() {
  placeSun();
  const a = radians('azimuth'), h = radians('height');
  const file = state.file;
  if (worker && !state.idle && performance.now() - state.heard > 3000)
    startWorker(); /* reference: minutes */
  state.idle = false;
  worker?.postMessage({
    wish: {
      number: ++state.wishes,
      file: file?.bytes,
      sky: chosen('sky'),
      skyKey: file ? `file ${file.number}` : `scene ${chosen('sky')}`,
      size: 256,
      sun: [Math.cos(h) * Math.sin(a), Math.sin(h), -Math.cos(h) * Math.cos(a)],
      flux: number('flux'),
      look: number('look'),
      exponent: 10 ** number('exponent'),
      roughness: number('roughness'),
      banks: number('banks'),
      fit: number('fit'),
      along: number('along'),
      method: number('method'),
      tolerance: 10 ** number('tolerance')
    }
  });
  busy('Filtering');
}

async function open(file) {
  if (!file) return;
  if (file.size > 512 << 20) return fail(`${file.name} is larger than 512 MB.`);
  const bytes = await file.arrayBuffer();
  state.file = {bytes, number: ++state.fileCount};
  document.querySelectorAll('input[name=sky]').forEach(radio => {
    radio.checked = false;
  });
  wish();
}

/* ---- the picture */

function viewNow() {
  return {
    look: number('look'),
    yaw: state.yaw,
    pitch: state.pitch,
    distance: 4.4 * Math.max(1, 1.2 * canvas.height / canvas.width),
    skyTurn: radians('turn'),
    exposure: 2 ** number('exposure'),
    roughness: number('roughness'),
    metal: number('metal'),
    blur: number('blur'),
    along: number('along'),
    across: state.across ?? 0.1
  };
}
function cpuPicture(w = 320, h = 240) {
  const now = viewNow();
  worker.postMessage({picture: [VIEW.map(name => now[name]), w, h]});
}
let asked = 0;
function draw() {
  asked ||= requestAnimationFrame(drawNow);
}
function drawNow() {
  asked = 0;
  if (!view) return;
  const scale = Math.min(devicePixelRatio || 1, 2);
  const w = Math.max(1, Math.round(canvas.clientWidth * scale)),
        h = Math.max(1, Math.round(canvas.clientHeight * scale));
  if (canvas.width !== w || canvas.height !== h) canvas.width = w, canvas.height = h;
  view.draw(viewNow(), chosen('object'), radians('spin'));
  if (!state.first && state.levels.length === LEVELS) state.first = performance.now();
}

/* ---- what the panel says */

const shown = {
  flux: v => v ? v.toFixed(1) : 'off',
  azimuth: v => `${v}°`,
  height: v => `${v}°`,
  turn: v => `${v}°`,
  spin: v => `${v}°`,
  exponent: v => (10 ** v).toFixed(0),
  exposure: v => `${v > 0 ? '+' : ''}${v.toFixed(1)} EV`,
  tolerance: v => (10 ** v).toExponential(0),
  blur: v => v ? v.toFixed(2) : 'sharp'
};
function label(input) {
  const output = input.parentElement.querySelector('output');
  if (output) output.textContent = (shown[input.id] ?? (v => v.toFixed(2)))(Number(input.value));
}
function explain() {
  const look = number('look');
  document.querySelectorAll('[data-looks]').forEach(row => {
    row.hidden = !row.dataset.looks.includes(look);
  });
  $('formula').innerHTML = `${FORMULAS[look]} <a href="../docs/${PAGES[look]}.md">More</a>`;
  $('failure').innerHTML =
      (FAILURES[$('method').value] ??
       'The rms error keeps the tolerance; the time pays for it. ' +
           '<a href="../docs/accuracy-speed.md">All methods</a>') +
      ' The map above is |error| over the mean of the result, in all directions, against ' +
      'the same lobe at 1e-5.';
}
/* The sky, with the tone curve of the picture. */
function smallSky() {
  const {h, texels} = state.sky;
  const pixels = new ImageData(2 * h, h), white = 2 ** number('exposure'), small = $('small');
  const tone = x => 255 * (1 - Math.exp(-x * white)) ** (1 / 2.2);
  for (let i = 0; i < texels.length; i++) {
    const pixel = Math.floor(i / 3);
    pixels.data[4 * pixel + i % 3] = tone(texels[i]);
    pixels.data[4 * pixel + 3] = 255;
  }
  small.width = 2 * h, small.height = h;
  small.getContext('2d').putImageData(pixels, 0, 0);
}
function placeSun() {
  $('sun').hidden = !number('flux');
  $('sun').style.left = `${50 + number('azimuth') / 3.6}%`;
  $('sun').style.top = `${50 - number('height') / 1.8}%`;
}
function dragSun(event) {
  if (!event.buttons) return;
  const box = $('small').getBoundingClientRect();
  const set = (id, value) => {
    $(id).value = value;
    label($(id));
  };
  if (!number('flux')) set('flux', 4);
  set('azimuth', ((event.clientX - box.left) / box.width - 0.5) * 360);
  set('height', (0.5 - (event.clientY - box.top) / box.height) * 180);
  wish();
}
/* t in [0,1]: from the page's quiet blue through yellow to red. */
function heatColour(t) {
  const stops = [[38, 48, 84], [44, 112, 142], [105, 174, 122], [240, 200, 80], [205, 60, 40]];
  const x = Math.min(Math.max(t, 0), 1) * (stops.length - 1),
        k = Math.min(Math.floor(x), stops.length - 2);
  return stops[k].map((v, c) => v + (stops[k + 1][c] - v) * (x - k));
}
function heat(logs) {
  const context = $('heat').getContext('2d'), {width, height} = $('heat');
  const picture = context.createImageData(width, height);
  for (let i = 0; logs && i < width * height; i++)
    picture.data.set([...heatColour((logs[i] + 6) / 6), 255], 4 * i);
  context.putImageData(picture, 0, 0);
}
/* The same text as `envmap sh sky.pfm --glsl`. */
function glsl(packed) {
  const digits = v => String(Number(v.toPrecision(9)));
  const rows = Array.from(
      {length: 7},
      (_, k) => `    vec4(${Array.from(packed.subarray(4 * k, 4 * k + 4), digits).join(', ')})`);
  return `// irradiance / pi: times the albedo, it is the light that a diffuse surface sends out.
// n: unit normal, right-handed, +y up
const vec4 sh[7] = vec4[7](
${rows.join(',\n')});
vec3 diffuse_light(vec3 n) {
    vec4 a = vec4(n, 1.0), b = n.xyzz * n.yzzx;
    return vec3(dot(sh[0], a), dot(sh[1], a), dot(sh[2], a))
         + vec3(dot(sh[3], b), dot(sh[4], b), dot(sh[5], b))
         + sh[6].rgb * (n.x * n.x - n.y * n.y);
}
`;
}

/* ---- files to take away */

function save(bytes, name) {
  const link = document.createElement('a');
  link.href = URL.createObjectURL(new Blob([bytes], {type: 'application/octet-stream'}));
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}
/* The map that the material looks up: its own, or a level of the chain. */
function saveMap(kind, ending) {
  const look = number('look'), own = [1, 5, 6, 7].includes(look);
  const level = own || look === 0 ? 0 : Math.round(number('roughness') * (LEVELS - 1));
  worker.postMessage({
    save: {kind, map: own ? MAP : CHAIN, level, name: `${own ? 'map' : `ggx-${level}`}.${ending}`}
  });
}

/* ---- events */

const REFILTERS = [
  'flux', 'azimuth', 'height', 'look', 'roughness', 'exponent', 'banks', 'fit', 'along', 'method',
  'tolerance'
];
function changed(event) {
  const input = event.target;
  if (input.type === 'file') return open(input.files[0]);
  if (input.name === 'sky') state.file = null;
  if (input.type === 'range') label(input);
  if (input.tagName === 'SELECT') explain();
  if (input.id === 'exposure' && state.sky) smallSky();
  if (REFILTERS.includes(input.id) || input.name === 'sky') wish();
  if (input.id === 'slowly' && input.checked) requestAnimationFrame(turnSlowly);
  draw();
}
let turned = 0;
function turnSlowly(now) {
  if (!$('slowly').checked) return void (turned = 0);
  const spin = number('spin') + (turned ? (now - turned) * 0.012 : 0);
  turned = now;
  $('spin').step = 'any';
  $('spin').value = spin > 180 ? spin - 360 : spin;
  $('spin').parentElement.querySelector('output').textContent = `${Math.round(number('spin'))}°`;
  draw();
  requestAnimationFrame(turnSlowly);
}
function orbit(dx, dy) {
  state.yaw -= dx;
  state.pitch = Math.min(Math.max(state.pitch + dy, -1.4), 1.4);
  if (!view) cpuPicture();
  draw();
}
function listen() {
  $('panel').addEventListener('input', changed);
  $('panel').addEventListener('submit', event => event.preventDefault());
  canvas.addEventListener('pointermove', event => {
    if (event.buttons) orbit(event.movementX * 0.008, event.movementY * 0.008);
  });
  canvas.addEventListener('pointerdown', event => canvas.setPointerCapture(event.pointerId));
  canvas.addEventListener('keydown', event => {
    const step = {
      ArrowLeft: [-0.1, 0],
      ArrowRight: [0.1, 0],
      ArrowUp: [0, 0.1],
      ArrowDown: [0, -0.1]
    }[event.key];
    if (step) orbit(...step), event.preventDefault();
  });
  for (const type of ['pointerdown', 'pointermove']) $('small').addEventListener(type, dragSun);
  $('small').addEventListener(
      'pointerdown', event => $('small').setPointerCapture(event.pointerId));
  addEventListener('dragover', event => {
    event.preventDefault();
    $('drop').hidden = false;
  });
  addEventListener('dragleave', event => {
    if (!event.relatedTarget) $('drop').hidden = true;
  });
  addEventListener('drop', event => {
    event.preventDefault();
    $('drop').hidden = true;
    open(event.dataTransfer.files[0]);
  });
  addEventListener('resize', draw);
  $('save-pfm').addEventListener('click', () => saveMap(PFM, 'pfm'));
  $('save-hdr').addEventListener('click', () => saveMap(HDR, 'hdr'));
  $('save-chain').addEventListener('click', () => worker.postMessage({
    save: {kind: KTX2, map: CHAIN, level: 0, name: 'ggx.ktx2'}
  }));
  $('save-sh').addEventListener('click', () => save(state.glsl, 'sh.glsl'));
  $('copy').addEventListener('click', async () => {
    try {
      await navigator.clipboard.writeText(state.glsl);
      $('copy').textContent = 'Copied';
    } catch {
      getSelection().selectAllChildren($('glsl'));
      $('copy').textContent = 'Selected';
    }
    setTimeout(() => {
      $('copy').textContent = 'Copy GLSL';
    }, 1500);
  });
}

document.querySelectorAll('input[type=range]').forEach(label);
explain();
$('ramp').style.background =
    `linear-gradient(90deg, ${[0, 0.25, 0.5, 0.75, 1].map(t => `rgb(${heatColour(t)})`).join()})`;
listen();
try {
  start();
} catch (error) {
  fail(`The page cannot start: ${error.message}`);
}
