"""The picture of pyramid.py: the same moment after the hit, at three accuracies."""

import numpy as np
from matplotlib.patches import Polygon, Rectangle
from pictures import CHAOS, GROUND, INK, SAND, paint, subtitle

CORNERS = 0.5 * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])


def draw_level(axes, accuracy, moved, places, angles, residual):
    axes.set_title(f"“{accuracy}”")
    axes.set_gid(CHAOS)  # 1e-12 m of rounding before the hit are decimetres after it
    told = "below 1e-8" if residual < 1e-8 else f"{residual:.0e}"
    subtitle(axes, f"stood for a second: moved by {moved:.1f} m; hit: residual {told}")
    axes.add_patch(Rectangle((-10, -0.4), 40, 0.4, color=GROUND, lw=0))
    for (x, y), angle in zip(places[:-1], angles[:-1]):
        c, s = np.cos(angle), np.sin(angle)
        corners = CORNERS @ np.array([[c, s], [-s, c]]) + (x, y)
        axes.add_patch(Polygon(corners, fc=SAND, ec=INK, lw=0.9, zorder=2))
    around = np.linspace(0, 2 * np.pi, 40)
    x, y = places[-1]
    axes.fill(x + 0.5 * np.cos(around), y + 0.5 * np.sin(around), fc=INK, zorder=2)
    axes.set_aspect("equal")
    axes.set(xlim=(-5, 12), ylim=(-0.4, 8), xlabel="m")


def draw(folder, found):
    """Writes pyramid.png, pyramid.svg and pyramid.json; returns their paths."""

    def panels(axes):
        for panel, (accuracy, values) in zip(axes, found.items()):
            draw_level(panel, accuracy, *values)

    return paint(folder, "pyramid", panels, 3, (14.5, 3.6))
