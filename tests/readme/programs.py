"""Extracts the fenced programs of README.md, runs them and compares their output."""

import os
import re
import subprocess
import sys
import tempfile

ROOT = os.path.abspath(os.path.join(os.path.dirname(__file__), "..", ".."))
PROGRAM = re.compile(r"```(c|python)\n(.*?)```\s*```text\n(.*?)```", re.S)


def run_c(source, folder, build):
    path = os.path.join(folder, "program.c")
    with open(path, "w") as file:
        file.write(source)
    binary = os.path.join(folder, "program")
    library = os.path.join(build, "lib")
    flags = ["-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Werror"]
    command = [os.environ.get("CC", "cc"), *flags, "-I", os.path.join(ROOT, "include"), path,
               "-o", binary, "-L", library, "-lperp", "-Wl,-rpath," + library]
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


def main(build, python):
    passed = failed = 0
    with open(os.path.join(ROOT, "README.md")) as file:
        programs = PROGRAM.findall(file.read())
    for language, source, expected in programs:
        with tempfile.TemporaryDirectory() as folder:
            try:
                if language == "c":
                    printed = run_c(source, folder, build)
                else:
                    printed = run_python(source, folder, build, python)
            except subprocess.CalledProcessError as error:
                printed = f"{error}\n{error.stderr or ''}"
        if printed == expected:
            passed += 1
        else:
            failed += 1
            print(f"FAILED the {language} program prints\n{printed}instead of\n{expected}")
    if len(programs) != 2:
        failed += 1
        print(f"FAILED README.md has {len(programs)} programs with their output, expected 2")
    print(f"{passed} passed, {failed} failed")
    return failed > 0


if __name__ == "__main__":
    sys.exit(main(os.path.abspath(sys.argv[1]), sys.argv[2]))
