"""Time against reached residual of frictional contact: a curve a method and scene, peers beside it.

    python bench/work_precision_contact.py DIRECTORY [SCENE...]

Writes work_precision_contact.txt and work_precision_contact.png to DIRECTORY. A point is one solve
from no impulses by a solver that was set up before: its wall time (the best of some) and the tested
residual of docs/contact.md, recomputed here from W and q for every code alike. perp gets M and H,
2 seconds and tolerances from 1e-1 to 1e-12 ('lemke' ends in a refinement and has one point). Peers get
W, which they need, for nothing; Siconos as a sparse matrix where its Python has SciPy. They run in a
process of their own, in this Python, in the system's, or in those that PEERS_PYTHON names (a:b); one
that is nowhere installed has a line that says so. 10 seconds are the limit of a peer on one problem, and its
curve ends where a smaller tolerance no longer helps.
"""

from __future__ import annotations

import sys
from functools import partial
from pathlib import Path
from typing import Any, Callable

import perp

import curves
import peers
import problems

SCENES = {
    "tower": (
        "tower of 10 cubes, mass ratio 1e3, pushed",
        lambda: problems.tower(10, 1e3, 0.5, 0.02),
    ),
    "wall": ("wall of 6 x 4 bricks, pushed", lambda: problems.wall(6, 4, 0.5, 0.02)),
    "balls": ("pyramid of 55 balls, pushed", lambda: problems.ball_pyramid(5, 0.5, 0.02)),
}

# name of a curve: keyword arguments of perp.ContactSolver, and whether a tolerance is to be varied
PERP: dict[str, tuple[dict[str, Any], bool]] = {
    method: ({"method": method}, method != "lemke")
    for method in ("sweep", "admm", "proximal", "lemke", "auto")
}


def measure(make: Callable[[], problems.Contacts]) -> curves.Problem:
    scene = make()
    W, q = scene.delassus()
    residual = partial(problems.contact_residual, W, q, scene.mu)

    def kept(**settings: Any) -> Callable[[], Any]:
        solver = perp.ContactSolver(scene.M, scene.H, scene.mu, time_limit=2.0, **settings)
        return partial(solver.solve, scene.f, scene.w, r0=0.0)

    own = curves.own_points(PERP, kept, lambda result: result.impulse, residual)
    others = curves.peer_points(peers.CONTACT, residual, W=W, q=q, mu=scene.mu)
    return curves.Problem(f"{len(scene.mu)} contacts", own, others)


def main() -> int:
    chosen = [SCENES[name] for name in sys.argv[2:] or SCENES]
    curves.write(
        __doc__,
        Path(sys.argv[1]) / "work_precision_contact.txt",
        [f"perp {curve}" for curve in PERP] + list(peers.CONTACT),
        {title: partial(measure, make) for title, make in chosen},
        "residual, without a dimension",
    )
    return 0


if __name__ == "__main__":
    sys.exit(main())
