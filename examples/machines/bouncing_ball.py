"""A ball that bounces infinitely often in a finite time, and then lies still. (See
docs/machines.md.)

    python examples/machines/bouncing_ball.py [--output FOLDER | --no-picture]

Dropped from 1 m with restitution e it is at rest after sqrt(2/g) (1 + e)/(1 - e) seconds. Steps of
a given length can't show every bounce; what they must do is come to rest, exactly, and in time.
"""

import math

import numpy as np
from common import G, run

import perp


def ball(e):
    return perp.Mechanism(1, force=[-G], contacts=lambda q: (q, [[1.0]]), restitution=e)


def rest(e):
    return math.sqrt(2 / G) * (1 + e) / (1 - e)


def rest_of(answer):
    """When the velocity has become 0.0 for good."""
    last = len(answer.t) - 1 - int(np.argmax(answer.v[::-1, 0] != 0))
    assert answer.ok and answer.v[-1, 0] == 0.0 and answer.q[-1, 0] >= 0
    return answer.t[last + 1]


def report():
    print("   e    rest, closed form (s)    steps of 1 ms (s)   impacts seen   height at the end")
    runs = {}
    for e in (0.5, 0.8, 0.9):
        runs[e] = answer = ball(e).simulate([1], [0], 1.1 * rest(e), 1e-3)
        impacts = int(((answer.v[1:, 0] > 0) & (answer.v[:-1, 0] < 0)).sum())
        print(f"{e:4} {rest(e):20.6f} {rest_of(answer):20.3f} {impacts:14} {answer.q[-1, 0]:16}")
    steps = 0.01 / 2.0 ** np.arange(7)
    errors = [abs(rest_of(ball(0.5).simulate([1], [0], 1.5, h)) - rest(0.5)) for h in steps]
    print("e = 0.5, error of the time of rest:", ", ".join(f"{x:.1e}" for x in errors))
    order = np.polyfit(np.log(steps), np.log(errors), 1)[0]
    print(f"order {order:.1f}")
    return runs, steps, errors


def draw(axes, data):
    from pictures import BLUE, INK, QUIET, RED, subtitle

    SHADE = "#c9b48a"
    runs, steps, errors = data
    axes[0].set_title("Height")
    subtitle(axes[0], "dropped from 1 m; a dot where it is at rest by theory")
    for (e, answer), colour in zip(sorted(runs.items(), reverse=True), (SHADE, BLUE, RED)):
        axes[0].plot(answer.t, answer.q[:, 0], color=colour, lw=1.4, label=f"e = {e}")
        axes[0].plot(rest(e), 0, "o", color=colour, ms=6, clip_on=False, zorder=4)
    axes[0].legend(frameon=False, loc="upper right")
    axes[0].set(xlabel="time (s)", ylabel="height (m)", ylim=(0, 1.02), xlim=(0, 9.4))

    axes[1].set_title("The end of it, e = 0.5")
    subtitle(axes[1], "steps of 1 ms: slower approach than g h is rest")
    t, v = runs[0.5].t, runs[0.5].v[:, 0]
    near = (t > 1.2) & (t < 1.42)
    axes[1].plot(t[near], v[near], color=RED, lw=1.4)
    axes[1].axvline(rest(0.5), color=INK, lw=1, ls=(0, (4, 3)))
    axes[1].annotate("rest by theory", (rest(0.5), -0.55), (6, 0), textcoords="offset points",
                     color=INK, fontsize=9.5)
    axes[1].set(xlabel="time (s)", ylabel="speed (m/s)")

    axes[2].set_title("Time of rest")
    subtitle(axes[2], "error over the length of steps, e = 0.5")
    axes[2].loglog(steps, errors, "o-", color=BLUE, ms=5, lw=1.4)
    axes[2].loglog(steps, errors[-1] * steps / steps[-1], color=QUIET, lw=1, ls=(0, (4, 3)))
    axes[2].text(steps[2], 0.45 * errors[-1] * steps[2] / steps[-1], "order 1", color=QUIET)
    axes[2].set(xlabel="step (s)", ylabel="error (s)")


if __name__ == "__main__":
    run("bouncing_ball", __doc__, report, draw, 3, (14, 4.2))
