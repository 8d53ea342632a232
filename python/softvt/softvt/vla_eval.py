"""softvt as a benchmark of vla-eval: `benchmark: "softvt.vla_eval:SoftVTBenchmark"` in its configuration. docs/vla-eval.md is the guide."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from vla_eval.benchmarks.base import StepBenchmark, StepResult
from vla_eval.specs import (
    GRIPPER_01,
    GRIPPER_CLOSE_01,
    GRIPPER_CLOSE_POS,
    IMAGE_RGB,
    LANGUAGE,
    POSITION_ABSOLUTE,
    POSITION_DELTA,
    RAW,
    ROTATION_AA,
    DimSpec,
)
from vla_eval.types import Action, EpisodeResult, Observation, Task

from .arguments import require_bool, require_one_of, texts, whole_number
from .env import SoftVTEnv, refuse_flags
from .profile import CONTROLS, GRIPPERS, action_size, proprio_parts

# Names of the cameras in observations, as `softvt --protocol vla-eval` has them.
_CAMERAS = {"third_person": "agentview", "wrist": "wrist"}
_MAX_VALUE_CHARS = 300


class SoftVTBenchmark(StepBenchmark):
    """Tasks of a suite. An episode ends at the goal, which must hold for 0.4 s in most suites, or with the budget of its task.

    Results have `success` (Goal Success), `safety` (Safety Success), `no_drop`, and `d_over_tau`: the peak deformation over the limit, where the
    object has one.
    """

    # The cameras need no GPU.
    render_backends = frozenset({"cpu", "gpu"})
    _ALL_RECORD_FIELDS = frozenset({"reward", "done", "success", "cost", "action", "state"})

    @classmethod
    def configure_render(cls, mode: str) -> dict[str, str]:
        """Sets nothing: the cameras are rendered on the CPU in any mode."""
        return {}

    def __init__(
        self,
        suite: str = "object_soft",
        seed: int = 0,
        control: str = "pose",
        gripper: str = "continuous",
        send_state: bool = True,
        send_wrist_image: bool = True,
        send_tactile: bool = False,
        image_size: int = 224,
        flags: Sequence[str] = (),
    ) -> None:
        """Starts a server with the first use.

        suite: standard suite, or a Lua file.
        seed: seed of all episodes.
        control, gripper: meaning of actions, as of SoftVTEnv.
        send_state: True for `states` (7): tool position (m), axis-angle (rad), half of the sensed width (m). With control="joints" (8): joint
            positions (rad), half of the sensed width.
        send_wrist_image: True for the wrist camera too.
        send_tactile: True for touch: the picture `tactile_image` and the markers `tactile_marker_motion` (9, 198, 2).
        image_size: edge of the camera images, pixels.
        flags: further flags of `softvt serve`. Not those that arguments set.
        """
        super().__init__()
        require_one_of("control", control, CONTROLS)
        require_one_of("gripper", gripper, GRIPPERS)
        for name, value in (("send_state", send_state), ("send_wrist_image", send_wrist_image), ("send_tactile", send_tactile)):
            require_bool(name, value)
        seed, image_size = whole_number("seed", seed, 0), whole_number("image_size", image_size, 1)
        flags = texts("flags", flags)
        refuse_flags(flags, {"--split": False}, dict.fromkeys(("--seed", "--seed-file"), "the argument seed"))
        self.suite, self.seed, self.control, self.gripper = suite, seed, control, gripper
        self._sends_state = send_state
        self._cameras = tuple(_CAMERAS) if send_wrist_image else ("third_person",)
        self._sends_tactile = send_tactile
        parts = ["proprio", "pixels"] + (["tactile_image", "marker_motion"] if send_tactile else [])
        self._arguments: dict[str, Any] = {
            "obs": parts,
            "control": control,
            "gripper": gripper,
            "cameras": self._cameras,
            "image_size": image_size,
            "privileged": True,
            "flags": flags,
            "render_mode": "rgb_array",
        }
        self._env: SoftVTEnv | None = None

    def get_tasks(self) -> list[Task]:
        """Tasks of the suite; the name of a task is its prompt."""
        served = self._environment().hello["suites"][0]
        return [{"name": entry["prompt"], "suite": served["name"], "task_id": entry["task"]} for entry in served["tasks"]]

    def reset(self, task: Task) -> Any:
        """Starts episode `episode_idx` of the task."""
        options = {"task": task["task_id"], "episode": task.get("episode_idx", 0), "seed": self.seed}
        observation, _ = self._environment().reset(options=options)
        self._recorder.record_video(observation["third_person"])
        return observation

    def step(self, action: Action) -> StepResult:
        """Executes `action["actions"]`, of 7 numbers, or 8 with control="joints". Raises ValueError for another length, and for an answer without
        numbers."""
        numbers = _numbers(action)
        size = action_size(self.control)
        if numbers.shape != (size,):
            motion = "joint positions" if self.control == "joints" else "position, axis-angle"
            raise ValueError(f"the action has {numbers.size} numbers; softvt expects {size}: {motion} and gripper")
        observation, reward, terminated, truncated, info = self._environment().step(numbers)
        done = terminated or truncated
        self._recorder.record_step(
            reward=reward,
            done=done,
            success=info["is_success"],
            cost=info["cost"],
            action=numbers.tolist(),
            state=observation["proprio"].tolist(),
        )
        self._recorder.record_video(observation["third_person"])
        return StepResult(observation, reward, done, info)

    def make_obs(self, raw_obs: Any, task: Task) -> Observation:
        """Observation in vla-eval's convention."""
        images = {_CAMERAS[camera]: raw_obs[camera] for camera in self._cameras}
        observation: Observation = {"images": images, "task_description": self._environment().task_description}
        if self._sends_tactile:
            images["tactile_image"] = raw_obs["tactile_image"]
            observation["tactile_marker_motion"] = raw_obs["tactile_marker_motion"]
        if self._sends_state:
            observation["states"] = raw_obs["proprio"]
        return observation

    def get_step_result(self, step_result: StepResult) -> EpisodeResult:
        """The verdict on the episode."""
        verdict = step_result.info["verdict"]
        result: EpisodeResult = {
            key: bool(verdict[name]) for key, name in (("success", "goal"), ("safety", "safety"), ("no_drop", "no_drop"))
        }
        # Of the objects that the goal moves.
        objects = [verdict, *verdict.get("targets", ())]
        ratios = [one["d_peak"] / one["tau"] for one in objects if one["d_peak"] is not None and one["tau"]]
        if ratios:
            result["d_over_tau"] = max(ratios)
        return result

    def get_metric_keys(self) -> dict[str, str]:
        """Metrics of the results, with the way in which vla-eval aggregates them."""
        return {"success": "mean", "safety": "mean", "no_drop": "mean", "d_over_tau": "max"}

    def get_metadata(self) -> dict[str, Any]:
        """Suite and largest budget of its tasks, in control steps of 0.05 s."""
        tasks = self._environment().hello["suites"][0]["tasks"]
        return {"suite": self.suite, "max_steps": max(entry["budget_steps"] for entry in tasks), "control_hz": 20}

    def get_action_spec(self) -> dict[str, DimSpec]:
        """Format of the actions."""
        is_absolute = self.control in ("pose", "joints")
        grippers = {"continuous": GRIPPER_01 if is_absolute else RAW, "binary": GRIPPER_CLOSE_01 if is_absolute else GRIPPER_CLOSE_POS}
        gripper = grippers.get(self.gripper, RAW)
        if self.control == "joints":
            return {"joints": DimSpec("joints", 7, "joint_positions_rad"), "gripper": gripper}
        return {"position": POSITION_ABSOLUTE if is_absolute else POSITION_DELTA, "rotation": ROTATION_AA, "gripper": gripper}

    def get_observation_spec(self) -> dict[str, DimSpec]:
        """Format of the observations."""
        spec = {_CAMERAS[camera]: IMAGE_RGB for camera in self._cameras}
        spec["language"] = LANGUAGE
        if self._sends_state:
            names = "joints7_finger1" if self.control == "joints" else "eef_pos3_axisangle3_finger1"
            spec["state"] = DimSpec("state", sum(proprio_parts(self.control).values()), names)
        if self._sends_tactile:
            spec["tactile_image"] = IMAGE_RGB
        return spec

    def get_hold_action(self, last_action: Action | None) -> Action:
        """Repeats an absolute pose or joint positions, and steps by zero with the last gripper value. Before the first action the hand is open."""
        if self.control in ("pose", "joints"):
            if last_action is not None:
                return last_action
            size = action_size(self.control) - 1
            arm = np.zeros(size) if self._last_result.obs is None else self._last_result.obs["proprio"][:size]
            return {"actions": np.append(arm, 0.0).astype(np.float32)}
        grip = -1.0 if last_action is None else _numbers(last_action)[-1]
        return {"actions": np.append(np.zeros(6), grip).astype(np.float32)}

    def render(self) -> np.ndarray | None:
        """Image of the third-person camera."""
        image: np.ndarray | None = self._environment().render()
        return image

    def cleanup(self) -> None:
        """Ends the server."""
        if self._env is not None:
            self._env.close()
            self._env = None

    def _environment(self) -> SoftVTEnv:
        if self._env is None:
            env = SoftVTEnv(self.suite, task=None, **self._arguments)
            names = [served["name"] for served in env.hello["suites"]]
            if len(names) > 1:
                env.close()
                raise ValueError(f"suite={self.suite!r} has the suites {', '.join(names)}, and a benchmark has one: give one of them")
            self._env = env
        return self._env


def _numbers(action: Action) -> np.ndarray:
    """The numbers of a model server's answer, in one row. Raises ValueError for an answer that is an error or has no numbers."""
    fix = "a model server of vla-eval answers {'actions': …}, an array of numbers"
    if not isinstance(action, Mapping):
        raise ValueError(f"the answer is {_shortened(action)}; {fix}")
    if action.get("actions") is None:
        found = ", ".join(f"{key!r}: {_shortened(value)}" for key, value in action.items())
        raise ValueError(f"the answer has no 'actions', but {{{found}}}; {fix}")
    try:
        return np.asarray(action["actions"], dtype=np.float64).reshape(-1)
    except (TypeError, ValueError):
        raise ValueError(f"the answer has 'actions': {_shortened(action['actions'])}; {fix}") from None


def _shortened(value: object) -> str:
    text = repr(value)
    return text if len(text) <= _MAX_VALUE_CHARS else text[:_MAX_VALUE_CHARS] + "…"
