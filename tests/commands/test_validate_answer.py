"""The answer on a real robot: each model by what it adds, errors in the robot's unit, whether authors are beaten."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from matplotlib.patches import Rectangle

from wristctl.commands.quantities import told_table
from wristctl.commands.validate.answer import (
    model_rows,
    models_table,
    parameters_table,
    steps_table,
    validated_answer,
    wanted_terms,
)
from wristctl.commands.validate.figures import left_over, motion
from wristctl.identification.arc_fit import Told
from wristctl.identification.prediction_scores import Score
from wristctl.identification.real_robots import RealRobot


def robot(scale: float = 1e3, unit: str = "mm", authors: float | None = 3.0, **more: Any) -> RealRobot:
    known: Any = {"robot": SimpleNamespace(scale=scale, unit=unit), "read": None}
    told = (("their best", authors), ("another", 9.0)) if authors is not None else ()
    return RealRobot("a trunk", "Somebody 2020", **known, parts="all but the last", asked="error", authors=told, **more)


def model(*terms: str, error: float = 2e-3, verdict: str = "", without: Any = None, numbers: int = 7) -> Any:
    """A tried model whose error has an interval of 10 % to both sides; half of that is of the one without."""
    return SimpleNamespace(
        terms=terms, words="elastic arcs and tendons" + "".join(f" + {term}" for term in terms), numbers=numbers,
        score=Score(error, 0.9 * error, 1.1 * error, 12), ratio=Score(0.5, 0.4, 0.6, 12) if without else None,
        verdict=verdict, without=without,
    )  # fmt: skip


BARE = model(numbers=5)
SLACK = model("slack", verdict="wanted", without=BARE)
CREEP = model("slack", "creep", verdict="unwanted", without=SLACK)
INNER = model("slack", "inner friction", verdict="not told", without=SLACK)
FRICTION = model("slack", "tendon friction", verdict="wanted", without=SLACK)
ALL = model("slack", "tendon friction", "inner friction", without=SLACK, numbers=11)
MODELS = (BARE, SLACK, CREEP, INNER, FRICTION, ALL)


def test_each_model_is_named_by_what_it_adds_to_slack() -> None:
    names = [row[0] for row in model_rows(MODELS, 1e3)]
    assert names == [
        "arcs and tendons", "arcs and tendons + slack", "+ creep", "+ inner friction", "+ tendon friction",
        "+ all that is wanted",
    ]  # fmt: skip
    friction = model("tendon friction", without=BARE), model("tendon friction", "creep", without=BARE)
    assert [row[0] for row in model_rows(friction, 1e3)] == [
        "arcs and tendons + tendon friction", "arcs and tendons + tendon friction + creep",
    ]  # fmt: skip


@pytest.mark.parametrize(("scale", "unit"), [(1e3, "mm"), (math.degrees(1.0), "deg")])
def test_errors_are_in_the_robots_unit_below_those_of_its_authors(scale: float, unit: str) -> None:
    table = models_table(robot(scale, unit), MODELS, {})
    assert f"error [{unit}]" in table.columns
    theirs, others, *ours = table.rows
    assert (theirs[0], theirs[2], others[2]) == ("their best", "3.00", "9.00")
    low, error, high = (scale * share * 2e-3 for share in (0.9, 1.0, 1.1))
    assert {row[2] for row in ours} == {f"{error:.2f} [{low:.2f}, {high:.2f}]"}
    assert [row[1] for row in ours] == [5, 7, 7, 7, 7, 11]
    assert [row[3] for row in ours] == ["", *["0.500 [0.400, 0.600]"] * 5]
    assert [row[4] for row in ours] == ["", "wanted", "unwanted", "not told", "wanted", ""]


def test_what_the_data_want_is_told_by_the_models_that_add_one_term() -> None:
    wanted, worse, untold = wanted_terms(MODELS).split(";")
    assert "slack" in wanted and "tendon friction" in wanted and "creep" in worse and "inner friction" in untold
    assert "nothing beside elastic arcs" in wanted_terms([BARE, model("slack", verdict="unwanted", without=BARE)])


@pytest.mark.parametrize(
    ("authors", "said"), [(2.3, "below the 2.30 mm"), (2.1, "not told apart from the 2.10 mm"), (1.7, "above the 1.70")]
)
def test_authors_are_beaten_where_the_whole_interval_is_below_theirs(authors: float, said: str) -> None:
    answer = validated_answer(robot(authors=authors), MODELS, SLACK, "", {})
    assert said in answer.sentence and "2.00 mm" in answer.sentence and "1.80 to 2.20" in answer.sentence
    assert (
        "predicts the tip of a trunk" in answer.sentence
        and answer.more.startswith("Somebody 2020. ")
        and ".tables" in answer.more
    )


def test_a_robot_without_its_authors_error_is_held_against_nobody() -> None:
    answer = validated_answer(robot(authors=None, in_sample=True), MODELS, SLACK, "results/x", {})
    notes = " ".join(map(str, answer.notes))
    assert "authors" not in answer.sentence + notes and "fits the tip" in answer.sentence
    assert (
        "12 blocks" in notes
        and "same prediction" not in notes
        and "--all" in answer.more
        and ".tables" not in answer.more
    )
    other = " ".join(map(str, validated_answer(robot(centred=True), MODELS, SLACK, "", {}).notes))
    assert "7 free numbers" in other and "same prediction" in other and "mean error does not count" in other


def test_an_unknown_that_the_data_do_not_tell_has_no_value() -> None:
    told = {
        "stiffness": Told(0.5, 0.4, 0.6, "N m/rad", "of the springs"),
        "slack": Told(1e-3, 0.0, math.inf, "m", "of"),
    }
    fits: list[Any] = [SimpleNamespace(told=told, recordings=[SimpleNamespace(name=name)]) for name in ("a", "b")]
    one, both = parameters_table(fits[:1]), parameters_table(fits)
    assert [tuple(row)[:3] for row in one.rows] == [
        ("stiffness", "0.5", "0.4 to 0.6"),
        ("slack", "not identifiable", ""),
    ]
    assert [row[0] for row in both.rows] == ["a", "a", "b", "b"] and len(both.columns) == len(one.columns) + 1


def test_a_step_has_its_error_over_all_and_over_its_last_second() -> None:
    """3 mm and 4 mm to two sides, then a tenth of it."""
    time = np.arange(0.0, 4.0, 0.1)
    wrong = np.where(time[:, None] > time[-1] - 1.0, 0.1, 1.0) * np.array([3e-3, 4e-3])
    step: Any = SimpleNamespace(
        recordings=[SimpleNamespace(name="0 g", time=time)], errors=[wrong], rms=lambda part: {"asked": 4e-3}[part]
    )
    assert [tuple(row) for row in steps_table(robot(), [step]).rows] == [("0 g", "4.00", "0.50")]


def test_errors_without_a_model_stand_between_the_authors_and_ours() -> None:
    table = models_table(robot(), MODELS, {"Gaussian process": Score(4e-3, 3e-3, 5e-3, 12)})
    assert [row[0] for row in table.rows[:4]] == ["their best", "another", "Gaussian process", "arcs and tendons"]
    assert table.rows[2][2] == "4.00 [3.00, 5.00]"


def test_an_error_below_a_tenth_has_the_digits_in_which_its_interval_is_seen() -> None:
    (row,) = model_rows([model(error=0.0177)], 1.0)
    assert row[2] == "0.0177 [0.0159, 0.0195]"


@pytest.mark.parametrize(("value", "shown"), [(3e-12, "0"), (-3e-12, "0"), (2e-3, "0.002"), (-0.5, "-0.5")])
def test_a_value_that_is_nothing_beside_its_interval_is_printed_as_nothing(value: float, shown: str) -> None:
    (row,) = told_table({"sheath": Told(value, min(value, 0.0), 0.04, "", "wrap")}).rows
    assert row[1] == shown


@pytest.mark.parametrize(("still", "timed"), [(0, True), (1, False)])
def test_the_figure_of_a_motion_has_the_bends_that_move_and_no_line_over_what_was_fitted(
    still: int, timed: bool
) -> None:
    """Each at its time."""
    measured = np.stack([np.arange(8.0), np.arange(8.0) ** 2], axis=1)
    measured[:, still] = 0.25
    asked = np.array([True, True, False, False, True, True, False, True])
    recording = SimpleNamespace(measured=measured, asked=asked, name="all", time=0.5 * np.arange(8.0))
    fit: Any = SimpleNamespace(recordings=[recording], errors=[np.full((8, 2), 0.5)])
    arc = SimpleNamespace(measured="bend", timed=timed)
    of_bends: Any = SimpleNamespace(robot=arc, scale=2.0, unit="deg", asked="part")
    (axes,) = motion(of_bends, [fit]).axes
    assert axes.get_ylabel() == f"bend {'zy'[still]} [deg]"
    assert axes.get_xlabel() == ("time [s]" if timed else "sample")
    points, line = axes.lines
    np.testing.assert_array_equal(np.asarray(points.get_xdata()), recording.time[asked])
    np.testing.assert_array_equal(np.asarray(points.get_ydata()), 2.0 * measured[asked, 1 - still])
    drawn = np.asarray(line.get_ydata())
    assert list(np.flatnonzero(np.isnan(drawn))) == [2, 5], "a gap where samples between were fitted"
    np.testing.assert_array_equal(drawn[~np.isnan(drawn)], 2.0 * (measured[asked, 1 - still] + 0.5))


@pytest.mark.parametrize("count", [2, 5])
def test_the_figure_of_what_is_left_has_each_error_at_the_number_of_its_sample_and_counts_all_recordings(
    count: int,
) -> None:
    asked = np.array([True, True, False, False, True, True, False, True])
    recordings = [SimpleNamespace(asked=asked, name=f"t{k}", time=0.5 * np.arange(8.0)) for k in range(count)]
    fit: Any = SimpleNamespace(recordings=recordings, errors=[np.full((8, 2), [3.0 + k, 0.0]) for k in range(count)])
    of_bends: Any = SimpleNamespace(scale=2.0, unit="deg", centred=False)
    left, right = left_over(of_bends, [fit]).axes
    *points, line = left.lines
    drawn = min(count, 3)
    assert len(points) == drawn
    for k, of_recording in enumerate(points):
        np.testing.assert_array_equal(np.asarray(of_recording.get_xdata()), 8 * k + np.flatnonzero(asked))
    root = 2.0 * np.sqrt(np.mean((3.0 + np.arange(count)) ** 2))
    assert np.asarray(line.get_ydata())[0] == pytest.approx(root)
    assert sum(bar.get_width() for bar in right.patches if isinstance(bar, Rectangle)) == 5 * count
