"""lcp_verify: no claim is ever false, whatever the numbers; and most solutions get their proof."""

import itertools
from fractions import Fraction

import numpy as np
import pytest
import rational

import perp

INF = np.inf


def places_near(z, radii, lower, upper):
    """The index sets of solutions that can lie within the radii of z."""
    options = []
    for i in range(len(z)):
        words = []
        if abs(z[i] - lower[i]) <= radii[i] * 1.001:
            words.append("l")
        if lower[i] < upper[i] and abs(z[i] - upper[i]) <= radii[i] * 1.001:
            words.append("u")
        options.append(words + (["b"] if lower[i] < upper[i] else []))
    return itertools.product(*options)


def claim_is_true(M, q, lower, upper, z, proof):
    for places in places_near(z, proof.radii, lower, upper):
        s = rational.basic_solution(M, q, lower, upper, places)
        if s and all(abs(Fraction(a) - b) <= Fraction(r) for a, b, r in zip(z, s, proof.radii)):
            return True
    return False


def random_matrix(rng, n, kind):
    A = rng.normal(size=(n, n))
    if kind == "conditioned":  # up to 1e16
        Q, _ = np.linalg.qr(A)
        P, _ = np.linalg.qr(rng.normal(size=(n, n)))
        d = np.logspace(0, -rng.uniform(0, 16), n)
        return (Q * d) @ (Q.T if rng.random() < 0.7 else P)
    if kind == "hilbert":
        return 1 / (np.arange(n)[:, None] + np.arange(n) + 1.0)
    M = 0.3 * A @ A.T + A - A.T + 0.01 * np.eye(n)
    if kind == "scaled":
        d = np.exp2(rng.integers(-200, 200, n))
        return d[:, None] * M * d
    return M


def random_problem(rng, kind):
    n = int(rng.integers(1, 7))
    M = random_matrix(rng, n, kind)
    z = np.maximum(rng.normal(size=n), 0)
    w = np.where(z > 0, 0, rng.random(n)) * (rng.random(n) < 0.9)
    lower, upper = np.zeros(n), np.full(n, INF)
    if rng.random() < 0.5:
        k = rng.integers(0, 4, n)
        upper = np.where(k == 0, z + rng.random(n), upper)
        lower = np.where(k == 1, -INF, lower)
        upper = np.where(k == 2, z, upper)
    return M, w - M @ z, lower, upper


@pytest.mark.parametrize("kind", ["plain", "conditioned", "hilbert", "scaled"])
def test_claims_are_true(kind):
    rng = np.random.default_rng(len(kind))
    claims = 0
    for _ in range(100):
        M, q, lower, upper = random_problem(rng, kind)
        z = perp.lcp(M, q, lower, upper).z
        if rng.random() < 0.3:
            z = z + rng.normal(size=len(z)) * 10 ** rng.uniform(-17, -1) * np.abs(z).max()
        proof = perp.lcp_verify(M, q, z, lower, upper)
        if proof:
            claims += 1
            assert proof.radius == max(proof.radii) and proof.reason is None
            assert claim_is_true(M, q, lower, upper, z, proof)
        else:
            assert proof.radius is None and proof.radii is None
            assert proof.reason in ("not a solution", "singular", "degenerate")
    assert claims > 50


def test_near_ties_are_not_claimed():
    """z9 of a Hilbert system is known to ten digits; another row asks on which side of a number it
    lies that differs in the last."""
    n, verdicts = 12, []
    H = random_matrix(np.random.default_rng(0), n, "hilbert")
    q = -H.sum(axis=0)
    s = rational.solve(H, -q)
    for shift in (-(2**30), -(2**20), -64, -8, -1, 1, 8, 64, 2**20):
        number = float(s[8]) + shift * 2.0**-52
        M = np.zeros((n + 1, n + 1))
        M[:n, :n], M[n, 8], M[n, n] = H, 1.0, 1.0
        z = np.append([float(x) for x in s], 0.0)
        z[8] += 1e-6  # w = z9 - number > 0 at z13 = 0 is what z shows
        proof = perp.lcp_verify(M, np.append(q, -number), z)
        verdicts.append(proof.reason)
        if proof:
            assert number <= s[8] and proof.radius >= 9e-7
            assert all(abs(Fraction(a) - b) <= Fraction(r)
                       for a, b, r in zip(z, s, proof.radii))
        if proof.reason == "not a solution":
            assert number > s[8]
    assert verdicts[0] is None and verdicts[-1] == "not a solution"  # far from the tie
    assert verdicts[2:8] == ["degenerate"] * 6


def test_reasons():
    M = np.array([[2.0, 1.0], [1.0, 2.0]])
    proof = perp.lcp_verify(M, [-3, -3], [1, 1])
    assert proof and proof.radius < 1e-25 and proof.reason is None and proof.index is None
    proof = perp.lcp_verify(M, [-2, -1], [1, 0])
    assert not proof and (proof.reason, proof.index) == ("degenerate", 1)
    proof = perp.lcp_verify(np.ones((2, 2)), [-1, -1], [0.5, 0.5])
    assert (proof.reason, proof.index, proof.radius) == ("singular", None, None)
    proof = perp.lcp_verify([[0, -1], [-1, 0]], [-1, -1], [0.5, 0.5])
    assert (proof.reason, proof.index) == ("not a solution", 0)


def test_storages_and_scalar_bounds():
    sparse = pytest.importorskip("scipy.sparse")
    M = np.array([[4.0, 1.0, 0.0], [-1.0, 4.0, 1.0], [0.0, -1.0, 4.0]])
    q = np.array([-3.0, 7.0, -9.0])
    z = perp.lcp(M, q, -1, 1).z
    expected = perp.lcp_verify(M, q, z, -1, 1).radius
    for view in (np.asfortranarray(M), sparse.csc_matrix(M), sparse.csr_array(M), M.tolist()):
        assert perp.lcp_verify(view, q, z, -1, 1).radius == pytest.approx(expected, abs=1e-25)


@pytest.mark.parametrize(
    "arguments, words",
    [
        ({"M": np.ones((2, 3))}, "M has shape"),
        ({"q": [1.0]}, "q has shape"),
        ({"z": [1.0, 2.0, 3.0]}, "z has shape"),
        ({"z": [np.nan, 2.0]}, "z[0] is nan"),
        ({"q": [0.0, np.inf]}, "q[1] is inf"),
        ({"lower": 2.0, "upper": 1.0}, "lower[0]"),
    ],
)
def test_refusals(arguments, words):
    good = {"M": np.eye(2), "q": [1.0, 1.0], "z": [0.0, 0.0]}
    with pytest.raises(ValueError) as caught:
        perp.lcp_verify(**{**good, **arguments})
    assert words in str(caught.value)
