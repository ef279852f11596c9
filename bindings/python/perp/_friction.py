"""Load-dependent friction: A q'' + b + diag(mu sgn q') |C q'' + d| = tau."""

from __future__ import annotations

from ctypes import byref, pointer
from dataclasses import dataclass
from typing import Any, Optional

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _arrays
from ._answer import Found, Shown, maker
from ._errors import argument_error
from ._generated import (
    LoadFound,
    LoadFrictionPointer,
    LoadInverse,
    LoadSettings,
    LoadStep,
    LoadSummary,
    LoadSystem,
    LoadUniqueness,
    Matrix,
)
from ._handle import Handle
from ._mechanism_library import LOAD_KINDS, LOAD_MODES, LOAD_REASONS, defaults, library
from ._structures import sized

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class LoadSolution(Shown):
    """One acceleration that a torque may have; of a family, a point inside."""

    acceleration: Array  # q''
    normal_force: Array  # C q'' + d
    friction: Array  # f: A q'' + b + f = tau
    kind: str  # "dynamic", "static" (all stick), "mixed" (some stick), "family"
    modes: list[str]  # of each coordinate: "slide", "stick", "forward", "backward", "stopped"
    stable: bool  # compliant contacts settle on it
    flutter: bool  # unstable though no effective inertia is negative
    eigenvalues: NDArray[np.complex128]  # 2 n, of the compliant contacts
    at_vertex: bool  # data next to these have more solutions, or fewer
    dimension: int  # 0; of a family at least 1
    vertices: Array  # (k, n): the family is their convex hull,
    directions: Array  # (m, n): plus sums of these with factors >= 0
    residual: float  # relative

    def __repr__(self) -> str:
        verdict = "stable" if self.stable else "unstable"
        return f"<perp.LoadSolution {self.kind} {self.acceleration} {verdict}>"


@dataclass(frozen=True, eq=False)
class LoadSolutions(Found[LoadSolution]):
    """What load_friction() found: a sequence of LoadSolution, and whether there can be several."""

    solutions: list[LoadSolution]
    exhaustive: bool  # there are no others
    unique_for_all_tau: Optional[bool]  # None: not decided
    margin: float  # all mu may be multiplied by less than this before uniqueness is lost, in motion
    margin_exact: bool  # else margin is a lower bound
    determinant: float  # the smallest det(I + G D); nan for n > 12
    norm: float  # ||G||_2 < 1 is sufficient for uniqueness,
    radius: float  # and so is rho(|G|) < 1
    patterns: int  # combinations of signs and modes looked at


@dataclass(frozen=True, eq=False)
class InverseLoad(Shown):
    """What load_friction_inverse() found."""

    tau: Array
    well_posed: bool  # tau has the wanted acceleration alone, and that is stable
    reason: Optional[str]  # what is not; None if well posed
    stable: bool  # the wanted motion is
    solutions: list[LoadSolution]  # all that tau may do
    exhaustive: bool  # there are no others

    def __repr__(self) -> str:
        return f"<perp.LoadInverse tau={self.tau} {self.reason or 'well posed'}>"


def _square(value: Any, name: str, n: int) -> Array:
    dense = value.toarray() if _arrays.is_sparse(value) else value
    array = np.atleast_1d(_arrays.real(dense, name))
    if array.ndim == 1 and n == 1 and array.shape == (1,):
        array = array.reshape(1, 1)
    if array.shape != (n, n):
        raise argument_error(f"{name} has shape {array.shape}, expected ({n}, {n})")
    return np.asfortranarray(array)


def _vector(value: Any, name: str, n: int) -> Optional[Array]:
    """Scalars stand for n of their kind."""
    return _arrays.bound(value, name, n)


@dataclass(frozen=True, eq=False)
class LoadStepped(Shown):
    """What load_friction_step() did."""

    velocity: Array  # at the end of the step; exactly 0.0 where a coordinate stops or stays at rest
    normal_force: Array  # of the answer that was taken: `previous` of the next step
    chosen: Optional[int]  # index of that answer in solutions; None: there is none
    solutions: list[LoadSolution]  # of the step's equations; acceleration is (velocity - v) / h;
    # LoadFriction.step() reads them only if asked to
    exhaustive: bool  # there are no others
    stable: bool  # the answer that was taken is
    stopped: int  # coordinates that came to rest
    jam: bool  # one of them by an impulse, not by an acceleration
    accelerations: int  # of the rigid system before the step


_make_solution = maker(LoadSolution, LoadFound, kind=LOAD_KINDS)
_make_solutions = maker(LoadSolutions, LoadSummary)
_make_inverse = maker(InverseLoad, LoadInverse, reason=lambda code: LOAD_REASONS[code] or None)
_make_stepped = maker(LoadStepped, LoadStep)


class LoadFriction(Handle):
    """A system whose friction depends on the load, kept for several questions:

        A q'' + b + f = tau,   f_i = mu_i |N_i| sgn q_i',   N = C q'' + d

    Arguments and settings as for load_friction(). A step takes microseconds where
    load_friction_step(), which sets the system up anew, takes tens of them.
    """

    _create = library.perp_load_friction_create
    _destroy = library.perp_load_friction_destroy
    _pointer_type = LoadFrictionPointer

    def __init__(
        self,
        A: Any,
        b: ArrayLike,
        C: Any,
        d: ArrayLike,
        mu: ArrayLike,
        mu_static: Optional[ArrayLike] = None,
        *,
        stiffness: float = 1.0,
        damping: Optional[float] = None,
        normal_inertia: Any = None,
        tol: Optional[float] = None,
        most_patterns: Optional[int] = None,
        starts: Optional[int] = None,
    ) -> None:
        first = np.atleast_1d(_arrays.real(A.toarray() if _arrays.is_sparse(A) else A, "A"))
        self.n = len(first)
        self._unique: dict[bytes, LoadUniqueness] = {}
        self._stiffness, self._damping = stiffness, damping
        self._normal_inertia = normal_inertia
        settings = defaults(LoadSettings)
        for name, value in (("tol", tol), ("most_patterns", most_patterns), ("starts", starts)):
            if value is not None:
                setattr(settings, name, value)
        system, _kept = self._system(A, b, C, d, mu, mu_static)
        super().__init__(byref(settings), byref(system))
        self._stepped = sized(LoadStep)

    def _system(
        self, A: Any, b: Any, C: Any, d: Any, mu: Any, mu_static: Any
    ) -> tuple[LoadSystem, list[Any]]:
        """The library's description, and what has to live as long as it is read."""
        n, system = self.n, defaults(LoadSystem)
        system.n = n
        kept: list[Any] = []
        for name, value in (("A", A), ("C", C), ("normal_inertia", self._normal_inertia)):
            if value is not None or name == "C":
                matrix = sized(Matrix)
                _, _, owner = _arrays.view(matrix, _square(value, name, n))
                setattr(system, name, pointer(matrix))
                kept += [matrix, owner]
        for name, value in (("b", b), ("d", d), ("mu", mu), ("mu_static", mu_static)):
            vector = _vector(value, name, n)
            if vector is not None:
                setattr(system, name, _arrays.address(vector))
                kept.append(vector)
        system.stiffness = self._stiffness
        damping = self._damping
        system.damping = 2 * np.sqrt(abs(self._stiffness)) if damping is None else damping
        return system, kept

    def update(
        self,
        A: Any,
        b: ArrayLike,
        C: Any,
        d: ArrayLike,
        mu: ArrayLike,
        mu_static: Optional[ArrayLike] = None,
    ) -> None:
        """Takes another system of as many coordinates, as where A to mu depend on the place."""
        system, _kept = self._system(A, b, C, d, mu, mu_static)
        with self._lock:
            self._call(library.perp_load_friction_set, byref(system))
            self._unique.clear()

    def solve(self, velocity: ArrayLike, tau: ArrayLike) -> LoadSolutions:
        """Finds every acceleration that a torque may have, as load_friction() does."""
        summary = sized(LoadSummary)
        torque, v = self._given(tau, "tau"), self._given(velocity, "velocity")
        with self._lock:
            self._call(
                library.perp_load_friction_solve,
                byref(summary),
                _arrays.address(torque),
                _arrays.address(v),
            )
            solutions = self._solutions(summary.count)
            unique = self._uniqueness(v)
        return _make_solutions(
            summary,
            solutions=solutions,
            unique_for_all_tau={0: True, 1: False}.get(unique.verdict),
            margin=unique.margin,
            margin_exact=bool(unique.exact),
            determinant=unique.determinant,
            norm=unique.norm,
            radius=unique.radius,
        )

    def inverse(self, velocity: ArrayLike, acceleration: ArrayLike) -> InverseLoad:
        """Finds the torque for a wanted acceleration, as load_friction_inverse() does."""
        tau, result = np.empty(self.n), sized(LoadInverse)
        v, x = self._given(velocity, "velocity"), self._given(acceleration, "acceleration")
        with self._lock:
            self._call(
                library.perp_load_friction_inverse,
                _arrays.address(tau),
                byref(result),
                _arrays.address(v),
                _arrays.address(x),
            )
            solutions = self._solutions(result.accelerations)
        return _make_inverse(result, tau=tau, solutions=solutions)

    def step(
        self,
        velocity: ArrayLike,
        tau: ArrayLike,
        h: float,
        *,
        previous: Optional[ArrayLike] = None,
        solutions: bool = False,
    ) -> LoadStepped:
        """Steps the velocity by the time h, as load_friction_step() does. solutions: also read all
        answers of the step, which takes longer; else that list is empty."""
        n, result = self.n, self._stepped
        torque, v = self._given(tau, "tau"), self._given(velocity, "velocity")
        before = None if previous is None else self._given(previous, "previous")
        after, normal = np.empty(n), np.empty(n)
        with self._lock:
            self._call(
                library.perp_load_friction_step,
                _arrays.address(after),
                _arrays.address(normal),
                byref(result),
                _arrays.address(torque),
                _arrays.address(v),
                _arrays.optional(before),
                h,
            )
            answers = self._solutions(result.answers) if solutions else []
            return _make_stepped(
                result, velocity=after, normal_force=normal, solutions=answers
            )

    def _given(self, value: Any, name: str) -> Array:
        if type(value) is float:  # the short way round
            return np.array([value] * self.n)
        return _arrays.spread(value, name, self.n)

    def _solutions(self, count: int) -> list[LoadSolution]:
        answers, found = [], sized(LoadFound)
        for index in range(count):
            self._call(library.perp_load_friction_get, byref(found), index)
            answers.append(self._solution(found))
        return answers

    def _solution(self, s: LoadFound) -> LoadSolution:
        n = self.n
        return _make_solution(
            s,
            acceleration=_arrays.read(s.acceleration, n),
            normal_force=_arrays.read(s.normal_force, n),
            friction=_arrays.read(s.friction, n),
            modes=[LOAD_MODES[mode] for mode in _arrays.read_codes(s.modes, n)],
            eigenvalues=_arrays.read(s.eigenvalues, 4 * n).view(np.complex128),
            vertices=_arrays.read(s.vertices, s.vertex_count, n),
            directions=_arrays.read(s.rays, s.ray_count, n),
        )

    def _uniqueness(self, velocity: Array) -> LoadUniqueness:
        """It depends on what is at rest alone."""
        rests = (velocity == 0.0).tobytes()
        if rests not in self._unique:
            result = sized(LoadUniqueness)
            where = _arrays.address(velocity)
            self._call(library.perp_load_friction_uniqueness, byref(result), where)
            self._unique[rests] = result
        return self._unique[rests]


def load_friction(
    A: Any,
    b: ArrayLike,
    C: Any,
    d: ArrayLike,
    mu: ArrayLike,
    velocity: ArrayLike,
    tau: ArrayLike,
    mu_static: Optional[ArrayLike] = None,
    *,
    stiffness: float = 1.0,
    damping: Optional[float] = None,
    normal_inertia: Any = None,
    tol: Optional[float] = None,
    most_patterns: Optional[int] = None,
    starts: Optional[int] = None,
) -> LoadSolutions:
    """Finds every acceleration that a torque may have where friction depends on the load:

        A q'' + b + f = tau,   f_i = mu_i |N_i| sgn q_i',   N = C q'' + d

    and |f_i| <= mu_static_i |N_i| where a coordinate is at rest (velocity exactly 0.0). A and C are
    (n, n), the rest (n,); a scalar stands for n of its kind, and for n = 1 all may be scalars.

    Stability is that of contacts with this stiffness and damping (default: 2 sqrt(stiffness)) and
    inertia in normal direction (default: 1). Up to most_patterns combinations of signs are
    enumerated; beyond, `exhaustive` is False.
    """
    friction = LoadFriction(
        A, b, C, d, mu, mu_static, stiffness=stiffness, damping=damping,
        normal_inertia=normal_inertia, tol=tol, most_patterns=most_patterns, starts=starts,
    )
    return friction.solve(velocity, tau)


def load_friction_inverse(
    A: Any,
    b: ArrayLike,
    C: Any,
    d: ArrayLike,
    mu: ArrayLike,
    velocity: ArrayLike,
    acceleration: ArrayLike,
    mu_static: Optional[ArrayLike] = None,
    **settings: Any,
) -> InverseLoad:
    """Finds the torque for a wanted acceleration, and says whether that torque gives this
    acceleration: `well_posed`, or `reason`. Arguments and settings as for load_friction()."""
    return LoadFriction(A, b, C, d, mu, mu_static, **settings).inverse(velocity, acceleration)


def load_friction_step(
    A: Any,
    b: ArrayLike,
    C: Any,
    d: ArrayLike,
    mu: ArrayLike,
    velocity: ArrayLike,
    tau: ArrayLike,
    h: float,
    mu_static: Optional[ArrayLike] = None,
    *,
    previous: Optional[ArrayLike] = None,
    **settings: Any,
) -> LoadStepped:
    """Steps the velocity by the time h, implicitly: where the rigid system has no acceleration it
    stops within the step, by an impulse (`jam`). Of several answers a stable one is taken whose
    normal forces are on the side of `previous`, those of the step before (nan: unknown); all are
    returned. Other arguments and settings as for load_friction(). For many steps keep a
    LoadFriction."""
    friction = LoadFriction(A, b, C, d, mu, mu_static, **settings)
    return friction.step(velocity, tau, h, previous=previous, solutions=True)
