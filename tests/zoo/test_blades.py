"""Thin kinematic blades and walls that turn and shake: what they push does not pass through them."""

from __future__ import annotations

import math

import numpy as np
import perp
import pytest

from scene import matrix, unit

LEVELS = ("fast", "standard", "accurate", "exact")


def add_shape(g: np.random.Generator, body: perp.Body, size: float) -> None:
    kind = g.integers(3)
    if kind == 0:
        body.add_box(size * g.uniform(0.3, 1, 3))
    elif kind == 1:
        body.add_sphere(size * g.uniform(0.3, 1))
    else:
        body.add_capsule(0.4 * size, 0.8 * size)


@pytest.mark.parametrize("level", LEVELS)
def test_a_blade_pushes_what_it_turns_into(level: str) -> None:
    """Bodies that lie before a blade are never behind it while it turns by 2.4 radians, up to one a
    step: mass centres stay on its side, but for the blade's half thickness and the overlap that steps
    leave, less than a body's least half width. What a blade takes more than half-way through itself
    by its turn alone had the normal of its far side, or none."""
    for seed in range(60):
        g = np.random.default_rng(seed)
        half, turn = 10 ** g.uniform(-3, -1), g.uniform(0.05, 1)
        h = 1 / g.choice((30, 60, 240))
        world = perp.World((0, 0, 0), accuracy=level,  # type: ignore[arg-type]
                           friction=g.choice((0, 0.5)))
        blade = world.add_body(kind="kinematic", angular_velocity=(0, 0, turn / h),
                               orientation=(math.cos(0.6), 0, 0, -math.sin(0.6)))
        blade.add_box((2, half, 1))
        bodies = []
        for i in range(int(g.integers(1, 5))):
            body = world.add_body(10 ** g.uniform(-2, 2), position=(0.5 + 0.3 * i, 0, 0))
            add_shape(g, body, 0.1)
            bodies.append(body)
        for step in range(int(2.4 / turn)):
            world.step(h)
            for body in bodies:
                x, y, z = matrix(blade.orientation).T @ body.position
                beside = 0.2 < x < 2 and abs(z) < 1
                assert not beside or y > -half - 0.03, (seed, step, turn, x, y)


@pytest.mark.parametrize("shape", ("box", "hull"))
def test_no_bullet_passes_a_plate_that_spins(shape: str) -> None:
    """About the way of the bullet, by up to 1600 radians a step of .01 s: the plate is always there."""
    half = np.array((0.02, 0.5, 0.5))
    for seed in range(60):
        g = np.random.default_rng(seed)
        with perp.World(gravity=(0, 0, 0)) as world:
            spin, speed = 10 ** g.uniform(1, 5.2), 10 ** g.uniform(1.3, 3)
            plate = world.add_body(kind="kinematic", angular_velocity=(spin, 0, 0))
            if shape == "box":
                plate.add_box(half)
            else:
                plate.add_hull(half * (np.indices((2, 2, 2)).reshape(3, 8).T * 2 - 1))
            bullet = world.add_body(mass=1, position=(-1, g.uniform(-0.3, 0.3), 0), velocity=(speed, 0, 0))
            bullet.add_sphere(0.05)
            for _ in range(6):
                world.step(0.01)
                assert bullet.position[0] < 0, (seed, spin, speed)


@pytest.mark.parametrize("level", LEVELS)
def test_nothing_leaves_a_shaken_box(level: str) -> None:
    """Six walls that are one kinematic body, thin ones too, shaken and turned at up to a metre and .4
    radians a step, with steps of 1/60 s. Of a wall that the next one covers in a corner the far side
    was met, which is open there. Where bodies crush each other in a corner (the seeds beyond 30) the
    step takes one more than half-way through a wall that turns away."""
    for seed in (*range(30), 356, 373, 533, 546, 679, 1280):
        g = np.random.default_rng(1000 + seed)
        world = perp.World(accuracy=level, friction=g.choice((0, 0.5)))  # type: ignore[arg-type]
        box, half = world.add_body(kind="kinematic"), g.choice((0.001, 0.05, 0.3))
        for axis in range(3):
            for side in (-1, 1):
                wall, place = np.full(3, 1 + 2 * half), np.zeros(3)
                wall[axis], place[axis] = half, side * (1 + half)
                box.add_box(wall, offset=place)
        bodies = []
        for i in range(int(g.integers(1, 6))):
            body = world.add_body(10 ** g.uniform(-2, 2), position=((i % 3 - 1) * 0.6, i // 3 * 0.6, 0))
            add_shape(g, body, 0.15)
            bodies.append(body)
        way, rate, along = g.uniform(0.5, 3), g.uniform(10, 20), unit(g)
        box.angular_velocity = unit(g) * g.choice((0, 5, 25))
        for step in range(60):
            box.velocity = way * rate * math.cos(rate * step / 60) * along
            world.step(1 / 60)
            for body in bodies:
                inside = matrix(box.orientation).T @ (body.position - box.position)
                assert np.abs(inside).max() < 1, (seed, step, inside)
