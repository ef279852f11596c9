"""Linear complementarity problems with bounds."""

from __future__ import annotations

import os
import threading
from ctypes import byref, pointer
from dataclasses import dataclass
from operator import is_not
from typing import Any, Optional

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _arrays, _plot
from ._answer import SolverAnswer, maker
from ._generated import (
    AccelerationMethod,
    LcpMethod,
    LcpMonitor,
    LcpProblem,
    LcpSettings,
    LcpSolverPointer,
    Matrix,
    Outcome,
    PivotRule,
    Sweep,
)
from ._generated import LcpResult as CResult
from ._handle import Context, Handle
from ._library import METHODS, codes, library
from ._monitor import Monitor, Watch, needs_watch
from ._settings import fill, numbers
from ._structures import sized

_CODES = {
    "method": numbers(METHODS),
    "pivot_rule": codes("PERP_PIVOT_"),
    "sweep": codes("PERP_SWEEP_"),
    "acceleration": codes("PERP_ACCELERATION_"),
}
_SETTINGS = (
    *("method", "tol", "max_iterations", "time_limit", "relaxation", "pivot_rule", "scaling"),
    *("polish", "crash", "sweep", "acceleration", "penalty"),
)
_NO_MONITOR = LcpMonitor()
_UNCHANGING = (str, float, int, bool, type(None))


@dataclass(eq=False)
class LcpResult(SolverAnswer):
    """The answer to one problem. See lcp() for what was asked."""

    z: NDArray[np.float64]  # within the bounds; the best iterate, whatever the outcome
    w: NDArray[np.float64]  # M z + q
    outcome: Outcome  # "solved", "rounding_limit", "ray", "iteration_limit", ...
    ok: bool  # solved, or as near as a double can come
    residual: float  # dimensionless, the one compared with tol
    natural_residual: float  # max |mid(z - lower, z - upper, w)|, in the caller's units
    backward_error: float  # row-wise; 2**-52 is one unit
    iterations: int
    seconds: float
    method: str  # the method that gave the answer
    ray: Optional[NDArray[np.float64]]  # direction of the secondary ray, if one was verified
    certificate: Optional[str]  # "infeasible" if the ray proves that there is no solution

    def __repr__(self) -> str:
        return (
            f"<perp.LcpResult {self.outcome} by {self.method}, n={len(self.z)}, "
            f"residual={self.residual:.2g}, iterations={self.iterations}>"
        )

    def _pictures(self) -> list[Any]:
        return [(_plot.complements, (self.z, self.w))]


_make = maker(LcpResult, CResult, method=METHODS)


def read_answer(
    result: CResult, z: NDArray[Any], w: NDArray[Any], ray: NDArray[Any]
) -> LcpResult:
    return _make(result, z, w, ray if result.has_ray else None)


class _Call:
    """A context and the structs of one call of lcp(), kept for the next one."""

    def __init__(self) -> None:
        self.context = Context()
        self.settings = sized(LcpSettings)
        self.filled: Any = None  # what the settings hold, as lcp() was given it
        self.matrix, self.problem = sized(Matrix), sized(LcpProblem)
        self.problem.M = pointer(self.matrix)
        self.result = sized(CResult)
        self.references = byref(self.result), byref(self.settings), byref(self.problem)


class _Pool(threading.local):
    """The calling thread's idle calls; more than one only where a monitor calls lcp() again."""

    def __init__(self) -> None:
        self.idle: list[_Call] = []


_pool = _Pool()

# after a fork, a child may only destroy what its parent made
if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=lambda: _pool.idle.clear())


def lcp(
    M: Any,
    q: ArrayLike,
    lower: Optional[ArrayLike] = None,
    upper: Optional[ArrayLike] = None,
    *,
    z0: Optional[ArrayLike] = None,
    method: LcpMethod = "auto",
    tol: float = 1e-10,
    max_iterations: Optional[int] = None,
    time_limit: Optional[float] = None,
    monitor: Optional[Monitor] = None,
    relaxation: float = 1.0,
    pivot_rule: PivotRule = "harris",
    scaling: bool = True,
    polish: bool = True,
    crash: bool = True,
    sweep: Sweep = "forward",
    acceleration: AccelerationMethod = "none",
    penalty: float = 0.0,
) -> LcpResult:
    """Finds z in [lower, upper] with w = M z + q such that, for every i, w[i] >= 0 where z[i] is
    at its lower bound, w[i] <= 0 at its upper bound, and w[i] = 0 between.

    M: (n, n), any array, or a SciPy sparse matrix. Arrays of float64 that are contiguous along
        one axis, and canonical CSC matrices, are read in place.
    q: (n,).
    lower, upper: (n,), or a number for all; None is 0 and +inf. Infinite bounds are allowed.
    z0: (n,), a start (pgs, fischer) or a guess of the solution that is tried first (lemke).
    method: "auto", "lemke", "pgs" (needs a positive diagonal), "fischer" or "active_set".
    tol: the residual (dimensionless) that counts as solved.
    max_iterations, time_limit (seconds): None is the method's own limit, and none.
    monitor: called with an object that has method, iterations and residual as the solve goes on;
        a true answer stops it (outcome "stopped"), an exception ends the call.
    relaxation: of pgs, in (0, 2).  pivot_rule: of lemke, "harris" or "lexicographic".
    scaling: equilibrate M by powers of two.  polish: re-solve the final active set.
    crash: of lemke, start from a basis found by active sets where that pays.
    sweep: of pgs, "forward" or "symmetric".  acceleration: of pgs, "none" or "conjugate_gradient".
    penalty: of fischer, the weight of max(a,0) max(b,0), in [0, 1); 0 is the plain function.

    Returns an LcpResult: check its `ok` or its `outcome`. Raises Error where the call itself did
    not make sense; ValueError catches bad arguments.
    """
    idle = _pool.idle
    call = idle.pop() if idle else _Call()
    watch = None
    try:
        given = (
            *(method, tol, max_iterations, time_limit, relaxation, pivot_rule, scaling, polish),
            *(crash, sweep, acceleration, penalty),
        )
        if call.filled is None or any(map(is_not, given, call.filled)):
            call.filled = None
            fill(call.settings, _CODES, **dict(zip(_SETTINGS, given)))
            if all(type(value) in _UNCHANGING for value in given):
                call.filled = given
        n, entries, owner = _arrays.view(call.matrix, M)
        offset = _arrays.vector(q, "q", n)
        low = _arrays.bound(lower, "lower", n)
        high = _arrays.bound(upper, "upper", n)
        start = None if z0 is None else _arrays.vector(z0, "z0", n)
        z, w, ray = np.empty(n), np.empty(n), np.empty(n)
        if needs_watch(monitor, entries, call.settings.max_iterations):
            watch = Watch(monitor)
            call.settings.monitor = watch.function
        result, settings, problem = call.references
        address, posed = _arrays.address, call.problem
        posed.q = address(offset)
        posed.lower = None if low is None else address(low)
        posed.upper = None if high is None else address(high)
        status = library.perp_lcp_solve(
            call.context.pointer,
            address(z),
            address(w),
            address(ray),
            result,
            settings,
            problem,
            None if start is None else address(start),
        )
        if watch is not None:
            watch.raise_caught()
        if status:
            call.context.check(status)
        del owner  # the view of M was used up to here
        return read_answer(call.result, z, w, ray).watched(monitor)
    finally:
        if watch is not None:
            call.settings.monitor = _NO_MONITOR
        idle.append(call)


class LCP(Handle):
    """A problem to be solved for many q: checks, scaling and workspace are set up once.

        with perp.LCP(M, lower=-1.0, upper=1.0, method="pgs") as problem:
            result = problem.solve(q)
            result = problem.solve(another_q, z0=result.z)

    The arguments are those of lcp(). An M that needs no conversion is read in place, here and at
    every solve: call setup() again after changing its values.
    """

    _create = library.perp_lcp_solver_create
    _destroy = library.perp_lcp_solver_destroy
    _pointer_type = LcpSolverPointer

    def __init__(
        self,
        M: Any,
        lower: Optional[ArrayLike] = None,
        upper: Optional[ArrayLike] = None,
        *,
        method: LcpMethod = "auto",
        tol: float = 1e-10,
        max_iterations: Optional[int] = None,
        time_limit: Optional[float] = None,
        monitor: Optional[Monitor] = None,
        relaxation: float = 1.0,
        pivot_rule: PivotRule = "harris",
        scaling: bool = True,
        polish: bool = True,
        crash: bool = True,
        sweep: Sweep = "forward",
        acceleration: AccelerationMethod = "none",
        penalty: float = 0.0,
    ) -> None:
        self._settings = sized(LcpSettings)
        self._result = sized(CResult)
        self._reference = byref(self._result)
        fill(
            self._settings, _CODES, method=method, tol=tol, max_iterations=max_iterations,
            time_limit=time_limit, relaxation=relaxation, pivot_rule=pivot_rule, scaling=scaling,
            polish=polish, crash=crash, sweep=sweep, acceleration=acceleration, penalty=penalty,
        )  # fmt: skip
        self._monitor = monitor
        self._watch = Watch(monitor)
        self._watched = False
        super().__init__(byref(self._settings))
        self.setup(M, lower, upper)

    def setup(
        self,
        M: Any,
        lower: Optional[ArrayLike] = None,
        upper: Optional[ArrayLike] = None,
    ) -> None:
        """Replaces the problem, or takes note that values of M have changed. After an exception
        the solver has the problem it had."""
        matrix = sized(Matrix)
        n, entries, owner = _arrays.view(matrix, M)
        low = _arrays.bound(lower, "lower", n)
        high = _arrays.bound(upper, "upper", n)
        with self._lock:
            self._call(
                library.perp_lcp_solver_setup,
                byref(matrix),
                _arrays.optional(low),
                _arrays.optional(high),
            )
            self._n, self._entries, self._owner = n, entries, owner

    def solve(self, q: ArrayLike, z0: Optional[ArrayLike] = None) -> LcpResult:
        """Solves the problem for one q, from z0 if given."""
        with self._lock:
            n = self._n
            offset = _arrays.vector(q, "q", n)
            start = None if z0 is None else _arrays.vector(z0, "z0", n)
            z, w, ray = np.empty(n), np.empty(n), np.empty(n)
            self._set_watch()
            status = library.perp_lcp_solver_solve(
                self._alive(),
                _arrays.address(z),
                _arrays.address(w),
                _arrays.address(ray),
                self._reference,
                _arrays.address(offset),
                _arrays.optional(start),
            )
            self._watch.raise_caught()
            if status:
                self._context.check(status)
            return read_answer(self._result, z, w, ray).watched(self._monitor)

    def _set_watch(self) -> None:
        """Has the library call the watch if this solve, on this thread, needs it."""
        needed = needs_watch(self._monitor, self._entries, self._settings.max_iterations)
        if needed != self._watched:
            self._settings.monitor = self._watch.function if needed else _NO_MONITOR
            self._call(library.perp_lcp_solver_set, byref(self._settings))
            self._watched = needed
