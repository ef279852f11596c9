"""Who keeps what alive; threads; forks; the end of the interpreter."""

import gc
import os
import subprocess
import sys
import threading
import weakref

import numpy as np
import pytest
from test_lcp import random_problem, slow_problem

import perp


def test_solver_keeps_its_matrix():
    M, q = random_problem(1, 30)
    problem = perp.LCP(M.copy())
    expected = perp.lcp(M, q).z
    gc.collect()
    litter = [np.full((30, 30), np.nan) for _ in range(50)]  # would land where the copy was
    np.testing.assert_array_equal(problem.solve(q).z, expected)
    del litter


def test_solver_keeps_converted_matrices():
    M, q = random_problem(2, 30)
    problem = perp.LCP(M[::-1, ::-1])
    expected = perp.lcp(np.ascontiguousarray(M[::-1, ::-1]), q).z
    gc.collect()
    litter = [np.full((30, 30), np.nan) for _ in range(50)]
    np.testing.assert_allclose(problem.solve(q).z, expected, rtol=0, atol=1e-9)
    del litter


def test_solver_lets_go_of_the_previous_matrix():
    M, _ = random_problem(3, 5)
    problem = perp.LCP(M)
    gone = weakref.ref(M)
    problem.setup(np.eye(5))
    del M
    gc.collect()
    assert gone() is None


def test_call_lets_go_of_everything():
    M, q = random_problem(4, 5)

    def monitor(progress):
        return None

    gone = [weakref.ref(x) for x in (M, q, monitor)]
    result = perp.lcp(M, q, monitor=monitor, method="pgs")
    del M, q, monitor
    gc.collect()
    assert [x() for x in gone] == [None] * 3
    assert result.ok


def test_objects_go_without_the_cycle_collector():
    gc.disable()
    try:
        problem = perp.LCP(np.eye(3), monitor=lambda progress: None)
        problem.solve(np.ones(3))
        gone = weakref.ref(problem)
        del problem
        assert gone() is None
    finally:
        gc.enable()


def test_results_do_not_share_memory():
    M, q = random_problem(5, 8)
    with perp.LCP(M) as problem:
        a = problem.solve(q)
        kept = a.z.copy()
        problem.solve(-q)
    np.testing.assert_array_equal(a.z, kept)
    assert a.z.flags.owndata and a.z.flags.writeable


def test_threads_side_by_side():
    """Calls, solvers and worlds of different threads give what they give alone."""
    problems = [random_problem(seed, 40) for seed in range(8)]
    alone = [perp.lcp(M, q).z for M, q in problems]
    answers, failures = {}, []

    def work(index):
        try:
            M, q = problems[index]
            solver = perp.LCP(M)
            for _ in range(20):
                answers[index] = perp.lcp(M, q).z, solver.solve(q).z
        except BaseException as error:
            failures.append(error)

    threads = [threading.Thread(target=work, args=(index,)) for index in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not failures
    for index, z in enumerate(alone):
        np.testing.assert_array_equal(answers[index][0], z)
        np.testing.assert_array_equal(answers[index][1], z)


def test_one_solver_from_several_threads():
    """They wait for each other."""
    M, q = random_problem(6, 40)
    solver = perp.LCP(M, method="pgs", monitor=lambda progress: None)
    expected = {sign: solver.solve(sign * q).z for sign in (1, -1)}
    failures = []

    def work(sign):
        for _ in range(20):
            try:
                np.testing.assert_array_equal(solver.solve(sign * q).z, expected[sign])
            except BaseException as error:
                failures.append(error)

    threads = [threading.Thread(target=work, args=(sign,)) for sign in (1, -1, 1, -1)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not failures


def test_world_read_by_one_thread_and_stepped_by_another():
    world = perp.World(gravity=[0, 0, 0])
    body = world.add_body(velocity=[1, 1, 1])
    steps = 2000
    stepping = threading.Thread(target=world.run, args=(steps * 2.0**-10, 2.0**-10))
    stepping.start()
    seen = [body.position for _ in range(500)]
    stepping.join()
    for x, y, z in seen:  # never a state half-way through a step
        assert x == y == z and (x * 2**10).is_integer()
    np.testing.assert_array_equal(body.position, [steps * 2.0**-10] * 3)


def test_other_threads_run_during_a_solve():
    """The interpreter's lock is free: a flag set by another thread ends the solve."""
    M, q = slow_problem(80)
    flag = threading.Event()
    threading.Timer(0.05, flag.set).start()
    result = perp.lcp(
        M,
        q,
        method="pgs",
        max_iterations=2**31 - 1,
        tol=1e-300,
        polish=False,
        monitor=lambda progress: flag.is_set(),
    )
    assert flag.is_set() or result.outcome in ("solved", "stalled", "rounding_limit")


def run(code):
    """One BLAS thread: OpenBLAS waits for its own workers at exit, and may do so for ever where a
    daemon thread is still inside a call. That is between it and such a program."""
    return subprocess.run(
        [sys.executable, "-X", "dev", "-c", code],
        capture_output=True,
        text=True,
        timeout=120,
        env=dict(os.environ, OPENBLAS_NUM_THREADS="1"),
    )


@pytest.mark.parametrize(
    "code",
    [
        "problem = perp.LCP(np.eye(3)); problem.solve(np.ones(3))",
        "import builtins; builtins.problem = perp.LCP(np.eye(3), monitor=print)",
        "world = perp.World(); body = world.add_body()",
        "a = [perp.LCP(np.eye(3))]; a.append(a)",
        """
import threading, time
problem = perp.LCP(np.eye(400) + 0.001)
work = lambda: [problem.solve(-np.ones(400)) for _ in range(10**6)]
threading.Thread(target=work, daemon=True).start()
time.sleep(0.05)
""",
    ],
)
def test_quiet_end_of_the_interpreter(code):
    ended = run("import numpy as np, perp\n" + code)
    assert (ended.returncode, ended.stderr) == (0, "")


@pytest.mark.skipif(not hasattr(os, "fork"), reason="no fork")
def test_after_a_fork():
    """The child makes contexts of its own, and may drop what the parent made."""
    code = """
import os, sys, numpy as np, perp
problem = perp.LCP(np.eye(3))
assert perp.lcp(np.eye(3), -np.ones(3)).ok
child = os.fork()
if child == 0:
    good = perp.lcp(np.eye(3), -np.ones(3)).ok and perp.LCP(np.eye(2)).solve(np.ones(2)).ok
    del problem
    os._exit(0 if good else 3)
assert problem.solve(-np.ones(3)).ok
sys.exit(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))
"""
    ended = run(code)
    assert (ended.returncode, ended.stderr) == (0, "")


def test_no_memory_is_lost():
    """Contexts and solvers made and dropped by the thousand: resident memory stays."""
    resource = pytest.importorskip("resource")
    M, q = random_problem(7, 60)

    def spend(times):
        for _ in range(times):
            perp.LCP(M).solve(q)
            perp.lcp(M, q, monitor=lambda progress: None, method="pgs")

    spend(50)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    spend(400)
    grown = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before
    # a solver of this size holds more than 50 kB: 400 of them would be 20 MB
    assert grown < 8_000
