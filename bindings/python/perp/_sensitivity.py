"""Derivatives of a solution of a linear complementarity problem with respect to its data."""

from __future__ import annotations

from ctypes import byref
from typing import Any, Optional

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _arrays
from ._errors import argument_error
from ._generated import LcpSensitivityInfo, LcpSensitivityPointer, LcpSettings, Matrix
from ._handle import Handle
from ._library import PLACES, VERDICTS, defaults, library
from ._structures import sized

Array = NDArray[np.float64]


class Sensitivity(Handle):
    """What lcp_sensitivity() returns: one factorisation, for many products.

    differentiable: strictly complementary, with a regular block.
    reason, index: where not, "degenerate" (row `index` is on the edge between two places),
        "singular" or "not a solution" (row `index` is farthest from it); else None.
    places: "lower", "upper", "between" or "fixed" for each variable: the index set used.
    margin: how far the nearest row is from changing its place, dimensionless as the residual is.
    condition: estimate of the condition number of the equilibrated block.

    The products of a degenerate solution are those of the linear piece that belongs to `places`;
    without a regular block, or a solution, they raise a ValueError.
    """

    _create = library.perp_lcp_sensitivity_create
    _destroy = library.perp_lcp_sensitivity_destroy
    _pointer_type = LcpSensitivityPointer

    def __init__(
        self,
        M: Any,
        q: ArrayLike,
        z: ArrayLike,
        lower: Optional[ArrayLike],
        upper: Optional[ArrayLike],
        tol: float,
        scaling: bool,
    ) -> None:
        matrix, info, settings = sized(Matrix), sized(LcpSensitivityInfo), defaults(LcpSettings)
        settings.tol, settings.scaling = tol, 1 if scaling else 0
        n, _, self._owner = _arrays.view(matrix, M)
        offset, point = _arrays.vector(q, "q", n), _arrays.vector(z, "z", n)
        low, high = _arrays.bound(lower, "lower", n), _arrays.bound(upper, "upper", n)
        super().__init__(
            byref(info),
            byref(settings),
            byref(_arrays.lcp_problem(matrix, offset, low, high)),
            _arrays.address(point),
        )
        self._n = n
        codes = np.empty(n, dtype=np.int32)
        self._call(library.perp_lcp_sensitivity_places, _arrays.address(codes))
        self._z = np.clip(point, 0.0 if low is None else low, np.inf if high is None else high)
        self.places: NDArray[np.str_] = np.array(PLACES)[codes]
        self.differentiable = info.verdict == 0
        self.reason: Optional[str] = VERDICTS[info.verdict] if info.verdict else None
        self.index: Optional[int] = None if info.index < 0 else info.index
        self.margin: float = info.margin
        self.condition: float = info.condition

    def __repr__(self) -> str:
        return f"<perp.Sensitivity {self.reason or 'differentiable'}, n={self._n}>"

    def forward(
        self,
        dq: Optional[ArrayLike] = None,
        dM: Any = None,
        dlower: Optional[ArrayLike] = None,
        dupper: Optional[ArrayLike] = None,
    ) -> Array:
        """Returns dz, the derivative of z along these changes of the data; None is no change."""
        n, dz = self._n, np.empty(self._n)
        matrix, owner = None, None
        if dM is not None:
            matrix = sized(Matrix)
            _, _, owner = _arrays.view(matrix, dM)
        changes = [
            _arrays.bound(value, name, n)
            for value, name in ((dq, "dq"), (dlower, "dlower"), (dupper, "dupper"))
        ]
        self._call(
            library.perp_lcp_sensitivity_forward,
            _arrays.address(dz),
            _arrays.optional(changes[0]),
            None if matrix is None else byref(matrix),
            _arrays.optional(changes[1]),
            _arrays.optional(changes[2]),
        )
        del owner  # the view of dM was used up to here
        return dz

    def _adjoint(self, g: ArrayLike) -> tuple[Array, Array, Array]:
        gradient = _arrays.vector(g, "g", self._n)
        p, lower, upper = np.empty(self._n), np.empty(self._n), np.empty(self._n)
        self._call(
            library.perp_lcp_sensitivity_adjoint,
            *(_arrays.address(array) for array in (p, lower, upper, gradient)),
        )
        return p, lower, upper

    def adjoint(self, g: ArrayLike) -> Array:
        """Returns the gradient with respect to q of a function of z whose gradient in z is g."""
        return self._adjoint(g)[0]

    def adjoint_bounds(self, g: ArrayLike) -> tuple[Array, Array]:
        """Returns the gradients with respect to lower and to upper."""
        return self._adjoint(g)[1:]

    def adjoint_matrix(self, g: ArrayLike, pattern: Any = None) -> Any:
        """Returns the gradient with respect to M, the outer product of adjoint(g) and z: a dense
        array, or, with a sparse matrix as `pattern`, its entries there as a CSC matrix."""
        p = self.adjoint(g)
        if pattern is None:
            return np.outer(p, self._z)
        if not _arrays.is_sparse(pattern) or pattern.shape != (self._n, self._n):
            raise argument_error(f"pattern is not a sparse ({self._n}, {self._n}) matrix")
        result = pattern.tocsc(copy=True)
        columns = np.repeat(np.arange(self._n), np.diff(result.indptr))
        result.data = p[result.indices] * self._z[columns]
        return result


def lcp_sensitivity(
    M: Any,
    q: ArrayLike,
    z: ArrayLike,
    lower: Optional[ArrayLike] = None,
    upper: Optional[ArrayLike] = None,
    *,
    tol: float = 1e-10,
    scaling: bool = True,
) -> Sensitivity:
    """Returns the derivatives of the solution z of a problem with respect to M, q and the bounds,
    as products: forward(dq, dM, dlower, dupper) and adjoint(g), adjoint_matrix(g),
    adjoint_bounds(g). See Sensitivity.

    M, q, lower, upper, scaling: as for lcp(). An M that needs no conversion is read in place, here
    and at every product.
    tol: the residual that counts as solved, and the margin that counts as none.
    """
    return Sensitivity(M, q, z, lower, upper, tol, scaling)
