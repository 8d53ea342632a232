"""Reading demonstrations, normalisation, prompts and grip codes. Needs no learning library."""

import json
import tempfile
import unittest
from pathlib import Path

import h5py
import numpy as np
from softvt_baselines import UserError, prompts
from softvt_baselines.data import (
    ACTIONS,
    CAMERAS,
    CELLS,
    TACTILE,
    Statistics,
    contact,
    displacements,
    hand_steps,
    load,
    moving_steps,
    pack,
    readings,
    shrink,
)
from softvt_baselines.inputs import LIMITS, MOSAIC, RECENT, REMEMBERED, Past, Shape, mosaic_cells, read, remembered
from softvt_baselines.numbers import FINE, Standard, coarse, fine, fold, hand, mean_axis, reference, turned, turns
from softvt_baselines.phases import is_seen, memory_begins

STEPS = 12
# Initial positions of the markers of a finger, px.
GRID = 20.0 * np.stack(np.meshgrid(np.arange(11), np.arange(9)), -1).reshape(99, 2)


def rotation(vector: np.ndarray) -> np.ndarray:
    """Rotation matrix of a rotation vector, by Rodrigues' formula."""
    angle = np.linalg.norm(vector)
    x, y, z = vector / angle
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


def recording(folder: Path, demos: int = 2, without: tuple[str, ...] = (), gripper: str | None = None, edge: int = 4) -> Path:
    """A recording of one task with simple numbers, as softvt record leaves it."""
    (folder / "hdf5").mkdir(parents=True)
    with h5py.File(folder / "hdf5" / "suite_task0_demo.hdf5", "w") as file:
        for index in range(demos):
            demo = file.create_group(f"data/demo_{index}")
            demo.attrs["num_samples"], demo.attrs["language"] = STEPS, "pick up the left bun"
            actions = np.zeros((STEPS, 7))
            actions[:, 0], actions[:, 3], actions[:, 6] = 0.01 * np.arange(STEPS), 3.1, 0.1 * index
            streams = {f"obs/{stream}": np.full((STEPS, edge, edge, 3), 10 * index, np.uint8) for stream in CAMERAS.values()}
            streams |= {f"obs/{stream}": np.full((STEPS, 6, 8, 3), 20 * index, np.uint8) for stream in TACTILE}
            streams |= {stream: actions for stream in ACTIONS.values()}
            streams["obs/state"], streams["obs/gripper_closure"] = actions, np.full((STEPS, 1), 0.1 * index)
            streams["obs/gripper_width_sensed"] = np.full((STEPS, 1), 0.04 * index)
            streams["obs/gripper_marker_motion"] = np.random.default_rng(index).normal(0, 1, (STEPS, 2, 2, 99, 2)).astype(np.float32)
            streams["obs/gripper_marker_motion"][:, :, 0] = GRID
            for name, values in streams.items():
                if name not in without:
                    demo[name] = values
    (folder / "dataset.json").write_text("{}")
    if gripper != "":
        (folder / "recording.json").write_text(json.dumps({"gripper": gripper} if gripper else {}))
    return folder


class Recordings(unittest.TestCase):
    def setUp(self):
        scratch = tempfile.TemporaryDirectory()
        self.addCleanup(scratch.cleanup)
        self.folder = Path(scratch.name)

    def refused(self, words: str, *arguments) -> None:
        with self.assertRaises(UserError) as caught:
            load(*arguments)
        self.assertIn(words, str(caught.exception))

    def test_all_steps_are_read_in_order(self):
        demos = load([recording(self.folder / "a")], "continuous", 4)
        self.assertEqual(demos.pictures["image"].shape, (2 * STEPS, 4, 4, 3))
        self.assertEqual(demos.pictures["image"][:, 0, 0, 0].tolist(), [0] * STEPS + [10] * STEPS)
        self.assertEqual((demos.start[0], demos.start[-1], demos.last[0], demos.last[-1]), (0, STEPS, STEPS - 1, 2 * STEPS - 1))
        np.testing.assert_allclose(demos.actions[STEPS:, 6], 0.1)
        self.assertEqual(demos.prompts, ["pick up the left bun"])
        again = load([self.folder / "a", recording(self.folder / "b")], "force", 4)
        self.assertEqual((len(again.actions), again.start[-1]), (4 * STEPS, 3 * STEPS))

    def test_the_exact_width_and_the_command_are_seen_with_the_drives_only(self):
        folder = recording(self.folder / "a")
        vision, drives = load([folder], "continuous", 4), load([folder], "continuous", 4, has_drives=True)
        self.assertEqual((vision.state.shape, vision.is_relative), ((2 * STEPS, 7), False))
        np.testing.assert_allclose(vision.state[STEPS:, 6], 0.02, rtol=1e-6, err_msg="half the sensed width")
        self.assertEqual((drives.state.shape, drives.is_relative), ((2 * STEPS, 8), True))
        np.testing.assert_allclose(drives.state[STEPS:, 6:], 0.1, rtol=1e-6)
        self.assertIn('parts = { "position", "axis_angle", "sensed_finger_position" }', Shape("markers").profile("vt"))
        self.assertIn(
            'parts = { "position", "axis_angle", "finger_position", "closure" }', Shape("markers", has_drives=True).profile("vpt")
        )
        self.assertFalse(load([folder], "force", 4, has_drives=True).is_relative, "a force is no change of a closure")

    def test_what_is_missing_is_named(self):
        self.refused("no dataset.json", [self.folder], "continuous", 4)
        self.refused("--images video", [recording(self.folder / "a", without=("obs/agentview_rgb",))], "continuous", 4)
        self.refused("no actions_force", [recording(self.folder / "b", without=("actions_force",))], "force", 4)
        self.refused("record with --edge 32, or train with --edge 4", [recording(self.folder / "d")], "continuous", 32)
        self.refused("recording.json", [recording(self.folder / "e", gripper="")], "continuous", 4)
        for stream in ("gripper_closure", "gripper_width_sensed"):
            self.refused(stream, [recording(self.folder / stream, without=(f"obs/{stream}",))], "continuous", 4)
        shown = recording(self.folder / "shown")
        numbers = pack(shown, 4, 1) / "numbers.npz"
        np.savez(numbers, **np.load(numbers), picture=np.arange(2 * STEPS))
        self.refused("demonstrate with --frames 2", [shown], "continuous", 4, False, False, True, 2)
        self.refused("--gripper force", [recording(self.folder / "c", gripper="force")], "continuous", 4)

    def test_tactile_pictures_are_those_of_both_fingers(self):
        demos = load([recording(self.folder / "a"), recording(self.folder / "b", demos=1)], "continuous", 4, has_tactile=True)
        self.assertEqual(demos.tactile_pictures.shape, (3 * STEPS, *CELLS))
        self.assertEqual(demos.tactile_pictures[demos.tactile_picture][:, 1, 0, 0, 0].tolist(), [0] * STEPS + [20] * STEPS + [0] * STEPS)
        recorded = self.folder / "c"
        (recorded / "packed_4").mkdir(parents=True)
        (recorded / "dataset.json").write_text("{}")
        with self.assertRaisesRegex(UserError, "no tactile pictures: record it again, demonstrate with --tactile-pictures"):
            pack(recorded, None, 1)

    def test_a_new_recording_in_the_same_folder_is_packed_again(self):
        folder = recording(self.folder / "a")
        load([folder], "continuous", 4)
        (folder / "dataset.json").write_text('{"demonstrations": 3}')
        (folder / "hdf5" / "suite_task0_demo.hdf5").unlink()
        self.refused("no demonstrations", [folder], "continuous", 4)


class Numbers(unittest.TestCase):
    def test_folded_vectors_are_the_same_rotations_on_one_side(self):
        random = np.random.default_rng(0)
        rows = np.zeros((50, 7), np.float32)
        rows[:, 3:6] = random.normal([3.1, 0.1, 0], 0.05, (50, 3)) * random.choice([-1, 1], (50, 1))
        axis = mean_axis(rows[:, 3:6])
        folded = fold(rows, axis)
        self.assertTrue((folded[:, 3:6] @ axis > 0).all())
        for before, after in zip(rows[:, 3:6], folded[:, 3:6]):
            np.testing.assert_allclose(rotation(before), rotation(after), atol=1e-5)

    def test_standardised_numbers_return(self):
        rows = np.array([[1.0, 5.0], [3.0, 5.0]], np.float32)
        standard = Standard.of(rows)
        np.testing.assert_allclose(standard.apply(rows), [[-1, 0], [1, 0]])
        np.testing.assert_allclose(standard.invert(standard.apply(rows)), rows)

    def test_actions_are_relative_and_standardised_by_their_place_in_a_chunk(self):
        with tempfile.TemporaryDirectory() as scratch:
            folder = recording(Path(scratch) / "a")
            actions = {code: Statistics.of(load([folder], code, 4, has_drives=True), STEPS + 1).action for code in ("continuous", "force")}
        action = actions["force"]
        np.testing.assert_allclose(action.mean[:STEPS, 0], 0.01 * np.arange(STEPS), atol=1e-6)
        np.testing.assert_allclose(action.mean[:, 6], 0.05, atol=1e-6)
        np.testing.assert_array_equal(action.mean[STEPS], action.mean[STEPS - 1], "no demonstration is that long")
        np.testing.assert_allclose(actions["continuous"].mean[:, 6], 0, atol=1e-6, err_msg="relative to the commanded closure")
        self.assertTrue((action.std > 0).all())
        self.assertEqual(reference(np.full((2, 7), 3.0), False)[1].tolist(), [3.0] * 6 + [0.0])
        self.assertEqual(reference(np.arange(8.0), True).tolist(), [0, 1, 2, 3, 4, 5, 7])

    def test_pictures_shrink_to_the_mean_of_their_area(self):
        picture = np.zeros((1, 4, 4, 3), np.uint8)
        picture[0, :2, :2] = [[[0], [100]], [[200], [100]]]
        self.assertEqual(shrink(picture, 2)[0, :, :, 0].tolist(), [[100, 0], [0, 0]])

    def test_waiting_is_left_out(self):
        actions = np.zeros((10, 7))
        actions[5:, 6] = 0.5
        self.assertEqual(moving_steps(actions, 0.5).tolist(), [True] + [False] * 4 + [True] + [False] * 4)
        slow = np.zeros((10, 7))
        slow[:, 0] = 0.0003 * np.arange(10)
        self.assertEqual(moving_steps(slow, 1.0).tolist(), [True, False] * 5, "slow motion is not waiting")
        closure = np.array([0.5] * 10 + [0.0, 0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.5, 0.5, 0.4, 0.2, 0.0, 0.0, 0.0])
        switched = np.zeros((14, 7))
        switched[2:9, 6] = 1
        moves = hand_steps(closure, np.array([10, 14]))[10:]
        self.assertEqual(np.flatnonzero(moving_steps(switched, 1.0)).tolist(), [0, 2, 9])
        kept = np.flatnonzero(moving_steps(switched, 1.0, moves)).tolist()
        self.assertEqual(kept, [0, 2, 3, 4, 5, 6, 9, 10, 11], "while the hand closes and while it opens")
        felt = np.zeros((60, 7))
        felt[:, 6], felt[:, 2] = 0.4 + 0.00025 * np.arange(60), 2e-5 * np.arange(60)
        self.assertGreater(moving_steps(felt, 1.0).sum(), 6, "nor is tightening by 0.02 mm per step while the hand rises")

    def test_the_fingers_tell_that_a_hand_closes_if_no_closure_was_recorded(self):
        with tempfile.TemporaryDirectory() as scratch:
            folder = recording(Path(scratch) / "a", demos=1, without=("actions", "actions_binary"))
            with h5py.File(folder / "hdf5" / "suite_task0_demo.hdf5", "a") as file:
                demo = file["data/demo_0"]
                demo["actions_two_width"][:, :3] = 0
                demo["actions_two_width"][2:, 6] = 0.5
                demo["obs/state"][:, 6] = [0.04] * 3 + [0.035, 0.03, 0.025] + [0.02] * 6
            demos = load([folder], "two-width", 4)
        self.assertEqual(demos.row.tolist(), [0, 2, 3, 4, 5, 6], "and the steps after it are waiting")

    def test_the_steps_in_which_the_fingers_follow_a_command_that_switched_are_kept(self):
        with tempfile.TemporaryDirectory() as scratch:
            folder = recording(Path(scratch) / "a", demos=1)
            with h5py.File(folder / "hdf5" / "suite_task0_demo.hdf5", "a") as file:
                demo = file["data/demo_0"]
                for stream in ("actions", "actions_binary"):
                    demo[stream][:, :3] = 0
                    demo[stream][:, 6] = [0] * 2 + [1] * 5 + [0] * 5
                demo["obs/state"][:, 6] = [0.04] * 3 + [0.025, 0.01, 0.01, 0.01, 0.01, 0.03, 0.04, 0.04, 0.04]
            demos = load([folder], "binary", 4)
        self.assertEqual(demos.row.tolist(), [0, 2, 3, 4, 7, 8, 9], "while the hand closes and opens; it waits in the others")

    def test_memory_keeps_waiting_and_the_command_before_each_step(self):
        with tempfile.TemporaryDirectory() as scratch:
            demos = load([recording(Path(scratch) / "a")], "continuous", 4, has_drives=True, has_memory=True)
        self.assertEqual(len(demos.actions), 2 * STEPS)
        np.testing.assert_array_equal(demos.commands[1:STEPS], demos.actions[: STEPS - 1])
        np.testing.assert_array_equal(demos.commands[STEPS], hand(demos.state[STEPS]))
        found = Statistics.of(demos, 3)
        np.testing.assert_allclose(found.felt.mean[2, 0], np.arcsinh(0.03 / FINE[0]), rtol=0.05, err_msg="relative to the command before")
        np.testing.assert_allclose(
            found.action.mean[2, 0], np.arcsinh(0.02 / FINE[0]), rtol=0.05, err_msg="relative to the pose of the tool"
        )

    def test_changes_along_the_axes_of_the_tool(self):
        np.testing.assert_array_equal(turns(np.zeros(3)), np.eye(3))
        vectors = np.array([[np.pi, 0, 0], [2.9, 0.7, 0.1]])
        for vector, matrix in zip(vectors, turns(vectors)):
            np.testing.assert_allclose(matrix, rotation(vector), atol=1e-6)
            changes = np.arange(14.0).reshape(2, 7)
            found = turned(changes, matrix)
            np.testing.assert_allclose(found[:, :3], changes[:, :3] @ rotation(vector), atol=1e-5)
            np.testing.assert_allclose(turned(found, matrix.T), changes, atol=1e-5)

    def test_small_and_large_changes_are_told_apart_on_the_fine_scale(self):
        changes = np.array([-0.3, -1e-4, 0, 2.5e-4, 0.9])
        np.testing.assert_allclose(coarse(fine(changes, FINE[6]), FINE[6]), changes, rtol=1e-6)
        self.assertGreater(fine(2 * changes, FINE[6])[3] - fine(changes, FINE[6])[3], 0.5)

    def test_readings_are_the_mean_motion_and_the_divergence_of_each_finger(self):
        motion = np.zeros((1, 2, 2, 99, 2))
        motion[0, :, 0] = motion[0, :, 1] = GRID
        motion[0, 0, 1] += [0.5, -1]
        motion[0, 1, 1] *= [1.01, 1.02]
        found = readings(motion)[0]
        np.testing.assert_allclose(found[:3], [0.5, -1, 0], atol=1e-6)
        np.testing.assert_allclose(found[5], 0.03, rtol=1e-4)

    def test_displacements_are_those_of_both_fingers(self):
        motion = np.zeros((1, 2, 2, 99, 2), np.float32)
        motion[0, 1, 1, 98, 1] = 3
        self.assertEqual(displacements(motion)[0].nonzero()[0].tolist(), [395])


class Prompts(unittest.TestCase):
    def test_words_and_pairs_are_hashed_alike_in_every_process(self):
        self.assertEqual(prompts.ngrams("Pick up, the bun"), ["pick", "up", "the", "bun", "pick up", "up the", "the bun"])
        self.assertEqual(prompts.encode("bun")[:2], [1 + 1280313264 % (prompts.BUCKETS - 1), 0])
        left, right = set(prompts.encode("the left bun")), set(prompts.encode("the right bun"))
        self.assertTrue(left - right and right - left and left & right)

    def test_unknown_prompts_are_refused_and_paraphrases_are_not(self):
        vocabulary = prompts.Vocabulary(["pick up the left bun and place it in the basket"])
        self.assertIsNone(vocabulary.problem("put the left bun in the basket"))
        self.assertIn("was not trained for the prompt 'open a drawer'", vocabulary.problem("open a drawer"))
        self.assertIn("empty prompt", vocabulary.problem(""))


class Inputs(unittest.TestCase):
    def setUp(self):
        standard = Standard(np.zeros(8, np.float32), np.ones(8, np.float32))
        self.statistics = Statistics(standard, standard, standard, 2.0, np.array([1, 0, 0], np.float32))
        self.vocabulary = prompts.Vocabulary(["take it"])
        motion = np.zeros((6, 198, 2), np.float32)
        motion[5] = 6
        self.obs = {camera: np.zeros((4, 4, 3), np.uint8) for camera in CAMERAS}
        self.obs |= {"state": np.array([0, 0, 0, -3.1, 0, 0, 0.04, 0.3], np.float32), "prompt": "take it", "softvt": {"seed": 7, "step": 0}}
        self.obs["tactile_marker_motion"] = motion

    def read(self, shape: Shape, **changes) -> dict:
        return read(self.obs | changes, shape, self.statistics, self.vocabulary)[0]

    def test_an_observation_becomes_the_inputs_of_the_network(self):
        shape = Shape("markers", edge=4, has_drives=True)
        found = self.read(shape)
        self.assertEqual(found["image"].shape, (1, 1, 4, 4, 3))
        np.testing.assert_allclose(found["state"][0, 0, 3], 2 * np.pi - 3.1, rtol=1e-6)
        self.assertEqual(found["reference"].shape, (1, 1, 7))
        self.assertEqual(found["reference"][0, 0, 6], np.float32(0.3))
        self.assertEqual((found["touch"][0, 0].max(), found["touch"][0, 1].max()), (0, 3))
        np.testing.assert_array_equal(found["noise"], self.read(shape)["noise"])
        self.assertFalse((found["noise"] == self.read(shape, softvt={"seed": 8, "step": 0})["noise"]).all())

    def test_a_finger_touches_if_its_markers_diverge_over_five_steps(self):
        motion = np.repeat(GRID[None, None, None], 12, 0).repeat(2, 1).repeat(2, 2)
        middle = GRID.mean(0)
        for step in range(6, 12):
            motion[step, 1, 1] = middle + (GRID - middle) * (1 + 1e-3 / 2)
        felt = readings(motion)
        self.assertEqual(contact(felt, np.zeros(12, int)).tolist(), [[0, 0]] * 7 + [[0, 1]] * 5, "once its mean is above 4e-4")
        self.assertEqual(contact(felt, np.repeat([0, 6], 6))[6].tolist(), [0, 1], "earlier steps are of another episode")
        obs = {
            "tactile_marker_motion": np.concatenate([motion[:1, :, 0], motion[:9, :, 1]]).reshape(10, 198, 2),
        }
        shape = Shape("contact", edge=4, has_drives=True)
        self.assertEqual(shape.marker_rows, 10)
        self.assertEqual(self.read(shape, **obs)["touch"].tolist(), [[[0, 0], [0, 1]]], "four steps ago and now")
        self.assertEqual(self.read(Shape("contact", edge=4, has_drives=True), **obs)["touch"].dtype, np.float32)

    def test_cells_of_a_mosaic_run_from_the_oldest_to_the_present(self):
        mosaic = np.zeros((224, 224, 3), np.uint8)
        for finger in range(2):
            for place in range(MOSAIC):
                row, column = 2 * finger + place // 4, place % 4
                mosaic[56 * row : 56 * row + 56, 56 * column : 56 * column + 56] = 10 * finger + place
        found = mosaic_cells(mosaic)
        self.assertEqual(found.shape, (MOSAIC, *CELLS))
        self.assertEqual(found[:, :, 5, 50, 1].tolist(), [[place, 10 + place] for place in range(MOSAIC)])
        seen = self.read(Shape("pictures", edge=4, has_drives=True), tactile_image=mosaic)["tactile"]
        self.assertEqual(seen[0, :, :, 0, 0, 0].tolist(), [[3, 13], [7, 17]], "four steps ago and now")
        self.assertIn('{ keys = { "tactile_image" }, source = "tactile_image" }', Shape("pictures").profile("vi"))

    def test_fast_motions_of_the_arm_and_the_hand_are_not_remembered(self):
        commands = np.zeros((10, 7), np.float32)
        commands[2:, 0], commands[6:, 6] = 0.01, 0.1
        commands[8:, 2], commands[9:, 6] = 1e-4, 0.1003
        self.assertEqual(memory_begins(commands, np.array([0, 5])).tolist(), [0, 0, 2, 2, 2, 5, 6, 6, 6, 6])
        states, felt = commands - np.float32(1e-3), np.zeros((10, 6), np.float32)
        found = Past(states, commands, felt).inputs()
        np.testing.assert_allclose(found["commands"][0, LIMITS.index(16)], [0, 0, -1e-4, 0, 0, 0, -3e-4], atol=1e-7, err_msg="since step 6")
        self.assertTrue(found["states"].any())
        while_fast = Past(states[:7], commands[:7], felt[:7]).inputs()
        self.assertFalse(while_fast["states"].any() or while_fast["commands"].any())

    def test_a_hand_feels_once_it_has_closed_slowly_since_the_last_fast_motion(self):
        commands = np.zeros((30, 7), np.float32)
        commands[5:, 6], commands[25:, 2] = 0.3, 0.01
        commands[:25, 6] += 0.0013 * np.maximum(np.arange(25) - 5, 0)
        commands[25:, 6] = commands[24, 6]
        rows = np.arange(30)
        seen = is_seen(commands, rows, memory_begins(commands, np.array([0])))
        self.assertEqual(rows[~seen].tolist(), list(range(15, 25)))

    def test_a_hand_feels_however_long_ago_it_began(self):
        commands = np.zeros((2 * REMEMBERED, 7), np.float32)
        commands[:, 6] = 0.0013 * np.minimum(np.arange(len(commands)), 20)
        felt = np.zeros((RECENT, 6), np.float32)
        past = remembered(commands[:1], felt, None)
        for step in range(1, len(commands) - RECENT, RECENT):
            recent = commands[step : step + RECENT]
            past = remembered(recent, felt, (past, recent))
        self.assertFalse(past.inputs()["seen"].any())

    def test_memory_needs_the_last_steps_of_states_and_markers_only(self):
        profile = Shape("markers", has_memory=True).profile("vt").splitlines()
        self.assertEqual([line.split('"')[1] for line in profile if f"frames = {RECENT}" in line], ["state", "tactile_marker_motion"])

    def test_what_does_not_fit_is_named(self):
        for shape, changes, words in [
            (Shape("markers", edge=4), {"tactile_marker_motion": None}, "no tactile_marker_motion; use the profile"),
            (Shape(frames=2), {}, "image has the shape (4, 4, 3), expected 2 frames"),
            (Shape(edge=32), {}, "--set cameras.width=32"),
            (Shape(edge=4), {"softvt": {"step": 0}}, "no seed"),
            (Shape(edge=4), {"prompt": "fly away"}, "was not trained for the prompt"),
            (
                Shape("pictures", edge=4, has_drives=True),
                {"tactile_image": np.zeros((224, 224, 3))},
                "float64 of the shape (224, 224, 3), expected uint8",
            ),
            (Shape(edge=4), {}, "state has 8 numbers, expected 7; use the profile"),
        ]:
            obs = {key: value for key, value in (self.obs | changes).items() if value is not None}
            with self.assertRaises(UserError) as caught:
                read(obs, shape, self.statistics, self.vocabulary)
            self.assertIn(words, str(caught.exception))


if __name__ == "__main__":
    unittest.main()
