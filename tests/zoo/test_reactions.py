"""What joints tell of their impulses and moments is what changes the momentum of their bodies.

Of each body, over a step of length h, with the impulse J and the moment T of its joints (the other
way round on body A) and arms from its mass centre to the anchor on B, means of both ends,

    m dv = h m g + sum J,        dL = sum (T + arm x J),        L = R I R' w by NumPy alone.

    python -m pytest tests/zoo/test_reactions.py
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import perp
import pytest

sys.path.insert(0, str(Path(__file__).parent))

import articulated

STEPS = 8
# Where a body turns by an angle a in a step, sums with the mean arm are off by a^2 / 12 of each of
# their terms, of which bodies in chains have many; what gives energy back changes momentum by a^2
# of it at most. Impulses of the way alone missed by a / 10 and more. Rounding is beside momenta
# that are up to 1e6 times what a step changes.
LINEAR, ANGULAR, ROUNDING = 0.5, 1.0, 1e-9


def spins(world: perp.World, rows: list[int], moments: np.ndarray) -> np.ndarray:
    """Angular momenta about the mass centres."""
    turns = articulated.matrices(world.orientations[rows])
    own = np.einsum("kji,kj->ki", turns, world.angular_velocities[rows])
    return np.einsum("kij,kj->ki", turns, moments * own)


def misses(system: articulated.System, level: str, parts: int) -> np.ndarray:
    """The largest of steps, beside their largest terms: linear, angular; and the largest turn."""
    world, bodies = articulated.build(system, level)
    h, rows = system.dt / parts, [body.index for body in bodies]
    mass = np.array([[link.mass] for link in system.links])
    moments = np.array([link.moments for link in system.links])
    worst = np.zeros(3)
    for _ in range(STEPS * parts):
        x, v, spin = world.positions[rows], world.velocities[rows], spins(world, rows, moments)
        anchors = [joint.anchor for joint in world.joints]
        result = world.step(h)
        assert result.advanced
        if result.steps > 1:  # joints tell of the last part
            continue
        x = (x + world.positions[rows]) / 2
        push = mass * (world.velocities[rows] - v - h * system.gravity)
        turn = spins(world, rows, moments) - spin
        worst[2] = max(worst[2], h * np.linalg.norm(world.angular_velocities[rows], axis=1).max())
        # rounding of momenta is no miss
        sizes = [h * mass * np.linalg.norm(system.gravity) + 1e-6 * mass * np.abs(v).max(), 0]
        sizes = [sizes[0].max(), system.size * sizes[0].max() + 1e-6 * np.abs(spin).max()]
        for joint, hinge, anchor in zip(world.joints, system.hinges, anchors):
            told, anchor = joint.reaction, (anchor + joint.anchor) / 2
            for body, sign in ((hinge.a, -1), (hinge.b, 1)):
                if body < 0:
                    continue
                about = np.cross(anchor - x[body], told.impulse)
                push[body] -= sign * told.impulse
                turn[body] -= sign * (told.moment + about)
                terms = (told.impulse, told.moment), (told.impulse, about)
                sizes = [max(size, *(np.linalg.norm(term[k]) for term in terms))
                         for k, size in enumerate(sizes)]
        for k, miss in enumerate((push, turn)):
            worst[k] = max(worst[k], np.linalg.norm(miss, axis=1).max() / sizes[k])
    world.close()
    return worst


@pytest.mark.parametrize("level", articulated.LEVELS)
def test_impulses_balance_the_change_of_momentum(level: str) -> None:
    for seed in range(40):
        system = articulated.make(seed)
        if len(system.links) > 8:
            continue
        for parts in (1, 4):
            linear, angular, turn = misses(system, level, parts)
            what = f"seed {seed}, {parts} parts, {level}: {linear:.1e} and {angular:.1e} at turns " \
                   f"of {turn:.1e}; {system.name}"
            assert linear <= LINEAR * turn**2 + ROUNDING, what
            assert angular <= ANGULAR * turn**2 + ROUNDING, what


@pytest.mark.parametrize("level", articulated.LEVELS)
def test_a_jerk_is_told_once(level: str) -> None:
    """A step that begins with velocities which its joint does not have changes them by what the
    joint tells, to rounding: nothing is given back to them."""
    random = np.random.default_rng(3)
    for kind in ("ball", "revolute", "fixed", "prismatic"):
        for _ in range(4):
            world = perp.World(gravity=random.uniform(-10, 10, 3), accuracy=level)
            bodies = [world.add_body(random.uniform(0.5, 2), np.diag(random.uniform(0.1, 0.15, 3)),
                                     position=random.uniform(-1, 1, 3),
                                     velocity=random.uniform(-1, 1, 3)) for _ in range(2)]
            joint = world.add_joint(kind, *bodies, anchor=(0, 0, 0), axis=random.uniform(0.1, 1, 3))
            before = [body.velocity for body in bodies]
            assert world.step(0.004).steps == 1
            for body, v, sign in zip(bodies, before, (-1, 1)):
                gain = body.mass * (body.velocity - v - 0.004 * world.gravity)
                assert np.abs(gain - sign * joint.reaction.impulse).max() <= 1e-12 * body.mass
            world.close()
