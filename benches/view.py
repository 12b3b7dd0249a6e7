#!/usr/bin/env python3
"""How fast the live picture is: from the command to the first picture, from a drag to the turned picture, and what a look costs.

Usage: benches/view.py path/to/octolux [SCENE] [--rounds N]. Needs what tests/view.py needs. Each figure is a median, with the middle
half of the rounds in brackets:

- the first picture and a turned camera, in milliseconds, as a client gets them that draws nothing, and as a page of chromium shows
  them. A headless chromium draws on the processor, with the threads that render: a screen with a graphics card is faster;
- samples a second while such a client looks, over those of `octolux render`, by pairs: from the first figures that the client gets to
  the last, by its clock, so that what a look takes counts wherever it is taken.
"""

import argparse
import json
import pathlib
import shutil
import socket
import statistics
import struct
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "tests"))
from view import DESK, Browser, view  # noqa: E402


class Client:
    """A page that takes every picture and draws none."""

    def __init__(self, address):
        host, token = address.removeprefix("http://").strip("/").split("/")
        name, port = host.split(":")
        self.socket = socket.create_connection((name, int(port)), 60)
        self.socket.sendall(
            f"GET /{token}/live HTTP/1.1\r\nHost: {host}\r\nOrigin: http://{host}\r\nConnection: Upgrade\r\nUpgrade: websocket\r\n"
            "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n".encode()
        )
        self.stream = self.socket.makefile("rb")
        while self.stream.readline() not in (b"\r\n", b""):
            pass

    def say(self, **message):
        text = json.dumps(message).encode()
        head = bytes([0x81, 0x80 | len(text)]) if len(text) < 126 else struct.pack(">BBH", 0x81, 0xFE, len(text))
        self.socket.sendall(head + bytes(4) + text)

    def hear(self):
        """The next message; a picture is its epoch, and asks for the next one."""
        first, size = self.stream.read(2)
        if size >= 126:
            size = int.from_bytes(self.stream.read(2 if size == 126 else 8), "big")
        data = self.stream.read(size)
        if first & 15 == 1:
            message = json.loads(data)
            if message["kind"] == "look":
                self.say(do="next")
            return message
        return {"kind": "picture", "epoch": struct.unpack_from("<I", data, 4)[0]} if first & 15 == 2 else {"kind": ""}

    def until(self, found):
        while True:
            message = self.hear()
            if found(message):
                return message


def told(name, values, unit):
    low, middle, high = statistics.quantiles(values, n=4)
    print(f"{name:44} {middle:7.{3 if not unit else 0}f} ({low:.{3 if not unit else 0}f} to {high:.{3 if not unit else 0}f}) {unit}")


def ended(server):
    server.terminate()
    server.wait()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("octolux")
    parser.add_argument("scene", nargs="?", default=str(ROOT / "scenes/veach-mis.toml"))
    parser.add_argument("--rounds", type=int, default=12)
    parser.add_argument("--spp", type=int, default=512, help="samples of the pairs (512)")
    parser.add_argument("--only-pairs", action="store_true", help="the samples a second alone, without a browser")
    options = parser.parse_args()
    octolux, scene = str(pathlib.Path(options.octolux).resolve()), str(pathlib.Path(options.scene).resolve())
    folder = tempfile.mkdtemp()

    first, turned = [], []
    for _ in range(0 if options.only_pairs else options.rounds):
        begun = time.perf_counter()
        server, address = view(octolux, folder, scene)
        client = Client(address)
        client.until(lambda message: message["kind"] == "picture")
        first.append(1e3 * (time.perf_counter() - begun))
        # A coarse picture may come before the whole one, and be of another epoch.
        epoch = max(client.until(lambda message: message["kind"] == "picture")["epoch"] for _ in range(3))
        camera = client.until(lambda message: message["kind"] == "status")["camera"]
        eye = [x + 0.1 for x in camera["origin"]]
        begun = time.perf_counter()
        client.say(do="camera", origin=eye, target=camera["target"], up=camera["up"], focus=camera.get("focus"))
        client.until(lambda message: message["kind"] == "picture" and message["epoch"] > epoch)
        turned.append(1e3 * (time.perf_counter() - begun))
        ended(server)
    if not options.only_pairs:
        told("first picture at a client, from the command", first, "ms")
        told("turned picture at a client", turned, "ms")

    ratios, rates = [], []
    for _ in range(options.rounds):
        command = [octolux, "render", scene, "--spp", str(options.spp), "-o", "r.npy", "--json"]
        stats = json.loads(subprocess.run(command, cwd=folder, check=True, capture_output=True).stdout)
        server, address = view(octolux, folder, scene, "--spp", str(options.spp))
        client = Client(address)
        begun = client.until(lambda message: message["kind"] == "status" and message["picture"]["samples"] > 0)
        first = time.perf_counter()
        looks, done = 0, begun
        while done["state"] != "done":
            done = client.until(lambda message: message["kind"] in ("status", "picture"))
            looks += done["kind"] == "picture"
            done = done if done["kind"] == "status" else begun
        seconds = time.perf_counter() - first
        share = (done["picture"]["samples"] - begun["picture"]["samples"]) / done["picture"]["samples"]
        ratios.append(share * stats["render_s"] / seconds)
        rates.append(looks / seconds)
        ended(server)
    told("pictures a second at a client", rates, "")
    told("samples a second while a client looks / render's", ratios, "")

    if options.only_pairs:
        return
    first, turned = [], []
    browser = Browser(folder)
    browser.screen(*DESK)
    for _ in range(options.rounds):
        begun = time.time()
        server, address = view(octolux, folder, scene)
        browser.call("Page.navigate", url=address)
        browser.until("window.octolux?.drawn")
        first.append(browser.ask("octolux.drawn.first") - 1e3 * begun)
        time.sleep(0.5)
        turned.append(browser.ask("""(async () => {
          const epoch = octolux.drawn.epoch, begun = performance.now();
          octolux.camera.orbit(0.05, 0);
          while (octolux.drawn.epoch === epoch) await new Promise(next => setTimeout(next, 1));
          return octolux.drawn.at - begun;
        })()"""))
        ended(server)
    browser.end()
    told("first picture in chromium, from the command", first, "ms")
    told("turned picture in chromium", turned, "ms")
    shutil.rmtree(folder, ignore_errors=True)


if __name__ == "__main__":
    sys.exit(main())
