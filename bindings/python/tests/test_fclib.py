"""FCLIB's files: what is written is read again, by the layout of FCLIB's own C library."""

import numpy as np
import pytest
import scipy.sparse as sparse
import scipy.sparse.linalg

h5py = pytest.importorskip("h5py")

import perp  # noqa: E402
from perp import fclib  # noqa: E402


def small_local():
    """One contact on a slope that sticks: W = 1, q pushes in and along."""
    return fclib.Problem(
        3, np.array([0.5]), W=sparse.eye(3, format="csc"), q=np.array([-1.0, 0.25, 0.0])
    )


def small_global():
    M = sparse.diags([2.0, 2.0, 2.0, 5.0], format="csc")
    H = sparse.csc_matrix(np.array([[0.0, 0, 1, 1], [1, 0, 0, 0], [0, 1, 0, 0]]))
    return fclib.Problem(
        3,
        np.array([0.5]),
        M=M,
        f=np.array([0.5, 0.0, -2.0, 0.0]),
        H=H,
        w=np.zeros(3),
        G=sparse.csc_matrix(np.array([[0.0, 0, 0, 1]])),
        b=np.array([0.0]),
    )


def write_matrix(group, matrix, form):
    """A matrix in one of the three forms of the C library."""
    stored = {"csc": matrix.tocsc, "csr": matrix.tocsr, "triplet": matrix.tocoo}[form]()
    group["m"], group["n"] = [matrix.shape[0]], [matrix.shape[1]]
    group["nzmax"] = [stored.nnz]
    group["nz"] = [{"csc": -1, "csr": -2, "triplet": stored.nnz}[form]]
    group["x"] = stored.data
    if form == "triplet":
        group["i"], group["p"] = stored.row, stored.col
    else:
        group["i"], group["p"] = stored.indices, stored.indptr


def arm(kind):
    """A guide, a contact with friction and a motor on three velocities: FCLIB has no such rows."""
    M, f = sparse.diags([2.0, 3.0, 0.5], format="csc"), np.array([1.0, -2.0, 3.0])
    H = sparse.csc_matrix([[0, 1.0, 0.2], [1, 0, 0.6], [1, 1, 0], [0, 1, -1], [0, 0, 1.0]])
    laws = dict(dim=np.array([2, 2]), mu=np.array([0.3, 0.2]), two_sided=np.array([1, 0]),
                lower=np.array([-0.4]), upper=np.array([0.4]))
    if kind == "global":
        return fclib.Problem(M=M, f=f, H=H, w=np.zeros(5), **laws)
    v = sparse.linalg.spsolve(M, f)
    return fclib.Problem(W=H @ sparse.linalg.spsolve(M, H.T.tocsc()), q=H @ v, **laws)


@pytest.mark.parametrize("kind", ["local", "global"])
def test_rows_that_fclib_has_no_place_for(tmp_path, kind):
    problem, path = arm(kind), tmp_path / "arm.hdf5"
    fclib.write(path, problem)
    with h5py.File(path) as file:
        assert "fclib_" + kind not in file  # FCLIB's readers don't take it for one of theirs
    again = fclib.read(path)
    assert np.array_equal(again.dim, [2, 2]) and np.array_equal(again.two_sided, [1, 0])
    assert again.lower == [-0.4] and again.upper == [0.4] and again.contacts == 2
    first, second = problem.solve(tol=1e-12), again.solve(tol=1e-12)
    assert first.ok and np.array_equal(first.impulse, second.impulse)
    assert np.array_equal(first.modes, second.modes) and len(first.modes) == 3
    other = arm("global" if kind == "local" else "local").solve(tol=1e-12)
    assert first.impulse == pytest.approx(other.impulse, abs=1e-9)
    with h5py.File(path, "a") as file:
        del file["perp_" + kind]["dims"]
        file["perp_" + kind]["dims"] = [2, 3]
    with pytest.raises(perp.Error, match="make 6 rows, expected 5"):
        fclib.read(path)


@pytest.mark.parametrize("form", ["csc", "csr", "triplet"])
def test_every_storage_is_read(tmp_path, form):
    matrix = sparse.csc_matrix(np.array([[4.0, 1, 0], [0, 3, 2], [0.5, 0, 5]]))
    path = tmp_path / "one.hdf5"
    with h5py.File(path, "w") as file:
        group = file.create_group("fclib_local")
        group["spacedim"] = [3]
        write_matrix(group.create_group("W"), matrix, form)
        group["vectors/q"], group["vectors/mu"] = [1.0, 2, 3], [0.7]
    problem = fclib.read(path)
    assert (problem.kind, problem.dim, problem.contacts) == ("local", 3, 1)
    assert np.array_equal(problem.W.toarray(), matrix.toarray())
    assert np.array_equal(problem.q, [1, 2, 3]) and np.array_equal(problem.mu, [0.7])


def test_triplets_that_meet_are_added(tmp_path):
    path = tmp_path / "one.hdf5"
    with h5py.File(path, "w") as file:
        group = file.create_group("fclib_local")
        group["spacedim"] = [2]
        W = group.create_group("W")
        W["m"], W["n"], W["nz"], W["nzmax"] = [2], [2], [3], [4]  # room for one more
        W["i"], W["p"], W["x"] = [0, 1, 0], [0, 1, 0], [1.0, 1.0, 0.5, 9.0]
        group["vectors/a"], group["vectors/mu"] = [1.0, 2], [0.7]  # an old name of q
    assert np.array_equal(fclib.read(path).W.toarray(), [[1.5, 0], [0, 1]])


@pytest.mark.parametrize("make", [small_local, small_global])
def test_what_is_written_is_read(tmp_path, make):
    problem = make()
    problem.title, problem.description = "A contact", "in words"
    problem.solution = fclib.Solution(r=np.array([1.0, -0.25, 0.0]), u=np.zeros(3))
    problem.guesses = [fclib.Solution(r=np.zeros(3)), problem.solution]
    path = tmp_path / "one.hdf5"
    fclib.write(path, problem)
    again = fclib.read(path)
    for name in ("W", "M", "H", "G"):
        one, two = getattr(problem, name), getattr(again, name)
        assert (one is None) == (two is None)
        assert one is None or np.array_equal(one.toarray(), two.toarray())
    for name in ("q", "f", "w", "b", "mu"):
        assert np.array_equal(getattr(problem, name), getattr(again, name))
    assert (again.title, again.description, again.math_info) == ("A contact", "in words", "")
    assert np.array_equal(again.solution.r, problem.solution.r) and again.solution.v is None
    assert len(again.guesses) == 2
    with h5py.File(path) as file:  # C reads a text up to its 0, and H as n by rows
        assert file[f"fclib_{problem.kind}/info/title"].dtype == "S10"
        if problem.kind == "global":
            assert file["fclib_global/H/m"][0] == 4 and file["fclib_global/H/n"][0] == 3


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda g: g.pop("W"), "W"),
        (lambda g: g["W"].pop("nz"), "no nz"),
        (lambda g: g["W"]["nz"].__setitem__(0, -3), "nz is -3"),
        (lambda g: g["W"]["i"].__setitem__(1, 3), r"i\[1\] is 3, expected 0 .. 2"),
        (lambda g: g["W"]["p"].__setitem__(1, 9), r"p\[1\] is 9"),
        (lambda g: g["W"]["p"].__setitem__(slice(1, 3), [2, 1]), "rise"),
        (lambda g: g["spacedim"].__setitem__(0, 4), "spacedim is 4"),
        (lambda g: g["spacedim"].__setitem__(0, 2), "no multiple of spacedim 2"),
        (lambda g: g["vectors"].pop("q"), "no q"),
        (lambda g: g.move("vectors/q", "vectors/mu2") or g.move("vectors/mu", "vectors/q"), "no mu"),
    ],
)
def test_damaged_files_say_what_is_wrong(tmp_path, change, said):
    path = tmp_path / "bad.hdf5"
    fclib.write(path, small_local())
    with h5py.File(path, "r+") as file:
        change(file["fclib_local"])
    with pytest.raises(perp.Error, match=said):
        fclib.read(path)


def test_other_files_are_refused(tmp_path):
    with h5py.File(tmp_path / "empty.hdf5", "w"):
        pass
    with pytest.raises(perp.Error, match="neither fclib_local nor fclib_global"):
        fclib.read(tmp_path / "empty.hdf5")
    (tmp_path / "text.hdf5").write_text("no HDF5")
    with pytest.raises(OSError):
        fclib.read(tmp_path / "text.hdf5")
    with pytest.raises(perp.Error, match="q is missing"):
        fclib.write(tmp_path / "none.hdf5", fclib.Problem(3, np.ones(1), W=sparse.eye(3)))


def test_solutions_in_closed_form():
    # sticks: r = -q, as |(-0.25, 0)| < 0.5
    result = small_local().solve(tol=1e-12)
    assert result.ok and list(result.modes) == ["stick"]
    assert np.allclose(result.impulse, [1, -0.25, 0], rtol=0, atol=1e-14)
    # The last velocity is held by the bilateral row. The normal one and the tangential ones have
    # mass 2 each: without contact (0.25, 0, -1), so that r_n = 2 and the contact slips by
    # 0.25 - 0.5 * 2 / 2 < 0: it sticks with r_t = -0.5.
    problem = small_global()
    result = problem.solve(tol=1e-12)
    assert result.ok and list(result.modes) == ["stick"]
    assert np.allclose(result.v, 0, atol=1e-15)
    assert np.allclose(result.impulse[:3], [2, -0.5, 0], rtol=0, atol=1e-14)


def test_local_and_global_forms_agree(tmp_path):
    """W = H M^-1 H', V = H M^-1 G', R = G M^-1 G' is the same problem, bilateral row and all."""
    problem = small_global()
    problem.f = np.array([3.0, 0.5, -2.0, 1.0])  # slips
    inverse = sparse.diags(1.0 / problem.M.diagonal())
    H, G = problem.H, problem.G
    local = fclib.Problem(
        3,
        problem.mu,
        W=H @ inverse @ H.T,
        q=H @ (inverse @ problem.f) + problem.w,
        V=H @ inverse @ G.T,
        R=G @ inverse @ G.T,
        s=G @ (inverse @ problem.f) + problem.b,
    )
    fclib.write(tmp_path / "local.hdf5", local)
    one = problem.solve(tol=1e-12)
    two = fclib.read(tmp_path / "local.hdf5").solve(tol=1e-12)
    assert one.ok and two.ok and list(one.modes) == list(two.modes) == ["slip"]
    assert np.allclose(one.velocity, two.velocity, rtol=0, atol=1e-14)
    assert np.allclose(one.impulse, two.impulse, rtol=0, atol=1e-14)


def test_the_command(tmp_path, capsys):
    for name, problem in (("one.hdf5", small_local()), ("two.hdf5", small_global())):
        fclib.write(tmp_path / name, problem)
    names = [str(tmp_path / "one.hdf5"), str(tmp_path / "two.hdf5")]
    assert fclib.main(names) == 0
    head, *lines = capsys.readouterr().out.splitlines()
    assert head.split()[:3] == ["file", "contacts", "outcome"]
    assert [line.split()[:3] for line in lines] == [
        ["one.hdf5", "1", "solved"],
        ["two.hdf5", "1", "solved"],
    ]
    (tmp_path / "text.hdf5").write_text("no HDF5")
    assert fclib.main([str(tmp_path / "text.hdf5"), names[0]]) == 2
    assert len(capsys.readouterr().out.splitlines()) == 3  # the other one is solved all the same
    assert fclib.main([*names, "--cone", "8", "--method", "lemke"]) == 0
