"""`hw-run` in two planes, from homing to the page: what is written, said, drawn and exported."""

from __future__ import annotations

import json
import math
import shutil
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import wristctl
from tests.commands.conftest import columns_of, session
from wristctl.commands.adoption import with_planes
from wristctl.commands.export.run_data import open_log_of
from wristctl.commands.hw_run.command import hw_run, plan
from wristctl.commands.hw_run.results import Performed
from wristctl.commands.inputs import Inputs
from wristctl.commands.printed_table import degrees
from wristctl.config.study import Study
from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError
from wristctl.identification.measured_trials import trials_of_logs
from wristctl.plotting.animation import animation
from wristctl.plotting.page import page
from wristctl.plotting.spatial_view import spatial_view
from wristctl.records import Run, start_run
from wristctl.simulation.metrics import metrics_in
from wristctl.trial.motion_limit import LEAST, peak_tension
from wristctl.trial.rig_belief import PLANES
from wristctl.trial.trials import trials_of
from wristctl.wrist.directions import ACTIVE
from wristctl.wrist.plant import PLANTS_IN_SPACE
from wristctl.wrist.spatial.spatial_kinematics import tip_bends

pytestmark = pytest.mark.slow

SETTINGS = (
    "hw-run={reference: {kind: dart-thrower, angle_deg: 8.0, turn: 1.0}, horizon: 1.2, back: 0.4, rest: 0.1, "
    "push: {force: 1.0, start: 0.6, duration: 0.2}, push_toward_deg: 130, "
    "homing: {frames: 2, rest: 0.1, move: 1.0e-4, slack: 4.0e-4, let_go: 0.6}, "
    "controllers: [{controller: ct-dob, gains: hardware}], "
    "bench: {person: {takes: 0.0}, motors: {slack: [0.0, 0.0, 0.0, 0.0]}}}",
)  # fmt: skip


def study_of(*changes: str) -> Study:
    """The short trials, changed, on a rig with the planes of their reference."""
    return with_planes(wristctl.load_study(None, *SETTINGS, *changes))


@dataclass
class Whole:
    """A result with its run."""

    result: Performed
    run: Run


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Whole:
    """Two trials, of which one is pushed."""
    study = study_of()
    with start_run("hw-run", study, "", tmp_path_factory.mktemp("whole")) as live:
        result = hw_run(session(study, live))
    assert isinstance(result, Performed)
    return Whole(result, Run(live.path))


def test_a_row_has_errors_by_plane_estimated_and_true(whole: Whole) -> None:
    table, columns = whole.run.data("trials"), columns_of(whole.run, "data/trials.csv")
    assert sorted(table["push"]) == [0.0, 1.0] and set(table["direction"]) == {"dart-thrower"}
    assert set(table["outcome"]) == {"ok"} and table["odd"].isna().all()
    for name in ("rmse_ulnar", "rmse_flexion", "rmse"):
        assert columns[name] == (metrics_in(2)[name].unit, metrics_in(2)[name].formula)
        assert columns[f"true_{name}"][1].endswith("of the true bend")
        assert (np.degrees(table[f"true_{name}"]) < 0.5).all()
    pushed = table[table["push"] > 0.0].iloc[0]
    assert math.isnan(pushed["push_torque"]), "the wrist moves meanwhile"
    assert columns["true_recovery"][0] == "s" and columns["push_torque"][0] == "N m"


def test_the_tension_that_would_have_stopped_the_trials_is_that_of_their_simulation(whole: Whole) -> None:
    """Twice what simulated trials need, and no less than what a zero that is a little off may ask for."""
    study = study_of()
    peak = peak_tension(study, trials_of(study.hw_run, np.random.default_rng(0)), None, None)
    limit = max(LEAST, study.hw_run.tension_factor * peak)
    assert whole.result.tension_limit == pytest.approx(limit) and limit < study.hw_run.safety.tension
    assert whole.result.expected_peak == pytest.approx(peak)
    assert f"more than {limit:.3g} N would stop the motors" in " ".join(str(whole.result.answer).split())


def test_the_ellipse_of_the_error_is_in_rows_means_answer_and_figure(whole: Whole) -> None:
    table, log = whole.run.data("trials"), whole.run.data("log")
    still = table[table["push"] == 0.0].iloc[0]
    error = log.loc[log["trial"] == still["trial"], ["error_ulnar", "error_flexion"]].to_numpy(float)
    covariance, found = np.cov(error.T), [still[name] for name in ("error_major", "error_minor", "error_toward")]
    assert np.square(found[:2]) == pytest.approx(np.linalg.eigvalsh(covariance)[::-1], rel=0.05)
    axis = np.array([math.cos(found[2]), math.sin(found[2])])
    assert covariance @ axis == pytest.approx(found[0] ** 2 * axis, abs=0.05 * found[0] ** 2)
    true = math.hypot(still["true_error_major"], still["true_error_minor"])
    assert 0.5 * still["true_rmse"] < true <= still["true_rmse"] * (1.0 + 1e-9), "but for the mean it is the error"
    known = whole.result.metrics
    assert [known[name] for name in ("error_major", "error_minor", "error_toward")] == pytest.approx(found)
    said = f"an ellipse of {degrees(found[0])} by {degrees(found[1])} deg, longest {math.degrees(found[2]):.0f} deg"
    assert said in whole.result.answer.sentence
    assert f"(truly {degrees(still['true_error_major'])} by {degrees(still['true_error_minor'])} deg)" in (
        whole.result.answer.sentence
    )
    (panel,) = whole.result.findings.figures["ellipses"].axes
    drawn = np.radians(next(each for each in panel.lines if each.get_label() == "ct-dob/hardware").get_xydata())
    assert np.hypot(*(drawn - error.mean(axis=0)).T).max() == pytest.approx(2.0 * found[0], rel=0.05)


def test_nothing_is_asked_of_the_board_between_a_trial_and_its_first_tick(whole: Whole) -> None:
    """In the emulated time an exchange of half a tick would make the first one late."""
    log = whole.run.data("log")
    assert set(log.trial) == {0, 1} and log.late.max() < 1e-6


def test_the_answer_has_both_planes_beside_simulation(whole: Whole) -> None:
    answer = whole.result.answer
    assert answer.sentence.startswith("ct-dob/hardware in two planes: error 0.")
    assert "toward ulnar" in answer.sentence and "toward flexion" in answer.sentence
    assert "a push of 1 N" in answer.sentence and "No trial ended early." in answer.sentence
    assert "settles" not in answer.sentence and "never" not in answer.sentence, "the path rests nowhere"
    assert answer.table is not None
    rows = {
        row["push [N]"]: row for row in (dict(zip(answer.table.columns, row, strict=True)) for row in answer.table.rows)
    }
    trials = {push: whole.result.trials[whole.result.trials["push"] == push].iloc[0] for push in (0.0, 1.0)}
    assert list(rows) == [0.0, 1.0]
    for push, row in rows.items():
        for plane in ("ulnar", "flexion"):
            assert row[f"RMSE toward {plane} [rad]"] == pytest.approx(trials[push][f"rmse_{plane}"])
            assert f"truly {degrees(trials[push][f'true_rmse_{plane}'])} deg" in answer.sentence
        assert row["true RMSE [rad]"] == pytest.approx(trials[push]["true_rmse"])
    known = trials[1.0]["true_recovery"]
    assert ("after a push of 1 N" in answer.sentence) is math.isfinite(known)
    assert rows[1.0].get("recovery [s]", math.nan) == pytest.approx(known, nan_ok=True)
    simulated = [twin.metrics["rmse"] for twin in whole.result.twins.values()]
    assert np.degrees(simulated) == pytest.approx([0.1, 0.1], abs=0.15)


def test_it_is_drawn_in_the_plane_of_bends_and_in_space(whole: Whole) -> None:
    names = {f"{prefix}{name}" for prefix in ("", "pushed-") for name in ("bends", "ellipses", "errors", "tensions")}
    assert names <= set(whole.result.findings.figures)
    assert all((whole.run.path / f"figures/{name}.svg").is_file() for name in names)
    figures = whole.result.findings.figures
    assert [axes.get_title("left") for axes in figures["errors"].axes] == [
        "dart-thrower, toward ulnar",
        "dart-thrower, toward flexion",
    ]
    log = whole.run.data("log")
    for axes, plane in zip(figures["pushed-errors"].axes, ("ulnar", "flexion"), strict=True):
        (line,) = (line for line in axes.lines if line.get_label() == "ct-dob/hardware")
        of_trial = log[log["trial"] == whole.result.trials.query("push > 0")["trial"].iloc[0]]
        error = np.degrees(of_trial[f"bend_{plane}"] - of_trial[f"bend_ref_{plane}"])
        np.testing.assert_allclose(np.asarray(line.get_ydata()), error)
        assert {"true", "ct-dob/hardware, simulated"} <= {line.get_label() for line in axes.lines}
        assert [patch.get_label() for patch in axes.patches] == ["push"]
    (pulls,) = figures["tensions"].axes
    assert [line.get_label() for line in pulls.lines] == [f"tendon {number}" for number in ACTIVE]
    space = spatial_view(whole.run)
    assert (
        space is not None
        and not space["hinged"]
        and len(space["tendons"]) == 4
        and space["duration"] == pytest.approx(1.2, abs=0.02)
    )
    wanted = np.array(space["wanted"]) * space["units"]["angle"]
    assert np.degrees(np.hypot(*wanted.T)).max() == pytest.approx(8.0, abs=0.1)
    assert animation(whole.run) is None
    assert 'id="space"' in page(whole.run, whole.run.manifest)


def test_a_wrist_of_links_is_homed_and_run_and_drawn_as_it_is(whole: Whole, tmp_path: Path) -> None:
    """Its joints bend more toward the tip; the page has them as they truly were, and the tip where they bring it."""
    links = "hw-run.bench.plant={model: hinges, taper: 3.0}"
    study = study_of(links, "hw-run.push.force=0")
    with start_run("hw-run", study, "", tmp_path) as live:
        result = hw_run(session(study, live))
    assert isinstance(result, Performed)
    run = Run(live.path)
    (trial,) = run.data("trials").to_dict("records")
    assert trial["outcome"] == "ok" and np.degrees(trial["true_rmse"]) < 0.5
    names = [[f"bend_{k}_{plane}" for plane in PLANES] for k in (1, 2, 3, 4)]
    bent, arcs = run.data("truth"), whole.run.data("truth")
    (base, _, _, tip), even = (
        [np.ptp(table[each].to_numpy(float), axis=0) for each in names] for table in (bent, arcs)
    )
    assert (tip / base > 1.3 * even[3] / even[0]).all()
    joints = bent[[name for each in names for name in each]].to_numpy(float)
    assert bent[[f"bend_{plane}" for plane in PLANES]].to_numpy(float) == pytest.approx(tip_bends(joints), abs=1e-9)
    (twin,) = result.twins.values()
    simulated = twin.trajectory.segment_theta[np.argmax(np.hypot(*twin.trajectory.theta.T))].reshape(4, 2)
    assert np.hypot(*simulated[3]) > 1.2 * np.hypot(*simulated[0]), "its simulation is of links too"
    space = spatial_view(run)
    assert space is not None
    drawn = space["units"]["angle"] * np.array(space["bends"])
    assert space["hinged"]
    within = bent[bent["trial"] == 0]
    at = np.linspace(within["time"].iloc[0], space["duration"], len(drawn))
    for column, name in zip(drawn.T, (name for each in names for name in each), strict=True):
        assert column == pytest.approx(np.interp(at, within["time"], within[name]), abs=1e-3)
    wrist = run.config.wrist
    tips = PLANTS_IN_SPACE["hinges"].tips(wrist, drawn)
    assert space["units"]["place"] * np.array(space["tip"]) == pytest.approx(tips, abs=5e-5)


def test_what_homing_has_found_is_kept_by_tendon_and_camera(whole: Whole) -> None:
    zero: dict[str, Any] = json.loads(whole.run.file("data/zero.json").read_text())
    assert np.degrees(zero["directions"]) == pytest.approx([-135.0, 135.0, -45.0, 45.0], abs=2.5)
    assert {"marker", "marker_2"} < set(zero)
    assert set(json.loads(whole.run.file("data/camera_pose.json").read_text())) == {"ulnar", "flexion"}


def test_its_open_log_is_one_that_identification_reads(whole: Whole) -> None:
    log = open_log_of(whole.run)
    assert {"time", "bend_y", "bend_z", *(f"spool_{tendon}" for tendon in ACTIVE)} <= set(log.columns)
    assert all((np.diff(trial.columns["time"]) > 0.0).all() for trial in log.trials().values()), "a row for each time"
    trials = trials_of_logs([log], WristParameters(), 0.005)
    assert len(trials) == 2 and all(len(trial.angle) > 80 for trial in trials)
    assert {0, 1} == {int(channel) for trial in trials for channel in trial.channel}
    assert "theta" not in whole.run.data("frames"), "no sample of an angle in one plane"


def test_a_tick_by_which_no_answer_had_come_moves_no_spool_of_an_open_log(whole: Whole, tmp_path: Path) -> None:
    """Its row repeats the board's last positions, at their time; where spools were meanwhile, their rates say."""
    late = tmp_path / "late"
    shutil.copytree(whole.run.path, late)
    rows = (late / "data/log.csv").read_text().splitlines()
    names = rows[0].split(",")
    first, second = (rows[number].split(",") for number in (60, 61))
    for name in ("counted", *(f"position_{tendon}" for tendon in ACTIVE)):
        second[names.index(name)] = first[names.index(name)]
    rows[61] = ",".join(second)
    (late / "data/log.csv").write_text("\n".join(rows) + "\n")
    logs = [open_log_of(run).columns for run in (whole.run, Run(late))]
    spools = [log["spool_1"][np.isfinite(log["spool_1"])] for log in logs]
    assert len(spools[0]) == len(spools[1]) and np.ptp(spools[0]) > 1e-3
    assert np.abs(spools[0] - spools[1]).max() < 2.0 * whole.run.config.hw_run.actuator.step_length
    assert set(logs[0]["mass"]) == {whole.run.config.wrist.hand_mass}


@pytest.mark.parametrize(
    ("change", "problem"),
    [
        ("hw-run.reference.angle_deg=70", "a bend of 70 deg is beyond the wrist's range"),
        ("wrist.tendons=six", "the motor board has 4 axes, and this wrist 6 tendons off its axis"),
    ],
)
def test_what_cannot_be_is_refused_before_a_rig_is_opened(change: str, problem: str) -> None:
    with pytest.raises(UserError, match=problem):
        plan(study_of(change), Inputs({}))
    said = plan(study_of(), Inputs({}))
    assert "2 trials" in said


def test_a_wrist_that_swings_at_rest_is_told_and_one_that_still_moves_is_not(whole: Whole) -> None:
    """The whole run's motion goes on to its end: whatever swings there may be the motion."""
    table = whole.result.trials.assign(oscillation=np.radians(0.7), steady_state=0.0, chattering=0.0)
    table = table.assign(true_oscillation=np.radians([0.5, 0.6]))
    moving = replace(whole.result, trials=table)
    still = {}
    for number, twin in whole.result.twins.items():
        course, samples = twin.trajectory, len(twin.trajectory.time)
        arrays = {name: value for name, value in vars(course).items() if np.shape(value)[:1] == (samples,)}
        longer: dict[str, Any] = {name: np.resize(value, (300, *value.shape[1:])) for name, value in arrays.items()}
        longer |= {"time": np.arange(300) * 0.01, "theta_ref": np.full((300, 2), 0.1)}
        given = {field.name for field in fields(course)}
        longer = {name: value for name, value in longer.items() if name in given}
        still[number] = replace(twin, trajectory=replace(course, **longer))
    assert moving.marks == []
    resting = replace(moving, twins=still)
    assert resting.marks == ["swings by up to 1.4 deg peak to peak at rest (truly 1.2 deg): 2 of 2 trials"]
    assert any("swings by up to 1.4 deg peak to peak" in str(note) for note in resting.answer.notes)
    away = replace(resting, trials=table.assign(oscillation=0.0, true_oscillation=0.0, steady_state=[0.1, 0.0]))
    assert away.marks == ["does not arrive: 1 of 2 trials"]
    crossing = 4.0 * 30.0 * WristParameters().tension_range  # of two sides 30 times a second, and of four tendons 15
    slams = replace(
        resting, trials=table.assign(oscillation=0.0, true_oscillation=0.0, chattering=[crossing, 2.0 * crossing])
    )
    assert slams.marks == ["chatters: 1 of 2 trials"]
