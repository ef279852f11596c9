"""Tippe tops: balls whose mass lies off their centre, spun on a plane with friction. The contact
wanders over the top while it slides, and its slip turns in space. Beside SciPy's integration of the
equations of a top that slides and never leaves."""

import numpy as np
import pytest

import perp

G = 9.81
integrate = pytest.importorskip("scipy.integrate")
UP = np.array([0, 0, 1.0])


def turned(p):
    """The matrix of the unit quaternion p."""
    w, x, y, z = p
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def kinematics(q, v):
    """Velocities are those of the mass centre, and the spin in axes of the body."""
    (w, x, y, z), (a, b, c) = q[3:], v[3:]
    change = [-x * a - y * b - z * c, w * a + y * c - z * b, w * b + z * a - x * c]
    return np.r_[v[:3], 0.5 * np.array([*change, w * c + x * b - y * a])]


class Top:
    def __init__(self, rng):
        self.R, m = rng.uniform(0.015, 0.03), rng.uniform(0.01, 0.03)
        self.mu = rng.uniform(0.1, 0.5)
        self.offset, self.spin = self.R * rng.uniform(0.05, 0.3), rng.uniform(80, 250)
        across = rng.uniform(0.8, 1.2)
        self.inertia = 0.4 * m * self.R**2 * np.array([across, across, 1])
        self.mass = np.r_[m, m, m, self.inertia]
        lean = rng.uniform(0.1, 1)
        p = [np.cos(lean / 2), np.sin(lean / 2), 0, 0]
        self.q0 = np.r_[0, 0, self.R - self.offset * np.cos(lean), p]
        self.v0 = np.r_[0.1 * rng.normal(size=3), 2 * rng.normal(size=2), self.spin]
        self.v0[2] -= self.rows(self.q0)[1] @ self.v0  # it stays on the plane

    def force(self, t, q, v):
        return np.r_[0, 0, -self.mass[0] * G, -np.cross(v[3:], self.inertia * v[3:])]

    def rows(self, q):
        """The gap, its row, and those of the slip."""
        axes = turned(q[3:])
        arm = self.offset * axes[:, 2] - self.R * UP
        rows = [np.r_[d, axes.T @ np.cross(arm, d)] for d in np.eye(3)]
        return q[2] + arm[2], rows[2], np.array(rows[:2])

    def mechanism(self):
        def contacts(q):
            gap, normal, slip = self.rows(q)
            return [gap], [normal], slip

        return perp.Mechanism(
            6,
            mass=self.mass,
            force=self.force,
            contacts=contacts,
            mu=self.mu,
            coordinates=7,
            kinematics=kinematics,
            normalise=lambda q: np.r_[q[:3], q[3:] / np.linalg.norm(q[3:])],
        )

    def rate(self, t, y):
        q, v = y[:7], y[7:]
        _, normal, slip = self.rows(q)
        axes, u, free = turned(q[3:]), slip @ v, self.force(t, q, v) / self.mass
        spin = axes @ v[3:]
        bend = spin @ np.cross(self.offset * np.cross(spin, axes[:, 2]), UP)  # d/dt(normal) v
        response = (normal - self.mu * slip.T @ u / np.hypot(*u)) / self.mass
        load = -(normal @ free + bend) / (normal @ response)
        assert load > 0  # it stays on the plane
        return np.r_[kinematics(q, v), free + response * load]


@pytest.mark.parametrize("seed", range(3))
def test_a_tippe_top_has_the_second_order(seed):
    top, end = Top(np.random.default_rng(seed)), 0.05
    m = top.mechanism()
    run = integrate.solve_ivp(
        top.rate, (0, end), np.r_[top.q0, top.v0], method="DOP853", rtol=1e-11, atol=1e-12
    )
    slips = [np.hypot(*(top.rows(y[:7])[2] @ y[7:])) for y in run.y.T]
    size = np.r_[[top.R] * 3, [1] * 4, [0.5] * 3, [top.spin] * 3]
    assert min(slips) > 0.1  # it never sticks

    def off(h, error=0.0):
        told = m.simulate(top.q0, top.v0, end, h, scheme="theta", error=error)
        assert told.outcome == "solved"
        return np.abs((np.r_[told.q[-1], told.v[-1]] - run.y[:, -1]) / size).max()

    # half the step leaves a quarter of the error, up to terms of the third order
    assert np.log2(off(end / 50) / off(end / 100)) == pytest.approx(2, abs=0.05)
    for error in (1e-3, 1e-5):
        assert off(1e-3, error) < 10 * error
