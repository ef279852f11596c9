"""One step of somebody else's robot: the contact solver over arrays that are this package's own.

ContactSolver checks and converts what a caller gives it, at 50 to 150 us a call. Here sizes and
types are known, arrays are kept as long as the sizes stay, and the library checks their numbers.
"""

from __future__ import annotations

from ctypes import byref, pointer
from typing import Any, NamedTuple, Optional

import numpy as np
from numpy.typing import NDArray

from . import _arrays
from ._contact import _METHOD_CODES, _fill
from ._generated import (
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
        self._views = M, H, G = sized(Matrix), sized(Matrix), sized(Matrix)
        self.result = sized(CResult)
        self._dynamics.n, self._laws.dim = n, 3
        self._dynamics.M, self._dynamics.H = pointer(M), pointer(H)
        self._by_reference = byref(self._laws), byref(self._dynamics), byref(self.result)
        self.rows = self.bilateral = -1
        self.r = np.zeros(0)

    def set_mass(self, M: Array, starts: Optional[Indices] = None, rows: Any = None) -> None:
        """A dense (n, n) array, or the values of a matrix in columns; it is read at every solve."""
        self._view(self._views[0], M, self.n, starts, rows)

    def set_laws(self, laws: Laws, rows: int, bilateral: int) -> None:
        """Makes room for so many rows of H and G, and takes their laws."""
        mine, address = self._laws, _arrays.address
        self._kept = laws
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
        """From `start` where it is warm."""
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

    def solve_by(self, method: str, tol: float) -> Solved:
        """Once by another method, from no start."""
        mine = self._settings
        other = ContactSettings.from_buffer_copy(mine)
        other.method, other.tol = _METHOD_CODES[method], tol
        self._call(library.perp_contact_solver_set, byref(other))
        try:
            return self.solve(False)
        finally:
            self._call(library.perp_contact_solver_set, byref(mine))

    def copy(self) -> list[Any]:
        """The answer, for put_back()."""
        return [x.copy() for x in (self.v, self.r, self.u, self.modes)]

    def put_back(self, answer: list[Any]) -> None:
        self.v[:], self.r[:], self.u[:], self.modes[:] = answer
