"""Bounces, moving surfaces and adhesion in perp.mujoco: closed forms."""

import numpy as np
import pytest

mujoco = pytest.importorskip("mujoco")

import perp.mujoco  # noqa: E402

NEW = tuple(map(int, mujoco.__version__.split(".")[:2])) >= (4, 0)
G = 9.81
STATE = int(mujoco.mjtState.mjSTATE_FULLPHYSICS)


def load(body, option=""):
    return mujoco.MjModel.from_xml_string(
        f'<mujoco><option timestep=".001" {option}/><worldbody>{body}</worldbody></mujoco>'
    )


def ball(height=1.1):
    return load(
        '<geom type="plane" size="5 5 .1"/>'
        f'<body pos="0 0 {height}"><freejoint/><geom size=".1"/></body>'
    )


def told(model, name):
    return {one.name: one.treatment for one in perp.mujoco.check(model)}.get(name)


@pytest.mark.parametrize("e", [0.0, 0.5, 0.9, 1.0])
def test_a_ball_bounces_to_e_squared_of_its_height(e):
    model = ball()
    data = mujoco.MjData(model)
    run = perp.mujoco.simulate(model, data, 1.0, restitution=e)
    assert run.ok
    hit = int(np.argmax(run.qpos[:, 2] < 0.1))
    speed = np.sqrt(2.0 * G)
    # found in the floor a step late, with up to h g more speed
    assert run.qvel[hit + 1, 2] == pytest.approx(e * speed, abs=2.0 * 0.001 * G)
    top = run.qpos[hit:, 2].max() - 0.1
    assert top == pytest.approx(e * e, abs=0.001 * speed + 0.001)


def test_what_bounces_comes_to_rest():
    model = ball(0.2)
    run = perp.mujoco.simulate(model, mujoco.MjData(model), 3.0, restitution=0.5)
    assert run.ok and (run.qvel[-100:] == 0.0).all()


def test_runs_bounce_as_steps_do():
    model = ball()
    data, start = mujoco.MjData(model), np.zeros(mujoco.mj_stateSize(model, STATE))
    mujoco.mj_getState(model, data, start, STATE)
    run = perp.mujoco.rollout(model, start, steps=900, restitution=0.8)
    stepper = perp.mujoco.Stepper(model, restitution=0.8)
    for k in range(900):
        stepper.step(data)
        np.testing.assert_array_equal(run.states[0, k, 1:8], data.qpos)


def test_restitution_is_checked():
    with pytest.raises(ValueError, match="restitution is 2"):
        perp.mujoco.Stepper(ball(), restitution=2.0)


BOX = '<body pos="{} 0 {}"><freejoint/><geom type="{}" size="{}" {}/></body>'


@pytest.mark.skipif(not NEW, reason="MuJoCo 4 has surfacevel")
def test_a_conveyor_drives_what_lies_on_it():
    """Friction mu g until it has the belt's speed, then none at all."""
    model = load(
        '<geom type="box" size="9 9 .1" pos="0 0 -.1" surfacevel="1 .5 0 0 0 0" friction=".3"/>'
        + BOX.format(0, 0.04999, "box", ".1 .1 .05", 'friction=".3"')
    )
    assert told(model, "geom surfacevel") == "exact instead of soft"
    run = perp.mujoco.simulate(model, mujoco.MjData(model), 0.6)
    assert run.ok
    belt, speeds = np.array([1.0, 0.5]), np.linalg.norm(run.qvel[:, :2], axis=1)
    expected = np.minimum(0.3 * G * run.times, np.linalg.norm(belt))
    np.testing.assert_allclose(speeds, expected, atol=1e-6)
    np.testing.assert_allclose(run.qvel[-100:, :2], np.tile(belt, (100, 1)), atol=1e-9)
    theirs = mujoco.MjData(model)
    for _ in range(600):
        mujoco.mj_step(model, theirs)
    np.testing.assert_allclose(theirs.qvel[:2], belt, atol=1e-3)  # the same direction


@pytest.mark.skipif(not NEW, reason="MuJoCo 4 has surfacevel")
def test_a_turntable_turns_what_stands_on_it():
    model = load(
        '<geom type="cylinder" size="1 .1" pos="0 0 -.1" surfacevel="0 0 0 0 0 2" condim="4"/>'
        + BOX.format(0.01, 0.0499, "cylinder", ".1 .05", 'condim="4"')
    )
    data = mujoco.MjData(model)
    assert perp.mujoco.simulate(model, data, 1.0).ok
    np.testing.assert_allclose(data.qvel[5], 2.0, atol=1e-9)
    radius = np.linalg.norm(data.qpos[:2])
    # along the circle: a step moves by a chord, h omega = 0.002 off
    np.testing.assert_allclose(np.linalg.norm(data.qvel[:2]), 2.0 * radius, rtol=1e-2)


@pytest.mark.skipif(not NEW, reason="MuJoCo 4 has adhesion")
@pytest.mark.parametrize("adhesion, hangs", [(3.0, True), (2.0, False)])
def test_adhesion_holds_up_to_its_force(adhesion, hangs):
    """A box of 1 kg below a ceiling, by four corners."""
    model = load(
        f'<geom type="box" size="1 1 .1" pos="0 0 1.1" adhesion="{adhesion}"/>'
        + BOX.format(0, 0.9001, "box", ".1 .1 .1", 'mass="1"')
    )
    assert told(model, "geom adhesion") == "exact instead of soft"
    data = mujoco.MjData(model)
    run = perp.mujoco.simulate(model, data, 0.2)
    assert run.ok
    if hangs:
        assert (run.qvel == 0.0).all()
        forces = [perp.mujoco.contact_force(model, data, k)[0] for k in range(data.ncon)]
        assert sum(forces) == pytest.approx(-G, rel=1e-6)
    else:
        assert run.qvel[1, 2] == pytest.approx(-0.001 * (G - 8.0), rel=1e-6)


@pytest.mark.parametrize("body", ["", '<body mocap="true" pos="0 0 .05"><geom size=".1"/></body>'])
def test_what_has_no_degrees_of_freedom_steps(body):
    model = load('<geom type="plane" size="5 5 .1"/>' + body)
    data = mujoco.MjData(model)
    stepper = perp.mujoco.Stepper(model)
    assert all(stepper.step(data).ok for _ in range(3))
    assert data.time == pytest.approx(0.003, rel=1e-12)  # three sums of .001
