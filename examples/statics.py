"""What can stand, and what makes it fall: an arch, a wall and a grasp. (docs/statics.md)

    python examples/statics.py [--output FOLDER | --no-picture]

Stones are polygons in the plane, 1 m deep; two stones meet in the two end points of their joint.
Nothing is stepped in time: each line is the answer to one question, whether contacts can carry the
forces, and what they can carry besides.
"""

import argparse

import numpy as np

import perp

WEIGHT = 20.0  # kN/m3


class Stones:
    """Polygons and where they touch: the rows of H, two for each contact, normal and tangent."""

    def __init__(self):
        self.corners, self.centres, self.weights, self.points = [], [], [], []
        self.contacts = []  # below, above (None: the ground), point, normal from below to above

    def add(self, corners):
        """Adds a polygon, its corners counterclockwise."""
        p = np.asarray(corners, dtype=float)
        q = np.roll(p, -1, axis=0)
        cross = p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0]
        self.corners.append(p)
        self.centres.append((p + q).T @ cross / (3 * cross.sum()))
        self.weights.append(WEIGHT * cross.sum() / 2)
        return len(self.corners) - 1

    def join(self, below, above, one, other):
        """A joint between two points, with `above` to the left of the way from one to the other."""
        one, other = np.asarray(one, dtype=float), np.asarray(other, dtype=float)
        x, y = (other - one) / np.linalg.norm(other - one)
        for point in one, other:
            self.contacts.append((below, above, point, np.array([-y, x])))

    def H(self):
        rows = np.zeros((2 * len(self.contacts), 3 * len(self.corners)))
        for k, (below, above, point, normal) in enumerate(self.contacts):
            for row, (x, y) in enumerate((normal, (normal[1], -normal[0]))):
                for stone, sign in ((below, -1.0), (above, 1.0)):
                    if stone is not None:
                        arm = point - self.centres[stone]
                        entries = x, y, arm[0] * y - arm[1] * x
                        rows[2 * k + row, 3 * stone : 3 * stone + 3] = sign * np.array(entries)
        return rows

    def load(self, stone, point, force):
        """A force at a point of a stone."""
        arm, load = np.asarray(point) - self.centres[stone], np.zeros(3 * len(self.corners))
        load[3 * stone : 3 * stone + 3] = *force, arm[0] * force[1] - arm[1] * force[0]
        return load

    def body_forces(self, x, y):
        """All weights, times x along the ground and times y upwards."""
        weights = np.array(self.weights)
        return np.column_stack([x * weights, y * weights, 0 * weights]).ravel()


def arch(stones, thickness, radius=1.0):
    """Half a circle; `radius` is that of its middle line."""
    made, angles = Stones(), np.linspace(np.pi, 0, stones + 1)
    rays = np.column_stack([np.cos(angles), np.sin(angles)])
    inner, outer = (radius - thickness / 2) * rays, (radius + thickness / 2) * rays
    for k in range(stones):
        made.add([inner[k], inner[k + 1], outer[k + 1], outer[k]])
    for k in range(stones + 1):
        below, above = k - 1 if k else None, k if k < stones else None
        made.join(below, above, outer[k], inner[k])
    return made


def wall(courses, bricks):
    """Courses of `bricks` bricks of 2 x 1, every other one shifted by half a brick."""
    made, before = Stones(), [(None, 0, 2 * bricks)]
    for course in range(courses):
        ends = sorted({0, 2 * bricks, *range(1 + (course + 1) % 2, 2 * bricks, 2)})
        here = []
        for left, right in zip(ends, ends[1:]):
            y = course
            brick = made.add([(left, y), (right, y), (right, y + 1), (left, y + 1)])
            for below, a, b in before:
                if max(a, left) < min(b, right):
                    made.join(below, brick, (max(a, left), y), (min(b, right), y))
            if here:
                made.join(here[-1][0], brick, (left, y + 1), (left, y))
            here.append((brick, left, right))
        before = here
    return made


def told(result):
    safety = "" if np.isnan(result.safety) else f", safety {result.safety:.6f}"
    return f"{result.verdict}, margin {result.margin:.3f}{safety}"


def proof(H, f, mu, v):
    """Checks a virtual velocity: how far H v is within the cones at worst, and the work of f."""
    u = (H @ v).reshape(-1, 2)
    return (u[:, 0] - mu * np.abs(u[:, 1])).min(), f @ v


def hinges(H, v):
    """Joints of an arch that open at one end and turn about the other: (joint, it is outside)."""
    u = (H @ v).reshape(-1, 2, 2)[:, :, 0]  # of each joint: outside, inside
    wide = 0.05 * u.max()
    return [(k, bool(outside < inside)) for k, (outside, inside) in enumerate(u)
            if max(outside, inside) > wide]


def least_thickness(stones, mu):
    low, high = 0.05, 0.2
    while high - low > 1e-8:
        middle = (low + high) / 2
        made = arch(stones, middle)
        falls = not perp.statics(made.H(), made.body_forces(0, -1), mu, dim=2)
        low, high = (middle, high) if falls else (low, middle)
    return high


def report_arch():
    stones, mu, made = 24, 0.7, arch(24, 0.15)
    H, weights = made.H(), made.body_forces(0, -1)
    whole = sum(made.weights)
    print(f"arch of {stones} stones, t/R = 0.15, mu = {mu}: weight {whole:.4f} kN")
    print("by itself:", told(perp.statics(H, weights, mu, dim=2)))

    for name, stone in (("crown", stones // 2), ("quarter point", stones // 4)):
        load = made.load(stone, made.corners[stone][3], (0, -1))  # 1 kN on the outer edge
        r = perp.statics(H, weights, mu, dim=2, load=load)
        share = r.safety / whole
        print(f"1 kN at the {name}: {told(r)}: it carries {share:.6f} of its weight there")
    most = r.safety
    stands = perp.statics(H, weights, mu, dim=2, load=0.999 * most * load)
    falls = perp.statics(H, weights, mu, dim=2, load=1.001 * most * load)
    print("0.999 of that:", told(stands))
    print("1.001 of that:", told(falls))
    inside, work = proof(H, weights + 1.001 * most * load, mu, falls.velocity)
    print(f"the virtual velocity: work {work:.2e}, least u_n - mu |u_t| {inside:.0e}")
    found = hinges(H, falls.velocity)
    for joint, outside in found:
        side = "outside" if outside else "inside"
        angle = 180 * joint / stones
        print(f"    the joint at {angle:.1f} degrees from the left opens, hinge on the {side}")

    for n in 24, 96:
        least = least_thickness(n, mu)
        print(f"least t/R with {n} stones: {least:.6f}")
    return made, stone, stands, falls, found, share


def report_wall():
    mu, courses, bricks = 0.7, 10, 3
    block = Stones()
    block.add([(0, 0), (2, 0), (2, 5), (0, 5)])
    block.join(None, 0, (0, 0), (2, 0))
    made = wall(courses, bricks)
    whole = Stones()
    whole.add([(0, 0), (2 * bricks, 0), (2 * bricks, courses), (0, courses)])
    whole.join(None, 0, (0, 0), (2 * bricks, 0))
    for name, stones in (("block of 2 x 5", block), ("block of 6 x 10", whole), ("wall", made)):
        H, weights, sideways = stones.H(), stones.body_forces(0, -1), stones.body_forces(1, 0)
        r = perp.statics(H, weights, mu, dim=2, load=sideways)
        print(f"{name}: falls by {r.safety:.6f} of its weight sideways")
    falls = perp.statics(H, weights, mu, dim=2, load=1.001 * r.safety * sideways)
    inside, work = proof(H, weights + 1.001 * r.safety * sideways, mu, falls.velocity)
    print(f"its virtual velocity: work {work:.2e}, least u_n - mu |u_t| {inside:.0e}")
    ways = np.abs(falls.velocity.reshape(-1, 3)).max(axis=1)
    moves = ways > 0.1 * ways.max()
    print(f"{moves.sum()} of {len(moves)} bricks fall, the others move by less than a tenth")
    return made, falls, moves, r.safety


def fingers(*given):
    """The rows of H of fingers that touch a body: (point, normal into the body) each."""
    rows = []
    for (px, py), (x, y) in given:
        rows += [(x, y, px * y - py * x), (y, -x, -px * x - py * y)]
    return np.array(rows)


def holds(H, mu, dim):
    """Asks with n + 1 loads, of which every load is a sum with factors >= 0; returns the first
    answer that is no, or None."""
    loads = [*np.eye(3), -np.ones(3)]
    answers = [perp.statics(H, load, mu, dim=dim) for load in loads]
    return next((answer for answer in answers if not answer), None)


def loose(answer):
    x, y, turn = answer.velocity + 0.0
    return f"comes loose by ({x:.3f}, {y:.3f}) and turns by {turn:.3f}"


def report_grasp():
    mu, push, weight = 0.5, 30.0, 9.81
    # a box of 2 x 1, and two fingers that slide along x and push with 30 N
    H = np.zeros((4, 5))
    H[:, :3] = fingers(((-1, 0), (1, 0)), ((1, 0), (-1, 0)))
    H[0, 3], H[2, 4] = -1, 1
    H[1, 3] = H[3, 4] = 0
    r = perp.statics(H, [0, 0, 0, push, -push], mu, dim=2, load=[0, -weight, 0, 0, 0])
    print(f"two fingers: {told(r)}; 2 mu N / (m g) = {2 * mu * push / weight:.6f}")

    for height in 0.0, 0.99, 1.01:  # two fixed fingers; the line between them rises by height / 2
        H = fingers(((-1, -height / 2), (1, 0)), ((1, height / 2), (-1, 0)))
        lost = holds(H, mu, 2)
        words = "force closure" if lost is None else loose(lost)
        print(f"fixed fingers, one {height} higher, mu = {mu}: {words}")

    four = ((-1, 0.3), (1, 0)), ((1, -0.3), (-1, 0)), ((-0.5, 0.5), (0, -1)), ((0.5, -0.5), (0, 1))
    for count in 3, 4:
        lost = holds(fingers(*four[:count])[::2], 0.0, 1)
        words = "form closure" if lost is None else loose(lost)
        print(f"{count} fingers without friction: {words}")


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--output", default=".", help="folder for statics.png and .svg")
    parser.add_argument("--no-picture", action="store_true")
    arguments = parser.parse_args()
    pictured = report_arch()
    pictured += report_wall()
    report_grasp()
    if not arguments.no_picture:
        from statics_picture import draw

        for path in draw(arguments.output, *pictured):
            print("wrote", path)


if __name__ == "__main__":
    main()
