"""Families of worlds: what is drawn, from what, and that nothing else changes it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pydantic import ValidationError
from scipy import stats

from wristctl.config.families import Family, drawn_value
from wristctl.config.loop import Reference
from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError
from wristctl.simulation.drawn_worlds import drawn_cases, streams_of, world_of
from wristctl.simulation.worlds import World
from wristctl.study_files.load import load_study

WRIST = WristParameters()
SCENARIOS = Path(__file__).parents[2] / "experiments" / "scenarios"
FAMILY = Family.model_validate({
    "loop": {"control_period": 5e-3, "actuator": {"level": "tendon"}, "sensor": {"level": "camera"}},
    "draw": {
        "plant.stiffness": "x0.5..2", "actuator.tendon_stiffness": "8e3..4e4 log", "plant_segments": (1, 4),
        "plant.actuator.tendon_stiffness": "x0.7..1.4 log", "reference.angle_deg": "-45..45",
    },
    "references": ({"duration": 0.5}, {"kind": "sine"}), "horizon": 2.5,
})  # fmt: skip


def test_leaves_are_spread_as_they_are_said_to_be() -> None:
    """Kolmogorov and Smirnov against even and log-even draws; a list's values are alike in number."""
    worlds = [World(world_of(FAMILY, "f", "test", 3, k), WRIST) for k in range(400)]
    stiffness = np.array([each.plant.stiffness / WRIST.stiffness for each in worlds])
    assert stats.kstest(stiffness, stats.uniform(0.5, 1.5).cdf).pvalue > 1e-3
    believed = np.array([each.loop.actuator.tendon_stiffness for each in worlds])
    assert stats.kstest(np.log(believed), stats.uniform(np.log(8e3), np.log(5.0)).cdf).pvalue > 1e-3
    true = np.array([each.actuator.tendon_stiffness for each in worlds]) / believed
    assert 0.7 <= true.min() < 0.72 and 1.37 < true.max() <= 1.4 and abs(np.corrcoef(true, believed)[0, 1]) < 0.2
    assert 150 < sum(each.loop.plant_segments == 1 for each in worlds) < 250


def test_splits_and_seeds_are_other_worlds_and_the_same_ones_are_the_same() -> None:
    def stiffness(split: str, seed: int, name: str = "f") -> list[object]:
        return [world_of(FAMILY, name, split, seed, k).plant.stiffness for k in range(5)]

    known = stiffness("test", 0)
    assert known == stiffness("test", 0)
    for other in (stiffness("tune", 0), stiffness("validation", 0), stiffness("test", 1), stiffness("test", 0, "g")):
        assert not set(known) & set(other)


def test_another_leaf_or_reference_changes_nothing_for_those_that_were_there() -> None:
    more = FAMILY.model_copy(
        update={"draw": FAMILY.draw | {"plant.payload": "0..0.1"}, "references": (*FAMILY.references, Reference())}
    )
    before, after = (drawn_cases(each, "f", "test", 0, 3, WRIST) for each in (FAMILY, more))
    kept = [case for number, case in enumerate(after) if number % 3 < 2]
    for old, new in zip(before, kept, strict=True):
        assert old.loop.plant.stiffness == new.loop.plant.stiffness and old.stream == new.stream
        assert np.array_equal(old.motion.theta_ref, new.motion.theta_ref) and new.loop.plant.payload > 0.0


def test_each_world_meets_every_motion_with_noise_of_its_own() -> None:
    cases = drawn_cases(FAMILY, "f", "test", 0, 4, WRIST)
    assert len(cases) == 8 and len({case.stream for case in cases}) == 8
    assert [case.cell for case in cases] == list(range(8))
    assert all(cases[k].loop is cases[k + 1].loop for k in range(0, 8, 2))
    ends = {round(float(np.degrees(case.motion.theta_ref[-1])), 6) for case in cases[::2]}
    assert len(ends) == 4 and max(map(abs, ends)) <= 45.0
    assert [case.rests for case in cases] == [True, False] * 4
    named = streams_of(FAMILY, "f", "test")
    assert len(named) == len(set(named)) == 4 + 2 + 2


@settings(max_examples=50)
@given(st.floats(0.0, 1.0, exclude_max=True))
def test_a_value_is_within_what_it_is_drawn_from(share: float) -> None:
    assert 2.0 <= drawn_value("2..8 log", share) <= 8.0 + 1e-12
    assert -3.0 <= drawn_value("-3..1e-2", share) <= 1e-2
    assert 0.7 <= float(drawn_value("x0.7..1.3", share)[1:]) <= 1.3
    assert drawn_value((4, 8), share) == (4 if share < 0.5 else 8)


@pytest.mark.parametrize(
    ("draw", "said"),
    [
        ("{plant.stiffnes: x0.7..1.3}", "plant.stiffnes"),
        ("{plant.stiffness: x1.3..0.7}", "its lower end first, or a list of values, not x1.3..0.7"),
        ("{plant.stiffness: x-1..2}", "not x-1..2"),
        ("{plant.payload: 0..1 log}", "not 0..1 log"),
        ("{plant.payload: wide}", "not wide"),
        ("{plant_segments: []}", "plant_segments is drawn from nothing"),
        ("{plant_segments: [4, 9]}", "plant_segments"),
        ("{reference.kind: [sine, wobble]}", "reference.kind"),
        ("{sensor.delay_frames: -1..2}", "sensor.delay_frames"),
    ],
)
def test_a_draw_that_cannot_be_is_named(draw: str, said: str) -> None:
    with pytest.raises(UserError) as caught:
        load_study([], [f"families={{odd: {{draw: {draw}}}}}"], "tune")
    assert said in str(caught.value) and "families.odd" in str(caught.value)


@pytest.mark.parametrize("worlds", ["{family: f, split: sealed}", "{family: f, sealed: 3}"])
def test_a_sealed_split_goes_with_its_seed(worlds: str) -> None:
    with pytest.raises(UserError, match="split: sealed goes with its seed"):
        load_study([], [f"worlds={worlds}"], "compare")


@pytest.mark.parametrize("file", sorted(SCENARIOS.glob("*.yaml")), ids=lambda file: file.stem)
def test_the_families_that_are_shipped_are_drawn(file: Path) -> None:
    ((name, family),) = load_study([file]).families.items()
    assert name == file.stem and family.about
    assert len(drawn_cases(family, name, "test", 0, 2, WRIST)) == 2 * len(family.references)


def test_settings_that_are_drawn_together_come_from_one_row() -> None:
    rows = ({"plant.stiffness": 0.5, "plant.damping": 0.05}, {"plant.stiffness": 0.9, "plant.damping": 0.12})
    family = Family(together=rows, draw={"plant.payload": "0..0.1"})
    worlds = [world_of(family, "posterior", "test", 0, number).plant for number in range(40)]
    pairs = {(plant.stiffness, plant.damping) for plant in worlds}
    assert pairs == {(0.5, 0.05), (0.9, 0.12)}
    assert len({plant.payload for plant in worlds}) == 40
    apart = Family(draw={"plant.payload": "0..0.1"})
    assert [world_of(apart, "posterior", "test", 0, k).plant.payload for k in range(3)] == [
        plant.payload for plant in worlds[:3]
    ]
    with pytest.raises(ValidationError, match="row 1 of together is no world"):
        Family(together=({"plant.stiffnes": 0.5},))
