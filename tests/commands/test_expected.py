"""The error to expect of a trial: whose rigs it is of, and which fact would narrow it."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import wristctl
from wristctl.commands.recommend.expected import (
    FACTS,
    IDENTIFIED,
    Candidate,
    Expected,
    Fact,
    Left,
    _narrower,
    _over_rigs,
    asked_for,
    expected,
    known_of,
    spread,
)
from wristctl.config.loop import Reference
from wristctl.config.study import Study
from wristctl.control.table import controller
from wristctl.simulation.cases import measure
from wristctl.simulation.drawn_worlds import drawn_cases
from wristctl.study_files.resolved import resolved_yaml
from wristctl.tuning.scaled_presets import scaled_to

TENDONS, SPRINGS, HAND, CAMERA = FACTS
IDEAL = "recommend.loop={plant_segments: 1, actuator: {level: ideal}, sensor: {level: ideal}}"


def study_of(*overrides: str) -> Study:
    return wristctl.load_study(None, "recommend.tests=40", *overrides)


def candidate(study: Study, name: str) -> Candidate:
    law = scaled_to(study.wrist, controller(name))
    return Candidate(name, "", dict(list(law.presets.values())[-1]) if law.presets else {})


def degrees_of(low: float, high: float, every: tuple[Left, ...], **counts: int) -> Expected:
    return Expected(math.radians(low), math.radians(low), math.radians(high), 200, left=every, **counts)


def left(low: float, high: float, *facts: Fact) -> Left:
    return Left(facts, math.radians(low), math.radians(high))


@pytest.mark.parametrize(("rigs", "within"), [(39, 38 / 40), (40, 39 / 41), (200, 191 / 201), (1000, 951 / 1001)])
def test_another_rig_errs_within_the_range_19_times_of_20(rigs: int, within: float) -> None:
    """Of n rigs and another one each order is alike: it is between two neighbours with a probability of 1/(n + 1)."""
    low, median, high = spread(np.random.default_rng(0).permutation(np.arange(1.0, rigs + 1.0)))
    assert (high - low) / (rigs + 1.0) == pytest.approx(within) and 0.95 <= within < 0.953
    assert median == pytest.approx(0.5 * (rigs + 1.0)) == pytest.approx(0.5 * (low + high))
    assert spread(np.arange(1.0, 9.0)) == (1.0, 4.5, 8.0), "few rigs give no such range"


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_rig_errs_by_the_root_of_the_mean_square_of_its_errors_to_both_sides(sign: float) -> None:
    """Springs off by a share miss as much to either side; a load misses to one, and both add up as they do here."""
    study = study_of(IDEAL, f"recommend.draw={{plant.stiffness: x0.7..1.3, disturbances.load: [{0.3 * sign}]}}")
    best, toward = candidate(study, "pid-ff"), [Reference(angle_deg=20.0), Reference(angle_deg=-20.0)]
    family = study.recommend.family(20.0)
    found = _over_rigs(study, best, asked_for(family, toward, 2.0))
    each = []
    for one in toward:
        law = controller(best.controller)
        cases = drawn_cases(asked_for(family, [one], 2.0), "recommend", "test", study.seed, 40, study.wrist)
        each.append(measure(law, np.array([law.values(best.gains)]), cases, study.wrist, ["rmse"]).metrics["rmse"][0])
    assert found[:3] == pytest.approx(spread(np.sqrt((each[0] ** 2 + each[1] ** 2) / 2.0)), rel=1e-9)
    assert found.at_limit == found.failed == 0 and not np.allclose(each[0], each[1], rtol=1e-2)


@pytest.mark.parametrize("angle", [35.0, -35.0])
def test_rigs_whose_motors_stand_at_their_limit_are_counted_and_have_no_part_in_the_range(angle: float) -> None:
    """Of springs as believed and three times as stiff, the tendons hold these no more: they miss several degrees."""
    study = study_of(IDEAL, "wrist.tension_limit=30", "recommend.draw={plant.stiffness: [x1, x3]}")
    asked = asked_for(study.recommend.family(20.0), [Reference(angle_deg=angle)], 2.0)
    found = _over_rigs(study, candidate(study, "pid-ff"), asked)
    assert 10 < found.at_limit < 30 and found.failed == 0 and found.high < math.radians(1.0)
    assert f"On {found.at_limit} of 40 rigs the motors are at their limit." in found.said
    assert f"With that motion {40 - found.at_limit} other simulated rigs err by" in found.said
    weak = study.recommend.model_copy(update={"draw": {"plant.stiffness": ("x3",)}})
    none = _over_rigs(study, candidate(study, "pid-ff"), asked.model_copy(update={"draw": weak.draw}))
    assert none.at_limit == 40 and math.isnan(none.high) and "err by" not in none.said


def test_a_narrow_range_asks_nobody_to_measure_anything_and_a_wide_one_names_what_makes_it_wide() -> None:
    """Without feedback the error is that of springs and loads: known, they leave little of it."""
    calm = study_of("recommend.draw={disturbances.load: '0.2..0.3'}")
    feedforward = candidate(calm, "feedforward")
    family = calm.recommend.family(20.0)
    assert expected(calm, feedforward, family, 20.0, 1).left == ()
    wide = study_of("recommend.draw={plant.stiffness: x0.5..2, disturbances.load: '0.001..0.002'}")
    found = expected(wide, feedforward, wide.recommend.family(20.0), 20.0, 1)
    assert [one.facts for one in found.left] == [(SPRINGS,), (HAND,)] and found.left[0].high < 0.3 * found.high
    assert found.left[1].high > 0.9 * found.high and SPRINGS.name in found.wide and "wristctl identify" in found.wide
    pushed = study_of("recommend.draw={plant.stiffness: x0.99..1.01, disturbances.load: '-5..5'}")
    found = expected(pushed, feedforward, pushed.recommend.family(20.0), 20.0, 1)
    assert HAND.name in found.wide and "identify" not in found.wide


def test_what_is_known_is_no_wider_than_a_study_says() -> None:
    assert _narrower("x0.6..1.4", "x0.9..1.1") == "x0.9..1.1" == _narrower("0.03..0.2", "x0.9..1.1")
    assert _narrower("x0.95..1.05", "x0.9..1.1") == "x0.95..1.05" and _narrower((1.0, 2.0), "x0.9..1.1") == "x0.9..1.1"
    asked = asked_for(study_of().recommend.family(20.0), [Reference()], 5.0)
    assert "plant.hand_mass" in asked.draw and "plant.hand_mass" not in known_of(asked, [HAND]).draw
    both = known_of(asked, [TENDONS, SPRINGS]).draw
    late, measured = "plant.sensor.delay_frames", study_of().recommend.measured().draw
    assert both == measured | {late: asked.draw[late]}
    identified = study_of().model_copy(update={"recommend": study_of().recommend.measured()}).recommend.family(20.0)
    again = asked_for(identified, [Reference()], 5.0)
    assert known_of(again, [TENDONS]) == again == known_of(again, [SPRINGS]) and known_of(again, [CAMERA]) != again
    assert (
        known_of(again, [CAMERA]).draw["plant.sensor.delay_frames"] == "1.5..2.5"
        and _narrower("1.9..2", "1..3") == "1.9..2"
    )


def test_a_runs_own_config_draws_the_rigs_that_the_run_drew(tmp_path: Path) -> None:
    """It has every setting, what is drawn too, which nobody gave."""
    study = study_of("recommend.from_identified=RUN")
    (tmp_path / "config.yaml").write_text(resolved_yaml(study, "recommend"))
    again = wristctl.load_study(tmp_path / "config.yaml").recommend
    assert "draw" in again.model_fields_set and again.measured({"wrist.damping"}) == study.recommend.measured(
        {"wrist.damping"}
    )
    assert again.measured().draw["plant.stiffness"] == "x0.9..1.1"


def test_the_words_are_of_the_fact_that_lowers_the_upper_end_by_most() -> None:
    alone = left(0.05, 0.4, TENDONS), left(0.06, 0.3, SPRINGS), left(0.05, 0.5, CAMERA)
    joint = left(0.06, 0.2, TENDONS, SPRINGS)
    found = degrees_of(0.05, 0.5, (*alone, joint), at_limit=3, failed=1)
    assert "On 3 of 200 rigs the motors are at their limit and on 1 of 200 the wrist fails." in found.said
    assert "95 % of 196 other simulated rigs err by 0.05 to 0.5 deg, half by at most 0.05 deg." in found.said
    first = (
        f"first of all the {SPRINGS.name}: known, 0.06 to 0.3 deg would be left, 0.06 to 0.2 deg with {TENDONS.name}"
    )
    assert first in found.wide and f"({IDENTIFIED})" in found.wide
    worse = degrees_of(0.05, 0.5, (*alone, left(0.06, 0.35, TENDONS, SPRINGS)))
    assert "known too" not in worse.wide and worse.said.startswith("With that motion 95 % of 200 simulated rigs err")
    even = degrees_of(0.05, 0.5, (left(0.05, 0.49, TENDONS), left(0.04, 0.48, HAND)))
    assert "No fact alone" in even.wide and HAND.name in even.wide


def test_a_hand_carries_by_default_up_to_half_of_what_is_said_of_it() -> None:
    for mass in (0.0, 0.03, 0.3):
        study = study_of(f"wrist.hand_mass={mass}")
        asked = asked_for(study.recommend.family(20.0), [Reference()], 1.0)
        cases = drawn_cases(asked, "recommend", "test", 0, 40, study.wrist)
        carried = [case.loop.plant.of(study.wrist).hand_mass + case.loop.plant.payload for case in cases]
        assert mass <= min(carried) <= max(carried) <= 1.5 * mass
        assert mass == 0.0 or (min(carried) < 1.1 * mass and max(carried) > 1.4 * mass)
