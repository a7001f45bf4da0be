/* The page: controls into a wish for the worker and a view for the picture; answers onto the page.
   SPDX-License-Identifier: MIT */
const $ = id => document.getElementById(id);
const canvas = $('picture'), LEVELS = 6;
const LIT = 1, CHAIN = 2, MAP = 3, PFM = 0, HDR = 1, KTX2 = 2; /* as in web.c */
const state = {
  yaw: 0.45,
  pitch: 0.1,
  file: null,
  fileCount: 0,
  ready: false,
  failure: '',
  levels: [],
  wishes: 0,
  tried: new Map()
};
const number = id => Number($(id).value);
const chosen = name => Number(document.querySelector(`input[name=${name}]:checked`)?.value ?? -1);
const radians = id => number(id) * Math.PI / 180;

/* ---- the module and its worker */

/* A module whose only function makes a v128. */
const HAS_SIMD = WebAssembly.validate(new Uint8Array([
  0, 97, 115, 109, 1,  0, 0, 0, 1,  5, 1,   96, 0,   1,  123, 3,
  2, 1,  0,   10,  10, 1, 8, 0, 65, 0, 253, 15, 253, 98, 11
]));

let worker, artist, view; /* the artist makes skies as fine as a window */
const SCALAR = new URLSearchParams(location.search).has('scalar') || !HAS_SIMD;
function startWorker() {
  worker?.terminate();
  state.painting = false;
  worker = newWorker(data => {
    state.heard = performance.now();
    answers[data.type]?.(data);
  });
  state.heard = performance.now();
}
function newWorker(answer) {
  const source = new Blob([$('worker').textContent], {type: 'text/javascript'});
  const made = new Worker(URL.createObjectURL(source));
  made.onmessage = ({data}) => answer(data);
  made.onerror = event => fail(event.message);
  made.postMessage({module: $(SCALAR ? 'module-scalar' : 'module-simd').textContent});
  return made;
}
const skyKey = () => state.file ? `file ${state.file.number}` : `scene ${chosen('sky')}`;
/* A sky four times as fine as what is filtered, quickly and then in full: only to be looked at. */
function paint() {
  if (state.file || !view || state.painted === skyKey()) return;
  state.painted = skyKey(), state.fine = 0;
  artist?.terminate();
  const mine = artist = newWorker(({type, key, h, texels}) => {
    if (type === 'ready')
      for (const quick of [1, 0])
        mine.postMessage({backdrop: {sky: chosen('sky'), skyKey: skyKey(), size: 1024, quick}});
    if (type !== 'sky' || key !== skyKey()) return;
    view.sky(h, texels);
    draw();
    if (++state.fine === 2) mine.terminate();
  });
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
  sky({h, radius, texels}) {
    state.sky = {h, texels}, state.painted = '';
    smallSky();
    view?.set({sunRadius: radius});
    view?.sky(h, texels);
    draw();
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
    if (texels) tried(ms, rms);
    plot();
  },
  idle({bytes, note}) {
    state.bytes = bytes;
    state.idle = true;
    busy(note);
    paint();
    if (!view) draw();
  },
  split({texels}) {
    view?.set({split: texels});
    draw();
  },
  file({name, texels}) {
    save(texels, name);
  },
  picture(data) {
    state.painting = false;
    if (state.onPicture) return state.onPicture(data);
    if (view) return;
    canvas.width = data.w, canvas.height = data.h;
    canvas.getContext('2d').putImageData(new ImageData(data.rgba, data.w, data.h), 0, 0);
    if (state.repaint) state.repaint = false, draw();
  }
};

/* ---- wishes */

function sunDirection() {
  const a = radians('azimuth'), h = radians('height');
  return [Math.cos(h) * Math.sin(a), Math.sin(h), -Math.cos(h) * Math.cos(a)];
}
function wish() {
  placeSun();
  const file = state.file;
  if (worker && !state.idle && performance.now() - state.heard > 3000)
    startWorker(); /* reference: minutes */
  state.idle = false;
  worker?.postMessage({
    wish: {
      number: ++state.wishes,
      file: file?.bytes,
      sky: chosen('sky'),
      skyKey: skyKey(),
      size: 256,
      sun: sunDirection(),
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
  const [sunX, sunY, sunZ] = sunDirection();
  return {
    sunX,
    sunY,
    sunZ,
    flux: number('flux'),
    look: number('look'),
    yaw: state.yaw,
    pitch: state.pitch,
    distance: 4.4 * Math.max(1, 1.4 * canvas.clientHeight / canvas.clientWidth),
    skyTurn: radians('turn'),
    exposure: 2 ** number('exposure'),
    roughness: number('roughness'),
    metal: number('metal'),
    blur: number('blur'),
    along: number('along'),
    across: state.across ?? 0.1
  };
}
function cpuPicture(w = 320, h = Math.round(w * canvas.clientHeight / canvas.clientWidth)) {
  const now = viewNow();
  worker.postMessage({picture: [VIEW.map(name => now[name]), w, h]});
}
let asked = 0;
/* Without WebGL one picture at a time comes from the worker, and a last one after changes. */
function draw() {
  if (view)
    asked ||= requestAnimationFrame(drawNow);
  else if (!state.idle || state.painting)
    state.repaint = state.painting;
  else
    state.painting = true, cpuPicture();
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
/* The sentence of a control, below its group. */
function explain(control) {
  const entry = WHY[control.name || control.id], group = control.closest('fieldset');
  if (!entry || !group) return;
  const [sentence, page] = typeof entry === 'function' ? entry() : entry;
  const link = page.includes('#') ? page : `${page}.md`;
  group.querySelector('.why').innerHTML = `${sentence} <a href="../docs/${link}">More</a>`;
}
function rows() {
  document.querySelectorAll('[data-looks]').forEach(row => {
    row.hidden = !row.dataset.looks.includes(number('look'));
  });
}
/* The sky, with the tone curve of the picture; every step-th texel will do. */
function smallSky() {
  const step = Math.max(1, Math.floor(state.sky.h / 256)), h = Math.floor(state.sky.h / step);
  const pixels = new ImageData(2 * h, h), white = 2 ** number('exposure'), small = $('small');
  for (let y = 0, at = 0; y < h; y++)
    for (let x = 0; x < 2 * h; x++) {
      const from = 3 * step * (2 * state.sky.h * y + x);
      for (let c = 0; c < 3; c++)
        pixels.data[at++] = 255 * (1 - Math.exp(-state.sky.texels[from + c] * white)) ** (1 / 2.2);
      pixels.data[at++] = 255;
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
/* rms over time of every setting that was tried on this lobe and scene, both logarithmic. */
const PLOT = {
  x: ms => 46 + 244 * Math.min(Math.max(Math.log10(ms), 0), 4) / 4,
  y: rms => 128 - 120 * Math.min(Math.max(Math.log10(rms) + 7, 0), 7) / 7
};
function plot() {
  const line = (x1, y1, x2, y2) => `<path d="M${x1} ${y1}L${x2} ${y2}"/>`;
  const text = (x, y, anchor, words) =>
      `<text x="${x}" y="${y}" text-anchor="${anchor}">${words}</text>`;
  let out = '';
  for (const [ms, words] of [[1, '1'], [10, '10'], [100, '100'], [1000, '1 s'], [1e4, '10 s']])
    out += line(PLOT.x(ms), 8, PLOT.x(ms), 128) + text(PLOT.x(ms), 142, 'middle', words);
  for (const [rms, words] of [[1, '1'], [1e-2, '10⁻²'], [1e-4, '10⁻⁴'], [1e-6, '10⁻⁶']])
    out += line(46, PLOT.y(rms), 290, PLOT.y(rms)) + text(41, PLOT.y(rms) + 4, 'end', words);
  out += text(168, 158, 'middle', 'time of this lobe, ms') +
      `<text transform="translate(9 68) rotate(-90)" text-anchor="middle">rms error</text>`;
  const last = [...state.tried.values()].at(-1);
  for (const dot of state.tried.values())
    out += `<circle cx="${PLOT.x(dot.ms)}" cy="${PLOT.y(dot.rms)}" r="4.5" class="${
        dot.method > 4 ? 'fails' : ''} ${dot === last ? 'now' : ''}"><title>${dot.name}: ${
        dot.ms.toFixed(1)} ms, rms ${dot.rms.toExponential(1)}</title></circle>`;
  $('plot').innerHTML = out;
}
function tried(ms, rms) {
  const lobe = [
    skyKey(),
    ...['flux', 'azimuth', 'height', 'look', 'roughness', 'exponent', 'banks', 'fit'].map(number)
  ].join();
  if (state.lobe !== lobe) state.tried.clear();
  state.lobe = lobe;
  const select = $('method'), name = select.selectedOptions[0].text;
  const key = [select.value, select.value < 5 && number('tolerance')].join();
  state.tried.delete(key); /* the last is the newest */
  state.tried.set(key, {ms, rms, method: number('method'), name});
}
/* In the form of `envmap sh sky.pfm --glsl`, with the numbers of bake's manifest. */
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
  explain(input);
  rows();
  if (input.id === 'exposure' && state.sky) smallSky();
  if (REFILTERS.includes(input.id) || input.name === 'sky') wish();
  if (input.id === 'slowly' && input.checked) requestAnimationFrame(turnSlowly);
  draw();
}
let turned = 0;
function turnSlowly(now) {
  if (!$('slowly').checked) return void (turned = 0);
  if (!state.first) return void requestAnimationFrame(turnSlowly);
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
  draw();
}
function listen() {
  $('panel').addEventListener('focusin', event => explain(event.target));
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
  canvas.addEventListener(
      'webglcontextlost',
      () => fail('The browser took WebGL away. Reload the page to have it again.'));
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
    save: {kind: KTX2, map: CHAIN, level: 0, name: 'specular.ktx2'}
  }));
  $('save-sky').addEventListener('click', () => worker.postMessage({
    save: {kind: HDR, map: LIT, level: 0, name: 'environment.hdr'}
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
for (const id of ['sky', 'look', 'turn', 'method', 'save-chain'])
  explain($(id).querySelector('input') ?? $(id));
rows();
$('ramp').style.background =
    `linear-gradient(90deg, ${[0, 0.25, 0.5, 0.75, 1].map(t => `rgb(${heatColour(t)})`).join()})`;
listen();
plot();
const less = matchMedia('(prefers-reduced-motion: reduce)');
const motion = () => {
  $('slowly').checked = !less.matches;
  requestAnimationFrame(turnSlowly);
};
motion();
less.addEventListener('change', motion);
try {
  start();
} catch (error) {
  fail(`The page cannot start: ${error.message}`);
}
