"""Small bodies on large ones: how deep an overlap is does not depend on how large the other body is."""

from __future__ import annotations

import numpy as np
import perp
import pytest

LEVELS = ("fast", "standard", "accurate", "exact")
SLOP = 2e-3  # of two bodies' size, twice the smaller one's radius: docs/world.md leaves so much


@pytest.mark.parametrize("half", [1.0, 100.0, 1e4])
@pytest.mark.parametrize("level", LEVELS)
def test_what_is_put_into_a_slab_comes_out(level: str, half: float) -> None:
    """Cubes that begin a third of their size in a slab, however wide that is: a fifth of an overlap
    goes in a step, so that 200 leave none above the slop, and what is out rests."""
    for seed in range(4):
        g = np.random.default_rng(seed)
        world = perp.World(accuracy=level, friction=0.5)  # type: ignore[arg-type]
        slab = world.add_body(kind="static", position=(0, 0, -0.1 * half))
        slab.add_box((half, half, 0.1 * half))
        edge = 10 ** g.uniform(-1.5, -0.5)
        bodies = []
        for k in range(int(g.integers(1, 10))):
            at = ((k % 3) * 3 * edge, (k // 3) * 3 * edge, edge * g.uniform(0.4, 0.8))
            bodies.append(world.add_body(1.0, position=at))
            bodies[-1].add_box((edge, edge, edge))
        for _ in range(200):
            world.step(0.01)
        size = 2 * np.sqrt(3) * edge
        for body in bodies:
            assert body.position[2] >= edge - SLOP * size, seed
            assert not body.velocity.any() and not body.angular_velocity.any(), seed
