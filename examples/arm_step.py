"""One step of an arm of two links: pins whose friction grows with what they carry, a motor, a seal of
given friction, a joint's limit and a table under its tip, in one call."""

import numpy as np

import perp

h, m, J, half, radius = 1e-3, 2.0, 0.06, 0.3, 0.02  # step, links, half of their length, pins
v = -np.array([0, 0.3, 1, 0, 1.2, 2])  # x, y, angle; twice: stretched out, it swings down
M = np.diag([m, m, J, m, m, J])
f = M @ v + h * np.array([0, -9.81 * m, 0, 0, -9.81 * m, 0])
shoulder = [[1, 0, 0, 0, 0, 0], [0, 1, -half, 0, 0, 0], [0, 0, radius, 0, 0, 0]]
elbow = [[-1, 0, 0, 1, 0, 0], [0, -1, -half, 0, 1, -half], [0, 0, -radius, 0, 0, radius]]
roller = [0, 0, 0, 0, 1, half]  # at the tip, over a table
turns = [[0, 0, 1, 0, 0, 0], [0, 0, 1, 0, 0, 0], [0, 0, 1, 0, 0, -1]]  # motor; seal; limit
w = [0] * 6 + [1e-3 / h] + [0.5, 0, 5e-4 / h]  # gaps; the motor asks for -0.5 rad/s
bounds = [-30 * h, -0.2 * h, 0], [30 * h, 0.2 * h, np.inf]
r = perp.contact(
    M, f, np.vstack([shoulder, elbow, roller, turns]), w, mu=[0.3, 0.3, 0],
    dim=[3, 3, 1], two_sided=[2, 2, 0], bounds=bounds,
)  # fmt: skip
print(r.outcome, *r.modes)
for k, name in (0, "shoulder"), (3, "elbow"):
    N, t = np.hypot(*r.impulse[k : k + 2]) / h, r.impulse[k + 2] / h
    print(f"{name}: |N| = {N:.3f} N, friction {t * radius:.4f} Nm = {t / N:.3f} |N| radius")
print("motor %.3f, seal %.3f, limit %.3f Nm" % tuple(r.impulse[7:] / h))
print("joints turn at", *np.round([r.v[2], r.v[5] - r.v[2]], 6))
