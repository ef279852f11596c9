"""Slabs that slide on flush tiles without friction, and begin in them by a little, level or tilted.
The sides of tiles are covered by their neighbours: nothing there holds a slab up."""

from __future__ import annotations

import numpy as np
import perp
import pytest

LEVELS = "fast", "standard", "accurate"
SPEED = 2.0


def slowest(seed: int, level: str) -> float:
    """The least speed along the floor within a third of a second, of a slab over 20 by 3 tiles."""
    random = np.random.default_rng(seed)
    thickness, sunk = random.choice([0.01, 0.05]), 10.0 ** random.uniform(-3.7, -2.4)
    tilt = random.choice([0.0, 10.0 ** random.uniform(-3.0, -2.0)])
    turn = np.array([1.0, 1.3 * tilt, tilt, 9.0 * tilt])
    world = perp.World(accuracy=level, friction=0.0)
    for i in range(-6, 14):
        for j in (-1, 0, 1):
            world.ground.add_box((0.1, 0.1, thickness), offset=(0.2 * i, 0.2 * j, -thickness))
    slab = world.add_body(
        1.0, position=(0, 0.03, 0.05 - sunk), orientation=turn / np.linalg.norm(turn),
        velocity=(SPEED, 0.3, 0),
    )  # fmt: skip
    slab.add_box((0.13, 0.08, 0.05))
    least = SPEED
    for _ in range(20):
        world.step(1 / 60)
        least = min(least, slab.velocity[0])
    return least


@pytest.mark.parametrize("level", LEVELS)
def test_no_side_of_a_tile_holds_a_slab_up(level: str) -> None:
    """.9: a side that is met takes all of a speed; what tilts by .03 at most and comes out of the
    floor by its face gives the floor .03 of what it presses with."""
    for seed in range(40):
        assert slowest(seed, level) > 0.9 * SPEED, seed
