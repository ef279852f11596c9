"""lcp_batch against lcp, problem by problem."""

import numpy as np
import pytest

import perp


def problems(k, n, seed=1):
    rng = np.random.default_rng(seed)
    A = rng.uniform(-1, 1, (k, n, n))
    return A @ A.transpose(0, 2, 1) / n + 0.1 * np.eye(n), rng.uniform(-1, 1, (k, n))


@pytest.mark.parametrize("threads", [1, 3])
def test_answers_are_those_of_lcp(threads):
    M, q = problems(50, 12)
    batch = perp.lcp_batch(M, q, threads=threads)
    assert len(batch) == 50 and batch.ok.all() and set(batch.outcomes) == {"solved"}
    for k in range(50):
        one = perp.lcp(M[k], q[k])
        # condition < 1e3: both are within 1e-12 of the solution
        np.testing.assert_allclose(batch.z[k], one.z, rtol=0, atol=1e-12)
        np.testing.assert_allclose(batch.w[k], M[k] @ batch.z[k] + q[k], rtol=0, atol=1e-14)
        assert np.array_equal(batch.z[k] == 0, one.z == 0)


def test_bounds_of_every_shape():
    M, q = problems(10, 4)
    a = perp.lcp_batch(M, q, -1, 0.5)
    b = perp.lcp_batch(M, q, np.full(4, -1.0), np.full((10, 4), 0.5))
    assert a.ok.all() and np.array_equal(a.z, b.z)
    assert a.z.min() >= -1 and a.z.max() <= 0.5
    for k in range(10):
        np.testing.assert_allclose(a.z[k], perp.lcp(M[k], q[k], -1, 0.5).z, rtol=0, atol=1e-12)


def test_outcomes_differ_from_problem_to_problem():
    M, q = problems(9, 3)
    M[4] = 0
    q[4] = [-1, 1, 1]
    batch = perp.lcp_batch(M, q)
    assert batch.ok.tolist() == [k != 4 for k in range(9)]
    assert batch.outcomes[4] == perp.lcp(M[4], q[4]).outcome != "solved"


def test_any_memory_order():
    M, q = problems(20, 6)
    plain = perp.lcp_batch(M, q)
    turned = perp.lcp_batch(np.asfortranarray(M), np.asfortranarray(q))
    assert np.array_equal(plain.z, turned.z)


def test_nothing():
    assert len(perp.lcp_batch(np.empty((0, 3, 3)), np.empty((0, 3)))) == 0
    assert perp.lcp_batch(np.empty((2, 0, 0)), np.empty((2, 0))).ok.all()


def test_a_time_limit():
    M, q = problems(20, 6)
    assert set(perp.lcp_batch(M, q, time_limit=1e-12).outcomes) == {"time_limit"}


@pytest.mark.parametrize(
    "change, words",
    [
        (dict(M=np.ones((2, 3))), "M has shape"),
        (dict(M=np.ones((2, 3, 4))), "M has shape"),
        (dict(q=np.ones((2, 4))), "q has shape"),
        (dict(lower=np.ones((3, 2))), "lower has shape"),
        (dict(lower=1.0, upper=0.0), "lower"),
        (dict(M=np.full((2, 3, 3), np.nan)), "M"),
        (dict(threads=0), "threads is 0"),
        (dict(threads=2**40), "threads is"),
        (dict(tol=-1.0), "tol"),
        (dict(time_limit=-1.0), "time_limit"),
    ],
)
def test_refusals(change, words):
    arguments = dict(M=np.ones((2, 3, 3)), q=np.ones((2, 3))) | change
    with pytest.raises(ValueError, match=words):
        perp.lcp_batch(**arguments)
