"""The picture of simulate.py: a brick that stops, Painlevé's rod, a stack of boxes."""

import math

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.patches import FancyBboxPatch, Rectangle
from pictures import BLUE, GROUND, INK, QUIET, RED, SAND, TIME, capsule, paint, subtitle


def explicit_sign(h, stop, pull, hold):
    """What a fixed step makes of m v' = pull - hold sign(v): the speed chatters around 0."""
    times, speeds = [stop - 4 * h], [4 * h * (hold - pull)]
    while times[-1] < stop + 20 * h:
        speeds.append(speeds[-1] + h * (pull - hold * np.sign(speeds[-1])))
        times.append(times[-1] + h)
    return np.array(times), np.array(speeds)


def draw_brick(axes, brick):
    times, speeds, stop = brick
    axes.set_title("A brick stops on a ramp")
    subtitle(axes, "10° slope, μ = 0.3, 2 m/s downhill")
    shown = times <= 2.5
    axes.plot(times[shown], speeds[shown], color=BLUE, lw=2.6, label="perp", zorder=3)
    line = np.array([0, stop, 2.5])
    exact = np.array([2.0, 0, 0])
    axes.plot(line, exact, color=INK, lw=1.2, ls=(0, (4, 3)), label="closed form", zorder=4)
    axes.set(xlabel="time (s)", ylabel="speed (m/s)", xlim=(0, 2.5), ylim=(-0.1, 2.15))
    axes.set_yticks([0, 0.5, 1, 1.5, 2])
    axes.annotate(
        f"velocity 0.0\nfrom {stop:.3f} s on",
        (stop, 0),
        (1.08, 0.22),
        ha="center",
        color=BLUE,
        arrowprops=dict(arrowstyle="-", color=BLUE, lw=0.8, shrinkB=3, relpos=(1, 0.3)),
    )

    inset = axes.inset_axes([0.5, 0.5, 0.5, 0.4])
    h = 1e-3
    pull, hold = 9.81 * math.sin(math.radians(10)), 2.943 * math.cos(math.radians(10))
    chatter = explicit_sign(h, stop, pull, hold)
    milli = 1e3
    inset.axhline(0, color=GROUND, lw=0.8)
    inset.plot(milli * (chatter[0] - stop), milli * chatter[1], color=RED, lw=1)
    near = np.abs(times - stop) < 0.03
    inset.plot(milli * (times[near] - stop), milli * speeds[near], color=BLUE, lw=2.2)
    inset.set(xlim=(-4, 20), ylim=(-3.5, 6.5))
    inset.set_xlabel("time since the stop (ms)", fontsize=8.5, labelpad=1)
    inset.set_ylabel("mm/s", fontsize=8.5, labelpad=0)
    inset.tick_params(labelsize=8)
    inset.set_xticks([0, 10, 20])
    inset.set_yticks([0, 5])
    inset.text(19.8, 5.6, "explicit steps with sign(v)", color=RED, fontsize=8.5, ha="right")
    axes.legend(loc="lower left", frameon=False, bbox_to_anchor=(-0.01, 0.0), handlelength=2.2)


def draw_rod(axes, rod):
    states, (step, _) = rod
    axes.set_title("Painlevé's rod")
    subtitle(axes, "μ = 0.6: sliding would need a pulling force, so the tip sticks")
    norm = Normalize(0, 1)
    axes.add_patch(Rectangle((-2, -0.2), 4, 0.2, color=GROUND, lw=0))
    axes.plot(states[:, 1], states[:, 2], color=QUIET, lw=0.8, ls=(0, (1, 2)), zorder=1)
    for time in (0.0, 0.12, 0.22, 0.31, 0.43, 0.47, 0.51, 1.0):
        _, x, y, angle = states[round(time / states[1, 0])]
        colour = TIME(norm(time))
        capsule(axes, x, y, angle, fc=(*colour[:3], 0.3), ec=colour, lw=1.1, zorder=2)
    time, x, y, angle = states[step]
    capsule(axes, x, y, angle, fc=RED, ec=RED, alpha=0.85, lw=1.1, zorder=4)
    tip = x - 0.25 * math.cos(angle), y - 0.25 * math.sin(angle) - 0.05
    axes.plot(*tip, marker=(9, 1, 0), ms=17, color=RED, mec="white", mew=1.0, zorder=5)
    axes.annotate(
        f"impact at {time:.3f} s, {math.degrees(angle):.0f}°:\nthe tip sticks",
        tip,
        (0.3, 0.13),
        color=RED,
        va="center",
        arrowprops=dict(arrowstyle="-", color=RED, lw=0.8, shrinkB=9),
    )
    axes.set_aspect("equal")
    axes.set(xlabel="x (m)", ylabel="height (m)", xlim=(-0.62, 0.75), ylim=(-0.08, 1.25))
    axes.set_yticks([0, 0.5, 1])
    axes.set_xticks([-0.5, 0, 0.5])
    bar = axes.inset_axes([0.66, 0.9, 0.3, 0.025])
    colours = axes.figure.colorbar(ScalarMappable(norm, TIME), cax=bar, orientation="horizontal")
    colours.outline.set_visible(False)
    colours.set_ticks([0, 0.5, 1])
    bar.tick_params(labelsize=8.5, length=2)
    bar.set_title("time (s)", fontsize=8.5, fontweight="normal", pad=3, loc="center")


def draw_stack(axes, boxes):
    points, forces = boxes
    count = len(forces)
    axes.set_title("A stack at rest")
    subtitle(axes, f"{count} boxes of 1 kg; normal forces")
    axes.add_patch(Rectangle((-5, -1), 10, 1, color=GROUND, lw=0))
    for k in range(count):
        corner = FancyBboxPatch(
            (-0.97, k + 0.03), 1.94, 0.94, boxstyle="round,pad=0,rounding_size=0.08"
        )
        corner.set(fc=SAND, ec=INK, lw=0.9)
        axes.add_patch(corner)
    # of the four corners of a contact, two stand behind each other: one arrow for both
    arrow = dict(arrowstyle="-|>,head_width=0.2,head_length=0.4", color=RED, lw=1.8)
    for k, force in enumerate(forces):
        for side in (-1, 1):
            pair = sum(f for p, f in points if round(p[2]) == k and p[0] * side > 0)
            foot = side * 0.8, k + 0.03
            head = foot[0], foot[1] + 1.7 * pair / forces[0]
            axes.annotate("", head, foot, arrowprops=dict(arrow, shrinkA=0, shrinkB=0))
        axes.text(1.12, k + 0.25, f"{force:.2f} N", va="center", color=RED, fontsize=9)
    axes.text(-1.12, count / 2, "every velocity is 0.0", rotation=90, va="center", ha="right")
    axes.set_aspect("equal", anchor="W")
    axes.set(ylabel="height (m)", xlim=(-2.3, 2.7), ylim=(-0.4, count + 0.4))
    axes.set_xticks([])
    axes.set_yticks(range(0, count + 1, 2))
    axes.spines["bottom"].set_visible(False)


def draw(folder, brick, rod, boxes):
    """Writes simulate.png, simulate.svg and simulate.json; returns their paths."""

    def panels(axes):
        draw_brick(axes[0], brick)
        draw_rod(axes[1], rod)
        draw_stack(axes[2], boxes)

    return paint(
        folder, "simulate", panels, 3, (14.5, 5.2), dpi=160, width_ratios=[1.15, 1.1, 0.62]
    )
