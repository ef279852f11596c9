"""A scene of the zoo in plain words: bodies, joints, forces, and how to build it with perp.

Assemblies are described in a frame of their own: x to the right, z up, y into the depth. What is a
picture in the x-z plane, extended along y, can be flattened: then it is a planar world whose x and
y are the picture's x and z. All angles that a picture needs are turns about y, which lean what
stands to the right.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any, Optional, Sequence

import numpy as np

GRAVITY = 9.81
UPRIGHT = (1.0, 0.0, 0.0, 0.0)


def about(axis: str, angle: float) -> tuple[float, ...]:
    """The quaternion of a turn about x, y or z."""
    turn = [math.cos(angle / 2), 0.0, 0.0, 0.0]
    turn["xyz".index(axis) + 1] = math.sin(angle / 2)
    return tuple(turn)


def product(p: Sequence[float], q: Sequence[float]) -> tuple[float, ...]:
    """The turn p after q."""
    w, x = p[0], np.array(p[1:])
    u, y = q[0], np.array(q[1:])
    return (float(w * u - x @ y), *(w * y + u * x + np.cross(x, y)).tolist())


def unit(random: np.random.Generator, count: int = 3) -> np.ndarray:
    """A random direction."""
    x = random.standard_normal(count)
    return x / np.linalg.norm(x)


def matrix(q: Sequence[float]) -> np.ndarray:
    """The rotation of a unit quaternion. Turns by nothing and about axes keep their zeros."""
    w, x, y, z = q
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


@dataclass
class Shape:
    """A box (half its edges), a prism (an outline in x and z, counterclockwise, and half its depth
    along y) or a half-space below z = 0. Without a friction of its own it has the scene's."""

    kind: str
    half: tuple[float, ...] = ()
    outline: tuple[tuple[float, float], ...] = ()
    depth: float = 0.0
    friction: Optional[float] = None

    def corners(self) -> np.ndarray:
        if self.kind == "box":
            signs = [(i, j, k) for i in (-1, 1) for j in (-1, 1) for k in (-1, 1)]
            return np.array(signs) * self.half
        return np.array([(x, y, z) for y in (-self.depth, self.depth) for x, z in self.outline])

    def scaled(self, unit: float) -> Shape:
        return Shape(
            self.kind,
            tuple(unit * edge for edge in self.half),
            tuple((unit * x, unit * z) for x, z in self.outline),
            unit * self.depth,
            self.friction,
        )


@dataclass
class Part:
    """A body. Its shapes lie about its mass centre; mass is of dynamic ones, inertia follows."""

    kind: str
    position: tuple[float, ...]
    shapes: list[Shape]
    mass: Optional[float] = None
    turn: tuple[float, ...] = UPRIGHT
    force: tuple[float, ...] = (0.0, 0.0, 0.0)


@dataclass
class Joint:
    """Between two parts, by number."""

    kind: str
    a: int
    b: int
    anchor: tuple[float, ...]
    anchor_b: Optional[tuple[float, ...]] = None  # of distance joints
    axis: tuple[float, ...] = (0.0, 1.0, 0.0)  # of revolute joints


@dataclass
class Scene:
    """What begins at rest, beside static bodies or beside what carries it."""

    friction: float
    parts: list[Part] = field(default_factory=list)
    joints: list[Joint] = field(default_factory=list)
    gravity: tuple[float, ...] = (0.0, 0.0, -GRAVITY)
    velocity: tuple[float, ...] = (0.0, 0.0, 0.0)  # of all bodies: the carrier's
    planar: bool = False
    picture: bool = False  # can be flattened
    share: Optional[float] = None  # of what can be carried, where that is known: it falls beyond 1
    kind: str = ""
    seed: int = 0
    size: Optional[int] = None  # as it was asked for
    notes: dict[str, Any] = field(default_factory=dict)

    def __str__(self) -> str:
        notes = ", ".join(
            f"{name} {value:.6g}" if isinstance(value, float) else f"{name} {value}"
            for name, value in self.notes.items()
        )
        return f"{self.kind}, seed {self.seed}: {len(self.parts)} bodies, {notes}"

    # --- what generators call -----------------------------------------------------------------

    def add(self, kind: str, position: Sequence[float], *shapes: Shape, **more: Any) -> int:
        self.parts.append(Part(kind, tuple(position), list(shapes), **more))
        return len(self.parts) - 1

    def add_floor(self, slab: bool = False, friction: Optional[float] = None) -> int:
        """Static, with its upper face at z = 0: a half-space or a slab."""
        if slab:
            return self.add("static", (0, 0, -0.5), Shape("box", (80, 80, 0.5), friction=friction))
        return self.add("static", (0, 0, 0), Shape("plane", friction=friction))

    def add_box(
        self, centre: Sequence[float], half: Sequence[float], density: float, **more: Any
    ) -> int:
        """A dynamic box, its mass from its volume."""
        friction = more.pop("friction", None)
        mass = density * 8 * math.prod(half)
        return self.add(
            "dynamic", centre, Shape("box", tuple(half), friction=friction), mass=mass, **more
        )

    def add_prism(
        self,
        outline: Sequence[Sequence[float]],
        y: float,
        depth: float,
        density: float,
        kind: str = "dynamic",
        lean: float = 0.0,
    ) -> int:
        """The prism over an outline in x and z of the scene. With a lean the body is turned by it,
        and its outline back."""
        area, x, z = area_and_centre(outline)
        c, s = math.cos(lean), math.sin(lean)
        local = tuple(
            (c * (px - x) - s * (pz - z), s * (px - x) + c * (pz - z)) for px, pz in outline
        )
        mass = density * area * 2 * depth if kind == "dynamic" else None
        shape = Shape("prism", outline=local, depth=depth)
        return self.add(kind, (x, y, z), shape, mass=mass, turn=about("y", lean))

    def add_joint(
        self,
        kind: str,
        a: int,
        b: int,
        anchor: Sequence[float],
        anchor_b: Optional[Sequence[float]] = None,
    ) -> None:
        self.joints.append(Joint(kind, a, b, tuple(anchor), anchor_b and tuple(anchor_b)))

    # --- the whole scene, changed ---------------------------------------------------------------

    def turned(self, axis: str, angle: float, gravity: bool = True) -> Scene:
        """All of it turned about an axis through the origin, gravity and forces with it or not."""
        turn, R = about(axis, angle), matrix(about(axis, angle))

        def image(vector: Sequence[float]) -> tuple[float, ...]:
            return tuple((R @ np.array(vector)).tolist())

        for part in self.parts:
            part.position = image(part.position)
            part.turn = product(turn, part.turn)
            if gravity:
                part.force = image(part.force)
        for joint in self.joints:
            joint.anchor, joint.axis = image(joint.anchor), image(joint.axis)
            if joint.anchor_b is not None:
                joint.anchor_b = image(joint.anchor_b)
        self.velocity = image(self.velocity)
        if gravity:
            self.gravity = image(self.gravity)
        return self

    def scaled(self, unit: float) -> Scene:
        """Lengths times unit, masses times its cube."""
        for part in self.parts:
            part.position = tuple(unit * x for x in part.position)
            part.shapes = [shape.scaled(unit) for shape in part.shapes]
            part.force = tuple(unit**3 * f for f in part.force)
            if part.mass is not None:
                part.mass *= unit**3
        for joint in self.joints:
            joint.anchor = tuple(unit * x for x in joint.anchor)
            if joint.anchor_b is not None:
                joint.anchor_b = tuple(unit * x for x in joint.anchor_b)
        return self

    def carried(self, velocity: Sequence[float]) -> Scene:
        """What was static is kinematic, and all moves with one velocity."""
        for part in self.parts:
            if part.kind == "static":
                part.kind = "kinematic"
        self.velocity = tuple(velocity)
        return self

    def length(self) -> float:
        """The largest extent of a dynamic body's shape: what lengths are compared with."""
        return max(
            float(np.ptp(shape.corners(), axis=0).max())
            for part in self.parts
            if part.kind == "dynamic"
            for shape in part.shapes
        )

    def dynamic(self) -> list[int]:
        return [k for k, part in enumerate(self.parts) if part.kind == "dynamic"]

    # --- perp -----------------------------------------------------------------------------------

    def flat(self, vector: Sequence[float]) -> Any:
        """A vector as the world wants it."""
        return (vector[0], vector[2]) if self.planar else tuple(vector)

    def build(self, accuracy: str = "standard", **settings: Any) -> tuple[Any, list[Any]]:
        """Returns the world and its bodies, in the order of the parts."""
        import perp

        world = perp.World(
            self.flat(self.gravity),
            self.planar,
            friction=self.friction,
            accuracy=accuracy,
            **settings,
        )
        bodies = [self._build_part(world, part) for part in self.parts]
        for joint in self.joints:
            more: dict[str, Any] = {}
            if joint.kind == "distance":
                more["anchor_b"] = self.flat(joint.anchor_b)
            elif joint.kind == "revolute" and not self.planar:
                more["axis"] = joint.axis
            a, b = bodies[joint.a], bodies[joint.b]
            world.add_joint(joint.kind, a, b, anchor=self.flat(joint.anchor), **more)
        return world, bodies

    def _build_part(self, world: Any, part: Part) -> Any:
        angle = -2 * math.atan2(part.turn[2], part.turn[0])
        body = world.add_body(
            part.mass,
            position=self.flat(part.position),
            orientation=angle if self.planar else part.turn,
            velocity=None if part.kind == "static" else self.flat(self.velocity),
            kind=part.kind,
        )
        for shape in part.shapes:
            if shape.kind == "plane":
                body.add_plane((0, 1) if self.planar else (0, 0, 1), friction=shape.friction)
            elif shape.kind == "box":
                body.add_box(self.flat(shape.half), friction=shape.friction)
            else:
                points = shape.outline if self.planar else shape.corners()
                body.add_hull(points, friction=shape.friction)
        if any(part.force):
            body.force = self.flat(part.force)
        return body


def area_and_centre(outline: Sequence[Sequence[float]]) -> tuple[float, float, float]:
    """Of a polygon given counterclockwise."""
    x0, z0 = outline[0]
    area = x = z = 0.0
    for (ax, az), (bx, bz) in zip(outline[1:], outline[2:]):
        twice = (ax - x0) * (bz - z0) - (bx - x0) * (az - z0)
        area += twice / 2
        x += twice / 6 * (ax + bx - 2 * x0)
        z += twice / 6 * (az + bz - 2 * z0)
    return area, x0 + x / area, z0 + z / area
