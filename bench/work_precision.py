"""Time against reached residual: a curve a method and problem class, peers beside it.

    python bench/work_precision.py DIRECTORY [CLASS...]

Writes work_precision.txt and work_precision.png to DIRECTORY. A point is one solve of a solver that
was set up before: its wall time (the best of some) and the natural residual max |min(z, Mz+q)|,
recomputed here from M and q for every code alike and divided by max |q|. A method that has a
tolerance is run with tolerances from 1e-1 to 1e-12; perp's polish is off for pgs, so that its curve
is its own. Peers (quantecon, Siconos, Drake) run in a process of their own, in this Python, in the
system's, or in those that PEERS_PYTHON names (a:b); one that is nowhere installed has a line that
says so. 10 seconds are the limit of a peer on one problem, and its
curve ends where a smaller tolerance no longer helps.
"""

from __future__ import annotations

import sys
from functools import partial
from pathlib import Path
from typing import Any, Callable

import perp
from scipy import sparse

import curves
import peers
import problems

LARGEST_FOR_PEERS = 1100  # they take dense matrices only

CLASSES = {
    "definite": ("random positive definite, n = 500", lambda: problems.random_definite(500)),
    "obstacle": ("obstacle, 32 x 32, sparse", lambda: problems.obstacle(32)),
    "contact": (
        "contact, 5 boxes, mass ratio 1e4",
        lambda: problems.contact_stack(5, 8, 1e4, 0.5),
    ),
}

# name of a curve: keyword arguments of perp.LCP, and whether a tolerance is to be varied
PERP = {
    "lemke": ({"method": "lemke"}, False),
    "active set": ({"method": "active_set"}, False),
    "fischer": ({"method": "fischer", "polish": False}, True),
    "pgs": ({"method": "pgs", "polish": False}, True),
    "pgs, accelerated": (
        {"method": "pgs", "polish": False, "acceleration": "conjugate_gradient"},
        True,
    ),
    "auto": ({"method": "auto"}, True),
}


def measure(make: Callable[[], Any]) -> curves.Problem:
    M, q = make()
    residual = partial(problems.residual, M, q)

    def kept(**settings: Any) -> Callable[[], Any]:
        return partial(perp.LCP(M, **settings).solve, q)

    others = []
    if len(q) <= LARGEST_FOR_PEERS:
        dense = M.toarray() if sparse.issparse(M) else M
        others = curves.peer_points(peers.LCP, residual, M=dense, q=q)
    own = curves.own_points(PERP, kept, lambda result: result.z, residual)
    return curves.Problem(f"n = {len(q)}", own, others)


def main() -> int:
    chosen = [CLASSES[name] for name in sys.argv[2:] or CLASSES]
    curves.write(
        __doc__,
        Path(sys.argv[1]) / "work_precision.txt",
        [f"perp {curve}" for curve in PERP] + list(peers.LCP),
        {title: partial(measure, make) for title, make in chosen},
        "residual, relative to max |q|",
    )
    return 0


if __name__ == "__main__":
    sys.exit(main())
