"""Steps scenes and judges them without the library's word; the zoo's table."""

from __future__ import annotations

import time
from collections import defaultdict
from typing import Iterable, NamedTuple, Optional

import numpy as np

import equilibrium
from scene import Scene

STEP = 0.01
FALLS = 5  # steps of what falls


class Run(NamedTuple):
    wrong: Optional[str]  # what the world did that it should not
    steps: int
    seconds: float  # a step


def run_stands(scene: Scene, accuracy: str, steps: int) -> Run:
    """Velocities are the carrier's to the last bit after every step, and bodies where they were, or
    beside it moved by as much to rounding."""
    world, bodies = scene.build(accuracy)
    dynamic = [bodies[k].index for k in scene.dynamic()]
    still = not any(scene.velocity)
    velocity = np.array(scene.flat(scene.velocity))
    states = (world.positions, world.orientations, world.velocities, world.angular_velocities)
    places, turns, velocities, spins = states
    place, turn = places[dynamic].copy(), turns[dynamic].copy()
    wrong, seconds, k = None, 0.0, 0
    for k in range(1, steps + 1):
        start = time.process_time()
        result = world.step(STEP)
        seconds += time.process_time() - start
        off = np.abs(velocities[dynamic] - velocity).max()
        spin = np.abs(spins[dynamic]).max()
        moved = np.abs(places[dynamic] - place - k * STEP * velocity).max()
        turned = np.abs(turns[dynamic] - turn).max()
        # Carried, each step rounds once, and the product above.
        largest = max(np.abs(places).max(), np.abs(place).max())
        least = 0.0 if still else (k + 2) * 2.0**-52 * largest
        if not result.advanced:
            wrong = f"step {k} not taken: {result.outcome}"
        elif off or spin:
            wrong = f"step {k} moves at {off:.1e}, turns at {spin:.1e} ({result.outcome})"
        elif moved > least or turned:
            wrong = f"step {k} moved by {moved:.1e}, turned by {turned:.1e}"
        if wrong:
            break
    del places, turns, velocities, spins, states
    world.close()
    return Run(wrong, k, seconds / k)


def run_falls(scene: Scene, accuracy: str, steps: int = FALLS) -> Run:
    """Something moves, and ever faster, until it has moved so far that it may strike."""
    world, bodies = scene.build(accuracy)
    dynamic = [bodies[k].index for k in scene.dynamic()]
    velocity = np.array(scene.flat(scene.velocity))
    length, speeds, seconds = scene.length(), [], 0.0
    wrong, first = None, world.positions[dynamic].copy()
    for k in range(steps):
        start = time.process_time()
        result = world.step(STEP)
        seconds += time.process_time() - start
        speed = np.abs(world.velocities[dynamic] - velocity).max()
        speeds.append(max(speed, length * np.abs(world.angular_velocities[dynamic]).max()))
        if not result.advanced:
            wrong = f"step {k + 1} not taken: {result.outcome}"
    way = np.abs(world.positions[dynamic] - first - steps * STEP * velocity).max()
    if not wrong and not speeds[0] > 0:
        wrong = "did not move in the first step"
    elif not wrong and way < 1e-3 * length and not speeds[-1] > 0:
        wrong = f"came to rest where it cannot stand: first {speeds[0]:.1e}, at most {max(speeds):.1e}"
    world.close()
    return Run(wrong, steps, seconds / steps)


def run(scene: Scene, stands: bool, accuracy: str, steps: int) -> Run:
    """What raises is wrong as well."""
    import perp

    try:
        return run_stands(scene, accuracy, steps) if stands else run_falls(scene, accuracy)
    except perp.Error as error:
        return Run(f"raises {type(error).__name__}: {error}", 1, 0.0)


def verdict(scene: Scene) -> equilibrium.Verdict:
    """Clarabel's; of what has a closed form the closed form's where Clarabel cannot tell."""
    known = None
    if scene.share is not None:
        known = "stands" if scene.share < 1 else "falls"
    if equilibrium.clarabel is None:
        return equilibrium.Verdict(known or "edge", 0.0, "no Clarabel", 0.0, 0)
    found = equilibrium.decide(scene)
    if known and found.word == "edge":
        found = found._replace(word=known)
    elif known and found.word != known:
        print(f"{scene}: {known} by its closed form, but {found}", flush=True)
        found = found._replace(word="unclear")
    return found


class Row:
    """Of the table: a class of scenes."""

    def __init__(self) -> None:
        self.words = {"stands": 0, "falls": 0, "edge": 0, "unclear": 0}
        self.wrong: dict[tuple[str, str], int] = defaultdict(int)  # by level and verdict
        self.seconds: dict[str, list[float]] = defaultdict(list)  # a step of what stands


def report(scenes: Iterable[Scene], levels: tuple[str, ...], steps: int, verbose: bool) -> int:
    """Runs them all, tells what is wrong and how to see it again; returns 1 if something is."""
    table: dict[str, Row] = defaultdict(Row)
    for scene in scenes:
        row, found = table[scene.kind], verdict(scene)
        row.words[found.word] += 1
        if verbose:
            print(f"{scene}: {found}", flush=True)
        if found.word in ("edge", "unclear"):
            continue
        for level in levels:
            stands = found.word == "stands"
            done = run(scene, stands, level, steps)
            if stands:
                row.seconds[level].append(done.seconds)
            if done.wrong:
                row.wrong[level, found.word] += 1
                again = f"--seed {scene.seed} --count 1 --kind {scene.kind} --levels {level}"
                again += f" --size {scene.size}" if scene.size else ""
                print(f"{found.word} by {found.margin:.1e}, {level}: {done.wrong}\n    {scene}\n"
                      f"    python tests/zoo/assemblies.py {again}", flush=True)
    print_table(table, levels)
    return int(any(sum(row.wrong.values()) for row in table.values()))


def print_table(table: dict[str, Row], levels: tuple[str, ...]) -> None:
    print("\nviolations are of what stands + of what falls; times are ms a step of what stands")
    wide = "".join(f"{level:>20}" for level in levels)
    print(f"{'class':<12}{'scenes':>7}{'stands':>7}{'falls':>7}{'edge':>6}{'unclear':>8}{wide}")
    total = Row()
    for kind, row in table.items():
        print_row(kind, row, levels)
        for word, count in row.words.items():
            total.words[word] += count
        for key, count in row.wrong.items():
            total.wrong[key] += count
        for level, seconds in row.seconds.items():
            total.seconds[level] += seconds
    print_row("all", total, levels)


def print_row(kind: str, row: Row, levels: tuple[str, ...]) -> None:
    cells = ""
    for level in levels:
        stands, falls = row.wrong[level, "stands"], row.wrong[level, "falls"]
        seconds = row.seconds[level]
        mean = f"{1e3 * sum(seconds) / len(seconds):.2f}" if seconds else "-"
        cells += f"{f'{stands} + {falls}':>11}{mean:>9}"
    words = row.words
    print(f"{kind:<12}{sum(words.values()):>7}{words['stands']:>7}{words['falls']:>7}"
          f"{words['edge']:>6}{words['unclear']:>8}{cells}")
