"""Extracts the fenced programs of pages, runs them and compares their output."""

import os
import re
import shutil
import subprocess
import sys
import tempfile

ROOT = os.path.abspath(os.path.join(os.path.dirname(__file__), "..", ".."))
PROGRAM = re.compile(r"```(c|cpp|python)\n(.*?)```\s*```text\n(.*?)```", re.S)
# and how many programs they have
PAGES = {"README.md": 2, "docs/embedding.md": 3, "docs/contact.md": 1, "docs/statics.md": 2,
         "docs/lcp.md": 1}
COMPILERS = {"c": ("CC", "cc", "-std=c99"), "cpp": ("CXX", "c++", "-std=c++11")}


def run_compiled(language, source, folder, build):
    variable, compiler, standard = COMPILERS[language]
    path = os.path.join(folder, f"program.{language}")
    with open(path, "w") as file:
        file.write(source)
    binary = os.path.join(folder, "program")
    library = os.path.join(build, "lib")
    flags = [standard, "-Wall", "-Wextra", "-Wpedantic", "-Werror"]
    command = [os.environ.get(variable, compiler), *flags, "-I", os.path.join(ROOT, "include"), path,
               "-o", binary, "-L", library, "-lperp", "-lm", "-Wl,-rpath," + library]
    subprocess.run(command, check=True)
    return subprocess.run([binary], check=True, capture_output=True, text=True).stdout


def run_python(source, folder, build, python):
    path = os.path.join(folder, "program.py")
    with open(path, "w") as file:
        file.write(source)
    environment = dict(os.environ)
    environment.setdefault("PERP_LIBRARY", os.path.join(build, "lib", "libperp.so"))
    environment["PYTHONPATH"] = os.path.join(ROOT, "bindings", "python")
    return subprocess.run([python, path], check=True, capture_output=True, text=True,
                          env=environment).stdout


def run(language, source, build, python):
    """What a program prints, or why it does not run."""
    if language == "cpp" and shutil.which(os.environ.get("CXX", "c++")) is None:
        return "there is no C++ compiler\n"
    with tempfile.TemporaryDirectory() as folder:
        try:
            if language == "python":
                return run_python(source, folder, build, python)
            return run_compiled(language, source, folder, build)
        except subprocess.CalledProcessError as error:
            return f"{error}\n{error.stderr or ''}"


def main(build, python):
    passed = failed = 0
    for page, expected_programs in PAGES.items():
        with open(os.path.join(ROOT, page)) as file:
            programs = PROGRAM.findall(file.read())
        for language, source, expected in programs:
            printed = run(language, source, build, python)
            if printed == expected:
                passed += 1
            else:
                failed += 1
                print(f"FAILED the {language} program of {page} prints\n{printed}"
                      f"instead of\n{expected}")
        if len(programs) != expected_programs:
            failed += 1
            print(f"FAILED {page} has {len(programs)} programs with their output, "
                  f"expected {expected_programs}")
    print(f"{passed} passed, {failed} failed")
    return failed > 0


if __name__ == "__main__":
    sys.exit(main(os.path.abspath(sys.argv[1]), sys.argv[2]))
