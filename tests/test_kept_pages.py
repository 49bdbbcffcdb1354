"""Pages of what was tried for hours are what is kept of it, and a later try adds to it."""

from __future__ import annotations

import argparse
import math
from pathlib import Path

import pytest

from tests.commands import expected_ranges, recommended_rigs
from tests.drawn_rigs import COMMITTED, Kept, ended, tried
from tests.trial import largest_pulls, sound_rigs
from tests.trial.single_trials import Ended

ROOT = Path(__file__).parents[1]


def kept_in(name: str) -> argparse.Namespace:
    return argparse.Namespace(kept=ROOT / COMMITTED / name)


def test_each_page_is_made_of_what_is_kept() -> None:
    """So that no figure of them is one that somebody has typed."""
    ends = {number: Ended(*came) for number, came in ended(kept_in("sound-rigs")).items()}
    assert sound_rigs.PAGE.read_text() == sound_rigs.page(ends)
    pulls = largest_pulls.all_of(Kept(ROOT / COMMITTED / "largest-pulls.jsonl"))
    assert largest_pulls.PAGE.read_text() == largest_pulls.page(*pulls)
    assert recommended_rigs.PAGE.read_text() == recommended_rigs.page([*ended(kept_in("recommended-rigs")).items()])
    ranges = kept_in("expected-ranges")
    rows, truths, facts = ended(ranges), ended(ranges, "emulated"), ended(ranges, "facts")
    order = {number: rows[number] for number in expected_ranges.WRISTS if number in rows}
    assert expected_ranges.PAGE.read_text() == expected_ranges.page(order, truths, facts)


def test_what_has_ended_is_not_tried_again_and_stands_in_order(tmp_path: Path) -> None:
    asked, begun = argparse.Namespace(kept=tmp_path / "some", first=2, count=2), list[int]()

    def trial(number: int) -> list[float]:
        begun.append(number)
        return [float(number), math.nan]

    assert [number for number, _ in tried(asked, trial)] == [2, 3] == begun
    asked.first, asked.count = 0, 3
    assert [came[0] for _, came in tried(asked, trial)] == [0.0, 1.0, 2.0] and begun == [2, 3, 0, 1]
    assert [*ended(asked)] == [0, 1, 2, 3] and math.isnan(ended(asked)[3][1])
    assert ended(asked, "beside") == {}


def test_of_what_was_tried_twice_the_last_counts(tmp_path: Path) -> None:
    kept = Kept(tmp_path / "kept.jsonl")
    for came in ("stopped", "ok"):
        kept.add("a fault", came)
    assert kept.all() == {"a fault": "ok"}


@pytest.mark.parametrize(
    ("outcome", "stopped"),
    [("ok", 0), ("stopped: a jump", 1), (f"{sound_rigs.REFUSED}: 45 N", 0), (f"{sound_rigs.SLIPPED}: 46 N", 0)],
)
def test_only_sound_rigs_count_as_stopped(outcome: str, stopped: int) -> None:
    assert len(sound_rigs.stopped_of({3: Ended(outcome, "", math.nan, 9.0, 0.01)})) == stopped
