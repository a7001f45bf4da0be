# SPDX-License-Identifier: MIT
"""Chromium without a screen, through its debugging port: a page, what it says, what it shows."""

import base64, json, os, re, shutil, socket, struct, subprocess, tempfile, time


def find():
    """Path of a Chromium, or None."""
    return next(
        filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None
    )


class Browser:
    """Call names are those of the DevTools protocol; errors collect in `problems`."""

    def __init__(self, path, flags=()):
        self.folder = tempfile.mkdtemp()
        self.process = subprocess.Popen(
            [
                path,
                "--headless=new",
                "--no-sandbox",
                "--remote-debugging-port=0",
                "--no-first-run",
                "--user-data-dir=" + self.folder,
                "--use-angle=swiftshader",
                "--enable-unsafe-swiftshader",
                "--hide-scrollbars",
                "--disable-extensions",
                *flags,
                "about:blank",
            ],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
        )
        for line in self.process.stderr:
            found = re.search(r"ws://127\.0\.0\.1:(\d+)(/\S+)", line)
            if found:
                break
        else:
            raise RuntimeError("chromium ended before it listened")
        self.socket = socket.create_connection(("127.0.0.1", int(found[1])), timeout=120)
        key = base64.b64encode(os.urandom(16)).decode()
        self.socket.sendall(
            (
                f"GET {found[2]} HTTP/1.1\r\nHost: 127.0.0.1:{found[1]}\r\nUpgrade: websocket\r\n"
                f"Connection: Upgrade\r\nSec-WebSocket-Key: {key}\r\n"
                "Sec-WebSocket-Version: 13\r\n\r\n"
            ).encode()
        )
        self.rest, self.count, self.problems, self.session = b"", 0, [], None
        while b"\r\n\r\n" not in self.rest:
            self.rest += self.socket.recv(4096)
        self.rest = self.rest.split(b"\r\n\r\n", 1)[1]
        target = self.call("Target.createTarget", url="about:blank")["targetId"]
        self.session = self.call("Target.attachToTarget", targetId=target, flatten=True)[
            "sessionId"
        ]
        for domain in ("Page", "Runtime", "Log"):
            self.call(domain + ".enable")

    def take(self, count):
        while len(self.rest) < count:
            more = self.socket.recv(1 << 20)
            if not more:
                raise RuntimeError("chromium closed the connection")
            self.rest += more
        out, self.rest = self.rest[:count], self.rest[count:]
        return out

    def message(self):
        """The next whole message; frames of 7, 16 or 64 bits of length."""
        text, last = b"", False
        while not last:
            first, second = self.take(2)
            last, size = first & 128, second & 127
            if size > 125:
                size = int.from_bytes(self.take(2 if size == 126 else 8), "big")
            text += self.take(size)
        return json.loads(text)

    def call(self, method, **arguments):
        self.count += 1
        body = {"id": self.count, "method": method, "params": arguments}
        if self.session:
            body["sessionId"] = self.session
        data, mask = json.dumps(body).encode(), os.urandom(4)
        long = struct.pack(">BQ", 255, len(data))
        masked = int.from_bytes(data, "big") ^ int.from_bytes(
            (mask * (len(data) // 4 + 1))[: len(data)], "big"
        )
        self.socket.sendall(b"\x81" + long + mask + masked.to_bytes(len(data), "big"))
        while True:
            answer = self.message()
            self.note(answer)
            if answer.get("id") == self.count:
                if "error" in answer:
                    raise RuntimeError(f"{method}: {answer['error']['message']}")
                return answer["result"]

    def note(self, event):
        kind, what = event.get("method"), event.get("params", {})
        if kind == "Runtime.exceptionThrown":
            self.problems.append(
                what["exceptionDetails"].get("exception", {}).get("description", "exception")
            )
        elif kind == "Runtime.consoleAPICalled" and what["type"] in ("error", "warning", "assert"):
            self.problems.append(
                " ".join(str(a.get("value", a.get("description"))) for a in what["args"])
            )
        elif kind == "Log.entryAdded" and what["entry"]["level"] in ("error", "warning"):
            self.problems.append(what["entry"]["text"])

    def open(self, url, width=1280, height=800, scheme="light", motion="reduce"):
        self.call(
            "Emulation.setDeviceMetricsOverride",
            width=width,
            height=height,
            deviceScaleFactor=1,
            mobile=False,
        )
        self.call(
            "Emulation.setEmulatedMedia",
            features=[
                {"name": "prefers-color-scheme", "value": scheme},
                {"name": "prefers-reduced-motion", "value": motion},
            ],
        )
        self.call("Page.navigate", url=url)

    def run(self, code):
        """The value of an expression in the page; promises are waited for."""
        out = self.call("Runtime.evaluate", expression=code, awaitPromise=True, returnByValue=True)
        if "exceptionDetails" in out:
            raise RuntimeError(
                out["exceptionDetails"].get("exception", {}).get("description", code)
            )
        return out["result"].get("value")

    def wait(self, code, seconds=60):
        """Until an expression is true; its value, or None when that takes too long."""
        end = time.time() + seconds
        while time.time() < end:
            value = self.run(code)
            if value:
                return value
            time.sleep(0.02)
        return None

    def screenshot(self, path):
        with open(path, "wb") as out:
            out.write(base64.b64decode(self.call("Page.captureScreenshot", format="png")["data"]))

    def close(self):
        try:
            self.session = None
            self.call("Browser.close")
        except (RuntimeError, OSError):
            self.process.terminate()
        self.process.wait(30)
        shutil.rmtree(self.folder, ignore_errors=True)
