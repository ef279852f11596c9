"""Bodies that begin in each other: they come apart, and none jumps.

Overlaps are found here, by separating axes and distances, not asked of the world. With D the deepest
of them as a step begins, h the step and v a body's speed,

  way <= h v + max(D / 5 + 2e-3 of two bodies' size, as far as two points went in the step)

for every body: a step opens a fifth of an overlap that was there, all of one that is small, and what
its own motion made. What nothing holds keeps its mass centre as it parts, so that it gains no energy.
At the end all have parted but for 2e-3 of two bodies' size.
"""

from __future__ import annotations

import itertools
from typing import Any, Callable, NamedTuple, Optional

import numpy as np
import perp
from scene import matrix

STEP = 0.01
SHARE = 0.2  # of an overlap that a step opens
SLOP = 2e-3  # of two bodies' size, which is opened at once, or left


class Solid(NamedTuple):
    """A box by its half edges; a ball or a capsule along x by its radius and half length."""

    body: Any
    half: Optional[np.ndarray]
    radius: float = 0.0
    length: float = 0.0

    def size(self) -> float:
        return self.radius + self.length if self.half is None else float(np.linalg.norm(self.half))

    def axes(self) -> np.ndarray:
        return matrix(tuple(self.body.orientation))

    def ends(self) -> np.ndarray:
        way = self.length * self.axes()[:, 0]
        return np.array((self.body.position - way, self.body.position + way))

    def below(self) -> float:
        """How deep it is below z = 0."""
        if self.half is None:
            return self.radius - self.ends()[:, 2].min()
        return np.abs(self.axes()[2]) @ self.half - self.body.position[2]


def boxes(a: Solid, b: Solid) -> float:
    """The least overlap along normals of faces and products of edges."""
    A, B = a.axes(), b.axes()
    axes = np.vstack((A.T, B.T, np.cross(A.T[:, None], B.T[None]).reshape(9, 3)))
    length = np.linalg.norm(axes, axis=1)
    wide = np.abs(axes @ A) @ a.half + np.abs(axes @ B) @ b.half
    depth = wide - np.abs(axes @ (b.body.position - a.body.position))
    return float((depth[length > 1e-6] / length[length > 1e-6]).min())


def ball_in_box(ball: Solid, box: Solid) -> float:
    local = box.axes().T @ (ball.body.position - box.body.position)
    beyond = np.abs(local) - box.half
    outside = np.linalg.norm(np.maximum(beyond, 0.0))
    return ball.radius - (outside if outside > 0.0 else beyond.max())


def round_ones(a: Solid, b: Solid) -> float:
    """Radii less the distance of two segments, whose squared distance is convex."""
    (p, q), (r, s) = a.ends(), b.ends()
    u, v, w = q - p, s - r, p - r
    clip = lambda x: min(max(x, 0.0), 1.0)  # noqa: E731
    best, uu, vv = np.inf, u @ u, v @ v
    starts = [0.0, 1.0]
    if (bent := uu * vv - (u @ v) ** 2) > 1e-12 * uu * vv > 0.0:
        starts.append(clip(((u @ v) * (v @ w) - vv * (u @ w)) / bent))
    for t in starts:  # a point of one, the next one of the other, and back
        other = clip((v @ (w + t * u)) / vv) if vv > 0.0 else 0.0
        t = clip((u @ (other * v - w)) / uu) if uu > 0.0 else 0.0
        best = min(best, float(np.linalg.norm(w + t * u - other * v)))
    return a.radius + b.radius - best


def overlap(a: Solid, b: Solid) -> float:
    if (apart := np.linalg.norm(a.body.position - b.body.position) - a.size() - b.size()) > 0.0:
        return -float(apart)
    if a.half is not None and b.half is not None:
        return boxes(a, b)
    if a.half is None and b.half is None:
        return round_ones(a, b)
    return ball_in_box(*((a, b) if a.half is None else (b, a)))


class Scene(NamedTuple):
    world: perp.World
    solids: list[Solid]
    grounded: bool


def clump(random: np.random.Generator, accuracy: str, kinds: str, count: int, gravity: float,
          height: Optional[float], spread: float = 0.3, masses: float = 1.0) -> Scene:
    """Bodies about one point; `height` above the ground, if there is one."""
    world = perp.World((0, 0, -gravity), accuracy=accuracy, friction=0.5)
    if height is not None:
        world.ground.add_plane((0, 0, 1))
    solids = []
    for _ in range(count):
        q = random.normal(size=4)
        place = random.uniform(-spread, spread, 3) + (0, 0, height or 0.0)
        body = world.add_body(10 ** random.uniform(-masses, masses), position=place,
                              orientation=q / np.linalg.norm(q))
        kind = str(random.choice(kinds.split()))
        if kind in ("ball", "capsule"):
            radius, length = random.uniform(0.1, 0.3), random.uniform(0.1, 0.3) * (kind != "ball")
            body.add_sphere(radius) if kind == "ball" else body.add_capsule(radius, length)
            solids.append(Solid(body, None, radius, length))
        else:
            half = {"box": random.uniform(0.12, 0.36, 3), "plate": np.array((0.36, 0.36, 0.012)),
                    "rod": np.array((0.02, 0.02, 0.5))}[kind]
            body.add_box(half)
            solids.append(Solid(body, half))
    return Scene(world, solids, height is not None)


def few(random: np.random.Generator) -> int:
    return int(random.integers(2, 6))


def same(random: np.random.Generator, accuracy: str) -> Scene:
    """All in one place."""
    scene = clump(random, accuracy, "box" if random.integers(2) else "ball", few(random), 9.81, None)
    for solid in scene.solids:
        solid.body.position = (0, 0, 0)
    return scene


def stack(random: np.random.Generator, accuracy: str) -> Scene:
    """Boxes that stand in each other, by up to a third."""
    scene = clump(random, accuracy, "box", int(random.integers(2, 6)), 9.81, 0.0)
    height = 0.0
    for solid in scene.solids:
        height += solid.half[2] * random.uniform(1.4, 2.0)
        solid.body.orientation = (1, 0, 0, 0)
        solid.body.position = (0, 0, height)
    return scene


def pairs(random: np.random.Generator, accuracy: str) -> Scene:
    """Each second one is joined to the one before, which it may not touch then."""
    scene = clump(random, accuracy, "ball", 6, 9.81, 0.8)
    for a, b in zip(scene.solids[::2], scene.solids[1::2]):
        anchor = (a.body.position + b.body.position) / 2
        scene.world.add_joint(str(random.choice(("ball", "fixed"))), a.body, b.body, anchor=anchor)
    return scene


Make = Callable[[np.random.Generator, str], Scene]
CLASSES: dict[str, Make] = {
    "boxes": lambda r, a: clump(r, a, "box", few(r), 9.81, 0.6),
    "boxes without gravity": lambda r, a: clump(r, a, "box", few(r), 0.0, None),
    "boxes that fall": lambda r, a: clump(r, a, "box", few(r), 9.81, None),
    "capsules": lambda r, a: clump(r, a, "capsule ball", few(r), 9.81, 0.6),
    "masses": lambda r, a: clump(r, a, "box ball", few(r), 9.81, 0.6, masses=2.0),
    "masses that fall": lambda r, a: clump(r, a, "box ball", few(r), 9.81, None, masses=2.0),
    "rods and plates": lambda r, a: clump(r, a, "rod plate", few(r), 9.81, 1.0),
    "in the ground": lambda r, a: clump(r, a, "box ball", few(r), 9.81, 0.0),
    "many": lambda r, a: clump(r, a, "box ball", 9, 0.0, None, spread=0.35),
    "same": same,
    "stack": stack,
    "pairs": pairs,
}
LEVELS = ("fast", "standard", "accurate", "exact")


def judge(kind: str, seed: int, accuracy: str, steps: int = 200) -> Optional[str]:
    """What is wrong with it, or None."""
    world, solids, grounded = CLASSES[kind](np.random.default_rng(seed), accuracy)
    met = [(a, b) for a, b in itertools.combinations(solids, 2)]
    if kind == "pairs":
        met = [(a, b) for a, b in met if not (solids.index(a) % 2 == 0
                                              and solids.index(b) == solids.index(a) + 1)]
    sizes = sorted(solid.size() for solid in solids)
    slop = SLOP * sum(sizes[-2:])
    energy, scale = world.energy().total, sum(s.body.mass for s in solids) * 9.81 * sizes[-1]
    wrong = None
    for k in range(steps):
        deepest = max([overlap(a, b) for a, b in met]
                      + [solid.below() for solid in solids if grounded])
        if k > 30 and deepest <= 0.5 * slop:
            break
        places, speed = world.positions.copy(), np.linalg.norm(world.velocities, axis=1)
        world.step(STEP)
        speed = np.maximum(speed, np.linalg.norm(world.velocities, axis=1))
        jump = (np.linalg.norm(world.positions - places, axis=1) - STEP * speed).max()
        spin = np.linalg.norm(world.angular_velocities, axis=1).max() * sizes[-1]
        if jump > max(SHARE * max(deepest, 0.0) + slop, 2 * STEP * (speed.max() + spin)):
            wrong = f"step {k}: {jump:.3f} beyond the speed, of an overlap of {deepest:.3f}"
            break
        now = world.energy().total
        if not grounded and now > energy + 1e-12 * scale * (1 + k):
            wrong = f"step {k}: gains {(now - energy) / scale:.1e} of m g size"
            break
        energy = now
    if not wrong:
        left = max([overlap(a, b) for a, b in met] + [s.below() for s in solids if grounded])
        wrong = f"{left:.4f} left in each other" if left > slop else None
    world.close()
    return wrong and f"{kind} {seed} {accuracy}: {wrong}"
