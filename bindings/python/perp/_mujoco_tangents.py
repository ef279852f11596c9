"""How the inverse dynamics of a MuJoCo model, and the rows of its contacts, move with its places.

Spatial vectors are (angular, linear) at one point of the world. A place k turns and moves all that
it carries as one rigid body, by the twist S_k: what is downstream goes along (Carpentier and
Mansard, Analytical derivatives of rigid body dynamics algorithms, RSS 2018). A contact's point and
frame follow from where its two geoms are. By how these lie to each other they are differences of
MuJoCo's collision, the same twelve calls for all contacts.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import mujoco as mj  # type: ignore[import-untyped]
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def _skews() -> Array:
    """(9, 3): row 3 i + j is that of entry (i, j) of [x], with [x] y = x × y."""
    found = np.zeros((9, 3))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        found[3 * i + j, k], found[3 * j + i, k] = -1.0, 1.0
    return found


_SKEWS = _skews().T


def skew(x: Array) -> Array:
    return (x @ _SKEWS).reshape(*x.shape[:-1], 3, 3)


def _spatial(a: Any, b: Any, c: Any, d: Any) -> Array:
    """[[a, b], [c, d]]."""
    found = np.empty((*a.shape[:-2], 6, 6))
    found[..., :3, :3], found[..., :3, 3:], found[..., 3:, :3], found[..., 3:, 3:] = a, b, c, d
    return found


def motion(V: Array) -> Array:
    """[V ×], of twists on twists; that on wrenches is minus its transpose."""
    turn = skew(V[..., :3])
    return _spatial(turn, 0.0, skew(V[..., 3:]), turn)


def wrench(W: Array) -> Array:
    """Of twists w: how W turns with them, w ×* W."""
    push = -skew(W[..., 3:])
    return _spatial(-skew(W[..., :3]), push, push, 0.0)


def times(A: Array, x: Array) -> Array:
    """A matrix each, times a vector each."""
    return np.matmul(A, x[:, :, None])[:, :, 0]


class Tree:
    """Which places of a model carry which."""

    def __init__(self, model: Any) -> None:
        n, body = model.nv, model.dof_bodyid
        carries = np.zeros((n, model.nbody))  # whether place k carries a body
        carries[np.arange(n), body] = 1.0
        for b, parent in enumerate(model.body_parentid):
            carries[:, b] = np.maximum(carries[:, b], carries[:, parent])
        first = np.arange(n)  # the first place of those that turn one ball or free joint
        for kind, begin in zip(model.jnt_type.tolist(), model.jnt_dofadr.tolist()):
            if kind in TURNS:
                begin += TURNS[kind]
                first[begin : begin + 3] = begin
        on = carries[:, body] > 0.0  # on[i, k]: i is of the chain to k's body
        same, order = body[:, None] == body, np.arange(n)
        earlier = on & ~(same & (order[:, None] >= first[None, :]))
        turns_with = same & (first[:, None] == first) & (order[:, None] != order)
        self.carries, self.carried = carries, np.ascontiguousarray(carries.T)
        self.before = np.ascontiguousarray(earlier.T.astype(float))
        # [j, k]: k moves the axis of j; j is of k's chain, and k does not move its axis
        moves = (earlier | turns_with).T
        self.moves, self.below = moves.astype(float), (on & ~moves).astype(float)
        self._root = model.body_rootid[body]

    def axes(self, data: Any, origin: Array) -> Array:
        """S, a row each."""
        S = data.cdof.copy()
        S[:, 3:] += times(skew(data.subtree_com[self._root] - origin), S[:, :3])
        return S


class Kinematics:
    """A model's axes at the state of data."""

    def __init__(self, tree: Tree, data: Any) -> None:
        self.tree, self.origin = tree, data.subtree_com[0].copy()
        self.S = tree.axes(data, self.origin)

    def moving(self, v: Array) -> tuple[Array, Array]:
        """At each of some v: twists of bodies, and rates of the axes by what moves them."""
        parts, tree = self.S * v[:, :, None], self.tree
        rates = np.matmul(motion(tree.before @ parts), self.S[:, :, None])
        return tree.carried @ parts, rates[..., 0]


class Dynamics:
    """A model's inertia at the state of data, with its axes."""

    def __init__(self, kinematics: Kinematics, model: Any, data: Any) -> None:
        self._tree, self._S = kinematics.tree, kinematics.S
        x, R = skew(data.xipos - kinematics.origin), data.ximat.reshape(-1, 3, 3)
        m = model.body_mass[:, None, None]
        turning = (R * model.body_inertia[:, None, :]) @ R.transpose(0, 2, 1)
        mx = m * x
        self._inertia = _spatial(turning - mx @ x, mx, -mx, m * np.eye(3))
        self._of_subtrees = self._sums(self._inertia)

    def _sums(self, of_bodies: Array) -> Array:
        """Over what each place carries."""
        summed = self._tree.carries @ of_bodies.reshape(len(of_bodies), -1)
        return summed.reshape(-1, *of_bodies.shape[1:])

    def forces(self, a: Array, v: Array, gravity: Array) -> Array:
        """Of inverse dynamics by places: a row a force, a column a place.

        A place k moves the wrench B of a body that it carries by
            S_k ×* B + I (A_k × S_k + V_k × S'_k) + Q S'_k,   S'_k = V_k × S_k,
            Q w = -I (V × w) + w ×* (I V) + V ×* (I w),
        with V_k and A_k the twist and its rate of what k does not move.
        """
        S, tree, inertia, base = self._S, self._tree, self._inertia, np.zeros(6)
        before = tree.before @ (S * v[:, None])
        over = motion(before)
        rates, base[3:] = times(over, S), -gravity
        parts, V = S * a[:, None] + rates * v[:, None], tree.carried @ (S * v[:, None])
        A, crossed, impulse = base + tree.carried @ parts, motion(V), times(inertia, V)
        dual = -crossed.transpose(0, 2, 1)
        B = self._sums(times(inertia, A) + times(dual, impulse))
        Q = self._sums(dual @ inertia + wrench(impulse) - inertia @ crossed)
        left = times(motion(base + tree.before @ parts), S) + times(over, rates)
        chain = times(self._of_subtrees, left) + times(Q, rates) + times(wrench(B), S)
        of_axes = times(self._of_subtrees, S) @ left.T
        of_axes += times(Q.transpose(0, 2, 1), S) @ rates.T
        return tree.below * (S @ chain.T) + tree.moves * of_axes


def has_constant_rows(model: Any) -> tuple[bool, NDArray[Any]]:
    """Whether all rows of limits and dry friction have a J that does not change with places; and
    which equations do."""
    curved = model.wrap_type[model.tendon_adr] != int(mj.mjtWrap.mjWRAP_JOINT)
    ruled = (model.tendon_limited != 0) | (model.tendon_frictionloss != 0.0)
    balls = np.isin(model.jnt_type, list(TURNS)) & (model.jnt_limited != 0)
    even = np.isin(model.eq_type, _COUPLED) & ~model.eq_data[:, 2:5].any(1)
    of_tendons = model.eq_type == _COUPLED[1]  # of joints, and no second one: the last entry
    ends = np.where(of_tendons, [model.eq_obj1id, model.eq_obj2id], -1)
    straight = not (model.nflex or balls.any() or (curved & ruled).any())
    return bool(straight), even & ~np.append(curved, False)[ends].any(0)


class Seen(NamedTuple):
    """Contacts as MuJoCo's collision finds them."""

    geom: NDArray[Any]
    points: Array
    frames: Array  # the axes, a row each
    gaps: Array


def see(data: Any) -> Seen:
    found = data.contact
    frames = found.frame.reshape(-1, 3, 3)
    return Seen(found.geom.copy(), found.pos.copy(), frames.copy(), found.dist.copy())


def _contacts_of(contact: Any, rows: NDArray[Any]) -> tuple[NDArray[Any], NDArray[Any]]:
    """Of such rows of MuJoCo's: which contact's, and which of its (normal, tangents, spin...)."""
    there = contact.efc_address >= 0
    address, dim = contact.efc_address[there], contact.dim[there]
    of = np.repeat(np.flatnonzero(there), dim)
    place = np.arange(len(of)) - np.repeat(address - address[0], dim)
    return of[rows - address[0]], place[rows - address[0]]  # contacts' rows follow each other


class Contacts:
    """Rows of contacts: X of the twists of their second body against the first. They go along with
    the first, and turn by dX with the second's twist against it."""

    def __init__(
        self,
        kinematics: Kinematics,
        model: Any,
        data: Any,
        which: NDArray[Any],
        rows: Any,
        J: Array,
    ) -> None:
        """which: MuJoCo's rows that are perp's `rows`, which begin with those of contacts.
        J: theirs, constant in all others."""
        tree, S = kinematics.tree, kinematics.S
        count = len(rows.H) - len(rows.laws.lower)
        self._of, place = _contacts_of(data.contact, which[:count])
        self._lines = 6 * self._of + place  # of its contact's forces and torques along axes
        self.gaps, self._normals = J.copy(), rows.gaps[: len(rows.laws.dims)]
        self._scale = None if rows.scale is None else rows.scale[:count, None]
        self._kinematics, self._seen = kinematics, see(data)
        self._sums = (self._of == np.arange(len(self._seen.geom))[:, None]).astype(float)
        self._ids = self._seen.geom.tobytes()
        self._first, self._second = model.geom_bodyid[self._seen.geom].T
        first = tree.carried[self._first][:, None]
        self._moving_first = bool(first.any())
        self._signs = tree.carried[self._second][:, None] - first
        self._with_first, self._between = first * S.T, self._signs * S.T  # (contacts, 6, n)
        frames = self._seen.frames
        self._arms = skew(self._seen.points - kinematics.origin)
        self._own = self._lines_of(np.matmul(frames, -self._arms), frames)
        self.X = self._rows_of(self._own)

    def _lines_of(self, moments: Array, axes: Array) -> Array:
        """(..., contacts, 6, 6): unit forces along a contact's axes, then torques about them."""
        return _spatial(moments, axes, axes, 0.0)

    def _rows_of(self, lines: Array) -> Array:
        """(..., rows, 6)."""
        X = lines.reshape(*lines.shape[:-3], -1, 6).take(self._lines, axis=-2)
        return X if self._scale is None else X * self._scale

    def differ(self, model: Any, data: Any, eps: float, centered: bool) -> None:
        """How they turn. All geoms move at once, those of a contact by different multiples of one
        twist: by the difference the one moves against the other."""
        seen = self._seen
        share = self._shares(model)
        first = share[seen.geom[:, 0]]
        between = share[seen.geom[:, 1]] - first
        sides = np.array([1.0, -1.0] if centered else [1.0])
        points, frames, gaps, there = self._at_twists(model, data, eps * sides, share)
        # where others touch on one side, what is here is the other one
        both, sign = there.sum(1), sides[:, None] * there  # (6, contacts), (6, sides, contacts)
        sign = sign / (eps * between * np.maximum(both, 1))[:, None]
        moved = np.add.reduce(sign[..., None, None] * (frames - seen.frames), 1)
        gone = np.add.reduce(sign[..., None] * (points - seen.points), 1)
        d_gaps = np.add.reduce(sign * (gaps - seen.gaps), 1)
        turned = np.matmul(moved, self._arms) + np.matmul(seen.frames, skew(gone))
        lines = self._lines_of(-turned, moved)
        if first.any():  # as the first goes: with the other sign
            along = np.matmul(self._own, _UNITS[:, None])
            lines += along * (first / between)[:, None, None]
        held = both == 0
        if held.any():
            lines[held] = 0.0
            d_gaps = np.where(held, self._own[:, 0].T, d_gaps)
        self.dX, self.held = self._rows_of(lines).transpose(1, 2, 0), held
        of = self._of[self._normals]
        self.gaps[self._normals] = np.matmul(d_gaps.T[of, None], self._between[of])[:, 0]

    def _at_twists(
        self, model: Any, data: Any, steps: Array, share: Array
    ) -> tuple[Array, Array, Array, NDArray[Any]]:
        """Points, frames and gaps at unit twists times these steps, and where there are such."""
        size, place = len(self._seen.geom), (data.geom_xpos.copy(), data.geom_xmat.copy())
        at_points, at_frames = _moved(*place, self._kinematics.origin, share, steps)
        shape = 6, len(steps), size
        points, frames, gaps = np.zeros((*shape, 3)), np.zeros((*shape, 9)), np.zeros(shape)
        there = np.ones(shape, dtype=bool)
        xpos, xmat = data.geom_xpos, data.geom_xmat
        for k in range(6):
            for side in range(len(steps)):
                xpos[:], xmat[:] = at_points[k, side], at_frames[k, side]
                mj.mj_collision(model, data)
                found, here = data.contact, (k, side)
                if found.geom.tobytes() == self._ids:
                    points[here], frames[here], gaps[here] = found.pos, found.frame, found.dist
                else:
                    there[here] = self._match(found, points[here], frames[here], gaps[here])
        xpos[:], xmat[:] = place
        return points, frames.reshape(*shape, 3, 3), gaps, there

    def _shares(self, model: Any) -> Array:
        """Multiples of geoms, different ones where two touch; of the world's: 0."""
        still = model.body_weldid[model.geom_bodyid] == 0
        share = 1.0 - still
        if not (share[self._seen.geom[:, 0]] == share[self._seen.geom[:, 1]]).any():
            return share
        pairs = set(map(tuple, self._seen.geom.tolist()))
        for a, b in sorted(pairs):
            if share[a] == share[b]:
                near = {share[x + y - b] for x, y in pairs if b in (x, y)}
                share[b] = next(k for k in range(1, len(near) + 2) if k not in near)
        return share

    def _match(self, now: Any, points: Array, frames: Array, gaps: Array) -> NDArray[Any]:
        """Fills in those of pairs that have as many contacts as here, and says which these are."""
        here, there = self._seen.geom, np.zeros(len(points), dtype=bool)
        for pair in np.unique(here, axis=0):
            mine = np.flatnonzero((here == pair).all(1))
            other = np.flatnonzero((now.geom == pair).all(1))
            if len(mine) == len(other):
                points[mine], frames[mine] = now.pos[other], now.frame[other]
                gaps[mine], there[mine] = now.dist[other], True
        return there

    def forces(self, r: Array) -> Array:
        """Of J'r with r held: (n, n) for each of some r, of all of perp's rows."""
        S, sums = self._kinematics.S, self._sums
        r = r[:, : len(self._of), None]
        W = sums @ (r * self.X)  # (some, contacts, 6)
        turned = sums @ (r * self.dX.reshape(-1, 36))
        carried = self._signs[:, 0].T @ W  # (some, n, 6)
        moved = turned.reshape(*W.shape, 6) @ self._between
        if self._moving_first:
            moved += wrench(W) @ self._with_first
        between = self._between.reshape(-1, len(S)).T
        by_axes = np.matmul(wrench(carried), S[:, :, None])[..., 0] @ S.T
        return self._kinematics.tree.moves * by_axes + between @ moved.reshape(len(r), -1, len(S))

    def velocities(self, v: Array) -> Array:
        """Of J v with v held: (rows, n) for each of some v."""
        of, (bodies, rates) = self._of, self._kinematics.moving(v)
        second = bodies[:, self._second]
        relative = second - bodies[:, self._first]
        chain = self._signs * rates.transpose(0, 2, 1)[:, None] - motion(second) @ self._between
        turned = np.matmul(relative[:, of, None], self.dX)
        rows = np.matmul(self.X[:, None], chain[:, of]) + np.matmul(turned, self._between[of])
        found = np.zeros((len(v), *self.gaps.shape))
        found[:, : len(of)] = rows[:, :, 0]
        return found


def _moved(
    points: Array, frames: Array, origin: Array, share: Array, steps: Array
) -> tuple[Array, Array]:
    """Places of geoms, each moved by its share of unit twists: (6, steps, geoms, ...)."""
    by = (share * steps[:, None])[..., None]
    shape = 6, len(steps), len(points)
    all_points, all_frames = np.empty((*shape, 3)), np.empty((*shape, 9))
    all_points[:3] = points + by * np.matmul(points - origin, _TURNED)[:, None]
    all_points[3:] = points + by * _WAYS[:, None, None]
    # what turns leave out, of the second order, is the same to either side
    turned = np.matmul(-_TURNED[:, None], frames.reshape(-1, 3, 3)).reshape(3, 1, *frames.shape)
    all_frames[:3] = frames + by * turned
    all_frames[3:] = frames
    return all_points, all_frames


_WAYS = np.eye(3)
_TURNED = -skew(_WAYS)  # x times that: the way across x
_UNITS = motion(np.eye(6))
_COUPLED = int(mj.mjtEq.mjEQ_JOINT), int(mj.mjtEq.mjEQ_TENDON)
TURNS = {int(mj.mjtJoint.mjJNT_FREE): 3, int(mj.mjtJoint.mjJNT_BALL): 0}
