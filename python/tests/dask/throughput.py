"""Throughput of two Dask workers of one thread each against one process of two threads, in turn.

`python3 -m pip install './python[dask]'`, then `python3 python/tests/dask/throughput.py [ROUNDS [SPP]]` after a
release build. The start of the command counts, that of the cluster does not. A line a round, then least / median / most
of the ratio.
"""

import statistics
import subprocess
import sys
import time

from loopback import OCTOLUX, SCENE, Place

SHARDS = "8"


def main() -> None:
    """Measure."""
    rounds, spp = (*sys.argv[1:], *("5", "2048")[len(sys.argv) - 1 :])
    settings = ("--size", "768x512", "--spp", spp)
    ratios = []
    with Place() as place:
        scheduler = place.scheduler()
        for _ in range(2):
            place.worker(scheduler, "--no-nanny")
        place.wait_for(lambda: place.registered() == 2)
        for number in range(int(rounds)):
            started = time.monotonic()
            alone = place.one_process(SCENE, *settings, "--threads", "2")
            one = time.monotonic() - started

            started = time.monotonic()
            code, said = place.run(SCENE, "--shards", SHARDS, *settings, "-o", "many.npy", "--scheduler", scheduler)
            many = time.monotonic() - started
            if code or place.sha256("many.npy") != alone:
                sys.exit(said or "other bits")
            ratios.append(one / many)
            print(f"{number + 1}: process {one:.2f} s, workers {many:.2f} s, ratio {one / many:.3f}", flush=True)
    least, middle, most = min(ratios), statistics.median(ratios), max(ratios)
    print(f"throughput of the workers to that of the process: {least:.3f} / {middle:.3f} / {most:.3f}")
    print(subprocess.run([OCTOLUX, "--version"], capture_output=True, text=True, check=True).stdout, end="")


if __name__ == "__main__":
    main()
