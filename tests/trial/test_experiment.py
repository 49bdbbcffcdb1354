"""The experiment on the emulated bench: what it reaches, and how it is interrupted."""

from __future__ import annotations

import errno
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.trial.conftest import WRIST, Run, settings_of
from wristctl.board.messages import State
from wristctl.errors import UserError
from wristctl.trial.control_loop import AtZero
from wristctl.trial.experiment import Experiment, log_of, spared
from wristctl.trial.log import tick_columns
from wristctl.trial.safety import SafetyStop
from wristctl.trial.trials import trials_of
from wristctl.trial.zero_checks import HomedWrist

NAMES = "log", "between", "frames", "residuals", "truth", "wire"


@pytest.mark.slow
def test_a_trial_follows_its_reference_and_comes_back(experiment: Run) -> None:
    done = experiment()
    log, truth = done.table("log"), done.table("truth")
    assert done.error is None and done.experiment.outcomes == {0: "ok"}
    assert list(log.columns) == list(tick_columns(1)) and len(log) == 40 and (log["state"] == "ENABLED").all()
    error = np.interp(log["time"], truth["time"], truth["theta"]) - log["theta_ref"]
    assert math.degrees(np.abs(error).max()) < 0.6
    between = done.table("between")
    assert between["theta_ref"].iloc[-1] == 0.0 and abs(between["theta"].iloc[-1]) < 0.02
    assert (log["late"].abs() < 1e-5).all() and done.experiment.timing.overruns == 0


@pytest.mark.parametrize("ramp", [50_000.0, 200_000.0])
@pytest.mark.slow
def test_a_wrist_under_a_quick_controller_rests_however_steeply_its_board_ramps(experiment: Run, ramp: float) -> None:
    """Host and observer know how the board turns its motors; with rates taken to be there at once it swings."""
    gains = {"w": 275.0, "lambda": 96.1, "Kd": 2.18e-4, "gamma": 4.16, "leak": 0.212}
    done = experiment(
        horizon=2.0, reference={"duration": 0.5, "angle_deg": 30.0}, actuator={"level": "tendon", "ramp": ramp},
        rows=({"controller": "mrac", "gains": gains},),
    )  # fmt: skip
    truth = done.table("truth")
    late = truth[(truth["trial"] == 0) & truth["time"].between(1.2, 2.0)]
    theta = np.degrees(late["theta"].to_numpy())
    theta -= np.polyval(np.polyfit(late["time"], theta - 30.0, 1), late["time"])
    assert done.error is None and np.ptp(theta) < 0.1, "peak to peak [deg]"


@pytest.mark.slow
def test_tensions_and_spools_in_the_log_are_what_the_emulated_tendons_do(experiment: Run) -> None:
    """Once the reference rests, each tendon pulls as commanded, within friction and what the springs lack."""
    done = experiment()
    log, truth = done.table("log"), done.table("truth")
    late = log[log["time"] > 0.35]
    for tendon in (1, 2, 4, 5):
        pull = np.interp(late["time"], truth["time"], truth[f"pull_{tendon}"])
        assert pull == pytest.approx(late[f"tension_{tendon}"].to_numpy(), abs=2.5)


@pytest.mark.slow
def test_frames_are_fused_at_their_capture_time(experiment: Run) -> None:
    """A frame's marker angle is the true angle when it was taken, not when it was used two frames later."""
    done = experiment()
    log, truth = done.table("log"), done.table("truth")
    used = log[log["theta_measured"].notna() & (log["captured"] > 0.02)]
    assert ((used["time"] - used["captured"]) > 1.9 / 60.0).all() and len(used) > 15
    taken, now = (np.interp(used[name], truth["time"], truth["theta"]) for name in ("captured", "time"))
    off = [float(np.abs(used["theta_measured"] - true).max()) for true in (taken, now)]
    assert math.degrees(off[0]) < 0.6 < math.degrees(off[1])


@pytest.mark.parametrize(("period", "most"), [(10.1e-3, 1e-4), (10e-3, 0.6e-3)])
@pytest.mark.slow
def test_positions_in_the_log_are_of_the_time_that_it_says(experiment: Run, period: float, most: float) -> None:
    """By the true spools, to a tenth of a millisecond, though a status comes six after its command.

    That is so where ticks begin anywhere in USB's frames. Where they keep step with them, a whole frame may go by.
    Rotors have no inertia: they would lag behind the count by their load.
    """
    motors = {"slack": (0.0,) * 4, "rotor_inertia": 0.0}
    done = experiment(control_period=period, bench={"motors": motors, "person": {"takes": 0.5}})
    log, truth = done.table("log"), done.bench.truth()
    begin = float(log["clock"].iloc[0] - log["time"].iloc[0])
    late, weight = 0.0, 0.0
    for axis, tendon in enumerate((1, 2, 4, 5)):
        position = log[f"position_{tendon}"] * done.experiment._settings.actuator.step_length
        rate = np.gradient(position, log["counted"])
        true = np.interp(log["counted"] + begin, truth.time - 0.5e-3, truth.reeled[:, axis])
        late += float(rate @ (position - true))
        weight += float(rate @ rate)
    assert abs(late / weight) < most
    assert 1e-3 < (log["counted"] - log["time"].shift()).mean() < 0.5 * period, "of the tick before"


@pytest.mark.parametrize("moment", [0.0, 0.11, 0.31])
@pytest.mark.slow
def test_ctrl_c_stops_the_motors_before_it_goes_on_up(experiment: Run, moment: float) -> None:
    def interrupt(row: dict[str, Any]) -> None:
        if row["trial"] == 0 and row["time"] >= moment:
            raise KeyboardInterrupt

    done = experiment(interrupt)
    stop = done.experiment.stop
    assert isinstance(done.error, KeyboardInterrupt) and stop is not None and stop.halt.verified
    assert stop.reason == "interrupted by the operator"
    assert stop.halt.status is not None and stop.halt.status.state is State.ENABLED
    assert not any(done.bench.motion().energised)


@pytest.mark.slow
def test_an_error_of_the_disk_is_told_as_such(experiment: Run) -> None:
    def fail(row: dict[str, Any]) -> None:
        raise OSError(errno.EDQUOT, "Disk quota exceeded")

    done = experiment(fail)
    assert isinstance(done.error, UserError) and "Disk quota exceeded" in done.error.what
    stop = done.experiment.stop
    assert stop is not None and stop.halt.verified and stop.reason == done.error.what


@pytest.mark.slow
def test_the_same_seed_gives_the_same_bytes(experiment: Run) -> None:
    files = []
    for _ in range(2):
        done = experiment()
        files.append({file.name: file.read_bytes() for file in done.folder.iterdir()})
    assert set(files[0]) == {f"{name}.csv" for name in NAMES} and files[0] == files[1]


@pytest.mark.slow
def test_a_stored_zero_is_checked_on_a_wrist_that_has_had_time_to_straighten(
    experiment: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    times, slacken, check_zero = list[tuple[str, float]](), HomedWrist.slacken, HomedWrist.check_zero

    def slackened(homed: HomedWrist, *given: float) -> None:
        slacken(homed, *given)
        times.append(("slack", homed._board.transport.now()))

    def checked(homed: HomedWrist) -> tuple[float, ...]:
        times.append(("check", homed._board.transport.now()))
        return check_zero(homed)

    monkeypatch.setattr(HomedWrist, "slacken", slackened)
    monkeypatch.setattr(HomedWrist, "check_zero", checked)
    done = experiment()
    (slack, since), (check, then), *after = times
    assert done.error is None and (slack, check) == ("slack", "check") and all(name == "slack" for name, _ in after)
    assert then - since >= settings_of().homing.let_go > 0.0


@pytest.mark.slow
def test_the_zero_of_a_further_plane_is_what_its_checks_find(experiment: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[tuple[float, ...]] = []
    at_rest = Experiment._at_rest

    def resting(performed: Experiment, ready: AtZero, *given: Any) -> Any:
        seen.append(ready.tracking.zero)
        return at_rest(performed, ready, *given)

    check_zero = HomedWrist.check_zero

    def checked(homed: HomedWrist) -> tuple[float, ...]:
        return (check_zero(homed)[0] + 0.01,)

    monkeypatch.setattr(Experiment, "_at_rest", resting)
    monkeypatch.setattr(HomedWrist, "check_zero", checked)
    done = experiment(directions=("ulnar", "flexion"))
    assert done.error is None and len(seen) >= 3
    assert seen[0] == (0.0,), "the calibration's"
    assert seen[-1][0] == pytest.approx(0.01, abs=2e-3), "the wrist is straight, and the checks say 0.01 rad more"


@pytest.mark.parametrize("planes", [1, 2])
def test_a_loop_in_one_plane_knows_the_springs_of_that_plane_and_one_in_two_the_whole_wrist(
    planes: int, tmp_path: Path
) -> None:
    wrist = WRIST.model_copy(update={"flexion_ratio": 1.4, "gravity_flexion": -3.0})
    settings = settings_of(planes=planes)
    trials, log = trials_of(settings, np.random.default_rng(0)), log_of(tmp_path, settings, wrist)
    own = Experiment(settings, wrist, trials, log)
    log.close()
    ulnar, flexion = (own._facing(plane if planes == 1 else "") for plane in ("ulnar", "flexion"))
    assert ulnar.stiffness == WRIST.stiffness and ulnar.gravity[1] == WRIST.gravity[1]
    assert flexion.stiffness == pytest.approx((1.4 if planes == 1 else 1.0) * WRIST.stiffness)
    assert flexion.gravity[1] == (-3.0 if planes == 1 else WRIST.gravity[1])


def test_stored_positions_of_another_start_of_the_board_are_refused(experiment: Run, at_zero: Any) -> None:
    object.__setattr__(at_zero, "boot_nonce", at_zero.boot_nonce ^ 1)
    try:
        done = experiment()
    finally:
        object.__setattr__(at_zero, "boot_nonce", at_zero.boot_nonce ^ 1)
    assert isinstance(done.error, UserError) and done.error.exit_code == 4
    assert "the board has restarted since" in done.error.what and "positions: stored" in done.error.fix
    assert not (done.folder / "log.csv").read_text().splitlines()[1:]


def test_zero_is_found_anew_by_a_calibrations_senses_unless_its_positions_are_stored(
    experiment: Run, at_zero: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    senses: list[Any] = []

    def found(*given: Any, layout: Any) -> Any:
        senses.append(given[-1])
        raise SafetyStop("far enough", fix="none")

    monkeypatch.setattr("wristctl.trial.board_stand.find_zero", found)
    done = experiment(positions="find")
    assert isinstance(done.error, SafetyStop) and senses == [at_zero.zero.signs]


@pytest.mark.slow
def test_co_contraction_in_a_trial_is_found_behind_it_and_never_beyond_the_motors_pull(experiment: Run) -> None:
    faults = tuple({"kind": "tendon-creeps", "at": 0.1, "axis": axis, "size": -3.0, "duration": 0.6} for axis in (1, 2))
    bench = {"motors": {"slack": (0.0, 0.0, 0.0, 0.0)}, "person": {"takes": 0.5}, "faults": faults}
    done = experiment(bench=bench)
    assert isinstance(done.error, SafetyStop) and "tendons pull against each other" in done.error.what
    assert done.experiment.odd == {0: ""}, "no residual shows it"
    assert done.experiment.outcomes[0].startswith("after it: tendons pull against each other")
    assert 30.0 < done.bench.truth().pull.max() < 43.5


@pytest.mark.slow
def test_no_law_asks_for_more_than_the_motors_hold_and_no_tension_is_let_pass_beyond_the_wrists(
    experiment: Run,
) -> None:
    done = experiment(safety={"motor_pull": 30.0, "tension": 45.0})
    assert done.experiment._wrist.tension_limit == pytest.approx(24.0)
    assert done.experiment._settings.safety.tension == 45.0
    assert settings_of(safety={"tension": 150.0}).within(WRIST).safety.tension == WRIST.tension_limit == 60.0
    assert settings_of(safety={"tension": 25.0}).within(WRIST).safety.tension == 25.0
    with pytest.raises(UserError, match="cannot hold a pretension of 2 N"):
        spared(WRIST, settings_of(safety={"motor_pull": 2.4}))
