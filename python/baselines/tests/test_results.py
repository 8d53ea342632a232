"""Rates and paired differences."""

import json
import tempfile
import unittest
from pathlib import Path

import numpy as np
from softvt_baselines import UserError
from softvt_baselines.results import difference, load, load_collected, rate, save


def run(folder: Path, safe: np.ndarray, suite: str = "one") -> Path:
    """A run of ten tasks; `safe` is (10, episodes)."""
    folder.mkdir()
    rows = [
        {
            "suite": suite,
            "policy": folder.name,
            "task": task,
            "asset": "bun",
            "episode": episode,
            "goal": True,
            "no_drop": True,
            "safety": bool(is_safe),
            "tau": 0.5,
            "d_peak": 0.25,
            "grip_ratio": 1.5 if is_safe else None,
            "outcome": {"kind": "invalid" if not is_safe else "completed"},
        }
        for (task, episode), is_safe in np.ndenumerate(safe)
    ]
    (folder / "episodes.jsonl").write_text("".join(json.dumps(row) + "\n" for row in reversed(rows)))
    (folder / "summary.json").write_text(json.dumps({"suite": suite}))
    return folder


class Results(unittest.TestCase):
    def setUp(self):
        scratch = tempfile.TemporaryDirectory()
        self.addCleanup(scratch.cleanup)
        self.folder = Path(scratch.name)

    def test_rates_are_means_over_seeds_with_an_interval_that_covers(self):
        random = np.random.default_rng(1)
        runs = [load(run(self.folder / f"s{seed}", random.random((10, 50)) < 0.8)) for seed in range(3)]
        safety = rate(runs, "safety")
        self.assertAlmostEqual(safety.mean, 100 * np.mean([one.safety.mean() for one in runs]))
        # Three independent draws of 500: a standard error of 1.03 points, which seeds that are redrawn as well widen.
        self.assertTrue(1.0 < (safety.high - safety.low) / 3.92 < 2.1)
        self.assertLess(difference(runs, runs, "safety").mean, 1e-9)
        random = np.random.default_rng(1)
        apart = [load(run(self.folder / f"a{seed}", random.random((10, 50)) < 0.6 + 0.2 * seed)) for seed in range(3)]
        self.assertGreater(rate(apart, "safety").high - rate(apart, "safety").low, 20, "seeds that differ")
        self.assertEqual(rate(runs, "goal").text(), "100.0 [100.0, 100.0]")
        self.assertEqual(sorted(set(runs[0].ratio)), [0.5, np.inf])

    def test_differences_are_paired(self):
        safe = np.random.default_rng(2).random((10, 50)) < 0.5
        better = safe.copy()
        better[:, :10] = True
        first, second = load(run(self.folder / "a", safe)), load(run(self.folder / "b", better))
        found = difference([first], [second], "safety")
        self.assertAlmostEqual(found.mean, 100 * (better.mean() - safe.mean()))
        self.assertLess(found.high - found.low, 6, "the episodes in common cancel")
        self.assertTrue(found.text(signed=True).startswith("+"))

    def test_collected_outcomes_are_those_of_the_run(self):
        before = load(run(self.folder / "a", np.random.default_rng(3).random((10, 5)) < 0.5))
        before.ratio[:2] = 1.00003, 1 + 1e-12  # just above the limit
        (self.folder / "a" / "episodes.jsonl").unlink()
        save(before, self.folder / "one-a.csv")
        after = load_collected(self.folder / "one-a.csv", is_finished=True)
        for key in ("task", "episode", "goal", "no_drop", "safety", "ratio", "stage", "grip"):
            np.testing.assert_array_equal(getattr(before, key), getattr(after, key))

    def test_runs_that_cannot_be_compared_are_refused(self):
        safe = np.ones((10, 2), bool)
        first, other = load(run(self.folder / "a", safe)), load(run(self.folder / "b", safe, suite="two"))
        with self.assertRaises(UserError):
            difference([first], [other], "safety")
        (run(self.folder / "c", safe) / "summary.json").unlink()
        with self.assertRaises(UserError):
            load(self.folder / "c")


if __name__ == "__main__":
    unittest.main()
