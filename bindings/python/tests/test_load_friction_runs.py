"""Load-dependent friction with A, b, C, d of the state, run as a mechanism: the lines are those of
docs/friction.md (Runs)."""

import re
import textwrap
from pathlib import Path

import numpy as np
import pytest

import perp

integrate = pytest.importorskip("scipy.integrate")
PAGE = Path(__file__).parents[3] / "docs" / "friction.md"
if not PAGE.is_file():
    pytest.skip("the page is not installed", allow_module_level=True)


def load_mechanism(*arguments):
    block = re.search(r"\n( +def load_mechanism.*?\n)\n(?! )", PAGE.read_text("utf-8"), re.S)
    names = {"np": np, "perp": perp}
    exec(textwrap.dedent(block.group(1)), names)
    return names["load_mechanism"](*arguments)


class System:
    """Two coordinates, all functions of the state."""

    def __init__(self, rng, most, drive):
        B, self.C0 = rng.standard_normal((2, 2, 2)) * [[[1]], [[0.5]]]
        self.A0, self.w = B @ B.T + np.eye(2), rng.uniform(0.2, 0.5)
        self.d0 = rng.uniform(1, 2, 2) * rng.choice([-1, 1], 2)
        self.mu, self.drive = rng.uniform(0.05, most, 2), drive

    def A(self, q):
        return self.A0 + self.w * np.diag(np.cos(q))

    def b(self, q, v):
        return 0.3 * np.array([v[0] * v[1], -v[0] ** 2])

    def C(self, q):
        return self.C0 * (1 + 0.3 * np.sin(q[0]))

    def d(self, q, v):
        return self.d0 + 0.2 * v[::-1]

    def tau(self, t, q, v):
        return self.drive * np.array([np.sin(3 * t), np.cos(2 * t)]) - 0.3 * q

    def sliding(self, t, y):
        """Of the four signs of N, the one that fits: mu is small, there is no other."""
        q, v = y[:2], y[2:]
        for sign in ([1, 1], [1, -1], [-1, 1], [-1, -1]):
            D = np.diag(self.mu * np.sign(v) * sign)
            right = self.tau(t, q, v) - self.b(q, v) - D @ self.d(q, v)
            a = np.linalg.solve(self.A(q) + D @ self.C(q), right)
            if np.all((self.C(q) @ a + self.d(q, v)) * sign >= 0):
                return np.r_[v, a]
        raise AssertionError("no acceleration")

    def run(self, v0, end, error):
        m = load_mechanism(2, self.A, self.b, self.C, self.d, self.mu, self.tau)
        run = m.simulate([0] * 4, [*v0, 0, 0], end, 1e-2, scheme="theta", error=error)
        assert run.outcome == "solved" and np.all(run.q[:, 2:] == 0.0)
        return run


def test_runs_that_slide_have_the_error_asked():
    rng = np.random.default_rng(7)
    for _ in range(4):
        s = System(rng, 0.25, 1.0)
        v0 = rng.uniform(2.5, 4, 2) * rng.choice([-1, 1], 2)
        true = integrate.solve_ivp(
            s.sliding, (0, 0.5), [0, 0, *v0], method="DOP853", rtol=1e-10, atol=1e-11
        ).y[:, -1]
        assert np.all(true[2:] * v0 > 0)
        for error in (1e-4, 1e-6):
            run = s.run(v0, 0.5, error)
            off = np.abs(np.r_[run.q[-1, :2], run.v[-1, :2]] - true).max()
            assert off < error * np.abs(true).max()


def test_runs_through_rest_are_the_limit_of_load_friction_steps():
    """Steps of first order are late by about one: 3 h times the largest speed. With friction
    on the wrong side in one of the phases the difference is some tenths."""
    rng, h = np.random.default_rng(8), 5e-4
    rests = 0
    for _ in range(3):
        s = System(rng, 0.3, 3.0)
        v0 = rng.uniform(0.5, 1, 2) * rng.choice([-1, 1], 2)
        run = s.run(v0, 2.0, 1e-6)
        q, v, normal = np.zeros(2), v0, None
        friction = perp.LoadFriction(s.A(q), s.b(q, v), s.C(q), s.d(q, v), s.mu)
        for k in range(round(2.0 / h)):
            friction.update(s.A(q), s.b(q, v), s.C(q), s.d(q, v), s.mu)
            step = friction.step(v, s.tau((k + 1) * h, q, v), h, previous=normal)
            v, normal = step.velocity, step.normal_force
            q = q + h * v
        assert np.abs(q - run.q[-1, :2]).max() < 3 * h * np.abs(run.v).max()
        rests += np.any(run.modes == "stick")
    assert rests > 0
