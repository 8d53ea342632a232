"""Checkpoints: weights, the shape of the network, normalisation, and what the policy was trained with."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch

from . import UserError
from .data import Statistics
from .inputs import Shape
from .model import Policy
from .numbers import Standard

VERSION = 7


@dataclass
class Checkpoint:
    """A trained policy."""

    policy: Policy
    statistics: Statistics
    prompts: list[str]
    about: dict  # how it was trained


def save(path: Path, checkpoint: Checkpoint) -> None:
    """Writes a checkpoint, its weights in half precision, and next to it the profile of softvt for its inputs."""
    one, statistics = checkpoint, checkpoint.statistics
    content = {
        "version": VERSION,
        "shape": one.policy.shape.to_dict(),
        "weights": {name: value.detach().cpu().half() for name, value in one.policy.state_dict().items()},
        "statistics": {
            "state": [torch.from_numpy(statistics.state.mean), torch.from_numpy(statistics.state.std)],
            "action": [torch.from_numpy(statistics.action.mean), torch.from_numpy(statistics.action.std)],
            "felt": [torch.from_numpy(statistics.felt.mean), torch.from_numpy(statistics.felt.std)],
            "marker_scale": statistics.marker_scale,
            "axis": torch.from_numpy(statistics.axis),
        },
        "prompts": one.prompts,
        "about": one.about,
    }
    profile_of(path).write_text(one.policy.shape.profile(path.stem))
    part = path.with_name(f"{path.name}.part")
    torch.save(content, part)
    part.rename(path)


def profile_of(path: Path) -> Path:
    """The profile of softvt for a checkpoint."""
    return path.with_name(f"{path.name}.lua")


def load(path: Path, device: torch.device) -> Checkpoint:
    """Reads a checkpoint.

    Raises UserError if the file is missing, is not a checkpoint of this version, or does not fit its stated shape.
    """
    if not path.is_file():
        raise UserError(f"{path}: no such checkpoint; softvt-baselines train writes one")
    try:
        content = torch.load(path, map_location="cpu", weights_only=True)
        if content["version"] != VERSION:
            raise UserError(f"{path}: a checkpoint of version {content['version']}, expected {VERSION}; train it again")
        shape = Shape(**content["shape"])
        stated = content["statistics"]
        numbers = {name: Standard(*(part.numpy() for part in stated[name])) for name in ("state", "action", "felt")}
        statistics = Statistics(numbers["state"], numbers["action"], numbers["felt"], float(stated["marker_scale"]), stated["axis"].numpy())
        prompts, about = content["prompts"], content["about"]
        policy = Policy(shape)
        policy.load_state_dict({name: value.float() for name, value in content["weights"].items()})
    except UserError:
        raise
    except KeyError as missing:
        raise UserError(f"{path}: the checkpoint has no {missing.args[0]}; train it again") from None
    except Exception as error:  # torch reports broken and foreign files in many ways
        reason = " ".join(str(error).split())[:200]
        raise UserError(f"{path}: not a checkpoint of this package: {reason}") from None
    if not all(np.isfinite(one.std).all() and (one.std > 0).all() for one in (statistics.action, statistics.felt)):
        raise UserError(f"{path}: the normalisation of its actions is not valid; train it again")
    return Checkpoint(policy.to(device).eval(), statistics, list(prompts), dict(about))


def device_of(name: str) -> torch.device:
    """The device of a name. Raises UserError if it is not there."""
    if name.startswith("cuda") and not torch.cuda.is_available():
        raise UserError("no CUDA GPU is available; pass --device cpu for a small trial")
    try:
        device = torch.device(name)
        torch.zeros(1, device=device)
    except RuntimeError as error:
        raise UserError(f"--device {name}: {str(error).splitlines()[0]}") from None
    return device
