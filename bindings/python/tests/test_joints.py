"""perp.World.add_joint: what goes in comes out, and what moves moves as it should."""

import math

import numpy as np
import pytest

import perp

G = 9.81


@pytest.fixture
def world():
    return perp.World()


def test_hinge(world):
    body = world.add_body(1.0, 0.1, position=[1, 0, 0])
    joint = world.add_joint("revolute", world.ground, body, anchor=[0, 0, 0], axis=[0, 2, 0])
    assert joint.kind == "revolute" and joint.bodies == (world.ground, body)
    assert joint.position == 0.0 and joint.speed == 0.0 and joint.friction == 0.0
    assert joint.limits == (-math.inf, math.inf) and joint.motor == (0.0, 0.0)
    assert world.joints == (joint,) and joint.world is world
    assert world.step(0.01).ok
    # the torque m g l on m l^2 + I, to second order of a first step
    assert joint.speed == pytest.approx(0.01 * G / 1.1, rel=1e-4)
    np.testing.assert_allclose(joint.anchor, [0, 0, 0], atol=1e-9)
    assert "revolute" in repr(joint)


def test_reaction(world):
    body = world.add_body(2.0, 0.1, position=[0.5, 0, 0])
    joint = world.add_joint("fixed", world.ground, body, anchor=[0, 0, 0])
    assert world.step(0.01).ok
    assert not body.velocity.any() and not body.angular_velocity.any()
    np.testing.assert_allclose(joint.reaction.impulse, [0, 0, 2 * G * 0.01], atol=1e-10)
    np.testing.assert_allclose(joint.reaction.moment, [0, -0.5 * 2 * G * 0.01, 0], atol=1e-10)
    assert world.stats().joints == 1 and world.stats().rows_joint == 6


def test_rows_only_for_what_is_there(world):
    body = world.add_body(1.0, 0.1)
    joint = world.add_joint("prismatic", world.ground, body, axis=[1, 0, 0], lower=-1, upper=1)
    assert world.step(0.01).ok and world.stats().rows_joint == 5
    joint.limits = 0, 1
    assert world.step(0.01).ok and world.stats().rows_joint == 6
    joint.limits = -1, 1
    joint.motor = 2.0, 3.0
    assert world.step(0.01).ok and world.stats().rows_joint == 6
    assert joint.speed == pytest.approx(0.03, rel=1e-12)
    assert joint.reaction.motor == pytest.approx(0.03, rel=1e-12)
    joint.friction = 1.0
    assert joint.motor == (2.0, 3.0) and joint.friction == 1.0 and joint.limits == (-1.0, 1.0)
    assert world.step(0.01).ok and world.stats().rows_joint == 7
    assert joint.speed == pytest.approx(0.05, rel=1e-12)
    assert joint.reaction.friction == pytest.approx(-0.01, rel=1e-12)


def test_stop(world):
    body = world.add_body(1.0, 0.1)
    joint = world.add_joint("prismatic", world.ground, body, axis=[0, 0, -1], upper=0.5)
    world.run(1.0, 0.01)
    assert joint.position == pytest.approx(0.5, abs=1e-12) and joint.speed == 0.0
    assert joint.at_limit == 1
    assert joint.reaction.limit == pytest.approx(-G * 0.01, rel=1e-9)


def test_planar():
    world = perp.World(planar=True)
    body = world.add_body(1.0, 0.1, position=[0, -1])
    joint = world.add_joint("revolute", world.ground, body, anchor=[0, 0])
    world.run(1.0, 0.01)
    assert not body.velocity.any() and body.angular_velocity == 0.0
    np.testing.assert_array_equal(body.position, [0, -1])
    assert isinstance(joint.reaction.moment, float) and joint.reaction.impulse.shape == (2,)
    slider = world.add_body(1.0, 0.1, position=[2, 0])
    rail = world.add_joint("prismatic", world.ground, slider)  # along x
    slider.force = [3, 0]
    world.run(1.0, 0.01)
    assert rail.position == pytest.approx(1.5, rel=1e-12)
    with pytest.raises(perp.Error, match="planar world"):
        world.add_joint("screw", world.ground, slider)


def test_distance(world):
    a = world.add_body(1.0, 0.1, position=[0, 0, 0])
    b = world.add_body(1.0, 0.1, position=[3, 0, 4])
    rod = world.add_joint("distance", a, b)
    assert rod.position == 5.0 and rod.limits == (5.0, 5.0)
    a.velocity = [1, 0, 0]
    world.run(1.0, 0.01)
    assert rod.position == pytest.approx(5.0, abs=1e-11)


def test_removal(world):
    a = world.add_body(1.0, 0.1)
    b = world.add_body(1.0, 0.1, position=[1, 0, 0])
    c = world.add_body(1.0, 0.1, position=[2, 0, 0])
    first = world.add_joint("ball", a, b)
    second = world.add_joint("ball", b, c)
    third = world.add_joint("ball", world.ground, c)
    first.remove()
    assert world.joints == (second, third)
    with pytest.raises(perp.Error, match="removed"):
        _ = first.position
    assert "removed" in repr(first)
    b.remove()
    assert world.joints == (third,)
    with pytest.raises(perp.Error, match="removed"):
        _ = second.bodies


def test_snapshot(world):
    body = world.add_body(1.0, (0.1, 0.2, 0.3), position=[1, 0, 0], angular_velocity=[1, 2, 0])
    joint = world.add_joint("ball", world.ground, body, anchor=[0, 0, 0])
    world.run(0.1, 0.01)
    before = world.snapshot()
    world.run(0.1, 0.01)
    position, impulse = body.position, joint.reaction.impulse
    world.restore(before)
    world.run(0.1, 0.01)
    np.testing.assert_array_equal(body.position, position)
    np.testing.assert_array_equal(joint.reaction.impulse, impulse)


def test_refusals(world):
    other = perp.World()
    body = world.add_body(1.0, 0.1)
    with pytest.raises(ValueError, match="kind"):
        world.add_joint("hinge", world.ground, body)
    with pytest.raises(ValueError, match="a body of this world"):
        world.add_joint("ball", other.ground, body)
    with pytest.raises(ValueError, match="same body"):
        world.add_joint("ball", body, body)
    with pytest.raises(ValueError, match="anchor_b"):
        world.add_joint("ball", world.ground, body, anchor_b=[0, 0, 0])
    with pytest.raises(ValueError, match="lower is 1 and upper is 0"):
        world.add_joint("revolute", world.ground, body, lower=1, upper=0)
    with pytest.raises(ValueError, match="axis is 0"):
        world.add_joint("revolute", world.ground, body, axis=[0, 0, 0])
    assert world.joints == ()


def limited_chains(seed, accuracy):
    """Three chains of five capsules on hinges with limits, thrown at the ground."""
    rng = np.random.default_rng(seed)
    world = perp.World(friction=0.5, accuracy=accuracy)
    world.ground.add_plane((0, 0, 1))
    joints = []
    for chain in range(3):
        at, last = np.array((1.2 * chain, 0.0, rng.uniform(1.0, 2.0))), None
        for _ in range(5):
            body = world.add_body(
                mass=rng.uniform(0.2, 3.0),
                inertia=np.full(3, rng.uniform(0.005, 0.02)),
                position=at,
                velocity=rng.normal(size=3) * (3.0, 3.0, 5.0),
            )
            body.add_capsule(0.06, 0.12)
            if last is not None:
                joints.append(world.add_joint(
                    "revolute", last, body, anchor=at - (0.17, 0, 0), axis=rng.normal(size=3),
                    lower=-rng.uniform(0.1, 0.8), upper=rng.uniform(0.1, 0.8),
                ))
            last, at = body, at + (0.34, 0, 0)
    return world, joints


@pytest.mark.parametrize("accuracy", ("fast", "standard", "accurate", "exact"))
def test_limits_hold_whatever_hits_the_ground(accuracy):
    """No step ends beyond a limit, by more than what equations may lack (1e-12 of a radian a joint,
    times the few joints whose errors one island adds up)."""
    for seed in range(3):
        world, joints = limited_chains(seed, accuracy)
        for step in range(100):
            world.step(0.01)
            for joint in joints:
                lower, upper = joint.limits
                beyond = max(lower - joint.position, joint.position - upper)
                assert beyond <= 1e-11, f"seed {seed}, step {step}, {joint}: {beyond}"


@pytest.mark.parametrize("accuracy", ("fast", "standard", "accurate", "exact"))
def test_a_motor_in_a_weld_gives_no_energy(accuracy):
    """Two bodies in free flight, fixed to each other, with a distance joint that says the same and a
    hinge whose motor pushes in vain: their kinetic energy is what it was (1e-6: ten thousand steps'
    rounding of rows that say the same)."""
    for seed in range(3):
        rng = np.random.default_rng(seed)
        world = perp.World(gravity=(0, 0, 0), accuracy=accuracy)
        a = world.add_body(2.0, 0.2, velocity=rng.normal(size=3),
                           angular_velocity=rng.normal(size=3))
        b = world.add_body(1.0, 0.1, position=rng.normal(size=3), velocity=rng.normal(size=3))
        world.add_joint("fixed", a, b)
        world.add_joint("distance", a, b)
        world.add_joint("revolute", a, b, axis=rng.normal(size=3), motor_speed=-2, motor_force=3)
        world.step(0.01)  # the velocities that they begin with are not those of one body
        energy = world.energy().kinetic
        for _ in range(100):
            world.step(0.01)
            assert world.energy().kinetic <= (1 + 1e-6) * energy


def test_joined_bodies_fall_without_a_spin():
    """Two bodies on a ball joint, let go together: velocities are those of free fall, whatever the
    steps and the rounding of their turns are (1e-10: that of a hundred steps and of lever arms)."""
    for seed in range(190, 210):
        rng = np.random.default_rng(seed)
        world = perp.World(planar=True, gravity=(0, -G), accuracy="accurate")
        bodies = [
            world.add_body(rng.uniform(0.2, 5), rng.uniform(0.01, 0.1), position=rng.normal(size=2))
            for _ in range(2)
        ]
        world.add_joint("ball", *bodies, anchor=rng.normal(size=2))
        for _ in range(60):
            world.step(float(10 ** rng.uniform(-3, -1.7)))
            fall = [[0, -G * world.time]] * 2
            np.testing.assert_allclose(world.velocities, fall, rtol=0, atol=1e-10)
