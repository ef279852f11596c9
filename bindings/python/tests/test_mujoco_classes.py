"""Random members of a class of models on which steps once went wrong."""

import numpy as np
import pytest

mujoco = pytest.importorskip("mujoco")

import perp.mujoco  # noqa: E402

FLOOR = '<geom type="plane" size="9 9 .1"/>'


def turntable(rng, depth):
    """A hinge along the contact's normal to rounding, its geom in the floor."""
    q = rng.normal(size=4)
    q /= np.linalg.norm(q)
    R = np.zeros(9)
    mujoco.mju_quat2Mat(R, q)
    axis, (x, y) = R.reshape(3, 3)[2], rng.uniform(-0.02, 0.02, 2)
    text = [" ".join(map(repr, map(float, v))) for v in (q, axis)]
    return mujoco.MjModel.from_xml_string(
        f'<mujoco><worldbody>{FLOOR}<body pos="0 0 {0.05 - depth}" quat="{text[0]}">'
        f'<joint axis="{text[1]}"/><geom size=".05" pos="{x} {y} 0" mass="1"/></body>'
        "</worldbody></mujoco>"
    )


@pytest.mark.parametrize("depth", [0.001, 0.01, 0.05])
def test_rows_of_rounding_turn_nothing(depth):
    """Nothing moves such a hinge: its weight lies along the axis."""
    rng = np.random.default_rng(round(1e4 * depth))
    for _ in range(60):
        model = turntable(rng, depth)
        data = mujoco.MjData(model)
        stepper = perp.mujoco.Stepper(model)
        for _ in range(3):
            assert stepper.step(data).ok
        assert np.abs(data.qpos).max() < 1e-9 and np.abs(data.qvel).max() < 1e-9
