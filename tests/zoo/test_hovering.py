"""Balls that roll on boxes which hover over the ground by less than a level tells apart from touching:
what stands stays where it is, and so does what rolls on it in height."""

from __future__ import annotations

import numpy as np
import perp
import pytest

TOLERANCES = {"fast": 1e-2, "standard": 1e-3, "accurate": 1e-6, "exact": 1e-10}


@pytest.mark.parametrize("level", TOLERANCES)
def test_what_rolls_on_what_hovers_does_not_sink(level: str) -> None:
    """Gaps are .01 to .8 of what docs/world.md says touches. Velocities were solved as if the box fell
    by its gap in the step, and then it stood: at `fast` balls went into it by the gap in each step."""
    for seed in range(10):
        g = np.random.default_rng(seed)
        world = perp.World(accuracy=level, friction=g.uniform(0.2, 0.9))  # type: ignore[arg-type]
        world.ground.add_plane((0, 0, 1))
        half = g.uniform(0.1, 0.3, 3) * (5, 3, 1)
        gap = 4e-3 * np.linalg.norm(half) * TOLERANCES[level] * 10 ** g.uniform(-2, -0.1)
        box = world.add_body(position=(0, 0, gap + half[2]))
        box.add_box(half)
        r, v = g.uniform(0.05, 0.1), g.uniform(-0.3, 0.3, 2)
        ball = world.add_body(position=(*(half[:2] * 0.3), gap + 2 * half[2] + r),
                              velocity=(*v, 0), angular_velocity=(-v[1] / r, v[0] / r, 0))
        ball.add_sphere(r)
        height = ball.position[2] - box.position[2]
        for _ in range(30):
            world.step(0.005)
        # it sank by the gap in a step, a hundredth of it in 30 would show; 30 steps round to 1e-12
        assert abs(height - ball.position[2] + box.position[2]) < 0.01 * gap + 1e-12, seed
