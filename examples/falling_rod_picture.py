"""The picture of falling_rod.py: the motion, its velocities, the error over the step."""

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.patches import Rectangle
from pictures import BLUE, GROUND, INK, QUIET, RED, TIME, capsule, paint, subtitle


def draw_motion(axes, run):
    axes.set_title("Falling rod")
    subtitle(axes, "0.5 m, μ = 0.6; feet that stick in red")
    norm = Normalize(0, 1)
    axes.add_patch(Rectangle((-2, -0.2), 4, 0.2, color=GROUND, lw=0))
    axes.plot(run.q[:, 0], run.q[:, 1], color=QUIET, lw=0.8, ls=(0, (1, 2)), zorder=1)
    for time in (0.0, 0.12, 0.22, 0.31, 0.3858, 0.43, 0.47, 0.51, 1.0):
        x, y, angle = run.q[np.argmin(np.abs(run.t - time))]
        colour = TIME(norm(time))
        capsule(axes, x, y, angle, fc=(*colour[:3], 0.3), ec=colour, lw=1.1, zorder=2)
    hits = np.flatnonzero((run.modes == "stick").any(axis=1) & ~(run.v == 0).all(axis=1))
    for k in hits:
        for foot in np.flatnonzero(run.modes[k] == "stick"):
            x = run.q[k, 0] + (foot - 0.5) * 0.5 * np.cos(run.q[k, 2])
            axes.plot(x, 0, ".", color=RED, ms=7, zorder=4)
    axes.set_aspect("equal")
    axes.set(xlabel="x (m)", ylabel="height (m)", xlim=(-0.62, 0.62), ylim=(-0.08, 1.25))
    axes.set_yticks([0, 0.5, 1])
    axes.set_xticks([-0.5, 0, 0.5])
    bar = axes.inset_axes([0.7, 0.93, 0.28, 0.025])
    colours = axes.figure.colorbar(ScalarMappable(norm, TIME), cax=bar, orientation="horizontal")
    colours.outline.set_visible(False)
    colours.set_ticks([0, 0.5, 1])
    bar.tick_params(labelsize=8.5, length=2)
    bar.set_title("time (s)", fontsize=8.5, fontweight="normal", pad=3, loc="center")


def draw_velocities(axes, run):
    axes.set_title("Velocities")
    subtitle(axes, f"shocks are jumps; step {1e3 * run.t[1]:.3g} ms")
    for k, (name, colour, scale) in enumerate(
        (("x'", RED, 1), ("y'", BLUE, 1), ("angle' / 4", INK, 0.25))
    ):
        axes.plot(run.t, scale * run.v[:, k], color=colour, lw=1.5, label=name)
    axes.axhline(0, color=QUIET, lw=0.6)
    axes.set(xlabel="time (s)", ylabel="m/s, rad/s", xlim=(0, 1))
    axes.legend(frameon=False, loc="lower right")


def draw_errors(axes, steps, errors, others, their_errors, limit):
    axes.set_title("Where it ends: of order 1")
    subtitle(axes, f"error of x after a second; limit {limit:.5f}")
    axes.loglog(others, their_errors, "o", color=QUIET, ms=3.5, label="other steps")
    axes.loglog(steps, errors, "o-", color=BLUE, ms=6, lw=1.6, label="h, h/4, h/16, h/64")
    axes.loglog(steps, 2 * steps, color=INK, lw=1, ls=(0, (4, 3)), label="2 h")
    axes.set(xlabel="step h (s)", ylabel="error (m)")
    axes.legend(frameon=False, loc="upper left")


def draw(folder, run, *errors):
    """Writes falling_rod.png, falling_rod.svg and falling_rod.json; returns their paths."""

    def panels(axes):
        draw_motion(axes[0], run)
        draw_velocities(axes[1], run)
        draw_errors(axes[2], *errors)

    return paint(folder, "falling_rod", panels, 3, (14.5, 5.0), width_ratios=[1.0, 1.1, 1.0])
