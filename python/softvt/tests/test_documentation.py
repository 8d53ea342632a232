"""The Python code of docs/python.md and of the README, and the versions of the packages."""

import re
import tomllib
import unittest
from pathlib import Path
from unittest import mock

import gymnasium
from suites_for_tests import recording

ROOT = Path(__file__).resolve().parents[3]


def fences(page: str) -> list[str]:
    """The blocks of Python code of a page."""
    return re.findall(r"^```python\n(.*?)^```$", (ROOT / page).read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL)


class Documentation(unittest.TestCase):
    def test_the_code_of_the_pages_runs(self):
        # No test needs PyTorch.
        names = {"torch": mock.MagicMock(), "gymnasium": gymnasium}
        for page, number in (("docs/python.md", 3), ("README.md", 1)):
            found = fences(page)
            self.assertEqual(len(found), number, page)
            for code in found:
                short = code.replace("num_envs=8", "num_envs=2").replace('"data/object_soft"', repr(str(recording())))
                with self.subTest(page, code=code):
                    exec(compile(short, page, "exec"), names)
                    for name in ("env", "envs"):
                        if name in names:
                            names.pop(name).close()
        self.assertEqual((names["observation"]["proprio"].shape, names["image"].shape), ((7,), (224, 224, 3)))
        self.assertEqual(names["item"]["actions"].shape, (50, 7))

    def test_all_packages_have_the_version_of_the_program(self):
        program = tomllib.loads((ROOT / "Cargo.toml").read_text(encoding="utf-8"))["workspace"]["package"]["version"]
        for package in ("lerobot_env_softvt", "baselines"):
            project = tomllib.loads((ROOT / f"python/{package}/pyproject.toml").read_text(encoding="utf-8"))["project"]
            self.assertEqual(project["version"], program, package)
            for name, version in re.findall(r"(softvt[\w-]*)==([\d.]+)", " ".join(project["dependencies"])):
                self.assertEqual(version, program, f"{package} asks for {name}")
        self.assertIn(f"\nversion: {program}\n", (ROOT / "CITATION.cff").read_text(encoding="utf-8"))


if __name__ == "__main__":
    unittest.main()
