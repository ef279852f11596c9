"""Mechanisms in generalised coordinates, with contacts and friction, from functions."""

from __future__ import annotations

from ctypes import byref, c_void_p, sizeof
from typing import Any, Callable, Optional, Union

import numpy as np
from numpy.typing import ArrayLike

from . import _arrays
from ._callbacks import Array
from ._generated import (
    ImpactLaw,
    MechanismFound,
    MechanismObserver,
    MechanismRunResult,
    MechanismStart,
    MechanismSummary,
    Scheme,
    Selection,
)
from ._generated import MechanismStep as CStep
from ._mechanism_accelerations import Accelerations, make_accelerations, read_acceleration
from ._mechanism_base import MechanismBase, whole
from ._mechanism_check import MechanismCheck
from ._mechanism_library import library
from ._mechanism_results import (
    MechanismRun,
    MechanismStep,
    Recorder,
    make_run,
    make_step,
    words,
)
from ._structures import sized


def _start(time: float, length: float, place: Array, speed: Array) -> MechanismStart:
    """Where a step or a run begins; the arrays have to outlive it."""
    return MechanismStart(
        sizeof(MechanismStart), time, length, _arrays.address(place), _arrays.address(speed)
    )


class Mechanism(MechanismBase):
    """A mechanism with n velocities v and coordinates q, q' = v unless `kinematics` says otherwise:

        mass(q) v' = force(t, q, v) + H.T r + G.T s + B.T y

    r, s, y: forces of contacts, of bilateral constraints, and of dry friction of a given bound
    (Tresca). Functions get copies of q and v; what they return is checked. Exceptions raised in
    them come out of the call; raise perp.OutsideDomain where q is outside of what they are
    defined for.

    n: how many velocities.
    mass: mass(q) returns (n, n), symmetric positive definite; or a constant array, (n,) for a
        diagonal; None: the identity.
    force: force(t, q, v) returns (n,): applied forces, gravity, -C(q, v) v; or a constant array.
    contacts: contacts(q), or contacts(t, q) if it has two arguments without default, returns
        gap (k,), positive where separated,
        normal (k, n), the gap's gradient,
        tangent (k, n) in the plane, (k, 2, n) in space, (sum of dim - 1, n) with mixed dim; left
            out without friction,
        drift (optional), the rows' velocities at v = 0 (moving walls, belts): (k,) for normals
            alone, the gaps' partial derivatives by t; (k, dim) or (rows,) for all,
        mu (optional), (k,) or a number, instead of the coefficient below;
        as a tuple, a dict, or an object with these names. One contact may leave out the first axis.
    two_sided: normals that hold both ways: 0 (an ordinary contact), 1 (a guide, a screw's flank), 2
        (a pin in the plane, an axle) or 3 (a ball joint), or one a contact. Friction is mu |N|; gap
        has a number for each normal, 0 where it is met, normal a row: (k, 2) and (k, 2, n) for
        pins, or one after the other. The tangent of a pin is its radius times the relative
        turning. dim counts all rows.
    mu: of sliding; mu_static: where the contact did not slide; stribeck: speed s of
        mu + (mu_static - mu) exp(-(speed/s)**2), or 0; restitution: in [0, 1]. Each (k,), or a
        number for all.
    law: of impacts, "moreau", "newton", "poisson" or "stronge".
    bilateral: bilateral(q), or (t, q), returns c (m,), its gradient G (m, n) and, if it depends on
        time, drift (m,), the partial derivative of c: c = 0.
    tresca: tresca(t, q, v) returns bound (d,), a force, B (d, n), or (d, 2, n) for discs, and
        optionally drift, the slip at v = 0; or these as a constant.
    coordinates: how many q there are, if not n; then kinematics(q, v) returns q' (coordinates,).
    normalise: normalise(q) returns q put back where it belongs after a step (unit quaternions).
    curvature: curvature(t, q, v) returns d/dt(rows) v + d/dt(drift), all rows: for
        accelerations(); None: by differences.
    contact_count, dim (1, 2 or 3, or one a contact), bilateral_count, tresca_count, tresca_dim:
        sizes; those not given are found by calling the functions once, at the first state.
    check: look at the first state as check() does; Error says which entry is wrong.

    Units are any consistent ones. Raises Error where an argument makes no sense.
    """

    def __init__(
        self,
        n: int,
        *,
        mass: Union[ArrayLike, Callable[[Array], ArrayLike], None] = None,
        force: Union[ArrayLike, Callable[[float, Array, Array], ArrayLike], None] = None,
        contacts: Optional[Callable[..., Any]] = None,
        mu: ArrayLike = 0.0,
        mu_static: Optional[ArrayLike] = None,
        stribeck: Optional[ArrayLike] = None,
        restitution: ArrayLike = 0.0,
        law: ImpactLaw = "moreau",
        bilateral: Optional[Callable[..., Any]] = None,
        tresca: Any = None,
        coordinates: Optional[int] = None,
        kinematics: Optional[Callable[[Array, Array], ArrayLike]] = None,
        normalise: Optional[Callable[[Array], ArrayLike]] = None,
        curvature: Optional[Callable[[float, Array, Array], ArrayLike]] = None,
        two_sided: Optional[ArrayLike] = None,
        contact_count: Optional[int] = None,
        dim: Union[int, ArrayLike, None] = None,
        bilateral_count: Optional[int] = None,
        tresca_count: Optional[int] = None,
        tresca_dim: Optional[int] = None,
        check: bool = True,
    ) -> None:
        super().__init__(
            n,
            coordinates,
            law,
            dict(
                mass=mass,
                force=force,
                contacts=contacts,
                bilateral=bilateral,
                tresca=tresca,
                kinematics=kinematics,
                normalise=normalise,
                curvature=curvature,
            ),
            dict(mu=mu, mu_static=mu_static, stribeck=stribeck, restitution=restitution),
            dict(
                two_sided=two_sided,
                contact_count=contact_count,
                dim=dim,
                bilateral_count=bilateral_count,
                tresca_count=tresca_count,
                tresca_dim=tresca_dim,
            ),
            check,
        )

    def check(self, q: ArrayLike, v: Optional[ArrayLike] = None, t: float = 0.0) -> MechanismCheck:
        """Compares normal, G and their drift at a state with differences of gap and c, which tell
        their own error (4 (n + 1) calls and more), and tangents with normals: a tangent is no
        gradient, but may not be a multiple of its normal. A state without special values (0,
        right angles) shows more. Returns a MechanismCheck that names the worst entry."""
        with self._lock:
            before, self._check = self._check, False
            try:
                speed = np.zeros(self.n) if v is None else v
                return self._compare(*self._state(t, q, speed, ("t", "q", "v")))
            finally:
                self._check = before

    def step(
        self,
        t: float,
        q: ArrayLike,
        v: ArrayLike,
        h: float,
        *,
        scheme: Scheme = "frozen",
        cone: Union[str, int] = "exact",
        tol: float = 1e-10,
        theta: float = 0.5,
        project: bool = True,
        select: Selection = "any",
        time_limit: Optional[float] = None,
    ) -> MechanismStep:
        """Steps from (t, q, v) to t + h. q: (coordinates,), v: (n,). Settings as for simulate().

        The answer is one solution of the step's problem; answers() tells whether there are others,
        and `select` which to take. With outcome "ray", "evaluation_failed" or "singular" the state
        did not move. Raises Error where the call itself did not make sense.
        """
        with self._lock:
            time, place, speed = self._state(t, q, v, ("t", "q", "v"))
            length = _arrays.number(h, "h")
            self._set(
                scheme=scheme, cone=cone, tol=tol, theta=theta, project=project, select=select,
                time_limit=time_limit,
            )  # fmt: skip
            sizes = self.coordinates, self.n, self._row_count, self._row_count
            arrays = [np.empty(size) for size in sizes]
            modes, ray = np.empty(self._mode_count, dtype=np.int32), np.empty(self._row_count)
            result = sized(CStep)
            self._call(
                library.perp_mechanism_advance,
                *map(_arrays.address, arrays),
                _arrays.address(modes),
                _arrays.address(ray),
                byref(result),
                byref(_start(time, length, place, speed)),
            )
            said = words(_arrays.address(modes), self._mode_count)
            return make_step(
                result, time + length, length, arrays, said, ray if result.has_ray else None
            )

    def simulate(
        self,
        q0: ArrayLike,
        v0: ArrayLike,
        t_end: float,
        dt: float,
        *,
        scheme: Scheme = "frozen",
        cone: Union[str, int] = "exact",
        tol: float = 1e-10,
        error: float = 0.0,
        t0: float = 0.0,
        theta: float = 0.5,
        project: bool = True,
        select: Selection = "any",
        shortest: float = 0.0,
        longest: float = 0.0,
        overlap: float = 0.0,
        time_limit: Optional[float] = None,
        callback: Optional[Callable[[MechanismStep], Any]] = None,
    ) -> MechanismRun:
        """Steps from (t0, q0, v0) to t_end and keeps every step.

        dt: the step, made a little shorter so that a whole number of them ends at t_end; with
            error > 0 the first one.
        scheme: "frozen" (mass, force and contacts at the step's start), "implicit" (at its end),
            or "theta" (Moreau-Jean, forces weighted by theta).
        cone: "exact", or the number of edges of polyhedral cones (contacts in space).
        tol: the tested residual (dimensionless) that counts as solved.
        error: 0 for equal steps, or the estimated error a step may have, beside the largest value
            of q and dt v so far; then steps are from shortest to longest (0: no limit).
        project: remove penetration, and the drift of bilateral constraints, after each step.
        overlap: penetration and |c| that a step may end with, in the model's units; with more the
            run goes on, but its outcome is "stalled". 0: 1e-3, or `error`, of what gaps are sums
            of, or as much as at the start; with project=False any.
        select: which velocities a frozen step takes where its problem has several: "any" that the
            solver finds; "nearest" to those before, or the "freest" of impulses, of the stable
            ones of answers(). The last two look for all of them in every step.
        time_limit: seconds for the whole run; None: none.
        callback: called with a MechanismStep at the start and after every step; a true answer
            stops the run (outcome "stopped"), an exception ends it.

        Returns a MechanismRun: check its `ok` or its `outcome`. Raises Error where the call itself
        did not make sense.
        """
        with self._lock:
            time, place, speed = self._state(t0, q0, v0, ("t0", "q0", "v0"))
            end, length = _arrays.number(t_end, "t_end"), _arrays.number(dt, "dt")
            self._set(
                error=error, shortest=shortest, longest=longest, overlap=overlap, scheme=scheme,
                cone=cone, tol=tol, theta=theta, project=project, select=select,
                time_limit=time_limit,
            )  # fmt: skip
            sizes = self.coordinates, self.n, self._row_count, self._mode_count
            recorder = Recorder(*sizes)
            observer = MechanismObserver(self._observer(recorder, callback))
            q, v, result = place.copy(), speed.copy(), sized(MechanismRunResult)
            self._call(
                library.perp_mechanism_run,
                _arrays.address(q),
                _arrays.address(v),
                byref(result),
                byref(_start(time, length, place, speed)),
                end,
                observer,
                c_void_p(),
            )
            return make_run(result, recorder)

    def _observer(
        self, recorder: Recorder, callback: Optional[Callable[[MechanismStep], Any]]
    ) -> Callable[[Any, Any], int]:
        raised = self._callbacks.raised

        def observe(view: Any, _: Any) -> int:
            try:
                if raised:
                    return -1
                recorder.add(view[0])
                return 1 if callback is not None and callback(recorder.step(view[0])) else 0
            except BaseException as error:
                raised.append(error)
                return -1

        return observe

    def accelerations(
        self,
        t: float,
        q: ArrayLike,
        v: ArrayLike,
        *,
        most_patterns: int = 2**22,
        directions: int = 16,
        starts: int = 16,
        stiffness: float = 1.0,
        damping: float = 2.0,
        tol: float = 1e-10,
        time_limit: Optional[float] = None,
    ) -> Accelerations:
        """Finds all accelerations of a state, with their forces: every combination of separate,
        stick and slip. There may be none, one, several, or families. q: (coordinates,), v: (n,).

        most_patterns: more combinations (or 12 contacts) are not enumerated: `exhaustive` is then
            False, and a search from so many `starts` finds some.
        directions: in space, of several slips that start at once: tried at first, then made
            exact.
        stiffness, damping: of compliant contacts, which tell what is `stable`.
        """
        with self._lock:
            time, place, speed = self._state(t, q, v, ("t", "q", "v"))
            self._set(
                most_patterns=whole(most_patterns, "most_patterns", 2**62),
                directions=whole(directions, "directions"),
                starts=whole(starts, "starts"),
                stiffness=stiffness,
                damping=damping,
                tol=tol,
                time_limit=time_limit,
            )
            return self._found(library.perp_mechanism_accelerations, (time,), place, speed)

    def answers(
        self,
        t: float,
        q: ArrayLike,
        v: ArrayLike,
        h: float,
        *,
        most_patterns: int = 2**22,
        directions: int = 16,
        tol: float = 1e-10,
        time_limit: Optional[float] = None,
    ) -> Accelerations:
        """Finds all answers of a frozen step from (t, q, v) to t + h, before restitution, as
        accelerations: each `acceleration` is the change of v over h, each `force` an impulse over
        h. A wedge may jam or come out; a rod that jams has an answer without an acceleration.
        """
        with self._lock:
            time, place, speed = self._state(t, q, v, ("t", "q", "v"))
            length = _arrays.number(h, "h")
            self._set(
                most_patterns=whole(most_patterns, "most_patterns", 2**62),
                directions=whole(directions, "directions"),
                tol=tol,
                time_limit=time_limit,
            )
            return self._found(library.perp_mechanism_answers, (time, length), place, speed)

    def _found(
        self, ask: Callable[..., int], when: tuple[float, ...], place: Array, speed: Array
    ) -> Accelerations:
        summary = sized(MechanismSummary)
        self._call(ask, byref(summary), *when, _arrays.address(place), _arrays.address(speed))
        solutions, found = [], sized(MechanismFound)
        for index in range(summary.count):
            self._call(library.perp_mechanism_get_acceleration, byref(found), index)
            solutions.append(read_acceleration(found, self.n, self._row_count, self._mode_count))
        return make_accelerations(summary, solutions)
