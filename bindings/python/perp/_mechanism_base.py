"""What a mechanism is made of: sizes, coefficients, and the library's handle."""

from __future__ import annotations

import threading
from collections.abc import Mapping
from ctypes import byref
from typing import Any, NamedTuple, Optional, TypeVar, Union

import numpy as np
from numpy.typing import NDArray

from . import _arrays
from ._errors import argument_error
from ._generated import MechanismCheckResult, MechanismPointer, MechanismSettings
from ._handle import Handle
from ._mechanism_callbacks import MechanismCallbacks, Sizes
from ._mechanism_check import MechanismCheck, friction, make_check
from ._mechanism_library import (
    MECHANISM_LAWS,
    MECHANISM_SCHEMES,
    MECHANISM_SELECTIONS,
    defaults,
    library,
)
from ._settings import code, fill, numbers
from ._structures import sized

_LAW_CODES = numbers(MECHANISM_LAWS)
_CODES = {"scheme": numbers(MECHANISM_SCHEMES), "select": numbers(MECHANISM_SELECTIONS)}

B = TypeVar("B", bound="MechanismBase")


class Rows(NamedTuple):
    """Where the rows of each kind are in impulses, velocities and forces."""

    contacts: slice
    bilateral: slice
    tresca: slice


class _Live(Handle):
    """The library's mechanism."""

    _create = library.perp_mechanism_create
    _destroy = library.perp_mechanism_destroy
    _pointer_type = MechanismPointer


def whole(value: Any, name: str, most: int = _arrays.INT32_MAX) -> int:
    if isinstance(value, (int, np.integer)) and not isinstance(value, bool):
        if abs(int(value)) <= most:
            return int(value)
    raise argument_error(f"{name} is {value!r}, expected a whole number")


def _each(value: Any, name: str, first: int, last: int) -> Union[int, NDArray[np.int32]]:
    """A whole number for all contacts, or one for each."""
    array = np.asarray(value)
    good = array.dtype.kind in "iu" and array.ndim <= 1
    if not good or not ((array >= first) & (array <= last)).all():
        choice = ", ".join(map(str, range(first, last)))
        raise argument_error(f"{name} is {value!r}, expected {choice} or {last}, or one a contact")
    return int(array) if array.ndim == 0 else array.astype(np.int32)


class MechanismBase:
    """Holds the library's mechanism. It is made in the constructor, with one of whatever is not
    known to be more, so that all else is checked there, and again once all sizes are known."""

    def __init__(
        self,
        n: int,
        coordinates: Optional[int],
        law: str,
        functions: Mapping[str, Any],
        coefficients: Mapping[str, Any],
        sizes: Mapping[str, Any],
        check: bool,
    ) -> None:
        self.n = whole(n, "n")
        self.coordinates = self.n if coordinates is None else whole(coordinates, "coordinates")
        if min(self.n, self.coordinates) < 1:
            name = "n" if self.n < 1 else "coordinates"
            raise argument_error(f"{name} is {getattr(self, name)}, expected at least 1")
        self._callbacks = MechanismCallbacks(self.n, self.coordinates, functions)
        self._coefficients = {
            name: _arrays.real(value, name)
            for name, value in coefficients.items()
            if value is not None
        }
        self._law = code(law, _LAW_CODES, "law")
        self._lock = threading.RLock()
        self._check = bool(check)
        self._sizes = self._given(functions, sizes)
        self._build(self._guess(functions))

    def _given(self, functions: Mapping[str, Any], sizes: Mapping[str, Any]) -> Sizes:
        """The sizes that are stated, or that follow from something else that is."""
        counts: dict[str, Optional[int]] = {}
        for name in ("contact_count", "bilateral_count", "tresca_count", "tresca_dim"):
            count = None if sizes[name] is None else whole(sizes[name], name)
            if count is not None and count < 0:
                raise argument_error(f"{name} is {count}, expected at least 0")
            counts[name] = count
        both = _each(0 if sizes["two_sided"] is None else sizes["two_sided"], "two_sided", 0, 3)
        most = 5 if np.any(both) else 3
        dims = None if sizes["dim"] is None else _each(sizes["dim"], "dim", 1, most)
        lengths = [len(x) for x in self._coefficients.values() if x.ndim]
        lengths += [len(x) for x in (dims, both) if isinstance(x, np.ndarray)]
        if counts["contact_count"] is None and lengths:
            counts["contact_count"] = lengths[0]
        for name in ("contact", "bilateral", "tresca"):
            if functions["contacts" if name == "contact" else name] is None:
                counts[f"{name}_count"] = counts[f"{name}_count"] or 0
        if functions["tresca"] is None:
            counts["tresca_dim"] = counts["tresca_dim"] or 1
        return Sizes(
            counts["contact_count"],
            2 if dims is None and functions["contacts"] is None else dims,
            counts["bilateral_count"],
            counts["tresca_count"],
            counts["tresca_dim"],
            both,
        )

    def _guess(self, functions: Mapping[str, Any]) -> Sizes:
        """Sizes with one of what is not known yet: with them the library checks the rest."""
        s = self._sizes
        planar = np.maximum(s.two_sided, 1).astype(np.int32) + 1
        return Sizes(
            int(functions["contacts"] is not None) if s.contacts is None else s.contacts,
            (planar if planar.ndim else int(planar)) if s.dims is None else s.dims,
            int(functions["bilateral"] is not None) if s.bilateral is None else s.bilateral,
            int(functions["tresca"] is not None) if s.tresca is None else s.tresca,
            1 if s.tresca_dim is None else s.tresca_dim,
            s.two_sided,
        )

    def _build(self, sizes: Sizes) -> None:
        """Makes the library's mechanism of these sizes."""
        for name, each in (("two_sided", sizes.two_sided), ("dim", sizes.dims)):
            if isinstance(each, np.ndarray) and len(each) != sizes.contacts:
                count = f"{len(each)} entries for {sizes.contacts} contacts"
                raise argument_error(f"{name} has {count}")
        self._callbacks.settle(sizes)
        self._model = self._callbacks.model()
        self._kept = {
            name: _arrays.bound(value, name, sizes.contacts or 0)
            for name, value in self._coefficients.items()
        }
        for name in {"mu", "mu_static"} & set(self._kept):  # a number for all that have tangents
            if self._coefficients[name].ndim == 0:
                coefficient = float(self._coefficients[name])
                self._kept[name] = np.where(sizes.each() > 1, coefficient, 0.0)
        for name, array in self._kept.items():
            if array is not None and len(array):
                setattr(self._model, name, _arrays.address(array))
        self._settings = defaults(MechanismSettings)
        self._settings.law = self._law
        self._handle = _Live(byref(self._settings), byref(self._model))
        each, extra = sizes.each(), (sizes.tresca or 0) * (sizes.tresca_dim or 1)
        ends = np.cumsum([0, each.sum(), sizes.bilateral or 0, extra]).tolist()
        self._slices = Rows(*(slice(a, b) for a, b in zip(ends, ends[1:])))
        self._row_count, self._mode_count = ends[-1], len(each) + (sizes.tresca or 0)

    @property
    def rows(self) -> Rows:
        """Slices of impulses, velocities and forces: rows.contacts, rows.bilateral, rows.tresca.
        Sizes that were not given are known after the first call."""
        return self._slices

    def _state(self, t: Any, q: Any, v: Any, names: tuple[str, str, str]) -> tuple[float, Any, Any]:
        """The arguments as arrays; sees to it that all sizes are known."""
        time = _arrays.number(t, names[0])
        place = np.atleast_1d(_arrays.real(q, names[1]))
        speed = np.atleast_1d(_arrays.real(v, names[2]))
        place = _arrays.vector(place, names[1], self.coordinates)
        speed = _arrays.vector(speed, names[2], self.n)
        self._handle._alive()
        if not self._sizes.known:
            guessed = self._sizes.dims is None
            sizes = self._callbacks.measure(self._sizes, time, place, speed)
            if guessed and np.all(sizes.each() == 1) and sizes.contacts:
                friction(self._coefficients)
            self._sizes = sizes
            self._handle.close()
            self._build(sizes)
        if self._check:
            complaint = self._compare(time, place, speed).complaint
            if complaint:
                raise argument_error(
                    f"{complaint} (Mechanism(check=False) leaves this look at the first state out)"
                )
            self._check = False
        return time, place, speed

    def _compare(self, t: float, q: Any, v: Any) -> MechanismCheck:
        result = sized(MechanismCheckResult)
        where = _arrays.address(q), _arrays.address(v)
        self._call(library.perp_mechanism_check, byref(result), t, *where)
        label = self._callbacks.label
        of_contact = 0 <= result.row < self.rows.contacts.stop
        index = self._callbacks.row_of(result.row) if of_contact else -1
        return make_check(result, label("contacts"), label("bilateral"), index)

    def _set(self, **values: Any) -> None:
        """Puts these settings in force, and the defaults of all others."""
        settings = defaults(MechanismSettings)
        settings.law = self._law
        fill(settings, _CODES, **values)
        if bytes(settings) != bytes(self._settings):
            self._handle._call(library.perp_mechanism_set, byref(settings))
            self._settings = settings

    def _call(self, function: Any, *arguments: Any) -> None:
        """Calls the library; what was raised in a function comes out first."""
        with self._callbacks.catching():
            status = function(self._handle._alive(), *arguments)
        self._callbacks.raise_caught()
        self._handle._context.check(status)

    def close(self) -> None:
        """Releases the memory; the mechanism can't be used afterwards. Closing twice is allowed."""
        with self._lock:
            self._handle.close()

    def __enter__(self: B) -> B:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
