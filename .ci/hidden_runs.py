"""Runs of the hidden suites by a controller, for search-trials."""

import json
import os
import pathlib
import subprocess

SUITES = ["object_hidden", "spatial_hidden"]


def records(softvt, suite, controller, episodes, folder, *flags):
    """Returns the records of a run in a folder whose scripts take precedence over those of the binary."""
    command = [softvt.resolve(), f"suites/{suite}.lua", "--policy", controller, "--episodes", episodes, *flags]
    command += ["--threads", os.cpu_count(), "--out", suite]
    run = subprocess.run([str(word) for word in command], cwd=folder, capture_output=True, text=True)
    if run.returncode:
        raise SystemExit(run.stderr)
    lines = pathlib.Path(folder, suite, "episodes.jsonl").read_text().splitlines()
    return [json.loads(line) for line in lines]


def share(found, key):
    """Returns the percentage of records in which a verdict holds."""
    return 100 * sum(bool(record[key]) for record in found) / len(found)
