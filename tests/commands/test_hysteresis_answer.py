"""The answer on a measured loop has every parameter in its unit, and a dash for what the loop does not tell."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from wristctl.commands.identify.hysteresis import loop_answer
from wristctl.config.wrist import WristParameters
from wristctl.identification.friction_fit import FrictionEstimate
from wristctl.identification.loop_shape import LoopShape

NOTHING = LoopShape(None, None, None, None, 0)


def about(value: float, share: float = 0.1) -> FrictionEstimate:
    return FrictionEstimate(value, (1.0 - share) * value, (1.0 + share) * value)


def fit(freed: bool = True, winch: bool = False, **found: Any) -> Any:
    """A loop that tells all of its parameters, but for what is given."""
    problem = SimpleNamespace(
        supposed=SimpleNamespace(freed=freed, inner=True, words="all"),
        loop=SimpleNamespace(name="made.csv", winch=winch),
        settings=SimpleNamespace(lack_of_fit=2.0),
    )
    known: dict[str, Any] = {
        "friction": about(0.15), "sheath": about(0.5), "presliding": about(3e-5),
        "told_best": (math.radians(20.0), about(0.127)), "inner_friction": about(0.02),
        "inner_presliding": about(math.radians(0.5)), "stiffness": about(0.43), "tendon_radius": about(4e-3),
        "slack": (about(1e-4), about(2e-4)), "noise": np.array([math.radians(0.05), 0.06, 0.08]), "misfit": 1.0,
        "count": 321,
    }  # fmt: skip
    return SimpleNamespace(problem=problem, **{**known, **found})


@pytest.fixture(autouse=True)
def no_shape(monkeypatch: pytest.MonkeyPatch) -> None:
    """The loop's own shape is of another test."""
    monkeypatch.setattr("wristctl.identification.loop_shape.loop_shape", lambda loop, wrist: NOTHING)


def rows(one: Any) -> dict[str, tuple[Any, ...]]:
    """Value, interval and unit by the first words of each row."""
    table = loop_answer([one], WristParameters(), "").table
    assert table is not None
    return {str(name).partition(",")[0].partition(" (")[0]: tuple(cells) for name, *cells in table.rows}


TOLD = {
    "friction coefficient": ("0.15", "0.135 to 0.165", ""),
    "sheath": ("0.5", "0.45 to 0.55", "rad"),
    "presliding": ("30", "27 to 33", "um"),
    "coefficient x": ("0.127", "0.114 to 0.14", ""),
    "friction inside the wrist": ("0.02", "0.018 to 0.022", "N m"),
    "bend in which that turns round": ("0.5", "0.45 to 0.55", "deg"),
    "stiffness": ("0.43", "0.387 to 0.473", "N m/rad"),
    "tendon radius": ("4", "3.6 to 4.4", "mm"),
    "slack of the + side": ("0.1", "0.09 to 0.11", "mm"),
    "slack of the - side": ("0.2", "0.18 to 0.22", "mm"),
}
OF_SPOOLS = ("tendon radius", "slack of the + side", "slack of the - side")


def test_every_parameter_that_is_told_has_its_interval_and_unit() -> None:
    assert rows(fit()) == TOLD


@pytest.mark.parametrize(
    ("found", "untold"),
    [
        ({"friction": FrictionEstimate(0.15, 0.0, 0.3)}, {"friction coefficient", "sheath"}),
        ({"sheath": FrictionEstimate(0.5, 0.0, math.inf)}, {"friction coefficient", "sheath"}),
        ({"presliding": FrictionEstimate(3e-5, 0.0, math.inf)}, {"presliding"}),
        ({"inner_friction": FrictionEstimate(0.02, 0.0, 0.05)}, {"friction inside the wrist"}),
        ({"stiffness": FrictionEstimate(0.4, 0.2, 0.61)}, {"stiffness"}),
        ({"stiffness": FrictionEstimate(0.4, 0.2, 0.59)}, set()),
    ],
)
def test_what_the_loop_does_not_tell_is_a_dash_and_all_else_is_told(found: dict[str, Any], untold: set[str]) -> None:
    shown = rows(fit(**found))
    assert {name for name, cells in shown.items() if cells == ("-", "-", "")} == untold and shown.keys() == TOLD.keys()


def test_only_what_was_searched_for_has_a_row() -> None:
    """The radius and the slacks show where spools drove the wrist; friction inside it only where there is some."""
    assert TOLD.keys() - rows(fit(winch=True)).keys() == set(OF_SPOOLS)
    assert TOLD.keys() - rows(fit(freed=False)).keys() == {"stiffness", *OF_SPOOLS}
    bare = rows(fit(inner_friction=None, inner_presliding=None))
    assert TOLD.keys() - bare.keys() == {"friction inside the wrist", "bend in which that turns round"}


@pytest.mark.parametrize(("misfit", "refused"), [(1.9, False), (2.1, True)])
def test_a_model_that_leaves_more_than_noise_is_nothing_to_rely_on(misfit: float, refused: bool) -> None:
    answer = loop_answer([fit(misfit=misfit)], WristParameters(), "")
    assert answer.sentence.startswith("Nothing to rely on") == refused


def test_what_is_left_over_is_told_in_degrees_and_of_the_tensions_by_the_larger() -> None:
    noted = " ".join(map(str, loop_answer([fit()], WristParameters(), "").notes))
    assert "0.05 deg" in noted and "0.08 N" in noted and "321 samples" in noted
