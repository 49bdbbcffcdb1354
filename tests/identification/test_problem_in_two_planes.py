"""The ellipse of springs, the plan of spools, and the log of a rehearsed bench in two planes."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.identification.bend_rehearsal import Hold, RehearsedBends, planned_spools, rehearse_bends
from tests.identification.bend_rigs import (
    KNOWN,
    LAYOUT,
    MASSES,
    SETTINGS,
    TENDONS,
    drawn_rig,
    identified,
    logs_of,
    spools,
)
from wristctl.config.identify import Fixed, IdentifySettings
from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError
from wristctl.identification.bend_estimates import overruled_mass, told_of_bends
from wristctl.identification.fit import Fit, Rival, fit, linearise
from wristctl.identification.forward import Places, Supposed, courses
from wristctl.identification.intervals import Knowledge, knowledge
from wristctl.identification.measured_trials import PLANES, MeasuredTrial, places_of_log, trials_of_logs
from wristctl.identification.problem import GAIN, TURN, Coordinate, Problem, bend_problem
from wristctl.identification.unknowns import oblique_of, springs_of
from wristctl.records.log_converters import read_log
from wristctl.records.open_log import write_log
from wristctl.wrist.spatial.spatial_model import spatial_terms
from wristctl.wrist.spatial.spatial_segments import ellipse, spatial_values
from wristctl.wrist.tendon_layout import TendonLayout

pytestmark = pytest.mark.slow


@given(st.floats(0.1, 2.0), st.floats(0.3, 3.0), st.floats(-180.0, 180.0))
def test_springs_are_the_same_by_their_axis_and_by_the_numbers_of_the_search(
    stiffness: float, ratio: float, axis: float
) -> None:
    wrist = KNOWN.model_copy(update={"stiffness": stiffness, "flexion_ratio": ratio, "stiffness_axis_deg": axis})
    again = springs_of(*oblique_of(wrist))
    assert abs(again["stiffness_axis_deg"]) <= 45.0 + 1e-6
    one, other = (
        ellipse(values["stiffness"], values["stiffness"] * values["flexion_ratio"], math.radians(values["axis"]))
        for values in (
            {"stiffness": stiffness, "flexion_ratio": ratio, "axis": axis},
            {**again, "axis": again["stiffness_axis_deg"]},
        )
    )
    assert other == pytest.approx(one, rel=1e-9, abs=1e-12)


def test_a_wrist_on_held_spools_comes_to_rest_where_its_tendons_hold_springs_and_weight() -> None:
    wrist = KNOWN.model_copy(update={"flexion_ratio": 1.3, "stiffness_axis_deg": 25.0, "gravity_flexion": 3.0})
    sliding = TENDONS.model_copy(update={"friction": 0.0})
    reeled = np.tile([-2e-3, 1e-3, -1.5e-3, 6e-3], (1500, 1))
    supposed = Supposed(wrist, sliding, (1e-4, 0.0, 0.0, -1e-4), Places.of(LAYOUT, wrist.discs))
    (course,) = courses([supposed], reeled, 1e-3, 1, pulls=True)
    bend, pulls = course[-1, :2], course[-1, 2:]
    assert np.hypot(*bend) > 0.1 and pulls.min() == 0.0 and np.abs(course[-1] - course[-200]).max() < 1e-6
    at_rest = spatial_terms(spatial_values(wrist, LAYOUT, 1, axis=math.radians(25.0)), bend, 0.0 * bend)
    yy, yz, zz = ellipse(wrist.stiffness, 1.3 * wrist.stiffness, math.radians(25.0))
    held = at_rest.bias + np.array([[yy, yz], [yz, zz]]) @ bend
    assert pulls @ at_rest.moment_arms == pytest.approx(held, abs=1e-5)
    stretch = np.array(supposed.taut) + reeled[-1] - (wrist.length - at_rest.lengths)
    assert pulls == pytest.approx(2e4 * stretch.clip(0.0), abs=1e-3)


def test_a_place_of_two_tendons_and_one_that_ends_early_pull_on_held_spools_as_they_do_in_the_wrist() -> None:
    places = ({"angle_deg": 10.0, "multiplicity": 2}, {"angle_deg": 130.0, "ends_at": 3}, {"angle_deg": 250.0})
    wrist = WristParameters.model_validate({"tendons": places})
    layout, sliding = TendonLayout.of(wrist), TENDONS.model_copy(update={"friction": 0.0})
    shares = layout.shares(wrist.discs)
    supposed = Supposed(wrist, sliding, (1e-4,) * 3, Places.of(layout, wrist.discs))
    reeled = np.array([6e-3, -1e-3, -2e-3])
    (course,) = courses([supposed], np.tile(reeled, (1500, 1)), 1e-3, 1, pulls=True)
    bend, pulls = course[-1, :2], course[-1, 2:]
    at_rest = spatial_terms(spatial_values(wrist, layout, 1), bend, 0.0 * bend)
    stretch = 1e-4 + reeled - (shares * wrist.length - at_rest.lengths)
    assert pulls == pytest.approx(2e4 * stretch.clip(0.0), abs=1e-3) and pulls[0] > 2.0, "of one tendon of each place"
    held = at_rest.bias + wrist.stiffness * bend
    assert (pulls * layout.multiplicity) @ at_rest.moment_arms == pytest.approx(held, abs=1e-5)


def test_planned_spools_keep_to_what_motors_can_do() -> None:
    counts = spools()
    speed, acceleration = (np.abs(np.diff(counts, order, axis=0)).max() * 1e3**order for order in (1, 2))
    assert (counts == np.rint(counts)).all() and speed < TENDONS.step_rate
    smooth = np.diff(counts[::20], 2, axis=0) / 0.02**2  # without the rounding to whole steps
    assert np.abs(smooth).max() < 1.1 * TENDONS.step_acceleration < acceleration
    with pytest.raises(UserError, match="takes the motors"):
        planned_spools(KNOWN, TENDONS, LAYOUT, [Hold(30.0, 0.0), Hold(30.0, 180.0)], hold=0.2)
    with pytest.raises(UserError, match="out of the tendons' reach"):
        planned_spools(KNOWN, TENDONS, LAYOUT, [Hold(45.0, 45.0, 25.0)])


def test_a_rehearsed_log_is_read_back_as_it_was_written(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    log = logs_of(drawn_rig(rng), rng, tension_noise=0.2)[0]
    write_log(log, tmp_path / "hand.csv")
    written, again = (trials_of_logs([one], KNOWN, 1e-3, 4e-3)[0] for one in (log, read_log(tmp_path / "hand.csv")))
    assert written.wrist.hand_mass == again.wrist.hand_mass == pytest.approx(0.3)
    assert again.angle == pytest.approx(written.angle) and (again.channel == written.channel).all()
    bends = [written.angle[written.channel == plane] for plane in (0, 1)]
    assert len(bends[0]) == len(bends[1]) == pytest.approx(0.95 * 60.0 * 9.6, rel=0.05)
    assert max(np.degrees(np.abs(bend).max()) for bend in bends) > 20.0
    # readings of tensions are weighed as bends are, of which quick moves look like noise
    assert 1.0 < written.per_newton * 0.2 / math.radians(0.05) < 2.0


def test_at_the_truth_nothing_but_noise_is_left_of_bends_and_tensions() -> None:
    rng = np.random.default_rng(5)
    rig = drawn_rig(rng)
    bench = RehearsedBends(rig.wrist, rig.actuator, rig.layout, tension_noise=0.2, segments=2)
    log = rehearse_bends(bench, spools(), TENDONS.step_length, rng)
    (trial,) = trials_of_logs([log], KNOWN, 1e-3, bench.exposure)
    problem = bend_problem([trial], places_of_log(log, KNOWN), KNOWN, TENDONS, SETTINGS)
    mean, p, q = oblique_of(rig.wrist)
    true = rig.truth(0.0) | {"stiffness": mean, "oblique_cos": p, "oblique_sin": q}
    true |= {name: math.radians(value) for name, value in true.items() if name.startswith("direction")}
    x = np.zeros(len(problem.coordinates))
    for index, name in enumerate(problem.free):
        x[index] = problem.unknowns[name].coordinate(true[name], problem.start[name])
    left = trial.angle - trial.shown(problem.courses(trial, [x])[0], true["delay"])
    for channel, noise in enumerate([math.radians(0.05)] * 2 + [0.2 * trial.per_newton] * 4):
        spread = np.median(np.abs(left[trial.channel == channel])) / 0.6745
        assert spread == pytest.approx(noise, rel=0.12)


def test_a_log_of_another_wrist_or_of_one_plane_is_refused() -> None:
    rng = np.random.default_rng(0)
    log = logs_of(drawn_rig(rng), rng)[0]
    three = KNOWN.model_copy(update={"tendons": "three"})
    with pytest.raises(UserError, match="3 places"):
        places_of_log(log, three)
    columns = {name: column for name, column in log.columns.items() if name != "bend_z"}
    with pytest.raises(UserError, match="bend_z is not in the log"):
        trials_of_logs([type(log)(log.file, "log", columns)], KNOWN, 1e-3)
    trials = trials_of_logs([log], KNOWN, 1e-3)
    held = IdentifySettings.model_validate({"fix": {"flexion_ratio": 1.0}})
    with pytest.raises(UserError, match="flexion_ratio"):
        bend_problem(trials, places_of_log(log, KNOWN), KNOWN, TENDONS, held)


def test_what_the_readings_leave_open_is_not_told() -> None:
    """Springs alike all around have no axis, and what was known beforehand is nothing that the readings told."""
    rng = np.random.default_rng(0)
    log = logs_of(drawn_rig(rng), rng)[0]
    problem = bend_problem(trials_of_logs([log], KNOWN, 1e-3), places_of_log(log, KNOWN), KNOWN, TENDONS, SETTINGS)
    x = problem.begin()
    x[problem.free.index("oblique_cos")] = 1e-3
    deviation = np.full(len(x), 2e-3)
    deviation[problem.free.index("damping")] = 1.0
    deviation[problem.free.index("gain_4")] = 0.95 * SETTINGS.radius_error
    found = Fit(problem, x, 1e-3, [], [], 1)
    told = told_of_bends(found, Knowledge(deviation, np.diag(deviation**-2.0), 1.0, 0.0, 1.0, problem.prior()))
    assert {name for name, one in told.items() if not one.known} == {"stiffness_axis_deg", "damping", "gain_4"}
    assert told["stiffness"].value == pytest.approx(1.001 * KNOWN.stiffness)
    # of the mean and of the two numbers the same share
    half = 1.96 * KNOWN.stiffness * math.hypot(2e-3, 2e-3)
    assert told["stiffness"].high - told["stiffness"].value == pytest.approx(half, rel=1e-2)
    assert told["direction_5"].value == pytest.approx(45.0)
    x[problem.free.index("oblique_cos")], x[problem.free.index("oblique_sin")] = 0.05, 0.05
    axis = told_of_bends(found, Knowledge(deviation, np.diag(deviation**-2.0), 1.0, 0.0, 1.0, problem.prior()))[
        "stiffness_axis_deg"
    ]
    assert axis.known and axis.value == pytest.approx(22.5)
    assert axis.high - axis.value == pytest.approx(math.degrees(1.96 * 2e-3 / (2.0 * math.hypot(0.05, 0.05))), rel=1e-3)


@pytest.mark.parametrize("excess", [1.0, 8.0])
def test_what_two_minima_have_different_is_told_only_where_one_fits_significantly_better(excess: float) -> None:
    rng = np.random.default_rng(0)
    log = logs_of(drawn_rig(rng), rng)[0]
    problem = bend_problem(trials_of_logs([log], KNOWN, 1e-3), places_of_log(log, KNOWN), KNOWN, TENDONS, SETTINGS)
    x, deviation = problem.begin(), np.full(len(problem.coordinates), 2e-3)
    x[problem.free.index("oblique_cos")] = -0.1
    residuals = [np.full(len(trial.angle), 1e-3) for trial in problem.trials]
    count = sum(map(len, residuals))
    other = x.copy()
    other[problem.free.index("oblique_cos")] = -0.2
    other[problem.free.index("damping")] += 0.1
    other[problem.free.index("friction")] += 1e-3
    found = Fit(problem, x, 1e-3, residuals, [], 1, (Rival(other, excess),))
    known = Knowledge(deviation, np.diag(deviation**-2.0), 1.0, 0.0, count, problem.prior())
    missing = {name for name, one in told_of_bends(found, known).items() if not one.known}
    if excess < 1.96**2:
        assert missing >= {"stiffness", "stiffness_across", "damping"} and not missing & {"friction", "delay"}
    else:
        assert not missing & {"stiffness", "stiffness_across", "damping", "stiffness_axis_deg"}
    # of readings that are alike a quarter as many count, and the same difference is no more significant
    alike = Knowledge(deviation, np.diag(deviation**-2.0), 1.0, 0.0, 0.25 * count, problem.prior())
    assert not told_of_bends(found, alike)["damping"].known
    turned = x.copy()
    turned[problem.free.index("oblique_cos")], turned[problem.free.index("oblique_sin")] = -0.08, -0.06
    told = told_of_bends(Fit(problem, x, 1e-3, residuals, [], 1, (Rival(turned, 1.0),)), known)
    assert not told["stiffness_axis_deg"].known and told["damping"].known


LATE = 5e-4
THREE = WristParameters(tendons="three", gravity=(0.0, 0.0), stiffness=1.2, damping=0.12, hand_mass=0.2)
HELD = {"friction": 0.0, "sheath_friction": 0.0, "presliding": 2e-5}


def one_plane_each(late: float) -> list[MeasuredTrial]:
    """A motion toward ulnar, seen so much later than the mean delay of 30 ms, and one toward flexion, as much earlier.

    Three tendons stay tight, so that the wrist's inertia alone tells its springs from theirs.
    """
    layout, tendons = TendonLayout.of(THREE), TENDONS.model_copy(update={"friction": 0.0})
    time, rng, trials = 1e-3 * np.arange(2500.0), np.random.default_rng(5), []
    for plane, side in enumerate((1.0, -1.0)):
        bend = np.zeros((len(time), 2))
        bend[:, plane] = 0.3 * np.sin(5.0 * time) * np.minimum(1.0, time**2)
        reeled = 4e-4 + bend @ layout.cross_section.T
        supposed = Supposed(THREE, tendons, places=Places.of(layout, THREE.discs))
        (course,) = courses([supposed], reeled, 1e-3, 1, pulls=True)
        captured = np.arange(0.05, 2.45, 0.01)
        seen = [np.interp(captured - 0.03 - side * late, time, bends) for bends in course[:, :2].T]
        angle = np.concatenate(seen) + math.radians(0.02) * rng.standard_normal(2 * len(captured))
        trials.append(
            MeasuredTrial(
                f"log, {plane}", "log", "both", THREE, time, reeled, np.tile(captured, 2), angle, 0.0, (1, 2, 3),
                np.repeat([0, 1], len(captured)), 1.0,
            )
        )  # fmt: skip
    return trials


@pytest.mark.parametrize("late", [LATE, -LATE])
def test_trials_whose_clocks_are_apart_do_not_make_springs_of_one_plane_softer(late: float) -> None:
    places = dict(enumerate(TendonLayout.of(THREE).places, 1))
    ratios = []
    for error in (3e-4, 0.0):
        settings = IdentifySettings(segments=1, fix=Fixed(**HELD), clock_error=error)
        problem = bend_problem(one_plane_each(late), places, THREE, TENDONS, settings)
        found = fit(problem)
        ratios.append(springs_of(*(found.values[name] for name in ("stiffness", "oblique_cos", "oblique_sin"))))
        if error:
            x, (ulnar, flexion) = found.x, problem.trials
            apart = problem.delay(ulnar, x) - problem.delay(flexion, x)
            assert apart == pytest.approx(2.0 * late, abs=4e-4), "the trials tell much of it themselves"
            told = told_of_bends(found, knowledge(found))
            for name in ("stiffness", "stiffness_across"):
                assert told[name].low < THREE.stiffness < told[name].high
            for number, degrees in ((2, 120.0), (3, 240.0 - 360.0)):
                turned = math.remainder(degrees - told[f"direction_{number}"].value, 360.0)
                assert told[f"direction_{number}"].low < told[f"direction_{number}"].value + turned
                assert told[f"direction_{number}"].value + turned < told[f"direction_{number}"].high
    apart, together = (abs(math.log(springs["flexion_ratio"])) for springs in ratios)
    assert together > 2.0 * apart, "with clocks that are known to agree one plane's springs take it up"


def test_a_mass_of_the_log_goes_before_one_that_the_study_gives() -> None:
    places = dict(enumerate(TendonLayout.of(THREE).places, 1))
    trials = one_plane_each(0.0)

    def overruled(trials: list[MeasuredTrial], wrist: WristParameters) -> float | None:
        return overruled_mass(bend_problem(trials, places, wrist, TENDONS, IdentifySettings(segments=1)), wrist)

    assert overruled(trials, WristParameters(tendons="three", hand_mass=0.19)) == pytest.approx(0.2)
    assert overruled(trials, WristParameters(tendons="three", hand_mass=0.2)) is None, "they agree"
    assert overruled(trials, WristParameters(tendons="three")) is None, "nobody has given another"
    light = replace(trials[1], wrist=THREE.model_copy(update={"hand_mass": 0.1}))
    assert overruled([trials[0], light], WristParameters(tendons="three", hand_mass=0.19)) is None, "several masses"


def looked_at() -> tuple[Problem, MeasuredTrial]:
    """A search over one trial of three tight tendons, seen in both planes."""
    places = dict(enumerate(TendonLayout.of(THREE).places, 1))
    problem = bend_problem(one_plane_each(0.0)[:1], places, THREE, TENDONS, IdentifySettings(segments=1))
    return problem, problem.trials[0]


def test_views_that_are_turned_alike_show_a_turned_wrist_and_a_gain_is_its_planes_own() -> None:
    problem, trial = looked_at()
    x, turn = problem.begin(), 1e-4
    (course,) = problem.courses(trial, [x])
    for plane in PLANES:
        x[problem.coordinates[Coordinate(TURN, place=plane)]] = turn
    turned = course @ np.array([[math.cos(turn), -math.sin(turn)], [math.sin(turn), math.cos(turn)]])
    np.testing.assert_allclose(problem.viewed(trial, course, x), turned, atol=turn**2)
    assert np.abs(turned - course).max() > 100.0 * turn**2
    x = problem.begin()
    x[problem.coordinates[Coordinate(GAIN, place="flexion")]] = 0.01
    np.testing.assert_allclose(problem.viewed(trial, course, x), course * [1.0, 1.01], atol=1e-12)


def test_slopes_of_views_are_the_differences_of_what_is_expected() -> None:
    """Of a motion toward ulnar what the view of the other plane shows of it by its turn, and its own by its gain."""
    problem, _ = looked_at()
    x = problem.begin() + 1e-4
    here = linearise(problem, x)
    for kind, plane in ((TURN, "flexion"), (GAIN, "ulnar")):
        at = problem.coordinates[Coordinate(kind, place=plane)]
        moved = linearise(problem, x + 1e-3 * (np.arange(len(x)) == at)).expected[0]
        slope = here.slopes[0][:, at]
        assert np.abs(slope).max() > 0.05
        np.testing.assert_allclose((moved - here.expected[0]) / 1e-3, slope, atol=1e-9)


def test_intervals_of_tendons_know_how_well_views_stand() -> None:
    """Views are 0.08 and -0.07 deg about the wrist's axis and 0.04 % off; nobody knows but how much that may be."""
    rng = np.random.default_rng(8)
    rig, logs = drawn_rig(rng), []
    for name, mass in MASSES.items():
        wrist = rig.wrist.model_copy(update={"hand_mass": mass})
        truth = RehearsedBends(
            wrist, rig.actuator, rig.layout, turn_deg=(0.08, -0.07), too_much=(4e-4, -4e-4), segments=2
        )
        logs.append(rehearse_bends(truth, spools(), TENDONS.step_length, rng, name=name))
    held = []
    for known in ({}, {"turn_error_deg": 1e-4, "view_error": 1e-6}):
        told = identified(logs, SETTINGS.model_copy(update=known)).told
        true = {name: value for name, value in rig.truth(0.0).items() if name.startswith(("direction", "gain"))}
        held.append(sum(told[name].low <= value <= told[name].high for name, value in true.items()))
        assert all(told[name].known for name in true)
    assert held[0] == 8 and held[1] <= 4
