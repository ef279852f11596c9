"""Joints between the bodies of a world."""

from __future__ import annotations

from ctypes import byref
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from . import _generated as s
from ._arrays import number
from ._body import Body
from ._library import library
from ._results import Array
from ._structures import sized

if TYPE_CHECKING:
    from ._world import World


@dataclass
class Reaction:
    """Impulses of a joint in the last step, on body b; body a gets the opposite.

    impulse: of all its rows, in the world.  moment: about the anchor (planar: a number).
    motor, friction, limit: the parts along the coordinate; limit > 0: the lower one presses.
    """

    impulse: Array
    moment: Any
    motor: float
    friction: float
    limit: float


class Joint:
    """A joint of a world, from World.add_joint()."""

    __slots__ = ("_id", "_world")

    def __init__(self, world: World, id: int) -> None:
        self._world = world
        self._id = id

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Joint) and self._id == other._id and self._world is other._world

    def __hash__(self) -> int:
        return hash((id(self._world), self._id))

    def __repr__(self) -> str:
        if not self._world._finalizer.alive:
            return "<perp.Joint of a closed world>"
        if self._id not in self._world._joints:
            return "<perp.Joint, removed>"
        return f"<perp.Joint, {self.kind}: position {self.position:.4g}, speed {self.speed:.4g}>"

    def _state(self) -> s.JointState:
        state = sized(s.JointState)
        self._world._call(library.perp_world_get_joint, byref(state), self._id)
        return state

    def _given(self) -> tuple[str, int, int]:
        self._state()  # refuses a joint that has been removed
        return self._world._joints[self._id]

    @property
    def world(self) -> World:
        return self._world

    @property
    def kind(self) -> str:
        """ "ball", "revolute" and so on."""
        return self._given()[0]

    @property
    def bodies(self) -> tuple[Body, Body]:
        """a and b."""
        _, a, b = self._given()
        return Body(self._world, a), Body(self._world, b)

    @property
    def position(self) -> float:
        """The coordinate: an angle with whole turns counted, a way or a distance; 0 without."""
        return float(self._state().position)

    @property
    def speed(self) -> float:
        """The rate of the coordinate."""
        return float(self._state().speed)

    @property
    def anchor(self) -> Array:
        """Where the anchor is now, on b."""
        return np.array(self._state().anchor[: self._world._dimension])

    @property
    def reaction(self) -> Reaction:
        """The impulses of the last step."""
        state = self._state()
        moment = float(state.moment[2]) if self._world.planar else np.array(state.moment)
        return Reaction(
            np.array(state.impulse[: self._world._dimension]),
            moment,
            state.motor_impulse,
            state.friction_impulse,
            state.limit_impulse,
        )

    @property
    def at_limit(self) -> int:
        """-1 where the lower limit presses, 1 where the upper one does, else 0."""
        return int(self._state().at_limit)

    @property
    def limits(self) -> tuple[float, float]:
        """(lower, upper) of the coordinate."""
        state = self._state()
        return state.lower, state.upper

    @limits.setter
    def limits(self, value: tuple[float, float]) -> None:
        lower, upper = value
        self._world._call(
            library.perp_world_set_joint_limits,
            self._id,
            number(lower, "lower"),
            number(upper, "upper"),
        )

    @property
    def motor(self) -> tuple[float, float]:
        """(speed, force): what it aims at, and the most that it pushes with; force 0: no motor."""
        state = self._state()
        return state.motor_speed, state.motor_force

    @motor.setter
    def motor(self, value: tuple[float, float]) -> None:
        speed, force = value
        self._world._call(
            library.perp_world_set_joint_motor,
            self._id,
            number(speed, "speed"),
            number(force, "force"),
        )

    @property
    def friction(self) -> float:
        """The most that dry friction pushes with."""
        return float(self._state().friction)

    @friction.setter
    def friction(self, value: float) -> None:
        self._world._call(
            library.perp_world_set_joint_friction, self._id, number(value, "friction")
        )

    def remove(self) -> None:
        """Removes the joint from the world; its bodies stay."""
        with self._world._lock:
            self._world._call(library.perp_world_remove_joint, self._id)
            del self._world._joints[self._id]
