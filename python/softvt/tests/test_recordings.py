"""Runs that a server records, and recordings of demonstrations as data sets."""

import json
import pickle
import shutil
import subprocess
import unittest
import warnings

import gymnasium
import h5py
import numpy as np
import softvt
from softvt import serve
from suites_for_tests import FOLDER, STEPS, expert_run, recording, short_suite


def record_held(seed: int, task: int | str, *flags: str) -> None:
    """Steps an episode of the short suite to its end, with a server of its own."""
    env = softvt.SoftVTEnv(short_suite(), obs="proprio", cost=False, task=task, flags=flags)
    try:
        env.reset(seed=seed)
        for _ in range(STEPS):
            *_, truncated, _ = env.step(np.zeros(7))
        assert truncated
    finally:
        env.close()


class Runs(unittest.TestCase):
    def test_a_recorded_run_has_the_record_of_the_expert_whose_actions_were_stepped(self):
        actions, record = expert_run()
        out = FOLDER / "recorded"
        flags = ("--episodes", "1", "--task", "0", "--out", str(out), "--name", "mine")
        env = softvt.SoftVTEnv("object_soft", obs="proprio", control="pose", cost=False, flags=flags)
        try:
            self.assertTrue(env.hello["records"])
            env.reset(seed=1000)
            infos = [env.step(row)[4] for row in actions]
        finally:
            env.close()
        self.assertTrue(infos[-1]["recorded"])
        self.assertFalse(any("recorded" in info for info in infos[:-1]))
        recorded = json.loads((out / "episodes.jsonl").read_text())
        del recorded["record_sha256"]  # of the line
        self.assertEqual(recorded["policy"], "mine")
        for entry in (recorded, record):
            for key in ("policy", "camera_inside", "gave_up", "notes", "privileged"):
                entry.pop(key, None)
        self.assertEqual(recorded, record)
        for command in (["replay", str(out), "0/0"], ["report", str(out), "--out", str(FOLDER / "report")]):
            subprocess.run([softvt.find_binary(), *command], check=True, stdout=subprocess.DEVNULL)

    def test_a_run_has_the_tasks_of_its_environment_and_is_resumed_by_another_server(self):
        out = FOLDER / "resumed"
        for seed in (1000, 1001):
            self.assertFalse((out / "summary.json").exists())
            record_held(seed, 3, "--episodes", "2", "--out", str(out), "--resume")
        self.assertTrue((out / "summary.json").exists())
        self.assertEqual(json.loads((out / "run.json").read_text())["tasks"], [3])
        prompt = json.loads((out / "episodes.jsonl").read_text().splitlines()[0])["prompt"]
        named = FOLDER / "named"
        record_held(1000, prompt.upper(), "--episodes", "1", "--out", str(named))
        self.assertTrue((named / "summary.json").exists())

    def test_shards_of_an_environment_are_merged(self):
        shards = [FOLDER / f"shard{number}" for number in (1, 2)]
        for number, shard in enumerate(shards, 1):
            for seed in (1000, 1001):
                # Each shard has one of both.
                record_held(seed, 0, "--episodes", "2", "--out", str(shard), "--shard", f"{number}/2", "--resume")
        merged = FOLDER / "merged"
        subprocess.run([softvt.find_binary(), "merge", str(merged), *map(str, shards)], check=True, capture_output=True)
        self.assertEqual(len((merged / "episodes.jsonl").read_text().splitlines()), 2)

    def test_environments_of_single_tasks_record_in_a_run_of_all(self):
        arguments = {"script": short_suite(), "obs": "proprio", "cost": False}
        arguments["flags"] = ("--episodes", "1", "--out", str(FOLDER / "all_tasks"))
        whole = softvt.SoftVTEnv(**arguments, task=None)
        single = softvt.SoftVTEnv(**arguments, task=3)
        self.addCleanup(whole.close)
        self.addCleanup(single.close)
        self.assertEqual(whole._client.url, single._client.url)

    def test_episodes_that_a_run_does_not_record_are_warnings(self):
        flags = ("--episodes", "2", "--out", str(FOLDER / "left"))
        arguments = {"obs": "proprio", "cost": False, "flags": flags}
        hold = np.zeros(7)
        left = r"task 0, episode 0: left before its end, so that --out has no record .*; max_episode_steps ends it earlier"
        env = gymnasium.make("softvt/File-v0", script=short_suite(), max_episode_steps=3, **arguments)
        try:
            env.reset(seed=1000)
            for _ in range(3):
                *_, truncated, info = env.step(hold)
            self.assertTrue(truncated and "recorded" not in info)
            with self.assertWarnsRegex(UserWarning, left):
                env.reset(seed=1001)
            with warnings.catch_warnings():
                warnings.simplefilter("error")
                # Only once; nothing was begun, and training is not of the run.
                env.step(hold)
                env.reset(seed=1001)
                env.reset(options={"split": "demonstration"})
                env.step(hold)
                env.reset(options={"episode": 9, "seed": 7})
            with self.assertWarnsRegex(UserWarning, "has the episodes 0 to 1 of each task, .* Reset by seeds 1000 to 1001"):
                env.reset()
        finally:
            env.close()
        # Every episode of a run, in a vector.
        out = FOLDER / "vector"
        arguments["flags"] = ("--episodes", "2", "--task", "0", f"--out={out}")
        envs = softvt.SoftVTVectorEnv(2, script=short_suite(), autoreset_mode="Disabled", **arguments)
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("error")
                envs.reset(seed=1000)
                for _ in range(STEPS):
                    *_, infos = envs.step(np.zeros((2, 7)))
            self.assertEqual(infos["recorded"].tolist(), [True, True])
            with self.assertWarnsRegex(UserWarning, "autoreset_mode"):
                envs.reset()
        finally:
            url = envs.envs[0]._client.url
            envs.close()
        self.assertNotIn(url, [server.url for server in serve._running], "a server that records ends at once")
        self.assertEqual(len((out / "episodes.jsonl").read_text().splitlines()), 2)


class Datasets(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = recording()

    def test_items_are_the_steps_of_all_demonstrations(self):
        data = softvt.Dataset(self.folder, horizon=4)
        first, second = data.demonstrations
        self.assertEqual((first.task, second.task, first.suite), (0, 1, "object_rigid"))
        self.assertEqual(len(data), first.steps + second.steps)
        item = data[first.steps]
        self.assertEqual((item["episode"], item["step"], item["prompt"]), (1, 0, second.prompt))
        self.assertEqual(item["agentview_rgb"].shape, (24, 32, 3))
        self.assertEqual((item["actions"].shape, item["actions"].dtype), ((4, 7), np.float32))
        self.assertEqual([len(data), data[-1]["step"]], [len([*data]), second.steps - 1])
        with self.assertRaises(IndexError):
            data[len(data)]

    def test_files_that_the_manifest_does_not_name_are_left_out(self):
        stray = self.folder / "hdf5" / "copy.hdf5"
        shutil.copy(next((self.folder / "hdf5").iterdir()), stray)
        try:
            self.assertEqual(len(softvt.Dataset(self.folder).demonstrations), 2)
            checked = subprocess.run([softvt.find_binary(), "dataset", "check", str(self.folder)], capture_output=True, text=True)
            self.assertEqual(checked.returncode, 2)
            self.assertIn("copy.hdf5", checked.stdout + checked.stderr)
        finally:
            stray.unlink()

    def test_actions_after_the_last_step_are_marked(self):
        data = softvt.Dataset(self.folder, keys=("state",), horizon=3, task=0)
        last = data[len(data) - 1]
        self.assertEqual(last["actions_is_pad"].tolist(), [False, True, True])
        self.assertTrue((last["actions"] == last["actions"][0]).all())
        whole = data.episode(0)
        np.testing.assert_array_equal(whole["actions"][-1].astype(np.float32), last["actions"][0])
        np.testing.assert_array_equal(whole["state"][-1], last["state"])

    def test_rotation_vectors_are_continuous_and_those_that_an_environment_observes(self):
        demo = softvt.Dataset(self.folder, task=0, keys=("state",)).demonstrations[0]
        with h5py.File(demo.file) as file:
            group = file["data/demo_0"]
            actions, states = group["actions"][:], group["obs/state"][:]
            commanded, attempt = actions.copy(), int(group.attrs["attempt"])
            if "commanded_rotations" in group:
                commanded[:, 3:6] = group["commanded_rotations"][:]
        for rows in (actions, states):
            self.assertLess(np.linalg.norm(np.diff(rows[:, 3:6], axis=0), axis=1).max(), 0.5)
            self.assertLess(np.linalg.norm(rows[0, 3:6] - [np.pi, 0, 0]), 0.5)
        env = softvt.SoftVTEnv("object_rigid", obs="proprio", control="pose", cost=False, split="demonstration")
        try:
            seen = [env.reset(options={"episode": attempt})[0]]
            seen += [env.step(row)[0] for row in commanded[:-1]]
        finally:
            env.close()
        np.testing.assert_array_equal(np.stack(seen)[:, :6], states[:, :6].astype(np.float32))

    def test_actions_may_be_joint_positions(self):
        data = softvt.Dataset(self.folder, keys=("arm_joint_pos",), control="joints", horizon=2)
        self.assertEqual(data[5]["actions"].shape, (2, 8))
        whole, poses = data.episode(0), softvt.Dataset(self.folder, keys=()).episode(0)
        np.testing.assert_array_equal(whole["actions"][:, 7], poses["actions"][:, 6])
        # The joints follow their commands.
        self.assertLess(np.abs(whole["arm_joint_pos"][1:] - whole["actions"][:-1, :7]).max(), 0.1)

    def test_depth_and_torques_are_streams_of_their_own(self):
        data = softvt.Dataset(self.folder, keys=("agentview_depth", "joint_torques"), task=0)
        item = data[3]
        self.assertEqual((item["agentview_depth"].shape, item["agentview_depth"].dtype), ((24, 32), np.float32))
        self.assertTrue((item["agentview_depth"] > 0.1).all())
        self.assertEqual(item["joint_torques"].shape, (7,))

    def test_grip_codes_and_other_streams(self):
        data = softvt.Dataset(next((self.folder / "hdf5").iterdir()), keys=("gripper_width", "privileged/pad_force"), gripper="binary")
        self.assertEqual(set(np.unique([item["actions"][0, 6] for item in data])), {0.0, 1.0})
        self.assertIn("privileged/pad_force", data[0])

    def test_the_grip_code_is_that_of_the_recording_by_default(self):
        folder = FOLDER / "forces"
        shutil.copytree(self.folder, folder)
        card = json.loads((folder / "dataset.json").read_text())
        (folder / "dataset.json").write_text(json.dumps(card | {"gripper": "force"}))

        def grips(path, **arguments):
            return np.array([item["actions"][0, 6] for item in softvt.Dataset(path, keys=("state",), **arguments)])

        forces = grips(self.folder, gripper="force")
        for path in (folder, min((folder / "hdf5").iterdir())):
            found = grips(path)
            np.testing.assert_array_equal(found, forces[: len(found)])
        np.testing.assert_array_equal(grips(self.folder), grips(folder, gripper="continuous"))
        self.assertFalse(np.array_equal(grips(self.folder), forces))

    def test_files_of_recordings_with_different_grip_codes_need_the_argument(self):
        files = sorted((self.folder / "hdf5").iterdir())
        for name, card in (("codes", {"gripper": "force"}), ("cards", None)):
            mixed, other = FOLDER / name, FOLDER / name / "other"
            other.mkdir(parents=True)
            for file, place in zip(files, (mixed / "a.hdf5", other / "b.hdf5")):
                shutil.copy(file, place)
            if card is not None:
                (mixed / "dataset.json").write_text("{}")
                (other / "dataset.json").write_text(json.dumps(card))
            else:
                (other / "dataset.json").write_text("{}")
            (mixed / "b.hdf5").symlink_to(other / "b.hdf5")
            with self.assertRaisesRegex(ValueError, "a.hdf5: .*; .*b.hdf5: .*give gripper"):
                softvt.Dataset(mixed)
            self.assertEqual(len(softvt.Dataset(mixed, gripper="binary").demonstrations), 2)
            self.assertEqual(len(softvt.Dataset(mixed, task=1).demonstrations), 1)

    def test_tasks_of_several_suites_need_the_suite(self):
        folder = FOLDER / "suites"
        folder.mkdir()
        for file in (self.folder / "hdf5").iterdir():
            shutil.copy(file, folder)
            other = folder / f"other_{file.name}"
            shutil.copy(file, other)
            with h5py.File(other, "r+") as opened:
                opened["data/demo_0"].attrs["task_suite"] = "mine"
        code = {"gripper": "continuous"}
        self.assertEqual(len(softvt.Dataset(folder, **code).demonstrations), 4)
        with self.assertRaisesRegex(ValueError, "suites/.*hdf5: no dataset.json of its recording, which has the grip code; give gripper"):
            softvt.Dataset(folder)
        with self.assertRaisesRegex(ValueError, "task=0: the recording has demonstrations of the suites mine, object_rigid; give suite"):
            softvt.Dataset(folder, task=0)
        self.assertEqual(
            [(demo.suite, demo.task) for demo in softvt.Dataset(folder, suite="mine", task=1, **code).demonstrations], [("mine", 1)]
        )
        self.assertEqual(len(softvt.Dataset(folder, suite="object_rigid", **code).demonstrations), 2)
        with self.assertRaisesRegex(ValueError, "no demonstration of suite 'others'; the recording has those of mine, object_rigid"):
            softvt.Dataset(folder, suite="others")

    def test_demonstrations_are_those_of_the_manifest(self):
        names = [file.name for file in sorted((self.folder / "hdf5").iterdir())]

        def delete(data):
            del data["demo_0"]

        def extend(data):
            data.copy("demo_0", "demo_1")

        def attribute(key, value):
            return lambda data: data["demo_0"].attrs.__setitem__(key, value)

        for number, (change, words) in enumerate(
            [
                (delete, "no data/demo_0, which the manifest names"),
                (extend, "data/demo_1 is not in the manifest"),
                (attribute("language", "wave"), "data/demo_0: language is 'wave', and 'pick up .*' in the manifest"),
                (attribute("task_id", 3), "data/demo_0: task_id is 3, and 0 in the manifest"),
                (attribute("state_hash", "00"), "data/demo_0: state_hash is '00', and '[0-9a-f]+' in the manifest"),
                (attribute("num_samples", 7), "data/demo_0: num_samples is 7, and actions has [0-9]+ steps"),
            ]
        ):
            folder = FOLDER / f"changed{number}"
            shutil.copytree(self.folder, folder)
            with h5py.File(folder / "hdf5" / names[0], "r+") as opened:
                change(opened["data"])
            # Also of the file alone.
            for path in (folder, folder / "hdf5" / names[0]):
                with self.subTest(words), self.assertRaisesRegex(ValueError, f"{names[0]}: {words}; `softvt dataset check`"):
                    softvt.Dataset(path)
            self.assertEqual(len(softvt.Dataset(folder / "hdf5" / names[1]).demonstrations), 1)

    def test_a_demonstration_has_one_line_in_the_manifest(self):
        folder = FOLDER / "twice"
        shutil.copytree(self.folder, folder)
        manifest = folder / "manifest.jsonl"
        manifest.write_text(manifest.read_text() + manifest.read_text().splitlines()[0] + "\n")
        with self.assertRaisesRegex(ValueError, "twice/manifest.jsonl: demo_0 of hdf5/.*task0_demo.hdf5 has two lines"):
            softvt.Dataset(folder)

    def test_files_of_several_recordings_in_one_folder_are_refused(self):
        for number, (change, words) in enumerate(
            [
                ({"task_id": 7}, "manifest.jsonl:2: object_rigid task 7, which dataset.json does not have: files of several recordings"),
                ({"seed": 3}, "manifest.jsonl:2: seed 3, and the first line has 0: files of several recordings"),
            ]
        ):
            folder = FOLDER / f"merged{number}"
            shutil.copytree(self.folder, folder)
            first, second = (folder / "manifest.jsonl").read_text().splitlines()
            (folder / "manifest.jsonl").write_text(f"{first}\n{json.dumps(json.loads(second) | change)}\n")
            with self.subTest(words), self.assertRaisesRegex(ValueError, words):
                softvt.Dataset(folder)
            checked = subprocess.run([softvt.find_binary(), "dataset", "check", str(folder)], capture_output=True, text=True)
            self.assertEqual(checked.returncode, 2)
            self.assertIn("files of several recordings are in one folder", checked.stderr)

    def test_a_file_alone_does_not_contradict_itself(self):
        file = FOLDER / "alone.hdf5"
        source = next((self.folder / "hdf5").iterdir())

        def shorten(data):
            state = data["demo_0/obs/state"][:-1]
            del data["demo_0/obs/state"]
            data["demo_0/obs/state"] = state

        for change, words in [
            (
                lambda data: data["demo_0"].attrs.__setitem__("num_samples", 9),
                "data/demo_0: num_samples is 9, and actions has [0-9]+ steps",
            ),
            (
                lambda data: data["demo_0"].attrs.__delitem__("num_samples"),
                "data/demo_0 has no attribute num_samples; `softvt dataset check`",
            ),
            (lambda data: data.create_group("mask"), "data/mask: not a demonstration, which has a name such as demo_0"),
            (shorten, r"data/demo_0/obs/state has the shape \([0-9]+, 7\), and the demonstration [0-9]+ steps"),
        ]:
            shutil.copy(source, file)
            with h5py.File(file, "r+") as opened:
                change(opened["data"])
            with self.subTest(words), self.assertRaisesRegex(ValueError, f"alone.hdf5: {words}"):
                softvt.Dataset(file, gripper="continuous")

    def test_statistics_are_those_of_the_chosen_demonstrations(self):
        data = softvt.Dataset(self.folder, keys=("state", "agentview_rgb", "privileged/pad_force"), gripper="binary", task=1)
        found, whole = data.stats(), data.episode(0)
        self.assertEqual(set(found), {"actions", "state", "privileged/pad_force"})
        np.testing.assert_allclose(found["actions"]["mean"], whole["actions"].mean(0), rtol=1e-5)
        np.testing.assert_allclose(found["state"]["q99"], np.quantile(whole["state"], 0.99, axis=0), rtol=1e-5)
        self.assertEqual((found["actions"]["max"][6], found["state"]["std"].shape), (1.0, (7,)))
        self.assertEqual({value.dtype.name for value in found["actions"].values()}, {"float32"})

    def test_a_card_that_is_no_json_is_named(self):
        folder = FOLDER / "card"
        shutil.copytree(self.folder, folder)
        for text in ("{", "[]"):
            (folder / "dataset.json").write_text(text)
            with self.assertRaisesRegex(ValueError, "card/dataset.json: not the file that softvt record wrote: .*; give gripper"):
                softvt.Dataset(folder)
            self.assertEqual(len(softvt.Dataset(folder, gripper="continuous").demonstrations), 2)

    def test_unsafe_demonstrations_can_be_left_out(self):
        folder = FOLDER / "unsafe"
        shutil.copytree(self.folder, folder)
        self.assertEqual([demo.safe for demo in softvt.Dataset(folder, safe=True).demonstrations], [True, True])
        for number, file in enumerate(sorted((folder / "hdf5").iterdir())):
            # As with --keep goal.
            with h5py.File(file, "r+") as opened:
                opened["data/demo_0"].attrs["success"] = 0
            self.assertEqual([demo.safe for demo in softvt.Dataset(folder).demonstrations], [False, number == 0])
            if number == 0:
                self.assertEqual([demo.task for demo in softvt.Dataset(folder, safe=True).demonstrations], [1])
        with self.assertRaisesRegex(ValueError, "safe=True: none of the 2 demonstrations is safe"):
            softvt.Dataset(folder, safe=True)

    def test_a_data_set_can_be_sent_to_a_worker(self):
        data = softvt.Dataset(self.folder)
        self.assertEqual(pickle.loads(pickle.dumps(data))[3]["step"], data[3]["step"])
        data.close()
        self.assertEqual(data[3]["step"], 3)

    def test_an_interrupted_recording_is_refused_with_the_way_to_complete_it(self):
        folder = FOLDER / "interrupted"
        (folder / "hdf5").mkdir(parents=True)
        (folder / "recording.json").write_text("{}")
        words = r"interrupted: the recording was interrupted; complete it .*softvt record … --resume --out .*interrupted"
        with self.assertRaisesRegex(ValueError, words):
            softvt.Dataset(folder)
        # Also if some of its tasks are complete.
        file = folder / "hdf5" / "task.hdf5"
        file.write_bytes(next((self.folder / "hdf5").iterdir()).read_bytes())
        with self.assertRaisesRegex(ValueError, words):
            softvt.Dataset(folder)
        self.assertEqual(len(softvt.Dataset(file, gripper="continuous").demonstrations), 1)

    def test_what_is_missing_is_named(self):
        for arguments, words in [
            ({"path": FOLDER / "nothing"}, "no recording"),
            ({"path": self.folder, "keys": ("agentview",)}, "no stream obs/agentview; obs has agentview_depth, agentview_pose"),
            ({"path": self.folder, "task": 7}, "no demonstration of task 7; the recording has those of task 0, 1"),
            ({"path": self.folder, "task": [0, 9, 7]}, "no demonstration of task 7, 9; the recording has those of task 0, 1"),
            ({"path": self.folder, "control": "delta"}, "expected 'pose' or 'joints'"),
            ({"path": self.folder, "gripper": "soft"}, "gripper='soft': expected 'continuous'"),
            ({"path": self.folder, "horizon": 0}, "at least 1"),
            ({"path": self.folder, "horizon": 2.5}, "horizon=2.5: expected a whole number"),
            ({"path": self.folder, "keys": "state"}, r'keys=\'state\': expected a list; write keys=\("state",\)'),
            ({"path": self.folder, "keys": ("actions",)}, "'actions' is no observation"),
            ({"path": self.folder, "keys": ("privileged/nope",)}, "no stream privileged/nope; privileged has actions_with_force"),
            (
                {"path": self.folder, "keys": ("privileged/states",)},
                "data/demo_0/privileged/states is a group; give one of its streams: privileged/states/rigid_object/alphabet_soup/root_pose_w, ",
            ),
            (
                {"path": self.folder, "keys": ("/data/demo_1/obs/state",)},
                "keys: '/data/demo_1/obs/state': expected the path of a stream in",
            ),
            ({"path": self.folder, "keys": ("obs/",)}, "keys: 'obs/': expected the path"),
            ({"path": self.folder, "suite": 3}, "suite=3: expected text"),
            ({"path": self.folder, "safe": "yes"}, "safe='yes': expected True or False"),
            ({"path": self.folder, "task": "0"}, "task='0': expected a number or a list of numbers"),
            ({"path": self.folder, "task": []}, "no number in the list"),
            ({"path": None}, "path=None: expected the path of a recording"),
            ({"path": self.folder / "manifest.jsonl"}, "no recording of softvt: .*signature"),
        ]:
            with self.subTest(arguments), self.assertRaisesRegex(ValueError, words):
                softvt.Dataset(**arguments)
        data = softvt.Dataset(self.folder)
        with self.assertRaisesRegex(TypeError, "step slice.*`episode` gives all steps"):
            data[0:3]
        with self.assertRaisesRegex(IndexError, "demonstration 2 of 2"):
            data.episode(2)


if __name__ == "__main__":
    unittest.main()
