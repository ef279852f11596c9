"""Linear complementarity problems whose matrix is known by its products alone."""

from __future__ import annotations

from ctypes import byref
from typing import Callable, Optional

import numpy as np
from numpy.typing import ArrayLike

from . import _arrays
from ._callbacks import Array, Callbacks
from ._generated import LcpProblem, LcpProduct, LcpSettings
from ._generated import LcpResult as CResult
from ._handle import Context
from ._lcp import LcpResult, read_answer
from ._library import defaults, library
from ._monitor import Monitor, Watch
from ._settings import fill
from ._structures import sized


def lcp_product(
    product: Callable[[Array], ArrayLike],
    q: ArrayLike,
    lower: Optional[ArrayLike] = None,
    upper: Optional[ArrayLike] = None,
    *,
    diagonal: Optional[ArrayLike] = None,
    z0: Optional[ArrayLike] = None,
    tol: float = 1e-10,
    max_iterations: Optional[int] = None,
    time_limit: Optional[float] = None,
    monitor: Optional[Monitor] = None,
) -> LcpResult:
    """Solves the problem of lcp() for a symmetric, positive definite or semidefinite M that is
    known by its products alone, by conjugate gradients and gradient projections (MPRGP).

    product: product(x) returns M x, (n,) for (n,): a convolution by FFT, a finite element code, a
        solve, the matvec of a SciPy LinearOperator.
    diagonal: (n,), of M or about that, > 0: scales variables of different units; None: all are
        alike.
    max_iterations: products; None is 10000.
    Other arguments as for lcp().

    Returns an LcpResult: its iterations count products, its ray is None. Check its `ok` or its
    `outcome`. An exception of product ends the call.
    """
    context, result, settings = Context(), sized(CResult), defaults(LcpSettings)
    fill(settings, {}, tol=tol, max_iterations=max_iterations, time_limit=time_limit)
    n = np.size(q)
    offset = _arrays.vector(q, "q", n)
    low, high = _arrays.bound(lower, "lower", n), _arrays.bound(upper, "upper", n)
    scale = None if diagonal is None else _arrays.vector(diagonal, "diagonal", n)
    start = None if z0 is None else _arrays.vector(z0, "z0", n)
    callbacks, watch = Callbacks(), Watch(monitor)
    multiply = LcpProduct(lambda y, x, _: callbacks.answer(product, "product(x)", y, x, n))
    if monitor is not None:
        settings.monitor = watch.function
    problem, optional = sized(LcpProblem), _arrays.optional
    problem.q, problem.product, problem.n = _arrays.address(offset), multiply, n
    problem.lower, problem.upper, problem.diagonal = map(optional, (low, high, scale))
    z, w = np.empty(n), np.empty(n)
    with callbacks.catching():
        status = library.perp_lcp_solve(
            context.pointer,
            _arrays.address(z),
            _arrays.address(w),
            None,
            byref(result),
            byref(settings),
            byref(problem),
            _arrays.optional(start),
        )
    callbacks.raise_caught()
    watch.raise_caught()
    context.check(status)
    return read_answer(result, z, w, z).watched(monitor)
