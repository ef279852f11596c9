"""Movers leave wide stacks of boxes at rest: they roll off, slide off or are shot off. What a mover
does to a stack is a force within the cone of its contact, which the stack's own friction, the same
everywhere, passes on to the ground within its base: so the stack stands, and all that lies on it."""

from __future__ import annotations

import math

import numpy as np
import perp
import pytest

from scene import about, unit

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


@pytest.mark.parametrize("planar", (False, True))
@pytest.mark.parametrize("level", LEVELS)
@pytest.mark.parametrize("seed", range(12))
def test_what_is_hit_between_walls_goes_on(seed: int, level: str, planar: bool) -> None:
    """A box just as wide as its chute stands, by walls that press as hard as friction needs. Hit, it
    goes on with what hit it, or stops it; it does not stop alone: at fast it did, hit by what is
    so quick that what the box makes of it is within tol."""
    random = np.random.default_rng(seed)
    count, h = 2 if planar else 3, 0.01
    up = np.eye(count)[-1]
    world = perp.World(-9.81 * up, friction=random.uniform(0.3, 0.9), accuracy=level, planar=planar)
    for side in (1, -1):
        world.ground.add_plane(side * np.eye(count)[0], -0.5)
    box = world.add_body(1.0, position=0 * up)
    box.add_box((0.5, 0.2) if planar else (0.5, 0.3, 0.2))
    world.step(h)
    ball = world.add_body(10 ** random.uniform(-2, 1), position=0.3 * up,
                          velocity=-10 ** random.uniform(0.3, 2.2) * up)
    ball.add_sphere(0.1)
    for _ in range(3):
        world.step(h)
        # what forces make of a velocity in a step, as rests are decided by that
        assert (ball.velocity - box.velocity) @ up > -9.81 * h


@pytest.mark.parametrize("level, tol", (("accurate", 1e-6), ("exact", 1e-10)))
def test_what_moves_obeys_the_laws_beside_what_rests(level: str, tol: float) -> None:
    """Bodies are thrown at a box. Where it could both creep and rest it was written to rest, while those
    on it had the impulses and velocities of its creeping: friction was off by .0086 of its size."""
    h = 0.01
    for seed in range(100):
        random = np.random.default_rng(seed)
        world = perp.World(friction=random.uniform(0.3, 0.9), accuracy=level)  # type: ignore[arg-type]
        world.ground.add_plane((0, 0, 1))
        half = random.uniform(0.1, 0.25, 3)
        world.add_body(1.0, position=(0, 0, half[2])).add_box(half)
        world.step(h)
        for k in range(3):
            way = unit(random) * (1, 1, -1)
            way[2] = -abs(way[2])
            body = world.add_body(10 ** random.uniform(-1.5, 0.5), orientation=unit(random, 4),
                                  position=half[2] * np.eye(3)[2] - (0.6 + 0.4 * k) * way,
                                  velocity=random.uniform(0.3, 3) * way + random.normal(0, 0.3, 3))
            if random.integers(2):
                body.add_sphere(random.uniform(0.05, 0.15))
            else:
                body.add_box(random.uniform(0.05, 0.15, 3))
        for step in range(70):
            result = world.step(h)
            if result.outcome != "solved" or result.steps > 1:  # it tells of the last part
                continue
            for contact in world.contacts:
                impulse, velocity = contact.impulse, contact.velocity
                if not np.any(velocity):
                    continue
                mass = min(b.mass for b in (contact.body_a, contact.body_b) if b.kind == "dynamic")
                left = max(contact.gap, 0.0) / h  # none where it is rounding, up to 1e-9
                velocity[0] += left if contact.gap > 1e-9 else min(max(-velocity[0], 0.0), left)
                aim = impulse - mass * velocity
                aim[0] = max(aim[0], 0.0)
                aim[1:] *= min(1.0, contact.friction * impulse[0] / max(np.linalg.norm(aim[1:]), 1e-300))
                # tol is of the fastest of all, up to 5 m/s; this of what gravity makes in a step
                size = mass * 9.81 * h + impulse[0]
                assert np.linalg.norm(aim - impulse) < 5 / (9.81 * h) * tol * size, (seed, step)


@pytest.mark.parametrize("level", LEVELS)
def test_polyhedra_hold_no_more_than_they_have(level: str) -> None:
    """Between two of four edges they hold 1 / sqrt(2) of what the cone does, and the slope asks .9."""
    friction = 0.5
    slope = math.atan(0.9 * friction)
    along = math.sin(slope) / math.sqrt(2)
    world = perp.World(9.81 * np.array((along, along, -math.cos(slope))), friction=friction,
                       accuracy=level, cone=4)
    world.ground.add_plane((0, 0, 1))
    world.add_body(1.0, position=(0, 0, 0.1)).add_box((1, 1, 0.1))
    world.step(0.01)
    for contact in world.contacts:
        normal, *tangents = contact.impulse
        # sums of impulses to the default tol
        assert np.abs(tangents).sum() <= friction * normal * (1 + 1e-10) + 1e-10


@pytest.mark.parametrize("level", LEVELS[:3])
def test_walls_rest_under_rolling_balls_at_any_number_of_threads(level: str) -> None:
    """What was decided of a wall is adjusted to the ball's place, with a factor that another thread
    may have: the bits of the balls are the same, and no brick moves."""
    ends = []
    for threads in (1, 2):
        world = perp.World(friction=0.6, accuracy=level, threads=threads)
        world.ground.add_plane((0, 0, 1))
        bricks, balls = [], []
        for wall, row, column in np.ndindex(4, 5, 5):
            at = (0.4 * column + 0.2 * (row % 2), 2.0 * wall, 0.1 + 0.2 * row)
            bricks.append(world.add_body(1.0, position=at))
            bricks[-1].add_box((0.2, 0.15, 0.1))
        world.run(0.05, 0.01)
        for wall in range(4):
            balls.append(world.add_body(0.5, position=(0.5, 2.0 * wall, 1.08),
                                        velocity=(0.5 + 0.2 * wall, 0, 0)))
            balls[-1].add_sphere(0.08)
        for _ in range(30):
            world.step(0.01)
            assert not any(np.any(brick.velocity) for brick in bricks)
        ends.append([ball.position for ball in balls])
    assert np.array_equal(*ends)
