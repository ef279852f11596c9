"""What a step needs of a MuJoCo model beside its rows: options, damping, and where data is."""

from __future__ import annotations

import ctypes
import functools
import threading
import weakref
from typing import Any, NamedTuple

import mujoco as mj  # type: ignore[import-untyped]
import numpy as np
from numpy.typing import NDArray

from ._generated import ContactSource
from ._mujoco_check import tumbling
from ._structures import sized

Array = NDArray[np.float64]

DENSE = 120  # velocities up to which matrices are dense
_ELLIPTIC = int(mj.mjtCone.mjCONE_ELLIPTIC)
_AS_DENSE, _AS_SPARSE = int(mj.mjtJacobian.mjJAC_DENSE), int(mj.mjtJacobian.mjJAC_SPARSE)
FAST = int(mj.mjtIntegrator.mjINT_IMPLICITFAST)
RK4 = int(mj.mjtIntegrator.mjINT_RK4)
_TAKEN = {int(mj.mjtIntegrator.mjINT_IMPLICIT): FAST}
NO_EULER_DAMPING = int(mj.mjtDisableBit.mjDSBL_EULERDAMP)
_NEWTON = int(mj.mjtSolver.mjSOL_NEWTON)  # which needs no matrix of all rows with all,
_NO_ISLANDS = int(getattr(mj.mjtDisableBit, "mjDSBL_ISLAND", 0))  # as nothing of MuJoCo's solves


class _Lent:
    """A model's options while steppers have them: one for each model, of all its steppers. mine: the
    user's own, with timestep and flags."""

    of: weakref.WeakValueDictionary[int, _Lent] = weakref.WeakValueDictionary()  # by address
    making = threading.Lock()

    def __init__(self, model: Any) -> None:
        self.options, self.lock, self.users = model.opt, threading.Lock(), 0
        begin, end, first, last = place_of_options()
        self.cells = (ctypes.c_char * (end - begin)).from_address(model._address + begin)
        self.taken = (ctypes.c_char * (last - first)).from_address(model._address + first)
        self.mine, self.own, self.theirs, self.jacobian = b"", b"", b"", -1

    def take(self, jacobian: int) -> None:
        """Where they are others than were taken last."""
        options = self.options
        self.mine, self.own, self.jacobian = self.cells.raw, self.taken.raw, jacobian
        options.cone, options.jacobian = _ELLIPTIC, jacobian
        options.solver, options.noslip_iterations = _NEWTON, 0
        options.disableflags |= _NO_ISLANDS
        options.integrator = _TAKEN.get(options.integrator, options.integrator)
        self.theirs = self.taken.raw

    def give_back(self) -> None:
        with self.lock:
            self.users -= 1
            if not self.users:
                self.taken.raw = self.own


class Borrowed:
    """A model's cone and Jacobian are as perp stores rows, implicitfast is taken for implicit, and
    nothing is made for MuJoCo's solvers, while this is entered; the user's own are back after that:
    also where several threads step it."""

    def __init__(self, model: Any) -> None:
        with _Lent.making:
            lent = _Lent.of.get(model._address)
            self.lent = lent = lent or _Lent(model)
            _Lent.of[model._address] = lent
        self._jacobian = _AS_DENSE if model.nv <= DENSE else _AS_SPARSE

    def __enter__(self) -> None:
        lent = self.lent
        with lent.lock:
            if not lent.users:  # here, as each call costs a small robot's step a part of its time
                if lent.cells.raw == lent.mine and lent.jacobian == self._jacobian:
                    lent.taken.raw = lent.theirs
                else:
                    lent.take(self._jacobian)
            lent.users += 1

    def __exit__(self, *_: Any) -> None:
        self.lent.give_back()


def turns(model: Any) -> Any:
    """Of each velocity: whether its coordinate is an angle."""
    of = model.dof_jntid
    slides = model.jnt_type[of] == mj.mjtJoint.mjJNT_SLIDE
    moves = model.jnt_type[of] == mj.mjtJoint.mjJNT_FREE
    return ~(slides | (moves & (np.arange(model.nv) < model.jnt_dofadr[of] + 3)))


class Damping:
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


class Tumbling:
    """Forces of free bodies with implicitfast's gyroscopic term, which is not symmetric: those that
    give MuJoCo's acceleration in the symmetric rest of its metric."""

    def __init__(self, model: Any) -> None:
        self._dofs = (tumbling(model)[:, None] + np.arange(6)).ravel()
        row, column, entry = entries_of_mass(model)
        mine = np.isin(row, self._dofs)
        self._entries = row[mine], column[mine], entry[mine]
        self.force = np.zeros(model.nv)

    def update(self, data: Any, acceleration: Array, mass: Array) -> None:
        row, column, entry = self._entries
        self.force[:] = data.qfrc_smooth
        of_mass = np.bincount(row, mass[entry] * acceleration[column], len(self.force))
        self.force[self._dofs] = of_mass[self._dofs]


def entries_of_mass(model: Any) -> tuple[NDArray[Any], NDArray[Any], NDArray[Any]]:
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


OF_CONTACTS = "geom", "efc_address", "dim", "friction"
WATCHED, PATTERN = ("efc_id", "efc_frictionloss"), ("efc_J_rownnz", "efc_J_colind")


class Layout(NamedTuple):
    """Where MuJoCo's structs have what a step reads, in bytes."""

    pointers: dict[str, int]  # of mjData
    of_contacts: list[int]  # of mjContact
    stride: int
    surface: int  # of mjContact; 0 in versions without
    counts: int  # of mjData: contacts, equations, rows of dry friction and of limits, all rows
    time: int


@functools.lru_cache(maxsize=None)
def layout() -> Layout:
    """Found in a small scene, where all of these are there. Its arrays move from step to step, and
    each costs half a microsecond to be asked for."""
    data = mj.MjData(mj.MjModel.from_xml_string(_SCENE))
    mj.mj_step1(data.model, data)
    names = "efc_J", "efc_pos", "efc_force", "efc_type", "efc_vel", *WATCHED, *PATTERN
    looked_for = {getattr(data, name).ctypes.data: name for name in names}
    first = data.contact.dist.ctypes.data
    looked_for[first] = "contact"
    data.time, found = _SOME_TIME, {}  # type: float, dict[str, int]
    struct = b""
    while len(found) < len(looked_for):  # page by page: those are there as a whole
        begin = data._address + len(struct)
        page = ctypes.string_at(begin, _PAGE - begin % _PAGE)
        words = np.frombuffer(page, dtype=np.uint64)
        for place in np.flatnonzero(np.isin(words, list(looked_for))).tolist():
            if len(found) < len(looked_for):  # the arena's pointer, which comes first, is contact's
                found[looked_for[int(words[place])]] = len(struct) + 8 * place
        struct += page
    offsets = [getattr(data.contact, name).ctypes.data - first for name in OF_CONTACTS]
    moving = getattr(data.contact, "surfacevel", None)
    surface = 0 if moving is None else moving.ctypes.data - first
    counts = np.array([data.ncon, data.ne, data.nf, data.nl, data.nefc], dtype=np.int32)
    return Layout(
        found, offsets, data.contact.dist.strides[0], surface,
        struct.index(counts.tobytes()), struct.index(np.float64(_SOME_TIME).tobytes()),
    )  # fmt: skip


@functools.lru_cache(maxsize=None)
def place_of_options() -> tuple[int, int, int, int]:
    """Where a model has its timestep and what is lent, from and to, in bytes; and where the latter.
    Reading them there costs a tenth of asking for each."""
    model = mj.MjModel.from_xml_string(_SCENE)
    places = []
    lent = "disableflags", "integrator", "cone", "jacobian", "solver", "noslip_iterations"
    for name in "timestep", *lent:
        seen = []
        for value in (0.1, 0.3) if name == "timestep" else (0, 1):
            setattr(model.opt, name, value)
            seen.append(np.frombuffer(ctypes.string_at(model._address, _OPTIONS_BEFORE), np.int32))
        places.append(4 * int(np.flatnonzero(seen[0] != seen[1])[0]))
    return min(places), max(places) + 4, min(places[1:]), max(places[1:]) + 4


_OPTIONS_BEFORE = 2048  # a model begins with some hundred sizes, and then the options

_PAGE = 4096  # bytes: no system's is smaller
_SOME_TIME = 0.12345678901234567  # found nowhere else
_SCENE = """<mujoco><option jacobian="sparse"/><worldbody><geom type="plane" size="1 1 1"/>
<body><freejoint/><geom size=".1"/></body><body pos="0 0 1"><freejoint/><geom size=".1"/></body>
<body pos="0 0 1.1"><freejoint/><geom size=".1"/></body></worldbody></mujoco>"""


def pointers(data: Any) -> dict[str, Any]:
    """Where data has its pointers to these arrays."""
    begin = data._address
    return {name: begin + k for name, k in layout().pointers.items()}


def source(model: Any, data: Any, at: dict[str, Any]) -> ContactSource:
    """Where perp_contact_solver_arrange finds what touches."""
    where, found = layout(), sized(ContactSource)
    found.counts = data._address + where.counts
    found.contacts, found.stride = at["contact"], where.stride
    found.geoms_at, found.row_at, found.dim_at, found.friction_at = where.of_contacts
    found.geoms = model.ngeom
    found.surface_at = where.surface if getattr(model, "flg_surfacevel", 0) else 0
    found.kinds, found.ids, found.bounds = at["efc_type"], at["efc_id"], at["efc_frictionloss"]
    return found
