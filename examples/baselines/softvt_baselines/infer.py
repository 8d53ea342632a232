"""Answers of a checkpoint to batches of observations."""

import numpy as np
import torch

from . import UserError, prompts
from .checkpoint import Checkpoint
from .inputs import read

BATCH = 16  # observations that are answered together


class Answering:
    """Runs a checkpoint.

    Every batch has the same size, padded with copies, and kernels are deterministic: an answer does not depend on the other
    observations that are answered with it, so that runs are repeatable to the byte.
    """

    def __init__(self, checkpoint: Checkpoint, device: torch.device):
        self.checkpoint, self.device = checkpoint, device
        self.vocabulary = prompts.Vocabulary(checkpoint.prompts)
        torch.backends.cudnn.benchmark = False
        torch.backends.cudnn.deterministic = True

    def __call__(self, batch: list[dict]) -> list[np.ndarray | UserError]:
        """A chunk (chunk, 7) per observation, or the reason why there is none; at most BATCH observations."""
        inputs: list[dict | UserError] = []
        for obs in batch:
            try:
                inputs.append(read(obs, self.checkpoint.policy.shape, self.checkpoint.statistics, self.vocabulary))
            except UserError as error:
                inputs.append(error)
        valid = [one for one in inputs if isinstance(one, dict)]
        chunks = iter(self._chunks(valid) if valid else [])
        return [next(chunks) if isinstance(one, dict) else one for one in inputs]

    def _chunks(self, inputs: list[dict[str, np.ndarray]]) -> np.ndarray:
        padded = inputs + inputs[:1] * (BATCH - len(inputs))
        tensors = {key: torch.from_numpy(np.concatenate([one[key] for one in padded])).to(self.device) for key in padded[0]}
        answers = self.checkpoint.policy.act(tensors, tensors["noise"]).float().cpu().numpy()
        changes = self.checkpoint.statistics.action.invert(answers[: len(inputs)])
        return changes + np.concatenate([one["reference"] for one in inputs])
