"""Derivatives of a step of a MuJoCo model: of its forces by differences, of its contacts in closed
form.

A step solves M (v' - v) = h f + H'r + G's with contact's laws on u = H v' + w. What M, f, H, G and
w do where place, velocity, activation or control change is MuJoCo's: differences of its smooth
functions with v', r and s fixed, no contact solved. What v' does then is a linear system of the
solution's active set (Pang and Stewart, Differential variational inequalities, Math. Program. 113,
2008): rows that hold, and friction that turns with what slips.
"""

from __future__ import annotations

from typing import Any, NamedTuple, Optional

import mujoco as mj  # type: ignore[import-untyped]
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_EDGE = 1e-6  # of the velocities of a step: nearer to another mode is on the edge
_RANK = 1e-9  # of the largest response of rows: less is none


class Derivatives(NamedTuple):
    """Of the next state by state and control, as mujoco.mjd_transitionFD has them: tangents of
    places, velocities and activations, one below the other."""

    A: Array
    B: Array
    verdict: str  # "regular"; "degenerate": one of several pieces; "singular": not determined
    margin: float  # how far the nearest contact or bound is from another mode, relative
    index: Optional[int]  # that contact, or contacts + a row with bounds; None where there is none


class _Active(NamedTuple):
    """What holds: dr = E x + K du, and rows C of H and G have du = 0."""

    held: NDArray[Any]
    E: Array
    K: Array
    turns: list[tuple[int, slice]]  # of what slips: its normal, and the rows whose K goes with that
    margins: Array


class _Modes:
    """Reads the active set of an answer, row by row."""

    def __init__(self, rows: int, size: int, response: Array) -> None:
        self._rows, self._size, self._W = rows, size, response
        self._held: list[int] = []
        self._columns: list[Array] = []
        self._K = np.zeros((size, size))
        self._turns: list[tuple[int, slice]] = []
        self._margins: list[float] = []

    def _hold(self, row: int) -> Array:
        column = np.zeros(self._size)
        column[row] = 1.0
        self._held.append(row)
        self._columns.append(column)
        return column

    def contact(self, first: int, discs: list[tuple[int, int, float]], r: Array, u: Array) -> None:
        """discs: first row, rows and coefficient of what friction has."""
        push = r[first] * self._W[first]
        self._margins.append(max(push, u[first]))
        if u[first] > push:
            return
        normal = self._hold(first)
        for begin, count, mu in discs:
            here = slice(begin, begin + count)
            slack, speed = mu * r[first] - np.linalg.norm(r[here]), float(np.linalg.norm(u[here]))
            slack *= self._W[here].mean()
            self._margins[-1] = min(self._margins[-1], max(slack, speed))
            if slack >= speed:
                for row in range(begin, begin + count):
                    self._hold(row)
                continue
            e = u[here] / speed
            normal[here] = -mu * e
            self._turns.append((first, here))
            self._K[here, here] = -mu * r[first] / speed * (np.eye(count) - np.outer(e, e))

    def bounded(self, row: int, low: float, high: float, r: float, u: float) -> None:
        slack = self._W[row] * (r - low if u > 0.0 else high - r)
        least = self._W[row] * min(r - low, high - r)
        self._margins.append(max(abs(u), least))
        if abs(u) <= slack:
            self._hold(row)

    def read(self) -> _Active:
        for row in range(self._rows, self._size):
            self._hold(row)
        E = np.array(self._columns).reshape(len(self._held), self._size).T
        held, margins = np.array(self._held, dtype=int), np.array(self._margins)
        return _Active(held, E, self._K, self._turns, margins)


def _read(laws: Any, rows: int, J: Array, M: Array, r: Array, u: Array) -> _Active:
    modes = _Modes(rows, len(J), np.einsum("ij,ji->i", J, np.linalg.solve(M, J.T)))
    place = 0
    for dim, mu, rolling, spinning in zip(laws.dims, laws.mu, laws.rolling, laws.spinning):
        discs, after = [], place + 1
        turns = (dim - 1, mu), (dim - 1, rolling), (1, spinning)
        for k, (count, coefficient) in enumerate(turns):
            if count and (k == 0 or coefficient > 0.0):
                discs.append((after, int(count), float(coefficient)))
                after += count
        modes.contact(place, discs, r, u)
        place = after
    for low, high in zip(laws.lower, laws.upper):
        modes.bounded(place, low, high, r[place], u[place])
        place += 1
    return modes.read()


def _solve(
    M: Array, J: Array, active: _Active, r: Array, dF: Array, du: Array
) -> tuple[Array, bool]:
    """dv for each column of the changes dF of M v - f - J'r and du of u; and whether it is
    determined.

    M dv = -dF + J'(E x + K (J dv + du)),   J dv = -du in the rows that hold.
    """
    JK = J.T @ active.K
    inner = np.linalg.inv(M - JK @ J)
    free = inner @ (JK @ du - dF)
    if not len(active.held):
        return free, True
    C, push = J[active.held], inner @ (J.T @ active.E)
    left, sizes, right = np.linalg.svd(C @ push)
    rank = int((sizes > _RANK * sizes[0]).sum())
    needed = left.T @ (-du[active.held] - C @ free)
    dv = free + push @ (right[:rank].T @ (needed[:rank] / sizes[:rank, None]))
    asked = np.abs(needed[:rank]).max(initial=0.0)
    met = np.abs(needed[rank:]).max(initial=0.0) <= 1e-5 * asked
    loose = right[rank:].T  # impulses that no row that holds feels
    unfelt = np.abs(push @ loose).max(initial=0.0) <= 1e-6 * np.abs(push).max()
    shares = _shares(inner @ J.T, J @ dv + du, active, active.E @ loose, r)
    return dv, bool(met and unfelt and shares <= 1e-6 * np.abs(dv).max(initial=0.0))


def _shares(push: Array, du: Array, active: _Active, loose: Array, r: Array) -> float:
    """How much dv depends on how redundant contacts share their load: friction turns with what
    slips the slower the more a contact bears."""
    most = 0.0
    for way in loose.T:
        turned = np.zeros_like(du)
        for normal, here in active.turns:
            share = way[normal] / np.abs(way).max() * np.abs(r).max() / r[normal]
            turned[here] = share * (active.K[here, here] @ du[here])
        most = max(most, float(np.abs(push @ turned).max(initial=0.0)))
    return most


class _Opening:
    """The velocity that takes overlaps away, and the rows that make it."""

    def __init__(self, shift: Array, M: Array, A: Array, G: Array, g: Array) -> None:
        self.shift, self.moves, self.is_one = shift, bool(shift.any()), True
        if self.moves:
            self._read(M, A, G, g)

    def _read(self, M: Array, A: Array, G: Array, g: Array) -> None:
        shift = self.shift
        u = A @ shift + g
        close = np.flatnonzero(u <= 1e-7 * np.abs(g).max(initial=0.0))
        push = np.linalg.lstsq(np.vstack([A[close], G]).T, M @ shift, rcond=1e-9)[0]
        bears = push[: len(close)] > 1e-9 * np.abs(push).max(initial=0.0)
        self.rows = close[bears]
        self.push = np.concatenate([push[: len(close)][bears], push[len(close) :]])
        missed = M @ shift - np.vstack([A[self.rows], G]).T @ self.push
        small = 1e-6 * np.abs(M @ shift).max(initial=0.0)
        self.is_one = bool(np.abs(missed).max(initial=0.0) <= small)

    def changes(self, moved: Array, A: Array, G: Array, g: Array) -> list[Array]:
        """Of M shift - J'push and of its rows; moved: M shift. A state each."""
        J = np.concatenate([A[:, self.rows], G], axis=1)
        u = J @ self.shift
        u[:, : len(self.rows)] += g[:, self.rows]
        return [moved - np.einsum("kij,i->kj", J, self.push), u]


class _Moved(NamedTuple):
    """A step's numbers at states near its own, one below the other; none where others touch."""

    there: NDArray[Any]
    F: Array  # M (v' - v) - h f
    act: Array
    moved: Array  # M shift
    J: Array
    gaps: Array


class Linearization:
    """A step of one model and its derivatives, with its own data."""

    def __init__(self, model: Any, stepper: Any) -> None:
        self.model, self._stepper = model, stepper
        self._data = mj.MjData(model)
        self._state = np.zeros(mj.mj_stateSize(model, _SPEC))
        self._ways = np.random.default_rng(0).choice([-1.0, 1.0], max(model.nv, model.nu, model.na))
        alone = not model.na or int(model.actuator_actnum.max()) <= 1
        self._own_act = model.actuator_actadr if alone else None
        row, place = np.repeat(np.arange(model.nv), model.D_rownnz), model.D_colind
        self._of_D = row, place

    def __call__(self, data: Any, eps: float, centered: bool) -> Derivatives:
        """At the state and control of data."""
        model, own = self.model, self._data
        mj.mj_copyData(own, model, data)
        mj.mj_getState(model, own, self._state, _SPEC)
        with self._stepper.borrowed:
            self._h, self._eps, self._centered = model.opt.timestep, eps, centered
            self._stepper.answer(own)
            self._keep()
            by_place, du, opened = self._by_places()
            self._restore(mj.mj_fwdPosition)
            by_velocity = self._by_velocities()
            self._restore(mj.mj_fwdVelocity)
            by_activation = self._by_drives(own.act, model.na)
            by_control = self._by_drives(own.ctrl, model.nu)
        others = [by_velocity, by_activation, by_control]
        changes = np.hstack([by_place, *others])
        return self._assemble(changes, du, opened)

    def _restore(self, stage: Any) -> None:
        mj.mj_setState(self.model, self._data, self._state, _SPEC)
        stage(self.model, self._data)

    def _keep(self) -> None:
        """The answer, and the rows that are active in it."""
        stepper, own = self._stepper, self._data
        solver = stepper.solver
        self._rows = stepper.rows
        self._contacts = own.nefc, own.contact.geom.tobytes()
        self._which = np.concatenate([self._rows.H, self._rows.G])
        self._v, self._r, u = solver.v.copy(), solver.r.copy(), solver.u.copy()
        J, gaps = self._jacobian()
        self._M, count = stepper.metric(own), len(self._rows.H)
        u[count:] = 0.0
        self._J, self._gaps = J, gaps
        self._active = _read(self._rows.laws, count, J, self._M, self._r, u)
        self._scale = max(solver.numbers.driven, solver.numbers.fastest, 1e-300)
        shift = np.zeros(len(self._v)) if solver.shift is None else solver.shift.copy()
        A, g = J[self._rows.gaps], self._to_open(gaps[self._rows.gaps])
        self._opening = _Opening(shift, self._M, A, J[count:], g)

    def _jacobian(self) -> tuple[Array, Array]:
        """Rows of H, then of G, and the gaps of all of them."""
        own, n, rows = self._data, self.model.nv, self._rows
        if own.nefc == 0:
            return np.zeros((0, n)), np.zeros(0)
        sparse = rows.pattern is not None
        J = (self._sparse_rows() if sparse else own.efc_J.reshape(own.nefc, n))[self._which]
        if rows.scale is not None:
            J[: len(rows.H)] *= rows.scale[:, None]
        return J, own.efc_pos[self._which]

    def _to_open(self, gaps: Array) -> Array:
        stepper = self._stepper
        inside = stepper.correction * np.minimum(gaps + stepper.slop, 0.0)
        return (inside + np.maximum(gaps, 0.0)) / self._h

    def _by_force(self) -> tuple[Array, Array]:
        """M (v' - v) - h f, and the next activations, where places and velocities are."""
        model, own, stepper = self.model, self._data, self._stepper
        mj.mj_fwdActuation(model, own)
        mj.mj_fwdAcceleration(model, own)
        stepper.rebind(own)
        balance = stepper.times(own, self._v - own.qvel) - self._h * stepper.force(own)
        return balance, self._next_act() if model.na else own.act

    def _at_places(self, changes: Array) -> _Moved:
        """All of a step at places that are moved by these: MuJoCo's numbers state by state, what is
        made of them at once."""
        model, own, stepper = self.model, self._data, self._stepper
        size, n, (nefc, geoms) = len(changes), model.nv, self._contacts
        there, act = np.ones(size, dtype=bool), np.zeros((size, model.na))
        sparse = self._rows.pattern is not None
        rows, gaps = np.zeros((size, nefc, n)), np.zeros((size, nefc))
        mass, force = np.zeros((size, model.nC)), np.zeros((size, n))
        mj.mj_setState(model, own, self._state, _SPEC)
        place, qpos, M = own.qpos.copy(), own.qpos, stepper.metric_mass(own)
        implicit = M is not own.M
        f, advances = stepper.force(own), model.na and self._acts_move(place, changes)
        for k, change in enumerate(changes):
            qpos[:] = place
            mj.mj_integratePos(model, qpos, change, 1.0)
            for stage in _STAGES:
                stage(model, own)
            if implicit:
                stepper.rebind(own)
            if advances:
                act[k] = self._next_act()
            mass[k], force[k] = M, f
            if nefc:
                there[k] = own.nefc == nefc and own.contact.geom.tobytes() == geoms
                if there[k]:
                    rows[k] = self._sparse_rows() if sparse else own.efc_J.reshape(nefc, n)
                    gaps[k] = own.efc_pos
        J, which = rows[:, self._which], self._which
        if self._rows.scale is not None:
            J[:, : len(self._rows.H)] *= self._rows.scale[:, None]
        F = stepper.times_mass(mass, self._v - own.qvel) - self._h * force
        moved = stepper.times_mass(mass, self._opening.shift) if self._opening.moves else F
        return _Moved(there, F, act, moved, J, gaps[:, which])

    def _sparse_rows(self) -> Array:
        own = self._data
        J = np.zeros((own.nefc, self.model.nv))
        columns = own.efc_J_colind.ravel()
        mj.mju_sparse2dense(J, own.efc_J.ravel(), own.efc_J_rownnz, own.efc_J_rowadr, columns)
        return J

    def _next_act(self) -> Array:
        model, own, state = self.model, self._data, np.zeros_like(self._state)
        mj.mj_getState(model, own, state, _SPEC)
        mj.mj_Euler(model, own)
        act = own.act.copy()
        mj.mj_setState(model, own, state, _SPEC)
        return act

    def _acts_move(self, place: Array, changes: Array) -> bool:
        """Whether activations go another way where all places have changed."""
        model, own, acts = self.model, self._data, []
        for change in np.zeros(model.nv), changes.max(0) * self._ways[: model.nv]:
            own.qpos[:] = place
            mj.mj_integratePos(model, own.qpos, change, 1.0)
            for stage in _STAGES:
                stage(model, own)
            acts.append(self._next_act())
        return bool((acts[0] != acts[1]).any())

    def _by_places(self) -> tuple[Array, Array, Array]:
        """By places: columns of the balance and the activations, of velocities of rows, and of what
        opens overlaps."""
        model, eps = self.model, self._eps
        n, rows = model.nv, self._rows
        ways = np.vstack([np.zeros((1, n)), eps * np.eye(n), -eps * np.eye(n)])
        if not self._centered:
            ways = ways[: n + 1]
        at = self._at_places(ways)
        count, gaps = len(rows.H), at.gaps[:, rows.gaps]
        F = at.F - np.einsum("kij,i->kj", at.J, self._r)
        u = at.J @ self._v
        u[:, rows.gaps] += np.maximum(gaps, 0.0) / self._h
        u[:, count:] += self._stepper.correction / self._h * at.gaps[:, count:]
        parts = [F, at.act, u]
        opening = self._opening
        if opening.moves:
            parts += opening.changes(
                at.moved, at.J[:, rows.gaps], at.J[:, count:], self._to_open(gaps)
            )
        all_of_it = np.hstack(parts)
        up, down = 1 + np.arange(n), 1 + n * self._centered + np.arange(n)
        down = down if self._centered else np.zeros(n, dtype=int)
        # on one side of an edge the other side's numbers are nobody's
        up, down = np.where(at.there[up], up, 0), np.where(at.there[down], down, 0)
        step = (up > 0) * eps + (down > 0) * eps
        self._held = step == 0.0
        columns = (all_of_it[up] - all_of_it[down]) / np.where(self._held, 1.0, step)[:, None]
        for k in np.flatnonzero(self._held):
            columns[k] = self._with_rows_held(at, k, all_of_it.shape[1])
        first, second = n + model.na, n + model.na + len(self._J)
        return columns[:, :first].T, columns[:, first:second].T, columns[:, second:].T

    def _with_rows_held(self, at: _Moved, k: int, size: int) -> Array:
        """Where others touch on both sides: as if contacts kept their points and directions."""
        n, rows, count = self.model.nv, self._rows, len(self._rows.H)
        column, side = np.zeros(size), 2.0 * self._eps
        a, b = (1 + k, 1 + n + k) if self._centered else (1 + k, 0)
        side = side if self._centered else self._eps
        column[:n], column[n : n + self.model.na] = at.F[a] - at.F[b], at.act[a] - at.act[b]
        column /= side
        u = column[n + self.model.na :][: len(self._J)]
        u[rows.gaps] += self._J[rows.gaps, k] * (self._gaps[rows.gaps] > 0.0) / self._h
        u[count:] += self._stepper.correction / self._h * self._J[count:, k]
        return column

    def _by_velocities(self) -> Array:
        """MuJoCo's own derivatives, where they are those of the balance along one way."""
        model, own, stepper = self.model, self._data, self._stepper
        n, options = model.nv, model.opt
        integrator, options.integrator = options.integrator, _IMPLICIT
        try:
            mj.mj_implicit(model, own)
        finally:
            options.integrator = integrator
        D = np.zeros((n, n))
        D[self._of_D] = own.qDeriv
        self._restore(mj.mj_fwdVelocity)
        columns = np.vstack([-self._M - self._h * D, np.zeros((model.na, n))])
        return self._proved(columns, own.qvel, n, mj.mj_fwdVelocity)

    def _by_drives(self, numbers: Array, count: int) -> Array:
        """By controls or activations, where each is of one actuator with a force of its own."""
        model, own, eps = self.model, self._data, self._eps
        if not count or self._own_act is None:
            return self._proved(None, numbers, count, None)
        here, forces, acts = numbers.copy(), [], []
        for step in (eps, -eps):
            numbers[:] = here + step
            acts.append(self._by_force()[1].copy())
            forces.append(own.actuator_force.copy())
        numbers[:] = here
        slope, of_act = (forces[0] - forces[1]) / (2.0 * eps), (acts[0] - acts[1]) / (2.0 * eps)
        moment = np.zeros((model.nu, model.nv))
        mj.mju_sparse2dense(
            moment, own.actuator_moment, own.moment_rownnz, own.moment_rowadr, own.moment_colind
        )
        columns = np.zeros((model.nv + model.na, count))
        acting, own_act = np.arange(model.nu), self._own_act
        has = own_act >= 0
        if numbers is own.act or count != model.nu:
            acting = acting[has]
            places = own_act[has]
        else:
            places = acting
        columns[: model.nv, places] = -self._h * (moment * slope[:, None]).T[:, acting]
        with_act = acting[has[acting]]
        columns[model.nv + own_act[with_act], places[has[acting]]] = of_act[own_act[with_act]]
        return self._proved(columns, numbers, count, None)

    def _proved(self, columns: Optional[Array], numbers: Array, count: int, stage: Any) -> Array:
        """Columns that agree with a difference along one way, or differences."""
        if not count:
            return np.zeros((self.model.nv + self.model.na, 0))
        if columns is not None:
            way = self._ways[:count]
            seen, should = self._difference(numbers, way, stage), columns @ way
            size = np.abs(columns).sum(1).max() + 1e-3 * self._h * np.abs(self._force()).max()
            if np.abs(seen - should).max(initial=0.0) <= 1e-6 * size:
                return columns
        ways = np.eye(count)
        found = [self._difference(numbers, way, stage) for way in ways]
        return np.array(found).T

    def _force(self) -> Array:
        return np.asarray(self._data.qfrc_smooth)

    def _difference(self, numbers: Array, way: Array, stage: Any) -> Array:
        here, sides = numbers.copy(), []
        steps = (self._eps, -self._eps if self._centered else 0.0)
        for step in steps:
            numbers[:] = here + step * way
            if stage is not None:
                stage(self.model, self._data)
            sides.append(np.concatenate(self._by_force()))
        numbers[:] = here
        return (sides[0] - sides[1]) / (steps[0] - steps[1])

    def _assemble(self, changes: Array, du: Array, opened: Array) -> Derivatives:
        n, na = self.model.nv, self.model.na
        dF, dact = changes[:n], changes[n:]
        du = np.hstack([du, np.zeros((len(du), changes.shape[1] - n))])
        dv, one = _solve(self._M, self._J, self._active, self._r, dF, du)
        opening, ds, other = self._opening, np.zeros((n, 0)), True
        if opening.moves:
            count = len(self._rows.H)
            J = np.vstack([self._J[self._rows.gaps][opening.rows], self._J[count:]])
            none = np.zeros((len(J), len(J)))
            holds = _Active(np.arange(len(J)), np.eye(len(J)), none, [], np.zeros(0))
            ds, other = _solve(self._M, J, holds, opening.push, opened[:n], opened[n:])
        turned, moved = self._places()
        dq = moved @ dv
        dq[:, : ds.shape[1]] += moved @ ds
        dq[:, :n] += turned
        state = np.vstack([dq, dv, dact])
        margins = self._active.margins / self._scale
        index = int(np.argmin(margins)) if len(margins) else None
        margin = float(margins[index]) if index is not None else np.inf
        determined, edge = one and other and opening.is_one, margin < _EDGE or self._held.any()
        verdict = "singular" if not determined else "degenerate" if edge else "regular"
        return Derivatives(state[:, : 2 * n + na], state[:, 2 * n + na :], verdict, margin, index)

    def _places(self) -> tuple[Array, Array]:
        """How the next place turns with this one, and moves with the velocity."""
        model, h = self.model, self._h
        turned, moved = np.eye(model.nv), h * np.eye(model.nv)
        v, nothing = self._v + self._opening.shift, np.zeros(3)
        for kind, first in zip(model.jnt_type.tolist(), model.jnt_dofadr.tolist()):
            if kind in _TURNS:
                first += _TURNS[kind]
                here = slice(first, first + 3)
                of_place, of_velocity = np.zeros(9), np.zeros(9)
                mj.mjd_quatIntegrate(v[here], h, of_place, of_velocity, nothing)
                turned[here, here] = of_place.reshape(3, 3)
                moved[here, here] = h * of_velocity.reshape(3, 3)
        return turned, moved


_TURNS = {int(mj.mjtJoint.mjJNT_FREE): 3, int(mj.mjtJoint.mjJNT_BALL): 0}
_SPEC = int(mj.mjtState.mjSTATE_INTEGRATION)
_IMPLICIT = int(mj.mjtIntegrator.mjINT_IMPLICIT)
# Of a step's forces: mj_fwdPosition without what the constraint solver needs, where a version has that by itself
_ALONE = "fwdKinematics", "makeM", "factorM", "collision", "makeConstraint", "transmission"
_NAMES = _ALONE if all(hasattr(mj, f"mj_{x}") for x in _ALONE) else ("fwdPosition",)
_LATER = "fwdVelocity", "fwdActuation", "fwdAcceleration"
_STAGES = [getattr(mj, f"mj_{x}") for x in _NAMES + _LATER]
