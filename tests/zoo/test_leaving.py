"""Movers leave wide stacks of boxes at rest: they roll off, slide off or are shot off. What a mover
does to a stack is a force within the cone of its contact, which the stack's own friction, the same
everywhere, passes on to the ground within its base: so the stack stands, and all that lies on it."""

from __future__ import annotations

import math

import numpy as np
import perp
import pytest

from scene import about

LEVELS = ("fast", "standard", "accurate", "exact")
WAYS = ("shot", "rolls", "slides", "box slides", "box shot", "lies", "box lies")


def stack(random: np.random.Generator, world: perp.World, planar: bool) -> tuple[float, list[perp.Body]]:
    """Its height, at most .6; any point within .3 of its axis may be pushed along the cone."""
    height, bodies = 0.0, []
    for _ in range(int(random.integers(1, 4))):
        half = random.uniform(1.0, 1.5, 3)
        half[1 if planar else 2] = random.uniform(0.05, 0.1)
        place = np.zeros(2 if planar else 3)
        place[-1] = height + half[1 if planar else 2]
        turn = random.uniform(-3, 3) * (not planar)
        body = world.add_body(10 ** random.uniform(-1, 1), position=place,
                              orientation=0.0 if planar else about("z", turn))
        body.add_box(half[:2] if planar else half)
        bodies.append(body)
        height = place[-1] + half[1 if planar else 2]
    return height, bodies


def put(random: np.random.Generator, world: perp.World, way: str, height: float, out: np.ndarray) -> perp.Body:
    """A body on the stack that goes outwards."""
    size, speed = random.uniform(0.05, 0.1), random.uniform(0.5, 3.0)
    planar, up = len(out) == 1, np.zeros(len(out) + 1)
    up[-1] = 1.0
    away = np.append(out, 0.0)
    velocity = speed * (up if "shot" in way else 0.0 * up if "lies" in way else away)
    spin = np.cross((0, 0, 1), away) * speed / size if not planar else -speed / size * out[0]
    body = world.add_body(10 ** random.uniform(-1, 1), position=0.25 * away + (height + size) * up,
                          velocity=velocity, angular_velocity=spin if way == "rolls" else 0 * spin)
    if "box" in way:
        body.add_box([size] * len(up))
    else:
        body.add_sphere(size)
    return body


@pytest.mark.parametrize("planar", (False, True))
@pytest.mark.parametrize("level", LEVELS)
@pytest.mark.parametrize("seed", range(25))
def test_what_stays_rests(seed: int, level: str, planar: bool) -> None:
    random = np.random.default_rng(seed)
    gravity = (0.0, -9.81) if planar else (0.0, 0.0, -9.81)
    world = perp.World(gravity, friction=random.uniform(0.05, 0.8), accuracy=level, planar=planar)
    world.ground.add_plane((0, 1) if planar else (0, 0, 1))
    height, resting = stack(random, world, planar)
    count = 2 if planar else int(random.integers(1, 5))
    for k in range(count):
        angle = math.pi * k if planar else 2 * math.pi * (k + random.uniform(-0.1, 0.1)) / count
        way = str(random.choice(WAYS))
        body = put(random, world, way, height,
                   np.array((math.cos(angle), math.sin(angle)))[: 1 if planar else 2])
        if "lies" in way:
            resting.append(body)
    for step in range(3):
        world.step(0.01)
        for body in resting:
            assert not np.any(body.velocity) and not np.any(body.angular_velocity), step
