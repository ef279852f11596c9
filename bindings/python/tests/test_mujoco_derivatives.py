"""perp.mujoco.derivatives against differences of whole steps."""

import numpy as np
import pytest

mujoco = pytest.importorskip("mujoco")

import perp._mujoco_derivatives  # noqa: E402
import perp._mujoco_model  # noqa: E402
import perp.mujoco  # noqa: E402

NEW = tuple(map(int, mujoco.__version__.split(".")[:2])) >= (4, 0)
SPEC = int(mujoco.mjtState.mjSTATE_INTEGRATION)
FLOOR = '<geom name="floor" type="plane" size="5 5 .1" {}/>'
BODY = '<body pos="0 0 {}"><freejoint/><geom name="g" {}/></body>'
BOX, BALL = 'type="box" size=".1 .1 .1"', 'type="sphere" size=".1"'
ARM = """
<body name="one"><joint name="a" axis="0 1 0" {a}/>
  <geom type="capsule" size=".03" fromto="0 0 0 .5 0 0"/>
  <body pos=".5 0 0"><joint name="b" {b}/><geom type="capsule" size=".02" fromto="0 0 0 .3 0 -.1"/>
  <site name="tip" pos=".3 0 -.1"/></body></body>
"""
HOPPER = """
<body pos="0 0 .549"><joint type="slide" axis="1 0 0"/><joint type="slide" axis="0 0 1"/>
  <joint type="hinge" axis="0 1 0"/><geom type="capsule" size=".04" fromto="0 0 .2 0 0 0"/>
  <body><joint name="a" type="hinge" axis="0 1 0" damping="1"/>
    <geom type="capsule" size=".04" fromto="0 0 0 .2 0 -.25"/>
    <body pos=".2 0 -.25"><joint name="b" type="hinge" axis="0 1 0" damping="1"/>
      <geom type="capsule" size=".03" fromto="0 0 0 -.2 0 -.26"/>
      <geom size=".03" pos="-.2 0 -.26"/></body></body></body>
"""
DRIVES = (
    '<actuator><motor joint="a"/><general joint="b" dyntype="filterexact" dynprm=".1" '
    'gainprm="3"/><position joint="b" kp="9" kv="1"/></actuator>'
)


def load(body, rest="", option=""):
    return mujoco.MjModel.from_xml_string(
        f'<mujoco><option timestep=".002" {option}/><worldbody>{body}</worldbody>{rest}</mujoco>'
    )


def on_floor(height, geom, floor="", option=""):
    return load(FLOOR.format(floor) + BODY.format(height, geom), "", option)


HINGE = 'type="hinge" axis="1 1 0" damping=".1"'
MODELS = {
    "a box rests": (lambda: on_floor(0.0999, BOX), None),
    "a box falls on an edge": (lambda: on_floor(0.1, BOX), "tilt"),
    "a box is deep in the floor": (lambda: on_floor(0.09, BOX), None),
    "a ball slides": (lambda: on_floor(0.0999, BALL), [1.0, 0.5, 0.0, 0.0, 0.0, 3.0]),
    "a ball rolls": (lambda: on_floor(0.0999, BALL), [1.0, 0.5, 0.0, -5.0, 10.0, 0.0]),
    "a ball slides and spins": (
        lambda: on_floor(0.0999, BALL, 'condim="4"'), [1.0, 0.5, 0.0, 0.0, 0.0, 3.0],
    ),
    "a ball turns and is braked": (
        lambda: on_floor(0.0999, BALL, 'condim="6"'), [1.0, 0.5, 0.0, -5.0, 10.0, 2.0],
    ),
    "a ball without friction": (
        lambda: on_floor(0.0999, BALL + ' condim="1"', 'condim="1"'), [1.0, 0.5, -0.1, 0, 0, 3.0],
    ),
    "a capsule rolls on two points": (
        lambda: on_floor(0.0499, 'type="capsule" size=".05 .2" euler="90 0 0"'),
        [0.5, 0.0, 0.0, 0.0, 10.0, 0.0],
    ),
    "an ellipsoid lies": (
        lambda: on_floor(0.0799, 'type="ellipsoid" size=".2 .1 .08"'), [0, 0, 0, 0.3, 0.2, 0.1],
    ),
    "a ball within its margin": (
        lambda: on_floor(0.1001, BALL + ' margin=".01"'), [1, 0, -1, 0, 0, 0],
    ),
    "a ball on a ball": (
        lambda: load(
            '<geom size=".2"/><body pos="0.05 0 .2953"><freejoint/><geom size=".1"/></body>'
        ),
        [0.1, 0.2, 0.0, 0.5, 0.0, 0.3],
    ),
    "an arm in the air": (lambda: load(ARM.format(a='damping=".2"', b=HINGE), DRIVES), "random"),
    "an arm, implicit": (
        lambda: load(ARM.format(a='damping=".2"', b=HINGE), DRIVES, 'integrator="implicitfast"'),
        "random",
    ),
    "an arm with a ball joint": (
        lambda: load(ARM.format(a="", b='type="ball" damping=".1"')), "random",
    ),
    "an arm at its limit": (
        lambda: load(ARM.format(a='range="-10 10" stiffness="1"', b=HINGE), DRIVES), "limit",
    ),
    "an arm with dry friction": (
        lambda: load(ARM.format(a='frictionloss="2"', b=HINGE + ' frictionloss=".01"'), DRIVES),
        [0.0, 2.0],
    ),
    "an arm tied at its tip": (
        lambda: load(
            ARM.format(a="", b='axis="0 1 0"') + '<site name="hook" pos=".799 0 -.101"/>',
            DRIVES + '<equality><connect site1="tip" site2="hook"/></equality>',
        ),
        [0.3, 0.2],
    ),
    "a link is deep in a ball beside its hinge, and turns by a fifth of a radian": (
        lambda: load(
            '<geom size=".1" pos="0 0 -.1"/><body><joint name="a" axis="0 1 0"/>'
            '<geom size=".05" pos=".03 0 0"/><body pos=".2 0 0"><joint name="b" axis="0 1 0"/>'
            '<geom size=".02" pos=".1 0 .1"/></body></body>'
            '<geom size=".1" pos="1 0 -.1"/><body pos="1.02 0 .04"><freejoint/>'
            '<geom size=".05"/></body>',
            DRIVES,
        ),
        [0.3, 0.2, 0, 0, 0, 0.1, 0.2, 0.3],
    ),
    "a hopper stands": (lambda: load(FLOOR.format("") + HOPPER, DRIVES), "land"),
    "a hopper slides": (lambda: load(FLOOR.format("") + HOPPER, DRIVES), "push"),
}  # fmt: skip
if NEW:
    MODELS["an arm with polynomial damping"] = (
        lambda: load(ARM.format(a='damping=".2 .3 .1"', b=HINGE), DRIVES), "random",
    )  # fmt: skip


def state(name):
    make, begin = MODELS[name]
    model = make()
    data, rng = mujoco.MjData(model), np.random.default_rng(3)
    data.ctrl[:] = 0.3
    if isinstance(begin, list):
        data.qvel[:] = begin
    elif begin == "random":
        data.qvel[:] = rng.standard_normal(model.nv)
    elif begin == "tilt":
        data.qpos[2:7] = 0.1 * np.sqrt(2.0) - 1e-4, np.cos(np.pi / 8), 0.0, np.sin(np.pi / 8), 0.0
        data.qvel[:] = 0.5, 0.2, 0.0, 0.0, 1.0, 0.0
    elif begin == "limit":
        data.qpos[0], data.qvel[:] = np.radians(10.01), 0.5
    elif begin in ("land", "push"):
        perp.mujoco.simulate(model, data, 0.1)
        data.qvel[0] += 2.0 if begin == "push" else 0.0
    return model, data


def after(model, state, place, k, change):
    """The state after a step, by its tangent from `place`."""
    nv, na = model.nv, model.na
    data = mujoco.MjData(model)
    mujoco.mj_setState(model, data, state, SPEC)
    if k < nv:
        way = np.zeros(nv)
        way[k] = change
        mujoco.mj_integratePos(model, data.qpos, way, 1.0)
    elif k < 2 * nv:
        data.qvel[k - nv] += change
    elif k < 2 * nv + na:
        data.act[k - 2 * nv] += change
    else:
        data.ctrl[k - 2 * nv - na] += change
    assert perp.mujoco.Stepper(model, tol=1e-12).step(data).ok
    way = np.zeros(nv)
    mujoco.mj_differentiatePos(model, way, 1.0, place, data.qpos)
    return np.concatenate([way, data.qvel, data.act])


def differences(model, data, eps):
    start = np.zeros(mujoco.mj_stateSize(model, SPEC))
    mujoco.mj_getState(model, data, start, SPEC)
    count = 2 * model.nv + model.na + model.nu
    step = mujoco.MjData(model)
    mujoco.mj_setState(model, step, start, SPEC)
    perp.mujoco.Stepper(model, tol=1e-12).step(step)
    place = step.qpos
    columns = [
        (after(model, start, place, k, eps) - after(model, start, place, k, -eps)) / (2.0 * eps)
        for k in range(count)
    ]
    return np.array(columns).T


@pytest.mark.parametrize("name", MODELS)
def test_they_are_those_of_whole_steps(name):
    model, data = state(name)
    before = data.qpos.copy(), data.qvel.copy()
    found = perp.mujoco.derivatives(model, data)
    np.testing.assert_array_equal(data.qpos, before[0])
    np.testing.assert_array_equal(data.qvel, before[1])
    assert found.verdict == "regular" and found.margin > 1e-6
    expected = differences(model, data, 1e-6)
    mine, size = np.hstack([found.A, found.B]), np.abs(expected).max()
    assert mine.shape == expected.shape
    # of a step's tol 1e-12 over 1e-6, and of third derivatives, which grow as A does
    np.testing.assert_allclose(mine, expected, rtol=0, atol=1e-5 * size)


@pytest.mark.parametrize("many", [0, 24])
@pytest.mark.parametrize("name", ["a hopper slides", "a box rests", "an arm with dry friction"])
def test_sparse_and_dense_are_the_same(name, many, monkeypatch):
    monkeypatch.setattr(perp._mujoco_derivatives, "_MANY", many)
    model, data = state(name)
    dense = perp.mujoco.derivatives(model, data)
    monkeypatch.setattr(perp._mujoco_model, "DENSE", 0)
    again = mujoco.MjData(model)
    mujoco.mj_copyData(again, model, data)
    sparse = perp.mujoco.derivatives(model, again)
    # of answers to 1e-12 and differences of 1e-6
    np.testing.assert_allclose(sparse.A, dense.A, rtol=0, atol=1e-6 * np.abs(dense.A).max())
    assert sparse.verdict == dense.verdict


def test_from_one_side_they_are_nearly_those_of_both():
    model, data = state("a hopper slides")
    both = perp.mujoco.derivatives(model, data)
    one = perp.mujoco.derivatives(model, data, centered=False)
    np.testing.assert_allclose(one.A, both.A, rtol=0, atol=1e-3 * np.abs(both.A).max())
    np.testing.assert_allclose(one.B, both.B, rtol=0, atol=1e-5 * np.abs(both.B).max())


def test_where_nothing_touches_they_are_mujocos():
    model, data = state("an arm in the air")
    n = 2 * model.nv + model.na
    A, B = np.zeros((n, n)), np.zeros((n, model.nu))
    mujoco.mjd_transitionFD(model, data, 1e-6, True, A, B, None, None)
    found = perp.mujoco.derivatives(model, data)
    np.testing.assert_allclose(found.A, A, atol=1e-7)
    np.testing.assert_allclose(found.B, B, atol=1e-7)


FACES = """<body pos="-.0399 0 .5"><geom type="box" size=".01 .03 .03"/></body>
<body pos=".0399 0 .5"><joint type="slide" axis="-1 0 0"/><geom type="box" size=".01 .03 .03"/>
</body><body pos="0 0 .5"><freejoint/><geom type="box" size=".03 .03 .03" mass=".2"/></body>"""


@pytest.mark.parametrize("many", [0, 24])
def test_faces_that_lie_on_each_other(many, monkeypatch):
    """A turned box loses corners of a contact either way, which whole steps do not feel: it is held
    by faces and stays."""
    monkeypatch.setattr(perp._mujoco_derivatives, "_MANY", many)
    model = load(FACES)
    data = mujoco.MjData(model)
    data.qfrc_applied[0] = 5.0
    perp.mujoco.simulate(model, data, 0.1)
    found = perp.mujoco.derivatives(model, data)
    assert found.verdict == "degenerate"
    assert np.isfinite(found.A).all()
    expected, n = differences(model, data, 1e-6), model.nv
    places = [0, 1, 2, 3]  # the slide, and the box's way along the faces and through them
    np.testing.assert_allclose(found.A[n:, n:], expected[n:, n : 2 * n], atol=1e-6)
    np.testing.assert_allclose(found.A[np.ix_(places, places)][1:], np.eye(4)[1:], atol=1e-2)


CLAMPED = (
    ARM.format(a='actuatorfrcrange="-1 1" actuatorfrclimited="true"', b=HINGE),
    '<actuator><motor joint="a" gear="2"/><motor joint="a"/><motor joint="b"/></actuator>',
)


def test_what_actuators_share_is_differenced():
    """A limit of a joint's whole actuation: two motors' forces are not their own."""
    model = load(*CLAMPED)
    data = mujoco.MjData(model)
    for control, reaches in (0.2, True), (0.9, False):
        data.ctrl[:] = control
        found = perp.mujoco.derivatives(model, data)
        expected = differences(model, data, 1e-6)[:, 2 * model.nv :]
        np.testing.assert_allclose(found.B, expected, atol=1e-7)
        assert found.B[:, 0].any() == reaches


def test_on_an_edge_they_are_degenerate():
    """A block that friction just holds: pulled with mu m g."""
    model = load(
        FLOOR.format('condim="3"') + '<body pos="0 0 .0999"><joint type="slide" axis="1 0 0"/>'
        '<joint type="slide" axis="0 0 1"/><geom size=".1" mass="1"/></body>'
    )
    data = mujoco.MjData(model)
    for pull, verdict in (0.5, "regular"), (1.0, "degenerate"), (1.5, "regular"):
        data.qfrc_applied[0] = pull * 9.81
        found = perp.mujoco.derivatives(model, data)
        assert found.verdict == verdict
        assert found.A[2, 2] == pytest.approx(0.0 if pull < 1.0 else 1.0, abs=1e-9) or pull == 1.0
        assert found.index == 0


def test_shares_of_a_load_that_are_not_determined_are_singular():
    """Four corners slide: how much the box is braked when it turns depends on which of them bear."""
    model = on_floor(0.0999, BOX)
    data = mujoco.MjData(model)
    data.qvel[:] = 1.0, 0.5, 0.0, 0.0, 0.0, 2.0
    assert perp.mujoco.derivatives(model, data).verdict == "singular"


def test_refusals():
    model, data = state("a box rests")
    with pytest.raises(ValueError, match="eps is 0"):
        perp.mujoco.derivatives(model, data, eps=0.0)
    with pytest.raises(ValueError, match="restitution"):
        perp.mujoco.derivatives(model, data, restitution=0.5)
    with pytest.raises(ValueError, match="tol"):
        perp.mujoco.derivatives(model, data, tol=-1.0)


ON_BALLS = """<geom type="plane" size="5 5 .1"/>
<body pos="0 0 .0999"><freejoint/><geom name="g" size=".1"/></body>
<body pos=".02 .03 .2962"><freejoint/>
<geom name="f" type="capsule" size=".1 .1" euler="20 80 0"/></body>"""
COUPLED = (
    ARM.format(a='stiffness="2"', b=HINGE),
    '<tendon><fixed name="t" damping=".1"><joint joint="a" coef="1"/><joint joint="b" coef="-.5"/>'
    '</fixed></tendon><equality><tendon tendon1="t"/></equality><actuator><muscle joint="a" '
    'ctrllimited="true" ctrlrange="0 1" lengthrange="-3 3"/><general tendon="t" '
    'dyntype="integrator" gainprm="2"/></actuator>',
)
BORNE = ARM.format(a="", b=HINGE).replace("<body", '<body gravcomp=".5"')
MORE = {
    "a capsule on a ball": lambda: load(ON_BALLS),
    "a capsule on a ball, uneven friction": lambda: load(
        ON_BALLS, '<contact><pair geom1="g" geom2="f" friction=".9 .4 .01 .01 .01"/></contact>'
    ),
    "an arm tied by a tendon": lambda: load(*COUPLED),
    "an arm tied by a tendon, implicitfast": lambda: load(*COUPLED, 'integrator="implicitfast"'),
    "an arm that is borne in part": lambda: load(BORNE, DRIVES),
    "an arm, RK4": lambda: load(ARM.format(a='damping=".2"', b=HINGE), DRIVES, 'integrator="RK4"'),
    "a ball that is held": lambda: load(
        FLOOR.format("")
        + '<body name="b" pos=".01 0 .0999"><freejoint/><geom type="ellipsoid" size=".1 .09 .1"/>'
        "</body>",
        '<actuator><adhesion body="b" ctrlrange="0 1" gain="3"/></actuator>',
    ),
    "an arm in a thick fluid": lambda: load(
        ARM.format(a="", b=HINGE), DRIVES, 'integrator="implicitfast" density="900" viscosity="5"'
    ),
}


@pytest.mark.parametrize("name", MODELS)
def test_in_closed_form_they_are_those_of_whole_steps(name, monkeypatch):
    """As of models with many velocities; forces are nowhere differenced by places."""
    monkeypatch.setattr(perp._mujoco_derivatives, "_MANY", 0)
    monkeypatch.setattr(perp._mujoco_derivatives.Linearization, "_by_inverse", None)
    test_they_are_those_of_whole_steps(name)


def options(model):
    names = "integrator", "cone", "jacobian", "disableflags", "enableflags", "noslip_iterations"
    return [getattr(model.opt, name) for name in names]


@pytest.mark.parametrize("many", [0, 999])
@pytest.mark.parametrize("name", MORE)
def test_more_of_them(name, many, monkeypatch):
    """Bodies that touch each other; forces on bodies; what is implicit and moves."""
    monkeypatch.setattr(perp._mujoco_derivatives, "_MANY", many)
    model = MORE[name]()
    data, rng = mujoco.MjData(model), np.random.default_rng(1)
    data.qvel[:] = 0.1 * rng.standard_normal(model.nv)
    pushed = "borne" in name or "capsule" in name
    data.ctrl[:], data.xfrc_applied[-1, :] = 0.4, 0.3 if pushed else 0.0
    expected, before = differences(model, data, 1e-6), options(model)
    found = perp.mujoco.derivatives(model, data)
    assert options(model) == before
    mine = np.hstack([found.A, found.B])
    # as of whole steps above
    np.testing.assert_allclose(mine, expected, rtol=0, atol=1e-5 * np.abs(expected).max())


def test_a_control_of_sensors_is_of_those_of_the_state():
    """data has not sensed yet: what a callback makes of its sensors is as if it had been set."""
    model = load(
        ARM.format(a='damping=".2"', b=HINGE),
        DRIVES + '<sensor><jointpos joint="a"/><jointvel joint="b"/></sensor>',
    )
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:] = (0.4, -0.3), (0.5, 0.8)
    here = mujoco.MjData(model)
    mujoco.mj_copyData(here, model, data)
    here.ctrl[:] = -2.0 * data.qpos[0], 3.0 * data.qvel[1], 0.0
    expected = perp.mujoco.derivatives(model, here)

    def control(_, now):
        now.ctrl[:2] = -2.0 * now.sensordata[0], 3.0 * now.sensordata[1]

    mujoco.set_mjcb_control(control)
    try:
        found = perp.mujoco.derivatives(model, data)
    finally:
        mujoco.set_mjcb_control(None)
    # of differences by 1e-6 of the same forces, in another order
    np.testing.assert_allclose(found.A, expected.A, rtol=0, atol=1e-8 * np.abs(expected.A).max())
    np.testing.assert_allclose(found.B, expected.B, rtol=0, atol=1e-8 * np.abs(expected.B).max())


@pytest.mark.parametrize(
    "name", ["an arm in the air", "an arm tied by a tendon", "a hopper slides"]
)
def test_actuators_at_once_are_as_one_by_one(name, monkeypatch):
    model, data = state(name) if name in MODELS else (MORE[name](), None)
    data = mujoco.MjData(model) if data is None else data
    data.ctrl[:], data.act[:] = 0.4, 0.3
    linear = perp._mujoco_derivatives.Linearization(model, perp.mujoco.Stepper(model))
    assert linear._apart
    at_once = linear(data, 1e-6, True)
    linear._apart = False
    one_by_one = linear(data, 1e-6, True)
    # of differences by 1e-6 of the same forces
    size = np.abs(one_by_one.A).max()
    np.testing.assert_allclose(at_once.A, one_by_one.A, rtol=0, atol=1e-8 * size)
    np.testing.assert_allclose(at_once.B, one_by_one.B, rtol=0, atol=1e-8 * size)


@pytest.mark.parametrize("option", ["", 'integrator="implicitfast"'])
def test_the_inverse_is_that_of_the_metric(option):
    """With damping that is implicit; M and its factors stay as they were."""
    model = load(ARM.format(a='damping=".2"', b=HINGE), DRIVES, option)
    data, stepper = mujoco.MjData(model), perp.mujoco.Stepper(model)
    data.qpos[:], data.qvel[:] = (0.4, -0.3), (0.5, 0.8)
    with stepper.borrowed:
        stepper.gather(data)
        before = data.M.copy(), data.qLD.copy()
        inverse = stepper.inverse(data, np.eye(model.nv))
        np.testing.assert_allclose(inverse @ stepper.metric(data), np.eye(model.nv), atol=1e-13)
    np.testing.assert_array_equal(data.M, before[0])
    np.testing.assert_array_equal(data.qLD, before[1])


@pytest.mark.parametrize("least", [1.0, 1e-4, 1e-7, 1e-10, 1e-13, 0.0])
def test_an_inverse_is_taken_where_it_proves_the_rank(least):
    rng = np.random.default_rng(4)
    for n in (1, 2, 5, 12):
        left, _ = np.linalg.qr(rng.standard_normal((n, n)))
        right, _ = np.linalg.qr(rng.standard_normal((n, n)))
        sizes = 10.0 ** rng.uniform(-1.0, 0.0, n)
        sizes[-1] = least * sizes[0] if n > 1 else least
        found = perp._mujoco_derivatives._inverse_of(left @ np.diag(sizes) @ right)
        if n > 1 and least < 1e-9:
            assert found is None
        elif least > 1e-6:  # nearer it may leave it to the singular values
            np.testing.assert_allclose(
                found, right.T @ np.diag(1.0 / sizes) @ left.T, rtol=0, atol=1e-7 / least
            )
