"""A third-party openpi server (PyPI: openpi-server) around a policy that holds still and checks its observations.

usage: python openpi_hold.py PORT PROFILE
"""

import sys

import numpy as np
from openpi_server.websocket_policy_server import WebsocketPolicyServer

TACTILE = {"tactile_image": ((224, 224, 3), "uint8"), "tactile_marker_motion": ((9, 198, 2), "float32")}
VISION = {
    "image": ((224, 224, 3), "uint8"),
    "wrist_image": ((224, 224, 3), "uint8"),
    "state": ((7,), "float32"),
}
PROFILES = {
    "vision": VISION,
    "visuo_tactile": VISION | TACTILE,
    "softvtbench": VISION | TACTILE | {"tactile_gripper_force": ((8, 6), "float32")},
    "libero": VISION | {"state": ((8,), "float32")},
}


class Hold:
    def __init__(self, profile):
        self.profile = profile

    def infer(self, obs):
        assert isinstance(obs["prompt"], str) and obs["prompt"], obs.keys()
        for name, (shape, dtype) in PROFILES[self.profile].items():
            keys = ["observation/" + name] + ([] if self.profile == "libero" else [name])
            for key in keys:
                got = obs[key]
                assert got.shape == shape and str(got.dtype) == dtype, (key, got.shape, got.dtype)
        image = obs["observation/image"]
        assert image.std() > 10, "a uniform image"
        state = obs["observation/state"]
        gripper = {"vision": 0.0, "visuo_tactile": 0.0, "softvtbench": 0.04, "libero": -1.0}[self.profile]
        row = np.zeros(32, np.float32)
        if self.profile != "libero":
            row[:6] = state[:6]
        row[6] = gripper
        return {"actions": np.tile(row, (50, 1)), "state": state}


if __name__ == "__main__":
    WebsocketPolicyServer(Hold(sys.argv[2]), host="127.0.0.1", port=int(sys.argv[1])).serve_forever()
