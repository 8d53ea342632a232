"""The page of a study."""

import json
import re
import shutil
import tempfile
import unittest
from pathlib import Path

import numpy as np
from softvt_baselines import UserError, figure, page
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

    def pictures(self, docs: Path) -> list[str]:
        return [(docs / "images" / f"{name}.svg").read_text() for name in ("baselines", "baselines_d")]

    def test_tables_and_pictures_are_repeatable_from_what_was_collected(self):
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
        drawn = self.pictures(self.docs)
        self.assertIn(">VT: with touch</text>", drawn[0])
        self.assertIn(">expert</text>", drawn[0])
        self.assertIn(">2 seeds<", drawn[0])
        page.write([], self.docs)
        self.assertEqual((self.docs / "baselines.md").read_text(), text)
        self.assertEqual(self.pictures(self.docs), drawn)
        shutil.rmtree(self.docs / "baselines" / "one-vo-continuous-s1-r4")
        page.write([], self.docs)
        self.assertIn(">1 or 2 seeds<", self.pictures(self.docs)[0])

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

    def test_policies_of_another_teacher_stand_beside_those_of_the_suite(self):
        self.run_of("one-vo-binary-s0-r4/one", np.zeros((10, 5), bool))
        for inputs in ("vo", "vt"):
            self.run_of(f"one-{inputs}-binary-by-expert-binary-s0-r4/one", np.ones((10, 5), bool))
        page.collect(self.study, self.docs)
        text = page.tables(self.docs)
        self.assertIn("| VO, binary | 4 | 1 | 50 | 100.0", text)
        self.assertIn("| VO shown by expert-binary, binary | 4 | 1 | 50 | 100.0 [100.0, 100.0] |", text)
        for difference in ("VO shown by expert-binary − VO", "VT shown by expert-binary − VO shown by expert-binary"):
            self.assertIn(f"| `one` | {difference} | binary | 4 | 1 | none | 50 |", text)
        (plot,) = page.plots(self.docs)
        self.assertEqual(list(plot.learned)[:3], ["VO binary", "VO binary*", "VO continuous"])
        self.assertIn(">asterisk:", figure.rates([plot]))
        for name in ("VO binary*", "VT binary*"):
            del plot.learned[name]
        self.assertNotIn("asterisk", figure.rates([plot]))

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
        plots = page.plots(docs / "baselines")
        self.assertEqual(self.pictures(docs), [figure.rates(plots), figure.distributions(plots)])

    def test_pictures_have_the_colours_of_the_others(self):
        palette = (Path(__file__).parents[3] / "src" / "media" / "palette.rs").read_text()
        colours = {name: (light, dark) for name, light, dark in re.findall(r'const (\w+): Colour = colour\("(#\w+)", "(#\w+)"\)', palette)}
        same = {"safe": "SAFE", "over": "OVER_LIMIT", "soft": "FAINT", "ink": "INK", "rule": "RULE", "ground": "GROUND"}
        self.assertEqual(figure.COLOURS, {name: colours[other] for name, other in same.items()})

    def test_pictures_show_the_rows_at_the_common_replan(self):
        for code, replan in (("binary", 4), ("continuous", 10)):
            self.run_of(f"one-vo-{code}-s0-r{replan}/one", np.zeros((10, 5), bool))
        for name in ("vb-continuous", "vt-force"):
            self.run_of(f"one-{name}-s0-r4/one", np.ones((10, 5), bool))
        page.collect(self.study, self.docs)
        (plot,) = page.plots(self.docs)
        self.assertEqual(list(plot.learned), ["VO binary", "VO continuous", "VP continuous", "VT continuous", "VPT continuous"])
        self.assertEqual((len(plot.learned["VO continuous"]), list(plot.references)), (2, ["expert"]))

    def test_a_row_is_orange_where_a_success_is_over_the_limit(self):
        page.collect(self.study, self.docs)
        (plot,) = page.plots(self.docs)
        shown = figure.Plot("one", {}, plot.references)
        self.assertNotIn('r="4.5" class="over"', figure.rates([shown]).split("<g ")[0])
        shown.references["expert"][0].safety[3] = 0
        shown.references["expert"][0].ratio[3] = 1.2
        self.assertIn('r="4.5" class="over"', figure.rates([shown]).split("<g ")[0])

    def test_a_bar_includes_the_limit_and_the_axis_ends_with_what_is_beyond_it(self):
        counts = figure._counts(np.array([0.0, 1.0, 1.0001, 400.0]))
        self.assertEqual(np.flatnonzero(counts).tolist(), [0, figure.PER_DECADE - 1, figure.PER_DECADE, len(figure.EDGES) - 2])

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
