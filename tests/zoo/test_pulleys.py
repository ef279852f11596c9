"""Ropes of light beads over a round pin without friction, with a load at each end: the heavier one
falls as Atwood's does. Beads are up to ten thousand times as light as what pulls them, and swing
across the rope faster than a step of 1/60 s follows. Steps are as long as docs/world.md (Limits)
lets them be for a rope like that."""

from __future__ import annotations

import math

import numpy as np
import perp
import pytest

from scene import GRAVITY

LEVELS = ("fast", "standard", "accurate", "exact")
PIN, BEAD, LINK, BEADS, TIME = 0.15, 0.029, 0.1, 18, 0.3
ROUND = PIN + BEAD  # where beads lie
# At either side of the pin a link leaves it for the line on which the load hangs: its chord is so
# much shorter than its arc.
CHORD = 2 * ROUND * math.asin(0.5 * LINK / ROUND) - LINK


def pulley(seed: int, level: str) -> tuple[perp.World, list[perp.Body], float, float]:
    """Returns the rope, too, how fast its loads speed up, and the longest step for it."""
    random = np.random.default_rng(seed)
    planar = bool(random.integers(2))
    gravity = (0, -GRAVITY) if planar else (0, -GRAVITY, 0)
    world = perp.World(gravity, planar, accuracy=level)  # type: ignore[arg-type]
    if planar:
        world.ground.add_sphere(PIN)
    else:
        world.ground.add_capsule(PIN, 0.2, rotation=(math.sqrt(0.5), 0, math.sqrt(0.5), 0))
    mass, loads = 10 ** random.uniform(-3, -1.5), (1, random.uniform(2, 20))
    chain = []
    for k in range(-1, BEADS + 1):
        along = (k - 0.5 * (BEADS - 1)) * LINK
        angle = along / ROUND
        load = loads[k > 0] if k in (-1, BEADS) else None
        at = np.array((ROUND * math.sin(angle), ROUND * math.cos(angle), 0.0))
        if abs(angle) > 0.5 * math.pi:
            hangs = abs(along) - 0.5 * math.pi * ROUND
            at = np.array((math.copysign(ROUND, along), -hangs, 0.0))
        body = world.add_body(load or mass, position=at[:2] if planar else at)
        body.add_sphere(0.04 if load else BEAD)
        chain.append(body)
    for a, b in zip(chain, chain[1:]):
        world.add_joint("distance", a, b, anchor=a.position, anchor_b=b.position)
    faster = (loads[1] - loads[0]) * GRAVITY / (sum(loads) + BEADS * mass)
    tension = loads[1] * (GRAVITY - faster)
    return world, chain, faster, math.sqrt(LINK / (tension * (2 / mass)))


@pytest.mark.parametrize("level", LEVELS)
@pytest.mark.parametrize("seed", range(8))
def test_loads_fall_over_their_pin(seed: int, level: str) -> None:
    """Velocities change before positions: of n steps the way is a h^2 n (n + 1) / 2. They are known
    to a hundredth at `fast`, the coarsest level."""
    world, chain, faster, h = pulley(seed, level)
    load, begun = chain[-1], float(chain[-1].position[1])
    lengths = [np.linalg.norm(b.position - a.position) for a, b in zip(chain, chain[1:])]
    steps = math.ceil(TIME / h)
    for _ in range(steps):
        world.step(h)
        for a, b, length in zip(chain, chain[1:], lengths):  # of which swept joints lack 1e-9
            assert abs(np.linalg.norm(b.position - a.position) - length) < 1e-8
    way = begun - float(load.position[1])
    missed = way - 0.5 * faster * h * h * steps * (steps + 1)
    assert abs(missed) < 2 * CHORD + 0.01 * way, missed / way
