"""All accelerations that a state of a mechanism may have."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Optional

import numpy as np
from numpy.typing import NDArray

from ._answer import Found, Shown, maker
from ._arrays import read
from ._callbacks import Array
from ._generated import MechanismFound, MechanismSummary
from ._mechanism_library import MECHANISM_REASONS
from ._mechanism_results import Words, words


@dataclass(frozen=True, eq=False)
class Acceleration(Shown):
    """One acceleration that a state may have, with its forces; of a family, a point inside."""

    acceleration: Array  # v'
    force: Array  # rows as in MechanismStep
    row_acceleration: Array  # u'
    modes: Words  # contacts, then groups of tresca
    stable: bool  # compliant contacts settle on it
    flutter: bool  # unstable though no eigenvalue says so without damping
    eigenvalues: NDArray[np.complex128]  # of the compliant contacts
    at_vertex: bool  # within rounding of a change of modes
    dimension: int  # 0; of a family at least 1
    free: int  # dimension of the accelerations in that family; 0: forces alone
    vertices: Array  # (k, rows): the forces of a family are the convex hull of these,
    directions: Array  # (m, rows): plus sums of these with factors >= 0
    residual: float  # largest violation of the laws, relative

    def __repr__(self) -> str:
        verdict = "stable" if self.stable else "unstable"
        return f"<perp.Acceleration {self.acceleration} {'/'.join(self.modes)} {verdict}>"


@dataclass(frozen=True, eq=False)
class Accelerations(Found[Acceleration]):
    """All accelerations of a state: a sequence of Acceleration, and why there are as many."""

    solutions: list[Acceleration]
    count: int  # families included
    families: int
    stable: int  # how many of the solutions are
    exhaustive: bool  # there are no others
    closed: int  # contacts that take part: gap and normal velocity are 0
    impact: bool  # a closed contact approaches: an impact comes before any acceleration
    reason: str  # why there may be none or several, or can't be
    contact: Optional[int]  # that the reason names first
    inertia: float  # the smallest n' M^-1 (n - mu d) of a contact that slides, over n' M^-1 n
    patterns: int  # combinations of modes looked at

    def __repr__(self) -> str:
        all_of = "all" if self.exhaustive else "at least"
        return f"<perp.Accelerations {all_of} {self.count}: {self.reason}>"


_make_acceleration = maker(Acceleration, MechanismFound)
_make_accelerations = maker(Accelerations, MechanismSummary, reason=MECHANISM_REASONS)


def read_acceleration(found: MechanismFound, n: int, rows: int, modes: int) -> Acceleration:
    return _make_acceleration(
        found,
        acceleration=read(found.acceleration, n),
        force=read(found.force, rows),
        row_acceleration=read(found.row_acceleration, rows),
        modes=words(found.modes, modes),
        eigenvalues=read(found.eigenvalues, 2 * found.eigenvalue_count).view(np.complex128),
        vertices=read(found.vertices, found.vertex_count, rows),
        directions=read(found.rays, found.ray_count, rows),
    )


def make_accelerations(
    summary: MechanismSummary, solutions: list[Acceleration]
) -> Accelerations:
    return _make_accelerations(summary, solutions=solutions)
