"""Every fault of the table at every phase of an experiment: caught in time, or tolerated and named."""

from __future__ import annotations

import itertools
import os
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

import numpy as np
import pytest

from tests.trial.fault_cases import AT, CASES, EXCEPTED, PHASES, Case, Phase
from tests.trial.fault_judging import Judged, by_phase, table
from tests.trial.fault_runs import fan_out, from_power_on, sound_course
from tests.trial.further_faults import FURTHER, SILENT, page
from tests.trial.further_faults import INJECTED as INJECTED_FURTHER
from tests.trial.further_faults import wrong as wrong_further
from tests.trial.sound_rigs import ended_on
from wristctl.config.bench import InjectedFault

THOROUGH = bool(os.environ.get("WRISTCTL_THOROUGH"))
thorough = pytest.mark.skipif(not THOROUGH, reason="with WRISTCTL_THOROUGH: takes minutes")
WORKERS, PAIRS, RIGS = 2, 300, 100
INJECTED = [case for case in CASES if case.kind]
BUILT = [case for case in CASES if not case.kind]
SAMPLE = ("dirflip2", "detach2", "supply off", "marker slips 5 deg")


def wrong(judged: list[Judged]) -> list[Judged]:
    """Those that did not end as they were to, and are not excepted."""
    return [each for each in judged if not each.right and each.name not in EXCEPTED]


def test_there_are_enough_kinds_and_few_exceptions() -> None:
    assert len(INJECTED) >= 30 and len({case.name for case in CASES}) == len(CASES)
    assert len(EXCEPTED) <= 5 and {each for name in EXCEPTED for each in name.split(" + ")} <= {
        case.name for case in CASES
    }


@pytest.mark.slow
def test_some_faults_in_motion_end_as_they_are_to() -> None:
    judged = fan_out("moving", [[case] for case in CASES if case.name in SAMPLE])
    assert len(judged) == len(SAMPLE)
    assert not wrong(judged), table(judged)
    causes = {each.name: each.said for each in judged}
    assert "axis 2 (tendon 4) turns the wrong way" in causes["dirflip2"]
    assert "the tendon of axis 2 (tendon 4) is off its pulley" in causes["detach2"]
    assert "likely" not in causes["supply off"], "spools that nobody turns pull on paper, before more can be told"
    assert "tension of about" in causes["supply off"]
    assert "the tip's marker has slipped" in causes["marker slips 5 deg"]


@thorough
def test_each_fault_alone_ends_as_it_is_to() -> None:
    """Prints the table of docs/hardware/faults.md."""
    judged = [each for phase in PHASES for each in fan_out(phase, [[case] for case in INJECTED], WORKERS)]
    assert len(judged) == len(PHASES) * len(INJECTED)
    print(f"\n{by_phase(judged)}\n\n{table([each for each in judged if not each.right])}")
    assert not wrong(judged)


@thorough
@pytest.mark.parametrize("phase", ["homing", "moving"])
def test_a_rig_that_is_built_wrong_is_refused_before_it_moves(phase: Phase) -> None:
    """Homed from scratch, and with a calibration that was of the rig as it had been."""
    sound_course(phase)
    with ProcessPoolExecutor(WORKERS, get_context("fork")) as pool:
        judged = list(pool.map(from_power_on, BUILT, itertools.repeat(phase)))
    print(f"\n{table(judged)}")
    assert not wrong(judged)


@thorough
@pytest.mark.parametrize("phase", PHASES)
def test_two_faults_at_once_are_caught(phase: Phase) -> None:
    """Pairs drawn by a seed, as many in each phase."""
    rng = np.random.default_rng(20261123)
    pairs: list[list[Case]] = []
    for number in range(PAIRS):
        one, other = (INJECTED[k] for k in rng.choice(len(INJECTED), 2, replace=False))
        if PHASES[number % len(PHASES)] == phase:
            pairs.append([one, other])
    judged = fan_out(phase, pairs, WORKERS)
    assert len(judged) == len(pairs)
    print(f"\n{table([each for each in judged if not each.right])}\n{len(judged)} pairs")
    assert not [each for each in wrong(judged) if not set(each.name.split(" + ")) & set(EXCEPTED)]


@thorough
def test_no_sound_rig_raises_a_false_alarm() -> None:
    sound_course("homing")
    with ProcessPoolExecutor(WORKERS, get_context("fork")) as pool:
        ended = list(pool.map(ended_on, range(RIGS)))
    alarms = [(number, each) for number, each in enumerate(ended) if each.outcome != "ok"]
    print(f"\n{RIGS - len(alarms)} of {RIGS} sound rigs without a false alarm")
    assert not alarms


def test_further_faults_are_named_once_and_silence_is_judged() -> None:
    """What may end either way is wrong where a pull exceeds the motors', or a wrist that differed is passed over."""
    names = [case.name for case in FURTHER]
    assert len(names) == len(set(names)) >= 40 and set(SILENT) < set(names)
    for case in INJECTED_FURTHER:
        parts = [InjectedFault.model_validate(part) for part in case.faults("moving")]
        assert len(parts) == 1 + len(case.parts) and all(part.at >= AT["moving"] for part in parts)
    sound = Judged("all tendons shorter by 1 mm", "moving", "caught", True, 0.1, 42.0, 0.2, "stopped: pulls")
    assert not wrong_further([sound, sound._replace(end="no effect", said="")])
    ended = [sound._replace(pull=45.0), sound._replace(end="tolerated", said=""), sound._replace(end="tolerated")]
    assert [why for _, why in wrong_further(ended)] == ["45 N", "went through, and said nothing"]
    assert "| all tendons shorter by 1 mm | moving | stopped | 100 | 42 | 0.2 | pulls |" in page([sound])
