"""Contacts that hold both ways in mechanisms: Dupont's drawer, a machine on four frictional pins,
a ball joint, and the shapes in which functions may say it."""

import numpy as np
import pytest

import perp

M, H, L, MU, F = 2.3, 0.6, 0.25, 0.35, 3.0  # theory.md's: z = 2 mu h / L = 1.68
Z = 2 * MU * H / L
G = 9.81


def drawer(mu=MU, **settings):
    def guides(q):
        gap = [q[1] + L / 2 * q[2], q[1] - L / 2 * q[2]]
        return gap, [[0, 1, L / 2], [0, 1, -L / 2]], [[1, 0, H], [1, 0, H]]

    force = [F, 0, F * H]
    return perp.Mechanism(
        3, mass=[M, M, 0.7], force=force, contacts=guides, mu=mu, two_sided=1, **settings
    )


def linkage(mu, radius=0.02):
    """A crank, a coupler and a rocker of length 1, and the ground: a parallelogram whose coupler
    stays level, on four pins. One coordinate, the crank's angle."""
    a = np.deg2rad(-30)
    ends = [((None, 0), (0, 0)), ((0, 1), (1, 0)), ((1, 1), (2, 1)), ((None, 1), (2, 0))]
    c = np.array([[0.5 * np.cos(a), 0.5 * np.sin(a), a],
                  [np.cos(a) + 0.5, np.sin(a), 0.0],
                  [1 + 0.5 * np.cos(a), 0.5 * np.sin(a), a]])

    def point(q, body, end):
        """Of a pin on a body: place, and its rows by velocities. None: the ground."""
        rows = np.zeros((2, 9))
        if body is None:
            return np.array([float(end), 0.0]), rows
        x, y, angle = q[3 * body : 3 * body + 3]
        s, k = (end - 0.5) * np.sin(angle), (end - 0.5) * np.cos(angle)
        rows[0, 3 * body], rows[0, 3 * body + 2] = 1, -s
        rows[1, 3 * body + 1], rows[1, 3 * body + 2] = 1, k
        return np.array([x + k, y + s]), rows

    def pins(q):
        gap, normal, tangent = np.zeros((4, 2)), np.zeros((4, 2, 9)), np.zeros((4, 9))
        for i, (one, other) in enumerate(ends):
            (p, P), (o, O) = point(q, *one), point(q, *other)
            gap[i], normal[i] = o - p, O - P
            if one[0] is not None:
                tangent[i, 3 * one[0] + 2] = -radius
            tangent[i, 3 * other[0] + 2] = radius
        return gap, normal, tangent

    mass = np.tile([1.0, 1.0, 1 / 12], 3)
    force = np.tile([0.0, -G, 0.0], 3)
    m = perp.Mechanism(9, mass=mass, force=force, contacts=pins, mu=mu, two_sided=2)
    spin = np.array([-0.5 * np.sin(a), 0.5 * np.cos(a), 1, -np.sin(a), np.cos(a), 0,
                     -0.5 * np.sin(a), 0.5 * np.cos(a), 1])
    return m, c.ravel(), spin


## The drawer


def test_drawer():
    """m x'' + 2 mu |N| = F, N = m h x'' / L: two accelerations, one stable, and no preload."""
    r = drawer().accelerations(0, np.zeros(3), [1, 0, 0])
    assert r.exhaustive and r.families == 0 and r.stable == 1 and r.closed == 2
    unstable, stable = r
    assert stable.stable and not unstable.stable
    # numbers of size 1, and six digits that were given
    assert stable.acceleration == pytest.approx([F / (M * (1 + Z)), 0, 0], abs=1e-13)
    assert unstable.acceleration == pytest.approx([F / (M * (1 - Z)), 0, 0], abs=1e-13)
    assert [s.acceleration[0] for s in r] == pytest.approx([-1.918159, 0.486697], abs=5e-7)
    N = M * H * stable.acceleration[0] / L
    assert stable.force == pytest.approx([-N, -MU * N, N, -MU * N], abs=1e-13)


def test_drawer_against_its_motion():
    m = drawer()
    assert len(m.accelerations(0, np.zeros(3), [-1, 0, 0])) == 0
    step = m.step(0, np.zeros(3), [-1, 0, 0], 1e-3)
    assert step.ok and (step.v == 0.0).all() and step.modes.tolist() == ["stick", "stick"]


@pytest.mark.parametrize("select", ["nearest", "freest"])
def test_answers_of_a_step(select):
    """The two accelerations, and the jam."""
    m, h = drawer(), 1e-3
    r = m.answers(0, np.zeros(3), [1, 0, 0], h)
    assert r.exhaustive and len(r) == 3 and r.families == 1
    found = sorted(s.acceleration[0] for s in r)  # rounding of v / h
    assert found == pytest.approx([-1 / h, F / (M * (1 - Z)), F / (M * (1 + Z))], abs=1e-12 / h)
    step = m.step(0, np.zeros(3), [1, 0, 0], h, select=select)
    assert step.v[0] == pytest.approx(1 + h * F / (M * (1 + Z)), abs=1e-15 * 4)


@pytest.mark.parametrize("scheme", ["frozen", "implicit", "theta"])
def test_drawer_runs(scheme):
    run = drawer().simulate(np.zeros(3), [1, 0, 0], 1, 0.01, scheme=scheme)
    assert run.ok and run.v[-1][0] == pytest.approx(1 + F / (M * (1 + Z)), abs=1e-13)
    assert (run.v[:, 1:] == 0.0).all() and run.stats.drift == 0.0


## Four pins


@pytest.mark.parametrize("way", [-1, 1])
@pytest.mark.parametrize("mu", [0.0, 0.1, 0.5])
def test_four_pins(mu, way):
    """Slow, so that only weights load: the friction of what presses each pin takes from the power
    of the weights, by virtual work, and accelerates the rest."""
    m, q, spin = linkage(mu)
    r = m.accelerations(0, q, 1e-3 * way * spin)
    assert r.exhaustive and len(r) == 1
    s = r[0]
    force = s.force.reshape(4, 3)
    load = np.hypot(force[:, 0], force[:, 1])
    assert np.abs(force[:, 2]) == pytest.approx(mu * load, rel=1e-12)  # Coulomb's law
    # each pin turns by the crank's angle; a parallelogram: coupler's mass, and two cranks
    inertia = 1.0 + 2 / 3
    weights = -2 * G * np.cos(q[2])  # of the coupler, and half of each crank
    friction = -way * mu * 0.02 * load.sum()
    crank = s.acceleration[2]
    assert inertia * crank == pytest.approx(weights + friction, rel=1e-12)


def test_four_pins_run():
    """It loses what friction takes: less than all, more than nothing, and stays together."""
    m, q, spin = linkage(0.3)
    run = m.simulate(q, 0 * q, 1.0, 2e-3, scheme="theta")
    assert run.ok and run.stats.drift < 1e-5  # to first order in each step, of (h w)^2

    def energy(i):
        return (0.5 * np.tile([1, 1, 1 / 12], 3) @ run.v[i] ** 2) + G * run.q[i][1::3].sum()

    lost = energy(0) - energy(-1)
    turned = np.abs(np.diff(run.q[:, 2])).sum()
    x, y, _ = np.moveaxis(run.impulse[1:].reshape(-1, 4, 3), 2, 0)
    load = np.hypot(x, y).sum(axis=1) / 2e-3
    power = 0.3 * 0.02 * (load * np.abs(np.diff(run.q[:, 2]))).sum()
    assert turned > 1 and lost == pytest.approx(power, rel=1e-2)  # of second order in h w = 1e-2


## Shapes


def test_ball_joint():
    """A body on a ball joint at its side, let go."""
    normal = np.zeros((3, 6))
    normal[:, :3] = np.eye(3)
    normal[1, 5], normal[2, 4] = 0.5, -0.5  # the joint is at (0.5, 0, 0)
    tangent = np.zeros((2, 6))
    tangent[0, 4] = tangent[1, 5] = 0.01
    m = perp.Mechanism(
        6, mass=[1, 1, 1, 0.1, 0.1, 0.1], force=[0, 0, -G, 0, 0, 0],
        contacts=lambda q: (normal @ q, normal, tangent), mu=0.2, two_sided=3,
    )
    (s,) = m.accelerations(0, np.zeros(6), np.zeros(6))
    alpha, N = -s.acceleration[4], s.force[2]
    # (0.1 + 0.25) alpha = 0.5 g - mu r N, N = g - alpha / 2
    assert 0.35 * alpha == pytest.approx(0.5 * G - 0.2 * 0.01 * N, rel=1e-12)
    assert N == pytest.approx(G - alpha / 2, rel=1e-12)


def test_mixed_with_an_ordinary_contact():
    """A guide and a floor: rows one after the other, sizes by two_sided."""
    normal, tangent = [[1.0, 0], [0, 1.0]], [[0, 1.0], [1.0, 0]]
    m = perp.Mechanism(
        2, force=[3.0, -1.0], contacts=lambda q: (np.array([q[0], q[1]]), normal, tangent),
        mu=[0.5, 0.0], two_sided=[1, 0],
    )
    step = m.step(0, [0, 0], [0, 1.0], 0.1)
    # rises along the guide, held back by 0.5 * 3 and by 1
    assert step.v == pytest.approx([0, 1 - 0.1 * 2.5], abs=1e-15)
    assert step.modes.tolist() == ["slip", "separate"]


def test_gaps_by_contact_or_flat():
    m, q, spin = linkage(0.1)
    (one,) = m.accelerations(0, q, spin)

    def flat(q):
        gap, normal, tangent = m._callbacks._functions["contacts"](q)
        return gap.ravel(), normal.reshape(8, 9), tangent

    other = perp.Mechanism(
        9, mass=np.tile([1.0, 1.0, 1 / 12], 3), force=np.tile([0.0, -G, 0.0], 3),
        contacts=flat, mu=0.1, two_sided=[2, 2, 2, 2],
    )
    (same,) = other.accelerations(0, q, spin)
    assert (same.acceleration == one.acceleration).all()


@pytest.mark.parametrize(
    "change, words",
    [
        (dict(two_sided=4), "two_sided is 4, expected 0, 1, 2 or 3"),
        (dict(two_sided=1.5), "two_sided is 1.5"),
        (dict(two_sided=[1, 1, 1]), r"gap has shape \(2,\), expected \(3,\)"),
        (dict(two_sided=1, dim=6), "dim is 6, expected 1, 2, 3, 4 or 5"),
        (dict(two_sided=1, restitution=0.5), r"restitution\[0\] is 0.5"),
        (dict(two_sided=2, contact_count=2), r"gap has shape \(2,\), expected \(4,\)"),
        (dict(two_sided=1, dim=1), r"dims\[0\] is 1, expected 2 or 3"),
    ],
)
def test_refused(change, words):
    def guides(q):
        return [q[1], q[1]], [[0, 1, 0], [0, 1, 0]], [[1, 0, 0], [1, 0, 0]]

    with pytest.raises(perp.Error, match=words):
        m = perp.Mechanism(3, contacts=guides, mu=0.5, **change)
        m.step(0, np.zeros(3), np.zeros(3), 0.1)
