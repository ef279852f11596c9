"""What a negative status becomes in Python."""

from __future__ import annotations

import builtins

from ._generated import CONSTANTS

ARGUMENT = CONSTANTS["PERP_ERROR_ARGUMENT"]
NOT_FINITE = CONSTANTS["PERP_ERROR_NOT_FINITE"]
MEMORY = CONSTANTS["PERP_ERROR_MEMORY"]
HANDLE = CONSTANTS["PERP_ERROR_HANDLE"]
BUSY = CONSTANTS["PERP_ERROR_BUSY"]

_NAMES = {value: name for name, value in CONSTANTS.items() if name.startswith("PERP_ERROR_")}


class Error(Exception):
    """A call that did not work; what it was called on is as it was before.

    status: the negative status of the C library.  name: that status as the C headers spell it.
    message: what was wrong, with the argument and the index at fault.
    """

    def __init__(self, status: int, message: str) -> None:
        super().__init__(status, message)
        self.status = status
        self.name = _NAMES.get(status, "unknown status")
        self.message = message

    def __str__(self) -> str:
        return self.message


class ArgumentError(Error, ValueError):
    """An argument that has no meaning: a wrong shape, a negative mass, NaN, ..."""


class MemoryError(Error, builtins.MemoryError):
    """Out of memory."""


class BufferError(Error, builtins.BufferError):
    """Arrays that show the library's own memory are still in use."""


class OutsideDomain(Exception):
    """Raised by a function of a perp.Mechanism where q is outside of what it is defined for: the
    step's outcome is then "evaluation_failed" (or the step is shortened, if errors are
    controlled). From the first state of a mechanism whose sizes are not given it comes out of the
    call."""


_CLASSES: dict[int, type[Error]] = {
    ARGUMENT: ArgumentError,
    NOT_FINITE: ArgumentError,
    MEMORY: MemoryError,
}


def error(status: int, message: str) -> Error:
    """Returns the exception for a status."""
    return _CLASSES.get(status, Error)(status, message)


def argument_error(message: str) -> Error:
    return ArgumentError(ARGUMENT, message)
