"""The structs of include/perp/mechanism.h, field by field, and the types of its callbacks."""

from __future__ import annotations

from ctypes import (
    CFUNCTYPE,
    POINTER,
    Structure,
    c_double,
    c_int32,
    c_int64,
    c_size_t,
    c_void_p,
)


class MechanismHandle(Structure):
    pass


MechanismPointer = POINTER(MechanismHandle)

# arrays as addresses: what the callbacks make of them is cheaper than a POINTER
_array, _user = c_void_p, c_void_p
MechanismMass = CFUNCTYPE(c_int32, _array, _array, _user)
MechanismForce = CFUNCTYPE(c_int32, _array, c_double, _array, _array, _user)
MechanismContacts = CFUNCTYPE(
    c_int32, _array, _array, _array, _array, c_double, _array, _user
)
MechanismBilateral = CFUNCTYPE(c_int32, _array, _array, _array, c_double, _array, _user)
MechanismDry = CFUNCTYPE(c_int32, _array, _array, _array, c_double, _array, _array, _user)
MechanismKinematics = CFUNCTYPE(c_int32, _array, _array, _array, _user)
MechanismNormalise = CFUNCTYPE(c_int32, _array, _user)
MechanismCurvature = CFUNCTYPE(c_int32, _array, c_double, _array, _array, _user)


class MechanismModel(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("velocities", c_int32),
        ("coordinates", c_int32),
        ("contacts", c_int32),
        ("dim", c_int32),
        ("dims", c_void_p),
        ("bilateral", c_int32),
        ("dry", c_int32),
        ("dry_dim", c_int32),
        ("reserved", c_int32),
        ("mu", c_void_p),
        ("mu_static", c_void_p),
        ("stribeck", c_void_p),
        ("restitution", c_void_p),
        ("mass", MechanismMass),
        ("force", MechanismForce),
        ("contact_rows", MechanismContacts),
        ("bilateral_rows", MechanismBilateral),
        ("dry_rows", MechanismDry),
        ("kinematics", MechanismKinematics),
        ("normalise", MechanismNormalise),
        ("curvature", MechanismCurvature),
        ("user", c_void_p),
    ]


class MechanismSettings(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("scheme", c_int32),
        ("law", c_int32),
        ("cone", c_int32),
        ("project", c_int32),
        ("theta", c_double),
        ("tol", c_double),
        ("error", c_double),
        ("shortest", c_double),
        ("longest", c_double),
        ("time_limit", c_double),
        ("most_patterns", c_int64),
        ("directions", c_int32),
        ("starts", c_int32),
        ("stiffness", c_double),
        ("damping", c_double),
        ("select", c_int32),
        ("reserved", c_int32),
    ]


class MechanismStep(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("outcome", c_int32),
        ("scheme", c_int32),
        ("closed", c_int32),
        ("sticking", c_int32),
        ("impacts", c_int32),
        ("certificate", c_int32),
        ("has_ray", c_int32),
        ("method", c_int32),
        ("residual", c_double),
        ("penetration", c_double),
        ("drift", c_double),
        ("error", c_double),
        ("seconds", c_double),
        ("iterations", c_int64),
        ("evaluations", c_int64),
        ("answers", c_int32),
        ("exhaustive", c_int32),
    ]


class MechanismView(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("t", c_double),
        ("h", c_double),
        ("q", c_void_p),
        ("v", c_void_p),
        ("impulse", c_void_p),
        ("velocity", c_void_p),
        ("modes", c_void_p),
        ("step", POINTER(MechanismStep)),
    ]


class MechanismRunResult(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("outcome", c_int32),
        ("fallbacks", c_int32),
        ("t", c_double),
        ("error", c_double),
        ("residual", c_double),
        ("penetration", c_double),
        ("drift", c_double),
        ("seconds", c_double),
        ("steps", c_int64),
        ("rejected", c_int64),
        ("iterations", c_int64),
        ("evaluations", c_int64),
    ]


class MechanismFound(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("stable", c_int32),
        ("flutter", c_int32),
        ("at_vertex", c_int32),
        ("dimension", c_int32),
        ("free", c_int32),
        ("vertex_count", c_int32),
        ("ray_count", c_int32),
        ("reserved", c_int32),
        ("residual", c_double),
        ("acceleration", c_void_p),
        ("force", c_void_p),
        ("row_acceleration", c_void_p),
        ("modes", c_void_p),
        ("eigenvalues", c_void_p),
        ("eigenvalue_count", c_int32),
        ("reserved_too", c_int32),
        ("vertices", c_void_p),
        ("rays", c_void_p),
    ]


class MechanismSummary(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("count", c_int32),
        ("families", c_int32),
        ("stable", c_int32),
        ("exhaustive", c_int32),
        ("closed", c_int32),
        ("impact", c_int32),
        ("reason", c_int32),
        ("contact", c_int32),
        ("inertia", c_double),
        ("patterns", c_int64),
    ]


MechanismObserver = CFUNCTYPE(c_int32, POINTER(MechanismView), c_void_p)

MECHANISM_STRUCTS = {
    "perp_mechanism_model": MechanismModel,
    "perp_mechanism_settings": MechanismSettings,
    "perp_mechanism_step": MechanismStep,
    "perp_mechanism_view": MechanismView,
    "perp_mechanism_run_result": MechanismRunResult,
    "perp_mechanism_found": MechanismFound,
    "perp_mechanism_summary": MechanismSummary,
}
