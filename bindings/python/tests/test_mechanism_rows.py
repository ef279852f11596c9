"""What the functions of a mechanism may return, and where it goes."""

from collections import namedtuple

import numpy as np
import pytest
from test_mechanism import G, falling

import perp

Rows = namedtuple("Rows", "mu gap tangent normal")


@pytest.mark.parametrize(
    "answer",
    [
        (0.0, [0, 1], [1, 0], None, 0.3),
        ([0.0], [[0, 1]], [[1, 0]], [0.0], [0.3]),
        ([0.0], [[0, 1]], [[[1, 0]]], [0.0, 0.0], 0.3),
        {"gap": [0.0], "normal": [[0, 1]], "tangent": [[1, 0]], "mu": 0.3, "drift": [[0, 0]]},
        Rows(0.3, [0.0], [[1, 0]], [[0, 1]]),
        [np.float32([0]), np.array([[0, 1]], order="F"), np.int8([[1, 0]]), 0, 0.3],
    ],
)
def test_forms_of_contacts(answer):
    m = perp.Mechanism(2, force=[0, -1], contacts=lambda q: answer)
    r = m.step(0, [0, 0], [1, 0], 1.0)
    np.testing.assert_allclose(r.v, [0.7, 0], atol=1e-15)
    np.testing.assert_allclose(r.impulse, [1, -0.3], atol=1e-15)


def test_dimensions_may_differ():
    """A corner without friction on one side."""
    m = perp.Mechanism(
        3,
        force=[1, 0, -1],
        contacts=lambda q: ([-q[0], q[2]], [[-1, 0, 0], [0, 0, 1]], [[1, 0, 0], [0, 1, 0]]),
        dim=[1, 3],
        mu=[0, 0.25],
    )
    r = m.step(0, [0, 0, 0], [0, 1, 0], 1.0)
    np.testing.assert_allclose(r.v, [0, 0.75, 0], atol=1e-15)
    assert r.impulse.shape == (4,) and r.modes.shape == (2,) and m.rows.contacts == slice(0, 4)


def test_rows_of_all_kinds():
    m = perp.Mechanism(
        3,
        force=[3, -2, 5],
        contacts=lambda q: ([q[1]], [[0, 1, 0]]),
        bilateral=lambda t, q: ([q[2] - t], [[0, 0, 1]], [-1]),
        tresca=lambda t, q, v: ([1.0], [[1, 0, 0]]),
    )
    r = m.step(0, [0, 0, 0], [0, 0, 1], 0.5)
    np.testing.assert_allclose(r.v, [1, 0, 1], atol=1e-15)
    np.testing.assert_allclose(r.impulse, [1, -2.5, -0.5], atol=1e-15)
    np.testing.assert_allclose(r.impulse[m.rows.contacts], [1], atol=1e-15)
    assert m.rows == (slice(0, 1), slice(1, 2), slice(2, 3))
    assert r.modes.tolist() == ["stick", "slip"]  # contacts, then groups of tresca


def test_discs():
    m = perp.Mechanism(2, tresca=([0.5], np.eye(2)[None]))
    r = m.step(0, [0, 0], [3, 4], 1.0)
    np.testing.assert_allclose(r.v, [2.7, 3.6], atol=1e-14)
    strong = perp.Mechanism(2, tresca=(6, np.eye(2)))
    assert strong.step(0, [0, 0], [3, 4], 1.0).v.tolist() == [0, 0]


def test_no_contact_yet():
    m = perp.Mechanism(2, contacts=lambda q: ([], np.zeros((0, 2)), np.zeros((0, 2))))
    assert m.step(0, [0, 0], [1, 2], 0.5).q.tolist() == [0.5, 1.0]


@pytest.mark.parametrize("seed", range(8))
def test_rows_are_those_of_contact(seed):
    """A frozen step of random rows is one problem of perp.contact."""
    rng, n, h = np.random.default_rng(seed), 7, 0.1
    A, k, v = rng.normal(size=(n, n)), rng.normal(size=n), rng.normal(size=n)
    M, normal, tangent = A @ A.T + n * np.eye(n), rng.normal(size=(3, n)), rng.normal(size=(3, n))
    gap, drift, mu = rng.uniform(0, 0.1, 3), rng.normal(size=6), rng.uniform(0, 0.5, 3)
    gradient, speed = rng.normal(size=(1, n)), rng.normal(size=1)
    m = perp.Mechanism(
        n,
        mass=lambda q: M,
        force=lambda t, q, v: k,
        contacts=lambda q: (gap, normal, tangent, drift, mu),
        bilateral=lambda q: ([0.0], gradient, speed),
        dim=[1, 2, 3],
    )
    step = m.step(0, np.zeros(n), v, h, project=False)
    H = np.concatenate([normal[:2], tangent[:1], normal[2:], tangent[1:]])
    offset = drift + np.array([gap[0], gap[1], 0, gap[2], 0, 0]) / h
    load, joint = M @ v + h * k, (gradient, speed)
    r = perp.contact(M, load, H, offset, mu, dim=[1, 2, 3], bilateral=joint, tol=1e-10)
    assert step.ok and r.ok
    # residuals of 1e-10 beside numbers of about 1
    np.testing.assert_allclose(step.v, r.v, atol=1e-8)
    np.testing.assert_allclose(step.impulse[m.rows.contacts], r.impulse, atol=1e-7)
    np.testing.assert_allclose(step.impulse[m.rows.bilateral], r.bilateral_impulse, atol=1e-7)
    assert step.modes.tolist() == r.modes.tolist()


def test_sizes_that_are_given_are_not_looked_for():
    calls = []
    m = falling(
        contacts=lambda q: calls.append(q) or (q, [[1.0]]), contact_count=1, dim=1, check=False
    )
    r = m.step(0, [1], [0], 0.1)
    assert len(calls) == r.evaluations
    calls.clear()
    m = falling(contacts=lambda q: calls.append(q) or (q, [[1.0]]), check=False)
    assert m.rows.contacts == slice(0, 2)  # one contact of dimension 2 until it is known better
    r = m.step(0, [1], [0], 0.1)
    assert len(calls) == r.evaluations + 1 and m.rows.contacts == slice(0, 1)


def test_functions_may_keep_and_change_what_they_get():
    kept = []

    def force(t, q, v):
        kept.append((q, v))
        q[:], v[:] = 7, 7
        return [-G]

    run = falling(force=force).simulate([1], [0], 0.1, 0.01)
    assert run.q[-1] == pytest.approx(1 - G * 0.01 * 0.55)
    assert all(q == v == 7 for q, v in kept)
