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


def chosen(rows: list[dict], *keys: str) -> list[tuple]:
    """Columns of a table, by row."""
    return [tuple(row[key] for key in keys) for row in rows]


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
        self.assertIn("| `one` | VT, continuous | 4 | 2 | 50 | 100.0 [100.0, 100.0] |", text)
        self.assertIn("| `one` | expert (privileged) |  | 1 | 50 | 100.0", text)
        files = {path.stem: path.read_text() for path in (self.docs / "baselines").glob("*.csv")}
        for pair in ("VP − VO", "VT − VO", "VT − VP", "VPT − VP"):
            self.assertIn(f"one,{pair},continuous,4,2,none,50,0.0,0.0,0.0,", files["differences"])
        self.assertEqual((files["differences"].count("\none,"), files["references"].count("\none,")), (4, 4))
        self.assertIn('one,"VT, continuous − expert (privileged)",4,2,50,0.0,0.0,0.0,-', files["references"])
        drawn = self.pictures(self.docs)
        self.assertIn(">VT: with touch</text>", drawn[0])
        self.assertIn(">expert</text>", drawn[0])
        self.assertIn(">2 seeds<", drawn[0])
        page.write([], self.docs)
        self.assertEqual((self.docs / "baselines.md").read_text(), text)
        self.assertEqual(self.pictures(self.docs), drawn)
        (self.docs / "baselines" / "outcomes" / "one-vo-continuous-s1-r4.csv").unlink()
        page.write([], self.docs)
        self.assertIn(">1 or 2 seeds<", self.pictures(self.docs)[0])

    def test_runs_under_a_condition_are_rows_of_their_own(self):
        for inputs in ("vo", "vt"):
            self.run_of(f"one-{inputs}-continuous-s0-r4/shifts/light x2", np.ones((10, 5), bool))
            self.run_of(f"one-{inputs}-continuous-s0-r4/shifts/reference", np.zeros((10, 5), bool))
        page.collect(self.study, self.docs)
        tables = page.tables(self.docs)
        self.assertIn(("VT − VO", 1, "light x2"), chosen(tables["differences"], "difference", "seeds", "shift"))
        self.assertNotIn("reference", [row["shift"] for name in ("differences", "shifts") for row in tables[name]])
        self.assertIn(("VT, continuous", "light x2", "100.0"), chosen(tables["shifts"], "policy", "shift", "change_of_safety"))

    def test_policies_of_two_frames_are_compared_with_each_other_and_with_one(self):
        for inputs in ("vo2", "vt2"):
            self.run_of(f"one-{inputs}-continuous-s0-r4/one", np.ones((10, 5), bool))
        page.collect(self.study, self.docs)
        tables = page.tables(self.docs)
        self.assertIn(("VT of two frames, continuous", 50, "100.0"), chosen(tables["rates"], "policy", "episodes", "goal"))
        for difference in ("VT of two frames − VO of two frames", "VT of two frames − VT"):
            self.assertIn((difference, 1), chosen(tables["differences"], "difference", "seeds"))

    def test_policies_of_another_teacher_stand_beside_those_of_the_suite(self):
        self.run_of("one-vo-binary-s0-r4/one", np.zeros((10, 5), bool))
        for inputs in ("vo", "vt"):
            self.run_of(f"one-{inputs}-binary-by-expert-binary-s0-r4/one", np.ones((10, 5), bool))
        page.collect(self.study, self.docs)
        tables = page.tables(self.docs)
        for name in ("VO, binary", "VO shown by expert-binary, binary"):
            self.assertIn((name, 50, "100.0"), chosen(tables["rates"], "policy", "episodes", "goal"))
        for difference in ("VO shown by expert-binary − VO", "VT shown by expert-binary − VO shown by expert-binary"):
            self.assertIn((difference, "binary", 50), chosen(tables["differences"], "difference", "code", "episodes"))
        (plot,) = page.plots(self.docs)
        self.assertEqual(list(plot.learned)[:3], ["VO binary", "VO binary*", "VO continuous"])
        self.assertIn(">asterisk:", figure.rates([plot]))
        for name in ("VO binary*", "VT binary*"):
            del plot.learned[name]
        self.assertNotIn("asterisk", figure.rates([plot]))

    def test_policies_are_compared_on_the_seeds_that_both_have(self):
        shutil.rmtree(self.study / "runs" / "one-vo-continuous-s0-r4")
        page.collect(self.study, self.docs)
        tables = page.tables(self.docs)
        self.assertIn(("VT, continuous", 2), chosen(tables["rates"], "policy", "seeds"))
        seeds = chosen(tables["differences"], "difference", "seeds")
        self.assertTrue(("VT − VO", 1) in seeds and ("VT − VP", 2) in seeds)

    def test_an_interrupted_run_that_was_collected_is_compared_on_the_episodes_that_both_have(self):
        page.collect(self.study, self.docs)
        collected, runs = self.docs / "outcomes" / "one-vo-continuous-s0-r4.csv", self.docs / "runs.csv"
        runs.write_text(runs.read_text().replace("one-vo-continuous-s0-r4,1", "one-vo-continuous-s0-r4,0"))
        lines = collected.read_text().splitlines()
        collected.write_text("\n".join(lines[:-7]) + "\n")
        for name in (
            "vp-continuous-s0",
            "vpt-continuous-s0",
            "vo-continuous-s1",
            "vp-continuous-s1",
            "vt-continuous-s1",
            "vpt-continuous-s1",
        ):
            (self.docs / "outcomes" / f"one-{name}-r4.csv").unlink()
        tables = page.tables(self.docs)
        rates = chosen(tables["rates"], "policy", "episodes", "finished")
        self.assertTrue(("VO, continuous", 43, 0) in rates and ("VT, continuous", 50, 1) in rates)
        self.assertIn("| 43 (interrupted) |", page.rates_text(tables["rates"]))
        self.assertIn(("VT − VO", 43), chosen(tables["differences"], "difference", "episodes"))
        self.assertIn((8, "bun", 3), chosen(tables["tasks"], "task", "asset", "episodes"))

    def test_the_published_page_is_that_of_the_published_outcomes(self):
        docs = Path(__file__).parents[3] / "docs"
        published = (docs / "baselines.md").read_text().split(page.BEGIN)[1].split(page.END)[0]
        tables = page.tables(docs / "baselines")
        self.assertEqual(published.strip(), page.rates_text(tables["rates"]).strip())
        for name, rows in tables.items():
            with self.subTest(table=name):
                self.assertEqual(
                    page._read(docs / "baselines" / f"{name}.csv"), [{key: str(cell) for key, cell in row.items()} for row in rows]
                )
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

    def test_ratios_without_a_limit_have_no_percentiles(self):
        columns = page._percentiles("ratio", np.array([np.nan, np.inf]))
        self.assertEqual(set(columns.values()), {""}, "an invalid episode of a suite without limits")
        self.assertEqual(page._percentiles("ratio", np.array([1.0, 2.0, np.inf]))["ratio_p95"], "2")

    def test_runs_say_where_they_come_from(self):
        origin = {"machine": "a machine", "commit": "abc", "checkpoint_sha256": "0123456789abcdef" * 4}
        run = self.study / "runs" / "one-vo-continuous-s0-r4" / "one"
        (run / "origin.json").write_text(json.dumps(origin))
        (run / "run.json").write_text(json.dumps({"softvt": "0.2.0"}))
        page.collect(self.study, self.docs)
        expected = "one-vo-continuous-s0-r4,1,0.2.0,abc,a machine," + "0123456789abcdef" * 4
        self.assertIn(expected, (self.docs / "runs.csv").read_text())

    def test_foreign_runs_are_refused_and_not_collected(self):
        self.run_of("something", np.ones((10, 5), bool))
        with self.assertRaises(UserError) as caught:
            page.write([self.study], self.docs)
        self.assertIn("not named as a run of a study", str(caught.exception))
        self.assertFalse((self.docs / "baselines" / "outcomes" / "something.csv").exists())

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
