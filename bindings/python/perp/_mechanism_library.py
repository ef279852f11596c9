"""Loads libperp-mechanism, the second library, where something of it is used first.

It is beside the libperp that the package has loaded, under the same name but for `-mechanism`, and
of the same version: it works in contexts that libperp has made.
"""

from __future__ import annotations

import ctypes
import os

from ._generated import MECHANISM_FUNCTIONS
from ._library import declare, origin, words
from ._library import defaults as _defaults
from ._library import library as _libperp
from ._structures import S


def _path() -> str:
    folder, name = os.path.split(_libperp._name)
    return os.path.join(folder, name.replace("perp", "perp-mechanism", 1))


def _load() -> ctypes.CDLL:
    # Another copy of libperp in this process must not answer in place of ours.
    mode = ctypes.RTLD_LOCAL | getattr(os, "RTLD_DEEPBIND", 0)
    try:
        library = ctypes.CDLL(_path(), mode=mode)
        declare(library, MECHANISM_FUNCTIONS)
    except (OSError, AttributeError) as error:
        raise ImportError(
            f"no usable libperp-mechanism beside {_libperp._name} ({origin}): {error}"
        ) from None
    return library


def defaults(struct: type[S], *arguments: int) -> S:
    """Returns settings with the library's defaults."""
    return _defaults(struct, *arguments, of=library)


library = _load()

LOAD_KINDS = words(library.perp_load_kind_text)
LOAD_MODES = words(library.perp_load_mode_text)
LOAD_REASONS = words(library.perp_load_reason_text)
MECHANISM_SCHEMES = words(library.perp_mechanism_scheme_text)
MECHANISM_SELECTIONS = words(library.perp_mechanism_select_text)
MECHANISM_LAWS = words(library.perp_mechanism_law_text)
MECHANISM_REASONS = words(library.perp_mechanism_reason_text)
