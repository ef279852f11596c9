"""A finger pushed over a surface, tip ahead: it slides, ever harder the steeper it stands, or jams.
(Dupont's sliding fingers; see docs/machines.md.)

    python examples/machines/sliding_finger.py [--output FOLDER | --no-picture]

The finger of length l is hinged to a carriage on a rail and pressed down by a torque; at the angle
a

    M x'' = F - mu N,   N = torque / (l (cos a - mu sin a)).

If mu >= cot a no force of sliding friction exists: the finger jams, by an impact without collision.
"""

import math

import numpy as np
from common import bisect, run

import perp

CARRIAGE, INERTIA, LENGTH, TORQUE, PUSH, MU = 1.0, 0.02, 0.5, 1.0, 1.0, 0.5


def finger(angle, mu=MU):
    """q: the carriage's place, and the angle between finger and surface."""
    height = LENGTH * math.sin(angle)

    def contacts(q):
        c, s = LENGTH * math.cos(q[1]), LENGTH * math.sin(q[1])
        return [height - s], [[0, -c]], [[1, -s]]

    return perp.Mechanism(
        2, mass=[CARRIAGE, INERTIA], force=[PUSH, TORQUE], contacts=contacts, mu=mu
    )


def sliding_force(angle):
    """N of the formula, +inf where there is none."""
    free = math.cos(angle) - MU * math.sin(angle)
    return TORQUE / (LENGTH * free) if free > 0 else math.inf


def step_force(angle):
    """N and friction over N of one short step at 1 m/s, and the velocity after it."""
    answer = finger(angle).step(0, [0, angle], [1, 0], 1e-6)
    assert answer.ok
    normal, friction = answer.impulse
    return normal / 1e-6, friction / normal, answer.v[0]


def accelerations(angle):
    found = finger(angle).accelerations(0, [0, angle], [1, 0])
    assert found.exhaustive
    return len(found)


def way(angle, h=1e-3):
    """How far it slides from 1 m/s."""
    answer = finger(angle).simulate([0, angle], [1, 0], 1.8, h)
    assert answer.ok and answer.v[-1, 0] == 0.0
    return answer


def report():
    steep = math.degrees(bisect(lambda a: accelerations(a) == 0, 0.1, 1.5))
    print(f"jams from {steep:.6f} degrees on; arccot(mu) is {math.degrees(math.atan(1 / MU)):.6f}")
    runs = {degrees: way(math.radians(degrees)) for degrees in (30, 45, 60)}
    for degrees, answer in runs.items():
        angle = math.radians(degrees)
        slows = (MU * sliding_force(angle) - PUSH) / CARRIAGE
        print(f"{degrees} degrees: N = {step_force(angle)[0]:.6f} N (formula "
              f"{sliding_force(angle):.6f}), slides {answer.q[-1, 0]:.4f} m ({0.5 / slows:.4f})")
    angle = math.radians(70)
    _, ratio, after = step_force(angle)
    print(f"accelerations at 60 degrees: {accelerations(math.radians(60))}, at 70: "
          f"{accelerations(angle)}; there a step stops it, velocity {after},\n"
          f"    friction / normal impulse {-ratio:.5f} (cot a = {1 / math.tan(angle):.5f})")
    angles = np.radians(np.arange(8, 63, 2.5))
    return angles, [step_force(a)[0] for a in angles], runs


def draw(axes, data):
    from matplotlib.patches import Arc, Rectangle
    from pictures import BLUE, GROUND, INK, QUIET, RED, SAND, subtitle

    angles, forces, runs = data
    place = axes[0]
    place.set_title("A pushed finger")
    subtitle(place, "pressed down by a torque at the hinge")
    place.add_patch(Rectangle((-1, -0.3), 3, 0.3, color=GROUND, lw=0))
    for degrees, colour, left in ((45, BLUE, -0.45), (70, RED, 0.45)):
        a = math.radians(degrees)
        x, y = LENGTH * math.cos(a), LENGTH * math.sin(a)
        place.add_patch(Rectangle((left - 0.1, y - 0.04), 0.2, 0.08, fc=SAND, ec=INK, lw=1))
        place.plot([left, left + x], [y, 0], color=colour, lw=4, solid_capstyle="round")
        place.plot(left, y, "o", color=INK, ms=4, zorder=4)
        place.annotate("", (left - 0.12, y), (left - 0.3, y),
                       arrowprops=dict(arrowstyle="-|>", color=INK, lw=1.4))
        place.add_patch(
            Arc((left + x, 0), 0.24, 0.24, theta1=180 - degrees, theta2=180, color=colour)
        )
        place.text(left + x + 0.05, 0.03, f"{degrees}°: " + ("slides" if degrees < 63 else "jams"),
                   color=colour)
    place.set_aspect("equal")
    place.set(xlim=(-0.85, 1.05), ylim=(-0.12, 0.78), xticks=[], yticks=[])
    for spine in place.spines.values():
        spine.set_visible(False)

    axes[1].set_title("Normal force while it slides")
    subtitle(axes[1], "μ = 0.5; steps of perp, and the formula")
    fine = np.linspace(0.1, math.atan(1 / MU) - 0.004, 400)
    axes[1].plot(np.degrees(fine), [sliding_force(a) for a in fine], color=INK, lw=1.2)
    axes[1].plot(np.degrees(angles), forces, "o", color=BLUE, ms=4)
    limit = math.degrees(math.atan(1 / MU))
    axes[1].axvspan(limit, 90, color=RED, alpha=0.12, lw=0)
    axes[1].text((limit + 90) / 2, 30, "no sliding\nforce exists:\njams", color=RED, ha="center")
    axes[1].set(xlabel="angle (degrees)", ylabel="N (newton)", xlim=(0, 90), ylim=(0, 60))

    axes[2].set_title("Speed of the carriage")
    subtitle(axes[2], "from 1 m/s, pushed by 1 N")
    for (degrees, answer), colour in zip(runs.items(), (BLUE, INK, QUIET)):
        axes[2].plot(answer.t, answer.v[:, 0], color=colour, lw=2)
        k = int(np.argmax(answer.v[:, 0] == 0.0))
        axes[2].annotate(f"{degrees}°", (0.5 * answer.t[k], 0.5), (4, 4), color=colour,
                         textcoords="offset points")
    axes[2].plot([0, 0], [1, 0], color=RED, lw=2)
    axes[2].annotate("from 63.4° on: at once", (0, 0.9), (0.45, 0.93), color=RED, va="center",
                     arrowprops=dict(arrowstyle="-", color=RED, lw=0.8))
    axes[2].set(xlabel="time (s)", ylabel="speed (m/s)", xlim=(-0.03, 1.8), ylim=(-0.03, 1.05))


if __name__ == "__main__":
    run("sliding_finger", __doc__, report, draw, 3, (14, 4.2))
