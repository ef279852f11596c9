"""Other people's LCP solvers, each called the way its own documentation says.

    python peers.py PEER PROBLEM.npz ANSWER.npz TOLERANCE

reads M and q, writes z and the seconds of the best of some runs. A program of its own, because the
peers need other versions of NumPy than perp's plots do, or live in the system's Python.
Exit status 3: the peer is not installed in this Python.
"""

from __future__ import annotations

import importlib
import sys
import time
from typing import Any, Callable

import numpy as np

Solve = Callable[[Any, Any, float], Any]


def quantecon_lemke(M: Any, q: Any, tolerance: float) -> Any:
    from quantecon.optimize import lcp_lemke

    return lcp_lemke(M, q).z


def _siconos(name: str, iterations: int) -> Solve:
    def solve(M: Any, q: Any, tolerance: float) -> Any:
        numerics = importlib.import_module("siconos.numerics")
        problem = numerics.LCP(M, q)
        options = numerics.SolverOptions(getattr(numerics, name))
        options.dparam[numerics.SICONOS_DPARAM_TOL] = tolerance
        options.iparam[numerics.SICONOS_IPARAM_MAX_ITER] = iterations
        z, w = np.zeros(len(q)), np.zeros(len(q))
        numerics.linearComplementarity_driver(problem, z, w, options)
        return z

    return solve


def drake_moby(M: Any, q: Any, tolerance: float) -> Any:
    solvers = importlib.import_module("pydrake.solvers")
    program = solvers.MathematicalProgram()
    z = program.NewContinuousVariables(len(q))
    program.AddLinearComplementarityConstraint(M, q, z)
    return solvers.MobyLcpSolver().Solve(program).GetSolution(z)


# name: (module that must be there, the call, whether the tolerance steers it)
PEERS: dict[str, tuple[str, Solve, bool]] = {
    "quantecon lemke": ("quantecon", quantecon_lemke, False),
    "siconos lemke": ("siconos.numerics", _siconos("SICONOS_LCP_LEMKE", 100000), False),
    "siconos pgs": ("siconos.numerics", _siconos("SICONOS_LCP_PGS", 100000), True),
    "siconos newton": ("siconos.numerics", _siconos("SICONOS_LCP_NEWTON_FB_FBLSA", 1000), True),
    "drake moby": ("pydrake.solvers", drake_moby, False),
}


def best_of(solve: Solve, M: Any, q: Any, tolerance: float) -> tuple[Any, float]:
    """A first run for compilers that work just in time, then the best of up to five or one second."""
    solve(M, q, tolerance)
    seconds, spent = [], 0.0
    while len(seconds) < 5 and spent < 1.0:
        started = time.perf_counter()
        z = solve(M, q, tolerance)
        seconds.append(time.perf_counter() - started)
        spent += seconds[-1]
    return z, min(seconds)


def main() -> int:
    name, problem, answer, tolerance = sys.argv[1:]
    module, solve, _ = PEERS[name]
    try:
        importlib.import_module(module)
    except Exception as error:  # an extension built for another NumPy raises what it likes
        print(f"{module}: {error}", file=sys.stderr)
        return 3
    data = np.load(problem)
    z, seconds = best_of(solve, data["M"], data["q"], float(tolerance))
    np.savez(answer, z=z, seconds=seconds)
    return 0


if __name__ == "__main__":
    sys.exit(main())
