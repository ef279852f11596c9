"""Simulates scenes whose motion is known in closed form, and compares.

    python simulate.py [--output FOLDER] [--no-picture]

A brick on a ramp, Painlevé's rod, a bouncing ball, balls and hoops that begin to roll, a stack of
boxes. Every quantity is printed beside its closed form, with the error and the bound that follows
from the step size; the exit status is 1 if one is beyond its bound. FOLDER (default build/run)
receives simulate.png and simulate.svg (needs Matplotlib).
"""

import argparse
import math
import sys

import numpy as np

import perp

G = 9.81


class Table:
    """Computed beside exact values, aligned; counts what is beyond its bound."""

    compared = 0
    beyond = 0

    def __init__(self, title, step):
        self.title = f"{title}; step {step:g} s"
        self.rows = []

    def add(self, quantity, computed, exact, bound):
        """A bound of 0 asks for the same bits."""
        error = abs(computed - exact)
        good = error <= bound
        Table.compared += 1
        Table.beyond += not good
        self.rows.append((quantity, computed, exact, error, bound, "" if good else "BEYOND"))

    def print(self):
        print(self.title)
        print(f"  {'':44} {'computed':>14} {'exact':>14} {'error':>8} {'bound':>8}")
        for quantity, computed, exact, error, bound, verdict in self.rows:
            numbers = f"{computed:14.9f} {exact:14.9f} {error:8.1e} {bound:8.1e} {verdict}"
            print(f"  {quantity:44} {numbers}".rstrip())
        print()


# --- a brick on a ramp --------------------------------------------------------------------------

SLOPE = math.radians(10.0)
DOWNHILL = np.array([math.cos(SLOPE), -math.sin(SLOPE)])
UPRIGHT = np.array([math.sin(SLOPE), math.cos(SLOPE)])


def brick_on_ramp(mu, speed):
    """The ramp falls towards +x; a brick of 1 kg lies on it and slides."""
    world = perp.World(planar=True)
    world.ground.add_plane(UPRIGHT, 0.0, friction=mu)
    brick = world.add_body(
        mass=1.0,
        inertia=(0.4**2 + 0.2**2) / 12,
        position=0.1 * UPRIGHT,
        angle=-SLOPE,
        velocity=speed * DOWNHILL,
    )
    brick.add_box((0.2, 0.1), friction=mu)
    return world, brick


def slide(mu, speed, seconds, h, force=None):
    """Speed and distance along the slope at every step, and whether every velocity is 0.0."""
    world, brick = brick_on_ramp(mu, speed)
    start = brick.position
    speeds, distances, at_rest = [speed], [0.0], [False]
    for k in range(round(seconds / h)):
        if force:
            brick.force = force((k + 1) * h) * DOWNHILL
        world.step(h)
        velocity = brick.velocity
        speeds.append(velocity @ DOWNHILL)
        distances.append((brick.position - start) @ DOWNHILL)
        at_rest.append(not velocity.any() and brick.angular_velocity == 0.0)
    return np.array(speeds), np.array(distances), np.array(at_rest), world


def stop_of(at_rest, h):
    """When the brick came to the rest that lasts to the end; infinite if it does not."""
    moving = np.flatnonzero(~at_rest)
    return math.inf if moving[-1] == len(at_rest) - 1 else (moving[-1] + 1) * h


def ramp():
    h = 1e-3
    pull = G * math.sin(SLOPE)  # per kg, downhill
    hold = 0.3 * G * math.cos(SLOPE)
    table = Table("Brick of 1 kg on a ramp of 10 degrees, mu = 0.3, 2 m/s downhill", h)

    speeds, distances, at_rest, world = slide(0.3, 2.0, 3.0, h)
    stop = 2.0 / (hold - pull)
    table.add("no force: stops after (s)", stop_of(at_rest, h), stop, h)
    # trapezia of the speed, exact but for the step in which it stops: its triangle is left
    table.add("  slides (m)", distances[-1], 2.0 * stop / 2, (hold - pull) * h**2 / 8 + 1e-11)
    stepped = h * (1.0 + sum(max(0.0, 2.0 - k * h * (hold - pull)) for k in range(1, 3000)))
    table.add("  the same, closed form of the steps", distances[-1], stepped, 1e-11)
    table.add("  speed at 3 s (m/s)", speeds[-1], 0.0, 0.0)
    friction = sum(contact.impulse[1] * contact.tangents[0] for contact in world.contacts) / h
    table.add("  friction at rest (N, downhill)", friction @ DOWNHILL, -pull, 1e-9)
    picture = (np.arange(len(speeds)) * h, speeds, stop)

    speeds, distances, at_rest, _ = slide(0.3, 2.0, 11.0, h, lambda t: 1.0)
    stop = 2.0 / (hold - pull - 1.0)
    table.add("pushed by 1 N: stops after (s)", stop_of(at_rest, h), stop, h)
    table.add("  slides (m)", distances[-1], 2.0 * stop / 2, (hold - pull) * h**2 / 8)
    speeds, _, _, _ = slide(0.3, 2.0, 1.0, h, lambda t: 3.0)
    table.add("pushed by 3 N: speed at 1 s (m/s)", speeds[-1], 2.0 + pull + 3.0 - hold, 1e-11)

    speeds, distances, at_rest, _ = slide(0.3, -2.0, 1.0, h)
    stop = 2.0 / (hold + pull)
    table.add("2 m/s uphill: stops after (s)", stop_of(at_rest, h), stop, h)
    table.add("  slides (m)", -distances[-1], 2.0 * stop / 2, (hold + pull) * h**2 / 8)
    table.add("  speed at 1 s (m/s)", speeds[-1], 0.0, 0.0)
    speeds, _, _, _ = slide(0.1, -2.0, 1.0, h)
    stop = 2.0 / (hold / 3 + pull)
    turned = np.flatnonzero(speeds >= 0)[0] * h
    table.add("mu = 0.1, uphill: turns after (s)", turned, stop, h)
    table.add("  speed at 1 s (m/s)", speeds[-1], (pull - hold / 3) * (1.0 - stop), 2 * h * hold)

    speeds, distances, _, _ = slide(0.3, 0.0, 3.0, h, lambda t: t)
    away = hold - pull
    table.add("force of t N, from rest: slips at (s)", np.flatnonzero(speeds)[0] * h, away, h)
    table.add("  speed at 3 s (m/s)", speeds[-1], (3.0 - away) ** 2 / 2, 3.0 * h)
    table.add("  slides in 3 s (m)", distances[-1], (3.0 - away) ** 3 / 6, 3.0 * 3.0 * h)
    # slips from 2 sin 2t = away until the speed is 0 again: theory of the stick-slip creep
    _, distances, _, _ = slide(0.3, 0.0, 2 * math.pi + h, h, lambda t: 2.0 * math.sin(2.0 * t))
    cycle = round(math.pi / h)
    creep = distances[2 * cycle] - distances[cycle]
    table.add("force of 2 sin 2t N: creeps in a cycle (m)", creep, 0.39959713267656855, 2 * h)
    table.print()
    return picture


# --- Painlevé's rod -----------------------------------------------------------------------------


def painleve():
    """A slender rod slides on its tip with mu = 2, slope 2 and no rotation: no acceleration
    satisfies Coulomb's law, but an impulse does: the tip sticks ('impact without collision')."""
    angle, mu = math.atan(2.0), 2.0
    c, s = math.cos(angle), math.sin(angle)
    # impulses that stop the tip: W (N, F) = -(u_n, u_t), for m = l = 1 and inertia 1/3
    W = np.array([[1 + 3 * c * c, -3 * s * c], [-3 * s * c, 1 + 3 * s * s]])

    def after(velocity):
        u = np.array([velocity[1] - velocity[2] * c, velocity[0] + velocity[2] * s])
        N, F = np.linalg.solve(W, -u)
        return velocity + np.array([F, N, 3 * (F * s - N * c)])

    limit = after(np.array([-1.0, 0.0, 0.0]))
    for h in (1e-2, 1e-4, 1e-6):
        world = perp.World(planar=True)
        world.ground.add_plane((0, 1), 0.0, friction=mu)
        rod = world.add_body(mass=1, inertia=1 / 3, position=(c, s), angle=angle, velocity=(-1, 0))
        rod.add_sphere(0.0, offset=(-1, 0), friction=mu)
        world.step(h)
        got = (*rod.velocity, rod.angular_velocity)
        step = after(np.array([-1.0, -G * h, 0.0]))
        table = Table("Painlevé's rod, tip sliding at -1 m/s: one step", h)
        for name, x, y, z in zip(("v_x (m/s)", "v_y (m/s)", "omega (rad/s)"), got, step, limit):
            table.add(f"{name}, closed form of the step", x, y, 1e-9)
            table.add(f"{name}, impulse at h = 0", x, z, 3.5 * h + 1e-9)
        table.add("slip of the tip (m/s)", np.abs(world.contacts[0].velocity).max(), 0.0, 0.0)
        table.print()


def falling_rod(h, seconds=1.0):
    """A rod with rounded ends is thrown at the ground, in the manner of Stewart & Trinkle (1996).
    The first impact is a Painlevé configuration: sliding on would need a negative normal force."""
    world = perp.World(planar=True)
    world.ground.add_plane((0, 1), 0.0, friction=0.6)
    rod = world.add_body(
        mass=1, inertia=0.002, position=(0, 1), angle=math.pi / 6, angular_velocity=4.0
    )
    for end in (-0.25, 0.25):
        rod.add_sphere(0.05, offset=(end, 0), friction=0.6)
    states, hit, after = [(0.0, 0.0, 1.0, math.pi / 6)], None, None
    for k in range(round(seconds / h)):
        world.step(h)
        states.append(((k + 1) * h, *rod.position, rod.orientation))
        if hit is not None and after is None:
            after = (*rod.velocity, rod.angular_velocity)
        if hit is None and any(contact.impulse[0] > 0 for contact in world.contacts):
            hit = k + 1  # the tip arrives at the end of this step, and the next one stops it
    return np.array(states), (hit, after), rod


def thrown_rod():
    for h in (2.5e-3, 1.5625e-4):
        states, (step, velocity), rod = falling_rod(h)
        table = Table("Rod with rounded ends, turning at 4 rad/s, falls from 1 m, mu = 0.6", h)
        table.add("first impact at (s)", step * h, 0.385817751713149, h)
        # velocities: the impulse that stops the tip, at the exact time and angle of the impact;
        # x: limit of an independent implementation of the same step, extrapolated from h / 64
        exact = (-1.39009611781697, -0.612948533911025, 5.15108789940500)
        # the step that meets the ground is up to h early: gravity and rotation have that to change
        for name, x, y in zip(("v_x (m/s)", "v_y (m/s)", "omega (rad/s)"), velocity, exact):
            table.add(f"  {name} after it", x, y, 40 * h)
        table.add("x at 1 s (m), limit for small steps", rod.position[0], -0.22735, 2 * h)
        table.add("angle at 1 s (rad): flat", rod.orientation, math.pi, 1e-6)
        table.add("speed at 1 s (m/s)", np.abs(rod.velocity).max(), 0.0, 0.0)
        table.print()
    return falling_rod(2.5e-3)[:2]


# --- a ball that bounces, wheels that begin to roll, boxes in a stack ----------------------------


def bouncing_ball():
    """Impacts take place inside of the steps, where they are: in between the ball is on its parabola
    at the end of every step. A step has 32 impacts at most; what is left of them then waits for the
    next, and an approach of less than g h / 64 is rest."""
    h, height = 1e-2, 1.0
    for e in (0.5, 0.8, 0.9):
        world = perp.World(planar=True)
        world.ground.add_plane((0, 1), 0.0)
        ball = world.add_body(position=(0, height + 0.1))
        ball.add_sphere(0.1, restitution=e)
        first = math.sqrt(2 * height / G)
        rest = first * (1 + e) / (1 - e)
        impacts = [first * (1 + 2 * sum(e**k for k in range(1, n))) for n in range(1, 7)]
        moving, off = 0, [0.0] * 6
        for k in range(round((rest + 1.0) / h)):
            world.step(h)
            if ball.velocity[1] != 0.0:
                moving = k + 1
            flight = sum((k + 1) * h > t for t in impacts)
            if 0 < flight < 6:
                t, speed = (k + 1) * h - impacts[flight - 1], G * first * e**flight
                parabola = speed * t - G * t**2 / 2
                off[flight] = max(off[flight], abs(ball.position[1] - 0.1 - parabola))
        table = Table(f"Ball dropped from 1 m, e = {e}: impacts that heap up, then rest", h)
        for flight in (1, 3, 5):
            table.add(f"off the parabola after impact {flight} (m)", off[flight], 0.0, 1e-11)
        table.add("at rest after (s)", (moving + 1) * h, rest, 4 * h)
        table.add("speed at the end (m/s)", np.abs(ball.velocity).max(), 0.0, 0.0)
        table.add("height at the end (m)", ball.position[1] - 0.1, 0.0, 1e-11)
        table.print()


def rolling():
    h, mu, radius = 1e-3, 0.2, 0.1
    table = Table("Sliding at 7 m/s, mu = 0.2, then rolling", h)
    for name, kappa, speed, spin in (
        ("ball", 2 / 5, 7.0, 0.0),
        ("disc", 1 / 2, 7.0, 0.0),
        ("hoop", 1.0, 7.0, 0.0),
        ("ball with backspin of 20 m/s", 2 / 5, 7.0, -20.0),
    ):
        world = perp.World(planar=True)
        world.ground.add_plane((0, 1), 0.0, friction=mu)
        wheel = world.add_body(
            mass=1.0,
            inertia=kappa * radius**2,
            position=(0, radius),
            velocity=(speed, 0),
            angular_velocity=-spin / radius,
        )
        wheel.add_sphere(radius, friction=mu)
        rolls, where = None, None
        for k in range(round(5.0 / h)):
            world.step(h)
            if rolls is None and world.contacts[0].mode == "stick":
                rolls, where = (k + 1) * h, wheel.position[0]
        final = (speed + kappa * spin) / (1 + kappa)
        time = (speed - final) / (mu * G)
        table.add(f"{name}: rolls at (m/s)", wheel.velocity[0], final, 1e-11)
        table.add("  rolls after (s)", rolls, time, h)
        table.add("  by then at (m)", where, (speed + final) / 2 * time, speed * h)
        table.add("  slip of the contact (m/s)", world.contacts[0].velocity[1], 0.0, 0.0)
    table.print()


def stack(boxes=10):
    h = 1e-2
    world = perp.World()
    world.ground.add_plane((0, 0, 1), 0.0, friction=0.5)
    bodies = []
    for k in range(boxes):
        body = world.add_body(mass=1.0, inertia=(5 / 12, 5 / 12, 2 / 3), position=(0, 0, 0.5 + k))
        body.add_box((1.0, 1.0, 0.5), friction=0.5)
        bodies.append(body)
    world.run(1.0, h)
    table = Table(f"Stack of {boxes} boxes of 1 kg and 2 x 2 x 1 m, after 100 steps", h)
    speeds = [np.abs([*body.velocity, *body.angular_velocity]).max() for body in bodies]
    table.add("largest velocity of a box", max(speeds), 0.0, 0.0)
    table.add("top of the stack (m)", bodies[-1].position[2] + 0.5, float(boxes), 1e-9)
    forces = np.zeros(boxes)  # on each box from below
    points = []
    for contact in world.contacts:
        upper = contact.body_b if contact.normal[2] > 0 else contact.body_a
        forces[bodies.index(upper)] += contact.impulse[0] / h
        points.append((contact.position, contact.impulse[0] / h))
    weight = boxes * G
    table.add("normal force of the ground (N)", forces[0], weight, 1e-12 * weight)
    table.add("  under the top box (N)", forces[-1], G, 1e-12 * weight)
    table.print()
    return points, forces


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--output", default="build/run", help="folder of the picture")
    parser.add_argument("--no-picture", action="store_true")
    options = parser.parse_args()

    brick = ramp()
    painleve()
    rod = thrown_rod()
    bouncing_ball()
    rolling()
    boxes = stack()
    if not options.no_picture:
        from simulate_picture import draw

        for path in draw(options.output, brick, rod, boxes):
            print(f"wrote {path}")
    print(f"{Table.compared} quantities compared, {Table.beyond} beyond their bounds")
    return 1 if Table.beyond else 0


if __name__ == "__main__":
    sys.exit(main())
