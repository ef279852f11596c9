"""Builds the two libraries with the repository's Makefile and carries them in the package.

PERP_USE_SYSTEM_LIBRARY=1 leaves them out; the package then loads the system's. A source archive holds
the C sources in the folder `library`.
"""

import os
import shutil
import subprocess
from pathlib import Path

from setuptools import Distribution, setup
from setuptools.command.bdist_wheel import bdist_wheel
from setuptools.command.build_py import build_py
from setuptools.command.sdist import sdist

HERE = Path(__file__).resolve().parent
ARCHIVED = HERE / "library"
ROOT = ARCHIVED if ARCHIVED.is_dir() else HERE.parent.parent
# What make needs to build and install the libraries.
SOURCES = (
    "Makefile",
    "perp.map",
    "perp-mechanism.map",
    "LICENSE",
    "include",
    "src",
    "packaging",
    "scripts/dependencies",
)
USE_SYSTEM_LIBRARY = os.environ.get("PERP_USE_SYSTEM_LIBRARY") == "1"


def build_libraries() -> list:
    """Runs make and returns the shared libraries it built for the package."""
    if not (ROOT / "Makefile").is_file() or not (ROOT / "include/perp/perp.h").is_file():
        raise SystemExit(
            f"There are no C sources of perp in {ARCHIVED}, nor two folders above it. "
            "Install from a checkout of the repository (pip install ./bindings/python) with pip "
            "21.3 or later, which builds in place; or install libperp on the system and set "
            "PERP_USE_SYSTEM_LIBRARY=1."
        )
    # the Makefile chooses the directory by its switches: ask it in the same run
    tell = "perp-python-tell: packaged; @echo $(abspath $(PACKAGED) $(MECHANISM_PACKAGED))"
    command = ["make", "--no-print-directory", "-C", str(ROOT), f"--eval={tell}"]
    jobs = [] if "MAKEFLAGS" in os.environ else [f"-j{os.cpu_count() or 1}"]
    run = subprocess.run(
        [*command, *jobs, "perp-python-tell"], stdout=subprocess.PIPE, text=True, check=False
    )
    print(run.stdout, end="", flush=True)
    if run.returncode:
        raise SystemExit(f"make failed in {ROOT}; what it printed is above")
    return [Path(name) for name in run.stdout.split("\n")[-2].split()]


class BuildWithLibraries(build_py):
    """As build_py, and the shared libraries beside the modules, under their sonames."""

    def _place(self) -> Path:
        source = Path(__file__).resolve().parent
        return (source if self.editable_mode else Path(self.build_lib)) / "perp"

    def run(self) -> None:
        super().run()
        if USE_SYSTEM_LIBRARY:
            return
        self.mkpath(str(self._place()))
        for library in build_libraries():
            shutil.copyfile(library, self._place() / library.name)

    def get_outputs(self, include_bytecode: bool = True) -> list:
        built = [str(path) for path in self._place().glob("libperp*.so*")]
        return super().get_outputs(include_bytecode) + built


class WithSources(sdist):
    """As sdist, and the C sources, so that the archive builds by itself."""

    def make_release_tree(self, base_dir: str, files: list) -> None:
        super().make_release_tree(base_dir, files)
        for name in SOURCES:
            source, target = ROOT / name, Path(base_dir) / ARCHIVED.name / name
            target.parent.mkdir(parents=True, exist_ok=True)
            if source.is_dir():
                shutil.copytree(source, target, dirs_exist_ok=True)
            else:
                shutil.copy(source, target)
        shutil.copy(ROOT / "LICENSE", base_dir)


class BinaryDistribution(Distribution):
    def has_ext_modules(self) -> bool:
        return not USE_SYSTEM_LIBRARY


class AnyPython(bdist_wheel):
    """The library does not know of Python: one wheel a platform serves every version."""

    def get_tag(self) -> tuple:
        tag = super().get_tag()
        return tag if USE_SYSTEM_LIBRARY else ("py3", "none", tag[2])


setup(
    distclass=BinaryDistribution,
    cmdclass={"build_py": BuildWithLibraries, "bdist_wheel": AnyPython, "sdist": WithSources},
)
