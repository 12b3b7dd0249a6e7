"""What the package decides by itself, and its command on a cluster in its own process."""

import signal
import tempfile
import time
import unittest
from dataclasses import replace
from pathlib import Path
from unittest import mock

from loopback import SCENE, Place

from octolux_dask import scene
from octolux_dask.errors import Exit, Failure
from octolux_dask.job import Job
from octolux_dask.parts import Parts
from octolux_dask.progress import clock

SETTINGS = ("--size", "48x32", "--spp", "4000", "--seed", "7")


class Scene(unittest.TestCase):
    """Which files travel."""

    def setUp(self) -> None:
        """Make a folder `in` beside a secret."""
        self.outer = Path(self.enterContext(tempfile.TemporaryDirectory()))
        self.folder = self.outer / "in"
        (self.folder / "meshes").mkdir(parents=True)
        (self.outer / "secret").write_bytes(b"secret")
        self.scene = self.folder / "a.toml"

    def test_a_scene_travels_with_every_file_that_it_names(self) -> None:
        """Also with those that its files name, and with nothing else."""
        self.scene.write_text("""file = "meshes/a.gltf" # 'note'\nmap = { file = 'sky.exr' }\nother = "nothing.ply\"""")
        (self.folder / "meshes/a.gltf").write_text('{"buffers": [{"uri": "a%20b.bin"}, {"uri": "../sky.exr"}]}')
        (self.folder / "meshes/a b.bin").write_bytes(b"\0\1")
        (self.folder / "sky.exr").write_bytes(b"sky")
        (self.folder / "unused.ply").write_bytes(b"ply")
        files = scene.files(self.scene)
        self.assertEqual(set(files), {"a.toml", "meshes/a.gltf", "meshes/a b.bin", "sky.exr"})
        self.assertEqual(files["meshes/a b.bin"], b"\0\1")

    def test_what_lies_outside_of_the_folder_stays_at_home(self) -> None:
        """By its name or behind a link."""
        (self.folder / "link").symlink_to(self.outer / "secret")
        (self.folder / "loop").symlink_to("loop")
        names = ["../secret", f"{self.outer}/secret", "link", "loop", "meshes/../../secret", "x" * 5000, "meshes", "."]
        self.scene.write_text("\n".join(f'file = "{name}"' for name in names))
        self.assertEqual(set(scene.files(self.scene)), {"a.toml"})

    def test_a_scene_that_is_missing_or_too_large_is_refused(self) -> None:
        """With the exit code of a bad scene."""
        with self.assertRaises(Failure) as caught:
            scene.files(self.scene)
        self.assertEqual(caught.exception.code, Exit.BAD_INPUT)
        self.scene.write_bytes(b"x" * 11)
        with mock.patch.object(scene, "MOST_BYTES", 10), self.assertRaisesRegex(Failure, "too much to send"):
            scene.files(self.scene)


def a_job(path: Path) -> Job:
    """Make a job that is not rendered."""
    files = {"a.toml": b"ab", "b": b"c"}
    return Job(path, 4, "octolux", "octolux 1", threads=1, options=("--spp", "4"), files=files, shared=False)


class Folder(unittest.TestCase):
    """The folder of parts."""

    def setUp(self) -> None:
        """Make a place for it."""
        self.folder = Path(self.enterContext(tempfile.TemporaryDirectory()))
        self.job = a_job(self.folder / "a.toml")

    def test_whatever_changes_the_bits_changes_the_digest_and_nothing_else_does(self) -> None:
        """Scene, files, options, shards, program; not threads, nor how files travel."""
        others = [
            replace(self.job, shards=5),
            replace(self.job, version="octolux 2"),
            replace(self.job, options=("--spp4",)),
            replace(self.job, options=("--spp", "5")),
            replace(self.job, files={"a.toml": b"a", "b": b"bc"}),
            replace(self.job, files={"a.toml": b"ab", "c": b"c"}),
        ]
        digests = {job.digest for job in [self.job, *others]}
        self.assertEqual(len(digests), 1 + len(others))
        same = replace(self.job, threads=2, shared=True, program="/bin/octolux", scene=Path("/elsewhere/a.toml"))
        self.assertEqual(same.digest, self.job.digest)

    def test_a_folder_that_holds_parts_stays_and_an_empty_one_goes(self) -> None:
        """Nothing is left of a run that rendered nothing."""
        parts = Parts(self.job, self.folder / "a.npy")
        self.assertEqual(parts.missing(), [1, 2, 3, 4])
        self.assertEqual(parts.close(), 0)
        self.assertEqual(list(self.folder.iterdir()), [])
        parts = Parts(self.job, self.folder / "a.npy")
        parts.keep(2, b"sums", "worker")
        self.assertEqual(parts.close(), 1)
        self.assertEqual(parts.path(2).read_bytes(), b"sums")

    def test_two_commands_never_work_in_one_folder(self) -> None:
        """The second is told so."""
        parts = Parts(self.job, self.folder / "a.npy")
        with self.assertRaisesRegex(Failure, "another octolux-dask"):
            Parts(self.job, self.folder / "b.npy")
        parts.close()
        Parts(self.job, self.folder / "b.npy").close()

    def test_times_are_minutes_and_seconds(self) -> None:
        """Also beyond an hour."""
        self.assertEqual([clock(seconds) for seconds in (0.9, 61, 6000)], ["0:00", "1:01", "100:00"])


class Command(unittest.TestCase):
    """The whole command on a cluster in its own process."""

    def setUp(self) -> None:
        """Make a place for it."""
        self.place = self.enterContext(Place())

    def test_shards_make_the_bits_of_one_process(self) -> None:
        """And leave nothing but the picture, on paths that are shared as well."""
        alone = self.place.one_process(SCENE, *SETTINGS)
        for words in ([], ["--shared", "--threads", "2"]):
            code, said = self.place.run(SCENE, "--shards", "5", *SETTINGS, *words, "-o", "many.npy")
            self.assertEqual(code, 0, said)
            self.assertIn("wrote many.npy", said)
            self.assertEqual(self.place.sha256("many.npy"), alone)
            self.assertEqual(self.place.parts(), [])
            (self.place.folder / "many.npy").unlink()

    def test_a_mesh_travels_with_its_scene(self) -> None:
        """Workers render it in folders of their own."""
        knot = SCENE.parent / "knot.toml"
        settings = ("--size", "32x24", "--spp", "64")
        code, said = self.place.run(knot, "--shards", "2", *settings, "-o", "many.npy")
        self.assertEqual(code, 0, said)
        self.assertEqual(self.place.sha256("many.npy"), self.place.one_process(knot, *settings))

    def test_a_shard_that_fails_is_tried_again(self) -> None:
        """Once by an exit code, once by a signal."""
        program = self.place.program(
            "weak",
            """if [ "$1" = render ]; then
            mkdir $here/first 2> /dev/null && { echo "error: no luck" >&2; exit 1; }
            mkdir $here/second 2> /dev/null && kill -9 $$
            fi""",
        )
        code, said = self.place.run(SCENE, "--shards", "3", *SETTINGS, "-o", "many.npy", program=program)
        self.assertEqual(code, 0, said)
        self.assertRegex(said, r"note: shard \d failed and is tried again: worker inproc://.*: error: no luck")
        self.assertIn("octolux was ended by SIGKILL", said)
        self.assertEqual(self.place.sha256("many.npy"), self.place.one_process(SCENE, *SETTINGS))

    def test_a_shard_that_always_fails_ends_the_command_and_the_others_are_kept(self) -> None:
        """The next run, with a whole program, renders what is missing alone."""
        words = (SCENE, "--shards", "3", *SETTINGS, "-o", "many.npy")
        fails = 'case "$*" in *"--shard 3/3"*) echo "error: no luck" >&2; exit 1;; esac'
        log = 'echo "$*" >> $here/log'
        code, said = self.place.run(*words, "--retries", "5", program=self.place.program("weak", fails))
        self.assertEqual(code, 1)
        self.assertRegex(said, "error: shard 3 failed 6 times, lastly so: .*no luck")
        self.assertFalse((self.place.folder / "many.npy").exists())
        kept = len(self.place.parts())
        self.assertIn(f"note: {kept} of 3 parts are kept", said)
        code, said = self.place.run(*words, program=self.place.program("logs", log))
        self.assertEqual(code, 0, said)
        self.assertEqual((self.place.folder / "log").read_text().count("render"), 3 - kept)
        self.assertEqual(self.place.sha256("many.npy"), self.place.one_process(SCENE, *SETTINGS))

    def test_a_part_of_another_render_is_refused_with_the_name_of_its_worker(self) -> None:
        """As from a worker with another Embree, which only the part itself tells."""
        program = self.place.program("odd", 'case "$*" in *"--shard 2/3"*) set -- "$@" --seed 9;; esac')
        words = (SCENE, "--shards", "3", *SETTINGS[:4], "-o", "many.npy")
        code, said = self.place.run(*words, program=program)
        self.assertEqual(code, 1)
        self.assertRegex(said, "error: .*/2-of-3.acc: belongs to another render than .*: seed")
        self.assertRegex(said, "note: 2-of-3.acc was rendered by inproc://")
        self.assertFalse((self.place.folder / "many.npy").exists())
        self.place.parts()[1].unlink()
        code, said = self.place.run(*words)
        self.assertEqual(code, 0, said)
        self.assertEqual(self.place.sha256("many.npy"), self.place.one_process(SCENE, *SETTINGS[:4]))

    def test_a_bad_scene_is_told_at_once_and_never_tried_again(self) -> None:
        """In the words of octolux, with exit code 2; so is a bad option."""
        program = self.place.program("logs", 'echo "$*" >> $here/log')
        (self.place.folder / "bad.toml").write_text("[camera]\n")
        for scene_file, option in (("bad.toml", "--spp=2"), (str(SCENE), "--sppp=2")):
            log = self.place.folder / "log"
            log.write_text("")
            words = (scene_file, "--shards", "20", option, "-o", "many.npy")
            code, said = self.place.run(*words, program=program)
            self.assertEqual(code, 2, said)
            self.assertTrue(said.startswith("error: "), said)
            self.assertIn(scene_file if scene_file == "bad.toml" else "--sppp", said)
            self.assertLess(log.read_text().count("render"), 20)
            self.assertEqual(list(self.place.folder.glob("many*")) + list(self.place.folder.glob("*.parts")), [])

    def test_an_interrupted_command_kills_its_renders_and_keeps_what_came_back(self) -> None:
        """By ctrl-c as by SIGTERM, and by both of them in a hurry."""
        for numbers in ([signal.SIGINT], [signal.SIGTERM], [signal.SIGINT, signal.SIGTERM]):
            command = self.place.start(SCENE, "--shards", "8", "--spp", "200000", "-o", "many.npy")
            self.place.wait_for(lambda: self.place.alive("render"))
            for number in numbers:
                command.send_signal(number)
                time.sleep(0.05)
            _, said = command.communicate(timeout=30)
            self.assertEqual(command.returncode, 130, said)
            self.assertNotIn("Traceback", said)
            self.place.wait_for(lambda: not self.place.alive(), seconds=5)
            self.assertFalse((self.place.folder / "many.npy").exists())

    def test_a_wrong_command_line_gets_a_sentence_and_exit_code_2(self) -> None:
        """Before anything is rendered."""
        scene_file = str(SCENE)
        wrong = {
            ("--shards", "3"): "the scene comes first",
            (scene_file,): "required: --shards",
            (scene_file, "--shards", "0"): "a whole number from 1 on is wanted, got 0",
            (scene_file, "--shards", "2", "-o", "a.jpg"): "ends in .exr, .png or .npy",
            (scene_file, "--shards", "2", "-o", "none/a.png"): "the folder none does not exist",
            (scene_file, "--shards", "2", "--allow-outside"): "not sent to workers",
            (scene_file, "--shards", "2", "--scheduler", "nonsense://"): "unknown address scheme",
            ("none.toml", "--shards", "2"): "none.toml: cannot be read: No such file",
        }
        for words, sentence in wrong.items():
            with self.subTest(sentence):
                code, said = self.place.run(*words)
                self.assertEqual(code, 2)
                self.assertRegex(said, f"^error: .*{sentence}")
                self.assertEqual(list(self.place.folder.glob("*.parts")), [])


if __name__ == "__main__":
    unittest.main()
