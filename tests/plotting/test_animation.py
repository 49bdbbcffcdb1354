"""What the page's animation plays is what a run logged: angles of each segment, 25 pictures a second."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

import wristctl
from wristctl.commands.compare.csv_data import frame, series
from wristctl.comparison.combinations import ComparedRow
from wristctl.config.loop import Loop
from wristctl.config.study import Study
from wristctl.config.wrist import WristParameters
from wristctl.plotting.animation import FRAMES, animation
from wristctl.plotting.page import page
from wristctl.plotting.style import colour
from wristctl.records import Run, start_run
from wristctl.simulation.repetitions import Repeated
from wristctl.simulation.trajectory import Trajectory
from wristctl.wrist.plant import PLANTS

WRIST = WristParameters()
Course = Callable[..., Trajectory]


def single(tmp_path: Path, course: Trajectory, study: Study | None = None) -> dict[str, Any] | None:
    with start_run("simulate", study or Study(), "", tmp_path) as live:
        live.table("data/trajectory.csv", course.columns())
    return animation(Run(live.path))


def fine(course: Course, **changes: Any) -> Trajectory:
    """Four seconds at a millisecond, four segments that bend by 1, 2, 3 and 4 parts of ten."""
    one, time = course("pid/printed"), 1e-3 * np.arange(4001.0)
    theta = 0.5 * np.sin(time)
    columns = {name: np.resize(getattr(one, name), 4001) for name in ("rate", "theta_ref", "torque", "torque_wanted")}
    columns |= {name: np.resize(getattr(one, name), (4001, 2)) for name in ("tip", "tip_desired", "tension")}
    columns |= {"segment_theta": theta[:, None] * [0.1, 0.2, 0.3, 0.4], "theta_desired": 0.1 * time}
    return replace(one, time=time, theta=theta, **columns | changes)


def test_a_loop_is_played_25_pictures_a_second_in_tenths_of_a_milliradian(tmp_path: Path, course: Course) -> None:
    found = single(tmp_path, fine(course))
    assert found is not None
    assert (found["step"], found["duration"]) == pytest.approx((1.0 / FRAMES, 4.0)) and FRAMES == 25.0
    (own,) = found["courses"]
    time = np.arange(101.0) / 25.0
    expected = 1e4 * 0.5 * np.sin(time)[:, None] * [0.1, 0.2, 0.3, 0.4]
    np.testing.assert_allclose(own["theta"], expected, atol=0.51)
    np.testing.assert_allclose(own["wanted"], 1e4 * 0.1 * time, atol=0.51)
    assert own["diverged"] is False and own["group"] == ""


@pytest.mark.slow
def test_a_single_loop_is_named_by_its_controller_and_gains(tmp_path: Path, course: Course) -> None:
    for gains, name in (("printed", "pid/printed"), ("{P4: 1.0, P5: 1.0, P6: 0.1}", "pid/own gains")):
        study = wristctl.load_study(None, f"simulate={{controller: pid, gains: {gains}}}")
        found = single(tmp_path / name.replace("/", "-"), fine(course), study)
        assert found is not None
        assert (found["courses"][0]["name"], found["courses"][0]["colour"]) == (name, colour("pid"))


def test_the_wrist_is_that_of_the_run(tmp_path: Path, course: Course) -> None:
    study = wristctl.load_study(None, "wrist={length: 0.1, discs: 4, tendon_radius: 0.03, hand_offset: 0.05}")
    found = single(tmp_path, fine(course), study)
    assert found is not None
    offset = pytest.approx(0.03 / np.sqrt(2.0))
    sizes = {"length": 0.1, "discs": 4, "offset": offset, "radius": 0.03, "hand": 0.05}
    assert found["wrist"] == sizes | {"gravity": -9.81}


@pytest.mark.parametrize(
    ("gravity", "down"),
    [("gravity=[-9.81, 0]", 1), ("gravity=[9.81, 0]", -1), ("gravity=[0, 9.81]", 0), ("gravity_flexion=1", 0)],
)
def test_gravity_is_shown_where_it_is_along_the_straight_wrist(
    tmp_path: Path, course: Course, browser: Any, gravity: str, down: int
) -> None:
    study = wristctl.load_study(None, f"wrist.{gravity}")
    with start_run("simulate", study, "", tmp_path, page=lambda path, man, _: page(Run(path), man)) as live:
        live.table("data/trajectory.csv", fine(course).columns())
    browser.open(Run(live.path).file("report.html"), 1280, False)
    told = browser.run("return [...document.querySelectorAll('#wrists text')].map(each => each.textContent)")
    assert told == ["gravity"] * abs(down) and browser.console() == []
    arrows = browser.run(
        "return [...document.querySelectorAll(`#wrists path[stroke-width='1'][stroke-linecap='round']`)]"
        ".map(each => each.getAttribute('d').match(/-?[\\d.]+/g).map(Number))"
    )
    assert [np.sign(tip - begin) for _, begin, _, tip, *_ in arrows] == [down] * abs(down)


def test_a_log_coarser_than_the_pictures_is_played_as_it_is(tmp_path: Path, course: Course) -> None:
    one = course("pid/printed")
    slow = replace(one, time=0.1 * np.arange(200.0))
    found = single(tmp_path, slow)
    assert found is not None and found["step"] == pytest.approx(0.1) and len(found["courses"][0]["wanted"]) == 200


@pytest.mark.parametrize("bad", [np.nan, np.pi + 0.01, -np.pi - 0.01])
def test_pictures_end_where_the_wrist_diverged(tmp_path: Path, course: Course, bad: float) -> None:
    one = fine(course)
    segments = one.segment_theta.copy()
    segments[2000:] = bad / 4.0
    found = single(tmp_path, replace(one, segment_theta=segments))
    assert found is not None
    (own,) = found["courses"]
    assert own["diverged"] is True and len(own["theta"]) == 50 and len(own["wanted"]) == 101


def test_a_wrist_bent_by_less_than_half_a_turn_has_not_diverged(tmp_path: Path, course: Course) -> None:
    one = fine(course)
    found = single(tmp_path, replace(one, segment_theta=np.full_like(one.segment_theta, 0.77)))
    assert found is not None and found["courses"][0]["diverged"] is False


@pytest.mark.parametrize("plant", ["pcc", "hinges"])
def test_the_browser_draws_arcs_and_hinged_links_each_to_its_own_tip(
    tmp_path: Path, course: Course, browser: Any, plant: str
) -> None:
    made, study = fine(course), wristctl.load_study(None, f"simulate.loop.plant.model={plant}")
    with start_run("simulate", study, "", tmp_path, page=lambda path, man, _: page(Run(path), man)) as live:
        live.table("data/trajectory.csv", made.columns())
    browser.open(Run(live.path).file("report.html"), 1280, False)
    seek = "const s = document.getElementById('instant'); s.value = 500; s.dispatchEvent(new Event('input'));"
    backbone, discs = browser.run(
        seek + "return ['2.5', '3.5'].map(w => document.querySelector(`#wrists path[stroke-width='${w}']`))"
        ".map(each => each.getAttribute('d').slice(1).split(/[LM]/).map(at => at.split(' ').map(Number)))"
    )
    bent = made.segment_theta[2000]
    x, y = 1e3 * PLANTS[plant].tips(WRIST, bent[None])[0]
    assert backbone[0] == [0, 0] and backbone[-1] == pytest.approx([y, -x], abs=0.02)
    away, there = np.subtract(discs[-1], discs[-2]), bent.sum()
    assert away / np.hypot(*away) == pytest.approx([np.cos(there), np.sin(there)], abs=1e-3)
    assert len(discs) == 2 * WRIST.discs and browser.console() == []


def rods(loop: Loop) -> Loop:
    """The same with a plant whose segments are no arcs."""
    return loop.model_copy(update={"plant": loop.plant.model_copy(update={"model": "rods"})})


def test_a_run_without_courses_and_a_plant_without_arcs_play_nothing(
    tmp_path: Path, course: Course, monkeypatch: pytest.MonkeyPatch
) -> None:
    with start_run("gen-data", Study(), "", tmp_path) as live:
        live.metric("samples", 1.0)
    assert animation(Run(live.path)) is None
    settings = Study().simulate
    bent = Study().model_copy(update={"simulate": settings.model_copy(update={"loop": rods(settings.loop)})})
    monkeypatch.setattr(Run, "config", bent)
    assert single(tmp_path, fine(course)) is None


def compared(tmp_path: Path, results: list[ComparedRow], study: Study) -> dict[str, Any] | None:
    full = {"settling": 1.0, "steady_state": 1e-4}
    done = [
        replace(r, repeated=Repeated.once(replace(r.simulation, metrics=r.simulation.metrics | full))) for r in results
    ]
    with start_run("compare", study, "", tmp_path) as live:
        live.table("data/comparison.csv", frame(done, ()))
        live.arrays("data/trajectories.npz", series(done, every=1))
    return animation(Run(live.path))


def test_courses_of_a_comparison_are_grouped_by_loop_and_reference(
    tmp_path: Path, results: list[ComparedRow], monkeypatch: pytest.MonkeyPatch
) -> None:
    study = wristctl.load_study(None, "compare.loops={four-segments: {}, rods: {}}")
    loops = study.compare.loops | {"rods": rods(study.compare.loops["rods"])}
    bent = study.model_copy(update={"compare": study.compare.model_copy(update={"loops": loops})})
    monkeypatch.setattr(Run, "config", bent)
    rows = [results[0], results[9], replace(results[0], loop="rods")]
    found = compared(tmp_path / "one", rows, study)
    assert found is not None
    assert [(each["group"], each["name"], each["colour"]) for each in found["courses"]] == [
        ("four-segments, step 30 deg", "smc/printed", colour("smc")),
        ("four-segments, step 30 deg", "pid/tuned", colour("pid")),
    ], "what is no chain of arcs is left out"
    theta = results[9].simulation.trajectory.segment_theta[:: round(0.04 / 0.025)]
    np.testing.assert_allclose(found["courses"][1]["theta"], 1e4 * theta, atol=0.51)
    np.testing.assert_allclose(found["courses"][1]["wanted"], 1e4 * np.radians(30.0), atol=0.51)
    both = compared(tmp_path / "two", [results[0], replace(results[0], inverse="network")], study)
    assert both is not None
    assert [each["group"] for each in both["courses"]] == [
        "four-segments, step 30 deg, closed-form inverse",
        "four-segments, step 30 deg, network inverse",
    ]


def performed(tmp_path: Path, truth: bool) -> dict[str, Any]:
    """Three trials, the second of which was stopped, logged every 5 ms from a little later."""
    study = wristctl.load_study(None, "hw-run={horizon: 1.0, control_period: 0.005}")
    trials = pd.DataFrame(
        {
            "trial": [0, 1, 2], "direction": ["ulnar", "ulnar", "flexion"], "repetition": [0, 1, 2],
            "push": [0.0, 0.0, 5.0], "controller": ["smc", "smc", "pid"], "gains": ["tuned", "tuned", "printed"],
            "outcome": ["ok", "stopped", "ok"],
        }
    )  # fmt: skip
    time = 0.005 * np.arange(240.0)
    logs = [
        pd.DataFrame({"trial": k, "time": time, "theta": 0.1 * (k + 1) * time, "theta_desired": 0.2 * (k + 1) * time})
        for k in range(3)
    ]
    true = [each.assign(theta_1=0.3 * each["theta"], theta_2=0.7 * each["theta"]) for each in logs]
    with start_run("hw-run", study, "", tmp_path) as live:
        live.table("data/trials.csv", trials)
        live.table("data/log.csv", pd.concat(logs))
        if truth:
            live.table("data/truth.csv", pd.concat(true))
    found = animation(Run(live.path))
    assert found is not None
    return found


@pytest.mark.parametrize("truth", [False, True])
def test_trials_that_ended_well_are_played_by_the_true_segments_where_they_are_known(
    tmp_path: Path, truth: bool
) -> None:
    found = performed(tmp_path, truth)
    first, last = found["courses"]
    assert (first["group"], first["name"], first["colour"]) == ("ulnar", "smc/tuned", colour("smc"))
    assert (last["group"], last["name"]) == ("flexion, pushed with 5 N", "pid/printed, repetition 2")
    time = np.arange(0.0, 1.0, 0.04)
    assert found["step"] == pytest.approx(0.04) and found["duration"] == pytest.approx(0.995)
    for own, speed in ((first, 0.1), (last, 0.3)):
        parts = [0.3, 0.7] if truth else [1.0]
        np.testing.assert_allclose(own["theta"], 1e4 * speed * time[:, None] * parts, atol=0.51)
        np.testing.assert_allclose(own["wanted"], 1e4 * 2.0 * speed * time, atol=0.51)
