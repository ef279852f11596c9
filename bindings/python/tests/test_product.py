"""lcp_product: Hertz' contact by FFT against its closed form, random problems against lcp(), and
what goes wrong in a caller's function."""

from __future__ import annotations

from typing import Any, Callable

import numpy as np
import pytest

import perp

Array = Any


def half_space(side: int, h: float) -> tuple[Callable[[Array], Array], Array]:
    """What uniform pressures on squares of width h sink an elastic half-space with E* = 1 by, at
    the centres of side x side of them (Love 1929): a convolution, by FFT; and one column of M."""
    k = np.arange(-side, side) * h
    x, y = np.meshgrid(k, k, indexing="ij")
    kernel = np.zeros_like(x)
    for sx in (-1, 1):
        for sy in (-1, 1):
            a, b = x + sx * h / 2, y + sy * h / 2
            r = np.hypot(a, b)
            kernel += sx * sy * (a * np.log(b + r) + b * np.log(a + r)) / np.pi
    transform = np.fft.rfft2(np.fft.ifftshift(kernel))

    def product(p: Array) -> Array:
        wide = np.fft.irfft2(transform * np.fft.rfft2(p.reshape(side, side), (2 * side,) * 2))
        return wide[:side, :side].ravel()

    return product, kernel


def ball(side: int, width: float, depth: float) -> tuple[Callable[[Array], Array], Array, float]:
    """A ball of radius 1, `depth` into the half-space: the product, q, and an area a cell."""
    h = width / side
    centre = (np.arange(side) - (side - 1) / 2) * h
    x, y = np.meshgrid(centre, centre, indexing="ij")
    return half_space(side, h)[0], ((x**2 + y**2) / 2 - depth).ravel(), h * h


def test_hertz() -> None:
    depth = 0.01
    radius, force = np.sqrt(depth), 4 / 3 * depth**1.5
    errors = []
    for side in (32, 64, 128):
        product, q, area = ball(side, 2.6 * radius, depth)
        result = perp.lcp_product(product, q)
        assert result.outcome == "solved"
        assert result.method == "mprgp"
        assert result.iterations < 200  # the condition is about that of one side's cells
        assert np.all(result.z >= 0) and np.all(result.w >= -1e-10 * depth)
        errors.append(abs(result.z.sum() * area / force - 1))
        # (p = p0 sqrt(1 - r^2/a^2)) is 2/pi sqrt(depth) in the middle; cells average over it
        assert result.z.max() == pytest.approx(2 / np.pi * np.sqrt(depth), rel=2 / side)
    # the pressure's root at the rim is cut by cells: the force errs by less than a cell's share
    assert errors[0] < 0.02 and errors[2] < 0.005


def test_as_the_whole_matrix() -> None:
    product, q, _ = ball(14, 0.26, 0.01)
    M = np.array([product(column) for column in np.eye(len(q))])
    whole = perp.lcp(0.5 * (M + M.T), q, upper=0.05)
    result = perp.lcp_product(product, q, upper=0.05, tol=1e-12)
    assert whole.ok and result.ok
    assert (whole.z == 0.05).sum() > 4 and (whole.z == 0).sum() > 4  # all three places are there
    # cond(M) = 1e2 times the residuals of both
    np.testing.assert_allclose(result.z, whole.z, atol=1e-8)
    np.testing.assert_array_equal(result.z == 0.05, whole.z == 0.05)


def test_units_by_the_diagonal() -> None:
    rng = np.random.default_rng(3)
    A = rng.normal(size=(40, 40))
    M, q = A @ A.T + np.eye(40), rng.normal(size=40)
    units = 10.0 ** rng.integers(-4, 5, 40)
    scaled = M * units[:, None] * units
    plain = perp.lcp_product(lambda x: M @ x, q)
    result = perp.lcp_product(lambda x: scaled @ x, units * q, diagonal=np.diag(scaled))
    assert plain.ok and result.ok
    np.testing.assert_allclose(result.z * units, plain.z, atol=1e-8)  # cond(M) = 150, tol 1e-10
    blind = perp.lcp_product(lambda x: scaled @ x, units * q)
    assert result.iterations < 0.5 * blind.iterations


def test_products_are_few() -> None:
    """An obstacle's problem pushed both ways on side^2 nodes: the condition's root is 2 side / pi,
    so that conjugate gradients that knew what touches would take 7.5 side products to 1e-10."""
    for side in (30, 60):
        k = (np.arange(side) + 1) / (side + 1)
        x, _ = np.meshgrid(k, k)
        q = ((10 - 40 * (abs(x - 0.5) < 0.2)) / side**2).ravel()

        def product(z: Array) -> Array:
            grid = np.pad(z.reshape(side, side), 1)
            neighbours = grid[2:, 1:-1] + grid[:-2, 1:-1] + grid[1:-1, 2:] + grid[1:-1, :-2]
            return 4 * z - neighbours.ravel()

        result = perp.lcp_product(product, q)
        assert result.outcome == "solved"
        assert result.iterations < 2 * 7.5 * side


def test_functions_that_fail() -> None:
    class Unwell(Exception):
        pass

    def raises(x: Array) -> Array:
        raise Unwell

    with pytest.raises(Unwell):
        perp.lcp_product(raises, [1.0, -1.0])
    with pytest.raises(ValueError, match=r"shape \(3,\), expected \(2,\)"):
        perp.lcp_product(lambda x: np.ones(3), [1.0, -1.0])
    with pytest.raises(ValueError, match="not symmetric"):
        perp.lcp_product(lambda x: np.array([[1.0, 1.0], [0.0, 1.0]]) @ x, [1.0, -1.0])
    with pytest.raises(ValueError, match=r"diagonal\[1\]"):
        perp.lcp_product(lambda x: x, [1.0, -1.0], diagonal=[1.0, 0.0])
    result = perp.lcp_product(lambda x: x * np.nan, [1.0, -1.0])
    assert result.outcome == "evaluation_failed" and not result.ok


def test_monitor_and_limits() -> None:
    product, q, _ = ball(32, 0.26, 0.01)
    seen = []
    result = perp.lcp_product(product, q, monitor=lambda now: seen.append(now) or len(seen) > 5)
    assert result.outcome == "stopped" and len(seen) == 6
    assert seen[0].method == "mprgp"
    assert perp.lcp_product(product, q, max_iterations=15).outcome == "iteration_limit"
    with pytest.raises(ZeroDivisionError):
        perp.lcp_product(product, q, monitor=lambda now: 1 / 0)
