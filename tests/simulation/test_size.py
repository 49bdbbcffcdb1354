"""A study that no computer could do is refused before it begins, with the largest that there is room for."""

from __future__ import annotations

import re

import pytest

from wristctl.config.errors import UserError
from wristctl.config.loop import LOOPS, Loop
from wristctl.simulation.size import MOST_BYTES, check_size


@pytest.mark.parametrize(
    ("loop", "horizon", "said"),
    [
        (Loop(), 1e9, "integration steps"),
        (Loop(control_period=1e-12), 5.0, "integration steps"),
        (Loop(substeps=1000, control_period=1e-6), 100.0, "integration steps"),
        (Loop(), 1e5, "GB"),
    ],
)
def test_too_much_is_refused_and_what_is_said_to_fit_does(loop: Loop, horizon: float, said: str) -> None:
    with pytest.raises(UserError, match=said) as caught:
        check_size([Loop(), loop], horizon)
    found = re.search(r"at most ([0-9.e+-]+) s", str(caught.value.fix))
    assert found is not None and 0.0 < float(found[1]) < horizon
    check_size([loop], 0.99 * min(float(found[1]), 1e4))


def test_what_people_do_is_not_refused() -> None:
    check_size([*LOOPS.values(), Loop(control_period=0.01, substeps=100)], 600.0)
    assert 8 * 5_000 * len(LOOPS) < MOST_BYTES
