"""Sections that entries of a table add to."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

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
