"""Reads an RLDS export and compares it with the recording's HDF5 files: features, every number, image, flag and text. Numbers are
compared with a LeRobot export (v2.1) with the same options too. By default the records are decoded with protobuf, and their checksums
computed by google-crc32c; with --tfds, TensorFlow Datasets reads them."""

import argparse
import io
import json
import math
import pathlib
import struct

import h5py
import numpy as np
import pyarrow.parquet as pq
from lerobot import STREAMS, markers, mosaic, sources, stacked
from PIL import Image

CAMERAS = {"image": "agentview_rgb", "wrist_image": "eye_in_hand_rgb"}
FLAGS = ("is_first", "is_last", "is_terminal")


def expected_features(length, has_torques):
    """Types and shapes of all features by their paths, for vectors of that length."""
    observation = {name: ("uint8", (224, 224, 3)) for name in (*CAMERAS, "tactile_image")}
    observation |= {"state": ("float32", (length,)), "joint_state": ("float32", (7,)), "tactile_marker_motion": ("float32", (3, 198, 2))}
    if has_torques:
        observation["joint_torques"] = ("float32", (7,))
    step = {"action": ("float32", (length,)), "discount": ("float32", ()), "reward": ("float32", ())}
    step |= {name: ("bool", ()) for name in FLAGS} | {"language_instruction": ("text", ())}
    metadata = {name: ("text", ()) for name in ("file_path", "suite", "asset_name")}
    metadata |= {name: ("int64", ()) for name in ("task_id", "episode", "demo_id")} | {"success": ("bool", ())}
    paths = {f"steps/observation/{name}": kind for name, kind in observation.items()}
    paths |= {f"steps/{name}": kind for name, kind in step.items()}
    return paths | {f"episode_metadata/{name}": kind for name, kind in metadata.items()}


def declared_features(feature, path=""):
    """The same of features.json."""
    if "sequence" in feature:
        assert feature["sequence"]["length"] == "-1"
        return declared_features(feature["sequence"]["feature"], path)
    if "featuresDict" in feature:
        entries = feature["featuresDict"]["features"].items()
        return {key: kind for name, child in entries for key, kind in declared_features(child, f"{path}/{name}").items()}
    assert feature["description"], path
    if "text" in feature:
        return {path[1:]: ("text", ())}
    content = feature.get("image") or feature["tensor"]
    assert content.get("encodingFormat", "png") == "png" and content.get("encoding", "none") == "none"
    return {path[1:]: (content["dtype"], tuple(map(int, content["shape"].get("dimensions", []))))}


def example_class():
    """The message tf.train.Example."""
    from google.protobuf import descriptor_pb2, descriptor_pool, message_factory

    types = descriptor_pb2.FieldDescriptorProto
    file = descriptor_pb2.FileDescriptorProto(name="example.proto", package="tf", syntax="proto3")

    def message(name, *fields, owner=None):
        added = (owner.nested_type if owner else file.message_type).add(name=name)
        for number, (field, label, kind, type_name) in enumerate(fields, 1):
            added.field.add(name=field, number=number, label=label, type=kind, type_name=type_name)
        return added

    one, many = types.LABEL_OPTIONAL, types.LABEL_REPEATED
    message("BytesList", ("value", many, types.TYPE_BYTES, None))
    message("FloatList", ("value", many, types.TYPE_FLOAT, None))
    message("Int64List", ("value", many, types.TYPE_INT64, None))
    lists = (("bytes", ".tf.BytesList"), ("float", ".tf.FloatList"), ("int64", ".tf.Int64List"))
    feature = message("Feature", *((f"{name}_list", one, types.TYPE_MESSAGE, type_name) for name, type_name in lists))
    feature.oneof_decl.add(name="kind")
    for field in feature.field:
        field.oneof_index = 0
    features = message("Features", ("feature", many, types.TYPE_MESSAGE, ".tf.Features.FeatureEntry"))
    entry = (("key", one, types.TYPE_STRING, None), ("value", one, types.TYPE_MESSAGE, ".tf.Feature"))
    message("FeatureEntry", *entry, owner=features).options.map_entry = True
    message("Example", ("features", one, types.TYPE_MESSAGE, ".tf.Features"))
    pool = descriptor_pool.DescriptorPool()
    pool.Add(file)
    return message_factory.GetMessageClass(pool.FindMessageTypeByName("tf.Example"))


def records(path):
    """The records of a TFRecord file, whose checksums are verified."""
    import google_crc32c

    def masked(data):
        checksum = google_crc32c.value(data)
        return ((checksum >> 15 | checksum << 17) + 0xA282EAD8) % 2**32

    with path.open("rb") as file:
        while length := file.read(8):
            assert struct.unpack("<I", file.read(4))[0] == masked(length), path
            record = file.read(*struct.unpack("<Q", length))
            assert struct.unpack("<I", file.read(4))[0] == masked(record), path
            yield record


def pixels(png):
    picture = Image.open(io.BytesIO(png))
    assert (picture.format, picture.mode) == ("PNG", "RGB")
    return np.asarray(picture)


def decoded(feature, kind, is_step):
    """Values of a feature of tf.train.Example as an array, or as texts."""
    dtype, shape = kind
    name = {"text": "bytes_list", "uint8": "bytes_list", "float32": "float_list"}.get(dtype, "int64_list")
    assert feature.WhichOneof("kind") == name, (name, feature.WhichOneof("kind"))
    values = getattr(feature, name).value
    if dtype == "text":
        values = [text.decode() for text in values]
    elif dtype == "uint8":
        values = np.stack([pixels(png) for png in values])
        assert values.shape[1:] == shape, values.shape
    else:
        values = np.array(values, dtype=dtype)
        assert len(values) % math.prod(shape) == 0, (len(values), shape)
        values = values.reshape(-1, *shape)
    assert is_step or len(values) == 1
    return values if is_step else values[0]


def read_records(folder, info, features):
    """Episodes, in the order of the files: values by the paths of their features."""
    message, (split,) = example_class(), info["splits"]
    lengths = [int(length) for length in split["shardLengths"]]
    paths = [folder / f"{info['name']}-train.tfrecord-{i:05}-of-{len(lengths):05}" for i in range(len(lengths))]
    assert sorted(folder.glob("*tfrecord*")) == paths, "no other files"
    found, sizes = [], []
    for path, length in zip(paths, lengths):
        shard = list(records(path))
        assert len(shard) == length and (length == 1 or path.stat().st_size <= 200 * 2**20), path
        for record in shard:
            example = message.FromString(record).features.feature
            assert set(example) == set(features), set(example) ^ set(features)
            found.append({path: decoded(example[path], kind, path.startswith("steps/")) for path, kind in features.items()})
        sizes += map(len, shard)
    assert int(split["numBytes"]) == sum(sizes)
    return found


def flat(tree, path=""):
    """Leaves of nested dictionaries by their paths."""
    if not isinstance(tree, dict):
        return {path[1:]: tree}
    return {key: leaf for name, child in tree.items() for key, leaf in flat(child, f"{path}/{name}").items()}


def declared_classes(feature, path=""):
    """Features of TensorFlow Datasets by their paths."""
    feature = getattr(feature, "feature", feature)  # of the steps
    if not hasattr(feature, "items"):
        return {path[1:]: feature}
    return {key: leaf for name, child in feature.items() for key, leaf in declared_classes(child, f"{path}/{name}").items()}


def read_tfds(folder, info, features):
    """The same, as TensorFlow Datasets decodes them."""
    import tensorflow as tf
    import tensorflow_datasets as tfds

    builder = tfds.builder_from_directory(folder)
    assert (builder.name, str(builder.version)) == (info["name"], info["version"])
    assert tfds.builder(info["name"], data_dir=folder.parents[1]).info.features.keys() == builder.info.features.keys()
    declared = declared_classes(builder.info.features)
    assert set(declared) == set(features)
    for path, (dtype, shape) in features.items():
        is_text = isinstance(declared[path], tfds.features.Text)
        assert (dtype == "text") == is_text and declared[path].shape == shape, path
        assert is_text or declared[path].np_dtype == np.dtype(dtype), path

    def plain(values, dtype):
        if dtype == "text":
            return [text.decode() for text in values]
        return np.stack(values)

    # OpenVLA and Octo skip the decoding of steps, and decode images later.
    in_order = tfds.ReadConfig(interleave_cycle_length=1)
    episodes = builder.as_dataset(split="train", read_config=in_order)
    raw = builder.as_dataset(split="train", read_config=in_order, decoders={"steps": tfds.decode.SkipDecoding()})
    found = []
    for episode, batch in zip(episodes, raw, strict=True):
        steps = [flat(step) for step in episode.pop("steps").as_numpy_iterator()]
        batch = {path: values.numpy() for path, values in flat(batch["steps"]).items()}
        values = {f"steps/{path}": plain([step[path] for step in steps], features[f"steps/{path}"][0]) for path in steps[0]}
        for path, whole in batch.items():
            dtype, _ = features[f"steps/{path}"]
            whole = (
                [tf.io.decode_image(png, expand_animations=False, dtype=tf.uint8).numpy() for png in whole] if dtype == "uint8" else whole
            )
            assert np.array_equal(plain(whole, dtype), values[f"steps/{path}"]), path
        for path, value in flat(episode).items():
            value = value.numpy()
            values[path] = value.decode() if features[path][0] == "text" else value
        found.append(values)
    assert len(found) == builder.info.splits["train"].num_examples
    return found


def vectors(demo, gripper, control):
    """States and actions."""
    finger, actions = 0.5 * demo["obs/gripper_width_sensed"][:], demo[STREAMS[gripper]][:]
    if control == "pose":
        return np.hstack([demo["obs/state"][:, :6], finger]), actions
    return np.hstack([demo["obs/arm_joint_pos"][:], finger]), np.hstack([demo["actions_joints"][:], actions[:, 6:]])


def compare(episode, entry, demo, table, args):
    """An episode against its demonstration, and against the rows of the LeRobot export."""
    steps = demo.attrs["num_samples"]
    state, action = vectors(demo, args.gripper, args.control)
    last = np.arange(steps) == steps - 1
    numbers = {
        "observation/state": state,
        "observation/joint_state": demo["obs/arm_joint_pos"][:],
        "observation/tactile_marker_motion": markers(demo),
        "action": action,
        "discount": np.ones(steps),
        "reward": demo["rewards"][:],
    }
    if "obs/joint_torques" in demo:
        numbers["observation/joint_torques"] = demo["obs/joint_torques"][:]
    for path, values in numbers.items():
        found = episode[f"steps/{path}"]
        assert found.dtype == np.float32 and np.array_equal(found, values.astype(np.float32)), path
    rows = {"observation/state": "state", "action": "actions", "observation/tactile_marker_motion": "tactile_marker_motion"}
    for path, column in rows.items():
        assert np.array_equal(episode[f"steps/{path}"], stacked(table[column])), path
    assert np.array_equal(demo["dones"][:].astype(bool), last)
    for name, flags in zip(FLAGS, (np.arange(steps) == 0, last, last)):
        assert np.array_equal(episode[f"steps/{name}"], flags), name
    assert episode["steps/language_instruction"] == [entry["language"]] * steps
    for name, stream in CAMERAS.items():
        assert np.array_equal(episode[f"steps/observation/{name}"], demo["obs/" + stream][:]), name
    mosaics = episode["steps/observation/tactile_image"]
    for step in range(steps):
        assert np.array_equal(mosaics[step], pixels(table["tactile_image"][step].as_py()["bytes"])), step
    for step in sorted({0, 1, steps // 2, steps - 1}):
        apart = np.abs(mosaics[step].astype(int) - mosaic(demo, step))
        assert apart.max() <= 2 and apart.mean() < 0.3, (step, apart.max(), apart.mean())
    names = {name: name for name in ("suite", "task_id", "episode", "demo_id", "asset_name", "success")}
    for name, key in ({"file_path": "hdf5_path"} | names).items():
        assert episode[f"episode_metadata/{name}"] == entry[key], name
    return steps


def main(args):
    (folder,) = args.out.glob("*/1.0.0")
    info = json.loads((folder / "dataset_info.json").read_text())
    assert info["name"] == folder.parent.name
    features = declared_features(json.loads((folder / "features.json").read_text()))
    entries = [entry for entry, _ in sources(args.data)]
    with h5py.File(args.data / entries[0]["hdf5_path"]) as file:
        has_torques = "obs/joint_torques" in file[f"data/demo_{entries[0]['demo_id']}"]
    expected = expected_features({"pose": 7, "joints": 8}[args.control], has_torques)
    assert features == expected, set(features.items()) ^ set(expected.items())
    episodes = (read_tfds if args.tfds else read_records)(folder, info, features)
    frames = 0
    for index, ((entry, demo), episode) in enumerate(zip(sources(args.data), episodes, strict=True)):
        table = pq.read_table(args.lerobot / f"data/chunk-000/episode_{index:06d}.parquet")
        frames += compare(episode, entry, demo, table, args)
    stated = json.loads((folder / "softvt.json").read_text())
    assert stated == json.loads((args.lerobot / "meta/softvt.json").read_text())
    assert (stated["control"], stated["gripper"]) == (args.control, args.gripper)
    assert (args.out / "README.md").read_text().startswith("---\nlicense: apache-2.0")
    assert not list(args.out.rglob(".*")), "nothing but the dataset"
    print(f"{args.out.name}: RLDS, {frames} steps of {len(episodes)} episodes as they should be")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("data", type=pathlib.Path)
    parser.add_argument("out", type=pathlib.Path)
    parser.add_argument("lerobot", type=pathlib.Path)
    parser.add_argument("gripper", choices=STREAMS)
    parser.add_argument("control", choices=("pose", "joints"))
    parser.add_argument("--tfds", action="store_true")
    main(parser.parse_args())
