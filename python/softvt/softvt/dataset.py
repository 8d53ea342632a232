"""Recordings of `softvt record` as a data set of control steps, for the loaders of PyTorch and others."""

import json
import operator
import os
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .arguments import require_bool, require_one_of, texts, whole_number

if TYPE_CHECKING:
    import h5py

ACTIONS = {"continuous": "actions", "binary": "actions_binary", "two-width": "actions_two_width", "force": "actions_force"}
"""Streams of the actions in each grip code (docs/data.md)."""

JOINT_ACTIONS = "actions_joints"
"""Stream of the motion of the actions as joint positions, rad."""

OBSERVATIONS = ("agentview_rgb", "eye_in_hand_rgb", "state")
"""Streams that an item has by default."""


@dataclass(frozen=True)
class Demonstration:
    """One demonstration of a recording."""

    file: Path
    """HDF5 file."""
    name: str
    """Group in the file, such as "demo_0"."""
    steps: int
    """Number of control steps."""
    suite: str
    task: int
    prompt: str
    attempt: int
    """Episode of the demonstration split in which it was recorded."""
    safe: bool
    """Whether the evaluator judged it safe. Recordings made with `--keep goal` have others too."""


class Dataset:
    """The control steps of a recording, as a map-style data set: `len(dataset)` and `dataset[i]`.

    An item is a dict of the requested observation streams and of

    - `actions` (horizon, 7): the actions from this step on; after the last step they repeat the last one, and `actions_is_pad` (horizon) is
      true there. Position (m), axis-angle (rad), and the gripper in the grip code. With control="joints" (horizon, 8): the positions of the seven
      joints (rad), and the gripper.
    - `prompt`, `episode` (number of the demonstration in `demonstrations`) and `step`.

    Files are opened by each process that reads, so that loaders with workers are safe.
    """

    demonstrations: list[Demonstration]
    """All demonstrations, in the order of files and of their numbers."""

    def __init__(
        self,
        path: str | os.PathLike[str],
        keys: Sequence[str] = OBSERVATIONS,
        *,
        horizon: int = 1,
        control: str = "pose",
        gripper: str | None = None,
        task: int | Sequence[int] | None = None,
        safe: bool = False,
    ):
        """Opens a recording.

        path: folder that `softvt record` wrote, or one of its HDF5 files.
        keys: streams of `obs`, such as "state", "gsmini_left_tactile_rgb", or "agentview_depth" if it was recorded, and others by their path, such
            as "privileged/d".
        horizon: number of actions of an item.
        control: motion of the actions, "pose" or "joints".
        gripper: grip code of the actions; by default that of the recording, as of its exports.
        task: only these tasks.
        safe: True for the safe demonstrations only. By default all that were kept, which are safe unless they were recorded with `--keep goal`.

        Raises ValueError if there is no such stream, no demonstration of one of the tasks, or no safe one, and ImportError without h5py.
        """
        if gripper is not None:
            require_one_of("gripper", gripper, [*ACTIONS])
        require_one_of("control", control, ("pose", "joints"))
        require_bool("safe", safe)
        horizon = whole_number("horizon", horizon, 1)
        keys = texts("keys", keys)
        if not isinstance(path, str | os.PathLike):
            raise ValueError(f"path={path!r}: expected the path of a recording")
        self._streams = {key: key if "/" in key else f"obs/{key}" for key in keys}
        self._horizon, self._control = horizon, control
        self._files: dict[Path, h5py.File] = {}
        self._process = os.getpid()
        tasks = None if task is None else _tasks(task)
        files = _hdf5_files(Path(path))
        self._actions = ACTIONS[gripper or _recorded_gripper(files[0])]
        recorded = [demo for file in files for demo in self._read(file)]
        if not recorded:
            raise ValueError(f"{path}: no demonstration")
        known = {demo.task for demo in recorded}
        if tasks is not None and (missing := tasks - known):
            raise ValueError(f"{path}: no demonstration of task {_listed(missing)}; the recording has those of task {_listed(known)}")
        chosen = [demo for demo in recorded if tasks is None or demo.task in tasks]
        self.demonstrations = [demo for demo in chosen if demo.safe or not safe]
        if not self.demonstrations:
            raise ValueError(f"{path}: safe=True: none of the {len(chosen)} demonstrations is safe; leave it out")
        self._starts = np.cumsum([0, *(demo.steps for demo in self.demonstrations)])

    def __len__(self) -> int:
        """Number of control steps."""
        return int(self._starts[-1])

    def __getitem__(self, index: int) -> dict[str, Any]:
        """The control step of a number, from 0; negative ones count from the end."""
        try:
            index = operator.index(index)
        except TypeError:
            raise TypeError(f"step {index!r}: expected a whole number; `episode` gives all steps of a demonstration") from None
        number = index + len(self) if index < 0 else index
        if not 0 <= number < len(self):
            raise IndexError(f"step {index} of {len(self)}")
        episode = int(np.searchsorted(self._starts, number, side="right")) - 1
        demo, step = self.demonstrations[episode], number - int(self._starts[episode])
        group = self._group(demo)
        item: dict[str, Any] = {key: np.asarray(group[stream][step]) for key, stream in self._streams.items()}
        actions = self._actions_of(group, slice(step, step + self._horizon)).astype(np.float32)
        missing = self._horizon - len(actions)
        item["actions"] = np.concatenate([actions, np.repeat(actions[-1:], missing, axis=0)])
        item["actions_is_pad"] = np.arange(self._horizon) >= len(actions)
        return {**item, "prompt": demo.prompt, "episode": episode, "step": step}

    def episode(self, number: int) -> dict[str, np.ndarray]:
        """All steps of a demonstration: the requested streams and `actions`, each with the steps along its first axis."""
        number = whole_number("number", number)
        if not -len(self.demonstrations) <= number < len(self.demonstrations):
            raise IndexError(f"demonstration {number} of {len(self.demonstrations)}")
        group = self._group(self.demonstrations[number])
        streams = {key: np.asarray(group[stream]) for key, stream in self._streams.items()}
        return {**streams, "actions": self._actions_of(group, slice(None))}

    def close(self) -> None:
        """Closes the files. They are opened again when they are needed."""
        for file in self._files.values():
            file.close()
        self._files.clear()

    def __getstate__(self) -> dict[str, Any]:
        # Open files cannot be sent to the workers of a loader.
        return {**self.__dict__, "_files": {}}

    def _read(self, file: Path) -> list[Demonstration]:
        try:
            data = self._open(file)["data"]
        except (OSError, KeyError) as error:
            raise ValueError(f"{file}: no recording of softvt: {str(error).strip(chr(34))}") from error
        found = []
        for name in sorted(data, key=lambda name: int(name.removeprefix("demo_"))):
            group, attrs = data[name], data[name].attrs
            joints = [JOINT_ACTIONS] if self._control == "joints" else []
            for stream in [*self._streams.values(), self._actions, *joints]:
                if stream not in group:
                    if stream == JOINT_ACTIONS:
                        raise ValueError(f"{file}: data/{name} has no {stream}: an earlier version of softvt recorded it; record it again")
                    if stream.removeprefix("obs/") in ACTIONS.values():
                        raise ValueError(f"keys: {stream.removeprefix('obs/')!r} is no observation; an item has `actions` in any case")
                    folder = stream.rpartition("/")[0]
                    folder = folder if folder in group else "obs"
                    have = ", ".join(sorted(group[folder]))
                    raise ValueError(f"{file}: data/{name} has no stream {stream}; {folder} has {have}")
                if below := _streams_below(group, stream):
                    raise ValueError(f"{file}: data/{name}/{stream} is a group; give one of its streams: {', '.join(below)}")
            text = {key: _text(attrs[key]) for key in ("task_suite", "language")}
            numbers = {key: int(attrs[key]) for key in ("num_samples", "task_id", "attempt", "success")}
            found.append(
                Demonstration(
                    file,
                    name,
                    numbers["num_samples"],
                    text["task_suite"],
                    numbers["task_id"],
                    text["language"],
                    numbers["attempt"],
                    bool(numbers["success"]),
                )
            )
        return found

    def _actions_of(self, group: Any, steps: slice) -> np.ndarray:
        poses = np.asarray(group[self._actions][steps])
        if self._control == "pose":
            return poses
        return np.concatenate([np.asarray(group[JOINT_ACTIONS][steps]), poses[:, -1:]], axis=1)

    def _group(self, demo: Demonstration) -> Any:
        return self._open(demo.file)["data"][demo.name]

    def _open(self, path: Path) -> "h5py.File":
        import h5py

        if self._process != os.getpid():
            # The files of the process that this one was forked from.
            self._files, self._process = {}, os.getpid()
        if path not in self._files:
            self._files[path] = h5py.File(path, "r")
        return self._files[path]


def _hdf5_files(path: Path) -> list[Path]:
    """The HDF5 files of a recording, in order of their names. Raises ValueError if there is none, or if the recording is not complete."""
    if path.is_file():
        return [path]
    # softvt writes the first file at the start of a recording, and the second at its end.
    if (path / "recording.json").is_file() and not (path / "dataset.json").is_file():
        raise ValueError(
            f"{path}: the recording was interrupted; complete it by its command with --resume (softvt record … --resume --out {path}), or give "
            "the HDF5 file of a task that is complete"
        )
    manifest = path / "manifest.jsonl"
    if manifest.is_file():
        found = [path / name for name in sorted(_manifest_files(manifest))]
    else:
        found = sorted((path / "hdf5").glob("*.hdf5")) or sorted(path.glob("*.hdf5"))
    if not found:
        raise ValueError(f"{path}: no recording; give a folder that softvt record wrote, or one of its HDF5 files")
    return found


def _recorded_gripper(file: Path) -> str:
    """The grip code of the recording that an HDF5 file belongs to."""
    for folder in file.resolve().parents[:2]:
        card = folder / "dataset.json"
        if card.is_file():
            try:
                gripper = json.loads(card.read_text(encoding="utf-8")).get("gripper") or "continuous"
            except (ValueError, AttributeError) as error:
                raise ValueError(f"{card}: not the file that softvt record wrote: {error}; give gripper to do without it") from error
            require_one_of(f"{card}: gripper", gripper, [*ACTIONS])
            return str(gripper)
    return "continuous"


def _streams_below(demo: Any, name: str) -> list[str]:
    """Paths in the group of a demonstration of the streams below a name; none for a stream."""
    import h5py

    found: list[str] = []
    if isinstance(demo[name], h5py.Group):
        demo[name].visititems(lambda _, item: found.append(item.name) if isinstance(item, h5py.Dataset) else None)
    return sorted(path.removeprefix(f"{demo.name}/") for path in found)


def _manifest_files(manifest: Path) -> set[str]:
    """The HDF5 files that a manifest names. Raises ValueError for a line that names none."""
    names = set()
    for number, line in enumerate(manifest.read_text(encoding="utf-8").splitlines(), 1):
        try:
            names.add(json.loads(line)["hdf5_path"])
        except (ValueError, KeyError, TypeError) as error:
            raise ValueError(f"{manifest}:{number}: not a line of a manifest: {error}") from error
    return names


def _tasks(task: Any) -> set[int]:
    """Numbers of the tasks that an argument names. Raises ValueError for anything else."""
    try:
        many = isinstance(task, Iterable) and not isinstance(task, str | bytes)
        numbers = {whole_number("task", number) for number in (task if many else [task])}
    except ValueError:
        raise ValueError(f"task={task!r}: expected a number or a list of numbers") from None
    if not numbers:
        raise ValueError(f"task={task!r}: no number in the list; None is for all tasks")
    return numbers


def _listed(tasks: Iterable[int]) -> str:
    return ", ".join(map(str, sorted(tasks)))


def _text(value: Any) -> str:
    return value.decode() if isinstance(value, bytes) else str(value)
