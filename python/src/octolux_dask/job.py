"""What is rendered, how, and by which program."""

import hashlib
import shutil
import subprocess
from dataclasses import dataclass, field
from pathlib import Path

from .errors import Exit, Failure


def version(program: str) -> str:
    """Ask the `octolux` at `program` who it is: version, commit, processor features."""
    path = shutil.which(program)
    if path is None:
        raise Failure(
            f"{program}: no such program",
            remedy="install Octolux (cargo install --locked --path .), or name the program with --octolux",
            code=Exit.BAD_INPUT,
        )
    answer = subprocess.run([path, "--version"], capture_output=True, text=True, check=False)
    if answer.returncode != 0 or not answer.stdout.startswith("octolux "):
        raise Failure(f"{program} --version: {(answer.stderr or answer.stdout).strip() or 'no answer'}")
    return answer.stdout.strip()


@dataclass(frozen=True)
class Job:
    """One picture in `shards` parts. Two jobs with one `digest` have the same parts, bit for bit."""

    scene: Path
    shards: int
    program: str
    version: str
    threads: int
    options: tuple[str, ...]
    files: dict[str, bytes] = field(repr=False)
    # Workers read the scene and write the parts where this process does.
    shared: bool

    @property
    def digest(self) -> str:
        """Name the bits: the scene's files, the options of `octolux render`, the number of shards, the program."""
        what = hashlib.sha256()
        words = [self.scene.name, str(self.shards), self.version, *self.options]
        contents = [item for name, data in sorted(self.files.items()) for item in (name.encode(), data)]
        for item in [b"".join(len(word).to_bytes(8) + word for word in map(str.encode, words)), *contents]:
            what.update(len(item).to_bytes(8))
            what.update(item)
        return what.hexdigest()[:16]
