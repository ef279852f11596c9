"""Boxes and balls on joints that lie in a plane, and fall on another at right angles to it without
friction, at restitution 1. Both sides of the plane are alike, and so is what happens there: nothing
leaves it."""

from __future__ import annotations

import math

import numpy as np
import perp
import pytest

from scene import about

LEVELS = ("fast", "standard", "accurate", "exact")


@pytest.mark.parametrize("level", LEVELS)
@pytest.mark.parametrize("seed", range(12))
def test_what_lies_in_a_plane_stays_there(seed: int, level: str) -> None:
    random = np.random.default_rng(seed)
    world = perp.World((0, -9.81, 0), accuracy=level)
    world.ground.add_plane((0, 1, 0), 0)
    bodies = []
    for k in range(2):
        body = world.add_body(
            10 ** random.uniform(-1, 1),
            position=(0.9 * k, random.uniform(0.5, 0.9), 0),
            orientation=about("z", random.uniform(-3, 3)),
            velocity=(*random.normal(size=2), 0),
            angular_velocity=(0, 0, 3 * random.normal()),
        )
        if k == 0 or random.random() < 0.5:
            body.add_box((*random.uniform(0.1, 0.35, 2), 0.3), restitution=1)
        else:
            body.add_sphere(random.uniform(0.1, 0.35), restitution=1)
        bodies.append(body)
    length = math.dist(bodies[0].position, bodies[1].position)
    kind = str(random.choice(("distance", "rope", "hinge")))
    if kind == "hinge":
        middle = (bodies[0].position + bodies[1].position) / 2
        world.add_joint("revolute", *bodies, anchor=middle, axis=(0, 0, 1))
    else:
        world.add_joint("distance", *bodies, lower=length if kind == "distance" else 0, upper=length)
    for step in range(60):
        assert world.step(1 / 60).advanced
        for body in bodies:
            off = max(abs(body.velocity[2]), *np.abs(body.angular_velocity[:2]))
            # rounding, which impacts of one box take further by some ten in each
            assert off < 1e-6, (seed, level, kind, step, off)
