"""A fault is on from its moment in the trial for as long as it lasts."""

from __future__ import annotations

import math

import pytest

from wristctl.bench.faults import Faults
from wristctl.config.bench import InjectedFault


def faults() -> Faults:
    made = Faults(
        [
            InjectedFault(kind="port-lost", at=1.0),
            InjectedFault(kind="host-silent", at=0.5, duration=0.25),
            InjectedFault(kind="host-silent", at=0.625, duration=0.5),
        ]
    )
    made.begin(10.0)
    return made


@pytest.mark.parametrize(("time", "on"), [(10.49, False), (10.5, True), (10.75, True), (11.124, True), (11.125, False)])
def test_it_is_on_between_its_begin_and_its_end(time: float, on: bool) -> None:
    assert faults().on("host-silent", time) == on


def test_without_a_duration_it_is_for_good() -> None:
    assert not faults().on("port-lost", 10.999) and faults().on("port-lost", 11.0) and faults().on("port-lost", 1e6)


def test_the_earliest_of_those_that_are_on_says_since_when() -> None:
    assert faults().since("host-silent", 10.7) == 10.5 and faults().since("host-silent", 10.8) == 10.625
    assert faults().since("host-silent", 12.0) is None


def test_the_next_one_is_the_earliest_that_begins_later() -> None:
    assert faults().next("host-silent", 10.0) == 10.5 and faults().next("host-silent", 10.5) == 10.625
    assert faults().next("host-silent", 10.7) == math.inf and faults().next("board-reset", 0.0) == math.inf


def test_of_several_trials_a_fault_is_in_each_or_in_the_first_alone() -> None:
    each, first = InjectedFault(kind="port-lost", at=1.0), InjectedFault(kind="port-lost", at=1.0, since="first trial")
    powered = InjectedFault(kind="port-lost", at=1.0, since="power-on")
    schedule = Faults([each, first, powered])
    begins = []
    for start in (10.0, 20.0, 30.0):
        schedule.begin(start)
        begins.append([schedule.begun(fault) for fault in (each, first, powered)])
    assert begins == [[11.0, 11.0, 1.0], [21.0, 11.0, 1.0], [31.0, 11.0, 1.0]]


def test_before_a_trial_begins_none_is_on_and_none_is_next() -> None:
    idle = Faults([InjectedFault(kind="port-lost", at=0.0)])
    assert not idle.on("port-lost", 1e9) and idle.next("port-lost", 0.0) == math.inf
