"""Several environments that one server steps at the same time, without worker processes."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space, concatenate, create_empty_array, iterate

from .arguments import require_one_of, whole_number
from .env import SoftVTEnv
from .serve import ServerError


class SoftVTVectorEnv(VectorEnv):
    """`num_envs` environments with the same arguments. Each has a connection; the server steps them in parallel, one thread each."""

    def __init__(
        self,
        num_envs: int,
        *,
        autoreset_mode: str | AutoresetMode = AutoresetMode.NEXT_STEP,
        max_episode_steps: int | None = None,
        **arguments: Any,
    ):
        """`arguments` are those of SoftVTEnv. `max_episode_steps` truncates episodes after so many calls of `step`, before the budget of their
        task."""
        num_envs = whole_number("num_envs", num_envs, 1)
        if max_episode_steps is not None:
            max_episode_steps = whole_number("max_episode_steps", max_episode_steps, 1)
        if not isinstance(autoreset_mode, AutoresetMode):
            require_one_of("autoreset_mode", autoreset_mode, [mode.value for mode in AutoresetMode])
        self.envs: list[SoftVTEnv] = []
        try:
            for _ in range(num_envs):
                self.envs.append(SoftVTEnv(**arguments))
        except BaseException:
            self.close_extras()
            raise
        first = self.envs[0]
        self.num_envs = num_envs
        self.autoreset_mode = AutoresetMode(autoreset_mode)
        self.metadata = {**first.metadata, "autoreset_mode": self.autoreset_mode}
        self.render_mode = first.render_mode
        self.single_observation_space, self.single_action_space = first.observation_space, first.action_space
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._max_steps = max_episode_steps
        self._steps = np.zeros(num_envs, dtype=np.int64)
        self._ended = np.zeros(num_envs, dtype=np.bool_)
        self._observations: list[Any] = [None] * num_envs

    def reset(self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """Starts an episode in each environment, or in those of the mask `options["reset_mask"]`. A single seed is that of the first one, and
        the others have the following ones."""
        if seed is None:
            seeds: Sequence[int | None] = [None] * self.num_envs
        elif isinstance(seed, Sequence | np.ndarray):
            seeds = list(seed)
        else:
            first = whole_number("seed", seed, 0)
            seeds = [first + index for index in range(self.num_envs)]
        if len(seeds) != self.num_envs:
            raise ValueError(f"reset: {len(seeds)} seeds for {self.num_envs} environments")
        if options is not None and not isinstance(options, Mapping):
            raise ValueError(f"reset: options: expected a dict, got {options!r}")
        options = dict(options or {})
        chosen = self._chosen(options.pop("reset_mask", None))
        self._begin_all(chosen, lambda index: self.envs[index].begin_reset(seeds[index], options), self._end_reset)
        infos: dict[str, Any] = {}
        for index, info in self._wait(chosen, self._end_reset).items():
            infos = self._add_info(infos, info, index)
        return self._batch(), infos

    def step(self, actions: Any) -> tuple[Any, np.ndarray, np.ndarray, np.ndarray, dict[str, Any]]:
        """Executes an action in each environment. An environment whose episode has ended is reset as the autoreset mode says. Raises ValueError for an
        action that is not possible, with the number of its environment; then none has stepped."""
        if self.autoreset_mode == AutoresetMode.DISABLED and self._ended.any():
            raise RuntimeError("step: an episode has ended; reset it first, by options={'reset_mask': …}")
        if len(actions) != self.num_envs:
            raise ValueError(f"step: {len(actions)} actions for {self.num_envs} environments")
        restarting = self._ended.copy()
        rewards = np.zeros(self.num_envs)
        terminated, truncated = np.zeros((2, self.num_envs), dtype=np.bool_)

        def end(index: int) -> dict[str, Any]:
            if restarting[index]:
                return self._end_reset(index)
            self._observations[index], rewards[index], terminated[index], truncated[index], info = self.envs[index].end_step()
            self._steps[index] += 1
            if self._max_steps is not None and self._steps[index] >= self._max_steps and not terminated[index]:
                truncated[index] = True
            return info

        each = [*iterate(self.action_space, actions)]
        for index, action in enumerate(each):
            if not restarting[index]:
                try:
                    self.envs[index].require_action(action)
                except ValueError as error:
                    raise ValueError(f"step: environment {index}: {error}") from None
        self._begin_all(
            range(self.num_envs),
            lambda index: self.envs[index].begin_reset() if restarting[index] else self.envs[index].begin_step(each[index]),
            end,
        )
        found = self._wait(range(self.num_envs), end)
        infos: dict[str, Any] = {}
        self._ended = terminated | truncated
        if self.autoreset_mode == AutoresetMode.SAME_STEP:
            ended = [int(index) for index in np.flatnonzero(self._ended)]
            for index in ended:
                infos = self._add_info(infos, {"final_obs": self._observations[index], "final_info": found[index]}, index)
                self.envs[index].begin_reset()
            found |= self._wait(ended, self._end_reset)
        for index, info in found.items():
            infos = self._add_info(infos, info, index)
        return self._batch(), rewards, terminated, truncated, infos

    def set_state(self, states: Sequence[dict[str, Any]]) -> tuple[Any, dict[str, Any]]:
        """Restores a state of each environment, of `call("get_state")`, also after the end of its episode; returns what `reset` does."""
        if not isinstance(states, Sequence) or len(states) != self.num_envs:
            found = f"{len(states)} states" if isinstance(states, Sequence) else f"a {type(states).__name__}"
            raise ValueError(f"set_state: {found} for {self.num_envs} environments; give a list of one state for each")
        infos: dict[str, Any] = {}
        for index, (env, state) in enumerate(zip(self.envs, states)):
            self._observations[index], info = env.set_state(state)
            self._steps[index] = 0
            # A state may be that of the end.
            self._ended[index] = "record" in info
            infos = self._add_info(infos, info, index)
        return self._batch(), infos

    def render(self) -> tuple[Any, ...] | None:
        """Images of all environments."""
        return None if self.render_mode is None else self.call("render")

    def call(self, name: str, *arguments: Any, **named: Any) -> tuple[Any, ...]:
        """Calls a method of each environment, or reads an attribute. Raises ValueError for the methods that the vector has itself, since it keeps
        count of the episodes."""
        if name in ("reset", "step", "set_state"):
            raise ValueError(f"call: {name!r} of single environments leaves the vector behind; call {name} of the vector itself")
        found = [getattr(env, name) for env in self.envs]
        return tuple(value(*arguments, **named) if callable(value) else value for value in found)

    def get_attr(self, name: str) -> tuple[Any, ...]:
        """An attribute of each environment."""
        return tuple(getattr(env, name) for env in self.envs)

    def set_attr(self, name: str, values: Any) -> None:
        """Sets an attribute of each environment, to one value or to a list of values."""
        each = values if isinstance(values, list | tuple) else [values] * self.num_envs
        for env, value in zip(self.envs, each, strict=True):
            setattr(env, name, value)

    def close_extras(self, **_: Any) -> None:
        """Closes all environments."""
        for env in self.envs:
            env.close()

    def _chosen(self, reset_mask: Any) -> list[int]:
        """The environments that a mask resets. Raises ValueError for anything else than a bool for each environment, and for a mask that leaves
        an environment without its first episode."""
        if reset_mask is None:
            return list(range(self.num_envs))
        mask = np.asarray(reset_mask)
        if mask.dtype != np.bool_ or mask.shape != (self.num_envs,):
            raise ValueError(f"reset: reset_mask={reset_mask!r}: expected {self.num_envs} bools, one for each environment")
        if not mask.any():
            raise ValueError("reset: reset_mask selects no environment")
        if any(observation is None and not chosen for observation, chosen in zip(self._observations, mask, strict=True)):
            raise ValueError("reset: reset_mask leaves out an environment that has had no episode; leave out the mask of the first reset")
        return [int(index) for index in np.flatnonzero(mask)]

    def _begin_all(self, indices: Sequence[int], begin: Callable[[int], None], end: Callable[[int], dict[str, Any]]) -> None:
        """Sends a request for each of these environments. If one fails, the answers to those before are read, so that none is left for a later
        request."""
        for number, index in enumerate(indices):
            try:
                begin(index)
            except BaseException:
                self._wait(indices[:number], end)
                raise

    def _wait(self, indices: Iterable[int], end: Callable[[int], dict[str, Any]]) -> dict[int, dict[str, Any]]:
        """Reads the answers of all these environments. The first error is raised after that, so that no answer is left for a later request.
        A refusal of the server names its environment."""
        found: dict[int, dict[str, Any]] = {}
        first: Exception | None = None
        for index in indices:
            try:
                found[index] = end(index)
            except ServerError as error:
                first = first or ServerError(f"environment {index}: {error}")
            except Exception as error:
                first = first or error
        if first is not None:
            raise first
        return found

    def _end_reset(self, index: int) -> dict[str, Any]:
        self._observations[index], info = self.envs[index].end_reset()
        self._steps[index] = 0
        self._ended[index] = False
        return info

    def _batch(self) -> Any:
        batch: Any = create_empty_array(self.single_observation_space, self.num_envs)
        return concatenate(self.single_observation_space, self._observations, batch)
