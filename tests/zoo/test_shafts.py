"""Boxes fall into a narrow shaft and jam there, at frictions up to 2: sweeps do not run away."""

from __future__ import annotations

import numpy as np
import perp
import pytest


# Momentum of the sweeps fed loops of friction, as only its sum over all bodies was asked whether it
# led back: residuals grew to 15 beside what drives; a step without any impulse has about 1.
@pytest.mark.parametrize("seed", (50, 53, 59))
def test_what_jams_is_not_thrown(seed: int) -> None:
    g = np.random.default_rng(seed)
    world = perp.World(friction=float(g.choice((0.3, 0.5, 1, 2))), accuracy="standard")
    world.ground.add_plane((0, 0, 1))
    for way in ((1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0)):
        world.ground.add_plane(way, -0.35)
    for k in range(int(g.integers(10, 25))):
        turn = g.normal(size=4)
        body = world.add_body(
            10 ** g.uniform(-0.5, 0.5),
            position=(*g.uniform(-0.1, 0.1, 2), 0.3 + 0.25 * k),
            orientation=turn / np.linalg.norm(turn),
        )
        body.add_box(g.uniform(0.05, 0.18, 3))
    for step in range(120):
        result = world.step(0.01)
        assert result.residual < 1, (seed, step, result.residual)
