"""The functions that describe a mechanism, as the library calls them."""

from __future__ import annotations

import inspect
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Callable, Optional, Union

import numpy as np
from numpy.typing import NDArray

from . import _arrays
from ._callbacks import Array, Callbacks
from ._errors import OutsideDomain, argument_error
from ._generated import MechanismModel
from ._structures import sized


@dataclass
class Sizes:
    """How many rows there are; None: not known yet."""

    contacts: Optional[int]
    dims: Union[int, NDArray[np.int32], None]  # of every contact, or of each
    bilateral: Optional[int]
    tresca: Optional[int]
    tresca_dim: Optional[int]
    two_sided: Union[int, NDArray[np.int32]] = 0  # normals that hold both ways

    @property
    def known(self) -> bool:
        return None not in (self.contacts, self.bilateral, self.tresca, self.tresca_dim) and (
            self.dims is not None
        )

    def each(self) -> NDArray[np.int32]:
        """The dimension of each contact."""
        return self._spread(2 if self.dims is None else self.dims)

    def both(self) -> NDArray[np.int32]:
        """The normals of each contact that hold both ways."""
        return self._spread(self.two_sided)

    def _spread(self, value: Union[int, NDArray[np.int32]]) -> NDArray[np.int32]:
        return np.full(self.contacts or 0, value, dtype=np.int32)


def takes_time(function: Any) -> bool:
    """Whether a function of q takes t, too: it has two arguments without default."""
    try:
        parameters = inspect.signature(function).parameters.values()
    except (TypeError, ValueError):
        return False
    ordinary = (inspect.Parameter.POSITIONAL_ONLY, inspect.Parameter.POSITIONAL_OR_KEYWORD)
    return sum(p.kind in ordinary and p.default is p.empty for p in parameters) >= 2


def _parts(value: Any, name: str, words: Sequence[str], needed: int) -> list[Any]:
    """The items of a tuple, or those of these names in a dict or an object; None where missing."""
    if isinstance(value, dict):
        unknown = set(value) - set(words)
        if unknown:
            raise argument_error(f"{name} has {min(unknown)!r}, expected {', '.join(words)}")
        parts = [value.get(word) for word in words]
    elif hasattr(value, words[0]):
        parts = [getattr(value, word, None) for word in words]
    elif isinstance(value, (tuple, list)) and needed <= len(value) <= len(words):
        parts = [*value, *[None] * (len(words) - len(value))]
    else:
        what = f"{len(value)} items" if isinstance(value, (tuple, list)) else type(value).__name__
        raise argument_error(f"{name} returned {what}, expected {', '.join(words)}")
    for word, part in zip(words[:needed], parts):
        if part is None:
            raise argument_error(f"{name} returned no {word}")
    return parts


def _count(value: Any, name: str, most: int = 1) -> Array:
    """One number for each of what there is, or a row; a number alone is one."""
    array = np.atleast_1d(_arrays.real(value, name))
    if array.ndim > most:
        raise argument_error(f"{name} has shape {array.shape}, expected one number each")
    return array


def _shaped(value: Any, name: str, *shapes: tuple[int, ...]) -> Array:
    """An array of the first of these shapes, given in any of them. Where there is one row of its
    kind, the first axis may be left out."""
    array = _arrays.real(value, name)
    for shape in shapes:
        if array.shape == shape or (shape[0] == 1 and array.shape == shape[1:]):
            return array.reshape(shapes[0])
    raise argument_error(f"{name} has shape {array.shape}, expected {shapes[0]}")


def _width(value: Any, name: str, count: int, n: int) -> int:
    """How many rows of n each of `count` has: 1 or 2."""
    shape = _arrays.real(value, name).shape
    for width in (1, 2):
        choices = [(count, width, n)] + [(count, n)] * (width == 1)
        if shape in choices or (count == 1 and shape in [choice[1:] for choice in choices]):
            return width
    raise argument_error(f"{name} has shape {shape}, expected ({count}, {n}) or ({count}, 2, {n})")


_CONTACT_WORDS = ("gap", "normal", "tangent", "drift", "mu")
_BILATERAL_WORDS = ("c", "G", "drift")
_TRESCA_WORDS = ("bound", "B", "drift")


class MechanismCallbacks(Callbacks):
    """Calls the functions, checks the shapes of what they return, and writes it where the library
    wants it."""

    def __init__(self, n: int, coordinates: int, functions: Mapping[str, Any]) -> None:
        super().__init__()
        self._n, self._m = n, coordinates
        for name, function in functions.items():
            constant = name in ("mass", "force", "tresca") and function is not None
            if function is not None and not callable(function) and not constant:
                raise argument_error(f"{name} is neither callable nor None")
        self._functions = functions
        self._timed = {
            name: takes_time(functions[name])
            for name in ("contacts", "bilateral")
            if functions[name] is not None
        }
        self._mass = self._constant("mass", self._square)
        self._force = self._constant("force", lambda x, name: _arrays.vector(x, name, n))
        self._tresca: Optional[list[Any]] = self._constant(
            "tresca", lambda x, name: _parts(x, name, _TRESCA_WORDS, 2)
        )

    def _constant(self, name: str, read: Any) -> Any:
        value = self._functions[name]
        return None if value is None or callable(value) else read(value, name)

    def _square(self, value: Any, name: str) -> Array:
        n, array = self._n, _arrays.real(value, name)
        if array.shape in ((), (n,)):
            return np.diag(np.broadcast_to(array, (n,)))
        return _shaped(array, name, (n, n))

    ## Sizes

    def measure(self, sizes: Sizes, t: float, q: Array, v: Array) -> Sizes:
        """Finds the sizes that are not known, from what the functions return at a state."""
        contacts, dims = sizes.contacts, sizes.dims
        if contacts is None or dims is None:
            gap, _, tangent, _, _ = self._contact_parts(t, q)
            name = f"{self.label('contacts')}: gap"
            each = np.maximum(sizes.two_sided, 1)
            found = _count(gap, name, 1 + int(each.max(initial=1) > 1))
            if contacts is None:
                contacts = found.size // int(each)  # two_sided is one for all of them
            normals = np.broadcast_to(each, (contacts,))
            _shaped(found, name, *self._gap_shapes(normals))
            if dims is None:
                name = f"{self.label('contacts')}: tangent"
                width = 0 if tangent is None else _width(tangent, name, contacts, self._n)
                dims = int(each) + width if each.ndim == 0 else (normals + width).astype(np.int32)
        bilateral = sizes.bilateral
        if bilateral is None:
            c = self._bilateral_parts(t, q)[0]
            bilateral = len(_count(c, f"{self.label('bilateral')}: c"))
        tresca, tresca_dim = sizes.tresca, sizes.tresca_dim
        if tresca is None or tresca_dim is None:
            bound, B, _ = self._tresca_parts(t, q, v)
            found = _count(bound, "tresca: bound")
            tresca = len(found) if tresca is None else tresca
            _shaped(found, "tresca: bound", (tresca,))
            if tresca_dim is None:
                tresca_dim = _width(B, "tresca: B", tresca, self._n)
        return Sizes(contacts, dims, bilateral, tresca, tresca_dim, sizes.two_sided)

    def settle(self, sizes: Sizes) -> None:
        """Takes these sizes: those of the handle that is going to call."""
        self._dims = sizes.each()
        self._contacts, self._rows = len(self._dims), int(self._dims.sum())
        self._both = sizes.both()
        self._each = np.maximum(self._both, 1)  # normals of each contact
        starts = np.cumsum(self._dims) - self._dims
        self._normals = np.arange(self._rows) - np.repeat(starts, self._dims) < np.repeat(
            self._each, self._dims
        )
        self._gaps = int(self._each.sum())
        alike = len(set(zip(self._dims.tolist(), self._both.tolist()))) == 1
        self._uniform = int(self._dims[0]) if alike else 0
        self._bilateral = sizes.bilateral or 0
        self._dry, self._dry_dim = sizes.tresca or 0, sizes.tresca_dim or 1

    def row_of(self, row: int) -> int:
        """The number of a row of H among the normals, or among the tangents."""
        return int((self._normals[:row] == self._normals[row]).sum())

    ## What the functions return

    def label(self, name: str) -> str:
        """What messages call this function."""
        return f"{name}(t, q)" if self._timed.get(name) else f"{name}(q)"

    def _at(self, name: str, t: float, q: Array) -> Any:
        function = self._functions[name]
        return function(t, q.copy()) if self._timed[name] else function(q.copy())

    def _contact_parts(self, t: float, q: Array) -> list[Any]:
        value = self._at("contacts", t, q)
        return _parts(value, self.label("contacts"), _CONTACT_WORDS, 2)

    def _bilateral_parts(self, t: float, q: Array) -> list[Any]:
        value = self._at("bilateral", t, q)
        return _parts(value, self.label("bilateral"), _BILATERAL_WORDS, 2)

    def _tresca_parts(self, t: float, q: Array, v: Array) -> list[Any]:
        if self._tresca is not None:
            return self._tresca
        value = self._functions["tresca"](t, q.copy(), v.copy())
        return _parts(value, "tresca(t, q, v)", _TRESCA_WORDS, 2)

    @staticmethod
    def _gap_shapes(each: NDArray[np.int32]) -> list[tuple[int, ...]]:
        """One number for each normal; or one row for each contact of as many."""
        flat = (int(each.sum()),)
        alike = len(set(each.tolist())) == 1 and each[0] > 1
        return [flat, (len(each), int(each[0]))] if alike else [flat]

    def _normal_shapes(self) -> list[tuple[int, ...]]:
        return [(*shape, self._n) for shape in self._gap_shapes(self._each)]

    def _tangent_shapes(self) -> list[tuple[int, ...]]:
        k, n = self._contacts, self._n
        flat, each = (self._rows - self._gaps, n), (self._rows - self._gaps) // max(k, 1)
        if self._uniform and each == 1:
            return [flat, (k, 1, n)]
        return [(k, each, n), flat] if self._uniform else [flat]

    def _drift_shapes(self) -> list[tuple[int, ...]]:
        return [(self._rows,)] + [(self._contacts, self._uniform)] * bool(self._uniform)

    ## What the library calls

    def _fill_mass(self, M: int, q: int, _: Any) -> None:
        n, value = self._n, self._mass
        if value is None:
            value = self._square(self._functions["mass"](self.view(q, self._m).copy()), "mass(q)")
        self.view(M, n * n).reshape(n, n)[:] = value

    def _fill_force(self, k: int, t: float, q: int, v: int, _: Any) -> None:
        n, value = self._n, self._force
        if value is None:
            state = self.view(q, self._m).copy(), self.view(v, n).copy()
            value = _shaped(self._functions["force"](t, *state), "force(t, q, v)", (n,))
        self.view(k, n)[:] = value

    def _fill_contacts(
        self, gaps: int, H: int, drifts: int, coefficients: int, t: float, q: int, _: Any
    ) -> None:
        k, n, name = self._contacts, self._n, self.label("contacts")
        gap, normal, tangent, drift, mu = self._contact_parts(t, self.view(q, self._m))
        shapes = self._gap_shapes(self._each)
        self.view(gaps, self._gaps)[:] = _shaped(np.atleast_1d(gap), f"{name}: gap", *shapes)
        rows = self.view(H, self._rows * n).reshape(self._rows, n)
        rows[self._normals] = _shaped(normal, f"{name}: normal", *self._normal_shapes())
        if self._rows > self._gaps:
            if tangent is None:
                raise argument_error(f"{name} returned no tangent")
            array = _shaped(tangent, f"{name}: tangent", *self._tangent_shapes())
            rows[~self._normals] = array.reshape(-1, n)
        elif tangent is not None and np.size(tangent):
            raise argument_error(f"{name} returned a tangent, but dim is 1")
        if drift is not None:
            self._write_drift(self.view(drifts, self._rows), drift, f"{name}: drift")
        if mu is not None:
            given = mu if np.ndim(mu) == 0 else _shaped(mu, f"{name}: mu", (k,))
            self.view(coefficients, k)[:] = given

    def _write_drift(self, rows: Array, drift: Any, name: str) -> None:
        """Of normals alone, or of all rows."""
        array = _arrays.real(drift, name)
        if array.ndim == 0 or array.shape == (self._gaps,):
            rows[self._normals] = array
        else:
            rows[:] = _shaped(array, name, *self._drift_shapes())

    def _fill_bilateral(
        self, values: int, G: int, drifts: int, t: float, q: int, _: Any
    ) -> None:
        m, n, name = self._bilateral, self._n, self.label("bilateral")
        c, gradient, drift = self._bilateral_parts(t, self.view(q, self._m))
        self.view(values, m)[:] = _shaped(np.atleast_1d(c), f"{name}: c", (m,))
        self.view(G, m * n).reshape(m, n)[:] = _shaped(gradient, f"{name}: G", (m, n))
        if drift is not None:
            self.view(drifts, m)[:] = _shaped(np.atleast_1d(drift), f"{name}: drift", (m,))

    def _fill_tresca(
        self, bounds: int, B: int, drifts: int, t: float, q: int, v: int, _: Any
    ) -> None:
        d, r, n, name = self._dry, self._dry_dim, self._n, "tresca(t, q, v)"
        state = self.view(q, self._m), self.view(v, n)
        bound, rows, drift = self._tresca_parts(t, *state)
        self.view(bounds, d)[:] = _shaped(np.atleast_1d(bound), f"{name}: bound", (d,))
        shapes = [(d, r, n), (d * r, n)] if r > 1 else [(d, n), (d, 1, n)]
        array = _shaped(rows, f"{name}: B", *shapes)
        self.view(B, d * r * n).reshape(d * r, n)[:] = array.reshape(d * r, n)
        if drift is not None:
            speeds = _shaped(np.atleast_1d(drift), f"{name}: drift", (d * r,), (d, r))
            self.view(drifts, d * r)[:] = speeds

    def _fill_kinematics(self, rate: int, q: int, v: int, _: Any) -> None:
        state = self.view(q, self._m).copy(), self.view(v, self._n).copy()
        value = self._functions["kinematics"](*state)
        self.view(rate, self._m)[:] = _shaped(value, "kinematics(q, v)", (self._m,))

    def _fill_normalise(self, q: int, _: Any) -> None:
        place = self.view(q, self._m)
        value = self._functions["normalise"](place.copy())
        place[:] = _shaped(value, "normalise(q)", (self._m,))

    def _fill_curvature(self, bias: int, t: float, q: int, v: int, _: Any) -> None:
        rows = self._rows + self._bilateral + self._dry * self._dry_dim
        state = self.view(q, self._m).copy(), self.view(v, self._n).copy()
        value = self._functions["curvature"](t, *state)
        self.view(bias, rows)[:] = _shaped(value, "curvature(t, q, v)", (rows,))

    def guarded(self, fill: Callable[..., None]) -> Callable[..., int]:
        """A callback that answers what the library wants to know, whatever is raised."""

        def call(*arguments: Any) -> int:
            try:
                if self.raised:
                    return -1
                fill(*arguments)
                return 0
            except OutsideDomain:
                return 1
            except BaseException as error:
                self.raised.append(error)
                return -1

        return call

    def model(self) -> MechanismModel:
        """The model's sizes and callbacks."""
        model = sized(MechanismModel)
        model.velocities, model.coordinates = self._n, self._m
        model.contacts, model.dims = self._contacts, _arrays.address(self._dims)
        if self._both.any():
            model.two_sided = _arrays.address(self._both)
        model.bilateral, model.dry, model.dry_dim = self._bilateral, self._dry, self._dry_dim
        kinds: dict[str, Any] = {field[0]: field[1] for field in MechanismModel._fields_}
        for name, field in _FIELDS.items():
            if self._functions[name] is not None:
                callback = kinds[field](self.guarded(getattr(self, f"_fill_{name}")))
                setattr(model, field, callback)
        return model


# The model's field that each function belongs to.
_FIELDS = {
    "mass": "mass",
    "force": "force",
    "contacts": "contact_rows",
    "bilateral": "bilateral_rows",
    "tresca": "dry_rows",
    "kinematics": "kinematics",
    "normalise": "normalise",
    "curvature": "curvature",
}
