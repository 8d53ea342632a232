"""Networks, checkpoints and training on tiny data. Needs torch and torchvision."""

import tempfile
import unittest
from pathlib import Path

import numpy as np
import torch
from softvt_baselines import UserError
from softvt_baselines.checkpoint import device_of, load
from softvt_baselines.data import CAMERAS, TACTILE
from softvt_baselines.data import load as load_demonstrations
from softvt_baselines.infer import Answering, blended
from softvt_baselines.inputs import Shape
from softvt_baselines.serve import Plan, Request
from softvt_baselines.train import TrainOptions, train
from test_data import recording

CPU = torch.device("cpu")


class Policies(unittest.TestCase):
    def setUp(self):
        scratch = tempfile.TemporaryDirectory()
        self.addCleanup(scratch.cleanup)
        self.folder = Path(scratch.name)
        self.demos = load_demonstrations([recording(self.folder / "data", edge=32)], "continuous", 32, has_tactile=True, has_drives=True)

    def trained(self, shape: Shape) -> Path:
        path = self.folder / "policy.pt"
        train(self.demos, TrainOptions(shape, 2, 4, 0, CPU), path, {})
        return path

    def observation(self, shape: Shape, seed: int) -> dict:
        random = np.random.default_rng(seed)
        frames = () if shape.frames == 1 else (shape.frames,)
        obs = {camera: random.integers(0, 255, (*frames, 32, 32, 3), np.uint8) for camera in CAMERAS}
        obs |= {key: random.integers(0, 255, (*frames, 24, 32, 3), np.uint8) for key in TACTILE}
        state = np.broadcast_to(np.array([0, 0, 0, 3.1, 0, 0, 0.04, 0], np.float32), (*frames, 8))
        motion = random.normal(0, 1, (6, 198, 2)).astype(np.float32)
        return obs | {
            "state": state,
            "prompt": "pick up the left bun",
            "softvt": {"seed": seed, "step": 0},
            "tactile_marker_motion": motion,
        }

    def test_every_kind_of_policy_trains_and_answers_whatever_else_is_in_the_batch(self):
        for has_touch, head, frames, has_pictures in [
            (False, "regression", 1, False),
            (True, "regression", 1, True),
            (True, "flow", 2, False),
        ]:
            shape = Shape(
                has_touch,
                head=head,
                frames=frames,
                edge=32,
                chunk=5,
                width=32,
                layers=1,
                has_tactile_pictures=has_pictures,
                has_drives=True,
            )
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

    def test_training_is_repeatable(self):
        shape = Shape(False, edge=32, chunk=5, width=32, layers=1, has_drives=True)
        first = torch.load(self.trained(shape), weights_only=True)["weights"]
        second = torch.load(self.trained(shape), weights_only=True)["weights"]
        self.assertTrue(all(torch.equal(first[name], second[name]) for name in first))

    def test_broken_checkpoints_are_refused(self):
        path = self.trained(Shape(False, edge=32, chunk=5, width=32, layers=1, has_drives=True))
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
