"""Random lives of worlds, made from a seed: bodies and joints come and go, velocities are set, steps
change their length, snapshots are restored, things fall asleep and are woken.

    python tests/zoo/lives.py --count 100 --seed 0

Three worlds live the same life: one whose bodies sleep, one that is wakeful and one with two threads.
Whatever happens, they have the same bits (docs/world.md), finite ones, and no step raises.
"""

from __future__ import annotations

import argparse
import sys
from typing import Any

import numpy as np

import perp

LEVELS = ("fast", "standard", "accurate", "exact")
WORLDS: tuple[dict[str, Any], ...] = ({}, {"wakeful": True}, {"threads": 2})
CHANGES, SHARES = ("", "remove", "add", "join", "part", "push"), (0.74, 0.05, 0.07, 0.08, 0.02, 0.04)
STEPS = 80


def add_body(world: perp.World, rng: np.random.Generator, height: float) -> perp.Body:
    flat = world.planar
    place = np.append(rng.uniform(-1.5, 1.5, 1 if flat else 2), height)
    size = rng.uniform(0.1, 0.35, 2 if flat else 3)
    q = rng.normal(size=4)
    mass = rng.uniform(0.2, 5.0)
    moments = 0.1 * mass * size.max() ** 2 * (1.0 if flat else rng.uniform(1.0, 1.9, 3))
    body = world.add_body(
        mass=mass, inertia=moments, position=place,
        orientation=rng.uniform(-3, 3) if flat else q / np.linalg.norm(q),
        kind=str(rng.choice(("dynamic", "kinematic"), p=(0.85, 0.15))),
        velocity=rng.normal(size=len(place)) * rng.choice((0.0, 1.0)),
    )
    kind = rng.integers(3)
    if kind == 0:
        body.add_sphere(size[0])
    elif kind == 1:
        body.add_box(size)
    else:
        body.add_capsule(0.5 * size[0], size[1])
    return body


def add_joint(world: perp.World, rng: np.random.Generator, a: perp.Body, b: perp.Body) -> None:
    """Not to what moves as it is told: that may ask for what the ground forbids."""
    kinds = ("ball", "revolute", "prismatic", "fixed", "distance")
    kind = str(rng.choice(kinds if world.planar else (*kinds, "cylindrical", "planar", "screw")))
    settings: dict[str, Any] = {}
    if kind in ("revolute", "prismatic") and rng.uniform() < 0.6:
        settings = {"lower": -rng.uniform(0, 0.5), "upper": rng.uniform(0, 0.5)}
    if kind in ("revolute", "prismatic") and rng.uniform() < 0.3:
        settings |= {"motor_speed": rng.uniform(-2, 2), "motor_force": rng.uniform(0, 5)}
    if kind in ("revolute", "prismatic") and rng.uniform() < 0.3:
        settings["friction"] = rng.uniform(0, 1)
    if kind in ("prismatic", "planar", "cylindrical", "screw", "revolute"):
        axis = rng.normal(size=2 if world.planar else 3)
        if not (world.planar and kind == "revolute"):
            settings["axis"] = axis
    if kind == "screw":
        settings["pitch"] = rng.uniform(-0.1, 0.1)
    if a.kind == b.kind == "dynamic":
        world.add_joint(kind, a, b, **settings)  # type: ignore[arg-type]


def change(world: perp.World, what: str, i: int, j: int, rng: np.random.Generator) -> None:
    """What a caller does between steps, to bodies i and j."""
    bodies = world.bodies
    if what == "remove" and len(bodies) > 4:
        bodies[i].remove()
    elif what == "add" and len(bodies) < 14:
        add_body(world, rng, 3.0)
    elif what == "join":
        add_joint(world, rng, bodies[i], bodies[j])
    elif what == "part":
        for joint in world.joints[:1]:
            joint.remove()
    elif what == "push":
        bodies[i].velocity = rng.normal(size=2 if world.planar else 3)


def states(world: perp.World) -> list[np.ndarray]:
    return [np.array(values) for values in (
        world.positions, world.orientations, world.velocities, world.angular_velocities)]


def begin(rng: np.random.Generator, planar: bool, level: str) -> list[perp.World]:
    """Some bodies above each other, in one world for each of the settings."""
    down, mu = float(rng.choice((0.0, 9.81))), float(rng.choice((0.0, 0.5)))
    bodies, made = int(rng.integers(3, 10)), int(rng.integers(2**31))
    worlds = [
        perp.World(gravity=(0, -down) if planar else (0, 0, -down), planar=planar, friction=mu,
                   accuracy=level, **settings)  # type: ignore[arg-type]
        for settings in WORLDS
    ]
    for world in worlds:
        own = np.random.default_rng(made)
        world.ground.add_plane((0, 1) if planar else (0, 0, 1))
        for k in range(bodies):
            add_body(world, own, 0.5 + 0.6 * k)
    return worlds


def live(seed: int, steps: int = STEPS) -> str:
    """What is wrong with that life; empty if nothing is."""
    rng = np.random.default_rng(seed)
    planar, level, h = bool(rng.integers(2)), str(rng.choice(LEVELS)), 0.01
    name = f"seed {seed}, {'planar' if planar else 'space'}, {level}"
    worlds = begin(rng, planar, level)
    kept = None
    for step in range(steps):
        if rng.uniform() < 0.2:
            h = float(10 ** rng.uniform(-3, -1.7))
        what, made = str(rng.choice(CHANGES, p=SHARES)), int(rng.integers(2**31))
        i, j = rng.choice(len(worlds[0].bodies), 2, replace=False)
        kept = None if what else kept
        if kept is None and not what:
            kept = [world.snapshot() for world in worlds], []
        try:
            for world in worlds:
                change(world, what, i, j, np.random.default_rng(made))
                world.step(h)
        except perp.Error as error:
            return f"{name}, step {step}: {error}"
        now = [states(world) for world in worlds]
        if not all(np.isfinite(values).all() for values in now[0]):
            return f"{name}, step {step}: numbers that are not finite"
        for other, settings in zip(now[1:], WORLDS[1:]):
            if not all(np.array_equal(a, b) for a, b in zip(now[0], other)):
                return f"{name}, step {step}: {settings} has other bits"
        if kept is None:
            continue
        kept[1].append((h, now[0]))
        if len(kept[1]) < 6:
            continue
        for world, snapshot in zip(worlds, kept[0]):
            world.restore(snapshot)
            for length, before in kept[1]:
                world.step(length)
                if not all(np.array_equal(a, b) for a, b in zip(before, states(world))):
                    return f"{name}, step {step}: restored, it lives another life"
        kept = None
    for world in worlds:
        world.close()
    return ""


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--count", type=int, default=100)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    wrong = 0
    for seed in range(options.seed, options.seed + options.count):
        found = live(seed)
        wrong += bool(found)
        if found:
            print(found)
    print(f"{wrong} of {options.count} lives wrong")
    return wrong > 0


if __name__ == "__main__":
    sys.exit(main())
