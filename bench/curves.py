"""Curves of time against reached residual: perp's from solvers that are kept, peers' from a process
of their own, one table and one picture of them all."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any, Callable, Mapping, NamedTuple, Optional

import matplotlib.pyplot as plt
import numpy as np
import perp

import peers
import report

TOLERANCES = 10.0 ** -np.arange(1.0, 13.0)
PEER_TOLERANCES = (1e-2, 1e-4, 1e-6, 1e-8, 1e-10)
PEER_SECONDS = 10

Residual = Callable[[Any], float]  # of any code's answer


class Point(NamedTuple):
    curve: str
    tolerance: Optional[float]
    seconds: float
    residual: float
    outcome: str


class Problem(NamedTuple):
    size: str  # in words
    own: list[Point]
    peers: list[Point]


def own_points(
    methods: Mapping[str, tuple[dict[str, Any], bool]],
    make: Callable[..., Callable[[], Any]],
    answer: Callable[[Any], Any],
    residual: Residual,
) -> list[Point]:
    """methods: name of a curve: (settings, whether there is a tolerance to vary). make(tol=...,
    **settings) returns a function that solves once, answer(its result) what a residual is of."""
    points = []
    for curve, (settings, varies) in methods.items():
        for tolerance in TOLERANCES if varies else (1e-10,):
            try:
                solve = make(tol=float(tolerance), **settings)
                results = [solve()]
            except perp.Error as error:
                print(f"  perp {curve}: {error}", file=sys.stderr)
                break
            while len(results) < 20 and sum(r.seconds for r in results) < 0.5:
                results.append(solve())
            best = min(results, key=lambda r: r.seconds)
            reached = residual(answer(best))
            points.append(Point(f"perp {curve}", tolerance, best.seconds, reached, best.outcome))
    return points


def interpreters() -> list[str]:
    named = os.environ.get("PEERS_PYTHON", "").split(":")
    return [path for path in named if path] + [sys.executable, "/usr/bin/python3"]


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


def peer_points(those: Mapping[str, Any], residual: Residual, **problem: Any) -> list[Point]:
    """The peers' curves, each up to where a smaller tolerance no longer helps; one that has no
    answer gets a point without numbers, that says why."""
    points = []
    with tempfile.TemporaryDirectory() as directory:
        path = Path(directory) / "problem.npz"
        np.savez(path, **problem)
        for name, (_, _, varies) in those.items():
            least = np.inf
            for tolerance in PEER_TOLERANCES if varies else (1e-10,):
                word, answer = run_peer(name, path, tolerance)
                if answer is None:
                    points.append(Point(name, tolerance, np.nan, np.nan, word))
                    break
                seconds, reached = float(answer["seconds"]), residual(answer["answer"])
                points.append(Point(name, tolerance, seconds, reached, ""))
                if reached >= least:
                    break
                least = reached
    return points


def write_table(file: Any, title: str, size: str, points: list[Point]) -> None:
    fastest = min((p.seconds for p in points if p.residual < 1e-8), default=np.nan)
    print(f"\n{title} ({size})\n", file=file)
    print(f"{'':24}{'tol':>8}{'residual':>10}{'ms':>12}{'ratio':>9}  outcome", file=file)
    for p in points:
        numbers = f"{p.residual:10.1e}{1e3 * p.seconds:12.3f}{p.seconds / fastest:9.2f}"
        numbers = f"{'':31}" if np.isnan(p.seconds) else numbers
        print(f"{p.curve:24}{p.tolerance:8.0e}{numbers}  {p.outcome}", file=file)


def draw(axes: Any, title: str, points: list[Point], names: list[str]) -> None:
    for curve in dict.fromkeys(p.curve for p in points if p.residual == p.residual):
        own = [p for p in points if p.curve == curve]
        ours = curve.startswith("perp")
        axes.plot(
            [1e3 * p.seconds for p in own],
            [min(max(p.residual, 1e-17), 10.0) for p in own],  # 10: a wrong answer, however wrong
            marker="o" if ours else "x",
            linestyle="-" if ours else ":",
            markersize=5,
            color=plt.get_cmap("tab20")(2 * names.index(curve) % 19),  # dark ones first
            label=curve,
        )
    axes.set(xscale="log", yscale="log", ylim=(1e-17, 30), title=title, xlabel="time, ms")
    axes.grid(True, alpha=0.3)


def write(
    about: str, path: Path, names: list[str], classes: Mapping[str, Callable[[], Problem]], y: str
) -> None:
    """Table and picture of some classes; names: those of all curves, for their colours."""
    figure, panels = plt.subplots(1, len(classes), figsize=(5.2 * len(classes), 4.6), squeeze=False)
    with open(path, "w") as table:
        report.heading(about, table)
        for (title, measure), axes in zip(classes.items(), panels[0]):
            print(f"{path.stem}: {title}", file=sys.stderr)
            size, own, others = measure()
            write_table(table, title, size, own + others)
            draw(axes, title, own + others, names)
    panels[0][0].set_ylabel(y)
    handles = {h.get_label(): h for axes in panels[0] for h in axes.get_lines()}
    figure.legend(handles.values(), handles.keys(), loc="outside lower center", ncols=6, fontsize=8)
    figure.set_layout_engine("constrained")
    report.save(figure, path)
