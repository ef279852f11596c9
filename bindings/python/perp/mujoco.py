"""MuJoCo's robots with exact contact: MuJoCo loads and moves them, perp solves their steps.

    import mujoco, perp.mujoco

    model = mujoco.MjModel.from_xml_path("scene.xml")
    data = mujoco.MjData(model)
    while data.time < 2.0:
        perp.mujoco.step(model, data)          # in the place of mujoco.mj_step(model, data)

Kinematics, inertia, collision, actuation, passive forces and sensors are MuJoCo's. Its constraint
solver is left out: contacts obey Coulomb's law with the model's coefficients, limits and equations
are rigid, dry friction holds up to its bound. solref, solimp, impratio and noslip are not read. See
docs/mujoco.md. Needs the package mujoco (pip install 'perp[mujoco]').
"""

from __future__ import annotations

import ctypes
import functools
import threading
import time as _clock
import weakref
from typing import Any, Callable, NamedTuple, Optional

import numpy as np
from numpy.typing import NDArray

try:
    import mujoco as mj  # type: ignore[import-untyped]
except ImportError as error:
    raise ImportError("perp.mujoco needs MuJoCo: pip install 'perp[mujoco]'") from error

from . import _arrays
from ._errors import argument_error
from ._mujoco_check import Feature, check, refuse, tumbling
from ._mujoco_derivatives import Derivatives, Linearization
from ._stepper import Array, Laws, Pattern, Rows, RowSolver, Solved
from ._words import ContactMethod

__all__ = [
    "Derivatives", "Feature", "Run", "Solved", "Stepper", "check", "contact_force", "derivatives",
    "simulate", "step", "view",
]  # fmt: skip

_DENSE = 120  # velocities up to which matrices are dense
_BLOCK = 12  # unknowns of a block of M up to which the library's v has exact zeros
_ELLIPTIC = int(mj.mjtCone.mjCONE_ELLIPTIC)
_AS_DENSE, _AS_SPARSE = int(mj.mjtJacobian.mjJAC_DENSE), int(mj.mjtJacobian.mjJAC_SPARSE)
_FAST = int(mj.mjtIntegrator.mjINT_IMPLICITFAST)
_TAKEN = {int(mj.mjtIntegrator.mjINT_IMPLICIT): _FAST}
_NO_EULER_DAMPING = int(mj.mjtDisableBit.mjDSBL_EULERDAMP)
_NO_RESETS = int(mj.mjtDisableBit.mjDSBL_AUTORESET)
_STATE = int(mj.mjtState.mjSTATE_FULLPHYSICS)
_OF_ACCELERATIONS = int(mj.mjtStage.mjSTAGE_ACC)

# MuJoCo's rows of a contact are normal, tangents, spin, roll, roll; perp's end with the spin. By
# condim, padded.
_ROWS = np.full((7, 6), -1)
_ROWS[1, :1], _ROWS[3, :3], _ROWS[4, :4], _ROWS[6] = 0, range(3), range(4), (0, 1, 2, 4, 5, 3)
_THERE = _ROWS >= 0
_COUNTS = _THERE.sum(1)
_DIMS = np.array([0, 1, 0, 3, 3, 0, 3], dtype=np.int32)
# Sliding, rolling, spinning: where MuJoCo has a contact's, and what condim leaves of them.
_FRICTIONS = np.array([0, 3, 2])
_HAS = np.array([[0] * 3, [0] * 3, [0] * 3, [1, 0, 0], [1, 0, 1], [0] * 3, [1] * 3], dtype=float)
_NONE = np.zeros(0, dtype=np.int32)
_PAIRS = 64  # more contacts than MuJoCo makes of two geoms: places of one pair in a key


def _entries_of_mass(model: Any) -> tuple[NDArray[Any], NDArray[Any], NDArray[Any]]:
    """Rows and columns of M's entries, and where MuJoCo, which has the lower triangle, has each."""
    n = model.nv
    row = np.repeat(np.arange(n), model.M_rownnz)
    entry = np.arange(len(row)) + np.repeat(
        model.M_rowadr - np.cumsum(model.M_rownnz) + model.M_rownnz, model.M_rownnz
    )
    column = model.M_colind[entry]
    below = row != column
    rows = np.concatenate([row, column[below]])
    columns = np.concatenate([column, row[below]])
    return rows, columns, np.concatenate([entry, entry[below]])


def _set_mass(model: Any, solver: RowSolver, entries: tuple[NDArray[Any], ...]) -> None:
    n = model.nv
    rows, columns, sources = entries
    if n <= _DENSE:
        dense = np.full((n, n), -1, dtype=np.int32)
        dense[rows, columns] = sources
        solver.set_mass(dense.ravel(), (np.arange(n) * (n + 1)).astype(np.int32))
        return
    order = np.lexsort((rows, columns))
    rows, columns, sources = (x[order].astype(np.int32) for x in (rows, columns, sources))
    starts = np.searchsorted(columns, np.arange(n + 1)).astype(np.int32)
    solver.set_mass(sources, np.flatnonzero(rows == columns).astype(np.int32), starts, rows)


class _Borrowed:
    """A model's cone and Jacobian are as perp stores rows, and implicitfast is taken for implicit,
    while this is entered, and the user's own after that: also where several threads step it."""

    _entered: dict[int, list[int]] = {}  # by address: how often, and what the user has
    _lock = threading.Lock()

    def __init__(self, model: Any) -> None:
        self._options, self._key = model.opt, model._address
        self._jacobian = _AS_DENSE if model.nv <= _DENSE else _AS_SPARSE

    def __enter__(self) -> None:
        options = self._options
        with self._lock:
            mine = self._entered.get(self._key)
            if mine is None:
                mine = [0, options.cone, options.jacobian, options.integrator]
                self._entered[self._key] = mine
                options.cone, options.jacobian = _ELLIPTIC, self._jacobian
                options.integrator = _TAKEN.get(mine[3], mine[3])
            mine[0] += 1

    def __exit__(self, *_: Any) -> None:
        with self._lock:
            mine = self._entered[self._key]
            mine[0] -= 1
            if not mine[0]:
                options = self._options
                _, options.cone, options.jacobian, options.integrator = mine
                del self._entered[self._key]


class _Damping:
    """The diagonal that MuJoCo's Euler takes implicitly: of joints, and of actuators at them."""

    def __init__(self, model: Any) -> None:
        self._model = model
        none = np.zeros(model.nu)
        linear = getattr(model, "actuator_damping", none)
        poly = getattr(model, "actuator_dampingpoly", none)
        mine = getattr(model, "dof_dampingpoly", none)
        at_joints = np.isin(model.actuator_trntype, _AT_JOINTS)
        self._of = np.flatnonzero(at_joints & ((linear != 0.0) | (poly.T != 0.0).any(0)))
        self._dofs = model.jnt_dofadr[model.actuator_trnid[self._of, 0]]
        self.changes = bool(len(self._of) or mine.any())
        self.diagonal = model.dof_damping.copy() if self.changes else model.dof_damping

    def update(self, v: Array) -> None:
        """With the derivatives of a + b |v| + c v^2, times v, at v."""
        model, speed = self._model, np.abs(v)
        self.diagonal[:] = model.dof_damping + _slope(model.dof_dampingpoly, speed)
        if len(self._of):
            of = model.actuator_dampingpoly[self._of]
            slope = model.actuator_damping[self._of] + _slope(of, speed[self._dofs])
            np.add.at(self.diagonal, self._dofs, slope)


def _slope(poly: Array, speed: Array) -> Array:
    powers = np.arange(1, poly.shape[1] + 1)
    return ((powers + 1) * poly * speed[:, None] ** powers).sum(1)


_AT_JOINTS = int(mj.mjtTrn.mjTRN_JOINT), int(mj.mjtTrn.mjTRN_JOINTINPARENT)


class _Tumbling:
    """Forces of free bodies with implicitfast's gyroscopic term, which is not symmetric: those that
    give MuJoCo's acceleration in the symmetric rest of its metric."""

    def __init__(self, model: Any) -> None:
        self._dofs = (tumbling(model)[:, None] + np.arange(6)).ravel()
        row, column, entry = _entries_of_mass(model)
        mine = np.isin(row, self._dofs)
        self._entries = row[mine], column[mine], entry[mine]
        self.force = np.zeros(model.nv)

    def update(self, data: Any, acceleration: Array, mass: Array) -> None:
        row, column, entry = self._entries
        self.force[:] = data.qfrc_smooth
        of_mass = np.bincount(row, mass[entry] * acceleration[column], len(self.force))
        self.force[self._dofs] = of_mass[self._dofs]


class _Touching(NamedTuple):
    """Perp's rows among MuJoCo's, as long as the same things touch."""

    key: tuple[Any, ...]
    rows: Rows
    first: NDArray[Any]  # of each contact: its normal among H's rows
    names: NDArray[Any]  # of each contact and row with bounds: the same as long as it lasts
    there: NDArray[Any]  # (names, 6): which rows it has
    still: NDArray[Any]  # rows of J that are left out as they move nothing


def _touching(key: tuple[Any, ...], model: Any, data: Any, h: float, all_move: bool) -> _Touching:
    contact, ne, nf, nb = data.contact, data.ne, data.nf, data.nf + data.nl
    address, dim, geom, friction = contact.efc_address, contact.dim, contact.geom, contact.friction
    there, equations, still = address >= 0, np.arange(ne, dtype=np.int32), _NONE
    if not all_move:
        moves, still = _moves(model, data), np.concatenate([equations, address[there]])
        still, equations = still[~moves[still]], equations[moves[:ne]]
        there[there] = moves[address[there]]
    if not there.all():
        address, dim, geom, friction = address[there], dim[there], geom[there], friction[there]
    all_there = _THERE[np.concatenate([dim, np.ones(nb, dtype=np.int32)])]
    there, counts = all_there[: len(dim)], _COUNTS[dim]
    order = (address[:, None] + _ROWS[dim])[there]
    first, count = np.cumsum(counts) - counts, len(order)
    limits = np.zeros((2, nb))
    limits[1, :nf] = h * data.efc_frictionloss[ne : ne + nf]
    limits[1, nf:] = np.inf
    limits[0, :nf] -= limits[1, :nf]
    laws = Laws(_DIMS[dim], *(friction[:, _FRICTIONS] * _HAS[dim]).T.copy(), *limits)
    rows = Rows(
        laws,
        np.concatenate([order, np.arange(ne, ne + nb)]).astype(np.int32),
        equations,
        np.concatenate([first, np.arange(count + nf, count + nb)]).astype(np.int32),
        _scale(friction, there, nb),
        None if model.nv <= _DENSE else _pattern(data),
    )
    names = _names(model, geom, data.efc_type[ne : ne + nb], data.efc_id[ne : ne + nb])
    return _Touching(key, rows, first, names, all_there, still)


def _scale(friction: NDArray[Any], there: NDArray[Any], bounded: int) -> Optional[Array]:
    """Of the rows: a second direction in units in which its coefficient is the first one's."""
    second, first = friction[:, 1::3], friction[:, 0:4:3]
    if ((second == first) | ~there[:, 2:5:2]).all():
        return None
    scale = np.ones(there.shape)
    scale[:, 2:5:2] = second / first
    return np.concatenate([scale[there], np.ones(bounded)])


def _names(model: Any, geom: NDArray[Any], kind: NDArray[Any], which: NDArray[Any]) -> Any:
    pair = (geom[:, 0].astype(np.int64) + 1) * (model.ngeom + 2) + geom[:, 1]
    rows = 8 * which.astype(np.int64) + kind
    # an upper and a lower limit of one joint: the second is another
    return np.concatenate([pair * _PAIRS + _place(pair), -1 - 2 * rows - _place(rows)])


def _place(names: NDArray[Any]) -> Any:
    """Among those that follow each other and are the same."""
    place = np.arange(len(names))
    if len(names) > 1:
        begins = names[1:] != names[:-1]
        place[1:] -= np.maximum.accumulate(place[1:] * begins)
    return place


class Stepper:
    """The steps of one simulation, each from the last one's impulses.

        stepper = perp.mujoco.Stepper(model)
        while data.time < 2.0:
            stepper.step(data)

    method, tol, max_iterations, time_limit: as for perp.contact().
    correction: the share of an overlap, or of an equation's error, that a step takes away.
    slop: the overlap that contacts and limits keep, so that they are found again; None is a
        thousandth of the model's mean size.

    What the model asks for and a step can't do is refused here, by name; check() says how each of
    its features is treated. The model is not changed.
    """

    def __init__(
        self,
        model: Any,
        *,
        method: ContactMethod = "auto",
        tol: float = 1e-8,
        max_iterations: Optional[int] = None,
        time_limit: Optional[float] = None,
        correction: float = 0.2,
        slop: Optional[float] = None,
    ) -> None:
        refuse(model)
        self.model = model
        self.correction = correction
        self.slop = 1e-3 * model.stat.meansize if slop is None else slop
        self.solver = RowSolver(model.nv, method, tol, max_iterations, time_limit)
        self._entries = _entries_of_mass(model)
        _set_mass(model, self.solver, self._entries)
        self.solver.numbers.correction = correction
        self._mass = np.zeros(model.nC)  # of implicit integrators
        self._bound: Any = lambda: None  # data, while they last, and what else the numbers go by
        self._bound_by: tuple[int, int] = (-1, -1)
        self.touching: Optional[_Touching] = None
        self._warm, self._all_move = False, True
        # those whose zeros the library leaves alone
        trees = np.bincount(model.dof_treeid) if model.nv else _NONE
        self._large = model.nv <= _DENSE and bool((trees > _BLOCK).any())
        more = getattr(model, "nhistory", 0) + getattr(model, "nplastic", 0)
        self._advances = bool(model.na or model.nplugin or more)
        self._damping, self.borrowed = _Damping(model), _Borrowed(model)
        self._tumbling = _Tumbling(model) if len(tumbling(model)) else None
        self._state = np.zeros(mj.mj_stateSize(model, _STATE))
        # what costs a tenth of a microsecond or two to be asked for in every step
        self._options, self._senses = model.opt, bool(model.nsensor)
        self._accelerates = bool((model.sensor_needstage == _OF_ACCELERATIONS).any())

    def step(self, data: Any) -> Solved:
        """Advances data by the model's timestep, and says how its problem ended. Where that is not
        ok, the best impulses found are used all the same."""
        with self.borrowed:
            return self._step(data)

    def _gather(self, data: Any) -> None:
        """All of a step before its contacts are solved."""
        model, options = self.model, self._options
        mj.mj_step1(model, data)
        mj.mj_fwdActuation(model, data)
        mj.mj_fwdAcceleration(model, data)
        self._bind(data, options, options.timestep)

    def answer(self, data: Any) -> Solved:
        """The contacts of a step as sharply as can be, with impulses away from the rims of cones
        where there are such, from no start."""
        self._gather(data)
        self.touching, self._warm = None, False
        how = self._solve_any(data, self._options.timestep)
        turns = self.touching.rows.laws
        method = "auto" if turns.rolling.any() or turns.spinning.any() else "newton"
        solver = self.solver
        kept = [x.copy() for x in (solver.v, solver.r, solver.u, solver.modes)]
        if solver.rows and not solver.solve_by(method, 1e-12).ok:
            solver.v[:], solver.r[:], solver.u[:], solver.modes[:] = kept
        return how

    def force(self, data: Any) -> Array:
        """The forces of a step in the metric."""
        fast = self._options.integrator == _FAST and self._tumbling is not None
        return self._tumbling.force if fast else data.qfrc_smooth

    def rebind(self, data: Any) -> None:
        """What is implicit in the metric, at data's state."""
        self._bind(data, self._options, self._options.timestep)

    def times(self, data: Any, x: Array) -> Array:
        """The metric, times x."""
        options = self._options
        if options.integrator == _FAST:
            rows, columns, sources = self._entries
            return np.bincount(rows, self._mass[sources] * x[columns], len(x))
        product = np.empty(len(x))
        mj.mj_mulM(self.model, data, product, x)
        if not options.disableflags & _NO_EULER_DAMPING:
            product += options.timestep * self._damping.diagonal * x
        return product

    def metric(self, data: Any) -> Array:
        """M with what is implicit, dense."""
        options, n = self._options, self.model.nv
        fast = options.integrator == _FAST
        rows, columns, sources = self._entries
        M = np.zeros((n, n))
        M[rows, columns] = (self._mass if fast else data.M)[sources]
        if not fast and not options.disableflags & _NO_EULER_DAMPING:
            M[range(n), range(n)] += options.timestep * self._damping.diagonal
        return M

    def _step(self, data: Any) -> Solved:
        model, options, solver = self.model, self._options, self.solver
        h = options.timestep
        self._gather(data)
        if not np.isfinite(data.qacc_smooth).all():
            return self._reset(data)
        how = self._solve_any(data, h)
        touching, numbers, known = self.touching, solver.numbers, solver.known
        assert touching is not None
        if not known:
            if self._warm and how.ok and numbers.slips:
                how = solver.settle(how, touching.first)
            if self._large and how.ok and solver.may_hold() and self._nearly_rests(data, h):
                solver.hold()
            self._warm = how.ok
        if self._senses:
            self._sense(data)
        shift = solver.shift
        if known and shift is None and not self._advances:
            data.time += h  # qvel and qpos would become what they are
        else:
            self._advance(data, h, shift)
        return how

    def _reset(self, data: Any) -> Solved:
        """What MuJoCo does where accelerations are no numbers: it warns, and begins anew."""
        if self._options.disableflags & _NO_RESETS:
            raise argument_error("data has forces that are not finite, and autoreset is disabled")
        data.qacc[:] = data.qacc_smooth
        mj.mj_checkAcc(self.model, data)
        self.touching, self._warm = None, False
        return self._step(data)

    def _sense(self, data: Any) -> None:
        """Accelerations as MuJoCo's sensors have them: of the forces, before implicit damping."""
        data.flg_rnepost = 0
        mean = data.qacc.copy() if self._accelerates else None
        if mean is not None and mean.any():
            force = (data.qfrc_smooth + data.qfrc_constraint)[None]
            acceleration = np.empty_like(force)
            mj.mj_solveM(self.model, data, acceleration, force)
            data.qacc[:] = acceleration[0]
        mj.mj_sensorAcc(self.model, data)
        if mean is not None:
            data.qacc[:] = mean

    def _bind(self, data: Any, options: Any, h: float) -> None:
        """Where the step's numbers are."""
        model, solver = self.model, self.solver
        integrator, flags, damping = options.integrator, options.disableflags, self._damping
        implicit = integrator == _FAST
        if self._bound() is not data or self._bound_by != (integrator, flags):
            self._bound, self._bound_by = weakref.ref(data), (integrator, flags)
            self._at, self.touching = _pointers(data), None
            for name, field in ("J", "efc_J"), ("gaps", "efc_pos"), ("row_force", "efc_force"):
                setattr(solver.numbers, name, self._at[field])
            damped = not implicit and not flags & _NO_EULER_DAMPING
            solver.bind(
                mass=self._mass if implicit else data.M,
                damping=damping.diagonal if damped else None,
                velocity=data.qvel, acceleration=data.qacc,
                force=self._tumbling.force if implicit and self._tumbling else data.qfrc_smooth,
                force_of_rows=data.qfrc_constraint,
            )  # fmt: skip
        if implicit:  # only what it knows of the forces' derivatives is of use
            mj.mj_getState(model, data, self._state, _STATE)
            data.qfrc_constraint[:] = 0.0
            mj.mj_implicit(model, data)
            free = data.qvel.copy()
            mj.mj_setState(model, data, self._state, _STATE)
            np.subtract(data.M, h * data.qDeriv[model.mapD2M], out=self._mass)
            if self._tumbling:
                self._tumbling.update(data, (free - data.qvel) / h, self._mass)
        elif damping.changes:
            damping.update(data.qvel)
        solver.numbers.h, solver.numbers.slop = h, self.slop

    def _solve_any(self, data: Any, h: float) -> Solved:
        try:
            return self._solve(data, h)
        except ValueError:  # a contact that moved something does so no more?
            self.touching, self._warm, self._all_move = None, False, False
            return self._solve(data, h)

    def _solve(self, data: Any, h: float) -> Solved:
        """With the rows of the last step, where the same things touch."""
        solver, key = self.solver, (data.ne, data.nf, data.nl, data.ncon, h)
        if self.touching is not None and key == self.touching.key:
            how = solver.step(self._warm)
            if not solver.is_other:
                return how
        self._take_rows(_touching(key, self.model, data, h, self._all_move), data)
        return solver.step(self._warm)

    def _take_rows(self, touching: _Touching, data: Any) -> None:
        """Other rows, the start's impulses, and what is looked at to find these the same."""
        solver, last, at, layout = self.solver, self.touching, self._at, _layout()
        old = solver.start
        solver.arrange(touching.rows, data.nefc)
        if last is not None:
            _hand_over(solver.start, touching, old, last)
        self.touching, contact = touching, data.contact
        kept = [getattr(contact, name).copy() for name in _OF_CONTACTS]
        places = [(at["contact"], offset, layout.stride) for offset in layout.of_contacts]
        for name in _WATCHED if self.model.nv <= _DENSE else _WATCHED + _PATTERN:
            kept.append(getattr(data, name).copy())
            places.append((at[name], 0, kept[-1].itemsize))
        for row in touching.still:  # zeros as long as they move nothing
            begin, count = _place_of_row(self.model, data, row)
            kept.append(np.zeros(count))
            places.append((at["efc_J"], 8 * begin, 8))
        solver.watch(places, kept)

    def _nearly_rests(self, data: Any, h: float) -> bool:
        """Whether a search for what is held is worth its cost: it says nothing of what is."""
        fastest = self.solver.numbers.fastest
        return bool(0.0 < fastest < 1e-6 * h * np.abs(data.qacc_smooth).max())

    def _advance(self, data: Any, h: float, shift: Optional[Array]) -> None:
        """As MuJoCo does, but that places follow from the very velocities."""
        model, v = self.model, self.solver.v
        if self._advances:
            place = data.qpos.copy()
            mj.mj_Euler(model, data)
            data.qpos[:] = place
        else:
            data.time += h
        data.qvel[:] = v
        mj.mj_integratePos(model, data.qpos, v if shift is None else v + shift, h)


def _pattern(data: Any) -> Pattern:
    return Pattern(data.efc_J_rownnz.copy(), data.efc_J_rowadr.copy(), data.efc_J_colind.copy())


def _moves(model: Any, data: Any) -> NDArray[Any]:
    """Whether each row moves anything: a wall's contact with a planar robot may not."""
    J = data.efc_J
    if model.nv <= _DENSE:
        return np.asarray(J.reshape(data.nefc, model.nv).any(1))
    row, places = _pattern(data).places(np.arange(data.nefc))
    return np.bincount(row, np.abs(J.ravel()[places]), data.nefc) > 0.0


def _place_of_row(model: Any, data: Any, row: int) -> tuple[int, int]:
    """Where a row of J begins, and how many entries it has."""
    if model.nv <= _DENSE:
        return row * model.nv, model.nv
    return int(data.efc_J_rowadr[row]), int(data.efc_J_rownnz[row])


def _hand_over(start: Array, now: _Touching, old: Array, last: _Touching) -> None:
    """The impulses of what touched already."""
    count, before = len(now.rows.H), np.zeros(last.there.shape)
    if len(last.names) and len(now.names):
        before[last.there] = old[: len(last.rows.H)]
        order = np.argsort(last.names)
        place = np.minimum(np.searchsorted(last.names[order], now.names), len(order) - 1)
        same = last.names[order[place]] == now.names
        start[:count] = np.where(same[:, None], before[order[place]], 0.0)[now.there]
        if len(now.rows.G) == len(last.rows.G):
            start[count:] = old[len(last.rows.H) :]


_OF_CONTACTS = "geom", "efc_address", "friction"
_WATCHED, _PATTERN = ("efc_id", "efc_frictionloss"), ("efc_J_rownnz", "efc_J_colind")


class _Layout(NamedTuple):
    """Where MuJoCo's structs have what a step reads, in bytes."""

    pointers: dict[str, int]  # of mjData
    of_contacts: list[int]  # of mjContact
    stride: int


@functools.lru_cache(maxsize=None)
def _layout() -> _Layout:
    """Found in a small scene, where all of these are there. Its arrays move from step to step, and
    each costs half a microsecond to be asked for."""
    data = mj.MjData(mj.MjModel.from_xml_string(_SCENE))
    mj.mj_step1(data.model, data)
    names = "efc_J", "efc_pos", "efc_force", *_WATCHED, *_PATTERN
    looked_for = {getattr(data, name).ctypes.data: name for name in names}
    first = data.contact.dist.ctypes.data
    looked_for[first] = "contact"
    found, place = {}, 0  # type: dict[str, int], int
    while len(found) < len(looked_for):
        name = looked_for.get(ctypes.c_uint64.from_address(data._address + place).value)
        if name is not None:
            found[name] = place
        place += 8
    offsets = [getattr(data.contact, name).ctypes.data - first for name in _OF_CONTACTS]
    return _Layout(found, offsets, data.contact.dist.strides[0])


_SCENE = """<mujoco><option jacobian="sparse"/><worldbody><geom type="plane" size="1 1 1"/>
<body><freejoint/><geom size=".1"/></body><body pos="0 0 1"><freejoint/><geom size=".1"/></body>
<body pos="0 0 1.1"><freejoint/><geom size=".1"/></body></worldbody></mujoco>"""


def _pointers(data: Any) -> dict[str, Any]:
    """Where data has its pointers to these arrays."""
    return {name: data._address + k for name, k in _layout().pointers.items()}


_kept: weakref.WeakKeyDictionary[Any, tuple[Any, Stepper]] = weakref.WeakKeyDictionary()


def step(model: Any, data: Any, **settings: Any) -> Solved:
    """mujoco.mj_step(model, data) with perp's contact; settings as for Stepper, which it keeps as
    long as data lives. Returns how the step's problem ended: check its `ok`."""
    kept = _kept.get(data)
    if kept is None or kept[1].model is not model or kept[0] != settings:
        kept = _kept[data] = settings, Stepper(model, **settings)
    return kept[1].step(data)


def contact_force(model: Any, data: Any, contact: int) -> Array:
    """The force and torque of a contact of the last step, in its frame, normal first:
    mujoco.mj_contactForce for any cone of the model."""
    if not 0 <= contact < data.ncon:
        raise argument_error(f"contact is {contact}, expected 0 to {data.ncon - 1}")
    wrench = np.zeros(6)
    with _Borrowed(model):
        mj.mj_contactForce(model, data, contact, wrench)
    return wrench


_linear: weakref.WeakKeyDictionary[Any, tuple[Any, Linearization]] = weakref.WeakKeyDictionary()


def derivatives(
    model: Any, data: Any, *, eps: float = 1e-6, centered: bool = True, **settings: Any
) -> Derivatives:
    """Of the step that step(model, data) would make from no start, by data's state and control:
    mujoco.mjd_transitionFD's A and B. data is left as it is.

    eps, centered: of the differences of MuJoCo's forces; contacts are not differenced. settings: as
    for Stepper.
    verdict: "regular"; "degenerate", where the step is on the edge between two modes, and A and B
    are of one of them; "singular", where v' is not determined.
    """
    if not eps > 0.0:
        raise argument_error(f"eps is {eps}, expected a number > 0")
    kept = _linear.get(data)
    if kept is None or kept[1].model is not model or kept[0] != settings:
        made = Linearization(model, Stepper(model, **settings))
        kept = _linear[data] = settings, made
    return kept[1](data, eps, centered)


class Run(NamedTuple):
    """What simulate() saw. Rows of qpos and qvel belong to times."""

    times: Array
    qpos: Array
    qvel: Array
    outcomes: dict[str, int]  # how many steps ended so
    residual: float  # the worst one
    seconds: float  # of wall time

    @property
    def ok(self) -> bool:
        """Whether every step was solved, or as near as a double can come."""
        return not set(self.outcomes) - {"solved", "rounding_limit"}


def simulate(
    model: Any,
    data: Any,
    seconds: float,
    control: Optional[Callable[[Any, Any], None]] = None,
    *,
    every: int = 1,
    **settings: Any,
) -> Run:
    """Steps data through so many seconds, and keeps every so many states.

    control: called with model and data before each step, to set data.ctrl or forces.
    """
    stepper, outcomes = Stepper(model, **settings), {}  # type: tuple[Stepper, dict[str, int]]
    times, places, speeds, worst = [data.time], [data.qpos.copy()], [data.qvel.copy()], 0.0
    began = _clock.perf_counter()
    for k in range(1, round(seconds / model.opt.timestep) + 1):
        if control is not None:
            control(model, data)
        how = stepper.step(data)
        outcomes[how.outcome] = outcomes.get(how.outcome, 0) + 1
        worst = max(worst, how.residual)
        if k % every == 0:
            times.append(data.time)
            places.append(data.qpos.copy())
            speeds.append(data.qvel.copy())
    seconds = _clock.perf_counter() - began
    return Run(np.array(times), np.array(places), np.array(speeds), outcomes, worst, seconds)


def view(
    model: Any,
    data: Any = None,
    control: Optional[Callable[[Any, Any], None]] = None,
    **settings: Any,
) -> None:
    """Opens MuJoCo's viewer on a simulation in real time, and returns when it is closed."""
    import mujoco.viewer  # type: ignore[import-untyped]

    data = mj.MjData(model) if data is None else data
    stepper = Stepper(model, **settings)
    with mujoco.viewer.launch_passive(model, data) as window:
        while window.is_running():
            began = _clock.perf_counter()
            with window.lock():
                if control is not None:
                    control(model, data)
                stepper.step(data)
            window.sync()
            _clock.sleep(max(model.opt.timestep - (_clock.perf_counter() - began), 0.0))
