"""An analysis as it is told: the answer first, then numbers, figures and what linearisation leaves out."""

from __future__ import annotations

import logging
import math
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

import wristctl
from tests.commands.conftest import columns_of, known_of
from wristctl.errors import UserError
from wristctl.study_files.load import load_study

ALONE, STRAIGHT = "simulate={controller: feedforward, gains: default}", "analyse.angles_deg=[0.0]"
GVSC = "simulate={controller: gvsc, gains: default}"
PID = "simulate={controller: pid, gains: {Kp: 10.0, Ki: 20.0, Kd: 0.5}}"
CAMERA = "simulate.loop={control_period: 5.0e-3, actuator: {level: tendon}, sensor: {level: camera}}"


READINGS = ("slipping", "stuck")


def analyse(*settings: str, **given: Any) -> Any:
    return wristctl.analyse(load_study([], [*settings]), **given)


@pytest.mark.slow
def test_the_answer_is_the_least_margin_of_all_angles() -> None:
    done = analyse(PID)
    assert list(done.angles) == [0.0, 15.0, 30.0] and done.fault is None
    table = done.frame()
    assert list(table["angle_deg"]) == [0.0, 15.0, 30.0] and table["stable"].all()
    assert done.metrics["gain_most"] == table["gain_most"].min() < table["gain_most"].max()
    assert done.metrics["delay_margin"] == table["delay_margin"].min()
    least, delay = done.metrics["gain_most"], done.metrics["delay_margin"]
    words, lines = " ".join(done.summary), done.summary
    assert "stable at 0, 15 and 30 deg" in words and f"{20.0 * math.log10(least):.3g} dB" in words
    assert f"delay margin {1e3 * delay:.3g} ms" in words and len(lines) <= 32 and max(map(len, lines)) <= 100
    for row, (_, found) in zip(done.answer.table.rows, table.iterrows(), strict=True):
        own = found["gain_most"], found["phase_margin"], found["delay_margin"], found["settling"], found["overshoot"]
        shown = 20.0 * math.log10(own[0]), own[1], 1e3 * own[2], 1e3 * own[3], 100.0 * own[4]
        assert row[0] == found["angle_deg"] and row[1:] == pytest.approx(shown)
    assert len(done.answer.table.text(100).splitlines()) == 2 + len(table), "side by side"
    heads = ("Ms", "Mt", "at [Hz]", "least factor", "torque [N m]")
    (margins,) = [each for each in done.tables if each.title == "Margins"]
    cells = dict(zip(margins.columns, margins.rows[-1], strict=True))
    names = ("sensitivity", "complementary", "gain_most_frequency", "gain_least", "torque")
    assert [cells[head] for head in heads] == [table[name].iloc[-1] for name in names]
    assert list(done.figures) == ["bode", "step", "sensitivity", "locus"] and done.portrait is None
    assert known_of(done.findings, "gain_most", "delay_margin") == [("", "higher", 3), ("s", "higher", 3)]


@pytest.mark.slow
def test_a_sealed_run_begins_with_the_answer_and_one_figure(tmp_path: Path) -> None:
    done = analyse("simulate={controller: smc-tracking, gains: default, horizon: 0.5}", "analyse.over=k", out=tmp_path)
    assert done.run is not None
    text = (done.run.path / "README.md").read_text(encoding="utf-8")
    assert text.index(done.summary[0]) < text.index("figures/bode.png") < text.index("least factor")
    assert columns_of(done.run, "data/margins.csv")["delay_margin"][0] == "s"
    assert set(columns_of(done.run, "data/response.csv")) == {
        "angle_deg", "frequency", "gain", "phase", "plant_gain", "plant_phase",
    }  # fmt: skip
    portrait = done.run.data("portrait")
    assert portrait["course"].nunique() == 4 and portrait["error"].abs().max() > 0.3
    steps = done.run.data("step")
    assert steps.groupby("angle_deg")["response"].last().to_numpy() == pytest.approx(1.0, abs=1e-3)
    pd.testing.assert_frame_equal(done.run.data("margins"), done.frame(), check_dtype=False)
    assert set(done.run.data("locus")["factor"]) == set(done.locus.factors)
    assert [table.title.split(",")[0] for table in done.tables][2] == "Root locus"


@pytest.mark.slow
def test_every_table_holds_what_was_found_in_the_units_of_its_heads(tmp_path: Path) -> None:
    """A loop that is stable above a gain too, so that no column is empty; frequencies in Hz, angles in deg."""
    lagged = "simulate.loop={actuator: {level: lagged}, sensor: {level: camera}}"
    law = "simulate={controller: smc-tracking, gains: camera, horizon: 0.2}"
    done = analyse(lagged, law, "analyse.angles_deg=[0.0, 20.0]", out=tmp_path)
    run, turn, last = done.run, 2.0 * math.pi, done.found[-1]
    own = last.margins
    assert len(done.found) == 2 and not any(math.isnan(each.omega) for each in (own.most, own.least))
    expected = {
        "angle_deg": 20.0, "torque": last.linear.torque, "stable": True, "growth": own.growth,
        "gain_most": own.most.value, "gain_most_frequency": own.most.omega / turn,
        "gain_least": own.least.value, "gain_least_frequency": own.least.omega / turn,
        "phase_margin": own.phase.value, "delay_margin": own.delay, "delay_frequency": own.delay_omega / turn,
        "sensitivity": own.sensitivity.value, "complementary": own.complementary.value, "rise": last.step.rise,
        "overshoot": last.step.overshoot, "settling": last.step.settling, "final": last.step.final,
    }  # fmt: skip
    cells = run.data("margins").iloc[-1]
    assert {name: cells[name] for name in cells.index} == pytest.approx(expected, rel=1e-9)
    heads = {name: unit for name, (unit, _) in columns_of(run, "data/margins.csv").items()}
    assert {heads[name] for name in expected if name.endswith("_frequency")} == {"Hz"} and heads["angle_deg"] == "deg"
    assert (heads["phase_margin"], heads["growth"]) == ("rad", "1/s")
    response, at = run.data("response"), 40
    rows = response[response["angle_deg"] == 20.0].reset_index(drop=True)
    assert len(rows) == len(last.omega) and rows["frequency"].max() == pytest.approx(500.0 * 0.06, rel=1e-6)
    for name, values in (("gain", last.response), ("plant_gain", last.plant)):
        assert rows[name][at] == pytest.approx(abs(values[at]))
    for name, values in (("phase", last.response), ("plant_phase", last.plant)):
        assert np.exp(1j * rows[name][at]) == pytest.approx(values[at] / abs(values[at]))
    step, locus, portrait = (run.data(name) for name in ("step", "locus", "portrait"))
    course = step[step["angle_deg"] == 20.0].reset_index(drop=True)
    assert (course["time"][at], course["response"][at]) == pytest.approx((last.step.time[at], last.step.angle[at]))
    here = locus[locus["factor"] == done.locus.factors[7]].reset_index(drop=True)
    np.testing.assert_allclose(here[["growth", "frequency"]].to_numpy(), done.locus.poles[7])
    third, own_course = portrait[portrait["course"] == 2].reset_index(drop=True), done.portrait.courses[2]
    for name in ("time", "error", "rate", "sigma"):
        assert third[name][at] == pytest.approx(getattr(own_course, name)[at]), name


@pytest.mark.slow
def test_over_a_gain_the_table_tells_its_values() -> None:
    done = analyse(PID, "analyse={over: Kd, span: 20.0, angles_deg: [10.0]}")
    (row,) = done.tables[2].rows
    assert row[0] == "Kd [N m s/rad]" and row[1] == 0.5 and row[4] == pytest.approx(0.5 * done.locus.most)
    assert row[2] is None and done.tables[2].title.endswith("from 1/20 to 20 times")
    assert list(done.angles) == [10.0]


@pytest.mark.slow
def test_a_loop_that_feeds_nothing_back_says_so_and_shows_the_plant() -> None:
    done = analyse(ALONE)
    said = done.answer.sentence
    assert "feeds nothing back" in said and "UNSTABLE" not in said and done.locus is None
    assert list(done.figures) == ["bode", "step"] and done.fault is None and math.isnan(done.metrics["gain_most"])
    assert "angle per torque" in done.figures["bode"].axes[0].get_title("left")


@pytest.mark.slow
def test_an_unstable_loop_is_told_with_what_would_mend_it_and_ends_with_a_fault() -> None:
    done = analyse("simulate={gains: exchanged, horizon: 1.1}")
    said = done.answer.sentence
    assert "smc/exchanged is UNSTABLE at 0, 15 and 30 deg" in said and "stable up to" in said
    assert done.fault is not None and done.fault.exit_code == 3 and "0, 15 and 30 deg" in done.fault.what
    assert done.marks == ["unstable at 0, 15 and 30 deg"], "which the run's page shows in place of ok"
    assert math.isnan(done.metrics["delay_margin"]) and done.metrics["growth"] > 1e3
    assert [row[1:] for row in done.answer.table.rows] == 3 * [5 * (None,)]
    assert "UNSTABLE" in done.summary[0] and "stable up to" in " ".join(done.summary)
    assert "step" not in done.figures and done.figures["locus"].axes


@pytest.mark.slow
def test_a_wrist_that_buckles_needs_some_gain_to_stay(caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.WARNING):
        done = analyse(PID, "wrist.hand_mass=0.9", STRAIGHT)
    assert done.fault is None and not done.marks and 0.0 < done.metrics["gain_least"] < 0.1 and "buckles" in caplog.text
    assert f"{done.metrics['gain_least']:.3g} times" in " ".join(done.summary[1:])
    alone = analyse("simulate={controller: feedforward, gains: default}", "wrist.hand_mass=0.9", STRAIGHT)
    assert "and it is UNSTABLE" in alone.answer.sentence and alone.fault is not None


@pytest.mark.slow
def test_behind_camera_and_tendons_it_is_said_for_which_swings_it_holds() -> None:
    done = analyse(CAMERA, "simulate={controller: smc-tracking, gains: hardware, horizon: 0.2}", STRAIGHT)
    assert (  # it would begin at 24 Hz, by the time that a rate takes to act
        "no swing is linear, which it would be above 0.081 deg (friction that sticks) and below 0.0312 deg "
        "(the stepper's acceleration)"
    ) in " ".join(done.answer.notes)
    last = next(table for table in done.tables if table.title.startswith("Where linearisation"))
    assert "the camera's frames" in last.title
    told = {row[0]: row[1] for row in last.rows}
    assert told["the camera's noise"] == "below 0.1" and told["a slack tendon"] == "above 0.4051"
    slips, stuck = (analyse(CAMERA, GVSC, f"analyse={{angles_deg: [20.0], friction: {each}}}") for each in READINGS)
    assert abs(stuck.found[0].plant[0]) < 0.8 * abs(slips.found[0].plant[0])


@pytest.mark.slow
def test_no_swing_is_linear_where_the_limits_cross() -> None:
    slow = "simulate.loop.plant={actuator: {step_acceleration: x0.2}}"
    done = analyse(CAMERA, slow, "simulate={controller: super-twisting, gains: hardware, horizon: 0.1}", STRAIGHT)
    said = " ".join(done.answer.notes)
    assert "no swing is linear, which it would be above 0.081 deg (friction that sticks) and below 0.0126" in said


@pytest.mark.slow
def test_angles_count_toward_the_direction_and_a_sine_ends_at_its_farthest() -> None:
    one, other = (
        analyse(GVSC, f"simulate.direction={each}", "wrist.gravity=[-9.81, 2.0]") for each in ("ulnar", "radial")
    )
    assert list(one.angles) == list(other.angles) == [0.0, 15.0, 30.0]
    assert one.frame()["torque"].iloc[2] > 0.0 > other.frame()["torque"].iloc[2]
    swings = analyse(
        "simulate={controller: gvsc, gains: default, reference: {kind: sine, angle_deg: 20.0}, horizon: 2.5}"
    )
    assert swings.angles[-1] == pytest.approx(20.0, abs=0.01)


def test_a_law_that_bends_at_once_is_warned_of(caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.WARNING):
        analyse("simulate={gains: printed, horizon: 0.1}", STRAIGHT)
    assert "at 0 deg the control law is not linear" in caplog.text


@pytest.mark.slow
def test_frames_that_never_repeat_are_warned_of(caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level(logging.WARNING):
        analyse(
            CAMERA, "simulate={controller: gvsc, gains: default}", "simulate.loop.sensor.frame_rate=58.37",
            STRAIGHT,
        )  # fmt: skip
    assert "58.37 Hz repeat on no few control periods: linearised with 58.333 Hz" in caplog.text


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ((PID, "analyse.over=kp"), "pid has no gain 'kp' for a root locus"),
        (("simulate={controller: feedforward, gains: default}", "analyse.over=Kp"), "feedforward has no gain 'Kp'"),
        ((PID, "analyse.angles_deg=[10.0, -60.0]"), "-60 deg lies outside the wrist's range of +-50 deg"),
        ((PID, "wrist.tension_limit=5.0"), "to rest at 15 deg takes 5.25 N in a tendon that bears 5"),
        (("simulate.controller=scm",), "did you mean 'smc'"),
        (
            ("simulate.loop={control_period: 1.0e-4, sensor: {level: camera}}", "simulate.gains=initial"),
            "looks back over 501",
        ),
    ],
)
@pytest.mark.slow
def test_what_cannot_be_analysed_is_said_with_where(settings: tuple[str, ...], said: str) -> None:
    with pytest.raises(UserError) as caught:
        analyse(*settings)
    assert said in str(caught.value) and caught.value.exit_code == 2


@pytest.mark.slow
@pytest.mark.parametrize("gains", [{"Kp": 20.0, "Ki": 0.0, "Kd": 0.5}, {"Kp": 5.0, "Ki": 0.0, "Kd": 0.3}])
def test_a_loop_without_an_integral_rests_where_the_simulated_one_does(gains: dict[str, float]) -> None:
    """Short of what is asked, with an integral of the error that drifts and acts on nothing."""
    done: Any = wristctl.analyse(controller="pid", gains=gains, angles_deg=[15.0])
    rest = math.degrees(done.found[0].linear.theta)
    moved: Any = wristctl.simulate(controller="pid", gains=gains, reference={"angle_deg": 15.0}, horizon=6.0)
    assert done.found[0].margins.stable and rest < 14.9
    assert rest == pytest.approx(math.degrees(moved.course["bend"].iloc[-1]), abs=2e-3)


@pytest.mark.slow
def test_a_loop_far_from_stable_is_told_unstable_and_with_which_part_of_a_gain_it_would_be() -> None:
    rig: Any = {"control_period": 0.01, "sensor": {"level": "camera"}, "actuator": {"level": "tendon"}}
    found: Any = wristctl.analyse(
        controller="pd-ff", gains={"Kp": 20.0, "Kd": 0.5}, loop=rig, angles_deg=[15.0], over="Kp"
    )
    assert found.fault is not None and "unstable at 15 deg" in found.fault.what
    assert found.locus.least == 0.0 or found.locus.least < found.locus.most
    assert 0.1 < found.locus.most < 1.0, "it is stable with less of the gain"


def test_a_loop_that_rests_nowhere_is_said() -> None:
    """A reference of which tendons that only pull one way make nothing: no finite gain rests there."""
    with pytest.raises(UserError, match="rests nowhere near"):
        analyse("simulate={controller: pid, gains: {Kp: 1.0e-9, Ki: 1.0e-9, Kd: 1.0e-9}}", "analyse.angles_deg=[40.0]",
                "wrist.hand_mass=3.0")  # fmt: skip


@pytest.mark.slow
def test_noise_and_drawn_courses_come_from_the_seed() -> None:
    first, again, other = (
        analyse(
            CAMERA,
            "simulate={controller: smc, gains: hardware, horizon: 0.3}",
            STRAIGHT,
            f"seed={seed}",
        )
        for seed in (1, 1, 2)
    )
    np.testing.assert_array_equal(first.portrait.courses[0].error, again.portrait.courses[0].error)
    assert np.abs(first.portrait.courses[0].error - other.portrait.courses[0].error).max() > 0.0
    assert first.metrics == again.metrics


@pytest.mark.slow
def test_three_tendons_are_analysed_as_one_loop_of_two_planes(tmp_path: Path) -> None:
    """Toward where the reference ends, with what each plane bears by itself beside the margins of both."""
    done = analyse(
        "wrist.tendons=three", "simulate={controller: ct-dob, gains: default, direction: flexion}",
        "analyse.angles_deg=[0.0, 20.0]", out=tmp_path,
    )  # fmt: skip
    assert done.toward_deg == 90.0 and "in two planes toward flexion is stable at 0 and 20 deg" in done.answer.sentence
    table, margins = done.frame(), done.found[-1].margins
    assert list(table["toward_deg"]) == [90.0, 90.0] and done.found[-1].linear.theta == pytest.approx(
        [0.0, math.radians(20.0)], abs=1e-6
    )
    assert table["each_most"][1] == margins.of_each.most <= margins.most.value * (1.0 + 1e-6)
    assert table["each_least"][1] < 1.0 < table["each_most"][1]
    assert f"{margins.of_each.least:.3g} to " in " ".join(done.summary)
    assert len(done.found[-1].linear.tensions) == 3
    response = done.run.data("response")
    assert set(response["locus"]) == {1, 2} and response.groupby(["angle_deg", "locus"]).ngroups == 4
    bode = done.figures["bode"].axes[0]
    drawn = [line for line in bode.lines if len(line.get_xdata()) > 100]
    assert len(drawn) == 4, "two eigenvalues at each angle"
    assert done.tables[1].title.startswith("What each plane bears by itself") and len(done.tables[1].rows) == 2
