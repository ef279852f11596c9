"""Tall planar stacks of boxes that all bounce, under one that falls on them: what is hit by nothing stays as it
is while others are hit, and no step ends far from its laws."""

from __future__ import annotations

import numpy as np
import perp
import pytest

# Ten times what counts as solved at `fast`: a stack of 30 contacts may be left that far off, not by what drives it.
FAR = 0.1


def stack(seed: int, level: str) -> tuple[perp.World, float]:
    random = np.random.default_rng(seed)
    world = perp.World(planar=True, friction=random.uniform(0, 1), accuracy=level)  # type: ignore[arg-type]
    world.ground.add_plane((0, 1))
    count, height = int(random.integers(9, 16)), 0.0
    spread, differ = random.uniform(0.02, 0.3), random.random() < 0.5
    same = float(random.choice((0.3, 0.5, 0.8, 1)))
    for k in range(count):
        radius, top = random.uniform(0.1, 0.3), k == count - 1
        height += random.uniform(0.001, 0.1) if top else 10 ** random.uniform(-12, -2)
        body = world.add_body(
            10 ** (random.uniform(1, 2) if top else random.uniform(-1, 1)),
            position=(random.uniform(-spread, spread), height + radius),
            velocity=(0, -random.uniform(1, 8) if top else 0),
        )
        bounce = float(random.choice((0.3, 0.5, 0.8, 1)))
        body.add_box((radius, radius), restitution=bounce if differ else same)
        height += 2 * radius
    return world, float(random.choice((1 / 30, 1 / 60, 1 / 120)))


# Velocities of 1e-11 to 1e-47 m/s, which rounding had left of what touches apart from an impact, jumped with it,
# in problems of their own that end anywhere: of the first 5,508 steps 3 at `fast` and 4 at `standard` had
# residuals of .2 to 8,424; now the worst is .019.
@pytest.mark.parametrize(
    "seed, level",
    [(27, "fast"), (32, "fast"), (60, "fast"), (6, "standard"), (27, "standard"), (60, "standard"), (74, "standard"), (16, "accurate")],
)
def test_what_is_hit_by_nothing_does_not_jump(seed: int, level: str) -> None:
    world, h = stack(seed, level)
    for step in range(int(0.6 / h)):
        assert world.step(h).residual < FAR, step
