"""Millimetres typed for metres are asked about, and what is meant goes on."""

from __future__ import annotations

import pytest

from wristctl.errors import UserError
from wristctl.study_files.error_messages import check_sizes
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
    "wrist.tendons=[{angle_deg: 0}, {angle_deg: 120, radius: 13}, {angle_deg: 240}]": "did you mean 0.013?",
    "wrist.length=1e6": "is that meant?",
}


@pytest.mark.parametrize("given", ASKED)
def test_a_length_that_was_hardly_meant_in_metres_is_asked_about(given: str) -> None:
    with pytest.raises(UserError, match="give it in metres, or go on with --force") as refused:
        check_sizes(*read_study([], [given]))
    assert ASKED[given] in refused.value.what
    assert given.partition("=")[0] in str(refused.value) and refused.value.exit_code == 2


@pytest.mark.parametrize(
    "given", ["wrist.length=0.3", "simulate.loop.plant.tendon_radius=x1.05", "wrist.stiffness=80", "seed=7"]
)
def test_what_may_be_meant_is_not(given: str) -> None:
    check_sizes(*read_study([], [given]))


SIZES = {
    "wrist.stiffness": (1e-3, 1e3),
    "wrist.tension_limit": (0.1, 1e4),
    "simulate.loop.disturbances.load": (None, 1e3),
    "simulate.loop.disturbances.push.force": (None, 1e3),
    "hw-run.safety.load": (None, 1e3),
}
"""The least and the largest of each that goes on without a question; None: as little as one likes."""


@pytest.mark.parametrize("key", SIZES)
def test_a_size_by_far_out_of_the_usual_is_asked_about_and_the_last_one_within_is_not(key: str) -> None:
    least, most = SIZES[key]
    slack, unit = "wrist.pretension=0.01", "N m" if key.endswith("safety.load") else "N"
    for within in (most, 1e-6 if least is None else least):
        check_sizes(*read_study([], [slack, f"{key}={within}"]))
    for beyond in (1.01 * most, *([] if least is None else [0.99 * least])):
        with pytest.raises(UserError, match=f"{beyond:g} {unit}.* is not between") as refused:
            check_sizes(*read_study([], [slack, f"{key}={beyond}"]))
        assert f"{most:g}" in refused.value.what and key in str(refused.value) and "--force" in refused.value.fix


def test_a_force_to_the_other_side_is_as_large_and_none_is_no_size() -> None:
    key = "simulate.loop.disturbances.push.force"
    check_sizes(*read_study([], [f"{key}=-1000"]))
    check_sizes(*read_study([], [f"{key}=0"]))
    with pytest.raises(UserError, match="-1010 N is not between"):
        check_sizes(*read_study([], [f"{key}=-1010"]))
    with pytest.raises(UserError, match="give it in metres"):
        check_sizes(*read_study([], ["wrist.length=80"]))
