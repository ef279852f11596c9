"""What takes joined bodies out of overlaps gives no energy, and leaves none of what turns far.

Stacks fall on a plate on a rail whose end holds it: ways out of an overlap press it against that.
Rotors of gyroscopes sink to the ground while they turn by up to two radians a step: that they
turned deep into it tells no sweep, and what they lift themselves by is their motion's.
"""

from __future__ import annotations

import numpy as np
import perp
import pytest

from links import energy
from scene import GRAVITY, about, matrix

LEVELS = ("fast", "standard", "exact")


def stack(seed: int, level: str) -> tuple[perp.World, list[perp.Body], np.random.Generator]:
    random = np.random.default_rng(seed)
    world = perp.World(accuracy=level, friction=random.choice((0.3, 1.0)))  # type: ignore[arg-type]
    plate = world.add_body(10 ** random.uniform(-1, 2), position=(0, 0, 1))
    plate.add_box((1, 1, 0.1))
    world.add_joint("prismatic", world.ground, plate, axis=(random.choice((0, 0.3)), 0, 1),
                    lower=-random.uniform(0, 0.7), upper=random.choice((0, 0.2)))
    bodies = [plate]
    for k in range(int(random.integers(2, 6))):
        place = (*random.uniform(-0.1, 0.1, 2), 1.35 + 0.5 * k)
        body = world.add_body(10 ** random.uniform(-1, 1), position=place)
        if random.random() < 0.6:
            body.add_box((0.3, 0.3, 0.2))
        else:
            body.add_capsule(0.06, 0.16)
        bodies.append(body)
    return world, bodies, random


@pytest.mark.parametrize("level", LEVELS)
def test_plates_at_their_limits_give_no_energy(level: str) -> None:
    """By no more than 1e-9 of what moves and of the weight times a size. Energies at heights of some
    metres are known to 1e-15 of that; joints are closed to 1e-12, ways to 1e-10."""
    for seed in range(12):
        world, bodies, random = stack(seed, level)
        weight = GRAVITY * sum(body.mass for body in bodies)
        even = random.random() < 0.5
        before = energy(bodies, np.zeros(3), 0.0)
        for step in range(200):
            world.step(1 / 60 if even else 10 ** random.uniform(-3, -1.5))
            now = energy(bodies, np.zeros(3), 0.0)
            moving = now - GRAVITY * sum(body.mass * body.position[2] for body in bodies)
            assert now - before <= 1e-9 * (moving + 0.3 * weight), (seed, step)
            before = now


RADIUS, HALF, SIDES = 0.2, 0.03, 12  # of rotors: prisms


@pytest.mark.parametrize("level", LEVELS)
def test_rotors_stay_out_of_the_ground(level: str) -> None:
    """But for the sagitta of an edge, which is what a turn from edge to edge takes away: a motion
    that is level ends so deep at most."""
    angle = 2 * np.pi / SIDES * np.arange(SIDES)
    rim = np.array([(RADIUS * np.cos(a), RADIUS * np.sin(a), z) for a in angle for z in (-HALF, HALF)])
    sagitta = RADIUS * (1 - np.cos(np.pi / SIDES))
    for seed in range(12):
        random = np.random.default_rng(seed)
        world = perp.World(accuracy=level, friction=0.5)  # type: ignore[arg-type]
        world.ground.add_plane((0, 0, 1), -0.25)
        step = float(random.choice((1 / 60, 1 / 240)))
        frame = world.add_body(10 ** random.uniform(-2, 1), np.full(3, 10 ** random.uniform(-3, -1)))
        rotor = world.add_body(10 ** random.uniform(-1, 1), position=(0.5, 0, 0),
                               orientation=about("y", np.pi / 2),
                               angular_velocity=(min(random.uniform(0.3, 2) / step, 400), 0, 0))
        rotor.add_hull(rim)
        world.add_joint("ball", world.ground, frame, anchor=(0, 0, 0))
        world.add_joint("revolute", frame, rotor, anchor=(0.5, 0, 0), axis=(1, 0, 0))
        if seed % 2:
            ball = world.add_body(1.0, position=(0.9, 0, 0))
            ball.add_sphere(0.1)
            world.add_joint("ball", rotor, ball, anchor=(0.6, 0, 0))
        for k in range(300):
            world.step(step)
            low = rotor.position[2] + (rim @ matrix(rotor.orientation).T)[:, 2].min()
            assert low >= -0.25 - sagitta, (seed, k, low + 0.25)
