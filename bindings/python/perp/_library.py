"""Finds and loads libperp, checks its version, and declares every function of its surface."""

from __future__ import annotations

import ctypes.util
import os
import sys
from ctypes import (
    CDLL,
    POINTER,
    byref,
    c_char_p,
    c_double,
    c_int32,
    c_int64,
    c_size_t,
    c_uint64,
    c_void_p,
    sizeof,
)
from pathlib import Path
from typing import Any

from . import _structures as s

# The soname's number this package was written for, and the oldest library that has every struct
# as declared in _structures.py. A newer one with the same number is a drop-in replacement.
ABI_VERSION = 0
OLDEST_VERSION = 100

_VOID_FUNCTIONS: dict[str, list[Any]] = {
    "perp_context_destroy": [s.ContextPointer],
    "perp_lcp_solver_destroy": [s.SolverPointer],
    "perp_lcp_sensitivity_destroy": [s.SensitivityPointer],
    "perp_load_friction_destroy": [s.LoadFrictionPointer],
    "perp_compliant_destroy": [s.CompliantPointer],
    "perp_world_destroy": [s.WorldPointer],
}

_TEXT_FUNCTIONS: dict[str, list[Any]] = {
    "perp_version_text": [],
    "perp_status_text": [c_int32],
    "perp_outcome_text": [c_int32],
    "perp_lcp_method_text": [c_int32],
    "perp_lcp_verdict_text": [c_int32],
    "perp_load_kind_text": [c_int32],
    "perp_load_mode_text": [c_int32],
    "perp_load_reason_text": [c_int32],
    "perp_contact_mode_text": [c_int32],
    "perp_ncp_method_text": [c_int32],
    "perp_contact_method_text": [c_int32],
    "perp_context_message": [s.ContextPointer],
}

_STATUS_FUNCTIONS: dict[str, list[Any]] = {
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


def _candidates() -> list[str]:
    """Where to look, in order: PERP_LIBRARY and nothing else if it is set; the library that came
    with this package; the system's."""
    override = os.environ.get("PERP_LIBRARY")
    if override:
        return [override]
    here = Path(__file__).resolve().parent
    names = {"darwin": "libperp.*dylib", "win32": "*perp*.dll"}
    packaged = sorted(str(path) for path in here.glob(names.get(sys.platform, "libperp.so*")))
    system = ctypes.util.find_library("perp")
    return packaged + ([system] if system else [])


def _checked(path: str) -> CDLL:
    """Loads one library. Raises OSError where it can't be used."""
    library = CDLL(path)
    try:
        library.perp_version.restype = library.perp_abi_version.restype = c_int32
        library.perp_version.argtypes = library.perp_abi_version.argtypes = []
        found, abi = library.perp_version(), library.perp_abi_version()
    except AttributeError as error:
        raise OSError(f"{path}: not a perp library ({error})") from None
    if abi != ABI_VERSION or found < OLDEST_VERSION:
        raise OSError(
            f"{path}: version {_dotted(found)} with ABI {abi}, "
            f"but this package needs ABI {ABI_VERSION}, version {_dotted(OLDEST_VERSION)} or later"
        )
    return library


def _dotted(number: int) -> str:
    return ".".join(map(str, _split(number)))


def _split(number: int) -> tuple[int, int, int]:
    return number // 10000, number // 100 % 100, number % 100


def _load() -> CDLL:
    errors = []
    for path in _candidates():
        try:
            return _checked(path)
        except OSError as error:
            errors.append(str(error))
    override = os.environ.get("PERP_LIBRARY")
    raise ImportError(
        "no usable libperp, "
        + ("as PERP_LIBRARY says" if override else "neither in this package nor on the system")
        + (":\n  " + "\n  ".join(errors) if errors else "")
        + "\nInstall the package from a source checkout (pip install ./bindings/python), "
        "or set PERP_LIBRARY to the path of the shared library."
    )


def _declare(library: CDLL) -> None:
    for functions, result in (
        (_VOID_FUNCTIONS, None),
        (_TEXT_FUNCTIONS, c_char_p),
        (_STATUS_FUNCTIONS, c_int32),
    ):
        for name, arguments in functions.items():
            function = getattr(library, name)
            function.restype, function.argtypes = result, arguments
    library.perp_world_ground.restype = c_uint64
    library.perp_world_ground.argtypes = [s.WorldPointer]
    library.perp_world_contact_count.restype = c_int32
    library.perp_world_contact_count.argtypes = [s.WorldPointer]


def _words(text: Any) -> dict[int, str]:
    """The library's own words for the codes 0, 1, 2, ..."""
    words: dict[int, str] = {}
    while not (word := text(len(words)).decode()).startswith("unknown"):
        words[len(words)] = word
    return words


library = _load()
_declare(library)

OUTCOMES = _words(library.perp_outcome_text)
METHODS = _words(library.perp_lcp_method_text)
NCP_METHODS = _words(library.perp_ncp_method_text)
VERDICTS = _words(library.perp_lcp_verdict_text)
MODES = _words(library.perp_contact_mode_text)
CONTACT_METHODS = _words(library.perp_contact_method_text)
LOAD_KINDS = _words(library.perp_load_kind_text)
LOAD_MODES = _words(library.perp_load_mode_text)
LOAD_REASONS = _words(library.perp_load_reason_text)
PLACES = ("lower", "upper", "between", "fixed")
CERTIFICATES = {0: None, 1: "infeasible"}
GOOD_OUTCOMES = (0, 1)

version: tuple[int, int, int] = _split(library.perp_version())


def version_text() -> str:
    """Returns the loaded library's version, its BLAS and its sparse factorisations, in words."""
    text: bytes = library.perp_version_text()
    return text.decode()


def defaults(struct: type[s.S], *arguments: int) -> s.S:
    """Returns settings with the library's defaults."""
    settings = s.sized(struct)
    name = next(name for name, value in s.STRUCTS.items() if value is struct)
    status = getattr(library, name + "_init")(byref(settings), sizeof(struct), *arguments)
    if status:
        raise ImportError(f"{name}_init: {library.perp_status_text(status).decode()}")
    return settings
