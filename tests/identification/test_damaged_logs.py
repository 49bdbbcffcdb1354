"""Damaged logs are met with a finding that names the damage, or give the numbers of the sound log."""

from __future__ import annotations

import numpy as np
import pytest

import tests.identification.damaged_logs as damages
from tests.identification.damaged_logs import DAMAGES, KINDS, Finding, damaged, judged, made, outcome, page, unchanged

# Two of each damage, on logs of all kinds; those that no look names are fitted.
NUMBERS = (2, 5, 16, 27, 30, 31, 35, 42, 44, 47, 50, 53, 67, 68, 79, 83, 106, 128, 149, 151)
SOUND = Finding("", [], {"gain": (1.0, 0.9, 1.1), "delay": (0.0, 0.0, 0.01)})


@pytest.mark.slow
@pytest.mark.parametrize("number", NUMBERS)
def test_a_damaged_log_is_named_or_gives_the_numbers_of_the_sound_one(number: int) -> None:
    row = outcome(number)
    assert row["verdict"] != "wrong", (row["what"], row["finding"])


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.words)
def test_sound_logs_stay_as_they_are(kind: damages.Kind) -> None:
    assert unchanged(made(kind, 0).table, kind) and unchanged(made(kind, 1).table, kind)


def test_every_damage_changes_the_log_and_says_how() -> None:
    names = {damaged(number)[1] for number in NUMBERS if KINDS.index(damaged(number)[0]) == 0}
    assert names <= DAMAGES.keys()
    table = made(KINDS[0], 0).table
    for damage in DAMAGES.values():
        changed, words, _ = damage.change(table, np.random.default_rng(0))
        assert not changed.equals(table) and words


def test_a_number_that_is_told_and_misses_the_sound_logs_is_wrong_and_all_else_is_not() -> None:
    def verdict(refused: str = "", remarks: tuple[str, ...] = (), **told: tuple[float, float, float]) -> str:
        return judged(Finding(refused, remarks, told), lambda: SOUND, "gap", {"delay": 0.2}).verdict

    late = (0.2, 0.19, 0.21)
    assert verdict("a gap") == "named" and verdict("no motion") == "refused"
    assert verdict(remarks=("a gap",), gain=(3.0, 2.9, 3.1)) == "named"
    assert verdict(gain=(1.05, 1.0, 1.1), delay=late) == "same"
    assert verdict(gain=(1.2, 0.9, 1.5), delay=late) == "wider"
    assert verdict(gain=(1.05, 1.0, 1.1)) == "untold"
    assert verdict(remarks=("another",), gain=(1.2, 1.15, 1.25), delay=late) == "wrong"
    assert verdict(gain=(1.0, 0.9, 1.1), delay=(0.0, 0.0, 0.01)) == "wrong"


def test_the_page_counts_each_damage_and_lists_what_is_wrong() -> None:
    row = {"kind": "k", "damage": "a gap", "what": "0.5 s without rows", "finding": "gain 2"}
    text = page([row | {"verdict": "wrong"}, row | {"verdict": "named"}], [])
    assert "| a gap | 1 | 0 | 0 | 0 | 0 | 1 |" in text and "| 0.5 s without rows | k | gain 2 |" in text
