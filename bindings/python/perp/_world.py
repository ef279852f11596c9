"""Rigid bodies with contact and Coulomb friction."""

from __future__ import annotations

import sys
import time
from ctypes import byref, c_double, c_size_t, c_uint64, create_string_buffer, sizeof
from math import cos, sin
from struct import Struct
from typing import Any, Callable, Optional, Union

import numpy as np
from numpy.typing import ArrayLike

from . import _generated as s
from ._answer import maker
from ._arrays import floats, number, real
from ._body import Body, Record, Shape
from ._contact import CODES
from ._errors import argument_error
from ._generated import Accuracy, BodyKind, ContactMethod, JointKind, Outcome, StaticsObjective
from ._handle import Handle
from ._joint import Joint
from ._library import MODES, codes, defaults, library
from ._results import Array, Contact, Energy, Momentum, RunResult, Stats, StepResult
from ._settings import code, fill, limit
from ._states import States
from ._statics import WorldStatics, world_statics
from ._structures import Matrix3, Vector3, Vector4, sized

_KIND_CODES = codes("PERP_BODY_")
_CODES = {"accuracy": codes("PERP_ACCURACY_"), **CODES}
_JOINT_CODES = codes("PERP_JOINT_")
_CLOCK = Struct("=dd")  # what a snapshot adds to the library's: the time, and what it has lost
_make_result = maker(StepResult, s.StepResult)
_make_stats = maker(Stats, s.WorldStats)


class World(Handle):
    """A world of rigid bodies; `ground` is its static body.

    gravity: (3,), default (0, 0, -9.81); in a planar world (2,), default (0, -9.81).
    planar: bodies move in the x-y plane and turn about z.
    friction: mu of shapes that have none of their own.
    accuracy: what a step may cost: "fast", "standard" or "accurate" give large islands a fixed
        number of sweeps, "exact" solves them to tol, as small ones are at every accuracy. What
        rests has velocity 0.0 at all of them.
    cone: of friction in three dimensions: "exact", or the even number of edges, 4 .. 64, of a
        polyhedron, solved by pivoting.
    method: of what is solved to tol, as for contact(). substeps: of what is not. tol: residual that
        counts as solved. None takes those of the accuracy. max_iterations, time_limit: of a whole step.
    strict: a step that is not solved leaves the state untouched; otherwise, on a limit, it
        advances with the best iterate.
    error: a length: a step is taken in as many as it needs for the estimated error of each to be
        below it; 0 takes it as one.
    wakeful: takes the steps of what rests like all others, for the same bits at more cost.
    threads: that take part in a step, for the same bits at any number.
    """

    _create = library.perp_world_create
    _destroy = library.perp_world_destroy
    _pointer_type = s.WorldPointer

    def __init__(
        self,
        gravity: Optional[ArrayLike] = None,
        planar: bool = False,
        *,
        friction: float = 0.0,
        accuracy: Accuracy = "standard",
        cone: Union[str, int] = "exact",
        method: ContactMethod = "auto",
        substeps: Optional[int] = None,
        tol: Optional[float] = None,
        max_iterations: Optional[int] = None,
        time_limit: Optional[float] = None,
        strict: bool = False,
        error: float = 0.0,
        wakeful: bool = False,
        threads: int = 1,
    ) -> None:
        self._planar = bool(planar)
        self._dimension = 2 if planar else 3
        settings = defaults(s.WorldSettings, 1 if planar else 0)
        if gravity is not None:
            settings.gravity = self._vector(gravity, "gravity")
        settings.friction = number(friction, "friction")
        fill(
            settings, _CODES, accuracy=accuracy, cone=cone, method=method, substeps=substeps,
            tol=limit(tol, "tol"), max_iterations=max_iterations, time_limit=time_limit,
            strict=strict, error=number(error, "error"), wakeful=wakeful, threads=threads,
        )  # fmt: skip
        super().__init__(byref(settings))
        self._gravity = settings.gravity[: self._dimension]
        self._accuracy = accuracy
        self._time = self._lost = 0.0
        self._ground_id: int = library.perp_world_ground(self._pointer)
        self._records = {self._ground_id: Record("static")}
        self._joints: dict[int, tuple[str, int, int]] = {}  # kind and bodies, by id
        self._states = States(self)

    def __repr__(self) -> str:
        kind = "planar" if self._planar else "3-D"
        if not self._finalizer.alive:
            return f"<perp.World, {kind}, closed>"
        bodies = len(self._records) - 1
        counted = f"{bodies} bod{'y' if bodies == 1 else 'ies'}"
        return f"<perp.World, {kind}, {self._accuracy}: {counted}, t = {self.time:g}>"

    @property
    def planar(self) -> bool:
        return self._planar

    @property
    def accuracy(self) -> str:
        return self._accuracy

    @property
    def gravity(self) -> Array:
        """(3,), in a planar world (2,). Assign to change it."""
        return np.array(self._gravity)

    @gravity.setter
    def gravity(self, value: ArrayLike) -> None:
        gravity = self._vector(value, "gravity")
        self._call(library.perp_world_set_gravity, gravity)
        self._gravity = gravity[: self._dimension]

    @property
    def time(self) -> float:
        """The steps since the world was made, added up; restore() sets it back."""
        return self._time + self._lost

    @property
    def ground(self) -> Body:
        """The static body that every world has."""
        return Body(self, self._ground_id)

    @property
    def bodies(self) -> tuple[Body, ...]:
        """The bodies that were added, in that order, without those removed and the ground."""
        with self._lock:
            self._alive()
            return tuple(Body(self, id) for id in self._records if id != self._ground_id)

    # --- all bodies at once, without copies -------------------------------------------------

    @property
    def positions(self) -> Array:
        """(n, 3), in a planar world (n, 2): row body.index is where that body is.

        This array and the next three show the world's own memory: they follow each step, restore
        and assignment, and can't be written to. The row of a removed body keeps its last numbers
        until the next body takes it. As long as one of them is in use no body can be added or
        removed, nor the world be closed (BufferError): `del` it, or keep a copy().
        """
        return self._states.view("position", self._dimension)

    @property
    def orientations(self) -> Array:
        """(n, 4), unit quaternions (w, x, y, z); in a planar world (n,), angles. See positions."""
        if self._planar:
            return self._states.view("angle", 1)[:, 0]
        return self._states.view("orientation", 4)

    @property
    def velocities(self) -> Array:
        """(n, 3), in a planar world (n, 2): of the mass centres. See positions."""
        return self._states.view("velocity", self._dimension)

    @property
    def angular_velocities(self) -> Array:
        """(n, 3), in a planar world (n,). See positions."""
        all_of_them = self._states.view("angular_velocity", 3)
        return all_of_them[:, 2] if self._planar else all_of_them

    def close(self) -> None:
        """Releases the world's memory; it can't be used afterwards. Closing twice is allowed."""
        with self._lock:
            self._states.require_unused("closing the world")
            super().close()

    # --- from what the caller has to what the library reads ----------------------------------

    def _vector(self, value: ArrayLike, name: str) -> Any:
        return Vector3(*floats(value, name, self._dimension))

    def _turn(self, value: ArrayLike, name: str) -> Any:
        if self._planar:
            return Vector3(0.0, 0.0, number(value, name))
        return Vector3(*floats(value, name, 3))

    def _inertia(self, value: ArrayLike) -> Any:
        """From a number, three principal moments or a matrix; a number in a planar world."""
        array = real(value, "inertia")
        if array.ndim == 0 or self._planar:
            moments = [number(array, "inertia")] * 3
        elif array.shape == (3, 3):
            return Matrix3(*array.ravel().tolist())
        elif array.shape == (3,):
            moments = array.tolist()
        else:
            raise argument_error(
                f"inertia has shape {array.shape}, expected a number, (3,) or (3, 3)"
            )
        return Matrix3(moments[0], 0.0, 0.0, 0.0, moments[1], 0.0, 0.0, 0.0, moments[2])

    def _shape_settings(
        self,
        friction: Optional[float],
        restitution: float,
        density: Optional[float],
        offset: Optional[ArrayLike],
        rotation: Optional[ArrayLike],
    ) -> s.ShapeSettings:
        settings = defaults(s.ShapeSettings)
        if friction is not None:
            settings.friction = number(friction, "friction")
        if density is not None:
            settings.density = number(density, "density")
        settings.restitution = number(restitution, "restitution")
        if offset is not None:
            settings.offset = self._vector(offset, "offset")
        if rotation is not None and self._planar:
            half = 0.5 * number(rotation, "rotation")
            settings.rotation = Vector4(cos(half), 0.0, 0.0, sin(half))
        elif rotation is not None:
            settings.rotation = Vector4(*floats(rotation, "rotation", 4))
        return settings

    # --- bodies -----------------------------------------------------------------------------

    def add_body(
        self,
        mass: Optional[float] = None,
        inertia: Optional[ArrayLike] = None,
        position: Optional[ArrayLike] = None,
        orientation: Optional[ArrayLike] = None,
        velocity: Optional[ArrayLike] = None,
        angular_velocity: Optional[ArrayLike] = None,
        *,
        angle: Optional[float] = None,
        kind: BodyKind = "dynamic",
    ) -> Body:
        """Adds a body without shapes.

        mass, inertia: about the mass centre in the body frame; a number, three principal moments
            or a symmetric matrix. What is left out comes from the shapes that are added: density
            times volume (planar: area), and their inertia in the ratio of the given mass to
            theirs; offsets are from the mass centre. 1 where the shapes have no volume.
        position: the mass centre.  orientation: a unit quaternion (w, x, y, z), body to world; in
            a planar world an angle, which may also be given as `angle`.
        velocity: of the mass centre; both velocities in the world frame.
        kind: "dynamic", "static", or "kinematic" (keeps its velocity, whatever touches it).
        """
        settings = defaults(s.BodySettings)
        settings.kind = code(kind, _KIND_CODES, "kind")
        if mass is not None:
            settings.mass = number(mass, "mass")
            if settings.mass == 0.0:
                raise argument_error("mass is 0, > 0 expected")
        if inertia is not None:
            settings.inertia = self._inertia(inertia)
        if position is not None:
            settings.position = self._vector(position, "position")
        if velocity is not None:
            settings.velocity = self._vector(velocity, "velocity")
        if angular_velocity is not None:
            settings.angular_velocity = self._turn(angular_velocity, "angular_velocity")
        self._place(settings, orientation, angle)
        body = c_uint64()
        with self._lock:
            self._states.require_unused("adding a body")
            self._call(library.perp_world_add_body, byref(body), byref(settings))
            self._records[body.value] = Record(kind)
        return Body(self, body.value)

    def _place(
        self,
        settings: s.BodySettings,
        orientation: Optional[ArrayLike],
        angle: Optional[float],
    ) -> None:
        if angle is not None and not self._planar:
            raise argument_error("angle is for planar worlds, orientation for this one")
        if angle is not None and orientation is not None:
            raise argument_error("angle and orientation are the same thing: give one of them")
        if self._planar:
            turn = orientation if angle is None else angle
            settings.angle = 0.0 if turn is None else number(turn, "orientation")
        elif orientation is not None:
            settings.orientation = Vector4(*floats(orientation, "orientation", 4))

    # --- joints -----------------------------------------------------------------------------

    def add_joint(
        self,
        kind: JointKind,
        a: Body,
        b: Body,
        *,
        anchor: Optional[ArrayLike] = None,
        anchor_b: Optional[ArrayLike] = None,
        axis: Optional[ArrayLike] = None,
        pitch: float = 0.0,
        lower: Optional[float] = None,
        upper: Optional[float] = None,
        motor_speed: float = 0.0,
        motor_force: float = 0.0,
        friction: float = 0.0,
        collides: bool = False,
    ) -> Joint:
        """Adds a joint between two bodies where they are.

        kind: "ball", "revolute", "prismatic", "fixed", "screw", "cylindrical", "planar" or
            "distance"; in a planar world "ball", "revolute", "prismatic", "fixed" or "distance".
        anchor: a point in the world, default the mass centre of b; of "distance" that on a, and
            anchor_b that on b, by default their mass centres.
        axis: in the world, default z; in a planar world of "prismatic" alone, default x.
        pitch: of a screw, the way a turn.
        lower, upper: limits of the coordinate, an angle, a way or a distance: 0 now but for a
            distance, which without limits keeps the length that it has. Equal ones hold it.
        motor_speed, motor_force: what a motor aims at, and the most that it pushes with.
        friction: the most that dry friction pushes with.
        collides: whether the two bodies touch each other; those that fixed joints hold together,
            in a chain as well, never do.
        """
        settings = defaults(s.JointSettings)
        settings.kind = code(kind, _JOINT_CODES, "kind")
        for name, body in (("a", a), ("b", b)):
            if not isinstance(body, Body) or body._world is not self:
                raise argument_error(f"{name} is {body!r}, expected a body of this world")
        apart = kind == "distance"
        settings.anchor = self._vector(
            (a if apart else b).position if anchor is None else anchor, "anchor"
        )
        if apart:
            settings.anchor_b = self._vector(b.position if anchor_b is None else anchor_b, "anchor_b")
        elif anchor_b is not None:
            raise argument_error("anchor_b is for distance joints: others have one anchor")
        if axis is not None:
            settings.axis = self._vector(axis, "axis")
        elif self._planar:
            settings.axis = Vector3(1.0, 0.0, 0.0)
        settings.pitch = number(pitch, "pitch")
        if lower is not None:
            settings.lower = number(lower, "lower")
        if upper is not None:
            settings.upper = number(upper, "upper")
        settings.motor_speed = number(motor_speed, "motor_speed")
        settings.motor_force = number(motor_force, "motor_force")
        settings.friction = number(friction, "friction")
        settings.collides = 1 if collides else 0
        joint = c_uint64()
        with self._lock:
            self._call(
                library.perp_world_add_joint, byref(joint), a._id, b._id, byref(settings)
            )
            self._joints[joint.value] = (kind, a._id, b._id)
        return Joint(self, joint.value)

    @property
    def joints(self) -> tuple[Joint, ...]:
        """The joints that were added, in that order, without those removed."""
        with self._lock:
            self._alive()
            return tuple(Joint(self, id) for id in self._joints)

    def _forget_joints(self, body: int) -> None:
        for id in [id for id, given in self._joints.items() if body in given[1:]]:
            del self._joints[id]

    # --- time -------------------------------------------------------------------------------

    def step(self, dt: float) -> StepResult:
        """Advances by dt. Where no step exists (outcome "ray") the state is left untouched."""
        result = sized(s.StepResult)
        with self._lock:
            self._call(library.perp_world_step, byref(result), dt)
            if result.advanced:
                self._advance(dt)
        return _make_result(result)

    def _advance(self, dt: float) -> None:
        """Adds dt to the time, with what rounding takes from the sum kept beside it."""
        sum = self._time + dt
        big, small = (self._time, dt) if self._time >= dt else (dt, self._time)
        self._time, self._lost = sum, self._lost + ((big - sum) + small)

    def run(
        self,
        seconds: float,
        dt: float,
        callback: Optional[Callable[[World], Any]] = None,
        progress: bool = False,
    ) -> RunResult:
        """Takes round(seconds / dt) steps of dt.

        callback: called with the world after each step; a true answer ends the run.
        progress: tell stderr how far the run is, about once a second.

        A step that leaves the state untouched ends the run: the next would do the same.
        """
        if not (dt > 0 and 0 <= seconds < float("inf")):
            raise argument_error(f"seconds is {seconds} and dt is {dt}, expected >= 0 and > 0")
        if callback is not None and not callable(callback):
            raise argument_error(f"callback is {callback!r}, expected None or a function")
        steps = round(seconds / dt)
        outcome: Outcome = "solved"
        ok, residual, done, stopped = True, 0.0, 0, False
        told = time.monotonic()
        while done < steps and not stopped:
            result = self.step(dt)
            residual = max(residual, result.residual)
            if ok and not result.ok:
                outcome, ok = result.outcome, False
            done += result.advanced
            stopped = not result.advanced or (callback is not None and bool(callback(self)))
            now = time.monotonic()
            if progress and (now - told >= 1.0 or done == steps or stopped):
                told = now
                print(f"perp: step {done} of {steps}, t = {done * dt:g}", file=sys.stderr)
        return RunResult(outcome, ok, done, done * dt, residual, stopped)

    # --- what happened ----------------------------------------------------------------------

    @property
    def contacts(self) -> list[Contact]:
        """The contact points of the last step, those that separate included."""
        with self._lock:
            found = (s.WorldContact * library.perp_world_contact_count(self._alive()))()
            for index, contact in enumerate(found):
                contact.struct_size = sizeof(contact)
                self._call(library.perp_world_get_contact, byref(contact), index)
        return [self._contact(contact) for contact in found]

    def _contact(self, contact: s.WorldContact) -> Contact:
        d = self._dimension
        body_a, body_b = Body(self, contact.body_a), Body(self, contact.body_b)
        tangents = [contact.tangent_1[:d], contact.tangent_2[:d]]
        return Contact(
            body_a,
            body_b,
            Shape(body_a, contact.shape_a),
            Shape(body_b, contact.shape_b),
            np.array(contact.position[:d]),
            np.array(contact.normal[:d]),
            np.array(tangents[: d - 1]),
            contact.gap,
            np.array(contact.impulse[:d]),
            np.array(contact.velocity[:d]),
            contact.friction,
            contact.restitution,
            MODES[contact.mode],
        )

    def statics(
        self,
        load: Optional[dict[Body, Any]] = None,
        *,
        objective: StaticsObjective = "least",
        max_iterations: Optional[int] = None,
    ) -> WorldStatics:
        """Decides whether all bodies can rest where they are: whether contacts and joints can carry
        their weights, forces and torques. Changes nothing.

        load: further forces, {body: force} or {body: (force, torque)}, at the mass centre, in the
            world; the result's `safety` is the largest factor with which they are carried.
        objective, max_iterations: as for statics().
        """
        return world_statics(self, load, objective, max_iterations)

    def energy(self) -> Energy:
        """Returns the kinetic and the potential energy of the dynamic bodies, and their total."""
        kinetic, potential = c_double(), c_double()
        self._call(library.perp_world_energy, byref(kinetic), byref(potential))
        return Energy(kinetic.value, potential.value)

    def momentum(self) -> Momentum:
        """Returns the linear momentum and the angular momentum about the origin."""
        linear, angular = Vector3(), Vector3()
        self._call(library.perp_world_momentum, linear, angular)
        turn = float(angular[2]) if self._planar else np.array(angular)
        return Momentum(np.array(linear[: self._dimension]), turn)

    def stats(self) -> Stats:
        """Returns what the last step counted, and the time spent since creation."""
        stats = sized(s.WorldStats)
        self._call(library.perp_world_get_stats, byref(stats))
        return _make_stats(stats)

    def snapshot(self) -> bytes:
        """Returns the state of all bodies and the time, for restore()."""
        with self._lock:
            blob = create_string_buffer(self._snapshot_size())
            self._call(library.perp_world_snapshot_save, blob, len(blob))
            return blob.raw + _CLOCK.pack(self._time, self._lost)

    def restore(self, snapshot: Any) -> None:
        """Puts all bodies back where snapshot() found them; the world goes on with the same bits.
        Valid for this world, as long as no body is added or removed."""
        blob = bytes(snapshot)
        size = len(blob) - _CLOCK.size
        if size < 0:
            raise argument_error(f"snapshot has {len(blob)} bytes: it is none of a world")
        with self._lock:
            self._call(library.perp_world_snapshot_restore, blob, size)
            self._time, self._lost = _CLOCK.unpack_from(blob, size)

    def _snapshot_size(self) -> int:
        size = c_size_t()
        self._call(library.perp_world_snapshot_size, byref(size))
        return size.value
