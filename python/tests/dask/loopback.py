"""A Dask cluster of separate processes on 127.0.0.1, an Octolux that can be told to fail, and who of them is alive."""

import hashlib
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import uuid
from collections.abc import Callable
from pathlib import Path
from types import TracebackType
from typing import BinaryIO, Self

REPOSITORY = Path(__file__).resolve().parents[3]
OCTOLUX = os.environ.get("OCTOLUX", str(REPOSITORY / "target/release/octolux"))
SCENE = REPOSITORY / "scenes/veach-mis.toml"

# Whoever descends from a test has this variable with the test's mark.
MARK = "OCTOLUX_TEST_MARK"


class Place:
    """A working folder, a program `octolux` in it, and the processes that are started from there."""

    def __init__(self) -> None:
        """Make the folder; the program is the real one until `program` says otherwise."""
        self.folder = Path(tempfile.mkdtemp(prefix="octolux-test-"))
        self.mark = uuid.uuid4().hex
        self.cluster: list[subprocess.Popen[bytes]] = []
        self._held: BinaryIO | None = None
        self.environment = {**os.environ, MARK: self.mark}
        os.mkfifo(self.folder / "held")
        # The shell itself waits: it has no child that could be left over.
        self.octolux = self.program("bin", 'if [ -e $here/hold ] && [ "$1" = render ]; then read line < $here/held; fi')

    def __enter__(self) -> Self:
        """Use it."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """End what was started and remove the folder."""
        for process in self.cluster:
            process.kill()
            process.wait()
        for process_id in self.alive():
            os.kill(process_id, signal.SIGKILL)
        if self._held:
            self._held.close()
        shutil.rmtree(self.folder)

    def program(self, folder: str, before: str) -> Path:
        """Write an `octolux` that runs the shell text `before` and then becomes the real one."""
        path = self.folder / folder / "octolux"
        path.parent.mkdir(exist_ok=True)
        path.write_text(f'#!/bin/sh\nhere={self.folder}\n{before}\nexec {OCTOLUX} "$@"\n')
        path.chmod(0o755)
        return path

    def hold(self) -> None:
        """Let renders that start from now on wait for ever: who sees one end knows that it was killed."""
        (self.folder / "hold").touch()

    def release(self) -> None:
        """Let them go on."""
        (self.folder / "hold").unlink()
        # Open for reading too: it must not wait for readers, nor they for more.
        self._held = (self.folder / "held").open("r+b", buffering=0)
        self._held.write(b"\n" * 100)

    def start(self, *words: str | Path, program: str | Path | None = None) -> subprocess.Popen[str]:
        """Start `octolux-dask`."""
        command = [sys.executable, "-m", "octolux_dask.cli", *words, "--octolux", program or self.octolux]
        return subprocess.Popen(
            command, cwd=self.folder, env=self.environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
        )

    def run(self, *words: str | Path, program: str | Path | None = None) -> tuple[int, str]:
        """Run `octolux-dask`; return its exit code and what it said."""
        process = self.start(*words, program=program)
        _, said = process.communicate(timeout=120)
        return process.returncode, said

    def one_process(self, *words: str | Path, picture: str = "one.npy") -> str:
        """Render by one `octolux render`; return the picture's SHA-256."""
        command = [OCTOLUX, "render", *words, "-o", picture, "--quiet"]
        subprocess.run(command, cwd=self.folder, check=True)
        return self.sha256(picture)

    def sha256(self, name: str) -> str:
        """Hash a file of the folder."""
        return hashlib.sha256((self.folder / name).read_bytes()).hexdigest()

    def scheduler(self) -> str:
        """Start `dask scheduler`; return its scheduler file."""
        file = self.folder / "scheduler.json"
        address = ("--host", "127.0.0.1", "--port", "0", "--dashboard-address", "127.0.0.1:0")
        self._dask("scheduler", *address, "--scheduler-file", str(file))
        self.wait_for(file.exists)
        return str(file)

    def worker(self, scheduler: str, *options: str) -> subprocess.Popen[bytes]:
        """Start `dask worker` with one thread."""
        words = ("worker", "--scheduler-file", scheduler, "--nthreads", "1", "--no-dashboard", *options)
        return self._dask(*words, "--local-directory", str(self.folder / "workers"))

    def registered(self) -> int:
        """Count the workers that the scheduler took in."""
        return (self.folder / "dask.log").read_text().count("Register worker addr")

    def _dask(self, *words: str) -> subprocess.Popen[bytes]:
        # Neither the scheduler nor the workers may find this package: only its callers need it.
        command = [sys.executable, "-m", "dask", *words]
        environment = {key: value for key, value in self.environment.items() if key != "PYTHONPATH"}
        with (self.folder / "dask.log").open("ab") as log:
            process = subprocess.Popen(command, env=environment, cwd=self.folder, stdout=log, stderr=log)
        self.cluster.append(process)
        return process

    def alive(self, *command: str, parent: int | None = None) -> list[int]:
        """List the processes that descend from here, by words of their command or by their parent."""
        found = []
        for entry in Path("/proc").iterdir():
            try:
                if not entry.name.isdecimal() or f"{MARK}={self.mark}".encode() not in (entry / "environ").read_bytes():
                    continue
                words = (entry / "cmdline").read_bytes().split(b"\0")
                state, parent_id = (entry / "stat").read_text().rpartition(")")[2].split()[:2]
            except OSError:  # it has ended meanwhile
                continue
            if state != "Z" and set(map(str.encode, command)) <= set(words) and parent in (None, int(parent_id)):
                found.append(int(entry.name))
        return found

    def wait_for(self, there: Callable[[], object], seconds: float = 60) -> None:
        """Wait until something is there."""
        end = time.monotonic() + seconds
        while not there():
            if time.monotonic() > end:
                log = self.folder / "dask.log"
                raise TimeoutError(log.read_text() if log.exists() else "waited in vain")
            time.sleep(0.02)

    def parts(self) -> list[Path]:
        """List the parts that are kept."""
        return sorted(self.folder.glob("*.parts/*.acc"))
