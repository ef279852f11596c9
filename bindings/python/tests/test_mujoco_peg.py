"""A square peg of 20 mm goes into a hole that is wider by 10 to 1000 um, or stands on its rim, as
rigid bodies do."""

import numpy as np
import pytest

mujoco = pytest.importorskip("mujoco")

import perp.mujoco  # noqa: E402

G, HALF, LONG, WEIGHT, PRESS = 9.81, 0.01, 0.03, 0.1 * 9.81, 2.0


def load(clearance, mu):
    inside, wide = HALF + clearance / 2.0, 0.02
    far = inside + wide / 2.0
    walls = (wide / 2, 0.05, far, 0), (wide / 2, 0.05, -far, 0), (inside, wide / 2, 0, far)
    walls += ((inside, wide / 2, 0, -far),)
    geoms = "".join(
        f'<geom type="box" size="{a} {b} .015" pos="{x} {y} -.015"/>' for a, b, x, y in walls
    )
    return mujoco.MjModel.from_xml_string(
        f'<mujoco><option timestep=".001"/><default><geom friction="{mu} .005 .0001"/></default>'
        f'<worldbody>{geoms}<geom type="plane" size="1 1 .1" pos="0 0 -.03"/>'
        f'<body><freejoint/><geom type="box" size="{HALF} {HALF} {LONG}" mass=".1"/></body>'
        f"</worldbody></mujoco>"
    )


def press(model, data, steps, arm, stiffness, stepper):
    """Pressed down by a wrist with springs, whose centre is `arm` above the peg's. Returns where
    the middle of its lower end is."""
    axis = np.zeros(9)
    for _ in range(steps):
        mujoco.mju_quat2Mat(axis, data.qpos[3:7])
        R = axis.reshape(3, 3)
        at, spin = R @ [0.0, 0.0, arm], R @ data.qvel[3:]
        place, speed = data.qpos[:3] + at, data.qvel[:3] + np.cross(spin, at)
        force = -stiffness * place - [5.0, 5.0, 20.0] * speed
        force[2] = -PRESS - 20.0 * speed[2]
        data.xfrc_applied[1, :3] = force
        turn = 0.5 * 2.0 * data.qpos[4:7] + 0.005 * spin
        data.xfrc_applied[1, 3:] = np.cross(at, force) - turn
        assert stepper.step(data).ok
    mujoco.mju_quat2Mat(axis, data.qpos[3:7])
    return data.qpos[:3] - LONG * axis.reshape(3, 3)[:, 2]


def start(model, tilt):
    data = mujoco.MjData(model)
    data.qpos[:3] = LONG * np.sin(tilt), 0.0, LONG + 0.0015
    data.qpos[3:7] = np.cos(tilt / 2.0), 0.0, np.sin(tilt / 2.0), 0.0
    return data


@pytest.mark.parametrize("clearance, mu", [(1e-3, 0.3), (2e-4, 0.3), (5e-5, 0.1), (1e-5, 1e-5)])
def test_it_goes_in(clearance, mu):
    """Turned by .01, with the wrist's centre at the peg's end, as in assembly (Whitney,
    Quasi-static assembly of compliantly supported rigid parts, 1982): down to the ground."""
    model = load(clearance, mu)
    data, stepper = start(model, 0.01), perp.mujoco.Stepper(model)
    end = press(model, data, 3000, -LONG, 500.0, stepper)
    # overlaps up to twice slop stay, on the ground and on both sides
    assert end[2] == pytest.approx(-0.03, abs=2.0 * stepper.slop)
    assert abs(end[0]) <= clearance / 2.0 + 2.0 * stepper.slop


def on_the_rim(clearance, stiffness):
    """x, z and the turn where its lower face lies on the rim of the left wall, without friction:
    forces and moments of the springs, the weight and one normal force balance."""

    def unbalanced(y):
        x, z, turn, push = y
        normal = np.array([np.sin(turn), np.cos(turn)])
        arm = np.array([-HALF - clearance / 2.0 - x, -z])
        force = push * normal
        return np.array([
            normal @ arm + LONG, force[0] - stiffness * x, force[1] - PRESS - WEIGHT,
            arm[1] * force[0] - arm[0] * force[1] - np.sin(turn / 2.0),
        ])  # fmt: skip

    y = np.array([0.0, LONG, 0.03, 3.0])
    for _ in range(50):
        J = np.array([(unbalanced(y + d) - unbalanced(y - d)) / 2e-7 for d in 1e-7 * np.eye(4)]).T
        y = y - np.linalg.solve(J, unbalanced(y))
    return y[:3]


@pytest.mark.parametrize("clearance", [2e-4, 1e-5])
def test_it_stands_on_the_rim_where_that_is_in_balance(clearance):
    """With the wrist's centre at the peg's own and soft springs: nothing but overlaps of
    millimetres would let it in."""
    model = load(clearance, 1e-5)
    data = start(model, 0.02)
    press(model, data, 3000, 0.0, 200.0, perp.mujoco.Stepper(model, slop=1e-7))
    x, z, turn = on_the_rim(clearance, 200.0)
    assert z > LONG * 0.95 and turn > 0.02
    found = abs(data.qpos[0]), data.qpos[2], 2.0 * np.arcsin(abs(data.qpos[5]))  # either rim
    # slop, and friction of 1e-5 over levers of 30 mm
    np.testing.assert_allclose(found, (x, z, turn), rtol=0, atol=1e-6)


class Theirs:
    """mj_step, and the deepest overlap above half of the hole's depth."""

    ok, deepest = True, 0.0

    def __init__(self, model):
        self._model = model

    def step(self, data):
        mujoco.mj_step(self._model, data)
        if data.qpos[2] - LONG > -0.015:
            self.deepest = max(self.deepest, -data.contact.dist.min(initial=0.0))
        return self


@pytest.mark.parametrize("clearance", [2e-4, 1e-5])
def test_mujoco_gets_in_there_by_overlaps(clearance):
    model = load(clearance, 1e-5)
    theirs = Theirs(model)
    end = press(model, start(model, 0.02), 3000, 0.0, 200.0, theirs)
    assert end[2] < -0.029 and theirs.deepest > 3e-4 > clearance
