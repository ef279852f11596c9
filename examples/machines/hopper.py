"""A hopper on one leg: on the spot, where its gait has a closed form, and forwards.
(After Raibert's; see docs/machines.md.)

    python examples/machines/hopper.py [--output FOLDER | --no-picture]

A body and a foot, with a leg between them that has a stop: a spring presses it out to that length.
Once the spring is at its shortest, a thruster helps it. The foot lands without bounce and the leg
runs into its stop without bounce: what these cost, and all else of a hop on the spot, is

    landing      the foot's m v^2 / 2; the body keeps v
    shortest s   M v^2 / 2 = (P - M g) s + k s^2 / 2
    at the stop  M w^2 / 2 = M v^2 / 2 + F s
    take-off     v' = w M / (M + m), apex v'^2 / (2 g)

Forwards a hip swings the leg in flight, to where half the stance's way lies before the body, and
keeps the body upright in stance.
"""

import math

import numpy as np
from common import G, at, bisect, run

import perp

BODY, FOOT, INERTIA = 10.0, 1.0, 2.0
LENGTH, SPRING, PRELOAD, THRUST = 0.5, 2000.0, 150.0, 50.0
MU, SPEED = 0.8, 0.8
GRIP = 0.2  # what of the leg's force the hip may use in stance


class Hopper:
    """q: the body's x, y, pitch, and the foot's x, y."""

    def __init__(self, speed):
        self.speed, self.stands, self.thrust = speed, False, False
        self.machine = perp.Mechanism(
            5, mass=[BODY, BODY, INERTIA, FOOT, FOOT], force=self.force, contacts=contacts,
            mu=[MU, 0], dim=[2, 1],
        )

    def force(self, t, q, v):
        along, across, length = leg(q)
        push = PRELOAD + SPRING * (LENGTH - length) + THRUST * self.thrust
        torque = self.hip(q, v, across, length)
        on_body = push * along - torque / length * across
        weights = [0, -BODY * G, 0, 0, -FOOT * G]
        return np.add(weights, [*on_body, -torque, *-on_body])

    def hip(self, q, v, across, length):
        """The torque that turns the leg forwards, and the body back."""
        if self.speed == 0:
            return 0.0
        if self.stands:
            most = GRIP * (PRELOAD + SPRING * (LENGTH - length)) * length
            return max(-most, min(most, 100 * q[2] + 20 * v[2]))
        ahead = v[0] * 0.08 + 0.04 * (v[0] - self.speed)  # half a stance's way, and a correction
        goal = math.asin(min(max(ahead / LENGTH, -0.5), 0.5))
        angle, rate = math.asin((q[3] - q[0]) / length), across @ (v[3:] - v[:2]) / length
        return 60 * (goal - angle) - 6 * rate

    def watch(self, step):
        """Thrust from the leg's shortest until the foot leaves the ground."""
        self.stands = bool(step.impulse[0] > 0)
        longer = step.velocity[2] < 0  # the gap to the stop closes
        self.thrust = self.stands and (self.thrust or longer)

    def hop(self, height, seconds, speed=0.0, error=1e-7):
        start = [0, LENGTH + height, 0, 0, height]
        answer = self.machine.simulate(
            start, [speed, 0, 0, speed, 0], seconds, 1e-3, scheme="theta", error=error,
            longest=5e-3, callback=self.watch,
        )
        assert answer.ok
        return answer


def leg(q):
    """The leg's direction towards the body, that to the front, and its length."""
    x, y = q[0] - q[3], q[1] - q[4]
    length = math.hypot(x, y)
    return np.array([x, y]) / length, np.array([y, -x]) / length, length


def contacts(q):
    """The foot on the ground, with friction, and the leg at its stop."""
    (x, y), _, length = leg(q)
    return [q[4], LENGTH - length], [[0, 0, 0, 0, 1], [-x, -y, 0, x, y]], [[0, 0, 0, 1, 0]]


def shortest(v):
    free = PRELOAD - BODY * G
    return (math.sqrt(free**2 + SPRING * BODY * v**2) - free) / SPRING


def next_speed(v):
    """Of take-off and the next landing."""
    return math.sqrt(v**2 + 2 * THRUST * shortest(v) / BODY) * BODY / (BODY + FOOT)


def stance(v):
    """How long the foot stands after a landing with v."""
    w = math.sqrt(SPRING / BODY)
    down, up = ((PRELOAD + extra - BODY * G) / SPRING for extra in (0, THRUST))
    return (math.atan2(v / w, down) + math.acos(up / (shortest(v) + up))) / w


def hops(height, count):
    """Landing and apex of so many hops that begin with a fall from `height`."""
    v = math.sqrt(2 * G * height)
    t = v / G
    for _ in range(count):
        landing = t
        t, v = t + stance(v), next_speed(v)
        yield landing, t + v / G, v**2 / (2 * G)
        t += 2 * v / G


def phases(answer):
    """Steps at which the foot has left the ground, and those at which it has landed."""
    stands = answer.impulse[:, 0] > 0
    change = np.diff(stands.astype(int))
    return np.nonzero(change < 0)[0] + 1, np.nonzero(change > 0)[0] + 1


def report():
    formula = list(hops(0.3, 12))
    spot = Hopper(0).hop(0.3, formula[-1][1])
    _, landed = phases(spot)
    print(f"on the spot, after 12 hops: apex {spot.q[-1, 4]:.4f} m, by the closed form"
          f" {formula[-1][2]:.4f}; last landing {spot.t[landed[-1]]:.4f} s, {formula[-1][0]:.4f}")
    v = bisect(lambda v: next_speed(v) < v, 0.1, 10)
    print(f"period of the gait {2 * v / G + stance(v):.6f} s, apex {v * v / (2 * G):.6f} m,"
          f" reached again: {repeated(v)}")
    print(f"sideways {np.abs(spot.q[:, 0]).max()}, foot in stance {standing(spot)}")

    forwards = Hopper(SPEED).hop(0.2, 8.0, SPEED, 1e-5)
    left, landed = phases(forwards)
    flight = slice(left[-3], landed[np.searchsorted(landed, left[-3])])
    print(f"forwards: {len(landed)} hops, {last_speed(forwards, landed):.3f} m/s,"
          f" foot in stance {standing(forwards)}")
    centre, rate = ((BODY * part[flight, :2] + FOOT * part[flight, 3:]) / (BODY + FOOT)
                    for part in (forwards.q, forwards.v))
    rise = rate[0, 1] ** 2 / (2 * G)
    print(f"in a flight the centre rises by {np.ptp(centre[:, 1][:centre[:, 1].argmax() + 1]):.5f}"
          f" m, by v^2/(2 g) {rise:.5f}; its speed along changes by {np.ptp(rate[:, 0]):.1e} m/s")
    print(f"spin changes by {np.ptp(spin(forwards.q[flight], forwards.v[flight])):.1e} kg m2/s")
    share = ratio(forwards)
    print(f"friction at most {np.nanmax(share):.3f} of the normal force (mu = {MU})")
    return spot, formula, forwards, share


def repeated(v):
    """Period and apex of a hop that begins with what repeats itself."""
    period = 2 * v / G + stance(v)
    answer = Hopper(0).hop(v * v / (2 * G), 5 * period)
    _, landed = phases(answer)
    return f"{(answer.t[landed[4]] - answer.t[landed[0]]) / 4:.4f} s, {answer.q[-1, 4]:.4f} m"


def stance_of(answer):
    """Steps in the midst of a stance: neither the impact, nor the one that closes what it left of the
    gap, nor that of take-off."""
    stands = answer.impulse[:, 0] > 0
    inner = stands.copy()
    inner[2:-1] &= stands[:-3] & stands[1:-2] & stands[3:]
    return inner


def standing(answer):
    """The foot's largest speed."""
    return np.abs(answer.v[stance_of(answer), 3:]).max()


def last_speed(answer, landed):
    begin, end = landed[-5], landed[-1]
    return (answer.q[end, 0] - answer.q[begin, 0]) / (answer.t[end] - answer.t[begin])


def spin(q, v):
    """About the centre of mass."""
    arm, rate = q[:, :2] - q[:, 3:], v[:, :2] - v[:, 3:]
    reduced = BODY * FOOT / (BODY + FOOT)
    return INERTIA * v[:, 2] + reduced * (arm[:, 0] * rate[:, 1] - arm[:, 1] * rate[:, 0])


def ratio(answer):
    """Friction over the normal force."""
    inner, share = stance_of(answer), np.full(len(answer.t), np.nan)
    share[inner] = np.abs(answer.impulse[inner, 1]) / answer.impulse[inner, 0]
    return share


def draw(axes, data):
    import matplotlib.pyplot as plt
    from pictures import BLUE, GROUND, INK, QUIET, RED, subtitle

    spot, formula, forwards, share = data
    where = axes[0]
    t = np.linspace(0, 1.6, 400)
    q = at(5 + t, forwards.t, forwards.q)
    first = q[0, 0]
    where.axhspan(-0.06, 0, color=GROUND, linewidth=0)
    where.plot(q[:, 0] - first, q[:, 1], color=QUIET, linewidth=1)
    every = 5 + np.arange(0, 1.6, 0.05)
    for x, y, pitch, foot, height in at(every, forwards.t, forwards.q):
        x, foot = x - first, foot - first
        where.plot([x, foot], [y, height], color=BLUE, linewidth=1.4)
        c, s = 0.09 * math.cos(pitch), 0.09 * math.sin(pitch)
        where.plot([x - c, x + c], [y - s, y + s], color=INK, linewidth=3, solid_capstyle="round")
    where.set(xlim=(-0.15, 1.5), ylim=(-0.06, 0.95), xlabel="x (m)", ylabel="y (m)",
              title="Forwards")
    subtitle(where, "every 50 ms; the hip keeps the body upright")

    over = axes[1]
    times = np.linspace(0, 8, 1200)
    height = np.interp(times, spot.t, spot.q[:, 4])
    over.plot(times, height, color=BLUE, linewidth=1.1, label="foot")
    over.plot(*np.array(formula)[:, 1:].T, "o", color=RED, markersize=3, label="closed form")
    over.set(xlim=(0, 8), ylim=(0, 0.45), xlabel="t (s)", ylabel="height (m)",
             title="On the spot")
    over.legend(frameon=False, fontsize=8, loc="upper left", ncols=2)
    subtitle(over, "let go from 0.3 m")

    force = axes[2]
    force.plot(t, np.interp(5 + t, forwards.t, share), color=BLUE, linewidth=1.1)
    force.axhline(MU, color=RED, linewidth=0.9, linestyle="--")
    force.set(xlim=(0, 1.6), ylim=(0, 1), xlabel="t (s)", ylabel="friction / normal force",
              title="What the foot needs")
    subtitle(force, f"mu = {MU:g}: it sticks, with velocity 0.0")
    plt.setp(axes, axisbelow=True)


if __name__ == "__main__":
    run("hopper", __doc__, report, draw, 3, (13, 3.6))
