"""Bodies that tumble beside others without touching them are free: nothing changes what they have."""

from __future__ import annotations

import numpy as np
import perp
import pytest

from scene import matrix, unit

LEVELS = ("fast", "standard", "accurate", "exact")


def spin_of(body: perp.Body) -> np.ndarray:
    turn = matrix(body.orientation)
    return turn @ body.inertia @ turn.T @ body.angular_velocity


@pytest.mark.parametrize("kind", ("static", "kinematic", "dynamic"))
@pytest.mark.parametrize("level", LEVELS)
def test_what_touches_nothing_keeps_its_angular_momentum(level: str, kind: str) -> None:
    """To rounding, in steps of up to .3 radians, though corners come near enough for contacts that
    bear nothing. It lost up to 2 % in such a step."""
    near = 0
    for seed in range(12):
        g = np.random.default_rng(seed)
        world = perp.World((0, 0, 0), accuracy=level)  # type: ignore[arg-type]
        along = (0, 0, 0) if kind == "static" else g.normal(size=3)
        other = world.add_body(kind=kind, velocity=along)  # type: ignore[arg-type]
        other.add_box((5, 5, 0.5))
        half = g.uniform(0.05, 0.4, 3)
        q = g.normal(size=4)
        clear = np.linalg.norm(half) * (1 + 10 ** g.uniform(-3, -1))
        body = world.add_body(1, position=(0, 0, 0.5 + clear), velocity=along,
                              orientation=q / np.linalg.norm(q), angular_velocity=5 * g.normal(size=3))
        body.add_box(half)
        spin = spin_of(body)
        for _ in range(60):
            near += world.step(1 / 60).contacts
            assert np.abs(spin_of(body) - spin).max() < 1e-12 * np.linalg.norm(spin), seed
            assert np.abs(body.velocity - along).max() < 1e-14, seed
    assert near > 100  # steps with contacts are many


@pytest.mark.parametrize("level", LEVELS)
def test_a_torque_turns_what_touches_nothing_as_if_alone(level: str) -> None:
    """The same bits as without a slab beside it, in steps of up to two radians. The work of the torque
    was not that along the body's way, and half of the bodies lost what seemed too much."""
    near = 0
    for seed in range(60):
        g = np.random.default_rng(seed)
        half, q = g.uniform(0.05, 0.4, 3), unit(g, 4)
        clear = np.linalg.norm(half) * (1 + 10 ** g.uniform(-3, -1))
        spin, torque = unit(g) * 10 ** g.uniform(-1, 1.5), unit(g) * 10 ** g.uniform(0, 4)
        ends = []
        for slab in (False, True):
            world = perp.World((0, 0, 0), accuracy=level)  # type: ignore[arg-type]
            body = world.add_body(1, position=(0, 0, 0.5 + clear), orientation=q,
                                  angular_velocity=spin)
            body.add_box(half)
            body.torque = torque * body.inertia.max()
            if slab:
                world.ground.add_box((5, 5, 0.5))
            for _ in range(3):
                near += world.step(0.003).contacts
            ends.append((*body.position, *body.orientation, *body.velocity, *body.angular_velocity))
        assert ends[0] == ends[1], seed
    assert near > 30


@pytest.mark.parametrize("wall", ("box", "plane", "hulls"))
@pytest.mark.parametrize("floor", (False, True))
@pytest.mark.parametrize("level", LEVELS)
def test_a_rotor_turns_between_walls(level: str, floor: bool, wall: str) -> None:
    """A rod that spins about its middle, by up to half a radian a step, and clears walls on all sides
    by 1e-4 to .03 of its length keeps its rate for ever, to the rounding of its steps, in the air and
    on ice. The rate of an end that goes towards a wall was taken for its way, and stopped it: 24 of 25
    were hit."""
    for seed in range(12):
        g = np.random.default_rng(seed)
        turn, h = g.uniform(0.02, 0.5), 1 / g.choice((60, 240))
        long = g.uniform(0.2, 1)
        clear = np.hypot(long, 0.1 * long) + 10 ** g.uniform(-4, -1.5) * long
        world = perp.World((0, 0, -9.81 * floor), accuracy=level)  # type: ignore[arg-type]
        if floor:
            world.ground.add_box((3, 3, 0.1), offset=(0, 0, -0.1 * long - 0.1))
        for axis in range(2):
            for side in (-1, 1):
                normal = np.zeros(3)
                normal[axis] = side
                if wall == "plane":
                    world.ground.add_plane(normal, -clear)
                else:
                    half = np.full(3, 3.0)
                    half[axis] = 0.1
                    world.ground.add_box(half, offset=-(clear + 0.1) * normal)
        rod = world.add_body(1, angular_velocity=(0, 0, turn / h))
        half = long * np.array((1, 0.1, 0.1))
        if wall == "hulls":
            rod.add_hull([half * (x, y, z) for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
        else:
            rod.add_box(half)
        for step in range(100):
            world.step(h)
            off = abs(rod.angular_velocity[2] * h / turn - 1)
            assert off < 1e-12 and np.abs(rod.velocity).max() < 1e-12, (seed, step, off)


@pytest.mark.parametrize("laws", ("limits", "friction", "motors"))
@pytest.mark.parametrize("level", LEVELS)
def test_trees_tumble_by_the_laws_of_their_joints(level: str, laws: str) -> None:
    """Links on hinges with limits, dry friction and motors as well, which nothing touches: momentum
    stays, energy never grows but by motors, no limit is passed, and what goes on in its way has all
    the friction, or force, there is. Each step takes a solution a round of the joints' places, as
    many as the level and limits that come ask for; it took up to some hundred iterations of the
    contact layer's methods."""
    hits, slides, h = 0, 0, 0.005
    for seed in range(4):
        g = np.random.default_rng(seed)
        world = perp.World((0, 0, 0), accuracy=level)  # type: ignore[arg-type]
        for k in range(8):
            inertia = 10 ** g.uniform(-2, -1, 3)
            inertia += inertia.max()
            arm = g.normal(size=3) * 0.3
            if k == 0:
                world.add_body(1, inertia=inertia, angular_velocity=g.normal(size=3))
                continue
            parent = world.bodies[g.integers(k)]
            anchor = parent.position + g.normal(size=3) * 0.3
            link = world.add_body(10 ** g.uniform(-1, 0.5), inertia=inertia, position=anchor + arm,
                                  velocity=g.normal(size=3), angular_velocity=3 * g.normal(size=3))
            low, high = -g.uniform(0, 0.5), g.uniform(0, 0.5)
            axis, u = g.normal(size=3), g.uniform(size=3)
            world.add_joint("revolute", parent, link, anchor=anchor, axis=axis, lower=low, upper=high,
                            friction=(laws != "limits") * 10 ** (-2 + 2 * u[0]),
                            motor_speed=(laws == "motors") * 6 * (u[1] - 0.5),
                            motor_force=(laws == "motors") * 10 ** (-2 + 2 * u[2]))
        linear = np.array(world.momentum().linear)
        world.step(h)
        energy = first = sum(world.energy())
        for _ in range(150):
            result = world.step(h)
            assert result.outcome == "solved" and result.iterations < 12, seed
            assert np.abs(world.momentum().linear - linear).max() < 1e-12, seed
            assert laws == "motors" or sum(world.energy()) <= energy + 1e-12 * first, seed
            energy = sum(world.energy())
            for joint in world.joints:
                low, high = joint.limits
                assert low - 1e-11 <= joint.position <= high + 1e-11, seed
                hits += joint.at_limit != 0
                if joint.at_limit == 0 and abs(joint.speed) > 1 and joint.friction > 0:
                    slides += 1
                    assert joint.reaction.friction == pytest.approx(
                        -np.sign(joint.speed) * h * joint.friction, rel=1e-12), seed
    assert hits > (400 if laws == "limits" else 40) and (slides > 40 or laws == "limits")
