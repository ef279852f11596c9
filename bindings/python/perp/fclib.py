"""Frictional contact problems in the HDF5 files of FCLIB, the field's collection of problems.

    python -m perp.fclib FILE...        solves them and prints a table

A file holds one problem, 'local' (with the Delassus matrix W) or 'global' (with M and H), and maybe
guesses and a solution. FCLIB's H is the transpose of perp's: M v = H r + G l + f, u = H' v + w,
G' v + b = 0; a Problem holds perp's. Its components are normal first, as here.

Rows with bounds and contacts that hold both ways have no place in FCLIB: problems with them (or with
a dim for each contact) are written alike, in a group perp_local or perp_global, which no reader of
FCLIB takes for one of its own, with dims, two_sided and the vectors lower and upper beside mu.

Source: Acary, Bremond, Koziara & Perignon, "FCLIB: a collection of discrete 3D frictional contact
problems", INRIA RT-0444 (2014), and its C library, which reads what write() writes.

Needs h5py and SciPy (pip install 'perp[fclib]').
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any, Optional, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _errors

Array = NDArray[np.float64]
Path = Union[str, "os.PathLike[str]"]

# What the field nz of a matrix says of its storage; a count of entries says triplets.
_CSC, _CSR = -1, -2


@dataclass
class Solution:
    """A solution, or a guess of one: what the file has of it."""

    v: Optional[Array] = None  # velocities (global problems)
    u: Optional[Array] = None  # relative velocities of the contacts
    r: Optional[Array] = None  # impulses of the contacts
    l: Optional[Array] = None  # impulses of the bilateral rows  # noqa: E741


@dataclass
class Problem:
    """A frictional contact problem. Matrices are SciPy sparse, in perp's orientation.

    local:  u = W r + V l + q,  0 = V' r + R l + s      (V, R, s: None without bilateral rows)
    global: M v = f + H' r + G' l,  u = H v + w,  0 = G v + b
    """

    dim: Union[int, NDArray[Any]]  # 2 or 3, of all contacts; or one a contact
    mu: Array
    W: Any = None
    q: Optional[Array] = None
    V: Any = None
    R: Any = None
    s: Optional[Array] = None
    M: Any = None
    f: Optional[Array] = None
    H: Any = None
    w: Optional[Array] = None
    G: Any = None
    b: Optional[Array] = None
    title: str = ""
    description: str = ""
    math_info: str = ""
    guesses: list[Solution] = field(default_factory=list)
    solution: Optional[Solution] = None
    two_sided: Optional[NDArray[Any]] = None  # a contact each: normals that hold both ways
    lower: Optional[Array] = None  # of the last rows of H (of W), which have bounds of their own
    upper: Optional[Array] = None

    @property
    def own(self) -> bool:
        """Whether it says what FCLIB can't."""
        return np.ndim(self.dim) > 0 or self.two_sided is not None or self.lower is not None

    @property
    def kind(self) -> str:
        """"local" or "global"."""
        return "global" if self.M is not None else "local"

    @property
    def contacts(self) -> int:
        return len(self.mu)

    def solve(self, **options: Any) -> Any:
        """Solves the problem by perp.contact (global) or perp.contact_delassus (local), to which
        the options go."""
        from . import contact, contact_delassus

        if self.two_sided is not None:
            options["two_sided"] = self.two_sided
        if self.lower is not None:
            options["bounds"] = (self.lower, self.upper)
        if self.kind == "global":
            if self.G is not None:
                options["bilateral"] = (self.G, self.b)
            assert self.f is not None
            return contact(self.M, self.f, self.H, self.w, self.mu, dim=self.dim, **options)
        W, q = self.W, self.q
        if self.V is not None:
            sparse, _ = _libraries()
            assert q is not None and self.s is not None
            W = sparse.bmat([[W, self.V], [self.V.T, self.R]], format="csc")
            q = np.concatenate([q, self.s])
            options["bilateral"] = len(self.s)
        assert q is not None
        return contact_delassus(W, q, self.mu, dim=self.dim, **options)


def _libraries() -> tuple[Any, Any]:
    """SciPy's sparse matrices and h5py, which the rest of the package does without."""
    try:
        import h5py
        import scipy.sparse as sparse
    except ImportError as missing:
        raise ImportError(
            f"perp.fclib needs h5py and SciPy: pip install 'perp[fclib]' ({missing})"
        ) from missing
    return sparse, h5py


def _bad(group: Any, what: str) -> _errors.Error:
    return _errors.argument_error(f"{group.file.filename}: {group.name}: {what}")


def _number(group: Any, name: str) -> int:
    if name not in group:
        raise _bad(group, f"no {name}")
    value = np.ravel(group[name][()])
    if value.size != 1:
        raise _bad(group, f"{name} has {value.size} numbers, expected 1")
    return int(value[0])


def _vector(group: Any, names: Sequence[str], size: int) -> Array:
    """The first of the names that is there."""
    for name in names:
        if name in group:
            value = np.ravel(np.asarray(group[name][()], dtype=np.float64))
            if value.size != size:
                raise _bad(group, f"{name} has {value.size} numbers, expected {size}")
            return value
    raise _bad(group, f"no {names[0]}")


def _text(group: Any, name: str) -> str:
    if name not in group:
        return ""
    value = group[name][()]
    return value.decode(errors="replace") if isinstance(value, bytes) else str(value)


def _indices(group: Any, name: str, size: int, end: int) -> NDArray[np.int64]:
    """As many indices, each in 0 .. end."""
    if name not in group:
        raise _bad(group, f"no {name}")
    value = np.ravel(np.asarray(group[name][()]))
    if value.size < size:
        raise _bad(group, f"{name} has {value.size} indices, expected {size}")
    value = value[:size].astype(np.int64)
    outside = np.flatnonzero((value < 0) | (value > end))
    if outside.size:
        raise _bad(group, f"{name}[{outside[0]}] is {value[outside[0]]}, expected 0 .. {end}")
    return value


def _read_matrix(group: Any) -> Any:
    """A matrix as CSC: sorted, duplicates added."""
    sparse, _ = _libraries()
    m, n, nz = _number(group, "m"), _number(group, "n"), _number(group, "nz")
    if m < 0 or n < 0 or nz < _CSR:
        raise _bad(group, f"m is {m}, n is {n}, nz is {nz}")
    if nz >= 0:
        rows = _indices(group, "i", nz, m - 1)
        columns = _indices(group, "p", nz, n - 1)
        values = _vector(group, ["x"], np.size(group["x"]) if "x" in group else nz)[:nz]
        if values.size != nz:
            raise _bad(group, f"x has {values.size} numbers, expected {nz}")
        result = sparse.coo_matrix((values, (rows, columns)), shape=(m, n)).tocsc()
    else:
        lines, inner = (n, m) if nz == _CSC else (m, n)
        entries = np.size(group["x"]) if "x" in group else 0
        starts = _indices(group, "p", lines + 1, entries)
        if starts[0] != 0 or np.any(np.diff(starts) < 0):
            raise _bad(group, "p does not start at 0 and rise")
        used = int(starts[-1])
        values = _vector(group, ["x"], entries)[:used]
        indices = _indices(group, "i", used, inner - 1)
        form = sparse.csc_matrix if nz == _CSC else sparse.csr_matrix
        result = form((values, indices, starts), shape=(m, n)).tocsc()
    result.sum_duplicates()
    result.sort_indices()
    return result


def _read_solution(group: Any) -> Solution:
    parts = {name: np.ravel(group[name][()]) for name in "vurl" if name in group}
    return Solution(**parts)


def _make(group: Any, matrix: Any, columns: bool, dim: int) -> tuple[int, Problem]:
    """Rows of W (columns of FCLIB's H), and a problem of that many with the laws alone; dim is 0
    where each contact has its own."""
    size, vectors = matrix.shape[1 if columns else 0], group["vectors"]
    if dim:
        if size % dim:
            raise _bad(group, f"{size} rows are no multiple of spacedim {dim}")
        return size, Problem(dim, _vector(vectors, ["mu"], size // dim))
    contacts, bounded = np.size(group["dims"][()]), np.size(vectors["lower"][()])
    dims = _indices(group, "dims", contacts, 5)
    if dims.sum() + bounded != size:
        raise _bad(group, f"dims and lower make {dims.sum() + bounded} rows, expected {size}")
    problem = Problem(dims, _vector(vectors, ["mu"], contacts))
    problem.two_sided = _indices(group, "two_sided", contacts, 3)
    if bounded:
        problem.lower = _vector(vectors, ["lower"], bounded)
        problem.upper = _vector(vectors, ["upper"], bounded)
    return size, problem


def _read_local(group: Any, dim: int) -> Problem:
    W = _read_matrix(group["W"])
    vectors = group["vectors"]
    size, problem = _make(group, W, False, dim)
    problem.W = W
    # The C library has written q under the name of a.
    problem.q = _vector(vectors, ["q", "a"], size)
    if "V" in group:
        problem.V, problem.R = _read_matrix(group["V"]), _read_matrix(group["R"])
        problem.s = _vector(vectors, ["s"], problem.R.shape[0])
    return problem


def _read_global(group: Any, dim: int) -> Problem:
    M, H = _read_matrix(group["M"]), _read_matrix(group["H"])
    vectors = group["vectors"]
    size, problem = _make(group, H, True, dim)
    problem.M, problem.H = M, H.T.tocsc()
    problem.f = _vector(vectors, ["f"], M.shape[0])
    problem.w = _vector(vectors, ["w"], size)
    if "G" in group:
        G = _read_matrix(group["G"])
        problem.G, problem.b = G.T.tocsc(), _vector(vectors, ["b"], G.shape[1])
    return problem


def read(path: Path) -> Problem:
    """Reads a problem.

    Raises perp.Error for a file that is no FCLIB problem, naming the group and what is wrong with
    it, OSError for one that can't be opened as HDF5.
    """
    _, h5py = _libraries()
    with h5py.File(os.fspath(path), "r") as file:
        for name in ("fclib_local", "fclib_global", "perp_local", "perp_global"):
            if name not in file:
                continue
            group = file[name]
            reader = _read_local if name.endswith("local") else _read_global
            dim = _number(group, "spacedim") if name.startswith("fclib") else 0
            if dim not in (2, 3) and name.startswith("fclib"):
                raise _bad(group, f"spacedim is {dim}, expected 2 or 3")
            try:
                problem = reader(group, dim)
            except KeyError as missing:
                raise _bad(group, str(missing.args[0])) from None
            if "info" in group:
                for text in ("title", "description", "math_info"):
                    setattr(problem, text, _text(group["info"], text))
            if "guesses" in file:
                guesses = [file["guesses"][key] for key in sorted(file["guesses"]) if key.isdigit()]
                problem.guesses = [_read_solution(guess) for guess in guesses]
            if "solution" in file:
                problem.solution = _read_solution(file["solution"])
            return problem
        raise _bad(file, "neither fclib_local nor fclib_global")


def _write_matrix(group: Any, matrix: Any) -> None:
    sparse, _ = _libraries()
    csc = sparse.csc_matrix(matrix, copy=True)
    csc.sum_duplicates()
    for name, value in (("nzmax", csc.nnz), ("m", csc.shape[0]), ("n", csc.shape[1]), ("nz", _CSC)):
        group.create_dataset(name, data=np.array([value], dtype=np.int32))
    group.create_dataset("p", data=csc.indptr.astype(np.int32))
    group.create_dataset("i", data=csc.indices.astype(np.int32))
    group.create_dataset("x", data=csc.data.astype(np.float64))


def _write_vector(group: Any, name: str, value: Optional[ArrayLike]) -> None:
    if value is None:
        raise _errors.argument_error(f"{name} is missing")
    group.create_dataset(name, data=np.ravel(np.asarray(value, dtype=np.float64)))


def _write_solution(group: Any, solution: Solution) -> None:
    for name in "vurl":
        if getattr(solution, name) is not None:
            _write_vector(group, name, getattr(solution, name))


def _write_own(group: Any, problem: Problem) -> None:
    both = 0 if problem.two_sided is None else problem.two_sided
    for name, value in (("dims", problem.dim), ("two_sided", both)):
        each = np.broadcast_to(np.asarray(value, dtype=np.int32), (problem.contacts,))
        group.create_dataset(name, data=each)
    for name in ("lower", "upper"):
        value = getattr(problem, name)
        _write_vector(group.require_group("vectors"), name, [] if value is None else value)


def write(path: Path, problem: Problem) -> None:
    """Writes a problem, with its guesses and solution; an existing file is replaced."""
    _, h5py = _libraries()
    matrices: dict[str, Any]
    if problem.kind == "local":
        matrices, vectors = {"W": problem.W}, ["q", "mu"]
        if problem.V is not None:
            matrices.update(V=problem.V, R=problem.R)
            vectors.append("s")
    else:
        matrices, vectors = {"M": problem.M, "H": problem.H.T}, ["f", "w", "mu"]
        if problem.G is not None:
            matrices["G"] = problem.G.T
            vectors.append("b")
    for name, value in matrices.items():
        if value is None:
            raise _errors.argument_error(f"{name} is missing")
    with h5py.File(os.fspath(path), "w") as file:
        group = file.create_group(f"{'perp' if problem.own else 'fclib'}_{problem.kind}")
        if problem.own:
            _write_own(group, problem)
        else:
            group.create_dataset("spacedim", data=np.array([problem.dim], dtype=np.int32))
        for name, value in matrices.items():
            _write_matrix(group.create_group(name), value)
        for name in vectors:
            _write_vector(group.require_group("vectors"), name, getattr(problem, name))
        for name in ("title", "description", "math_info"):
            if getattr(problem, name):
                text = getattr(problem, name).encode()  # ended by a 0, for C
                form = f"S{len(text) + 1}"
                group.require_group("info").create_dataset(name, data=text, dtype=form)
        if problem.guesses:
            guesses = file.create_group("guesses")
            count = np.array([len(problem.guesses)], dtype=np.int32)
            guesses.create_dataset("number_of_guesses", data=count)
            for number, guess in enumerate(problem.guesses, 1):
                _write_solution(guesses.create_group(str(number)), guess)
        if problem.solution is not None:
            _write_solution(file.create_group("solution"), problem.solution)


def _arguments(given: Optional[Sequence[str]]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="python -m perp.fclib",
        description="Solves frictional contact problems in FCLIB's files and prints a table. "
        "The exit status is 1 if one is not solved, 2 if a file can't be read.",
    )
    parser.add_argument("files", nargs="+", metavar="FILE")
    parser.add_argument("--method", default="auto", help="auto, sweep, newton, lemke, admm or proximal")
    parser.add_argument("--tol", type=float, default=1e-8, help="tested residual (1e-8)")
    parser.add_argument("--time-limit", type=float, metavar="SECONDS")
    parser.add_argument(
        "--cone", type=int, metavar="K", help="a polyhedron of K directions in place of the cone"
    )
    return parser.parse_args(given)


def _lines(options: argparse.Namespace, status: list[int]) -> Iterable[str]:
    wide = max(len(os.path.basename(name)) for name in options.files)
    yield (
        f"{'file':{wide}} {'contacts':>8} {'outcome':>16} {'method':>7} {'residual':>9} "
        f"{'signorini':>9} {'cone':>9} {'dissip.':>9} {'steps':>6} {'ms':>9}"
    )
    for name in options.files:
        short = os.path.basename(name)
        try:
            problem = read(name)
            result = problem.solve(
                method=options.method,
                tol=options.tol,
                time_limit=options.time_limit,
                cone="exact" if options.cone is None else options.cone,
            )
        except (OSError, _errors.Error) as error:
            status[0] = 2
            yield f"{short:{wide}} {error}"
            continue
        if not result.ok:
            status[0] = max(status[0], 1)
        yield (
            f"{short:{wide}} {problem.contacts:8} {result.outcome:>16} {result.method:>7} "
            f"{result.residual:9.1e} {result.signorini:9.1e} {result.cone:9.1e} "
            f"{result.dissipation:9.1e} {result.iterations:6} {1e3 * result.seconds:9.2f}"
        )


def main(given: Optional[Sequence[str]] = None) -> int:
    """The command of this module; returns its exit status."""
    status = [0]
    for line in _lines(_arguments(given), status):
        print(line, flush=True)
    return status[0]


if __name__ == "__main__":
    sys.exit(main())
