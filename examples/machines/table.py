"""A rigid table on more legs than it takes: the load is shared, how is open. (See
docs/machines.md.)

    python examples/machines/table.py [--output FOLDER | --no-picture]

Four legs at (+-1, +-1/2), a weight of 100 at (0.3, 0.1). Forces that push one diagonal and relieve
the other by the same t don't show in the table's balance: t in [-12.5, 22.5] keeps all legs
pressed.
"""

import numpy as np
from common import run

import perp

WEIGHT, X, Y = 100.0, 0.3, 0.1
LEGS = np.array([[1, 0.5], [-1, 0.5], [-1, -0.5], [1, -0.5]])


def table(legs):
    """q: height, and small turns about x and y."""
    rows = np.column_stack([np.ones(len(legs)), legs[:, 1], -legs[:, 0]])
    return perp.Mechanism(
        3, mass=[10, 2, 3], force=[-WEIGHT, -WEIGHT * Y, WEIGHT * X],
        contacts=lambda q: (rows @ q, rows), contact_count=len(legs), dim=1,
    )


def wrench(legs, forces):
    return forces.sum(), forces @ legs[:, 1], forces @ legs[:, 0]


def circle(count):
    angles = 2 * np.pi * np.arange(count) / count
    return np.column_stack([np.cos(angles), np.sin(angles)])


def report():
    found = table(LEGS).accelerations(0, np.zeros(3), np.zeros(3))
    assert found.exhaustive
    print(f"four legs: {len(found)} answer ({found.reason}), acceleration {found[0].acceleration}")
    ends = found[0].vertices[np.argsort(found[0].vertices[:, 0])]
    for word, end in zip(("forces from", "to"), ends):
        print(f"    {word:12}" + " ".join(f"{force:g}" for force in end))
    print(f"    a family of dimension {found[0].dimension}; each has the wrench "
          + " ".join(f"{number:g}" for number in wrench(LEGS, ends[1])))
    step = table(LEGS).step(0, np.zeros(3), np.zeros(3), 0.01)
    chosen = step.impulse / 0.01
    print(f"a step takes {' '.join(f'{force:.6f}' for force in chosen)}, velocity {step.v}")

    legs = circle(1000)
    many = table(legs).step(0, np.zeros(3), np.zeros(3), 0.01)
    forces = many.impulse / 0.01
    total = wrench(legs, forces)
    print(f"a thousand legs: {many.outcome}, wrench {' '.join(f'{x:.6f}' for x in total)}, "
          f"{int((forces > 0).sum())} of them pressed, velocity {many.v}")
    return ends, chosen, forces


def draw(axes, data):
    from matplotlib.patches import Rectangle
    from pictures import BLUE, INK, QUIET, RED, SAND, subtitle

    ends, chosen, forces = data
    axes[0].set_title("A table from above")
    subtitle(axes[0], "forces of the legs that a step takes (newton)")
    axes[0].add_patch(Rectangle((-1.15, -0.65), 2.3, 1.3, fc=SAND, ec=INK, lw=1.2))
    for (x, y), force in zip(LEGS, chosen):
        axes[0].plot(x, y, "o", color=BLUE, ms=3 + force**0.5 * 1.6, alpha=0.85)
        axes[0].text(x, y + (0.3 if y > 0 else -0.32), f"{force:.1f}", color=BLUE, ha="center",
                     va="center")
    axes[0].plot(X, Y, "X", color=RED, ms=10)
    axes[0].text(X + 0.08, Y + 0.02, "100", color=RED, va="center")
    axes[0].set_aspect("equal")
    axes[0].set(xlim=(-1.6, 1.6), ylim=(-1.05, 1.05), xlabel="x (m)", ylabel="y (m)")

    axes[1].set_title("What each leg may carry")
    subtitle(axes[1], "the family of all answers, from one end to the other")
    for k in range(4):
        low, high = sorted(ends[:, k])
        axes[1].plot([k, k], [low, high], color=QUIET, lw=7, solid_capstyle="butt", alpha=0.5)
        axes[1].plot(k, chosen[k], "o", color=BLUE, ms=7)
    for t in np.linspace(0, 1, 5):
        axes[1].plot(range(4), ends[0] + t * (ends[1] - ends[0]), color=INK, lw=0.7,
                     alpha=0.5)
    axes[1].set(ylabel="force (N)", xticks=range(4), ylim=(-2, 64),
                xticklabels=["(1, ½)", "(-1, ½)", "(-1, -½)", "(1, -½)"], xlabel="leg at")

    axes[2].set_title("A thousand legs on a circle")
    subtitle(axes[2], "all of these balance the load; least squares is one choice")
    angles = np.degrees(2 * np.pi * np.arange(1000) / 1000)
    least = WEIGHT / 1000 * (1 + 2 * X * np.cos(np.radians(angles)) +
                             2 * Y * np.sin(np.radians(angles)))
    axes[2].semilogy(angles, forces, ".", color=BLUE, ms=3, label="a step's")
    axes[2].semilogy(angles, least, color=INK, lw=1.2, label="least squares")
    axes[2].set(xlabel="leg at (degrees)", ylabel="force (N)", xticks=[0, 90, 180, 270, 360])
    axes[2].legend(frameon=False)


if __name__ == "__main__":
    run("table", __doc__, report, draw, 3, (14, 4.2))
