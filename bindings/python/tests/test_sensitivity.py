"""lcp_sensitivity: derivatives against differences of exact solutions, adjoints, verdicts."""

from fractions import Fraction

import numpy as np
import pytest
import rational

import perp

INF = np.inf
LETTERS = {"lower": "l", "upper": "u", "between": "b", "fixed": "l"}


def random_problem(rng, n):
    """A strictly complementary problem with every kind of place; its solution; its index set."""
    A = rng.normal(size=(n, n))
    M = 0.3 * A @ A.T + A - A.T + 0.1 * np.eye(n)
    kind = rng.integers(0, 5, n)  # lower, upper, between with bounds, free, fixed
    lower = np.where(kind == 3, -INF, rng.normal(size=n))
    upper = np.where(kind == 3, INF, np.where(kind == 4, lower, lower + 1 + rng.random(n)))
    z = np.where(kind == 0, lower, np.where(kind == 1, upper, 0.0))
    z = np.where(kind == 2, lower + 0.5, np.where(kind == 3, rng.normal(size=n), z))
    z = np.where(kind == 4, lower, z)
    push = 0.5 + rng.random(n)
    w = np.where(kind == 0, push, np.where(kind == 1, -push, np.where(kind == 4, push - 1, 0.0)))
    places = np.array(["lower", "upper", "between", "between", "fixed"])[kind]
    return M, w - M @ z, lower, upper, perp.lcp(M, w - M @ z, lower, upper).z, places


def exact_solution(M, q, lower, upper, places):
    return rational.basic_solution(M, q, lower, upper, [LETTERS[p] for p in places])


def moved(array, change, t):
    """array + t change, without rounding; infinite bounds stay."""
    flat = [
        a if not np.isfinite(a) else Fraction(a) + t * Fraction(b)
        for a, b in zip(np.ravel(array), np.ravel(change))
    ]
    n = len(array)
    return [flat[n * i : n * i + n] for i in range(n)] if np.ndim(array) == 2 else flat


def test_forward_is_the_derivative_of_exact_solutions():
    """Central differences of rational solutions: no rounding, the error is t**2 |z'''| / 6."""
    rng = np.random.default_rng(1)
    t = Fraction(1, 2**30)
    for _ in range(30):
        n = int(rng.integers(1, 6))
        M, q, lower, upper, z, places = random_problem(rng, n)
        s = perp.lcp_sensitivity(M, q, z, lower, upper)
        assert s.differentiable and s.reason is None and s.index is None
        assert list(s.places) == list(places)
        dq, dlower, dupper = rng.normal(size=(3, n))
        dM = rng.normal(size=(n, n))
        plus, minus = (
            exact_solution(
                moved(M, dM, u),
                moved(q, dq, u),
                moved(lower, dlower, u),
                [
                    b if places[i] != "fixed" else a
                    for i, (a, b) in enumerate(
                        zip(moved(lower, dlower, u), moved(upper, dupper, u))
                    )
                ],
                places,
            )
            for u in (t, -t)
        )
        expected = np.array([float((a - b) / (2 * t)) for a, b in zip(plus, minus)])
        dz = s.forward(dq, dM, dlower, dupper)
        np.testing.assert_allclose(dz, expected, rtol=0, atol=1e-9 * np.abs(expected).max())


def test_adjoints_are_transposes():
    rng = np.random.default_rng(2)
    for _ in range(30):
        n = int(rng.integers(1, 12))
        M, q, lower, upper, z, _ = random_problem(rng, n)
        s = perp.lcp_sensitivity(M, q, z, lower, upper)
        dq, dlower, dupper, g = rng.normal(size=(4, n))
        dM = rng.normal(size=(n, n))
        low, high = s.adjoint_bounds(g)
        forward = g @ s.forward(dq, dM, dlower, dupper)
        backward = s.adjoint(g) @ dq + np.sum(s.adjoint_matrix(g) * dM) + low @ dlower
        assert backward + high @ dupper == pytest.approx(forward, rel=1e-8, abs=1e-10)


def test_sparse_gradient_has_the_pattern():
    sparse = pytest.importorskip("scipy.sparse")
    M = sparse.csr_matrix(np.array([[2.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 2.0]]))
    z = perp.lcp(M, [-1.0, 1.0, -1.0]).z
    s = perp.lcp_sensitivity(M, [-1.0, 1.0, -1.0], z)
    g = np.array([1.0, 2.0, 3.0])
    gradient = s.adjoint_matrix(g, pattern=M)
    assert sparse.issparse(gradient) and gradient.nnz == M.nnz
    dense = s.adjoint_matrix(g)
    np.testing.assert_array_equal(gradient.toarray(), np.where(M.toarray() != 0, dense, 0))
    np.testing.assert_allclose(dense, np.outer(s.adjoint(g), z))


def test_reasons():
    M = np.array([[2.0, 1.0], [1.0, 2.0]])
    s = perp.lcp_sensitivity(M, [-2, -1], [1, 0])
    assert not s.differentiable
    assert (s.reason, s.index, s.margin) == ("degenerate", 1, 0.0)
    np.testing.assert_allclose(s.forward([1.0, 0.0]), [-0.5, 0.0])
    s = perp.lcp_sensitivity(np.ones((2, 2)), [-1, -1], [0.5, 0.5])
    assert s.reason == "singular" and s.condition > 1e15
    with pytest.raises(ValueError, match="singular"):
        s.adjoint([1.0, 1.0])
    s = perp.lcp_sensitivity(M, [-3, -3], [0.5, 0.5])
    assert s.reason == "not a solution"
    with pytest.raises(ValueError, match="not a solution"):
        s.forward([1.0, 1.0])


def test_refusals_and_closing():
    M = np.eye(2)
    for arguments, words in (
        ((M, [1.0], [0.0, 0.0]), "q has shape"),
        ((M, [1.0, 1.0], [0.0, np.nan]), r"z\[1\]"),
        ((np.ones((2, 3)), [1.0, 1.0], [0.0, 0.0]), "M has shape"),
    ):
        with pytest.raises(ValueError, match=words):
            perp.lcp_sensitivity(*arguments)
    with pytest.raises(ValueError, match="tol"):
        perp.lcp_sensitivity(M, [1.0, 1.0], [0.0, 0.0], tol=-1.0)
    with perp.lcp_sensitivity(M, [-1.0, 1.0], [1.0, 0.0]) as s:
        with pytest.raises(ValueError, match="dq has shape"):
            s.forward([1.0, 2.0, 3.0])
        with pytest.raises(ValueError, match="dM is 3 by 3"):
            s.forward(dM=np.eye(3))
        with pytest.raises(ValueError, match="pattern"):
            s.adjoint_matrix([1.0, 1.0], pattern=np.eye(2))
        np.testing.assert_array_equal(s.forward(), [0.0, 0.0])
    with pytest.raises(perp.Error, match="closed"):
        s.adjoint([1.0, 1.0])


def test_equations_that_methods_turn_round_stay_as_they_are():
    """[H A'; A 0] with free multipliers: derivatives against differences of solutions, whose third
    derivatives are 0 as long as the index set stays; and w of all solutions."""
    rng = np.random.default_rng(3)
    for _ in range(20):
        B, A = rng.normal(size=(5, 5)), rng.normal(size=(2, 5))
        M = np.block([[B @ B.T + np.eye(5), A.T], [A, np.zeros((2, 2))]])
        x = np.where(np.arange(5) < 3, 1.0, 0.0) * rng.uniform(1, 2, 5)
        z = np.r_[x, rng.normal(size=2)]
        q = np.r_[np.where(x > 0, 0.0, 1.0), 0.0, 0.0] - M @ z
        lower, upper = np.r_[np.zeros(5), -INF, -INF], np.full(7, INF)
        s = perp.lcp_sensitivity(M, q, z, lower, upper)
        dq, t = rng.normal(size=7), 1e-5
        ends = [perp.lcp(M, q + side * dq, lower, upper) for side in (t, -t)]
        assert all(end.ok for end in ends)
        change = (ends[0].z - ends[1].z) / (2 * t)
        # of roundings: 1e-15 of z over t, by conditions up to 100
        np.testing.assert_allclose(s.forward(dq), change, rtol=0, atol=1e-8)
        g = rng.normal(size=7)
        assert s.adjoint(g) @ dq == pytest.approx(g @ change, abs=1e-8)
        (only,) = perp.lcp_all(M, q + t * dq, lower, upper)
        np.testing.assert_allclose(only.w, M @ only.z + q + t * dq, rtol=0, atol=1e-13)
