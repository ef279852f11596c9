"""Random links, joints between them, and their energy by NumPy alone."""

from __future__ import annotations

import numpy as np
import perp

from scene import GRAVITY, matrix, unit

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
    """As who moves with this velocity sees it."""
    total = 0.0
    for body in bodies:
        spin = matrix(body.orientation).T @ body.angular_velocity
        beside = body.velocity - velocity
        height = body.position[2] - velocity[2] * time
        total += body.mass * (beside @ beside / 2 + GRAVITY * height)
        total += spin @ body.inertia @ spin / 2
    return float(total)
