"""Motions by feedback laws, and what is taken of a teacher's attempt. Needs no learning library."""

import json
import tempfile
import unittest
from pathlib import Path

import numpy as np
from softvt_baselines import laws
from softvt_baselines.demonstrate import Job, Plan, grasp_of, in_code, number_of, plan_of, start_of, turned_home
from softvt_baselines.laws import Grasp, Release
from softvt_baselines.numbers import GRIPPER, ROTATION, between, rotated
from softvt_baselines.phases import FAST_GRIP, FEELS, holds, is_seen, memory_begins

DOWN = np.array([np.pi, 0, 0])
GRASP = Grasp(np.array([0.46, -0.25, 0.023, *rotated(DOWN, np.array([0, 0, 0.4]))]), 0.08, 0.0, 0.15)
HOME = np.array([0.49, 0, 0.3, *DOWN, 0])


def rows(commands: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Of steps before which these commands were sent: whether pictures are seen, and whether the hand holds what it has felt."""
    commands, first = np.float32(commands), np.array([0])
    begins = memory_begins(commands, first)
    return is_seen(commands, np.arange(len(commands)), begins), holds(commands, first, begins)


class Rotations(unittest.TestCase):
    def test_a_turn_between_two_rotations_leads_from_one_to_the_other(self):
        random = np.random.default_rng(0)
        for _ in range(50):
            first, second = random.normal(0, 1.5, (2, 3))
            found = rotated(first, between(first, second))
            np.testing.assert_allclose(np.linalg.norm(between(found, second)), 0, atol=1e-6)
        np.testing.assert_allclose(between(DOWN, GRASP.pose[3:]), [0, 0, 0.4], atol=1e-9)
        np.testing.assert_allclose(rotated(DOWN, np.zeros(3)), DOWN, atol=1e-9)


class Reaching(unittest.TestCase):
    def test_a_hand_arrives_from_everywhere_and_begins_to_feel(self):
        random = np.random.default_rng(0)
        for _ in range(100):
            start = start_of(GRASP, HOME, random)
            way = laws.reach(start, GRASP)
            self.assertLess(len(way), laws.MOST_STEPS)
            np.testing.assert_allclose(way[-1, :3], GRASP.pose[:3], atol=laws.ARRIVED)
            self.assertLess(np.linalg.norm(between(way[-1, ROTATION], GRASP.pose[3:])), laws.TURNED)
            seen, _ = rows(np.concatenate([[start], way]))
            self.assertTrue(seen[:-4].all() and not seen[-1], "the hand feels in the last steps")
            fast = np.diff(way[:, GRIPPER])
            self.assertTrue(((fast < laws.SLOW_CLOSING + 1e-6) | (fast > FAST_GRIP)).all(), "no step is between fast and slow")
        self.assertGreater(laws.SLOW_STEPS * laws.SLOW_CLOSING, FEELS)

    def test_the_hand_turns_close_to_the_object_and_comes_down_above_it(self):
        way = laws.reach(HOME, GRASP)
        distance = np.hypot(*(way[:, :2] - GRASP.pose[:2]).T)
        turned = np.array([np.linalg.norm(between(row[ROTATION], DOWN)) for row in way])
        self.assertTrue((turned[distance > laws.TURNS_WITHIN + 0.02] < 1e-6).all())
        self.assertLess(distance[way[:, 2] < 0.045].max(), 0.006)

    def test_round_objects_are_grasped_without_a_turn_and_square_ones_with_the_smallest(self):
        for asset, angle in [("cylinder", 0), ("capsule", 1.2), ("cube", 1.2 - np.pi / 2)]:
            grasp = Grasp(np.array([0, 0, 0, *rotated(DOWN, np.array([0, 0, 1.2]))]), 0.1, 0, 0.1)
            found = turned_home(grasp, HOME, asset)
            np.testing.assert_allclose(between(DOWN, found.pose[3:])[2], angle, atol=1e-6, err_msg=asset)


class Carrying(unittest.TestCase):
    held = np.array([*GRASP.pose, 0.24])
    release = Release(np.array([0.6, 0.25, 0.035, *GRASP.pose[3:]]), 0.19, 0.05)

    def test_an_object_is_lifted_carried_above_obstacles_and_let_go(self):
        way = laws.carry(self.held, self.release)
        before = way[way[:, GRIPPER] == self.held[GRIPPER]]
        np.testing.assert_allclose(before[-1, :2], self.release.pose[:2], atol=laws.CARRY_RADIUS)
        self.assertLess(before[-1, 2] - self.release.pose[2], 0.002)
        gone = np.hypot(*(way[:, :2] - self.held[:2]).T)
        self.assertGreater(way[(gone > 0.01) & (gone < 0.45), 2].min(), self.release.over - laws.BELOW)
        self.assertAlmostEqual(way[-1, GRIPPER], self.release.closure)
        self.assertGreater(way[-1, 2], self.release.pose[2] + 0.05)
        speed = np.linalg.norm(np.diff(before[:, :3], axis=0), axis=1) / laws.STEP
        self.assertLess(np.abs(np.diff(speed)).max() / laws.STEP, 1.5, "m/s²")

    def test_what_a_hand_holds_is_known_until_it_lets_go(self):
        closing = np.array([*self.held[:6], 0.15]) + np.outer(0.001 * np.arange(90), [0, 0, 0, 0, 0, 0, 1])
        way = laws.carry(closing[-1], self.release)
        seen, held = rows(np.concatenate([closing, way]))
        self.assertTrue(held[89:-25].all() and seen[95:].all() and not held[:10].any())
        self.assertFalse(held[-15:].any())


class Plans(unittest.TestCase):
    def test_an_attempt_shows_where_the_hand_grasps_and_lets_go(self):
        closing = GRASP.pose[None].repeat(101, 0)
        closing = np.concatenate([closing, (0.15 + 0.00125 * np.arange(101))[:, None]], 1)
        wait = closing[-1:].repeat(6, 0)
        carried = laws.carry(wait[-1], Carrying.release)
        reached = laws.reach(HOME, GRASP)[: -laws.SLOW_STEPS]
        actions = np.concatenate([reached, closing, wait, carried])
        plan, grasp = plan_of(actions), grasp_of(actions)
        self.assertEqual(len(plan.actions), len(reached) + 107)
        np.testing.assert_allclose(grasp.pose[:3], GRASP.pose[:3], atol=laws.ARRIVED)
        self.assertAlmostEqual(grasp.closure, 0.15, places=6)
        np.testing.assert_allclose(plan.release.pose[:3], Carrying.release.pose[:3], atol=laws.CARRY_RADIUS)
        self.assertAlmostEqual(plan.release.closure, Carrying.release.closure)
        self.assertIsNone(plan_of(np.concatenate([actions, actions])), "it grasped twice")
        self.assertIsNone(plan_of(reached), "it never felt")

    def test_a_hand_that_closes_at_once_closes_to_what_the_teacher_found(self):
        plan = Plan(np.array([[0, 0, 0, 0, 0, 0, closure] for closure in (0, 0.2, 0.3, 0.4, 0.41, 0.42, 0.43)]), 2, Carrying.release)
        with tempfile.TemporaryDirectory() as scratch:
            trace = Path(scratch) / "trace.jsonl"
            forces = [0, 9, 1, 2, 3, 4, 5, 100]  # the last one after the lift
            trace.write_text("".join(json.dumps({"pad_force_n": [force, force + 1]}) + "\n" for force in forces))
            job = Job(0, 0, "cube", Path(), trace, 0)
            self.assertEqual((number_of(job, plan, "two-width"), number_of(job, plan, "force")), (0.43, 3.5))
        carried = laws.carry(np.array([0.4, 0, 0.02, *DOWN, 0.43]), Carrying.release)
        found = in_code(carried, 0.43, 3.5, "force")
        np.testing.assert_array_equal(found[:, :6], carried[:, :6])
        self.assertEqual({*found[:-20, GRIPPER]}, {3.5})
        self.assertEqual({*found[-20:, GRIPPER]}, {-1.0}, "from the first step of the release on")


if __name__ == "__main__":
    unittest.main()
