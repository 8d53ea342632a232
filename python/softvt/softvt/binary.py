"""The program `softvt` that this package drives."""

import os
import shutil
import subprocess
import sys
import sysconfig
from pathlib import Path

VARIABLE = "SOFTVT_BINARY"
"""Environment variable that names another program."""

_NAME = "softvt.exe" if sys.platform == "win32" else "softvt"


def find_binary() -> str:
    """Path of the program: that of `SOFTVT_BINARY`, of this package's wheel, or the first on the PATH.

    Raises FileNotFoundError, which names the places that were searched.
    """
    named = os.environ.get(VARIABLE)
    if named:
        found = shutil.which(named)
        if found is None:
            raise FileNotFoundError(f"{VARIABLE} is {named!r}, which is no program; name the file softvt, or unset it")
        return found
    folders = [Path(sysconfig.get_path("scripts")), Path(sysconfig.get_path("scripts", _user_scheme())), Path(sys.executable).parent]
    for folder in folders:
        if _is_program(folder / _NAME):
            return str(folder / _NAME)
    found = shutil.which(_NAME)
    if found is None:
        searched = ", ".join(dict.fromkeys(map(str, folders)))
        raise FileNotFoundError(
            f"no program softvt in {searched} and on the PATH; install it by `pip install .` in a clone of softvt or by "
            f"`cargo install --path .`, or name it by the environment variable {VARIABLE}"
        )
    return found


def run(*arguments: str, binary: str | None = None) -> str:
    """Runs a command of softvt, such as `run("list", "suites", "--json")`, and returns its output.

    Raises `subprocess.CalledProcessError` if it fails; its message is on standard error.
    """
    command = [binary or find_binary(), *arguments]
    return subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True, encoding="utf-8").stdout


def _user_scheme() -> str:
    return sysconfig.get_preferred_scheme("user")


def _is_program(path: Path) -> bool:
    return path.is_file() and os.access(path, os.X_OK)
