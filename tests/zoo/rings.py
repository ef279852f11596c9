"""Random rings of links on hinges, dropped on a plane: loops in which joints say the same, and press
each other with impulses of any size, while contacts come and go.

    python tests/zoo/rings.py --count 100 --seed 0

Judged without the library's word: kinetic and potential energy together never grow, and anchors, as
both bodies see them, stay together.
"""

from __future__ import annotations

import argparse
import math
import sys

import numpy as np

import perp

from scene import matrix, product

LEVELS = ("fast", "standard", "accurate", "exact")


def turn(axis: np.ndarray, angle: float) -> np.ndarray:
    return np.array((math.cos(0.5 * angle), *(math.sin(0.5 * angle) * axis)))


def make(seed: int, level: str) -> tuple[perp.World, list[tuple]]:
    """A world, and of each joint its bodies and where these see its anchor."""
    g = np.random.default_rng(seed)
    world = perp.World(accuracy=level, friction=g.uniform(0, 0.9))  # type: ignore[arg-type]
    world.ground.add_plane((0, 0, 1))
    count, ratio = int(g.integers(4, 14)), 10 ** g.uniform(0, 3)
    radius = 0.1 * count / math.pi
    whole = g.normal(size=4)
    whole /= np.linalg.norm(whole)
    R, centre = matrix(whole), np.array((0, 0, radius + 0.3))
    kind = str(g.choice(("ball", "revolute", "revolute")))
    links, joints = [], []
    half = radius * math.tan(math.pi / count)
    for k in range(count):
        angle = 2 * math.pi * k / count
        link = world.add_body(
            mass=g.uniform(0.1, 0.1 * ratio),
            position=centre + R @ (radius * np.array((math.cos(angle), math.sin(angle), 0))),
            orientation=product(whole, turn(np.array((0, 0, 1)), angle + 0.5 * math.pi)))
        if g.uniform() < 0.5:
            link.add_capsule(0.02, 0.8 * half)
        else:
            link.add_box((0.8 * half, 0.03, 0.02))
        links.append(link)
    for k in range(count):
        angle, out = 2 * math.pi * (k + 0.5) / count, radius / math.cos(math.pi / count)
        anchor = centre + R @ (out * np.array((math.cos(angle), math.sin(angle), 0)))
        a, b = links[k], links[(k + 1) % count]
        world.add_joint(kind, a, b, anchor=anchor, axis=R[:, 2])  # type: ignore[arg-type]
        joints.append((a, b, *(matrix(x.orientation).T @ (anchor - x.position) for x in (a, b))))
    if g.uniform() < 0.5:
        world.add_body(
            mass=10 ** g.uniform(-1, 1.5), position=(0, 0, 2 * radius + 0.8),
            velocity=(0, 0, -g.uniform(0, 10)), orientation=(1, 0, 0, 0),
        ).add_box((0.15, 0.1, 0.08))
    return world, joints


def live(seed: int, level: str, seconds: float = 1.5) -> str:
    """What is wrong; empty if nothing is."""
    world, joints = make(seed, level)
    h = float(np.random.default_rng([seed]).choice((0.01, 1 / 60, 1 / 240)))
    world.step(h)
    last = scale = world.energy().total  # heights are above the plane
    for step in range(round(seconds / h)):
        try:
            result = world.step(h)
        except perp.Error as error:
            return f"seed {seed}, {level}, step {step}: {error}"
        energy = world.energy().total
        apart = max(np.linalg.norm(a.position + matrix(a.orientation) @ p - b.position -
                                   matrix(b.orientation) @ q) for a, b, p, q in joints)
        if not energy <= last + 1e-3 * scale:
            return f"seed {seed}, {level}, step {step}: {(energy - last) / scale:.1e} of energy " \
                   f"come from nowhere ({result.outcome})"
        if not apart <= 1e-6:
            return f"seed {seed}, {level}, step {step}: apart by {apart:.1e} ({result.outcome})"
        last = energy
    world.close()
    return ""


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--count", type=int, default=100)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--levels", default=",".join(LEVELS))
    given, wrong = parser.parse_args(), 0
    for seed in range(given.seed, given.seed + given.count):
        for level in given.levels.split(","):
            found = live(seed, level)
            wrong += bool(found)
            if found:
                print(found, flush=True)
    print(f"{given.count} rings: {wrong} wrong")
    return int(wrong > 0)


if __name__ == "__main__":
    sys.exit(main())
