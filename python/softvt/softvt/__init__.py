"""softvt from Python: its tasks as Gymnasium environments, its servers, and its recordings. docs/python.md is the guide.

import gymnasium, softvt

env = gymnasium.make("softvt/ObjectHidden-v0", task=3, obs="pixels+proprio", control="delta", reward="staged")
"""

from importlib.metadata import PackageNotFoundError, version

from .binary import find_binary, run
from .dataset import Dataset
from .env import SoftVTEnv
from .readings import Readings
from .serve import Client, Server, ServerError, ServerLostError
from .suites import SUITES, environment_id, register
from .vector import SoftVTVectorEnv

try:
    __version__ = version("softvt")
except PackageNotFoundError:
    __version__ = "0"

register()

__all__ = [
    "SUITES",
    "Client",
    "Dataset",
    "Readings",
    "Server",
    "ServerError",
    "ServerLostError",
    "SoftVTEnv",
    "SoftVTVectorEnv",
    "environment_id",
    "find_binary",
    "run",
]
