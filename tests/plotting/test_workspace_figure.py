"""Where the tip can rest is what loops come to rest at."""

from __future__ import annotations

import numpy as np
import pytest

import wristctl
from wristctl.commands.gen_data.figures import rest_poses, workspace
from wristctl.config.wrist import WristParameters

WRIST = WristParameters()
PULLS = np.linspace(WRIST.pretension, WRIST.tension_limit, 7)


def test_the_other_side_is_the_mirror_image_and_more_tension_or_softer_springs_bend_more() -> None:
    bent = rest_poses(WRIST, PULLS).sum(axis=1)
    assert rest_poses(WRIST, -PULLS).sum(axis=1) == pytest.approx(-bent, abs=1e-9)
    assert bent[0] == pytest.approx(0.0, abs=1e-9) and (np.diff(bent) > 0.0).all()
    softer = WRIST.model_copy(update={"stiffness": 0.7 * WRIST.stiffness})
    assert (rest_poses(softer, PULLS).sum(axis=1)[1:] > bent[1:]).all()


def test_a_loop_that_holds_30_degrees_pulls_as_much_as_is_drawn() -> None:
    study = wristctl.load_study(
        None, "simulate.controller=pid-ff", "simulate.gains=default", "simulate.reference.angle_deg=30",
        "simulate.horizon=4", "simulate.loop.plant_segments=4",
    )  # fmt: skip
    last = wristctl.simulate(study).frame().iloc[-1]
    assert np.degrees(last["theta"]) == pytest.approx(30.0, abs=0.05)
    pulled = max(last["tension_plus"], last["tension_minus"])
    (held,) = rest_poses(WRIST, np.array([pulled]))
    assert np.degrees(held.sum()) == pytest.approx(30.0, abs=0.2)


@pytest.mark.parametrize(("factor", "told"), [(0.5, "from "), (0.02, "nowhere: it buckles within 60 N")])
@pytest.mark.slow
def test_a_wrist_that_buckles_is_drawn_as_far_as_it_stands(factor: float, told: str) -> None:
    soft = WRIST.model_copy(update={"stiffness": factor * WRIST.stiffness})
    assert np.isnan(rest_poses(soft, PULLS)).any()
    (shape, _) = workspace(soft).axes
    assert f"the tip rests {told}" in shape.get_title(loc="left")


def test_the_figure_says_how_far_within_which_tension() -> None:
    (shape, curve) = workspace(WRIST).axes
    reach = np.degrees(rest_poses(WRIST, PULLS[-1:]).sum())
    assert shape.get_title(loc="left") == f"the tip rests from {-reach:.3g} to {reach:.3g} deg within 60 N"
    assert np.asarray(curve.lines[1].get_ydata())[-1] == pytest.approx(reach)
