"""Nonlinear complementarity problems with bounds."""

from __future__ import annotations

from ctypes import byref
from dataclasses import dataclass
from typing import Any, Callable, Optional, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _arrays, _errors, _plot
from ._answer import Shown, SolverAnswer, maker
from ._callbacks import Callbacks
from ._generated import (
    NcpCheck,
    NcpFunction,
    NcpJacobian,
    NcpMethod,
    NcpMonitor,
    NcpProblem,
    NcpSettings,
    NcpSolverPointer,
    Outcome,
)
from ._generated import NcpResult as CResult
from ._handle import Context, Handle
from ._library import NCP_METHODS, library
from ._monitor import Monitor, Watch
from ._settings import fill, numbers
from ._structures import sized

Array = NDArray[np.float64]

_CODES = {"method": numbers(NCP_METHODS)}
_NO_JACOBIAN = NcpJacobian()


@dataclass(eq=False)
class NcpResult(SolverAnswer):
    """The answer to one problem. See ncp() for what was asked."""

    z: Array  # within the bounds; the best iterate, whatever the outcome
    w: Array  # F(z)
    outcome: Outcome  # "solved", "rounding_limit", "stalled", "iteration_limit", ...
    ok: bool  # solved, or as near as a double can come
    residual: float  # dimensionless, the one compared with tol
    natural_residual: float  # max |mid(z - lower, z - upper, w)|, in the caller's units
    backward_error: float  # row-wise, of the linearisation at z; 2**-52 is one unit
    iterations: int  # Newton steps, all runs together
    seconds: float
    method: str  # the method that gave the answer
    function_evaluations: int  # calls of F, those for differences included
    jacobian_evaluations: int
    restarts: int  # starts from perturbed points
    trapped: bool  # z is no solution, but a stationary point of the merit function

    def __repr__(self) -> str:
        return (
            f"<perp.NcpResult {self.outcome} by {self.method}, n={len(self.z)}, "
            f"residual={self.residual:.2g}, iterations={self.iterations}>"
        )

    @property
    def message(self) -> str:
        """The outcome in a sentence; where it is not good, also what was tried and how near it came."""
        if self.ok:
            return super().message
        place = "a stationary point of the merit function" if self.trapped else "the best point"
        return (
            f"{super().message}; tried: {self.iterations} iterations from {self.restarts + 1} start"
            f"{'s' * (self.restarts > 0)}, {self.function_evaluations} calls of F; z is {place}, "
            f"with a natural residual of {self.natural_residual:.2g}"
        )

    @property
    def nfev(self) -> int:
        """`function_evaluations`, by SciPy's name."""
        return self.function_evaluations

    @property
    def njev(self) -> int:
        """`jacobian_evaluations`, by SciPy's name."""
        return self.jacobian_evaluations

    def _pictures(self) -> list[Any]:
        return [(_plot.complements, (self.z, self.w))]


@dataclass(eq=False)
class JacobianCheck(Shown):
    """How a Jacobian compares with differences of F."""

    ok: bool  # nothing wrong, nothing missing, every column checked
    wrong: int  # entries that differ by more than differences can be wrong
    missing: int  # entries not in the sparse pattern whose difference isn't 0
    entry: Optional[tuple[int, int]]  # row and column with the worst disagreement,
    given: float  # J's value there,
    difference: float  # the value by differences,
    uncertainty: float  # and the estimated error of that
    missing_entry: Optional[tuple[int, int]]  # the missing entry with the largest difference
    missing_difference: float
    unchecked: int  # columns of fixed variables, or next to which F is not defined

    def __bool__(self) -> bool:
        return self.ok


class _Callbacks(Callbacks):
    """F and J as the library calls them. What they raise is kept, and ends the call."""

    def __init__(self, F: Any, J: Any, start: Array, pattern: Any) -> None:
        if not callable(F):
            raise _errors.argument_error("F is not callable")
        if J is not None and not callable(J):
            raise _errors.argument_error("J is neither callable nor None")
        super().__init__()
        self._F, self._J, self._n = F, J, len(start)
        self.problem = sized(NcpProblem)
        self.problem.n = self._n
        self._choose_storage(start, pattern)
        self._function = NcpFunction(self._call_function)
        self._jacobian = _NO_JACOBIAN if J is None else NcpJacobian(self._call_jacobian)
        self.problem.function, self.problem.jacobian = self._function, self._jacobian

    def _choose_storage(self, start: Array, pattern: Any) -> None:
        """Dense, or the pattern given, or the one that J has at the start."""
        first = None if self._J is None or pattern is not None else self._J(start.copy())
        self._starts: Optional[NDArray[Any]] = None
        self._rows: Optional[NDArray[Any]] = None
        if pattern is None and not _arrays.is_sparse(first):
            self.problem.storage = _arrays.ROW_MAJOR
            self._entries = self._n * self._n
            return
        starts, rows = _pattern(first if pattern is None else pattern, self._n)
        self._starts, self._rows = starts, rows
        self._columns = np.repeat(np.arange(self._n), np.diff(starts))
        self._entries = len(rows)
        self.problem.storage = _arrays.CSC
        self.problem.column_starts = _arrays.address(starts)
        self.problem.row_indices = _arrays.address(rows)

    def _call_function(self, out: int, z: int, _: Any) -> int:
        return self.answer(self._F, "F(z)", out, z, self._n)

    def _call_jacobian(self, out: int, z: int, _: Any) -> int:
        try:
            if self.raised:
                return -1
            self._store(self._J(self.view(z, self._n).copy()), self.view(out, self._entries))
            return 0
        except BaseException as error:
            self.raised.append(error)
            return -1

    def _store(self, J: Any, out: Array) -> None:
        n = self._n
        if getattr(J, "shape", None) != (n, n):
            J = J if _arrays.is_sparse(J) else _arrays.real(J, "J(z)")
            if J.shape != (n, n):
                raise _errors.argument_error(f"J(z) has shape {J.shape}, expected ({n}, {n})")
        if self._rows is None:
            dense = J.toarray() if _arrays.is_sparse(J) else _arrays.real(J, "J(z)")
            out.reshape(n, n)[:] = dense
        elif not _arrays.is_sparse(J):
            dense = _arrays.real(J, "J(z)")
            out[:] = dense[self._rows, self._columns]
            if np.count_nonzero(dense) > np.count_nonzero(out):
                raise _errors.argument_error("J(z) has entries outside of the pattern")
        else:
            self._store_sparse(J, out)

    def _store_sparse(self, J: Any, out: Array) -> None:
        assert self._starts is not None and self._rows is not None
        csc = J.tocsc()
        if not csc.has_canonical_format:
            csc = csc.copy()
            csc.sum_duplicates()
        if np.array_equal(csc.indptr, self._starts) and np.array_equal(csc.indices, self._rows):
            out[:] = csc.data
            return
        # some of the pattern's entries were left out: find the others' places
        n = np.int64(self._n)
        columns = np.repeat(np.arange(self._n, dtype=np.int64), np.diff(csc.indptr))
        mine = self._columns * n + self._rows
        theirs = columns * n + csc.indices
        places = np.minimum(np.searchsorted(mine, theirs), max(len(mine) - 1, 0))
        out[:] = 0.0
        if len(theirs) and (len(mine) == 0 or not np.array_equal(mine[places], theirs)):
            lost = 0 if len(mine) == 0 else int(np.argmax(mine[places] != theirs))
            raise _errors.argument_error(
                f"J(z) has the entry ({int(csc.indices[lost])}, {int(columns[lost])}), which "
                "is not in the pattern: state it by pattern="
            )
        out[places] = csc.data


def _pattern(pattern: Any, n: int) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """Column starts and sorted row indices of what a matrix stores, or where an array isn't 0."""
    if not _arrays.is_sparse(pattern):
        array = np.asarray(pattern)
        if array.shape != (n, n):
            raise _errors.argument_error(f"pattern has shape {array.shape}, expected ({n}, {n})")
        columns, rows = np.nonzero(array.T)
        starts = np.searchsorted(columns, np.arange(n + 1))
        return starts.astype(np.int32), rows.astype(np.int32)
    if pattern.shape != (n, n):
        raise _errors.argument_error(f"pattern has shape {pattern.shape}, expected ({n}, {n})")
    csc = pattern.tocsc().copy()
    csc.sum_duplicates()  # sorts, too; zeros that are stored stay
    if int(csc.indptr[-1]) > _arrays.INT32_MAX:
        raise _errors.argument_error("pattern has more entries than a 32-bit index can number")
    return csc.indptr.astype(np.int32), csc.indices.astype(np.int32)


def _bounds(
    problem: NcpProblem, lower: Optional[ArrayLike], upper: Optional[ArrayLike], n: int
) -> tuple[Optional[Array], Optional[Array]]:
    low, high = _arrays.bound(lower, "lower", n), _arrays.bound(upper, "upper", n)
    problem.lower = _arrays.optional(low)
    problem.upper = _arrays.optional(high)
    return low, high


def _vector(value: ArrayLike, name: str) -> Array:
    array = _arrays.real(value, name)
    if array.ndim != 1:
        raise _errors.argument_error(f"{name} has shape {array.shape}, expected (n,)")
    return np.ascontiguousarray(array)


def _in_order(J: Any, z0: Any, jac: Any) -> tuple[Any, Any]:
    """J and z0, by whatever names and in whichever order they came."""
    if z0 is None and J is not None and not callable(J):
        J, z0 = None, J
    if jac is not None:
        if J is not None:
            raise _errors.argument_error("J and jac are the same thing: give one of them")
        J = jac
    if z0 is None:
        raise _errors.argument_error("z0 is missing: the start")
    return J, z0


_make = maker(NcpResult, CResult, method=NCP_METHODS)
_make_check = maker(JacobianCheck, NcpCheck)


class NCP(Handle):
    """A problem to be solved from many starts: checks, workspace and factors are kept, and every
    solve starts from the last solution.

        with perp.NCP(F, J, z0, lower, upper) as problem:
            result = problem.solve()      # from z0, the first time
            result = problem.solve()      # F and J may have changed: from result.z

    The arguments are those of ncp(). F and J are called anew at every solve; what depends on more
    than z they find where the caller has put it.
    """

    _create = library.perp_ncp_solver_create
    _destroy = library.perp_ncp_solver_destroy
    _pointer_type = NcpSolverPointer

    def __init__(
        self,
        F: Callable[[Array], ArrayLike],
        J: Union[Callable[[Array], Any], ArrayLike, None] = None,
        z0: Optional[ArrayLike] = None,
        lower: Optional[ArrayLike] = None,
        upper: Optional[ArrayLike] = None,
        *,
        jac: Optional[Callable[[Array], Any]] = None,
        method: NcpMethod = "auto",
        tol: float = 1e-10,
        max_iterations: Optional[int] = None,
        time_limit: Optional[float] = None,
        monitor: Optional[Monitor] = None,
        pattern: Any = None,
        penalty: float = 0.1,
        restarts: int = 20,
        scaling: bool = True,
        polish: bool = True,
    ) -> None:
        J, z0 = _in_order(J, z0, jac)
        settings = sized(NcpSettings)
        fill(
            settings, _CODES, method=method, tol=tol, max_iterations=max_iterations,
            time_limit=time_limit, penalty=penalty, restarts=restarts, scaling=scaling,
            polish=polish,
        )  # fmt: skip
        self._start = _vector(z0, "z0")
        self._n = n = len(self._start)
        low, high = _arrays.bound(lower, "lower", n), _arrays.bound(upper, "upper", n)
        projected = np.minimum(
            np.maximum(self._start, 0.0 if low is None else low), np.inf if high is None else high
        )
        self._callbacks = _Callbacks(F, J, projected, pattern)
        self._bounds = _bounds(self._callbacks.problem, low, high, n)
        self._monitor = monitor
        self._watch = Watch(monitor, NcpMonitor, NCP_METHODS)
        if monitor is not None:
            settings.monitor = self._watch.function
        super().__init__(byref(settings))
        with self._callbacks.catching():
            status = library.perp_ncp_solver_setup(self._pointer, byref(self._callbacks.problem))
        self._check(status)

    def _check(self, status: int) -> None:
        self._callbacks.raise_caught()
        self._watch.raise_caught()
        if status:
            self._context.check(status)

    def solve(self, z0: Optional[ArrayLike] = None) -> NcpResult:
        """Solves the problem from z0; None is the last solution that was ok, else the first z0."""
        with self._lock:
            n, result = self._n, sized(CResult)
            start = self._start if z0 is None else _arrays.vector(z0, "z0", n)
            z, w = np.empty(n), np.empty(n)
            with self._callbacks.catching():
                status = library.perp_ncp_solver_solve(
                    self._alive(),
                    _arrays.address(z),
                    _arrays.address(w),
                    byref(result),
                    _arrays.address(start),
                )
            self._check(status)
            answer = _make(result, z=z, w=w)
            if answer.ok:
                self._start = z.copy()
            return answer.watched(self._monitor)


def ncp(
    F: Callable[[Array], ArrayLike],
    J: Union[Callable[[Array], Any], ArrayLike, None] = None,
    z0: Optional[ArrayLike] = None,
    lower: Optional[ArrayLike] = None,
    upper: Optional[ArrayLike] = None,
    *,
    jac: Optional[Callable[[Array], Any]] = None,
    method: NcpMethod = "auto",
    tol: float = 1e-10,
    max_iterations: Optional[int] = None,
    time_limit: Optional[float] = None,
    monitor: Optional[Monitor] = None,
    pattern: Any = None,
    penalty: float = 0.1,
    restarts: int = 20,
    scaling: bool = True,
    polish: bool = True,
) -> NcpResult:
    """Finds z in [lower, upper] with w = F(z) such that, for every i, w[i] >= 0 where z[i] is at
    its lower bound, w[i] <= 0 at its upper bound, and w[i] = 0 between.

    F: a function of an (n,) array that returns one. NaN or infinity says that z is outside of its
        domain; it is only called within the bounds.
    J: its Jacobian, dF_i/dz_j at row i and column j: returns an (n, n) array or a SciPy sparse
        matrix. None: finite differences, few calls of F where pattern is sparse. It may also be
        left out, or come as jac=, in SciPy's order: ncp(F, z0, jac=J).
    z0: (n,), the start.
    lower, upper: (n,), or a number for all; None is 0 and +inf. Infinite bounds are allowed.
    method: "auto", "fischer" or "josephy".
    tol: the residual (dimensionless) that counts as solved.
    max_iterations (of the call), time_limit (seconds): None is 200 (fischer under
        auto: 100), and none.
    monitor: called with an object that has method, iterations and residual as the solve goes on;
        a true answer stops it (outcome "stopped"), an exception ends the call.
    pattern: a sparse matrix, or an array, that is not 0 where J ever is; by default that of J(z0).
    penalty: of fischer, the weight of max(a,0) max(b,0), in [0, 1); 0 is the plain function.
    restarts: of auto, at most so many starts from perturbed points.
    scaling: equilibrate by powers of two.  polish: go on to the limit of rounding.

    Returns an NcpResult: check its `ok` or its `outcome`. Exceptions raised in F and J come out of
    the call. Raises Error where the call itself did not make sense.
    """
    with NCP(
        F, J, z0, lower, upper, jac=jac, method=method, tol=tol, max_iterations=max_iterations,
        time_limit=time_limit, monitor=monitor, pattern=pattern, penalty=penalty,
        restarts=restarts, scaling=scaling, polish=polish,
    ) as problem:  # fmt: skip
        return problem.solve()


def ncp_check_jacobian(
    F: Callable[[Array], ArrayLike],
    J: Callable[[Array], Any],
    z: ArrayLike,
    lower: Optional[ArrayLike] = None,
    upper: Optional[ArrayLike] = None,
    *,
    pattern: Any = None,
) -> JacobianCheck:
    """Compares J at z with central differences of F that tell their own error. The arguments are
    those of ncp(); z has to be within the bounds. Returns a JacobianCheck that names the worst
    entry, and the worst one that a sparse pattern lacks."""
    point = _vector(z, "z")
    if J is None:
        raise _errors.argument_error("J is None: there is nothing to check")
    callbacks = _Callbacks(F, J, point, pattern)
    low, high = _bounds(callbacks.problem, lower, upper, len(point))
    check = sized(NcpCheck)
    context = Context()
    with callbacks.catching():
        status = library.perp_ncp_check_jacobian(
            context.pointer, byref(check), byref(callbacks.problem), _arrays.address(point)
        )
    callbacks.raise_caught()
    context.check(status)
    del low, high
    return _make_check(
        check,
        ok=check.wrong == check.missing == check.unchecked == 0,
        entry=None if check.row < 0 else (check.row, check.column),
        missing_entry=None if check.missing_row < 0 else (check.missing_row, check.missing_column),
    )
