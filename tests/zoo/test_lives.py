"""Worlds live through whatever callers do between steps, with the same bits asleep, awake, with threads
and restored: a few random lives. lives.py runs as many as one wants.

    python -m pytest tests/zoo
"""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))

import lives  # noqa: E402


@pytest.mark.parametrize("begin", (2, 100, 3058))
def test_random_lives(begin: int) -> None:
    for seed in range(begin, begin + 8):
        assert not lives.live(seed)
