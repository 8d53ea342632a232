"""Demonstrations of `softvt record`, as arrays.

The first reader of a recording packs it: pictures at the edge that policies see, and all numbers, as numpy files in
`RECORDING/packed_EDGE/`, and tactile pictures in `RECORDING/packed_tactile/`. Later readers map these files into memory.
"""

import hashlib
import json
import shutil
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import h5py
import numpy as np
from PIL import Image

from . import UserError, processors
from .numbers import FINE, GRIPPER, Standard, fine, fold, hand, mean_axis, reference
from .phases import is_seen, memory_begins

# The grip codes and the streams that hold the actions in them.
ACTIONS = {"continuous": "actions", "binary": "actions_binary", "two-width": "actions_two_width", "force": "actions_force"}
# Pictures of the cameras by their keys in an observation, and their streams; streams of the tactile pictures of both fingers.
CAMERAS = {"image": "agentview_rgb", "wrist_image": "eye_in_hand_rgb"}
TACTILE = ["gsmini_left_tactile_rgb", "gsmini_right_tactile_rgb"]
# Shape of the tactile pictures of a step: finger, and a cell of softvt's `tactile_image`, without drawn markers. 19 kB.
CELLS = (2, 56, 56, 3)
# Motion below which a step is idle: of the position (m), of the rotation vector (rad), and of the gripper as a share of its range in
# the recording.
IDLE_MOTION, IDLE_TURN, IDLE_GRIP = 0.0005, 0.005, 0.002
# Smallest deviations by which actions are divided: of the position (m), the rotation vector (rad), and the gripper.
LEAST_SPREAD = np.array([0.001] * 3 + [0.01] * 3 + [0.002])
# The same of actions on the fine scale.
LEAST_FINE_SPREAD = 0.2
# Version of the packed files.
PACKED = 5
# Length of the marker displacements of a step: finger, marker, (x, y).
MARKERS = 2 * 99 * 2
# A finger touches if the mean divergence of its markers over the last steps is above a limit (about 0.08 N), as tactile-servo feels it.
TOUCHES, TOUCH_WINDOW = 4e-4, 5
# Columns of the readings that hold the divergence of each finger.
DIVERGENCE = [2, 5]


@dataclass
class Demonstrations:
    """All demonstrations, one after the other: M recorded steps, of which N are trained on."""

    pictures: dict[str, np.ndarray]  # per key (P, edge, edge, 3) uint8
    picture: np.ndarray  # (M,) index of the pictures of each recorded step, -1 without
    state: np.ndarray  # (M, 7): tool position (m), rotation vector, finger position (m); folded; (M, 8) with the drives
    commands: np.ndarray  # (M, 7): the action before each step; that of a first step is its state
    markers: np.ndarray  # (M, 396) px: displacements of the markers of both fingers
    readings: np.ndarray  # (M, 6): of both fingers
    tactile_pictures: np.ndarray | None  # (P, *CELLS) uint8, if they were asked for
    tactile_picture: np.ndarray | None  # (M,) index of the tactile pictures of each recorded step, -1 without
    actions: np.ndarray  # (N, 7): tool position, rotation vector, gripper in the grip code; folded
    row: np.ndarray  # (N,) index among the recorded steps
    start: np.ndarray  # (N,) index of the first recorded step of the same demonstration
    last: np.ndarray  # (N,) index of the last of the N steps of the same demonstration
    prompts: list[str]
    prompt: np.ndarray  # (N,) index of the prompt of each step
    axis: np.ndarray  # (3,) the side of the rotation vectors
    is_relative: bool  # True if the closure of an answer is relative to the commanded one
    has_memory: bool = False  # True if answers are on the fine scale, and relative to the command before while the hand feels

    @property
    def contact(self) -> np.ndarray:
        """(M, 2): 1 in the steps in which each finger touches."""
        first = np.zeros(len(self.readings), int)
        first[self.start] = self.start
        return contact(self.readings, np.maximum.accumulate(first))

    @property
    def begin(self) -> np.ndarray:
        """(M,) the row from which on each row is remembered."""
        return memory_begins(self.commands, np.unique(self.start))

    @property
    def seen(self) -> np.ndarray:
        """(M,) False in the steps in which the hand feels."""
        return is_seen(self.commands, np.arange(len(self.commands)), self.begin)

    def changes(self, ahead: int, feels: bool = False) -> np.ndarray:
        """What answers would be relative to the observation, (n, 7), for actions `ahead` steps after it, or as late as the longest
        demonstration has them; of a policy with memory, in the steps in which the hand feels or in the others."""
        steps = np.arange(len(self.actions))
        if self.has_memory:
            chosen = steps[self.seen != feels]
            # A short demonstration of a test may have no such steps.
            steps = chosen if len(chosen) else steps
        ahead = min(ahead, int((self.last[steps] - steps).max()))
        steps = steps[steps + ahead <= self.last[steps]]
        rows = self.row[steps]
        present = reference(self.state[rows], self.is_relative)
        if self.has_memory:
            present = self.commands[rows] if feels else seen_reference(self.state[rows], self.commands[rows])
        return self.actions[steps + ahead] - present


def seen_reference(state, command):
    """What is subtracted from the actions (…, 7) of a policy with memory that sees, arrays or tensors: the pose of the tool, since what is
    seen is seen from there, and the closure commanded last."""
    found = state[..., :7] + 0
    found[..., GRIPPER] = command[..., GRIPPER]
    return found


def displacements(motion: np.ndarray) -> np.ndarray:
    """Displacements (T, 396) of the markers, px, of gripper_marker_motion (T, finger, initial and present, marker, xy)."""
    return (motion[:, :, 1] - motion[:, :, 0]).reshape(len(motion), -1)


def readings(motion: np.ndarray) -> np.ndarray:
    """Readings (T, 6) of both fingers: the mean motion of the markers along x and y, px, and their divergence, which grows with the load.
    `motion` is gripper_marker_motion (T, finger, initial and present, marker, xy)."""
    initial, moved = motion[:, :, 0], motion[:, :, 1] - motion[:, :, 0]
    place = initial - initial.mean(axis=2, keepdims=True)
    gradient = (place * moved).sum(axis=2) / np.maximum(np.square(place).sum(axis=2), 1e-6)
    return np.concatenate([moved.mean(axis=2), gradient.sum(axis=2, keepdims=True)], 2).reshape(len(motion), -1).astype(np.float32)


def contact(felt: np.ndarray, first: np.ndarray) -> np.ndarray:
    """Whether each finger touches (M, 2), 0 or 1, given readings (M, 6) and the row (M,) at which the episode of each begins."""
    rows = np.maximum(np.arange(len(felt))[:, None] - np.arange(TOUCH_WINDOW), first[:, None])
    return np.float32(felt[:, DIVERGENCE][rows].mean(1) > TOUCHES)


def is_relative(code: str, has_drives: bool) -> bool:
    """True if the closure of an answer is relative to the commanded one.

    The fingers stop before the closure that is commanded, the more so the firmer the grip. An answer relative to where they are
    would close further each time, so that without the drives it is absolute.
    """
    return has_drives and code == "continuous"


def with_hand(state: np.ndarray, sensed_width: np.ndarray, closure: np.ndarray, has_drives: bool) -> np.ndarray:
    """States (M, 7) with what a policy sees of the hand: with the drives its exact finger position and (M, 8) the commanded closure,
    else the finger position with the steps and the offset of a real sensor."""
    if has_drives:
        return np.concatenate([state, closure], 1)
    return np.concatenate([state[:, :6], 0.5 * sensed_width], 1)


def shrink(pictures: np.ndarray, edge: int) -> np.ndarray:
    """Pictures (T, h, w, 3) with an edge of `edge` pixels, each the mean of its area."""
    if pictures.shape[1:3] == (edge, edge):
        return pictures
    small = [Image.fromarray(picture).resize((edge, edge), Image.Resampling.BOX) for picture in pictures]
    return np.stack([np.asarray(picture) for picture in small])


def tactile_cells(fingers: list[np.ndarray]) -> np.ndarray:
    """Tactile pictures (T, *CELLS) of both fingers, given those of each (T, h, w, 3), scaled as softvt scales the cells of `tactile_image`."""
    size = CELLS[1:3]
    cells = [[np.asarray(Image.fromarray(one).resize(size, Image.Resampling.BILINEAR)) for one in pictures] for pictures in fingers]
    return np.stack([np.stack(one) for one in cells], 1)


def hand_steps(closure: np.ndarray, lengths: np.ndarray) -> np.ndarray:
    """True for the steps in which the hand opens or closes, given its closures (M,) in demonstrations of some lengths."""
    change, first = np.diff(closure, prepend=closure[0]), np.cumsum(lengths) - lengths
    change[first] = 0
    return np.abs(change) > IDLE_GRIP * np.ptp(closure)


def moving_steps(actions: np.ndarray, grip_range: float, hand_moves: np.ndarray | None = None) -> np.ndarray:
    """True for the steps of a demonstration (T, 7) that are kept, those of `hand_moves` (T,) among them.

    An expert that waits teaches a policy without memory to wait forever, since its observation does not change meanwhile. In a code that
    switches, the actions do not change while the fingers move: the steps in which they do would count as waiting, and a policy would learn
    neither to let go nor to wait until the hand has closed.
    """
    kept, last = np.ones(len(actions), bool), actions[0]
    for step, action in enumerate(actions[1:], 1):
        change = np.abs(action - last)
        moves = np.linalg.norm(change[:3]) > IDLE_MOTION or np.linalg.norm(change[3:6]) > IDLE_TURN
        moves = moves or change[6] > IDLE_GRIP * grip_range
        kept[step] = moves or (hand_moves is not None and hand_moves[step])
        last = action if moves else last
    return kept


@dataclass
class _Job:
    """A demonstration, and the row of its first step in the packed files."""

    file: Path
    name: str
    steps: int
    row: int
    folder: Path
    edge: int | None  # of the pictures of the cameras; None: the tactile pictures are packed


def _pictures(job: _Job, obs, streams: list[str]) -> list[np.ndarray]:
    if missing := [stream for stream in streams if stream not in obs]:
        raise UserError(f"{job.file}: {job.name} has no pictures ({', '.join(missing)}): it was recorded with --images video")
    return [obs[stream][:] for stream in streams]


def _pack_one(job: _Job) -> dict[str, np.ndarray | str]:
    """Writes the pictures of a demonstration to their rows, and returns its numbers; none with the tactile pictures."""
    rows = slice(job.row, job.row + job.steps)
    with h5py.File(job.file) as file:
        demo = file["data"][job.name]
        obs = demo["obs"]
        if job.edge is None:
            np.load(job.folder / "tactile.npy", mmap_mode="r+")[rows] = tactile_cells(_pictures(job, obs, TACTILE))
            return {}
        for key, pictures in zip(CAMERAS, _pictures(job, obs, [*CAMERAS.values()])):
            if (height := pictures.shape[1]) != job.edge:
                raise UserError(f"{job.file}: pictures of {height} pixels; record with --edge {job.edge}, or train with --edge {height}")
            np.load(job.folder / f"{key}.npy", mmap_mode="r+")[rows] = shrink(pictures, job.edge)
        actions = {stream: demo[stream][:].astype(np.float32) for stream in ACTIONS.values() if stream in demo}
        motion = obs["gripper_marker_motion"][:]
        return actions | {
            "state": obs["state"][:].astype(np.float32),
            "closure": obs["gripper_closure"][:].astype(np.float32),
            "sensed_width": obs["gripper_width_sensed"][:].astype(np.float32),
            "markers": displacements(motion),
            "readings": readings(motion),
            "prompt": str(demo.attrs["language"]),
        }


def _read_one(job: _Job) -> dict[str, np.ndarray | str]:
    try:
        return _pack_one(job)
    except (OSError, KeyError, ValueError) as error:
        raise UserError(f"{job.file}: {job.name} cannot be read: {error}") from None


def _demonstrations(recording: Path) -> list[tuple[Path, str, int]]:
    """File, name and number of steps of each demonstration."""
    found = []
    for path in sorted((recording / "hdf5").glob("*.hdf5")):
        try:
            with h5py.File(path) as file:
                names = sorted(file["data"], key=lambda name: int(name.rsplit("_", 1)[1]))
                found += [(path, name, int(file["data"][name].attrs["num_samples"])) for name in names]
        except (OSError, KeyError, ValueError) as error:
            raise UserError(f"{path}: not a file of demonstrations: {error}") from None
    return found


def packed_folder(recording: Path, edge: int | None) -> Path:
    """The folder of the packed files with pictures of an edge, or of those with the tactile pictures."""
    return recording / f"packed_{'tactile' if edge is None else edge}"


def identity(recording: Path) -> str:
    """What packed files of a recording were made of. Raises UserError if it is incomplete."""
    card = recording / "dataset.json"
    if not card.is_file():
        raise UserError(f"{recording} is no complete recording of softvt: it has no dataset.json")
    return f"{PACKED} {hashlib.sha256(card.read_bytes()).hexdigest()}"


def pack(recording: Path, edge: int | None, processes: int) -> Path:
    """Packs a recording with pictures of an edge, or its tactile pictures, unless that was done before. Returns the folder of the packed
    files.

    Raises UserError if the recording is incomplete or has no such pictures.
    """
    own, folder = identity(recording), packed_folder(recording, edge)

    def is_packed() -> bool:
        return (folder / "identity").is_file() and (folder / "identity").read_text() == own

    if is_packed():
        return folder
    demos = _demonstrations(recording)
    if not demos:
        others = sorted(other.name.removeprefix("packed_") for other in recording.glob("packed_*") if other.name != folder.name)
        if others and edge is None:
            raise UserError(f"{recording} has no tactile pictures: record it again, demonstrate with --tactile-pictures")
        raise UserError(
            f"{recording}: no demonstrations" + (f" with pictures of {edge} pixels, but of {', '.join(others)}" if others else "")
        )
    # Other processes may pack the same recording.
    with TemporaryDirectory(dir=recording, prefix="packing_") as scratch:
        part = Path(scratch) / folder.name
        part.mkdir()
        _write_packed(part, demos, edge, processes)
        (part / "identity").write_text(own)
        if is_packed():  # by another process, which reads it by now
            return folder
        shutil.rmtree(folder, ignore_errors=True)
        try:
            part.rename(folder)
        except OSError:
            if not folder.is_dir():
                raise
    return folder


def create_pictures(folder: Path, edge: int | None, count: int) -> None:
    """Creates the files for `count` pictures of each camera, or of the tactile sensors. They are sparse: only what is written takes space."""
    shapes = {"tactile": CELLS} if edge is None else {key: (edge, edge, 3) for key in CAMERAS}
    for key, shape in shapes.items():
        np.lib.format.open_memmap(folder / f"{key}.npy", "w+", np.uint8, (count, *shape))


def _write_packed(folder: Path, demos: list[tuple[Path, str, int]], edge: int | None, processes: int) -> None:
    """Writes the pictures and, with those of the cameras, the numbers of demonstrations (file, name, steps)."""
    ends = np.cumsum([steps for _, _, steps in demos])
    create_pictures(folder, edge, int(ends[-1]))
    jobs = [_Job(path, name, steps, int(end) - steps, folder, edge) for (path, name, steps), end in zip(demos, ends)]
    with ProcessPoolExecutor(processes) as pool:
        numbers = list(pool.map(_read_one, jobs))
    if edge is None:
        return
    common = set.intersection(*(set(one) for one in numbers)) - {"prompt"}
    arrays = {stream: np.concatenate([one[stream] for one in numbers]) for stream in sorted(common)}
    prompts = np.array([one["prompt"] for one in numbers])
    np.savez(folder / "numbers.npz", lengths=[steps for _, _, steps in demos], prompts=prompts, **arrays)


def _check_recording(recording: Path, code: str, frames: int, packed) -> None:
    """Raises UserError if the recording was made for another grip code, has no actions in this one, or too few steps with pictures."""
    card = recording / "recording.json"
    if not card.is_file():
        raise UserError(f"{recording} is no complete recording of softvt: it has no recording.json")
    about = json.loads(card.read_text())
    stated = about.get("gripper")
    if stated and stated != code:
        raise UserError(f"{recording} was recorded for the grip code {stated}: pass --gripper {stated}")
    if ACTIONS[code] not in packed:
        again = f"record it again, demonstrate with --gripper {code}" if "picture" in packed else "record it again"
        raise UserError(f"{recording} has no {ACTIONS[code]}, the actions in the grip code {code}: {again}")
    if "picture" in packed and about.get("frames", 1) < frames:
        raise UserError(f"{recording} has no pictures of {frames} steps in a row: record it again, demonstrate with --frames {frames}")


def commands(state: np.ndarray, actions: np.ndarray, lengths: np.ndarray) -> np.ndarray:
    """The action before each step (M, 7) of demonstrations; that of a first step is its state."""
    before, first = np.roll(actions, 1, axis=0), np.cumsum(lengths) - lengths
    before[first] = hand(state[first])
    return before


def load(
    recordings: list[Path],
    code: str,
    edge: int,
    has_tactile: bool = False,
    has_drives: bool = False,
    has_memory: bool = False,
    frames: int = 1,
) -> Demonstrations:
    """Reads all demonstrations of recordings, with their tactile pictures and the drives of the fingers if they are asked for, for a policy
    that sees a number of frames. For one with memory, waiting is kept.

    Raises UserError if a recording is incomplete, or lacks the pictures or the grip code.
    """
    folders = [pack(recording, edge, processors()) for recording in recordings]
    packed = [np.load(folder / "numbers.npz") for folder in folders]
    for recording, numbers in zip(recordings, packed):
        _check_recording(recording, code, frames, numbers)

    def joined(stream: str) -> np.ndarray:
        return np.concatenate([numbers[stream] for numbers in packed])

    def indices(key: str) -> tuple[np.ndarray, list[int]]:
        """The index of the pictures of each recorded step, -1 without, and the number of pictures of each recording."""
        own = [numbers[key] if key in numbers else np.arange(numbers["lengths"].sum()) for numbers in packed]
        counts = [int(one.max()) + 1 for one in own]
        return np.concatenate([np.where(one < 0, -1, one + first) for one, first in zip(own, np.cumsum(counts) - counts)]), counts

    def pictures(folders: list[Path], key: str, counts: list[int]) -> np.ndarray:
        mapped = [np.load(folder / f"{key}.npy", mmap_mode="r")[:count] for folder, count in zip(folders, counts)]
        return mapped[0] if len(mapped) == 1 else np.concatenate(mapped)

    picture, counts = indices("picture")
    tactile_pictures = tactile_picture = None
    if has_tactile:
        tactile_folders = [pack(recording, None, processors()) for recording in recordings]
        tactile_picture, tactile_counts = indices("tactile_picture")
        tactile_pictures = pictures(tactile_folders, "tactile", tactile_counts)

    recorded, names, actions = joined("lengths"), joined("prompts"), joined(ACTIONS[code])
    axis = mean_axis(actions[:, 3:6])
    state, actions = fold(with_hand(joined("state"), joined("sensed_width"), joined("closure"), has_drives), axis), fold(actions, axis)
    grip_range, ends = float(np.ptp(actions[:, 6])), np.cumsum(recorded)[:-1]
    # What was recorded in another code has no commanded closure: the fingers tell how far the hand is closed.
    is_commanded = all(ACTIONS["continuous"] in numbers for numbers in packed)
    fingers = hand(joined("state"))[:, GRIPPER]
    closure = joined(ACTIONS["continuous"])[:, GRIPPER] if is_commanded else fingers
    hand_moves = hand_steps(closure, recorded)
    if code != "continuous":
        # The command of a hand that is open or closed switches in one step, and its fingers move in the next ones.
        hand_moves |= hand_steps(fingers, recorded)
    moving = [
        np.ones(len(one), bool) if has_memory else moving_steps(one, grip_range, own)
        for one, own in zip(np.split(actions, ends), np.split(hand_moves, ends))
    ]
    kept, lengths = np.concatenate(moving), np.array([mask.sum() for mask in moving])
    prompts = sorted(set(names.tolist()))
    return Demonstrations(
        pictures={key: pictures(folders, key, counts) for key in CAMERAS},
        picture=picture,
        state=state,
        commands=commands(state, actions, recorded),
        markers=joined("markers"),
        readings=joined("readings"),
        tactile_pictures=tactile_pictures,
        tactile_picture=tactile_picture,
        actions=actions[kept],
        row=np.flatnonzero(kept),
        start=np.repeat(np.cumsum(recorded) - recorded, lengths),
        last=np.repeat(np.cumsum(lengths) - 1, lengths),
        prompts=prompts,
        prompt=np.repeat([prompts.index(name) for name in names], lengths),
        axis=axis,
        is_relative=is_relative(code, has_drives),
        has_memory=has_memory,
    )


@dataclass
class Statistics:
    """Normalisation of the inputs and answers of a policy.

    Answers are relative to the observation (numbers.reference, seen_reference), those of a hand that feels to the command before: a policy that
    is to hold still then answers 0, instead of a pose which it knows to a few millimetres only. The first actions of a chunk differ less from the present pose than the last
    ones, and are standardised each on their own.
    """

    state: Standard
    action: Standard  # of shape (chunk, 7)
    felt: Standard  # the same while the hand feels
    marker_scale: float  # px
    axis: np.ndarray  # (3,) the side of the rotation vectors

    @classmethod
    def of(cls, demos: Demonstrations, chunk: int) -> "Statistics":
        scale = float(np.sqrt(np.square(demos.markers, dtype=np.float64).mean()) + 1e-6)
        if not demos.has_memory:
            action = Standard.of_each([demos.changes(ahead) for ahead in range(chunk)], LEAST_SPREAD)
            return cls(Standard.of(demos.state), action, action, scale, demos.axis)
        action, felt = (
            Standard.of_each([fine(demos.changes(ahead, feels), FINE) for ahead in range(chunk)], LEAST_FINE_SPREAD)
            for feels in (False, True)
        )
        return cls(Standard.of(demos.state), action, felt, scale, demos.axis)
