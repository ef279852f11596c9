"""A finger pushes a box to a mark: iLQR with the derivatives of steps with exact contact.

The finger is a motor on a slide, and friction of the floor stops the box. Needs MuJoCo:
pip install 'perp[mujoco]'.
"""

import time

import mujoco
import numpy as np

import perp.mujoco

model = mujoco.MjModel.from_xml_string("""
<mujoco><option timestep=".01"/><worldbody><geom type="plane" size="5 5 .1" friction=".3"/>
<body pos="-.1 0 .05"><joint name="finger" axis="1 0 0" type="slide"/>
<geom size=".04" mass=".2"/></body>
<body pos="0 0 .04999"><joint axis="1 0 0" type="slide"/><joint axis="0 0 1" type="slide"/>
<geom type="box" size=".05 .05 .05" mass=".3" friction=".3"/></body></worldbody>
<actuator><motor joint="finger"/></actuator></mujoco>""")
MARK, HORIZON = 0.3, 100
n, m = 2 * model.nv, model.nu
spec = mujoco.mjtState.mjSTATE_FULLPHYSICS
data = mujoco.MjData(model)
start = np.zeros(mujoco.mj_stateSize(model, spec))
mujoco.mj_getState(model, data, start, spec)
wanted = np.array([MARK - 0.1, MARK, 0.0, 0.0, 0.0, 0.0])  # the finger may be anywhere
Q_end, Q, R = np.diag([0.0, 300.0, 0.0, 0.0, 5.0, 0.0]), 1e-4 * np.eye(n), 1e-2 * np.eye(m)


def run(controls):
    """States before and after each step, and what they cost."""
    steps = perp.mujoco.rollout(model, start, controls, threads=1).states[0]
    x = np.vstack([start, steps])[:, 1:]
    off = x[-1] - wanted
    return x, off @ Q_end @ off + np.sum((x @ Q) * x) + np.sum((controls @ R) * controls)


def linear(x, u):
    data.qpos[:], data.qvel[:], data.ctrl[:] = x[: model.nv], x[model.nv :], u
    return perp.mujoco.derivatives(model, data)


def gains(x, u):
    """Backwards in time: the change of each control, and its gain on the state."""
    V, v = 2.0 * Q_end, 2.0 * Q_end @ (x[-1] - wanted)
    k, K = np.zeros((HORIZON, m)), np.zeros((HORIZON, m, n))
    for t in reversed(range(HORIZON)):
        A, B = linear(x[t], u[t])[:2]
        by_u = B.T @ V @ B + 2.0 * R
        k[t] = -np.linalg.solve(by_u, B.T @ v + 2.0 * R @ u[t])
        K[t] = -np.linalg.solve(by_u, B.T @ V @ A)
        closed = A + B @ K[t]
        v = 2.0 * Q @ x[t] + A.T @ v + K[t].T @ (2.0 * R @ u[t]) + A.T @ V @ B @ k[t]
        V = 2.0 * Q + A.T @ V @ closed
        V = 0.5 * (V + V.T)
    return k, K


def forward(x, u, k, K, share):
    """Controls with this share of the change, closed by the gains, step by step."""
    stepper, own = perp.mujoco.Stepper(model), mujoco.MjData(model)
    new = np.zeros_like(u)
    for t in range(HORIZON):
        off = np.concatenate([own.qpos, own.qvel]) - x[t]
        own.ctrl[:] = new[t] = u[t] + share * k[t] + K[t] @ off
        stepper.step(own)
    return new


controls = np.full((HORIZON, m), 1.2)  # pushes steadily: more than friction, too far
x, cost = run(controls)
print(f"a steady push: the box is at {x[-1, 1]:.3f} m with {x[-1, 4]:.2f} m/s")
began = time.perf_counter()
for _ in range(30):
    k, K = gains(x, controls)
    tried = [forward(x, controls, k, K, 0.5**j) for j in range(6)]
    runs = [run(one) for one in tried]
    best = min(range(6), key=lambda j: runs[j][1])
    if runs[best][1] > (1.0 - 1e-4) * cost:
        break
    controls, (x, cost) = tried[best], runs[best]
print(f"iLQR, {time.perf_counter() - began:.1f} s: {x[-1, 1]:.3f} m with {x[-1, 4]:.2f} m/s")
print("reached" if abs(x[-1, 1] - MARK) < 0.01 and abs(x[-1, 4]) < 0.05 else "missed")
