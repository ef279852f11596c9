"""Contact with Coulomb friction over somebody else's dynamics."""

from __future__ import annotations

from collections.abc import Sequence
from ctypes import byref, pointer
from dataclasses import dataclass
from typing import Any, Callable, Optional, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _arrays, _errors, _plot
from ._answer import SolverAnswer
from ._callbacks import Array, Callbacks
from ._generated import (
    ContactDynamics,
    ContactLaws,
    ContactMassSolve,
    ContactMonitor,
    ContactSettings,
    Matrix,
)
from ._generated import ContactResult as CResult
from ._handle import Context
from ._lcp import code, count, limit
from ._library import CERTIFICATES, CONTACT_METHODS, GOOD_OUTCOMES, MODES, OUTCOMES, library
from ._monitor import Monitor, Watch, needs_watch
from ._structures import sized
from ._words import ContactMethod, Outcome

_METHOD_CODES = {word: k for k, word in CONTACT_METHODS.items()}
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
    modes: NDArray[np.str_]  # a contact each: "separate", "stick" or "slip"
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

    def __repr__(self) -> str:
        return (
            f"<perp.ContactResult {self.outcome} by {self.method}, {len(self.modes)} contacts, "
            f"residual={self.residual:.2g}, iterations={self.iterations}>"
        )

    def _pictures(self) -> list[Any]:
        normal, friction = self.impulse[self.starts], np.zeros(len(self.dims))
        for row in (1, 2):
            there = self.dims > row
            friction[there] = np.hypot(friction[there], self.impulse[self.starts[there] + row])
        cone = normal, friction, self.mu * normal, self.modes
        return [(_plot.impulses, (normal, self.modes)), (_plot.cones, cone)]


class _Laws:
    """The contacts as the library takes them, with the arrays that they live in."""

    def __init__(
        self,
        rows: int,
        mu: ArrayLike,
        dim: Union[int, ArrayLike],
        rolling: Optional[ArrayLike],
        spinning: Optional[ArrayLike],
    ) -> None:
        dims = np.asarray(dim)
        if dims.dtype.kind not in "iu" or dims.ndim > 1 or not np.isin(dims, (1, 2, 3)).all():
            raise _errors.argument_error(f"dim is {dim!r}, expected 1, 2 or 3, or one a contact")
        given = {"mu": mu, "rolling": rolling, "spinning": spinning}
        arrays = {name: _arrays.real(x, name) for name, x in given.items() if x is not None}
        self.contacts = self._contacts(rows, dims, arrays)
        self.dims = np.full(self.contacts, dims, dtype=np.int32) if dims.ndim == 0 else dims
        self.dims = np.ascontiguousarray(self.dims, dtype=np.int32)
        self.coefficients = {
            name: _arrays.bound(x, name, self.contacts) for name, x in arrays.items()
        }
        self.struct = sized(ContactLaws)
        self.struct.contacts = self.contacts
        self.struct.dim = 3
        self.struct.dims = _arrays.address(self.dims)
        for name, array in self.coefficients.items():
            setattr(self.struct, name, _arrays.address(array))

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

    def starts(self) -> NDArray[np.int64]:
        """The row of each contact's normal."""
        rows = self.dims.astype(np.int64)
        rolling, spinning = (self.coefficients.get(name) for name in ("rolling", "spinning"))
        if rolling is not None:
            rows += (self.dims - 1) * (rolling > 0)
        if spinning is not None:
            rows += spinning > 0
        return np.cumsum(rows) - rows

    def comply(self, compliance: Optional[ArrayLike], size: int) -> None:
        self.compliance = _arrays.bound(compliance, "compliance", size)
        if self.compliance is not None:
            self.struct.compliance = _arrays.address(self.compliance)


def _cone(cone: Union[str, int]) -> int:
    if cone == "exact":
        return 0
    if isinstance(cone, (int, np.integer)) and not isinstance(cone, bool) and cone >= 3:
        return int(cone)
    raise _errors.argument_error(f"cone is {cone!r}, expected 'exact' or 3, 4, 5, ... edges")


def _fill(
    settings: ContactSettings,
    method: str,
    cone: Union[str, int],
    tol: float,
    max_iterations: Optional[int],
    time_limit: Optional[float],
) -> None:
    settings.method = code(method, _METHOD_CODES, "method")
    settings.cone = _cone(cone)
    settings.tol = tol
    settings.max_iterations = count(max_iterations, "max_iterations")
    settings.time_limit = limit(time_limit, "time_limit")


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


def _answer(
    laws: _Laws, rows: int, v: Optional[Array], buffers: Any, modes: NDArray[Any], result: CResult
) -> ContactResult:
    r, u, ray = buffers
    return ContactResult(
        v,
        r[:rows],
        u[:rows],
        r[rows:],
        _MODE_WORDS[modes],
        OUTCOMES[result.outcome],
        result.outcome in GOOD_OUTCOMES,
        result.residual,
        result.natural_residual,
        result.backward_error,
        result.signorini_velocity,
        result.signorini_impulse,
        result.cone,
        result.dissipation_velocity,
        result.dissipation_impulse,
        result.bilateral,
        result.iterations,
        result.seconds,
        CONTACT_METHODS[result.method],
        ray if result.has_ray else None,
        CERTIFICATES[result.certificate],
        laws.dims,
        laws.starts(),
        np.asarray(laws.coefficients["mu"]),
    )


def _optional(array: Optional[Array]) -> Optional[int]:
    return None if array is None else _arrays.address(array)


def _watch(monitor: Optional[Monitor], entries: int, settings: ContactSettings) -> Optional[Watch]:
    if not needs_watch(monitor, entries, settings.max_iterations):
        return None
    watch = Watch(monitor, ContactMonitor, CONTACT_METHODS)
    settings.monitor = watch.function
    return watch


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
    compliance: Optional[ArrayLike] = None,
    rolling: Optional[ArrayLike] = None,
    spinning: Optional[ArrayLike] = None,
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
    rolling rows (dim - 1) where rolling > 0, and a spinning row where spinning > 0.

    M: (n, n) symmetric positive definite, any array or SciPy sparse matrix; or a function that
        returns M^-1 x for x of shape (n, k): a simulator's own factorisation.
    f: (n,). w: (rows,), with gap / h or restitution folded in; None is 0. H: (rows, n).
    mu: (contacts,), or a number for all; it has to be given.
    dim: 1 (frictionless), 2 or 3, or one of these a contact.
    cone: "exact", or the number of edges of polyhedral cones (3-dimensional contacts).
    bilateral: (G, b), the joints' rows. compliance: (rows of H, then of G), or a number for all.
    rolling, spinning: coefficients, lengths; (contacts,), or a number for all.
    r0: (rows of H, then of G), a start.
    method: "auto", "sweep", "newton", "lemke", "admm" or "proximal". tol, max_iterations, time_limit, monitor: as for
        lcp().

    Returns a ContactResult: check its `ok` or its `outcome`. With redundant contacts only v and
    H.T r are determined, not r. Raises Error where the call itself did not make sense.
    """
    settings, dynamics, result = sized(ContactSettings), sized(ContactDynamics), sized(CResult)
    H_view, G_view, M_view = sized(Matrix), sized(Matrix), sized(Matrix)
    _fill(settings, method, cone, tol, max_iterations, time_limit)
    load = _arrays.real(f, "f")
    n = len(load) if load.ndim == 1 else -1
    load = _arrays.vector(load, "f", n)
    entries, owners = _arrays.view_rectangle(H_view, H, "H")
    rows, size = H_view.rows, H_view.rows
    if mu is None:
        raise _errors.argument_error("mu is missing: the coefficients of friction")
    laws = _Laws(rows, mu, dim, rolling, spinning)
    dynamics.n = n
    dynamics.H = pointer(H_view)
    offset = np.zeros(rows) if w is None else _arrays.vector(w, "w", rows)
    joint_offset, joint_owners = None, None
    if bilateral is not None:
        G, b = bilateral
        _, joint_owners = _arrays.view_rectangle(G_view, G, "G")
        joint_offset = _arrays.vector(b, "b", G_view.rows)
        dynamics.G = pointer(G_view)
        size += G_view.rows
    laws.comply(compliance, size)
    start = None if r0 is None else _arrays.vector(r0, "r0", size)
    mass_owner: Any = None
    if callable(M) and not _arrays.is_sparse(M):
        mass_owner = _MassSolve(M, n)
        dynamics.solve = mass_owner.function
    else:
        _, mass_owner = _arrays.view_rectangle(M_view, M, "M")
        dynamics.M = pointer(M_view)
    watch = _watch(monitor, entries * max(rows, 1), settings)
    v, r, u, ray = np.empty(n), np.empty(size), np.empty(size), np.empty(size)
    modes = np.empty(laws.contacts, dtype=np.int32)
    context, address = Context(), _arrays.address
    status = library.perp_contact_solve(
        context.pointer,
        address(v),
        address(r),
        address(u),
        address(modes),
        address(ray),
        byref(result),
        byref(settings),
        byref(laws.struct),
        byref(dynamics),
        address(load),
        address(offset),
        _optional(joint_offset),
        _optional(start),
    )
    if watch is not None:
        watch.raise_caught()
    if isinstance(mass_owner, _MassSolve):
        mass_owner.raise_caught()
    context.check(status)
    del owners, joint_owners, mass_owner  # the views were used up to here
    return _answer(laws, rows, v, (r, u, ray), modes, result).watched(monitor)


def contact_delassus(
    W: Any,
    q: ArrayLike,
    mu: ArrayLike,
    *,
    dim: Union[int, Sequence[int], NDArray[Any]] = 3,
    cone: Union[str, int] = "exact",
    bilateral: int = 0,
    compliance: Optional[ArrayLike] = None,
    rolling: Optional[ArrayLike] = None,
    spinning: Optional[ArrayLike] = None,
    r0: Optional[ArrayLike] = None,
    method: ContactMethod = "auto",
    tol: float = 1e-8,
    max_iterations: Optional[int] = None,
    time_limit: Optional[float] = None,
    monitor: Optional[Monitor] = None,
) -> ContactResult:
    """As contact(), for u = W r + q, W = H M^-1 H.T.

    W: (rows, rows), any array or SciPy sparse matrix, used as it is given. q: (rows,).
    bilateral: how many of the rows, the last ones, are bilateral (u = 0).
    """
    settings, view, result = sized(ContactSettings), sized(Matrix), sized(CResult)
    _fill(settings, method, cone, tol, max_iterations, time_limit)
    entries, owner = _arrays.view_rectangle(view, W, "W")
    size = view.rows
    if not 0 <= bilateral <= size:
        raise _errors.argument_error(f"bilateral is {bilateral}, but W has {size} rows")
    rows = size - bilateral
    laws = _Laws(rows, mu, dim, rolling, spinning)
    laws.struct.bilateral = bilateral
    laws.comply(compliance, size)
    offset = _arrays.vector(q, "q", size)
    start = None if r0 is None else _arrays.vector(r0, "r0", size)
    watch = _watch(monitor, entries, settings)
    r, u, ray = np.empty(size), np.empty(size), np.empty(size)
    modes = np.empty(laws.contacts, dtype=np.int32)
    context, address = Context(), _arrays.address
    status = library.perp_contact_solve_delassus(
        context.pointer,
        address(r),
        address(u),
        address(modes),
        address(ray),
        byref(result),
        byref(settings),
        byref(laws.struct),
        byref(view),
        address(offset),
        _optional(start),
    )
    if watch is not None:
        watch.raise_caught()
    context.check(status)
    del owner  # the view of W was used up to here
    return _answer(laws, rows, None, (r, u, ray), modes, result).watched(monitor)
