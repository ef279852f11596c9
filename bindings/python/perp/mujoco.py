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

import time as _clock
import weakref
from typing import Any, Callable, NamedTuple, Optional

import numpy as np
from numpy.typing import NDArray

try:
    import mujoco as mj  # type: ignore[import-untyped]
except ImportError as error:
    raise ImportError("perp.mujoco needs MuJoCo: pip install 'perp[mujoco]'") from error

from ._stepper import Array, Laws, RowSolver, Solved
from ._words import ContactMethod

__all__ = ["Run", "Solved", "Stepper", "simulate", "step", "view"]

_DENSE = 120  # velocities up to which matrices are dense
_BLOCK = 12  # unknowns of a block of M up to which the library's v has exact zeros
_ELLIPTIC = int(mj.mjtCone.mjCONE_ELLIPTIC)
_AS_DENSE, _AS_SPARSE = int(mj.mjtJacobian.mjJAC_DENSE), int(mj.mjtJacobian.mjJAC_SPARSE)
_IMPLICIT = int(mj.mjtIntegrator.mjINT_IMPLICIT), int(mj.mjtIntegrator.mjINT_IMPLICITFAST)
_NO_EULER_DAMPING = int(mj.mjtDisableBit.mjDSBL_EULERDAMP)

# MuJoCo's rows of a contact are normal, tangents, spin, roll, roll; perp's end with the spin. By
# condim, padded.
_ROWS = np.full((7, 6), -1)
_ROWS[1, :1], _ROWS[3, :3], _ROWS[4, :4], _ROWS[6] = 0, range(3), range(4), (0, 1, 2, 4, 5, 3)
_THERE = _ROWS >= 0
_NONE = np.zeros(0, dtype=np.int64)
_PAIRS = 64  # more contacts than MuJoCo makes of two geoms: places of one pair in a key


class _Mass:
    """M and what implicit integration adds to it, as perp reads it: dense, or by columns."""

    def __init__(self, model: Any, solvers: tuple[RowSolver, ...]) -> None:
        n = model.nv
        row = np.repeat(np.arange(n), model.M_rownnz)  # of the lower triangle
        entry = np.arange(len(row)) + np.repeat(
            model.M_rowadr - np.cumsum(model.M_rownnz) + model.M_rownnz, model.M_rownnz
        )
        column = model.M_colind[entry]
        below = row != column
        rows = np.concatenate([row, column[below]])
        columns = np.concatenate([column, row[below]])
        order = np.lexsort((rows, columns))
        self.diagonal = entry[~below]
        self._entries = np.concatenate([entry, entry[below]])[order]
        self._rows = rows[order].astype(np.int32)
        self._starts = np.searchsorted(columns[order], np.arange(n + 1)).astype(np.int32)
        self._places = rows[order] * n + columns[order]
        self._values = np.zeros(len(order))
        self._dense = np.zeros((n, n)) if n <= _DENSE else None
        for solver in solvers:
            if self._dense is None:
                solver.set_mass(self._values, self._starts, self._rows)
            else:
                solver.set_mass(self._dense)

    def fill(self, values: Array) -> None:
        """From entries as MuJoCo stores them."""
        np.take(values, self._entries, out=self._values, mode="clip")
        if self._dense is not None:
            self._dense.ravel()[self._places] = self._values

    def times(self, v: Array) -> Array:
        if self._dense is not None:
            product: Array = self._dense.dot(v)
            return product
        product = np.add.reduceat(self._values * v[self._rows], self._starts[:-1])
        return product


class _Rows(NamedTuple):
    """Where perp's rows stand among MuJoCo's, as long as the same things touch."""

    key: tuple[Any, ...]
    first: NDArray[Any]  # of each contact: its normal among H's rows
    order: NDArray[Any]  # of each row of H: contacts, then dry friction and limits
    scale: Optional[Array]  # of each row, where friction depends on the direction
    gaps: NDArray[Any]  # the rows of H that have gaps: normals and limits
    sources: NDArray[Any]  # the same among MuJoCo's
    equations: NDArray[Any]  # the rows of G among MuJoCo's
    laws: Laws
    names: NDArray[Any]  # of each contact and row with bounds: the same as long as it lasts
    there: NDArray[Any]  # (names, 6): which rows it has


def _rows(
    key: tuple[Any, ...], model: Any, data: Any, h: float, equations: Any, address: Any
) -> _Rows:
    contact, ne, nb = data.contact, data.ne, data.nf + data.nl
    which = np.flatnonzero(address >= 0)
    address, dim = address[which], contact.dim[which]
    friction = contact.friction[which]
    there = _THERE[dim]
    order = (address[:, None] + _ROWS[dim])[there]
    scale = np.ones((len(which), 6))
    scale[:, 2] = friction[:, 1] / friction[:, 0]
    scale[:, 4] = friction[:, 4] / friction[:, 3]
    scale = np.concatenate([scale[there], np.ones(nb)])
    bounds = h * data.efc_frictionloss[ne : ne + data.nf]
    laws = Laws(
        np.where(dim == 1, 1, 3).astype(np.int32),
        np.where(dim > 1, friction[:, 0], 0.0),
        np.where(dim == 6, friction[:, 3], 0.0),
        np.where(dim >= 4, friction[:, 2], 0.0),
        np.concatenate([-bounds, np.zeros(data.nl)]),
        np.concatenate([bounds, np.full(data.nl, np.inf)]),
    )
    normals = np.cumsum(there.sum(1)) - there.sum(1)
    limits = np.arange(ne + data.nf, ne + nb)
    return _Rows(
        key,
        normals,
        np.concatenate([order, np.arange(ne, ne + nb)]),
        None if (scale == 1.0).all() else scale,
        np.concatenate([normals, len(order) + data.nf + np.arange(data.nl)]),
        np.concatenate([address, limits]),
        equations,
        laws,
        _names(model, contact.geom[which], data.efc_type[ne : ne + nb], data.efc_id[ne : ne + nb]),
        np.concatenate([there, np.tile(_THERE[1], (nb, 1))]),
    )


def _names(model: Any, geom: NDArray[Any], kind: NDArray[Any], which: NDArray[Any]) -> Any:
    pair = (geom[:, 0].astype(np.int64) + 1) * (model.ngeom + 2) + geom[:, 1]
    first = np.flatnonzero(np.diff(pair, prepend=-1))
    place = np.arange(len(pair)) - np.repeat(first, np.diff(first, append=len(pair)))
    rows = -1 - (which.astype(np.int64) * 8 + kind)
    # an upper and a lower limit of one joint: the second is another
    again = np.zeros(len(rows), dtype=np.int64)
    again[1:] = rows[1:] == rows[:-1]
    return np.concatenate([pair * _PAIRS + place, 2 * rows - again])


class Stepper:
    """The steps of one simulation, each from the last one's impulses.

        stepper = perp.mujoco.Stepper(model)
        while data.time < 2.0:
            stepper.step(data)

    method, tol, max_iterations, time_limit: as for perp.contact().
    correction: the share of an overlap, or of an equation's error, that a step takes away.
    slop: the overlap that contacts and limits keep, so that they are found again; None is a
        thousandth of the model's mean size.

    The model's cone is set to elliptic: perp's rows are stored as those, and MuJoCo's functions
    read them so.
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
        self.model = model
        self.correction = correction
        self.slop = 1e-3 * model.stat.meansize if slop is None else slop
        self.corrections = 0
        settings = method, tol, max_iterations, time_limit
        self._solver = RowSolver(model.nv, *settings)
        self._overlaps = RowSolver(model.nv, *settings)
        self._mass = _Mass(model, (self._solver, self._overlaps))
        self._rows: Optional[_Rows] = None
        self._warm = self._some_move_nothing = False
        # those whose zeros the library leaves alone
        trees = np.bincount(model.dof_treeid) if model.nv else _NONE
        self._large = model.nv <= _DENSE and bool((trees > _BLOCK).any())
        self._advances = bool(model.na or model.nplugin or getattr(model, "nhistory", 0))

    def step(self, data: Any) -> Solved:
        """Advances data by the model's timestep, and says how its problem ended. Where that is not
        ok, the best impulses found are used all the same."""
        model, options, solver = self.model, self.model.opt, self._solver
        h = options.timestep
        options.cone = _ELLIPTIC
        options.jacobian = _AS_DENSE if model.nv <= _DENSE else _AS_SPARSE
        mj.mj_step1(model, data)
        mj.mj_fwdActuation(model, data)
        mj.mj_fwdAcceleration(model, data)
        place = self._fill_mass(data, h)
        v = data.qvel
        np.add(self._mass.times(v), h * data.qfrc_smooth, out=solver.f)
        rows = self._take_rows(data, h)
        gaps = data.efc_pos[rows.sources]
        solver.w[rows.gaps] = np.maximum(gaps, 0.0) / h
        if len(rows.equations):
            np.multiply(data.efc_pos[rows.equations], self.correction / h, out=solver.b)
        try:
            how = solver.solve(self._warm)
        except ValueError:  # a contact that moved something does so no more?
            if self._some_move_nothing:
                raise
            self._some_move_nothing = True
            rows = self._take_rows(data, h)
            how = solver.solve(False)
        if self._warm and how.ok:
            how = solver.settle(how, rows.first, lambda: self._fastest(data, h))
        if self._large and how.ok and self._nearly_rests(data, h):
            solver.hold()
        self._warm = how.ok
        solver.keep(how)
        data.qacc[:] = (solver.v - v) / h
        self._give_forces(data, rows, h)
        shift = self._correct(data, rows, gaps, h)
        self._advance(data, h, place, shift)
        return how

    def _fill_mass(self, data: Any, h: float) -> Optional[Array]:
        """M with the implicit part of MuJoCo's integrator. Returns qpos where data has been
        advanced for it, in all but place and velocity."""
        model = self.model
        if model.opt.integrator in _IMPLICIT:
            place: Array = data.qpos.copy()
            v = data.qvel.copy()
            mj.mj_implicit(model, data)
            data.qpos[:], data.qvel[:] = place, v
            self._mass.fill(data.M - h * data.qDeriv[model.mapD2M])
            return place
        M = data.M.copy()
        if not model.opt.disableflags & _NO_EULER_DAMPING:
            M[self._mass.diagonal] += h * model.dof_damping
        self._mass.fill(M)
        return None

    def _take_rows(self, data: Any, h: float) -> _Rows:
        """Fills H and G; new laws, and the start's impulses, where other things touch."""
        ne, nf, nl, contact = data.ne, data.nf, data.nl, data.contact
        dense = self.model.nv <= _DENSE
        J = data.efc_J.reshape(data.nefc, self.model.nv) if dense else None
        live = np.flatnonzero(_moves(data, J, np.arange(ne))) if ne else _NONE
        address = contact.efc_address
        if self._some_move_nothing:
            address = np.where((address >= 0) & _moves(data, J, address), address, -1)
        key = (
            ne, nf, nl, h, live.tobytes(), contact.geom.tobytes(), address.tobytes(),
            contact.friction.tobytes(), data.efc_id[ne : ne + nf + nl].tobytes(),
            data.efc_frictionloss[ne : ne + nf].tobytes(),
        )  # fmt: skip
        rows, solver = self._rows, self._solver
        if rows is None or rows.key != key:
            last, rows = rows, _rows(key, self.model, data, h, live, address)
            if not self._some_move_nothing and not _moves(data, J, address[address >= 0]).all():
                self._some_move_nothing = True
                return self._take_rows(data, h)
            old = solver.r.copy()
            solver.set_laws(rows.laws, len(rows.order), len(live))
            solver.w[:] = 0.0
            if last is not None:
                _hand_over(solver.start, rows, old, last)
            self._rows = rows
        if J is not None:
            np.take(J, rows.order, axis=0, out=solver.H, mode="clip")
            if rows.scale is not None:
                solver.H *= rows.scale[:, None]
            if len(live):
                np.take(J, live, axis=0, out=solver.G, mode="clip")
        else:
            self._take_sparse(data, rows)
        return rows

    def _take_sparse(self, data: Any, rows: _Rows) -> None:
        solver, n = self._solver, self.model.nv
        row, column, values = _entries(data, rows.order)
        if rows.scale is not None:
            values = values * rows.scale[row]
        order = np.argsort(column, kind="stable")
        starts = np.searchsorted(column[order], np.arange(n + 1)).astype(np.int32)
        solver.set_rows(values[order], starts, row[order].astype(np.int32))
        if len(rows.equations):
            _fill_dense(solver.G, data, rows.equations)

    def _give_forces(self, data: Any, rows: _Rows, h: float) -> None:
        """What MuJoCo's sensors and mj_contactForce read."""
        model, solver, force, size = self.model, self._solver, data.efc_force, len(rows.order)
        if len(force):
            r = solver.r[:size] if rows.scale is None else solver.r[:size] * rows.scale
            force[: data.ne] = 0.0
            force[rows.order] = r / h
            force[rows.equations] = solver.r[size:] / h
        mj.mj_mulJacTVec(model, data, data.qfrc_constraint, force)
        if model.nsensor:
            mj.mj_sensorAcc(model, data)

    def _nearly_rests(self, data: Any, h: float) -> bool:
        """Whether a search for what is held is worth its cost: it says nothing of what is."""
        fastest = np.abs(self._solver.v).max()
        return bool(0.0 < fastest < 1e-6 * h * np.abs(data.qacc_smooth).max())

    def _fastest(self, data: Any, h: float) -> float:
        velocities = np.zeros(data.nefc)
        mj.mj_mulJacVec(self.model, data, velocities, data.qvel + h * data.qacc_smooth)
        return float(np.abs(velocities).max())

    def _correct(self, data: Any, rows: _Rows, gaps: Array, h: float) -> Optional[Array]:
        if not len(gaps) or gaps.min() >= -2.0 * self.slop:
            return None
        self.corrections += 1
        if self.model.nv <= _DENSE:
            H = self._solver.H[rows.gaps]
        else:
            H = np.zeros((len(gaps), self.model.nv))
            _fill_dense(H, data, rows.sources)
        return self._overlaps.open(H, self._solver.G, gaps, self.slop, self.correction, h)

    def _advance(self, data: Any, h: float, place: Optional[Array], shift: Optional[Array]) -> None:
        """As MuJoCo does, but that places follow from the very velocities."""
        model, v = self.model, self._solver.v
        if place is None and self._advances:
            place = data.qpos.copy()
            mj.mj_Euler(model, data)
        elif place is None:
            data.time += h
        if place is not None:
            data.qpos[:] = place
        data.qvel[:] = v
        mj.mj_integratePos(model, data.qpos, v if shift is None else v + shift, h)


def _entries(data: Any, rows: NDArray[Any]) -> tuple[NDArray[Any], NDArray[Any], Array]:
    """Row, column and value of each entry of some rows of a sparse J."""
    counts = data.efc_J_rownnz[rows]
    ends = np.cumsum(counts)
    places = np.arange(ends[-1] if len(ends) else 0)
    places += np.repeat(data.efc_J_rowadr[rows] - ends + counts, counts)
    J = data.efc_J.ravel()
    return np.repeat(np.arange(len(rows)), counts), data.efc_J_colind[places], J[places]


def _moves(data: Any, J: Optional[Array], rows: NDArray[Any]) -> NDArray[Any]:
    """Whether each row moves anything: a wall's contact with a planar robot may not."""
    if J is not None:
        return np.asarray(J[rows].any(1))
    row, _, values = _entries(data, rows)
    return np.bincount(row, np.abs(values), len(rows)) > 0.0


def _fill_dense(out: Array, data: Any, rows: NDArray[Any]) -> None:
    row, column, values = _entries(data, rows)
    out[:] = 0.0
    out[row, column] = values


def _hand_over(start: Array, rows: _Rows, old: Array, last: _Rows) -> None:
    """The impulses of what touched already."""
    start[:] = 0.0
    if not len(last.names) or not len(rows.names):
        return
    before = np.zeros(last.there.shape)
    before[last.there] = old[: len(last.order)]
    order = np.argsort(last.names)
    place = np.minimum(np.searchsorted(last.names[order], rows.names), len(order) - 1)
    same = last.names[order[place]] == rows.names
    now = np.where(same[:, None], before[order[place]], 0.0)
    start[: len(rows.order)] = now[rows.there]
    if len(rows.equations) == len(last.equations):
        start[len(rows.order) :] = old[len(last.order) :]


_kept: weakref.WeakKeyDictionary[Any, tuple[Any, Stepper]] = weakref.WeakKeyDictionary()


def step(model: Any, data: Any, **settings: Any) -> Solved:
    """mujoco.mj_step(model, data) with perp's contact; settings as for Stepper, which it keeps as
    long as data lives. Returns how the step's problem ended: check its `ok`."""
    kept = _kept.get(data)
    if kept is None or kept[1].model is not model or kept[0] != settings:
        kept = _kept[data] = settings, Stepper(model, **settings)
    return kept[1].step(data)


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
