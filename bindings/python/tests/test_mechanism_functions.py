"""What a mechanism refuses, what its functions may raise, and what lives how long."""

import gc
import os
import signal
import subprocess
import sys
import threading
import tracemalloc
import weakref

import numpy as np
import pytest
from test_mechanism import falling, ramp

import perp
from perp import _generated, _mechanism_library
from perp._mechanism_callbacks import takes_time


@pytest.mark.parametrize(
    "function, expected",
    [
        (lambda q: 0, False),
        (lambda t, q: 0, True),
        (lambda q, scale=1: 0, False),
        (lambda t, q, scale=1: 0, True),
        (lambda *arguments: 0, False),
        (max, False),  # has no signature
    ],
)
def test_who_gets_the_time(function, expected):
    assert takes_time(function) == expected


## Refusals


@pytest.mark.parametrize(
    "arguments, text",
    [
        (dict(n=0), "n is 0"),
        (dict(n=1.5), "n is 1.5"),
        (dict(coordinates=0), "coordinates is 0"),
        (dict(coordinates=2), "kinematics"),
        (dict(mu=-0.1), "mu"),
        (dict(mu=[0.5, np.nan]), r"mu\[1\]"),
        (dict(mu=0.5, mu_static=0.4), "mu_static"),
        (dict(restitution=1.5), "restitution"),
        (dict(restitution=[0.5, -1]), r"restitution\[1\]"),
        (dict(mu=[1, 2], restitution=[0, 0, 0]), "restitution has shape"),
        (dict(stribeck=-1.0), "stribeck"),
        (dict(law="kick"), "law is 'kick', expected one of 'moreau'"),
        (dict(dim=4), "dim is 4"),
        (dict(dim=[2, 2], contact_count=3), "dim has 2 entries for 3 contacts"),
        (dict(contacts=None, contact_count=1), "contact_rows"),
        (dict(bilateral_count=1), "bilateral_rows"),
        (dict(tresca_count=1), "dry_rows"),
        (dict(contact_count=-1), "contact_count"),
        (dict(contacts=3), "contacts is neither callable nor None"),
        (dict(mass=[[1, 2], [3, 4]]), r"mass has shape \(2, 2\), expected \(1, 1\)"),
        (dict(force="much"), "force is not an array of numbers"),
    ],
)
def test_refusals(arguments, text):
    good = dict(n=1, contacts=lambda q: ([q[0]] * 2, [[1.0]] * 2))
    with pytest.raises(ValueError, match=text):
        perp.Mechanism(**{**good, **arguments})


@pytest.mark.parametrize(
    "arguments, text",
    [
        (dict(mass=lambda q: np.eye(3)), r"mass\(q\) has shape \(3, 3\), expected \(2, 2\)"),
        (dict(mass=lambda q: "heavy"), r"mass\(q\) is not an array of numbers"),
        (dict(mass=[1, -1]), "M"),
        (dict(mass=[[1, 0.5], [0, 1]]), "M"),
        (dict(mass=[1, np.nan]), "M"),
        (dict(force=lambda t, q, v: [1.0]), r"force\(t, q, v\) has shape \(1,\), expected \(2,\)"),
        (dict(force=lambda t, q, v: [1j, 0]), r"force\(t, q, v\) is complex"),
        (dict(force=[np.inf, 0]), "k"),
        (dict(contacts=lambda q: 3.0), r"contacts\(q\) returned float, expected gap, normal"),
        (dict(contacts=lambda q: None), r"contacts\(q\) returned NoneType"),
        (dict(contacts=lambda q: (1,)), r"contacts\(q\) returned 1 items"),
        (dict(contacts=lambda q: {"gap": 1, "normals": 2}), "has 'normals', expected gap"),
        (dict(contacts=lambda q: {"gap": 1}), r"contacts\(q\) returned no normal"),
        (
            dict(contacts=lambda t, q: ([1, 2], [[1, 0]])),
            r"contacts\(t, q\): normal has shape \(1, 2\), expected \(2, 2\)",
        ),
        (
            dict(contacts=lambda q: ([1.0], [[1, 0]], [[1, 0, 0]])),
            r"contacts\(q\): tangent has shape \(1, 3\), expected \(1, 2\) or \(1, 2, 2\)",
        ),
        (
            dict(contacts=lambda q: ([1.0], [[1, 0]], [[0, 1]]), mu=[0, 0]),
            r"contacts\(q\): gap has shape \(1,\), expected \(2,\)",
        ),
        (
            dict(contacts=lambda q: ([1.0], [[1, 0]], [[0, 1]], [1, 2, 3])),
            r"contacts\(q\): drift has shape \(3,\)",
        ),
        (dict(contacts=lambda q: ([1.0], [[1, 0]]), dim=2), r"contacts\(q\) returned no tangent"),
        (
            dict(contacts=lambda q: ([1.0], [[1, 0]], [[0, 1]]), dim=1),
            r"contacts\(q\) returned a tangent, but dim is 1",
        ),
        (
            dict(contacts=lambda q: ([1.0], [[1, 0]], [[0, 1]], None, [-1])),
            r"mu\[0\]",
        ),
        (dict(contacts=lambda q: ([np.nan], [[1, 0]])), "gap"),
        (dict(contacts=lambda q: ([0], [[np.nan, 0]])), "H"),
        (
            dict(bilateral=lambda q: ([0.0], [[1, 0, 0]])),
            r"bilateral\(q\): G has shape \(1, 3\), expected \(1, 2\)",
        ),
        (dict(bilateral=lambda q: ([np.nan], [[1, 0]])), "c"),
        (dict(tresca=([1.0], [[1, 0, 0]])), r"tresca: B has shape \(1, 3\)"),
        (dict(tresca=(-1.0, [[1, 0]])), "bound"),
        (
            dict(kinematics=lambda q, v: [1.0]),
            r"kinematics\(q, v\) has shape \(1,\), expected \(2,\)",
        ),
        (dict(normalise=lambda q: None), r"normalise\(q\)"),
    ],
)
def test_refusals_of_what_functions_return(arguments, text):
    m = perp.Mechanism(2, **arguments)
    with pytest.raises(ValueError, match=text):
        m.step(0, [0, 0], [0, 0], 0.1)


@pytest.mark.parametrize(
    "arguments, text",
    [
        (dict(q=[0, 0]), r"q has shape \(2,\), expected \(1,\)"),
        (dict(v=[[0]]), r"v has shape \(1, 1\)"),
        (dict(q=[np.nan]), r"q0?\[0\]"),
        (dict(v=[np.inf]), r"v0?\[0\]"),
        (dict(t=np.nan), r"t\[0\] is nan"),
        (dict(h=0), "h is"),
        (dict(h=-1), "h is"),
        (dict(scheme="leapfrog"), "scheme is 'leapfrog'"),
        (dict(cone=2), "cone is 2"),
        (dict(tol=0), "tol"),
        (dict(theta=2, scheme="theta"), "theta"),
        (dict(time_limit=-1), "time_limit"),
    ],
)
def test_refusals_of_states_and_settings(arguments, text):
    with pytest.raises(ValueError, match=text):
        ramp().step(**{**dict(t=0, q=[0], v=[1], h=0.1), **arguments})


def test_refusals_of_runs():
    for arguments, text in (
        (dict(t_end=0), "t1"),
        (dict(dt=0), "h"),
        (dict(error=-1), "error"),
        (dict(shortest=-1), "shortest"),
    ):
        with pytest.raises(ValueError, match=text):
            ramp().simulate(**{**dict(q0=[0], v0=[1], t_end=1, dt=0.1), **arguments})


def test_a_refusal_leaves_the_old_settings():
    m = ramp()
    before = m.simulate([0], [2], 1.0, 0.1)
    with pytest.raises(ValueError, match="tol"):
        m.simulate([0], [2], 1.0, 0.1, tol=-1)
    np.testing.assert_array_equal(m.simulate([0], [2], 1.0, 0.1).q, before.q)


## What functions raise


class Mine(Exception):
    pass


NAMES = ("mass", "force", "contacts", "bilateral", "tresca", "kinematics", "normalise")


def complete(fail):
    """A mechanism that calls every function."""

    def said(name, answer):
        def function(*arguments):
            fail(name)
            return answer(*arguments)

        return function

    functions = dict(
        mass=said("mass", lambda q: np.eye(3)),
        force=said("force", lambda t, q, v: [0, 0, -1]),
        contacts=said("contacts", lambda q: ([q[2]], [[0, 0, 1]])),
        bilateral=said("bilateral", lambda q: ([q[0]], [[1, 0, 0]])),
        tresca=said("tresca", lambda t, q, v: ([0.1], [[0, 1, 0]])),
        kinematics=said("kinematics", lambda q, v: v),
        normalise=said("normalise", lambda q: q),
    )
    sizes = dict(contact_count=1, dim=1, bilateral_count=1, tresca_count=1, tresca_dim=1)
    return perp.Mechanism(3, **functions, **sizes)


@pytest.mark.parametrize("which", [*NAMES, "callback"])
@pytest.mark.parametrize("error", [Mine, KeyboardInterrupt, SystemExit])
def test_exceptions_come_out(which, error):
    calls = []

    def fail(name):
        calls.append(name)
        if name == which and calls.count(name) == 3:
            raise error("from inside")

    m = complete(fail)
    with pytest.raises(error, match="from inside"):
        m.simulate([0, 0, 0], [0, 1, 0], 1.0, 0.1, callback=lambda step: fail("callback"))
    assert calls.count(which) == 3 and calls[-1] == which  # nothing is called after it
    assert m.step(0, [0, 0, 0], [0, 1, 0], 0.1).ok  # and the mechanism is as good as before


def test_functions_may_not_use_their_own_mechanism():
    def force(t, q, v):
        m.step(0, q, v, 0.1)

    m = perp.Mechanism(1, force=force)
    with pytest.raises(perp.Error) as caught:
        m.step(0, [0], [0], 0.1)
    assert caught.value.name == "PERP_ERROR_BUSY"


def test_functions_may_use_another():
    other = perp.Mechanism(1, force=[1.0])
    m = perp.Mechanism(1, force=lambda t, q, v: other.step(t, q, v, 1.0).v - v)
    assert m.step(0, [0], [0], 0.5).v == 0.5


INTERRUPTED = """
import os, signal, threading
import perp
m = perp.Mechanism(1, force=[-1.0], contacts=lambda q: (q, [[1.0]]))
signal.signal(signal.SIGINT, signal.default_int_handler)  # a job in the background ignores it
threading.Timer(0.3, lambda: os.kill(os.getpid(), signal.SIGINT)).start()
try:
    while True:
        m.simulate([0], [0], 1e6, 1e-3)
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


## Lifetime


def test_nothing_is_kept_alive():
    m = falling()
    m.step(0, [1], [0], 0.1)
    run = m.simulate([1], [0], 0.1, 0.01, callback=lambda step: None)
    handle = m._handle
    gone = [weakref.ref(x) for x in (m, m._callbacks, m._handle._context)]
    finalizer = handle._finalizer
    del m, handle
    gc.collect()
    assert [x() for x in gone] == [None] * 3 and not finalizer.alive
    assert run.ok


def test_the_first_handle_is_released():
    m = falling()
    first = m._handle._finalizer
    m.step(0, [1], [0], 0.1)
    assert not first.alive and m._handle._finalizer.alive


def test_close():
    with ramp() as m:
        m.step(0, [0], [1], 0.1)
    m.close()
    for call in (lambda: m.step(0, [0], [1], 0.1), lambda: m.simulate([0], [1], 1, 0.1)):
        with pytest.raises(perp.Error, match="closed"):
            call()


def test_threads():
    shared, answers = falling(restitution=0.5), [None] * 4

    def work(k):
        m = shared if k % 2 else falling(restitution=0.5)
        answers[k] = m.simulate([1], [0], 0.6, 0.01).q

    threads = [threading.Thread(target=work, args=(k,)) for k in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    for answer in answers:
        np.testing.assert_array_equal(answer, answers[0])


def test_defaults_are_the_librarys():
    """Python states defaults of its own, so that help() shows them."""
    theirs = _mechanism_library.defaults(_generated.MechanismSettings)
    words = {
        "scheme": _mechanism_library.MECHANISM_SCHEMES,
        "select": _mechanism_library.MECHANISM_SELECTIONS,
    }
    calls = (perp.Mechanism.step, perp.Mechanism.simulate)
    for name in {name for call in calls for name in call.__kwdefaults__}:
        stated = {call.__kwdefaults__[name] for call in calls if name in call.__kwdefaults__}
        assert len(stated) == 1
        (value,) = stated
        if name == "cone":
            assert value == "exact" and theirs.cone == 0
        elif name == "time_limit":
            assert value is None and theirs.time_limit == 0
        elif name in ("t0", "callback"):
            assert not value
        else:
            assert words.get(name, {}).get(getattr(theirs, name), getattr(theirs, name)) == value
    law = _mechanism_library.MECHANISM_LAWS[theirs.law]
    assert perp.Mechanism.__init__.__kwdefaults__["law"] == law
    assert list(_mechanism_library.MECHANISM_SELECTIONS.values()) == ["any", "nearest", "freest"]
    assert list(_mechanism_library.MECHANISM_SCHEMES.values()) == ["frozen", "implicit", "theta"]
    laws = list(_mechanism_library.MECHANISM_LAWS.values())
    assert laws == ["moreau", "newton", "poisson", "stronge"]


def test_runs_keep_what_they_need():
    """A run of many steps takes the memory of its arrays, not of an object for each step."""
    tracemalloc.start()
    run = perp.Mechanism(1).simulate([0], [1], 1.0, 1e-4)
    kept, _ = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert len(run.t) == 10001
    # t, q and v are 24 bytes a step; bytearrays grow by an eighth at a time
    assert kept < 100 * len(run.t)
    run.q[:] = 0  # may be written
