"""perp: complementarity problems, and rigid bodies with contact and Coulomb friction.

lcp, LCP    linear complementarity problems with bounds, once or again and again
lcp_all     every solution of a small problem, families of solutions included
lcp_batch   many small problems in one call
lcp_product  a symmetric matrix that is known by its products alone
lcp_sensitivity  derivatives of a solution with respect to its data
lcp_verify  a proof that a solution lies near a point
ncp         nonlinear complementarity problems with bounds, from functions
NCP         the same, kept for many solves
ncp_check_jacobian  a Jacobian against differences of its function
contact     contact with friction over dynamics of your own
ContactSolver     the same, kept for many solves
contact_delassus  the same from the matrix W that couples the contacts
statics     whether contacts can carry forces: equilibrium, or a motion that proves there is none
contact_sensitivity  derivatives of velocities and impulses with respect to the data
fclib       (perp.fclib, imported by name) problems in FCLIB's files
Mechanism   mechanisms in coordinates of your own, by functions: steps, all accelerations
load_friction  every acceleration where friction depends on the load (screws, gears, guides)
load_friction_step  a step in time over it, through jams
LoadFriction  the same, kept for many questions and steps
Compliant   sliding contacts that give: stability, integration
load_friction_inverse  the torque for an acceleration, and what else that torque may do
stribeck, LuGre  friction that depends on speed, and on bristles that bend
World       rigid bodies with contact, stepped in time
History     a monitor that keeps what it sees, for result.history and result.plot()
Error       what every failed call raises; bad arguments are ValueErrors, too
"""

from typing import TYPE_CHECKING, Any

from ._all import Solution, Solutions, lcp_all
from ._answer import History
from ._batch import Batch, lcp_batch
from ._body import Body, Shape
from ._contact import ContactResult, ContactSolver, contact, contact_delassus
from ._contact_sensitivity import ContactSensitivity, contact_sensitivity
from ._errors import Error, OutsideDomain
from ._joint import Joint, Reaction
from ._lcp import LCP, LcpResult, lcp
from ._library import version, version_text
from ._monitor import Progress
from ._product import lcp_product
from ._ncp import NCP, JacobianCheck, NcpResult, ncp, ncp_check_jacobian
from ._results import Contact, Energy, Momentum, RunResult, Stats, StepResult
from ._sensitivity import Sensitivity, lcp_sensitivity
from ._statics import StaticsResult, WorldStatics, statics
from ._verify import Proof, lcp_verify
from ._version import __version__
from ._world import World

if TYPE_CHECKING:
    from ._bristle import LuGre, Stribeck, stribeck
    from ._compliant import Compliant, CompliantRun, Linearisation
    from ._friction import (
        InverseLoad,
        LoadFriction,
        LoadSolution,
        LoadSolutions,
        LoadStepped,
        load_friction,
        load_friction_inverse,
        load_friction_step,
    )
    from ._mechanism import Mechanism
    from ._mechanism_accelerations import Acceleration, Accelerations
    from ._mechanism_check import MechanismCheck
    from ._mechanism_results import MechanismRun, MechanismStats, MechanismStep

# What is in libperp-mechanism, which is loaded when one of these names is used first, by module.
_MECHANISM = {
    "_bristle": ("LuGre", "Stribeck", "stribeck"),
    "_compliant": ("Compliant", "CompliantRun", "Linearisation"),
    "_friction": (
        "InverseLoad",
        "LoadFriction",
        "LoadSolution",
        "LoadSolutions",
        "LoadStepped",
        "load_friction",
        "load_friction_inverse",
        "load_friction_step",
    ),
    "_mechanism": ("Mechanism",),
    "_mechanism_accelerations": ("Acceleration", "Accelerations"),
    "_mechanism_check": ("MechanismCheck",),
    "_mechanism_results": ("MechanismRun", "MechanismStats", "MechanismStep"),
}
_MODULES = {name: module for module, names in _MECHANISM.items() for name in names}

__all__ = [
    "LCP",
    "NCP",
    "Acceleration",
    "Accelerations",
    "Batch",
    "Body",
    "Compliant",
    "CompliantRun",
    "Contact",
    "ContactResult",
    "ContactSensitivity",
    "ContactSolver",
    "Energy",
    "Error",
    "History",
    "InverseLoad",
    "JacobianCheck",
    "Joint",
    "LcpResult",
    "Linearisation",
    "LoadFriction",
    "LoadSolution",
    "LoadSolutions",
    "LoadStepped",
    "LuGre",
    "Mechanism",
    "MechanismCheck",
    "MechanismRun",
    "MechanismStats",
    "MechanismStep",
    "Momentum",
    "NcpResult",
    "OutsideDomain",
    "Progress",
    "Proof",
    "Reaction",
    "RunResult",
    "Sensitivity",
    "Shape",
    "Solution",
    "Solutions",
    "StaticsResult",
    "Stats",
    "StepResult",
    "Stribeck",
    "World",
    "WorldStatics",
    "__version__",
    "contact",
    "contact_delassus",
    "contact_sensitivity",
    "lcp",
    "lcp_all",
    "lcp_batch",
    "lcp_product",
    "lcp_sensitivity",
    "lcp_verify",
    "load_friction",
    "load_friction_inverse",
    "load_friction_step",
    "ncp",
    "ncp_check_jacobian",
    "statics",
    "stribeck",
    "version",
    "version_text",
]


def __getattr__(name: str) -> Any:
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib import import_module

    globals()[name] = value = getattr(import_module(f".{_MODULES[name]}", __name__), name)
    return value


def __dir__() -> list[str]:
    return sorted({*globals(), *_MODULES})
