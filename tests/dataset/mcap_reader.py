"""Reads the MCAP file of an episode with the readers of Foxglove, and compares it with the record of the episode."""

import io
import json
import math
import sys

import numpy as np
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory
from PIL import Image

path, records = sys.argv[1:]
record = json.loads(open(records).readline())
del record["record_sha256"]  # of the line
steps = record["steps"]
with open(path, "rb") as file:
    reader = make_reader(file, decoder_factories=[DecoderFactory()], validate_crcs=True)
    (attachment,) = reader.iter_attachments()
    assert json.loads(attachment.data) == record
    messages = {}
    for schema, channel, message, decoded in reader.iter_decoded_messages():
        assert schema.encoding == "protobuf"
        messages.setdefault(channel.topic, []).append((message.log_time, decoded))

every_step = ["/tf", "/joints", "/gripper", "/deformation", "/camera/third_person", "/camera/wrist/calibration"]
every_step += ["/tactile/left", "/contacts/right", f"/nodes/{record['asset']}"]
for topic in every_step:
    times = [time for time, _ in messages[topic]]
    assert times == [round(0.05e9 * step) for step in range(steps + 1)], topic

peak = max(decoded.d_pct for _, decoded in messages["/deformation"])
assert math.isclose(peak, record["d_peak"], rel_tol=1e-9), (peak, record["d_peak"])
assert all(math.isclose(decoded.tau_pct, record["tau"]) for _, decoded in messages["/deformation"])
force = max(decoded.left_force_n for _, decoded in messages["/gripper"])
assert 0.1 < force < 100, force

frames = {transform.child_frame_id: transform for transform in messages["/tf"][0][1].transforms}
assert len(frames) == len(messages["/tf"][0][1].transforms), "a frame has one transform"
# The pads are either side of the tool, which is between them.
tool, left, right = (frames[name].translation for name in ["tool", "pad_left", "pad_right"])
for axis in "xyz":
    middle = (getattr(left, axis) + getattr(right, axis)) / 2
    assert abs(middle - getattr(tool, axis)) < 0.005, (axis, middle, getattr(tool, axis))

first = messages["/scene"][0][1]
assert messages["/scene"][0][0] == 0 and len(first.entities) > 10
known = {"world", *frames}
for entity in first.entities:
    (triangles,) = entity.triangles
    assert entity.frame_id in known and entity.frame_locked, entity.frame_id
    assert max(triangles.indices) < len(triangles.points) == len(triangles.colors)
# The object moves: its last entity is where its nodes are.
moved = [entity for _, update in messages["/scene"] for entity in update.entities if entity.id == record["asset"]]
assert len(moved) > 20, len(moved)
skin = np.array([[p.x, p.y, p.z] for p in moved[-1].triangles[0].points])
cloud = messages[f"/nodes/{record['asset']}"][-1][1]
assert [field.name for field in cloud.fields] == ["x", "y", "z", "strain"] and cloud.point_stride == 16
nodes = np.frombuffer(cloud.data, dtype="<f4").reshape(-1, 4)
assert (abs(skin.min(axis=0) - nodes[:, :3].min(axis=0)) < 0.02).all() and (nodes[:, 3] >= 0).all()

# A point in front of the camera is in the image of it: the middle of the object in the third-person camera.
matrix = np.array(messages["/camera/third_person/calibration"][0][1].P).reshape(3, 4)
pose = frames["third_person"]
x, y, z, w = pose.rotation.x, pose.rotation.y, pose.rotation.z, pose.rotation.w
rotation = np.array(
    [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
)
eye = np.array([pose.translation.x, pose.translation.y, pose.translation.z])
in_camera = rotation.T @ (nodes[:, :3].mean(axis=0) - eye)
u, v, depth = matrix @ np.append(in_camera, 1)
picture = Image.open(io.BytesIO(messages["/camera/third_person"][0][1].data))
assert picture.size == (224, 224) and depth > 0 and 0 < u / depth < 224 and 0 < v / depth < 224, (u / depth, v / depth)

(_, prompt), (end, verdict) = messages["/log"]
assert prompt.message == record["prompt"] and end == messages["/tf"][-1][0] and verdict.message == "safe"
print(f"{path}: {len(messages)} topics, {steps + 1} states")
