"""Equilibrium: what a decision costs, and what the step of a pile at rest costs with it.

    bench/run build statics        # or: BUILD=build python bench/statics.py bench/results

First table: perp.statics on the rows of assemblies (objective `interior`, which stops at the first
margin, and `least`), beside Clarabel on the same cones (max s; its own setup and solve), where that
is installed. Times are wall times of the solve in ms, medians of five.

Second table: steps of a world, processor time in ms. first: the first step; still: all bodies awake
(`wakeful`), nothing changes; touched: in each step another box is pushed with 1e-7 to 5 N; largest
velocity of any box in all these steps.

Third table: scenes on which exact solvers of other engines were reported to stop, 300 steps of 0.01 s,
all bodies awake, processor time in ms, and the largest distance that any body has moved in the end.
MuJoCo, where it is installed, takes the same bodies with its defaults and an elliptic cone; Bullet,
where its driver is built (bench/peers_world/build), with its 10 iterations.
"""

from __future__ import annotations

import os
import random
import subprocess
import sys
import tempfile
import time
from math import cos, isnan, nan, pi, radians, sin
from pathlib import Path

import numpy as np
import scipy.sparse as sparse

import motion
import motion_scenes
import perp

sys.path.insert(0, str(Path(__file__).parent.parent / "tests" / "zoo"))
import masonry  # noqa: E402
from scene import Scene, about  # noqa: E402

G = 9.81
Times = tuple[float, float, float, float]  # of the first step, median, mean and most


class Assembly:
    """Bodies, and contacts with a normal from a to b; -1 is the ground."""

    def __init__(self, mu: float) -> None:
        self.mu, self.places, self.masses = mu, [], []
        self.entries: list[tuple[int, int, float]] = []
        self.contacts = 0

    def body(self, place: tuple[float, float, float], mass: float) -> int:
        self.places.append(np.array(place))
        self.masses.append(mass)
        return len(self.places) - 1

    def contact(self, a: int, b: int, point: tuple[float, float, float], normal: tuple) -> None:
        n = np.array(normal, float)
        t = np.cross(n, (0, 1, 0) if abs(n[1]) < 0.9 else (1, 0, 0))
        t /= np.linalg.norm(t)
        for k, axis in enumerate((n, t, np.cross(n, t))):
            for body, sign in ((a, -1.0), (b, 1.0)):
                if body < 0:
                    continue
                row = sign * np.append(axis, np.cross(np.array(point) - self.places[body], axis))
                self.entries += [
                    (3 * self.contacts + k, 6 * body + j, row[j]) for j in range(6) if row[j]
                ]
        self.contacts += 1

    def rows(self) -> sparse.csc_matrix:
        i, j, x = zip(*self.entries)
        return sparse.csc_matrix((x, (i, j)), shape=(3 * self.contacts, 6 * len(self.places)))

    def weight(self) -> np.ndarray:
        f = np.zeros(6 * len(self.places))
        f[2::6] = -G * np.array(self.masses)
        return f


def pyramid(levels: int) -> Assembly:
    one, boxes = Assembly(0.5), {}
    for level in range(levels):
        for i in range(levels - level):
            x = i - (levels - level - 1) / 2
            boxes[level, i] = b = one.body((x, 0.0, level + 0.5), 1.0)
            below = [(-1, x)] if level == 0 else [
                (boxes[level - 1, j], x - 0.5 + (j - i)) for j in (i, i + 1)
            ]
            for other, x0 in below:
                low, high = (x - 0.5, x + 0.5) if other < 0 else (max(x, x0) - 0.5, min(x, x0) + 0.5)
                for px in (low, high):
                    for py in (-0.5, 0.5):
                        one.contact(other, b, (px, py, level), (0, 0, 1))
    return one


def arch(stones: int, ratio: float, mu: float = 0.7) -> Assembly:
    """A semicircle of middle radius 10, with thickness 10 ratio."""
    one, inner, outer = Assembly(mu), 10 - 5 * ratio, 10 + 5 * ratio
    step = np.pi / stones
    centre = 2 / 3 * (outer**3 - inner**3) / (outer**2 - inner**2) * np.sin(step / 2) / (step / 2)
    for k in range(stones):
        angle = (k + 0.5) * step
        one.body((-centre * np.cos(angle), 0, centre * np.sin(angle)), (outer**2 - inner**2) * step)
    for k in range(stones + 1):
        s, c = np.sin(k * step), np.cos(k * step)
        for r in (inner, outer):
            for y in (-0.5, 0.5):
                one.contact(k - 1, k if k < stones else -1, (-r * c, y, r * s), (s, 0, c))
    return one


def by_clarabel(one: Assembly) -> str:
    """max s with r_n - s w >= |r_t| / mu, all weights w the mean weight."""
    try:
        import clarabel
    except ImportError:
        return f"{'-':>10}"
    H, f = one.rows(), one.weight()
    m, n, w = H.shape[0], H.shape[1], G * float(np.mean(one.masses))
    balance = sparse.hstack([H.T, sparse.csc_matrix((n, 1))])
    scale = np.tile([one.mu, 1.0, 1.0], one.contacts)
    margin = sparse.csc_matrix(np.tile([one.mu * w, 0.0, 0.0], one.contacts)[:, None])
    cones = sparse.hstack([-sparse.diags(scale), margin])
    most = sparse.csc_matrix(([1.0], ([0], [m])), shape=(1, m + 1))
    A = sparse.vstack([balance, cones, most]).tocsc()
    b = np.concatenate((-f, np.zeros(m), [1.0]))
    kinds = [clarabel.ZeroConeT(n)] + [clarabel.SecondOrderConeT(3)] * one.contacts
    kinds.append(clarabel.NonnegativeConeT(1))
    q = np.zeros(m + 1)
    q[m] = -1.0
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    found = clarabel.DefaultSolver(
        sparse.csc_matrix((m + 1, m + 1)), q, A, b, kinds, settings
    ).solve()
    return f"{1e3 * found.solve_time:10.2f}"


def decisions() -> list[str]:
    cases = [(f"pyramid of {k * (k + 1) // 2}", pyramid(k)) for k in (5, 20, 40)]
    cases += [(f"arch of {n}, t/R {t}", arch(n, t)) for n, t in (
        (25, 0.2), (25, 0.115), (25, 0.10), (101, 0.15), (101, 0.11), (101, 0.105))]
    lines = [
        f"{'':<22}{'bodies':>7}{'contacts':>9}{'verdict':>9}{'interior':>10}{'factors':>8}"
        f"{'us/contact':>11}{'least':>10}{'factors':>8}{'unbalance':>10}{'Clarabel':>10}"
    ]
    for name, one in cases:
        H, f, mu = one.rows(), one.weight(), np.full(one.contacts, one.mu)
        told = []
        for objective in ("interior", "least"):
            runs = [perp.statics(H, f, mu, objective=objective) for _ in range(5)]
            told.append((np.median([r.seconds for r in runs]), runs[0]))
        (first, r), (least, last) = told
        lines.append(
            f"{name:<22}{len(one.places):>7}{one.contacts:>9}{r.verdict:>9}{1e3 * first:>10.2f}"
            f"{r.iterations:>8}{1e6 * first / one.contacts:>11.1f}{1e3 * least:>10.2f}"
            f"{last.iterations:>8}{last.unbalance:>10.1e}{by_clarabel(one)}"
        )
    return lines


def world_of(accuracy: str, wakeful: bool) -> tuple[perp.World, list[perp.Body]]:
    world = perp.World(accuracy=accuracy, wakeful=wakeful)
    world.ground.add_plane((0, 0, 1), 0, friction=0.5)
    boxes = []
    for place in pyramid(20).places:
        boxes.append(world.add_body(mass=1, position=place))
        boxes[-1].add_box((0.5, 0.5, 0.5), friction=0.5)
    return world, boxes


def timed(world: perp.World) -> float:
    start = time.process_time()
    world.step(0.01)
    return 1e3 * (time.process_time() - start)


def steps() -> list[str]:
    lines = [
        f"{'pyramid of 210':<16}{'contacts':>9}{'first':>9}{'still':>9}"
        f"{'touched':>9}{'mean':>9}{'most':>9}{'velocity':>10}"
    ]
    for accuracy in ("fast", "standard", "accurate", "exact"):
        world, boxes = world_of(accuracy, True)
        first = timed(world)
        still = [timed(world) for _ in range(30)]
        world, boxes = world_of(accuracy, False)
        timed(world)
        chance, touched, fastest = random.Random(1), [], 0.0
        for _ in range(200):
            box = chance.choice(boxes)
            push = 10 ** chance.uniform(-7, 0.7)
            angle = chance.uniform(0, 2 * np.pi)
            box.force = (push * np.cos(angle), push * np.sin(angle), 0)
            touched.append(timed(world))
            box.force = (0, 0, 0)
            fastest = max(fastest, np.abs(world.velocities).max())
        lines.append(
            f"{accuracy:<16}{world.stats().contacts:>9}{first:>9.2f}{np.median(still):>9.3f}"
            f"{np.median(touched):>9.3f}{np.mean(touched):>9.3f}{max(touched):>9.2f}{fastest:>10.1e}"
        )
    return lines


def house_of_cards(levels: int) -> Scene:
    """Cards of .9 x .6 m, 1 cm thick, leaning by 15 degrees; mu is 1.5 times what they need."""
    lean, length, thick = radians(15), 0.9, 0.01
    scene, z = Scene(1.5 * sin(lean) / cos(lean)), 0.0
    width = 2 * (length * sin(lean) + thick * cos(lean))
    height = length * cos(lean) + thick * sin(lean)
    scene.add_floor()
    for count in range(levels, 0, -1):
        for c in range(2 * count):
            side = 1 if c % 2 else -1
            x = (c // 2 - (count - 1) / 2) * width + side * width / 4
            turn = about("y", -side * lean)
            scene.add_box((x, 0, z + height / 2), (thick / 2, 0.3, length / 2), 1000, turn=turn)
        z += height
        for c in range(count - 1):
            x = (c - (count - 2) / 2) * width
            scene.add_box((x, 0, z + thick / 2), (width / 2 - 0.001, 0.3, thick / 2), 1000)
        z += thick
    return scene


def arch_of_wedges(stones: int, thickness: float) -> Scene:
    scene = Scene(0.7)
    scene.notes["density"] = 1000
    scene.add_floor()
    masonry.ring(scene, 0, 0.1, thickness, [pi * k / stones for k in range(stones + 1)], False)
    return scene


def summary(times: list[float]) -> Times:
    return times[0], np.median(times), np.mean(times), max(times)


def run_perp(scene: Scene, accuracy: str) -> tuple[Times, float]:
    world, bodies = scene.build(accuracy, wakeful=True)
    moving = [bodies[k].index for k in scene.dynamic()]
    begin = world.positions[moving].copy()
    times = [timed(world) for _ in range(300)]
    moved = world.positions[moving] - begin
    return summary(times), float(np.linalg.norm(moved, axis=1).max())


def run_mujoco(scene: Scene) -> tuple[Times, float]:
    import mujoco

    spec = mujoco.MjSpec()
    spec.option.cone, spec.option.timestep = mujoco.mjtCone.mjCONE_ELLIPTIC, 0.01
    for k, part in enumerate(scene.parts):
        shape = part.shapes[0]
        told = {"friction": (scene.friction, 0, 0), "condim": 3}
        if shape.kind == "plane":
            spec.worldbody.add_geom(
                type=mujoco.mjtGeom.mjGEOM_PLANE, size=(40, 40, 1), **told)
            continue
        body = spec.worldbody.add_body(pos=part.position, quat=part.turn)
        body.add_freejoint()
        if shape.kind == "box":
            body.add_geom(
                type=mujoco.mjtGeom.mjGEOM_BOX, size=shape.half, mass=part.mass, **told)
        else:
            spec.add_mesh(name=f"stone{k}", uservert=shape.corners().ravel())
            body.add_geom(
                type=mujoco.mjtGeom.mjGEOM_MESH, meshname=f"stone{k}", mass=part.mass, **told)
    model = spec.compile()
    data, times = mujoco.MjData(model), []
    begin = data.qpos.reshape(-1, 7)[:, :3].copy()
    for _ in range(300):
        start = time.process_time()
        mujoco.mj_step(model, data)
        times.append(1e3 * (time.process_time() - start))
    moved = data.qpos.reshape(-1, 7)[:, :3] - begin
    return summary(times), float(np.linalg.norm(moved, axis=1).max())


def run_bullet(scene: Scene) -> tuple[Times, float]:
    """Its driver tells the mean, median and largest time of a step, not the first. The half-space
    below is its ground."""
    told = motion_scenes.Scene("assembly", 300, scene.friction)
    for part in scene.parts:
        shape = part.shapes[0]
        if shape.kind == "box":
            told.box(shape.half, part.mass, part.position, turn=part.turn)
        elif shape.kind != "plane":
            corners = shape.corners()
            squares = np.square(np.ptp(corners, axis=0) / 2)  # inertia as of a box
            told.body(motion_scenes.HULL, part.mass, part.mass / 3 * (squares.sum() - squares),
                      part.position, corners.ravel(), part.turn)
    with tempfile.TemporaryDirectory() as folder:
        told.write(Path(folder))
        words = subprocess.run([motion.PEER, Path(folder, "assembly.scene")], text=True,
                               capture_output=True, check=True).stdout.split()
    numbers = motion.read(" ".join(words))
    times = tuple(float(numbers[name][0]) for name in ("median", "mean", "max"))
    return (nan, *times), float(numbers["moved"][0])


def troubles() -> list[str]:
    cases = [
        ("26 cards", house_of_cards(4)),
        ("155 cards", house_of_cards(10)),
        ("arch of 25, t/R .115", arch_of_wedges(25, 0.115)),
        ("arch of 101, t/R .15", arch_of_wedges(101, 0.15)),
    ]
    runs = [(level, lambda scene, level=level: run_perp(scene, level))
            for level in ("fast", "standard", "accurate", "exact")]
    try:
        import mujoco  # noqa: F401
        runs.append(("mujoco", run_mujoco))
    except ImportError:
        pass
    if os.access(motion.PEER, os.X_OK):
        runs.append(("bullet", run_bullet))
    lines = [f"{'':<22}{'':<10}{'first':>9}{'median':>9}{'mean':>9}{'most':>9}{'moved (m)':>11}"]
    for name, scene in cases:
        for level, run in runs:
            times, moved = run(scene)
            lines.append(
                f"{name:<22}{level:<10}{'-' if isnan(times[0]) else f'{times[0]:.2f}':>9}{times[1]:>9.3f}"
                f"{times[2]:>9.3f}{times[3]:>9.2f}{moved:>11.1e}")
    return lines


def main() -> None:
    text = "\n".join([
        __doc__.strip(), "", os.environ.get("MACHINE", ""), "", *decisions(), "", *steps(), "",
        *troubles(), "",
    ])
    Path(sys.argv[1], "statics.txt").write_text(text)
    print(text)


if __name__ == "__main__":
    main()
