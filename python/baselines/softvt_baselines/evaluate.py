"""Evaluation: serves a checkpoint and runs softvt against it."""

import hashlib
import os
import re
import subprocess
import sys
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from . import UserError


def softvt_binary() -> str:
    """The command softvt, or what SOFTVT names."""
    return os.environ.get("SOFTVT", "softvt")


def run_softvt(words: list[str]) -> None:
    """Runs softvt. Raises UserError if it is not installed or fails; its own message is on standard error."""
    try:
        code = subprocess.run([softvt_binary(), *words]).returncode
    except FileNotFoundError:
        raise UserError("softvt was not found; install it (cargo install --path .), or set SOFTVT to its path") from None
    if code != 0:
        raise UserError(f"softvt {' '.join(words)} ended with exit code {code}")


def camera_flags(edge: int) -> list[str]:
    """Settings with which softvt renders pictures of `edge` pixels."""
    return ["--set", f"cameras.width={edge}", "--set", f"cameras.height={edge}"]


def recording_flags(demos: int, edge: int, teacher: str, keep: str, disturbance: float) -> list[str]:
    """Flags of softvt record. `teacher` is a built-in policy, or "suite" for that of the suite; `keep` is "safe" or "goal"; `disturbance` is the
    deviation of the robot from its commands, m and 4 rad/m."""
    moves = ["--set", f"robot.disturbance.position={disturbance}", "--set", f"robot.disturbance.rotation={4 * disturbance}"]
    demonstrates = [] if teacher == "suite" else ["--policy", teacher]
    return [*demonstrates, "--keep", keep, "--demos", str(demos), "--no-privileged", *camera_flags(edge), *moves]


@contextmanager
def served(path: Path, device: str, blend: float):
    """A server of a checkpoint in a process of its own; gives its address."""
    words = [sys.executable, "-m", "softvt_baselines", "serve", str(path), "--device", device, "--blend", str(blend), "--port", "0"]
    server = subprocess.Popen(words, stdout=subprocess.PIPE, text=True)
    try:
        for line in server.stdout:
            if found := re.search(r"ws://\S+", line):
                yield found.group()
                return
        raise UserError(f"the server of {path} did not start")
    finally:
        server.terminate()
        server.wait()


@dataclass
class Evaluation:
    """A checkpoint, and the suites on which it is evaluated."""

    checkpoint: Path
    profile: Path
    edge: int  # pixels of a picture
    scripts: list[str]  # suites or conditions of softvt
    name: str  # of the policy in results
    out: Path
    flags: list[str]  # further flags of softvt
    device: str
    blend: float  # share of the last answer in the next one


def evaluate(one: Evaluation) -> None:
    """Evaluates a checkpoint on all scripts, each in a folder below `out`. Raises UserError if its profile is missing."""
    if not one.profile.is_file():
        raise UserError(f"{one.profile}: no such profile; train writes it next to the checkpoint")
    # softvt refuses to continue a run with another profile, and so with other weights.
    weights = hashlib.sha256(one.checkpoint.read_bytes()).hexdigest()
    profile = one.out / "profile.lua"
    one.out.mkdir(parents=True, exist_ok=True)
    profile.write_text(f"{one.profile.read_text()}-- Weights {weights}, blend {one.blend}.\n")
    own = ["--profile", str(profile), "--name", one.name, *camera_flags(one.edge)]
    with served(one.checkpoint, one.device, one.blend) as address:
        os.nice(10)  # inherited by softvt, whose threads wait for the server
        for script in one.scripts:
            run_softvt([script, "--policy", address, *own, "--out", str(one.out / Path(script).stem), *one.flags])
