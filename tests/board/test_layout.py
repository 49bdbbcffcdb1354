"""How values lie in a message's bytes."""

from __future__ import annotations

import struct
from dataclasses import FrozenInstanceError
from enum import IntEnum
from typing import NamedTuple

import pytest

from wristctl.board.layout import Field, Layout


class Mode(IntEnum):
    OFF = 0
    ON = 3


class Message(NamedTuple):
    mode: Mode
    speed: float
    places: tuple[int, int]


SPEED = Field("speed", "i", 1, 100, "steps/s", -50.0, 50.0, None)
PLACES = Field("places", "h", 2, 1, "steps", None, None, None)
LAYOUT = Layout(Field("mode", "B", 1, 1, "", None, None, Mode), SPEED, PLACES)


def test_a_message_is_little_endian_without_gaps_and_comes_back() -> None:
    payload = LAYOUT.pack(Message(Mode.ON, -12.34, (1, -2)))
    assert payload == struct.pack("<Bihh", 3, -1234, 1, -2) and len(payload) == 9
    back = LAYOUT.unpack(Message, payload)
    assert back == Message(Mode.ON, -12.34, (1, -2)) and isinstance(back.mode, Mode)
    assert isinstance(back.places[0], int)


def test_values_are_rounded_to_whole_counts() -> None:
    assert SPEED.to_wire(0.126) == [13] and SPEED.from_wire((13,)) == 0.13
    half = Field("half", "i", 1, 2, "", None, None, None)
    assert half.to_wire(1.3) == [3] and half.from_wire((3,)) == 1.5


@pytest.mark.parametrize(("speed", "fits"), [(-50.0, True), (50.0, True), (50.01, False), (-50.01, False)])
def test_the_ends_of_a_range_are_in_it(speed: float, fits: bool) -> None:
    if fits:
        assert SPEED.to_wire(speed) == [round(100 * speed)]
    else:
        with pytest.raises(ValueError, match=r"speed = .* steps/s is outside -50\.0 to 50\.0"):
            SPEED.to_wire(speed)


def test_each_of_several_values_is_checked_and_their_number_too() -> None:
    both = Field("both", "h", 2, 1, "steps", 0, 9, None)
    assert both.to_wire((0, 9)) == [0, 9]
    with pytest.raises(ValueError, match="both = 10"):
        both.to_wire((0, 10))
    with pytest.raises(ValueError, match="both needs 2 values, got 3"):
        both.to_wire((0, 1, 2))


def test_a_payload_of_another_length_is_an_error() -> None:
    with pytest.raises(struct.error):
        LAYOUT.unpack(Message, bytes(8))


def test_a_field_cannot_be_changed() -> None:
    with pytest.raises(FrozenInstanceError):
        SPEED.scale = 1  # type: ignore[misc]
