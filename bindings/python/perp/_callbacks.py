"""Functions of the caller's that the library calls, and what they raise."""

from __future__ import annotations

import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from ctypes import c_double
from typing import Any, Callable

import numpy as np
from numpy.typing import NDArray

from . import _arrays, _errors

Array = NDArray[np.float64]

# Views that are kept: a library's own arrays are few, but those of its callers come and go.
_MOST_VIEWS = 64


class Callbacks:
    """What is raised in a callback is kept in `raised`, ends the call of the library, and comes out
    of raise_caught()."""

    def __init__(self) -> None:
        self.raised: list[BaseException] = []
        self._views: dict[tuple[int, int], Array] = {}

    def view(self, address: int, length: int) -> Array:
        """The library's memory as an array; it is the same few places again and again."""
        view = self._views.get((address, length))
        if view is None:
            if len(self._views) >= _MOST_VIEWS:
                self._views.clear()
            memory = (c_double * length).from_address(address or id(self))
            view = self._views[address, length] = np.ctypeslib.as_array(memory)
        return view

    def answer(self, function: Callable[[Array], Any], name: str, out: int, x: int, n: int) -> int:
        """out := function(x), n numbers each; what the library is to return for it."""
        try:
            if self.raised:
                return -1
            values = _arrays.real(function(self.view(x, n).copy()), name)
            if values.shape != (n,):
                raise _errors.argument_error(f"{name} has shape {values.shape}, expected ({n},)")
            self.view(out, n)[:] = values
            return 0
        except BaseException as error:
            self.raised.append(error)
            return -1

    @contextmanager
    def catching(self) -> Iterator[None]:
        """Python runs the handler of a signal, such as Ctrl-C's, at the next bytecode of the main
        thread: the first one of a callback, before its `try`. ctypes hands such an exception to
        sys.unraisablehook and goes on."""
        if threading.current_thread() is not threading.main_thread():
            yield
            return
        before = sys.unraisablehook

        def hook(lost: Any) -> None:
            if "ctypes callback" in (lost.err_msg or "") and lost.exc_value is not None:
                self.raised.append(lost.exc_value)
            else:
                before(lost)

        sys.unraisablehook = hook
        try:
            yield
        finally:
            sys.unraisablehook = before

    def raise_caught(self) -> None:
        if self.raised:
            try:
                raise self.raised[0]
            finally:
                self.raised.clear()
