"""What a mechanism answers: steps and runs."""

from __future__ import annotations

from ctypes import c_double
from dataclasses import dataclass
from typing import Any, Optional

import numpy as np
from numpy.typing import NDArray

from . import _plot
from ._answer import Answer, Shown, maker
from ._arrays import copied, read, read_codes
from ._callbacks import Array
from ._generated import MechanismRunResult, MechanismView
from ._generated import MechanismStep as CStep
from ._library import CONTACT_METHODS, GOOD_OUTCOMES, MODES, OUTCOMES
from ._mechanism_library import MECHANISM_SCHEMES

Words = NDArray[np.str_]
_MODE_WORDS = np.array([MODES[k] for k in range(len(MODES))])


@dataclass(frozen=True, eq=False)
class MechanismStep(Answer):
    """One step. Rows of impulse, velocity and ray: contacts (normal, then tangents, of each),
    bilateral ones, those of tresca; Mechanism.rows has the slices."""

    t: float  # the end of the step
    h: float  # its length; 0 at the start of a run
    q: Array  # at the end; the start's where the state did not move
    v: Array
    impulse: Array  # force times h, and shocks
    velocity: Array  # of the rows, at the end
    modes: Words  # contacts, then groups of tresca: "separate", "stick", "slip"
    outcome: str  # "solved", "rounding_limit", "ray", "evaluation_failed", ...
    ok: bool  # solved, or as near as a double can come
    ray: Optional[Array]  # impulses that no motion can answer, if one was verified
    certificate: Optional[str]  # "infeasible" if the ray proves that there is no step
    scheme: str  # that gave the answer
    closed: int  # contacts with an impulse
    sticking: int  # of those, and of the groups of tresca
    impacts: int  # contacts with restitution > 0 that were hit
    method: str  # of the last contact problem
    residual: float  # dimensionless, the one compared with tol
    penetration: float  # max(-gap, 0), the largest, at the end
    drift: float  # the largest |c| of bilateral constraints, at the end
    error: float  # estimate, where errors are controlled; else nan
    seconds: float
    iterations: int
    evaluations: int  # of the contacts, or of the force if there are none
    answers: Optional[int]  # with select: how many the step's problem has; else None
    exhaustive: bool  # with select: there are no others

    def __repr__(self) -> str:
        return f"<perp.MechanismStep {self.outcome}, t={self.t:g}, v={self.v}>"


@dataclass(frozen=True, eq=False)
class MechanismStats(Shown):
    """What a run took."""

    steps: int
    rejected: int  # steps that were tried again shorter
    fallbacks: int  # steps of the implicit scheme that frozen answered
    iterations: int
    evaluations: int  # of the contacts, or of the force if there are none
    residual: float  # the largest of the steps'
    penetration: float  # the same
    drift: float  # the same
    error: float  # sum of the steps' estimates; nan with equal steps
    seconds: float


@dataclass(frozen=True, eq=False)
class MechanismRun(Answer):
    """A run: entry 0 of each array is the start, entry k the end of step k. Rows as in
    MechanismStep."""

    t: Array  # (steps + 1,)
    q: Array  # (steps + 1, coordinates)
    v: Array  # (steps + 1, n)
    impulse: Array  # (steps + 1, rows); 0 at the start
    velocity: Array  # (steps + 1, rows)
    modes: Words  # (steps + 1, contacts + groups of tresca)
    outcome: str  # of the step that ended the run, "stopped", "time_limit", "stalled"; else that of
    ok: bool  # the first step that was not solved; "solved"
    stats: MechanismStats

    def __repr__(self) -> str:
        return f"<perp.MechanismRun {self.outcome}, {self.stats.steps} steps, t={self.t[-1]:g}>"

    @property
    def nit(self) -> int:
        return self.stats.iterations

    def plot(self, axes: Any = None) -> Any:
        """Draws q, v and the impulses over time, on as many of matplotlib's axes or, with None,
        in a new figure, which is returned. Needs matplotlib (pip install 'perp[plot]')."""
        names = ("q", "v", "impulse")
        return _plot.panels(
            [(_plot.courses, (self.t, getattr(self, name), name)) for name in names], axes
        )


_make_step = maker(
    MechanismStep,
    CStep,
    scheme=MECHANISM_SCHEMES,
    method=CONTACT_METHODS,
    answers=lambda count: count or None,
)
_make_stats = maker(MechanismStats, MechanismRunResult)


def words(address: Optional[int], count: int) -> Words:
    """The modes that the library wrote."""
    return _MODE_WORDS[read_codes(address, count)]


def make_step(
    step: CStep, t: float, h: float, arrays: list[Array], modes: Words, ray: Optional[Array]
) -> MechanismStep:
    q, v, impulse, velocity = arrays
    return _make_step(
        step, t=t, h=h, q=q, v=v, impulse=impulse, velocity=velocity, modes=modes, ray=ray
    )


class Recorder:
    """Keeps what an observer is shown, as bytes: a run may have a million steps."""

    def __init__(self, coordinates: int, n: int, rows: int, modes: int) -> None:
        self._modes = modes
        self._widths = {"q": coordinates, "v": n, "impulse": rows, "velocity": rows}
        self._kept = {name: bytearray() for name in ("t", *self._widths, "modes")}

    def add(self, view: MechanismView) -> None:
        kept = self._kept
        kept["t"] += c_double(view.t)
        for name, width in self._widths.items():
            kept[name] += copied(getattr(view, name), 8 * width)
        kept["modes"] += copied(view.modes, 4 * self._modes)

    def step(self, view: MechanismView) -> MechanismStep:
        """The same for a callback."""
        arrays = [read(getattr(view, name), width) for name, width in self._widths.items()]
        step, modes = view.step[0] if view.step else CStep(), words(view.modes, self._modes)
        return make_step(step, view.t, view.h, arrays, modes, None)

    def tables(self) -> dict[str, Any]:
        """An array for each name, a row for each call of add()."""
        t = np.frombuffer(self._kept["t"])
        tables = {
            name: np.frombuffer(self._kept[name]).reshape(len(t), width)
            for name, width in self._widths.items()
        }
        codes = np.frombuffer(self._kept["modes"], dtype=np.int32)
        return {"t": t, **tables, "modes": _MODE_WORDS[codes].reshape(len(t), self._modes)}


def make_run(result: MechanismRunResult, recorder: Recorder) -> MechanismRun:
    return MechanismRun(
        **recorder.tables(),
        outcome=OUTCOMES[result.outcome],
        ok=result.outcome in GOOD_OUTCOMES,
        stats=_make_stats(result),
    )
