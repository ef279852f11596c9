"""Where the bodies of a scene touch as it begins, from their corners alone.

Two convex bodies touch along a direction that keeps them apart by nothing. Candidates are the
normals of all faces of both (what crosses edge on edge, askew, does not occur in the zoo). The
contact points of a direction are the corners of what the two outermost features have in common: of
two faces a polygon, of an edge on a face a segment.

Where corner meets corner, as at the tip of two cards, more than one direction keeps them apart, and
a contact may have any direction between them: laws of contact do not say which. `touching` lists
them pair by pair, so that a verdict can be asked of all of them together or of each.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from scene import Scene, Shape, matrix

TOUCH = 1e-9  # of the largest body: what is farther apart does not touch


@dataclass
class Contact:
    """Between two parts, by number; the normal points from a to b."""

    a: int
    b: int
    position: np.ndarray
    normal: np.ndarray
    friction: float


class Placed(NamedTuple):
    """A shape of a part, in the world."""

    part: int
    corners: np.ndarray  # a half-space: none
    normals: np.ndarray  # of faces, outwards
    friction: float


def place(scene: Scene, part: int, shape: Shape) -> Placed:
    given = scene.parts[part]
    R, position = matrix(given.turn), np.array(given.position)
    if shape.kind == "plane":
        corners, normals = np.zeros((0, 3)), np.array([[0.0, 0.0, 1.0]])
    elif shape.kind == "box":
        corners, normals = shape.corners(), np.concatenate((np.eye(3), -np.eye(3)))
    else:
        points = np.array(shape.outline)
        along = np.roll(points, -1, axis=0) - points
        sides = np.column_stack((along[:, 1], np.zeros(len(along)), -along[:, 0]))
        sides /= np.linalg.norm(sides, axis=1)[:, None]
        corners, normals = shape.corners(), np.concatenate((sides, [[0, 1, 0], [0, -1, 0]]))
    if scene.planar:
        corners = corners[corners[:, 1] < 0] * (1, 0, 1)
        normals = normals[normals[:, 1] == 0]
    friction = scene.friction if shape.friction is None else shape.friction
    return Placed(part, corners @ R.T + position, normals @ R.T, friction)


def touching(scene: Scene) -> list[list[list[Contact]]]:
    """A list for each pair of shapes that touch, with a list of contacts for each direction."""
    reach = TOUCH * scene.length()
    placed = [place(scene, k, shape) for k, part in enumerate(scene.parts) for shape in part.shapes]
    joined = {frozenset((joint.a, joint.b)) for joint in scene.joints}
    bounds = np.array([bounds_of(shape, reach) for shape in placed])
    low, high = bounds[:, 0], bounds[:, 1]
    pairs = []
    for i, a in enumerate(placed):
        near = (low[:i] <= high[i]).all(axis=1) & (low[i] <= high[:i]).all(axis=1)
        for b in (placed[j] for j in np.flatnonzero(near)):
            fixed = "dynamic" not in (scene.parts[a.part].kind, scene.parts[b.part].kind)
            if fixed or a.part == b.part or frozenset((a.part, b.part)) in joined:
                continue
            found = touching_pair(a, b, reach)
            if found:
                pairs.append(found)
    return pairs


def bounds_of(shape: Placed, reach: float) -> tuple[np.ndarray, np.ndarray]:
    if not len(shape.corners):
        return np.full(3, -math.inf), np.full(3, math.inf)
    return shape.corners.min(axis=0) - reach, shape.corners.max(axis=0) + reach


def touching_pair(a: Placed, b: Placed, reach: float) -> list[list[Contact]]:
    friction = math.sqrt(a.friction * b.friction)
    if not len(a.corners) or not len(b.corners):
        solid, other = (a, b) if not len(a.corners) else (b, a)
        normal = solid.normals[0]
        low = [corner for corner in other.corners if abs(corner @ normal) <= reach]
        contacts = [Contact(solid.part, other.part, corner, normal, friction) for corner in low]
        return [contacts] if contacts else []
    found: list[list[Contact]] = []
    directions: list[np.ndarray] = []
    for normal in (*a.normals, *-b.normals):
        over_a, over_b = a.corners @ normal, b.corners @ normal
        if abs(over_b.min() - over_a.max()) > reach:
            continue
        if any(normal @ known > 1 - 1e-12 for known in directions):
            continue
        top = a.corners[over_a >= over_a.max() - reach]
        bottom = b.corners[over_b <= over_b.min() + reach]
        points = common(top, bottom, normal, reach)
        if points:
            directions.append(normal)
            found.append([Contact(a.part, b.part, p, normal, friction) for p in points])
    return found


# --- what two flat convex features have in common -------------------------------------------------


def common(a: np.ndarray, b: np.ndarray, normal: np.ndarray, reach: float) -> list[np.ndarray]:
    """Corners of the intersection of the hulls of points a and b, which lie in one plane."""
    first = np.cross(normal, np.eye(3)[int(np.argmin(np.abs(normal)))])
    first /= np.linalg.norm(first)
    axes = np.array([first, np.cross(normal, first)])
    flat_a, flat_b = in_order(a @ axes.T), in_order(b @ axes.T)
    points = [p for p in flat_a if inside(p, flat_b, reach)]
    points += [p for p in flat_b if inside(p, flat_a, reach)]
    points += crossings(flat_a, flat_b, reach)
    height = a[0] @ normal
    kept: list[np.ndarray] = []
    for p in points:
        if all(np.abs(p - q).max() > 10 * reach for q in kept):
            kept.append(p)
    return [p @ axes + height * normal for p in kept]


def in_order(points: np.ndarray) -> np.ndarray:
    """Around their middle, counterclockwise."""
    away = points - points.mean(axis=0)
    return points[np.argsort(np.arctan2(away[:, 1], away[:, 0]))]


def inside(p: np.ndarray, hull: np.ndarray, reach: float) -> bool:
    """Whether p is no farther than reach from a polygon, a segment or a point."""
    ends = np.roll(hull, -1, axis=0)
    along, away = ends - hull, p - hull
    if len(hull) > 2 and (along[:, 0] * away[:, 1] - along[:, 1] * away[:, 0] >= 0).all():
        return True
    squares = np.maximum((along**2).sum(axis=1), 1e-300)
    share = np.clip((along * away).sum(axis=1) / squares, 0, 1)
    return bool((np.linalg.norm(away - share[:, None] * along, axis=1) <= reach).any())


def crossings(a: np.ndarray, b: np.ndarray, reach: float) -> list[np.ndarray]:
    """Where sides cross."""
    found = []
    for p, p_end in zip(a, np.roll(a, -1, axis=0)):
        for q, q_end in zip(b, np.roll(b, -1, axis=0)):
            d, e, between = p_end - p, q_end - q, q - p
            area = d[0] * e[1] - d[1] * e[0]
            if abs(area) <= reach * max(np.linalg.norm(d), np.linalg.norm(e)):
                continue
            s = (between[0] * e[1] - between[1] * e[0]) / area
            t = (between[0] * d[1] - between[1] * d[0]) / area
            if 0 <= s <= 1 and 0 <= t <= 1:
                found.append(p + s * d)
    return found


# --- which direction corners have that meet -------------------------------------------------------


def all_directions(pairs: list[list[list[Contact]]]) -> list[Contact]:
    """The contacts of all directions together: what falls with these falls with any."""
    return [contact for pair in pairs for way in pair for contact in way]


def middle_directions(pairs: list[list[list[Contact]]]) -> list[Contact]:
    """The contacts with one direction for each pair: where there are several the middle one, as the
    world has it. Corners that meet at right angles, of flush neighbours, carry nothing."""
    contacts = []
    for pair in pairs:
        normal = pair[0][0].normal + pair[-1][0].normal
        if pair[0][0].normal @ pair[-1][0].normal > 0.1:
            normal /= np.linalg.norm(normal)
            contacts += [Contact(c.a, c.b, c.position, normal, c.friction) for c in pair[0]]
    return contacts
