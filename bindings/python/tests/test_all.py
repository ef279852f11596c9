"""lcp_all: the solution sets of small problems, against brute force in rational arithmetic."""

import numpy as np
import pytest
import rational

import perp


def rounded(points):
    return frozenset(tuple(np.round(np.array(x, dtype=float), 7) + 0.0) for x in points)


@pytest.mark.parametrize(
    "n, count, bounded",
    [(1, 40, False), (2, 120, False), (3, 80, False), (4, 12, False), (1, 40, True), (2, 80, True)],
)
def test_solution_sets_are_exact(n, count, bounded):
    """Small integers make singular blocks and ties common: every polyhedron, every vertex and every
    ray is there, once, and nothing else."""
    rng = np.random.default_rng(n)
    families = 0
    for _ in range(count):
        size = int(rng.integers(1, 4))
        M = rng.integers(-size, size + 1, (n, n))
        if rng.random() < 0.3:
            A = rng.integers(-2, 3, (n, max(1, n - 1)))
            M = A @ A.T
        q = rng.integers(-size, size + 1, n)
        lower, upper = np.zeros(n), np.full(n, np.inf)
        if bounded:
            lower = rng.choice([-1.0, 0.0, -np.inf], n)
            width = rng.choice([0.0, 1.0, np.inf], n)
            upper = np.where(lower == -np.inf, 1.0, np.maximum(lower, -1.0) + width)
        case = M.tolist(), q.tolist(), lower.tolist(), upper.tolist()
        expected = [(rounded(v), rounded(r)) for v, r in rational.faces(*case)]
        found = perp.lcp_all(M, q, lower, upper)
        assert found.exhaustive and found.outcome == "solved"
        assert len(found) == len(expected), case
        for s in found:
            assert (rounded(s.vertices), rounded(s.rays)) in expected, case
            assert s.isolated == (s.dimension == 0) == (len(s.vertices) + len(s.rays) == 1)
            assert s.residual <= 1e-10
            np.testing.assert_allclose(s.w, M @ s.z + q, atol=1e-12)
            families += not s.isolated
    assert families > 0


def test_isolated_solutions_verify():
    """What is isolated and strictly complementary has a proof."""
    rng = np.random.default_rng(5)
    proved = 0
    for _ in range(20):
        M, q = rng.normal(size=(8, 8)) - 0.5 * np.eye(8), rng.normal(size=8) + 0.5
        for s in perp.lcp_all(M, q):
            assert s.isolated
            proof = perp.lcp_verify(M, q, s.z)
            assert proof, proof.reason
            proved += 1
    assert proved > 20


def test_family_of_a_redundant_table():
    """Four feet, one too many: the forces form a segment with the wrench in common."""
    feet = np.array([[1, 0.5], [1, -0.5], [-1, 0.5], [-1, -0.5]])
    G = np.vstack([np.ones(4), feet[:, 1], -feet[:, 0]])
    wrench = np.array([100.0, 10.0, -30.0])
    found = perp.lcp_all(G.T @ G, -G.T @ wrench)
    assert len(found) == 1 and found[0].dimension == 1 and len(found[0].vertices) == 2
    for force in (*found[0].vertices, found[0].z):
        np.testing.assert_allclose(G @ force, wrench, rtol=1e-12)
    assert (found[0].vertices.min(axis=1) == 0).all()  # each end has a foot in the air
    assert found[0].z.min() > 1


def test_bounds_and_storages():
    sparse = pytest.importorskip("scipy.sparse")
    M = np.array([[-1.0, 0.0], [0.0, 1.0]])
    for view in (M, sparse.csc_matrix(M), sparse.csr_matrix(M)):
        found = perp.lcp_all(view, [0.0, -3.0], lower=-1, upper=1)
        assert sorted(s.z[0] for s in found) == [-1.0, 0.0, 1.0]
        assert all(s.z[1] == 1.0 and s.places[1] == "upper" for s in found)
    assert found.nodes > 0 and found.bases >= 3 and found.seconds >= 0
    empty = perp.lcp_all(np.zeros((0, 0)), [])
    assert len(empty) == 1 and empty[0].z.shape == (0,)


def test_limits():
    M, q = -np.eye(10), np.ones(10)
    assert len(perp.lcp_all(M, q)) == 1024
    found = perp.lcp_all(M, q, max_iterations=50)
    assert not found.exhaustive and found.outcome == "iteration_limit" and found.nodes == 50
    assert perp.lcp_all(M, q, time_limit=1e-9).outcome == "time_limit"
    assert perp.lcp_all(M, q, monitor=lambda progress: True).outcome == "stopped"

    def fail(progress):
        raise KeyError("from the monitor")

    with pytest.raises(KeyError, match="from the monitor"):
        perp.lcp_all(M, q, monitor=fail)
    assert perp.lcp_all(np.eye(1), [1.0])[0].z == 0.0


@pytest.mark.parametrize(
    "arguments, words",
    [
        ({"M": np.ones((2, 3))}, "M has shape"),
        ({"M": np.eye(61), "q": np.zeros(61)}, "61 rows"),
        ({"q": [1.0, np.nan]}, "q[1] is nan"),
        ({"tol": 0.0}, "tol"),
        ({"max_iterations": 0}, "max_iterations"),
        ({"lower": 2.0, "upper": 1.0}, "lower[0]"),
    ],
)
def test_refusals(arguments, words):
    with pytest.raises(ValueError) as caught:
        perp.lcp_all(**{"M": np.eye(2), "q": [1.0, 1.0], **arguments})
    assert words in str(caught.value)
