"""Random bodies between kinematic jaws that close until nothing can give way: what has no answer is
told, and no step works on it for ever.

    python tests/zoo/jams.py --count 20 --seed 0
"""

from __future__ import annotations

import argparse
import sys

import numpy as np

import perp

MOST = 10000  # iterations of a step: those of all methods but the last resorts, in each of its solves


def live(seed: int, steps: int = 90) -> str:
    """What is wrong; empty if nothing is."""
    g = np.random.default_rng(seed)
    world = perp.World(accuracy="exact", friction=g.uniform(0.3, 0.9))
    world.ground.add_plane((0, 0, 1))
    speed, tilt = g.uniform(0.5, 1.5), g.uniform(-0.2, 0.2)
    for side in (-1, 1):
        turn = (np.cos(tilt), 0, side * np.sin(tilt), 0)
        world.add_body(position=(0.6 * side, 0, 0.4), velocity=(-speed * side, 0, 0), kind="kinematic",
                       orientation=turn).add_box((0.1, 0.5, 0.8))
    for k in range(int(g.integers(3, 7))):
        turn, size = g.normal(size=4), g.uniform(0.08, 0.2)
        body = world.add_body(position=(0, g.uniform(-0.2, 0.2), 0.2 + 0.35 * k),
                              orientation=turn / np.linalg.norm(turn))
        if g.uniform() < 0.5:
            body.add_box(size * g.uniform(0.3, 1, 3))
        else:
            body.add_capsule(size * g.uniform(0.2, 0.5), size * g.uniform(0.2, 1))
    for step in range(steps):
        try:
            result = world.step(0.01)
        except perp.Error as error:
            return f"seed {seed}, step {step}: {error}"
        if result.iterations > MOST:
            return f"seed {seed}, step {step}: {result.iterations} iterations, {result.outcome}"
        if not np.isfinite(world.velocities).all():
            return f"seed {seed}, step {step}: numbers that are not finite"
    world.close()
    return ""


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=20)
    parser.add_argument("--seed", type=int, default=0)
    given, wrong = parser.parse_args(), 0
    for seed in range(given.seed, given.seed + given.count):
        found = live(seed)
        wrong += bool(found)
        if found:
            print(found, flush=True)
    print(f"{given.count} jams: {wrong} wrong")
    return int(wrong > 0)


if __name__ == "__main__":
    sys.exit(main())
