"""Frictional contact over dynamics that Python hands over."""

import numpy as np
import pytest
import scipy.sparse as sp

import perp
from perp import _generated, _library, _settings, _structures

EPS = np.finfo(float).eps
NAN = float("nan")


def random_dynamics(seed, n=9, contacts=4, dim=3):
    """A body that falls onto contacts in general position."""
    rng = np.random.default_rng(seed)
    A = rng.standard_normal((n, n))
    M = A @ A.T + np.eye(n)
    H = rng.standard_normal((contacts * dim, n))
    return M, rng.standard_normal(n), H, np.zeros(contacts * dim), rng.uniform(0.1, 1, contacts)


def check_law(r, mu, dim, scale):
    """Signorini and Coulomb, in other words than the library's."""
    for k, (p, u) in enumerate(zip(r.impulse.reshape(-1, dim), r.velocity.reshape(-1, dim))):
        assert p[0] >= 0 and u[0] >= -scale
        assert min(p[0], u[0]) <= scale
        pt, ut = p[1:], u[1:]
        assert np.linalg.norm(pt) <= mu[k] * p[0] * (1 + 4 * EPS)
        # power lost to friction is the most that the cone allows
        assert abs(pt @ ut + mu[k] * p[0] * np.linalg.norm(ut)) <= scale
        if r.modes[k] == "separate":
            assert (p == 0).all()
        if r.modes[k] == "stick":
            assert (u == 0).all()


@pytest.mark.parametrize("method", ["auto", "newton", "sweep"])
@pytest.mark.parametrize("seed", range(8))
def test_law_and_dynamics_hold(method, seed):
    M, f, H, w, mu = random_dynamics(seed)
    tol = 1e-8 if method == "sweep" else 1e-12  # 12 rows on 9 coordinates: sweeps are slow
    r = perp.contact(M, f, H, w, mu, method=method, tol=tol)
    assert r.ok
    check_law(r, mu, 3, 100 * tol)  # numbers of order 1 to 100
    assert np.abs(M @ r.v - f - H.T @ r.impulse).max() <= 1e-12 * np.abs(M).max()
    assert np.abs(H @ r.v + w - r.velocity).max() <= 100 * tol
    # without contact the energy in terms of M is f M^-1 f / 2; inelastic contact only takes
    assert r.v @ M @ r.v <= f @ np.linalg.solve(M, f) * (1 + tol)


@pytest.mark.parametrize("method", ["auto", "proximal"])
@pytest.mark.parametrize(
    "friction", [[1e-2], [1e-4], [1e-8, 1e-12], [0.0, 1e-10, 0.5], [1e-100, 1.0], [0.1, 0.8]]
)
def test_ice(friction, method):
    """Chains of rigid bodies on contacts that hardly rub, some beside others that do."""
    for seed in range(6):
        rng = np.random.default_rng(seed)
        bodies = (3, 10)[seed % 2]
        contacts, n = 6 * bodies, 6 * bodies
        blocks = rng.standard_normal((bodies, 6, 6))
        M = sp.block_diag([A @ A.T + np.eye(6) for A in blocks]).tocsc()
        H, mu = np.zeros((3 * contacts, n)), rng.choice(friction, contacts)
        for k in range(contacts):
            b = int(rng.integers(bodies))
            H[3 * k : 3 * k + 3, 6 * b : 6 * b + 6] = rng.standard_normal((3, 6))
            if b > 0 and rng.random() < 0.8:
                H[3 * k : 3 * k + 3, 6 * b - 6 : 6 * b] = rng.standard_normal((3, 6))
        f = M @ rng.standard_normal(n)
        r = perp.contact(M, f, sp.csr_matrix(H), None, mu, method=method, tol=1e-10)
        assert r.ok, seed
        # products of impulses and speeds, each known to 1e-10 of the largest
        check_law(r, mu, 3, 1e-8 * max(1.0, np.abs(r.impulse).max() * np.abs(r.velocity).max()))
        assert np.abs(M @ r.v - f - H.T @ r.impulse).max() <= 1e-10 * np.abs(r.impulse).max()


@pytest.mark.parametrize("n", [90, 97, 132, 256, 260])
def test_more_rows_than_many_velocities(n):
    """From 97 to 256 velocities W is half made only then; the law and the balance hold all the same,
    and what is felt does not depend on how M is given."""
    contacts = n // 2
    M, f, H, w, mu = random_dynamics(n, n, contacts)
    M /= n
    given = M, sp.csc_matrix(M)
    answers = [perp.contact(M_, f, H, w, mu, method="newton") for M_ in given]
    for r in answers:
        assert r.ok
        check_law(r, mu, 3, 1e-6)  # tol 1e-8, numbers of order 1 to 100
        assert np.abs(M @ r.v - f - H.T @ r.impulse).max() <= 1e-11 * np.abs(r.impulse).max()
    np.testing.assert_allclose(answers[0].v, answers[1].v, atol=1e-6)


def test_dense_sparse_and_callback_agree():
    M, f, H, w, mu = random_dynamics(3)
    inverse = np.linalg.inv(M)
    answers = [
        perp.contact(M_, f, H_, w, mu, tol=1e-12)
        for M_ in (M, np.asfortranarray(M), sp.csc_matrix(M), lambda x: inverse @ x)
        for H_ in (H, sp.csr_matrix(H))
    ]
    W = H @ inverse @ H.T
    for W_ in (W, sp.coo_matrix(W)):
        answers.append(perp.contact_delassus(W_, H @ inverse @ f + w, mu, tol=1e-12))
    for r in answers:
        assert r.ok
        assert np.abs(r.impulse - answers[0].impulse).max() <= 1e-10
        assert (r.modes == answers[0].modes).all()


@pytest.mark.parametrize("dim", [1, 2, 3])
def test_one_contact_in_every_mode(dim):
    W = np.eye(dim)
    r = perp.contact_delassus(W, [0.5, 1, 0][:dim], 0.5, dim=dim)
    assert r.modes == ["separate"] and (r.impulse == 0).all() and r.velocity[0] == 0.5
    r = perp.contact_delassus(W, [-1, 0.25, 0][:dim], 0.5, dim=dim)
    assert r.modes == ["stick"] and (r.velocity == 0).all()
    if dim > 1:
        r = perp.contact_delassus(W, [-1, 2, 0][:dim], 0.5, dim=dim, tol=1e-12)
        assert r.modes == ["slip"] and r.velocity[0] == 0
        assert r.velocity[1] == pytest.approx(1.5, abs=1e-12)


def test_polyhedron_loses_a_cosine():
    """Sliding between two vertices of a k-gon: the force along the slip is mu cos(pi / k)."""
    for k in (4, 8, 16):
        angle = np.pi / k
        # slip along a normal of an edge; both vertices serve, the sum of their shares is free
        q = [-1, 2 * np.cos(angle), 2 * np.sin(angle)]
        r = perp.contact_delassus(np.eye(3), q, 0.5, cone=k, tol=1e-12)
        assert r.ok and r.method == "lemke"
        along = np.array([np.cos(angle), np.sin(angle)])
        assert -r.impulse[1:] @ along == pytest.approx(0.5 * np.cos(np.pi / k), abs=1e-12)


def test_answer_turns_with_the_tangents():
    M, f, H, w, mu = random_dynamics(5)
    base = perp.contact(M, f, H, w, mu, tol=1e-12)
    c, s = np.cos(0.7), np.sin(0.7)
    turn = np.kron(np.eye(4), np.array([[1, 0, 0], [0, c, s], [0, -s, c]]))
    turned = perp.contact(M, f, turn @ H, turn @ w, mu, tol=1e-12)
    assert (base.modes == turned.modes).all()
    assert np.abs(turn @ base.impulse - turned.impulse).max() <= 1e-10
    assert np.abs(base.v - turned.v).max() <= 1e-10


def test_joints_and_mixed_dimensions():
    M, f, H, w, mu = random_dynamics(6)
    G, b = np.random.default_rng(1).standard_normal((2, 9)), np.array([0.25, -0.5])
    dims = [3, 1, 2, 3]
    H, w = H[:9], w[:9]
    r = perp.contact(M, f, H, w, mu, dim=dims, bilateral=(G, b), tol=1e-12)
    assert r.ok and len(r.impulse) == 9 and len(r.bilateral_impulse) == 2
    assert np.abs(G @ r.v + b).max() <= 1e-10
    residual = M @ r.v - f - H.T @ r.impulse - G.T @ r.bilateral_impulse
    assert np.abs(residual).max() <= 1e-12 * np.abs(M).max()


def test_compliance_is_a_spring():
    # u = r + q + c r = 0 at r = 1 / (1 + c)
    r = perp.contact_delassus([[1.0]], [-1.0], 0.0, dim=1, compliance=3.0)
    assert r.impulse[0] == 0.25 and r.velocity[0] == 0.0


def test_opposed_walls_have_no_solution():
    H = np.array([[1.0], [-1.0]])
    for M in ([[2.0]], lambda x: x / 2):
        r = perp.contact(M, [0.0], H, [-1.0, -1.0], 0.0, dim=1)
        assert r.outcome == "ray" and not r.ok and r.certificate == "infeasible"
        assert (r.ray == [1, 1]).all()


def test_start_and_monitor():
    M, f, H, w, mu = random_dynamics(7)
    r = perp.contact(M, f, H, w, mu, tol=1e-10)
    again = perp.contact(M, f, H, w, mu, r0=r.impulse, tol=1e-10)
    assert again.ok and again.method == "polish" and again.iterations == 0
    seen = []
    stopped = perp.contact(M, f, H, w, mu, tol=1e-12, monitor=lambda p: seen.append(p) or True)
    assert stopped.outcome == "stopped" and len(seen) == 1

    def fail(progress):
        raise KeyError("monitor")

    with pytest.raises(KeyError, match="monitor"):
        perp.contact(M, f, H, w, mu, monitor=fail)


def test_a_start_of_zeros_is_none():
    M, f, H, w, mu = random_dynamics(5)
    for method in ("auto", "proximal", "sweep"):
        cold = perp.contact(M, f, H, w, mu, method=method)
        again = perp.contact(M, f, H, w, mu, method=method, r0=np.zeros(len(w)))
        assert again.iterations == cold.iterations
        assert (again.impulse == cold.impulse).all()


def test_exceptions_in_the_mass_solve_come_through():
    _, f, H, w, mu = random_dynamics(7)

    def fail(x):
        raise RuntimeError("no factor")

    with pytest.raises(RuntimeError, match="no factor"):
        perp.contact(fail, f, H, w, mu)
    with pytest.raises(ValueError, match="shape"):
        perp.contact(lambda x: x[:, 0], f, H, w, mu)
    with pytest.raises(ValueError, match="nan"):
        perp.contact(lambda x: x * NAN, f, H, w, mu)


GOOD = {
    "M": np.eye(3),
    "f": np.array([0.0, 0.0, -1.0]),
    "H": np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]]),
    "w": np.zeros(3),
    "mu": [0.5],
}


@pytest.mark.parametrize(
    "arguments, words",
    [
        ({"M": np.ones((2, 2))}, ["M", "2 by 2", "3 by 3"]),
        ({"M": np.diag([1.0, -1, 1])}, ["M(1,1)", "definite"]),
        ({"M": np.array([[1.0, 2, 0], [2, 1, 0], [0, 0, 1]])}, ["M", "definite"]),
        ({"M": np.array([[1.0, 0.5, 0], [0, 1, 0], [0, 0, 1]])}, ["M(0,1)", "symmetric"]),
        ({"M": np.eye(3) * NAN}, ["M(0,0)", "nan"]),
        ({"f": [0.0, 0, NAN]}, ["f[2]", "nan"]),
        ({"w": [0.0, 0]}, ["w", "(2,)", "(3,)"]),
        ({"w": [0.0, 0, NAN]}, ["w[2]"]),
        ({"H": np.eye(2)}, ["w", "(3,)", "(2,)"]),
        ({"H": np.array([[0.0, 0], [1, 0], [0, 1]])}, ["H", "columns"]),
        ({"H": np.zeros((3, 3))}, ["contact 0", "moves nothing"]),
        ({"mu": [-0.5]}, ["mu[0]", "-0.5"]),
        ({"mu": [NAN]}, ["mu[0]", "nan"]),
        ({"mu": [0.5, 0.5]}, ["H", "3 rows", "6"]),
        ({"dim": 4}, ["dim", "4"]),
        ({"dim": [3, 3]}, ["dim", "2 entries"]),
        ({"dim": 2.0}, ["dim"]),
        ({"rolling": -1.0}, ["rolling[0]"]),
        ({"rolling": 1.0}, ["H", "3 rows", "5"]),
        ({"spinning": 1.0, "dim": [2], "mu": 0.0}, ["spinning[0]", "dimension 2"]),
        ({"compliance": -1.0}, ["compliance[0]"]),
        ({"compliance": [1.0]}, ["compliance", "(1,)"]),
        ({"r0": [1.0]}, ["r0"]),
        ({"r0": [0.0, NAN, 0.0]}, ["r0[1]"]),
        ({"bilateral": (np.ones((1, 2)), [0.0])}, ["G", "columns"]),
        ({"bilateral": (np.zeros((1, 3)), [0.0])}, ["bilateral row 0"]),
        ({"bilateral": (np.ones((1, 3)), [NAN])}, ["b[0]"]),
        ({"cone": 2}, ["cone", "2"]),
        ({"cone": "round"}, ["cone", "round"]),
        ({"cone": 8, "method": "newton"}, ["cone", "newton"]),
        ({"cone": 5000}, ["cone", "1024"]),
        ({"method": "pgs"}, ["method", "'newton'"]),
        ({"method": "polish"}, ["method"]),
        ({"tol": 0.0}, ["tol"]),
        ({"time_limit": 0.0}, ["time_limit"]),
        ({"max_iterations": 0}, ["max_iterations"]),
    ],
)
def test_refusals(arguments, words):
    with pytest.raises(ValueError) as info:
        perp.contact(**{**GOOD, **arguments})
    for word in words:
        assert word in str(info.value)


def robot(seed):
    """Two contacts in space, a limit, a motor and an equation over nine velocities."""
    random = np.random.default_rng(seed)
    A, H, G = random.normal(size=(9, 9)), random.normal(size=(8, 9)), random.normal(size=(1, 9))
    f, w, b = random.normal(size=9), random.normal(size=8), random.normal(size=1)
    return A @ A.T + np.eye(9), H, G, f, w, b, (np.array([0.0, -0.2]), np.array([np.inf, 0.2]))


def check_robot(problem, mu, r):
    """Equations and laws, recomputed; eight digits are what tol asks for."""
    M, H, G, f, w, b, (lower, upper) = problem
    assert np.allclose(M @ r.v, f + H.T @ r.impulse + G.T @ r.bilateral_impulse, atol=1e-9)
    u = H @ r.v + w
    assert np.allclose(u, r.velocity, atol=1e-7)
    assert np.allclose(G @ r.v + b, 0.0, atol=1e-7)
    x, y = r.impulse[6:], u[6:]
    assert np.allclose(x, np.clip(x - y, lower, upper), atol=1e-6)
    for k in (0, 3):
        s = mu * np.hypot(u[k + 1], u[k + 2])
        d = r.impulse[k : k + 3] - u[k : k + 3] - [s, 0.0, 0.0]
        n, t = d[0], np.hypot(d[1], d[2])
        if t <= mu * n:
            nearest = d
        elif mu * t <= -n:
            nearest = np.zeros(3)
        else:
            n = (n + mu * t) / (1 + mu * mu)
            nearest = np.array([n, *(d[1:] / t * mu * n)])
        assert np.allclose(r.impulse[k : k + 3], nearest, atol=1e-6)


def test_rows_with_bounds():
    words = set()
    for seed in range(40):
        problem = M, H, G, f, w, b, bounds = robot(seed)
        r = perp.contact(M, f, H, w, 0.5, bilateral=(G, b), bounds=bounds)
        assert r.ok and len(r.modes) == 4
        check_robot(problem, 0.5, r)
        words |= set(r.modes[2:])
        assert (r.velocity[6:][r.modes[2:] == "stick"] == 0.0).all()
        X = np.vstack([H, G])
        W, q = X @ np.linalg.solve(M, X.T), X @ np.linalg.solve(M, f) + np.append(w, b)
        same = perp.contact_delassus(W, q, 0.5, bilateral=1, bounds=bounds)
        assert same.ok and np.allclose(same.impulse, r.impulse, atol=1e-6)
        assert (same.modes == r.modes).all()
    assert words == {"lower", "stick", "upper"}


def test_solver_keeps_set_up_and_start():
    problem = M, H, G, f, w, b, bounds = robot(3)
    with perp.ContactSolver(M, H, 0.5, bilateral=G, bounds=bounds) as solver:
        first = solver.solve(f, w, b)
        check_robot(problem, 0.5, first)
        again = solver.solve(f, w, b)
        assert again.ok and again.method == "polish"  # the start was the answer
        cold = solver.solve(f, w, b, r0=0.0)
        assert cold.method == first.method and (cold.impulse == first.impulse).all()
        changed = (M, H, G, 1.1 * f, w - 0.1, b, bounds)
        check_robot(changed, 0.5, solver.solve(1.1 * f, w - 0.1, b))
        M *= 2.0  # read in place
        solver.setup(M, H, 0.5, bilateral=G, bounds=bounds)
        check_robot((M, H, G, f, w, b, bounds), 0.5, solver.solve(f, w, b))
        solver.setup(M, H[:3], 0.5)  # other sizes
        assert solver.solve(f, w[:3]).ok
        with pytest.raises(ValueError, match="definite"):
            solver.setup(-M, H[:3], 0.5)
        with pytest.raises(ValueError, match="no problem"):
            solver.solve(f, w[:3])
        solver.setup(M, H[:3], 0.5)
    with pytest.raises(perp.Error, match="closed"):
        solver.solve(f, w[:3])


def test_a_moving_robot_keeps_its_laws_and_start():
    M, H, G, f, w, b, bounds = robot(3)
    compliance = np.full(len(H) + 1, 1e-3)
    with perp.ContactSolver(M, H, 0.5, bilateral=G, bounds=bounds) as solver:
        solver.solve(f, w, b)
        M, H = M + 1e-3 * np.eye(len(M)), 1.001 * H
        solver.setup(M, H, bilateral=G)
        step = solver.solve(f, w, b)
        check_robot((M, H, G, f, w, b, bounds), 0.5, step)
        assert step.iterations <= 6  # a few Newton steps from the last solution
        with pytest.raises(ValueError, match="mu is missing"):
            solver.setup(M, H[:3])  # other rows need laws of their own
        solver.setup(M, H, bilateral=G)  # those of as many rows are still there
        check_robot((M, H, G, f, w, b, bounds), 0.5, solver.solve(f, w, b))
        solver.setup(M, H, 0.5, bilateral=G, bounds=bounds, compliance=compliance)
        with pytest.raises(ValueError, match="compliance"):
            solver.setup(M, H)


def test_solver_takes_a_mass_callback():
    M, H, G, f, w, b, bounds = robot(5)
    with perp.ContactSolver(lambda x: np.linalg.solve(M, x), H, 0.5, bounds=bounds) as solver:
        r = solver.solve(f, w)
    assert np.allclose(r.v, perp.contact(M, f, H, w, 0.5, bounds=bounds).v, atol=1e-7)

    def fail(x):
        raise RuntimeError("lost")

    with pytest.raises(RuntimeError, match="lost"):
        perp.ContactSolver(fail, H, 0.5, bounds=bounds)


def test_rows_with_bounds_alone():
    for dim in (1, [], np.zeros(0, dtype=int)):
        r = perp.contact_delassus(np.eye(2), [-3.0, 0.5], [], dim=dim, bounds=([0, -1], [2, 1]))
        assert np.allclose(r.impulse, [2, -0.5]) and list(r.modes) == ["upper", "stick"]
        assert "0 contacts" in repr(r)


def test_bounds_are_refused():
    M, H, G, f, w, b, _ = robot(1)
    for bounds, words in [
        (([0.0] * 9, 1.0), "9"),
        (([1.0, 0.0], [0.0, 1.0]), "lower"),
        ((0.0, 1.0), "bounds"),
        (([0.0, NAN], 1.0), "lower"),
    ]:
        with pytest.raises(ValueError, match=words):
            perp.contact(M, f, H, w, 0.5, bounds=bounds)


def test_defaults_are_the_librarys():
    theirs = _library.defaults(_generated.ContactSettings)
    for call in (perp.contact, perp.contact_delassus, perp.ContactSolver.__init__):
        defaults = call.__kwdefaults__
        mine = _structures.sized(_generated.ContactSettings)
        names = ("method", "cone", "tol", "max_iterations", "time_limit")
        given = {name: defaults[name] for name in names}
        _settings.fill(mine, perp._contact.CODES, **given)
        for field, kind in _generated.ContactSettings._fields_:
            if kind is not _generated.ContactMonitor:
                assert getattr(mine, field) == getattr(theirs, field), field


def test_solver_keeps_what_holds_both_ways():
    """A mass on a guide, pressed to and fro: v_t falls by mu |r_N| / m a step, down to 0.0."""
    M, H, mu = np.diag([2.0, 2.0]), np.eye(2), 0.25
    speed, expected = 3.0, 3.0
    with perp.ContactSolver(M, H, mu, dim=2, two_sided=1) as solver:
        for step in range(12):
            if step == 5:
                solver.setup(M, H)  # contacts stay
            push = (2.0 if step % 2 else -2.0) * (1 + step % 3)
            result = solver.solve([push, 2.0 * speed])
            assert result.ok
            expected = max(0.0, expected - mu * abs(push) / 2.0)
            speed = result.v[1]
            assert result.v[0] == 0.0 and result.impulse[0] == pytest.approx(-push, rel=1e-14)
            assert speed == pytest.approx(expected, abs=1e-12)  # a few roundings a step
    assert speed == 0.0


@pytest.mark.parametrize("method", ["auto", "sweep", "proximal", "admm", "lemke"])
def test_bounds_that_are_reached_for_and_a_monitor_that_stops(method):
    """r = (0, 1e4, -1e4) by hand: further off than the loads suggest, and searched for again."""
    W = np.array([[1, 0.1, 0], [0.1, 1, 0.9999], [0, 0.9999, 1]])
    q = np.array([-1.0, -1.0, 1.0])
    for most in range(1, 30):
        asked = []

        def monitor(progress, asked=asked, most=most):
            asked.append(progress)
            return len(asked) >= most

        r = perp.contact_delassus(
            W, q, [0.5], dim=[1], bounds=([-1e9] * 2, [2e9] * 2), method=method, monitor=monitor
        )
        assert len(asked) <= most  # never again after it has said stop
        if r.ok:  # the matrix has a condition of 2e4
            assert np.allclose(r.impulse, [0, 1e4, -1e4], rtol=1e-3)


def test_who_asks_for_less_gets_no_less():
    """A torso of 100 kg on casters of 3e-5 kg m2: one residual for all is small long before each
    contact's own is."""
    casters = 8
    for seed in range(60):
        draw = np.random.default_rng(seed)
        n, contacts = 6 + casters, 2 * casters
        M = np.diag([100.0] * 3 + [10.0] * 3 + [3e-5] * casters)
        M[:6, 6:] = 1e-3 * draw.normal(size=(6, casters))
        M[6:, :6] = M[:6, 6:].T
        H = np.zeros((3 * contacts, n))
        for c in range(contacts):
            place = np.append(draw.normal(size=2), -0.3)
            rows = slice(3 * c, 3 * c + 3)
            H[rows, :3] = np.eye(3)[[2, 0, 1]]
            H[rows, 3:6] = np.cross(place, H[rows, :3])
            if c < contacts - 4:
                H[rows, 6 + c % casters] = [0.0, 0.05, 0.01] * draw.normal(size=3)
        f = np.zeros(n)
        f[:3], f[6:] = [*0.3 * draw.normal(size=2), -0.98], 1e-5 * draw.normal(size=casters)
        w = np.zeros(3 * contacts)
        w[::3] = np.where(draw.random(contacts) < 0.4, draw.uniform(0, 2.5, size=contacts), 0.0)
        for tol in 1e-10, 1e-8, 1e-6, 1e-4:
            end = perp.contact(M, f, H, w, [0.7] * contacts, method="newton", tol=tol)
            assert end.ok, (seed, tol, end.outcome)


def pushed_box(rng, share):
    """A box on four corners, pushed in its base by `share` of its friction; a fifth contact is open.
    Returns M, f, H, w, mu."""
    half, mass, mu = rng.uniform(0.2, 1, 3), 10 ** rng.uniform(-3, 3), rng.uniform(0.1, 1.2)
    turn, heading = rng.uniform(0, 2 * np.pi, 2)
    c, s = np.cos(turn), np.sin(turn)
    R = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    corners = [R @ (x * half[0], y * half[1], -half[2]) for x in (-1, 1) for y in (-1, 1)]
    rows = [(d, np.cross(p, d)) for p in [*corners, corners[0]] for d in np.eye(3)[[2, 0, 1]]]
    M = np.diag([mass] * 3 + [0.0] * 3)
    M[3:, 3:] = R @ np.diag(mass / 3 * (half @ half - half**2)) @ R.T
    push = share * mu * mass * 9.81 * np.array([np.cos(heading), np.sin(heading), 0])
    weight = np.array([0, 0, -9.81 * mass])
    f = 0.01 * np.concatenate([weight + push, np.cross([0, 0, -half[2]], push)])
    w = np.zeros(15)
    w[12] = 0.3
    return M, f, np.array([np.concatenate(row) for row in rows]), w, mu


@pytest.mark.parametrize("method", ["auto", "sweep", "newton", "lemke", "admm", "proximal"])
def test_a_push_below_its_friction_moves_nothing(method):
    """To the last bit at 1e-9 below, whatever a method leaves of velocities; behind it slides with
    what is left of the push."""
    rng = np.random.default_rng(5)
    for _ in range(40):
        share = rng.choice([0.5, 0.9, 0.9999, 1 - 1e-9])
        M, f, H, w, mu = pushed_box(rng, share)
        told = perp.contact(M, f, H, w, mu=mu, method=method)
        assert told.ok and (told.v == 0).all() and (told.velocity == w).all()
        assert np.abs(f + H.T @ told.impulse).max() <= 1e-12 * np.abs(f).max()
        assert told.modes[4] == "separate"
    M, f, H, w, mu = pushed_box(rng, 1.001)
    told = perp.contact(M, f, H, w, mu=mu, method=method)
    # (1.001 - 1) mu g h, by a method's tol beside g h
    assert np.hypot(*told.v[:2]) == pytest.approx(1e-3 * mu * 0.0981, abs=1e-8)


def test_a_large_sparse_mass_matrix_is_factored_as_it_is():
    """Above the size at which every mass matrix is made dense: the equations hold by numpy's own
    sums; what one triangle alone has, as small as rounding, is none of M; what is not positive
    definite is refused."""
    rng = np.random.default_rng(3)
    n, contacts = 300, 20
    L = sp.diags([np.ones(n), rng.uniform(-0.8, 0.8, n - 1)], [0, -1]) + sp.csc_matrix(
        (rng.uniform(-0.3, 0.3, 60), (rng.integers(150, n, 60), rng.integers(0, 150, 60))), (n, n)
    )
    M = sp.csc_matrix(L @ L.T)
    H = np.zeros((3 * contacts, n))
    for row in H:
        row[rng.integers(0, n, 3)] = rng.uniform(-1, 1, 3)
    f, mu = rng.uniform(-1, 1, n), np.full(contacts, 0.5)
    told = perp.contact(M, f, H, mu=mu)
    assert told.ok
    # 1e-13: sums of 300 terms of about 10 in doubles
    assert np.abs(M @ told.v - f - H.T @ told.impulse).max() <= 1e-13
    for i, j in ((250, 3), (3, 250)):
        rounded = M.tolil()
        assert rounded[i, j] == 0
        rounded[i, j] = 1e-10
        other = perp.contact(sp.csc_matrix(rounded), f, H, mu=mu)
        # 1e-8: the entry times M's inverse, of norm below 100
        assert other.ok and np.abs(other.v - told.v).max() <= 1e-8
    wrong = M.tolil()
    wrong[0, 1] = wrong[1, 0] = 5.0
    with pytest.raises(perp.Error, match="not positive definite"):
        perp.contact(sp.csc_matrix(wrong), f, H, mu=mu)
