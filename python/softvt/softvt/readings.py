"""What the server tells about an episode besides its observations."""

from collections.abc import Iterator, Mapping
from typing import Any


class Readings(Mapping[str, Any]):
    """The true state, the verdict or the record of an episode: fields of docs/results.md by name.

    It is a mapping, and not a dict, so that vector environments keep it whole instead of making an array of each field.
    """

    def __init__(self, fields: Mapping[str, Any]):
        self._fields = dict(fields)

    def __getitem__(self, name: str) -> Any:
        return self._fields[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._fields)

    def __len__(self) -> int:
        return len(self._fields)

    def __repr__(self) -> str:
        return f"Readings({self._fields!r})"
