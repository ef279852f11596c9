"""Loads on chains of light links that hang straight from an arm which turns: what is taut is closed by
ways of the load, though links are a thousand times as light, and turn more easily."""

from __future__ import annotations

import numpy as np
import perp
import pytest

from scene import about, matrix

LEVELS = ("fast", "standard", "accurate", "exact")
LINK, THICK, REACH = 0.3, 0.03, 2.0
UPRIGHT = about("y", np.pi / 2)


@pytest.mark.parametrize("level", LEVELS)
def test_taut_chains_stay_closed(level: str) -> None:
    """To 1e-6 of a link after every step, as docs/joints.md has it of all joints."""
    for seed in range(8):
        g = np.random.default_rng(seed)
        world = perp.World(accuracy=level)  # type: ignore[arg-type]
        arm = world.add_body(kind="kinematic", angular_velocity=(0, 0, g.uniform(0.3, 3)))
        arm.add_box((0.1, 0.1, 0.1))
        before, place, ends = arm, np.array((REACH, 0, 0)), []
        load, mass = 10 ** g.uniform(1.5, 3), 10 ** g.uniform(-1, 0)
        half = 0.5 * LINK
        for _ in range(int(g.integers(4, 10))):
            link = world.add_body(
                mass, mass * np.array((0.5 * THICK**2, LINK**2 / 12, LINK**2 / 12)),
                position=place - (0, 0, half), orientation=UPRIGHT,
            )
            link.add_capsule(THICK, half - 2 * THICK)
            world.add_joint("ball", before, link, anchor=place)
            ends.append((before, (place - before.position) @ matrix(before.orientation),
                         link, (place - link.position) @ matrix(link.orientation)))
            before, place = link, place - (0, 0, LINK)
        ball = world.add_body(load, (0.025 * load,) * 3, position=place)
        ball.add_sphere(0.25)
        world.add_joint("ball", before, ball, anchor=place)
        for step in range(120):
            world.step(1 / 60)
            for a, at_a, b, at_b in ends:
                open_by = (a.position + matrix(a.orientation) @ at_a
                           - b.position - matrix(b.orientation) @ at_b)
                assert np.linalg.norm(open_by) <= 1e-6 * LINK, (seed, step)
