"""What differences say of a mechanism's functions at a state."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from . import _arrays
from ._answer import maker
from ._errors import argument_error
from ._generated import CONSTANTS, MechanismCheckResult


@dataclass(frozen=True)
class MechanismCheck:
    """How normals, G, their drift and the tangents compare with differences of gap and c."""

    ok: bool  # nothing is wrong, constant or unchecked
    wrong: int  # entries that can't be right
    constant: int  # normals and rows of G whose gap or c never changes: not compared
    unchecked: int  # velocities, and the time, next to which the functions are not defined
    complaint: str  # the worst entry in words; "" if none is wrong
    given: float  # there: what the function returned,
    difference: float  # the value by differences,
    uncertainty: float  # and the estimated error of that


_make = maker(MechanismCheck, MechanismCheckResult)


def make_check(
    check: MechanismCheckResult, contacts: str, bilateral: str, index: int
) -> MechanismCheck:
    """contacts, bilateral: what messages call the functions; index: of the row among the normals or
    tangents, -1 for those of G."""
    return _make(
        check,
        ok=check.wrong == check.constant == check.unchecked == 0,
        complaint=_complaint(check, contacts, bilateral, index) if check.wrong else "",
    )


def _complaint(
    check: MechanismCheckResult, contacts: str, bilateral: str, index: int
) -> str:
    of_contact = index >= 0
    number = index if of_contact else check.index
    name, value = (contacts, "gap") if of_contact else (bilateral, "c")
    if check.part == CONSTANTS["PERP_MECHANISM_TANGENT"]:
        return f"{name}: tangent row {index} is a multiple of the normal of contact {check.index}"
    if check.part == CONSTANTS["PERP_MECHANISM_DRIFT"]:
        entry, what = f"drift of {value}[{number}]", "drift has to be its derivative by t"
    else:
        rows = "normal" if of_contact else "G"
        entry, what = f"{rows} ({number}, {check.column})", f"{rows} has to be its gradient"
    return (
        f"{name}: {entry} is {check.given:g}, but {name}: {value}[{number}] changes by "
        f"{check.difference:g}: {what}"
    )


def friction(coefficients: Any) -> None:
    """Refuses coefficients above 0 for contacts without tangents, which have no friction."""
    for word in ("mu", "mu_static"):
        value = coefficients.get(word)
        if value is not None and np.any(_arrays.real(value, word) > 0):
            raise argument_error(
                f"{word} is above 0, but contacts returned no tangent: without one there is no "
                "friction (dim=1 says that none is meant)"
            )
