"""The table of recommended rigs: what counts as kept, and which command is run for which finalist."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from tests.commands.recommended_rigs import Verdict, _command, drawn, page, verdict

KEPT: dict[str, Any] = {
    "use": "ct-dob (tuned)", "printed": [0.05, 0.14], "rmse": 0.1, "swing": 0.19, "others": [{"rmse": 0.09}],
}  # fmt: skip


@pytest.mark.parametrize(
    ("changed", "broken"),
    [
        ({}, ""), ({"swing": 0.21}, "rests"),
        ({"printed": [0.05, 0.09]}, "within"), ({"printed": [0.11, 0.2]}, "within"),
        ({"printed": [0.04, 0.121]}, "narrow"), ({"others": [{"rmse": 0.5}, {"rmse": 0.079}]}, "near"),
        ({"others": [{"stopped": "rate"}, {"rmse": 0.081}]}, ""), ({"others": []}, ""),
    ],
)  # fmt: skip
def test_a_wrist_keeps_each_of_four_promises_up_to_its_limit(changed: dict[str, Any], broken: str) -> None:
    found = verdict(KEPT | changed)
    assert [name for name, holds in found._asdict().items() if not holds] == [broken] * bool(broken)


def test_a_trial_that_is_stopped_keeps_nothing_but_the_width_of_its_range() -> None:
    stopped = {name: KEPT[name] for name in ("use", "printed", "others")} | {"stopped": "angle beyond"}
    assert verdict(stopped) == Verdict(False, False, True, False)
    text = page([(0, KEPT), (1, stopped), (2, {"refused": "all swing"})], 4, 1)
    assert "Of 2 with a recommendation" in text and "- 1 swing at rest by at most 0.2 deg" in text
    assert text.count("| yes |") == 1 and "**not rests, not within, not near**" in text and "none: all swing" in text
    assert (
        "Wrists in one plane" in text
        and "has tried 3 of 20" in text
        and "4 more were drawn that no rig can home" in text
    )


def test_the_other_finalists_are_run_by_the_printed_command_with_the_file_of_their_gains() -> None:
    candidates = [
        SimpleNamespace(file="data/controllers/a-tuned.yaml"),
        SimpleNamespace(file="data/controllers/b.yaml"),
    ]
    typed = "wristctl hw-run --seed 3 '/a run/data/recommended.yaml'"
    result: Any = SimpleNamespace(next_command=typed, best_row=0, candidates=candidates)
    assert _command(result, 0) == ["wristctl", "hw-run", "--seed", "3", "/a run/data/recommended.yaml"]
    assert _command(result, 1)[-1] == "/a run/data/controllers/b.yaml"


def test_wrists_are_drawn_by_their_number_within_what_the_page_says() -> None:
    wrists = [drawn(number) for number in range(200)]
    assert drawn(7) == wrists[7] and len(set(wrists)) == 200
    for values, low, high in zip(zip(*wrists, strict=True), (0.06, 0.2, 0.0), (0.14, 3.0, 0.5), strict=True):
        assert low <= min(values) < low + 0.1 * (high - low) and high - 0.1 * (high - low) < max(values) <= high
