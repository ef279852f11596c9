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

DEEP = 0.04  # of radius 1: twice what `fast` lets a motion go deep, 1/100 of the size


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


def depth(world: perp.World) -> float:
    """The deepest overlap of discs of radius 1, with each other or with the ground."""
    places = world.positions[1:]
    apart = np.hypot(*(places[:, None] - places[None]).transpose(2, 0, 1))
    np.fill_diagonal(apart, 2.0)
    return float(max((2 - apart).max(), (1 - places[:, 1]).max()))


# In 4 of the first 10 of such worlds what was left of a step's impacts gave energy, and discs were a radius to 12 km in the ground.
# In 3 of these worlds bounces against walls went on for ever, each slower than the one before: after 500 steps down to 1e-158.
@pytest.mark.parametrize("level", ("fast", "standard", "accurate", "exact"))
@pytest.mark.parametrize("seed", range(5))
def test_bounces_against_walls_die_out(seed: int, level: str) -> None:
    world = chute(seed, level)
    for _ in range(500):
        assert world.step(STEP).advanced
        assert depth(world) < DEEP
    speeds = np.hypot(*world.velocities.T)
    assert not ((speeds > 0) & (speeds < ROUNDING)).any(), speeds
