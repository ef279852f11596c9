"""Bodies between jaws that close: no step works for ever on what has no answer. jams.py runs as many
as one wants.

    python -m pytest tests/zoo
"""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

import jams  # noqa: E402


def test_jams_are_told() -> None:
    for seed, steps in ((1, 15), (2, 31), (7, 26), (13, 36)):
        assert not jams.live(seed, steps)
