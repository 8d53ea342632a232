"""Commands: record, train, serve, evaluate, study, page."""

import argparse
import asyncio
import sys
from collections.abc import Callable
from pathlib import Path

from . import UserError, processors

CODES = ["continuous", "binary", "two-width", "force"]
# Those in which a grip that was felt can be shown: a binary hand closes with its whole effort.
FELT_CODES = ["continuous", "two-width", "force"]
INPUTS = {
    "vo": "vision only",
    "vp": "vision and drives",
    "vt": "vision and touch",
    "vpt": "all three",
    "vb": "vision and contact bits",
    "vi": "vision and tactile pictures",
}
# Disturbances of recordings, m: of ordinary ones, and of those of a teacher that feels.
DISTURBANCE, FELT_DISTURBANCE = 0.002, 0.00003
REFERENCES = ["expert", "tactile-servo", "fixed-closure", "size-seen"]


def _record(args: argparse.Namespace) -> None:
    from .evaluate import recording_flags, run_softvt

    disturbance = DISTURBANCE if args.disturbance is None else args.disturbance
    run_softvt(
        [
            "record",
            args.suite,
            "--out",
            str(args.out),
            *recording_flags(args.demos, args.edge, args.teacher, args.keep, disturbance),
            *args.flags,
        ]
    )


def _demonstrate(args: argparse.Namespace) -> None:
    from .demonstrate import Demonstrate, demonstrate

    options = {key: value for key, value in vars(args).items() if key not in ("command", "run", "flags")}
    demonstrate(Demonstrate(**options | {"processes": args.processes or processors()}))


def _train(args: argparse.Namespace) -> None:
    from .checkpoint import device_of
    from .data import load
    from .inputs import Shape
    from .train import TrainOptions, train

    if args.memory and args.gripper != "continuous":
        raise UserError(f"--memory needs --gripper continuous: in the code {args.gripper} a hand closes at once and has nothing to feel")
    device = device_of(args.device)
    if args.out.is_dir():
        raise UserError(f"--out {args.out}: expected a file, this is a folder")
    args.out.parent.mkdir(parents=True, exist_ok=True)
    inputs = {"touch": args.touch, "has_drives": args.drives, "has_memory": args.memory}
    shape = Shape(**inputs, code=args.gripper, head=args.head, frames=args.frames, edge=args.edge, chunk=20 if args.memory else 50)
    demos = load(args.recordings, args.gripper, args.edge, shape.has_tactile_pictures, args.drives, args.memory, args.frames)
    options = TrainOptions(shape, args.steps, args.batch, args.seed, device, args.compile, args.seconds)
    train(demos, options, args.out, {"recordings": [recording.name for recording in args.recordings]})


def _serve(args: argparse.Namespace) -> None:
    from .checkpoint import device_of, load
    from .infer import BATCH, Answering
    from .serve import serve

    device = device_of(args.device)
    checkpoint = load(args.checkpoint, device)
    metadata = {"gripper": checkpoint.policy.shape.code, "trained": checkpoint.about}
    asyncio.run(serve(Answering(checkpoint, device, args.blend), BATCH, metadata, args.host, args.port))


def _evaluate(args: argparse.Namespace) -> None:
    from .checkpoint import device_of, load, profile_of
    from .evaluate import Evaluation, evaluate

    device_of(args.device)
    checkpoint = load(args.checkpoint, device_of("cpu"))
    profile, edge, name = profile_of(args.checkpoint), checkpoint.policy.shape.edge, args.name or args.checkpoint.stem
    evaluate(Evaluation(args.checkpoint, profile, edge, args.scripts, name, args.out, args.flags, args.device, args.blend))


def _study_of(given: argparse.Namespace, out: Path, flags: list[str], until: float):
    """The study of some options. Raises UserError if they do not fit each other."""
    from .inputs import MOSAIC
    from .study import Study

    if given.memory and (unfelt := [code for code in given.codes if code not in FELT_CODES]):
        raise UserError(f"--codes {' '.join(unfelt)}: --memory has demonstrations in the codes {', '.join(FELT_CODES)} only")
    if given.memory and "vi" in given.inputs and max(given.replans) > MOSAIC:
        raise UserError(f"--replans {max(given.replans)}: --inputs vi with --memory needs {MOSAIC} or less")
    if given.memory and (given.keep != "safe" or given.teacher == "expert-binary"):
        raise UserError("--keep goal and --teacher expert-binary are of recordings of softvt record, which --memory does not use")
    own = ("command", "run", "flags", "queue", "minutes", "out")
    options = {key: value for key, value in vars(given).items() if key not in own}
    if given.disturbance is None:
        options["disturbance"] = FELT_DISTURBANCE if given.memory else DISTURBANCE
    return Study(**options, out=out, flags=tuple(flags), until=until)


def _study(args: argparse.Namespace) -> None:
    import time

    from .study import read_queue, run

    until = time.monotonic() + 60 * args.minutes
    if args.queue is None:
        if not args.suites:
            raise UserError("study: name a suite, or a --queue")
        return run(_study_of(args, args.out, args.flags, until))
    if args.suites:
        raise UserError("study: a --queue names the suites")
    # All lines are read before the first study runs.
    lines = [(name, _parser().parse_args(["study", *words, "--out", "."])) for name, *words in read_queue(args.queue)]
    for study in [_study_of(given, args.out / name, args.flags, until) for name, given in lines]:
        if time.monotonic() < until:
            run(study)


def _diagnose(args: argparse.Namespace) -> None:
    from .diagnose import diagnose

    print(diagnose(args.run_folder))


def _page(args: argparse.Namespace) -> None:
    from .page import write

    write(args.studies, args.docs)


def _number(kind: type, is_valid: Callable[[float], bool], expected: str) -> Callable[[str], float]:
    """The type of an option that takes some numbers only."""

    def parse(text: str) -> float:
        try:
            value = kind(text)
        except ValueError:
            value = None
        if value is None or not is_valid(value):
            raise argparse.ArgumentTypeError(f"expected {expected}, got {text}")
        return value

    return parse


_positive = _number(int, lambda value: value >= 1, "a whole number, 1 or more")
_edge = _number(int, lambda value: value >= 32 and value % 32 == 0, "a multiple of 32 pixels")
_share = _number(float, lambda value: 0 <= value < 1, "a number from 0 to below 1")
_minutes = _number(float, lambda value: value > 0, "a number above 0")
_length = _number(float, lambda value: 0 <= value <= 0.05, "0 to 0.05 m")


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="softvt-baselines", description=__doc__, epilog="Flags after -- are those of softvt.")
    commands = parser.add_subparsers(dest="command", required=True)

    def command(name: str, run, help: str) -> argparse.ArgumentParser:
        sub = commands.add_parser(name, help=help, description=help, formatter_class=argparse.ArgumentDefaultsHelpFormatter)
        sub.set_defaults(run=run)
        return sub

    def with_device(sub: argparse.ArgumentParser) -> None:
        sub.add_argument("--device", default="cuda", help="device of torch; cpu for a small trial")

    def with_blend(sub: argparse.ArgumentParser) -> None:
        sub.add_argument("--blend", type=_share, default=0.5, help="share of what was planned before in an answer, from 0 to below 1")

    def with_edge(sub: argparse.ArgumentParser) -> None:
        sub.add_argument("--edge", type=_edge, default=128, help="width and height of the pictures, pixels; a multiple of 32")

    def with_frames(sub: argparse.ArgumentParser) -> None:
        sub.add_argument("--frames", type=int, default=1, choices=[1, 2], help="control steps whose pictures and states the policy sees")

    def with_steps(sub: argparse.ArgumentParser) -> None:
        sub.add_argument("--steps", type=_positive, default=6000, help="training steps")
        sub.add_argument(
            "--seconds", type=_minutes, default=float("inf"), help="time that training may take: there are fewer steps if need be"
        )

    def with_disturbance(sub: argparse.ArgumentParser, default: float | None, more: str = "") -> None:
        words = f"standard deviation of the robot from its commands while recording, m; of its rotation 4 rad per m{more}"
        sub.add_argument("--disturbance", type=_length, default=default, help=words)

    def with_recording(sub: argparse.ArgumentParser) -> None:
        sub.add_argument("--demos", type=_positive, default=75, help="demonstrations per task")
        with_edge(sub)
        sub.add_argument(
            "--teacher",
            default="suite",
            choices=["suite", "expert", "expert-binary", "tactile-servo"],
            help="policy that demonstrates; suite: that of the suite",
        )
        sub.add_argument(
            "--keep",
            default="safe",
            choices=["safe", "goal"],
            help="demonstrations to keep: safe ones, or all that reach the goal; goal is for a teacher that crushes, as expert-binary",
        )
        with_disturbance(sub, None, f"; by default {DISTURBANCE}, and {FELT_DISTURBANCE} with --memory")

    def with_demonstrations(sub: argparse.ArgumentParser) -> None:
        sub.add_argument("--attempts", type=_positive, default=100, help="attempts of the teacher per task")
        sub.add_argument("--scenes", type=_positive, default=200, help="scenes with ways to the object, per task")
        sub.add_argument("--ways", type=_positive, default=4, help="ways to the object per scene")

    record = command("record", _record, "record demonstrations of a suite with pictures of the size that policies see")
    record.add_argument("suite", help="suite of softvt")
    record.add_argument("--out", type=Path, required=True, help="folder of the recording")
    with_recording(record)

    demonstrate = command(
        "demonstrate", _demonstrate, "record grips of a teacher that feels, with ways to and from them by feedback laws: for train --memory"
    )
    demonstrate.add_argument("suite", help="suite of softvt")
    demonstrate.add_argument("--out", type=Path, required=True, help="folder of the recording")
    with_demonstrations(demonstrate)
    demonstrate.add_argument("--task", default="", help="only these tasks: indices, separated by commas")
    demonstrate.add_argument("--seed", type=_positive, default=1, help="seed of the episodes; evaluations use 0")
    demonstrate.add_argument("--teacher", default="tactile-servo", help="built-in policy that demonstrates")
    demonstrate.add_argument(
        "--tactile-pictures", action="store_true", help="store the tactile pictures of both fingers as well, for train --touch pictures"
    )
    demonstrate.add_argument(
        "--teacher-runs",
        type=Path,
        help="folder of the runs of the teacher, kept if they are there: the same for two-width and force; by default that of the recording",
    )
    demonstrate.add_argument("--processes", type=int, default=0, help="processes; 0: one per processor")
    with_disturbance(demonstrate, FELT_DISTURBANCE)
    with_edge(demonstrate)
    with_frames(demonstrate)
    demonstrate.add_argument(
        "--gripper",
        default="continuous",
        choices=FELT_CODES,
        help="grip code; in two-width and force the hand closes at once to what the teacher found, and train takes no --memory",
    )

    train = command("train", _train, "train a policy")
    train.add_argument("recordings", type=Path, nargs="+", help="folders of softvt record")
    train.add_argument("--out", type=Path, required=True, help="checkpoint to write")
    train.add_argument(
        "--touch",
        default="",
        choices=["markers", "contact", "pictures"],
        help="what the policy sees of both fingers: their markers, whether each touches, or their tactile pictures; by default nothing",
    )
    train.add_argument(
        "--drives", action="store_true", help="give it the exact finger position and the commanded closure, whose gap is the grip force"
    )
    train.add_argument(
        "--memory",
        action="store_true",
        help="let it remember the last 20 s of slow motion, and close the hand by that memory and touch, without cameras",
    )
    train.add_argument("--gripper", default="continuous", choices=CODES, help="grip code")
    train.add_argument("--head", default="regression", choices=["regression", "flow"], help="how actions are predicted")
    with_frames(train)
    with_edge(train)
    with_steps(train)
    train.add_argument("--batch", type=_positive, default=256, help="samples per step")
    train.add_argument("--seed", type=int, default=0, help="seed of the weights and batches")
    train.add_argument("--compile", action="store_true", help="compile the network: a minute more at first, faster then")
    with_device(train)

    serve = command("serve", _serve, "serve a checkpoint in openpi's protocol")
    serve.add_argument("checkpoint", type=Path)
    serve.add_argument("--host", default="127.0.0.1")
    serve.add_argument("--port", type=int, default=8000, help="0 takes a free one")
    with_device(serve)
    with_blend(serve)

    evaluate = command("evaluate", _evaluate, "serve a checkpoint and evaluate it on suites of softvt")
    evaluate.add_argument("checkpoint", type=Path)
    evaluate.add_argument("scripts", nargs="+", help="suites or conditions of softvt")
    evaluate.add_argument("--out", type=Path, required=True, help="folder of the runs")
    evaluate.add_argument("--name", help="name of the policy in results; by default that of the checkpoint")
    with_device(evaluate)
    with_blend(evaluate)

    study = command("study", _study, "record, train and evaluate every combination of suites, inputs, grip codes and seeds")
    study.add_argument("suites", nargs="*", help="names of standard suites")
    study.add_argument(
        "--queue",
        type=Path,
        help="file with a study per line, in place of the other options: the name of its folder below --out, and its options",
    )
    study.add_argument("--minutes", type=_minutes, default=float("inf"), help="time after which no further part is begun")
    study.add_argument("--out", type=Path, required=True, help="folder of the study")
    study.add_argument(
        "--inputs",
        nargs="+",
        default=["vo", "vp", "vt"],
        choices=[*INPUTS],
        help=f"inputs: {', '.join(f'{name} {what}' for name, what in INPUTS.items())}",
    )
    study.add_argument("--seeds", type=int, nargs="+", default=[0, 1, 2], help="training seeds")
    study.add_argument("--codes", nargs="+", default=["continuous"], choices=CODES, help="grip codes")
    study.add_argument("--replans", type=_positive, nargs="+", default=[4], help="actions executed of each answer")
    study.add_argument("--shifts", action="store_true", help="evaluate also under the nine conditions of suites/shifts.lua")
    study.add_argument("--references", nargs="*", default=REFERENCES, choices=REFERENCES, help="built-in policies for comparison")
    with_frames(study)
    with_steps(study)
    study.add_argument("--episodes", type=_positive, default=50, help="episodes per task")
    with_recording(study)
    with_blend(study)
    study.add_argument("--task", default="", help="only these tasks: indices, separated by commas")
    study.add_argument(
        "--memory",
        action="store_true",
        help="policies from recordings of demonstrate, which remember; those of the codes two-width and force have nothing to remember",
    )
    with_demonstrations(study)
    study.add_argument("--compile", action="store_true", help="compile the networks")
    study.add_argument("--per-gpu", type=_positive, default=1, help="policies that are trained on one GPU at a time")

    diagnose = command(
        "diagnose", _diagnose, "say where the episodes of a run fail; the run was made with --trace, on an Object or a Spatial suite"
    )
    diagnose.add_argument("run_folder", metavar="run", type=Path, help="run folder of softvt")

    page = command("page", _page, "write the tables and the pictures of studies into docs/baselines.md and docs/images")
    page.add_argument("studies", type=Path, nargs="*", help="folders of studies to collect; none: those that were collected")
    page.add_argument("--docs", type=Path, default=Path("docs"), help="folder of the documentation")
    return parser


def main() -> int:
    words = sys.argv[1:]
    at = words.index("--") if "--" in words else len(words)
    parser = _parser()
    args = parser.parse_args(words[:at])
    args.flags = words[at + 1 :]
    if args.flags and args.command not in ("record", "evaluate", "study"):
        parser.error(f"{args.command} does not run softvt and takes no flags after --")
    try:
        args.run(args)
    except UserError as error:
        print(f"softvt-baselines: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        return 130
    return 0


if __name__ == "__main__":
    sys.exit(main())
