"""From what the caller has to what the library reads: vectors, dense and sparse matrices."""

from __future__ import annotations

from ctypes import addressof, c_char, pointer, sizeof, string_at
from math import prod
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._errors import argument_error
from ._generated import CONSTANTS, LcpProblem, Matrix

COLUMN_MAJOR = CONSTANTS["PERP_STORAGE_COLUMN_MAJOR"]
ROW_MAJOR = CONSTANTS["PERP_STORAGE_ROW_MAJOR"]
CSC = CONSTANTS["PERP_STORAGE_CSC"]
INT32_MAX = 2**31 - 1

_float64 = np.dtype(np.float64)
_item = _float64.itemsize


def address(array: NDArray[Any]) -> int:
    """Where an array's data are. The short way round, where there is one, costs a quarter of
    array.ctypes.data."""
    memory: Any = array
    try:
        return addressof(c_char.from_buffer(memory))
    except (TypeError, ValueError, BufferError):  # read-only, empty, or not C-contiguous
        return array.ctypes.data


def optional(array: NDArray[Any] | None) -> int | None:
    """Where the data are of an array that may be left out."""
    return None if array is None else address(array)


def lcp_problem(
    matrix: Matrix,
    q: NDArray[Any],
    lower: NDArray[Any] | None,
    upper: NDArray[Any] | None,
) -> LcpProblem:
    """A problem as calls take it; the arrays have to outlive it."""
    return LcpProblem(
        sizeof(LcpProblem), pointer(matrix), address(q), optional(lower), optional(upper)
    )


def copied(address: int | None, size: int) -> bytes:
    """So many bytes of the library's; zeros where it has none."""
    return string_at(address, size) if address else bytes(size)


def read(address: int | None, *shape: int) -> NDArray[np.float64]:
    """A copy of an array of the library's."""
    return np.frombuffer(bytearray(copied(address, 8 * prod(shape)))).reshape(shape)


def read_codes(address: int | None, count: int) -> NDArray[np.int32]:
    """The same of codes."""
    return np.frombuffer(copied(address, 4 * count), dtype=np.int32)


def real(value: Any, name: str) -> NDArray[np.float64]:
    """Returns value as an array of float64, itself if it is one."""
    if type(value) is np.ndarray and value.dtype is _float64 and value.flags.aligned:
        return value
    if isinstance(value, np.ma.MaskedArray) and np.ma.is_masked(value):
        raise argument_error(f"{name} has masked entries")
    try:
        array = np.asarray(value)
        if array.dtype.kind != "c":
            return np.require(array, dtype=_float64, requirements="A")
    except (TypeError, ValueError) as error:
        raise argument_error(f"{name} is not an array of numbers: {error}") from None
    raise argument_error(f"{name} is complex")


def vector(value: Any, name: str, n: int) -> NDArray[np.float64]:
    """Returns value as n contiguous float64, itself where it is that."""
    array = real(value, name)
    if array.shape != (n,):
        raise argument_error(f"{name} has shape {array.shape}, expected ({n},)")
    return np.ascontiguousarray(array)


def bound(value: Any, name: str, n: int) -> NDArray[np.float64] | None:
    """As spread(); None for the default."""
    return None if value is None else spread(value, name, n)


def spread(value: Any, name: str, n: int) -> NDArray[np.float64]:
    """As vector(); a scalar stands for n of its kind."""
    array = real(value, name)
    return np.full(n, array) if array.ndim == 0 else vector(array, name, n)


def _check_rectangle(shape: tuple[int, ...], name: str) -> tuple[int, int]:
    if len(shape) != 2:
        raise argument_error(f"{name} has shape {tuple(shape)}, expected (rows, columns)")
    if max(shape) > INT32_MAX:
        raise argument_error(f"{name} has shape {tuple(shape)}, more than 32-bit indices number")
    return shape[0], shape[1]


def _check_square(shape: tuple[int, ...]) -> int:
    if len(shape) != 2 or shape[0] != shape[1]:
        raise argument_error(f"M has shape {tuple(shape)}, expected (n, n)")
    if shape[0] > INT32_MAX:
        raise argument_error(f"M has {shape[0]} rows, more than a 32-bit index can number")
    return shape[0]


def is_sparse(value: Any) -> bool:
    """Tells SciPy's matrices and arrays, and what behaves like them, without importing SciPy."""
    return type(value) is not np.ndarray and hasattr(value, "tocsc") and hasattr(value, "shape")


def view(matrix: Matrix, M: Any) -> tuple[int, int, Any]:
    """Points `matrix` at the square matrix M.

    Returns the number of rows, the number of stored entries, and what owns the memory, to be kept
    as long as the view is used.
    """
    if is_sparse(M):
        n = _check_square(M.shape)
        return n, *_view_sparse(matrix, M, "M")
    array = real(M, "M")
    n = _check_square(array.shape)
    return n, *_view_array(matrix, array, n, n)


def view_rectangle(matrix: Matrix, A: Any, name: str) -> tuple[int, Any]:
    """Points `matrix` at the matrix A. Returns the number of stored entries and what owns the
    memory."""
    return _view_sparse(matrix, A, name) if is_sparse(A) else _view_dense(matrix, A, name)


def _view_dense(matrix: Matrix, A: Any, name: str) -> tuple[int, Any]:
    array = real(A, name)
    return _view_array(matrix, array, *_check_rectangle(array.shape, name))


def _view_array(
    matrix: Matrix, array: NDArray[np.float64], rows: int, columns: int
) -> tuple[int, Any]:
    down, right = array.strides
    if rows <= 1 and columns <= 1:
        storage, step = COLUMN_MAJOR, _item
    elif right == _item and down >= _item * max(columns, 1) and down % _item == 0:
        storage, step = ROW_MAJOR, down
    elif down == _item and right >= _item * max(rows, 1) and right % _item == 0:
        storage, step = COLUMN_MAJOR, right
    else:
        array = np.asfortranarray(array)
        storage, step = COLUMN_MAJOR, _item * max(rows, 1)
    matrix.storage = storage
    matrix.rows, matrix.columns = rows, columns
    matrix.leading_dimension = step // _item
    matrix.values = address(array)
    matrix.column_starts = matrix.row_indices = None
    return rows * columns, array


def _view_sparse(matrix: Matrix, A: Any, name: str) -> tuple[int, Any]:
    shape = _check_rectangle(A.shape, name)
    if np.dtype(A.dtype).kind == "c":
        raise argument_error(f"{name} is complex")
    csc = A.tocsc()
    if not csc.has_canonical_format:
        csc = csc.copy() if csc is A or np.shares_memory(csc.data, A.data) else csc
        csc.sum_duplicates()  # sorts, too
    if len(csc.indptr) != shape[1] + 1:
        raise argument_error(
            f"{name}.indptr has {len(csc.indptr)} entries, expected {shape[1] + 1}"
        )
    entries = int(csc.indptr[-1])
    if min(len(csc.indices), len(csc.data)) < entries:
        raise argument_error(f"{name} has fewer than {entries} indices or values")
    starts = _indices(csc.indptr, f"{name}.indptr")
    rows = _indices(csc.indices, f"{name}.indices")
    values = np.ascontiguousarray(real(csc.data, name))
    matrix.storage = CSC
    matrix.rows, matrix.columns = shape
    matrix.leading_dimension = 0
    matrix.values = address(values)
    matrix.column_starts = address(starts)
    matrix.row_indices = address(rows)
    return entries, (starts, rows, values)


def _indices(value: Any, name: str) -> NDArray[np.int32]:
    """Returns indices as contiguous int32, themselves where they are that."""
    indices = np.asarray(value)
    if indices.dtype != np.int32 and indices.size and int(indices.max()) > INT32_MAX:
        raise argument_error(
            f"{name} goes up to {int(indices.max())}, more than a 32-bit index can number"
        )
    return np.require(indices, dtype=np.int32, requirements=["C", "A"])


def floats(value: Any, name: str, n: int) -> list[float]:
    """Returns n numbers, or says what shape the argument has instead."""
    array = real(value, name)
    if array.shape != (n,):
        raise argument_error(f"{name} has shape {array.shape}, expected ({n},)")
    numbers: list[float] = array.tolist()
    return numbers


def number(value: Any, name: str) -> float:
    """Returns a single number."""
    array = real(value, name)
    if array.ndim != 0:
        raise argument_error(f"{name} has shape {array.shape}, expected a number")
    return float(array)
