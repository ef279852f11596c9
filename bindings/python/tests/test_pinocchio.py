"""perp.pinocchio against closed forms, and against Pinocchio where nothing touches."""

import subprocess
import sys

import numpy as np
import pytest

pin = pytest.importorskip("pinocchio")

import perp  # noqa: E402
import perp.pinocchio  # noqa: E402

G, H = 9.81, 1e-3
CORNERS = [[x, y, -0.05] for x in (-0.1, 0.1) for y in (-0.1, 0.1)]


def box(tangent=0.0, mass=2.0):
    """A free box of 0.2 x 0.2 x 0.1, gravity leaning."""
    model = pin.Model()
    joint = model.addJoint(0, pin.JointModelFreeFlyer(), pin.SE3.Identity(), "box")
    model.appendBodyToJoint(joint, pin.Inertia.FromBox(mass, 0.2, 0.2, 0.1), pin.SE3.Identity())
    model.addBodyFrame("box", joint, pin.SE3.Identity(), 0)
    angle = np.arctan(tangent)
    model.gravity.linear = G * np.array([np.sin(angle), 0.0, -np.cos(angle)])
    return model, model.getFrameId("box")


def run(stepper, q, v, steps, tau=None):
    states = []
    for _ in range(steps):
        q, v, how, *_ = stepper.step(q, v, tau)
        assert how.ok
        states.append((q, v))
    return states


def at(height):
    return np.array([0.0, 0.0, height, 0.0, 0.0, 0.0, 1.0])


def test_a_box_on_a_slope_rests():
    model, frame = box(0.5)
    ground = perp.pinocchio.Ground(model, [frame] * 4, CORNERS, 0.6)
    states = run(perp.pinocchio.Stepper(model, H, [ground]), at(0.055), np.zeros(6), 1000)
    assert all((v == 0.0).all() for _, v in states[-200:])
    assert all((q == states[-1][0]).all() for q, _ in states[-200:])


def test_a_box_on_a_steeper_slope_slides_along_coulombs_law():
    model, frame = box(0.8)
    ground = perp.pinocchio.Ground(model, [frame] * 4, CORNERS, 0.6)
    _, v = run(perp.pinocchio.Stepper(model, H, [ground]), at(0.05), np.zeros(6), 300)[-1]
    angle = np.arctan(0.8)
    expected = G * (np.sin(angle) - 0.6 * np.cos(angle)) * 0.3
    np.testing.assert_allclose(v, [expected, 0, 0, 0, 0, 0], atol=1e-6)  # tol h g a step


def test_impulses_carry_the_weight():
    model, frame = box()
    ground = perp.pinocchio.Ground(model, [frame] * 4, CORNERS, 0.6)
    step = perp.pinocchio.Stepper(model, H, [ground]).step(at(0.05), np.zeros(6))
    assert step.impulses.shape == (4, 3) and len(step.contacts[0].gaps) == 4
    np.testing.assert_allclose(step.impulses[:, 0].sum(), 2.0 * G * H, rtol=1e-7)


def arm():
    model = pin.buildSampleModelManipulator()
    return model, pin.neutral(model)


def test_where_nothing_touches_it_is_forward_dynamics():
    model, q = arm()
    rng = np.random.default_rng(2)
    model.lowerPositionLimit[:], model.upperPositionLimit[:] = -10.0, 10.0
    model.lowerDryFrictionLimit[:] = model.upperDryFrictionLimit[:] = 0.0
    model.damping[:] = 0.0
    v, tau = rng.normal(size=model.nv), rng.normal(size=model.nv)
    step = perp.pinocchio.Stepper(model, H).step(q, v, tau)
    data = model.createData()
    expected = v + H * pin.aba(model, data, q, v, tau)
    np.testing.assert_allclose(step.v, expected, rtol=1e-11, atol=1e-12)
    np.testing.assert_allclose(step.q, pin.integrate(model, q, H * step.v), atol=1e-15)


def test_joints_stop_at_their_limits():
    model, q = arm()
    model.lowerPositionLimit[:], model.upperPositionLimit[:] = -0.3, 0.3
    model.damping[:] = 2.0
    states = run(perp.pinocchio.Stepper(model, H), q + 0.2, np.zeros(model.nv), 3000)
    q, _ = states[-1]
    # the overlap that limits keep, and may leave
    assert np.abs(q).max() < 0.3 + 2e-4
    assert np.abs(q).max() > 0.29


def test_dry_friction_holds_up_to_its_bound():
    model, q = arm()
    model.gravity.linear = np.zeros(3)
    model.damping[:] = 0.0
    model.lowerDryFrictionLimit[:], model.upperDryFrictionLimit[:] = -0.5, 0.5
    tau = np.zeros(model.nv)
    tau[0] = 0.49
    stepper = perp.pinocchio.Stepper(model, H)
    states = run(stepper, q, np.zeros(model.nv), 20, tau)
    assert (states[-1][1] == 0.0).all() and (states[-1][0] == q).all()
    tau[0] = 0.6
    assert run(stepper, q, np.zeros(model.nv), 20, tau)[-1][1][0] > 0.0


def test_equations_hold():
    """The tip of an arm is tied to where it is, by a point."""
    model, q = arm()
    q = q + 0.3
    frame = model.nframes - 1
    data = model.createData()
    pin.framesForwardKinematics(model, data, q)
    hook = data.oMf[frame].translation.copy()

    def tied(model, data, q):
        J = pin.computeFrameJacobian(model, data, q, frame, pin.LOCAL_WORLD_ALIGNED)
        pin.updateFramePlacement(model, data, frame)
        return J[:3], data.oMf[frame].translation - hook

    model.lowerPositionLimit[:], model.upperPositionLimit[:] = -10.0, 10.0
    model.damping[:] = 1.0
    stepper = perp.pinocchio.Stepper(model, H, equations=tied)
    q, _ = run(stepper, q, np.zeros(model.nv), 1000)[-1]
    pin.framesForwardKinematics(model, data, q)
    # a step leaves h^2 v^2 of curvature, a fifth of which goes each step: speeds are below 3
    np.testing.assert_allclose(data.oMf[frame].translation, hook, atol=5 * 9 * H**2)


def test_geometries_touch():
    """A ball falls onto a box that is fixed to the world, and stays."""
    hppfcl = pytest.importorskip("coal")
    model = pin.Model()
    joint = model.addJoint(0, pin.JointModelFreeFlyer(), pin.SE3.Identity(), "ball")
    model.appendBodyToJoint(joint, pin.Inertia.FromSphere(1.0, 0.1), pin.SE3.Identity())
    geometry = pin.GeometryModel()
    floor = pin.GeometryObject("floor", 0, 0, pin.SE3.Identity(), hppfcl.Box(2.0, 2.0, 0.2))
    ball = pin.GeometryObject("ball", joint, 0, pin.SE3.Identity(), hppfcl.Sphere(0.1))
    geometry.addCollisionPair(
        pin.CollisionPair(geometry.addGeometryObject(floor), geometry.addGeometryObject(ball))
    )
    source = perp.pinocchio.Geometry(geometry, 0.5)
    q, v = run(perp.pinocchio.Stepper(model, H, [source]), at(0.25), np.zeros(6), 500)[-1]
    # it arrives at its gap, to what collision detection is worth
    np.testing.assert_allclose(q[:3], [0.0, 0.0, 0.2], atol=2e-4)
    np.testing.assert_allclose(v, 0.0, atol=1e-6)


def test_two_bodies_meet():
    """Both are moved: what they have in common of velocity is that of their momentum."""
    coal = pytest.importorskip("coal")
    model, geometry = pin.Model(), pin.GeometryModel()
    model.gravity.linear = np.zeros(3)
    balls = []
    for k, mass in enumerate((1.0, 3.0)):
        joint = model.addJoint(0, pin.JointModelFreeFlyer(), pin.SE3.Identity(), str(k))
        model.appendBodyToJoint(joint, pin.Inertia.FromSphere(mass, 0.1), pin.SE3.Identity())
        ball = pin.GeometryObject(str(k), joint, 0, pin.SE3.Identity(), coal.Sphere(0.1))
        balls.append(geometry.addGeometryObject(ball))
    geometry.addCollisionPair(pin.CollisionPair(*balls))
    stepper = perp.pinocchio.Stepper(model, H, [perp.pinocchio.Geometry(geometry, 0.5)])
    q, v = pin.neutral(model), np.zeros(12)
    q[0], q[7], v[0], v[6] = -0.15, 0.15, 2.0, -1.0
    q, v = run(stepper, q, v, 100)[-1]
    np.testing.assert_allclose(v[[0, 6]], (1.0 * 2.0 - 3.0 * 1.0) / 4.0, atol=1e-7)
    np.testing.assert_allclose(q[7] - q[0], 0.2, atol=1e-6)


def test_a_humanoid_on_its_soles():
    """Pinocchio's own model, its joints held by springs: no foot slips or sinks."""
    model = pin.buildSampleModelHumanoid()
    q = pin.neutral(model)
    soles = [model.getFrameId(side + "leg_effector_body") for side in "rl"]
    data = model.createData()
    pin.framesForwardKinematics(model, data, q)
    low = min(data.oMf[k].translation[2] for k in soles)
    corners = [[x, y, 0.0] for x in (-0.3, 0.3) for y in (-0.1, 0.1)]
    ground = perp.pinocchio.Ground(
        model, [k for k in soles for _ in corners], corners * 2, 0.8, height=low
    )
    stepper = perp.pinocchio.Stepper(model, H, [ground])
    model.damping[6:] = 100.0
    v = np.zeros(model.nv)
    for _ in range(300):
        tau = np.zeros(model.nv)
        tau[6:] = -1000.0 * pin.difference(model, pin.neutral(model), q)[6:]
        q, v, how, *_ = stepper.step(q, v, tau)
        assert how.ok and how.residual <= 1e-8
    pin.framesForwardKinematics(model, data, q)
    for k in soles:
        assert data.oMf[k].translation[2] > low - 0.01


def test_misuse_is_refused():
    model, frame = box()
    with pytest.raises(ValueError, match="places"):
        perp.pinocchio.Ground(model, [frame], CORNERS)
    stepper = perp.pinocchio.Stepper(model, H)
    with pytest.raises(ValueError, match="v has shape"):
        stepper.step(at(1.0), np.zeros(7))


def test_without_pinocchio_it_says_what_to_install():
    program = (
        "import sys; sys.modules['pinocchio'] = None\n"
        "try:\n    import perp.pinocchio\nexcept ImportError as error:\n    print(error)"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    )
    assert "pip install 'perp[pinocchio]'" in done.stdout
