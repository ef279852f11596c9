"""Friction on what holds both ways: Dupont's drawer between two guides, and a linkage on four
frictional pins. (See docs/machines.md.)

    python examples/machines/pins.py [--output FOLDER | --no-picture]

Guides and pins have no clearance: their force N has any direction, and friction is mu |N|. The
drawer is theory's, m = 2.3, pulled h = 0.6 beside its middle between pins L = 0.25 apart. The
linkage is a parallelogram of three rods of 1 m and 1 kg, with pins of 5 cm: one coordinate.
"""

import numpy as np
from common import G, bisect, run

import perp

M, H, L, F = 2.3, 0.6, 0.25, 3.0
RADIUS, STEP = 0.05, 5e-3
MASS = np.tile([1, 1, 1 / 12], 3)  # of the rods: x, y, angle
PINS = [(0, -0.5, None, 0.0), (0, 0.5, 1, -0.5), (1, 0.5, 2, 0.5), (2, -0.5, None, 1.0)]


def drawer(mu):
    """q: along, across, angle."""
    normal, tangent = [[0, 1, L / 2], [0, 1, -L / 2]], [[1, 0, H], [1, 0, H]]
    return perp.Mechanism(3, mass=[M, M, 0.7], force=[F, 0, F * H], mu=mu, two_sided=1,
                          contacts=lambda q: (np.dot(normal, q), normal, tangent))


def end(q, rod, along):
    """A point of a rod, or of the ground: place, rows of its velocity, row of the rod's turning."""
    rows = np.zeros((3, 9))
    if rod is None:
        return np.array([along, 0.0]), rows
    x, y, angle = q[3 * rod : 3 * rod + 3]
    arm = along * np.array([np.cos(angle), np.sin(angle)])
    rows[:, 3 * rod : 3 * rod + 3] = [[1, 0, -arm[1]], [0, 1, arm[0]], [0, 0, RADIUS]]
    return [x, y] + arm, rows


def pins(q):
    sides = [(end(q, a, x), end(q, b, y)) for a, x, b, y in PINS]
    rows = np.array([one[1] - other[1] for one, other in sides])
    return [one[0] - other[0] for one, other in sides], rows[:, :2], rows[:, 2]


def linkage(mu):
    return perp.Mechanism(9, mass=MASS, force=np.tile([0, -G, 0], 3), contacts=pins, mu=mu,
                          two_sided=2)


def pose(angle):
    """q at an angle of the cranks, and the velocities of 1 rad/s there."""
    c, s = np.cos(angle), np.sin(angle)
    q = [c / 2, s / 2, angle, c + 0.5, s, 0, 1 + c / 2, s / 2, angle]
    return np.array(q), np.array([-s / 2, c / 2, 1, -s, c, 0, -s / 2, c / 2, 1])


def loads(forces):
    """|N| of each pin, of rows of forces."""
    return np.hypot(*np.moveaxis(np.reshape(forces, (-1, 4, 3))[:, :, :2], 2, 0))


def lost(swing, mu):
    """The energy that a swing has lost, and the work of friction, mu r |N| |turning|."""
    energy = 0.5 * swing.v**2 @ MASS + G * swing.q[:, 1::3].sum(axis=1)
    turned = np.abs(np.diff(swing.q[:, 2]))
    work = np.cumsum(mu * RADIUS * loads(swing.impulse[1:]).sum(axis=1) / STEP * turned)
    return energy[0] - energy, np.append(0, work)


def report():
    for s in reversed(list(drawer(0.35).accelerations(0, [0, 0, 0], [1, 0, 0]))):
        print(f"drawer, pulled on: {s.acceleration[0]:+.6f} m/s2, "
              f"{'stable' if s.stable else 'unstable'}, guides {s.force[0]:+.4f} {s.force[2]:+.4f} N")
    held = drawer(0.35).accelerations(0, [0, 0, 0], [-1, 0, 0])
    step = drawer(0.35).step(0, [0, 0, 0], [-1, 0, 0], 1e-3)
    print(f"pulled back: {len(held)} accelerations, a step gives velocity {step.v[0]}")
    critical = bisect(lambda mu: not drawer(mu).accelerations(0, [0, 0, 0], [-1, 0, 0]), 0.01, 0.9)
    print(f"it jams above mu = {critical:.9f}, by the formula {L / (2 * H):.9f}")
    q, way = pose(np.radians(-30))
    for sign in (1, -1):
        (s,) = linkage(0.3).accelerations(0, q, 1e-3 * sign * way)
        friction = sign * 0.3 * RADIUS * loads(s.force).sum()
        print(f"linkage at -30 degrees, {'up' if sign > 0 else 'down'}: {s.acceleration[2]:.6f} "
              f"rad/s2, by virtual work {(-2 * G * q[0] * 2 - friction) / (5 / 3):.6f}")
    swing = linkage(0.3).simulate(q, 0 * q, 15, STEP, scheme="theta")
    energy, work = lost(swing, 0.3)
    print(f"after 15 s it has lost {energy[-1]:.3f} J, by friction {work[-1]:.3f} J")
    print(f"it rests at {np.degrees(swing.q[-1][2]):.3f} degrees, velocity {swing.v[-1][2]}")
    return swing, critical


def draw_drawer(axes, critical):
    from pictures import BLUE, INK, QUIET, RED, subtitle

    axes.set_title("Drawer without clearance")
    subtitle(axes, "accelerations of a pull along its motion")
    mus = np.linspace(0.01, 0.6, 60)
    found = [(mu, s) for mu in mus for s in drawer(mu).accelerations(0, [0, 0, 0], [1, 0, 0])]
    for stable, colour in ((True, BLUE), (False, RED)):
        points = [(mu, s.acceleration[0]) for mu, s in found if s.stable == stable]
        axes.plot(*zip(*points), "o", ms=3.5, color=colour)
    axes.axvline(critical, color=QUIET, lw=0.9)
    axes.text(0.59, 0.75, "stable", ha="right", color=BLUE)
    axes.text(0.605, -4.8, "unstable, from μ = L / 2h on", ha="right", color=RED)
    axes.text(critical - 0.01, -4.6, f"{critical:.4f}", ha="right", color=INK)
    axes.set(xlabel="coefficient of friction", ylabel="acceleration (m/s²)", ylim=(-5, 2))


def draw_linkage(axes, swing):
    from pictures import INK, TIME, subtitle

    axes.set_title("Linkage on four pins")
    subtitle(axes, "μ = 0.3, let go at -30°, every 0.1 s to the other side")
    for k in range(0, 161, 20):
        corners = [end(swing.q[k], a, x)[0] for a, x, _, _ in PINS]
        axes.plot(*zip(*corners), color=TIME(k / 160), lw=1.6)
    axes.plot([0, 1], [0, 0], "o", color=INK, ms=6)
    axes.set_aspect("equal")
    axes.set(xlim=(-1.1, 2.1), ylim=(-1.2, 0.3), xlabel="x (m)", ylabel="y (m)")


def draw_losses(axes, swing):
    from pictures import BLUE, QUIET, RED, subtitle

    axes.set_title("What friction takes")
    subtitle(axes, "energy lost, and the work of μ r |N|")
    energy, work = lost(swing, 0.3)
    t = swing.t
    axes.plot(t, energy, color=BLUE, lw=2.4, label="energy lost")
    axes.plot(t, work, color=RED, lw=1.1, ls=(0, (4, 3)), label="work of friction")
    rests = t[np.abs(swing.v).max(axis=1) > 0][-1]
    axes.axvline(rests, color=QUIET, lw=0.9)
    axes.set(xlabel="time (s)", ylabel="energy (J)")
    axes.legend(frameon=False, loc="center right", bbox_to_anchor=(0.9, 0.5))


def draw(axes, data):
    swing, critical = data
    draw_drawer(axes[0], critical)
    draw_linkage(axes[1], swing)
    draw_losses(axes[2], swing)


if __name__ == "__main__":
    run("pins", __doc__, report, draw, 3, (14, 4.4))
