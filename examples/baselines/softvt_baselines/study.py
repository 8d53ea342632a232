"""The study of docs/baselines.md: records suites, trains the policies of a list on all GPUs, and evaluates them.

Everything that is complete in the folder of the study is kept, so a study that was interrupted continues.
"""

import os
import queue
import subprocess
import sys
import threading
from dataclasses import dataclass
from pathlib import Path

from . import UserError
from .evaluate import camera_flags, run_softvt


@dataclass
class Study:
    """What a study compares. Every combination is one policy."""

    suites: list[str]
    inputs: list[str]  # "vo", "vt"
    seeds: list[int]
    codes: list[str]
    replans: list[int]
    out: Path
    demos: int
    steps: int
    episodes: int
    edge: int = 128
    per_gpu: int = 1  # policies that are trained on one GPU at a time
    compile: bool = False  # compile the networks
    flags: tuple[str, ...] = ()  # further flags of the evaluations


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
    environment = os.environ | ({} if gpu is None else {"CUDA_VISIBLE_DEVICES": str(gpu)})
    with open(log, "a") as file:
        code = subprocess.run([sys.executable, "-m", "softvt_baselines", *words], stdout=file, stderr=file, env=environment).returncode
    if code != 0:
        last = log.read_text().strip().splitlines()[-1:]
        raise UserError(f"{' '.join(words[:2])}: exit code {code}: {''.join(last)}; see {log}")


def _run_job(job: Job, study: Study, gpu: int | None, threads: int) -> None:
    device = "cpu" if gpu is None else "cuda"
    checkpoint = study.out / "checkpoints" / f"{job.name}.pt"
    log = study.out / "logs" / f"{job.name}.log"
    if not checkpoint.is_file():
        switches = ["--touch"] * (job.inputs == "vt") + ["--compile"] * study.compile
        shape = ["--gripper", job.code, "--edge", str(study.edge), "--steps", str(study.steps), "--seed", str(job.seed), *switches]
        _call(["train", str(study.out / "data" / job.suite), "--out", str(checkpoint), "--device", device, *shape], log, gpu)
    for replan in study.replans:
        name = f"{job.name}-r{replan}"
        flags = ["--replan", str(replan), "--episodes", str(study.episodes), "--threads", str(threads), "--resume", *study.flags]
        run = ["--out", str(study.out / "runs" / name), "--name", name, "--device", device]
        _call(["evaluate", str(checkpoint), f"suites/{job.suite}.lua", *run, "--", *flags], log, gpu)
        print(f"evaluated {name}", flush=True)


def run(study: Study) -> None:
    """Runs a study. Raises UserError naming the jobs that failed."""
    import torch

    gpus: list[int | None] = list(range(torch.cuda.device_count())) * study.per_gpu or [None]
    threads = max(1, (os.cpu_count() or 1) // len(gpus))
    for folder in ("data", "logs", "runs", "checkpoints"):
        (study.out / folder).mkdir(parents=True, exist_ok=True)
    jobs: queue.Queue[Job | None] = queue.Queue()
    problems: list[str] = []

    def work(gpu: int | None) -> None:
        while job := jobs.get():
            try:
                _run_job(job, study, gpu, threads)
            except UserError as error:
                problems.append(f"{job.name}: {error}")
                print(problems[-1], file=sys.stderr, flush=True)

    workers = [threading.Thread(target=work, args=(gpu,)) for gpu in gpus]
    for worker in workers:
        worker.start()
    try:
        for suite in study.suites:
            recording = study.out / "data" / suite
            if not (recording / "dataset.json").is_file():
                flags = ["--out", str(recording), "--demos", str(study.demos), "--no-privileged", "--resume"]
                run_softvt(["record", f"suites/{suite}.lua", *flags, *camera_flags(study.edge)])
            print(f"recorded {suite}", flush=True)
            for seed in study.seeds:
                for code in study.codes:
                    for inputs in study.inputs:
                        jobs.put(Job(suite, inputs, code, seed))
    finally:
        for _ in workers:
            jobs.put(None)
        for worker in workers:
            worker.join()
    if problems:
        raise UserError(f"{len(problems)} policies are not complete: {'; '.join(problems)}")
