"""One step of somebody else's robot: the contact solver over arrays that are this package's own.

ContactSolver checks and converts what a caller gives it, at 50 to 150 us a call. Here sizes and
types are known, arrays are kept as long as the same bodies touch, and a step is one call:
perp_contact_solver_step in perp/contact.h.
"""

from __future__ import annotations

from ctypes import addressof, byref, c_double, c_int32, c_void_p, memmove, pointer, sizeof
from functools import partial
from struct import Struct
from typing import Any, NamedTuple, Optional

import numpy as np
from numpy.typing import NDArray

from . import _arrays
from ._contact import CODES
from ._generated import (
    CONSTANTS,
    ContactDynamics,
    ContactLaws,
    ContactRun,
    ContactSettings,
    ContactSolverPointer,
    ContactStep,
    ContactWatch,
    Matrix,
)
from ._generated import ContactResult as CResult
from ._handle import Handle
from ._library import CONTACT_METHODS, GOOD_OUTCOMES, OUTCOMES, library
from ._settings import fill
from ._structures import sized

Array = NDArray[np.float64]
Indices = NDArray[np.int32]

_SLIP = CONSTANTS["PERP_CONTACT_SLIP"]
_DTYPES = {c_double: np.dtype(np.float64), c_int32: np.dtype(np.int32)}
_PATIENCE = 32  # steps after which what holds is looked for again


class Solved(NamedTuple):
    """How a step's problem ended; see ContactResult."""

    outcome: str
    ok: bool
    residual: float
    iterations: int
    method: str


# How a problem ended, in its result: all at once, as each field costs as much.
_END, _END_AT = Struct("iiqd"), CResult.outcome.offset
_ENDS = {code: (word, code in GOOD_OUTCOMES) for code, word in OUTCOMES.items()}
_make = tuple.__new__


class Laws(NamedTuple):
    """What contacts and rows with bounds obey. Arrays of one entry a contact, or a row."""

    dims: Indices
    mu: Array
    rolling: Array
    spinning: Array
    lower: Array
    upper: Array


class Pattern(NamedTuple):
    """Of a sparse J: entries of each row, where they begin, and their columns."""

    counts: Indices
    starts: Indices
    columns: Indices

    def places(self, rows: Indices) -> tuple[NDArray[Any], NDArray[Any]]:
        """Of the entries of some rows: which of these, and where among all."""
        counts = self.counts[rows]
        ends = np.cumsum(counts)
        places = np.arange(ends[-1] if len(ends) else 0)
        return np.repeat(np.arange(len(rows)), counts), places + np.repeat(
            self.starts[rows] - ends + counts, counts
        )


class Rows(NamedTuple):
    """Which rows of the robot's J are H and G, and their laws."""

    laws: Laws
    H: Indices
    G: Indices
    gaps: Indices  # the rows of H that have gaps: each contact's first, and others
    scale: Optional[Array] = None  # of each row of H
    pattern: Optional[Pattern] = None  # of a sparse J


class _Entries:
    """Of some rows of a sparse J: where their numbers are, as a matrix of their own has them."""

    def __init__(self, rows: Indices, n: int, scale: Optional[Array], J: Pattern) -> None:
        row, sources = J.places(rows)
        columns = J.columns[sources]
        order = np.argsort(columns, kind="stable")
        row, sources = row[order], sources[order]
        self.starts = np.searchsorted(columns[order], np.arange(n + 1)).astype(np.int32)
        self.indices = row.astype(np.int32)
        self.sources = sources.astype(np.int32)
        self.scale = None if scale is None else scale[row]


class RowSolver(Handle):
    """M v = f + H.T r + G.T s, u = H v + w, 0 = G v + b, of a robot whose numbers are where bind()
    says. Answers are v, r (of H, then of G), u and modes."""

    _create = library.perp_contact_solver_create
    _destroy = library.perp_contact_solver_destroy
    _pointer_type = ContactSolverPointer

    def __init__(
        self, n: int, method: str, tol: float, max_iterations: Any, limit: Any, holds: bool = False
    ) -> None:
        """holds: v has exact zeros only where all is slow; in trees of more than 12 by hold()."""
        self._settings = sized(ContactSettings)
        self._settings.raw_velocity = 2 if holds else 0
        fill(
            self._settings, CODES, method=method, tol=tol, max_iterations=max_iterations,
            time_limit=limit,
        )  # fmt: skip
        super().__init__(byref(self._settings))
        self.n, self.tol = n, tol
        self._laws, self._dynamics = sized(ContactLaws), sized(ContactDynamics)
        self._views = M, H, _ = sized(Matrix), sized(Matrix), sized(Matrix)
        self._dynamics.n, self._laws.dim = n, 3
        self._dynamics.M, self._dynamics.H = pointer(M), pointer(H)
        self.numbers, self.result = sized(ContactStep), sized(CResult)
        self._end = memoryview(self.result).cast("B")[_END_AT : _END_AT + _END.size]  # type: ignore
        structs = self.numbers, self.result, self._laws, self._dynamics
        self._by_reference = tuple(byref(x) for x in structs)
        self._f, self.v, self.acceleration, self.force, self._shift = np.zeros((5, n))
        self.shares = np.ones(n)  # what shift is of what would open overlaps at once
        self.numbers.n = n
        self.bind(
            f=self._f, v=self.v, acceleration=self.acceleration, force_of_rows=self.force,
            shift=self._shift, shares=self.shares,
        )  # fmt: skip
        self.how = Solved("iteration_limit", False, np.inf, 0, "auto")
        self.patience = self._pause = 0
        self._watched: Any = [], None, []
        self._running: Optional[ContactRun] = None
        self._held_by: Any = None
        self._held = np.zeros(0, dtype=int)

    @property
    def known(self) -> bool:
        """Whether the last step's answer is, to the bit, that of the one before."""
        return bool(self.numbers.was_known)

    @property
    def is_other(self) -> bool:
        """Whether other things touch than are arranged."""
        return bool(self.numbers.is_other)

    @property
    def shift(self) -> Optional[Array]:
        """The velocity that takes overlaps away, where there are any."""
        return self._shift if self.numbers.shifts else None

    def bind(self, **arrays: Optional[NDArray[Any]]) -> None:
        """Where numbers of the step are (perp_contact_step); who calls keeps them alive."""
        for name, array in arrays.items():
            there = array is not None and len(array) > 0
            setattr(self.numbers, name, _arrays.address(array) if there else None)

    def bind_rows(self, J: Array, gaps: Array) -> None:
        """J and the gaps of its rows, where they do not move from step to step."""
        self._cells = c_void_p(_arrays.address(J)), c_void_p(_arrays.address(gaps))
        self.numbers.J, self.numbers.gaps = (addressof(x) for x in self._cells)

    def set_reach(self, turns: NDArray[Any]) -> None:
        """How far a shift goes: coordinates that turn, by the share of a radian that a step takes
        away of an overlap. Rows are those of a place, and say nothing farther away."""
        self._reach = np.where(turns, self.numbers.correction, np.inf)
        self.bind(reach=self._reach)

    def set_mass(
        self, sources: Indices, diagonal: Indices, starts: Any = None, indices: Any = None
    ) -> None:
        """Which number of the robot's mass each entry of M is, -1 for 0: of a dense one row by
        row, or of a sparse one by columns."""
        self.M = np.zeros(len(sources))
        self._mass = sources, diagonal, starts, indices
        self.numbers.M_entries = len(sources)
        self.bind(M=self.M, mass_sources=sources, mass_diagonal=diagonal)
        self._view(self._views[0], self.numbers.M, self.n, starts, indices)

    def arrange(self, rows: Rows, J_rows: int) -> None:
        """Other rows touch; start is 0."""
        laws, numbers, n = rows.laws, self.numbers, self.n
        count, bilateral = len(rows.H), len(rows.G)
        size = count + bilateral
        entries, of_H, of_G = (count * n, bilateral * n), None, None
        if rows.pattern is not None:
            of_H = _Entries(rows.H, n, rows.scale, rows.pattern)
            of_G = _Entries(rows.G, n, None, rows.pattern)
            entries = len(of_H.sources), len(of_G.sources)
            self.bind(H_sources=of_H.sources, H_scale=of_H.scale, G_sources=of_G.sources)
        modes, sources = np.zeros(size + 1, dtype=np.int32), rows.H[rows.gaps]
        first = rows.gaps[: len(laws.dims)]
        self._lay_out(
            r=size, u=size, start=size, w=count, H=entries[0], b=bilateral, G=entries[1]
        )  # fmt: skip
        self._kept = laws, rows, of_H, of_G, sources, modes, first, self._zeros
        self._laws.contacts, self._laws.bounded = len(laws.dims), len(laws.lower)
        for name, array in zip(Laws._fields, laws):
            setattr(self._laws, name, _arrays.address(array) if len(array) else None)
        self._view(self._views[1], numbers.H, count, *_pattern_of(of_H))
        self._view(self._views[2], numbers.G, bilateral, *_pattern_of(of_G))
        self._dynamics.H = pointer(self._views[1])
        self._dynamics.G = pointer(self._views[2]) if bilateral else None
        numbers.contacts, numbers.rows, numbers.bilateral = len(laws.dims), count, bilateral
        numbers.H_entries, numbers.G_entries = entries
        numbers.by_rows = rows.pattern is None
        numbers.gap_count, numbers.J_rows, numbers.rests = len(rows.gaps), J_rows, 0
        self.bind(
            H_rows=rows.H, row_scale=rows.scale, G_rows=rows.G, gap_rows=rows.gaps,
            gap_sources=sources, modes=modes, first=first,
        )  # fmt: skip

    def _lay_out(self, **counts: int) -> None:
        """Zeros, behind each other, where the step is told of them."""
        self._zeros = np.zeros(sum(counts.values()) + 1)
        first, place = _arrays.address(self._zeros), 0
        for name, count in counts.items():
            setattr(self.numbers, name, first + 8 * place)
            place += count

    def arrange_from_source(self) -> None:
        """The rows that the simulator has now, where numbers.source says."""
        step, _, laws, dynamics = self._by_reference
        self._call(library.perp_contact_solver_arrange, step, laws, dynamics)

    def comply(self, compliance: Array, gaps: Array) -> None:
        """For the rows that are arranged: w is what the caller has put there, b is gaps / h, of
        each row of J, and u = H v + w and 0 = G v + b have compliance times r beside them."""
        numbers = self.numbers
        self._complying = compliance, gaps, c_void_p(_arrays.address(gaps))
        self._laws.compliance = _arrays.address(compliance) if len(compliance) else None
        numbers.gaps, numbers.correction = addressof(self._complying[2]), 1.0
        numbers.gap_count = numbers.rests = 0
        numbers.shift = None

    # What is arranged, where the step has it: views that last until other rows are.

    def _of(self, struct: Any, name: str, count: int, kind: Any = c_double) -> NDArray[Any]:
        at = getattr(struct, name)
        dtype = _DTYPES[kind]
        if not count:
            return np.zeros(0, dtype=dtype)
        return np.ndarray((count,), dtype=dtype, buffer=(kind * count).from_address(at))

    @property
    def rows(self) -> int:
        return int(self.numbers.rows)

    @property
    def _size(self) -> int:
        return int(self.numbers.rows + self.numbers.bilateral)

    @property
    def r(self) -> Array:
        return self._of(self.numbers, "r", self._size)

    @property
    def u(self) -> Array:
        return self._of(self.numbers, "u", self._size)

    @property
    def start(self) -> Array:
        return self._of(self.numbers, "start", self._size)

    @property
    def w(self) -> Array:
        return self._of(self.numbers, "w", self.rows)

    @property
    def H(self) -> Array:
        """Dense: a row each; sparse: the entries."""
        H = self._of(self.numbers, "H", self.numbers.H_entries)
        return H.reshape(self.rows, self.n) if self.numbers.by_rows else H

    @property
    def modes(self) -> NDArray[Any]:
        """Of contacts and rows with bounds."""
        return self._of(self.numbers, "modes", self._laws.contacts + self._laws.bounded, c_int32)

    @property
    def first(self) -> NDArray[Any]:
        """Of each contact: its normal among H's rows."""
        return self._of(self.numbers, "first", self._laws.contacts, c_int32)

    @property
    def laws(self) -> Laws:
        laws = self._laws
        of_contacts = [self._of(laws, x, laws.contacts) for x in ("mu", "rolling", "spinning")]
        bounds = [self._of(laws, x, laws.bounded) for x in ("lower", "upper")]
        return Laws(self._of(laws, "dims", laws.contacts, c_int32), *of_contacts, *bounds)

    @property
    def row_scale(self) -> Optional[Array]:
        return self._of(self.numbers, "row_scale", self.rows) if self.numbers.row_scale else None

    def kept_rows(self, name: str, count: int) -> NDArray[Any]:
        """Places of rows in numbers: H_rows, G_rows, gap_rows."""
        return self._of(self.numbers, name, count, c_int32)

    def watch(self, places: list[tuple[int, int, int]], kept: list[NDArray[Any]]) -> None:
        """What the rows that were arranged go by, as it is: copies of arrays, and for each where
        the pointer to it is, the place behind that, and how far apart its elements lie."""
        if self._watched[0] != places:
            watches = (ContactWatch * len(places))()
            for one, place in zip(watches, places):
                one.at, one.offset, one.stride = place
            self._watched = places, watches, kept
            self.numbers.watches, self.numbers.watch_count = watches, len(places)
        _, watches, _ = self._watched
        for one, array in zip(watches, kept):
            count = len(array)
            one.seen, one.count = _arrays.address(array), count
            one.bytes = array.nbytes // count if count else 0
        self._watched = places, watches, kept

    def _view(self, matrix: Matrix, values: Any, rows: int, starts: Any, indices: Any) -> None:
        matrix.rows, matrix.columns, matrix.leading_dimension = rows, self.n, max(self.n, 1)
        matrix.storage = _arrays.ROW_MAJOR if starts is None else _arrays.CSC
        matrix.values = values
        matrix.column_starts = _arrays.optional(starts)
        matrix.row_indices = _arrays.optional(indices)

    def step(self, warm: bool) -> Solved:
        """From `start` where it is warm; that becomes r. Not where is_other says so; known: as the
        last one, to the bit."""
        numbers = self.numbers
        numbers.warm = warm
        with self._lock:
            status = library.perp_contact_solver_step(self._alive(), *self._by_reference)
            if status:
                self._context.check(status)
        if not (numbers.was_known or numbers.is_other):
            self.how = self._ended()
        return self.how

    def run(self, run: ContactRun) -> Solved:
        """Steps within a run, as far as it goes without help: perp_contact_solver_run. Returns how
        the last one ended."""
        if run is not self._running:  # for a small robot ctypes takes longer than the library does
            function = library["perp_contact_solver_run"]
            function.restype = c_int32
            self._call_run = partial(function, self._alive(), byref(run), *self._by_reference)
            self._running = run
        with self._lock:
            status = self._call_run()
            if status:
                self._context.check(status)
        numbers = self.numbers
        if not (numbers.was_known or numbers.is_other):
            self.how = self._ended()
        return self.how

    def watch_nothing(self) -> None:
        """No rows are arranged yet: the next step is told that they are others."""
        self._nothing = c_void_p(None), np.zeros(1)
        self.watch([(addressof(self._nothing[0]), 0, 8)], [self._nothing[1]])

    def _ended(self) -> Solved:
        outcome, method, iterations, residual = _END.unpack(self._end)
        word, ok = _ENDS[outcome]
        return _make(Solved, (word, ok, residual, iterations, CONTACT_METHODS[method]))

    def _hand_back(self) -> None:
        self._call(library.perp_contact_solver_hand_back, self._by_reference[0])

    def settle(self, how: Solved) -> Solved:
        """Looks for impulses that hold what no longer slides.

        What slid to rest has impulses on the rims of their cones, and those are an answer to the
        next step, too: slower than tol can tell from rest, but not 0.0. Where several contacts
        bear a body there are others inside the cones, and newton, which keeps away from rims,
        finds them: or gives up after as many iterations as the steps until the next look take.
        """
        self.patience -= 1
        if self.patience > 0 or not self.numbers.slips:
            return how
        first = self.first
        slips = self.modes[: len(first)] == _SLIP
        of_contacts = np.abs(self.u[: self.rows - self._laws.bounded])
        speeds = np.maximum.reduceat(of_contacts, first)[slips]
        tol = self._settings.tol
        if not 0.0 < speeds.max() <= 100.0 * tol * self.numbers.driven:
            return how
        kept = [x.copy() for x in (self.v, self.r, self.u, self.modes)]
        ended, laws = CResult.from_buffer_copy(self.result), self.laws
        turns = laws.rolling.any() or laws.spinning.any()
        again = self.solve_by("auto" if turns else "newton", 1e-3 * tol, 4 * _PATIENCE)
        if again.ok and self.numbers.slips < slips.sum():
            return again
        self.patience = _PATIENCE
        self.v[:], self.r[:], self.u[:], self.modes[:] = kept
        self.how = how
        memmove(byref(self.result), byref(ended), sizeof(ended))
        self._hand_back()
        return how

    def solve_by(self, method: str, tol: float, most: int = 0) -> Solved:
        """Once, from no start; most: iterations of each method, 0 for the setting."""
        mine = self._settings
        other = ContactSettings.from_buffer_copy(mine)
        other.method, other.tol = CODES["method"][method], tol
        other.max_iterations = min(filter(None, (most, other.max_iterations)), default=0)
        self._call(library.perp_contact_solver_set, byref(other))
        try:
            return self.step(False)
        finally:
            self._call(library.perp_contact_solver_set, byref(mine))

    def may_hold(self) -> bool:
        """Whether hold() is worth a question: nothing was held that long ago."""
        self._pause -= 1
        return self._pause <= 0 or len(self._held) > 0

    def hold(self) -> None:
        """Exact zeros in v, which the library leaves to those who know M where its blocks have more
        than 12 unknowns: H v = -w = 0 in the rows that hold, and what they determine is 0."""
        rows = self.rows
        holds = (self.u[:rows] == 0.0) & (self.w == 0.0)
        A = self.H[holds]
        key = holds.tobytes(), A.tobytes()
        if key != self._held_by and self._pause <= 0:
            self._held_by, self._held = key, _determined(A)
            self._pause = 0 if len(self._held) == self.n else _PATIENCE
        if key == self._held_by:
            self.v[self._held] = 0.0
            self._hand_back()
        else:  # what held them moves
            self._held = self._held[:0]


def _pattern_of(entries: Optional[_Entries]) -> tuple[Any, Any]:
    return (entries.starts, entries.indices) if entries else (None, None)


def _determined(A: Array) -> NDArray[Any]:
    """The coordinates that are 0 wherever A v = 0: unit vectors in the span of A's rows."""
    if not len(A):
        return np.zeros(0, dtype=int)
    _, sizes, rows = np.linalg.svd(A, full_matrices=False)
    span = rows[sizes > 1e-10 * sizes[0]]
    return np.flatnonzero(1.0 - (span * span).sum(0) < 1e-12)
