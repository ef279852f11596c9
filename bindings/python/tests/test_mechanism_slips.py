"""Slips that turn, or whose friction depends on their speed: theta is of second order, and chosen
steps keep the error asked. Random members of each class, beside SciPy's integration of the same
equations, in which friction is a force: no member comes to rest before the end."""

import numpy as np
import pytest

import perp

G = 9.81
integrate = pytest.importorskip("scipy.integrate")


def plane(rng):
    """A block in space; its force turns, and with it the slip."""
    mu, pull, w = rng.uniform(0.1, 0.5), rng.uniform(-4, 4, 2), rng.uniform(1, 4)
    angle, v0 = rng.uniform(0, 2 * np.pi), rng.uniform(3, 5)

    def force(t, q, v):
        return pull * np.cos(w * t) - mu * G * v / np.hypot(*v)

    m = perp.Mechanism(
        3,
        force=lambda t, q, v: [*(pull * np.cos(w * t)), -G],
        contacts=lambda q: (q[2:], [[0, 0, 1]], [[1, 0, 0], [0, 1, 0]]),
        mu=mu,
    )
    return m, [v0 * np.cos(angle), v0 * np.sin(angle), 0], [0, 1], force


def ball(rng):
    """A ball with spin whose path bends (v' = k v x z and friction): its foot's slip turns."""
    mu, k, R = rng.uniform(0.02, 0.1), rng.uniform(0.5, 3), 0.1
    inertia = 0.4 * R * R
    v0, spin = [6, 0] + rng.uniform(-2, 2, 2), rng.uniform(-20, 20, 2)
    H = np.array([[1, 0, 0, -R], [0, 1, R, 0]])

    def force(t, q, v):
        u = H @ v
        return np.r_[-k * v[1], k * v[0], 0, 0] - H.T @ (mu * G * u / np.hypot(*u)) / np.r_[
            1, 1, inertia, inertia
        ]

    m = perp.Mechanism(
        5,
        mass=[1, 1, inertia, inertia, 1],
        force=lambda t, q, v: [-k * v[1], k * v[0], 0, 0, -G],
        contacts=lambda q: (q[4:], [[0, 0, 0, 0, 1]], np.c_[H, [0, 0]]),
        mu=mu,
    )
    return m, [*v0, *spin, 0], [0, 1, 2, 3], force


def disc(rng):
    """Dry friction of a given bound in two directions, and a spring."""
    bound, k, v0 = rng.uniform(0.5, 3), rng.uniform(1, 4), rng.uniform(2, 3, 2)

    def force(t, q, v):
        return -k * np.array([1, 2]) * q - bound * v / np.hypot(*v)

    m = perp.Mechanism(
        2, force=lambda t, q, v: -k * np.array([1, 2]) * q, tresca=([bound], np.eye(2)[None])
    )
    return m, v0, [0, 1], force


def ellipse(rng):
    """Friction in an ellipse, mu and s mu: tangents that are scaled."""
    mu, s = rng.uniform(0.2, 0.4), np.array([1, rng.uniform(0.3, 0.9)])
    v0 = rng.uniform(1.5, 3, 2)

    def force(t, q, v):
        return -mu * G * s * s * v / np.hypot(*(s * v))

    m = perp.Mechanism(
        3,
        force=[0, 0, -G],
        contacts=lambda q: (q[2:], [[0, 0, 1]], [[1, 0, 0], [0, s[1], 0]]),
        mu=mu,
    )
    return m, [*v0, 0], [0, 1], force


def stribeck(rng):
    """Friction that falls with the speed."""
    mu, more, s, v0 = rng.uniform(0.2, 0.4), *rng.uniform(0.2, 0.4, 2), rng.uniform(3, 4)
    s *= 5

    def force(t, q, v):
        return -G * (mu + more * np.exp(-((v / s) ** 2)))

    m = perp.Mechanism(
        2,
        force=[0, -G],
        contacts=lambda q: (q[1:], [[0, 1]], [[1, 0]]),
        mu=mu,
        mu_static=mu + more,
        stribeck=s,
    )
    return m, [v0, 0], [0], force


@pytest.mark.parametrize("kind", [plane, ball, disc, ellipse, stribeck])
def test_a_slip_that_turns_has_the_second_order(kind):
    rng = np.random.default_rng(5)
    for _ in range(5):
        m, v0, moves, force = kind(rng)
        n, end = len(moves), 0.3
        given = [v0[i] for i in moves]

        def rate(t, y, n=n, force=force):
            return np.r_[y[n:], force(t, y[:n], y[n:])]

        # to 1e-12; the smallest errors below are some 1e-9
        true = integrate.solve_ivp(
            rate, (0, end), [0] * n + given, method="DOP853", rtol=1e-12, atol=1e-13
        ).y[:, -1]

        def off(h, error=0.0, m=m, v0=v0, moves=moves, true=true):
            run = m.simulate([0] * m.n, v0, 0.3, h, scheme="theta", error=error)
            assert run.outcome == "solved"
            return np.abs(np.r_[run.q[-1, moves], run.v[-1, moves]] - true).max()

        # half the step leaves a quarter of the error, up to terms of the third order
        assert np.log2(off(end / 80) / off(end / 160)) == pytest.approx(2, abs=0.2)
        for error in (1e-4, 1e-6):
            # relative to the largest q and v; what one coordinate's estimate leaves to others
            assert off(1e-2, error) < 10 * error * np.abs(true).max()


@pytest.mark.parametrize("theta", [0.0, 0.3, 0.8, 1.0])
def test_other_weights_are_of_first_order(theta):
    """They come nearer to 1/2's answer in proportion to the step; 1/2's own error is 1000 times less."""
    rng = np.random.default_rng(9)
    for kind in (plane, ball, disc, stribeck):
        m, v0, _, _ = kind(rng)
        end = [
            m.simulate([0] * m.n, v0, 0.3, h, scheme="theta", theta=weight).q[-1]
            for h, weight in ((0.003, theta), (0.0015, theta), (0.0015, 0.5))
        ]
        ratio = np.abs(end[0] - end[2]).max() / np.abs(end[1] - end[2]).max()
        assert ratio == pytest.approx(2, abs=0.15)


def test_an_ellipse_of_friction_stops_where_its_equation_does():
    """A drawn block: the slip turns towards the tangent with more friction, and ends."""
    rng = np.random.default_rng(6)
    for _ in range(4):
        m, v0, _, force = ellipse(rng)

        def rate(t, y, force=force):
            return np.r_[y[2:], force(t, y[:2], y[2:])]

        def ends(t, y):
            return np.hypot(*y[2:]) - 1e-7  # from there on it moves by 1e-7^2 / (2 mu G)

        ends.terminal = True
        run = integrate.solve_ivp(
            rate, (0, 5), [0, 0, *v0[:2]], method="DOP853", rtol=1e-11, atol=1e-12, events=ends
        )
        for error in (1e-4, 1e-6):
            found = m.simulate([0] * 3, v0, 2 * run.t[-1], 1e-2, scheme="theta", error=error)
            assert np.all(found.v[-1] == 0.0)
            assert np.abs(found.q[-1, :2] - run.y[:2, -1]).max() < error * np.abs(run.y).max()
