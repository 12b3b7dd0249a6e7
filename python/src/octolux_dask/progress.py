"""One line on a terminal; nothing elsewhere."""

import sys
import time


def clock(seconds: float) -> str:
    """Write a time as m:ss."""
    return f"{int(seconds) // 60}:{int(seconds) % 60:02}"


class Progress:
    """Tells how far a render is, and what happens to it."""

    def __init__(self, name: str, total: int, done: int, *, quiet: bool) -> None:
        """Start counting with `done` of `total` shards there."""
        self.name = name
        self.total = total
        self.done = done
        self._before = done
        self._started = time.monotonic()
        self._quiet = quiet
        self._draws = not quiet and sys.stderr.isatty()

    def show(self, workers: int) -> None:
        """Draw the line anew."""
        if self._draws:
            seconds = time.monotonic() - self._started
            rendered = self.done - self._before
            left = f", {clock(seconds / rendered * (self.total - self.done))} left" if rendered else ""
            line = f"{self.name}: {self.done} of {self.total} shards, {workers} workers, {clock(seconds)}{left}"
            print(f"\r\x1b[K{line}", end="", file=sys.stderr, flush=True)

    def note(self, text: str) -> None:
        """Say something that stays."""
        if not self._quiet:
            self.clear()
            print(f"note: {text}", file=sys.stderr, flush=True)

    def clear(self) -> None:
        """Remove the line."""
        if self._draws:
            print("\r\x1b[K", end="", file=sys.stderr, flush=True)
