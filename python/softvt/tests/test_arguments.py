"""Arguments, profiles and registered names: what needs no server."""

import json
import os
import unittest
from unittest import mock

import gymnasium
import softvt
from softvt.profile import ProfileSpec, parse_parts


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

    def test_impossible_arguments_are_refused_with_what_is_possible(self):
        for arguments, words in [
            ({"parts": (), "control": "delta"}, "no part"),
            ({"parts": ("state",), "control": "velocity"}, "expected 'delta'"),
            ({"parts": ("state",), "control": "pose", "gripper": "soft"}, "expected 'continuous'"),
            ({"parts": ("state",), "control": "pose", "history": 33}, "1 to 32"),
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
                ({"script": "object_soft", "token": "t"}, "token='t' has no effect"),
            ]:
                with self.subTest(arguments), self.assertRaisesRegex(ValueError, words):
                    softvt.SoftVTEnv(**arguments)


if __name__ == "__main__":
    unittest.main()
