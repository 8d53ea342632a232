"""What a policy sees: the shape of its inputs, and how observations of softvt become them."""

import json
from dataclasses import asdict, dataclass
from itertools import pairwise

import numpy as np

from . import UserError, prompts
from .data import CAMERAS, CELLS, MARKERS, TOUCH_WINDOW, Statistics, contact, is_relative, readings, seen_reference
from .numbers import GRIPPER, ROTATION, fold, hand, reference, turned, turns
from .phases import holds, is_seen, memory_begins

USE_PROFILE = "use the profile that train wrote next to the checkpoint"
# A policy with memory sees means over intervals of steps before the present one. These are their limits. Feeling for a grip takes 100 to
# 300 steps.
LIMITS = (0, 1, 2, 4, 6, 8, 10, 12, 14, 16, 20, 24, 28, 32, 40, 50, 64, 80, 100, 128, 160, 200, 250, 320, 400)
INTERVALS, REMEMBERED = len(LIMITS) - 1, LIMITS[-1]
# Share (INTERVALS, REMEMBERED) of each remembered step in the mean of each interval.
SHARES = np.float32([[(first <= back < end) / (end - first) for back in range(REMEMBERED)] for first, end in pairwise(LIMITS)])
# Control steps in an observation of such a policy, softvt's largest number: as many actions may be executed of an answer.
RECENT = 32
# What a policy sees of the fingers, and how many numbers per step it remembers of it: the readings of the markers, or whether each touches.
TOUCH = {"": 0, "markers": 6, "contact": 2, "pictures": 0}
# Steps before the present one whose touch is seen, and those of a policy that remembers, whose memory has no numbers of tactile pictures. Those
# from before its memory begins are replaced by that at which it does.
TOUCH_STEPS, REMEMBERED_PICTURES = (4, 0), (128, 32, 8, 0)
# Control steps in `tactile_image`, a mosaic of 4 × 4 cells: as many actions may be executed of an answer of a policy that remembers them.
MOSAIC = 8


def gripper(code: str) -> str:
    """The gripper of a profile of softvt in a grip code, in Lua."""
    ends = "" if code == "force" else "open = 0, closed = 1, "
    return f'{{ {ends}code = "{code}" }}'


@dataclass
class Shape:
    """Inputs and size of a network."""

    touch: str = ""  # a key of TOUCH
    code: str = "continuous"  # grip code of its answers
    head: str = "regression"  # or "flow"
    frames: int = 1  # control steps whose pictures and states are seen
    edge: int = 128  # pixels of a picture
    chunk: int = 50  # actions of an answer
    width: int = 384
    layers: int = 4  # of the encoder and of the decoder
    action: int = 7
    has_drives: bool = False  # the exact finger position and the commanded closure, whose gap is the grip force
    has_memory: bool = False  # states, commands and readings of earlier steps; answers are then relative to the command before

    def to_dict(self) -> dict:
        return asdict(self)

    @property
    def pictures(self) -> list[str]:
        """Keys of the pictures of the cameras."""
        return [*CAMERAS]

    @property
    def has_markers(self) -> bool:
        """True if softvt sends the markers."""
        return self.touch in ("markers", "contact")

    @property
    def has_tactile_pictures(self) -> bool:
        return self.touch == "pictures"

    @property
    def touch_steps(self) -> tuple[int, ...]:
        """Steps before the present one whose touch is seen."""
        return REMEMBERED_PICTURES if self.has_tactile_pictures and self.has_memory else TOUCH_STEPS

    @property
    def most_executed(self) -> int:
        """Largest number of actions of an answer that may be executed before the next one."""
        return min(self.chunk, MOSAIC if self.has_tactile_pictures else RECENT) if self.has_memory else self.chunk

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
        states = f", frames = {RECENT}" if self.has_memory else history
        hand = ["finger_position", "closure"] if self.has_drives else ["sensed_finger_position"]
        parts = ["position", "axis_angle", *hand]
        inputs = {
            "image": 'source = "camera", camera = "third_person"' + history,
            "wrist_image": 'source = "camera", camera = "wrist"' + history,
            "state": f'source = "state", parts = {{ {", ".join(map(json.dumps, parts))} }}' + states,
            "prompt": 'source = "prompt"',
            "softvt": 'source = "query"',
            "tactile_marker_motion": f'source = "marker_motion", frames = {self.marker_rows - 1}',
            "tactile_image": 'source = "tactile_image"',
        }
        lines = "".join(f'    {{ keys = {{ "{key}" }}, {inputs[key]} }},\n' for key in self.keys)
        actions = f'{{ pose = "absolute", gripper = {gripper(self.code)} }}'
        return f"return softvt.profile {{\n  name = {json.dumps(name, ensure_ascii=False)},\n  inputs = {{\n{lines}  }},\n  actions = {actions},\n}}\n"

    @property
    def marker_rows(self) -> int:
        """Length of tactile_marker_motion (rows, 198, 2): the initial positions of the markers, and those of the last steps."""
        own = max(TOUCH_STEPS) + (TOUCH_WINDOW if self.touch == "contact" else 1)
        return 1 + (RECENT if self.has_memory else own)

    @property
    def keys(self) -> list[str]:
        """Keys of an observation."""
        touch = ["tactile_marker_motion"] * self.has_markers + ["tactile_image"] * self.has_tactile_pictures
        return [*self.pictures, "state", "prompt", "softvt", *touch]


@dataclass
class Past:
    """What a policy with memory has seen of an episode: one row per control step, the present one last. All steps are kept, since a hand may
    feel for longer than REMEMBERED steps, and since when it feels decides which network answers."""

    states: np.ndarray  # (T, 7): in the units of commands
    commands: np.ndarray  # (T, 7): the action before each step
    readings: np.ndarray  # (T, n): what is remembered of the fingers
    tactile: np.ndarray | None = None  # (t, *CELLS) tactile pictures of the last steps, as many as are seen

    def inputs(self) -> dict[str, np.ndarray]:
        """The means of the remembered steps, each with a first axis of length 1: states and commands relative to the command before, along
        the axes of the hand, and the least and the greatest of these commands. While nothing is remembered, the lag of the robot is not
        shown either."""
        begins = memory_begins(self.commands, np.array([0]))
        last, begin = len(self.states) - 1, begins[-1]
        rows, now, is_known = np.maximum(last - np.arange(REMEMBERED), begin), self.commands[-1], np.float32(begin < last)
        axes = turns(now[ROTATION])
        states, commands = (turned(is_known * (numbers[rows] - now), axes) for numbers in (self.states, self.commands))
        touch = {}
        if self.readings.shape[1]:
            touch["readings"] = (SHARES @ self.readings[rows])[None]
        if self.tactile is not None:
            back = np.minimum(REMEMBERED_PICTURES, last - begin)
            touch["tactile"] = self.tactile[len(self.tactile) - 1 - back][None]
        return touch | {
            "states": (SHARES @ states)[None],
            "commands": (SHARES @ commands)[None],
            "extremes": np.stack([commands.min(0), commands.max(0)])[None],
            "seen": np.float32([is_seen(self.commands, last, begin)]),
            "held": np.float32([[holds(self.commands, np.array([0]), begins)[-1]]]),
            "axes": axes[None],
        }


def mosaic_cells(mosaic: np.ndarray) -> np.ndarray:
    """The tactile pictures (MOSAIC, *CELLS) in `tactile_image`, oldest first: four to a row, those of the left finger above."""
    fingers, height, width, colors = CELLS
    return mosaic.reshape(fingers, 2, height, 4, width, colors).transpose(1, 3, 0, 2, 4, 5).reshape(MOSAIC, *CELLS)


def remembered(states: np.ndarray, felt: np.ndarray, before: tuple[Past, np.ndarray] | None, tactile: np.ndarray | None = None) -> Past:
    """What was seen up to the present step, given the states (RECENT, 7), what is remembered of the fingers and the tactile pictures
    (MOSAIC, *CELLS), if they are seen, of the last steps, and what had been seen at the observation before with the actions (n, 7) executed
    since; None at the start."""
    if before is None:
        return Past(states[-1:], states[-1:], felt[-1:], None if tactile is None else tactile[-1:])
    past, actions = before
    steps, commands = len(actions), actions.astype(np.float32)
    commands[:, GRIPPER] = commands[:, GRIPPER].clip(0, 1)
    pairs = (past.states, states[-steps:]), (past.commands, commands), (past.readings, felt[-steps:])
    pictures = None
    if tactile is not None:
        pictures = np.concatenate([past.tactile, tactile[-steps:]])[-1 - max(REMEMBERED_PICTURES) :]
    return Past(*(np.concatenate(pair) for pair in pairs), pictures)


def _felt(obs: dict, shape: Shape) -> tuple[np.ndarray, np.ndarray]:
    """The displacements (T, 396) of the markers in the last steps, px, and what is remembered of them (T, n), or if each finger touches."""
    motion = np.array(obs["tactile_marker_motion"])
    if motion.shape != (expected := (shape.marker_rows, MARKERS // 2, 2)):
        raise UserError(f"tactile_marker_motion has the shape {motion.shape}, expected {expected}; {USE_PROFILE}")
    fingers = motion.reshape(-1, 2, MARKERS // 4, 2)
    moved = fingers[1:]
    felt = readings(np.stack([np.broadcast_to(fingers[:1], moved.shape), moved], 2))
    if shape.touch == "contact":
        felt = contact(felt, np.zeros(len(felt), int))
    return (motion[1:] - motion[0]).reshape(len(moved), -1), felt


def read(
    obs: dict, shape: Shape, statistics: Statistics, vocabulary: prompts.Vocabulary, before: tuple[Past, np.ndarray] | None = None
) -> tuple[dict[str, np.ndarray], Past | None]:
    """The inputs of a network for an observation, the noise for a flow, and what its answer is relative to, each with a first
    axis of length 1; and for a policy with memory what it has seen, given `before` as in `remembered`.

    Raises UserError if an entry is missing or has another shape, or the prompt was not trained.
    """
    if missing := [key for key in shape.keys if key not in obs]:
        raise UserError(f"the observation has no {', '.join(missing)}; {USE_PROFILE}")
    if missing := [key for key in ("seed", "step") if key not in obs["softvt"]]:
        raise UserError(f"softvt in the observation has no {', '.join(missing)}; {USE_PROFILE}")
    if problem := vocabulary.problem(str(obs["prompt"])):
        raise UserError(problem)

    def frames(key: str, axes: int, count: int = shape.frames) -> np.ndarray:
        """An entry with its frames along the first axis."""
        array = np.array(obs[key])
        array = array[None] if array.ndim == axes else array
        if array.ndim != axes + 1 or len(array) != count:
            expected = f"{count} frames" if count > 1 else "one frame"
            raise UserError(f"{key} has the shape {np.shape(obs[key])}, expected {expected}; {USE_PROFILE}")
        return array

    inputs = {}
    for key in shape.pictures:
        pictures = frames(key, 3)
        if pictures.dtype != np.uint8 or pictures.shape[3] != 3:
            raise UserError(f"{key} is {pictures.dtype} with {pictures.shape[3]} channels, expected uint8 with 3")
        if pictures.shape[1:3] != (shape.edge, shape.edge):
            size = f"--set cameras.width={shape.edge} --set cameras.height={shape.edge}"
            raise UserError(f"{key} has {pictures.shape[2]} x {pictures.shape[1]} pixels; the policy needs softvt {size}")
        inputs[key] = pictures[None]
    recent = fold(frames("state", 1, RECENT if shape.has_memory else shape.frames), statistics.axis)
    if recent.shape[-1] != shape.state:
        raise UserError(f"state has {recent.shape[-1]} numbers, expected {shape.state}; {USE_PROFILE}")
    states = recent[None, -shape.frames :]
    inputs["state"], inputs["reference"] = statistics.state.apply(states), reference(states[:, -1:], shape.is_relative)
    inputs["prompt"] = np.array([prompts.encode(str(obs["prompt"]))])
    random = np.random.default_rng(obs["softvt"]["seed"])
    inputs["noise"] = random.standard_normal((1, shape.chunk, shape.action), np.float32)
    felt, tactile = np.zeros((RECENT, 0), np.float32), None
    present = [-1 - back for back in shape.touch_steps]
    if shape.has_markers:
        moved, felt = _felt(obs, shape)
        inputs["touch"] = (felt if shape.touch == "contact" else moved / np.float32(statistics.marker_scale))[present][None]
    if shape.has_tactile_pictures:
        mosaic = np.array(obs["tactile_image"])
        if mosaic.shape != (expected := (4 * CELLS[1], 4 * CELLS[2], CELLS[3])) or mosaic.dtype != np.uint8:
            raise UserError(f"tactile_image is {mosaic.dtype} of the shape {mosaic.shape}, expected uint8 of {expected}; {USE_PROFILE}")
        tactile = mosaic_cells(mosaic)
        if not shape.has_memory:
            inputs["tactile"] = tactile[present][None]
    if not shape.has_memory:
        return inputs, None
    past = remembered(hand(recent), felt, before, tactile)
    inputs |= past.inputs()
    command = past.commands[None, -1:]
    inputs["reference"] = seen_reference(states[:, -1:], command) if inputs["seen"] else command
    return inputs, past
