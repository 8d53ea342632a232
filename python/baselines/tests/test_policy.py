"""Networks, checkpoints and training on tiny data. Needs torch and torchvision."""

import tempfile
import unittest
from pathlib import Path
from unittest import mock

import h5py
import numpy as np
import torch
from softvt_baselines import UserError, prompts
from softvt_baselines.checkpoint import device_of, load
from softvt_baselines.data import CAMERAS, Statistics, commands
from softvt_baselines.data import load as load_demonstrations
from softvt_baselines.infer import Answering, blended
from softvt_baselines.inputs import MOSAIC, RECENT, Past, Shape, read
from softvt_baselines.model import Policy
from softvt_baselines.numbers import FINE, fine, turns
from softvt_baselines.serve import Plan, Request
from softvt_baselines.train import Batches, TrainOptions, train
from test_data import STEPS, recording

CPU = torch.device("cpu")


class Policies(unittest.TestCase):
    def setUp(self):
        scratch = tempfile.TemporaryDirectory()
        self.addCleanup(scratch.cleanup)
        self.folder = Path(scratch.name)
        self.demos = load_demonstrations([recording(self.folder / "data", edge=32)], "continuous", 32, has_tactile=True, has_drives=True)

    def trained(self, shape: Shape) -> Path:
        path, demos = self.folder / "policy.pt", self.demos
        if shape.has_memory:
            demos = load_demonstrations([self.folder / "data"], "continuous", 32, has_tactile=True, has_drives=True, has_memory=True)
            demos.commands[:] = 0
            demos.commands[:, 6] = 0.005 * (np.arange(len(demos.actions)) % STEPS)
        train(demos, TrainOptions(shape, 2, 4, 0, CPU), path, {})
        return path

    def observation(self, shape: Shape, seed: int) -> dict:
        random = np.random.default_rng(seed)
        frames = () if shape.frames == 1 else (shape.frames,)
        obs = {camera: random.integers(0, 255, (*frames, 32, 32, 3), np.uint8) for camera in CAMERAS}
        obs["tactile_image"] = random.integers(0, 255, (224, 224, 3), np.uint8)
        states = (RECENT,) if shape.has_memory else frames
        state = np.broadcast_to(np.array([0, 0, 0, 3.1, 0, 0, 0.04, 0], np.float32), (*states, 8))
        motion = random.normal(0, 1, (shape.marker_rows, 198, 2)).astype(np.float32)
        return obs | {
            "state": state,
            "prompt": "pick up the left bun",
            "softvt": {"seed": seed, "step": 0},
            "tactile_marker_motion": motion,
        }

    def test_states_are_not_rounded_to_half_precision(self):
        seen = []
        net = Policy(Shape(edge=32, chunk=5, width=32, layers=1))
        net.tokens.state[0].register_forward_hook(lambda _, inputs, answer: seen.append(answer))
        obs = {key: torch.zeros((2, 1, 32, 32, 3), dtype=torch.uint8) for key in CAMERAS}
        obs |= {"state": torch.ones((2, 1, 7)), "prompt": torch.zeros((2, 4), dtype=torch.long)}
        obs["state"][1] += 1 / 512
        with torch.autocast("cpu", torch.bfloat16):
            net.tokens(obs)
        self.assertFalse(torch.equal(seen[0][0], seen[0][1]))

    def test_every_kind_of_policy_trains_and_answers_whatever_else_is_in_the_batch(self):
        for touch, head, frames, has_memory in [
            ("", "regression", 1, False),
            ("pictures", "regression", 1, False),
            ("contact", "regression", 1, False),
            ("markers", "flow", 2, False),
            ("", "regression", 1, True),
            ("markers", "regression", 1, True),
            ("contact", "regression", 1, True),
            ("pictures", "regression", 2, True),
            ("markers", "flow", 1, True),
        ]:
            options = dict(head=head, frames=frames, has_memory=has_memory)
            shape = Shape(touch, edge=32, chunk=5, width=32, layers=1, has_drives=True, **options)
            answering = Answering(load(self.trained(shape), CPU), CPU)
            observations = [self.observation(shape, seed) for seed in range(5)]
            requests = [Request(observation, None) for observation in observations]
            together = answering(requests)
            self.assertEqual(together[0].shape, (5, 7))
            for request, answer in zip(requests, together):
                np.testing.assert_array_equal(answering([request])[0], answer)
            wrong = answering([Request(observations[0] | {"prompt": "fly away"}, None), requests[1]])
            self.assertIsInstance(wrong[0], UserError)
            np.testing.assert_array_equal(wrong[1], together[1])

    def test_an_answer_keeps_a_share_of_what_was_planned_for_the_same_steps(self):
        planned, fresh = np.arange(5.0)[:, None] * np.ones(7), np.zeros((5, 7))
        found = blended(fresh, 12, Plan(10, planned), np.full(7, 0.5))
        self.assertEqual(found[:, 0].tolist(), [1, 1.5, 2, 0, 0])
        for step, last in [(12, None), (10, Plan(10, planned)), (0, Plan(10, planned)), (15, Plan(10, planned))]:
            np.testing.assert_array_equal(blended(fresh, step, last, np.full(7, 0.5)), fresh)

    def test_a_server_remembers_what_training_showed(self):
        demos = load_demonstrations([self.folder / "data"], "continuous", 32, has_tactile=True, has_memory=True)
        slow = np.minimum(np.arange(len(demos.actions)) % STEPS, 3) * 0.01 + 1e-4 * np.arange(len(demos.actions))
        demos.actions[:, 0], demos.state[:, 0] = slow, slow - 0.001
        demos.actions[:, 6] = 0.005 * (np.arange(len(demos.actions)) % STEPS)
        demos.commands = commands(demos.state, demos.actions, np.array([STEPS, STEPS]))
        statistics = Statistics.of(demos, 5)
        with h5py.File(self.folder / "data" / "hdf5" / "suite_task0_demo.hdf5") as file:
            motion = file["data/demo_0/obs/gripper_marker_motion"][:]
        demos.tactile_pictures = np.random.default_rng(0).integers(0, 255, demos.tactile_pictures.shape, np.uint8)
        for touch in ("markers", "contact", "pictures"):
            shape = Shape(touch, edge=32, chunk=5, has_memory=True)
            batches = Batches(demos, statistics, TrainOptions(shape, 1, 1, 0, CPU))
            before, last = None, 0
            for step in (0, 2, 4, 8, 11):
                shown = np.maximum(np.arange(step - RECENT + 1, step + 1), 0)
                obs = self.observation(shape, 0) | {"state": demos.state[shown]}
                obs["tactile_marker_motion"] = np.concatenate([motion[:1, :, 0], motion[shown, :, 1]]).reshape(-1, 198, 2)
                cells = demos.tactile_pictures[shown[-MOSAIC:]].reshape(2, 4, 2, 56, 56, 3).transpose(2, 0, 3, 1, 4, 5)
                obs["tactile_image"] = cells.reshape(224, 224, 3)
                before = before and (before, demos.actions[last:step])
                inputs, before = read(obs, shape, statistics, prompts.Vocabulary(demos.prompts), before)
                last = step
                with mock.patch("softvt_baselines.train.MEMORY_NOISE", 0):
                    expected = batches._remembered(torch.tensor([step])) | {"axes": batches.axes[[step]]}
                self.assertEqual("tactile" in expected, touch == "pictures")
                for key, value in expected.items():
                    self.assertEqual(inputs[key].shape, value.shape)
                    np.testing.assert_allclose(inputs[key], value.numpy(), rtol=1e-5, atol=1e-6, err_msg=f"{touch}: {key} in step {step}")

    def test_a_hand_that_feels_answers_from_its_memory_along_its_axes(self):
        shape = Shape("markers", edge=32, chunk=5, width=32, layers=1, has_drives=True, has_memory=True)
        answering = Answering(load(self.trained(shape), CPU), CPU)
        commands = np.zeros((20, 7), np.float32)
        commands[:, 3:6], commands[:, 6] = [np.pi, 0, 0.4], 0.001 * np.arange(20)
        past, action = Past(commands, commands, np.zeros((20, 6), np.float32)), commands[-1] + np.float32([0, 0, 0, 0, 0, 0, 0.001])
        wanted = np.zeros((1, 5, 7), np.float32)
        wanted[..., 1] = 0.0003  # towards the left finger
        answer = torch.from_numpy(answering.checkpoint.statistics.felt.apply(fine(wanted, FINE)))
        with mock.patch.object(answering.checkpoint.policy.feeling, "forward", lambda obs: answer.expand(len(obs["seen"]), -1, -1)):
            obs = self.observation(shape, 0) | {"softvt": {"seed": 0, "step": 1}}
            found = answering([Request(obs, Plan(0, action[None].repeat(5, 0), past))])[0]
        np.testing.assert_allclose(found[0, :3], 0.0003 * turns(action[3:6])[:, 1], atol=1e-7)
        np.testing.assert_allclose(found[0, 3:], action[3:], atol=1e-5)

    def test_a_teacher_that_closes_fast_is_refused(self):
        demos = load_demonstrations([self.folder / "data"], "continuous", 32, has_memory=True)
        with self.assertRaisesRegex(UserError, "needs those of a teacher that feels"):
            train(demos, TrainOptions(Shape(edge=32, has_memory=True), 1, 1, 0, CPU), self.folder / "policy.pt", {})

    def test_a_policy_with_memory_refuses_to_replan_too_late(self):
        shape = Shape(edge=32, chunk=5, width=32, layers=1, has_drives=True, has_memory=True)
        answering = Answering(load(self.trained(shape), CPU), CPU)
        first = Request(self.observation(shape, 0), None)
        plan = Plan(0, answering([first])[0], first.memory)
        found = [answering([Request(self.observation(shape, 1) | {"softvt": {"seed": 1, "step": step}}, plan)])[0] for step in (5, 6)]
        self.assertEqual(found[0].shape, (5, 7))
        self.assertIn("needs --replan 5 or less", str(found[1]))
        self.assertEqual(Shape("pictures", has_memory=True).most_executed, MOSAIC, "an observation has no more tactile pictures")

    def test_steps_are_trained_on_whose_frames_have_pictures(self):
        demos = load_demonstrations([self.folder / "data"], "continuous", 32, has_memory=True)
        demos.commands[:] = 0
        demos.commands[:, 6] = 0.005 * (np.arange(len(demos.actions)) % STEPS)  # from the fourth step on, the hand feels
        demos.picture[2:STEPS] = -1
        demos.picture[STEPS + 1 :: 3] = -1
        for frames, expected in ((1, {0, 1, 12, 14}), (2, {0, 1, 12})):
            batches = Batches(
                demos, Statistics.of(demos, 5), TrainOptions(Shape(edge=32, chunk=5, frames=frames, has_memory=True), 1, 1, 0, CPU)
            )
            self.assertEqual({*batches.steps.tolist()}, expected)

    def test_training_is_repeatable(self):
        shape = Shape(edge=32, chunk=5, width=32, layers=1, has_drives=True)
        first = torch.load(self.trained(shape), weights_only=True)["weights"]
        second = torch.load(self.trained(shape), weights_only=True)["weights"]
        self.assertTrue(all(torch.equal(first[name], second[name]) for name in first))

    def test_broken_checkpoints_are_refused(self):
        path = self.trained(Shape(edge=32, chunk=5, width=32, layers=1, has_drives=True))
        content = torch.load(path, weights_only=True)

        def refused(words: str, **changes) -> None:
            torch.save({key: value for key, value in (content | changes).items() if value is not None}, path)
            with self.assertRaises(UserError) as caught:
                load(path, CPU)
            self.assertIn(words, str(caught.exception))

        refused("version 0", version=0)
        refused("has no statistics", statistics=None)
        refused("size mismatch", shape=content["shape"] | {"width": 64})
        path.write_bytes(b"no checkpoint")
        with self.assertRaises(UserError):
            load(path, CPU)
        with self.assertRaises(UserError):
            load(self.folder / "none.pt", CPU)

    @unittest.skipIf(torch.cuda.is_available(), "there is a GPU")
    def test_a_gpu_that_is_not_there_is_an_error(self):
        with self.assertRaises(UserError) as caught:
            device_of("cuda")
        self.assertIn("--device cpu", str(caught.exception))


if __name__ == "__main__":
    unittest.main()
