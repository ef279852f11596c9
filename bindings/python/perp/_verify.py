"""A proof that a solution of a linear complementarity problem lies near a point."""

from __future__ import annotations

from ctypes import byref
from dataclasses import dataclass
from typing import Any, Optional

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _arrays
from ._answer import Shown
from ._generated import LcpProof, Matrix
from ._handle import Context
from ._library import VERDICTS, library
from ._structures import sized


@dataclass(frozen=True, eq=False)
class Proof(Shown):
    """What lcp_verify() proved, or why it could not."""

    radius: Optional[float]  # a solution s has |z[i] - s[i]| <= radius for all i; None: no proof
    radii: Optional[NDArray[np.float64]]  # the same for each i
    reason: Optional[str]  # "not a solution", "singular", "degenerate", "too large"; None: proved
    index: Optional[int]  # the row that decided, if one did

    def __bool__(self) -> bool:
        return self.radius is not None


def lcp_verify(
    M: Any,
    q: ArrayLike,
    z: ArrayLike,
    lower: Optional[ArrayLike] = None,
    upper: Optional[ArrayLike] = None,
) -> Proof:
    """Proves that a true solution of the problem lies near z, with every rounding counted, for the
    very numbers given. M, q, lower and upper are those of lcp().

    The result's `radius` bounds the distance in every variable, or is None, and then `reason` says
    why: "not a solution" (no solution has the index set that z shows), "singular" (the equations
    of that index set could not be proved regular), "degenerate" (row `index` is too close to
    call), "too large" (sparse, and neither an H-matrix nor small).
    """
    context, matrix, proof = Context(), sized(Matrix), sized(LcpProof)
    n, _, owner = _arrays.view(matrix, M)
    offset, point = _arrays.vector(q, "q", n), _arrays.vector(z, "z", n)
    low, high = _arrays.bound(lower, "lower", n), _arrays.bound(upper, "upper", n)
    radii = np.empty(n)
    context.check(
        library.perp_lcp_verify(
            context.pointer,
            _arrays.address(radii),
            byref(proof),
            byref(_arrays.lcp_problem(matrix, offset, low, high)),
            _arrays.address(point),
        )
    )
    del owner  # the view of M was used up to here
    index = None if proof.index < 0 else proof.index
    if proof.verdict:
        return Proof(None, None, VERDICTS[proof.verdict], index)
    return Proof(proof.radius, radii, None, index)
