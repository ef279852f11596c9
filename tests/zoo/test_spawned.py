"""Bodies that begin in each other come apart without jumping. spawned.py judges them.

    python -m pytest tests/zoo
"""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))

import spawned  # noqa: E402


@pytest.mark.parametrize("kind", spawned.CLASSES)
def test_they_come_apart_without_jumping(kind: str) -> None:
    for seed, level in enumerate(spawned.LEVELS):
        assert not spawned.judge(kind, seed, level)
