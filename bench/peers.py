"""Other people's solvers of LCPs and of contacts, each called the way its own documentation says.

    python peers.py PEER PROBLEM.npz ANSWER.npz TOLERANCE

reads M and q (contacts: W, q and mu, three rows each, normal first), writes `answer` (z; impulses) and
the seconds of the best of some runs. A program of its own, because the peers need other versions of
NumPy than perp's plots do, or live in the system's Python.
Exit status 3: the peer is not installed in this Python.
"""

from __future__ import annotations

import importlib
import sys
import time
from typing import Any, Callable, Mapping

import numpy as np

Solve = Callable[[], Any]  # once, to the tolerance
Prepare = Callable[[Mapping[str, Any], float], Solve]


def quantecon_lemke(data: Mapping[str, Any], tolerance: float) -> Solve:
    from quantecon.optimize import lcp_lemke

    lcp_lemke(np.eye(2), -np.ones(2))  # compiles it
    M, q = data["M"], data["q"]
    return lambda: lcp_lemke(M, q).z


def _siconos_options(name: str, tolerance: float, iterations: int) -> tuple[Any, Any]:
    numerics = importlib.import_module("siconos.numerics")
    options = numerics.SolverOptions(getattr(numerics, name))
    options.dparam[numerics.SICONOS_DPARAM_TOL] = tolerance
    options.iparam[numerics.SICONOS_IPARAM_MAX_ITER] = iterations
    return numerics, options


def siconos_lcp(name: str, iterations: int) -> Prepare:
    def prepare(data: Mapping[str, Any], tolerance: float) -> Solve:
        M, q = data["M"], data["q"]

        def solve() -> Any:
            numerics, options = _siconos_options(name, tolerance, iterations)
            z, w = np.zeros(len(q)), np.zeros(len(q))
            numerics.linearComplementarity_driver(numerics.LCP(M, q), z, w, options)
            return z

        return solve

    return prepare


def drake_moby(data: Mapping[str, Any], tolerance: float) -> Solve:
    solvers = importlib.import_module("pydrake.solvers")
    M, q = data["M"], data["q"]

    def solve() -> Any:
        program = solvers.MathematicalProgram()
        z = program.NewContinuousVariables(len(q))
        program.AddLinearComplementarityConstraint(M, q, z)
        return solvers.MobyLcpSolver().Solve(program).GetSolution(z)

    return solve


def siconos_contact(name: str, iterations: int) -> Prepare:
    """With a sparse W where this Python has SciPy: ten times as fast as with a dense one."""

    def prepare(data: Mapping[str, Any], tolerance: float) -> Solve:
        W, q, mu = (np.array(data[key]) for key in ("W", "q", "mu"))
        numerics, _ = _siconos_options(name, tolerance, iterations)
        try:
            from scipy import sparse
        except ImportError:
            matrix = W
        else:
            matrix = sparse.csc_matrix(W)
            matrix.indices, matrix.indptr = (
                x.astype(np.int64) for x in (matrix.indices, matrix.indptr)
            )
        problem = numerics.FrictionContactProblem(3, matrix, q, mu)

        def solve() -> Any:
            _, options = _siconos_options(name, tolerance, iterations)
            r, u = np.zeros(len(q)), np.zeros(len(q))
            numerics.fc3d_driver(problem, r, u, options)
            return r

        return solve

    return prepare


def pinocchio_contact(kind: str, iterations: int) -> Prepare:
    """Pinocchio's solvers take a Delassus matrix, and constraints that say which cones there are;
    its contacts have their normal last."""

    def prepare(data: Mapping[str, Any], tolerance: float) -> Solve:
        pin = importlib.import_module("pinocchio")
        W, q, mu = data["W"], data["q"], data["mu"]
        order = (np.arange(0, len(q), 3)[:, None] + [1, 2, 0]).ravel()
        model = pin.Model()
        model.addJoint(0, pin.JointModelFreeFlyer(), pin.SE3.Identity(), "body")
        models, datas = pin.StdVec_ConstraintModel(), pin.StdVec_ConstraintData()
        for friction in mu:
            contact = pin.PointContactConstraintModel(model, 1)
            contact.setFriction(float(friction))
            models.append(pin.ConstraintModel(contact))
            datas.append(models[-1].createData())
        delassus = pin.DelassusOperatorDense(W[np.ix_(order, order)])
        offset = np.ascontiguousarray(q[order])

        def solve() -> Any:
            settings = getattr(pin, f"{kind}SolverSettings")()
            for name in dir(settings):
                if name.startswith("absolute_"):
                    setattr(settings, name, tolerance * np.abs(q).max())
                elif name.startswith("relative_"):
                    setattr(settings, name, 0.0)
            settings.max_iterations = iterations
            solver = getattr(pin, f"{kind}ConstraintSolver")(len(q))
            result = getattr(pin, f"{kind}SolverResult")()
            solver.solve(delassus, offset, models, datas, settings, result)
            r = np.empty(len(q))
            r[order] = result.retrieveConstraintImpulses()
            return r

        return solve

    return prepare


# name: (module that must be there, how a call is prepared, whether the tolerance steers it)
LCP: dict[str, tuple[str, Prepare, bool]] = {
    "quantecon lemke": ("quantecon", quantecon_lemke, False),
    "siconos lemke": ("siconos.numerics", siconos_lcp("SICONOS_LCP_LEMKE", 100000), False),
    "siconos pgs": ("siconos.numerics", siconos_lcp("SICONOS_LCP_PGS", 100000), True),
    "siconos newton": (
        "siconos.numerics",
        siconos_lcp("SICONOS_LCP_NEWTON_FB_FBLSA", 1000),
        True,
    ),
    "drake moby": ("pydrake.solvers", drake_moby, False),
}
CONTACT: dict[str, tuple[str, Prepare, bool]] = {
    "siconos nsgs": (
        "siconos.numerics",
        siconos_contact("SICONOS_FRICTION_3D_NSGS", 100000),
        True,
    ),
    "siconos nsn_ac": (
        "siconos.numerics",
        siconos_contact("SICONOS_FRICTION_3D_NSN_AC", 1000),
        True,
    ),
    "siconos admm": (
        "siconos.numerics",
        siconos_contact("SICONOS_FRICTION_3D_ADMM", 100000),
        True,
    ),
    "pinocchio admm": ("pinocchio", pinocchio_contact("ADMM", 10000), True),
    "pinocchio pgs": ("pinocchio", pinocchio_contact("PGS", 100000), True),
}


def best_of(solve: Solve) -> tuple[Any, float]:
    """The best of up to six, or of what one second holds."""
    seconds, spent = [], 0.0
    while len(seconds) < 6 and spent < 1.0:
        started = time.perf_counter()
        answer = solve()
        seconds.append(time.perf_counter() - started)
        spent += seconds[-1]
    return answer, min(seconds)


def main() -> int:
    name, problem, target, tolerance = sys.argv[1:]
    module, prepare, _ = {**LCP, **CONTACT}[name]
    try:
        importlib.import_module(module)
    except Exception as error:  # an extension built for another NumPy raises what it likes
        print(f"{module}: {error}", file=sys.stderr)
        return 3
    answer, seconds = best_of(prepare(np.load(problem), float(tolerance)))
    np.savez(target, answer=answer, seconds=seconds)
    return 0


if __name__ == "__main__":
    sys.exit(main())
