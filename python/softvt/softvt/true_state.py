"""The true state of an episode as a vector of numbers, and the staged reward, which is a function of it."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

STAGES = ("reach", "grasp", "lift", "carry", "place", "release")
"""Stages of an episode, in order (docs/results.md)."""

# Bounds of possible values, not of likely ones: an object may fall, and forces may be those of an impact.
_FAR_M, _MAX_FORCE_N, _MAX_DEFORMATION = 1e3, 1e6, 1e6

STATE_FIELDS: dict[str, tuple[int, float]] = {
    "tool_position": (3, _FAR_M),  # m
    "tool_rotation": (6, 1.001),  # the first two columns of the rotation matrix
    "gripper_width": (1, 1.0),  # m, exact
    "closure": (1, 1.001),  # as commanded, 0 open to 1 closed
    "pad_force": (2, _MAX_FORCE_N),  # of the left and right pad on the object, N
    "object_position": (3, _FAR_M),  # m
    "object_rotation": (6, 1.001),
    "object_from_tool": (3, _FAR_M),  # m
    "target_position": (3, _FAR_M),  # m
    "target_from_object": (3, _FAR_M),  # m
    "deformation": (1, _MAX_DEFORMATION),  # D / τ; 0 for rigid objects and for those without a limit
}
"""Fields of the vector in order: number of elements, and largest magnitude. Positions and rotations are in the robot's base frame."""

STATE_BOUNDS = np.concatenate([np.full(size, bound, dtype=np.float32) for size, bound in STATE_FIELDS.values()])
"""Largest magnitude of each element of the vector."""

_NEAR_M = 0.2
"""Distance that the staged reward counts as half-way, as tanh does, m."""


@dataclass(frozen=True)
class Scene:
    """What is constant in an episode: the goal, and the pose of the robot's base in the world."""

    object: str
    target: str
    base_position: np.ndarray  # (3), m
    base_rotation: np.ndarray  # (3, 3)
    fixed: Mapping[str, Any]  # positions in the world of objects that never move, m

    @classmethod
    def read(cls, scene: Mapping[str, Any]) -> "Scene":
        """The `info["scene"]` of a server. Raises ValueError if its goal gives the object of the task no target."""
        predicates = _predicates(scene["goal"])
        placed = [goal for goal in predicates if goal.get("object") == scene["object"] and "target" in goal]
        if not placed:
            kinds = ", ".join(dict.fromkeys(goal["kind"] for goal in predicates))
            raise ValueError(f"the goal ({kinds}) has no target for {scene['object']!r}")
        position = np.array(scene["base_position_w"], dtype=np.float64)
        rotation, fixed = _matrix_of_quaternion(scene["base_quaternion_w"]), scene["fixed_positions_w"]
        return cls(scene["object"], placed[0]["target"], position, rotation, fixed)


def _predicates(goal: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    """The predicates of a goal, in the order in which they are written."""
    if "goals" in goal:
        return [predicate for part in goal["goals"] for predicate in _predicates(part)]
    return [goal]


@dataclass(frozen=True)
class TrueState:
    """The true state after a control step, in the robot's base frame."""

    vector: np.ndarray
    """Float32, the elements of STATE_FIELDS."""
    reach_m: float
    """Distance from the tool to the origin of the object's frame, m."""
    carry_m: float
    """Horizontal distance from the object to the target, m."""

    @classmethod
    def read(cls, scene: Scene, state: Mapping[str, Any], verdict: Mapping[str, Any]) -> "TrueState":
        """From the `state` and the `verdict` of a server. Raises ValueError if the object or the target cannot move, or is not there."""
        tool, tool_rotation = np.array(state["ee_position_b"]), _matrix_of_axis_angle(state["ee_axis_angle_b"])
        position, rotation, deformation = _object(scene, state, scene.object)
        target, _, _ = _object(scene, state, scene.target)
        tau = verdict["tau"]
        fields = {
            "tool_position": tool,
            "tool_rotation": _two_columns(tool_rotation),
            "gripper_width": [state["gripper_width_m"]],
            "closure": [state["closure"]],
            "pad_force": state["pad_force_n"],
            "object_position": position,
            "object_rotation": _two_columns(rotation),
            "object_from_tool": position - tool,
            "target_position": target,
            "target_from_object": target - position,
            "deformation": [deformation / tau if deformation is not None and tau else 0.0],
        }
        vector = np.concatenate([np.asarray(fields[name], dtype=np.float32) for name in STATE_FIELDS])
        return cls(vector, float(np.linalg.norm(position - tool)), float(np.linalg.norm((target - position)[:2])))


def progress(state: TrueState, verdict: Mapping[str, Any]) -> float:
    """Progress of an episode, 0 to 1.

    The share of completed stages, and the way within reaching and carrying. Of a goal of several parts: the share of parts that were met, and
    the stages of the next object that must be placed.
    """
    if verdict["goal"]:
        return 1.0
    stage = verdict["failed_stage"]
    parts = [part for part in verdict.get("goal_parts", []) if not part.get("negated", False)]
    met = sum(part["met_s"] is not None for part in parts)
    # The way is known for the object of the task alone.
    way = {"reach": state.reach_m, "carry": state.carry_m} if met == 0 else {}
    remaining = way.get(stage, math.inf)
    within = 0.0 if stage is None else (STAGES.index(stage) + 1.0 - math.tanh(remaining / _NEAR_M)) / len(STAGES)
    return within if not parts else (met + within) / (len(parts) + 1)


def _object(scene: Scene, state: Mapping[str, Any], name: str) -> tuple[np.ndarray, np.ndarray, float | None]:
    """Position (m) and rotation in the base frame, and D (%)."""
    if name in scene.fixed:
        return scene.base_rotation.T @ (np.array(scene.fixed[name]) - scene.base_position), scene.base_rotation.T, None
    for entry in state["objects"]:
        if entry["name"] == name:
            position = scene.base_rotation.T @ (np.array(entry["position_w"]) - scene.base_position)
            return position, scene.base_rotation.T @ _matrix_of_quaternion(entry["quaternion_w"]), entry["d_pct"]
    raise ValueError(f"the server does not send the position of {name!r}")


def _two_columns(rotation: np.ndarray) -> np.ndarray:
    return rotation[:, :2].T.reshape(6)


def _matrix_of_quaternion(wxyz: Any) -> np.ndarray:
    w, x, y, z = wxyz
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def _matrix_of_axis_angle(axis_angle: Any) -> np.ndarray:
    vector = np.array(axis_angle, dtype=np.float64)
    angle = float(np.linalg.norm(vector))
    axis = vector / angle if angle > 0 else vector
    return _matrix_of_quaternion([math.cos(angle / 2), *(math.sin(angle / 2) * axis)])
