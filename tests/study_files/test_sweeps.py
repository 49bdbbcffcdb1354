"""Sweeps as they are written, and the studies at their points."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from wristctl.config.choices import CONTROLLERS
from wristctl.config.leaves import named_by
from wristctl.config.study import Study
from wristctl.errors import UserError
from wristctl.study_files.load import load_study
from wristctl.study_files.sweeps import SweepAxis, axes_of, points_of, study_at, unit_at


def swept(*sweep: str) -> Study:
    return load_study().model_copy(update={"sweep": sweep})


def values(text: str) -> list[object]:
    (axis,) = axes_of(swept(f"wrist.length={text}"), "simulate")
    return list(axis.values)


def test_lists_ranges_and_logarithmic_ranges_have_the_values_they_say() -> None:
    assert values("0.05,0.06, 0.08") == [0.05, 0.06, 0.08]
    assert values("0.05..0.07:5") == pytest.approx([0.05, 0.055, 0.06, 0.065, 0.07])
    assert values("0.01..1 log:3") == pytest.approx([0.01, 0.1, 1.0])
    assert values("x0.5..1.5:3") == ["x0.5", "x1", "x1.5"]
    assert values("0.05..0.07:1") == [0.05] and len(values("~1..3:1")) == 1, "one value is a sweep too"


def test_distributions_are_drawn_from_a_stream_of_the_leafs_own() -> None:
    even, normal = np.array(values("~1..3:4000")), np.array(values("~normal(2, 0.5):4000"))
    assert 1.0 <= even.min() < 1.01 and 2.99 < even.max() <= 3.0 and even.mean() == pytest.approx(2.0, abs=0.05)
    assert (normal.mean(), normal.std()) == pytest.approx((2.0, 0.5), abs=0.05)
    assert np.log(np.array(values("~1..100 log:4000"))).mean() == pytest.approx(np.log(10.0), abs=0.1)
    assert values("~1..3:5") == values("~1..3:5")
    other = axes_of(swept("wrist.damping=~1..3:5"), "simulate")[0].values
    assert list(other) != values("~1..3:5")


@given(st.lists(st.integers(1, 4), min_size=1, max_size=3), st.integers(0, 3))
def test_points_multiply_and_drawn_axes_go_together(counts: list[int], drawn: int) -> None:
    axes = [SweepAxis(f"g{k}", tuple(range(many)), False, "") for k, many in enumerate(counts)]
    axes += [SweepAxis(f"d{k}", tuple(range(5)), True, "") for k in range(drawn)]
    points = points_of(axes)
    assert len(points) == np.prod(counts) * (5 if drawn else 1) and len(set(points)) == len(points)
    assert all(len(set(point[len(counts) :])) <= 1 for point in points)


@pytest.mark.parametrize(
    "key, value, unit",
    [
        ("wrist.length", 0.09, "m"),
        ("loop.plant_segments", 2, "1"),
        ("loop.plant.actuator.tendon_stiffness", 1e4, "N/m"),
        ("loop.plant.stiffness", "x1.2", "N m/rad"),
        ("reference.angle_deg", 12.0, "deg"),
        ("controller", "pid", "1"),
    ],
)
def test_a_point_changes_its_leaf_and_nothing_else(key: str, value: object, unit: str) -> None:
    study = swept(f"{key}={value}")
    (axis,) = axes_of(study, "simulate")
    at = study_at(study, [axis], [value])
    known = load_study(None or [], [f"{key}={value}"], "simulate")
    assert at.model_copy(update={"sweep": ()}) == known and unit_at(study, axis.path) == unit


def test_leaves_of_lists_and_whole_numbers_given_as_ranges_are_reached() -> None:
    study = load_study(overrides=["compare.controllers=[{controller: smc, gains: printed}, {controller: pid}]"])
    axes = axes_of(
        study.model_copy(
            update={"sweep": ("controllers.1.controller=mrac", "loops.four-segments.plant_segments=1..3:3")}
        ),
        "compare",
    )
    at = study_at(study, axes, ["mrac", 3.0])
    assert [row.controller for row in at.compare.rows] == ["smc", "mrac"] and at.compare.loops[
        "four-segments"
    ].plant_segments == 3


@pytest.mark.parametrize("item", [0, 1, 2])
def test_the_other_items_of_a_list_stay_whichever_is_swept(item: int) -> None:
    """Rows of settings, numbers, and numbers within a row."""
    rows = "compare.controllers=[{controller: smc, gains: printed}, {controller: pid}, {controller: ct-dob}]"
    places = "wrist.tendons=[{angle_deg: 0}, {angle_deg: 120}, {angle_deg: 240}]"
    study = load_study(overrides=[rows, places, "wrist.gravity=[-9.0, 2.0]"])
    swept = (f"controllers.{item}.controller=mrac", f"wrist.tendons.{item}.angle_deg=7", f"wrist.gravity.{item % 2}=3")
    at = study_at(study, axes_of(study.model_copy(update={"sweep": swept}), "compare"), ["mrac", 7.0, 3.0])
    names, angles, gravity = ["smc", "pid", "ct-dob"], [0.0, 120.0, 240.0], [-9.0, 2.0]
    names[item], angles[item], gravity[item % 2] = "mrac", 7.0, 3.0
    assert [row.controller for row in at.compare.rows] == names
    assert not isinstance(at.wrist.tendons, str) and [place.angle_deg for place in at.wrist.tendons] == angles
    assert list(at.wrist.gravity) == gravity


@pytest.mark.parametrize(
    "sweep, told",
    [
        (["wrist.lenght=0.05,0.06"], r"no setting wrist.lenght - .*wrist.lenght=0.05,0.06.*did you mean 'length'"),
        (["wrsit.length=0.05"], r"there is no setting wrsit.length .* did you mean 'wrist'"),
        (["loop.plant=1"], r"simulate.loop.plant is a group of settings"),
        (["gains.Kx=1"], r"there is no setting simulate.gains.Kx"),
        (["wrist.length=0..1:1000000000"], r"a sweep of 1e\+09 points is more than 1e\+06 .* drawn ones"),
        (["wrist.length=0.1..1:1100", "wrist.damping=0.1..1:1100"], r"a sweep of 1.21e\+06 points"),
        (["wrist.length=0.05..0.06"], r"a range says how many values it has"),
        (["wrist.length=0.06..0.05:3"], r"'0.06..0.05' is neither a range nor a distribution"),
        (["wrist.length=~gauss(1,2):3"], r"'gauss\(1,2\)' is neither"),
        (["wrist.length=0.05..0.06:0"], r"a sweep of no values"),
        (["wrist.length"], r"a sweep is KEY=VALUES"),
        (["wrist.length=1,,2"], r"a value is missing"),
        (["wrist.length=0.05,-1"], r"wrist.length cannot be -1: -1.0 should be greater than 0 - .* - fix: arc length"),
        (["simulate.controller=pidd,pid"], r"cannot be 'pidd': .* - --sweep .* - fix: did you mean 'pid'\? All: adrc"),
        (["wrist.length=5m,6"], "cannot be '5m': .* with a unit - .* - fix: give the number without its unit, in m"),
        (["loop.plant_segments=1..2:3"], r"simulate.loop.plant_segments cannot be 1.5"),
        (["wrist.length=1,2", "wrist.length=3"], r"wrist.length is swept twice"),
        (["wrist.length=~1..2:3", "wrist.damping=~1..2:4"], r"drawn settings go together, and 3 and 4 values do not"),
    ],
)  # fmt: skip
def test_a_sweep_that_cannot_be_is_named(sweep: list[str], told: str) -> None:
    study = swept(*sweep)
    with pytest.raises(UserError, match=told) as raised:
        axes = axes_of(study, "simulate")
        for point in points_of(axes):
            study_at(study, axes, point)
    assert raised.value.exit_code == 2


def test_as_many_points_as_there_may_be_are_taken_and_drawn_ones_count_once(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("wristctl.study_files.sweeps.MOST_POINTS", 6)
    six = ["wrist.length=0.1,0.2,0.3", "wrist.damping=~1..2:2", "wrist.mass=~1..2:2"]
    assert len(points_of(axes_of(swept(*six), "simulate"))) == 6
    with pytest.raises(UserError, match="a sweep of 12 points is more than 6"):
        axes_of(swept(*six, "wrist.stiffness=1,2"), "simulate")


def test_what_a_kind_of_reference_adds_has_its_unit() -> None:
    study = load_study([], ["simulate.reference.kind=chirp"])
    units = {name: unit_at(study, ("simulate", "reference", name)) for name in ("end_frequency", "offset_deg", "seed")}
    assert units == {"end_frequency": "1/s", "offset_deg": "deg", "seed": "1"}
    daily = study.simulate.reference.model_copy(update={"kind": "adl:jar"})
    assert unit_at(daily, ("scale",)) == "1" and unit_at(daily, ("frequency",)) == "1/s"


def test_the_place_of_ones_own_controller_counts_from_the_file_that_sweeps_it(tmp_path: Path) -> None:
    """A study file's from its folder, an override's from here; what a sweep has beside it stays as it was typed."""
    axis, other = "controller=ct-dob, 'mine.py:MY_PD',{}/b.py:B", "wrist.length=0.05, 0.1"
    (tmp_path / "inner").mkdir()
    (tmp_path / "inner" / "study.yaml").write_text(f'sweep: ["{axis.format("..")}", "{other}"]\n')
    here, above = Path.cwd(), tmp_path / "inner"
    study = load_study([above / "study.yaml"])
    assert study.sweep == (f"controller=ct-dob,{above}/mine.py:MY_PD,{tmp_path}/b.py:B", other)
    study = load_study([], [f'sweep=["{axis.format("/a")}"]'])
    assert study.sweep == (f"controller=ct-dob,{here}/mine.py:MY_PD,/a/b.py:B",)
    assert load_study([], ["sweep=['controller= pid , ct-dob']"]).sweep == ("controller= pid , ct-dob",)


def test_the_names_that_a_sweep_takes_in_turn_are_among_those_of_the_study() -> None:
    """What is no controller at all is left to the value's own error."""
    study = swept("simulate.controller=/a/b.py:B,pid,no-such", "compare.controllers.0.controller=pid,/c.py:C")
    named = [name for table, name in named_by(study) if table is CONTROLLERS]
    assert named[-2:] == ["/a/b.py:B", "/c.py:C"] and named.count("pid") == 1 and "no-such" not in named
    assert "/a/b.py:B" not in [name for _, name in named_by(study, {"simulate", "compare"})]
