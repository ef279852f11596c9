"""Derivatives of a step of a MuJoCo model: of its forces by differences, of its contacts in closed
form.

A step solves M (v' - v) = h f + H'r + G's with contact's laws on u = H v' + w. What M and f do
where place, velocity, activation or control change is MuJoCo's own to say: differences of its
inverse dynamics and actuation with v' held. H and G follow from the bodies' axes, or are
differenced; no contact is solved. What v' does then is a linear system of the solution's active set
(Pang and Stewart, Differential variational inequalities, Math. Program. 113, 2008): rows that hold,
and friction that turns with what slips.
"""

from __future__ import annotations

import contextlib
import math
from collections.abc import Iterator
from typing import Any, NamedTuple, Optional

import mujoco as mj  # type: ignore[import-untyped]
import numpy as np
from numpy.typing import NDArray

from ._mujoco_model import FAST, RK4, turns
from ._mujoco_run import has_callbacks
from ._mujoco_tangents import TURNS, Contacts, Dynamics, Kinematics, Tree, has_constant_rows

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
        self._rows, self._size, self._W = rows, size, response.tolist()
        self._held: list[int] = []
        self._shares: list[tuple[int, int, float]] = []  # entries of E beside those that hold
        self._K = np.zeros((size, size))
        self._turns: list[tuple[int, slice]] = []
        self._margins: list[float] = []

    def _hold(self, row: int) -> int:
        self._held.append(row)
        return len(self._held) - 1

    def contact(
        self, first: int, discs: list[tuple[int, int, float]], r: list[float], u: list[float]
    ) -> None:
        """discs: first row, rows and coefficient of what friction has."""
        push = r[first] * self._W[first]
        self._margins.append(max(push, u[first]))
        if u[first] > push:
            return
        normal = self._hold(first)
        for begin, count, mu in discs:
            end = begin + count
            here = slice(begin, end)
            slack, speed = mu * r[first] - math.hypot(*r[here]), math.hypot(*u[here])
            slack *= sum(self._W[here]) / count
            self._margins[-1] = min(self._margins[-1], max(slack, speed))
            if slack >= speed:
                self._held.extend(range(begin, end))
                continue
            e = np.array(u[here]) / speed
            self._shares += [(begin + k, normal, -mu * e[k]) for k in range(count)]
            self._turns.append((first, here))
            self._K[here, here] = -mu * r[first] / speed * (np.eye(count) - np.outer(e, e))

    def bounded(self, row: int, low: float, high: float, r: float, u: float) -> None:
        slack = self._W[row] * (r - low if u > 0.0 else high - r)
        least = self._W[row] * min(r - low, high - r)
        self._margins.append(max(abs(u), least))
        if abs(u) <= slack:
            self._hold(row)

    def read(self) -> _Active:
        self._held.extend(range(self._rows, self._size))
        held, margins = np.array(self._held, dtype=int), np.array(self._margins)
        E = np.zeros((self._size, len(held)))
        E[held, range(len(held))] = 1.0
        for row, column, share in self._shares:
            E[row, column] = share
        return _Active(held, E, self._K, self._turns, margins)


def _read(laws: Any, rows: int, J: Array, inverse: Array, r: Array, u: Array) -> _Active:
    """inverse: of M."""
    if not len(J):
        return _Active(np.zeros(0, dtype=int), np.zeros((0, 0)), J @ J.T, [], np.zeros(0))
    modes = _Modes(rows, len(J), ((J @ inverse) * J).sum(1))
    place, r, u = 0, r.tolist(), u.tolist()
    for contact in zip(*(x.tolist() for x in laws[:4])):
        dim, mu, rolling, spinning = contact
        discs, after = [], place + 1
        turns = (dim - 1, mu), (dim - 1, rolling), (1, spinning)
        for k, (count, coefficient) in enumerate(turns):
            if count and (k == 0 or coefficient > 0.0):
                discs.append((after, count, coefficient))
                after += count
        modes.contact(place, discs, r, u)
        place = after
    for low, high in zip(laws.lower.tolist(), laws.upper.tolist()):
        modes.bounded(place, low, high, r[place], u[place])
        place += 1
    return modes.read()


def _largest(x: Array) -> float:
    return float(max(x.max(), -x.min())) if x.size else 0.0


def _inverse_of(W: Array) -> Optional[Array]:
    """Where its least singular value is surely above _RANK of the largest: the product of the
    norms of W and its inverse is at least their quotient."""
    if not W.diagonal().all():  # a row that nothing moves, as of what is across a plane
        return None
    try:
        inverse = np.linalg.inv(W)
    except np.linalg.LinAlgError:
        return None
    bound = np.vdot(W, W) * np.vdot(inverse, inverse)
    return inverse if bound < (0.1 / _RANK) ** 2 else None


def _solve(
    metric: tuple[Array, Array], J: Array, active: _Active, r: Array, dF: Array, du: Array
) -> tuple[Array, bool]:
    """dv for each column of the changes dF of M v - f - J'r and du of u; and whether it is
    determined. metric: M and its inverse.

    M dv = -dF + J'(E x + K (J dv + du)),   J dv = -du in the rows that hold.
    """
    (M, inner), load = metric, -dF
    if active.turns:
        JK = J.T @ active.K
        inner, load = np.linalg.inv(M - JK @ J), JK @ du - dF
    free = inner @ load
    if not len(active.held):
        return free, True
    C, push = J[active.held], inner @ (J.T @ active.E)
    response, needed = C @ push, -du[active.held] - C @ free
    inverse = _inverse_of(response) if len(C) <= len(M) else None
    if inverse is not None:
        return free + push @ (inverse @ needed), True
    left, sizes, right = np.linalg.svd(response)
    rank = int((sizes > _RANK * sizes[0]).sum())
    needed = left.T @ needed
    dv = free + push @ (right[:rank].T @ (needed[:rank] / sizes[:rank, None]))
    if rank == len(sizes):
        return dv, True
    asked = np.abs(needed[:rank]).max(initial=0.0)
    met = np.abs(needed[rank:]).max() <= 1e-5 * asked
    loose = right[rank:].T  # impulses that no row that holds feels
    unfelt = np.abs(push @ loose).max() <= 1e-6 * np.abs(push).max()
    if not (met and unfelt and active.turns):
        return dv, bool(met and unfelt)
    shares = _shares(inner @ J.T, J @ dv + du, active, active.E @ loose, r)
    return dv, shares <= 1e-6 * np.abs(dv).max(initial=0.0)


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

    def __init__(self, shift: Array, shares: Array) -> None:
        """shift: as it was made, which is `shares` of self.shift."""
        self.made, self.moves, self.is_one = shift, bool(shift.any()), True
        self.shift, self._shares = (shift / shares if self.moves else shift), shares
        self._reached = np.zeros(len(shift), dtype=int)
        self.at_once = False  # whether several coordinates of one part are at their reach

    def read(self, metric: tuple[Array, Array], A: Array, G: Array, g: Array) -> None:
        """metric: M and its inverse."""
        (M, inverse), shift = metric, self.shift
        close = np.flatnonzero(A @ shift + g <= 1e-7 * _largest(g))
        C, asked = np.concatenate([A[close], G]), M @ shift
        response = _inverse_of(C @ inverse @ C.T) if 0 < len(C) <= len(M) else None
        if response is None:
            push = np.linalg.lstsq(C.T, asked, rcond=1e-9)[0]
        else:
            push = response @ (C @ shift)
        bears = push > 1e-9 * _largest(push)
        bears[len(close) :] = True
        self.response = response if bears.all() else None
        self.rows, self.push, self.J = close[bears[: len(close)]], push[bears], C[bears]
        self.is_one = _largest(asked - self.push @ self.J) <= 1e-6 * _largest(asked)

    def changes(self, metric: tuple[Array, Array], dF: Array, du: Array) -> tuple[Array, bool]:
        """As _solve, of the shift."""
        inverse, J, count = metric[1], self.J, len(self.J)
        if self.response is None:
            holds = _Active(np.arange(count), np.eye(count), np.zeros((count, count)), [], du[0])
            return _solve(metric, J, holds, self.push, dF, du)
        free = -(inverse @ dF)
        return free - inverse @ (J.T @ (self.response @ (du + J @ free))), True

    def find_reached(self, turns: Array, M: Array, J: Array) -> None:
        """Of each coordinate that is shortened: the one at its reach in its part, which M and rows
        join."""
        rows = (J != 0.0).astype(float)
        joined = ((M != 0.0) | (rows.T @ rows > 0.0)).astype(float)
        while (wider := (joined @ joined > 0.0).astype(float)).sum() > joined.sum():
            joined = wider
        ways = joined * (turns * np.abs(self.made))
        self._reached, most = np.argmax(ways, axis=1), ways.max(axis=1)
        near = (ways >= (1.0 - _EDGE) * most[:, None]).sum(1)
        self.at_once = bool((near[self._shares < 1.0] > 1).any())

    def shorten(self, ds: Array) -> Array:
        """Changes of the shift as it is made, of those of self.shift: s_m / |s_m| stays."""
        changes, short = ds.copy(), np.flatnonzero(self._shares < 1.0)
        reached = self._reached[short]
        changes[short] -= self.shift[short, None] * ds[reached] / self.shift[reached, None]
        return np.asarray(self._shares[:, None] * changes)


class _Rows:
    """How J and the gaps of its rows move with places, as differences; closed form: Contacts."""

    def __init__(self, dJ: Array, gaps: Array) -> None:
        """dJ: (places, rows, n), gaps: (places, rows)."""
        self._dJ, self.gaps = dJ, gaps.T

    def forces(self, r: Array) -> Array:
        """Of J'r with r held: (n, places) for each of some r."""
        return np.matmul(r, self._dJ).transpose(1, 2, 0)

    def velocities(self, v: Array) -> Array:
        """Of J v with v held: (rows, places) for each of some v."""
        return np.matmul(self._dJ, v.T).transpose(2, 1, 0)


class _Smooth(NamedTuple):
    """Of the balance and the activations by places and by velocities, and of M shift by places."""

    by_place: Array
    by_velocity: Array
    moved: Array


class Linearization:
    """A step of one model and its derivatives, with its own data."""

    def __init__(self, model: Any, stepper: Any) -> None:
        self.model, self._stepper = model, stepper
        self._data = mj.MjData(model)
        self._state, self._room = np.zeros((2, mj.mj_stateSize(model, _SPEC)))
        self._ways = np.random.default_rng(0).choice([-1.0, 1.0], max(model.nv, model.nu, model.na))
        shared = model.jnt_actfrclimited.any() or np.any(getattr(model, "tendon_actfrclimited", 0))
        several = (model.na and int(model.actuator_actnum.max()) > 1) or model.nplugin
        self._apart = not (several or shared)  # each force is of its own control and activation
        driven = np.flatnonzero(model.actuator_actadr >= 0)
        self._driven = driven, model.actuator_actadr[driven]
        self._filters = bool(np.isin(model.actuator_dyntype, _FILTERS).all())
        adheres = (model.actuator_trntype == int(mj.mjtTrn.mjTRN_BODY)).any()
        self._adheres = bool(adheres or getattr(model, "flg_adhesion", 0))  # forces of contacts
        self._tree = Tree(model)
        self._straight, self._constant = has_constant_rows(model)
        self._units = np.eye(model.nv)
        straight = np.isin(model.jnt_type, list(TURNS), invert=True)
        self._straight_places = model.jnt_qposadr[straight], model.jnt_dofadr[straight]
        self._damped = np.repeat(np.arange(model.nv), model.D_rownnz)
        kinds = zip(model.jnt_type.tolist(), model.jnt_dofadr.tolist())
        self._turning = [first + TURNS[kind] for kind, first in kinds if kind in TURNS]

    def __call__(self, data: Any, eps: float, centered: bool) -> Derivatives:
        """At the state and control of data."""
        with self._stepper.borrowed, self._begun(data):
            self._h, self._eps, self._centered = self.model.opt.timestep, eps, centered
            self._sides = np.array([eps, -eps] if centered else [eps])
            self._rows = self._stepper.answer(self._data)
            if self.model.opt.integrator == RK4 and not self._data.nefc:
                return self._by_whole_steps()
            self._keep()
            changes, rows, moved = self._changes()
        du, opened = self._of_rows(rows, changes, moved)
        return self._assemble(changes, du, opened)

    @contextlib.contextmanager
    def _begun(self, data: Any) -> Iterator[None]:
        """Its own data is as data, and sensors, of which nothing depends unless Python is called,
        are left out."""
        model, own, options = self.model, self._data, self.model.opt
        mj.mj_getState(model, data, self._state, _SPEC)
        self._calls = has_callbacks()
        kept = options.disableflags, options.enableflags, options.noslip_iterations
        try:
            options.enableflags, options.noslip_iterations = kept[1] & ~_DISCRETE, 0
            if self._calls or model.nplugin:
                mj.mj_copyData(own, model, data)
            else:
                mj.mj_setState(model, own, self._state, _SPEC)
                options.disableflags = kept[0] | _NO_SENSORS
            yield
        finally:
            options.disableflags, options.enableflags, options.noslip_iterations = kept

    def _changes(self) -> tuple[Array, Any, Array]:
        """Of the balance and the activations by all; of rows, and of M shift, by places."""
        own, kinematics = self._data, None
        drives = self._of_drives()
        if self.model.nv >= _MANY:
            kinematics = Kinematics(self._tree, own)
        forces = self._forces_in_closed_form(kinematics) if kinematics else None
        rows = self._rows_in_closed_form(kinematics)
        if self._is_steady():
            rows = rows or self._at_places(False)[0]
            by_place, by_velocity, moved = self._proved(forces) or self._by_inverse()
        else:
            others, by_place, moved = self._at_places(True)
            rows, by_velocity = rows or others, self._by_velocities()
        return np.concatenate([by_place, by_velocity, *drives], axis=1), rows, moved

    def _by_whole_steps(self) -> Derivatives:
        """Differences of the step where four stages make it and no row takes part."""
        model, own, n, na = self.model, self._data, self.model.nv, self.model.na
        ends, columns = [], np.zeros((2 * n + na + model.nu, 2 * n + na))
        for k in range(len(columns)):
            ends.clear()
            for side in (self._eps, -self._eps):
                mj.mj_setState(model, own, self._state, _SPEC)
                if k < n:
                    mj.mj_integratePos(model, own.qpos, np.eye(n)[k], side)
                elif k < 2 * n:
                    own.qvel[k - n] += side
                elif k < 2 * n + na:
                    own.act[k - 2 * n] += side
                else:
                    own.ctrl[k - 2 * n - na] += side
                self._stepper.gather(own)
                self._stepper.runge_kutta(own)
                ends.append((own.qpos.copy(), np.concatenate([own.qvel, own.act])))
            (place, after), (low, before) = ends
            mj.mj_differentiatePos(model, columns[k, :n], 2.0 * self._eps, low, place)
            columns[k, n:] = (after - before) / (2.0 * self._eps)
        state = columns.T
        return Derivatives(
            state[:, : 2 * n + na], state[:, 2 * n + na :], "regular", math.inf, None
        )

    def _keep(self) -> None:
        """The answer, and the rows that are active in it."""
        stepper, own = self._stepper, self._data
        solver = stepper.solver
        self._found = own.nefc, own.contact.geom.tobytes()
        self._which = np.concatenate([self._rows.H, self._rows.G])
        self._v, self._r, u = solver.v, solver.r, solver.u.copy()
        self._J, self._gaps = self._jacobian()
        self._M, count = stepper.metric(own), len(self._rows.H)
        metric = self._M, stepper.inverse(own, self._units)
        self._inverse = metric[1]
        u[count:] = 0.0
        self._active = _read(self._rows.laws, count, self._J, self._inverse, self._r, u)
        self._scale = max(solver.numbers.driven, solver.numbers.fastest, 1e-300)
        shift = solver.shift
        made = np.zeros(0) if shift is None else shift.copy()
        self._opening = _Opening(made, solver.shares.copy())
        if self._opening.moves and (solver.shares < 1.0).any():
            self._opening.find_reached(turns(self.model), self._M, self._J)
        if self._opening.moves:
            A, G, gaps = self._J[self._rows.gaps], self._J[count:], self._gaps[self._rows.gaps]
            self._opening.read(metric, A, G, self._to_open(gaps))

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

    def _opens(self, gaps: Array) -> Array:
        """How much of a gap's change changes that."""
        stepper = self._stepper
        return (stepper.correction * (gaps + stepper.slop < 0.0) + (gaps > 0.0)) / self._h

    def _is_steady(self) -> bool:
        """Whether what is implicit in the metric, and activations, stay as they are where all
        places and velocities move, and inverse dynamics knows of all forces."""
        model, own, stepper, n = self.model, self._data, self._stepper, self.model.nv
        fast = model.opt.integrator == FAST
        if self._adheres or own.xfrc_applied.any():
            return False
        if stepper.tumbling if fast else stepper.damping.changes:
            return False
        if not fast and (self._filters and not self._calls):
            return True
        seen = []
        for step in (0.0, self._eps):
            mj.mj_setState(model, own, self._state, _SPEC)
            mj.mj_integratePos(model, own.qpos, self._ways[:n], step)
            own.qvel[:] += step * self._ways[:n]
            for stage in _FORCES:
                stage(model, own)
            if fast:
                stepper.rebind(own)
            damping = stepper.mass - own.M if fast else np.zeros(0)
            seen.append((damping, self._next_act()))
        (before, acts), (after, others) = seen
        same = np.abs(after - before).max(initial=0.0) <= 1e-12 * np.abs(before).max(initial=0.0)
        return bool(same and (acts == others).all())

    @contextlib.contextmanager
    def _inverse_dynamics(self) -> Iterator[None]:
        """Where MuJoCo's is that of forces alone, at the step's acceleration."""
        model, own, options = self.model, self._data, self.model.opt
        mj.mj_setState(model, own, self._state, _SPEC)
        own.qacc[:] = (self._v - own.qvel) / self._h
        flags, stages = options.disableflags, options.integrator == RK4
        options.disableflags = flags | _NO_CONSTRAINTS
        if stages:  # Euler is taken for it, and MuJoCo refuses it here
            options.integrator = _EULER
        try:
            yield
        finally:
            options.disableflags = flags
            if stages:
                options.integrator = RK4

    def _by_inverse(self) -> _Smooth:
        """Differences of MuJoCo's inverse dynamics."""
        model, own, n, opening = self.model, self._data, self.model.nv, self._opening
        found, mass = np.zeros((2, n + model.na, n)), np.zeros((n, model.nC))
        of_mass = np.zeros_like(mass) if opening.moves else None
        sides, share = np.zeros((len(self._sides), 2, n, n)), 1.0 / len(self._sides)
        with self._inverse_dynamics():
            for side, (places, speeds) in zip(self._sides.tolist(), sides):
                mj.mjd_inverseFD(
                    model, own, side, True, places, speeds, None, None, None, None, of_mass
                )
                if of_mass is not None:
                    mass += share * of_mass
        found[:, :n] = (self._h * share) * sides.sum(0).transpose(0, 2, 1)
        found[1, :n] -= self._M
        moved = mass
        if opening.moves:
            moved = self._stepper.times_mass(mass, opening.shift).T
        return _Smooth(found[0], found[1], moved)

    def _forces_in_closed_form(self, kinematics: Kinematics) -> _Smooth:
        """Of rigid bodies, springs of straight joints and of tendons, and what actuators do with
        their lengths; by velocities MuJoCo's own derivatives."""
        model, own, h, n = self.model, self._data, self._h, self.model.nv
        bodies, off = Dynamics(kinematics, model, own), model.opt.disableflags & _NO_GRAVITY
        gravity, none = np.zeros(3) if off else model.opt.gravity, np.zeros(n)
        found, shift = np.zeros((2, n + model.na, n)), self._opening.shift
        balance, by_velocity = found[0, :n], found[1, :n]
        balance += h * bodies.forces((self._v - own.qvel) / h, own.qvel, gravity)
        moved = bodies.forces(shift, none, np.zeros(3)) if self._opening.moves else by_velocity
        places, dofs = self._straight_places
        pulls = self._slope(own.qpos, places, mj.mj_passive, own.qfrc_spring)
        balance[dofs, dofs] -= h * pulls[dofs]
        if model.tendon_stiffness.any():
            J = np.zeros((model.ntendon, n))
            pattern = model.ten_J_rownnz, model.ten_J_rowadr, model.ten_J_colind
            mj.mju_sparse2dense(J, own.ten_J, *pattern)
            slack = np.clip(own.ten_length, *model.tendon_lengthspring.T) == own.ten_length
            balance += h * J.T @ (np.where(slack, 0.0, model.tendon_stiffness)[:, None] * J)
        if model.nu:
            moment, lengths, every = self._moment, own.actuator_length, slice(None)
            pulls = self._slope(lengths, every, mj.mj_fwdActuation, own.actuator_force)
            balance -= h * moment.T @ (pulls[:, None] * moment)
        by_velocity[self._damped, model.D_colind] = self._damping()
        by_velocity *= -h
        by_velocity -= self._M
        return _Smooth(found[0], found[1], moved)

    def _slope(self, numbers: Array, which: Any, stage: Any, answer: Array) -> Array:
        """How each answer moves with a number of its own, all of which move at once."""
        here, found = numbers.copy(), []
        for step in (self._eps, -self._eps):
            numbers[which] = here[which] + step
            stage(self.model, self._data)
            found.append(answer.copy())
        numbers[:] = here
        return np.asarray((found[0] - found[1]) / (2.0 * self._eps))

    def _damping(self) -> Array:
        """qDeriv, MuJoCo's derivatives of forces by velocities."""
        model, own, options = self.model, self._data, self.model.opt
        integrator, options.integrator = options.integrator, _IMPLICIT
        try:
            mj.mj_implicit(model, own)
        finally:
            options.integrator = integrator
        mj.mj_setState(model, own, self._state, _SPEC)
        return np.asarray(own.qDeriv)

    def _proved(self, found: Optional[_Smooth]) -> Optional[_Smooth]:
        """What agrees with a difference of MuJoCo's inverse dynamics along one way."""
        if found is None:
            return None
        model, own, n, sides = self.model, self._data, self.model.nv, []
        way, other = self._ways[:n], self._ways[:n][::-1]
        with self._inverse_dynamics():
            place, speed = own.qpos.copy(), own.qvel.copy()
            for step in (self._eps, -self._eps):
                own.qpos[:] = place
                mj.mj_integratePos(model, own.qpos, way, step)
                own.qvel[:] = speed + step * other
                mj.mj_inverse(model, own)
                mj.mj_fwdActuation(model, own)
                sides.append(own.qfrc_inverse - own.qfrc_actuator)
        columns = np.concatenate([found.by_place[:n], found.by_velocity[:n] + self._M], axis=1)
        seen = (sides[0] - sides[1]) * (0.5 * self._h / self._eps)
        off = _largest(seen - columns @ np.concatenate([way, other]))
        # a difference by 1e-6 has 1e-10 of the forces for rounding
        size = np.abs(columns).sum(1).max() + 1e-3 * self._h * _largest(sides[0])
        return found if off <= 1e-6 * size else None

    def _rows_in_closed_form(self, kinematics: Optional[Kinematics]) -> Any:
        """Where all rows are contacts of geoms, or constant, and differences of all places cost
        more."""
        model, own, rows = self.model, self._data, self._rows
        self._held = np.zeros(1, dtype=bool)
        if not own.nefc:
            return _Rows(np.zeros((model.nv, 0, model.nv)), np.zeros((model.nv, 0)))
        if not (self._straight and self._constant[own.efc_id[rows.G]].all()):
            return None
        if not len(rows.laws.dims):
            return _Rows(np.zeros((model.nv, *self._J.shape)), self._J.T)
        # tangents that MuJoCo takes from the world's axes matter to friction that is not even
        bodies = model.geom_bodyid[own.contact.geom]
        uneven = rows.scale is not None and (model.body_weldid[bodies] != 0).all(1).any()
        if uneven or kinematics is None:
            return None
        found = Contacts(kinematics, model, own, self._which, rows, self._J)
        found.differ(model, own, self._eps, self._centered)
        self._held = found.held
        return found

    def _at_places(self, whole: bool) -> tuple[_Rows, Array, Array]:
        """Rows where each place has moved; of the whole step also the balance and the activations,
        and M shift."""
        model, own, stepper, n = self.model, self._data, self._stepper, self.model.nv
        nefc, geoms = self._found
        shape = len(self._sides), n
        there, sparse = np.ones(shape, dtype=bool), self._rows.pattern is not None
        J, gaps = np.zeros((*shape, nefc, n)), np.zeros((*shape, nefc))
        balance, mass = np.zeros((*shape, n + model.na)), np.zeros((*shape, model.nC))
        mj.mj_setState(model, own, self._state, _SPEC)
        place, qpos = own.qpos.copy(), own.qpos
        if whole:
            here, masses = np.concatenate(self._by_force()), stepper.metric_mass(own)
            mass_here = masses.copy()
        for side, step in enumerate(self._sides.tolist()):
            for k, way in enumerate(self._units):
                qpos[:] = place
                mj.mj_integratePos(model, qpos, way, step)
                for stage in _STAGES if whole else _ROWS:
                    stage(model, own)
                if whole:
                    balance[side, k] = np.concatenate(self._by_force()) - here
                    mass[side, k] = masses - mass_here
                if not nefc:
                    continue
                if own.nefc == nefc and own.contact.geom.tobytes() == geoms:
                    J[side, k] = self._sparse_rows() if sparse else own.efc_J.reshape(nefc, n)
                    gaps[side, k] = own.efc_pos
                else:
                    there[side, k] = False
        by_place, moved = balance[0], mass  # read by those who ask for the whole
        if whole:
            sign = np.sign(self._sides)[:, None] / (self._eps * len(self._sides))
            by_place = (sign[..., None] * balance).sum(0).T
            if self._opening.moves:
                mass = (sign[..., None] * mass).sum(0)
                moved = stepper.times_mass(mass, self._opening.shift).T
        rows = self._differenced(J[:, :, self._which], gaps[:, :, self._which], there)
        return rows, by_place, moved

    def _differenced(self, J: Array, gaps: Array, there: NDArray[Any]) -> _Rows:
        """Where others touch on one side, with what is here; on both: as if contacts kept their
        points and directions."""
        if self._rows.scale is not None:
            J[:, :, : len(self._rows.H)] *= self._rows.scale[:, None]
        if there.all() and self._centered:
            self._held = there[:0]
            return _Rows(*((x[0] - x[1]) / (2.0 * self._eps) for x in (J, gaps)))
        both = there.sum(0)
        sign = np.sign(self._sides)[:, None] * there / (self._eps * np.maximum(both, 1))
        self._held = both == 0
        dJ = (sign[..., None, None] * (J - self._J)).sum(0)
        d_gaps = (sign[..., None] * (gaps - self._gaps)).sum(0)
        d_gaps[self._held] = self._J.T[self._held]
        return _Rows(dJ, d_gaps)

    def _of_rows(self, rows: Any, changes: Array, moved: Array) -> tuple[Array, Array]:
        """By places: velocities of rows, and what opens overlaps and what these rows do then.
        Takes J'r from the balance's changes; moved: M shift."""
        mine, count, opening, n = self._rows.gaps, len(self._rows.H), self._opening, self.model.nv
        if not len(self._J):
            return np.zeros((0, n)), np.zeros((0, n))
        gaps, gap = rows.gaps, self._gaps[mine]
        r, v, closing = self._r[None], self._v[None], mine[:0]
        if opening.moves:
            push, closing = np.zeros(len(self._J)), mine[opening.rows]
            push[closing], push[count:] = opening.push[: len(closing)], opening.push[len(closing) :]
            r, v = np.array([self._r, push]), np.array([self._v, opening.shift])
        turned, speeds = rows.forces(r), rows.velocities(v)
        changes[:n, :n] -= turned[0]
        speeds[0, mine] += gaps[mine] * ((gap > 0.0) / self._h)[:, None]
        speeds[0, count:] += self._stepper.correction / self._h * gaps[count:]
        if not opening.moves:
            return speeds[0], np.zeros((0, n))
        speeds[1, mine] += gaps[mine] * self._opens(gap)[:, None]
        opened = [moved - turned[1], speeds[1, closing], speeds[1, count:]]
        return speeds[0], np.concatenate(opened)

    def _sparse_rows(self) -> Array:
        own = self._data
        J = np.zeros((own.nefc, self.model.nv))
        columns = own.efc_J_colind.ravel()
        mj.mju_sparse2dense(J, own.efc_J.ravel(), own.efc_J_rownnz, own.efc_J_rowadr, columns)
        return J

    def _next_act(self) -> Array:
        model, own, state = self.model, self._data, self._room
        mj.mj_getState(model, own, state, _SPEC)
        mj.mj_Euler(model, own)
        act = own.act.copy()
        mj.mj_setState(model, own, state, _SPEC)
        return act

    def _by_velocities(self) -> Array:
        model, own = self.model, self._data
        mj.mj_setState(model, own, self._state, _SPEC)
        mj.mj_fwdPosition(model, own)
        here, columns = own.qvel.copy(), []
        for k in range(model.nv):
            sides = []
            for step in (self._eps, -self._eps):
                own.qvel[k] = here[k] + step
                mj.mj_fwdVelocity(model, own)
                sides.append(np.concatenate(self._by_force()))
            own.qvel[k] = here[k]
            columns.append((sides[0] - sides[1]) / (2.0 * self._eps))
        return np.array(columns).T

    def _of_drives(self) -> list[Array]:
        """Of the balance and the activations by activations, and by controls."""
        own, apart = self._data, self._apart and not self._calls
        self._moment = self._moment_arms()
        self._pushes = -self._h * self._moment.T  # of units of the actuators' forces
        return [self._at_once(x) if apart else self._one_by_one(x) for x in (own.act, own.ctrl)]

    def _moment_arms(self) -> Array:
        model, own = self.model, self._data
        moment = np.zeros((model.nu, model.nv))
        pattern = own.moment_rownnz, own.moment_rowadr, own.moment_colind
        mj.mju_sparse2dense(moment, own.actuator_moment, *pattern)
        return moment

    def _at_once(self, numbers: Array) -> Array:
        """Of actuators that have nothing to do with each other."""
        model, own, n = self.model, self._data, self.model.nv
        found = np.zeros((n + model.na, len(numbers)))
        if not len(numbers):
            return found
        here, sides = numbers.copy(), []
        for step in (self._eps, -self._eps):
            numbers[:] = here + step
            mj.mj_fwdActuation(model, own)
            acts = self._next_act() if model.na else own.act
            sides.append((own.actuator_force.copy(), acts))
        numbers[:] = here
        of, place = self._driven
        slopes, acts = ((a - b) / (2.0 * self._eps) for a, b in zip(*sides))
        if numbers is own.act:
            found[:n, place] = (slopes * self._pushes)[:, of]
            found[n + place, place] = acts[place]
        else:
            found[:n] = slopes * self._pushes
            if model.na:
                found[n + place, of] = acts[place]
        return found

    def _one_by_one(self, numbers: Array) -> Array:
        """Where forces or activations are of several."""
        model, own, eps, n = self.model, self._data, self._eps, self.model.nv
        count, na = len(numbers), model.na
        forces, acts, here = np.zeros((2, count, n)), np.zeros((2, count, na)), numbers.copy()
        for side, step in enumerate((eps, -eps)):
            for k in range(count):
                numbers[k] = here[k] + step
                mj.mj_fwdActuation(model, own)
                forces[side, k] = own.qfrc_actuator
                if na:
                    acts[side, k] = self._next_act()
                numbers[k] = here[k]
        changes = np.concatenate([-self._h * (forces[0] - forces[1]), acts[0] - acts[1]], axis=1)
        return np.asarray(changes.T / (2.0 * eps))

    def _assemble(self, changes: Array, du: Array, opened: Array) -> Derivatives:
        """changes: of the balance and the activations by all; du: of velocities of rows, and
        opened: of what opens overlaps, by places."""
        n, na = self.model.nv, self.model.na
        metric, opening, other = (self._M, self._inverse), self._opening, True
        speeds = np.zeros((len(du), changes.shape[1]))
        speeds[:, :n] = du
        dv, one = _solve(metric, self._J, self._active, self._r, changes[:n], speeds)
        turned, moved = self._places()
        state = np.concatenate([moved @ dv, dv, changes[n:]])
        if opening.moves:
            ds, other = opening.changes(metric, opened[:n], opened[n:])
            state[:n, :n] += moved @ opening.shorten(ds)
        state[:n, :n] += turned
        margins = self._active.margins / self._scale
        index = int(np.argmin(margins)) if len(margins) else None
        margin = float(margins[index]) if index is not None else np.inf
        determined = one and other and opening.is_one
        edge = margin < _EDGE or self._held.any() or opening.at_once
        verdict = "singular" if not determined else "degenerate" if edge else "regular"
        return Derivatives(state[:, : 2 * n + na], state[:, 2 * n + na :], verdict, margin, index)

    def _places(self) -> tuple[Array, Array]:
        """How the next place turns with this one, and moves with the velocity."""
        model, h = self.model, self._h
        turned, moved = np.eye(model.nv), h * np.eye(model.nv)
        v, nothing = self._v, np.zeros(3)
        if self._opening.moves:
            v = v + self._opening.made
        for first in self._turning:
            here, of_place, of_velocity = slice(first, first + 3), np.zeros(9), np.zeros(9)
            mj.mjd_quatIntegrate(v[here], h, of_place, of_velocity, nothing)
            turned[here, here] = of_place.reshape(3, 3)
            moved[here, here] = h * of_velocity.reshape(3, 3)
        return turned, moved


_SPEC = int(mj.mjtState.mjSTATE_INTEGRATION)
_MANY = 24  # places from which the calls that closed form takes cost less than differences
_NO_CONSTRAINTS = int(mj.mjtDisableBit.mjDSBL_CONSTRAINT)
_NO_SENSORS = int(mj.mjtDisableBit.mjDSBL_SENSOR)
_NO_GRAVITY = int(mj.mjtDisableBit.mjDSBL_GRAVITY)
_IMPLICIT = int(mj.mjtIntegrator.mjINT_IMPLICIT)
_EULER = int(mj.mjtIntegrator.mjINT_EULER)
_FILTERS = [  # activations that go by control and activation alone
    int(getattr(mj.mjtDyn, f"mjDYN_{name}"))
    for name in ("NONE", "INTEGRATOR", "FILTER", "FILTEREXACT", "MUSCLE")
]
_DISCRETE = int(mj.mjtEnableBit.mjENBL_INVDISCRETE)


def _stages(*names: str) -> list[Any]:
    return [getattr(mj, f"mj_{name}") for name in names]


# mj_fwdPosition's parts, where a version has them by themselves: without what MuJoCo's solver needs
_PARTS = "fwdKinematics", "makeM", "factorM", "collision", "makeConstraint", "transmission"
_APART = all(hasattr(mj, f"mj_{name}") for name in _PARTS)
_POSITION = _stages(*(_PARTS if _APART else ("fwdPosition",)))
_ROWS = [_POSITION[k] for k in (0, 3, 4)] if _APART else _POSITION
_STAGES = _POSITION + _stages("fwdVelocity")
_FORCES = _STAGES + _stages("fwdActuation", "fwdAcceleration")
