"""Which class of conditions a loop is in, and how rows stand in it."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from tests.commands.conftest import repeated
from wristctl.api import load_study
from wristctl.comparison.bootstrap import MEASURABLE, paired_ratio
from wristctl.comparison.combinations import CLASSES, ComparedRow, class_of
from wristctl.comparison.controller_ranking import (
    Ranking,
    Traits,
    class_rankings,
    probability_of_less,
    standings_frame,
    traits_of,
    undominated,
)
from wristctl.config.loop import LOOPS, Loop
from wristctl.config.wrist import WristParameters
from wristctl.simulation.repetitions import Repeated

WRIST = WristParameters()
RIG = {"actuator": {"level": "tendon"}, "sensor": {"level": "camera"}}


@pytest.mark.parametrize(
    ("loop", "expected"),
    [
        (LOOPS["exact"], "ideal"),
        (LOOPS["sampled"], "sampled"),
        (LOOPS["four-segments"], "sampled"),
        (Loop(plant_segments=1, limits=False), "sampled"),
        (Loop(plant_segments=1, control_period=1e-6), "sampled"),
        (Loop(plant_segments=4, limits=False, control_period=1e-6), "sampled"),
        (Loop.model_validate({"sensor": {"level": "camera"}}), "camera and tendons"),
        (Loop.model_validate(RIG | {"plant": {"payload": 0.1}}), "camera and tendons"),
        (Loop.model_validate(RIG | {"disturbances": {"push": {"force": 1.0}}}), "pushed"),
        (Loop.model_validate({"disturbances": {"load": -0.2}}), "pushed"),
        (Loop.model_validate({"disturbances": {"drift": {"scale": 0.8}}}), "off-nominal"),
        (Loop.model_validate({"plant": {"stiffness_scale": 0.8}}), "off-nominal"),
        (Loop.model_validate({"plant": {"tendon_radius": "x1.05"}}), "off-nominal"),
        (Loop.model_validate({"actuator": {"level": "lagged"}}), "off-nominal"),
    ],
)
def test_a_loop_is_in_the_class_of_what_is_hardest_about_it(loop: Loop, expected: str) -> None:
    assert class_of(loop, WRIST) == expected and expected in CLASSES


def compared(label: str, rmse: list[float], loop: str = "a", inverse: str = "none", **how: Any) -> list[ComparedRow]:
    """A row on as many motions as there are errors."""
    own, (name, gains) = [repeated(label, [each], **how) for each in rmse], label.split("/")
    return [ComparedRow(loop, f"move {k}", inverse, name, gains, each) for k, each in enumerate(own)]


def stand(rows: list[ComparedRow], loops: str = "{a: {}}") -> list[Ranking]:
    study = load_study(None, f"compare.loops={loops}")
    return class_rankings(rows, study.compare, study.wrist)


SPREAD = [1.0, 1.4, 0.7, 2.0, 0.5, 1.1, 0.9, 1.3, 1.8, 0.6]


def test_rows_stand_in_groups_over_the_motions_of_a_class() -> None:
    noise = np.random.default_rng(0).normal(0.0, 0.02, (3, 10))
    factors = {"a/x": 1e-4, "b/x": 1e-4, "c/x": 2e-4}
    rows = [
        compared(label, list(factor * np.array(SPREAD) * np.exp(own)))
        for (label, factor), own in zip(factors.items(), noise, strict=True)
    ]
    (found,) = stand([each for row in rows for each in row])
    assert (found.name, found.cases, found.loops) == ("sampled", "10 cases", ["a"])
    assert [sorted(found.labels[at] for at in group) for group in found.standing.groups] == [
        ["a/x", "b/x"],
        ["c/x"],
    ]
    assert found.standing.group(2) == 2 and found.best("c") == 2 and found.best("z") is None
    ratio, reverse = found.times_better(0, 2), found.times_better(2, 0)
    assert ratio.value == pytest.approx(2.0, rel=0.03) and ratio.low < ratio.value < ratio.high
    assert reverse.value == pytest.approx(1.0 / ratio.value)
    assert ratio.value == pytest.approx(paired_ratio(found.scores[2], found.scores[0], 1).value)
    assert found.yardstick is None and np.isnan([gain.value for gain in found.gains]).all()


def test_classes_come_in_their_order_and_each_has_its_own_loops() -> None:
    rows = [each for loop in ("soft", "plain", "other") for each in compared("a/x", [1e-3], loop)]
    found = stand(rows, "{soft: {plant: {stiffness_scale: 0.8}}, plain: {}, other: {plant: {payload: 0.1}}}")
    assert [(each.name, each.loops) for each in found] == [("sampled", ["plain"]), ("off-nominal", ["soft", "other"])]
    assert [each.cases for each in found] == ["1 case", "2 cases"]


def test_what_swings_or_fails_or_does_not_arrive_or_is_not_physical_is_in_no_group() -> None:
    """Each row once; a row that fails and swings too is told by motions, each once."""
    moves = 8
    rows = compared("sound/x", [1e-3] * moves) + compared("swings/x", [1e-4] * moves, oscillation=0.01)
    failing = compared("fails/x", [1e-5] * moves, oscillation=0.01)
    failing[1] = replace(failing[1], repeated=repeated("fails/x", [np.nan], failed=1, oscillation=0.01))
    short = [replace(each, repeated=_short(each.repeated)) for each in compared("short/x", [1e-5] * moves)]
    short[1:] = compared("short/x", [1e-5] * moves)[1:]
    strong = compared("strong/x", [1e-5] * moves, peak_tension=70.0)
    strong = [replace(each, repeated=replace(each.repeated, bears=60.0)) for each in strong]
    (found,) = stand([*rows, *failing, *short, *strong])
    stands = found.standing
    fates = ["ranked", "unreliable", "unreliable", "does not arrive", "not physical"]
    assert [stands.fate(at) for at in range(5)] == fates and sorted(stands.order) == list(range(5))
    assert stands.groups == [[0]] and stands.unphysical == [4] and stands.short == [3]
    assert found.swing[1] == 0.01 and found.away.tolist() == [0, 0, 0, 1, 0] and found.scores[2, 1] == np.inf
    assert (stands.failures[2].times, stands.swings[2].times, stands.lost[2].times) == (1, moves - 1, moves)
    assert found.peak.tolist() == [0.0, 0.0, 0.0, 0.0, 70.0]


@pytest.mark.parametrize("failed", [0, 1, 2])
def test_a_row_that_fails_in_one_of_three_repetitions_is_unreliable(failed: int) -> None:
    rows = compared("a/x", [1e-3] * 8) + compared("b/x", [1e-5] * 8)
    rows[-1] = replace(rows[-1], repeated=repeated("b/x", [1e-5] * 3, failed=failed))
    rows[7] = replace(rows[7], repeated=repeated("a/x", [1e-3] * 3))
    (found,) = stand(rows)
    assert found.standing.fate(1) == ("unreliable" if failed else "ranked")
    assert np.isinf(found.scores[1]).tolist() == [False] * 7 + [failed > 0]
    assert found.standing.failures[1].times == (failed > 0) and found.standing.groups[0] == ([0] if failed else [1])


def test_a_row_that_swings_in_one_of_three_repetitions_is_unreliable() -> None:
    rows = compared("a/x", [1e-3] * 8) + compared("b/x", [1e-5] * 8)
    once = repeated("b/x", [1e-5] * 3)
    swinging = {**once.metrics, "oscillation": np.array([0.0, 0.02, 0.0])}
    rows[-1] = replace(rows[-1], repeated=replace(once, metrics=swinging))
    (found,) = stand(rows)
    assert found.standing.unreliable == [1] and found.standing.swings[1].times == 1 and found.swing[1] == 0.02


@pytest.mark.parametrize("redrawn", [False, True])
def test_a_row_that_chatters_in_one_cell_is_unreliable_and_counted_by_itself(redrawn: bool) -> None:
    """Of eight motions in the last, or of twelve repetitions in the fourth."""
    if redrawn:
        rows = [
            ComparedRow("a", "move 0", "none", label, "x", repeated(f"{label}/x", [1e-3] * 12)) for label in ("a", "b")
        ]
        chattering = np.where(np.arange(12) == 3, 232.0 * 100.0, 1.0)
    else:
        rows, chattering = compared("a/x", [1e-3] * 8) + compared("b/x", [1e-5] * 8), np.array([232.0 * 100.0])
    once = rows[-1].repeated
    slams = replace(once, metrics={**once.metrics, "chattering": chattering}, tension_range=58.0)
    rows[-1] = replace(rows[-1], repeated=slams)
    (found,) = stand(rows)
    assert found.standing.unreliable == [1] and found.standing.swings[1].times == 1 and found.swing[1] == 0.0
    assert found.chatter == pytest.approx([0.0, 100.0]) and found.unsound["chatters"].tolist() == [0, 1]
    assert found.unsound["limit cycle"].tolist() == found.unsound["not converged"].tolist() == [0, 0]
    assert standings_frame([found]).set_index("row")["chatter"].to_dict() == pytest.approx({"a/x": 0.0, "b/x": 100.0})


def test_more_repetitions_than_motions_are_what_is_compared() -> None:
    """Two motions tell nothing; twelve repetitions of both do, each by the mean over the motions."""
    rng = np.random.default_rng(0)
    rmse = {
        label: factor * np.exp(0.1 * rng.standard_normal((2, 12))) for label, factor in (("a/x", 1e-2), ("b/x", 2e-2))
    }
    few = [each for label, own in rmse.items() for each in compared(label, own[:, 0].tolist())]
    (found,) = stand(few)
    assert found.cases == "2 cases" and found.standing.untold == [0, 1]
    many = [
        ComparedRow("a", f"move {k}", "none", label[0], "x", repeated(label, own[k].tolist()))
        for label, own in rmse.items() for k in (0, 1)
    ]  # fmt: skip
    (found,) = stand(many)
    assert found.cases == "12 repetitions" and found.standing.groups == [[0], [1]] and found.motions == 2
    np.testing.assert_allclose(found.scores, [np.sqrt(own[0] * own[1]) for own in rmse.values()])
    assert found.means[0].value == pytest.approx(np.exp(np.log(rmse["a/x"]).mean()))
    (setting,) = re.findall(r"repetitions=\d+", found.more)
    assert load_study(None, f"compare.{setting}").compare.repetitions > 1 and "--" not in found.more


def test_too_few_motions_rank_nothing_whatever_the_difference() -> None:
    """Three motions and rows 75 times apart in each of them."""
    (found,) = stand(compared("a/x", [1e-3, 2e-3, 3e-3]) + compared("b/x", [0.075, 0.15, 0.22]))
    assert found.standing.groups == [] and found.standing.untold == [0, 1]


def test_steps_are_no_part_of_the_mean_of_smooth_motions() -> None:
    """A jump costs each row the same; in one mean it would make a row that is 100 times better 5 times so."""

    def both(label: str, smooth: float) -> list[ComparedRow]:
        jump = replace(compared(label, [0.04])[0], reference="step 30 deg", jumps=True)
        return [*compared(label, [smooth] * 8), jump]

    rows = both("a/x", 1e-4) + both("b/x", 1e-2)
    smooth, steps = stand(rows)
    assert (smooth.name, smooth.cases, smooth.jumps) == ("sampled", "8 cases", False)
    assert (steps.name, steps.cases, steps.jumps) == ("sampled, steps", "1 case", True)
    assert smooth.times_better(0, 1).value == pytest.approx(100.0) and smooth.standing.groups == [[0], [1]]
    assert steps.means[0].value == steps.means[1].value == pytest.approx(0.04) and steps.standing.untold == [0, 1]
    assert [len(each.of(rows)) for each in (smooth, steps)] == [16, 2]


def test_an_error_of_nothing_counts_as_the_least_that_can_be_measured() -> None:
    (found,) = stand(compared("a/x", [0.0] * 8) + compared("b/x", [1e-7] * 8) + compared("c/x", [1e-3] * 8))
    assert found.standing.groups == [[0, 1], [2]]
    assert found.means[0].value == found.means[1].value == pytest.approx(MEASURABLE)


def test_the_table_of_standings_has_every_row_of_every_class_once() -> None:
    rows = (
        compared("a/x", [1e-3] * 8)
        + compared("b/x", [2e-3] * 8, oscillation=0.01)
        + compared("a/x", [1e-3] * 2, "soft")
    )
    rows += compared("b/x", [1e-3] * 2, "soft")
    table = standings_frame(stand(rows, "{a: {}, soft: {plant: {stiffness_scale: 0.8}}}"))
    told = table[["class", "row", "fate", "pairs", "swings"]].to_numpy().tolist()
    assert told == [
        ["sampled", "a/x", "ranked", 8, 0], ["sampled", "b/x", "unreliable", 8, 8],
        ["off-nominal", "a/x", "too few to tell", 2, 0], ["off-nominal", "b/x", "too few to tell", 2, 0],
    ]  # fmt: skip


def _short(given: Repeated) -> Repeated:
    """The same that ends at half of what is asked."""
    course = given.first.trajectory
    halved = replace(given.first, trajectory=replace(course, theta=0.5 * course.theta))
    return replace(given, first=halved)


def test_gains_are_over_feedforwards_error_in_the_same_cases() -> None:
    errors = {"a/x": 1e-3, "feedforward/default": 8e-3, "b/x": 4e-3}
    rows = [compared(label, list(factor * np.array(SPREAD))) for label, factor in errors.items()]
    (found,) = stand([each for row in rows for each in row])
    assert found.yardstick == 1 and [gain.value for gain in found.gains] == pytest.approx([8.0, 1.0, 2.0])


def test_a_condition_has_the_traits_that_all_its_loops_share() -> None:
    loops = (
        "{plain: {}, soft: {plant: {stiffness_scale: 0.8}}, push: {disturbances: {push: {force: 1.0}}},"
        " camera: {sensor: {level: camera}}, rig: {sensor: {level: camera}, actuator: {level: tendon}}}"
    )
    rows = [each for loop in ("plain", "soft", "push", "camera", "rig") for each in compared("a/x", [1e-3], loop)]
    traits = {each.name: each.traits for each in stand(rows, loops)}
    told = {name: (one.rig, one.camera, one.tendons, one.load, one.unknown) for name, one in traits.items()}
    assert told == {
        "sampled": (False, False, False, False, False),
        "camera and tendons": (True, True, False, False, False),  # one of the two has no tendons
        "pushed": (False, False, False, True, False),
        "off-nominal": (False, False, False, False, True),
    }
    assert not any(one.jumps or one.uneven for one in traits.values())


def test_a_condition_of_which_nothing_is_said_asks_nothing_special() -> None:
    """Each trait is a question to a reader, of which the answer is no until a loop or a study says yes."""
    assert not any(Traits()) and not any(traits_of([LOOPS["exact"], LOOPS["sampled"]], WRIST))
    assert traits_of([LOOPS["sampled"]], WRIST, jumps=True) == Traits(jumps=True)
    tendons = Loop.model_validate({"actuator": {"level": "tendon"}})
    assert traits_of([tendons], WRIST) == Traits(rig=True, tendons=True)
    assert traits_of([tendons, Loop.model_validate({"sensor": {"level": "camera"}})], WRIST) == Traits(rig=True)
    assert not any(traits_of([tendons, LOOPS["sampled"]], WRIST)), "what not all of them have"
    hinges, soft = (Loop.model_validate({"plant": {name: of}}) for name, of in (("model", "hinges"), ("creep", 0.1)))
    assert traits_of([hinges], WRIST) == Traits(unknown=True, uneven=True)
    assert traits_of([hinges, soft], WRIST) == Traits(unknown=True)


def test_on_the_front_is_what_no_other_beats_in_all_costs() -> None:
    """A row that is as dear in one and cheaper in another beats; equal rows beat neither; inf is never on the front."""
    costs = np.array([[1.0, 4.0], [2.0, 2.0], [2.0, 3.0], [4.0, 1.0], [1.0, 4.0], [0.5, np.inf], [3.0, 3.0]])
    assert undominated(costs).tolist() == [True, True, False, True, True, False, False]
    assert undominated(np.array([[np.inf, np.inf]])).tolist() == [False]
    assert undominated(np.array([[3.0], [2.0], [2.0]])).tolist() == [False, True, True]


def test_one_beats_another_in_the_share_of_cases_where_its_error_is_less() -> None:
    """Equal below what can be measured, and where both fail; the two shares of a pair add up to one."""
    scores = np.array([[1e-3, 1e-3, 1e-9, np.inf], [2e-3, 5e-4, 1e-7, np.inf], [5e-3, 6e-3, 1e-2, 1e-2]])
    shares = probability_of_less(scores)
    assert shares[0].tolist() == [0.5, 0.5, 0.75] and shares[2].tolist() == [0.25, 0.25, 0.5]
    np.testing.assert_allclose(shares + shares.T, 1.0)


def test_control_is_judged_without_a_network_where_it_can_be() -> None:
    both = compared("a/x", [1e-3]) + compared("a/x", [1.0], inverse="network")
    assert stand(both)[0].scores == pytest.approx(1e-3)
    assert stand(compared("a/x", [1.0], inverse="network"))[0].scores == pytest.approx(1.0)
