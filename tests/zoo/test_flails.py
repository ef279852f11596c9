"""Heavy balls on chains of light links that swing down and wrap round light boxes. Links are closed
by long ways where the ball pulls them straight: these may not take them into what they touch, nor
give energy."""

from __future__ import annotations

import numpy as np
import perp
import pytest

from scene import matrix

STEP = 1 / 30
LENGTH, RADIUS, HALF = 0.25, 0.03, 0.2  # of links, capsules; boxes' half width

# No link goes farther than half of the way to a box's middle; at `accurate` no deeper than it is
# thick.
MOST = {"fast": 0.5 * HALF, "standard": 0.5 * HALF, "accurate": 2 * RADIUS}


def flail(seed: int, level: str) -> tuple[perp.World, list[perp.Body], list[perp.Body]]:
    """A chain of links at the height of 2 m, held at the pile's axis, with a ball at its end."""
    g = np.random.default_rng(seed)
    world = perp.World(accuracy=level, friction=g.uniform(0.1, 0.8))  # type: ignore[arg-type]
    world.ground.add_plane((0, 0, 1), 0)
    links: list[perp.Body] = []
    count = int(g.integers(4, 8))
    core, mass = LENGTH / 2 - RADIUS, 0.2
    inertia = (mass * RADIUS**2 / 2, mass * LENGTH**2 / 12, mass * LENGTH**2 / 12)
    for k in range(count):
        link = world.add_body(mass, inertia, position=(-(k + 0.5) * LENGTH, 0, 2))
        link.add_capsule(RADIUS, core)
        world.add_joint("ball", links[-1] if links else world.ground, link, anchor=(-k * LENGTH, 0, 2))
        links.append(link)
    mass = g.uniform(20, 80)
    ball = world.add_body(mass, (0.016 * mass,) * 3, position=(-count * LENGTH - 0.2, 0, 2))
    ball.add_sphere(0.2)
    world.add_joint("ball", links[-1], ball, anchor=(-count * LENGTH, 0, 2))
    boxes = []
    for k in range(3):
        mass = 10 ** g.uniform(-1, 1)
        box = world.add_body(mass, (mass * HALF**2 / 1.5,) * 3, position=(0, 0, (2 * k + 1) * HALF))
        box.add_box((HALF, HALF, HALF))
        boxes.append(box)
    return world, links, boxes


def deepest(link: perp.Body, box: perp.Body) -> float:
    """How deep points of the link's axis lie in the box, and its radius; 0 where they do not."""
    axis = matrix(link.orientation)[:, 0]
    along = np.linspace(-1, 1, 41) * (LENGTH / 2 - RADIUS)
    points = np.asarray(link.position) + np.outer(along, axis) - np.asarray(box.position)
    inside = HALF - np.abs(points @ matrix(box.orientation)).max(axis=1)
    return max(float(inside.max()) + RADIUS, 0.0) if inside.max() > -RADIUS else 0.0


@pytest.mark.parametrize("level", MOST)
def test_links_stay_out_of_boxes(level: str) -> None:
    """Energy never rises by a thousandth of what there was at the beginning."""
    for seed in (*range(16), 112, 124):
        world, links, boxes = flail(seed, level)
        first = lowest = world.energy().total
        for _ in range(60):
            world.step(STEP)
            energy = world.energy().total
            assert energy <= lowest + 1e-3 * first, seed
            lowest = min(lowest, energy)
            for link in links:
                for box in boxes:
                    assert deepest(link, box) <= MOST[level], seed
