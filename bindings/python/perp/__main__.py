"""The package from a terminal.

    python -m perp solve M.mtx q.mtx [lower.mtx [upper.mtx]]    a problem in Matrix Market files
    python -m perp solve FILE.hdf5...                           contacts, as python -m perp.fclib
    python -m perp version                                      the library, and where it was found
    python -m perp check                                        does this installation work?
"""

from __future__ import annotations

import argparse
import platform
import sys
from collections.abc import Iterator, Sequence
from typing import Any, Optional, get_args

import numpy as np

import perp

from ._generated import LcpMethod
from ._library import library, origin


def _market(path: str) -> Any:
    """The matrix or the vector in a Matrix Market file."""
    try:
        from scipy.io import mmread
    except ImportError:
        raise SystemExit("Matrix Market files need SciPy: pip install 'perp[sparse]'") from None
    try:
        return mmread(path)
    except (OSError, ValueError, OverflowError, TypeError) as error:
        raise SystemExit(f"{path}: {error}") from None


def _vector(path: str) -> Any:
    found = _market(path)
    dense = found.toarray() if hasattr(found, "toarray") else np.asarray(found)
    return dense.ravel()


def _solve(options: argparse.Namespace) -> int:
    files = options.files
    if any(name.endswith((".h5", ".hdf5")) for name in files):
        from . import fclib

        return fclib.main(files + options.rest)
    if options.rest:
        raise SystemExit(f"unknown options: {' '.join(options.rest)}")
    if not 2 <= len(files) <= 4:
        raise SystemExit("expected M.mtx q.mtx [lower.mtx [upper.mtx]], or files of FCLIB (.hdf5)")
    M, vectors = _market(files[0]), [_vector(name) for name in files[1:]]
    try:
        answer = perp.lcp(
            M, *vectors, method=options.method, tol=options.tol, time_limit=options.time_limit
        )
    except perp.Error as error:
        raise SystemExit(str(error)) from None
    print(answer)
    if options.output:
        np.savetxt(options.output, answer.z, fmt="%.17g")
    return 0 if answer else 1


def _where() -> Iterator[tuple[str, str]]:
    yield "perp", f"{perp.__version__}, Python package in {__file__.rpartition('/')[0]}"
    yield "library", f"{library._name} ({origin})"
    yield "version", perp.version_text()
    yield "python", f"{platform.python_version()}, {platform.platform()}"
    yield "numpy", np.__version__


def _version(_: argparse.Namespace) -> int:
    for name, text in _where():
        print(f"{name:8} {text}")
    return 0


## Solves with known answers. Each yields the error of its answer, and what it may be.


def _dense() -> tuple[float, float]:
    answer = perp.lcp([[2, 1], [1, 2]], [-1, 1])
    return float(np.abs(answer.z - [0.5, 0.0]).max()), 0.0


def _blas() -> tuple[float, float]:
    """Every z is positive: M z = 1 with M = I + ones, so z = 1 / (n + 1)."""
    n = 200
    answer = perp.lcp(np.eye(n) + np.ones((n, n)), -np.ones(n))
    return float(np.abs((n + 1) * answer.z - 1).max()), 1e-12


def _klu() -> tuple[float, float]:
    """A string under load 1 between its ends: z_i = i (n + 1 - i) / 2."""
    try:
        from scipy import sparse
    except ImportError:
        raise SkippedError("needs SciPy") from None
    n = 50
    M = sparse.diags([-1.0, 2.0, -1.0], [-1, 0, 1], (n, n), format="csc")
    i = np.arange(1.0, n + 1)
    answer = perp.lcp(M, -np.ones(n), method="fischer")
    return float(np.abs(answer.z / (i * (n + 1 - i) / 2) - 1).max()), 1e-9


def _nonlinear() -> tuple[float, float]:
    """z^3 = 8."""
    return abs(float(perp.ncp(lambda z: z**3 - 8, [1.0]).z[0]) - 2.0), 1e-9


def _contact() -> tuple[float, float]:
    """A mass of 1 pressed by 1, pushed by 0.25 and by 2, mu = 0.5: it sticks, it goes at 1.5."""
    answer = perp.contact(np.eye(6), [-1, 0.25, 0, -1, 2, 0], np.eye(6), mu=0.5)
    assert answer.v is not None
    return float(np.abs(answer.v - [0, 0, 0, 0, 1.5, 0]).max()), 1e-7


def _world() -> tuple[float, float]:
    """A box that slides to rest: it has velocity 0.0, not almost 0."""
    world = perp.World()
    world.ground.add_plane((0, 0, 1), 0, friction=0.5)
    box = world.add_body(mass=1, position=(0, 0, 0.5), velocity=(1, 0, 0))
    box.add_box((0.5, 0.5, 0.5), friction=0.5)
    world.run(0.5, 0.01)
    return float(np.abs(box.velocity).max()), 0.0


def _mechanism() -> tuple[float, float]:
    """A force of 2 on a mass of 2 for a second."""
    run = perp.Mechanism(1, mass=[2.0], force=[2.0]).simulate([0.0], [0.0], 1.0, 0.25)
    return abs(float(run.v[-1, 0]) - 1.0), 1e-14


class SkippedError(Exception):
    """A check that lacks something optional."""


_CHECKS = {
    "a linear problem": _dense,
    "a dense one (BLAS)": _blas,
    "a sparse one (KLU)": _klu,
    "a nonlinear one": _nonlinear,
    "contacts with friction": _contact,
    "a box comes to rest": _world,
    "a mechanism": _mechanism,
}


def _check(options: argparse.Namespace) -> int:
    _version(options)
    print()
    failed = 0
    for name, check in _CHECKS.items():
        try:
            error, allowed = check()
            good = error <= allowed
            said = f"{'ok' if good else 'WRONG'}, error {error:.1e}"
        except SkippedError as lacks:
            good, said = True, f"left out: {lacks}"
        except Exception as problem:
            good, said = False, f"FAILED, {type(problem).__name__}: {problem}"
        failed += not good
        print(f"{name:24} {said}")
    print(f"\n{'this installation works' if not failed else f'{failed} of {len(_CHECKS)} failed'}")
    return 1 if failed else 0


def main(given: Optional[Sequence[str]] = None) -> int:
    """The command; returns its exit status."""
    parser = argparse.ArgumentParser(prog="python -m perp", description=perp.__doc__.split("\n")[0])
    commands = parser.add_subparsers(required=True, metavar="solve | version | check")
    solve = commands.add_parser(
        "solve",
        help="solve a problem in files",
        description="0 <= z - lower, upper - z, perpendicular to M z + q, from Matrix Market "
        "files; or frictional contacts from FCLIB's, whose options python -m perp.fclib --help "
        "tells. The exit status is 1 where the problem is not solved.",
    )
    solve.add_argument("files", nargs="+", metavar="FILE")
    solve.add_argument("--method", default="auto", choices=get_args(LcpMethod))
    solve.add_argument("--tol", type=float, default=1e-10, help="tested residual (1e-10)")
    solve.add_argument("--time-limit", type=float, metavar="SECONDS")
    solve.add_argument("--output", metavar="FILE", help="write z there, a number a line")
    solve.set_defaults(run=_solve)
    version = commands.add_parser("version", help="the library's version, and where it was found")
    version.set_defaults(run=_version)
    check = commands.add_parser("check", help="does this installation work?")
    check.set_defaults(run=_check)
    options, rest = parser.parse_known_args(given)
    if rest and options.run is not _solve:
        parser.error(f"unknown options: {' '.join(rest)}")
    options.rest = rest
    status: int = options.run(options)
    return status


if __name__ == "__main__":
    sys.exit(main())
