"""A third-party vla-eval model server (PyPI: vla-eval) that holds still and checks its observations.

usage: python vla_eval_hold.py PORT PROFILE (visuo_tactile)
"""

import sys

import numpy as np
from vla_eval.model_servers.base import ModelServer
from vla_eval.model_servers.serve import serve
from vla_eval.specs import GRIPPER_01, POSITION_ABSOLUTE, ROTATION_AA


class Hold(ModelServer):
    started = False

    async def on_episode_start(self, config, ctx):
        assert config["task"]["name"], config
        self.started = True

    async def on_observation(self, obs, ctx):
        assert self.started, "no episode was started"
        images = obs["images"]
        for name, shape in {"agentview": (224, 224, 3), "wrist": (224, 224, 3), "tactile_image": (224, 224, 3)}.items():
            assert images[name].shape == shape and images[name].dtype == np.uint8, (name, images[name].shape)
        assert obs["states"].shape == (7,) and obs["task_description"], obs.keys()
        assert obs["tactile_marker_motion"].shape == (9, 198, 2)
        row = np.append(obs["states"][:6], 0.0).astype(np.float32)
        await ctx.send_action({"actions": np.tile(row, (20, 1))})

    async def on_episode_end(self, result, ctx):
        self.started = False

    def get_action_spec(self):
        return {"position": POSITION_ABSOLUTE, "rotation": ROTATION_AA, "gripper": GRIPPER_01}

    def get_observation_spec(self):
        return {}


if __name__ == "__main__":
    serve(Hold(), host="127.0.0.1", port=int(sys.argv[1]))
