"""The folder of parts: what is there, what is missing, and the picture that they make."""

import fcntl
import os
import shutil
import subprocess
from pathlib import Path

from .errors import Exit, Failure
from .job import Job


class Parts:
    """The parts of one job, in a folder that bears its digest: no other render's parts get into it."""

    def __init__(self, job: Job, beside: Path) -> None:
        """Make the folder beside a picture, or find it there from a run that was stopped, and lock it."""
        self.job = job
        self.folder = beside.parent.absolute() / f"{job.scene.stem}-{job.digest}.parts"
        # Who rendered what, to be named when a part is refused.
        self.workers: dict[int, str] = {}
        try:
            self.folder.mkdir(exist_ok=True)
            self._lock = os.open(self.folder, os.O_RDONLY)
        except OSError as error:
            raise Failure(
                f"{self.folder.parent}: cannot be written: {error.strerror}",
                remedy="choose another folder with -o",
                code=Exit.BAD_INPUT,
            ) from error
        try:
            fcntl.flock(self._lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            raise Failure(
                f"{self.folder}: another octolux-dask is at work on this render", remedy="wait for it, or stop it"
            ) from error
        except OSError:  # a file system without locks; two at once then do the work twice, with the same bits
            pass

    def path(self, shard: int) -> Path:
        """Where a part is or will be."""
        return self.folder / f"{shard}-of-{self.job.shards}.acc"

    def all(self) -> list[int]:
        """List the numbers of the shards, from 1."""
        return list(range(1, self.job.shards + 1))

    def missing(self) -> list[int]:
        """List the shards that are still to be rendered."""
        if not any(self.folder.glob("*.acc")):
            return self.all()
        answer = self._ask("shards", str(self.folder), "--of", str(self.job.shards), "--missing")
        return [int(word) for word in answer.stdout.strip().split(",") if word]

    def keep(self, shard: int, data: bytes, worker: str) -> None:
        """Write a part that came back, whole or not at all; a shared one is there already."""
        self.workers[shard] = worker
        if data:
            path = self.path(shard)
            temporary = path.with_suffix(".tmp")
            try:
                with temporary.open("wb") as file:
                    file.write(data)
                    file.flush()
                    os.fsync(file.fileno())
                temporary.replace(path)
            except OSError as error:
                temporary.unlink(missing_ok=True)
                raise Failure(f"{path}: cannot be written: {error.strerror}") from error

    def merge(self, pictures: list[Path], options: list[str]) -> str:
        """Write the pictures from all parts; return what `octolux merge` says."""
        parts = [str(self.path(shard)) for shard in self.all()]
        outputs = [word for picture in pictures for word in ("-o", str(picture))]
        return self._ask("merge", *parts, *outputs, *options).stderr

    def discard(self) -> None:
        """Remove the folder: the pictures are written, or nothing is in it."""
        shutil.rmtree(self.folder, ignore_errors=True)

    def close(self) -> int:
        """Leave the folder to the next run, unless it is empty; return how many parts are in it."""
        kept = len(list(self.folder.glob("*.acc"))) if self.folder.is_dir() else 0
        if kept == 0:
            self.discard()
        os.close(self._lock)
        return kept

    def _ask(self, *words: str) -> subprocess.CompletedProcess[str]:
        answer = subprocess.run([self.job.program, *words], capture_output=True, text=True, check=False)
        if answer.returncode != 0:
            said = answer.stderr.strip().removeprefix("error: ") or f"octolux {words[0]} failed"
            raise Failure(said + self._blamed(said))
        return answer

    def _blamed(self, said: str) -> str:
        """Name the workers of the parts that a message names, and of the first part, to which others are compared."""
        named = [shard for shard in self.all() if str(self.path(shard)) in said]
        lines = [
            f"\nnote: {self.path(shard).name} was rendered by {self.workers.get(shard, 'an earlier run')}"
            for shard in dict.fromkeys([1, *named])
        ]
        return "".join(lines) + "\nnote: delete what is wrong, and the same command renders it again" if named else ""
