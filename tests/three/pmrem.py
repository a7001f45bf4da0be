#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""usage: tests/three/pmrem.py THREE DIR: three.js in headless Chromium filters DIR/sky.f32, the six
faces of a cube, into DIR/out.f32, level after level. Prints the seconds that all processes of the
browser worked for it, once shaders were compiled and the source was uploaded."""

import base64, os, shutil, sys

sys.dont_write_bytecode = True
HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, os.path.join(HERE, "..", "web"))
import browser, run


def seconds(root):
    """Processor time of a process and of all that descend from it."""
    parent, ticks = {}, {}
    for name in filter(str.isdigit, os.listdir("/proc")):
        try:
            with open(f"/proc/{name}/stat", encoding="utf-8", errors="replace") as file:
                words = file.read().rsplit(")", 1)[1].split()
        except OSError:
            continue
        parent[int(name)], ticks[int(name)] = int(words[1]), int(words[11]) + int(words[12])
    total = 0
    for process in ticks:
        at = process
        while at in parent and at != root:
            at = parent[at]
        total += ticks[process] if at == root else 0
    return total / os.sysconf("SC_CLK_TCK")


def main(three, folder):
    chromium = browser.find()
    if not chromium or not os.path.exists(os.path.join(three, "package.json")):
        sys.exit(f"no browser (Debian: chromium) or no {three} (npm install three)")
    shutil.copy(os.path.join(HERE, "pmrem.html"), folder)
    os.symlink(os.path.abspath(three), os.path.join(folder, "three"))
    server, url = run.serve(os.path.join(folder, "pmrem.html"))
    page = browser.Browser(chromium)
    try:
        page.open(url)
        page.wait("window.revision || window.failure", 300)
        if not page.run("window.revision"):
            sys.exit(page.run("window.failure") or "three.js did not start")
        begun = seconds(page.process.pid)
        text = page.run("window.filter()")
        print(seconds(page.process.pid) - begun)
    finally:
        page.close()
        server.shutdown()
    with open(os.path.join(folder, "out.f32"), "wb") as out:
        out.write(base64.b64decode(text))


if __name__ == "__main__":
    main(*sys.argv[1:])
