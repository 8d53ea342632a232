"""Reads what softvt exported of a recording with pyarrow, pandas and Pillow, and compares it with the recording's HDF5 files:
the schema that LeRobot expects, every row, and every figure of the statistics, worked out once more by numpy."""

import io
import json
import pathlib
import sys

import h5py
import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
from PIL import Image

PICTURES = {"image": "agentview_rgb", "wrist_image": "eye_in_hand_rgb", "tactile_image": None}
ORDER = [*PICTURES, "state", "actions", "tactile_marker_motion", "timestamp", "frame_index", "episode_index", "index", "task_index"]
STREAMS = {"continuous": "actions", "binary": "actions_binary", "two-width": "actions_two_width", "force": "actions_force"}
# The keys of v3.0 are those that LeRobot's own policies look for.
KEYS = {
    "image": "observation.images.third_person",
    "wrist_image": "observation.images.wrist",
    "tactile_image": "observation.images.tactile_image",
    "state": "observation.state",
    "actions": "action",
    "tactile_marker_motion": "observation.tactile_marker_motion",
}
QUANTILES = {"q01": 0.01, "q10": 0.1, "q50": 0.5, "q90": 0.9, "q99": 0.99}
PLAIN = {"timestamp": "float32", "frame_index": "int64", "episode_index": "int64", "index": "int64", "task_index": "int64"}


def key(name, version):
    """The key of a feature in a version."""
    return KEYS.get(name, name) if version == "v3.0" else name


def order(version):
    return [key(name, version) for name in ORDER]


def schema(found, version):
    picture = pa.struct([("bytes", pa.binary()), ("path", pa.string())])
    numbers = pa.list_(pa.field("element", pa.float32()))
    nested = pa.list_(pa.field("element", pa.list_(pa.field("element", numbers))))
    types = {name: picture for name in PICTURES} | {"state": numbers, "actions": numbers, "tactile_marker_motion": nested}
    types |= {name: getattr(pa, kind)() for name, kind in PLAIN.items()}
    assert found.names == order(version), found.names
    for name, kind in types.items():
        field = found.field(key(name, version))
        assert field.type == kind and field.nullable, (name, field)
    known = json.loads(found.metadata[b"huggingface"])["info"]["features"]
    assert list(known) == order(version)
    known = dict(zip(ORDER, known.values()))
    assert known["image"] == {"_type": "Image"}
    assert known["state"] == {"feature": {"dtype": "float32", "_type": "Value"}, "length": 7, "_type": "Sequence"}
    assert known["tactile_marker_motion"] == {"shape": [3, 198, 2], "dtype": "float32", "_type": "Array3D"}
    assert known["index"] == {"dtype": "int64", "_type": "Value"}


def info(root, version, episodes, frames, tasks):
    found = json.loads((root / "meta/info.json").read_text())
    features = found.pop("features")
    expected = {
        "codebase_version": version,
        "robot_type": "franka",
        "total_episodes": episodes,
        "total_frames": frames,
        "total_tasks": tasks,
        "chunks_size": 1000,
        "fps": 20,
        "splits": {"train": f"0:{episodes}"},
        "video_path": None,
    }
    expected |= {
        "v2.1": {"total_videos": 0, "total_chunks": 1, "data_path": "data/chunk-{episode_chunk:03d}/episode_{episode_index:06d}.parquet"},
        "v3.0": {
            "data_files_size_in_mb": 100,
            "video_files_size_in_mb": 200,
            "data_path": "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet",
        },
    }[version]
    assert found == expected, found
    assert list(features) == order(version)
    features = dict(zip(ORDER, features.values()))
    for name in PICTURES:
        assert features[name] == {"dtype": "image", "shape": [224, 224, 3], "names": ["height", "width", "channel"]}
    for name, shape in {"state": [7], "actions": [7], "tactile_marker_motion": [3, 198, 2]}.items():
        assert (features[name]["dtype"], features[name]["shape"]) == ("float32", shape), features[name]
    assert len(features["state"]["names"]) == len(features["actions"]["names"]) == 7
    assert len(features["tactile_marker_motion"]["names"]) == 3
    for name, dtype in PLAIN.items():
        assert features[name] == {"dtype": dtype, "shape": [1], "names": None}
    return found


def stacked(column):
    return np.array(column.to_pylist(), dtype=np.float32)


def decoded(column, pattern):
    """All pictures of a column, (rows, height, width, 3)."""
    pictures = []
    for row, cell in enumerate(column.to_pylist()):
        assert cell["path"] == pattern.format(row), cell["path"]
        picture = Image.open(io.BytesIO(cell["bytes"]))
        assert (picture.format, picture.mode) == ("PNG", "RGB")
        pictures.append(np.asarray(picture))
    return np.stack(pictures)


def mosaic(demo, step):
    """The 4 x 4 mosaic by Pillow's own scaling, which rounds a little differently."""
    sheet = np.zeros((224, 224, 3), np.uint8)
    for finger, side in enumerate(("left", "right")):
        pictures = demo[f"obs/gsmini_{side}_tactile_rgb"]
        for place in range(8):
            small = Image.fromarray(pictures[max(0, step - 7 + place)]).resize((56, 56), Image.Resampling.BILINEAR)
            row, column = 2 * finger + place // 4, place % 4
            sheet[56 * row : 56 * row + 56, 56 * column : 56 * column + 56] = small
    return sheet


def markers(demo):
    stored = demo["obs/gripper_marker_motion"][:]
    steps = len(stored)
    both = stored.transpose(0, 2, 1, 3, 4).reshape(steps, 2, 198, 2)
    rows = [[both[max(0, t - 7), 0], both[max(0, t - 1), 1], both[t, 1]] for t in range(steps)]
    return np.array(rows, dtype=np.float32)


def compare(table, demo, numbers, pattern, gripper):
    """Rows of an episode against its demonstration; what they hold, as arrays."""
    episode, first, task = numbers
    steps = table.num_rows
    assert steps == demo.attrs["num_samples"]
    held = {name: table[name].to_numpy() for name in PLAIN}
    assert (held["timestamp"] == (np.arange(steps) / 20).astype(np.float32)).all()
    assert (held["frame_index"] == np.arange(steps)).all() and (held["index"] == first + np.arange(steps)).all()
    assert (held["episode_index"] == episode).all() and (held["task_index"] == task).all()
    for name in ("state", "actions", "tactile_marker_motion"):
        held[name] = stacked(table[name])
    state = np.hstack([demo["obs/state"][:, :6], 0.5 * demo["obs/gripper_width_sensed"][:]])
    assert (held["state"] == state.astype(np.float32)).all()
    assert (held["actions"] == demo[STREAMS[gripper]][:].astype(np.float32)).all()
    assert (held["tactile_marker_motion"] == markers(demo)).all()
    for name, stream in PICTURES.items():
        held[name] = decoded(table[name], pattern)
        if stream:
            assert (held[name] == demo["obs/" + stream][:]).all(), name
    for step in sorted({0, 1, steps // 2, steps - 1}):
        apart = np.abs(held["tactile_image"][step].astype(int) - mosaic(demo, step))
        assert apart.max() <= 2 and apart.mean() < 0.3, (step, apart.max(), apart.mean())
    return held


def picture_figures(values, version):
    """The figures of each colour in 0..1, from the counts of its 256 levels: np.quantile would sort all pixels."""
    levels, stored = np.arange(256) / 255, {}
    for counts in (np.bincount(values[..., colour].ravel(), minlength=256) for colour in range(3)):
        total, held = counts.sum(), levels[counts > 0]
        mean = counts @ levels / total
        found = {"min": held[0], "max": held[-1], "mean": mean, "std": np.sqrt(counts @ (levels - mean) ** 2 / total)}
        if version == "v3.0":
            for figure, quantile in QUANTILES.items():
                place, up_to = quantile * (total - 1), np.cumsum(counts)
                below, above = (levels[np.searchsorted(up_to, rank, side="right")] for rank in (np.floor(place), np.ceil(place)))
                found[figure] = below + (above - below) * (place - np.floor(place))
        for figure, number in found.items():
            stored.setdefault(figure, []).append(number)
    return {figure: np.array(numbers).reshape(3, 1, 1) for figure, numbers in stored.items()}


def figures(name, values, version):
    """What numpy says of a feature."""
    steps = len(values)
    if name in PICTURES:
        return picture_figures(values, version) | {"count": np.array([steps])}
    if name == "tactile_marker_motion" and version == "v3.0":
        values, shape = values.reshape(-1, 2).astype(float), (2,)
    else:
        shape = values.shape[1:] or (1,)
        values = values.reshape(steps, -1).astype(float)
    stored = {"min": values.min(0), "max": values.max(0), "mean": values.mean(0), "std": values.std(0)}
    if version == "v3.0":
        stored |= dict(zip(QUANTILES, np.quantile(values, list(QUANTILES.values()), axis=0)))
    return {figure: numbers.reshape(shape) for figure, numbers in stored.items()} | {"count": np.array([steps])}


def same(name, stored, values, version):
    expected = figures(name, values, version)
    assert set(stored) == set(expected), (name, set(stored))
    for figure, numbers in expected.items():
        found = np.array(stored[figure], dtype=float)
        assert found.shape == numbers.shape, (name, figure, found.shape)
        # Single precision in v2.1; places of markers are counted to 0.01 px for their quantiles.
        coarse = name == "tactile_marker_motion" and figure in QUANTILES
        close = np.allclose(found, numbers, rtol=1e-6 if version == "v2.1" else 1e-9, atol=0.0051 if coarse else 1e-6)
        assert close, (name, figure, found, numbers)


def sources(data):
    """Each demonstration that should be an episode, with its prompt."""
    for line in (data / "manifest.jsonl").read_text().splitlines():
        entry = json.loads(line)
        with h5py.File(data / entry["hdf5_path"]) as file:
            yield entry, file[f"data/demo_{entry['demo_id']}"]


def version_21(data, root, gripper):
    prompts, first, number = [], 0, 0
    episodes = [json.loads(line) for line in (root / "meta/episodes.jsonl").read_text().splitlines()]
    stats = [json.loads(line) for line in (root / "meta/episodes_stats.jsonl").read_text().splitlines()]
    for number, (entry, demo) in enumerate(sources(data)):
        if entry["language"] not in prompts:
            prompts.append(entry["language"])
        path = root / f"data/chunk-000/episode_{number:06d}.parquet"
        schema(pq.read_schema(path), "v2.1")
        table = pq.read_table(path)
        held = compare(table, demo, (number, first, prompts.index(entry["language"])), "frame_{:06d}.png", gripper)
        assert episodes[number] == {"episode_index": number, "tasks": [entry["language"]], "length": table.num_rows}
        assert stats[number]["episode_index"] == number and set(stats[number]["stats"]) == set(ORDER)
        for name, stored in stats[number]["stats"].items():
            same(name, stored, held[name], "v2.1")
        first += table.num_rows
    assert len(episodes) == len(stats) == number + 1
    tasks = [json.loads(line) for line in (root / "meta/tasks.jsonl").read_text().splitlines()]
    assert tasks == [{"task_index": i, "task": prompt} for i, prompt in enumerate(prompts)]
    info(root, "v2.1", number + 1, first, len(prompts))
    return first


def version_30(data, root, gripper):
    prompts, first, number, whole = [], 0, 0, {name: [] for name in ORDER}
    episodes = pq.read_table(root / "meta/episodes/chunk-000/file-000.parquet").to_pylist()
    paths = sorted((root / "data").glob("*/*.parquet"))
    files = [pq.ParquetFile(path) for path in paths]
    groups = [(at, group) for at, file in enumerate(files) for group in range(file.num_row_groups)]
    assert all(path.stat().st_size <= 100 * 2**20 for path in paths)
    for number, (entry, demo) in enumerate(sources(data)):
        if entry["language"] not in prompts:
            prompts.append(entry["language"])
        at, group = groups[number]
        schema(files[at].schema_arrow, "v3.0")
        table = files[at].read_row_group(group).rename_columns(ORDER)
        bounds = files[at].metadata.row_group(group).column(ORDER.index("episode_index") + 3).statistics
        assert (bounds.min, bounds.max) == (number, number), "one episode a group, and it says which"
        held = compare(table, demo, (number, first, prompts.index(entry["language"])), "frame-{:06d}.png", gripper)
        stored, steps = episodes[number], table.num_rows
        expected = {
            "episode_index": number,
            "tasks": [entry["language"]],
            "length": steps,
            "data/chunk_index": 0,
            "data/file_index": at,
            "dataset_from_index": first,
            "dataset_to_index": first + steps,
            "meta/episodes/chunk_index": 0,
            "meta/episodes/file_index": 0,
        }
        assert expected == {key: value for key, value in stored.items() if not key.startswith("stats/")}, stored
        for name in ORDER:
            prefix = f"stats/{key(name, 'v3.0')}/"
            figures = {key.removeprefix(prefix): value for key, value in stored.items() if key.startswith(prefix)}
            same(name, figures, held[name], "v3.0")
            whole[name].append(held[name])
        first += steps
    assert len(groups) == len(episodes) == number + 1
    stats = json.loads((root / "meta/stats.json").read_text())
    assert set(stats) == set(order("v3.0"))
    for name in ORDER:
        same(name, stats[key(name, "v3.0")], np.concatenate(whole[name]), "v3.0")
    tasks = pd.read_parquet(root / "meta/tasks.parquet")
    assert tasks.index.tolist() == prompts and tasks["task_index"].tolist() == list(range(len(prompts))), tasks
    assert tasks.columns.tolist() == ["task_index"] and tasks.index.name is None
    info(root, "v3.0", number + 1, first, len(prompts))
    return first


def main(data, root, gripper):
    data, root = pathlib.Path(data), pathlib.Path(root)
    version = json.loads((root / "meta/info.json").read_text())["codebase_version"]
    frames = {"v2.1": version_21, "v3.0": version_30}[version](data, root, gripper)
    assert (root / "README.md").read_text().startswith("---\nlicense: apache-2.0")
    assert not list(root.glob(".*")), "nothing but the data set"
    print(f"{root.name}: LeRobot {version}, {frames} frames as they should be")


if __name__ == "__main__":
    main(*sys.argv[1:])
