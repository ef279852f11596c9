"""Every storage order and sparse format reads the same M, and what can be read in place is."""

import numpy as np
import pytest
from check import assert_solves

import perp
from perp import _arrays, _generated, _structures

sparse = pytest.importorskip("scipy.sparse")

# Unsymmetric, and so that M' has another solution: reading it transposed does not go unnoticed.
M = np.array(
    [
        [4.0, -2.0, 0.0, 1.0],
        [0.0, 3.0, 0.0, -1.0],
        [1.0, 2.0, 5.0, 0.0],
        [-3.0, 0.0, 0.5, 6.0],
    ]
)
Q = np.array([-1.0, 2.0, -3.0, -4.0])


def strided(array, down, right):
    """The array as a view of a larger one, with steps of `down` rows and `right` columns."""
    n = len(array)
    large = np.full((n * abs(down), n * abs(right)), np.nan)
    view = large[::down, ::right]
    view[...] = array
    return view


DENSE = {
    "rows": M.copy(order="C"),
    "columns": M.copy(order="F"),
    "transposed view": M.T.copy().T,
    "rows, padded": np.pad(M, ((0, 1), (0, 3)), constant_values=np.nan)[:4, :4],
    "columns, padded": np.asfortranarray(np.pad(M, 2, constant_values=np.nan))[2:6, 2:6],
    "every other row": strided(M, 2, 1),
    "every other column": strided(M, 1, 2),
    "steps both ways": strided(M, 3, 2),
    "rows backwards": strided(M, -1, 1),
    "columns backwards": strided(M, 1, -1),
    "list": M.tolist(),
    "single precision": M.astype(np.float32),
    "big-endian": M.astype(">f8"),
    "extended precision": M.astype(np.longdouble),
    "objects": M.astype(object),
    "misaligned": np.frombuffer(b"?" + M.tobytes(), offset=1).reshape(4, 4),
    "inside records": np.rec.fromarrays([M, M])["f1"],
}


def read_only(array):
    array.setflags(write=False)
    return array


DENSE["read-only"] = read_only(M.copy())
DENSE["read-only columns"] = read_only(M.copy(order="F"))


def test_the_problem_tells_transposed_matrices_apart():
    assert not np.allclose(perp.lcp(M, Q).z, perp.lcp(M.T.copy(), Q).z)


@pytest.mark.parametrize("name", DENSE)
@pytest.mark.parametrize("method", ["lemke", "pgs", "fischer"])
def test_dense(name, method):
    result = perp.lcp(DENSE[name], Q, method=method)
    assert_solves(result, M, Q)
    # the same numbers in another order of memory may be added in another order
    np.testing.assert_allclose(result.z, perp.lcp(M, Q, method="lemke").z, rtol=0, atol=1e-9)


@pytest.mark.parametrize("name", DENSE)
def test_transposed_view_is_another_matrix(name):
    if isinstance(DENSE[name], list):
        return
    result = perp.lcp(DENSE[name].T, Q)
    assert_solves(result, M.T, Q)


def seen(matrix):
    """Where the library would look for M, and how."""
    view = _structures.sized(_generated.Matrix)
    owner = _arrays.view(view, matrix)[2]
    return view, owner


@pytest.mark.parametrize(
    "name, storage, leading_dimension",
    [
        ("rows", 1, 4),
        ("columns", 0, 4),
        ("transposed view", 0, 4),
        ("rows, padded", 1, 7),
        ("columns, padded", 0, 8),
        ("every other row", 1, 8),
        ("read-only", 1, 4),
        ("read-only columns", 0, 4),
    ],
)
def test_dense_read_in_place(name, storage, leading_dimension):
    view, owner = seen(DENSE[name])
    assert view.values == DENSE[name].__array_interface__["data"][0]
    assert (view.storage, view.leading_dimension) == (storage, leading_dimension)
    assert owner is DENSE[name]


@pytest.mark.parametrize("name", DENSE)
def test_addresses_are_aligned(name):
    view, owner = seen(DENSE[name])
    assert view.values % np.dtype(float).alignment == 0
    assert owner.dtype == np.float64 and owner.dtype.isnative


@pytest.mark.parametrize(
    "matrix",
    [
        np.broadcast_to(2.0, (3, 3)),  # steps of zero
        np.lib.stride_tricks.as_strided(np.arange(5.0), (3, 3), (8, 8)),  # overlapping rows
        np.lib.stride_tricks.as_strided(np.arange(9.0), (3, 3), (16, 8)),
    ],
)
def test_overlapping_views_are_copied(matrix):
    owner = seen(matrix)[1]
    assert not np.shares_memory(owner, matrix)
    np.testing.assert_array_equal(owner, matrix)


def sparse_matrices():
    csc = sparse.csc_array(M)
    unsorted = csc.copy()
    for j in range(4):
        part = slice(unsorted.indptr[j], unsorted.indptr[j + 1])
        unsorted.indices[part] = unsorted.indices[part][::-1].copy()
        unsorted.data[part] = unsorted.data[part][::-1].copy()
    unsorted = sparse.csc_array((unsorted.data, unsorted.indices, unsorted.indptr), shape=(4, 4))
    rows, columns = np.nonzero(M)
    twice = np.concatenate
    halves = sparse.coo_array(
        (twice([M[rows, columns] / 2] * 2), (twice([rows] * 2), twice([columns] * 2))), shape=(4, 4)
    )
    pointers = np.array([0, 8, 16, 24, 32])
    double = sparse.csc_array(
        (np.repeat(M.T.ravel() / 2, 2), np.repeat(np.tile(np.arange(4), 4), 2), pointers),
        shape=(4, 4),
    )
    long = csc.copy()
    long.indices, long.indptr = long.indices.astype(np.int64), long.indptr.astype(np.int64)
    return {
        "csc": csc,
        "csc matrix": sparse.csc_matrix(M),
        "csr": sparse.csr_array(M),
        "coo": sparse.coo_array(M),
        "bsr": sparse.bsr_array(M, blocksize=(2, 2)),
        "dia": sparse.dia_array(M),
        "lil": sparse.lil_array(M),
        "dok": sparse.dok_array(M),
        "unsorted": unsorted,
        "duplicates in coo": halves,
        "duplicates in csc": double,
        "64-bit indices": long,
        "single precision": sparse.csc_array(M.astype(np.float32)),
        "integers": sparse.csc_array((M * 2).astype(int)) / 2,
        "transposed view": sparse.csr_array(M.T).T,
    }


@pytest.mark.parametrize("name", sparse_matrices())
@pytest.mark.parametrize("method", ["lemke", "pgs", "fischer"])
def test_sparse(name, method):
    matrix = sparse_matrices()[name]
    result = perp.lcp(matrix, Q, method=method)
    assert_solves(result, M, Q)
    np.testing.assert_allclose(result.z, perp.lcp(M, Q, method="lemke").z, rtol=0, atol=1e-9)


@pytest.mark.parametrize("name", ["csc", "csc matrix", "transposed view"])
def test_canonical_csc_is_read_in_place(name):
    matrix = sparse_matrices()[name]
    view, _ = seen(matrix)
    assert view.storage == 2
    for pointer, array in (
        (view.values, matrix.data),
        (view.column_starts, matrix.indptr),
        (view.row_indices, matrix.indices),
    ):
        assert array.dtype in (np.float64, np.int32)
        assert pointer == array.__array_interface__["data"][0]


@pytest.mark.parametrize("name", sparse_matrices())
def test_the_callers_matrix_is_left_alone(name):
    matrix, again = sparse_matrices()[name], sparse_matrices()[name]
    perp.lcp(matrix, Q)
    if matrix.format == "csc":
        np.testing.assert_array_equal(matrix.indices, again.indices)
        np.testing.assert_array_equal(matrix.indptr, again.indptr)
        np.testing.assert_array_equal(matrix.data, again.data)
    np.testing.assert_array_equal(matrix.toarray(), again.toarray())


def test_unpruned_csc():
    """Arrays longer than the matrix uses, as scipy leaves them after eliminate_zeros."""
    csc = sparse.csc_array(M)
    matrix = sparse.csc_array((4, 4))
    matrix.indptr = csc.indptr
    matrix.indices = np.append(csc.indices, [9, 9]).astype(np.int32)
    matrix.data = np.append(csc.data, [np.nan, np.nan])
    assert_solves(perp.lcp(matrix, Q), M, Q)


def test_duck_typed_sparse_matrix():
    """Something that is not SciPy's but can make a CSC matrix."""

    class Mine:
        shape, dtype = (4, 4), np.dtype(float)

        def tocsc(self):
            return sparse.csc_matrix(M)

    assert_solves(perp.lcp(Mine(), Q), M, Q)


@pytest.mark.parametrize("order", ["C", "F"])
def test_q_and_bounds_of_any_stride(order):
    wide = np.zeros((4, 3), order=order)
    wide[:, 1] = Q
    low = np.array([9, -1, 9, -1, 9, -1, 9, -1.0])[1::2]
    result = perp.lcp(M, wide[:, 1], low, low[::-1] + 3)
    assert_solves(result, M, Q, -1.0, 2.0)
    assert_solves(perp.lcp(M, Q.astype(np.float32), z0=[1, 1, 1, 1]), M, Q)
