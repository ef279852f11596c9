"""The picture of lead_screw.py: torque over acceleration, compliant runs, a screw that is driven,
jam times."""

import numpy as np
from pictures import BLUE, INK, QUIET, RED, paint, subtitle

import perp


def draw_half_lines(axes, rigid):
    A, b, C, d, mu = rigid
    axes.set_title("Torque over acceleration")
    subtitle(axes, "screw turning forward; friction adds inertia or takes it")
    vertex = -d / C
    spread = np.array([0, 1900.0])
    for side, colour in ((1, BLUE), (-1, RED)):
        x = vertex + side * spread
        axes.plot(x, A * x + b + mu * np.abs(C * x + d), color=colour, lw=2.4)
        word = "N > 0: stable" if side > 0 else "N < 0: unstable"
        place = (-1150, 0.17) if side > 0 else (-3950, 0.03)
        axes.text(*place, word, ha="right" if side > 0 else "left", color=colour)
    for torque in (0.0, -0.1):
        found = perp.load_friction(*rigid, 1.0, torque)
        axes.axhline(torque, color=QUIET, lw=0.9, ls=(0, (4, 3)))
        for s in found:
            axes.plot(
                s.acceleration[0], torque, "o", ms=8, mew=1.8, mec=BLUE if s.stable else RED,
                mfc=BLUE if s.stable else "white", zorder=4,
            )
        count = {0: "no acceleration", 2: "two accelerations"}[len(found)]
        axes.annotate(
            f"T = {torque:g}: {count}", (450, torque), (0, -14),
            textcoords="offset points", color=INK, ha="right", fontsize=9.5,
        )
    axes.plot(vertex, A * vertex + b, "s", ms=5, color=INK, zorder=5)
    axes.set(xlabel="angular acceleration (rad/s²)", ylabel="torque (N m)")
    axes.set(xlim=(-4400, 500), ylim=(-0.15, 0.3))
    axes.set_xticks([-4000, -3000, -2000, -1000])


def draw_runs(axes, divide, runs):
    axes.set_title("Compliant thread, T = 0")
    subtitle(axes, "started 0.1 % to either side of the unstable answer")
    for run, colour, text in zip(runs, (BLUE, RED), ("to N > 0", "into a jam")):
        t, N = 1e3 * run.samples[:, 0], run.samples[:, -1]
        axes.plot(t, N, color=colour, lw=1.8)
        axes.plot(t[-1], N[-1], "o", color=colour, ms=6)
        axes.annotate(
            f"{text}: at rest\nafter {t[-1]:.3f} ms", (t[-1], N[-1]),
            (-8, 30) if colour == BLUE else (14, 10), textcoords="offset points",
            ha="right" if colour == BLUE else "left", color=colour, fontsize=9.5,
        )
    axes.axhline(divide, color=QUIET, lw=0.9, ls=(0, (4, 3)))
    axes.set(xlabel="time (ms)", ylabel="normal force (N)", ylim=(-430, 190))


def draw_driven(axes, rigid, driven):
    """One torque after the other; the rigid screw jams at once where it has no acceleration."""
    axes.set_title("Reverses, stops, starts")
    subtitle(axes, "compliant thread, one torque after the other")
    start = 0.0
    for torque, run in driven:
        t = 1e3 * run.samples[:, 0]
        axes.plot(start + t, run.samples[:, 3], color=BLUE, lw=2.4)
        found = perp.load_friction(*rigid, 0.0, torque)
        speed = 1e-3 * t * next(s.acceleration[0] for s in found if s.stable)
        axes.plot(start + t, speed, color=INK, lw=1, ls=(0, (4, 3)))
        axes.text(start + 1, -128, f"T = {torque:g}", color=INK)
        start += t[-1]
        axes.axvline(start, ymax=0.1, color=QUIET, lw=0.9)
    axes.plot([], [], color=BLUE, lw=2.4, label="compliant")
    axes.plot([], [], color=INK, lw=1, ls=(0, (4, 3)), label="rigid, from rest")
    axes.set(xlabel="time (ms)", ylabel="angular velocity (rad/s)", ylim=(-135, 75))
    axes.legend(frameon=False, loc="upper right")


def draw_times(axes, stiffnesses, times):
    axes.set_title("No acceleration: the jam")
    subtitle(axes, "T = -0.1; time to rest from 10 rad/s")
    axes.loglog(stiffnesses, 1e3 * times, "o-", color=RED, ms=5, lw=1.6, label="compliant runs")
    law = 1e3 * times[-1] * np.sqrt(stiffnesses[-1] / stiffnesses)
    axes.loglog(stiffnesses, law, color=INK, lw=1, ls=(0, (4, 3)), label="stiffness$^{-1/2}$")
    axes.set(xlabel="stiffness (N/m)", ylabel="time (ms)")
    axes.legend(frameon=False)


def draw(folder, rigid, divide, runs, driven, stiffnesses, times):
    """Writes lead_screw.png, lead_screw.svg and lead_screw.json; returns their paths."""

    def panels(axes):
        draw_half_lines(axes[0], rigid)
        draw_runs(axes[1], divide, runs)
        draw_driven(axes[2], rigid, driven)
        draw_times(axes[3], stiffnesses, times)

    return paint(folder, "lead_screw", panels, 4, (19, 4.6))
