"""A trial on a robot of one's own and its simulation, its tips, and its identified wrist."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from tests.doors.conftest import wristctl
from tests.doors.test_own_rig import written
from wristctl.commands.adoption import adopted
from wristctl.commands.identified_wrist import _on_its_rig
from wristctl.config.hw_run import HwRunSettings, RigRow
from wristctl.config.loop import Reference
from wristctl.config.plant import Actuator
from wristctl.config.study import Study
from wristctl.config.wrist import TendonPlace, WristParameters
from wristctl.errors import UserError
from wristctl.records import Run
from wristctl.rig import Drive, Facts, Limits, Look, Sensor, Spread, Tendon, VirtualClock
from wristctl.simulation.planes import motion_in
from wristctl.trial.guarded_rig import GuardedRig, RigStop
from wristctl.trial.log import TrialLog
from wristctl.trial.rig_drive import RigTracking
from wristctl.trial.rig_settings import settings_of
from wristctl.wrist.kinematics import AnglePath, TipPath

THREE = [Tendon(angle, 0.02) for angle in (0.0, 120.0, 240.0)]


def facts_with(drive: Drive) -> Facts:
    return Facts(planes=2, tendons=THREE, limits=Limits(0.02, 0.1, 50.0), sensor=Sensor(100.0, 0.02, 0.1), drive=drive)


@pytest.mark.parametrize("resolution", [0.0, 5e-5])
def test_motors_are_simulated_as_the_facts_say_and_keys_of_a_study_go_before(resolution: float) -> None:
    drive = Drive(delay=0.012, lag=Spread(0.03, 0.02, 0.04), resolution=resolution, stiffness=15e3)
    motors = settings_of(facts_with(drive), HwRunSettings(), "a.py:RIG").actuator
    assert (motors.level, motors.command_delay, motors.lag) == ("servo", 0.012, 0.03)
    assert (motors.resolution, motors.tendon_stiffness) == (resolution, 15e3)
    assert motors.step_rate * motors.step_length == pytest.approx(0.1)
    given = HwRunSettings.model_validate({"actuator": {"friction": 0.02, "lag": 0.0}})
    motors = settings_of(facts_with(drive), given, "a.py:RIG").actuator
    assert (motors.level, motors.friction, motors.lag, motors.command_delay) == ("servo", 0.02, 0.0, 0.012)
    again = settings_of(facts_with(drive), HwRunSettings(actuator=motors), "a.py:RIG").actuator
    assert again == motors


def test_the_board_has_no_motors_that_follow_targets() -> None:
    study = Study(hw_run=HwRunSettings(actuator=Actuator(level="servo")))
    with pytest.raises(UserError, match="leads its motors by rates"):
        adopted(study, "hw-run")


def rmse(run: Run) -> tuple[float, float]:
    """Of a trial and of its simulation [deg]."""
    table = json.loads((run.path / "tables.json").read_text())[0]
    row = dict(zip(table["columns"], table["rows"][0], strict=True))
    return math.degrees(row["RMSE [rad]"]), math.degrees(row["simulated RMSE [rad]"])


@pytest.mark.slow
def test_the_simulation_beside_a_trial_predicts_it_also_where_motors_and_sensor_are_late(tmp_path: Path) -> None:
    errors = {}
    for name, delay in {"prompt": "0.01", "late": "0.025"}.items():
        reference = written(tmp_path, ("1e-3, 0.01  #", f"1e-3, {delay}  #"), name=f"{name}.py")
        done = wristctl(
            tmp_path,
            "hw-run",
            "pid-ff",
            "--rig",
            reference,
            "--set",
            "directions=[ulnar]",
            "--horizon",
            "2",
            "--set",
            "hw-run.actuator.friction=0",
        )
        assert done.returncode == 0, done.stderr
        errors[name] = rmse(Run(tmp_path / done.stdout.strip().splitlines()[-1]))
    for measured, simulated in errors.values():  # of a few hundredths of a degree: its wrist is one hinge, no arcs
        assert 0.5 < measured / simulated < 2.0


class Tipped:
    """A rig that sees its tip."""

    facts = facts_with(Drive())

    def __init__(self, tip: Any) -> None:
        self.clock, self.tip = VirtualClock(lambda begin, end: None), tip

    def look(self) -> Look:
        return Look([0.1, -0.2], self.clock.now() + 1e-6, None, None, self.tip)


def test_the_looks_of_a_tip_are_rows_and_those_without_one_are_none(tmp_path: Path) -> None:
    rig: Any = Tipped([0.19, 0.01, -0.02])
    log = TrialLog(tmp_path, None, 0.01, planes=2, tendons=(1, 2, 3), wired=False)
    tracking = RigTracking(GuardedRig(rig, "a.py:RIG"))
    tracking.zero = (0.03, 0.0)
    for tip in ([0.19, 0.01, -0.02], None, [0.18, math.nan, 0.0], [0.17, 0.02, 0.03]):
        rig.tip = tip
        for sighting in tracking.look():
            log.frame(0, 0.0, 0.0, sighting, None)
        rig.clock.wait_until(rig.clock.now() + 0.01)
    log.close()
    looks = pd.read_csv(tmp_path / "looks.csv")
    names = ["tip_x", "tip_y", "tip_z", "bend_ulnar", "bend_flexion"]
    assert looks[names].to_numpy() == pytest.approx(
        np.array([[0.19, 0.01, -0.02, 0.07, -0.2], [0.17, 0.02, 0.03, 0.07, -0.2]])
    )


@pytest.mark.parametrize("tip", [[0.1, 0.0], "nowhere", [0.0, 0.0, 0.0, 0.0]])
def test_a_tip_of_another_shape_is_refused(tip: Any) -> None:
    rig: Any = Tipped(tip)
    with pytest.raises(RigStop, match="not 3 numbers"):
        GuardedRig(rig, "a.py:RIG").look()


def halved(path: TipPath) -> AnglePath:
    """An inverse that no arc has: bends are 20 rad/m of the tip's way aside, and half as much toward flexion."""
    theta, rate, acceleration = (
        20.0 * rows[:, 1:] * np.array([1.0, 0.5]) for rows in (path.position, path.velocity, path.acceleration)
    )
    return AnglePath(theta, rate, acceleration, np.asarray(path.position[:, 0] < 0.05))


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_recorded_tips_go_through_a_network_as_they_are_where_no_arc_ends(tmp_path: Path, side: float) -> None:
    time = np.linspace(0.0, 2.0, 101)
    tips = np.column_stack([0.06 + 0.0 * time, side * 0.01 * np.sin(time), -side * 0.02 * np.sin(time)])
    names = ["time [s]", "tip_x [m]", "tip_y [m]", "tip_z [m]"]
    file = tmp_path / "tips.csv"
    pd.DataFrame(np.column_stack([time, tips]), columns=names).to_csv(file, index=False)
    given: dict[str, Any] = {"kind": "recording", "file": str(file), "column": "tip"}
    wrist = WristParameters()
    with pytest.raises(UserError, match="tip"):  # of a wrist that is 80 mm long
        motion_in(2, Reference(**given), None, wrist, 2.0, 0.01)
    found = motion_in(2, Reference(**given, inverse="network"), None, wrist, 2.0, 0.01, halved)
    at = 0.01 * np.arange(200)
    assert found.bend_ref[:, 0] == pytest.approx(side * 0.2 * np.sin(at), abs=1e-6)
    assert found.bend_ref[:, 1] == pytest.approx(-side * 0.2 * np.sin(at), abs=1e-6)
    assert np.asarray(found.rate_ref)[:, 0] == pytest.approx(side * 0.2 * np.cos(at), abs=1e-4)
    assert found.tip_desired[:, 0] == pytest.approx(0.06) and found.outside == 0.0
    with pytest.raises(UserError, match="as they are"):
        motion_in(2, Reference(**given, inverse="network", scale=0.5), None, wrist, 2.0, 0.01, halved)


def test_an_identified_wrist_keeps_the_motors_and_the_sensor_of_its_rig(tmp_path: Path) -> None:
    reference = written(tmp_path)
    settings = HwRunSettings(rig=reference, rows=(RigRow(controller="pid-ff"),))
    study = adopted(Study(hw_run=settings), "hw-run").study
    places = tuple(TendonPlace(angle_deg=angle, radius=0.017) for angle in (2.0, 121.0, 239.0))
    motors = study.hw_run.actuator.model_copy(update={"tendon_stiffness": 9e3, "command_delay": 0.05})
    sensor = study.hw_run.sensor.model_copy(update={"delay_frames": 0.4})
    found = study.model_copy(
        update={
            "wrist": study.wrist.model_copy(update={"tendons": places}),
            "hw_run": study.hw_run.model_copy(update={"actuator": motors, "sensor": sensor}),
        }
    )
    on_rig = _on_its_rig(study, found)
    assert on_rig.wrist.tendons == places and on_rig.hw_run.sensor == study.hw_run.sensor
    assert on_rig.hw_run.actuator.tendon_stiffness == 9e3
    assert on_rig.hw_run.actuator.command_delay == study.hw_run.actuator.command_delay
    fewer = found.model_copy(update={"wrist": study.wrist.model_copy(update={"tendons": "four"})})
    with pytest.raises(UserError, match="4 tendons were identified, and the rig has 3"):
        _on_its_rig(study, fewer)
