"""Robots that packages carry, stepped by MuJoCo and by perp.mujoco from the same states.

    bench/run build mujoco_models        needs mujoco, dm_control and gymnasium

Every scene runs its seconds with each engine; both have elliptic cones. What is shown is of the last
second: speed, the largest of qvel in its last tenth; creep, how far the furthest coordinate moved in
it (m or rad); depth, of the deepest overlap at the end; law, the largest violation of Signorini's and
Coulomb's law by a contact, a velocity: t |r - P_K(r - (u + mu |u_t| e_n) / t)| with t the trace of the
contact's block of J M^-1 J', recomputed here for both; time, the median of a step in us, the engines
taking turns; half, the same over the first half of the run, when what falls moves; failed, steps of
perp's that were not solved.

slope      a box on a slope of 0.5, friction 0.6
gripper    a box of 0.2 kg between a wall and a finger of 5 N, friction 1
hand       Kinova's hand holds a ball of 0.1 kg, lying; perp grips for both, then gravity sets in
humanoid   dm_control's, stands: joints are springs of 1000 Nm, ten times damped
lying      the same without springs, with dry friction of 1 Nm in its joints, where it fell
quadruped  dm_control's, stands on its springs
walker     dm_control's, falls and lies
ant        gymnasium's, stands
stacker    dm_control's, four boxes and an arm, falls in a heap
dog        dm_control's, 85 velocities, falls and lies
"""

import importlib.util
import os
import sys
import time

import mujoco
import numpy as np

import perp.mujoco

G = 9.81


def package(name, *path):
    return os.path.join(os.path.dirname(importlib.util.find_spec(name).origin), *path)


def suite(name):
    return mujoco.MjModel.from_xml_path(package("dm_control", "suite", name + ".xml"))


def slope():
    return mujoco.MjModel.from_xml_string(f"""<mujoco>
        <option timestep=".002" gravity="{G / 1.25**0.5 * 0.5} 0 {-G / 1.25**0.5}"/><worldbody>
        <geom type="plane" size="5 5 .1" friction=".6"/><body pos="0 0 .055"><freejoint/>
        <geom type="box" size=".1 .1 .05" friction=".6"/></body></worldbody></mujoco>""")


def gripper():
    return mujoco.MjModel.from_xml_string("""<mujoco><option timestep=".002"/><worldbody>
        <geom type="box" pos="-.0399 0 .5" size=".01 .03 .03"/><body pos=".0399 0 .5">
        <joint name="r" type="slide" axis="-1 0 0"/><geom type="box" size=".01 .03 .03" mass=".1"/>
        </body><body pos="0 0 .5"><freejoint/><geom type="box" size=".03 .03 .03" mass=".2"/></body>
        </worldbody><actuator><motor joint="r"/></actuator></mujoco>""")


def hand():
    spec = mujoco.MjSpec.from_file(package("dm_control", "third_party", "kinova", "jaco_hand.xml"))
    ball = spec.worldbody.add_body(name="ball", pos=[0, 0, 0.15])
    ball.add_freejoint()
    ball.add_geom(
        type=mujoco.mjtGeom.mjGEOM_SPHERE, size=[0.03, 0, 0], mass=0.1, condim=4,
        friction=[1, 0.005, 0.0001], contype=3, conaffinity=3,
    )  # fmt: skip
    return spec.compile()


def stiff():
    model = suite("humanoid")
    model.jnt_stiffness[1:] = 1000.0
    model.dof_damping[6:] *= 10.0
    return model


def dry():
    model = suite("humanoid")
    model.dof_frictionloss[6:] = 1.0
    return model


def ant():
    model = mujoco.MjModel.from_xml_path(
        package("gymnasium", "envs", "mujoco", "assets", "ant.xml")
    )
    model.opt.integrator = mujoco.mjtIntegrator.mjINT_EULER  # both alike
    return model


def grip(model, data):
    """Closes the hand without gravity."""
    data.qpos[:3], data.qfrc_applied[:3] = 0.3, 1.0
    model.opt.gravity[:] = 0.0
    perp.mujoco.simulate(model, data, 3.0)
    model.opt.gravity[0] = G


def press(model, data):
    data.ctrl[:] = 5.0


def stand(model, data):
    data.qpos[2] = 1.28


SCENES = {
    "slope": (slope, 2, None),
    "gripper": (gripper, 2, press),
    "hand": (hand, 2, grip),
    "humanoid": (stiff, 8, stand),
    "lying": (dry, 5, None),
    "quadruped": (lambda: suite("quadruped"), 3, None),
    "walker": (lambda: suite("walker"), 6, None),
    "ant": (ant, 4, None),
    "stacker": (lambda: suite("stacker"), 4, None),
    "dog": (lambda: suite("dog"), 3, None),
}


def violation(model, data, rigid):
    """Of the step that was made: J and forces are of its start, qvel of its end. MuJoCo's contacts
    bear at their margins, perp's where surfaces meet; perp's J is dense up to 120 velocities."""
    which = np.flatnonzero((data.contact.efc_address >= 0) & (data.contact.dim >= 3))
    if not len(which):
        return 0.0
    J = np.zeros((data.nefc, model.nv))
    if mujoco.mj_isSparse(model) and not (rigid and model.nv <= 120):
        mujoco.mju_sparse2dense(
            J, data.efc_J.ravel(), data.efc_J_rownnz, data.efc_J_rowadr, data.efc_J_colind
        )
    else:
        J = data.efc_J.reshape(J.shape)
    M = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, M)
    rows = data.contact.efc_address[which, None] + np.arange(3)
    blocks = J[rows]  # contacts, 3, n
    moved = np.linalg.solve(M, blocks.reshape(-1, model.nv).T).T.reshape(blocks.shape)
    t = np.einsum("kin,kin->k", blocks, moved)
    u = blocks @ data.qvel
    if rigid:
        u[:, 0] += np.maximum(data.contact.dist[which], 0.0) / model.opt.timestep
    r = data.efc_force[rows] * model.opt.timestep
    mu = data.contact.friction[which, 0]
    x = r - u / t[:, None]
    x[:, 0] -= mu * np.hypot(u[:, 1], u[:, 2]) / t
    n, f = x[:, 0], np.hypot(x[:, 1], x[:, 2])
    on_rim = np.maximum((n + mu * f) / (1.0 + mu * mu), 0.0)
    inside, below = f <= mu * n, mu * f <= -n
    near = np.stack([on_rim, *(mu * on_rim * x[:, 1:].T / np.maximum(f, 1e-300))], axis=1)
    near = np.where(inside[:, None], x, np.where(below[:, None], 0.0, near))
    return (t * np.linalg.norm(r - near, axis=1)).max()


class Track:
    """One engine's way through a scene."""

    def __init__(self, model, data, step):
        self.model, self.data, self.step = model, data, step
        self.times, self.speed, self.law = [], 0.0, 0.0

    def advance(self):
        began = time.perf_counter()
        said = self.step(self.data)
        self.times.append(time.perf_counter() - began)
        return said

    def numbers(self, steps):
        depth = max(-self.data.contact.dist.min(), 0.0) if self.data.ncon else 0.0
        creep = np.abs(self.data.qpos - self.before).max()
        half = self.times[: len(self.times) // 2]
        times = 1e6 * np.median(self.times[-steps:]), 1e6 * np.median(half)
        return self.speed, creep, depth, self.law, *times


def run(build, seconds, prepare):
    first = build()
    first.opt.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    start = mujoco.MjData(first)
    if prepare:
        prepare(first, start)
    tracks = []
    for engine in ("MuJoCo", "perp"):
        model, data = build(), mujoco.MjData(first)
        model.opt.cone, model.opt.gravity[:] = first.opt.cone, first.opt.gravity
        mujoco.mj_copyData(data, first, start)
        if engine == "perp":
            tracks.append(Track(model, data, perp.mujoco.Stepper(model).step))
        else:
            tracks.append(Track(model, data, lambda d, m=model: mujoco.mj_step(m, d)))
    steps, last = round(seconds / first.opt.timestep), round(1.0 / first.opt.timestep)
    failed = 0
    for k in range(steps):
        for track in tracks:
            if k == steps - last:
                track.before = track.data.qpos.copy()
            said = track.advance()
            failed += said is not None and not said.ok
            if k >= steps - last // 10:
                track.speed = max(track.speed, np.abs(track.data.qvel).max())
                track.law = max(track.law, violation(track.model, track.data, track is tracks[1]))
    return [track.numbers(last) for track in tracks], first.nv, failed


def main():
    lines = [
        __doc__.split("\n    bench/run")[0].strip(),
        "",
        __doc__[__doc__.index("Every") :].strip(),
    ]
    lines += ["", os.environ.get("MACHINE", ""), f"mujoco {mujoco.__version__}", ""]
    head = f"{'scene':10} {'nv':>3} {'engine':7} {'speed':>8} {'creep':>8} {'depth':>8} {'law':>8}"
    lines.append(f"{head} {'time':>6} {'ratio':>6} {'half':>6} {'ratio':>6} {'failed':>6}")
    for name, scene in SCENES.items():
        (theirs, ours), n, failed = run(*scene)
        for engine, numbers in (("MuJoCo", theirs), ("perp", ours)):
            row = f"{name:10} {n:3d} {engine:7} " + " ".join(f"{x:8.1e}" for x in numbers[:4])
            for time, other in zip(numbers[4:], theirs[4:]):
                row += f" {time:6.0f} " + (f"{time / other:6.1f}" if engine == "perp" else 6 * " ")
            row = row.rstrip() + (f" {failed:6d}" if engine == "perp" else "")
            lines.append(row)
            print(row, file=sys.stderr)
    with open(os.path.join(sys.argv[1], "mujoco_models.txt"), "w") as file:
        file.write("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
