"""Scenes in motion, as text that bench/motion.c and bench/peers_world/motion_bullet.cpp read.

    python bench/motion_scenes.py DIRECTORY

peers_world/motion.h says what the text means. The same seed on every machine.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any, Sequence

import numpy as np
from scipy.spatial import ConvexHull

GRAVITY = 9.81
BOX, SPHERE, HULL = range(3)
BALL, HINGE = range(2)


class Scene:
    def __init__(
        self, name: str, steps: int = 300, friction: float = 0.5, planar: bool = False
    ) -> None:
        self.name, self.steps, self.friction, self.planar = name, steps, friction, planar
        self.h = 0.01
        self.bodies: list[list[float]] = []
        self.joints: list[list[float]] = []

    def body(
        self, shape: int, mass: float, inertia: Sequence[float], position: Sequence[float],
        size: Sequence[float], turn: Sequence[float] = (1, 0, 0, 0), way: Sequence[float] = (),
        omega: float = 0,
    ) -> int:
        """Driven along way sin(omega t), if that is given."""
        self.bodies.append([shape, mass, *inertia, *position, *turn, 0, 0, 0, len(way) > 0,
                            *(way or (0, 0, 0)), omega, len(size), *size])
        return len(self.bodies) - 1

    def box(self, half: Sequence[float], mass: float, position: Sequence[float],
            **more: Any) -> int:
        squares = np.square(half)
        return self.body(BOX, mass, mass / 3 * (squares.sum() - squares), position, half, **more)

    def sphere(self, radius: float, mass: float, position: Sequence[float], **more: Any) -> int:
        return self.body(SPHERE, mass, [0.4 * mass * radius**2] * 3, position, [radius], **more)

    def joint(
        self, kind: int, a: int, b: int, anchor: Sequence[float],
        axis: Sequence[float] = (0, 0, 1), limits: Sequence[float] = (0, 0), speed: float = 0,
        force: float = 0,
    ) -> None:
        """b = -1: the ground."""
        self.joints.append([kind, a, b, *anchor, *axis, *limits, speed, force])

    def walls(self, half: float, height: float) -> None:
        """Half a metre thick, round a square of 2 half."""
        thick = 0.5
        away, outer = half + thick, half + 2 * thick
        for x in (-away, away):
            if self.planar:
                self.box((thick, height, 1), 0, (x, height, 0))
            else:
                self.box((thick, outer, height), 0, (x, 0, height))
        for y in () if self.planar else (-away, away):
            self.box((outer, thick, height), 0, (0, y, height))

    def write(self, folder: Path) -> None:
        gravity = (0, -GRAVITY, 0) if self.planar else (0, 0, -GRAVITY)
        head = [self.planar, self.steps, self.h, self.friction, *gravity, len(self.bodies),
                len(self.joints)]
        lines = [" ".join(f"{number:.17g}" for number in row)
                 for row in [head, *self.bodies, *self.joints]]
        text = "\n".join(lines) + "\n"
        (folder / f"{self.name}.scene").write_text(f"scene {self.name} {text}")


def turned(axis: Sequence[float], angle: float) -> tuple[float, ...]:
    return (np.cos(angle / 2), *(np.sin(angle / 2) * np.asarray(axis)))


def any_turn(random: np.random.Generator) -> np.ndarray:
    turn = random.normal(size=4)
    return turn / np.linalg.norm(turn)


def moments(points: np.ndarray, hull: ConvexHull) -> tuple[float, np.ndarray, np.ndarray]:
    """Volume, centre and second moments about it, as a sum over tetrahedra from the origin."""
    volume, centre, second = 0.0, np.zeros(3), np.zeros((3, 3))
    for corners, plane in zip(points[hull.simplices], hull.equations):
        part = np.dot(corners[0], np.cross(corners[1], corners[2])) / 6
        part *= np.sign(np.dot(np.cross(*(corners[1:] - corners[0])), plane[:3]))
        total = corners.sum(axis=0)
        volume += part
        centre += part * total / 4
        second += part / 20 * (corners.T @ corners + np.outer(total, total))
    centre /= volume
    return volume, centre, second - volume * np.outer(centre, centre)


def random_hull(
    random: np.random.Generator, corners: int, size: float
) -> tuple[np.ndarray, float, np.ndarray]:
    """Corners about the mass centre along principal axes; mass and inertia of density 1."""
    while True:
        points = random.normal(size=(corners, 3))
        points /= np.linalg.norm(points, axis=1)[:, None]
        points *= size * random.uniform(0.75, 1, size=(corners, 1))
        points *= np.array([1, random.uniform(0.6, 1), random.uniform(0.6, 1)])
        points = points[ConvexHull(points).vertices]
        if len(points) >= 12:
            break
    volume, centre, second = moments(points, ConvexHull(points))
    inertia, axes = np.linalg.eigh(np.trace(second) * np.eye(3) - second)
    if np.linalg.det(axes) < 0:
        axes[:, 0] *= -1
    return (points - centre) @ axes, volume, inertia


def bin_of_boxes(random: np.random.Generator) -> Scene:
    scene = Scene("bin", 500)
    scene.walls(3, 8)
    for i in range(500):
        half = random.uniform(0.15, 0.45, 3)
        place = ((i % 5 - 2) * 1.1 + random.uniform(-0.05, 0.05),
                 (i // 5 % 5 - 2) * 1.1 + random.uniform(-0.05, 0.05), 0.9 + i // 25)
        scene.box(half, 8 * half.prod(), place, turn=any_turn(random))
    return scene


def plate(random: np.random.Generator) -> Scene:
    """Boxes on a plate that is shaken sideways."""
    scene = Scene("plate")
    scene.box((12, 12, 0.25), 0, (0, 0, 0.75), way=(0.5, 0, 0), omega=2 * np.pi * 0.8)
    for i in range(300):
        half = random.uniform(0.2, 0.5, 3)
        place = ((i % 10 - 4.5) * 1.6, (i // 10 % 10 - 4.5) * 1.6, 1.6 + 1.2 * (i // 100))
        scene.box(half, 8 * half.prod(), place, turn=turned((0, 0, 1), random.uniform(0, 6)))
    return scene


def ragdoll(scene: Scene, origin: np.ndarray, angle: float) -> None:
    """Lying in the air, its head along x, turned by the angle about the vertical."""
    c, s = np.cos(angle), np.sin(angle)
    rotation = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    turn = turned((0, 0, 1), angle)

    def at(*place: float) -> np.ndarray:
        return origin + rotation @ np.array(place)

    torso = scene.box((0.3, 0.2, 0.12), 20, at(0, 0, 0), turn=turn)
    head = scene.sphere(0.13, 4, at(0.45, 0, 0), turn=turn)
    scene.joint(BALL, torso, head, at(0.31, 0, 0))
    for side in (-1, 1):
        upper = scene.box((0.06, 0.15, 0.06), 2, at(0.22, side * 0.37, 0), turn=turn)
        lower = scene.box((0.05, 0.15, 0.05), 1.5, at(0.22, side * 0.69, 0), turn=turn)
        scene.joint(BALL, torso, upper, at(0.22, side * 0.21, 0))
        scene.joint(HINGE, upper, lower, at(0.22, side * 0.53, 0),
                    limits=(-0.1, 2.2) if side > 0 else (-2.2, 0.1))
        thigh = scene.box((0.2, 0.08, 0.08), 5, at(-0.52, side * 0.12, 0), turn=turn)
        shin = scene.box((0.2, 0.06, 0.06), 3, at(-0.94, side * 0.12, 0), turn=turn)
        scene.joint(BALL, torso, thigh, at(-0.31, side * 0.12, 0))
        scene.joint(HINGE, thigh, shin, at(-0.73, side * 0.12, 0), rotation @ (0, 1, 0),
                    limits=(-0.05, 2.2))


def ragdolls(random: np.random.Generator) -> Scene:
    scene = Scene("ragdolls", friction=0.6)
    for i in range(20):
        origin = np.array([(i % 2 - 0.5) * 0.5 + random.uniform(-0.1, 0.1),
                           (i // 2 % 2 - 0.5) * 0.5 + random.uniform(-0.1, 0.1), 1.6 + 0.9 * i])
        ragdoll(scene, origin, random.uniform(0, 6))
    return scene


def bridge(random: np.random.Generator) -> Scene:
    """Planks between two banks, nearly along the parabola on which they would rest, and boxes."""
    scene = Scene("bridge", friction=0.6)
    planks, length, sag = 50, 0.4, 1.5
    slopes = -np.arctan(8 * sag / (planks * length) * (0.5 - (np.arange(planks) + 0.5) / planks))
    ways = length * np.stack([np.cos(slopes), 0 * slopes, np.sin(slopes)], axis=1)
    ends = np.concatenate([np.zeros((1, 3)), np.cumsum(ways, axis=0)]) + (0, 0, 6)
    ends[:, 0] -= ends[-1, 0] / 2
    for i in range(planks):
        scene.box((0.475 * length, 1, 0.05), 8, (ends[i] + ends[i + 1]) / 2,
                  turn=turned((0, 1, 0), -slopes[i]))
    scene.joint(HINGE, 0, -1, ends[0], (0, 1, 0))
    scene.joint(HINGE, planks - 1, -1, ends[-1], (0, 1, 0))
    for i in range(planks - 1):
        scene.joint(HINGE, i, i + 1, ends[i + 1], (0, 1, 0))
    for i in range(30):
        place = ((i % 10 - 4.5) * 1.2, (-0.5, 0.1, 0.6)[i // 10], 6.6 + 0.7 * (i // 10))
        scene.box((0.25, 0.25, 0.25), 2, place, turn=turned((0, 0, 1), random.uniform(0, 6)))
    return scene


def hulls(random: np.random.Generator) -> Scene:
    scene = Scene("hulls", 400)
    scene.walls(3, 8)
    for i in range(300):
        corners = int(random.integers(12, 21))
        points, mass, inertia = random_hull(random, corners, random.uniform(0.3, 0.5))
        place = ((i % 5 - 2) * 1.1, (i // 5 % 5 - 2) * 1.1, 0.8 + 1.1 * (i // 25))
        scene.body(HULL, mass, inertia, place, points.ravel(), turn=any_turn(random))
    return scene


def dominoes(random: np.random.Generator) -> Scene:
    """The first one leans on the second."""
    scene = Scene("dominoes", 500, 0.4)
    lean = 0.2
    c, s = np.cos(lean), np.sin(lean)
    scene.box((0.05, 0.25, 0.5), 1, (0.05 - (0.05 * c - 0.5 * s), 0, 0.05 * s + 0.5 * c),
              turn=turned((0, 1, 0), lean))
    for i in range(1, 200):
        scene.box((0.05, 0.25, 0.5), 1, (0.45 * i, 0, 0.5))
    return scene


def car(random: np.random.Generator) -> Scene:
    """Four driven wheels on a way of loose slabs."""
    scene = Scene("car", 400, 0.8)
    chassis = scene.box((1, 0.5, 0.2), 40, (0, 0, 0.75))
    for x in (-0.75, 0.75):
        for y in (-0.7, 0.7):
            wheel = scene.sphere(0.35, 5, (x, y, 0.352))
            scene.joint(HINGE, chassis, wheel, (x, y, 0.352), (0, 1, 0), speed=12, force=40)
    for i in range(60):
        half = [random.uniform(0.1, 0.4), random.uniform(0.3, 0.8), random.uniform(0.03, 0.12)]
        place = (2 + 0.45 * i, random.uniform(-0.6, 0.6), half[2] + 0.3 * (i % 2))
        scene.box(half, 100 * np.prod(half), place,
                  turn=turned((0, 0, 1), random.uniform(-0.5, 0.5)))
    return scene


def planar(random: np.random.Generator) -> Scene:
    """Rectangles and discs in a bin of the plane."""
    scene = Scene("planar", planar=True)
    scene.walls(10, 40)
    for i in range(1000):
        place = ((i % 20 - 9.5) * 0.95 + random.uniform(-0.05, 0.05), 0.6 + 0.95 * (i // 20), 0)
        if i % 2:
            half = random.uniform(0.15, 0.4, 2)
            mass = 4 * half.prod()
            scene.body(BOX, mass, (0, 0, mass / 3 * (half @ half)), place, (*half, 1),
                       turn=turned((0, 0, 1), random.uniform(0, 6)))
        else:
            radius = random.uniform(0.2, 0.42)
            mass = np.pi * radius**2
            scene.body(SPHERE, mass, (0, 0, 0.5 * mass * radius**2), place, (radius,))
    return scene


# In this order they draw from one stream of random numbers.
SCENES = (bin_of_boxes, plate, ragdolls, bridge, hulls, dominoes, car, planar)


def write_all(folder: Path) -> list[str]:
    """The names of the scenes, in files NAME.scene."""
    folder.mkdir(parents=True, exist_ok=True)
    random = np.random.default_rng(7)
    scenes = [make(random) for make in SCENES]
    for scene in scenes:
        scene.write(folder)
    return [scene.name for scene in scenes]


if __name__ == "__main__":
    write_all(Path(sys.argv[1]))
