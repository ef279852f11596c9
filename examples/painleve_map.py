"""How many accelerations has a rod that slides on a floor? One, none, or two: over its angle and
its coefficient of friction. (Painlevé 1895; Génot & Brogliato 1999; see docs/mechanism.md.)

    python examples/painleve_map.py [--output FOLDER | --no-picture]

A thin rod of mass 1 and length 2 slides on its lower tip, to the left. Friction presses the tip
into the floor; beyond a critical coefficient more than the floor's own push lifts it.
"""

import argparse
import math

import numpy as np

import perp

G, HALF = 9.81, 1.0


def contacts(q):
    """The lower tip's gap above the floor, and how it and the tip's slip change with q."""
    s, c = math.sin(q[2]), math.cos(q[2])
    return q[1] - HALF * s, [0, 1, -HALF * c], [1, 0, HALF * s]


def curvature(t, q, v):
    """What the tip's acceleration is where that of q is 0."""
    s, c = math.sin(q[2]), math.cos(q[2])
    return [HALF * s * v[2] ** 2, HALF * c * v[2] ** 2]


def rod(mu):
    return perp.Mechanism(
        3, mass=[1, 1, 1 / 3], force=[0, -G, 0], contacts=contacts, curvature=curvature, mu=mu,
        contact_count=1, dim=2,
    )


def state(angle, spin):
    """q and v with the tip on the floor, sliding to the left at speed 1."""
    s, c = math.sin(angle), math.cos(angle)
    return [HALF * c, HALF * s, angle], [-1 - HALF * s * spin, HALF * c * spin, spin]


def accelerations(mu, angle, spin):
    return rod(mu).accelerations(0, *state(angle, spin))


def bisect(inside, low, high):
    """Where a property that `low` has ends."""
    for _ in range(50):
        middle = (low + high) / 2
        low, high = (middle, high) if inside(middle) else (low, middle)
    return low


def critical_friction(angle):
    """The largest mu with an acceleration for the rod that does not spin."""
    return bisect(lambda mu: len(accelerations(mu, angle, 0.0)) == 1, 0.5, 3.0)


def smallest(function, low, high):
    """The minimum of a function and its place, by golden sections."""
    ratio = (math.sqrt(5) - 1) / 2
    for _ in range(26):
        a, b = high - ratio * (high - low), low + ratio * (high - low)
        low, high = (low, b) if function(a) < function(b) else (a, high)
    return function(low), low


def report():
    mu, angle = smallest(critical_friction, math.radians(40), math.radians(80))
    print(f"critical friction {mu:.9f}, at {math.degrees(angle):.3f} degrees")
    steep = math.atan(2)
    ends = [
        math.degrees(bisect(lambda x: len(accelerations(2.0, x, 0.0)) == 0, steep, end))
        for end in (0.3, 1.5)
    ]
    print(f"mu = 2: no acceleration from {ends[0]:.9f} to {ends[1]:.9f} degrees")
    none = accelerations(2.0, steep, 0.0)
    print(f"at {math.degrees(steep):.3f} degrees: {len(none)} accelerations, for {none.reason}")
    step = rod(2.0).step(0, *state(steep, 0.0), 1e-6)
    print(f"a step of 1e-6 s: velocity {step.v[0]:.6f} {step.v[1]:.6f} {step.v[2]:.6f}, "
          f"tip: {step.modes[0]}")
    spin = bisect(lambda w: len(accelerations(2.0, steep, w)) == 0, 0.0, 10.0)
    print(f"two accelerations from {spin:.9f} rad/s on; at 4 rad/s:")
    for s in accelerations(2.0, steep, 4.0):
        print(f"    N = {s.force[0]:.9f}: {s.modes[0]}, {'stable' if s.stable else 'unstable'}")


def count_over(angles, frictions, spin):
    """The number of accelerations, a row for each coefficient of friction."""
    counts = np.empty((len(frictions), len(angles)), dtype=int)
    for i, mu in enumerate(frictions):
        slider = rod(mu)
        for j, angle in enumerate(angles):
            counts[i, j] = len(slider.accelerations(0, *state(angle, spin)))
    return counts


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--output", default=".", help="folder for painleve_map.png and .svg")
    parser.add_argument("--no-picture", action="store_true")
    arguments = parser.parse_args()
    report()
    if not arguments.no_picture:
        from painleve_map_picture import draw

        angles = np.radians(1.5 * (np.arange(60) + 0.5))
        frictions = (np.arange(50) + 0.5) * 0.06
        # the second spin is that at which the nodes of p = b = 0 change: cos^2 = 3/7 there
        spins = 0.0, math.sqrt(G / math.sqrt(4 / 7))
        maps = {spin: count_over(angles, frictions, spin) for spin in spins}
        for path in draw(arguments.output, angles, frictions, maps):
            print("wrote", path)


if __name__ == "__main__":
    main()
