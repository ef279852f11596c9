"""Piles on a platform that a motor or dry friction of limited force moves up and down a rail. While
it goes slower than the motor aims at, or slides, the force is all that it may be: with W the weight,
the momentum of all of them changes by (F - W) h in a step, however well contacts are solved."""

from __future__ import annotations

import numpy as np
import perp
import pytest

GRAVITY = 9.81
LEVELS = ("fast", "standard", "accurate", "exact")


@pytest.mark.parametrize("drive", ("motor", "friction"))
@pytest.mark.parametrize("level", LEVELS)
def test_limited_forces_push_with_all_they_have(level: str, drive: str) -> None:
    """Contacts push one body as much as the other, and the rail pushes across: so it holds to
    rounding. At `fast` what sweeps leave may be worth more energy than motors have, which is taken
    from all velocities. Motors and brakes did nothing in whole steps that said `solved`, whose loads
    fell freely, wherever the impulses known from the last look were worse than none."""
    most = 0.1 if level == "fast" and drive == "motor" else 1e-9
    for seed in range(12):
        g = np.random.default_rng(seed)
        h = float(g.choice((1 / 30, 1 / 60, 1 / 240)))
        world = perp.World(accuracy=level, friction=g.uniform(0.2, 1))  # type: ignore[arg-type]
        spread, boxes = g.choice((0, 0.5, 1)), int(g.integers(4, 10))
        speed = g.uniform(2, 5) * g.choice((-1, 1)) if drive == "friction" else 0
        bodies = []
        for k in range(boxes + 1):
            mass = 10 ** (spread if k == 0 else g.uniform(-spread, spread))
            body = world.add_body(mass, velocity=(0, 0, speed),
                                  position=(0, 0, 0.4 * k if k else 0.1))
            body.add_box((0.4, 0.4, 0.2) if k else (1, 1, 0.1))
            bodies.append(body)
        masses = np.array([body.mass for body in bodies])
        weight = masses.sum() * GRAVITY
        force = g.uniform(0.3, 3) * weight
        if drive == "motor":
            world.add_joint("prismatic", world.ground, bodies[0], axis=(0, 0, 1),
                            motor_speed=100, motor_force=force)
        else:
            world.add_joint("prismatic", world.ground, bodies[0], axis=(0, 0, 1), friction=force)
        push = force if drive == "motor" else -np.sign(speed) * force
        before = masses @ [body.velocity[2] for body in bodies]
        for step in range(4):
            world.step(h)
            after = masses @ [body.velocity[2] for body in bodies]
            slides = drive == "motor" or after * before > 0 and abs(bodies[0].velocity[2]) > h
            error = abs(after - before - h * (push - weight))
            assert not slides or error < most * h * (force + weight), (seed, step)
            before = after
