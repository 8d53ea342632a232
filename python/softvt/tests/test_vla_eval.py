"""The benchmark class under the stock tool of vla-eval, with a model server that repeats the actions of an expert."""

import json
import subprocess
import sys
import time
import unittest

import numpy as np
from softvt.vla_eval import SoftVTBenchmark
from suites_for_tests import FOLDER, expert_run, short_suite
from vla_eval.benchmarks.base import StepResult
from vla_eval.specs import GRIPPER_CLOSE_POS, POSITION_ABSOLUTE

SERVER = """
import sys
import numpy as np
from vla_eval.model_servers.base import ModelServer
from vla_eval.model_servers.serve import serve
from vla_eval.specs import GRIPPER_01, IMAGE_RGB, POSITION_ABSOLUTE, ROTATION_AA

rows = np.load(sys.argv[2])

class Repeat(ModelServer):
    async def on_episode_start(self, config, ctx):
        self.step = 0

    async def on_observation(self, obs, ctx):
        assert obs["images"]["tactile_image"].shape == (224, 224, 3)
        assert obs["tactile_marker_motion"].shape == (9, 198, 2) and obs["states"].shape == (7,)
        self.step += 1
        await ctx.send_action({"actions": rows[min(self.step, len(rows)) - 1]})

    async def on_episode_end(self, result, ctx):
        pass

    def get_action_spec(self):
        return {"position": POSITION_ABSOLUTE, "rotation": ROTATION_AA, "gripper": GRIPPER_01}

    def get_observation_spec(self):
        return {"agentview": IMAGE_RGB}

serve(Repeat(), host="127.0.0.1", port=int(sys.argv[1]))
"""
PORT = 18795


class Benchmarks(unittest.TestCase):
    def test_the_stock_tool_aggregates_success_safety_drops_and_deformation(self):
        actions, record = expert_run("expert-binary")
        np.save(FOLDER / "rows.npy", actions)
        out = FOLDER / "vla"
        config = {
            "server": {"url": f"ws://127.0.0.1:{PORT}"},
            "output_dir": str(out),
            "benchmarks": [
                {
                    "benchmark": "softvt.vla_eval:SoftVTBenchmark",
                    "name": "softvt",
                    "episodes_per_task": 1,
                    "max_tasks": 1,
                    "params": {"suite": "object_soft", "seed": 0, "send_tactile": True, "image_size": 48},
                }
            ],
        }
        (FOLDER / "config.json").write_text(json.dumps(config))
        server = subprocess.Popen([sys.executable, "-c", SERVER, str(PORT), str(FOLDER / "rows.npy")], stderr=subprocess.DEVNULL)
        try:
            # The tool tries again while the server starts.
            time.sleep(2)
            tool = [sys.executable, "-m", "vla_eval.cli.main", "run", "--config", str(FOLDER / "config.json"), "--no-docker", "--yes"]
            done = subprocess.run(tool, capture_output=True, text=True)
        finally:
            server.kill()
            server.wait()
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("Spec validation passed", done.stdout + done.stderr)
        result = json.loads(next(out.glob("*_aggregate.json")).read_text())
        self.assertEqual((result["mean_success"], result["mean_safety"], result["mean_no_drop"]), (1.0, 0.0, 1.0))
        self.assertAlmostEqual(result["max_d_over_tau"], record["d_peak"] / record["tau"], places=3)

    def test_a_benchmark_of_several_suites_is_refused(self):
        with self.assertRaisesRegex(ValueError, "has the suites object_soft, .*give one of them"):
            SoftVTBenchmark("all").get_tasks()

    def test_formats_and_held_actions_follow_the_control(self):
        pose = SoftVTBenchmark(short_suite(), image_size=48)
        delta = SoftVTBenchmark(
            short_suite(), control="delta_osc", gripper="binary", send_wrist_image=False, send_state=False, image_size=48
        )
        self.addCleanup(pose.cleanup)
        self.addCleanup(delta.cleanup)
        self.assertEqual(pose.get_action_spec()["position"], POSITION_ABSOLUTE)
        self.assertEqual(delta.get_action_spec()["gripper"], GRIPPER_CLOSE_POS)
        self.assertEqual(set(delta.get_observation_spec()), {"agentview", "language"})
        last = {"actions": np.arange(7.0)}
        self.assertIs(pose.get_hold_action(last), last)
        np.testing.assert_array_equal(delta.get_hold_action(last)["actions"], [0, 0, 0, 0, 0, 0, 6])
        self.assertEqual(delta.get_hold_action(None)["actions"][-1], -1)
        self.assertEqual(pose.get_metadata()["max_steps"], 12)
        with self.assertRaisesRegex(ValueError, "8 numbers"):
            pose.step({"actions": np.zeros(8)})

    def test_an_answer_that_is_no_action_is_quoted_with_the_form_of_one(self):
        benchmark = SoftVTBenchmark(short_suite())
        for action, words in [
            ({"error": "CUDA out of memory"}, "no 'actions', but {'error': 'CUDA out of memory'}; a model server of vla-eval answers"),
            ({"action": [0, 1]}, r"no 'actions', but {'action': \[0, 1\]}"),
            ({"actions": {"x": 1}}, "the answer has 'actions': {'x': 1}; a model server"),
            ({"actions": ["a"] * 200}, "…; a model server"),
            ({"actions": None}, "no 'actions', but {'actions': None}"),
            ([0.0] * 7, r"the answer is \[0.0, "),
        ]:
            with self.subTest(action), self.assertRaisesRegex(ValueError, words):
                benchmark.step(action)

    def test_the_ratio_is_that_of_the_object_for_which_it_is_largest(self):
        verdict = {"goal": True, "safety": False, "no_drop": True, "d_peak": 0.2, "tau": 0.4}
        rigid, crushed = {"d_peak": None, "tau": None}, {"d_peak": 3.0, "tau": 0.5}
        benchmark = SoftVTBenchmark(short_suite())
        for objects, ratio in [(verdict, 0.5), (verdict | {"targets": [rigid, crushed]}, 6.0), (verdict | rigid, None)]:
            result = benchmark.get_step_result(StepResult(None, 0.0, True, {"verdict": objects}))
            self.assertEqual(result.get("d_over_tau"), ratio)

    def test_impossible_parameters_are_refused_before_a_server_starts(self):
        for arguments, words in [
            ({"control": "delt"}, "control='delt': expected 'delta'"),
            ({"seed": "a"}, "seed='a': expected a whole number"),
            ({"image_size": [64, 64]}, r"image_size=\[64, 64\]: expected a whole number"),
            ({"flags": "--rigid-twin"}, r'write flags=\("--rigid-twin",\)'),
            ({"seed": 3, "flags": ["--seed", "7"]}, "--seed is set by the argument seed; leave it out of flags"),
            ({"flags": ["--gripper=binary"]}, "--gripper is set by the argument gripper"),
            ({"send_state": "no"}, "send_state='no': expected True or False"),
        ]:
            with self.subTest(arguments), self.assertRaisesRegex(ValueError, words):
                SoftVTBenchmark(**arguments)
        SoftVTBenchmark(flags=["--split", "demonstration", "--shift", "stiffness=0.5"])


if __name__ == "__main__":
    unittest.main()
