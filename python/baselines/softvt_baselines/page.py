"""The page of a study: collects its runs, and writes tables and pictures of the collected runs.

In the folder `baselines` beside the page, `runs.csv` lists the runs, `outcomes/` has their episodes, and the other CSV files are the tables. The
page has the rates alone.
"""

import csv
import json
import re
from collections import Counter, defaultdict
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from . import UserError, figure, results
from .figure import Plot
from .results import Estimate, Run
from .study import ORIGIN

# The table of rates stands between these lines of the page.
BEGIN, END = "<!-- tables: softvt-baselines page -->", "<!-- end of tables -->"
LEARNED = re.compile(
    r"(?P<suite>\w+)-(?P<inputs>(?:vo|vp|vt|vpt|vb|vi)2?)-(?P<code>[a-z-]+?)(?:-by-(?P<teacher>[a-z-]+))?-s(?P<seed>\d+)-r(?P<replan>\d+)(?P<condition>\+.*)?"
)
REFERENCES = {
    "expert": "expert (privileged)",
    "tactile-servo": "tactile servo (privileged)",
    "fixed-closure": "fixed closure (privileged)",
    "size-seen": "size seen (privileged)",
}
# The inputs that are compared: what they add to others, touch with the drives, and the markers with the other kinds of touch.
COMPARED = [("vp", "vo"), ("vt", "vo"), ("vt", "vp"), ("vpt", "vp"), ("vb", "vo"), ("vi", "vo"), ("vt", "vb"), ("vt", "vi")]
# The same with two frames, and two frames with one.
COMPARED += [(f"{one}2", f"{other}2") for one, other in COMPARED] + [(f"{one}2", one) for one in ("vo", "vp", "vt", "vpt", "vb", "vi")]
MEASURES = ["goal", "no_drop", "safety"]
# Stages of an episode, in their order.
STAGES = ["reach", "grasp", "lift", "carry", "place", "release"]
# The list of the collected runs, its columns, and the folder of their episodes.
RUNS, RUN_COLUMNS = "runs.csv", ["run", "finished", "softvt", "commit", "machine", "checkpoint_sha256"]
OUTCOMES = "outcomes"
# What the pictures show: suites in the order of their plots, inputs in that of their rows, grip codes, and steps per answer.
SUITES = ["object_hidden", "spatial_hidden", "object_soft", "spatial_soft"]
INPUT_WORDS = {"vo": "cameras", "vp": "with drives", "vt": "with touch", "vpt": "with both"}
INPUTS, CODES, REPLAN = list(INPUT_WORDS), ["binary", "continuous"], 4
# The condition of suites/shifts.lua that changes nothing.
UNCHANGED = "reference"


@dataclass(frozen=True, order=True)
class Policy:
    """What the runs of several training seeds have in common."""

    suite: str
    code: str
    replan: int
    inputs: str  # as in the name of a run: "vo", or "vo2" with two frames
    condition: str = ""
    teacher: str = ""  # "": that of the suite


def collect(study: Path, into: Path) -> None:
    """Copies the outcomes of the finished runs of a study. Raises UserError without any."""
    found = sorted(study.glob("runs/**/summary.json"))
    if not found:
        raise UserError(f"{study}: no finished runs; softvt-baselines study makes them")
    listed = {row["run"]: row for row in _read(into / RUNS)}
    for summary in found:
        if summary.parent.name == "softvtbench":
            continue
        # Runs are in NAME (references), NAME/SUITE, or NAME/SCRIPT/CONDITION.
        name, *inner = summary.parent.relative_to(study / "runs").parts
        name, run, origin = "+".join([name, *inner[1:]]), results.load(summary.parent), {}
        _identify(name, run.suite)
        if (path := summary.with_name(ORIGIN)).is_file():
            version = json.loads(summary.with_name("run.json").read_text())["softvt"]
            origin = {"softvt": version} | json.loads(path.read_text())
        listed[name] = dict.fromkeys(RUN_COLUMNS, "") | origin | {"run": name, "finished": 1}
        results.save(run, into / OUTCOMES / f"{name}.csv")
    _write(into / RUNS, [{key: row[key] for key in RUN_COLUMNS} for _, row in sorted(listed.items())])


def _read(path: Path) -> list[dict]:
    if not path.is_file():
        return []
    with open(path, newline="") as file:
        return list(csv.DictReader(file))


def _write(path: Path, rows: list[dict]) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    with open(path, "w", newline="") as file:
        table = csv.DictWriter(file, list(rows[0]) if rows else [], lineterminator="\n")
        table.writeheader()
        table.writerows(rows)


def _identify(name: str, suite: str) -> Policy | str:
    """The policy of a collected run: a learned one, or the name of a reference. Raises UserError for other runs."""
    if found := LEARNED.fullmatch(name):
        part = found.groupdict()
        return Policy(
            part["suite"], part["code"], int(part["replan"]), part["inputs"], (part["condition"] or "")[1:], part["teacher"] or ""
        )
    if (reference := name.removeprefix(f"{suite}-")) in REFERENCES:
        return reference
    raise UserError(f"{name}: not named as a run of a study")


def _grouped(folder: Path) -> tuple[dict[Policy, list[Run]], dict[tuple[str, str], Run]]:
    """The collected runs of learned policies by policy, and those of the references by suite and name."""
    learned, references = defaultdict(list), {}
    unfinished = {row["run"] for row in _read(folder / RUNS) if row["finished"] != "1"}
    for path in sorted((folder / OUTCOMES).glob("*.csv")):
        run = results.load_collected(path, path.stem not in unfinished)
        policy = _identify(path.stem, run.suite)
        if isinstance(policy, Policy):
            learned[policy].append(run)
        else:
            references[run.suite, policy] = run
    return learned, references


def _percentiles(name: str, values: np.ndarray) -> dict[str, str]:
    """Columns of the 5th, 50th and 95th percentile. Without a limit only invalid episodes have a ratio, which is infinite."""
    names = [f"{name}_p5", f"{name}_median", f"{name}_p95"]
    if not np.isfinite(values).any():
        return dict.fromkeys(names, "")
    return {key: f"{value:.4g}" for key, value in zip(names, np.nanpercentile(values, [5, 50, 95], method="lower"))}


def _interval(name: str, of: Estimate) -> dict[str, str]:
    """Columns of a mean and its 95 % interval."""
    return {name: f"{of.mean:.1f}", f"{name}_low": f"{of.low:.1f}", f"{name}_high": f"{of.high:.1f}"}


def _rates(learned: dict[Policy, list[Run]], references: dict[tuple[str, str], Run]) -> list[dict]:
    """Rows of the policies without a shift, and of the references."""

    def row(suite: str, name: str, replan: int | str, runs: list[Run]) -> dict:
        ratio, grip = (np.concatenate([getattr(run, key) for run in runs]) for key in ("ratio", "grip"))
        grip = grip[np.concatenate([run.goal for run in runs]) == 1]
        columns = {"suite": suite, "policy": name, "replan": replan, "seeds": len(runs), "episodes": len(runs[0].task)}
        columns["finished"] = int(all(run.is_finished for run in runs))
        for measure in MEASURES:
            columns |= _interval(measure, results.rate(runs, measure))
        return columns | _percentiles("d_over_tau", ratio) | _percentiles("grip_ratio", grip)

    rows = []
    for suite in sorted({policy.suite for policy in learned} | {suite for suite, _ in references}):
        of_suite = [policy for policy in sorted(learned) if (policy.suite, policy.condition) == (suite, "")]
        rows += [row(suite, _name(policy), policy.replan, learned[policy]) for policy in of_suite]
        rows += [row(suite, shown, "", [references[suite, name]]) for name, shown in REFERENCES.items() if (suite, name) in references]
    return rows


def _inputs(policy: Policy) -> str:
    """The inputs of a policy in words, and its teacher if it is not that of the suite."""
    return policy.inputs.upper().replace("2", " of two frames") + (f" shown by {policy.teacher}" if policy.teacher else "")


def _name(policy: Policy) -> str:
    return f"{_inputs(policy)}, {policy.code}"


@dataclass
class Pair:
    """Policies of two kinds of inputs, or of two teachers, of the same suite, grip code, replanning and condition, and their runs of the training
    seeds that both have."""

    policy: Policy
    other: Policy
    fewer: list[Run]
    more: list[Run]

    @property
    def columns(self) -> dict:
        """The first columns of its rows."""
        first, second = (_inputs(self.other), _inputs(self.policy))
        policy = self.policy
        return {"suite": policy.suite, "difference": f"{second} − {first}", "code": policy.code, "replan": policy.replan}


def _seeds(runs: list[Run]) -> dict[str, Run]:
    return {LEARNED.fullmatch(run.name)["seed"]: run for run in runs}


def _pairs(learned: dict[Policy, list[Run]]) -> list[Pair]:
    """The pairs of COMPARED, and of a policy of another teacher with that of the suite's, with a common training seed."""
    pairs = []
    for policy, runs in sorted(learned.items()):
        others = [replace(policy, inputs=other) for inputs, other in COMPARED if inputs == policy.inputs]
        others += [replace(policy, teacher="")] if policy.teacher else []
        for other in others:
            fewer, more = _seeds(learned.get(other, [])), _seeds(runs)
            if common := sorted(fewer.keys() & more.keys()):
                pairs.append(Pair(policy, other, [fewer[seed] for seed in common], [more[seed] for seed in common]))
    return pairs


def tables(folder: Path) -> dict[str, list[dict]]:
    """The rows of all tables, by the name of their file."""
    learned, references = _grouped(folder)
    pairs = [pair for pair in _pairs(learned) if pair.policy.condition != UNCHANGED]
    unshifted = [pair for pair in pairs if not pair.policy.condition]
    return {
        "rates": _rates(learned, references),
        "differences": [_difference(pair) for pair in pairs],
        "references": _against_references(learned, references),
        "tasks": [row for pair in unshifted for row in _by_task(pair)],
        "stages": [row for pair in unshifted for row in _by_stage(pair)],
        "shifts": _shifts(learned),
    }


def rates_text(rows: list[dict]) -> str:
    """The table of rates of the page, in Markdown."""
    lines = ["| suite | policy | replan | seeds | episodes | Goal, % | Safety, % | D/τ, median |", "|---|---|---|---|---|---|---|---|"]
    for row in rows:
        episodes = f"{row['episodes']}" + ("" if row["finished"] else " (interrupted)")
        goal, safety = (f"{row[key]} [{row[f'{key}_low']}, {row[f'{key}_high']}]" for key in ("goal", "safety"))
        cells = [f"`{row['suite']}`", row["policy"], row["replan"], row["seeds"], episodes, goal, safety, row["d_over_tau_median"] or "–"]
        lines.append(f"| {' | '.join(map(str, cells))} |")
    return "\n".join(lines) + "\n"


def _in_common(pair: Pair) -> tuple[list[Run], list[Run]]:
    """The runs of a pair with the episodes that all of them have."""
    common = results.in_common(pair.fewer + pair.more)
    return common[: len(pair.fewer)], common[len(pair.fewer) :]


def _difference(pair: Pair) -> dict:
    """The row of a pair in the table of differences. *Both succeed*: Safety of the episodes in which both reach the goal."""
    fewer, more = _in_common(pair)
    row = pair.columns | {"seeds": len(more), "shift": pair.policy.condition or "none", "episodes": len(more[0].task)}
    for measure in MEASURES:
        row |= _interval(measure, results.difference(fewer, more, measure))
    row |= dict.fromkeys(["both_succeed", "safety_there", "safety_there_low", "safety_there_high"], "")
    # With several seeds, success differs from seed to seed.
    if len(more) == 1:
        both = (fewer[0].goal * more[0].goal).astype(bool)
        row["both_succeed"] = int(both.sum())
        if both.any():
            row |= _interval("safety_there", results.difference([fewer[0].where(both)], [more[0].where(both)], "safety"))
    return row


def _against_references(learned: dict[Policy, list[Run]], references: dict[tuple[str, str], Run]) -> list[dict]:
    """Rows of the policies less each reference of their suite, on the episodes that both have."""
    rows = []
    for policy, runs in sorted(learned.items()):
        for name, shown in REFERENCES.items():
            if policy.condition or (policy.suite, name) not in references:
                continue
            reference, *common = results.in_common([references[policy.suite, name], *runs])
            row = {"suite": policy.suite, "difference": f"{_name(policy)} − {shown}", "replan": policy.replan, "seeds": len(runs)}
            row["episodes"] = len(reference.task)
            for measure in ("goal", "safety"):
                row |= _interval(measure, results.difference([reference], common, measure))
            rows.append(row)
    return rows


def _by_task(pair: Pair) -> list[dict]:
    """Safety by task, on the episodes and seeds that both have."""
    fewer, more = _in_common(pair)
    assets = {task: asset for run in fewer + more for task, asset in run.assets.items()}

    def safety(runs: list[Run], task: int) -> str:
        return f"{100 * np.mean([run.safety[run.task == task].mean() for run in runs]):.0f}"

    return [
        pair.columns
        | {"task": task, "asset": assets.get(task, ""), "episodes": (more[0].task == task).sum()}
        | {"safety_of_first": safety(fewer, task), "safety_of_second": safety(more, task)}
        for task in np.unique(more[0].task)
    ]


def _by_stage(pair: Pair) -> list[dict]:
    """Stages in which episodes without success ended, and successes beyond the limit."""
    both = _in_common(pair)
    counts = [Counter(stage for run in runs for stage in run.stage) for runs in both]
    firm = [sum(int(((run.goal == 1) & (run.ratio > 1)).sum()) for run in runs) for runs in both]
    ended = {f"failed at {stage}": [count[stage] for count in counts] for stage in STAGES if any(count[stage] for count in counts)}
    ended["success beyond the limit"] = firm
    return [pair.columns | {"episodes": end, "first": first, "second": second} for end, (first, second) in ended.items()]


def _shifts(learned: dict[Policy, list[Run]]) -> list[dict]:
    """Rows of the policies under conditions, and their change against the same policy without one on the same episodes."""
    rows = []
    for policy, runs in sorted(learned.items()):
        if not policy.condition or policy.condition == UNCHANGED:
            continue
        row = {"suite": policy.suite, "policy": _name(policy), "replan": policy.replan, "seeds": len(runs), "shift": policy.condition}
        for measure in ("goal", "safety"):
            row |= _interval(measure, results.rate(runs, measure))
        row |= dict.fromkeys(["change_of_safety", "change_of_safety_low", "change_of_safety_high"], "")
        unchanged = learned.get(replace(policy, condition=UNCHANGED), [])
        if len(unchanged) == len(runs):
            row |= _interval("change_of_safety", results.difference(unchanged, runs, "safety"))
        rows.append(row)
    return rows


def plots(folder: Path) -> list[Plot]:
    """What the pictures show: the suites and the inputs of the text, at one number of steps per answer. Raises UserError without learned policies.

    A study of other suites has all of its own, without those that have no limit if others have some.
    """
    learned, references = _grouped(folder)
    runs = {policy.suite: runs for policy, runs in learned.items() if not policy.condition}
    if not runs:
        raise UserError(f"{folder}: no runs of learned policies")
    limited = sorted(suite for suite in runs if np.isfinite(runs[suite][0].ratio).any()) or sorted(runs)
    shown = []
    for suite in [suite for suite in SUITES if suite in limited] or limited:
        policies = [policy for policy in learned if (policy.suite, policy.condition) == (suite, "") and policy.inputs in INPUTS]
        policies = [policy for policy in policies if policy.code in CODES] or policies
        replan = min((policy.replan for policy in policies), key=lambda replan: (abs(replan - REPLAN), replan), default=REPLAN)
        policies = sorted(
            (policy for policy in policies if policy.replan == replan),
            key=lambda policy: (INPUTS.index(policy.inputs), policy.code, policy.teacher),
        )
        has_codes = len({policy.code for policy in policies}) > 1
        own = {_row_name(policy, has_codes): learned[policy] for policy in policies}
        others = {name.replace("-", " "): [references[suite, name]] for name in REFERENCES if (suite, name) in references}
        shown.append(Plot(suite, own, others))
    return shown


def _row_name(policy: Policy, has_codes: bool) -> str:
    """What a row is called in a plot of several grip codes, or of one. An asterisk marks another teacher than that of the suite."""
    name = f"{policy.inputs.upper()} {policy.code}" if has_codes else f"{policy.inputs.upper()}: {INPUT_WORDS[policy.inputs]}"
    return name + "*" * bool(policy.teacher)


def write(studies: list[Path], docs: Path) -> None:
    """Collects studies into DOCS/baselines, and writes the tables there, the rates into DOCS/baselines.md, and the pictures beside the others.

    Raises UserError if the page has no place for the tables.
    """
    page, folder = docs / "baselines.md", docs / "baselines"
    text = page.read_text() if page.is_file() else f"{BEGIN}\n{END}\n"
    if not (text.count(BEGIN) == text.count(END) == 1 and text.index(BEGIN) < text.index(END)):
        raise UserError(f"{page}: expected the lines {BEGIN} and {END} once each, around the tables")
    for study in studies:
        collect(study, folder)
    found = tables(folder)
    for name, rows in found.items():
        _write(folder / f"{name}.csv", rows)
    images, shown = docs / "images", plots(folder)
    images.mkdir(parents=True, exist_ok=True)
    (images / "baselines.svg").write_text(figure.rates(shown))
    (images / "baselines_d.svg").write_text(figure.distributions(shown))
    before, after = text.split(BEGIN)[0], text.split(END)[1]
    page.write_text(f"{before}{BEGIN}\n\n{rates_text(found['rates'])}\n{END}{after}")
