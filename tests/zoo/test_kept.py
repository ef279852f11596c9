"""Random lives without motors: bodies and ball joints come and go, velocities are set, snapshots are
restored. No step gives energy where nothing lies in another, and nothing that is told as sticking
slips."""

from __future__ import annotations

import numpy as np
import perp
import pytest

# What a step may leave of a speed, and with it of a stick's slip: the levels' own tolerances.
LEVELS = {"fast": 1e-2, "standard": 1e-3, "accurate": 1e-6, "exact": 1e-9}
GRAVITY = 9.81


def add_body(world: perp.World, random: np.random.Generator) -> perp.Body:
    size = 2 if world.planar else 3
    half, mass, q = random.uniform(0.1, 0.35, size), random.uniform(0.2, 5), random.normal(size=4)
    share = 1.0 if world.planar else random.uniform(1, 1.9, 3)
    body = world.add_body(
        mass=mass,
        inertia=0.1 * mass * half.max() ** 2 * share,
        position=np.append(random.uniform(-1.2, 1.2, size - 1), random.uniform(0.3, 3)),
        orientation=random.uniform(-3, 3) if world.planar else q / np.linalg.norm(q),
        velocity=random.normal(size=size) * random.choice((0, 1, 3)),
    )
    law = {"restitution": random.choice((0, 0, 0.3, 0.9)), "friction": random.choice((0, 0.3, 1))}
    kind = random.integers(3)
    if kind == 0:
        body.add_sphere(half[0], **law)
    elif kind == 1:
        body.add_box(half, **law)
    else:
        body.add_capsule(0.5 * half[0], half[1], **law)
    return body


def change(world: perp.World, random: np.random.Generator, h: float) -> None:
    """What a caller does between steps; most often nothing."""
    bodies, what = world.bodies, random.random()
    i, j = random.choice(len(bodies), 2, replace=False)
    if what < 0.05 and len(bodies) > 2:
        bodies[i].remove()
    elif what < 0.1:
        add_body(world, random)
    elif what < 0.14:
        bodies[i].velocity = 2 * random.normal(size=2 if world.planar else 3)
    elif what < 0.17 and not world.planar:
        middle = 0.5 * (np.array(bodies[i].position) + np.array(bodies[j].position))
        world.add_joint("ball", bodies[i], bodies[j], anchor=middle)
    elif what < 0.19:
        kept = world.snapshot()
        world.step(h)
        world.restore(kept)


def energy(world: perp.World) -> tuple[float, float]:
    """Kinetic and potential, from the states; and the size of its terms."""
    kinetic = potential = size = 0.0
    for body in world.bodies:
        v, spin = np.array(body.velocity), np.atleast_1d(body.angular_velocity)
        moments = np.atleast_2d(body.inertia)
        if not world.planar:  # inertia is given in the body's axes
            w, x, y, z = body.orientation
            turn = np.array(
                [
                    [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                    [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                    [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
                ]
            )
            spin = turn.T @ spin
        kinetic += 0.5 * (body.mass * v @ v + spin @ moments @ spin)
        potential += body.mass * GRAVITY * body.position[-1]
        size += body.mass * GRAVITY * abs(body.position[-1])
    return kinetic + potential, kinetic + size


def deepest(world: perp.World) -> float:
    return min([contact.gap for contact in world.contacts], default=0.0)


@pytest.mark.parametrize("level", LEVELS)
@pytest.mark.parametrize("seed", range(15))
def test_a_random_life_keeps_its_energy_and_its_sticks(seed: int, level: str) -> None:
    random = np.random.default_rng(seed)
    planar = bool(random.random() < 0.35)
    down = (0, -GRAVITY) if planar else (0, 0, -GRAVITY)
    world = perp.World(down, planar=planar, accuracy=level, friction=random.choice((0, 0.5, 0.8)))
    world.ground.add_plane((0, 1) if planar else (0, 0, 1), 0)
    for _ in range(int(random.integers(2, 9))):
        add_body(world, random)
    h = random.choice((0.002, 0.005, 0.01, 1 / 60))
    for step in range(40):
        change(world, random, h)
        before, overlap = energy(world)[0], deepest(world)
        result = world.step(h)
        after, size = energy(world)
        assert result.advanced
        if result.outcome not in ("solved", "rounding_limit"):
            continue
        # what lies in another is lifted out of it; up to a millimetre that shows in 1e-5 at most
        if min(overlap, deepest(world)) > -1e-3:
            assert after <= before + 1e-5 * size, (step, (after - before) / size)
        fastest = max(1.0, np.abs(world.velocities).max())
        for contact in world.contacts:
            if contact.mode == "stick":
                assert np.abs(np.asarray(contact.velocity)[1:]).max() <= LEVELS[level] * fastest
    world.close()
