"""YAML says what it seems to say, or is refused with file and line."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from wristctl.errors import UserError
from wristctl.study_files.strict_yaml import parse_yaml


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1e-3", 1e-3),
        ("1e3", 1000.0),
        ("-.5", -0.5),
        ("010", 10),
        ("no", "no"),
        ("on", "on"),
        ("true", True),
        ("12:30", "12:30"),
        ("2026-01-01", "2026-01-01"),
        ("1_000", "1_000"),
        ("'1'", "1"),
        ("~", None),
        ("[1, 2.0, x]", (1, 2.0, "x")),
    ],
)
def test_plain_values_mean_what_they_look_like(text: str, value: object) -> None:
    found = parse_yaml(text, "f").data
    assert found == value
    assert type(found) is type(value)


@given(st.floats())
def test_every_float_reads_back_exactly(value: float) -> None:
    special = {math.inf: ".inf", -math.inf: "-.inf"}
    text = ".nan" if math.isnan(value) else special.get(value, repr(value))
    found = parse_yaml(text, "f").data
    assert found == value or (math.isnan(found) and math.isnan(value))


def test_keys_know_their_lines() -> None:
    document = parse_yaml("a: 1\nb:\n  c:\n  - x\n  - d: 2\n", "f")
    assert document.lines[("b", "c", 1, "d")] == 5
    assert document.lines[("b",)] == 2


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("a: 1\nb: 2\na: 3\n", "key 'a' is repeated - f.yaml:3"),
        ("a: &x 1\nb: *x\n", "aliases are not supported - f.yaml:2"),
        ("a: !!python/object/apply:os.system [ls]\n", "f.yaml:1"),
        ("a: [1\n", "not valid YAML"),
        ("a:\n\t- 1\n", "f.yaml:2"),
        ("a: 1\n---\nb: 2\n", "f.yaml:2"),
        ("? [1, 2]\n: 3\n", "a key must be a word - f.yaml:1"),
        ("[" * 5000, "nested too deeply"),
        ("a: " + "9" * 5000, "too many digits - f.yaml:1"),
        ("a: \x00", "not valid YAML"),
    ],
)
@pytest.mark.slow
def test_doubtful_yaml_is_refused_with_its_line(text: str, said: str) -> None:
    with pytest.raises(UserError) as caught:
        parse_yaml(text, "f.yaml")
    assert said in str(caught.value)


@given(st.binary(max_size=60))
def test_any_bytes_are_read_or_refused_politely(text: bytes) -> None:
    try:
        parse_yaml(text, "f")
    except UserError as error:
        assert "\n" not in str(error)
