"""The falling rod of problem (e') from event to event: where it ends, to ten digits."""

import numpy as np
import pytest
from test_mechanism import G, rod

HALF, CAP, INERTIA, MU = 0.25, 0.05, 0.002, 0.6
INVERSE = np.diag([1, 1, 1 / INERTIA])
GRAVITY = np.array([0, -G, 0])
integrate = pytest.importorskip("scipy.integrate")


def gap(y, end):
    return y[1] + end * HALF * np.sin(y[2]) - CAP


def foot(y, end):
    """Rows of the foot's velocity, and its acceleration where v' is 0."""
    s, c = end * HALF * np.sin(y[2]), end * HALF * np.cos(y[2])
    return np.array([[0, 1, c], [1, 0, CAP - s]]), -np.array([s, c]) * y[5] ** 2


def force(y, sliding):
    """Of the lower foot (end -1): it sticks, or slides to the left, pushed by friction."""
    J, bias = foot(y, -1)
    W, b = J @ INVERSE @ J.T, J @ GRAVITY + bias
    if sliding:
        return np.array([1, MU]) * (-b[0] / (W[0, 0] + MU * W[0, 1]))
    return np.linalg.solve(W, -b)


def phase(t, y, sliding, *events):
    """Integrates until one of the events."""

    def rate(t, y):
        return np.r_[y[3:], GRAVITY + INVERSE @ foot(y, -1)[0].T @ force(y, sliding)]

    stops = [lambda t, y, event=event: event(y) for event in events]
    for stop in stops:
        stop.terminal = True
    run = integrate.solve_ivp(
        rate, (t, 1.0), y, method="DOP853", rtol=1e-12, atol=1e-13, events=stops
    )
    return run.t[-1], run.y[:, -1], [len(times) > 0 for times in run.t_events]


def fall():
    """Free, until the left cap touches."""
    low, high = 0.0, 0.4
    for _ in range(60):
        t = (low + high) / 2
        y = np.array([0, 1 - G * t * t / 2, np.pi / 6 + 4 * t, 0, -G * t, 4])
        low, high = (t, high) if gap(y, -1) > 0 else (low, t)
    return t, y


def test_falling_rod_from_event_to_event():
    t, y = fall()
    assert t == pytest.approx(0.385817751713149, abs=1e-14)
    # The first impact: the foot stops (sliding would need a force that pulls).
    J, _ = foot(y, -1)
    impulse = np.linalg.solve(J @ INVERSE @ J.T, -J @ y[3:])
    assert impulse[0] > 0 and abs(impulse[1]) < MU * impulse[0]
    y[3:] += INVERSE @ J.T @ impulse
    # It sticks until friction does not hold it, then slides to the left until the right cap lands.
    t, y, ends = phase(
        t, y, False, lambda y: MU * force(y, False)[0] - force(y, False)[1], lambda y: gap(y, 1)
    )
    assert ends == [True, False] and force(y, False)[0] > 0
    t, y, ends = phase(t, y, True, lambda y: gap(y, 1), lambda y: force(y, True)[0])
    assert ends == [True, False] and (foot(y, -1)[0] @ y[3:])[1] < 0
    # It lies flat: both feet slide, the second impact takes y' and the spin; then friction brakes.
    speed = y[3] - MU * y[4]
    assert speed < 0 and y[2] == pytest.approx(np.pi, abs=1e-10)
    # its impulses: their sum stops y', their difference the spin, which friction's arm feeds
    total, twist = -y[4], (INERTIA * y[5] + CAP * MU * -y[4]) / HALF
    assert abs(twist) < total
    x = y[0] - speed**2 / (2 * MU * G)
    assert x == pytest.approx(-0.2273599827, abs=1e-10)
    m = rod(MU, half=HALF, inertia=INERTIA, cap=CAP, tips=(-1, 1))
    run = m.simulate([0, 1, np.radians(30)], [0, 0, 4], 1.0, 1e-3, scheme="theta", error=1e-7)
    # the estimated errors of the steps up to the second impact add up to about a hundred of 1e-7
    assert run.q[-1, 0] == pytest.approx(x, abs=1e-5)
    for h in (0.0025, 0.001):
        run = m.simulate([0, 1, np.radians(30)], [0, 0, 4], 1.0, h)
        assert abs(run.q[-1, 0] - x) < 2 * h
