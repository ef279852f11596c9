"""Monitors, exceptions in them, and Ctrl-C."""

import os
import signal
import subprocess
import sys
import threading

import numpy as np
import pytest
from test_lcp import random_problem, slow_problem

import perp

SLOW = {"method": "pgs", "max_iterations": 2**31 - 1, "tol": 1e-14, "polish": False}


@pytest.mark.parametrize("method", ["pgs", "fischer", "lemke"])
def test_monitor_sees_the_solve(method):
    M, q = random_problem(1, 40)
    seen = []
    result = perp.lcp(M, q, method=method, monitor=seen.append)
    assert result.ok
    assert seen
    assert all(progress.method == method for progress in seen)
    iterations = [progress.iterations for progress in seen]
    assert iterations == sorted(iterations)
    assert all(progress.residual >= 0 for progress in seen)
    if method == "pgs":
        assert seen[-1].residual < seen[0].residual


def test_monitor_changes_no_bit():
    M, q = random_problem(2, 40)
    for method in ("pgs", "fischer", "lemke"):
        a = perp.lcp(M, q, method=method)
        b = perp.lcp(M, q, method=method, monitor=lambda progress: None)
        np.testing.assert_array_equal(a.z, b.z)


@pytest.mark.parametrize("answer", [True, 1, "enough", np.bool_(True)])
def test_true_answer_stops(answer):
    M, q = slow_problem(60)
    seen = []
    result = perp.lcp(
        M, q, **SLOW, monitor=lambda p: seen.append(p) or (p.iterations >= 5 and answer)
    )
    assert result.outcome == "stopped" and not result.ok
    assert result.iterations == seen[-1].iterations
    assert np.all(result.z >= 0) and np.any(result.z > 0)


class Odd(BaseException):
    pass


@pytest.mark.parametrize("kind", [RuntimeError, KeyboardInterrupt, SystemExit, StopIteration, Odd])
def test_exceptions_come_out_of_the_call(kind):
    M, q = slow_problem(60)

    def fail(progress):
        raise kind("from the monitor")

    with pytest.raises(kind, match="from the monitor") as caught:
        perp.lcp(M, q, **SLOW, monitor=fail)
    assert caught.value.__context__ is None
    assert "fail" in [entry.name for entry in caught.traceback]
    problem = perp.LCP(M, **SLOW, monitor=fail)
    for _ in range(2):
        with pytest.raises(kind, match="from the monitor"):
            problem.solve(q)
    assert perp.lcp(M, q).ok


def test_monitor_may_solve_something_else():
    M, q = slow_problem(60)
    inner = []

    def monitor(progress):
        inner.append(perp.lcp([[2.0]], [-1.0]).z[0])
        return len(inner) == 3

    assert perp.lcp(M, q, **SLOW, monitor=monitor).outcome == "stopped"
    assert inner == [0.5] * 3


def test_monitor_may_not_enter_its_own_solver():
    M, q = slow_problem(60)
    problem = perp.LCP(M, **SLOW, monitor=lambda progress: problem.solve(q))
    with pytest.raises(perp.Error) as caught:
        problem.solve(q)
    assert caught.value.name == "PERP_ERROR_BUSY"


def test_large_solve_is_watched_without_a_monitor():
    """On the main thread only: signals reach no other."""
    assert not perp._monitor.needs_watch(None, 100, 0)
    assert perp._monitor.needs_watch(None, 10**6, 0)
    assert perp._monitor.needs_watch(None, 4, 2**31 - 1)
    assert perp._monitor.needs_watch(print, 4, 0)
    answers = []
    thread = threading.Thread(
        target=lambda: answers.append(perp._monitor.needs_watch(None, 10**6, 0))
    )
    thread.start()
    thread.join()
    assert answers == [False]


# Each program is interrupted by its own timer while it is inside the library, and must end with
# the exception of the signal's handler.
INTERRUPTED = """
import os, signal, sys, threading
import numpy as np
import perp
n = {n}
# springs in a row with loose ends, each weakly held: pgs would need some 1e6 sweeps, and gains
# just enough in each thousand of them not to be called stalled
M, q = 2 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1), -np.ones(n)
M[0, 0] = M[-1, -1] = 1
M += 2e-5 * np.eye(n)
settings = dict(method="pgs", max_iterations=2**31 - 1, tol=1e-14, polish=False)
{handler}
threading.Timer(0.3, lambda: os.kill(os.getpid(), signal.{signal})).start()
try:
    {call}
except {exception} as error:
    print("interrupted", perp.lcp([[2.0]], [-1.0]).z[0])
"""

CALLS = {
    "lcp, large": (300, "perp.lcp(M, q, **settings)"),
    "lcp, small": (99, "perp.lcp(M, q, **settings)"),
    "LCP": (300, "perp.LCP(M, **settings).solve(q)"),
    "with a monitor": (300, "perp.lcp(M, q, **settings, monitor=lambda p: None)"),
}


def run_interrupted(**parts):
    return subprocess.run(
        [sys.executable, "-c", INTERRUPTED.format(**parts)],
        capture_output=True,
        text=True,
        timeout=100,  # of a solve that nothing stops
    )


@pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")
@pytest.mark.parametrize("name", CALLS)
def test_ctrl_c(name):
    n, call = CALLS[name]
    run = run_interrupted(
        n=n,
        call=call,
        # a job in the background ignores it
        handler="signal.signal(signal.SIGINT, signal.default_int_handler)",
        signal="SIGINT",
        exception="KeyboardInterrupt",
    )
    assert (run.stdout, run.stderr) == ("interrupted 0.5\n", "")


@pytest.mark.skipif(not hasattr(signal, "SIGALRM"), reason="signals of POSIX")
def test_other_signals_whose_handlers_raise():
    run = run_interrupted(
        n=300,
        call="perp.lcp(M, q, **settings)",
        handler="signal.signal(signal.SIGALRM, lambda *_: 1 / 0)",
        signal="SIGALRM",
        exception="ZeroDivisionError",
    )
    assert (run.stdout, run.stderr) == ("interrupted 0.5\n", "")
