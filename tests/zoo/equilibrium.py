"""Can it stand? An answer without perp's solvers.

An assembly at rest stands where impulses exist, within the friction cones, that balance all forces.
How far it is from the edge is the margin s of

    max s   subject to   J r = -f,   r_n - s w >= |r_t| / mu  for all contacts,   s <= 1

with w the weight of the lighter of the two bodies. Rows of J are in units of each body's load;
joints are rows without bounds; static and kinematic bodies carry anything. Clarabel solves it.

The contacts are those of the scene's own geometry (geometry.py). `from_world` gives those that a
world reports, which may have been taken where bodies would be after a step.

Both answers are checked without Clarabel: what stands by its impulses, what falls by a virtual
velocity v of the bodies that gains work although u = J'v is in the dual cones, u_n >= mu |u_t|.
"""

from __future__ import annotations

import math
from typing import Any, Iterator, NamedTuple

import numpy as np
import scipy.sparse as sp

from geometry import TOUCH, Contact, all_directions, middle_directions, touching
from scene import Scene

try:
    import clarabel
except ImportError:
    clarabel = None

MARGIN = 1e-6  # of a body's weight: nearer than this to the edge no verdict is given

class Verdict(NamedTuple):
    word: str  # "stands", "falls", "edge", or "unclear": flush neighbours might carry something
    margin: float  # -inf: no impulses of any sign balance the forces
    status: str  # Clarabel's
    error: float  # of the balance, or of the virtual velocity: beside the margin
    contacts: int


def from_world(scene: Scene, accuracy: str = "exact", step: float = 0.01) -> list[Contact]:
    """The contacts of the scene as the world reports them after its first step."""
    world, bodies = scene.build(accuracy)
    world.step(step)
    numbers = {body: k for k, body in enumerate(bodies)}
    reach = TOUCH * scene.length()
    found = []
    for contact in world.contacts:
        if contact.gap > reach:
            continue
        position, normal = contact.position, contact.normal
        if scene.planar:
            position, normal = ((v[0], 0.0, v[1]) for v in (position, normal))
        a, b = numbers[contact.body_a], numbers[contact.body_b]
        found.append(Contact(a, b, np.array(position), np.array(normal), contact.friction))
    world.close()
    return found


# --- the balance of impulses -------------------------------------------------------------------


class Balance:
    """J and f. A body has six rows, x, y, z and turns, in a planar scene three: x, z and the turn
    about y; each row in units of the body's load."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self.kept = [0, 2, 4] if scene.planar else list(range(6))
        self.bodies = {part: k for k, part in enumerate(scene.dynamic())}
        self.loads, self.forces = {}, []
        self.length = scene.length()
        for k in self.bodies:
            part = scene.parts[k]
            force = part.mass * np.array(scene.gravity) + part.force
            if scene.planar:
                force[1] = 0.0
            weight = part.mass * float(np.linalg.norm(scene.gravity))
            self.loads[k] = max(weight, float(np.linalg.norm(force)))
            self.forces.append(np.concatenate((force, np.zeros(3)))[self.kept] / self.loads[k])
        self.f = np.concatenate(self.forces)
        self.columns = 0
        self.entries: list[tuple[np.ndarray, int, np.ndarray]] = []  # rows, a column, numbers

    def weight(self, a: int, b: int) -> float:
        """Of the lighter one; what is fixed has none."""
        return min(self.loads[k] for k in (a, b) if k in self.loads)

    def add(self, a: int, b: int, columns: list[tuple[np.ndarray, np.ndarray]]) -> None:
        """Columns of forces on b (and the opposite on a) and their moments about the origin, in
        units of the lighter body's load."""
        unit = self.weight(a, b)
        for force, moment in columns:
            for body, sign in ((a, -1.0), (b, 1.0)):
                if body not in self.bodies:
                    continue
                arm = np.cross(self.scene.parts[body].position, force)
                wrench = np.concatenate((force, (moment - arm) / self.length))[self.kept]
                start = self.bodies[body] * len(self.kept)
                rows = np.arange(start, start + len(self.kept))
                scale = sign * unit / self.loads[body]
                self.entries.append((rows, self.columns, scale * wrench))
            self.columns += 1

    def add_contact(self, contact: Contact) -> int:
        """Returns the number of its columns: normal first, then tangents where it has friction."""
        directions = [contact.normal]
        if contact.friction > 0:
            directions += tangents(contact.normal, self.scene.planar)
        pairs = [(d, np.cross(contact.position, d)) for d in directions]
        self.add(contact.a, contact.b, pairs)
        return len(pairs)

    def add_joint(self, joint: Any) -> int:
        pairs = [pair for pair in joint_columns(joint) if self.matters(pair)]
        self.add(joint.a, joint.b, pairs)
        return len(pairs)

    def matrix(self) -> sp.csc_matrix:
        shape = (len(self.f), max(self.columns, 1))
        if not self.entries:
            return sp.csc_matrix(shape)
        rows, columns, numbers = zip(*self.entries)
        wide = [np.full(len(r), c) for r, c in zip(rows, columns)]
        data = np.concatenate(numbers), (np.concatenate(rows), np.concatenate(wide))
        return sp.csc_matrix(data, shape=shape)

    def matters(self, pair: tuple[np.ndarray, np.ndarray]) -> bool:
        return bool(np.concatenate(pair)[self.kept].any())


def tangents(normal: np.ndarray, planar: bool) -> list[np.ndarray]:
    if planar:
        return [np.array([normal[2], 0.0, -normal[0]])]
    first = np.cross(normal, np.eye(3)[int(np.argmin(np.abs(normal)))])
    first /= np.linalg.norm(first)
    return [first, np.cross(normal, first)]


def joint_columns(joint: Any) -> list[tuple[np.ndarray, np.ndarray]]:
    """Forces and moments about the origin that a joint can carry."""
    anchor, axes, none = np.array(joint.anchor), np.eye(3), np.zeros(3)
    if joint.kind == "distance":
        along = np.array(joint.anchor_b) - anchor
        along /= np.linalg.norm(along)
        return [(along, np.cross(anchor, along))]
    held = [(axis, np.cross(anchor, axis)) for axis in axes]
    if joint.kind == "fixed":
        return held + [(none, axis) for axis in axes]
    if joint.kind == "revolute":
        return held + [(none, axis) for axis in tangents(np.array(joint.axis), False)]
    assert joint.kind == "ball"
    return held


# --- Clarabel -----------------------------------------------------------------------------------


class Solution(NamedTuple):
    status: str
    r: np.ndarray
    s: np.ndarray
    v: np.ndarray  # multipliers of the balance: a virtual velocity


class Program:
    """The problem of the margin over some of a scene's contacts."""

    def __init__(self, scene: Scene, contacts: list[Contact]) -> None:
        balance = Balance(scene)
        self.contacts = contacts
        self.sizes = [balance.add_contact(contact) for contact in contacts]
        for joint in scene.joints:
            balance.add_joint(joint)
        self.J = balance.matrix()
        self.f = balance.f

    def solve(self, common: bool, cap: float, least: float = -math.inf) -> Solution:
        """max s, one for all contacts (common) or the sum of one for each; least <= s <= cap."""
        count = 1 if common else len(self.contacts)
        n, m = self.J.shape[1], self.J.shape[0]
        entries: list[tuple[int, int, float]] = []
        cones, row, first = [clarabel.ZeroConeT(m)], m, 0
        for k, (size, contact) in enumerate(zip(self.sizes, self.contacts)):
            scale = contact.friction if size > 1 else 1.0
            entries += [(row, first, -scale), (row, n + (0 if common else k), scale)]
            entries += [(row + i, first + i, -1.0) for i in range(1, size)]
            cones.append(
                clarabel.SecondOrderConeT(size) if size > 1 else clarabel.NonnegativeConeT(1)
            )
            row, first = row + size, first + size
        bounds = [(1.0, cap)] + ([(-1.0, -least)] if math.isfinite(least) else [])
        right = [-self.f, np.zeros(row - m)]
        for sign, bound in bounds:
            entries += [(row + k, n + k, sign) for k in range(count)]
            right.append(np.full(count, bound))
            row += count
        cones.append(clarabel.NonnegativeConeT(count * len(bounds)))
        rows, columns, values = zip(*entries)
        below = sp.csc_matrix((values, (rows, columns)), shape=(row, n + count))
        above = sp.hstack([self.J, sp.csc_matrix((m, count))]).tocsc()
        above.resize((row, n + count))
        cost = np.concatenate((np.zeros(n), -np.ones(count)))
        for tolerance in (1e-10, 1e-9, 1e-8):
            settings = clarabel.DefaultSettings()
            settings.verbose = False
            settings.tol_feas = settings.tol_gap_abs = settings.tol_gap_rel = tolerance
            zero = sp.csc_matrix((n + count, n + count))
            solver = clarabel.DefaultSolver(
                zero, cost, (above + below).tocsc(), np.concatenate(right), cones, settings
            )
            found = solver.solve()
            if str(found.status) in ("Solved", "PrimalInfeasible"):
                break
        x, z = np.array(found.x), np.array(found.z)
        return Solution(str(found.status), x[:n], x[n:], z[:m])

    def blocks(self, x: np.ndarray) -> Iterator[tuple[float, float, float]]:
        """Of each contact: the normal component, the size of the tangential one, and mu."""
        first = 0
        for size, contact in zip(self.sizes, self.contacts):
            side = float(np.linalg.norm(x[first + 1 : first + size]))
            yield float(x[first]), side, contact.friction if size > 1 else 0.0
            first += size

    def impulses_error(self, r: np.ndarray, margin: float) -> float:
        """By how much impulses fail to balance the forces with a margin, in loads."""
        off = float(np.abs(self.J @ r + self.f).max())
        for normal, side, mu in self.blocks(r):
            off = max(off, margin - (normal - (side / mu if mu > 0 else 0.0)))
        return off

    def velocity_margin(self, v: np.ndarray) -> tuple[float, float]:
        """What a virtual velocity proves: f'v / sum u_n is how much is missing at least, if u is in
        the dual cones. Returns it, and by how much u is outside, beside the sum of all u_n."""
        u = self.J.T @ v
        first = sum(self.sizes)
        total, off = 0.0, float(np.abs(u[first:]).max(initial=0.0))
        for normal, side, mu in self.blocks(u):
            total, off = total + max(normal, 0.0), max(off, mu * side - normal)
        total = max(total, 1e-3 * float(np.abs(v).max(initial=0.0)), 1e-300)
        return float(self.f @ v) / total, off / total


def decide(scene: Scene) -> Verdict:
    """Stands, falls, too near to the edge to say, or unclear."""
    pairs = touching(scene)
    together = decide_with(scene, all_directions(pairs))
    if together.word != "stands" or all(len(pair) == 1 for pair in pairs):
        return together
    middle = decide_with(scene, middle_directions(pairs))
    return middle if middle.word == "stands" else middle._replace(word="unclear")


def decide_with(scene: Scene, contacts: list[Contact]) -> Verdict:
    """The same with given contacts."""
    program = Program(scene, contacts)
    found = program.solve(True, 1.0)
    proved, off = program.velocity_margin(found.v)
    short = found.status == "PrimalInfeasible" or found.s[0] <= -MARGIN
    if short and proved >= MARGIN and off <= 1e-3 * proved:
        margin = -math.inf if found.status == "PrimalInfeasible" else float(found.s[0])
        return Verdict("falls", margin, found.status, off, len(contacts))
    if abs(found.s[0]) < MARGIN:
        program, found = without_idle(scene, program, found)
    margin = float(found.s[0])
    off = program.impulses_error(found.r, margin)
    word = "stands" if margin >= MARGIN and off <= 1e-2 * margin else "edge"
    return Verdict(word, margin, found.status, off, len(contacts))


def without_idle(scene: Scene, program: Program, found: Solution) -> tuple[Program, Solution]:
    """The margin without the contacts that can carry nothing, like those of flush neighbours which
    nothing presses. Impulses of 0 are within their cones, so that what stands without them stands.

    They are idle because a motion opens them that no force resists or helps. At the edge contacts
    lose their load because works of forces cancel: there leaving them out would hide the edge."""
    works = np.abs(program.f * found.v)
    if works.max() > MARGIN * np.abs(found.v).max():
        return program, found
    each = program.solve(False, 1e-3, -1e-9)
    busy = [c for c, s in zip(program.contacts, each.s) if s > MARGIN]
    if each.status != "Solved" or len(busy) == len(program.contacts):
        return program, found
    rest = Program(scene, busy)
    better = rest.solve(True, 1.0)
    return (rest, better) if better.s[0] >= MARGIN else (program, found)
