"""A lead screw whose friction takes more inertia than there is: two accelerations for one torque,
none for another, which of them is real, and the jam. (Dupont 1993; see docs/friction.md.)

    python examples/lead_screw.py [--output FOLDER | --no-picture]

A nut of mass m under a weight W rides on a screw of radius r and lead angle 5 degrees,
x = r tan(lead) th:

    J th'' = T - r (N sin + F cos),  m x'' = N cos - F sin - W,  F = mu |N| sgn th'

With the axial load L = m x'' + W and k± = tan(lead ± phi), phi = atan(mu), this is Dupont's form
A th'' + b + mu' |C th'' + d| sgn th' = T with C th'' + d = L and mu' = r (k+ - k-) / 2.
"""

import argparse
import math

import numpy as np

import perp

J, M, R, W, LEAD = 2e-5, 50.0, 0.01, 100.0, math.radians(5)
PITCH = R * math.tan(LEAD)


def rigid(mu):
    """A, b, C, d and mu' of the rigid screw."""
    up, down = math.tan(LEAD + math.atan(mu)), math.tan(LEAD - math.atan(mu))
    mean, half = R * (up + down) / 2, R * (up - down) / 2
    return J + M * PITCH * mean, W * mean, M * PITCH, W, half


def compliant(mu, torque, stiffness, damping):
    """The same with a thread that gives: coordinates th and x, penetration r th sin - x cos."""
    s, c = math.sin(LEAD), math.cos(LEAD)
    return perp.Compliant(
        np.diag([J, M]), [[R * s, -c]], [[R * c, s]], mu, stiffness, damping, [torque, -W]
    )


def start(load, stiffness):
    """x0 and v0 at th' = 10 rad/s with this normal force in the thread."""
    return [0, -load / stiffness / math.cos(LEAD)], [10, 10 * PITCH]


def normal_force(mu, solution):
    """Of the thread, from the axial load and the friction that goes with its sign."""
    axial = solution.normal_force[0]
    return axial / (math.cos(LEAD) - math.copysign(mu, axial) * math.sin(LEAD))


def critical_friction():
    """The largest mu for which every torque has exactly one acceleration, by bisection."""
    low, high = 0.01, 0.5
    for _ in range(60):
        mu = (low + high) / 2
        unique = perp.load_friction(*rigid(mu), 1.0, 0.0).unique_for_all_tau
        low, high = (mu, high) if unique else (low, mu)
    return low


def holding_torques(mu):
    """The torques between which the screw stays at rest."""
    def rests(torque):
        return any(s.kind == "static" for s in perp.load_friction(*rigid(mu), 0.0, torque))

    limits = []
    for outside in (-1.0, 1.0):
        inside = rigid(mu)[1]  # no friction needed
        for _ in range(60):
            middle = (inside + outside) / 2
            inside, outside = (middle, outside) if rests(middle) else (inside, middle)
        limits.append(inside)
    return limits


def jam_times(mu, torque, stiffnesses):
    """From th' = 10 rad/s to rest; the thread starts with a force that grows like sqrt(stiffness),
    that is, with the same energy."""
    times = []
    for k in stiffnesses:
        run = compliant(mu, torque, k, 0.0).run(*start(-math.sqrt(k / 1e8), k), 0.05)
        assert run.end == "stopped"
        times.append(run.t)
    return np.array(times)


def drive(mu, torques, span, stiffness=1e9, damping=1e5):
    """One torque after the other, each for this time, from th' = 10 rad/s on: the runs."""
    runs, (x, v) = [], start(1.0, stiffness)
    for torque in torques:
        run = compliant(mu, torque, stiffness, damping).run(x, v, span, through=True, samples=400)
        runs.append(run)
        x, v = run.x, run.v
    return runs


def report(mu=0.2):
    print(f"critical friction {critical_friction():.12f}")
    lower, raise_ = holding_torques(mu)
    print(f"stays at rest from {lower:.12f} to {raise_:.12f} N m")
    for torque in (0.0, -0.1):
        found = perp.load_friction(*rigid(mu), 1.0, torque)
        print(f"T = {torque:g}: {len(found)} accelerations" + (":" if found.solutions else ""))
        for s in found:
            thread, verdict = normal_force(mu, s), "stable" if s.stable else "unstable"
            print(f"    {s.acceleration[0]:.6f} rad/s2, N = {thread:.6f} N, {verdict}")

    step = perp.load_friction_step(*rigid(mu), 10.0, -0.1, 1e-4)
    print(f"a step at T = -0.1: velocity {step.velocity[0]}", "(jam)" if step.jam else "")

    divide = normal_force(mu, perp.load_friction(*rigid(mu), 1.0, 0.0)[0])
    runs = []
    for factor in (0.999, 1.001):
        run = compliant(mu, 0.0, 1e9, 1e4).run(*start(divide * factor, 1e9), 0.02, samples=2000)
        print(f"compliant, N(0) = {factor} of the unstable one: stops after {1e3 * run.t:.6f} ms "
              f"with N = {run.normal_force[0]:.3f} N")
        runs.append(run)

    driven = list(zip((-0.5, 0.0, 0.4), drive(mu, (-0.5, 0.0, 0.4), 0.02)))
    for torque, run in driven:
        rigid_ones = perp.load_friction(*rigid(mu), float(np.sign(torque)), torque)
        print(f"then T = {torque:g} for 20 ms: {run.stops} stops, {run.starts} starts, "
              f"th' = {run.v[0]:.6f} rad/s, {run.modes[0]}, N = {run.normal_force[0]:.4f} N",
              *(f"(rigid: {s.acceleration[0]:.3f} rad/s2)" for s in rigid_ones if s.stable))

    stiffnesses = 10.0 ** np.arange(8, 17)
    times = jam_times(mu, -0.1, stiffnesses)
    rates = np.diff(np.log10(times))
    print("jams at T = -0.1 in", ", ".join(f"{1e3 * t:.4g}" for t in times), "ms")
    print(f"rate of the jam time: stiffness^{rates[-1]:.4f}")
    return divide, runs, driven, stiffnesses, times


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--output", default=".", help="folder for lead_screw.png and .svg")
    parser.add_argument("--no-picture", action="store_true")
    arguments = parser.parse_args()
    data = report()
    if not arguments.no_picture:
        from lead_screw_picture import draw

        for path in draw(arguments.output, rigid(0.2), *data):
            print("wrote", path)


if __name__ == "__main__":
    main()
