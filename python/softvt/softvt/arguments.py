"""Checks of arguments: each error names the argument, its value and what is expected."""

import operator
from collections.abc import Iterable, Sequence
from typing import Any


def require_one_of(argument: str, value: object, known: Sequence[str]) -> None:
    """Raises ValueError unless the value of an argument is one of those."""
    if not isinstance(value, str) or value not in known:
        raise ValueError(f"{argument}={value!r}: expected {', '.join(map(repr, known[:-1]))} or {known[-1]!r}")


def whole_number(argument: str, value: Any, low: int | None = None, high: int | None = None) -> int:
    """The value as an int, also of numpy. Raises ValueError for anything else and outside of the bounds."""
    try:
        number = None if is_bool(value) else operator.index(value)
    except TypeError:
        number = None
    if number is not None and (low is None or number >= low) and (high is None or number <= high):
        return number
    bounds = "" if low is None else f" of at least {low}" if high is None else f" from {low} to {high}"
    raise ValueError(f"{argument}={value!r}: expected a whole number{bounds}")


def require_bool(argument: str, value: object) -> None:
    """Raises ValueError unless the value is True or False."""
    if not is_bool(value):
        raise ValueError(f"{argument}={value!r}: expected True or False")


def require_text(argument: str, value: object) -> None:
    """Raises ValueError unless the value is text."""
    if not isinstance(value, str):
        raise ValueError(f"{argument}={value!r}: expected text")


def texts(argument: str, value: Any) -> tuple[str, ...]:
    """The value as a tuple of texts. Raises ValueError for anything else, and for a single text with the list to write in its place."""
    if isinstance(value, str):
        words = tuple(value.split()) if argument == "flags" else (value,)
        written = ", ".join(_quoted(word) for word in words) + ("," if len(words) == 1 else "")
        raise ValueError(f"{argument}={value!r}: expected a list; write {argument}=({written})")
    if not isinstance(value, Iterable) or isinstance(value, bytes):
        raise ValueError(f"{argument}={value!r}: expected a list of texts")
    found = tuple(value)
    for entry in found:
        if not isinstance(entry, str):
            raise ValueError(f"{argument}={value!r}: expected a list of texts, got {entry!r} in it")
    return found


def is_bool(value: object) -> bool:
    """True for True and False, also those of numpy. They are numbers to Python, and never meant as such."""
    return type(value).__name__ in ("bool", "bool_")


def _quoted(text: str) -> str:
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"') + '"'
