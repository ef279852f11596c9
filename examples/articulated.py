"""A double pendulum swings against a wall. Its simulator works in joint angles and keeps the factors
of its own mass matrix: perp sees only a function that solves with them, and the rows of the tip."""

import numpy as np

import perp

m, length, g, h = np.array([1.0, 0.5]), np.array([1.0, 0.8]), 9.81, 1e-3
wall, mu, restitution = 1.2, 0.3, 0.4  # solid where x >= wall


def mass_and_force(q, v):
    """M(q) and the forces: gravity, and what velocities add (Coriolis, centrifugal)."""
    c, s = np.cos(q[0] - q[1]), np.sin(q[0] - q[1])
    coupling = m[1] * length[0] * length[1]
    M = np.array([[m.sum() * length[0] ** 2, coupling * c], [coupling * c, m[1] * length[1] ** 2]])
    gravity = -g * np.array([m.sum() * length[0], m[1] * length[1]]) * np.sin(q)
    return M, gravity + coupling * s * np.array([-v[1] ** 2, v[0] ** 2])


def tip(q):
    """Position (x to the right, y up) and its derivative with respect to the angles."""
    position = np.array([length @ np.sin(q), -length @ np.cos(q)])
    return position, np.array([length * np.cos(q), length * np.sin(q)])


q, v = np.array([-1.2, -0.9]), np.zeros(2)
impulse, impacts = np.zeros(2), 0
worst, deepest, gained = 0.0, np.inf, 0.0
for step in range(2000):
    M, force = mass_and_force(q, v)
    factors = np.linalg.cholesky(M)
    position, jacobian = tip(q)
    gap = wall - position[0]
    deepest = min(deepest, gap)
    # the contact pushes the tip to -x: normal velocity, then tangential
    H = np.array([-jacobian[0], jacobian[1]])
    approach = (H @ v)[0]
    hits = gap + h * approach < 0.0
    w = np.array([restitution * approach if hits and approach < -0.1 else max(gap, 0.0) / h, 0.0])
    r = perp.contact(
        lambda x, L=factors: np.linalg.solve(L.T, np.linalg.solve(L, x)),
        M @ v + h * force,
        H,
        w,
        mu,
        dim=2,
        r0=impulse,
        tol=1e-12,
    )
    assert r.ok, r.outcome
    worst = max(worst, r.residual)
    if r.impulse[0] > 0.0 and hits and approach < -0.1:
        impacts += 1
        before, after = 0.5 * v @ M @ v, 0.5 * r.v @ M @ r.v
        gained = max(gained, after - before - h * force @ (v + r.v) / 2)
        if impacts == 1:
            ratio = -(H @ r.v)[0] / approach
            print(f"first impact after {step * h:.3f} s: {r.modes[0]}, leaves at {ratio:.3f} times")
    v, impulse = r.v, r.impulse
    q = q + h * v

print(f"{impacts} impacts, energy gained in the worst of them: {max(gained, 0.0):.1e}")
print(f"smallest gap {deepest:.1e}, largest residual {worst:.0e}")
