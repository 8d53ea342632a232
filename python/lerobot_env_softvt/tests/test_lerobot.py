"""lerobot-eval with softvt's tasks, and vla-eval's bridge for policies of LeRobot."""

import json
import socket
import subprocess
import sys
import tempfile
import time
import unittest
from functools import cache
from pathlib import Path

import numpy as np
import softvt
import torch
from lerobot.configs import FeatureType, PolicyFeature, PreTrainedConfig
from lerobot.envs import EnvConfig, env_to_policy_features, make_env, preprocess_observation
from lerobot.policies import PreTrainedPolicy
from lerobot.policies.act.configuration_act import ACTConfig
from lerobot.policies.act.modeling_act import ACTPolicy
from lerobot.policies.factory import make_pre_post_processors
from lerobot.processor import PolicyProcessorPipeline
from lerobot.scripts.lerobot_eval import eval_policy_all
from lerobot.utils.import_utils import register_third_party_plugins

FOLDER = Path(tempfile.mkdtemp(prefix="softvt-lerobot-"))
STEPS = 8


@PreTrainedConfig.register_subclass("softvt_repeat")
class RepeatConfig(PreTrainedConfig):
    """Configuration of `Repeat`."""

    observation_delta_indices = action_delta_indices = reward_delta_indices = None

    def get_optimizer_preset(self):
        raise NotImplementedError

    def get_scheduler_preset(self):
        return None

    def validate_features(self):
        pass


class Repeat(PreTrainedPolicy):
    """Repeats the actions of a run, the same in all environments."""

    config_class = RepeatConfig
    name = "softvt_repeat"

    def __init__(self, rows: np.ndarray):
        super().__init__(RepeatConfig(device="cpu"))
        self.rows = torch.from_numpy(rows)
        self.step = 0

    def get_optim_params(self):
        return {}

    def reset(self):
        self.step = 0

    def forward(self, batch):
        raise NotImplementedError

    def predict_action_chunk(self, batch):
        raise NotImplementedError

    def select_action(self, batch):
        self.step += 1
        row = self.rows[min(self.step, len(self.rows)) - 1]
        return row.repeat(len(batch["task"]), 1)


@cache
def short_suite() -> str:
    path = FOLDER / "short.lua"
    path.write_text(
        f'local suite = require "suites.object_soft"\nfor _, task in ipairs(suite.tasks) do task.budget_steps = {STEPS} end\nreturn suite\n'
    )
    return str(path)


@cache
def expert_run(policy: str) -> tuple[np.ndarray, dict]:
    out = FOLDER / policy
    command = [softvt.find_binary(), "suites/object_soft.lua", "--task", "0", "--episodes", "1", "--policy", policy, "--out", str(out)]
    subprocess.run(command, check=True, capture_output=True)
    record = json.loads((out / "episodes.jsonl").read_text())
    return np.load(out / "actions/task_000/episode_00000.npy"), record


@cache
def checkpoint() -> str:
    """A tiny ACT with random weights, whose answers are near a pose in front of the robot."""
    picture = PolicyFeature(FeatureType.VISUAL, (3, 224, 224))
    cameras = ["observation.images.third_person", "observation.images.wrist"]
    config = ACTConfig(
        input_features={**dict.fromkeys(cameras, picture), "observation.state": PolicyFeature(FeatureType.STATE, (7,))},
        output_features={"action": PolicyFeature(FeatureType.ACTION, (7,))},
        chunk_size=4,
        n_action_steps=4,
        dim_model=16,
        dim_feedforward=16,
        n_heads=2,
        n_encoder_layers=1,
        n_vae_encoder_layers=1,
        latent_dim=4,
        pretrained_backbone_weights=None,
        device="cpu",
    )
    unit = {"mean": torch.zeros(7), "std": torch.ones(7)}
    pictures = {"mean": torch.zeros(3, 1, 1), "std": torch.ones(3, 1, 1)}
    pose = {"mean": torch.tensor([0.45, 0.0, 0.3, 3.1, 0.0, 0.0, 0.3]), "std": torch.full((7,), 0.01)}
    stats = {**dict.fromkeys(cameras, pictures), "observation.state": unit, "action": pose}
    folder = str(FOLDER / "act")
    ACTPolicy(config).save_pretrained(folder)
    for processor in make_pre_post_processors(config, dataset_stats=stats):
        processor.save_pretrained(folder)
    return folder


def listens(port: int) -> bool:
    with socket.socket() as probe:
        return probe.connect_ex(("127.0.0.1", port)) == 0


def evaluate(rows: np.ndarray, n_envs: int = 1, **config) -> tuple[dict, dict]:
    """Results of lerobot-eval's evaluation, and its vector environments."""
    register_third_party_plugins()
    made = EnvConfig.get_choice_class("softvt")(**config)
    envs = make_env(made, n_envs=n_envs, use_async_envs=True)
    nothing = PolicyProcessorPipeline(steps=[])
    pipelines = {"env_preprocessor": nothing, "env_postprocessor": nothing}
    identity = {"preprocessor": lambda batch: batch, "postprocessor": lambda action: action}
    info = eval_policy_all(envs, Repeat(rows), **pipelines, **identity, n_episodes=n_envs, start_seed=1000)
    return info, envs


class Evaluations(unittest.TestCase):
    def test_goal_is_pc_success_and_safety_is_avg_max_reward(self):
        for policy, is_safe in [("expert", True), ("expert-binary", False)]:
            rows, record = expert_run(policy)
            self.assertEqual((record["goal"], record["safety"]), (True, is_safe))
            info, _ = evaluate(rows, task="object_soft", task_ids=[0])
            overall = info["overall"]
            self.assertEqual((overall["pc_success"], overall["avg_max_reward"], overall["n_episodes"]), (100.0, float(is_safe), 1))
            self.assertEqual(info["per_task"][0]["task_group"], "object_soft")

    def test_a_finished_sub_environment_waits_for_the_slowest(self):
        rows, record = expert_run("expert")
        # In episode 1 the same actions miss the object, so that its environment goes on.
        info, envs = evaluate(rows, n_envs=2, task="object_soft", task_ids=[0])
        self.assertEqual(info["per_task"][0]["metrics"]["successes"], [True, False])
        first, second = envs["object_soft"][0].envs
        self.assertEqual(first._last[4]["step"], record["steps"])
        self.assertEqual(second._last[4]["step"], second._max_episode_steps)

    def test_the_command_finds_the_plugin_and_writes_results_and_videos(self):
        out = FOLDER / "eval"
        arguments = [
            f"--policy.path={checkpoint()}",
            "--policy.device=cpu",
            "--env.type=softvt",
            f"--env.task={short_suite()}",
            "--env.task_ids=[0,1]",
            "--eval.n_episodes=2",
            "--eval.batch_size=2",
            f"--output_dir={out}",
        ]
        done = subprocess.run([sys.executable, "-m", "lerobot.scripts.lerobot_eval", *arguments], capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, done.stderr[-3000:])
        info = json.loads((out / "eval_info.json").read_text())
        self.assertEqual(info["overall"]["n_episodes"], 4)
        self.assertEqual(len([*out.glob("videos/*/*.mp4")]), 4)

    def test_features_are_those_of_the_observations(self):
        register_third_party_plugins()
        parts = "pixels+proprio+tactile_image+tactile+marker_motion+state"
        config = EnvConfig.get_choice_class("softvt")(task=short_suite(), task_ids=[3], obs=parts, observation_width=64)
        features = env_to_policy_features(config)
        vector = make_env(config, n_envs=2)["object_soft"][3]
        self.addCleanup(vector.close)
        observation, _ = vector.reset(seed=[1000, 1001])
        found = {key: tuple(value.shape[1:]) for key, value in preprocess_observation(observation).items()}
        self.assertEqual(found, {key: tuple(feature.shape) for key, feature in features.items() if key != "action"})
        self.assertEqual([environment.task for environment in vector.envs], [3, 3])

    def test_what_policies_cannot_read_is_refused(self):
        register_third_party_plugins()
        with self.assertRaisesRegex(ValueError, "env.obs: .* no input for 'depth'"):
            EnvConfig.get_choice_class("softvt")(obs="pixels+depth")
        with self.assertRaisesRegex(ValueError, "task 99: suite object_soft has the tasks 0 to 9"):
            make_env(EnvConfig.get_choice_class("softvt")(task=short_suite(), task_ids=[99]))
        for options, words in [
            ({"fps": 10}, "env.fps=10: softvt's control rate is 20 steps per second"),
            ({"task_ids": []}, r"env.task_ids=\[\]: no task"),
            ({"task_ids": [0, 0]}, r"env.task_ids=\[0, 0\]: a task is named twice"),
        ]:
            with self.subTest(options), self.assertRaisesRegex(ValueError, words):
                EnvConfig.get_choice_class("softvt")(**options)
        with self.assertRaisesRegex(ValueError, "env.task: object_soft and .*short.lua both have a suite named 'object_soft'"):
            make_env(EnvConfig.get_choice_class("softvt")(task=f"object_soft,{short_suite()}", task_ids=[0]))
        with self.assertRaisesRegex(ValueError, "224 x 64 pixels; state --env.observation_height=224"):
            make_env(EnvConfig.get_choice_class("softvt")(task=short_suite(), flags=["--set", "cameras.width=64"]))


class Bridges(unittest.TestCase):
    def test_softvt_evaluates_a_policy_behind_the_bridge_of_vla_eval(self):
        port = 18796
        bridge = [sys.executable, "-m", "vla_eval.model_servers.lerobot", "--address", f"127.0.0.1:{port}"]
        cameras = '{"agentview": "third_person", "wrist": "wrist"}'
        policy = ["--args.policy_type", "act", "--args.checkpoint", checkpoint(), "--args.device", "cpu", "--args.image_keys", cameras]
        server = subprocess.Popen([*bridge, *policy], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        try:
            deadline = time.monotonic() + 180
            while not listens(port):
                self.assertIsNone(server.poll(), "the bridge ended")
                self.assertLess(time.monotonic(), deadline, "the bridge does not listen")
                time.sleep(0.5)
            out = FOLDER / "bridged"
            command = [softvt.find_binary(), short_suite(), "--task", "0", "--episodes", "1", "--out", str(out)]
            flags = ["--policy", f"ws://127.0.0.1:{port}", "--protocol", "vla-eval", "--profile", "vision", "--gripper", "continuous"]
            subprocess.run([*command, *flags], check=True, capture_output=True)
        finally:
            server.kill()
            server.wait()
        record = json.loads((out / "episodes.jsonl").read_text())
        self.assertEqual((record["steps"], record["outcome"]["kind"], record["far_commands"]), (STEPS, "budget", 0))


if __name__ == "__main__":
    unittest.main()
