"""perp.mujoco.rollout: the bits of single steps, at any number of threads."""

import threading
import time

import numpy as np
import pytest

mujoco = pytest.importorskip("mujoco")

import perp.mujoco  # noqa: E402
from perp._mujoco_run import Batch, Runner  # noqa: E402

STATE = int(mujoco.mjtState.mjSTATE_FULLPHYSICS)
GRAVITY = int(mujoco.mjtDisableBit.mjDSBL_GRAVITY)
FAST = int(mujoco.mjtIntegrator.mjINT_IMPLICITFAST)
WALKER = """
<mujoco><option timestep=".004" {option}/><worldbody><geom type="plane" size="9 9 .1"/>
<body pos="0 0 .6"><freejoint/><geom type="box" size=".2 .1 .05"/>
  <body pos=".15 .1 0"><joint name="a" axis="0 1 0" range="-60 60" damping="1"/>
    <geom type="capsule" size=".03" fromto="0 0 0 .1 0 -.4"/><site name="s" pos=".1 0 -.4"/></body>
  <body pos="-.15 .1 0"><joint name="b" axis="0 1 0" frictionloss=".3"/>
    <geom type="capsule" size=".03" fromto="0 0 0 -.1 0 -.4"/></body>
  <body pos="0 -.1 0"><joint name="c" axis="1 1 0"/>
    <geom type="capsule" size=".03" fromto="0 0 0 0 0 -.4" condim="6"/></body>
</body>{bodies}</worldbody>
<actuator><motor joint="a" gear="9"/><position joint="b" kp="20" kv="1"/>
<general joint="c" dyntype="filter" dynprm=".05" gainprm="8"/></actuator>
<sensor>{sensors}<touch site="s"/><jointpos joint="a"/></sensor></mujoco>
"""
BALLS = "".join(
    f'<body pos="{0.3 * k} 0 {1.0 + 0.1 * k}"><freejoint/><geom size=".1"/></body>'
    for k in range(20)
)
CASES = {
    "Euler": (WALKER.format(option="", bodies="", sensors=""), True),
    "implicitfast, in the library": (
        WALKER.format(option='integrator="implicitfast"', bodies="", sensors="").replace(
            '<freejoint/>', '<joint type="slide" axis="0 0 1"/>'
        ),
        True,
    ),
    "sparse": (WALKER.format(option="", bodies=BALLS, sensors=""), True),
    "accelerometers": (
        WALKER.format(option="", bodies="", sensors='<accelerometer site="s"/>'), True,
    ),
    "RK4": (
        WALKER.format(
            option='integrator="RK4"', bodies="", sensors='<accelerometer site="s"/>'
        ).replace('dyntype="filter" dynprm=".05"', ""), True,
    ),
    "RK4 with activations, by steps": (
        WALKER.format(option='integrator="RK4"', bodies="", sensors=""), False,
    ),
    "tumbling bodies, by steps": (
        WALKER.format(option='integrator="implicitfast"', bodies=BALLS.replace(
            'size=".1"', 'type="box" size=".1 .08 .06"'), sensors=""), False,
    ),
}  # fmt: skip


def setup(name, starts=4, steps=150):
    model = mujoco.MjModel.from_xml_string(CASES[name][0])
    data, rng = mujoco.MjData(model), np.random.default_rng(2)
    states = np.zeros((starts, mujoco.mj_stateSize(model, STATE)))
    for k in range(starts):
        mujoco.mj_resetData(model, data)
        data.qvel[:] = 0.3 * rng.standard_normal(model.nv)
        mujoco.mj_getState(model, data, states[k], STATE)
    return model, states, rng.standard_normal((starts, steps, model.nu))


@pytest.mark.parametrize("name", CASES)
def test_bits_are_those_of_steps_at_any_number_of_threads(name, monkeypatch):
    """Of steps that Python makes, stage by stage."""
    model, states, controls = setup(name)
    assert Runner.can(perp.mujoco.Stepper(model), mujoco.MjData(model)) == CASES[name][1]
    runs = [perp.mujoco.rollout(model, states, controls, threads=k) for k in (1, 3)]
    np.testing.assert_array_equal(runs[0].states, runs[1].states)
    np.testing.assert_array_equal(runs[0].sensors, runs[1].sensors)
    assert runs[0].ok and runs[0].residual.max() < 1e-7
    monkeypatch.setattr(Runner, "can_end", lambda *_: False)
    for k in range(len(states)):
        data, stepper = mujoco.MjData(model), perp.mujoco.Stepper(model)
        mujoco.mj_setState(model, data, states[k], STATE)
        state = np.zeros(states.shape[1])
        for step, control in enumerate(controls[k]):
            data.ctrl[:] = control
            stepper.step(data)
            mujoco.mj_getState(model, data, state, STATE)
            np.testing.assert_array_equal(runs[0].states[k, step], state)
            np.testing.assert_array_equal(runs[0].sensors[k, step], data.sensordata)
    assert data.ncon > 0  # it fell


def test_what_changes_between_steps_counts():
    """A step that is one call reads it all the same: what follows is a fresh stepper's from there."""
    model, states, controls = setup("accelerometers", 1, 3)
    stepper, data, calls = perp.mujoco.Stepper(model), mujoco.MjData(model), []
    mine = model.opt.cone, model.opt.jacobian, model.opt.integrator

    def both():
        fresh, other = perp.mujoco.Stepper(model), mujoco.MjData(model)
        mujoco.mj_setState(model, other, state, STATE)
        for one, at in (stepper, data), (fresh, other):
            assert one.step(at).ok
        assert data.time == other.time
        np.testing.assert_allclose(data.qvel, other.qvel, atol=1e-7)  # tol is 1e-8

    def keep():
        mujoco.mj_getState(model, data, state, STATE)

    state = states[0].copy()
    mujoco.mj_setState(model, data, state, STATE)
    for _ in range(3):
        stepper.step(data)
    for name, value in ("timestep", 0.001), ("disableflags", GRAVITY), ("integrator", FAST):
        keep()
        before = data.time, getattr(model.opt, name)
        setattr(model.opt, name, value)
        both()
        assert data.time - before[0] == pytest.approx(model.opt.timestep, abs=1e-12)
        setattr(model.opt, name, before[1])
        keep()
        both()
    mujoco.set_mjcb_control(lambda m, d: calls.append(d.time))
    try:
        stepper.step(data)
    finally:
        mujoco.set_mjcb_control(None)
    assert len(calls) == 1
    stepper.slop = 0.01
    stepper.step(data)
    assert len(calls) == 1 and stepper.solver.numbers.slop == 0.01
    assert (model.opt.cone, model.opt.jacobian, model.opt.integrator) == mine


def test_in_the_air_they_are_mujocos():
    rollout = pytest.importorskip("mujoco.rollout")
    model, states, controls = setup("Euler", 2, 40)
    model.opt.disableflags = int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
    theirs, sensors = rollout.rollout(model, mujoco.MjData(model), states, controls)
    ours = perp.mujoco.rollout(model, states, controls)
    np.testing.assert_allclose(ours.states, theirs, atol=1e-9)
    np.testing.assert_allclose(ours.sensors, sensors, atol=1e-9)


def slider():
    """A box that slides to rest; its model, data and state."""
    model = mujoco.MjModel.from_xml_string(
        '<mujoco><option gravity="3 0 -9.4"/><worldbody><geom type="plane" size="9 9 .1"/>'
        '<body pos="0 0 .0999"><freejoint/><geom type="box" size=".1 .1 .1"/></body>'
        "</worldbody></mujoco>"
    )
    data = mujoco.MjData(model)
    data.qvel[:2] = 0.3, 0.2
    state = np.zeros(mujoco.mj_stateSize(model, STATE))
    mujoco.mj_getState(model, data, state, STATE)
    return model, data, state


def test_what_rests_stays_at_rest():
    """Slides to rest within the run: the slow slips are looked at, as in steps."""
    model, _, state = slider()
    run = perp.mujoco.rollout(model, state, steps=400)
    assert run.ok and run.states.shape == (1, 400, 14)
    assert (run.states[0, -50:, 8:] == 0.0).all()


def test_a_look_that_finds_nothing_leaves_the_answer(monkeypatch):
    """No look at slow slips is ever content here: the steps say what they said before it."""
    model, data, _ = slider()
    model.opt.gravity[:] = 9.4, 0.0, -9.4  # on the edge of friction
    data.qvel[:2] = 1e-9, 0.0
    stepper, looks = perp.mujoco.Stepper(model), []
    solve_by = stepper.solver.solve_by

    def sharper(method, *_):
        looks.append(solve_by(method, 1e-300))
        return looks[-1]._replace(ok=False)

    monkeypatch.setattr(stepper.solver, "solve_by", sharper)
    for _ in range(100):
        before = len(looks)
        how = stepper.step(data)
        assert how.ok
        assert len(looks) == before or how != looks[-1]
    assert looks


@pytest.mark.parametrize("name", CASES)
def test_steps_in_one_call_are_steps(name):
    model, states, controls = setup(name, 1, 1)
    ends = []
    for many in (False, True):
        data, stepper = mujoco.MjData(model), perp.mujoco.Stepper(model)
        mujoco.mj_setState(model, data, states[0], STATE)
        data.ctrl[:] = controls[0, 0]
        for _ in range(20):
            if many:
                assert stepper.steps(data, 5)
            else:
                assert all([stepper.step(data).ok for _ in range(5)])
        ends.append(data.qpos.copy())
    np.testing.assert_array_equal(*ends)


def test_an_environment_is_stepped():
    """An ant that lies still in perp's contact, and creeps in MuJoCo's."""
    gymnasium = pytest.importorskip("gymnasium")
    speeds = []
    for wrap in (perp.mujoco.wrap, lambda env: env):
        env = wrap(gymnasium.make("Ant-v5", terminate_when_unhealthy=False))
        env.reset(seed=3)
        for _ in range(120):
            env.step(np.zeros(env.action_space.shape))
        speeds.append(np.abs(env.unwrapped.data.qvel[:3]).max())
        assert env.unwrapped.data.time == pytest.approx(120 * 0.05)
    assert speeds[0] < 1e-6 < speeds[1]


def test_what_is_no_environment_is_refused():
    with pytest.raises(ValueError, match="env is not"):
        perp.mujoco.wrap(object())


def test_python_callbacks_are_called():
    model, states, controls = setup("Euler", 1, 20)
    calls = []
    mujoco.set_mjcb_control(lambda model, data: calls.append(data.time))
    try:
        perp.mujoco.rollout(model, states, controls)
    finally:
        mujoco.set_mjcb_control(None)
    assert len(calls) == 20


def test_after_an_error_others_begin_nothing_more(monkeypatch):
    """As by Ctrl-C. The first start fails while another one is made; the others are left."""
    begun, another = [], threading.Event()

    def fails(self, k, data, stepper):
        begun.append(k)
        if k == 0:
            another.wait()
            raise KeyboardInterrupt
        another.set()
        time.sleep(0.02)

    model = mujoco.MjModel.from_xml_string(CASES["Euler"][0])
    state = np.zeros((50, mujoco.mj_stateSize(model, STATE)))
    monkeypatch.setattr(Batch, "_one", fails)
    with pytest.raises(KeyboardInterrupt):
        perp.mujoco.rollout(model, state, np.zeros((50, 3, model.nu)), threads=2)
    assert len(begun) < 50


def test_the_model_is_as_it_was():
    model, states, controls = setup("Euler", 2, 5)
    before = model.opt.cone, model.opt.jacobian
    perp.mujoco.rollout(model, states, controls, threads=2)
    assert (model.opt.cone, model.opt.jacobian) == before


@pytest.mark.parametrize(
    "change, text",
    [
        (lambda s, c: (s[:, 1:], c, {}), "states has shape"),
        (lambda s, c: (s, c[:, :, 1:], {}), "controls has shape"),
        (lambda s, c: (s, c[:3], {}), "states are 4, but controls 3"),
        (lambda s, c: (s, None, {}), "controls is None"),
        (lambda s, c: (s, c, {"steps": 7}), "steps is 7"),
        (lambda s, c: (s, c, {"threads": 0}), "threads is 0"),
    ],
)
def test_refusals(change, text):
    model, states, controls = setup("Euler", 4, 10)
    states, controls, more = change(states, controls)
    with pytest.raises(ValueError, match=text):
        perp.mujoco.rollout(model, states, controls, **more)
