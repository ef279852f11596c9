"""The functions of the library that the package calls, and what each takes."""

from __future__ import annotations

from ctypes import POINTER, c_char_p, c_double, c_int32, c_int64, c_size_t, c_uint64, c_void_p
from typing import Any

from . import _structures as s
from . import _structures_mechanism as m

VOID_FUNCTIONS: dict[str, list[Any]] = {
    "perp_context_destroy": [s.ContextPointer],
    "perp_lcp_solver_destroy": [s.SolverPointer],
    "perp_lcp_sensitivity_destroy": [s.SensitivityPointer],
    "perp_load_friction_destroy": [s.LoadFrictionPointer],
    "perp_compliant_destroy": [s.CompliantPointer],
    "perp_mechanism_destroy": [m.MechanismPointer],
    "perp_world_destroy": [s.WorldPointer],
}

TEXT_FUNCTIONS: dict[str, list[Any]] = {
    "perp_version_text": [],
    "perp_status_text": [c_int32],
    "perp_outcome_text": [c_int32],
    "perp_lcp_method_text": [c_int32],
    "perp_lcp_verdict_text": [c_int32],
    "perp_load_kind_text": [c_int32],
    "perp_load_mode_text": [c_int32],
    "perp_load_reason_text": [c_int32],
    "perp_contact_mode_text": [c_int32],
    "perp_mechanism_scheme_text": [c_int32],
    "perp_mechanism_law_text": [c_int32],
    "perp_mechanism_select_text": [c_int32],
    "perp_mechanism_reason_text": [c_int32],
    "perp_ncp_method_text": [c_int32],
    "perp_contact_method_text": [c_int32],
    "perp_context_message": [s.ContextPointer],
}

STATUS_FUNCTIONS: dict[str, list[Any]] = {
    "perp_context_create": [POINTER(s.ContextPointer), POINTER(s.ContextSettings)],
    "perp_lcp_settings_init": [POINTER(s.LcpSettings), c_size_t],
    "perp_lcp_solver_create": [
        s.ContextPointer,
        POINTER(s.SolverPointer),
        POINTER(s.LcpSettings),
    ],
    "perp_lcp_solver_set": [s.SolverPointer, POINTER(s.LcpSettings)],
    "perp_lcp_solver_setup": [s.SolverPointer, POINTER(s.Matrix), c_void_p, c_void_p],
    "perp_lcp_solver_solve": [s.SolverPointer]
    + [c_void_p] * 3
    + [POINTER(s.LcpResult)]
    + [c_void_p] * 2,
    "perp_lcp_solve": [s.ContextPointer]
    + [c_void_p] * 3
    + [POINTER(s.LcpResult), POINTER(s.LcpSettings), POINTER(s.Matrix)]
    + [c_void_p] * 4,
    "perp_lcp_all": [
        s.ContextPointer,
        POINTER(s.LcpEnumeration),
        POINTER(s.LcpSettings),
        POINTER(s.Matrix),
        c_void_p,
        c_void_p,
        c_void_p,
        s.LcpVisit,
        c_void_p,
    ],
    "perp_lcp_batch": [s.ContextPointer]
    + [c_void_p] * 4
    + [POINTER(s.LcpSettings), c_int32, c_int64, c_int32]
    + [c_void_p] * 4,
    "perp_lcp_sensitivity_create": [
        s.ContextPointer,
        POINTER(s.SensitivityPointer),
        POINTER(s.LcpSensitivityInfo),
        POINTER(s.LcpSettings),
        POINTER(s.Matrix),
    ]
    + [c_void_p] * 4,
    "perp_lcp_sensitivity_places": [s.SensitivityPointer, c_void_p],
    "perp_lcp_sensitivity_forward": [
        s.SensitivityPointer,
        c_void_p,
        c_void_p,
        POINTER(s.Matrix),
        c_void_p,
        c_void_p,
    ],
    "perp_lcp_sensitivity_adjoint": [s.SensitivityPointer] + [c_void_p] * 4,
    "perp_lcp_verify": [
        s.ContextPointer,
        c_void_p,
        POINTER(s.LcpProof),
        POINTER(s.Matrix),
    ]
    + [c_void_p] * 4,
    "perp_contact_settings_init": [POINTER(s.ContactSettings), c_size_t],
    "perp_contact_solve": [s.ContextPointer]
    + [c_void_p] * 5
    + [
        POINTER(s.ContactResult),
        POINTER(s.ContactSettings),
        POINTER(s.ContactLaws),
        POINTER(s.ContactDynamics),
    ]
    + [c_void_p] * 4,
    "perp_contact_solve_delassus": [s.ContextPointer]
    + [c_void_p] * 4
    + [
        POINTER(s.ContactResult),
        POINTER(s.ContactSettings),
        POINTER(s.ContactLaws),
        POINTER(s.Matrix),
    ]
    + [c_void_p] * 2,
    "perp_ncp_settings_init": [POINTER(s.NcpSettings), c_size_t],
    "perp_ncp_solve": [
        s.ContextPointer,
        c_void_p,
        c_void_p,
        POINTER(s.NcpResult),
        POINTER(s.NcpSettings),
        POINTER(s.NcpProblem),
        c_void_p,
    ],
    "perp_ncp_check_jacobian": [
        s.ContextPointer,
        POINTER(s.NcpCheck),
        POINTER(s.NcpProblem),
        c_void_p,
    ],
    "perp_load_system_init": [POINTER(s.LoadSystem), c_size_t],
    "perp_load_settings_init": [POINTER(s.LoadSettings), c_size_t],
    "perp_load_friction_create": [
        s.ContextPointer,
        POINTER(s.LoadFrictionPointer),
        POINTER(s.LoadSettings),
        POINTER(s.LoadSystem),
    ],
    "perp_load_friction_set": [s.LoadFrictionPointer, POINTER(s.LoadSystem)],
    "perp_load_friction_solve": [
        s.LoadFrictionPointer,
        POINTER(s.LoadSummary),
        c_void_p,
        c_void_p,
    ],
    "perp_load_friction_get": [s.LoadFrictionPointer, POINTER(s.LoadFound), c_int32],
    "perp_load_friction_uniqueness": [
        s.LoadFrictionPointer,
        POINTER(s.LoadUniqueness),
        c_void_p,
    ],
    "perp_load_friction_inverse": [
        s.LoadFrictionPointer,
        c_void_p,
        POINTER(s.LoadInverse),
        c_void_p,
        c_void_p,
    ],
    "perp_load_friction_step": [
        s.LoadFrictionPointer,
        c_void_p,
        c_void_p,
        POINTER(s.LoadStep),
        c_void_p,
        c_void_p,
        c_void_p,
        c_double,
    ],
    "perp_compliant_settings_init": [POINTER(s.CompliantSettings), c_size_t],
    "perp_compliant_create": [
        s.ContextPointer,
        POINTER(s.CompliantPointer),
        POINTER(s.CompliantSystem),
    ],
    "perp_compliant_linearise": [
        s.CompliantPointer,
        POINTER(s.CompliantStability),
        c_void_p,
        c_void_p,
        c_void_p,
        c_void_p,
    ],
    "perp_compliant_run": [
        s.CompliantPointer,
        c_void_p,
        c_void_p,
        c_void_p,
        POINTER(s.CompliantResult),
        POINTER(s.CompliantSettings),
        c_void_p,
        c_void_p,
        c_double,
    ],
    "perp_mechanism_model_init": [POINTER(m.MechanismModel), c_size_t],
    "perp_mechanism_settings_init": [POINTER(m.MechanismSettings), c_size_t],
    "perp_mechanism_create": [
        s.ContextPointer,
        POINTER(m.MechanismPointer),
        POINTER(m.MechanismSettings),
        POINTER(m.MechanismModel),
    ],
    "perp_mechanism_set": [m.MechanismPointer, POINTER(m.MechanismSettings)],
    "perp_mechanism_advance": [m.MechanismPointer]
    + [c_void_p] * 6
    + [POINTER(m.MechanismStep), c_double, c_double, c_void_p, c_void_p],
    "perp_mechanism_run": [
        m.MechanismPointer,
        c_void_p,
        c_void_p,
        POINTER(m.MechanismRunResult),
        c_double,
        c_double,
        c_double,
        c_void_p,
        c_void_p,
        m.MechanismObserver,
        c_void_p,
    ],
    "perp_bristle_init": [POINTER(s.Bristle), c_size_t],
    "perp_stribeck_force": [
        s.ContextPointer,
        POINTER(c_double),
        POINTER(c_double),
        POINTER(s.Bristle),
        c_double,
    ],
    "perp_lugre_force": [
        s.ContextPointer,
        POINTER(c_double),
        POINTER(c_double),
        POINTER(s.Bristle),
        c_double,
        c_double,
    ],
    "perp_lugre_step": [
        s.ContextPointer,
        POINTER(c_double),
        POINTER(c_double),
        POINTER(c_double),
        POINTER(s.Bristle),
        c_double,
        c_double,
        c_double,
    ],
    "perp_lugre_passive": [s.ContextPointer, POINTER(c_int32), POINTER(s.Bristle)],
    "perp_mechanism_accelerations": [
        m.MechanismPointer,
        POINTER(m.MechanismSummary),
        c_double,
        c_void_p,
        c_void_p,
    ],
    "perp_mechanism_answers": [
        m.MechanismPointer,
        POINTER(m.MechanismSummary),
        c_double,
        c_double,
        c_void_p,
        c_void_p,
    ],
    "perp_mechanism_get_acceleration": [
        m.MechanismPointer,
        POINTER(m.MechanismFound),
        c_int32,
    ],
    "perp_world_settings_init": [POINTER(s.WorldSettings), c_size_t, c_int32],
    "perp_body_settings_init": [POINTER(s.BodySettings), c_size_t],
    "perp_shape_settings_init": [POINTER(s.ShapeSettings), c_size_t],
    "perp_world_create": [s.ContextPointer, POINTER(s.WorldPointer), POINTER(s.WorldSettings)],
    "perp_world_add_body": [s.WorldPointer, POINTER(c_uint64), POINTER(s.BodySettings)],
    "perp_world_remove_body": [s.WorldPointer, c_uint64],
    "perp_world_get_body": [s.WorldPointer, POINTER(s.BodyState), c_uint64],
    "perp_world_set_body": [s.WorldPointer, POINTER(s.BodyState), c_uint64],
    "perp_world_add_sphere": [
        s.WorldPointer,
        POINTER(c_uint64),
        c_uint64,
        c_double,
        POINTER(s.ShapeSettings),
    ],
    "perp_world_add_box": [
        s.WorldPointer,
        POINTER(c_uint64),
        c_uint64,
        POINTER(c_double),
        POINTER(s.ShapeSettings),
    ],
    "perp_world_add_plane": [
        s.WorldPointer,
        POINTER(c_uint64),
        c_uint64,
        POINTER(c_double),
        c_double,
        POINTER(s.ShapeSettings),
    ],
    "perp_world_step": [s.WorldPointer, POINTER(s.StepResult), c_double],
    "perp_world_get_contact": [s.WorldPointer, POINTER(s.Contact), c_int32],
    "perp_world_energy": [s.WorldPointer, POINTER(c_double), POINTER(c_double)],
    "perp_world_momentum": [s.WorldPointer, POINTER(c_double), POINTER(c_double)],
    "perp_world_get_stats": [s.WorldPointer, POINTER(s.WorldStats)],
    "perp_world_snapshot_size": [s.WorldPointer, POINTER(c_size_t)],
    "perp_world_snapshot_save": [s.WorldPointer, c_char_p, c_size_t],
    "perp_world_snapshot_restore": [s.WorldPointer, c_char_p, c_size_t],
}
