"""Every solution of a small linear complementarity problem."""

from __future__ import annotations

from collections.abc import Generator
from ctypes import byref
from dataclasses import dataclass
from typing import Any, Optional

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _arrays
from ._answer import Found, Shown, maker
from ._generated import LcpEnumeration, LcpFound, LcpSettings, LcpVisit, Matrix
from ._handle import Context
from ._library import PLACES, defaults, library
from ._monitor import Monitor, Watch
from ._settings import fill
from ._structures import sized

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Solution(Shown):
    """An isolated solution, or a family: the convex hull of its vertices plus the cone of its
    rays."""

    z: Array  # the solution; of a family, a point inside
    w: Array  # M z + q
    dimension: int  # 0 if isolated
    vertices: Array  # (k, n); of an isolated solution z itself
    rays: Array  # (m, n); empty if bounded
    places: NDArray[np.str_]  # "lower", "upper", "between", "fixed": an index set that shows it
    residual: float  # dimensionless, the largest of z and the vertices

    @property
    def isolated(self) -> bool:
        return self.dimension == 0

    def __repr__(self) -> str:
        if self.isolated:
            return f"<perp.Solution z={self.z}>"
        return (
            f"<perp.Solution family of dimension {self.dimension}, "
            f"{len(self.vertices)} vertices, {len(self.rays)} rays, z={self.z}>"
        )


@dataclass(frozen=True, eq=False)
class Solutions(Found[Solution]):
    """What lcp_all() found: a sequence of Solution."""

    solutions: list[Solution]
    outcome: str  # "solved" if every index set was looked at, or what ended the search
    nodes: int  # of the tree of index sets
    bases: int  # index sets that were not ruled out on the way; of those
    singular: int  # with a singular block
    seconds: float

    @property
    def exhaustive(self) -> bool:
        """Whether there are no other solutions."""
        return self.outcome == "solved"


_PLACES = np.array(PLACES)
_make = maker(Solutions, LcpEnumeration)


def _read(s: LcpFound, n: int) -> Solution:
    return Solution(
        _arrays.read(s.z, n),
        _arrays.read(s.w, n),
        s.dimension,
        _arrays.read(s.vertices, s.vertex_count, n),
        _arrays.read(s.rays, s.ray_count, n),
        _PLACES[_arrays.read_codes(s.places, n)],
        s.residual,
    )


def _collect(
    n: int, found: list[Solution], raised: list[BaseException]
) -> Generator[int, Any, None]:
    """Inside its `try` whenever the library calls it: see Watch."""
    answer = 0
    while True:
        try:
            while True:
                pointer = yield answer
                answer = 0
                found.append(_read(pointer[0], n))
        except GeneratorExit:
            return
        except BaseException as error:
            raised.append(error)
            answer = -1


def lcp_all(
    M: Any,
    q: ArrayLike,
    lower: Optional[ArrayLike] = None,
    upper: Optional[ArrayLike] = None,
    *,
    tol: float = 1e-10,
    time_limit: Optional[float] = None,
    max_iterations: Optional[int] = None,
    monitor: Optional[Monitor] = None,
    scaling: bool = True,
) -> Solutions:
    """Finds every solution of a problem with up to 60 variables (20 take seconds).

    Solutions that hang together with one index set come as a family, with vertices and rays; no
    solution or family lies within another one. Arguments as for lcp(); max_iterations limits the
    nodes of the search tree.

    Returns Solutions, a sequence: check its `exhaustive` or its `outcome`.
    """
    context, matrix, result = Context(), sized(Matrix), sized(LcpEnumeration)
    settings = defaults(LcpSettings)
    fill(
        settings, {}, tol=tol, scaling=scaling, time_limit=time_limit, max_iterations=max_iterations
    )
    n, _, owner = _arrays.view(matrix, M)
    offset = _arrays.vector(q, "q", n)
    low, high = _arrays.bound(lower, "lower", n), _arrays.bound(upper, "upper", n)
    watch = Watch(monitor)
    settings.monitor = watch.function
    found: list[Solution] = []
    raised: list[BaseException] = []
    collector = _collect(n, found, raised)
    next(collector)
    visit = LcpVisit(property(collector.send).__get__)
    status = library.perp_lcp_all(
        context.pointer,
        byref(result),
        byref(settings),
        byref(_arrays.lcp_problem(matrix, offset, low, high)),
        visit,
        None,
    )
    watch.raise_caught()
    if raised:
        raise raised[0]
    context.check(status)
    del owner  # the view of M was used up to here
    return _make(result, solutions=found)
