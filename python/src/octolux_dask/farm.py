"""Shards on a Dask cluster: submitted, fetched, tried again."""

import logging
import operator
import os
import queue
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import cloudpickle
import dask
from distributed import Client, Future, LocalCluster
from distributed.comm.addressing import resolve_address

from . import task
from .errors import Exit, Failure
from .job import Job
from .parts import Parts
from .progress import Progress

# How often the progress line is drawn and the workers are counted, in seconds.
TICK = 1.0

# How long a scheduler has for answering, in seconds.
ANSWER = 10.0

LOST = "the connection to the scheduler was lost"


@contextmanager
def connected(address: str | None, threads: int) -> Iterator[Client]:
    """Connect to a scheduler at an address or in a scheduler file; to a cluster in this process if none is given."""
    cloudpickle.register_pickle_by_value(task)
    # What these would say of lost workers is said here, in a sentence.
    for name in ("distributed", "tornado", "asyncio"):
        logging.getLogger(name).setLevel(logging.CRITICAL)
    # Scenes travel in the task graph.
    with dask.config.set({"distributed.admin.large-graph-warning-threshold": "2 GiB"}):
        if address is None:
            # Renders are processes of their own: workers that are threads start sooner and do as well.
            workers = max(1, len(os.sched_getaffinity(0)) // threads)
            with (
                LocalCluster(
                    n_workers=workers,
                    threads_per_worker=1,
                    processes=False,
                    # None would listen on all interfaces.
                    dashboard_address="127.0.0.1:0",
                    worker_dashboard_address="127.0.0.1:0",
                    memory_limit=0,
                ) as cluster,
                Client(cluster, set_as_default=False) as client,
            ):
                yield client
        else:
            with _client(address) as client:
                _same_python(client)
                yield client


def _client(address: str) -> Client:
    try:
        if address.endswith(".json"):
            # Dask would wait for it.
            Path(address).stat()
            return Client(scheduler_file=address, timeout=ANSWER, set_as_default=False)
        # A client that cannot be made takes 20 s to say so.
        resolve_address(address)
        return Client(address, timeout=ANSWER, set_as_default=False)
    except ValueError as error:
        raise Failure(
            f"--scheduler {address}: {error}",
            remedy="write an address such as tcp://10.0.0.1:8786, or the name of a scheduler file that ends in .json",
            code=Exit.BAD_INPUT,
        ) from error
    except OSError as error:
        raise Failure(
            f"no Dask scheduler answers at {address}", remedy="start one (dask scheduler), or correct the address"
        ) from error


def _same_python(client: Client) -> None:
    """Refuse a cluster of another Python: tasks travel as byte code."""
    mine = sys.version_info[:2]
    versions: Any = client.get_versions()
    peers = [("the scheduler", versions["scheduler"]), *versions["workers"].items()]
    for name, peer in peers:
        python = str(peer["host"]["python"])
        if tuple(map(int, python.split(".")[:2])) != mine:
            raise Failure(
                f"{name} runs Python {python}, this is {mine[0]}.{mine[1]}",
                remedy="use one version of Python for all",
            )


class Farm:
    """The shards of one job under way."""

    def __init__(self, client: Client, job: Job, parts: Parts, progress: Progress) -> None:
        """Nothing is submitted yet."""
        self.client = client
        self.job = job
        self.parts = parts
        self.progress = progress
        self.retries = 3
        self.patience = 300.0
        self._failures: dict[int, int] = {}
        self._running: dict[int, Future] = {}
        self._ended: queue.SimpleQueue[tuple[int, Future]] = queue.SimpleQueue()

    def render(self, shards: list[int]) -> None:
        """Render these shards into the folder of parts; on any failure cancel what is left."""
        # The scene travels within the function, and the function as a value that cloudpickle unpacks: the scheduler can
        # make it again when all workers that held it are lost, and needs no module of this package.
        render = partial(task.render, {} if self.job.shared else self.job.files)
        self._render = self.client.submit(
            cloudpickle.loads, cloudpickle.dumps(render), key=f"octolux-scene-{self.job.digest}"
        )
        try:
            for shard in shards:
                self._submit(shard)
            met = time.monotonic()
            while self._running:
                try:
                    self._take(*self._ended.get(timeout=TICK))
                except queue.Empty:
                    workers = self._workers()
                    met = time.monotonic() if workers else met
                    if time.monotonic() - met > self.patience:
                        raise Failure(
                            f"no worker was there for {self.patience:.0f} s",
                            remedy="start workers (dask worker ADDRESS), or give --patience",
                        ) from None
                    self.progress.show(workers)
        finally:
            self.progress.clear()
            # Workers notice, and end the renders of what nobody wants any more.
            if self._running and self.client.status == "running":
                self.client.cancel(list(self._running.values()))

    def _submit(self, shard: int) -> None:
        job = self.job
        order: task.Order = {
            "program": job.program,
            "version": job.version,
            "scene": str(job.scene.absolute()) if job.shared else job.scene.name,
            "arguments": [
                *("--shard", f"{shard}/{job.shards}", "--threads", str(job.threads), "--quiet"),
                *job.options,
            ],
            "part": str(self.parts.path(shard)) if job.shared else None,
        }
        # A key names the work: the same command twice at one time is done once.
        key = f"octolux-{job.digest}-{shard}-of-{job.shards}-try-{self._failures.get(shard, 0)}"
        future = self.client.submit(operator.call, self._render, order, key=key)
        self._running[shard] = future
        future.add_done_callback(lambda ended: self._ended.put((shard, ended)))

    def _take(self, shard: int, future: Future) -> None:
        """Keep a part, or decide what its failure means."""
        try:
            answer: task.Answer = future.result()
        except Exception as error:
            if future.cancelled():
                raise Failure(LOST) from error
            # KilledWorker among others: too many workers died with this shard.
            self._failed(shard, f"{type(error).__name__}: {error}")
            return
        finally:
            future.release()
        said, worker = answer["said"], answer["worker"]
        match answer["kind"]:
            case "done":
                self.parts.keep(shard, answer["data"], worker)
                del self._running[shard]
                self.progress.done += 1
                self.progress.show(self._workers())
            case "input":
                raise Failure(said.removeprefix("error: "), code=Exit.BAD_INPUT)
            case "unfit":
                raise Failure(
                    f"worker {worker} cannot help: {said}", remedy="give all workers the Octolux of this machine"
                )
            case _:
                self._failed(shard, f"worker {worker}: {said}")

    def _failed(self, shard: int, said: str) -> None:
        self._failures[shard] = self._failures.get(shard, 0) + 1
        if self._failures[shard] > self.retries:
            raise Failure(f"shard {shard} failed {self._failures[shard]} times, lastly so: {said}")
        self.progress.note(f"shard {shard} failed and is tried again: {said}")
        self._submit(shard)

    def _workers(self) -> int:
        try:
            return len(self.client.nthreads())
        except (OSError, RuntimeError) as error:
            # A scheduler that died, and a client that has given it up.
            raise Failure(LOST) from error
