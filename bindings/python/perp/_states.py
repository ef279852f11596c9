"""The states of all bodies of a world, as arrays that show the world's own memory."""

from __future__ import annotations

import weakref
from ctypes import byref
from typing import TYPE_CHECKING, Any

import numpy as np

from . import _generated as s
from ._errors import BUSY, BufferError
from ._library import library
from ._results import Array
from ._structures import sized

if TYPE_CHECKING:
    from ._world import World

_FLOAT64 = np.dtype(np.float64)


class _Memory:
    """What every such array refers to: keeps the world, and shows it that the array is in use."""

    def __init__(self, world: World, interface: dict[str, Any]) -> None:
        self._world = world
        self.__array_interface__ = interface


class States:
    """Makes the arrays of a world, and knows which are in use."""

    def __init__(self, world: World) -> None:
        self._world = weakref.ref(world)
        self._used: weakref.WeakSet[_Memory] = weakref.WeakSet()

    def view(self, field: str, numbers: int) -> Array:
        """(n, numbers), read-only: a row for each slot but the ground's, which is the first."""
        world = self._world()
        assert world is not None  # it is who asks
        states = sized(s.WorldStates)
        with world._lock:
            world._call(library.perp_world_get_states, byref(states))
            twist = field in ("velocity", "angular_velocity")
            stride = states.twist_stride if twist else states.pose_stride
            memory = _Memory(
                world,
                {
                    "version": 3,
                    "typestr": _FLOAT64.str,
                    "data": (getattr(states, field) + stride, True),
                    "shape": (states.slots - 1, numbers),
                    "strides": (stride, _FLOAT64.itemsize),
                },
            )
            self._used.add(memory)
        return np.asarray(memory)

    def require_unused(self, what: str) -> None:
        """Refuses `what` as long as there are arrays that it would leave without their memory."""
        if len(self._used):
            raise BufferError(
                BUSY,
                f"{what} would leave arrays such as world.positions, which are still in use, "
                "without their memory: del them first, or keep copies",
            )
