"""Python inside a solve: the user's monitor, and signals such as Ctrl-C."""

from __future__ import annotations

import threading
from collections.abc import Generator
from typing import Any, Callable, NamedTuple, Optional

from ._generated import LcpMonitor
from ._library import METHODS

# A call that reads fewer matrix entries than this in all ends soon enough by itself; and where an
# iteration reads this many entries, entering Python once in each does not show in the time.
_MUCH_WORK = 100_000_000
_MUCH_AN_ITERATION = 10_000


class Progress(NamedTuple):
    """What a monitor sees."""

    method: str
    iterations: int
    residual: float


Monitor = Callable[[Progress], Any]


class Watch:
    """A callback for the library that keeps what was raised inside it.

    Python runs the handler of a signal at the next bytecode of the main thread. That would be the
    first one of an ordinary callback function, before any `try` of it: ctypes prints such an
    exception and loses it. A suspended generator is inside its `try` already, so it is what the
    library calls: property.__get__, a function in C, hands its first argument on to send().
    """

    def __init__(
        self,
        monitor: Optional[Monitor],
        kind: Any = LcpMonitor,
        methods: dict[int, str] = METHODS,
    ) -> None:
        self._raised: list[BaseException] = []
        watch = _watch(monitor, self._raised, methods)
        next(watch)
        self.function = kind(property(watch.send).__get__)

    def raise_caught(self) -> None:
        """Raises what the callback caught, if anything, after the library has returned."""
        if self._raised:
            try:
                raise self._raised[0]
            finally:
                self._raised.clear()


def _watch(
    monitor: Optional[Monitor], raised: list[BaseException], methods: dict[int, str]
) -> Generator[int, Any, None]:
    answer = 0
    while True:
        try:
            while True:
                pointer = yield answer
                answer = 0
                if monitor is not None:
                    now = pointer[0]
                    method = methods.get(now.method, "unknown method")
                    answer = 1 if monitor(Progress(method, now.iterations, now.residual)) else 0
        except GeneratorExit:
            return
        except BaseException as error:
            raised.append(error)
            answer = -1


def needs_watch(monitor: Optional[Monitor], entries: int, max_iterations: int) -> bool:
    """Whether a call must enter Python while it runs. Signals reach the main thread only, and
    another would wait for the interpreter once an iteration for nothing."""
    if monitor is not None:
        return True
    much = entries >= _MUCH_AN_ITERATION or entries * max_iterations >= _MUCH_WORK
    return much and threading.current_thread() is threading.main_thread()
