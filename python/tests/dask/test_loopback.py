"""Scheduler, workers and command as separate processes on 127.0.0.1, and what happens when one of them dies."""

import os
import signal
import time
import unittest

from loopback import SCENE, Place

# A shard takes about a third of a second on one thread.
SHARDS = 10
SETTINGS = ("--size", "96x64", "--spp", "12000", "--seed", "7")
COMMAND = (SCENE, "--shards", str(SHARDS), *SETTINGS, "-o", "many.npy")


class Loopback(unittest.TestCase):
    """Two workers of one thread each."""

    def setUp(self) -> None:
        """Start the cluster."""
        self.place = self.enterContext(Place())
        self.scheduler = self.place.scheduler()

    def test_a_worker_that_is_killed_costs_time_and_no_bit(self) -> None:
        """One worker gets SIGKILL while it renders; its render dies with it and its shards go to the other one."""
        place = self.place
        alone = place.one_process(SCENE, *SETTINGS)
        workers = [place.worker(self.scheduler, "--no-nanny") for _ in range(2)]
        place.wait_for(lambda: place.registered() == len(workers))

        started = time.monotonic()
        code, said = place.run(*COMMAND, "--scheduler", self.scheduler)
        undisturbed = time.monotonic() - started
        self.assertEqual(code, 0, said)
        self.assertEqual(place.sha256("many.npy"), alone)
        (place.folder / "many.npy").unlink()

        started = time.monotonic()
        command = place.start(*COMMAND, "--scheduler", self.scheduler)
        victim = workers[0].pid
        place.wait_for(lambda: len(place.parts()) >= SHARDS // 4)
        place.hold()
        # The shell is the program that is held.
        place.wait_for(lambda: all(place.alive("/bin/sh", "render", parent=worker.pid) for worker in workers))
        renders = place.alive("render", parent=victim)
        os.kill(victim, signal.SIGKILL)
        place.wait_for(lambda: not set(renders) & set(place.alive()), seconds=10)
        place.release()
        _, said = command.communicate(timeout=120)
        disturbed = time.monotonic() - started
        self.assertEqual(command.returncode, 0, said)
        self.assertEqual(place.sha256("many.npy"), alone)
        self.assertEqual(place.parts(), [])

        for process in place.cluster:
            process.terminate()
            process.wait(timeout=30)
        self.assertEqual(place.alive(), [])
        print(f"\nSHA-256 {alone} thrice; {undisturbed:.1f} s undisturbed, {disturbed:.1f} s with a worker killed")

    def test_a_client_that_is_killed_leaves_no_render_behind_and_the_next_one_goes_on(self) -> None:
        """The workers notice that nobody wants their shards any more."""
        place = self.place
        # With a nanny, which is how Dask starts workers by default.
        place.worker(self.scheduler)
        command = place.start(*COMMAND, "--scheduler", self.scheduler)
        place.wait_for(lambda: len(place.parts()) >= 2)
        place.hold()
        place.wait_for(lambda: place.alive("/bin/sh", "render"))
        kept = len(place.parts())
        command.kill()
        command.communicate()
        place.wait_for(lambda: not place.alive("render"), seconds=10)
        self.assertFalse((place.folder / "many.npy").exists())

        place.release()
        code, said = place.run(*COMMAND, "--scheduler", self.scheduler)
        self.assertEqual(code, 0, said)
        self.assertRegex(said, rf"note: ({kept}|{kept + 1}) of {SHARDS} parts are there already")
        self.assertEqual(place.sha256("many.npy"), place.one_process(SCENE, *SETTINGS))

    def test_a_worker_with_another_octolux_is_named(self) -> None:
        """Its version differs, so that its parts would be refused."""
        place = self.place
        other = place.program("other", 'if [ "$1" = --version ]; then echo "octolux 0.0.9 (old)"; exit; fi')
        place.environment["PATH"] = f"{other.parent}:{os.environ['PATH']}"
        place.worker(self.scheduler, "--name", "old")
        place.environment["PATH"] = f"{place.octolux.parent}:{os.environ['PATH']}"
        code, said = place.run(*COMMAND, "--scheduler", self.scheduler, program="octolux")
        self.assertEqual(code, 1)
        self.assertRegex(
            said, r'error: worker tcp://127\.0\.0\.1:\d+ on .* cannot help: it has "octolux 0\.0\.9 \(old\)"'
        )
        self.assertEqual(place.parts(), [])

    def test_a_scheduler_that_dies_ends_the_command_with_a_sentence(self) -> None:
        """And so do workers that never come."""
        place = self.place
        code, said = place.run(*COMMAND, "--scheduler", self.scheduler, "--patience", "1")
        self.assertEqual((code, said.splitlines()[0]), (1, "error: no worker was there for 1 s"))
        place.worker(self.scheduler, "--no-nanny")
        command = place.start(*COMMAND, "--scheduler", self.scheduler)
        place.wait_for(place.parts)
        place.cluster[0].kill()
        _, said = command.communicate(timeout=60)
        self.assertEqual(command.returncode, 1)
        self.assertIn("error: the connection to the scheduler was lost", said)
        self.assertIn("parts are kept in", said)
        place.wait_for(lambda: not place.alive("render"), seconds=30)


if __name__ == "__main__":
    unittest.main()
