"""The picture of painleve_map.py: where there are one, no, and two accelerations, and why."""

import math

import numpy as np
from matplotlib.colors import ListedColormap
from pictures import BLUE, GROUND, INK, QUIET, RED, SAND, paint, subtitle

G = 9.81
COLOURS = ("#e2a396", GROUND, SAND)  # of none, one, two


def critical(angles):
    """p = 0: friction takes away what the normal force pushes."""
    return (1 + 3 * np.cos(angles) ** 2) / (3 * np.sin(angles) * np.cos(angles))


def draw_map(axes, angles, frictions, spin, counts):
    axes.set_title("Accelerations, not turning" if spin == 0 else f"Turning at {spin:.1f} rad/s")
    subtitle(axes, f"tip sliding to the left; counted at {len(angles)} by {len(frictions)} points")
    edges = np.degrees(angles), frictions
    axes.imshow(
        counts, origin="lower", aspect="auto", cmap=ListedColormap(COLOURS), vmin=-0.5, vmax=2.5,
        extent=(0, 90, 0, 3), interpolation="nearest",
    )
    inner = np.linspace(0.02, math.pi / 2 - 0.02, 400)
    axes.plot(np.degrees(inner), critical(inner), color=INK, lw=1.6)
    axes.plot(math.degrees(math.atan(2)), 4 / 3, "o", color=INK, ms=6, zorder=4)
    axes.annotate("4/3", (math.degrees(math.atan(2)), 4 / 3), (0, -14), ha="center",
                  textcoords="offset points", color=INK)
    place = math.degrees(math.acos(math.sqrt(3 / 7)))
    axes.plot(place, 8 / 27**0.5, "s", color=INK, ms=5, zorder=4)
    axes.annotate("8/(3√3)", (place, 8 / 27**0.5), (-6, -12), ha="right",
                  textcoords="offset points", color=INK)
    axes.text(29, 2.72, "$p = 0$", ha="left", color=INK)
    if spin:
        lifts = math.degrees(math.asin(G / spin**2))
        axes.axvline(lifts, color=INK, lw=1.2, ls=(0, (4, 3)))
        axes.text(lifts - 1.5, 0.12, "$b = 0$", ha="right", color=INK)
    for number, word in enumerate(("none", "one", "two")):
        rows, columns = np.nonzero(counts == number)
        if len(rows):
            place = np.median(edges[0][columns]), np.median(edges[1][rows])
            if number == 1:
                place = 20, 0.7
            axes.text(*place, word, ha="center", va="center", fontsize=12, color=INK)
    axes.set(xlabel="angle (degrees)", ylabel="friction μ", xlim=(0, 90), ylim=(0, 3))
    axes.set_xticks([0, 30, 60, 90])


def draw_lines(axes):
    axes.set_title("Why: the tip's normal acceleration")
    subtitle(axes, "$a = p N + b$ for μ = 2 at 63.4°; and N ≥ 0, a ≥ 0, one is 0")
    N, s = np.array([-1.0, 12.0]), math.sin(math.atan(2))
    axes.axhline(0, color=QUIET, lw=0.8)
    axes.axvline(0, color=QUIET, lw=0.8)
    axes.plot([0, 0, 12], [12, 0, 0], color=SAND, lw=9, zorder=0, solid_joinstyle="round")
    for spin, colour in ((0.0, RED), (4.0, BLUE)):
        b = spin**2 * s - G
        axes.plot(N, -0.8 * N + b, color=colour, lw=2)
        answers = [(0, b), (b / 0.8, 0)] if b > 0 else []
        for k, point in enumerate(answers):
            fill = "white" if k else colour
            axes.plot(*point, "o", ms=8, mec=colour, mew=1.8, mfc=fill, zorder=4)
        word = "two answers,\none unstable" if answers else "no answer"
        axes.annotate(
            f"{spin:g} rad/s: {word}", (6, 0.3) if answers else (0.5, b), (6, 10),
            textcoords="offset points", color=colour,
        )
    axes.set(xlabel="normal force N", ylabel="normal acceleration", xlim=(-1, 12), ylim=(-14, 7))


def draw(folder, angles, frictions, maps):
    """Writes painleve_map.png, painleve_map.svg and painleve_map.json; returns their paths."""

    def panels(axes):
        for place, (spin, counts) in zip(axes, maps.items()):
            draw_map(place, angles, frictions, spin, counts)
        draw_lines(axes[2])

    return paint(folder, "painleve_map", panels, 3, (14.5, 4.8))
