"""One step of somebody else's robot: the contact solver over arrays that are this package's own.

ContactSolver checks and converts what a caller gives it, at 50 to 150 us a call. Here sizes and
types are known, arrays are kept as long as the sizes stay, and the library checks their numbers.
"""

from __future__ import annotations

from ctypes import byref, pointer
from typing import Any, Callable, NamedTuple, Optional

import numpy as np
from numpy.typing import NDArray

from . import _arrays
from ._contact import _METHOD_CODES, _fill
from ._generated import (
    CONSTANTS,
    ContactDynamics,
    ContactLaws,
    ContactSettings,
    ContactSolverPointer,
    Matrix,
)
from ._generated import ContactResult as CResult
from ._handle import Handle
from ._library import CONTACT_METHODS, GOOD_OUTCOMES, OUTCOMES, library
from ._structures import sized

Array = NDArray[np.float64]
Indices = NDArray[np.int32]

_SLIP = CONSTANTS["PERP_CONTACT_SLIP"]
_PATIENCE = 32  # steps after which what holds is looked for again


class Solved(NamedTuple):
    """How a step's problem ended; see ContactResult."""

    outcome: str
    ok: bool
    residual: float
    iterations: int
    method: str


class Laws(NamedTuple):
    """What contacts and rows with bounds obey. Arrays of one entry a contact, or a row."""

    dims: Indices
    mu: Array
    rolling: Array
    spinning: Array
    lower: Array
    upper: Array


class RowSolver(Handle):
    """M v = f + H.T r + G.T s, u = H v + w, 0 = G v + b. The caller fills M, H, G, f, w and b,
    calls solve(), and reads v, r (of H, then of G) and modes."""

    _create = library.perp_contact_solver_create
    _destroy = library.perp_contact_solver_destroy
    _pointer_type = ContactSolverPointer

    def __init__(self, n: int, method: str, tol: float, max_iterations: Any, limit: Any) -> None:
        self._settings = sized(ContactSettings)
        _fill(self._settings, method, "exact", tol, max_iterations, limit)
        super().__init__(byref(self._settings))
        self.n = n
        self.f, self.v = np.zeros(n), np.zeros(n)
        self._laws, self._dynamics = sized(ContactLaws), sized(ContactDynamics)
        self._owners: dict[int, Any] = {}
        self._views = M, H, _ = sized(Matrix), sized(Matrix), sized(Matrix)
        self.result = sized(CResult)
        self._dynamics.n, self._laws.dim = n, 3
        self._dynamics.M, self._dynamics.H = pointer(M), pointer(H)
        self._by_reference = byref(self._laws), byref(self._dynamics), byref(self.result)
        self.rows = self.bilateral = -1
        self._patience = self._pause = 0
        self._at_rest: Optional[tuple[Solved, list[NDArray[Any]]]] = None
        self._is_known = False
        self._held_by: Any = None
        self._held = np.zeros(0, dtype=int)
        self.r = np.zeros(0)

    def set_mass(self, M: Array, starts: Optional[Indices] = None, rows: Any = None) -> None:
        """A dense (n, n) array, or the values of a matrix in columns; it is read at every solve."""
        self._view(self._views[0], M, self.n, starts, rows)

    def set_laws(self, laws: Laws, rows: int, bilateral: int) -> None:
        """Makes room for so many rows of H and G, and takes their laws."""
        mine, address = self._laws, _arrays.address
        self._kept, self._at_rest = laws, None
        mine.contacts, mine.bounded = len(laws.dims), len(laws.lower)
        for name, array in laws._asdict().items():
            setattr(mine, name, address(array))
        if (rows, bilateral) == (self.rows, self.bilateral):
            return
        self.rows, self.bilateral = rows, bilateral
        size, n = rows + bilateral, self.n
        self.H, self.G = np.zeros((rows, n)), np.zeros((bilateral, n))
        self._view(self._views[1], self.H, rows)
        self._view(self._views[2], self.G, bilateral)
        self._dynamics.G = pointer(self._views[2]) if bilateral else None
        self.w, self.b, self.r, self.u = np.zeros(rows), np.zeros(bilateral), *np.zeros((2, size))
        self.start = np.zeros(size)
        self.modes = np.zeros(size + 1, dtype=np.int32)
        arrays = self.v, self.r, self.u, self.modes
        self._out = [address(x) for x in arrays]
        self._in = [address(self.f), address(self.w), address(self.b) if bilateral else None]
        self._start = address(self.start)

    def set_rows(self, values: Array, starts: Indices, indices: Indices) -> None:
        """H as a sparse matrix, by columns."""
        self._view(self._views[1], values, self.rows, starts, indices)

    def _view(
        self,
        matrix: Matrix,
        values: Array,
        rows: int,
        starts: Optional[Indices] = None,
        indices: Optional[Indices] = None,
    ) -> None:
        self._owners[id(matrix)] = values, starts, indices
        matrix.rows, matrix.columns, matrix.leading_dimension = rows, self.n, self.n
        matrix.storage = _arrays.ROW_MAJOR if starts is None else _arrays.CSC
        matrix.values = _arrays.address(values)
        matrix.column_starts = None if starts is None else _arrays.address(starts)
        matrix.row_indices = None if indices is None else _arrays.address(indices)

    def solve(self, warm: bool) -> Solved:
        """From `start` where it is warm. At rest the problem stays the same to the last bit, and so
        does its answer, which is then not computed again."""
        self._is_known = warm and self._at_rest is not None and self._is_the_same()
        if self._is_known and self._at_rest is not None:
            return self._at_rest[0]
        return self._solve(warm)

    def keep(self, how: Solved) -> None:
        """Takes the answer for the next start; and, where nothing moves, for the next answer."""
        if self._is_known:
            return
        rests = how.ok and not self.v.any() and (self.start == self.r).all()
        self._at_rest = (how, [x.copy() for x in self._inputs()]) if rests else None
        np.copyto(self.start, self.r)

    def _inputs(self) -> list[NDArray[Any]]:
        matrices = [x for owner in self._owners.values() for x in owner if x is not None]
        return [self.f, self.w, self.b, *matrices]

    def _is_the_same(self) -> bool:
        before = [] if self._at_rest is None else self._at_rest[1]
        return all(a.tobytes() == b.tobytes() for a, b in zip(self._inputs(), before))

    def _solve(self, warm: bool) -> Solved:
        laws, dynamics, result = self._by_reference
        with self._lock:
            solver = self._alive()
            status = library.perp_contact_solver_setup_dynamics(solver, laws, dynamics)
            if status == 0:
                status = library.perp_contact_solver_solve_dynamics(
                    solver, *self._out, None, result, *self._in, self._start if warm else None
                )
            if status:
                self._context.check(status)
        end = self.result
        word = OUTCOMES[end.outcome]
        good = end.outcome in GOOD_OUTCOMES
        return Solved(word, good, end.residual, end.iterations, CONTACT_METHODS[end.method])

    def settle(self, how: Solved, first: NDArray[Any], fastest: Callable[[], float]) -> Solved:
        """Looks for impulses that hold what no longer slides.

        What slid to rest has impulses on the rims of their cones, and those are an answer to the
        next step, too: slower than tol can tell from rest, but not 0.0. Where several contacts
        bear a body there are others inside the cones, and newton, which keeps away from rims,
        finds them.

        first: the contacts' normals among the rows. fastest: the largest velocity of a row
            without impulses.
        """
        slips = self.modes[: len(first)] == _SLIP
        self._patience -= 1
        if self._patience > 0 or not slips.any():
            return how
        of_contacts = np.abs(self.u[: self.rows - len(self._kept.lower)])
        speeds = np.maximum.reduceat(of_contacts, first)[slips]
        tol = self._settings.tol
        if speeds.max() > 100.0 * tol * fastest():
            return how
        kept = [x.copy() for x in (self.v, self.r, self.u, self.modes)]
        turns = self._kept.rolling.any() or self._kept.spinning.any()
        again = self._solve_by("auto" if turns else "newton", 1e-3 * tol)
        if again.ok and (self.modes[: len(first)] == _SLIP).sum() < slips.sum():
            return again
        self._patience = _PATIENCE
        self.v[:], self.r[:], self.u[:], self.modes[:] = kept
        return how

    def _solve_by(self, method: str, tol: float) -> Solved:
        """Once, from no start."""
        mine = self._settings
        other = ContactSettings.from_buffer_copy(mine)
        other.method, other.tol = _METHOD_CODES[method], tol
        self._call(library.perp_contact_solver_set, byref(other))
        try:
            return self.solve(False)
        finally:
            self._call(library.perp_contact_solver_set, byref(mine))

    def hold(self) -> None:
        """Exact zeros in v, which the library leaves to those who know M where its blocks have more
        than 12 unknowns: H v = -w = 0 in the rows that hold, and what they determine is 0."""
        rows = self.rows
        holds = (self.u[:rows] == 0.0) & (self.w == 0.0)
        A = self.H[holds]
        key = holds.tobytes(), A.tobytes()
        self._pause -= 1
        if key != self._held_by and self._pause <= 0:
            self._held_by, self._held = key, _determined(A)
            self._pause = 0 if len(self._held) == self.n else _PATIENCE
        if key == self._held_by:
            self.v[self._held] = 0.0

    def open(
        self, H: Array, G: Array, gaps: Array, slop: float, share: float, h: float
    ) -> Optional[Array]:
        """The velocity that takes a share of overlaps away within h, or None: the least, in the
        metric of M, that opens what overlaps and closes nothing else. H: the rows of the gaps."""
        if (self.rows, self.bilateral) != (len(gaps), len(G)):
            none = np.zeros(0)
            limits = np.zeros(len(gaps)), np.full(len(gaps), np.inf)
            laws = Laws(np.zeros(0, np.int32), none, none, none, *limits)
            self.set_laws(laws, len(gaps), len(G))
        self.H[:], self.G[:] = H, G
        self.w[:] = (share * np.minimum(gaps + slop, 0.0) + np.maximum(gaps, 0.0)) / h
        return self.v if self.solve(False).ok else None


def _determined(A: Array) -> NDArray[Any]:
    """The coordinates that are 0 wherever A v = 0: unit vectors in the span of A's rows."""
    if not len(A):
        return np.zeros(0, dtype=int)
    _, sizes, rows = np.linalg.svd(A, full_matrices=False)
    span = rows[sizes > 1e-10 * sizes[0]]
    return np.flatnonzero(1.0 - (span * span).sum(0) < 1e-12)
