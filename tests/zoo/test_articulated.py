"""Nothing gains energy from nowhere, and joints hold: a few systems of the zoo of articulated ones.
articulated.py runs as many as one wants.

    python -m pytest tests/zoo
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

sys.path.insert(0, str(Path(__file__).parent))

import articulated  # noqa: E402


def test_the_judge_knows_a_tumbling_body() -> None:
    """Energy of a rod that turns about its end: m l^2 w^2 / 6, and its weight."""
    link = articulated.Link(3.0, np.array((0.0, 0.25, 0.25)), np.array((0.5, 0, 2.0)),
                            np.array((1.0, 0, 0, 0)), np.array((0, 1.0, 0)), np.array((0, 0, 2.0)))
    system = articulated.System([link], [], articulated.GRAVITY, 0.01, 1.0, "a rod")
    kinetic, potential = articulated.Judge(system).energy(*(np.array([x]) for x in (
        link.position, link.orientation, link.velocity, link.spin)))
    assert kinetic == pytest.approx(3.0 * 1.0 * 4.0 / 6.0)
    assert potential == pytest.approx(3.0 * 9.81 * 2.0)


@pytest.mark.parametrize("level", articulated.LEVELS)
def test_systems_keep_their_energy(level: str) -> None:
    for seed in range(48):
        system = articulated.make(seed)
        found = articulated.run(system, level, 40 * system.dt, 2.0)
        assert not found.wrong, f"seed {seed}, {level}: {found.wrong}; {system.name}"
