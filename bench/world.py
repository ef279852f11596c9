"""The dial: error against time a step, perp at every accuracy and other engines beside it.

    python bench/world.py DIRECTORY [SECONDS [SCENE...]]

Writes world.txt and world.png to DIRECTORY. All scenes have h = 0.01 s, one thread
(OPENBLAS_NUM_THREADS=1), nothing asleep; a scene goes on for 3 s of its own (a hit for 1 s) or
until a run has used SECONDS of processor time, 1 by default. 'median' and 'mean' are milliseconds
of processor time a step, 'ratio' the mean beside that of perp at standard. What is resting should
not move: 'drift' is the longest way of a body, 'sunk' the deepest fall, in metres; '<' marks runs
that ended early, whose numbers are of what they did. 'deep' is the deepest overlap of the run, by
an independent test of all pairs. 'rise' is energy from nowhere, beside that of the beginning.
'step' is the error of one step's velocities beside the exact ones from the same state (perp at
exact with tol 1e-10), in the kinetic metric and over what contacts change, the median of five; '?'
where neither the exact step is solved in time, nor two of them, from states next to each other,
agree to a third of the error. Phases, in ms: collide, solve, integrate, project.
'solved' counts steps whose outcome is good. Engines read the scenes as text and are run as their
manuals say; x4 stands for four times the default iterations, of MuJoCo for four substeps. In the
hit and the heap peers have n steps in one as well, the first n of 2, 4, ... 64 that overlaps no
deeper than perp at fast: what its accuracy costs there. Steps in parts differ in their method, so
that 'step' says little of them. 'goal' is
what the project wants to reach; it and the picture know only runs that came to the end of their
scene. Where perp's own is not known the picture has the overlap.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any, NamedTuple, Optional

import matplotlib.pyplot as plt
from matplotlib.ticker import NullFormatter

import report

BENCH = Path(os.environ.get("BUILD", "build")).resolve() / "bench"
PEERS = ("bullet", "ode", "mujoco", "box2d", "jolt", "rapier")
LEVELS = (("fast", 0), ("standard", 0), ("accurate", 0), ("exact", 0))
SUBSTEPS = (("standard", 2), ("standard", 16), ("standard", 32))
FLOOR = 1e-16  # where an error of 0 is drawn


class Scene(NamedTuple):
    title: str
    error: str  # what the picture and the goal speak of
    goal: Optional[tuple[float, float]]  # ms a step, error
    more: bool = True  # all settings
    longer: float = 1  # than SECONDS


SCENES = {
    "slide": Scene("one box sliding", "step", (0.0015, 1e-9)),
    "slide_planar": Scene("one box sliding in the plane", "step", (0.0008, 1e-9)),
    "rest": Scene("one box at rest", "drift", (0.00005, 0)),
    "rest_planar": Scene("one box at rest in the plane", "drift", (0.00005, 0)),
    "separate": Scene("1024 separate boxes sliding", "step", (1.2, 1e-9), False, 3),
    "separate_rest": Scene("1024 separate boxes at rest", "drift", (1.2, 0), False, 3),
    "pyramid": Scene("pyramid of 210 boxes", "drift", (0.6, 1e-3)),
    "pyramid_planar": Scene("the same in the plane", "drift", (0.2, 1e-12)),
    "hit": Scene("the pyramid hit by 20 kg at 30 m/s", "step", (1.5, 0.65), False, 4),
    "heap": Scene("1000 spheres falling in a heap", "deep", (3, 1e-3), False, 4),
    "wall": Scene("wall of 126 bricks", "drift", (0.4, 3e-3)),
    "stack": Scene("stack of 20", "drift", (0.1, 0)),
    "cards": Scene("card house of 15", "drift", (0.1, 0)),
    "tower_1e4": Scene("tower under 1e4 kg", "drift", (0.2, 0)),
    "tower_1e8": Scene("tower under 1e8 kg", "drift", (0.2, 0)),
    "tower_1e12": Scene("tower under 1e12 kg", "drift", (0.2, 0)),
}
LINEAR = {"free": ("free bodies", 1.3), "heaps": ("heaps of ten boxes at rest", 1.3),
          "packed": ("packed spheres in motion", 2.5)}  # and how the cost of a body may grow
LEAST_BODIES, MOST_BODIES, MOST_KB = 1000, 100000, 6.0
DRAWN = ("pyramid", "pyramid_planar", "wall", "stack", "hit", "heap")


class Run(NamedTuple):
    engine: str
    setting: str
    numbers: dict[str, list[float]]

    def error(self, scene: Scene) -> Optional[float]:
        """None where it is not known, or not that of the whole scene."""
        if self.numbers["time"][2] < self.numbers["steps"][0]:
            return None
        found = self.numbers.get({"step": "error"}.get(scene.error, scene.error))
        return found[0] if found else None


def read(text: str) -> dict[str, list[float]]:
    """Lines of a name and numbers."""
    numbers = {}
    for line in text.splitlines():
        name, *words = line.split()
        if words and words[0] != "unknown":
            numbers[name] = [float(word) for word in words]
    return numbers


def call(*command: Any, patience: float, **more: Any) -> Optional[str]:
    """What it prints; None after an error, or if it takes too long."""
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}
    try:
        return subprocess.run([str(word) for word in command], env=environment, text=True,
                              capture_output=True, timeout=patience, check=True, **more).stdout
    except (OSError, subprocess.SubprocessError) as error:
        print(f"  {command[0]} {command[1]}: {error}", file=sys.stderr)
        return None


def judge(name: str, record: Path) -> dict[str, list[float]]:
    return read(call(BENCH / "world", "judge", name, record, patience=60) or "")


def run_perp(
    name: str, accuracy: str, substeps: int, seconds: float, record: Path
) -> Optional[Run]:
    text = call(BENCH / "world", "play", name, accuracy, substeps, seconds, record, patience=60)
    if text is None:
        return None
    setting = accuracy + (f" n={substeps}" if substeps else "")
    return Run("perp", setting, {**read(text), **judge(name, record)})


def run_peer(name: str, engine: str, times: int, seconds: float, record: Path,
             parts: int = 1) -> Optional[Run]:
    scene = call(BENCH / "world", "scene", name, patience=60)
    text = call(BENCH / "peers" / engine, times, seconds, record, parts, patience=60, input=scene)
    if text is None or text.startswith("skipped"):
        return None
    setting = f"x{times}" if parts == 1 else f"n={parts}"
    return Run(engine, setting, {**read(text), **judge(name, record)})


def run_as_deep(name: str, engine: str, deep: float, seconds: float,
                record: Path) -> Optional[Run]:
    """In as many parts as make it overlap no deeper."""
    for parts in (2 ** k for k in range(1, 7)):
        run = run_peer(name, engine, 1, seconds, record, parts)
        if run is None or run.numbers.get("deep", [deep])[0] <= deep:
            return run
    return None


def engines() -> list[str]:
    """Builds the drivers of those that are there."""
    python = os.environ.get("PEERS_PYTHON", sys.executable)
    subprocess.run([Path(__file__).parent / "peers_world" / "build", BENCH / "peers", python])
    return [name for name in PEERS if os.access(BENCH / "peers" / name, os.X_OK)]


def run_all(name: str, scene: Scene, peers: list[str], seconds: float, record: Path) -> list[Run]:
    seconds *= scene.longer
    runs = [run_perp(name, *setting, seconds, record)
            for setting in LEVELS + (SUBSTEPS if scene.more else ())]
    for engine in peers:
        runs += [run_peer(name, engine, times, seconds, record)
                 for times in ((1, 4) if scene.more else (1,))]
        if not scene.more and runs[0] and scene.goal and not name.startswith("separate"):
            runs.append(run_as_deep(name, engine, runs[0].numbers["deep"][0], 20 * seconds, record))
    return [run for run in runs if run and {"time", "steps"} <= set(run.numbers)]


def cell(numbers: dict[str, list[float]], name: str, unknown: str = "-") -> str:
    return f"{numbers[name][0]:9.1e}" if name in numbers else f"{unknown:>9}"


def row(run: Run, unit: float, scene: Scene) -> str:
    numbers = run.numbers
    middle, mean, steps = numbers["time"]
    text = (f"{run.engine:7}{run.setting:14}{middle:10.4g}{mean:10.4g}{mean / unit:8.2f}"
            f"{int(steps):6}{' ' if steps >= numbers['steps'][0] else '<'}")
    for name in ("drift", "sunk", "deep", "rise"):
        text += cell(numbers, name)
    text += cell(numbers, "error", "?" if scene.error == "step" else "-")
    if "outcomes" in numbers:
        phases = " ".join(f"{phase:.2g}" for phase in numbers["phases"])
        text += f"  {int(numbers['outcomes'][0]):4} solved  {phases}"
    return text


def verdict(scene: Scene, runs: list[Run]) -> str:
    """The goal beside what came nearest to it."""
    if not scene.goal:
        return ""
    ms, error = scene.goal
    ours = [run for run in runs if run.engine == "perp" and run.error(scene) is not None]
    good = [run for run in ours if run.error(scene) <= error]
    text = f"goal: {ms:g} ms a step with {scene.error} <= {error:g}; "
    if not good:
        best = min(ours, key=lambda run: run.error(scene), default=None)
        return text + "MISSED: " + (
            f"{best.setting} comes to {best.error(scene):.1e}" if best else
            "no run came to the end with an error that is known")
    best = min(good, key=lambda run: run.numbers["time"][1])
    mean = best.numbers["time"][1]
    word = "met" if mean <= ms else f"MISSED by {mean / ms:.1f}"
    return text + f"{word}: {best.setting} takes {mean:.3g}"


def write_scene(scene: Scene, runs: list[Run], file: Any) -> None:
    unit = next((run.numbers["time"][1] for run in runs if run.setting == "standard"), 1.0)
    print(f"\n{scene.title}\n\n{'':21}{'median':>10}{'mean':>10}{'ratio':>8}{'steps':>6} "
          f"{'drift':>9}{'sunk':>9}{'deep':>9}{'rise':>9}{'step':>9}", file=file)
    for run in runs:
        print(row(run, unit, scene), file=file)
    print(verdict(scene, runs), file=file, flush=True)


def write_linear(seconds: float, file: Any) -> None:
    print(f"\ncost a body, us (median), of {LEAST_BODIES} and {MOST_BODIES} bodies; memory of the "
          f"latter, kB a body, goal {MOST_KB:g}\n", file=file)
    for name, (title, most) in LINEAR.items():
        cost, memory = [], 0.0
        for bodies in (LEAST_BODIES, MOST_BODIES):
            # all steps of both: the first ones cost more
            text = call(BENCH / "world", "play", f"{name}_{bodies}", "standard", 0,
                        max(seconds, 60.0), patience=120)
            if text is None:
                break
            numbers = read(text)
            cost.append(1e3 * numbers["time"][0] / bodies)
            memory = numbers["memory"][0] / bodies
        if len(cost) == 2:
            growth = cost[1] / cost[0]
            word = "met" if growth <= most and memory <= MOST_KB else "MISSED"
            print(f"{title:32}{cost[0]:8.3f}{cost[1]:8.3f}  {growth:.2f} times, goal {most:g}; "
                  f"{memory:.1f} kB: {word}", file=file)


def draw(axes: Any, scene: Scene, runs: list[Run]) -> None:
    if all(run.error(scene) is None for run in runs if run.engine == "perp"):
        scene = scene._replace(error="deep", goal=None)
    for engine in ("perp", *PEERS):
        own = [run for run in runs if run.engine == engine and run.error(scene) is not None]
        own.sort(key=lambda run: run.numbers["time"][1])
        x = [run.numbers["time"][1] for run in own]
        y = [min(max(run.error(scene), FLOOR), 100.0) for run in own]
        axes.plot(x, y, "o" if engine == "perp" else "x", markersize=5, label=engine,
                  linestyle="none" if engine == "perp" else ":")
        for run, x_run, y_run in zip(own, x, y) if engine == "perp" else ():
            axes.annotate(run.setting.replace("standard n", "n"), (x_run, y_run), fontsize=6,
                          rotation=75, xytext=(0, 5), textcoords="offset points")
    if scene.goal:
        axes.plot(scene.goal[0], max(scene.goal[1], FLOOR), "*", color="grey", label="goal")
    words = {"drift": "drift, m", "deep": "deepest overlap, m", "step": "error of a step"}
    axes.set(xscale="log", yscale="log", ylim=(FLOOR / 5, 300), title=scene.title,
             xlabel="ms a step", ylabel=words[scene.error])
    begin, end = axes.get_xlim()
    axes.set_xlim(0.6 * begin, 1.6 * end)
    axes.xaxis.set_minor_formatter(NullFormatter())
    ticks = [10.0**k for k in range(-15, 3, 3)]
    axes.set_yticks([FLOOR, *ticks], ["0", *(f"{tick:.0e}" for tick in ticks)])
    axes.grid(True, alpha=0.3)


def main() -> int:
    path = Path(sys.argv[1]) / "world.txt"
    seconds = float(sys.argv[2]) if len(sys.argv) > 2 else 1.0
    chosen = sys.argv[3:] or list(SCENES)
    panels = [name for name in DRAWN if name in chosen] or chosen
    figure, axes = plt.subplots(-(-len(panels) // 3), min(3, len(panels)), figsize=(14, 8),
                                squeeze=False, layout="constrained")
    peers = engines()
    with open(path, "w") as table, tempfile.TemporaryDirectory() as folder:
        report.heading(__doc__, table)
        for missing in (name for name in PEERS if name not in peers):
            print(f"{missing}: not installed, skipped", file=table)
        for name in chosen:
            scene = SCENES[name]
            print(f"world: {scene.title}", file=sys.stderr)
            runs = run_all(name, scene, peers, seconds, Path(folder) / "record")
            write_scene(scene, runs, table)
            if name in panels:
                draw(axes.flat[panels.index(name)], scene, runs)
        if len(sys.argv) <= 3:
            write_linear(seconds, table)
    handles = {h.get_label(): h for a in axes.flat for h in a.get_lines()}
    figure.legend(handles.values(), handles.keys(), loc="outside lower center", ncols=6, fontsize=8)
    report.save(figure, path)
    return 0


if __name__ == "__main__":
    sys.exit(main())
