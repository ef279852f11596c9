"""Contact with Coulomb friction over somebody else's dynamics."""

from __future__ import annotations

from collections.abc import Sequence
from ctypes import byref, pointer, sizeof
from dataclasses import dataclass
from typing import Any, Callable, Optional, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _arrays, _errors, _plot
from ._answer import SolverAnswer, maker
from ._callbacks import Array, Callbacks
from ._generated import (
    ContactAnswer,
    ContactDynamics,
    ContactLaws,
    ContactMassSolve,
    ContactMethod,
    ContactMonitor,
    ContactProblem,
    ContactSettings,
    ContactSolverPointer,
    Matrix,
    Outcome,
)
from ._generated import ContactResult as CResult
from ._handle import Context, Handle
from ._library import CONTACT_METHODS, MODES, library
from ._monitor import Monitor, Watch, needs_watch
from ._settings import fill, numbers
from ._structures import sized

CODES = {"method": numbers(CONTACT_METHODS)}
_NO_MONITOR, _NO_SOLVE = ContactMonitor(), ContactMassSolve()
_MODE_WORDS = np.array([MODES[k] for k in range(len(MODES))])


@dataclass(eq=False)
class ContactResult(SolverAnswer):
    """The answer to one problem of contacts. See contact() for what was asked.

    signorini, cone, dissipation and bilateral_residual are the largest violations of each law;
    those with _impulse are the same in units of impulse.
    """

    v: Optional[Array]  # velocities after the impulses; None from contact_delassus()
    impulse: Array  # a row of H each; 0.0 where a contact separates
    velocity: Array  # u, as impulse; 0.0 where a contact sticks
    bilateral_impulse: Array  # s, a row of G each
    modes: NDArray[np.str_]  # a contact each: "separate", "stick" or "slip"; then a row with bounds
    # of its own each: "lower", "stick" (u = 0) or "upper"
    outcome: Outcome  # "solved", "rounding_limit", "ray", "iteration_limit", ...
    ok: bool  # solved, or as near as a double can come
    residual: float  # dimensionless, the one compared with tol
    natural_residual: float  # an impulse
    backward_error: float  # by contact; 2**-52 is one unit
    signorini: float  # a velocity
    signorini_impulse: float
    cone: float  # an impulse
    dissipation: float  # a velocity
    dissipation_impulse: float
    bilateral_residual: float  # a velocity
    iterations: int
    seconds: float
    method: str  # the method that gave the answer
    ray: Optional[Array]  # a direction of impulses, bilateral ones last, if one was verified
    certificate: Optional[str]  # "infeasible" if the ray proves that no velocities are possible
    dims: NDArray[np.int32]  # a contact each: rows of normal and tangents
    starts: NDArray[np.int64]  # a contact each: its normal row
    mu: Array  # a contact each
    two_sided: NDArray[np.int32]  # a contact each: normals that hold both ways

    def __repr__(self) -> str:
        return (
            f"<perp.ContactResult {self.outcome} by {self.method}, {len(self.dims)} contacts, "
            f"residual={self.residual:.2g}, iterations={self.iterations}>"
        )

    def _pictures(self) -> list[Any]:
        normal, friction = self.impulse[self.starts], np.zeros(len(self.dims))
        for row in range(1, 5):
            there = self.dims > row
            normals = there & (self.two_sided > row)
            normal[normals] = np.hypot(normal[normals], self.impulse[self.starts[normals] + row])
            there &= ~normals
            friction[there] = np.hypot(friction[there], self.impulse[self.starts[there] + row])
        normal = np.where(self.two_sided > 0, np.abs(normal), normal)
        modes = self.modes[: len(self.dims)]
        cone = normal, friction, self.mu * normal, modes
        return [(_plot.impulses, (normal, modes)), (_plot.cones, cone)]


def _pair(value: Any, name: str, expected: str) -> Any:
    try:
        first, second = value
    except (TypeError, ValueError):
        raise _errors.argument_error(f"{name} is no pair, expected {expected}") from None
    return first, second


def _bounds(
    bounds: Optional[tuple[ArrayLike, ArrayLike]], rows: int
) -> tuple[Optional[Array], Optional[Array], int]:
    """Both bounds, and how many rows have them: as many as there are lower ones."""
    if bounds is None:
        return None, None, 0
    low, high = (_arrays.real(x, "bounds") for x in _pair(bounds, "bounds", "(lower, upper)"))
    if low.ndim != 1 or len(low) > rows:
        raise _errors.argument_error(
            f"bounds[0] has shape {low.shape}, but H has {rows} rows"
        )
    return np.ascontiguousarray(low), _arrays.bound(high, "bounds[1]", len(low)), len(low)


class _Laws:
    """The contacts as the library takes them, with the arrays that they live in."""

    def __init__(
        self,
        rows: int,
        mu: Optional[ArrayLike],
        dim: Union[int, ArrayLike],
        rolling: Optional[ArrayLike],
        spinning: Optional[ArrayLike],
        bounds: Optional[tuple[ArrayLike, ArrayLike]],
        two_sided: Optional[ArrayLike],
    ) -> None:
        low, high, self.bounded = _bounds(bounds, rows)
        self.rows = rows
        rows -= self.bounded
        if mu is None:
            raise _errors.argument_error("mu is missing: the coefficients of friction")
        dims = np.asarray(dim)
        both = np.asarray(0 if two_sided is None else two_sided)
        dims, both = (x if x.size else x.astype(np.int32) for x in (dims, both))  # [] is of floats
        if both.dtype.kind not in "iu" or both.ndim > 1:
            raise _errors.argument_error(
                f"two_sided is {two_sided!r}, expected 0, 1, 2 or 3, or one a contact"
            )
        most = 3 + 2 * bool(both.any())
        if dims.dtype.kind not in "iu" or dims.ndim > 1 or not ((dims >= 1) & (dims <= most)).all():
            raise _errors.argument_error(f"dim is {dim!r}, expected 1, 2 or 3, or one a contact")
        given = {"mu": mu, "rolling": rolling, "spinning": spinning}
        arrays = {name: _arrays.real(x, name) for name, x in given.items() if x is not None}
        self.contacts = self._contacts(rows, dims, {**arrays, "two_sided": both})
        self.dims = np.full(self.contacts, dims, dtype=np.int32) if dims.ndim == 0 else dims
        self.dims = np.ascontiguousarray(self.dims, dtype=np.int32)
        self.coefficients = {
            name: _arrays.spread(x, name, self.contacts) for name, x in arrays.items()
        }
        self.two_sided = np.zeros(self.contacts, dtype=np.int32)
        self.two_sided[:] = both
        self.struct = sized(ContactLaws)
        self.struct.contacts = self.contacts
        self.struct.dim = 3
        self.struct.dims = _arrays.address(self.dims)
        if both.any():
            self.struct.two_sided = _arrays.address(self.two_sided)
        self.struct.bounded = self.bounded
        self.bounds = low, high
        self.struct.lower, self.struct.upper = _arrays.optional(low), _arrays.optional(high)
        for name, array in self.coefficients.items():
            setattr(self.struct, name, _arrays.address(array))
        alike = dims.ndim == 0 and len(arrays) == 1  # without rolling and spinning
        self.starts = np.arange(self.contacts) * int(dims) if alike else self._starts()

    @staticmethod
    def _contacts(rows: int, dims: NDArray[Any], arrays: dict[str, Array]) -> int:
        """From whatever comes one a contact, else from the rows of each contact."""
        lengths = {name: len(x) for name, x in arrays.items() if x.ndim == 1}
        if dims.ndim == 1:
            lengths["dim"] = len(dims)
        if lengths:
            name, length = next(iter(lengths.items()))
            for other, found in lengths.items():
                if found != length:
                    raise _errors.argument_error(
                        f"{other} has {found} entries, but {name} has {length}"
                    )
            return length
        dim = int(dims)
        each = dim + (dim - 1) * bool(arrays.get("rolling", 0) > 0) + bool(
            arrays.get("spinning", 0) > 0
        )
        if rows % each:
            raise _errors.argument_error(f"{rows} rows are no contacts of {each} rows")
        return rows // each

    def _starts(self) -> NDArray[np.int64]:
        """The row of each contact's normal."""
        rows = self.dims.astype(np.int64)
        rolling, spinning = (self.coefficients.get(name) for name in ("rolling", "spinning"))
        if rolling is not None:
            rows += (self.dims - 1) * (rolling > 0)
        if spinning is not None:
            rows += spinning > 0
        return np.cumsum(rows) - rows

    compliance: Optional[Array] = None

    def comply(self, compliance: Optional[ArrayLike], size: int) -> None:
        self.compliance = _arrays.bound(compliance, "compliance", size)
        if self.compliance is not None:
            self.struct.compliance = _arrays.address(self.compliance)


class _MassSolve(Callbacks):
    """The caller's solve as a callback for the library, which keeps what was raised inside."""

    def __init__(self, solve: Callable[[Array], ArrayLike], n: int) -> None:
        super().__init__()
        self._solve, self._n = solve, n
        self.function = ContactMassSolve(self._call)

    def _call(self, x: int, columns: int, _: Any) -> int:
        try:
            # entry i of right-hand side j at x[j n + i]
            block = self.view(x, columns * self._n).reshape(columns, self._n).T
            answer = _arrays.real(self._solve(block.copy()), "M(x)")
            if answer.shape != block.shape:
                raise _errors.argument_error(
                    f"M(x) has shape {answer.shape}, expected {block.shape}"
                )
            block[:] = answer
            return 0
        except BaseException as error:
            self.raised.append(error)
            return 1


_make = maker(ContactResult, CResult, method=CONTACT_METHODS)


def _to(
    v: Optional[Array], r: Array, u: Array, modes: NDArray[np.int32], ray: Array
) -> ContactAnswer:
    """Where an answer goes; the arrays have to outlive it."""
    return ContactAnswer(sizeof(ContactAnswer), *map(_arrays.optional, (v, r, u, modes, ray)))


def _answer(
    laws: _Laws,
    rows: int,
    v: Optional[Array],
    buffers: Any,
    modes: NDArray[Any],
    result: CResult,
) -> ContactResult:
    r, u, ray = buffers
    return _make(
        result,
        v=v,
        impulse=r[:rows],
        velocity=u[:rows],
        bilateral_impulse=r[rows:],
        modes=_MODE_WORDS[modes],
        signorini=result.signorini_velocity,
        dissipation=result.dissipation_velocity,
        bilateral_residual=result.bilateral,
        ray=ray if result.has_ray else None,
        dims=laws.dims,
        starts=laws.starts,
        mu=laws.coefficients["mu"],
        two_sided=laws.two_sided,
    )


def _watch(monitor: Optional[Monitor], entries: int, settings: ContactSettings) -> Optional[Watch]:
    if not needs_watch(monitor, entries, settings.max_iterations):
        return None
    watch = Watch(monitor, ContactMonitor, CONTACT_METHODS)
    settings.monitor = watch.function
    return watch


class _Problem:
    """Contacts and dynamics as the library takes them, with the arrays that they live in."""

    def __init__(self) -> None:
        self.dynamics = sized(ContactDynamics)
        self._views = sized(Matrix), sized(Matrix), sized(Matrix)
        self.mass: Optional[_MassSolve] = None
        self._laws: Optional[_Laws] = None

    def read(
        self,
        M: Any,
        H: Any,
        mu: Optional[ArrayLike],
        dim: Union[int, Sequence[int], NDArray[Any]],
        bilateral: Any,
        bounds: Optional[tuple[ArrayLike, ArrayLike]],
        compliance: Optional[ArrayLike],
        rolling: Optional[ArrayLike],
        spinning: Optional[ArrayLike],
        two_sided: Optional[ArrayLike],
    ) -> None:
        """mu None: with the laws as they are, of as many rows."""
        M_view, H_view, G_view = self._views
        dynamics, owners = self.dynamics, []
        self.entries, owner = _arrays.view_rectangle(H_view, H, "H")
        owners.append(owner)
        self.rows, self.n = H_view.rows, H_view.columns
        laws = self._laws
        keeps = mu is None and laws is not None and laws.rows == self.rows
        if laws is None or not keeps:
            laws = _Laws(self.rows, mu, dim, rolling, spinning, bounds, two_sided)
        dynamics.H = pointer(H_view)
        dynamics.G = None
        self.size = self.rows
        if bilateral is not None:
            owners.append(_arrays.view_rectangle(G_view, bilateral, "G")[1])
            dynamics.G = pointer(G_view)
            self.size += G_view.rows
        laws.comply(laws.compliance if keeps else compliance, self.size)
        dynamics.M, dynamics.solve, self.mass = None, _NO_SOLVE, None
        if callable(M) and not _arrays.is_sparse(M):
            self.mass = _MassSolve(M, self.n)
            dynamics.solve = self.mass.function
        else:
            owners.append(_arrays.view_rectangle(M_view, M, "M")[1])
            dynamics.M = pointer(M_view)
        dynamics.n = self.n
        self._laws, self._owners = laws, owners

    @property
    def laws(self) -> _Laws:
        assert self._laws is not None
        return self._laws

    def raise_caught(self) -> None:
        if self.mass is not None:
            self.mass.raise_caught()


class ContactSolver(Handle):
    """Contacts over somebody else's dynamics, to be solved for many f and w: checks, factors and
    workspace are set up once, and every solve starts from the last solution.

        with perp.ContactSolver(M, H, mu, bilateral=G, bounds=(lower, upper)) as solver:
            result = solver.solve(f, w, b)

    The arguments are those of contact(), but that bilateral is G alone. Matrices that need no
    conversion are read in place, here and at every solve: call setup() again after changing their
    values or their number of rows. It costs no memory where sizes stay.
    """

    _create = library.perp_contact_solver_create
    _destroy = library.perp_contact_solver_destroy
    _pointer_type = ContactSolverPointer

    def __init__(
        self,
        M: Any,
        H: Any,
        mu: Optional[ArrayLike],
        *,
        dim: Union[int, Sequence[int], NDArray[Any]] = 3,
        cone: Union[str, int] = "exact",
        bilateral: Any = None,
        bounds: Optional[tuple[ArrayLike, ArrayLike]] = None,
        compliance: Optional[ArrayLike] = None,
        rolling: Optional[ArrayLike] = None,
        spinning: Optional[ArrayLike] = None,
        two_sided: Optional[ArrayLike] = None,
        method: ContactMethod = "auto",
        tol: float = 1e-8,
        max_iterations: Optional[int] = None,
        time_limit: Optional[float] = None,
        monitor: Optional[Monitor] = None,
    ) -> None:
        self._settings = sized(ContactSettings)
        fill(
            self._settings, CODES, method=method, cone=cone, tol=tol, max_iterations=max_iterations,
            time_limit=time_limit,
        )  # fmt: skip
        self._monitor = monitor
        self._watch = Watch(monitor, ContactMonitor, CONTACT_METHODS)
        self._watched = False
        self._problem, self._result = _Problem(), sized(CResult)
        self._size, self._last = -1, None  # type: int, Optional[Array]
        super().__init__(byref(self._settings))
        self.setup(
            M, H, mu, dim=dim, bilateral=bilateral, bounds=bounds, compliance=compliance,
            rolling=rolling, spinning=spinning, two_sided=two_sided,
        )  # fmt: skip

    def setup(
        self,
        M: Any,
        H: Any,
        mu: Optional[ArrayLike] = None,
        *,
        dim: Union[int, Sequence[int], NDArray[Any]] = 3,
        bilateral: Any = None,
        bounds: Optional[tuple[ArrayLike, ArrayLike]] = None,
        compliance: Optional[ArrayLike] = None,
        rolling: Optional[ArrayLike] = None,
        spinning: Optional[ArrayLike] = None,
        two_sided: Optional[ArrayLike] = None,
    ) -> None:
        """Replaces the problem, or takes note that values have changed. setup(M, H, bilateral=G),
        without mu, has contacts, coefficients, bounds and compliance stay: M, H and G are new, with
        as many rows. After an exception the solver has no problem."""
        problem = self._problem
        with self._lock:
            size, self._size = self._size, -1
            problem.read(
                M, H, mu, dim, bilateral, bounds, compliance, rolling, spinning, two_sided
            )
            status = library.perp_contact_solver_setup_dynamics(
                self._alive(), byref(problem.laws.struct), byref(problem.dynamics)
            )
            self._check(status)
            self._n, self._rows, self._size = problem.n, problem.rows, problem.size
            self._laws = problem.laws
            if size != self._size:
                self._last = None
            self._entries = problem.entries * max(problem.rows, 1)

    def _check(self, status: int) -> None:
        self._watch.raise_caught()
        self._problem.raise_caught()
        if status:
            self._context.check(status)

    def solve(
        self,
        f: ArrayLike,
        w: Optional[ArrayLike] = None,
        b: Optional[ArrayLike] = None,
        r0: Optional[ArrayLike] = None,
    ) -> ContactResult:
        """Solves the problem for one f, w and b (None: 0), from r0: (rows of H, then of G), or 0.0
        for no impulses at all; None is the last solution, if that was ok and of as many rows.
        Returns a ContactResult."""
        with self._lock:
            n, rows, size = self._n, self._rows, self._size
            if size < 0:
                raise _errors.argument_error("the solver has no problem: setup() failed")
            load = _arrays.vector(f, "f", n)
            offset = np.zeros(rows) if w is None else _arrays.vector(w, "w", rows)
            joints = None if b is None else _arrays.vector(b, "b", size - rows)
            start = self._last if r0 is None else _arrays.bound(r0, "r0", size)
            v, r, u, ray = np.empty(n), np.empty(size), np.empty(size), np.empty(size)
            modes = np.empty(self._laws.contacts + self._laws.bounded, dtype=np.int32)
            result, address = self._result, _arrays.address
            self._set_watch()
            status = library.perp_contact_solver_solve_dynamics(
                self._alive(),
                byref(_to(v, r, u, modes, ray)),
                byref(result),
                address(load),
                address(offset),
                _arrays.optional(joints),
                _arrays.optional(start),
            )
            self._check(status)
            answer = _answer(self._laws, rows, v, (r, u, ray), modes, result)
            self._last = r if answer.ok else None
            return answer.watched(self._monitor)

    def _set_watch(self) -> None:
        """Has the library call the watch if this solve, on this thread, needs it."""
        needed = needs_watch(self._monitor, self._entries, self._settings.max_iterations)
        if needed != self._watched:
            self._settings.monitor = self._watch.function if needed else _NO_MONITOR
            self._call(library.perp_contact_solver_set, byref(self._settings))
            self._watched = needed


def contact(
    M: Any,
    f: ArrayLike,
    H: Any,
    w: Optional[ArrayLike] = None,
    mu: Optional[ArrayLike] = None,
    *,
    dim: Union[int, Sequence[int], NDArray[Any]] = 3,
    cone: Union[str, int] = "exact",
    bilateral: Optional[tuple[Any, ArrayLike]] = None,
    bounds: Optional[tuple[ArrayLike, ArrayLike]] = None,
    compliance: Optional[ArrayLike] = None,
    rolling: Optional[ArrayLike] = None,
    spinning: Optional[ArrayLike] = None,
    two_sided: Optional[ArrayLike] = None,
    r0: Optional[ArrayLike] = None,
    method: ContactMethod = "auto",
    tol: float = 1e-8,
    max_iterations: Optional[int] = None,
    time_limit: Optional[float] = None,
    monitor: Optional[Monitor] = None,
) -> ContactResult:
    """Finds the impulses r of contacts with Coulomb friction, s of joints and the velocities v:

        M v = f + H.T r + G.T s,   u = H v + w,   0 = G v + b

    with 0 <= r_n perpendicular to u_n >= 0 for each contact, and friction |r_t| <= mu r_n that
    opposes u_t. Rows of H, contact after contact: normal (u_n > 0 opens), tangents (dim - 1), then
    rolling rows (dim - 1) where rolling > 0, and a spinning row where spinning > 0; then rows with
    bounds of their own: lower <= r_i <= upper, u_i >= 0 at lower, <= 0 at upper, 0 between.

    M: (n, n) symmetric positive definite, any array or SciPy sparse matrix; or a function that
        returns M^-1 x for x of shape (n, k): a simulator's own factorisation.
    f: (n,). w: (rows,), with gap / h or restitution folded in; None is 0. H: (rows, n).
    mu: (contacts,), or a number for all; it has to be given.
    dim: 1 (frictionless), 2 or 3, or one of these a contact.
    cone: "exact", or the number of edges of polyhedral cones (3-dimensional contacts).
    bilateral: (G, b), the joints' rows. compliance: (rows of H, then of G), or a number for all.
    bounds: (lower, upper) of the last len(lower) rows of H, which have bounds of their own: limits
        of joints (0, inf), motors and dry friction (-h F, h F). upper may be a number for all.
    rolling, spinning: coefficients, lengths; (contacts,), or a number for all.
    two_sided: normals that hold both ways: 0 (an ordinary contact), 1 (a guide), 2 (a pin, an axle)
        or 3 (a ball joint), or one of these a contact. These come first of its dim rows, and
        u_N = 0, |r_t| <= mu |r_N|. v need not be unique then: r0 tells which answer comes first.
    r0: (rows of H, then of G), a start.
    method: "auto", "sweep", "newton", "lemke", "admm" or "proximal".
    tol, max_iterations, time_limit, monitor: as for lcp().

    Returns a ContactResult: check its `ok` or its `outcome`. With redundant contacts only v and
    H.T r are determined, not r. Raises Error where the call itself did not make sense. Many
    problems with the same matrices, or sizes: ContactSolver.
    """
    G, b = (None, None) if bilateral is None else _pair(bilateral, "bilateral", "(G, b)")
    load = _arrays.real(f, "f")
    load = _arrays.vector(load, "f", len(load) if load.ndim == 1 else np.shape(H)[-1])
    shape = H.shape if _arrays.is_sparse(H) else _arrays.real(H, "H").shape
    if w is not None and len(shape) == 2:
        _arrays.vector(w, "w", shape[0])
    if len(shape) == 2 and shape[1] != len(load):
        raise _errors.argument_error(f"H has {shape[1]} columns, but f has {len(load)} entries")
    with ContactSolver(
        M, H, mu, dim=dim, cone=cone, bilateral=G, bounds=bounds, compliance=compliance,
        rolling=rolling, spinning=spinning, two_sided=two_sided, method=method, tol=tol, max_iterations=max_iterations,
        time_limit=time_limit, monitor=monitor,
    ) as solver:  # fmt: skip
        return solver.solve(load, w, b, r0)


def contact_delassus(
    W: Any,
    q: ArrayLike,
    mu: ArrayLike,
    *,
    dim: Union[int, Sequence[int], NDArray[Any]] = 3,
    cone: Union[str, int] = "exact",
    bilateral: int = 0,
    bounds: Optional[tuple[ArrayLike, ArrayLike]] = None,
    compliance: Optional[ArrayLike] = None,
    rolling: Optional[ArrayLike] = None,
    spinning: Optional[ArrayLike] = None,
    two_sided: Optional[ArrayLike] = None,
    r0: Optional[ArrayLike] = None,
    method: ContactMethod = "auto",
    tol: float = 1e-8,
    max_iterations: Optional[int] = None,
    time_limit: Optional[float] = None,
    monitor: Optional[Monitor] = None,
) -> ContactResult:
    """As contact(), for u = W r + q, W = H M^-1 H.T.

    W: (rows, rows), any array or SciPy sparse matrix, used as it is given. q: (rows,).
    bilateral: how many of the rows, the last ones, are bilateral (u = 0); bounds: those of rows
        before these.
    """
    settings, view, result = sized(ContactSettings), sized(Matrix), sized(CResult)
    fill(
        settings, CODES, method=method, cone=cone, tol=tol, max_iterations=max_iterations,
        time_limit=time_limit,
    )  # fmt: skip
    entries, owner = _arrays.view_rectangle(view, W, "W")
    size = view.rows
    if not 0 <= bilateral <= size:
        raise _errors.argument_error(f"bilateral is {bilateral}, but W has {size} rows")
    rows = size - bilateral
    laws = _Laws(rows, mu, dim, rolling, spinning, bounds, two_sided)
    laws.struct.bilateral = bilateral
    laws.comply(compliance, size)
    offset = _arrays.vector(q, "q", size)
    start = None if r0 is None else _arrays.vector(r0, "r0", size)
    watch = _watch(monitor, entries, settings)
    r, u, ray = np.empty(size), np.empty(size), np.empty(size)
    modes = np.empty(laws.contacts + laws.bounded, dtype=np.int32)
    context, problem = Context(), sized(ContactProblem)
    problem.laws, problem.W = pointer(laws.struct), pointer(view)
    problem.q = _arrays.address(offset)
    status = library.perp_contact_solve(
        context.pointer,
        byref(_to(None, r, u, modes, ray)),
        byref(result),
        byref(settings),
        byref(problem),
        _arrays.optional(start),
    )
    if watch is not None:
        watch.raise_caught()
    context.check(status)
    del owner  # the view of W was used up to here
    return _answer(laws, rows, None, (r, u, ray), modes, result).watched(monitor)
