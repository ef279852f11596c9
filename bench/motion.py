"""Scenes in motion: what a step costs, perp at two levels and Bullet beside it.

    python bench/motion.py DIRECTORY [SECONDS [SCENE...]]

Writes motion.txt to DIRECTORY. All have h = 0.01 s, one thread (OPENBLAS_NUM_THREADS=1) and nothing
asleep; Bullet takes its 10 iterations, in one step of h (n=1), and in n steps of h / n: the first n
of 2, 4, 8, ... 64 that overlaps no deeper than perp at fast does. A run ends with its scene or after SECONDS of processor
time, 30 by default; '<' marks those that ended early, whose numbers are of the steps that they did.
Piles in motion are chaotic, and one trajectory of bin or planar takes up to 15 % more than another:
each scene is run under three gravities that differ by 1e-5 of it. 'mean' is the mean of the three;
'median', 'p99' and 'max' are their medians, milliseconds of processor time a step; 'overlap' is the
largest of all contacts in all three after the first tenth of the steps (some boxes of the bin begin
in each other), as each engine measures its own, in metres. 'energy' is in joules, at the
beginning and in the end, 'residual' the median of those above 0. Then steps by their outcome, both
of the first run.
"""

from __future__ import annotations

import os
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any, Optional

import motion_scenes
import report

BENCH = Path(os.environ.get("BUILD", "build")) / "bench"
PEER = BENCH / "peers" / "motion_bullet"
LEVELS = ("fast", "standard")
GRAVITIES = (1.0, 1.0 + 1e-5, 1.0 - 1e-5)
MOST_SUBSTEPS = 64
TIMES = ("mean", "median", "p99", "max")


def read(line: str) -> dict[str, list[str]]:
    """'NAME SETTING key value...'; energy has two values, and what follows residual is outcomes."""
    words = line.split()[2:]
    numbers: dict[str, list[str]] = {}
    while words:
        count = 3 if words[0] == "energy" else 2
        numbers[words[0]] = words[1:count]
        words = words[count:]
    return numbers


def variants(path: Path) -> list[Path]:
    """The scene in a file for each of GRAVITIES (words 6 to 8 of its first line)."""
    head, body = path.read_text().split("\n", 1)
    words, paths = head.split(), []
    for k, factor in enumerate(GRAVITIES):
        gravity = [repr(factor * float(word)) for word in words[6:9]]
        paths.append(path.with_suffix(f".{k}"))
        paths[-1].write_text(" ".join(words[:6] + gravity + words[9:]) + "\n" + body)
    return paths


def run(program: Path, paths: list[Path], *options: Any) -> Optional[dict[str, list[str]]]:
    """The numbers of the first path's line, times and overlap of all; None without an answer."""
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}
    found = []
    for path in paths:
        command = [str(word) for word in (program, path, *options)]
        try:
            text = subprocess.run(command, env=environment, text=True, capture_output=True,
                                  timeout=300, check=True).stdout
        except (OSError, subprocess.SubprocessError) as error:
            print(f"  {program}: {error}", file=sys.stderr)
            return None
        if text.startswith("skipped"):
            return None
        found.append(read(text))
    for name, middle in (*((name, statistics.median) for name in TIMES),
                         ("mean", statistics.mean), ("overlap", max)):
        found[0][name] = [f"{middle([float(numbers[name][0]) for numbers in found]):.4g}"]
    return found[0]


def row(engine: str, setting: str, numbers: dict[str, list[str]], steps: int) -> str:
    done = int(numbers.pop("steps")[0])
    text = f"{engine:7}{setting:9}"
    for name in TIMES:
        text += f"{float(numbers.pop(name)[0]):10.4g}"
    text += f"{done:6}{' ' if done >= steps else '<'}{numbers.pop('overlap')[0]:>9}"
    text += "".join(f"{float(number):11.5g}" for number in numbers.pop("energy"))
    text += f"{numbers.pop('residual', ['-'])[0]:>10}"
    return text + "".join(f"  {count[0]} {name}" for name, count in numbers.items())


def write_scene(path: Path, seconds: float, file: Any) -> None:
    steps = int(path.read_text().split(None, 4)[3])
    print(f"\n{path.stem}\n\n{'':16}" + "".join(f"{name:>10}" for name in TIMES)
          + f"{'steps':>6} {'overlap':>9}{'energy':>11}{'':11}{'residual':>10}", file=file)
    paths = variants(path)
    overlaps = []
    for level in LEVELS:
        numbers = run(BENCH / "motion", paths, level, seconds)
        if numbers:
            overlaps.append(float(numbers["overlap"][0]))
            print(row("perp", level, numbers, steps), file=file, flush=True)
    numbers, n = run(PEER, paths, seconds) if os.access(PEER, os.X_OK) else None, 1
    if numbers:
        deepest = float(numbers["overlap"][0])
        print(row("bullet", "n=1", numbers, steps), file=file, flush=True)
        while numbers and overlaps and deepest > overlaps[0] and n < MOST_SUBSTEPS:
            n *= 2
            numbers = run(PEER, paths, seconds, n)
            deepest = float(numbers["overlap"][0]) if numbers else 0.0
        if numbers and n > 1:
            print(row("bullet", f"n={n}", numbers, steps), file=file, flush=True)


def main() -> int:
    seconds = float(sys.argv[2]) if len(sys.argv) > 2 else 30.0
    subprocess.run([Path(__file__).parent / "peers_world" / "build", PEER.parent, sys.executable,
                    "motion"])
    with tempfile.TemporaryDirectory() as folder, \
            open(Path(sys.argv[1]) / "motion.txt", "w") as table:
        names = motion_scenes.write_all(Path(folder))
        report.heading(__doc__, table)
        if not os.access(PEER, os.X_OK):
            print("bullet: not installed, skipped", file=table)
        for name in sys.argv[3:] or names:
            print(f"motion: {name}", file=sys.stderr)
            write_scene(Path(folder) / f"{name}.scene", seconds, table)
    return 0


if __name__ == "__main__":
    sys.exit(main())
