"""Gains that a study found, by the name of their family: the numbers, and what speaks against them on a loop."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pandas as pd
import pytest

import wristctl
from tests.documented import DOCS, script_of_docs
from wristctl.commands.loop_warnings import outside_conditions, warn_outside_conditions
from wristctl.commands.study import published
from wristctl.config.controller_row import Row
from wristctl.config.families import Family
from wristctl.config.loop import Loop
from wristctl.control import shipped_gains
from wristctl.control.shipped_gains import PREFIX, families
from wristctl.control.table import CONTROLLERS, controller, gains_of
from wristctl.errors import UserError
from wristctl.simulation import simulated_drives
from wristctl.simulation.simulated_drives import DRIVE

CAMERA = {
    "about": "a rig",
    "conditions": {"period": [5e-3, 5e-3], "tendon_stiffness": [8e3, 3e4]},
    "family_sha256": "",
    "drive": 2,
    "worlds": 40,
    "run": "20260101T000000Z-study-x",
    "controllers": {
        "pd-ff": {"gains": {"Kd": 0.25, "Kp": 3.5}, "rmse": 0.004, "lost": 0, "reliable": True},
        "pid-ff": {"gains": {"Kp": 3.0, "Ki": 1.0, "Kd": 0.2}, "rmse": 0.003, "lost": 9, "reliable": False},
    },
}
RIG = {"control_period": 5e-3, "actuator": {"level": "tendon"}, "sensor": {"level": "camera"}}


@pytest.fixture
def shipped(monkeypatch: pytest.MonkeyPatch) -> None:
    content = {"camera": CAMERA, "ideal": CAMERA | {"conditions": None}}
    monkeypatch.setattr(shipped_gains, "_shipped", lambda: content)


def rig(**actuator: Any) -> Loop:
    return Loop.model_validate(RIG | {"actuator": {"level": "tendon"} | actuator})


@pytest.mark.usefixtures("shipped")
def test_gains_of_a_family_are_its_numbers_in_the_controllers_order() -> None:
    assert gains_of(controller("pd-ff"), "tuned:camera") == (3.5, 0.25)
    by_name, by_value = (
        wristctl.simulate(wristctl.load_study(None, "simulate.controller=pd-ff", f"simulate.gains={gains}"))
        for gains in ("tuned:camera", "{Kp: 3.5, Kd: 0.25}")
    )
    assert (by_name.trajectory.theta == by_value.trajectory.theta).all()


@pytest.mark.usefixtures("shipped")
@pytest.mark.parametrize(
    "name, gains, told",
    [
        ("pd-ff", "tuned:camra", "unknown gains 'tuned:camra'.*did you mean 'tuned:camera'"),
        ("smc", "tuned:camera", "no gains of smc are shipped for 'camera'.*pd-ff, pid-ff"),
        ("pd-ff", "tuned:", "no study of '' is shipped"),
        ("pd-ff", "tunedcamera", "unknown gains 'tunedcamera' of pd-ff.*tuned:camera"),
    ],
)
def test_what_is_not_shipped_is_named_with_what_is(name: str, gains: str, told: str) -> None:
    with pytest.raises(UserError) as raised:
        gains_of(controller(name), gains)
    assert re.search(told, str(raised.value)) and raised.value.exit_code == 2


@pytest.mark.usefixtures("shipped")
def test_they_warn_outside_the_family_and_where_the_study_lost_worlds() -> None:
    def warned(name: str, gains: str, loop: Loop) -> list[str]:
        return outside_conditions([Row(controller=name, gains=gains)], [loop])

    assert warned("pd-ff", "tuned:camera", rig(tendon_stiffness=2e4)) == []
    (soft,) = warned("pd-ff", "tuned:camera", rig(tendon_stiffness=6e3))
    assert "found for tendons of 8 to 30 kN/m, not 6" in soft
    (ideal,) = warned("pd-ff", "tuned:ideal", rig(tendon_stiffness=2e4))
    assert "without elastic tendons" in ideal and warned("pd-ff", "tuned:ideal", Loop()) == []
    (lost,) = warned("pid-ff", "tuned:camera", rig(tendon_stiffness=2e4))
    assert "9 of 40 worlds" in lost and str(CAMERA["run"]) in lost


BRIEF = """
families:
  camera:
    about: {about}
    loop: {{plant_segments: 1, actuator: {{level: {level}}}}}
    draw: {{reference.angle_deg: {angles}}}
"""


@pytest.fixture
def experiments(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[..., Family]]:
    """Makes the experiments that are shipped have another family `camera`, and gives it back."""

    def of(about: str = "a rig", level: str = "tendon", angles: str = "10..20") -> Family:
        file = tmp_path / "scenarios" / "camera.yaml"
        file.parent.mkdir(exist_ok=True)
        file.write_text(BRIEF.format(about=about, level=level, angles=angles))
        monkeypatch.setattr("wristctl.study_files.shipped.shipped", lambda: tmp_path)
        published._shipped_family.cache_clear()
        return wristctl.load_study(file).families["camera"]

    yield of
    published._shipped_family.cache_clear()


def test_gains_are_of_today_until_a_motion_a_world_or_the_drive_changes(
    experiments: Callable[..., Family], monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """Words about a family are none of these, nor is a drive where a family has none."""
    found = experiments()
    monkeypatch.setattr(
        shipped_gains, "_shipped", lambda: {"camera": CAMERA | {"family_sha256": found.settings_hash(), "drive": DRIVE}}
    )
    rows = [Row(controller=name, gains="tuned:camera") for name in ("pd-ff", "pd-ff")]

    def warned() -> list[str]:
        caplog.clear()
        warn_outside_conditions(rows, [rig(tendon_stiffness=2e4)])
        return caplog.messages

    assert warned() == []
    experiments(about="in other words")
    assert warned() == []
    experiments(angles="10..30")
    (family,) = warned()
    assert family.startswith("tuned:camera: the family camera has changed since")
    experiments()
    monkeypatch.setattr(simulated_drives, "DRIVE", DRIVE + 1)
    (drive,) = warned()
    assert "the simulated drive has changed since" in drive and "family" not in drive
    experiments(angles="10..30")
    assert "the family camera and the simulated drive have changed" in warned()[0]
    ideal = experiments(level="ideal")
    assert published.what_changed("camera", ideal.settings_hash(), None) == ""
    assert "shipped no more" in published.what_changed("handling", "", None)


def test_a_family_that_states_its_defaults_is_the_same_family(experiments: Callable[..., Family]) -> None:
    """A run's own settings hold all of them; what is tuned on when it goes on is no other family."""
    family = experiments()
    whole = Family.model_validate_json(family.model_dump_json(by_alias=True))
    assert whole.settings_hash() == family.settings_hash() != experiments(angles="10..30").settings_hash()


def test_the_page_says_of_each_family_whether_it_is_that_of_today(experiments: Callable[..., Family]) -> None:
    content = json.loads(json.dumps(shipped_gains._shipped()["camera"]))
    page, same = script_of_docs("published_gains").page, {"family_sha256": experiments().settings_hash()}
    assert "changed since these gains were found" not in page({"camera": content | same | {"drive": DRIVE}})
    assert "The simulated drive has changed since" in page({"camera": content | same | {"drive": DRIVE - 1}})


def test_what_is_shipped_can_be_run_and_lies_within_the_search_boxes() -> None:
    for family in families():
        for name in shipped_gains._shipped()[family]["controllers"]:
            law = CONTROLLERS[name]
            values = dict(zip(law.gains, gains_of(law, PREFIX + family), strict=True))
            assert all(law.gains[gain].low <= value <= law.gains[gain].high for gain, value in values.items())


def test_the_page_prints_what_is_shipped_with_its_run() -> None:
    text = (DOCS / "gains.md").read_text(encoding="utf-8")
    assert text == script_of_docs("published_gains").page(shipped_gains._shipped())
    for family in families():
        for name in shipped_gains._shipped()[family]["controllers"]:
            assert shipped_gains.shipped_gains(name, PREFIX + family).run in text and f"| {name} |" in text


def test_a_comparison_renews_errors_and_lost_worlds_and_leaves_the_gains(tmp_path: Path) -> None:
    """Of two controllers one is lost in 3 of 50 worlds, which is unreliable; their study stays named."""
    script = script_of_docs("published_gains")
    argv = ["wristctl", "compare", "camera.yaml", "--out", "/elsewhere", "--set", "a=b"]
    (tmp_path / "run.json").write_text(json.dumps({"argv": argv, "result_sha256": "abc"}))
    fates = pd.DataFrame(
        {"row": ["pid-ff/tuned:camera", "feedforward/default", "pd-ff/tuned:camera"], "rmse": [1e-3, 1.0, 2e-3],
         "rmse_low": [5e-4, 1.0, 1e-3], "rmse_high": [2e-3, 1.0, 3e-3], "lost": [0.0, 0.0, 3 / 50],
         "fate": ["ranked", "ranked", "unreliable"]}
    )  # fmt: skip
    worlds = SimpleNamespace(family="camera", draws=50)
    run = SimpleNamespace(
        path=tmp_path, id="20270101T000000Z-compare-x", data=lambda name: fates,
        config=SimpleNamespace(compare=SimpleNamespace(worlds=worlds)),
    )  # fmt: skip
    before = {name: row | {"tunings": [1e-3, 2e-3]} for name, row in CAMERA["controllers"].items()}  # type: ignore[attr-defined]
    content = {"camera": CAMERA | {"controllers": before, "command": "wristctl study", "result_sha256": "def"}}
    renewed = script.with_comparison(content, run)["camera"]
    rows = renewed["controllers"]
    assert renewed["worlds"] == 50 and renewed["run"] == CAMERA["run"] and renewed["compared"]["run"] == run.id
    assert renewed["compared"]["command"] == "wristctl compare camera.yaml --set a=b"
    assert [rows[name]["lost"] for name in ("pd-ff", "pid-ff")] == [3, 0]
    assert [rows[name]["reliable"] for name in ("pd-ff", "pid-ff")] == [False, True]
    assert rows["pd-ff"]["gains"] == before["pd-ff"]["gains"] and rows["pd-ff"]["rmse"] == 2e-3
    page = script.page({"camera": renewed})
    assert f"{math.degrees(1e-3):.3g} [" in page and "abc" in page and "def" in page
