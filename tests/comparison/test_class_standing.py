"""Which class of conditions a loop is in, and how rows stand in it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from tests.studies.conftest import repeated
from wristctl.api import load_study
from wristctl.comparison.class_standing import ClassStanding, class_standings
from wristctl.comparison.combinations import ComparedRow
from wristctl.comparison.condition_classes import CLASSES, class_of
from wristctl.comparison.geometric_means import paired_ratio
from wristctl.comparison.tie_groups import ALIKE, standing
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
        (LOOPS["default"], "sampled"),
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


def stand(rows: list[ComparedRow], loops: str = "{a: {}}") -> list[ClassStanding]:
    study = load_study(None, f"compare.loops={loops}")
    return class_standings(rows, study.compare, study.wrist)


SPREAD = [1.0, 1.4, 0.7, 2.0, 0.5, 1.1, 0.9, 1.3, 1.8, 0.6]


def test_rows_stand_in_groups_over_the_motions_of_a_class() -> None:
    noise = np.random.default_rng(0).normal(0.0, 0.02, (3, 10))
    factors = {"a/x": 1e-4, "b/x": 1e-4, "c/x": 2e-4}
    rows = [
        compared(label, list(factor * np.array(SPREAD) * np.exp(own)))
        for (label, factor), own in zip(factors.items(), noise, strict=True)
    ]
    (found,) = stand([each for row in rows for each in row])
    assert (found.name, found.cells, found.loops) == ("sampled", "10 motions", ["a"])
    assert [sorted(found.labels[at] for at in group.rows) for group in found.standing.groups] == [
        ["a/x", "b/x"],
        ["c/x"],
    ]
    assert found.group(2) == 2 and found.best("c") == 2 and found.best("z") is None
    ratio, reverse = found.times_better(0, 2), found.times_better(2, 0)
    assert ratio.value == pytest.approx(2.0, rel=0.03) and ratio.low < ratio.value < ratio.high
    assert reverse.value == pytest.approx(1.0 / ratio.value)
    assert ratio.value == pytest.approx(paired_ratio(found.scores[2], found.scores[0], 1).value)


def test_classes_come_in_their_order_and_each_has_its_own_loops() -> None:
    rows = [each for loop in ("soft", "plain", "other") for each in compared("a/x", [1e-3], loop)]
    found = stand(rows, "{soft: {plant: {stiffness_scale: 0.8}}, plain: {}, other: {plant: {payload: 0.1}}}")
    assert [(each.name, each.loops) for each in found] == [("sampled", ["plain"]), ("off-nominal", ["soft", "other"])]
    assert [each.cells for each in found] == ["1 motion", "2 motions"]


def test_what_swings_or_fails_is_in_no_group_and_what_does_not_arrive_is_told() -> None:
    rows = compared("sound/x", [1e-3, 2e-3]) + compared("swings/x", [1e-4, 1e-4], oscillation=0.01)
    failing = compared("fails/x", [1e-5, 1e-5])
    failing[1] = replace(failing[1], repeated=repeated("fails/x", [np.nan], failed=1))
    short = [replace(each, repeated=_short(each.repeated)) for each in compared("short/x", [1e-2, 1e-2])]
    (found,) = stand([*rows, *failing, *short])
    assert [found.labels[at] for group in found.standing.groups for at in group.rows] == ["sound/x", "short/x"]
    assert {found.labels[at] for at in found.standing.unreliable} == {"swings/x", "fails/x"}
    assert found.swing[1] == 0.01 and found.away.tolist() == [0, 0, 0, 2] and found.scores[2, 1] == np.inf


def _short(given: Repeated) -> Repeated:
    """The same that ends at half of what is asked."""
    course = given.first.trajectory
    halved = replace(given.first, trajectory=replace(course, theta=0.5 * course.theta))
    return replace(given, first=halved)


def test_control_is_judged_without_a_network_where_it_can_be() -> None:
    both = compared("a/x", [1e-3]) + compared("a/x", [1.0], inverse="network")
    assert stand(both)[0].scores.tolist() == [[1e-3]]
    assert stand(compared("a/x", [1.0], inverse="network"))[0].scores.tolist() == [[1.0]]


@pytest.mark.parametrize(("ahead", "groups"), [(ALIKE * 1.001, 2), (ALIKE * 0.999, 1)])
def test_of_few_motions_a_row_is_behind_only_where_it_is_in_every_one(ahead: float, groups: int) -> None:
    best = np.array([1.0, 3.0, 0.2])
    found = standing([best, best * ahead], np.zeros((2, 3), bool), 90.0, 0, drawn=False)
    assert len(found.groups) == groups and not found.unreliable
    mixed = standing([best, best * [10.0, 10.0, 0.5]], np.zeros((2, 3), bool), 90.0, 0, drawn=False)
    assert [group.rows for group in mixed.groups] == [[0, 1]], "ahead on two of three tells nothing"
