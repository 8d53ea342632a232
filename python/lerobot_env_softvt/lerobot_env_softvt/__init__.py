"""softvt as an environment of LeRobot, which imports this module by its name: `lerobot-eval --env.type=softvt --env.task=object_hidden`.

docs/lerobot.md is the guide.
"""

from dataclasses import dataclass, field
from typing import Any

from gymnasium.vector import VectorEnv
from lerobot.configs import FeatureType, PolicyFeature
from lerobot.envs import EnvConfig
from lerobot.utils.constants import ACTION, OBS_ENV_STATE, OBS_IMAGES, OBS_STATE
from softvt import SoftVTVectorEnv
from softvt.env import FIRST_SEED, tasks_of_run
from softvt.profile import action_size, parse_parts, proprio_parts
from softvt.true_state import STATE_BOUNDS

_CAMERAS = ("third_person", "wrist")
_RATE_HZ = 20
_SCENE_IMAGE = (224, 224, 3)
"""Shape of the images of all standard scenes."""


@EnvConfig.register_subclass("softvt")
@dataclass
class SoftVTEnvConfig(EnvConfig):
    """Environment of the type `softvt`: one vector environment for each task of each suite.

    `pc_success` of lerobot-eval is Goal Success, and with `reward` "safety" `avg_max_reward` is the rate of Safety Success, from 0 to 1. Finished
    sub-environments repeat their last transition.
    """

    task: str | None = "object_soft"
    """Standard suite or Lua file, or several with commas between."""
    task_ids: list[int] | None = None
    """Numbers of the tasks; None for all."""
    fps: int = 20
    obs: str = "pixels+proprio"
    """Parts of the observation, joined by +: pixels, proprio, tactile_image, tactile, marker_motion, state."""
    control: str = "pose"
    """Meaning of an action: "pose", "joints", "delta" or "delta_osc"."""
    gripper: str = "continuous"
    """Grip code of the last number of an action."""
    reward: str = "safety"
    """ "safety", "sparse" or "staged"."""
    observation_height: int = 224
    observation_width: int = 224
    split: str = "validation"
    """List of episodes."""
    first_seed: int = FIRST_SEED
    """Value of `--seed` for which the first episode is episode 0 of the suite."""
    flags: list[str] = field(default_factory=list)
    """Further flags of `softvt serve`, such as ["--shift", "stiffness=0.5"]."""
    render_mode: str = "rgb_array"
    camera: str | None = None
    """Camera of the videos; by default the scene's first."""
    features: dict[str, PolicyFeature] = field(default_factory=dict)
    features_map: dict[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Checks the options, and fills in the features of the observation and of the action."""
        if self.fps != _RATE_HZ:
            raise ValueError(f"env.fps={self.fps}: softvt's control rate is {_RATE_HZ} steps per second; leave it out")
        if self.task_ids is not None:
            if not self.task_ids:
                raise ValueError("env.task_ids=[]: no task; leave it out for all tasks")
            if len(set(self.task_ids)) < len(self.task_ids):
                raise ValueError(f"env.task_ids={self.task_ids}: a task is named twice; name each once")
        finger = (240, 320, 3)
        visual: dict[str, dict[str, tuple[int, ...]]] = {
            "pixels": dict.fromkeys(_CAMERAS, self._image),
            "tactile_image": {"tactile_image": (224, 224, 3)},
            "tactile": {"tactile_left": finger, "tactile_right": finger},
        }
        other = {
            "proprio": ("agent_pos", OBS_STATE, PolicyFeature(FeatureType.STATE, (sum(proprio_parts(self.control).values()),))),
            "state": ("environment_state", OBS_ENV_STATE, PolicyFeature(FeatureType.ENV, STATE_BOUNDS.shape)),
            "marker_motion": (
                "tactile_marker_motion",
                "observation.tactile_marker_motion",
                PolicyFeature(FeatureType.STATE, (3, 198, 2)),
            ),
        }
        self._add(ACTION, ACTION, PolicyFeature(FeatureType.ACTION, (action_size(self.control),)))
        for part in parse_parts(self.obs):
            for name, shape in visual.get(part, {}).items():
                # The key by which `--eval.recording` finds the pictures too.
                self._add(f"{OBS_IMAGES}.{name}", f"{OBS_IMAGES}.{name}", PolicyFeature(FeatureType.VISUAL, shape))
            if part in other:
                self._add(*other[part])
            elif part not in visual:
                raise ValueError(f"env.obs: LeRobot's policies have no input for {part!r}; expected {', '.join([*visual, *other])}")

    def _add(self, key: str, policy_key: str, feature: PolicyFeature) -> None:
        self.features[key] = feature
        self.features_map[key] = policy_key

    @property
    def _image(self) -> tuple[int, int, int]:
        return (self.observation_height, self.observation_width, 3)

    @property
    def gym_kwargs(self) -> dict[str, Any]:
        """Arguments of the environments, without the task."""
        return {
            "obs": self.obs,
            "control": self.control,
            "gripper": self.gripper,
            "reward": self.reward,
            "layout": "lerobot",
            # A size that scenes have anyway is no setting, which would tell runs apart.
            "image_size": None if self._image == _SCENE_IMAGE else self._image[:2],
            "split": self.split,
            "first_seed": self.first_seed,
            # The environments of all tasks record one run.
            "flags": (*self.flags, *tasks_of_run(self.task_ids, self.flags)),
            "cost": False,
            "freeze": True,
            "render_mode": self.render_mode,
            "camera": self.camera,
        }

    def create_envs(self, n_envs: int, use_async_envs: bool = False) -> dict[str, dict[int, VectorEnv]]:
        """Vector environments by suite and task. They step in parallel in either mode: the server has a thread for each environment, so that
        no worker processes are needed."""
        if not self.task:
            raise ValueError("env.task: give a standard suite or a Lua file")
        found: dict[str, dict[int, VectorEnv]] = {}
        scripts: dict[str, str] = {}
        try:
            for script in self.task.split(","):
                self._add_suites(script.strip(), n_envs, found, scripts)
        except BaseException:
            for vectors in found.values():
                for vector in vectors.values():
                    vector.close()
            raise
        return found

    def _add_suites(self, script: str, n_envs: int, found: dict[str, dict[int, VectorEnv]], scripts: dict[str, str]) -> None:
        """Adds the environments of a script to those found. `scripts` are the scripts of suites by the names of these, by which LeRobot tells
        their results apart. Raises ValueError for a name of two suites."""
        arguments = {**self.gym_kwargs, "script": script}
        first = SoftVTVectorEnv(1, **arguments, task=None)
        try:
            self._check_images(first)
            for suite in first.envs[0].hello["suites"]:
                name = suite["name"]
                if name in scripts:
                    raise ValueError(
                        f"env.task: {scripts[name]} and {script} both have a suite named {name!r}, under which results are kept; give one of them "
                        "another name in its script, or evaluate them by two commands"
                    )
                scripts[name] = script
                known = [entry["task"] for entry in suite["tasks"]]
                vectors = found.setdefault(name, {})
                for task in known if self.task_ids is None else self.task_ids:
                    vectors[task] = SoftVTVectorEnv(n_envs, **arguments, suite=name, task=task)
        finally:
            first.close()

    def _check_images(self, vector: SoftVTVectorEnv) -> None:
        """Raises ValueError if the cameras of the scene have another size than the features."""
        space: Any = vector.single_observation_space
        for name in _CAMERAS:
            if "pixels" in space.spaces and name in space["pixels"].spaces and space["pixels"][name].shape != self._image:
                height, width, _ = space["pixels"][name].shape
                raise ValueError(
                    f"env.task: camera {name} has {height} x {width} pixels; state --env.observation_height={height} and "
                    f"--env.observation_width={width}"
                )
