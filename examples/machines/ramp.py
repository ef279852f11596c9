"""A brick on a ramp: seven motions with Coulomb's law, beside their closed forms. (Stewart &
Trinkle's first example; see docs/machines.md.)

    python examples/machines/ramp.py [--output FOLDER | --no-picture]

m v' is in m g sin th + F(t) - mu m g cos th Sgn v, with Sgn 0 = [-1, 1]: m = 1, th = 10 degrees.
Where the brick sticks its velocity is 0.0, not nearly so.
"""

import math

import numpy as np
from common import G, run

import perp

SIN, COS, H = math.sin(math.radians(10)), math.cos(math.radians(10)), 1e-3


def brick(pull=lambda t: 0.0, mu=0.3):
    """q: along the slope, and away from it."""
    return perp.Mechanism(
        2,
        force=lambda t, q, v: [G * SIN + pull(t), -G * COS],
        contacts=lambda q: ([q[1]], [[0, 1]], [[1, 0]]),
        mu=mu,
    )


def simulate(v0, t_end, **how):
    answer = brick(**how).simulate([0, 0], [v0, 0], t_end, H)
    assert answer.ok
    return answer


def stop(answer):
    """The first time after which v is 0.0 in every step, and the place there."""
    k = len(answer.t) - int(np.argmax(answer.v[::-1, 0] != 0)) if answer.v[-1, 0] == 0 else None
    assert k is not None and (answer.v[k:, 0] == 0.0).all()
    return answer.t[k], answer.q[k, 0]


def at(answer, t):
    return answer.q[round(t / H), 0], answer.v[round(t / H), 0]


def line(problem, what, computed, closed):
    print(f"{problem}  {what:36} {computed:12.6f} {closed:12.6f} {abs(computed - closed):10.1e}")


def report():
    print(f"with steps of {H} s{'computed':>35} {'closed form':>12} {'difference':>10}")
    cap, runs = 0.3 * G * COS, {}

    runs["R1"] = simulate(2, 3)
    t, x = stop(runs["R1"])
    exact = 2 / (cap - G * SIN)
    line("R1", "stops for good after (s)", t, exact)
    line("R1", "and so many metres", x, exact)  # v0 / 2 is 1
    line("R1", "held there by (N)", runs["R1"].impulse[-1, 1] / H, -G * SIN)
    t, x = stop(simulate(2, 11, pull=lambda t: 1.0))
    line("R2", "pulled by 1 N: stops after (s)", t, 2 / (cap - G * SIN - 1))
    line("R3", "pulled by 3 N: v after 1 s (m/s)", at(simulate(2, 1, pull=lambda t: 3.0), 1)[1],
         2 + 3 + G * SIN - cap)
    runs["R4"] = simulate(-2, 3)
    line("R4", "uphill: stops after (s)", stop(runs["R4"])[0], 2 / (G * SIN + cap))
    runs["R5"] = simulate(-2, 3, mu=0.1)
    turn = 2 / (G * SIN + cap / 3)
    line("R5", "mu = 0.1: turns after (s)", runs["R5"].t[np.argmax(runs["R5"].v[:, 0] >= 0)], turn)
    line("R5", "v after 1 s (m/s)", at(runs["R5"], 1)[1], (G * SIN - cap / 3) * (1 - turn))
    runs["R6"] = simulate(0, 3, pull=lambda t: t)
    away = cap - G * SIN
    first = runs["R6"].t[np.argmax(runs["R6"].v[:, 0] > 0)]
    line("R6", "pulled by t: breaks away after (s)", first, away)
    line("R6", "x after 3 s (m)", at(runs["R6"], 3)[0], (3 - away) ** 3 / 6)
    runs["R7"] = simulate(0, 2 * math.pi, pull=lambda t: 2 * math.sin(2 * t))
    cycles = [runs["R7"].q[np.searchsorted(runs["R7"].t, k * math.pi), 0] for k in (1, 2)]
    line("R7", "pulled by 2 sin 2t: creep a cycle (m)", cycles[1] - cycles[0], 0.39959713267656855)
    for name, v in (("R1", runs["R1"].v), ("R4", runs["R4"].v)):
        print(f"{name}: velocity at the end {v[-1, 0]}, {v[-1, 1]}")
    return runs


def draw(axes, runs):
    from pictures import BLUE, INK, QUIET, RED, subtitle
    from simulate_picture import explicit_sign

    left, middle, right = axes
    left.set_title("Stops, and a turn")
    subtitle(left, "10° slope; μ = 0.3, and 0.1 where it turns")
    for name, colour, text, place in (
        ("R1", BLUE, "downhill", (0.75, 1.25)),
        ("R4", INK, "uphill", (-0.02, -1.0)),
        ("R5", RED, "uphill, μ = 0.1", (1.1, -0.55)),
    ):
        left.plot(runs[name].t, runs[name].v[:, 0], color=colour, lw=2)
        left.text(*place, text, color=colour, ha="right" if name == "R4" else "left")
        if name != "R5":
            t = stop(runs[name])[0]
            left.plot(t, 0, "o", color=colour, ms=6, zorder=4)
    left.axhline(0, color=QUIET, lw=0.8)
    left.set(xlabel="time (s)", ylabel="speed (m/s)", xlim=(-0.45, 3))

    middle.set_title("Breaking away, and creep")
    subtitle(middle, "pulled by t, and by 2 sin 2t; sticking drawn thick")
    for name, colour, place in (("R6", RED, (2.1, 1.05)), ("R7", BLUE, (4.15, 0.57))):
        t, v = runs[name].t, runs[name].v[:, 0]
        middle.plot(t, v, color=colour, lw=1.8)
        held = np.where(v == 0.0, 0.0, np.nan)
        middle.plot(t, held + (0.012 if name == "R6" else -0.012), color=colour, lw=4, alpha=0.55)
        middle.text(*place, {"R6": "t", "R7": "2 sin 2t"}[name], color=colour, ha="center")
    middle.set(xlabel="time (s)", ylabel="speed (m/s)", ylim=(-0.06, 1.2))

    right.set_title("Why not simply sign(v)?")
    subtitle(right, "the end of the first stop, steps of 1 ms")
    t, _ = stop(runs["R1"])
    chatter = explicit_sign(H, t, G * SIN, 0.3 * G * COS)
    right.plot(1e3 * (chatter[0] - t), 1e3 * chatter[1], color=RED, lw=1.2)
    near = np.abs(runs["R1"].t - t) < 0.025
    right.plot(1e3 * (runs["R1"].t[near] - t), 1e3 * runs["R1"].v[near, 0], color=BLUE, lw=2.4)
    right.text(19.5, 5.4, "explicit steps with sign(v)", color=RED, ha="right")
    right.text(19.5, -1.0, "perp: 0.0", color=BLUE, ha="right")
    right.set(xlabel="time since the stop (ms)", ylabel="speed (mm/s)", xlim=(-4, 20),
              ylim=(-3.5, 6.5))


if __name__ == "__main__":
    run("ramp", __doc__, report, draw, 3, (14, 4.4))
