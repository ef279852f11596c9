"""A planar biped without motors that walks down a slope: the compass gait of Goswami, Espiau and
Keramane (1996); see docs/machines.md.

    python examples/machines/biped.py [--output FOLDER | --no-picture]

Two straight legs, each with a mass, and one at the hip; the feet are points that touch the ground
with friction. Nothing says that the foot that stands stays where it is, or that the one behind
leaves when the one ahead lands: contacts do all that. Straight legs can't pass each other above
the ground: the foot that swings is drawn in until it is ahead, by a gap larger than its height.

Beside it, the textbook's walker: the standing foot is a pin, landing keeps the angular momenta
about the new foot and, of the leg behind, about the hip. Its gait that repeats itself is found by
Newton's method on one step.
"""

import math

import numpy as np
from common import G, at, run

import perp

HIP, LEG, LENGTH, BELOW, ABOVE = 10.0, 5.0, 1.0, 0.5, 0.5  # the leg's mass lies BELOW the hip
SLOPE, MU, TOTAL = math.radians(3), 0.6, 20.0
UNFOLD = 0.05  # rad that the swinging leg is ahead


## The walker with contacts: q = (hip along and off the slope, angles of both legs from its normal)


class Walker:
    def __init__(self, swing):
        self.swing, self.folded = swing, True
        self.machine = perp.Mechanism(
            4, mass=mass, force=force, contacts=self.contacts, mu=MU, check=False
        )

    def contacts(self, q):
        c, s = LENGTH * np.cos(q[2:]), LENGTH * np.sin(q[2:])
        gap = q[1] - c
        gap[self.swing] += self.folded * LENGTH
        return gap, [[0, 1, s[0], 0], [0, 1, 0, s[1]]], [[1, 0, -c[0], 0], [1, 0, 0, -c[1]]]

    def watch(self, step):
        stand = 1 - self.swing
        if self.folded:
            self.folded = step.q[2 + stand] - step.q[2 + self.swing] < UNFOLD
        elif step.impulse[2 * self.swing] > 0:
            self.swing, self.folded = stand, True


def mass(q):
    c, s = LEG * BELOW * np.cos(q[2:]), LEG * BELOW * np.sin(q[2:])
    M = np.diag([TOTAL, TOTAL, LEG * BELOW**2, LEG * BELOW**2])
    M[0, 2:] = M[2:, 0] = -c
    M[1, 2:] = M[2:, 1] = s
    return M


def force(t, q, v):
    s, c = LEG * BELOW * np.sin(q[2:]), LEG * BELOW * np.cos(q[2:])
    along, off = TOTAL * G * math.sin(SLOPE), -TOTAL * G * math.cos(SLOPE)
    turning = -LEG * BELOW * G * np.sin(q[2:] + SLOPE)
    return [along - s @ v[2:] ** 2, off - c @ v[2:] ** 2, *turning]


def walk(state, seconds):
    """From just after a landing; state as of the textbook's walker."""
    stand, swing = state[:2]
    q = [LENGTH * math.sin(stand), LENGTH * math.cos(stand), stand, swing]
    v = [LENGTH * math.cos(stand) * state[2], -LENGTH * math.sin(stand) * state[2], *state[2:]]
    walker = Walker(1)
    answer = walker.machine.simulate(
        q, v, seconds, 1e-3, scheme="theta", error=1e-6, longest=1e-2, callback=walker.watch
    )
    assert answer.ok
    return answer


## The textbook's: state = (angles of the leg that stands and of the one that swings, their rates)


def rate(state):
    stand, swing, w, u = state
    turn = LEG * LENGTH * BELOW * math.sin(stand - swing)
    cross = -LEG * LENGTH * BELOW * math.cos(stand - swing)
    inertia = HIP * LENGTH**2 + LEG * (ABOVE**2 + LENGTH**2)
    M = [[inertia, cross], [cross, LEG * BELOW**2]]
    pull = (HIP * LENGTH + LEG * (ABOVE + LENGTH)) * G * math.sin(stand + SLOPE)
    load = [pull + turn * u**2, -LEG * BELOW * G * math.sin(swing + SLOPE) - turn * w**2]
    return np.array([w, u, *np.linalg.solve(M, load)])


def runge_kutta(state, h):
    a = rate(state)
    b = rate(state + h / 2 * a)
    c = rate(state + h / 2 * b)
    return state + h / 6 * (a + 2 * b + 2 * c + rate(state + h * c))


def landing(state):
    """After it; the leg that swung stands."""
    (stand, swing, w, u), e = state, lambda a: np.array([math.sin(a), math.cos(a)])
    d = lambda a: np.array([math.cos(a), -math.sin(a)])  # noqa: E731

    def momenta(old, new, hip):
        """Of a leg behind that turns by `old`, one ahead by `new`, while the hip moves so."""
        back, front = hip - BELOW * old * d(stand), hip - BELOW * new * d(swing)
        arms = LENGTH * e(swing), LENGTH * e(swing) - BELOW * e(stand), ABOVE * e(swing)
        momentum = HIP * hip, LEG * back, LEG * front
        cross = [a[0] * p[1] - a[1] * p[0] for a, p in zip(arms, momentum)]
        arm = -BELOW * e(stand)
        return np.array([sum(cross), LEG * (arm[0] * back[1] - arm[1] * back[0])])

    before = momenta(w, u, LENGTH * w * d(stand))
    behind = momenta(1, 0, 0 * d(swing))
    ahead = momenta(0, 1, LENGTH * d(swing))
    old, new = np.linalg.solve(np.column_stack([behind, ahead]), before)
    return np.array([swing, stand, new, old])


def stride(state, h=1e-3):
    """The state after the next landing, and when that is."""
    t = 0.0
    while True:
        after = runge_kutta(state, h)
        if after[0] > UNFOLD and after[0] + after[1] > 0 and state[0] - state[1] > UNFOLD:
            break
        state, t = after, t + h
    low, high = 0.0, h
    for _ in range(50):
        middle = (low + high) / 2
        low, high = (low, middle) if sum(runge_kutta(state, middle)[:2]) > 0 else (middle, high)
    return landing(runge_kutta(state, high)), t + high


def gait(guess):
    """The state after a landing that the next one brings again, and the period: Newton's method
    in (angle, rates), as both feet are on the ground."""
    full = lambda x: np.array([x[0], -x[0], x[1], x[2]])  # noqa: E731
    x = np.array(guess)
    for _ in range(12):
        wrong = lambda x: stride(full(x))[0][[0, 2, 3]] - x  # noqa: E731
        F = wrong(x)
        J = np.column_stack([(wrong(x + d) - F) / 1e-6 for d in 1e-6 * np.eye(3)])
        x = x - np.linalg.solve(J, F)
    return full(x), stride(full(x))[1]


def stances(answer):
    """For each foot, the steps in the midst of a stance: neither of landing nor of leaving."""
    stands = answer.impulse[:, ::2] > 0
    inner = stands.copy()
    inner[1:-1] &= stands[:-2] & stands[2:] & ~stands[1:-1, ::-1]
    return inner


def landings(answer):
    """When a foot lands."""
    stands = answer.impulse[:, ::2] > 0
    first = ~stands[1:-1] & stands[2:]
    return answer.t[2:][first.any(axis=1)]


def energy(q, v):
    """Of all of a run's states, and beside the ground under the walk's begin."""
    height = TOTAL * (math.cos(SLOPE) * q[:, 1] - math.sin(SLOPE) * q[:, 0])
    height -= LEG * BELOW * np.cos(q[:, 2:] + SLOPE).sum(axis=1)
    return np.array([w @ mass(x) @ w for x, w in zip(q, v)]) / 2 + G * height


def report():
    start, period = gait([-0.27, 1.1, 0.4])
    print("the textbook's gait", *(f"{x:.6f}" for x in start), f"after {period:.6f} s")
    answer = walk(start, 10.05 * period)
    times = landings(answer)
    print(f"with contacts: {len(times)} steps, period {(times[-1] - times[0]) / 9:.6f} s")
    inner = stances(answer)
    share = np.abs(answer.impulse[:, 1::2]) / np.where(inner, answer.impulse[:, ::2], np.inf)
    print(f"standing feet: speed at most {np.abs(answer.velocity[:, 1::2][inner]).max():.1e} m/s,"
          f" friction at most {share.max():.3f} of the normal force (mu = {MU})")
    E = energy(answer.q, answer.v)
    parts = np.searchsorted(answer.t, times)
    drift = max(np.ptp(E[a + 4 : b - 1]) for a, b in zip(parts, parts[1:]))
    fall = TOTAL * G * math.sin(SLOPE) * 2 * LENGTH * math.sin(start[1])
    print(f"energy between landings changes by {drift:.1e} J; a landing costs"
          f" {(E[parts[0] + 4] - E[parts[-1] + 4]) / 9:.4f} J, the slope gives {fall:.4f} J")
    return answer, start, period


def draw(axes, data):
    from pictures import BLUE, GROUND, INK, QUIET, RED, subtitle

    answer, start, period = data
    c, s = math.cos(SLOPE), math.sin(SLOPE)
    turn = lambda x, y: (c * x + s * y, c * y - s * x)  # noqa: E731
    where = axes[0]
    where.fill_between([-0.5, 2.8], [0.5 * s / c, -2.8 * s / c], -0.3, color=GROUND, linewidth=0)
    for x, y, *legs in at(np.arange(0, 4 * period, 0.12), answer.t, answer.q):
        for angle, color in zip(legs, (BLUE, RED)):
            foot = x - LENGTH * math.sin(angle), y - LENGTH * math.cos(angle)
            where.plot(*zip(turn(x, y), turn(*foot)), color=color, linewidth=1.1)
        where.plot(*turn(x, y), "o", color=INK, markersize=3)
    where.set(xlim=(-0.5, 2.8), ylim=(-0.3, 1.15), xlabel="x (m)", ylabel="y (m)",
              title="Down 3 degrees")
    subtitle(where, "four steps, every 120 ms")

    path = [start]
    while len(path) * 1e-2 < period:
        path.append(runge_kutta(path[-1], 1e-2))
    path = np.array(path)
    phase = axes[1]
    t = np.linspace(0, 10 * period, 2000)
    q, v = (at(t, answer.t, part) for part in (answer.q, answer.v))
    for leg, color in enumerate((BLUE, RED)):
        phase.plot(q[:, 2 + leg], v[:, 2 + leg], color=color, linewidth=1)
    phase.plot(path[::4, :2], path[::4, 2:], "o", color=INK, markersize=2.5)
    phase.set(xlim=(-0.4, 0.35), ylim=(-2.5, 2.5), xlabel="angle of a leg (rad)",
              ylabel="its rate (rad/s)", title="Both legs, ten steps")
    subtitle(phase, "dots: the textbook's walker")

    force = axes[2]
    inner = stances(answer)
    with np.errstate(invalid="ignore", divide="ignore"):
        share = np.where(inner, np.abs(answer.impulse[:, 1::2]) / answer.impulse[:, ::2], np.nan)
    t = np.linspace(0, 4 * period, 801)
    for part, color in zip(at(t, answer.t, share).T, (BLUE, RED)):
        force.plot(t, part, color=color, linewidth=1)
    force.set(xlim=(0, 4 * period), ylim=(0, 0.4), xlabel="t (s)", ylabel="friction / normal force",
              title="What the feet need")
    subtitle(force, "standing feet have velocity 0")


if __name__ == "__main__":
    run("biped", __doc__, report, draw, 3, (13, 3.6))
