"""The order of a study and what happens when a part fails. Needs no learning library: commands are replaced."""

import json
import sys
import tempfile
import types
import unittest
from pathlib import Path
from unittest import mock

from softvt_baselines import UserError, study
from softvt_baselines.__main__ import _parser, _study_of


class Studies(unittest.TestCase):
    def setUp(self):
        scratch = tempfile.TemporaryDirectory()
        self.addCleanup(scratch.cleanup)
        self.out = Path(scratch.name)
        self.calls, self.words, self.switches = [], [], {}
        cuda = types.SimpleNamespace(device_count=lambda: 0)
        for patch in (
            mock.patch.dict(sys.modules, {"torch": types.SimpleNamespace(cuda=cuda)}),
            mock.patch.object(study, "_call", self.call),
            mock.patch.object(study, "run_softvt", self.run_softvt),
            mock.patch.object(study, "pack", lambda *_: None),
        ):
            patch.start()
            self.addCleanup(patch.stop)
        self.failing = ""

    def call(self, words, log, gpu=None):
        self.words.append(words)
        self.calls.append(" ".join(words[:1] + words[words.index("--out") + 1 :][:1]).replace(f"{self.out}/", ""))
        if self.failing and self.failing in self.calls[-1]:
            raise UserError("it failed")
        if words[0] == "train":
            kept = ("--touch", "markers", "contact", "pictures", "--drives", "--memory")
            self.switches[Path(words[words.index("--out") + 1]).stem.split("-")[1]] = " ".join(word for word in words if word in kept)
            Path(words[words.index("--out") + 1]).touch()
        if words[0] == "evaluate":
            (Path(words[words.index("--out") + 1]) / Path(words[2]).stem).mkdir(parents=True)

    def run_softvt(self, words):
        self.calls.append(" ".join(words[:2]))
        if self.failing and self.failing in self.calls[-1]:
            raise UserError("it failed")
        if words[0] != "record":
            Path(words[words.index("--out") + 1]).mkdir(parents=True)

    def study(self, **changes) -> study.Study:
        options = dict(suites=["one"], inputs=["vo", "vt"], seeds=[0], codes=["continuous"], replans=[4, 10], out=self.out, demos=1)
        return study.Study(**options | dict(steps=2, episodes=1) | changes)

    def test_every_policy_is_trained_once_and_evaluated_with_every_replan(self):
        study.run(self.study(references=("expert",), shifts=True))
        self.assertEqual(self.calls[0], "record suites/one.lua")
        runs = sorted(call for call in self.calls if call.startswith("evaluate"))
        expected = [f"evaluate runs/one-{inputs}-continuous-s0-r{replan}" for inputs in ("vo", "vt") for replan in (10, 4, 4)]
        self.assertEqual(runs, expected)
        self.calls.clear()
        study.run(self.study(references=("expert",), shifts=True))
        self.assertEqual(self.calls, ["record suites/one.lua"], "what is there is not made again")

    def test_inputs_are_switches_of_training(self):
        study.run(self.study(inputs=["vo", "vp", "vt", "vpt", "vb", "vi"]))
        expected = {"vo": "", "vp": "--drives", "vt": "--touch markers", "vpt": "--drives --touch markers"}
        self.assertEqual(self.switches, expected | {"vb": "--touch contact", "vi": "--touch pictures"})

    def test_what_fails_is_named_and_the_rest_goes_on(self):
        self.failing = "train checkpoints/one-vo"
        with self.assertRaises(UserError) as caught:
            study.run(self.study())
        self.assertIn("1 recordings, policies or runs are not complete: it failed", str(caught.exception))
        self.assertIn("evaluate runs/one-vt-continuous-s0-r10", self.calls)

    def test_a_suite_that_cannot_be_recorded_does_not_stop_the_others(self):
        self.failing = "suites/one"
        with self.assertRaises(UserError):
            study.run(self.study(suites=["one", "two"]))
        self.assertIn("evaluate runs/two-vt-continuous-s0-r4", self.calls)

    def test_other_options_need_another_folder(self):
        study.run(self.study())
        with self.assertRaises(UserError) as caught:
            study.run(self.study(steps=3))
        self.assertIn("steps 2, now 3", str(caught.exception))

    def test_results_say_where_they_come_from(self):
        with mock.patch.dict("os.environ", {"SOFTVT_COMMIT": "abc"}):
            study.run(self.study(inputs=["vt"], replans=[4]))
        origin = json.loads((self.out / "runs/one-vt-continuous-s0-r4/one" / study.ORIGIN).read_text())
        self.assertEqual((origin["commit"], len(origin["checkpoint_sha256"])), ("abc", 64))

    def test_no_part_is_begun_after_the_time(self):
        study.run(self.study(until=0))
        self.assertEqual(self.calls, [])

    def test_policies_that_remember_have_recordings_of_their_own(self):
        study.run(self.study(memory=True, attempts=7, task="0,3", inputs=["vt"]))
        self.assertEqual(self.calls[0], "demonstrate data/one")
        self.assertIn("--memory", self.switches["vt"])
        self.assertNotIn("--tactile-pictures", self.words[0])

    def test_codes_in_which_a_hand_closes_at_once_have_recordings_of_their_own_and_no_memory(self):
        study.run(self.study(memory=True, inputs=["vt"], codes=["continuous", "two-width"], replans=[4], references=("expert",)))
        self.assertEqual([call for call in self.calls if "demonstrate" in call], ["demonstrate data/one", "demonstrate data/one-two-width"])
        trained = {Path(words[words.index("--out") + 1]).stem: words for words in self.words if words[0] == "train"}
        self.assertIn("--memory", trained["one-vt-continuous-s0"])
        self.assertNotIn("--memory", trained["one-vt-two-width-s0"])
        self.assertEqual(Path(trained["one-vt-two-width-s0"][1]).name, "one-two-width")
        self.assertEqual(sum("suites/one.lua" in call for call in self.calls), 1, "a reference runs once")

    def test_codes_in_which_a_hand_closes_at_once_share_the_runs_of_the_teacher(self):
        study.run(self.study(memory=True, inputs=["vt"], codes=["continuous", "two-width", "force"], replans=[4]))
        words = [words for words in self.words if words[0] == "demonstrate"]
        self.assertNotIn("--teacher-runs", words[0])
        shared = [given[given.index("--teacher-runs") + 1] for given in words[1:]]
        self.assertEqual(shared, [str(self.out / "data" / "one-teacher")] * 2)

    def test_policies_are_named_by_a_teacher_that_is_not_that_of_the_suite(self):
        study.run(self.study(inputs=["vo"], codes=["binary"], replans=[4], teacher="expert-binary", keep="goal"))
        self.assertIn("evaluate runs/one-vo-binary-by-expert-binary-s0-r4", self.calls)

    def test_frames_are_recorded_trained_and_named(self):
        study.run(self.study(memory=True, inputs=["vt"], frames=2))
        self.assertEqual(self.calls[:2], ["demonstrate data/one", "train checkpoints/one-vt2-continuous-s0.pt"])
        self.assertTrue(all(words[words.index("--frames") + 1] == "2" for words in self.words[:2]))

    def test_studies_from_before_an_option_have_its_default(self):
        study.run(self.study())
        path = self.out / "study.json"
        before = json.loads(path.read_text())
        del before["frames"]
        path.write_text(json.dumps(before))
        study.run(self.study())
        with self.assertRaisesRegex(UserError, "frames 1, now 2"):
            study.run(self.study(frames=2))

    def test_tactile_pictures_are_recorded_if_a_policy_sees_them(self):
        study.run(self.study(memory=True, inputs=["vt", "vi"], replans=[4]))
        self.assertIn("--tactile-pictures", self.words[0])

    def test_options_that_do_not_fit_each_other_are_refused(self):
        for words, problem in [
            ("--memory --inputs vi --replans 4 10", "--replans 10: --inputs vi with --memory needs 8 or less"),
            ("--memory --codes binary", "--codes binary: --memory has demonstrations in the codes continuous, two-width, force only"),
        ]:
            given = _parser().parse_args(["study", "one", "--out", ".", *words.split()])
            with self.assertRaisesRegex(UserError, problem):
                _study_of(given, self.out, [], 0)

    def test_a_queue_has_a_study_per_line(self):
        path = self.out / "queue"
        path.write_text("# First.\nsmall one two --seeds 0  # with one seed\n\nmore one\n")
        self.assertEqual(study.read_queue(path), [["small", "one", "two", "--seeds", "0"], ["more", "one"]])
        with self.assertRaises(UserError):
            study.read_queue(self.out / "none")


if __name__ == "__main__":
    unittest.main()
