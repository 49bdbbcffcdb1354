"""The box of decades per gain and the unit cube."""

from __future__ import annotations

import numpy as np
import pytest

from wristctl.control.law import Controller, Gain
from wristctl.errors import UserError
from wristctl.tuning.gain_space import GainSpace
from wristctl.tuning.search import _presets, _start

SPACE = GainSpace.of({"P1": Gain("1/rad", "", 1e-1, 1e5), "P2": Gain("s/rad", "", 1e-3, 1e3)})


def test_corners_of_the_cube_are_the_box_exactly() -> None:
    assert SPACE.gains(np.zeros(2)).tolist() == [1e-1, 1e-3]
    assert SPACE.gains(np.ones(2)).tolist() == [1e5, 1e3]


def test_equal_steps_of_the_cube_are_equal_factors() -> None:
    gains = SPACE.gains(np.linspace(0.0, 1.0, 7)[:, None].repeat(2, axis=1))
    np.testing.assert_allclose(gains[1:] / gains[:-1], 10.0, rtol=1e-12)
    assert SPACE.decades == pytest.approx([6.0, 6.0])


def test_gains_and_unit_undo_each_other() -> None:
    points = np.random.default_rng(0).random((4, 5, 2))
    np.testing.assert_allclose(SPACE.unit(SPACE.gains(points)), points, atol=1e-12)


@pytest.mark.parametrize("gains", [[1.0, 1e4], [1.0, 0.0], [1.0, np.nan]])
def test_gain_outside_its_box_is_named(gains: list[float]) -> None:
    with pytest.raises(UserError, match=r"P2.*0\.001 to 1000"):
        SPACE.unit(np.array(gains))


def test_of_many_gains_that_which_lies_outside_is_named() -> None:
    three = GainSpace.of({name: Gain("", "", 1.0, 10.0**k) for k, name in enumerate("abc", start=1)})
    for at, name in enumerate("abc"):
        gains = np.full((2, 4, 3), 5.0)
        gains[1, 2, at] = 2.0 * 10.0 ** (at + 1)
        with pytest.raises(UserError, match=f"gain {name} outside"):
            three.unit(gains)
    assert three.unit(np.array([10.0, 1.0, 10.0])) == pytest.approx([1.0, 0.0, 1.0 / 3.0])


def test_a_search_starts_at_the_last_preset_that_lies_in_the_box_with_every_gain() -> None:
    presets = {"low": {"P1": 1.0, "P2": 1e-4}, "in": {"P1": 1e2, "P2": 1.0}, "high": {"P1": 1e6, "P2": 1.0}}
    gains = {"P1": Gain("", "", 1e-1, 1e5), "P2": Gain("", "", 1e-3, 1e3)}
    law = Controller("boxed", None, "a test", gains, presets)
    assert list(_presets(law, SPACE)) == ["in"]
    assert _start(law, SPACE) == pytest.approx([0.5, 0.5])
    two = Controller("boxed", None, "a test", gains, presets | {"corner": {"P1": 1e5, "P2": 1e-3}})
    assert _start(two, SPACE) == pytest.approx([1.0, 0.0])
    far = Controller("boxed", None, "a test", gains, {"low": presets["low"]})
    assert _start(far, SPACE) == pytest.approx([0.5, 0.5])
