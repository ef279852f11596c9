"""Equilibrium, against closed forms, certificates checked by hand and other people's solvers."""

import math

import numpy as np
import pytest
import scipy.sparse as sp
from scipy.optimize import linprog

import perp

NAN, INF = float("nan"), float("inf")
UP = (0.0, 0.0, 1.0)


def point_rows(point, normal, dim=3):
    """Rows of H of a contact at `point` from a body's centre: normal, then tangents."""
    n, p = np.array(normal, dtype=float), np.array(point, dtype=float)
    if dim == 2:
        axes = [n, np.array([n[1], -n[0]])]
        return [[*a, p[0] * a[1] - p[1] * a[0]] for a in axes]
    helper = np.eye(3)[np.argmin(np.abs(n))]
    first = np.cross(n, helper)
    first /= np.linalg.norm(first)
    return [[*a, *np.cross(p, a)] for a in (n, first, np.cross(n, first))]


def box_on_slope(share, mu, heading=0.3, mass=1.7, g=9.81, size=(0.6, 0.4, 0.1)):
    """H of a box on its four corners and its weight where the slope is `share` of what mu holds."""
    corners = [(i * size[0], j * size[1], -size[2]) for i in (-1, 1) for j in (-1, 1)]
    H = np.vstack([point_rows(corner, UP) for corner in corners])
    angle = math.atan(mu * share)
    down = math.sin(angle) * np.array([math.cos(heading), math.sin(heading)])
    return H, mass * g * np.array([*down, -math.cos(angle), 0, 0, 0])


def check_balance(r, H, forces, mu, dim, G=None, tol=1e-12):
    """The impulses balance the forces beside the terms of each sum, within all cones."""
    terms, sizes = forces + H.T @ r.impulse, np.abs(forces) + np.abs(H.T) @ np.abs(r.impulse)
    if G is not None:
        terms = terms + G.T @ r.bilateral_impulse
        sizes = sizes + np.abs(G.T) @ np.abs(r.bilateral_impulse)
    # 1e-12: far above the roundings of the sums here, far below what a missing force would leave;
    # a sum of nothing but rounding counts beside the others
    sizes = np.maximum(sizes, 1e-3 * sizes.max())
    assert (np.abs(terms) <= tol * sizes).all() and 0 <= r.unbalance <= tol
    parts = r.impulse.reshape(-1, dim)
    assert (np.linalg.norm(parts[:, 1:], axis=1) <= np.asarray(mu) * parts[:, 0]).all()
    assert r.velocity is None


def check_certificate(r, H, forces, mu, dim, G=None):
    """The virtual velocity proves it: within the dual cones, against the joints, and f works."""
    assert r.verdict == "falls" and not r and r.impulse is None and r.bilateral_impulse is None
    assert np.abs(r.velocity).max() <= 1
    u = (H @ r.velocity).reshape(-1, dim)
    # entries of H and v are of order 1: what is outside by 1e-9 is rounding of the search, and
    # beside the work of f no force within the cones could gain it back
    outside = (np.asarray(mu) * np.linalg.norm(u[:, 1:], axis=1) - u[:, 0]).max()
    assert outside <= 1e-9
    work = forces @ r.velocity
    assert work > 0 and r.work == pytest.approx(work, rel=1e-6)
    if G is not None:
        assert np.abs(G @ r.velocity).max() <= 1e-9


@pytest.mark.parametrize("mu", [0.05, 0.5, 1.3])
@pytest.mark.parametrize("slack", [1e-1, 1e-3, 1e-6, 1e-9])
def test_box_on_a_slope_stands_up_to_its_friction(mu, slack):
    for heading in (0.0, 0.3, 2.0):
        H, f = box_on_slope(1 - slack, mu, heading)
        r = perp.statics(H, f, mu)
        assert r.verdict == "stands" and r
        check_balance(r, H, f, mu, 3)
        H, f = box_on_slope(1 + slack, mu, heading)
        r = perp.statics(H, f, mu)
        check_certificate(r, H, f, mu, 3)
        # it slides down: there is no other motion
        down = np.array([math.cos(heading), math.sin(heading)])
        assert r.velocity[:2] @ down >= 0.99 * np.linalg.norm(r.velocity[:2]) > 0


def table(load=(0.0, 0.0), legs=((1, 0.7), (1, -0.7), (-1, 0.7), (-1, -0.7)), height=0.8):
    """H of a table on legs, its centre `height` above the floor, and a weight of 100 at `load`."""
    H = np.vstack([point_rows((x, y, -height), UP) for x, y in legs])
    return H, np.array([0, 0, -100, -100 * load[1], 100 * load[0], 0]), np.array(legs)


def test_four_legs_carry_four_quarters():
    H, f, _ = table()
    r = perp.statics(H, f, 0.4)
    assert r.impulse[::3] == pytest.approx(25, rel=1e-12)
    assert np.abs(r.impulse.reshape(-1, 3)[:, 1:]).max() <= 1e-11
    check_balance(r, H, f, 0.4, 3)


def test_equally_stiff_legs_carry_a_plane():
    load, weight = (0.3, -0.2), 100.0
    H, f, legs = table(load)
    r = perp.statics(H, f, 0.4)
    # equal springs under a stiff plate: forces a + b x + c y with the resultant of the load
    plane = np.column_stack([np.ones(4), legs])
    found = plane @ np.linalg.solve(plane.T @ plane, weight * np.array([1, *load]))
    assert found.min() > 0
    np.testing.assert_allclose(r.impulse[::3], found, rtol=1e-10)
    # near a corner the leg across would have to pull: it lifts off, and three are determined
    H, f, legs = table((0.8, 0.5))
    r = perp.statics(H, f, 0.4)
    three = np.linalg.solve(np.vstack([np.ones(3), legs[:3].T]), weight * np.array([1, 0.8, 0.5]))
    assert three.min() > 0
    np.testing.assert_allclose(r.impulse[::3], [*three, 0], rtol=1e-9, atol=1e-9)


def test_table_tips_when_the_load_leaves_its_legs():
    for place, stands in ((0.999999, True), (1.000001, False)):
        H, f, _ = table((place, 0.0))
        assert perp.statics(H, f, 0.4).stands == stands
    # a load that tips it: the moment about the edge is zero
    H, f, _ = table((0.4, 0.0))
    load = np.array([0, 0, -1, 0, 1.5, 0])  # 1 N, half a metre outside of the legs
    r = perp.statics(H, f, 0.4, load=load)
    assert r.safety == pytest.approx(100 * (1 - 0.4) / 0.5, rel=1e-7)


@pytest.mark.parametrize("height, mu, most", [(1.5, 0.5, 100 * 0.7 / 1.5), (0.4, 0.5, 50.0)])
def test_box_pushed_sideways_tips_or_slides(height, mu, most):
    """By W b / h where that is less than mu W; b is half its width."""
    corners = [(-0.7, -0.8), (0.7, -0.8)]
    H = np.vstack([point_rows(corner, (0, 1), 2) for corner in corners])
    f, load = np.array([0.0, -100.0, 0.0]), np.array([1.0, 0.0, -(height - 0.8)])
    r = perp.statics(H, f, mu, dim=2, load=load)
    assert r.stands and r.safety == pytest.approx(most, rel=1e-7)
    for share in (1 - 1e-6, 1 + 1e-6):
        r = perp.statics(H, f + share * most * load, mu, dim=2)
        assert r.stands == (share < 1)
        if not r:
            check_certificate(r, H, f + share * most * load, mu, 2)
            tips = abs(r.velocity[2]) > 0.1 * np.abs(r.velocity).max()
            assert tips == (height == 1.5)


def ladder(angle, ground, wall, length=4.0):
    """H and coefficients of a ladder, its middle the origin."""
    x, y = length / 2 * math.cos(angle), length / 2 * math.sin(angle)
    H = np.vstack([point_rows((-x, -y), (0, 1), 2), point_rows((x, y), (-1, 0), 2)])
    return H, np.array([ground, wall])


@pytest.mark.parametrize("wall", [0.0, 0.3])
@pytest.mark.parametrize("slack", [1e-3, 1e-6, 1e-9])
def test_ladder_leans_on_a_wall(wall, slack):
    """tan(angle) = (1 - mu_ground mu_wall) / (2 mu_ground) is the least."""
    ground, f = 0.35, np.array([0, -120.0, 0])
    for share, stands in ((1 + slack, True), (1 - slack, False)):
        H, mu = ladder(math.atan(share * (1 - ground * wall) / (2 * ground)), ground, wall)
        r = perp.statics(H, f, mu, dim=2)
        assert r.stands == stands
        if stands:
            check_balance(r, H, f, mu, 2)
        else:
            check_certificate(r, H, f, mu, 2)


def test_who_climbs_a_ladder():
    """Smooth wall: the foot's friction m/2 + M s over tan(angle) is at most mu (m + M)."""
    angle, mu, weight, place, length = math.radians(62), 0.3, 120.0, 0.9, 4.0
    H, coefficients = ladder(angle, mu, 0.0, length)
    f, arm = np.array([0, -weight, 0]), (place - 0.5) * length * math.cos(angle)
    load = np.array([0, -1.0, -arm])
    slope = mu * math.tan(angle)
    r = perp.statics(H, f, coefficients, dim=2, load=load)
    assert r.safety == pytest.approx(weight * (slope - 0.5) / (place - slope), rel=1e-7)


def test_two_fingers_hold_a_box():
    """A box, and two fingers that slide towards it and push with N: 2 mu N carries it."""
    mu, push, weight = 0.4, 30.0, 9.81
    H = np.zeros((6, 8))
    H[:3, :6], H[3:, :6] = point_rows((-1, 0, 0), (1, 0, 0)), point_rows((1, 0, 0), (-1, 0, 0))
    H[0, 6], H[3, 7] = -1, 1
    f, load = np.zeros(8), np.zeros(8)
    f[6:], load[2] = (push, -push), -weight
    r = perp.statics(H, f, mu, load=load)
    assert r.stands and r.safety == pytest.approx(2 * mu * push / weight, rel=1e-7)
    assert r.impulse[::3] == pytest.approx(push, rel=1e-12)
    assert not perp.statics(H, f, mu, load=3 * load)
    # fingers that do not yield carry any weight: they can press as hard as they like
    r = perp.statics(H[:, :6], f[:6], mu, load=load[:6])
    assert r.stands and r.safety == INF


def test_no_factor_carries_a_load_that_does_not_matter():
    H, f, _ = table()
    r = perp.statics(H, f, 0.4)
    assert math.isnan(r.safety)
    assert perp.statics(H, f, 0.4, load=[0, 0, -1.0, 0, 0, 0]).safety == INF
    assert perp.statics(H, f, 0.4, load=[0, 0, 1.0, 0, 0, 0]).safety == pytest.approx(100, rel=1e-7)


def test_margin_of_one_contact():
    """r = (1, x) at mu: r_n - s = |r_t| / mu."""
    for x in (0.1, 0.3, 0.6):
        r = perp.statics(np.eye(3), [-1.0, x, 0], 0.5)
        assert r.margin == pytest.approx(1 - x / 0.5, abs=0.01)
        assert r.stands == (x < 0.5)


def test_interior_is_strictly_inside():
    H, f = box_on_slope(0.8, 0.5)
    least, interior = (perp.statics(H, f, 0.5, objective=o) for o in ("least", "interior"))
    assert least and interior
    check_balance(interior, H, f, 0.5, 3)
    parts = interior.impulse.reshape(-1, 3)
    assert (np.linalg.norm(parts[:, 1:], axis=1) < 0.5 * parts[:, 0]).all()
    assert (least.impulse**2).sum() <= (interior.impulse**2).sum() * (1 + 1e-12)


def test_rows_with_bounds_are_motors_and_limits():
    # a block on ice, held by a motor of at most 5 N and a stop
    H = np.array([[0.0, 1.0], [1.0, 0.0]])
    f, load = np.array([0.0, -10.0]), np.array([1.0, 0.0])
    r = perp.statics(H, f, 0.0, dim=1, load=load, bounds=([-5.0], [5.0]))
    assert r.stands and r.safety == pytest.approx(5, rel=1e-7)
    assert r.impulse == pytest.approx([10, -1], rel=1e-12)
    r = perp.statics(H, f, 0.0, dim=1, load=-6 * load, bounds=([-5.0], [5.0]))
    assert not r and r.velocity[0] < 0
    # the force's work, less what the motor takes at most
    assert r.work == pytest.approx((6 - 5) * abs(r.velocity[0]) - 10 * r.velocity[1], rel=1e-6)
    for way, stands in ((1, False), (-1, True)):  # a stop pushes along x only
        r = perp.statics(H, f, 0.0, dim=1, load=way * load, bounds=([0.0], INF))
        assert r.stands == stands
    # a row that needs impulses to be what they are not
    assert not perp.statics(H, f, 0.0, dim=1, bounds=([2.0], [3.0]))


def test_joints_pull_both_ways():
    # a body that hangs by two of its points, and nothing else
    G = np.array([[1.0, 0, 0], [0, 1, -1], [0, 1, 1]])
    f = np.array([3.0, -10.0, 4.0])
    r = perp.statics(np.zeros((0, 3)), f, 0.5, dim=2, bilateral=G)
    assert r.stands and len(r.impulse) == 0
    np.testing.assert_allclose(r.bilateral_impulse, np.linalg.solve(G.T, -f), rtol=1e-12)
    # on one of them it swings
    r = perp.statics(np.zeros((0, 3)), f, 0.5, dim=2, bilateral=G[:2])
    assert not r and np.abs(G[:2] @ r.velocity).max() <= 1e-12 and f @ r.velocity > 0
    # and with the floor under its right end the joint takes the rest
    H = np.array(point_rows((1, 0), (0, 1), 2))
    r = perp.statics(H, [0, -10.0, 0], 0.5, dim=2, bilateral=G[:2])
    assert r.stands
    check_balance(r, H, np.array([0, -10.0, 0]), 0.5, 2, G[:2])


@pytest.mark.parametrize("slack", [1e-3, 1e-6])
def test_rolling_and_spinning_friction(slack):
    """A ball stays on a slope up to tan(angle) = rolling / radius, and against a moment about the
    normal up to spinning N."""
    radius, mu, coefficient = 0.2, 0.6, 0.03
    rows = [*point_rows((0, 0, -radius), UP), [0, 0, 0, 1, 0, 0], [0, 0, 0, 0, 1, 0]]
    for share, stands in ((1 - slack, True), (1 + slack, False)):
        angle = math.atan(share * coefficient / radius)
        f = [math.sin(angle), 0, -math.cos(angle), 0, 0, 0]
        r = perp.statics(np.array(rows), f, mu, rolling=coefficient, bilateral=np.eye(6)[5:])
        assert r.stands == stands
        f = np.array([0, 0, -5.0, 0, 0, share * 5 * coefficient])
        H = np.array([*rows, [0, 0, 0, 0, 0, 1]])
        r = perp.statics(H, f, mu, rolling=coefficient, spinning=coefficient)
        assert r.stands == stands


def test_what_nothing_presses_carries_nothing():
    """On ice, flush with a wall: no force along the floor could press the box against it."""
    rows = [point_rows((x, -0.5), (0, 1), 2)[0] for x in (-1, 1)]
    rows += [*point_rows((1, -0.5), (-1, 0), 2), *point_rows((1, 0.5), (-1, 0), 2)]
    dims, mu = [1, 1, 2, 2], [0.0, 0.0, 0.5, 0.5]
    r = perp.statics(np.array(rows), [0, -7.0, 0], mu, dim=dims)
    assert r.verdict == "stands" and r.margin == 0
    assert r.impulse[:2] == pytest.approx(3.5, rel=1e-12)
    assert (r.impulse[2:] == 0.0).all()


@pytest.mark.parametrize("seed", range(20))
def test_where_joints_carry_all_contacts_carry_nothing(seed):
    """A lamp on a rod, beside walls that it could move away from, all at once: the normals are
    within 53 degrees of that way, further in than friction reaches."""
    rng = np.random.default_rng(seed)
    count, away = int(rng.integers(1, 5)), rng.uniform(0, 2 * np.pi)
    angles, up = away + rng.uniform(-0.9, 0.9, count), rng.uniform(-0.2, 0.2, count)
    normals = np.column_stack([np.cos(angles), np.sin(angles), up]) / np.hypot(1, up)[:, None]
    H = np.vstack([point_rows(rng.uniform(-1, 1, 3), normal) for normal in normals])
    G = np.eye(6)[2:]  # nor does it turn
    f = np.array([0, 0, -rng.uniform(0.1, 9.0), 0, 0, 0])
    r = perp.statics(H, f, rng.uniform(0, 0.4, count), bilateral=G)
    assert r.verdict == "stands" and r.margin == 0 and (r.impulse == 0.0).all()
    assert r.bilateral_impulse == pytest.approx([-f[2], 0, 0, 0], abs=1e-12)


def bodies_on_joints(rng, decades):
    """Bodies in space, their weights decades apart, contacts and ball joints between them and the
    ground, and rows of a gear that all of them drive."""
    bodies = int(rng.integers(1, 5))
    n, contacts, pairs = 6 * bodies, bodies * int(rng.integers(1, 4)) + 2, int(rng.integers(1, 4))
    f = np.zeros(n)
    f[2::6] = -(10.0 ** rng.uniform(-decades, 0, bodies))
    rows = []
    for k in range(contacts + pairs):
        b, a, row = int(rng.integers(bodies)), int(rng.integers(-1, bodies)), np.zeros((3, n))
        normal = rng.standard_normal(3) + (0, 0, 1.5 * (a < 0))
        normal /= np.linalg.norm(normal)
        row[:, 6 * b : 6 * b + 6] = point_rows(rng.uniform(-1, 1, 3), normal)
        if a not in (-1, b):
            row[:, 6 * a : 6 * a + 6] -= point_rows(rng.uniform(-1, 1, 3), normal)
        rows.append(row if k < contacts else row[: rng.integers(1, 4)])
    gears = rng.standard_normal((int(rng.integers(3)), n)) * (rng.random(n) < 0.4)
    G = np.vstack(rows[contacts:] + [gears])
    return np.vstack(rows[:contacts]), f, rng.choice([0, 0.2, 0.5, 0.8, 1.2], contacts), G


@pytest.mark.parametrize("decades", [0, 2, 4, 6, 8])
def test_joints_between_bodies_of_any_weight(decades):
    """Each answer proves itself: impulses that balance all forces, or a motion that they drive."""
    told = {"stands": 0, "falls": 0}
    for seed in range(150):
        H, f, mu, G = bodies_on_joints(np.random.default_rng([seed, decades]), decades)
        r = perp.statics(H, f, mu, bilateral=G)
        assert r.verdict in told, seed
        told[r.verdict] += 1
        if r:
            check_balance(r, H, f, mu, 3, G)
        else:
            check_certificate(r, H, f, mu, 3, G)
    assert min(told.values()) >= 10


@pytest.mark.parametrize("share", [0.9, 1 + 1e-6, 1.01, 2.0, 10.0])
def test_a_wedged_part_hides_nothing(share):
    """Between two fixed walls forces may be as large as they like; a box on a slope falls."""
    H = np.zeros((8, 6))
    H[:4, :3] = [*point_rows((-1, 0), (1, 0), 2), *point_rows((1, 0), (-1, 0), 2)]
    H[4:, 3:] = [*point_rows((-1, -0.2), (0, 1), 2), *point_rows((1, -0.2), (0, 1), 2)]
    f = np.array([0, -1.0, 0, 0.5 * share, -1.0, 0])
    r = perp.statics(H, f, 0.5, dim=2)
    assert r.verdict == ("stands" if share < 1 else "falls")
    if not r:
        check_certificate(r, H, f, 0.5, 2)
        assert r.margin < 0


@pytest.mark.parametrize("seed", range(20))
def test_forces_that_no_row_can_answer(seed):
    """Fewer rows than velocities, and a force that is no sum of them."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(4, 10))
    H, G = rng.standard_normal((2, n)), rng.standard_normal((int(rng.integers(1, n - 2)), n))
    f = rng.standard_normal(n)
    r = perp.statics(H, f, 0.5, dim=2, bilateral=G)
    check_certificate(r, H, f, 0.5, 2, G)


def test_no_forces_need_no_impulses():
    H, f, _ = table()
    r = perp.statics(H, 0 * f, 0.4)
    assert r.stands and (r.impulse == 0.0).all() and r.unbalance == 0.0
    free = perp.statics(np.zeros((0, 3)), [1.0, -2.0, 0.0], 0.4, dim=2)
    assert not free and free.velocity @ [1.0, -2.0, 0.0] > 0


def test_units_do_not_matter():
    H, f = box_on_slope(0.9, 0.5)
    base = perp.statics(H, f, 0.5)
    for scale in (2.0**-200, 2.0**-20, 2.0**300):
        r = perp.statics(H, scale * f, 0.5)
        assert r.verdict == base.verdict and r.margin == pytest.approx(base.margin, rel=1e-12)
        np.testing.assert_allclose(r.impulse, scale * base.impulse, rtol=1e-12)


def test_dense_and_sparse_agree():
    H, f = box_on_slope(0.9, 0.5)
    answers = [perp.statics(X, f, 0.5) for X in (H, np.asfortranarray(H), sp.csr_matrix(H))]
    answers.append(perp.statics(H.tolist(), f.tolist(), [0.5] * 4, dim=[3] * 4))
    for r in answers:
        assert np.array_equal(r.impulse, answers[0].impulse)


def test_answers_are_shown():
    H, f = box_on_slope(0.9, 0.5)
    r = perp.statics(H, f, 0.5, load=f)
    assert repr(r) == f"<perp.StaticsResult: stands, margin {r.margin:.3g}, safety inf>"
    assert "verdict: stands" in str(r) and r.iterations >= 1 and r.seconds >= 0
    one = perp.statics(H, f, 0.5, max_iterations=1)
    assert one.verdict in ("stands", "falls", "indeterminate")


# ---- against other people's solvers --------------------------------------------------------------


def random_problem(rng, dim, bodies=3):
    """Bodies and contacts at random, forces that lean on them more or less."""
    contacts = int(rng.integers(2 * bodies, 4 * bodies))
    n = bodies * (3 if dim == 2 else 6)
    H = rng.standard_normal((contacts * dim, n))
    mu = rng.uniform(0.1, 1.2, contacts)
    r = rng.standard_normal((contacts, dim))
    r[:, 0] = np.linalg.norm(r[:, 1:], axis=1) / mu + rng.uniform(-1.2, 1.0)
    return H, -H.T @ r.ravel(), mu, rng.standard_normal(n)


def unit(H, f):
    """What margins are told in: the largest force, each over the largest entry of its column."""
    return (np.abs(f) / np.abs(H).max(axis=0)).max()


def planar_rows(mu):
    """A r <= -s for the cones of planar contacts, r_n - s >= |r_t| / mu."""
    blocks = [sp.csc_matrix([[-1, 1 / m], [-1, -1 / m]]) for m in mu]
    return sp.block_diag(blocks).tocsc()


@pytest.mark.parametrize("seed", range(30))
def test_planar_problems_against_linear_programs(seed):
    H, f, mu, load = random_problem(np.random.default_rng(seed), 2)
    rows, n = H.shape
    size = unit(H, f)
    cones = planar_rows(mu)
    found = linprog(
        [*np.zeros(rows), -1], A_ub=sp.hstack([cones, np.ones((len(mu) * 2, 1))]),
        b_ub=np.zeros(2 * len(mu)), A_eq=np.column_stack([H.T, np.zeros(n)]), b_eq=-f / size,
        bounds=[(None, None)] * rows + [(None, 1)], method="highs",
    )  # fmt: skip
    r = perp.statics(H, f, mu, dim=2)
    if found.status == 2:  # no impulses at all, cones aside
        margin = -1.0
    else:
        assert found.status == 0
        margin = found.x[-1]
        # to a hundredth, says perp/statics.h
        assert r.margin == pytest.approx(margin, abs=1e-6 + 0.01 * abs(margin))
    assert abs(margin) > 1e-6 and r.stands == (margin > 0)
    if r:
        check_balance(r, H, f, mu, 2)
    else:
        check_certificate(r, H, f, mu, 2)

    found = linprog(
        [*np.zeros(rows), -1], A_ub=sp.hstack([cones, np.zeros((len(mu) * 2, 1))]),
        b_ub=np.zeros(2 * len(mu)), A_eq=np.column_stack([H.T, load / size]), b_eq=-f / size,
        bounds=[(None, None)] * (rows + 1), method="highs",
    )  # fmt: skip
    safety = perp.statics(H, f, mu, dim=2, load=load).safety
    if found.status == 0:
        assert safety == pytest.approx(found.x[-1], rel=1e-6, abs=1e-7)
    else:
        assert math.isnan(safety) if found.status == 2 else safety == INF


def few_rows(rng):
    """Fewer rows than coordinates or more, with bounds; forces that rows may answer, and any load:
    H, f, mu, bounds, load, of whole numbers."""
    n, contacts, limits = (int(rng.integers(1, most)) for most in (6, 6, 4))
    H = rng.integers(-2, 3, (2 * contacts + limits, n)).astype(float)
    mu = rng.choice([0.1, 0.3, 0.5, 1, 3], contacts)
    r = np.zeros(len(H))
    r[: 2 * contacts : 2] = rng.integers(0, 4, contacts)
    f = -H.T @ r if rng.random() < 0.5 else rng.integers(-3, 4, n).astype(float)
    low, high = -rng.integers(0, 3, limits).astype(float), rng.integers(0, 3, limits).astype(float)
    high[rng.random(limits) < 0.3] = INF
    return H, f, mu, (low, high), rng.integers(-2, 3, n).astype(float)


@pytest.mark.parametrize("first", range(0, 400, 100))
def test_safety_of_any_load_against_linear_programs(first):
    """The largest factor, none, or any: also of a load that rows answer with their bounds alone, or
    that is carried though f is not, and where rows do not reach f or the load."""
    told = {"number": 0, "nan": 0, "inf": 0}
    for seed in range(first, first + 100):
        H, f, mu, bounds, load = few_rows(np.random.default_rng(seed))
        contacts, limits = len(mu), len(bounds[0])
        r = perp.statics(H, f, mu, dim=2, load=load, bounds=bounds)
        cones = sp.block_diag([[[m, 1.0], [m, -1.0]] for m in mu])
        found = linprog(
            [*np.zeros(len(H)), -1], A_ub=-sp.hstack([cones, sp.csc_matrix((2 * contacts, limits + 1))]),
            b_ub=np.zeros(2 * contacts), A_eq=np.column_stack([H.T, load]), b_eq=-f,
            bounds=[*[(None, None)] * (2 * contacts), *zip(*bounds), (None, None)], method="highs",
        )  # fmt: skip
        if found.status == 0 and not math.isnan(r.safety):
            assert r.safety == pytest.approx(found.x[-1], rel=1e-6, abs=1e-6), seed  # HiGHS: 1e-7
        elif found.status == 0:  # one factor alone, or one on the edge of all cones
            assert r.margin < 1e-9, seed
        elif found.status == 3 and r.safety != INF:  # only where the load alone is on the edge
            alone = perp.statics(H[: 2 * contacts], load, mu, dim=2)
            assert math.isnan(r.safety) and not (alone.stands and alone.margin > 1e-9), seed
        elif found.status == 2:
            assert math.isnan(r.safety), seed
        told["nan" if math.isnan(r.safety) else "inf" if r.safety == INF else "number"] += 1
    assert min(told.values()) >= 5


def bodies_that_touch(rng):
    """Planar bodies, contacts between them and the ground, some without friction; forces near what
    these can carry."""
    bodies = int(rng.integers(1, 6))
    rows, mu = [], np.where(rng.random(5 * bodies) < 0.2, 0.0, rng.uniform(0.1, 1.2, 5 * bodies))
    for contact in range(len(mu)):
        b, a = contact % bodies, int(rng.integers(-1, bodies))
        angle, row = rng.uniform(0, 2 * np.pi), np.zeros((2, 3 * bodies))
        normal = np.cos(angle), np.sin(angle)
        row[:, 3 * b : 3 * b + 3] = point_rows(rng.uniform(-1, 1, 2), normal, 2)
        if a not in (-1, b):
            row[:, 3 * a : 3 * a + 3] -= point_rows(rng.uniform(-1, 1, 2), normal, 2)
        rows.append(row)
    H, r = np.vstack(rows), rng.standard_normal((len(mu), 2))
    r[:, 1] *= mu > 0
    r[:, 0] = np.where(mu > 0, np.abs(r[:, 1]) / np.maximum(mu, 0.1), 0) + rng.uniform(-0.3, 1.5)
    return H, -H.T @ r.ravel(), mu, H.T @ rng.standard_normal(len(H))


@pytest.mark.parametrize("seed", range(60))
def test_bodies_that_touch_against_linear_programs(seed):
    H, f, mu, load = bodies_that_touch(np.random.default_rng(seed))
    rows, size = len(H), np.abs(f).max()
    cones = [[[-1.0, 1 / m], [-1.0, -1 / m]] if m > 0 else [[-1.0, 0.0]] for m in mu]
    A = sp.block_diag([*map(sp.csc_matrix, cones), [[0.0]]]).tocsr()[:-1]
    free = [(None, None) if j % 2 == 0 or mu[j // 2] > 0 else (0, 0) for j in range(rows)]
    found = linprog(
        [*np.zeros(rows), -1], A_ub=A, b_ub=np.zeros(A.shape[0]),
        A_eq=np.column_stack([H.T, load / size]), b_eq=-f / size, bounds=[*free, (None, None)],
        method="highs",
    )  # fmt: skip
    if found.status != 0:  # 3: any factor; 2: none
        assert found.status in (2, 3, 4)
        safety = perp.statics(H, f, mu, dim=2, load=load).safety
        assert safety == INF if found.status == 3 else not math.isfinite(safety)
        return
    most = found.x[-1]
    # HiGHS's own tolerance is 1e-7
    for share, stands in ((-1e-5, True), (1e-5, False)):
        forces = f + (most + share * max(1.0, abs(most))) * load
        r = perp.statics(H, forces, mu, dim=2)
        if stands:
            # the least factor may be as near as the largest
            assert r.verdict in ("stands", "falls")
        else:
            check_certificate(r, H, forces, mu, 2)
    if perp.statics(H, f, mu, dim=2):
        assert most >= -1e-7
        safety = perp.statics(H, f, mu, dim=2, load=load).safety
        assert safety == pytest.approx(most, rel=1e-6, abs=1e-6)


def bodies_near_the_edge(rng):
    """Bodies in space, and forces of impulses from 1e-9 of their normals to all of them inside the
    cones; a load that rows can answer, of any size beside these forces."""
    bodies = int(rng.integers(1, 4))
    contacts = bodies + int(rng.integers(2, 6))
    H = np.zeros((3 * contacts, 6 * bodies))
    for k in range(contacts):
        a, b = int(rng.integers(bodies)), int(rng.integers(-1, bodies))
        normal = rng.normal(size=3)
        normal /= np.linalg.norm(normal)
        H[3 * k : 3 * k + 3, 6 * a : 6 * a + 6] = point_rows(rng.normal(size=3), normal)
        if b not in (-1, a):
            H[3 * k : 3 * k + 3, 6 * b : 6 * b + 6] -= point_rows(rng.normal(size=3), normal)
    mu, side = 10 ** rng.uniform(-1, 0.3, contacts), rng.normal(size=(contacts, 2))
    r = np.ones((contacts, 3)) * 10 ** rng.uniform(-2, 2, (contacts, 1))
    inside = 10 ** rng.uniform(-9, 0) * rng.uniform(0.1, 1, (contacts, 1))
    r[:, 1:] *= mu[:, None] * (1 - inside) * side / np.linalg.norm(side, axis=1)[:, None]
    return H, -H.T @ r.ravel(), mu, H.T @ rng.normal(size=len(H)) * 10 ** rng.uniform(-2, 2)


@pytest.mark.parametrize("first", range(0, 150, 30))
def test_safety_near_the_edge(first):
    """A factor of any size is found, and proofs on both sides of it say that it is the largest."""
    asked = proved = 0
    for seed in range(first, first + 30):
        H, f, mu, load = bodies_near_the_edge(np.random.default_rng(seed))
        safety = perp.statics(H, f, mu, load=load).safety
        assert safety >= -1e-12 * np.abs(f).max() / np.abs(load).max()  # f alone is carried
        # a change of forces that the verdict resolves: the edge is told to 1e-9 of them
        step = max(1e-6 * safety, 1e-9 * np.abs(f).max() / np.abs(load).max())
        if safety == INF or safety < 2 * step:
            continue
        asked += 1
        less, more = f + (safety - step) * load, f + (safety + step) * load
        inner, outer = perp.statics(H, less, mu), perp.statics(H, more, mu)
        # the least factor may be next to the largest; and where rows depend on each other, rounding
        # of the forces may leave both undecided
        assert inner.verdict != "falls" and outer.verdict != "stands"
        if outer.verdict == "falls":
            proved += 1
            check_certificate(outer, H, more, mu, 3)
        if inner:  # beside all terms: bodies that all touch each other count as one
            lacks = np.abs(less + H.T @ inner.impulse).max()
            assert lacks <= 1e-11 * (np.abs(H.T) @ np.abs(inner.impulse)).max()
    assert asked >= 10 and proved >= asked - 2


@pytest.mark.parametrize("power", [-1000, -512, 512, 1000, 1012])
def test_units_that_are_powers_of_two(power):
    """Nothing rounds otherwise: squares of these forces overflow or are 0, answers are the same."""
    for seed in range(20):
        H, f, mu, load = bodies_near_the_edge(np.random.default_rng(seed))
        one = perp.statics(H, f, mu, load=load)
        other = perp.statics(H, np.ldexp(f, power), mu, load=np.ldexp(load, power))
        assert one.verdict == other.verdict and one.margin == other.margin
        if one:
            assert (np.ldexp(one.impulse, power) == other.impulse).all()
        # where a first factor, far too large, had no double, another way leads there: to what the
        # verdict resolves of the forces, as above
        least = 1e-9 * np.abs(f).max() / np.abs(load).max()
        assert other.safety == pytest.approx(one.safety, rel=1e-8, abs=max(1e-9, least))


@pytest.mark.parametrize("dim", [2, 3])
def test_units_of_rows_change_no_verdict(dim):
    """Normals and tangents each in units up to 2^20 apart, exactly the same problem: it may be more
    than doubles can tell, but what stands never falls, and what falls never stands."""
    told = 0
    for seed in range(200):
        rng = np.random.default_rng(seed)
        H, f, mu, _ = random_problem(rng, dim, bodies=5 - dim)
        n, t = 2.0 ** rng.integers(-20, 21, (2, len(mu)))
        units = np.column_stack([n] + (dim - 1) * [t]).ravel()
        one = perp.statics(H, f, mu, dim=dim)
        other = perp.statics(units[:, None] * H, f, mu * n / t, dim=dim)
        assert other.verdict in (one.verdict, "indeterminate")
        told += other.verdict == one.verdict
    assert told >= 100


def clarabel_margin(H, f, mu, G=None):
    """The largest s with r_n - s >= |r_t| / mu in all contacts, and the least impulses; those of
    the rows of G are free."""
    clarabel = pytest.importorskip("clarabel")
    contacts, pressing = len(mu), len(H)
    H = H if G is None else np.vstack([H, G])
    rows, n = H.shape
    shares = np.repeat(mu, 3)
    shares[1::3] = shares[2::3] = 1.0
    settings = clarabel.DefaultSettings()
    settings.verbose = False
    answers = []
    for least in (False, True):
        lift = np.zeros((pressing, 1))
        lift[::3, 0] = mu
        within = -sp.diags(shares).tocsc() @ sp.eye(pressing, rows)
        A = sp.vstack([
            sp.hstack([sp.csc_matrix(H.T), np.zeros((n, 1))]), sp.hstack([within, lift]),
            sp.csc_matrix(([1.0], ([0], [rows])), shape=(1, rows + 1)),
        ]).tocsc()  # fmt: skip
        P = sp.diags([*np.full(rows, float(least)), 0.0]).tocsc()
        end = clarabel.ZeroConeT(1) if least else clarabel.NonnegativeConeT(1)
        cones = [clarabel.ZeroConeT(n), *[clarabel.SecondOrderConeT(3)] * contacts, end]
        b = np.array([*(-f / unit(H, f)), *np.zeros(pressing), 0.0 if least else 1.0])
        cost = np.array([*np.zeros(rows), 0.0 if least else -1.0])
        answer = clarabel.DefaultSolver(P, cost, A, b, cones, settings).solve()
        answers.append(np.array(answer.x))
    return answers[0][-1], answers[1][:-1] * unit(H, f)


@pytest.mark.parametrize("seed", range(30))
def test_problems_in_space_against_clarabel(seed):
    H, f, mu, _ = random_problem(np.random.default_rng(100 + seed), 3, bodies=2)
    margin, least = clarabel_margin(H, f, mu)
    r = perp.statics(H, f, mu)
    assert abs(margin) > 1e-6 and r.stands == (margin > 0)
    assert r.margin == pytest.approx(margin, abs=1e-6 + 0.01 * abs(margin))
    if r:
        check_balance(r, H, f, mu, 3)
        # Clarabel's tol is 1e-8 of the objective: half the digits of the impulses
        assert np.abs(r.impulse - least).max() <= 1e-4 * np.abs(least).max()
    else:
        check_certificate(r, H, f, mu, 3)


# ---- guides and pins -----------------------------------------------------------------------------


@pytest.mark.parametrize("slack", [1e-3, 1e-6, 1e-9])
def test_a_drawer_jams(slack):
    """Guided along x at x = +-L / 2, pulled along it h beside its middle: the guides carry h / L
    each, one this way and one that way, and hold it back by 2 mu h / L. It jams from L / (2 mu)."""
    rng, length = np.random.default_rng(3), 0.4
    for mu in rng.uniform(0.05, 1.5, 10):
        for share, jams in ((1 + slack, True), (1 - slack, False)):
            H = np.vstack([[[0, 1, x], [1, 0, 0]] for x in (length / 2, -length / 2)])
            f = np.array([1.0, 0, -share * length / (2 * mu)])
            r = perp.statics(H, f, mu, dim=2, two_sided=1, r0=[1.0, 0, -1.0, 0])
            assert r.stands == jams
            if jams:
                assert r.impulse[::2] == pytest.approx(np.array([1, -1]) / (2 * mu), rel=2e-3)
                assert (np.abs(r.impulse[1::2]) <= mu * np.abs(r.impulse[::2])).all()
            else:  # it slides along the guides
                turned = np.diag([1.0, 1, -1, 1]) @ H
                check_certificate(r, turned, f, mu, 2)
            # pressed the other way they would turn it further
            assert perp.statics(H, f, mu, dim=2, two_sided=1, r0=[-1, 0, 1, 0]).verdict == "falls"


def turned_problem(rng):
    """Contacts with friction that have one to three normals, some ordinary, in 6 velocities twice;
    the direction of each, and the ordinary contacts that press along these, with free rows."""
    contacts = int(rng.integers(4, 8))
    normals = rng.integers(0, 4, contacts)
    H, r0, cones, free = [], [], [], []
    for both in normals:
        rows = rng.standard_normal((max(both, 1) + 2, 12))
        d = rng.standard_normal(max(both, 1)) if both else np.ones(1)
        H.append(rows)
        r0 += [*d, 0, 0]
        d /= np.linalg.norm(d)
        cones += [d @ rows[: len(d)], *rows[len(d) :]]
        free += list(np.linalg.svd(d[None])[2][1:] @ rows[: len(d)])  # across d
    mu = rng.uniform(0.1, 1.2, contacts)
    cones, free = np.array(cones), np.array(free).reshape(-1, 12)
    r = rng.standard_normal((contacts, 3))
    r[:, 0] = np.linalg.norm(r[:, 1:], axis=1) / mu + rng.uniform(-1.2, 1.0)
    f = -cones.T @ r.ravel() - free.T @ rng.standard_normal(len(free))
    return np.vstack(H), f, mu, normals, np.array(r0), cones, free


@pytest.mark.parametrize("seed", range(40))
def test_guides_pins_and_ball_joints_against_clarabel(seed):
    """Rows of order 1: impulses across a direction are told to 1e-12 of all."""
    H, f, mu, normals, r0, cones, free = turned_problem(np.random.default_rng(seed))
    margin, _ = clarabel_margin(cones, f, mu, free)
    dims = np.maximum(normals, 1) + 2
    r = perp.statics(H, f, mu, dim=dims, two_sided=normals, r0=r0)
    other = perp.statics(cones, f, mu, bilateral=free)
    assert abs(margin) > 1e-6 and r.stands == other.stands == (margin > 0)
    assert r.margin == pytest.approx(margin, abs=1e-6 + 0.01 * abs(margin))
    if not r:
        return check_certificate(r, cones, f, mu, 3, free)
    ends = np.cumsum(dims)
    for part, both, m, d in zip(
        np.split(r.impulse, ends[:-1]), np.maximum(normals, 1), mu, np.split(r0, ends[:-1])
    ):
        assert np.linalg.norm(part[both:]) <= m * np.linalg.norm(part[:both])
        along = part[:both] @ d[:both] / np.linalg.norm(d)
        assert np.linalg.norm(part[both:]) <= m * along * (1 + 1e-12)
    assert np.abs(f + H.T @ r.impulse).max() <= 1e-12 * (np.abs(H.T) @ np.abs(r.impulse)).max()
    # a turned basis has the same least impulses
    assert np.linalg.norm(r.impulse) == pytest.approx(
        np.hypot(np.linalg.norm(other.impulse), np.linalg.norm(other.bilateral_impulse)), rel=1e-6
    )


# ---- refusals ------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "arguments, words",
    [
        ({"H": np.ones(6)}, ["H", "(6,)"]),
        ({"H": np.ones((12, 5))}, ["f", "(6,)", "(5,)"]),
        ({"H": np.ones((11, 6))}, ["11 rows"]),
        ({"f": np.ones(5)}, ["f", "(5,)", "(6,)"]),
        ({"load": np.ones(5)}, ["load", "(5,)", "(6,)"]),
        ({"bilateral": np.ones((1, 5))}, ["G", "5", "6"]),
        ({"mu": [0.5, 0.5]}, ["H", "12", "6"]),
        ({"mu": None}, ["mu"]),
        ({"mu": [0.5, -0.5, 0.5, 0.5]}, ["mu[1]"]),
        ({"mu": NAN}, ["mu[0]", "nan"]),
        ({"f": [0, 0, NAN, 0, 0, 0]}, ["f[2]", "nan"]),
        ({"load": [0, INF, 0, 0, 0, 0]}, ["load[1]", "inf"]),
        ({"H": np.where(np.arange(72).reshape(12, 6) == 8, NAN, 1.0)}, ["H", "nan"]),
        ({"bilateral": np.full((1, 6), INF)}, ["G", "inf"]),
        ({"dim": 4}, ["dim"]),
        ({"dim": [3, 3, 3]}, ["H", "12", "9"]),
        ({"rolling": -0.1}, ["rolling"]),
        ({"objective": "most"}, ["objective", "'most'", "'least'"]),
        ({"max_iterations": 0}, ["max_iterations"]),
        ({"bounds": ([1.0] * 3, [0.0] * 3), "mu": [0.5] * 3}, ["lower[0]", "upper[0]"]),
        ({"bounds": ([NAN] * 3, [0.0] * 3), "mu": [0.5] * 3}, ["lower[0]", "nan"]),
        ({"bounds": (np.zeros(13), INF)}, ["bounds[0]", "(13,)"]),
        ({"two_sided": [0, 1, 0, 0]}, ["two_sided[1]", "r0 does not tell"]),
        ({"two_sided": [0, 1, 0, 0], "r0": [1, 0, 0] + [0, 1, 1] * 3}, ["two_sided[1]", "r0"]),
        ({"r0": np.ones(11)}, ["r0", "(11,)", "(12,)"]),
        ({"r0": np.full(12, NAN)}, ["r0[0]", "nan"]),
    ],
)
def test_refusals(arguments, words):
    H, f, _ = table()
    with pytest.raises(perp.Error) as caught:
        perp.statics(**{"H": H, "f": f, "mu": 0.5 if "mu" not in arguments else None, **arguments})
    assert isinstance(caught.value, ValueError)
    for word in words:
        assert word in str(caught.value)


# ---- worlds --------------------------------------------------------------------------------------


def slope_world(share, mu=0.5):
    """A box on a slope of `share` of what friction holds; gravity is what leans."""
    angle = math.atan(mu * share)
    world = perp.World(gravity=(9.81 * math.sin(angle), 0, -9.81 * math.cos(angle)), friction=mu)
    world.ground.add_plane(UP)
    box = world.add_body(mass=2, position=(0, 0, 0.1))
    box.add_box((0.3, 0.2, 0.1))
    return world, box


def test_world_stands_or_falls():
    world, box = slope_world(1 - 1e-6)
    before = world.snapshot()
    r = world.statics()
    assert r.verdict == "stands" and r and r.velocities is None
    assert len(r.contacts) == 4 and {c.body_b for c in r.contacts} | {
        c.body_a for c in r.contacts
    } == {box, world.ground}
    total = np.zeros(3)
    for c in r.contacts:
        sign = 1 if c.body_b == box else -1
        total += sign * c.impulse @ np.vstack([c.normal, c.tangents])
        assert np.hypot(*c.impulse[1:]) <= 0.5 * c.impulse[0]
    np.testing.assert_allclose(total, -2 * world.gravity, rtol=1e-12, atol=1e-12)
    assert world.snapshot() == before

    world, box = slope_world(1 + 1e-6)
    r = world.statics()
    assert r.verdict == "falls" and not r and r.work > 0
    v, w = r.velocities[box]
    assert v[0] > 0.99 * np.abs(v).max() and v.shape == w.shape == (3,)


def test_world_carries_a_load():
    world, box = slope_world(0.0)
    weight = 2 * 9.81
    r = world.statics({box: (1.0, 0.0, 0.0)})
    assert r.stands and r.safety == pytest.approx(0.5 * weight, rel=1e-7)
    # tipped by a moment about y: W b
    r = world.statics({box: ((0, 0, 0), (0, 1.0, 0))})
    assert r.safety == pytest.approx(0.3 * weight, rel=1e-7)
    r = world.statics({box: (20.0, 0.0, 0.0)})
    assert r.verdict == "falls" and r.safety == pytest.approx(0.5 * weight / 20, rel=1e-7)
    box.force = (20.0, 0.0, 0.0)
    assert world.statics().verdict == "falls"


def test_planar_world():
    world = perp.World(planar=True, friction=0.5)
    world.ground.add_box((5, 0.5), offset=(-5, -0.5))
    brick = world.add_body(mass=1, position=(-0.1, 0.125))
    brick.add_box((0.5, 0.125))
    r = world.statics({brick: ((0.0, 0.0), -0.5)})  # turns it over the table's edge
    assert r.stands and r.safety == pytest.approx(9.81 * 0.1 / 0.5, rel=1e-7)
    assert r.contacts and all(c.impulse.shape == (2,) for c in r.contacts)
    assert world.statics({brick: ((0.0, 0.0), -0.5)}, objective="interior")
    assert not world.statics({brick: ((0.0, 0.0), -1.0)})
    brick.position = (0.1, 0.125)
    r = world.statics()
    v, w = r.velocities[brick]
    assert r.verdict == "falls" and v.shape == (2,) and isinstance(w, float) and w < 0


def test_world_with_joints_and_without_anything():
    world = perp.World()
    assert world.statics().verdict == "stands" and world.statics().contacts == []
    body = world.add_body(mass=1, inertia=1, position=(1, 0, 0))
    r = world.statics()
    v, _ = r.velocities[body]
    assert r.verdict == "falls" and v[2] < 0
    world.add_joint("fixed", world.ground, body)
    assert world.statics().verdict == "stands"


@pytest.mark.parametrize("room, decisions", [(24, 1), (1, 2), (0, 2)])
def test_a_world_is_decided_once(monkeypatch, room, decisions):
    """And once more where contacts are more than there was room for: four here, of two slots."""
    world, box = slope_world(0.5)
    whole, asked, call = world.statics(), [], world._call
    monkeypatch.setattr("perp._statics.CONTACTS_A_BODY", room)
    monkeypatch.setattr(world, "_call", lambda f, *x: asked.append(f.__name__) or call(f, *x))
    again = world.statics()
    assert asked.count("perp_world_statics") == decisions
    assert len(whole.contacts) == len(again.contacts) == 4
    for one, other in zip(whole.contacts, again.contacts):
        assert (one.impulse == other.impulse).all() and (one.position == other.position).all()


def test_loads_of_a_world_are_checked():
    world, box = slope_world(0.5)
    other, stranger = slope_world(0.5)
    for load, words in (
        ({stranger: (1, 0, 0)}, "this world"),
        ({"box": (1, 0, 0)}, "this world"),
        ({box: (1, 0)}, "load"),
        ({box: ((1, 0, 0), 1.0)}, "load"),
        ({box: (NAN, 0, 0)}, "nan"),
    ):
        with pytest.raises(perp.Error, match=words):
            world.statics(load)
    with pytest.raises(perp.Error, match="objective"):
        world.statics(objective="most")
    other.close()


@pytest.mark.parametrize("far", [1e1, 1e3, 1e5, 1e6, 1e7])
def test_safety_up_to_a_far_bound(far):
    """1 - s + r_0 + 3 r_1 = 0 with r_0 <= far and r_1 <= .001: s = far + 1.003, as told to 1e-8."""
    bounds = (np.array([-np.inf, -5e-4]), np.array([far, 1e-3]))
    told = perp.statics(
        np.array([[1.0], [3.0]]), np.ones(1), mu=np.zeros(0), load=-np.ones(1), bounds=bounds
    )
    assert told.safety == pytest.approx(far + 1.003, rel=1e-8)


def test_safety_of_a_load_on_the_edge_of_its_cone():
    """r_t = 3 s and r_n = 1 + 4 s are within mu = .75 for every s: no factor is the largest."""
    H = np.array([[2.0, -2.0], [-3.0, 2.0]])
    told = perp.statics(H, np.array([-2.0, 2.0]), mu=0.75, dim=2, load=np.array([1.0, 2.0]))
    assert np.isnan(told.safety) or told.safety == np.inf


def column(seed):
    """Bodies on one another, each on 1 to 4 contacts anywhere below it: H, G, f, mu. A shove, loads
    that impulses on the edges of their cones balance, and rows of joints, also twice the same."""
    rng = np.random.default_rng(seed)
    count, blocks, G = int(rng.integers(2, 12)), [], None
    masses = 10.0 ** rng.uniform(-2, 2, count)
    for a in range(count):
        below = a - 1 if rng.random() < 0.8 else -1
        for _ in range(int(rng.integers(1, 5))):
            point = np.array([*rng.uniform(-0.5, 0.5, 2), -0.5])
            normal = np.array([*rng.normal(0, 0.2, 2), 1.0])
            normal /= np.linalg.norm(normal)
            block = np.zeros((3, 6 * count))
            block[:, 6 * a : 6 * a + 6] = point_rows(point, normal)
            if below >= 0:
                opposite = -np.array(point_rows(point + (0, 0, a - below), normal))
                block[:, 6 * below : 6 * below + 6] = opposite
            blocks.append(block)
    H = np.vstack(blocks)
    mu = rng.choice([0.0, 0.3, 0.7, 1.5], len(blocks))
    f = np.zeros(6 * count)
    f[2::6] = -9.81 * masses
    if rng.random() < 0.3:
        f[rng.integers(len(f))] += rng.normal() * 10 * masses.mean()
    if rng.random() < 0.4:
        r = np.zeros((len(blocks), 3))
        r[:, 0] = np.abs(rng.normal(size=len(r))) * (rng.random(len(r)) < 0.7)
        way = rng.uniform(0, 2 * np.pi, len(r))
        edge = mu * r[:, 0] * rng.choice([0.0, 0.5, 0.99, 1.0], len(r))
        r[:, 1], r[:, 2] = edge * np.cos(way), edge * np.sin(way)
        f = -H.T @ r.ravel()
    if rng.random() < 0.5:
        G = np.zeros((int(rng.integers(1, 5)), len(f)))
        for row in G:
            a = 6 * int(rng.integers(count))
            row[a : a + 6] = rng.normal(size=6)
        G = np.vstack([G, G[:1]]) if rng.random() < 0.5 else G
    return H, G, f, mu


@pytest.mark.parametrize("first", range(0, 240, 20))
def test_columns_by_their_certificates(first):
    """Contacts that carry nothing, edges and repeated rows come together here: every answer proves
    itself. The two verdicts exclude each other, so that one with its certificate is right."""
    verdicts = []
    for seed in range(first, first + 20):
        H, G, f, mu = column(seed)
        r = perp.statics(H, f, mu, bilateral=G)
        verdicts.append(r.verdict)
        if r.verdict == "stands":
            check_balance(r, H, f, mu, 3, G)
        elif r.verdict == "falls":
            check_certificate(r, H, f, mu, 3, G)
    assert verdicts.count("indeterminate") < 10  # loads on edges have no margin


@pytest.mark.parametrize("method", ["auto", "sweep", "admm", "proximal", "lemke"])
def test_a_pushed_box_rests_where_it_may_pivot(method: str) -> None:
    """Pushed through its centre with less than mu m g; its roll and pitch are locked, so that how
    its corners share the weight is open. With equal shares, each below mu N, it rests; with all on
    one corner it may turn about that. What rests stays: by every method."""
    random = np.random.default_rng(28)
    for _ in range(40):
        width, depth, mass, mu, h = random.uniform([0.02, 0.02, 0.01, 0.1, 1e-3], [1, 1, 10, 1, 0.01])
        angle, share = random.uniform(0, 2 * np.pi), random.uniform(0.2, 0.95)
        H = [
            row
            for x in (-width, width)
            for y in (-depth, depth)
            for row in ([0, 0, 1, 0], [1, 0, 0, -y], [0, 1, 0, x])
        ]
        M = mass * np.diag([1, 1, 1, (width**2 + depth**2) / 3])
        push = share * mu * mass * 9.81
        f = h * np.array([push * np.cos(angle), push * np.sin(angle), -mass * 9.81, 0])
        result = perp.contact(M, f, np.array(H, float), mu=mu, method=method)
        assert result.outcome == "solved" and not result.v.any()


@pytest.mark.parametrize("noise", [0.0, 1e-18, -1e-17, 1e-16, 5e-16])
def test_noise_of_rows_moves_nothing(noise):
    """Entries that only rounding made: of a rod that hangs upright, and of a disc in a groove, whose
    contacts do not turn it."""
    rod = perp.statics(
        np.zeros((0, 3)), np.array([0, 0, -1.0]), 0.5, bilateral=np.array([[noise, 0, 1.0]])
    )
    assert rod.verdict == "stands"
    c, s = math.cos(0.5), math.sin(0.5)
    for other in (noise, -noise):
        H = np.array([[s, c, noise], [-s, c, other]])
        disc = perp.statics(H, np.array([0, -1.0, 0.0]), [0, 0], dim=1)
        assert disc.verdict == "stands"


def random_wedges(rng):
    """Rows, coefficients and weights of up to five wedges in notches of any slope: what presses at
    random on one below may be held, or be as tight as one likes beside what falls."""
    count = rng.integers(1, 6)
    H, mu = [], []
    for body in range(count):
        slope, friction = 10.0 ** rng.uniform(-3, 0.3), 10.0 ** rng.uniform(-2, 0.3)
        for side in (1, -1):
            if rng.random() < 0.05:
                continue
            normal = np.array([side, slope]) / np.hypot(1, slope)
            for axis in (normal, np.array([normal[1], -normal[0]])):
                row = np.zeros(3 * count)
                row[3 * body : 3 * body + 2] = axis
                if body > 0 and side == 1 and rng.random() < 0.5:
                    row[3 * body - 3 : 3 * body - 1] -= axis
                H.append(row)
            mu.append(friction)
    forces = np.zeros(3 * count)
    forces[1::3] = -(10.0 ** rng.uniform(-2, 2, count))
    return np.array(H), np.array(mu), forces


def test_wedges_are_decided():
    rng, stand = np.random.default_rng(1), 0
    for _ in range(3000):
        H, mu, forces = random_wedges(rng)
        if len(mu) == 0:
            continue
        r = perp.statics(H, forces, mu=mu, dim=2)
        if r.verdict == "stands":
            check_balance(r, H, forces, mu, 2)
            stand += 1
        else:
            check_certificate(r, H, forces, mu, 2)
    assert 500 < stand < 2500
