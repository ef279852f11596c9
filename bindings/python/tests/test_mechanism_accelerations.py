"""All accelerations of a state of a mechanism: counts, forces, and which are stable."""

import numpy as np
import pytest
from test_mechanism import PAINLEVE, RAMP, G, puck, ramp, rod

import perp
from perp import _generated, _mechanism_library


def sliding(mu, tangent=2.0, spin=0.0, slip=-1.0):
    """Accelerations of problem (e)'s rod, its tip on the floor, at an angle of this tangent."""
    angle = np.arctan(tangent)
    s, c = np.sin(angle), np.cos(angle)
    q, v = [c, s, angle], [slip - s * spin, c * spin, spin]
    return rod(mu).accelerations(0, q, v)


def bisect(inside, low, high):
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if inside(middle) else (low, middle)
    return low


## Painlevé's rod (e)


def test_no_acceleration():
    r = sliding(2.0)
    assert len(r) == r.count == 0 and r.solutions == [] and r.exhaustive
    assert r.closed == 1 and not r.impact and r.contact == 0
    assert r.inertia < 0 and r.reason == _mechanism_library.MECHANISM_REASONS[1]


def test_two_accelerations():
    """It takes off, which is stable, or the tip is pressed in: N = -b / p."""
    r = sliding(2.0, spin=4.0)
    assert r.count == 2 and r.exhaustive and r.stable == 1 and r.families == 0
    off, pressed = r
    assert off.modes.tolist() == ["separate"] and off.stable
    assert (off.force == 0.0).all()
    assert off.acceleration == pytest.approx([0, -G, 0], abs=1e-15)
    # b from theory.md; differences of rows along the motion are good for ten digits
    assert off.row_acceleration[0] == pytest.approx(4.5008350559986541, rel=1e-10)
    assert pressed.modes.tolist() == ["slip"] and not pressed.stable
    N = 5.6260438199983176
    assert pressed.force == pytest.approx([N, 2 * N], rel=1e-10)
    assert pressed.row_acceleration[0] == 0.0
    assert pressed.eigenvalues.real.max() > 0


def test_one_acceleration():
    """Slipping to the right the rod is always consistent: p = 4."""
    r = sliding(2.0, slip=1.0)
    assert r.count == 1 and r.exhaustive and r.inertia > 0
    (s,) = r
    assert s.force == pytest.approx([G / 4, -2 * G / 4], rel=1e-10)
    assert s.stable and s.modes.tolist() == ["slip"] and s.dimension == s.free == 0


def test_critical_friction():
    """2 sqrt(1 + 3) / 3 at tan = 2; of mu = 2 the tangents are 3 -+ sqrt(5)."""
    assert bisect(lambda mu: sliding(mu).count == 1, 1.0, 2.0) == pytest.approx(4 / 3, abs=1e-9)
    for end in (0.5, 6.0):
        tangent = bisect(lambda x: sliding(2.0, x).count == 0, 2.0, end)
        expected = 3 + np.copysign(np.sqrt(5), end - 2)
        assert tangent == pytest.approx(expected, abs=1e-9)


def test_critical_spin():
    """Beyond sqrt(g / (l sin)) the rod can take off: two instead of none."""
    spin = bisect(lambda w: sliding(2.0, spin=w).count == 0, 0.0, 10.0)
    assert spin == pytest.approx(3.3117840252100481, abs=1e-8)


## Others


def test_free():
    m = rod(0.5)
    r = m.accelerations(0, [0, 5, 1], [1, 2, 3])
    assert r.count == 1 and r.exhaustive and r.closed == 0 and r.contact is None
    assert r[0].acceleration == pytest.approx([0, -G, 0], abs=1e-15)
    assert r[0].modes.tolist() == ["separate"]


def test_an_impact_comes_first():
    r = rod(0.5).accelerations(0, PAINLEVE, [0, -1, 0])
    assert r.impact and r.count == 0


def test_brick_at_rest():
    """On a slope below the friction angle it stays: acceleration exactly 0.0."""
    m = perp.Mechanism(
        2,
        force=[G * np.sin(RAMP), -G * np.cos(RAMP)],
        contacts=lambda q: (q[1], [0, 1], [1, 0]),
        mu=0.3,
    )
    r = m.accelerations(0, [0, 0], [0, 0])
    assert r.count == 1 and (r[0].acceleration == 0.0).all()
    assert r[0].modes.tolist() == ["stick"]
    assert r[0].force == pytest.approx([G * np.cos(RAMP), -G * np.sin(RAMP)], rel=1e-14)
    r = m.accelerations(0, [0, 0], [1, 0])
    (s,) = r
    a = G * (np.sin(RAMP) - 0.3 * np.cos(RAMP))
    assert s.acceleration == pytest.approx([a, 0], rel=1e-14, abs=1e-15)


def test_dry_friction():
    r = ramp().accelerations(0, [0], [0])
    assert r.count == 1 and r[0].acceleration == 0.0 and r[0].modes.tolist() == ["stick"]
    assert r[0].force == pytest.approx([-1.7034886229125867], rel=1e-14)
    r = ramp(force=[5.0]).accelerations(0, [0], [0])
    assert r.count == 1 and r[0].modes.tolist() == ["slip"]
    assert r[0].acceleration == pytest.approx([5 - 2.8982892171149283], rel=1e-14)


def test_in_space():
    """Friction against the slip, whatever its direction."""
    heading = np.array([np.cos(0.3), np.sin(0.3), 0])
    r = puck().accelerations(0, [0, 0, 0], 3 * heading)
    assert r.count == 1 and r[0].modes.tolist() == ["slip"]
    # differences of rows that do not change
    assert r[0].acceleration == pytest.approx(-0.5 * G * heading, abs=1e-9)


def test_redundant_feet():
    """Three feet in a row carry a plank: the forces are a family, the acceleration is one."""

    def contacts(q):
        x = np.array([-1.0, 0, 1])
        normal = np.stack([np.ones(3), x * np.cos(q[1])], axis=1)
        return q[0] + x * np.sin(q[1]), normal

    m = perp.Mechanism(2, mass=[1, 1 / 3], force=[-G, 0], contacts=contacts)
    r = m.accelerations(0, [0, 0], [0, 0])
    assert r.exhaustive and r.reason == _mechanism_library.MECHANISM_REASONS[4]
    family = max(r, key=lambda s: s.dimension)
    assert family.dimension == 1 and family.free == 0 and r.families >= 1
    assert (family.acceleration == 0.0).all()
    assert family.vertices.shape == (2, 3) and family.directions.shape == (0, 3)
    # the middle foot carries all, or the outer ones half each
    expected = np.array([[G / 2, 0, G / 2], [0, G, 0]])
    np.testing.assert_allclose(
        sorted(family.vertices.tolist()), sorted(expected.tolist()), atol=1e-12
    )


def test_curvature_given():
    """Instead of differences: the same to their accuracy, and exact."""

    def curvature(t, q, v):
        s, c = np.sin(q[2]), np.cos(q[2])
        return [s * v[2] ** 2, c * v[2] ** 2]

    m = rod(2.0, curvature=curvature)
    v = [-1 - np.sqrt(0.8) * 4, np.sqrt(0.2) * 4, 4]
    r = m.accelerations(0, PAINLEVE, v)
    assert r[1].force[0] == pytest.approx(5.6260438199983176, rel=1e-14)


def test_not_exhaustive():
    m = perp.Mechanism(2, force=[0, -G], contacts=lambda q: (q[1], [0, 1], [1, 0]), mu=0.3)
    r = m.accelerations(0, [0, 0], [0, 0], most_patterns=1)
    assert not r.exhaustive and "at least" in repr(r)


def test_answers_are_kept():
    m = rod(2.0)
    first = m.accelerations(0, PAINLEVE, [-1, 0, 0])
    v = [-1 - np.sqrt(0.8) * 4, np.sqrt(0.2) * 4, 4]
    second = m.accelerations(0, PAINLEVE, v)
    before = second[1].force.copy()
    m.accelerations(0, [0, 5, 1], [0, 0, 0])
    np.testing.assert_array_equal(second[1].force, before)
    assert len(first) == 0 and len(list(second)) == 2


@pytest.mark.parametrize(
    "arguments, text",
    [
        (dict(q=[0, 0]), r"q has shape \(2,\)"),
        (dict(most_patterns=0), "most_patterns"),
        (dict(most_patterns=1.5), "most_patterns is 1.5"),
        (dict(directions=2), "directions"),
        (dict(starts=-1), "starts"),
        (dict(stiffness=0), "stiffness"),
        (dict(damping=-1), "damping"),
    ],
)
def test_refusals(arguments, text):
    with pytest.raises(ValueError, match=text):
        rod(0.5).accelerations(**{**dict(t=0, q=[0, 5, 1], v=[0, 0, 0]), **arguments})


def test_exceptions_come_out():
    def curvature(t, q, v):
        raise KeyError("from inside")

    with pytest.raises(KeyError, match="from inside"):
        rod(0.5, curvature=curvature).accelerations(0, PAINLEVE, [-1, 0, 0])
    m = rod(0.5, curvature=lambda t, q, v: [0])
    with pytest.raises(ValueError, match=r"curvature\(t, q, v\) has shape \(1,\), expected \(2,\)"):
        m.accelerations(0, PAINLEVE, [-1, 0, 0])


def test_defaults_are_the_librarys():
    theirs = _mechanism_library.defaults(_generated.MechanismSettings)
    calls = (perp.Mechanism.accelerations, perp.Mechanism.answers)
    for name, value in (item for call in calls for item in call.__kwdefaults__.items()):
        if name == "time_limit":
            assert value is None and theirs.time_limit == 0
        else:
            assert getattr(theirs, name) == value, name


def test_answers_of_a_step():
    """A wedge with half angle 10 degrees and mu = 0.3 > tan(10 degrees), pulled from rest with a
    force of 1: it jams, or comes out with velocity h; both solve the step's problem."""
    s, c = np.sin(np.radians(10)), np.cos(np.radians(10))

    def faces(q):
        gap = [c * q[0] + s * q[1], -c * q[0] + s * q[1]]
        return gap, [[c, s], [-c, s]], [[-s, c], [s, c]]

    wedge = perp.Mechanism(2, force=[0, 1], contacts=faces, mu=0.3)
    answers = wedge.answers(0, [0, 0], [0, 0], 1e-2)
    assert answers.exhaustive and len(answers) == answers.count >= 2
    assert {tuple(a.acceleration) for a in answers} == {(0, 0), (0, 1)}
    for select, velocity in ("nearest", 0.0), ("freest", 1e-2):
        step = wedge.step(0, [0, 0], [0, 0], 1e-2, select=select)
        assert step.v[1] == velocity and step.answers == len(answers) and step.exhaustive
    assert wedge.step(0, [0, 0], [0, 0], 1e-2).answers is None
    with pytest.raises(perp.Error, match="select"):
        wedge.step(0, [0, 0], [0, 0], 1e-2, select="best")
    with pytest.raises(perp.Error, match="h is 0"):
        wedge.answers(0, [0, 0], [0, 0], 0)


def test_search_with_dry_friction():
    """What one start of the search finds does not spoil the next: dry friction starts to slip to
    one side in one answer, to the other in another."""
    rows = np.zeros(1), np.array([[2.0, 2.0]]), np.array([[-4.0, 0.0]])
    m = perp.Mechanism(
        2,
        mass=lambda q: np.eye(2),
        force=lambda t, q, v: np.array([4.0, -3.0]),
        contacts=lambda q: rows,
        mu=3.0,
        tresca=lambda t, q, v: (np.ones(1), np.array([[-2.0, 2.0]])),
    )
    everything = m.accelerations(0, np.zeros(2), np.zeros(2))
    some = m.accelerations(0, np.zeros(2), np.zeros(2), most_patterns=1)
    assert everything.exhaustive and everything.count == 3
    assert not some.exhaustive and some.count >= 2
    for s in some:
        distances = [abs(s.acceleration - e.acceleration).max() for e in everything]
        assert min(distances) < 1e-12  # of forces near 1


def slips_that_start(W, q, mu):
    """Forces of one contact at rest whose slip starts, by a scan over its direction: f_n from
    u_n' = 0, friction against (c, s), and the zeros of (c, s) x u_t' where u_t' points along it."""

    def at(t):
        c, s = np.cos(t), np.sin(t)
        n = -q[0] / (W[0, 0] - mu * (W[0, 1] * c + W[0, 2] * s))
        f = n * np.array([1, -mu * c, -mu * s])
        u = q + W @ f
        return f, c * u[2] - s * u[1], c * u[1] + s * u[2]

    found, angles = [], np.linspace(0, 2 * np.pi, 721)
    for low, high in zip(angles, angles[1:]):
        if at(low)[1] * at(high)[1] >= 0 or at(low)[0][0] * at(high)[0][0] <= 0:
            continue
        for _ in range(120):
            middle = (low + high) / 2
            low, high = (low, middle) if at(low)[1] * at(middle)[1] <= 0 else (middle, high)
        f, across, along = at(low)
        if f[0] > 0 and along > 1e-6:
            found.append(f)
    return found


@pytest.mark.parametrize("condition", [1e2, 1e5, 1e6, 1e7])
def test_no_answer_of_an_ill_conditioned_contact_is_missed(condition):
    """M = A A' with two rows of A nearly the same; what is called exhaustive has every
    slip that the scan finds, to what rounding leaves of W."""
    rng, seen, n = np.random.default_rng(6), 0, 5
    for _ in range(60):
        A, J = rng.standard_normal((n, n)), rng.standard_normal((3, n))
        A[-1] = A[0] + condition**-0.5 * A[-1]
        M = A @ A.T
        inverse = np.linalg.inv(M)
        W, mu, k = J @ inverse @ J.T, rng.uniform(0.2, 1.5), 4 * rng.standard_normal(n)
        q = J @ inverse @ k
        if q[0] > 0:
            q, k = -q, -k

        def contacts(x, J=J):
            return (J @ x)[:1], J[:1], J[None, 1:]

        m = perp.Mechanism(n, mass=M, force=k, contacts=contacts, mu=mu, dim=3)
        told = m.accelerations(0, np.zeros(n), np.zeros(n))
        for f in slips_that_start(W, q, mu) if told.exhaustive else []:
            near = [np.abs(np.array(a.force).ravel()[:3] - f).max() for a in told]
            assert near and min(near) <= 1e-11 * condition * np.abs(f).max()
            seen += 1
    assert seen > 10
