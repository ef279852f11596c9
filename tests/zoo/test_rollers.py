"""Planks that roll on round logs, between two belts, and balls: all go on as they are."""

from __future__ import annotations

import math

import numpy as np
import perp
import pytest

RESIDUALS = {"fast": 1e-2, "standard": 1e-3, "accurate": 1e-6, "exact": 0.0}
ACROSS = (math.sqrt(0.5), 0.0, 0.0, math.sqrt(0.5))  # a capsule along y


@pytest.mark.parametrize("level", ["fast", "standard", "accurate", "exact"])
def test_a_plank_rolls_on_logs(level: str) -> None:
    """It touches them all the time. To the level's residual of what a step's weight makes in each, or
    1e-9, as `tol` is 1e-10; masses are up to 40 apart. Turned about its length a log was not felt in some steps, as rounding told a
    product of edges from the face's normal that it is: up to .2 was found then."""
    for seed in range(8):
        g = np.random.default_rng(seed)
        radius, h, speed = g.uniform(0.05, 0.3), g.uniform(0.002, 0.01), g.uniform(0.1, 2)
        world = perp.World(friction=0.8, accuracy=level)
        belt = world.add_body(kind="kinematic", position=(0, 0, -0.1), velocity=(-speed, 0, 0))
        belt.add_box((5, 2, 0.1))
        for k in range(int(g.integers(2, 4))):
            log = world.add_body(g.uniform(0.5, 2), position=(k, 0, radius), orientation=ACROSS,
                                 angular_velocity=(0, speed / radius, 0))
            log.add_capsule(radius, g.uniform(0.1, 0.5))
        plank = world.add_body(g.uniform(0.5, 20), position=(0.5 * k, 0, 2 * radius + 0.05))
        plank.velocity = (speed, 0, 0)
        plank.add_box((0.5 * k + 0.8, 0.6, 0.05))
        least = max(math.sqrt(40) * RESIDUALS[level] * 9.81 * h, 1e-9)
        for step in range(40):
            world.step(h)
            off = max(np.abs(plank.velocity - (speed, 0, 0)).max(),
                      np.abs(plank.angular_velocity).max() * radius)
            assert off <= (step + 1) * least, (seed, step, off)
