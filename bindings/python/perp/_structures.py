"""The structs of include/perp/*.h, field by field, and the types of its callbacks.

tests/test_layout.py compares every size and offset with what a C compiler says of the headers.
"""

from __future__ import annotations

from ctypes import (
    CFUNCTYPE,
    POINTER,
    Structure,
    c_char_p,
    c_double,
    c_int32,
    c_int64,
    c_size_t,
    c_uint64,
    c_void_p,
    sizeof,
)
from typing import TypeVar

from ._structures_mechanism import MECHANISM_STRUCTS

Vector3 = c_double * 3
Vector4 = c_double * 4
Matrix3 = c_double * 9


# Opaque handles: a type each, so that ctypes refuses one where another belongs.
class ContextHandle(Structure):
    pass


class SolverHandle(Structure):
    pass


class SensitivityHandle(Structure):
    pass


class ContactSolverHandle(Structure):
    pass


class WorldHandle(Structure):
    pass


class LoadFrictionHandle(Structure):
    pass


class CompliantHandle(Structure):
    pass


ContextPointer = POINTER(ContextHandle)
LoadFrictionPointer = POINTER(LoadFrictionHandle)
CompliantPointer = POINTER(CompliantHandle)
SolverPointer = POINTER(SolverHandle)
SensitivityPointer = POINTER(SensitivityHandle)
ContactSolverPointer = POINTER(ContactSolverHandle)
WorldPointer = POINTER(WorldHandle)

AllocateFunction = CFUNCTYPE(c_void_p, c_size_t, c_void_p)
ReleaseFunction = CFUNCTYPE(None, c_void_p, c_void_p)
LogFunction = CFUNCTYPE(None, c_char_p, c_void_p)


class ContextSettings(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("allocate", AllocateFunction),
        ("release", ReleaseFunction),
        ("allocator_user", c_void_p),
        ("log", LogFunction),
        ("log_user", c_void_p),
    ]


class Matrix(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("storage", c_int32),
        ("rows", c_int32),
        ("columns", c_int32),
        ("reserved", c_int32),
        ("leading_dimension", c_int64),
        ("values", c_void_p),
        ("column_starts", c_void_p),
        ("row_indices", c_void_p),
    ]


class LcpProgress(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("method", c_int32),
        ("reserved", c_int32),
        ("iterations", c_int64),
        ("residual", c_double),
    ]


LcpMonitor = CFUNCTYPE(c_int32, POINTER(LcpProgress), c_void_p)


class LcpSettings(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("method", c_int32),
        ("max_iterations", c_int32),
        ("tol", c_double),
        ("time_limit", c_double),
        ("relaxation", c_double),
        ("pivot_rule", c_int32),
        ("scaling", c_int32),
        ("polish", c_int32),
        ("crash", c_int32),
        ("monitor", LcpMonitor),
        ("monitor_user", c_void_p),
        ("sweep", c_int32),
        ("acceleration", c_int32),
        ("penalty", c_double),
    ]


class LcpResult(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("outcome", c_int32),
        ("method", c_int32),
        ("iterations", c_int64),
        ("residual", c_double),
        ("natural_residual", c_double),
        ("backward_error", c_double),
        ("seconds", c_double),
        ("certificate", c_int32),
        ("has_ray", c_int32),
    ]


class LcpProof(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("verdict", c_int32),
        ("index", c_int32),
        ("radius", c_double),
    ]


class LcpSensitivityInfo(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("verdict", c_int32),
        ("index", c_int32),
        ("active", c_int32),
        ("reserved", c_int32),
        ("margin", c_double),
        ("condition", c_double),
    ]


class LcpFound(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("dimension", c_int32),
        ("vertex_count", c_int32),
        ("ray_count", c_int32),
        ("reserved", c_int32),
        ("residual", c_double),
        ("z", c_void_p),
        ("w", c_void_p),
        ("places", c_void_p),
        ("vertices", c_void_p),
        ("rays", c_void_p),
    ]


LcpVisit = CFUNCTYPE(c_int32, POINTER(LcpFound), c_void_p)


class LcpEnumeration(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("outcome", c_int32),
        ("isolated", c_int32),
        ("families", c_int32),
        ("reserved", c_int32),
        ("nodes", c_int64),
        ("bases", c_int64),
        ("singular", c_int64),
        ("seconds", c_double),
    ]


# the two arrays as addresses: what the callbacks make of them is cheaper than a POINTER
NcpFunction = CFUNCTYPE(c_int32, c_void_p, c_void_p, c_void_p)


class NcpProblem(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("n", c_int32),
        ("storage", c_int32),
        ("column_starts", c_void_p),
        ("row_indices", c_void_p),
        ("function", NcpFunction),
        ("jacobian", NcpFunction),
        ("lower", c_void_p),
        ("upper", c_void_p),
        ("user", c_void_p),
    ]


class NcpProgress(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("method", c_int32),
        ("restarts", c_int32),
        ("iterations", c_int64),
        ("evaluations", c_int64),
        ("residual", c_double),
    ]


NcpMonitor = CFUNCTYPE(c_int32, POINTER(NcpProgress), c_void_p)


class NcpSettings(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("method", c_int32),
        ("max_iterations", c_int32),
        ("tol", c_double),
        ("time_limit", c_double),
        ("penalty", c_double),
        ("restarts", c_int32),
        ("scaling", c_int32),
        ("polish", c_int32),
        ("reserved", c_int32),
        ("monitor", NcpMonitor),
        ("monitor_user", c_void_p),
    ]


class NcpResult(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("outcome", c_int32),
        ("method", c_int32),
        ("iterations", c_int64),
        ("residual", c_double),
        ("natural_residual", c_double),
        ("backward_error", c_double),
        ("seconds", c_double),
        ("function_evaluations", c_int64),
        ("jacobian_evaluations", c_int64),
        ("restarts", c_int32),
        ("trapped", c_int32),
    ]


class NcpCheck(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("wrong", c_int32),
        ("missing", c_int32),
        ("row", c_int32),
        ("column", c_int32),
        ("given", c_double),
        ("difference", c_double),
        ("uncertainty", c_double),
        ("missing_row", c_int32),
        ("missing_column", c_int32),
        ("missing_difference", c_double),
        ("unchecked", c_int32),
        ("reserved", c_int32),
    ]


class ContactLaws(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("contacts", c_int32),
        ("dim", c_int32),
        ("dims", c_void_p),
        ("mu", c_void_p),
        ("rolling", c_void_p),
        ("spinning", c_void_p),
        ("compliance", c_void_p),
        ("bilateral", c_int32),
        ("reserved", c_int32),
    ]


ContactMassSolve = CFUNCTYPE(c_int32, POINTER(c_double), c_int32, c_void_p)


class ContactDynamics(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("n", c_int32),
        ("reserved", c_int32),
        ("M", POINTER(Matrix)),
        ("solve", ContactMassSolve),
        ("user", c_void_p),
        ("H", POINTER(Matrix)),
        ("G", POINTER(Matrix)),
    ]


class ContactProgress(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("method", c_int32),
        ("reserved", c_int32),
        ("iterations", c_int64),
        ("residual", c_double),
    ]


ContactMonitor = CFUNCTYPE(c_int32, POINTER(ContactProgress), c_void_p)


class ContactSettings(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("method", c_int32),
        ("cone", c_int32),
        ("tol", c_double),
        ("max_iterations", c_int32),
        ("reserved", c_int32),
        ("time_limit", c_double),
        ("monitor", ContactMonitor),
        ("monitor_user", c_void_p),
    ]


class ContactResult(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("outcome", c_int32),
        ("method", c_int32),
        ("iterations", c_int64),
        ("residual", c_double),
        ("natural_residual", c_double),
        ("backward_error", c_double),
        ("signorini_velocity", c_double),
        ("signorini_impulse", c_double),
        ("cone", c_double),
        ("dissipation_velocity", c_double),
        ("dissipation_impulse", c_double),
        ("bilateral", c_double),
        ("seconds", c_double),
        ("certificate", c_int32),
        ("has_ray", c_int32),
    ]


class WorldSettings(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("gravity", Vector3),
        ("planar", c_int32),
        ("friction_directions", c_int32),
        ("method", c_int32),
        ("max_iterations", c_int32),
        ("tol", c_double),
        ("time_limit", c_double),
        ("strict", c_int32),
        ("reserved", c_int32),
        ("friction", c_double),
    ]


class BodySettings(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("kind", c_int32),
        ("reserved", c_int32),
        ("mass", c_double),
        ("inertia", Matrix3),
        ("position", Vector3),
        ("orientation", Vector4),
        ("angle", c_double),
        ("velocity", Vector3),
        ("angular_velocity", Vector3),
    ]


class BodyState(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("position", Vector3),
        ("orientation", Vector4),
        ("angle", c_double),
        ("velocity", Vector3),
        ("angular_velocity", Vector3),
        ("force", Vector3),
        ("torque", Vector3),
    ]


class ShapeSettings(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("friction", c_double),
        ("restitution", c_double),
        ("offset", Vector3),
        ("rotation", Vector4),
        ("density", c_double),
    ]


class Contact(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("body_a", c_uint64),
        ("body_b", c_uint64),
        ("shape_a", c_uint64),
        ("shape_b", c_uint64),
        ("position", Vector3),
        ("normal", Vector3),
        ("tangent_1", Vector3),
        ("tangent_2", Vector3),
        ("gap", c_double),
        ("impulse", Vector3),
        ("velocity", Vector3),
        ("friction", c_double),
        ("restitution", c_double),
        ("mode", c_int32),
        ("reserved", c_int32),
    ]


class StepResult(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("outcome", c_int32),
        ("advanced", c_int32),
        ("iterations", c_int64),
        ("residual", c_double),
        ("contacts", c_int32),
        ("islands", c_int32),
    ]


class WorldStats(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("bodies", c_int32),
        ("shapes", c_int32),
        ("islands", c_int32),
        ("contacts", c_int32),
        ("rows_normal", c_int32),
        ("rows_friction", c_int32),
        ("rows_cone", c_int32),
        ("impacts", c_int32),
        ("iterations", c_int64),
        ("steps", c_int64),
        ("residual", c_double),
        ("seconds_collide", c_double),
        ("seconds_solve", c_double),
        ("seconds_integrate", c_double),
        ("seconds_project", c_double),
    ]


class LoadSystem(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("n", c_int32),
        ("reserved", c_int32),
        ("A", c_void_p),
        ("C", c_void_p),
        ("b", c_void_p),
        ("d", c_void_p),
        ("mu", c_void_p),
        ("mu_static", c_void_p),
        ("normal_inertia", c_void_p),
        ("stiffness", c_double),
        ("damping", c_double),
    ]


class LoadSettings(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("tol", c_double),
        ("most_patterns", c_int64),
        ("starts", c_int32),
        ("reserved", c_int32),
    ]


class LoadFound(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("kind", c_int32),
        ("stable", c_int32),
        ("flutter", c_int32),
        ("at_vertex", c_int32),
        ("dimension", c_int32),
        ("vertex_count", c_int32),
        ("ray_count", c_int32),
        ("reserved", c_int32),
        ("residual", c_double),
        ("acceleration", c_void_p),
        ("normal_force", c_void_p),
        ("friction", c_void_p),
        ("modes", c_void_p),
        ("eigenvalues", c_void_p),
        ("vertices", c_void_p),
        ("rays", c_void_p),
    ]


class LoadSummary(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("count", c_int32),
        ("families", c_int32),
        ("stable", c_int32),
        ("exhaustive", c_int32),
        ("patterns", c_int64),
    ]


class LoadUniqueness(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("verdict", c_int32),
        ("exact", c_int32),
        ("margin", c_double),
        ("determinant", c_double),
        ("norm", c_double),
        ("radius", c_double),
    ]


class LoadInverse(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("well_posed", c_int32),
        ("accelerations", c_int32),
        ("exhaustive", c_int32),
        ("stable", c_int32),
        ("flutter", c_int32),
        ("undetermined", c_int32),
        ("reason", c_int32),
        ("reserved", c_int32),
    ]


class LoadStep(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("chosen", c_int32),
        ("answers", c_int32),
        ("exhaustive", c_int32),
        ("stable", c_int32),
        ("stopped", c_int32),
        ("jam", c_int32),
        ("accelerations", c_int32),
        ("reserved", c_int32),
    ]


class CompliantSystem(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("n", c_int32),
        ("contacts", c_int32),
        ("mass", c_void_p),
        ("normal", c_void_p),
        ("tangent", c_void_p),
        ("force", c_void_p),
        ("mu", c_void_p),
        ("stiffness", c_double),
        ("damping", c_double),
    ]


class CompliantSettings(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("tol", c_double),
        ("first_step", c_double),
        ("most_steps", c_int64),
    ]


class CompliantResult(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("end", c_int32),
        ("contact", c_int32),
        ("t", c_double),
        ("next_step", c_double),
        ("least_normal", c_double),
        ("largest_normal", c_double),
        ("steps", c_int64),
        ("rejected", c_int64),
    ]


class CompliantStability(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("stable", c_int32),
        ("flutter", c_int32),
        ("growth", c_double),
    ]


class Bristle(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("kinetic", c_double),
        ("breakaway", c_double),
        ("speed", c_double),
        ("viscosity", c_double),
        ("stiffness", c_double),
        ("damping", c_double),
    ]


# The C name of each struct that crosses the boundary.
STRUCTS = {
    "perp_context_settings": ContextSettings,
    "perp_matrix": Matrix,
    "perp_lcp_progress": LcpProgress,
    "perp_lcp_settings": LcpSettings,
    "perp_lcp_result": LcpResult,
    "perp_lcp_proof": LcpProof,
    "perp_lcp_found": LcpFound,
    "perp_lcp_enumeration": LcpEnumeration,
    "perp_lcp_sensitivity_info": LcpSensitivityInfo,
    "perp_load_system": LoadSystem,
    "perp_load_settings": LoadSettings,
    "perp_load_found": LoadFound,
    "perp_load_summary": LoadSummary,
    "perp_load_uniqueness": LoadUniqueness,
    "perp_load_inverse": LoadInverse,
    "perp_load_step": LoadStep,
    "perp_compliant_system": CompliantSystem,
    "perp_compliant_settings": CompliantSettings,
    "perp_compliant_result": CompliantResult,
    "perp_compliant_stability": CompliantStability,
    "perp_bristle": Bristle,
    "perp_ncp_problem": NcpProblem,
    "perp_ncp_progress": NcpProgress,
    "perp_ncp_settings": NcpSettings,
    "perp_ncp_result": NcpResult,
    "perp_ncp_check": NcpCheck,
    "perp_contact_laws": ContactLaws,
    "perp_contact_dynamics": ContactDynamics,
    "perp_contact_progress": ContactProgress,
    "perp_contact_settings": ContactSettings,
    "perp_contact_result": ContactResult,
    "perp_world_settings": WorldSettings,
    "perp_body_settings": BodySettings,
    "perp_body_state": BodyState,
    "perp_shape_settings": ShapeSettings,
    "perp_contact": Contact,
    "perp_step_result": StepResult,
    "perp_world_stats": WorldStats,
    **MECHANISM_STRUCTS,
}

S = TypeVar("S", bound=Structure)


def sized(struct: type[S]) -> S:
    """Returns a new struct, zero but for struct_size: what every perp_..._init() expects."""
    return struct(struct_size=sizeof(struct))
