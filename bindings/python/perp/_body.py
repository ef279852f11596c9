"""Bodies of a world and the shapes on them."""

from __future__ import annotations

from ctypes import POINTER, byref, c_double, c_int32, c_uint64
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Optional, Union

import numpy as np
from numpy.typing import ArrayLike

from . import _generated as s
from ._arrays import floats, number, real
from ._errors import argument_error
from ._library import library
from ._results import Array
from ._structures import Matrix3, Vector4, sized

if TYPE_CHECKING:
    from ._world import World


@dataclass
class Record:
    """What was given with a body, and does not change."""

    kind: str
    shapes: dict[int, str] = field(default_factory=dict)  # in words, by id


class Shape:
    """A shape on a body."""

    __slots__ = ("_id", "body")

    def __init__(self, body: Body, id: int) -> None:
        self.body = body
        self._id = id

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Shape) and self._id == other._id and self.body == other.body

    def __hash__(self) -> int:
        return hash((self.body, self._id))

    def __repr__(self) -> str:
        record = self.body._world._records.get(self.body._id, Record("removed"))
        return f"<perp.Shape, {record.shapes.get(self._id, 'removed')}>"


def _vector(field: str, text: str) -> Any:
    """A property: a vector of the state, with as many components as the world has."""
    return property(
        lambda body: np.array(getattr(body._state(), field)[: body._world._dimension]),
        lambda body, value: body._set(field, body._world._vector(value, field)),
        doc=text,
    )


def _turn(field: str, text: str) -> Any:
    """The same of what is about an axis: a number in planar worlds."""

    def get(body: Body) -> Union[Array, float]:
        values = getattr(body._state(), field)
        return float(values[2]) if body._world.planar else np.array(values)

    return property(
        get, lambda body, value: body._set(field, body._world._turn(value, field)), doc=text
    )


class Body:
    """A body of a world.

    Arrays read from it are copies: assign to change the body. In a planar world positions,
    velocities and forces have two components; orientation is an angle, and angular velocity and
    torque are numbers. Otherwise orientation is a unit quaternion (w, x, y, z), body to world.
    """

    __slots__ = ("_id", "_world")

    def __init__(self, world: World, id: int) -> None:
        self._world = world
        self._id = id

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Body) and self._id == other._id and self._world is other._world

    def __hash__(self) -> int:
        return hash((id(self._world), self._id))

    def __repr__(self) -> str:
        world = self._world
        if not world._finalizer.alive:
            return "<perp.Body of a closed world>"
        if self._id not in world._records:
            return "<perp.Body, removed>"
        if self == world.ground:
            return "<perp.Body, the ground, static>"
        with np.printoptions(precision=4, suppress=False):
            return (
                f"<perp.Body {self.index}, {self.kind}: position {self.position}, "
                f"velocity {self.velocity}>"
            )

    @property
    def world(self) -> World:
        return self._world

    @property
    def index(self) -> int:
        """Of the body's row in world.positions and its like. The ground has none."""
        slot = c_int32()
        self._world._call(library.perp_world_body_slot, byref(slot), self._id)
        if slot.value == 0:
            raise argument_error("the ground has no row in the world's arrays")
        return slot.value - 1

    def _record(self) -> Record:
        self._state()  # refuses a body that has been removed
        return self._world._records[self._id]

    @property
    def kind(self) -> str:
        """ "dynamic", "static" or "kinematic"."""
        return self._record().kind

    @property
    def mass(self) -> float:
        """Given, or of the shapes; infinite for static and kinematic bodies."""
        mass = c_double()
        self._world._call(library.perp_world_get_mass, byref(mass), None, self._id)
        return mass.value

    @property
    def inertia(self) -> Any:
        """About the mass centre in the body's frame, (3, 3); in a planar world a number. As mass."""
        inertia = Matrix3()
        self._world._call(library.perp_world_get_mass, None, inertia, self._id)
        return float(inertia[8]) if self._world.planar else np.reshape(inertia, (3, 3))

    @property
    def shapes(self) -> tuple[Shape, ...]:
        """Its shapes, in the order in which they were added."""
        return tuple(Shape(self, id) for id in self._record().shapes)

    # --- what changes in time ---------------------------------------------------------------

    def _state(self) -> s.BodyState:
        state = sized(s.BodyState)
        self._world._call(library.perp_world_get_body, byref(state), self._id)
        return state

    def _set(self, field: str, value: Any) -> None:
        with self._world._lock:
            state = self._state()
            setattr(state, field, value)
            self._world._call(library.perp_world_set_body, byref(state), self._id)

    position: Array = _vector("position", "The mass centre, in the world.")

    @property
    def orientation(self) -> Any:
        """A unit quaternion (w, x, y, z); in a planar world, an angle."""
        state = self._state()
        return state.angle if self._world.planar else np.array(state.orientation)

    @orientation.setter
    def orientation(self, value: ArrayLike) -> None:
        if self._world.planar:
            self._set("angle", number(value, "orientation"))
        else:
            self._set("orientation", Vector4(*floats(value, "orientation", 4)))

    velocity: Array = _vector("velocity", "Of the mass centre, in the world.")
    angular_velocity: Any = _turn("angular_velocity", "In the world.")
    force: Array = _vector(
        "force", "Applied at the mass centre, in the world, until it is changed."
    )
    torque: Any = _turn("torque", "Applied, in the world, until it is changed.")

    # --- shapes -----------------------------------------------------------------------------

    def add_sphere(
        self,
        radius: float,
        *,
        friction: Optional[float] = None,
        restitution: float = 0.0,
        density: Optional[float] = None,
        offset: Optional[ArrayLike] = None,
        rotation: Optional[ArrayLike] = None,
    ) -> Shape:
        """Adds a sphere (planar: a disc). A sphere of radius 0 is a point.

        friction: mu, default the world's; a pair's is the geometric mean.
        restitution: a pair's is the larger.  density: default 1000; see World.add_body().
        offset: of the centre from the mass centre, in the body.  rotation: shape to body, a unit
        quaternion, or an angle in a planar world.
        """
        settings = self._world._shape_settings(friction, restitution, density, offset, rotation)
        size = number(radius, "radius")
        words = f"{'disc' if self._world.planar else 'sphere'} of radius {size:g}"
        return self._add(words, library.perp_world_add_sphere, size, settings)

    def add_box(
        self,
        half_extents: ArrayLike,
        *,
        friction: Optional[float] = None,
        restitution: float = 0.0,
        density: Optional[float] = None,
        offset: Optional[ArrayLike] = None,
        rotation: Optional[ArrayLike] = None,
    ) -> Shape:
        """Adds a box (planar: a rectangle), given half its edges. The rest as for add_sphere()."""
        settings = self._world._shape_settings(friction, restitution, density, offset, rotation)
        extents = self._world._vector(half_extents, "half_extents")
        edges = " x ".join(f"{2 * extent:g}" for extent in extents[: self._world._dimension])
        return self._add(f"box of {edges}", library.perp_world_add_box, extents, settings)

    def add_capsule(
        self,
        radius: float,
        half_length: float,
        *,
        friction: Optional[float] = None,
        restitution: float = 0.0,
        density: Optional[float] = None,
        offset: Optional[ArrayLike] = None,
        rotation: Optional[ArrayLike] = None,
    ) -> Shape:
        """Adds all points within radius of a segment of length 2 half_length, which lies along the
        shape's x axis. The rest as for add_sphere()."""
        settings = self._world._shape_settings(friction, restitution, density, offset, rotation)
        size, half = number(radius, "radius"), number(half_length, "half_length")
        words = f"capsule of radius {size:g}, {2 * half:g} between the ends' centres"
        return self._add(words, library.perp_world_add_capsule, size, half, settings)

    def add_hull(
        self,
        points: ArrayLike,
        *,
        friction: Optional[float] = None,
        restitution: float = 0.0,
        density: Optional[float] = None,
        offset: Optional[ArrayLike] = None,
        rotation: Optional[ArrayLike] = None,
    ) -> Shape:
        """Adds the convex hull of points, (n, 3) (planar: (n, 2), a convex polygon), which has at
        most 128 corners. The rest as for add_sphere(); offset is that of the points' origin."""
        settings = self._world._shape_settings(friction, restitution, density, offset, rotation)
        given, dimension = real(points, "points"), self._world._dimension
        if given.ndim != 2 or given.shape[1] != dimension:
            raise argument_error(f"points has shape {given.shape}, expected (n, {dimension})")
        spatial = np.zeros((len(given), 3))
        spatial[:, :dimension] = given
        return self._add(
            f"hull of {len(given)} points",
            library.perp_world_add_hull,
            spatial.ctypes.data_as(POINTER(c_double)),
            c_int32(len(spatial)),
            settings,
        )

    def add_plane(
        self,
        normal: ArrayLike,
        offset: float = 0.0,
        *,
        friction: Optional[float] = None,
        restitution: float = 0.0,
    ) -> Shape:
        """Adds a half-space, solid where n . x <= offset in the body's frame, n the normal brought
        to length 1. Static and kinematic bodies only. The rest as for add_sphere()."""
        settings = self._world._shape_settings(friction, restitution, None, None, None)
        direction = self._world._vector(normal, "normal")
        distance = c_double(number(offset, "offset"))
        return self._add(
            "half-space", library.perp_world_add_plane, direction, distance, settings
        )

    def _add(self, words: str, function: Any, *arguments: Any) -> Shape:
        *geometry, settings = arguments
        shape = c_uint64()
        with self._world._lock:
            self._world._call(function, byref(shape), self._id, *geometry, byref(settings))
            self._world._records[self._id].shapes[shape.value] = words
        return Shape(self, shape.value)

    def remove(self) -> None:
        """Removes the body and its shapes from the world."""
        with self._world._lock:
            self._world._states.require_unused("removing a body")
            self._world._call(library.perp_world_remove_body, self._id)
            del self._world._records[self._id]
            self._world._forget_joints(self._id)
