"""The largest tension of trials by their simulation, and what undeclared loads come to."""

from __future__ import annotations

import math
import re
from typing import Any

import numpy as np
import pytest

import wristctl
from tests.trial.conftest import WRIST, Run, settings_of
from wristctl.cli.operator import TerminalOperator
from wristctl.cli.progress import Terminal
from wristctl.commands.hw_run.command import hw_run
from wristctl.commands.inputs import Inputs
from wristctl.commands.progress import watched
from wristctl.commands.results import Findings
from wristctl.commands.session import Session
from wristctl.config.hw_run import HwRunSettings
from wristctl.config.study import Study
from wristctl.errors import UserError
from wristctl.trial.expected_moves import Bend, ExpectedMoves
from wristctl.trial.motion_limit import LEAST, borne, held_pull, limited, peak_tension, reeled_unseen, unseen_time
from wristctl.trial.trial_results import twin
from wristctl.trial.trials import Trial, trials_of
from wristctl.trial.zero_checks import _goes_on

pytestmark = pytest.mark.slow

SHORT = (
    "hw-run={horizon: 2.5, reference: {duration: 1.0, angle_deg: 25}, push: {force: 0}, directions: [ulnar, radial]}"
)
HANGING = "wrist.gravity=[9.81, 0.0]"


def peak(*changes: str) -> tuple[Study, float]:
    """The study of short trials, and what they need."""
    study = wristctl.load_study(None, SHORT, *changes)
    return study, peak_tension(study, trials_of(study.hw_run, np.random.default_rng(0)), None, None)


def test_what_trials_need_is_the_peak_of_their_simulation_on_the_believed_wrist_and_not_on_the_emulated_one() -> None:
    study, needed = peak()
    (real,) = (study.model_copy(update={"hw_run": study.hw_run.model_copy(update={"port": "/dev/ttyACM0"})}),)
    each = [twin(real, Trial(0, name, 0, 0.0, 0), None, None).metrics["peak_tension"] for name in ("ulnar", "radial")]
    assert needed == pytest.approx(max(each), rel=1e-12)
    weaker = peak("hw-run.bench.plant.stiffness_scale=0.3")[1]
    assert weaker == needed, "nobody knows the emulated springs"


@pytest.mark.parametrize(("payload", "gravity"), [(0.5, HANGING), (0.5, "wrist.gravity=[-9.81, 0.0]")])
def test_a_declared_payload_lets_motors_pull_for_it_and_never_less(payload: float, gravity: str) -> None:
    """A hanging wrist carries it up. An upright one is pulled along by it, and yet lifts nothing at first."""
    without, declared = (peak(gravity, f"hw-run.payload={kg}")[1] for kg in (0.0, payload))
    assert declared >= without and (declared > 1.2 * without) == (gravity == HANGING)


def test_a_push_counts_and_so_do_the_swings_of_unsound_gains() -> None:
    sound = peak()[1]
    assert peak("hw-run.push={force: 4, start: 1.5}")[1] > 1.2 * sound
    assert peak("hw-run.controllers=[{controller: pd-ff, gains: {Kp: 900, Kd: 0.0}}]")[1] > 2.0 * sound


@pytest.mark.parametrize(
    ("needed", "changes", "limit"),
    [
        (9.0, (), 18.0), (9.0, ("hw-run.tension_factor=3",), 27.0), (2.0, (), LEAST), (40.0, (), 60.0),
        (math.inf, (), 60.0), (9.0, ("hw-run.safety.tension=15",), 15.0), (40.0, ("wrist.tension_limit=50",), 50.0),
    ],
)  # fmt: skip
def test_a_limit_is_so_many_times_what_trials_need_and_never_above_what_tendons_and_wrist_bear(
    needed: float, changes: tuple[str, ...], limit: float
) -> None:
    study = wristctl.load_study(None, SHORT, *changes)
    changed = limited(study, needed)
    assert changed.hw_run.safety.tension == limit
    assert changed.hw_run.safety.model_copy(update={"tension": 60.0}) == study.hw_run.safety.model_copy(
        update={"tension": 60.0}
    )


@pytest.mark.parametrize("turn", [1.5, 4.0])
@pytest.mark.parametrize(("rate", "delay_frames", "unseen"), [(60.0, 2.0, 0.062), (30.0, 1.0, 0.0787)])
def test_what_a_spool_reels_in_unseen_is_the_way_of_the_motion_in_that_time(
    turn: float, rate: float, delay_frames: float, unseen: float
) -> None:
    """Of a dart-thrower through angle A at 5 deg off a pair of tendons: 2 r A cos 5 sin(pi t/turn), and the ramp's."""
    path = {"kind": "dart-thrower", "angle_deg": 30.0, "turn": turn}
    settings = HwRunSettings.model_validate(
        {"planes": 2, "reference": path, "horizon": 1.5 * turn,
         "sensor": {"frame_rate": rate, "delay_frames": delay_frames}}
    )  # fmt: skip
    assert unseen_time(settings) == pytest.approx(unseen, abs=1e-4)
    motors, largest = settings.actuator, WRIST.tendon_radius * math.radians(30.0) * math.cos(math.radians(5.0))
    ticks = math.ceil(unseen / settings.control_period) * settings.control_period
    fastest = 2.0 * math.pi / turn * largest
    way = 2.0 * largest * math.sin(math.pi * ticks / turn) + fastest**2 / (2.0 * motors.ramp * motors.step_length)
    assert reeled_unseen(settings, WRIST) == pytest.approx(way, rel=0.02)


def test_a_slower_motion_a_lower_current_or_a_lower_limit_lets_a_held_wrist_be_pulled_less() -> None:
    settings = HwRunSettings.model_validate({"safety": {"motor_pull": 100.0, "tension": 35.0}})
    assert held_pull(settings, 2.5e-3) == pytest.approx(35.0 + 20e3 * 2.5e-3)
    assert held_pull(settings, 1.0e-3) == pytest.approx(55.0)
    weak, strict = (
        settings.model_copy(update={"safety": settings.safety.model_copy(update=each)})
        for each in ({"motor_pull": 42.0}, {"tension": 18.0})
    )
    assert held_pull(weak, 2.5e-3) == 42.0 and held_pull(strict, 1.0e-3) == pytest.approx(38.0)
    assert borne(strict) == 60.0, "a smaller limit is where motors stop"
    stronger = settings.model_copy(update={"safety": settings.safety.model_copy(update={"tension": 80.0})})
    assert borne(stronger) == 80.0


@pytest.mark.parametrize(
    ("changes", "pull"),
    [((), 100), (("hw-run.reference.turn=5", "hw-run.horizon=6"), None),
     (("hw-run.reference.turn=5", "hw-run.horizon=6", "hw-run.safety.tension=10"), None),
     (("hw-run.safety.motor_pull=42",), 42)],
)  # fmt: skip
def test_motors_that_may_pull_more_than_tendons_bear_do_not_move_real_ones_unless_told_to(
    changes: tuple[str, ...], pull: int | None, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """It is said before the port is opened."""
    begun: list[str] = []
    monkeypatch.setattr("wristctl.commands.hw_run.trials.perform_trials", lambda *given: _begin(begun))
    thrown = "hw-run={planes: 2, reference: {kind: dart-thrower, turn: 1.5}, push: {force: 0}, horizon: 2.0}"
    study = wristctl.load_study(None, thrown, "hw-run.safety.motor_pull=100", "hw-run.port=/nowhere", *changes)
    for flags in ({"yes"}, {"yes", "force"}):
        operator = TerminalOperator(Terminal(stderr=True), True, frozenset(flags))
        with pytest.raises(UserError) as stopped:
            hw_run(Session(study, Inputs(), Findings(study.seed, None), watched(None), operator))
        said = " ".join(capsys.readouterr().err.split())
        if changes or "force" in flags:
            assert begun.pop() == "begun" and ("beyond the 60 N that tendons are to bear" in said) == (not changes)
            assert f"may pull a tendon with about {pull or ''}" in said
        else:
            assert not begun and stopped.value.exit_code == 3 and "60 % of their current" in str(stopped.value.fix)
            assert "may pull a tendon with about 100 N, beyond the 60 N" in stopped.value.what


@pytest.mark.parametrize(
    ("changes", "refused"),
    [((), True), (("hw-run.safety.motor_pull=60",), False), (("hw-run.reference.angle_deg=12",), False)],
)
def test_a_motion_that_needs_more_than_motors_are_asked_for_moves_real_ones_only_where_it_is_forced(
    changes: tuple[str, ...], refused: bool, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """A wrist of 3.2 N m/rad needs some 38 N for 20 deg; of motors that pull 42 N four fifths are asked."""
    begun: list[str] = []
    monkeypatch.setattr("wristctl.commands.hw_run.trials.perform_trials", lambda *given: _begin(begun))
    stiff = "hw-run={reference: {angle_deg: 20}, push: {force: 0}, directions: [extension], horizon: 2.0}"
    for port in ("null", "/nowhere"):
        study = wristctl.load_study(None, "wrist.stiffness=3.2", stiff, f"hw-run.port={port}", *changes)
        for flags in ({"yes"}, {"yes", "force"}):
            operator = TerminalOperator(Terminal(stderr=True), True, frozenset(flags))
            with pytest.raises(UserError) as stopped:
                hw_run(Session(study, Inputs(), Findings(study.seed, None), watched(None), operator))
            said = " ".join(capsys.readouterr().err.split())
            if refused and port != "null" and "force" not in flags:
                assert not begun and stopped.value.exit_code == 3
                assert re.search(
                    r"trials need \d+ N, and of motors that pull 42 N no more than 34 N", stopped.value.what
                )
            else:
                assert begun.pop() == "begun" and ("motors slip" in said) == refused


def _begin(begun: list[str]) -> None:
    begun.append("begun")
    raise UserError("so far")


@pytest.mark.parametrize("taken", [0.25, 0.5])
@pytest.mark.parametrize("declared", [False, True])
def test_a_load_that_nobody_declared_ends_as_such_and_a_declared_one_is_carried(
    experiment: Run, declared: bool, taken: float
) -> None:
    """An upright wrist that holds it sags once its tendons let it, which they do not for 0.6 mm.

    Half a kilogram does so at once, of 0.25 kg it still falls while tendons are let out on one side.
    """
    happens: dict[str, Any] = {"kind": "payload-taken", "size": taken, "at": 0.1}
    motors = {"slack": (0.0, 0.0, 0.0, 0.0)}
    done = experiment(
        payload=taken if declared else 0.0, horizon=0.6,
        bench={"motors": motors, "person": {"takes": 0.0}, "faults": (happens,)},
    )  # fmt: skip
    assert ("ok" if declared else "more load than declared") in done.experiment.outcomes[0]
    assert (done.error is None) == declared


@pytest.mark.parametrize("away", [4e-3, -4e-3, math.nan])
def test_a_wrist_that_tendons_bring_back_carries_no_load_and_one_that_goes_on_does(away: float) -> None:
    bent = Bend(6e-3, away)
    for times, goes_on in ((0.0, False), (0.4, False), (-2.0, False), (0.6, True), (3.0, True)):
        assert _goes_on(bent, Bend(times * 6e-3, times * away)) == goes_on
    assert not _goes_on(Bend(6e-3, 0.0), Bend(0.0, 9e-3)), "aside of where it bent"


@pytest.mark.parametrize("planes", [1, 2])
@pytest.mark.parametrize("believed", [20e3, 40e3])
def test_steps_per_radian_tell_tendons_that_are_softer_than_believed_and_never_softer_than_they_are(
    planes: int, believed: float
) -> None:
    """But for 1.5 % of a rigid tendon's path; tendons that are stiffer stay as believed."""
    settings = settings_of(planes=planes, actuator={"level": "tendon", "tendon_stiffness": believed})
    moves = ExpectedMoves(settings, WRIST, "ulnar" if planes == 1 else "")
    for true in (5e3, 6e3, 9e3, 15e3, believed, 80e3):
        told = moves.tendon_stiffness([moves.steps(true)] * 4)
        assert min(true, believed) <= told <= believed
        if true <= 6e3:
            assert told < 1.7 * true, "the limit of tension is then at most twice as near"
        longer = moves.tendon_stiffness([moves.steps(true) + 0.015 * moves.steps(math.inf)] * 4)
        assert longer == pytest.approx(max(5e3, min(true, believed)), rel=1e-6)
