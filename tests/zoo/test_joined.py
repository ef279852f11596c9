"""Bodies that joints hold or carriers move, beside what is known of them: clusters of boxes that
fixed joints hold together beside the same boxes as one body; chains with light beads that hang;
boxes and weights on slopes, beams and turntables that move.

    python -m pytest tests/zoo/test_joined.py
"""

from __future__ import annotations

import numpy as np
import pytest

import perp

LEVELS = ("fast", "standard", "accurate", "exact")
GRAVITY = 9.81


def turning(q: np.ndarray) -> np.ndarray:
    w, x, y, z = q
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + 2 * w * cross + 2 * cross @ cross


def random_cluster(random: np.random.Generator) -> tuple[np.ndarray, list[tuple[int, int]]]:
    """Places of unit boxes, one on the ground, and a tree of joints: others touch as well."""
    cells, edges = [(0, 0, 0)], []
    ways = [(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1)]
    count = int(random.integers(3, 9))
    while len(cells) < count:
        k = int(random.integers(len(cells)))
        cell = tuple(np.add(cells[k], ways[random.integers(5)]))
        if cell not in cells and cell[2] > 0:
            edges.append((k, len(cells)))
            cells.append(cell)
    return np.array(cells, float) + (0, 0, 0.5), edges


def one_body(world: perp.World, places: np.ndarray, masses: np.ndarray, q: np.ndarray) -> None:
    R, whole = turning(q), masses.sum()
    centre, inertia = masses @ places / whole, np.zeros((3, 3))
    for mass, d in zip(masses, places - centre):
        inertia += mass * (np.eye(3) / 6 + d @ d * np.eye(3) - np.outer(d, d))
    body = world.add_body(whole, inertia, position=R @ centre, orientation=q)
    for place in places:
        body.add_box((0.5, 0.5, 0.5), offset=place - centre)


def many_bodies(
    world: perp.World,
    places: np.ndarray,
    masses: np.ndarray,
    q: np.ndarray,
    edges: list[tuple[int, int]],
) -> None:
    R, bodies = turning(q), []
    for mass, place in zip(masses, places):
        bodies.append(world.add_body(mass, position=R @ place, orientation=q))
        bodies[-1].add_box((0.5, 0.5, 0.5))
    for i, j in edges:
        middle = (places[i] + places[j]) / 2
        world.add_joint("fixed", bodies[i], bodies[j], anchor=R @ middle)


@pytest.mark.parametrize("level", LEVELS)
def test_fixed_clusters_move_as_one_body(level: str) -> None:
    """Whether they stand, and how fast they topple after ten steps: to a hundredth, ten steps of
    the second order, h^2 g / l = 1e-3 each; `fast` promises a hundredth of what forces make of
    velocities, g t, and comes to a fifth."""
    standing, falling = 0, 0
    for seed in range(24):
        random = np.random.default_rng(seed)
        places, edges = random_cluster(random)
        masses = 10 ** random.uniform(-0.5, 0.5, len(places))
        q = random.standard_normal(4) if seed % 2 else np.array([1.0, 0, 0, 0])
        q /= np.linalg.norm(q)
        spins = []
        for joined in (False, True):
            world = perp.World(turning(q) @ (0, 0, -GRAVITY), accuracy=level, friction=0.5)
            world.add_body(kind="static", orientation=q).add_plane((0, 0, 1))
            if joined:
                many_bodies(world, places, masses, q, edges)
            else:
                one_body(world, places, masses, q)
            for _ in range(10):
                world.step(0.01)
            spins.append(np.abs(world.angular_velocities).max())
        standing, falling = standing + (spins[0] == 0), falling + (spins[0] > 0)
        left = 0.01 * GRAVITY * 0.1 if level == "fast" and spins[0] > 0 else 0.0
        share = 0.2 if level == "fast" else 0.01
        assert abs(spins[1] - spins[0]) <= share * spins[0] + left, (seed, spins)
    assert standing >= 4 and falling >= 4


@pytest.mark.parametrize("base", ["static", "kinematic"])
@pytest.mark.parametrize("level", LEVELS)
def test_chains_with_light_beads_hang(base: str, level: str) -> None:
    """1e-9 off the vertical. Beads swing at up to 40 radians a step, for which rounds of a path do
    not settle. What hangs that still swings by no more than that, and rods keep their length."""
    for seed in range(12):
        random = np.random.default_rng(seed)
        world = perp.World(accuracy=level)
        bodies, anchor = [world.add_body(kind=base)], np.zeros(3)
        count = int(random.integers(2, 5))
        for k in range(count):
            length, ratio = random.uniform(0.1, 0.5), 10 ** random.uniform(-5, 0)
            mass = 100.0 if k == count - 1 else 100 * ratio
            end = anchor + (1e-9 * length, 0, -length)
            bodies.append(world.add_body(mass, 0.1 * mass * length**2, position=end))
            world.add_joint("distance", *bodies[-2:], anchor=anchor, anchor_b=end)
            anchor = end
        first = world.positions.copy()
        for _ in range(60):
            world.step(0.01)
        # from 1e-9 of .5 m: sqrt(9.81 / .1) swings a second of that, with light ends 30 times it
        assert np.abs(world.velocities).max() < 1e-6, seed
        assert np.abs(world.positions - first).max() < 1e-6, seed


@pytest.mark.parametrize("level", LEVELS)
@pytest.mark.parametrize("rope", [False, True])
def test_tied_boxes_go_with_their_slope(level: str, rope: bool) -> None:
    """Boxes tied to a post and to each other on a slope that is too steep for their friction: both
    slope and post move, and all go with them to the last bit."""
    for seed in range(12):
        random = np.random.default_rng(seed)
        heading, steep = random.uniform(0, 2 * np.pi), random.uniform(0.3, 0.9)
        v, friction = random.uniform(-0.7, 0.7, 3), np.tan(steep) * random.uniform(0.1, 0.9)
        q = np.array([np.cos(heading / 2), 0, 0, np.sin(heading / 2)])
        R = turning(q)
        gravity = GRAVITY * R @ (np.sin(steep), 0, -np.cos(steep))
        world = perp.World(gravity, accuracy=level, friction=friction)
        world.add_body(kind="kinematic", velocity=v).add_plane((0, 0, 1))
        bodies = [world.add_body(kind="kinematic", velocity=v)]
        for k in range(int(random.integers(1, 6))):
            mass = 10 ** random.uniform(-1, 1)
            box = world.add_body(mass, position=R @ (k, 0, 0.2), orientation=q, velocity=v)
            box.add_box((0.3, 0.3, 0.2))
            ends = R @ (k - 0.7, 0, 0.13), R @ (k - 0.3, 0, 0.13)
            limits = {"upper": float(np.linalg.norm(ends[1] - ends[0]))} if rope else {}
            world.add_joint("distance", bodies[-1], box, anchor=ends[0], anchor_b=ends[1], **limits)
            bodies.append(box)
        for _ in range(10):
            world.step(0.01)
        assert all((box.velocity == v).all() for box in bodies), seed
        assert not world.angular_velocities.any(), seed


@pytest.mark.parametrize("level", LEVELS)
def test_boxes_ride_on_a_turntable(level: str) -> None:
    """Piles of one to three boxes at a share of the friction that takes them round: they stay in
    their place to rounding, or slide off. A step turns velocities by its chord, which is shorter
    than the arc by (w h)^2 / 24 < 1e-4: so far from the edge the shares stay."""
    for seed in range(12):
        random = np.random.default_rng(seed)
        friction, radius = random.uniform(0.1, 0.5), random.uniform(0.5, 3)
        share = 1 + random.choice((-1, 1)) * 10 ** random.uniform(-3.5, -0.5)
        omega = np.sqrt(share * friction * GRAVITY / radius) * random.choice((-1, 1))
        heading, steps = random.uniform(0, 2 * np.pi), 100
        world = perp.World(accuracy=level, friction=friction)
        table = world.add_body(kind="kinematic", angular_velocity=(0, 0, omega))
        table.add_box((5, 5, 0.5), offset=(0, 0, -0.5))
        place = radius * np.array([np.cos(heading), np.sin(heading), 0])
        for k in range(int(random.integers(1, 4))):
            box = world.add_body(
                10 ** random.uniform(-1, 1),
                position=place + (0, 0, 0.1 + 0.2 * k),
                velocity=np.cross((0, 0, omega), place) * (1 + 2.0**-52 * int(random.integers(3))),
                angular_velocity=(0, 0, omega),
            )
            box.add_box((0.3, 0.3, 0.1))
        for _ in range(steps):
            world.step(0.01)
        radii = np.hypot(*world.positions[-(k + 1) :, :2].T)
        if share < 1:
            assert np.abs(radii - radius).max() < 1e-12 * radius, (seed, share)
        else:  # outwards by at least a part of what the friction lacks.
            lacks = (share - 1) * friction * GRAVITY * (0.01 * steps) ** 2 / 2
            assert radii.min() - radius > 0.1 * lacks, (seed, share)


@pytest.mark.parametrize("level", LEVELS)
def test_a_turntable_catches_what_is_put_on_it(level: str) -> None:
    """At rest; it slides a little, sticks, and from then on stays in its place to rounding."""
    for seed in range(8):
        random = np.random.default_rng(seed)
        radius, friction = random.uniform(0.5, 3), random.uniform(0.3, 1)
        omega = np.sqrt(random.uniform(0.05, 0.5) * friction * GRAVITY / radius)
        world = perp.World(accuracy=level, friction=friction)
        table = world.add_body(kind="kinematic", angular_velocity=(0, 0, omega))
        table.add_box((9, 9, 0.5), offset=(0, 0, -0.5))
        box = world.add_body(1, position=(radius, 0, 0.1))
        box.add_box((0.3, 0.3, 0.1))
        radii = []
        for _ in range(200):
            world.step(0.01)
            radii.append(np.hypot(*box.position[:2]))
        assert abs(radii[-1] - radii[100]) < 1e-12 * radius, seed

@pytest.mark.parametrize("kind", ["fixed", "revolute", "ball", "prismatic", "distance"])
@pytest.mark.parametrize("level", LEVELS)
def test_joined_boxes_ride_on_turntables(level: str, kind: str) -> None:
    """Two in a row, on a table that is two bodies of one turn: they stay in place to rounding."""
    for seed in range(6):
        random = np.random.default_rng(seed)
        friction, radius = random.uniform(0.3, 1), random.uniform(0.5, 2)
        omega = np.sqrt(random.uniform(0.1, 0.6) * friction * GRAVITY / (radius + 0.7))
        world = perp.World(accuracy=level, friction=friction)
        for side in (-1, 1):
            table = world.add_body(kind="kinematic", angular_velocity=(0, 0, omega))
            table.add_box((2.5, 5, 0.5), offset=(2.5 * side, 0, -0.5))
        bodies, spin = [], (0, 0, omega)
        for x in (0.0, 0.65):
            place = np.array([x, radius, 0.1])
            mass, v = 10 ** random.uniform(-1, 1), np.cross(spin, place)
            body = world.add_body(mass, position=place, velocity=v, angular_velocity=spin)
            body.add_box((0.3, 0.3, 0.1))
            bodies.append(body)
        ends = np.array([0.3, radius, 0.1]), np.array([0.35, radius, 0.1])
        far = {"anchor_b": ends[1]} if kind == "distance" else {}
        world.add_joint(kind, *bodies, anchor=ends[0], **far)
        first = [np.hypot(*body.position[:2]) for body in bodies]
        for _ in range(60):
            world.step(0.01)
        for body, r in zip(bodies, first):
            assert abs(np.hypot(*body.position[:2]) - r) < 1e-12 * r, seed

@pytest.mark.parametrize("level", LEVELS)
def test_what_nothing_holds_goes_straight_over_a_turntable(level: str) -> None:
    """Without friction: it begins with the velocity of the table, and keeps it."""
    for seed in range(6):
        random = np.random.default_rng(seed)
        omega, place = random.uniform(-3, 3), np.append(random.uniform(-2, 2, 2), 0)
        v = np.cross((0, 0, omega), place)
        world = perp.World(accuracy=level, friction=0)
        table = world.add_body(kind="kinematic", angular_velocity=(0, 0, omega))
        table.add_box((20, 20, 0.5), offset=(0, 0, -0.5))
        start = place + (0, 0, 0.1)
        box = world.add_body(1, position=start, velocity=v, angular_velocity=(0, 0, omega))
        box.add_box((0.3, 0.3, 0.1))
        for _ in range(50):
            world.step(0.01)
        assert np.abs(box.velocity - v).max() <= 1e-15 * np.abs(v).max()
        # fifty steps that round once
        assert np.abs(box.position - start - 0.5 * v).max() < 50 * 2e-16 * 10

@pytest.mark.parametrize("level", LEVELS)
def test_weights_hang_from_a_beam_that_moves(level: str) -> None:
    """On upright rods and on rods below these, from a beam turned about the vertical: rows have
    entries of 1e-17 where exact ones have zeros. All go with the beam to the last bit."""
    for seed in range(12):
        random = np.random.default_rng(seed)
        heading, v = random.uniform(0, 2 * np.pi), random.uniform(-0.7, 0.7, 3) * (seed % 3 > 0)
        q = np.array([np.cos(heading / 2), 0, 0, np.sin(heading / 2)])
        R = turning(q)
        world = perp.World(accuracy=level)
        beam = world.add_body(kind="kinematic", orientation=q, velocity=v)
        hung = []
        for k in range(int(random.integers(1, 5))):
            above, z = beam, 0.0
            for _ in range(int(random.integers(1, 4))):
                top, length = z, random.uniform(0.1, 1)
                z -= length
                mass, place = 10 ** random.uniform(-1, 1), R @ (0.7 * k, 0.2, z)
                ball = world.add_body(mass, position=place, orientation=q, velocity=v)
                ball.add_sphere(0.02)
                anchor = R @ (0.7 * k, 0.2, top)
                world.add_joint("distance", above, ball, anchor=anchor, anchor_b=place)
                hung.append(ball)
                above = ball
        for _ in range(10):
            world.step(0.01)
        assert all((ball.velocity == v).all() for ball in hung), seed
        assert not world.angular_velocities.any(), seed


@pytest.mark.parametrize("kind", ("ball", "revolute", "prismatic", "cylindrical", "planar",
                                  "screw", "distance"))
@pytest.mark.parametrize("level", LEVELS)
def test_flush_bodies_with_a_joint_turn_as_one(kind: str, level: str) -> None:
    """Two cubes, flush, of any masses, that may touch beside their joint, in one rigid turn and
    without forces. Their contacts and the joint say the same, and a step of any length keeps energy
    and angular momentum up to the error of a step of second order, a few (|w| h)^3, and tol."""
    for seed in range(6):
        random = np.random.default_rng(seed)
        spin, h = random.standard_normal(3), (1e-2, 1e-3, 1e-5)[seed % 3]
        off = 0.2 * (seed % 2) if kind == "ball" else 0.0
        world = perp.World((0, 0, 0), accuracy=level, friction=0.5)
        bodies = []
        for place in ((0, 0, 0), (0.4, 0, 0)):
            body = world.add_body(10 ** random.uniform(-1, 1), position=place,
                                  velocity=np.cross(spin, place), angular_velocity=spin)
            body.add_box((0.2, 0.2, 0.2))
            bodies.append(body)
        options = {"anchor": (0.2, 0, off)}
        if kind == "distance":
            options = {"anchor": (0, 0, 0), "anchor_b": (0.4, 0, 0)}
        elif kind != "ball":
            options["axis"] = (1, 0, 0) if kind == "planar" else (0, 0, 1)
        world.add_joint(kind, *bodies, collides=True, **options)
        energy, momentum = world.energy().total, world.momentum().angular
        world.step(h)
        change = world.momentum().angular - momentum
        error = 4 * (np.linalg.norm(spin) * h) ** 3 + 1e-10
        assert np.abs(change).max() <= error * np.linalg.norm(momentum), (seed, kind)
        assert -1e-12 <= 1 - world.energy().total / energy <= error, (seed, kind)
