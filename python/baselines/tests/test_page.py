"""The page of a study."""

import json
import shutil
import tempfile
import unittest
from pathlib import Path

import numpy as np
from softvt_baselines import UserError, page
from test_results import run


class Pages(unittest.TestCase):
    def setUp(self):
        scratch = tempfile.TemporaryDirectory()
        self.addCleanup(scratch.cleanup)
        self.study, self.docs = Path(scratch.name) / "study", Path(scratch.name) / "docs"
        self.docs.mkdir()
        random = np.random.default_rng(0)
        for inputs, rate in (("vo", 0.5), ("vp", 0.7), ("vt", 0.9), ("vpt", 0.9)):
            for seed in range(2):
                self.run_of(f"one-{inputs}-continuous-s{seed}-r4/one", random.random((10, 5)) < rate)
        self.run_of("one-expert", np.ones((10, 5), bool))

    def run_of(self, path: str, safe: np.ndarray) -> None:
        folder = self.study / "runs" / path
        folder.parent.mkdir(parents=True, exist_ok=True)
        run(folder, safe, suite="one")

    def test_tables_and_figure_are_repeatable_from_what_was_collected(self):
        (self.docs / "baselines.md").write_text(f"before\n{page.BEGIN}\nold\n{page.END}\nafter\n")
        page.write([self.study], self.docs)
        text = (self.docs / "baselines.md").read_text()
        self.assertTrue(text.startswith("before\n") and text.endswith("after\n") and "old" not in text)
        self.assertIn("| VT, continuous | 4 | 2 | 50 | 100.0 [100.0, 100.0] |", text)
        self.assertIn("| expert (privileged) |  | 1 | 50 | 100.0", text)
        difference = text.split("### Differences", 1)[1]
        for pair in ("VP − VO", "VT − VO", "VT − VP", "VPT − VP"):
            self.assertIn(f"| `one` | {pair} | continuous | 4 | 2 | none | 50 | +0.0 [+0.0, +0.0] |", difference)
        between, against = difference.split("### Differences from reference controllers")
        self.assertEqual((between.count("| `one` |"), against.count("| `one` |")), (4, 4))
        self.assertIn("| `one` | VT, continuous − expert (privileged) | 4 | 2 | 50 | +0.0 [+0.0, +0.0] | -", against)
        figure = (self.docs / "images" / "baselines.svg").read_bytes()
        page.write([], self.docs)
        self.assertEqual((self.docs / "baselines.md").read_text(), text)
        self.assertEqual((self.docs / "images" / "baselines.svg").read_bytes(), figure)

    def test_runs_under_a_condition_are_rows_of_their_own(self):
        for inputs in ("vo", "vt"):
            self.run_of(f"one-{inputs}-continuous-s0-r4/shifts/light x2", np.ones((10, 5), bool))
            self.run_of(f"one-{inputs}-continuous-s0-r4/shifts/reference", np.zeros((10, 5), bool))
        page.collect(self.study, self.docs)
        text = page.tables(self.docs)
        self.assertIn("| `one` | VT − VO | continuous | 4 | 1 | light x2 |", text)
        self.assertNotIn("| reference |", text)
        self.assertIn("| `one` | VT, continuous | 4 | 1 | light x2 | 100.0 [100.0, 100.0] | 100.0 [100.0, 100.0] | +100.0", text)

    def test_policies_of_two_frames_are_compared_with_each_other_and_with_one(self):
        for inputs in ("vo2", "vt2"):
            self.run_of(f"one-{inputs}-continuous-s0-r4/one", np.ones((10, 5), bool))
        page.collect(self.study, self.docs)
        text = page.tables(self.docs)
        self.assertIn("| VT of two frames, continuous | 4 | 1 | 50 | 100.0 [100.0, 100.0] |", text)
        for difference in ("VT of two frames − VO of two frames", "VT of two frames − VT"):
            self.assertIn(f"| `one` | {difference} | continuous | 4 | 1 | none |", text)

    def test_policies_are_compared_on_the_seeds_that_both_have(self):
        shutil.rmtree(self.study / "runs" / "one-vo-continuous-s0-r4")
        page.collect(self.study, self.docs)
        text = page.tables(self.docs)
        self.assertIn("| VT, continuous | 4 | 2 | 50 |", text)
        self.assertIn("| `one` | VT − VO | continuous | 4 | 1 | none | 50 |", text)
        self.assertIn("| `one` | VT − VP | continuous | 4 | 2 | none | 50 |", text)

    def test_an_interrupted_run_that_was_collected_is_compared_on_the_episodes_that_both_have(self):
        page.collect(self.study, self.docs)
        collected = self.docs / "one-vo-continuous-s0-r4"
        (collected / "summary.json").unlink()
        lines = (collected / "outcomes.csv").read_text().splitlines()
        (collected / "outcomes.csv").write_text("\n".join(lines[:-7]) + "\n")
        for inputs in ("vp", "vpt"):
            for seed in range(2):
                shutil.rmtree(self.docs / f"one-{inputs}-continuous-s{seed}-r4")
        for inputs in ("vo", "vt"):
            shutil.rmtree(self.docs / f"one-{inputs}-continuous-s1-r4")
        text = page.tables(self.docs)
        self.assertIn("| VO, continuous | 4 | 1 | 43 (interrupted) |", text)
        self.assertIn("| VT, continuous | 4 | 1 | 50 |", text)
        self.assertIn("| `one` | VT − VO | continuous | 4 | 1 | none | 43 |", text)
        self.assertIn("| 8 | – | 3 |", text.split("by task and by stage")[1])

    def test_the_published_page_is_that_of_the_published_outcomes(self):
        docs = Path(__file__).parents[3] / "docs"
        published = (docs / "baselines.md").read_text().split(page.BEGIN)[1].split(page.END)[0]
        self.assertEqual(published.strip(), page.tables(docs / "baselines").strip())

    def test_ratios_without_a_limit_and_very_large_ones_have_no_numbers(self):
        self.assertEqual(page._spread(np.array([np.nan, np.inf])), "–", "an invalid episode of a suite without limits")
        self.assertEqual(page._spread(np.array([1.0, 2.0, 400.0])), "2.00 [1.10, 89.30]")
        self.assertEqual(page._spread(np.array([200.0, 300.0])), "> 99 [> 99, > 99]")

    def test_runs_say_where_they_come_from(self):
        origin = {"machine": "a machine", "commit": "abc", "checkpoint_sha256": "0123456789abcdef" * 4}
        run = self.study / "runs" / "one-vo-continuous-s0-r4" / "one"
        (run / "origin.json").write_text(json.dumps(origin))
        (run / "run.json").write_text(json.dumps({"softvt": "0.2.0"}))
        page.collect(self.study, self.docs)
        expected = "Made by softvt 0.2.0 at abc on a machine. Checkpoints (SHA-256): `one-vo-continuous-s0-r4` 0123456789abcdef."
        self.assertIn(expected, page.tables(self.docs))

    def test_foreign_runs_are_refused_and_not_collected(self):
        self.run_of("something", np.ones((10, 5), bool))
        with self.assertRaises(UserError) as caught:
            page.write([self.study], self.docs)
        self.assertIn("not named as a run of a study", str(caught.exception))
        self.assertFalse((self.docs / "baselines" / "something").exists())

    def test_what_is_missing_is_named(self):
        with self.assertRaises(UserError) as caught:
            page.write([self.docs], self.docs)
        self.assertIn("no finished runs", str(caught.exception))
        (self.docs / "baselines.md").write_text("no place")
        with self.assertRaises(UserError) as caught:
            page.write([self.study], self.docs)
        self.assertIn(page.BEGIN, str(caught.exception))


if __name__ == "__main__":
    unittest.main()
