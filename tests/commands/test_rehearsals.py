"""Finalists of a recommendation on the emulated rig: who is taken, who is out, and which wrist no rig can home."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import wristctl
from wristctl.commands.adoption import with_planes
from wristctl.commands.inputs import Inputs
from wristctl.commands.recommend.answer import Recommended
from wristctl.commands.recommend.command import plan
from wristctl.commands.recommend.expected import Candidate
from wristctl.commands.recommend.rehearsals import (
    Rehearsal,
    _asked,
    _circling,
    _scales,
    check_homing,
    motions_of_trial,
)
from wristctl.commands.results import Findings
from wristctl.errors import UserError
from wristctl.trial.rehearsed import Rehearsed, rehearse


def rehearsal(
    weak: float, strong: float, swing_deg: float = 0.05, outcome: str = "ok", around: tuple[float, ...] = ()
) -> Rehearsal:
    """One with these errors with weak springs and strong ones, and while the hand circles [deg]; stopped where nan."""
    of = {0.7: (weak, outcome), 1.0: (strong, "ok")}
    circles = {
        scale: Rehearsed("rate" if math.isnan(error) else "ok", math.radians(error), 0.0)
        for scale, error in zip(of, around, strict=False)
    }
    return Rehearsal(
        {scale: Rehearsed(end, math.radians(error), math.radians(swing_deg)) for scale, (error, end) in of.items()},
        circles,
    )


def test_what_swings_or_is_stopped_in_its_rehearsal_is_out_and_says_with_which_springs() -> None:
    assert rehearsal(0.1, 0.1).fault == ""
    assert rehearsal(0.1, 0.1, swing_deg=0.19).fault == ""
    assert "swings by 0.21 deg peak to peak with springs x0.7" in rehearsal(0.1, 0.1, swing_deg=0.21).fault
    assert "stopped on circumduction with springs x1 (rate)" in rehearsal(0.1, 0.1, around=(0.1, math.nan)).fault
    stopped = rehearsal(math.nan, 0.1, outcome="rate 11.0 rad/s beyond +-10 rad/s; likely gains")
    assert stopped.fault == "is stopped with springs x0.7 (rate 11.0 rad/s beyond +-10 rad/s)"


@pytest.mark.parametrize(
    ("runs", "best"),
    [
        ({}, 0),
        ({0: rehearsal(0.1, 0.1), 1: rehearsal(0.09, 0.09)}, 0),  # the first, if it errs hardly more
        ({0: rehearsal(0.2, 0.1), 1: rehearsal(0.1, 0.1)}, 1),
        ({0: rehearsal(0.13, 1.0), 1: rehearsal(0.1, 1.0)}, 1),  # with weak springs, though both are far off else
        ({0: rehearsal(1.0, 0.13), 1: rehearsal(1.0, 0.1)}, 1),
        ({0: rehearsal(0.1, 0.14), 1: rehearsal(0.15, 0.1)}, 0),  # each errs more somewhere, and the first least so
        ({0: rehearsal(0.1, 0.16), 1: rehearsal(0.15, 0.1)}, 1),
        ({0: rehearsal(0.1, 0.1, around=(0.3, 0.1)), 1: rehearsal(0.1, 0.1, around=(0.2, 0.1))}, 1),
        ({0: rehearsal(0.1, 0.1, around=(math.nan, 0.1)), 1: rehearsal(0.3, 0.3, around=(0.2, 0.1))}, 1),
        ({0: rehearsal(0.1, 0.1, swing_deg=0.5), 1: rehearsal(0.3, 0.3)}, 1),
        ({0: rehearsal(0.1, 0.1, swing_deg=0.5), 1: rehearsal(0.3, 0.3, swing_deg=3.0)}, None),
    ],
)
def test_of_those_near_the_best_the_first_is_taken_that_is_sound_and_near_the_least_on_the_emulated_rig(
    runs: dict[int, Rehearsal], best: int | None
) -> None:
    share = SimpleNamespace(times=0)
    standing = SimpleNamespace(groups=[[0, 1, 2], [3]], lost=[share] * 4, group=lambda row: 1 if row < 3 else 2)
    ranking: Any = SimpleNamespace(standing=standing, means=[SimpleNamespace(value=v) for v in (1.0, 1.1, 1.2, 9.0)])
    candidates = [Candidate(name, "tuned", dict.fromkeys("ab"[: k + 1], 1.0)) for k, name in enumerate(("a", "b"))]
    candidates += [Candidate("c", "tuned", dict.fromkeys("abc", 1.0)), Candidate("feedforward", "", {})]
    result = Recommended(
        wristctl.load_study(None), Findings(0), [], 30.0, candidates, ranking, {}, [], [], "", rehearsals=runs
    )
    assert result.near == [0, 1, 2] and result.best_row == best
    assert result.untried == [row for row in (0, 1, 2) if row not in runs]
    assert best is not None or result.fault is not None
    circling = (0.01, 0.01) if any(run.around for run in runs.values()) else ()
    assert replace(result, rehearsals={**runs, 2: rehearsal(0.01, 0.01, around=circling)}).best_row == 2


@pytest.mark.parametrize(
    ("hand", "gravity", "name"),
    [
        (0.4, "[-9.81, 0.0]", ""), (0.45, "[-9.81, 0.0]", "buckles"), (0.6, "[-9.81, 0.0]", "buckles"),
        (0.6, "[9.81, 0.0]", ""), (0.3, "[0.0, 9.81]", "sags"),
    ],
)  # fmt: skip
def test_a_wrist_that_no_rig_can_home_is_refused_by_that_name_before_any_search(
    hand: float, gravity: str, name: str
) -> None:
    """An upright one whose springs, weakened to 0.7, hold the hand by less than a fifth; and one that sags."""
    study = wristctl.load_study(None, f"wrist.hand_mass={hand}", f"wrist.gravity={gravity}")
    if not name:
        check_homing(study, 1)
        return
    with pytest.raises(UserError, match=name):
        check_homing(study, 1)
    with pytest.raises(UserError):
        plan(study, Inputs({}))
    check_homing(wristctl.load_study(None, f"wrist.hand_mass={hand}", "recommend.loop.sensor.level=ideal"), 1)


def test_springs_that_were_measured_are_not_taken_to_weaken() -> None:
    """Upright, springs of 0.44 N m/rad hold the hand, those of 0.7 times as much do not."""
    believed = wristctl.load_study(None, "wrist.stiffness=0.44")
    with pytest.raises(UserError, match="weaken to"):
        check_homing(believed, 1)
    measured = believed.model_copy(update={"recommend": believed.recommend.measured()})
    check_homing(measured, 1)
    assert _scales(believed) == [0.7, 1.0] and _scales(measured) == [1.0]
    wide = wristctl.load_study(None, "recommend.draw={plant.stiffness: x0.5..2}").recommend
    assert wide.measured() == wide, "what somebody says stays"


def lost_on(*counts: int) -> Any:
    """A ranking of candidates that swing on so many of 200 rigs, the first rigs, and feedforward that never does."""
    every = [*counts, 0]
    standing = SimpleNamespace(
        groups=[[*range(len(counts))], [len(counts)]], lost=[SimpleNamespace(times=count) for count in every],
        group=lambda row: 1 if row < len(counts) else 2,
    )  # fmt: skip
    rows = [SimpleNamespace(swings=np.arange(200) < count, rmse=np.ones(200)) for count in every]
    means = [*[SimpleNamespace(value=1.0)] * len(counts), SimpleNamespace(value=9.0)]
    return SimpleNamespace(standing=standing, rows=rows, means=means)


@pytest.mark.parametrize(("counts", "first"), [((7, 7), 1), ((7, 8), 1), ((7, 11), 1), ((7, 12), 0), ((20, 7), 1)])
def test_the_fewest_gains_are_taken_where_no_test_tells_which_is_lost_on_fewer_rigs(
    counts: tuple[int, int], first: int
) -> None:
    """Rigs on which one of both is lost are heads or tails: four more are chance in one of 16, five in one of 32."""
    gains = ({"a": 1.0, "b": 1.0}, {"a": 1.0})
    candidates = [Candidate(str(k), "tuned", one) for k, one in enumerate(gains)] + [Candidate("feedforward", "", {})]
    ranking = lost_on(*counts)
    result = Recommended(wristctl.load_study(None), Findings(0), [], 30.0, candidates, ranking, {}, [], [], "")
    assert result.near[0] == result.best_row == first and sorted(result.near) == [0, 1]


def test_a_rehearsal_goes_to_both_sides_and_simulated_rigs_are_asked_for_the_same() -> None:
    study = wristctl.load_study(None)
    assert _asked(study, [], 20.0, 1, 1.0).directions == ("ulnar", "radial")
    motions, horizon = motions_of_trial(study, 20.0, 1)
    assert [one.end_deg for one in motions] == [20.0, -20.0] and horizon == study.hw_run.horizon
    assert _asked(study, [], 20.0, 2, 1.0).directions == ("ulnar-flexion", "radial-extension")
    motions, _ = motions_of_trial(study, 20.0, 2)
    assert [(one.value("toward_deg"), one.end_deg) for one in motions] == [(45.0, 20.0), (225.0, 20.0)]
    assert _circling(motions[0]).end_deg == 20.0


def test_the_motion_of_ones_own_study_is_rehearsed_where_it_says_one() -> None:
    study = wristctl.load_study(None, "hw-run.directions=[radial]", "hw-run.reference.angle_deg=12")
    motions, _ = motions_of_trial(study, 20.0, 1)
    assert [one.end_deg for one in motions] == [-12.0] and _asked(study, [], 20.0, 1, 1.0).directions == ("radial",)
    path = wristctl.load_study(None, "hw-run={planes: 2, reference: {kind: circle, angle_deg: 12}}")
    motions, _ = motions_of_trial(path, 20.0, 2)
    assert [one.kind for one in motions] == ["circle"], "which has its own direction"


@pytest.mark.slow
def test_a_controller_that_swings_is_found_and_ends_nobody_elses_rehearsal() -> None:
    rows = "[{controller: ct-dob, gains: {w: 190, zeta: 0.6, wo: 1600}}, {controller: pid-ff, gains: hardware}]"
    study = wristctl.load_study(
        None,
        f"hw-run={{controllers: {rows}, directions: [ulnar], push: {{force: 0}}, horizon: 3.0, back: 0.3, rest: 0.1, "
        "reference: {angle_deg: 10, duration: 0.6}, bench: {person: {takes: 0}}, "
        "homing: {frames: 2, rest: 0.1, let_go: 0.6}}",
    )
    swinging, sound = rehearse(study)
    assert swinging.outcome != "ok" or swinging.swing > math.radians(1.0)
    assert sound.outcome == "ok" and sound.swing < math.radians(0.2) and 0.0 < sound.rmse < math.radians(0.3)


@pytest.mark.slow
def test_three_tendons_are_rehearsed_as_the_board_winds_them() -> None:
    study = wristctl.load_study(
        None,
        "hw-run={controllers: [{controller: pid-ff, gains: hardware}], directions: [flexion], push: {force: 0}, "
        "horizon: 3.0, back: 0.3, rest: 0.1, reference: {angle_deg: 10, duration: 0.6}, bench: {person: {takes: 0}}, "
        "homing: {frames: 2, rest: 0.1, let_go: 0.6}}",
        "wrist.tendons=three",
    )
    (done,) = rehearse(with_planes(study))
    assert done.outcome == "ok" and done.swing < math.radians(0.2) and 0.0 < done.rmse < math.radians(0.3)
