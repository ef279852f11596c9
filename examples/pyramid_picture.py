"""The picture of pyramid.py: the same half second after the hit, at three accuracies."""

import numpy as np
from matplotlib.patches import Polygon, Rectangle
from pictures import BLUE, GROUND, INK, SAND, paint, subtitle

CORNERS = 0.5 * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])


def draw_level(axes, accuracy, moved, places, angles, residual, exact):
    axes.set_title(f"“{accuracy}”")
    subtitle(axes, f"at rest before: moved by {moved:g}; residual {residual:.0e}")
    axes.add_patch(Rectangle((-10, -0.4), 40, 0.4, color=GROUND, lw=0))
    for (x, y), (u, v) in zip(places, exact):
        axes.plot([x, u], [y, v], color=BLUE, lw=0.6, zorder=3)
    for (x, y), angle in zip(places[:-1], angles[:-1]):
        c, s = np.cos(angle), np.sin(angle)
        corners = CORNERS @ np.array([[c, s], [-s, c]]) + (x, y)
        axes.add_patch(Polygon(corners, fc=SAND, ec=INK, lw=0.9, zorder=2))
    around = np.linspace(0, 2 * np.pi, 40)
    x, y = places[-1]
    axes.fill(x + 0.5 * np.cos(around), y + 0.5 * np.sin(around), fc=INK, zorder=2)
    axes.set_aspect("equal")
    axes.set(xlim=(-5, 15), ylim=(-0.4, 8), xlabel="m")


def draw(folder, found):
    """Writes pyramid.png, pyramid.svg and pyramid.json; returns their paths."""

    def panels(axes):
        for panel, (accuracy, values) in zip(axes, found.items()):
            draw_level(panel, accuracy, *values, found["exact"][1])

    return paint(folder, "pyramid", panels, 3, (14.5, 3.6))
