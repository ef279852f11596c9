"""Arguments that make no sense: refused with the argument's name, and nothing else happens."""

import pickle

import numpy as np
import pytest

import perp

M = np.array([[2.0, 1.0], [0.0, 2.0]])
Q = np.array([-1.0, -1.0])
NAN, INF = float("nan"), float("inf")


def with_entry(array, index, value):
    changed = np.array(array, dtype=float)
    changed[index] = value
    return changed


@pytest.mark.parametrize(
    "arguments, words",
    [
        # shapes, told by this package
        ({"M": np.ones((2, 3))}, ["M", "(2, 3)", "(n, n)"]),
        ({"M": np.ones(4)}, ["M", "(4,)", "(n, n)"]),
        ({"M": np.ones((2, 2, 2))}, ["M", "(2, 2, 2)"]),
        ({"M": 1.0}, ["M", "()"]),
        ({"q": np.ones(3)}, ["q", "(3,)", "(2,)"]),
        ({"q": np.ones((2, 1))}, ["q", "(2, 1)"]),
        ({"q": 1.0}, ["q", "()"]),
        ({"lower": np.zeros(3)}, ["lower", "(3,)"]),
        ({"upper": np.ones((1, 2))}, ["upper", "(1, 2)"]),
        ({"z0": np.ones(1)}, ["z0", "(1,)"]),
        # kinds of numbers
        ({"M": M + 0j}, ["M", "complex"]),
        ({"q": Q + 0j}, ["q", "complex"]),
        ({"q": ["a", "b"]}, ["q"]),
        ({"q": [None, None]}, ["q"]),
        ({"M": [[1, 2], [3]]}, ["M"]),
        ({"q": np.ma.array(Q, mask=[True, False])}, ["q", "masked"]),
        # values, told by the library
        ({"M": with_entry(M, (1, 0), NAN)}, ["M", "1", "0", "nan"]),
        ({"M": with_entry(M, (0, 1), -INF)}, ["M", "inf"]),
        ({"q": [0.0, INF]}, ["q[1]", "inf"]),
        ({"lower": [0.0, NAN]}, ["lower[1]", "nan"]),
        ({"lower": [0.0, INF]}, ["lower[1]"]),
        ({"upper": [-INF, 1.0]}, ["upper[0]"]),
        ({"lower": [0.0, 2.0], "upper": [1.0, 1.0]}, ["lower[1]", "upper[1]"]),
        ({"lower": 1.0, "upper": 0.5}, ["lower[0]", "upper[0]"]),
        ({"z0": [NAN, 0.0]}, ["z0[0]", "nan"]),
        # settings
        ({"method": "newton"}, ["method", "'newton'", "'lemke'"]),
        ({"method": 3}, ["method", "3"]),
        ({"method": ["lemke"]}, ["method"]),
        ({"pivot_rule": "bland"}, ["pivot_rule", "'harris'"]),
        ({"tol": 0.0}, ["tol"]),
        ({"tol": NAN}, ["tol"]),
        ({"method": "polish"}, ["method", "'polish'", "'lemke'"]),
        ({"tol": "small"}, ["tol", "'small'", "a number"]),
        ({"max_iterations": 1.5}, ["max_iterations", "1.5"]),
        ({"time_limit": -1.0}, ["time_limit"]),
        ({"time_limit": 0.0}, ["time_limit"]),
        ({"time_limit": NAN}, ["time_limit"]),
        ({"max_iterations": -1}, ["max_iterations"]),
        ({"max_iterations": 0}, ["max_iterations"]),
        ({"max_iterations": 2**31}, ["max_iterations"]),
        ({"relaxation": 2.0}, ["relaxation"]),
        ({"M": -M, "method": "pgs"}, ["pgs"]),
    ],
)
def test_lcp_refuses(arguments, words):
    with pytest.raises(perp.Error) as caught:
        perp.lcp(**{"M": M, "q": Q, **arguments})
    error = caught.value
    assert isinstance(error, ValueError)
    assert error.status in (-1, -2)
    assert error.name in ("PERP_ERROR_ARGUMENT", "PERP_ERROR_NOT_FINITE")
    for word in words:
        assert word in str(error), str(error)
    # and the next call is not disturbed
    assert perp.lcp(M, Q).ok


def test_every_entry_that_is_not_finite_is_found():
    for i in range(2):
        for j in range(2):
            for order in "CF":
                bad = with_entry(M, (i, j), NAN).copy(order=order)
                with pytest.raises(ValueError, match=rf"\({i}, ?{j}\)"):
                    perp.lcp(bad, Q)


def test_sparse_refusals():
    sparse = pytest.importorskip("scipy.sparse")
    csc = sparse.csc_matrix(M)
    with pytest.raises(perp.Error, match=r"\(2, 3\)"):
        perp.lcp(sparse.csc_matrix((2, 3)), Q)
    with pytest.raises(perp.Error, match="complex"):
        perp.lcp(csc * 1j, Q)
    with pytest.raises(ValueError, match="nan"):
        perp.lcp(sparse.csc_matrix(with_entry(M, (0, 1), NAN)), Q)


class Columns:
    """A CSC matrix without SciPy's checks."""

    format = "csc"
    has_canonical_format = True

    def __init__(self, n, data, indices, indptr):
        self.shape, self.dtype = (n, n), np.dtype(float)
        self.data, self.indices, self.indptr = map(np.asarray, (data, indices, indptr))

    def tocsc(self):
        return self


@pytest.mark.parametrize(
    "matrix, words",
    [
        (Columns(2**31, [1.0], [0], [0, 1]), "32-bit"),
        (Columns(2, [1.0], np.array([2**31]), [0, 1, 1]), "32-bit"),
        (Columns(2, [1.0], [0], np.array([0, 1, 2**31 + 1])), "fewer than 2147483649"),
        (Columns(2, [1.0, 1.0], [0, 1], [0, 1]), "indptr has 2 entries, expected 3"),
        (Columns(2, [1.0], [0, 1], [0, 1, 2]), "fewer"),
        (Columns(2, [1.0, 1.0], [0], [0, 1, 2]), "fewer"),
        # told by the library, which must not be led out of the arrays
        (Columns(2, [1.0, 1.0], [0, 2], [0, 1, 2]), None),
        (Columns(2, [1.0, 1.0], [0, -1], [0, 1, 2]), None),
        (Columns(2, [1.0, 1.0], [1, 0], [0, 2, 2]), None),
        (Columns(2, [1.0, 1.0], [0, 0], [0, 2, 2]), None),
        (Columns(2, [1.0, 1.0], [0, 1], [1, 1, 2]), None),
        (Columns(2, [1.0, 1.0], [0, 1], [0, 3, 2]), None),
        (Columns(2, [1.0, 1.0], [0, 1], [0, 1, -1]), None),
    ],
)
def test_broken_columns(matrix, words):
    with pytest.raises(ValueError, match=words):
        perp.lcp(matrix, np.zeros(min(matrix.shape[0], 2)))


def test_unknown_keyword_is_a_type_error():
    with pytest.raises(TypeError):
        perp.lcp(M, Q, tolerance=1e-6)
    with pytest.raises(TypeError):
        perp.LCP(M, z0=Q)


def test_errors_know_their_kind():
    assert issubclass(perp.Error, Exception)
    error = perp.Error(-6, "inside another call")
    assert (error.status, error.name) == (-6, "PERP_ERROR_BUSY")
    assert str(error) == error.message == "inside another call"
    assert not isinstance(error, ValueError)
    memory = perp._errors.error(-3, "no more")
    assert isinstance(memory, perp.Error) and isinstance(memory, MemoryError)
    assert memory.name == "PERP_ERROR_MEMORY"
    again = pickle.loads(pickle.dumps(memory))
    assert (type(again), again.status, str(again)) == (type(memory), -3, "no more")


def test_closed_solver():
    problem = perp.LCP(M)
    problem.close()
    problem.close()
    with pytest.raises(perp.Error, match="closed") as caught:
        problem.solve(Q)
    assert caught.value.name == "PERP_ERROR_HANDLE"
    with pytest.raises(perp.Error, match="closed"):
        problem.setup(M)


@pytest.mark.parametrize(
    "arguments, words",
    [
        ({"f": np.ones((3, 1))}, ["f has shape (3, 1), expected (3,)"]),
        ({"f": None}, ["f has shape (), expected (3,)"]),
        ({"bounds": [0]}, ["bounds", "(lower, upper)"]),
        ({"bilateral": [1, 2, 3]}, ["bilateral", "(G, b)"]),
    ],
)
def test_contacts_of_other_shapes(arguments, words):
    with pytest.raises(perp.Error) as caught:
        perp.contact(**{"M": np.eye(3), "f": np.ones(3), "H": np.eye(3), "mu": 0.5, **arguments})
    assert all(word in str(caught.value) for word in words)
