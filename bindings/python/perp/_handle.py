"""Contexts, and the objects that live in one."""

from __future__ import annotations

import threading
import weakref
from ctypes import byref
from types import TracebackType
from typing import Any, TypeVar

from . import _errors
from ._generated import ContextPointer
from ._library import library

H = TypeVar("H", bound="Handle")


def _release_with(owner: object, destroy: Any, pointer: Any) -> Any:
    """Has `pointer` destroyed once: when the returned object is called, or with its owner.

    A finaliser and not __del__: it needs nothing of a half-dismantled interpreter. Nothing is
    destroyed at exit, where a daemon thread may still be inside the library.
    """
    finalizer = weakref.finalize(owner, destroy, pointer)
    finalizer.atexit = False
    return finalizer


class Context:
    """A context of the library: one thread at a time."""

    def __init__(self) -> None:
        self.pointer = ContextPointer()
        status = library.perp_context_create(byref(self.pointer), None)
        if status:  # a context that was not made has no message
            raise _errors.error(status, library.perp_status_text(status).decode())
        self.close = _release_with(self, library.perp_context_destroy, self.pointer)

    def check(self, status: int) -> None:
        """Raises the exception that belongs to a negative status."""
        if status:
            message = library.perp_context_message(self.pointer)
            message = message or library.perp_status_text(status)
            raise _errors.error(status, message.decode(errors="replace"))


class Handle:
    """An object of the library with a context of its own, so that no two objects share state.

    Calls from several threads on one object wait for each other.
    """

    _create: Any
    _destroy: Any
    _pointer_type: Any

    def __init__(self, *arguments: Any) -> None:
        self._lock = threading.RLock()
        self._context = Context()
        self._pointer = self._pointer_type()
        self._context.check(
            self._create(self._context.pointer, byref(self._pointer), *arguments)
        )
        self._finalizer = _release_with(self, self._destroy, self._pointer)

    def _call(self, function: Any, *arguments: Any) -> None:
        """Calls a function of the library on this object, alone, and raises what it refused."""
        with self._lock:
            status = function(self._alive(), *arguments)
            if status:
                self._context.check(status)

    def _alive(self) -> Any:
        """Returns the object's pointer; raises Error once the object has been closed."""
        if not self._finalizer.alive:
            raise _errors.error(_errors.HANDLE, f"this {type(self).__name__} has been closed")
        return self._pointer

    def __reduce__(self) -> Any:
        what = f"a perp.{type(self).__name__} can't be pickled: it is memory of the library's"
        raise TypeError(what)

    def close(self) -> None:
        """Releases the object's memory; it can't be used afterwards. Closing twice is allowed."""
        with self._lock:
            self._finalizer()
            self._context.close()

    def __enter__(self: H) -> H:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        exception: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self.close()
