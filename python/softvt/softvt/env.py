"""softvt as a Gymnasium environment: a client of `softvt serve` that starts its own server, or connects to one."""

import math
import os
import shutil
import time
import warnings
import weakref
from collections import deque
from collections.abc import Iterable, Mapping, Sequence
from functools import partial
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces

from .arguments import is_bool, require_bool, require_one_of, require_text, texts, whole_number
from .profile import CAMERA_PARTS, CONTROLS, GRIPPERS, PARTS, PARTS_OF_ONE_STEP, ProfileSpec, parse_parts
from .readings import Readings
from .serve import Client, Lease, ServerError, lease
from .suites import FILE_ID, SUITES, environment_id
from .true_state import STATE_BOUNDS, Scene, TrueState, progress

REWARDS = ("sparse", "staged", "safety")
"""Values of the argument `reward`."""

LAYOUTS = ("flat", "lerobot")
"""Values of the argument `layout`."""

SPLITS = ("validation", "demonstration", "experiment")
"""Lists of episodes."""

FIRST_SEED = 1000
"""Seed of episode 0: the first seed of lerobot-eval, so that it judges the episodes of `softvt FILE.lua`."""

NEW_ROLLOUT = "lerobot_new_rollout"
"""Option of `reset` by which lerobot-eval begins an episode."""

CONTROL_DT = 0.05
"""Duration of a control step, s."""

RECONNECT_S = 10.0
"""Time for which an environment tries to connect again after an interrupted request, s."""

_EPISODES = 2**32
_RENDER_MODES = ("rgb_array", "sensors")
_FINGERS = ("left", "right")
_MAX_IMAGE_EDGE = 4096  # pixels
# What the server tells in `info` and the environment passes on under another name, or not at all.
_OTHER_NUMBERS = ("task", "episode", "step", "carried_out")
# What the server counts of commands that were not executed as given, in the words of the command line.
_COMMANDS = {
    "far_commands": "commands were out of reach; check the meaning of the actions (control) and their units, m and rad",
    "clamped_grips": "grip values were out of range; check the grip code (gripper)",
    "clamped_steps": "displacements were beyond −1..1; check the meaning of the actions (control)",
}
_SENSOR_EDGE = 240  # pixels of each image of the render mode "sensors"
# Key of `get_state` for the last true states, which the server does not keep.
_PAST_STATES = "past_true_states"
# Flags of `softvt serve` and what sets them.
_SET_BY = {
    "--profile": "the arguments profile, obs, control, gripper, history and cameras",
    "--split": "the argument split",
    "--gripper": "the argument gripper",
    **dict.fromkeys(("--port", "--threads", "--token", "--until-stdin-closes"), "the environment for its own server"),
}
# Servers, suites and tasks whose goals were checked, so that a vector does it once.
_with_true_state: set[tuple[str, str, int]] = set()

Observation = np.ndarray | dict[str, Any]
Step = tuple[Observation, float, bool, bool, dict[str, Any]]


class SoftVTEnv(gymnasium.Env[Observation, np.ndarray]):
    """Tasks of a suite. docs/python.md describes observations, actions, rewards and `info`."""

    metadata = {"render_modes": [*_RENDER_MODES], "render_fps": 20}

    def __init__(
        self,
        script: str | os.PathLike[str] | None = None,
        *,
        url: str | None = None,
        token: str | None = None,
        suite: str | None = None,
        task: int | str | Sequence[int] | None = 0,
        obs: str | Sequence[str] | None = None,
        control: str | None = None,
        gripper: str | None = None,
        reward: str = "sparse",
        layout: str = "flat",
        history: int | None = None,
        cameras: Sequence[str] | None = None,
        image_size: int | Sequence[int] | None = None,
        profile: str | os.PathLike[str] | None = None,
        cost: bool = True,
        privileged: bool = False,
        split: str | None = None,
        first_seed: int = FIRST_SEED,
        freeze: bool = False,
        flags: Sequence[str] = (),
        binary: str | None = None,
        render_mode: str | None = None,
        camera: str | None = None,
        registered_suite: str | None = None,
    ):
        """Starts a server, or shares one that was started with equal arguments.

        script: a Lua file that returns a suite or a list of suites, or the name of a standard suite, such as "object_soft".
        url, token: a running server in place of the script. `control`, `gripper`, `history`, `cameras`, `image_size`, `profile` and `flags`
            are then those of the server, and are refused here.
        suite: name of one of several suites of the script; by default the first.
        task: number of a task, part of its prompt, or several numbers, of which each reset draws one; None for all tasks. A run that `flags`
            record with --out has these tasks, unless --task is among the flags or an environment of all tasks records it.
        obs: parts of the observation (`softvt.profile.PARTS`), such as "state", or joined by +, such as "pixels+proprio". By default "state";
            with `url`, all that the server sends. Not with `profile`, which states its own.
        control: "delta" (fractions −1..1 of 20 mm and 0.2 rad, the default), "delta_osc" (of 50 mm and 0.5 rad, as LIBERO has them), "pose"
            (absolute), or "joints" (positions of the seven joints, rad).
        gripper: grip code of the last number of an action: "continuous" (the default), "binary", "two-width" or "force".
        reward: 1 at the goal ("sparse"), 1 at a goal reached safely ("safety"), or the increase of progress ("staged").
        layout: keys of the observation: "flat", or those that LeRobot reads.
        history: control steps of each entry, the present one last, along a first axis if there are several; by default 1.
        cameras: names of the cameras of pixels, depth and segmentation, by default ("third_person", "wrist"). Only with one of them in `obs`.
        image_size: pixels of the camera images, (height, width) or one number for both; by default those of the scene. Only with such a part,
            a profile, or render_mode="rgb_array" of another camera than a finger.
        profile: a profile of softvt by name or file, in place of `obs`, `control`, `gripper`, `history` and `cameras`, which are refused beside it.
        cost: True for `info["cost"]`, which needs a server with access to the true state (`--privileged`).
        privileged: True for `info["verdict"]` and `info["state"]`.
        split: list of episodes, "validation", "demonstration" or "experiment"; by default that of the server, "validation".
        first_seed: seed of episode 0.
        freeze: True to repeat the last transition after the end of an episode, until a reset with a seed or with the option of lerobot-eval.
        flags: further flags of `softvt serve`, such as ("--shift", "stiffness=0.5"). Not those that arguments set.
        binary: the program; by default `softvt.find_binary()`.
        render_mode: "rgb_array" for the image of `camera`, or "sensors" for both cameras above both fingers.
        camera: a camera's name (default: the scene's first), or "left" or "right" for a finger. Only with render_mode="rgb_array".
        registered_suite: the standard suite of an identifier of Gymnasium's registry, which gives it. `script` and `url` must not name others.

        Raises ValueError for an argument that is not possible, and ServerError with the message of the program if it does not start.
        """
        require_one_of("reward", reward, REWARDS)
        require_one_of("layout", layout, LAYOUTS)
        for name, value, known in (
            ("control", control, CONTROLS),
            ("gripper", gripper, GRIPPERS),
            ("render_mode", render_mode, _RENDER_MODES),
            ("split", split, SPLITS),
        ):
            if value is not None:
                require_one_of(name, value, known)
        for name, switch in (("cost", cost), ("privileged", privileged), ("freeze", freeze)):
            require_bool(name, switch)
        for name, text in (("url", url), ("token", token), ("camera", camera)):
            if text is not None:
                require_text(name, text)
        first_seed = whole_number("first_seed", first_seed)
        cameras, flags = None if cameras is None else texts("cameras", cameras), texts("flags", flags)
        image_shape = _image_shape(image_size)
        script, profile = _path("script", script), _path("profile", profile)
        if registered_suite is not None:
            _refuse_other_suites(registered_suite, script, url)
            script = registered_suite
        if binary is not None and shutil.which(binary) is None:
            raise ValueError(f"binary={binary!r}: there is no such program; leave it out for that of the package")
        if url is not None and not url.startswith(("ws://", "wss://")):
            raise ValueError(f"url={url!r}: expected an address such as 'ws://127.0.0.1:8765'")
        if (script is None) == (url is None):
            raise ValueError("give either the script of a suite or the url of a server")
        own = {"control": control, "gripper": gripper, "history": history, "cameras": cameras}
        _refuse_given("profile", profile, own)
        _refuse_given("url", url, {**own, "profile": profile, "image_size": image_size, "flags": flags or None, "binary": binary})
        _refuse_given("script", script, {"token": token})
        refuse_flags(flags, {"--split": split is not None, "--gripper": gripper is not None})
        if profile is not None and obs is not None:
            raise ValueError(
                f"obs={obs!r} and profile={profile!r}: a profile states all observations; leave out one of them. The true state is in "
                'info["state"] with privileged=True'
            )
        # None for all that the server sends.
        parts: tuple[str, ...] | None = None if url or profile else ("state",)
        if obs is not None:
            parts = parse_parts(obs)
        if url is None and parts is not None:
            _refuse_without_effect(parts, obs, cameras, image_size, history, render_mode, camera)
        control = "delta" if control is None else control
        gripper = "continuous" if gripper is None else gripper
        history = 1 if history is None else history
        cameras = ("third_person", "wrist") if cameras is None else cameras
        if camera is not None and render_mode != "rgb_array":
            raise ValueError(
                f"camera={camera!r} has no effect with render_mode={render_mode!r}; give render_mode='rgb_array', or leave it out"
            )
        _check_task(task)
        needs_truth = cost or privileged or reward != "sparse" or (parts is not None and "state" in parts)
        self.render_mode = render_mode
        self._camera, self._reward, self._layout, self._freezes = camera, reward, layout, freeze
        self._has_cost, self._has_readings = cost, privileged
        self._parts, self._split, self._first_seed = parts, split, first_seed
        self._lease: Lease | None = None
        # True in an episode of a recorded run that was begun by an action and has not ended.
        self._is_open = False
        if script is not None:
            spec = None if profile or parts is None else ProfileSpec(parts, control, gripper, cameras, history)
            if image_shape is not None and any("cameras.width=" in flag or "cameras.height=" in flag for flag in flags):
                raise ValueError("image_size sets cameras.width and cameras.height; leave them out of flags, or image_size")
            own_flags = _flags(profile, image_shape, needs_truth and "--privileged" not in flags) + flags
            self._lease = lease(_script(script), own_flags, binary, None if spec is None else spec.to_lua(), tasks_of_run(task, flags))
            self._connect = self._lease.connect
        else:
            assert url is not None
            self._connect = partial(Client, url, token)
        try:
            self._client = self._connect()
        except BaseException:
            if self._lease is not None:
                self._lease.release()
            raise
        self._closer = self._finalizer()
        try:
            self._begin(suite, task, needs_truth, history)
            if self._needs_state() and script not in SUITES:
                self._check_goals()
            self._check_camera()
        except BaseException:
            self.close()
            raise

    def _finalizer(self) -> Any:
        """Closes what this environment uses, once it is called or the environment is gone."""
        closer = weakref.finalize(self, _close, self._client, self._lease)
        # Servers end with their process anyway.
        closer.atexit = False
        return closer

    def _reconnect_if_interrupted(self) -> None:
        """Replaces a connection in which a request was interrupted."""
        if not (self._client.is_interrupted and self._closer.alive):
            return
        self._client.close()
        deadline = time.monotonic() + RECONNECT_S
        while True:
            try:
                self._client = self._connect()
                break
            except ServerError:
                # A server with as many clients as it accepts still works on the interrupted request.
                if time.monotonic() > deadline:
                    raise
                time.sleep(0.1)
        self._closer.detach()
        self._closer = self._finalizer()

    def _ask(self, kind: str, **fields: Any) -> dict[str, Any]:
        """The response to a request about the present episode."""
        if self._client.is_interrupted and self._closer.alive:
            raise ServerError(f"{kind}: {self._client.interruption()}; call reset first")
        return self._client.request(kind, **fields)

    def _begin(self, suite: str | None, task: int | str | Sequence[int] | None, needs_truth: bool, history: int) -> None:
        hello = self._client.hello
        if needs_truth and not hello["privileged"]:
            raise ValueError(
                "obs='state', reward='staged', reward='safety', cost=True and privileged=True need the true state, which this server does not "
                "send; start it with --privileged, or use obs='proprio', reward='sparse' and cost=False"
            )
        suites = {entry["name"]: entry for entry in hello["suites"]}
        name = suite if suite is not None else next(iter(suites))
        if name not in suites:
            raise ValueError(f"suite={name!r}: the server has {', '.join(suites)}")
        self._suite = name
        self._prompts = {entry["task"]: entry["prompt"] for entry in suites[name]["tasks"]}
        self._tasks = _tasks(name, task, self._prompts)
        self._task = self._tasks[0]
        self._prompt: str = self._prompts[self._task]
        budgets = {entry["task"]: entry["budget_steps"] for entry in suites[name]["tasks"]}
        # The name under which Gymnasium's TimeLimit has it, and under which LeRobot asks for it.
        self._max_episode_steps = max(budgets[task] for task in self._tasks)
        self._entries = self._select(hello["observation_space"])
        self._history = history
        self._past: deque[np.ndarray] = deque(maxlen=history)
        self.observation_space = self._space(hello["observation_space"])
        low, high = (_numbers(hello["action_space"], end, np.float32) for end in ("low", "high"))
        self.action_space = spaces.Box(low, high, dtype=np.float32)
        self._scene: Scene | None = None
        self._verdict: Mapping[str, Any] = {}
        self._progress = 0.0
        self._last: Step | None = None
        self._pending = ""
        self._warned: set[str] = set()
        # Seed and split of the list of the present episode, and of the one that `end_reset` starts.
        self._episode, self._list = 0, self._list_of({})
        self._pending_list = self._list
        # Number of episodes of each task in the run that the server records.
        self._run_episodes: int = suites[name]["episodes"] if hello["records"] else 0
        # True while the only episode of the server is that of `_probe`.
        self._has_probe = False

    def _probe(self, task: int) -> dict[str, Any]:
        """First answer of an episode, for checks of what only episodes have. It is not begun by an action."""
        self._has_probe = True
        return self._client.request("reset", suite=self._suite, task=task, episode=0)

    def _check_goals(self) -> None:
        """Raises ValueError if the goal of a task has nothing that the true state consists of."""
        for task in self._tasks:
            key = (self._client.url, self._suite, task)
            if key not in _with_true_state:
                _read_scene(self._probe(task)["info"])
                _with_true_state.add(key)

    def _check_camera(self) -> None:
        """Raises ValueError if the scene has no camera of the argument."""
        if self._camera is None or self._camera in _FINGERS:
            return
        self._probe(self.task)
        names = [*self.camera_matrices()]
        if self._camera not in names:
            raise ValueError(
                f"camera={self._camera!r}: expected a camera of the scene, {', '.join(map(repr, names))}, or 'left' or 'right'"
            )

    # Gymnasium's interface.

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Observation, dict[str, Any]]:
        """Starts episode `seed - first_seed` of the task, or a random one.

        `options` may name another `task`, by its number or a part of its prompt, or `split`, the `episode`, and the `seed` of the whole list of
        episodes; None leaves an option out. Raises ValueError for another option, and for an `episode` beside the seed of another one.
        """
        self.begin_reset(seed, options)
        return self.end_reset()

    def step(self, action: np.ndarray) -> Step:
        """Executes an action, of the length of the action space, or several (n, length), and returns the result of the last one."""
        self.begin_step(action)
        return self.end_step()

    def render(self) -> Any:
        """Image of the present state, uint8 (height, width, 3); None without a render mode."""
        if self.render_mode is None:
            return None
        if self.render_mode == "rgb_array":
            return self._ask("render", camera=self._camera)["image"]
        return self._render_sensors()

    def close(self) -> None:
        """Closes the connection, and ends the server after its last environment. A second call has no effect."""
        self._warn_of_left_episode()
        self._closer()

    def __reduce__(self) -> Any:
        # Also for copy.deepcopy.
        raise TypeError(
            f"a {type(self).__name__} has a connection to a server and cannot be pickled or copied; make it inside of the worker, by a function: "
            'lambda: gymnasium.make("softvt/ObjectSoft-v0", …). get_state and set_state carry an episode from one environment to another'
        )

    # What softvt offers besides.

    def begin_reset(self, seed: int | None = None, options: dict[str, Any] | None = None) -> None:
        """As `reset`, without waiting; `end_reset` has to follow. Several environments thus work at the same time."""
        super().reset(seed=seed)
        if options is not None and not isinstance(options, Mapping):
            raise ValueError(f"reset: options: expected a dict, got {options!r}")
        options = dict(options or {})
        is_rollout = bool(options.pop(NEW_ROLLOUT, False))
        unknown = options.keys() - {"task", "episode", "split", "seed"}
        if unknown:
            raise ValueError(f"reset: options has no {', '.join(map(repr, sorted(unknown)))}; expected task, episode, split or seed")
        options = {key: value for key, value in options.items() if value is not None}
        if self._freezes and self._last is not None and not (is_rollout or seed is not None or options):
            self._pending = "frozen"
            return
        if isinstance(options.get("task"), str):
            options["task"] = _tasks(self._suite, options["task"], self._prompts)[0]
        drawn = int(self.np_random.integers(_EPISODES))
        task = self._tasks[int(self.np_random.integers(len(self._tasks)))]
        episode = drawn if seed is None else (seed - self._first_seed) % _EPISODES
        named = options.get("episode")
        if seed is not None and named is not None and named != episode:
            raise ValueError(f"reset: seed={seed} is episode {episode}, and options name episode {named}; leave out one of them")
        self._reconnect_if_interrupted()
        requested = {"suite": self._suite, "task": task, "episode": episode, "split": self._split, **options}
        self._last = None
        self._client.send("reset", **{key: value for key, value in requested.items() if value is not None})
        self._pending, self._pending_list = "reset", self._list_of(requested)

    def end_reset(self) -> tuple[Observation, dict[str, Any]]:
        """Waits for `begin_reset`."""
        if self._take_pending() == "frozen":
            assert self._last is not None
            observation, _, _, _, info = self._last
            return observation, info
        response = self._client.receive()
        self._warn_of_left_episode()
        restarted = self._restart(response, self._pending_list)
        self._warn_of_other_episode()
        return restarted

    def begin_step(self, action: np.ndarray) -> None:
        """As `step`, without waiting; `end_step` has to follow."""
        if self._freezes and self._last is not None:
            self._pending = "frozen"
            return
        if self._has_probe or self._client.is_interrupted:
            # For `end_step`, so that the requests of a vector environment and their answers stay in step.
            self._pending = "no episode yet" if self._has_probe else self._client.interruption()
            return
        self._client.send("step", action=np.asarray(action))
        self._pending = "step"

    def require_action(self, action: Any) -> None:
        """Raises ValueError unless the server would execute an action: finite numbers (length) or (n, length)."""
        shape = self.action_space.shape
        assert shape is not None
        size = shape[0]
        try:
            numbers = np.asarray(action, dtype=np.float64)
        except (TypeError, ValueError):
            raise ValueError(f"action: expected {size} numbers, got {action!r}") from None
        if numbers.ndim not in (1, 2) or numbers.shape[-1] != size or numbers.size == 0:
            raise ValueError(f"action: expected shape ({size}) or (n, {size}), got {numbers.shape}")
        if not np.isfinite(numbers).all():
            raise ValueError(f"action: not finite: {numbers.tolist()}")

    def end_step(self) -> Step:
        """Waits for `begin_step`."""
        pending = self._take_pending()
        if pending == "frozen":
            assert self._last is not None
            return self._last
        if pending != "step":
            raise ServerError(f"step: {pending}; call reset first")
        response = self._client.receive()
        before = self._verdict
        self._verdict = response["info"].get("verdict", {})
        self._warn_of_missing_limits()
        observation, state = self._observe(response, is_first=False)
        info = self._info(response["info"], before)
        reward = self._reward_of(response, state)
        terminated, truncated = bool(response["terminated"]), bool(response["truncated"])
        self._is_open = self._is_of_run() and not (terminated or truncated)
        if terminated or truncated:
            self._warn_of_commands(info)
        self._freeze_end(response, observation, info)
        return observation, reward, terminated, truncated, info

    def _freeze_end(self, response: Mapping[str, Any], observation: Observation, info: dict[str, Any]) -> None:
        """Keeps the last transition of an episode for an environment that repeats it."""
        terminated, truncated = bool(response["terminated"]), bool(response["truncated"])
        if self._freezes and (terminated or truncated):
            # Its costs have been counted.
            frozen = {key: 0.0 if key == "cost" or key.startswith("cost_") else value for key, value in info.items()}
            self._last = (observation, 0.0, terminated, truncated, frozen)

    def get_state(self) -> dict[str, Any]:
        """State of the episode as plain data, for `set_state` of this or an equal environment."""
        state: dict[str, Any] = self._ask("get_state")["state"]
        if self._history > 1 and self._needs_state():
            state[_PAST_STATES] = [past.tolist() for past in self._past]
        return state

    def set_state(self, state: dict[str, Any]) -> tuple[Observation, dict[str, Any]]:
        """Restores a state bit for bit, also after the end of an episode; returns what `reset` does. Wrappers of Gymnasium do not notice it: a
        TimeLimit counts on."""
        self._reconnect_if_interrupted()
        restored = dict(state) if isinstance(state, Mapping) else state
        past = restored.pop(_PAST_STATES, None) if isinstance(restored, dict) else None
        response = self._client.request("set_state", state=restored)
        self._warn_of_left_episode()
        observation, info = self._restart(response, self._list_of(restored), past)
        self._freeze_end(response, observation, info)
        return observation, info

    def camera_matrices(self) -> dict[str, dict[str, Any]]:
        """Of each camera by name, in the present state: `width` and `height` of its image, pixels, its matrix `intrinsic` (3, 3), and its pose in
        the robot's base frame `pose_b` (4, 4), with the axes of OpenGL: x right, y up, view along −z."""
        cameras: dict[str, dict[str, Any]] = self._ask("cameras")["cameras"]
        return cameras

    @property
    def task(self) -> int:
        """Number of the task of the present episode. The argument `task` or an option of `reset` chooses it."""
        return self._task

    @property
    def task_description(self) -> str:
        """The prompt of the present episode."""
        return self._prompt

    @property
    def hello(self) -> dict[str, Any]:
        """The server's description of its suites, tasks and profile (docs/serve.md)."""
        return self._client.hello

    def _take_pending(self) -> str:
        pending, self._pending = self._pending, ""
        return pending

    def _restart(
        self, response: dict[str, Any], episode_list: tuple[int, str], past: Sequence[Sequence[float]] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Takes in the first answer of an episode of a list, or of a restored state with the true states up to it."""
        raw = response["info"]
        self._last, self._has_probe = None, False
        self._task, self._episode, self._prompt = raw["task"], raw["episode"], raw["prompt"]
        self._list = episode_list
        self._verdict = raw.get("verdict", {})
        self._scene = None
        if self._needs_state():
            self._scene = _read_scene(raw)
        observation, state = self._observe(response, is_first=True, past=past)
        self._progress = progress(state, self._verdict) if state is not None else 0.0
        return observation, self._info(raw, None)

    def _warn_of_missing_limits(self) -> None:
        """Warns once of a soft object without a limit, whose deformation has no cost and is never safe."""
        if not (self._has_cost or self._reward == "safety"):
            return
        judged = [self._verdict, *self._verdict.get("targets", ())]
        if any(one.get("d_peak") is not None and one.get("tau") is None for one in judged):
            self._warn_once(
                f"suite {self._suite}, task {self.task}",
                "an object of the goal has no limit τ, so that no episode is safe and no deformation costs; calibrate it (docs/calibration.md)",
            )

    def _warn_of_commands(self, info: Mapping[str, Any]) -> None:
        """Warns once of each kind of commands that were not executed as given in most steps of an episode, as `softvt` does after a run."""
        steps = info["step"]
        for counter, words in _COMMANDS.items():
            count = info.get(counter, 0)
            if 2 * count > steps and counter not in self._warned:
                self._warned.add(counter)
                where = f"suite {self._suite}, task {self.task}, episode {info['episode_index']}"
                warnings.warn(f"{where}: {count} of {steps} {words}", stacklevel=2)

    def _warn_of_left_episode(self) -> None:
        """Warns once if an episode of a recorded run is left before its end: it has no record then."""
        if self._is_open:
            self._is_open = False
            self._warn_once(
                f"suite {self._suite}, task {self.task}, episode {self._episode}",
                "left before its end, so that --out has no record of this attempt, and takes no later one. The server ends an episode at the goal "
                "or with the budget of its task; max_episode_steps ends it earlier",
            )

    def _warn_of_other_episode(self) -> None:
        """Warns once if an episode is not one of the recorded run."""
        if self._run_episodes <= self._episode and self._run_episodes > 0 and self._list == self._list_of({}):
            last = self._run_episodes - 1
            self._warn_once(
                f"suite {self._suite}",
                f"the run of --out has the episodes 0 to {last} of each task, and no other one is recorded; a reset without a seed, also the "
                f"automatic one of a vector, draws from 2³² episodes. Reset by seeds {self._first_seed} to {self._first_seed + last}, vectors with "
                'autoreset_mode="Disabled" and reset_mask',
            )

    def _is_of_run(self) -> bool:
        """True in an episode of the run that the server records."""
        return self._episode < self._run_episodes and self._list == self._list_of({})

    def _list_of(self, named: Mapping[str, Any]) -> tuple[int, str]:
        """Seed and split of the list of episodes that a request or a state names; by default those of the server, which its run has."""
        hello = self._client.hello
        seed, split = (hello[key] if named.get(key) is None else named[key] for key in ("seed", "split"))
        return seed, split

    def _warn_once(self, what: str, words: str) -> None:
        """Warns of something, unless the same words were a warning of this environment before."""
        if words not in self._warned:
            self._warned.add(words)
            warnings.warn(f"{what}: {words}", stacklevel=2)

    def _needs_state(self) -> bool:
        return self._reward == "staged" or (self._parts is not None and "state" in self._parts)

    # Observations.

    def _select(self, entries: Mapping[str, Any]) -> list[str]:
        """Keys of the server's entries that the observation has."""
        if self._parts is None:
            # Text is no Box, which many libraries need.
            return [key for key, entry in entries.items() if "charset" not in entry]
        selected = []
        for part in self._parts:
            if part == "state":
                continue
            found = [key for key, entry in entries.items() if _part(key, entry) == part]
            if not found:
                raise ValueError(
                    f"obs={part!r}: the profile {self._client.hello['profile']!r} of this server does not send it; it sends {', '.join(entries)}"
                )
            selected += found
        if "state" in self._parts and "state" in selected:
            raise ValueError(
                "obs: the profile of this server has an entry 'state' of its own, so that the true state cannot be added to it"
            )
        return selected

    def _space(self, entries: Mapping[str, Any]) -> spaces.Space[Any]:
        all_spaces: dict[str, spaces.Space[Any]] = {key: _space(entries[key]) for key in self._entries}
        if self._parts is not None and "state" in self._parts:
            bounds = STATE_BOUNDS if self._history == 1 else np.tile(STATE_BOUNDS, (self._history, 1))
            all_spaces["state"] = spaces.Box(-bounds, bounds, dtype=np.float32)
        if self._layout == "flat":
            return next(iter(all_spaces.values())) if self._is_bare else spaces.Dict(all_spaces)
        if "tactile_marker_motion" in all_spaces:
            motion = all_spaces["tactile_marker_motion"]
            assert isinstance(motion, spaces.Box)
            all_spaces["tactile_marker_motion"] = spaces.Box(_last_motion(motion.low), _last_motion(motion.high), dtype=np.float32)
        nested = self._nest(all_spaces)
        return spaces.Dict({key: spaces.Dict(value) if isinstance(value, dict) else value for key, value in nested.items()})

    @property
    def _is_bare(self) -> bool:
        """True if the observation is an array instead of a dict with one entry."""
        return self._parts in (("state",), ("proprio",))

    def _nest(self, flat: Mapping[str, Any]) -> dict[str, Any]:
        """The keys that LeRobot reads: pictures in `pixels`, the robot's state as `agent_pos`, the true one as `environment_state`."""
        nested: dict[str, Any] = {}
        for key, value in flat.items():
            match _part(key, self._client.hello["observation_space"].get(key, {})):
                case "pixels" | "tactile" | "tactile_image":
                    nested.setdefault("pixels", {})[key] = value
                case "proprio":
                    nested["agent_pos"] = value
                case _:
                    nested["environment_state" if self._is_true_state(key) else key] = value
        return nested

    def _is_true_state(self, key: str) -> bool:
        return key == "state" and key not in self._entries

    def _observe(
        self, response: dict[str, Any], is_first: bool, past: Sequence[Sequence[float]] | None = None
    ) -> tuple[Observation, TrueState | None]:
        sent, raw = response["observation"], response["info"]
        flat = {key: sent[key] for key in self._entries}
        state = None if self._scene is None else TrueState.read(self._scene, raw["state"], raw["verdict"])
        if state is not None and self._parts is not None and "state" in self._parts:
            self._past.extend([state.vector] * (self._history if is_first else 1))
            if past is not None:
                self._past.extend(np.asarray(vector, dtype=state.vector.dtype) for vector in past)
            flat["state"] = state.vector if self._history == 1 else np.stack(self._past)
        if self._layout == "flat":
            return (next(iter(flat.values())) if self._is_bare else flat), state
        if "tactile_marker_motion" in flat:
            flat["tactile_marker_motion"] = _last_motion(flat["tactile_marker_motion"])
        return self._nest(flat), state

    # Rewards and info.

    def _reward_of(self, response: dict[str, Any], state: TrueState | None) -> float:
        if self._reward == "staged":
            assert state is not None
            before, self._progress = self._progress, progress(state, self._verdict)
            return self._progress - before
        if self._reward == "safety":
            return 1.0 if response["terminated"] and self._verdict["safety"] else 0.0
        return float(response["reward"])

    def _info(self, raw: dict[str, Any], before: Mapping[str, Any] | None) -> dict[str, Any]:
        """`before` is the verdict of the previous step; None without a step."""
        info: dict[str, Any] = {key: raw[key] for key in ("task", "step", "time_s")}
        info.update(_counters(raw))
        # Not "episode", under which wrappers of Gymnasium and Stable-Baselines3 put their statistics.
        info["episode_index"] = raw["episode"]
        info["split"] = self._list[1]
        info["prompt"] = self.task_description
        # Vector environments make an array of Python's bool only.
        info["is_success"] = bool(raw["success"])
        if self._has_cost:
            info.update(_costs(before, self._verdict))
            info["is_safe"] = bool(self._verdict["safety"])
        if self._has_readings:
            info["verdict"], info["state"] = Readings(raw["verdict"]), Readings(raw["state"])
        if "record" in raw:
            info["record"] = Readings(raw["record"])
        if "recorded" in raw:
            info["recorded"] = bool(raw["recorded"])
        return info

    def _render_sensors(self) -> np.ndarray:
        """Both cameras above both fingers."""
        names = [*self.camera_matrices()][:2]
        cameras = [self._ask("render", camera=name, width=320, height=_SENSOR_EDGE)["image"] for name in names]
        fingers = [self._ask("render", camera=side)["image"] for side in ("left", "right")]
        return np.vstack([np.hstack(cameras), np.hstack(fingers)])


def _close(client: Client, lease: Lease | None) -> None:
    client.close()
    if lease is not None:
        lease.release()


def _read_scene(raw: Mapping[str, Any]) -> Scene:
    """The scene of an episode's first answer. Raises ValueError, with what to use instead, if it has no true state."""
    try:
        scene = Scene.read(raw["scene"])
        TrueState.read(scene, raw["state"], raw["verdict"])
    except ValueError as error:
        raise ValueError(
            f"task {raw['task']}: obs='state' and reward='staged' need the object and its target, but {error}; use obs='proprio' or other parts, "
            "and reward='sparse' or 'safety'. The true state is in info[\"state\"] with privileged=True"
        ) from None
    return scene


def _refuse_other_suites(registered: str, script: str | None, url: str | None) -> None:
    """Raises ValueError for a script or a server that is not the suite of an identifier."""
    known = environment_id(registered)
    for name, value in (("script", script), ("url", url)):
        if value is not None and (name == "url" or _script(value) != _script(registered)):
            raise ValueError(f"{name}={value!r}: {known} is the suite {registered}; write gymnasium.make({FILE_ID!r}, {name}={value!r})")


def _refuse_given(cause: str, given: object, arguments: Mapping[str, object]) -> None:
    """Raises ValueError for arguments that have no effect where another one is given, also with the value of their default."""
    for name, value in arguments.items():
        if given is not None and value is not None:
            raise ValueError(f"{name}={value!r} has no effect with {cause}={given!r}; leave it out")


def refuse_flags(flags: tuple[str, ...], given: Mapping[str, bool], further: Mapping[str, str] | None = None) -> None:
    """Raises ValueError for flags that an argument sets. `given` has those that may replace their argument, and whether it is given too; `further`
    has those that are refused besides, and what sets them."""
    set_by = {**_SET_BY, **(further or {})}
    for flag in flags:
        name = flag.split("=")[0]
        if name in set_by and given.get(name, True):
            raise ValueError(f"flags={flags!r}: {name} is set by {set_by[name]}; leave it out of flags")


def _refuse_without_effect(
    parts: Sequence[str],
    obs: object,
    cameras: tuple[str, ...] | None,
    image_size: object,
    history: int | None,
    render_mode: str | None,
    camera: str | None,
) -> None:
    """Raises ValueError for arguments that change nothing about these parts of an observation."""
    shown = "state" if obs is None else obs
    found = f"obs={shown!r}"
    pictures = "which has no pixels, depth or segmentation; leave it out"
    if not any(part in CAMERA_PARTS for part in parts):
        if cameras is not None:
            raise ValueError(f"cameras={cameras!r} has no effect with {found}, {pictures}")
        if image_size is not None and render_mode != "rgb_array":
            raise ValueError(f"image_size={image_size!r} has no effect with {found}, {pictures}")
        if image_size is not None and camera in _FINGERS:
            raise ValueError(f"image_size={image_size!r} has no effect with {found} and the finger camera={camera!r}; leave it out")
    if history not in (None, 1) and parts and all(part in PARTS_OF_ONE_STEP for part in parts):
        raise ValueError(f"history={history!r} has no effect with {found}; leave it out")


def _image_shape(image_size: Any) -> tuple[int, int] | None:
    """Height and width that the argument states. Raises ValueError for anything else than one or two whole numbers."""
    if image_size is None:
        return None
    pair = (image_size, image_size)
    if isinstance(image_size, Sequence | np.ndarray) and not isinstance(image_size, str | bytes):
        pair = tuple(image_size)
    try:
        height, width = (whole_number("image_size", edge, 1, _MAX_IMAGE_EDGE) for edge in pair)
    except ValueError:
        raise ValueError(
            f"image_size={image_size!r}: expected (height, width) or one number for both, each a whole number from 1 to {_MAX_IMAGE_EDGE}"
        ) from None
    return height, width


def _path(argument: str, value: Any) -> str | None:
    """A name or path as text. Raises ValueError for what is neither."""
    if value is None:
        return None
    if not isinstance(value, str | os.PathLike):
        raise ValueError(f"{argument}={value!r}: expected a name or the path of a Lua file")
    return os.fspath(value)


def _counters(raw: Mapping[str, Any]) -> dict[str, int]:
    """All that the server counts in an episode, such as `far_commands`."""
    return {key: value for key, value in raw.items() if isinstance(value, int) and not is_bool(value) and key not in _OTHER_NUMBERS}


def _script(name: str) -> str:
    """Path of a Lua file, or of a standard suite."""
    return name if name.endswith(".lua") else f"suites/{name}.lua"


def _flags(profile: str | None, image_shape: tuple[int, int] | None, needs_truth: bool) -> tuple[str, ...]:
    flags: list[str] = []
    if profile is not None:
        flags += ["--profile", profile]
    if image_shape is not None:
        height, width = image_shape
        flags += ["--set", f"cameras.height={height}", "--set", f"cameras.width={width}"]
    if needs_truth:
        flags.append("--privileged")
    return tuple(flags)


def tasks_of_run(task: int | str | Sequence[int] | None, flags: Sequence[str]) -> tuple[str, ...]:
    """The flag by which a run has the tasks of the argument alone. Servers that record nothing are shared by the environments of all tasks."""
    names = {flag.split("=")[0] for flag in flags}
    if task is None or "--out" not in names or "--task" in names:
        return ()
    if isinstance(task, str):
        # A comma would separate tasks.
        return ("--task", max(task.split(","), key=len))
    return ("--task", ",".join(str(int(number)) for number in (task if isinstance(task, Iterable) else [task])))


def _check_task(task: Any) -> None:
    """Raises ValueError unless the argument is None, a number, text, or numbers."""
    if task is None or isinstance(task, str):
        return
    many = isinstance(task, Sequence | np.ndarray | range | set) and not isinstance(task, bytes)
    try:
        numbers = [whole_number("task", number) for number in (task if many else [task])]
    except (TypeError, ValueError):
        raise ValueError(f"task={task!r}: expected a number, text or a list of numbers") from None
    if not numbers:
        raise ValueError(f"task={task!r}: no number in the list; None is for all tasks")


def _tasks(suite: str, task: int | str | Sequence[int] | None, prompts: Mapping[int, str]) -> list[int]:
    """Numbers of the tasks that an argument names. Raises ValueError if there is no such task."""
    if task is None:
        return [*prompts]
    if isinstance(task, str):
        found = [number for number, prompt in prompts.items() if task.lower() in prompt.lower()]
        if not found and task.isdecimal():
            raise ValueError(f"task={task!r}: text is a part of a prompt; write task={int(task)} for the task of this number")
        if len(found) != 1:
            raise ValueError(
                f"task={task!r}: {len(found)} prompts of suite {suite} contain it; expected one of: {'; '.join(prompts.values())}"
            )
        return found
    numbers = [int(number) for number in (task if isinstance(task, Iterable) else [task])]
    for number in numbers:
        if number not in prompts:
            known = [*prompts]
            have = f"0 to {known[-1]}" if known == [*range(len(known))] else ", ".join(map(str, known))
            raise ValueError(f"task {number}: suite {suite} has the tasks {have}")
    return numbers


def _part(key: str, entry: Mapping[str, Any]) -> str:
    """Part of an observation (`PARTS`) that an entry of a server belongs to; its key for other entries."""
    if "charset" in entry:
        return "prompt"
    if key in PARTS and key not in ("state", "prompt"):
        return key
    if key == "tactile_marker_motion":
        return "marker_motion"
    if key.startswith("tactile_"):
        return "tactile"
    shape, dtype = entry.get("shape", ()), entry.get("dtype", "")
    if dtype == "|u1" and len(shape) >= 3:
        return "pixels"
    for part in ("depth", "segmentation"):
        if key.endswith(f"_{part}"):
            return part
    # The robot's own state in softvt's profiles.
    return "proprio" if entry and key.rsplit("/", 1)[-1] == "state" else key


def _space(entry: Mapping[str, Any]) -> spaces.Space[Any]:
    """Space of an entry as the server describes it: text, or an array with common or individual bounds."""
    if "charset" in entry:
        return spaces.Text(entry["max_length"], charset=entry["charset"])
    dtype = np.dtype(entry["dtype"]).type
    return spaces.Box(_numbers(entry, "low", dtype), _numbers(entry, "high", dtype), dtype=dtype)


def _numbers(entry: Mapping[str, Any], end: str, dtype: Any) -> np.ndarray:
    """Lower or upper bounds of an array, which the server states once or for each element."""
    shape, bounds = tuple(entry["shape"]), np.array(entry[end], dtype)
    return np.full(shape, bounds) if bounds.size == 1 else bounds.reshape(shape)


def _last_motion(motion: np.ndarray) -> np.ndarray:
    """Initial, previous and present positions of the markers (3, 198, 2), as the data sets for LeRobot have them."""
    return motion[[0, -2, -1]]


def _costs(before: Mapping[str, Any] | None, now: Mapping[str, Any]) -> dict[str, float]:
    """Costs of a control step, 1 each: D beyond τ, the first drop, and slip beyond the limit where the suite forbids it, of any object that the goal
    moves; `cost` is their sum. 0 without a step."""
    costs = dict.fromkeys(("cost_deformation", "cost_drop", "cost_slip"), 0.0)
    if before is not None:
        pairs = zip(_times_over_limit(before), _times_over_limit(now), strict=True)
        # A step of several actions costs the time beyond τ in control steps, rounded up.
        costs["cost_deformation"] = float(max(math.ceil((after - earlier) / CONTROL_DT - 1e-6) for earlier, after in pairs))
        costs["cost_drop"] = float(before["no_drop"] and not now["no_drop"])
        costs["cost_slip"] = float(before["slip_ok"] is not False and now["slip_ok"] is False)
    return {"cost": sum(costs.values()), **costs}


def _times_over_limit(verdict: Mapping[str, Any]) -> list[float]:
    """Time for which D of each object that the goal moves was beyond its τ, s."""
    return [target.get("time_over_tau_s") or 0.0 for target in (verdict, *verdict.get("targets", ()))]
