"""Environments: Gymnasium's checker, observations, rewards, info, episodes and states."""

import copy
import os
import pickle
import re
import threading
import unittest
import warnings
from pathlib import Path

import gymnasium
import numpy as np
import softvt
from gymnasium.utils.env_checker import check_env
from softvt.env import CONTROL_DT
from softvt.true_state import STATE_BOUNDS, STATE_FIELDS, TrueState, progress
from suites_for_tests import STEPS, crushing_suite, drawer_suite, expert_run, same, short_suite, uncalibrated_suite

# Policies of this field return poses in metres and radians, and depth is infinite in the background.
EXPECTED_WARNINGS = ("we recommend using a symmetric and normalized space", "is infinity", "is -infinity")
HOLD = np.zeros(7)
_COSTS = ("cost", "cost_deformation", "cost_drop", "cost_slip")


def field(state: np.ndarray, name: str) -> np.ndarray:
    """A field of the vector of the true state."""
    first = sum(size for size, _ in list(STATE_FIELDS.values())[: list(STATE_FIELDS).index(name)])
    return state[first : first + STATE_FIELDS[name][0]]


def judged(record) -> dict:
    """A record without the fields that depend on what observed and controlled the episode."""
    return {key: value for key, value in record.items() if key not in ("policy", "camera_inside", "gave_up", "notes", "privileged")}


class Environments(unittest.TestCase):
    def make(self, script: str | None = None, **arguments) -> softvt.SoftVTEnv:
        env = softvt.SoftVTEnv(script or short_suite(), **arguments)
        self.addCleanup(env.close)
        return env

    def test_gymnasiums_checker_reports_nothing(self):
        for arguments in [
            {"obs": "state", "reward": "staged"},
            {"obs": "proprio+pixels+tactile+marker_motion", "image_size": 48, "cost": False},
            {"obs": "pixels+depth+segmentation+state", "image_size": (40, 48), "history": 3, "privileged": True},
            {"obs": "proprio+pixels+tactile_image+marker_motion+state", "layout": "lerobot", "control": "pose", "reward": "safety"},
            {"obs": "pixels+prompt", "control": "delta_osc", "gripper": "binary"},
            {"obs": "proprio+pixels", "control": "joints", "layout": "lerobot", "image_size": 48},
            {"profile": "libero"},
            {"profile": "visuo_tactile", "layout": "lerobot"},
        ]:
            with self.subTest(arguments), warnings.catch_warnings(record=True) as caught:
                warnings.simplefilter("always")
                env = gymnasium.make("softvt/File-v0", script=short_suite(), task=2, render_mode="rgb_array", **arguments)
                self.addCleanup(env.close)
                check_env(env.unwrapped)
                reported = [str(one.message) for one in caught if not any(words in str(one.message) for words in EXPECTED_WARNINGS)]
                self.assertEqual(reported, [])

    def test_registered_environments_are_made_with_arguments(self):
        env = gymnasium.make("softvt/SpatialSoft-v0", task="left small dark brown", max_episode_steps=2, obs="proprio")
        self.addCleanup(env.close)
        _, info = env.reset(seed=1000)
        self.assertEqual((info["task"], info["episode_index"]), (4, 0))
        self.assertEqual(env.get_wrapper_attr("task_description"), info["prompt"])
        env.step(env.action_space.sample())
        *_, truncated, info = env.step(env.action_space.sample())
        self.assertTrue(truncated)
        self.assertIs(info["is_success"], False)
        own = gymnasium.make("softvt/File-v0", script=short_suite())
        self.addCleanup(own.close)
        self.assertEqual(own.get_wrapper_attr("_max_episode_steps"), STEPS)

    def test_flags_may_replace_arguments_that_are_not_given(self):
        env = self.make(obs="proprio", flags=("--split", "experiment", "--gripper", "binary", "--privileged"))
        self.assertEqual([env.hello[key] for key in ("split", "gripper", "pose", "privileged")], ["experiment", "binary", "delta", True])
        self.assertEqual(env.reset(seed=1000)[1]["split"], "experiment")

    def test_impossible_tasks_suites_and_parts_are_refused(self):
        for arguments, words in [
            ({"task": 99}, "task 99: suite spatial_soft has the tasks 0 to 9"),
            ({"task": [0, -1]}, "task -1"),
            ({"task": "pastry"}, "10 prompts of suite spatial_soft contain it"),
            ({"task": "3"}, "task='3': text is a part of a prompt; write task=3"),
            ({"suite": "object_soft"}, "suite='object_soft': the server has spatial_soft"),
        ]:
            with self.subTest(arguments), self.assertRaisesRegex(ValueError, words):
                self.make(obs="proprio", **arguments)
        with softvt.Server(short_suite(), "--profile", "vision") as server:
            for arguments, words in [
                ({"obs": "tactile", "cost": False}, "obs='tactile': the profile 'vision' .* sends image, wrist_image, state, prompt"),
                ({"obs": "state"}, "start it with --privileged"),
                ({"cost": True}, "start it with --privileged"),
                ({"reward": "safety", "cost": False}, "start it with --privileged"),
            ]:
                with self.subTest(arguments), self.assertRaisesRegex(ValueError, words):
                    softvt.SoftVTEnv(url=server.url, token=server.token, **arguments)
            env = softvt.SoftVTEnv(url=server.url, token=server.token, obs="pixels+proprio", cost=False)
            self.assertEqual(set(env.observation_space.spaces), {"image", "wrist_image", "state"})
            env.close()
        with (
            softvt.Server(short_suite(), "--profile", "vision", "--privileged") as server,
            self.assertRaisesRegex(ValueError, "entry 'state' of its own"),
        ):
            softvt.SoftVTEnv(url=server.url, token=server.token, obs="proprio+state")

    def test_a_goal_without_a_target_for_the_object_is_refused_where_the_true_state_is_asked_for(self):
        words = r"task 1: .*the goal \(opened\) has no target for 'roll'; use obs='proprio' .* reward='sparse'"
        for arguments in ({}, {"task": None}, {"obs": "proprio+state"}, {"obs": "proprio", "reward": "staged"}):
            with self.subTest(arguments), self.assertRaisesRegex(ValueError, words):
                self.make(drawer_suite(), **{"task": 1, **arguments})
        env = self.make(drawer_suite(), task=0)
        with self.assertRaisesRegex(softvt.ServerError, "no episode yet"):
            env.step(HOLD)
        env.reset(seed=1000)
        with self.assertRaisesRegex(ValueError, words):
            env.reset(options={"task": 1})
        self.assertEqual(self.make(drawer_suite(), task=1, obs="proprio", reward="safety").reset(seed=1000)[1]["task"], 1)

    def test_a_camera_that_the_scene_has_not_is_refused_and_the_check_begins_no_episode(self):
        with self.assertRaisesRegex(ValueError, "camera='frnt': expected a camera of the scene, 'third_person', 'wrist', or 'left'"):
            self.make(render_mode="rgb_array", camera="frnt")
        env = self.make(obs="proprio", render_mode="rgb_array", camera="wrist")
        with self.assertRaisesRegex(softvt.ServerError, "no episode yet; call reset first"):
            env.step(HOLD)
        env.reset(seed=1000)
        self.assertEqual(env.step(HOLD)[4]["step"], 1)

    def test_a_seed_names_an_episode_and_its_start_depends_on_it_alone(self):
        env = self.make(obs="state", task=2)
        first, info = env.reset(seed=1003)
        self.assertEqual(info["episode_index"], 3)
        other, _ = env.reset(seed=1004)
        self.assertFalse(same(first, other))
        again, info = env.reset(options={"episode": 3})
        self.assertTrue(same(first, again))
        _, info = env.reset(seed=0)
        self.assertEqual(info["episode_index"], 2**32 - 1000)
        episodes = [[env.reset(seed=7)[1]["episode_index"], env.reset()[1]["episode_index"]] for _ in range(2)]
        self.assertEqual(episodes[0], episodes[1], "the episode after a seed is drawn from it")
        other, info = env.reset(options={"episode": 3, "split": "demonstration"})
        self.assertEqual((same(other, first), info["split"]), (False, "demonstration"))
        kept = env.get_state()
        self.assertEqual(env.reset(seed=1003)[1]["split"], "validation")
        self.assertEqual(env.set_state(kept)[1]["split"], "demonstration")
        with self.assertRaisesRegex(ValueError, "'episodes'; expected task, episode, split or seed"):
            env.reset(options={"episodes": 3})
        with self.assertRaisesRegex(ValueError, "seed=1003 is episode 3, and options name episode 7; leave out one of them"):
            env.reset(seed=1003, options={"episode": 7})
        self.assertTrue(same(env.reset(seed=1003, options={"episode": 3})[0], first))
        self.assertEqual(env.reset(seed=1003, options={"task": 4})[1]["task"], 4)

    def test_without_a_task_every_reset_draws_one(self):
        env = self.make(obs="proprio", task=None)
        tasks = [env.reset(seed=seed)[1]["task"] for seed in range(12)]
        self.assertGreater(len(set(tasks)), 3)
        self.assertEqual(tasks, [env.reset(seed=seed)[1]["task"] for seed in range(12)])

    def test_joint_positions_are_commanded_within_the_limits_of_the_joints(self):
        env = self.make(obs="proprio", control="joints", task=2)
        self.assertEqual((env.action_space.shape, env.observation_space.shape), ((8,), (8,)))
        np.testing.assert_allclose([env.action_space.low[3], env.action_space.high[3]], [-3.0718, -0.0698], rtol=1e-6)
        self.assertEqual(env.hello["action_space"]["names"][3:5] + [env.hello["pose"]], ["joint_4", "joint_5", "joints"])
        start, _ = env.reset(seed=1001)
        action = np.append(start[:7], 0.0)
        action[0] += 0.05
        for _ in range(10):
            observation, *_, info = env.step(action)
        np.testing.assert_allclose(observation[:7], action[:7], atol=2e-3)
        self.assertEqual(info["far_commands"], 0)
        *_, info = env.step(np.full(8, 5.0))
        self.assertEqual((info["far_commands"], info["clamped_grips"]), (1, 1))
        with self.assertRaisesRegex(softvt.ServerError, r"expected shape \(8\)"):
            env.step(np.zeros(7))

    def test_the_same_actions_give_the_same_observations_and_a_state_is_restored(self):
        env = self.make(obs="state+pixels+tactile", image_size=48)
        actions = np.random.default_rng(0).uniform(-1, 1, (8, 7))

        def drive():
            start, _ = env.reset(seed=1001)
            return [start] + [env.step(action)[0] for action in actions]

        once, again = drive(), drive()
        self.assertTrue(all(same(a, b) for a, b in zip(once, again)))
        self.assertFalse(same(once[0], once[-1]))
        env.reset(seed=1001)
        env.step(actions[:4])
        state = pickle.loads(pickle.dumps(env.get_state()))
        self.assertTrue(same(env.step(actions[4])[0], once[5]))
        other = self.make(obs="state+pixels+tactile", image_size=48)
        for restored in (env, other):
            observation, info = restored.set_state(state)
            self.assertTrue(same(observation, once[4]))
            self.assertEqual(info["step"], 4)
            self.assertTrue(same(restored.step(actions[4])[0], once[5]))

    def test_a_state_is_restored_after_the_end_and_may_be_that_of_the_end(self):
        for freeze in (False, True):
            env = self.make(obs="proprio", freeze=freeze)
            env.reset(seed=1000)
            env.step(np.tile(HOLD, (4, 1)))
            middle = env.get_state()
            last = env.step(np.tile(HOLD, (STEPS - 4, 1)))
            end = env.get_state()
            self.assertEqual(env.set_state(middle)[1]["step"], 4)
            self.assertEqual(env.step(HOLD)[4]["step"], 5)
            self.assertEqual(judged(env.set_state(end)[1]["record"]), judged(last[4]["record"]))
            if freeze:
                self.assertEqual(env.step(HOLD)[1:4], (0.0, False, True))
            else:
                with self.assertRaisesRegex(softvt.ServerError, "the episode is over"):
                    env.step(HOLD)

    def test_the_task_is_chosen_by_arguments_and_options_alone(self):
        env = self.make(obs="proprio", task=3)
        for name in ("task", "task_description"):
            with self.assertRaises(AttributeError):
                setattr(env, name, 0)
        env.reset(seed=1000)
        self.assertEqual((env.task, env.reset(options={"task": 5})[1]["task"], env.task), (3, 5, 5))
        prompt = env.task_description
        env.reset(seed=1000)
        self.assertEqual((env.task, env.reset(options={"task": prompt[4:].upper()})[1]["task"]), (3, 5))
        with self.assertRaisesRegex(ValueError, "task='zebra': 0 prompts of suite .* expected one of: "):
            env.reset(options={"task": "zebra"})

    def test_an_option_of_none_is_none(self):
        env = self.make(obs="proprio", task=3, freeze=True)
        _, info = env.reset(seed=1004, options={"task": None, "episode": None, "split": None, "seed": None})
        self.assertEqual((info["task"], info["episode_index"], info["split"]), (3, 4, "validation"))
        env.step(np.tile(HOLD, (STEPS, 1)))
        self.assertEqual(env.reset(options={"episode": None})[1]["step"], STEPS, "the end is repeated")
        with self.assertRaisesRegex(ValueError, "options has no 'episodes'"):
            env.reset(options={"episodes": None})

    def test_the_split_of_an_argument_is_that_of_info(self):
        env = self.make(obs="proprio", split="demonstration")
        self.assertEqual([env.reset(seed=1000)[1]["split"], env.step(HOLD)[4]["split"]], ["demonstration"] * 2)
        self.assertEqual(env.reset(options={"split": "experiment"})[1]["split"], "experiment")

    def test_an_environment_cannot_be_pickled_or_copied(self):
        env = self.make(obs="proprio")
        for send in (pickle.dumps, copy.deepcopy):
            with self.assertRaisesRegex(TypeError, "SoftVTEnv has a connection .* make it inside of the worker"):
                send(env)

    def test_an_experts_actions_earn_each_reward_and_end_with_the_record_of_its_run(self):
        actions, record = expert_run()
        binary, unsafe = expert_run("expert-binary")
        self.assertTrue(record["safety"] and unsafe["goal"] and not unsafe["safety"])
        for reward, total, unsafe_total in [("sparse", 1.0, 1.0), ("safety", 1.0, 0.0), ("staged", None, None)]:
            env = self.make("object_soft", obs="proprio", control="pose", reward=reward, privileged=True)
            for rows, expected, kept in [(actions, total, record), (binary, unsafe_total, unsafe)]:
                with self.subTest(reward, safe=kept["safety"]):
                    env.reset(options={"episode": 0})
                    steps = [env.step(row) for row in rows]
                    rewards = [one[1] for one in steps]
                    _, _, terminated, truncated, info = steps[-1]
                    self.assertTrue(terminated and not truncated)
                    self.assertIs(info["is_success"], True)
                    self.assertEqual((info["is_safe"], info["record"]["goal"]), (kept["safety"], True))
                    self.assertEqual(judged(info["record"]), judged(kept))
                    if expected is None:
                        self.assertAlmostEqual(sum(rewards), 1.0, delta=0.17)
                        self.assertGreater(sum(one > 0 for one in rewards), 50, "dense")
                    else:
                        self.assertEqual(rewards, [0.0] * (len(rows) - 1) + [expected])
                    costs = [one[4]["cost"] for one in steps]
                    self.assertEqual(sum(costs) > 0, not kept["safety"])
                    self.assertEqual([type(one) for one in (costs[0], rewards[0], terminated)], [float, float, bool])

    def test_a_step_of_several_actions_costs_as_much_time_beyond_the_limit_as_single_steps(self):
        actions, record = expert_run(suite=crushing_suite())
        (croissant,) = record["targets"]
        costs = []
        for count in (1, 7):
            env = self.make(crushing_suite(), obs="proprio", control="pose")
            env.reset(seed=1000)
            costs.append(sum(env.step(actions[at : at + count])[4]["cost_deformation"] for at in range(0, len(actions), count)))
        single, several = costs
        self.assertGreater(single, 10)
        # Each begins and ends within a control step.
        self.assertLessEqual(abs(several - single), 3)
        self.assertLessEqual(abs(single * CONTROL_DT - croissant["time_over_tau_s"]), 3 * CONTROL_DT)

    def test_after_an_interrupted_step_an_episode_is_begun_anew(self):
        env = self.make(obs="proprio")
        first, _ = env.reset(seed=1003)
        action = np.array([1.0, 0, 0, 0, 0, 0, -1])
        after, *_ = env.step(action)
        # As Ctrl-C leaves it.
        env.begin_step(action)
        for _ in range(2):
            with self.assertRaisesRegex(softvt.ServerError, "step: the request before was interrupted; call reset first"):
                env.step(action)
        with self.assertRaisesRegex(softvt.ServerError, "get_state: the request before was interrupted; call reset first"):
            env.get_state()
        again, info = env.reset(seed=1003)
        np.testing.assert_array_equal(again, first)
        self.assertEqual(info["step"], 0)
        np.testing.assert_array_equal(env.step(action)[0], after)
        # A state is a way back as well, and what cannot be sent interrupts nothing.
        kept = env.get_state()
        env.begin_step(action)
        np.testing.assert_array_equal(env.set_state(kept)[0], after)
        with self.assertRaises((TypeError, OverflowError)):
            env.reset(options={"task": {0}})
        self.assertEqual(env.step(action)[4]["step"], 2)

    def test_two_threads_in_one_environment_are_named(self):
        env = self.make(obs="proprio")
        env.reset(seed=1000)
        sent, done = threading.Event(), threading.Event()

        def step():
            env.begin_step(HOLD)
            sent.set()
            done.wait(60)

        other = threading.Thread(target=step, name="other")
        other.start()
        sent.wait(60)
        try:
            with self.assertRaisesRegex(softvt.ServerError, "thread other waits for the response .*: give each thread its own"):
                env.get_state()
        finally:
            done.set()
            other.join()

    def test_commands_out_of_reach_are_a_warning_at_the_end_of_the_episode(self):
        env = self.make(obs="proprio", control="pose")
        # Millimetres in place of metres.
        far = np.array([450.0, 0, 300, 3.1, 0, 0, 0])
        env.reset(seed=1000)
        with self.assertWarnsRegex(UserWarning, "task 0, episode 0: ([0-9]+) of \\1 commands were out of reach; check"):
            for _ in range(STEPS):
                env.step(far)
        env.reset(seed=1001)
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            for _ in range(STEPS):
                env.step(far)

    def test_steps_of_delta_cover_the_share_that_the_page_states(self):
        page = (Path(__file__).resolve().parents[3] / "docs/python.md").read_text(encoding="utf-8")
        stated = int(re.search(r"equal steps in a row cover (\d+) % of their length", page).group(1))
        env = self.make("object_soft", obs="proprio", control="delta")
        # Along y, and about x by the half of the largest turn, by which no joint is at its speed limit.
        for number, fraction, whole in [(1, 1.0, 0.02), (3, 0.5, 0.2)]:
            env.reset(seed=1000)
            step = np.array([0, 0, 0, 0, 0, 0, -1.0])
            start = [env.step(step)[0] for _ in range(5)][-1]
            step[number] = fraction
            end = [env.step(step)[0] for _ in range(10)][-1]
            with self.subTest(number):
                self.assertAlmostEqual(100 * (end - start)[number] / (10 * fraction * whole), stated, delta=1)

    def test_after_an_interrupted_step_a_vector_is_reset(self):
        envs = softvt.SoftVTVectorEnv(2, script=short_suite(), obs="proprio")
        try:
            first, _ = envs.reset(seed=1000)
            actions = np.tile([1.0, 0, 0, 0, 0, 0, -1], (2, 1))
            after = envs.step(actions)[0]
            envs.envs[1].begin_step(actions[1])
            with self.assertRaisesRegex(softvt.ServerError, "interrupted; call reset first"):
                envs.step(actions)
            np.testing.assert_array_equal(envs.reset(seed=1000)[0], first)
            np.testing.assert_array_equal(envs.step(actions)[0], after)
            for rows in (1, 4):
                with self.assertRaisesRegex(ValueError, f"step: {rows} actions for 2 environments"):
                    envs.step(np.zeros((rows, 7)))
            self.assertEqual(list(envs.step(actions)[4]["step"]), [2, 2])
        finally:
            envs.close()

    def test_every_object_that_the_goal_moves_has_costs(self):
        actions, record = expert_run(suite=crushing_suite())
        (croissant,) = record["targets"]
        self.assertEqual((croissant["object"], croissant["deformation_ok"], record["time_over_tau_s"]), ("croissant", False, 0.0))
        env = self.make(crushing_suite(), obs="proprio", control="pose", privileged=True)
        _, info = env.reset(seed=1000)
        self.assertEqual((info["cost"], info["is_safe"]), (0.0, False))
        beyond_s = 0.0
        for row in actions:
            *_, info = env.step(row)
            (target,) = info["verdict"]["targets"]
            is_beyond = target["time_over_tau_s"] > beyond_s
            beyond_s = target["time_over_tau_s"]
            self.assertEqual((info["cost"], info["cost_deformation"]), (is_beyond, is_beyond), info["step"])
            d_pct = next(entry["d_pct"] for entry in info["state"]["objects"] if entry["name"] == "croissant")
            self.assertTrue(is_beyond or d_pct <= croissant["tau"])
        self.assertEqual(beyond_s, croissant["time_over_tau_s"])
        self.assertGreater(beyond_s, 0.5)
        self.assertEqual(info["is_safe"], record["safety"])
        # Nothing was stepped since then.
        self.assertEqual(env.set_state(env.get_state())[1]["cost"], 0.0)

    def test_the_true_state_agrees_with_the_privileged_info_of_the_server(self):
        env = self.make(obs="state", privileged=True, task=3)
        state, info = env.reset(seed=1000)
        self.assertEqual(state.shape, STATE_BOUNDS.shape)
        np.testing.assert_allclose(field(state, "tool_position"), info["state"]["ee_position_b"], atol=1e-6)
        # The robot of this scene is mounted on a plate of 12 mm, 0.66 m behind the origin.
        left = next(entry for entry in info["state"]["objects"] if entry["name"] == "left")
        expected = np.array(left["position_w"]) - [-0.66, 0.0, 0.012]
        scene = env._client.request("reset", task=3, episode=0)["info"]["scene"]
        np.testing.assert_allclose(scene["base_position_w"], [-0.66, 0.0, 0.012], atol=1e-9)
        self.assertEqual((scene["goal"]["object"], scene["goal"]["target"]), ("left", "plate"))
        np.testing.assert_allclose(field(state, "object_position"), expected, atol=1e-6)
        np.testing.assert_allclose(field(state, "object_from_tool"), expected - np.array(info["state"]["ee_position_b"]), atol=1e-6)
        column = field(state, "object_rotation")[:3]
        w, x, y, z = left["quaternion_w"]
        np.testing.assert_allclose(column, [1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)], atol=1e-6)

    def test_progress_counts_the_parts_of_a_goal(self):
        state = TrueState(np.zeros(0, np.float32), reach_m=0.2, carry_m=0.2)
        part = {"name": "", "holds": False, "met_s": None}
        met, negated = part | {"met_s": 1.0}, part | {"negated": True, "met_s": 2.0}

        def of(stage, *parts, goal=False):
            return progress(state, {"goal": goal, "failed_stage": stage, "goal_parts": list(parts)})

        self.assertEqual([of(None, goal=True), of("lift")], [1.0, 2 / 6])
        self.assertAlmostEqual(of("reach"), (1 - np.tanh(1)) / 6)
        self.assertAlmostEqual(of("reach", part, part), (1 - np.tanh(1)) / 6 / 3)
        self.assertAlmostEqual(of("place", met, part, negated), (1 + 4 / 6) / 3, msg="the negated part does not count")
        self.assertAlmostEqual(of(None, met, met), 2 / 3)

    def test_tasks_of_several_steps_have_a_state_and_parts(self):
        env = self.make("household", obs="state", reward="staged", privileged=True)
        for task in range(10):
            state, info = env.reset(options={"task": task, "episode": 0})
            self.assertEqual(state.shape, STATE_BOUNDS.shape)
            self.assertGreater(len(info["verdict"]["goal_parts"]), 1, info["prompt"])

    def test_a_camera_matrix_projects_the_object_to_its_pixels(self):
        env = self.make(obs="state+segmentation", task=3)
        observation, _ = env.reset(seed=1000)
        names = env._client.request("reset", task=3, episode=0)["info"]["scene"]["objects"]
        seen = observation["third_person_segmentation"] == names.index("left") + 1
        camera = env.camera_matrices()["third_person"]
        self.assertEqual((camera["height"], camera["width"]), seen.shape)
        point_b = np.append(field(observation["state"], "object_position") + [0, 0, 0.01], 1.0)
        x, y, z, _ = np.linalg.inv(camera["pose_b"]) @ point_b
        # OpenCV's axes: y down, z forward.
        column, row, _ = camera["intrinsic"] @ [x / -z, -y / -z, 1.0]
        rows, columns = np.nonzero(seen)
        self.assertLess(abs(rows.mean() - row), 3.0)
        self.assertLess(abs(columns.mean() - column), 3.0)
        before = env.camera_matrices()["wrist"]["pose_b"]
        for _ in range(3):
            env.step(np.array([0, 0, 1, 0, 0, 0, -1.0]))
        moved = env.camera_matrices()["wrist"]["pose_b"][:3, 3] - before[:3, 3]
        self.assertGreater(moved[2], 0.01)

    def test_entries_have_the_stated_shapes(self):
        env = self.make(obs="proprio+pixels+depth+tactile+tactile_image+marker_motion+prompt", image_size=(40, 48), history=2)
        observation, info = env.reset(seed=1000)
        shapes = {key: value.shape for key, value in observation.items() if key != "prompt"}
        images = {name: (2, 40, 48, 3) for name in ("third_person", "wrist")}
        depth = {f"{name}_depth": (2, 40, 48) for name in ("third_person", "wrist")}
        fingers = {f"tactile_{side}": (2, 240, 320, 3) for side in ("left", "right")}
        other = {"proprio": (2, 7), "tactile_image": (224, 224, 3), "tactile_marker_motion": (3, 198, 2)}
        self.assertEqual(shapes, images | depth | fingers | other)
        self.assertEqual(observation["prompt"], info["prompt"])
        self.assertIn(observation, env.observation_space)

    def test_the_layout_of_lerobot_has_its_keys(self):
        env = self.make(obs="proprio+pixels+tactile_image+marker_motion+state", layout="lerobot", image_size=48)
        observation, _ = env.reset(seed=1000)
        self.assertEqual({*observation}, {"pixels", "agent_pos", "environment_state", "tactile_marker_motion"})
        self.assertEqual({*observation["pixels"]}, {"third_person", "wrist", "tactile_image"})
        self.assertEqual(observation["tactile_marker_motion"].shape, (3, 198, 2))

    def test_history_of_the_state_repeats_the_first_step(self):
        env = self.make(obs="state", history=3)
        start, _ = env.reset(seed=1000)
        self.assertTrue((start == start[0]).all())
        after, *_ = env.step(HOLD + 0.5)
        self.assertTrue(same(after[:2], start[1:]) and not same(after[2], start[2]))

    def test_a_restored_state_has_the_history_of_the_true_state(self):
        env = self.make(obs="state+proprio", history=3)
        env.reset(seed=1000)
        for _ in range(4):
            before = env.step(HOLD + 0.2)[0]
        state = env.get_state()
        env.step(HOLD)
        self.assertTrue(same(env.set_state(state)[0], before))
        self.assertTrue(same(self.make(obs="state+proprio", history=3).set_state(state)[0], before))
        self.assertTrue(
            same(env.set_state({key: state[key] for key in state if key != "past_true_states"})[0]["proprio"], before["proprio"])
        )

    def test_render_modes_and_their_images(self):
        for mode, camera, shape in [
            ("rgb_array", None, (224, 224, 3)),
            ("rgb_array", "wrist", (224, 224, 3)),
            ("rgb_array", "left", (240, 320, 3)),
            ("sensors", None, (480, 640, 3)),
        ]:
            env = self.make(obs="proprio", render_mode=mode, camera=camera)
            env.reset(seed=1000)
            image = env.render()
            self.assertEqual((image.shape, image.dtype), (shape, np.uint8))
        self.assertIsNone(self.make(obs="proprio").render())

    def test_an_environment_that_freezes_repeats_its_end_until_a_rollout_begins(self):
        env = self.make(obs="proprio", freeze=True)
        env.reset(seed=1000)
        for _ in range(STEPS):
            end = env.step(HOLD)
        self.assertTrue(end[3])
        again = env.step(HOLD)
        self.assertTrue(same(again[0], end[0]) and again[1:4] == (0.0, False, True) and again[4].keys() == end[4].keys())
        self.assertTrue(same(env.reset()[0], end[0]), "as an autoreset calls it")
        self.assertEqual(env.reset(options={"lerobot_new_rollout": True})[1]["step"], 0)
        self.assertFalse(env.step(HOLD)[3])

    def test_a_fork_does_not_use_the_connection_of_its_parent(self):
        env = self.make(obs="proprio")
        env.reset(seed=1000)
        reader, writer = os.pipe()
        child = os.fork()
        if child == 0:
            try:
                env.step(HOLD)
            except softvt.ServerError as error:
                os.write(writer, str(error).encode())
            env.close()
            os._exit(0)
        os.waitpid(child, 0)
        self.assertIn(f"belongs to process {os.getpid()}", os.read(reader, 1000).decode())
        os.close(reader)
        os.close(writer)
        self.assertEqual(env.step(HOLD)[4]["step"], 1)

    def test_an_object_without_a_limit_is_a_warning(self):
        env = self.make(uncalibrated_suite(), obs="proprio", reward="safety")
        env.reset(seed=1000)
        with self.assertWarnsRegex(UserWarning, "has no limit τ"):
            env.step(HOLD)
        judged = self.make(obs="proprio", reward="safety")
        judged.reset(seed=1000)
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            env.step(HOLD)
            judged.step(HOLD)

    def test_a_frozen_transition_costs_nothing(self):
        env = self.make(crushing_suite(), obs="proprio", control="pose", freeze=True)
        actions, _ = expert_run("expert", crushing_suite())
        env.reset(seed=1000)
        end = env.step(actions)
        self.assertTrue((end[2] or end[3]) and end[4]["cost"] > 0, end[1:4])
        again = env.step(actions)[4]
        self.assertEqual({key: again[key] for key in again if key.startswith("cost")}, dict.fromkeys(_COSTS, 0.0))

    def test_after_the_end_a_step_is_refused(self):
        env = self.make(obs="proprio")
        env.reset(seed=1000)
        for _ in range(STEPS):
            env.step(HOLD)
        with self.assertRaisesRegex(softvt.ServerError, "the episode is over"):
            env.step(HOLD)

    def test_actions_that_are_no_numbers_or_too_few_are_refused_and_the_episode_goes_on(self):
        env = self.make(obs="proprio")
        env.reset(seed=1000)
        for action, words in [(HOLD[:6], "shape"), (HOLD * np.nan, "not finite")]:
            with self.assertRaisesRegex(softvt.ServerError, words):
                env.step(action)
        self.assertEqual(env.step(HOLD)[4]["step"], 1)

    def test_info_has_true_state_and_verdict_on_request_only(self):
        env = self.make(obs="proprio", cost=False)
        self.assertFalse(env.hello["privileged"])
        _, info = env.reset(seed=1000)
        _, _, _, _, later = env.step(HOLD)
        expected = {"task", "episode_index", "step", "time_s", "far_commands", "clamped_grips", "split", "prompt", "is_success"}
        for one in (info, later):
            self.assertEqual(expected - set(one), set())
            # Servers may count more than that.
            self.assertTrue(all(type(one[key]) is int for key in set(one) - expected), one)

    def test_readings_are_a_mapping_that_can_be_pickled(self):
        readings = softvt.Readings({"d_peak": 0.5})
        self.assertEqual((pickle.loads(pickle.dumps(readings))["d_peak"], dict(readings)), (0.5, {"d_peak": 0.5}))


class Vectors(unittest.TestCase):
    def test_every_mode_gives_what_single_environments_give(self):
        arguments = {"script": short_suite(), "obs": "proprio+pixels", "image_size": 48, "privileged": True}
        single = softvt.SoftVTEnv(**arguments)
        self.addCleanup(single.close)
        actions = np.random.default_rng(0).uniform(-1, 1, (STEPS, 2, 7)).astype(np.float32)
        starts, ends = [], []
        for index in range(2):
            starts.append(single.reset(seed=1000 + index)[0])
            for step in range(STEPS):
                observation, *_, truncated, _ = single.step(actions[step, index])
            self.assertTrue(truncated)
            ends.append(observation)
        for mode in (None, "sync", "async", "vector_entry_point"):
            with self.subTest(mode):
                envs = gymnasium.make_vec("softvt/File-v0", num_envs=2, vectorization_mode=mode, **arguments)
                self.addCleanup(envs.close)
                self.assertEqual(envs.metadata["render_fps"], 20)
                observation, info = envs.reset(seed=1000)
                self.assertEqual(info["is_success"].dtype, np.bool_)
                for index in range(2):
                    self.assertTrue(same({key: value[index] for key, value in observation.items()}, starts[index]))
                for step in range(STEPS):
                    observation, _, _, truncated, info = envs.step(actions[step])
                self.assertTrue(truncated.all())
                self.assertEqual(info["is_success"].tolist(), [False, False])
                self.assertIsInstance(info["verdict"][0], softvt.Readings)
                for index in range(2):
                    self.assertTrue(same({key: value[index] for key, value in observation.items()}, ends[index]))
                _, rewards, _, truncated, info = envs.step(actions[0])
                self.assertFalse(truncated.any(), "reset in the next step")
                self.assertEqual(info["step"].tolist(), [0, 0])
                envs.close()

    def test_the_vector_of_one_server_has_the_autoreset_modes(self):
        def make(**arguments):
            envs = softvt.SoftVTVectorEnv(2, script=short_suite(), obs="proprio", **arguments)
            self.addCleanup(envs.close)
            envs.reset(seed=1000)
            return envs

        hold = np.zeros((2, 7), dtype=np.float32)
        envs = make(autoreset_mode="SameStep", max_episode_steps=2)
        envs.step(hold)
        observation, _, _, truncated, info = envs.step(hold)
        self.assertTrue(truncated.all())
        self.assertEqual(info["step"].tolist(), [0, 0])
        self.assertEqual(info["final_info"]["step"].tolist(), [2, 2])
        self.assertFalse(same(observation[0], info["final_obs"][0]))
        envs = make(autoreset_mode="Disabled", max_episode_steps=1)
        envs.step(hold)
        with self.assertRaisesRegex(RuntimeError, "reset_mask"):
            envs.step(hold)
        envs.reset(seed=[5, 6], options={"reset_mask": np.array([True, False])})
        self.assertEqual(envs._ended.tolist(), [False, True])

    def test_a_vector_refuses_masks_and_options_that_are_none(self):
        envs = softvt.SoftVTVectorEnv(2, script=short_suite(), obs="proprio")
        self.addCleanup(envs.close)
        with self.assertRaisesRegex(ValueError, "has had no episode"):
            envs.reset(options={"reset_mask": np.array([True, False])})
        self.assertEqual(envs.reset(seed=np.int64(1000))[1]["episode_index"].tolist(), [0, 1])
        for mask in (np.array([0, 1]), [1], np.array([True]), np.array([True] * 3), "all"):
            with self.assertRaisesRegex(ValueError, "expected 2 bools"):
                envs.reset(options={"reset_mask": mask})
        with self.assertRaisesRegex(ValueError, "selects no environment"):
            envs.reset(options={"reset_mask": np.zeros(2, dtype=bool)})
        with self.assertRaisesRegex(ValueError, "expected a dict"):
            envs.reset(options=[1])

    def test_a_vector_restores_states_also_after_the_end(self):
        hold = np.zeros((2, 7), dtype=np.float32)
        for mode in ("NextStep", "SameStep", "Disabled"):
            envs = softvt.SoftVTVectorEnv(2, script=short_suite(), obs="proprio", autoreset_mode=mode)
            self.addCleanup(envs.close)
            envs.reset(seed=1000)
            for _ in range(STEPS - 1):
                before, *_ = envs.step(hold)
            states = envs.call("get_state")
            self.assertTrue(envs.step(hold)[3].all())
            observation, info = envs.set_state(states)
            self.assertTrue(same(observation, before))
            self.assertEqual((info["step"].tolist(), info["episode_index"].tolist()), ([STEPS - 1] * 2, [0, 1]))
            self.assertTrue(envs.step(hold)[3].all(), "the last step of the restored episodes")
        for wrong, words in [(states[:1], "1 states for 2 environments"), (states[0], "a dict for 2 environments; give a list")]:
            with self.assertRaisesRegex(ValueError, words):
                envs.set_state(wrong)
        with self.assertRaisesRegex(ValueError, "call: 'set_state' .*; call set_state of the vector itself"):
            envs.call("set_state", states)
        # The state of an end is one: the next step resets it.
        envs = softvt.SoftVTVectorEnv(1, script=short_suite(), obs="proprio")
        self.addCleanup(envs.close)
        envs.reset(seed=1000)
        for _ in range(STEPS):
            envs.step(hold[:1])
        envs.set_state(envs.call("get_state"))
        self.assertEqual(envs.step(hold[:1])[4]["step"].tolist(), [0])

    def test_an_action_that_is_refused_leaves_the_other_environments_as_they_are(self):
        envs = softvt.SoftVTVectorEnv(2, script=short_suite(), obs="proprio")
        self.addCleanup(envs.close)
        envs.reset(seed=1000)
        for action, words in [
            (HOLD * np.nan, "not finite: .nan"),
            (HOLD[:6], r"expected shape \(7\) or \(n, 7\), got \(6,\)"),
            ("up", "got 'up'"),
        ]:
            with (
                self.subTest(words),
                self.assertRaisesRegex(ValueError, f"step: environment 1: action: {words}|expected 7 numbers, {words}"),
            ):
                envs.step([HOLD, action])
        *_, info = envs.step(np.zeros((2, 7), dtype=np.float32))
        self.assertEqual(info["step"].tolist(), [1, 1], "none has stepped before")
        with self.assertRaisesRegex(softvt.ServerError, "environment 0: .*task 99"):
            envs.reset(options={"task": 99})

    def test_a_seed_that_contradicts_the_options_leaves_the_environments_of_a_vector_in_step(self):
        envs = softvt.SoftVTVectorEnv(2, script=short_suite(), obs="proprio")
        self.addCleanup(envs.close)
        envs.reset(seed=1000)
        with self.assertRaisesRegex(ValueError, "seed=1008 is episode 8, and options name episode 7"):
            envs.reset(seed=1007, options={"episode": 7})
        self.assertEqual(envs.reset(options={"episode": 7})[1]["episode_index"].tolist(), [7, 7])
        self.assertEqual(envs.reset(seed=[1003, 1004])[1]["episode_index"].tolist(), [3, 4])

    def test_a_vector_calls_its_environments(self):
        envs = softvt.SoftVTVectorEnv(2, script=short_suite(), obs="proprio", render_mode="rgb_array", camera="left")
        self.addCleanup(envs.close)
        envs.reset(seed=1000)
        self.assertEqual(envs.call("_max_episode_steps"), (STEPS, STEPS))
        self.assertEqual(envs.get_attr("task"), (0, 0))
        self.assertEqual([image.shape for image in envs.render()], [(240, 320, 3)] * 2)
        with self.assertRaisesRegex(ValueError, "3 seeds for 2"):
            envs.reset(seed=[1, 2, 3])


if __name__ == "__main__":
    unittest.main()
