"""What is said of a key: the names that its value may have, its unit and source, and where commands look for it."""

from __future__ import annotations

import pytest

from wristctl.config.choices import CONTROLLERS
from wristctl.study_files.keys import (
    choices_of,
    field_at,
    home_of,
    keys_of,
    section_keys,
    source_of,
    unit_of,
    whole_key,
)


@pytest.mark.parametrize(
    ("key", "unit", "choices"),
    [
        ("simulate.loop.actuator.level", "", ("ideal", "lagged", "tendon", "servo")),
        ("simulate.loop.sensor.level", "", ("ideal", "camera")),
        ("wrist.length", "m", ()),
        ("wrist.gravity", "m/s^2", ()),
        ("wrist.discs", "", ()),
        ("simulate.loop.limits", "", ()),
        ("simulate.loop.plant.end_stop_deg", "deg", ()),
        ("simulate.loop.disturbances.push.force", "N", ()),
        ("train.hidden", "", ()),
    ],
)
def test_a_key_has_a_unit_and_names_to_choose_from_where_they_are_few(
    key: str, unit: str, choices: tuple[str, ...]
) -> None:
    _, field = field_at(tuple(key.split(".")))
    assert field is not None and unit_of(field) == unit and tuple(choices_of(field)) == choices


def test_names_of_a_table_are_all_that_belong_to_it() -> None:
    _, field = field_at(("simulate", "controller"))
    assert field is not None and {"pid", "smc", "ct-dob"} <= set(choices_of(field)) <= set(CONTROLLERS)


def test_a_default_names_its_source() -> None:
    sources = {name: source_of(field) for name, field in keys_of(field_at(("wrist",))[0]).items()}
    assert "paper" in sources["stiffness"] and sources["length"] == "assumed"
    assert keys_of(float) == keys_of(None) == {}


def test_a_command_finds_keys_in_its_own_section_and_in_that_of_its_subject() -> None:
    assert whole_key("horizon", "tune") == "tune.horizon" and whole_key("horizon=3.0", "tune") == "tune.horizon=3.0"
    assert whole_key("loop.limits", "analyse") == "simulate.loop.limits" and home_of("analyse", "loop") == "simulate"
    own = next(key for key in section_keys("analyse") if key not in section_keys("simulate"))
    assert home_of("analyse", own) == "analyse" and whole_key(own, "analyse") == f"analyse.{own}"
    assert whole_key("wrist.length", "tune") == "wrist.length" and whole_key("horizon", None) == "horizon"
    assert section_keys(None) == {} and set(section_keys("simulate")) < set(section_keys("analyse"))


def test_the_way_to_a_leaf_goes_through_lists_and_through_groups_that_may_be_left_out() -> None:
    """The annotation at its end, and the field that it belongs to."""
    assert field_at(("compare", "controllers", 1, "gains"))[1] is not None
    kind, field = field_at(("tune", "loops", "any", "plant", "length"))
    assert field is not None and unit_of(field) == "m" and kind is not None
    assert field_at(("wrist", "nothing")) == (None, None) and field_at(())[1] is None
    row, rows = field_at(("hw-run", "controllers", 0))
    assert {"controller", "gains"} <= set(keys_of(row)) and rows is field_at(("hw-run", "controllers"))[1]
