"""What all results share: truth, words for people, tables in notebooks, pictures."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator
from ctypes import Structure, c_void_p
from html import escape
from typing import TYPE_CHECKING, Any, Callable, Generic, Optional, TypeVar

import numpy as np

from . import _plot
from ._library import CERTIFICATES, GOOD_OUTCOMES, OUTCOMES

if TYPE_CHECKING:
    from ._monitor import Progress

A = TypeVar("A", bound="Answer")
R = TypeVar("R")
T = TypeVar("T")

_MESSAGES = {
    "solved": "the residual is within tol, and every row holds beside its own terms",
    "rounding_limit": "tol was missed, but no double comes nearer: the data's rounding decides",
    "ray": "the method ended in a ray: nothing was found along its path",
    "iteration_limit": "max_iterations, or the method's own limit, ended the solve",
    "time_limit": "time_limit ended the solve",
    "stalled": "the methods make no more progress; the best iterate is returned",
    "singular": "a matrix that had to be factored is singular",
    "stopped": "the caller stopped it",
    "evaluation_failed": "a function of the caller's has no value where one was needed",
}
_INFEASIBLE = "the ray proves that there is no solution"


def _text(value: Any) -> str:
    """A field's value in one line."""
    if isinstance(value, np.ndarray):
        shape = "x".join(map(str, value.shape))
        options: Any = dict(precision=6, threshold=8, edgeitems=3, max_line_width=10**6)
        return f"{np.array2string(value, **options)} ({shape})".replace("\n", "")
    if isinstance(value, float):
        return f"{value:.6g}"
    text = value if isinstance(value, str) else repr(value)
    return text if len(text) <= 100 else text[:97] + "..."


class Shown:
    """A result of several fields: print() shows them all, notebooks show a table."""

    def _lines(self) -> Iterator[tuple[str, str]]:
        return ((name, _text(value)) for name, value in vars(self).items() if name[0] != "_")

    def __str__(self) -> str:
        lines = list(self._lines())
        width = max(len(name) for name, _ in lines)
        return "\n".join([repr(self), *(f"  {name:>{width}}: {text}" for name, text in lines)])

    def _repr_html_(self) -> str:
        rows = "".join(
            f"<tr><th style='text-align:right'>{escape(name)}</th>"
            f"<td style='text-align:left'>{escape(text)}</td></tr>"
            for name, text in self._lines()
        )
        return f"<table><caption>{escape(repr(self))}</caption>{rows}</table>"


class Found(Generic[T]):
    """A sequence of `solutions`."""

    solutions: list[T]

    def __len__(self) -> int:
        return len(self.solutions)

    def __iter__(self) -> Iterator[T]:
        return iter(self.solutions)

    def __getitem__(self, index: int) -> T:
        return self.solutions[index]


def maker(result: type[R], struct: type[Structure], **words: Any) -> Callable[..., R]:
    """A function that makes a result of a struct of the library's and, as keywords, of the fields
    that the struct has not got. Of what it has by the same name flags become bools, an index below
    0 None, codes the words given for them (a table, or a function); with an `outcome` comes
    `ok`."""
    words = {"outcome": OUTCOMES, "certificate": CERTIFICATES, **words}
    there = {name for name, kind in struct._fields_ if kind is not c_void_p}  # type: ignore[misc]
    turns: dict[str, Any] = {"bool": bool, "Optional[int]": _index}
    seen: dict[str, Any] = {"result": result, "good_outcomes": GOOD_OUTCOMES}
    parameters, values = ["found"], []
    for field in dataclasses.fields(result):  # type: ignore[arg-type]
        name, turn = field.name, words.get(field.name, turns.get(str(field.type)))
        if name in there:
            seen[f"turn_{name}"] = turn if callable(turn) else getattr(turn, "__getitem__", None)
            call = "found.{0}" if turn is None else "turn_{0}(found.{0})"
            values.append(call.format(name))
        elif name == "ok" and "outcome" in there:
            values.append("found.outcome in good_outcomes")
        else:
            parameters.append(name)
            values.append(name)
    # one expression, as if written by hand: a loop would take as long as a small solve
    return eval(f"lambda {', '.join(parameters)}: result({', '.join(values)})", seen)  # type: ignore[no-any-return]


def _index(number: int) -> Optional[int]:
    return None if number < 0 else number


class Answer(Shown):
    """A result that says how it ended: true where it is `ok`."""

    outcome: str
    ok: bool

    def __bool__(self) -> bool:
        return self.ok

    @property
    def success(self) -> bool:
        """`ok`, by SciPy's name."""
        return self.ok

    @property
    def message(self) -> str:
        """The outcome in a sentence."""
        proved = getattr(self, "certificate", None) == "infeasible"
        return f"{self.outcome}: {_INFEASIBLE if proved else _MESSAGES[self.outcome]}"

    @property
    def nit(self) -> int:
        """`iterations`, by SciPy's name."""
        return int(vars(self)["iterations"])


class SolverAnswer(Answer):
    """The answer of a solver, which a perp.History may have watched."""

    history: Optional[tuple[Progress, ...]] = None

    def watched(self: A, monitor: Any) -> A:
        """Takes the part of a history that belongs to this solve."""
        if isinstance(monitor, History):
            self.history = monitor.take()  # type: ignore[attr-defined]
        return self

    def _panels(self) -> list[Any]:
        residuals = [] if self.history is None else [(_plot.residuals, (self.history,))]
        return [*residuals, *self._pictures()]

    def _pictures(self) -> list[Any]:
        """What to draw besides: functions of an Axes, with their other arguments."""
        raise NotImplementedError

    def plot(self, axes: Any = None) -> Any:
        """Draws the answer, and the residual's history where a perp.History was the monitor.

        axes: matplotlib's, as many as there are pictures; None: a new figure. Returns the figure.
        Needs matplotlib (pip install 'perp[plot]').
        """
        return _plot.panels(self._panels(), axes)


class History(list["Progress"]):
    """A monitor that keeps what it sees, a Progress each time:

        r = perp.lcp(M, q, monitor=perp.History())
        r.history, r.plot()

    It is a list; a result's `history` is the part that belongs to its solve.
    """

    def __init__(self) -> None:
        super().__init__()
        self._taken = 0

    def __call__(self, progress: Progress) -> None:
        self.append(progress)

    def take(self) -> tuple[Progress, ...]:
        """What was added since this was called last."""
        new = tuple(self[self._taken :])
        self._taken = len(self)
        return new
