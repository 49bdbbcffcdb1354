"""The table of recommended rigs: what counts as kept, and which command is run for which finalist."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from tests.commands.recommended_rigs import Verdict, _command, drawn, page, right, verdict
from wristctl.commands.inputs import Inputs
from wristctl.commands.recommend.command import plan
from wristctl.errors import UserError

CALM: dict[str, Any] = {"rmse": 0.1, "swing": 0.19}
KEPT: dict[str, Any] = {
    "use": "ct-dob (tuned)", "printed": [0.05, 0.14], "rigs": {"0.7": CALM, "1": CALM},
    "others": [{"0.7": {"rmse": 0.09}, "1": {"rmse": 0.2}}],
}  # fmt: skip


@pytest.mark.parametrize("springs", ["0.7", "1"])
@pytest.mark.parametrize(
    ("changed", "broken"),
    [
        ({}, ""), ({"swing": 0.21}, "rests"), ({"swing": 0.2}, ""),
        ({"rmse": 0.141}, "within"), ({"rmse": 0.049}, "within"), ({"rmse": 0.06}, ""),
    ],
)  # fmt: skip
def test_a_wrist_keeps_what_is_promised_with_either_springs(springs: str, changed: dict[str, Any], broken: str) -> None:
    found = KEPT | {"rigs": KEPT["rigs"] | {springs: CALM | changed}, "others": []}
    assert [name for name, holds in verdict(found)._asdict().items() if not holds] == [broken] * bool(broken)


@pytest.mark.parametrize(
    ("others", "near"),
    [
        ([(0.5, 0.5), (0.079, 0.5)], False), ([(0.5, 0.5), (0.5, 0.079)], False), ([(0.081, 0.081)], True), ([], True),
    ],
)  # fmt: skip
def test_the_best_finalist_is_one_with_the_same_springs(others: list[tuple[float, float]], near: bool) -> None:
    rigs = [{"0.7": {"rmse": weak}, "1": {"rmse": believed}} for weak, believed in others]
    assert verdict(KEPT | {"others": rigs}) == Verdict(True, True, True, near)
    halted = [{"0.7": {"stopped": "rate"}, "1": {"stopped": "rate"}}, *rigs]
    assert verdict(KEPT | {"others": halted}).near == near


def test_a_range_is_narrow_up_to_a_factor_of_three() -> None:
    assert verdict(KEPT | {"printed": [0.05, 0.15]}).narrow and not verdict(KEPT | {"printed": [0.04, 0.121]}).narrow


def test_a_trial_that_is_stopped_keeps_nothing_but_the_width_of_its_range() -> None:
    stopped = KEPT | {"rigs": {"0.7": CALM, "1": {"stopped": "angle beyond"}}}
    assert verdict(stopped) == Verdict(False, False, True, False)
    text = page([(0, KEPT), (1, stopped), (2, {"not_tried": "it buckles"}), (3, {"refused": "all swing"})])
    assert "Of 2 with a recommendation" in text and "- 1 swing at rest by at most 0.2 deg" in text
    assert (
        text.count("| yes |") == 2 and text.count("| **no** |") == 1 and "**not rests, not within, not near**" in text
    )
    assert "| 0.1, stopped: angle beyond |" in text and "| 0.09, 0.1 |" in text
    assert (
        "none: all swing" in text
        and "has tried 4 of 20" in text
        and "1 of 4 fall over" in text
        and "and no other: 3 of 4 are treated so" in text
    )


def test_the_page_says_on_which_side_of_the_printed_range_errors_are() -> None:
    outside = {"0.7": CALM | {"rmse": 0.04}, "1": CALM | {"rmse": 0.15}}
    assert "Of the 2 errors 0 are below the printed range, 0 above." in page([(0, KEPT)])
    rows = [(0, KEPT | {"rigs": outside}), (4, KEPT | {"rigs": outside | {"1": {"stopped": "rate"}}})]
    assert "Of the 3 errors 2 are below the printed range, 1 above." in page(rows)


def test_the_other_finalists_are_run_by_the_printed_command_with_the_file_of_their_gains() -> None:
    candidates = [
        SimpleNamespace(file="data/controllers/a-tuned.yaml"),
        SimpleNamespace(file="data/controllers/b.yaml"),
    ]
    typed = "wristctl hw-run --seed 3 '/a run/data/recommended.yaml'"
    result: Any = SimpleNamespace(next_command=typed, best_row=0, candidates=candidates)
    springs = ["--set", "hw-run.bench.plant.stiffness_scale=0.7"]
    assert _command(result, 0, 0.7) == ["wristctl", "hw-run", "--seed", "3", "/a run/data/recommended.yaml", *springs]
    assert _command(result, 1, 1.0)[4:] == ["/a run/data/controllers/b.yaml", "--set", springs[1].replace("0.7", "1")]


def test_wrists_are_drawn_by_their_number_within_what_the_page_says() -> None:
    wrists = [drawn(number) for number in range(200)]
    assert drawn(7) == wrists[7] and len(set(wrists)) == 200
    for kind in ((tendons, hanging) for tendons in ("three", "four") for hanging in (True, False)):
        assert sum((each.tendons, each.hanging) == kind for each in wrists[:20]) == 5
    for values, low, high in zip(list(zip(*wrists, strict=True))[2:], (0.06, 0.3, 0.1), (0.12, 1.5, 0.5), strict=True):
        assert low <= min(values) < low + 0.1 * (high - low) and high - 0.1 * (high - low) < max(values) <= high


def test_only_upright_wrists_fall_over_and_just_these_are_refused() -> None:
    fall = [number for number in range(20) if drawn(number).buckles]
    assert fall and not any(drawn(number).hanging for number in fall)
    for number in [*fall, 3, 7, 12]:
        try:
            plan(drawn(number).study, Inputs({}))
        except UserError as error:
            assert right(number, {"not_tried": str(error.what)}) and "buckles" in str(error.what)
            assert not right(3, {"not_tried": str(error.what)})
        else:
            assert right(number, {"rigs": {}}) and number not in fall
