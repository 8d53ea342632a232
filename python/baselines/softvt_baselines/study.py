"""A study: records suites, trains the policies of a list on all GPUs, and evaluates them.

Everything that is complete in the folder of the study is kept, so a study that was interrupted continues. A queue is a list of studies, which
stops in time.
"""

import hashlib
import itertools
import json
import os
import platform
import queue
import shlex
import subprocess
import sys
import time
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from . import UserError, processors
from .data import pack
from .evaluate import recording_flags, run_softvt

# Script that runs a suite under conditions.
SHIFTS = "shifts"
# Options that all results in the folder of a study have in common.
SAME = [
    "demos",
    "steps",
    "edge",
    "teacher",
    "keep",
    "disturbance",
    "blend",
    "episodes",
    "task",
    "memory",
    "attempts",
    "scenes",
    "ways",
    "frames",
]
# Switches of train by the letters of inputs.
SWITCHES = {"p": ["--drives"], "t": ["--touch", "markers"], "b": ["--touch", "contact"], "i": ["--touch", "pictures"]}
# File in the folder of a run with the origin of its results.
ORIGIN = "origin.json"


@dataclass
class Study:
    """What a study compares. Every combination is one policy."""

    suites: list[str]
    inputs: list[str]  # "v", and the letters of SWITCHES: what is added to vision; "vo": nothing
    seeds: list[int]
    codes: list[str]
    replans: list[int]
    out: Path
    demos: int
    steps: int
    episodes: int
    edge: int = 128
    teacher: str = "suite"  # built-in policy that demonstrates; "suite": that of the suite
    keep: str = "safe"  # demonstrations to keep: "safe", or "goal" for all that reach it
    disturbance: float = 0.002  # m
    blend: float = 0.5  # share of the last answer in the next one
    per_gpu: int = 1  # policies that are trained on one GPU at a time
    shifts: bool = False  # evaluate also under the standard conditions of suites/shifts.lua, with the first of `replans`
    references: tuple[str, ...] = ()  # built-in policies that are evaluated as well
    compile: bool = False  # compile the networks
    seconds: float = float("inf")  # time that training a policy may take
    task: str = ""  # only these tasks: indices, separated by commas
    memory: bool = False  # policies from demonstrations of `demonstrate`, which remember, except in codes in which the hand closes at once
    attempts: int = 100  # of the teacher per task, for these
    scenes: int = 200  # with ways to the object, per task
    ways: int = 4  # per scene
    frames: int = 1  # control steps whose pictures and states a policy sees
    flags: tuple[str, ...] = ()  # further flags of the evaluations of learned policies
    until: float = float("inf")  # time (time.monotonic()) after which no further part is begun


@dataclass(frozen=True)
class Job:
    suite: str
    inputs: str
    code: str
    seed: int
    frames: int
    teacher: str  # as in Study

    @property
    def name(self) -> str:
        """The inputs are followed by the number of frames if there are several, the grip code by the teacher if it is not that of the suite."""
        frames, by = self.frames if self.frames > 1 else "", f"-by-{self.teacher}" if self.teacher != "suite" else ""
        return f"{self.suite}-{self.inputs}{frames}-{self.code}{by}-s{self.seed}"


class OutOfTime(UserError):
    """A part was not begun, since the time was up."""


def _note(study: Study, text: str, began: float) -> None:
    print(f"{study.out.name}: {text}; {time.monotonic() - began:.0f} s", flush=True)


def _check_time(study: Study) -> None:
    if time.monotonic() > study.until:
        raise OutOfTime("the time was up")


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
    _check_time(study)
    began = time.monotonic()
    switches = [word for letter in job.inputs for word in SWITCHES.get(letter, [])] + ["--compile"] * study.compile
    switches += ["--memory"] * (study.memory and job.code == "continuous") + (
        ["--seconds", str(study.seconds)] if study.seconds < float("inf") else []
    )
    shape = ["--gripper", job.code, "--edge", str(study.edge), "--steps", str(study.steps), "--seed", str(job.seed), *switches]
    shape += ["--frames", str(study.frames)]
    words = ["train", str(_recording(job.suite, job.code, study)), "--out", str(checkpoint), "--device", _device(gpu), *shape]
    _call(words, study.out / "logs" / f"{job.name}.log", gpu)
    _note(study, f"trained {job.name}", began)


def _machine() -> str:
    """The processor and the GPUs of this machine, in words."""
    try:
        words = ["nvidia-smi", "--query-gpu=name", "--format=csv,noheader"]
        gpus = subprocess.run(words, capture_output=True, text=True).stdout.split("\n")
    except FileNotFoundError:
        gpus = []
    return f"{os.cpu_count()} processors ({platform.machine()}), {', '.join(filter(None, gpus)) or 'no GPU'}"


def _write_origin(run: Path, checkpoint: Path | None) -> None:
    """Writes where the results of a run come from. SOFTVT_COMMIT names the commit of softvt."""
    origin = {"machine": _machine(), "commit": os.environ.get("SOFTVT_COMMIT")}
    if checkpoint is not None:
        origin["checkpoint_sha256"] = hashlib.sha256(checkpoint.read_bytes()).hexdigest()
    (run / ORIGIN).write_text(json.dumps(origin, indent=1) + "\n")


def _evaluate(job: Job, replan: int, script: str, study: Study, threads: int, gpu: int | None) -> None:
    name = f"{job.name}-r{replan}"
    run, checkpoint = study.out / "runs" / name / script, study.out / "checkpoints" / f"{job.name}.pt"
    if (run / ORIGIN).is_file():
        return
    _check_time(study)
    began = time.monotonic()
    words = ["evaluate", str(study.out / "checkpoints" / f"{job.name}.pt"), f"suites/{script}.lua"]
    words += ["--out", str(study.out / "runs" / name), "--name", name, "--device", _device(gpu), "--blend", str(study.blend)]
    flags = ["--replan", str(replan), "--episodes", str(study.episodes), "--threads", str(threads), "--resume", *study.flags]
    flags += ["--suite", job.suite] * (script == SHIFTS)
    flags += ["--task", study.task] if study.task else []
    _call([*words, "--", *flags], study.out / "logs" / f"{name}-{script}.log", gpu)
    _write_origin(run, checkpoint)
    _note(study, f"evaluated {name} on {script}", began)


def _evaluate_reference(suite: str, policy: str, study: Study, threads: int, gpu: int | None) -> None:
    name = f"{suite}-{policy}"
    run = study.out / "runs" / name
    if (run / ORIGIN).is_file():
        return
    _check_time(study)
    began = time.monotonic()
    words = [f"suites/{suite}.lua", "--policy", policy, "--out", str(run), "--name", name, *(["--task", study.task] if study.task else [])]
    run_softvt([*words, "--episodes", str(study.episodes), "--threads", str(threads), "--resume"])
    _write_origin(run, None)
    _note(study, f"evaluated {name}", began)


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
            except OutOfTime:
                raise
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
    # Those that studies did not have at first are at their defaults.
    before = {key: getattr(Study, key, None) for key in SAME} | before
    if changed := [f"{key} {before[key]}, now {value}" for key, value in options.items() if before[key] != value]:
        raise UserError(f"{study.out} has a study with other options ({'; '.join(changed)}); choose another --out")


def _recording(suite: str, code: str, study: Study) -> Path:
    """The recording for policies of a grip code. `softvt record` has the actions in all codes, `demonstrate` makes a recording for each."""
    return study.out / "data" / (f"{suite}-{code}" if study.memory and code != "continuous" else suite)


def _record(suite: str, code: str, study: Study) -> None:
    recording = _recording(suite, code, study)
    if (recording / "dataset.json").is_file():
        pack(recording, study.edge, processors())
        return
    _check_time(study)
    began = time.monotonic()
    if study.memory:
        words = ["demonstrate", f"suites/{suite}.lua", "--out", str(recording), "--attempts", str(study.attempts)]
        words += ["--scenes", str(study.scenes), "--ways", str(study.ways)]
        words += ["--edge", str(study.edge), "--disturbance", str(study.disturbance), *(["--task", study.task] if study.task else [])]
        words += ["--teacher", study.teacher] if study.teacher != "suite" else []
        words += ["--frames", str(study.frames), "--gripper", code]
        # Where the hand closes at once, the attempts of the teacher are the same in all codes.
        words += ["--teacher-runs", str(study.out / "data" / f"{suite}-teacher")] if code != "continuous" else []
        words += ["--tactile-pictures"] * any("i" in inputs for inputs in study.inputs)
        _call(words, study.out / "logs" / f"{recording.name}.log")
    else:
        flags = [
            "--out",
            str(recording),
            "--resume",
            *recording_flags(study.demos, study.edge, study.teacher, study.keep, study.disturbance),
        ]
        flags += ["--task", study.task] if study.task else []
        run_softvt(["record", f"suites/{suite}.lua", *flags])
    pack(recording, study.edge, processors())
    _note(study, f"recorded {recording.name}", began)


def run(study: Study) -> None:
    """Runs a study: evaluations of the first policies beside the training of the next ones.

    Raises UserError naming what failed.
    """
    import torch

    gpus: list[int | None] = list(range(torch.cuda.device_count())) or [None]
    # Threads that wait for answers leave their core to others.
    threads = max(1, 2 * processors() // len(gpus))
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
            references, recordings = study.references, {}
            for code in study.codes:
                recordings.setdefault(_recording(suite, code, study), []).append(code)
            for codes in recordings.values():
                try:
                    _record(suite, codes[0], study)
                except UserError as error:
                    problems.append(str(error))
                    continue
                for policy in references:
                    evaluation.add(partial(_evaluate_reference, suite, policy, study, threads))
                references = ()
                for seed, code, inputs in itertools.product(study.seeds, codes, study.inputs):
                    add(Job(suite, inputs, code, seed, study.frames, study.teacher))
        problems += training.problems() + evaluation.problems()
    except KeyboardInterrupt:
        training.cancel()
        evaluation.cancel()
        raise
    if problems:
        if study.until < time.monotonic():
            print(f"{study.out.name}: stopped in time, {len(problems)} parts are left", flush=True)
            return
        raise UserError(f"{len(problems)} recordings, policies or runs are not complete: {'; '.join(problems)}")


def read_queue(path: Path) -> list[list[str]]:
    """The words of each study in a queue: one study per line, its name and its options. A line that begins with # says nothing.

    Raises UserError if the file is missing.
    """
    if not path.is_file():
        raise UserError(f"{path}: no such queue")
    lines = [shlex.split(line, comments=True) for line in path.read_text().splitlines()]
    return [words for words in lines if words]
