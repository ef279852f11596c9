"""Time against reached residual: a curve a method and problem class, peers beside it.

    python bench/work_precision.py DIRECTORY [CLASS...]

Writes work_precision.txt and work_precision.png to DIRECTORY. A point is one solve of a solver that
was set up before: its wall time (the best of some) and the natural residual max |min(z, Mz+q)|,
recomputed here from M and q for every code alike and divided by max |q|. A method that has a
tolerance is run with tolerances from 1e-1 to 1e-12; perp's polish is off for pgs, so that its curve
is its own. Peers (quantecon, Siconos, Drake) run in a process of their own, in this Python, in the
system's, or in the one that PEERS_PYTHON names; one that is nowhere installed is skipped with a
word. 20 seconds are the limit of a peer on one problem.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any, NamedTuple, Optional

import matplotlib.pyplot as plt
import numpy as np
import perp
from scipy import sparse

import peers
import problems
import report

TOLERANCES = 10.0 ** -np.arange(1.0, 13.0)
PEER_TOLERANCES = (1e-2, 1e-4, 1e-6, 1e-8, 1e-10)
PEER_SECONDS = 20
LARGEST_FOR_PEERS = 1100  # they take dense matrices only

CLASSES = {
    "definite": ("random positive definite, n = 500", lambda: problems.random_definite(500)),
    "obstacle": ("obstacle, 32 x 32, sparse", lambda: problems.obstacle(32)),
    "contact": (
        "contact, 5 boxes, mass ratio 1e4",
        lambda: problems.contact_stack(5, 8, 1e4, 0.5),
    ),
}

# name of a curve: keyword arguments of perp.LCP; None: no tolerance to vary
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


class Point(NamedTuple):
    curve: str
    tolerance: Optional[float]
    seconds: float
    residual: float
    outcome: str


def perp_points(M: Any, q: Any) -> list[Point]:
    points = []
    for curve, (options, varies) in PERP.items():
        for tolerance in TOLERANCES if varies else (1e-10,):
            try:
                solver = perp.LCP(M, tol=float(tolerance), **options)
                results = [solver.solve(q)]
            except perp.Error as error:
                print(f"  perp {curve}: {error}", file=sys.stderr)
                break
            while len(results) < 20 and sum(r.seconds for r in results) < 0.5:
                results.append(solver.solve(q))
            best = min(results, key=lambda r: r.seconds)
            reached = problems.residual(M, q, best.z)
            points.append(Point(f"perp {curve}", tolerance, best.seconds, reached, best.outcome))
    return points


def interpreters() -> list[str]:
    named = os.environ.get("PEERS_PYTHON")
    return ([named] if named else []) + [sys.executable, "/usr/bin/python3"]


def run_peer(name: str, problem: Path, tolerance: float) -> tuple[str, Any]:
    """Returns ("ok", the answer), or a word on why there is none and None."""
    answer = problem.with_name("answer.npz")
    environment = {k: v for k, v in os.environ.items() if k != "PYTHONPATH"}
    for python in interpreters():
        command = [python, peers.__file__, name, str(problem), str(answer), str(tolerance)]
        try:
            done = subprocess.run(command, env=environment, timeout=PEER_SECONDS, stdout=2,
                                  stderr=subprocess.DEVNULL)
        except subprocess.TimeoutExpired:
            return f"more than {PEER_SECONDS} s", None
        except OSError:
            continue
        if done.returncode == 0:
            return "ok", np.load(answer)
        if done.returncode != 3:
            return f"ended with status {done.returncode}", None
    return "not installed", None


def peer_points(M: Any, q: Any) -> list[Point]:
    if len(q) > LARGEST_FOR_PEERS:
        return []
    points = []
    with tempfile.TemporaryDirectory() as directory:
        problem = Path(directory) / "problem.npz"
        np.savez(problem, M=M.toarray() if sparse.issparse(M) else M, q=q)
        for name, (_, _, varies) in peers.PEERS.items():
            for tolerance in PEER_TOLERANCES if varies else (1e-10,):
                word, answer = run_peer(name, problem, tolerance)
                if answer is None:
                    print(f"  {name}: {word}, skipped", file=sys.stderr)
                    break
                reached = problems.residual(M, q, answer["z"])
                points.append(Point(name, tolerance, float(answer["seconds"]), reached, ""))
    return points


def write_table(file: Any, title: str, n: int, points: list[Point]) -> None:
    fastest = min(p.seconds for p in points if p.residual < 1e-8)
    print(f"\n{title} (n = {n})\n", file=file)
    print(f"{'':24}{'tol':>8}{'residual':>10}{'ms':>12}{'ratio':>9}  outcome", file=file)
    for p in points:
        print(
            f"{p.curve:24}{p.tolerance:8.0e}{p.residual:10.1e}{1e3 * p.seconds:12.3f}"
            f"{p.seconds / fastest:9.2f}  {p.outcome}",
            file=file,
        )


def draw(axes: Any, title: str, points: list[Point]) -> None:
    names = [f"perp {curve}" for curve in PERP] + list(peers.PEERS)
    for curve in dict.fromkeys(p.curve for p in points):
        own = [p for p in points if p.curve == curve]
        ours = curve.startswith("perp")
        axes.plot(
            [1e3 * p.seconds for p in own],
            [min(max(p.residual, 1e-17), 10.0) for p in own],  # 10: a wrong answer, however wrong
            marker="o" if ours else "x",
            linestyle="-" if ours else ":",
            markersize=5,
            color=plt.get_cmap("tab20")(names.index(curve)),
            label=curve,
        )
    axes.set(xscale="log", yscale="log", ylim=(1e-17, 30), title=title, xlabel="time, ms")
    axes.grid(True, alpha=0.3)


def main() -> int:
    directory = Path(sys.argv[1])
    chosen = sys.argv[2:] or list(CLASSES)
    figure, all_axes = plt.subplots(1, len(chosen), figsize=(5.2 * len(chosen), 4.6), squeeze=False)
    path = directory / "work_precision.txt"
    with open(path, "w") as table:
        report.heading(__doc__, table)
        for name, axes in zip(chosen, all_axes[0]):
            title, make = CLASSES[name]
            M, q = make()
            print(f"work_precision: {title}", file=sys.stderr)
            points = perp_points(M, q) + peer_points(M, q)
            write_table(table, title, len(q), points)
            draw(axes, title, points)
    all_axes[0][0].set_ylabel("residual, relative to max |q|")
    handles = {h.get_label(): h for axes in all_axes[0] for h in axes.get_lines()}
    figure.legend(handles.values(), handles.keys(), loc="outside lower center", ncols=6, fontsize=8)
    figure.set_layout_engine("constrained")
    report.save(figure, path)
    return 0


if __name__ == "__main__":
    sys.exit(main())
