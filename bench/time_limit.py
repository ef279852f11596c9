"""What a time limit costs and buys: `auto` with shorter and shorter limits.

    python bench/time_limit.py DIRECTORY

Writes time_limit.txt and time_limit.png to DIRECTORY. A limit may be exceeded by a tenth of it or
by 5 ms, whichever is more, and by what it takes to tell what one point is worth; 'over' is what was
taken beyond the limit, in ms, with ! where that is more. The residual is
max |min(z, Mz+q)| / max |q| of the z returned; that of z = 0 is on top of each table.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any, Callable, NamedTuple, Optional

import matplotlib.pyplot as plt
import numpy as np
import perp

import problems
import report

LIMITS = (1e-3, 3e-3, 1e-2, 3e-2, 1e-1, 3e-1, 1.0, 3.0)
REPEATS = 3

CLASSES: dict[str, Callable[[], Any]] = {
    "random positive definite, n = 1500": lambda: problems.random_definite(1500),
    "obstacle, 200 x 200, sparse": lambda: problems.obstacle(200),
    "contact, 15 boxes, mass ratio 1e4, n = 600": lambda: problems.contact_stack(15, 8, 1e4, 0.5),
}


def least_seconds(M: Any, q: Any) -> float:
    """What a solve takes whose time is over before it begins; the median of three."""
    solver = perp.LCP(M, time_limit=1e-12)
    return float(np.median([solver.solve(q).seconds for _ in range(REPEATS + 1)][1:]))


class Row(NamedTuple):
    limit: Optional[float]
    seconds: float
    residual: float
    outcome: str
    method: str

    def text(self, least: float) -> str:
        over = ""
        if self.limit is not None:
            beyond = max(self.seconds - self.limit, 0.0)
            over = f"{1e3 * beyond:.2f}" + "!" * (beyond > max(0.1 * self.limit, 5e-3) + least)
        name = "none" if self.limit is None else f"{1e3 * self.limit:.0f}"
        return (
            f"{name:>8}{1e3 * self.seconds:12.2f}{over:>8}{self.residual:10.1e}"
            f"  {self.outcome:16}{self.method}"
        )


def measure(M: Any, q: Any) -> list[Row]:
    rows = []
    for limit in (*LIMITS, None):
        solver = perp.LCP(M, time_limit=limit)
        solver.solve(q)  # makes the memory
        results = [solver.solve(q) for _ in range(REPEATS)]
        r = sorted(results, key=lambda r: r.seconds)[REPEATS // 2]
        rows.append(Row(limit, r.seconds, problems.residual(M, q, r.z), r.outcome, r.method))
    return rows


def draw(above: Any, below: Any, title: str, rows: list[Row], none: float) -> None:
    """What the limits buy, above; what they cost, below."""
    limited, whole = rows[:-1], rows[-1]
    limits = 1e3 * np.array(LIMITS)
    above.plot(limits, [max(row.residual, 1e-17) for row in limited], "o-", label="auto")
    above.axhline(none, color="grey", lw=0.8, ls=":", label="z = 0")
    above.set(title=title, yscale="log", ylim=(1e-17, 1e3))
    below.plot(limits, [1e3 * row.seconds for row in limited], "o-")
    below.plot(limits, limits, color="grey", lw=0.8, ls="--", label="the limit")
    below.axhline(1e3 * whole.seconds, color="grey", lw=0.8, ls=":", label="no limit")
    below.set(yscale="log", xlabel="limit, ms")
    for axes in (above, below):
        axes.set(xscale="log")
        axes.grid(True, alpha=0.3)
        axes.legend(frameon=False, fontsize=8)


def main() -> int:
    path = Path(sys.argv[1]) / "time_limit.txt"
    figure, panels = plt.subplots(2, len(CLASSES), figsize=(15, 7), layout="constrained")
    with open(path, "w") as table:
        report.heading(__doc__, table)
        for (title, make), above, below in zip(CLASSES.items(), *panels):
            print(f"time_limit: {title}", file=sys.stderr)
            M, q = make()
            least, none = least_seconds(M, q), problems.residual(M, q, np.zeros(len(q)))
            rows = measure(M, q)
            print(
                f"\n{title}; one point {1e3 * least:.1f} ms; z = 0: residual {none:.1e}\n\n"
                f"{'limit ms':>8}{'ms':>12}{'over':>8}{'residual':>10}  {'outcome':16}method",
                *(row.text(least) for row in rows),
                sep="\n",
                file=table,
            )
            draw(above, below, title, rows, none)
    panels[0][0].set_ylabel("residual, relative to max |q|")
    panels[1][0].set_ylabel("time taken, ms")
    report.save(figure, path)
    return 0


if __name__ == "__main__":
    sys.exit(main())
