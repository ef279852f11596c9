"""Models that are wrong at first sight are refused, and right ones are not."""

import numpy as np
import pytest

import perp


def rod(sign=1.0, turn=1.0, tangent=((1.0, 0.0, 0.5),), **settings):
    """A rod whose end touches the floor: gap = y - cos(theta) / 2."""

    def contacts(q):
        lever = np.sin(q[2]) / 2
        return q[1] - np.cos(q[2]) / 2, [[0, sign, sign * turn * lever]], np.array(tangent)

    return perp.Mechanism(
        3, mass=[1, 1, 0.1], force=[0, -9.81, 0], contacts=contacts, mu=0.3, **settings
    )


START = [0.0, 0.6, 0.3]


def test_right_models_pass():
    assert rod().step(0, START, [0, 0, 0], 0.01).ok


@pytest.mark.parametrize(
    "model, complaint",
    [
        (dict(sign=-1.0), r"normal \(0, 1\) is -1, but contacts\(q\): gap\[0\] changes by 1"),
        (dict(turn=-1.0), r"normal \(0, 2\) is -0.14776, but .* changes by 0.14776"),
        (dict(turn=2.0), r"normal \(0, 2\)"),
        (dict(tangent=[[0, 2, np.sin(0.3)]]), "tangent row 0 is a multiple of the normal of cont"),
    ],
)
def test_wrong_models_are_refused(model, complaint):
    with pytest.raises(ValueError, match=complaint):
        rod(**model).step(0, START, [0, 0, 0], 0.01)
    with pytest.raises(ValueError, match=complaint):
        rod(**model).simulate(START, [0, 0, 0], 0.1, 0.01)
    # and whoever knows better may go on
    rod(**model, check=False).step(0, START, [0, 0, 0], 0.01)


def test_a_tangent_that_is_the_normal_again_is_refused():
    ball = perp.Mechanism(2, force=[1, -9.81], mu=0.3,
                          contacts=lambda q: (q[1], [[0, 1]], [[0, 1]]))
    with pytest.raises(ValueError, match="tangent row 0 is a multiple of the normal of contact 0"):
        ball.step(0, [0, 1], [0, 0], 0.1)


def test_friction_without_tangents_is_refused_unless_none_is_meant():
    def ball(**settings):
        return perp.Mechanism(2, force=[1, -9.81], contacts=lambda q: (q[1], [[0, 1]]), **settings)

    with pytest.raises(ValueError, match="mu is above 0, but contacts returned no tangent"):
        ball(mu=0.5).step(0, [0, 1], [0, 0], 0.1)
    with pytest.raises(ValueError, match="mu_static is above 0"):
        ball(mu_static=[0.5]).step(0, [0, 1], [0, 0], 0.1)
    assert ball().step(0, [0, 1], [0, 0], 0.1).ok
    assert ball(mu=0.5, dim=1).step(0, [0, 1], [0, 0], 0.1).ok


def test_gradients_of_constraints():
    def pendulum(sign):
        return perp.Mechanism(
            2,
            force=[0, -9.81],
            bilateral=lambda q: (q @ q - 1, [[2 * q[0], sign * 2 * q[1]]]),
        )

    assert pendulum(1.0).step(0, [0.6, -0.8], [0, 0], 1e-3).ok
    with pytest.raises(ValueError, match=r"bilateral\(q\): G \(0, 1\) is 1.6"):
        pendulum(-1.0).step(0, [0.6, -0.8], [0, 0], 1e-3)


def test_kinks_and_edges_of_the_domain_are_let_through():
    """At a kink no gradient is wrong; where differences leave the domain nothing is said."""
    kink = perp.Mechanism(1, contacts=lambda q: (abs(q[0]), [[1.0]]))
    assert kink.step(0, [0.0], [0.0], 0.1).ok

    def root(q):
        if q[0] < 1.0:
            raise perp.OutsideDomain
        return np.sqrt(q[0] - 1.0), [[0.5]]

    assert perp.Mechanism(1, contacts=root).step(0, [1.0], [1.0], 0.1).outcome == "solved"


def test_gradients_along_velocities_of_other_coordinates():
    """A unit complex number turns at v: its gap's gradient is by v, not by the coordinates."""
    wheel = perp.Mechanism(
        1,
        coordinates=2,
        kinematics=lambda q, v: np.array([-q[1], q[0]]) * v,
        contacts=lambda q: (q[1], [[q[0]]]),
    )
    assert wheel.step(0, [0.6, 0.8], [0.0], 0.1).ok


def test_drifts():
    """A floor that rises has to say so."""

    def lift(speed):
        return perp.Mechanism(1, contacts=lambda t, q: (q[0] - 2 * t, [[1.0]], None, speed))

    assert lift(-2.0).step(0, [1.0], [0.0], 0.1).ok
    with pytest.raises(ValueError, match=r"contacts\(t, q\): drift of gap\[0\] is 0, but .* by -2"):
        lift(None).step(0, [1.0], [0.0], 0.1)


def test_check_tells_without_refusing():
    right, wrong = rod().check(START), rod(turn=2.0).check(START, [0, 0, 1])
    assert right.ok and right.wrong == 0 and right.complaint == ""
    assert not wrong.ok and wrong.wrong == 1
    assert "normal (0, 2)" in wrong.complaint
    assert wrong.given == pytest.approx(2 * wrong.difference, abs=10 * wrong.uncertainty)
    # a gap that is one step's number is told, not refused
    step = perp.Mechanism(1, contacts=lambda q: (0.25, [[1.0]]))
    assert step.check([0.0]).constant == 1 and not step.check([0.0]).ok
    assert step.step(0, [0.0], [0.0], 0.1).ok


def test_a_drift_above_overlap_is_told():
    """A pendulum in x and y whose constraint is not projected drifts, c = (h v)^2 a step."""
    pendulum = perp.Mechanism(
        2, force=[0, -9.81], bilateral=lambda q: (q @ q - 1, [2 * q])
    )
    for overlap, outcome in ((0.0, "solved"), (0.2, "solved"), (0.05, "stalled")):
        run = pendulum.simulate([1, 0], [0, 0], 1, 1e-2, project=False, overlap=overlap)
        assert run.outcome == outcome and 0.05 < run.q[-1] @ run.q[-1] - 1 < 0.2
