"""The structs as Python declares them, against what a C compiler makes of the headers."""

import ctypes
import shutil
import subprocess

import numpy as np
import pytest
from conftest import ROOT

import perp
from perp import _library, _structures

COMPILER = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")
needs_compiler = pytest.mark.skipif(COMPILER is None, reason="no C compiler on this machine")


def run_c(folder, body):
    """Compiles and runs the body of a main() that sees the headers; returns the lines printed."""
    source, program = folder / "program.c", folder / "program"
    source.write_text(
        "#include <perp/perp.h>\n#include <stddef.h>\n#include <stdio.h>\n"
        "int main(void) {\n" + body + "\nreturn 0; }\n"
    )
    subprocess.run(
        [COMPILER, "-std=c99", f"-I{ROOT / 'include'}", str(source), "-o", str(program)], check=True
    )
    return subprocess.run(
        [str(program)], check=True, stdout=subprocess.PIPE, text=True
    ).stdout.splitlines()


@needs_compiler
def test_structs_are_laid_out_as_in_c(tmp_path):
    body, expected = [], []
    for name, struct in _structures.STRUCTS.items():
        body.append(f'printf("{name} %zu\\n", sizeof({name}));')
        expected.append(f"{name} {ctypes.sizeof(struct)}")
        for field, _ in struct._fields_:
            place = f"offsetof({name}, {field}), sizeof((({name} *)0)->{field})"
            body.append(f'printf("{name}.{field} %zu %zu\\n", {place});')
            mine = getattr(struct, field)
            expected.append(f"{name}.{field} {mine.offset} {mine.size}")
    assert run_c(tmp_path, "\n".join(body)) == expected


def test_no_struct_of_the_headers_was_forgotten():
    header = "".join(path.read_text() for path in (ROOT / "include/perp").glob("*.h"))
    names = {
        line.split("}")[1].strip(" ;\n")
        for line in header.splitlines()
        if line.startswith("} perp")
    }
    assert names == set(_structures.STRUCTS)


@needs_compiler
def test_constants_are_those_of_the_headers(tmp_path):
    constants = {
        "PERP_ABI_VERSION": _library.ABI_VERSION,
        "PERP_STORAGE_COLUMN_MAJOR": perp._arrays.COLUMN_MAJOR,
        "PERP_STORAGE_ROW_MAJOR": perp._arrays.ROW_MAJOR,
        "PERP_STORAGE_CSC": perp._arrays.CSC,
        "PERP_OUTCOME_SOLVED": 0,
        "PERP_OUTCOME_ROUNDING_LIMIT": 1,
        "PERP_CERTIFICATE_NONE": 0,
        "PERP_CERTIFICATE_INFEASIBLE": 1,
        "PERP_PIVOT_HARRIS": perp._lcp._PIVOT_RULE_CODES["harris"],
        "PERP_PIVOT_LEXICOGRAPHIC": perp._lcp._PIVOT_RULE_CODES["lexicographic"],
        "PERP_BODY_DYNAMIC": perp._world._KIND_CODES["dynamic"],
        "PERP_BODY_STATIC": perp._world._KIND_CODES["static"],
        "PERP_BODY_KINEMATIC": perp._world._KIND_CODES["kinematic"],
        "PERP_LCP_AUTO": perp._lcp._METHOD_CODES["auto"],
        "PERP_LCP_LEMKE": perp._lcp._METHOD_CODES["lemke"],
        "PERP_LCP_PGS": perp._lcp._METHOD_CODES["pgs"],
        "PERP_LCP_FISCHER": perp._lcp._METHOD_CODES["fischer"],
        "PERP_LCP_ACTIVE_SET": perp._lcp._METHOD_CODES["active_set"],
        "PERP_SWEEP_FORWARD": perp._lcp._SWEEP_CODES["forward"],
        "PERP_SWEEP_SYMMETRIC": perp._lcp._SWEEP_CODES["symmetric"],
        "PERP_ACCELERATION_NONE": perp._lcp._ACCELERATION_CODES["none"],
        "PERP_ACCELERATION_CONJUGATE_GRADIENT": perp._lcp._ACCELERATION_CODES["conjugate_gradient"],
        "PERP_VERDICT_REGULAR": 0,
        **{"PERP_PLACE_" + word.upper(): k for k, word in enumerate(_library.PLACES)},
        **{name: status for status, name in perp._errors._NAMES.items()},
    }
    body = "\n".join(f'printf("%d\\n", (int){name});' for name in constants)
    assert run_c(tmp_path, body) == [str(value) for value in constants.values()]


@needs_compiler
def test_version_of_the_package_is_that_of_the_headers(tmp_path):
    body = 'printf("%d.%d.%d", PERP_VERSION_MAJOR, PERP_VERSION_MINOR, PERP_VERSION_PATCH);'
    assert run_c(tmp_path, body) == [perp.__version__]


def test_lcp_defaults_are_the_librarys():
    """Python states defaults of its own, so that help() shows them."""
    theirs = _library.defaults(_structures.LcpSettings)
    mine = _structures.sized(_structures.LcpSettings)
    signature = perp._lcp.lcp.__kwdefaults__
    names = [name for name in perp._lcp._fill.__code__.co_varnames[1:] if name in signature]
    perp._lcp._fill(mine, *(signature[name] for name in names))
    for field, kind in _structures.LcpSettings._fields_:
        if kind is not _structures.LcpMonitor:
            assert getattr(mine, field) == getattr(theirs, field), field
    assert not theirs.monitor
    assert set(signature) == {*names, "z0", "monitor"}
    assert perp.LCP.__init__.__kwdefaults__ == {k: v for k, v in signature.items() if k != "z0"}
    for call in (perp.lcp_all, perp.lcp_sensitivity):
        assert all(signature[k] == v for k, v in call.__kwdefaults__.items())


def test_world_defaults_are_the_librarys():
    theirs = _library.defaults(_structures.WorldSettings, 0)
    signature = perp.World.__init__.__kwdefaults__
    assert signature["friction_directions"] == theirs.friction_directions
    assert (signature["tol"], signature["method"]) == (theirs.tol, perp._library.METHODS[0])
    assert (theirs.method, theirs.strict, theirs.max_iterations) == (0, 0, 0)
    np.testing.assert_array_equal(list(theirs.gravity), [0, 0, -9.81])
    np.testing.assert_array_equal(
        list(_library.defaults(_structures.WorldSettings, 1).gravity), [0, -9.81, 0]
    )


def test_words_are_those_of_the_contract():
    assert list(_library.OUTCOMES.values()) == [
        "solved",
        "rounding_limit",
        "ray",
        "iteration_limit",
        "time_limit",
        "stalled",
        "singular",
        "stopped",
        "evaluation_failed",
    ]
    assert list(_library.METHODS.values()) == [
        "auto",
        "lemke",
        "pgs",
        "fischer",
        "polish",
        "active_set",
        "patterns",
    ]
    assert list(_library.VERDICTS.values()) == [
        "regular",
        "not a solution",
        "singular",
        "degenerate",
        "too large",
    ]
    assert list(_library.MODES.values()) == ["separate", "stick", "slip"]
