"""Identifiers of the standard suites in Gymnasium's registry."""

import gymnasium

SUITES = (
    "object_soft",
    "spatial_soft",
    "object_rigid",
    "spatial_rigid",
    "object_twin",
    "spatial_twin",
    "object_varied",
    "spatial_varied",
    "object_hidden",
    "spatial_hidden",
    "household",
)
"""Names of the standard suites (`softvt list suites`)."""

FILE_ID = "softvt/File-v0"
"""Environment of a suite of your own: `gymnasium.make(FILE_ID, script="my_suite.lua")`, or of a server that runs: `url="ws://…"`."""


def environment_id(suite: str) -> str:
    """Identifier of a standard suite: "softvt/ObjectSoft-v0" for "object_soft"."""
    words = "".join(word.capitalize() for word in suite.split("_"))
    return f"softvt/{words}-v0"


def register() -> None:
    """Registers all identifiers. Importing softvt calls it."""
    # Not as `script`, which an argument of that name would replace.
    arguments: dict[str, dict[str, str]] = {environment_id(suite): {"registered_suite": suite} for suite in SUITES}
    for name, given in {FILE_ID: {}, **arguments}.items():
        gymnasium.register(id=name, entry_point="softvt.env:SoftVTEnv", vector_entry_point="softvt.vector:SoftVTVectorEnv", kwargs=given)
