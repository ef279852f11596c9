"""perp.World: what goes in comes out, in both kinds of world."""

import gc
import math
import weakref

import numpy as np
import pytest
from check import EPS

import perp

NAN, INF = float("nan"), float("inf")


def quaternion(axis, angle):
    axis = np.asarray(axis, dtype=float) / np.linalg.norm(axis)
    return np.array([math.cos(angle / 2), *(math.sin(angle / 2) * axis)])


@pytest.fixture
def world():
    return perp.World()


@pytest.fixture
def planar():
    return perp.World(planar=True)


def sliding_brick(**settings):
    """A planar brick that slides on the ground, its lower face at height 0."""
    world = perp.World(planar=True, **settings)
    world.ground.add_plane([0, 1], friction=0.5)
    brick = world.add_body(2.0, 0.1, position=[0, 0.1], velocity=[1, 0])
    brick.add_box([0.2, 0.1], friction=0.5)
    return world, brick


# --- bodies -------------------------------------------------------------------------------------


def test_defaults(world, planar):
    body = world.add_body()
    np.testing.assert_array_equal(body.position, [0, 0, 0])
    np.testing.assert_array_equal(body.orientation, [1, 0, 0, 0])
    for name in ("velocity", "angular_velocity", "force", "torque"):
        np.testing.assert_array_equal(getattr(body, name), [0, 0, 0])
    body = planar.add_body()
    np.testing.assert_array_equal(body.position, [0, 0])
    np.testing.assert_array_equal(body.velocity, [0, 0])
    np.testing.assert_array_equal(body.force, [0, 0])
    for name in ("orientation", "angular_velocity", "torque"):
        value = getattr(body, name)
        assert value == 0.0 and isinstance(value, float)
    assert body.kind == "dynamic"


def test_state_of_a_new_body(world, planar):
    turn = quaternion([1, 2, 3], 0.7)
    body = world.add_body(
        2.0,
        [1, 2, 2.5],
        position=(1, 2, 3),
        orientation=turn,
        velocity=np.array([4.0, 5, 6]),
        angular_velocity=[7, 8, 9],
    )
    np.testing.assert_array_equal(body.position, [1, 2, 3])
    np.testing.assert_allclose(body.orientation, turn, rtol=0, atol=2 * EPS)  # normalised
    np.testing.assert_array_equal(body.velocity, [4, 5, 6])
    np.testing.assert_array_equal(body.angular_velocity, [7, 8, 9])
    for word in ("orientation", "angle"):
        body = planar.add_body(
            2.0, 3.0, position=(1, 2), velocity=(4, 5), angular_velocity=6, **{word: 0.5}
        )
        np.testing.assert_array_equal(body.position, [1, 2])
        np.testing.assert_array_equal(body.velocity, [4, 5])
        assert (body.orientation, body.angular_velocity) == (0.5, 6.0)


def test_writing(world, planar):
    body = world.add_body()
    turn = quaternion([1, -1, 0], 2.0)
    values = {
        "position": [1, 2, 3],
        "velocity": [4, 5, 6],
        "angular_velocity": [7, 8, 9],
        "force": [10, 11, 12],
        "torque": [13, 14, 15],
    }
    for name, value in values.items():
        setattr(body, name, value)
    body.orientation = 3 * turn / 3
    for name, value in values.items():
        np.testing.assert_array_equal(getattr(body, name), value)
    np.testing.assert_allclose(body.orientation, turn, rtol=0, atol=2 * EPS)
    body = planar.add_body()
    values = {"position": [1, 2], "velocity": [4, 5], "force": [10, 11]}
    numbers = {"orientation": 0.25, "angular_velocity": -9.0, "torque": np.float32(15)}
    for name, value in {**values, **numbers}.items():
        setattr(body, name, value)
    for name, value in values.items():
        np.testing.assert_array_equal(getattr(body, name), value)
    for name, value in numbers.items():
        assert getattr(body, name) == value


def test_reading_gives_copies(world):
    body = world.add_body(position=[1, 2, 3])
    body.position[0] = 9.0
    body.position += [1, 1, 1]  # reads, adds, writes
    np.testing.assert_array_equal(body.position, [2, 3, 4])


def test_mass_and_inertia_of_the_shapes():
    """What is left out comes from the shapes; a given mass scales their inertia."""
    for mass, density, expected in ((None, None, 1000.0), (None, 2.0, 2.0), (3.0, 2.0, 3.0)):
        world = perp.World(gravity=[0, 0, 0])
        body = world.add_body(mass)
        body.add_box([0.5, 0.5, 0.5], density=density)
        body.force = [1, 0, 0]
        body.torque = [0, 0, 1]
        world.step(1.0)
        assert body.velocity[0] == pytest.approx(1 / expected, rel=4 * EPS)
        assert body.angular_velocity[2] == pytest.approx(6 / expected, rel=8 * EPS)
    body.add_sphere(0.1, offset=[1, 0, 0])
    with pytest.raises(perp.Error, match="mass centre"):
        world.step(1.0)
    with pytest.raises(perp.Error, match="mass is 0"):
        world.add_body(mass=0)


def test_friction_of_the_world():
    world = perp.World(friction=0.5)
    world.ground.add_plane([0, 0, 1])
    world.add_body(position=[0, 0, 1]).add_sphere(1.0)
    world.step(0.01)
    assert world.contacts[0].friction == 0.5


def test_inertia_as_number_moments_and_matrix():
    """A torque of 1 for a step of 1 turns a body at rest at inertia^-1 torque."""
    matrix = np.array([[2.0, 0.5, 0.0], [0.5, 3.0, 0.25], [0.0, 0.25, 4.0]])
    for inertia, full in (
        (2.0, 2 * np.eye(3)),
        ([2, 3, 4], np.diag([2.0, 3, 4])),
        (matrix, matrix),
        (matrix.copy(order="F"), matrix),
    ):
        world = perp.World(gravity=[0, 0, 0])
        body = world.add_body(1.0, inertia)
        body.torque = [1, -2, 0.5]
        h = 2.0**-20
        world.step(h)
        # the gyroscopic term is of second order in h
        np.testing.assert_allclose(
            body.angular_velocity, h * np.linalg.solve(full, [1, -2, 0.5]), rtol=4 * h
        )
    world = perp.World(gravity=[0, 0], planar=True)
    body = world.add_body(1.0, 4.0)
    body.torque = 2.0
    world.step(0.5)
    assert body.angular_velocity == pytest.approx(0.25, rel=4 * EPS)


def test_identity(world):
    a, b = world.add_body(), world.add_body()
    a.add_sphere(1.0)
    b.add_sphere(1.0)
    b.position = [0, 0, 1.5]
    world.step(0.01)
    (contact,) = world.contacts
    assert {contact.body_a, contact.body_b} == {a, b}
    assert a != b and hash(a) == hash(perp.Body(world, a._id))
    assert a != 3 and world.ground == world.ground and world.ground != a
    other = perp.World().add_body()
    assert all(other != body for body in (a, b))
    assert contact.body_a.world is world
    assert contact.shape_a.body == contact.body_a
    assert contact.shape_a != contact.shape_b


def test_kinds(world):
    assert world.ground.kind == "static"
    bodies = {kind: world.add_body(kind=kind) for kind in ("dynamic", "static", "kinematic")}
    bodies["kinematic"].velocity = [1, 0, 0]
    world.step(0.5)
    for kind, body in bodies.items():
        assert body.kind == kind
        assert kind in repr(body)
    np.testing.assert_array_equal(bodies["static"].position, [0, 0, 0])
    np.testing.assert_array_equal(bodies["kinematic"].position, [0.5, 0, 0])
    assert bodies["dynamic"].velocity[2] == -9.81 * 0.5


def test_removed_bodies_are_refused(world):
    body, other = world.add_body(), world.add_body()
    body.remove()
    for use in (
        lambda: body.position,
        lambda: body.kind,
        lambda: body.add_sphere(1.0),
        body.remove,
        lambda: setattr(body, "velocity", [1, 2, 3]),
    ):
        with pytest.raises(perp.Error):
            use()
    again = world.add_body(position=[5, 5, 5])  # may take the place of the removed one
    assert again != body
    with pytest.raises(perp.Error):
        body.position = [0, 0, 0]
    np.testing.assert_array_equal(again.position, [5, 5, 5])
    np.testing.assert_array_equal(other.position, [0, 0, 0])
    with pytest.raises(perp.Error):
        world.ground.remove()
    assert world.ground.kind == "static"
    assert "removed" in repr(body)


def test_body_keeps_its_world():
    body = perp.World().add_body(position=[1, 2, 3])
    gc.collect()
    np.testing.assert_array_equal(body.position, [1, 2, 3])
    gone = weakref.ref(body.world)
    del body
    assert gone() is None


def test_closed_world():
    with perp.World() as world:
        body = world.add_body()
    for use in (
        lambda: world.step(0.1),
        lambda: body.position,
        lambda: world.contacts,
        lambda: world.snapshot(),
        lambda: world.add_body(),
    ):
        with pytest.raises(perp.Error, match="closed") as caught:
            use()
        assert caught.value.name == "PERP_ERROR_HANDLE"


# --- what stays the same ------------------------------------------------------------------------


def test_mass_inertia_and_shapes(world, planar):
    matrix = np.array([[2.0, 0.5, 0.0], [0.5, 3.0, 0.25], [0.0, 0.25, 4.0]])
    body = world.add_body(2.0, matrix)
    assert body.mass == 2.0 and body.shapes == ()
    np.testing.assert_array_equal(body.inertia, matrix)
    np.testing.assert_array_equal(world.add_body(inertia=[2, 3, 4]).inertia, np.diag([2, 3, 4]))
    assert (world.add_body().mass, planar.add_body().inertia) == (1.0, 1.0)
    slab = planar.add_body()
    slab.add_box([1, 2], density=3)
    assert slab.mass == 24.0  # an area of 8
    assert slab.inertia == pytest.approx(24 * (2**2 + 4**2) / 12, rel=4 * EPS)
    assert planar.add_body(2.0, 3.0).inertia == 3.0
    for kind in ("static", "kinematic"):
        assert world.add_body(kind=kind).mass == planar.add_body(kind=kind).inertia == INF
    np.testing.assert_array_equal(np.diag(world.ground.inertia), [INF] * 3)
    ball, box = body.add_sphere(0.5), body.add_box([1, 2, 3])
    assert body.mass == 2.0 and body.shapes == (ball, box) and all(shape.body == body for shape in body.shapes)
    floor = world.ground.add_plane([0, 0, 1])
    assert world.ground.shapes == (floor,)
    body.remove()
    for use in (lambda: body.mass, lambda: body.inertia, lambda: body.shapes, lambda: body.index):
        with pytest.raises(perp.Error, match="removed"):
            use()


def test_gravity_and_time(world, planar):
    np.testing.assert_array_equal(world.gravity, [0, 0, -9.81])
    np.testing.assert_array_equal(planar.gravity, [0, -9.81])
    np.testing.assert_array_equal(perp.World([1, 2, 3]).gravity, [1, 2, 3])
    world.gravity[2] = 5.0  # a copy
    assert world.gravity[2] == -9.81 and world.time == 0.0
    world.run(100.0, 0.01)
    assert world.time == 100.0  # 10 000 sums, whose rounding is kept
    saved = world.snapshot()
    world.step(2.0**-70)
    world.step(0.5)
    assert world.time == 100.5
    world.restore(saved)
    assert world.time == 100.0
    stuck, _ = squeezed_ball()
    assert not stuck.step(0.01).advanced and stuck.time == 0.0


def test_bodies_come_in_order(world):
    assert world.bodies == ()
    bodies = [world.add_body() for _ in range(5)]
    assert world.bodies == tuple(bodies)
    bodies.pop(1).remove()
    bodies.append(world.add_body())
    assert world.bodies == tuple(bodies) and world.ground not in world.bodies


def test_words_for_people(world, planar):
    assert repr(world) == "<perp.World, 3-D, standard: 0 bodies, t = 0>"
    body = world.add_body(position=[0, 0, 0.5])
    body.add_sphere(0.5)
    world.ground.add_plane([0, 0, 1])
    result = world.step(0.25)
    assert repr(world) == "<perp.World, 3-D, standard: 1 body, t = 0.25>"
    assert repr(body) == (
        "<perp.Body 0, dynamic: position [0.  0.  0.5], velocity [0. 0. 0.]>"
    )
    assert repr(world.ground) == "<perp.Body, the ground, static>"
    assert repr(body.shapes[0]) == "<perp.Shape, sphere of radius 0.5>"
    assert repr(planar.add_body().add_sphere(2)) == "<perp.Shape, disc of radius 2>"
    assert repr(planar.add_body().add_box([1, 2])) == "<perp.Shape, box of 2 x 4>"
    corners = planar.add_body().add_hull([[0, 0], [1, 0], [0, 1]])
    assert repr(corners) == "<perp.Shape, hull of 3 points>"
    assert repr(world.ground.shapes[0]) == "<perp.Shape, half-space>"
    assert repr(result).startswith("<perp.StepResult: solved, residual ")
    assert "contacts 1, islands 1" in repr(result) and "not advanced" not in repr(result)
    (contact,) = world.contacts
    assert repr(contact).startswith("<perp.Contact, stick: at [0. 0. 0.], normal [")
    assert "not advanced" in repr(squeezed_ball()[0].step(0.01))
    shape = body.shapes[0]
    body.remove()
    assert repr(body) == "<perp.Body, removed>" and repr(shape) == "<perp.Shape, removed>"
    world.close()
    assert repr(world) == "<perp.World, 3-D, closed>"
    assert repr(body) == "<perp.Body of a closed world>"


# --- arrays of all bodies -----------------------------------------------------------------------


def test_arrays_show_what_is_read_body_by_body(world, planar):
    turn = quaternion([1, 2, 3], 0.7)
    for w, moving in (
        (world, {"orientation": turn, "angular_velocity": [1, 2, 3]}),
        (planar, {"orientation": 0.7, "angular_velocity": 3.0}),
    ):
        assert w.positions.shape == (0, w._dimension)
        for k in range(30):
            w.add_body(position=[k] * w._dimension, velocity=[-k] * w._dimension, **moving)
        names = ("position", "orientation", "velocity", "angular_velocity")
        plural = ("positions", "orientations", "velocities", "angular_velocities")
        arrays = [getattr(w, name) for name in plural]
        for _ in range(3):
            for name, array in zip(names, arrays):
                expected = np.array([getattr(body, name) for body in w.bodies])
                np.testing.assert_array_equal(array, expected)
                assert array.shape == expected.shape
            saved = w.snapshot()
            w.step(0.25)  # the same arrays go on with the world
            assert [body.index for body in w.bodies] == list(range(30))
        w.restore(saved)
        w.bodies[4].position = [7] * w._dimension
        assert arrays[0][4, 0] == 7.0 and arrays[0][5, 0] == w.bodies[5].position[0]
        for array in arrays:
            assert not array.flags.owndata and not array.flags.writeable
            with pytest.raises(ValueError):
                array[:] = 0.0
            with pytest.raises(ValueError):
                array.flags.writeable = True


def test_rows_of_removed_bodies(world):
    bodies = [world.add_body(position=[k, 0, 0]) for k in range(4)]
    bodies[1].remove()
    assert [body.index for body in world.bodies] == [0, 2, 3]
    rows = [body.index for body in world.bodies]
    np.testing.assert_array_equal(world.positions[rows, 0], [0, 2, 3])
    again = world.add_body(position=[9, 0, 0])
    assert again.index == 1
    np.testing.assert_array_equal(world.positions[:, 0], [0, 9, 2, 3])
    with pytest.raises(ValueError, match="ground"):
        world.ground.index


def test_what_would_take_memory_from_arrays_is_refused():
    world = perp.World()
    body = world.add_body()
    array = world.velocities[:, 2]  # a view of a view
    for use in (world.add_body, body.remove, world.close):
        with pytest.raises(BufferError, match="still in use") as caught:
            use()
        assert isinstance(caught.value, perp.Error) and caught.value.name == "PERP_ERROR_BUSY"
    assert world.step(0.5).ok and array[0] == -0.5 * 9.81
    del array
    world.add_body()
    body.remove()
    kept = world.positions.copy()
    world.close()
    np.testing.assert_array_equal(kept.shape, (2, 3))
    with pytest.raises(perp.Error, match="closed"):
        world.positions


def test_arrays_keep_their_world():
    world = perp.World()
    world.add_body(position=[1, 2, 3])
    gone = weakref.ref(world)
    array = world.positions
    del world
    gc.collect()
    np.testing.assert_array_equal(array, [[1, 2, 3]])
    del array
    gc.collect()
    assert gone() is None


# --- settings -----------------------------------------------------------------------------------


@pytest.mark.parametrize("accuracy", ["fast", "standard", "accurate", "exact"])
@pytest.mark.parametrize("cone", ["exact", 8])
def test_rest_is_exact_at_every_accuracy(accuracy, cone):
    world = perp.World(accuracy=accuracy, cone=cone)
    assert world.accuracy == accuracy
    world.ground.add_plane([0, 0, 1], friction=0.5)
    for k in range(6):
        world.add_body(1.0, 1 / 6, [0, 0, 0.5 + k]).add_box([0.5] * 3, friction=0.5)
    places = world.positions.copy()
    world.run(0.1, 0.01)
    np.testing.assert_array_equal(world.positions, places)
    np.testing.assert_array_equal(world.velocities, np.zeros((6, 3)))
    np.testing.assert_array_equal(world.angular_velocities, np.zeros((6, 3)))


@pytest.mark.parametrize("method", ["auto", "sweep", "newton", "lemke"])
def test_methods_agree(method):
    """A box that slides along no edge of a cone; friction takes mu g t off its speed. lemke has
    polyhedra refined until they count as the cone."""
    world = perp.World(accuracy="exact", method=method)
    world.ground.add_plane([0, 0, 1], friction=0.5)
    start = np.array([2.0, 1.0, 0.0])
    box = world.add_body(1.0, 1 / 6, [0, 0, 0.5], velocity=start)
    box.add_box([0.5] * 3, friction=0.5)
    assert world.run(0.1, 0.01).ok
    speed = np.linalg.norm(start)
    left = start * (1 - 0.5 * 9.81 * 0.1 / speed)
    np.testing.assert_allclose(box.velocity, left, atol=1e-9)  # tol 1e-12, ten steps of 1e-2


# --- refusals -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "arguments, word",
    [
        ({"gravity": [0, 0]}, "gravity"),
        ({"gravity": [0, 0, 0], "planar": True}, "gravity"),
        ({"gravity": [0, 0, NAN]}, "gravity"),
        ({"accuracy": "best"}, "accuracy"),
        ({"accuracy": 2}, "accuracy"),
        ({"cone": 5}, "cone"),
        ({"cone": 2}, "cone"),
        ({"cone": 66}, "cone"),
        ({"cone": 8.0}, "cone"),
        ({"cone": "round"}, "cone"),
        ({"method": "bullet"}, "method"),
        ({"method": "fischer"}, "method"),
        ({"substeps": 0}, "substeps"),
        ({"substeps": 10**6}, "substeps"),
        ({"tol": -1.0}, "tol"),
        ({"time_limit": NAN}, "time_limit"),
        ({"max_iterations": 0}, "max_iterations"),
    ],
)
def test_world_refuses(arguments, word):
    with pytest.raises(ValueError, match=word):
        perp.World(**arguments)


@pytest.mark.parametrize(
    "arguments, word",
    [
        ({"mass": 0.0}, "mass"),
        ({"mass": -1.0}, "mass"),
        ({"mass": NAN}, "mass"),
        ({"mass": [1, 2]}, "mass"),
        ({"inertia": [1, 2]}, "inertia"),
        ({"inertia": [1, 1, 3]}, "inertia"),  # no body has it: 1 + 1 < 3
        ({"inertia": [[1, 2, 0], [2, 1, 0], [0, 0, 1]]}, "inertia"),  # not positive definite
        ({"inertia": [[1, 0.1, 0], [0, 1, 0], [0, 0, 1]]}, "inertia"),  # not symmetric
        ({"inertia": -1.0}, "inertia"),
        ({"position": [0, 0]}, "position"),
        ({"position": [0, INF, 0]}, "position"),
        ({"orientation": [1, 0, 0]}, "orientation"),
        ({"orientation": [2, 0, 0, 0]}, "orientation"),
        ({"angle": 0.5}, "angle"),
        ({"velocity": 1.0}, "velocity"),
        ({"angular_velocity": 1.0}, "angular_velocity"),
        ({"kind": "ghost"}, "kind"),
    ],
)
def test_add_body_refuses(world, arguments, word):
    with pytest.raises(ValueError, match=word):
        world.add_body(**arguments)
    assert world.stats().bodies == perp.World().stats().bodies


def test_planar_refusals(planar):
    with pytest.raises(ValueError, match="angle"):
        planar.add_body(angle=0.1, orientation=0.1)
    for arguments, word in (
        ({"position": [0, 0, 0]}, "position"),
        ({"inertia": [1, 1, 1]}, "inertia"),
        ({"orientation": [1, 0, 0, 0]}, "orientation"),
        ({"angular_velocity": [0, 0, 1]}, "angular_velocity"),
    ):
        with pytest.raises(ValueError, match=word):
            planar.add_body(**arguments)
    body = planar.add_body()
    with pytest.raises(ValueError, match="half_extents"):
        body.add_box([1, 1, 1])
    with pytest.raises(ValueError, match="torque"):
        body.torque = [0, 0, 1]


def test_capsule_and_hull_weigh_as_their_parts(world):
    r, half = 0.5, 2.0
    capsule = world.add_body()
    capsule.add_capsule(r, half, density=1.0)
    assert np.isclose(capsule.mass, np.pi * r**2 * 2 * half + 4 / 3 * np.pi * r**3, rtol=1e-14)
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-2, 2) for z in (-3, 3)], float)
    hull, box = world.add_body(), world.add_body()
    hull.add_hull(np.vstack([corners, 0.5 * corners]), density=1.0)
    box.add_box([1, 2, 3], density=1.0)
    assert np.isclose(hull.mass, box.mass, rtol=1e-14)
    assert np.allclose(hull.inertia, box.inertia, rtol=1e-14, atol=1e-12)


@pytest.mark.parametrize(
    "add, word",
    [
        (lambda body: body.add_sphere(-1.0), "radius"),
        (lambda body: body.add_sphere(NAN), "radius"),
        (lambda body: body.add_sphere([1, 2]), "radius"),
        (lambda body: body.add_box([1, 1]), "half_extents"),
        (lambda body: body.add_box([1, 0, 1]), "half_extents"),
        (lambda body: body.add_plane([0, 0, 1]), ""),
        (lambda body: body.add_capsule(0.0, 1.0), "radius"),
        (lambda body: body.add_capsule(1.0, -1.0), "half_length"),
        (lambda body: body.add_hull([[0, 0], [1, 0], [0, 1]]), "(n, 3)"),
        (lambda body: body.add_hull([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]]), "plane"),
        (lambda body: body.add_hull([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, NAN]]), "points[11]"),
        (lambda body: body.add_sphere(1.0, friction=-0.1), "friction"),
        (lambda body: body.add_sphere(1.0, restitution=1.1), "restitution"),
        (lambda body: body.add_sphere(1.0, offset=[0, 0]), "offset"),
        (lambda body: body.add_sphere(1.0, rotation=0.5), "rotation"),
        (lambda body: body.world.ground.add_plane([0, 0, 0]), "normal"),
        (lambda body: body.world.ground.add_plane([0, 0, 1], INF), "offset"),
    ],
)
def test_shapes_refuse(world, add, word):
    body = world.add_body()
    with pytest.raises(ValueError) as caught:
        add(body)
    assert word in str(caught.value)
    assert world.stats().shapes == 0


def test_state_refuses(world):
    body = world.add_body(position=[1, 2, 3])
    for name, value in (
        ("position", [NAN, 0, 0]),
        ("velocity", [0, 0]),
        ("orientation", [0, 0, 0, 0]),
        ("force", [0, 0, INF]),
    ):
        with pytest.raises(ValueError, match=name):
            setattr(body, name, value)
    np.testing.assert_array_equal(body.position, [1, 2, 3])
    with pytest.raises(AttributeError):
        body.positon = [0, 0, 0]
    for dt in (0.0, -1.0, NAN, INF):
        with pytest.raises(ValueError, match="dt"):
            world.step(dt)


# --- shapes and contacts ------------------------------------------------------------------------


def test_contact_of_a_ball_on_the_ground():
    world = perp.World()
    world.ground.add_plane([0, 0, 2], -1.0, friction=0.25, restitution=0.5)
    ball = world.add_body(2.0, 0.1, position=[3, 4, -0.75])
    ball.add_sphere(0.25, friction=0.25)
    result = world.step(0.01)
    assert result.ok and result.advanced and (result.contacts, result.islands) == (1, 1)
    (contact,) = world.contacts
    assert {contact.body_a, contact.body_b} == {world.ground, ball}
    sign = 1.0 if contact.body_b == ball else -1.0
    np.testing.assert_array_equal(contact.normal, [0, 0, sign])
    np.testing.assert_allclose(contact.position, [3, 4, -1], rtol=4 * EPS)
    assert abs(contact.gap) <= 2 * EPS
    assert (contact.friction, contact.restitution) == (0.25, 0.5)
    # right-handed: normal x tangent 1 = tangent 2
    assert contact.tangents.shape == (2, 3)
    np.testing.assert_allclose(
        np.cross(contact.normal, contact.tangents[0]), contact.tangents[1], atol=4 * EPS
    )
    # it carries the weight for the step
    assert contact.impulse[0] == pytest.approx(2.0 * 9.81 * 0.01, rel=1e-12)
    assert contact.mode == "stick"
    np.testing.assert_array_equal(contact.velocity, [0, 0, 0])
    np.testing.assert_array_equal(ball.velocity, [0, 0, 0])


def test_offset_and_rotation_of_shapes(world, planar):
    """A box on its side, off the mass centre, just touches the ground."""
    world.ground.add_plane([0, 0, 1])
    body = world.add_body(inertia=1.0, position=[0, 0, 1.0])
    body.add_box([0.5, 0.1, 0.2], offset=[0, 0, -0.5], rotation=quaternion([0, 1, 0], math.pi / 2))
    world.step(1e-3)
    assert len(world.contacts) == 4
    for contact in world.contacts:
        # x and z half extents have changed places
        np.testing.assert_allclose(np.abs(contact.position[:2]), [0.2, 0.1], atol=4 * EPS)
        assert abs(contact.gap) <= 4 * EPS
    planar.ground.add_plane([0, 1])
    body = planar.add_body(inertia=1.0, position=[0, 1.0])
    body.add_box([0.5, 0.2], offset=[0, -0.5], rotation=math.pi / 2)
    planar.step(1e-3)
    assert len(planar.contacts) == 2
    for contact in planar.contacts:
        assert contact.tangents.shape == (1, 2)
        assert contact.position.shape == contact.normal.shape == (2,)
        assert contact.impulse.shape == contact.velocity.shape == (2,)
        np.testing.assert_allclose(np.abs(contact.position[0]), 0.2, atol=4 * EPS)


def test_friction_is_the_geometric_mean_and_restitution_the_larger(planar):
    planar.ground.add_plane([0, 1], friction=0.9, restitution=0.25)
    planar.add_body(position=[0, 1]).add_sphere(1.0, friction=0.4, restitution=0.75)
    planar.step(0.01)
    (contact,) = planar.contacts
    assert contact.friction == pytest.approx(0.6, rel=2 * EPS)
    assert contact.restitution == 0.75


def test_no_contacts_before_a_step_and_none_after_separation(planar):
    planar.ground.add_plane([0, 1])
    ball = planar.add_body(position=[0, 1])
    ball.add_sphere(1.0)
    assert planar.contacts == []
    planar.step(0.01)
    assert len(planar.contacts) == 1
    ball.position = [0, 50]
    planar.step(0.01)
    assert planar.contacts == [] or planar.contacts[0].mode == "separate"


# --- time ---------------------------------------------------------------------------------------


def test_free_fall():
    """Nothing touches it: the parabola itself."""
    world = perp.World(gravity=[0, -1, -8])
    body = world.add_body(position=[0, 0, 1], velocity=[1, 0, 0])
    body.force = [0, 0, 4]
    h, n = 2.0**-7, 128
    result = world.run(n * h, h)
    assert (result.outcome, result.ok, result.steps, result.stopped) == ("solved", True, n, False)
    assert result.seconds == n * h
    # sums of multiples of 2^-15: exact
    np.testing.assert_array_equal(body.velocity, [1, -1, -4])
    np.testing.assert_array_equal(body.position, [1, -1 / 2, 1 - 4 / 2])


def test_step_result_and_stats():
    world, _ = sliding_brick()
    result = world.step(0.01)
    assert isinstance(result.ok, bool) and isinstance(result.advanced, bool)
    assert 0 <= result.residual <= 1e-10
    assert result.contacts == 2 and result.islands == 1
    world.step(0.01)
    stats = world.stats()
    assert stats.shapes == 2 and stats.contacts == 2 and stats.islands == 1
    assert stats.steps == 2 and stats.rows_normal == 2
    assert stats.seconds_solve > 0
    names = [name for name, _ in perp._generated.WorldStats._fields_]
    assert ["struct_size", *stats.as_dict()] == names


def test_brick_stops_and_stays_exactly():
    world, brick = sliding_brick()
    world.run(1.0, 0.01)
    np.testing.assert_array_equal(brick.velocity, [0, 0])
    assert brick.angular_velocity == 0.0
    place = brick.position
    world.run(1.0, 0.01)
    np.testing.assert_array_equal(brick.position, place)
    for contact in world.contacts:
        assert contact.mode == "stick"
        np.testing.assert_array_equal(contact.velocity, [0, 0])


def test_run_counts_rounds_and_stops():
    world = sliding_brick()[0]
    assert world.run(0.1, 0.03).steps == 3
    assert world.run(0.0, 0.01).steps == 0
    seen = []
    result = world.run(1.0, 0.01, callback=lambda w: seen.append(w) or len(seen) == 4)
    assert result.stopped and result.steps == 4
    assert seen == [world] * 4

    def fail(world):
        raise KeyError("in the callback")

    with pytest.raises(KeyError, match="in the callback"):
        world.run(1.0, 0.01, callback=fail)
    with pytest.raises(ValueError, match="callback"):
        world.run(1.0, 0.01, callback=3)
    for seconds, dt in ((1.0, 0.0), (1.0, -1.0), (-1.0, 0.1), (NAN, 0.1), (INF, 0.1), (1, NAN)):
        with pytest.raises(ValueError):
            world.run(seconds, dt)


def test_progress_goes_to_stderr(capsys):
    world, _ = sliding_brick()
    world.run(0.05, 0.01)
    assert capsys.readouterr() == ("", "")
    world.run(0.05, 0.01, progress=True)
    out, err = capsys.readouterr()
    assert out == "" and err.splitlines()[-1] == "perp: step 5 of 5, t = 0.05"


def squeezed_ball(**settings):
    """A ball between two walls it touches, moving towards the one that asks for a bounce while the
    other holds it: unequal restitution at opposed contacts leaves no velocity."""
    world = perp.World(gravity=[0, 0], planar=True, **settings)
    world.ground.add_plane([0, 1], restitution=0.5)
    world.ground.add_plane([0, -1], -2.0, restitution=0.0)
    ball = world.add_body(position=[0, 1], velocity=[0, -1])
    ball.add_sphere(1.0)
    return world, ball


def test_where_no_step_exists_the_state_is_untouched():
    world, ball = squeezed_ball()
    before = world.snapshot()
    result = world.step(0.01)
    assert (result.outcome, result.ok, result.advanced) == ("ray", False, False)
    assert world.snapshot() == before
    np.testing.assert_array_equal(ball.velocity, [0, -1])
    run = world.run(1.0, 0.01)
    assert (run.outcome, run.ok, run.steps, run.stopped) == ("ray", False, 0, True)


def pile(**settings):
    """Discs of very unequal masses that hit each other: no active set is near at hand."""
    world = perp.World(planar=True, **settings)
    world.ground.add_plane([0, 1], friction=0.5)
    rng = np.random.default_rng(1)
    for i in range(5):
        for j in range(5):
            mass, velocity = 10.0 ** rng.uniform(-2, 2), rng.standard_normal(2)
            disc = world.add_body(mass, 0.1, position=[i, 0.5 + j], velocity=velocity)
            disc.add_sphere(0.5, friction=0.5)
    return world


def test_strict_worlds_do_not_advance_on_a_limit():
    result = pile(max_iterations=1).step(0.01)
    assert (result.ok, result.advanced) == (False, True)
    strict = pile(max_iterations=1, strict=True)
    before = strict.snapshot()
    result = strict.step(0.01)
    assert (result.outcome, result.advanced) == ("iteration_limit", False)
    assert strict.snapshot() == before


def test_snapshot_from_before_the_contacts_came():
    world = perp.World(friction=0.5)
    world.ground.add_plane([0, 0, 1], 0)
    box = world.add_body(position=[0, 0, 1])
    box.add_box([0.5, 0.5, 0.5])
    falling = world.snapshot()
    world.run(1.0, 0.01)
    resting, where = world.snapshot(), box.position
    world.restore(falling)
    assert world.time == 0.0 and box.position[2] == 1.0
    world.restore(resting)
    assert world.time == pytest.approx(1.0, abs=1e-12)  # 100 steps of 0.01, added up
    assert box.position.tolist() == where.tolist()
    for wrong in (b"", resting[:-1], bytes(len(resting))):
        with pytest.raises(perp.Error):
            world.restore(wrong)
    assert box.position.tolist() == where.tolist()


def test_snapshot_restores_every_bit():
    world, brick = sliding_brick()
    world.run(0.1, 0.01)
    saved = world.snapshot()
    assert isinstance(saved, bytes)
    world.run(0.1, 0.01)
    end = [brick.position, brick.velocity, brick.orientation]
    for blob in (saved, bytearray(saved), memoryview(saved)):
        world.restore(blob)
        assert world.snapshot() == saved
        world.run(0.1, 0.01)
        for a, b in zip(end, [brick.position, brick.velocity, brick.orientation]):
            np.testing.assert_array_equal(a, b)
    for wrong in (b"", saved[:-1], saved + b"?"):
        with pytest.raises(ValueError):
            world.restore(wrong)
    world.add_body()
    with pytest.raises(ValueError):
        world.restore(saved)


def test_steps_chosen_by_their_error():
    world = perp.World(friction=0.4, error=1e-9)
    world.ground.add_plane([0, 0, 1], 0)
    block = world.add_body(position=[0, 0, 0.1], velocity=[2, 0, 0])
    block.add_box([0.2, 0.2, 0.1])
    results = [world.step(0.1) for _ in range(10)]
    error = sum(result.error for result in results)
    assert max(result.steps for result in results) > 2
    # v^2 / (2 mu g); the estimates are of single steps
    assert abs(block.position[0] - 4 / (2 * 0.4 * 9.81)) <= 4 * error + 1e-12
    assert perp.World().step(0.1).steps == 1
    with pytest.raises(perp.Error):
        perp.World(error=-1)


def test_gravity_changes_and_wakes():
    world = perp.World(friction=0.5)
    world.ground.add_plane([0, 0, 1], 0)
    box = world.add_body(position=[0, 0, 0.1])
    box.add_box([0.1, 0.1, 0.1])
    world.run(0.1, 0.01)
    assert box.velocity.tolist() == [0, 0, 0]
    world.gravity = [0, 0, 2]
    assert world.gravity.tolist() == [0, 0, 2]
    world.run(1.0, 0.01)
    np.testing.assert_allclose(box.position, [0, 0, 1.1], atol=1e-12)  # t^2; 100 sums
    for wrong in ([0, 0], [0, 0, np.nan]):
        with pytest.raises(perp.Error):
            world.gravity = wrong
    assert world.gravity.tolist() == [0, 0, 2]


def test_two_worlds_same_bits():
    states = []
    for _ in range(2):
        world = pile()
        world.run(0.2, 0.01)
        states.append(np.array([body.position for body in world.bodies]))
    np.testing.assert_array_equal(*states)


def test_energy_and_momentum(world, planar):
    turn = quaternion([0, 0, 1], math.pi / 2)
    body = world.add_body(
        2.0, [2, 3, 4], [1, 0, 3], turn, velocity=[0, 5, 0], angular_velocity=[1, 0, 0]
    )
    # in the body's frame the turn is about -y: 3/2 * 1^2
    energy = world.energy()
    assert energy.kinetic == pytest.approx(0.5 * 2 * 25 + 0.5 * 3, rel=8 * EPS)
    assert energy.potential == pytest.approx(2 * 9.81 * 3, rel=8 * EPS)
    assert energy.total == energy.kinetic + energy.potential
    assert energy == (energy.kinetic, energy.potential)
    momentum = world.momentum()
    np.testing.assert_allclose(momentum.linear, [0, 10, 0], atol=8 * EPS)
    spin = np.array([3.0, 0, 0]) + np.cross([1, 0, 3], [0, 10, 0])
    np.testing.assert_allclose(momentum.angular, spin, atol=64 * EPS)
    planar.add_body(2.0, 3.0, position=[1, 2], velocity=[4, 5], angular_velocity=6)
    assert planar.energy().kinetic == pytest.approx(0.5 * 2 * 41 + 0.5 * 3 * 36, rel=8 * EPS)
    momentum = planar.momentum()
    np.testing.assert_allclose(momentum.linear, [8, 10])
    assert isinstance(momentum.angular, float)
    assert momentum.angular == pytest.approx(2 * (1 * 5 - 2 * 4) + 3 * 6, rel=8 * EPS)
    assert body.kind == "dynamic"


def test_threads():
    worlds = [perp.World(friction=0.5, threads=threads) for threads in (1, 2, 3)]
    for world in worlds:
        world.ground.add_plane([0, 0, 1])
        for k in range(150):
            world.add_body(1.0, position=[2 * (k // 3), 0.1 * (k % 3), 0.5 + k % 3]).add_box(
                [0.5, 0.5, 0.5]
            )
        for _ in range(3):
            world.step(0.01)
    for world in worlds[1:]:
        np.testing.assert_array_equal(
            [body.position for body in world.bodies], [body.position for body in worlds[0].bodies]
        )
    with pytest.raises(ValueError, match="threads"):
        perp.World(threads=257)


def rotation(q):
    w, x, y, z = q
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def overlap_of_boxes(place_a, A, half_a, place_b, B, half_b):
    """The least overlap along the axes of two boxes and the products of their edges."""
    axes = [*A.T, *B.T, *(np.cross(a, b) for a in A.T for b in B.T)]
    axes = [axis / np.linalg.norm(axis) for axis in axes if np.linalg.norm(axis) > 1e-6]
    return min(
        abs(A.T @ n) @ half_a + abs(B.T @ n) @ half_b - abs(n @ (place_b - place_a)) for n in axes
    )


@pytest.mark.parametrize("seed", [3, 4, 5, 28, 29, 32])
def test_overlaps_are_those_of_the_shapes(seed):
    """Chains of thin boxes fall on each other: no contact is deeper than its boxes overlap, by more
    than they could move in a step: what meets within it is told as it was at the start."""
    rng = np.random.default_rng(seed)
    world = perp.World(accuracy="fast")
    world.ground.add_plane((0, 0, 1), 0, friction=0.6)
    half = {}
    for k in range(14):
        base = np.array([*rng.uniform(-0.5, 0.5, 2), 0.6 + 0.55 * k])
        last = None
        for j in range(4):
            size = np.array([0.05, 0.15, 0.05]) * rng.uniform(0.8, 1.3, 3)
            mass = 8000 * size.prod()
            inertia = mass / 3 * (size @ size - size * size)
            body = world.add_body(mass, tuple(inertia), position=base + [0, 0.32 * j, 0])
            body.add_box(tuple(size), friction=0.6)
            half[body.index] = size
            if last is not None:
                world.add_joint("ball", last, body, anchor=base + [0, 0.32 * j - 0.16, 0])
            last = body
    for _ in range(220):
        place, turn = world.positions.copy(), world.orientations.copy()
        velocity, turning = world.velocities.copy(), world.angular_velocities.copy()
        world.step(0.01)
        for contact in world.contacts:
            bodies = [contact.body_a, contact.body_b]
            if contact.gap > -0.005 or world.ground in bodies:
                continue
            a, b = (body.index for body in bodies)
            overlap = overlap_of_boxes(
                place[a], rotation(turn[a]), half[a], place[b], rotation(turn[b]), half[b]
            )
            way = 0.01 * (
                np.linalg.norm(velocity[a] - velocity[b])
                + np.linalg.norm(turning[a]) * np.linalg.norm(half[a])
                + np.linalg.norm(turning[b]) * np.linalg.norm(half[b])
            )
            assert -contact.gap <= max(overlap, 0.0) + way
