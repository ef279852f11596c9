"""A block that rocks from one corner to the other. (Housner; see docs/machines.md.)

    python examples/machines/rocking_block.py [--output FOLDER | --no-picture]

Half-width b, half-height h, tan(alpha) = b/h. Each time the other corner lands, inelastically, the
block keeps 1 - 1.5 sin(alpha)^2 of its spin; if b/h is at least sqrt(2) it stops dead.
"""

import math

import numpy as np
from common import G, run

import perp


def block(b, h, mu=1.0):
    """q: centre and angle; contacts are its lower corners, left and right."""

    def contacts(q):
        c, s = math.cos(q[2]), math.sin(q[2])
        gap, normal, tangent = [], [], []
        for side in (-1, 1):
            x, y = side * b * c + h * s, side * b * s - h * c  # of the corner, from the centre
            gap.append(q[1] + y)
            normal.append([0, 1, x])
            tangent.append([1, 0, -y])
        return gap, normal, tangent

    return perp.Mechanism(
        3, mass=[1, 1, (b * b + h * h) / 3], force=[0, -G, 0], contacts=contacts, mu=mu
    )


def tilted(b, h, angle):
    """On its left corner, which is at the origin, for an angle > 0; else on its right one."""
    side = 1 if angle > 0 else -1
    c, s = math.cos(angle), math.sin(angle)
    return [side * b * c - h * s, side * b * s + h * c, angle]


def ratio(b, h):
    """Spin after over spin before, of a step in which the left corner lands."""
    answer = block(b, h, mu=10.0).step(0, [0, h, 0], [-h, -b, 1], 1e-9)
    assert answer.ok
    return answer.v[2]


def report():
    b, h = 0.1, 0.5
    alpha = math.atan(b / h)
    start = tilted(b, h, alpha / 2)
    answer = block(b, h).simulate(start, [0, 0, 0], 5, 1e-3)
    assert answer.ok
    fine = block(b, h).simulate(start, [0, 0, 0], 0.36, 2e-5)
    landed = int(np.argmax(fine.impulse[:, 2] > 0))  # this step ends where the corner touches
    print(f"lands after {fine.t[landed]:.5f} s (closed form 0.347094), spin "
          f"{-fine.v[landed - 1, 2]:.5f} (0.648049) before, "
          f"{-fine.v[landed + 1, 2]:.5f} (0.610662) after")
    keeps = 1 - 1.5 * math.sin(alpha) ** 2
    print(f"keeps {ratio(b, h):.7f} of its spin, by the formula {keeps:.7f}")
    dead = 2 ** 0.5 * h
    print(f"b/h = sqrt(2): keeps {ratio(dead * 1.000001, h)}, "
          f"just below {ratio(dead * 0.999, h):.6f}")
    slips = block(b, h, mu=0.148).step(0, [0, h, 0], [-h, -b, 1], 1e-9).modes
    sticks = block(b, h, mu=0.149).step(0, [0, h, 0], [-h, -b, 1], 1e-9).modes
    print(f"the landing corner: {slips[0]} at mu = 0.148, {sticks[0]} at mu = 0.149 "
          "(closed form 0.148515)")
    widths = np.linspace(0.05, 1.8, 36)
    return b, h, answer, widths, [ratio(w, 1.0) for w in widths]


def draw(axes, data):
    from matplotlib.patches import Polygon, Rectangle
    from pictures import BLUE, GROUND, INK, QUIET, RED, SAND, subtitle

    b, h, answer, widths, ratios = data
    axes[0].set_title("Rocking")
    subtitle(axes[0], "released at half of the angle at which it would fall")
    axes[0].add_patch(Rectangle((-1, -1), 2, 1, color=GROUND, lw=0))
    corners = np.array([[-b, -h], [b, -h], [b, h], [-b, h]])
    for time, fill, edge in ((0.0, SAND, INK), (0.6, "none", BLUE)):
        x, y, angle = answer.q[round(time / 1e-3)]
        c, s = math.cos(angle), math.sin(angle)
        shape = corners @ np.array([[c, s], [-s, c]]) + [x, y]
        axes[0].add_patch(Polygon(shape, closed=True, fc=fill, ec=edge, lw=1.3, alpha=0.9))
        axes[0].annotate(f"{time:g} s", shape[2] if angle < 0 else shape[3], (0, 5),
                         textcoords="offset points", color=edge, fontsize=9.5,
                         ha="center")
    axes[0].set_aspect("equal")
    axes[0].set(xlim=(-0.55, 0.55), ylim=(-0.06, 1.16), xlabel="x (m)", ylabel="height (m)")

    axes[1].set_title("Angle")
    subtitle(axes[1], "each landing takes the same share of the spin")
    axes[1].plot(answer.t, np.degrees(answer.q[:, 2]), color=BLUE, lw=1.6)
    axes[1].axhline(0, color=QUIET, lw=0.8)
    axes[1].plot(0.34709358678888131, 0, "o", color=RED, ms=6, zorder=4)
    axes[1].annotate("first landing\nby theory", (0.347, 0), (0.62, 4.6), color=RED, fontsize=9.5,
                     arrowprops=dict(arrowstyle="-", color=RED, lw=0.8))
    axes[1].set(xlabel="time (s)", ylabel="angle (degrees)", xlim=(0, 5))

    axes[2].set_title("Spin that a landing leaves")
    subtitle(axes[2], "over b/h; steps of perp, and Housner's formula")
    fine = np.linspace(0, 1.8, 400)
    formula = np.maximum(1 - 1.5 * fine**2 / (1 + fine**2), 0)
    axes[2].plot(fine, formula, color=INK, lw=1.2, label="1 - 1.5 sin² α")
    axes[2].plot(widths, ratios, "o", color=BLUE, ms=4, label="perp")
    axes[2].axvline(math.sqrt(2), color=QUIET, lw=0.9, ls=(0, (4, 3)))
    axes[2].text(math.sqrt(2) + 0.03, 0.5, "√2: stops\ndead", color=QUIET, fontsize=9.5)
    axes[2].set(xlabel="b / h", ylabel="spin after / before", ylim=(-0.04, 1.04))
    axes[2].legend(frameon=False)


if __name__ == "__main__":
    run("rocking_block", __doc__, report, draw, 3, (14, 4.2))
