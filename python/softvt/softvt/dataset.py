"""Recordings of `softvt record` as a data set of control steps, for the loaders of PyTorch and others."""

import json
import operator
import os
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .arguments import require_bool, require_one_of, require_text, texts, whole_number

if TYPE_CHECKING:
    import h5py

ACTIONS = {"continuous": "actions", "binary": "actions_binary", "two-width": "actions_two_width", "force": "actions_force"}
"""Streams of the actions in each grip code (docs/data.md)."""

JOINT_ACTIONS = "actions_joints"
"""Stream of the motion of the actions as joint positions, rad."""

OBSERVATIONS = ("agentview_rgb", "eye_in_hand_rgb", "state")
"""Streams that an item has by default."""

# Attributes of a demonstration that its line of the manifest has as well.
_COMPARED = ("num_samples", "task_suite", "task_id", "language", "state_hash")
_CHECK = "`softvt dataset check` tells more"


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
        suite: str | None = None,
        task: int | Sequence[int] | None = None,
        safe: bool = False,
    ):
        """Opens a recording.

        path: folder that `softvt record` wrote, or one of its HDF5 files.
        keys: streams of `obs`, such as "state", "gsmini_left_tactile_rgb", or "agentview_depth" if it was recorded, and others by their path, such
            as "privileged/d".
        horizon: number of actions of an item.
        control: motion of the actions, "pose" or "joints".
        gripper: grip code of the actions; by default that of the recording, as of its exports. Needed for files of recordings that differ in it, and
            for files outside of the folder of their recording.
        suite: only the demonstrations of this suite.
        task: only these tasks. Needs `suite` if the recording has several suites.
        safe: True for the safe demonstrations only. By default all that were kept, which are safe unless they were recorded with `--keep goal`.

        Raises ValueError if there is no such stream, no demonstration of the suite or of one of the tasks, or no safe one, and if the files
        contradict themselves or the manifest; ImportError without h5py.
        """
        if gripper is not None:
            require_one_of("gripper", gripper, [*ACTIONS])
        require_one_of("control", control, ("pose", "joints"))
        require_bool("safe", safe)
        horizon = whole_number("horizon", horizon, 1)
        keys = texts("keys", keys)
        for key in keys:
            if not all(key.split("/")):
                raise ValueError(
                    f"keys: {key!r}: expected the path of a stream in its demonstration, without / at its ends, such as 'privileged/d'"
                )
        if suite is not None:
            require_text("suite", suite)
        if not isinstance(path, str | os.PathLike):
            raise ValueError(f"path={path!r}: expected the path of a recording")
        self._streams = {key: key if "/" in key else f"obs/{key}" for key in keys}
        self._horizon, self._control = horizon, control
        self._files: dict[Path, h5py.File] = {}
        self._process = os.getpid()
        tasks = None if task is None else _tasks(task)
        manifests: dict[Path, list[dict[str, Any]]] = {}
        recorded = [demo for file in _hdf5_files(Path(path)) for demo in self._read(file, manifests)]
        if not recorded:
            raise ValueError(f"{path}: no demonstration")
        chosen = _chosen(path, recorded, suite, tasks)
        self.demonstrations = [demo for demo in chosen if demo.safe or not safe]
        if not self.demonstrations:
            raise ValueError(f"{path}: safe=True: none of the {len(chosen)} demonstrations is safe; leave it out")
        self._actions = ACTIONS[gripper or _recorded_gripper(dict.fromkeys(demo.file for demo in self.demonstrations))]
        for demo in self.demonstrations:
            self._require_streams(demo)
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

    def stats(self) -> dict[str, dict[str, np.ndarray]]:
        """Of `actions` and of each requested stream of numbers or vectors, over all steps: `mean`, `std`, `min`, `max`, and the quantiles `q01` and
        `q99`, each of the shape of a step, float32, for normalisation. Pictures and other arrays are left out."""
        group = self._group(self.demonstrations[0])
        keys = [key for key, stream in self._streams.items() if group[stream].ndim <= 2 and group[stream].dtype.kind in "iuf"]
        steps: dict[str, list[np.ndarray]] = {key: [] for key in ["actions", *keys]}
        for demo in self.demonstrations:
            group = self._group(demo)
            steps["actions"].append(self._actions_of(group, slice(None)))
            for key in keys:
                steps[key].append(np.asarray(group[self._streams[key]]))
        return {key: _statistics(np.concatenate(found).astype(np.float64)) for key, found in steps.items()}

    def close(self) -> None:
        """Closes the files. They are opened again when they are needed."""
        for file in self._files.values():
            file.close()
        self._files.clear()

    def __getstate__(self) -> dict[str, Any]:
        # Open files cannot be sent to the workers of a loader.
        return {**self.__dict__, "_files": {}}

    def _read(self, file: Path, manifests: dict[Path, list[dict[str, Any]]]) -> list[Demonstration]:
        """The demonstrations of a file. Raises ValueError if they are not those of its manifest."""
        try:
            data = self._open(file)["data"]
            names = [*data]
        except (OSError, KeyError, TypeError) as error:
            raise ValueError(f"{file}: no recording of softvt: {str(error).strip(chr(34))}") from error
        if other := [name for name in names if not re.fullmatch(r"demo_\d+", name)]:
            raise ValueError(f"{file}: data/{other[0]}: not a demonstration, which has a name such as demo_0")
        lines = _manifest_lines(file, manifests)
        if lines is not None:
            if missing := lines.keys() - names:
                raise ValueError(f"{file}: no data/{min(missing)}, which the manifest names; {_CHECK}")
            if unknown := names - lines.keys():
                raise ValueError(f"{file}: data/{min(unknown)} is not in the manifest; {_CHECK}")
        return [_demonstration(file, data, name, {} if lines is None else lines[name]) for name in sorted(names, key=_number)]

    def _require_streams(self, demo: Demonstration) -> None:
        """Raises ValueError for a demonstration without one of the streams, or with one of another length."""
        group, where = self._group(demo), f"{demo.file}: data/{demo.name}"
        joints = [JOINT_ACTIONS] if self._control == "joints" else []
        for stream in [*self._streams.values(), self._actions, *joints]:
            if stream not in group:
                if stream == JOINT_ACTIONS:
                    raise ValueError(f"{where} has no {stream}: an earlier version of softvt recorded it; record it again")
                if stream.removeprefix("obs/") in ACTIONS.values():
                    raise ValueError(f"keys: {stream.removeprefix('obs/')!r} is no observation; an item has `actions` in any case")
                folder = stream.rpartition("/")[0]
                folder = folder if folder in group else "obs"
                have = ", ".join(sorted(group[folder]))
                raise ValueError(f"{where} has no stream {stream}; {folder} has {have}")
            if below := _streams_below(group, stream):
                raise ValueError(f"{where}/{stream} is a group; give one of its streams: {', '.join(below)}")
            if group[stream].shape[:1] != (demo.steps,):
                raise ValueError(
                    f"{where}/{stream} has the shape {group[stream].shape}, and the demonstration {demo.steps} steps; {_CHECK}"
                )

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
    """The HDF5 files of a recording, in order of their names. Raises ValueError without any, or if the recording is not complete."""
    if path.is_file():
        return [path]
    if _is_interrupted(path):
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


def _demonstration(file: Path, data: Any, name: str, line: Mapping[str, Any]) -> Demonstration:
    """A demonstration of a file with its line of the manifest. Raises ValueError if they, or number and length of its actions, contradict."""
    group, where = data[name], f"{file}: data/{name}"
    texts_of, numbers_of = ("task_suite", "language"), ("num_samples", "task_id", "attempt", "success")
    if missing := [key for key in (*texts_of, *numbers_of) if key not in group.attrs]:
        raise ValueError(f"{where} has no attribute {missing[0]}; {_CHECK}")
    if "actions" not in group:
        raise ValueError(f"{where} has no actions; {_CHECK}")
    text = {key: _text(group.attrs[key]) for key in texts_of}
    numbers = {key: int(group.attrs[key]) for key in numbers_of}
    hashed = {"state_hash": _text(group.attrs.get("state_hash", ""))}
    steps = len(group["actions"])
    if numbers["num_samples"] != steps:
        raise ValueError(f"{where}: num_samples is {numbers['num_samples']}, and actions has {steps} steps; {_CHECK}")
    if steps == 0:
        raise ValueError(f"{where} has no step; {_CHECK}")
    for key, found in {**text, **numbers, **hashed}.items():
        if key in _COMPARED and key in line and line[key] != found:
            raise ValueError(f"{where}: {key} is {found!r}, and {line[key]!r} in the manifest; {_CHECK}")
    return Demonstration(
        file, name, steps, text["task_suite"], numbers["task_id"], text["language"], numbers["attempt"], bool(numbers["success"])
    )


def _chosen(path: object, recorded: list[Demonstration], suite: str | None, tasks: set[int] | None) -> list[Demonstration]:
    """The demonstrations of a suite and of tasks. Raises ValueError without any, or if tasks of several suites have these numbers."""
    suites = sorted({demo.suite for demo in recorded})
    if suite is not None and suite not in suites:
        raise ValueError(f"{path}: no demonstration of suite {suite!r}; the recording has those of {', '.join(suites)}")
    of_suite = [demo for demo in recorded if suite in (None, demo.suite)]
    if tasks is None:
        return of_suite
    if suite is None and len(suites) > 1:
        raise ValueError(
            f"{path}: task={_listed(tasks)}: the recording has demonstrations of the suites {', '.join(suites)}; give suite as well"
        )
    known = {demo.task for demo in of_suite}
    if missing := tasks - known:
        raise ValueError(f"{path}: no demonstration of task {_listed(missing)}; the recording has those of task {_listed(known)}")
    return [demo for demo in of_suite if demo.task in tasks]


def _recorded_gripper(files: Iterable[Path]) -> str:
    """The grip code of the recordings that HDF5 files belong to. Raises ValueError if they differ in it."""
    codes: dict[str | None, Path] = {}
    for file in files:
        codes.setdefault(_card_gripper(file), file)
    fix = "give gripper, such as gripper='continuous'"
    if len(codes) > 1:
        found = "; ".join(f"{file}: {'no dataset.json' if code is None else code}" for code, file in codes.items())
        raise ValueError(f"the files differ in their grip code ({found}); {fix}")
    code, file = next(iter(codes.items()))
    if code is None:
        raise ValueError(f"{file}: no dataset.json of its recording, which has the grip code; {fix}, or the folder of the recording")
    return code


def _card_gripper(file: Path) -> str | None:
    """The grip code of the recording that an HDF5 file belongs to; None without its card."""
    for folder in file.resolve().parents[:2]:
        card = folder / "dataset.json"
        if card.is_file():
            contents = _card(card)
            if contents is None:
                raise ValueError(f"{card}: not the file that softvt record wrote: no JSON object; give gripper to do without it")
            gripper = contents.get("gripper") or "continuous"
            require_one_of(f"{card}: gripper", gripper, [*ACTIONS])
            return str(gripper)
    return None


def _card(file: Path) -> dict[str, Any] | None:
    """Contents of `dataset.json`; None if it is missing or not as softvt wrote it."""
    try:
        contents = json.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    return contents if isinstance(contents, dict) else None


def _streams_below(demo: Any, name: str) -> list[str]:
    """Paths in the group of a demonstration of the streams below a name; none for a stream."""
    import h5py

    found: list[str] = []
    if isinstance(demo[name], h5py.Group):
        demo[name].visititems(lambda _, item: found.append(item.name) if isinstance(item, h5py.Dataset) else None)
    return sorted(path.removeprefix(f"{demo.name}/") for path in found)


def _manifest_files(manifest: Path) -> set[str]:
    """The HDF5 files that a manifest names."""
    return {line["hdf5_path"] for line in _lines(manifest)}


def _manifest_lines(file: Path, known: dict[Path, list[dict[str, Any]]]) -> dict[str, dict[str, Any]] | None:
    """Lines of the manifest about an HDF5 file, by the names of its demonstrations; None without a complete manifest that names the file. `known`
    keeps the lines of manifests."""
    for folder in dict.fromkeys([*file.absolute().parents[:2], *file.resolve().parents[:2]]):
        manifest = folder / "manifest.jsonl"
        if not manifest.is_file() or _is_interrupted(folder):
            continue
        if manifest not in known:
            known[manifest] = _lines(manifest)
            _refuse_merged(manifest, known[manifest])
        names = {name for name in {line["hdf5_path"] for line in known[manifest]} if (folder / name).resolve() == file.resolve()}
        if names:
            found: dict[str, dict[str, Any]] = {}
            for line in known[manifest]:
                if line["hdf5_path"] in names and found.setdefault(f"demo_{line['demo_id']}", line) is not line:
                    raise ValueError(f"{manifest}: demo_{line['demo_id']} of {line['hdf5_path']} has two lines; {_CHECK}")
            return found
    return None


def _refuse_merged(manifest: Path, lines: list[dict[str, Any]]) -> None:
    """Raises ValueError for a manifest with lines of several recordings, whose grip codes may differ."""
    tasks = (_card(manifest.with_name("dataset.json")) or {}).get("tasks")
    known = {(task.get("suite"), task.get("task")) for task in tasks} if isinstance(tasks, list) else None
    fix = "files of several recordings are in one folder; give each recording by itself, or record their tasks together"
    for number, line in enumerate(lines, 1):
        place = (line.get("suite"), line.get("task_id"))
        if known is not None and place not in known:
            raise ValueError(f"{manifest}:{number}: {place[0]} task {place[1]}, which dataset.json does not have: {fix}; {_CHECK}")
        if line.get("seed") != lines[0].get("seed"):
            raise ValueError(
                f"{manifest}:{number}: seed {line.get('seed')}, and the first line has {lines[0].get('seed')}: {fix}; {_CHECK}"
            )


def _is_interrupted(folder: Path) -> bool:
    """True if the recording in a folder is not complete: softvt writes the first file at its start, and the second at its end."""
    return (folder / "recording.json").is_file() and not (folder / "dataset.json").is_file()


def _lines(manifest: Path) -> list[dict[str, Any]]:
    """Lines of a manifest. Raises ValueError for one that names no demonstration."""
    found = []
    for number, text in enumerate(manifest.read_text(encoding="utf-8").splitlines(), 1):
        try:
            line = json.loads(text)
            found.append({**line, "hdf5_path": str(line["hdf5_path"]), "demo_id": int(line["demo_id"])})
        except (ValueError, KeyError, TypeError) as error:
            raise ValueError(f"{manifest}:{number}: not a line of a manifest: {error}") from error
    return found


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


def _statistics(steps: np.ndarray) -> dict[str, np.ndarray]:
    low, high = np.quantile(steps, [0.01, 0.99], axis=0)
    found = {"mean": steps.mean(0), "std": steps.std(0), "min": steps.min(0), "max": steps.max(0), "q01": low, "q99": high}
    return {name: np.asarray(value, dtype=np.float32) for name, value in found.items()}


def _number(name: str) -> int:
    return int(name.removeprefix("demo_"))


def _text(value: Any) -> str:
    return value.decode() if isinstance(value, bytes) else str(value)
