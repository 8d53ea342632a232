"""PPO from the true state learns to reach the object: Stable-Baselines3, two cores, some minutes.

    pip install . stable-baselines3
    python examples/python/ppo_reach.py --verbose 1

Reaching is the first stage of an episode: it is completed when a pad touches the object. The policy sees the true state, so that results are
privileged (docs/policies.md).
"""

import argparse
import time
from typing import Any

import gymnasium
import numpy as np
import softvt
from stable_baselines3 import PPO
from stable_baselines3.common.env_util import make_vec_env
from stable_baselines3.common.evaluation import evaluate_policy
from stable_baselines3.common.vec_env import VecEnv, VecNormalize

gymnasium.register_envs(softvt)

# Control steps of an episode, 5 s: the way is 0.2 to 0.6 m, and a step is at most 20 mm along each axis.
EPISODE_STEPS = 100


class Reach(gymnasium.Wrapper):
    """Ends an episode once the object is reached, which then is its success."""

    def step(self, action: np.ndarray) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        observation, reward, terminated, truncated, info = self.env.step(action)
        reached = info["verdict"]["failed_stage"] != "reach"
        info["is_success"] = reached
        return observation, float(reward), terminated or reached, truncated, info


def make(split: str, envs: int, seed: int) -> VecEnv:
    """Environments that share one server."""

    def make_one() -> gymnasium.Env:
        arguments = {"task": 0, "obs": "state", "control": "delta", "reward": "staged", "privileged": True, "split": split}
        return Reach(gymnasium.make("softvt/SpatialRigid-v0", max_episode_steps=EPISODE_STEPS, **arguments))

    return make_vec_env(make_one, n_envs=envs, seed=seed)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--steps", type=int, default=60_000, help="control steps of training")
    parser.add_argument("--envs", type=int, default=8)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--episodes", type=int, default=20, help="episodes of the evaluation")
    parser.add_argument("--verbose", type=int, default=0, help="1 for the progress of training")
    options = parser.parse_args()

    # Numbers of the state differ in size by orders of magnitude.
    training = VecNormalize(make("demonstration", options.envs, options.seed), gamma=0.97)
    policy = PPO(
        "MlpPolicy",
        training,
        n_steps=256,
        batch_size=512,
        gamma=0.97,
        learning_rate=1e-3,
        seed=options.seed,
        device="cpu",
        verbose=options.verbose,
    )
    began = time.monotonic()
    policy.learn(options.steps)
    took = time.monotonic() - began

    testing = VecNormalize(make("validation", 1, softvt.env.FIRST_SEED), training=False, norm_reward=False)
    testing.obs_rms = training.obs_rms
    reached: list[bool] = []

    def note(local: dict[str, Any], _: dict[str, Any]) -> None:
        if local["done"]:
            reached.append(local["info"]["is_success"])

    evaluate_policy(policy, testing, options.episodes, callback=note)
    print(f"{policy.num_timesteps} steps in {took:.0f} s; reached the object in {sum(reached)} of {len(reached)} episodes")
    training.close()
    testing.close()


if __name__ == "__main__":
    main()
