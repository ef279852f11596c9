"""The falling rod of problem (e') from event to event: where it ends, to ten digits."""

import numpy as np
import pytest
from test_mechanism import G, rod

import perp

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


@pytest.mark.parametrize("scheme", ["frozen", "implicit", "theta"])
def test_a_run_may_end_next_to_an_impact(scheme):
    """A ball on a floor that rises, e = .7; t_end within 1e-3 to 1e-12 of the impact, either way."""
    rng = np.random.default_rng(3)
    for shift in (-1e-3, -1e-6, -1e-9, -1e-12, 0.0, 1e-12, 1e-9, 1e-6, 1e-3):
        up, height = rng.uniform(0, 0.5), rng.uniform(0.3, 2)
        impact = (-up + np.sqrt(up * up + 2 * 9.81 * height)) / 9.81

        def contacts(t, q, up=up):
            return {"gap": [q[0] - up * t], "normal": [[1.0]], "drift": [-up]}

        m = perp.Mechanism(1, mass=[[1.0]], force=[-9.81], contacts=contacts, restitution=0.7)
        run = m.simulate([height], [0.0], impact + shift, 1e-2, scheme=scheme, error=1e-5)
        assert run.outcome == "solved" and run.t[-1] == impact + shift
        assert run.stats.rejected < 200  # some 15; a run that went back and forth had thousands


def inelastic_answers(M, mu, v):
    """All velocities after an inelastic impact of row (0, 1) with friction along (1, 0)."""
    W = np.linalg.inv(M)
    r = -M @ v
    answers = [np.zeros(2)] if abs(r[0]) <= mu * r[1] else []
    for s in (-1.0, 1.0):
        rn = -v[1] / (W[1, 1] - s * mu * W[1, 0])
        after = v + W @ [-s * mu * rn, rn]
        if rn > 0 and s * after[0] > 0:
            answers.append(after)
    return answers


@pytest.mark.parametrize("scheme", ["frozen", "implicit", "theta"])
def test_an_inelastic_impact_may_end_or_turn_a_slip(scheme):
    """Random masses; what the run ends with is one of the answers of the impact's law."""
    rng = np.random.default_rng(4)
    for _ in range(60):
        A = rng.standard_normal((2, 2))
        M, mu = A @ A.T + 0.2 * np.eye(2), rng.uniform(0.05, 1.5)
        v = np.array([rng.uniform(-3, 3), -rng.uniform(0.5, 4)])
        m = perp.Mechanism(
            2, mass=M, contacts=lambda q: ([q[1]], [[0, 1.0]], [[1.0, 0]]), mu=mu
        )
        run = m.simulate([0, 1.0], v, 2.5, 1e-2, scheme=scheme, error=1e-6)
        assert run.outcome == "solved"
        off = [np.abs(run.v[-1] - after).max() for after in inelastic_answers(M, mu, v)]
        assert min(off) <= 1e-12 * np.abs(v).max()


# ---- runs with restitution, from impact to impact: flights in closed form --------------------------


class Member:
    """q0, v0, T; flight(q, v, s); gaps and rows(t, q) of what may be hit; the mechanism."""

    mu, law = 0.0, "moreau"

    def rows(self, t, q):
        return np.array([[0.0] * (len(q) - 1) + [1.0]]), np.zeros(1)

    def gaps(self, t, q):
        return np.array([q[-1]])

    def impact(self, t, q, v, j):
        """Row j alone is hit; mu > 0: M is 1, the other velocities are tangential."""
        H, drift = self.rows(t, q)
        step = np.linalg.solve(self.mass, H[j])
        u = H[j] @ v + drift[j]
        v = v - (1 + self.e) * u / (H[j] @ step) * step
        slip = np.linalg.norm(v[:-1])
        if self.mu > 0:
            v[:-1] *= max(slip + (1 + self.e) * u * self.mu, 0) / slip
        return v

    def reference(self):
        """q, v at T; how many impacts, and the least time between two of them or T."""
        optimize = pytest.importorskip("scipy.optimize")
        t, q, v, count, least = 0.0, self.q0, self.v0, 0, np.inf
        while True:
            times = np.linspace(0, self.T - t, 1001)

            def gap(s, j, t=t, q=q, v=v):
                return self.gaps(t + s, self.flight(q, v, s)[0])[j]

            first = (np.inf, 0)
            for j in range(len(self.gaps(t, q))):
                values = [gap(s, j) for s in times]
                low = [k for k in range(1, 1000) if values[k] >= 0 > values[k + 1]]
                if low:
                    at = optimize.brentq(gap, times[low[0]], times[low[0] + 1], (j,), 1e-15)
                    first = min(first, (at, j))
            if first[0] == np.inf:
                return *self.flight(q, v, self.T - t), count, least
            q, v = self.flight(q, v, first[0])
            t, count, least = t + first[0], count + 1, min(least, first[0], self.T - t - first[0])
            v = self.impact(t, q, v, first[1])

    def mechanism(self):
        def contacts(t, q):
            H, drift = self.rows(t, q)
            if self.mu == 0:
                return {"gap": self.gaps(t, q), "normal": H, "drift": drift}
            tangent = np.eye(len(q))[:-1]
            tangent = tangent if len(q) == 2 else tangent[None]
            drift = np.r_[drift, np.zeros(len(q) - 1)]
            return {"gap": self.gaps(t, q), "normal": H, "tangent": tangent, "drift": drift}

        return perp.Mechanism(
            len(self.q0), mass=self.mass, force=lambda t, q, v: self.force(q, v), mu=self.mu,
            contacts=contacts, restitution=self.e, law=self.law,
        )


class Drop(Member):
    """A ball falls, in half of the cases through a medium that drags, v' = -g - c v."""

    def __init__(self, rng):
        g, c, h = rng.uniform(1, 20), rng.choice([1e-9, rng.uniform(0.1, 1)]), rng.uniform(0.2, 2)
        self.e, self.mass, self.g, self.c = rng.uniform(0.3, 0.95), np.eye(1), g, c
        self.q0, self.v0 = np.array([h]), np.zeros(1)
        self.T = np.sqrt(2 * h / g) * rng.uniform(1.3, 1 + 2 * self.e + 1.5 * self.e**2)

    def force(self, q, v):
        return -self.g - self.c * v

    def flight(self, q, v, s):
        x = -np.expm1(-self.c * s)
        end = v + x * (-self.g / self.c - v)
        return q + (v - end - self.g * s) / self.c if self.c > 1e-3 else (
            q + v * s - self.g * s * s / 2), end


class Slope(Member):
    """A ball on a slope, with friction, in two or three dimensions."""

    def __init__(self, rng):
        n, a = rng.integers(2, 4), rng.uniform(0.05, 0.6)
        self.mu, self.e, self.mass = rng.uniform(0.01, 0.4), rng.uniform(0.3, 0.9), np.eye(n)
        self.law = rng.choice(["moreau", "newton", "poisson", "stronge"])
        self.G = np.zeros(n)
        self.G[0], self.G[-1] = 9.81 * np.sin(a), -9.81 * np.cos(a)
        self.q0, self.v0 = np.zeros(n), np.r_[rng.uniform(-2, 4, n - 1), 0]
        self.q0[-1] = rng.uniform(0.2, 1)
        self.T = np.sqrt(-2 * self.q0[-1] / self.G[-1])
        self.T *= rng.uniform(1.3, 1 + 2 * self.e + 1.5 * self.e**2)

    def force(self, q, v):
        return self.G

    def flight(self, q, v, s):
        return q + v * s + self.G * s * s / 2, v + self.G * s


class Table(Slope):
    """The same above a table that moves up and down."""

    def __init__(self, rng):
        super().__init__(rng)
        self.w, self.A = rng.uniform(1, 6), rng.uniform(0.01, 0.1)

    def gaps(self, t, q):
        return super().gaps(t, q) - self.A * np.sin(self.w * t)

    def rows(self, t, q):
        return super().rows(t, q)[0], np.array([-self.A * self.w * np.cos(self.w * t)])


class Stop(Member):
    """A spring beside a stop."""

    def __init__(self, rng):
        self.w, self.at, self.e = rng.uniform(3, 8), rng.uniform(0.1, 0.6), rng.uniform(0.3, 0.9)
        self.mass, self.q0, self.v0 = np.eye(1), np.ones(1), np.zeros(1)
        self.T = rng.uniform(0.6, 2) * 2 * np.pi / self.w

    def gaps(self, t, q):
        return q + self.at

    def force(self, q, v):
        return -self.w**2 * q

    def flight(self, q, v, s):
        c, d = np.cos(self.w * s), np.sin(self.w * s)
        return q * c + v * d / self.w, v * c - q * self.w * d


class Rod(Member):
    """A rod turns as it falls, on either end."""

    def __init__(self, rng):
        self.L, self.e = rng.uniform(0.2, 0.5), rng.uniform(0.3, 0.9)
        self.mass = np.diag([1, 1, self.L**2 * rng.uniform(0.2, 1)])
        self.q0 = np.array([0, rng.uniform(0.8, 1.5), rng.uniform(0, 3)])
        self.v0, self.T = np.array([0.3, 0, rng.uniform(-3, 3)]), rng.uniform(0.6, 1.1)

    def gaps(self, t, q):
        return q[1] + self.L * np.array([-1, 1]) * np.sin(q[2])

    def rows(self, t, q):
        c = self.L * np.cos(q[2])
        return np.array([[0, 1, -c], [0, 1, c]]), np.zeros(2)

    def force(self, q, v):
        return np.array([0, -9.81, 0])

    def flight(self, q, v, s):
        a = self.force(q, v)
        return q + v * s + a * s * s / 2, v + a * s


@pytest.mark.parametrize("kind", [Drop, Slope, Table, Stop, Rod])
@pytest.mark.parametrize(
    "scheme, errors",
    [("theta", (1e-3, 1e-5, 1e-7)), ("frozen", (1e-3, 1e-4)), ("implicit", (1e-3, 1e-4))],
)
def test_velocities_after_impacts_have_the_error_that_was_asked_for(kind, scheme, errors):
    """Each step may be wrong by `error`, in q and in v, and an impact multiplies it: 12 times at the
    most. What is hit again at once is left out. Of rods that turn far in steps that are exact an end
    may dip in and out between their ends: `longest`."""
    rng, members = np.random.default_rng(11), 0
    while members < 4:
        member = kind(rng)
        q, v, count, least = member.reference()
        if count == 0 or count > 4 or least < 0.03:
            continue
        members += 1
        for error in errors:
            run = member.mechanism().simulate(
                member.q0, member.v0, member.T, 1e-2, scheme=scheme, error=error, longest=0.05
            )
            wrong = max(
                np.abs(run.q[-1] - q).max() / max(1, np.abs(q).max()),
                np.abs(run.v[-1] - v).max() / max(1, np.abs(run.v).max()),
            )
            assert run.outcome == "solved"
            assert wrong <= 20 * error


@pytest.mark.parametrize("error", [1e-8, 1e-10])
def test_what_iterations_leave_does_not_add_up(error):
    """Springs beside stops, in thousands of steps: with the leading error of each taken out, and
    nothing left by iterations, the whole run is as right as a step of it was asked to be."""
    rng = np.random.default_rng(5)
    for _ in range(6):
        member = Stop(rng)
        q, v, *_ = member.reference()
        run = member.mechanism().simulate(
            member.q0, member.v0, member.T, 1e-2, scheme="theta", error=error
        )
        assert run.outcome == "solved"
        assert np.abs(run.q[-1] - q).max() <= error
        assert np.abs(run.v[-1] - v).max() <= error * np.abs(run.v).max()


@pytest.mark.parametrize("error", [1e-3, 1e-4])
def test_falling_rods_go_on(error):
    """Rods that fall onto an end, which then sticks, slides, turns round or jams: each run ends at
    its end, and energy is lost, never gained. An end that is hit where its gap is only closed up to
    `error` is at rest on the ground then; else the next step has to close it, and bounces."""
    for seed in range(160, 210):
        rng = np.random.default_rng(seed)
        angle, mu = rng.uniform(0.1, 1.4), rng.uniform(0.1, 1.5)
        v = [rng.uniform(-2, 2), rng.uniform(-2, 0), rng.uniform(-5, 5)]
        start = [0, np.sin(angle) / 2 + rng.uniform(0, 0.5), angle]

        def end(q):
            s, c = 0.5 * np.sin(q[2]), 0.5 * np.cos(q[2])
            return [q[1] - s], [[0, 1, -c]], [[1, 0, s]]

        mass = np.array([1, 1, 1 / 12])
        m = perp.Mechanism(3, mass=mass, force=[0, -G, 0], contacts=end, mu=mu)
        run = m.simulate(start, v, 0.6, 1e-2, scheme="theta", error=error)
        energy = 0.5 * run.v**2 @ mass + G * run.q[:, 1]
        assert run.outcome == "solved" and run.t[-1] == 0.6, seed
        # beside m g l = 10 and kinetic energies of up to 5
        assert np.all(np.diff(energy) <= 100 * error), seed


@pytest.mark.parametrize("seed", range(40))
def test_a_gap_closes_within_an_error_of_any_size(seed):
    """A ball that falls, bounces and flies on, in units of any size, with a rough error: v as in
    closed form, to a few steps' errors, and the run is solved."""
    rng = np.random.default_rng(seed)
    unit, error = 10.0 ** rng.uniform(-3, 3), 10.0 ** rng.uniform(-3, -2)
    height, e, v = unit * rng.uniform(0.1, 2), rng.uniform(0.3, 1), np.sqrt(G * unit) * rng.normal()
    ball = perp.Mechanism(
        1, force=[-G * unit], contacts=lambda q: ([q[0]], [[1.0]]), dim=1, restitution=e, law="newton"
    )
    speed = np.sqrt(v * v + 2 * G * unit * height)
    hit = (v + speed) / (G * unit) + 2 * e * speed / (G * unit)  # the second time
    back = e * e * speed
    end = hit + back / (G * unit) * rng.uniform(0.1, 1.8)
    for scheme in ("frozen", "implicit", "theta"):
        run = ball.simulate([height], [v], end, end / 20, scheme=scheme, error=error)
        assert run.outcome == "solved"
        assert run.v[-1][0] == pytest.approx(back - G * unit * (end - hit), abs=10 * error * speed)
