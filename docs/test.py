#!/usr/bin/env python3
"""Runs every command of the book and of the README, and compares what it prints with what stands there.

    docs/test.py [PAGE...]            `octolux` is the first one in the PATH
    docs/test.py --show [PAGE...]     prints the whole output of every command too
    docs/test.py --update [PAGE...]   writes the numbers of today into the pages

A ```console block is run, line by line: `$ command`, continued by a `\\` at the end of a line; `# exit code 2` at its end says
that it fails so. Lines below a command are what it prints on both streams. They are compared with every number taken as equal,
because times and machines differ; `...` stands for any lines. Commands without lines below them are compared by exit code alone.

The folder of a page starts with the scenes of the repository, and keeps what its commands write. A block below
`<!-- file: NAME -->` is written to this file first, one below `<!-- append: NAME -->` is added to its end.
"""

import os
import re
import shutil
import subprocess
import sys
import tempfile
import time

from pages import ROOT, blocks, listed

NUMBER = re.compile(r"[+-]?\d+(?:\.\d+)?(?:e[+-]?\d+)?")
EXIT = re.compile(r"\s+# exit code (\d+)$")
TIMEOUT = 300  # seconds, for a busy machine; `timeout` then ends a command with exit code 124


def commands(block):
    """The commands of a block, each with the lines below it, and the index in the page of the first of these."""
    found, unfinished = [], False
    for index, line in enumerate(block.lines, block.first):
        if unfinished:
            found[-1][0] += "\n" + line
            found[-1][2] += 1
        elif line.startswith("$ "):
            found.append([line[2:], [], index])
        elif found:
            found[-1][1].append(line)
        else:
            raise ValueError("a console block starts with a command")
        # The lines of a command, not those of its output.
        unfinished = not found[-1][1] and line.endswith("\\")
    return found


def plain(line):
    """A line without what differs from run to run: numbers, and how wide they make a table."""
    return re.sub(r"\s+", " ", re.sub(r"-{4,}", "----", NUMBER.sub("#", line))).strip()


def matched(shown, printed):
    """For each line that a page shows, the printed line that it is, or None for `...`, which stands for any number of them. None if
    they differ."""
    if not shown:
        return None if printed else []
    if shown[0] == "...":
        tails = (matched(shown[1:], printed[i:]) for i in range(len(printed) + 1))
        return next(([None, *tail] for tail in tails if tail is not None), None)
    if not printed or plain(shown[0]) != plain(printed[0]):
        return None
    tail = matched(shown[1:], printed[1:])
    return None if tail is None else [printed[0], *tail]


def run(command, folder):
    """Its exit code and the lines that it prints."""
    limited = ["timeout", str(TIMEOUT), "bash", "-c", command]
    done = subprocess.run(limited, cwd=folder, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    return done.returncode, done.stdout.splitlines()


def test(page, show):
    """Runs a page. Returns how many commands it has, what is wrong with it, and its text with the numbers of this run."""
    count, wrong, text = 0, [], page.read_text().splitlines()
    name = page.relative_to(ROOT)
    with tempfile.TemporaryDirectory() as folder:
        shutil.copytree(ROOT / "scenes", os.path.join(folder, "scenes"))
        for block in blocks(page):
            kind, file = block.note or (None, None)
            if kind in ("file", "append"):
                with open(os.path.join(folder, file), "w" if kind == "file" else "a") as out:
                    out.write("\n".join(block.lines) + "\n")
            if block.language != "console":
                continue
            for command, shown, line in commands(block):
                wanted = EXIT.search(command)
                code, printed = run(EXIT.sub("", command), folder)
                count += 1
                if show:
                    print(f"$ {command}", *printed, sep="\n")
                where = f"{name}:{block.first}: {command}\n"
                if code != int(wanted[1] if wanted else 0):
                    wrong.append(where + "\n".join([f"ends with exit code {code}", *printed]))
                elif shown:
                    today = matched(shown, printed)
                    if today is None:
                        wrong.append(where + "\n".join(["prints", *printed, "where the page shows", *shown]))
                    for offset, new in enumerate(today or []):
                        text[line + offset] = text[line + offset] if new is None else new
    return count, wrong, "\n".join(text) + "\n"


def main():
    arguments = sys.argv[1:]
    show, update = "--show" in arguments, "--update" in arguments
    names = [name for name in arguments if not name.startswith("--")]
    pages = [ROOT / name for name in names] or [ROOT / "README.md", *listed()]
    failed = False
    for page in pages:
        start = time.monotonic()
        count, wrong, text = test(page, show)
        if update:
            page.write_text(text)
        if count:
            print(f"{page.relative_to(ROOT)}: {count} commands, {time.monotonic() - start:.1f} s", flush=True)
        for text in wrong:
            failed = True
            print(f"error: {text}\n", file=sys.stderr, flush=True)
    sys.exit(failed)


main()
