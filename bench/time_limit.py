"""What a time limit costs and buys: `auto` with shorter and shorter limits.

    python bench/time_limit.py DIRECTORY

Writes time_limit.txt to DIRECTORY. A limit may be exceeded by a tenth and one factorisation; 'over' is
what was taken beyond the limit, in factorisations of M timed in the same run (LAPACK's LU for dense
M, SuperLU for sparse M). The residual is max |min(z, Mz+q)| / max |q| of the z returned; that of
z = 0 is on top of each table.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path
from typing import Any, Callable

import numpy as np
import perp
from scipy import linalg, sparse
from scipy.sparse.linalg import splu

import problems

LIMITS = (1e-3, 3e-3, 1e-2, 3e-2, 1e-1, 3e-1, 1.0, 3.0)
REPEATS = 3

CLASSES: dict[str, Callable[[], Any]] = {
    "random positive definite, n = 1500": lambda: problems.random_definite(1500),
    "obstacle, 200 x 200, sparse": lambda: problems.obstacle(200),
    "contact, 15 boxes, mass ratio 1e4, n = 600": lambda: problems.contact_stack(15, 8, 1e4, 0.5),
}


def factorisation_seconds(M: Any) -> float:
    """The median of three."""
    seconds = []
    for _ in range(3):
        started = time.perf_counter()
        splu(M) if sparse.issparse(M) else linalg.lu_factor(M, check_finite=False)
        seconds.append(time.perf_counter() - started)
    return float(np.median(seconds))


def rows(M: Any, q: Any, unit: float) -> list[str]:
    lines = []
    for limit in (*LIMITS, None):
        solver = perp.LCP(M, time_limit=limit)
        solver.solve(q)  # makes the memory
        results = [solver.solve(q) for _ in range(REPEATS)]
        r = sorted(results, key=lambda r: r.seconds)[REPEATS // 2]
        over = "" if limit is None else f"{max(r.seconds - limit, 0.0) / unit:.2f}"
        name = "none" if limit is None else f"{1e3 * limit:.0f}"
        lines.append(
            f"{name:>8}{1e3 * r.seconds:12.2f}{over:>8}{problems.residual(M, q, r.z):10.1e}"
            f"  {r.outcome:16}{r.method}"
        )
    return lines


def main() -> int:
    with open(Path(sys.argv[1]) / "time_limit.txt", "w") as table:
        about = __doc__.split("\n\n")
        print(about[0], about[2].split(". ", 1)[1], sep="\n\n", end="", file=table)
        print(f"\nperp {perp.version_text()}", file=table)
        for title, make in CLASSES.items():
            print(f"time_limit: {title}", file=sys.stderr)
            M, q = make()
            unit = factorisation_seconds(M)
            print(
                f"\n{title}; one factorisation {1e3 * unit:.1f} ms; z = 0: residual "
                f"{problems.residual(M, q, np.zeros(len(q))):.1e}\n\n{'limit ms':>8}{'ms':>12}"
                f"{'over':>8}{'residual':>10}  {'outcome':16}method",
                file=table,
            )
            print(*rows(M, q, unit), sep="\n", file=table)
    return 0


if __name__ == "__main__":
    sys.exit(main())
