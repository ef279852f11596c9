"""contact_sensitivity: a closed form, differences of solves, matrices, verdicts."""

import numpy as np
import pytest

import perp

# a block on a plane, pushed along it: normal, tangents
M = np.diag([2.0, 2.0, 2.0])
H = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
f, w = np.array([6.0, 8.0, -10.0]), np.zeros(3)


def solve(M=M, f=f, H=H, w=w, mu=0.5):
    result = perp.contact(M, f, H, w, mu, tol=1e-13)
    assert result.ok
    return result


def test_mu_slows_what_slips():
    s = perp.contact_sensitivity(M, f, H, w, 0.5, solve().impulse)
    assert s.differentiable and s.reason is None and list(s.modes) == ["slip"]
    dv, dr = s.forward(dmu=[1.0])
    # dv = -r_n e / m, e = (3, 4) / 5, to rounding
    np.testing.assert_allclose(dv, [-3.0, -4.0, 0.0], atol=1e-13)
    np.testing.assert_allclose(dr, [0.0, -6.0, -8.0], atol=1e-13)
    np.testing.assert_allclose(s.adjoint(gv=[3.0, 4.0, 0.0])[3], [-25.0], atol=1e-12)


def test_differences_and_matrices():
    rng = np.random.default_rng(1)
    s = perp.contact_sensitivity(M, f, H, w, 0.5, solve().impulse)
    dM, dH = rng.standard_normal((3, 3)), rng.standard_normal((3, 3))
    dM, df, dw = dM + dM.T, rng.standard_normal(3), rng.standard_normal(3)
    dv, dr = s.forward(df, dw, None, [0.3], dM, dH)
    h = 1e-5  # h^2 is left of the third derivatives, 1e-13 / h of the solves
    ahead, behind = (
        solve(M + t * dM, f + t * df, H + t * dH, w + t * dw, 0.5 + t * 0.3) for t in (h, -h)
    )
    np.testing.assert_allclose((ahead.v - behind.v) / (2 * h), dv, atol=1e-6)
    np.testing.assert_allclose((ahead.impulse - behind.impulse) / (2 * h), dr, atol=1e-6)
    gv, gr = rng.standard_normal(3), rng.standard_normal(3)
    x, y, z, mu = s.adjoint(gv, gr)
    of_M, of_H, of_G = s.adjoint_matrices(gv, gr)
    assert z.shape == (0,) and of_G.shape == (0, 3)
    right = x @ df + y @ dw + mu[0] * 0.3 + np.sum(of_M * dM) + np.sum(of_H * dH)
    assert right == pytest.approx(gv @ dv + gr @ dr, rel=1e-11)


def test_verdicts():
    at_threshold = perp.contact_sensitivity(M, f / [2, 2, 1], H, w, 0.5, [10.0, -3.0, -4.0])
    assert at_threshold.reason == "degenerate" and at_threshold.index == 0
    wrong = perp.contact_sensitivity(M, f, H, w, 0.5, [11.0, -3.0, -4.0])
    assert wrong.reason == "not a solution" and not wrong.differentiable
    with pytest.raises(ValueError, match="no derivatives"):
        wrong.forward(df=f)
    with pytest.raises(ValueError, match="dmu"):
        perp.contact_sensitivity(M, f, H, w, 0.5, solve().impulse).forward(dmu=[1.0, 2.0])


def test_a_drawer_between_guides():
    """Friction grows with |r_N|: of both answers v = V + F / (m (1 +- 2 mu h / L))."""
    mass, pull, offset, guide, speed = 2.0, 3.0, 0.5, 0.25, 20.0
    H = np.array(
        [[0, 1, guide / 2], [1, 0, offset], [0, 1, -guide / 2], [1, 0, offset]], dtype=float
    )
    M, f = np.diag([mass, mass, 0.5]), np.array([mass * speed + pull, 0.0, pull * offset])

    def answer(mu, r0):
        result = perp.contact(M, f, H, mu=mu, dim=2, two_sided=1, r0=r0, tol=1e-13)
        assert result.ok
        return result

    for side in (1.0, -1.0):
        change = pull / (1.0 + side * 2.0 * 0.4 * offset / guide)
        N = change * offset / guide
        result = answer(0.4, [-N, -0.4 * abs(N), N, -0.4 * abs(N)])
        s = perp.contact_sensitivity(
            M, f, H, np.zeros(4), 0.4, result.impulse, dim=2, two_sided=1
        )
        assert s.differentiable and list(s.modes) == ["slip", "slip"]
        dv, dr = s.forward(dmu=[1.0, 1.0])
        h = 1e-5  # h^2 is left of the third derivatives, 1e-13 / h of the solves
        ahead, behind = (answer(0.4 + t, result.impulse) for t in (h, -h))
        size = 1.0 + np.abs(dr).max()
        np.testing.assert_allclose((ahead.v - behind.v) / (2 * h), dv, atol=1e-7 * size)
        np.testing.assert_allclose((ahead.impulse - behind.impulse) / (2 * h), dr, atol=1e-7 * size)
        by_mu = s.adjoint(gv=[1.0, 0.0, 0.0])[3]
        assert by_mu.sum() == pytest.approx(dv[0], rel=1e-12)
