"""Wrists with tendons at drawn places, some of which end inside, are simulated, compared and tuned."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st

import wristctl
from wristctl.study_files.load import load_study

pytestmark = pytest.mark.slow


@st.composite
def layouts(draw: st.DrawFn) -> list[dict[str, Any]]:
    """Three to six tendons with gaps below 150 deg, of which those beyond three may end at an inner disc."""
    count = draw(st.integers(3, 6))
    first = draw(st.floats(0.0, 120.0))
    places = []
    for k in range(count):
        angle, radius = first + 360.0 * k / count + draw(st.floats(-12.0, 12.0)), draw(st.floats(0.014, 0.022))
        place: dict[str, Any] = {"angle_deg": round(angle % 360.0, 1), "radius": round(radius, 4)}
        if k % 2 and count == 6:
            place["ends_at"] = draw(st.sampled_from([3, 4, 5]))
        places.append(place)
    return places


LOOP = "{plant_segments: 4}"
MOTIONS = "[{kind: circle, angle_deg: 15, turn: 0.8}, {angle_deg: -20, duration: 0.5}]"


@settings(max_examples=4, deadline=None, derandomize=True, phases=[Phase.generate])
@given(places=layouts())
def test_drawn_places_follow_and_keep_their_limits_in_all_three_commands(places: list[dict[str, Any]]) -> None:
    wrist = f"wrist.tendons={json.dumps(places)}"
    study = load_study([], [wrist, f"simulate.loop={LOOP}", "simulate.horizon=1", "simulate.controller=ct-dob"])
    done = wristctl.simulate(study)
    course = done.trajectory
    assert course.planes == 2 and course.tension.shape[1] == len(places)
    assert done.repeated.arrives and done.metrics["rmse"] < np.deg2rad(0.5)
    known = study.wrist
    assert course.tension.min() >= known.pretension - 1e-9 and course.tension.max() <= known.tension_limit + 1e-9
    rows = "[{controller: ct-dob, gains: default}, {controller: pid-ff, gains: default}]"
    loops = [f"loops={{here: {LOOP}}}", "horizon=1"]
    compared = wristctl.compare(load_study([], [wrist, *(f"compare.{each}" for each in
        (*loops, f"controllers={rows}", f"references={MOTIONS}", "inverses=[none]"))]))  # fmt: skip
    assert (compared.frame()["rmse"] < np.deg2rad(1.0)).all() and not compared.frame()["failed"].any()
    scenario = "scenarios=[{loop: here, reference: {kind: circle, angle_deg: 15, turn: 0.8}}]"
    tuned = wristctl.tune(load_study([], [wrist, *(f"tune.{each}" for each in
        (*loops, scenario, "controllers=[pid-ff]", "iterations=2", "candidates=4"))]))  # fmt: skip
    assert not tuned.marks and tuned.errors["pid-ff"].ratio > 1.0
