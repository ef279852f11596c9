"""What differences say of a mechanism's functions at a state."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from . import _arrays
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


def make_check(
    check: MechanismCheckResult, contacts: str, bilateral: str, contact_rows: int
) -> MechanismCheck:
    """contacts, bilateral: what messages call the functions."""
    return MechanismCheck(
        check.wrong == check.constant == check.unchecked == 0,
        check.wrong,
        check.constant,
        check.unchecked,
        _complaint(check, contacts, bilateral, contact_rows) if check.wrong else "",
        check.given,
        check.difference,
        check.uncertainty,
    )


<<<<<<< HEAD
def _complaint(
    check: MechanismCheckResult, contacts: str, bilateral: str, contact_rows: int
) -> str:
    of_contact = check.row < contact_rows
    name, value = (contacts, "gap") if of_contact else (bilateral, "c")
    if check.part == CONSTANTS["PERP_MECHANISM_TANGENT"]:
        row = check.row - check.index - 1  # each contact up to this one has a normal
        return f"{name}: tangent row {row} is a multiple of the normal of contact {check.index}"
    if check.part == CONSTANTS["PERP_MECHANISM_DRIFT"]:
        entry, what = f"drift of {value}[{check.index}]", "drift has to be its derivative by t"
    else:
        rows = "normal" if of_contact else "G"
        entry, what = f"{rows} ({check.index}, {check.column})", f"{rows} has to be its gradient"
    return (
        f"{name}: {entry} is {check.given:g}, but {name}: {value}[{check.index}] changes by "
        f"{check.difference:g}: {what}"
    )
=======
def tangents(normal: Array, tangent: Array, count: Any, name: str) -> None:
    """Refuses a tangent, of `count` for each contact, that is a multiple of its (first) normal,
    where both move several coordinates: one velocity can't be both."""
    contact = np.repeat(np.arange(len(count)), count)
    n, t = normal[contact], tangent
    cross = np.abs(n[:, :, None] * t[:, None, :] - n[:, None, :] * t[:, :, None]).max(axis=(1, 2))
    scale = np.abs(n).max(axis=1) * np.abs(t).max(axis=1)
    several = (np.count_nonzero(n, axis=1) > 1) & (np.count_nonzero(t, axis=1) > 1)
    bad = several & (cross <= 1e-12 * scale)
    if bad.any():
        row = int(np.argmax(bad))
        raise argument_error(
            f"{name}: tangent row {row} is a multiple of the normal of contact {contact[row]} "
            f"({_SEE})"
        )
>>>>>>> main


def friction(coefficients: Any) -> None:
    """Refuses coefficients above 0 for contacts without tangents, which have no friction."""
    for word in ("mu", "mu_static"):
        value = coefficients.get(word)
        if value is not None and np.any(_arrays.real(value, word) > 0):
            raise argument_error(
                f"{word} is above 0, but contacts returned no tangent: without one there is no "
                "friction (dim=1 says that none is meant)"
            )
