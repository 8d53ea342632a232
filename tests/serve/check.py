"""Tests of scripts/python/softvt_gym.py and its server. Arguments: the binary, the folder of an expert's run."""

import json
import os
import signal
import subprocess
import sys
import time
import warnings

import gymnasium
import numpy as np
from gymnasium.utils.env_checker import check_env
from softvt_gym import SoftVTEnv

BINARY, RUN = sys.argv[1:]
SUITE = "suites/object_soft.lua"
# Policies of this field return poses in metres and radians, so the action space is not normalized.
EXPECTED_WARNING = "we recommend using a symmetric and normalized space"


def same(a, b):
    """True if two observations are bitwise equal."""
    assert a.keys() == b.keys()
    return all(np.array_equal(a[key], b[key]) for key in a)


def gymnasiums_checker_reports_nothing(env):
    spec = gymnasium.make("softvt/Suite-v0", url=env.url, render_mode="rgb_array")
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        check_env(spec.unwrapped)
    reported = [str(one.message) for one in caught if EXPECTED_WARNING not in str(one.message)]
    assert not reported, reported


def the_same_seed_and_actions_give_the_same_observations(env):
    actions = np.load(f"{RUN}/actions/task_000/episode_00000.npy")[:5]

    def drive():
        first, _ = env.reset(seed=3, options={"task": 2})
        return [first] + [env.step(action)[0] for action in actions]

    once, again = drive(), drive()
    assert all(same(a, b) for a, b in zip(once, again, strict=True))
    assert not same(once[0], env.reset(seed=4, options={"task": 2})[0]), "a seed changes nothing"
    assert not same(once[0], once[-1]), "actions change nothing"


def a_state_is_restored_bitwise_by_a_copy_and_by_simulating_again(env):
    actions = np.load(f"{RUN}/actions/task_000/episode_00000.npy")
    env.reset(seed=0, options={"task": 0, "episode": 0})
    env.step(actions[:8])
    state = env.get_state()
    assert np.array_equal(state["actions"], actions[:8])
    straight, _, _, _, expected = env.step(actions[8:12])
    copied, _ = env.set_state(state)
    assert same(env.step(actions[8:12])[0], straight), "by a copy"
    other = SoftVTEnv(env.url)
    again, _ = other.set_state(state)
    assert same(again, copied), "by simulating again"
    seen, _, _, _, info = other.step(actions[8:12])
    other.close()
    assert same(seen, straight) and info == expected, "after the restored state"


def an_experts_actions_reach_the_goal_with_the_record_of_its_run(env):
    actions = np.load(f"{RUN}/actions/task_000/episode_00000.npy")
    with open(f"{RUN}/episodes.jsonl", encoding="utf-8") as lines:
        expected = json.loads(lines.readline())
    env.reset(seed=0, options={"task": 0, "episode": 0})
    rewards = []
    for action in actions:
        assert action in env.action_space
        observation, reward, terminated, truncated, info = env.step(action)
        assert observation in env.observation_space
        rewards.append(reward)
    assert rewards == [0.0] * (len(actions) - 1) + [1.0], "the reward comes with the goal"
    assert terminated and not truncated and info["success"]
    for key in ("policy", "camera_inside", "gave_up", "notes", "privileged"):
        expected.pop(key, None)
        info["record"].pop(key, None)
    assert info["record"] == expected, (info["record"], expected)
    assert info["verdict"]["goal"] and info["state"]["objects"]
    print(f"    state {expected['state_hash']} after {len(actions)} steps, D_peak {expected['d_peak']:.2f} %")


def a_recorded_run_has_the_records_of_the_expert(out):
    actions = np.load(f"{RUN}/actions/task_000/episode_00000.npy")
    env = SoftVTEnv.launch(SUITE, "--task", "0", "--episodes", "1", "--out", out, softvt=BINARY)
    try:
        assert env.about["records"]
        env.reset(seed=0, options={"task": 0, "episode": 0})
        infos = [env.step(action)[4] for action in actions]
        assert infos[-1]["recorded"] and not any("recorded" in info for info in infos[:-1])
    finally:
        env.close()
    records = []
    for run in (out, RUN):
        with open(f"{run}/episodes.jsonl", encoding="utf-8") as lines:
            record = json.loads(lines.read())
        for key in ("policy", "camera_inside", "gave_up", "notes", "privileged"):
            record.pop(key, None)
        records.append(record)
    assert records[0] == records[1], records
    for command in (["replay", out, "0/0"], ["compare", out, RUN], ["report", out, "--out", f"{out}-report"]):
        subprocess.run([BINARY, *command], check=True, stdout=subprocess.DEVNULL)


def the_server_of_launch_ends_with_its_python_process():
    launch = f"""
import os, signal, sys
from softvt_gym import SoftVTEnv
env = SoftVTEnv.launch({SUITE!r}, "--task", "0", softvt={BINARY!r})
print(env._server.pid, flush=True)
"""
    endings = {
        "at its last line": ("", 0),
        "by an exception": ("raise ValueError", 1),
        "by SIGTERM": ("os.kill(os.getpid(), signal.SIGTERM)", -signal.SIGTERM),
        "by SIGKILL": ("os.kill(os.getpid(), signal.SIGKILL)", -signal.SIGKILL),
    }
    for how, (last, code) in endings.items():
        ended = subprocess.run([sys.executable, "-c", launch + last], capture_output=True, text=True)
        assert ended.returncode == code, (how, ended)
        server, deadline = int(ended.stdout), time.monotonic() + 60
        while is_running(server):
            assert time.monotonic() < deadline, f"the server runs on after Python ended {how}"
            time.sleep(0.05)


def is_running(process):
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    # A zombie has ended; its new parent need not have noticed yet.
    with open(f"/proc/{process}/stat", encoding="utf-8") as stat:
        return stat.read().rsplit(")", 1)[1].split()[0] != "Z"


def a_missing_server_is_named_with_a_command():
    try:
        SoftVTEnv("ws://127.0.0.1:9")
    except ConnectionError as error:
        assert "ws://127.0.0.1:9" in str(error) and "softvt serve FILE.lua --port 9" in str(error), error
    else:
        raise AssertionError("something listens on port 9")


def unprivileged_clients_receive_no_true_state(env):
    _, info = env.reset(seed=0)
    received = set(info)
    _, _, _, _, info = env.step(env.action_space.sample())
    received |= set(info)
    assert received == {"task", "episode", "step", "time_s", "success", "carried_out", "far_commands", "clamped_grips"}, received


def main():
    env = SoftVTEnv.launch(SUITE, "--privileged", softvt=BINARY)
    try:
        for check in (
            gymnasiums_checker_reports_nothing,
            the_same_seed_and_actions_give_the_same_observations,
            a_state_is_restored_bitwise_by_a_copy_and_by_simulating_again,
            an_experts_actions_reach_the_goal_with_the_record_of_its_run,
        ):
            print(check.__name__.replace("_", " "), flush=True)
            check(env)
    finally:
        env.close()
    env = SoftVTEnv.launch(SUITE, "--profile", "libero", softvt=BINARY)
    try:
        print("unprivileged clients receive no true state", flush=True)
        unprivileged_clients_receive_no_true_state(env)
    finally:
        env.close()
    for check in (a_missing_server_is_named_with_a_command, the_server_of_launch_ends_with_its_python_process):
        print(check.__name__.replace("_", " "), flush=True)
        check()
    print("a recorded run has the records of the expert", flush=True)
    a_recorded_run_has_the_records_of_the_expert(f"{RUN}-served")


main()
