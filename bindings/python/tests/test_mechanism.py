"""Mechanisms by functions, against closed forms."""

import numpy as np
import pytest

import perp

G = 9.81
RAMP = np.radians(10)
CAP = 0.3 * G * np.cos(RAMP)  # of friction on the ramp, mass 1


def ramp(**changes):
    """Problem (a), R1: the normal force is known, so is the bound of friction."""
    return perp.Mechanism(
        1, **{"force": [G * np.sin(RAMP)], "tresca": (CAP, [[1.0]]), **changes}
    )


def rod(mu, half=1.0, inertia=1 / 3, cap=0.0, tips=(-1,), mass=1.0, **changes):
    """A rod with centre (x, y) and angle; its ends, rounded with radius cap, touch the floor."""

    def contacts(q):
        s, c = np.sin(q[2]), np.cos(q[2])
        gap = [q[1] + k * half * s - cap for k in tips]
        normal = [[0, 1, k * half * c] for k in tips]
        tangent = [[1, 0, -k * half * s + cap] for k in tips]
        return gap, normal, tangent

    return perp.Mechanism(
        3, mass=[mass, mass, inertia], force=[0, -mass * G, 0], contacts=contacts, mu=mu, **changes
    )


PAINLEVE = [np.sqrt(0.2), np.sqrt(0.8), np.arctan(2)]  # the tip at the origin


def puck(**changes):
    """A mass on a floor in space."""
    return perp.Mechanism(
        3,
        force=[0, 0, -G],
        contacts=lambda q: (q[2], [0, 0, 1], [[1, 0, 0], [0, 1, 0]]),
        **{"mu": 0.5, **changes},
    )


def falling(**changes):
    """A mass above a floor, in one dimension."""
    given = dict(force=[-G], contacts=lambda q: (q, [[1.0]]))
    return perp.Mechanism(1, **{**given, **changes})


def chain(n, **changes):
    """Problem (f): balls in a row that touch."""
    gradients = np.diff(np.eye(n), axis=0)
    return perp.Mechanism(n, contacts=lambda q: (np.diff(q), gradients), **changes)


## Closed forms


def test_ramp_stops():
    """v is exactly 0 from step 17; x = h sum max(0, v0 - k h a): theory.md (a)."""
    run = ramp().simulate([0], [2], 3.0, 0.1)
    assert run.ok and run.outcome == "solved" and run.stats.steps == 30
    assert (run.v[:17] > 0).all() and (run.v[17:] == 0.0).all()
    assert (run.q[17:] == run.q[17]).all()
    # 17 sums of numbers below 2, half a unit of 2**-52 each
    assert run.q[-1] == pytest.approx(1.5750711918848154, abs=17 * 2**-52)
    assert set(run.modes[1:17, 0]) == {"slip"} and set(run.modes[17:, 0]) == {"stick"}
    np.testing.assert_allclose(run.t, np.linspace(0, 3, 31), rtol=1e-15)
    # at rest the force is -m g sin th
    assert run.impulse[-1, 0] / 0.1 == pytest.approx(-1.7034886229125867, rel=1e-14)
    assert run.q.shape == run.v.shape == run.impulse.shape == run.velocity.shape == (31, 1)


def test_ramp_by_contact():
    """The same brick on its plane, with the normal force to be found."""
    m = perp.Mechanism(
        2,
        force=[G * np.sin(RAMP), -G * np.cos(RAMP)],
        contacts=lambda q: ([q[1]], [[0, 1]], [[1, 0]]),
        mu=0.3,
    )
    run = m.simulate([0, 0], [2, 0], 3.0, 0.1)
    assert (run.v[:17, 0] > 0).all() and (run.v[17:] == 0.0).all()
    assert run.q[-1, 0] == pytest.approx(1.5750711918848154, abs=1e-14)
    assert run.impulse.shape == (31, 2) and m.rows.contacts == slice(0, 2)


@pytest.mark.parametrize("law", ["moreau", "newton", "poisson", "stronge"])
def test_chains(law):
    """Problem (f), and two balls 1:3 with e = 1/2: (-1/8, 3/8), up to the tolerance of the two
    problems of an impact."""
    for n, e in ((3, 0), (3, 0.5), (3, 1), (5, 0.5), (5, 1)):
        r = chain(n, restitution=e, law=law).step(0, np.zeros(n), np.eye(n)[0], 1e-3)
        expected = np.full(n, (1 + e) / n) - e * np.eye(n)[0]
        np.testing.assert_allclose(r.v, expected, atol=1e-10)
        assert r.ok and r.impacts == (1 if e else 0)  # one contact is hit, all have impulses
    r = chain(2, mass=[1, 3], restitution=0.5, law=law).step(0, [0, 0], [1, 0], 1e-3)
    np.testing.assert_allclose(r.v, [-1 / 8, 3 / 8], atol=1e-10)


def test_stronge_does_not_add_energy():
    """A rod at 40 degrees with e = 1, mu = 0.4, whose end slides in at 1/2 and comes down at 1. It
    stops in the compression and slides back; Stronge's law takes the work of friction along both
    ways, Newton's adds energy."""
    lean, mass = np.radians(40), np.diag([1, 1, 1 / 3])

    def contacts(q):
        s, c = np.sin(lean + q[2]), np.cos(lean + q[2])
        return [q[1] + c - np.cos(lean)], [[0, 1, -s]], [[1, 0, c]]

    def energy(law):
        m = perp.Mechanism(3, mass=mass, contacts=contacts, mu=0.4, restitution=1, law=law)
        v = m.step(0, np.zeros(3), [0.5, -1, 0], 1e-3).v
        return v @ mass @ v / 2

    s, c = np.sin(lean), np.cos(lean)
    nn, nt, tt = 1 + 3 * s * s, -3 * s * c, 1 + 3 * c * c  # mobility of the end
    stop = 0.5 / (0.4 * tt - nt)
    u = -1 + (nn - 0.4 * nt) * stop  # there
    back, again = -nt - 0.4 * tt, nn + 0.4 * nt  # rates of slip and of u_n by the impulse
    taken = -stop * (u - 1) / 2 + u * u / again / 2
    rest = (np.sqrt(2 * again * taken) - u) / again
    friction = 0.4 * (0.5 * stop / 2 + back * rest * rest / 2)
    assert energy("stronge") == pytest.approx(0.625 - friction, abs=1e-9)
    told = {"newton": 0.73967, "poisson": 0.58616, "stronge": 0.56144}  # docs/mechanism.md
    for law, value in told.items():
        assert energy(law) == pytest.approx(value, abs=5e-6)


def test_ball_comes_to_rest():
    """e = 1/2 from h = 1: at rest after 1.3545709 s (problem (c)), then exactly."""
    run = falling(restitution=0.5).simulate([1], [0], 2.0, 1e-3)
    late = run.t > 1.3545709 + 0.05  # impacts are up to a step late, and there are tens of them
    assert (run.v[late] == 0.0).all() and (run.q[late] == run.q[-1]).all()
    assert run.q.min() > -1e-12 and run.stats.penetration == 0


@pytest.mark.parametrize(
    "h, expected",
    [
        (1e-2, (-0.57057, 0.285285, 0.637916652961)),
        (1e-4, (-0.5997057, 0.29985285, 0.670491355847)),
        (1e-6, (-0.599997057, 0.2999985285, 0.670817102876)),
    ],
)
def test_rod_without_acceleration(h, expected):
    """Problem (e): no acceleration exists, but a step does: an impact without collision. The
    digits are those of theory.md: 12 after the point."""
    r = rod(2.0).step(0, PAINLEVE, [-1, 0, 0], h)
    np.testing.assert_allclose(r.v, expected, atol=1e-12)
    assert r.ok and r.modes.tolist() == ["stick"]
    assert (r.velocity == 0.0).all()  # the tip stops dead


def test_falling_rod():
    """Problem (e'): where the rod ends up after 400 steps of another stepper, which does not
    project: its penetration, 5e-7, is closed by velocities."""
    m = rod(0.6, half=0.25, inertia=0.002, cap=0.05, tips=(-1, 1))
    run = m.simulate([0, 1, np.radians(30)], [0, 0, 4], 1.0, 0.0025)
    assert run.ok and run.stats.steps == 400
    assert run.q[-1] == pytest.approx([-0.2302629534, 0.05, np.pi], abs=1e-7)
    assert (run.v[-1] == 0.0).all()


def pendulum(**changes):
    return perp.Mechanism(
        2,
        force=[0, -G],
        bilateral=lambda q: ((q @ q - 1) / 2, q),
        **changes,
    )


def test_pendulum():
    """From the horizontal: the lowest point after K(1/2) / sqrt(g), at the speed sqrt(2 g); the
    method is of order 1."""
    quarter = 1.8540746773013719 / np.sqrt(G)
    errors = []
    for steps in (200, 400):
        run = pendulum().simulate([1, 0], [0, 0], quarter, quarter / steps)
        assert run.ok and run.stats.steps == steps
        errors.append(np.linalg.norm(run.q[-1] - [0, -1]))
        assert run.stats.drift < 1e-6  # projected: what is left is of second order in h^2
    assert errors[1] < 0.02 and errors[0] / errors[1] == pytest.approx(2, abs=0.1)
    assert run.velocity[-1] == 0.0 and run.impulse.shape == (401, 1)
    drifting = pendulum().simulate([1, 0], [0, 0], quarter, quarter / 400, project=False)
    assert drifting.stats.drift > 100 * run.stats.drift


def test_puck_slides_straight():
    """Problem (b): implicit steps slide h sum max(0, v0 - k h mu g), in the first direction."""
    h, heading = 0.01, np.array([np.cos(0.3), np.sin(0.3), 0])
    run = puck().simulate([0, 0, 0], 3 * heading, 1.0, h)
    distance = h * np.maximum(0, 3 - h * 0.5 * G * np.arange(1, 101)).sum()
    # a hundred steps, each solved to a few roundings
    np.testing.assert_allclose(run.q[-1], distance * heading, atol=1e-12)
    assert (run.v[-1] == 0.0).all() and run.modes[-1, 0] == "stick"
    polygon = puck().simulate([0, 0, 0], 3 * heading, 1.0, h, cone=4)
    assert np.linalg.norm(polygon.q[-1]) > 1.05 * distance


def test_belt():
    """A mass on a belt of speed 1/4: it is dragged along, then has exactly the belt's velocity."""
    m = perp.Mechanism(
        2,
        force=[0, -G],
        contacts=lambda q: ([q[1]], [[0, 1]], [[1, 0]], [[0, -0.25]]),
        mu=0.5,
    )
    run = m.simulate([0, 0], [0, 0], 0.2, 0.01)
    assert run.v[-1, 0] == 0.25 and run.modes[-1, 0] == "stick" and (run.velocity[-1] == 0).all()


def test_moving_floor():
    """A floor that rises by t^2 / 2 from under a mass: contacts(t, q)."""
    floor = falling(contacts=lambda t, q: (q - t * t / 2, [[1.0]], None, [-t]))
    run = floor.simulate([0], [0], 1.0, 0.01)
    assert run.q[-1] == pytest.approx(0.5, abs=0.01)  # of first order
    assert run.v[-1] == pytest.approx(1.0, abs=0.02)


def test_closing_walls():
    """Two walls that meet: no velocity is possible, which the ray proves; nothing moves."""
    m = perp.Mechanism(1, contacts=lambda q: ([0, 0], [[1], [-1]], None, [-1, -1]))
    r = m.step(0, [0.5], [0.25], 0.1)
    assert r.outcome == "ray" and not r.ok and r.certificate == "infeasible"
    assert r.q == [0.5] and r.v == [0.25] and (r.impulse == 0).all()
    assert r.ray == pytest.approx(r.ray[0] * np.ones(2)) and r.ray[0] > 0
    run = m.simulate([0.5], [0.25], 1.0, 0.1)
    assert run.outcome == "ray" and not run.ok and run.q[-1] == 0.5


def test_quaternion():
    """A spin about one axis: coordinates, kinematics, normalise. n = 3 but q has 4 entries."""

    def kinematics(q, w):
        a, x, y, z = q
        E = [[-x, -y, -z], [a, z, -y], [-z, a, x], [y, -x, a]]
        return np.array(E) @ w / 2

    sizes = []

    def normalise(q):
        sizes.append(np.linalg.norm(q))
        return q / sizes[-1]

    m = perp.Mechanism(3, mass=[1, 2, 3], coordinates=4, kinematics=kinematics, normalise=normalise)
    run = m.simulate([1, 0, 0, 0], [0, 0, 1.0], 1.0, 0.001)
    assert run.q.shape == (1001, 4) and max(sizes) > 1
    np.testing.assert_allclose(np.linalg.norm(run.q, axis=1), 1, rtol=1e-15)
    # h^2 / 12 of the angle's rate is lost in each step
    np.testing.assert_allclose(run.q[-1], [np.cos(0.5), 0, 0, np.sin(0.5)], atol=1e-7)


## Runs


def test_chosen_steps():
    """A stricter tolerance takes more steps and is nearer to the truth: the pendulum's energy
    stays 0. Of a falling ball e = 1/2 nothing but rest remains."""
    energies, steps = [], []
    for error in (1e-3, 1e-4):
        run = pendulum().simulate([1, 0], [0, 0], 0.5, 0.01, error=error)
        assert run.ok and run.t[-1] == 0.5 and np.isfinite(run.stats.error)
        assert len(run.t) == run.stats.steps + 1 and np.ptp(np.diff(run.t)) > 1e-4
        steps.append(run.stats.steps)
        energies.append(abs(run.v[-1] @ run.v[-1] / 2 + G * run.q[-1, 1]))
    assert steps[0] < steps[1] and energies[1] < energies[0] / 4 < 1e-3
    run = pendulum().simulate([1, 0], [0, 0], 0.5, 0.01, error=1e-4, longest=1e-3)
    assert np.diff(run.t).max() <= 1e-3 * (1 + 1e-12)
    run = falling(restitution=0.5).simulate([1], [0], 2.0, 0.01, error=1e-4)
    assert run.ok and run.q[-1] == 0.0 and run.v[-1] == 0.0


def test_schemes():
    """Of a free fall: the velocity is g t with each; the path is of order 1, and exact with theta's
    mean of two ends. Of the pendulum: all near the truth, theta nearest."""
    h, t = 0.1, 1.0
    for scheme, path in (
        ("frozen", -G * t * (t + h) / 2),
        ("implicit", -G * t * (t + h) / 2),
        ("theta", -G * t * t / 2),
    ):
        run = falling().simulate([10], [0], t, h, scheme=scheme)
        assert run.ok and run.stats.fallbacks == 0
        # ten steps of a few roundings
        assert run.v[-1] == pytest.approx(-G * t, rel=1e-14)
        assert run.q[-1] - 10 == pytest.approx(path, rel=1e-13)
    quarter, errors = 1.8540746773013719 / np.sqrt(G), {}
    for scheme in ("frozen", "implicit", "theta"):
        run = pendulum().simulate([1, 0], [0, 0], quarter, quarter / 200, scheme=scheme)
        assert run.ok
        errors[scheme] = np.linalg.norm(run.q[-1] - [0, -1])
    assert max(errors.values()) < 0.02 and errors["theta"] < 1e-3
    step = falling().step(0, [10], [0], 0.1, scheme="implicit")
    assert step.scheme == "implicit"


def test_callback_sees_every_step_and_stops():
    seen = []
    run = ramp().simulate([0], [2], 3.0, 0.1, callback=lambda s: seen.append(s) or s.t > 0.45)
    assert run.outcome == "stopped" and run.stats.steps == 5 and len(seen) == 6
    assert seen[0].h == 0 and seen[0].v == 2 and seen[1].h == pytest.approx(0.1)
    assert [s.v[0] for s in seen] == run.v[:, 0].tolist()
    assert seen[-1].modes.tolist() == ["slip"] and seen[-1].ok


def test_starts_at_any_time():
    m = perp.Mechanism(1, force=lambda t, q, v: [t])
    run = m.simulate([0], [0], 3.0, 0.5, t0=2.0)
    assert run.t.tolist() == [2.0, 2.5, 3.0]


def test_the_same_bits():
    runs = [rod(2.0).simulate(PAINLEVE, [-1, 0, 0], 0.3, 1e-3) for _ in range(2)]
    for name in ("t", "q", "v", "impulse", "velocity", "modes"):
        np.testing.assert_array_equal(getattr(runs[0], name), getattr(runs[1], name))


def test_steps_are_those_of_a_run():
    m, q, v = rod(2.0), np.array(PAINLEVE), np.array([-1.0, 0, 0])
    run = m.simulate(q, v, 0.25, 2**-6)
    for k in range(16):
        r = m.step(k * 2**-6, q, v, 2**-6)
        q, v = r.q, r.v
    np.testing.assert_array_equal(run.q[-1], q)
    np.testing.assert_array_equal(run.v[-1], v)


def test_outside_of_the_domain():
    def force(t, q, v):
        if q[0] < 0.9:
            raise perp.OutsideDomain
        return [-G]

    m = perp.Mechanism(1, force=force)
    r = m.step(0, [0.5], [0], 0.1)
    assert r.outcome == "evaluation_failed" and not r.ok
    assert r.q == [0.5] and r.v == [0]
    run = m.simulate([1], [0], 1.0, 0.05)
    assert run.outcome == "evaluation_failed" and len(run.t) == run.stats.steps + 1
    assert run.q[-1] < 0.9
