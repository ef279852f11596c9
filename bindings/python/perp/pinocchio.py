"""Pinocchio's robots with exact contact: Pinocchio computes M, h and J, perp solves the step.

    import pinocchio as pin, perp.pinocchio

    model = pin.buildModelFromUrdf("robot.urdf", pin.JointModelFreeFlyer())
    feet = [model.getFrameId(name) for name in ("left_sole", "right_sole")]
    ground = perp.pinocchio.Ground(model, feet, corners, mu=0.7)
    stepper = perp.pinocchio.Stepper(model, 1e-3, [ground])
    q, v, how = stepper.step(q, v, tau)

Contacts obey Coulomb's law, limits of joints and the equations given are rigid, the model's dry
friction holds up to its bound. See docs/pinocchio.md. Needs the package pin
(pip install 'perp[pinocchio]').
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any, Callable, NamedTuple, Optional

import numpy as np
from numpy.typing import ArrayLike, NDArray

try:
    import pinocchio as pin  # type: ignore[import-untyped]
except ImportError as error:
    raise ImportError("perp.pinocchio needs Pinocchio: pip install 'perp[pinocchio]'") from error

from . import _arrays, _errors
from ._generated import ContactMethod
from ._stepper import Array, Laws, Rows, RowSolver, Solved

__all__ = ["Contacts", "Geometry", "Ground", "Solved", "Step", "Stepper"]


class Contacts(NamedTuple):
    """Points where bodies touch or nearly do: arrays of one entry each, in the world's frame."""

    joints: NDArray[Any]  # (contacts, 2): the joints that carry both bodies; 0 is the world
    points: Array  # (contacts, 3)
    normals: Array  # (contacts, 3): from the first body to the second
    gaps: Array  # > 0 where they are apart
    mu: Array
    names: NDArray[Any]  # integers: the same from step to step for the same contact


class Ground:
    """A half-space that points of some frames touch: soles by their corners.

    frames: one a point. places: (points, 3), each in its frame; (points, 3) zeros where None.
    mu: a number, or one a point. normal, height: the half-space normal . x <= height.
    look_ahead: points so near take part at their gap.
    """

    def __init__(
        self,
        model: Any,
        frames: Sequence[int],
        places: Optional[ArrayLike] = None,
        mu: ArrayLike = 0.5,
        *,
        normal: ArrayLike = (0.0, 0.0, 1.0),
        height: float = 0.0,
        look_ahead: float = 0.01,
    ) -> None:
        count = len(frames)
        self._joints = np.array([model.frames[k].parentJoint for k in frames], dtype=int)
        own = np.zeros((count, 3)) if places is None else _arrays.real(places, "places")
        if own.shape != (count, 3):
            raise _errors.argument_error(f"places has shape {own.shape}, expected ({count}, 3)")
        put = [model.frames[k].placement for k in frames]
        self._places = np.array([p.act(x) for p, x in zip(put, own)]).reshape(count, 3)
        self._mu = np.array(np.broadcast_to(mu, count), dtype=float)
        self._normal = np.array(normal, dtype=float)
        self._normal /= np.linalg.norm(self._normal)
        self._height, self._look_ahead = height, look_ahead

    def __call__(self, model: Any, data: Any, q: Array) -> Contacts:
        used, where = np.unique(self._joints, return_inverse=True)
        turns = np.array([data.oMi[j].rotation for j in used.tolist()])[where]
        moves = np.array([data.oMi[j].translation for j in used.tolist()])[where]
        points = np.einsum("kij,kj->ki", turns, self._places) + moves
        gaps = points @ self._normal - self._height
        near = np.flatnonzero(gaps < self._look_ahead)
        joints = np.stack([np.zeros(len(near), dtype=int), self._joints[near]], axis=1)
        normals = np.tile(self._normal, (len(near), 1))
        return Contacts(joints, points[near], normals, gaps[near], self._mu[near], near)


class Geometry:
    """The collision pairs of a pinocchio.GeometryModel, a point each: the nearest one.

    mu: a number, or one a pair. look_ahead: pairs so near take part at their gap.
    """

    def __init__(self, geometry: Any, mu: ArrayLike = 0.5, *, look_ahead: float = 0.01) -> None:
        self._geometry, self._data = geometry, geometry.createData()
        self._look_ahead = look_ahead
        pairs = [(p.first, p.second) for p in geometry.collisionPairs]
        parents = [g.parentJoint for g in geometry.geometryObjects]
        self._joints = np.array([[parents[a], parents[b]] for a, b in pairs]).reshape(-1, 2)
        self._mu = np.array(np.broadcast_to(mu, len(pairs)), dtype=float)

    def __call__(self, model: Any, data: Any, q: Array) -> Contacts:
        pin.updateGeometryPlacements(model, data, self._geometry, self._data)
        pin.computeDistances(self._geometry, self._data)
        found = self._data.distanceResults
        gaps = np.array([d.min_distance for d in found])
        near = np.flatnonzero(gaps < self._look_ahead)
        which = near.tolist()
        points = [0.5 * (found[k].getNearestPoint1() + found[k].getNearestPoint2()) for k in which]
        normals = np.array([found[k].normal for k in which]).reshape(-1, 3)
        joints = self._joints[near]
        places = np.array(points).reshape(-1, 3)
        return Contacts(joints, places, normals, gaps[near], self._mu[near], near)


_NO_EQUATIONS = np.zeros((0, 0)), np.zeros(0)
Source = Callable[[Any, Any, Array], Contacts]


class Step(NamedTuple):
    """After a step."""

    q: Array
    v: Array
    how: Solved
    contacts: list[Contacts]  # of each source
    impulses: Array  # a row a contact: normal, and both tangents of frames()


def frames(normals: Array) -> Array:
    """(contacts, 3, 3): normal and two tangents of each, as rows."""
    least = np.argmin(np.abs(normals), axis=1)
    first = np.cross(normals, np.eye(3)[least])
    first /= np.linalg.norm(first, axis=1)[:, None]
    return np.stack([normals, first, np.cross(normals, first)], axis=1)


class Stepper:
    """Steps of one robot, or several in one model.

    model: a pinocchio.Model; its friction, damping and limits are read at each step.
    h: seconds a step.
    sources: Ground, Geometry, or functions (model, data, q) -> Contacts.
    equations: a function (model, data, q) -> (G, error): G v = 0 holds, and the error that has
        come up is taken away; closed loops by pinocchio.getConstraintJacobian().
    method, tol, max_iterations, time_limit: as for perp.contact().
    correction: the share of an overlap, or of an equation's error, that a step takes away.
    slop: the overlap that contacts and limits keep.
    """

    def __init__(
        self,
        model: Any,
        h: float,
        sources: Iterable[Source] = (),
        *,
        equations: Optional[Callable[[Any, Any, Array], tuple[Array, Array]]] = None,
        method: ContactMethod = "auto",
        tol: float = 1e-8,
        max_iterations: Optional[int] = None,
        time_limit: Optional[float] = None,
        correction: float = 0.2,
        slop: float = 1e-4,
    ) -> None:
        n = model.nv
        self.model, self.data, self.h = model, model.createData(), h
        self.sources, self.equations = list(sources), equations
        self.correction, self.slop = correction, slop
        self._solver = RowSolver(n, method, tol, max_iterations, time_limit)
        entries, diagonal = np.arange(n * n, dtype=np.int32), np.arange(0, n * n, n + 1)
        self._solver.set_mass(entries, diagonal.astype(np.int32))
        self._M = np.zeros((n, n))
        self._v, self._force, self._damping = np.zeros((3, n))
        self._solver.bind(
            mass=self._M, velocity=self._v, force=self._force, damping=self._damping
        )
        self._solver.numbers.h, self._solver.numbers.correction = h, correction
        self._solver.numbers.slop = slop
        pin.computeJointJacobians(model, self.data, pin.neutral(model))
        self._solver.set_reach((self.data.J[3:] != 0.0).any(0))
        self._supports = np.zeros((model.njoints, n), dtype=bool)
        for j in range(1, model.njoints):
            for k in model.supports[j]:
                self._supports[j, model.idx_vs[k] : model.idx_vs[k] + model.nvs[k]] = True
        lone = [j for j in range(1, model.njoints) if model.nqs[j] == model.nvs[j] == 1]
        self._limited_q = np.array([model.idx_qs[j] for j in lone], dtype=int)
        self._limited_v = np.array([model.idx_vs[j] for j in lone], dtype=int)
        self._key: Any = None
        self._names = self._start = np.zeros(0)
        self._warm = False

    def step(self, q: ArrayLike, v: ArrayLike, tau: Optional[ArrayLike] = None) -> Step:
        """Where q and v go in h, with torques tau; the arguments stay as they are."""
        model, data, h, solver = self.model, self.data, self.h, self._solver
        q, v = _arrays.vector(q, "q", model.nq), _arrays.vector(v, "v", model.nv)
        self._v[:], self._damping[:] = v, model.damping
        np.negative(pin.nonLinearEffects(model, data, q, v), out=self._force)
        self._force -= self._damping * v
        if tau is not None:
            self._force += _arrays.vector(tau, "tau", model.nv)
        M = pin.crba(model, data, q)
        self._M[:] = np.triu(M) + np.triu(M, 1).T
        pin.computeJointJacobians(model, data, q)
        contacts = [source(model, data, q) for source in self.sources]
        joined = _join(contacts)
        limits, sign, slack = self._limits(q)
        gaps = np.concatenate([joined.gaps, slack])
        G, error = _NO_EQUATIONS if self.equations is None else self.equations(model, data, q)
        self._set_laws(joined, limits, sign, len(G))
        self._fill(joined, limits, sign)
        self._gaps[self._rows.gaps] = gaps
        if len(G):
            self._J[solver.rows :], self._gaps[solver.rows :] = G, error
        count = len(joined.gaps)
        how = solver.step(self._warm)
        if self._warm and how.ok and count:
            how = solver.settle(how)
        self._warm = how.ok
        after, shift = solver.v.copy(), solver.shift
        moved = after if shift is None else after + shift
        impulses = solver.r[: 3 * count].reshape(count, 3).copy()
        return Step(pin.integrate(model, q, h * moved), after, how, contacts, impulses)

    def _limits(self, q: Array) -> tuple[NDArray[Any], Array, Array]:
        """Velocities at a limit, which way each opens, and how far it is."""
        lower = self.model.lowerPositionLimit[self._limited_q]
        upper = self.model.upperPositionLimit[self._limited_q]
        now = q[self._limited_q]
        low, high = np.flatnonzero(now < lower + 1e-3), np.flatnonzero(now > upper - 1e-3)
        sign = np.concatenate([np.ones(len(low)), -np.ones(len(high))])
        slack = np.concatenate([now[low] - lower[low], upper[high] - now[high]])
        return self._limited_v[np.concatenate([low, high])], sign, slack

    def _set_laws(
        self, contacts: Contacts, limits: NDArray[Any], sign: Array, equations: int
    ) -> None:
        """New laws, and the start's impulses, where other things touch."""
        model, solver, count = self.model, self._solver, len(contacts.gaps)
        low, high = self.h * model.lowerDryFrictionLimit, self.h * model.upperDryFrictionLimit
        self._dry = np.flatnonzero((low < 0.0) | (high > 0.0))
        bounds = low[self._dry], high[self._dry]
        names = np.concatenate([contacts.names, -1 - 2 * limits - (sign > 0)])
        key = names.tobytes(), contacts.mu.tobytes(), equations, low.tobytes(), high.tobytes()
        if key == self._key:
            return
        laws = Laws(
            np.full(count, 3, dtype=np.int32), contacts.mu.copy(), np.zeros(count),
            np.zeros(count), np.concatenate([np.zeros(len(limits)), bounds[0]]),
            np.concatenate([np.full(len(limits), np.inf), bounds[1]]),
        )  # fmt: skip
        before = dict(zip(self._names.tolist(), self._parts(solver.r.copy())))
        size = 3 * count + len(limits) + len(self._dry)
        numbers = np.arange(size + equations, dtype=np.int32)
        opens = [3 * np.arange(count), 3 * count + np.arange(len(limits))]
        self._rows = Rows(
            laws, numbers[:size], numbers[size:], np.concatenate(opens).astype(np.int32)
        )
        solver.arrange(self._rows, len(numbers))
        self._J, self._gaps = np.zeros((len(numbers), model.nv)), np.zeros(len(numbers))
        solver.bind_rows(self._J, self._gaps)
        self._key, self._names, self._contacts = key, names, count
        for name, part in zip(names.tolist(), self._parts(solver.start)):
            if name in before:
                part[:] = before[name]

    def _parts(self, r: Array) -> list[Array]:
        """The impulses of each contact and each limit."""
        if self._key is None:
            return []
        ends = 3 * self._contacts
        lone = range(ends, ends + len(self._names) - self._contacts)
        return [*r[:ends].reshape(-1, 3), *(r[k : k + 1] for k in lone)]

    def _fill(self, contacts: Contacts, limits: NDArray[Any], sign: Array) -> None:
        """H. A row of a contact is (direction, point x direction) times the difference of both
        bodies' twists at the origin, whose columns are those of the joints that carry them."""
        H, count = self._J[: self._solver.rows], len(contacts.gaps)
        D = frames(contacts.normals)
        wrench = np.concatenate([D, np.cross(contacts.points[:, None, :], D)], axis=2)
        first, second = contacts.joints.T
        moves = self._supports[second].astype(float) - self._supports[first]
        rows = (wrench.reshape(-1, 6) @ self.data.J).reshape(count, 3, self.model.nv) * moves[
            :, None, :
        ]
        H[: 3 * count] = rows.reshape(3 * count, self.model.nv)
        H[3 * count :] = 0.0
        k = 3 * count + np.arange(len(limits))
        H[k, limits] = sign
        H[3 * count + len(limits) + np.arange(len(self._dry)), self._dry] = 1.0


def _join(parts: list[Contacts]) -> Contacts:
    """All contacts, with names that tell the sources apart."""
    if not parts:
        none = np.zeros((0, 3))
        return Contacts(np.zeros((0, 2), int), none, none, none[:, 0], none[:, 0], np.zeros(0, int))
    names = [len(parts) * np.asarray(p.names, dtype=np.int64) + k for k, p in enumerate(parts)]
    columns = [np.concatenate(c) for c in zip(*(p[:5] for p in parts))]
    return Contacts._make([*columns, np.concatenate(names)])
