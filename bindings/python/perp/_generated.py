"""Constants, words, structs, callbacks and functions of include/perp/*.h.

Written by scripts/generate-binding (make binding): change the headers, not this file.
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
)
from typing import Any, Literal

CONSTANTS: dict[str, int] = {
    "PERP_VERSION_MAJOR": 0,
    "PERP_VERSION_MINOR": 1,
    "PERP_VERSION_PATCH": 0,
    "PERP_ABI_VERSION": 0,
    "PERP_MAX_HULL_CORNERS": 128,
    "PERP_OK": 0,
    "PERP_ERROR_ARGUMENT": -1,
    "PERP_ERROR_NOT_FINITE": -2,
    "PERP_ERROR_MEMORY": -3,
    "PERP_ERROR_ABI": -4,
    "PERP_ERROR_HANDLE": -5,
    "PERP_ERROR_BUSY": -6,
    "PERP_ERROR_CALLBACK": -7,
    "PERP_OUTCOME_SOLVED": 0,
    "PERP_OUTCOME_ROUNDING_LIMIT": 1,
    "PERP_OUTCOME_RAY": 2,
    "PERP_OUTCOME_ITERATION_LIMIT": 3,
    "PERP_OUTCOME_TIME_LIMIT": 4,
    "PERP_OUTCOME_STALLED": 5,
    "PERP_OUTCOME_SINGULAR": 6,
    "PERP_OUTCOME_STOPPED": 7,
    "PERP_OUTCOME_EVALUATION_FAILED": 8,
    "PERP_STORAGE_COLUMN_MAJOR": 0,
    "PERP_STORAGE_ROW_MAJOR": 1,
    "PERP_STORAGE_CSC": 2,
    "PERP_LCP_AUTO": 0,
    "PERP_LCP_LEMKE": 1,
    "PERP_LCP_PGS": 2,
    "PERP_LCP_FISCHER": 3,
    "PERP_LCP_POLISH": 4,
    "PERP_LCP_ACTIVE_SET": 5,
    "PERP_LCP_PATTERNS": 6,
    "PERP_LCP_MPRGP": 7,
    "PERP_PIVOT_HARRIS": 0,
    "PERP_PIVOT_LEXICOGRAPHIC": 1,
    "PERP_SWEEP_FORWARD": 0,
    "PERP_SWEEP_SYMMETRIC": 1,
    "PERP_ACCELERATION_NONE": 0,
    "PERP_ACCELERATION_CONJUGATE_GRADIENT": 1,
    "PERP_CERTIFICATE_NONE": 0,
    "PERP_CERTIFICATE_INFEASIBLE": 1,
    "PERP_VERDICT_REGULAR": 0,
    "PERP_VERDICT_NOT_A_SOLUTION": 1,
    "PERP_VERDICT_SINGULAR": 2,
    "PERP_VERDICT_DEGENERATE": 3,
    "PERP_VERDICT_TOO_LARGE": 4,
    "PERP_PLACE_LOWER": 0,
    "PERP_PLACE_UPPER": 1,
    "PERP_PLACE_BETWEEN": 2,
    "PERP_PLACE_FIXED": 3,
    "PERP_CONTACT_SEPARATE": 0,
    "PERP_CONTACT_STICK": 1,
    "PERP_CONTACT_SLIP": 2,
    "PERP_CONTACT_LOWER": 3,
    "PERP_CONTACT_UPPER": 4,
    "PERP_CONTACT_METHOD_AUTO": 0,
    "PERP_CONTACT_METHOD_SWEEP": 1,
    "PERP_CONTACT_METHOD_NEWTON": 2,
    "PERP_CONTACT_METHOD_LEMKE": 3,
    "PERP_CONTACT_METHOD_POLISH": 4,
    "PERP_CONTACT_METHOD_ADMM": 5,
    "PERP_CONTACT_METHOD_PROXIMAL": 6,
    "PERP_CONTACT_CERTIFICATE_NONE": 0,
    "PERP_CONTACT_CERTIFICATE_INFEASIBLE": 1,
    "PERP_CONTACT_WAIT_DONE": 0,
    "PERP_CONTACT_WAIT_OTHER": 1,
    "PERP_CONTACT_WAIT_LOOK": 2,
    "PERP_CONTACT_PHASE_BEGIN": 0,
    "PERP_CONTACT_PHASE_SOLVE": 1,
    "PERP_CONTACT_PHASE_MOVE": 2,
    "PERP_STATICS_STANDS": 0,
    "PERP_STATICS_FALLS": 1,
    "PERP_STATICS_INDETERMINATE": 2,
    "PERP_STATICS_LEAST": 0,
    "PERP_STATICS_INTERIOR": 1,
    "PERP_BODY_DYNAMIC": 0,
    "PERP_BODY_STATIC": 1,
    "PERP_BODY_KINEMATIC": 2,
    "PERP_ACCURACY_FAST": 0,
    "PERP_ACCURACY_STANDARD": 1,
    "PERP_ACCURACY_ACCURATE": 2,
    "PERP_ACCURACY_EXACT": 3,
    "PERP_JOINT_BALL": 0,
    "PERP_JOINT_REVOLUTE": 1,
    "PERP_JOINT_PRISMATIC": 2,
    "PERP_JOINT_FIXED": 3,
    "PERP_JOINT_SCREW": 4,
    "PERP_JOINT_CYLINDRICAL": 5,
    "PERP_JOINT_PLANAR": 6,
    "PERP_JOINT_DISTANCE": 7,
    "PERP_NCP_AUTO": 0,
    "PERP_NCP_FISCHER": 1,
    "PERP_NCP_JOSEPHY": 2,
    "PERP_LOAD_DYNAMIC": 0,
    "PERP_LOAD_STATIC": 1,
    "PERP_LOAD_MIXED": 2,
    "PERP_LOAD_FAMILY": 3,
    "PERP_LOAD_SLIDE": 0,
    "PERP_LOAD_STICK": 1,
    "PERP_LOAD_FORWARD": 2,
    "PERP_LOAD_BACKWARD": 3,
    "PERP_LOAD_STOPPED": 4,
    "PERP_LOAD_UNIQUE": 0,
    "PERP_LOAD_NOT_UNIQUE": 1,
    "PERP_LOAD_UNDECIDED": 2,
    "PERP_LOAD_WELL_POSED": 0,
    "PERP_LOAD_IN_FAMILY": 1,
    "PERP_LOAD_UNSTABLE": 2,
    "PERP_LOAD_FLUTTERS": 3,
    "PERP_LOAD_SEVERAL": 4,
    "PERP_LOAD_AT_REST": 5,
    "PERP_LOAD_NOT_ENUMERATED": 6,
    "PERP_COMPLIANT_TIME": 0,
    "PERP_COMPLIANT_STOPPED": 1,
    "PERP_COMPLIANT_STEPS": 2,
    "PERP_COMPLIANT_FAILED": 3,
    "PERP_COMPLIANT_RELEASED": 4,
    "PERP_COMPLIANT_TOUCHED": 5,
    "PERP_MECHANISM_FROZEN": 0,
    "PERP_MECHANISM_IMPLICIT": 1,
    "PERP_MECHANISM_THETA": 2,
    "PERP_MECHANISM_MOREAU": 0,
    "PERP_MECHANISM_NEWTON": 1,
    "PERP_MECHANISM_POISSON": 2,
    "PERP_MECHANISM_STRONGE": 3,
    "PERP_MECHANISM_SEPARATE": 0,
    "PERP_MECHANISM_STICK": 1,
    "PERP_MECHANISM_SLIP": 2,
    "PERP_MECHANISM_ANY": 0,
    "PERP_MECHANISM_NEAREST": 1,
    "PERP_MECHANISM_FREEST": 2,
    "PERP_MECHANISM_ALWAYS_ONE": 0,
    "PERP_MECHANISM_NEGATIVE_INERTIA": 1,
    "PERP_MECHANISM_ZERO_INERTIA": 2,
    "PERP_MECHANISM_COUPLED": 3,
    "PERP_MECHANISM_REDUNDANT": 4,
    "PERP_MECHANISM_UNDECIDED": 5,
    "PERP_MECHANISM_STATIC_FRICTION": 6,
    "PERP_MECHANISM_NORMAL": 0,
    "PERP_MECHANISM_GRADIENT": 1,
    "PERP_MECHANISM_DRIFT": 2,
    "PERP_MECHANISM_TANGENT": 3,
}

# The words of settings and answers.
LcpMethod = Literal["auto", "lemke", "pgs", "fischer", "active_set"]
NcpMethod = Literal["auto", "fischer", "josephy"]
ContactMethod = Literal["auto", "sweep", "newton", "lemke", "admm", "proximal"]
PivotRule = Literal["harris", "lexicographic"]
Sweep = Literal["forward", "symmetric"]
AccelerationMethod = Literal["none", "conjugate_gradient"]
Accuracy = Literal["fast", "standard", "accurate", "exact"]
Scheme = Literal["frozen", "implicit", "theta"]
Selection = Literal["any", "nearest", "freest"]
ImpactLaw = Literal["moreau", "newton", "poisson", "stronge"]
BodyKind = Literal["dynamic", "static", "kinematic"]
JointKind = Literal[
    "ball", "revolute", "prismatic", "fixed", "screw", "cylindrical", "planar", "distance"
]
StaticsObjective = Literal["least", "interior"]
StaticsVerdict = Literal["stands", "falls", "indeterminate"]
Outcome = Literal[
    "solved", "rounding_limit", "ray", "iteration_limit", "time_limit", "stalled", "singular",
    "stopped", "evaluation_failed"
]


class ContextHandle(Structure):
    pass


ContextPointer = POINTER(ContextHandle)


AllocateFunction = CFUNCTYPE(c_void_p, c_size_t, c_void_p)


ReleaseFunction = CFUNCTYPE(None, c_void_p, c_void_p)


LogFunction = CFUNCTYPE(None, c_char_p, c_void_p)


Task = CFUNCTYPE(None, c_int32, c_void_p)


RunTasks = CFUNCTYPE(None, Task, c_void_p, c_int32, c_void_p)


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


LcpProduct = CFUNCTYPE(c_int32, c_void_p, c_void_p, c_void_p)


class LcpProblem(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("M", POINTER(Matrix)),
        ("q", c_void_p),
        ("lower", c_void_p),
        ("upper", c_void_p),
        ("product", LcpProduct),
        ("user", c_void_p),
        ("diagonal", c_void_p),
        ("n", c_int32),
        ("reserved", c_int32),
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


class LcpSolverHandle(Structure):
    pass


LcpSolverPointer = POINTER(LcpSolverHandle)


class LcpProof(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("verdict", c_int32),
        ("index", c_int32),
        ("radius", c_double),
    ]


class LcpSensitivityHandle(Structure):
    pass


LcpSensitivityPointer = POINTER(LcpSensitivityHandle)


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


class LcpStack(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("count", c_int64),
        ("n", c_int32),
        ("reserved", c_int32),
        ("M", c_void_p),
        ("q", c_void_p),
        ("lower", c_void_p),
        ("upper", c_void_p),
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
        ("bounded", c_int32),
        ("lower", c_void_p),
        ("upper", c_void_p),
        ("two_sided", c_void_p),
    ]


ContactMassSolve = CFUNCTYPE(c_int32, c_void_p, c_int32, c_void_p)


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


class ContactProblem(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("laws", POINTER(ContactLaws)),
        ("dynamics", POINTER(ContactDynamics)),
        ("f", c_void_p),
        ("w", c_void_p),
        ("b", c_void_p),
        ("W", POINTER(Matrix)),
        ("q", c_void_p),
    ]


class ContactAnswer(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("v", c_void_p),
        ("r", c_void_p),
        ("u", c_void_p),
        ("modes", c_void_p),
        ("ray", c_void_p),
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
        ("raw_velocity", c_int32),
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


class ContactSolverHandle(Structure):
    pass


ContactSolverPointer = POINTER(ContactSolverHandle)


class ContactWatch(Structure):
    _fields_ = [
        ("at", c_void_p),
        ("seen", c_void_p),
        ("count", c_int32),
        ("offset", c_int32),
        ("stride", c_int32),
        ("bytes", c_int32),
    ]


class ContactSource(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("counts", c_void_p),
        ("contacts", c_void_p),
        ("stride", c_int32),
        ("geoms_at", c_int32),
        ("row_at", c_int32),
        ("dim_at", c_int32),
        ("friction_at", c_int32),
        ("surface_at", c_int32),
        ("kinds", c_void_p),
        ("ids", c_void_p),
        ("bounds", c_void_p),
    ]


class ContactStep(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("n", c_int32),
        ("contacts", c_int32),
        ("rows", c_int32),
        ("bilateral", c_int32),
        ("M_entries", c_int32),
        ("H_entries", c_int32),
        ("G_entries", c_int32),
        ("gap_count", c_int32),
        ("J_rows", c_int32),
        ("warm", c_int32),
        ("rests", c_int32),
        ("h", c_double),
        ("correction", c_double),
        ("mass", c_void_p),
        ("damping", c_void_p),
        ("velocity", c_void_p),
        ("force", c_void_p),
        ("J", c_void_p),
        ("gaps", c_void_p),
        ("row_force", c_void_p),
        ("mass_sources", c_void_p),
        ("mass_diagonal", c_void_p),
        ("H_sources", c_void_p),
        ("G_sources", c_void_p),
        ("H_scale", c_void_p),
        ("gap_rows", c_void_p),
        ("gap_sources", c_void_p),
        ("H_rows", c_void_p),
        ("G_rows", c_void_p),
        ("row_scale", c_void_p),
        ("M", c_void_p),
        ("H", c_void_p),
        ("G", c_void_p),
        ("f", c_void_p),
        ("w", c_void_p),
        ("b", c_void_p),
        ("v", c_void_p),
        ("r", c_void_p),
        ("u", c_void_p),
        ("start", c_void_p),
        ("modes", c_void_p),
        ("watches", POINTER(ContactWatch)),
        ("watch_count", c_int32),
        ("is_other", c_int32),
        ("acceleration", c_void_p),
        ("force_of_rows", c_void_p),
        ("least_gap", c_double),
        ("fastest", c_double),
        ("slips", c_int32),
        ("was_known", c_int32),
        ("by_rows", c_int32),
        ("shifts", c_int32),
        ("slop", c_double),
        ("driven", c_double),
        ("shift", c_void_p),
        ("source", POINTER(ContactSource)),
        ("first", c_void_p),
        ("restitution", c_double),
        ("speeds", c_void_p),
        ("reach", c_void_p),
        ("shares", c_void_p),
    ]


ContactStage = CFUNCTYPE(None, c_void_p, c_void_p)


ContactInvert = CFUNCTYPE(None, c_void_p, c_void_p, c_void_p, c_void_p, c_int32)


ContactIntegrate = CFUNCTYPE(None, c_void_p, c_void_p, c_void_p, c_double)


class ContactCopy(Structure):
    _fields_ = [
        ("to", c_void_p),
        ("source", c_void_p),
        ("count", c_int32),
        ("stride", c_int32),
    ]


class ContactRun(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("model", c_void_p),
        ("data", c_void_p),
        ("before", POINTER(ContactStage)),
        ("after", POINTER(ContactStage)),
        ("advance", POINTER(ContactStage)),
        ("before_count", c_int32),
        ("after_count", c_int32),
        ("advance_count", c_int32),
        ("places", c_int32),
        ("metric", ContactStage),
        ("metric_M", c_void_p),
        ("metric_D", c_void_p),
        ("metric_mass", c_void_p),
        ("metric_places", c_void_p),
        ("metric_count", c_int32),
        ("kept_count", c_int32),
        ("kept", POINTER(ContactCopy)),
        ("place", c_void_p),
        ("velocity", c_void_p),
        ("time", c_void_p),
        ("room", c_void_p),
        ("integrate", ContactIntegrate),
        ("inputs", POINTER(ContactCopy)),
        ("outputs", POINTER(ContactCopy)),
        ("input_count", c_int32),
        ("output_count", c_int32),
        ("steps", c_int32),
        ("done", c_int32),
        ("phase", c_int32),
        ("wait", c_int32),
        ("patience", c_int32),
        ("look_slip", c_double),
        ("look_rest", c_double),
        ("drive", c_void_p),
        ("unsolved", c_int64),
        ("residual", c_double),
        ("invert", ContactInvert),
        ("again", POINTER(ContactStage)),
        ("again_count", c_int32),
        ("reserved", c_int32),
    ]


class ContactSensitivityHandle(Structure):
    pass


ContactSensitivityPointer = POINTER(ContactSensitivityHandle)


class ContactSensitivityInfo(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("verdict", c_int32),
        ("index", c_int32),
        ("active", c_int32),
        ("reserved", c_int32),
        ("margin", c_double),
        ("condition", c_double),
    ]


class ContactChange(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("df", c_void_p),
        ("dw", c_void_p),
        ("db", c_void_p),
        ("dmu", c_void_p),
        ("dM", POINTER(Matrix)),
        ("dH", POINTER(Matrix)),
        ("dG", POINTER(Matrix)),
    ]


class StaticsSettings(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("objective", c_int32),
        ("max_iterations", c_int32),
    ]


class StaticsResult(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("verdict", c_int32),
        ("iterations", c_int32),
        ("margin", c_double),
        ("safety", c_double),
        ("unbalance", c_double),
        ("work", c_double),
        ("seconds", c_double),
    ]


class StaticsProblem(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("n", c_int32),
        ("reserved", c_int32),
        ("laws", POINTER(ContactLaws)),
        ("H", POINTER(Matrix)),
        ("G", POINTER(Matrix)),
        ("f", c_void_p),
        ("load", c_void_p),
        ("r0", c_void_p),
    ]


class WorldHandle(Structure):
    pass


WorldPointer = POINTER(WorldHandle)


class WorldSettings(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("gravity", c_double * 3),
        ("planar", c_int32),
        ("accuracy", c_int32),
        ("cone", c_int32),
        ("method", c_int32),
        ("substeps", c_int32),
        ("max_iterations", c_int32),
        ("strict", c_int32),
        ("wakeful", c_int32),
        ("tol", c_double),
        ("time_limit", c_double),
        ("friction", c_double),
        ("error", c_double),
        ("threads", c_int32),
        ("reserved", c_int32),
        ("run_tasks", RunTasks),
        ("tasks_user", c_void_p),
    ]


class BodySettings(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("kind", c_int32),
        ("reserved", c_int32),
        ("mass", c_double),
        ("inertia", c_double * 9),
        ("position", c_double * 3),
        ("orientation", c_double * 4),
        ("angle", c_double),
        ("velocity", c_double * 3),
        ("angular_velocity", c_double * 3),
    ]


class BodyState(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("position", c_double * 3),
        ("orientation", c_double * 4),
        ("angle", c_double),
        ("velocity", c_double * 3),
        ("angular_velocity", c_double * 3),
        ("force", c_double * 3),
        ("torque", c_double * 3),
    ]


class ShapeSettings(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("friction", c_double),
        ("restitution", c_double),
        ("offset", c_double * 3),
        ("rotation", c_double * 4),
        ("density", c_double),
    ]


class WorldContact(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("body_a", c_uint64),
        ("body_b", c_uint64),
        ("shape_a", c_uint64),
        ("shape_b", c_uint64),
        ("position", c_double * 3),
        ("normal", c_double * 3),
        ("tangent_1", c_double * 3),
        ("tangent_2", c_double * 3),
        ("gap", c_double),
        ("impulse", c_double * 3),
        ("velocity", c_double * 3),
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
        ("steps", c_int32),
        ("reserved", c_int32),
        ("error", c_double),
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
        ("impacts", c_int32),
        ("iterations", c_int64),
        ("steps", c_int64),
        ("residual", c_double),
        ("seconds_collide", c_double),
        ("seconds_solve", c_double),
        ("seconds_integrate", c_double),
        ("seconds_project", c_double),
        ("joints", c_int32),
        ("rows_joint", c_int32),
    ]


class WorldStates(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("slots", c_int32),
        ("reserved", c_int32),
        ("pose_stride", c_size_t),
        ("twist_stride", c_size_t),
        ("position", c_void_p),
        ("orientation", c_void_p),
        ("angle", c_void_p),
        ("velocity", c_void_p),
        ("angular_velocity", c_void_p),
    ]


class WorldLoad(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("body", c_uint64),
        ("force", c_double * 3),
        ("torque", c_double * 3),
    ]


class JointSettings(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("kind", c_int32),
        ("collides", c_int32),
        ("anchor", c_double * 3),
        ("anchor_b", c_double * 3),
        ("axis", c_double * 3),
        ("pitch", c_double),
        ("lower", c_double),
        ("upper", c_double),
        ("motor_speed", c_double),
        ("motor_force", c_double),
        ("friction", c_double),
    ]


class JointState(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("position", c_double),
        ("speed", c_double),
        ("anchor", c_double * 3),
        ("impulse", c_double * 3),
        ("moment", c_double * 3),
        ("motor_impulse", c_double),
        ("friction_impulse", c_double),
        ("limit_impulse", c_double),
        ("at_limit", c_int32),
        ("reserved", c_int32),
        ("lower", c_double),
        ("upper", c_double),
        ("motor_speed", c_double),
        ("motor_force", c_double),
        ("friction", c_double),
    ]


NcpFunction = CFUNCTYPE(c_int32, c_void_p, c_void_p, c_void_p)


NcpJacobian = CFUNCTYPE(c_int32, c_void_p, c_void_p, c_void_p)


class NcpProblem(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("n", c_int32),
        ("storage", c_int32),
        ("column_starts", c_void_p),
        ("row_indices", c_void_p),
        ("function", NcpFunction),
        ("jacobian", NcpJacobian),
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


class NcpSolverHandle(Structure):
    pass


NcpSolverPointer = POINTER(NcpSolverHandle)


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


class LoadSystem(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("n", c_int32),
        ("reserved", c_int32),
        ("A", POINTER(Matrix)),
        ("C", POINTER(Matrix)),
        ("b", c_void_p),
        ("d", c_void_p),
        ("mu", c_void_p),
        ("mu_static", c_void_p),
        ("normal_inertia", POINTER(Matrix)),
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
        ("mass", POINTER(Matrix)),
        ("normal", POINTER(Matrix)),
        ("tangent", POINTER(Matrix)),
        ("force", c_void_p),
        ("mu", c_void_p),
        ("stiffness", c_double),
        ("damping", c_double),
        ("mu_static", c_void_p),
        ("one_sided", c_void_p),
    ]


class CompliantSettings(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("tol", c_double),
        ("first_step", c_double),
        ("most_steps", c_int64),
        ("through", c_int32),
        ("resume", c_int32),
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
        ("stops", c_int32),
        ("reversals", c_int32),
        ("starts", c_int32),
        ("releases", c_int32),
        ("friction", c_void_p),
        ("modes", c_void_p),
    ]


class CompliantStability(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("stable", c_int32),
        ("flutter", c_int32),
        ("growth", c_double),
    ]


class CompliantHandle(Structure):
    pass


CompliantPointer = POINTER(CompliantHandle)


class LoadFrictionHandle(Structure):
    pass


LoadFrictionPointer = POINTER(LoadFrictionHandle)


MechanismMass = CFUNCTYPE(c_int32, c_void_p, c_void_p, c_void_p)


MechanismForce = CFUNCTYPE(c_int32, c_void_p, c_double, c_void_p, c_void_p, c_void_p)


MechanismContacts = CFUNCTYPE(
    c_int32, c_void_p, c_void_p, c_void_p, c_void_p, c_double, c_void_p, c_void_p
)


MechanismBilateral = CFUNCTYPE(c_int32, c_void_p, c_void_p, c_void_p, c_double, c_void_p, c_void_p)


MechanismDry = CFUNCTYPE(
    c_int32, c_void_p, c_void_p, c_void_p, c_double, c_void_p, c_void_p, c_void_p
)


MechanismKinematics = CFUNCTYPE(c_int32, c_void_p, c_void_p, c_void_p, c_void_p)


MechanismNormalise = CFUNCTYPE(c_int32, c_void_p, c_void_p)


MechanismCurvature = CFUNCTYPE(c_int32, c_void_p, c_double, c_void_p, c_void_p, c_void_p)


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
        ("two_sided", c_void_p),
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
        ("overlap", c_double),
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


class MechanismStart(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("t", c_double),
        ("h", c_double),
        ("q", c_void_p),
        ("v", c_void_p),
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


MechanismObserver = CFUNCTYPE(c_int32, POINTER(MechanismView), c_void_p)


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


class MechanismCheckResult(Structure):
    _fields_ = [
        ("struct_size", c_size_t),
        ("wrong", c_int32),
        ("constant", c_int32),
        ("unchecked", c_int32),
        ("part", c_int32),
        ("index", c_int32),
        ("row", c_int32),
        ("column", c_int32),
        ("reserved", c_int32),
        ("given", c_double),
        ("difference", c_double),
        ("uncertainty", c_double),
    ]


class MechanismHandle(Structure):
    pass


MechanismPointer = POINTER(MechanismHandle)

# The C name of each struct that crosses the boundary.
STRUCTS: dict[str, type[Structure]] = {
    "perp_context_settings": ContextSettings,
    "perp_matrix": Matrix,
    "perp_lcp_problem": LcpProblem,
    "perp_lcp_progress": LcpProgress,
    "perp_lcp_settings": LcpSettings,
    "perp_lcp_result": LcpResult,
    "perp_lcp_proof": LcpProof,
    "perp_lcp_sensitivity_info": LcpSensitivityInfo,
    "perp_lcp_found": LcpFound,
    "perp_lcp_enumeration": LcpEnumeration,
    "perp_lcp_stack": LcpStack,
    "perp_contact_laws": ContactLaws,
    "perp_contact_dynamics": ContactDynamics,
    "perp_contact_problem": ContactProblem,
    "perp_contact_answer": ContactAnswer,
    "perp_contact_progress": ContactProgress,
    "perp_contact_settings": ContactSettings,
    "perp_contact_result": ContactResult,
    "perp_contact_watch": ContactWatch,
    "perp_contact_source": ContactSource,
    "perp_contact_step": ContactStep,
    "perp_contact_copy": ContactCopy,
    "perp_contact_run": ContactRun,
    "perp_contact_sensitivity_info": ContactSensitivityInfo,
    "perp_contact_change": ContactChange,
    "perp_statics_settings": StaticsSettings,
    "perp_statics_result": StaticsResult,
    "perp_statics_problem": StaticsProblem,
    "perp_world_settings": WorldSettings,
    "perp_body_settings": BodySettings,
    "perp_body_state": BodyState,
    "perp_shape_settings": ShapeSettings,
    "perp_world_contact": WorldContact,
    "perp_step_result": StepResult,
    "perp_world_stats": WorldStats,
    "perp_world_states": WorldStates,
    "perp_world_load": WorldLoad,
    "perp_joint_settings": JointSettings,
    "perp_joint_state": JointState,
    "perp_ncp_problem": NcpProblem,
    "perp_ncp_progress": NcpProgress,
    "perp_ncp_settings": NcpSettings,
    "perp_ncp_result": NcpResult,
    "perp_ncp_check": NcpCheck,
    "perp_bristle": Bristle,
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
    "perp_mechanism_model": MechanismModel,
    "perp_mechanism_settings": MechanismSettings,
    "perp_mechanism_step": MechanismStep,
    "perp_mechanism_start": MechanismStart,
    "perp_mechanism_view": MechanismView,
    "perp_mechanism_run_result": MechanismRunResult,
    "perp_mechanism_found": MechanismFound,
    "perp_mechanism_summary": MechanismSummary,
    "perp_mechanism_check_result": MechanismCheckResult,
}

# What each function of libperp returns and takes.
FUNCTIONS: dict[str, tuple[Any, list[Any]]] = {
    "perp_status_text": (c_char_p, [c_int32]),
    "perp_outcome_text": (c_char_p, [c_int32]),
    "perp_version": (c_int32, []),
    "perp_abi_version": (c_int32, []),
    "perp_version_text": (c_char_p, []),
    "perp_struct_init": (c_int32, [c_void_p, c_size_t]),
    "perp_context_create": (c_int32, [POINTER(ContextPointer), POINTER(ContextSettings)]),
    "perp_context_destroy": (None, [ContextPointer]),
    "perp_context_message": (c_char_p, [ContextPointer]),
    "perp_matrix_dense": (c_int32, [POINTER(Matrix), c_int32, c_int32, c_int32, c_void_p, c_int64]),
    "perp_matrix_csc": (c_int32, [POINTER(Matrix), c_int32, c_int32, c_void_p, c_void_p, c_void_p]),
    "perp_lcp_settings_init": (c_int32, [POINTER(LcpSettings), c_size_t]),
    "perp_lcp_method_text": (c_char_p, [c_int32]),
    "perp_lcp_solver_create": (c_int32, [
        ContextPointer, POINTER(LcpSolverPointer), POINTER(LcpSettings)
    ]),
    "perp_lcp_solver_destroy": (None, [LcpSolverPointer]),
    "perp_lcp_solver_set": (c_int32, [LcpSolverPointer, POINTER(LcpSettings)]),
    "perp_lcp_solver_setup": (c_int32, [LcpSolverPointer, POINTER(Matrix), c_void_p, c_void_p]),
    "perp_lcp_solver_solve": (c_int32, [
        LcpSolverPointer, c_void_p, c_void_p, c_void_p, POINTER(LcpResult), c_void_p, c_void_p
    ]),
    "perp_lcp_solve": (c_int32, [
        ContextPointer, c_void_p, c_void_p, c_void_p, POINTER(LcpResult), POINTER(LcpSettings),
        POINTER(LcpProblem), c_void_p
    ]),
    "perp_lcp_verdict_text": (c_char_p, [c_int32]),
    "perp_lcp_verify": (c_int32, [
        ContextPointer, c_void_p, POINTER(LcpProof), POINTER(LcpProblem), c_void_p
    ]),
    "perp_lcp_sensitivity_create": (c_int32, [
        ContextPointer, POINTER(LcpSensitivityPointer), POINTER(LcpSensitivityInfo),
        POINTER(LcpSettings), POINTER(LcpProblem), c_void_p
    ]),
    "perp_lcp_sensitivity_destroy": (None, [LcpSensitivityPointer]),
    "perp_lcp_sensitivity_places": (c_int32, [LcpSensitivityPointer, c_void_p]),
    "perp_lcp_sensitivity_forward": (c_int32, [
        LcpSensitivityPointer, c_void_p, c_void_p, POINTER(Matrix), c_void_p, c_void_p
    ]),
    "perp_lcp_sensitivity_adjoint": (c_int32, [
        LcpSensitivityPointer, c_void_p, c_void_p, c_void_p, c_void_p
    ]),
    "perp_lcp_all": (c_int32, [
        ContextPointer, POINTER(LcpEnumeration), POINTER(LcpSettings), POINTER(LcpProblem),
        LcpVisit, c_void_p
    ]),
    "perp_lcp_batch": (c_int32, [
        ContextPointer, c_void_p, c_void_p, c_void_p, c_void_p, POINTER(LcpSettings), c_int32,
        POINTER(LcpStack)
    ]),
    "perp_contact_laws_init": (c_int32, [POINTER(ContactLaws), c_size_t]),
    "perp_contact_settings_init": (c_int32, [POINTER(ContactSettings), c_size_t]),
    "perp_contact_mode_text": (c_char_p, [c_int32]),
    "perp_contact_method_text": (c_char_p, [c_int32]),
    "perp_contact_solver_create": (c_int32, [
        ContextPointer, POINTER(ContactSolverPointer), POINTER(ContactSettings)
    ]),
    "perp_contact_solver_destroy": (None, [ContactSolverPointer]),
    "perp_contact_solver_set": (c_int32, [ContactSolverPointer, POINTER(ContactSettings)]),
    "perp_contact_solver_setup_dynamics": (c_int32, [
        ContactSolverPointer, POINTER(ContactLaws), POINTER(ContactDynamics)
    ]),
    "perp_contact_solver_setup_delassus": (c_int32, [
        ContactSolverPointer, POINTER(ContactLaws), POINTER(Matrix)
    ]),
    "perp_contact_solver_solve_dynamics": (c_int32, [
        ContactSolverPointer, POINTER(ContactAnswer), POINTER(ContactResult), c_void_p, c_void_p,
        c_void_p, c_void_p
    ]),
    "perp_contact_solver_solve_delassus": (c_int32, [
        ContactSolverPointer, POINTER(ContactAnswer), POINTER(ContactResult), c_void_p, c_void_p
    ]),
    "perp_contact_solve": (c_int32, [
        ContextPointer, POINTER(ContactAnswer), POINTER(ContactResult), POINTER(ContactSettings),
        POINTER(ContactProblem), c_void_p
    ]),
    "perp_contact_solver_arrange": (c_int32, [
        ContactSolverPointer, POINTER(ContactStep), POINTER(ContactLaws), POINTER(ContactDynamics)
    ]),
    "perp_contact_solver_step": (c_int32, [
        ContactSolverPointer, POINTER(ContactStep), POINTER(ContactResult), POINTER(ContactLaws),
        POINTER(ContactDynamics)
    ]),
    "perp_contact_solver_hand_back": (c_int32, [ContactSolverPointer, POINTER(ContactStep)]),
    "perp_contact_solver_run": (c_int32, [
        ContactSolverPointer, POINTER(ContactRun), POINTER(ContactStep), POINTER(ContactResult),
        POINTER(ContactLaws), POINTER(ContactDynamics)
    ]),
    "perp_contact_sensitivity_create": (c_int32, [
        ContextPointer, POINTER(ContactSensitivityPointer), POINTER(ContactSensitivityInfo),
        POINTER(ContactSettings), POINTER(ContactProblem), c_void_p
    ]),
    "perp_contact_sensitivity_destroy": (None, [ContactSensitivityPointer]),
    "perp_contact_sensitivity_point": (c_int32, [
        ContactSensitivityPointer, c_void_p, c_void_p, c_void_p, c_void_p
    ]),
    "perp_contact_sensitivity_forward": (c_int32, [
        ContactSensitivityPointer, c_void_p, c_void_p, POINTER(ContactChange)
    ]),
    "perp_contact_sensitivity_adjoint": (c_int32, [
        ContactSensitivityPointer, c_void_p, c_void_p, c_void_p, c_void_p, c_void_p, c_void_p
    ]),
    "perp_statics_verdict_text": (c_char_p, [c_int32]),
    "perp_contact_statics": (c_int32, [
        ContextPointer, c_void_p, c_void_p, POINTER(StaticsResult), POINTER(StaticsProblem),
        POINTER(StaticsSettings)
    ]),
    "perp_world_settings_init": (c_int32, [POINTER(WorldSettings), c_size_t, c_int32]),
    "perp_body_settings_init": (c_int32, [POINTER(BodySettings), c_size_t]),
    "perp_body_state_init": (c_int32, [POINTER(BodyState), c_size_t]),
    "perp_shape_settings_init": (c_int32, [POINTER(ShapeSettings), c_size_t]),
    "perp_world_create": (c_int32, [ContextPointer, POINTER(WorldPointer), POINTER(WorldSettings)]),
    "perp_world_destroy": (None, [WorldPointer]),
    "perp_world_ground": (c_uint64, [WorldPointer]),
    "perp_world_add_body": (c_int32, [WorldPointer, c_void_p, POINTER(BodySettings)]),
    "perp_world_remove_body": (c_int32, [WorldPointer, c_uint64]),
    "perp_world_get_body": (c_int32, [WorldPointer, POINTER(BodyState), c_uint64]),
    "perp_world_set_body": (c_int32, [WorldPointer, POINTER(BodyState), c_uint64]),
    "perp_world_get_mass": (c_int32, [WorldPointer, c_void_p, c_void_p, c_uint64]),
    "perp_world_get_states": (c_int32, [WorldPointer, POINTER(WorldStates)]),
    "perp_world_body_slot": (c_int32, [WorldPointer, c_void_p, c_uint64]),
    "perp_world_add_sphere": (c_int32, [
        WorldPointer, c_void_p, c_uint64, c_double, POINTER(ShapeSettings)
    ]),
    "perp_world_add_box": (c_int32, [
        WorldPointer, c_void_p, c_uint64, c_void_p, POINTER(ShapeSettings)
    ]),
    "perp_world_add_capsule": (c_int32, [
        WorldPointer, c_void_p, c_uint64, c_double, c_double, POINTER(ShapeSettings)
    ]),
    "perp_world_add_hull": (c_int32, [
        WorldPointer, c_void_p, c_uint64, c_void_p, c_int32, POINTER(ShapeSettings)
    ]),
    "perp_world_add_plane": (c_int32, [
        WorldPointer, c_void_p, c_uint64, c_void_p, c_double, POINTER(ShapeSettings)
    ]),
    "perp_world_step": (c_int32, [WorldPointer, POINTER(StepResult), c_double]),
    "perp_world_set_gravity": (c_int32, [WorldPointer, c_void_p]),
    "perp_world_contact_count": (c_int32, [WorldPointer]),
    "perp_world_get_contact": (c_int32, [WorldPointer, POINTER(WorldContact), c_int32]),
    "perp_world_statics": (c_int32, [
        WorldPointer, POINTER(WorldContact), c_int32, c_void_p, c_void_p, POINTER(StaticsResult),
        POINTER(StaticsSettings), POINTER(WorldLoad), c_int32
    ]),
    "perp_world_energy": (c_int32, [WorldPointer, c_void_p, c_void_p]),
    "perp_world_momentum": (c_int32, [WorldPointer, c_void_p, c_void_p]),
    "perp_world_get_stats": (c_int32, [WorldPointer, POINTER(WorldStats)]),
    "perp_world_snapshot_size": (c_int32, [WorldPointer, c_void_p]),
    "perp_world_snapshot_save": (c_int32, [WorldPointer, c_void_p, c_size_t]),
    "perp_world_snapshot_restore": (c_int32, [WorldPointer, c_void_p, c_size_t]),
    "perp_joint_settings_init": (c_int32, [POINTER(JointSettings), c_size_t]),
    "perp_world_add_joint": (c_int32, [
        WorldPointer, c_void_p, c_uint64, c_uint64, POINTER(JointSettings)
    ]),
    "perp_world_remove_joint": (c_int32, [WorldPointer, c_uint64]),
    "perp_world_get_joint": (c_int32, [WorldPointer, POINTER(JointState), c_uint64]),
    "perp_world_set_joint_limits": (c_int32, [WorldPointer, c_uint64, c_double, c_double]),
    "perp_world_set_joint_motor": (c_int32, [WorldPointer, c_uint64, c_double, c_double]),
    "perp_world_set_joint_friction": (c_int32, [WorldPointer, c_uint64, c_double]),
    "perp_ncp_settings_init": (c_int32, [POINTER(NcpSettings), c_size_t]),
    "perp_ncp_method_text": (c_char_p, [c_int32]),
    "perp_ncp_solver_create": (c_int32, [
        ContextPointer, POINTER(NcpSolverPointer), POINTER(NcpSettings)
    ]),
    "perp_ncp_solver_destroy": (None, [NcpSolverPointer]),
    "perp_ncp_solver_set": (c_int32, [NcpSolverPointer, POINTER(NcpSettings)]),
    "perp_ncp_solver_setup": (c_int32, [NcpSolverPointer, POINTER(NcpProblem)]),
    "perp_ncp_solver_solve": (c_int32, [
        NcpSolverPointer, c_void_p, c_void_p, POINTER(NcpResult), c_void_p
    ]),
    "perp_ncp_solve": (c_int32, [
        ContextPointer, c_void_p, c_void_p, POINTER(NcpResult), POINTER(NcpSettings),
        POINTER(NcpProblem), c_void_p
    ]),
    "perp_ncp_check_jacobian": (c_int32, [
        ContextPointer, POINTER(NcpCheck), POINTER(NcpProblem), c_void_p
    ]),
}

# The same of libperp-mechanism.
MECHANISM_FUNCTIONS: dict[str, tuple[Any, list[Any]]] = {
    "perp_stribeck_force": (c_int32, [
        ContextPointer, c_void_p, c_void_p, POINTER(Bristle), c_double
    ]),
    "perp_lugre_force": (c_int32, [
        ContextPointer, c_void_p, c_void_p, POINTER(Bristle), c_double, c_double
    ]),
    "perp_lugre_step": (c_int32, [
        ContextPointer, c_void_p, c_void_p, c_void_p, POINTER(Bristle), c_double, c_double, c_double
    ]),
    "perp_lugre_passive": (c_int32, [ContextPointer, c_void_p, POINTER(Bristle)]),
    "perp_load_system_init": (c_int32, [POINTER(LoadSystem), c_size_t]),
    "perp_load_settings_init": (c_int32, [POINTER(LoadSettings), c_size_t]),
    "perp_compliant_settings_init": (c_int32, [POINTER(CompliantSettings), c_size_t]),
    "perp_load_kind_text": (c_char_p, [c_int32]),
    "perp_load_mode_text": (c_char_p, [c_int32]),
    "perp_load_reason_text": (c_char_p, [c_int32]),
    "perp_load_friction_create": (c_int32, [
        ContextPointer, POINTER(LoadFrictionPointer), POINTER(LoadSettings), POINTER(LoadSystem)
    ]),
    "perp_load_friction_set": (c_int32, [LoadFrictionPointer, POINTER(LoadSystem)]),
    "perp_load_friction_destroy": (None, [LoadFrictionPointer]),
    "perp_load_friction_solve": (c_int32, [
        LoadFrictionPointer, POINTER(LoadSummary), c_void_p, c_void_p
    ]),
    "perp_load_friction_get": (c_int32, [LoadFrictionPointer, POINTER(LoadFound), c_int32]),
    "perp_load_friction_uniqueness": (c_int32, [
        LoadFrictionPointer, POINTER(LoadUniqueness), c_void_p
    ]),
    "perp_load_friction_inverse": (c_int32, [
        LoadFrictionPointer, c_void_p, POINTER(LoadInverse), c_void_p, c_void_p
    ]),
    "perp_load_friction_step": (c_int32, [
        LoadFrictionPointer, c_void_p, c_void_p, POINTER(LoadStep), c_void_p, c_void_p, c_void_p,
        c_double
    ]),
    "perp_compliant_create": (c_int32, [
        ContextPointer, POINTER(CompliantPointer), POINTER(CompliantSystem)
    ]),
    "perp_compliant_destroy": (None, [CompliantPointer]),
    "perp_compliant_linearise": (c_int32, [
        CompliantPointer, POINTER(CompliantStability), c_void_p, c_void_p, c_void_p, c_void_p
    ]),
    "perp_compliant_run": (c_int32, [
        CompliantPointer, c_void_p, c_void_p, c_void_p, POINTER(CompliantResult),
        POINTER(CompliantSettings), c_void_p, c_void_p, c_double
    ]),
    "perp_mechanism_model_init": (c_int32, [POINTER(MechanismModel), c_size_t]),
    "perp_mechanism_settings_init": (c_int32, [POINTER(MechanismSettings), c_size_t]),
    "perp_mechanism_scheme_text": (c_char_p, [c_int32]),
    "perp_mechanism_law_text": (c_char_p, [c_int32]),
    "perp_mechanism_select_text": (c_char_p, [c_int32]),
    "perp_mechanism_reason_text": (c_char_p, [c_int32]),
    "perp_mechanism_create": (c_int32, [
        ContextPointer, POINTER(MechanismPointer), POINTER(MechanismSettings),
        POINTER(MechanismModel)
    ]),
    "perp_mechanism_destroy": (None, [MechanismPointer]),
    "perp_mechanism_set": (c_int32, [MechanismPointer, POINTER(MechanismSettings)]),
    "perp_mechanism_check": (c_int32, [
        MechanismPointer, POINTER(MechanismCheckResult), c_double, c_void_p, c_void_p
    ]),
    "perp_mechanism_advance": (c_int32, [
        MechanismPointer, c_void_p, c_void_p, c_void_p, c_void_p, c_void_p, c_void_p,
        POINTER(MechanismStep), POINTER(MechanismStart)
    ]),
    "perp_mechanism_run": (c_int32, [
        MechanismPointer, c_void_p, c_void_p, POINTER(MechanismRunResult), POINTER(MechanismStart),
        c_double, MechanismObserver, c_void_p
    ]),
    "perp_mechanism_accelerations": (c_int32, [
        MechanismPointer, POINTER(MechanismSummary), c_double, c_void_p, c_void_p
    ]),
    "perp_mechanism_answers": (c_int32, [
        MechanismPointer, POINTER(MechanismSummary), c_double, c_double, c_void_p, c_void_p
    ]),
    "perp_mechanism_get_acceleration": (c_int32, [
        MechanismPointer, POINTER(MechanismFound), c_int32
    ]),
}
