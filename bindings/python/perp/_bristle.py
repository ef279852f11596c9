"""Friction that depends on speed (Stribeck) and on what its bristles remember (LuGre)."""

from __future__ import annotations

from ctypes import byref, c_double, c_int32
from typing import Any, NamedTuple, Optional, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _arrays
from ._generated import Bristle
from ._handle import Context
from ._mechanism_library import library
from ._structures import sized

Numbers = Union[float, NDArray[np.float64]]


class Stribeck(NamedTuple):
    """What stribeck() gives; in the shape of its velocities."""

    force: Numbers
    slope: Numbers  # d force / d v


def _law(**fields: Optional[float]) -> Bristle:
    law = sized(Bristle)
    for name, value in fields.items():
        if value is not None:
            setattr(law, name, _arrays.number(value, name))
    return law


def stribeck(
    v: ArrayLike,
    kinetic: float,
    breakaway: Optional[float] = None,
    speed: Optional[float] = None,
    viscosity: float = 0.0,
) -> Stribeck:
    """Returns the force of steady sliding with velocity v, and its derivative by v:

        (kinetic + (breakaway - kinetic) exp(-(v / speed)**2)) sgn v + viscosity v

    breakaway: at v = 0, not below kinetic; None: kinetic. At v = 0 the force is 0, the middle of
    [-breakaway, breakaway]. A body that slides with v feels the opposite force.
    """
    law = _law(kinetic=kinetic, breakaway=breakaway, speed=speed, viscosity=viscosity)
    speeds = _arrays.real(v, "v")
    answer = np.empty((2,) + speeds.shape)
    force, slope, context = c_double(), c_double(), Context()
    for place in np.ndindex(speeds.shape):
        context.check(
            library.perp_stribeck_force(
                context.pointer, byref(force), byref(slope), byref(law), speeds[place]
            )
        )
        answer[(0,) + place], answer[(1,) + place] = force.value, slope.value
    if speeds.ndim == 0:
        return Stribeck(float(answer[0]), float(answer[1]))
    return Stribeck(answer[0], answer[1])


class LuGre:
    """Friction by bristles that bend by z:

        z' = v - stiffness |v| z / g(v),   F = stiffness z + damping z' + viscosity v,
        g(v) = kinetic + (breakaway - kinetic) exp(-(v / speed)**2)

    In steady sliding the force is that of stribeck(). A body that slides with v feels -F.

    z: the bend, 0 at first; may be set. passive: whether friction never gives back more than the
    bristles hold: viscosity kinetic >= damping (breakaway - kinetic).
    """

    def __init__(
        self,
        *,
        stiffness: float,
        kinetic: float,
        breakaway: Optional[float] = None,
        speed: Optional[float] = None,
        damping: float = 0.0,
        viscosity: float = 0.0,
        z: float = 0.0,
    ) -> None:
        self._context = Context()
        self._law = _law(
            kinetic=kinetic,
            breakaway=breakaway,
            speed=speed,
            viscosity=viscosity,
            stiffness=stiffness,
            damping=damping,
        )
        self.z = z
        passive = c_int32()
        self._call(library.perp_lugre_passive, byref(passive), byref(self._law))
        self.passive = bool(passive.value)

    def _call(self, function: Any, *arguments: Any) -> None:
        self._context.check(function(self._context.pointer, *arguments))

    def force(self, v: float) -> float:
        """Returns the force at this instant."""
        force = c_double()
        self._call(
            library.perp_lugre_force,
            byref(force),
            None,
            byref(self._law),
            _arrays.number(self.z, "z"),
            _arrays.number(v, "v"),
        )
        return force.value

    def steady(self, v: float) -> float:
        """Returns the force of steady sliding."""
        force = c_double()
        self._call(
            library.perp_stribeck_force,
            byref(force),
            None,
            byref(self._law),
            _arrays.number(v, "v"),
        )
        return force.value

    def trial(self, v: float, h: float) -> tuple[float, float, float]:
        """Returns what step(v, h) would: the bend, the mean force, and its derivative by v, for
        implicit steps of what slides. z stays."""
        bend, force, slope = c_double(), c_double(), c_double()
        self._call(
            library.perp_lugre_step,
            byref(bend),
            byref(force),
            byref(slope),
            byref(self._law),
            _arrays.number(self.z, "z"),
            _arrays.number(v, "v"),
            _arrays.number(h, "h"),
        )
        return bend.value, force.value, slope.value

    def step(self, v: float, h: float) -> float:
        """Slides with v for the time h, exactly. Returns the mean force: h F is the impulse."""
        self.z, force, _ = self.trial(v, h)
        return force

    def __repr__(self) -> str:
        return f"<perp.LuGre z={self.z:g}>"
