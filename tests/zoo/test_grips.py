"""What two jaws on rails hold firmly goes where the palm goes, which is told to: lifted off the
ground, shaken, turned. Where the thing is beside the palm is NumPy's; that it can be held is
Coulomb's law for a mass point, with a margin."""
from __future__ import annotations

import numpy as np
import perp
import pytest

from scene import GRAVITY

LEVELS = ("fast", "standard", "accurate", "exact")
CORNERS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)


def matrix(q: np.ndarray) -> np.ndarray:
    w, v = q[0], q[1:]
    cross = np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])
    return np.eye(3) + 2 * w * cross + 2 * cross @ cross


def grip(random: np.random.Generator, level: str, jaws: int) -> tuple[perp.World, perp.Body,
                                                                     perp.Body, float]:
    """A thing of size L beside a finger of the palm and a jaw on a rail, or between two such jaws: they
    can hold 4 to 8 g."""
    L, mass = 10 ** random.uniform(-2, 1), 10 ** random.uniform(-2, 2)
    friction = random.uniform(0.3, 1)
    world = perp.World((0, 0, -GRAVITY * L), accuracy=level, friction=friction)
    world.ground.add_plane((0, 0, 1), 0)
    half = L * random.uniform((0.1, 0.1, 0.1), (0.4, 0.4, 0.5))
    kind = random.integers(3)
    half[2] = half[0] if kind == 1 else half[2]
    thing = world.add_body(mass, position=(0, 0, half[2]))
    if kind == 0:
        thing.add_box(half)
    elif kind == 1:
        thing.add_capsule(half[0], 0.3 * L, rotation=(np.sqrt(0.5), 0, 0, np.sqrt(0.5)))
    else:
        thing.add_hull(CORNERS * half)
    force = random.uniform(4, 8) * mass * GRAVITY * L / (2 * friction)
    palm = world.add_body(kind="kinematic", position=(0, 0, half[2]))
    finger = np.array((0.05 * L, 0.3 * L, min(0.3 * L, 0.9 * half[2])))
    if jaws == 1:
        palm.add_box(finger, offset=(-half[0] - 0.05 * L, 0, 0))
    light = 10 ** random.uniform(-1, 1)
    for side in (1, -1)[:jaws]:
        jaw = world.add_body(mass * light,
                             position=(side * (half[0] + 0.12 * L), 0, half[2]))
        jaw.add_box(finger)
        world.add_joint("prismatic", palm, jaw, axis=(1, 0, 0), motor_speed=-2 * side * L,
                        motor_force=force)
    return world, palm, thing, L


@pytest.mark.parametrize("level", LEVELS)
@pytest.mark.parametrize("jaws, motion", ((1, "lift"), (1, "shake"), (1, "turn"), (2, "lift"),
                                          (2, "shake")))
@pytest.mark.parametrize("seed", range(8))
def test_what_is_held_goes_with_the_palm(seed: int, jaws: int, motion: str, level: str) -> None:
    """Along the rails of two jaws nothing but what they weigh keeps it from going on, so that those
    weigh the same; and sweeps leave some overlap with these, which opens as it is lifted."""
    random = np.random.default_rng(seed)
    h = random.choice((1 / 60, 1 / 240, 1 / 1000))
    world, palm, thing, L = grip(random, level, jaws)
    for _ in range(round(0.6 / h)):
        assert world.step(h).advanced
    at, turned = thing.position - palm.position, matrix(thing.orientation)
    up, rate = GRAVITY * L * random.uniform(0.1, 1), random.uniform(2, 10)
    for step in range(1, round(0.9 / h) + 1):
        t = step * h
        way = np.sin(rate * max(t - 0.4, 0))
        palm.velocity = (0, 0, up * (t if motion == "lift" else max(0.2 - abs(t - 0.2), 0)))
        if motion == "shake":
            palm.velocity += 0.5 * GRAVITY * L / rate * way * np.array((2 - jaws, 1, 1))
        elif motion == "turn":
            palm.angular_velocity = (0, 0, 2 * way)
        assert world.step(h).advanced
        M = matrix(palm.orientation)
        slip = (M.T @ (thing.position - palm.position) - at)[jaws - 1:] / L
        # some roundings of a quaternion in each of a thousand steps, or that overlap
        least = 1e-12 if jaws == 1 else 2e-5
        assert np.abs(slip).max() < least, (seed, jaws, motion, level, step, slip)
        assert np.abs(M.T @ matrix(thing.orientation) - turned).max() < least
