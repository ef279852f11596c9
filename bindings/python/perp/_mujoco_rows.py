"""Perp's rows among those of a sparse Jacobian of MuJoCo's: which there are, by which laws, and what
is the same as before. Those of a dense one are arranged by the library (contact/rows.c)."""

from __future__ import annotations

from typing import Any, NamedTuple, Optional

import numpy as np
from numpy.typing import NDArray

from . import _mujoco_model as _model
from ._stepper import Array, Laws, Pattern, Rows

# MuJoCo's rows of a contact are normal, tangents, spin, roll, roll; perp's end with the spin. By
# condim, padded.
_ROWS = np.full((7, 6), -1)
_ROWS[1, :1], _ROWS[3, :3], _ROWS[4, :4], _ROWS[6] = 0, range(3), range(4), (0, 1, 2, 4, 5, 3)
_THERE = _ROWS >= 0
_COUNTS = _THERE.sum(1)
_DIMS = np.array([0, 1, 0, 3, 3, 0, 3], dtype=np.int32)
# Sliding, rolling, spinning: where MuJoCo has a contact's, and what condim leaves of them.
_FRICTIONS = np.array([0, 3, 2])
_HAS = np.array([[0] * 3, [0] * 3, [0] * 3, [1, 0, 0], [1, 0, 1], [0] * 3, [1] * 3], dtype=float)
_NONE = np.zeros(0, dtype=np.int32)
_PAIRS = 64  # more contacts than MuJoCo makes of two geoms: places of one pair in a key


def places_of_mass(model: Any, entries: tuple[NDArray[Any], ...]) -> tuple[NDArray[Any], ...]:
    """What RowSolver.set_mass asks for."""
    n = model.nv
    rows, columns, sources = entries
    if n <= _model.DENSE:
        dense = np.full((n, n), -1, dtype=np.int32)
        dense[rows, columns] = sources
        return dense.ravel(), (np.arange(n) * (n + 1)).astype(np.int32)
    order = np.lexsort((rows, columns))
    rows, columns, sources = (x[order].astype(np.int32) for x in (rows, columns, sources))
    starts = np.searchsorted(columns, np.arange(n + 1)).astype(np.int32)
    return sources, np.flatnonzero(rows == columns).astype(np.int32), starts, rows


class Touching(NamedTuple):
    """Perp's rows among MuJoCo's, as long as the same things touch."""

    key: tuple[Any, ...]
    rows: Rows
    names: NDArray[Any]  # of each contact and row with bounds: the same as long as it lasts
    there: NDArray[Any]  # (names, 6): which rows it has
    still: NDArray[Any]  # rows of J that are left out as they move nothing


def find_rows(key: tuple[Any, ...], model: Any, data: Any, h: float, all_move: bool) -> Touching:
    contact, ne, nf, nb = data.contact, data.ne, data.nf, data.nf + data.nl
    address, dim, geom, friction = contact.efc_address, contact.dim, contact.geom, contact.friction
    there, equations, still = address >= 0, np.arange(ne, dtype=np.int32), _NONE
    if not all_move:
        moves, still = _moves(data), np.concatenate([equations, address[there]])
        still, equations = still[~moves[still]], equations[moves[:ne]]
        there[there] = moves[address[there]]
    if not there.all():
        address, dim, geom, friction = address[there], dim[there], geom[there], friction[there]
    all_there = _THERE[np.concatenate([dim, np.ones(nb, dtype=np.int32)])]
    there, counts = all_there[: len(dim)], _COUNTS[dim]
    order = (address[:, None] + _ROWS[dim])[there]
    first, count = np.cumsum(counts) - counts, len(order)
    limits = np.zeros((2, nb))
    limits[1, :nf] = h * data.efc_frictionloss[ne : ne + nf]
    limits[1, nf:] = np.inf
    limits[0, :nf] -= limits[1, :nf]
    laws = Laws(_DIMS[dim], *(friction[:, _FRICTIONS] * _HAS[dim]).T.copy(), *limits)
    rows = Rows(
        laws,
        np.concatenate([order, np.arange(ne, ne + nb)]).astype(np.int32),
        equations,
        np.concatenate([first, np.arange(count + nf, count + nb)]).astype(np.int32),
        _scale(friction, there, nb),
        pattern(data),
    )
    names = _names(model, geom, data.efc_type[ne : ne + nb], data.efc_id[ne : ne + nb])
    return Touching(key, rows, names, all_there, still)


def _scale(friction: NDArray[Any], there: NDArray[Any], bounded: int) -> Optional[Array]:
    """Of the rows: a second direction in units in which its coefficient is the first one's."""
    second, first = friction[:, 1::3], friction[:, 0:4:3]
    if ((second == first) | ~there[:, 2:5:2]).all():
        return None
    scale = np.ones(there.shape)
    scale[:, 2:5:2] = second / first
    return np.concatenate([scale[there], np.ones(bounded)])


def _names(model: Any, geom: NDArray[Any], kind: NDArray[Any], which: NDArray[Any]) -> Any:
    pair = (geom[:, 0].astype(np.int64) + 1) * (model.ngeom + 2) + geom[:, 1]
    rows = 8 * which.astype(np.int64) + kind
    # an upper and a lower limit of one joint: the second is another
    return np.concatenate([pair * _PAIRS + _place(pair), -1 - 2 * rows - _place(rows)])


def _place(names: NDArray[Any]) -> Any:
    """Among those that follow each other and are the same."""
    place = np.arange(len(names))
    if len(names) > 1:
        begins = names[1:] != names[:-1]
        place[1:] -= np.maximum.accumulate(place[1:] * begins)
    return place


def pattern(data: Any) -> Pattern:
    return Pattern(data.efc_J_rownnz.copy(), data.efc_J_rowadr.copy(), data.efc_J_colind.copy())


def _moves(data: Any) -> NDArray[Any]:
    """Whether each row moves anything: a wall's contact with a planar robot may not."""
    row, places = pattern(data).places(np.arange(data.nefc))
    return np.bincount(row, np.abs(data.efc_J.ravel()[places]), data.nefc) > 0.0


def place_of_row(data: Any, row: int) -> tuple[int, int]:
    """Where a row of J begins, and how many entries it has."""
    return int(data.efc_J_rowadr[row]), int(data.efc_J_rownnz[row])


def hand_over(start: Array, now: Touching, old: Array, last: Touching) -> None:
    """The impulses of what touched already."""
    count, before = len(now.rows.H), np.zeros(last.there.shape)
    if len(last.names) and len(now.names):
        before[last.there] = old[: len(last.rows.H)]
        order = np.argsort(last.names)
        place = np.minimum(np.searchsorted(last.names[order], now.names), len(order) - 1)
        same = last.names[order[place]] == now.names
        start[:count] = np.where(same[:, None], before[order[place]], 0.0)[now.there]
        if len(now.rows.G) == len(last.rows.G):
            start[count:] = old[len(last.rows.H) :]


