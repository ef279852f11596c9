"""From settings as callers give them to the fields of the library's structs."""

from __future__ import annotations

from ctypes import Structure
from typing import Any, Optional, Union

import numpy as np

from ._arrays import INT32_MAX
from ._errors import argument_error


def code(word: Any, codes: dict[str, int], name: str) -> int:
    """Returns the number of a word, or tells which words there are."""
    try:
        return codes[word]
    except (KeyError, TypeError):
        known = ", ".join(map(repr, codes))
        raise argument_error(f"{name} is {word!r}, expected one of {known}") from None


def count(value: Optional[int], name: str) -> int:
    """Returns a limit as the library takes it: 0 for None, which is no limit of the caller's."""
    if value is None:
        return 0
    if not 1 <= value <= INT32_MAX or value != int(value):
        raise argument_error(f"{name} is {value}, expected None or 1 .. 2147483647")
    return int(value)


def limit(value: Optional[float], name: str) -> float:
    """As count(), for a number that need not be whole."""
    if value is None:
        return 0.0
    if not value > 0:
        raise argument_error(f"{name} is {value}, expected None or a number > 0")
    return value


def cone_edges(cone: Union[str, int], name: str) -> int:
    if cone == "exact":
        return 0
    if isinstance(cone, (int, np.integer)) and not isinstance(cone, bool) and cone >= 3:
        return int(cone)
    raise argument_error(f"{name} is {cone!r}, expected 'exact' or 3, 4, 5, ... edges")


_CHECKED = {
    "max_iterations": count,
    "substeps": count,
    "threads": count,
    "time_limit": limit,
    "cone": cone_edges,
}
_REPORTED = {"polish", "patterns", "mprgp"}  # methods that only answers name
_FLAGS = {"scaling", "polish", "crash", "project", "strict", "wakeful"}


def fill(settings: Structure, codes: dict[str, dict[Any, int]], **given: Any) -> None:
    """Puts settings into the fields of their names: of words their codes, of a limit that is None
    0, of flags 0 or 1, and others as they are."""
    for name, value in given.items():
        if name in codes:
            value = code(value, codes[name], name)
        elif name in _CHECKED:
            value = _CHECKED[name](value, name)
        elif name in _FLAGS:
            value = 1 if value else 0
        try:
            setattr(settings, name, value)
        except TypeError:
            raise argument_error(f"{name} is {value!r}, expected a number") from None


def numbers(words: dict[int, str]) -> dict[str, int]:
    """The codes of words that a caller may give."""
    return {word: number for number, word in words.items() if word not in _REPORTED}
