"""Random systems of links on joints that fall on a slab which moves on at a constant velocity. Who
moves with the slab sees it at rest: kinetic and potential energy, taken from there by NumPy alone,
never grow, whatever it is that carries what."""

from __future__ import annotations

import math

import numpy as np
import perp
import pytest

from scene import matrix, unit

LEVELS = ("fast", "standard", "accurate", "exact")
KINDS = ("ball", "revolute", "prismatic", "fixed", "screw", "cylindrical", "planar", "distance")


def add_link(world: perp.World, random: np.random.Generator, k: int) -> perp.Body:
    turn = random.normal(size=4)
    body = world.add_body(
        10 ** random.uniform(-1, 1),
        position=(0.8 * (k % 3), 0.8 * (k // 3), random.uniform(0.5, 2)),
        orientation=turn / np.linalg.norm(turn),
    )
    restitution, sizes = random.choice((0, 0.5, 1)), random.uniform(0.1, 0.35, 3)
    shape = random.integers(3)
    if shape == 0:
        body.add_box(sizes, restitution=restitution)
    elif shape == 1:
        body.add_sphere(sizes[0], restitution=restitution)
    else:
        body.add_capsule(0.6 * sizes[0], sizes[1], restitution=restitution)
    return body


def join(world: perp.World, random: np.random.Generator, a: perp.Body, b: perp.Body) -> None:
    kind, more = str(random.choice(KINDS)), {}
    if kind not in ("ball", "fixed", "distance"):
        more["axis"] = unit(random)
    if kind != "distance":
        more["anchor"] = (a.position + b.position) / 2
    if kind == "screw":
        more["pitch"] = 0.4
    if kind in ("revolute", "prismatic", "screw") and random.random() < 0.5:
        more["lower"], more["upper"] = -0.3, 0.5
    world.add_joint(kind, a, b, **more)


def energy(bodies: list[perp.Body], velocity: np.ndarray, time: float) -> float:
    total = 0.0
    for body in bodies:
        spin = matrix(body.orientation).T @ body.angular_velocity
        beside = body.velocity - velocity
        height = body.position[2] - velocity[2] * time
        total += body.mass * (beside @ beside / 2 + 9.81 * height) + spin @ body.inertia @ spin / 2
    return float(total)


@pytest.mark.parametrize("level", LEVELS)
@pytest.mark.parametrize("seed", range(10))
def test_nothing_gains_energy_on_what_moves_evenly(seed: int, level: str) -> None:
    random = np.random.default_rng(seed)
    h = random.choice((1 / 30, 1 / 60))
    world = perp.World((0, 0, -9.81), accuracy=level, friction=random.choice((0, 0.5, 1)))
    velocity = 3 * random.normal(size=3)
    slab = world.add_body(position=(0, 0, -0.5), velocity=velocity, kind="kinematic")
    slab.add_box((30, 30, 0.5))
    bodies: list[perp.Body] = []
    for k in range(int(random.integers(3, 9))):
        bodies.append(add_link(world, random, k))
        bodies[k].velocity = velocity
        if k and random.random() < 0.6:
            join(world, random, bodies[k - 1], bodies[k])
    before = energy(bodies, velocity, 0.0)
    scale = sum(body.mass for body in bodies) * 9.81 * 1.0
    for step in range(math.ceil(1.5 / h)):
        assert world.step(h).advanced
        now = energy(bodies, velocity, world.time)
        # what impulses known to 1e-10 may give, beside heights of 1
        assert now <= before + 1e-6 * scale, (seed, level, step, (now - before) / scale)
        before = now
