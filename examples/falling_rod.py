"""A falling rod with friction: its first impact is one that no acceleration could go through, and a
step in time goes through it all the same. (Stewart & Trinkle 1996; see docs/mechanism.md.)

    python examples/falling_rod.py [--output FOLDER | --no-picture]

A rod of 0.5 m between the centres of its caps, which have radius 0.05 m, falls turning onto a floor
with friction 0.6. Where it lies after a second is computed with shorter and shorter steps. Their
error is at most proportional to h, but jumps with where in a step the impacts fall, so that
extrapolation gains a digit and not two; steps that end at the impacts gain more.
"""

import argparse
import math

import numpy as np

import perp

G, HALF, CAP, INERTIA, MU = 9.81, 0.25, 0.05, 0.002, 0.6
START, SPEED = [0, 1, np.radians(30)], [0, 0, 4]  # x, y, angle


def contacts(q):
    """The caps' gaps above the floor, and how they and the feet's slips change with q."""
    along, up = HALF * math.cos(q[2]), HALF * math.sin(q[2])  # to a cap's centre
    gap = [q[1] - up - CAP, q[1] + up - CAP]
    return gap, [[0, 1, -along], [0, 1, along]], [[1, 0, up + CAP], [1, 0, CAP - up]]


def rod():
    return perp.Mechanism(3, mass=[1, 1, INERTIA], force=[0, -G, 0], contacts=contacts, mu=MU)


def first_impact():
    """When a cap meets the floor, and q then: free fall, by bisection."""
    low, high = 0.0, 0.4
    for _ in range(60):
        t = (low + high) / 2
        q = np.add(START, [0, -G * t * t / 2, 4 * t])
        low, high = (t, high) if min(contacts(q)[0]) > 0 else (low, t)
    return t, q


def report():
    t, q = first_impact()
    before = [0, -G * t, 4]
    print(f"first impact after {t:.9f} s, at {np.degrees(q[2]):.6f} degrees")
    hit = rod().step(t, q, before, 1e-9)
    foot = int(np.argmax(hit.impulse[::2]))
    normal, friction = hit.impulse[2 * foot : 2 * foot + 2]
    print(f"velocity after it: {hit.v[0]:.6f} {hit.v[1]:.6f} {hit.v[2]:.6f}: {hit.modes[foot]}, "
          f"friction / normal impulse = {friction / normal:.6f}")

    runs, steps = [], 0.0025 / 4.0 ** np.arange(4)
    for h in steps:
        runs.append(rod().simulate(START, SPEED, 1.0, h))
        assert runs[-1].ok
    ends = np.array([run.q[-1, 0] for run in runs])
    print("       h        x(1)   order")
    for k, (h, x) in enumerate(zip(steps, ends)):
        order = ""
        if k > 1:
            before, after = ends[k - 1] - ends[k - 2], x - ends[k - 1]
            order = f"{np.log(before / after) / np.log(4):8.3f}"
        print(f"{h:8.2e} {x:11.7f}{order}")
    print(f"by extrapolation: {(4 * ends[-1] - ends[-2]) / 3:.5f}")
    chosen = rod().simulate(START, SPEED, 1.0, 1e-3, scheme="theta", error=1e-8)
    limit = chosen.q[-1, 0]
    print(f"in {chosen.stats.steps} steps of a chosen length: {limit:.6f}")

    others = np.geomspace(3e-3, 3e-4, 20)  # impacts fall elsewhere in a step; at rest after 0.6 s
    errors = [abs(rod().simulate(START, SPEED, 0.6, h).q[-1, 0] - limit) for h in others]
    print(f"with {len(others)} other steps the error is at most {max(errors / others):.2f} h")
    print("at the end:", *(f"{x:.6f}" for x in runs[-1].q[-1]), "velocity", *runs[-1].v[-1])
    return runs[1], steps, np.abs(ends - limit), others, errors, limit


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--output", default=".", help="folder for falling_rod.png and .svg")
    parser.add_argument("--no-picture", action="store_true")
    arguments = parser.parse_args()
    data = report()
    if not arguments.no_picture:
        from falling_rod_picture import draw

        for path in draw(arguments.output, *data):
            print("wrote", path)


if __name__ == "__main__":
    main()
