"""Reads a data set that softvt recorded with h5py, PyAV and numpy, and says what is not as docs/data.md says it is."""

import json
import pathlib
import sys

import av
import h5py
import numpy as np

SHAPES = {
    "actions": (7,),
    "actions_binary": (7,),
    "actions_joints": (7,),
    "rewards": (),
    "dones": (),
    "timestamps": (),
    "obs/eef_pose": (7,),
    "obs/state": (7,),
    "obs/arm_joint_pos": (7,),
    "obs/gripper_pos": (2,),
    "obs/gripper_width": (1,),
    "obs/gripper_width_sensed": (1,),
    "obs/gripper_close_norm": (1,),
    "obs/gripper_closure": (1,),
    "obs/agentview_pose": (7,),
    "obs/eye_in_hand_pose": (7,),
    "obs/gripper_marker_motion": (2, 2, 99, 2),
}
PICTURES = {
    "agentview_rgb": (224, 224, 3),
    "eye_in_hand_rgb": (224, 224, 3),
    "gsmini_left_tactile_rgb": (240, 320, 3),
    "gsmini_right_tactile_rgb": (240, 320, 3),
}
TEXTS = ["language", "task_suite", "asset_name", "metadata_json", "state_hash"]


def frames(path):
    with av.open(str(path)) as film:
        stream = film.streams.video[0]
        assert stream.codec_context.name == "h264" and stream.average_rate == 20, (path, stream.average_rate)
        return [frame.to_ndarray(format="rgb24") for frame in film.decode(stream)]


def turn(q):
    """Rotation matrix of a quaternion w x y z."""
    w, x, y, z = q
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def rodrigues(v):
    """Rotation matrix of a rotation vector."""
    angle = np.linalg.norm(v)
    x, y, z = v / max(angle, 1e-12)
    k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * k @ k


def numbers(demo, steps):
    for name, row in SHAPES.items():
        assert demo[name].shape == (steps, *row), (name, demo[name].shape)
    demo.visititems(lambda name, item: check_stream(name, item, steps) if isinstance(item, h5py.Dataset) else None)
    actions, binary = demo["actions"][:], demo["actions_binary"][:]
    assert (actions[:, :6] == binary[:, :6]).all() and set(np.unique(binary[:, 6])) <= {0.0, 1.0}
    assert (0 <= actions[:, 6]).all() and (actions[:, 6] <= 1).all() and binary[:, 6].any(), "it holds something at some time"
    pose, state = demo["obs/eef_pose"][:], demo["obs/state"][:]
    assert (pose[:, 3] >= 0).all() and np.allclose(np.linalg.norm(pose[:, 3:], axis=1), 1)
    assert np.allclose(pose[:, :3], state[:, :3])
    for q, v in zip(pose[:, 3:], state[:, 3:6]):
        assert np.allclose(turn(q), rodrigues(v), atol=1e-9)
    wrist, agent = demo["obs/eye_in_hand_pose"], demo["obs/agentview_pose"]
    in_tool = [turn(q).T @ (camera[:3] - tool[:3]) for q, camera, tool in zip(pose[:, 3:], wrist[:], pose)]
    assert np.allclose(in_tool, in_tool[0], atol=1e-6) and (agent[:] == agent[0]).all(), "one camera moves with the hand"
    for camera in wrist, agent:
        matrix = np.array(json.loads(camera.attrs["intrinsic"]))
        assert matrix[0, 0] == matrix[1, 1] > 100 and (matrix[:2, 2] == 112).all(), matrix
    width = demo["obs/gripper_width"][:, 0]
    assert np.allclose(width, demo["obs/gripper_pos"][:].sum(axis=1)) and np.allclose(state[:, 6], width / 2)
    sensed = demo["obs/gripper_width_sensed"][:, 0]
    assert np.allclose(sensed / 4e-4, np.round(sensed / 4e-4)) and np.abs(sensed - width).max() < 2e-3, "steps of 0.4 mm and an offset"
    assert np.allclose(demo["obs/gripper_close_norm"][:, 0], 1 - width / 0.08)
    assert np.allclose(demo["obs/gripper_closure"][1:, 0], actions[:-1, 6]), "what was commanded last"
    assert np.allclose(np.diff(demo["timestamps"][:]), 0.05)
    assert demo["rewards"][:].tolist() == [0.0] * (steps - 1) + [1.0] and demo["dones"][-1] == 1
    # A pose is followed: the tool ends near what was commanded a little before.
    assert np.abs(pose[10:, :3] - actions[:-10, :3]).max() < 0.25


def check_stream(name, item, steps):
    assert item.shape[0] == steps, (name, item.shape)
    if item.dtype.kind == "f":
        assert np.isfinite(item[:]).all(), name
    assert all(type(value) is str for value in item.attrs.values()), name


def hidden(demo, record):
    group = demo["privileged"]
    force = group["gripper_net_force"][:]
    assert np.array_equal(group["actions_with_force"][:], np.hstack([demo["actions"][:], force.reshape(len(force), 6)]))
    assert group["contact"][:].any() and not group["contact"][0].any()
    assert not group["dropped"][:].any()
    if record["soft"]:
        d = group["soft_extras/fem_deformation_rms"]
        assert d[0] == 0 and d[:].max() <= record["d_peak_v1"] + 1e-12 and d.attrs["metric_id"] == "fem_rms_rigid_aligned_bbox_pct_v1"
        nodes = group["states/deformable_object"]
        assert all(item["nodal_pos_w"].shape[2] == 3 for item in nodes.values())


def pictures(root, demo, entry, steps):
    for stream, file in entry["video_files"].items():
        film = frames(root / file)
        assert len(film) == steps, (file, len(film), steps)
        array = "obs/" + stream
        if array not in demo:
            continue
        still = demo[array]
        assert still.shape == (steps, *PICTURES[stream]) and still.dtype == np.uint8
        for at in {0, steps // 2, steps - 1}:
            noise = np.mean((film[at].astype(float) - still[at]) ** 2)
            psnr = 10 * np.log10(255**2 / noise)
            assert psnr > 36, (file, at, psnr)
            print(f"  {stream} picture {at}: {psnr:.1f} dB")


def main(root, *flags):
    root = pathlib.Path(root)
    card = json.loads((root / "dataset.json").read_text())
    entries = [json.loads(line) for line in (root / "manifest.jsonl").read_text().splitlines()]
    assert (root / "README.md").read_text().startswith("---\nlicense:")
    assert len(entries) == sum(task["demos"] for task in card["tasks"])
    assert not (root / ".parts").exists()
    for entry in entries:
        with h5py.File(root / entry["hdf5_path"]) as file:
            data = file["data"]
            env = json.loads(data.attrs["env_args"])
            assert env["type"] == 2 and env["env_name"] == "softvt" and env["env_kwargs"]["split"] == "demonstration"
            assert data.attrs["total"] == sum(demo.attrs["num_samples"] for demo in data.values())
            demo = data[f"demo_{entry['demo_id']}"]
            steps = int(demo.attrs["num_samples"])
            assert steps == entry["num_samples"] and demo.attrs["success"] == 1
            assert all(type(demo.attrs[name]) is str for name in TEXTS)
            record = json.loads(demo.attrs["metadata_json"])
            assert record["safety"] and record["goal"] and record["state_hash"] == entry["state_hash"]
            numbers(demo, steps)
            assert ("privileged" in demo) == card["privileged"]
            assert all((f"obs/{name}" in demo) == card["pictures"] for name in PICTURES)
            if card["privileged"]:
                hidden(demo, record)
            pictures(root, demo, entry, steps)
        preview = f"previews/{entry['suite']}_task{entry['task_id']}/demo_{entry['demo_id']}.mp4"
        assert len(frames(root / preview)) == steps
        print(f"{entry['suite']} task {entry['task_id']} demo {entry['demo_id']}: {steps} steps as they should be")


if __name__ == "__main__":
    main(*sys.argv[1:])
