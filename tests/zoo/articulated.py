"""A zoo of articulated systems that nothing drives, made from a seed: trees and loops of 1 to 30
links on joints of all kinds, rods, planks, flywheels, mass centres off the axes, spins of up to a
radian a step, masses 1e4 apart.

    python tests/zoo/articulated.py --count 100 --seed 0 --levels all --seconds 60
    python tests/zoo/articulated.py --seed 37 --count 1 --levels fast --verbose     # one again

Energy and what joints lack are computed from the states that bodies are in, by NumPy alone. Energy
has to stay below what it was, to 1e-3 of its scale: the kinetic energy of the start and the weight
times the size of all of it, which is what swings can exchange. Joints have to hold to 1e-6.
"""

from __future__ import annotations

import argparse
import sys
import time
from dataclasses import dataclass
from typing import Any, Optional

import numpy as np

GAIN, OPEN = 1e-3, 1e-6
LEVELS = ("fast", "standard", "accurate", "exact")
KINDS = ("ball", "revolute", "prismatic", "fixed", "screw", "cylindrical", "planar", "distance")
GRAVITY = np.array((0.0, 0.0, -9.81))
TURN = 2 * np.pi


def matrices(q: np.ndarray) -> np.ndarray:
    """Rotations of unit quaternions, one a row."""
    w, x, y, z = q.T
    rows = (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y),
            2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x),
            2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y))
    return np.stack(rows, axis=1).reshape(-1, 3, 3)


@dataclass
class Link:
    mass: float
    moments: np.ndarray  # about the mass centre, along the link's own axes
    position: np.ndarray
    orientation: np.ndarray
    velocity: np.ndarray
    spin: np.ndarray


@dataclass
class Hinge:
    kind: str
    a: int  # -1: the ground
    b: int
    anchor: np.ndarray
    anchor_b: np.ndarray
    axis: np.ndarray
    pitch: float


@dataclass
class System:
    links: list[Link]
    hinges: list[Hinge]
    gravity: np.ndarray
    dt: float
    size: float
    name: str


def direction(g: np.random.Generator) -> np.ndarray:
    x = g.standard_normal(3)
    return x / np.linalg.norm(x)


def moments_of(g: np.random.Generator, mass: float, length: float) -> np.ndarray:
    """Of a rod, a plank, a flywheel or a lump, longest along x."""
    kind = g.integers(4)
    if kind == 0:
        thin = length / g.uniform(5, 50)
        return mass * np.array((thin**2 / 8, length**2 / 12, length**2 / 12))
    if kind == 1:
        sides = length * np.array((1.0, g.uniform(0.1, 0.5), g.uniform(0.02, 0.1)))
        return mass * (np.sum(sides**2) - sides**2) / 12
    if kind == 2:
        thick = g.uniform(0.05, 0.3)
        moments = mass * length**2 * np.array((0.5, 0.25 + thick**2, 0.25 + thick**2)) / 4
        return moments[g.permutation(3)]
    parts = g.uniform(0.05, 1.0, 3)
    return mass * length**2 / 12 * (parts.sum() - parts)


def relative(g: np.random.Generator, hinge: Hinge, spin: float, length: float) -> tuple:
    """A velocity at the anchor and a spin of B beside A that the joint lets pass."""
    n = hinge.axis
    slide = n * g.uniform(-1, 1) * spin * length
    across = np.cross(n, direction(g)) * spin * length
    about = n * g.uniform(-1, 1) * spin
    free = direction(g) * g.uniform(0, 1) * spin
    none = np.zeros(3)
    return {"ball": (none, free), "revolute": (none, about), "prismatic": (0.1 * slide, none),
            "fixed": (none, none), "screw": (about * hinge.pitch / TURN, about),
            "cylindrical": (0.1 * slide, about), "planar": (0.1 * across, about),
            "distance": (0.1 * across, free)}[hinge.kind]


def make(seed: int) -> System:
    g = np.random.default_rng(seed)
    dt = 1 / g.choice((30, 60, 60, 100, 240, 1000))
    count = int(g.choice((1, 1, 2, 3, 5, 8, 15, 30)))
    shape = g.choice(("chain", "tree", "loop")) if count > 2 else "chain"
    anchored = bool(g.random() < 0.7)
    kinds = [str(g.choice(KINDS))] if g.random() < 0.5 else list(KINDS)
    length, orders = float(np.exp(g.uniform(-1.5, 1.5))), g.choice((0.0, 0.5, 2.0, 4.0))
    spin = float(np.exp(g.uniform(np.log(0.01), 0.0)) * g.choice((0.1, 1.0, 1.0))) / dt
    gravity = GRAVITY * (g.random() < 0.7)
    links: list[Link] = []
    hinges: list[Hinge] = []
    if shape == "loop":
        spots = ring(g, count, length)
    for k in range(count):
        parent = -1 if k == 0 else int(g.integers(k)) if shape == "tree" else k - 1
        mass = float(10 ** (orders * g.uniform(-0.5, 0.5)))
        off = g.uniform(0.05, 0.5) if g.random() < 0.7 else 0.0
        before = links[parent] if parent >= 0 else None
        base = before.position if before else np.zeros(3)
        axis = direction(g)
        anchor = base + length * g.uniform(0.2, 0.5) * direction(g) if before else base
        place = anchor + length * off * direction(g)
        if shape == "loop":
            anchor, place, axis = spots[k], 0.5 * (spots[k] + spots[k + 1]), np.array((0, 0, 1.0))
        q = direction_of(g, place - anchor)
        kind = "revolute" if shape == "loop" else str(g.choice(kinds))
        if kind == "distance" and np.linalg.norm(place - anchor) < 0.05 * length:
            kind = "ball"
        hinge = Hinge(kind, parent, k, anchor, place + 0.2 * (place - anchor) if
                      kind == "distance" else anchor, axis, length * g.uniform(0.2, 1.0))
        velocity, turn = np.zeros(3), np.zeros(3)
        if before or not anchored:
            velocity = before.velocity if before else direction(g) * spin * length * 0.1
            turn = before.spin if before else direction(g) * spin
            velocity = velocity + np.cross(turn, anchor - base)
        if shape != "loop" and (before or anchored):
            slide, extra = relative(g, hinge, 0.3 * spin if before else spin, length)
            if kind == "distance":  # across the rod that joins both anchors
                rod = hinge.anchor_b - anchor
                slide = slide - rod * (slide @ rod) / (rod @ rod)
                slide = slide + np.cross(turn, rod) + np.cross(turn + extra, anchor - hinge.anchor_b)
            velocity, turn = velocity + slide, turn + extra
        if shape == "loop" and anchored and k == 0:
            turn = spin * axis
        velocity = velocity + np.cross(turn, place - anchor)
        links.append(Link(mass, moments_of(g, mass, length), place, q, velocity, turn))
        if before or anchored:
            hinges.append(hinge)
    if shape == "loop":
        hinges.append(Hinge("revolute", count - 1, 0, spots[0], spots[0], np.array((0, 0, 1.0)), 1))
    name = f"{count} {shape} {'anchored' if anchored else 'free'} {'/'.join(kinds[:1])}" \
           f"{'+' if len(kinds) > 1 else ''} spin {spin * dt:.2g} a step, masses 1e{orders:g}, " \
           f"dt 1/{1 / dt:.0f}{'' if gravity.any() else ', no gravity'}"
    return System(links, hinges, gravity, float(dt), length, name)


def ring(g: np.random.Generator, count: int, length: float) -> np.ndarray:
    """Corners of a polygon in x and y, the first one again at its end."""
    angles = np.sort(g.uniform(0, 1, count) * 0.6 + np.arange(count)) * TURN / count
    radius = length * count / TURN
    corners = radius * np.stack((np.cos(angles), np.sin(angles), 0 * angles), axis=1)
    corners -= corners[0]
    return np.vstack((corners, corners[:1]))


def direction_of(g: np.random.Generator, along: np.ndarray) -> np.ndarray:
    """A quaternion that brings x there, or anywhere."""
    size = np.linalg.norm(along)
    if size == 0 or g.random() < 0.3:
        q = g.standard_normal(4)
    else:
        x = along / size
        q = np.r_[1 + x[0], np.cross((1, 0, 0), x)]
        if q[0] < 1e-6:
            q = np.array((0.0, 0.0, 1.0, 0.0))
    return q / np.linalg.norm(q)


class Judge:
    """Energy and what joints lack, of arrays of states."""

    def __init__(self, system: System) -> None:
        self.system = system
        self.mass = np.array([link.mass for link in system.links])
        self.moments = np.array([link.moments for link in system.links])
        places = np.array([link.position for link in system.links])
        turns = matrices(np.array([link.orientation for link in system.links]))
        self.sides = []
        for hinge in system.hinges:
            side = []
            for body, anchor in ((hinge.a, hinge.anchor), (hinge.b, hinge.anchor_b)):
                R, x = (turns[body], places[body]) if body >= 0 else (np.eye(3), np.zeros(3))
                frame = np.linalg.qr(np.c_[hinge.axis, np.eye(3)[:, :2] + 0.1])[0]
                side.append((body, R.T @ (anchor - x), R.T @ frame))
            self.sides.append(side)

    def energy(self, x: Any, q: Any, v: Any, w: Any) -> tuple[float, float]:
        own = np.einsum("kji,kj->ki", matrices(q), w)
        kinetic = 0.5 * (self.mass @ np.sum(v * v, 1) + np.sum(self.moments * own * own))
        return kinetic, -float(self.mass @ (x @ self.system.gravity))

    def lack(self, x: Any, q: Any) -> float:
        turns, worst = matrices(q), 0.0
        for hinge, side in zip(self.system.hinges, self.sides):
            p, frames = [], []
            for body, anchor, frame in side:
                R, at = (turns[body], x[body]) if body >= 0 else (np.eye(3), np.zeros(3))
                p.append(at + R @ anchor)
                frames.append(R @ frame)
            d, n = p[1] - p[0], frames[0][:, 0]
            tilt = float(np.linalg.norm(np.cross(n, frames[1][:, 0])))
            twist = float(np.abs(frames[0] - frames[1]).max())
            size = self.system.size
            gap, along = float(np.linalg.norm(d)) / size, float(abs(n @ d)) / size
            aside = float(np.linalg.norm(d - n * (n @ d))) / size
            rod = np.linalg.norm(hinge.anchor_b - hinge.anchor)
            lack = {"ball": gap, "revolute": max(gap, tilt), "fixed": max(gap, twist),
                    "prismatic": max(aside, twist), "cylindrical": max(aside, tilt),
                    "screw": max(aside, tilt), "planar": max(along, tilt),
                    "distance": float(abs(np.linalg.norm(d) - rod)) / size}
            worst = max(worst, lack[hinge.kind])
        return worst


@dataclass
class Verdict:
    wrong: Optional[str]
    gain: float  # most, and what is lost in the end, of the scale
    loss: float
    lack: float
    seconds: float  # a step


def build(system: System, accuracy: str) -> tuple[Any, list[Any]]:
    import perp

    world = perp.World(gravity=system.gravity, accuracy=accuracy)
    bodies = [world.add_body(mass=link.mass, inertia=np.diag(link.moments), position=link.position,
                             orientation=link.orientation, velocity=link.velocity,
                             angular_velocity=link.spin) for link in system.links]
    for hinge in system.hinges:
        more: dict[str, Any] = {"axis": hinge.axis}
        if hinge.kind == "distance":
            more["anchor_b"] = hinge.anchor_b
        if hinge.kind == "screw":
            more["pitch"] = hinge.pitch
        a = bodies[hinge.a] if hinge.a >= 0 else world.ground
        world.add_joint(hinge.kind, a, bodies[hinge.b], anchor=hinge.anchor, **more)
    return world, bodies


def run(system: System, accuracy: str, seconds: float, limit: float = np.inf) -> Verdict:
    """limit: of the processor time of its steps."""
    import perp

    judge = Judge(system)
    world, bodies = build(system, accuracy)
    rows = [body.index for body in bodies]
    kinetic, potential = judge.energy(world.positions[rows], world.orientations[rows],
                                      world.velocities[rows], world.angular_velocities[rows])
    start = kinetic + potential
    reach = len(rows) * system.size
    scale = kinetic + judge.mass.sum() * np.linalg.norm(system.gravity) * reach or 1.0
    gain, lack, used, energy, wrong, k = -np.inf, 0.0, 0.0, start, None, 0
    try:
        for k in range(round(seconds / system.dt)):
            begun = time.process_time()
            result = world.step(system.dt)
            used += time.process_time() - begun
            x, q = world.positions[rows], world.orientations[rows]
            energy = sum(judge.energy(x, q, world.velocities[rows], world.angular_velocities[rows]))
            gain = max(gain, (energy - start) / scale)
            if k % 7 == 0:
                lack = max(lack, judge.lack(x, q))
            if not result.advanced:
                wrong = f"not taken: {result.outcome}"
            elif not gain <= GAIN:
                wrong = f"gains {gain:.1e}"
            elif not lack <= OPEN:
                wrong = f"opens by {lack:.1e}"
            if wrong:
                wrong = f"step {k + 1}: {wrong} ({result.outcome})"
            if wrong or used > limit:
                break
    except perp.Error as error:
        wrong = f"step {k + 1} raises {type(error).__name__}: {error}"
    world.close()
    return Verdict(wrong, gain, (start - energy) / scale, lack, used / (k + 1))


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--count", type=int, default=48, help="of systems")
    parser.add_argument("--seed", type=int, default=0, help="of the first")
    parser.add_argument("--levels", default="all", help="all, or some with commas")
    parser.add_argument("--seconds", type=float, default=10.0, help="of each")
    parser.add_argument("--limit", type=float, default=60.0, help="seconds of work for each")
    parser.add_argument("--verbose", action="store_true", help="a line for each")
    options = parser.parse_args()
    levels = LEVELS if options.levels == "all" else tuple(options.levels.split(","))
    wrong = {level: 0 for level in levels}
    cost = {level: 0.0 for level in levels}
    for seed in range(options.seed, options.seed + options.count):
        system = make(seed)
        for level in levels:
            found = run(system, level, options.seconds, options.limit)
            wrong[level] += found.wrong is not None
            cost[level] += found.seconds / options.count
            if found.wrong or options.verbose:
                print(f"{seed} {level}: {found.wrong or 'well'}; gain {found.gain:.1e}, loss "
                      f"{found.loss:.1e}, joints {found.lack:.1e}, {1e6 * found.seconds:.0f} us a "
                      f"step; {system.name}", flush=True)
    for level in levels:
        print(f"{level}: {wrong[level]} of {options.count} wrong, {1e6 * cost[level]:.0f} us a step")
    return int(any(wrong.values()))


if __name__ == "__main__":
    sys.exit(main())
