"""Finding and refusing libraries."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from test_layout import COMPILER, needs_compiler

import perp
import perp._mechanism_library


def try_import(library):
    environment = {**os.environ, "PERP_LIBRARY": str(library)}
    return subprocess.run(
        [sys.executable, "-c", "import perp; print(perp.version)"],
        env=environment,
        capture_output=True,
        text=True,
    )


def fake_library(folder, version, abi):
    source, library = folder / "fake.c", folder / "libperp.so"
    source.write_text(
        f"int perp_version(void) {{ return {version}; }}\n"
        f"int perp_abi_version(void) {{ return {abi}; }}\n"
    )
    subprocess.run([COMPILER, "-shared", "-fPIC", str(source), "-o", str(library)], check=True)
    return library


def test_version():
    assert perp.version >= (0, 1, 0)
    assert perp.version_text().startswith(".".join(map(str, perp.version)) + " ")
    assert perp.__version__ == "0.1.0"


def test_override_names_the_library_to_load():
    path = os.environ.get("PERP_LIBRARY")
    if not path:
        pytest.skip("the library came with the package")
    assert try_import(path).stdout.strip() == str(perp.version)


def test_override_that_is_missing_is_not_replaced_by_another_library(tmp_path):
    run = try_import(tmp_path / "nowhere.so")
    assert run.returncode == 1
    assert "ImportError" in run.stderr
    assert "nowhere.so" in run.stderr
    assert "PERP_LIBRARY" in run.stderr


def test_order_of_places(tmp_path, monkeypatch):
    (tmp_path / "lib").mkdir()
    library = tmp_path / "lib" / "libperp.so.0"
    library.touch()
    monkeypatch.setattr(sys, "prefix", str(tmp_path))
    monkeypatch.setattr(perp._library.ctypes.util, "find_library", lambda name: f"lib{name}.so")
    monkeypatch.setenv("PERP_LIBRARY", "mine.so")
    assert perp._library._candidates() == [("PERP_LIBRARY", "mine.so")]
    monkeypatch.delenv("PERP_LIBRARY")
    places = perp._library._candidates()
    assert places[-2:] == [("beside Python", str(library)), ("the system's", "libperp.so")]
    assert {origin for origin, _ in places[:-2]} <= {"inside the package"}


def test_the_conda_recipe_is_of_this_version():
    recipe = Path(__file__).parents[3] / "packaging" / "conda" / "meta.yaml"
    if not recipe.exists():
        pytest.skip("not in a checkout")
    assert f'set version = "{perp.__version__}"' in recipe.read_text()
    assert perp.__version__ == ".".join(map(str, perp.version))


@needs_compiler
@pytest.mark.parametrize(
    "version, abi, complaint",
    [(100, 7, "version 0.1.0 with ABI 7"), (99, 0, "version 0.0.99 with ABI 0")],
)
def test_other_abi_and_older_version_are_refused(tmp_path, version, abi, complaint):
    run = try_import(fake_library(tmp_path, version, abi))
    assert run.returncode == 1
    assert complaint in run.stderr
    assert "needs ABI 0, version 0.1.0 or later" in run.stderr


@needs_compiler
def test_library_of_something_else_is_refused(tmp_path):
    source, library = tmp_path / "other.c", tmp_path / "libother.so"
    source.write_text("int other(void) { return 0; }\n")
    subprocess.run([COMPILER, "-shared", "-fPIC", str(source), "-o", str(library)], check=True)
    run = try_import(library)
    assert run.returncode == 1
    assert "not a perp library" in run.stderr


def run_python(code, *arguments):
    return subprocess.run(
        [sys.executable, "-c", code, *map(str, arguments)], capture_output=True, text=True
    )


def test_the_second_library_is_loaded_when_it_is_used_first():
    code = (
        "import perp\n"
        "def loaded(): return 'perp-mechanism' in open('/proc/self/maps').read()\n"
        "perp.lcp([[1.0]], [-1.0]), perp.World(), dir(perp)\n"
        "before = loaded()\n"
        "perp.stribeck(1.0, 2.0)\n"
        "print(before, loaded())"
    )
    assert run_python(code).stdout.split() == ["False", "True"]


def test_every_name_is_there():
    assert set(perp.__all__) <= set(dir(perp))
    assert all(getattr(perp, name) is not None for name in perp.__all__)
    with pytest.raises(AttributeError, match="no attribute 'Mechanisms'"):
        _ = perp.Mechanisms


def test_a_missing_second_library_is_named(tmp_path):
    if not os.environ.get("PERP_LIBRARY"):
        pytest.skip("the libraries came with the package")
    alone = tmp_path / "libperp.so"
    shutil.copy(perp._library.library._name, alone)
    code = "import perp; perp.lcp([[1.0]], [-1.0]); perp.stribeck(1.0, 2.0)"
    run = subprocess.run(
        [sys.executable, "-c", code],
        env={**os.environ, "PERP_LIBRARY": str(alone)},
        capture_output=True,
        text=True,
    )
    assert run.returncode == 1
    assert f"no usable libperp-mechanism beside {alone} (PERP_LIBRARY)" in run.stderr


@needs_compiler
def test_the_second_library_refuses_another_version_of_the_first(tmp_path):
    """Another perp_version() is found first: every call that is given a context is refused."""
    code = (
        "import ctypes, sys\n"
        "from ctypes import byref, c_void_p\n"
        "fake, first, second = sys.argv[1:]\n"
        "ctypes.CDLL(fake, mode=ctypes.RTLD_GLOBAL)\n"
        "first, second = ctypes.CDLL(first), ctypes.CDLL(second)\n"
        "context, made = c_void_p(), c_void_p()\n"
        "first.perp_context_create(byref(context), None)\n"
        "print(second.perp_load_friction_create(context, byref(made), None, None))"
    )
    libraries = perp._library.library._name, perp._mechanism_library.library._name
    run = run_python(code, fake_library(tmp_path, 9900, 0), *libraries)
    assert run.stdout.strip() == str(perp._generated.CONSTANTS["PERP_ERROR_ABI"]), run.stderr


def test_importing_does_not_import_scipy():
    code = "import sys, perp; perp.lcp([[1.0]], [-1.0]); sys.exit('scipy' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code]).returncode == 0


def test_types_are_announced():
    folder = os.path.dirname(perp.__file__)
    assert os.path.exists(os.path.join(folder, "py.typed"))


def test_readme_example_runs():
    text = (Path(__file__).parents[1] / "README.md").read_text()
    code = text.split("```python\n")[1].split("```")[0]
    names = {}
    exec(code, names)
    assert names["r"].ok and list(names["r"].z) == [0.25, 0.5]
    assert list(names["brick"].velocity) == [0.0, 0.0]
