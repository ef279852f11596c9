"""A brick on a ramp from functions of one's own: it slides, stops dead, and stays."""

import numpy as np

import perp

g, slope, mu = 9.81, np.radians(10), 0.3

brick = perp.Mechanism(
    2,  # along the ramp, and away from it
    force=[g * np.sin(slope), -g * np.cos(slope)],
    contacts=lambda q: (q[1], [0, 1], [1, 0]),  # the gap, its gradient, the way it can slide
    mu=mu,
)
run = brick.simulate(q0=[0, 0], v0=[2, 0], t_end=3.0, dt=0.001)
stop = np.argmax(run.v[:, 0] == 0.0)  # not almost: exactly
formula = 2 / (g * (mu * np.cos(slope) - np.sin(slope)))
print(f"stops after {run.t[stop]:.3f} s, by the formula {formula:.4f} s", run.modes[stop])
print("velocity after 3 s:", *run.v[-1])
