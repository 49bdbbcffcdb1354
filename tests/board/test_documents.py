"""The documents say what the message table and the pins say."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from wristctl.board.dictionary import load
from wristctl.config.bench import FAULTS
from wristctl.vision.marker import MEANING
from wristctl.wrist.directions import ACTIVE

DOCUMENTS = Path(__file__).parents[2] / "docs" / "hardware"
FIRMWARE = Path(__file__).parents[2] / "wristctl" / "board" / "firmware"
TABLE = load()


@pytest.mark.parametrize("group", ["faults", "results", "states"])
def test_each_fault_refusal_and_state_is_explained_in_the_tables_words(group: str) -> None:
    text = (DOCUMENTS / "faults.md").read_text()
    for name, entry in TABLE[group].items():
        if name == "OK":
            continue
        words = [name, entry["meaning"], *([entry["fix"]] if "fix" in entry else [])]
        assert "| " + " | ".join(words) + " |" in text


def test_every_fault_that_can_be_injected_is_explained_in_the_schemas_words() -> None:
    text = (DOCUMENTS / "emulated-bench.md").read_text()
    for kind, meaning in FAULTS.items():
        assert f"| {kind} | {meaning} |" in text


def test_each_verdict_on_a_frame_is_explained_in_the_trackers_words() -> None:
    text = (DOCUMENTS / "camera.md").read_text()
    for verdict, meaning in MEANING.items():
        assert f"| {verdict} | {meaning} |" in text


def test_wiring_names_the_pins_the_firmware_uses() -> None:
    text, pins = (DOCUMENTS / "wiring.md").read_text(), (FIRMWARE / "pins.h").read_text()
    for port, first in (("A", 22), ("C", 37), ("L", 49)):
        for bit in range(8 if port == "A" else 4):
            digital = first + bit if port == "A" else first - bit
            assert f"D{digital} (P{port}{bit})" in text
            assert re.search(rf"P{port}{bit}\b", pins) and re.search(rf"\bD{digital}\b", pins)
    assert "D41 (PG0)" in text and "D13 (PB7)" in text


def test_load_cells_are_wired_to_the_pins_the_firmware_reads() -> None:
    text, pins = (DOCUMENTS / "load-cells.md").read_text(), (FIRMWARE / "pins.h").read_text()
    for axis, tendon in enumerate(ACTIVE):
        data, clock = 2 * axis, 2 * axis + 1
        assert f"| {tendon} | {axis} | A{data} (PF{data}) | A{clock} (PF{clock}) |" in text
        assert all(re.search(rf"\b(P?)[FA]{bit}\b", pins) for bit in (data, clock))
    assert "LOAD_DATA_BIT(axis) (1 << (2 * (axis)))" in pins and "LOAD_CLOCK_BIT(axis) (2 << (2 * (axis)))" in pins
