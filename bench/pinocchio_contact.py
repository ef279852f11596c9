"""Contact problems of robots that Pinocchio models: perp.contact beside Pinocchio's own solvers.

    bench/run build pinocchio_contact   needs pin and example-robot-data

Each robot is let go .1 m above the ground, a fixed one with its limbs through it, with random
joints and torques, of 20 rad/s^2 or so, that last .1 s each, and joints whose speeds fade in .1 s,
and goes on by perp.pinocchio for one second at h = 2 ms. What may touch are the corners of the box
about each link's collision shapes, mu = .7. Of the steps in which something is within reach 20 are
recorded: M, the rows, and velocities without impulses. Joint limits take no part. Every code solves
the same problems from no impulses, by a solver that was set up before. Pinocchio's get their
Delassus matrix for nothing, perp gets M and H, and forms what it needs within its time. residual:
the tested one of docs/contact.md, recomputed here from W and q for every code alike. solved:
problems with a residual of 1e-8. Pinocchio's tolerances are absolute; of 1e-8, 1e-10 and 1e-12
beside the largest free velocity the first that reaches it counts, else the last; at most 10,000
iterations (ADMM) and 50,000 (PGS). Times are the thread's, in us, the least of three, of what is
solved, and of what is not: median, nineteen of twenty, most.
"""

from __future__ import annotations

import os
import sys
import time
from pathlib import Path
from typing import Any, Callable, NamedTuple

import numpy as np
import perp
import perp.pinocchio
import pinocchio as pin
from problems import contact_residual

import peers

ROBOTS = {  # a file of example-robot-data, and whether its base is free
    "a1": ("a1_description/urdf/a1.urdf", True),
    "go1": ("go1_description/urdf/go1.urdf", True),
    "anymal": ("anymal_c_simple_description/urdf/anymal.urdf", True),
    "hyq": ("hyq_description/robots/hyq_no_sensors.urdf", True),
    "laikago": ("laikago_description/urdf/laikago.urdf", True),
    "bolt": ("bolt_description/robots/bolt.urdf", True),
    "g1": ("g1_description/urdf/g1_29dof_rev_1_0.urdf", True),
    "talos": ("talos_data/robots/talos_reduced.urdf", True),
    "panda": ("panda_description/urdf/panda.urdf", False),
    "z1": ("z1_description/urdf/z1.urdf", False),
}
PROBLEMS, H, MU, GOAL = 20, 2e-3, 0.7, 1e-8


class Problem(NamedTuple):
    M: Any
    J: Any
    f: Any
    w: Any
    W: Any
    q: Any
    mu: Any


def folder() -> Path:
    prefix = Path(pin.__file__).parents[4]
    return prefix / "share" / "example-robot-data" / "robots"


def corners(model: Any, path: Path, fixed: int) -> tuple[list[int], Any]:
    """A frame for each corner of the boxes about what collides, and where it is in its frame; of
    the joints beyond `fixed`: what turns about the vertical only, no contact of the ground moves."""
    packages = [str(folder()), str(folder().parents[1])]
    shapes = pin.buildGeomFromUrdf(
        model, str(path), pin.GeometryType.COLLISION, package_dirs=packages
    )
    frames, places = [], []
    for shape in shapes.geometryObjects:
        shape.geometry.computeLocalAABB()
        box = shape.geometry.aabb_local
        scale = np.asarray(shape.meshScale)
        low, high = scale * box.min_, scale * box.max_
        if shape.parentJoint <= fixed or not np.all(np.isfinite([low, high])):
            continue
        own = model.frames[shape.parentFrame].placement.inverse() * shape.placement
        for choice in np.ndindex(2, 2, 2):
            frames.append(shape.parentFrame)
            places.append(own.act(np.where(choice, high, low)))
    return frames, np.array(places)


def record(name: str) -> list[Problem]:
    file, free = ROBOTS[name]
    path, random = folder() / file, np.random.RandomState(sorted(ROBOTS).index(name))
    root = [pin.JointModelFreeFlyer()] if free else []
    model = pin.buildModelFromUrdf(str(path), *root)
    frames, places = corners(model, path, 0 if free else 2)
    for bound, size in ((model.lowerPositionLimit, -np.inf), (model.upperPositionLimit, np.inf)):
        bound[7 if free else 0 :] = size
    model.lowerDryFrictionLimit[:] = model.upperDryFrictionLimit[:] = 0.0
    q, v = pin.neutral(model), 0.2 * random.standard_normal(model.nv)
    first = 6 if free else 0
    turn = np.zeros(model.nv)
    turn[first:] = 0.3 * random.standard_normal(model.nv - first)
    q = pin.integrate(model, q, turn)
    data = model.createData()
    pin.framesForwardKinematics(model, data, q)
    heights = [data.oMf[f].act(x)[2] for f, x in zip(frames, places)]
    height = min(heights) - 0.1 if free else float(np.quantile(heights, 0.25))
    ground = perp.pinocchio.Ground(model, frames, places, MU, height=height)
    stepper = perp.pinocchio.Stepper(model, H, [ground])
    inertia = np.diag(pin.crba(model, data, q))[first:]
    model.damping[first:] = inertia / 0.1
    found, tau = [], np.zeros(model.nv)
    for k in range(500):
        if k % 50 == 0:
            tau[first:] = 20.0 * inertia * random.standard_normal(model.nv - first)
        before = v
        q, v, _, contacts, _ = stepper.step(q, v, tau)
        if len(contacts[0].gaps):
            found.append(problem_of(stepper, before, contacts[0].gaps))
    chosen = np.linspace(0, len(found) - 1, PROBLEMS).astype(int)
    return [found[k] for k in chosen]


def problem_of(stepper: Any, v: Any, gaps: Any) -> Problem:
    """What the step that was made last has solved."""
    M = stepper._M + H * np.diag(stepper.model.damping)
    J = stepper._J[: 3 * len(gaps)].copy()
    f, w = M @ v + H * stepper._force, np.zeros(3 * len(gaps))
    w[::3] = np.maximum(gaps, 0.0) / H
    X = np.linalg.solve(M, np.column_stack([J.T, f]))
    W = J @ X[:, :-1]
    return Problem(M, J, f, w, 0.5 * (W + W.T), J @ X[:, -1] + w, np.full(len(gaps), MU))


def clock(solve: Callable[[], Any]) -> tuple[Any, float]:
    """Its answer, and the least time of three calls: of two where one takes .1 s."""
    least, answer = np.inf, None
    for _ in range(3):
        began = time.thread_time_ns()
        answer = solve()
        least = min(least, (time.thread_time_ns() - began) * 1e-3)
        if least > 1e5:
            break
    return answer, least


def own(**settings: Any) -> Callable[[Problem], Any]:
    def run(p: Problem) -> Any:
        solver = perp.ContactSolver(p.M, p.J, p.mu, **settings)
        result, spent = clock(lambda: solver.solve(p.f, p.w, r0=0.0))
        return contact_residual(p.W, p.q, p.mu, result.impulse), spent

    return run


def peer(kind: str, iterations: int) -> Callable[[Problem], Any]:
    prepare = peers.pinocchio_contact(kind, iterations)

    def run(p: Problem) -> Any:
        for tolerance in (1e-8, 1e-10, 1e-12):
            solve = prepare({"W": p.W, "q": p.q, "mu": p.mu}, tolerance)
            r, spent = clock(solve)
            residual = contact_residual(p.W, p.q, p.mu, r)
            if residual <= GOAL or spent > 1e6:  # as a robot's step, it is of no use
                break
        return residual, spent

    return run


SOLVERS = {
    "perp auto": own(method="auto"),
    "perp proximal": own(method="proximal"),
    "pinocchio ADMM": peer("ADMM", 10000),
    "pinocchio PGS": peer("PGS", 50000),
}


def line(name: str, solver: str, found: list[tuple[float, float]]) -> str:
    residuals, times = np.array(found).T
    middle, many, most = np.quantile(times, [0.5, 0.95, 1.0])
    good = int(np.sum(residuals <= GOAL))
    return (
        f"{name:10} {solver:15} {good:4} of {len(found):<4}"
        f"{np.max(residuals):10.1e}{middle:10.0f}{many:10.0f}{most:10.0f}"
    )


def main() -> None:
    doc = __doc__.split("\n    bench/run")
    lines = [doc[0].strip(), "", __doc__[__doc__.index("Each") :].strip(), ""]
    lines += [os.environ.get("MACHINE", ""), f"pinocchio {pin.__version__}, {perp.version_text()}", ""]
    lines.append(f"{'robot':10} {'solver':15} {'solved':>7} {'residual':>13}{'median':>10}{'p95':>10}{'most':>10}")
    all_of: dict[str, list[tuple[float, float]]] = {name: [] for name in SOLVERS}
    for name in ROBOTS:
        recorded = record(name)
        sizes = [len(p.mu) for p in recorded]
        lines.append(f"{name}: {len(recorded[0].f)} velocities, {min(sizes)} to {max(sizes)} contacts")
        for solver, run in SOLVERS.items():
            found = [run(p) for p in recorded]
            all_of[solver] += found
            lines.append(line(name, solver, found))
        print("\n".join(lines[-5:]), file=sys.stderr, flush=True)
    for solver, found in all_of.items():
        lines.append(line("all", solver, found))
    (Path(sys.argv[1]) / "pinocchio_contact.txt").write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
