"""What a policy sees: the shape of its inputs, and how observations of softvt become them."""

from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from . import UserError, prompts
from .data import CAMERAS, TACTILE, Statistics, shrink
from .numbers import fold, reference

# Row of tactile_marker_motion (9, 198, 2) with the present positions; row 0 has the initial ones.
NOW = 8


@dataclass
class Shape:
    """Inputs and size of a network."""

    has_touch: bool  # the markers of both fingers
    head: str = "regression"  # or "flow"
    frames: int = 1  # control steps whose pictures and states are seen
    edge: int = 128  # pixels of a picture
    chunk: int = 50  # actions of an answer
    width: int = 384
    layers: int = 4  # of the encoder and of the decoder
    action: int = 7
    state: int = 7
    marker_steps: tuple[int, ...] = (4, 0)  # steps before the present one whose markers are seen
    has_tactile_pictures: bool = False  # besides the markers

    def to_dict(self) -> dict:
        return asdict(self)

    @property
    def pictures(self) -> list[str]:
        """Keys of the pictures."""
        return [*CAMERAS, *TACTILE] if self.has_tactile_pictures else [*CAMERAS]

    @property
    def profile(self) -> str:
        """The profile of softvt with these inputs: a name, or a file."""
        name = "tactile_pictures" if self.has_tactile_pictures else "visuo_tactile" if self.has_touch else "vision"
        if self.frames == 1 and not self.has_tactile_pictures:
            return name
        return str(Path(__file__).parent / "profiles" / (f"{name}_history.lua" if self.frames > 1 else f"{name}.lua"))


def read(obs: dict, shape: Shape, statistics: Statistics, vocabulary: prompts.Vocabulary) -> dict[str, np.ndarray]:
    """The inputs of a network for an observation, the noise for a flow, and what its answer is relative to, each with a first
    axis of length 1.

    Raises UserError if an entry is missing or has another shape, or the prompt was not trained.
    """
    needed = [*shape.pictures, "state", "prompt", "softvt"] + ["tactile_marker_motion"] * shape.has_touch
    if missing := [key for key in needed if key not in obs]:
        raise UserError(f"the observation has no {', '.join(missing)}; use the profile {shape.profile}")
    if problem := vocabulary.problem(obs["prompt"]):
        raise UserError(problem)

    def frames(key: str, axes: int) -> np.ndarray:
        """An entry with its frames along the first axis."""
        array = np.array(obs[key])
        array = array[None] if array.ndim == axes else array
        if array.ndim != axes + 1 or len(array) != shape.frames:
            expected = f"{shape.frames} frames" if shape.frames > 1 else "one frame"
            raise UserError(f"{key} has the shape {np.shape(obs[key])}, expected {expected}; use the profile {shape.profile}")
        return array

    inputs = {key: shrink(frames(key, 3), shape.edge)[None] for key in shape.pictures}
    states = fold(frames("state", 1)[None], statistics.axis)
    inputs["state"], inputs["reference"] = statistics.state.apply(states), reference(states[:, -1:])
    inputs["prompt"] = np.array([prompts.encode(obs["prompt"])])
    random = np.random.default_rng(obs["softvt"]["seed"])
    inputs["noise"] = random.standard_normal((1, shape.chunk, shape.action), np.float32)
    if shape.has_touch:
        motion = np.array(obs["tactile_marker_motion"])
        rows = [motion[NOW - back] - motion[0] for back in shape.marker_steps]
        inputs["markers"] = np.stack(rows).reshape(1, len(rows), -1) / np.float32(statistics.marker_scale)
    return inputs
