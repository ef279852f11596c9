"""perp.ncp and perp.ncp_check_jacobian."""

import os
import signal
import subprocess
import sys
import threading

import numpy as np
import pytest
import scipy.sparse

import perp
from perp import _generated, _library, _settings, _structures


def kojima_shindo(z):
    a, b, c, d = z
    return np.array(
        [
            3 * a * a + 2 * a * b + 2 * b * b + c + 3 * d - 6,
            2 * a * a + a + b * b + 10 * c + 2 * d - 2,
            3 * a * a + a * b + 2 * b * b + 2 * c + 9 * d - 9,
            a * a + 3 * b * b + 2 * c + 3 * d - 3,
        ]
    )


def kojima_shindo_jacobian(z):
    a, b, _, _ = z
    return np.array(
        [
            [6 * a + 2 * b, 2 * a + 4 * b, 1, 3],
            [4 * a + 1, 2 * b, 10, 2],
            [6 * a + b, a + 4 * b, 2, 9],
            [2 * a, 6 * b, 2, 3],
        ]
    )


SOLUTIONS = np.array([[np.sqrt(6) / 2, 0, 0, 0.5], [1, 0, 3, 0]])


@pytest.mark.parametrize("method", ["auto", "fischer", "josephy"])
@pytest.mark.parametrize("kind", ["dense", "lists", "fortran", "sparse", "none"])
def test_kojima_shindo(method, kind):
    jacobian = {
        "dense": kojima_shindo_jacobian,
        "lists": lambda z: kojima_shindo_jacobian(z).tolist(),
        "fortran": lambda z: np.asfortranarray(kojima_shindo_jacobian(z)),
        "sparse": lambda z: scipy.sparse.csr_matrix(kojima_shindo_jacobian(z)),
        "none": None,
    }[kind]
    pattern = np.ones((4, 4)) if kind == "sparse" else None
    r = perp.ncp(kojima_shindo, jacobian, [1, 1, 1, 1], method=method, pattern=pattern)
    assert r.ok and r.outcome == "solved" and not r.trapped
    assert r.natural_residual <= 1e-12
    assert np.min(np.max(np.abs(SOLUTIONS - r.z), axis=1)) <= 1e-10
    np.testing.assert_array_equal(r.w, kojima_shindo(r.z))
    assert method in ("auto", r.method)
    assert r.restarts == 0 and r.function_evaluations > 0 and "solved" in repr(r)


def bratu(n, wrong=0.0):
    """-u'' = exp(u), u(0) = u(1) = 0, and its sparse Jacobian."""
    h2 = 1 / (n + 1) ** 2
    laplace = scipy.sparse.diags([-1.0, 2.0, -1.0], [-1, 0, 1], shape=(n, n), format="csc") / h2

    def F(u):
        return laplace @ u - np.exp(u)

    def J(u):
        matrix = (laplace - scipy.sparse.diags(np.exp(u))).tocsc()
        matrix[3, 2] += wrong
        return matrix

    return F, J, laplace


def test_sparse_and_coloured_differences():
    n = 300
    F, J, pattern = bratu(n)
    free = {"lower": -np.inf}
    given = perp.ncp(F, J, np.zeros(n), **free)
    coloured = perp.ncp(F, None, np.zeros(n), pattern=pattern, **free)
    assert given.ok and coloured.ok
    # the middle of the continuous solution; differences are off by h^2
    assert abs(np.max(given.z) - 0.1405392144004718) < 1e-5
    # entries of F are rounded to 1e-11, the inverse of J is below 1
    np.testing.assert_allclose(coloured.z, given.z, atol=1e-10)
    # three colours, twice where both sides are asked, a few steps
    assert coloured.function_evaluations < 12 * coloured.jacobian_evaluations


def test_bounds_and_calls_within_them():
    seen = []

    def F(z):
        seen.append(z)
        return z**3 - np.array([8.0, -8.0, 1.0, 27.0])

    lower, upper = np.array([0, -1, -np.inf, 1]), np.array([1, 1, np.inf, 1])
    r = perp.ncp(F, None, [5, 5, 5, 5], lower, upper)
    assert r.ok
    np.testing.assert_allclose(r.z, [1, -1, 1, 1], rtol=0, atol=1e-15)
    assert all(np.all(z >= lower) and np.all(z <= upper) for z in seen)


def test_trap_is_said():
    """Billups: Newton's method from 0 ends where the merit function has a false minimum."""

    def F(z):
        return (z - 1) ** 2 - 1.01

    r = perp.ncp(F, None, [0], method="fischer")
    assert not r.ok and r.outcome == "stalled" and r.trapped
    r = perp.ncp(F, None, [0])
    assert r.ok and r.restarts > 0 and not r.trapped
    np.testing.assert_allclose(r.z, 1 + np.sqrt(1.01), rtol=1e-14)


def test_nan_shortens_the_step():
    with np.errstate(invalid="ignore"):
        r = perp.ncp(lambda z: np.log(z) + 1, None, [50.0], lower=-np.inf)
    assert r.ok
    np.testing.assert_allclose(r.z, np.exp(-1), rtol=1e-14)
    r = perp.ncp(lambda z: z * np.nan, None, [1.0])
    assert r.outcome == "evaluation_failed" and np.isnan(r.w).all()


class Mine(Exception):
    pass


@pytest.mark.parametrize("which", ["F", "J", "monitor"])
@pytest.mark.parametrize("error", [Mine, KeyboardInterrupt, SystemExit])
def test_exceptions_come_out(which, error):
    calls = []

    def fail(name):
        calls.append(name)
        if name == which and calls.count(name) == 3:
            raise error("from inside")

    def F(z):
        fail("F")
        return kojima_shindo(z)

    def J(z):
        fail("J")
        return kojima_shindo_jacobian(z)

    with pytest.raises(error, match="from inside"):
        perp.ncp(F, J, [100] * 4, monitor=lambda progress: fail("monitor"))
    assert calls.count(which) == 3


def test_monitor_stops():
    seen = []
    r = perp.ncp(
        kojima_shindo,
        kojima_shindo_jacobian,
        [100] * 4,
        monitor=lambda p: seen.append(p) or len(seen) == 2,
    )
    assert r.outcome == "stopped" and r.iterations == 1
    assert seen[0].method == "fischer" and seen[0].residual > 0


def test_callbacks_may_solve_something_else():
    def F(z):
        assert perp.ncp(lambda x: x - 1, None, [0.0]).ok
        return z - 2

    r = perp.ncp(F, None, [0.0])
    assert r.ok and r.z[0] == 2


@pytest.mark.parametrize(
    "arguments, word",
    [
        (dict(F=3), "F"),
        (dict(J=3), "J"),
        (dict(z0=[[1.0]]), "z0"),
        (dict(z0=[np.nan]), r"z0\[0\]"),
        (dict(lower=[0, 1]), "lower"),
        (dict(lower=2, upper=1), "lower"),
        (dict(method="newton"), "method"),
        (dict(tol=0), "tol"),
        (dict(max_iterations=0), "max_iterations"),
        (dict(time_limit=-1), "time_limit"),
        (dict(penalty=1), "penalty"),
        (dict(restarts=-1), "restarts"),
        (dict(pattern=np.ones((2, 2))), "pattern"),
        (dict(F=lambda z: np.ones(2)), "F"),
        (dict(F=lambda z: "word"), "F"),
        (dict(J=lambda z: np.ones((2, 2))), "J"),
        (dict(J=lambda z: np.ones((1, 1)), pattern=np.zeros((1, 1))), "pattern"),
        (dict(J=lambda z: scipy.sparse.eye(1), pattern=np.zeros((1, 1))), "pattern"),
    ],
)
def test_refusals(arguments, word):
    good = dict(F=lambda z: z - 1, J=None, z0=[0.0])
    with pytest.raises(ValueError, match=word):
        perp.ncp(**{**good, **arguments})


def test_entries_that_come_and_go():
    """A sparse Jacobian may leave out entries of the pattern, but not add to it."""

    def F(z):
        return np.array([z[0] - 2 + z[1] ** 2, z[1] * z[0] - 1])

    def J(z):
        return scipy.sparse.csr_matrix([[1, 2 * z[1]], [z[1], z[0]]])  # has no zeros

    with pytest.raises(ValueError, match="pattern"):
        perp.ncp(F, J, [0.5, 0.0])
    r = perp.ncp(F, J, [0.5, 0.0], pattern=[[1, 1], [1, 1]])
    assert r.ok
    np.testing.assert_allclose(F(r.z), 0, atol=1e-12)


def test_check_jacobian():
    n = 20
    F, J, _ = bratu(n)
    z = np.linspace(0.1, 0.2, n)
    check = perp.ncp_check_jacobian(F, J, z)
    assert check.ok and check.wrong == check.missing == 0 and check.missing_entry is None
    F, J, _ = bratu(n, wrong=0.1)
    check = perp.ncp_check_jacobian(F, J, z)
    assert not check.ok and check.wrong == 1 and check.entry == (3, 2)
    assert abs(check.given - check.difference - 0.1) < 1e-6
    check = perp.ncp_check_jacobian(F, lambda z: scipy.sparse.diags(J(z).diagonal()), z)
    assert check.missing == 2 * (n - 1) and check.wrong == 0
    with pytest.raises(ValueError, match="nothing to check"):
        perp.ncp_check_jacobian(F, None, z)
    with pytest.raises(ValueError, match=r"z\[0\]"):
        perp.ncp_check_jacobian(F, J, -z)


def test_defaults_are_the_librarys():
    theirs = _library.defaults(_generated.NcpSettings)
    mine = _structures.sized(_generated.NcpSettings)
    signature = perp.ncp.__kwdefaults__
    names = {name for name, _ in mine._fields_} & {*signature} - {"monitor"}
    _settings.fill(mine, perp._ncp._CODES, **{name: signature[name] for name in names})
    for field, kind in _generated.NcpSettings._fields_:
        if kind is not _generated.NcpMonitor:
            assert getattr(mine, field) == getattr(theirs, field), field
    assert set(signature) == {*names, "monitor", "pattern", "jac"}
    assert list(_library.NCP_METHODS.values()) == ["auto", "fischer", "josephy"]


def test_threads():
    answers = [None] * 4

    def work(k):
        answers[k] = perp.ncp(kojima_shindo, None, [1, 1, 1, 1]).z

    threads = [threading.Thread(target=work, args=(k,)) for k in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for answer in answers:
        np.testing.assert_array_equal(answer, answers[0])


def test_solver_goes_on_from_the_last_solution():
    load = np.array([1.0, -2.0])

    def F(z):  # z = sqrt(load) where that is positive, else 0
        return z * z - load

    with perp.NCP(F, lambda z: np.diag(2.0 * z), [3.0, 3.0]) as problem:
        first = problem.solve()
        assert first.ok
        np.testing.assert_allclose(first.z, [1.0, 0.0], atol=1e-10)
        assert problem.solve().iterations < first.iterations
        load[:] = [4.0, 9.0]  # tol is 1e-10
        np.testing.assert_allclose(problem.solve([5.0, 5.0]).z, [2.0, 3.0], rtol=1e-9)
        with pytest.raises(ValueError, match="z0"):
            problem.solve([1.0])
    with pytest.raises(perp.Error, match="closed"):
        problem.solve()

    def fail(z):
        raise RuntimeError("lost")

    with pytest.raises(RuntimeError, match="lost"):
        perp.NCP(fail, None, [1.0]).solve()


# F never says that it is solved, and much of the time is spent in the library: the signal is
# mostly handled at the first bytecode of a callback.
INTERRUPTED = """
import os, signal, threading
import numpy as np
import perp
n = 120
def F(z):
    return np.sin(1e3 * z) + 2
signal.signal(signal.SIGINT, signal.default_int_handler)  # a job in the background ignores it
threading.Timer(0.3, lambda: os.kill(os.getpid(), signal.SIGINT)).start()
try:
    while True:
        perp.ncp(F, lambda z: np.diag(1e3 * np.cos(1e3 * z)), np.zeros(n), restarts=10**6)
except KeyboardInterrupt:
    print("interrupted")
"""


@pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")
def test_ctrl_c():
    assert signal.SIGINT
    run = subprocess.run(
        [sys.executable, "-c", INTERRUPTED], capture_output=True, text=True, timeout=60
    )
    assert run.stdout == "interrupted\n" and run.stderr == ""


def test_a_problem_without_a_solution_says_what_was_tried():
    """Sums of squares above 0 have no root; nor have equations that differ by a constant."""
    rng = np.random.default_rng(11)
    for n in (1, 2, 3):
        A, c = rng.standard_normal((n, n)), rng.uniform(0.1, 2, n)
        for F in (lambda x: (A @ x) ** 2 + c, lambda x: np.full(n, x.sum()) + np.arange(n) + c):
            if n == 1 and F(np.zeros(1)) * F(np.full(1, -9.0)) < 0:
                continue  # one equation has a root
            r = perp.ncp(F, rng.standard_normal(n), lower=-np.inf)
            assert not r.ok
            for tried in (
                f"{r.iterations} iterations from {r.restarts + 1} start",
                f"{r.function_evaluations} calls of F",
                f"a natural residual of {r.natural_residual:.2g}",
            ):
                assert tried in r.message
            assert r.message.startswith(r.outcome)
            assert r.function_evaluations < 35000  # what docs/ncp.md tells of n up to 12
    assert "tried" not in perp.ncp(lambda x: x - 1, [0.0]).message
