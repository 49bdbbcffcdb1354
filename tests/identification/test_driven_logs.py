"""Logs of tensions and currents: what drives, what is told with a scale and without, and what is refused."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.identification.driven_robots import BELIEVED, counted, plan, summary
from wristctl.arrays import Array
from wristctl.commands.identify.driven import driven_answer
from wristctl.config.identify import IdentifySettings
from wristctl.config.plant import Actuator, TrueWrist
from wristctl.config.study import Study
from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError
from wristctl.identification.arc_fit import fit_arcs
from wristctl.identification.driven_fit import DrivenFit
from wristctl.identification.driven_forward import STEP, _softening, courses_of_pulls, driven_arc
from wristctl.identification.driven_log import _at, drive_of_log, driven_robot
from wristctl.identification.measured_trials import places_of_log
from wristctl.identification.ratios import ratios_of_driven, wrist_by_ratios
from wristctl.records.log_looks import looked_at
from wristctl.records.open_log import OpenLog, read_table
from wristctl.simulation.spool_driven import SpooledWrist, spooled
from wristctl.wrist.statics import straight_stiffness

SETTINGS = IdentifySettings()
STIFFNESS, DAMPING, INERTIA, DELAY = 0.8, 0.12, 2e-3, 0.04
OF_THREE: Array = math.tau / 3.0 * np.arange(3.0) + 0.3


Pulls = Callable[[Array], Array]
"""Tensions (T, M) [N] by times (T,) [s]."""


def waves(count: int, seed: int = 0) -> Pulls:
    """Sums of slow sines, each tendon's its own."""
    rng = np.random.default_rng(seed)
    pace, phase = rng.uniform(0.1, 0.9, (count, 4)), rng.uniform(0.0, math.tau, (count, 4))
    return lambda time: 8.0 + 2.0 * np.sin(math.tau * pace * time[:, None, None] + phase).sum(axis=2)


def antagonists(time: Array) -> Array:
    """Two whose sum stays."""
    one = 4.0 * np.sin(0.9 * time) * np.cos(0.31 * time)
    return 5.0 + np.stack([one, -one], axis=1)


def made(angles: Array, told: Pulls, time: Array, newtons: Array | float = 1.0, noise: float = 1e-3) -> OpenLog:
    """The log of an arc by its own model: currents of so many newtons an ampere, tensions where that is 1."""
    fine = np.arange(0.0, time[-1] + STEP, STEP)
    driven, pulls = told(fine + 0.5 * STEP), told(time)
    places = BELIEVED.tendon_radius * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    values = {"damping": DAMPING, "inertia": INERTIA}
    arc = driven_arc(BELIEVED, values, places, np.full(len(angles), 1.0 / STIFFNESS))
    (course,) = courses_of_pulls([arc], driven)
    seen = np.stack([np.interp(time - DELAY, fine, one) for one in course.T], axis=1)
    rng = np.random.default_rng(1)
    bends = seen[:, :2] + noise * rng.standard_normal((len(time), 2))
    quantity = "tension" if np.all(np.asarray(newtons) == 1.0) else "current"
    columns = {"time": time, "bend_y": bends[:, 0], "bend_z": bends[:, 1], "rate_y": seen[:, 2], "rate_z": seen[:, 3]}
    columns |= {f"{quantity}_{k}": one for k, one in enumerate((pulls / newtons).T, 1)}
    return OpenLog(Path("made.csv"), "log", columns)


def without(log: OpenLog, *names: str) -> OpenLog:
    return replace(log, columns={name: column for name, column in log.columns.items() if name not in names})


TIME = np.arange(0.0, 30.0, 0.04)


def plainly_fitted(log: OpenLog, settings: IdentifySettings = SETTINGS) -> DrivenFit:
    """Without friction and creep, which these logs have not, to be quick."""
    from wristctl.identification.model_choice import TriedModel

    robot, recordings, remarks = driven_robot([log], BELIEVED, settings)
    part = TriedModel((), (fit_arcs(robot, (), recordings),), None)
    whole = [replace(one, fitted=one.fitted | one.asked, asked=0 * one.block > 0) for one in recordings]
    fit = fit_arcs(robot, (), whole, begin=part.fits[0].values)
    return DrivenFit(fit, (part,), part, tuple(recordings), tuple(remarks), len(log))


def test_spools_drive_before_tensions_and_tensions_before_currents() -> None:
    here = np.zeros(3)
    columns = {"time": here, "spool_1": here, "tension_1": here, "current_1": here, "bend_y": here}
    log = OpenLog(Path("made.csv"), "log", columns)
    assert drive_of_log(log, SETTINGS) is None
    assert drive_of_log(without(log, "spool_1"), SETTINGS) == "tension"
    currents = without(log, "spool_1", "tension_1")
    assert drive_of_log(currents, SETTINGS) == "current"
    scaled = SETTINGS.model_copy(update={"torque_constant": 0.6, "spool_radius": 0.012})
    assert drive_of_log(currents, scaled) == "tension"
    with pytest.raises(UserError, match="torque constant and spool radius") as caught:
        drive_of_log(currents, SETTINGS.model_copy(update={"torque_constant": 0.6}))
    assert "identify.spool_radius" in str(caught.value)


def test_a_command_is_held_between_its_changes_and_a_reading_is_not() -> None:
    clock = 0.1 * np.arange(9.0)
    held = np.array([0.0, 0.0, 0.0, 4.0, 4.0, 4.0, 6.0, 6.0, 6.0])
    assert _at(np.array([0.29, 0.31, 0.55]), clock, held).tolist() == [0.0, 4.0, 4.0]
    smooth = np.sin(2.0 * clock)
    assert _at(np.array([0.25, 0.55]), clock, smooth) == pytest.approx(np.sin([0.5, 1.1]), abs=5e-3)


def test_a_log_in_which_nothing_moves_is_refused_before_a_fit() -> None:
    columns = {f"current_{k}": np.sin(k * TIME) for k in (1, 2, 3)}
    noise = 1e-3 * np.random.default_rng(0).standard_normal((2, len(TIME)))
    still = OpenLog(Path("made.csv"), "log", {"time": TIME, "bend_y": noise[0], "bend_z": noise[1], **columns})
    with pytest.raises(UserError, match="without motion"):
        driven_robot([still], BELIEVED, SETTINGS)
    moving = {"bend_y": 0.3 * np.sin(TIME), "bend_z": 0.2 * np.sin(2.0 * TIME)}
    held = {f"current_{k}": np.full(len(TIME), 0.4) for k in (1, 2, 3)}
    with pytest.raises(UserError, match="no current changes"):
        driven_robot([OpenLog(Path("made.csv"), "log", {"time": TIME, **moving, **held})], BELIEVED, SETTINGS)
    with pytest.raises(UserError, match="no column time"):
        driven_robot([OpenLog(Path("made.csv"), "log", {**moving, **columns})], BELIEVED, SETTINGS)


def test_one_log_of_two_clocks_leaves_the_delay_untold_whichever_it_is() -> None:
    columns = {f"current_{k}": np.sin(k * TIME) for k in (1, 2, 3)}
    moving = {"time": TIME, "bend_y": 0.3 * np.sin(TIME), "bend_z": 0.2 * np.sin(2.0 * TIME)}
    one = OpenLog(Path("made.csv"), "log", {**moving, **columns})
    two = replace(one, two_clocks=True)
    for logs, told in (([one, one], True), ([one, two], False), ([two, one], False)):
        robot, _, _ = driven_robot(logs, BELIEVED, SETTINGS)
        assert ("delay" not in robot.untold) is told


def test_logs_that_are_not_of_one_robot_at_one_mass_are_refused() -> None:
    columns = {f"current_{k}": np.sin(k * TIME) for k in (1, 2, 3)}
    moving = {"time": TIME, "bend_y": 0.3 * np.sin(TIME), "bend_z": 0.2 * np.sin(2.0 * TIME)}
    whole = OpenLog(Path("made.csv"), "log", {**moving, **columns})
    heavy, light = (replace(whole, columns={**whole.columns, "mass": np.full(len(TIME), m)}) for m in (0.1, 0.3))
    with pytest.raises(UserError, match="several masses"):
        driven_robot([heavy, light], BELIEVED, SETTINGS)
    with pytest.raises(UserError, match="other columns of tendons"):
        driven_robot([whole, without(whole, "current_3")], BELIEVED, SETTINGS)
    with pytest.raises(UserError, match="neither a bend nor the tip"):
        driven_robot([without(whole, "bend_y", "bend_z")], BELIEVED, SETTINGS)
    with pytest.raises(UserError, match="driven by spools"):
        places_of_log(whole, BELIEVED)


def test_a_current_in_ma_whose_header_says_a_is_refused_with_the_columns_that_mend_it(tmp_path: Path) -> None:
    file = tmp_path / "arm.csv"
    file.write_text("time [s],current_1 [A],current_2 [A],bend_y [deg]\n0,310,20,1\n0.1,290,40,2\n0.2,10,300,3\n")
    with pytest.raises(UserError, match="reaches 310 A") as caught:
        looked_at(read_table(file))
    assert "current_1=current_1 [mA]" in str(caught.value)


@pytest.mark.slow
@pytest.mark.parametrize("count", [3, 6])
@pytest.mark.parametrize("rates", [True, False])
def test_tensions_tell_stiffness_in_newton_metres_and_directions(count: int, rates: bool) -> None:
    angles: Array = OF_THREE if count == 3 else math.tau / 6.0 * np.arange(6.0) - 0.2
    log = made(angles, waves(count), TIME)
    found = plainly_fitted(log if rates else without(log, "rate_y", "rate_z"))
    told = found.fit.told
    assert found.share < 0.05 and told["stiffness"].unit == "N m/rad"
    assert told["stiffness"].low < STIFFNESS < told["stiffness"].high < 1.1 * STIFFNESS
    for name, truth in (("delay", DELAY), ("damping", DAMPING)):
        half = 0.5 * (told[name].high - told[name].low)
        assert told[name].known and abs(told[name].value - truth) < 1.5 * half
    assert not rates or told["delay"].value == pytest.approx(DELAY, abs=1e-3), "rates tell it from damping"
    for k, angle in enumerate(angles, 1):
        assert math.remainder(told[f"direction_{k}"].value - angle, math.tau) == pytest.approx(0.0, abs=0.02)
    ratios = ratios_of_driven(found.fit, found.robot, 25.0)
    wrist = wrist_by_ratios(ratios, Study(wrist=BELIEVED), "a run")
    assert "wrist.stiffness" in wrist.told and wrist.told["wrist.stiffness"] == pytest.approx(STIFFNESS, rel=0.05)
    assert "wrist.tendons" in wrist.told


@pytest.mark.slow
def test_currents_tell_ratios_alone_and_the_wrong_sign_of_one_is_said() -> None:
    newtons = np.array([12.0, 9.0, 15.0])
    log = made(OF_THREE, waves(3), TIME, newtons)
    log.columns["current_2"][:] *= -1.0
    found = plainly_fitted(log)
    told, mean = found.fit.told, float(newtons.mean())
    assert told["stiffness"].unit == "A/rad"
    assert told["stiffness"].value == pytest.approx(STIFFNESS / (mean * BELIEVED.tendon_radius), rel=0.02)
    assert told["gain_3"].value == pytest.approx(15.0 / mean, rel=0.02)
    assert any("current_2" in remark for remark in found.remarks)
    words = " ".join(driven_answer(found, found.remarks).lines())
    assert "no scale in newtons" in words and "identify.torque_constant" in words and "N m/rad needs" in words
    ratios = ratios_of_driven(found.fit, found.robot, 25.0)
    with pytest.raises(UserError, match="nobody has said that") as asked:
        wrist_by_ratios(ratios, Study(), "a run")
    assert "wrist.stiffness" in str(asked.value) and "identify.torque_constant" in str(asked.value)
    said = wrist_by_ratios(ratios, Study(wrist=WristParameters(stiffness=1.2)), "a run")
    assert {"wrist.damping", "wrist.tendons"} <= said.told.keys()
    scaled = SETTINGS.model_copy(update={"torque_constant": 0.12, "spool_radius": 0.01})
    in_newtons = plainly_fitted(log, scaled)
    assert in_newtons.fit.told["stiffness"].value == pytest.approx(STIFFNESS, rel=0.03)
    assert any("12 N" in remark for remark in in_newtons.remarks)


@pytest.mark.slow
def test_antagonists_that_only_trade_their_pull_do_not_tell_their_gains() -> None:
    log = made(np.array([0.0, math.pi]), antagonists, TIME, 10.0)
    found = plainly_fitted(without(log, "bend_z", "rate_z"))
    told = found.fit.told
    assert not any(name.startswith("direction") for name in told), "they are along one line"
    assert told["stiffness"].known and not told["gain_2"].known
    words = " ".join(driven_answer(found, ()).lines())
    assert "Not identifiable from these data: gain_2" in words and "pull each tendon by itself" in words
    ratios = ratios_of_driven(found.fit, found.robot, 25.0)
    assert ratios["angles"] == pytest.approx([0.0, math.pi])


@pytest.mark.slow
def test_a_tendon_that_never_pulls_leaves_the_others_told() -> None:
    whole = waves(3)

    def two_pull(time: Array) -> Array:
        return whole(time) * [0.0, 1.0, 1.0] + [2.0, 0.0, 0.0]

    found = plainly_fitted(made(OF_THREE, two_pull, TIME, 10.0))
    told = found.fit.told
    assert told["stiffness"].value == pytest.approx(STIFFNESS / (10.0 * BELIEVED.tendon_radius), rel=0.02)
    assert {"direction_2", "direction_3", "gain_3"} <= {name for name, one in told.items() if one.known}
    assert "direction_1" not in told and "gain_2" not in told
    assert "direction_1 and gain_1" in " ".join(driven_answer(found, ()).lines())
    assert ratios_of_driven(found.fit, found.robot, 25.0)["angles"] == []


def test_directions_that_no_log_tells_want_the_studys_own_tendons() -> None:
    ratios = {"values": {"damping": 0.1}, "angles": [], "tendons": 3, "radius": 0.02, "rate": 50.0}
    study = Study(wrist=WristParameters(stiffness=1.2))
    with pytest.raises(UserError, match="directions of its 3 tendons") as caught:
        wrist_by_ratios(ratios, study, "a run")
    assert "wrist.tendons=three" in str(caught.value)
    three = Study(wrist=WristParameters(stiffness=1.2, tendons="three"))
    assert "wrist.tendons" not in wrist_by_ratios(ratios, three, "a run").told


def weighing(gravity: float) -> tuple[OpenLog, WristParameters]:
    """The log of a simulated wrist of four segments with a hand of 0.2 kg in this gravity along its base's tangent."""
    wrist = BELIEVED.model_copy(update={"stiffness": 1.0, "damping": 0.1, "gravity": (gravity, 0.0)})
    rng, time = np.random.default_rng(3), np.arange(0.0, 30.0, 0.02)
    pulls, radius = plan(rng), wrist.tendon_radius

    def tensions(at: Array, which: Any) -> Array:
        return np.repeat(pulls(at)[:, :, None] / radius, len(which), axis=2)

    free = Actuator(level="tendon", friction=0.0)
    lane = SpooledWrist(wrist, free, np.zeros(8), winch=True, plant=TrueWrist(), planes=2)
    done = spooled([lane], tensions, 30_100, 1e-3)
    seen = np.clip(time - DELAY, 0.0, None)
    bends = [np.interp(seen, 1e-3 * np.arange(done.bends.shape[1]), one) for one in done.bends[0].T]
    columns = {"time": time} | {
        name: one + 1e-3 * rng.standard_normal(len(time)) for name, one in zip(("bend_y", "bend_z"), bends, strict=True)
    }
    columns |= {f"tension_{k}": one / radius for k, one in enumerate(pulls(time).T, 1)}
    return OpenLog(Path("made.csv"), "log", columns), wrist


@pytest.mark.slow
@pytest.mark.parametrize("gravity", [-9.81, 9.81, 0.0])
def test_a_wrist_that_stands_or_hangs_tells_what_weight_takes_of_its_stiffness(gravity: float) -> None:
    log, wrist = weighing(gravity)
    shown = float(straight_stiffness(wrist.model_copy(update={"pretension": 0.0}), 1)[0, 0])
    anywhere = WristParameters(tendons="three", hand_mass=0.2)
    robot, recordings, _ = driven_robot([log], anywhere, SETTINGS)
    whole = [replace(one, fitted=one.fitted | one.asked, asked=0 * one.block > 0) for one in recordings]
    told = fit_arcs(robot, (), whole).told
    truth = {"stiffness": shown, "weight": wrist.stiffness / shown - 1.0, "damping": wrist.damping / shown}
    for name, value in truth.items():
        assert told[name].known and told[name].low < value < told[name].high, name
    assert told["weight"].high - told["weight"].low < 0.08
    weightless = anywhere.model_copy(update={"gravity": (0.0, 0.0)})
    weightless.model_fields_set.add("gravity")
    bare = driven_robot([log], weightless, SETTINGS)[0]
    assert "weight" in robot.unknowns(()) and "weight" not in bare.unknowns(())


@pytest.mark.parametrize(("length", "offset"), [(0.08, 0.06), (0.2, 0.0)])
def test_a_hand_takes_of_a_standing_arcs_stiffness_its_weight_times_a_third_of_the_length_and_its_offset(
    length: float, offset: float
) -> None:
    assert _softening(length, 1e-9, 0.3, offset) == pytest.approx(0.3 * (length / 3.0 + offset), rel=1e-4)


@pytest.mark.slow
def test_ratios_directions_and_delays_of_robots_with_friction_lie_in_their_intervals() -> None:
    """One at 10 Hz, one at 50 Hz; `make driven-robots` counts 20."""
    results = [counted(number) for number in (0, 1)]
    told = [one for result in results for one in result.intervals.values() if math.isfinite(one[0] + one[2])]
    assert len(told) >= 14 and sum(low <= truth <= high for low, truth, high in told) >= 0.85 * len(told)
    assert all(result.circle < 0.1 for result in results), summary(results)
