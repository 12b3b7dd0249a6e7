"""A headless chromium, driven over the DevTools protocol, with nothing but Python. Needs Debian's chromium, or CHROMIUM."""

import json
import os
import pathlib
import socket
import struct
import subprocess
import time
import urllib.request

PATIENCE = 120.0
"""Seconds that anything may take."""


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
