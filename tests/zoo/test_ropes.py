"""Ropes of balls, no farther from each other than so much, that fall over a bar with a load at each
end. The loads pull them into the bar, where they turn it by much in a step: joints are closed by
ways that lead round the bar, not into it, and give no energy."""

from __future__ import annotations

import numpy as np
import perp
import pytest

from scene import about, matrix

LEVELS = ("fast", "standard", "accurate", "exact")
RADIUS, BAR = 0.05, 0.2


def rope(seed: int, level: str) -> tuple[perp.World, list[perp.Body], perp.Body, str]:
    """Stretched out above a round or a square bar, as long as that may be."""
    g = np.random.default_rng(seed)
    world = perp.World(accuracy=level, friction=g.uniform(0, 0.6))  # type: ignore[arg-type]
    kind, long = str(g.choice(("round", "square"))), 10 ** g.uniform(0, 2)
    bar = world.add_body(kind="static", position=(0, 0, 1), orientation=about("z", np.pi / 2))
    if kind == "round":
        bar.add_capsule(BAR, long)
    else:
        bar.add_box((long, BAR, BAR))
    balls: list[perp.Body] = []
    count, load = int(g.integers(10, 18)), 10 ** g.uniform(0, 1)
    for k in range(count):
        mass = 0.1 if 0 < k < count - 1 else load * g.uniform(0.5, 1)
        at = (0.16 * (k - count / 2), 0, 1 + BAR + 0.4)
        ball = world.add_body(mass, (0.4 * mass * RADIUS**2,) * 3, position=at)
        ball.add_sphere(RADIUS)
        if balls:
            world.add_joint("distance", balls[-1], ball, lower=0, upper=0.17)
        balls.append(ball)
    return world, balls, bar, kind


def depth(ball: perp.Body, bar: perp.Body, kind: str) -> float:
    """How deep the ball lies in the bar, seen along it: nothing comes near its ends."""
    x, z = (matrix(bar.orientation).T @ (ball.position - bar.position))[1:]
    if kind == "round":
        return RADIUS + BAR - float(np.hypot(x, z))
    out = np.maximum(np.abs((x, z)) - BAR, 0.0)
    return RADIUS - float(np.linalg.norm(out) if out.any() else np.abs((x, z)).max() - BAR)


@pytest.mark.parametrize("level", LEVELS)
def test_ropes_lie_on_their_bar(level: str) -> None:
    """No ball's centre comes into the bar, from where on its other side is as near; and energy never
    rises by a thousandth of what there was at the beginning."""
    for seed in range(10):
        world, balls, bar, kind = rope(seed, level)
        lowest = first = world.energy().total
        for step in range(90):
            world.step(1 / 60)
            energy = world.energy().total
            assert energy <= lowest + 1e-3 * abs(first), (seed, step)
            lowest = min(lowest, energy)
            assert max(depth(ball, bar, kind) for ball in balls) <= RADIUS, (seed, step)
