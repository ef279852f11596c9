"""What can be seen of a wrong model at its first state: gradients that are not those of their gaps,
tangents that are normals, coefficients of friction for contacts that have no tangents."""

from __future__ import annotations

from typing import Any, Callable

import numpy as np

from . import _arrays
from ._callbacks import Array
from ._errors import OutsideDomain, argument_error

# The cube root of the precision of a double: the step of central differences with the least error.
_STEP = 2.0**-17
# Beside the largest entry of its row: above what differences are wrong by, which the two sides
# tell, and below what a wrong sign or factor does.
_WRONG = 1e-3

_SEE = "Mechanism(check=False) leaves this look at the first state out"


def _differences(
    values: Callable[[Array], Array], q: Array, rate: Callable[[Array], Array], n: int
) -> tuple[Array, Array]:
    """The gradient of values(q) along each velocity, and how far its two sides disagree."""
    here = values(q)
    gradient, doubt = np.full((len(here), n), np.nan), np.full((len(here), n), np.inf)
    for j in range(n):
        direction = rate(np.eye(n)[j])
        step = _STEP * max(float(np.abs(q).max(initial=0.0)), 1.0)
        try:
            ahead, behind = values(q + step * direction), values(q - step * direction)
        except (OutsideDomain, ArithmeticError):  # this column stays open
            continue
        if ahead.shape == behind.shape == here.shape:
            gradient[:, j] = (ahead - behind) / (2 * step)
            doubt[:, j] = np.abs(ahead + behind - 2 * here) / step
    return gradient, doubt


def gradients(
    values: Callable[[Array], Array],
    given: Array,
    q: Array,
    rate: Callable[[Array], Array],
    names: tuple[str, str],
) -> None:
    """Refuses rows that are not the gradients of values(q); says which entry, and what it is by
    differences. A row at a kink, where the two sides differ, is let through, and so is one of
    values that don't change at all."""
    found, doubt = _differences(values, q, rate, given.shape[1])
    size = np.maximum(np.abs(given), np.nan_to_num(np.abs(found))).max(axis=1, keepdims=True)
    off = np.abs(given - found)
    bad = (off > _WRONG * size) & (off > 10 * doubt)
    bad &= np.nan_to_num(found).any(axis=1, keepdims=True)  # constants are one step's data
    if bad.any():
        i, j = map(int, np.unravel_index(np.argmax(np.where(bad, off, 0.0)), off.shape))
        raise argument_error(
            f"{names[1]} ({i}, {j}) is {given[i, j]:g}, but {names[0]}[{i}] changes by "
            f"{found[i, j]:g}: {names[1]} has to be its gradient ({_SEE})"
        )


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


def friction(coefficients: Any) -> None:
    """Refuses coefficients above 0 for contacts without tangents, which have no friction."""
    for word in ("mu", "mu_static"):
        value = coefficients.get(word)
        if value is not None and np.any(_arrays.real(value, word) > 0):
            raise argument_error(
                f"{word} is above 0, but contacts returned no tangent: without one there is no "
                "friction (dim=1 says that none is meant)"
            )
