"""Rings of links fall on a plane without energy from nowhere, and stay closed: a few random ones.
rings.py runs as many as one wants.

    python -m pytest tests/zoo
"""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))

import rings  # noqa: E402


@pytest.mark.parametrize("level", ("fast", "standard"))
def test_rings_keep_their_energy(level: str) -> None:
    for seed in (5, 11, 14, 23, 28, 29):
        assert not rings.live(seed, level, 1.3)
