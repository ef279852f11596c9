"""MuJoCo loads and moves a gripper, perp solves its contacts: what it holds stays at 0.0."""

import mujoco
import numpy as np

import perp.mujoco

MODEL = """
<mujoco>
  <option timestep="0.002"/>
  <worldbody>
    <geom type="box" pos="-.0399 0 .5" size=".01 .03 .03"/>
    <body pos=".0399 0 .5">
      <joint name="finger" type="slide" axis="-1 0 0"/>
      <geom type="box" size=".01 .03 .03" mass=".1"/>
    </body>
    <body name="held" pos="0 0 .5">
      <freejoint/>
      <geom type="box" size=".03 .03 .03" mass=".2"/>
    </body>
  </worldbody>
  <actuator><motor joint="finger"/></actuator>
</mujoco>
"""


def slip(step, seconds=2.0):
    """How far the held box goes down in the last second, and how fast it moves at the end."""
    model = mujoco.MjModel.from_xml_string(MODEL)
    data = mujoco.MjData(model)
    data.ctrl[:] = 5.0
    while data.time < seconds - 1.0:
        step(model, data)
    height = data.body("held").xpos[2]
    while data.time < seconds:
        step(model, data)
    return height - data.body("held").xpos[2], np.abs(data.qvel).max()


for name, step in (("MuJoCo", mujoco.mj_step), ("perp", perp.mujoco.step)):
    print("%-6s slips %.1e m in a second, velocity %.1e" % (name, *slip(step)))
