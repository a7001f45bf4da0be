#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""usage: tests/three/run.py THREE ENVMAP BALLS DIR: three.js in headless Chromium draws balls from
what `ENVMAP bake --for three` wrote, and agrees with BALLS (balls.c), which read none of it.

THREE is the folder of the package, DIR where files go. The last line counts "N passed, N failed".
Without the package or a Chromium it passes by and says so."""

import array, base64, math, os, re, shutil, subprocess, sys

sys.dont_write_bytecode = True
HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, os.path.join(HERE, "..", "web"))
import browser, run

PIXELS = 64
NAMES = [f"{kind}, roughness {k / 5}" for kind in ("metal", "dielectric") for k in range(6)]
NAMES += ["its LightProbe of the manifest's nine numbers", "a mirror by environment.hdr"]
MOST = 0.02


def bake(envmap, balls, folder):
    """sky.pfm, what is baked of it, and ours. The sun is dimmed: its edge would be all error."""
    sky, out = os.path.join(folder, "sky.pfm"), os.path.join(folder, "out")
    ours = os.path.join(folder, "ours")
    for command in (
        [envmap, "generate", "sun", sky, "--size", "128"],
        [envmap, "bake", sky, out, "--for", "three"]
        + ["--size", "64", "--levels", "5", "--limit", "20"],
        [balls, sky, ours],
    ):
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    with open(ours, "rb") as file:
        return array.array("f", file.read())


def site(three, folder):
    """The page beside the package and the block of docs/bake.md; returns the page's path."""
    with open(os.path.join(HERE, "..", "..", "docs", "bake.md"), encoding="utf-8") as file:
        block = re.search(r"```js\n(.*?)```", file.read(), re.S)[1]
    with open(os.path.join(folder, "baked.js"), "w", encoding="utf-8") as file:
        file.write(block)
    shutil.copy(os.path.join(HERE, "page.html"), folder)
    os.symlink(os.path.abspath(three), os.path.join(folder, "three"))
    return os.path.join(folder, "page.html")


def difference(theirs, ours):
    """Relative rms over the pixels of a ball of ours, and the worst error of one."""
    error = all_ = worst = 0.0
    for i in range(3 * PIXELS * PIXELS):
        want, got = ours[i], theirs[i]
        if want > 0:
            error, all_ = error + (got - want) ** 2, all_ + want * want
            worst = max(worst, abs(got - want) / want)
    return (math.sqrt(error / all_) if all_ > 0 else math.inf), worst


def main(three, envmap, balls, folder):
    chromium = browser.find()
    if not os.path.exists(os.path.join(three, "package.json")):
        print(
            f"three passed by: no {three} here "
            "(npm install --prefix build/npm three@0.187.0 ktx-parse@2.0.0)"
        )
        return 0
    if not chromium:
        print("three passed by: no browser here (Debian: chromium)")
        return 0
    shutil.rmtree(folder, ignore_errors=True)
    os.makedirs(folder)
    ours = bake(envmap, balls, folder)
    server, url = run.serve(site(three, folder))
    page = browser.Browser(chromium)
    try:
        page.open(url)
        page.wait("window.balls || window.failure", 120)
        drawn = run.check(
            f"three.js {page.run('window.revision')} draws",
            bool(page.run("window.balls")),
            page.run("window.failure") or "",
        )
        size = 3 * PIXELS * PIXELS
        for k, name in enumerate(NAMES if drawn else ()):
            theirs = array.array("f", base64.b64decode(page.run(f"window.balls[{k}]")))
            rms, worst = difference(theirs, ours[k * size : (k + 1) * size])
            run.check(name, rms <= MOST, f"rms {100 * rms:.2f} %, worst {100 * worst:.2f} %")
        run.check("the console stays empty", not page.problems, "; ".join(page.problems[:3]))
    finally:
        page.close()
        server.shutdown()
    print(f"{run.counts[0]} passed, {run.counts[1]} failed")
    return run.counts[1] > 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
