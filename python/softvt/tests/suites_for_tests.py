"""Suites and runs that the tests share. They need the program: SOFTVT_BINARY or the PATH."""

import atexit
import json
import subprocess
import tempfile
from functools import cache
from pathlib import Path

import numpy as np
import softvt

FOLDER = Path(tempfile.mkdtemp(prefix="softvt-tests-"))
STEPS = 12
"""Budget of the tasks of the short suite, control steps."""


@atexit.register
def _remove() -> None:
    for path in sorted(FOLDER.rglob("*"), reverse=True):
        path.rmdir() if path.is_dir() else path.unlink()
    FOLDER.rmdir()


@cache
def short_suite() -> str:
    """Path of Spatial-Soft with budgets of `STEPS`."""
    path = FOLDER / "short.lua"
    path.write_text(
        f'local suite = require "suites.spatial_soft"\nfor _, task in ipairs(suite.tasks) do task.budget_steps = {STEPS} end\nreturn suite\n'
    )
    return str(path)


@cache
def drawer_suite() -> str:
    """Path of a suite of two tasks: to place an object, and to open a drawer."""
    path = FOLDER / "drawer.lua"
    path.write_text("""
local suite = require "suites.household"
local open = suite.tasks[1]
open.goal, open.object = softvt.opened { joint = "cabinet.top_drawer" }, "roll"
suite.tasks = { suite.tasks[5], open }
return suite
""")
    return str(path)


@cache
def uncalibrated_suite() -> str:
    """Path of a suite of one task, whose object has no limit."""
    path = FOLDER / "uncalibrated.lua"
    path.write_text("""
local box = softvt.shape.box
local floor = softvt.asset { name = "floor", shape = box { size = { 1, 1, 0.05 } }:translate(0, 0, -0.025), body = softvt.static {} }
local material = softvt.soft { youngs_pa = 2e4, poisson = 0.3, density = 300, damage_strain = 0.2 }
local cube = softvt.asset { name = "cube", shape = box { size = { 0.04, 0.04, 0.04 } }:grounded(), body = material }
local layout = softvt.layout("cube", function(scene)
  scene:add { name = "floor", asset = floor, position = { 0, 0, 0 } }
  scene:add { name = "cube", asset = cube, at = { 0, 0.1 } }
  scene:add { name = "post", asset = floor, position = { 0, 2, 0 } }
end)
return softvt.suite { name = "uncalibrated", object_type = "deformable", tasks_differ_in = "spatial", episodes = 1, tasks = {
  softvt.task { prompt = "wait", layout = layout, goal = softvt.on { object = "cube", target = "post" }, budget_steps = 4 },
} }
""")
    return str(path)


@cache
def crushing_suite() -> str:
    """Path of a suite of one task, whose goal moves a bun and a croissant, and whose expert crushes the croissant."""
    path = FOLDER / "crushing.lua"
    path.write_text("""
local suite = require "suites.household"
local task = suite.tasks[5]
task.expert = require("experts.pick_place") { object = "croissant", target = "plate", closure = 0.7 }
task.budget_steps = 120
suite.tasks = { task }
return suite
""")
    return str(path)


@cache
def expert_run(policy: str = "expert", suite: str = "suites/object_soft.lua") -> tuple[np.ndarray, dict]:
    """Actions (steps, 7) and record of an expert in task 0, episode 0 of a suite, by default Object-Soft."""
    out = FOLDER / f"{Path(suite).stem}-{policy}"
    command = [softvt.find_binary(), suite, "--task", "0", "--episodes", "1", "--policy", policy, "--out", str(out)]
    subprocess.run(command, check=True, capture_output=True)
    record = json.loads((out / "episodes.jsonl").read_text())
    del record["record_sha256"]  # of the line
    return np.load(out / "actions/task_000/episode_00000.npy"), record


@cache
def recording() -> Path:
    """Folder of a recording: a demonstration of each of tasks 0 and 1 of Object-Rigid, with small images."""
    folder = FOLDER / "demonstrations"
    command = ["record", "suites/object_rigid.lua", "--task", "0,1", "--demos", "1", "--out", str(folder)]
    small = ["--set", "cameras.width=32", "--set", "cameras.height=24", "--streams", "depth,joint-torques"]
    subprocess.run([softvt.find_binary(), *command, *small], check=True, capture_output=True)
    return folder


def same(a, b) -> bool:
    """True if two observations are equal bit for bit."""
    if isinstance(a, dict):
        return a.keys() == b.keys() and all(same(a[key], b[key]) for key in a)
    return np.array_equal(a, b)
