"""Random systems of links on joints that fall on a slab which moves on at a constant velocity. Who
moves with the slab sees it at rest: kinetic and potential energy, taken from there by NumPy alone,
never grow, whatever it is that carries what."""

from __future__ import annotations

import math

import numpy as np
import perp
import pytest

from links import add_link, energy, join
from scene import GRAVITY

LEVELS = ("fast", "standard", "accurate", "exact")


@pytest.mark.parametrize("level", LEVELS)
@pytest.mark.parametrize("seed", range(10))
def test_nothing_gains_energy_on_what_moves_evenly(seed: int, level: str) -> None:
    random = np.random.default_rng(seed)
    h = random.choice((1 / 30, 1 / 60))
    world = perp.World((0, 0, -GRAVITY), accuracy=level, friction=random.choice((0, 0.5, 1)))
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
    scale = sum(body.mass for body in bodies) * GRAVITY * 1.0
    for step in range(math.ceil(1.5 / h)):
        assert world.step(h).advanced
        now = energy(bodies, velocity, world.time)
        # what impulses known to 1e-10 may give, beside heights of 1
        assert now <= before + 1e-6 * scale, (seed, level, step, (now - before) / scale)
        before = now
