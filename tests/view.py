#!/usr/bin/env python3
"""The live picture in a real browser, without a network.

The picture arrives and converges to that of a file, the camera turns, a race of four runs, a sample is drawn with the right number
of directions and blocked rays, files are written, fingers turn the camera; no message on the console, nothing asked of any other
server, nothing wider than the screen; on a desk and on a phone, dark and light. Needs Debian's chromium, or CHROMIUM, and nothing but Python.

Usage: tests/view.py path/to/octolux [--screenshots FOLDER]. How fast it is: benches/view.py.
"""

import argparse
import base64
import json
import os
import pathlib
import shutil
import socket
import struct
import subprocess
import sys
import tempfile
import time
import urllib.request

PATIENCE = 120.0
"""Seconds that anything may take."""

ROOT = pathlib.Path(__file__).resolve().parent.parent
DESK, PHONE = (1280, 800, 1, False), (390, 844, 3, True)


class Browser:
    """A page of a headless chromium, over the DevTools protocol."""

    def __init__(self, folder):
        command = [
            os.environ.get("CHROMIUM", "chromium"), "--headless", "--no-sandbox", "--disable-gpu", "--disable-background-networking",
            "--disable-component-update", "--no-first-run", "--remote-debugging-port=0", f"--user-data-dir={folder}/profile",
            "--host-resolver-rules=MAP * ~NOTFOUND, EXCLUDE 127.0.0.1", "about:blank",
        ]
        self.log = open(f"{folder}/console", "wb")
        self.process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=self.log)
        port = wait(lambda: self.port(folder), "the browser")
        pages = json.load(urllib.request.urlopen(f"http://127.0.0.1:{port}/json/list"))
        target = next(page for page in pages if page["type"] == "page")["webSocketDebuggerUrl"]
        self.socket = socket.create_connection(("127.0.0.1", port), PATIENCE)
        path = target.split(str(port), 1)[1]
        self.socket.sendall(
            f"GET {path} HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n"
            "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n".encode()
        )
        self.stream = self.socket.makefile("rb")
        while self.stream.readline() not in (b"\r\n", b""):
            pass
        self.number, self.problems, self.requests = 0, [], []
        for domain in ("Page", "Runtime", "Log", "Network"):
            self.call(f"{domain}.enable")

    @staticmethod
    def port(folder):
        try:
            return int(pathlib.Path(folder, "profile/DevToolsActivePort").read_text().split()[0])
        except (FileNotFoundError, IndexError):
            return None

    def call(self, method, **parameters):
        self.number += 1
        text = json.dumps({"id": self.number, "method": method, "params": parameters}).encode()
        size = len(text)
        head = bytes([0x81, 0x80 | size]) if size < 126 else struct.pack(">BBH", 0x81, 0xFE, size) if size < 65536 \
            else struct.pack(">BBQ", 0x81, 0xFF, size)
        self.socket.sendall(head + bytes(4) + text)  # a mask of zeros
        while True:
            message = json.loads(self.message())
            if message.get("id") == self.number:
                if "error" in message:
                    raise RuntimeError(f"{method}: {message['error']}")
                return message["result"]
            self.note(message)

    def message(self):
        text = b""
        while True:
            first, second = self.stream.read(2)
            size = second & 127
            if size >= 126:
                size = int.from_bytes(self.stream.read(2 if size == 126 else 8), "big")
            text += self.stream.read(size)
            if first & 0x80:
                return text

    def note(self, message):
        method, parameters = message.get("method"), message.get("params", {})
        if method == "Runtime.consoleAPICalled":
            self.problems.append(("console", parameters["args"]))
        elif method == "Runtime.exceptionThrown":
            self.problems.append(("exception", parameters["exceptionDetails"]))
        elif method == "Log.entryAdded" and "getImageData" not in parameters["entry"]["text"]:  # which this test calls
            self.problems.append(("log", parameters["entry"]))
        elif method == "Network.requestWillBeSent":
            self.requests.append(parameters["request"]["url"])
        elif method == "Network.webSocketCreated":
            self.requests.append(parameters["url"])

    def ask(self, expression):
        answer = self.call("Runtime.evaluate", expression=expression, returnByValue=True, awaitPromise=True)
        if "exceptionDetails" in answer:
            raise RuntimeError(f"{expression}: {answer['exceptionDetails']}")
        return answer["result"].get("value")

    def until(self, expression):
        return wait(lambda: self.ask(expression), expression)

    def screen(self, width, height, scale, mobile):
        self.call("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=scale, mobile=mobile)

    def colours(self, scheme):
        self.call("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": scheme}])

    def mouse(self, kind, x, y, **more):
        self.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", clickCount=1, **more)

    def click(self, x, y):
        self.mouse("mousePressed", x, y, buttons=1)
        self.mouse("mouseReleased", x, y)

    def touch(self, kind, *points):
        points = [{"x": x, "y": y, "id": i} for i, (x, y) in enumerate(points)]
        self.call("Input.dispatchTouchEvent", type=kind, touchPoints=points)

    def drag(self, *fingers):
        """Each finger goes from a point to another."""
        self.touch("touchStart", *(begin for begin, _ in fingers))
        for step in range(1, 9):
            self.touch("touchMove", *([a + (b - a) * step / 8 for a, b in zip(*finger)] for finger in fingers))
        self.touch("touchEnd")

    def press(self, selector):
        self.ask(f"document.querySelector({json.dumps(selector)}).click()")

    def key(self, key):
        for kind in ("keyDown", "keyUp"):
            self.call("Input.dispatchKeyEvent", type=kind, key=key, text=key if kind == "keyDown" and len(key) == 1 else "")

    def end(self):
        self.process.terminate()
        self.process.wait()
        self.log.close()


def wait(look, what):
    deadline = time.monotonic() + PATIENCE
    while time.monotonic() < deadline:
        found = look()
        if found:
            return found
        time.sleep(0.02)
    raise SystemExit(f"error: this does not come: {what}")


def view(octolux, folder, *arguments):
    """A server and its address."""
    command = [octolux, "view", "--no-open", "--quiet", *arguments]
    process = subprocess.Popen(command, cwd=folder, stdout=subprocess.PIPE, text=True)
    return process, process.stdout.readline().strip()


# The pixels of a layer as bits of half floats, added up in a way that any difference changes.
SUM = "(l => { let s = 0; for (const h of l.halves) s = (s * 31 + h) >>> 0; return s; })(octolux.layers.get(0))"
FITS = "document.documentElement.scrollWidth <= innerWidth && document.body.scrollHeight <= innerHeight + 1"
SPREAD = """(() => { const c = document.getElementById('stage'), d = c.getContext('2d').getImageData(0, 0, c.width, c.height).data,
  seen = new Set(); for (let i = 0; i < d.length; i += 4 * 97) seen.add(d[i] << 16 | d[i + 1] << 8 | d[i + 2]); return seen.size; })()"""


def halves_of(path):
    """The same sum over the half floats of an .npy file, rounded as the hardware rounds."""
    data = pathlib.Path(path).read_bytes()
    start = 10 + int.from_bytes(data[8:10], "little")
    total = 0
    for (value,) in struct.iter_unpack("<f", data[start:]):
        try:
            (bits,) = struct.unpack("<H", struct.pack("<e", value))
        except OverflowError:
            bits = 0x7C00
        total = (total * 31 + bits) & 0xFFFFFFFF
    return total


def check(truth, what):
    if not truth:
        raise SystemExit(f"error: {what}")
    print(f"  {what}")


def middle(browser, u=0.5, v=0.5):
    """A point of the picture on the page."""
    return browser.ask(f"""(() => {{ const s = octolux.stage, p = s.place(s.cells(1)[0]), b = s.canvas.getBoundingClientRect();
      return [b.left + (p.x + {u} * p.w) / s.ratio, b.top + (p.y + {v} * p.h) / s.ratio]; }})()""")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("octolux")
    parser.add_argument("--screenshots", help="keep pictures of the page in this folder")
    options = parser.parse_args()
    octolux = str(pathlib.Path(options.octolux).resolve())
    folder = tempfile.mkdtemp()
    browser, server = None, None
    try:
        browser = Browser(folder)
        shutil.copy(ROOT / "scenes/veach-mis.toml", folder)
        server, address = view(octolux, folder, "veach-mis.toml", "--estimator", "mis", "--size", "192x128", "--spp", "32", "--reference-time", "1")

        def shot(name):
            if options.screenshots:
                os.makedirs(options.screenshots, exist_ok=True)
                data = browser.call("Page.captureScreenshot", format="png")["data"]
                pathlib.Path(options.screenshots, f"{name}.png").write_bytes(base64.b64decode(data))

        browser.screen(*DESK)
        browser.colours("light")
        browser.call("Page.navigate", url=address)

        print("picture")
        browser.until("window.octolux?.status?.state === 'done' && octolux.status.picture.least === 32 && octolux.layers.get(0)")
        render = [octolux, "render", "veach-mis.toml", "--estimator", "mis", "--size", "192x128", "--spp", "32", "--quiet"]
        subprocess.run([*render, "-o", "file.npy", "-o", "file.exr"], cwd=folder, check=True)
        expected = halves_of(f"{folder}/file.npy")
        browser.until(f"{SUM} === {expected}")
        check(True, "the picture has the bits of the file")
        check(browser.ask(SPREAD) > 50, "the canvas shows it")
        browser.key("w")
        browser.until("/wrote veach-mis.exr/.test(document.getElementById('message').textContent)")
        same = pathlib.Path(folder, "veach-mis.exr").read_bytes() == pathlib.Path(folder, "file.exr").read_bytes()
        check(same, "the written file has the bytes of octolux render's")
        browser.key("f")
        check(browser.ask("document.getElementById('tone').value === 'false'"), "F shows false colour")
        shot("false-colour")
        browser.key("f")
        browser.key("f")
        browser.key("]")
        shot("written")
        check(browser.ask("octolux.tone.stops === 0.25"), "] brightens")
        browser.key("[")

        print("sample")
        x, y = middle(browser, 0.5, 0.75)
        browser.click(x, y)
        browser.until("octolux.samples.sample")
        at = browser.ask("[octolux.samples.sample.x, octolux.samples.sample.y]")
        replay = [octolux, "render", "veach-mis.toml", "--estimator", "mis", "--size", "192x128", "--replay", f"{at[0]},{at[1]},0", "--json"]
        told = json.loads(subprocess.run(replay, cwd=folder, check=True, capture_output=True).stdout)
        drawn = [asked for asked in told["asked"] if asked["found"]]
        counts = [len(told["asked"]), len(drawn), sum(asked["found"]["occluded"] for asked in drawn)]
        shown = browser.ask("[octolux.samples.asked, octolux.samples.drawn.length, octolux.samples.blocked]")
        check(shown == counts and counts[0] >= 5, f"{counts[0]} directions, {counts[1]} drawn, {counts[2]} blocked, as --replay says")
        browser.ask("(() => { const c = document.getElementById('sample-count'); c.value = 6; c.oninput(); })()")
        browser.until("octolux.samples.sample.replays.length === 64")
        check(browser.ask("octolux.samples.asked") == 64 * counts[0], "64 passes of them")
        shot("sample")
        browser.key("Escape")

        print("camera")
        before = browser.ask("octolux.status.epoch")
        browser.press("#tool-camera")
        x, y = middle(browser)
        browser.mouse("mousePressed", x, y, buttons=1)
        for step in range(1, 6):
            browser.mouse("mouseMoved", x + 12 * step, y + 4 * step, buttons=1)
        browser.mouse("mouseReleased", x + 60, y + 20)
        browser.until(f"octolux.status.epoch > {before} && octolux.status.state === 'done' && octolux.status.turned")
        browser.until(f"{SUM} !== {expected}")
        check(True, "dragging turns it")
        check("origin = [0.0, 2.0, 15.0]" not in browser.ask("document.getElementById('camera-table').textContent"), "its table is told")
        shot("turned")
        browser.key("Home")
        browser.until(f"octolux.status.state === 'done' && !octolux.status.turned && octolux.layers.get(0)?.width === 192 && {SUM} === {expected}")
        check(True, "Home takes it back, to the same bits")
        browser.press("#tool-look")

        print("race")
        browser.key("r")
        shot("race-setup")
        browser.press("#race-start")
        browser.until("octolux.status.race?.racers.length === 4 && octolux.status.race.racers.every(r => r.curve.length > 8)")
        check(browser.ask("[0, 1, 2, 3, 255].every(id => octolux.layers.get(id)?.width === 192)"), "four pictures and a reference")
        check(browser.ask("document.querySelectorAll('#standings tbody tr').length === 4"), "four lines of standings")
        shot("race")
        browser.key("x")
        shot("race-error")
        browser.key("x")
        browser.press("#race-divider")
        browser.until("document.querySelectorAll('#labels span').length === 4")
        shot("race-divider")
        browser.colours("dark")
        browser.press("#race-grid")
        time.sleep(0.3)
        shot("race-dark")
        check(browser.ask(FITS), "nothing is wider than the screen")
        browser.press("[data-close=race]")
        browser.until("octolux.status.race === null")

        print("scene")
        browser.key("s")
        browser.until("document.querySelectorAll('#scene-text div').length > 50")
        path = pathlib.Path(folder, "veach-mis.toml")
        text = path.read_text()
        path.write_text(text.replace("radius = 0.1\n", "radius = -0.1\n"))
        browser.until("document.querySelector('#scene-text .wrong')?.textContent.includes('-0.1')")
        check(browser.ask("!document.getElementById('scene-error').hidden"), "an error shows at its line")
        shot("scene-error-dark")
        path.write_text(text)
        browser.until("document.getElementById('scene-error').hidden && octolux.status.state === 'done'")
        check(True, "and goes when it is mended")
        shot("scene-dark")

        print("phone")
        browser.ask("document.getElementById('stage').focus()")
        browser.screen(*PHONE)
        time.sleep(0.3)
        check(browser.ask(FITS), "nothing is wider than the screen, with the scene")
        shot("phone-scene-dark")
        browser.press("[data-close=scene]")
        browser.colours("light")
        # On a busy machine the canvas takes its new size later than the key would come.
        browser.until("""(() => { const box = octolux.stage.canvas.getBoundingClientRect();
          return octolux.stage.pixel(box.left + box.width / 2, box.top + box.height / 2, 1).inside; })()""")
        browser.key("Enter")
        browser.until("!document.getElementById('sample-panel').hidden")
        time.sleep(0.3)
        check(browser.ask(FITS), "nor with a sample")
        shot("phone-sample")
        browser.key("Escape")
        time.sleep(0.2)
        check(browser.ask(SPREAD) > 50, "the picture is there")
        shot("phone")

        browser.call("Emulation.setTouchEmulationEnabled", enabled=True, maxTouchPoints=2)
        browser.press("#tool-camera")
        x, y = middle(browser)
        eye, distance = "JSON.stringify(octolux.camera.view.origin)", "octolux.camera.axes().distance"
        was, far = browser.ask(eye), browser.ask(distance)
        browser.drag(((x - 40, y), (x + 40, y + 10)))
        check(browser.ask(eye) != was and abs(browser.ask(distance) / far - 1) < 1e-6, "a finger turns the camera")
        browser.until("octolux.status.turned")
        browser.drag(((x - 30, y), (x - 90, y)), ((x + 30, y), (x + 90, y)))
        check(abs(browser.ask(distance) / far - 1 / 3) < 0.01, "two fingers that part go nearer")
        target = browser.ask("JSON.stringify(octolux.camera.view.target)")
        browser.drag(((x - 30, y), (x - 30, y + 60)), ((x + 30, y), (x + 30, y + 60)))
        check(browser.ask("JSON.stringify(octolux.camera.view.target)") != target, "two fingers side by side move it")
        browser.press("#camera-reset")
        browser.until("!octolux.status.turned")
        was = browser.ask("octolux.stage.zoom")
        browser.press("#tool-look")
        browser.drag(((x - 30, y), (x - 60, y)), ((x + 30, y), (x + 60, y)))
        check(abs(browser.ask("octolux.stage.zoom") / was - 2) < 0.05, "or zoom the picture")

        print("manners")
        foreign = [url for url in browser.requests if not url.split("://", 1)[1].startswith(address.split("://", 1)[1])]
        check(not foreign, f"nothing is asked of others {foreign or ''}")
        check(not browser.problems, f"nothing on the console {browser.problems or ''}")
        check(server.poll() is None, "the server is there")
    finally:
        if browser:
            browser.end()
        if server:
            server.terminate()
            server.wait()
        shutil.rmtree(folder, ignore_errors=True)
    print("all is there")


if __name__ == "__main__":
    sys.exit(main())
