"""What is wrong with a rig is named, with what to do, and the grave first."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.trial.test_camera_pace import pace
from wristctl.board.check import Adapter, RoundTrips, adapter_of, shorter
from wristctl.board.transport import PortFound
from wristctl.config.hw_run import HwRunSettings
from wristctl.trial.rig_facts import RigFacts, troubles
from wristctl.trial.rig_strokes import Latency
from wristctl.vision.camera_pose import CameraPose
from wristctl.vision.detector import PictureQuality
from wristctl.vision.marker import SightingVerdict
from wristctl.vision.view import View

SETTINGS = HwRunSettings()
SOUND = RigFacts(
    trips=RoundTrips("STATUS", 100, 3.0e-3, 3.4e-3, 4e-3), adapter=Adapter("FTDI", 1e-3), pace=pace(60.0, 0.033),
    quality=PictureQuality(48.0, 1.0, 40.0, 220.0), noise=4e-4, woken=np.full(200, 1e-4),
    latency=Latency(1e-3, 3e-4, 40.0, 5e-4, 200),
)  # fmt: skip


def posed(tilt: float, pan: float = 0.0, misfit: float = 1e-3) -> CameraPose:
    """A camera so many degrees off square."""
    return CameraPose(math.radians(tilt), math.radians(pan), -0.05, misfit, View())


SLOW = RoundTrips("STATUS", 100, 0.016, 0.03, 0.04)


def told(**changes: Any) -> list[tuple[bool, str, str]]:
    return [tuple(each) for each in troubles(SOUND._replace(**changes), SETTINGS, "/dev/ttyUSB0")]  # type: ignore[misc]


def test_a_sound_rig_has_no_troubles() -> None:
    assert told() == [] == told(pose=posed(3.0, -3.0))


@pytest.mark.parametrize(
    ("changes", "grave", "said", "fix"),
    [
        ({"trips": SLOW, "adapter": Adapter("FTDI", 0.016)}, True, "latency timer is 16 ms", "tee"),
        ({"trips": SLOW}, True, "take 16.7 ms of a tick's 10 ms",
         "control_period=0.018"),
        ({"pace": pace(40.0, 0.033)}, False, "gives 40 pictures/s; the loop's observer counts on 60", "device.fourcc"),
        ({"pace": pace(60.0, 0.0, 61, jitter=4e-3)}, False, "unevenly, +-12 ms", "hub"),
        ({"pace": pace(60.0, 0.14)}, True, "beyond safety.stale (150 ms)", "safety.stale of 0.2"),
        ({"latency": Latency(0.06, 3e-4, 40.0, 5e-4, 99)}, False, "60 ms older than their time stamps say",
         "device.delay=0.0600"),
        ({"latency": Latency(0.12, 3e-4, 40.0, 5e-4, 99)}, True, "beyond safety.stale", "safety.stale of 0.2 s"),
        ({"pace": pace(60.0, 0.03, verdict=SightingVerdict.TWICE)}, True, "60 of 60 pictures: twice", "same id"),
        ({"pose": posed(6.0)}, False, "looks 6 deg off square", "--optics"),
        ({"pose": posed(0.0, -16.0)}, True, "looks 16 deg off square", "--optics"),
        ({"pose": posed(0.0, misfit=0.02)}, False, "no squares of one plane (by 2.0 %)", "flat on stiff flags"),
        ({"quality": PictureQuality(28.0, 1.0, 40.0, 220.0)}, False, "28 px wide", "40 px"),
        ({"quality": PictureQuality(48.0, 2.4, 40.0, 220.0)}, False, "blurred by 2.4 px", "focus"),
        ({"quality": PictureQuality(48.0, 1.0, 90.0, 254.0)}, False, "rim is white", "shorter"),
        ({"quality": PictureQuality(48.0, 1.0, 40.0, 80.0)}, False, "print is faint", "light"),
        ({"woken": np.array([1e-4] * 190 + [3e-3] * 10)}, False, "wakes a tick 3.0 ms late", "--priority"),
        ({"woken": np.array([1e-4] * 190 + [0.06] * 10)}, True, "wakes a tick 60.0 ms late", "--priority"),
    ],
)  # fmt: skip
def test_each_trouble_is_named_with_its_way_out(changes: Any, grave: bool, said: str, fix: str) -> None:
    found = told(**changes)
    assert any(said in what and fix in how and grave == is_grave for is_grave, what, how in found), found
    assert [is_grave for is_grave, *_ in found] == sorted((g for g, *_ in found), reverse=True)


def test_the_adapter_is_that_of_the_real_port_behind_a_link_with_its_own_latency(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    system, port, link = tmp_path / "devices", tmp_path / "ttyUSB3", tmp_path / "wrist"
    (system / "ttyUSB3").mkdir(parents=True)
    (system / "ttyUSB3" / "latency_timer").write_text("16\n")
    port.touch()
    link.symlink_to(port)
    assert adapter_of(str(link), system) == Adapter("FTDI", 0.016)
    assert f"{system}/ttyUSB3/latency_timer" in shorter(str(link), system)
    assert adapter_of("/dev/ttyACM0", system) == adapter_of("socket://a:1", system) == Adapter("", None)
    listed = [PortFound("/dev/ttyACM0", "", "", True, "16U2"), PortFound("/dev/ttyUSB4", "", "", True, "CH340")]
    monkeypatch.setattr("wristctl.board.check.ports", lambda: listed)
    assert str(adapter_of("/dev/ttyACM0", system)) == "16U2, hands over every 4.1 ms"
    assert str(adapter_of("/dev/ttyUSB4", system)) == "CH340, hands over every 1 ms"
