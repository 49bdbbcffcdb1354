"""The answer in words: who is best where, who fails, what the paper's law ranks, within a terminal."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from wristctl.commands.compare.answer import LADDER, LINES, answer_lines, wrapped
from wristctl.commands.printed_table import COLUMNS, two
from wristctl.comparison.bootstrap import geometric_mean, penalised
from wristctl.comparison.class_standing import ClassStanding
from wristctl.comparison.combinations import CLASSES
from wristctl.comparison.model_confidence_set import LEAST_PAIRS
from wristctl.comparison.tie_groups import standing

ROWS = ("mrac/default", "smc/exchanged", "smc/printed", "pid/printed", "gvsc/default", "nc/default")
RUNGS = tuple(f"{name}/default" for name in LADDER)
RMSE = dict(zip((*ROWS, *RUNGS), (1e-5, 4e-3, 0.3, 3e-3, 5e-3, 2e-3, 1e-1, 1e-3, 2e-4, 1e-4, 1e-4), strict=True))


def stands(
    name: str = "sampled",
    rmse: dict[str, float] | None = None,
    swings: tuple[str, ...] = (),
    away: tuple[str, ...] = (),
    strained: tuple[str, ...] = (),
    motions: int = 12,
    chatters: tuple[str, ...] = (),
    unconverged: tuple[str, ...] = (),
) -> ClassStanding:
    """Rows on so many motions, each its RMSE times what all share."""
    errors = RMSE if rmse is None else rmse
    rng = np.random.default_rng(5)
    shared, own = rng.normal(0.0, 0.5, motions), 0.02 * rng.standard_normal((len(errors), motions))
    scores = np.array(list(errors.values()))[:, None] * np.exp(shared + own)
    labels = list(errors)
    swing = np.array([0.05 if label in swings else 0.0 for label in labels])
    peak = np.array([70.0 if label in strained else 0.0 for label in labels])
    short = np.array([motions if label in away else 0 for label in labels])
    slams = np.array([300.0 if label in chatters else 0.0 for label in labels])
    drifts = np.array([label in unconverged for label in labels])
    holds = {"limit cycle": swing > 0.0, "chatters": slams > 0.0, "not converged": drifts}
    swinging = np.repeat(np.any(list(holds.values()), axis=0)[:, None], motions, axis=1)
    return ClassStanding(
        name, f"{motions} motions", labels, ["a"], scores,
        standing(scores, swinging, 0, short=short > 0, unphysical=peak > 0.0),
        [geometric_mean(each, 0) for each in penalised(scores)], swing, peak, short, motions, slams,
        {name: motions * each for name, each in holds.items()},
    )  # fmt: skip


def test_the_best_stands_first_with_its_interval_and_what_it_buys() -> None:
    lines = answer_lines([stands()])
    assert lines[2].startswith("sampled (12 motions): ") and "RMSE [deg]" in lines[0]
    assert re.search(r"1\. mrac 0\.001 \[<0\.001, \S+\]", lines[2])
    said = " ".join(" ".join(lines).split())
    assert re.search(r"errors over mrac's: (pid|smc)-dob x5\.\d+, feedforward x5\d00 \[", said), "of 0.001 deg"
    assert "smc/exchanged 7/10" in said, "of the 10 places of 11 rows, one of which two share"


def test_the_paper_is_answered_by_name() -> None:
    """What becomes of printed gains in each class adds up to all classes."""
    said = " ".join(answer_lines([stands(away=("smc/printed",)), stands("pushed", swings=("pid/printed",))]))
    assert "smc does not arrive in 1, has a place in 1 of 2 classes" in said
    assert "pid has a place in 1, fails, swings or chatters in 1" in said
    assert "the paper's order (least RMSE first: smc, mrac, pid, gvsc, nc) holds in 0 of 2 classes" in said
    order = dict(
        zip(("smc/tuned", "mrac/default", "pid/tuned", "gvsc/default", "nc/default"), (1, 2, 3, 4, 5), strict=True)
    )
    theirs = stands(rmse={label: 1e-3 * value for label, value in order.items()})
    assert "holds in 1 of 2 classes (sampled)" in " ".join(answer_lines([theirs, stands("pushed")]))
    both = {"smc/printed": 1e-3, "feedforward/default": 1e-2}
    assert "smc has a place in 1 of 1 classes" in " ".join(answer_lines([stands(rmse=both)]))


def test_limit_cycles_failures_and_short_ends_are_named_with_how_often() -> None:
    one = stands(swings=("pid/printed",), away=("smc/printed",), strained=("gvsc/default",))
    lost = " ".join(answer_lines([one]))
    assert "limit cycle: pid/printed +-2.9 deg; does not arrive: smc/printed; no tendon bears it: gvsc 70 N" in lost
    scores, swings = one.scores.copy(), np.zeros(one.scores.shape, bool)
    scores[4, :5], swings[4, 3:8] = np.inf, True
    counts = {"limit cycle": np.full(11, 3), "chatters": np.zeros(11, int), "not converged": np.zeros(11, int)}
    half = replace(one, scores=scores, standing=standing(scores, swings, 0), swing=np.full(11, 0.05), unsound=counts)
    assert "fails: gvsc 5/12 (+-2.9 deg in 3/12)" in " ".join(answer_lines([half])), "each motion once"


def test_rows_that_chatter_or_have_not_converged_stand_in_no_place_and_are_named_so() -> None:
    one = stands(swings=("smc/printed",), chatters=("pid/printed", "smc/printed"), unconverged=("gvsc/default",))
    said = " ".join(" ".join(answer_lines([one])).split())
    assert "limit cycle: smc/printed +-2.9 deg (chatters 300/s in 12/12)" in said
    assert "chatters: pid/printed 300/s; not converged: gvsc" in said and "+-0 deg" not in said
    assert {one.standing.fate(one.labels.index(row)) for row in ("pid/printed", "gvsc/default")} == {"unreliable"}


def test_rows_that_tie_are_joined() -> None:
    alike = {"a/default": 1e-3, "b/default": 1e-3, "c/default": 5e-3}
    (line,) = [each for each in answer_lines([stands(rmse=alike)]) if "1." in each]
    assert re.search(r"1\. [ab] \S+ \[.*\] = [ab] \S+ 2\. c", line.replace(";", ""))


def test_what_too_few_motions_tell_is_no_tie_and_has_no_number() -> None:
    apart = {"a/default": 1e-3, "b/default": 1e-1}
    said = " ".join(" ".join(answer_lines([stands(rmse=apart, motions=3)])).split())
    block = said[said.index("sampled (3 motions)") :]
    assert f"n=3, {LEAST_PAIRS} at least" in block and "--repetitions" in block
    assert " = " not in block and "1." not in block.replace("1.0", "") and "a 0.0" in block and "b " in block


def test_errors_that_nobody_can_measure_are_equal_and_said_to_be_less() -> None:
    tiny = {"a/default": 1e-9, "b/default": 1e-7, "c/default": 5e-3}
    (line,) = [each for each in answer_lines([stands(rmse=tiny)]) if "1." in each]
    assert "1. a <0.001 = b <0.001" in line
    said = " ".join(answer_lines([stands(rmse=tiny)]))
    assert "errors over 0.001 deg: c x2" in said and "a's" not in said, "no ratio of what nobody can measure"


def test_rows_shown_left_out_and_without_a_place_add_up_to_all_rows() -> None:
    """However little room there is."""
    swinging, away, strained = ("pid/printed", "nc/default"), ("smc/printed",), ("gvsc/default",)
    for classes in (1, 5, 10):
        names = [*CLASSES, *(f"{name}, steps" for name in CLASSES)][:classes]
        lines = answer_lines([stands(name, None, swinging, away, strained) for name in names])
        assert len(lines) <= LINES and all(any(line.startswith(f"{name} (") for line in lines) for name in names)
    (first, *_) = names
    text = "\n".join(answer_lines([stands(first, None, swinging, away, strained)]))
    block = text[text.index(f"{first} (12 motions)") : text.index("errors over")]
    shown = [label for label in RMSE if re.search(rf"(^|[ =]){re.escape(called(label))}[ ;]", block.replace("\n", " "))]
    assert len(shown) == len(RMSE) and "more" not in block


def called(label: str) -> str:
    return label.removesuffix("/default")


@settings(max_examples=25, deadline=None)
@given(
    st.integers(1, 5),
    st.lists(st.text("abcdefgh-", min_size=1, max_size=30), min_size=1, max_size=18, unique=True),
    st.integers(0, 1000),
)
def test_an_answer_fits_a_terminal_whatever_is_compared(classes: int, laws: list[str], seed: int) -> None:
    rng = np.random.default_rng(seed)
    rmse = {f"{law}/g{k}": float(10.0 ** rng.uniform(-6, 0)) for k, law in enumerate(laws)}
    swings, away = (tuple(label for label in rmse if rng.random() < 0.3) for _ in range(2))
    lines = answer_lines([stands(name, rmse, swings, away) for name in CLASSES[:classes]])
    assert len(lines) <= LINES and max(map(len, lines)) <= max(COLUMNS, 24 + 8 + 35)
    assert all(any(line.startswith(name) for line in lines) for name in CLASSES[:classes])


def test_no_comparison_has_no_answer() -> None:
    assert answer_lines([]) == []


@pytest.mark.parametrize(
    ("value", "said"),
    [(0.0123, "0.012"), (3.14e-5, "3.1e-5"), (15234.0, "15000"), (3.2e7, "3.2e7"), (0.0, "0"), (12.3, "12")],
)
def test_a_number_is_as_short_as_two_digits_are(value: float, said: str) -> None:
    assert two(value) == said


def test_what_does_not_fit_is_counted_and_nothing_else_is_lost() -> None:
    words = [f"w{k}" for k in range(40)]
    assert " ".join(wrapped(words, 9, 60)).replace(";", "").split() == words
    short = wrapped(words, 2, 30)
    shown = " ".join(short).replace(";", "").split()
    assert len(short) == 2 and max(map(len, short)) <= 30
    assert shown[-2:] == [f"+{40 - len(shown[:-2])}", "more"] and shown[:-2] == words[: len(shown) - 2]
    assert wrapped(["a\u00a0b c d e f g h"], 1, 9) == ["a b c ..."], "held together, and shown as a blank"


def test_whoever_swings_is_named_before_places_take_the_room() -> None:
    """With ten classes there are two lines for each: all that swing, fewer places, and how many are left out."""
    swinging = ("pid/printed", "smc/exchanged", "nc/default")
    lines = answer_lines([stands(name, swings=swinging) for name in CLASSES])
    assert len(lines) <= LINES and sum("limit cycle: " in line for line in lines) == 5
    for name in swinging:
        assert sum(line.count(f"{name.removesuffix('/default')} +-2.9 deg") for line in lines) == 5
    assert sum("1. mrac " in line for line in lines) == 5
    many = {f"law{k}/default": 1e-3 * 1.5**k for k in range(14)}
    squeezed = "".join(answer_lines([stands(f"class {k}", many) for k in range(10)]))
    left_out = 0
    for block in squeezed.split("class ")[1:]:
        places = block.split("errors over")[0]
        left = re.search(r"\+(\d+) more", places)
        left_out += left is not None
        assert len(re.findall(r"law\d+ ", places)) + int(left[1] if left else 0) == 14
    assert left_out >= 5
