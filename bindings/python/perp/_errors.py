"""What a negative status becomes in Python."""

from __future__ import annotations

import builtins

ARGUMENT, NOT_FINITE, MEMORY, ABI, HANDLE, BUSY, CALLBACK = range(-1, -8, -1)

_NAMES = {
    ARGUMENT: "PERP_ERROR_ARGUMENT",
    NOT_FINITE: "PERP_ERROR_NOT_FINITE",
    MEMORY: "PERP_ERROR_MEMORY",
    ABI: "PERP_ERROR_ABI",
    HANDLE: "PERP_ERROR_HANDLE",
    BUSY: "PERP_ERROR_BUSY",
    CALLBACK: "PERP_ERROR_CALLBACK",
}


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
