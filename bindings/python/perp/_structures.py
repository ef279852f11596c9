"""What the package adds to the structs of _generated.py."""

from __future__ import annotations

from ctypes import Structure, c_double, sizeof
from typing import TypeVar

Vector3 = c_double * 3
Vector4 = c_double * 4
Matrix3 = c_double * 9

S = TypeVar("S", bound=Structure)


def sized(struct: type[S]) -> S:
    """Returns a new struct, zero but for struct_size: what every perp_..._init() expects."""
    return struct(struct_size=sizeof(struct))
