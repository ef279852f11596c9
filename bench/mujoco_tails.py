"""What a step of perp.mujoco costs beside mj_step's, its worst steps included, on every model that
packages carry.

    bench/run build mujoco_tails         needs mujoco, dm_control, gymnasium, gymnasium-robotics

Every MJCF file of these packages that loads, has velocities and touches something in its run: each
engine makes 1000 steps from the model's first key frame, or its first place, with the same random
controls, new ones every 50 steps; what has no floor gets one below its lowest point. Both have the
model's own options, MuJoCo its own solver and cone. Times are of the thread's processor, in us, the
engines taking turns of 50 steps. median, mean, p99 and worst: perp's over MuJoCo's own median, mean,
p99 and worst; failed: steps of perp's that were not solved; contacts, rows: the most of a step.
The two go different ways, and one may lie in a heap while the other is in the air: 'same states'
are the same ratios with MuJoCo's steps from each of perp's states, its warm start that of the step
before; 'for accuracy' those with elliptic cones and ten iterations of noslip, from these states too.
"""

import copy
import importlib.util
import os
import sys
import time

import mujoco
import numpy as np

import perp.mujoco

PACKAGES = "dm_control", "gymnasium", "gymnasium_robotics"
STEPS, TURN = 1000, 50
STATE = mujoco.mjtState.mjSTATE_FULLPHYSICS


def files():
    """Of each package, sorted; models that differ in nothing but their name come twice."""
    for package in PACKAGES:
        root = os.path.dirname(importlib.util.find_spec(package).origin)
        for folder, _, names in sorted(os.walk(root)):
            for name in sorted(names):
                if name.endswith(".xml") and "test" not in folder:
                    yield package, os.path.join(folder, name)


def load(path):
    spec = mujoco.MjSpec.from_file(path)
    model = spec.compile()
    if model.nv == 0:
        return None
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    kinds = model.geom_type
    if not np.isin(kinds, [mujoco.mjtGeom.mjGEOM_PLANE, mujoco.mjtGeom.mjGEOM_HFIELD]).any():
        low = (data.geom_xpos[:, 2] - model.geom_rbound).min(initial=0.0)
        spec.worldbody.add_geom(
            name="a floor", type=mujoco.mjtGeom.mjGEOM_PLANE, size=[9, 9, 1], pos=[0, 0, low]
        )
        model = spec.compile()
    return model


class Track:
    def __init__(self, model, step):
        self.model, self.step, self.times, self.failed = model, step, [], 0
        self.states = []
        self.data = mujoco.MjData(model)
        if model.nkey:
            mujoco.mj_resetDataKeyframe(model, self.data, 0)

    def turn(self, control, states=(None,) * TURN):
        self.data.ctrl[:] = control
        self.states = []
        for state in states:
            if state is not None:
                mujoco.mj_setState(self.model, self.data, state, STATE)
            self.states.append(np.empty(mujoco.mj_stateSize(self.model, STATE)))
            mujoco.mj_getState(self.model, self.data, self.states[-1], STATE)
            began = time.thread_time_ns()
            said = self.step(self.model, self.data)
            self.times.append((time.thread_time_ns() - began) * 1e-3)
            self.failed += said is not None and not said.ok

    def numbers(self):
        t = np.array(self.times)
        return np.array([np.median(t), t.mean(), np.percentile(t, 99), t.max()])


def run(model, seed):
    rng, most = np.random.default_rng(seed), (0, 0)
    stepper = perp.mujoco.Stepper(model, rigid=True)
    theirs, ours = Track(model, mujoco.mj_step), Track(model, lambda _, d: stepper.step(d))
    same = Track(model, mujoco.mj_step)
    accurate = copy.deepcopy(model)
    accurate.opt.cone, accurate.opt.noslip_iterations = mujoco.mjtCone.mjCONE_ELLIPTIC, 10
    sharp = Track(accurate, mujoco.mj_step)
    low, high = np.where(model.actuator_ctrllimited[:, None], model.actuator_ctrlrange, (-1, 1)).T
    for _ in range(STEPS // TURN):
        control = rng.uniform(low, high)
        theirs.turn(control)
        ours.turn(control)
        same.turn(control, ours.states)
        sharp.turn(control, ours.states)
        most = max(most, (ours.data.ncon, ours.data.nefc))
    return theirs, ours, same, sharp, most


def main():
    head = f"{'model':52} {'nv':>3} {'con':>4} {'rows':>4} {'MuJoCo':>7} {'perp':>7}"
    ratios = "median", "mean", "p99"
    head += "".join(f"{x:>7}" for x in (*ratios, "worst", "failed", *ratios, *ratios))
    above = f"{'':82}{'own paths':>28}{'same states':>28}{'for accuracy':>21}"
    doc = __doc__.split("\n    bench/run")
    lines = [doc[0].strip(), "", __doc__[__doc__.index("Every") :].strip(), ""]
    lines += [os.environ.get("MACHINE", ""), f"mujoco {mujoco.__version__}", "", above, head]
    all_of_them, seen = [], set()
    for package, path in files():
        name = package + path.split(package, 1)[1][:-4]
        if len(sys.argv) > 2 and not any(word in name for word in sys.argv[2:]):
            continue
        try:
            model = load(path)
        except ValueError:  # a part of a model
            continue
        key = None if model is None else (model.nv, model.nu, model.ngeom, model.body_mass.sum())
        if model is None or key in seen:
            continue
        seen.add(key)
        theirs, ours, same, sharp, (contacts, rows) = run(model, 1)
        if contacts == 0:
            continue
        a, b, c, d = (track.numbers() for track in (theirs, ours, same, sharp))
        others = np.concatenate([b[:3] / c[:3], b[:3] / d[:3]])
        all_of_them.append(np.concatenate([b / a, others]))
        short = name if len(name) <= 52 else ".." + name[-50:]
        row = f"{short:52} {model.nv:3d} {contacts:4d} {rows:4d} {a[1]:7.0f} {b[1]:7.0f}"
        row += "".join(f"{x:7.1f}" for x in b / a) + f"{ours.failed:7d}"
        lines.append(row + "".join(f"{x:7.1f}" for x in others))
        print(lines[-1], file=sys.stderr, flush=True)
    middle = np.median(all_of_them, axis=0)
    name = f"the middle of {len(all_of_them)} models"
    row = f"{name:52} {'':29}" + "".join(f"{x:7.1f}" for x in middle[:4])
    lines.append(row + " " * 7 + "".join(f"{x:7.1f}" for x in middle[4:]))
    print(lines[-1], file=sys.stderr)
    if len(sys.argv) == 2:
        with open(os.path.join(sys.argv[1], "mujoco_tails.txt"), "w") as file:
            file.write("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
