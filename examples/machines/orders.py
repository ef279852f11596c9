"""How the error of each scheme falls with the length of its steps. (See docs/mechanism.md.)

    python examples/machines/orders.py [--output FOLDER | --no-picture]

A pendulum on its constraint, a brick that stops on a ramp, the falling rod: places at the end
against closed forms (for the rod: the limit that falling_rod.py finds).
"""

import math

import numpy as np
from common import G, run

import perp

SCHEMES = ("frozen", "implicit", "theta")


def pendulum():
    """x^2 + y^2 = 1, released at the height of its hinge: elliptic functions, 16 digits."""
    mechanism = perp.Mechanism(
        2, force=[0, -G], bilateral=lambda q: ([(q @ q - 1) / 2], [q]), bilateral_count=1
    )
    return mechanism, [1, 0], [0, 0], 1.0, [-0.986291751131875319, -0.165010853125541169]


def brick():
    """R1 of ramp.py: slides downhill from 2 m/s and stops after v0^2 / (2 a) metres."""
    slope = math.radians(10)
    pull, hold = G * math.sin(slope), 0.3 * G * math.cos(slope)
    mechanism = perp.Mechanism(1, force=[pull], tresca=(hold, [[1.0]]))
    return mechanism, [0], [2], 2.0, [2 / (hold - pull)]


def rod():
    """Of falling_rod.py; after impacts and slips it lies flat at x = -0.22735998."""

    def contacts(q):
        along, up = 0.25 * math.cos(q[2]), 0.25 * math.sin(q[2])
        gap = [q[1] - up - 0.05, q[1] + up - 0.05]
        return gap, [[0, 1, -along], [0, 1, along]], [[1, 0, up + 0.05], [1, 0, 0.05 - up]]

    mechanism = perp.Mechanism(3, mass=[1, 1, 0.002], force=[0, -G, 0], contacts=contacts, mu=0.6)
    start = [0, 1, math.radians(30)]
    return mechanism, start, [0, 0, 4], 0.6, [-0.2273599827]


MACHINES = {"pendulum": (pendulum, 50, 5), "brick": (brick, 50, 5), "rod": (rod, 120, 5)}


def report():
    errors = {}
    shares = "  ".join(f"{f'h/{2**k}':>8}" for k in range(5))
    print("machine   scheme         " + shares + "   order")
    for name, (make, coarsest, halvings) in MACHINES.items():
        mechanism, q0, v0, end, exact = make()
        steps = end / (coarsest * 2.0 ** np.arange(halvings))
        for scheme in SCHEMES:
            found = []
            for h in steps:
                answer = mechanism.simulate(q0, v0, end, h, scheme=scheme)
                assert answer.ok
                found.append(np.abs(answer.q[-1, : len(exact)] - exact).max())
            order = np.polyfit(np.log(steps), np.log(found), 1)[0]
            errors[name, scheme] = steps, np.array(found), order
            print(f"{name:9} {scheme:9} {steps[0]:5.3f} " + "  ".join(f"{e:8.1e}" for e in found)
                  + f"   {order:5.2f}")
    return errors


def draw(axes, errors):
    from pictures import BLUE, INK, QUIET, RED, subtitle

    texts = {
        "pendulum": ("Pendulum on its constraint", "place after 1 s"),
        "brick": ("Brick that stops on a ramp", "place after 2 s, at rest"),
        "rod": ("Falling rod", "place at rest; impacts, sliding, sticking"),
    }
    for panel, (name, (title, text)) in zip(axes, texts.items()):
        panel.set_title(title)
        subtitle(panel, text)
        for scheme, colour, mark in zip(SCHEMES, (BLUE, INK, RED), ("o-", "s--", "^-")):
            steps, found, order = errors[name, scheme]
            panel.loglog(steps, found, mark, color=colour, ms=5, lw=1.4,
                         label=f"{scheme}: {order:.1f}")
        steps = errors[name, "frozen"][0]
        for order, scheme in ((1, "frozen"), (2, "theta")):
            if name != "rod" or order == 1:
                base = errors[name, scheme][1][-1] * 0.6
                panel.loglog(steps, base * (steps / steps[-1]) ** order, color=QUIET, lw=1,
                             ls=(0, (4, 3)))
        panel.set_xticks(steps, [f"{h:.2g}" for h in steps])
        panel.minorticks_off()
        panel.legend(frameon=False, title="order", loc="lower right")
        panel.set(xlabel="step (s)", ylabel="error (m)")


if __name__ == "__main__":
    run("mechanism_orders", __doc__, report, draw, 3, (14, 4.4))
