"""Hands on an emulated wrist, and the tables of largest pulls and of sound rigs."""

from __future__ import annotations

import math
from functools import partial

import numpy as np
import pytest

from tests.bench.conftest import TAUT
from tests.trial import hands, largest_pulls, sound_rigs
from tests.trial.conftest import WRIST
from tests.trial.fault_runs import forked, over
from tests.trial.largest_pulls import CASES, CURRENTS, LOADS, MOST, TRIED, Case, Load
from tests.trial.single_trials import Ended, performed
from wristctl.bench.virtual_bench import VirtualBench
from wristctl.config.bench import BenchSettings, WeakenedPlant
from wristctl.config.camera import Markers
from wristctl.config.hw_run import HwRunSettings
from wristctl.config.plant import Disturbances
from wristctl.trial.resting import sag_of

SLACK = BenchSettings(plant=WeakenedPlant(stiffness_scale=1.0), motors=TAUT.model_copy(update={"slack": (0.02,) * 4}))
STOPPED = Ended("stopped: tension of about 22 N", "", 0.2, 36.0, 0.05, "more load than declared (hw-run.payload)", 18.0)


def bend_under(load: float, grip: hands.Grip | None, planes: int) -> np.ndarray:
    """Where a wrist without taut tendons comes to rest under this force [N], with a hand on it or none (P,)."""
    bench = VirtualBench(SLACK, WRIST, 0, Markers(), Markers(base=2, tip=3) if planes == 2 else None)
    if grip is not None:
        hands.lay_hand_on(bench, grip, 0.0)
    bench.begin(0.0)
    bench.transport.wait(0.2)
    bench.disturb(Disturbances(load=load, toward_deg=30.0 if planes == 2 else 0.0), 0.2)
    bench.transport.wait(8.0)
    return np.atleast_1d(bench.truth().angle[-1])


@pytest.mark.slow
@pytest.mark.parametrize("planes", [1, 2])
@pytest.mark.parametrize("load", [0.1, -0.1])
def test_a_hand_that_holds_a_wrist_is_a_spring_beside_the_wrists_own(planes: int, load: float) -> None:
    """One newton a radian more at the last disc: d = F/(K/l + k), which is what F/d without it has and k."""
    alone, held = (bend_under(load, grip, planes) for grip in (None, hands.holding(2.0)))
    assert np.linalg.norm(held) == pytest.approx(1.0 / (1.0 / np.linalg.norm(alone) + 2.0 / abs(load)), rel=2e-3)
    assert alone @ held == pytest.approx(float(np.linalg.norm(alone) * np.linalg.norm(held)), rel=1e-4), "one direction"


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_an_edge_pushes_one_way_and_only_beyond_where_it_stands(sign: float) -> None:
    grip, still = hands.edge(0.05, 300.0), np.zeros(1)
    place = partial(np.full, 1)
    assert grip(place(sign * 0.2), still) == 0.0 == grip(place(sign * 0.25), still) == grip(place(sign * 0.1), still)
    assert grip(place(sign * 0.27), still) == pytest.approx(-sign * 6.0)


def test_a_hand_is_no_stronger_than_a_hand() -> None:
    grip = hands.holding(250.0)
    assert grip(np.zeros(2), np.zeros(2)) == pytest.approx([0.0, 0.0])
    assert grip(np.array([1.0, -1.0]), np.zeros(2)) == pytest.approx([-80.0, 80.0])


def test_every_fault_of_one_motor_comes_on_each_axis_and_each_pair_is_exchanged_once() -> None:
    alone = {case for case in CASES if case.name in largest_pulls.OF_ONE_MOTOR}
    assert {case.axes for case in alone} == {(axis,) for axis in range(4)}
    assert len(alone) == 4 * len(largest_pulls.OF_ONE_MOTOR)
    assert len({case.axes for case in CASES if len(case.axes) == 2}) == 6
    assert len({case.named for case in CASES}) == len(CASES) == len(set(CASES))
    settings = [HwRunSettings.model_validate(over(TRIED["ulnar"][0], each)) for each in CURRENTS.values()]
    holds = [each.bench.motors.holding_torque / each.bench.actuator.pulley_radius for each in settings]
    assert holds == pytest.approx([each.safety.motor_pull for each in settings], rel=0.02), "said as it is"
    assert sorted({HwRunSettings.model_validate(each).planes for each, _ in TRIED.values()}) == [1, 2]


def test_a_pull_beyond_the_bound_a_hard_median_and_a_load_that_nobody_names_miss_and_are_shown() -> None:
    case = Case("motor stalls", (2,))
    hard = {(case, "2.4 A", "ulnar"): STOPPED._replace(pull=MOST + 1.0), (case, "1.0 A", "ulnar"): STOPPED}
    loads = {(Load("upright", False), "1.0 A", "ulnar"): STOPPED, (Load("upright", True), "1.0 A", "ulnar"): STOPPED}
    missed = largest_pulls.wrong(hard, loads)
    assert [each.partition(":")[0] for each in missed] == [
        "motor stalls 2, 2.4 A, ulnar", "Load(wrist='upright', declared=True), 1.0 A, ulnar", "the median at 1.0 A"
    ]  # fmt: skip
    text = largest_pulls.page(hard, loads)
    assert "| motor stalls | 2 | 36, 0.20 s |  |  |  |  | **56**, 0.20 s |" in text
    assert "2 trials" in text and f"; {len(CASES) * 10 - 2} more trials are to be made" in " ".join(text.split())
    hanging, silent = (Load("hanging", False), "1.0 A", "ulnar"), STOPPED._replace(outcome="ok", fix="", pull=17.0)
    assert not largest_pulls.wrong({}, {hanging: silent})
    assert largest_pulls.wrong({}, {hanging: silent._replace(pull=19.0)})
    assert largest_pulls.wrong({}, {(Load("upright", False), *hanging[1:]): silent})
    light = {each: ended._replace(pull=20.0) for each, ended in hard.items()}
    assert not largest_pulls.wrong(light, {(LOADS[0], "1.0 A", "ulnar"): STOPPED._replace(outcome="ok")})


@pytest.mark.slow
def test_a_held_hand_and_a_reversed_motor_pull_less_at_the_higher_current_than_tendons_bear() -> None:
    settings, at = TRIED["ulnar"]
    cases = [Case("a hand that holds hard for 1 s"), Case("direction reversed", (0,))]
    run = partial(performed, over(settings, CURRENTS["2.4 A"]), at=at)
    ends = forked(run, [each.change(at) for each in cases], "first trial", at)
    assert all(ended.outcome.startswith("stopped") and ended.after < 0.3 for ended in ends.values())
    assert all(1.5 * ended.limit < ended.pull < MOST for ended in ends.values()), "and more than a sound trial"


def test_sound_rigs_are_drawn_alike_again_stand_and_are_of_every_kind() -> None:
    rigs = [sound_rigs.drawn(number) for number in range(60)]
    assert rigs[7] == sound_rigs.drawn(7) and rigs[7] != rigs[8]
    for rig in rigs:
        settings = HwRunSettings.model_validate(rig.settings)
        weakened = settings.bench.plant.stiffness_scale * rig.wrist.stiffness
        assert math.isfinite(sag_of(rig.wrist.model_copy(update={"stiffness": weakened}), "ulnar"))
        assert settings.push.force * rig.wrist.length == pytest.approx(2.0 * WRIST.length)
    kinds = {(rig.settings.get("planes", 1), "payload" in rig.settings, rig.wrist == WRIST) for rig in rigs}
    assert len(kinds) >= 7
    assert {rig.settings["controllers"][0]["controller"] for rig in rigs} == set(sound_rigs.LAWS)


def test_the_page_of_sound_rigs_counts_those_that_were_stopped() -> None:
    sound = Ended("ok", "", math.nan, 9.0, 0.01, "", 18.0)
    text = sound_rigs.page({2: sound, 3: STOPPED})
    assert "2 sound rigs were drawn, homed and tried once; stopped: 1" in " ".join(text.split())
    rows = [row for row in text.splitlines() if row.startswith(("| 2 |", "| 3 |"))]
    assert len(rows) == 2 and rows[0].endswith("| 18 | 9 | 0.6 | ok |") and "tension of about 22 N" in rows[1]
