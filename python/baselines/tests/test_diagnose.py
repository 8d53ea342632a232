"""Causes of failure, from traces. Needs no learning library."""

import json
import tempfile
import unittest
from pathlib import Path

import numpy as np
from softvt_baselines import UserError
from softvt_baselines.diagnose import BASE, TABLE_BASE, diagnose, meeting


def trace(angle: float) -> list[dict]:
    """A hand that is turned by an angle and meets an object 3 mm off its middle in step 2."""
    place = [0.45 + BASE[0], -0.1 + BASE[1], 0]
    objects = [{"name": "cube", "position_w": place, "quaternion_w": [1, 0, 0, 0]}]
    turn = [float(np.pi * np.cos(angle / 2)), float(np.pi * np.sin(angle / 2)), 0]  # a tool that points down
    steps = [
        {"ee_position_b": [0.453, -0.1, 0.02], "ee_axis_angle_b": turn, "closure": 0.1 + 0.00125 * k, "objects": objects} for k in range(4)
    ]
    return [step | {"pad_force_n": [0, 0.5 * (k > 1)]} for k, step in enumerate(steps)]


class Diagnoses(unittest.TestCase):
    def test_how_a_hand_meets_an_object(self):
        found = meeting(trace(0.2), "cube")
        self.assertEqual(found.step, 2)
        self.assertAlmostEqual(found.beside, 0.003)
        self.assertAlmostEqual(abs(found.along), 0.003 * np.sin(0.2), places=5)
        self.assertAlmostEqual(abs(found.turned), 0.2, places=5)
        self.assertAlmostEqual(abs(meeting(trace(np.pi / 2 - 0.2), "cube").turned), 0.2, places=5, msg="its sides are alike")
        self.assertEqual(meeting(trace(0.2), "cube").closing, found.closing)
        self.assertIsNone(meeting(trace(0.2)[:2], "cube"))

    def test_one_of_two_of_a_kind_is_named_by_the_prompt(self):
        steps = trace(0)
        for step in steps:
            far = {"name": "left", "position_w": [0.4, 0.3, 0], "quaternion_w": [1, 0, 0, 0]}
            right = step["objects"][0] | {"name": "right", "position_w": [0.45 + TABLE_BASE[0], -0.1 + TABLE_BASE[1], 0]}
            step["objects"] = [far, {"name": "plate", "position_w": [0, 0, 0], "quaternion_w": [1, 0, 0, 0]}, right]
        found = meeting(steps, "cube", "pick up the right soft cube and place it on the plate")
        self.assertAlmostEqual(found.beside, 0.003)

    def test_causes_are_counted_by_task(self):
        row = dict(asset="cube", task=0, goal=True, safety=True, deformation_ok=True, no_drop=True, grip_ratio=1.4, d_peak=0.1, tau=0.2)
        row |= dict(slip_mm=0.5, steps=300, failed_stage=None)
        with tempfile.TemporaryDirectory() as scratch:
            run = Path(scratch)
            rows = [row | dict(episode=0), row | dict(episode=1, safety=False, deformation_ok=False)]
            (run / "episodes.jsonl").write_text("".join(json.dumps(one) + "\n" for one in rows))
            with self.assertRaises(UserError):
                diagnose(run)
            (run / "trace" / "task_000").mkdir(parents=True)
            for episode in range(2):
                path = run / "trace" / "task_000" / f"episode_{episode:05}.jsonl"
                path.write_text("".join(json.dumps(step) + "\n" for step in trace(0)))
            found = diagnose(run).splitlines()
        self.assertEqual(len(found), 2)
        self.assertIn("cube: n 2; safe 1, too firm 1; beside 3 / 3 / 3 mm; safe of those within 3 mm across the fingers", found[1])


if __name__ == "__main__":
    unittest.main()
