"""Stribeck's and LuGre's friction: closed forms, the belt, refusals."""

import numpy as np
import pytest

import perp

EPS = 2.0**-52


def test_stribeck():
    r = perp.stribeck(0.25, 3, 5, 0.25, 0.5)
    assert r.force == pytest.approx(3 + 2 / np.e + 0.125, rel=4 * EPS)
    assert r.slope == pytest.approx(0.5 - 16 / np.e, rel=8 * EPS)
    v = np.array([[-1.0, 0.0, 1e-9], [1.0, 2.0, 1e9]])
    force, slope = perp.stribeck(v, kinetic=3, breakaway=5, speed=0.5)
    expected = (3 + 2 * np.exp(-((v / 0.5) ** 2))) * np.sign(v)
    np.testing.assert_allclose(force, expected, rtol=8 * EPS)
    assert force[0, 1] == 0.0 and slope[0, 1] == 0.0 and slope.shape == v.shape
    assert perp.stribeck(-0.1, 3).force == -3.0


def test_lugre():
    bristles = perp.LuGre(
        stiffness=800, kinetic=3, breakaway=5, speed=0.25, damping=0.75, viscosity=0.5
    )
    assert bristles.z == 0.0 and bristles.passive  # 0.5 * 3 = 0.75 * (5 - 3)
    # bristles before slip: a spring and a damper, to first order in s0 |v| h / g = 0.0016
    assert bristles.trial(1e-3, 1e-2)[1] == pytest.approx(800 * 5e-6 + 1.25e-3, rel=2e-3)
    assert bristles.z == 0.0
    bristles.step(0.1, 5.0)
    assert bristles.step(0.1, 1e-3) == pytest.approx(bristles.steady(0.1), rel=8 * EPS)
    assert bristles.force(0.1) == pytest.approx(bristles.steady(0.1), rel=8 * EPS)
    assert bristles.steady(0.1) == perp.stribeck(0.1, 3, 5, 0.25, 0.5).force
    assert not perp.LuGre(stiffness=1, kinetic=3, breakaway=5, speed=1, damping=1).passive


def test_dahl():
    """breakaway = kinetic: F = Fc (1 - exp(-s0 u / Fc)) whatever the speeds."""
    bristles, way = perp.LuGre(stiffness=800, kinetic=3), 0.0
    for v in (0.01, 0.2, 0.003):
        bristles.step(v, 1e-3)
        way += 1e-3 * v
    assert bristles.force(0) == pytest.approx(3 * -np.expm1(-800 * way / 3), rel=16 * EPS)


@pytest.mark.parametrize("name", ["kinetic", "breakaway", "speed", "stiffness", "damping"])
def test_refusals(name):
    good = dict(stiffness=800, kinetic=3, breakaway=5, speed=0.25, damping=0.5)
    with pytest.raises(ValueError, match=name):
        perp.LuGre(**{**good, name: -1.0})
    with pytest.raises(ValueError, match=name):
        perp.LuGre(**{**good, name: np.nan})


def test_refused_steps_change_nothing():
    bristles = perp.LuGre(stiffness=800, kinetic=3, z=1e-3)
    for v, h in ((np.inf, 1), (1, 0), (1, -1), (1, np.nan)):
        with pytest.raises(perp.Error):
            bristles.step(v, h)
    assert bristles.z == 1e-3
    with pytest.raises(ValueError, match="v is nan"):
        perp.stribeck([1.0, np.nan], 3)
