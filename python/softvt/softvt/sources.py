"""Files that a server reads when it starts. A change of one of them needs another server."""

import os
import re
import shutil
import stat
from collections.abc import Iterable, Iterator, Sequence
from functools import lru_cache
from pathlib import Path

Stamp = tuple[str, int, int, int]
"""Path of a file, its size in bytes, and the times of its last change and of that of its entry in the file system, ns."""

# Folders in which `require` and assets search (docs/lua.md), below those of `_roots`.
_FOLDERS = ("scripts", "suites", "assets")
_MAX_FILES = 5000
_MAX_DEPTH = 6
_MAX_LUA_BYTES = 1 << 20

_REQUIRE = re.compile(r"""\brequire\s*\(?\s*["']([\w./-]+)["']""")
# Extensions of the files that scripts read.
_READ = (".lua", ".obj", ".stl", ".ply", ".glb", ".gltf", ".msh", ".mtl", ".png", ".jpg", ".jpeg", ".json")
_FILE = re.compile(r"""["']([^"'\n]+\.(?:obj|stl|ply|glb|gltf|msh|mtl|png|jpe?g|json))["']""", re.IGNORECASE)


def stamps(program: str, script: str, flags: Sequence[str]) -> list[Stamp]:
    """Stamps of the program and of all files that a server may read: the script, files that flags name, what these require, and all files in the
    folders `scripts`, `suites` and `assets` where scripts are searched for.

    Of several thousand files only the first ones are looked at. A `require` of a name that is computed is followed in these folders only.
    """
    entries = [os.path.abspath(name) for name in (script, *(flag.rpartition("=")[2] for flag in flags)) if _stamp(name) is not None]
    roots = _roots(entries)
    found = {path: _stamp(path) for path in [*entries, *_swept(roots)]}
    pending, tried = [*found], set()
    while pending and len(found) < _MAX_FILES:
        path = pending.pop()
        stamp = found[path]
        if not path.endswith(".lua") or stamp is None:
            continue
        modules, files = _named_in(stamp)
        places = [os.path.join(root, folder, module) for module in modules for root in roots for folder in ("scripts", "suites", "")]
        places += [os.path.join(folder, file) for file in files for folder in (os.path.dirname(path), *roots)]
        for place in places:
            if place not in found and place not in tried:
                tried.add(place)
                if (stamp := _stamp(place)) is not None:
                    found[place] = stamp
                    pending.append(place)
    binary = shutil.which(program)
    return sorted(stamp for stamp in [*found.values(), _stamp(binary) if binary else None] if stamp is not None)


def _roots(entries: Iterable[str]) -> list[str]:
    """Folders in which scripts search: their own, the parents of these, and the current folder."""
    own = [os.path.dirname(path) for path in entries]
    folders = [folder for path in own for folder in (path, os.path.dirname(path))]
    return [*dict.fromkeys([*folders, os.getcwd()])]


def _swept(roots: Iterable[str]) -> Iterator[str]:
    """Files of the folders below the roots, in a fixed order."""
    left = _MAX_FILES
    for top in (os.path.join(root, name) for root in roots for name in _FOLDERS):
        for folder, folders, files in os.walk(top):
            is_deep = folder.count(os.sep) - top.count(os.sep) >= _MAX_DEPTH
            folders[:] = [] if is_deep else sorted(below for below in folders if not below.startswith("."))
            for file in sorted(file for file in files if file.lower().endswith(_READ))[:left]:
                left -= 1
                yield os.path.join(folder, file)
            if left == 0:
                return


@lru_cache(maxsize=_MAX_FILES)
def _named_in(stamp: Stamp) -> tuple[list[str], list[str]]:
    """Paths of the modules that a Lua file requires, and other files that it names, as far as it names them as text."""
    path, size, *_ = stamp
    try:
        text = Path(path).read_text(encoding="utf-8", errors="replace") if size <= _MAX_LUA_BYTES else ""
    except OSError:
        return [], []
    modules = [module.replace(".", "/") + ".lua" for module in dict.fromkeys(_REQUIRE.findall(text))]
    return modules, [*dict.fromkeys(_FILE.findall(text))]


def _stamp(path: str) -> Stamp | None:
    """Stamp of a file; None for anything else."""
    try:
        found = os.stat(path)
    except (OSError, ValueError):
        return None
    return (path, found.st_size, found.st_mtime_ns, found.st_ctime_ns) if stat.S_ISREG(found.st_mode) else None
