"""The picture of statics.py: an arch's thrust line, how the arch falls, how a wall falls."""

import numpy as np
from matplotlib.patches import Polygon
from pictures import BLUE, GROUND, INK, QUIET, RED, SAND, paint, subtitle


def draw_stones(axes, corners, **style):
    for p in corners:
        axes.add_patch(Polygon(p, closed=True, **{"lw": 0.7, "zorder": 2, **style}))


def arrow(axes, tip, along):
    tip, along = np.asarray(tip), np.asarray(along)
    axes.annotate(
        "", tip, tip - along, zorder=5,
        arrowprops={"arrowstyle": "-|>", "color": INK, "lw": 1.6, "shrinkA": 0, "shrinkB": 0},
    )


def moved(made, v, most):
    """The corners of all stones, moved by the virtual velocity; the largest way is `most`."""
    places = []
    for p, centre, (x, y, turn) in zip(made.corners, made.centres, v.reshape(-1, 3)):
        arm = p - centre
        places.append(np.column_stack([x - turn * arm[:, 1], y + turn * arm[:, 0]]))
    scale = most / max(np.hypot(*way.T).max() for way in places)
    return [p + scale * way for p, way in zip(made.corners, places)]


def thrust_line(made, impulse):
    """Where the force of each joint passes through it: between its two ends by their shares."""
    normal = impulse.reshape(-1, 2, 2)[:, :, 0]
    points = np.array([point for _, _, point, _ in made.contacts]).reshape(-1, 2, 2)
    return (normal[:, :, None] * points).sum(axis=1) / normal.sum(axis=1)[:, None]


def draw_floor(axes, *ends):
    low = axes.get_ylim()[0]
    axes.fill(*zip((ends[0], low), (ends[1], low), (ends[1], 0), (ends[0], 0)), color=GROUND, lw=0)


def arch_axes(axes):
    axes.set_aspect("equal")
    axes.set(xlim=(-1.35, 1.35), ylim=(-0.1, 1.3), xlabel="x / R")
    axes.set_xticks([-1, 0, 1])
    axes.set_yticks([0, 1])
    draw_floor(axes, -1.35, 1.35)


def draw_thrust(axes, made, stone, stands, share):
    axes.set_title("It stands: thrust line")
    subtitle(axes, f"t/R = 0.15; a load of {share:.4f} of its weight")
    arch_axes(axes)
    draw_stones(axes, made.corners, fc=SAND, ec=QUIET)
    axes.plot(*thrust_line(made, stands.impulse).T, color=BLUE, lw=1.8, zorder=4)
    arrow(axes, made.corners[stone][3], (0, -0.3))


def draw_mechanism(axes, made, stone, falls, hinges):
    axes.set_title("It falls: four hinges")
    subtitle(axes, "the virtual velocity under 1.001 of that load")
    arch_axes(axes)
    draw_stones(axes, made.corners, fc="none", ec=GROUND, zorder=1)
    places = moved(made, falls.velocity, 0.16)
    draw_stones(axes, places, fc=SAND, ec=QUIET)
    for joint, outside in hinges:
        of, corner = (joint, (0, 3)) if joint < len(places) else (joint - 1, (1, 2))
        axes.plot(*places[of][corner[outside]], "o", color=RED, ms=6, zorder=5)
    arrow(axes, places[stone][3], (0, -0.3))


def draw_wall(axes, made, falls, moves, share):
    axes.set_title("A wall pushed sideways")
    subtitle(axes, f"by {share:.4f} of its weight: what falls")
    axes.set_aspect("equal")
    axes.set(xlim=(-1, 11), ylim=(-0.8, 11), xlabel="x")
    draw_floor(axes, -1, 11)
    axes.set_yticks([0, 5, 10])
    places = moved(made, falls.velocity, 1.2)
    for p, falling in zip(places, moves):
        draw_stones(axes, [p], fc="#bcd8e8" if falling else SAND, ec=QUIET)


def draw(folder, arch, stone, stands, falls, hinges, share, wall, *of_wall):
    """Writes statics.png, statics.svg and statics.json; returns their paths."""

    def panels(axes):
        draw_thrust(axes[0], arch, stone, stands, share)
        draw_mechanism(axes[1], arch, stone, falls, hinges)
        draw_wall(axes[2], wall, *of_wall)

    return paint(folder, "statics", panels, 3, (14.5, 4.6), width_ratios=[1.25, 1.25, 1.0])
