"""python -m perp: solve, version, check."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import perp
from perp import __main__ as command

DATA = Path(__file__).parents[3] / "examples" / "data"


def test_solves_matrix_market_files(tmp_path, capsys):
    """The price at 100 is 6.088: the README beside the files, and a binomial tree, say so."""
    pytest.importorskip("scipy")
    files = [str(DATA / f"put_{name}.mtx") for name in ("M", "q", "payoff")]
    assert command.main(["solve", *files, "--output", str(tmp_path / "z")]) == 0
    assert "LcpResult solved" in capsys.readouterr().out
    assert round(np.loadtxt(tmp_path / "z")[249], 3) == 6.088


def test_status_is_1_where_there_is_no_solution(tmp_path, capsys):
    pytest.importorskip("scipy")
    for name, number in (("M", "0"), ("q", "-1")):
        text = f"%%MatrixMarket matrix array real general\n1 1\n{number}\n"
        (tmp_path / f"{name}.mtx").write_text(text)
    files = [str(tmp_path / f"{name}.mtx") for name in "Mq"]
    assert command.main(["solve", *files]) == 1
    assert "infeasible" in capsys.readouterr().out
    with pytest.raises(SystemExit, match="q has shape"):
        files[1] = str(DATA / "put_q.mtx")
        command.main(["solve", *files])
    with pytest.raises(SystemExit, match="expected M.mtx q.mtx"):
        command.main(["solve", files[0]])
    with pytest.raises(SystemExit, match="nowhere"):
        command.main(["solve", files[0], "nowhere"])


def test_solves_files_of_fclib(tmp_path, capsys):
    pytest.importorskip("h5py")
    from perp import fclib

    sparse = pytest.importorskip("scipy.sparse")
    one = sparse.identity(3, format="csc")
    problem = fclib.Problem(3, np.array([0.5]), W=one, q=np.array([-1.0, 0.25, 0.0]))
    fclib.write(tmp_path / "p.hdf5", problem)
    assert command.main(["solve", str(tmp_path / "p.hdf5")]) == 0
    assert "solved" in capsys.readouterr().out


def test_version_names_the_library(capsys):
    assert command.main(["version"]) == 0
    said = capsys.readouterr().out
    assert perp.version_text() in said and perp._library.library._name in said


def test_check_solves_problems_with_known_answers(capsys):
    assert command.main(["check"]) == 0
    said = capsys.readouterr().out
    assert said.count(" ok, error") >= len(command._CHECKS) - 1  # one needs SciPy
    assert said.endswith("this installation works\n")


def test_check_finds_wrong_answers(capsys, monkeypatch):
    right = perp.lcp

    def wrong(*arguments, **options):
        answer = right(*arguments, **options)
        answer.z *= 1 + 1e-6
        return answer

    monkeypatch.setattr(perp, "lcp", wrong)
    monkeypatch.setattr(perp, "ncp", None)
    assert command.main(["check"]) == 1
    said = capsys.readouterr().out
    assert said.count("WRONG") >= 2 and "FAILED, TypeError" in said
    assert f"of {len(command._CHECKS)} failed" in said


def test_runs_as_a_module():
    run = subprocess.run([sys.executable, "-m", "perp"], capture_output=True, text=True)
    assert run.returncode == 2 and "solve | version | check" in run.stderr
