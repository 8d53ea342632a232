"""Answers of a checkpoint to batches of observations."""

import numpy as np
import torch

from . import UserError, prompts
from .checkpoint import Checkpoint
from .inputs import read
from .model import Policy
from .numbers import FINE, coarse, turned
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
        self.shares = np.float32([blend] * 6 + [blend if checkpoint.policy.shape.code == "continuous" else 0])
        self.vocabulary = prompts.Vocabulary(checkpoint.prompts)
        torch.backends.cudnn.benchmark = False
        torch.backends.cudnn.deterministic = True
        self.graph: Graph | None = None

    def __call__(self, batch: list[Request]) -> list[np.ndarray | UserError]:
        """A chunk (chunk, 7) per request, or the reason why one is missing; at most BATCH requests."""
        inputs: list[dict | UserError] = []
        for request in batch:
            try:
                inputs.append(self._read(request))
            except UserError as error:
                inputs.append(error)
        valid = [one for one in inputs if isinstance(one, dict)]
        chunks = iter(self._chunks(valid) if valid else [])
        return [
            blended(next(chunks), request.obs["softvt"]["step"], request.last, self.shares) if isinstance(one, dict) else one
            for request, one in zip(batch, inputs)
        ]

    def _read(self, request: Request) -> dict[str, np.ndarray]:
        """The inputs of the network for a request, which gets the memory after it."""
        shape, last, before = self.checkpoint.policy.shape, request.last, None
        if shape.has_memory and last is not None:
            executed, most = request.obs.get("softvt", {}).get("step", 0) - last.step, shape.most_executed
            if not 0 < executed <= most:
                raise UserError(
                    f"{executed} steps after an answer of {len(last.actions)} actions: this policy remembers and needs --replan {most} or less"
                )
            before = last.memory, last.actions[:executed]
        inputs, request.memory = read(request.obs, shape, self.checkpoint.statistics, self.vocabulary, before)
        return inputs

    def _chunks(self, inputs: list[dict[str, np.ndarray]]) -> np.ndarray:
        padded = inputs + inputs[:1] * (BATCH - len(inputs))
        tensors = {key: torch.from_numpy(np.concatenate([one[key] for one in padded])).to(self.device) for key in padded[0]}
        answers = self._act(tensors).float().cpu().numpy()
        statistics, answers = self.checkpoint.statistics, answers[: len(inputs)]
        changes = statistics.action.invert(answers)
        if self.checkpoint.policy.shape.has_memory:
            seen = np.concatenate([one["seen"] for one in inputs])[:, None, None] > 0
            changes = np.where(seen, changes, statistics.felt.invert(answers))
            # Those of a hand that feels are along its axes.
            back = np.concatenate([np.eye(3)[None] if one["seen"] else one["axes"].transpose(0, 2, 1) for one in inputs])
            changes = turned(coarse(changes, FINE), back)
        return changes + np.concatenate([one["reference"] for one in inputs])

    def _act(self, inputs: dict[str, torch.Tensor]) -> torch.Tensor:
        if self.device.type != "cuda":
            return self.checkpoint.policy.act(inputs, inputs["noise"])
        with torch.cuda.device(self.device):
            if self.graph is None:
                self.graph = Graph(self.checkpoint.policy, inputs)
            return self.graph(inputs)


class Graph:
    """A policy captured as a CUDA graph: its kernels start without waiting for the processor, which simulates meanwhile."""

    def __init__(self, policy: Policy, inputs: dict[str, torch.Tensor]):
        """Captures a policy for inputs of these shapes."""
        self.inputs = {key: value.clone() for key, value in inputs.items()}
        stream = torch.cuda.Stream()
        stream.wait_stream(torch.cuda.current_stream())
        with torch.cuda.stream(stream):
            for _ in range(3):  # libraries allocate their memory in the first calls
                policy.act(self.inputs, self.inputs["noise"])
        torch.cuda.current_stream().wait_stream(stream)
        self.graph = torch.cuda.CUDAGraph()
        with torch.cuda.graph(self.graph):
            self.answers = policy.act(self.inputs, self.inputs["noise"])

    def __call__(self, inputs: dict[str, torch.Tensor]) -> torch.Tensor:
        for key, value in inputs.items():
            self.inputs[key].copy_(value)
        self.graph.replay()
        return self.answers
