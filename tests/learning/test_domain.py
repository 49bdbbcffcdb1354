"""The region of inputs: its edges, its parts, and what lies in it."""

from __future__ import annotations

import numpy as np

from wristctl.learning.domain import OTHERS, Domain
from wristctl.wrist.kinematics import arc_tip

DOMAIN = Domain((-0.8, 0.5), (0.07, 0.09), ((0.0, 3.0), (-0.4, 0.2)))


def inside(theta: float = 0.0, length: float = 0.08, pose: float = 1.0, mass: float = 0.0) -> bool:
    tip = arc_tip(np.array([theta]), np.array([length]))
    return bool(DOMAIN.contains(np.hstack([tip, [[pose, mass]]]))[0])


def test_every_input_has_both_ends_and_rounding_at_them_is_inside() -> None:
    assert inside()
    ends: tuple[tuple[str, float, float], ...] = (
        ("theta", -0.8, 0.5), ("length", 0.07, 0.09), ("pose", 0.0, 3.0), ("mass", -0.4, 0.2),
    )  # fmt: skip
    for name, low, high in ends:
        slack = 1e-9 * max(abs(low), abs(high))
        for end, out in ((low, -1.0), (high, 1.0)):
            assert inside(**{name: end + 0.5 * out * slack}), "rounding"
            assert not inside(**{name: end + 3.0 * out * slack})


def test_a_region_around_samples_touches_the_outermost_of_each_input() -> None:
    rng = np.random.default_rng(0)
    theta, length, others = rng.uniform(-0.6, 0.7, 50), rng.uniform(0.06, 0.1, 50), rng.random((50, 2))
    found = Domain.around(arc_tip(theta, length), others)
    np.testing.assert_allclose(found.theta, (theta.min(), theta.max()))
    np.testing.assert_allclose(found.arc_length, (length.min(), length.max()))
    np.testing.assert_allclose(found.others, [(column.min(), column.max()) for column in others.T])
    assert found.contains(np.hstack([arc_tip(theta, length), others])).all()


def test_at_values_of_its_other_inputs_it_is_the_region_of_tips_or_none() -> None:
    assert DOMAIN.at(np.array([3.0, -0.4])) == Domain(DOMAIN.theta, DOMAIN.arc_length)
    assert not DOMAIN.is_empty and not Domain((0.3, 0.3), (0.08, 0.08)).is_empty, "one tip is something"
    for values in ([3.1, 0.0], [1.0, 0.3], [-0.1, 0.0], [1.0, -0.5]):
        nothing = DOMAIN.at(np.array(values))
        assert nothing.is_empty and nothing.arc_length[0] > nothing.arc_length[1]
        assert not nothing.contains(arc_tip(np.linspace(-1.5, 1.5, 31), 0.08)).any()


def test_inputs_after_the_tip_have_units() -> None:
    assert OTHERS == {"pose": "rad", "roll": "rad", "hand_mass": "kg"}
