"""What a time limit costs and buys: `auto` with shorter and shorter limits.

    python bench/time_limit.py DIRECTORY

Writes time_limit.txt and time_limit.png to DIRECTORY. A limit may be exceeded by a tenth of it or
by 5 ms, whichever is more, and by what it takes to tell what one point is worth; 'over' is what was
taken beyond the limit, in ms, with ! where that is more. The residual is
max |min(z, Mz+q)| / max |q| of the z returned; that of z = 0 is on top of each table.
Below, what `perp.lcp` takes from reading M to the answer, in ms, cold, with memory to be found: ! is
beyond the limit by more than a tenth and 5 ms. 'least' is with a limit that is over at once.
"""

from __future__ import annotations

import sys
import time
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


COLD: dict[str, Callable[[], Any]] = {
    "obstacle, 316 x 316": lambda: problems.grid_problem(316, 2),
    "obstacle, 512 x 512": lambda: problems.grid_problem(512, 2),
    "obstacle in space, 46^3": lambda: problems.grid_problem(46, 3),
    "obstacle in space, 64^3": lambda: problems.grid_problem(64, 3),
    "plate, 316 x 316": lambda: problems.grid_problem(316, 2, plate=True),
    "convection, 316 x 316": lambda: problems.grid_problem(316, 2, flow=0.9),
    "skew, random, n = 1e5": lambda: problems.skew(100000),
    "quadratic program, n = 1e5": lambda: problems.program(50000),
}
COLD_LIMITS = LIMITS[2:7]


def cold(M: Any, q: Any, limit: float) -> float:
    """Seconds from the call to the answer; the median."""
    seconds = []
    for _ in range(REPEATS):
        begun = time.perf_counter()
        perp.lcp(M, q, time_limit=limit)
        seconds.append(time.perf_counter() - begun)
    return float(np.median(seconds))


def write_cold(table: Any) -> None:
    heads = "".join(f"{1e3 * limit:>9.0f}" for limit in COLD_LIMITS)
    print(f"\ncold, limit in ms{'':11}{'least':>9}{heads}\n", file=table)
    for title, make in COLD.items():
        print(f"time_limit: {title}", file=sys.stderr)
        M, q = make()
        row = f"{title:28}{1e3 * cold(M, q, 1e-12):9.1f}"
        for limit in COLD_LIMITS:
            seconds = cold(M, q, limit)
            row += f"{1e3 * seconds:8.1f}" + " !"[seconds > limit + max(0.1 * limit, 5e-3)]
        print(row.rstrip(), file=table)


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
        write_cold(table)
    panels[0][0].set_ylabel("residual, relative to max |q|")
    panels[1][0].set_ylabel("time taken, ms")
    report.save(figure, path)
    return 0


if __name__ == "__main__":
    sys.exit(main())
