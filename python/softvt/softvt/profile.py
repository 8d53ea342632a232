"""Profiles of `softvt serve` for the arguments of an environment: which observations it sends, and what its actions mean."""

import re
from collections.abc import Sequence
from dataclasses import dataclass

from .arguments import require_one_of, whole_number

PARTS = ("state", "proprio", "pixels", "depth", "segmentation", "tactile", "tactile_image", "marker_motion", "prompt")
"""Parts of an observation, by their names in the argument `obs`."""

CAMERA_PARTS = ("pixels", "depth", "segmentation")
"""Parts with an entry for each camera."""

PARTS_OF_ONE_STEP = ("prompt", "tactile_image")
"""Parts that the argument `history` does not change."""

CONTROLS = ("delta", "delta_osc", "pose", "joints")
"""Values of the argument `control`."""

_POSE = {"position": 3, "axis_angle": 3}
_JOINTS = {"joints": 7}

GRIPPERS = ("continuous", "binary", "two-width", "force")
"""Grip codes (docs/policies.md)."""

MAX_HISTORY = 32
"""Most control steps of an observation."""


@dataclass(frozen=True)
class ProfileSpec:
    """Arguments of an environment that its server's profile depends on."""

    parts: tuple[str, ...]
    control: str
    gripper: str = "continuous"
    cameras: tuple[str, ...] = ("third_person", "wrist")
    history: int = 1

    def __post_init__(self) -> None:
        """Checks the values. Raises ValueError."""
        if not self.parts:
            raise ValueError(f"obs: no part of an observation; give some of {', '.join(PARTS)}")
        for part in self.parts:
            require_one_of("obs", part, PARTS)
        require_one_of("control", self.control, CONTROLS)
        require_one_of("gripper", self.gripper, GRIPPERS)
        whole_number("history", self.history, 1, MAX_HISTORY)
        uses_cameras = any(part in CAMERA_PARTS for part in self.parts)
        if uses_cameras and not self.cameras:
            raise ValueError(f"cameras={self.cameras!r}: no camera for obs={'+'.join(self.parts)!r}; name one, or leave cameras out")
        if len({*self.cameras}) < len(self.cameras):
            raise ValueError(f"cameras={self.cameras!r}: a camera is named twice")

    def to_lua(self) -> str:
        """The profile as a Lua file. Its entries have the keys of observations with `layout="flat"`."""
        frames = "" if self.history == 1 else f", frames = {self.history}"
        inputs = []
        for part in self.parts:
            for key, source in self._sources(part):
                inputs.append(f"    {{ keys = {{ {_quoted(key)} }}, {source}{'' if part in PARTS_OF_ONE_STEP else frames} }},")
        if not inputs:
            # A profile has at least one entry. The true state is not one of them: it comes with each answer.
            inputs.append(f"    {{ keys = {{ 'proprio' }}, {self._proprio()} }},")
        return "\n".join(
            ["return softvt.profile {", '  name = "python",', "  inputs = {", *inputs, "  },", f"  {self._actions()},", "}", ""]
        )

    def _sources(self, part: str) -> list[tuple[str, str]]:
        """Keys and sources of the entries of a part."""
        match part:
            case "pixels":
                return [(camera, f'source = "camera", camera = {_quoted(camera)}') for camera in self.cameras]
            case "depth" | "segmentation":
                return [(f"{camera}_{part}", f'source = "{part}", camera = {_quoted(camera)}') for camera in self.cameras]
            case "tactile":
                return [(f"tactile_{finger}", f'source = "tactile", finger = "{finger}"') for finger in ("left", "right")]
            case "tactile_image" | "prompt":
                return [(part, f'source = "{part}"')]
            case "marker_motion":
                return [("tactile_marker_motion", 'source = "marker_motion"')]
            case "proprio":
                return [(part, self._proprio())]
        return []

    def _proprio(self) -> str:
        parts = ", ".join(_quoted(part) for part in proprio_parts(self.control))
        return f'source = "state", parts = {{ {parts} }}'

    def _actions(self) -> str:
        match self.control:
            case "pose":
                pose, ends = 'pose = "absolute"', "open = 0, closed = 1"
            case "joints":
                pose, ends = 'pose = "joints"', "open = 0, closed = 1"
            case "delta":
                pose, ends = 'pose = "delta", translation_m = 0.02, rotation_rad = 0.2', "open = -1, closed = 1"
            case _:
                pose, ends = 'pose = "delta_osc", translation_m = 0.05, rotation_rad = 0.5', "open = -1, closed = 1"
        ends = "" if self.gripper == "force" else f"{ends}, "
        return f'actions = {{ {pose}, gripper = {{ {ends}code = "{self.gripper}" }} }}'


def proprio_parts(control: str) -> dict[str, int]:
    """Parts of the entry `proprio` with their lengths. Tool position (m) and axis-angle (rad) in the base frame, or with control="joints" the
    positions of the arm's joints (rad); then half of the width that the sensor of a real hand measures (m). They are the `state` of the profiles
    `visuo_tactile` and `visuo_tactile_joints`."""
    return {**(_JOINTS if control == "joints" else _POSE), "sensed_finger_position": 1}


def action_size(control: str) -> int:
    """Numbers of an action: of the arm, and one of the gripper."""
    return 8 if control == "joints" else 7


def parse_parts(obs: str | Sequence[str]) -> tuple[str, ...]:
    """Parts of an observation from a list, or from text such as "pixels+proprio". Raises ValueError for an unknown one."""
    if not isinstance(obs, str | Sequence):
        raise ValueError(f"obs={obs!r}: expected text such as 'pixels+proprio', or a list of parts")
    parts = tuple(obs.split("+")) if isinstance(obs, str) else tuple(obs)
    if isinstance(obs, str) and (words := re.findall(r"[^\s,+]+", obs)) and {*parts} != {*words} <= {*PARTS}:
        raise ValueError(f"obs={obs!r}: parts are joined by +; write obs={'+'.join(words)!r}")
    for part in parts:
        require_one_of("obs", part, PARTS)
    return tuple(dict.fromkeys(parts))


def _quoted(text: str) -> str:
    """A string of Lua."""
    escaped = text.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n")
    return f'"{escaped}"'
