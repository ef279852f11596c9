"""Balls that go far in a step strike floors and roll on: what friction takes of their velocity it
gives to their spin. With a floor's normal n, v - I / (m R) n x w along the floor is what it was,
whatever the floor is, and wherever in a step it is struck. Free bodies that strike each other keep
their angular momentum."""

from __future__ import annotations

import numpy as np
import perp
import pytest

FLOORS = ("half-space", "box", "hull", "lift")


def add_floor(world: perp.World, kind: str, restitution: float) -> None:
    flat = world.planar
    down = (0, -1) if flat else (0, 0, -1)
    if kind == "half-space":
        world.ground.add_plane((0, 1) if flat else (0, 0, 1), restitution=restitution)
    elif kind == "hull":
        half = np.array((60, 1)) if flat else np.array((60, 60, 1))
        corners = np.array(np.meshgrid(*[(-1, 1)] * len(half))).reshape(len(half), -1).T
        if flat:
            corners = corners[[0, 1, 3, 2]]
        world.ground.add_hull(corners * half + down, restitution=restitution)
    else:
        lift = world.ground
        if kind == "lift":
            lift = world.add_body(kind="kinematic", velocity=-0.5 * np.array(down))
        lift.add_box((60, 1) if flat else (60, 60, 1), offset=down, restitution=restitution)


@pytest.mark.parametrize("level", ["fast", "standard", "accurate", "exact"])
@pytest.mark.parametrize("floor", FLOORS)
def test_spin_is_what_friction_took(floor: str, level: str) -> None:
    """To 1e-9 of the velocity: impulses are known to `tol`, 1e-10, and balls strike some ten times.
    With the arm to the middle of the gap that a step begins with, .7 of the spin was missing."""
    for seed in range(12):
        g = np.random.default_rng(seed)
        flat, mu, e = seed % 2 == 1, g.uniform(0.1, 1), float(g.choice((0, 0.5, 1)))
        radius, h = 10 ** g.uniform(-2, -0.3), 10 ** g.uniform(-3, -1.5)
        at, v = g.uniform(-1, 1, 3), g.uniform(-8, 8, 3)
        v[2] = -g.uniform(1, 15)
        at[2] = radius - v[2] * h * g.uniform(0, 3)
        w = g.uniform(-0.1, 0.1, 3) / h
        world = perp.World(planar=flat, friction=mu, accuracy=level)
        add_floor(world, floor, e)
        ball = world.add_body(position=at[[0, 2]] if flat else at, velocity=v[[0, 2]] if flat else v,
                              angular_velocity=w[0] if flat else w)
        ball.add_sphere(radius)
        share = (ball.inertia if flat else ball.inertia[0, 0]) / (ball.mass * radius)

        def kept() -> np.ndarray:
            if flat:
                return np.array(ball.velocity[0] - share * ball.angular_velocity)
            return (ball.velocity - share * np.cross((0, 0, 1), ball.angular_velocity))[:2]

        first = kept()
        for _ in range(60):
            world.step(h)
        assert np.abs(kept() - first).max() < 1e-9 * np.linalg.norm(v), (seed, kept() - first)


def add_body(world: perp.World, g: np.random.Generator, e: float, at: np.ndarray, v: np.ndarray,
             spin: float) -> perp.Body:
    flat, q = world.planar, g.normal(size=4)
    kind = g.choice(("ball", "box", "capsule", "hull"))
    body = world.add_body(position=at, velocity=v, orientation=g.uniform(-3, 3) if flat
                          else q / np.linalg.norm(q),
                          angular_velocity=spin * g.normal(size=None if flat else 3))
    if kind == "ball":
        body.add_sphere(0.4, restitution=e)
    elif kind == "box":
        body.add_box(g.uniform(0.2, 0.5, len(at)), restitution=e)
    elif kind == "capsule":
        body.add_capsule(0.2, 0.3, restitution=e)
    else:
        corners = g.normal(size=(3 if flat else 12, len(at)))
        corners *= 0.5 / np.linalg.norm(corners, axis=1)[:, None]
        corners = np.vstack((corners, -corners))
        if flat:
            corners = corners[np.argsort(np.arctan2(*corners.T[::-1]))]
        body.add_hull(corners, restitution=e)
    return body


def angular(body: perp.Body) -> np.ndarray:
    """About the origin, of a body at hand."""
    if len(body.position) == 2:
        (x, y), (vx, vy) = body.position, body.velocity
        return np.array(body.mass * (x * vy - y * vx) + body.inertia * body.angular_velocity)
    orbit = body.mass * np.cross(body.position, body.velocity)
    w, *u = body.orientation
    to = np.array([x + 2 * np.cross(u, np.cross(u, x) + w * x) for x in np.eye(3)]).T
    return orbit + to @ body.inertia @ to.T @ body.angular_velocity


def missed(seed: int, level: str, flat: bool) -> tuple[float, float]:
    """What two free bodies that strike each other miss of their angular momentum, and their turn."""
    g = np.random.default_rng(seed)
    world = perp.World(gravity=(0, 0) if flat else (0, 0, 0), planar=flat, accuracy=level,
                       friction=g.choice((0, 0.5)))
    e, h, spin = g.choice((0.5, 1)), 1 / 10 ** g.uniform(1.5, 3), g.choice((0, 3))
    n = 2 if flat else 3
    bodies = [add_body(world, g, e, np.zeros(n), np.zeros(n), spin)]
    at, v = np.array((1.2, 0, 0))[:n] + g.uniform(-0.2, 0.2, n), np.array((-6, 0, 0))[:n]
    bodies.append(add_body(world, g, e, at, v + g.uniform(-2, 2, n), spin))
    first, size, turn = sum(map(angular, bodies)), bodies[1].mass * 6 * 0.4, 0.0
    for _ in range(int(0.3 / h)):
        world.step(h)
        turn = max(turn, *(h * np.linalg.norm(body.angular_velocity) for body in bodies))
    return float(np.linalg.norm(sum(map(angular, bodies)) - first) / size), turn


@pytest.mark.parametrize("level", ["fast", "exact"])
def test_angular_momentum_of_two_is_kept_in_the_plane(level: str) -> None:
    """To 1e-9, impulses being known to `tol`, 1e-10; one in forty slides along the other after the
    impact, and what lasts while normals turn is of first order. With arms to where each surface was
    as the step began one in three missed, by up to .05."""
    misses = np.array([missed(seed, level, True)[0] for seed in range(80)])
    assert (misses > 1e-9).sum() <= 2, np.sort(misses)[-5:]
    assert misses.max() < 1e-3


@pytest.mark.parametrize("level", ["fast", "exact"])
def test_angular_momentum_of_two_is_kept_in_space(level: str) -> None:
    """To second order of the turn, as inertia turns in what is left of a step after its impact: a
    tenth of its square for all but one in twenty, which slide on. It was one in three."""
    found = np.array([missed(seed, level, False) for seed in range(80)])
    beyond = found[:, 0] > 0.1 * found[:, 1] ** 2 + 1e-9
    assert beyond.sum() <= 4, found[beyond]
    assert found[:, 0].max() < 5e-3
