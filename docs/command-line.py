#!/usr/bin/env python3
"""Writes docs/reference/command-line.md: the help of `octolux` and of each of its commands, as the program in the PATH prints it.

    docs/command-line.py              writes the page
    docs/command-line.py --check      ends with exit code 1 if the page is not what the program says
"""

import difflib
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

PAGE = pathlib.Path(__file__).resolve().parent / "reference/command-line.md"
HEAD = """# Command line

What the program says of itself: `octolux --help`, and `--help` of every command. Made by `docs/command-line.py`, and compared with the
program in CI.

Standard output carries data alone; progress, notes and errors go to standard error. A picture file is written whole or not at all.

| exit code | means |
| --- | --- |
| 0 | all is well |
| 1 | something failed that is neither usage nor the scene: a file, the machine, a comparison beyond its bound |
| 2 | bad usage or a bad scene |
| 130 | interrupted; `render` wrote what there was |

| variable | |
| --- | --- |
| `EMBREE_DIR` | the folder above Embree's `lib/`, when building and when running ([installing](../guide/installing.md)) |
| `OCTOLUX_AVX512=off` | renders without AVX-512, as on a processor that lacks it |
| `OCTOLUX_EMBREE` | settings for Embree's device, such as `isa=avx2`. Where they leave Embree without packets of 16 rays, `--lanes 16` is refused; without packets of 8 it traces the rays of a packet one by one, and `explain` says so |
"""


def told(octolux, *words):
    """The help of a command; the width that it is broken to is that of a pipe."""
    done = subprocess.run([octolux, *words, "--help"], check=True, stdin=subprocess.DEVNULL, capture_output=True, text=True)
    return "\n".join(line.rstrip() for line in done.stdout.strip().splitlines())


def page():
    """The page as it should be."""
    found = shutil.which("octolux")
    if not found:
        sys.exit("error: no program `octolux` in the PATH")
    with tempfile.TemporaryDirectory() as folder:
        # The help names the program by its file: a link names it as a reader does.
        octolux = pathlib.Path(folder) / "octolux"
        octolux.symlink_to(pathlib.Path(found).resolve())
        whole = told(octolux)
        listed = whole.split("Commands:\n")[1].split("\n\n")[0]
        names = [name for name in re.findall(r"^  (\w+)", listed, re.MULTILINE) if name != "help"]
        parts = [HEAD, f"## octolux\n\n```text\n{whole}\n```\n"]
        parts += [f"## octolux {name}\n\n```text\n{told(octolux, name)}\n```\n" for name in names]
    return "\n".join(parts)


def main():
    new = page()
    if "--check" not in sys.argv[1:]:
        PAGE.write_text(new)
        return
    old = PAGE.read_text()
    if old != new:
        name = "docs/reference/command-line.md"
        sys.stderr.writelines(difflib.unified_diff(old.splitlines(True), new.splitlines(True), name, "the program"))
        sys.exit(f"error: {name} is not what the program says: run docs/command-line.py")


main()
