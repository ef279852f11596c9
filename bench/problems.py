"""Problem classes for the work-precision pictures, the same in every run: (M, q) of plain LCPs, and
frictional contacts."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
import scipy.sparse.linalg  # noqa: F401

Vector = NDArray[np.float64]


def random_definite(n: int, seed: int = 1) -> tuple[Vector, Vector]:
    """A positive definite matrix that is not symmetric; about half of the variables are positive."""
    random = np.random.RandomState(seed)
    A = random.uniform(-1, 1, (n, n))
    B = random.uniform(-1, 1, (n, n))
    M = A @ A.T / n + 0.1 * np.eye(n) + 0.5 * (B - B.T) / np.sqrt(n)
    return M, random.uniform(-1, 1, n)


def obstacle(side: int) -> tuple[sparse.csc_matrix, Vector]:
    """A membrane over a hemisphere of radius 1, held at height 0 on the edge of a square of side 3,
    by five-point differences; z is the height above the obstacle."""
    x = np.linspace(-1.5, 1.5, side + 2)[1:-1]
    T = sparse.diags([-np.ones(side - 1), 2 * np.ones(side), -np.ones(side - 1)], [-1, 0, 1])
    eye = sparse.identity(side)
    laplace = sparse.csc_matrix(sparse.kron(T, eye) + sparse.kron(eye, T)) / (x[1] - x[0]) ** 2
    r2 = (x[:, None] ** 2 + x[None, :] ** 2).ravel()
    height = np.where(r2 < 1, np.sqrt(np.maximum(1 - r2, 0)), (1 - r2) / 2)
    return laplace, laplace @ height


def grid_problem(side: int, space: int, plate: bool = False, flow: float = 0.0) -> tuple[Any, Vector]:
    """Differences on a square or a cube, squared for a plate, with a flow along the last axis; q is
    random."""
    T = sparse.diags([-np.ones(side - 1), 2 * np.ones(side), -np.ones(side - 1)], [-1, 0, 1])
    M, eye = T, sparse.identity(side)
    for _ in range(space - 1):
        M = sparse.kron(M, eye) + sparse.kron(sparse.identity(M.shape[0]), T)
    n = M.shape[0]
    M = M @ M if plate else M
    M = M + flow * sparse.diags([np.ones(n - 1), -np.ones(n - 1)], [1, -1])
    return _canonical(M), np.random.default_rng(1).uniform(-1, 1, n)


def _canonical(M: Any) -> sparse.csc_matrix:
    M = sparse.csc_matrix(M)
    M.eliminate_zeros()
    M.sort_indices()
    return M


def _scattered(n: int, entries: int, random: Any) -> sparse.csc_matrix:
    rows, columns = random.integers(0, n, (2, entries))
    return sparse.csc_matrix((random.uniform(0, 1, entries), (rows, columns)), shape=(n, n))


def skew(n: int) -> tuple[sparse.csc_matrix, Vector]:
    """I + R - R', five entries a row of R at random."""
    random = np.random.default_rng(1)
    R = _scattered(n, 5 * n, random)
    return _canonical(R - R.T + sparse.identity(n)), random.uniform(-1, 1, n)


def program(m: int) -> tuple[sparse.csc_matrix, Vector]:
    """[I -A'; A 0], two entries a row of A at random."""
    random = np.random.default_rng(2)
    A = _scattered(m, 2 * m, random)
    return _canonical(sparse.bmat([[sparse.identity(m), -A.T], [A, None]])), random.uniform(-1, 1, 2 * m)


def residual(M: Any, q: Vector, z: Vector) -> float:
    """max |min(z, Mz+q)| / max |q| of any code's z; a z that is not finite has none."""
    value = np.max(np.abs(np.minimum(z, M @ z + q))) / np.max(np.abs(q))
    return float(value) if np.isfinite(value) else np.inf


def _directions(normal: Vector, count: int) -> Vector:
    tangent = np.linalg.svd(normal[None, :])[2][1:]
    angles = 2 * np.pi * np.arange(count) / count
    return np.cos(angles)[:, None] * tangent[0] + np.sin(angles)[:, None] * tangent[1]


def contact_stack(boxes: int, directions: int, ratio: float, mu: float, seed: int = 1):
    """One Stewart-Trinkle step of a pushed stack of cubes, four contacts a face, the whole scene
    rotated at random; the mass grows from box to box until the top one weighs `ratio` times the
    lowest. Unknown: normal impulses, friction impulses, slip speeds."""
    random = np.random.RandomState(seed)
    Q = np.linalg.qr(random.standard_normal((3, 3)))[0]
    mass = ratio ** (np.arange(boxes) / max(boxes - 1, 1))
    h = 1e-2
    inverse = np.repeat(1 / mass, 6).reshape(boxes, 6)
    inverse[:, 3:] *= 6  # a cube with edge 1: I = m / 6
    free = np.zeros((boxes, 6))
    free[:, :3] = -9.81 * h * Q[:, 2] + 0.02 * random.standard_normal((boxes, 3))
    normals, frictions = [], []
    for upper in range(boxes):
        for corner in ((-0.5, -0.5), (-0.5, 0.5), (0.5, -0.5), (0.5, 0.5)):
            arm = {upper: Q @ np.array([*corner, -0.5])}
            if upper > 0:
                arm[upper - 1] = Q @ np.array([*corner, 0.5])

            def row(direction: Vector) -> Vector:
                J = np.zeros((boxes, 6))
                for body, r in arm.items():
                    sign = 1.0 if body == upper else -1.0
                    J[body, :3] = sign * direction
                    J[body, 3:] = sign * np.cross(r, direction)
                return J.ravel()

            normals.append(row(Q[:, 2]))
            frictions.extend(row(d) for d in _directions(Q[:, 2], directions))
    contacts = len(normals)
    B = np.array(normals + frictions)
    E = np.kron(np.eye(contacts), np.ones((directions, 1)))
    size = B.shape[0] + contacts
    M = np.zeros((size, size))
    M[: len(B), : len(B)] = (B * inverse.ravel()) @ B.T
    M[contacts : len(B), len(B) :] = E
    M[len(B) :, :contacts] = mu * np.eye(contacts)
    M[len(B) :, contacts : len(B)] = -E.T
    q = np.concatenate([B @ free.ravel(), np.zeros(contacts)])
    return M, q


class Contacts(NamedTuple):
    """M v = f + H'r, u = H v + w, three rows of H a contact, normal first."""

    M: sparse.csc_matrix
    H: sparse.csc_matrix
    f: Vector
    w: Vector
    mu: Vector

    def delassus(self) -> tuple[Vector, Vector]:
        """W and q of u = W r + q."""
        inverse = sparse.linalg.inv(self.M)
        return (self.H @ inverse @ self.H.T).toarray(), self.H @ (inverse @ self.f) + self.w


class _Pile:
    """Boxes and balls of density 1 that touch, one step of 0.01 under gravity, turned at random."""

    def __init__(self, mu: float, push: float, seed: int = 1) -> None:
        self.random = np.random.RandomState(seed)
        self.Q = np.linalg.qr(self.random.standard_normal((3, 3)))[0]
        self.mu, self.push = mu, push
        self.centre: list[Vector] = []
        self.inertia: list[Vector] = []  # mass and moments about the axes
        self.touching: list[tuple[int, int, Vector, Vector]] = []

    def box(self, centre: Any, half: Any, mass: float = 1.0) -> int:
        squares = np.square(half)
        self.centre.append(np.array(centre, dtype=float))
        self.inertia.append(mass * np.array([1, *(squares.sum() - squares) / 3]))
        return len(self.centre) - 1

    def ball(self, centre: Any) -> int:
        self.centre.append(np.array(centre, dtype=float))
        self.inertia.append(np.array([1, 0.1, 0.1, 0.1]))  # of diameter 1
        return len(self.centre) - 1

    def touch(self, below: int, above: int, point: Any, normal: Any = (0, 0, 1)) -> None:
        """below -1: the ground."""
        self.touching.append((below, above, np.array(point, dtype=float), np.array(normal, dtype=float)))

    def face(self, below: int, above: int, x: tuple[float, float], z: float) -> None:
        """Four points of a face of depth 1."""
        for corner in ((x[0], -0.5), (x[0], 0.5), (x[1], -0.5), (x[1], 0.5)):
            self.touch(below, above, (*corner, z))

    def _rows(self, normal: Vector) -> Vector:
        tangent = np.linalg.svd((self.Q @ normal)[None, :])[2][1:]
        return np.vstack([self.Q @ normal, tangent])

    def problem(self) -> Contacts:
        n, rows = 6 * len(self.centre), 3 * len(self.touching)
        M, H, before = sparse.lil_matrix((n, n)), sparse.lil_matrix((rows, n)), np.zeros(n)
        for k, (mass, *moments) in enumerate(self.inertia):
            M[6 * k : 6 * k + 3, 6 * k : 6 * k + 3] = mass * np.eye(3)
            M[6 * k + 3 : 6 * k + 6, 6 * k + 3 : 6 * k + 6] = self.Q * moments @ self.Q.T
            before[6 * k : 6 * k + 3] = -0.0981 * self.Q[:, 2]
        before += self.push * self.random.standard_normal(n)
        for k, (below, above, point, normal) in enumerate(self.touching):
            directions = self._rows(normal)
            for body, sign in ((below, -1), (above, 1)):
                if body >= 0:
                    arm = self.Q @ (point - self.centre[body])
                    J = np.hstack([directions, np.cross(arm, directions)])
                    H[3 * k : 3 * k + 3, 6 * body : 6 * body + 6] = sign * J
        M, H = sparse.csc_matrix(M), sparse.csc_matrix(H)
        return Contacts(M, H, M @ before, np.zeros(rows), np.full(rows // 3, self.mu))


def tower(boxes: int, ratio: float, mu: float, push: float) -> Contacts:
    """Cubes on each other, the top one `ratio` times as heavy as the lowest."""
    pile, below = _Pile(mu, push), -1
    for k in range(boxes):
        above = pile.box((0, 0, k + 0.5), (0.5, 0.5, 0.5), ratio ** (k / max(boxes - 1, 1)))
        pile.face(below, above, (-0.5, 0.5), k)
        below = above
    return pile.problem()


def wall(courses: int, bricks: int, mu: float, push: float) -> Contacts:
    """Bricks of 2 by 1 by 1 in bond: each on the halves of two."""
    pile, last = _Pile(mu, push), []
    for k in range(courses):
        row = [
            (x, pile.box((x, 0, k + 0.5), (1, 0.5, 0.5)))
            for x in 2.0 * np.arange(bricks) + k % 2
        ]
        for x, above in row:
            if k == 0:
                pile.face(-1, above, (x - 1, x + 1), k)
            for other, below in last:
                if abs(other - x) < 2:
                    pile.face(below, above, (max(x, other) - 1, min(x, other) + 1), k)
        last = row
    return pile.problem()


def ball_pyramid(layers: int, mu: float, push: float) -> Contacts:
    """Balls of diameter 1, each on four; those of a layer have a hair between them."""
    pile, below = _Pile(mu, push), {}
    for k in range(layers):
        side = layers - k
        height = k * np.sqrt(0.5)
        row = {
            (i, j): pile.ball((i + 0.5 * k, j + 0.5 * k, height))
            for i in range(side)
            for j in range(side)
        }
        for (i, j), ball in row.items():
            centre = pile.centre[ball]
            if k == 0:
                pile.touch(-1, ball, centre - [0, 0, 0.5])
            under = [(i + a, j + b) for a in (0, 1) for b in (0, 1)] if k else []
            for other in [below[at] for at in under]:
                normal = centre - pile.centre[other]
                pile.touch(other, ball, pile.centre[other] + 0.5 * normal, normal)
        below = row
    return pile.problem()


def contact_residual(W: Vector, q: Vector, mu: Vector, r: Vector) -> float:
    """max sqrt(t) |r - P(r - (u + mu |u_t| e_n) / t)| over max |q| / sqrt(t), t the trace of a
    contact's block of W: docs/contact.md's `residual`, for any code's r."""
    t = np.diag(W).reshape(-1, 3).sum(axis=1)
    r = r.reshape(-1, 3)
    u = (W @ r.ravel() + q).reshape(-1, 3)
    x = r - u / t[:, None]
    x[:, 0] -= mu * np.linalg.norm(u[:, 1:], axis=1) / t
    n, s = x[:, 0], np.linalg.norm(x[:, 1:], axis=1)
    normal = np.where(s <= mu * n, n, np.maximum((n + mu * s) / (1 + mu**2), 0))
    shrink = np.where(s <= mu * n, 1, mu * normal / np.maximum(s, 1e-300))
    nearest = np.column_stack([normal, shrink[:, None] * x[:, 1:]])
    scale = np.max(np.abs(q).reshape(-1, 3).max(axis=1) / np.sqrt(t))
    value = np.max(np.sqrt(t) * np.linalg.norm(r - nearest, axis=1)) / scale
    return float(value) if np.isfinite(value) else np.inf
