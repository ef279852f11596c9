"""Tables that turn freely about an upright hinge, with boxes on them that friction holds where they
are. Nothing brakes: boxes stay at their distance from the axis, and what all have of angular
momentum about it stays."""

from __future__ import annotations

import math

import numpy as np
import perp
import pytest


@pytest.mark.parametrize("level", ("fast", "standard", "exact"))
def test_boxes_ride_round(level: str) -> None:
    """With a the turn of a step, second order: each of a second's steps is off by less than a^3 of
    the distance or, below `exact`, by what sweeps leave. Boxes went in by a^2 / 2 a step, as they
    were moved by the velocities at its end: a seventh of the way to the axis in a second. At
    `accurate` what turns in a step leaves more than sweeps do, and boxes are off by a hundredth."""
    for seed in range(6):
        g = np.random.default_rng(seed)
        h, rate, boxes = 1 / g.choice((30, 60)), g.uniform(1, 3), int(g.integers(2, 6))
        world = perp.World(accuracy=level, friction=1)  # type: ignore[arg-type]
        table = world.add_body(g.uniform(1, 4), position=(0, 0, 0.1), angular_velocity=(0, 0, rate))
        table.add_box((1.5, 1.5, 0.1))
        world.add_joint("revolute", world.ground, table)
        riders, distances = [], []
        for k in range(boxes):
            angle, distance = 2 * math.pi * k / boxes, g.uniform(0.6, 1)
            place = distance * np.array((math.cos(angle), math.sin(angle)))
            rider = world.add_body(g.uniform(0.5, 2), position=(*place, 0.4),
                                   velocity=(-rate * place[1], rate * place[0], 0),
                                   angular_velocity=(0, 0, rate))
            rider.add_box((0.2, 0.2, 0.2))
            riders.append(rider)
            distances.append(distance)
        before = world.momentum().angular[2]
        steps = round(1 / h)
        for _ in range(steps):
            world.step(h)
        most = max(steps * (rate * h) ** 3, 1e-3)
        found = [float(np.linalg.norm(rider.position[:2])) for rider in riders]
        assert found == pytest.approx(distances, rel=most), seed
        assert world.momentum().angular[2] == pytest.approx(before, rel=most), seed
