"""What a policy sees: the shape of its inputs, and how observations of softvt become them."""

import json
from dataclasses import asdict, dataclass

import numpy as np

from . import UserError, prompts
from .data import CAMERAS, MARKERS, TACTILE, Statistics, is_relative, shrink
from .numbers import fold, reference

USE_PROFILE = "use the profile that train wrote next to the checkpoint"


@dataclass
class Shape:
    """Inputs and size of a network."""

    has_touch: bool  # the markers of both fingers
    code: str = "continuous"  # grip code of its answers
    head: str = "regression"  # or "flow"
    frames: int = 1  # control steps whose pictures and states are seen
    edge: int = 128  # pixels of a picture
    chunk: int = 50  # actions of an answer
    width: int = 384
    layers: int = 4  # of the encoder and of the decoder
    action: int = 7
    marker_steps: tuple[int, ...] = (4, 0)  # steps before the present one whose markers are seen
    has_tactile_pictures: bool = False  # besides the markers
    has_drives: bool = False  # the exact finger position and the commanded closure, whose gap is the grip force

    def to_dict(self) -> dict:
        return asdict(self)

    @property
    def pictures(self) -> list[str]:
        """Keys of the pictures."""
        return [*CAMERAS, *TACTILE] if self.has_tactile_pictures else [*CAMERAS]

    @property
    def state(self) -> int:
        """Numbers of a state."""
        return 8 if self.has_drives else 7

    @property
    def is_relative(self) -> bool:
        """True if the closure of an answer is relative to the commanded one."""
        return is_relative(self.code, self.has_drives)

    def profile(self, name: str) -> str:
        """The profile of softvt with these inputs, in Lua."""
        history = f", frames = {self.frames}" if self.frames > 1 else ""
        hand = ["finger_position", "closure"] if self.has_drives else ["sensed_finger_position"]
        parts = ["position", "axis_angle", *hand]
        inputs = {
            "image": 'source = "camera", camera = "third_person"' + history,
            "wrist_image": 'source = "camera", camera = "wrist"' + history,
            "left_tactile_image": 'source = "tactile", finger = "left"' + history,
            "right_tactile_image": 'source = "tactile", finger = "right"' + history,
            "state": f'source = "state", parts = {{ {", ".join(map(json.dumps, parts))} }}' + history,
            "prompt": 'source = "prompt"',
            "softvt": 'source = "query"',
            "tactile_marker_motion": f'source = "marker_motion", frames = {self.marker_rows - 1}',
        }
        lines = "".join(f'    {{ keys = {{ "{key}" }}, {inputs[key]} }},\n' for key in self.keys)
        ends = "" if self.code == "force" else "open = 0, closed = 1, "
        actions = f'{{ pose = "absolute", gripper = {{ {ends}code = "{self.code}" }} }}'
        return f"return softvt.profile {{\n  name = {json.dumps(name, ensure_ascii=False)},\n  inputs = {{\n{lines}  }},\n  actions = {actions},\n}}\n"

    @property
    def marker_rows(self) -> int:
        """Length of tactile_marker_motion (rows, 198, 2): the initial positions of the markers, and those of the last steps."""
        return max(self.marker_steps) + 2

    @property
    def keys(self) -> list[str]:
        """Keys of an observation."""
        return [*self.pictures, "state", "prompt", "softvt"] + ["tactile_marker_motion"] * self.has_touch


def read(obs: dict, shape: Shape, statistics: Statistics, vocabulary: prompts.Vocabulary) -> dict[str, np.ndarray]:
    """The inputs of a network for an observation, the noise for a flow, and what its answer is relative to, each with a first
    axis of length 1.

    Raises UserError if an entry is missing or has another shape, or the prompt was not trained.
    """
    if missing := [key for key in shape.keys if key not in obs]:
        raise UserError(f"the observation has no {', '.join(missing)}; {USE_PROFILE}")
    if missing := [key for key in ("seed", "step") if key not in obs["softvt"]]:
        raise UserError(f"softvt in the observation has no {', '.join(missing)}; {USE_PROFILE}")
    if problem := vocabulary.problem(str(obs["prompt"])):
        raise UserError(problem)

    def frames(key: str, axes: int) -> np.ndarray:
        """An entry with its frames along the first axis."""
        array = np.array(obs[key])
        array = array[None] if array.ndim == axes else array
        if array.ndim != axes + 1 or len(array) != shape.frames:
            expected = f"{shape.frames} frames" if shape.frames > 1 else "one frame"
            raise UserError(f"{key} has the shape {np.shape(obs[key])}, expected {expected}; {USE_PROFILE}")
        return array

    inputs = {}
    for key in shape.pictures:
        pictures = frames(key, 3)
        if pictures.dtype != np.uint8 or pictures.shape[3] != 3:
            raise UserError(f"{key} is {pictures.dtype} with {pictures.shape[3]} channels, expected uint8 with 3")
        if key in CAMERAS and pictures.shape[1:3] != (shape.edge, shape.edge):
            size = f"--set cameras.width={shape.edge} --set cameras.height={shape.edge}"
            raise UserError(f"{key} has {pictures.shape[2]} x {pictures.shape[1]} pixels; the policy needs softvt {size}")
        inputs[key] = shrink(pictures, shape.edge)[None]
    states = fold(frames("state", 1)[None], statistics.axis)
    if states.shape[-1] != shape.state:
        raise UserError(f"state has {states.shape[-1]} numbers, expected {shape.state}; {USE_PROFILE}")
    inputs["state"], inputs["reference"] = statistics.state.apply(states), reference(states[:, -1:], shape.is_relative)
    inputs["prompt"] = np.array([prompts.encode(str(obs["prompt"]))])
    random = np.random.default_rng(obs["softvt"]["seed"])
    inputs["noise"] = random.standard_normal((1, shape.chunk, shape.action), np.float32)
    if shape.has_touch:
        motion = np.array(obs["tactile_marker_motion"])
        if motion.shape != (expected := (shape.marker_rows, MARKERS // 2, 2)):
            raise UserError(f"tactile_marker_motion has the shape {motion.shape}, expected {expected}; {USE_PROFILE}")
        rows = [motion[-1 - back] - motion[0] for back in shape.marker_steps]
        inputs["markers"] = np.stack(rows).reshape(1, len(rows), -1) / np.float32(statistics.marker_scale)
    return inputs
