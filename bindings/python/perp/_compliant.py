"""Sliding contacts that give: which solution of load-dependent friction is real."""

from __future__ import annotations

from ctypes import byref, pointer
from dataclasses import dataclass
from typing import Any, Optional

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _arrays
from ._answer import Shown
from ._errors import argument_error
from ._generated import (
    CompliantPointer,
    CompliantResult,
    CompliantSettings,
    CompliantStability,
    CompliantSystem,
    Matrix,
)
from ._handle import Context, _release_with
from ._library import MODES, codes
from ._mechanism_library import defaults, library
from ._structures import sized

Array = NDArray[np.float64]
_ENDS = tuple(codes("PERP_COMPLIANT_"))
_COUNTS = ("steps", "rejected", "stops", "reversals", "starts", "releases")


@dataclass(frozen=True, eq=False)
class Linearisation(Shown):
    """delta'' + Gamma (stiffness delta + damping delta') = const."""

    stable: bool  # every eigenvalue has a negative real part
    flutter: bool  # it is not, though Re gamma > 0 for all
    growth: float  # largest real part of an eigenvalue
    gamma: NDArray[np.complex128]  # the eigenvalues of Gamma
    eigenvalues: NDArray[np.complex128]  # two for each gamma, in pairs


@dataclass(frozen=True, eq=False)
class CompliantRun(Shown):
    """Where a run ended, and samples on the way."""

    t: float
    x: Array
    v: Array
    normal_force: Array
    friction: Array  # F, along the tangents
    modes: list[str]  # "separate" "stick" "slip"
    end: str  # "time", "stopped" (a contact stopped sliding), "released", "touched", "steps", "failed"
    contact: Optional[int]  # that ended it
    least_normal: float  # on the way
    largest_normal: float
    steps: int
    rejected: int
    stops: int  # slip that ended in stick
    reversals: int  # slip that ended in slip the other way
    starts: int  # stick that ended in slip
    releases: int  # of one-sided contacts
    samples: Array  # (k, 1 + 2 n + p): t, x, v, N


def _matrix(value: Any, name: str, rows: Optional[int], columns: int, kept: list[Any]) -> Any:
    array = np.atleast_2d(_arrays.real(value, name))
    if array.shape != (rows, columns):
        raise argument_error(f"{name} has shape {array.shape}, expected ({rows}, {columns})")
    array, matrix = np.ascontiguousarray(array), sized(Matrix)
    matrix.storage, matrix.rows, matrix.columns = _arrays.ROW_MAJOR, rows, columns
    matrix.leading_dimension, matrix.values = max(columns, 1), _arrays.address(array)
    kept += [array, matrix]
    return pointer(matrix)


class Compliant:
    """n coordinates x and p contacts with stiffness and damping in normal direction:

        mass x'' + normal' N + tangent' F = force,  F = mu sgn(tangent x') |N| where it slides,
        |F| <= mu_static |N| and tangent x' = 0 where it sticks
        N = stiffness delta + damping delta',  delta = normal x; one-sided contacts only press

    mass is (n, n); normal and tangent are (p, n); force is (n,), mu, mu_static (None: mu) and
    one_sided (p,), or scalars.
    """

    def __init__(
        self,
        mass: ArrayLike,
        normal: ArrayLike,
        tangent: ArrayLike,
        mu: ArrayLike,
        stiffness: float,
        damping: float = 0.0,
        force: Optional[ArrayLike] = None,
        *,
        mu_static: Optional[ArrayLike] = None,
        one_sided: ArrayLike = False,
    ) -> None:
        self.n = n = np.atleast_2d(_arrays.real(mass, "mass")).shape[0]
        self.p = p = np.atleast_2d(_arrays.real(normal, "normal")).shape[0]
        system = sized(CompliantSystem)
        kept: list[Any] = []
        system.n, system.contacts = n, p
        system.mass = _matrix(mass, "mass", n, n, kept)
        system.normal = _matrix(normal, "normal", p, n, kept)
        system.tangent = _matrix(tangent, "tangent", p, n, kept)
        for name, value, size in ("force", force, n), ("mu", mu, p), ("mu_static", mu_static, p):
            array = _arrays.bound(value, name, size)
            kept.append(array)
            setattr(system, name, _arrays.optional(array))
        sides = np.ascontiguousarray(np.broadcast_to(one_sided, (p,)), dtype=np.int32)
        system.one_sided = _arrays.address(sides)
        system.stiffness, system.damping = stiffness, damping
        self._context, self._pointer = Context(), CompliantPointer()
        self._context.check(
            library.perp_compliant_create(
                self._context.pointer, byref(self._pointer), byref(system)
            )
        )
        _release_with(self, library.perp_compliant_destroy, self._pointer)

    def linearise(self, slip: ArrayLike, load: ArrayLike) -> Linearisation:
        """Eigenvalues where contact i slides in direction slip[i] (-1, 0: no friction, 1) with a
        normal force of sign load[i]."""
        result, p = sized(CompliantStability), self.p
        gamma, roots = np.empty(p, complex), np.empty(2 * p, complex)
        signs = [
            np.ascontiguousarray(np.broadcast_to(x, (p,)), dtype=np.int32) for x in (slip, load)
        ]
        self._context.check(
            library.perp_compliant_linearise(
                self._pointer,
                byref(result),
                _arrays.address(gamma),
                _arrays.address(roots),
                _arrays.address(signs[0]),
                _arrays.address(signs[1]),
            )
        )
        return Linearisation(
            bool(result.stable), bool(result.flutter), result.growth, gamma, roots
        )

    def run(
        self,
        x0: ArrayLike,
        v0: ArrayLike,
        t_end: float,
        *,
        through: bool = False,
        tol: float = 1e-9,
        samples: int = 0,
        most_steps: Optional[int] = None,
    ) -> CompliantRun:
        """Integrates until t_end or until a contact stops sliding (or separates, or touches), with
        this error a step beside the largest value so far. through: starts at rest, too, and goes
        on through stick, reversal and release. samples: that many equal parts of t_end are
        recorded."""
        settings, result = defaults(CompliantSettings), sized(CompliantResult)
        settings.tol, settings.through = tol, through
        if most_steps is not None:
            settings.most_steps = most_steps
        x = _arrays.vector(x0, "x0", self.n).copy()
        v = _arrays.vector(v0, "v0", self.n).copy()
        N = np.empty(self.p)
        rows, least, largest, t = [], np.inf, -np.inf, 0.0
        counts = dict.fromkeys(_COUNTS, 0)
        parts = max(samples, 1)
        for part in range(parts):
            until = t_end * (part + 1) / parts
            self._context.check(
                library.perp_compliant_run(
                    self._pointer,
                    _arrays.address(x),
                    _arrays.address(v),
                    _arrays.address(N),
                    byref(result),
                    byref(settings),
                    _arrays.address(x),
                    _arrays.address(v),
                    until - t,
                )
            )
            least, largest = min(least, result.least_normal), max(largest, result.largest_normal)
            for name in _COUNTS:
                counts[name] += getattr(result, name)
            settings.first_step, settings.resume = result.next_step, 1
            t = until if result.end == 0 else t + result.t
            rows.append(np.concatenate([[t], x, v, N]))
            if result.end:
                break
        return CompliantRun(
            t=t,
            x=x,
            v=v,
            normal_force=N,
            friction=_arrays.read(result.friction, self.p),
            modes=[MODES[k] for k in _arrays.read_codes(result.modes, self.p)],
            end=_ENDS[result.end],
            contact=None if result.contact < 0 else result.contact,
            least_normal=least,
            largest_normal=largest,
            samples=np.array(rows) if samples else np.empty((0, 1 + 2 * self.n + self.p)),
            **counts,
        )
