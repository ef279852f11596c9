"""Load-dependent friction: the counts of the theory's problem (j), and random systems against
enumeration in rational arithmetic."""

import itertools
from fractions import Fraction

import numpy as np
import pytest
import rational

import perp

J = dict(A=[[1]], b=[0], C=[[3]], d=[2], mu=[0.5])  # inertias 5/2 and -1/2

COUNTS = [
    (1, {-1: [], -2 / 3: [-2 / 3], 0: [-2, -0.4], 3: [-8, 0.8]}),
    (-1, {-1: [-0.8, 0], -2 / 3: [-2 / 3], 0: [], 3: []}),
    (0, {-2: [-1.2], -1: [-0.8, 0], -5 / 6: [-11 / 15, -1 / 3, 0], 0: [0], 1: [0], 2: [0.4]}),
]


@pytest.mark.parametrize("velocity, cases", COUNTS)
def test_scalar_counts(velocity, cases):
    for tau, expected in cases.items():
        r = perp.load_friction(velocity=[velocity], tau=[tau], **J)
        assert r.exhaustive and r.unique_for_all_tau is False
        assert r.margin == pytest.approx(2 / 3, rel=1e-15)
        assert [s.acceleration[0] for s in r] == pytest.approx(expected, rel=1e-15, abs=1e-15)
        for s in r:
            assert s.kind == ("static" if velocity == 0 and s.acceleration[0] == 0 else "dynamic")


def test_scalars_are_enough():
    r = perp.load_friction(1, 0, 3, 2, 0.1, 1.0, 0.5)
    assert r.unique_for_all_tau and len(r) == 1 and r[0].stable


def test_half_line():
    (s,) = perp.load_friction(1, 0, 2, 2, 0.5, 1.0, -1.0)
    assert s.kind == "family" and s.dimension == 1
    assert s.vertices == pytest.approx(np.array([[-1.0]]))
    assert len(s.directions) == 1 and s.directions[0][0] < 0


def test_inverse():
    r = perp.load_friction_inverse(velocity=[1], acceleration=[-2], **J)
    assert r.tau == pytest.approx([0.0]) and not r.well_posed and "unstable" in r.reason
    assert len(r.solutions) == 2
    r = perp.load_friction_inverse(velocity=[1], acceleration=[-0.4], **J)
    assert not r.well_posed and "other accelerations" in r.reason
    r = perp.load_friction_inverse(1, 0, 3, 2, 0.1, 1.0, 1.0)
    assert r.well_posed and r.reason is None and r.tau == pytest.approx([1.5])


def exact(A, b, C, d, mu, mu_static, velocity, tau):
    """All accelerations with regular patterns, as a set of tuples of Fractions, and whether a
    pattern is singular."""
    n = len(b)
    found, singular = set(), False
    starts = [(s, g) for s in (1, -1) for g in (1, -1)]
    moving = [[(0, g) for g in (1, -1)], [("stick", 0), *starts]]
    for pattern in itertools.product(*(moving[v == 0] for v in velocity)):
        K, rhs = [], []
        for i, (mode, g) in enumerate(pattern):
            if mode == "stick":
                K.append([Fraction(int(i == j)) for j in range(n)])
                rhs.append(Fraction(0))
                continue
            t = mu[i] * g * (mode or (1 if velocity[i] > 0 else -1))
            K.append([A[i][j] + t * C[i][j] for j in range(n)])
            rhs.append(tau[i] - b[i] - t * d[i])
        x = rational.solve(K, rhs)
        if x is None:
            singular = True
            continue
        normal = [sum(c * y for c, y in zip(C[i], x)) + d[i] for i in range(n)]
        for i, (mode, g) in enumerate(pattern):
            if mode == "stick":
                f = tau[i] - b[i] - sum(a * y for a, y in zip(A[i], x))
                if abs(f) > mu_static[i] * abs(normal[i]):
                    break
            elif g * normal[i] < 0 or (mode and mode * x[i] <= 0):
                break
        else:
            found.add(tuple(x))
    return found, singular


def fractions(array):
    return [fractions(row) if np.ndim(row) else Fraction(float(row)) for row in array]


@pytest.mark.parametrize("n, count", [(1, 150), (2, 80), (3, 40)])
def test_random_systems(n, count):
    """Small integers: normal forces of exactly 0, limits of static friction that are met exactly,
    coordinates at rest. Every answer is there, once, and nothing else."""
    rng = np.random.default_rng(n)
    counts, singular = {}, 0
    for _ in range(count):
        L = rng.integers(-2, 3, (n, n))
        A = L @ L.T + np.eye(n, dtype=int)
        C, d, b, tau = (rng.integers(-3, 4, size) for size in ((n, n), n, n, n))
        mu = rng.integers(0, 5, n) / 4
        mu_static = mu + rng.integers(0, 2, n) / 4
        velocity = rng.integers(-1, 2, n)
        case = A, b, C, d, mu, mu_static, velocity, tau
        expected, is_singular = exact(*map(fractions, case))
        r = perp.load_friction(A, b, C, d, mu, velocity.astype(float), tau, mu_static)
        assert r.exhaustive
        if is_singular:
            singular += 1
            continue
        points = sorted([float(x) for x in point] for point in expected)
        assert len(r) == len(points), case
        # components of the answers are small fractions: 1e-13 is a hundred roundings
        got = sorted(s.acceleration.tolist() for s in r)
        for x in points:
            distance = min(np.max(np.abs(np.array(x) - y)) for y in got)
            assert distance <= 1e-13 * (1 + max(map(abs, x)))
        if r.unique_for_all_tau:
            assert len(r) == 1, case
        counts[len(r)] = counts.get(len(r), 0) + 1
    assert len(counts) >= 3 and counts[1] > 0 and singular < count


def violation(A, b, C, d, mu, mu_static, velocity, tau, x):
    """By how much x misses the friction law, relatively."""
    normal, f = np.abs(C @ x + d), tau - b - A @ x
    sign = np.where(velocity != 0, velocity, np.sign(np.where(np.abs(x) < 1e-9, 0, x)))
    error = np.where(sign != 0, np.abs(f - mu * normal * sign), np.abs(f) - mu_static * normal)
    return max(0, np.max(error / (1 + np.abs(A) @ np.abs(x))))


def test_families():
    """Systems with effective inertias of 0: every point of a family is an answer, every answer
    with a regular pattern is there or lies in a family, nothing is there twice."""
    nnls = pytest.importorskip("scipy.optimize").nnls
    rng = np.random.default_rng(1)
    families = 0
    for _ in range(250):
        n = int(rng.integers(1, 4))
        A = np.diag(rng.integers(1, 3, n))
        C, b, d = rng.integers(-2, 3, (n, n)), np.zeros(n), rng.integers(-2, 3, n)
        if rng.random() < 0.5:
            C = np.diag(np.diag(C))
        mu, velocity = rng.choice([0, 0.5, 1, 2], n), rng.integers(-1, 2, n)
        mu_static = mu + rng.integers(0, 2, n) / 2
        x = rng.integers(-2, 3, n)  # has often a normal force of 0, the vertex of a family
        tau = A @ x + mu * np.where(velocity != 0, velocity, np.sign(x)) * np.abs(C @ x + d)
        case = A, b, C, d, mu, mu_static, velocity, tau
        expected, is_singular = exact(*map(fractions, case))
        if not is_singular:
            continue
        r = perp.load_friction(A, b, C, d, mu, velocity.astype(float), tau, mu_static)
        for s in r:
            weights = rng.dirichlet(np.ones(len(s.vertices)), 4)
            factors = rng.exponential(3, (4, len(s.directions)))
            inner = weights @ s.vertices + factors @ s.directions
            for point in [s.acceleration, *s.vertices, *inner]:
                # families are found to nine digits
                assert violation(*case, point) < 1e-8, case
            families += s.kind == "family"
            assert s.dimension == 0 or not s.stable
        for point in expected:
            point, inside = np.array([float(y) for y in point]), 0
            for s in r:
                hull = np.vstack([np.ones(len(s.vertices)), s.vertices.T])
                cone = np.vstack([np.zeros(len(s.directions)), s.directions.T])
                inside += nnls(np.hstack([hull, cone]), np.append(1, point))[1] < 1e-8
            assert inside > 0, case
        isolated = [s.acceleration for s in r if s.dimension == 0]
        for i, x in enumerate(isolated):
            assert all(np.max(np.abs(x - y)) > 1e-9 for y in isolated[:i]), case
    assert families > 20


@pytest.mark.parametrize(
    "change, text",
    [
        (dict(A=[[-1]]), "A is not positive definite"),
        (dict(mu=[-1]), "mu"),
        (dict(tau=[float("nan")]), "tau"),
        (dict(velocity=[1, 2]), "velocity has shape"),
        (dict(C=np.ones((2, 2))), "C has shape"),
        (dict(mu_static=[0.1]), "mu_static"),
        (
            dict(A=np.ones((0, 0)), C=np.ones((0, 0)), b=[], d=[], mu=[], velocity=[], tau=[]),
            "n is 0",
        ),
    ],
)
def test_refusals(change, text):
    with pytest.raises(ValueError, match=text):
        perp.load_friction(**{**J, "velocity": [1], "tau": [0], **change})


def test_steps():
    """The sets of the theory's implicit stepping, v = 1 and h = 1e-3; jams; `previous`."""
    for tau, expected in ((-1, [0]), (-2 / 3, [0, 1499 / 1500]), (0, [0, 499 / 500, 2499 / 2500])):
        r = perp.load_friction_step(velocity=[1], tau=[tau], h=1e-3, **J)
        assert [1 + 1e-3 * s.acceleration[0] for s in r.solutions] == pytest.approx(
            expected, rel=1e-15, abs=1e-15
        )
        assert r.jam == (tau < 0) and r.stable and r.exhaustive
        assert r.velocity[0] == (0.0 if tau < 0 else pytest.approx(expected[-1]))
        assert r.solutions[r.chosen].modes == (["stopped"] if tau < 0 else ["slide"])
    for previous, jam in ((0.5, False), (-3.9, False), (-4.1, True)):
        r = perp.load_friction_step(velocity=[1], tau=[0], h=1e-3, previous=[previous], **J)
        assert r.jam == jam and (r.normal_force[0] < 0) == jam


def screw(stiffness, damping=0.0, torque=0.0):
    """The lead screw of the theory's problem (k)."""
    s, c, r = np.sin(np.pi / 36), np.cos(np.pi / 36), 0.01
    return perp.Compliant(
        np.diag([2e-5, 50]), [[r * s, -c]], [[r * c, s]], 0.2, stiffness, damping, [torque, -100]
    )


def test_compliant_screw():
    """Eigenvalues and times of reference_output.txt, which has the digits given here."""
    compliant, c, pitch = screw(1e9, 1e4), np.cos(np.pi / 36), 0.01 * np.tan(np.pi / 36)
    good, bad = compliant.linearise(1, 1), compliant.linearise(1, -1)
    assert good.stable
    assert good.eigenvalues.real == pytest.approx([-721.527437388666] * 2, rel=1e-13)
    assert not bad.stable and not bad.flutter
    assert bad.growth == pytest.approx(5497.54859542658, rel=1e-13)
    N = -69.547005614481321 * 1.001
    run = compliant.run([0, -N / 1e9 / c], [10, 10 * pitch], 0.02, samples=50)
    assert run.end == "stopped" and run.contact == 0
    assert run.t == pytest.approx(0.0016688277341284424, rel=1e-7)
    assert run.samples.shape == (5, 6)  # of 0.4 ms, the last one short
    run = screw(1e8, torque=-0.1).run([0, 1e-8 / c], [10, 10 * pitch], 0.05)
    assert run.t == pytest.approx(0.0011570925232247487, rel=1e-7)


def test_compliant_through():
    """One coordinate falls on a spring and slides until its friction has stopped it; a scalar
    one_sided, samples within stick, and what the run tells of its end."""
    k, g, v = 1e4, 10.0, 3.0
    block = perp.Compliant(np.eye(2), [[0, -1]], [[1, 0]], 0.25, k, 200.0, [0, -g],
                           mu_static=0.5, one_sided=True)
    run = block.run([0, 0.01], [v, 0], 5.0, through=True, samples=10)
    assert run.end == "time" and run.modes == ["stick"] and run.stops == 1 and run.releases <= 3
    assert run.v[0] == 0.0 and run.samples[-1, 3] == 0.0 and run.samples[-1, 1] == run.x[0]
    assert run.normal_force == pytest.approx([g], rel=1e-9)
    assert run.friction == pytest.approx([0.0], abs=1e-9)
    assert block.run([0, -g / k], [0, 0], 1.0, through=True).v[0] == 0.0


def test_samples_do_not_tighten_the_error():
    """What sticks swings less and less: recorded in pieces the run keeps its scale, so it takes
    the same steps and at most three more a piece, to end there and to grow again."""
    k, g = 1e4, 10.0
    block = perp.Compliant(np.eye(2), [[0, -1]], [[1, 0]], 0.25, k, 20.0, [0, -g], mu_static=0.5)
    whole = block.run([0, 0.0], [0, 0], 4.0, through=True)
    parts = block.run([0, 0.0], [0, 0], 4.0, through=True, samples=20)
    assert parts.steps <= whole.steps + 3 * 20
    # exact: y + g/k = g/k exp(-10 t) (...), by which all has decayed at 2
    assert parts.samples[9:, 2] == pytest.approx([-g / k] * 11, rel=1e-7)


def test_compliant_refusals():
    with pytest.raises(ValueError, match="does not slide"):
        screw(1e9).run([0, 0], [0, 0], 1.0)
    with pytest.raises(ValueError, match="stiffness"):
        screw(-1.0)
    with pytest.raises(ValueError, match="normal has shape|tangent has shape"):
        perp.Compliant(np.eye(2), [[1, 0]], [[1, 0, 0]], 0.1, 1.0)


def test_large_systems_say_that_they_were_not_enumerated():
    n = 30
    r = perp.load_friction(np.eye(n), 0, 3 * np.eye(n), 2, 0.5, 1.0, 0.0, starts=8)
    assert not r.exhaustive and not r.margin_exact and r.unique_for_all_tau is False and len(r) > 1
    r = perp.load_friction(np.eye(n), 0, 3 * np.eye(n), 2, 0.3, 1.0, 0.0, starts=8)
    assert r.exhaustive and r.unique_for_all_tau is True and len(r) == 1  # monotone: 1 > 0.9
    assert r.margin == pytest.approx(1 / 0.9, rel=1e-6)


def test_limits_of_enumeration():
    """Blocks of (j): every one of the 2^n patterns has an answer, and one is stable."""
    n = 8
    r = perp.load_friction(np.eye(n), 0, 3 * np.eye(n), 2, 0.5, 1.0, 0.0)
    assert r.exhaustive and len(r) == 2**n and sum(s.stable for s in r) == 1


## A system that is kept


def same(one, other):
    """In all fields, to the last bit; nan is itself."""
    assert type(one) is type(other)
    for name, value in vars(one).items():
        if name == "solutions":
            assert len(value) == len(other.solutions)
            for pair in zip(value, other.solutions):
                same(*pair)
        else:
            np.testing.assert_array_equal(value, getattr(other, name))


@pytest.mark.parametrize("velocity", [[1.0, -1.0], [0.0, 1.0], [0.0, 0.0]])
def test_kept(velocity):
    """A handle says what the functions say, one question after the other, to the last bit."""
    rng = np.random.default_rng(4)
    system = 3 * np.eye(2), rng.normal(size=2), rng.normal(size=(2, 2)), rng.normal(size=2), 0.6
    with perp.LoadFriction(*system, mu_static=0.7) as kept:
        for tau in ([0.5, 1.0], [3.0, -2.0], [0.0, 0.1]):
            same(kept.solve(velocity, tau), perp.load_friction(*system, velocity, tau, 0.7))
            one = perp.load_friction_step(*system, velocity, tau, 1e-2, 0.7)
            same(kept.step(velocity, tau, 1e-2, solutions=True), one)
            bare = kept.step(velocity, tau, 1e-2, previous=one.normal_force)
            assert bare.solutions == [] and (bare.velocity == one.velocity).all()
        other = perp.load_friction_inverse(*system, velocity, [0.0, 0.3], 0.7)
        same(kept.inverse(velocity, [0.0, 0.3]), other)


def test_kept_takes_another_system():
    kept = perp.LoadFriction(1.0, 0.0, 3.0, 2.0, 0.1)
    assert kept.solve(1.0, 0.0).unique_for_all_tau
    kept.update(**J)
    r = kept.solve(1.0, 0.0)
    assert r.unique_for_all_tau is False and len(r) == 2
    with pytest.raises(perp.Error, match="mu"):
        kept.update(1.0, 0.0, 3.0, 2.0, -0.1)
    assert len(kept.solve(1.0, 0.0)) == 2  # the one before
    with pytest.raises(perp.Error, match=r"tau has shape \(2,\), expected \(1,\)"):
        kept.step(1.0, [1.0, 2.0], 1e-3)
    kept.close()
    with pytest.raises(perp.Error, match="LoadFriction has been closed"):
        kept.solve(1.0, 0.0)


def test_kept_jams_and_goes_back():
    """The scalar machine, pulled back: 0.0 in one step; then from rest, with its memory."""
    kept, N = perp.LoadFriction(**J), None
    step = kept.step(1.0, -1.0, 1e-3)
    assert step.jam and step.velocity[0] == 0.0
    v, N = step.velocity, step.normal_force
    for k in range(1, 4):  # at tau = -2 from rest x = -6/5 alone (theory.md), in steps of 1e-3
        step = kept.step(v, -2.0, 1e-3, previous=N)
        v, N = step.velocity, step.normal_force
        assert v[0] == pytest.approx(-1.2e-3 * k, rel=1e-13)
