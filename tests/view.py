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
import struct
import subprocess
import sys
import tempfile
import time

from chromium import Browser

ROOT = pathlib.Path(__file__).resolve().parent.parent
DESK, PHONE = (1280, 800, 1, False), (390, 844, 3, True)


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


def check_quiet(truth, what):
    if not truth:
        raise SystemExit(f"error: {what}")


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
        rows = browser.ask("[...document.querySelectorAll('#directions tbody tr')].map(row => row.cells[1].textContent)")
        check(rows == [f"sphere {asked['sphere'] + 1}" for asked in told["asked"]], "a line of numbers for each direction")
        lobes = [asked for asked in told["asked"] if asked["lobe"] and any(asked["lobe"])]
        missed = bool(lobes) and not any(asked["found"] for asked in lobes)
        check(browser.ask("octolux.samples.missed.length") == missed, "a direction of the lobe that meets no light is drawn once")
        browser.ask("(() => { const c = document.getElementById('sample-count'); c.value = 6; c.oninput(); })()")
        browser.until("octolux.samples.sample.replays.length === 64")
        check(browser.ask("octolux.samples.asked") == 64 * counts[0], "64 passes of them")
        shot("sample")
        # Every pass of a drawing has met the surface of the first one: an edge has two, with a hemisphere each.
        browser.ask("(() => { const c = document.getElementById('sample-count'); c.value = 5; c.oninput(); })()")
        edges = 0
        for row in range(50, 128, 3):
            browser.ask(f"octolux.samples.sample = null, octolux.samples.open(70, {row}, 0)")
            browser.until("octolux.samples.sample?.replays.length === 32")
            normals, shown = browser.ask("[octolux.samples.sample.replays.map(r => r.point?.n ?? null), octolux.samples.shown.map(r => r.point.n)]")
            first = next((n for n in normals if n), None)
            near = [n for n in normals if n and sum(a * b for a, b in zip(n, first)) > 0.9]
            check_quiet(shown == near, f"row {row}: of one surface")
            edges += len(near) < sum(n is not None for n in normals)
        check(edges > 0, f"of {edges} pixels with an edge one side is drawn")
        browser.ask("(() => { const c = document.getElementById('estimator'); c.value = 'product'; c.onchange(); })()")
        browser.until("octolux.status.estimator === 'product' && octolux.status.state === 'done'")
        browser.ask("octolux.samples.sample = null, octolux.samples.open(42, 92, 0)")
        browser.until("octolux.samples.sample?.estimator === 'product'")
        arcs = browser.ask("octolux.samples.rings().map(({ wr, cap, theta, around }) => [theta, cap.cos])")
        check(browser.ask("octolux.samples.point.model") == "phong" and arcs, f"{len(arcs)} rings of product")
        browser.until("/ring/.test(document.getElementById('legend').textContent)")
        shot("sample-product")
        browser.ask("(() => { const c = document.getElementById('estimator'); c.value = 'mis'; c.onchange(); })()")
        browser.until("octolux.status.estimator === 'mis' && octolux.status.state === 'done'")
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
        check(browser.ask("octolux.status.race.rims > 0"), "pixels at the rims of lights are not counted")
        browser.press("[data-close=race]")
        browser.until("octolux.status.race === null")
        browser.key("r")
        browser.ask("(() => { document.getElementById('race-by').value = 'oracle'; document.getElementById('race-seconds').value = 0.5; })()")
        browser.press("#race-start")
        browser.until("octolux.status.race?.reference.by === 'oracle' && octolux.status.race.reference.ready")
        browser.until("octolux.status.race.racers.every(r => r.curve.length > 2)")
        check(browser.ask("octolux.status.race.reference.noise > 0"), "the oracle renders a reference and knows its noise")
        shot("race-oracle")
        browser.ask("octolux.camera.orbit(0.1, 0)")
        browser.until("octolux.status.race === null && /camera/.test(document.getElementById('message').textContent)")
        check(True, "a race that a turned camera ends says so")
        browser.press("#camera-reset")
        browser.press("[data-close=race]")
        browser.until("octolux.status.state === 'done' && !octolux.status.turned")

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
        browser.ask("(() => { const r = document.querySelector('#lights input'); r.value = 2; r.oninput(); })()")
        browser.until("octolux.status.gains[0] === 4 && octolux.status.state === 'done'")
        browser.call("Page.reload")
        browser.until("window.octolux?.status && document.querySelector('#lights input')?.value === '2'")
        check(True, "a page that comes later knows a light that was changed")
        browser.press("#lights-reset")
        browser.until("octolux.status.gains.every(gain => gain === 1) && octolux.status.state === 'done'")
        browser.until("document.querySelector('#lights input').value === '0'")
        browser.key("s")
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
