"""Results of runs of softvt: rates per policy, and paired differences between policies."""

import csv
import json
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from . import UserError

# Columns of the file of a collected run.
COLUMNS = ["task", "asset", "episode", "goal", "no_drop", "safety", "ratio", "stage", "grip"]
# Resamples of a bootstrap, and its seed.
RESAMPLES, SEED = 10_000, 0


@dataclass
class Run:
    """Outcomes of the episodes of a run, in the order of tasks and episodes."""

    name: str
    suite: str
    task: np.ndarray  # (N,)
    episode: np.ndarray  # (N,)
    goal: np.ndarray  # (N,) 1 if the goal was reached
    no_drop: np.ndarray  # (N,) 1 if nothing was dropped
    safety: np.ndarray  # (N,) 1 if also safely
    ratio: np.ndarray  # (N,) peak D over the limit; infinite if the episode is invalid, NaN if there is no limit
    grip: np.ndarray  # (N,) peak force over the least one that holds; NaN if it is unknown
    stage: list[str]  # stage in which the episode failed, or ""
    assets: dict[int, str]  # asset of the target in the first episode of each task
    is_finished: bool = True

    def where(self, chosen: np.ndarray) -> "Run":
        """The chosen episodes."""
        columns = {key: getattr(self, key)[chosen] for key in ("task", "episode", "goal", "no_drop", "safety", "ratio", "grip")}
        return replace(self, **columns, stage=[stage for stage, is_chosen in zip(self.stage, chosen) if is_chosen])


def _ratio(row: dict) -> float:
    if row["outcome"]["kind"] == "invalid":
        return np.inf
    return row["d_peak"] / row["tau"] if row.get("tau") and row.get("d_peak") is not None else np.nan


def load(folder: Path) -> Run:
    """Reads a run folder of softvt. Raises UserError if it is not finished."""
    if not (folder / "summary.json").is_file():
        raise UserError(f"{folder}: not a finished run: it has no summary.json; repeat its command with --resume")
    rows = [json.loads(line) for line in (folder / "episodes.jsonl").read_text().splitlines()]
    rows = [row | {"ratio": _ratio(row), "stage": row.get("failed_stage") or "", "grip": row.get("grip_ratio")} for row in rows]
    rows.sort(key=lambda row: (row["task"], row["episode"]))
    return _run(folder.name, json.loads((folder / "summary.json").read_text())["suite"], rows)


def load_collected(path: Path, is_finished: bool) -> Run:
    """Reads the outcomes that `save` wrote. The name of a run begins with that of its suite."""
    with open(path, newline="") as file:
        return replace(_run(path.stem, path.stem.split("-")[0], list(csv.DictReader(file))), is_finished=is_finished)


def _run(name: str, suite: str, rows: list[dict]) -> Run:
    def column(key: str, kind: type) -> np.ndarray:
        return np.array([kind(row[key]) for row in rows])

    return Run(
        name=name,
        suite=suite,
        assets={int(row["task"]): row["asset"] for row in reversed(rows)},
        task=column("task", int),
        episode=column("episode", int),
        ratio=column("ratio", float),
        grip=np.array([float(row.get("grip") or "nan") for row in rows]),
        stage=[row["stage"] for row in rows],
        **{key: column(key, int).astype(float) for key in ("goal", "no_drop", "safety")},
    )


def save(run: Run, path: Path) -> None:
    """Writes the outcomes of a run.

    Ratios are written as they are: one just above 1 is not safe. Files of before have four digits, and 1 may stand for 1.00003 there.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    with open(path, "w", newline="") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow(COLUMNS)
        for row in zip(run.task, run.episode, run.goal, run.no_drop, run.safety, run.ratio, run.stage, run.grip):
            task, episode, *outcomes = map(int, row[:5])
            table.writerow([task, run.assets[task], episode, *outcomes, repr(float(row[5])), row[6], f"{row[7]:.4g}"])


@dataclass
class Estimate:
    """A mean with its 95 % interval, in percent or percentage points."""

    mean: float
    low: float
    high: float

    def text(self, signed: bool = False) -> str:
        sign = "+" if signed else ""
        return f"{self.mean:{sign}.1f} [{self.low:{sign}.1f}, {self.high:{sign}.1f}]"


def _bootstrap(sets: list[list[Run]], measure: str) -> tuple[float, np.ndarray]:
    """The mean of a measure over the episodes and the training seeds of the last of one or two sets of runs, less that of the first of two; and
    the same of resamples (RESAMPLES,) that redraw the episodes of each task and, of several, the seeds of each set."""
    random, task = np.random.default_rng(SEED), sets[0][0].task
    values = [np.array([getattr(run, measure) for run in runs]) for runs in sets]  # (seeds, episodes) each
    sums = [np.zeros((RESAMPLES, len(one))) for one in values]
    for kind in np.unique(task):
        own = np.flatnonzero(task == kind)
        drawn = own[random.integers(len(own), size=(RESAMPLES, len(own)))]
        for one, total in zip(values, sums):
            for seed, outcomes in enumerate(one):
                total[:, seed] += outcomes[drawn].sum(axis=1)
    counts = [random.multinomial(n, [1 / n] * n, RESAMPLES) if (n := len(one)) > 1 else np.ones((RESAMPLES, 1)) for one in values]
    means = [(total * count).sum(axis=1) / (len(task) * len(one)) for one, total, count in zip(values, sums, counts)]
    mean = values[-1].mean() - (values[0].mean() if len(sets) > 1 else 0)
    return float(mean), means[-1] - (means[0] if len(sets) > 1 else 0)


def _estimate(sets: list[list[Run]], measure: str) -> Estimate:
    mean, resampled = _bootstrap(sets, measure)
    low, high = np.percentile(resampled, [2.5, 97.5])
    return Estimate(100 * mean, 100 * low, 100 * high)


def _same_episodes(runs: list[Run]) -> None:
    first = runs[0]
    for run in runs[1:]:
        if not (np.array_equal(run.task, first.task) and np.array_equal(run.episode, first.episode) and run.suite == first.suite):
            raise UserError(f"{run.name} and {first.name} were not evaluated on the same episodes")


def in_common(runs: list[Run]) -> list[Run]:
    """The same runs with the episodes that all of them have."""
    keys = [list(zip(run.task.tolist(), run.episode.tolist())) for run in runs]
    common = set.intersection(*map(set, keys))
    return [run.where(np.array([key in common for key in own], dtype=bool)) for run, own in zip(runs, keys)]


def rate(runs: list[Run], measure: str) -> Estimate:
    """The rate of `goal`, `no_drop` or `safety` over the runs of a policy with several training seeds."""
    _same_episodes(runs)
    return _estimate([runs], measure)


def difference(first: list[Run], second: list[Run], measure: str) -> Estimate:
    """The rate of the second policy minus that of the first on the same episodes, each averaged over its training seeds."""
    _same_episodes(first + second)
    return _estimate([first, second], measure)
