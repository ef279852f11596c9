"""What a world tells: results of steps, contacts, energy, momentum, statistics."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple, Union

import numpy as np
from numpy.typing import NDArray

from ._answer import Answer, Shown
from ._generated import Outcome

if TYPE_CHECKING:
    from ._body import Body, Shape

Array = NDArray[np.float64]


@dataclass(frozen=True, repr=False)
class StepResult(Answer):
    """How one step went."""

    outcome: Outcome  # the worst of the islands'
    ok: bool  # solved, or as near as a double can come
    advanced: bool  # False if the state was left untouched
    residual: float  # the largest of the islands', dimensionless
    iterations: int
    contacts: int
    islands: int  # islands that needed a solve
    steps: int = 1  # that it was taken in
    error: float = float("nan")  # sum of their estimated errors; nan where steps were not chosen

    def __repr__(self) -> str:
        return (
            f"<perp.StepResult: {self.outcome}{'' if self.advanced else ', not advanced'}, "
            f"residual {self.residual:.2g}, contacts {self.contacts}, islands {self.islands}, "
            f"iterations {self.iterations}>"
        )


@dataclass(frozen=True)
class RunResult(Answer):
    """How a run went."""

    outcome: Outcome  # "solved", or the first outcome that was not ok
    ok: bool  # every step was
    steps: int  # taken
    seconds: float  # of the world's time: steps * dt
    residual: float  # the largest of the steps'
    stopped: bool  # by the callback, or because a step did not advance

    def __repr__(self) -> str:
        stopped = ", stopped" if self.stopped else ""
        return (
            f"<perp.RunResult: {self.outcome}{stopped}, {self.steps} steps, {self.seconds:g} s, "
            f"residual {self.residual:.2g}>"
        )

    @property
    def nit(self) -> int:
        return self.steps


@dataclass(frozen=True, eq=False, repr=False)
class Contact:
    """A contact point of the last step. The normal points from body_a to body_b; components are
    (normal, tangent) in a planar world, (normal, tangent 1, tangent 2) otherwise."""

    body_a: Body
    body_b: Body
    shape_a: Shape
    shape_b: Shape
    position: Array  # midway between the surfaces, at the start of the step
    normal: Array
    tangents: Array  # a row each: (1, 2) in a planar world, (2, 3) otherwise
    gap: float  # at the start of the step
    impulse: Array  # on body_b; exactly 0 where separated
    velocity: Array  # of b relative to a, after the step; exactly 0 where the contact holds
    friction: float
    restitution: float
    mode: str  # "separate", "stick" or "slip"

    def __repr__(self) -> str:
        with np.printoptions(precision=4):
            return (
                f"<perp.Contact, {self.mode}: at {self.position}, normal {self.normal}, "
                f"gap {self.gap:.2g}, impulse {self.impulse}, velocity {self.velocity}>"
            )


class Energy(NamedTuple):
    """Of the dynamic bodies; potential energy is zero at the origin."""

    kinetic: float
    potential: float

    @property
    def total(self) -> float:
        return self.kinetic + self.potential


class Momentum(NamedTuple):
    """Of the dynamic bodies; angular momentum is about the origin, a number in planar worlds."""

    linear: Array
    angular: Union[Array, float]


@dataclass(frozen=True)
class Stats(Shown):
    """Counts of the last step, except steps and seconds, which count since creation."""

    bodies: int
    shapes: int
    islands: int
    contacts: int
    rows_normal: int
    rows_friction: int
    impacts: int
    iterations: int
    steps: int
    residual: float
    seconds_collide: float
    seconds_solve: float
    seconds_integrate: float
    seconds_project: float
    joints: int
    rows_joint: int

    def as_dict(self) -> dict[str, Any]:
        return dict(vars(self))
