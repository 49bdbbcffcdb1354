"""A preset is quiet where it says so; docs/margins.py tries all of it."""

from __future__ import annotations

import dataclasses
import logging
import math
import re
from pathlib import Path
from types import ModuleType

import pytest

from tests.commands.test_compare_answer import stands
from tests.documented import script_of_docs
from wristctl.cli.operator import TerminalOperator
from wristctl.cli.progress import Terminal
from wristctl.commands.hw_run.command import hw_run
from wristctl.commands.inputs import Inputs
from wristctl.commands.loop_warnings import outside_conditions, warn_of_lost, warn_outside_conditions
from wristctl.commands.progress import watched
from wristctl.commands.results import Findings
from wristctl.commands.session import Session, Unattended
from wristctl.config.choices import CONTROLLERS
from wristctl.config.controller_row import Row
from wristctl.config.foreign import Foreign
from wristctl.config.loop import Loop
from wristctl.control.law import Conditions
from wristctl.control.table import controller
from wristctl.errors import UserError
from wristctl.simulation.closed_loop import simulate
from wristctl.simulation.oscillation import LIMIT_CYCLE, chatter, oscillation
from wristctl.study_files.load import load_study

PAPERS = ("smc", "pid", "pid-angle")
STATED = [(name, preset) for name in CONTROLLERS for preset in controller(name).conditions]


def test_what_a_preset_states_is_what_was_tried_for_the_page_of_margins() -> None:
    page = Path(__file__).parents[2] / "docs" / "margins.md"
    rows = re.findall(r"^\| ([\w-]+/\w+) \| ([^|]+) \|", page.read_text(encoding="utf-8"), re.MULTILINE)
    tried = {name: conditions for name, conditions in rows if conditions != "none"}
    stated = {
        f"{name}/{preset}": "{:g}-{:g} ms, {:g}-{:g} kN/m".format(
            *(1e3 * bound for bound in conditions.period), *(1e-3 * bound for bound in conditions.tendon_stiffness)
        )
        for name in CONTROLLERS
        for preset, conditions in controller(name).conditions.items()
    }
    assert tried == stated and len(rows) > len(tried)


@pytest.fixture(scope="module")
def margins() -> ModuleType:
    """docs/margins.py"""
    return script_of_docs("margins")


@pytest.mark.parametrize(("name", "preset"), STATED)
@pytest.mark.slow
def test_a_preset_does_not_swing_at_the_ends_of_its_conditions(margins: ModuleType, name: str, preset: str) -> None:
    (fast, slow), (soft, _) = controller(name).conditions[preset]
    for period in {fast, 5e-3, slow}:
        assert margins.swing(name, preset, margins.loop_of(period, soft, 0.0)) <= LIMIT_CYCLE
    assert margins.swing(name, preset, margins.loop_of(5e-3, 40e3, 3.0)) <= LIMIT_CYCLE


@pytest.mark.parametrize("name", [each for each in CONTROLLERS if each not in PAPERS])
def test_each_of_our_laws_has_a_preset_for_motors_and_a_camera(name: str) -> None:
    assert any(
        fast <= 5e-3 <= slow and soft <= 20e3 and stiff >= 40e3
        for (fast, slow), (soft, stiff) in controller(name).conditions.values()
    )


def test_a_preset_without_conditions_swings_there(margins: ModuleType) -> None:
    """The check can come out the other way."""
    assert margins.swing("super-twisting", "default", margins.loop_of(5e-3, 20e3, 1.0)) > LIMIT_CYCLE


@pytest.mark.parametrize(
    ("row", "loop", "told"),
    [
        (("mrac", "hardware"), {"control_period": 5e-3}, None),
        (("mrac", "hardware"), {"control_period": 1e-3}, "made for periods of 5 to 10 ms, not 1"),
        (("nc", "default"), {"control_period": 5e-3, "stiffness": 1e4}, "tendons of 40 to 100 kN/m, not 10"),
        (("smc-tracking", "default"), {}, "not made for elastic tendons behind a camera"),
        (("smc-tracking", "default"), {"sensor": "ideal"}, None),
    ],
)
def test_a_command_warns_outside_them(
    caplog: pytest.LogCaptureFixture, row: tuple[str, str], loop: dict[str, float | str], told: str | None
) -> None:
    given = Loop.model_validate(
        {
            "control_period": loop.get("control_period", 1e-3),
            "actuator": {"level": "tendon", "tendon_stiffness": loop.get("stiffness", 20e3)},
            "sensor": {"level": loop.get("sensor", "camera")},
        }
    )
    with caplog.at_level(logging.WARNING, logger="wristctl"):
        warn_outside_conditions([Row(controller=row[0], gains=row[1])], [given])
    assert caplog.messages == [] if told is None else told in " ".join(caplog.messages)


def test_a_controller_of_ones_own_that_states_nothing_is_untried(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """A comparison tries it: it warns of what is not made for a rig, and was lost there, alone."""
    own = dataclasses.replace(controller("pid"), name="own", presets={"hardware": controller("pid").presets["printed"]})
    monkeypatch.setitem(CONTROLLERS._entries, "own", own)
    monkeypatch.setitem(CONTROLLERS._origins, "own", Foreign(tmp_path / "own.py", "OWN", {}, tmp_path))
    loop = Loop.model_validate({"actuator": {"level": "tendon"}, "sensor": {"level": "camera"}})
    rows = [Row(controller=name, gains=gains) for name, gains in (("own", "hardware"), ("smc-tracking", "default"))]
    untried = "own/hardware is untried with elastic tendons behind a camera: it may swing"
    assert outside_conditions(rows[:1], [loop]) == [untried]
    errors = {row.label: 1e-3 for row in rows}
    on_ideal = stands(rmse=errors, swings=tuple(errors))
    with caplog.at_level(logging.WARNING, logger="wristctl"):
        warn_of_lost(rows, [loop], [stands("camera and tendons", errors), on_ideal])
        assert caplog.messages == [], "both held there"
        warn_of_lost(rows, [loop], [stands("camera and tendons", errors, swings=tuple(errors)), on_ideal])
    assert len(caplog.messages) == 1 and "smc-tracking/default is not made for" in caplog.messages[0]


def test_real_motors_do_not_move_by_gains_that_may_swing_unless_told_to(capsys: pytest.CaptureFixture[str]) -> None:
    study = load_study([], ["hw-run.port=/dev/null", "hw-run.controllers=[{controller: smc-tracking, gains: default}]"])
    for operator in (Unattended(), TerminalOperator(Terminal(), True, frozenset({"yes"}))):
        with pytest.raises(UserError, match="not made for elastic tendons behind a camera") as refused:
            hw_run(Session(study, Inputs(), Findings(study.seed, None), watched(None), operator))
        assert refused.value.exit_code == 3
    TerminalOperator(Terminal(stderr=True), True, frozenset({"force"})).dare("it may swing", "a", "b")
    assert "it may swing" in capsys.readouterr().err


def test_conditions_of_no_preset_are_refused() -> None:
    with pytest.raises(ValueError, match="no such preset"):
        dataclasses.replace(controller("nc"), conditions={"other": Conditions((1e-3, 1e-2), (1e3, 1e4))})


@pytest.mark.parametrize("name", [name for name in CONTROLLERS if "hardware" in controller(name).presets])
def test_hardware_gains_bring_an_ideal_wrist_to_its_angle_too(name: str) -> None:
    """A loop that begins without motors may be given them: the gains for those are no worse for it."""
    study = load_study([], [f"simulate.controller={name}", "simulate.gains=hardware"])
    assert study.simulate.loop.actuator.level == "ideal"
    done = simulate(study)
    course = done.first.trajectory
    assert not done.failed.any() and abs(course.error[-1]) < math.radians(0.05)
    assert (
        oscillation(course) < LIMIT_CYCLE and not chatter(done.metrics["chattering"], study.wrist.tension_range).any()
    )
