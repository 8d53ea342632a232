"""The page of a study: collects its runs, and writes tables and pictures of those that were collected."""

import json
import re
import shutil
from collections import Counter, defaultdict
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from . import UserError, figure, results
from .figure import Plot
from .results import Run
from .study import ORIGIN

# The tables stand between these lines of the page.
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
# Ratios from which on tables do not show them.
MOST = 99
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
    """Copies the summaries and outcomes of the finished runs of a study. Raises UserError without any."""
    found = sorted(study.glob("runs/**/summary.json"))
    if not found:
        raise UserError(f"{study}: no finished runs; softvt-baselines study makes them")
    for summary in found:
        if summary.parent.name == "softvtbench":
            continue
        # Runs are in NAME (references), NAME/SUITE, or NAME/SCRIPT/CONDITION.
        name, *inner = summary.parent.relative_to(study / "runs").parts
        folder, run = into / "+".join([name, *inner[1:]]), results.load(summary.parent)
        _identify(folder, run.suite)
        folder.mkdir(parents=True, exist_ok=True)
        shutil.copy(summary, folder)
        if (origin := summary.with_name(ORIGIN)).is_file():
            version = json.loads(summary.with_name("run.json").read_text())["softvt"]
            (folder / ORIGIN).write_text(json.dumps({"softvt": version} | json.loads(origin.read_text()), indent=1) + "\n")
        results.save(run, folder)


def _identify(folder: Path, suite: str) -> Policy | str:
    """The policy of a collected run: a learned one, or the name of a reference. Raises UserError for other runs."""
    if found := LEARNED.fullmatch(folder.name):
        part = found.groupdict()
        return Policy(
            part["suite"], part["code"], int(part["replan"]), part["inputs"], (part["condition"] or "")[1:], part["teacher"] or ""
        )
    if (reference := folder.name.removeprefix(f"{suite}-")) in REFERENCES:
        return reference
    raise UserError(f"{folder}: not named as a run of a study")


def _grouped(folder: Path) -> tuple[dict[Policy, list[Run]], dict[tuple[str, str], Run]]:
    """The collected runs of learned policies by policy, and those of the references by suite and name."""
    learned, references = defaultdict(list), {}
    for path in sorted(folder.glob(f"*/{results.OUTCOMES}")):
        run = results.load(path.parent)
        policy = _identify(path.parent, run.suite)
        if isinstance(policy, Policy):
            learned[policy].append(run)
        else:
            references[run.suite, policy] = run
    return learned, references


def _table(heading: list[str], rows: list[list[str]]) -> str:
    lines = [heading, ["---"] * len(heading), *rows]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines) + "\n"


def _spread(values: np.ndarray) -> str:
    """Median, and the 5th and 95th percentile. Where nothing has a limit, only invalid episodes have a ratio, which is infinite."""
    if not np.isfinite(values).any():
        return "–"
    percentiles = np.nanpercentile(np.minimum(values, MOST), [5, 50, 95])
    low, median, high = (f"{value:.2f}" if value < MOST else f"> {MOST}" for value in percentiles)
    return f"{median} [{low}, {high}]"


def _row(name: str, runs: list[Run], replan: str) -> list[str]:
    ratio, grip = (np.concatenate([getattr(run, key) for run in runs]) for key in ("ratio", "grip"))
    grip = grip[np.concatenate([run.goal for run in runs]) == 1]
    rates = [results.rate(runs, measure).text() for measure in MEASURES]
    episodes = str(len(runs[0].task)) + ("" if all(run.is_finished for run in runs) else " (interrupted)")
    return [name, replan, str(len(runs)), episodes, *rates, _spread(ratio), _spread(grip)]


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
    def names(self) -> tuple[str, str]:
        return _inputs(self.other), _inputs(self.policy)

    @property
    def difference(self) -> str:
        return f"{self.names[1]} − {self.names[0]}"


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


def tables(folder: Path) -> str:
    """All tables, in Markdown."""
    learned, references = _grouped(folder)
    text = "Rates are means over the training seeds; intervals (95 %, bootstrap) are over the episodes and, of several, the seeds.\n\n"
    for suite in sorted({policy.suite for policy in learned} | {suite for suite, _ in references}):
        text += f"### `{suite}`\n\n"
        rows = [
            _row(_name(policy), runs, str(policy.replan))
            for policy, runs in sorted(learned.items())
            if (policy.suite, policy.condition) == (suite, "")
        ]
        rows += [_row(shown, [references[suite, name]], "") for name, shown in REFERENCES.items() if (suite, name) in references]
        text += _table(["policy", "replan", "seeds", "episodes", "Goal, %", "NoDrop, %", "Safety, %", "D/τ", "grip ratio"], rows)
        text += _origin(folder, suite)
    pairs = [pair for pair in _pairs(learned) if pair.policy.condition != UNCHANGED]
    if pairs:
        text += (
            "### Differences, on the episodes and the training seeds that both have\n\n*Both succeed*: Safety of the episodes in which both reach "
            "the goal.\n\n"
        )
        measures = [f"{measure}, points" for measure in ("Goal", "NoDrop", "Safety")]
        heading = [
            "suite",
            "inputs",
            "grip code",
            "replan",
            "seeds",
            "shift",
            "episodes",
            *measures,
            "both succeed",
            "Safety there, points",
        ]
        text += _table(heading, [_difference(pair) for pair in pairs])
    if compared := _against_references(learned, references):
        text += "### Differences from reference controllers, on the episodes that both have\n\n"
        text += _table(["suite", "difference", "replan", "seeds", "episodes", "Goal, points", "Safety, points"], compared)
    for pair in pairs:
        policy = pair.policy
        if not policy.condition:
            text += f"### `{policy.suite}`, {pair.difference}, {policy.code}, replan {policy.replan}: by task and by stage\n\n"
            text += "Safety by task, and the stages in which episodes without success ended, on the same episodes and seeds.\n\n"
            text += _by_task(pair) + _by_stage(pair)
    if shifted := _shifts(learned):
        text += "### Shifts\n\nThe change is that against the same policy without a shift, on the same episodes.\n\n"
        text += _table(["suite", "policy", "replan", "seeds", "shift", "Goal, %", "Safety, %", "change of Safety, points"], shifted)
    return text


def _origin(folder: Path, suite: str) -> str:
    """Where the runs of a suite come from, as far as they say it."""
    places, weights = set(), []
    for path in sorted(folder.glob(f"{suite}-*/{ORIGIN}")):
        origin = json.loads(path.read_text())
        places.add(f"softvt {origin['softvt']} at {origin['commit'] or 'an unknown commit'} on {origin['machine']}")
        if digest := origin.get("checkpoint_sha256"):
            weights.append(f"`{path.parent.name}` {digest[:16]}")
    if not places:
        return "The runs do not say which version of softvt made them; it was one before 0.2.0.\n\n"
    return f"Made by {'; '.join(sorted(places))}. Checkpoints (SHA-256): {', '.join(weights)}.\n\n"


def _in_common(pair: Pair) -> tuple[list[Run], list[Run]]:
    """The runs of a pair with the episodes that all of them have."""
    common = results.in_common(pair.fewer + pair.more)
    return common[: len(pair.fewer)], common[len(pair.fewer) :]


def _difference(pair: Pair) -> list[str]:
    """The row of a pair in the table of differences."""
    policy, (fewer, more) = pair.policy, _in_common(pair)
    shown = [results.difference(fewer, more, measure).text(signed=True) for measure in MEASURES]
    succeed, there = "–", "–"
    # With several seeds, success differs from seed to seed.
    if len(more) == 1:
        both = (fewer[0].goal * more[0].goal).astype(bool)
        succeed = str(both.sum())
        there = results.difference([fewer[0].where(both)], [more[0].where(both)], "safety").text(signed=True) if both.any() else "–"
    names = [f"`{policy.suite}`", pair.difference, policy.code, str(policy.replan), str(len(more)), policy.condition or "none"]
    return [*names, str(len(more[0].task)), *shown, succeed, there]


def _against_references(learned: dict[Policy, list[Run]], references: dict[tuple[str, str], Run]) -> list[list[str]]:
    """Rows of the policies less each reference of their suite."""
    rows = []
    for policy, runs in sorted(learned.items()):
        for name, shown in REFERENCES.items():
            if policy.condition or (policy.suite, name) not in references:
                continue
            reference, *common = results.in_common([references[policy.suite, name], *runs])
            found = [results.difference([reference], common, measure).text(signed=True) for measure in ("goal", "safety")]
            difference = f"{_name(policy)} − {shown}"
            rows.append([f"`{policy.suite}`", difference, str(policy.replan), str(len(runs)), str(len(reference.task)), *found])
    return rows


def _by_task(pair: Pair) -> str:
    fewer, more = _in_common(pair)
    assets = {task: asset for run in fewer + more for task, asset in run.assets.items()}

    def safety(runs: list[Run], task: int) -> str:
        return f"{100 * np.mean([run.safety[run.task == task].mean() for run in runs]):.0f}"

    rows = [
        [
            str(task),
            assets.get(task, "–"),
            str((more[0].task == task).sum()),
            safety(fewer, task),
            safety(more, task),
        ]
        for task in np.unique(more[0].task)
    ]
    return _table(["task", "asset", "episodes", *(f"Safety of {name}, %" for name in pair.names)], rows)


def _by_stage(pair: Pair) -> str:
    both = _in_common(pair)
    counts = [Counter(stage for run in runs for stage in run.stage) for runs in both]
    firm = [sum(int(((run.goal == 1) & (run.ratio > 1)).sum()) for run in runs) for runs in both]
    rows = [[f"failed at *{stage}*", *(str(count[stage]) for count in counts)] for stage in STAGES if any(count[stage] for count in counts)]
    rows.append(["success beyond the limit", *map(str, firm)])
    return _table(["episodes", *pair.names], rows)


def _shifts(learned: dict[Policy, list[Run]]) -> list[list[str]]:
    """Rows of the policies under conditions."""
    rows = []
    for policy, runs in sorted(learned.items()):
        if not policy.condition or policy.condition == UNCHANGED:
            continue
        unchanged = learned.get(replace(policy, condition=UNCHANGED), [])
        change = results.difference(unchanged, runs, "safety").text(signed=True) if len(unchanged) == len(runs) else "–"
        rates = [results.rate(runs, measure).text() for measure in ("goal", "safety")]
        rows.append([f"`{policy.suite}`", _name(policy), str(policy.replan), str(len(runs)), policy.condition, *rates, change])
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
    """Collects studies into DOCS/baselines, and writes the tables into DOCS/baselines.md and the pictures beside the others.

    Raises UserError if the page has no place for the tables.
    """
    page, folder = docs / "baselines.md", docs / "baselines"
    text = page.read_text() if page.is_file() else f"{BEGIN}\n{END}\n"
    if not (text.count(BEGIN) == text.count(END) == 1 and text.index(BEGIN) < text.index(END)):
        raise UserError(f"{page}: expected the lines {BEGIN} and {END} once each, around the tables")
    for study in studies:
        collect(study, folder)
    found = tables(folder)
    images, shown = docs / "images", plots(folder)
    images.mkdir(parents=True, exist_ok=True)
    (images / "baselines.svg").write_text(figure.rates(shown))
    (images / "baselines_d.svg").write_text(figure.distributions(shown))
    before, after = text.split(BEGIN)[0], text.split(END)[1]
    page.write_text(f"{before}{BEGIN}\n\n{found}{END}{after}")
