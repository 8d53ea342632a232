"""Demonstrations for policies that feel: grips of a teacher, and ways to and from them by feedback laws.

A teacher such as tactile-servo first runs without cameras. What it did is repeated through `softvt serve`, with pictures only where a policy
looks: its grip as it was, and the way from there by a law. In further scenes, where the teacher runs until it begins to close, another law
reaches the object from random places. The recording is written as `data.pack` writes it. Tactile pictures, if they are asked for, are stored
for all steps in which a policy sees them.

In the codes two-width and force, a hand does not feel its way: it closes at once, to what the teacher found in the same scene. Such grips
are executed in that code and kept if they are safe; the ways to the object end with the first action that closes.
"""

import json
import multiprocessing
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from . import UserError, laws
from .client import Client, serving
from .data import ACTIONS, CAMERAS, commands, create_pictures, displacements, identity, packed_folder, readings
from .evaluate import camera_flags, run_softvt
from .inputs import MOSAIC, RECENT, REMEMBERED_PICTURES, TOUCH_STEPS, gripper, mosaic_cells
from .laws import Grasp, Release
from .numbers import GRIPPER, ROTATION, between, rotated
from .phases import is_seen, memory_begins

# Steps that are shown before the hand closes slowly.
BEFORE = 5
# Steps between two pictures: on the way to an object, within NEAR (m) of it, and while carrying.
FAR_STRIDE, NEAR_STRIDE, CARRY_STRIDE, NEAR = 3, 2, 3, 0.06
# Share of the ways that begin near the object, and of those that begin between the fingers' heights; the radii of both, m.
NEAR_SHARE, LOW_SHARE, NEAR_RADIUS, LOW_RADIUS = 0.65, 0.3, 0.08, 0.0035
# Heights above the grasp at which low ways begin, m, and turns off that of the grasp, rad (standard deviation).
LOW_HEIGHTS, LOW_TURN, HOME_TURN = (0.015, 0.045), 0.08, 0.05
# Largest motion of any object on the way of a hand, m: it has touched none then.
UNTOUCHED = 0.001
# Steps of the budget that are used at most.
MOST_STEPS = 690
# Objects that are round from above: their turn does not show, and the hand keeps its own.
ROUND = {"steamed_bun", "golden_bun", "sesame_bun", "cylinder", "sphere"}
# Objects that look alike after a quarter of a turn.
SQUARE = {"cube"}
# Displacement of the teacher's grasps in each horizontal direction, m: a hand that feels learns what to do if it is next to the object. The ways of
# the other scenes end in the middle. Control steps of a teacher that only reaches.
SPREAD, REACHES = 0.003, 90
# Distance of each gel from an object from which on the teacher closes slowly, m. A policy does not know the size as well as the teacher.
CLEARANCE = 0.003
# Seeds of the scenes follow that of the grips by this much.
NEXT_SEED = 1000
# The number that opens the hand, by the codes in which it closes at once.
OPENS = {"two-width": 0.0, "force": -1.0}
# Such a hand has closed once its fingers move by less than this in CLOSING_PART steps, m, and at most CLOSING_MOST steps later: a force of
# 0.1 N closes by 1 mm/s. Steps over which the force of the teacher's grip is averaged.
CLOSED, CLOSING_PART, CLOSING_MOST, FORCE_STEPS = 2e-5, 4, 160, 5
# Largest number of pictures of a grip and of a way.
GRIP_PICTURES, WAY_PICTURES = 250, laws.MOST_STEPS
CONTEXT = multiprocessing.get_context("spawn")
PROFILE = """return softvt.profile {
  name = "demonstrations",
  inputs = {
    { keys = { "image" }, source = "camera", camera = "third_person"FRAMES },
    { keys = { "wrist_image" }, source = "camera", camera = "wrist"FRAMES },
    { keys = { "state" }, source = "state", parts = { "position", "axis_angle", "finger_position", "sensed_finger_position", "closure" }, frames = RECENT },
    { keys = { "tactile_marker_motion" }, source = "marker_motion", frames = RECENT },
    { keys = { "prompt" }, source = "prompt" },TACTILE
  },
  actions = { pose = "absolute", gripper = GRIPPER_CODE },
}
"""
TACTILE = """
    { keys = { "tactile_image" }, source = "tactile_image" },"""
# Counts of the pictures of both cameras and of both fingers.
COUNTS = ("picture", "tactile_picture")


@dataclass
class Plan:
    """What an attempt of the teacher shows."""

    actions: np.ndarray  # (T, 7) from its start until it lifts the object
    begin: int  # step in which it begins to close slowly
    release: Release


def _before(actions: np.ndarray) -> np.ndarray:
    """The command before each step (T, 7)."""
    return np.concatenate([actions[:1], actions[:-1]])


def _feels(actions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Steps in which the hand feels, and since which step each step is remembered."""
    before = np.float32(_before(actions))
    begins = memory_begins(before, np.array([0]))
    return np.flatnonzero(~is_seen(before, np.arange(len(before)), begins)), begins


def grasp_of(actions: np.ndarray) -> Grasp | None:
    """Where the hand begins to close slowly for the first time; None if it does not."""
    feels, begins = _feels(actions)
    if len(feels) == 0:
        return None
    before, begin = _before(actions), begins[feels[0]]
    pose = before[begin]
    is_above = np.hypot(*(before[:, :2] - pose[:2]).T) < 1e-3
    over = before[int(is_above.argmax()), 2]
    waits = np.flatnonzero(np.abs(np.diff(before[: begin + 1, GRIPPER])) < 1e-9)
    opening = before[waits[-1], GRIPPER] if len(waits) else 0.0
    return Grasp(pose[:6], float(max(over, pose[2] + 0.05)), float(opening), float(pose[GRIPPER]))


def plan_of(actions: np.ndarray) -> Plan | None:
    """The plan in the actions (T, 7) of an attempt; None if it grasped more than once."""
    feels, begins = _feels(actions)
    if len(feels) == 0 or (np.diff(feels) > 1).any():
        return None
    last = feels[-1]
    lifts = np.flatnonzero(np.diff(actions[:last, 2]) <= 2e-5)
    if len(lifts) == 0:
        return None
    lift = int(lifts[-1]) + 2  # the first action that lifts
    opens = np.flatnonzero(np.diff(actions[lift:, GRIPPER]) < -0.005)
    if len(opens) == 0:
        return None
    end = lift + int(opens[0])
    release = Release(actions[end, :6], float(actions[lift:end, 2].max()), float(actions[end:, GRIPPER].min()))
    return Plan(actions[:lift], int(begins[feels[0]]), release)


def number_of(job: "Job", plan: Plan, code: str) -> float:
    """The number by which a hand closes at once to the grip that the teacher found: its closure, or the mean force of the pads, N."""
    if code == "two-width":
        return float(plan.actions[-1, GRIPPER])
    trace, lift = job.trace.read_text().splitlines(), len(plan.actions)
    return float(np.mean([json.loads(line)["pad_force_n"] for line in trace[lift - FORCE_STEPS : lift]]))


def in_code(actions: np.ndarray, held: float, number: float, code: str) -> np.ndarray:
    """Actions (n, 7) of a hand that closes at once: by a number from the closure `held` on, else open."""
    found = actions.copy()
    found[:, GRIPPER] = np.where(actions[:, GRIPPER] > held - 1e-6, number, OPENS[code])
    return found


def turned_home(grasp: Grasp, home: np.ndarray, asset: str) -> Grasp:
    """A grasp whose turn is the one nearest to that of the hand at home, of those that are alike for an asset."""
    pose = grasp.pose.copy()
    if asset in ROUND:
        pose[3:] = [np.pi, 0, 0]
    elif asset in SQUARE:
        turns = [rotated(pose[3:], np.array([0, 0, k * np.pi / 2])) for k in range(4)]
        pose[3:] = min(turns, key=lambda turn: np.linalg.norm(between(home[ROTATION], turn)))
    return Grasp(pose, grasp.over, grasp.opening, grasp.closure)


def start_of(grasp: Grasp, home: np.ndarray, random: np.random.Generator) -> np.ndarray:
    """A random command from which the hand reaches the object: near it, low above it, or on the way from home."""
    start, pose = home.copy(), grasp.pose
    turn = between(home[ROTATION], pose[3:])
    if random.random() < NEAR_SHARE:
        is_low = random.random() < LOW_SHARE
        angle, radius = 2 * np.pi * random.random(), (LOW_RADIUS if is_low else NEAR_RADIUS) * random.random() ** 0.5
        start[:2] = pose[:2] + radius * np.array([np.cos(angle), np.sin(angle)])
        start[2] = pose[2] + random.uniform(*LOW_HEIGHTS) if is_low else grasp.over + 0.08 * random.random()
        share = 1 if is_low else random.random() * (radius < laws.TURNS_WITHIN)
        start[ROTATION] = rotated(home[ROTATION], share * turn + np.array([0, 0, LOW_TURN * random.standard_normal()]))
        start[GRIPPER] = grasp.opening
    else:
        share = random.random()
        start[:2] += share * (pose[:2] - home[:2]) + random.uniform(-0.05, 0.05, 2)
        start[2] = max(grasp.over, home[2] + share * (grasp.over - home[2])) + 0.04 * random.random()
        start[ROTATION] = rotated(home[ROTATION], np.array([0, 0, HOME_TURN * random.standard_normal()]))
        start[GRIPPER] = grasp.opening * share
    return start


@dataclass
class Shown:
    """Steps of an episode, one row each."""

    rows: list[dict] = field(default_factory=list)  # what was observed before each action
    actions: list[np.ndarray] = field(default_factory=list)


class Episode:
    """An episode that is stepped with pictures where they are wanted, each with those of `frames` - 1 steps before it."""

    def __init__(self, client: Client, task: int, episode: int, frames: int):
        self.client, self.shown, self.frames = client, Shown(), frames
        obs = client.reset(task, episode)
        self.most = MOSAIC if "tactile_image" in obs else RECENT  # steps that one observation shows
        self.prompt, self.is_over, self.info = str(obs["prompt"]), False, {}
        self.next = {}  # the row of the next step
        self._add(obs, 1)

    def _add(self, obs: dict, count: int) -> list[dict]:
        """Rows of the next step and of `count` steps after it, the last of which is now the next one."""
        motion = np.asarray(obs["tactile_marker_motion"]).reshape(-1, 2, 99, 2)
        moved = motion[-count:]
        pairs = np.stack([np.broadcast_to(motion[:1], moved.shape), moved], 2)
        felt, markers, states = readings(pairs), displacements(pairs).astype(np.float32), np.asarray(obs["state"])[-count:]
        rows = [self.next, *({"state": states[k], "markers": markers[k], "readings": felt[k]} for k in range(count))]
        if "tactile_image" in obs:
            for row, cells in zip(rows[1:], mosaic_cells(np.asarray(obs["tactile_image"]))[-count:]):
                row["tactile"] = cells
        for key in CAMERAS:
            pictures = np.asarray(obs[key])
            for row, picture in zip(rows[-self.frames :], pictures if pictures.ndim == 4 else pictures[None]):
                row[key] = picture
        self.next = rows[-1]
        return rows

    def play(self, actions: np.ndarray, pictured: np.ndarray) -> None:
        """Executes actions, so that the steps of `pictured` have pictures; until the episode is over."""
        stops = sorted({*(int(step) for step in pictured if 0 < step < len(actions)), len(actions)})
        done = 0
        for stop in stops:
            while done < stop and not self.is_over:
                part = actions[done : min(stop, done + self.most)]
                response = self.client.step(part)
                count = int(response["info"]["carried_out"])
                self.info, self.is_over = response["info"], response["terminated"] or response["truncated"]
                self.shown.rows += self._add(response["observation"], count)[:-1]
                self.shown.actions += [*part[:count]]
                done += len(part)

    def close(self, action: np.ndarray) -> np.ndarray:
        """Executes an action until the hand has closed. Returns the steps with pictures."""
        begin, before = len(self.shown.rows), np.inf
        while not self.is_over and len(self.shown.rows) < begin + CLOSING_MOST:
            self.play(action[None].repeat(CLOSING_PART, 0), np.array([CLOSING_PART // 2]))
            finger = self.next["state"][GRIPPER]
            if abs(finger - before) < CLOSED:
                break
            before = finger
        return np.arange(begin, len(self.shown.rows), CLOSING_PART // 2)

    def positions(self) -> np.ndarray:
        return np.array([thing["position_w"] for thing in self.info["state"]["objects"]])


@dataclass
class Job:
    task: int
    episode: int
    asset: str
    file: Path  # of the teacher's actions
    trace: Path  # of its steps, for the code force
    ways: int  # to the object; 0: the grip is repeated


@dataclass
class Settings:
    address: str
    out: Path
    edge: int
    seed: int
    tactile_pictures: bool
    frames: int
    gripper: str  # grip code


def _tactile_rows(states: np.ndarray, actions: np.ndarray, picture: np.ndarray) -> np.ndarray:
    """Steps of a demonstration whose tactile pictures a policy sees, given the index of the pictures of the cameras in each, -1 without: those
    that are trained on, and those that are seen before them."""
    steps, before = np.arange(len(actions)), commands(states, actions, np.array([len(actions)]))
    begins = memory_begins(before, np.array([0]))
    trained = (picture >= 0) | ~is_seen(before, steps, begins)
    seen = [np.maximum(steps - back, begins)[trained] for back in REMEMBERED_PICTURES]
    seen += [np.maximum(steps - back, 0)[trained] for back in TOUCH_STEPS]
    return np.unique(np.concatenate(seen))


class _Worker:
    """A process with a connection, and files of pictures that all processes share."""

    def __init__(self, settings: Settings, used):
        self.client, self.settings, self.used = Client(settings.address), settings, used
        folder = packed_folder(settings.out, settings.edge)
        self.files = {key: np.load(folder / f"{key}.npy", mmap_mode="r+") for key in CAMERAS}
        if settings.tactile_pictures:
            self.files["tactile"] = np.load(packed_folder(settings.out, None) / "tactile.npy", mmap_mode="r+")

    def store(self, rows: list[dict], wanted: np.ndarray, keys: tuple[str, ...], count: str) -> np.ndarray:
        """Writes pictures of the wanted rows to the files. Returns the index of those of each row, -1 without."""
        with self.used[count].get_lock():
            at = self.used[count].value
            self.used[count].value += len(wanted)
        for key in keys:
            for k, row in enumerate(wanted):
                self.files[key][at + k] = rows[row][key]
        found = np.full(len(rows), -1)
        found[wanted] = at + np.arange(len(wanted))
        return found

    def demonstration(self, shown: Shown, prompt: str, pictured: np.ndarray, first: int) -> dict:
        """The rows from the first one, whose pictures go to the files."""
        rows = shown.rows[first:]
        states, actions = np.array([row["state"] for row in rows], np.float32), np.array(shown.actions[first:], np.float32)
        chosen = {step - back for step in (pictured - first).tolist() for back in range(self.settings.frames)}
        wanted = np.array([k for k, row in enumerate(rows) if k in chosen and "image" in row], int)
        picture, tactile = self.store(rows, wanted, (*CAMERAS,), "picture"), {}
        if self.settings.tactile_pictures:
            seen = _tactile_rows(states[:, :7], actions, picture)
            tactile["tactile_picture"] = self.store(rows, seen, ("tactile",), "tactile_picture")
        return tactile | {
            "prompt": prompt,
            "picture": picture,
            ACTIONS[self.settings.gripper]: actions,
            "state": states[:, :7],
            "sensed_width": 2 * states[:, 7:8],
            "closure": states[:, 8:9],
            "markers": np.array([row["markers"] for row in rows], np.float16),
            "readings": np.array([row["readings"] for row in rows], np.float32),
        }

    def grip(self, job: Job, plan: Plan) -> dict | str:
        """The teacher's grip, or one that closes at once, and the way to where it lets go; or the reason why it is not shown."""
        episode, code, none = Episode(self.client, job.task, job.episode, self.settings.frames), self.settings.gripper, np.zeros(0, int)
        carried = laws.carry(plan.actions[-1], plan.release)
        if code == "continuous":
            episode.play(plan.actions, none)
            first, closing = plan.begin - BEFORE, none
        else:
            reached = plan.actions[: plan.begin]
            carried = laws.carry(np.append(reached[-1, :GRIPPER], plan.actions[-1, GRIPPER]), plan.release)
            number = number_of(job, plan, code)
            carried = in_code(carried, plan.actions[-1, GRIPPER], number, code)
            episode.play(np.insert(reached[:, :GRIPPER], GRIPPER, OPENS[code], 1), np.array([len(reached) - 1]))
            first = len(episode.shown.rows) - 1
            closing = np.append(first, episode.close(np.append(reached[-1, :GRIPPER], number)))
        if episode.is_over:
            return "ended early"
        lift, pictured = len(episode.shown.rows), np.arange(0, len(carried), CARRY_STRIDE)
        episode.play(carried, np.concatenate([pictured, np.arange(len(carried) - 24, len(carried))]))
        count = len(episode.shown.rows)
        while not episode.is_over and len(episode.shown.rows) < count + 40:
            episode.play(episode.shown.actions[-1][None].repeat(8, 0), np.zeros(0, int))
        record = episode.info.get("record") or {}
        if not record.get("safety"):
            return (
                f"not safe: {record.get('failed_stage') or ('slip' if record.get('goal') and record.get('deformation_ok') else 'deformed')}"
            )
        shown = Shown(episode.shown.rows[:count], episode.shown.actions[:count])
        kept = lift + np.concatenate([pictured, np.arange(max(0, len(carried) - 24), len(carried))])
        return self.demonstration(shown, episode.prompt, np.concatenate([closing, kept]), first)

    def ways(self, job: Job, actions: np.ndarray, grasp: Grasp, number: float | None) -> list[dict]:
        """Ways from random places to where the teacher grasped; with the number of a hand that closes at once, they end with the action by
        which it does."""
        random = np.random.default_rng([self.settings.seed, job.task, job.episode])
        episode = Episode(self.client, job.task, job.episode, self.settings.frames)
        home = actions[0].copy()
        grasp, code = turned_home(grasp, home, job.asset), self.settings.gripper
        if number is not None:
            grasp = Grasp(grasp.pose, grasp.over, 0.0, 0.0)
        command, places, found = home, None, []
        for index in range(job.ways):
            start = start_of(grasp, home, random) if index else home
            going, way = laws.travel(command, start, grasp.over), laws.reach(start, grasp)
            if number is not None:
                way = way[way[:, GRIPPER] <= 0]
            if len(episode.shown.rows) + len(going) + len(way) > MOST_STEPS or len(way) >= laws.MOST_STEPS:
                continue
            # The hand comes to rest where it starts.
            rest = np.concatenate([going, start[None].repeat(4, 0)])
            episode.play(rest if number is None else in_code(rest, np.inf, number, code), np.array([len(going) + 3]))
            places = episode.positions() if places is None else places
            before = np.concatenate([start[None], way[:-1]])
            near = np.linalg.norm(before[:, :3] - grasp.pose[:3], axis=1) < NEAR
            steps = np.arange(len(way))
            pictured = steps[np.where(near, steps % NEAR_STRIDE, steps % FAR_STRIDE) == 0]
            first = len(episode.shown.rows)
            episode.play(way if number is None else in_code(way, np.inf, number, code), pictured)
            if episode.is_over or np.abs(episode.positions() - places).max() > UNTOUCHED:
                break
            shown, pictured = episode.shown, first + pictured
            if number is not None:
                shown = Shown([*shown.rows, episode.next], [*shown.actions, np.append(way[-1, :GRIPPER], number)])
                pictured = np.append(pictured, len(shown.rows) - 1)
            found.append(self.demonstration(shown, episode.prompt, pictured, first))
            command = way[-1]
        return found


_worker: _Worker


def _begin(settings: Settings, used) -> None:
    global _worker
    _worker = _Worker(settings, used)


def _show(job: Job) -> tuple[list[dict], str]:
    """The demonstrations of an attempt or a scene, and what became of it."""
    actions, code = np.load(job.file), _worker.settings.gripper
    if job.ways and code == "continuous":
        grasp = grasp_of(actions)
        return (_worker.ways(job, actions, grasp, None), "ways") if grasp else ([], "not reached")
    plan = plan_of(actions)
    if plan is None:
        return [], "grasped again"
    if job.ways:
        return _worker.ways(job, actions, grasp_of(actions), number_of(job, plan, code)), "ways"
    grip = _worker.grip(job, plan)
    return ([grip], "kept") if isinstance(grip, dict) else ([], grip)


@dataclass
class Demonstrate:
    """What is recorded."""

    suite: str  # a file below suites/
    out: Path
    attempts: int  # of the teacher per task
    scenes: int  # with ways to the object, per task
    ways: int  # per scene
    edge: int
    seed: int
    disturbance: float  # m
    teacher: str
    task: str  # only these tasks: indices, separated by commas; "": all
    tactile_pictures: bool  # store them
    frames: int  # control steps with pictures where a policy looks
    gripper: str  # grip code: "continuous" or a key of OPENS
    processes: int
    teacher_runs: Path | None = None  # folder of the teacher's runs, which the keys of OPENS may share; None: that of the recording

    @property
    def common(self) -> list[str]:
        """Flags of the teacher and of the servers."""
        moves = ["--set", f"robot.disturbance.position={self.disturbance}", "--set", f"robot.disturbance.rotation={4 * self.disturbance}"]
        return [*(["--task", self.task] if self.task else []), *moves]

    def run_teacher(self, name: str, seed: int, episodes: int, steps: int | None) -> Path:
        """The folder of a run of the teacher: attempts, or scenes, with a number of control steps per episode if it is given."""
        lines = [
            'local grasp = require "experts.grasp"',
            f"grasp.SPREAD, grasp.CONTACT_CLEARANCE = {SPREAD if name == 'attempts' else 0}, {CLEARANCE}",
        ]
        lines += [f"local suite = require {json.dumps('suites.' + Path(self.suite).stem)}"]
        lines += [] if steps is None else [f"for _, task in ipairs(suite.tasks) do task.budget_steps = {steps} end"]
        folder = self.teacher_runs or self.out
        folder.mkdir(parents=True, exist_ok=True)
        script, run = folder / f"{name}.lua", folder / name
        script.write_text("\n".join([*lines, "return suite\n"]))
        words = [str(script), "--policy", self.teacher, "--seed", str(seed), *self.common, "--episodes", str(episodes)]
        words += ["--trace"] * (self.gripper != "continuous")  # force reads it, and the run is the same for all codes that may share it
        run_softvt([*words, "--threads", str(self.processes), "--out", str(run), "--resume"])
        return run

    def jobs(self, run: Path, ways: int) -> list[Job]:
        found = []
        for line in (run / "episodes.jsonl").read_text().splitlines():
            row = json.loads(line)
            if row["safety"] or (ways and self.gripper == "continuous"):
                name = f"task_{row['task']:03}/episode_{row['episode']:05}"
                files = run / "actions" / f"{name}.npy", run / "trace" / f"{name}.jsonl"
                found.append(Job(row["task"], row["episode"], row["asset"], *files, ways))
        # Long ones of a task do not come last.
        return sorted(found, key=lambda job: (job.episode, job.task))

    def repeat(self, jobs: list[Job], seed: int, used) -> tuple[list[dict], Counter]:
        """The demonstrations of jobs, and what became of them."""
        profile, found, fates = self.out / "profile.lua", [], Counter()
        frames, tactile = f", frames = {self.frames}" if self.frames > 1 else "", TACTILE if self.tactile_pictures else ""
        replaced = {"RECENT": str(RECENT), "FRAMES": frames, "TACTILE": tactile, "GRIPPER_CODE": gripper(self.gripper)}
        text = PROFILE
        for word, value in replaced.items():
            text = text.replace(word, value)
        profile.write_text(text)
        flags = ["--threads", str(self.processes), "--privileged", "--profile", str(profile), "--seed", str(seed), *self.common]
        with serving(self.suite, [*flags, *camera_flags(self.edge)]) as address:
            settings = Settings(address, self.out, self.edge, seed, self.tactile_pictures, self.frames, self.gripper)
            with ProcessPoolExecutor(self.processes, CONTEXT, _begin, (settings, used)) as pool:
                for number, (shown, fate) in enumerate(pool.map(_show, jobs), 1):
                    found += shown
                    fates[fate] += 1
                    if number % 100 == 0 or number == len(jobs):
                        print(f"{self.out.name}: {number} of {len(jobs)} repeated, {used['picture'].value} pictures", flush=True)
        return found, fates


def demonstrate(one: Demonstrate) -> None:
    """Records demonstrations into a folder that `data.load` reads.

    Raises UserError if softvt fails.
    """
    out, edges = one.out, [one.edge, None] if one.tactile_pictures else [one.edge]
    if (out / "dataset.json").is_file():
        return
    for edge in edges:
        packed_folder(out, edge).mkdir(parents=True, exist_ok=True)
    grips = one.jobs(one.run_teacher("attempts", one.seed, one.attempts, None), 0)
    # A hand that closes at once has to know what the teacher finds, and so what happens after its reach.
    steps = REACHES if one.gripper == "continuous" else None
    ways = one.jobs(one.run_teacher("scenes", one.seed + NEXT_SEED, one.scenes, steps), one.ways)
    if not grips:
        raise UserError(f"{out}: no attempt of the teacher is safe")
    for edge, most in zip(edges, (one.frames * GRIP_PICTURES, MOST_STEPS)):
        create_pictures(packed_folder(out, edge), edge, len(grips) * most + len(ways) * one.ways * WAY_PICTURES)
    used = {count: CONTEXT.Value("q", 0) for count in COUNTS}
    (found, fates), (more, others) = one.repeat(grips, one.seed, used), one.repeat(ways, one.seed + NEXT_SEED, used)
    found += more
    if not found:
        raise UserError(f"{out}: no grip in the code {one.gripper} is safe, and no way reaches an object")
    lengths = np.array([len(one["state"]) for one in found])
    arrays = {key: np.concatenate([one[key] for one in found]) for key in found[0] if key != "prompt"}
    np.savez(packed_folder(out, one.edge) / "numbers.npz", lengths=lengths, prompts=np.array([one["prompt"] for one in found]), **arrays)
    (out / "recording.json").write_text(
        json.dumps({"gripper": None if one.gripper == "continuous" else one.gripper, "frames": one.frames}) + "\n"
    )
    card = {key: value for key, value in vars(one).items() if key not in ("out", "processes", "teacher_runs")} | {
        "safe_attempts": len(grips),
        "grips": dict(sorted(fates.items())),
        "scenes_shown": dict(sorted(others.items())),
        "demonstrations": len(found),
        "steps": int(lengths.sum()),
        "pictures": used["picture"].value,
        "tactile_picture_steps": used["tactile_picture"].value,
    }
    (out / "dataset.json").write_text(json.dumps(card, indent=1) + "\n")
    for edge in edges:
        (packed_folder(out, edge) / "identity").write_text(identity(out))
    print(f"{out.name}: {json.dumps(card)}", flush=True)
