"""What ends the command, and the exit code that says so."""

from enum import IntEnum


class Exit(IntEnum):
    """The exit codes of `octolux`."""

    WELL = 0
    FAILED = 1
    BAD_INPUT = 2
    INTERRUPTED = 130


class Failure(Exception):  # noqa: N818 - a bad scene is no error of this program
    """Why the command cannot go on: a sentence without `error: ` in front, what would do, and the exit code."""

    def __init__(self, what: str, *, remedy: str = "", code: Exit = Exit.FAILED) -> None:
        """Keep the three."""
        super().__init__(what)
        self.remedy = remedy
        self.code = code
