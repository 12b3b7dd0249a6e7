"""The pages of the book and their fenced blocks, for the scripts beside this file."""

import dataclasses
import pathlib
import re

DOCS = pathlib.Path(__file__).resolve().parent
ROOT = DOCS.parent
FENCE = re.compile(r"^```(\S*)$")
NOTE = re.compile(r"^<!-- (file|append|not run): (.+?) -->$")


@dataclasses.dataclass
class Block:
    """A fenced block: its language, its lines, the number of its first line, and the note in the line above its fence."""

    language: str
    lines: list[str]
    first: int
    note: tuple[str, str] | None


def listed():
    """The pages that SUMMARY.md lists, in its order."""
    links = re.findall(r"\]\(([^)]+\.md)\)", (DOCS / "SUMMARY.md").read_text())
    return [DOCS / link for link in links]


def blocks(page):
    """The fenced blocks of a page. An unclosed one is an error."""
    found, block = [], None
    lines = page.read_text().splitlines()
    for number, line in enumerate(lines, 1):
        fence = FENCE.match(line)
        if block is None and fence:
            note = NOTE.match(lines[number - 2]) if number > 1 else None
            block = Block(fence[1], [], number + 1, note and note.groups())
        elif fence:
            found.append(block)
            block = None
        elif block is not None:
            block.lines.append(line)
    if block is not None:
        raise SystemExit(f"{page.relative_to(ROOT)}:{block.first - 1}: this block has no end")
    return found
