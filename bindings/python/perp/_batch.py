"""Many small linear complementarity problems in one call."""

from __future__ import annotations

from ctypes import byref
from dataclasses import dataclass
from typing import Any, Optional

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _arrays, _errors
from ._generated import LcpSettings, LcpStack
from ._handle import Context
from ._library import GOOD_OUTCOMES, OUTCOMES, library
from ._settings import limit
from ._structures import sized

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Batch:
    """The answers to k problems of size n. See lcp_batch()."""

    z: Array  # (k, n)
    w: Array  # (k, n), M z + q
    residuals: Array  # (k,), dimensionless, what is compared with tol
    ok: NDArray[np.bool_]  # (k,), solved, or as near as a double can come
    codes: NDArray[np.int32]  # (k,), the outcomes' numbers

    @property
    def outcomes(self) -> list[str]:
        """A word for each problem: "solved", "ray", ..."""
        return [OUTCOMES[code] for code in self.codes.tolist()]

    def __len__(self) -> int:
        return len(self.codes)

    def __repr__(self) -> str:
        return f"<perp.Batch of {len(self)}, {np.count_nonzero(self.ok)} ok>"


def _stack(value: Any, name: str, shape: tuple[int, ...]) -> Array:
    array = _arrays.real(value, name)
    if array.shape != shape:
        raise _errors.argument_error(f"{name} has shape {array.shape}, expected {shape}")
    return np.ascontiguousarray(array)


def _bounds(value: Any, name: str, shape: tuple[int, int]) -> Optional[Array]:
    """A number stands for all, n of them for every problem's; None is the default."""
    if value is None:
        return None
    array = _arrays.real(value, name)
    if array.ndim < 2 and array.shape in ((), shape[1:]):
        array = np.broadcast_to(array, shape)
    return _stack(array, name, shape)


def lcp_batch(
    M: ArrayLike,
    q: ArrayLike,
    lower: Optional[ArrayLike] = None,
    upper: Optional[ArrayLike] = None,
    *,
    tol: float = 1e-10,
    time_limit: Optional[float] = None,
    threads: int = 1,
) -> Batch:
    """Solves k problems of the same small size n, each as lcp() would.

    M: (k, n, n).  q: (k, n).
    lower, upper: (k, n), or (n,) for all problems, or a number for all; None is 0 and +inf.
    tol: the residual that counts as solved.
    time_limit: seconds; problems not begun by then have the outcome "time_limit".
    threads: 1 to 256; the answers are the same bits for any number.

    Returns a Batch: check its `ok`. In messages, entry i of problem k has the index k n + i.
    """
    matrices = _arrays.real(M, "M")
    if matrices.ndim != 3 or matrices.shape[1] != matrices.shape[2]:
        raise _errors.argument_error(f"M has shape {matrices.shape}, expected (k, n, n)")
    if matrices.shape[2] > _arrays.INT32_MAX:
        raise _errors.argument_error(f"M has {matrices.shape[2]} columns, more than a 32-bit index")
    if not -(2**31) <= threads < 2**31:
        raise _errors.argument_error(f"threads is {threads}, expected 1 to 256")
    matrices = np.ascontiguousarray(matrices)
    count, n = matrices.shape[:2]
    offsets = _stack(q, "q", (count, n))
    low, high = _bounds(lower, "lower", (count, n)), _bounds(upper, "upper", (count, n))
    context, settings = Context(), sized(LcpSettings)
    settings.tol = tol
    settings.time_limit = limit(time_limit, "time_limit")
    settings.relaxation = 1.0
    settings.scaling = settings.polish = settings.crash = 1
    z, w = np.empty((count, n)), np.empty((count, n))
    problems = sized(LcpStack)
    problems.count, problems.n = count, n
    problems.M, problems.q = _arrays.address(matrices), _arrays.address(offsets)
    problems.lower, problems.upper = _arrays.optional(low), _arrays.optional(high)
    codes, residuals = np.empty(count, np.int32), np.empty(count)
    context.check(
        library.perp_lcp_batch(
            context.pointer,
            _arrays.address(z),
            _arrays.address(w),
            _arrays.address(codes),
            _arrays.address(residuals),
            byref(settings),
            threads,
            byref(problems),
        )
    )
    return Batch(z, w, residuals, np.isin(codes, GOOD_OUTCOMES), codes)
