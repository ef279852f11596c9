"""A drawer that sticks: pulled off its middle, friction grows with what accelerates it. (See
docs/machines.md; drawer.c is the same in C.)

    python examples/machines/drawer.py [--output FOLDER | --no-picture]

Its mass centre is h off the line of the pull, and the moment m x'' h presses its corners against a
guide of length L: N = 2 m h x'' / L. While it moves, m x'' + mu |N| = F: two half-lines with the
inertias m (1 + 2 mu h / L) and m (1 - 2 mu h / L), which is negative beyond h = L / (2 mu).
"""

import numpy as np
from common import bisect, run

import perp

M, L, MU = 2.0, 0.3, 0.4


def drawer(offset):
    return M, 0.0, 2 * M * offset / L, 0.0, MU


def accelerations(offset, force):
    found = perp.load_friction(*drawer(offset), 1.0, force)
    assert found.exhaustive
    return found


def jams(offset):
    return not accelerations(offset, -1.0)


def report():
    found = accelerations(0.5, 1.0)
    for s in reversed(list(found)):
        print(f"h = 0.5, pulled on by 1 N: {s.acceleration[0]:+.6f} m/s2, "
              f"inertia {1 / s.acceleration[0]:+.6f} kg, {'stable' if s.stable else 'unstable'}")
    print(f"held back by 1 N: {len(accelerations(0.5, -1.0))} accelerations")
    critical = bisect(jams, 0.1, 0.9)
    print(f"none beyond h = {critical:.9f}, by the formula {L / (2 * MU):.9f}")
    print(f"all mu may grow by the factor {accelerations(0.3, 1.0).margin:.6f} at h = 0.3")
    offsets = np.linspace(0, 0.7, 141)
    speeds = [
        perp.load_friction_step(*drawer(h), 1.0, -1.0, 0.1).velocity[0] for h in offsets
    ]
    step = perp.load_friction_step(*drawer(0.5), 1.0, -1.0, 1e-3)
    print(f"a step of 1 ms from 1 m/s: velocity {step.velocity[0]}{', a jam' if step.jam else ''}")
    return offsets, speeds, critical


def draw_half_lines(axes):
    from pictures import BLUE, INK, QUIET, RED, subtitle

    axes.set_title("Force over acceleration")
    subtitle(axes, "h = 0.5 m: one inertia is negative")
    for side, colour in ((1, BLUE), (-1, RED)):
        x = side * np.array([0, 2.2])
        axes.plot(x, (M + side * MU * drawer(0.5)[2]) * x, color=colour, lw=2.4)
    for force in (1.0, -1.0):
        axes.axhline(force, color=QUIET, lw=0.9, ls=(0, (4, 3)))
        for s in accelerations(0.5, force):
            axes.plot(s.acceleration[0], force, "o", ms=8, mew=1.8,
                      mec=BLUE if s.stable else RED, mfc=BLUE if s.stable else "white", zorder=4)
    axes.text(0.5, 3.4, "4.67 kg: stable", ha="right", color=BLUE)
    axes.text(-2.1, 1.75, "-0.67 kg: unstable", color=RED)
    axes.text(0.65, 1.12, "two", color=INK)
    axes.text(0.15, -0.88, "none: it jams", color=INK)
    axes.set(xlabel="acceleration (m/s²)", ylabel="force (N)", xlim=(-2.2, 1.4), ylim=(-2, 5))


def draw_counts(axes, critical):
    from pictures import GROUND, INK, SAND, subtitle

    axes.set_title("How many accelerations")
    subtitle(axes, "moving on, counted at 36 by 40 points")
    offsets, forces = np.linspace(0.01, 0.71, 36), np.linspace(-1.95, 1.95, 40)
    counts = [[len(accelerations(h, f)) for h in offsets] for f in forces]
    from matplotlib.colors import ListedColormap

    axes.pcolormesh(offsets, forces, counts, cmap=ListedColormap(["#e2a396", GROUND, SAND]),
                    vmin=0, vmax=2, shading="nearest", rasterized=True)
    axes.axvline(critical, color=INK, lw=1.4)
    for place, word in (((0.19, 0), "one"), ((0.54, 1), "two"), ((0.54, -1), "none")):
        axes.text(*place, word, ha="center", va="center", color=INK)
    axes.text(critical - 0.01, -1.8, f"h = L / 2μ = {critical:.3f} m", ha="right", color=INK)
    axes.set(xlabel="offset h (m)", ylabel="force along the motion (N)")


def draw_speeds(axes, offsets, speeds, critical):
    from pictures import BLUE, INK, QUIET, RED, subtitle

    axes.set_title("Held back by 1 N for 0.1 s")
    subtitle(axes, "velocity after a step from 1 m/s")
    speeds = np.array(speeds)
    moves = speeds > 0
    axes.plot(offsets[moves], speeds[moves], color=BLUE, lw=2.2)
    axes.plot(offsets[~moves], speeds[~moves], color=RED, lw=2.6)
    sliding = M * (1 - offsets[offsets < critical] / critical)
    law = 1 - 0.1 / sliding
    axes.plot(offsets[offsets < critical][law > 0], law[law > 0], color=INK, lw=1,
              ls=(0, (4, 3)), label="1 - F t / (m (1 - 2 μ h / L))")
    axes.axvline(critical, color=QUIET, lw=0.9)
    axes.text(0.68, 0.06, "stops, beyond the line at once: 0.0", ha="right", color=RED)
    axes.set(xlabel="offset h (m)", ylabel="velocity (m/s)", ylim=(-0.06, 1.1))
    axes.legend(frameon=False, loc="lower left")


def draw(axes, data):
    offsets, speeds, critical = data
    draw_half_lines(axes[0])
    draw_counts(axes[1], critical)
    draw_speeds(axes[2], offsets, speeds, critical)


if __name__ == "__main__":
    run("drawer", __doc__, report, draw, 3, (14, 4.4))
