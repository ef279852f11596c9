"""MuJoCo's robots with exact contact: MuJoCo loads and moves them, perp solves their steps.

    import mujoco, perp.mujoco

    model = mujoco.MjModel.from_xml_path("scene.xml")
    data = mujoco.MjData(model)
    while data.time < 2.0:
        perp.mujoco.step(model, data)          # in the place of mujoco.mj_step(model, data)

Kinematics, inertia, collision, actuation, passive forces and sensors are MuJoCo's. Its constraint
solver is left out: contacts obey Coulomb's law with the model's coefficients, limits and equations
are rigid, dry friction holds up to its bound. impratio and noslip are not read, nor are solref and
solimp, unless rigid=False asks for them. See docs/mujoco.md. Needs the package mujoco (pip install
'perp[mujoco]').
"""

from __future__ import annotations

import ctypes
import functools
import os
import time as _clock
import weakref
from typing import Any, Callable, NamedTuple, Optional

import numpy as np
from numpy.typing import ArrayLike

try:
    import mujoco as mj  # type: ignore[import-untyped]
except ImportError as error:
    raise ImportError("perp.mujoco needs MuJoCo: pip install 'perp[mujoco]'") from error

from . import _mujoco_model as _model
from ._errors import argument_error
from ._generated import ContactMethod
from ._mujoco_check import Feature, check, refuse, tell_rigid, tumbling
from ._mujoco_derivatives import Derivatives, Linearization
from ._mujoco_model import FAST, NO_EULER_DAMPING, RK4, Borrowed, Damping, Tumbling
from ._mujoco_rows import Touching, find_rows, hand_over, place_of_row, places_of_mass
from ._mujoco_run import Batch, Rollout, Runner, checked, has_callbacks
from ._stepper import Array, Laws, Rows, RowSolver, Solved

__all__ = [
    "Derivatives", "Feature", "Rollout", "Run", "Solved", "Stepper", "check", "contact_force",
    "derivatives", "rollout", "simulate", "step", "view", "wrap",
]  # fmt: skip

_NONE = np.zeros(0, dtype=np.int32)
_NO_ROWS = Rows(Laws(_NONE, *np.zeros((5, 0))), _NONE, _NONE, _NONE)
_BLOCK = 12  # unknowns of a block of M up to which the library's v has exact zeros
NEARLY = 1e-6  # of what drives a step: slower may be at rest
_NO_RESETS = int(mj.mjtDisableBit.mjDSBL_AUTORESET)
_STATE = int(mj.mjtState.mjSTATE_FULLPHYSICS)
_OF_ACCELERATIONS = int(mj.mjtStage.mjSTAGE_ACC)
_OF_FORCES = [  # late as well, but without accelerations
    int(getattr(mj.mjtSensor, f"mjSENS_{name}"))
    for name in (
        "TOUCH", "CONTACT", "ACTUATORFRC", "JOINTACTFRC", "TENDONACTFRC", "JOINTLIMITFRC",
        "TENDONLIMITFRC",
    )
    if hasattr(mj.mjtSensor, f"mjSENS_{name}")
]  # fmt: skip


class Stepper:
    """The steps of one simulation, each from the last one's impulses.

        stepper = perp.mujoco.Stepper(model)
        while data.time < 2.0:
            stepper.step(data)

    method, tol, max_iterations, time_limit: as for perp.contact().
    correction: the share of an overlap, or of an equation's error, that a step takes away.
    slop: the overlap that contacts and limits keep, so that they are found again; None is a
        thousandth of the model's mean size.

    restitution: the share of their normal speed with which what hits each other parts (Moreau's
        law), 0 to 1.
    rigid: False: contacts along their normals, limits and equations comply as the model's solref
        and solimp say, and correction, slop and restitution have no part in it; friction is rigid
        all the same. None is True, with a warning, once, where the model has solref or solimp of
        its own.

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
        restitution: float = 0.0,
        rigid: Optional[bool] = None,
    ) -> None:
        refuse(model)
        if rigid is None:
            rigid = True
            tell_rigid(model)
        if restitution and not rigid:
            raise argument_error("restitution is of rigid contacts; solref has that of soft ones")
        self.rigid = rigid
        if not 0.0 <= restitution <= 1.0:
            raise argument_error(f"restitution is {restitution}, expected 0 to 1")
        self.model = model
        self.correction, self.restitution = correction, restitution
        self._slop = 1e-3 * model.stat.meansize if slop is None else slop
        self.dense = model.nv <= _model.DENSE
        self.holds = self.dense and rigid
        self._entries = _model.entries_of_mass(model)
        self._places_of_mass = places_of_mass(model, self._entries)
        self._diagonal = model.M_rowadr + model.M_rownnz - 1
        self._settings = method, tol, max_iterations, time_limit
        self.mass = np.zeros(model.nC)  # of implicit integrators
        self.begin_anew()
        # those whose zeros the library leaves alone
        self.large = self.holds and bool((np.bincount(model.dof_treeid) > _BLOCK).any())
        more = getattr(model, "nhistory", 0) + getattr(model, "nplastic", 0)
        self.advances = bool(model.na or model.nplugin or more)
        self.damping, self.borrowed = Damping(model), Borrowed(model)
        self.tumbling = Tumbling(model) if len(tumbling(model)) else None
        self._state = np.zeros(mj.mj_stateSize(model, _STATE))
        # what costs a tenth of a microsecond or two to be asked for in every step
        self._options, self.senses = model.opt, bool(model.nsensor)
        late = model.sensor_needstage == _OF_ACCELERATIONS
        self.accelerates = bool((late & ~np.isin(model.sensor_type, _OF_FORCES)).any())
        _model.layout(), has_callbacks()  # what a process finds once is not of its first step

    def steps(self, data: Any, count: int) -> bool:
        """So many steps with the same control, in one call where rollout() makes one. Returns
        whether all were solved."""
        with self.borrowed:
            if not Runner.can(self, data):
                return all([self._step(data).ok for _ in range(count)])
            return self._run(data, count).unsolved == 0

    def _run(self, data: Any, count: int, phase: int = 0) -> Runner:
        """So many steps in one call of the library, of the first what comes from `phase` on."""
        self.bind(data)
        self.solver.numbers.h = self._options.timestep
        if self._runner is None:
            self._runner = Runner(self, data)
        self._runner(count, [], [], phase)
        return self._runner

    @property
    def slop(self) -> float:
        """The overlap that contacts and limits keep."""
        return self._slop

    @slop.setter
    def slop(self, slop: float) -> None:
        self._slop = self.solver.numbers.slop = slop

    @property
    def warm(self) -> bool:
        """Whether the next step has a start."""
        return bool(self.solver.numbers.warm)

    @warm.setter
    def warm(self, warm: bool) -> None:
        self.solver.numbers.warm = warm

    def begin_anew(self) -> None:
        """As if nothing had been stepped before."""
        self.solver = RowSolver(self.model.nv, *self._settings, self.holds)
        self.solver.set_mass(*self._places_of_mass)
        self.solver.numbers.correction, self.solver.numbers.slop = self.correction, self._slop
        self.solver.numbers.restitution = self.restitution
        self.solver.set_reach(_model.turns(self.model))
        self._runner: Optional[Runner] = None
        self._bound: Any = lambda: None  # data, while they last, and what else the numbers go by
        self._bound_by: tuple[int, int] = (-1, -1)
        self.touching: Optional[Touching] = None
        self._soft: Optional[_Soft] = None
        self.warm, self.all_move = False, True

    def step(self, data: Any) -> Solved:
        """Advances data by the model's timestep, and says how its problem ended. Where that is not
        ok, the best impulses found are used all the same."""
        how = self._runner.one(data) if self._runner else None
        if how is not None:
            return how
        with self.borrowed:
            if not Runner.can(self, data):
                return self._step(data)
            self._run(data, 1).fit()
            return self.solver.how

    def gather(self, data: Any) -> None:
        """All of a step before its contacts are solved."""
        model, options = self.model, self._options
        mj.mj_step1(model, data)
        mj.mj_fwdActuation(model, data)
        mj.mj_fwdAcceleration(model, data)
        self._bind(data, options, options.timestep)

    def answer(self, data: Any) -> Rows:
        """The contacts of a step as sharply as can be, with impulses away from the rims of cones
        where there are such, from no start. Returns its rows."""
        self.gather(data)
        self.forget()
        if not data.nefc:
            self._solve_any(data)
            return _NO_ROWS
        if self.dense:
            self.arrange(data)
        else:
            self._solve_any(data)  # which finds the rows that move something
        rows = self.rows
        if len(rows.H):
            turns = rows.laws.rolling.any() or rows.laws.spinning.any()
            if self.solver.solve_by("auto" if turns else "newton", 1e-12).ok:
                return rows
        self._solve_any(data)
        return rows

    def force(self, data: Any) -> Array:
        """The forces of a step in the metric."""
        if self._options.integrator == FAST and self.tumbling is not None:
            return self.tumbling.force
        return np.asarray(data.qfrc_smooth)

    def rebind(self, data: Any) -> None:
        """What is implicit in the metric, at data's state."""
        self._bind(data, self._options, self._options.timestep)

    def metric_mass(self, data: Any) -> Array:
        """The metric's entries, without the damping that Euler adds."""
        return self.mass if self._options.integrator == FAST else np.asarray(data.M)

    def times_mass(self, mass: Array, x: Array) -> Array:
        """Matrices of such entries, a row each, times x."""
        rows, columns, sources = self._entries
        spread = np.zeros((mass.shape[1], len(x)))
        np.add.at(spread, (sources, rows), x[columns])
        return mass @ spread

    def _implicit(self) -> Any:
        """What Euler adds to the diagonal."""
        options = self._options
        if options.integrator == FAST or options.disableflags & NO_EULER_DAMPING:
            return 0.0
        return options.timestep * self.damping.diagonal

    def times(self, data: Any, x: Array) -> Array:
        """The metric, times x."""
        rows, columns, sources = self._entries
        mass = self.metric_mass(data)
        return np.bincount(rows, mass[sources] * x[columns], len(x)) + self._implicit() * x

    def metric(self, data: Any) -> Array:
        """M with what is implicit, dense."""
        n = self.model.nv
        rows, columns, sources = self._entries
        M = np.zeros((n, n))
        M[rows, columns] = self.metric_mass(data)[sources]
        M.ravel()[:: n + 1] += self._implicit()
        return M

    def inverse(self, data: Any, units: Array) -> Array:
        """Of the metric, by MuJoCo's factors; units: a row each."""
        model, M, mass = self.model, data.M, data.M.copy()
        inverse = np.empty_like(units)
        M[:] = self.metric_mass(data)
        M[self._diagonal] += self._implicit()
        mj.mj_factorM(model, data)
        mj.mj_solveM(model, data, inverse, units)
        M[:] = mass
        mj.mj_factorM(model, data)
        return inverse

    def _step(self, data: Any) -> Solved:
        self.gather(data)
        stages = self._options.integrator == RK4
        if stages and data.nefc and Runner.can_end(self, data):
            self._run(data, 1, Runner.GATHERED)
            return self.solver.how
        how = self.solve(data)
        if not self.rigid:
            self.warm = how.ok
        elif not self.solver.known:
            how = self.look(data, how)
        if stages and not data.nefc:
            self.runge_kutta(data)
            return how
        if self.senses:
            self.sense(data)
        shift = self.solver.shift
        if self.solver.known and shift is None and not self.advances:
            data.time += self._options.timestep  # qvel and qpos would become what they are
        else:
            v = self.solver.v
            self._advance(data, self._options.timestep, v if shift is None else v + shift)
        return how

    def runge_kutta(self, data: Any) -> None:
        """The step that MuJoCo's RK4 makes where no row takes part, nor any in its stages."""
        model, h, control = self.model, self._options.timestep, mj.get_mjcb_control()
        place, time = data.qpos.copy(), data.time
        begin, mean = np.concatenate([data.qvel, data.act]), np.zeros(2 * model.nv + model.na)
        data.qacc[:] = data.qacc_smooth
        if self.senses:
            self.sense(data)
        for ahead, weight in ((0.0, 1.0), (0.5, 2.0), (0.5, 2.0), (1.0, 1.0)):
            if ahead:
                now = begin + ahead * h * rate[model.nv :]
                data.qpos[:], data.time = place, time + ahead * h
                mj.mj_integratePos(model, data.qpos, rate[: model.nv], ahead * h)
                data.qvel[:], data.act[:] = now[: model.nv], now[model.nv :]
                mj.mj_fwdPosition(model, data)
                mj.mj_fwdVelocity(model, data)
                if control:
                    control(model, data)
                mj.mj_fwdActuation(model, data)
                mj.mj_fwdAcceleration(model, data)
            rate = np.concatenate([data.qvel, data.qacc_smooth, data.act_dot])
            mean += weight / 6.0 * rate
        data.qpos[:], data.time = place, time
        data.qvel[:], data.act[:] = begin[: model.nv], begin[model.nv :]
        data.act_dot[:] = mean[2 * model.nv :]
        self.solver.v[:] = data.qvel + h * mean[model.nv : 2 * model.nv]
        self._advance(data, h, mean[: model.nv])

    def solve(self, data: Any) -> Solved:
        """The contacts of a step that has been gathered. Where forces are no numbers, what MuJoCo
        does: it warns, and begins anew."""
        if not np.isfinite(data.qacc_smooth).all():
            if self._options.disableflags & _NO_RESETS:
                raise argument_error("data has forces that are not finite, autoreset is disabled")
            data.qacc[:] = data.qacc_smooth
            mj.mj_checkAcc(self.model, data)
            self.forget()
            self.gather(data)
        return self._solve_any(data)

    def forget(self) -> None:
        """The next step has no start."""
        self.touching, self._soft, self.warm = None, None, False
        self.solver.numbers.w = None  # the arranged rows are others'

    def look(self, data: Any, how: Solved) -> Solved:
        """Whether what nearly rests does."""
        solver = self.solver
        if self.warm and how.ok and solver.numbers.slips:
            how = solver.settle(how)
        if self.large and how.ok and self._nearly_rests(data) and solver.may_hold():
            solver.hold()
        self.warm = how.ok
        return how

    def sense(self, data: Any) -> None:
        """Accelerations as MuJoCo's sensors have them: of the forces, before implicit damping."""
        data.flg_rnepost = 0
        mean = data.qacc.copy() if self.accelerates else None
        if mean is not None and mean.any():
            force = (data.qfrc_smooth + data.qfrc_constraint)[None]
            acceleration = np.empty_like(force)
            mj.mj_solveM(self.model, data, acceleration, force)
            data.qacc[:] = acceleration[0]
        mj.mj_sensorAcc(self.model, data)
        if mean is not None:
            data.qacc[:] = mean

    def _bind(self, data: Any, options: Any, h: float) -> None:
        """Where the step's numbers are, and what of its metric changes."""
        self.bind(data)
        if options.integrator == FAST:  # only what it knows of the forces' derivatives is of use
            self._linearise(data, h)
        elif self.damping.changes:
            self.damping.update(data.qvel)
        self.solver.numbers.h = h

    def bind(self, data: Any) -> None:
        options, solver = self._options, self.solver
        integrator, flags = options.integrator, options.disableflags
        if self._bound() is data and self._bound_by == (integrator, flags):
            return
        self._bound, self._bound_by = weakref.ref(data), (integrator, flags)
        self._struct = ctypes.c_void_p(data._address)
        self._at, self._runner = _model.pointers(data), None
        self.forget()
        if self.dense:
            self.solver.numbers.source = ctypes.pointer(_model.source(self.model, data, self._at))
        fields = ("J", "efc_J"), ("gaps", "efc_pos"), ("speeds", "efc_vel")
        for name, field in (*fields, ("row_force", "efc_force")):
            setattr(solver.numbers, name, self._at[field])
        damped = integrator != FAST and not flags & NO_EULER_DAMPING
        solver.bind(
            mass=self.mass if integrator == FAST else data.M,
            damping=self.damping.diagonal if damped else None,
            velocity=data.qvel, force=self.force(data), acceleration=data.qacc,
            force_of_rows=data.qfrc_constraint,
        )  # fmt: skip

    def _linearise(self, data: Any, h: float) -> None:
        model = self.model
        mj.mj_getState(model, data, self._state, _STATE)
        data.qfrc_constraint[:] = 0.0
        mj.mj_implicit(model, data)
        free = data.qvel.copy()
        mj.mj_setState(model, data, self._state, _STATE)
        np.subtract(data.M, h * data.qDeriv[model.mapD2M], out=self.mass)
        if self.tumbling:
            self.tumbling.update(data, (free - data.qvel) / h, self.mass)

    def _solve_any(self, data: Any) -> Solved:
        try:
            return self._solve(data)
        except ValueError:  # a contact that moved something does so no more?
            if self.dense or not self.all_move:
                raise
            self.forget()
            self.all_move = False
            return self._solve(data)

    def _solve(self, data: Any) -> Solved:
        """With the rows of the last step, where the same things touch."""
        solver = self.solver
        if self._may_be_as_before(data):
            if self._soft is not None:
                self._soften(data, self._soft)
            how = solver.step(self.warm)
            if not solver.is_other:
                return how
        self.arrange(data)
        if not self.rigid:
            self._soft = self._soft_rows(data)
            self._soften(data, self._soft)
        return solver.step(self.warm)

    def _may_be_as_before(self, data: Any) -> bool:
        if self._soft is not None:
            same = data.nefc == len(self._soft.offset)
        else:
            same = self.rigid
        return same and (self.dense or self._is_as_before(data))

    def _soft_rows(self, data: Any) -> _Soft:
        """Of those that are arranged, of which it tells the library where their numbers are."""
        solver, numbers = self.solver, self.solver.numbers
        places = ("H_rows", "rows"), ("G_rows", "bilateral"), ("gap_rows", "gap_count")
        H, G, soft = (solver.kept_rows(x, getattr(numbers, count)) for x, count in places)
        yields, offset = np.zeros(len(H) + len(G)), np.zeros(data.nefc)
        solver.comply(yields, offset)
        rows = np.concatenate([soft, np.arange(len(H), len(yields))])
        return _Soft(rows, np.concatenate([H[soft], G]), soft, H[soft], solver.w, yields, offset)

    def _soften(self, data: Any, soft: _Soft) -> None:
        """MuJoCo's compliance: J (v' - v) / h + R f = a, with a the acceleration that solref and
        solimp ask for, is u = J v' + R r - J v - h a."""
        h = self._options.timestep
        offset = -data.efc_vel - h * data.efc_aref
        soft.w[soft.gaps] = offset[soft.of_gaps]
        soft.yields[soft.rows] = data.efc_R[soft.sources]
        np.multiply(h, offset, out=soft.offset)
        self.solver.numbers.rests = 0

    def _is_as_before(self, data: Any) -> bool:
        key = data.ne, data.nf, data.nl, data.ncon, self._options.timestep
        return self.touching is not None and key == self.touching.key

    def arrange(self, data: Any) -> None:
        """The rows of what touches now."""
        if self.dense:
            self.solver.arrange_from_source()
            return
        h = self._options.timestep
        key = data.ne, data.nf, data.nl, data.ncon, h
        self._take_rows(find_rows(key, self.model, data, h, self.all_move), data)

    @property
    def rows(self) -> Rows:
        """Those that are arranged, as long as they are."""
        solver, numbers = self.solver, self.solver.numbers
        if not self.dense:
            assert self.touching is not None
            return self.touching.rows
        places = ("H_rows", "rows"), ("G_rows", "bilateral"), ("gap_rows", "gap_count")
        arranged = [solver.kept_rows(x, getattr(numbers, count)) for x, count in places]
        return Rows(solver.laws, *arranged, solver.row_scale)

    def _take_rows(self, touching: Touching, data: Any) -> None:
        """Other rows, the start's impulses, and what is looked at to find these the same."""
        solver, last, at, layout = self.solver, self.touching, self._at, _model.layout()
        old = solver.start.copy()
        solver.arrange(touching.rows, data.nefc)
        if last is not None:
            hand_over(solver.start, touching, old, last)
        self.touching, contact = touching, data.contact
        kept = [getattr(contact, name).copy() for name in _model.OF_CONTACTS]
        places = [(at["contact"], offset, layout.stride) for offset in layout.of_contacts]
        kept.insert(0, np.array([data.ncon, data.ne, data.nf, data.nl, data.nefc], dtype=np.int32))
        places.insert(0, (ctypes.addressof(self._struct), layout.counts, 4))
        for name in _model.WATCHED + _model.PATTERN:
            kept.append(getattr(data, name).copy())
            places.append((at[name], 0, kept[-1].itemsize))
        for row in touching.still:  # zeros as long as they move nothing
            begin, count = place_of_row(data, row)
            kept.append(np.zeros(count))
            places.append((at["efc_J"], 8 * begin, 8))
        solver.watch(places, kept)

    def _nearly_rests(self, data: Any) -> bool:
        """Whether a search for what is held is worth its cost: it says nothing of what is."""
        drive = self._options.timestep * np.abs(data.qacc_smooth).max()
        return bool(0.0 < self.solver.numbers.fastest < NEARLY * drive)

    def _advance(self, data: Any, h: float, velocity: Array) -> None:
        """As MuJoCo does, but that places move with these very velocities."""
        model, v = self.model, self.solver.v
        if self.advances:
            place = data.qpos.copy()
            mj.mj_Euler(model, data)
            data.qpos[:] = place
        else:
            data.time += h
        data.qvel[:] = v
        mj.mj_integratePos(model, data.qpos, velocity, h)


class _Soft(NamedTuple):
    """Which rows comply, and where the numbers of that are, while the same things touch."""

    rows: Any  # of H and G
    sources: Any  # where they stand among MuJoCo's
    gaps: Any  # those of H
    of_gaps: Any
    w: Array
    yields: Array  # of the rows of H and G
    offset: Array  # of MuJoCo's rows: what b is made of


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
    with Borrowed(model):
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
    No other thread may step the model meanwhile: its options are others for a while.
    verdict: "regular"; "degenerate", where the step is on the edge between two modes, and A and B
    are of one of them; "singular", where v' is not determined. Restitution and moving surfaces are
    refused.
    """
    if not eps > 0.0:
        raise argument_error(f"eps is {eps}, expected a number > 0")
    if settings.get("restitution") or getattr(model, "flg_surfacevel", 0):
        raise argument_error("restitution and moving surfaces (surfacevel) have no derivatives")
    if settings.get("rigid") not in (None, True):
        raise argument_error("soft contacts (rigid=False) have no derivatives")
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


def rollout(
    model: Any,
    states: ArrayLike,
    controls: Optional[ArrayLike] = None,
    *,
    steps: Optional[int] = None,
    threads: Optional[int] = None,
    **settings: Any,
) -> Rollout:
    """Steps the model from many states, as mujoco.rollout does; the same bits at any number of
    threads, and those of Stepper.step from each state.

    states: (starts, mj_stateSize(model, mjSTATE_FULLPHYSICS)), or one.
    controls: (starts, steps, nu), or (steps, nu) for all; None: so many steps with none.
    threads: None is one a processor. settings: as for Stepper.
    """
    threads = os.cpu_count() or 1 if threads is None else threads
    if threads < 1:
        raise argument_error(f"threads is {threads}, expected 1 or more")
    refuse(model)
    make = functools.partial(Stepper, model, **settings)
    return Batch(model, make, *checked(model, states, controls, steps)).run(threads)


def wrap(env: Any, **settings: Any) -> Any:
    """A MuJoCo environment of gymnasium, from now on stepped by perp; returns env.

        env = perp.mujoco.wrap(gymnasium.make("Ant-v5"))

    settings: as for Stepper.
    """
    inner = getattr(env, "unwrapped", env)
    if not hasattr(inner, "_step_mujoco_simulation"):
        raise argument_error("env is not a MuJoCo environment of gymnasium")
    model, data = inner.model, inner.data
    stepper = Stepper(model, **settings)

    def advance(ctrl: ArrayLike, frames: int) -> None:
        data.ctrl[:] = ctrl
        stepper.steps(data, frames)
        with stepper.borrowed:  # which reads contact forces
            mj.mj_rnePostConstraint(model, data)

    inner._step_mujoco_simulation = advance
    return env


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
