"""What a mechanism answers: steps and runs."""

from __future__ import annotations

from ctypes import string_at
from dataclasses import dataclass
from typing import Any, Optional

import numpy as np
from numpy.typing import NDArray

from ._callbacks import Array
from ._library import (
    CERTIFICATES,
    CONTACT_METHODS,
    GOOD_OUTCOMES,
    MECHANISM_SCHEMES,
    MODES,
    OUTCOMES,
)
from ._structures_mechanism import MechanismRunResult, MechanismView
from ._structures_mechanism import MechanismStep as CStep

Words = NDArray[np.str_]
_MODE_WORDS = np.array([MODES[k] for k in range(len(MODES))])


@dataclass(frozen=True, eq=False)
class MechanismStep:
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

    def __repr__(self) -> str:
        return f"<perp.MechanismStep {self.outcome}, t={self.t:g}, v={self.v}>"


@dataclass(frozen=True, eq=False)
class MechanismStats:
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
class MechanismRun:
    """A run: entry 0 of each array is the start, entry k the end of step k. Rows as in
    MechanismStep."""

    t: Array  # (steps + 1,)
    q: Array  # (steps + 1, coordinates)
    v: Array  # (steps + 1, n)
    impulse: Array  # (steps + 1, rows); 0 at the start
    velocity: Array  # (steps + 1, rows)
    modes: Words  # (steps + 1, contacts + groups of tresca)
    outcome: str  # "solved", or that of the step that ended the run; "stopped", "stalled", ...
    ok: bool
    stats: MechanismStats

    def __repr__(self) -> str:
        return f"<perp.MechanismRun {self.outcome}, {self.stats.steps} steps, t={self.t[-1]:g}>"


def read(address: Optional[int], count: int) -> Array:
    """A copy of so many doubles of the library's."""
    if not count or not address:
        return np.zeros(count)
    return np.frombuffer(bytearray(string_at(address, 8 * count)))


def words(address: Optional[int], count: int) -> Words:
    """The modes that the library wrote."""
    if not count or not address:
        return _MODE_WORDS[np.zeros(count, dtype=np.int32)]
    return _MODE_WORDS[np.frombuffer(string_at(address, 4 * count), dtype=np.int32)]


def make_step(
    step: CStep, t: float, h: float, arrays: list[Array], modes: Words, ray: Optional[Array]
) -> MechanismStep:
    q, v, impulse, velocity = arrays
    return MechanismStep(
        t,
        h,
        q,
        v,
        impulse,
        velocity,
        modes,
        OUTCOMES[step.outcome],
        step.outcome in GOOD_OUTCOMES,
        ray,
        CERTIFICATES[step.certificate],
        MECHANISM_SCHEMES[step.scheme],
        step.closed,
        step.sticking,
        step.impacts,
        CONTACT_METHODS[step.method],
        step.residual,
        step.penetration,
        step.drift,
        step.error,
        step.seconds,
        step.iterations,
        step.evaluations,
    )


def read_view(view: MechanismView, sizes: tuple[int, int, int, int]) -> MechanismStep:
    """What an observer is shown: coordinates, velocities, rows and modes in these numbers."""
    m, n, rows, modes = sizes
    arrays = [
        read(view.q, m),
        read(view.v, n),
        read(view.impulse, rows),
        read(view.velocity, rows),
    ]
    step = view.step[0] if view.step else CStep()
    return make_step(step, view.t, view.h, arrays, words(view.modes, modes), None)


def make_run(result: MechanismRunResult, steps: list[MechanismStep]) -> MechanismRun:
    def table(name: str) -> Any:
        return np.array([getattr(step, name) for step in steps])

    return MechanismRun(
        table("t"),
        table("q"),
        table("v"),
        table("impulse"),
        table("velocity"),
        table("modes"),
        OUTCOMES[result.outcome],
        result.outcome in GOOD_OUTCOMES,
        MechanismStats(
            result.steps,
            result.rejected,
            result.fallbacks,
            result.iterations,
            result.evaluations,
            result.residual,
            result.penetration,
            result.drift,
            result.error,
            result.seconds,
        ),
    )
