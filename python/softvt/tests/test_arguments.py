"""Arguments, profiles and registered names: what needs no server."""

import json
import os
import unittest
from unittest import mock

import gymnasium
import softvt
from softvt.env import _counters
from softvt.profile import ProfileSpec, parse_parts
from softvt.vector import SoftVTVectorEnv


class Arguments(unittest.TestCase):
    def test_every_standard_suite_is_registered(self):
        listed = json.loads(softvt.run("list", "suites", "--json"))
        singles = {entry["name"] for entry in listed if not entry.get("suites")}
        self.assertEqual(singles, set(softvt.SUITES))
        for suite in softvt.SUITES:
            self.assertIn(softvt.environment_id(suite), gymnasium.registry)

    def test_a_program_that_is_missing_is_named_with_the_ways_to_install_it(self):
        with (
            mock.patch.dict(os.environ, {"SOFTVT_BINARY": "/nowhere/softvt"}),
            self.assertRaisesRegex(FileNotFoundError, "/nowhere/softvt"),
        ):
            softvt.find_binary()
        with (
            mock.patch.dict(os.environ, {"PATH": ""}),
            mock.patch("softvt.binary._is_program", return_value=False),
        ):
            os.environ.pop("SOFTVT_BINARY", None)
            with self.assertRaisesRegex(FileNotFoundError, "pip install .*cargo install.*SOFTVT_BINARY"):
                softvt.find_binary()

    def test_parts_are_a_list_or_text(self):
        self.assertEqual(parse_parts("pixels+proprio"), ("pixels", "proprio"))
        self.assertEqual(parse_parts(["state", "state"]), ("state",))
        with self.assertRaisesRegex(ValueError, "'pixles': expected 'state'"):
            parse_parts("pixles")
        for text in ("pixels,proprio", "pixels + proprio"):
            with self.assertRaisesRegex(ValueError, r"joined by \+; write obs='pixels\+proprio'"):
                parse_parts(text)
        with self.assertRaisesRegex(ValueError, "obs=3: expected text"):
            parse_parts(3)

    def test_impossible_arguments_are_refused_with_what_is_possible(self):
        for arguments, words in [
            ({"parts": (), "control": "delta"}, "no part"),
            ({"parts": ("state",), "control": "velocity"}, "expected 'delta'"),
            ({"parts": ("state",), "control": "pose", "gripper": "soft"}, "expected 'continuous'"),
            ({"parts": ("state",), "control": "pose", "history": 33}, "history=33: expected a whole number from 1 to 32"),
            ({"parts": ("state",), "control": "pose", "history": "2"}, "history='2': expected a whole number"),
            ({"parts": ("pixels",), "control": "pose", "cameras": ()}, "no camera for obs='pixels'"),
            ({"parts": ("pixels",), "control": "pose", "cameras": ("wrist", "wrist")}, "a camera is named twice"),
        ]:
            with self.subTest(arguments), self.assertRaisesRegex(ValueError, words):
                ProfileSpec(**arguments)

    def test_names_of_cameras_are_quoted_in_lua(self):
        lua = ProfileSpec(("pixels",), "pose", cameras=('a"b',)).to_lua()
        self.assertIn('camera = "a\\"b"', lua)

    def test_arguments_of_an_environment_are_checked_before_a_server_starts(self):
        with mock.patch("softvt.env.lease", side_effect=AssertionError("a server was started")):
            for arguments, words in [
                ({}, "either the script"),
                ({"script": "object_soft", "url": "ws://127.0.0.1:1"}, "either the script"),
                ({"script": "object_soft", "reward": "dense"}, "reward='dense'"),
                ({"script": "object_soft", "layout": "nested"}, "layout='nested'"),
                ({"script": "object_soft", "obs": "image"}, "obs='image'"),
                ({"script": "object_soft", "render_mode": "window"}, "render_mode='window'"),
                ({"script": "object_soft", "profile": "vision", "control": "pose"}, "control='pose' has no effect with profile='vision'"),
                ({"url": "ws://127.0.0.1:9", "image_size": 64}, "image_size=64 has no effect with url="),
                # Values of the defaults contradict as well.
                ({"url": "ws://127.0.0.1:9", "control": "delta"}, "control='delta' has no effect with url=.*; leave it out"),
                ({"url": "ws://127.0.0.1:9", "gripper": "continuous"}, "gripper='continuous' has no effect with url="),
                ({"script": "object_soft", "profile": "vision", "history": 1}, "history=1 has no effect with profile='vision'"),
                (
                    {"script": "object_soft", "profile": "vision", "cameras": ("third_person", "wrist")},
                    r"cameras=\('third_person', 'wrist'\) has no effect with profile='vision'",
                ),
                ({"script": "object_soft", "cameras": ["third_person", "wrist"]}, "cameras=.* has no effect with obs='state'"),
                (
                    {"script": "object_soft", "split": "validation", "flags": ("--split=experiment",)},
                    "--split is set by the argument split; leave it out of flags",
                ),
                (
                    {"script": "object_soft", "gripper": "continuous", "flags": ("--gripper", "binary")},
                    "--gripper is set by the argument gripper",
                ),
                ({"script": "object_soft", "flags": ("--profile", "vision")}, "--profile is set by the arguments profile, obs, control"),
                ({"script": "object_soft", "flags": ("--token", "t")}, "--token is set by the environment for its own server"),
                ({"script": "object_soft", "token": "t"}, "token='t' has no effect"),
                ({"script": "object_soft", "profile": "libero", "obs": "pixels"}, "obs='pixels' and profile='libero': .* leave out one"),
                ({"script": "object_soft", "image_size": 64}, "image_size=64 has no effect with obs='state'"),
                (
                    {"script": "object_soft", "image_size": 64, "render_mode": "rgb_array", "camera": "left"},
                    "image_size=64 has no effect with obs='state' and the finger camera='left'; leave it out",
                ),
                ({"script": "object_soft", "image_size": 64, "render_mode": "sensors"}, "image_size=64 has no effect with obs='state'"),
                ({"script": "object_soft", "flags": ("--threads", "3")}, "--threads is set by the environment for its own server"),
                ({"script": "object_soft", "cameras": ["wrist"]}, "cameras=.* has no effect with obs='state'"),
                ({"script": "object_soft", "obs": "tactile_image", "history": 2}, "history=2 has no effect with obs='tactile_image'"),
                ({"script": "object_soft", "camera": "left"}, "camera='left' has no effect with render_mode=None"),
                ({"script": "object_soft", "split": "train"}, "split='train': expected 'validation'"),
                ({"script": 3}, "script=3: expected a name"),
                ({"url": "localhost:8765"}, "url='localhost:8765': expected an address such as 'ws:"),
                ({"script": "object_soft", "binary": "/nowhere/softvt"}, "binary='/nowhere/softvt': there is no such program"),
            ]:
                with self.subTest(arguments), self.assertRaisesRegex(ValueError, words):
                    softvt.SoftVTEnv(**arguments)

    def test_an_identifier_is_that_of_its_suite_alone(self):
        with mock.patch("softvt.env.lease", side_effect=AssertionError("a server was started")):
            for arguments, words in [
                (
                    {"script": "suites/mine.lua"},
                    "script='suites/mine.lua': softvt/ObjectSoft-v0 is the suite object_soft; "
                    "write gymnasium.make('softvt/File-v0', script='suites/mine.lua')",
                ),
                ({"script": "spatial_soft"}, "script='spatial_soft': softvt/ObjectSoft-v0 is"),
                ({"url": "ws://127.0.0.1:9"}, "url='ws://127.0.0.1:9': softvt/ObjectSoft-v0 is"),
            ]:
                for make in (gymnasium.make, gymnasium.make_vec):
                    with self.subTest(arguments, make=make.__name__), self.assertRaises(ValueError) as caught:
                        make("softvt/ObjectSoft-v0", **arguments)
                    self.assertIn(words, str(caught.exception))
            for script in ("object_soft", "suites/object_soft.lua"):
                with self.assertRaisesRegex(AssertionError, "a server was started"):
                    gymnasium.make("softvt/ObjectSoft-v0", script=script)

    def test_values_of_another_type_are_refused_with_the_name_of_their_argument(self):
        with mock.patch("softvt.env.lease", side_effect=AssertionError("a server was started")):
            for argument, value, words in [
                *(
                    ("image_size", size, r"expected \(height, width\)")
                    for size in ("64", [64, 96, 3], 0, 64.5, (64, 5000), (64, "a"), True)
                ),
                *(("task", task, "expected a number, text or a list of numbers") for task in (3.0, True, [1.0], [0, "a"], {})),
                ("task", [], "no number in the list"),
                ("first_seed", "a", "expected a whole number"),
                ("cameras", "wrist", r'expected a list; write cameras=\("wrist",\)'),
                ("flags", "--shift stiffness=0.5", r'expected a list; write flags=\("--shift", "stiffness=0.5"\)'),
                ("flags", ("--shift", 0.5), "got 0.5 in it"),
                ("cost", "no", "expected True or False"),
                ("gripper", 3, "expected 'continuous'"),
            ]:
                with self.subTest(argument, value=value), self.assertRaises(ValueError) as caught:
                    softvt.SoftVTEnv("object_soft", **{"obs": "pixels", argument: value})
                self.assertIn(f"{argument}={value!r}: ", str(caught.exception))
                self.assertRegex(str(caught.exception), words)
            for arguments, words in [
                ({"num_envs": "8"}, "num_envs='8': expected a whole number of at least 1"),
                ({"num_envs": 0}, "num_envs=0"),
                ({"num_envs": 1, "max_episode_steps": 0}, "max_episode_steps=0"),
                ({"num_envs": 1, "autoreset_mode": "next"}, "autoreset_mode='next': expected 'NextStep'"),
            ]:
                with self.subTest(arguments), self.assertRaisesRegex(ValueError, words):
                    SoftVTVectorEnv(script="object_soft", **arguments)

    def test_whatever_a_server_counts_is_passed_on(self):
        raw = {"task": 1, "episode": 2, "step": 3, "carried_out": 1, "success": False, "time_s": 0.1, "far_commands": 4, "clamped_other": 5}
        self.assertEqual(_counters(raw), {"far_commands": 4, "clamped_other": 5})


if __name__ == "__main__":
    unittest.main()
