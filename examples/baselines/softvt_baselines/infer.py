"""Answers of a checkpoint to batches of observations."""

import numpy as np
import torch

from . import UserError, prompts
from .checkpoint import Checkpoint
from .data import has_closure
from .inputs import read
from .serve import Plan, Request

BATCH = 16  # observations that are answered together


def blended(actions: np.ndarray, step: int, last: Plan | None, shares: np.ndarray) -> np.ndarray:
    """Actions (chunk, 7) from a step on, with a share (7,) of those that the last answer had planned for the same steps.

    A policy that replans every few steps then moves without jerks, as with the temporal ensemble of ACT (Zhao et al., 2023).
    """
    if last is None or not 0 < step - last.step < len(last.actions):
        return actions
    planned, found = last.actions[step - last.step :], actions.copy()
    found[: len(planned)] += shares * (planned - found[: len(planned)])
    return found


class Answering:
    """Runs a checkpoint. `blend` is the share of the last answer in the next one.

    Every batch has the same size, padded with copies, and kernels are deterministic: an answer does not depend on the other
    observations that are answered with it, so that runs are repeatable to the byte.
    """

    def __init__(self, checkpoint: Checkpoint, device: torch.device, blend: float = 0.0):
        self.checkpoint, self.device = checkpoint, device
        # The number of the gripper is blended where it is a closure; elsewhere it switches.
        self.shares = np.float32([blend] * 6 + [blend if has_closure(checkpoint.policy.shape.code) else 0])
        self.vocabulary = prompts.Vocabulary(checkpoint.prompts)
        torch.backends.cudnn.benchmark = False
        torch.backends.cudnn.deterministic = True

    def __call__(self, batch: list[Request]) -> list[np.ndarray | UserError]:
        """A chunk (chunk, 7) per request, or the reason why there is none; at most BATCH requests."""
        inputs: list[dict | UserError] = []
        for request in batch:
            try:
                inputs.append(read(request.obs, self.checkpoint.policy.shape, self.checkpoint.statistics, self.vocabulary))
            except UserError as error:
                inputs.append(error)
        valid = [one for one in inputs if isinstance(one, dict)]
        chunks = iter(self._chunks(valid) if valid else [])
        return [
            blended(next(chunks), request.obs["softvt"]["step"], request.last, self.shares) if isinstance(one, dict) else one
            for request, one in zip(batch, inputs)
        ]

    def _chunks(self, inputs: list[dict[str, np.ndarray]]) -> np.ndarray:
        padded = inputs + inputs[:1] * (BATCH - len(inputs))
        tensors = {key: torch.from_numpy(np.concatenate([one[key] for one in padded])).to(self.device) for key in padded[0]}
        answers = self.checkpoint.policy.act(tensors, tensors["noise"]).float().cpu().numpy()
        changes = self.checkpoint.statistics.action.invert(answers[: len(inputs)])
        return changes + np.concatenate([one["reference"] for one in inputs])
