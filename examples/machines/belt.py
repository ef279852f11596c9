"""A mass on a spring and a moving belt: stick-slip, with Coulomb's law and two coefficients, and
with LuGre's bristles beside it. (See docs/machines.md.)

    python examples/machines/belt.py [--output FOLDER | --no-picture]

m = 1, k = 100, belt 0.2 m/s; friction holds up to 5 N, and slides with 3 N. The mass sticks for 2
(5 - 3) / (k V) = 0.2 s and slips for (2/w)(pi - atan((5 - 3) w / (k V))) s, w = sqrt(k/m). While it
sticks its velocity is the belt's, 0.2 exactly.
"""

import math

import numpy as np
from common import G, run

import perp

K, BELT, HOLD, SLIDE = 100.0, 0.2, 5.0, 3.0
STICK = 2 * (HOLD - SLIDE) / (K * BELT)
SPEEDS = (1e-2, 2.5e-3, 6.25e-4)
SLIP = 2 / 10 * (math.pi - math.atan((HOLD - SLIDE) * 10 / (K * BELT)))


def coulomb(h, t_end=3.0, stribeck=None):
    """q: along the belt, and above it."""
    mass = perp.Mechanism(
        2,
        force=lambda t, q, v: [-K * q[0], -G],
        contacts=lambda q: ([q[1]], [[0, 1]], [[1, 0]], [[0, -BELT]]),
        mu=SLIDE / G, mu_static=HOLD / G, stribeck=stribeck,
    )
    answer = mass.simulate([0, 0], [BELT, 0], t_end, h)
    assert answer.ok
    return answer


def bristles(h, stiffness, speed, t_end=2.6):
    """LuGre: an implicit midpoint rule for the mass, exact steps for the bristles."""
    friction = perp.LuGre(stiffness=stiffness, damping=0.2 * stiffness**0.5, kinetic=SLIDE,
                          breakaway=HOLD, speed=speed)
    x, v, states = 0.0, BELT, []
    for step in range(round(t_end / h)):
        states.append([step * h, x, v])
        mean = v  # over the step
        for _ in range(30):
            bend, force, slope = friction.trial(mean - BELT, h)
            rest = 2 * (mean - v) + h * (K * (x + h / 2 * mean) + force)
            if abs(rest) < 1e-13:
                break
            mean -= rest / (2 + h * h * K / 2 + h * slope)
        x, v, friction.z = x + h * mean, 2 * mean - v, bend
    return np.array(states)


def period(t, x):
    """The mean time between passes of x upwards through the middle, but for the first."""
    up = np.flatnonzero((x[:-1] < SLIDE / K) & (x[1:] >= SLIDE / K))[1:]
    times = t[up] + (SLIDE / K - x[up]) / (x[up + 1] - x[up]) * (t[up + 1] - t[up])
    return float(np.diff(times).mean())


def report():
    print(f"closed form: sticks {STICK:.6f} s, slips {SLIP:.6f} s, period {STICK + SLIP:.6f} s")
    runs = {}
    for h in (2e-3, 1e-3, 5e-4):
        runs[h] = answer = coulomb(h)
        T = period(answer.t, answer.q[:, 0])
        print(f"Coulomb, steps of {h:7.2e} s: period {T:.6f}, error {abs(T - STICK - SLIP):.1e}")
    answer = runs[5e-4]
    stuck = answer.modes[:, 0] == "stick"
    print(f"while it sticks its velocity is {sorted(set(answer.v[stuck, 0].tolist()))}")
    late = answer.t > 1
    low, high = answer.q[late, 0].min(), answer.q[late, 0].max()
    print(f"it moves between {low:.5f} and {high:.5f} m "
          f"(closed form {0.03 - 0.02 * 2**0.5:.5f} and {0.03 + 0.02 * 2**0.5:.5f})")
    soft = coulomb(1e-3, stribeck=5e-3)
    print(f"Coulomb with Stribeck's curve, speed 0.005: period {period(soft.t, soft.q[:, 0]):.4f}")
    curves, periods = {}, []
    for speed in SPEEDS:
        curves[speed] = states = bristles(4e-4, stiffness=100 / speed**2, speed=speed)
        periods.append(period(states[:, 0], states[:, 1]))
        print(f"LuGre, stiffness {100 / speed**2:.2g}, speed {speed:g}: period {periods[-1]:.4f}")
    return answer, curves, periods


def draw(axes, data):
    from pictures import BLUE, INK, RED, subtitle

    answer, curves, periods = data
    axes[0].set_title("Stick-slip")
    subtitle(axes[0], "place of the mass; thick where it sticks")
    shown = answer.t <= 2
    axes[0].plot(answer.t[shown], 1e3 * answer.q[shown, 0], color=BLUE, lw=1.4)
    stuck = np.where(answer.modes[:, 0] == "stick", answer.q[:, 0], np.nan)
    axes[0].plot(answer.t[shown], 1e3 * stuck[shown], color=BLUE, lw=4, alpha=0.5)
    axes[0].set(xlabel="time (s)", ylabel="place (mm)", xlim=(0, 2))

    axes[1].set_title("The cycle")
    subtitle(axes[1], "Coulomb with two coefficients (blue)")
    late = answer.t > 1
    for speed, colour in zip(SPEEDS, ("#e3bfae", "#d58a70", RED)):
        states = curves[speed]
        cycle = states[:, 0] > 1.6
        axes[1].plot(1e3 * states[cycle, 1], states[cycle, 2], color=colour, lw=1.3,
                     label=f"LuGre, $v_s$ = {speed:g}")
    axes[1].plot(1e3 * answer.q[late, 0], answer.v[late, 0], color=BLUE, lw=1.8)
    axes[1].text(30, 0.215, "sticks: 0.2 exactly", color=BLUE, ha="center", fontsize=9.5)
    axes[1].legend(frameon=False, loc="center")
    axes[1].set(xlabel="place (mm)", ylabel="speed (m/s)", ylim=(-0.31, 0.24))

    axes[2].set_title("LuGre in the limit")
    subtitle(axes[2], "period less Coulomb's; stiffness $100 / v_s^2$")
    errors = np.abs(np.array(periods) - STICK - SLIP)
    axes[2].loglog(SPEEDS, errors, "o-", color=RED, ms=5, lw=1.4)
    law = errors[-1] * np.sqrt(np.array(SPEEDS) / SPEEDS[-1])
    axes[2].loglog(SPEEDS, law, color=INK, lw=1, ls=(0, (4, 3)))
    axes[2].text(SPEEDS[1], 0.8 * law[1], "$v_s^{1/2}$", color=INK, va="top")
    axes[2].set(xlabel="Stribeck's speed $v_s$ (m/s)", ylabel="error of the period (s)")


if __name__ == "__main__":
    run("belt", __doc__, report, draw, 3, (14, 4.2))
