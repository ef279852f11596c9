"""perp.lcp and perp.LCP: answers, bounds, outcomes."""

import numpy as np
import pytest
import scipy.sparse as sp
from check import EPS, assert_solves

import perp

METHODS = ["auto", "lemke", "pgs", "fischer"]

# Complementarity problems with known solutions: M, q, z.
KNOWN = {
    "P-matrix, unsymmetric": ([[1, 3], [0, 1]], [-1, -1], [0, 1]),
    "copositive-plus": ([[0, -1], [1, 0]], [1, -1], [1, 1]),
    # Cottle, Pang & Stone (1992), example 4.4.7
    "CPS 4.4.7": ([[0, -1, 2], [2, 0, -2], [-1, 1, 0]], [-3, 6, -1], [0, 1, 3]),
    "optimality conditions of a quadratic program": (
        [[11, 0, 10, -1], [0, 11, 10, -1], [10, 10, 21, -1], [1, 1, 1, 0]],
        [50, 50, 10, -6],
        [2, 2, 2, 92],
    ),
}


def random_problem(seed, n, positive_definite=True):
    """An unsymmetric M with positive definite symmetric part: one solution, for every method."""
    rng = np.random.default_rng(seed)
    A, B = rng.standard_normal((2, n, n))
    M = A @ A.T / n + 0.5 * np.eye(n) + (B - B.T) / n
    return M, rng.standard_normal(n)


@pytest.mark.parametrize("name", KNOWN)
def test_known_solutions(name):
    M, q, z = KNOWN[name]
    result = perp.lcp(M, q, method="lemke")
    assert_solves(result, M, q)
    # the solutions are small integers, the matrices well conditioned: a few units in the last place
    np.testing.assert_allclose(result.z, z, rtol=16 * EPS, atol=16 * EPS)
    assert np.all(result.z[np.equal(z, 0)] == 0.0)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("n", [1, 2, 10, 60])
def test_methods_agree_on_the_unique_solution(method, n):
    M, q = random_problem(n, n)
    result = perp.lcp(M, q, method=method)
    assert_solves(result, M, q)
    if method != "auto":
        assert result.method in (method, "polish")
    # Mathias & Pang (1990): the distance is at most (1 + |M|) / (least eigenvalue) residuals
    other = perp.lcp(M, q, method="lemke").z
    bound = (1 + np.linalg.norm(M, 2)) / np.linalg.eigvalsh((M + M.T) / 2)[0]
    assert np.linalg.norm(result.z - other) <= bound * 1e-9 * np.linalg.norm(q)


def test_bounds():
    M, q = random_problem(4, 12)
    low = np.linspace(-1.0, -0.1, 12)
    high = np.linspace(0.05, 0.5, 12)
    low[2], high[3], low[4], high[4] = -np.inf, np.inf, -np.inf, np.inf
    high[5] = low[5]
    result = perp.lcp(M, q, low, high)
    assert_solves(result, M, q, low, high)
    assert result.z[5] == low[5]
    for i, (z, w) in enumerate(zip(result.z, result.w)):
        if low[i] == high[i]:
            continue
        assert z == low[i] or w < 1e-12 or z != high[i]
        if low[i] < z < high[i]:
            assert abs(w) < 1e-12
        elif z == low[i]:
            assert w >= 0
        else:
            assert w <= 0


def test_scalar_bounds_stand_for_all():
    M, q = random_problem(5, 8)
    a = perp.lcp(M, q, -0.25, 0.25)
    b = perp.lcp(M, q, np.full(8, -0.25), np.full(8, 0.25))
    np.testing.assert_array_equal(a.z, b.z)
    assert_solves(a, M, q, -0.25, 0.25)


def test_infinite_bounds_make_equations():
    M, q = random_problem(6, 9)
    result = perp.lcp(M, q, -np.inf, np.inf)
    assert result.ok
    # backward stable: the error is the condition number times a few units
    np.testing.assert_allclose(
        result.z, np.linalg.solve(M, -q), rtol=0, atol=100 * EPS * np.linalg.cond(M)
    )


def test_no_variables():
    for M in (np.zeros((0, 0)), np.zeros((0, 0), order="F")):
        result = perp.lcp(M, [])
        assert result.ok and result.z.shape == result.w.shape == (0,)


@pytest.mark.parametrize("method", ["auto", "lemke", "fischer", "pgs"])
def test_infeasible_problem_is_never_ok(method):
    """w1 + w2 = -2 whatever z is."""
    M, q = [[1, -1], [-1, 1]], [-1, -1]
    for limit in (None, 1, 2, 1000):
        result = perp.lcp(M, q, method=method, max_iterations=limit)
        assert not result.ok
        assert result.outcome not in ("solved", "rounding_limit")
    result = perp.lcp(M, q, method=method)
    if method in ("auto", "lemke"):
        assert (result.outcome, result.certificate) == ("ray", "infeasible")
        # Farkas: y >= 0, M'y <= 0 and q'y < 0 leave no z >= 0 with M z + q >= 0
        y = result.ray
        assert y.max() == 1.0
        assert np.all(y >= 0) and np.all(np.transpose(M) @ y <= 0) and np.dot(q, y) < 0


def test_no_ray_where_there_is_none():
    result = perp.lcp([[2.0]], [-1.0])
    assert result.ray is None and result.certificate is None


def test_iteration_limit():
    M, q = random_problem(7, 30)
    result = perp.lcp(M, q, method="pgs", max_iterations=1, polish=False)
    assert result.outcome == "iteration_limit" and not result.ok
    assert result.iterations == 1
    assert np.all(result.z >= 0)  # the best iterate found


def slow_problem(n):
    """Springs in a row: pgs needs about n^2 sweeps."""
    return 2 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1), -np.ones(n)


def test_time_limit():
    M, q = slow_problem(150)
    result = perp.lcp(
        M, q, method="pgs", time_limit=1e-3, max_iterations=2**31 - 1, tol=1e-14, polish=False
    )
    assert result.outcome == "time_limit" and not result.ok


def test_keywords_reach_the_library():
    M, q = random_problem(8, 20)
    plain = perp.lcp(M, q, method="pgs", polish=False)
    relaxed = perp.lcp(M, q, method="pgs", polish=False, relaxation=0.5)
    assert relaxed.iterations > plain.iterations
    loose = perp.lcp(M, q, method="pgs", polish=False, tol=1e-2)
    assert loose.iterations < plain.iterations
    assert plain.residual <= 1e-10 < loose.residual <= 1e-2
    # Lo(n) with q = -e takes 2^n lexicographic pivots (Fathi, 1979), unscaled
    lower = 2 * np.tri(6) - np.eye(6)
    result = perp.lcp(
        lower, -np.ones(6), method="lemke", pivot_rule="lexicographic", scaling=False, polish=False
    )
    assert_solves(result, lower, -np.ones(6))
    np.testing.assert_array_equal(result.z, [1, 0, 0, 0, 0, 0])


def test_start_from_the_solution():
    M, q = random_problem(9, 40)
    cold = perp.lcp(M, q, method="pgs", polish=False)
    warm = perp.lcp(M, q, method="pgs", polish=False, z0=cold.z)
    assert warm.ok and warm.iterations <= max(1, cold.iterations // 4)


def test_powers_of_two_change_no_bit():
    M, q = random_problem(10, 15)
    a = perp.lcp(M, q)
    b = perp.lcp(M, q * 2.0**-300)
    np.testing.assert_array_equal(a.z * 2.0**-300, b.z)
    assert a.residual == b.residual


def test_same_bits_twice():
    M, q = random_problem(11, 50)
    for method in METHODS:
        a, b = (perp.lcp(M, q, method=method) for _ in range(2))
        np.testing.assert_array_equal(a.z, b.z)
        np.testing.assert_array_equal(a.w, b.w)
        assert (a.residual, a.backward_error, a.iterations) == (
            b.residual,
            b.backward_error,
            b.iterations,
        )


def test_result_tells_what_it_is():
    result = perp.lcp([[2.0]], [-1.0], method="lemke")
    assert repr(result).startswith("<perp.LcpResult solved by ")
    assert isinstance(result.ok, bool) and isinstance(result.iterations, int)
    assert result.seconds > 0
    assert result.backward_error <= 16 * EPS


def test_solver_for_many_q():
    M, _ = random_problem(12, 25)
    rng = np.random.default_rng(13)
    with perp.LCP(M, -1.0, np.inf, method="lemke", tol=1e-12) as problem:
        for _ in range(5):
            q = rng.standard_normal(25)
            result = problem.solve(q)
            assert_solves(result, M, q, -1.0)
            once = perp.lcp(M, q, -1.0, method="lemke", tol=1e-12)
            np.testing.assert_array_equal(result.z, once.z)
            warm = problem.solve(q, z0=result.z)
            assert_solves(warm, M, q, -1.0)


def test_solver_takes_changed_values_and_other_problems():
    M, q = random_problem(14, 6)
    problem = perp.LCP(M)
    problem.solve(q)
    M *= 2.0
    problem.setup(M)
    assert_solves(problem.solve(q), M, q)
    other, p = random_problem(15, 9)
    problem.setup(other, -1.0, 1.0)
    assert_solves(problem.solve(p), other, p, -1.0, 1.0)


def test_solver_keeps_its_problem_when_setup_is_refused():
    M, q = random_problem(16, 6)
    problem = perp.LCP(M)
    z = problem.solve(q).z
    for bad in (np.full((6, 6), np.nan), np.zeros((6, 5)), np.full((7, 7), np.inf)):
        with pytest.raises(ValueError):
            problem.setup(bad)
        np.testing.assert_array_equal(problem.solve(q).z, z)


def switched_converter():
    """A Buck converter with ideal diodes: 20 equations, one the sum of two others, 12 complementary
    rows, and an entry of 1.45e9 in the solution."""
    rows = {
     0: {13: 1, 20: 1, 22: -1, 23: -1}, 1: {12: 1, 28: 1, 29: 1},
     2: {15: 1, 22: 1, 23: 1, 24: 1, 25: 1, 26: -1, 27: -1, 28: -1, 29: -1}, 3: {11: 1, 24: -1, 25: -1},
     4: {4: -2.5e-6, 11: -1, 12: -1, 19: 2.84091e-12, 20: -1, 21: 1}, 5: {4: 2.5e-6, 7: 6.85747e-5, 18: 8.02311e-5, 19: -1},
     6: {10: 1, 30: 1, 31: 1}, 7: {9: 1, 14: -10000}, 8: {7: -6.41848e-5, 18: -1.00008, 19: 7.29373e-11},
     9: {7: 1.78158e-7, 16: -8.39575e-10, 17: 1}, 10: {7: -4.56797e-6, 14: 10000, 16: 8.39575e-10, 17: -2.34418e-6, 18: 1, 19: 4.98843e-12},
     11: {8: 1, 16: -1.00471, 17: -1, 30: -1, 31: -1}, 12: {8: -1, 14: 1, 16: .00471254}, 13: {6: 1}, 14: {5: 1},
     15: {3: 1, 4: -1}, 16: {1: 1, 4: -1}, 17: {0: 1}, 18: {8: 1}, 19: {2: 1}, 20: {0: 1, 4: -1}, 21: {4: 1},
     22: {0: -14.4975, 3: 14.4975, 22: 1}, 23: {0: -41.005, 3: 41.005, 23: 1}, 24: {0: 14.4975, 3: -14.4975, 24: 1},
     25: {0: 41.005, 3: -41.005, 25: 1}, 26: {1: -6.2132, 26: 1}, 27: {1: -17.5736, 27: 1}, 28: {1: 6.2132, 28: 1},
     29: {1: 17.5736, 29: 1}, 30: {15: -15, 30: 1}, 31: {15: 15, 31: 1}}
    q = np.zeros(32)
    q[[13, 15]] = -3
    q[22:] = [2, 5.5, 2, 5.5, 2, 3.5, 2, 3.5, .1, -.1]
    M = np.zeros((32, 32))
    for i, row in rows.items():
        for j, x in row.items():
            M[i, j] = x
    return M, q, np.r_[np.full(20, -np.inf), np.zeros(12)]


def test_the_polish_makes_no_answer_worse():
    """What is good without it is good with it, for the converter and its neighbours."""
    M, q, lower = switched_converter()
    for seed in range(60):
        rng = np.random.default_rng(seed)
        near = q * (1 + 10.0 ** -rng.uniform(0, 3) * rng.uniform(-1, 1, 32))
        plain = perp.lcp(M, near, lower, np.inf, polish=False)
        told = perp.lcp(M, near, lower, np.inf)
        assert not plain.ok or told.ok
        w = M @ told.z + near
        assert np.abs(w[:20]).max() <= 1e-12 * 1.5e9  # beside the largest term of these rows


@pytest.mark.parametrize("storage", [np.array, sp.csc_matrix])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_equations_that_contradict_are_proved_by_the_ray(sign, storage):
    """A x = b, x >= 0 with b outside of the cone of A, and -A x = -b as well: y = ray is Farkas'
    vector, with (M'y)_j = 0 for the free multipliers."""
    for seed in range(60):
        g = np.random.default_rng(seed)
        A = g.integers(0, 4, (3, 6)).astype(float)
        b = -1.0 - g.integers(0, 4, 3)
        M = np.block([[np.zeros((6, 6)), -A.T], [sign * A, np.zeros((3, 3))]])
        q = np.r_[g.uniform(0, 1, 6), -sign * b]
        told = perp.lcp(storage(M), q, np.r_[np.zeros(6), np.full(3, -np.inf)], np.inf)
        assert told.outcome == "ray" and told.certificate == "infeasible"
        y = told.ray
        size = 9 * EPS * (np.abs(M.T) @ np.abs(y)).max()
        assert (y[:6] >= 0).all() and q @ y < 0
        assert (M.T @ y)[:6].max() <= size and np.abs((M.T @ y)[6:]).max() <= size


@pytest.mark.parametrize("storage", [np.array, sp.csc_matrix])
@pytest.mark.parametrize("rows, columns", [(5, 12), (10, 25), (20, 50)])
def test_equations_have_no_sign(rows, columns, storage):
    """Linear programs whose equations stand as they are, turned round, and some of them so: paths
    lead to the solution of each. Optimal values are those of the points they were made from."""
    for seed in range(60):
        g = np.random.default_rng(seed)
        A = g.integers(-2, 3, (rows, columns)).astype(float)
        x, y = np.maximum(g.normal(size=columns), 0), g.normal(size=rows)
        c = A.T @ y + np.where(x > 0, 0, g.uniform(0, 1, columns))
        signs = np.array([1.0, -1.0, 0.0])[seed % 3] + (seed % 3 == 2) * g.choice([-1.0, 1.0], rows)
        M = np.block(
            [[np.zeros((columns, columns)), A.T], [-signs[..., None] * A, np.zeros((rows, rows))]]
        )
        q = np.r_[c, signs * (A @ x)]
        bounds = np.r_[np.zeros(columns), np.full(rows, -np.inf)], np.inf
        told = perp.lcp(storage(M), q, *bounds)
        assert told.ok and c @ told.z[:columns] == pytest.approx(c @ x, abs=1e-8 * np.abs(c).sum())
        early = perp.lcp(storage(M), q, *bounds, max_iterations=3)
        for one in (told, early):  # 100: terms of a row, each rounded once
            terms = np.abs(M) @ np.abs(one.z) + np.abs(q)
            assert np.abs(M @ one.z + q - one.w).max() <= 100 * EPS * terms.max()


@pytest.mark.parametrize("method", ["auto", "lemke", "active_set", "fischer"])
@pytest.mark.parametrize("side, rows", [(6, 3), (30, 20)])
def test_quadratic_programs_in_their_symmetric_form(side, rows, method):
    """x'Hx / 2 + c'x over A x = b, x >= 0, as [H A'; A 0]: H is a membrane's, so x is unique, and
    is the point that c and b were made from."""
    for seed in range(4):
        g, n = np.random.default_rng(seed), side * side
        line = sp.diags([-np.ones(side - 1), 2 * np.ones(side), -np.ones(side - 1)], [-1, 0, 1])
        H = sp.kron(line, sp.identity(side)) + sp.kron(sp.identity(side), line)
        A = sp.csc_matrix(np.where(g.uniform(size=(rows, n)) < 5 / n, g.normal(size=(rows, n)), 0))
        x, y = np.maximum(g.normal(size=n), 0), g.normal(size=rows)
        c = np.where(x > 0, 0, g.uniform(0, 1, n)) - H @ x - A.T @ y
        M = sp.bmat([[H, A.T], [A, None]]).tocsc()
        bounds = np.r_[np.zeros(n), np.full(rows, -np.inf)], np.inf
        told = perp.lcp(M, np.r_[c, -A @ x], *bounds, method=method)
        assert told.ok
        # cond H is below 400: tol 1e-10 is 4e-8 of x
        np.testing.assert_allclose(told.z[:n], x, rtol=0, atol=4e-8 * x.max())


def without_diagonal(kind, g):
    """Integers of a problem that has a solution, in which no row has a diagonal entry."""
    rows, columns = g.integers(1, 4, 2)
    n = rows + columns
    if kind == "game":
        A, B = g.integers(1, 10, (2, rows, columns))
        return np.block([[np.zeros((rows, rows)), A], [B.T, np.zeros((columns, columns))]]), -1.0
    M = np.tril(g.integers(-3, 4, (n, n)), -1).astype(float)
    if kind == "program":
        M[:rows, :rows] = M[rows:, rows:] = 0.0
    M -= M.T
    z = np.where(g.random(n) < 0.6, g.integers(1, 5, n), 0)
    w = np.where(z == 0, g.integers(0, 4, n), 0)
    return M, w - M @ z


@pytest.mark.parametrize("storage", [np.array, sp.csc_matrix])
@pytest.mark.parametrize("kind", ["skew", "program", "game"])
def test_size_of_a_matrix_without_diagonal(kind, storage):
    """M in units of any power of four: z is that much smaller, to the last bit."""
    for seed in range(40):
        M, q = without_diagonal(kind, np.random.default_rng(seed))
        q = np.full(len(M), q) if kind == "game" else q
        one = perp.lcp(storage(M), q)
        assert one.ok, seed
        for power in (-960, -500, -80, 70, 300, 900):
            told = perp.lcp(storage(np.ldexp(M, power)), q)
            assert told.ok and np.array_equal(told.z, np.ldexp(one.z, -power)), (seed, power)


@pytest.mark.parametrize("storage", [np.array, sp.csc_matrix])
@pytest.mark.parametrize("degenerate", [False, True])
def test_zero_sum_games(storage, degenerate):
    """x pays x'A y to y: costs A and 1 - A, made positive. The value is that of the linear program
    min v subject to A'x <= v, and no strategy does better against what is told."""
    optimize = pytest.importorskip("scipy.optimize")
    for seed in range(24):
        g = np.random.default_rng(seed)
        rows, columns = g.integers(2, 60, 2)
        size = (rows, columns)
        A = g.integers(-3, 4, size).astype(float) if degenerate else g.uniform(-1, 1, size)
        costs, others = A - A.min() + 1, A.max() - A + 1
        zeros = np.zeros((rows, rows)), np.zeros((columns, columns))
        M = np.block([[zeros[0], costs], [others.T, zeros[1]]])
        told = perp.lcp(storage(M), -np.ones(rows + columns))
        assert told.ok
        x, y = told.z[:rows] / told.z[:rows].sum(), told.z[rows:] / told.z[rows:].sum()
        program = optimize.linprog(
            np.r_[np.zeros(rows), 1.0],
            A_ub=np.c_[A.T, -np.ones(columns)],
            b_ub=np.zeros(columns),
            A_eq=np.r_[np.ones(rows), 0.0][None],
            b_eq=[1.0],
            bounds=[(0, None)] * rows + [(None, None)],
        )
        assert x @ A @ y == pytest.approx(program.fun, abs=1e-7)  # of linprog
        assert (x @ A).max() - (A @ y).min() <= 1e-9


def count_of_pivots(costs, others):
    """Those of Lemke and Howson's path that begins with the first player's first strategy, by two
    tableaus [b I C], [b C I] and the least ratio."""
    m, n = costs.shape
    T = [np.c_[np.ones(n), others.T, np.eye(n)], np.c_[np.ones(m), np.eye(m), costs]]
    basic = [list(range(m, m + n)), list(range(m))]
    entering, side, count = 0, 0, 0
    while True:
        t = T[side]
        column = t[:, 1 + entering]
        ratios = np.full(len(column), np.inf)
        np.divide(t[:, 0], column, out=ratios, where=column > 1e-9)
        r = np.argmin(ratios)
        t[r] /= t[r, 1 + entering]
        for i in set(range(len(t))) - {r}:
            t[i] -= t[i, 1 + entering] * t[r]
        leaving, basic[side][r] = basic[side][r], entering
        entering, side, count = leaving, 1 - side, count + 1
        if leaving == 0:
            return count


def test_the_path_of_a_game():
    """Random games are not degenerate, so that Lemke and Howson's path is one path: nothing is
    tried before it. Its first two pivots are the start's, and t and the missing strategy's slack
    are two variables of one column, so that the counts differ by at most two."""
    for seed in range(40):
        g = np.random.default_rng(seed)
        m, n = g.integers(9, 30, 2)
        costs, others = g.uniform(1, 3, (m, n)), g.uniform(1, 3, (m, n))
        M = np.block([[np.zeros((m, m)), costs], [others.T, np.zeros((n, n))]])
        told = perp.lcp(M, -np.ones(m + n))
        assert told.ok
        # maximal payoffs 4 - costs have the equilibria of minimal costs
        assert abs(told.iterations - count_of_pivots(4 - costs, 4 - others)) <= 2, seed


@pytest.mark.parametrize("method", ["auto", "lemke", "pgs", "fischer", "active_set"])
def test_a_limit_that_is_used_up_begins_nothing(method):
    """No pivot, no sweep, no factorisation, no proof of a ray: the start, with its true residual."""
    g = np.random.default_rng(4)
    n = 40
    A = g.uniform(1, 2, (n, n))
    game = np.block([[np.zeros((n, n)), A], [A.T, np.zeros((n, n))]])
    definite = A @ A.T + np.eye(n)
    laplacian = sp.diags([-1.0, 2.5, -1.0], [-7, 0, 7], shape=(400, 400)).tocsc()
    for M in (game, definite, laplacian):
        if M is game and method == "pgs":
            continue  # it needs a positive diagonal
        q = -g.uniform(1, 2, M.shape[0])
        z0 = g.uniform(0, 1, len(q))
        for start in (None, z0):
            r = perp.lcp(M, q, z0=start, method=method, time_limit=1e-12)
            z = np.zeros(len(q)) if start is None else z0
            assert (r.outcome, r.iterations) == ("time_limit", 0), (method, M.shape)
            assert np.array_equal(r.z, z)
            assert r.natural_residual == pytest.approx(np.abs(np.minimum(z, M @ z + q)).max())


def test_sweeps_come_first_where_nothing_else_is_promised():
    """Entries of any sign and twice the diagonal in a row: 20 sweeps, where Newton's method factors
    matrices that fill in."""
    sparse = pytest.importorskip("scipy.sparse")
    g, n = np.random.default_rng(1), 2000
    j, v = g.integers(0, n, 4 * n), g.choice([-1.0, 1.0], 4 * n) * g.uniform(0.2, 1, 4 * n)
    noise = sparse.csc_matrix((v, (j, np.repeat(np.arange(n), 4))), shape=(n, n))
    M, q = (2 * sparse.identity(n) + noise).tocsc(), g.normal(size=n)
    r = perp.lcp(M, q)
    assert (r.outcome, r.method) == ("solved", "pgs") and r.iterations <= 64
    assert np.abs(np.minimum(r.z, M @ r.z + q)).max() <= 1e-12  # rounding of 5 terms of size 4
