"""The command line: `octolux-dask SCENE --shards N`."""

import argparse
import os
import signal
import sys
import time
from collections.abc import Callable
from importlib import metadata
from pathlib import Path
from types import FrameType

from . import job, scene
from .errors import Exit, Failure
from .job import Job
from .parts import Parts
from .progress import Progress, clock

USAGE = "octolux-dask SCENE --shards N [--scheduler ADDRESS] [-o FILE]... [OPTION]... [OPTION OF octolux render]..."

STOPPING = (signal.SIGINT, signal.SIGTERM)

EXAMPLES = """\
Every other option goes to `octolux render` (--spp, --seed, --size, --estimator, ...).

Examples:
  octolux-dask scene.toml --shards 16 --spp 4096
      renders on the cores of this machine, writes scene.exr and scene.png
  octolux-dask scene.toml --shards 256 --spp 65536 --scheduler tcp://10.0.0.1:8786 -o scene.exr
      renders on the workers of a Dask scheduler

The picture has the bits that one `octolux render` would give. If something stops the render, the parts that came back
stay in a folder SCENE-*.parts beside the picture, and the same command goes on from there.

Exit codes: 0 well, 2 bad usage or a bad scene, 1 anything else, 130 interrupted."""


class _Parser(argparse.ArgumentParser):
    def error(self, message: str) -> None:  # type: ignore[override]
        raise Failure(message, remedy=f"usage: {USAGE}", code=Exit.BAD_INPUT)


def _whole(least: int) -> Callable[[str], int]:
    """Read a whole number from `least` on."""

    def read(text: str) -> int:
        if not text.isdecimal() or int(text) < least:
            raise argparse.ArgumentTypeError(f"a whole number from {least} on is wanted, got {text}")
        return int(text)

    return read


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(
        prog="octolux-dask",
        usage=USAGE,
        description="Render the shards of one picture on a Dask cluster.",
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    add = parser.add_argument
    add("--shards", metavar="N", type=_whole(1), required=True, help="into how many parts the samples are split")
    add(
        "--scheduler",
        metavar="ADDRESS",
        help="a Dask scheduler's address or scheduler file (.json) [default: a cluster on the cores of this machine]",
    )
    add(
        "-o",
        "--output",
        metavar="FILE",
        action="append",
        help="a picture to write, as for octolux render; may be repeated [default: {name}.exr and {name}.png]",
    )
    add("--exposure", metavar="STOPS", help="brighten the PNG by so many stops")
    add("--threads", metavar="N", type=_whole(1), default=1, help="threads of one shard's render [default: 1]")
    add(
        "--shared",
        action="store_true",
        help="all workers see SCENE and the picture's folder under these paths: nothing is sent",
    )
    add(
        "--retries",
        metavar="N",
        type=_whole(0),
        default=3,
        help="how often a shard that failed is tried again [default: 3]",
    )
    add(
        "--patience",
        metavar="SECONDS",
        type=_whole(1),
        default=300,
        help="give up when no worker was there for so long [default: 300]",
    )
    add(
        "--octolux",
        metavar="PROGRAM",
        default="octolux",
        help="the program, here and on the workers: a name in the PATH or a path [default: octolux]",
    )
    add("--version", action="version", version=f"octolux-dask {metadata.version('octolux')}")
    add("-q", "--quiet", action="store_true", help="say nothing but errors")
    return parser


def main() -> int:
    """Run the command; return its exit code."""
    for number in STOPPING:
        # A shell ignores ctrl-c for what it starts in the background.
        if signal.getsignal(number) != signal.SIG_IGN:
            signal.signal(number, _interrupt)
    try:
        run(sys.argv[1:])
    except Failure as failure:
        print(f"error: {failure}", file=sys.stderr)
        if failure.remedy:
            print(f"help: {failure.remedy}", file=sys.stderr)
        return failure.code
    except KeyboardInterrupt:
        return Exit.INTERRUPTED
    return Exit.WELL


def _interrupt(_signal: int, _frame: FrameType | None) -> None:
    """Cancel what is under way; at the second signal leave at once, which ends the renders too."""
    for number in STOPPING:
        signal.signal(number, lambda _signal, _frame: os._exit(Exit.INTERRUPTED))
    raise KeyboardInterrupt


def run(words: list[str]) -> None:
    """Render what the command line asks for."""
    if not words or words[0].startswith("-"):
        # Help, or an error about what is missing.
        _parser().parse_args(words or ["--help"])
        raise Failure("the scene comes first", remedy=f"usage: {USAGE}", code=Exit.BAD_INPUT)
    path = Path(words[0])
    options, further = _parser().parse_known_args(words[1:])
    pictures = [Path(name.replace("{name}", path.stem)) for name in options.output or ["{name}.exr", "{name}.png"]]
    _check(pictures)
    if not options.shared and "--allow-outside" in further:
        raise Failure(
            "--allow-outside: files outside of the scene's folder are not sent to workers",
            remedy="copy them into the folder, or give --shared",
            code=Exit.BAD_INPUT,
        )
    program = str(Path(options.octolux).absolute()) if "/" in options.octolux else options.octolux
    order = Job(
        scene=path,
        shards=options.shards,
        program=program,
        version=job.version(program),
        threads=options.threads,
        options=tuple(further),
        files=scene.files(path),
        shared=options.shared,
    )
    started = time.monotonic()
    parts = Parts(order, beside=pictures[0])
    try:
        _render(order, parts, options)
        exposure = ["--exposure", options.exposure] if options.exposure else []
        said = parts.merge(pictures, exposure)
        parts.discard()
        if not options.quiet:
            print(f"{path.stem}: {order.shards} shards in {clock(time.monotonic() - started)}", file=sys.stderr)
            print(said, end="", file=sys.stderr)
    finally:
        if kept := parts.close():
            print(
                f"note: {kept} of {order.shards} parts are kept in {parts.folder}: run the same command to go on",
                file=sys.stderr,
            )


def _render(order: Job, parts: Parts, options: argparse.Namespace) -> None:
    """Render what is missing."""
    missing = parts.missing()
    if not missing:
        return
    # Dask takes half a second to import: not before it is needed.
    from .farm import Farm, connected  # noqa: PLC0415

    progress = Progress(order.scene.stem, order.shards, order.shards - len(missing), quiet=options.quiet)
    if progress.done:
        progress.note(f"{progress.done} of {progress.total} parts are there already")
    with connected(options.scheduler, order.threads) as client:
        farm = Farm(client, order, parts, progress)
        farm.retries, farm.patience = options.retries, float(options.patience)
        farm.render(missing)


def _check(pictures: list[Path]) -> None:
    """Refuse early what could not be written after hours."""
    for picture in pictures:
        if picture.suffix.lower() not in {".exr", ".png", ".npy"}:
            raise Failure(f"{picture}: a picture ends in .exr, .png or .npy", code=Exit.BAD_INPUT)
        if not picture.parent.is_dir():
            raise Failure(
                f"{picture}: the folder {picture.parent} does not exist", remedy="make it", code=Exit.BAD_INPUT
            )


if __name__ == "__main__":
    sys.exit(main())
