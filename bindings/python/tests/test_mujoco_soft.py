"""perp.mujoco with rigid=False: contacts, limits and equations that comply as MuJoCo's do."""

import numpy as np
import pytest

mujoco = pytest.importorskip("mujoco")

import perp._mujoco_model  # noqa: E402
import perp.mujoco  # noqa: E402

G = 9.81
FLOOR = '<geom type="plane" size="5 5 .1" condim="1"/>'
FREE = '<body pos="0 0 .12"><freejoint/><geom {}/></body>'
ARM = """<body><joint name="a" axis="0 1 0" {}/>
<geom type="capsule" size=".03" fromto="0 0 0 .5 0 0" contype="0"/><body pos=".5 0 0">
<joint name="b" axis="0 1 0"/><geom type="capsule" size=".02" fromto="0 0 0 .3 0 -.1" contype="0"/>
<site name="tip" pos=".3 0 -.1"/></body></body>"""
BOX = 'type="box" size=".1 .1 .1" condim="{}" solref="{}"'


def load(body, rest=""):
    model = mujoco.MjModel.from_xml_string(
        f'<mujoco><option timestep=".002" cone="elliptic" tolerance="0" iterations="200"/>'
        f"<worldbody>{body}</worldbody>{rest}</mujoco>"
    )
    model.opt.tolerance = 0.0
    return model


def ball(d, solref, height):
    geom = f'size=".1" mass="2" condim="1" solref="{solref}" solimp="{d} {d} .001 .5 2"'
    geom += ' priority="1"'
    return load(FLOOR + FREE.format(geom).replace(".12", str(height)))


@pytest.mark.parametrize("d", [0.5, 0.9])
@pytest.mark.parametrize("tau, zeta", [(0.02, 1.0), (0.05, 0.2)])
def test_a_contact_is_a_spring_and_a_damper(d, tau, zeta):
    """In the words of MuJoCo's manual: a + d (b v + k x) = (1 - d) a0, with b = 2 / (d tau) and
    k = 1 / (d tau^2 zeta^2); x and v are those of the step's start."""
    model = ball(d, f"{tau} {zeta}", 0.0995)
    model.opt.timestep = h = 1e-4
    data, stepper = mujoco.MjData(model), perp.mujoco.Stepper(model, rigid=False, tol=1e-12)
    x, v, b, k = -0.0005, 0.0, 2.0 / (d * tau), 1.0 / (d * (tau * zeta) ** 2)
    for _ in range(3000):
        assert stepper.step(data).ok
        pull = -(1.0 - d) * G - d * (b * v + k * x)
        v += h * (max(pull, -G) if x <= 0.0 else -G)  # which pushes alone
        x += h * v
        # rounding of 3000 steps; diagApprox has 1 / m to 1e-12
        np.testing.assert_allclose(data.qpos[2] - 0.1, x, rtol=0, atol=1e-10)
    if zeta == 1.0:
        # both roots are -1 / tau: (1 + 15) e^-15 of at most 1.5 mm is left after .3 s
        assert data.qpos[2] - 0.1 == pytest.approx(-(1.0 - d) * G / (d * k), abs=1e-8)


SCENES = {
    "a box falls on four corners": (FLOOR + FREE.format(BOX.format(1, ".02 1")), ""),
    "a box on a springy floor": (FLOOR + FREE.format(BOX.format(1, "-5000 -5")), ""),
    "a box that sticks": (FLOOR + FREE.format(BOX.format(3, ".02 1")), ""),
    "within its margin": (FLOOR + FREE.format(BOX.format(1, ".02 1") + ' margin=".01"'), ""),
    "an arm at its limit": (
        ARM.format('limited="true" range="-30 20" solreflimit=".05 .3"'), "",
    ),
    "coupled joints": (
        ARM.format(""),
        '<equality><joint joint1="a" joint2="b" polycoef=".1 1 0 0 0" solref=".1 .5"/></equality>',
    ),
    "an arm on a soft hook": (
        ARM.format("") + '<site name="hook" pos=".7 0 -.1"/>',
        '<equality><connect site1="tip" site2="hook" solref=".1 .2"/></equality>',
    ),
    "a soft weld": (
        '<body name="x" pos="0 0 1"><freejoint/><geom type="box" size=".1 .05 .2" contype="0"/>'
        "</body>", '<equality><weld body1="x" solref=".1 .4"/></equality>',
    ),
}  # fmt: skip


@pytest.mark.parametrize("dense", [120, 0])
@pytest.mark.parametrize("name", SCENES)
def test_without_friction_they_are_mujocos(name, dense, monkeypatch):
    monkeypatch.setattr(perp._mujoco_model, "DENSE", dense)
    model = load(*SCENES[name])
    theirs, ours = mujoco.MjData(model), mujoco.MjData(model)
    if "box" not in name:
        theirs.qvel[:] = ours.qvel[:] = 0.3 * np.arange(1.0, model.nv + 1.0)
    stepper, touched = perp.mujoco.Stepper(model, rigid=False, tol=1e-12), 0
    for _ in range(500):
        mujoco.mj_step(model, theirs)
        assert stepper.step(ours).ok
        touched += ours.nefc > 0
        # tol 1e-12 in each of 500 steps, and MuJoCo's own rounding
        np.testing.assert_allclose(ours.qpos, theirs.qpos, rtol=0, atol=1e-9)
        np.testing.assert_allclose(ours.qfrc_constraint, theirs.qfrc_constraint, atol=1e-4)
    assert touched > 100


def test_friction_is_rigid():
    """A box on a slope: it sinks in as MuJoCo's does, and doesn't creep."""
    model = load('<geom type="plane" size="5 5 .1"/>' + FREE.format(BOX.format(3, ".02 1")))
    model.opt.gravity[:] = 0.5 * G, 0.0, -G
    theirs, ours = mujoco.MjData(model), mujoco.MjData(model)
    stepper = perp.mujoco.Stepper(model, rigid=False)
    for _ in range(2000):
        mujoco.mj_step(model, theirs)
        assert stepper.step(ours).ok
    assert abs(theirs.qvel[0]) > 1e-4
    assert np.abs(ours.qvel).max() < 1e-8  # tol
    # the same loads on the same springs: but for where MuJoCo's creeps
    np.testing.assert_allclose(ours.contact.dist.sum(), theirs.contact.dist.sum(), rtol=1e-3)


def test_where_it_is_not():
    model = load(*SCENES["a soft weld"])
    with pytest.raises(ValueError, match="restitution"):
        perp.mujoco.Stepper(model, rigid=False, restitution=0.5)
    with pytest.raises(ValueError, match="rigid"):
        perp.mujoco.derivatives(model, mujoco.MjData(model), rigid=False)
    of = {one.name: one.treatment for one in perp.mujoco.check(model)}
    softly = {one.name: one.treatment for one in perp.mujoco.check(model, rigid=False)}
    assert of["equality"] == "exact instead of soft" and of["solref, solimp"] == "ignored"
    assert softly["equality"] == softly["solref, solimp"] == "same"


def test_many_at_once_are_those_of_steps():
    model = load(*SCENES["a box that sticks"])
    size = mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS)
    state = np.zeros(size)
    data = mujoco.MjData(model)
    mujoco.mj_getState(model, data, state, mujoco.mjtState.mjSTATE_FULLPHYSICS)
    found = perp.mujoco.rollout(model, state, steps=200, threads=2, rigid=False)
    stepper = perp.mujoco.Stepper(model, rigid=False)
    for _ in range(200):
        stepper.step(data)
    mujoco.mj_getState(model, data, state, mujoco.mjtState.mjSTATE_FULLPHYSICS)
    np.testing.assert_array_equal(found.states[0, -1], state)
    assert found.ok


def test_with_implicit_damping_they_agree_the_better_the_shorter_steps_are():
    """Damping is in the metric of contacts, which MuJoCo's solver leaves out: of the order of h."""
    off = []
    for h in (1e-3, 2.5e-4):
        model = load(ARM.format('damping=".5" limited="true" range="-30 20" solreflimit=".05 .3"'))
        model.opt.timestep = h
        theirs, ours = mujoco.MjData(model), mujoco.MjData(model)
        stepper = perp.mujoco.Stepper(model, rigid=False, tol=1e-12)
        for _ in range(round(0.3 / h)):
            mujoco.mj_step(model, theirs)
            assert stepper.step(ours).ok
        assert ours.nefc > 0
        off.append(np.abs(ours.qpos - theirs.qpos).max())
    # first order: a quarter; of angles of .5
    assert off[1] < 0.3 * off[0] < 0.3 * 5e-3
