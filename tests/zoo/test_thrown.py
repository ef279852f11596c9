"""What a hit sets spinning does not pass through the wall that it hit."""
from __future__ import annotations

import numpy as np
import perp
import pytest

LEVELS = ("fast", "standard", "accurate", "exact")
HALF = {"card": (0.1, 0.001, 0.1), "rod": (0.1, 0.001, 0.001), "slab": (0.1, 0.01, 0.1),
        "brick": (0.02, 0.05, 0.1)}


@pytest.mark.parametrize("shape", HALF)
@pytest.mark.parametrize("level", LEVELS)
def test_thin_bodies_do_not_pass_a_thin_wall(shape: str, level: str) -> None:
    """At 10 to 1000 m/s, of any orientation and spin, with steps of 10 ms: a corner that hits turns
    the body by radians in a step. Its centre stays on the side from which it came, but for the wall's
    half thickness and an overlap of half of the body's own width, which no level leaves."""
    for seed in range(12):
        random = np.random.default_rng(seed)
        wall = 10 ** random.uniform(-3, -2)
        world = perp.World((0, 0, 0), accuracy=level)
        world.add_body(kind="static").add_box((wall, 30, 30))
        q = random.normal(size=4)
        body = world.add_body(1, position=(-random.uniform(0.2, 3), 0, 0),
                              velocity=(10 ** random.uniform(1, 3), 0, 0),
                              orientation=q / np.linalg.norm(q),
                              angular_velocity=random.uniform(0, 100) * (seed % 2)
                              * np.array((0.6, 0, 0.8)))
        body.add_box(HALF[shape], restitution=(0, 0.5, 1)[seed % 3])
        for _ in range(40):
            world.step(0.01)
            assert body.position[0] < wall + max(HALF[shape]), (seed, shape)
