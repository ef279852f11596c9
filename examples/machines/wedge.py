"""A wedge in a groove: pulled, it comes out or it jams, and both are answers. (See
docs/machines.md.)

    python examples/machines/wedge.py [--output FOLDER | --no-picture]

Half-angle 10 degrees, mu = 0.3 on either face. Above mu = tan(10 degrees) the two faces can press
on each other through the wedge as hard as they like: nothing in rigid bodies says whether they do.
"""

import math

import numpy as np
from common import bisect, run

import perp

SLOPE = math.radians(10)
COS, SIN = math.cos(SLOPE), math.sin(SLOPE)


def wedge(pull, mu=0.3):
    """q: sideways, and out of the groove; it does not turn."""
    normal, tangent = [[COS, SIN], [-COS, SIN]], [[-SIN, COS], [SIN, COS]]
    return perp.Mechanism(
        2, force=[0, pull], contacts=lambda q: (np.dot(normal, q), normal, tangent), mu=mu
    )


def answers(pull, mu=0.3):
    found = wedge(pull, mu).accelerations(0, [0, 0], [0, 0])
    assert found.exhaustive
    return found


def jams(mu):
    return any((s.acceleration == 0.0).all() for s in answers(1.0, mu))


def report():
    pushed = wedge(0.0).step(0, [0, 0], [0, -1], 1e-3)
    print(f"pushed in at 1 m/s: velocity {pushed.v[0]}, {pushed.v[1]}")
    out = wedge(0.0).step(0, [0, 0], [0, 1], 1e-3)
    print(f"thrown out at 1 m/s: a step gives {out.v[1]:g} m/s; to jam at once is an answer, too")
    found = answers(1.0)
    print(f"pulled by 1 N, at rest: {len(found)} answers ({found.reason})")
    for s in found:
        size = "" if s.dimension == 0 else f", forces a family of dimension {s.dimension}"
        print(f"    acceleration {s.acceleration[1]:.6f}, {'/'.join(s.modes)}{size}")
    for select in ("nearest", "freest"):
        speed = wedge(1.0).step(0, [0, 0], [0, 0], 1e-3, select=select).v[1]
        print(f"    a step of 1 ms that takes the {select} answer: velocity {speed:g}")
    print(f"it can jam above mu = {bisect(jams, 0.01, 0.9):.9f}, tan(10 degrees) is "
          f"{math.tan(SLOPE):.9f}")
    held = [s for s in answers(-1.0) if s.dimension][0]
    least = min(vertex[0] for vertex in held.vertices)
    print(f"pushed in by 1 N: the normal force of a face is at least {least:.9f} N "
          f"(closed form {1 / (2 * (SIN + 0.3 * COS)):.9f}), without an upper bound")
    return found, held


def draw_wedge(axes, arrows, pull, text):
    from matplotlib.patches import Polygon
    from pictures import BLUE, GROUND, INK, RED, SAND

    high, half = 1.6, 0.42
    for side in (-1, 1):
        low = side * half * 0.35
        axes.add_patch(Polygon([[low, -0.25], [low + side * high * math.tan(SLOPE), high - 0.25],
                                [side * 1.25, high - 0.25], [side * 1.25, -0.25]],
                               closed=True, color=GROUND, lw=0))
    tip, top = half * 0.35 + 0.25 * math.tan(SLOPE), half * 0.35 + 1.75 * math.tan(SLOPE)
    axes.add_patch(Polygon([[-tip, 0], [tip, 0], [top, 1.5], [-top, 1.5]], closed=True, fc=SAND,
                           ec=INK, lw=1.2))
    for side in (-1, 1):
        x, y = side * (half * 0.35 + 0.95 * math.tan(SLOPE)), 0.7
        normal = np.array([-side * COS, SIN])
        along = np.array([side * SIN, COS])
        for size, friction in arrows:
            end = np.array([x, y]) + size * (normal + friction * along)
            axes.annotate("", end, (x, y), arrowprops=dict(arrowstyle="-|>", color=RED, lw=1.8))
    axes.annotate("", (0, 2.0 if pull > 0 else 1.5), (0, 1.5 if pull > 0 else 2.0),
                  arrowprops=dict(arrowstyle="-|>", color=BLUE, lw=2))
    axes.text(0, -0.5, text, ha="center", va="top", color=INK, fontsize=9.5)
    axes.set_aspect("equal")
    axes.set(xlim=(-1.3, 1.3), ylim=(-0.75, 2.05), xticks=[], yticks=[])
    for spine in axes.spines.values():
        spine.set_visible(False)


def draw(axes, data):
    from pictures import BLUE, QUIET, RED, subtitle

    _, held = data
    axes[0].set_title("Pulled: it comes out")
    subtitle(axes[0], "no forces")
    draw_wedge(axes[0], [], 1, "acceleration 1")
    axes[1].set_title("Pulled: it stays")
    subtitle(axes[1], "each face presses and holds, as hard as it likes")
    draw_wedge(axes[1], [(0.26, -0.25)], 1, "acceleration 0.0")
    axes[2].set_title("Forces that hold it")
    subtitle(axes[2], "both faces alike; pulled by 1 N (red), pushed by 1 N (blue)")
    n = np.linspace(0, 9, 200)
    for pull, colour in ((1, RED), (-1, BLUE)):
        friction = (-pull / 2 - SIN * n) / COS  # the balance along the groove
        shown = np.abs(friction) <= 0.3 * n
        axes[2].plot(n[shown], friction[shown], color=colour, lw=2.4)
    axes[2].fill_between(n, -0.3 * n, 0.3 * n, color=QUIET, alpha=0.15, lw=0)
    axes[2].text(7, 1.75, "cone of friction", color=QUIET, ha="center")
    least = min(held.vertices, key=lambda v: v[0])
    axes[2].plot(least[0], least[1], "o", color=BLUE, ms=6)
    axes[2].annotate(f"at least {least[0]:.4f} N", (least[0], least[1]), (-6, 26), color=BLUE,
                     textcoords="offset points", fontsize=9.5)
    axes[2].set(xlabel="normal force (N)", ylabel="friction, outwards (N)", xlim=(0, 9))


if __name__ == "__main__":
    run("wedge", __doc__, report, draw, 3, (14, 4.4))
