"""`wristctl hw check --rig` on the emulated rig, and trials on rigs that it would have refused."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import pytest

from tests.cli.conftest import Call
from wristctl.bench.virtual_bench import VirtualBench
from wristctl.records import list_runs
from wristctl.trial import rig_facts, rig_strokes, testbeds

SLOW_CAMERA = (
    "--set",
    "bench.camera.frame_rate=15",
    "--set",
    "bench.camera.delay_frames=0.9",
    "--set",
    "bench.camera.dropped=0",
)
TRIAL = (
    "hw-run", "--set", "directions=[ulnar]", "--set", "push.force=0", "--set", "horizon=3.0", "--set",
    "bench.motors.slack=[0, 0, 0, 0]", "--set", "bench.person.takes=0", "--set", "homing.frames=1",
    "--set", "homing.rest=0.05",
)  # fmt: skip


def _milliseconds(out: str, name: str) -> float:
    found = re.search(rf"{name} +(-?[\d.]+) ms", out)
    assert found, out
    return float(found[1])


@pytest.mark.slow
def test_a_rig_is_measured_and_each_trouble_named_answer_first(call: Call, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(rig_strokes, "COUNT", 8)
    monkeypatch.setattr(rig_strokes, "MOST", 8)
    odd = ("--set", "bench.line.adapter=ftdi", "--set", "control_period=0.008")
    command = ("hw", "check", "--rig", "--port", "emulated", "--yes", *SLOW_CAMERA, *odd)
    code, out, err = call(*command)
    assert code == 3, err
    lines = out.splitlines()
    assert lines[0] == "This rig cannot run the loop of 8 ms."
    told = " ".join(lines[1 : lines.index("")])
    assert "the board's answers take 16." in told and "15 pictures/s; the loop's observer counts on 60" in told
    assert "beyond safety.stale (150 ms)" in told and "older than their time stamps" not in told
    by_stamps, hidden = (_milliseconds(out, name) for name in ("by their stamps", "by strokes"))
    assert 60.0 <= by_stamps <= 62.1, "pictures are looked for every 2 ms"
    assert abs(hidden) < 2.0


@pytest.mark.slow
def test_nothing_moves_without_a_yes_and_the_rest_is_measured(call: Call, monkeypatch: pytest.MonkeyPatch) -> None:
    moved: list[Any] = []
    monkeypatch.setattr(rig_facts, "RigStrokes", lambda *given: moved.append(given))
    monkeypatch.setattr("wristctl.cli.hw_check.typed_line", lambda meanwhile: "no")
    code, out, err = call("hw", "check", "--rig", "--port", "emulated", "--json")
    found = json.loads(out)
    assert code == 0 and not moved and found["fit"] and found["direction"] is None
    (camera,) = found["cameras"]
    assert camera["latency"] is None
    assert camera["pictures"]["rate"] == pytest.approx(57.0, abs=3.0)  # of 60, one in twenty is lost
    assert found["round_trip"]["median"] == pytest.approx(5.5e-3, abs=2e-3)
    assert camera["marker"]["side"] == pytest.approx(44.0, abs=1.0)
    assert "Type yes" in err


@pytest.mark.slow
def test_a_camera_too_slow_for_the_limits_is_refused_before_anything_moves(
    call: Call, monkeypatch: pytest.MonkeyPatch
) -> None:
    benches: list[Any] = []

    class Kept(VirtualBench):
        def __init__(self, *given: Any) -> None:
            super().__init__(*given)
            benches.append(self)

    monkeypatch.setattr(testbeds, "VirtualBench", Kept)
    code, _, err = call(*TRIAL, "--set", "bench.camera.frame_rate=15")
    assert code == 4 and "pictures/s" in err and "beyond safety.stale" in err and "device.fourcc" in err
    assert benches[0].motion().steps == (0, 0, 0, 0) and not any(benches[0].motion().energised)


@pytest.mark.slow
def test_a_link_that_is_slower_than_its_limit_is_a_stop_that_names_it(call: Call) -> None:
    code, _, err = call(*TRIAL, "--set", "bench.line.adapter=ftdi", "--set", "safety.round_trip=0.8")
    assert code == 5 and "the board's answers take" in err and "latency timer" in err
    (run,) = list_runs(Path("results"))
    assert run.state == "failed"


@pytest.mark.parametrize("more", [(), ("--set", "port=/dev/ttyACM0")])
@pytest.mark.parametrize(
    "given", [("device.delay=0.016",), ("device.delay=0",), ("device.delay=0.016", "device.width=640")]
)
def test_what_an_emulated_rig_does_not_read_of_a_camera_is_named(
    call: Call, given: tuple[str, ...], more: tuple[str, ...]
) -> None:
    _, out, err = call("hw-run", "--dry-run", *(part for one in given for part in ("--set", one)), *more)
    said = " ".join((out + err).split())
    for one in given:
        key, value = one.split("=")
        assert (f"{key}," in said.replace(" and ", ",")) == (not more and value != "0")
    assert ("bench.camera.delay_frames" in said) == (not more and given != ("device.delay=0",))


@pytest.mark.slow
@pytest.mark.parametrize("size", [0.016, 0.008])
def test_an_age_that_stamps_do_not_tell_is_found_and_a_device_setting_is_none_of_an_emulated_rig(
    call: Call, monkeypatch: pytest.MonkeyPatch, size: float
) -> None:
    monkeypatch.setattr(rig_strokes, "COUNT", 8)
    late = f"bench.faults=[{{kind: stamps-shifted, at: 0, since: power-on, size: {size}}}]"
    _, out, err = call(
        "hw", "check", "--rig", "--port", "emulated", "--yes", "--set", late, "--set", "device.delay=0.016"
    )
    assert _milliseconds(out, "their age beyond that, by strokes") == pytest.approx(1e3 * size, abs=2.0)
    assert "device.delay" in err and "bench.camera.delay_frames" in err
