"""Random systems of links on joints that fall on a plane while steps have next to no time: what is
not solved by then is an answer all the same, whose joints hold and which gives no energy."""

from __future__ import annotations

import numpy as np
import perp
import pytest

from links import add_link, energy, join
from scene import GRAVITY, unit

LEVELS = ("fast", "standard", "accurate", "exact")


@pytest.mark.parametrize("level", LEVELS)
@pytest.mark.parametrize("seed", range(20))
def test_steps_without_time_give_no_energy(seed: int, level: str) -> None:
    random = np.random.default_rng(seed)
    h, limit = random.uniform(0.01, 0.06), 10 ** random.uniform(-5.3, -3.3)
    friction = random.choice((0, 0.5, 5))
    world = perp.World(
        (0, 0, -GRAVITY), accuracy=level, friction=friction, time_limit=limit
    )
    world.ground.add_plane((0, 0, 1), 0)
    bodies: list[perp.Body] = []
    for k in range(int(random.integers(3, 9))):
        bodies.append(add_link(world, random, k))
        bodies[k].velocity, bodies[k].angular_velocity = 10 * unit(random), 3 * unit(random)
        if k and random.random() < 0.7:
            join(world, random, bodies[int(random.integers(k))], bodies[k])
    first = energy(bodies, np.zeros(3), 0.0)
    scale = sum(body.mass for body in bodies) * (10**2 / 2 + GRAVITY * 1.0)
    for step in range(80):
        assert world.step(h).advanced
        now = energy(bodies, np.zeros(3), 0.0)
        # bodies that begin in each other are lifted out of them
        assert now <= first + 1e-3 * scale, (seed, level, step, (now - first) / scale)
