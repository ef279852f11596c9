"""Which features of a MuJoCo model are treated as MuJoCo does, and which not."""

from __future__ import annotations

import warnings
from typing import Any, Callable, NamedTuple

import mujoco as mj  # type: ignore[import-untyped]
import numpy as np

from ._errors import argument_error

SAME, EXACT, IGNORED, REFUSED = "same", "exact instead of soft", "ignored", "refused"


class Feature(NamedTuple):
    """Something that a model uses.

    treatment: "same": as MuJoCo has it, to rounding; "exact instead of soft": the law that MuJoCo
        approximates; "ignored": it has no effect; "refused": no step is made.
    """

    name: str
    treatment: str
    note: str = ""


_Table = list[tuple[str, str, Callable[[Any], Any], str]]


def check(model: Any, *, rigid: bool = True) -> list[Feature]:
    """Returns every feature that the model uses, with how a step treats it; rigid: as for
    Stepper."""
    found = [Feature(name, how, note) for name, how, uses, note in _TABLE if _any(uses(model))]
    return found if rigid else [_SOFTLY.get(one.name, one) for one in found]


def refuse(model: Any) -> None:
    """Raises ValueError where the model has something that is refused."""
    refused = [one for one in check(model) if one.treatment == REFUSED]
    if refused:
        listed = "; ".join(f"{one.name} ({one.note})" for one in refused)
        raise argument_error(f"model asks for what perp.mujoco can't do: {listed}")


def tell_rigid(model: Any) -> None:
    """Warns, once in a process, where a model has compliance of its own that is not read."""
    if _any(_softness(model)):
        warnings.warn(_STIFF, stacklevel=2)


def _any(found: Any) -> bool:
    return bool(np.any(np.asarray(found)))


def _get(name: str) -> Callable[[Any], Any]:
    """An array or a size of a model; 0 in versions of MuJoCo without it."""
    return lambda model: getattr(model, name, 0)


def _option(name: str, code: Any) -> Callable[[Any], Any]:
    return lambda model: getattr(model.opt, name) == int(code)


def _flag(name: str) -> Callable[[Any], Any]:
    """Whether a flag is enabled; not in versions of MuJoCo without it."""
    bit = int(getattr(mj.mjtEnableBit, "mjENBL_" + name, 0))
    return lambda model: model.opt.enableflags & bit


def _types(array: str, enum: Any, *names: str) -> Callable[[Any], Any]:
    """Whether a model has something of these types."""
    codes = [int(getattr(enum, name)) for name in names if hasattr(enum, name)]
    return lambda model: np.isin(getattr(model, array), codes)


def _collides(model: Any) -> Any:
    geoms = (model.geom_contype != 0).any() and (model.geom_conaffinity != 0).any()
    disabled = model.opt.disableflags & int(mj.mjtDisableBit.mjDSBL_CONTACT)
    return not disabled and (geoms or model.npair or model.nflex)


def _dims(*dims: int) -> Callable[[Any], Any]:
    return lambda model: _collides(model) and np.isin(
        np.concatenate([model.geom_condim, model.pair_dim, model.flex_condim]), dims
    )


def _other(*names: str) -> Callable[[Any], Any]:
    """Whether an option has another value than MuJoCo's default."""
    default = mj.MjOption()
    return lambda model: [getattr(model.opt, x) != getattr(default, x) for x in names]


def _softness(model: Any) -> Any:
    """Whether anything has solref or solimp of its own."""
    names = _SOFT
    given = {"solref": np.array([0.02, 1.0]), "solimp": np.array([0.9, 0.95, 0.001, 0.5, 2.0])}
    return [
        (getattr(model, x) != given["solref" if "solref" in x else "solimp"]).any()
        for x in names
        if "friction" not in x  # of pairs: 0 is "as solref"
    ]


_SOFT = [x for x in dir(mj.MjModel) if "solref" in x or "solimp" in x]


def _euler(model: Any) -> Any:
    return model.opt.integrator == int(mj.mjtIntegrator.mjINT_EULER)


def _implicit(model: Any) -> Any:
    known = mj.mjtIntegrator.mjINT_IMPLICIT, mj.mjtIntegrator.mjINT_IMPLICITFAST
    return model.opt.integrator in [int(one) for one in known]


def tumbling(model: Any) -> Any:
    """The first velocities of free bodies without children, whose gyroscopic term implicitfast
    knows; not of those that are as balls are."""
    joints = np.flatnonzero(model.jnt_type == int(mj.mjtJoint.mjJNT_FREE))
    bodies = model.jnt_bodyid[joints]
    uneven = np.ptp(model.body_inertia[bodies], axis=1) > 0.0
    return model.jnt_dofadr[joints[uneven & ~np.isin(bodies, model.body_parentid[1:])]]


def _of_integrator(code: str) -> Callable[[Any], Any]:
    known = getattr(mj.mjtIntegrator, code, None)
    return (lambda model: False) if known is None else _option("integrator", known)


def _plugins(model: Any) -> Any:
    return model.nplugin


_STIFF = (
    "the model's solref and solimp are not read: contacts, limits and equations are rigid; "
    "rigid=False lets them comply, rigid=True keeps them rigid without this warning"
)
_COMPLIES = "complies as solref and solimp say"
_SOFTLY = {  # what rigid=False treats otherwise
    name: Feature(name, treatment, note)
    for name, treatment, note in (
        ("contact", EXACT, "the normal complies as solref and solimp say; Coulomb's law"),
        ("margin", SAME, "contacts bear within their margins"),
        ("equality", SAME, _COMPLIES),
        ("equality of flexes", SAME, _COMPLIES),
        ("limits of joints", SAME, _COMPLIES),
        ("limits of tendons", SAME, _COMPLIES),
        ("solref, solimp", SAME, "but for friction, which is rigid"),
        ("flag override", SAME, "o_margin, o_solref, o_solimp, o_friction"),
        ("flag diagexact", SAME, ""),
    )
}

_EQ, _SENSOR = mj.mjtEq, mj.mjtSensor
_INERTIAL = "mjSENS_ACCELEROMETER", "mjSENS_FORCE", "mjSENS_TORQUE", "mjSENS_FRAMELINACC"
_RIGID = "the law of rigid bodies; solref and solimp are not read"
_TABLE: _Table = [
    ("integrator Euler", SAME, _euler, "damping of joints is implicit"),
    (
        "integrator implicitfast", SAME, _of_integrator("mjINT_IMPLICITFAST"),
        "contacts answer in the same metric",
    ),
    (
        "gyroscopic term of free bodies", SAME, lambda m: _implicit(m) and len(tumbling(m)),
        "implicitfast's correction of bodies that tumble",
    ),
    ("integrator implicit", IGNORED, _of_integrator("mjINT_IMPLICIT"), "implicitfast is taken"),
    (
        "integrator RK4", SAME, _of_integrator("mjINT_RK4"),
        "in steps without contacts, limits, equations and dry friction; Euler is taken in others",
    ),
    (
        "integrator discrete", REFUSED, _of_integrator("mjINT_DISCRETE"),
        "set Euler or implicitfast",
    ),
    ("contact", EXACT, _dims(1, 3), "Signorini's and Coulomb's law; " + _RIGID),
    (
        "condim 4", EXACT, _dims(4),
        "spinning friction up to a bound of its own beside Coulomb's cone",
    ),
    (
        "condim 6", EXACT, _dims(6),
        "spinning and rolling friction up to bounds of their own beside Coulomb's cone",
    ),
    (
        "cone pyramidal", EXACT,
        lambda m: _collides(m) and m.opt.cone != int(mj.mjtCone.mjCONE_ELLIPTIC),
        "Coulomb's cone itself; read forces with perp.mujoco.contact_force",
    ),
    (
        "margin", EXACT, lambda m: np.concatenate([m.geom_margin, m.pair_margin, m.flex_margin]),
        "surfaces bear where they meet, not at the margin",
    ),
    ("geom adhesion", EXACT, _get("flg_adhesion"), "contacts pull with up to the given force"),
    (
        "geom surfacevel", EXACT, lambda m: m.nv <= 120 and _get("flg_surfacevel")(m),
        "what sticks has the surface's velocity",
    ),
    (
        "geom surfacevel of large models", REFUSED,
        lambda m: m.nv > 120 and _get("flg_surfacevel")(m), "more than 120 velocities",
    ),
    (
        "equality", EXACT,
        _types("eq_type", _EQ, "mjEQ_CONNECT", "mjEQ_WELD", "mjEQ_JOINT", "mjEQ_TENDON"),
        _RIGID,
    ),
    (
        "equality of flexes", EXACT,
        _types("eq_type", _EQ, "mjEQ_FLEX", "mjEQ_FLEXSTRAIN", "mjEQ_FLEXVERT"), _RIGID,
    ),
    ("limits of joints", EXACT, lambda m: m.jnt_limited, _RIGID),
    ("limits of tendons", EXACT, lambda m: m.tendon_limited, _RIGID),
    (
        "frictionloss", EXACT, lambda m: [m.dof_frictionloss.any(), m.tendon_frictionloss.any()],
        "holds up to its bound",
    ),
    ("solref, solimp", IGNORED, _softness, "contacts, limits and equations are rigid"),
    ("impratio", IGNORED, _other("impratio"), "friction and normal force are exact"),
    (
        "solver's settings", IGNORED,
        _other("solver", "iterations", "ls_iterations", "tolerance", "ls_tolerance"),
        "tol and max_iterations are those of Stepper",
    ),
    ("noslip_iterations", IGNORED, _other("noslip_iterations"), "nothing slips that should hold"),
    ("stiffness of joints", SAME, lambda m: m.jnt_stiffness, ""),
    ("stiffness of tendons", SAME, lambda m: m.tendon_stiffness, ""),
    ("springyield", SAME, _get("nplastic"), "advanced with the state"),
    ("damping of joints", SAME, lambda m: m.dof_damping, ""),
    ("polynomial damping of joints", SAME, _get("dof_dampingpoly"), ""),
    ("damping of tendons", SAME, lambda m: m.tendon_damping, ""),
    ("fluid forces", SAME, lambda m: [m.opt.density, m.opt.viscosity], ""),
    ("gravcomp", SAME, lambda m: m.body_gravcomp, ""),
    ("actuators", SAME, lambda m: m.nu, "those with activations, histories and damping, too"),
    ("plugins", SAME, _plugins, "their states advance as MuJoCo's do"),
    ("mocap bodies", SAME, lambda m: m.nmocap, ""),
    ("flexes", SAME, lambda m: m.nflex, "their elastic forces; contacts and equations are exact"),
    ("sensors", SAME, lambda m: m.nsensor, "of the exact contact forces"),
    (
        "sensors of acceleration and force", SAME, _types("sensor_type", _SENSOR, *_INERTIAL),
        "of the forces at the step's begin, contact forces at its end",
    ),
    ("flag sleep", REFUSED, _flag("SLEEP"), "what rests costs no solve anyway"),
    ("flag ipc", REFUSED, _flag("IPC"), "flexes touch by perp's contact"),
    ("flag override", IGNORED, _flag("OVERRIDE"), "but for margin and friction"),
    ("flag speculative", SAME, _flag("SPECULATIVE"), "contacts are those it finds"),
    ("flag energy", SAME, _flag("ENERGY"), ""),
    ("flag fwdinv", IGNORED, _flag("FWDINV"), "statistics of MuJoCo's solver"),
    ("flag diagexact", IGNORED, _flag("DIAGEXACT"), "part of MuJoCo's soft contacts"),
    ("flag autoreset", SAME, lambda m: True, "what is no number is set back, with a warning"),
]  # fmt: skip
