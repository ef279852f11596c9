"""Derivatives of a solution of contacts with respect to its data."""

from __future__ import annotations

from collections.abc import Sequence
from ctypes import byref, pointer, sizeof
from typing import Any, Optional, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _arrays
from ._contact import _MODE_WORDS, _Problem
from ._generated import (
    ContactChange,
    ContactProblem,
    ContactSensitivityInfo,
    ContactSensitivityPointer,
    ContactSettings,
    Matrix,
)
from ._handle import Handle
from ._library import VERDICTS, defaults, library
from ._structures import sized

Array = NDArray[np.float64]


class ContactSensitivity(Handle):
    """What contact_sensitivity() returns: the equations of the active set, factored once.

    differentiable: modes are strict and impulses determined.
    reason, index: where not, "degenerate" (contact `index`, or contacts + a row with bounds, is on
        the edge between two modes), "singular" or "not a solution"; else None.
    v, r, u, modes: the point, r and u with the bilateral rows last.
    margin: how far the nearest contact is from another mode, dimensionless as the residual is.
    condition: estimate of the condition number of the scaled equations.

    The products of a degenerate solution are those of the piece that belongs to `modes`; those of a
    singular one, or of none, raise a ValueError.
    """

    _create = library.perp_contact_sensitivity_create
    _destroy = library.perp_contact_sensitivity_destroy
    _pointer_type = ContactSensitivityPointer

    def __init__(
        self, problem: _Problem, f: ArrayLike, w: ArrayLike, b: Any, r: ArrayLike, tol: float
    ) -> None:
        info, settings = sized(ContactSensitivityInfo), defaults(ContactSettings)
        settings.tol = tol
        n, rows, size = problem.n, problem.rows, problem.size
        self._problem, self._n, self._rows, self._size = problem, n, rows, size
        load, offset = _arrays.vector(f, "f", n), _arrays.vector(w, "w", rows)
        joints = None if b is None else _arrays.vector(b, "b", size - rows)
        point = _arrays.vector(r, "r", size)
        posed = sized(ContactProblem)
        posed.laws, posed.dynamics = pointer(problem.laws.struct), pointer(problem.dynamics)
        posed.f, posed.w = _arrays.address(load), _arrays.address(offset)
        posed.b = _arrays.optional(joints)
        super().__init__(
            byref(info),
            byref(settings),
            byref(posed),
            _arrays.address(point),
        )
        self._contacts = problem.laws.contacts
        self.v, self.r, self.u = np.empty(n), np.empty(size), np.empty(size)
        codes = np.empty(self._contacts + problem.laws.bounded, dtype=np.int32)
        self._call(
            library.perp_contact_sensitivity_point,
            *(_arrays.address(x) for x in (self.v, self.r, self.u, codes)),
        )
        self.modes: NDArray[np.str_] = _MODE_WORDS[codes]
        self.differentiable = info.verdict == 0
        self.reason: Optional[str] = VERDICTS[info.verdict] if info.verdict else None
        self.index: Optional[int] = None if info.index < 0 else info.index
        self.margin: float = info.margin
        self.condition: float = info.condition

    def __repr__(self) -> str:
        return f"<perp.ContactSensitivity {self.reason or 'differentiable'}, n={self._n}>"

    def forward(
        self,
        df: Optional[ArrayLike] = None,
        dw: Optional[ArrayLike] = None,
        db: Optional[ArrayLike] = None,
        dmu: Optional[ArrayLike] = None,
        dM: Any = None,
        dH: Any = None,
        dG: Any = None,
    ) -> tuple[Array, Array]:
        """Returns (dv, dr), the derivatives along these changes of the data; None is no change."""
        lengths = (self._n, self._rows, self._size - self._rows, self._contacts)
        changes = [
            _arrays.bound(value, name, length)
            for value, name, length in zip(
                (df, dw, db, dmu), ("df", "dw", "db", "dmu"), lengths
            )
        ]
        views, owners = [], []
        for value, name in ((dM, "dM"), (dH, "dH"), (dG, "dG")):
            matrix = None if value is None else sized(Matrix)
            if matrix is not None:
                owners.append(_arrays.view_rectangle(matrix, value, name))
            views.append(None if matrix is None else pointer(matrix))
        change = ContactChange(sizeof(ContactChange), *map(_arrays.optional, changes), *views)
        dv, dr = np.empty(self._n), np.empty(self._size)
        self._call(
            library.perp_contact_sensitivity_forward,
            _arrays.address(dv),
            _arrays.address(dr),
            byref(change),
        )
        del owners  # the views were used up to here
        return dv, dr

    def adjoint(
        self, gv: Optional[ArrayLike] = None, gr: Optional[ArrayLike] = None
    ) -> tuple[Array, Array, Array, Array]:
        """Returns the gradients with respect to f, w, b and mu of a function of v and r whose
        gradients in these are gv and gr; None is 0."""
        left, right = _arrays.bound(gv, "gv", self._n), _arrays.bound(gr, "gr", self._size)
        results = (
            np.empty(self._n),
            np.empty(self._rows),
            np.empty(self._size - self._rows),
            np.empty(self._contacts),
        )
        self._call(
            library.perp_contact_sensitivity_adjoint,
            *(_arrays.address(x) for x in results),
            _arrays.optional(left),
            _arrays.optional(right),
        )
        return results

    def adjoint_matrices(
        self, gv: Optional[ArrayLike] = None, gr: Optional[ArrayLike] = None
    ) -> tuple[Array, Array, Array]:
        """Returns the same with respect to M, H and G, dense."""
        x, y, z, _ = self.adjoint(gv, gr)
        r, s = self.r[: self._rows], self.r[self._rows :]
        return (
            -np.outer(x, self.v),
            np.outer(r, x) + np.outer(y, self.v),
            np.outer(s, x) + np.outer(z, self.v),
        )


def contact_sensitivity(
    M: Any,
    f: ArrayLike,
    H: Any,
    w: ArrayLike,
    mu: ArrayLike,
    r: ArrayLike,
    *,
    dim: Union[int, Sequence[int], NDArray[Any]] = 3,
    bilateral: Optional[tuple[Any, ArrayLike]] = None,
    bounds: Optional[tuple[ArrayLike, ArrayLike]] = None,
    compliance: Optional[ArrayLike] = None,
    rolling: Optional[ArrayLike] = None,
    spinning: Optional[ArrayLike] = None,
    two_sided: Optional[ArrayLike] = None,
    tol: float = 1e-8,
) -> ContactSensitivity:
    """Returns the derivatives of v and r, a solution of contact(), with respect to f, w, b, mu, M,
    H and G, as products: forward(df, dw, db, dmu, dM, dH, dG) and adjoint(gv, gr),
    adjoint_matrices(gv, gr). See ContactSensitivity.

    r: (rows of H, then of G), a solution: result.impulse, and then result.bilateral_impulse.
    tol: the residual that counts as solved, and the margin that counts as none.
    The others: as for contact(). Matrices that need no conversion are read in place, here and at
    every product.
    """
    G, b = (None, None) if bilateral is None else bilateral
    problem = _Problem()
    problem.read(M, H, mu, dim, G, bounds, compliance, rolling, spinning, two_sided)
    return ContactSensitivity(problem, f, w, b, r, tol)
