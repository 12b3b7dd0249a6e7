"""What a worker does: one shard, rendered by `octolux` as a child process.

This module travels to the workers by value, so that they and the scheduler need no `octolux_dask` of their own. It
therefore uses nothing of this package, takes and returns plain values, and answers instead of raising.
"""

from __future__ import annotations

import os
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any, TypedDict

from distributed import get_worker

# How often a worker looks whether its shard is still wanted, in seconds.
LOOK = 0.1

# How long an unwanted render has for leaving by itself, in seconds.
GRACE = 2.0

# The exit code of a bad scene or a bad option.
BAD_INPUT = 2

# Becomes the program, which the kernel then kills with the thread that waits for it: no render outlives its worker,
# however that dies. The worker may have died before prctl (PR_SET_PDEATHSIG is 1), which getppid then tells.
LEASH = """
import ctypes, os, signal, sys
ctypes.CDLL(None).prctl(1, int(signal.SIGKILL), 0, 0, 0)
if os.getppid() != int(sys.argv[1]):
    sys.exit("the worker has gone")
os.execv(sys.argv[2], sys.argv[2:])
"""


class Order(TypedDict):
    """A shard to render."""

    program: str
    version: str
    # The scene's path in its folder, or everywhere if it is shared.
    scene: str
    # What follows `octolux render SCENE -o PART`.
    arguments: list[str]
    # Where the part goes if file systems are shared, else it comes back in the answer.
    part: str | None


class Answer(TypedDict):
    """How a shard went."""

    # "done"; "input": bad usage or a bad scene; "unfit": this worker cannot help; "failed": worth another try.
    kind: str
    worker: str
    # The part unless it is shared.
    data: bytes
    # What went wrong, as `octolux` said it.
    said: str


def render(files: dict[str, bytes], order: Order) -> Answer:
    """Render one shard of the scene made of `files`, or of the shared one if there are none."""
    worker = get_worker()

    def answer(kind: str, said: str = "", data: bytes = b"") -> Answer:
        return {"kind": kind, "worker": f"{worker.address} on {socket.gethostname()}", "data": data, "said": said}

    program = shutil.which(order["program"])
    if program is None:
        return answer("unfit", f"it has no {order['program']}")
    found = subprocess.run([program, "--version"], capture_output=True, text=True, check=False).stdout.strip()
    if found != order["version"]:
        return answer("unfit", f'it has "{found}" where "{order["version"]}" is wanted')
    try:
        with tempfile.TemporaryDirectory(prefix="octolux-", dir=worker.local_directory) as folder:
            unpack(files, Path(folder))
            part = Path(order["part"] or Path(folder, ".part.acc").absolute())
            command = [program, "render", order["scene"], "-o", str(part), *order["arguments"]]
            code, said = run(command, Path(folder), worker)
            if code == 0:
                return answer("done", data=b"" if order["part"] else part.read_bytes())
    except OSError as error:  # a full disk, no more processes
        return answer("failed", str(error))
    if code < 0:
        said = f"octolux was ended by {signal.Signals(-code).name}\n{said}"
    return answer("input" if code == BAD_INPUT else "failed", said.strip() or f"octolux ended with exit code {code}")


def unpack(files: dict[str, bytes], folder: Path) -> None:
    """Write the scene's files into a folder."""
    for name, data in files.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(data)


def run(command: list[str], folder: Path, worker: Any) -> tuple[int, str]:  # noqa: ANN401 - its module stays lazy
    """Run a child until it ends or Dask no longer wants the task; return its exit code and what it said."""
    key = worker.get_current_task()
    leashed = [sys.executable, "-I", "-S", "-c", LEASH, str(os.getpid()), *command]
    with tempfile.TemporaryFile(dir=worker.local_directory) as said:
        # A session of its own: ctrl-c in the worker's terminal is the worker's to answer.
        with subprocess.Popen(
            leashed, cwd=folder, stdin=subprocess.DEVNULL, stdout=said, stderr=said, start_new_session=True
        ) as child:
            while (code := waited(child, LOOK)) is None:
                task = worker.state.tasks.get(key)
                # Dask cannot interrupt a thread; it says here that the task was cancelled or its client has gone.
                if task is None or task.state == "cancelled":
                    child.terminate()
                    if waited(child, GRACE) is None:
                        child.kill()
        said.seek(0)
        return code, said.read().decode(errors="replace")


def waited(child: subprocess.Popen[bytes], seconds: float) -> int | None:
    """Wait for a child; return its exit code, or nothing if it still runs."""
    try:
        return child.wait(seconds)
    except subprocess.TimeoutExpired:
        return None
