#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""usage: tests/web/run.py envmap.html [PICTURES]: the page in headless Chromium.

The last line counts "N passed, N failed". Without a page or a Chromium it passes by and says so.
PICTURES is a folder for screenshots: light, dark, narrow."""

import functools, http.server, os, shutil, struct, subprocess, sys, tempfile, threading, time

sys.dont_write_bytecode = True
HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, HERE)
import browser

IDLE = "typeof state === 'object' && state.idle === true"
MOST_BYTES, MOST_SECONDS = 500_000, 1.0
counts = [0, 0]


def check(name, good, more=""):
    counts[not good] += 1
    print(f"  {'ok  ' if good else 'FAIL'} {name}{': ' if more else ''}{more}", flush=True)
    return good


def slower():
    """Others use the machine, too."""
    return max(1, os.getloadavg()[0] / os.cpu_count())


def serve(path):
    """A server of the page's folder on loopback; returns it and the page's address."""

    class Quiet(http.server.SimpleHTTPRequestHandler):
        def log_message(self, *arguments):
            pass

    handler = functools.partial(Quiet, directory=os.path.dirname(os.path.abspath(path)))
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    return server, f"http://127.0.0.1:{server.server_port}/{os.path.basename(path)}"


def load(page, url, **how):
    page.open(url, **how)
    return page.wait(f"{IDLE} && document.getElementById('time').textContent !== '–'", 90)


def set_control(page, name, value):
    page.run(
        f"""(() => {{ const c = $('{name}'); c.value = {value};
        c.dispatchEvent(new Event('input', {{bubbles: true}})); }})()"""
    )


# ---- the picture


def the_first_picture_comes_soon(page, url):
    """All levels of a chain are drawn; without the time of WebGL; the best of three."""
    times = []
    for _ in range(3):
        load(page, url)
        times.append(page.run("[(state.first - state.gl) / 1000, state.gl / 1000]"))
    first, gl = min(times)
    check(
        "the first picture comes soon",
        0 < first <= MOST_SECONDS * slower(),
        f"{first:.2f} s, and WebGL {gl:.2f} s",
    )


PICTURE_ERROR = """(async () => {
  const got = new Promise(done => { state.onPicture = done; });
  canvas.style.width = '160px', canvas.style.height = '120px';
  view.sky(state.sky.h, state.sky.texels);
  drawNow();
  cpuPicture(canvas.width, canvas.height);
  const {rgba, w, h} = await got;
  state.onPicture = null;
  drawNow();
  const copy = new OffscreenCanvas(w, h).getContext('2d', {willReadFrequently: true});
  copy.drawImage(canvas, 0, 0);
  const gl = copy.getImageData(0, 0, w, h).data;
  let sum = 0, worst = 0, seen = new Set();
  for (let i = 0; i < gl.length; i++)
    if (i % 4 < 3) sum += Math.abs(gl[i] - rgba[i]), seen.add(gl[i]);
  canvas.style.width = canvas.style.height = '';
  return [sum / (0.75 * gl.length) / 255, seen.size];
})()"""


def webgl_draws_what_the_cpu_draws(page):
    page.run("document.querySelector('input[name=object][value=\"0\"]').click()")
    set_control(page, "turn", 40)
    names = ["mirror", "Phong", "diffuse", "coated", "GGX", "Banks", "fitted", "elliptical"]
    for look, name in enumerate(names):
        set_control(page, "look", look)
        if not page.wait(IDLE, 60):
            check(f"{name} is filtered in time", False)
            continue
        error, colours = page.run(PICTURE_ERROR)
        check(
            f"{name}: WebGL draws what the CPU draws",
            error <= 0.01 and colours > 20,
            f"mean {100 * error:.2f} %, {colours} values",
        )
    set_control(page, "look", 4), set_control(page, "turn", 0)


# ---- controls


def every_control_moves(page):
    failures = []
    for name, end in page.run(
        "[...document.querySelectorAll('#panel input[type=range]')].map(c => [c.id, c.max])"
    ):
        before = page.run(f"$('{name}').value")
        set_control(page, name, end)
        if not page.wait(IDLE, 90) or page.run("state.failure"):
            failures.append(f"{name} {page.run('state.failure')}")
        set_control(page, name, before)
    check("every slider goes to its end", not failures, "; ".join(failures))
    failures = []
    for method in (2, 3, 4, 5, 6, 7, 8, 0):
        set_control(page, "method", method)
        if not page.wait(IDLE, 90) or page.run("state.failure"):
            failures.append(f"{method} {page.run('state.failure')}")
    check("every quick method filters a GGX lobe", not failures, "; ".join(failures))
    set_control(page, "method", 5), set_control(page, "look", 5)
    page.wait(IDLE, 60)
    note = page.run("$('status').textContent")
    check(
        "a method that refuses a lobe says so",
        "automatic" in note and not page.run("state.failure"),
    )
    set_control(page, "method", 0), set_control(page, "look", 4)
    for sky in (0, 1, 2):
        page.run(f"document.querySelector('input[name=sky][value=\"{sky}\"]').click()")
        page.wait(IDLE, 60)
    for kind in (0, 2, 1):
        page.run(f"document.querySelector('input[name=object][value=\"{kind}\"]').click()")
    check("skies and objects change", not page.run("state.failure"))


def the_error_keeps_the_tolerance(page):
    for tolerance in (-2, -4):
        set_control(page, "tolerance", tolerance)
        page.wait(IDLE, 60)
        rms = float(page.run("$('rms').textContent"))
        check(
            f"at 1e{tolerance} the shown error keeps the tolerance",
            0 < rms <= 10**tolerance,
            f"{rms:g}",
        )
    set_control(page, "method", 7)
    page.wait(IDLE, 60)
    check(
        "nine coefficients of a sharp lobe show their error",
        float(page.run("$('rms').textContent")) > 0.01,
    )
    set_control(page, "method", 0), set_control(page, "tolerance", -3)
    page.wait(IDLE, 60)


def a_slow_method_can_be_left(page):
    set_control(page, "method", 1)
    time.sleep(6)
    set_control(page, "method", 0)
    check("a slow method can be left", page.wait(IDLE, 60) and not page.run("state.failure"))


def keys_turn_the_view(page):
    before = page.run("canvas.focus(), state.yaw")
    for kind in ("keyDown", "keyUp"):
        page.call(
            "Input.dispatchKeyEvent",
            type=kind,
            key="ArrowLeft",
            code="ArrowLeft",
            windowsVirtualKeyCode=37,
        )
    check("arrow keys turn the view", page.run("state.yaw") != before)


FOLLOW = """(async () => {
  const times = [];
  for (let i = 0; i < 30; i++) {
    const start = performance.now();
    $('azimuth').value = -60 + 4 * i;
    $('azimuth').dispatchEvent(new Event('input', {bubbles: true}));
    while (state.whole.wish !== state.wishes) await new Promise(go => setTimeout(go, 1));
    times.push(state.whole.at - start);
  }
  return times.sort((a, b) => a - b);
})()"""


def the_chain_follows_the_sun(page):
    """From an event to all levels in WebGL's textures; drawing is SwiftShader's time."""
    set_control(page, "flux", 4)
    page.wait(IDLE, 60)
    times = page.run(FOLLOW)
    check(
        "the whole chain follows a moving sun within two frames",
        times[15] <= 1000 / 30 * slower(),
        f"{times[15]:.0f} ms in the middle, {times[27]:.0f} ms for one in ten",
    )


SUN_ERROR = """(async () => {
  const live = () => state.levels.map(l => l.texels);
  $('height').value = 50;
  $('height').dispatchEvent(new Event('input', {bubbles: true}));
  while (state.whole.wish !== state.wishes) await new Promise(go => setTimeout(go, 1));
  const a = live();
  while (!state.idle) await new Promise(go => setTimeout(go, 10));
  return live().map((b, l) => {
    let error = 0, norm = 0;
    for (let i = 0; i < b.length; i++) error += (b[i] - a[l][i]) ** 2, norm += b[i] ** 2;
    return [a[l] === b, Math.sqrt(error / norm)];
  });
})()"""


def the_sun_by_itself_is_the_filters_sun(page):
    """filter(sky) + filter(sun), against the whole that is filtered when the sun rests."""
    levels = page.run(SUN_ERROR)
    check(
        "the sum that follows the sun is the filter's result",
        not any(same for same, _ in levels)
        and all(error <= (1e-3 if level else 2e-2) for level, (_, error) in enumerate(levels)),
        " ".join(f"{error:.1e}" for _, error in levels),
    )
    set_control(page, "flux", 0)
    page.wait(IDLE, 60)


# ---- files


def pfm(width, height, value=0.5, scale=-1.0):
    return f"PF\n{width} {height}\n{scale}\n".encode() + struct.pack("<f", value) * (
        3 * width * height
    )


def drop(page, data, name="sky.pfm"):
    page.run(
        f"""(() => {{ const files = new DataTransfer();
        files.items.add(new File([Uint8Array.from({list(data)})], '{name}'));
        state.idle = false;
        dispatchEvent(new DragEvent('drop', {{dataTransfer: files, cancelable: true}})); }})()"""
    )
    page.wait("state.idle && !$('drop').offsetParent", 60)
    return page.run("state.failure")


def hdr(width, height):
    return f"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {height} +X {width}\n".encode() + bytes(
        [128, 64, 32, 128]
    ) * (width * height)


def files_are_dropped(page):
    check("a PFM is dropped", drop(page, pfm(32, 16)) == "")
    page.wait(IDLE)
    check(
        "its constant radiance stays itself",
        page.run("state.levels.every(l => l.texels.every(v => Math.abs(v - 0.5) < 1e-4))"),
    )
    whole, good = pfm(32, 16), page.run("state.levels.length")
    for name, data in (
        ("an empty file", b""),
        ("a text", b"PF hello"),
        ("half a PFM", whole[:900]),
        ("a square PFM", pfm(15, 16)),
        ("a huge header", b"PF\n99999999 49999999\n-1\n"),
        ("no picture", os.urandom(300)),
        ("half a Radiance file", hdr(32, 16)[:200]),
    ):
        why = drop(page, data)
        check(
            f"{name} is refused, and the page stays",
            bool(why) and good == page.run("state.levels.length"),
            why,
        )
    check(
        "NaN and negative radiance are cleaned",
        drop(page, pfm(32, 16, float("nan"))) == "" and drop(page, pfm(32, 16, -1.0)) == "",
    )
    check("a Radiance file is dropped", drop(page, hdr(32, 16), "sky.hdr") == "")
    page.run("document.querySelector('input[name=sky][value=\"2\"]').click()")
    page.wait(IDLE, 60)
    check("a scene after a bad file clears the message", page.run("state.failure") == "")


def memory_stops_growing(page):
    bytes_, rounds = [], 0
    for rounds in range(1, 201):
        set_control(page, "flux", 1 + rounds % 2)
        if not page.wait(IDLE, 60):
            break
        if rounds in (60, 200):
            bytes_.append(page.run("state.bytes"))
    check(
        "after 60 of 200 refilters memory stops growing",
        rounds == 200 and bytes_[0] == bytes_[-1],
        " ".join(f"{b / 1e6:.1f} MB" for b in bytes_),
    )


# ---- other machines

LEVELS = "Promise.resolve(state.levels.map(l => Array.from(l.texels)))"


def relative(a, b):
    """The worst level's rms of a - b over that of b, and the worst number over it."""
    out = [0.0, 0.0]
    for one, two in zip(a, b):
        norm = (sum(y * y for y in two) / len(two)) ** 0.5
        out[0] = max(out[0], (sum((x - y) ** 2 for x, y in zip(one, two)) / len(two)) ** 0.5 / norm)
    return out[0]


def simd_is_scalar(page, url):
    load(page, url)
    simd = page.run(LEVELS)
    load(page, url + "?scalar")
    error = relative(simd, page.run(LEVELS))
    check("SIMD filters as scalar code does", len(simd) == 6 and error <= 1e-6, f"rms {error:.1e}")


# The scalar module, started in the page itself, does what native.c does.
HASHES = """(async () => {
  const bytes = Uint8Array.from(atob($('module-scalar').textContent.trim()), c => c.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream('gzip'));
  const code = await new Response(stream).arrayBuffer();
  const e = (await WebAssembly.instantiate(code, {})).instance.exports;
  e._initialize?.();
  e.web_scene(2, 64, 0), e.web_light(0, 1, 0, 2), e.web_prepare(0.16, 1e-3);
  e.web_create(2, 0, 64, 6, 1);
  return [5, 4, 3, 2, 1, 0].map(i => {
    e.web_filter(2, i, i ? 3 : 0, (i / 5) ** 2, 0, 1e-3);
    let hash = 2166136261;
    for (const b of new Uint8Array(e.memory.buffer, e.web_map_texels(2, i), 72 * (64 >> i) ** 2))
      hash = Math.imul(hash ^ b, 16777619) >>> 0;
    return hash;
  });
})()"""


def scalar_is_native(page):
    """Bit for bit, as both have musl's libm."""
    if not shutil.which("musl-gcc"):
        print("  the native bits passed by: no musl-gcc here (Debian: musl-tools)")
        return
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run(
            [
                "musl-gcc",
                "-std=gnu99",
                "-O1",
                "-DENVMAP_NO_SIMD",
                "-ffp-contract=off",
                "-static",
                "-I",
                os.path.join(HERE, "../.."),
                os.path.join(HERE, "native.c"),
                "-o",
                folder + "/native",
            ],
            check=True,
        )
        native = subprocess.run(
            [folder + "/native"], check=True, capture_output=True, text=True
        ).stdout.split()
    check(
        "scalar code has the bits of a native program", native == [str(h) for h in page.run(HASHES)]
    )


SAVED = """(async () => {
  const out = [], make = URL.createObjectURL, click = HTMLAnchorElement.prototype.click;
  URL.createObjectURL = blob => { out.blob = blob; return 'data:,'; };
  HTMLAnchorElement.prototype.click = function () { out.push([this.download, out.blob]); };
  for (const id of ['save-chain', 'save-hdr', 'save-pfm', 'save-sh']) $(id).click();
  while (out.length < 4) await new Promise(done => setTimeout(done, 20));
  URL.createObjectURL = make, HTMLAnchorElement.prototype.click = click;
  const read = async blob => [blob.size, ...new Uint8Array(await blob.slice(0, 10).arrayBuffer())];
  return Promise.all(out.map(async ([name, blob]) => [name, await read(blob)]));
})()"""


def files_are_taken_away(page):
    size = page.run("state.levels[0].size")
    saved = {name.split(".")[1]: (data[0], bytes(data[1:])) for name, data in page.run(SAVED)}
    texels = sum(6 * max(1, size >> i) ** 2 for i in range(6))
    check(
        "the chain is saved as KTX 2",
        saved["ktx2"][1].startswith(b"\xabKTX 20")
        and 8 * texels < saved["ktx2"][0] < 8 * texels + 1000,
        f"{saved['ktx2'][0]} bytes",
    )
    check(
        "a map is saved as .hdr, .pfm, and nine numbers",
        saved["hdr"][1] == b"#?RADIANCE"
        and saved["pfm"][1].startswith(b"PF\n")
        and saved["glsl"][1].startswith(b"// irradia"),
    )


def without(page, url, script, name, text):
    added = page.call("Page.addScriptToEvaluateOnNewDocument", source=script)["identifier"]
    load(page, url)
    page.wait("state.idle && canvas.width > 0")
    time.sleep(0.5)
    check(
        name,
        text in page.run("$('says').textContent")
        and not page.run("state.failure")
        and page.run("(canvas.toDataURL().length > 3000)"),
        page.run("$('says').textContent"),
    )
    page.call("Page.removeScriptToEvaluateOnNewDocument", identifier=added)


def looks(page, url, folder):
    for name, width, height, scheme in (
        ("light", 1280, 800, "light"),
        ("dark", 1280, 800, "dark"),
        ("narrow", 360, 780, "light"),
    ):
        load(page, url, width=width, height=height, scheme=scheme)
        check(
            f"{name}: nothing is wider than the window",
            page.run("document.documentElement.scrollWidth <= innerWidth"),
        )
        if folder:
            page.screenshot(os.path.join(folder, f"web-{name}.png"))


def main(path, folder=None):
    if not os.path.exists(path):
        print(
            "web passed by: no page, as there is no WebAssembly here "
            "(Debian: clang lld wasi-libc libclang-rt-14-dev-wasm32)"
        )
        return 0
    chromium = browser.find()
    if not chromium:
        print("web passed by: no browser here (Debian: chromium)")
        return 0
    check(
        "the page is small", os.path.getsize(path) <= MOST_BYTES, f"{os.path.getsize(path)} bytes"
    )
    server, url = serve(path)
    page = browser.Browser(chromium)
    try:
        check("a picture comes", bool(load(page, url)))
        the_first_picture_comes_soon(page, url)
        check("the module imports nothing", page.run("state.imports") == 0)
        webgl_draws_what_the_cpu_draws(page)
        every_control_moves(page)
        the_error_keeps_the_tolerance(page)
        the_chain_follows_the_sun(page)
        the_sun_by_itself_is_the_filters_sun(page)
        a_slow_method_can_be_left(page)
        keys_turn_the_view(page)
        files_are_dropped(page)
        files_are_taken_away(page)
        memory_stops_growing(page)
        scalar_is_native(page)
        simd_is_scalar(page, url)
        get = "const get = HTMLCanvasElement.prototype.getContext; "
        without(
            page,
            url,
            get + "HTMLCanvasElement.prototype.getContext = function (kind, ...more) {"
            " return kind === 'webgl2' ? null : get.call(this, kind, ...more); };",
            "without WebGL2 the CPU draws",
            "No WebGL2",
        )
        without(
            page,
            url,
            "WebGL2RenderingContext.prototype.getExtension = () => null;",
            "without linear lookups of floats there are halves",
            "half",
        )
        looks(page, url, folder)
        check("the console stays empty", not page.problems, "; ".join(page.problems[:3]))
    finally:
        page.close()
        server.shutdown()
    print(f"{counts[0]} passed, {counts[1]} failed")
    return counts[1] > 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
