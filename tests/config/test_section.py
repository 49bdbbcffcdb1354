"""Sections that entries of a table add to."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from wristctl.config.hw_run import CalibrateWristSettings, HwRunSettings
from wristctl.config.loop import Reference

VALUES = st.dictionaries(st.sampled_from(["end_frequency", "offset_deg", "duration"]), st.floats(0.1, 5.0))


@given(VALUES, VALUES)
def test_sections_that_are_equal_hash_alike_and_what_is_added_tells_others_apart(
    one: dict[str, float], other: dict[str, float]
) -> None:
    first, turned, second = (
        Reference.model_validate({"kind": "chirp", **values}) for values in (one, dict(reversed(one.items())), other)
    )
    assert first == turned and hash(first) == hash(turned) == hash(first.model_copy())
    assert (hash(first) == hash(second)) == (first == second)


@pytest.mark.parametrize("kind", [HwRunSettings, CalibrateWristSettings])
def test_a_rig_keeps_motors_and_camera_where_a_study_gives_one_key_of_theirs(
    kind: type[HwRunSettings | CalibrateWristSettings],
) -> None:
    rig = kind.model_validate({"actuator": {"pulley_radius": 0.01}, "sensor": {"frame_rate": 30.0}})
    assert (rig.actuator.level, rig.actuator.pulley_radius) == ("tendon", 0.01)
    assert (rig.sensor.level, rig.sensor.frame_rate) == ("camera", 30.0)
    with pytest.raises(ValueError, match="tendon"):
        kind.model_validate({"actuator": {"level": "ideal"}})


def test_an_unknown_key_is_told_with_all_that_there_are_in_one_order() -> None:
    """Of the section and of what its kind adds, in an order that no process changes."""
    with pytest.raises(ValidationError) as raised:
        Reference.model_validate({"kind": "chirp", "frequencie": 1.0})
    known = raised.value.errors()[0]["ctx"]["known"]
    assert known == sorted(known) and {"kind", "duration", "end_frequency"} <= set(known)
