"""Motions with a known course, through the whole of Python's surface.

Velocities that change at a constant rate are exact at the end of each step, and what touches moves
by the mean of both ends: exact until a slip stops or turns within a step, which costs a h^2 / 8 at
most (the triangle of that step beside its trapezium). Impacts take place where they are. Forces are
given at the end of each step: that is off by O(h).
"""

import math

import numpy as np
import pytest

import perp

G = 9.81

# Every step solves its contact problem to 1e-10 of the step's velocities, and its final active set
# once more to rounding: what remains over a few thousand steps is a sum of rounding errors.
ROUNDING = 1e-11


# --- a mass on a slope of 10 degrees, mu = 0.3 ----------------------------------------------------

SLOPE = math.radians(10)
PULL = G * math.sin(SLOPE)  # 1.7034886229125867
GRIP = 0.3 * G * math.cos(SLOPE)  # 2.8982892171149283, the most that friction can do


def ramp(velocity, mu=0.3, shape="point"):
    """A unit mass on a slope: x points down it. The point can't turn; the box does not."""
    world = perp.World(gravity=[PULL, -G * math.cos(SLOPE)], planar=True)
    world.ground.add_plane([0, 1], friction=mu)
    height = 0.0 if shape == "point" else 0.01
    mass = world.add_body(1.0, 1.0, position=[0, height], velocity=[velocity, 0])
    if shape == "point":
        mass.add_sphere(0.0, friction=mu)
    else:
        mass.add_box([1.0, height], friction=mu)
    return world, mass


def slide(world, mass, h, seconds, force=lambda t: 0.0):
    """Steps with the force at the end of each step; returns times, positions and velocities."""
    t, x, v = [0.0], [mass.position[0]], [mass.velocity[0]]
    for step in range(1, round(seconds / h) + 1):
        mass.force = [force(step * h), 0.0]
        result = world.step(h)
        assert result.ok, result
        t.append(step * h)
        x.append(mass.position[0])
        v.append(mass.velocity[0])
        assert mass.position[1] >= -1e-12  # stays on the slope
    return np.array(t), np.array(x), np.array(v)


@pytest.mark.parametrize("shape", ["point", "box"])
@pytest.mark.parametrize(
    "h, distance, first_zero",
    [
        (0.1, 1.6750711918848154, 17),
        (0.01, 1.6739337264529552, 168),
        (0.001, 1.6739195331378669, 1674),
    ],
)
def test_ramp_stops_and_sticks(shape, h, distance, first_zero):
    """R1: the discrete motion to the last digits, and at rest to the last bit."""
    world, mass = ramp(2.0, shape=shape)
    _, x, v = slide(world, mass, h, 2.0)
    assert np.flatnonzero(v == 0.0)[0] == first_zero
    assert np.all(v[first_zero:] == 0.0)
    assert np.all(x[first_zero:] == x[first_zero])
    assert x[-1] == pytest.approx(distance, abs=ROUNDING)
    # the continuous motion needs t = x = 1.6739194889128892
    assert abs(first_zero * h - 1.6739194889128892) <= h
    assert abs(x[-1] - 1.6739194889128892) <= (GRIP - PULL) * h**2 / 8 + ROUNDING
    # friction balances the pull of gravity
    touching = [contact for contact in world.contacts if contact.gap <= 1e-12]
    along = sum(
        contact.impulse @ np.vstack([contact.normal, contact.tangents]) * direction(contact, mass)
        for contact in touching
    )
    np.testing.assert_allclose(along / h, [-PULL, G * math.cos(SLOPE)], rtol=1e-9)
    assert {contact.mode for contact in touching} == {"stick"}


def direction(contact, body):
    """The impulse of a contact is the one on its body b."""
    return 1.0 if contact.body_b == body else -1.0


def test_ramp_with_a_pull_stops_later():
    """R2: F = 1; t = x = 10.2669 in the limit; the sum of trapezia to rounding."""
    h, a = 0.01, GRIP - PULL - 1.0
    world, mass = ramp(2.0)
    _, x, v = slide(world, mass, h, 10.5, lambda t: 1.0)
    steps = np.arange(1, len(x))
    speeds = np.maximum(0.0, 2.0 - steps * h * a)
    assert x[-1] == pytest.approx(h * (1.0 + speeds.sum()), abs=ROUNDING)
    stop = np.flatnonzero(v == 0.0)[0]
    assert abs(stop * h - 10.266909134386814) <= h
    assert abs(x[-1] - 10.266909134386814) <= a * h**2 / 8 + ROUNDING


def test_ramp_with_a_strong_pull_never_stops():
    """R3: F = 3; the velocity grows at a constant rate, so backward Euler is exact."""
    world, mass = ramp(2.0)
    _, _, v = slide(world, mass, 0.01, 1.0, lambda t: 3.0)
    assert v[-1] == pytest.approx(3.8051994057976584, abs=ROUNDING)
    assert all(contact.mode == "slip" for contact in world.contacts)


def test_ramp_upwards_stops_and_sticks():
    """R4: v0 = -2 against gravity and friction."""
    h = 0.001
    world, mass = ramp(-2.0)
    _, x, v = slide(world, mass, h, 0.6)
    stop = np.flatnonzero(v == 0.0)[0]
    assert abs(stop * h - 0.43461463580520036) <= h
    assert np.all(v[stop:] == 0.0)
    assert abs(x[-1] + 0.43461463580520036) <= (GRIP + PULL) * h**2 / 8 + ROUNDING


def test_slippery_ramp_reverses():
    """R5: mu = 0.1 can't hold it; the turn may come a step late, at accelerations of up to
    PULL + GRIP / 3."""
    h = 0.001
    world, mass = ramp(-2.0, mu=0.1)
    t, _, v = slide(world, mass, h, 1.0)
    turn = t[np.flatnonzero(v >= 0.0)[0]]
    assert abs(turn - 0.7491801079794392) <= h
    assert abs(v[-1] - 0.18495263629681481) <= h * (PULL + GRIP / 3)


def test_ramp_breaks_away():
    """R6: F = t from rest; it does not move at all before."""
    h = 0.001
    world, mass = ramp(0.0)
    t, x, v = slide(world, mass, h, 3.0, lambda t: t)
    breakaway = 1.1948005942023416
    assert np.all(v[t < breakaway - h] == 0.0) and np.all(x[t < breakaway - h] == 0.0)
    assert v[t > breakaway + h].min() > 0.0
    # the force at the end of a step instead of its mean: h/2 too much, for 1.8 seconds
    assert abs(v[-1] - 1.6293724473461095) <= h * 1.9
    assert abs(x[-1] - 0.98044739125742443) <= h * 1.9**2


def test_ramp_creeps_under_a_periodic_pull():
    """R7: F = 2 sin 2t: slips a little further in each cycle of pi, and sticks in between."""
    h = math.pi / 3000
    world, mass = ramp(0.0)
    t, x, v = slide(world, mass, h, 2 * math.pi, lambda t: 2.0 * math.sin(2.0 * t))
    second = slice(3000, 6001)
    slips = t[second][v[second] > 0.0] - math.pi
    assert abs(slips[0] - 0.3201277124458444) <= 2 * h
    assert abs(slips[-1] - 1.7655745784222461) <= 2 * h
    assert np.all(v >= 0.0)
    # rates of change are at most 4: an error of h in time is one of 4 h in velocity, over 1.45 s
    assert abs(v.max() - 0.49207556375628177) <= 4 * h
    assert abs(x[6000] - x[3000] - 0.39959713267556855) <= 6 * h
    assert abs(x[6000] - 2 * 0.39959713267556855) <= 12 * h


# --- a ball that bounces to rest ------------------------------------------------------------------


@pytest.mark.parametrize(
    "e, end", [(0.5, 1.3545709229571927), (0.8, 4.0637127688715781), (0.9, 8.578949178728886)]
)
def test_ball_comes_to_rest_after_its_last_bounce(e, end):
    """Dropped from h = 1 it bounces infinitely often in a finite time; a step makes at most 32 of
    these bounces, where they are, and an approach of less than G h / 64 is none. What that leaves
    out is below half a step; at the end the ball rests, to the last bit."""
    h = 0.01
    world = perp.World(planar=True)
    world.ground.add_plane([0, 1], restitution=e)
    ball = world.add_body(position=[0, 1.0])
    ball.add_sphere(0.0)
    y, v = [1.0], [0.0]
    world.run(end + 0.1, h, lambda w: y.append(ball.position[1]) or v.append(ball.velocity[1]))
    y, v, t = np.array(y), np.array(v), h * np.arange(len(y))
    # between bounces y and v are those of the parabola through the first impact and the next
    fall = math.sqrt(2 / G)
    bounces = fall * (1 + 2 * np.concatenate([[0], np.cumsum(e ** np.arange(1, 6))]))
    assert np.all(np.diff(bounces) > h)
    for k in range(5):
        during = (t > bounces[k]) & (t < bounces[k + 1])
        since = t[during] - bounces[k]
        speed = G * fall * e ** (k + 1)
        np.testing.assert_allclose(y[during], speed * since - G / 2 * since**2, atol=ROUNDING)
        np.testing.assert_allclose(v[during], speed - G * since, atol=ROUNDING)
    moving = np.flatnonzero(v != 0.0)[-1] + 1
    assert abs(moving * h - end) <= 3 * h
    assert np.all(v[moving:] == 0.0) and np.all(y[moving:] == y[moving])
    assert abs(y[-1]) <= ROUNDING
    assert world.energy().kinetic == 0.0


# --- from sliding to rolling ----------------------------------------------------------------------


def roller(kappa, velocity, spin=0.0, mu=0.2, slope=0.0):
    """A planar body of radius 1/2 and inertia kappa m r^2; spin is that of rolling forwards."""
    world = perp.World(gravity=[G * math.sin(slope), -G * math.cos(slope)], planar=True)
    world.ground.add_plane([0, 1], friction=mu)
    body = world.add_body(
        2.0, kappa * 2.0 * 0.25, [0, 0.5], velocity=[velocity, 0], angular_velocity=-spin / 0.5
    )
    body.add_sphere(0.5, friction=mu)
    return world, body


@pytest.mark.parametrize(
    "kappa, share, time, distance",
    [
        (2 / 5, 5 / 7, 1.0193679918450561, 6.1162079510703364),
        (1 / 2, 2 / 3, 1.1892626571525654, 6.9373655000566316),
        (1.0, 1 / 2, 1.7838939857288481, 9.3654434250764526),
    ],
)
def test_slide_to_roll(kappa, share, time, distance):
    """Friction takes from m v what it gives to I omega / r, so the final velocity is exact."""
    h = 0.001
    world, body = roller(kappa, 7.0)
    rolling = []

    def note(world):
        (contact,) = world.contacts
        assert contact.mode in ("slip", "stick")
        if contact.mode == "stick" and not rolling:
            rolling.append((world.stats().steps * h, body.position[0]))
        assert not rolling or contact.mode == "stick"

    result = world.run(2.0, h, note)
    assert result.ok
    assert body.velocity[0] == pytest.approx(7 * share, rel=ROUNDING)
    assert body.angular_velocity == pytest.approx(-7 * share / 0.5, rel=ROUNDING)
    (when, where), *_ = rolling
    assert abs(when - time) <= h
    # a velocity that is off by at most mu G h, and a step more or less at up to 7 / s
    assert abs(where - distance) <= h * 7.0 + 0.2 * G * h * time


def test_backspin():
    """r omega = -20 against v = 7: it comes back, at -5/7."""
    world, body = roller(2 / 5, 7.0, spin=-20.0)
    world.run(12.0, 0.01)
    assert body.velocity[0] == pytest.approx(-5 / 7, rel=ROUNDING)


def test_rolling_down_a_slope():
    """30 degrees: a ball rolls iff mu >= (2/7) tan 30 = 0.16496, and then a = 5/7 g sin 30."""
    for mu, mode in ((0.1650, "stick"), (0.1649, "slip")):
        world, body = roller(2 / 5, 0.0, mu=mu, slope=math.radians(30))
        world.run(1.0, 0.01)
        (contact,) = world.contacts
        assert contact.mode == mode
    world, body = roller(2 / 5, 0.0, mu=0.3, slope=math.radians(30))
    world.run(1.0, 0.01)
    assert body.velocity[0] == pytest.approx(3.5035714285714286, rel=ROUNDING)


@pytest.mark.parametrize("cone", ["exact", 16])
def test_ball_in_space_slides_to_roll(cone):
    """The same in three dimensions, along and across the friction cone's edges: the cone's shape
    changes when it rolls, not how fast; the exact cone changes neither."""
    for heading in (0.0, 0.3):
        along = np.array([math.cos(heading), math.sin(heading), 0.0])
        world = perp.World(cone=cone)
        world.ground.add_plane([0, 0, 1], friction=0.2)
        ball = world.add_body(1.0, 0.4 * 0.25, [0, 0, 0.5], velocity=7 * along)
        ball.add_sphere(0.5, friction=0.2)
        world.run(1.5, 0.002)
        assert world.contacts[0].mode == "stick"
        # momentum about a point of the ground: 7/5 v = 7 at the end, whatever the path
        np.testing.assert_allclose(ball.velocity, 5 * along, atol=7 * ROUNDING)
        np.testing.assert_allclose(
            ball.angular_velocity, np.cross([0, 0, 1], 5 * along) / 0.5, atol=20 * ROUNDING
        )
        if cone == "exact":
            np.testing.assert_allclose(
                np.cross(ball.position - [0, 0, 0.5], along), 0, atol=7 * ROUNDING
            )


# --- Painlevé's rod -------------------------------------------------------------------------------


@pytest.mark.parametrize("h", [1e-2, 1e-4, 1e-6])
def test_painleve_rod(h):
    """A rod that slides on its tip where no acceleration satisfies Coulomb's law: the step has one
    solution, and tends to the impact without collision, (-3/5, 3/10, 0.67082...), linearly in h:
    the weight's part of the free velocity shrinks the impact by G h / 2."""
    theta = math.atan(2.0)
    world = perp.World(planar=True)
    world.ground.add_plane([0, 1], friction=2.0)
    rod = world.add_body(1.0, 1 / 3, [math.cos(theta), math.sin(theta)], theta, velocity=[-1, 0])
    rod.add_sphere(0.0, friction=2.0, offset=[-1, 0])
    result = world.step(h)
    assert result.ok
    limit = np.array([-0.6, 0.3, 0.6708203932499369])
    after = np.append(rod.velocity, rod.angular_velocity)
    # the gap is rounding, up to 2e-16, and enters as gap / h
    np.testing.assert_allclose(after, limit * (1 - G * h / 2), rtol=0, atol=1e-12 + 1e-15 / h)
    (contact,) = world.contacts
    assert contact.mode == "stick"
    np.testing.assert_array_equal(contact.velocity, [0, 0])
    # what the momentum of the rod has changed by: 0.3 and 0.4 in the limit, F / N = 4/3 < mu
    normal, tangential = contact.impulse
    assert normal == pytest.approx(0.3 + 0.85 * G * h, abs=1e-12 + 1e-15 / h)
    assert abs(tangential) == pytest.approx(0.4 + 0.3 * G * h, abs=1e-12 + 1e-15 / h)
    if h == 1e-2:
        np.testing.assert_allclose(after, [-0.57057, 0.285285, 0.637916652961], atol=1e-12)


# --- a chain of balls -----------------------------------------------------------------------------


@pytest.mark.parametrize(
    "n, e, after",
    [
        (3, 1.0, [-1 / 3, 2 / 3, 2 / 3]),
        (3, 0.5, [0, 1 / 2, 1 / 2]),
        (5, 1.0, [-3 / 5, 2 / 5, 2 / 5, 2 / 5, 2 / 5]),
    ],
)
def test_chain_of_touching_balls(n, e, after):
    """All at once, by Moreau's law: v1 = (1 + e)/n - e, the others (1 + e)/n."""
    world = perp.World(gravity=[0, 0], planar=True)
    balls = []
    for index in range(n):
        ball = world.add_body(1.0, position=[index, 0], velocity=[float(index == 0), 0])
        ball.add_sphere(0.5, restitution=e)
        balls.append(ball)
    assert world.step(0.001).ok
    np.testing.assert_allclose([ball.velocity[0] for ball in balls], after, atol=ROUNDING)
    assert world.momentum().linear[0] == pytest.approx(1.0, rel=ROUNDING)
    if e == 1.0:
        assert world.energy().kinetic == pytest.approx(0.5, rel=ROUNDING)
