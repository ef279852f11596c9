"""Equilibrium of contacts with Coulomb friction: whether forces can rest on them."""

from __future__ import annotations

from collections.abc import Sequence
from ctypes import byref, c_int32, pointer, sizeof
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Optional, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _arrays, _errors
from . import _generated as s
from ._answer import Shown, maker
from ._body import Body
from ._contact import _Laws
from ._generated import StaticsObjective, StaticsVerdict
from ._handle import Context
from ._library import STATICS_VERDICTS, library
from ._results import Array, Contact
from ._settings import fill
from ._structures import sized

if TYPE_CHECKING:
    from ._world import World

_CODES = {
    "objective": {
        word: s.CONSTANTS[f"PERP_STATICS_{word.upper()}"] for word in ("least", "interior")
    }
}


# Room that is kept for the contacts of a world: of a body in a dense packing of blocks, with a
# dozen neighbours, each pair of four points. A world of more is asked again.
CONTACTS_A_BODY = 24


@dataclass(frozen=True, eq=False, repr=False)
class Statics(Shown):
    """Whether forces are in equilibrium: true where they are."""

    verdict: StaticsVerdict  # "stands", "falls"; "indeterminate" where doubles cannot tell
    margin: float  # how far impulses can stay from the edge of all cones, in units of the largest
    # force, at most 1; negative: what is missing
    safety: float  # the largest factor of the load that is carried; inf: any; nan: not asked, none
    unbalance: float  # of the impulses returned, beside the terms of each sum
    work: float  # of the forces in the virtual velocity, > 0 where that proves that it falls
    iterations: int  # factorisations
    seconds: float

    @property
    def stands(self) -> bool:
        return self.verdict == "stands"

    def __bool__(self) -> bool:
        return self.stands

    def __repr__(self) -> str:
        safety = "" if np.isnan(self.safety) else f", safety {self.safety:.9g}"
        return f"<perp.{type(self).__name__}: {self.verdict}, margin {self.margin:.3g}{safety}>"


@dataclass(frozen=True, eq=False, repr=False)
class StaticsResult(Statics):
    """What statics() found."""

    impulse: Optional[Array]  # a row of H each, within the cones; None where it does not stand
    bilateral_impulse: Optional[Array]  # a row of G each; None where it does not stand
    velocity: Optional[Array]  # where it falls: v with H v in the dual cones and (f + load) v > 0


@dataclass(frozen=True, eq=False, repr=False)
class WorldStatics(Statics):
    """What World.statics() found."""

    contacts: list[Contact]  # their impulses are forces, zero where it does not stand
    velocities: Optional[dict[Body, tuple[Array, Any]]]  # where it falls: the virtual velocity and
    # angular velocity of each body


def _settings(objective: str, max_iterations: Optional[int]) -> s.StaticsSettings:
    settings = sized(s.StaticsSettings)
    fill(settings, _CODES, objective=objective, max_iterations=max_iterations)
    return settings


_make = maker(StaticsResult, s.StaticsResult, verdict=STATICS_VERDICTS)
_make_of_world = maker(WorldStatics, s.StaticsResult, verdict=STATICS_VERDICTS)


def statics(
    H: Any,
    f: ArrayLike,
    mu: Optional[ArrayLike],
    *,
    dim: Union[int, Sequence[int], NDArray[Any]] = 3,
    load: Optional[ArrayLike] = None,
    bilateral: Any = None,
    bounds: Optional[tuple[ArrayLike, ArrayLike]] = None,
    rolling: Optional[ArrayLike] = None,
    spinning: Optional[ArrayLike] = None,
    two_sided: Optional[ArrayLike] = None,
    r0: Optional[ArrayLike] = None,
    objective: StaticsObjective = "least",
    max_iterations: Optional[int] = None,
) -> StaticsResult:
    """Decides whether contacts and joints can carry forces:

        f + load + H.T r + G.T s = 0

    with |r_t| <= mu r_n for each contact, lower <= r_i <= upper in rows with bounds, and any s.
    If they cannot, a virtual velocity v proves it: u = H v has u_n >= mu |u_t| in each contact,
    G v = 0, and the forces do work, (f + load) v > 0, more than rows with bounds can take.

    H, f, mu, dim, rolling, spinning, two_sided: as for contact(); H may be any array or SciPy
        sparse matrix.
    load: (n,), a further force; the result's `safety` is the largest factor with which it is
        carried beside f.
    bilateral: G, the joints' rows.  bounds: (lower, upper) of the last len(lower) rows of H.
    r0: (rows of H,), impulses that tell which way two-sided contacts with friction press; they are
        then asked to press along these, and another call asks of the other way.
    objective: "least": of all impulses that balance the forces those with the least sum of squares;
        "interior": the first ones found strictly inside all cones.
    max_iterations: of the interior point; default 100.

    Returns a StaticsResult, which is true where it stands. Raises Error where the call itself did
    not make sense.
    """
    problem, result = sized(s.StaticsProblem), sized(s.StaticsResult)
    settings = _settings(objective, max_iterations)
    H_view, G_view = sized(s.Matrix), sized(s.Matrix)
    owners = [_arrays.view_rectangle(H_view, H, "H")[1]]
    n, rows = H_view.columns, H_view.rows
    forces, added, pressing = _arrays.vector(f, "f", n), None, None
    problem.n, problem.f = n, _arrays.address(forces)
    if load is not None:
        added = _arrays.vector(load, "load", n)
        problem.load = _arrays.address(added)
    if r0 is not None:
        pressing = _arrays.vector(r0, "r0", rows)
        problem.r0 = _arrays.address(pressing)
    laws = _Laws(rows, mu, dim, rolling, spinning, bounds, two_sided)
    problem.laws, problem.H = pointer(laws.struct), pointer(H_view)
    if bilateral is not None:
        owners.append(_arrays.view_rectangle(G_view, bilateral, "G")[1])
        if G_view.columns != n:
            raise _errors.argument_error(f"G has {G_view.columns} columns, but H has {n}")
        problem.G = pointer(G_view)
    r, v, context = np.empty(rows + G_view.rows), np.empty(n), Context()
    context.check(
        library.perp_contact_statics(
            context.pointer,
            _arrays.optional(r),
            _arrays.optional(v),
            byref(result),
            byref(problem),
            byref(settings),
        )
    )
    del owners, forces, added, pressing  # the views of these were used up to here
    verdict = STATICS_VERDICTS[result.verdict]
    stands, falls = verdict == "stands", verdict == "falls"
    return _make(
        result,
        impulse=r[:rows] if stands else None,
        bilateral_impulse=r[rows:] if stands else None,
        velocity=v if falls else None,
    )


def world_statics(
    world: World, load: Optional[dict[Body, Any]], objective: str, max_iterations: Optional[int]
) -> WorldStatics:
    """World.statics()."""
    settings, result = _settings(objective, max_iterations), sized(s.StaticsResult)
    given = (load or {}).items()
    loads = (s.WorldLoad * len(given))(*[_load(world, body, force) for body, force in given])
    found, states = c_int32(), sized(s.WorldStates)

    with world._lock:
        world._call(library.perp_world_get_states, byref(states))
        twists = np.zeros((states.slots, 6))
        found.value = CONTACTS_A_BODY * states.slots
        capacity = -1
        while capacity < found.value:  # again only where contacts are more than was thought
            capacity = found.value
            contacts = _world_contacts(capacity)
            world._call(
                library.perp_world_statics, contacts, capacity, byref(found),
                _arrays.address(twists), byref(result), byref(settings), loads, len(loads),
            )  # fmt: skip
        bodies = {body: twists[body.index + 1] for body in world.bodies}
    d, falls = world._dimension, STATICS_VERDICTS[result.verdict] == "falls"
    velocities = {
        body: (row[:d].copy(), float(row[5]) if world.planar else row[3:].copy())
        for body, row in bodies.items()
    }
    return _make_of_world(
        result,
        contacts=[world._contact(contact) for contact in contacts[: found.value]],
        velocities=velocities if falls else None,
    )


def _world_contacts(count: int) -> Any:
    contacts = (s.WorldContact * count)()
    if count > 0:
        sizes = np.frombuffer(contacts, dtype=np.uintp).reshape(count, -1)
        sizes[:, 0] = sizeof(s.WorldContact)
    return contacts


def _load(world: World, body: Any, given: Any) -> s.WorldLoad:
    """From a force, or (force, torque)."""
    if not isinstance(body, Body) or body._world is not world:
        raise _errors.argument_error(f"load has {body!r}, expected bodies of this world")
    pair = isinstance(given, (tuple, list)) and len(given) == 2 and np.ndim(given[0]) == 1
    load = sized(s.WorldLoad)
    load.body = body._id
    load.force = world._vector(given[0] if pair else given, "load")
    if pair:
        load.torque = world._turn(given[1], "load")
    return load
