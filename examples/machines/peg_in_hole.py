"""A peg in a hole: which loads push it in and which jam it, asked of steps over a grid of loads,
with Whitney's diagram on top; and how deep it must be not to wedge. (See docs/machines.md.)

    python examples/machines/peg_in_hole.py [--output FOLDER | --no-picture]

A planar peg of radius r at depth l in a hole that is hardly wider, pushed by F_z into the hole, F_x
across, and turned by M about the middle of its tip. With lambda = l / (2 r mu) it slides in if

    |M / (r F_z) + mu (1 + lambda) F_x / F_z| < lambda,   |F_x / F_z| < 1 / mu,

and jams otherwise. If l <= 2 mu r it can wedge: jam under any load, or none. (D. E. Whitney,
"Quasi-static assembly of compliantly supported rigid parts", J. Dyn. Syst. Meas. Control 104
(1982).)
"""

import math

import numpy as np
from common import bisect, run

import perp

R, MU = 0.01, 0.2
# two points that touch: left and right corners of the tip, left and right rims of the hole
PAIRS = ((0, 3), (1, 2), (0, 2), (1, 3))


def point(k, q):
    """Gap and rows of point k, for a hole as wide as the peg. y points out of the hole."""
    c, s, side = math.cos(q[2]), math.sin(q[2]), 1 if k % 2 == 0 else -1

    def row(direction, arm):
        return [*direction, arm[0] * direction[1] - arm[1] * direction[0]]

    if k < 2:  # a corner of the tip, and the wall of the hole
        arm = [-side * R * c, -side * R * s]
        return R + side * (q[0] + arm[0]), row([side, 0], arm), row([0, 1], arm)
    arm = [-side * R - q[0], -q[1]]  # a rim of the hole, and the side of the peg
    across = [side * c, side * s]
    return -R - arm[0] * across[0] - arm[1] * across[1], row(across, arm), row([-s, c], arm)


class Peg:
    """The peg with two of the points."""

    def __init__(self, pair):
        self.load = [0.0, -1.0, 0.0]

        def contacts(q):
            points = [point(k, q) for k in pair]
            return tuple(np.array(part) for part in zip(*points))

        self.mechanism = perp.Mechanism(
            3, mass=[1, 1, 1e-4], force=lambda t, q, v: self.load, contacts=contacts, mu=MU
        )

    def stays(self, depth, across, moment):
        """Whether it is at rest after a step from rest, pushed by F_z = 1."""
        self.load = [across, -1.0, moment * R]
        answer = self.mechanism.step(0, [0, -depth, 0], [0, 0, 0], 1e-3)
        assert answer.ok
        return bool((answer.v == 0.0).all())

    def wedges(self, depth):
        """Whether, pulled out by F_z = -1, it may stay as well as come out."""
        self.load = [0.0, 1.0, 0.0]
        found = self.mechanism.accelerations(0, [0, -depth, 0], [0, 0, 0])
        assert found.exhaustive
        return any((s.acceleration == 0.0).all() for s in found)


def slides(depth, across, moment):
    """Whitney's conditions."""
    long = depth / (2 * R * MU)
    return abs(moment + MU * (1 + long) * across) < long and abs(across) < 1 / MU


def report():
    depth, pegs = 0.012, [Peg(pair) for pair in PAIRS]
    long = depth / (2 * R * MU)
    grid = [(x, y) for x in np.linspace(-7.1, 7.1, 36) for y in np.linspace(-10.1, 10.1, 52)]
    jams = [any(peg.stays(depth, *load) for peg in pegs) for load in grid]
    wrong = sum(jam == slides(depth, *load) for load, jam in zip(grid, jams))
    print(f"lambda = {long:.6f}; {len(grid)} loads: {sum(jams)} jam, "
          f"{len(grid) - sum(jams)} slide in, {wrong} not as in Whitney's diagram")
    edge = bisect(lambda m: any(peg.stays(depth, 0.0, m) for peg in pegs), 0.0, 10.0)
    print(f"without a force across it jams from M / (r F_z) = {edge:.9f} on")
    deepest = bisect(lambda depth: not Peg(PAIRS[0]).wedges(depth), 0.001, 0.01)
    print(f"can wedge to a depth of {deepest:.9f} m, mu times the diameter is {2 * MU * R}")
    return depth, grid, jams, deepest


def draw_peg(axes, depth, angle=0.0):
    from matplotlib.patches import Polygon, Rectangle
    from pictures import GROUND, INK, RED, SAND

    for side in (-1, 1):
        axes.add_patch(Rectangle((side * R if side > 0 else -3 * R, -3 * R), 2 * R, 3 * R,
                                 color=GROUND, lw=0))
    axes.add_patch(Polygon([[-R, -depth], [R, -depth], [R, 2.4 * R], [-R, 2.4 * R]], closed=True,
                           fc=SAND, ec=INK, lw=1))
    phi = math.atan(MU)
    for x, y, way in ((-R, -depth, 1), (R, 0, -1)):
        cone = [[x, y]] + [
            [x + way * 2.2 * R * math.cos(phi), y + turn * 2.2 * R * math.sin(phi)]
            for turn in (-1, 1)
        ]
        axes.add_patch(Polygon(cone, closed=True, color=RED, alpha=0.25, lw=0))
        axes.plot(x, y, "o", color=RED, ms=5)
    axes.plot([-R, R], [-depth, 0], color=RED, lw=1, ls=(0, (3, 2)))


def draw(axes, data):
    from pictures import BLUE, INK, QUIET, RED, subtitle

    depth, grid, jams, deepest = data
    long = depth / (2 * R * MU)
    axes[0].set_title("Jamming")
    subtitle(axes[0], "each dot a load: blue slides in, red stays; lines are Whitney's diagram")
    x, y = np.array(grid).T
    jams = np.array(jams)
    axes[0].plot(x[jams], y[jams], "x", color=RED, ms=3.2, mew=0.9, alpha=0.75)
    axes[0].plot(x[~jams], y[~jams], "o", color=BLUE, ms=3)
    corners = np.array([[5, -long * 1 - MU * (1 + long) * 5], [5, long - MU * (1 + long) * 5],
                        [-5, long + MU * (1 + long) * 5], [-5, -long + MU * (1 + long) * 5]])
    axes[0].plot(*np.vstack([corners, corners[:1]]).T, color=INK, lw=1.8)
    axes[0].set(xlabel="$F_x / F_z$", ylabel="$M / (r F_z)$", xlim=(-7.2, 7.2), ylim=(-10.3, 10.3))

    for panel, deep, text in (
        (axes[1], 0.012,
         "12 mm deep: the line through the points\nleaves the cones; it can't wedge"),
        (axes[2], 0.0032, "3.2 mm: the line is in both cones;\npulled out it may stay"),
    ):
        draw_peg(panel, deep)
        panel.set_aspect("equal")
        panel.set(xlim=(-2.6 * R, 2.6 * R), ylim=(-1.7 * R, 2.7 * R), xticks=[], yticks=[])
        for spine in panel.spines.values():
            spine.set_visible(False)
        panel.text(0, -1.95 * R, text, ha="center", va="top", fontsize=9.5, color=INK)
    axes[1].set_title("Wedging")
    subtitle(axes[1], "radius 10 mm, μ = 0.2; cones of friction at two points")
    axes[2].text(0, 2.62 * R, f"wedges to {1e3 * deepest:.3f} mm = μ · diameter", ha="center",
                 color=QUIET, fontsize=9.5)


if __name__ == "__main__":
    run("peg_in_hole", __doc__, report, draw, 3, (14, 5))
