"""Discs that bounce pile up in a chute: walls press them by what others weigh, forces do not. Bounces
die out there, too, by the states alone."""

from __future__ import annotations

import numpy as np
import perp
import pytest

GRAVITY, STEP = 9.81, 1 / 60
# What moves slower than the rounding of what a step of falling makes does not move: nothing but bounces that do not end,
# by their restitution in each step, gets there, and they take 100 steps or so from the first rest.
ROUNDING = np.finfo(float).eps * GRAVITY * STEP


def chute(seed: int, level: str) -> perp.World:
    random = np.random.default_rng(seed)
    bounce, friction = random.uniform(0.2, 0.8), random.uniform(0.2, 1)
    world = perp.World((0, -GRAVITY), planar=True, accuracy=level, friction=friction)  # type: ignore[arg-type]
    count, width = int(random.integers(11, 24)), random.uniform(2.5, 3.5)
    for normal, offset in (((0, 1), 0.0), ((1, 0), -width / 2), ((-1, 0), -width / 2)):
        world.ground.add_plane(normal, offset)
    for k in range(count):
        aside = (width / 2 - 1) * (-1) ** k * random.uniform(-1, -0.3)
        body = world.add_body(
            random.uniform(0.5, 4), position=(aside, 1 + 2.5 * k + random.uniform(0, 0.4))
        )
        body.add_sphere(1.0, restitution=bounce)
    return world


# In 3 of these worlds bounces against walls went on for ever, each slower than the one before: after 500 steps down to 1e-158.
@pytest.mark.parametrize("level", ("fast", "standard", "accurate", "exact"))
@pytest.mark.parametrize("seed", range(5))
def test_bounces_against_walls_die_out(seed: int, level: str) -> None:
    world = chute(seed, level)
    for _ in range(500):
        assert world.step(STEP).advanced
    speeds = np.hypot(*world.velocities.T)
    assert not ((speeds > 0) & (speeds < ROUNDING)).any(), speeds
