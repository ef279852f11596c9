"""What derivatives of a step cost: perp.mujoco.derivatives beside mujoco.mjd_transitionFD.

    bench/run build mujoco_derivatives   needs mujoco, dm_control and gymnasium

Each model runs .8 s with perp from its first place with a control of .1; there both are asked for A
and B, by differences from both sides, taking turns, 40 times. Times are of the thread's processor,
in us, medians; share: perp's over MuJoCo's; rows: of J. MuJoCo's are differences of its soft
contacts, perp's of the exact ones.

two links   two hinges with three actuators, nothing touches
box         a box rests on its four corners
the others  dm_control's suite, and gymnasium's ant
"""

import os
import sys
import time

import mujoco
import numpy as np
from mujoco_models import ant, suite

import perp.mujoco

LINKS = """<mujoco><worldbody><body><joint name="a" axis="0 1 0" damping=".2"/>
<geom type="capsule" size=".03" fromto="0 0 0 .5 0 0"/><body pos=".5 0 0">
<joint name="b" axis="0 1 0"/><geom type="capsule" size=".02" fromto="0 0 0 .3 0 -.1"/></body></body></worldbody>
<actuator><motor joint="a"/><motor joint="b"/><position joint="b" kp="9"/></actuator></mujoco>"""
BOX = """<mujoco><worldbody><geom type="plane" size="5 5 .1"/><body pos="0 0 .0999"><freejoint/>
<geom type="box" size=".1 .1 .1"/></body></worldbody></mujoco>"""
SUITE = "hopper", "walker", "cheetah", "quadruped", "humanoid", "dog"
MODELS = {
    "two links": lambda: mujoco.MjModel.from_xml_string(LINKS),
    "box": lambda: mujoco.MjModel.from_xml_string(BOX),
    "ant": ant,
    **{name: lambda name=name: suite(name) for name in SUITE},
}


def clock(function):
    began = time.thread_time_ns()
    function()
    return (time.thread_time_ns() - began) * 1e-3


def main():
    head = f"{'model':10} {'nv':>3} {'nu':>3} {'rows':>4}"
    head += "".join(f"{x:>9}" for x in ("MuJoCo", "perp")) + f" {'share':>6}  verdict"
    doc = __doc__.split("\n    bench/run")
    lines = [doc[0].strip(), "", __doc__[__doc__.index("Each") :].strip(), ""]
    lines += [os.environ.get("MACHINE", ""), f"mujoco {mujoco.__version__}", "", head]
    for name, make in MODELS.items():
        model = make()
        data = mujoco.MjData(model)
        data.ctrl[:] = 0.1
        perp.mujoco.simulate(model, data, 0.8)
        n = 2 * model.nv + model.na
        A, B = np.zeros((n, n)), np.zeros((n, model.nu))
        found, times = perp.mujoco.derivatives(model, data), []
        for _ in range(40):
            theirs = clock(
                lambda: mujoco.mjd_transitionFD(model, data, 1e-6, True, A, B, None, None)
            )
            times.append((theirs, clock(lambda: perp.mujoco.derivatives(model, data))))
        theirs, ours = np.median(times, axis=0)
        lines.append(
            f"{name:10} {model.nv:3d} {model.nu:3d} {data.nefc:4d} {theirs:8.0f} {ours:8.0f}"
            f" {ours / theirs:6.2f}  {found.verdict}"
        )
        print(lines[-1], file=sys.stderr, flush=True)
    if len(sys.argv) == 2:
        with open(os.path.join(sys.argv[1], "mujoco_derivatives.txt"), "w") as file:
            file.write("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
