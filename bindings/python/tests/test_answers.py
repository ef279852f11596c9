"""What results share: truth, SciPy's names, pickles, tables, pictures; words for type checkers."""

import pickle
import subprocess
import sys
import typing

import numpy as np
import pytest

import perp
from perp import _answer, _generated, _library, _mechanism_library

M, Q = [[2.0, 1.0], [1.0, 2.0]], [-1.0, 1.0]


def lcp():
    return perp.lcp(M, Q)


def failed():
    """No solution: w = -1 whatever z is."""
    return perp.lcp([[0.0]], [-1.0])


def ncp():
    return perp.ncp(lambda z: z**3 - 8, [1.0])


def contact():
    """Two masses on the floor: one pushed by less than mu times its weight, one by more."""
    return perp.contact(np.eye(6), [-1, 0.25, 0, -1, 2, 0], np.eye(6), mu=0.5)


def step():
    world = perp.World()
    world.add_body(mass=1.0)
    return world.step(0.1)


def run():
    world = perp.World()
    world.add_body(mass=1.0)
    return world.run(0.2, 0.1)


def mechanism():
    return perp.Mechanism(1, force=[1.0]).simulate([0.0], [0.0], 1.0, 0.25)


def mechanism_step():
    return perp.Mechanism(1, force=[1.0]).step(0, [0.0], [0.0], 0.25)


ALL = [lcp, failed, ncp, contact, step, run, mechanism, mechanism_step]
OTHERS = {
    "verify": lambda: perp.lcp_verify(M, Q, [0.5, 0.0]),
    "all": lambda: perp.lcp_all(M, Q)[0],
    "batch": lambda: perp.lcp_batch([M], [Q]),
    "jacobian": lambda: perp.ncp_check_jacobian(lambda z: z**2, lambda z: np.diag(2 * z), [1.0]),
    "accelerations": lambda: perp.Mechanism(1, force=[1.0]).accelerations(0, [0.0], [0.0]),
    "load": lambda: perp.load_friction(1.0, 0.0, 1.0, 0.0, 0.1, 1.0, 1.0),
}


@pytest.mark.parametrize("make", ALL)
def test_truth_is_ok_and_scipys_names_are_there(make):
    r = make()
    assert bool(r) is r.ok is r.success is (make is not failed)
    assert r.message.startswith(r.outcome + ": ")
    assert isinstance(r.nit, int) and r.nit >= 0


def test_messages_know_every_outcome():
    assert set(_answer._MESSAGES) == set(_library.OUTCOMES.values())


def test_message_says_what_a_ray_proves():
    r = failed()
    assert r.certificate == "infeasible"
    assert r.message == "ray: the ray proves that there is no solution"


def test_counts_by_scipys_names():
    r = ncp()
    assert (r.nit, r.nfev, r.njev) == (r.iterations, r.function_evaluations, r.jacobian_evaluations)


def same(a, b):
    if isinstance(a, np.ndarray):
        assert a.dtype == b.dtype and a.shape == b.shape and a.tobytes() == b.tobytes()
    elif hasattr(a, "__dict__") and not isinstance(a, type):
        assert type(a) is type(b) and vars(a).keys() == vars(b).keys()
        for name, value in vars(a).items():
            same(value, vars(b)[name])
    elif isinstance(a, (list, tuple)):
        assert len(a) == len(b)
        for x, y in zip(a, b):
            same(x, y)
    else:
        assert a == b or (a != a and b != b)


@pytest.mark.parametrize("make", [*ALL, *OTHERS.values()])
def test_results_pickle(make):
    r = make()
    same(r, pickle.loads(pickle.dumps(r)))


@pytest.mark.parametrize("make", [lambda: perp.World(), lambda: perp.LCP(M)])
def test_memory_of_the_library_does_not_pickle(make):
    with pytest.raises(TypeError, match="can't be pickled"):
        pickle.dumps(make())


@pytest.mark.parametrize("make", ALL)
def test_results_show_themselves(make):
    r = make()
    assert "\n" not in repr(r) and len(repr(r)) < 200
    lines = str(r).split("\n")
    assert lines[0] == repr(r) and len(lines) == 1 + len(vars(r))
    assert max(map(len, lines)) < 200
    html = r._repr_html_()
    assert html.count("<tr>") == html.count("</tr>") == len(vars(r))
    assert "&lt;perp." in html and "<perp." not in html


def test_large_arrays_show_in_a_line():
    r = perp.lcp(np.eye(1000), -np.ones(1000))
    assert "... " in str(r) and "(1000)" in str(r) and len(str(r)) < 3000


def test_history_is_of_the_solve_it_watched():
    history = perp.History()
    with perp.LCP(np.diag([2.0, 3.0]), method="pgs", monitor=history) as problem:
        first, second = problem.solve([-1.0, -1.0]), problem.solve([-2.0, 1.0])
    assert first.history and second.history
    assert [*first.history, *second.history] == list(history)
    assert all(entry.method == "pgs" for entry in history)
    assert perp.lcp(M, Q).history is None


def test_plots_have_what_is_known():
    pytest.importorskip("matplotlib").use("Agg")
    r = perp.lcp(M, Q, method="pgs", monitor=perp.History())
    figure = r.plot()
    residuals, values = figure.axes
    assert residuals.get_yscale() == "log"
    assert list(residuals.lines[0].get_ydata()) == [x.residual for x in r.history]
    assert list(values.lines[0].get_ydata()) == list(r.z)
    impulses, cones = contact().plot().axes
    assert [bar.get_height() for bar in impulses.patches] == [1, 1]
    points = {line.get_label(): line.get_xydata().tolist() for line in cones.lines}
    # stuck well within its cone, and slipping on it: mu r_n = 0.5, |r_t| = 0.25 and 0.5
    assert points["stick"] == [[0.5, 0.25]]
    np.testing.assert_allclose(points["slip"], [[0.5, 0.5]], rtol=1e-8)  # tol of the solve
    q, v, _ = mechanism().plot().axes
    np.testing.assert_allclose(v.lines[0].get_ydata(), [0, 0.25, 0.5, 0.75, 1], rtol=1e-15)
    assert q.get_xlabel() == "t"


def test_plots_go_into_given_axes():
    pyplot = pytest.importorskip("matplotlib.pyplot")
    figure, axes = pyplot.subplots(1, 2)
    assert contact().plot(axes) is figure
    with pytest.raises(ValueError, match="axes has 1 entries for 2 pictures"):
        contact().plot(axes[0])
    pyplot.close("all")


def test_plots_say_how_to_get_matplotlib():
    code = (
        "import sys; sys.modules['matplotlib'] = None\n"
        "import perp\n"
        "perp.lcp([[1.0]], [-1.0]).plot()"
    )
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert run.returncode == 1
    assert "ImportError: plots need matplotlib: pip install 'perp[plot]'" in run.stderr


def test_importing_does_not_import_matplotlib():
    code = "import sys, perp; perp.lcp([[1.0]], [-1.0]); sys.exit('matplotlib' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code]).returncode == 0


@pytest.mark.parametrize(
    "literal, words",
    [
        (_generated.LcpMethod, _library.METHODS.values()),
        (_generated.NcpMethod, _library.NCP_METHODS.values()),
        (_generated.ContactMethod, _library.CONTACT_METHODS.values()),
        (_generated.PivotRule, _library.codes("PERP_PIVOT_")),
        (_generated.Sweep, _library.codes("PERP_SWEEP_")),
        (_generated.AccelerationMethod, _library.codes("PERP_ACCELERATION_")),
        (_generated.Accuracy, _library.codes("PERP_ACCURACY_")),
        (_generated.Scheme, _mechanism_library.MECHANISM_SCHEMES.values()),
        (_generated.Selection, _mechanism_library.MECHANISM_SELECTIONS.values()),
        (_generated.ImpactLaw, _mechanism_library.MECHANISM_LAWS.values()),
        (_generated.BodyKind, _library.codes("PERP_BODY_")),
        (_generated.JointKind, _library.codes("PERP_JOINT_")),
        (_generated.Outcome, _library.OUTCOMES.values()),
    ],
)
def test_literals_are_the_librarys_words(literal, words):
    # three words of methods are answers alone: no caller can ask for them
    assert set(typing.get_args(literal)) == set(words) - {"polish", "patterns", "mprgp"}


## Arguments as users of SciPy write them


def cube(z):
    return z**3 - 8


def slope(z):
    return np.diag(3 * z**2)


@pytest.mark.parametrize(
    "call",
    [
        lambda: perp.ncp(cube, slope, [1.0]),
        lambda: perp.ncp(cube, None, [1.0]),
        lambda: perp.ncp(cube, [1.0]),
        lambda: perp.ncp(cube, [1.0], jac=slope),
        lambda: perp.ncp(cube, z0=[1.0], jac=slope),
        lambda: perp.ncp(cube, z0=[1.0]),
    ],
)
def test_jacobian_may_come_by_keyword_or_not_at_all(call):
    r = call()
    assert r.ok
    np.testing.assert_allclose(r.z, [2.0], rtol=1e-12)  # 3 z^2 = 12: tol / 12 beside 2


def test_missing_and_doubled_arguments_are_refused():
    with pytest.raises(ValueError, match="z0 is missing"):
        perp.ncp(cube, slope)
    with pytest.raises(ValueError, match="J and jac are the same thing"):
        perp.ncp(cube, slope, [1.0], jac=slope)
    with pytest.raises(ValueError, match="mu is missing"):
        perp.contact([[1.0]], [1.0], [[1.0]])


def test_contacts_that_do_not_move_need_no_w():
    r = contact()
    assert list(r.modes) == ["stick", "slip"]
    np.testing.assert_array_equal(r.impulse, perp.contact(
        np.eye(6), [-1, 0.25, 0, -1, 2, 0], np.eye(6), np.zeros(6), 0.5).impulse)


def test_rows_of_contacts_are_found_where_they_start():
    """A rolling contact has two rows more, a spinning one one more."""
    r = perp.contact(
        np.eye(9), -np.ones(9), np.eye(9), mu=[0.5, 0.25], rolling=[0.1, 0.0], spinning=[0.1, 0.0]
    )
    assert list(r.starts) == [0, 6] and list(r.dims) == [3, 3] and list(r.mu) == [0.5, 0.25]


def test_kept_solvers_answer_as_the_functions_do():
    """jac=, w left out, a history of each solve, and pictures with rows that have bounds."""
    history = perp.History()
    with perp.NCP(cube, [1.0], jac=slope, monitor=history) as problem:
        r = problem.solve()
        assert r.success and len(r.history) > 0 and problem.solve().history is not r.history
        np.testing.assert_allclose(r.z, [2.0], rtol=1e-12)  # 3 z^2 = 12: tol / 12 beside 2
    with perp.ContactSolver(
        np.eye(7), np.eye(7), 0.5, bounds=([0.0], np.inf), method="newton", monitor=perp.History()
    ) as solver:
        r = solver.solve([-1, 0.25, 0, -1, 2, 0, 3.0])
        assert r.success and list(r.modes) == ["stick", "slip", "lower"]
        assert r.history is not None
        r.plot()
    with pytest.raises(ValueError, match="mu is missing"):
        perp.ContactSolver(np.eye(3), np.eye(3), None)
