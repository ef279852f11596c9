"""What an answer must satisfy, computed here from the problem and nothing the library said."""

import numpy as np

EPS = 2.0**-52


def natural_residual(M, q, z, lower=None, upper=None):
    """max |mid(z - l, z - u, w)| with w = M z + q."""
    n = len(q)
    z = np.asarray(z)
    low = np.broadcast_to(0.0 if lower is None else lower, n)
    high = np.broadcast_to(np.inf if upper is None else upper, n)
    w = np.asarray(M @ z).ravel() + q
    middle = np.sort([z - low, z - high, w], axis=0)[1]
    return np.abs(middle).max(initial=0.0)


def tolerance(M, q, z, lower=None, upper=None):
    """The rounding of w computed in double precision: n + 1 roundings of each row's terms."""
    M = M.toarray() if hasattr(M, "toarray") else np.asarray(M)
    return (len(q) + 2) * EPS * (np.abs(M) @ np.abs(z) + np.abs(q)).max(initial=0.0)


def assert_solves(result, M, q, lower=None, upper=None, tol=1e-10):
    """The result is ok, within its bounds, and its residual is what we find, too."""
    q = np.asarray(q, dtype=float)
    M = M if hasattr(M, "toarray") else np.asarray(M, dtype=float)
    assert result.ok, result
    assert result.outcome in ("solved", "rounding_limit")
    assert result.z.shape == result.w.shape == q.shape
    assert result.z.dtype == result.w.dtype == np.float64
    assert np.all(result.z >= (0.0 if lower is None else lower))
    assert np.all(result.z <= (np.inf if upper is None else upper))
    slack = tolerance(M, q, result.z)
    found = natural_residual(M, q, result.z, lower, upper)
    assert abs(found - result.natural_residual) <= slack
    # tol is relative to the scale of q; that scale is a power of two within 2 of max |q|
    assert found <= tol * 2 * max(np.abs(q).max(initial=0.0), 1e-300) * np.abs(M).max() + slack
    np.testing.assert_allclose(result.w, np.asarray(M @ result.z).ravel() + q, rtol=0, atol=slack)
