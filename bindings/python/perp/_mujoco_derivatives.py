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

    def changes(self, moved: Array, A: Array, G: Array, g: Array) -> Array:
        """Of M shift - J'push and of its rows; moved: M shift."""
        J = np.vstack([A[self.rows], G])
        u = J @ self.shift
        u[: len(self.rows)] += g[self.rows]
        return np.concatenate([moved - J.T @ self.push, u])


class Linearization:
    """A step of one model and its derivatives, with its own data."""

    def __init__(self, model: Any, stepper: Any) -> None:
        self.model, self._stepper = model, stepper
        self._data = mj.MjData(model)
        self._state = np.zeros(mj.mj_stateSize(model, _SPEC))

    def __call__(self, data: Any, eps: float, centered: bool) -> Derivatives:
        """At the state and control of data."""
        model, own = self.model, self._data
        mj.mj_copyData(own, model, data)
        mj.mj_getState(model, own, self._state, _SPEC)
        with self._stepper.borrowed:
            self._h, self._eps, self._centered = model.opt.timestep, eps, centered
            self._stepper.answer(own)
            self._keep()
            by_place = self._differences(self._by_place, self._at_place, model.nv)
            mj.mj_setState(model, own, self._state, _SPEC)
            mj.mj_fwdPosition(model, own)
            by_velocity = self._differences(self._by_force, self._at_velocity, model.nv)
            mj.mj_setState(model, own, self._state, _SPEC)
            mj.mj_fwdVelocity(model, own)
            by_activation = self._differences(self._by_force, self._at_activation, model.na)
            by_control = self._differences(self._by_force, self._at_control, model.nu)
        changes = np.hstack([
            np.vstack([x, np.zeros((len(by_place) - len(x), x.shape[1]))])
            for x in (by_place, by_velocity, by_activation, by_control)
        ])  # fmt: skip
        return self._assemble(changes)

    def _keep(self) -> None:
        """The answer, and the rows that are active in it."""
        stepper, own = self._stepper, self._data
        solver = stepper.solver
        self._rows = stepper.rows
        self._contacts = own.contact.geom.tobytes(), own.nefc
        self._which = np.concatenate([self._rows.H, self._rows.G])
        self._v, self._r, u = solver.v.copy(), solver.r.copy(), solver.u.copy()
        J, gaps = self._jacobian()
        self._M, count = stepper.metric(own), len(self._rows.H)
        u[count:] = 0.0
        self._J = J
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
        which = self._which
        if rows.pattern is None:
            J = own.efc_J.reshape(own.nefc, n)[which]
        else:
            J = np.zeros((own.nefc, n))
            mj.mju_sparse2dense(
                J, own.efc_J.ravel(), own.efc_J_rownnz, own.efc_J_rowadr, own.efc_J_colind.ravel()
            )
            J = J[which]
        if rows.scale is not None:
            J = J.copy()
            J[: len(rows.H)] *= rows.scale[:, None]
        return J, own.efc_pos[which]

    def _to_open(self, gaps: Array) -> Array:
        stepper = self._stepper
        inside = stepper.correction * np.minimum(gaps + stepper.slop, 0.0)
        return (inside + np.maximum(gaps, 0.0)) / self._h

    def _by_force(self) -> Array:
        """M (v' - v) - h f, and the next activations."""
        model, own, stepper = self.model, self._data, self._stepper
        mj.mj_fwdActuation(model, own)
        mj.mj_fwdAcceleration(model, own)
        stepper.rebind(own)
        balance = stepper.times(own, self._v - own.qvel) - self._h * stepper.force(own)
        if not model.na:
            return balance
        state = np.zeros_like(self._state)
        mj.mj_getState(model, own, state, _SPEC)
        mj.mj_Euler(model, own)
        act = own.act.copy()
        mj.mj_setState(model, own, state, _SPEC)
        return np.concatenate([balance, act])

    def _by_place(self) -> Optional[Array]:
        """The same less J'r, and velocities of rows; None where others touch."""
        model, own, rows = self.model, self._data, self._rows
        mj.mj_fwdPosition(model, own)
        geom, nefc = self._contacts
        if own.nefc != nefc or own.contact.geom.tobytes() != geom:
            return None
        mj.mj_fwdVelocity(model, own)
        force = self._by_force()
        J, gaps = self._jacobian()
        count, at_gaps = len(rows.H), gaps[rows.gaps]
        force[: model.nv] -= J.T @ self._r
        u = J @ self._v
        u[rows.gaps] += np.maximum(at_gaps, 0.0) / self._h
        u[count:] += self._stepper.correction / self._h * gaps[count:]
        opening = self._opening
        if not opening.moves:
            return np.concatenate([force, u])
        moved = self._stepper.times(own, opening.shift)
        opened = opening.changes(moved, J[rows.gaps], J[count:], self._to_open(at_gaps))
        return np.concatenate([force, u, opened])

    def _differences(self, function: Any, move: Any, count: int) -> Array:
        """A column for each of so many changes; of the other side where on one others touch."""
        eps, columns = self._eps, []
        here = self._at(function, move, 0, 0.0) if count and not self._centered else None
        for k in range(count):
            sides = [(here, 0.0)] if here is not None else []
            for step in (eps, -eps)[: 2 - len(sides)]:
                value = self._at(function, move, k, step)
                if value is not None:
                    sides.append((value, step))
            if len(sides) < 2:
                sides.append((self._at(function, move, k, 0.0), 0.0))
            if len(sides) < 2:  # from one side there is nothing
                sides.append((self._at(function, move, k, -eps), -eps))
            (a, s), (b, t) = sides[:2]
            columns.append((a - b) / (s - t))
        size = len(columns[0]) if columns else 0
        return np.array(columns).reshape(count, size).T

    def _at(self, function: Any, move: Any, k: int, step: float) -> Any:
        mj.mj_setState(self.model, self._data, self._state, _SPEC)
        move(k, step)
        return function()

    def _at_place(self, k: int, step: float) -> None:
        way = np.zeros(self.model.nv)
        way[k] = step
        mj.mj_integratePos(self.model, self._data.qpos, way, 1.0)

    def _at_velocity(self, k: int, step: float) -> None:
        self._data.qvel[k] += step
        mj.mj_fwdVelocity(self.model, self._data)

    def _at_activation(self, k: int, step: float) -> None:
        self._data.act[k] += step

    def _at_control(self, k: int, step: float) -> None:
        self._data.ctrl[k] += step

    def _assemble(self, changes: Array) -> Derivatives:
        n, na, size = self.model.nv, self.model.na, len(self._J)
        dF, dact, du, opened = np.split(changes, np.cumsum([n, na, size]))
        dv, one = _solve(self._M, self._J, self._active, self._r, dF, du)
        opening, ds, other = self._opening, 0.0, True
        if opening.moves:
            count = len(self._rows.H)
            J = np.vstack([self._J[self._rows.gaps][opening.rows], self._J[count:]])
            none = np.zeros((len(J), len(J)))
            holds = _Active(np.arange(len(J)), np.eye(len(J)), none, [], np.zeros(0))
            ds, other = _solve(self._M, J, holds, opening.push, opened[:n], opened[n:])
        turned, moved = self._places()
        dq = moved @ (dv + ds)
        dq[:, :n] += turned
        state = np.vstack([dq, dv, dact])
        margins = self._active.margins / self._scale
        index = int(np.argmin(margins)) if len(margins) else None
        margin = float(margins[index]) if index is not None else np.inf
        determined = one and other and opening.is_one
        verdict = "singular" if not determined else "degenerate" if margin < _EDGE else "regular"
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
