"""The structs as Python declares them, against what a C compiler makes of the headers."""

import ctypes
import os
import re
import shutil
import subprocess
import sys
from ctypes import c_double, c_int32, c_int64, c_size_t, c_uint64

import numpy as np
import pytest
from conftest import ROOT

import perp
from perp import _generated, _library, _settings, _structures
from perp._generated import (
    CONSTANTS,
    FUNCTIONS,
    MECHANISM_FUNCTIONS,
    STRUCTS,
    LcpMonitor,
    LcpSettings,
    WorldSettings,
)

COMPILER = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")
needs_compiler = pytest.mark.skipif(COMPILER is None, reason="no C compiler on this machine")


def run_c(folder, body):
    """Compiles and runs the body of a main() that sees the headers; returns the lines printed."""
    source, program = folder / "program.c", folder / "program"
    source.write_text(
        "#include <perp/perp.h>\n#include <perp/mechanism.h>\n"
        "#include <stddef.h>\n#include <stdio.h>\n"
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
    for name, struct in STRUCTS.items():
        body.append(f'printf("{name} %zu\\n", sizeof({name}));')
        expected.append(f"{name} {ctypes.sizeof(struct)}")
        for field, _ in struct._fields_:
            place = f"offsetof({name}, {field}), sizeof((({name} *)0)->{field})"
            body.append(f'printf("{name}.{field} %zu %zu\\n", {place});')
            mine = getattr(struct, field)
            expected.append(f"{name}.{field} {mine.offset} {mine.size}")
    assert run_c(tmp_path, "\n".join(body)) == expected


@needs_compiler
def test_functions_take_what_python_passes(tmp_path):
    """Calls of the widths that Python passes; a prototype that would convert one is an error."""
    words = {c_double: "d", c_int32: "i", c_int64: "l", c_uint64: "u", c_size_t: "s"}
    pointers = {struct: name for name, struct in STRUCTS.items()}
    pointers.update((kind, name) for name, kind in handles().items())

    def value(kind):
        """An expression of this type; typed where it points at a struct of the library's."""
        depth = 0
        while hasattr(kind, "_type_") and issubclass(kind, ctypes._Pointer):
            kind, depth = kind._type_, depth + 1
        return f"({pointers[kind]} {'*' * depth})p" if depth else words.get(kind, "p")

    declare = {None: "(void)", ctypes.c_char_p: "c =", **{k: f"{v} =" for k, v in words.items()}}
    calls = "\n".join(
        f"{declare[result]} {name}({', '.join(map(value, arguments))});"
        for name, (result, arguments) in {**FUNCTIONS, **MECHANISM_FUNCTIONS}.items()
    )
    source = tmp_path / "calls.c"
    source.write_text(
        "#include <perp/perp.h>\n#include <perp/mechanism.h>\n"
        "void calls(void *p, double d, int32_t i, int64_t l, uint64_t u, size_t s, const char *c)\n"
        "{\n" + calls + "\n}\n"
    )
    flags = ["-std=c99", "-Werror", "-Wconversion", "-Wtraditional-conversion", "-fsyntax-only"]
    if "clang" in os.path.realpath(COMPILER):  # has not got the second
        flags.append("-Wno-unknown-warning-option")
    subprocess.run([COMPILER, *flags, f"-I{ROOT / 'include'}", str(source)], check=True)


def handles():
    """The opaque structs by their names in C."""
    kinds = {name: kind for name, kind in vars(_generated).items() if name.endswith("Handle")}
    names = "".join(path.read_text() for path in (ROOT / "include/perp").glob("*.h"))
    opaque = re.findall(r"typedef struct (\w+) \1;", names)
    return {name: kinds[name[4:].title().replace("_", "") + "Handle"] for name in opaque}


@needs_compiler
def test_the_headers_give_the_committed_files():
    """The generator is also what would notice a struct or a function that is missing here."""
    subprocess.run([sys.executable, ROOT / "scripts/generate-binding", "--check"], check=True)


@needs_compiler
@pytest.mark.parametrize(
    "old, new, refused",
    [
        ("    double penalty;", "    int32_t more;\n    double penalty;", "perp_lcp_settings"),
        ("    double penalty;", "    int64_t penalty;", None),  # the same place
        ("} perp_lcp_settings;", "int32_t more;\n} perp_lcp_settings;", None),
        ("PERP_LCP_PGS = 2", "PERP_LCP_PGS = 9", "PERP_LCP_PGS"),
        ("PERP_LCP_PGS = 2", "PERP_LCP_OTHER = 2", "PERP_LCP_PGS"),
    ],
)
def test_the_generator_refuses_a_break_of_the_binary_interface(tmp_path, old, new, refused):
    for name in ("scripts/generate-binding", "tests/abi/layout.def", "bindings/python/perp"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (shutil.copytree if (ROOT / name).is_dir() else shutil.copy)(ROOT / name, tmp_path / name)
    shutil.copytree(ROOT / "include", tmp_path / "include")
    header = tmp_path / "include/perp/lcp.h"
    assert old in header.read_text()
    header.write_text(header.read_text().replace(old, new))
    run = subprocess.run(
        [sys.executable, tmp_path / "scripts/generate-binding"], stderr=subprocess.PIPE, text=True
    )
    if refused:
        assert run.returncode and f"{refused} is not what" in run.stderr
    else:
        assert run.returncode == 0, run.stderr
        added = (tmp_path / "tests/abi/layout.def").read_text()
        assert ("FIELD(more, 88, 4)" in added) == ("more" in new)


@pytest.mark.parametrize(
    "names, functions",
    [("perp.map", FUNCTIONS), ("perp-mechanism.map", MECHANISM_FUNCTIONS)],
)
def test_each_library_exports_these_functions_and_no_others(names, functions):
    exported = re.findall(r"(perp_\w+);", (ROOT / names).read_text())
    assert sorted(exported) == sorted(functions)


@needs_compiler
def test_constants_are_those_of_the_headers(tmp_path):
    body = "\n".join(f'printf("%d\\n", (int){name});' for name in CONSTANTS)
    assert run_c(tmp_path, body) == [str(value) for value in CONSTANTS.values()]


@needs_compiler
def test_version_of_the_package_is_that_of_the_headers(tmp_path):
    body = 'printf("%d.%d.%d", PERP_VERSION_MAJOR, PERP_VERSION_MINOR, PERP_VERSION_PATCH);'
    assert run_c(tmp_path, body) == [perp.__version__]


def test_lcp_defaults_are_the_librarys():
    """Python states defaults of its own, so that help() shows them."""
    theirs = _library.defaults(LcpSettings)
    mine = _structures.sized(LcpSettings)
    signature = perp._lcp.lcp.__kwdefaults__
    names = perp._lcp._SETTINGS
    _settings.fill(mine, perp._lcp._CODES, **{name: signature[name] for name in names})
    for field, kind in LcpSettings._fields_:
        if kind is not LcpMonitor:
            assert getattr(mine, field) == getattr(theirs, field), field
    assert not theirs.monitor
    assert set(signature) == {*names, "z0", "monitor"}
    assert perp.LCP.__init__.__kwdefaults__ == {k: v for k, v in signature.items() if k != "z0"}
    for call in (perp.lcp_all, perp.lcp_sensitivity):
        assert all(signature[k] == v for k, v in call.__kwdefaults__.items())


def test_world_defaults_are_the_librarys():
    theirs = _library.defaults(WorldSettings, 0)
    signature = perp.World.__init__.__kwdefaults__
    assert CONSTANTS["PERP_ACCURACY_" + signature["accuracy"].upper()] == theirs.accuracy
    assert (signature["cone"], theirs.cone) == ("exact", 0)
    assert signature["method"] == _library.CONTACT_METHODS[theirs.method]
    assert (theirs.tol, theirs.strict, theirs.substeps) == (0.0, 0, 0)
    assert (theirs.max_iterations, theirs.time_limit) == (0, 0.0)
    limits = ("tol", "substeps", "max_iterations", "time_limit", "strict")
    assert [signature[name] for name in limits] == [None, None, None, None, False]
    np.testing.assert_array_equal(list(theirs.gravity), [0, 0, -9.81])
    np.testing.assert_array_equal(
        list(_library.defaults(WorldSettings, 1).gravity), [0, -9.81, 0]
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
        "mprgp",
    ]
    assert list(_library.VERDICTS.values()) == [
        "regular",
        "not a solution",
        "singular",
        "degenerate",
        "too large",
    ]
    assert list(_library.MODES.values()) == ["separate", "stick", "slip", "lower", "upper"]
