"""Hulls of points as meshes and scanners give them: corners of prisms, and of boxes whose faces are
grids, turned at random and rounded to single precision, or off their faces by 1e-12 to 1e-5. They
are shapes all the same, and weigh what Qhull's hull of the points does. Those of single precision
come to rest on each other."""

from __future__ import annotations

import math

import numpy as np
import perp
import pytest
from scipy.spatial import ConvexHull

from scene import matrix, unit

LEVELS = ("fast", "standard", "accurate", "exact")
DENSITY, SIZES = 700.0, 60
RESTING = (0, 1, 2, 3, 42, 49)


def cloud(g: np.random.Generator, rounded: bool) -> np.ndarray:
    """About its mass centre."""
    if g.integers(2):
        n, half = int(g.integers(3, 12)), g.uniform(0.05, 0.15)
        turns = 2 * math.pi * np.arange(n) / n
        rim = 0.2 * np.column_stack((np.cos(turns), np.sin(turns)))
        points = np.array([(*p, side * half) for p in rim for side in (-1, 1)])
    else:
        line = np.linspace(-0.2, 0.2, 4)
        points = np.array([(x, y, z) for x in line for y in line for z in (-0.2, 0.2)])
        points *= g.uniform(0.3, 1.0, 3)
    points = points @ matrix(unit(g, 4)).T
    if rounded:
        points = points.astype(np.float32).astype(float)
    else:
        points += g.uniform(-1, 1, points.shape) * 10.0 ** g.uniform(-12, -5)
    corners = points[ConvexHull(points).simplices]
    volumes = np.abs(np.linalg.det(corners))
    return points - volumes @ corners.sum(axis=1) / (4 * volumes.sum())


@pytest.mark.parametrize("rounded", (True, False))
def test_what_points_with_noise_weigh(rounded: bool) -> None:
    for seed in range(SIZES):
        g = np.random.default_rng((seed, rounded))
        points = cloud(g, rounded)
        with perp.World() as world:
            body = world.add_body()
            body.add_hull(points, density=DENSITY)
            # What counts as flat is some times single precision's 1.2e-7 of the size, or the noise.
            expected = pytest.approx(DENSITY * ConvexHull(points).volume, rel=1e-4)
            assert body.mass == expected, (seed, body.mass)


@pytest.mark.parametrize("level", LEVELS)
def test_hulls_of_meshes_come_to_rest(level: str) -> None:
    for seed in RESTING:
        g = np.random.default_rng((seed, 2))
        clouds = [cloud(g, True) for _ in range(2)]
        with perp.World(accuracy=level, friction=0.6) as world:
            world.ground.add_plane((0, 0, 1))
            fallen = []
            for k, points in enumerate(clouds):
                body = world.add_body(position=(g.uniform(-0.05, 0.05), 0, 0.4 + 0.6 * k))
                body.add_hull(points)
                fallen.append(body)
            world.run(8.0, 0.01)
            for body, points in zip(fallen, clouds):
                assert not body.velocity.any() and not body.angular_velocity.any(), seed
                lowest = (points @ matrix(body.orientation).T)[:, 2].min() + body.position[2]
                size = 2 * np.linalg.norm(points, axis=1).max()
                assert lowest > -2e-3 * size, (seed, lowest)  # what docs/world.md leaves at rest
