"""The documents say what the message table and the pins say."""

from __future__ import annotations

import math
import re
from pathlib import Path

import pytest

from wristctl.board.dictionary import load
from wristctl.config.bench import FAULTS, Motors
from wristctl.config.hw_run import HwRunSettings
from wristctl.config.wrist import WristParameters
from wristctl.vision.detector import print_of
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


def test_the_cables_to_buy_are_those_of_the_firmwares_pins() -> None:
    text, pins = (DOCUMENTS / "bill-of-materials.md").read_text(), (FIRMWARE / "pins.h").read_text()
    step, direction, enable, alarm = (
        re.findall(r"\bD\d+", line)
        for line in (re.search(rf"{name} .*Mega (.*)", pins)[1] for name in ("STEP", "DIR", "ENA", "ALM"))  # type: ignore[index]
    )
    for axis in range(4):
        ends = ", ".join((step[axis], direction[axis], enable[axis], alarm[axis]))
        assert f"| drive {axis}: PUL+, DIR+, ENA+, ALM+ | {ends} | 4 |" in text
    assert "D41, GND" in text and "D41" in pins


def test_what_parts_must_fulfil_follows_from_the_default_settings() -> None:
    """Figures of the bill of materials, each computed anew from the settings that it is said to follow from."""
    text = (DOCUMENTS / "bill-of-materials.md").read_text()
    settings, wrist, torque = HwRunSettings(), WristParameters(), Motors().holding_torque
    actuator, safety = settings.actuator, settings.safety
    radius, speed = 1e3 * actuator.pulley_radius, actuator.step_rate * actuator.step_length
    pulses = actuator.motor_steps * actuator.microstep
    turns = actuator.step_rate / pulses
    flag = 1e3 * settings.markers.side * len(print_of(0)) / (len(print_of(0)) - 2)
    for part in (
        f"{360.0 / actuator.motor_steps:g} deg ({actuator.motor_steps} steps per turn)",
        f"{pulses} pulses per turn: {actuator.motor_steps} steps x {actuator.microstep}",
        f"{torque:g} N m at the drive's 1.0 A for a pull of {safety.motor_pull:g} N",
        f"{radius:g} mm from its axis to the middle of the tendon",
        f"reel in with {safety.motor_pull:g} N at {speed:.2g} m/s give {2.0 * safety.motor_pull * speed:.0f} W",
        f"The largest step rate, {actuator.step_rate:.0f} steps/s, is {turns:g} turns",
        f"{1e-3 * actuator.tendon_stiffness:g} kN/m as routed: 2 kg hung on it lengthen it by "
        f"{1e3 * 2.0 * 9.81 / actuator.tendon_stiffness:.1f} mm",
        f"several times the {wrist.tension_limit:g} N of `wrist.tension_limit`",
        f"{wrist.discs} discs, the first clamped; {1e3 * wrist.length:g} mm from first to last",
        f"last; {wrist.stiffness:g} N m/rad",
        f"a circle of {1e3 * wrist.tendon_radius:g} mm radius",
        f"{settings.sensor.frame_rate:g} pictures/s at 640 x 480",
        f"lens {settings.markers.distance:g} m from the markers",
        f"black squares of {1e3 * settings.markers.side:g} mm",
        f"flat, stiff, {math.ceil(flag):g} mm square or more",
        f"a loop of {1e3 * settings.control_period:g} ms",
        f"`safety.motor_pull` is {safety.motor_pull:g} N",
    ):
        assert part in text
    assert f"(`actuator.sheath` is {actuator.sheath:g})" in text
    assert safety.motor_pull < wrist.tension_limit and flag < 27.0


@pytest.mark.parametrize(
    ("rated", "current", "peak", "pull"), [(1.26, 2.8, 1.0, 42), (0.59, 2.0, 1.0, 28), (0.59, 2.0, 1.46, 41)]
)
def test_pulls_of_the_example_motors_follow_from_their_data_sheets(
    rated: float, current: float, peak: float, pull: int
) -> None:
    """Both phases at the rated current are a microstep's amplitude of sqrt(2) times that."""
    text = (DOCUMENTS / "bill-of-materials.md").read_text()
    torque = rated * peak / (math.sqrt(2.0) * current)
    assert round(torque / HwRunSettings().actuator.pulley_radius) == pull
    assert f"{rated:g} N m at {current:.1f} A" in text and f"{pull} N" in text


def test_load_cells_are_wired_to_the_pins_the_firmware_reads() -> None:
    text, pins = (DOCUMENTS / "load-cells.md").read_text(), (FIRMWARE / "pins.h").read_text()
    for axis, tendon in enumerate(ACTIVE):
        data, clock = 2 * axis, 2 * axis + 1
        assert f"| {tendon} | {axis} | A{data} (PF{data}) | A{clock} (PF{clock}) |" in text
        assert all(re.search(rf"\b(P?)[FA]{bit}\b", pins) for bit in (data, clock))
    assert "LOAD_DATA_BIT(axis) (1 << (2 * (axis)))" in pins and "LOAD_CLOCK_BIT(axis) (2 << (2 * (axis)))" in pins
