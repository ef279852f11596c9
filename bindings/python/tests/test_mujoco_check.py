"""perp.mujoco.check: each treatment is what happens, seen beside MuJoCo's own steps."""

import warnings

import numpy as np
import pytest

mujoco = pytest.importorskip("mujoco")

import perp.mujoco  # noqa: E402

NEW = tuple(map(int, mujoco.__version__.split(".")[:2])) >= (4, 0)
APART = 'contype="0" conaffinity="0"'
ARM = (
    '<body><joint name="a" axis="0 1 0" {a}/>'
    f'<geom type="capsule" size=".03" fromto="0 0 0 .5 0 0" {APART}/>'
    '<body pos=".5 0 0"><joint name="b" axis="1 1 0" {b}/>'
    f'<geom type="capsule" size=".02" fromto="0 0 0 .3 0 .1" {APART}/>'
    '<site name="s" pos=".3 0 .1"/></body></body>'
)
TILE = '<body pos="0 0 2"><freejoint/><geom type="box" size=".2 .1 .03"/></body>'
FLOOR = '<geom type="plane" size="5 5 .1" {}/>'
BOX = '<body pos="0 0 .0999"><freejoint/><geom type="box" size=".1 .1 .1" {}/></body>'


def load(body, option="", rest="", flag=""):
    return mujoco.MjModel.from_xml_string(
        f'<mujoco><option timestep=".002" {option}><flag {flag}/></option>'
        f"<worldbody>{body}</worldbody>{rest}</mujoco>"
    )


def arm(a="", b="", rest="", option=""):
    return load(ARM.format(a=a, b=b), option, rest)


def tendon(text):
    pair = '<joint joint="a" coef="1"/><joint joint="b" coef="1"/>'
    return arm(rest=f"<tendon><fixed {text}>{pair}</fixed></tendon>")


def run(model, step, steps=100):
    data = mujoco.MjData(model)
    rng = np.random.default_rng(0)
    data.qvel[:] = 2.0 * rng.standard_normal(model.nv)
    for k in range(steps):
        data.ctrl[:] = 0.5 * np.sin(0.1 * k) + 0.2
        step(model, data)
    return data


def told(model, name):
    return {one.name: one.treatment for one in perp.mujoco.check(model)}.get(name)


IMPLICIT = 'integrator="implicitfast"'
SAME = {
    "integrator Euler": lambda: arm(),
    "integrator RK4": lambda: arm('damping=".5"', option='integrator="RK4"'),
    "integrator implicitfast": lambda: arm('damping=".5"', option=IMPLICIT),
    "stiffness of joints": lambda: arm('stiffness="5"'),
    "damping of joints": lambda: arm('damping=".5"'),
    "stiffness of tendons": lambda: tendon('stiffness="3"'),
    "damping of tendons": lambda: tendon('damping=".3"'),
    "gyroscopic term of free bodies": lambda: load(TILE + ARM.format(a="", b=""), IMPLICIT),
    "fluid forces": lambda: arm(option='density="1.2" viscosity=".1" wind="1 0 0"'),
    "gravcomp": lambda: load(ARM.format(a="", b="").replace("<body>", '<body gravcomp="1">')),
    "sensors of acceleration and force": lambda: arm(
        'damping=".5"', rest='<sensor><accelerometer site="s"/><force site="s"/></sensor>'
    ),
    "mocap bodies": lambda: load(ARM.format(a="", b="") + '<body mocap="true"/>'),
    "flag energy": lambda: load(ARM.format(a="", b=""), flag='energy="enable"'),
}
ACTUATORS = [
    '<motor joint="a" forcerange="-.1 .1"/>',
    '<position joint="a" kp="20" kv="3"/>',
    '<general joint="a" dyntype="filterexact" dynprm=".1" gainprm="3"/>',
    '<muscle joint="a" lengthrange="-1 1"/>',
]
if NEW:
    ACTUATORS += [
        '<pid joint="a" kp="20" kv="1" ki="3"/>',
        '<motor joint="a" damping=".5 .2 .1" armature=".2"/>',
        '<motor joint="a" delay=".01" nsample="10"/>',
    ]
    SAME["polynomial damping of joints"] = lambda: arm('damping=".5 .3 .2"')
    SAME["springyield"] = lambda: arm('stiffness="5" springyield="10"', 'stiffness="5"')
    SAME["flag speculative"] = lambda: load(TILE, flag='speculative="enable"')


def assert_same(model):
    ours, theirs = run(model, perp.mujoco.step), run(model, mujoco.mj_step)
    for name in "qpos", "qvel", "act", "sensordata", "energy", "plastic", "history", "time":
        if hasattr(ours, name):
            # 100 steps of rounding, amplified by a double pendulum
            np.testing.assert_allclose(getattr(ours, name), getattr(theirs, name), atol=1e-10)


@pytest.mark.parametrize("name", SAME)
def test_what_is_the_same_moves_as_mujoco_has_it(name):
    model = SAME[name]()
    assert told(model, name) == "same"
    assert_same(model)


@pytest.mark.parametrize("integrator", ["Euler", "implicitfast", "RK4"])
@pytest.mark.parametrize("text", ACTUATORS)
def test_actuators_are_the_same(text, integrator):
    model = arm(rest=f"<actuator>{text}</actuator>", option=f'integrator="{integrator}"')
    assert told(model, "actuators") == "same"
    assert_same(model)


def boxed(floor="", box="", option="", flag=""):
    return load(FLOOR.format(floor) + BOX.format(box), option, flag=flag)


IGNORED = {
    "solref, solimp": (boxed, {"box": 'solref=".1 .5"'}),
    "impratio": (boxed, {"option": 'impratio="10"'}),
    "solver's settings": (boxed, {"option": 'iterations="1" solver="PGS"'}),
    "noslip_iterations": (boxed, {"option": 'noslip_iterations="5"'}),
}


@pytest.mark.parametrize("name", IGNORED)
def test_what_is_ignored_has_no_effect_but_in_mujoco(name):
    make, text = IGNORED[name]
    model, without = make(**text), make(**{key: "" for key in text})
    assert told(model, name) == "ignored" and told(without, name) is None
    ours, plain = run(model, perp.mujoco.step, 400), run(without, perp.mujoco.step, 400)
    np.testing.assert_allclose(ours.qpos, plain.qpos, rtol=0, atol=1e-12)
    theirs, plain = run(model, mujoco.mj_step, 400), run(without, mujoco.mj_step, 400)
    assert np.abs(theirs.qpos - plain.qpos).max() > 1e-8


def test_rk4_gives_way_to_euler_where_something_touches():
    """A box that is thrown flies as MuJoCo's RK4 has it, and slides as Euler does from there."""
    model, euler = boxed(option='integrator="RK4"'), boxed()
    ours, theirs = mujoco.MjData(model), mujoco.MjData(model)
    for data in (ours, theirs):
        data.qpos[2] += 0.5
        data.qvel[:] = [0.3, 0.0, 0.0, 0.5, 1.0, 0.2]
    while not theirs.nefc:
        mujoco.mj_step(model, theirs)
        if not theirs.nefc:  # of the stages of this step
            perp.mujoco.step(model, ours)
            np.testing.assert_allclose(ours.qpos, theirs.qpos, rtol=0, atol=1e-12)
    while not ours.nefc:
        perp.mujoco.step(model, ours)
    other = mujoco.MjData(euler)
    other.qpos[:], other.qvel[:] = ours.qpos, ours.qvel
    mujoco.mj_forward(model, ours)
    for _ in range(5):
        perp.mujoco.step(model, ours)
        perp.mujoco.step(euler, other)
        assert ours.nefc and np.abs(ours.qpos - other.qpos).max() < 1e-12


def test_implicit_is_taken_for_implicitfast():
    model, fast = arm(option='integrator="implicit"'), arm(option=IMPLICIT)
    assert told(model, "integrator implicit") == "ignored"
    ours, other = run(model, perp.mujoco.step), run(fast, mujoco.mj_step)
    np.testing.assert_allclose(ours.qpos, other.qpos, atol=1e-10)
    assert np.abs(run(model, mujoco.mj_step).qpos - other.qpos).max() > 1e-6


EXACT = {
    "contact": lambda: boxed(),
    "condim 4": lambda: boxed(floor='condim="4"'),
    "condim 6": lambda: boxed(floor='condim="6"'),
    "cone pyramidal": lambda: boxed(),
    "limits of joints": lambda: arm('range="-10 10"'),
    "frictionloss": lambda: arm('frictionloss="9"', 'frictionloss="3"'),
    "equality": lambda: arm(rest='<equality><joint joint1="a" joint2="b"/></equality>'),
}


@pytest.mark.parametrize("name", EXACT)
def test_what_is_exact_obeys_its_law_where_mujoco_does_not(name):
    """After half a second in which things come to rest or meet: the violation of velocities."""
    model = EXACT[name]()
    assert told(model, name) == "exact instead of soft"
    errors = []
    for step in perp.mujoco.step, mujoco.mj_step:
        data = run(model, step, 400)
        step(model, data)
        errors.append(violation(model, data, data.qvel.copy()))
    assert errors[0] < 1e-7 and errors[1] > 10.0 * errors[0]


def test_surfaces_bear_where_they_meet():
    model = load(FLOOR.format('margin=".01"') + BOX.format("").replace(".0999", ".105"))
    assert told(model, "margin") == "exact instead of soft"
    forces = []
    for step in perp.mujoco.step, mujoco.mj_step:
        data = mujoco.MjData(model)
        step(model, data)
        assert data.ncon == 4 and (data.contact.dist > 0.0).all()
        forces.append(data.efc_force.max())
    assert forces[0] == 0.0 < forces[1]


def violation(model, data, v):
    """Of Signorini's law by contacts and limits that touch, of equations, and of dry friction that
    holds, times what they carry: velocities of their rows where there should be none."""
    before, worst = data.efc_force.copy(), 0.0
    J = np.zeros((data.nefc, model.nv))
    (mujoco.mju_sparse2dense if mujoco.mj_isSparse(model) else copy_dense)(J, data)
    u = J @ v
    for row in range(data.nefc):
        kind = data.efc_type[row]
        if kind == mujoco.mjtConstraint.mjCNSTR_FRICTION_DOF:
            held = abs(before[row]) < data.efc_frictionloss[row] * (1.0 - 1e-9)
            worst = max(worst, abs(u[row]) if held else 0.0)
        elif kind == mujoco.mjtConstraint.mjCNSTR_LIMIT_JOINT:
            worst = max(worst, abs(u[row]) if before[row] > 1e-6 else 0.0)
        elif kind == mujoco.mjtConstraint.mjCNSTR_EQUALITY:
            worst = max(worst, abs(u[row]))
    for k in range(data.ncon):
        normal, row = data.contact.frame[k, :3], data.contact.efc_address[k]
        if row >= 0 and data.contact.dist[k] <= 0.0:
            worst = max(worst, abs(normal @ velocity(model, data, k, v)))
    return worst


def copy_dense(J, data):
    J[:] = data.efc_J.reshape(J.shape)


def velocity(model, data, k, v):
    """Of a contact's second body against the first, where it touches."""
    point, sides = data.contact.pos[k], []
    for geom in data.contact.geom[k]:
        jacobian = np.zeros((3, model.nv))
        mujoco.mj_jac(model, data, jacobian, None, point, model.geom_bodyid[geom])
        sides.append(jacobian @ v)
    return sides[1] - sides[0]


REFUSED = {}
if NEW:
    REFUSED["integrator discrete"] = lambda: arm(option='integrator="discrete"')
    REFUSED["flag sleep"] = lambda: load(TILE, flag='sleep="enable"')
    REFUSED["flag ipc"] = lambda: load(TILE, 'integrator="discrete"', flag='ipc="enable"')


@pytest.mark.parametrize("name", REFUSED)
def test_what_is_refused_is_named(name):
    model = REFUSED[name]()
    assert told(model, name) == "refused"
    with pytest.raises(ValueError, match=name):
        perp.mujoco.Stepper(model)


def test_compliance_that_is_not_read_is_told_once():
    soft, plain = boxed(box='solref=".1 1"'), boxed()
    data = mujoco.MjData(soft)
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("default")
        for _ in range(3):
            perp.mujoco.Stepper(soft)
            perp.mujoco.simulate(soft, data, 0.01)
    assert [str(one.message)[:27] for one in told] == ["the model's solref and soli"]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        perp.mujoco.Stepper(plain)
        for rigid in True, False:
            perp.mujoco.Stepper(soft, rigid=rigid)


def test_the_model_is_not_changed():
    models = boxed(option='cone="pyramidal" jacobian="sparse"'), boxed(option='cone="elliptic"')
    for model in models:
        before = model.opt.cone, model.opt.jacobian
        data = mujoco.MjData(model)
        perp.mujoco.check(model)
        perp.mujoco.simulate(model, data, 0.01)
        perp.mujoco.contact_force(model, data, 0)
        assert (model.opt.cone, model.opt.jacobian) == before
    with pytest.raises(ValueError, match="contact is 99"):
        perp.mujoco.contact_force(model, data, 99)


def test_forces_that_are_no_numbers_reset_the_state_as_mujoco_does():
    model, ends = arm(), []
    for step in perp.mujoco.step, mujoco.mj_step:
        data = mujoco.MjData(model)
        data.qpos[:] = 1.0
        for _ in range(10):
            step(model, data)
        data.qfrc_applied[0] = np.nan
        step(model, data)
        ends.append(data)
    ours, theirs = ends
    bad = mujoco.mjtWarning.mjWARN_BADQACC
    assert ours.warning[bad].number == theirs.warning[bad].number == 1
    assert ours.time == theirs.time == model.opt.timestep
    np.testing.assert_allclose(ours.qpos, theirs.qpos, atol=1e-14)
    model = load(ARM.format(a="", b=""), flag='autoreset="disable"')
    data = mujoco.MjData(model)
    data.qfrc_applied[0] = np.nan
    with pytest.raises(ValueError, match="autoreset"):
        perp.mujoco.step(model, data)
