#!/usr/bin/env python3
"""Checks the sources of the book: pages, links and blocks. Needs nothing but Python.

    docs/check.py               the sources
    docs/check.py --html DIR    the links of the HTML that mdbook made

- SUMMARY.md lists every page below docs/, once, and no other.
- Every relative link leads to a file, and to a heading of it if it names one, whose anchor GitHub and mdbook make in the same way.
  Pages of the book link to pages and files of the book alone, because the HTML holds nothing else; README.md, ARCHITECTURE.md and the
  like may link to all of the repository.
- What a page includes from another folder has no relative link: it could be right for one of the two places only.
- A block of shell commands is run by docs/test.py (```console), or a note above it says why it is not.
"""

import collections
import pathlib
import re
import sys
import unicodedata
from html import unescape

from pages import DOCS, ROOT, blocks, listed

LINK = re.compile(r"\]\(([^)\s]+)\)")
INCLUDE = re.compile(r"\{\{#include (\S+?):(\w+)\}\}")
OTHERS = ["README.md", "ARCHITECTURE.md", "CONTRIBUTING.md", "python/README.md", "contrib/slurm/README.md", "scenes/README.md"]


def prose(page):
    """The lines outside of fenced blocks and of `code`, with their numbers."""
    fenced = False
    for number, line in enumerate(page.read_text().splitlines(), 1):
        if line.startswith("```"):
            fenced = not fenced
        elif not fenced:
            yield number, line


def on_github(text, code):
    """The part of an anchor that GitHub makes of a part of a heading: letters, marks, decimal digits, `_` and `-` stay."""
    stays = lambda c: unicodedata.category(c)[0] in "LM" or unicodedata.category(c) in ("Nd", "Pc") or c in "- "
    return "".join(filter(stays, text.lower())).replace(" ", "-")


def in_book(text, code):
    """The same of mdbook 0.5: all that is alphanumeric stays, such as a superscript, and outside of code two hyphens become a dash."""
    text = text if code else re.sub(r"--+", "", text)
    return "".join(c for c in text.lower() if c.isalnum() or c in "_- ").replace(" ", "-")


def anchors(page, make):
    """The anchors of a page's headings. Of headings with the same anchor, the second one's ends in -1."""
    if "{{#include ../../ARCHITECTURE.md" in page.read_text():
        page = ROOT / "ARCHITECTURE.md"
    seen = collections.Counter()
    for heading in (line.lstrip("#").strip() for _, line in prose(page) if re.match(r"#+ ", line)):
        # Every second part is code; in the others marks and tags are no text.
        parts = ((part, at % 2 == 1) for at, part in enumerate(heading.split("`")))
        anchor = "".join(make(part if code else re.sub(r"<[^>]*>|\*|\]\([^)]*\)|\[", "", part), code) for part, code in parts)
        yield f"{anchor}-{seen[anchor]}" if seen[anchor] else anchor
        seen[anchor] += 1


def links(page, within):
    """What is wrong with the links of a page."""
    for number, line in prose(page):
        for link in LINK.findall(re.sub(r"`[^`]*`", "", line)):
            if re.match(r"[a-z]+:", link):
                continue
            file, _, anchor = link.partition("#")
            target = (page.parent / file).resolve() if file else page
            where = f"{page.relative_to(ROOT)}:{number}: {link}"
            if not target.is_relative_to(within):
                yield f"{where} leads out of {within.name}/"
            elif not target.exists():
                yield f"{where} leads nowhere"
            elif anchor:
                github, book = anchor in anchors(target, on_github), anchor in anchors(target, in_book)
                if not github and not book:
                    yield f"{where}: no such heading"
                elif not github:
                    yield f"{where}: GitHub makes another anchor of this heading than mdbook: write it in plain letters"
                elif not book and within == DOCS:
                    yield f"{where}: mdbook makes another anchor of this heading than GitHub: write it in plain letters"


def included(page):
    """The relative links in what a page includes from another folder."""
    for file, name in INCLUDE.findall(page.read_text()):
        source = (page.parent / file).resolve()
        within = False
        for number, line in prose(source):
            if f"ANCHOR: {name} " in line or f"ANCHOR_END: {name} " in line:
                within = "ANCHOR: " in line
            links = LINK.findall(re.sub(r"`[^`]*`", "", line)) if within and source.parent != page.parent else []
            for link in links:
                if not re.match(r"[a-z]+:|#", link):
                    yield (f"{source.relative_to(ROOT)}:{number}: {link} leads nowhere from {page.relative_to(ROOT)}, "
                           f"which includes this line")


def html(folder):
    """What is wrong with the links of the HTML."""
    pages = {page: page.read_text() for page in folder.rglob("*.html") if page.name not in ("404.html", "print.html", "toc.html")}
    names = {page: set(re.findall(r'id="([^"]+)"', text)) for page, text in pages.items()}
    for page, text in sorted(pages.items()):
        for link in sorted(set(re.findall(r'(?:href|src)="([^"]+)"', text))):
            link = unescape(link)
            if re.match(r"[a-z]+:", link):
                continue
            file, _, anchor = link.partition("#")
            target = (page.parent / file).resolve() if file else page
            if not target.exists():
                yield f"{page.relative_to(folder)}: {link} leads nowhere"
            elif anchor and anchor not in names.get(target, {anchor}):
                yield f"{page.relative_to(folder)}: {link}: no such heading"


def main():
    if sys.argv[1:2] == ["--html"]:
        wrong = list(html(pathlib.Path(sys.argv[2]).resolve()))
        for sentence in wrong:
            print(f"error: {sentence}", file=sys.stderr)
        sys.exit(bool(wrong))
    pages = listed()
    wrong = [f"SUMMARY.md lists {page.relative_to(DOCS)} twice" for page in set(pages) if pages.count(page) > 1]
    there = {page for page in DOCS.rglob("*.md") if page.name != "SUMMARY.md"}
    wrong += [f"SUMMARY.md does not list {page.relative_to(DOCS)}" for page in sorted(there - set(pages))]
    wrong += [f"SUMMARY.md lists {page.relative_to(DOCS)}, which is not there" for page in sorted(set(pages) - there)]
    others = [ROOT / name for name in OTHERS if (ROOT / name).exists()]
    for page in sorted(there):
        wrong += links(page, DOCS)
        wrong += included(page)
    for page in [*others, DOCS / "SUMMARY.md"]:
        wrong += links(page, ROOT)
    for page in [ROOT / "README.md", *sorted(there)]:
        for block in blocks(page):
            if block.language in ("sh", "bash", "shell") and (block.note or [None])[0] != "not run":
                wrong.append(f"{page.relative_to(ROOT)}:{block.first}: commands that nothing runs: make it a console block, or say "
                             "why above it: <!-- not run: ... -->")
    for sentence in wrong:
        print(f"error: {sentence}", file=sys.stderr)
    print(f"{len(there)} pages")
    sys.exit(bool(wrong))


main()
