"""Random lives of worlds, made from a seed: bodies and joints come and go, velocities are set, steps
change their length, snapshots are restored, things fall asleep and are woken.

    python tests/zoo/lives.py --count 100 --seed 0

Three worlds live the same life: one whose bodies sleep, one that is wakeful and one with two threads.
Whatever happens, they have the same bits (docs/world.md), finite ones, and no step raises.
"""

from __future__ import annotations

import argparse
import sys
from typing import Any, Callable

import numpy as np

import perp

LEVELS = ("fast", "standard", "accurate", "exact")
WORLDS: tuple[dict[str, Any], ...] = ({}, {"wakeful": True}, {"threads": 2})
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


def choose(rng: np.random.Generator, bodies: int) -> tuple[str, Callable[[perp.World], None]]:
    """What happens before a step, as a name and as what it does to each of the worlds."""
    what, seed = rng.uniform(), int(rng.integers(2**31))
    i, j = rng.choice(bodies, 2, replace=False)

    def own() -> np.random.Generator:
        return np.random.default_rng(seed)

    if what < 0.05 and bodies > 4:
        return "remove", lambda world: world.bodies[i].remove()
    if what < 0.12 and bodies < 14:
        return "add", lambda world: (add_body(world, own(), 3.0), None)[1]
    if what < 0.2:
        def join(world: perp.World) -> None:
            add_joint(world, own(), world.bodies[i], world.bodies[j])

        return "join", join
    if what < 0.22:
        return "part", lambda world: [joint.remove() for joint in world.joints[:1]].clear()
    if what < 0.26:
        velocity = own().normal(size=3)

        def push(world: perp.World) -> None:
            world.bodies[i].velocity = velocity[: 2 if world.planar else 3]

        return "push", push
    return "", lambda world: None


def states(world: perp.World) -> list[np.ndarray]:
    return [np.array(values) for values in (
        world.positions, world.orientations, world.velocities, world.angular_velocities)]


def live(seed: int, steps: int = STEPS) -> str:
    """What is wrong with that life; empty if nothing is."""
    rng = np.random.default_rng(seed)
    planar, level = bool(rng.integers(2)), str(rng.choice(LEVELS))
    down = float(rng.choice((0.0, 9.81)))
    mu, bodies, h = float(rng.choice((0.0, 0.5))), int(rng.integers(3, 10)), 0.01
    name = f"seed {seed}, {'planar' if planar else 'space'}, {level}"
    worlds = [
        perp.World(gravity=(0, -down) if planar else (0, 0, -down), planar=planar, friction=mu,
                   accuracy=level, **settings)  # type: ignore[arg-type]
        for settings in WORLDS
    ]
    begun = int(rng.integers(2**31))
    for world in worlds:
        own = np.random.default_rng(begun)
        world.ground.add_plane((0, 1) if planar else (0, 0, 1))
        for k in range(bodies):
            add_body(world, own, 0.5 + 0.6 * k)
    kept = None
    for step in range(steps):
        if rng.uniform() < 0.2:
            h = float(10 ** rng.uniform(-3, -1.7))
        done, act = choose(rng, len(worlds[0].bodies))
        kept = None if done else kept
        if kept is None and not done:
            kept = [world.snapshot() for world in worlds], []
        try:
            for world in worlds:
                act(world)
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
