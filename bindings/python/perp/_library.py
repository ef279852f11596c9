"""Finds and loads libperp, checks its version, and declares every function of its surface."""

from __future__ import annotations

import ctypes.util
import os
import sys
from ctypes import CDLL, byref, c_int32, sizeof
from pathlib import Path
from typing import Any, Optional

from ._generated import CONSTANTS, FUNCTIONS, STRUCTS
from ._structures import S, sized

# The soname's number this package was written for, and the oldest library that has every struct
# as declared in _generated.py. A newer one with the same number is a drop-in replacement.
ABI_VERSION = CONSTANTS["PERP_ABI_VERSION"]
OLDEST_VERSION = 100


def _candidates() -> list[tuple[str, str]]:
    """Where to look, in order: PERP_LIBRARY and nothing else if it is set; the library that came
    with this package; the one in Python's own prefix (conda); the system's. (how it was found,
    path)"""
    override = os.environ.get("PERP_LIBRARY")
    if override:
        return [("PERP_LIBRARY", override)]
    here = Path(__file__).resolve().parent
    names = {"darwin": "libperp.*dylib", "win32": "*perp*.dll"}
    name = names.get(sys.platform, "libperp.so*")
    places = [
        ("inside the package", here, "libperp-python.so*"),
        ("inside the package", here, name),
        ("beside Python", Path(sys.prefix) / "lib", name),
    ]
    found = [(origin, str(path)) for origin, folder, name in places for path in folder.glob(name)]
    system = ctypes.util.find_library("perp")
    return found + ([("the system's", system)] if system else [])


def _checked(path: str) -> CDLL:
    """Loads one library. Raises OSError where it can't be used."""
    library = CDLL(path)
    try:
        library.perp_version.restype = library.perp_abi_version.restype = c_int32
        library.perp_version.argtypes = library.perp_abi_version.argtypes = []
        found, abi = library.perp_version(), library.perp_abi_version()
    except AttributeError as error:
        raise OSError(f"{path}: not a perp library ({error})") from None
    if abi != ABI_VERSION or found < OLDEST_VERSION:
        raise OSError(
            f"{path}: version {_dotted(found)} with ABI {abi}, "
            f"but this package needs ABI {ABI_VERSION}, version {_dotted(OLDEST_VERSION)} or later"
        )
    return library


def _dotted(number: int) -> str:
    return ".".join(map(str, _split(number)))


def _split(number: int) -> tuple[int, int, int]:
    return number // 10000, number // 100 % 100, number % 100


def _load() -> tuple[CDLL, str]:
    """The library, and how it was found."""
    errors = []
    for origin, path in _candidates():
        try:
            return _checked(path), origin
        except OSError as error:
            errors.append(str(error))
    override = os.environ.get("PERP_LIBRARY")
    raise ImportError(
        "no usable libperp, "
        + ("as PERP_LIBRARY says" if override else "neither in this package nor on the system")
        + (":\n  " + "\n  ".join(errors) if errors else "")
        + "\nInstall the package from a source checkout (pip install ./bindings/python), "
        "or set PERP_LIBRARY to the path of the shared library."
    )


def declare(library: CDLL, functions: dict[str, tuple[Any, list[Any]]]) -> None:
    """Tells ctypes what these functions of a library take and return."""
    for name, (result, arguments) in functions.items():
        function = getattr(library, name)
        function.restype, function.argtypes = result, arguments


def words(text: Any) -> dict[int, str]:
    """The library's own words for the codes 0, 1, 2, ..."""
    found: dict[int, str] = {}
    while not (word := text(len(found)).decode()).startswith("unknown"):
        found[len(found)] = word
    return found


def codes(prefix: str) -> dict[str, int]:
    """The headers' constants of one kind, by the word that follows the prefix."""
    return {
        name[len(prefix) :].lower(): value
        for name, value in CONSTANTS.items()
        if name.startswith(prefix)
    }


library, origin = _load()
declare(library, FUNCTIONS)

OUTCOMES: dict[int, Any] = words(library.perp_outcome_text)
METHODS = words(library.perp_lcp_method_text)
NCP_METHODS = words(library.perp_ncp_method_text)
VERDICTS = words(library.perp_lcp_verdict_text)
MODES = words(library.perp_contact_mode_text)
CONTACT_METHODS = words(library.perp_contact_method_text)
STATICS_VERDICTS: dict[int, Any] = words(library.perp_statics_verdict_text)
PLACES = tuple(codes("PERP_PLACE_"))
CERTIFICATES: dict[int, Optional[str]] = {
    code: word for word, code in codes("PERP_CERTIFICATE_").items()
}
CERTIFICATES[CONSTANTS["PERP_CERTIFICATE_NONE"]] = None
GOOD_OUTCOMES = CONSTANTS["PERP_OUTCOME_SOLVED"], CONSTANTS["PERP_OUTCOME_ROUNDING_LIMIT"]

version: tuple[int, int, int] = _split(library.perp_version())


def version_text() -> str:
    """Returns the loaded library's version, its BLAS and its sparse factorisations, in words."""
    text: bytes = library.perp_version_text()
    return text.decode()


def defaults(struct: type[S], *arguments: int, of: CDLL = library) -> S:
    """Returns settings with the defaults of a library."""
    settings = sized(struct)
    name = next(name for name, value in STRUCTS.items() if value is struct)
    status = getattr(of, name + "_init")(byref(settings), sizeof(struct), *arguments)
    if status:
        raise ImportError(f"{name}_init: {library.perp_status_text(status).decode()}")
    return settings
