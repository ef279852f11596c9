"""Problem classes for the work-precision pictures: (M, q) of plain LCPs, the same in every run."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

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
