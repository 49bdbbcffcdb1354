"""Millimetres typed for metres are asked about, and what is meant goes on."""

from __future__ import annotations

import pytest

from wristctl.errors import UserError
from wristctl.study_files.error_messages import check_lengths
from wristctl.study_files.load import read_study

ASKED = {
    "wrist.length=80": "80 m is 1,000 times the usual: did you mean 0.08?",
    "wrist.tendon_radius=2": "2 m is 100 times the usual: did you mean 0.02?",
    "wrist.hand_offset=6": "did you mean 0.06?",
    "simulate.loop.plant.tendon_radius=1.05": "did you mean x1.05?",
    "simulate.loop.plant.tendon_radius=20": "did you mean 0.02?",
    "simulate.loop.actuator.pulley_radius=7.5": "did you mean 0.0075?",
    "hw-run.bench.plant.length=90": "did you mean 0.09?",
    "tune.loops={own: {plant: {length: 79}}}": "did you mean 0.079?",
    "wrist.length=1e6": "is that meant?",
}


@pytest.mark.parametrize("given", ASKED)
def test_a_length_that_was_hardly_meant_in_metres_is_asked_about(given: str) -> None:
    with pytest.raises(UserError, match="give it in metres, or go on with --force") as refused:
        check_lengths(*read_study([], [given]))
    assert ASKED[given] in refused.value.what
    assert given.partition("=")[0].split(".")[-1] in str(refused.value) and refused.value.exit_code == 2


@pytest.mark.parametrize(
    "given", ["wrist.length=0.3", "simulate.loop.plant.tendon_radius=x1.05", "wrist.stiffness=80", "seed=7"]
)
def test_what_may_be_meant_is_not(given: str) -> None:
    check_lengths(*read_study([], [given]))
