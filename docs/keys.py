#!/usr/bin/env python3
"""Checks that docs/scene-format.md has every key of scene files: the program in the PATH lists them where it meets an unknown one."""

import pathlib
import re
import subprocess
import sys
import tempfile

PAGE = pathlib.Path(__file__).resolve().parent / "scene-format.md"
VIEW = "[camera]\norigin = [0, 0, 5]\ntarget = [0, 0, 0]\nup = [0, 1, 0]\nfov_x = 40\n[film]\nwidth = 8\nheight = 8\n"
TRIANGLE = "vertices = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]\nfaces = [[0, 1, 2]]\n"

# The heading of a table's section, and a scene with a key in that table which no scene has.
TABLES = {
    "`[camera]`": VIEW.replace("[film]", "unheard_of = 1\n[film]"),
    "`[film]`": VIEW + "unheard_of = 1\n",
    "`[render]`": VIEW + "[render]\nunheard_of = 1\n",
    "`[materials.NAME]`": VIEW + "[materials.a]\ndiffuse = [1, 1, 1]\nunheard_of = 1\n",
    "`[[spheres]]`": VIEW + "[[spheres]]\ncenter = [0, 0, 0]\nradius = 1\nemission = [1, 1, 1]\nunheard_of = 1\n",
    "`[[meshes]]`": VIEW + "[[meshes]]\nemission = [1, 1, 1]\n" + TRIANGLE + "unheard_of = 1\n",
    "`[[boxes]]`": VIEW + "[[boxes]]\ncenter = [0, 0, 0]\nsize = [1, 1, 1]\nemission = [1, 1, 1]\nunheard_of = 1\n",
    "`[[lights]]`": VIEW + "[[lights]]\nkind = \"point\"\nposition = [0, 3, 0]\nintensity = [1, 1, 1]\nunheard_of = 1\n",
    "`[environment]`": VIEW + "[environment]\nemission = [1, 1, 1]\nunheard_of = 1\n",
}


def keys(scene):
    """The keys that the program knows where the scene has an unknown one."""
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder) / "scene.toml"
        path.write_text(scene)
        done = subprocess.run(["octolux", "explain", path], stdin=subprocess.DEVNULL, capture_output=True, text=True)
    # Long lists go over several lines.
    said = re.search(r"the keys of .*? are (.*)", " ".join(done.stderr.split()))
    if done.returncode != 2 or not said:
        sys.exit(f"error: this is no list of keys:\n{done.stderr}")
    return re.findall(r"\w+", said[1])


def main():
    sections = re.split(r"^## ", PAGE.read_text(), flags=re.MULTILINE)
    count, missing = 0, []
    for heading, scene in TABLES.items():
        section = next(text for text in sections if text.startswith(heading))
        known = keys(scene)
        count += len(known)
        missing += [f"{heading} has the key {key}" for key in known if not re.search(rf"`{key}\b", section)]
    for sentence in missing:
        print(f"error: docs/scene-format.md does not say that {sentence}", file=sys.stderr)
    print(f"{count} keys of scene files")
    sys.exit(bool(missing))


main()
