"""Joints that say what others do, on bodies that turn freely: doors on several hinges, loops of
hinges, welds beside hinges and slides, rods more than enough. Nothing acts, so that linear and
angular momentum and energy stay; so they do of the same bodies with as many rows as it takes.

    python -m pytest tests/zoo/test_repeated.py
"""

from __future__ import annotations

from typing import Callable

import numpy as np
import pytest

import perp

from scene import matrix, unit

LEVELS = ("fast", "standard", "accurate", "exact")
SPIN, STEPS = 4.0, 60
Random = np.random.Generator


def momenta(world: perp.World) -> tuple[np.ndarray, np.ndarray]:
    linear, angular = np.zeros(3), np.zeros(3)
    for body in world.bodies:
        if body.kind != "dynamic":
            continue
        R, push = matrix(body.orientation), body.mass * body.velocity
        linear += push
        angular += np.cross(body.position, push)
        angular += R @ body.inertia @ R.T @ body.angular_velocity
    return linear, angular


def kinetic(world: perp.World) -> float:
    energy = 0.0
    for body in world.bodies:
        if body.kind == "dynamic":
            w = matrix(body.orientation).T @ body.angular_velocity
            energy += body.mass * body.velocity @ body.velocity / 2 + w @ body.inertia @ w / 2
    return energy


def tumble(world: perp.World, random: Random) -> None:
    """All turn as one about their mass centre; a first short step makes that their joints' own."""
    bodies = [body for body in world.bodies if body.kind == "dynamic"]
    mass = sum(body.mass for body in bodies)
    centre, spin = sum(body.mass * body.position for body in bodies) / mass, SPIN * unit(random)
    for body in bodies:
        body.velocity = np.cross(spin, body.position - centre)
        body.angular_velocity = spin


def pair(what: str) -> Callable[[perp.World, Random], None]:
    def build(world: perp.World, random: Random) -> None:
        a, b = (
            world.add_body(
                mass,
                random.uniform(0.05, 0.08, 3),
                position=random.standard_normal(3),
                orientation=unit(random, 4),
            )
            for mass in (1.0, 2.0)
        )
        axis, middle, places = unit(random), (a.position + b.position) / 2, []
        for _ in range(8):
            places.append((a.position + unit(random), b.position + unit(random)))
        for word in what.split():
            if word == "rod":
                ends = places.pop()
                world.add_joint("distance", a, b, anchor=ends[0], anchor_b=ends[1])
            elif word in ("ball", "weld", "slide"):  # anywhere: what they say is the same
                kind = {"ball": "ball", "weld": "fixed", "slide": "prismatic"}[word]
                world.add_joint(kind, a, b, anchor=places.pop()[0], axis=axis)
            else:
                at = middle + random.uniform(-0.3, 0.3) * axis
                world.add_joint("revolute", a, b, anchor=at, axis=axis)
        tumble(world, random)
        if set(what.split()) == {"hinge"}:
            a.velocity = a.velocity + np.cross(axis, a.position - middle)
            a.angular_velocity = a.angular_velocity + axis

    return build


def ring(count: int, repeats: bool) -> Callable[[perp.World, Random], None]:
    """Bars with hinges that are parallel; or one of them a ball, and one that lets slide."""

    def build(world: perp.World, random: Random) -> None:
        R = matrix(unit(random, 4))
        angles = 2 * np.pi * np.arange(count) / count
        corners = np.stack([np.cos(angles), 0 * angles, np.sin(angles)], 1)
        corners = random.uniform(0.4, 0.8, (count, 1)) * corners @ R.T
        bars = []
        for p, q in zip(corners, np.roll(corners, -1, 0)):
            mass, d = 10 ** random.uniform(-0.5, 0.5), q - p
            inertia = mass * ((d @ d * np.eye(3) - np.outer(d, d)) / 12 + 0.002 * np.eye(3))
            bars.append(world.add_body(mass, inertia, position=(p + q) / 2))
        for k in range(count):
            kind = "revolute" if repeats or k > 1 else ("ball", "cylindrical")[k]
            world.add_joint(kind, bars[k - 1], bars[k], anchor=corners[k], axis=R[:, 1])
        tumble(world, random)
        if count > 3:
            bars[0].angular_velocity = bars[0].angular_velocity + R[:, 1]

    return build


MEMBERS = {
    "one hinge": pair("hinge"),
    "two hinges": pair("hinge hinge"),
    "three hinges": pair("hinge hinge hinge"),
    "a weld": pair("weld"),
    "a hinge and a weld": pair("hinge weld"),
    "a slide and a weld": pair("slide weld"),
    "a slide": pair("slide"),
    "parallel slides": pair("slide slide"),
    "a hinge and balls": pair("hinge ball ball ball"),
    "six rods": pair("rod " * 6),
    "eight rods": pair("rod " * 8),
    "three bars, enough rows": ring(3, False),
    "three bars": ring(3, True),
    "four bars, enough rows": ring(4, False),
    "four bars": ring(4, True),
    "six bars": ring(6, True),
}


@pytest.mark.parametrize("level", LEVELS)
@pytest.mark.parametrize("member", MEMBERS)
def test_what_turns_freely_keeps_its_momenta(member: str, level: str) -> None:
    """Linear momentum is kept to rounding. A step may leave (w h)^3 of angular momentum, as a rule of
    second order does, and of energy, where paths are those of two rounds; nothing gains."""
    for h in (0.01, 0.002):
        for seed in range(3):
            random = np.random.default_rng(seed)
            world = perp.World((0, 0, 0), accuracy=level)
            MEMBERS[member](world, random)
            world.step(1e-6)
            (push, turn), energy = momenta(world), kinetic(world)
            fastest = max(SPIN, np.linalg.norm(world.angular_velocities, axis=1).max())
            order = STEPS * (fastest * h) ** 3
            for _ in range(STEPS):
                assert world.step(h).outcome == "solved", (seed, h)
            linear, angular = momenta(world)
            size = sum(b.mass for b in world.bodies if b.kind == "dynamic")
            assert np.abs(linear - push).max() <= 1e-12 * size * np.abs(world.velocities).max()
            assert np.linalg.norm(angular - turn) <= order * np.linalg.norm(turn), (seed, h)
            assert -order <= kinetic(world) / energy - 1 <= 1e-9, (seed, h)


@pytest.mark.parametrize("level", ("standard", "exact"))
def test_rings_of_hinges_fall(level: str) -> None:
    """On a floor: what hinges say again is left out beside contacts as well, and all is solved."""
    for seed in range(3):
        random = np.random.default_rng(seed)
        world = perp.World((0, 0, -9.81), accuracy=level, friction=0.5)
        ring(int(random.integers(4, 8)), True)(world, random)
        world.ground.add_plane((0, 0, 1), offset=-1.0)
        for body in world.bodies:
            if body.kind == "dynamic":
                body.add_sphere(0.1)
        for _ in range(100):
            assert world.step(0.008).outcome == "solved", seed
