"""A finger pushes a box along a table to a place, where it is to lie still at the end: the force on the
finger, found by gradients through every contact of the way. Each step is one problem of contacts,
and perp.contact_sensitivity tells how its velocities depend on what the step began with."""

import numpy as np

import perp

STEPS, h, g, mu, goal = 60, 0.02, 9.81, 0.4, 0.5
M = np.diag([2.0, 2.0, 0.5])  # box along and up, finger along
# box on the table: normal, tangent; finger on the box
H = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [1.0, 0.0, -1.0]])
weight = np.array([0.0, -2.0 * g, 0.0])
KNOTS = 8  # the force is linear between them
spread = np.array(
    [np.interp(np.linspace(0.0, 1.0, STEPS), np.linspace(0.0, 1.0, KNOTS), e) for e in np.eye(KNOTS)]
).T


def walk(knots, solver):
    """Positions, velocities and problems of all steps."""
    q, v, tape = np.zeros(3), np.zeros(3), []
    for force in spread @ knots:
        f = M @ v + h * (weight + [0.0, 0.0, force])
        w = np.array([q[1] / h, 0.0, (q[0] - q[2]) / h])  # gaps over h
        result = solver.solve(f, w)
        assert result.ok
        tape.append((f, w, result))
        v = result.v
        q = q + h * v
    return q, v, tape


def cost_and_gradient(knots, solver):
    q, v, tape = walk(knots, solver)
    cost = 0.5 * (100.0 * (q[0] - goal) ** 2 + 10.0 * v[0] ** 2 + 1e-4 * knots @ knots)
    of_q = np.array([100.0 * (q[0] - goal), 0.0, 0.0])
    of_v = np.array([10.0 * v[0], 0.0, 0.0])
    forces, degenerate = np.zeros(STEPS), 0
    for k in reversed(range(STEPS)):
        f, w, result = tape[k]
        slope = perp.contact_sensitivity(M, f, H, w, [mu, 0.0], result.impulse, dim=[2, 1])
        degenerate += not slope.differentiable
        x, y, _, _ = slope.adjoint(of_v + h * of_q)  # q + h v is what the next step sees
        forces[k] = h * x[2]
        of_v = M @ x
        of_q = of_q + np.array([y[2], y[0], -y[2]]) / h
        slope.close()
    return cost, spread.T @ forces + 1e-4 * knots, degenerate, q, v


def descend(knots, solver, rounds=60):
    """BFGS with halved steps."""
    cost, slope, *rest = cost_and_gradient(knots, solver)
    inverse = np.eye(KNOTS) * 10.0
    for _ in range(rounds):
        step = -inverse @ slope
        share = min(1.0, 10.0 / np.abs(step).max())
        while True:
            trial = cost_and_gradient(knots + share * step, solver)
            if trial[0] <= cost + 1e-4 * share * slope @ step or share < 1e-6:
                break
            share *= 0.5
        if share < 1e-6:
            break
        s, y = share * step, trial[1] - slope
        knots, cost, slope, rest = knots + s, trial[0], trial[1], trial[2:]
        if s @ y > 1e-12:
            A = np.eye(KNOTS) - np.outer(s, y) / (s @ y)
            inverse = A @ inverse @ A.T + np.outer(s, s) / (s @ y)
    return knots, cost, rest


with perp.ContactSolver(M, H, [mu, 0.0], dim=[2, 1]) as solver:
    start = np.linspace(15.0, 5.0, KNOTS)
    before = cost_and_gradient(start, solver)
    # the gradient against a difference: all steps of this way have strict modes
    e, direction = 1e-6, np.ones(KNOTS)
    ahead, behind = (cost_and_gradient(start + s * e * direction, solver)[0] for s in (1, -1))
    print(f"slope {before[1] @ direction:.6f}, by differences {(ahead - behind) / (2 * e):.6f}")
    knots, cost, (degenerate, q, v) = descend(start, solver)
    print(f"before: cost {before[0]:.3f}, box at {before[3][0]:.3f} m, {before[4][0]:.3f} m/s")
    print(f"after:  cost {cost:.4f}, box at {q[0]:.4f} m, {v[0]:.4f} m/s, goal {goal} m")
    print("force at the knots:", np.round(knots, 2))
    modes = [" ".join(r.modes) for _, _, r in walk(knots, solver)[2]]
    for k, mode in enumerate(modes):
        if k == 0 or mode != modes[k - 1]:
            print(f"    from {k * h:.2f} s: table {mode.split()[0]}, finger {mode.split()[1]}")
