"""Where the episodes of a run fail: how the hand meets the object, how firmly it holds it, and what ends the episode.

Reads a run of softvt that was made with `--trace`.
"""

import json
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from . import UserError
from .demonstrate import ROUND, SQUARE
from .numbers import turns

# Distance across the motion of the fingers within which a grasp counts as one in the middle, m.
MIDDLE = 0.003
# Force on a pad from which on it touches, N.
TOUCHES = 0.01
# Position of the robot's base in the Object suites, on the floor, and in the Spatial ones, on the table, m: traces have poses of the tool in its
# frame, those of objects in the world.
BASE, TABLE_BASE = np.array([-0.6, 0.0]), np.array([-0.66, 0.0])


@dataclass
class Meeting:
    """The first control step in which a pad touches the object."""

    step: int
    along: float  # distance of the tool from the middle of the object along the motion of the fingers, m
    across: float  # and across it, horizontally
    turned: float  # of the fingers against the sides of the object, rad; 0 for a round one
    closing: float  # change of the closure in that step

    @property
    def beside(self) -> float:
        """Horizontal distance from the middle, m."""
        return float(np.hypot(self.along, self.across))


def _yaw(quaternion: list[float]) -> float:
    w, x, y, z = quaternion
    return float(np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)))


def _target(objects: list[dict], asset: str, prompt: str) -> tuple[dict, np.ndarray]:
    """The object that is to be grasped, and where the robot stands: objects are named after their assets, or, of two of a kind, by a word of
    the prompt."""
    named = {thing["name"]: thing for thing in objects}
    if asset in named:
        return named[asset], BASE
    return next(named[word] for word in prompt.split() if word in named), TABLE_BASE


def meeting(trace: list[dict], asset: str, prompt: str = "") -> Meeting | None:
    """How the hand meets the object; None if it never does."""
    touching = [k for k, step in enumerate(trace) if max(step["pad_force_n"]) > TOUCHES]
    if not touching:
        return None
    k = touching[0]
    before = trace[max(k - 1, 0)]  # the object is still where it was
    thing, base = _target(before["objects"], asset, prompt)
    beside = np.array(before["ee_position_b"][:2]) + base - thing["position_w"][:2]
    fingers = turns(np.array(before["ee_axis_angle_b"]))[:2, 1]
    turned = np.arctan2(fingers[1], fingers[0]) - np.pi / 2 - _yaw(thing["quaternion_w"])
    period = np.pi / 2 if asset in SQUARE else np.pi
    turned = 0.0 if asset in ROUND else (turned + period / 2) % period - period / 2
    along, across = float(beside @ fingers), float(beside @ [-fingers[1], fingers[0]])
    return Meeting(k, along, across, float(turned), trace[k]["closure"] - before["closure"])


def _quantiles(values: list[float], scale: float = 1) -> str:
    known = [scale * value for value in values if value is not None]
    return " / ".join(f"{number:.3g}" for number in np.percentile(known, [10, 50, 90])) if known else "–"


def _fate(row: dict) -> str:
    if row["safety"]:
        return "safe"
    if not row["goal"]:
        return f"failed at {row['failed_stage']}"
    if not row["deformation_ok"]:
        return "too firm"
    return "dropped" if not row["no_drop"] else "slipped"


def _safe(rows: list[dict], meetings: list[Meeting | None], is_middle: bool) -> str:
    """How many are safe of the episodes whose grasp is in the middle, or of the others."""
    chosen = [row for row, one in zip(rows, meetings) if one and (abs(one.across) <= MIDDLE) == is_middle]
    return f"{sum(row['safety'] for row in chosen)} of {len(chosen)}"


def diagnose(run: Path) -> str:
    """A summary in words. Raises UserError without a trace."""
    rows = [json.loads(line) for line in (run / "episodes.jsonl").read_text().splitlines()]
    lines, meetings = [], []
    for row in rows:
        path = run / "trace" / f"task_{row['task']:03}" / f"episode_{row['episode']:05}.jsonl"
        if not path.is_file():
            raise UserError(f"{path} is missing: run softvt with --trace")
        trace = [json.loads(line) for line in path.read_text().splitlines()]
        meetings.append(meeting(trace, row["asset"], row.get("prompt", "")))
    for task in [None, *sorted({row["task"] for row in rows})]:
        chosen = [k for k, row in enumerate(rows) if task is None or row["task"] == task]
        own, all_met = [rows[k] for k in chosen], [meetings[k] for k in chosen]
        met = [one for one in all_met if one]
        fates = Counter(_fate(row) for row in own)
        held = [row for row in own if row["goal"]]
        parts = [
            f"{'all' if task is None else own[0]['asset']}: n {len(own)}",
            ", ".join(f"{name} {count}" for name, count in fates.most_common()),
            f"beside {_quantiles([one.beside for one in met], 1e3)} mm",
            f"safe of those within {1e3 * MIDDLE:g} mm across the fingers {_safe(own, all_met, True)}, of the others {_safe(own, all_met, False)}",
            f"turned {_quantiles([abs(one.turned) for one in met], 57.3)}°",
            f"closing {_quantiles([one.closing for one in met], 80)} mm per step, in step {_quantiles([one.step for one in met])}",
            f"grip ratio {_quantiles([row['grip_ratio'] for row in held])}",
            f"D/τ {_quantiles([row['d_peak'] / row['tau'] for row in held if row['tau']])}",
            f"slip {_quantiles([row['slip_mm'] for row in held])} mm",
            f"steps {_quantiles([row['steps'] for row in own])}",
        ]
        lines.append("; ".join(parts))
    return "\n".join(lines)
