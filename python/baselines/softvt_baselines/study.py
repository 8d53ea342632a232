"""A study: records suites, trains the policies of a list on all GPUs, and evaluates them.

Everything that is complete in the folder of the study is kept, so a study that was interrupted continues.
"""

import itertools
import json
import os
import queue
import subprocess
import sys
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from . import UserError
from .data import pack
from .evaluate import recording_flags, run_softvt

# Script that runs a suite under conditions.
SHIFTS = "shifts"
# Options that all results in the folder of a study have in common.
SAME = ["demos", "steps", "edge", "teacher", "disturbance", "blend", "episodes"]


@dataclass
class Study:
    """What a study compares. Every combination is one policy."""

    suites: list[str]
    inputs: list[str]  # "vo", "vp", "vt", "vpt": vision only, with the drives, with touch, with both
    seeds: list[int]
    codes: list[str]
    replans: list[int]
    out: Path
    demos: int
    steps: int
    episodes: int
    edge: int = 128
    teacher: str = "suite"  # built-in policy that demonstrates; "suite": that of the suite
    disturbance: float = 0.002  # m
    blend: float = 0.5  # share of the last answer in the next one
    per_gpu: int = 1  # policies that are trained on one GPU at a time
    shifts: bool = False  # evaluate also under the standard conditions of suites/shifts.lua, with the first of `replans`
    references: tuple[str, ...] = ()  # built-in policies that are evaluated as well
    compile: bool = False  # compile the networks
    flags: tuple[str, ...] = ()  # further flags of the evaluations of learned policies


@dataclass(frozen=True)
class Job:
    suite: str
    inputs: str
    code: str
    seed: int

    @property
    def name(self) -> str:
        return f"{self.suite}-{self.inputs}-{self.code}-s{self.seed}"


def _call(words: list[str], log: Path, gpu: int | None = None) -> None:
    """Runs a command of this package with its output in a log."""
    visible = [name for name in os.environ.get("CUDA_VISIBLE_DEVICES", "").split(",") if name]
    own = {} if gpu is None else {"CUDA_VISIBLE_DEVICES": visible[gpu] if visible else str(gpu)}
    environment = os.environ | own
    with open(log, "a") as file:
        code = subprocess.run([sys.executable, "-m", "softvt_baselines", *words], stdout=file, stderr=file, env=environment).returncode
    if code != 0:
        last = log.read_text().strip().splitlines()[-1:]
        raise UserError(f"{' '.join(words[:2])}: exit code {code}: {''.join(last)}; see {log}")


def _train(job: Job, study: Study, gpu: int | None) -> None:
    checkpoint = study.out / "checkpoints" / f"{job.name}.pt"
    if checkpoint.is_file():
        return
    switches = ["--touch"] * ("t" in job.inputs) + ["--drives"] * ("p" in job.inputs) + ["--compile"] * study.compile
    shape = ["--gripper", job.code, "--edge", str(study.edge), "--steps", str(study.steps), "--seed", str(job.seed), *switches]
    words = ["train", str(study.out / "data" / job.suite), "--out", str(checkpoint), "--device", _device(gpu), *shape]
    _call(words, study.out / "logs" / f"{job.name}.log", gpu)


def _evaluate(job: Job, replan: int, script: str, study: Study, threads: int, gpu: int | None) -> None:
    name = f"{job.name}-r{replan}"
    words = ["evaluate", str(study.out / "checkpoints" / f"{job.name}.pt"), f"suites/{script}.lua"]
    words += ["--out", str(study.out / "runs" / name), "--name", name, "--device", _device(gpu), "--blend", str(study.blend)]
    flags = ["--replan", str(replan), "--episodes", str(study.episodes), "--threads", str(threads), "--resume", *study.flags]
    flags += ["--suite", job.suite] * (script == SHIFTS)
    _call([*words, "--", *flags], study.out / "logs" / f"{name}-{script}.log", gpu)
    print(f"evaluated {name} on {script}", flush=True)


def _evaluate_reference(suite: str, policy: str, study: Study, threads: int, gpu: int | None) -> None:
    name = f"{suite}-{policy}"
    words = [f"suites/{suite}.lua", "--policy", policy, "--out", str(study.out / "runs" / name), "--name", name]
    run_softvt([*words, "--episodes", str(study.episodes), "--threads", str(threads), "--resume"])
    print(f"evaluated {name}", flush=True)


def _device(gpu: int | None) -> str:
    return "cpu" if gpu is None else "cuda"


class _Workers:
    """Threads that take jobs in the order in which they were added. Each has a GPU, which several may share."""

    def __init__(self, gpus: list[int | None]):
        self.pool = ThreadPoolExecutor(len(gpus))
        self.free: queue.SimpleQueue[int | None] = queue.SimpleQueue()
        self.jobs: list[Future] = []
        for gpu in gpus:
            self.free.put(gpu)

    def add(self, work: Callable[[int | None], None]) -> None:
        def run() -> None:
            gpu = self.free.get()
            try:
                work(gpu)
            except UserError as error:
                print(error, file=sys.stderr, flush=True)
                raise
            finally:
                self.free.put(gpu)

        self.jobs.append(self.pool.submit(run))

    def problems(self) -> list[str]:
        """Waits for all jobs. Returns the errors."""
        return [str(error) for job in self.jobs if (error := job.exception())]

    def cancel(self) -> None:
        """Drops the jobs that have not begun."""
        self.pool.shutdown(wait=False, cancel_futures=True)


def _check_options(study: Study) -> None:
    """Raises UserError if the folder has results of a study with other options."""
    path, options = study.out / "study.json", {key: getattr(study, key) for key in SAME}
    if not path.is_file():
        path.write_text(json.dumps(options, indent=1) + "\n")
        return
    before = json.loads(path.read_text())
    if changed := [f"{key} {before.get(key)}, now {value}" for key, value in options.items() if before.get(key) != value]:
        raise UserError(f"{study.out} has a study with other options ({'; '.join(changed)}); choose another --out")


def _record(suite: str, study: Study) -> None:
    recording = study.out / "data" / suite
    if not (recording / "dataset.json").is_file():
        flags = ["--out", str(recording), "--resume", *recording_flags(study.demos, study.edge, study.teacher, study.disturbance)]
        run_softvt(["record", f"suites/{suite}.lua", *flags])
    pack(recording, study.edge, os.cpu_count() or 1)
    print(f"recorded {suite}", flush=True)


def run(study: Study) -> None:
    """Runs a study: evaluations of the first policies beside the training of the next ones.

    Raises UserError naming what failed.
    """
    import torch

    gpus: list[int | None] = list(range(torch.cuda.device_count())) or [None]
    # Threads that wait for answers leave their core to others.
    threads = max(1, 2 * (os.cpu_count() or 1) // len(gpus))
    for folder in ("data", "logs", "runs", "checkpoints"):
        (study.out / folder).mkdir(parents=True, exist_ok=True)
    _check_options(study)
    training, evaluation = _Workers(gpus * study.per_gpu), _Workers(gpus)

    def add(job: Job) -> None:
        def train(gpu: int | None) -> None:
            _train(job, study, gpu)
            # Evaluations begin while later policies are trained.
            for replan in study.replans:
                evaluation.add(partial(_evaluate, job, replan, job.suite, study, threads))
            if study.shifts:
                evaluation.add(partial(_evaluate, job, study.replans[0], SHIFTS, study, threads))

        training.add(train)

    problems = []
    try:
        for suite in study.suites:
            try:
                _record(suite, study)
            except UserError as error:
                problems.append(str(error))
                continue
            for policy in study.references:
                evaluation.add(partial(_evaluate_reference, suite, policy, study, threads))
            for seed, code, inputs in itertools.product(study.seeds, study.codes, study.inputs):
                add(Job(suite, inputs, code, seed))
        problems += training.problems() + evaluation.problems()
    except KeyboardInterrupt:
        training.cancel()
        evaluation.cancel()
        raise
    if problems:
        raise UserError(f"{len(problems)} recordings, policies or runs are not complete: {'; '.join(problems)}")
