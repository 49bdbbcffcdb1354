"""What `wristctl hw check --rig` says of known facts, to people and as JSON."""

from __future__ import annotations

import json
import math
import re
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tests.cli.conftest import Call
from tests.cli.test_hw_check_two_planes import Clock, StandingBoard
from wristctl.board.check import Adapter, RoundTrips
from wristctl.trial.rig_facts import AxisDirection, CameraFacts, RigFacts, Trouble
from wristctl.trial.rig_strokes import Latency
from wristctl.vision.camera_pose import CameraPose
from wristctl.vision.detector import PictureQuality

ODD, GRAVE = Trouble(False, "an odd thing", "look at it"), Trouble(True, "a grave thing", "mend it")
VIEW: Any = SimpleNamespace(camera_matrix=np.eye(3), plane=np.eye(3), size=(640, 480))
CHECK = ("hw", "check", "--rig", "--port", "/dev/x")


def camera(name: str, pictures: int = 100, **known: Any) -> CameraFacts:
    """57.3 pictures per second, uneven by 2.1 ms and 31 ms old by their stamps."""
    pace: Any = SimpleNamespace(
        name=name, rate=57.3, jitter=2.1e-3, latency=31e-3, verdicts={"ok": pictures} if pictures else {}
    )
    nothing: dict[str, Any] = {"quality": None, "noise": math.nan, "latency": None}
    return CameraFacts(pace, **{**nothing, **known})


KNOWN = camera(
    "camera 1",
    quality=PictureQuality(44.0, 1.25, 21.0, 203.0),
    noise=math.radians(0.023),
    latency=Latency(4.2e-3, 0.6e-3, 60.0, 1e-3, 200),
    pose=CameraPose(math.radians(3.0), math.radians(-4.0), 0.0, 1e-3, VIEW),
)
BLIND = camera("camera 2", 0)


@pytest.fixture
def rig(monkeypatch: pytest.MonkeyPatch) -> SimpleNamespace:
    """What the next check finds: `cameras`, `direction`, `troubles`; `asked` are the axes that were to move."""
    found = SimpleNamespace(cameras=(KNOWN,), direction=None, troubles=[], asked=[], clock=Clock())

    def measure(
        testbed: Any, board: Any, pictures: Any, settings: Any, wrist: Any, axis: Any, advance: Any
    ) -> RigFacts:
        found.asked.append(axis)
        trips, adapter = RoundTrips("STATUS", 100, 3.25e-3, 5.5e-3, 7e-3), Adapter("FTDI", 16e-3)
        return RigFacts(trips, adapter, np.linspace(0.0, 2e-3, 101), found.cameras, found.direction)

    testbed = SimpleNamespace(transport=found.clock, close=lambda: None)
    monkeypatch.setattr("wristctl.trial.testbeds.open_testbed", lambda *_: testbed)
    monkeypatch.setattr("wristctl.board.driver.Board", StandingBoard)
    monkeypatch.setattr("wristctl.trial.rig_facts.measure", measure)
    monkeypatch.setattr("wristctl.trial.rig_facts.troubles", lambda *_: found.troubles)
    return found


@pytest.mark.parametrize(
    ("troubles", "code", "can", "better"),
    [([], 0, "can", False), ([ODD], 0, "can", True), ([GRAVE], 3, "cannot", False), ([ODD, GRAVE], 3, "cannot", False)],
)
def test_one_grave_trouble_among_others_is_enough_to_stop_a_rig(
    call: Call, rig: SimpleNamespace, troubles: list[Trouble], code: int, can: str, better: bool
) -> None:
    rig.troubles = troubles
    ended, out, _ = call(*CHECK, "--yes")
    first, *others = out.split("\n\n")[0].splitlines()
    assert ended == code and f" {can} run the loop of 10 ms" in first and ("better" in first) == better
    assert others == [line for each in troubles for line in (f"- {each.what}", f"  {each.fix}")]
    ended, out, _ = call(*CHECK, "--yes", "--json")
    told = json.loads(out)
    assert ended == code and told["fit"] == (can == "can")
    assert [(each["grave"], each["what"], each["fix"]) for each in told["troubles"]] == troubles


@pytest.mark.parametrize(("typed", "axis"), [("yes", 3), ("no", None), ("", None), ("y", None)])
def test_the_named_axis_moves_after_a_typed_yes_alone(
    call: Call, rig: SimpleNamespace, monkeypatch: pytest.MonkeyPatch, typed: str, axis: int | None
) -> None:
    monkeypatch.setattr("wristctl.cli.hw_check.typed_line", lambda meanwhile: typed)
    _, out, err = call(*CHECK, "--axis", "3")
    assert rig.asked == [axis] and "axis 3" in err and "Type yes" in err and "Type yes" not in out


def cells_of(out: str, what: str) -> list[str]:
    (row,) = [line for line in out.splitlines() if line.startswith(what)]
    return re.split(r" {2,}", row.strip())[1:]


def test_times_are_told_in_milliseconds_and_angles_in_degrees(call: Call, rig: SimpleNamespace) -> None:
    """The age in all is by stamps and beyond them; what is uncertain is twice its standard deviation."""
    _, out, _ = call(*CHECK, "--yes")
    told = {
        "round trip of STATUS": "3.25 ms, p99 5.50 ms",
        "computer wakes late by": "1.00 ms, p99 1.98 ms",
        "pictures": "57.3 per second, uneven by 2.1 ms",
        "their age, by their stamps": "31.0 ms",
        "their age beyond that": "4.2 ms (+- 1.2 ms)",
        "their age in all": "35.2 ms",
        "tip's marker": "44 px, blurred by 1.2 px",
        "grey of its print": "21 to 203 of 255",
        "scatter of the resting": "0.023 deg",
        "camera off square": "5.0 deg (tilt +3.0, pan -4.0)",
    }
    assert {what: cells_of(out, what) for what in told} == {what: [text] for what, text in told.items()}
    assert "16 ms" in cells_of(out, "USB adapter")[0]


def test_json_is_in_seconds_and_radians(call: Call, rig: SimpleNamespace) -> None:
    told = json.loads(call(*CHECK, "--yes", "--json")[1])
    (seen,) = told["cameras"]
    assert told["round_trip"]["median"] == 3.25e-3 and told["adapter"]["every"] == 16e-3 and told["direction"] is None
    assert told["woken_late"] == pytest.approx({"median": 1e-3, "p99": 1.98e-3})
    assert seen["pictures"] == {"rate": 57.3, "jitter": 2.1e-3, "stamped_age": 31e-3}
    assert seen["latency"]["delay"] == 4.2e-3 and seen["marker"]["white"] == 203.0
    assert seen["noise"] == pytest.approx(math.radians(0.023)) and seen["pose"]["pan"] == pytest.approx(
        math.radians(-4)
    )


def test_two_cameras_stand_beside_each_other_and_what_one_lacks_is_said_of_it_alone(
    call: Call, rig: SimpleNamespace
) -> None:
    rig.cameras, rig.direction = (KNOWN, BLIND), AxisDirection(1, math.radians(-226.0), math.radians(135.0), None)
    _, out, _ = call(*CHECK, "--set", "planes=2", "--yes")
    assert "in two planes" in out.splitlines()[0]
    assert cells_of(out, "axis 1 bends the wrist toward") == ["134 deg, its tendon toward 135 deg"]
    assert cells_of(out.partition("Cameras")[2], "what ") == ["camera 1", "camera 2"]
    assert cells_of(out, "pictures")[1] == "none" and cells_of(out, "their age in all") == ["35.2 ms", "not measured"]
    assert cells_of(out, "tip's marker")[1] == cells_of(out, "grey of its print")[1] == "not seen"
    assert cells_of(out, "scatter of the resting")[1] == cells_of(out, "camera off square")[1] == "not seen"
