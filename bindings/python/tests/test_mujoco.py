"""perp.mujoco against closed forms, and against MuJoCo where nothing touches."""

import os
import subprocess
import sys

import numpy as np
import pytest

mujoco = pytest.importorskip("mujoco")

import perp  # noqa: E402
import perp._mujoco_model  # noqa: E402
import perp._stepper  # noqa: E402
import perp.mujoco  # noqa: E402

G = 9.81


def scene(body, options="", rest=""):
    model = mujoco.MjModel.from_xml_string(
        f'<mujoco><option timestep="0.002" {options}/><worldbody>{body}</worldbody>{rest}</mujoco>'
    )
    return model, mujoco.MjData(model)


def slope(tangent, geom, floor="", start="0 0 .05", options=""):
    """A body on a plane: gravity leans, not the plane, so that the plane's frame is the world's."""
    angle = np.arctan(tangent)
    gravity = f"{G * np.sin(angle)} 0 {-G * np.cos(angle)}"
    return scene(
        f'<geom type="plane" size="5 5 .1" {floor}/>'
        f'<body pos="{start}"><freejoint/><geom {geom}/></body>',
        f'gravity="{gravity}" {options}',
    )


BOX = 'type="box" size=".1 .1 .05" friction="{mu}"'
BALL = 'type="sphere" size=".1" condim="{dim}" friction="1 {spin} {roll}"'


def test_a_box_on_a_slope_rests():
    model, data = slope(0.5, BOX.format(mu=0.6), 'friction=".6"', "0 0 .055")
    run = perp.mujoco.simulate(model, data, 1.0)
    assert run.ok
    assert (run.qvel[-100:] == 0.0).all()  # not small: 0.0
    assert (run.qpos[-100:] == run.qpos[-1]).all()
    # it fell 5 mm, and slid until friction had taken what gravity gave it: 0.05 s of free fall at
    # most, so less than 0.5 g 0.05^2 = 12 mm
    assert abs(run.qpos[-1, 0]) < 0.012 and abs(run.qpos[-1, 1]) < 1e-9


def test_a_box_on_a_steeper_slope_slides_along_coulombs_law():
    model, data = slope(0.8, BOX.format(mu=0.6), 'friction=".6"', "0 0 .04999")
    run = perp.mujoco.simulate(model, data, 0.5)
    angle = np.arctan(0.8)
    a = G * (np.sin(angle) - 0.6 * np.cos(angle))
    assert run.ok
    # every step adds h a, to tol of h g
    np.testing.assert_allclose(run.qvel[1:, 0], a * run.times[1:], rtol=1e-6)
    np.testing.assert_allclose(run.qvel[:, 1:], 0.0, atol=1e-7)


@pytest.mark.parametrize("axis, mu", [(0, 0.3), (1, 0.6)])
def test_friction_may_depend_on_the_direction(axis, mu):
    model, data = scene(
        '<geom name="floor" type="plane" size="5 5 .1"/>'
        '<body pos="0 0 .04999"><freejoint/><geom name="box" type="box" size=".1 .1 .05"/></body>',
        rest='<contact><pair geom1="floor" geom2="box" condim="3" '
        'friction=".3 .6 0 0 0"/></contact>',
    )
    perp.mujoco.step(model, data)
    first, second = data.contact.frame[0].reshape(3, 3)[1:]
    direction = (first, second)[axis]
    data.qvel[:3] = 2.0 * direction
    run = perp.mujoco.simulate(model, data, 0.1)
    expected = 2.0 - mu * G * (run.times - run.times[0])
    assert run.ok
    np.testing.assert_allclose(run.qvel[:, :3] @ direction, expected, rtol=1e-6)


@pytest.mark.parametrize("tangent, rolls", [(0.04, False), (0.06, True)])
def test_a_ball_rolls_where_rolling_friction_gives_way(tangent, rolls):
    """It holds up to tan(slope) = coefficient / radius, here 0.005 / 0.1."""
    model, data = slope(tangent, BALL.format(dim=6, spin=0.01, roll=0.005), start="0 0 .0999999")
    run = perp.mujoco.simulate(model, data, 0.5)
    assert run.ok
    if not rolls:
        assert (run.qvel[-100:] == 0.0).all()
        return
    angle = np.arctan(tangent)
    # m a = m g sin - F,   I a / R = F R - 0.005 m g cos,   I = 2/5 m R^2
    a = G * (np.sin(angle) - 0.05 * np.cos(angle)) / 1.4
    np.testing.assert_allclose(run.qvel[-1, 0], a * 0.5, rtol=1e-5)


@pytest.mark.parametrize("dim", [4, 6])
def test_a_spinning_ball_is_braked(dim):
    model, data = slope(0.0, BALL.format(dim=dim, spin=0.005, roll=0.0002), start="0 0 .09999")
    data.qvel[5] = 10.0
    run = perp.mujoco.simulate(model, data, 0.25)
    # I w' = -0.005 m g,   I = 2/5 m R^2: to rest at 0.815 s
    assert run.ok
    np.testing.assert_allclose(run.qvel[:, 5], 10.0 - 0.005 * G / 0.004 * run.times, rtol=1e-6)
    run = perp.mujoco.simulate(model, data, 0.75)
    assert (run.qvel[-50:] == 0.0).all()


ARM = """
<body><joint name="a" type="hinge" axis="0 1 0" {a}/><geom type="capsule" size=".03" fromto="0 0 0 .5 0 0"/>
  <body pos=".5 0 0"><joint name="b" type="hinge" axis="0 1 0" {b}/>
    <geom type="capsule" size=".02" fromto="0 0 0 .3 0 .1"/></body></body>
"""


@pytest.mark.parametrize("integrator", ["Euler", "implicitfast"])
def test_where_nothing_touches_it_is_mujoco(integrator):
    """Damping, servos with velocity gains and activations are integrated as MuJoCo does."""
    rest = (
        '<actuator><position joint="a" kp="20" kv="3"/><velocity joint="b" kv="2"/>'
        '<general joint="b" dyntype="filter" dynprm="0.1" gainprm="4"/></actuator>'
    )
    model, data = scene(
        ARM.format(a='damping="0.5"', b='damping="0.1" stiffness="2"'),
        f'integrator="{integrator}"',
        rest,
    )
    other = mujoco.MjData(model)
    for k in range(300):
        data.ctrl[:] = other.ctrl[:] = np.sin(0.1 * k), 0.5, 1.0
        assert perp.mujoco.step(model, data).ok
        mujoco.mj_step(model, other)
    # 300 steps of rounding, which a double pendulum amplifies tenfold a second
    np.testing.assert_allclose(data.qpos, other.qpos, atol=1e-11)
    np.testing.assert_allclose(data.qvel, other.qvel, atol=1e-10)
    np.testing.assert_allclose(data.act, other.act, atol=1e-14)
    assert data.time == other.time


def test_a_joint_stops_at_its_limit():
    model, data = scene(
        ARM.format(a='limited="true" range="-180 30"', b='range="-20 20" damping=".2"')
    )
    run = perp.mujoco.simulate(model, data, 3.0)
    assert run.ok
    assert (run.qvel[-100:] == 0.0).all()
    # within the slop it keeps, a thousandth of the mean size, and what it may leave of an overlap
    assert 0.0 <= run.qpos[-1, 0] - np.radians(30.0) <= 2e-3 * model.stat.meansize


def test_dry_friction_of_a_joint_holds_up_to_its_bound():
    wheel = '<body><joint type="hinge" axis="0 0 1" frictionloss="0.5"/><geom type="sphere" size=".1"/></body>'
    model, data = scene(wheel)
    inertia = model.body_inertia[1, 2]
    data.qfrc_applied[0] = 0.499
    run = perp.mujoco.simulate(model, data, 0.1)
    assert run.ok and (run.qvel == 0.0).all()
    data.qfrc_applied[0] = 0.75
    run = perp.mujoco.simulate(model, data, 0.1)
    np.testing.assert_allclose(run.qvel[-1, 0], 0.25 / inertia * 0.1, rtol=1e-8)


def test_equations_hold_and_do_not_drift():
    """A chain whose end is tied to the world, a few millimetres off: a fifth of that goes a step."""
    model, data = scene(
        ARM.format(a="", b="")
        .replace('type="capsule" size=".02"', 'name="tip" type="capsule" size=".02"')
        .replace("</body></body>", '<site name="end" pos=".3 0 .1"/></body></body>')
        + '<site name="hook" pos=".8 0 .1"/>',
        rest='<equality><connect site1="end" site2="hook"/></equality>',
    )
    data.qpos[:] = 0.003, -0.002
    run = perp.mujoco.simulate(model, data, 2.0)
    assert run.ok
    np.testing.assert_allclose(data.site("end").xpos, data.site("hook").xpos, atol=1e-9)
    assert np.abs(data.qvel).max() < 1e-9


def test_a_tendon_stops_at_its_limit():
    model, data = scene(
        ARM.format(a='damping=".1"', b='damping=".1"'),
        rest='<tendon><fixed limited="true" range="-1 .4"><joint joint="a" coef="1"/>'
        '<joint joint="b" coef=".5"/></fixed></tendon>',
    )
    run = perp.mujoco.simulate(model, data, 1.0)
    assert run.ok
    lengths = run.qpos @ [1.0, 0.5]
    # found a step late: h times the fastest length's speed
    assert lengths.max() <= 0.4 + 0.002 * np.abs(run.qvel @ [1.0, 0.5]).max() + 1e-3


def test_forces_are_those_that_mujoco_reads():
    model, data = slope(
        0.5, BOX.format(mu=0.6) + ' mass="2"', 'friction=".6"', "0 0 .04999", 'cone="pyramidal"'
    )
    for _ in range(50):
        perp.mujoco.step(model, data)
    weight, force, wrench = np.zeros(3), np.zeros(3), np.zeros(6)
    for k in range(data.ncon):
        wrench[:] = perp.mujoco.contact_force(model, data, k)
        force += data.contact.frame[k].reshape(3, 3).T @ wrench[:3]
    weight[:] = 2.0 * model.opt.gravity
    np.testing.assert_allclose(force, -weight, atol=1e-6 * G)  # tol of 1e-8 a step, a few rows
    np.testing.assert_allclose(data.qfrc_constraint[:3], -weight, atol=1e-6 * G)
    np.testing.assert_array_equal(data.qacc, 0.0)


def test_a_touch_sensor_feels_the_weight():
    model, data = scene(
        '<geom type="plane" size="1 1 .1"/><body pos="0 0 .04999"><freejoint/>'
        '<geom type="box" size=".1 .1 .05" mass="2"/><site name="s" type="box" size=".2 .2 .1"/></body>',
        rest='<sensor><touch site="s"/></sensor>',
    )
    for _ in range(20):
        perp.mujoco.step(model, data)
    np.testing.assert_allclose(data.sensordata[0], 2.0 * G, rtol=1e-6)


def test_overlaps_go_away_without_a_bounce():
    model, data = slope(0.0, BOX.format(mu=0.6), start="0 0 .03")  # 2 cm deep
    run = perp.mujoco.simulate(model, data, 1.0)
    assert run.ok
    assert np.abs(run.qvel).max() < 1e-7  # no velocity was made of it
    slop = 1e-3 * model.stat.meansize
    assert -2.0 * slop <= run.qpos[-1, 2] - 0.05 <= 0.0


def test_contacts_within_the_margin_do_not_overlap():
    """A gap that the step would close is left for the next: the body arrives, no deeper."""
    model, data = slope(0.0, BOX.format(mu=0.6) + ' margin=".05"', start="0 0 .3")
    run = perp.mujoco.simulate(model, data, 0.5)
    assert run.ok
    assert run.qpos[:, 2].min() >= 0.05 - 1e-9
    assert (run.qvel[-20:] == 0.0).all()


GRIP = """
<body name="left" pos="-.0401 0 .5">
  <geom type="box" size=".01 .03 .03" mass=".1" friction="1"/></body>
<body name="right" pos=".06 0 .5"><joint name="r" type="slide" axis="-1 0 0"/>
  <geom type="box" size=".01 .03 .03" mass=".1" friction="1"/></body>
<body pos="0 0 .5"><freejoint/><geom type="box" size=".03 .03 .03" mass=".2" friction="1"/></body>
"""
FINGERS = '<actuator><motor joint="r"/></actuator>'


def test_a_gripped_object_does_not_slip():
    model, data = scene(GRIP, rest=FINGERS)
    model.opt.gravity[:] = 0.0
    data.ctrl[:] = 5.0  # two sides hold up to 10 N; the box weighs 1.96 N
    perp.mujoco.simulate(model, data, 0.3)
    model.opt.gravity[2] = -G
    run = perp.mujoco.simulate(model, data, 1.0)
    assert run.ok
    assert (run.qvel[-400:] == 0.0).all()
    assert (run.qpos[-400:] == run.qpos[-1]).all()


def test_a_long_robot_rests_by_dry_friction():
    """A chain of 18 velocities, more than the blocks whose zeros the library finds."""
    link = (
        '<body pos=".2 0 0"><joint type="hinge" axis="0 1 0" frictionloss="3"/>'
        '<geom type="box" size=".09 .03 .03" pos=".1 0 0" mass=".1"/>'
    )
    head = '<body pos="0 0 .031"><freejoint/><geom type="box" size=".09 .03 .03" pos=".1 0 0" mass=".1"/>'
    chain = head + 12 * link + 13 * "</body>"
    model, data = scene(f'<geom type="plane" size="9 9 .1"/>{chain}', 'gravity="2 0 -9.6"')
    run = perp.mujoco.simulate(model, data, 1.0)
    assert model.nv == 18 and run.ok
    assert (run.qvel[-100:] == 0.0).all() and (run.qpos[-100:] == run.qpos[-1]).all()


def test_rest_is_the_same_computed_again(monkeypatch):
    """What is at rest is not solved again, and gives the bits that solving gives."""
    runs, solved = [], []
    run = perp._stepper.RowSolver.run
    for again in (False, True):
        count = []

        def counted(solver, one, again=again, count=count):
            solver.numbers.rests &= not again
            how = run(solver, one)
            count.append(not solver.numbers.was_known)
            return how

        monkeypatch.setattr(perp._stepper.RowSolver, "run", counted)
        model, data = slope(0.5, BOX.format(mu=0.6), 'friction=".6"', "0 0 .055")

        def push(model, data):
            data.xfrc_applied[1, 0] = 5.0 if 0.5 < data.time < 0.6 else 0.0

        runs.append(perp.mujoco.simulate(model, data, 1.0, push))
        solved.append(sum(count))
    assert solved[0] < 0.5 * solved[1]
    assert (np.abs(runs[0].qvel[250:320]) > 1e-3).any() and (runs[0].qvel[-50:] == 0.0).all()
    np.testing.assert_array_equal(runs[0].qpos, runs[1].qpos)
    np.testing.assert_array_equal(runs[0].qvel, runs[1].qvel)


def boxes(count):
    rng = np.random.default_rng(5)
    body = (
        '<body pos="{} {} {}"><freejoint/><geom type="box" size=".1 .1 .1" friction=".5"/></body>'
    )
    return '<geom type="plane" size="9 9 .1"/>' + "".join(
        body.format(0.5 * (k % 5), 0.5 * (k // 5 % 5), 0.0999 + 0.1998 * (k // 25))
        for k in range(count)
    ), rng.normal(size=6 * count)


def test_sparse_and_dense_are_the_same(monkeypatch):
    body, speeds = boxes(25)
    runs = []
    for most in (0, 1000):
        monkeypatch.setattr(perp._mujoco_model, "DENSE", most)
        model, data = scene(body)
        data.qvel[:] = 0.2 * speeds
        runs.append(perp.mujoco.simulate(model, data, 0.3))
        assert runs[-1].ok
    assert model.nv == 150
    # 150 steps at tol 1e-8, velocities near 1
    np.testing.assert_allclose(runs[0].qpos, runs[1].qpos, atol=1e-5)


def test_many_boxes_on_a_slope_rest():
    """So many that the default is sparse."""
    body, _ = boxes(30)
    model, data = scene(body, 'gravity="3 0 -9.4"')
    data.qvel[:] = 0.1  # they slide to rest first
    run = perp.mujoco.simulate(model, data, 1.5)
    assert model.nv > perp._mujoco_model.DENSE and run.ok
    assert (run.qvel[-100:] == 0.0).all()


def test_what_moves_nothing_is_left_out():
    """A planar finger beside a wall that it can't move against: no refusal."""
    model, data = scene(
        '<geom type="plane" size="5 5 .1"/><body pos="0 0 .04999"><joint type="slide" axis="1 0 0"/>'
        '<geom type="box" size=".1 .1 .05"/></body>'
    )
    data.qvel[0] = 1.0
    run = perp.mujoco.simulate(model, data, 0.1)
    assert run.ok and (run.qvel == 1.0).all()


def test_what_moved_nothing_is_taken_up_where_it_does():
    """A pendulum whose ball touches the ground right below its joint, where no normal impulse moves
    it; put aside, with the ball still in the ground, gravity may not bring it back."""
    model, data = scene(
        '<geom type="plane" size="5 5 .1"/><body pos="0 0 1"><joint type="hinge" axis="0 1 0"/>'
        '<geom size=".1" pos="0 0 -.905" condim="1"/></body>'
    )
    model.geom_condim[:] = 1
    stepper = perp.mujoco.Stepper(model)
    assert stepper.step(data).ok and data.ncon == 1
    assert not data.efc_force.any()
    data.qpos[0], data.qvel[0] = 0.05, 0.0
    assert stepper.step(data).ok and data.ncon == 1
    assert data.qvel[0] == 0.0 and data.efc_force[0] > 0.0


def test_contacts_without_rows_are_left_out():
    """A ball that can't move against the ground, first in it, then just touching: MuJoCo knows of
    that contact and makes no row at all."""
    model, data = scene(
        '<geom type="plane" size="5 5 .1"/>'
        '<body pos="0 0 .499"><joint type="slide" axis="1 0 0"/><geom size=".5"/></body>'
    )
    stepper = perp.mujoco.Stepper(model)
    data.qvel[0] = 1.0
    assert stepper.step(data).ok and data.nefc > 0
    model.body_pos[1, 2] = 0.5
    assert stepper.step(data).ok and data.ncon == 1 and data.nefc == 0
    assert data.qvel[0] == 1.0


def test_robots_of_parts_that_overlap_come_apart():
    """A slider between two walls 5 mm too near for it goes to the middle, 1 mm from it."""
    model, data = scene(
        '<geom type="box" pos=".145 0 0" size=".05 1 1"/>'
        '<geom type="box" pos="-.145 0 0" size=".05 1 1"/>'
        '<body><joint type="slide" axis="1 0 0"/><geom size=".1"/></body>',
        'gravity="0 0 0"',
    )
    data.qpos[0] = 1e-3
    assert perp.mujoco.simulate(model, data, 0.2).ok
    assert data.ncon == 2 and abs(data.qpos[0]) < 1e-4


def test_nothing_is_made_for_solvers_of_mujocos_own():
    """Islands, and the matrix that PGS and noslip work on, are asked for by nobody: a step has the
    bits that it has where the model does not name them, and the model is as it was."""
    ends = []
    for options in ("", 'solver="PGS" noslip_iterations="5"'):
        model, data = slope(0.3, BOX.format(mu=0.6), start="0 0 .049", options=options)
        kept = model.opt.solver, model.opt.noslip_iterations, model.opt.disableflags
        for _ in range(20):
            assert perp.mujoco.step(model, data).ok
        assert kept == (model.opt.solver, model.opt.noslip_iterations, model.opt.disableflags)
        assert getattr(data, "nisland", 0) == 0 and getattr(data, "nA", 0) == 0
        ends.append(np.concatenate([data.qpos, data.qvel]))
    assert (ends[0] == ends[1]).all()


@pytest.mark.parametrize("seed", range(4))
def test_what_takes_overlaps_away_does_not_depend_on_the_last_step(seed):
    """It begins with the impulses of contacts that last while others come and go; the velocity is
    unique, and that of a stepper which knows nothing, to tol of the fastest."""
    rng = np.random.default_rng(seed)
    balls = "".join(
        f'<body pos="{x:.4f} {y:.4f} {z:.4f}"><freejoint/><geom size=".05"/></body>'
        for x, y, z in rng.uniform((-0.1, -0.1, 0.03), (0.1, 0.1, 0.2), (9, 3))
    )
    model, data = scene(f'<geom type="plane" size="1 1 1"/>{balls}')
    other, stepper = mujoco.MjData(model), perp.mujoco.Stepper(model)
    counts = set()
    for _ in range(60):
        mujoco.mj_copyData(other, model, data)
        fresh = perp.mujoco.Stepper(model)
        assert fresh.step(other).ok and stepper.step(data).ok
        counts.add(data.ncon)
        here, there = stepper.solver.shift, fresh.solver.shift
        assert (here is None) == (there is None)
        if here is not None:
            fastest = np.abs(there).max()
            assert here == pytest.approx(there, rel=0.0, abs=1e-7 * fastest)
    assert len(counts) > 2


LEG = """
<body pos="{x:.3f} {y:.3f} 0"><geom size=".02" mass=".1"/><body>
  <joint name="x{k}" axis="1 0 0" limited="true" range="-60 60"/>
  <joint name="y{k}" axis="0 1 0" limited="true" range="-60 60"/>
  <joint name="z{k}" axis="0 0 1" limited="true" range="-60 60"/>
  <geom type="capsule" size="{radius:.3f}" fromto="0 0 .05 0 0 -.3"/>
  <body pos="0 0 -.35"><joint name="k{k}" axis="0 1 0" limited="true" range="-1 120"/>
    <geom type="capsule" size=".03" fromto="0 0 0 0 0 -.25"/></body></body></body>
"""


@pytest.mark.parametrize("seed", range(6))
def test_links_that_overlap_beside_their_hinges_keep_their_limits(seed):
    """Legs are modelled into a trunk that no angle of their hips takes them out of: joints stay
    within their limits, but for a step's turn of the correction and one of the torques."""
    rng = np.random.default_rng(seed)
    quarters = (1, 1), (1, -1), (-1, 1), (-1, -1)
    places = [(x * rng.uniform(0.03, 0.1), y * rng.uniform(0.03, 0.1)) for x, y in quarters]
    radii = [rng.uniform(0.02, 0.06) for _ in places]
    legs = [LEG.format(k=k, x=places[k][0], y=places[k][1], radius=radii[k]) for k in range(4)]
    motors = [f'<motor joint="{axis}{k}" gear="3"/>' for k in range(4) for axis in "xyzk"]
    model, data = scene(
        '<geom type="plane" size="3 3 1"/><body pos="0 0 .8"><freejoint/>'
        f'<geom type="capsule" size=".1" fromto="0 -.12 0 0 .12 0" mass="5"/>{"".join(legs)}</body>',
        rest=f"<actuator>{''.join(motors)}</actuator>",
    )
    low, high = model.jnt_range[1:].T
    for k in range(300):
        if k % 50 == 0:
            data.ctrl[:] = rng.uniform(-1.0, 1.0, model.nu)
        perp.mujoco.step(model, data)
        place = data.qpos[7:]
        assert np.maximum(low - place, place - high).max() <= 2.0 * 0.2
    assert data.time == pytest.approx(0.6)  # nothing was reset


def test_step_keeps_its_solver_and_says_how_it_ended():
    model, data = slope(0.5, BOX.format(mu=0.6), start="0 0 .04999")
    first = perp.mujoco.step(model, data)
    assert first.ok and first.outcome == "solved" and first.residual <= 1e-8
    perp.mujoco.step(model, data)  # looks for impulses inside the cones
    again = perp.mujoco.step(model, data)
    assert again.method == "polish"  # the last impulses were the answer
    worse = perp.mujoco.step(model, data, tol=1e-4)
    assert worse.ok
    with pytest.raises(ValueError, match="tol"):
        perp.mujoco.step(model, data, tol=-1.0)


def test_what_touches_already_keeps_its_impulses(monkeypatch):
    """A box stands, another one lands: the first one's impulses are where the step starts."""
    model, data = scene(
        '<geom type="plane" size="9 9 .1"/>'
        '<body pos="0 0 .3"><freejoint/><geom type="box" size=".1 .1 .1"/></body>'
        '<body pos="1 0 .0999"><freejoint/><geom type="box" size=".1 .1 .1"/></body>'
    )
    monkeypatch.setattr(
        perp.mujoco.Runner, "can_end", lambda *_: False
    )  # a call of Python's a step
    stepper, starts = perp.mujoco.Stepper(model), []
    solver, step = stepper.solver, stepper.solver.step
    monkeypatch.setattr(solver, "step", lambda w: starts.append(solver.start.copy()) or step(w))
    while data.ncon <= 4:
        before = solver.r.copy()
        stepper.step(data)
    landed = starts[-1]
    assert len(before) == 12 and before[0] > 0.0
    np.testing.assert_array_equal(landed, np.concatenate([np.zeros(len(landed) - 12), before]))


def test_control_is_called_each_step():
    model, data = scene(GRIP, rest=FINGERS)
    calls = []
    run = perp.mujoco.simulate(model, data, 0.02, lambda m, d: calls.append(d.time), every=5)
    assert len(calls) == 10 and len(run.times) == 3
    assert sum(run.outcomes.values()) == 10


def test_view_steps_until_its_window_is_closed(monkeypatch):
    import mujoco.viewer

    class Window:
        shown = 0

        def __enter__(self):
            return self

        def __exit__(self, *_):
            pass

        def lock(self):
            return self

        def is_running(self):
            return self.shown < 5

        def sync(self):
            self.shown += 1

    window = Window()
    monkeypatch.setattr(mujoco.viewer, "launch_passive", lambda *_: window)
    model, data = scene(GRIP, rest=FINGERS)
    perp.mujoco.view(model, data)
    assert window.shown == 5 and data.time == pytest.approx(0.01)


def test_without_mujoco_it_says_what_to_install():
    program = (
        "import sys; sys.modules['mujoco'] = None\n"
        "try:\n    import perp.mujoco\nexcept ImportError as error:\n    print(error)"
    )
    out = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    )
    assert "pip install 'perp[mujoco]'" in out.stdout


def test_what_a_process_finds_once_is_found_before_its_first_step():
    program = (
        "import functools, mujoco, perp.mujoco\n"
        "from perp import _mujoco_model, _mujoco_run\n"
        "both = vars(_mujoco_model) | vars(_mujoco_run)\n"
        "once = [x for x in both.values() if isinstance(x, functools._lru_cache_wrapper)]\n"
        "model = mujoco.MjModel.from_xml_string('<mujoco><worldbody><body><freejoint/>'\n"
        "    '<geom size=\".1\"/></body></worldbody></mujoco>')\n"
        "stepper, found = perp.mujoco.Stepper(model), [x.cache_info().misses for x in once]\n"
        "stepper.step(mujoco.MjData(model))\n"
        "print(len(once), found == [x.cache_info().misses for x in once])"
    )
    out = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    )
    assert out.stdout == "4 True\n"


def test_a_look_for_rest_ends_where_it_is_no_use(monkeypatch):
    """An ant that stumbles: some looks have no answer, and go through a few methods."""
    gymnasium = pytest.importorskip("gymnasium")
    folder = os.path.join(os.path.dirname(gymnasium.__file__), "envs", "mujoco", "assets")
    model = mujoco.MjModel.from_xml_path(os.path.join(folder, "ant.xml"))
    solve_by, looks = perp._stepper.RowSolver.solve_by, []

    def watched(solver, *arguments):
        looks.append(solve_by(solver, *arguments))
        return looks[-1]

    monkeypatch.setattr(perp._stepper.RowSolver, "solve_by", watched)
    stepper, data = perp.mujoco.Stepper(model), mujoco.MjData(model)
    controls = np.random.default_rng(1).uniform(-1.0, 1.0, (20, model.nu))
    for control in np.repeat(controls, 50, axis=0):
        data.ctrl[:] = control
        assert stepper.step(data).ok
    assert looks and max(how.iterations for how in looks) <= 3 * 4 * perp._stepper._PATIENCE
