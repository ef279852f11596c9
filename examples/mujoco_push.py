"""A finger pushes a box to a mark, where friction stops it: iLQR by derivatives of exact contact,
timed beside MuJoCo's differences of its soft one. Needs MuJoCo: pip install 'perp[mujoco]'."""

import time

import mujoco
import numpy as np

import perp.mujoco

model = mujoco.MjModel.from_xml_string("""
<mujoco><option timestep=".01"/><default><joint type="slide"/></default><worldbody>
<geom type="plane" size="5 5 .1" friction=".3"/><body pos="-.1 0 .05">
<joint name="finger" axis="1 0 0"/><geom size=".04" mass=".2"/></body><body pos="0 0 .04999">
<joint axis="1 0 0"/><joint axis="0 0 1"/><geom type="box" size=".05 .05 .05" mass=".3"
friction=".3"/></body></worldbody><actuator><motor joint="finger"/></actuator></mujoco>""")
MARK, HORIZON, n = 0.3, 100, 2 * model.nv
wanted = np.array([0.0, MARK, 0.0, 0.0, 0.0, 0.0])  # the finger may be anywhere
Q_end, Q, R = np.diag([0.0, 300.0, 0.0, 0.0, 5.0, 0.0]), 1e-4 * np.eye(n), 1e-2 * np.eye(1)


def run(u, x, k, K):
    """Controls, closed by gains K on how far it is from x; states, controls and their cost."""
    stepper, data, u, way = perp.mujoco.Stepper(model), mujoco.MjData(model), u + k, [np.zeros(n)]
    for t in range(HORIZON):
        data.ctrl[:] = u[t] = u[t] + K[t] @ (way[t] - x[t])
        stepper.step(data)
        way.append(np.concatenate([data.qpos, data.qvel]))
    x, off = np.array(way), way[-1] - wanted
    return x, u, off @ Q_end @ off + np.sum(x @ Q * x) + np.sum(u @ R * u)


def improve(x, u, data, spent):
    """Backwards in time: the change of each control, and its gain on the state."""
    V, v, k, K = 2.0 * Q_end, 2.0 * Q_end @ (x[-1] - wanted), 0.0 * u, np.zeros((len(u), 1, n))
    for t in reversed(range(HORIZON)):
        (data.qpos[:], data.qvel[:]), data.ctrl[:] = np.split(x[t], 2), u[t]
        began = time.perf_counter()
        A, B = perp.mujoco.derivatives(model, data)[:2]
        between = time.perf_counter()
        mujoco.mjd_transitionFD(model, data, 1e-6, True, A.copy(), B.copy(), None, None)
        spent += between - began, time.perf_counter() - between
        gain = -np.linalg.inv(B.T @ V @ B + 2.0 * R)
        k[t], K[t] = gain @ (B.T @ v + 2.0 * R @ u[t]), gain @ B.T @ V @ A
        v = 2.0 * Q @ x[t] + A.T @ (v + V @ B @ k[t]) + K[t].T @ (2.0 * R @ u[t])
        V = 2.0 * Q + A.T @ V @ (A + B @ K[t])
    return k, K


u, spent = np.full((HORIZON, 1), 1.2), np.zeros(2)  # pushes steadily: too far
x, u, cost = run(u, np.zeros((HORIZON, n)), 0.0 * u, np.zeros((HORIZON, 1, n)))
for turn in range(1, 31):
    print(f"iLQR, turn {turn}: the box is at {x[-1, 1]:.3f} m with {x[-1, 4]:.2f} m/s")
    k, K = improve(x, u, mujoco.MjData(model), spent)
    tried = min((run(u, x, 0.5**j * k, K) for j in range(6)), key=lambda one: one[2])
    if tried[2] > (1.0 - 1e-4) * cost:
        break
    x, u, cost = tried
print("derivatives of a step: {:.0f} us, {:.0f} by mjd_transitionFD".format(*1e4 * spent / turn))
print("reached" if abs(x[-1, 1] - MARK) < 0.01 and abs(x[-1, 4]) < 0.05 else "missed")
