"""The files that a scene is made of, to be sent to workers that do not see them."""

import os
import re
from pathlib import Path
from urllib.parse import unquote

from .errors import Exit, Failure

# Files stay in the scheduler's memory until the render ends.
MOST_BYTES = 1 << 30

# Texts that name further files, relative to their own folder. Everything else is taken as it is.
NAMING = {".toml", ".gltf"}

QUOTED = re.compile(r'"([^"\n]+)"|\'([^\'\n]+)\'')


def files(path: Path) -> dict[str, bytes]:
    """Collect the scene and every file of its folder that it names, by their paths relative to the folder.

    A file is named where its name stands in quotes: this needs no list of the keys that name files, and what
    travels for nothing does no harm. Files outside of the folder, also behind links, stay at home: Octolux refuses
    them too.
    """
    folder = path.parent.resolve()
    found: dict[str, bytes] = {}
    waiting = [folder / path.name]
    room = MOST_BYTES
    while waiting:
        file = waiting.pop()
        name = file.relative_to(folder).as_posix()
        if name in found:
            continue
        try:
            room -= file.stat().st_size
            if room < 0:
                raise Failure(
                    f"{path}: its files hold more than 1 GiB, too much to send",
                    remedy="put the scene on a file system that all workers see, and give --shared",
                    code=Exit.BAD_INPUT,
                )
            found[name] = file.read_bytes()
        except OSError as error:
            raise Failure(
                f"{path.parent / name}: cannot be read: {error.strerror}",
                remedy="check the name, and that the file may be read",
                code=Exit.BAD_INPUT,
            ) from error
        if file.suffix.lower() in NAMING:
            waiting += _named(file.parent, found[name], folder)
    return found


def _named(here: Path, text: bytes, folder: Path) -> list[Path]:
    """Find the files inside `folder` that a text in the folder `here` names."""
    names = {a or b for a, b in QUOTED.findall(text.decode(errors="replace"))}
    # glTF percent-encodes the names of its buffers.
    names |= {unquote(name) for name in names}
    paths = (Path(os.path.normpath(here / name)) for name in names)
    return sorted(path for path in paths if path.is_relative_to(folder) and _is_file_in(folder, path))


def _is_file_in(folder: Path, path: Path) -> bool:
    try:
        return path.is_file() and path.resolve().is_relative_to(folder)
    except (OSError, RuntimeError, ValueError):  # too long for a name, a loop of links, a NUL
        return False
